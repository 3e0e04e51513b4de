-- What of the ledger and the queue nobody needs any more. What is kept of runs, of each kind of result (survey, kilometre, stage
-- and options) by itself: the last attempt; the last success, and that which bears the highest number, for staleness goes by
-- either; that which ended last; what runs; what a run that is kept was made from; and every import.

-- The names of the parameters by which a run says which runs it was made from, and then of those that tell the rest of it:
-- checksums of what people edit. See the functions tunnel_api.…_inputs.
CREATE OR REPLACE FUNCTION tunnel_api.run_input_names(stage text, runs boolean) RETURNS text[]
LANGUAGE sql IMMUTABLE PARALLEL SAFE CALLED ON NULL INPUT  -- not STRICT: then it is not called for each run, but put in its place
AS $$
    SELECT CASE WHEN $2 THEN
                CASE $1 WHEN 'compare' THEN ARRAY['detect_old', 'detect_new']
                        WHEN 'rings' THEN ARRAY['detect']
                        WHEN 'deviation' THEN ARRAY['detect']
                        WHEN 'thickness' THEN ARRAY['old', 'new']
                        WHEN 'evenness' THEN ARRAY['deviation']
                        WHEN 'clearance' THEN ARRAY['ground']
                        ELSE '{}' END
                ELSE
                CASE $1 WHEN 'compare' THEN ARRAY['leaks_old', 'leaks_new']
                        WHEN 'rings' THEN ARRAY['rings']
                        WHEN 'deviation' THEN ARRAY['profiles']
                        WHEN 'clearance' THEN ARRAY['outline']
                        WHEN 'members' THEN ARRAY['files', 'settings_at']
                        ELSE '{}' END
           END
$$;
COMMENT ON FUNCTION tunnel_api.run_input_names(text, boolean) IS
    'Parameters of a stage''s runs that say what it was made from: runs, or else checksums of the rest';

CREATE OR REPLACE FUNCTION tunnel_api.run_inputs(stage text, parameters jsonb) RETURNS bigint[]
LANGUAGE sql IMMUTABLE PARALLEL SAFE STRICT
AS $$
    SELECT array_agg(i.id::bigint ORDER BY i.id::bigint)
      FROM unnest(tunnel_api.run_input_names($1, true)) AS n (name)
     CROSS JOIN LATERAL jsonb_array_elements_text(
               CASE jsonb_typeof($2 -> n.name) WHEN 'array' THEN $2 -> n.name ELSE jsonb_build_array($2 -> n.name) END) AS i (id)
     WHERE i.id ~ '^[0-9]{1,18}$'
$$;
COMMENT ON FUNCTION tunnel_api.run_inputs(text, jsonb) IS 'Runs that a run was made from, by its stage and parameters; NULL without any';

-- The stages of a kilometre but load have one result each, whatever the parameters; so have rings. What is loaded or read goes by
-- the files, what is made on demand by what was asked for, such as the layer, the outline, or the survey compared with.
CREATE OR REPLACE FUNCTION tunnel_api.run_options(stage text, parameters jsonb) RETURNS jsonb
LANGUAGE sql IMMUTABLE PARALLEL SAFE CALLED ON NULL INPUT  -- as above
AS $$
    SELECT CASE WHEN $1 IN ('axis', 'segments', 'sections', 'ground', 'detect', 'rings') THEN '{}'
                ELSE $2 - tunnel_api.run_input_names($1, true) - tunnel_api.run_input_names($1, false) END
$$;
COMMENT ON FUNCTION tunnel_api.run_options(text, jsonb) IS
    'What tells the results of a stage apart that lie side by side in a kilometre: the run''s parameters without what it was made from';

CREATE OR REPLACE FUNCTION tunnel_api.superseded_runs(before timestamptz DEFAULT 'infinity')
RETURNS TABLE (id bigint, survey_id integer, km integer, stage text, outcome text, started_at timestamptz, bytes integer)
LANGUAGE sql STABLE STRICT PARALLEL RESTRICTED SECURITY DEFINER ROWS 5000 SET search_path = pg_catalog, pg_temp SET jit = off
AS $$
    WITH RECURSIVE ledger AS MATERIALIZED (
        SELECT r.id, r.survey_id, r.km, r.stage, r.outcome, r.started_at, r.job_id, r.finished_at, r.backend_pid, r.backend_start,
               pg_column_size(r.*) AS bytes,
               CASE WHEN tunnel_api.run_input_names(r.stage, true) <> '{}' THEN tunnel_api.run_inputs(r.stage, r.parameters) END AS inputs,
               tunnel_api.run_options(r.stage, r.parameters) AS options
          FROM tunnel.run r
    ), ranked AS MATERIALIZED (
        SELECT l.*,
               row_number() OVER (PARTITION BY l.survey_id, l.km, l.stage, l.options ORDER BY l.started_at DESC, l.id DESC) AS attempt,
               row_number() OVER (PARTITION BY l.survey_id, l.km, l.stage, l.options, l.outcome
                                  ORDER BY l.started_at DESC, l.id DESC) AS latest,
               row_number() OVER (PARTITION BY l.survey_id, l.km, l.stage, l.options, l.outcome
                                  ORDER BY l.finished_at DESC, l.id DESC) AS finished,
               max(l.id) OVER (PARTITION BY l.survey_id, l.km, l.stage, l.options, l.outcome) AS highest
          FROM ledger l
    ), keep AS (
        SELECT l.id, l.inputs
          FROM ranked l
         WHERE l.attempt = 1 OR l.stage = 'import' OR l.started_at >= $1
            OR l.outcome = 'done' AND (l.latest = 1 OR l.finished = 1 OR l.id = l.highest)
            OR l.outcome = 'running' AND tunnel_api.session_lives(l.backend_pid, l.backend_start)
            OR l.job_id IN (SELECT j.id FROM tunnel_queue.procrastinate_jobs j WHERE j.status IN ('todo', 'doing'))
         UNION
        SELECT l.id, l.inputs
          FROM keep k
         CROSS JOIN LATERAL unnest(k.inputs) AS i (id)
          JOIN ledger l ON l.id = i.id
    )
    SELECT l.id, l.survey_id, l.km, l.stage, l.outcome, l.started_at, l.bytes
      FROM ledger l
     WHERE NOT EXISTS (  -- by way of an array: the planner takes what recurs for billions of rows, and would hash them in as many files
           SELECT FROM unnest((SELECT array_agg(k.id) FROM keep k)) AS k (id) WHERE k.id = l.id)
$$;
COMMENT ON FUNCTION tunnel_api.superseded_runs(timestamptz) IS
    'Runs of the ledger that began before a moment and that nothing goes by any more: neither state nor result, nor whether it is stale; bytes: of the row';

CREATE OR REPLACE FUNCTION tunnel_api.superseded_jobs(before timestamptz DEFAULT 'infinity')
RETURNS TABLE (id bigint, survey_id integer, state text, ended_at timestamptz, rows bigint, bytes bigint)
LANGUAGE sql STABLE STRICT PARALLEL RESTRICTED SECURITY DEFINER ROWS 5000 SET search_path = pg_catalog, pg_temp SET jit = off
AS $$
    WITH needed AS MATERIALIZED (
        SELECT r.job_id FROM tunnel.run r WHERE r.job_id IS NOT NULL
        EXCEPT ALL
        SELECT r.job_id FROM tunnel_api.superseded_runs($1) s JOIN tunnel.run r ON r.id = s.id WHERE r.job_id IS NOT NULL
    ), event AS (
        SELECT v.job_id, max(v.at) AS at, count(*) AS rows, sum(pg_column_size(v.*)) AS bytes
          FROM tunnel_queue.procrastinate_events v GROUP BY v.job_id
    )
    SELECT j.id, (j.args ->> 'survey_id')::integer, j.status::text, v.at, 1 + coalesce(v.rows, 0),
           pg_column_size(j.*) + coalesce(v.bytes, 0)
      FROM tunnel_queue.procrastinate_jobs j
      LEFT JOIN event v ON v.job_id = j.id
     WHERE j.status NOT IN ('todo', 'doing') AND j.queue_name = 'tunneldb' AND (v.at < $1) IS NOT FALSE
       AND NOT EXISTS (SELECT FROM needed n WHERE n.job_id = j.id)
$$;
COMMENT ON FUNCTION tunnel_api.superseded_jobs(timestamptz) IS
    'Jobs of the queue that ended before a moment, and of which no run is kept: rows and bytes with those of what happened to it';
