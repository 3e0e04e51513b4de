-- The ledger: what distinguishes results of a stage in one kilometre is written by the database, whoever writes the row.

CREATE FUNCTION tunnel.set_subject() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SET search_path = pg_catalog, pg_temp
AS $$
BEGIN
    NEW.subject := coalesce((
        SELECT string_agg(NEW.parameters ->> k.key, ' ' ORDER BY k.n)
          FROM tunnel.stage s
         CROSS JOIN unnest(s.subject) WITH ORDINALITY AS k (key, n)
         WHERE s.name = NEW.stage), '');
    RETURN NEW;
END
$$;
COMMENT ON FUNCTION tunnel.set_subject() IS
    'Trigger on tunnel.run: values of the parameters that tunnel.stage names as the subject of the stage';
CREATE TRIGGER set_subject BEFORE INSERT OR UPDATE OF stage, parameters, subject ON tunnel.run
    FOR EACH ROW EXECUTE FUNCTION tunnel.set_subject();
