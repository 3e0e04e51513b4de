-- The audit: what people changed by hand, through the views. Its table (tunnel_audit.entry) is the database owner's alone, takes
-- new rows only, and is written by the triggers of views/edit.sql. What stages do is in the ledger (tunnel_api.run).

CREATE OR REPLACE VIEW tunnel_api.audit AS
SELECT e.id, e.at, e.who, e.survey, e.view, e.row_id, e.action, e.before, e.after, e.undoes, e.part_of, e.kept,
       e.imported_by, e.imported_at
  FROM tunnel_audit.entry e;
COMMENT ON VIEW tunnel_api.audit IS
    'What people changed through the views: who, when, before and after; it outlives what it speaks of. No role changes it, but for operators by a trigger or a function of their own on a table, which tunneldb check reports';
COMMENT ON COLUMN tunnel_api.audit.at IS 'When';
COMMENT ON COLUMN tunnel_api.audit.who IS 'Who was logged in';
COMMENT ON COLUMN tunnel_api.audit.view IS 'What was changed: finding (leaks, too), spot, axis_vertex, region, photo or learned_model';
COMMENT ON COLUMN tunnel_api.audit.row_id IS 'Its id in that view';
COMMENT ON COLUMN tunnel_api.audit.action IS 'insert, update or delete';
COMMENT ON COLUMN tunnel_api.audit.before IS 'Columns that changed, as they were, geometry as EWKT; NULL of an insert';
COMMENT ON COLUMN tunnel_api.audit.after IS 'The same columns as they became, geometry as EWKT; NULL of a delete';

COMMENT ON COLUMN tunnel_api.audit.undoes IS 'Entry that this one takes back (finding_undo)';
COMMENT ON COLUMN tunnel_api.audit.part_of IS 'Entry of the step that this one is a part of: a split, a merge, a delete';
COMMENT ON COLUMN tunnel_api.audit.kept IS 'What had been measured of a finding before its outline changed';
COMMENT ON COLUMN tunnel_api.audit.imported_by IS 'Who brought it in with an archive (survey import): then at and who are what the archive says; NULL of what was done here';
COMMENT ON COLUMN tunnel_api.audit.imported_at IS 'When it was brought in';

-- Notes an edit: of what was and is, the columns that differ; nothing when none does. Without before it is an insert, without
-- after a delete. Only the triggers, which run with the owner's rights, get through to the table. Returns the entry's id.
CREATE OR REPLACE FUNCTION tunnel_internal.note_edit(
    survey text, view text, row_id bigint, before jsonb, after jsonb, undoes bigint DEFAULT NULL, part_of bigint DEFAULT NULL,
    kept jsonb DEFAULT NULL) RETURNS bigint
LANGUAGE sql VOLATILE PARALLEL UNSAFE CALLED ON NULL INPUT SET search_path = pg_catalog, pg_temp AS $$
    INSERT INTO tunnel_audit.entry (survey, view, row_id, action, before, after, undoes, part_of, kept)
    SELECT $1, $2, $3, CASE WHEN $4 IS NULL THEN 'insert' WHEN $5 IS NULL THEN 'delete' ELSE 'update' END,
           (SELECT jsonb_object_agg(b.key, b.value) FROM jsonb_each($4) b WHERE b.value IS DISTINCT FROM $5 -> b.key),
           (SELECT jsonb_object_agg(a.key, a.value) FROM jsonb_each($5) a WHERE a.value IS DISTINCT FROM $4 -> a.key), $6, $7, $8
     WHERE $4 IS DISTINCT FROM $5
    RETURNING id
$$;
COMMENT ON FUNCTION tunnel_internal.note_edit(text, text, bigint, jsonb, jsonb, bigint, bigint, jsonb) IS
    'Writes into the audit which columns of a row an edit changed; for the triggers of the views alone, called by no role';
