-- Limit of what people take out of the totals by drawing, and what they did take out. A dry region excludes the open leaks in it.
-- A rejected drawing stands for the detected leaks beneath it, which then do not count either. The areas of both are added up for
-- each person and survey, so that many small ones are not more than a large one; a region that an operator approved is no longer
-- the person's.

CREATE OR REPLACE VIEW tunnel_internal.hiding AS
SELECT r.survey_id, r.drawn_by AS who, 'dry region' AS way, r.id::bigint AS id, public.ST_Area(r.geom) AS area,
       floor((public.ST_XMin(r.geom) + public.ST_XMax(r.geom)) / 2000)::int AS km, r.approved_by, l.leaks, l.leaks_area
  FROM tunnel.region r
 CROSS JOIN LATERAL (
        SELECT count(*) AS leaks, sum(a.area) AS leaks_area FROM tunnel.finding a
         WHERE a.dry_region_id = r.id AND a.review = 'open' AND a.merged_into IS NULL AND a.same_as IS NULL) l
 WHERE r.kind = 'dry'
 UNION ALL
SELECT h.survey_id, coalesce(h.reviewed_by, h.drawn_by), 'rejected drawing', h.id, public.ST_Area(h.unrolled), h.km, NULL,
       l.leaks, l.leaks_area
  FROM tunnel.finding h
 CROSS JOIN LATERAL (
        SELECT count(*) AS leaks, sum(a.area) AS leaks_area FROM tunnel.finding a
         WHERE a.same_as = h.id AND a.detected AND a.review <> 'rejected') l
 WHERE h.origin <> 'detected' AND h.wet AND h.review = 'rejected' AND h.merged_into IS NULL;
COMMENT ON VIEW tunnel_internal.hiding IS
    'Dry regions and rejected drawings, with area, person, and the detected leaks that each takes out of the totals';
COMMENT ON COLUMN tunnel_internal.hiding.survey_id IS 'Survey that the row belongs to';
COMMENT ON COLUMN tunnel_internal.hiding.who IS 'Role that drew the region, or rejected the drawing';
COMMENT ON COLUMN tunnel_internal.hiding.way IS 'dry region or rejected drawing';
COMMENT ON COLUMN tunnel_internal.hiding.id IS 'Id of the region or the finding';
COMMENT ON COLUMN tunnel_internal.hiding.area IS 'Area in the unrolled plane, m²';
COMMENT ON COLUMN tunnel_internal.hiding.km IS 'Kilometre of its middle';
COMMENT ON COLUMN tunnel_internal.hiding.approved_by IS 'Operator who approved the region';
COMMENT ON COLUMN tunnel_internal.hiding.leaks IS 'Number of leaks that it takes out of the totals';
COMMENT ON COLUMN tunnel_internal.hiding.leaks_area IS 'Area of these leaks, m²; NULL without any';

-- Waits for other transactions that take leaks out of the survey: two of one person at the same time count together.
CREATE OR REPLACE FUNCTION tunnel_internal.area_taken(survey_id int, who text, but_region int DEFAULT NULL) RETURNS float8
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE CALLED ON NULL INPUT SET search_path = pg_catalog, pg_temp AS $$
#variable_conflict use_variable
BEGIN
    PERFORM FROM tunnel.survey s WHERE s.id = survey_id FOR NO KEY UPDATE;
    RETURN (SELECT coalesce(sum(h.area), 0) FROM tunnel_internal.hiding h
             WHERE h.survey_id = area_taken.survey_id AND h.who = area_taken.who AND h.approved_by IS NULL
               AND (h.way <> 'dry region' OR h.id IS DISTINCT FROM but_region));
END
$$;
COMMENT ON FUNCTION tunnel_internal.area_taken(int, text, int) IS
    'Area of the dry regions, pending ones included and approved ones not, and of the rejected drawings of a person in a survey, m²; without one region';

-- Refuse a rejected drawing beyond the limit. Operators approve for themselves.
CREATE OR REPLACE FUNCTION tunnel_internal.check_hidden(finding_id bigint) RETURNS void
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    here record;
    taken float8;
BEGIN
    SELECT h.survey_id, h.who, s.name, t.dry_region_limit AS most INTO here
      FROM tunnel_internal.hiding h
      JOIN tunnel.survey s ON s.id = h.survey_id
      JOIN tunnel.tunnel t ON t.id = s.tunnel_id
     WHERE h.way = 'rejected drawing' AND h.id = finding_id;
    IF NOT FOUND OR (to_regrole('tunnel_operator') IS NOT NULL AND pg_has_role(here.who, 'tunnel_operator', 'USAGE')) THEN
        RETURN;
    END IF;
    taken := tunnel_internal.area_taken(here.survey_id, here.who);
    IF taken > here.most THEN
        RAISE EXCEPTION 'rejected drawings and dry regions of % in % would be % m², more than %', here.who, here.name,
            round(taken::numeric, 1), here.most
            USING ERRCODE = 'check_violation', HINT = 'Draw a dry region and give a reason: an operator approves it. Or an operator rejects the drawing.';
    END IF;
END
$$;
COMMENT ON FUNCTION tunnel_internal.check_hidden(bigint) IS
    'Raise an error if a finding is a rejected drawing of an inspector who thereby takes away more than dry_region_limit of the tunnel';
