-- Last runs of stages, from which status, notes and staleness are derived. The ledger contains all runs. The last ones are
-- read by skipping through its index (survey_id, stage, km, subject, started_at, id), so that the cost depends on the number
-- of places, not of runs. Runs are ordered by their start time.

-- The index is read backwards from a run to the first run of the previous place, which is the last run there.
CREATE OR REPLACE FUNCTION tunnel_internal.last_runs_of(
    survey_ids int[], stages text[], succeeded boolean DEFAULT true, km_from int DEFAULT -1000000, km_to int DEFAULT 1000000)
RETURNS SETOF tunnel.run
LANGUAGE plpgsql STABLE STRICT PARALLEL SAFE SECURITY DEFINER ROWS 25
SET search_path = pg_catalog, pg_temp
SET jit = off
SET enable_seqscan = off
SET enable_bitmapscan = off
SET enable_nestloop = on
SET plan_cache_mode = force_generic_plan  -- planning takes longer than a stage
AS $$
BEGIN
    RETURN QUERY
    WITH RECURSIVE last AS (
        SELECT l.*
          FROM unnest($1) AS s (id)
         CROSS JOIN unnest($2) AS g (stage)
         CROSS JOIN LATERAL (
                SELECT r.* FROM tunnel.run r
                 WHERE r.survey_id = s.id AND r.stage = g.stage AND r.km >= $4 AND r.km <= $5 AND (r.outcome = 'done' OR NOT $3)
                 ORDER BY r.km DESC, r.subject DESC, r.started_at DESC, r.id DESC LIMIT 1) l
         WHERE tunnel_internal.in_order($4, $5, 'km')
         UNION ALL
        SELECT n.*
          FROM last l
         CROSS JOIN LATERAL (
                SELECT r.* FROM tunnel.run r
                 WHERE r.survey_id = l.survey_id AND r.stage = l.stage AND (r.km, r.subject) < (l.km, l.subject) AND r.km >= $4
                   AND (r.outcome = 'done' OR NOT $3)
                 ORDER BY r.km DESC, r.subject DESC, r.started_at DESC, r.id DESC LIMIT 1) n
    )
    SELECT l.* FROM last l;
END
$$;
COMMENT ON FUNCTION tunnel_internal.last_runs_of(int[], text[], boolean, int, int) IS
'Result of last_runs for several stages and surveys';


-- The planner inlines the body.
CREATE OR REPLACE FUNCTION tunnel_internal.last_runs(
    survey_id int, stage text, succeeded boolean DEFAULT true, km_from int DEFAULT -1000000, km_to int DEFAULT 1000000)
RETURNS SETOF tunnel.run
LANGUAGE sql STABLE CALLED ON NULL INPUT PARALLEL SAFE ROWS 25
AS $$ SELECT r.* FROM tunnel_internal.last_runs_of(ARRAY[$1], ARRAY[$2], $3, $4, $5) r $$;
COMMENT ON FUNCTION tunnel_internal.last_runs(int, text, boolean, int, int) IS
'Last successful run of a stage in each kilometre of a survey from km_from to km_to, for each subject (layer, older survey, track and gauge). With false, the last run that began';


CREATE OR REPLACE FUNCTION tunnel_internal.last_run(survey_id int, stage text, km int, subject text DEFAULT '') RETURNS bigint
LANGUAGE sql STABLE STRICT PARALLEL SAFE SECURITY DEFINER
SET search_path = pg_catalog, pg_temp
AS $$
    SELECT r.id FROM tunnel.run r
     WHERE r.survey_id = $1 AND r.stage = $2 AND r.km = $3 AND r.subject = $4 AND r.outcome = 'done'
     ORDER BY r.started_at DESC, r.id DESC LIMIT 1
$$;
COMMENT ON FUNCTION tunnel_internal.last_run(int, text, int, text) IS
'Last successful run of a stage in one kilometre of a survey, for one subject; NULL if there is none';


-- Stages with runs in kilometres of a survey, by skipping through the same index.
CREATE OR REPLACE FUNCTION tunnel_internal.stages_run(survey_id int) RETURNS SETOF text
LANGUAGE sql STABLE STRICT PARALLEL SAFE SECURITY DEFINER ROWS 10
SET search_path = pg_catalog, pg_temp
SET jit = off
SET enable_seqscan = off
SET enable_bitmapscan = off
SET enable_nestloop = on
AS $$
    WITH RECURSIVE part AS (
        (SELECT r.stage FROM tunnel.run r WHERE r.survey_id = $1 ORDER BY r.stage LIMIT 1)
         UNION ALL
        SELECT n.stage
          FROM part p
         CROSS JOIN LATERAL (
                SELECT r.stage FROM tunnel.run r WHERE r.survey_id = $1 AND r.stage > p.stage ORDER BY r.stage LIMIT 1) n
    )
    SELECT p.stage FROM part p
$$;
COMMENT ON FUNCTION tunnel_internal.stages_run(int) IS 'Stages that have runs in the ledger of a survey, by name';
