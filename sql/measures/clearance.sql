-- Outlines about tracks, and how near to them what stands in a tunnel is. Needs stationing (geometry/stationing.sql), survey_id and
-- stage_state (stages/status.sql).

CREATE OR REPLACE FUNCTION tunnel_internal.class_name(class int) RETURNS text
LANGUAGE sql IMMUTABLE STRICT PARALLEL SAFE
RETURN CASE class WHEN 2 THEN 'ground' WHEN 64 THEN 'lining' WHEN 65 THEN 'niche' WHEN 66 THEN 'appendage' WHEN 67 THEN 'rail'
                  WHEN 68 THEN 'object' WHEN 69 THEN 'sphere' WHEN 70 THEN 'noise' ELSE 'unassigned' END;
COMMENT ON FUNCTION tunnel_internal.class_name(int) IS 'Name of a class of points';

CREATE OR REPLACE VIEW tunnel_api.gauge AS
SELECT g.id, g.tunnel_id, t.name AS tunnel, g.name, g.outline, g.source, g.added_at
  FROM tunnel.gauge g JOIN tunnel.tunnel t ON t.id = g.tunnel_id;
COMMENT ON VIEW tunnel_api.gauge IS 'Outlines that are to be clear about tracks or lanes';
COMMENT ON COLUMN tunnel_api.gauge.outline IS
    'Of each vertex: right of the track''s middle, above its running surface (m) and the bulge of what leads to the next';
COMMENT ON COLUMN tunnel_api.gauge.source IS 'File that it was read from';

CREATE OR REPLACE VIEW tunnel_api.clearance_section AS
SELECT c.id, c.survey_id, s.name AS survey, c.km, c.gauge, c.track, c.chainage_from, c.chainage_to,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, (c.chainage_from + c.chainage_to) / 2) l) AS label,
       c.margin, c.margin_se, c.clock, tunnel_internal.class_name(c.class) AS class, c.cluster_id, c.seen_share, c.points, c.inside,
       c.stray, c.passing, c.ground, c.track_right, c.track_up, c.cant, 1 / nullif(c.curvature, 0) AS radius, c.widened_left,
       c.widened_right, c.roll, c.margins, c.outline, c.geom::public.geometry AS geom
  FROM tunnel.clearance_section c JOIN tunnel.survey s ON s.id = c.survey_id;
COMMENT ON VIEW tunnel_api.clearance_section IS
    'Least distance of what stands in the tunnel from an outline about a track, by metre; where seen_share is below 1, what was not seen may stand nearer';
COMMENT ON COLUMN tunnel_api.clearance_section.gauge IS 'Name of the outline';
COMMENT ON COLUMN tunnel_api.clearance_section.track IS 'single; left or right; of more than two their number from the left; given';
COMMENT ON COLUMN tunnel_api.clearance_section.label IS 'Station of its middle, as 12+345.678';
COMMENT ON COLUMN tunnel_api.clearance_section.margin IS 'Least distance, m, negative inside the outline; NULL where nothing was seen that counts';
COMMENT ON COLUMN tunnel_api.clearance_section.margin_se IS 'Its standard error by that of the track''s axis and cant alone, m; 0 of a given track';
COMMENT ON COLUMN tunnel_api.clearance_section.clock IS 'Direction of the point, degrees from straight above the outline''s middle to the right';
COMMENT ON COLUMN tunnel_api.clearance_section.class IS 'Class: lining, niche, fixture (appendage), unassigned';
COMMENT ON COLUMN tunnel_api.clearance_section.cluster_id IS 'Cluster that it lies in, if any';
COMMENT ON COLUMN tunnel_api.clearance_section.seen_share IS 'Share of the directions, of 5° each, with a return of anything, 0 to 1';
COMMENT ON COLUMN tunnel_api.clearance_section.points IS 'Points that count';
COMMENT ON COLUMN tunnel_api.clearance_section.inside IS 'Of them inside the outline';
COMMENT ON COLUMN tunnel_api.clearance_section.stray IS 'Points inside that are noise or without company: they do not count';
COMMENT ON COLUMN tunnel_api.clearance_section.passing IS 'Points inside of objects and spheres, which may be gone: they do not count';
COMMENT ON COLUMN tunnel_api.clearance_section.ground IS 'Points inside of ground and rails: they do not count';
COMMENT ON COLUMN tunnel_api.clearance_section.track_right IS 'Middle of the track right of the given axis, m';
COMMENT ON COLUMN tunnel_api.clearance_section.track_up IS 'Plane of the running surface above the given axis, m';
COMMENT ON COLUMN tunnel_api.clearance_section.cant IS 'How much higher the left rail lies than the right one, m';
COMMENT ON COLUMN tunnel_api.clearance_section.radius IS 'Of the track in plan, positive to the right, m; NULL where straight';
COMMENT ON COLUMN tunnel_api.clearance_section.widened_left IS 'By how much the outline is wider on the left, without roll, m';
COMMENT ON COLUMN tunnel_api.clearance_section.widened_right IS 'By how much it is wider on the right, m';
COMMENT ON COLUMN tunnel_api.clearance_section.roll IS 'Roll of the vehicle, positive to the right, rad';
COMMENT ON COLUMN tunnel_api.clearance_section.margins IS 'Least distance in each 5° by clock, from straight above to the right, m; NaN where nothing that counts was seen';
COMMENT ON COLUMN tunnel_api.clearance_section.outline IS 'The outline widened, in the track''s frame, as in gauge';
COMMENT ON COLUMN tunnel_api.clearance_section.geom IS 'The point with the least distance, in the tunnel''s SRID';

CREATE OR REPLACE VIEW tunnel_api.clearance_infringement AS
SELECT i.id, i.survey_id, s.name AS survey, i.km, i.gauge, i.track, i.chainage_from, i.chainage_to,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, (i.chainage_from + i.chainage_to) / 2) l) AS label, i.depth, i.clock, tunnel_internal.class_name(i.class) AS class,
       i.counts, i.cluster_id, i.points, i.unrolled, i.geom::public.geometry AS geom
  FROM tunnel.clearance_infringement i JOIN tunnel.survey s ON s.id = i.survey_id;
COMMENT ON VIEW tunnel_api.clearance_infringement IS 'Groups of points inside an outline about a track, in pieces of 10 m at most';
COMMENT ON COLUMN tunnel_api.clearance_infringement.gauge IS 'Name of the outline';
COMMENT ON COLUMN tunnel_api.clearance_infringement.track IS 'single; left or right; of more than two their number from the left; given';
COMMENT ON COLUMN tunnel_api.clearance_infringement.label IS 'Station of its middle, as 12+345.678';
COMMENT ON COLUMN tunnel_api.clearance_infringement.depth IS 'How deep it reaches in, m';
COMMENT ON COLUMN tunnel_api.clearance_infringement.clock IS 'Direction of its deepest point, degrees from straight above the outline''s middle to the right';
COMMENT ON COLUMN tunnel_api.clearance_infringement.class IS 'Class that causes it: lining, niche, fixture (appendage), object, sphere, unassigned';
COMMENT ON COLUMN tunnel_api.clearance_infringement.counts IS 'False of objects and spheres, which may be gone';
COMMENT ON COLUMN tunnel_api.clearance_infringement.cluster_id IS 'Cluster that its deepest point lies in, if any';
COMMENT ON COLUMN tunnel_api.clearance_infringement.points IS 'How many points it has';
COMMENT ON COLUMN tunnel_api.clearance_infringement.unrolled IS 'What it covers of the unrolled plane: chainage and arc, m; NULL where it does not unroll';
COMMENT ON COLUMN tunnel_api.clearance_infringement.geom IS 'Its points, at most 200, deepest first, in the tunnel''s SRID';

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
    'What the clearance of a kilometre is made from: the last run of stage ground there and beside, and a checksum of the outline';

CREATE OR REPLACE FUNCTION tunnel_internal.clearance_places(survey_id int, of_subject text DEFAULT NULL)
RETURNS TABLE (km int, subject text, present boolean, reason text)
LANGUAGE sql STABLE CALLED ON NULL INPUT PARALLEL RESTRICTED SECURITY DEFINER ROWS 50
SET search_path = pg_catalog, pg_temp SET jit = off AS $$
    SELECT r.km, coalesce($2, r.subject), true, NULL::text
      FROM tunnel_internal.last_runs($1, CASE WHEN $2 IS NULL THEN 'clearance' ELSE 'ground' END) r
$$;
COMMENT ON FUNCTION tunnel_internal.clearance_places(int, text) IS
    'Kilometres, tracks and gauges that were measured; of a track and gauge given, kilometres whose points have classes';
