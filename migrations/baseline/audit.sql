-- An audit is of use only where nobody changes it: not by mistake either, so the owner's DELETE is refused, too.
CREATE FUNCTION tunnel_audit.refuse() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SET search_path = pg_catalog, pg_temp AS $$
BEGIN
    RAISE EXCEPTION 'entries of the audit are neither changed nor deleted' USING ERRCODE = 'insufficient_privilege';
END
$$;
COMMENT ON FUNCTION tunnel_audit.refuse() IS 'Trigger of tunnel_audit.entry: entries are neither changed nor deleted';
REVOKE EXECUTE ON FUNCTION tunnel_audit.refuse() FROM PUBLIC;
CREATE TRIGGER append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON tunnel_audit.entry
    FOR EACH STATEMENT EXECUTE FUNCTION tunnel_audit.refuse();
