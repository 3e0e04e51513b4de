-- A transaction that shows a survey as it was writes a row here, and cannot be committed (sql/findings/as_of.sql).

CREATE FUNCTION tunnel.refuse_past() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SET search_path = pg_catalog, pg_temp
AS $$
BEGIN
    RAISE EXCEPTION 'a transaction that shows a survey as it was cannot be committed'
        USING ERRCODE = 'invalid_transaction_termination', HINT = 'Write BEGIN before show_as_of and ROLLBACK after the queries.';
END
$$;
COMMENT ON FUNCTION tunnel.refuse_past() IS 'Trigger on tunnel.as_of: refuse the commit of a transaction that shows the past';
CREATE CONSTRAINT TRIGGER refuse_past AFTER INSERT ON tunnel.as_of DEFERRABLE INITIALLY DEFERRED
    FOR EACH ROW EXECUTE FUNCTION tunnel.refuse_past();
