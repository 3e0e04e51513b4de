-- Runs and jobs that are no longer needed. For each result (survey, kilometre, stage and subject) these runs are kept: the
-- last attempt, the last success, the one that ended last, running ones, inputs of kept runs, and every import. Loading and
-- reading have no single result: each list of files and each setting is kept separately.

-- The parameters by which a run says which runs it was made from are those of tunnel.stage_input.
CREATE OR REPLACE FUNCTION tunnel_internal.run_inputs(stage text, parameters jsonb) RETURNS bigint[]
LANGUAGE sql STABLE PARALLEL SAFE STRICT
AS $$
    SELECT array_agg(i.id::bigint ORDER BY i.id::bigint)
      FROM tunnel.stage_input n
     CROSS JOIN LATERAL jsonb_array_elements_text(
               CASE jsonb_typeof($2 -> n.key) WHEN 'array' THEN $2 -> n.key ELSE jsonb_build_array($2 -> n.key) END) AS i (id)
     WHERE n.stage = $1 AND n.holds = 'run' AND i.id ~ '^[0-9]{1,18}$'
$$;
COMMENT ON FUNCTION tunnel_internal.run_inputs(text, jsonb) IS
    'Runs that a run used, by its stage and parameters; NULL if it used none';

-- For one survey, the runs of all surveys of its tunnel are examined, since only those refer to each other.
CREATE OR REPLACE FUNCTION tunnel_internal.superseded_runs(survey_id int DEFAULT NULL, before timestamptz DEFAULT 'infinity')
RETURNS TABLE (id bigint, survey_id integer, km integer, stage text, outcome text, started_at timestamptz, bytes integer)
LANGUAGE sql STABLE PARALLEL RESTRICTED SECURITY DEFINER ROWS 5000 SET search_path = pg_catalog, pg_temp SET jit = off
AS $$
    WITH RECURSIVE ledger AS MATERIALIZED (
        SELECT r.id, r.survey_id, r.km, r.stage, r.outcome, r.started_at, r.job_id, r.finished_at, r.backend_pid, r.backend_start,
               pg_column_size(r.*) AS bytes, tunnel_internal.run_inputs(r.stage, r.parameters) AS inputs,
               CASE WHEN r.stage IN ('load', 'read') THEN r.parameters ELSE to_jsonb(r.subject) END AS result
          FROM tunnel.run r
         WHERE $1 IS NULL OR r.survey_id = ANY (ARRAY(SELECT o.id FROM tunnel.survey s JOIN tunnel.survey o USING (tunnel_id)
                                                       WHERE s.id = $1))
    ), ranked AS MATERIALIZED (
        SELECT l.*,
               row_number() OVER (PARTITION BY l.survey_id, l.km, l.stage, l.result ORDER BY l.started_at DESC, l.id DESC) AS attempt,
               row_number() OVER (PARTITION BY l.survey_id, l.km, l.stage, l.result, l.outcome
                                  ORDER BY l.started_at DESC, l.id DESC) AS latest,
               row_number() OVER (PARTITION BY l.survey_id, l.km, l.stage, l.result, l.outcome
                                  ORDER BY l.finished_at DESC, l.id DESC) AS finished
          FROM ledger l
    ), keep AS (
        SELECT l.id, l.inputs
          FROM ranked l
         WHERE l.attempt = 1 OR l.stage = 'import' OR l.started_at >= $2
            OR l.outcome = 'done' AND (l.latest = 1 OR l.finished = 1)
            OR l.outcome = 'running' AND tunnel_internal.session_lives(l.backend_pid, l.backend_start)
            OR EXISTS (SELECT FROM tunnel_queue.procrastinate_jobs j WHERE j.id = l.job_id AND j.status IN ('todo', 'doing'))
         UNION
        SELECT l.id, l.inputs
          FROM keep k
         CROSS JOIN LATERAL unnest(k.inputs) AS i (id)
          JOIN ledger l ON l.id = i.id
    )
    SELECT l.id, l.survey_id, l.km, l.stage, l.outcome, l.started_at, l.bytes
      FROM ledger l
     WHERE ($1 IS NULL OR l.survey_id = $1) AND NOT EXISTS (SELECT FROM keep k WHERE k.id = l.id)
$$;
COMMENT ON FUNCTION tunnel_internal.superseded_runs(int, timestamptz) IS
    'Runs of one survey, or of all, that began before a moment and are no longer needed for states, results or staleness. bytes: of the row';

CREATE OR REPLACE FUNCTION tunnel_internal.superseded_jobs(survey_id int DEFAULT NULL, before timestamptz DEFAULT 'infinity')
RETURNS TABLE (id bigint, survey_id integer, state text, ended_at timestamptz, rows bigint, bytes bigint)
LANGUAGE sql STABLE PARALLEL RESTRICTED SECURITY DEFINER ROWS 5000 SET search_path = pg_catalog, pg_temp SET jit = off
AS $$
    WITH needed AS MATERIALIZED (
        SELECT r.job_id FROM tunnel.run r WHERE r.job_id IS NOT NULL
        EXCEPT ALL
        SELECT r.job_id FROM tunnel_internal.superseded_runs($1, $2) s JOIN tunnel.run r ON r.id = s.id WHERE r.job_id IS NOT NULL
    ), event AS (
        SELECT v.job_id, max(v.at) AS at, count(*) AS rows, sum(pg_column_size(v.*)) AS bytes
          FROM tunnel_queue.procrastinate_events v GROUP BY v.job_id
    )
    SELECT j.id, (j.args ->> 'survey_id')::integer, j.status::text, v.at, 1 + coalesce(v.rows, 0),
           pg_column_size(j.*) + coalesce(v.bytes, 0)
      FROM tunnel_queue.procrastinate_jobs j
      LEFT JOIN event v ON v.job_id = j.id
     WHERE j.status NOT IN ('todo', 'doing') AND j.queue_name = 'tunneldb' AND (v.at < $2) IS NOT FALSE
       AND ($1 IS NULL OR (j.args ->> 'survey_id')::integer = $1)
       AND NOT EXISTS (SELECT FROM needed n WHERE n.job_id = j.id)
$$;
COMMENT ON FUNCTION tunnel_internal.superseded_jobs(int, timestamptz) IS
    'Jobs of one survey, or of all, that ended before a moment and have no run any more: rows and bytes, including their events';
