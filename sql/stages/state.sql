-- State of the results of stages and measures, as tunnel.stage and tunnel.stage_input define their inputs. Each measure NAME
-- has two functions (sql/measures/): NAME_places returns the places where a result exists or can exist, NAME_inputs the inputs
-- from which it would be made now. Needs last_runs and stage_state.

-- Inputs of a result, as its run stores them in its parameters.
CREATE OR REPLACE FUNCTION tunnel_internal.result_inputs(survey_id int, stage text, km int, subject text) RETURNS jsonb
LANGUAGE plpgsql STABLE STRICT PARALLEL SAFE SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
DECLARE
    inputs jsonb;
BEGIN
    EXECUTE format('SELECT tunnel_internal.%I($1, $2, $3)', $2 || '_inputs') INTO inputs USING $1, $3, $4;
    RETURN inputs;
END
$$;
COMMENT ON FUNCTION tunnel_internal.result_inputs(int, text, int, text) IS
    'Runs and checksums that a new result of a measure in a kilometre would use';

-- A result is out of date if a stage that it reads is out of date (blocked_by names that stage), if it was never made, or if one
-- of its inputs differs from the parameters of its last run. The subject of a stage that it reads is the end of its own subject:
-- for a pair of surveys and a layer, the layer.
CREATE OR REPLACE FUNCTION tunnel_internal.result_state(survey_id int, of_stage text, of_subject text DEFAULT NULL)
RETURNS TABLE (km int, subject text, older_id int, run_id bigint, done_at timestamptz, parameters jsonb, blocked_by text, reason text)
LANGUAGE plpgsql STABLE CALLED ON NULL INPUT PARALLEL RESTRICTED SECURITY DEFINER ROWS 50
SET search_path = pg_catalog, pg_temp
SET jit = off
AS $$
#variable_conflict use_column
DECLARE
    sources text[];
    pair boolean;
BEGIN
    SELECT s.reads, EXISTS (SELECT FROM tunnel.stage_input i WHERE i.stage = s.name AND i.holds = 'survey') INTO sources, pair
      FROM tunnel.stage s WHERE s.name = $2 AND s.on_demand;
    IF NOT FOUND THEN
        RETURN QUERY
        SELECT t.km, ''::text, NULL::int, t.run_id, t.done_at, t.done_parameters, NULL::text, t.reason
          FROM tunnel_internal.stage_state($1) t WHERE t.stage = $2;
        RETURN;
    END IF;
    RETURN QUERY EXECUTE format($query$
        WITH place AS MATERIALIZED (
            SELECT p.km, p.subject, p.present, p.reason, CASE WHEN $4 THEN split_part(p.subject, ' ', 1)::int END AS older_id
              FROM tunnel_internal.%I($1, $3) p
        ), source AS MATERIALIZED (
            SELECT v.id AS survey_id, n.stage, n.number, t.km, t.subject, t.reason
              FROM (SELECT DISTINCT p.older_id AS id FROM place p WHERE p.older_id IS NOT NULL UNION ALL SELECT $1) v
             CROSS JOIN unnest($5) WITH ORDINALITY AS n (stage, number)
             CROSS JOIN LATERAL tunnel_internal.result_state(v.id, n.stage) t
             WHERE t.reason IS NOT NULL
        )
        SELECT p.km, p.subject, p.older_id, l.id, l.finished_at, l.parameters, b.stage,
               CASE WHEN NOT p.present THEN p.reason
                    WHEN b.stage IS NOT NULL THEN concat(b.stage, b.survey, ' is stale: ', b.reason)
                    WHEN l.id IS NULL THEN 'never ran'
                    ELSE coalesce(c.reason, p.reason)
               END
          FROM place p
          LEFT JOIN tunnel_internal.last_runs($1, $2) l ON l.km = p.km AND l.subject = p.subject
          LEFT JOIN LATERAL (
                SELECT s.stage, s.reason,
                       CASE WHEN s.survey_id = p.older_id THEN ' of the older survey' WHEN $4 THEN ' of the newer survey' END AS survey
                  FROM source s
                 WHERE p.present AND s.km = p.km AND s.survey_id IN ($1, p.older_id)
                   AND right(p.subject, length(s.subject)) = s.subject
                 ORDER BY s.survey_id IS DISTINCT FROM p.older_id, s.number LIMIT 1) b ON true
          LEFT JOIN LATERAL (
                SELECT i.reason
                  FROM (SELECT tunnel_internal.%I($1, p.km, p.subject) AS inputs OFFSET 0) n
                  JOIN tunnel.stage_input i ON i.stage = $2 AND i.holds <> 'survey'
                 WHERE l.id IS NOT NULL AND l.parameters -> i.key IS DISTINCT FROM n.inputs -> i.key
                 ORDER BY i.number LIMIT 1) c ON true
        $query$, $2 || '_places', $2 || '_inputs')
    USING $1, $2, $3, pair, sources;
END
$$;
COMMENT ON FUNCTION tunnel_internal.result_state(int, text, text) IS
    'State of the results of a measure in a survey, by kilometre and subject: last successful run, and why the result is out of date, if it is. blocked_by: stage that must run first. Without a subject, all existing and possible results; with a subject, also results that were never made';

CREATE OR REPLACE VIEW tunnel_api.result_status AS
SELECT hashtextextended(concat_ws(' ', s.id, g.name, t.km, t.subject), 0) & 9007199254740991 AS id,
       s.id AS survey_id, s.name AS survey, g.name AS stage, t.km,
       CASE WHEN t.older_id IS NULL THEN t.subject ELSE substr(t.subject, length(t.older_id::text) + 2) END AS subject,
       o.name AS older_survey, t.done_at, t.reason IS NOT NULL AS stale, t.blocked_by, t.reason, t.parameters
  FROM tunnel.survey s
 CROSS JOIN tunnel.stage g
 CROSS JOIN LATERAL tunnel_internal.result_state(s.id, g.name) t
  LEFT JOIN tunnel.survey o ON o.id = t.older_id
 WHERE g.on_demand;
COMMENT ON VIEW tunnel_api.result_status IS
    'State of the results of measures, one row for each measure, kilometre and subject';
COMMENT ON COLUMN tunnel_api.result_status.stage IS 'Measure: deviation, evenness, thickness, clearance, rings, compare';
COMMENT ON COLUMN tunnel_api.result_status.subject IS
    'Layer of the profiles, or track and gauge; empty if a kilometre has one result only';
COMMENT ON COLUMN tunnel_api.result_status.older_survey IS 'Name of the older survey; NULL for a measure of one survey';
COMMENT ON COLUMN tunnel_api.result_status.done_at IS 'Time of the last result; NULL if there is none';
COMMENT ON COLUMN tunnel_api.result_status.stale IS
    'True if there is no result, or something that it depends on changed since';
COMMENT ON COLUMN tunnel_api.result_status.blocked_by IS 'Stage that is out of date itself and must run first; NULL if none';
COMMENT ON COLUMN tunnel_api.result_status.reason IS 'Reason why it is stale';
COMMENT ON COLUMN tunnel_api.result_status.parameters IS 'Parameters of the last run: its inputs and options';
