-- Views of the queue: goals, files that wait to be read, jobs and workers. They read tunnel_queue (procrastinate's schema)
-- with their owner's rights.

CREATE OR REPLACE VIEW tunnel_api.goal AS
SELECT (g.survey_id::bigint * 1000000 + 500000 + g.km) AS id, g.survey_id, s.name AS survey, g.km, g.stage, g.parameters,
       g.requested_at, g.retry_after
  FROM tunnel.goal g
  JOIN tunnel.survey s ON s.id = g.survey_id;
COMMENT ON VIEW tunnel_api.goal IS 'Stages up to which batches process each kilometre';
COMMENT ON COLUMN tunnel_api.goal.stage IS 'Last stage to run';
COMMENT ON COLUMN tunnel_api.goal.retry_after IS 'Stages that failed before this time are tried again';

CREATE OR REPLACE VIEW tunnel_api.incoming AS
SELECT ('x' || left(md5(i.survey_id || '/' || i.name), 13))::bit(52)::bigint AS id, i.survey_id, s.name AS survey, i.name,
       tunnel_internal.for_operators(i.path) AS path, i.bytes, i.points, i.km_from, i.km_to,
       CASE WHEN i.failed_at IS NULL THEN 'waiting' ELSE 'failed' END AS state, i.requested_at, i.failed_at, i.message
  FROM tunnel.incoming i
  JOIN tunnel.survey s ON s.id = i.survey_id;
COMMENT ON VIEW tunnel_api.incoming IS
    'Files of a batch that wait to be read or failed. Files that were read are in tunnel_api.file';
COMMENT ON COLUMN tunnel_api.incoming.id IS 'Key, derived from survey and name';
COMMENT ON COLUMN tunnel_api.incoming.path IS 'Path of the file; visible to operators only';
COMMENT ON COLUMN tunnel_api.incoming.points IS 'Number of points by its header; 0 if unreadable';
COMMENT ON COLUMN tunnel_api.incoming.km_from IS
    'First kilometre that it probably touches, by header or sample; NULL if unknown. After reading, its points decide';
COMMENT ON COLUMN tunnel_api.incoming.state IS 'waiting, or failed';
COMMENT ON COLUMN tunnel_api.incoming.message IS 'Reason of the failure, and what to do';

-- Separate by state: waiting and running jobs have indexes, so that queries for them do not read finished jobs.
CREATE OR REPLACE VIEW tunnel_api.job AS
SELECT j.id, (j.args->>'survey_id')::integer AS survey_id, s.name AS survey, (j.args->>'km')::integer AS km,
       j.args->>'file' AS file, coalesce(j.args->>'stage', j.task_name) AS stage, j.state,
       j.attempts, j.worker_id, w.host || '/' || w.pid AS worker, e.at AS since, r.message
  FROM (SELECT q.*, 'queued' AS state FROM tunnel_queue.procrastinate_jobs q WHERE q.status = 'todo'
         UNION ALL
        SELECT q.*, 'running' AS state FROM tunnel_queue.procrastinate_jobs q WHERE q.status = 'doing'
         UNION ALL
        SELECT q.*, CASE q.status WHEN 'succeeded' THEN 'done' ELSE q.status::text END AS state
          FROM tunnel_queue.procrastinate_jobs q WHERE q.status NOT IN ('todo', 'doing')) j
  LEFT JOIN tunnel.survey s ON s.id = (j.args->>'survey_id')::integer
  LEFT JOIN tunnel.worker w ON w.id = j.worker_id
  LEFT JOIN LATERAL (SELECT max(v.at) AS at FROM tunnel_queue.procrastinate_events v WHERE v.job_id = j.id) e ON true
  LEFT JOIN LATERAL (SELECT u.message FROM tunnel.run u WHERE u.job_id = j.id ORDER BY u.id DESC LIMIT 1) r ON true;
COMMENT ON VIEW tunnel_api.job IS 'Jobs of the queue: a stage of a kilometre, or the reading of a file';
COMMENT ON COLUMN tunnel_api.job.file IS 'Name of the file to read; NULL for a stage of a kilometre';
COMMENT ON COLUMN tunnel_api.job.stage IS 'Stage of the kilometre; read if a file is to be read';
COMMENT ON COLUMN tunnel_api.job.state IS 'queued, running, done, failed or cancelled';
COMMENT ON COLUMN tunnel_api.job.attempts IS 'Number of earlier attempts';
COMMENT ON COLUMN tunnel_api.job.worker_id IS
    'Key of the worker that runs or ran it; NULL before, and after that worker left';
COMMENT ON COLUMN tunnel_api.job.worker IS 'Machine and process that runs or ran it';
COMMENT ON COLUMN tunnel_api.job.since IS 'Time since which it is in this state';
COMMENT ON COLUMN tunnel_api.job.message IS 'Reason of the failure';

CREATE OR REPLACE VIEW tunnel_api.worker AS
SELECT w.id, w.host, w.pid, w.started_at, q.last_heartbeat AS heartbeat, w.stop AS stopping, d.doing, d.since
  FROM tunnel.worker w
  JOIN tunnel_queue.procrastinate_workers q ON q.id = w.id
  LEFT JOIN LATERAL (SELECT string_agg(format('%s %s of %s', j.stage, coalesce(j.file, 'km ' || j.km), j.survey), ', ') AS doing,
                            min(j.since) AS since
                       FROM tunnel_api.job j WHERE j.worker_id = w.id AND j.state = 'running') d ON true;
COMMENT ON VIEW tunnel_api.worker IS 'Workers that serve the queue';
COMMENT ON COLUMN tunnel_api.worker.host IS 'Machine of the worker';
COMMENT ON COLUMN tunnel_api.worker.pid IS 'Number of its process';
COMMENT ON COLUMN tunnel_api.worker.heartbeat IS 'Time of the last sign of life';
COMMENT ON COLUMN tunnel_api.worker.stopping IS 'True if it was asked to finish its current job and exit';
COMMENT ON COLUMN tunnel_api.worker.doing IS 'Current job: stage and kilometre, or file; NULL if idle';
COMMENT ON COLUMN tunnel_api.worker.since IS 'Beginning of the current job';
