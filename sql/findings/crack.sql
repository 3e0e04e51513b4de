-- What was searched for cracks, and their density by element. Needs element_boxes and element_parts (measures/rating.sql), and
-- line_orientation (findings/orientation.sql).

CREATE OR REPLACE FUNCTION tunnel_internal.crack_search_entry(source text, area geometry) RETURNS jsonb
LANGUAGE sql IMMUTABLE STRICT PARALLEL SAFE SET search_path = pg_catalog, pg_temp
RETURN jsonb_build_object('source', source, 'chainage_from', public.ST_XMin(area), 'chainage_to', public.ST_XMax(area),
                          'arc_from', public.ST_YMin(area), 'arc_to', public.ST_YMax(area));
COMMENT ON FUNCTION tunnel_internal.crack_search_entry(text, geometry) IS 'A record of crack_search as the audit has it';

CREATE OR REPLACE FUNCTION tunnel_api.crack_search_add(survey text, area geometry, source text) RETURNS int
LANGUAGE plpgsql VOLATILE STRICT PARALLEL UNSAFE SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
DECLARE
    survey_key constant int := tunnel_api.survey_id(survey);
    lining public.geometry;
    inside public.geometry;
    found int;
BEGIN
    PERFORM tunnel_internal.check_text('the text on what was searched', source, 1000),
            tunnel_internal.check_coordinates('the area that was searched', area);
    IF source = '' THEN
        RAISE EXCEPTION 'it is not said what was searched' USING ERRCODE = 'invalid_parameter_value', HINT = 'such as: photos of March';
    END IF;
    IF public.ST_Dimension(area) <> 2 OR public.ST_SRID(area) <> 0 OR NOT public.ST_IsValid(area) THEN
        RAISE EXCEPTION 'the area that was searched is no valid polygon of the unrolled plane'
            USING ERRCODE = 'invalid_parameter_value', HINT = 'give chainage and arc in metres, with SRID 0';
    END IF;
    SELECT public.ST_MakeEnvelope(v.chainage_from, min(s.arc[1]), v.chainage_to, max(s.arc[cardinality(s.arc)])) INTO lining
      FROM tunnel_api.survey_ends(survey_key) v CROSS JOIN tunnel.section s
     WHERE s.survey_id = survey_key GROUP BY v.chainage_from, v.chainage_to;
    inside := public.ST_Multi(public.ST_CollectionExtract(public.ST_Intersection(public.ST_Force2D(area), lining), 3));
    IF inside IS NULL OR public.ST_IsEmpty(inside) THEN
        RAISE EXCEPTION 'the area that was searched does not meet the lining of survey %', survey
            USING ERRCODE = 'invalid_parameter_value', HINT = 'tunneldb status shows from where to where the survey extends';
    END IF;
    SELECT c.id INTO found FROM tunnel.crack_search c
     WHERE c.survey_id = survey_key AND c.source = crack_search_add.source AND public.ST_Equals(c.area, inside) LIMIT 1;
    IF found IS NULL THEN
        INSERT INTO tunnel.crack_search (survey_id, area, source) VALUES (survey_key, inside, source) RETURNING id INTO found;
        PERFORM tunnel_internal.note_edit(survey, 'crack_search', found, NULL, tunnel_internal.crack_search_entry(source, inside));
    END IF;
    RETURN found;
END
$$;
COMMENT ON FUNCTION tunnel_api.crack_search_add(text, geometry, text) IS
'Record that a part of the lining was searched for cracks: a polygon in the unrolled plane (chainage, arc; m), and what was searched, such as photos. What lies beyond the lining is cut off. Returns the id in crack_search; the same again if it is recorded already';

CREATE OR REPLACE FUNCTION tunnel_api.crack_search_remove(id int) RETURNS void
LANGUAGE plpgsql VOLATILE STRICT PARALLEL UNSAFE SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
DECLARE
    gone record;
BEGIN
    DELETE FROM tunnel.crack_search c USING tunnel.survey s WHERE c.id = crack_search_remove.id AND s.id = c.survey_id
    RETURNING s.name, c.source, c.area INTO gone;
    IF gone IS NULL THEN
        RAISE EXCEPTION 'there is no search for cracks with id %', id
            USING ERRCODE = 'no_data_found', HINT = 'view crack_search shows them';
    END IF;
    PERFORM tunnel_internal.note_edit(gone.name, 'crack_search', id, tunnel_internal.crack_search_entry(gone.source, gone.area), NULL);
END
$$;
COMMENT ON FUNCTION tunnel_api.crack_search_remove(int) IS
'Remove a record of crack_search, by its id. Raises an error if there is none';

CREATE OR REPLACE VIEW tunnel_api.crack_search AS
SELECT c.id, c.survey_id, s.name AS survey, c.source, public.ST_XMin(c.area) AS chainage_from, public.ST_XMax(c.area) AS chainage_to,
       public.ST_YMin(c.area) AS arc_from, public.ST_YMax(c.area) AS arc_to, c.recorded_by, c.recorded_at
  FROM tunnel.crack_search c JOIN tunnel.survey s ON s.id = c.survey_id;
COMMENT ON VIEW tunnel_api.crack_search IS
    'Parts of the lining that were searched for cracks, recorded by tunneldb findings searched and findings trace. Elsewhere it is not known that there are no cracks';
COMMENT ON COLUMN tunnel_api.crack_search.chainage_from IS 'Least chainage, m';
COMMENT ON COLUMN tunnel_api.crack_search.chainage_to IS 'Greatest chainage, m';
COMMENT ON COLUMN tunnel_api.crack_search.arc_from IS 'Least arc, m, positive right looking up-chainage';
COMMENT ON COLUMN tunnel_api.crack_search.arc_to IS 'Greatest arc, m';

-- The lining is the length of the element times the girth of its sections, without the ground, searched for leaks or not: cracks can
-- come from photos of a survey without detection.
CREATE OR REPLACE FUNCTION tunnel_internal.element_cracks(survey_id int, set_id int)
RETURNS TABLE (element_id int, lining float8, searched_share float8, cracks int, length float8, longitudinal float8, transverse float8,
    oblique float8, width_mm float8)
LANGUAGE plpgsql STABLE STRICT PARALLEL SAFE SECURITY DEFINER ROWS 1000 SET search_path = pg_catalog, pg_temp SET jit = off
AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := survey_id;
    set_key constant int := set_id;
BEGIN
    RETURN QUERY
    WITH box AS MATERIALIZED (
        SELECT b.element_id, b.low, b.high, coalesce(above.girth, inside.girth, near.girth) AS girth,
               coalesce(above.first, inside.first, near.first) AS first, coalesce(above.last, inside.last, near.last) AS last
          FROM tunnel_internal.element_boxes(survey_key, set_key) b
         CROSS JOIN LATERAL (
               SELECT avg(greatest(least(b.arc_to, g.arc_right) - greatest(b.arc_from, g.arc_left), 0)) AS girth,
                      avg(greatest(b.arc_from, g.arc_left)) AS first, avg(least(b.arc_to, g.arc_right)) AS last FROM tunnel.ground g
                WHERE g.survey_id = survey_key AND g.n BETWEEN floor(b.low) AND ceil(b.high)) above
         CROSS JOIN LATERAL (
               SELECT avg(x.last - x.first) AS girth, avg(x.first) AS first, avg(x.last) AS last
                 FROM (SELECT greatest(b.arc_from, s.arc[1]) AS first, least(b.arc_to, s.arc[cardinality(s.arc)]) AS last
                         FROM tunnel.section s WHERE s.survey_id = survey_key AND s.chainage BETWEEN b.low AND b.high) x) inside
          LEFT JOIN LATERAL (
               SELECT x.last - x.first AS girth, x.first, x.last
                 FROM (SELECT greatest(b.arc_from, s.arc[1]) AS first, least(b.arc_to, s.arc[cardinality(s.arc)]) AS last
                         FROM tunnel.section s WHERE s.survey_id = survey_key AND s.chainage BETWEEN b.low - 50 AND b.high + 50
                        ORDER BY abs(s.chainage - (b.low + b.high) / 2) LIMIT 1) x) near ON true
    ), searched AS MATERIALIZED (
        SELECT public.ST_Subdivide(public.ST_Union(c.area)) AS area FROM tunnel.crack_search c WHERE c.survey_id = survey_key
    ), extent AS (
        SELECT b.element_id, sum((b.high - b.low) * b.girth) AS lining,
               least(sum(f.area) / nullif(sum((b.high - b.low) * greatest(b.last - b.first, 0)), 0), 1) AS searched
          FROM box b
         CROSS JOIN LATERAL (SELECT public.ST_MakeEnvelope(b.low, b.first, b.high, greatest(b.first, b.last)) AS rectangle) r
         CROSS JOIN LATERAL (
               SELECT coalesce(sum(public.ST_Area(public.ST_Intersection(s.area, r.rectangle))), 0) AS area
                 FROM searched s WHERE public.ST_Intersects(s.area, r.rectangle)) f
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
    SELECT e.id, coalesce(x.lining, 0), coalesce(x.searched, 0), coalesce(p.cracks, 0), coalesce(p.length, 0), coalesce(p.longitudinal, 0),
           coalesce(p.transverse, 0), coalesce(p.oblique, 0), p.width_mm
      FROM tunnel.element e
      LEFT JOIN extent x ON x.element_id = e.id
      LEFT JOIN part p ON p.element_id = e.id
     WHERE e.element_set_id = set_key;
END
$$;
COMMENT ON FUNCTION tunnel_internal.element_cracks(int, int) IS
'Counted cracks in the elements of a division in a survey: lining of the element within the survey (m²), share of it that was searched for cracks (0 to 1), number of cracks, their length in the element, in all and by orientation (m), and greatest width (mm)';

CREATE OR REPLACE VIEW tunnel_api.crack_density AS
SELECT s.id::bigint << 32 | e.id AS id, s.id AS survey_id, s.name AS survey, d.name AS element_set, e.id AS element_id, e.number, e.name,
       e.chainage_from, e.chainage_to, tunnel_api.station_label(s.tunnel_id, e.chainage_from) AS label_from,
       tunnel_api.station_label(s.tunnel_id, e.chainage_to) AS label_to, c.lining AS lining_area, c.searched_share,
       c.cracks, c.length AS crack_length,
       -- no crack is no density of 0 where nobody searched for cracks
       CASE WHEN c.cracks > 0 OR c.searched_share > 0 THEN c.length / nullif(c.lining, 0) END AS density,
       c.longitudinal AS longitudinal_length, c.transverse AS transverse_length, c.oblique AS oblique_length, c.width_mm
  FROM tunnel.survey s
  JOIN tunnel.element_set d ON d.tunnel_id = s.tunnel_id
 CROSS JOIN LATERAL tunnel_internal.element_cracks(s.id, d.id) c
  JOIN tunnel.element e ON e.id = c.element_id;
COMMENT ON VIEW tunnel_api.crack_density IS
    'Length of cracks by area of lining in each element of each survey. Select a survey and an element_set. The density is a lower bound where searched_share is less than 1';

COMMENT ON COLUMN tunnel_api.crack_density.element_set IS 'Name of the division of the tunnel';
COMMENT ON COLUMN tunnel_api.crack_density.element_id IS 'Id in element';
COMMENT ON COLUMN tunnel_api.crack_density.number IS 'Number of the element in its division, from 1';
COMMENT ON COLUMN tunnel_api.crack_density.name IS 'Name of the element';
COMMENT ON COLUMN tunnel_api.crack_density.chainage_from IS 'Chainage of its beginning, m';
COMMENT ON COLUMN tunnel_api.crack_density.chainage_to IS 'Chainage of its end, m';
COMMENT ON COLUMN tunnel_api.crack_density.label_from IS 'Station of its beginning, as 12+345.678';
COMMENT ON COLUMN tunnel_api.crack_density.label_to IS 'Station of its end';
COMMENT ON COLUMN tunnel_api.crack_density.lining_area IS 'Lining of the element within the survey, m²: length times girth of the sections, without the ground if stage ground found it';
COMMENT ON COLUMN tunnel_api.crack_density.searched_share IS 'Share of the lining that was searched for cracks (crack_search), 0 to 1';
COMMENT ON COLUMN tunnel_api.crack_density.cracks IS 'Number of counted cracks that reach into it';
COMMENT ON COLUMN tunnel_api.crack_density.crack_length IS 'Length of their parts in it, m';
COMMENT ON COLUMN tunnel_api.crack_density.density IS 'Length of cracks by area of lining, m per m²; NULL outside the survey, and where no crack is known and nothing was searched';
COMMENT ON COLUMN tunnel_api.crack_density.longitudinal_length IS 'Length of the longitudinal cracks, m';
COMMENT ON COLUMN tunnel_api.crack_density.transverse_length IS 'Length of the transverse cracks, m';
COMMENT ON COLUMN tunnel_api.crack_density.oblique_length IS 'Length of the oblique cracks, m';
COMMENT ON COLUMN tunnel_api.crack_density.width_mm IS 'Greatest width of a crack, mm; NULL: not stated';
