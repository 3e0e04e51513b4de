-- Orientation of lines on the lining, such as cracks, in the unrolled plane.

-- Principal axis of the points of the line: a wavy or zigzag crack has the direction in which it extends. Coordinates are relative to
-- the first point, because chainages are large.
CREATE OR REPLACE FUNCTION tunnel_api.line_orientation(line geometry) RETURNS float8
LANGUAGE sql IMMUTABLE STRICT PARALLEL SAFE SET search_path = pg_catalog, pg_temp AS $$
    WITH point AS (
        SELECT d.path, public.ST_X(d.geom) - public.ST_XMin($1) AS x, public.ST_Y(d.geom) - public.ST_YMin($1) AS y
          FROM public.ST_DumpPoints($1) d WHERE public.ST_Dimension($1) = 1
    ), segment AS (
        SELECT p.x AS x2, p.y AS y2, lag(p.x) OVER along AS x1, lag(p.y) OVER along AS y1 FROM point p
        WINDOW along AS (PARTITION BY p.path[:cardinality(p.path) - 1] ORDER BY p.path)
    ), piece AS (
        SELECT s.*, sqrt((s.x2 - s.x1) ^ 2 + (s.y2 - s.y1) ^ 2) AS l FROM segment s WHERE s.x1 IS NOT NULL
    ), moment AS (
        SELECT sum(p.l) AS l, sum(p.l * (p.x1 + p.x2)) / 2 AS x, sum(p.l * (p.y1 + p.y2)) / 2 AS y,
               sum(p.l * (p.x1 ^ 2 + p.x1 * p.x2 + p.x2 ^ 2)) / 3 AS xx, sum(p.l * (p.y1 ^ 2 + p.y1 * p.y2 + p.y2 ^ 2)) / 3 AS yy,
               sum(p.l * (2 * p.x1 * p.y1 + p.x1 * p.y2 + p.x2 * p.y1 + 2 * p.x2 * p.y2)) / 6 AS xy
          FROM piece p
    )
    SELECT abs(degrees(atan2(2 * (m.xy - m.x * m.y / m.l), m.xx - m.x ^ 2 / m.l - m.yy + m.y ^ 2 / m.l))) / 2
      FROM moment m WHERE m.l > 0
$$;
COMMENT ON FUNCTION tunnel_api.line_orientation(geometry) IS
'Angle of a line of the unrolled plane to the axis of the tunnel, degrees: 0 along the tunnel, 90 around it. It is that of the principal axis of the line''s points. NULL if it is no line or has no length';

CREATE OR REPLACE FUNCTION tunnel_api.orientation_class(orientation float8) RETURNS text
LANGUAGE sql IMMUTABLE STRICT PARALLEL SAFE SET search_path = pg_catalog, pg_temp
RETURN CASE WHEN orientation < 30 THEN 'longitudinal' WHEN orientation > 60 THEN 'transverse' ELSE 'oblique' END;
COMMENT ON FUNCTION tunnel_api.orientation_class(float8) IS
'Class of an angle to the axis of the tunnel, degrees: longitudinal (less than 30), oblique (30 to 60) or transverse (more than 60)';
