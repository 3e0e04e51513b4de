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
    'Classes of waterproofing (GB 50108-2008, table 3.2.1) with the limits that a scan can check. The limits of water volume, L/(m² d), are not among them';
COMMENT ON COLUMN tunnel_api.waterproof_limit.id IS 'Class; 1 is the driest';
COMMENT ON COLUMN tunnel_api.waterproof_limit.wet_ratio IS 'Largest permitted wet area, as a share of the lining';
COMMENT ON COLUMN tunnel_api.waterproof_limit.patch_area IS 'Largest permitted area of a leak, m²';
COMMENT ON COLUMN tunnel_api.waterproof_limit.patches_per_100 IS 'Largest permitted number of leaks in any 100 m² of lining';
COMMENT ON COLUMN tunnel_api.waterproof_limit.description IS 'Requirement of the class';


-- Any 100 m² of lining, seen or not: a window slid along a stretch that has more. The lining up to a place takes the part of
-- chainage, so that a leak is an interval [a, b] and every window has a length of 100. One that begins at s holds a leak for s
-- from a - 100 to b: their number changes there only. The area of a leak is spread evenly over its interval; that within a
-- window then changes along straight lines, which bend where an end of a leak enters the window or leaves it, and is greatest
-- at a bend or at an end of the stretch.
--
-- Given are the places in growing order, of both ends of each leak and of both ends of the stretch, and how the wet area per
-- m² of lining changes there: grows where a leak begins, falls where it ends, stays at the ends of the stretch. A loop, and no
-- query: it does in one pass what takes several sorts.
CREATE OR REPLACE FUNCTION tunnel_internal.slide_window(
    places float8[], turns float8[], OUT patches int, OUT window_from float8, OUT wet_area float8)
LANGUAGE plpgsql IMMUTABLE PARALLEL SAFE STRICT
AS $$
DECLARE
    size constant int := cardinality(places);
    first_begin constant float8 := places[1];
    last_begin constant float8 := places[size] - 100;
    entering int := 1;  -- the next of the places to come into the window
    leaving int := 1;  -- and to go out of it
    enters float8 := places[1] - 100;  -- where the window begins when they do
    leaves float8 := places[1];
    s float8 := enters;  -- where it begins
    before float8;
    turn float8;
    slope float8 := 0;  -- of the wet area in it
    held float8 := 0;
    inside int := 0;
    growing boolean := false;  -- whether it has held most leaks since window_from
BEGIN
    patches := 0;
    window_from := first_begin;
    wet_area := 0;
    LOOP
        before := s;
        IF enters <= leaves THEN
            s := enters;
            held := held + slope * (s - before);
            turn := turns[entering];
            slope := slope + turn;
            IF turn > 0 THEN
                inside := inside + 1;
                IF inside > patches THEN
                    patches := inside;
                    window_from := greatest(s, first_begin);
                    growing := true;
                END IF;
            END IF;
            IF held > wet_area AND s >= first_begin THEN
                wet_area := held;
            END IF;
            EXIT WHEN entering = size;
            entering := entering + 1;
            enters := places[entering] - 100;
        ELSE
            s := leaves;
            held := held + slope * (s - before);
            turn := turns[leaving];
            slope := slope - turn;
            IF turn < 0 THEN
                inside := inside - 1;
                IF growing THEN  -- the middle of where it holds them
                    window_from := (window_from + s) / 2;
                    growing := false;
                END IF;
            END IF;
            IF held > wet_area THEN
                wet_area := held;
            END IF;
            leaving := leaving + 1;
            leaves := places[leaving];
        END IF;
    END LOOP;
    IF growing THEN
        window_from := (window_from + last_begin) / 2;
    END IF;
    IF patches = 0 THEN
        window_from := NULL;
    END IF;
END
$$;
COMMENT ON FUNCTION tunnel_internal.slide_window(float8[], float8[]) IS
'Largest number of leaks in a window of 100 m² moved along a stretch, the beginning of that window (NULL without leaks), and the largest wet area in a window. places (m² of lining) and turns (wet area per m² of lining) are those of stretch_statistics';


-- Statistics of stretches of a survey, given by where they begin, in growing order, and end; they do not overlap.
--
-- Leaks are those of kind leak that the last detection found and nobody rejected. One that an end cuts counts by its part
-- in wet_area, as one patch, and whole where the size of a patch matters: a spot is no smaller for being cut by a limit.
-- Windows: see slide_window. A leak where no lining is known is in none.
CREATE OR REPLACE FUNCTION tunnel_internal.stretch_statistics(survey_id int, starts float8[], ends float8[])
RETURNS TABLE (
    n int, chainage_from float8, chainage_to float8, lining_area float8, seen_area float8, seen_share float8,
    wet_area float8, wet_ratio float8, patches int, largest_area float8, largest_leak bigint,
    window_patches int, window_from float8, window_to float8, window_leaks bigint[], window_wet_area float8, class int,
    searched_share float8)
LANGUAGE plpgsql STABLE PARALLEL SAFE STRICT
ROWS 100
SECURITY DEFINER SET search_path = pg_catalog, pg_temp
SET jit = off
SET enable_nestloop = off  -- how few or many rows there are is not known when it is planned
SET enable_mergejoin = off  -- it would sort rows with sums of a kilometre in them
SET plan_cache_mode = force_generic_plan  -- planning takes longer than a short stretch
AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := survey_id;
    first_start constant float8 := starts[1];
    last_end constant float8 := ends[cardinality(ends)];
    first_km constant int := (
        SELECT coalesce(max(c.km) FILTER (WHERE c.km <= floor(first_start / 1000)), min(c.km))
        FROM tunnel.coverage c WHERE c.survey_id = survey_key);
    -- no leak that begins before this reaches into a stretch
    first_leak constant float8 := first_start - 1e-6 - (
        SELECT coalesce(max(l.chainage_to - l.chainage_from), 0) FROM tunnel.finding l WHERE l.survey_id = survey_key);
BEGIN
    RETURN QUERY
    WITH given AS MATERIALIZED (
        SELECT starts AS low, ends AS high
    ), km AS MATERIALIZED (  -- [:] takes the sums out of their storage once, not for each leak
        SELECT c.km, c.km * 1000::float8 AS start, c.step, c.lining_before AS before, c.lining_sums[:] AS lining
        FROM tunnel_internal.coverage_sums c
        WHERE c.survey_id = survey_key AND c.km BETWEEN first_km AND floor(last_end / 1000)
    ), known AS MATERIALIZED (
        SELECT array_agg(k.km ORDER BY k.km) AS km, array_agg(k.before ORDER BY k.km) AS before FROM km k
    ), stretch AS MATERIALIZED (
        SELECT f.n, f.chainage AS low, t.chainage AS high, f.lining AS a, t.lining AS b, t.length - f.length AS looked_at,
            CASE WHEN t.length > f.length THEN t.seen - f.seen END AS seen
        FROM tunnel_internal.coverage_at(survey_key, starts) f JOIN tunnel_internal.coverage_at(survey_key, ends) t ON t.n = f.n
    ), leak AS (
        SELECT l.id, l.area, l.chainage_from AS low, l.chainage_to AS high, generate_series(
            greatest(width_bucket(l.chainage_from, g.low), 1), width_bucket(l.chainage_to, g.low)) AS n
        FROM given g CROSS JOIN tunnel.finding l
        WHERE l.survey_id = survey_key AND l.detected AND l.review <> 'rejected' AND l.wet AND NOT l.superseded
            AND l.chainage_from > first_leak AND l.chainage_to > first_start AND l.chainage_from < last_end
    ), cut AS (
        SELECT l.n, l.id, greatest(l.low, g.low[l.n]) AS low, least(l.high, g.high[l.n]) AS high, l.area AS whole,
            CASE WHEN l.low >= g.low[l.n] AND l.high <= g.high[l.n] THEN l.area
                 -- few are cut: only they are looked up, the others come from the index alone
                 ELSE (SELECT tunnel_internal.area_between(a.unrolled, a.area, g.low[l.n], g.high[l.n])
                     FROM tunnel.finding a WHERE a.id = l.id) END AS area
        FROM leak l CROSS JOIN given g
        WHERE l.high > g.low[l.n] AND l.low < g.high[l.n]
    ), patch AS MATERIALIZED (
        SELECT c.n, c.id, c.whole, c.area,
            coalesce(f.before + tunnel_internal.sum_upto(f.lining, f.step, least(c.low - f.start, 1000)), 0) AS a,
            coalesce(t.before + tunnel_internal.sum_upto(t.lining, t.step, least(c.high - t.start, 1000)), 0) AS b
        FROM cut c CROSS JOIN known
        LEFT JOIN km f ON f.km = known.km[width_bucket(floor(c.low / 1000)::int, known.km)]
        LEFT JOIN km t ON t.km = known.km[width_bucket(floor(c.high / 1000)::int, known.km)]
    ), total AS MATERIALIZED (
        SELECT p.n, count(*)::int AS patches, sum(p.area) AS area, max(p.whole) AS largest FROM patch p GROUP BY p.n
    ), largest AS (
        SELECT p.n, min(p.id) AS id FROM patch p JOIN total t ON t.n = p.n AND t.largest = p.whole GROUP BY p.n
    ), roomy AS (
        SELECT s.n, s.low, s.high, s.a, s.b FROM stretch s WHERE s.b - s.a > 100
    ), bend AS (
        SELECT p.n, p.a AS at, p.area / (p.b - p.a) AS turn FROM patch p JOIN roomy r ON r.n = p.n WHERE p.a < p.b
        UNION ALL
        SELECT p.n, p.b, -p.area / (p.b - p.a) FROM patch p JOIN roomy r ON r.n = p.n WHERE p.a < p.b
        UNION ALL
        SELECT r.n, r.a, 0 FROM roomy r
        UNION ALL
        SELECT r.n, r.b, 0 FROM roomy r
    ), listed AS (  -- sorted once, for both lists
        SELECT b.n, array_agg(b.at) AS places, array_agg(b.turn) AS turns
        FROM (SELECT e.* FROM bend e ORDER BY e.n, e.at) b
        GROUP BY b.n
    ), slid AS MATERIALIZED (
        SELECT l.n, w.patches, w.window_from AS a, w.window_from + 100 AS b, w.wet_area
        FROM listed l CROSS JOIN LATERAL tunnel_internal.slide_window(l.places, l.turns) w
    ), placed AS (  -- windows in chainage again
        SELECT q.n, min(q.chainage) AS low, max(q.chainage) AS high
        FROM (
            SELECT e.n, k.start + k.step * (i.k - 1 + coalesce((e.at - k.before - k.lining[i.k])
                / nullif(k.lining[i.k + 1] - k.lining[i.k], 0), 0)) AS chainage
            FROM (SELECT w.n, unnest(ARRAY[w.a, w.b]) AS at FROM slid w) e CROSS JOIN known
            JOIN km k ON k.km = known.km[width_bucket(e.at, known.before)]
            CROSS JOIN LATERAL (SELECT width_bucket(e.at - k.before, k.lining) AS k) i) q
        GROUP BY q.n
    ), named AS (
        SELECT p.n, array_agg(p.id ORDER BY p.id) AS leaks
        FROM patch p
        LEFT JOIN slid w ON w.n = p.n
        WHERE w.n IS NULL OR (p.a < p.b AND p.a <= w.b AND p.b >= w.a)
        GROUP BY p.n
    ), result AS (
        SELECT s.n, s.low, s.high, nullif(s.b - s.a, 0) AS lining, s.seen,
            CASE WHEN coalesce(s.looked_at, 0) > 0 THEN s.seen / nullif(s.b - s.a, 0) * least(s.looked_at / (s.high - s.low), 1)
                 ELSE 0 END AS seen_share,
            least(coalesce(s.looked_at, 0) / nullif(s.high - s.low, 0), 1) AS searched_share,
            -- that none was found is said only where they were searched for
            CASE WHEN s.looked_at > 0 THEN coalesce(t.area, 0) ELSE t.area END AS wet,
            coalesce(t.area, 0) / nullif(s.seen, 0) AS ratio,
            CASE WHEN s.looked_at > 0 THEN coalesce(t.patches, 0) ELSE t.patches END AS patches, t.largest, l.id,
            -- where there are no more than 100 m², they are the window; where no lining is known, there is none
            CASE WHEN w.n IS NOT NULL THEN w.patches WHEN s.b > s.a THEN coalesce(t.patches, 0) END AS crowd,
            CASE WHEN p.n IS NOT NULL THEN greatest(p.low, s.low) WHEN w.n IS NULL AND s.b > s.a THEN s.low END AS crowd_low,
            CASE WHEN p.n IS NOT NULL THEN least(p.high, s.high) WHEN w.n IS NULL AND s.b > s.a THEN s.high END AS crowd_high,
            CASE WHEN s.b > s.a THEN m.leaks END AS leaks,
            CASE WHEN w.n IS NOT NULL THEN w.wet_area WHEN s.b > s.a THEN coalesce(t.area, 0) END AS window_wet
        FROM stretch s
        LEFT JOIN total t ON t.n = s.n
        LEFT JOIN largest l ON l.n = s.n
        LEFT JOIN slid w ON w.n = s.n
        LEFT JOIN placed p ON p.n = s.n
        LEFT JOIN named m ON m.n = s.n
    )
    SELECT r.n, r.low, r.high, r.lining, r.seen, r.seen_share, r.wet, r.ratio, r.patches, r.largest, r.id,
        r.crowd, r.crowd_low, r.crowd_high, r.leaks, r.window_wet,
        (SELECT min(c.id) FROM tunnel_api.waterproof_limit c
         WHERE r.seen > 0 AND (r.ratio > c.wet_ratio) IS NOT TRUE AND (r.largest > c.patch_area) IS NOT TRUE
            AND (r.crowd > c.patches_per_100 OR (c.patches_per_100 = 0 AND r.patches > 0)) IS NOT TRUE),
        r.searched_share
    FROM result r
    ORDER BY r.n;
END
$$;
COMMENT ON FUNCTION tunnel_internal.stretch_statistics(int, float8[], float8[]) IS
'Result of leak_statistics for consecutive stretches of a survey';


CREATE OR REPLACE FUNCTION tunnel_api.leak_statistics(survey text, chainage_from float8, chainage_to float8)
RETURNS TABLE (
    chainage_from float8, chainage_to float8, lining_area float8, seen_area float8, seen_share float8,
    wet_area float8, wet_ratio float8, patches int, largest_area float8, largest_leak bigint,
    window_patches int, window_from float8, window_to float8, window_leaks bigint[], window_wet_area float8, class int,
    searched_share float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT
ROWS 1
AS $$
    SELECT t.chainage_from, t.chainage_to, t.lining_area, t.seen_area, t.seen_share, t.wet_area, t.wet_ratio, t.patches,
        t.largest_area, t.largest_leak, t.window_patches, t.window_from, t.window_to, t.window_leaks, t.window_wet_area, t.class,
        t.searched_share
    FROM (SELECT tunnel_api.survey_id($1) AS id) s
    CROSS JOIN LATERAL tunnel_api.survey_ends(s.id) e
    CROSS JOIN LATERAL (SELECT greatest($2, e.chainage_from) AS low, least($3, e.chainage_to) AS high) r
    CROSS JOIN LATERAL tunnel_internal.stretch_statistics(s.id, ARRAY[r.low], ARRAY[r.high]) t
    WHERE e.chainage_from IS NOT NULL AND r.low < r.high AND tunnel_internal.in_order($2, $3)
$$;
COMMENT ON FUNCTION tunnel_api.leak_statistics(text, float8, float8) IS
'Statistics of leaks of a survey between two chainages (m), within the surveyed part. Counts leaks that the last detection found and nobody rejected. lining_area and seen_area: of the part searched for leaks, which makes up searched_share of the length. seen_share: inspected share of the lining of the whole stretch; what was not searched counts as not inspected. wet_ratio: wet_area / seen_area. patches and wet_area are NULL if nothing was searched. A leak across an end counts in part in wet_area and as one patch; largest_area and largest_leak use whole leaks. window_patches: largest number of leaks in any 100 m² of lining, between window_from and window_to; window_wet_area: largest wet area in any 100 m² (m²). class: best class of GB 50108-2008 that the inspected lining meets; NULL if nothing was inspected';


CREATE OR REPLACE FUNCTION tunnel_api.waterproof_class(survey text, chainage_from float8, chainage_to float8)
RETURNS TABLE (class int, holds boolean, breaks text[], leaks bigint[], seen_share float8)
LANGUAGE plpgsql STABLE PARALLEL SAFE STRICT
ROWS 4
SECURITY DEFINER SET search_path = pg_catalog, pg_temp
SET jit = off
SET plan_cache_mode = force_generic_plan  -- planning takes longer than a short stretch
AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := tunnel_api.survey_id(survey);
    tunnel_key constant int := (SELECT s.tunnel_id FROM tunnel.survey s WHERE s.id = survey_key);
    low constant float8 := chainage_from;
    high constant float8 := chainage_to;
BEGIN
    RETURN QUERY
    WITH found AS MATERIALIZED (
        SELECT t.* FROM tunnel_api.leak_statistics(survey, low, high) t
    ), leak AS MATERIALIZED (
        SELECT l.id, l.area, (l.chainage_from + l.chainage_to) / 2 AS chainage
        FROM found t JOIN tunnel.finding l ON l.chainage_to > t.chainage_from AND l.chainage_from < t.chainage_to
        WHERE l.survey_id = survey_key AND l.detected AND l.review <> 'rejected' AND l.wet AND NOT l.superseded
            AND l.chainage_from > t.chainage_from - 1e-6 - (
                SELECT max(o.chainage_to - o.chainage_from) FROM tunnel.finding o WHERE o.survey_id = survey_key)
    ), breach AS (
        SELECT c.id AS class, 1 AS n, format('wet area is %s ‰ of the lining seen > %s ‰',
                round((1000 * t.wet_ratio)::numeric, 2), 1000 * c.wet_ratio) AS text,
            (SELECT array_agg(l.id) FROM leak l) AS leaks
        FROM found t JOIN tunnel_api.waterproof_limit c ON t.wet_ratio > c.wet_ratio
        UNION ALL
        SELECT p.class, 2, format('patch of %s m² at %s > %s m²%s', round(p.area::numeric, 3),
                (SELECT s.label FROM tunnel_api.stationing(tunnel_key, p.chainage) s), p.patch_area,
                CASE WHEN cardinality(p.leaks) > 1 THEN format(', the largest of %s', cardinality(p.leaks)) END),
            p.leaks
        FROM (SELECT c.id AS class, c.patch_area, max(l.area) AS area, array_agg(l.id) AS leaks,
                  (array_agg(l.chainage ORDER BY l.area DESC, l.id))[1] AS chainage
              FROM leak l
              JOIN tunnel_api.waterproof_limit c ON l.area > c.patch_area
              GROUP BY c.id, c.patch_area) p
        UNION ALL
        SELECT c.id, 3, CASE c.patches_per_100 WHEN 0 THEN format('wet patches: %s', t.patches)
                             ELSE format('%s patches in 100 m² between %s and %s > %s', t.window_patches,
                                 tunnel_api.station_label(tunnel_key, t.window_from),
                                 tunnel_api.station_label(tunnel_key, t.window_to), c.patches_per_100) END,
            CASE c.patches_per_100 WHEN 0 THEN (SELECT array_agg(l.id) FROM leak l) ELSE t.window_leaks END
        FROM found t
        JOIN tunnel_api.waterproof_limit c ON t.window_patches > c.patches_per_100 OR (c.patches_per_100 = 0 AND t.patches > 0)
    )
    SELECT c.id, CASE WHEN b.texts IS NOT NULL THEN false WHEN t.seen_area > 0 THEN true END, coalesce(b.texts, '{}'),
        ARRAY(SELECT DISTINCT unnest(i.leaks) FROM breach i WHERE i.class = c.id ORDER BY 1), t.seen_share
    FROM found t
    CROSS JOIN tunnel_api.waterproof_limit c
    LEFT JOIN LATERAL (SELECT array_agg(i.text ORDER BY i.n) AS texts FROM breach i WHERE i.class = c.id) b ON true
    ORDER BY c.id;
END
$$;
COMMENT ON FUNCTION tunnel_api.waterproof_class(text, float8, float8) IS
'Classes of waterproofing (GB 50108-2008, table 3.2.1) of a survey between two chainages (m), one row for each class. holds: true if the inspected lining meets the class; NULL if nothing was inspected and no limit is exceeded. breaks: exceeded limits; leaks: ids of the leaks that exceed them. seen_share: inspected share of the lining; the rest cannot be certified. Limits of water volume cannot be checked with a scan';


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
    PERFORM tunnel_internal.in_order(stretch_from, stretch_to);
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
        FROM tunnel_internal.stretch_statistics(survey_key, starts, ends) t
        CROSS JOIN LATERAL (SELECT CASE t.n WHEN 1 THEN first_whole ELSE t.chainage_from END AS low,
            CASE t.n WHEN cardinality(ends) THEN last_whole ELSE t.chainage_to END AS high) r;
END
$$;
COMMENT ON FUNCTION tunnel_api.ring_statistics(text, float8, float8, float8, float8) IS
'Statistics of leaks (see leak_statistics) for each ring of a segmental lining: rings of ring_length (m) from first_chainage (m, beginning of ring 1) to the end of the survey, or only those in a stretch. label: station of the beginning of the ring. A leak across several rings counts in each';
