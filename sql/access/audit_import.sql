-- Entries of the audit from an archived survey (tunneldb survey import). Operators can import them; each states who imported
-- it and when, so that it cannot pass for an edit made here.

CREATE OR REPLACE FUNCTION tunnel_internal.audit_reserve(count int) RETURNS SETOF bigint
LANGUAGE sql VOLATILE PARALLEL UNSAFE STRICT SECURITY DEFINER ROWS 1000 SET search_path = pg_catalog, pg_temp AS $$
    SELECT nextval('tunnel_audit.entry_id_seq'::regclass) FROM generate_series(1, $1)
$$;
COMMENT ON FUNCTION tunnel_internal.audit_reserve(int) IS
    'Return new, growing keys of audit entries, reserved for the caller (survey import)';

CREATE OR REPLACE FUNCTION tunnel_internal.audit_import(survey_id int, entries jsonb) RETURNS int
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    name constant text := (SELECT s.name FROM tunnel.survey s WHERE s.id = survey_id);
    done int;
BEGIN
    IF name IS NULL THEN
        RAISE EXCEPTION 'there is no survey %', survey_id USING ERRCODE = 'invalid_parameter_value';
    END IF;
    INSERT INTO tunnel_audit.entry (id, at, who, survey, view, row_id, action, before, after, undoes, part_of, kept,
                                    imported_by, imported_at)
        OVERRIDING SYSTEM VALUE
    SELECT e.id, e.at, e.who, name, e.view, e.row_id, e.action, nullif(e.before, 'null'), nullif(e.after, 'null'), e.undoes,
           e.part_of, nullif(e.kept, 'null'), session_user, clock_timestamp()
      FROM jsonb_populate_recordset(NULL::tunnel_audit.entry, entries) e;
    GET DIAGNOSTICS done = ROW_COUNT;
    RETURN done;
END
$$;
COMMENT ON FUNCTION tunnel_internal.audit_import(int, jsonb) IS
    'Write the audit entries of an archived survey, marked as imported by the caller, and return their number (survey import)';
