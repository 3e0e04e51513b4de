-- Design profiles, and deviation of the linings of surveys from them, by section and stretch. Needs stationing
-- (geometry/stationing.sql), survey_id, survey_ends and stage_state (stages/status.sql).

CREATE OR REPLACE VIEW tunnel_api.design_profile AS
SELECT p.id, p.tunnel_id, t.name AS tunnel, p.layer, p.name, p.chainage_from, p.chainage_to,
       tunnel_api.station_label(p.tunnel_id, p.chainage_from) AS label_from,
       tunnel_api.station_label(p.tunnel_id, p.chainage_to) AS label_to,
       cardinality(p.outline) / 3 - 1 AS elements,
       p.outline[1:2] = p.outline[cardinality(p.outline) - 2:cardinality(p.outline) - 1] AS closed,
       p.outline, p.source, p.added_at
  FROM tunnel.design_profile p
  JOIN tunnel.tunnel t ON t.id = p.tunnel_id;
COMMENT ON VIEW tunnel_api.design_profile IS
    'Design profiles of tunnels, by layer and chainage of the given axis; interpolated linearly between two of a layer';
COMMENT ON COLUMN tunnel_api.design_profile.layer IS 'lining, shotcrete or excavation';
COMMENT ON COLUMN tunnel_api.design_profile.elements IS 'Number of lines and arcs';
COMMENT ON COLUMN tunnel_api.design_profile.closed IS 'True if it ends where it begins; an open profile has no floor';
COMMENT ON COLUMN tunnel_api.design_profile.outline IS
    'Vertices: to the right of the axis and above it (m), and bulge of the edge to the next vertex; clockwise looking up-chainage';
COMMENT ON COLUMN tunnel_api.design_profile.source IS 'File that it was read from';

CREATE OR REPLACE VIEW tunnel_api.design_profile_element AS
SELECT p.id::bigint * 10000 + n AS id, p.id AS profile_id, p.tunnel_id, p.tunnel, p.layer, p.name, n AS number,
       CASE WHEN e.bulge = 0 THEN 'line' ELSE 'arc' END AS kind, e.right_from, e.up_from, e.right_to, e.up_to,
       e.chord * (1 + e.bulge ^ 2) / nullif(-4 * e.bulge, 0) AS radius,
       CASE WHEN e.bulge = 0 THEN e.chord ELSE e.chord * (1 + e.bulge ^ 2) / e.bulge * atan(e.bulge) END AS length
  FROM tunnel_api.design_profile p
 CROSS JOIN LATERAL generate_series(1, p.elements) AS n
 CROSS JOIN LATERAL (
    SELECT p.outline[3 * n - 2] AS right_from, p.outline[3 * n - 1] AS up_from, p.outline[3 * n] AS bulge,
           p.outline[3 * n + 1] AS right_to, p.outline[3 * n + 2] AS up_to,
           sqrt((p.outline[3 * n + 1] - p.outline[3 * n - 2]) ^ 2 + (p.outline[3 * n + 2] - p.outline[3 * n - 1]) ^ 2) AS chord) e;
COMMENT ON VIEW tunnel_api.design_profile_element IS 'Lines and arcs of design profiles, clockwise looking up-chainage, m from the axis';
COMMENT ON COLUMN tunnel_api.design_profile_element.profile_id IS 'Key of the profile';
COMMENT ON COLUMN tunnel_api.design_profile_element.layer IS 'lining, shotcrete or excavation';
COMMENT ON COLUMN tunnel_api.design_profile_element.name IS 'Name of the profile';
COMMENT ON COLUMN tunnel_api.design_profile_element.right_from IS 'Beginning, to the right of the axis, m';
COMMENT ON COLUMN tunnel_api.design_profile_element.up_from IS 'Beginning, above the axis, m';
COMMENT ON COLUMN tunnel_api.design_profile_element.right_to IS 'End, to the right of the axis, m';
COMMENT ON COLUMN tunnel_api.design_profile_element.up_to IS 'End, above the axis, m';
COMMENT ON COLUMN tunnel_api.design_profile_element.number IS 'Number along the profile, from 1';
COMMENT ON COLUMN tunnel_api.design_profile_element.kind IS 'line or arc';
COMMENT ON COLUMN tunnel_api.design_profile_element.radius IS
    'Radius of an arc, positive if convex outwards, m; NULL for a line';
COMMENT ON COLUMN tunnel_api.design_profile_element.length IS 'Length, m';

CREATE OR REPLACE VIEW tunnel_api.deviation_section AS
SELECT d.id, d.survey_id, s.name AS survey, d.km, d.layer, d.profile, d.chainage_from, d.chainage_to,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, (d.chainage_from + d.chainage_to) / 2) l) AS label,
       d.design_length, d.seen_length, d.seen_length / d.design_length AS seen_share, d.overbreak, d.underbreak,
       d.noise_area, d.over_right, d.over_up, d.under_right, d.under_up, d.sigma, d.deviation_mean, d.deviation_least, d.least_at, d.deviation_greatest,
       d.greatest_at, d.shift_right, d.shift_up, d.deviation
  FROM tunnel.deviation_section d
  JOIN tunnel.survey s ON s.id = d.survey_id;
COMMENT ON VIEW tunnel_api.deviation_section IS
    'Deviation of the lining from its design profile, for each metre of chainage, written by tunneldb deviation. Lining that was not inspected is in no area; see seen_share';
COMMENT ON COLUMN tunnel_api.deviation_section.layer IS 'Layer of the profile';
COMMENT ON COLUMN tunnel_api.deviation_section.profile IS 'Name of the profile; in a transition, both names';
COMMENT ON COLUMN tunnel_api.deviation_section.label IS 'Station of its middle, as 12+345.678';
COMMENT ON COLUMN tunnel_api.deviation_section.design_length IS 'Length of the profile, m';
COMMENT ON COLUMN tunnel_api.deviation_section.seen_length IS 'Inspected length of the profile, m';
COMMENT ON COLUMN tunnel_api.deviation_section.seen_share IS 'Inspected share of the profile, 0 to 1';
COMMENT ON COLUMN tunnel_api.deviation_section.overbreak IS 'Inspected area outside the profile, m²';
COMMENT ON COLUMN tunnel_api.deviation_section.underbreak IS 'Inspected area inside the profile, m²';
COMMENT ON COLUMN tunnel_api.deviation_section.noise_area IS
    'Standard deviation of underbreak minus overbreak from the scatter of pixels, m²';
COMMENT ON COLUMN tunnel_api.deviation_section.over_right IS
    'Increase of overbreak if the axis moves to the right, m² for 1 m';
COMMENT ON COLUMN tunnel_api.deviation_section.over_up IS 'Increase of overbreak if the axis moves up, m² for 1 m';
COMMENT ON COLUMN tunnel_api.deviation_section.under_right IS
    'Increase of underbreak if the axis moves to the right, m² for 1 m';
COMMENT ON COLUMN tunnel_api.deviation_section.under_up IS 'Increase of underbreak if the axis moves up, m² for 1 m';
COMMENT ON COLUMN tunnel_api.deviation_section.sigma IS
    'Scatter of pixels within cells (noise and texture of the lining), m';
COMMENT ON COLUMN tunnel_api.deviation_section.deviation_mean IS 'Mean deviation, positive inside the profile, m';
COMMENT ON COLUMN tunnel_api.deviation_section.deviation_least IS 'Smallest mean of a cell, m: deepest overbreak';
COMMENT ON COLUMN tunnel_api.deviation_section.least_at IS
    'Distance of that cell along the profile, clockwise from its left foot or lowest point, m';
COMMENT ON COLUMN tunnel_api.deviation_section.deviation_greatest IS 'Greatest mean of a cell, m: deepest underbreak';
COMMENT ON COLUMN tunnel_api.deviation_section.greatest_at IS 'Distance of that cell along the profile, m';
COMMENT ON COLUMN tunnel_api.deviation_section.shift_right IS
    'Shift of the lining as a whole to the right of the profile, m: error of the axis or of the lining, which cannot be separated';
COMMENT ON COLUMN tunnel_api.deviation_section.shift_up IS 'Shift of the lining as a whole above the profile, m';
COMMENT ON COLUMN tunnel_api.deviation_section.deviation IS
    'Mean deviation of cells of equal length along the profile, m, positive inside; NaN if not inspected';

CREATE OR REPLACE FUNCTION tunnel_internal.deviation_inputs(survey_id int, km int, subject text) RETURNS jsonb
LANGUAGE sql STABLE PARALLEL SAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT jsonb_build_object(
               'detect', tunnel_internal.last_run($1, 'detect', $2),
               'profiles', (
                   SELECT md5(string_agg(concat_ws(' ', p.name, p.chainage_from, p.chainage_to, p.outline), ';' ORDER BY p.chainage_from))
                     FROM tunnel.design_profile p
                    WHERE p.tunnel_id = s.tunnel_id AND p.layer = $3
                      AND p.chainage_to >= coalesce((SELECT max(b.chainage_from) FROM tunnel.design_profile b
                              WHERE b.tunnel_id = s.tunnel_id AND b.layer = $3 AND b.chainage_from <= $2 * 1000), '-infinity')
                      AND p.chainage_from <= coalesce((SELECT min(a.chainage_to) FROM tunnel.design_profile a
                              WHERE a.tunnel_id = s.tunnel_id AND a.layer = $3 AND a.chainage_to >= ($2 + 1) * 1000), 'infinity')))
      FROM tunnel.survey s WHERE s.id = $1
$$;
COMMENT ON FUNCTION tunnel_internal.deviation_inputs(int, int, text) IS
    'Inputs of the deviation of a kilometre from a layer: run of stage detect, and a checksum of the profiles in and next to it';

CREATE OR REPLACE FUNCTION tunnel_internal.deviation_places(survey_id int, of_subject text DEFAULT NULL)
RETURNS TABLE (km int, subject text, present boolean, reason text)
LANGUAGE sql STABLE CALLED ON NULL INPUT PARALLEL RESTRICTED SECURITY DEFINER ROWS 50
SET search_path = pg_catalog, pg_temp SET jit = off AS $$
    WITH design AS (
        SELECT p.layer, min(p.chainage_from) AS low, max(p.chainage_to) AS high
          FROM tunnel.survey s JOIN tunnel.design_profile p ON p.tunnel_id = s.tunnel_id
         WHERE s.id = $1 GROUP BY p.layer
    ), seen AS (
        SELECT i.km FROM tunnel_internal.image_kilometres($1, 'offset') i (km)
    ), pictured AS MATERIALIZED (
        SELECT l.layer, i.km
          FROM (VALUES ('lining'), ('shotcrete'), ('excavation')) l (layer)
         CROSS JOIN LATERAL tunnel_internal.image_kilometres($1, 'deviation_' || l.layer) i (km)
    ), place AS (  -- where there is a design, or there was one and what was made by it is still there
        SELECT k.km, d.layer FROM seen k JOIN design d ON d.low < (k.km + 1) * 1000 AND d.high > k.km * 1000
         UNION
        SELECT l.km, l.subject FROM tunnel_internal.last_runs($1, 'deviation') l
         WHERE EXISTS (SELECT FROM tunnel.deviation_section o WHERE o.survey_id = $1 AND o.layer = l.subject AND o.km = l.km
                          AND o.chainage_from >= l.km * 1000 - 1 AND o.chainage_from < (l.km + 1) * 1000)
    )
    SELECT k.km, d.layer, true,
           CASE WHEN NOT EXISTS (SELECT FROM pictured i WHERE i.km = k.km AND i.layer = d.layer) AND EXISTS (
                     SELECT FROM tunnel.deviation_section o
                      WHERE o.survey_id = $1 AND o.km = k.km AND o.layer = d.layer AND o.seen_length > 0
                        AND o.chainage_from >= k.km * 1000 - 1 AND o.chainage_from < (k.km + 1) * 1000)
                    THEN 'its image is not stored'
           END
      FROM seen k
      JOIN place d ON d.km = k.km
     WHERE $2 IS NULL OR d.layer = $2
$$;
COMMENT ON FUNCTION tunnel_internal.deviation_places(int, text) IS
    'Kilometres with an offset image, and each layer with a profile or sections in them';

-- Steps that an end of the stretch cuts count in proportion.
CREATE OR REPLACE FUNCTION tunnel_api.deviation_volume(
    survey text, layer text, chainage_from float8, chainage_to float8, axis_sigma float8 DEFAULT 0,
    OUT length float8, OUT design_area float8, OUT seen_area float8, OUT seen_share float8, OUT overbreak float8,
    OUT underbreak float8, OUT overbreak_sigma float8, OUT underbreak_sigma float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT
AS $$
    SELECT d.length, d.design_area, d.seen_area,
           d.seen_area / nullif(d.design_area, 0) * least(d.length / nullif(r.high - r.low, 0), 1), d.overbreak, d.underbreak,
           sqrt(d.noise + ($5 * d.over_right) ^ 2 + ($5 * d.over_up) ^ 2),
           sqrt(d.noise + ($5 * d.under_right) ^ 2 + ($5 * d.under_up) ^ 2)
      FROM (SELECT tunnel_api.survey_id($1) AS id) s
     CROSS JOIN LATERAL tunnel_api.survey_ends(s.id) e
     CROSS JOIN LATERAL (SELECT greatest($3, e.chainage_from) AS low, least($4, e.chainage_to) AS high) r
     CROSS JOIN LATERAL (
        SELECT sum(p.long) AS length, sum(p.long * d.design_length) AS design_area, sum(p.long * d.seen_length) AS seen_area,
               sum(p.long * d.overbreak) AS overbreak, sum(p.long * d.underbreak) AS underbreak,
               sum((p.long * d.noise_area) ^ 2) AS noise, sum(p.long * d.over_right) AS over_right,
               sum(p.long * d.over_up) AS over_up, sum(p.long * d.under_right) AS under_right, sum(p.long * d.under_up) AS under_up
          FROM tunnel_api.deviation_section d
         CROSS JOIN LATERAL (SELECT least(d.chainage_to, $4) - greatest(d.chainage_from, $3) AS long) p
         WHERE d.survey_id = s.id AND d.layer = $2 AND d.chainage_from > $3 - 1.001 AND d.chainage_from < $4 AND p.long > 0
           AND tunnel_internal.in_order($3, $4)
        HAVING count(*) > 0) d
$$;
COMMENT ON FUNCTION tunnel_api.deviation_volume(text, text, float8, float8, float8) IS
'Overbreak and underbreak of a survey from a layer''s design between two chainages (m), m³, of the inspected lining: area of each section times its length along the axis. length (m) and design_area (m²) of the compared part; seen_share of the whole stretch, in which what was not compared counts as not inspected. overbreak_sigma and underbreak_sigma: standard deviations from the scatter of pixels and from an axis uncertain by axis_sigma (m) to the right and up, alike along the whole stretch';

CREATE OR REPLACE FUNCTION tunnel_api.deviation_stretches(survey text, layer text, step float8 DEFAULT 100, axis_sigma float8 DEFAULT 0)
RETURNS TABLE (chainage_from float8, chainage_to float8, label text, length float8, design_area float8, seen_area float8,
               seen_share float8, overbreak float8, underbreak float8, overbreak_sigma float8, underbreak_sigma float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT ROWS 250
SET jit = off
AS $$
    SELECT w.low, w.high, tunnel_api.station_label(s.tunnel_id, w.low), w.length, w.design_area, w.seen_area,
           w.seen_area / nullif(w.design_area, 0)
               * least(w.length / nullif(least(w.high, e.chainage_to) - greatest(w.low, e.chainage_from), 0), 1),
           w.overbreak, w.underbreak, sqrt(w.noise + ($4 * w.over_right) ^ 2 + ($4 * w.over_up) ^ 2),
           sqrt(w.noise + ($4 * w.under_right) ^ 2 + ($4 * w.under_up) ^ 2)
      FROM (SELECT v.id, v.tunnel_id FROM tunnel_api.survey v WHERE v.id = tunnel_api.survey_id($1)) s
     CROSS JOIN LATERAL tunnel_api.survey_ends(s.id) e
     CROSS JOIN LATERAL (
        SELECT n * $3 AS low, (n + 1) * $3 AS high, sum(p.long) AS length, sum(p.long * d.design_length) AS design_area,
               sum(p.long * d.seen_length) AS seen_area, sum(p.long * d.overbreak) AS overbreak,
               sum(p.long * d.underbreak) AS underbreak, sum((p.long * d.noise_area) ^ 2) AS noise,
               sum(p.long * d.over_right) AS over_right, sum(p.long * d.over_up) AS over_up,
               sum(p.long * d.under_right) AS under_right, sum(p.long * d.under_up) AS under_up
          FROM tunnel_api.deviation_section d
         CROSS JOIN (VALUES (0), (1)) AS k (further)  -- a section lies in one stretch or two
         CROSS JOIN LATERAL (SELECT floor(d.chainage_from / $3) + k.further AS n) f
         CROSS JOIN LATERAL (SELECT least(d.chainage_to, (n + 1) * $3) - greatest(d.chainage_from, n * $3) AS long) p
         WHERE d.survey_id = s.id AND d.layer = $2 AND $3 >= 1 AND p.long > 0
         GROUP BY n) w
$$;
COMMENT ON FUNCTION tunnel_api.deviation_stretches(text, text, float8, float8) IS
'deviation_volume of each stretch of step metres (1 or more) of a survey, from whole multiples of step on. Default: m³ for each 100 m';
