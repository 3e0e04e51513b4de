-- Audit: edits that people made through the views. The table tunnel_audit.entry belongs to the owner of the database, accepts
-- new rows only, and is written by the triggers of the views. Runs of stages are in the ledger (tunnel_api.run).

CREATE OR REPLACE VIEW tunnel_api.audit AS
SELECT e.id, e.at, e.who, e.survey, e.view, e.row_id, e.action, e.before, e.after, e.undoes, e.part_of, e.kept,
       e.imported_by, e.imported_at
  FROM tunnel_audit.entry e;
COMMENT ON VIEW tunnel_api.audit IS
    'Edits that people made through the views: when, who, values before and after. Entries outlive the rows they describe. No role can change them';
COMMENT ON COLUMN tunnel_api.audit.at IS 'Time of the edit';
COMMENT ON COLUMN tunnel_api.audit.who IS 'Role that was logged in';
COMMENT ON COLUMN tunnel_api.audit.view IS
    'View of the edited row: finding (leaks, too), spot, axis_vertex, region, photo, action or learned_model';
COMMENT ON COLUMN tunnel_api.audit.row_id IS 'Key of the row in that view';
COMMENT ON COLUMN tunnel_api.audit.action IS 'insert, update or delete';
COMMENT ON COLUMN tunnel_api.audit.before IS 'Changed columns before the edit, geometry as EWKT; NULL for an insert';
COMMENT ON COLUMN tunnel_api.audit.after IS 'Changed columns after the edit, geometry as EWKT; NULL for a delete';

COMMENT ON COLUMN tunnel_api.audit.undoes IS 'Entry that this one reverses (finding_undo)';
COMMENT ON COLUMN tunnel_api.audit.part_of IS 'Entry of the split, merge or delete that this entry belongs to';
COMMENT ON COLUMN tunnel_api.audit.kept IS 'Measured values of a finding before its outline changed';
COMMENT ON COLUMN tunnel_api.audit.imported_by IS
    'Role that imported the entry with an archive (survey import); at and who are then those of the archive. NULL for edits made here';
COMMENT ON COLUMN tunnel_api.audit.imported_at IS 'Time of the import; NULL for edits made here';

-- Write an entry with the columns that differ; nothing if none does. Without before it is an insert, without after a delete.
-- Only the triggers, which run with the owner's rights, can write to the table. Returns the id of the entry.
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
    'Write an entry of the audit with the columns that an edit changed. Only the triggers of the views call it';
