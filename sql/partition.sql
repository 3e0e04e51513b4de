-- Partitions of tunnel.point: one per survey and kilometre, built aside and swapped in whole; and what waits to go into them.

-- Name of the partition that holds a survey's kilometre.
CREATE OR REPLACE FUNCTION tunnel_api.partition_name(survey_id int, km int)
RETURNS text
LANGUAGE sql IMMUTABLE PARALLEL SAFE STRICT
AS $$ SELECT 'point_s' || survey_id || '_km' || km $$;
COMMENT ON FUNCTION tunnel_api.partition_name(int, int) IS
'Name, in schema tunnel, of the partition of tunnel.point that holds a survey''s kilometre.';


-- Puts the table <partition>_new, built aside with the columns of tunnel.point and rows in chainage order, in the place of a
-- survey's kilometre: constraints and BRIN index are added, the old partition is dropped, all in the caller's transaction.
CREATE OR REPLACE FUNCTION tunnel_api.partition_swap(survey_id int, km int)
RETURNS void
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT
AS $$
DECLARE
    name constant text := tunnel_api.partition_name(survey_id, km);
    parent constant text := 'point_s' || survey_id;
BEGIN
    -- The check spares ATTACH a second scan.
    EXECUTE format($ddl$
        ALTER TABLE tunnel.%I
            ALTER survey_id SET NOT NULL, ALTER km SET NOT NULL, ALTER chainage SET NOT NULL, ALTER gps_time SET NOT NULL,
            ALTER geom SET NOT NULL, ALTER scan_id SET NOT NULL, ALTER file_id SET NOT NULL,
            ALTER intensity SET NOT NULL, ALTER classification SET NOT NULL,
            ADD CONSTRAINT part CHECK (survey_id = %s AND km = %s)
    $ddl$, name || '_new', survey_id, km);
    EXECUTE format('CREATE INDEX ON tunnel.%I USING brin (chainage) WITH (pages_per_range = 16)', name || '_new');
    EXECUTE format('CREATE TABLE IF NOT EXISTS tunnel.%I PARTITION OF tunnel.point FOR VALUES IN (%s) PARTITION BY LIST (km)',
        parent, survey_id);
    EXECUTE format('DROP TABLE IF EXISTS tunnel.%I', name);
    EXECUTE format('ALTER TABLE tunnel.%I RENAME TO %I', name || '_new', name);
    EXECUTE format('ALTER TABLE tunnel.%I ATTACH PARTITION tunnel.%I FOR VALUES IN (%s)', parent, name, km);
    EXECUTE format('ALTER TABLE tunnel.%I DROP CONSTRAINT part', name);
    -- geometry is never searched by its box here: its statistics would cost more than the index
    EXECUTE format('ANALYZE tunnel.%I (survey_id, km, chainage, segment)', name);
END
$$;
COMMENT ON FUNCTION tunnel_api.partition_swap(int, int) IS
'Puts the table <partition>_new in the place of a survey''s kilometre of tunnel.point, with its index, in the caller''s transaction.';


-- Makes the empty table tunnel.fragment_s<survey>_f<file>_km<km>, in the place of an older one. It belongs to the owner of
-- tunnel.point, so that any operator may load what another one read.
CREATE OR REPLACE FUNCTION tunnel_api.fragment_create(survey_id int, file_id int, km int)
RETURNS void
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT
AS $$
DECLARE
    name constant text := format('fragment_s%s_f%s_km%s', survey_id, file_id, km);
    owner constant regrole := (SELECT c.relowner FROM pg_class c WHERE c.oid = 'tunnel.point'::regclass);
BEGIN
    IF to_regclass('tunnel.' || quote_ident(name)) IS NOT NULL THEN
        EXECUTE format('DROP TABLE tunnel.%I', name);
    END IF;
    EXECUTE format('CREATE TABLE tunnel.%I (number int NOT NULL, rows bytea NOT NULL)', name);
    -- numbers as they lie in memory: to compress them costs more than it saves
    EXECUTE format('ALTER TABLE tunnel.%I ALTER rows SET STORAGE EXTERNAL', name);
    IF owner <> current_user::regrole THEN
        EXECUTE format('ALTER TABLE tunnel.%I OWNER TO %s', name, owner);
    END IF;
END
$$;
COMMENT ON FUNCTION tunnel_api.fragment_create(int, int, int) IS
'Makes the empty table that takes what was read of a file until it is loaded into a kilometre: blocks of packed rows.';
