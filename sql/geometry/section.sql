-- Stage 4 of Gonçalves et al. (2012): two cross-sections for each segment, from angular classes.

-- Planes of the sections of a kilometre, at 25 % and 75 % of each segment, within the scanned part: beyond its end a slab
-- would contain the portal's face. Needs km_ends (geometry/survey_ends.sql).
CREATE OR REPLACE FUNCTION tunnel_internal.section_plane(survey_id int, km int)
RETURNS TABLE (segment int, half int2, chainage float8, frame float8[])
LANGUAGE sql STABLE PARALLEL SAFE STRICT
ROWS 200
AS $$
    SELECT s.n, h.half::int2, s.chainage_from + h.half / 100.0 * (s.chainage_to - s.chainage_from),
        tunnel_internal.segment_frame(s.vertex_from || s.vertex_to || s.tangent_from || s.tangent_to, h.half / 100.0)
    FROM tunnel.segment s CROSS JOIN (VALUES (25), (75)) AS h (half)
    JOIN tunnel_internal.km_ends e ON e.survey_id = s.survey_id AND e.km = s.km
    WHERE s.survey_id = section_plane.survey_id AND s.km = section_plane.km
        AND s.chainage_from + h.half / 100.0 * (s.chainage_to - s.chainage_from) BETWEEN e.chainage_from AND e.chainage_to
    ORDER BY 3
$$;
COMMENT ON FUNCTION tunnel_internal.section_plane(int, int) IS
'Planes of the cross-sections of a kilometre, at 25 % and 75 % of each segment, within the scanned part: chainage (m) and frame (origin, tangent, right, up; 12 numbers). Source: Gonçalves et al. (2012), stage 4';


-- Points of a slab: within half_width (in chainage, m) of a plane, in its frame (right, up), with their distance from it in
-- chainage, m. If sonar scans were loaded, points on the bed and the submerged lining are included, and laser points below
-- 0.1 m above the water are excluded: they are reflections, or the water itself.
CREATE OR REPLACE FUNCTION tunnel_internal.section_slab(survey_id int, chainage float8, frame float8[], half_width float8)
RETURNS TABLE (u float8, w float8, away float8)
LANGUAGE plpgsql STABLE PARALLEL SAFE STRICT
ROWS 1000
AS $$
#variable_conflict use_variable
DECLARE
    -- near the ends of a kilometre a point may lie in the partition next door
    km_from constant int := floor((section_slab.chainage - half_width - 1) / 1000);
    km_to constant int := floor((section_slab.chainage + half_width + 1) / 1000);
    water constant float8 := (SELECT max(l.height) FROM tunnel.water_level l
                              WHERE l.survey_id = section_slab.survey_id AND l.km BETWEEN km_from AND km_to);
    from_origin constant text := 'SELECT public.ST_X(p.geom) - $1[1] AS x, public.ST_Y(p.geom) - $1[2] AS y,'
        ' public.ST_Z(p.geom) - $1[3] AS z, abs(p.chainage - $2) AS away';
BEGIN
    RETURN QUERY EXECUTE format($query$
        SELECT d.x * $1[7] + d.y * $1[8], d.x * $1[10] + d.y * $1[11] + d.z * $1[12], d.away
        FROM (%s FROM %s p WHERE p.chainage BETWEEN $3 AND $4 %s
              OFFSET 0) d  -- a fence: the coordinates are taken out once
    $query$, from_origin, tunnel_internal.partition_source(section_slab.survey_id, km_from, km_to), CASE WHEN water IS NOT NULL THEN
        'AND public.ST_Z(p.geom) >= $5 + 0.1 UNION ALL ' || from_origin || ' FROM tunnel.sonar_point p'
        ' WHERE p.survey_id = $6 AND p.classification IN (40, 42) AND p.chainage BETWEEN $3 AND $4' END)
    USING frame, section_slab.chainage, section_slab.chainage - half_width, section_slab.chainage + half_width, water,
        section_slab.survey_id;
END
$$;
COMMENT ON FUNCTION tunnel_internal.section_slab(int, float8, float8[], float8) IS
'Points within half_width (m of chainage) of a section plane, in its frame: right and up of the axis, and distance from the plane, m. Includes sonar points on the bed and the submerged lining. Source: Gonçalves et al. (2012), stage 4';


-- Angular classes of the sections of a kilometre.
--
-- Points within half_width of a section's plane, in polar coordinates about the axis (angle 0 upwards, positive right), are
-- grouped into classes of angle_step degrees; class 0 begins at -180°. Each class is described by a straight line through its
-- points: radius is its intersection with the middle of the class, slope its inclination there (outwards per metre to the
-- right, in the frame of the class), so that wide classes cut no corner. Points within two standard deviations are kept; the
-- standard deviation is estimated from the median distance to the line through the median radius, parallel to the line
-- through the medians of the neighbouring classes. sigma: standard deviation of the kept points from the line, m; spread:
-- variance of their position along it, m². only: requested sections, as segment * 100 + half.
CREATE OR REPLACE FUNCTION tunnel_internal.section_classes(
    survey_id int, km int, half_width float8, angle_step float8, "only" int[])
RETURNS TABLE (
    segment int, half int2, class int, radius float8, slope float8, sigma float8, spread float8, points bigint)
LANGUAGE sql STABLE PARALLEL SAFE STRICT
ROWS 10000
-- the planner expects few classes, and would compare each with every other or sort all points again
SET enable_nestloop = off
SET enable_mergejoin = off
AS $$
    -- OFFSET 0 is a fence: each step is reckoned once, not in each place where it is used.
    WITH plane AS MATERIALIZED (
        SELECT p.segment, p.half, p.chainage, p.frame, row_number() OVER (ORDER BY p.segment, p.half)::int AS i
        FROM tunnel_internal.section_plane(section_classes.survey_id, section_classes.km) p
        WHERE p.segment * 100 + p.half = ANY (section_classes."only")
    ), polar AS (
        SELECT p.i, sqrt(q.u * q.u + q.w * q.w) AS r, degrees(atan2(q.u, q.w)) + 180 AS angle
        FROM plane p
        CROSS JOIN LATERAL tunnel_internal.section_slab(
            section_classes.survey_id, p.chainage, p.frame, section_classes.half_width) q
        OFFSET 0
    ), classed AS (
        SELECT p.i, p.r, p.angle,
            least(floor(p.angle / section_classes.angle_step), 360 / section_classes.angle_step - 1)::int AS class
        FROM polar p
        OFFSET 0
    ), local AS MATERIALIZED (
        -- one number for section and class, and in its order: sorted and compared fast, and not sorted again by what follows
        SELECT c.i * 360 + c.class AS number, c.r,
            c.r * sin(radians(c.angle - (c.class + 0.5) * section_classes.angle_step)) AS x,
            c.r * cos(radians(c.angle - (c.class + 0.5) * section_classes.angle_step)) AS y
        FROM classed c
        ORDER BY 1
    ), middle AS (
        SELECT l.number, percentile_cont(0.5) WITHIN GROUP (ORDER BY l.r) AS radius
        FROM local l
        GROUP BY l.number
    ), rough AS (
        SELECT m.number, m.radius,
            coalesce((lead(m.radius) OVER beside - lag(m.radius) OVER beside)
                / (radians(section_classes.angle_step) * (lead(m.number) OVER beside - lag(m.number) OVER beside) * m.radius),
                0) AS slope
        FROM middle m
        WINDOW beside AS (PARTITION BY m.number / 360 ORDER BY m.number)
    ), residual AS MATERIALIZED (
        SELECT l.number, l.x, l.y, abs(l.y - r.radius - r.slope * l.x) AS distance
        FROM local l
        JOIN rough r ON r.number = l.number
    ), bound AS (
        -- 1.4826 × the median distance is the standard deviation of a normal distribution
        SELECT r.number, 2 * greatest(1.4826 * percentile_cont(0.5) WITHIN GROUP (ORDER BY r.distance), 0.001) AS tolerance
        FROM residual r
        GROUP BY r.number
    ), fitted AS (
        SELECT r.number, coalesce(regr_intercept(r.y, r.x), avg(r.y)) AS radius, regr_slope(r.y, r.x) AS slope,
            sqrt(greatest(coalesce(regr_syy(r.y, r.x) - regr_sxy(r.y, r.x) ^ 2 / nullif(regr_sxx(r.y, r.x), 0), 0), 0)
                / count(*)) AS sigma,
            coalesce(regr_sxx(r.y, r.x) / count(*), 0) AS spread, count(*) AS points
        FROM residual r
        JOIN bound b ON b.number = r.number
        WHERE r.distance <= b.tolerance
        GROUP BY r.number
    )
    SELECT p.segment, p.half, f.number % 360, f.radius, f.slope, f.sigma, f.spread, f.points
    FROM fitted f
    JOIN plane p ON p.i = f.number / 360
    ORDER BY 1, 2, 3
$$;
COMMENT ON FUNCTION tunnel_internal.section_classes(int, int, float8, float8, int[]) IS
'Angular classes of the sections of a kilometre, of angle_step degrees from -180°: line fitted to the points within two standard deviations. radius and sigma in m, slope in m/m, spread in m². Source: Gonçalves et al. (2012), stage 4';
