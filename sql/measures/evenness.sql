-- Evenness of linings. Needs deviation (measures/deviation.sql), station_label (geometry/stationing.sql), survey_id and
-- map_strip (geometry/shape.sql).

CREATE OR REPLACE VIEW tunnel_api.evenness_section AS
SELECT d.id, d.survey_id, s.name AS survey, d.km, d.layer, d.straightedge, d.gap_limit, d.chainage_from, d.chainage_to,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, (d.chainage_from + d.chainage_to) / 2) l) AS label,
       d.arc_from, d.cell, d.lining_area, d.measured_area, d.over_area, greatest(d.gap_along, d.gap_around) AS gap, d.gap_along,
       d.gap_along_at, d.gap_around, d.gap_around_at, d.waviness, d.sigma, d.along, d.around
  FROM tunnel.evenness_section d
  JOIN tunnel.survey s ON s.id = d.survey_id;
COMMENT ON VIEW tunnel_api.evenness_section IS
    'Evenness of the lining: gaps beneath a virtual straightedge along and around it, after removal of the design curvature, for each metre of chainage; written by tunneldb evenness';
COMMENT ON COLUMN tunnel_api.evenness_section.layer IS 'Layer whose profiles are the reference';
COMMENT ON COLUMN tunnel_api.evenness_section.straightedge IS 'Length of the straightedge, m';
COMMENT ON COLUMN tunnel_api.evenness_section.gap_limit IS 'Permitted gap, m';
COMMENT ON COLUMN tunnel_api.evenness_section.label IS 'Station of its middle, as 12+345.678';
COMMENT ON COLUMN tunnel_api.evenness_section.arc_from IS 'Arc of the edge of the first cell, m';
COMMENT ON COLUMN tunnel_api.evenness_section.cell IS 'Side of a cell, m';
COMMENT ON COLUMN tunnel_api.evenness_section.lining_area IS 'Inspected lining, m²';
COMMENT ON COLUMN tunnel_api.evenness_section.measured_area IS
    'Part of it beneath a straightedge, m²; the rest is not measured';
COMMENT ON COLUMN tunnel_api.evenness_section.over_area IS 'Part of it with a gap greater than the limit, m²';
COMMENT ON COLUMN tunnel_api.evenness_section.gap IS 'Greatest gap in both directions, m; NULL if not measured';
COMMENT ON COLUMN tunnel_api.evenness_section.gap_along IS 'Greatest gap along the tunnel, m';
COMMENT ON COLUMN tunnel_api.evenness_section.gap_along_at IS 'Arc of the greatest gap along the tunnel, m';
COMMENT ON COLUMN tunnel_api.evenness_section.gap_around IS 'Greatest gap around the section, m';
COMMENT ON COLUMN tunnel_api.evenness_section.gap_around_at IS 'Arc of the greatest gap around the section, m';
COMMENT ON COLUMN tunnel_api.evenness_section.waviness IS
    'Greatest ratio of the depth of a hollow beneath the straightedge to the distance from its nearer edge';
COMMENT ON COLUMN tunnel_api.evenness_section.sigma IS
    'Standard deviation of the mean of a cell from the scatter of pixels, m; a gap of a few times that is noise';
COMMENT ON COLUMN tunnel_api.evenness_section.along IS
    'Greatest gap along the tunnel, by cells of arc from arc_from up, m; NaN if not measured';
COMMENT ON COLUMN tunnel_api.evenness_section.around IS
    'Greatest gap around the section, by cells of arc from arc_from up, m; NaN if not measured';

CREATE OR REPLACE VIEW tunnel_api.evenness_area AS
SELECT d.id, d.survey_id, s.name AS survey, d.km, d.layer, public.st_xmin(d.geom) AS chainage_from, public.st_xmax(d.geom) AS chainage_to,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, (public.st_xmin(d.geom) + public.st_xmax(d.geom)) / 2) l) AS label,
       public.st_ymin(d.geom) AS arc_from, public.st_ymax(d.geom) AS arc_to, d.area, d.gap, d.direction,
       d.geom::public.geometry(Polygon, 0) AS geom
  FROM tunnel.evenness_area d
  JOIN tunnel.survey s ON s.id = d.survey_id;
COMMENT ON VIEW tunnel_api.evenness_area IS
    'Areas where the gap beneath a virtual straightedge is greater than the limit, written by tunneldb evenness. An area across a kilometre boundary is in two parts';
COMMENT ON COLUMN tunnel_api.evenness_area.layer IS 'Layer whose profiles are the reference';
COMMENT ON COLUMN tunnel_api.evenness_area.label IS 'Station of its middle, as 12+345.678';
COMMENT ON COLUMN tunnel_api.evenness_area.arc_from IS 'Smallest arc, m';
COMMENT ON COLUMN tunnel_api.evenness_area.arc_to IS 'Greatest arc, m';
COMMENT ON COLUMN tunnel_api.evenness_area.area IS 'Area, m²';
COMMENT ON COLUMN tunnel_api.evenness_area.gap IS 'Greatest gap, m';
COMMENT ON COLUMN tunnel_api.evenness_area.direction IS 'Direction of the straightedge: along or around';
COMMENT ON COLUMN tunnel_api.evenness_area.geom IS 'In the unrolled plane (chainage, arc), m';

CREATE OR REPLACE FUNCTION tunnel_internal.evenness_inputs(survey_id int, km int, subject text) RETURNS jsonb
LANGUAGE sql STABLE PARALLEL SAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT jsonb_build_object('deviation', jsonb_agg(tunnel_internal.last_run($1, 'deviation', $2 + k, $3) ORDER BY k))
      FROM generate_series(-1, 1) k
$$;
COMMENT ON FUNCTION tunnel_internal.evenness_inputs(int, int, text) IS
    'Inputs of the evenness of a kilometre: runs of stage deviation in it and its neighbours';

CREATE OR REPLACE FUNCTION tunnel_internal.evenness_places(survey_id int, of_subject text DEFAULT NULL)
RETURNS TABLE (km int, subject text, present boolean, reason text)
LANGUAGE sql STABLE CALLED ON NULL INPUT PARALLEL RESTRICTED SECURITY DEFINER ROWS 50
SET search_path = pg_catalog, pg_temp SET jit = off AS $$
    SELECT d.km, d.subject, true, NULL::text FROM tunnel_internal.deviation_places($1, $2) d
$$;
COMMENT ON FUNCTION tunnel_internal.evenness_places(int, text) IS 'Kilometres and layers with deviations from the design';

CREATE OR REPLACE FUNCTION tunnel_api.evenness_stretches(survey text, layer text, step float8 DEFAULT 100)
RETURNS TABLE (chainage_from float8, chainage_to float8, label text, straightedge float8, gap_limit float8, lining_area float8,
               measured_area float8, over_area float8, gap_along float8, gap_around float8, waviness float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT ROWS 250
SET jit = off
AS $$
    SELECT w.n * $3, (w.n + 1) * $3, tunnel_api.station_label(s.tunnel_id, w.n * $3), w.straightedge, w.gap_limit, w.lining,
           w.measured, w.over, w.along, w.around, w.waviness
      FROM (SELECT v.id, v.tunnel_id FROM tunnel_api.survey v WHERE v.id = tunnel_api.survey_id($1)) s
     CROSS JOIN LATERAL (
        SELECT floor((d.chainage_from + d.chainage_to) / 2 / $3) AS n, min(d.straightedge) AS straightedge,
               min(d.gap_limit) AS gap_limit, sum(d.lining_area) AS lining, sum(d.measured_area) AS measured,
               sum(d.over_area) AS over, max(d.gap_along) AS along, max(d.gap_around) AS around, max(d.waviness) AS waviness
          FROM tunnel_api.evenness_section d
         WHERE d.survey_id = s.id AND d.layer = $2 AND $3 >= 1
         GROUP BY 1) w
$$;
COMMENT ON FUNCTION tunnel_api.evenness_stretches(text, text, float8) IS
'Evenness of a survey''s lining in stretches of step metres (1 or more), from whole multiples of step on: inspected area, area beneath a straightedge, area with a gap greater than the limit (m²), greatest gaps (m), greatest waviness. A section counts at its middle';
