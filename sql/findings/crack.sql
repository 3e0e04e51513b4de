-- Density of cracks by element. Needs element_boxes and element_parts (measures/rating.sql), and line_orientation
-- (findings/orientation.sql).

-- The lining is the length of the element times the girth of its sections, without the ground, searched for leaks or not: cracks can
-- come from photos of a survey without detection.
CREATE OR REPLACE FUNCTION tunnel_internal.element_cracks(survey_id int, set_id int)
RETURNS TABLE (element_id int, lining float8, cracks int, length float8, longitudinal float8, transverse float8, oblique float8,
    width_mm float8)
LANGUAGE plpgsql STABLE STRICT PARALLEL SAFE SECURITY DEFINER ROWS 1000 SET search_path = pg_catalog, pg_temp SET jit = off
AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := survey_id;
    set_key constant int := set_id;
BEGIN
    RETURN QUERY
    WITH extent AS (
        SELECT b.element_id, sum((b.high - b.low) * coalesce(above.girth, inside.girth, near.girth)) AS lining
          FROM tunnel_internal.element_boxes(survey_key, set_key) b
         CROSS JOIN LATERAL (
               SELECT avg(greatest(least(b.arc_to, g.arc_right) - greatest(b.arc_from, g.arc_left), 0)) AS girth FROM tunnel.ground g
                WHERE g.survey_id = survey_key AND g.n BETWEEN floor(b.low) AND ceil(b.high)) above
         CROSS JOIN LATERAL (
               SELECT avg(least(b.arc_to, s.arc[cardinality(s.arc)]) - greatest(b.arc_from, s.arc[1])) AS girth FROM tunnel.section s
                WHERE s.survey_id = survey_key AND s.chainage BETWEEN b.low AND b.high) inside
          LEFT JOIN LATERAL (
               SELECT least(b.arc_to, s.arc[cardinality(s.arc)]) - greatest(b.arc_from, s.arc[1]) AS girth FROM tunnel.section s
                WHERE s.survey_id = survey_key AND s.chainage BETWEEN b.low - 50 AND b.high + 50
                ORDER BY abs(s.chainage - (b.low + b.high) / 2) LIMIT 1) near ON true
         GROUP BY b.element_id
    ), part AS (
        SELECT p.element_id, count(*)::int AS cracks, sum(p.length) AS length, max(p.width_mm) AS width_mm,
               sum(p.length) FILTER (WHERE c.class = 'longitudinal') AS longitudinal,
               sum(p.length) FILTER (WHERE c.class = 'transverse') AS transverse,
               sum(p.length) FILTER (WHERE c.class = 'oblique') AS oblique
          FROM tunnel_internal.element_parts(survey_key, set_key) p
          JOIN tunnel.finding f ON f.id = p.finding_id
         CROSS JOIN LATERAL (SELECT tunnel_api.orientation_class(tunnel_api.line_orientation(f.shape)) AS class) c
         WHERE p.kind = 'crack' GROUP BY p.element_id
    )
    SELECT e.id, coalesce(x.lining, 0), coalesce(p.cracks, 0), coalesce(p.length, 0), coalesce(p.longitudinal, 0),
           coalesce(p.transverse, 0), coalesce(p.oblique, 0), p.width_mm
      FROM tunnel.element e
      LEFT JOIN extent x ON x.element_id = e.id
      LEFT JOIN part p ON p.element_id = e.id
     WHERE e.element_set_id = set_key;
END
$$;
COMMENT ON FUNCTION tunnel_internal.element_cracks(int, int) IS
'Counted cracks in the elements of a division in a survey: lining of the element within the survey (m²), number of cracks, their length in the element, in all and by orientation (m), and greatest width (mm)';

CREATE OR REPLACE VIEW tunnel_api.crack_density AS
SELECT s.id::bigint << 32 | e.id AS id, s.id AS survey_id, s.name AS survey, d.name AS element_set, e.id AS element_id, e.number, e.name,
       e.chainage_from, e.chainage_to, tunnel_api.station_label(s.tunnel_id, e.chainage_from) AS label_from,
       tunnel_api.station_label(s.tunnel_id, e.chainage_to) AS label_to, c.lining AS lining_area, c.cracks, c.length AS crack_length,
       c.length / nullif(c.lining, 0) AS density, c.longitudinal AS longitudinal_length, c.transverse AS transverse_length,
       c.oblique AS oblique_length, c.width_mm
  FROM tunnel.survey s
  JOIN tunnel.element_set d ON d.tunnel_id = s.tunnel_id
 CROSS JOIN LATERAL tunnel_internal.element_cracks(s.id, d.id) c
  JOIN tunnel.element e ON e.id = c.element_id;
COMMENT ON VIEW tunnel_api.crack_density IS
    'Length of cracks by area of lining in each element of each survey. Select a survey and an element_set. 0 means that no crack was drawn or imported there: whether anybody looked for cracks is not recorded';

COMMENT ON COLUMN tunnel_api.crack_density.element_set IS 'Name of the division of the tunnel';
COMMENT ON COLUMN tunnel_api.crack_density.element_id IS 'Id in element';
COMMENT ON COLUMN tunnel_api.crack_density.number IS 'Number of the element in its division, from 1';
COMMENT ON COLUMN tunnel_api.crack_density.name IS 'Name of the element';
COMMENT ON COLUMN tunnel_api.crack_density.chainage_from IS 'Chainage of its beginning, m';
COMMENT ON COLUMN tunnel_api.crack_density.chainage_to IS 'Chainage of its end, m';
COMMENT ON COLUMN tunnel_api.crack_density.label_from IS 'Station of its beginning, as 12+345.678';
COMMENT ON COLUMN tunnel_api.crack_density.label_to IS 'Station of its end';
COMMENT ON COLUMN tunnel_api.crack_density.lining_area IS 'Lining of the element within the survey, m²: length times girth of the sections, without the ground if stage ground found it';
COMMENT ON COLUMN tunnel_api.crack_density.cracks IS 'Number of counted cracks that reach into it';
COMMENT ON COLUMN tunnel_api.crack_density.crack_length IS 'Length of their parts in it, m';
COMMENT ON COLUMN tunnel_api.crack_density.density IS 'Length of cracks by area of lining, m per m²; NULL outside the survey';
COMMENT ON COLUMN tunnel_api.crack_density.longitudinal_length IS 'Length of the longitudinal cracks, m';
COMMENT ON COLUMN tunnel_api.crack_density.transverse_length IS 'Length of the transverse cracks, m';
COMMENT ON COLUMN tunnel_api.crack_density.oblique_length IS 'Length of the oblique cracks, m';
COMMENT ON COLUMN tunnel_api.crack_density.width_mm IS 'Greatest width of a crack, mm; NULL: not stated';
