-- Statistics of leaks and classes of waterproofing by GB 50108-2008, over any stretches of a survey.

-- Limits of GB 50108-2008, table 3.2.1, as far as a scan can tell: it shows where the lining is wet, not how much water
-- flows. NULL is no limit.
CREATE OR REPLACE VIEW tunnel_api.waterproof_limit AS
SELECT c.id, c.wet_ratio, c.patch_area, c.patches_per_100, c.description
  FROM (VALUES
    (1, NULL::float8, NULL::float8, 0, 'No leak, no wet patch'),
    (2, 0.002, 0.2, 3, 'No leak, few wet patches (tunnels: wet area at most 2 in 1000)'),
    (3, NULL, 0.3, 7, 'Few leaks, no running water'),
    (4, NULL, NULL, NULL, 'Leaks, no running water')) AS c (id, wet_ratio, patch_area, patches_per_100, description);
COMMENT ON VIEW tunnel_api.waterproof_limit IS
    'Classes of waterproofing (GB 50108-2008, table 3.2.1) with those limits that a scan can check. The volumes of water that the standard limits as well, in L/(m² d), it cannot';
COMMENT ON COLUMN tunnel_api.waterproof_limit.id IS 'Class, 1 the driest';
COMMENT ON COLUMN tunnel_api.waterproof_limit.wet_ratio IS 'Greatest wet area, of the lining';
COMMENT ON COLUMN tunnel_api.waterproof_limit.patch_area IS 'Greatest area of a patch, m²';
COMMENT ON COLUMN tunnel_api.waterproof_limit.patches_per_100 IS 'Most patches in any 100 m² of lining';
COMMENT ON COLUMN tunnel_api.waterproof_limit.description IS 'What the class allows';


-- Statistics of stretches of a survey, given by where they begin, in growing order, and end; they do not overlap.
--
-- Leaks are those of kind leak that the last detection found and nobody rejected. One that an end cuts counts by its part
-- in wet_area, as one patch, and whole where the size of a patch matters: a spot is no smaller for being cut by a limit.
--
-- Any 100 m² of lining, seen or not: a window of tunnel slid along the stretch, or all of it if it has no more. The lining
-- up to a place takes the part of chainage, so that a leak is an interval [a, b] and every window has a length of 100. One
-- that begins at s holds a leak for s from a - 100 to b: their number changes there only. The area of a leak is spread
-- evenly over its interval; that within a window then changes along straight lines between those places, a and b - 100,
-- and is greatest at one of them. A leak where no lining is known is in no window.
CREATE OR REPLACE FUNCTION tunnel_api.stretch_statistics(survey_id int, starts float8[], ends float8[])
RETURNS TABLE (
    n int, chainage_from float8, chainage_to float8, lining_area float8, seen_area float8, seen_share float8,
    wet_area float8, wet_ratio float8, patches int, largest_area float8, largest_leak bigint,
    window_patches int, window_from float8, window_to float8, window_leaks bigint[], window_wet_area float8, class int)
LANGUAGE sql STABLE PARALLEL SAFE STRICT
ROWS 100
SECURITY DEFINER SET search_path = pg_catalog, public, pg_temp
SET jit = off
SET enable_nestloop = off  -- how few or many rows there are is not known when it is planned
AS $$
    WITH sums AS MATERIALIZED (
        SELECT c.* FROM tunnel_api.coverage_sums($1, ($2)[1], ($3)[cardinality($3)]) c
    ), stretch AS MATERIALIZED (
        SELECT q.n::int AS n, q.low, q.high, q.a, q.b, q.seen_b - q.seen_a AS seen,
            least(coalesce(q.length_b - q.length_a, 0), q.high - q.low) / nullif(q.high - q.low, 0) AS looked_at
        FROM sums c
        CROSS JOIN LATERAL unnest($2, $3,
            tunnel_api.interpolate($2, c.chainage, c.lining), tunnel_api.interpolate($3, c.chainage, c.lining),
            tunnel_api.interpolate($2, c.chainage, c.seen), tunnel_api.interpolate($3, c.chainage, c.seen),
            tunnel_api.interpolate($2, c.chainage, c.length), tunnel_api.interpolate($3, c.chainage, c.length))
            WITH ORDINALITY AS q (low, high, a, b, seen_a, seen_b, length_a, length_b, n)
    ), roomy AS (
        SELECT s.n, s.a, s.b - 100 AS last FROM stretch s WHERE s.b - s.a > 100
    ), leak AS (
        SELECT l.id, l.area, l.chainage_from AS low, l.chainage_to AS high
        FROM tunnel.anomaly l
        WHERE l.survey_id = $1 AND l.detected AND l.review <> 'rejected' AND coalesce(l.judged, l.kind) = 'leak'
            AND l.chainage_to > ($2)[1] AND l.chainage_from < ($3)[cardinality($3)]
    ), cut AS (
        SELECT s.n, l.id, greatest(l.low, s.low) AS low, least(l.high, s.high) AS high, l.area AS whole,
            CASE WHEN l.low >= s.low AND l.high <= s.high THEN l.area
                 -- few are cut: only they are looked up, the others come from the index alone
                 ELSE l.area * (SELECT ST_Area(ST_ClipByBox2D(a.unrolled, ST_MakeBox2D(
                     ST_MakePoint(s.low, -1e4), ST_MakePoint(s.high, 1e4)))) / ST_Area(a.unrolled)
                     FROM tunnel.anomaly a WHERE a.id = l.id) END AS area
        FROM leak l
        CROSS JOIN LATERAL generate_series(
            greatest(width_bucket(l.low, $2), 1), width_bucket(l.high, $2)) AS i (n)
        JOIN stretch s ON s.n = i.n
        WHERE l.high > s.low AND l.low < s.high
    ), listed AS (
        SELECT array_agg(p.n) AS n, array_agg(p.id) AS id, array_agg(p.low) AS low, array_agg(p.high) AS high,
            array_agg(p.whole) AS whole, array_agg(p.area) AS area
        FROM cut p
    ), patch AS MATERIALIZED (
        SELECT q.n, q.id, q.whole, q.area, q.a, q.b
        FROM listed p CROSS JOIN sums c
        CROSS JOIN LATERAL unnest(p.n, p.id, p.whole, p.area,
            tunnel_api.interpolate(p.low, c.chainage, c.lining), tunnel_api.interpolate(p.high, c.chainage, c.lining))
            AS q (n, id, whole, area, a, b)
    ), total AS (
        SELECT p.n, count(*)::int AS patches, sum(p.area) AS area, max(p.whole) AS largest,
            (array_agg(p.id ORDER BY p.whole DESC, p.id))[1] AS id, array_agg(p.id ORDER BY p.id) AS leaks
        FROM patch p
        GROUP BY p.n
    ), change AS (  -- of the number of patches in a window, by where it begins
        SELECT p.n, greatest(p.a - 100, s.a) AS at, 1 AS step FROM patch p JOIN roomy s ON s.n = p.n WHERE p.a < p.b
        UNION ALL
        SELECT p.n, p.b, -1 FROM patch p JOIN roomy s ON s.n = p.n WHERE p.a < p.b AND p.b < s.last
    ), counted AS (
        SELECT c.n, c.at, sum(c.step) OVER (along ROWS UNBOUNDED PRECEDING)::int AS patches, lead(c.at) OVER along AS until
        FROM change c
        WINDOW along AS (PARTITION BY c.n ORDER BY c.at, c.step DESC)
    ), crowded AS (
        SELECT DISTINCT ON (c.n) c.n, c.patches, (c.at + coalesce(c.until, s.last)) / 2 AS a
        FROM counted c JOIN roomy s ON s.n = c.n
        ORDER BY c.n, c.patches DESC, c.at
    ), named AS (
        SELECT w.n, array_agg(p.id ORDER BY p.id) AS leaks
        FROM crowded w JOIN patch p ON p.n = w.n
        WHERE p.a < p.b AND p.a <= w.a + 100 AND p.b >= w.a
        GROUP BY w.n
    ), slope AS (  -- of the wet area in a window, by where it begins
        SELECT p.n, e.at, p.area / (p.b - p.a) * e.way AS change
        FROM patch p JOIN roomy s ON s.n = p.n
        CROSS JOIN LATERAL (VALUES (p.a - 100, 1), (p.b - 100, -1), (p.a, -1), (p.b, 1)) AS e (at, way)
        WHERE p.a < p.b
        UNION ALL
        SELECT s.n, e.at, 0 FROM roomy s CROSS JOIN LATERAL (VALUES (s.a), (s.last)) AS e (at)
    ), bend AS (
        SELECT c.n, c.at, sum(c.change) AS change FROM slope c GROUP BY c.n, c.at
    ), risen AS (
        SELECT b.n, b.at, sum(b.change) OVER (along ROWS UNBOUNDED PRECEDING) * (lead(b.at) OVER along - b.at) AS rise
        FROM bend b
        WINDOW along AS (PARTITION BY b.n ORDER BY b.at)
    ), held AS (
        SELECT r.n, r.at, sum(r.rise) OVER (PARTITION BY r.n ORDER BY r.at
                                            ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING) AS area
        FROM risen r
    ), wettest AS (
        SELECT h.n, greatest(max(h.area), 0) AS area
        FROM held h JOIN roomy s ON s.n = h.n
        WHERE h.at BETWEEN s.a AND s.last
        GROUP BY h.n
    ), placed AS (  -- windows in chainage again
        SELECT q.n, q.low, q.high
        FROM (SELECT array_agg(c.n) AS n, array_agg(c.a) AS a, array_agg(c.a + 100) AS b FROM crowded c) w
        CROSS JOIN sums c
        CROSS JOIN LATERAL unnest(w.n, tunnel_api.interpolate(w.a, c.lining, c.chainage),
            tunnel_api.interpolate(w.b, c.lining, c.chainage)) AS q (n, low, high)
    ), result AS (
        SELECT s.n, s.low, s.high, nullif(s.b - s.a, 0) AS lining, s.seen,
            CASE WHEN coalesce(s.looked_at, 0) = 0 THEN 0 ELSE s.seen / nullif(s.b - s.a, 0) * s.looked_at END AS seen_share,
            coalesce(t.area, 0) AS wet, coalesce(t.area, 0) / nullif(s.seen, 0) AS ratio,
            coalesce(t.patches, 0) AS patches, t.largest, t.id, f.*
        FROM stretch s
        LEFT JOIN total t ON t.n = s.n
        LEFT JOIN roomy o ON o.n = s.n
        LEFT JOIN crowded w ON w.n = s.n
        LEFT JOIN placed p ON p.n = s.n
        LEFT JOIN named m ON m.n = s.n
        LEFT JOIN wettest v ON v.n = s.n
        LEFT JOIN LATERAL (
            SELECT coalesce(w.patches, 0) AS crowd, p.low AS crowd_low, p.high AS crowd_high, m.leaks, v.area AS window_wet
            WHERE o.n IS NOT NULL
            UNION ALL
            SELECT coalesce(t.patches, 0), s.low, s.high, t.leaks, coalesce(t.area, 0)
            WHERE o.n IS NULL AND s.b > s.a) f ON true
    )
    SELECT r.n, r.low, r.high, r.lining, r.seen, r.seen_share, r.wet, r.ratio, r.patches, r.largest, r.id,
        r.crowd, r.crowd_low, r.crowd_high, r.leaks, r.window_wet,
        (SELECT min(c.id) FROM tunnel_api.waterproof_limit c
         WHERE r.seen > 0 AND (r.ratio > c.wet_ratio) IS NOT TRUE AND (r.largest > c.patch_area) IS NOT TRUE
            AND (r.crowd > c.patches_per_100 OR (c.patches_per_100 = 0 AND r.patches > 0)) IS NOT TRUE)
    FROM result r
    ORDER BY r.n
$$;
COMMENT ON FUNCTION tunnel_api.stretch_statistics(int, float8[], float8[]) IS
'Statistics of leaks over stretches of a survey that follow one another, as leak_statistics gives them of one.';


CREATE OR REPLACE FUNCTION tunnel_api.leak_statistics(survey text, chainage_from float8, chainage_to float8)
RETURNS TABLE (
    chainage_from float8, chainage_to float8, lining_area float8, seen_area float8, seen_share float8,
    wet_area float8, wet_ratio float8, patches int, largest_area float8, largest_leak bigint,
    window_patches int, window_from float8, window_to float8, window_leaks bigint[], window_wet_area float8, class int)
LANGUAGE sql STABLE PARALLEL SAFE STRICT
ROWS 1
AS $$
    SELECT t.chainage_from, t.chainage_to, t.lining_area, t.seen_area, t.seen_share, t.wet_area, t.wet_ratio, t.patches,
        t.largest_area, t.largest_leak, t.window_patches, t.window_from, t.window_to, t.window_leaks, t.window_wet_area, t.class
    FROM (SELECT tunnel_api.survey_id($1) AS id) s
    CROSS JOIN LATERAL tunnel_api.survey_ends(s.id) e
    CROSS JOIN LATERAL (SELECT greatest($2, e.chainage_from) AS low, least($3, e.chainage_to) AS high) r
    CROSS JOIN LATERAL tunnel_api.stretch_statistics(s.id, ARRAY[r.low], ARRAY[r.high]) t
    WHERE e.chainage_from IS NOT NULL AND r.low < r.high
$$;
COMMENT ON FUNCTION tunnel_api.leak_statistics(text, float8, float8) IS
'Leaks of a survey between two chainages (m), as far as it reaches; of kind leak, found last and not rejected. wet_ratio is wet_area of the lining seen; seen_share that of the lining, in which kilometres without detection count as unseen. A leak that an end cuts counts by its part in wet_area and as one patch; largest_area and largest_leak take leaks whole. window_patches: most patches in any 100 m² of lining, here between window_from and window_to, and which; window_wet_area: greatest wet area in any 100 m² (m²). class: best class of GB 50108-2008 that the seen lining keeps, NULL if nothing was seen.';


CREATE OR REPLACE FUNCTION tunnel_api.waterproof_class(survey text, chainage_from float8, chainage_to float8)
RETURNS TABLE (class int, holds boolean, breaks text[], leaks bigint[], seen_share float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT
ROWS 4
SECURITY DEFINER SET search_path = pg_catalog, public, pg_temp
AS $$
    WITH found AS MATERIALIZED (
        SELECT t.*, (SELECT s.tunnel_id FROM tunnel.survey s WHERE s.name = $1) AS tunnel_id
        FROM tunnel_api.leak_statistics($1, $2, $3) t
    ), leak AS MATERIALIZED (
        SELECT l.id, l.area,
            (SELECT c.label FROM tunnel_api.stationing(s.tunnel_id, (l.chainage_from + l.chainage_to) / 2) c) AS label
        FROM tunnel.anomaly l JOIN tunnel.survey s ON s.id = l.survey_id
        WHERE l.survey_id = tunnel_api.survey_id($1) AND l.detected AND l.review <> 'rejected'
            AND coalesce(l.judged, l.kind) = 'leak' AND l.chainage_to > $2 AND l.chainage_from < $3
    ), breach AS (
        SELECT c.id AS class, 1 AS n, format('wet area is %s ‰ of the lining seen > %s ‰',
                round((1000 * t.wet_ratio)::numeric, 2), 1000 * c.wet_ratio) AS text,
            (SELECT array_agg(l.id) FROM leak l) AS leaks
        FROM found t JOIN tunnel_api.waterproof_limit c ON t.wet_ratio > c.wet_ratio
        UNION ALL
        SELECT c.id, 2, format('patch of %s m² at %s > %s m²%s', round((array_agg(l.area ORDER BY l.area DESC, l.id))[1]::numeric, 3),
                (array_agg(l.label ORDER BY l.area DESC, l.id))[1], c.patch_area,
                CASE WHEN count(*) > 1 THEN format(', the largest of %s', count(*)) END),
            array_agg(l.id)
        FROM leak l JOIN tunnel_api.waterproof_limit c ON l.area > c.patch_area
        GROUP BY c.id, c.patch_area
        UNION ALL
        SELECT c.id, 3, CASE c.patches_per_100 WHEN 0 THEN format('wet patches: %s', t.patches)
                             ELSE format('%s patches in 100 m² between %s and %s > %s', t.window_patches,
                                 tunnel_api.station_label(t.tunnel_id, t.window_from),
                                 tunnel_api.station_label(t.tunnel_id, t.window_to), c.patches_per_100) END,
            CASE c.patches_per_100 WHEN 0 THEN (SELECT array_agg(l.id) FROM leak l) ELSE t.window_leaks END
        FROM found t
        JOIN tunnel_api.waterproof_limit c ON t.window_patches > c.patches_per_100 OR (c.patches_per_100 = 0 AND t.patches > 0)
    )
    SELECT c.id, CASE WHEN b.texts IS NOT NULL THEN false WHEN t.seen_area > 0 THEN true END, coalesce(b.texts, '{}'),
        ARRAY(SELECT DISTINCT unnest(i.leaks) FROM breach i WHERE i.class = c.id ORDER BY 1), t.seen_share
    FROM found t
    CROSS JOIN tunnel_api.waterproof_limit c
    LEFT JOIN LATERAL (SELECT array_agg(i.text ORDER BY i.n) AS texts FROM breach i WHERE i.class = c.id) b ON true
    ORDER BY c.id
$$;
COMMENT ON FUNCTION tunnel_api.waterproof_class(text, float8, float8) IS
'Which classes of waterproofing (GB 50108-2008, table 3.2.1) a survey keeps between two chainages (m): one row a class, with what breaks it and the ids of the leaks that do. It speaks of the lining seen, the share seen_share: what was not seen cannot be certified. holds is NULL where nothing was seen and nothing breaks the class. Volumes of water, which the standard limits as well, cannot be told from a scan.';


CREATE OR REPLACE FUNCTION tunnel_api.ring_statistics(
    survey text, ring_length float8, first_chainage float8, stretch_from float8 DEFAULT '-Infinity',
    stretch_to float8 DEFAULT 'Infinity')
RETURNS TABLE (
    number int, chainage_from float8, chainage_to float8, label text, lining_area float8, seen_share float8,
    wet_area float8, wet_ratio float8, patches int, largest_area float8, class int)
LANGUAGE plpgsql STABLE PARALLEL SAFE STRICT
ROWS 10000
AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := tunnel_api.survey_id(survey);
    tunnel_key constant int := (SELECT s.tunnel_id FROM tunnel_api.survey s WHERE s.id = survey_key);
    extent record;
    starts float8[];
    ends float8[];
    first_whole float8;
    last_whole float8;
BEGIN
    IF NOT (ring_length >= 0.1 AND ring_length < 'Infinity') THEN
        RAISE EXCEPTION 'a ring must be at least 0.1 m long, not % m', ring_length USING ERRCODE = 'invalid_parameter_value';
    END IF;
    IF NOT (first_chainage > '-Infinity' AND first_chainage < 'Infinity') THEN
        RAISE EXCEPTION 'the first ring must begin at a finite chainage, not %', first_chainage
            USING ERRCODE = 'invalid_parameter_value';
    END IF;
    SELECT e.* INTO extent FROM tunnel_api.survey_ends(survey_key) e;
    IF extent.chainage_from IS NULL THEN
        RETURN;  -- no axis yet
    END IF;
    SELECT array_agg(first_chainage + (i - 1) * ring_length ORDER BY i), array_agg(first_chainage + i * ring_length ORDER BY i)
    INTO starts, ends
    FROM generate_series(
        greatest(1, floor((greatest(extent.chainage_from, stretch_from) - first_chainage) / ring_length + 1e-9)::int + 1),
        ceil((least(extent.chainage_to, stretch_to) - first_chainage) / ring_length - 1e-9)::int) i;
    IF starts IS NULL THEN
        RETURN;
    END IF;
    first_whole := starts[1];
    last_whole := ends[cardinality(ends)];
    -- of a ring that was scanned in part, that part
    starts[1] := greatest(starts[1], extent.chainage_from);
    ends[cardinality(ends)] := least(last_whole, extent.chainage_to);
    RETURN QUERY
        SELECT round((r.low - first_chainage) / ring_length)::int + 1, r.low, r.high,
            (SELECT c.label FROM tunnel_api.stationing(tunnel_key, r.low) c), t.lining_area, t.seen_share,
            t.wet_area, t.wet_ratio, t.patches, t.largest_area, t.class
        FROM tunnel_api.stretch_statistics(survey_key, starts, ends) t
        CROSS JOIN LATERAL (SELECT CASE t.n WHEN 1 THEN first_whole ELSE t.chainage_from END AS low,
            CASE t.n WHEN cardinality(ends) THEN last_whole ELSE t.chainage_to END AS high) r;
END
$$;
COMMENT ON FUNCTION tunnel_api.ring_statistics(text, float8, float8, float8, float8) IS
'Statistics of leaks, as leak_statistics gives them, for each ring of a segmental lining: rings of ring_length (m) from first_chainage on, where the first begins, to the end of the survey; of those only the ones that reach into a stretch, if one is given. label: station at which the ring begins, in growing chainage. A leak over several rings counts in each.';
