-- Rings of the linings of surveys: shape, steps from ring to ring, chords. Needs stationing (geometry/stationing.sql) and
-- stage_state (stages/status.sql).

CREATE OR REPLACE VIEW tunnel_api.ring AS
SELECT r.id, r.survey_id, s.name AS survey, r.km,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, (r.chainage_from + r.chainage_to) / 2) l) AS label,
       r.number, r.chainage_from, r.chainage_to, r.origin, r.joint, r.seen_share, r.shape, r.centre_right, r.centre_right_se,
       r.centre_up, r.centre_up_se, r.radius, r.radius_se, r.diameter_largest, r.diameter_largest_se, r.diameter_smallest,
       r.diameter_smallest_se, r.largest_clock, r.largest_clock_se, r.ovality, r.ovality_se, r.design_diameter,
       r.diameter_from, r.harmonic, r.harmonic_se, r.harmonic_clock, r.inward, r.inward_se, r.inward_clock, r.outward,
       r.outward_se, r.outward_clock, r.sigma, r.step_greatest, r.step_greatest_se, r.step_greatest_arc, r.lip, r.lip_se,
       r.lip_arc, r.remark, r.circle_x, r.circle_y, r.circle_z, r.circle_radius
  FROM tunnel.ring r
  JOIN tunnel.survey s ON s.id = r.survey_id;
COMMENT ON VIEW tunnel_api.ring IS
    'Rings of segmental linings with their shape, written by tunneldb rings; each value with its standard error (_se). Clock positions are in degrees. NULL: not measured, or not determined';
COMMENT ON COLUMN tunnel_api.ring.label IS 'Station of its middle, as 12+345.678';
COMMENT ON COLUMN tunnel_api.ring.number IS 'Number of the ring';
COMMENT ON COLUMN tunnel_api.ring.origin IS 'Source of the rings: length, file, or found';
COMMENT ON COLUMN tunnel_api.ring.joint IS 'Joint at its beginning: given, seen (detected in the image), or missing';
COMMENT ON COLUMN tunnel_api.ring.seen_share IS 'Inspected share of the circumference; NULL: not measured';
COMMENT ON COLUMN tunnel_api.ring.shape IS 'Fitted shape: ellipse, circle, or none';
COMMENT ON COLUMN tunnel_api.ring.centre_right IS 'Distance of the centre to the right of the given axis, m';
COMMENT ON COLUMN tunnel_api.ring.centre_right_se IS 'Standard error of centre_right, m';
COMMENT ON COLUMN tunnel_api.ring.centre_up IS 'Height of the centre above the given axis, m';
COMMENT ON COLUMN tunnel_api.ring.centre_up_se IS 'Standard error of centre_up, m';
COMMENT ON COLUMN tunnel_api.ring.radius IS 'Mean radius, m';
COMMENT ON COLUMN tunnel_api.ring.radius_se IS 'Standard error of radius, m';
COMMENT ON COLUMN tunnel_api.ring.diameter_largest IS 'Largest diameter of the ellipse, m';
COMMENT ON COLUMN tunnel_api.ring.diameter_largest_se IS 'Standard error of diameter_largest, m';
COMMENT ON COLUMN tunnel_api.ring.diameter_smallest IS 'Smallest diameter of the ellipse, m';
COMMENT ON COLUMN tunnel_api.ring.diameter_smallest_se IS 'Standard error of diameter_smallest, m';
COMMENT ON COLUMN tunnel_api.ring.largest_clock IS 'Clock position of the largest diameter, degrees';
COMMENT ON COLUMN tunnel_api.ring.largest_clock_se IS 'Standard error of largest_clock, degrees';
COMMENT ON COLUMN tunnel_api.ring.ovality IS '(Largest − smallest diameter) / design diameter';
COMMENT ON COLUMN tunnel_api.ring.ovality_se IS 'Standard error of ovality';
COMMENT ON COLUMN tunnel_api.ring.design_diameter IS 'Design diameter for ovality, m';
COMMENT ON COLUMN tunnel_api.ring.diameter_from IS 'Source of the design diameter: option, profile, or ring (its own mean)';
COMMENT ON COLUMN tunnel_api.ring.harmonic IS
    'Amplitudes of the harmonics of the radius, from order 2, m; NaN if not determined';
COMMENT ON COLUMN tunnel_api.ring.harmonic_se IS 'Standard errors of the amplitudes, m';
COMMENT ON COLUMN tunnel_api.ring.harmonic_clock IS 'First clock position of the maximum of each harmonic, degrees';
COMMENT ON COLUMN tunnel_api.ring.inward IS 'Smallest deviation from the circle with the mean radius, m, negative inside';
COMMENT ON COLUMN tunnel_api.ring.inward_se IS 'Standard error of inward, m';
COMMENT ON COLUMN tunnel_api.ring.inward_clock IS 'Clock position of inward, degrees';
COMMENT ON COLUMN tunnel_api.ring.outward IS 'Greatest deviation from that circle, m';
COMMENT ON COLUMN tunnel_api.ring.outward_se IS 'Standard error of outward, m';
COMMENT ON COLUMN tunnel_api.ring.outward_clock IS 'Clock position of outward, degrees';
COMMENT ON COLUMN tunnel_api.ring.sigma IS 'Scatter of cells around the fitted shape, m';
COMMENT ON COLUMN tunnel_api.ring.step_greatest IS 'Greatest step at its beginning, m, with its sign';
COMMENT ON COLUMN tunnel_api.ring.step_greatest_se IS 'Standard error of step_greatest, m';
COMMENT ON COLUMN tunnel_api.ring.step_greatest_arc IS 'Arc of step_greatest, m';
COMMENT ON COLUMN tunnel_api.ring.lip IS
    'Greatest step between segments of the ring, m, positive if the next segment clockwise protrudes';
COMMENT ON COLUMN tunnel_api.ring.lip_se IS 'Standard error of lip, m';
COMMENT ON COLUMN tunnel_api.ring.lip_arc IS 'Arc of lip, m';
COMMENT ON COLUMN tunnel_api.ring.remark IS 'Note on the ring';
COMMENT ON COLUMN tunnel_api.ring.circle_x IS
    'X (east) of the centre of the best-fit circle of all points of the ring, tunnel''s SRID, m; least squares of distances';
COMMENT ON COLUMN tunnel_api.ring.circle_y IS 'Y (north) of the centre of the best-fit circle, tunnel''s SRID, m';
COMMENT ON COLUMN tunnel_api.ring.circle_z IS 'Height of the centre of the best-fit circle, m';
COMMENT ON COLUMN tunnel_api.ring.circle_radius IS 'Radius of the best-fit circle, m';

-- In a cell of arc each; the joint is the one at the ring's beginning.
CREATE OR REPLACE VIEW tunnel_api.ring_step AS
SELECT r.id * 1000 + n AS id, r.id AS ring_id, r.survey_id, s.name AS survey, r.km, r.number, r.chainage_from AS chainage,
       n::int AS cell, r.step_arc[n] AS arc, r.step[n] AS step, r.step_se[n] AS step_se
  FROM tunnel.ring r
  JOIN tunnel.survey s ON s.id = r.survey_id
 CROSS JOIN LATERAL generate_subscripts(r.step, 1) AS n
 WHERE r.step[n] <> 'NaN';
COMMENT ON VIEW tunnel_api.ring_step IS
    'Steps of the lining from each ring to the next, written by tunneldb rings, in cells of arc. Cells without a determined step are left out';
COMMENT ON COLUMN tunnel_api.ring_step.ring_id IS 'Key of the ring behind the joint';
COMMENT ON COLUMN tunnel_api.ring_step.number IS 'Number of the ring behind the joint';
COMMENT ON COLUMN tunnel_api.ring_step.cell IS 'Number of the cell, from the smallest arc up, from 1';
COMMENT ON COLUMN tunnel_api.ring_step.arc IS 'Arc of the middle of the cell from the crown, m, positive right';
COMMENT ON COLUMN tunnel_api.ring_step.step IS 'Step, m, positive if the ring behind the joint protrudes';
COMMENT ON COLUMN tunnel_api.ring_step.step_se IS 'Standard error of step, m';

CREATE OR REPLACE VIEW tunnel_api.ring_chord AS
SELECT c.id, c.ring_id, r.survey_id, s.name AS survey, r.km, r.number, r.chainage_from, r.chainage_to, c.clock_from,
       c.clock_to, c.length, c.length_se
  FROM tunnel.ring_chord c
  JOIN tunnel.ring r ON r.id = c.ring_id
  JOIN tunnel.survey s ON s.id = r.survey_id;
COMMENT ON VIEW tunnel_api.ring_chord IS
    'Chords of rings between two clock positions, written by tunneldb rings --chord. Their change between surveys is the convergence';
COMMENT ON COLUMN tunnel_api.ring_chord.ring_id IS 'Key of the ring';
COMMENT ON COLUMN tunnel_api.ring_chord.number IS 'Number of the ring';
COMMENT ON COLUMN tunnel_api.ring_chord.clock_from IS 'Clock position of one end, degrees from the crown to the right';
COMMENT ON COLUMN tunnel_api.ring_chord.clock_to IS 'Clock position of the other end, degrees';
COMMENT ON COLUMN tunnel_api.ring_chord.length IS 'Length, m; NULL if an end is not inspected';
COMMENT ON COLUMN tunnel_api.ring_chord.length_se IS 'Standard error of length, m';

-- Rings of other kilometres whose end is next to this one belong to it, too: the step at its beginning depends on both.
CREATE OR REPLACE FUNCTION tunnel_internal.rings_inputs(survey_id int, km int, subject text) RETURNS jsonb
LANGUAGE sql STABLE PARALLEL SAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT jsonb_build_object(
               'detect', (SELECT jsonb_agg(l.id ORDER BY k) FROM generate_series($2 - 1, $2 + 1) k
                           CROSS JOIN LATERAL (SELECT tunnel_internal.last_run($1, 'detect', k) AS id) l WHERE l.id IS NOT NULL),
               'rings', (SELECT md5(string_agg(concat_ws(' ', g.number, g.chainage_from, g.chainage_to), ';' ORDER BY g.number))
                           FROM tunnel.ring g WHERE g.survey_id = $1 AND g.km = $2))
$$;
COMMENT ON FUNCTION tunnel_internal.rings_inputs(int, int, text) IS
    'Inputs of the measures of a kilometre''s rings: runs of stage detect in it and its neighbours, and a checksum of the joints';

CREATE OR REPLACE FUNCTION tunnel_internal.rings_places(survey_id int, of_subject text DEFAULT NULL)
RETURNS TABLE (km int, subject text, present boolean, reason text)
LANGUAGE sql STABLE CALLED ON NULL INPUT PARALLEL RESTRICTED SECURITY DEFINER ROWS 50
SET search_path = pg_catalog, pg_temp SET jit = off AS $$
    SELECT o.km, '', true, CASE WHEN bool_or(o.shape IS NULL) THEN 'rings changed since' END
      FROM tunnel.ring o WHERE o.survey_id = $1 GROUP BY o.km
$$;
COMMENT ON FUNCTION tunnel_internal.rings_places(int, text) IS 'Kilometres that contain the middle of a ring';

-- Between the ends of the section that is nearest behind the ring's beginning, or before it.
CREATE OR REPLACE VIEW tunnel_api.ring_unrolled AS
SELECT r.id, r.survey_id, r.survey, r.km, r.number, r.label, r.chainage_from, r.chainage_to, r.joint, r.seen_share, r.radius,
       1000 * r.ovality AS ovality, 1000 * r.ovality_se AS ovality_se, 1000 * r.centre_right AS centre_right,
       1000 * r.centre_up AS centre_up, 1000 * r.step_greatest AS step_greatest, 1000 * r.lip AS lip, r.remark,
       public.st_makeenvelope(r.chainage_from, e.low, r.chainage_to, e.high, 0)::public.geometry(Polygon, 0) AS geom
  FROM tunnel_api.ring r
 CROSS JOIN LATERAL (
        SELECT q.low, q.high
          FROM ((SELECT t.chainage, t.arc[1] AS low, t.arc[361] AS high FROM tunnel.section t
                  WHERE t.survey_id = r.survey_id AND t.chainage >= r.chainage_from ORDER BY t.chainage LIMIT 1)
                 UNION ALL
                (SELECT t.chainage, t.arc[1], t.arc[361] FROM tunnel.section t
                  WHERE t.survey_id = r.survey_id AND t.chainage < r.chainage_from ORDER BY t.chainage DESC LIMIT 1)) q
         ORDER BY abs(q.chainage - r.chainage_from) LIMIT 1) e;
COMMENT ON VIEW tunnel_api.ring_unrolled IS 'Rings on the unrolled plane, with the columns that QGIS shows';
COMMENT ON COLUMN tunnel_api.ring_unrolled.number IS 'Number of the ring';
COMMENT ON COLUMN tunnel_api.ring_unrolled.label IS 'Station of its middle, as 12+345.678';
COMMENT ON COLUMN tunnel_api.ring_unrolled.joint IS 'Joint at its beginning: given, seen (detected in the image), or missing';
COMMENT ON COLUMN tunnel_api.ring_unrolled.seen_share IS 'Inspected share of the circumference; NULL: not measured';
COMMENT ON COLUMN tunnel_api.ring_unrolled.radius IS 'Mean radius, m';
COMMENT ON COLUMN tunnel_api.ring_unrolled.ovality IS '(Largest − smallest diameter) / design diameter, per mille';
COMMENT ON COLUMN tunnel_api.ring_unrolled.ovality_se IS 'Standard error of ovality, per mille';
COMMENT ON COLUMN tunnel_api.ring_unrolled.centre_right IS 'Distance of the centre to the right of the given axis, mm';
COMMENT ON COLUMN tunnel_api.ring_unrolled.centre_up IS 'Height of the centre above the given axis, mm';
COMMENT ON COLUMN tunnel_api.ring_unrolled.step_greatest IS 'Greatest step at its beginning, mm, positive if it protrudes';
COMMENT ON COLUMN tunnel_api.ring_unrolled.lip IS 'Greatest step between its segments, mm';
COMMENT ON COLUMN tunnel_api.ring_unrolled.remark IS 'Note on the ring';
COMMENT ON COLUMN tunnel_api.ring_unrolled.geom IS 'Outline in the unrolled plane (chainage, arc), m';

CREATE OR REPLACE VIEW tunnel_api.ring_map AS
SELECT r.id, r.survey_id, r.survey, r.km, r.number, r.label, r.chainage_from, r.chainage_to, r.joint, r.seen_share, r.radius,
       r.ovality, r.ovality_se, r.centre_right, r.centre_up, r.step_greatest, r.lip, r.remark,
       public.st_makepolygon(public.st_makeline(ARRAY[c.a, c.b, c.c, c.d, c.a]))::public.geometry AS geom
  FROM tunnel_api.ring_unrolled r
 CROSS JOIN LATERAL (SELECT public.st_ymin(r.geom) AS low, public.st_ymax(r.geom) AS high) e
 CROSS JOIN LATERAL (
        SELECT tunnel_internal.map_point(r.survey_id, r.chainage_from, e.low) AS a,
               tunnel_internal.map_point(r.survey_id, r.chainage_to, e.low) AS b,
               tunnel_internal.map_point(r.survey_id, r.chainage_to, e.high) AS c,
               tunnel_internal.map_point(r.survey_id, r.chainage_from, e.high) AS d) c
 WHERE c.a IS NOT NULL AND c.b IS NOT NULL;
COMMENT ON VIEW tunnel_api.ring_map IS 'Rings on the map strip beside the axis, with the columns that QGIS shows';
COMMENT ON COLUMN tunnel_api.ring_map.number IS 'Number of the ring';
COMMENT ON COLUMN tunnel_api.ring_map.label IS 'Station of its middle, as 12+345.678';
COMMENT ON COLUMN tunnel_api.ring_map.joint IS 'Joint at its beginning: given, seen (detected in the image), or missing';
COMMENT ON COLUMN tunnel_api.ring_map.seen_share IS 'Inspected share of the circumference; NULL: not measured';
COMMENT ON COLUMN tunnel_api.ring_map.radius IS 'Mean radius, m';
COMMENT ON COLUMN tunnel_api.ring_map.ovality IS '(Largest − smallest diameter) / design diameter, per mille';
COMMENT ON COLUMN tunnel_api.ring_map.ovality_se IS 'Standard error of ovality, per mille';
COMMENT ON COLUMN tunnel_api.ring_map.centre_right IS 'Distance of the centre to the right of the given axis, mm';
COMMENT ON COLUMN tunnel_api.ring_map.centre_up IS 'Height of the centre above the given axis, mm';
COMMENT ON COLUMN tunnel_api.ring_map.step_greatest IS 'Greatest step at its beginning, mm, positive if it protrudes';
COMMENT ON COLUMN tunnel_api.ring_map.lip IS 'Greatest step between its segments, mm';
COMMENT ON COLUMN tunnel_api.ring_map.remark IS 'Note on the ring';
COMMENT ON COLUMN tunnel_api.ring_map.geom IS 'Outline on the map strip, tunnel''s SRID';
