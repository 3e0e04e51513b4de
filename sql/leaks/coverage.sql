-- Inspected part of the lining, from the counts of detection by steps of chainage (tunnel.coverage).

-- What is known of each kilometre, and what was summed up before it. Over kilometres without detection the sums stay as they
-- are. Read by coverage_at below and stretch_statistics (leaks/statistics.sql).
CREATE OR REPLACE VIEW tunnel_internal.coverage_sums AS
SELECT c.survey_id::bigint * 1000000 + 500000 + c.km AS id, c.survey_id, c.km, c.step, c.lining_sums, c.seen_sums,
       c.wet_sums, 1000 * count(*) OVER earlier AS length_before, coalesce(sum(c.lining_total) OVER earlier, 0) AS lining_before,
       coalesce(sum(c.seen_total) OVER earlier, 0) AS seen_before, coalesce(sum(c.wet_total) OVER earlier, 0) AS wet_before
  FROM tunnel.coverage c
WINDOW earlier AS (PARTITION BY c.survey_id ORDER BY c.km ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING);
COMMENT ON VIEW tunnel_internal.coverage_sums IS
    'Lining of each kilometre, its inspected part and its wet pixels, as running sums over steps of chainage; read by coverage_at';
COMMENT ON COLUMN tunnel_internal.coverage_sums.step IS 'Length of a step, m; the first begins with the kilometre';
COMMENT ON COLUMN tunnel_internal.coverage_sums.lining_sums IS
    'Lining from the beginning of the kilometre to the beginning of each step, and to the end of the last step, m²';
COMMENT ON COLUMN tunnel_internal.coverage_sums.seen_sums IS 'Inspected lining, summed in the same way, m²';
COMMENT ON COLUMN tunnel_internal.coverage_sums.wet_sums IS 'Wet pixels, summed in the same way, m²';
COMMENT ON COLUMN tunnel_internal.coverage_sums.length_before IS 'Length of the searched kilometres before this one, m';
COMMENT ON COLUMN tunnel_internal.coverage_sums.lining_before IS 'Lining of the searched kilometres before this one, m²';
COMMENT ON COLUMN tunnel_internal.coverage_sums.seen_before IS
    'Inspected lining of the searched kilometres before this one, m²';
COMMENT ON COLUMN tunnel_internal.coverage_sums.wet_before IS 'Wet pixels of the searched kilometres before this one, m²';


-- Running sums of the steps of a kilometre (the first is 0) at a place so far along it (m); a step counts by its share. The
-- planner puts the body in the place of a call, so that no call is paid for each place.
CREATE OR REPLACE FUNCTION tunnel_internal.sum_upto(sums float8[], step float8, along float8)
RETURNS float8
LANGUAGE sql IMMUTABLE PARALLEL SAFE CALLED ON NULL INPUT
AS $$
    SELECT $1[least(floor($3 / $2)::int, cardinality($1) - 2) + 1]
        + ($1[least(floor($3 / $2)::int, cardinality($1) - 2) + 2] - $1[least(floor($3 / $2)::int, cardinality($1) - 2) + 1])
            * least($3 / $2 - least(floor($3 / $2)::int, cardinality($1) - 2), 1)
$$;
COMMENT ON FUNCTION tunnel_internal.sum_upto(float8[], float8, float8) IS
'Sum over steps of equal length (m) up to a distance (m) from their beginning, from running sums that begin with 0';


CREATE OR REPLACE FUNCTION tunnel_internal.coverage_at(survey_id int, places float8[])
RETURNS TABLE (n int, chainage float8, length float8, lining float8, seen float8, wet float8)
LANGUAGE plpgsql STABLE PARALLEL SAFE STRICT
ROWS 100
SECURITY DEFINER SET search_path = pg_catalog, pg_temp
SET jit = off
SET enable_nestloop = off  -- how few or many places there are is not known when it is planned
SET enable_mergejoin = off  -- it would sort rows with sums of a kilometre in them
SET plan_cache_mode = force_generic_plan
AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := survey_id;
    wanted constant float8[] := places;
    first_km int;
    last_km int;
BEGIN
    SELECT floor(min(p) / 1000), floor(max(p) / 1000) INTO first_km, last_km FROM unnest(wanted) p;
    RETURN QUERY
        WITH km AS MATERIALIZED (  -- [:] takes the sums out of their storage once, not for each place
            SELECT c.km, c.km * 1000::float8 AS start, c.step, c.length_before, c.lining_before, c.seen_before, c.wet_before,
                c.lining_sums[:] AS lining, c.seen_sums[:] AS seen, c.wet_sums[:] AS wet
            FROM tunnel_internal.coverage_sums c
            WHERE c.survey_id = survey_key AND c.km <= last_km AND c.km >= (
                SELECT max(b.km) FROM tunnel.coverage b WHERE b.survey_id = survey_key AND b.km <= greatest(first_km, (
                    SELECT min(a.km) FROM tunnel.coverage a WHERE a.survey_id = survey_key)))
        ), known AS MATERIALIZED (
            SELECT array_agg(k.km ORDER BY k.km) AS km FROM km k
        )
        SELECT p.n::int, p.chainage, coalesce(k.length_before + i.along, 0),
            coalesce(k.lining_before + tunnel_internal.sum_upto(k.lining, k.step, i.along), 0),
            coalesce(k.seen_before + tunnel_internal.sum_upto(k.seen, k.step, i.along), 0),
            coalesce(k.wet_before + tunnel_internal.sum_upto(k.wet, k.step, i.along), 0)
        FROM known CROSS JOIN LATERAL unnest(wanted) WITH ORDINALITY AS p (chainage, n)
        LEFT JOIN km k ON k.km = known.km[width_bucket(floor(p.chainage / 1000)::int, known.km)]
        CROSS JOIN LATERAL (SELECT least(p.chainage - k.start, 1000) AS along) i
        ORDER BY p.n;
END
$$;
COMMENT ON FUNCTION tunnel_internal.coverage_at(int, float8[]) IS
'Sums from the beginning of a survey up to each given chainage (m): searched length (m), lining, inspected lining and wet pixels (m²). The difference between two chainages is the sum of the stretch between them; a step that is cut counts in proportion';


CREATE OR REPLACE FUNCTION tunnel_api.coverage(
    survey text, chainage_from float8, chainage_to float8,
    OUT lining_area float8, OUT seen_area float8, OUT seen_share float8, OUT wet_pixel_area float8, OUT wet_pixel_share float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT
AS $$
    SELECT d.lining, d.seen, d.seen / nullif(d.lining, 0) * least(d.length / (r.ends[2] - r.ends[1]), 1), d.wet,
        d.wet / nullif(d.seen, 0)
    FROM (SELECT tunnel_api.survey_id($1) AS id) s
    CROSS JOIN LATERAL tunnel_api.survey_ends(s.id) e
    CROSS JOIN LATERAL (SELECT ARRAY[greatest($2, e.chainage_from), least($3, e.chainage_to)] AS ends) r
    LEFT JOIN LATERAL (
        SELECT max(c.lining) - min(c.lining) AS lining, max(c.seen) - min(c.seen) AS seen, max(c.wet) - min(c.wet) AS wet,
            max(c.length) - min(c.length) AS length
        FROM tunnel_internal.coverage_at(s.id, r.ends) c
        HAVING max(c.length) > min(c.length)) d ON true
    WHERE e.chainage_from IS NOT NULL AND r.ends[1] < r.ends[2] AND tunnel_internal.in_order($2, $3)
$$;
COMMENT ON FUNCTION tunnel_api.coverage(text, float8, float8) IS
'Lining of a survey between two chainages (m) that was searched for leaks, its inspected part, and its wet pixels after the median filter (m²). seen_share: inspected share of the lining of the whole stretch; kilometres without detection count as not inspected, as in leak_statistics. wet_pixel_share: share of wet pixels in the inspected lining (Xu et al., 2018). Steps of chainage that are cut count in proportion';


-- Part of an area on the lining (m²) between two chainages (m), by its outline in the unrolled plane. The planner inlines the
-- body; outlines that are not cut are not clipped. For an empty or reversed stretch the part is 0.
CREATE OR REPLACE FUNCTION tunnel_internal.area_between(outline geometry, area float8, chainage_from float8, chainage_to float8)
RETURNS float8
LANGUAGE sql IMMUTABLE PARALLEL SAFE CALLED ON NULL INPUT
AS $$
    SELECT CASE WHEN public.ST_XMin($1) >= $3 AND public.ST_XMax($1) <= $4 THEN $2
        WHEN $3 >= $4 THEN 0
        ELSE $2 / nullif(public.ST_Area($1), 0) * public.ST_Area(public.ST_ClipByBox2D($1, public.ST_MakeBox2D(
            public.ST_MakePoint(greatest($3, -1e9), -1e4), public.ST_MakePoint(least($4, 1e9), 1e4)))) END
$$;
COMMENT ON FUNCTION tunnel_internal.area_between(geometry, float8, float8, float8) IS
'Part of an area on the lining (m²), e.g. of a leak, that lies between two chainages (m), by its outline in the unrolled plane';
