-- Points of a stretch of a survey, by its name. Needs the view point (views/survey.sql). The query is planned at each call
-- for the survey and its kilometres, so that partitions of other surveys are not opened.
CREATE OR REPLACE FUNCTION tunnel_api.points(survey text, chainage_from float8, chainage_to float8)
RETURNS SETOF tunnel_api.point
LANGUAGE plpgsql STABLE STRICT PARALLEL SAFE ROWS 100000
AS $$
BEGIN
    PERFORM tunnel_internal.in_order(chainage_from, chainage_to);
    -- Kilometres are those of the given axis; on the axis found a point may lie some metres into the next one.
    RETURN QUERY EXECUTE
        'SELECT p.* FROM tunnel_api.point p WHERE p.survey_id = $1 AND p.km BETWEEN $2 AND $3'
        ' AND p.chainage >= $4 AND p.chainage < $5'
        USING tunnel_api.survey_id(survey), greatest(floor((chainage_from - 50) / 1000), -1e6)::int,
              least(floor((chainage_to + 50) / 1000), 1e6)::int,
              chainage_from, chainage_to;
END
$$;
COMMENT ON FUNCTION tunnel_api.points(text, float8, float8) IS
'Points of a survey from one chainage (m) up to another, with the columns of the view point. Reads the partitions of that survey only';
