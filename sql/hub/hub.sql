-- Schemas of a hub, made by tunneldb federate add. Schema tunnel_hub has the views over all servers. Schema tunnel_hub_internal has
-- partitioned tables, whose partitions are the servers' foreign tables. This file runs at each change, and not in tunneldb init.

CREATE SCHEMA IF NOT EXISTS tunnel_hub;
COMMENT ON SCHEMA tunnel_hub IS 'Views of tunnel_api over all servers of the hub; made by tunneldb federate';
CREATE SCHEMA IF NOT EXISTS tunnel_hub_internal;
COMMENT ON SCHEMA tunnel_hub_internal IS 'Tables and functions behind schema tunnel_hub; not to be used';

CREATE TABLE IF NOT EXISTS tunnel_hub.server (
    name text PRIMARY KEY,
    state text NOT NULL DEFAULT 'present' CHECK (state IN ('present', 'different', 'away')),
    since timestamptz NOT NULL DEFAULT now(),
    message text,
    shown boolean NOT NULL DEFAULT true,
    version text,
    imported_version text,
    tunnels bigint,
    surveys bigint,
    checked_at timestamptz NOT NULL DEFAULT now()
);
COMMENT ON TABLE tunnel_hub.server IS 'Servers of the hub, as found by the last tunneldb federate check';
COMMENT ON COLUMN tunnel_hub.server.name IS 'Name, which is in the column server of all views';
COMMENT ON COLUMN tunnel_hub.server.state IS
    'present; different: it answers, but lacks columns or views, or was upgraded; away: its tunnels are missing in all views';
COMMENT ON COLUMN tunnel_hub.server.since IS 'Time since when it has this state';
COMMENT ON COLUMN tunnel_hub.server.message IS 'Reason of the state; NULL if present';
COMMENT ON COLUMN tunnel_hub.server.shown IS
    'True if the views ask it; false if they warn instead. Differs from the state while open transactions keep the views from being changed';
COMMENT ON COLUMN tunnel_hub.server.version IS 'Version of its schema tunnel_api at the last check that it answered';
COMMENT ON COLUMN tunnel_hub.server.imported_version IS 'Version of its schema tunnel_api when its views were imported';
COMMENT ON COLUMN tunnel_hub.server.tunnels IS 'Number of its tunnels at the last check that it answered';
COMMENT ON COLUMN tunnel_hub.server.surveys IS 'Number of its surveys at the last check that it answered';
COMMENT ON COLUMN tunnel_hub.server.checked_at IS 'Time of the last check';

-- A branch of each view while a server is away. A statement that reads several views warns once.
CREATE OR REPLACE FUNCTION tunnel_hub_internal.warn_away(server text) RETURNS boolean
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    statement text := server || ' ' || extract(epoch FROM statement_timestamp());
    known text := coalesce(current_setting('tunnel_hub.warned', true), '');
    away_since timestamptz;
BEGIN
    IF strpos(known, '|' || statement || '|') = 0 THEN
        SELECT s.since INTO away_since FROM tunnel_hub.server s WHERE s.name = server;
        RAISE WARNING 'server % is away since %: its tunnels are missing here', server,
            to_char(away_since, 'YYYY-MM-DD HH24:MI:SS TZ') USING ERRCODE = 'connection_does_not_exist';
        PERFORM set_config('tunnel_hub.warned', right(known, 1000) || '|' || statement || '|', false);
    END IF;
    RETURN false;
END
$$;
COMMENT ON FUNCTION tunnel_hub_internal.warn_away(text) IS 'Warn that the tunnels of a server are missing in the answer; returns false';

-- A branch of a view that a server of another version lacks.
CREATE OR REPLACE FUNCTION tunnel_hub_internal.warn_lacking(server text, view text) RETURNS boolean
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT SET search_path = pg_catalog, pg_temp AS $$
BEGIN
    RAISE WARNING 'server % has no view %: its rows are missing here', server, view USING ERRCODE = 'undefined_table';
    RETURN false;
END
$$;
COMMENT ON FUNCTION tunnel_hub_internal.warn_lacking(text, text) IS 'Warn that a server of another version has no such view; returns false';

-- Comments of the views of a server for those of the hub.
CREATE OR REPLACE FUNCTION tunnel_hub_internal.copy_comments(server_schema text) RETURNS void
LANGUAGE plpgsql VOLATILE STRICT SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    c record;
BEGIN
    FOR c IN EXECUTE format(
        'SELECT r.view_name, r.column_name, r.comment FROM %I.view_comment r'
        '  JOIN pg_class v ON v.relnamespace = ''tunnel_hub''::regnamespace AND v.relname = r.view_name AND v.relkind = ''v'''
        '  LEFT JOIN pg_attribute a ON a.attrelid = v.oid AND a.attname = r.column_name AND NOT a.attisdropped'
        ' WHERE r.column_name IS NULL OR a.attname IS NOT NULL', server_schema)
    LOOP
        IF c.column_name IS NULL THEN
            EXECUTE format('COMMENT ON VIEW tunnel_hub.%I IS %L', c.view_name, c.comment);
            EXECUTE format('COMMENT ON COLUMN tunnel_hub.%I.server IS %L', c.view_name, 'Server of the row, as in tunnel_hub.server');
        ELSE
            EXECUTE format('COMMENT ON COLUMN tunnel_hub.%I.%I IS %L', c.view_name, c.column_name, c.comment);
        END IF;
    END LOOP;
END
$$;
COMMENT ON FUNCTION tunnel_hub_internal.copy_comments(text) IS 'Copy the comments of a server''s views to those of the hub';

DO $$
BEGIN
    IF to_regrole('tunnel_viewer') IS NULL THEN
        BEGIN
            CREATE ROLE tunnel_viewer NOLOGIN;
        EXCEPTION
            WHEN duplicate_object OR unique_violation THEN NULL;  -- just made from another database
            WHEN insufficient_privilege THEN
                RAISE WARNING 'role tunnel_viewer is missing and % may not create it; a superuser can: CREATE ROLE tunnel_viewer; then run "tunneldb federate add" again',
                    current_user;
        END;
    END IF;
END
$$;

REVOKE ALL ON SCHEMA tunnel_hub, tunnel_hub_internal FROM PUBLIC;
REVOKE EXECUTE ON ALL FUNCTIONS IN SCHEMA tunnel_hub_internal FROM PUBLIC;
