-- How much of the lining was seen, from what detection notes of each kilometre by steps of chainage (tunnel.coverage).

-- Length of tunnel that was looked at (m), lining, lining seen and wet pixels (m²), summed from the first of the steps that
-- reach into a stretch on, at the edges of these steps. Over kilometres of which nothing is known the sums stay as they are.
CREATE OR REPLACE FUNCTION tunnel_api.coverage_sums(
    survey_id int, chainage_from float8, chainage_to float8,
    OUT chainage float8[], OUT length float8[], OUT lining float8[], OUT seen float8[], OUT wet float8[])
LANGUAGE sql STABLE PARALLEL SAFE STRICT
SECURITY DEFINER SET search_path = pg_catalog, public, pg_temp
SET jit = off
AS $$
    WITH part AS (
        SELECT c.km, c.step, i.first, c.lining[i.first + 1:i.last] AS lining, c.seen[i.first + 1:i.last] AS seen,
            c.wet[i.first + 1:i.last] AS wet
        FROM tunnel.coverage c
        CROSS JOIN LATERAL (
            SELECT greatest(0, floor(($2 - c.km * 1000) / c.step))::int AS first,
                   least(ceil(1000 / c.step), ceil(($3 - c.km * 1000) / c.step))::int AS last) i
        WHERE c.survey_id = $1 AND c.km BETWEEN floor($2 / 1000) AND floor($3 / 1000)
    ), edge AS (
        -- a step is summed up at its end, and a kilometre begins with an edge that adds nothing
        SELECT c.km, s.n, least(c.km * 1000 + (c.first + s.n - 1) * c.step, (c.km + 1) * 1000) AS chainage,
            CASE WHEN s.n = 1 THEN 0 ELSE least(c.step, 1000 - (c.first + s.n - 2) * c.step) END AS length,
            s.lining::float8, s.seen::float8, s.wet::float8
        FROM part c
        CROSS JOIN LATERAL unnest(0::float4 || c.lining, 0::float4 || c.seen, 0::float4 || c.wet)
            WITH ORDINALITY AS s (lining, seen, wet, n)
    ), total AS (
        SELECT e.chainage, sum(e.length) OVER upwards AS length, sum(e.lining) OVER upwards AS lining,
            sum(e.seen) OVER upwards AS seen, sum(e.wet) OVER upwards AS wet
        FROM edge e
        WINDOW upwards AS (ORDER BY e.km, e.n ROWS UNBOUNDED PRECEDING)
        ORDER BY e.km, e.n
    )
    SELECT array_agg(t.chainage), array_agg(t.length), array_agg(t.lining), array_agg(t.seen), array_agg(t.wet) FROM total t
$$;
COMMENT ON FUNCTION tunnel_api.coverage_sums(int, float8, float8) IS
'Running sums over the steps that reach into a stretch of a survey, at the edges of the steps: length looked at (m), lining, lining seen and wet pixels (m²). NULL where nothing was looked at.';


-- Straight lines through points, at many places at once; before the first point and after the last one as there.
CREATE OR REPLACE FUNCTION tunnel_api.interpolate(places float8[], x float8[], y float8[])
RETURNS float8[]
LANGUAGE sql IMMUTABLE PARALLEL SAFE STRICT
SET jit = off
AS $$
    SELECT array_agg(CASE p.k WHEN 0 THEN $3[1]
                          ELSE $3[p.k] + coalesce((p.place - $2[p.k]) / nullif($2[p.k + 1] - $2[p.k], 0)
                                                  * ($3[p.k + 1] - $3[p.k]), 0) END ORDER BY p.i)
    FROM (SELECT q.i, q.place, width_bucket(q.place, $2) AS k FROM unnest($1) WITH ORDINALITY AS q (place, i)) p
$$;
COMMENT ON FUNCTION tunnel_api.interpolate(float8[], float8[], float8[]) IS
'y at each of the places, on straight lines between the points (x, y); x grows.';


-- Where a survey begins and ends: at its first and last point, within its segments. Segments end at vertices, up to a spacing
-- beyond the points, and lining out there is nothing that a survey should have seen. Files know where they reach along the
-- given axis, on which segment n goes from n to n + 1 times the spacing; that is carried over to the axis found.
CREATE OR REPLACE FUNCTION tunnel_api.survey_ends(survey_id int, OUT chainage_from float8, OUT chainage_to float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT
COST 5000  -- once a survey, not once a kilometre
SECURITY DEFINER SET search_path = pg_catalog, public, pg_temp
AS $$
    SELECT min(g.chainage_from + (g.chainage_to - g.chainage_from) * greatest(0, f.first - g.n)),
        max(g.chainage_to - (g.chainage_to - g.chainage_from) * greatest(0, g.n + 1 - f.last))
    FROM (SELECT coalesce(min(q.chainage_from) / t.spacing, '-Infinity') AS first,
                 coalesce(max(q.chainage_to) / t.spacing, 'Infinity') AS last
          FROM tunnel.survey s
          JOIN tunnel.tunnel t ON t.id = s.tunnel_id
          LEFT JOIN tunnel.scan_file q ON q.survey_id = s.id
          WHERE s.id = $1
          GROUP BY t.spacing) f
    JOIN tunnel.segment g ON g.n < f.last AND g.n + 1 > f.first
    WHERE g.survey_id = $1
$$;
COMMENT ON FUNCTION tunnel_api.survey_ends(int) IS
'Least and greatest chainage (m) of what a survey scanned: its first and last point, within its segments.';


CREATE OR REPLACE FUNCTION tunnel_api.coverage(
    survey text, chainage_from float8, chainage_to float8,
    OUT lining_area float8, OUT seen_area float8, OUT seen_share float8, OUT wet_pixel_area float8, OUT wet_pixel_share float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT
AS $$
    SELECT d.lining, d.seen, d.seen / nullif(d.lining, 0), d.wet, d.wet / nullif(d.seen, 0)
    FROM (SELECT tunnel_api.survey_id($1) AS id) s
    CROSS JOIN LATERAL tunnel_api.survey_ends(s.id) e
    CROSS JOIN LATERAL (SELECT ARRAY[greatest($2, e.chainage_from), least($3, e.chainage_to)] AS ends) r
    CROSS JOIN LATERAL tunnel_api.coverage_sums(s.id, r.ends[1], r.ends[2]) c
    CROSS JOIN LATERAL (SELECT tunnel_api.interpolate(r.ends, c.chainage, c.lining) AS lining,
        tunnel_api.interpolate(r.ends, c.chainage, c.seen) AS seen, tunnel_api.interpolate(r.ends, c.chainage, c.wet) AS wet) a
    CROSS JOIN LATERAL (SELECT a.lining[2] - a.lining[1] AS lining, a.seen[2] - a.seen[1] AS seen, a.wet[2] - a.wet[1] AS wet) d
    WHERE e.chainage_from IS NOT NULL AND r.ends[1] < r.ends[2]
$$;
COMMENT ON FUNCTION tunnel_api.coverage(text, float8, float8) IS
'Lining of a survey between two chainages (m), what the last detection saw of it, and the pixels that it found wet, after the median filter (m²); seen_share of the lining, wet_pixel_share of what was seen, as Xu et al. (2018) state it. Steps of chainage that an end cuts count by their share; kilometres without detection are not counted.';
