-- Who may do what. Three group roles without login, to be granted to people:
--   tunnel_viewer     reads the views of tunnel_api and calls its read-only functions
--   tunnel_inspector  and reviews leaks and spots, draws findings and regions, moves axis vertices and writes actions, through the views
--   tunnel_operator   and loads and processes: owns schema tunnel and what lies in it
-- Runs last, after every function and view, as the database's owner. If the owner may not create roles, it prints what a
-- superuser has to run, and continues: the owner can do everything without the roles.

DO $$
DECLARE
    role text;
BEGIN
    FOREACH role IN ARRAY ARRAY['tunnel_viewer', 'tunnel_inspector', 'tunnel_operator'] LOOP
        IF to_regrole(role) IS NULL THEN
            BEGIN
                EXECUTE format('CREATE ROLE %I NOLOGIN', role);
            EXCEPTION
                WHEN duplicate_object OR unique_violation THEN NULL;  -- just made from another database
                WHEN insufficient_privilege THEN
                    RAISE WARNING 'role % is missing and % may not create it; a superuser can: CREATE ROLE %; then run "tunneldb init" again',
                        role, current_user, role;
            END;
        END IF;
    END LOOP;
END
$$;

-- Each role includes the previous one; the owner is a member of the operators, so that both may change schema tunnel.
DO $$
DECLARE
    pair text[];
BEGIN
    FOREACH pair SLICE 1 IN ARRAY ARRAY[['tunnel_viewer', 'tunnel_inspector'], ['tunnel_inspector', 'tunnel_operator'],
                                        ['tunnel_operator', current_user]] LOOP
        IF to_regrole(pair[1]) IS NOT NULL AND to_regrole(pair[2]) IS NOT NULL
           AND NOT pg_has_role(pair[2], pair[1], 'USAGE') THEN
            BEGIN
                EXECUTE format('GRANT %I TO %I', pair[1], pair[2]);
            EXCEPTION
                WHEN unique_violation THEN NULL;  -- just granted from another database
                WHEN insufficient_privilege THEN
                    RAISE WARNING '% may not grant role % to %; a superuser can: GRANT % TO %',
                        current_user, pair[1], pair[2], pair[1], pair[2];
            END;
        END IF;
    END LOOP;
END
$$;

REVOKE ALL ON SCHEMA tunnel FROM PUBLIC;
REVOKE ALL ON SCHEMA tunnel_api, tunnel_internal FROM PUBLIC;
REVOKE EXECUTE ON ALL FUNCTIONS IN SCHEMA tunnel_api, tunnel_internal FROM PUBLIC;
REVOKE EXECUTE ON ALL PROCEDURES IN SCHEMA tunnel_api, tunnel_internal FROM PUBLIC;
REVOKE ALL ON SCHEMA tunnel_queue FROM PUBLIC;
REVOKE ALL ON SCHEMA tunnel_audit FROM PUBLIC;  -- nobody's but the owner's: operators, who own schema tunnel, could drop it there

-- Viewers: all views of tunnel_api, and its functions that only read. A function that reads tables must run with the owner's
-- rights (SECURITY DEFINER). Of tunnel_internal, viewers may call only the functions that run with their own rights: those that
-- views of tunnel_api call, and those that a function granted here calls unless it is SECURITY DEFINER.
DO $$
DECLARE
    f regprocedure;
BEGIN
    IF to_regrole('tunnel_viewer') IS NULL THEN
        RETURN;
    END IF;
    GRANT USAGE ON SCHEMA tunnel_api, tunnel_internal TO tunnel_viewer;
    GRANT SELECT ON ALL TABLES IN SCHEMA tunnel_api TO tunnel_viewer;
    FOR f IN
        WITH RECURSIVE reading AS (
            SELECT p.oid, p.pronamespace::regnamespace::text || '.' || p.proname AS name, p.prosrc, p.prosecdef
              FROM pg_proc p
             WHERE p.pronamespace IN ('tunnel_api'::regnamespace, 'tunnel_internal'::regnamespace) AND p.prokind = 'f'
               AND p.provolatile <> 'v'
        ), granted AS (
            SELECT r.* FROM reading r
             WHERE r.name LIKE 'tunnel_api.%'
                OR r.oid IN (SELECT d.refobjid FROM pg_depend d
                               JOIN pg_rewrite w ON d.classid = 'pg_rewrite'::regclass AND d.objid = w.oid
                               JOIN pg_class c ON c.oid = w.ev_class AND c.relnamespace IN ('tunnel_api'::regnamespace, 'tunnel_internal'::regnamespace)
                              WHERE d.refclassid = 'pg_proc'::regclass)
            UNION
            SELECT r.* FROM granted g JOIN reading r ON g.prosrc ~ ('\m' || r.name || '\M')
             WHERE NOT g.prosecdef
        )
        SELECT oid FROM granted
    LOOP
        EXECUTE format('GRANT EXECUTE ON FUNCTION %s TO tunnel_viewer', f);
    END LOOP;
END
$$;

-- Inspectors: exactly the columns that they may change.
DO $$
BEGIN
    IF to_regrole('tunnel_inspector') IS NULL THEN
        RETURN;
    END IF;
    GRANT UPDATE (geom) ON tunnel_api.axis_vertex TO tunnel_inspector;
    GRANT UPDATE (review, remark, kind) ON
        tunnel_api.finding, tunnel_api.leak, tunnel_api.leak_unrolled, tunnel_api.leak_map, tunnel_api.leak_3d
        TO tunnel_inspector;
    GRANT INSERT, DELETE, UPDATE (geom) ON
        tunnel_api.leak_unrolled, tunnel_api.leak_map TO tunnel_inspector;
    GRANT UPDATE (review, remark) ON tunnel_api.spot, tunnel_api.spot_face, tunnel_api.spot_map, tunnel_api.spot_3d, tunnel_api.spot_sheet
        TO tunnel_inspector;
    GRANT INSERT, DELETE, UPDATE (kind, geom, reason) ON tunnel_api.region TO tunnel_inspector;
    GRANT INSERT, DELETE, UPDATE (kind, severity, width_mm, review, remark, geom) ON
        tunnel_api.finding_unrolled, tunnel_api.finding_map, tunnel_api.finding_3d TO tunnel_inspector;
    GRANT INSERT, DELETE, UPDATE (path, caption) ON tunnel_api.finding_photo TO tunnel_inspector;
    GRANT INSERT, DELETE, UPDATE (finding_id, element, chainage_from, chainage_to, arc, measure, urgency, responsible, due, cost,
                                  currency, state, remark) ON
        tunnel_api.action, tunnel_api.action_map, tunnel_api.action_unrolled TO tunnel_inspector;
    GRANT EXECUTE ON FUNCTION tunnel_api.finding_split(bigint, geometry), tunnel_api.finding_merge(bigint[]),
        tunnel_api.finding_undo(bigint), tunnel_api.finding_photo_add(bigint, bytea, text),
        tunnel_api.crack_search_add(text, geometry, text), tunnel_api.crack_search_remove(int),
        tunnel_api.show_as_of(text, timestamptz) TO tunnel_inspector;
END
$$;

-- Operators may call all functions except those that write the audit, may change the queue, and own schema tunnel, because
-- only the owner of a table can swap its partitions. A partition belongs to the operator who made it; other operators can
-- drop it as owners of the schema.
DO $$
DECLARE
    t record;
    f regprocedure;
BEGIN
    IF to_regrole('tunnel_operator') IS NULL THEN
        RETURN;
    END IF;
    GRANT SELECT ON ALL TABLES IN SCHEMA tunnel_internal TO tunnel_operator;
    GRANT EXECUTE ON ALL FUNCTIONS IN SCHEMA tunnel_api, tunnel_internal TO tunnel_operator;
    GRANT EXECUTE ON ALL PROCEDURES IN SCHEMA tunnel_api, tunnel_internal TO tunnel_operator;
    -- a user who may execute a trigger's function could attach it to an own view with forged old and new rows
    FOR f IN SELECT p.oid FROM pg_proc p
              WHERE p.pronamespace = 'tunnel_internal'::regnamespace
                AND (p.prorettype = 'trigger'::regtype OR p.proname IN ('note_edit', 'note_learned')) LOOP
        EXECUTE format('REVOKE EXECUTE ON FUNCTION %s FROM tunnel_operator', f);
    END LOOP;
    GRANT INSERT, DELETE, UPDATE (code, label, geometries, wet, position, active) ON tunnel_api.finding_kind TO tunnel_operator;
    GRANT UPDATE (label, text) ON tunnel_api.severity TO tunnel_operator;
    GRANT USAGE ON SCHEMA tunnel_queue TO tunnel_operator;
    GRANT SELECT, INSERT, UPDATE, DELETE ON ALL TABLES IN SCHEMA tunnel_queue TO tunnel_operator;
    GRANT USAGE ON ALL SEQUENCES IN SCHEMA tunnel_queue TO tunnel_operator;
    GRANT EXECUTE ON ALL FUNCTIONS IN SCHEMA tunnel_queue TO tunnel_operator;
    IF NOT pg_has_role(current_user, 'tunnel_operator', 'USAGE') THEN
        RETURN;
    END IF;
    ALTER SCHEMA tunnel OWNER TO tunnel_operator;
    FOR t IN SELECT c.oid::regclass AS name
               FROM pg_class c
              WHERE c.relnamespace = 'tunnel'::regnamespace AND c.relkind IN ('r', 'p')
                AND c.relowner <> to_regrole('tunnel_operator')
                AND pg_has_role(current_user, c.relowner, 'USAGE') LOOP
        EXECUTE format('ALTER TABLE %s OWNER TO tunnel_operator', t.name);
    END LOOP;
END
$$;

-- With the rights granted here.
CALL tunnel_api.make_layers();
