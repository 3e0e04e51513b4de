-- Ledger of runs, and state of each stage in each kilometre.

-- True if the database session that started a run is alive. Runs with the owner's rights, because pg_stat_activity hides
-- other sessions.
CREATE OR REPLACE FUNCTION tunnel_internal.session_lives(pid integer, started timestamptz) RETURNS boolean
LANGUAGE sql STABLE STRICT PARALLEL RESTRICTED SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT EXISTS (SELECT FROM pg_stat_activity a
                    WHERE a.pid = $1 AND (a.backend_start IS NULL OR a.backend_start = $2))
$$;
COMMENT ON FUNCTION tunnel_internal.session_lives(integer, timestamptz) IS
    'True if the server process with this number and start time is alive';

CREATE OR REPLACE VIEW tunnel_api.run AS
SELECT r.id, r.survey_id, s.name AS survey, r.km, r.stage,
       CASE WHEN r.outcome = 'running' AND NOT tunnel_internal.session_lives(r.backend_pid, r.backend_start)
            THEN 'interrupted' ELSE r.outcome END AS outcome,
       r.started_at, r.finished_at, r.finished_at - r.started_at AS duration, r.message, r.counts, r.parameters, r.versions,
       r.worker, r.job_id
  FROM tunnel.run r
  JOIN tunnel.survey s ON s.id = r.survey_id;
COMMENT ON VIEW tunnel_api.run IS 'Ledger: each run of a stage, with parameters, versions, counts and outcome';
COMMENT ON COLUMN tunnel_api.run.km IS 'Kilometre; NULL for the whole survey';
COMMENT ON COLUMN tunnel_api.run.outcome IS 'running, done, failed, or interrupted (its session is gone)';
COMMENT ON COLUMN tunnel_api.run.worker IS 'Machine and process that ran it';
COMMENT ON COLUMN tunnel_api.run.job_id IS 'Job of the queue (tunnel_api.job); NULL if run by hand';

-- Last run of each stage in each kilometre that was ever loaded, waits to be loaded, or is a goal, and whether its result is
-- out of date. load depends on the files that touch the kilometre. tunnel.stage lists what the other stages depend on, in the
-- kilometre and in both neighbours; stages that read the survey depend on its positions, reference and intensity; those that
-- read sonar, on the points below the water; those that classify, on the adapted model (leaks/learned.sql). A result is stale
-- if one of these was made after its run began, is stale itself, or belongs to a stage that never ran here. Runs are ordered
-- by time: a result commits under a lock that each run takes just before it begins (queue_lock), so a run never misses a
-- result with an earlier time. An edit of a vertex takes no such lock; it shows in the segments, whose planes then differ
-- from the axis (segment_moved). Only segments next to a vertex moved by hand are checked.
CREATE OR REPLACE FUNCTION tunnel_internal.stage_states(
    survey_ids integer[], km_from integer DEFAULT -1000000, km_to integer DEFAULT 1000000)
RETURNS TABLE (survey_id integer, km integer, step integer, stage text, run_id bigint, outcome text, done_id bigint,
               input_at timestamptz, outdated boolean, reason text)
LANGUAGE plpgsql STABLE STRICT PARALLEL RESTRICTED SECURITY DEFINER ROWS 5000
SET search_path = pg_catalog, pg_temp
SET jit = off
SET enable_nestloop = off  -- how few or many rows there are is not known when it is planned
SET enable_mergejoin = off
SET plan_cache_mode = force_generic_plan  -- planning takes longer than a survey
SET enable_hashjoin = on  -- which stage_state has off
SET enable_seqscan = on
AS $$
#variable_conflict use_column
BEGIN
    RETURN QUERY
    WITH RECURSIVE stage AS MATERIALIZED (  -- the stages that each rests on, by their numbers: here, and on both neighbours
        SELECT s.step, s.name, s.name = 'segments' AS of_segments, 'axis' = ANY (s.reads) AS of_axis,
               'survey' = ANY (s.reads) AS of_survey, 'sonar' = ANY (s.reads) AS of_sonar,
               'learned' = ANY (s.reads) AS of_learned,
               ARRAY(SELECT o.step FROM tunnel.stage o WHERE o.name = ANY (s.reads) ORDER BY 1) AS here,
               ARRAY(SELECT o.step FROM tunnel.stage o WHERE o.name = ANY (s.reads_beside) ORDER BY 1) AS beside
          FROM tunnel.stage s WHERE NOT s.on_demand
    ), need AS MATERIALIZED (
        SELECT s.step, w.way, n.source
          FROM stage s CROSS JOIN (VALUES (-1), (0), (1)) AS w (way)
         CROSS JOIN LATERAL unnest(CASE w.way WHEN 0 THEN s.here ELSE s.beside END) AS n (source)
    ), survey AS MATERIALIZED (
        SELECT s.id, s.settings_at, tunnel_internal.learned_in_force(s.tunnel_id) AS learned
          FROM tunnel.survey s WHERE s.id = ANY ($1)
    ), last AS MATERIALIZED (
        SELECT r.survey_id, r.km, s.step, r.id, r.outcome, r.started_at, r.finished_at, r.backend_pid, r.backend_start,
               r.counts ->> 'kept' = '0' AS void, (r.counts ->> 'learned')::integer AS learned
          FROM tunnel_internal.last_runs_of($1, ARRAY(SELECT s.name FROM stage s), false, $2, $3) r
          JOIN stage s ON s.name = r.stage
    ), success AS MATERIALIZED (  -- mostly the last one; where that is not, the ledger is asked again
        SELECT l.survey_id, l.km, l.step, l.id, l.started_at, l.finished_at, l.void, l.learned FROM last l WHERE l.outcome = 'done'
         UNION ALL
        SELECT r.survey_id, r.km, l.step, r.id, r.started_at, r.finished_at, r.counts ->> 'kept' = '0',
               (r.counts ->> 'learned')::integer
          FROM last l
          JOIN stage s ON s.step = l.step
         CROSS JOIN LATERAL tunnel_internal.last_runs(l.survey_id, s.name, true, l.km, l.km) r
         WHERE l.outcome <> 'done'
    ), pending AS (
        SELECT f.survey_id, k.km, max(k.read_at) AS read_at, (array_agg(f.name ORDER BY k.read_at DESC, f.name))[1] AS name
          FROM tunnel.scan_file f
         CROSS JOIN LATERAL (  -- by the file, not all of them
                SELECT q.* FROM tunnel.file_km q
                 WHERE q.file_id = f.id AND q.km BETWEEN $2 AND $3 AND q.loaded_at IS NULL OFFSET 0) k
         WHERE f.survey_id = ANY ($1)
         GROUP BY f.survey_id, k.km
    ), kilometre AS (
        SELECT l.survey_id, l.km FROM last l
         UNION SELECT p.survey_id, p.km FROM pending p
         UNION SELECT g.survey_id, g.km FROM tunnel.goal g WHERE g.survey_id = ANY ($1) AND g.km BETWEEN $2 AND $3
    ), edited AS MATERIALIZED (
        SELECT v.survey_id, v.n, v.edited_at
          FROM tunnel.axis_vertex v WHERE v.survey_id = ANY ($1) AND v.edited_at IS NOT NULL
    ), edit AS (
        SELECT v.survey_id, k.km, max(v.edited_at) AS edited_at
          FROM edited v
          JOIN tunnel.survey s ON s.id = v.survey_id
          JOIN tunnel.tunnel t ON t.id = s.tunnel_id
         CROSS JOIN LATERAL generate_series(ceil((v.n - 2) * t.spacing / 1000)::integer - 1,
                                            floor((v.n + 2) * t.spacing / 1000)::integer) AS k (km)
         GROUP BY v.survey_id, k.km
    ), near AS MATERIALIZED (
        SELECT DISTINCT v.survey_id, v.n + i AS n FROM edited v CROSS JOIN generate_series(-2, 1) AS i
    ), turned AS MATERIALIZED (  -- apart from moved, lest the planner ask segment_moved of all segments first
        SELECT g.survey_id, g.km, g.n, g.vertex_from || g.vertex_to || g.tangent_from || g.tangent_to AS planes
          FROM near
         CROSS JOIN LATERAL (
                SELECT q.* FROM tunnel.segment q
                 WHERE q.survey_id = near.survey_id AND q.n = near.n AND q.km BETWEEN $2 AND $3 OFFSET 0) g
    ), moved AS (
        SELECT DISTINCT t.survey_id, t.km FROM turned t WHERE tunnel_internal.segment_moved(t.survey_id, t.n, t.planes)
    ), cell AS MATERIALIZED (
        SELECT k.survey_id, k.km, s.step, d.started_at, d.finished_at, d.learned
          FROM kilometre k CROSS JOIN stage s
          LEFT JOIN success d ON d.survey_id = k.survey_id AND d.km = k.km AND d.step = s.step
    ), input AS (  -- the newest of what each rests on; as late, the first that came since or never ran: here, before, after
        SELECT c.survey_id, c.km, c.step, max(i.finished_at) AS finished_at,
               min(CASE WHEN i.finished_at > c.started_at THEN (3 * n.way * n.way + n.way) * 1000
                        WHEN i.finished_at IS NULL AND n.way = 0 AND n.source > 1 THEN 1000 END + n.source) AS late
          FROM cell c
          JOIN need n ON n.step = c.step
          LEFT JOIN cell i ON i.survey_id = c.survey_id AND i.km = c.km + n.way AND i.step = n.source
         GROUP BY c.survey_id, c.km, c.step
    ), direct AS MATERIALIZED (
        SELECT c.survey_id, c.km, c.step, c.started_at IS NOT NULL AS done,
               CASE c.step WHEN 1 THEN p.read_at ELSE greatest(i.finished_at, CASE WHEN s.of_axis THEN e.edited_at END,
                                                             CASE WHEN s.of_survey THEN v.settings_at END,
                                                             CASE WHEN s.of_sonar THEN w.changed_at END) END AS input_at,
               CASE
                   WHEN c.started_at IS NULL THEN NULL
                   WHEN c.step = 1 THEN p.name || ' read since'
                   WHEN i.late IS NOT NULL THEN
                       CASE i.late / 1000
                           WHEN 0 THEN format('%s ran since', l.name)
                           WHEN 1 THEN format('%s never ran', l.name)
                           ELSE format('%s of kilometre %s ran since', l.name, c.km + i.late / 1000 - 3)
                       END
                   WHEN s.of_survey AND v.settings_at > c.started_at THEN 'positions, reference or intensity set since'
                   WHEN s.of_sonar AND w.changed_at > c.started_at THEN 'sonar scans loaded or registered since'
                   WHEN s.of_learned AND c.learned IS DISTINCT FROM v.learned THEN 'adapted model changed since'
                   WHEN s.of_segments AND m.km IS NOT NULL THEN 'axis edited since'
               END AS reason
          FROM cell c
          JOIN stage s ON s.step = c.step
          JOIN survey v ON v.id = c.survey_id
          LEFT JOIN input i ON i.survey_id = c.survey_id AND i.km = c.km AND i.step = c.step
          LEFT JOIN stage l ON l.step = i.late % 1000
          LEFT JOIN pending p ON p.survey_id = c.survey_id AND p.km = c.km
          LEFT JOIN edit e ON e.survey_id = c.survey_id AND e.km = c.km
          LEFT JOIN moved m ON m.survey_id = c.survey_id AND m.km = c.km
          LEFT JOIN tunnel.water_level w ON w.survey_id = c.survey_id AND w.km = c.km
    ), ripple AS (  -- what is stale, and what rests on it
        SELECT d.survey_id, d.km, d.step FROM direct d WHERE d.reason IS NOT NULL
         UNION
        SELECT d.survey_id, d.km, d.step
          FROM (SELECT r.survey_id, r.km - n.way AS km, n.step FROM ripple r JOIN need n ON n.source = r.step
                OFFSET 0) w  -- first what may rest on it: joined otherwise it would be each kilometre with all
          JOIN direct d ON d.survey_id = w.survey_id AND d.km = w.km AND d.step = w.step AND d.done
    ), void AS (  -- emptied, with nothing left of it and nothing wanted: only its neighbours are to know
        SELECT d.survey_id, d.km FROM success d
         WHERE d.step = 1 AND d.void
           AND NOT EXISTS (SELECT FROM last l WHERE l.survey_id = d.survey_id AND l.km = d.km
                              AND (l.step > 1 OR l.started_at > d.started_at))
        EXCEPT SELECT p.survey_id, p.km FROM pending p
        EXCEPT SELECT g.survey_id, g.km FROM tunnel.goal g WHERE g.survey_id = ANY ($1)
    ), stale AS MATERIALIZED (
        SELECT r.survey_id, r.km, array_agg(r.step ORDER BY r.step) AS steps FROM ripple r GROUP BY r.survey_id, r.km
    )
    SELECT d.survey_id, d.km, d.step, s.name, l.id,
           CASE WHEN l.outcome = 'running' AND NOT tunnel_internal.session_lives(l.backend_pid, l.backend_start)
                THEN 'interrupted' ELSE coalesce(l.outcome, 'never') END,
           b.id, d.input_at, d.reason IS NOT NULL,
           CASE
               WHEN d.reason IS NOT NULL OR NOT d.done THEN d.reason
               WHEN here.steps && s.here THEN
                   (SELECT format('%s is stale', o.name) FROM stage o
                     WHERE o.step = ANY (here.steps) AND o.step = ANY (s.here) ORDER BY o.step LIMIT 1)
               WHEN before.steps && s.beside THEN
                   (SELECT format('%s of kilometre %s is stale', o.name, d.km - 1) FROM stage o
                     WHERE o.step = ANY (before.steps) AND o.step = ANY (s.beside) ORDER BY o.step LIMIT 1)
               WHEN after.steps && s.beside THEN
                   (SELECT format('%s of kilometre %s is stale', o.name, d.km + 1) FROM stage o
                     WHERE o.step = ANY (after.steps) AND o.step = ANY (s.beside) ORDER BY o.step LIMIT 1)
           END
      FROM direct d
      JOIN stage s ON s.step = d.step
      LEFT JOIN last l ON l.survey_id = d.survey_id AND l.km = d.km AND l.step = d.step
      LEFT JOIN success b ON b.survey_id = d.survey_id AND b.km = d.km AND b.step = d.step
      LEFT JOIN stale here ON here.survey_id = d.survey_id AND here.km = d.km
      LEFT JOIN stale before ON before.survey_id = d.survey_id AND before.km = d.km - 1
      LEFT JOIN stale after ON after.survey_id = d.survey_id AND after.km = d.km + 1
     WHERE (d.survey_id, d.km) NOT IN (SELECT v.survey_id, v.km FROM void v);
END
$$;
COMMENT ON FUNCTION tunnel_internal.stage_states(integer[], integer, integer) IS
    'Result of stage_state for several surveys. run_id: last run; done_id: last successful run (tunnel_api.run)';

-- State of one survey, with the columns of the ledger.
CREATE OR REPLACE FUNCTION tunnel_internal.stage_state(survey_id integer, km_from integer DEFAULT -1000000, km_to integer DEFAULT 1000000)
RETURNS TABLE (km integer, step integer, stage text, run_id bigint, outcome text, started_at timestamptz,
               finished_at timestamptz, message text, parameters jsonb, done_at timestamptz, done_parameters jsonb,
               input_at timestamptz, outdated boolean, reason text)
LANGUAGE sql STABLE STRICT PARALLEL RESTRICTED SECURITY DEFINER ROWS 5000
SET search_path = pg_catalog, pg_temp
SET jit = off
SET enable_hashjoin = off  -- the runs are few in a ledger that may be long
SET enable_mergejoin = off
SET enable_seqscan = off
AS $$
    SELECT t.km, t.step, t.stage, t.run_id, t.outcome, l.started_at, l.finished_at, l.message, l.parameters, b.finished_at,
           b.parameters, t.input_at, t.outdated, t.reason
      FROM tunnel_internal.stage_states(ARRAY[$1], $2, $3) t
      LEFT JOIN tunnel.run l ON l.id = t.run_id
      LEFT JOIN tunnel.run b ON b.id = t.done_id
$$;
COMMENT ON FUNCTION tunnel_internal.stage_state(integer, integer, integer) IS
    'State of the kilometres of a survey: last run and last success of each stage, and what changed since. Kilometres outside the range are ignored';

CREATE OR REPLACE VIEW tunnel_api.stage_status AS
SELECT (s.id::bigint * 1000000 + 500000 + t.km) * 10 + t.step AS id, s.id AS survey_id, s.name AS survey, t.km, t.step,
       t.stage, t.outcome, t.started_at, t.finished_at, t.done_at, r.counts, t.message,
       t.reason IS NOT NULL AS stale, t.reason
  FROM tunnel.survey s
 CROSS JOIN LATERAL tunnel_internal.stage_state(s.id) t
  LEFT JOIN tunnel.run r ON r.id = t.run_id;
COMMENT ON VIEW tunnel_api.stage_status IS 'State of each stage in each kilometre of each survey';
COMMENT ON COLUMN tunnel_api.stage_status.step IS 'Number of the stage in the order of processing';
COMMENT ON COLUMN tunnel_api.stage_status.outcome IS
    'Outcome of the last run: running, done, failed, interrupted (its session is gone) or never';
COMMENT ON COLUMN tunnel_api.stage_status.done_at IS 'End of the last successful run, whose result is in the database';
COMMENT ON COLUMN tunnel_api.stage_status.counts IS 'Counts of the last run';
COMMENT ON COLUMN tunnel_api.stage_status.stale IS 'True if something that the result depends on changed since it was made';
COMMENT ON COLUMN tunnel_api.stage_status.reason IS 'Reason why it is stale';
