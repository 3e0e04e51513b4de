-- Clearance: gauges around tracks, and the distance of objects in the tunnel from them. Needs stationing
-- (geometry/stationing.sql), survey_id and stage_state (stages/status.sql).

CREATE OR REPLACE FUNCTION tunnel_internal.class_name(class int) RETURNS text
LANGUAGE sql IMMUTABLE STRICT PARALLEL SAFE
RETURN CASE class WHEN 2 THEN 'ground' WHEN 64 THEN 'lining' WHEN 65 THEN 'niche' WHEN 66 THEN 'appendage' WHEN 67 THEN 'rail'
                  WHEN 68 THEN 'object' WHEN 69 THEN 'sphere' WHEN 70 THEN 'noise' ELSE 'unassigned' END;
COMMENT ON FUNCTION tunnel_internal.class_name(int) IS 'Name of a class of points';

CREATE OR REPLACE VIEW tunnel_api.gauge AS
SELECT g.id, g.tunnel_id, t.name AS tunnel, g.name, g.outline, g.source, g.added_at
  FROM tunnel.gauge g JOIN tunnel.tunnel t ON t.id = g.tunnel_id;
COMMENT ON VIEW tunnel_api.gauge IS 'Clearance outlines (gauges) around tracks or lanes';
COMMENT ON COLUMN tunnel_api.gauge.outline IS
    'Vertices: distance to the right of the track''s centre and above its running surface (m), and bulge of the edge to the next vertex';
COMMENT ON COLUMN tunnel_api.gauge.source IS 'File that it was read from';

CREATE OR REPLACE VIEW tunnel_api.clearance_section AS
SELECT c.id, c.survey_id, s.name AS survey, c.km, c.gauge, c.track, c.chainage_from, c.chainage_to,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, (c.chainage_from + c.chainage_to) / 2) l) AS label,
       c.margin, c.margin_se, c.clock, tunnel_internal.class_name(c.class) AS class, c.cluster_id, c.seen_share, c.points, c.inside,
       c.stray, c.passing, c.ground, c.track_right, c.track_up, c.cant, 1 / nullif(c.curvature, 0) AS radius, c.widened_left,
       c.widened_right, c.roll, c.margins, c.outline, c.geom::public.geometry AS geom
  FROM tunnel.clearance_section c JOIN tunnel.survey s ON s.id = c.survey_id;
COMMENT ON VIEW tunnel_api.clearance_section IS
    'Smallest distance of objects in the tunnel from a gauge, for each metre, written by tunneldb clearance. Where seen_share is less than 1, an object that was not measured may be nearer';
COMMENT ON COLUMN tunnel_api.clearance_section.gauge IS 'Name of the gauge';
COMMENT ON COLUMN tunnel_api.clearance_section.track IS
    'single; left or right; with more than two tracks, the number from the left; given';
COMMENT ON COLUMN tunnel_api.clearance_section.label IS 'Station of its middle, as 12+345.678';
COMMENT ON COLUMN tunnel_api.clearance_section.margin IS
    'Smallest distance, m, negative inside the gauge; NULL if nothing relevant was measured';
COMMENT ON COLUMN tunnel_api.clearance_section.margin_se IS
    'Standard error of margin from the track''s axis and cant only, m; 0 for a given track';
COMMENT ON COLUMN tunnel_api.clearance_section.clock IS
    'Direction of the point, degrees clockwise from above the middle of the gauge';
COMMENT ON COLUMN tunnel_api.clearance_section.class IS 'Class of the point: lining, niche, appendage, unassigned';
COMMENT ON COLUMN tunnel_api.clearance_section.cluster_id IS 'Cluster of the point, if any';
COMMENT ON COLUMN tunnel_api.clearance_section.seen_share IS
    'Share of the directions, in classes of 5°, with any return, 0 to 1';
COMMENT ON COLUMN tunnel_api.clearance_section.points IS 'Number of relevant points';
COMMENT ON COLUMN tunnel_api.clearance_section.inside IS 'Number of relevant points inside the gauge';
COMMENT ON COLUMN tunnel_api.clearance_section.stray IS 'Points inside that are noise or isolated; ignored';
COMMENT ON COLUMN tunnel_api.clearance_section.passing IS
    'Points inside on objects and spheres, which may be temporary; ignored';
COMMENT ON COLUMN tunnel_api.clearance_section.ground IS 'Points inside on ground and rails; ignored';
COMMENT ON COLUMN tunnel_api.clearance_section.track_right IS 'Centre of the track to the right of the given axis, m';
COMMENT ON COLUMN tunnel_api.clearance_section.track_up IS 'Running surface above the given axis, m';
COMMENT ON COLUMN tunnel_api.clearance_section.cant IS 'Height of the left rail above the right rail, m';
COMMENT ON COLUMN tunnel_api.clearance_section.radius IS
    'Radius of the track in plan, positive to the right, m; NULL if straight';
COMMENT ON COLUMN tunnel_api.clearance_section.widened_left IS 'Widening of the gauge on the left, without roll, m';
COMMENT ON COLUMN tunnel_api.clearance_section.widened_right IS 'Widening of the gauge on the right, without roll, m';
COMMENT ON COLUMN tunnel_api.clearance_section.roll IS 'Roll of the vehicle, positive to the right, rad';
COMMENT ON COLUMN tunnel_api.clearance_section.margins IS
    'Smallest distance in each 5° clockwise from above, m; NaN if nothing relevant was measured';
COMMENT ON COLUMN tunnel_api.clearance_section.outline IS 'Widened gauge in the track''s frame, as in the view gauge';
COMMENT ON COLUMN tunnel_api.clearance_section.geom IS 'Point with the smallest distance, tunnel''s SRID';

CREATE OR REPLACE VIEW tunnel_api.clearance_infringement AS
SELECT i.id, i.survey_id, s.name AS survey, i.km, i.gauge, i.track, i.chainage_from, i.chainage_to,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, (i.chainage_from + i.chainage_to) / 2) l) AS label, i.depth, i.clock, tunnel_internal.class_name(i.class) AS class,
       i.counts, i.cluster_id, i.points, i.unrolled, i.geom::public.geometry AS geom
  FROM tunnel.clearance_infringement i JOIN tunnel.survey s ON s.id = i.survey_id;
COMMENT ON VIEW tunnel_api.clearance_infringement IS 'Groups of points inside a gauge, in pieces of at most 10 m, written by tunneldb clearance';
COMMENT ON COLUMN tunnel_api.clearance_infringement.gauge IS 'Name of the gauge';
COMMENT ON COLUMN tunnel_api.clearance_infringement.track IS
    'single; left or right; with more than two tracks, the number from the left; given';
COMMENT ON COLUMN tunnel_api.clearance_infringement.label IS 'Station of its middle, as 12+345.678';
COMMENT ON COLUMN tunnel_api.clearance_infringement.depth IS 'Greatest depth inside the gauge, m';
COMMENT ON COLUMN tunnel_api.clearance_infringement.clock IS
    'Direction of the deepest point, degrees clockwise from above the middle of the gauge';
COMMENT ON COLUMN tunnel_api.clearance_infringement.class IS
    'Class of the points: lining, niche, appendage, object, sphere, unassigned';
COMMENT ON COLUMN tunnel_api.clearance_infringement.counts IS 'False for objects and spheres, which may be temporary';
COMMENT ON COLUMN tunnel_api.clearance_infringement.cluster_id IS 'Cluster of the deepest point, if any';
COMMENT ON COLUMN tunnel_api.clearance_infringement.points IS 'Number of points';
COMMENT ON COLUMN tunnel_api.clearance_infringement.unrolled IS
    'Area covered in the unrolled plane (chainage, arc; m); NULL if it cannot be unrolled';
COMMENT ON COLUMN tunnel_api.clearance_infringement.geom IS 'Points, at most 200, deepest first, tunnel''s SRID';

-- The subject is a track and a gauge, whose name may hold spaces.
CREATE OR REPLACE FUNCTION tunnel_internal.clearance_inputs(survey_id int, km int, subject text) RETURNS jsonb
LANGUAGE sql STABLE PARALLEL SAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT jsonb_build_object(
               'ground', (SELECT max(tunnel_internal.last_run($1, 'ground', k)) FROM generate_series($2 - 1, $2 + 1) k),
               'outline', (SELECT g.checksum FROM tunnel.gauge g
                            WHERE g.tunnel_id = s.tunnel_id AND g.name = substr($3, strpos($3, ' ') + 1)))
      FROM tunnel.survey s WHERE s.id = $1
$$;
COMMENT ON FUNCTION tunnel_internal.clearance_inputs(int, int, text) IS
    'Inputs of the clearance of a kilometre: last runs of stage ground in it and its neighbours, and a checksum of the gauge';

CREATE OR REPLACE FUNCTION tunnel_internal.clearance_places(survey_id int, of_subject text DEFAULT NULL)
RETURNS TABLE (km int, subject text, present boolean, reason text)
LANGUAGE sql STABLE CALLED ON NULL INPUT PARALLEL RESTRICTED SECURITY DEFINER ROWS 50
SET search_path = pg_catalog, pg_temp SET jit = off AS $$
    SELECT r.km, coalesce($2, r.subject), true, NULL::text
      FROM tunnel_internal.last_runs($1, CASE WHEN $2 IS NULL THEN 'clearance' ELSE 'ground' END) r
$$;
COMMENT ON FUNCTION tunnel_internal.clearance_places(int, text) IS
    'Kilometres, tracks and gauges that were measured; for a given track and gauge, kilometres whose points have classes';
