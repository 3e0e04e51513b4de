-- Width, height and area of cross-sections, from their stored radii. Needs stationing (geometry/stationing.sql) and survey_id.

-- Area (m²) of an outline of vertices and bulges (tan of a quarter of the arc's angle), as tunnel.design_profile stores it:
-- the polygon of its vertices, and the circular segment between each chord and its arc. NULL if it is open.
CREATE OR REPLACE FUNCTION tunnel_internal.outline_area(outline float8[])
RETURNS float8
LANGUAGE sql IMMUTABLE PARALLEL SAFE STRICT
AS $$
    SELECT CASE WHEN $1[1:2] = $1[cardinality($1) - 2:cardinality($1) - 1]
           THEN abs(sum((e.x * e.next_y - e.next_x * e.y) / 2
                        + CASE WHEN e.bulge = 0 THEN 0 ELSE
                              ((e.next_x - e.x) ^ 2 + (e.next_y - e.y) ^ 2) * (1 + e.bulge ^ 2) ^ 2 / (32 * e.bulge ^ 2)
                              * (4 * atan(e.bulge) - sin(4 * atan(e.bulge))) END)) END
      FROM (SELECT $1[3 * n - 2] AS x, $1[3 * n - 1] AS y, $1[3 * n] AS bulge, $1[3 * n + 1] AS next_x, $1[3 * n + 2] AS next_y
              FROM generate_series(1, cardinality($1) / 3 - 1) AS n) e
$$;
COMMENT ON FUNCTION tunnel_internal.outline_area(float8[]) IS
    'Area of a closed outline of vertices and bulges (x, y, bulge of the edge to the next vertex; m), m²; NULL if it is open';

CREATE OR REPLACE VIEW tunnel_api.section_dimension AS
SELECT c.id, c.survey_id, s.name AS survey, c.km, c.chainage,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, c.chainage) l) AS label, q.width, q.height, q.area,
       1 - c.interpolated * c.angle_step / 360 AS measured_share,
       d.name AS profile, d.area AS design_area, q.area - d.area AS area_difference
  FROM tunnel.section c
  JOIN tunnel.survey s ON s.id = c.survey_id
 CROSS JOIN LATERAL (
        SELECT max(n.far * sind(n.i - 181)) - min(n.far * sind(n.i - 181)) AS width,
               max(n.far * cosd(n.i - 181)) - min(n.far * cosd(n.i - 181)) AS height,
               sum(n.far * n.next) * sind(1) / 2 AS area  -- of triangles at the axis, one for each degree
          FROM unnest(c.radius, c.radius[2:]) WITH ORDINALITY AS n (far, next, i)) q
  LEFT JOIN LATERAL (
        SELECT p.name, tunnel_internal.outline_area(p.outline) AS area
          FROM tunnel.design_profile p
         WHERE p.tunnel_id = s.tunnel_id AND p.layer = 'lining' AND c.chainage BETWEEN p.chainage_from AND p.chainage_to
         ORDER BY p.chainage_from DESC
         LIMIT 1) d ON true;
COMMENT ON VIEW tunnel_api.section_dimension IS
    'Width, height and area of each cross-section, as measured: down to the ground or the track, and outside fixtures that were recognized';
COMMENT ON COLUMN tunnel_api.section_dimension.width IS 'Greatest width, horizontal, m';
COMMENT ON COLUMN tunnel_api.section_dimension.height IS 'Greatest height, at right angles to the axis, m';
COMMENT ON COLUMN tunnel_api.section_dimension.area IS 'Area inside the measured line, m²';
COMMENT ON COLUMN tunnel_api.section_dimension.measured_share IS
    'Share of the angular classes that were measured, 0 to 1; the rest is filled from its neighbours';
COMMENT ON COLUMN tunnel_api.section_dimension.profile IS
    'Design profile of layer lining at this chainage; NULL if there is none, and in a transition between two';
COMMENT ON COLUMN tunnel_api.section_dimension.design_area IS
    'Area inside the design profile, m²; NULL without a profile, or if it is open';
COMMENT ON COLUMN tunnel_api.section_dimension.area_difference IS
    'area - design_area, m²: a track bed or road above the design''s invert makes it negative';

CREATE OR REPLACE FUNCTION tunnel_api.section_dimensions(
    survey text, step float8 DEFAULT 10, chainage_from float8 DEFAULT '-infinity', chainage_to float8 DEFAULT 'infinity')
RETURNS SETOF tunnel_api.section_dimension
LANGUAGE plpgsql STABLE PARALLEL SAFE STRICT ROWS 100
SET search_path = pg_catalog, pg_temp
AS $$
BEGIN
    PERFORM tunnel_internal.in_order(chainage_from, chainage_to);
    IF NOT (step > 0 AND step < 'NaN') THEN
        RAISE EXCEPTION 'the step is % m: give one greater than 0', step USING ERRCODE = 'invalid_parameter_value';
    END IF;
    RETURN QUERY
    SELECT d.*
      FROM tunnel_api.section_dimension d
     WHERE d.id IN (
            SELECT DISTINCT ON (round(c.chainage / step)) c.id
              FROM tunnel_api.section c
             WHERE c.survey_id = tunnel_api.survey_id($1) AND c.chainage BETWEEN $3 AND $4
             ORDER BY round(c.chainage / step), abs(c.chainage - round(c.chainage / step) * step))
     ORDER BY d.chainage;
END
$$;
COMMENT ON FUNCTION tunnel_api.section_dimensions(text, float8, float8, float8) IS
    'Rows of section_dimension of a survey between two chainages, m: for each multiple of step (m) the nearest section, if it is within half a step';
