-- Design alignments, and deviation of the measured axis from the given axis. Needs axis_frame (geometry/axis.sql) and
-- stationing (geometry/stationing.sql).

-- Deviation of each vertex of a survey's axis from the given axis, right and up in the plane of the given axis, m. Vertices
-- beyond the ends of the given axis, where it is extended, are left out.
CREATE OR REPLACE FUNCTION tunnel_api.axis_deviation(survey_id int)
RETURNS TABLE (n int, chainage float8, source text, to_right float8, up float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT
ROWS 1000
SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
    SELECT d.n, d.n * t.spacing, d.source, q.x * d.ux + q.y * d.uy, q.x * d.wx + q.y * d.wy + q.z * d.wz
    FROM (SELECT t.spacing, t.start_chainage AS low, t.start_chainage + public.ST_Length(t.alignment) AS high
          FROM tunnel.survey s JOIN tunnel.tunnel t ON t.id = s.tunnel_id WHERE s.id = $1
          OFFSET 0) t  -- a fence: the length is reckoned once
    CROSS JOIN (SELECT array_agg(v.n ORDER BY v.n) AS n, array_agg(public.ST_X(v.given) ORDER BY v.n) AS x,
                    array_agg(public.ST_Y(v.given) ORDER BY v.n) AS y, array_agg(public.ST_Z(v.given) ORDER BY v.n) AS z,
                    array_agg(v.geom ORDER BY v.n) AS geom, array_agg(v.source ORDER BY v.n) AS source
                FROM tunnel.axis_vertex v WHERE v.survey_id = $1) v
    -- side by side, both in the order of n: the planner would join them by comparing each with every other
    CROSS JOIN LATERAL ROWS FROM (tunnel_internal.axis_frame(v.n, v.x, v.y, v.z), unnest(v.geom), unnest(v.source))
        AS d (n, x, y, z, tx, ty, tz, ux, uy, wx, wy, wz, geom, source)
    CROSS JOIN LATERAL (SELECT public.ST_X(d.geom) - d.x AS x, public.ST_Y(d.geom) - d.y AS y, public.ST_Z(d.geom) - d.z AS z OFFSET 0) q
    WHERE d.n * t.spacing BETWEEN t.low - 0.001 AND t.high + 0.001
    ORDER BY d.n
$$;
COMMENT ON FUNCTION tunnel_api.axis_deviation(int) IS
'Distance of each vertex of a survey''s measured axis from the given axis: to_right (looking up-chainage) and up, m, in the plane of the given axis. source: measured, interpolated or edited (by hand). The view of the same name has geometry';


CREATE OR REPLACE VIEW tunnel_api.axis_deviation AS
SELECT v.id, v.survey_id, s.name AS survey, v.n, v.km, d.chainage,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, d.chainage) l) AS label, d.source, d.to_right, d.up,
       sqrt(d.to_right ^ 2 + d.up ^ 2) AS distance, v.geom::public.geometry AS geom
  FROM tunnel.survey s
 CROSS JOIN LATERAL tunnel_api.axis_deviation(s.id) d
  JOIN tunnel.axis_vertex v ON v.survey_id = s.id AND v.n = d.n;
COMMENT ON VIEW tunnel_api.axis_deviation IS
    'Distance of each vertex of the measured axis from the given axis (the design alignment, if one was given)';
COMMENT ON COLUMN tunnel_api.axis_deviation.source IS 'measured, interpolated or edited (by hand)';
COMMENT ON COLUMN tunnel_api.axis_deviation.to_right IS 'Measured minus given, horizontally to the right looking up-chainage, m';
COMMENT ON COLUMN tunnel_api.axis_deviation.up IS 'Measured minus given, upwards, perpendicular to the given axis, m';
COMMENT ON COLUMN tunnel_api.axis_deviation.distance IS 'Distance of the measured vertex from the given axis, m';
COMMENT ON COLUMN tunnel_api.axis_deviation.geom IS 'Measured vertex, in the tunnel''s SRID';


-- The given axis has a vertex for each metre, so that its substring by length matches the element.
CREATE OR REPLACE VIEW tunnel_api.alignment_element AS
SELECT e.tunnel_id::bigint * 1000000 + CASE e.plane WHEN 'vertical' THEN 500000 ELSE 0 END + e.n AS id,
       e.tunnel_id, t.name AS tunnel, e.plane, e.n, e.kind, e.chainage AS chainage_from, e.chainage + e.length AS chainage_to,
       (SELECT l.label FROM tunnel_api.stationing(t.id, e.chainage) l) AS label_from,
       (SELECT l.label FROM tunnel_api.stationing(t.id, e.chainage + e.length) l) AS label_to,
       e.length,
       CASE WHEN e.plane = 'horizontal' THEN
           CASE sign(e.curvature_from + e.curvature_to) WHEN 1 THEN 'left' WHEN -1 THEN 'right' END
       ELSE CASE sign(e.grade_to - e.grade_from) WHEN 1 THEN 'sag' WHEN -1 THEN 'crest' END END AS turn,
       CASE WHEN e.plane = 'horizontal' THEN 1 / nullif(abs(e.curvature_from), 0)
            WHEN e.kind = 'circle' THEN c.radius
            ELSE abs(e.length / nullif(e.grade_to - e.grade_from, 0)) END AS radius_from,
       CASE WHEN e.plane = 'horizontal' THEN 1 / nullif(abs(e.curvature_to), 0)
            WHEN e.kind = 'circle' THEN c.radius
            ELSE abs(e.length / nullif(e.grade_to - e.grade_from, 0)) END AS radius_to,
       CASE WHEN e.kind = 'clothoid' THEN sqrt(abs(e.length / nullif(e.curvature_to - e.curvature_from, 0))) END AS parameter,
       100 * e.grade_from AS grade_from, 100 * e.grade_to AS grade_to, e.z AS z_from,
       CASE WHEN f.low < f.high THEN public.st_linesubstring(t.alignment, f.low, f.high) END::public.geometry AS geom
  FROM tunnel.alignment_element e
  JOIN tunnel.tunnel t ON t.id = e.tunnel_id
 CROSS JOIN LATERAL (SELECT abs(e.length / nullif(e.grade_to / sqrt(1 + e.grade_to ^ 2)
                                                  - e.grade_from / sqrt(1 + e.grade_from ^ 2), 0)) AS radius) c
 CROSS JOIN LATERAL (SELECT public.st_length(t.alignment) AS length OFFSET 0) w
 CROSS JOIN LATERAL (SELECT least(greatest((e.chainage - t.start_chainage) / w.length, 0), 1) AS low,
                            least(greatest((e.chainage + e.length - t.start_chainage) / w.length, 0), 1) AS high) f;
COMMENT ON VIEW tunnel_api.alignment_element IS
    'Elements of design alignments (LandXML, IFC), in plan (horizontal) and in profile (vertical)';
COMMENT ON COLUMN tunnel_api.alignment_element.plane IS 'horizontal (plan) or vertical (profile)';
COMMENT ON COLUMN tunnel_api.alignment_element.n IS 'Number along the alignment, from 1, separate for plan and profile';
COMMENT ON COLUMN tunnel_api.alignment_element.kind IS 'line, arc or clothoid in plan; grade, parabola or circle in profile';
COMMENT ON COLUMN tunnel_api.alignment_element.length IS 'Length in plan, m';
COMMENT ON COLUMN tunnel_api.alignment_element.turn IS
    'left or right in plan, looking up-chainage; crest or sag in profile; NULL if straight';
COMMENT ON COLUMN tunnel_api.alignment_element.radius_from IS
    'Radius at the beginning, m; NULL if straight. For a parabola, the radius at its vertex';
COMMENT ON COLUMN tunnel_api.alignment_element.radius_to IS 'Radius at the end, m; NULL if straight';
COMMENT ON COLUMN tunnel_api.alignment_element.parameter IS 'Parameter A of a clothoid, m';
COMMENT ON COLUMN tunnel_api.alignment_element.grade_from IS 'Grade of a vertical element at its beginning, %';
COMMENT ON COLUMN tunnel_api.alignment_element.grade_to IS 'Grade of a vertical element at its end, %';
COMMENT ON COLUMN tunnel_api.alignment_element.z_from IS 'Height of a vertical element at its beginning, m';
COMMENT ON COLUMN tunnel_api.alignment_element.geom IS 'Part of the given axis, in the tunnel''s SRID; NULL beyond its ends';
