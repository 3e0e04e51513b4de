-- Queue of jobs: jobs that are ready, and lost workers. Goals are in tunnel.goal and tunnel.incoming, results in tunnel.run;
-- the jobs are procrastinate's (schema tunnel_queue).

-- Order the results of a survey: a transaction that commits a result takes this lock first and holds it until the commit, and
-- each run takes it just before it begins. A run therefore sees every result with an earlier time, and one transaction at a
-- time determines the next jobs.
CREATE OR REPLACE FUNCTION tunnel_internal.queue_lock(survey_id integer) RETURNS void
LANGUAGE sql VOLATILE STRICT PARALLEL UNSAFE
AS $$ SELECT tunnel_internal.wait_lock(-2, survey_id, false, 'the queue of survey ' || survey_id) $$;
COMMENT ON FUNCTION tunnel_internal.queue_lock(integer) IS
    'Wait until nobody commits a result of the survey, and block others until the transaction ends';

-- What becomes of each stage that is wanted of each kilometre:
--   done     it is there, nothing that it rests on has changed since, and it was made with the parameters that are wanted
--   running, queued  there is a job for it
--   ready    there could be one
--   waits    for a file, an earlier stage, or a neighbour's that is still to come
--   failed   with a message: its last run failed, and neither the parameters nor what it rests on has changed since, nor was
--            asked to try again (goal.retry_after); or, for load, a file that touches the kilometre failed
--   blocked  an earlier stage of the kilometre failed
--   empty    the kilometre holds no points, and awaits none
-- A neighbour that is failed, blocked or empty, or of which the stage is not wanted, is not waited for. Stages reach no farther
-- than as many kilometres as there are stages after the first: a range is judged with one more than these on both sides.
CREATE OR REPLACE FUNCTION tunnel_internal.queue_state(survey_id integer, km_from integer DEFAULT -1000000, km_to integer DEFAULT 1000000)
RETURNS TABLE (km integer, step integer, stage text, state text, message text)
LANGUAGE sql STABLE STRICT PARALLEL RESTRICTED SECURITY DEFINER ROWS 5000
SET search_path = pg_catalog, pg_temp
SET jit = off
SET enable_nestloop = off  -- how few or many rows there are is not known when it is planned
AS $$
    WITH RECURSIVE stage AS MATERIALIZED (  -- the stages that each waits for, by their numbers: here, and on both neighbours
        SELECT s.step, s.name, s.parameters,
               ARRAY(SELECT o.step FROM tunnel.stage o WHERE o.name = ANY (s.reads)) AS here,
               ARRAY(SELECT o.step FROM tunnel.stage o WHERE o.name = ANY (s.reads_beside)) AS beside
          FROM tunnel.stage s WHERE NOT s.on_demand
    ), need AS MATERIALIZED (
        SELECT s.step, w.way, n.source
          FROM stage s CROSS JOIN (VALUES (-1), (0), (1)) AS w (way)
         CROSS JOIN LATERAL unnest(CASE w.way WHEN 0 THEN s.here ELSE s.beside END) AS n (source)
    ), span AS MATERIALIZED (
        SELECT $2 - count(*)::integer AS first, $3 + count(*)::integer AS last FROM stage
         WHERE tunnel_internal.in_order($2, $3, 'km')
    ), goal AS (
        SELECT g.km, s.step AS target, g.parameters, g.retry_after
          FROM tunnel.goal g CROSS JOIN span p JOIN stage s ON s.name = g.stage
         WHERE g.survey_id = $1 AND g.km BETWEEN p.first AND p.last
    ), family AS (  -- parameters by stage; load's are those of its files
        SELECT p.prefix, s.step FROM stage s CROSS JOIN LATERAL unnest(s.parameters) AS p (prefix)
    ), wish AS (
        SELECT p.parameters, f.step, jsonb_object_agg(e.key, e.value) AS part
          FROM (SELECT DISTINCT g.parameters FROM goal g) AS p
         CROSS JOIN LATERAL jsonb_each(p.parameters) AS e
          JOIN family f ON f.prefix = split_part(e.key, '.', 1)
         GROUP BY p.parameters, f.step
    ), file AS (
        SELECT k.km, bool_or(i.failed_at IS NULL) AS awaited,
               min(CASE WHEN strpos(i.message, i.name) = 0 THEN format('file %s: %s', i.name, i.message) ELSE i.message END)
                   FILTER (WHERE i.failed_at IS NOT NULL) AS message
          FROM tunnel.incoming i
         CROSS JOIN span p
         CROSS JOIN LATERAL generate_series(greatest(i.km_from, p.first), least(i.km_to, p.last)) AS k (km)
         WHERE i.survey_id = $1 AND i.km_from IS NOT NULL  -- a file without kilometres fails none
         GROUP BY k.km
    ), job AS (
        SELECT j.queueing_lock, bool_or(j.status = 'doing') AS doing, min(j.args ->> 'stage') AS stage
          FROM tunnel_queue.procrastinate_jobs j
         WHERE j.status IN ('todo', 'doing')
         GROUP BY j.queueing_lock
    ), judged AS (
        SELECT s.km, s.step, s.stage, s.outcome, s.started_at, s.finished_at, s.input_at, s.message, g.target, g.retry_after,
               coalesce(w.part, '{}') AS part, s.parameters, f.message AS lost, coalesce(f.awaited, false) AS awaited,
               s.step = 1 AND s.input_at IS NULL AND f.km IS NULL
               AND to_regclass(format('tunnel.point_s%s_km%s', $1, s.km)) IS NULL AS empty,
               CASE s.step WHEN 1 THEN s.input_at IS NOT NULL OR coalesce(f.awaited, false)
                           ELSE s.done_at IS NULL OR s.outdated OR NOT s.done_parameters @> coalesce(w.part, '{}') END AS due
          FROM tunnel_internal.stage_state($1, (SELECT p.first FROM span p), (SELECT p.last FROM span p)) s
          JOIN goal g ON g.km = s.km
          LEFT JOIN wish w ON w.parameters = g.parameters AND w.step = s.step
          LEFT JOIN file f ON f.km = s.km
         WHERE s.step <= g.target
    ), failing AS (
        SELECT j.*,
               CASE WHEN j.step = 1 AND j.lost IS NOT NULL THEN j.lost
                    WHEN j.due AND j.outcome = 'failed' AND j.parameters @> j.part
                     AND NOT (j.step = 1 AND j.awaited)
                     AND (j.input_at > j.started_at) IS NOT TRUE AND (j.finished_at < j.retry_after) IS NOT TRUE
                    THEN coalesce(j.message, 'failed') END AS failure
          FROM judged j
    ), cell AS MATERIALIZED (
        SELECT f.*, bool_or(f.failure IS NOT NULL OR f.empty) OVER (PARTITION BY f.km ORDER BY f.step) AS hopeless,
               bool_or(f.empty) OVER (PARTITION BY f.km) AS void
          FROM failing f
    ), open AS (  -- what is still to be done, and what rests on it
        SELECT c.km, c.step FROM cell c WHERE c.due AND NOT c.hopeless
         UNION
        SELECT c.km, c.step
          FROM open o
          JOIN need n ON n.source = o.step
          JOIN cell c ON c.km = o.km - n.way AND c.step = n.step AND NOT c.hopeless
    ), ahead AS (
        SELECT o.km, array_agg(o.step) AS steps FROM open o GROUP BY o.km
    )
    SELECT c.km, c.step, c.stage,
           CASE WHEN j.doing AND j.stage = c.stage THEN 'running'
                WHEN j.stage = c.stage THEN 'queued'
                WHEN c.failure IS NOT NULL THEN 'failed'
                WHEN c.void THEN 'empty'
                WHEN c.hopeless THEN 'blocked'
                WHEN here.steps IS NULL OR c.step <> ALL (here.steps) THEN 'done'
                WHEN NOT c.due OR j.queueing_lock IS NOT NULL OR c.step = 1 AND c.awaited
                  OR here.steps && s.here OR before.steps && s.beside OR after.steps && s.beside
                THEN 'waits'
                ELSE 'ready' END,
           c.failure
      FROM cell c
      JOIN stage s ON s.step = c.step
      LEFT JOIN job j ON j.queueing_lock = format('s%s.km%s', $1, c.km)
      LEFT JOIN ahead here ON here.km = c.km
      LEFT JOIN ahead before ON before.km = c.km - 1
      LEFT JOIN ahead after ON after.km = c.km + 1
     WHERE c.km BETWEEN $2 AND $3
$$;
COMMENT ON FUNCTION tunnel_internal.queue_state(integer, integer, integer) IS
    'State of each requested stage in each kilometre of a survey: done, running, queued, ready, waits, failed, blocked or empty';

-- Reach of a result: number of kilometres on both sides in which a stage can become ready.
CREATE OR REPLACE FUNCTION tunnel_internal.queue_reach() RETURNS integer
LANGUAGE sql STABLE STRICT PARALLEL RESTRICTED SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$ SELECT count(*)::integer - 1 FROM tunnel.stage WHERE NOT on_demand $$;
COMMENT ON FUNCTION tunnel_internal.queue_reach() IS
    'Number of kilometres on both sides in which a stage can become ready after a result in one kilometre: one for each later stage';

-- Queue a job for each file to read and each ready stage, and return the number of jobs. A transaction that commits a result
-- calls it last, for the kilometre and queue_reach on both sides, so that the new jobs commit together with the result. A
-- kilometre precedes the next one, and a later stage precedes an earlier one, so that kilometres are finished one after the
-- other and few fragments wait. The last stage lags by eight kilometres: nothing waits for it, and it keeps workers busy at
-- the end.
CREATE OR REPLACE FUNCTION tunnel_internal.queue_plan(survey_id integer, km_from integer DEFAULT -1000000, km_to integer DEFAULT 1000000)
RETURNS integer
LANGUAGE plpgsql VOLATILE STRICT PARALLEL UNSAFE
AS $$
DECLARE
    found tunnel_queue.procrastinate_job_to_defer_v1[];
BEGIN
    PERFORM tunnel_internal.queue_lock(survey_id);
    WITH job AS (
        SELECT j.queueing_lock FROM tunnel_queue.procrastinate_jobs j WHERE j.status IN ('todo', 'doing')
    ), ready AS (
        SELECT 'read' AS task, coalesce(-10 * i.km_from, 10000000) AS priority,  -- kilometres unknown: first
               format('s%s.f%s', queue_plan.survey_id, i.name) AS lock,
               jsonb_build_object('survey_id', queue_plan.survey_id, 'file', i.name, 'stage', 'read') AS args
          FROM tunnel.incoming i
         WHERE i.survey_id = queue_plan.survey_id AND i.failed_at IS NULL
         UNION ALL
        SELECT 'stage', -10 * (s.km + CASE s.step WHEN (SELECT max(t.step) FROM tunnel.stage t WHERE NOT t.on_demand) THEN 8 ELSE 0 END) + s.step,
               format('s%s.km%s', queue_plan.survey_id, s.km),
               jsonb_build_object('survey_id', queue_plan.survey_id, 'km', s.km, 'stage', s.stage)
          FROM tunnel_internal.queue_state(queue_plan.survey_id, queue_plan.km_from, queue_plan.km_to) s
         WHERE s.state = 'ready'
    )
    SELECT array_agg(ROW ('tunneldb', r.task, r.priority, r.lock, r.lock, r.args, NULL)
                         ::tunnel_queue.procrastinate_job_to_defer_v1 ORDER BY r.priority DESC, r.lock)
      INTO found
      FROM ready r
     WHERE r.lock NOT IN (SELECT j.queueing_lock FROM job j WHERE j.queueing_lock IS NOT NULL);
    PERFORM tunnel_queue.procrastinate_defer_jobs_v1(found);
    RETURN coalesce(cardinality(found), 0);
END
$$;
COMMENT ON FUNCTION tunnel_internal.queue_plan(integer, integer, integer) IS
    'Queue the jobs of a survey that are ready (files to read, stages of kilometres), and return their number. Holds queue_lock until the transaction ends';

-- Lock the row of a job until the end of the transaction. True if the worker still runs it; false if the worker was
-- considered lost and another one has the job: then the result must not be committed.
CREATE OR REPLACE FUNCTION tunnel_internal.queue_hold(job_id bigint, worker_id bigint) RETURNS boolean
LANGUAGE sql VOLATILE STRICT PARALLEL UNSAFE
AS $$
    SELECT EXISTS (SELECT FROM (SELECT j.status, j.worker_id FROM tunnel_queue.procrastinate_jobs j
                                 WHERE j.id = $1 FOR UPDATE) AS j
                    WHERE j.status = 'doing' AND j.worker_id = $2)
$$;
COMMENT ON FUNCTION tunnel_internal.queue_hold(bigint, bigint) IS 'Lock a job, and return true if the worker still runs it';

-- Request the kilometres that got points of a file that was read: they are processed to the stage that the batch requested for
-- the file's points, whatever its header states; kilometres beyond those of the batch, and those of files that had to be read
-- again, are only loaded. A later stage that was requested before stays.
CREATE OR REPLACE FUNCTION tunnel_internal.queue_request(survey_id integer, file text) RETURNS void
LANGUAGE sql VOLATILE STRICT PARALLEL UNSAFE
AS $$
    WITH touched AS (
        SELECT i.survey_id, k.km, i.stage, i.parameters, i.stage_parameters,
               i.stage IS NOT NULL AND bool_or(f.name = i.name) AND coalesce(i.kilometres @> k.km, true) AS runs
          FROM tunnel.incoming i
          JOIN tunnel.scan_file f ON f.survey_id = i.survey_id
          JOIN tunnel.file_km k ON k.file_id = f.id AND k.loaded_at IS NULL
         WHERE i.survey_id = $1 AND i.name = $2
         GROUP BY i.survey_id, i.name, k.km
    )
    INSERT INTO tunnel.goal AS g (survey_id, km, stage, parameters)
    SELECT t.survey_id, t.km, CASE WHEN t.runs THEN t.stage ELSE 'load' END, t.parameters || t.stage_parameters FROM touched t
        ON CONFLICT (survey_id, km) DO UPDATE
       SET stage = (SELECT s.name FROM tunnel.stage s WHERE s.name IN (g.stage, excluded.stage) ORDER BY s.step DESC LIMIT 1),
           parameters = g.parameters || coalesce((SELECT t.stage_parameters FROM touched t WHERE t.km = g.km AND t.runs), '{}')
$$;
COMMENT ON FUNCTION tunnel_internal.queue_request(integer, text) IS
    'Request the kilometres that got points of a file, up to the stage of its batch';

-- Withdraw the request of kilometres between two that a file was expected to touch and did not: those without points that await
-- no other file.
CREATE OR REPLACE FUNCTION tunnel_internal.queue_withdraw(survey_id integer, km_from integer, km_to integer) RETURNS void
LANGUAGE sql VOLATILE STRICT PARALLEL UNSAFE
AS $$
    DELETE FROM tunnel.goal g
     WHERE g.survey_id = $1 AND g.km BETWEEN $2 AND $3 AND tunnel_internal.in_order($2, $3, 'km')
       AND g.km IN (SELECT s.km FROM tunnel_internal.queue_state($1, $2, $3) s WHERE s.state = 'empty')
$$;
COMMENT ON FUNCTION tunnel_internal.queue_withdraw(integer, integer, integer) IS
    'Withdraw the request of kilometres that have no points and await no file';

-- Finish a job that succeeded, and queue what is ready now. A file that was read is removed from the list, unless it was
-- requested again after the job began. The kilometres that have its points are requested, and no others.
CREATE OR REPLACE FUNCTION tunnel_internal.queue_done(job_id bigint, started_at timestamptz) RETURNS void
LANGUAGE plpgsql VOLATILE STRICT PARALLEL UNSAFE
AS $$
DECLARE
    args constant jsonb := (SELECT j.args FROM tunnel_queue.procrastinate_jobs j WHERE j.id = job_id);
    survey constant integer := (args ->> 'survey_id')::integer;
    km constant integer := (args ->> 'km')::integer;
    reach constant integer := tunnel_internal.queue_reach();
    first integer;
    last integer;
    expected_from integer;
    expected_to integer;
BEGIN
    PERFORM tunnel_queue.procrastinate_finish_job_v1(job_id, 'succeeded', false);
    IF km IS NOT NULL THEN
        PERFORM tunnel_internal.queue_plan(survey, km - reach, km + reach);
        RETURN;
    END IF;
    PERFORM tunnel_internal.queue_request(survey, args ->> 'file');
    -- those that the file may touch, and those that were read anew
    SELECT least(min(i.km_from), min(k.km)) - reach, greatest(max(i.km_to), max(k.km)) + reach
      INTO first, last
      FROM tunnel.incoming i
      LEFT JOIN tunnel.scan_file f ON f.survey_id = i.survey_id
      LEFT JOIN tunnel.file_km k ON k.file_id = f.id AND k.read_at >= queue_done.started_at
     WHERE i.survey_id = survey AND i.name = args ->> 'file';
    DELETE FROM tunnel.incoming i
     WHERE i.survey_id = survey AND i.name = args ->> 'file' AND i.requested_at < queue_done.started_at
    RETURNING i.km_from, i.km_to INTO expected_from, expected_to;
    PERFORM tunnel_internal.queue_withdraw(survey, expected_from, expected_to);
    PERFORM tunnel_internal.queue_plan(survey, coalesce(first, -1000000), coalesce(last, 1000000));
END
$$;
COMMENT ON FUNCTION tunnel_internal.queue_done(bigint, timestamptz) IS
    'Finish a job that succeeded since a moment, and queue what is ready now';

-- Mark a job as failed for good, and queue what need not wait for it any more.
CREATE OR REPLACE FUNCTION tunnel_internal.queue_fail(job_id bigint, message text) RETURNS void
LANGUAGE plpgsql VOLATILE STRICT PARALLEL UNSAFE
AS $$
DECLARE
    args constant jsonb := (SELECT j.args FROM tunnel_queue.procrastinate_jobs j WHERE j.id = job_id);
    survey constant integer := (args ->> 'survey_id')::integer;
    reach constant integer := tunnel_internal.queue_reach();
    first integer;
    last integer;
BEGIN
    PERFORM tunnel_queue.procrastinate_finish_job_v1(job_id, 'failed', false);
    UPDATE tunnel.incoming i SET failed_at = clock_timestamp(), message = queue_fail.message
     WHERE i.survey_id = survey AND i.name = args ->> 'file'
    RETURNING i.km_from, i.km_to INTO first, last;
    first := coalesce(first, (args ->> 'km')::integer, -1000000);
    last := coalesce(last, (args ->> 'km')::integer, 1000000);
    PERFORM tunnel_internal.queue_plan(survey, first - reach, last + reach);
END
$$;
COMMENT ON FUNCTION tunnel_internal.queue_fail(bigint, text) IS
    'Mark a job as failed for good, and queue what need not wait for it any more';

-- Return the job of a lost worker to the queue. The 20th time it fails for good, since the job probably kills its workers.
CREATE OR REPLACE FUNCTION tunnel_internal.queue_return(job_id bigint) RETURNS void
LANGUAGE plpgsql VOLATILE STRICT PARALLEL UNSAFE
AS $$
DECLARE
    job tunnel_queue.procrastinate_jobs := (SELECT j FROM tunnel_queue.procrastinate_jobs j WHERE j.id = job_id);
    reason constant text := 'its worker or the server went down 20 times while at it, perhaps for lack of memory';
BEGIN
    IF job.attempts < 19 THEN
        PERFORM tunnel_queue.procrastinate_retry_job_v2(job_id, clock_timestamp(), NULL, NULL, NULL);
        PERFORM pg_notify('procrastinate_queue_v1#tunneldb', json_build_object('type', 'job_inserted', 'job_id', job_id)::text);
        RETURN;
    END IF;
    PERFORM tunnel_internal.queue_lock((job.args ->> 'survey_id')::integer);
    INSERT INTO tunnel.run (survey_id, km, stage, started_at, finished_at, outcome, message, job_id)
    SELECT (job.args ->> 'survey_id')::integer, (job.args ->> 'km')::integer, job.args ->> 'stage', clock_timestamp(),
           clock_timestamp(), 'failed', reason, job_id;
    PERFORM tunnel_internal.queue_fail(job_id, reason);
END
$$;
COMMENT ON FUNCTION tunnel_internal.queue_return(bigint) IS
    'Return the job of a lost worker to the queue; the 20th time it fails';

-- True if a worker is present: a session of its own holds this lock while it lives (queue_register).
CREATE OR REPLACE FUNCTION tunnel_internal.queue_present(worker_id bigint) RETURNS boolean
LANGUAGE sql VOLATILE STRICT PARALLEL RESTRICTED
AS $$
    SELECT EXISTS (SELECT FROM pg_locks l
                    WHERE l.locktype = 'advisory' AND l.classid = 4294967295::oid AND l.objid = worker_id::oid
                      AND l.objsubid = 2 AND l.granted
                      AND l.database = (SELECT d.oid FROM pg_database d WHERE d.datname = current_database()))
$$;
COMMENT ON FUNCTION tunnel_internal.queue_present(bigint) IS 'True if the session that a worker keeps open is alive';

-- Register a worker. The calling session must live as long as the worker.
CREATE OR REPLACE FUNCTION tunnel_internal.queue_register(worker_id bigint, host text, pid integer) RETURNS void
LANGUAGE sql VOLATILE STRICT PARALLEL UNSAFE
AS $$
    SELECT pg_advisory_lock(-1, worker_id::integer);
    INSERT INTO tunnel.worker (id, host, pid) VALUES (worker_id, host, pid) ON CONFLICT (id) DO NOTHING;
$$;
COMMENT ON FUNCTION tunnel_internal.queue_register(bigint, text, integer) IS
    'Register a worker, which is present as long as the calling session lives';

-- Take jobs from lost workers: those without a heartbeat for the given time, whose sessions are terminated, and killed ones,
-- whose own session and job session are gone. Deletes the rows of lost workers. Returns the number of jobs.
CREATE OR REPLACE FUNCTION tunnel_internal.queue_rescue(patience interval DEFAULT '25 seconds') RETURNS integer
LANGUAGE plpgsql VOLATILE STRICT PARALLEL UNSAFE
AS $$
DECLARE
    job record;
    rescued integer := 0;
BEGIN
    FOR job IN
        SELECT j.id
          FROM tunnel_queue.procrastinate_jobs j
          LEFT JOIN tunnel_queue.procrastinate_workers w ON w.id = j.worker_id
         WHERE j.status = 'doing' AND j.queue_name = 'tunneldb'
           AND CASE WHEN w.id IS NULL OR w.last_heartbeat < clock_timestamp() - patience THEN true
                    WHEN tunnel_internal.queue_present(w.id) THEN false
                    ELSE NOT EXISTS (SELECT FROM tunnel.run r
                                      WHERE r.job_id = j.id AND r.outcome = 'running'
                                        AND tunnel_internal.session_lives(r.backend_pid, r.backend_start)) END
           FOR UPDATE OF j SKIP LOCKED
    LOOP
        BEGIN
            PERFORM pg_terminate_backend(r.backend_pid) FROM tunnel.run r
              WHERE r.job_id = job.id AND r.outcome = 'running' AND r.backend_pid <> pg_backend_pid()
                AND tunnel_internal.session_lives(r.backend_pid, r.backend_start);
        EXCEPTION WHEN insufficient_privilege THEN NULL;  -- it ends by itself, and can't commit
        END;
        PERFORM tunnel_internal.queue_return(job.id);
        rescued := rescued + 1;
    END LOOP;
    DELETE FROM tunnel.worker v
     WHERE NOT EXISTS (SELECT FROM tunnel_queue.procrastinate_workers w
                        WHERE w.id = v.id AND w.last_heartbeat >= clock_timestamp() - patience)
        OR NOT tunnel_internal.queue_present(v.id)
       AND NOT EXISTS (SELECT FROM tunnel_queue.procrastinate_jobs j WHERE j.worker_id = v.id AND j.status = 'doing');
    RETURN rescued;
END
$$;
COMMENT ON FUNCTION tunnel_internal.queue_rescue(interval) IS
    'Take jobs from lost workers, return them to the queue, and return their number';

-- True if a survey has waiting or running jobs. If there are none, the batch is finished: each result queues the jobs that it
-- makes possible.
CREATE OR REPLACE FUNCTION tunnel_internal.queue_busy(survey_id integer) RETURNS boolean
LANGUAGE sql STABLE STRICT PARALLEL RESTRICTED SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
    SELECT EXISTS (SELECT FROM tunnel_queue.procrastinate_jobs j
                    WHERE j.status IN ('todo', 'doing') AND (j.args ->> 'survey_id')::integer = $1)
$$;
COMMENT ON FUNCTION tunnel_internal.queue_busy(integer) IS 'True if the survey has waiting or running jobs';
