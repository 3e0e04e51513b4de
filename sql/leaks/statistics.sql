-- Statistics of leaks over stretches of a survey, and over rings. Needs waterproof_limit, slide_window, stretch_leaks
-- and stretch_bands.

-- Statistics of stretches of a survey, given by their beginnings, in growing order, and ends; they do not overlap.
--
-- Counts leaks that the last detection found and nobody rejected. A leak that an end cuts counts in part in wet_area, as one
-- patch, and whole where the size of a patch matters. A leak where no lining is known is in no window (see slide_window).
CREATE OR REPLACE FUNCTION tunnel_internal.stretch_statistics(survey_id int, starts float8[], ends float8[])
RETURNS TABLE (
    n int, chainage_from float8, chainage_to float8, lining_area float8, seen_area float8, seen_share float8,
    wet_area float8, wet_ratio float8, patches int, largest_area float8, largest_leak bigint,
    window_patches int, window_from float8, window_to float8, window_leaks bigint[], window_wet_area float8, class int,
    searched_share float8, undecided_area float8, class_if_wet int)
LANGUAGE plpgsql STABLE PARALLEL SAFE STRICT
ROWS 100
SECURITY DEFINER SET search_path = pg_catalog, pg_temp
SET jit = off
SET enable_nestloop = off  -- the number of rows is unknown at planning
SET enable_mergejoin = off  -- it would sort rows that contain the sums of a kilometre
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
BEGIN
    RETURN QUERY
    WITH km AS MATERIALIZED (  -- [:] takes the sums out of their storage once, not for each leak
        SELECT c.km, c.km * 1000::float8 AS start, c.step, c.lining_before AS before, c.lining_sums[:] AS lining
        FROM tunnel_internal.coverage_sums c
        WHERE c.survey_id = survey_key AND c.km BETWEEN first_km AND floor(last_end / 1000)
    ), known AS MATERIALIZED (
        SELECT array_agg(k.km ORDER BY k.km) AS km, array_agg(k.before ORDER BY k.km) AS before FROM km k
    ), stretch AS MATERIALIZED (
        SELECT f.n, f.chainage AS low, t.chainage AS high, f.lining AS a, t.lining AS b, t.length - f.length AS looked_at,
            CASE WHEN t.length > f.length THEN t.seen - f.seen END AS seen
        FROM tunnel_internal.coverage_at(survey_key, starts) f JOIN tunnel_internal.coverage_at(survey_key, ends) t ON t.n = f.n
    ), patch AS MATERIALIZED (
        SELECT l.* FROM tunnel_internal.stretch_leaks(survey_key, starts, ends) l
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
    ), placed AS (  -- windows, converted to chainage
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
    ), undecided AS (
        SELECT u.* FROM tunnel_internal.stretch_bands(survey_key, starts, ends) u
    ), result AS (
        SELECT s.n, s.low, s.high, nullif(s.b - s.a, 0) AS lining, s.seen,
            CASE WHEN coalesce(s.looked_at, 0) > 0 THEN s.seen / nullif(s.b - s.a, 0) * least(s.looked_at / (s.high - s.low), 1)
                 ELSE 0 END AS seen_share,
            least(coalesce(s.looked_at, 0) / nullif(s.high - s.low, 0), 1) AS searched_share,
            -- 0 only where leaks were searched for
            CASE WHEN s.looked_at > 0 THEN coalesce(t.area, 0) ELSE t.area END AS wet,
            coalesce(t.area, 0) / nullif(s.seen, 0) AS ratio,
            CASE WHEN s.looked_at > 0 THEN coalesce(t.patches, 0) ELSE t.patches END AS patches, t.largest, l.id,
            -- up to 100 m² are one window; without known lining there is none
            CASE WHEN w.n IS NOT NULL THEN w.patches WHEN s.b > s.a THEN coalesce(t.patches, 0) END AS crowd,
            CASE WHEN p.n IS NOT NULL THEN greatest(p.low, s.low) WHEN w.n IS NULL AND s.b > s.a THEN s.low END AS crowd_low,
            CASE WHEN p.n IS NOT NULL THEN least(p.high, s.high) WHEN w.n IS NULL AND s.b > s.a THEN s.high END AS crowd_high,
            CASE WHEN s.b > s.a THEN m.leaks END AS leaks,
            CASE WHEN w.n IS NOT NULL THEN w.wet_area WHEN s.b > s.a THEN coalesce(t.area, 0) END AS window_wet,
            CASE WHEN s.looked_at > 0 THEN coalesce(u.area, 0) END AS unsure, u.largest AS unsure_largest, u.bands
        FROM stretch s
        LEFT JOIN total t ON t.n = s.n
        LEFT JOIN largest l ON l.n = s.n
        LEFT JOIN slid w ON w.n = s.n
        LEFT JOIN placed p ON p.n = s.n
        LEFT JOIN named m ON m.n = s.n
        LEFT JOIN undecided u ON u.n = s.n
    )
    SELECT r.n, r.low, r.high, r.lining, r.seen, r.seen_share, r.wet, r.ratio, r.patches, r.largest, r.id,
        r.crowd, r.crowd_low, r.crowd_high, r.leaks, r.window_wet,
        tunnel_internal.best_class(r.seen, r.ratio, r.largest, r.crowd, r.patches), r.searched_share, r.unsure,
        tunnel_internal.best_class(r.seen, r.ratio + r.unsure / nullif(r.seen, 0), greatest(r.largest, r.unsure_largest), r.crowd,
            r.patches + coalesce(r.bands, 0))
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
    searched_share float8, undecided_area float8, class_if_wet int)
LANGUAGE sql STABLE PARALLEL SAFE STRICT
ROWS 1
AS $$
    SELECT t.chainage_from, t.chainage_to, t.lining_area, t.seen_area, t.seen_share, t.wet_area, t.wet_ratio, t.patches,
        t.largest_area, t.largest_leak, t.window_patches, t.window_from, t.window_to, t.window_leaks, t.window_wet_area, t.class,
        t.searched_share, t.undecided_area, t.class_if_wet
    FROM (SELECT tunnel_api.survey_id($1) AS id) s
    CROSS JOIN LATERAL tunnel_api.survey_ends(s.id) e
    CROSS JOIN LATERAL (SELECT greatest($2, e.chainage_from) AS low, least($3, e.chainage_to) AS high) r
    CROSS JOIN LATERAL tunnel_internal.stretch_statistics(s.id, ARRAY[r.low], ARRAY[r.high]) t
    WHERE e.chainage_from IS NOT NULL AND r.low < r.high AND tunnel_internal.in_order($2, $3)
$$;
COMMENT ON FUNCTION tunnel_api.leak_statistics(text, float8, float8) IS
'Statistics of leaks of a survey between two chainages (m), within the surveyed part. Counts leaks that the last detection found and nobody rejected. lining_area and seen_area: of the part searched for leaks, which makes up searched_share of the length. seen_share: inspected share of the lining of the whole stretch; what was not searched counts as not inspected. wet_ratio: wet_area / seen_area. patches and wet_area are NULL if nothing was searched. A leak across an end counts in part in wet_area and as one patch; largest_area and largest_leak use whole leaks. window_patches: largest number of leaks in any 100 m² of lining, between window_from and window_to; window_wet_area: largest wet area in any 100 m² (m²). class: best class of GB 50108-2008 that the inspected lining meets; NULL if nothing was inspected. undecided_area: dark bands that may be wet or dirty (dark_band, m²); class_if_wet: class if they are';


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
        SELECT c.id AS class, 1 AS n, format('wet area is %s ‰ of the inspected lining > %s ‰',
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
