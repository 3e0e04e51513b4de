-- The views of tunnel_api for a hub (tunneldb federate), each with the name by which the hub knows this server as its first column.
-- The hub states that name in the session setting tunneldb.server; elsewhere it is NULL. With a column of the server's, the hub can
-- keep the views of all servers as partitions of one table, and so send joins and aggregates to the servers.
-- Runs after every view.

DO $$
DECLARE
    v name;
BEGIN
    FOR v IN SELECT c.relname FROM pg_class c WHERE c.relnamespace = 'tunnel_api'::regnamespace AND c.relkind = 'v' LOOP
        EXECUTE format(
            'CREATE OR REPLACE VIEW tunnel_shared.%1$I AS'
            ' SELECT current_setting(''tunneldb.server'', true) AS server, v.* FROM tunnel_api.%1$I v', v);
        EXECUTE format('COMMENT ON VIEW tunnel_shared.%I IS %L', v,
                       format('View %s of tunnel_api, and the name by which a hub knows this server', v));
    END LOOP;
END
$$;

CREATE OR REPLACE VIEW tunnel_shared.database_state AS
SELECT current_setting('tunneldb.server', true) AS server,
       obj_description('tunnel_api'::regnamespace, 'pg_namespace') AS version,
       current_user::text AS login,
       coalesce(pg_has_role(to_regrole('tunnel_inspector'), 'MEMBER'), true) AS may_write,
       (SELECT d.datcollate::text FROM pg_database d WHERE d.datname = current_database()) AS locale,
       (SELECT count(*) FROM tunnel.tunnel) AS tunnels,
       (SELECT count(*) FROM tunnel.survey) AS surveys;
COMMENT ON VIEW tunnel_shared.database_state IS 'This database, as a hub asks for it: version, login and its rights, locale, number of surveys';

CREATE OR REPLACE VIEW tunnel_shared.view_comment AS
SELECT c.relname::text AS view_name, a.attname::text AS column_name, d.description AS comment
  FROM pg_description d
  JOIN pg_class c ON d.classoid = 'pg_class'::regclass AND d.objoid = c.oid
  LEFT JOIN pg_attribute a ON a.attrelid = c.oid AND a.attnum = d.objsubid AND d.objsubid > 0
 WHERE c.relnamespace = 'tunnel_api'::regnamespace AND c.relkind = 'v';
COMMENT ON VIEW tunnel_shared.view_comment IS 'Comments of the views of tunnel_api (column_name is NULL) and of their columns';

REVOKE ALL ON SCHEMA tunnel_shared FROM PUBLIC;
DO $$
BEGIN
    IF to_regrole('tunnel_viewer') IS NOT NULL THEN
        GRANT USAGE ON SCHEMA tunnel_shared TO tunnel_viewer;
        GRANT SELECT ON ALL TABLES IN SCHEMA tunnel_shared TO tunnel_viewer;
    END IF;
END
$$;
