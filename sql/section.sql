-- Stage 4 of Gonçalves et al. (2012): two cross-sections a segment, from angular classes, as smooth curves.

-- The planes of the sections of a kilometre, at 25 % and 75 % of each segment.
CREATE OR REPLACE FUNCTION tunnel_api.section_plane(survey_id int, km int)
RETURNS TABLE (segment int, half int2, chainage float8, frame float8[])
LANGUAGE sql STABLE PARALLEL SAFE STRICT
ROWS 200
AS $$
    SELECT s.n, h.half::int2, s.chainage_from + h.half / 100.0 * (s.chainage_to - s.chainage_from),
        tunnel_api.segment_frame(s.vertex_from || s.vertex_to || s.tangent_from || s.tangent_to, h.half / 100.0)
    FROM tunnel.segment s CROSS JOIN (VALUES (25), (75)) AS h (half)
    WHERE s.survey_id = section_plane.survey_id AND s.km = section_plane.km
    ORDER BY 3
$$;
COMMENT ON FUNCTION tunnel_api.section_plane(int, int) IS
'Planes of the cross-sections of one kilometre, at 25 % and 75 % of each segment: chainage (m) and frame (origin, tangent, right, up; 12 numbers). Source: Gonçalves et al. (2012), stage 4.';


-- Angular classes of the sections of a kilometre.
--
-- The points at most half_width from a section's plane are taken in polar coordinates about the axis, angle 0 at the upward
-- direction and positive to the right, and grouped by classes of angle_step degrees, class 0 beginning at -180°. Each class
-- is described by a straight line through its points: radius is where the line meets the middle of the class, slope its
-- inclination there (outwards per metre to the right, in the class' own frame), so the class' width cuts no corner. Points
-- are kept within two standard deviations, taken robustly from the median distance to the line through the medians of the
-- neighbouring classes; what the median leaves out can't shift it.
-- sigma: standard deviation of the points kept from the line, m; spread: variance of their position along it, m².
-- only: the sections wanted, as segment * 100 + half.
CREATE OR REPLACE FUNCTION tunnel_api.section_classes(
    survey_id int, km int, half_width float8, angle_step float8, "only" int[])
RETURNS TABLE (
    segment int, half int2, class int, radius float8, slope float8, sigma float8, spread float8, points bigint)
LANGUAGE plpgsql STABLE PARALLEL SAFE STRICT
ROWS 10000
SET enable_nestloop = off  -- the planner expects few classes and would compare each with every other
SET plan_cache_mode = force_custom_plan
AS $$
#variable_conflict use_column
BEGIN
    RETURN QUERY
    WITH plane AS (
        SELECT p.segment, p.half, p.chainage,
            p.frame[1] AS x, p.frame[2] AS y, p.frame[3] AS z, p.frame[7] AS ux, p.frame[8] AS uy,
            p.frame[10] AS wx, p.frame[11] AS wy, p.frame[12] AS wz
        FROM tunnel_api.section_plane(section_classes.survey_id, section_classes.km) p
        WHERE p.segment * 100 + p.half = ANY (section_classes."only")
    ), polar AS (
        SELECT s.segment, s.half, sqrt(q.u * q.u + q.w * q.w) AS r, degrees(atan2(q.u, q.w)) AS angle
        FROM plane s
        JOIN tunnel.point p ON p.segment = s.segment AND abs(p.chainage - s.chainage) <= section_classes.half_width
        CROSS JOIN LATERAL (SELECT ST_X(p.geom) - s.x AS dx, ST_Y(p.geom) - s.y AS dy, ST_Z(p.geom) - s.z AS dz) d
        CROSS JOIN LATERAL (SELECT d.dx * s.ux + d.dy * s.uy AS u, d.dx * s.wx + d.dy * s.wy + d.dz * s.wz AS w) q
        WHERE p.survey_id = section_classes.survey_id
          -- near the ends of a kilometre a point may lie in the partition next door
          AND p.km BETWEEN section_classes.km - 1 AND section_classes.km + 1
          AND p.chainage BETWEEN section_classes.km * 1000 - 2 AND section_classes.km * 1000 + 1002
    ), classed AS (
        SELECT p.segment, p.half, p.r,
            least(floor((p.angle + 180) / section_classes.angle_step), 360 / section_classes.angle_step - 1)::int AS class, p.angle
        FROM polar p
    ), local AS MATERIALIZED (
        SELECT c.segment, c.half, c.class, c.r, c.r * sind(a.delta) AS x, c.r * cosd(a.delta) AS y
        FROM classed c
        CROSS JOIN LATERAL (SELECT c.angle + 180 - (c.class + 0.5) * section_classes.angle_step AS delta) a
    ), middle AS (
        SELECT l.segment, l.half, l.class, percentile_cont(0.5) WITHIN GROUP (ORDER BY l.r) AS radius
        FROM local l
        GROUP BY l.segment, l.half, l.class
    ), rough AS (
        -- the rough line: through the median, parallel to that from neighbour to neighbour
        SELECT m.segment, m.half, m.class, m.radius,
            coalesce((b.radius - a.radius) / (2 * radians(section_classes.angle_step) * m.radius), 0) AS slope
        FROM middle m
        CROSS JOIN LATERAL (SELECT round(360 / section_classes.angle_step)::int AS classes) t
        LEFT JOIN middle a ON a.segment = m.segment AND a.half = m.half AND a.class = (m.class + t.classes - 1) % t.classes
        LEFT JOIN middle b ON b.segment = m.segment AND b.half = m.half AND b.class = (m.class + 1) % t.classes
    ), residual AS (
        SELECT l.*, abs(l.y - r.radius - r.slope * l.x) AS distance
        FROM local l
        JOIN rough r ON r.segment = l.segment AND r.half = l.half AND r.class = l.class
    ), bound AS (
        -- 1.4826 × the median distance is the standard deviation of a normal distribution
        SELECT r.segment, r.half, r.class,
            2 * greatest(1.4826 * percentile_cont(0.5) WITHIN GROUP (ORDER BY r.distance), 0.001) AS tolerance
        FROM residual r
        GROUP BY r.segment, r.half, r.class
    )
    SELECT r.segment, r.half, r.class,
        coalesce(regr_intercept(r.y, r.x), avg(r.y)), regr_slope(r.y, r.x),
        sqrt(greatest(coalesce(regr_syy(r.y, r.x) - regr_sxy(r.y, r.x) ^ 2 / nullif(regr_sxx(r.y, r.x), 0), 0), 0) / count(*)),
        coalesce(regr_sxx(r.y, r.x) / count(*), 0), count(*)
    FROM residual r
    JOIN bound b ON b.segment = r.segment AND b.half = r.half AND b.class = r.class
    WHERE r.distance <= b.tolerance
    GROUP BY r.segment, r.half, r.class
    ORDER BY 1, 2, 3;
END
$$;
COMMENT ON FUNCTION tunnel_api.section_classes(int, int, float8, float8, int[]) IS
'Angular classes of the sections of one kilometre: a line through the points within two standard deviations, by class of angle_step degrees counted from -180°. radius, sigma in m, slope in m/m, spread in m². Source: Gonçalves et al. (2012), stage 4.';
