-- Procrastinate names its tables and functions without a schema: its functions get theirs here once and for all.
DO $$
DECLARE
    f regprocedure;
BEGIN
    FOR f IN SELECT p.oid FROM pg_proc p WHERE p.pronamespace = 'tunnel_queue'::regnamespace LOOP
        EXECUTE format('ALTER FUNCTION %s SET search_path = tunnel_queue, pg_temp', f);
    END LOOP;
END
$$;
