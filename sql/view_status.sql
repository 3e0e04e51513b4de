-- Views of the work: the ledger of runs and how far each kilometre has come.

-- True when the database session that started a run still lives. Runs with the owner's rights, for pg_stat_activity
-- hides the sessions of others.
CREATE OR REPLACE FUNCTION tunnel_api.session_lives(pid integer, started timestamptz) RETURNS boolean
LANGUAGE sql STABLE STRICT PARALLEL RESTRICTED SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT EXISTS (SELECT FROM pg_stat_activity a
                    WHERE a.pid = $1 AND (a.backend_start IS NULL OR a.backend_start = $2))
$$;
COMMENT ON FUNCTION tunnel_api.session_lives(integer, timestamptz) IS
    'Whether the server process with this number and start still lives';

CREATE OR REPLACE VIEW tunnel_api.run AS
SELECT r.id, r.survey_id, s.name AS survey, r.km, r.stage,
       CASE WHEN r.outcome = 'running' AND NOT tunnel_api.session_lives(r.backend_pid, r.backend_start)
            THEN 'interrupted' ELSE r.outcome END AS outcome,
       r.started_at, r.finished_at, r.finished_at - r.started_at AS duration, r.message, r.counts, r.parameters, r.versions
  FROM tunnel.run r
  JOIN tunnel.survey s ON s.id = r.survey_id;
COMMENT ON VIEW tunnel_api.run IS 'Ledger: each run of a stage, with parameters, versions, counts and outcome';
COMMENT ON COLUMN tunnel_api.run.km IS 'Kilometre; NULL for the whole survey';
COMMENT ON COLUMN tunnel_api.run.outcome IS 'running, done, failed, or interrupted when its session is gone';

-- Last run of each stage on each kilometre that was ever loaded or worked on, and whether its result is out of date.
-- A run without a kilometre counts for all of its survey; only a load has a row for each kilometre that it touched
-- beside the one for all of its files.
--
-- A result is stale when, since its last successful run began,
--   * an earlier stage has succeeded on that kilometre, or
--   * a vertex of the axis in the kilometre or at most two beyond its ends was moved by hand (stages after axis), or
-- when the result of an earlier stage is stale itself.
CREATE OR REPLACE VIEW tunnel_api.stage_status AS
WITH stage (step, stage) AS (
    VALUES (1, 'load'), (2, 'axis'), (3, 'segments'), (4, 'sections'), (5, 'detect')
), kilometre AS (
    SELECT DISTINCT r.survey_id, r.km FROM tunnel.run r WHERE r.km IS NOT NULL
), attempt AS (
    SELECT k.survey_id, k.km, g.step, r.id, r.started_at, r.finished_at, r.outcome, r.counts, r.message
      FROM kilometre k
      JOIN tunnel_api.run r ON r.survey_id = k.survey_id AND (r.km = k.km OR r.km IS NULL AND r.stage <> 'load')
      JOIN stage g ON g.stage = r.stage
), last_attempt AS (
    SELECT DISTINCT ON (survey_id, km, step) * FROM attempt ORDER BY survey_id, km, step, started_at DESC, id DESC
), success AS (
    SELECT survey_id, km, step, max(started_at) AS started_at, max(finished_at) AS finished_at
      FROM attempt
     WHERE outcome = 'done'
     GROUP BY survey_id, km, step
), edit AS (
    SELECT k.survey_id, k.km, max(v.edited_at) AS edited_at
      FROM kilometre k
      JOIN tunnel.survey s ON s.id = k.survey_id
      JOIN tunnel.tunnel t ON t.id = s.tunnel_id
      JOIN tunnel.axis_vertex v ON v.survey_id = k.survey_id AND v.edited_at IS NOT NULL
       AND v.n BETWEEN ceil(k.km * 1000 / t.spacing) - 2 AND floor((k.km + 1) * 1000 / t.spacing) + 2
     GROUP BY k.survey_id, k.km
), direct AS (
    SELECT d.survey_id, d.km, d.step, d.finished_at AS done_at,
           CASE WHEN u.stage IS NOT NULL THEN format('%s ran since', u.stage)
                WHEN d.step > 2 AND e.edited_at > d.started_at THEN 'axis edited since' END AS reason
      FROM success d
      LEFT JOIN edit e ON e.survey_id = d.survey_id AND e.km = d.km
      LEFT JOIN LATERAL (SELECT g.stage
                           FROM success b JOIN stage g ON g.step = b.step
                          WHERE b.survey_id = d.survey_id AND b.km = d.km AND b.step < d.step
                            AND b.finished_at > d.started_at
                          ORDER BY b.step LIMIT 1) u ON true
), judged AS (
    SELECT d.*, coalesce(d.reason, (SELECT format('%s is stale', g.stage)
                                      FROM direct b JOIN stage g ON g.step = b.step
                                     WHERE b.survey_id = d.survey_id AND b.km = d.km AND b.step < d.step
                                       AND b.reason IS NOT NULL
                                     ORDER BY b.step LIMIT 1)) AS stale_reason
      FROM direct d
)
SELECT (k.survey_id::bigint * 1000000 + 500000 + k.km) * 10 + g.step AS id, k.survey_id, s.name AS survey, k.km, g.step,
       g.stage,
       coalesce(a.outcome, 'never') AS outcome, a.started_at, a.finished_at, j.done_at, a.counts, a.message,
       j.stale_reason IS NOT NULL AS stale, j.stale_reason AS reason
  FROM kilometre k
  JOIN tunnel.survey s ON s.id = k.survey_id
 CROSS JOIN stage g
  LEFT JOIN last_attempt a ON a.survey_id = k.survey_id AND a.km = k.km AND a.step = g.step
  LEFT JOIN judged j ON j.survey_id = k.survey_id AND j.km = k.km AND j.step = g.step;
COMMENT ON VIEW tunnel_api.stage_status IS 'How far each kilometre of each survey has come: one row per stage';
COMMENT ON COLUMN tunnel_api.stage_status.step IS 'Order of the stages: load, axis, segments, sections, detect';
COMMENT ON COLUMN tunnel_api.stage_status.outcome IS 'Of the last run: running, done, failed, interrupted (its session is gone) or never';
COMMENT ON COLUMN tunnel_api.stage_status.done_at IS 'End of the last successful run, whose result is in the database';
COMMENT ON COLUMN tunnel_api.stage_status.counts IS 'What the last run counted';
COMMENT ON COLUMN tunnel_api.stage_status.stale IS 'True when what the result rests on has changed since it was made';
COMMENT ON COLUMN tunnel_api.stage_status.reason IS 'Why it is stale';
