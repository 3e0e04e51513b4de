-- Waiting for locks: whoever waits says for whom, and gives up in the end. Advisory locks have two numbers: -1 and a worker, -2
-- and a survey (queue_lock), -3 and a survey (lock_findings), or a survey and a kilometre.

-- With the owner's rights, who may see more of other sessions.
CREATE OR REPLACE FUNCTION tunnel_internal.session_text(pid int) RETURNS text
LANGUAGE sql STABLE PARALLEL RESTRICTED STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT format('%s (process %s, %s%s)', a.usename, a.pid, coalesce(nullif(a.application_name, ''), 'unnamed program'),
                  ', since ' || to_char(coalesce(a.xact_start, a.state_change, a.backend_start), 'YYYY-MM-DD HH24:MI:SS TZ'))
      FROM pg_stat_activity a WHERE a.pid = $1
$$;
COMMENT ON FUNCTION tunnel_internal.session_text(int) IS
    'A session in words: role, process of the server, program, and the beginning of its transaction if that can be seen';

CREATE OR REPLACE FUNCTION tunnel_internal.lock_holder(first int, second int) RETURNS text
LANGUAGE sql STABLE PARALLEL RESTRICTED STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT string_agg(tunnel_internal.session_text(l.pid), ', ' ORDER BY l.pid)
      FROM pg_locks l
     WHERE l.locktype = 'advisory' AND l.granted AND l.objsubid = 2 AND l.pid <> pg_backend_pid()
       AND l.classid = ($1::bigint & 4294967295)::oid AND l.objid = ($2::bigint & 4294967295)::oid
       AND l.database = (SELECT d.oid FROM pg_database d WHERE d.datname = current_database())
$$;
COMMENT ON FUNCTION tunnel_internal.lock_holder(int, int) IS 'Sessions that hold an advisory lock of two numbers; NULL if none does';

-- Take an advisory lock until the transaction ends. Waits for lock_timeout of the session.
CREATE OR REPLACE FUNCTION tunnel_internal.wait_lock(first int, second int, shared boolean, what text) RETURNS void
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    holder text;
BEGIN
    IF (CASE WHEN shared THEN pg_try_advisory_xact_lock_shared(first, second) ELSE pg_try_advisory_xact_lock(first, second) END) THEN
        RETURN;
    END IF;
    holder := coalesce(tunnel_internal.lock_holder(first, second), 'another session');
    RAISE WARNING 'waiting for %, which is locked by %', what, holder USING ERRCODE = 'lock_not_available';
    IF shared THEN
        PERFORM pg_advisory_xact_lock_shared(first, second);
    ELSE
        PERFORM pg_advisory_xact_lock(first, second);
    END IF;
EXCEPTION WHEN lock_not_available THEN
    RAISE EXCEPTION '% is locked by %', what, coalesce(tunnel_internal.lock_holder(first, second), holder)
        USING ERRCODE = 'lock_not_available', HINT = 'Ask them to end their transaction, or have a superuser run pg_terminate_backend.';
END
$$;
COMMENT ON FUNCTION tunnel_internal.wait_lock(int, int, boolean, text) IS
    'Take an advisory lock until the transaction ends; if another session has it, warn of that session and wait for lock_timeout';

-- Sessions of the database that wait for a lock, and those that have it; and programs of others with advisory locks.
CREATE OR REPLACE FUNCTION tunnel_internal.lock_waits() RETURNS TABLE (waiting text, holder text)
LANGUAGE sql STABLE PARALLEL RESTRICTED ROWS 5 SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT tunnel_internal.session_text(w.pid), tunnel_internal.session_text(h.pid)
      FROM pg_stat_activity w
     CROSS JOIN LATERAL unnest(pg_blocking_pids(w.pid)) AS h (pid)
     WHERE w.datname = current_database() AND h.pid > 0
     UNION
    SELECT NULL, tunnel_internal.session_text(l.pid)
      FROM pg_locks l
      JOIN pg_stat_activity a ON a.pid = l.pid
     WHERE l.locktype = 'advisory' AND l.granted AND a.application_name NOT LIKE 'tunneldb%' AND a.pid <> pg_backend_pid()
       AND l.database = (SELECT d.oid FROM pg_database d WHERE d.datname = current_database())
     ORDER BY 1, 2
$$;
COMMENT ON FUNCTION tunnel_internal.lock_waits() IS
    'Sessions that wait for a lock, with the session that has it; and, with waiting NULL, sessions of other programs that hold advisory locks';
