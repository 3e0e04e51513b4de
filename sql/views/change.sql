-- History of a survey: edits through the views (access/audit.sql) and runs of stages, in one list by time.

CREATE OR REPLACE VIEW tunnel_api.change AS
SELECT e.id * 2 AS id, e.survey, e.at, e.who, e.view AS what,
       CASE e.view WHEN 'finding' THEN (SELECT a.km FROM tunnel.finding a WHERE a.id = e.row_id)
                   WHEN 'axis_vertex' THEN (SELECT v.km FROM tunnel.axis_vertex v WHERE v.id = e.row_id) END AS km,
       (SELECT format('%s %s', e.action, e.row_id)
               || coalesce(': ' || string_agg(CASE k.key WHEN 'geom' THEN 'geom'
                      ELSE format('%s %s -> %s', k.key, coalesce(e.before ->> k.key, '-'), coalesce(e.after ->> k.key, '-')) END,
                      ', ' ORDER BY k.key), '')
          FROM jsonb_object_keys(coalesce(e.after, e.before)) AS k (key)) AS detail
  FROM tunnel_api.audit e
 UNION ALL
SELECT r.id * 2 + 1, s.name, r.finished_at, r.worker, r.stage, r.km, concat_ws(': ', r.outcome, r.message)
  FROM tunnel.run r
  JOIN tunnel.survey s ON s.id = r.survey_id
 WHERE r.finished_at IS NOT NULL;
COMMENT ON VIEW tunnel_api.change IS
    'History of a survey: edits by hand (tunnel_api.audit) and runs of stages (tunnel_api.run)';
COMMENT ON COLUMN tunnel_api.change.at IS 'Time of the edit, or end of the run';
COMMENT ON COLUMN tunnel_api.change.who IS
    'Role that was logged in; for a stage, machine and process; NULL for a stage run by hand';
COMMENT ON COLUMN tunnel_api.change.what IS 'Edited view (finding, axis_vertex, region, photo, action or learned_model), or stage';
COMMENT ON COLUMN tunnel_api.change.km IS
    'Kilometre; NULL for a region, for a deleted row, and for a run over the whole survey';
COMMENT ON COLUMN tunnel_api.change.detail IS 'Edited row and kind of edit, or outcome of the run';
