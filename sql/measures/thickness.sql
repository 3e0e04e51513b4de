-- Layer thickness between the linings of two surveys that were compared with the same profiles. Needs deviation
-- (measures/deviation.sql), station_label (geometry/stationing.sql) and survey_id (geometry/shape.sql).

CREATE OR REPLACE VIEW tunnel_api.thickness_section AS
SELECT d.id, d.survey_id, s.name AS survey, d.before_id, b.name AS before, d.km, d.layer, d.chainage_from, d.chainage_to,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, (d.chainage_from + d.chainage_to) / 2) l) AS label,
       d.design_length, d.compared_length, d.compared_length / d.design_length AS compared_share, d.area, d.noise_area, d.by_right,
       d.by_up, d.thickness_mean, d.thickness_least, d.least_at, d.thickness
  FROM tunnel.thickness_section d
  JOIN tunnel.survey s ON s.id = d.survey_id
  JOIN tunnel.survey b ON b.id = d.before_id;
COMMENT ON VIEW tunnel_api.thickness_section IS
    'Layer thickness between the linings of two surveys, perpendicular to a layer''s design profile, for each metre of chainage, written by tunneldb thickness. Lining that either survey did not inspect is in no area';
COMMENT ON COLUMN tunnel_api.thickness_section.survey_id IS 'Key of the later survey';
COMMENT ON COLUMN tunnel_api.thickness_section.survey IS 'Name of the later survey';
COMMENT ON COLUMN tunnel_api.thickness_section.before_id IS 'Key of the earlier survey';
COMMENT ON COLUMN tunnel_api.thickness_section.before IS 'Name of the earlier survey';
COMMENT ON COLUMN tunnel_api.thickness_section.layer IS 'Layer whose profiles are the reference of both';
COMMENT ON COLUMN tunnel_api.thickness_section.label IS 'Station of its middle, as 12+345.678';
COMMENT ON COLUMN tunnel_api.thickness_section.design_length IS 'Length of the profile, m';
COMMENT ON COLUMN tunnel_api.thickness_section.compared_length IS 'Length that both inspected, m';
COMMENT ON COLUMN tunnel_api.thickness_section.compared_share IS 'Share that both inspected, 0 to 1';
COMMENT ON COLUMN tunnel_api.thickness_section.area IS
    'Area between the two linings where both inspected it, m²; negative where material was removed';
COMMENT ON COLUMN tunnel_api.thickness_section.noise_area IS 'Standard deviation of the area from the scatter of pixels, m²';
COMMENT ON COLUMN tunnel_api.thickness_section.by_right IS
    'Increase of the area if the later survey moves to the right, m² for 1 m';
COMMENT ON COLUMN tunnel_api.thickness_section.by_up IS 'Increase of the area if the later survey moves up, m² for 1 m';
COMMENT ON COLUMN tunnel_api.thickness_section.thickness_mean IS
    'Mean thickness of the cells that both inspected, m; NULL if there are none';
COMMENT ON COLUMN tunnel_api.thickness_section.thickness_least IS 'Smallest thickness of a cell, m';
COMMENT ON COLUMN tunnel_api.thickness_section.least_at IS
    'Distance of that cell along the profile, clockwise from its left foot or lowest point, m';
COMMENT ON COLUMN tunnel_api.thickness_section.thickness IS
    'Thickness of cells of equal length along the profile, m; NaN if either survey did not inspect it';

CREATE OR REPLACE FUNCTION tunnel_internal.thickness_inputs(survey_id int, km int, subject text) RETURNS jsonb
LANGUAGE sql STABLE PARALLEL SAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT jsonb_build_object('old', tunnel_internal.last_run(p.older_id, 'deviation', $2, p.layer),
                              'new', tunnel_internal.last_run($1, 'deviation', $2, p.layer))
      FROM (SELECT split_part($3, ' ', 1)::int AS older_id, split_part($3, ' ', 2) AS layer) p
$$;
COMMENT ON FUNCTION tunnel_internal.thickness_inputs(int, int, text) IS
    'Inputs of the thickness between an older survey and this one in a kilometre: runs of stage deviation of both';

CREATE OR REPLACE FUNCTION tunnel_internal.thickness_places(survey_id int, of_subject text DEFAULT NULL)
RETURNS TABLE (km int, subject text, present boolean, reason text)
LANGUAGE sql STABLE CALLED ON NULL INPUT PARALLEL RESTRICTED SECURITY DEFINER ROWS 25
SET search_path = pg_catalog, pg_temp SET jit = off AS $$
    SELECT n.km, p.older_id || ' ' || p.layer, true, NULL::text
      FROM (SELECT DISTINCT d.before_id AS older_id, d.layer FROM tunnel.thickness_section d WHERE d.survey_id = $1 AND $2 IS NULL
             UNION ALL
            SELECT split_part($2, ' ', 1)::int, split_part($2, ' ', 2) WHERE $2 IS NOT NULL) p
     CROSS JOIN LATERAL tunnel_internal.deviation_places($1, p.layer) n
      JOIN LATERAL tunnel_internal.deviation_places(p.older_id, p.layer) o ON o.km = n.km
$$;
COMMENT ON FUNCTION tunnel_internal.thickness_places(int, text) IS
    'Kilometres in which this survey and an older one can be compared with a layer: of all pairs and layers with sections, or of a given one';

-- A section lies in one stretch or two. Cells are only looked at of sections in which one is thinner than the minimum.
CREATE OR REPLACE FUNCTION tunnel_api.thickness_stretches(
    survey_before text, survey_after text, layer text, step float8 DEFAULT 100, minimum float8 DEFAULT 0, axis_sigma float8 DEFAULT 0)
RETURNS TABLE (chainage_from float8, chainage_to float8, label text, length float8, design_area float8, compared_area float8,
               volume float8, volume_sigma float8, thickness_mean float8, thickness_least float8, thin_area float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT ROWS 250
SET jit = off
AS $$
    SELECT w.low, w.high, tunnel_api.station_label(s.tunnel_id, w.low), w.length, w.design_area, w.compared_area, w.volume,
           sqrt(w.noise + ($6 * w.by_right) ^ 2 + ($6 * w.by_up) ^ 2), w.mean, w.least, w.thin
      FROM (SELECT v.id, v.tunnel_id FROM tunnel_api.survey v WHERE v.id = tunnel_api.survey_id($2)) s
     CROSS JOIN (SELECT tunnel_api.survey_id($1) AS id OFFSET 0) b  -- once, not once a section
     CROSS JOIN LATERAL (
        SELECT n * $4 AS low, (n + 1) * $4 AS high, sum(p.long) AS length, sum(p.long * d.design_length) AS design_area,
               sum(p.long * d.compared_length) AS compared_area, sum(p.long * d.area) AS volume,
               sum((p.long * d.noise_area) ^ 2) AS noise, sum(p.long * d.by_right) AS by_right, sum(p.long * d.by_up) AS by_up,
               sum(p.long * d.compared_length * d.thickness_mean) / nullif(sum(p.long * d.compared_length), 0) AS mean,
               min(d.thickness_least) AS least,
               coalesce(sum(p.long * CASE WHEN d.thickness_least < $5 THEN d.design_length / cardinality(d.thickness) * (
                   SELECT count(*) FROM unnest(d.thickness) c (thick) WHERE c.thick < $5) END), 0) AS thin
          FROM tunnel_api.thickness_section d
         CROSS JOIN (VALUES (0), (1)) AS k (further)
         CROSS JOIN LATERAL (SELECT floor(d.chainage_from / $4) + k.further AS n) f
         CROSS JOIN LATERAL (SELECT least(d.chainage_to, (n + 1) * $4) - greatest(d.chainage_from, n * $4) AS long) p
         WHERE d.survey_id = s.id AND d.before_id = b.id AND d.layer = $3 AND $4 >= 1 AND p.long > 0
         GROUP BY n) w
$$;
COMMENT ON FUNCTION tunnel_api.thickness_stretches(text, text, text, float8, float8, float8) IS
'Layer thickness and volume between two surveys of a tunnel along a layer''s profiles, in stretches of step metres (1 or more), from whole multiples of step on: volume (m³) of the part that both inspected (compared_area of design_area, m²), mean and smallest thickness (m), thin_area (m²) of cells thinner than minimum (m). volume_sigma: standard deviation from the scatter of pixels and from a relative position of the surveys known to axis_sigma (m) to the right and up, alike along the stretch';
