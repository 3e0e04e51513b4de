-- Partitions of tunnel.point: one for each survey and kilometre, built beside the old one and swapped in; and tables of
-- points that wait to be loaded.

-- Name of the partition that holds a survey's kilometre.
CREATE OR REPLACE FUNCTION tunnel_internal.partition_name(survey_id int, km int)
RETURNS text
LANGUAGE sql IMMUTABLE PARALLEL SAFE STRICT
AS $$ SELECT 'point_s' || survey_id || '_km' || km $$;
COMMENT ON FUNCTION tunnel_internal.partition_name(int, int) IS
'Name of the partition of tunnel.point that holds a kilometre of a survey';


-- FROM expression for the partitions of several kilometres, by name: the reader locks no parent table, whose other partitions may
-- be swapped meanwhile. Without partitions, an empty set.
CREATE OR REPLACE FUNCTION tunnel_internal.partition_source(survey_id int, km_from int, km_to int)
RETURNS text
LANGUAGE sql STABLE PARALLEL SAFE STRICT
AS $$
    SELECT '(' || coalesce(string_agg(format('SELECT * FROM tunnel.%I', n.name), ' UNION ALL ' ORDER BY k),
        'SELECT * FROM tunnel.point WHERE false') || ')'
    FROM generate_series(km_from, km_to) AS k, tunnel_internal.partition_name(survey_id, k) AS n (name)
    WHERE to_regclass('tunnel.' || quote_ident(n.name)) IS NOT NULL AND tunnel_internal.in_order(km_from, km_to, 'km')
$$;
COMMENT ON FUNCTION tunnel_internal.partition_source(int, int, int) IS
'FROM expression that reads the points of the kilometres km_from to km_to of a survey: their partitions by name, without a lock on the parent table';


-- Lock a kilometre of a survey and its parent table against readers, as late as possible in a transaction, because others
-- wait until it ends. A waiting lock blocks all later readers. Therefore each attempt waits 0.1 s at most, lets waiting
-- readers pass, and tries again: long readers delay the swap only. Gives up after the session's lock_timeout, or 10 minutes.
CREATE OR REPLACE FUNCTION tunnel_internal.partition_lock(survey_id int, km int)
RETURNS void
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT
AS $$
DECLARE
    own constant text := current_setting('lock_timeout');
    patience constant interval := coalesce(nullif(own::interval, '0'), '10 minutes');
    since constant timestamptz := clock_timestamp();
    parent constant text := 'point_s' || survey_id;
    name constant text := tunnel_internal.partition_name(survey_id, km);
    others text;
BEGIN
    LOOP
        BEGIN
            PERFORM set_config('lock_timeout', '100ms', true);
            EXECUTE format('LOCK TABLE ONLY tunnel.%I IN ACCESS EXCLUSIVE MODE', parent);
            IF to_regclass('tunnel.' || quote_ident(name)) IS NOT NULL THEN
                EXECUTE format('LOCK TABLE tunnel.%I IN ACCESS EXCLUSIVE MODE', name);
            END IF;
            PERFORM set_config('lock_timeout', own, true);
            RETURN;
        EXCEPTION WHEN lock_not_available THEN
            IF clock_timestamp() - since > patience THEN
                SELECT string_agg(DISTINCT l.pid::text, ', ') INTO others
                FROM pg_locks l
                WHERE l.relation IN (to_regclass('tunnel.' || quote_ident(parent)), to_regclass('tunnel.' || quote_ident(name)))
                  AND l.granted AND l.pid <> pg_backend_pid();
                RAISE EXCEPTION 'kilometre % cannot be swapped in: for % s its survey has been read without a break (sessions %)',
                    km, round(extract(epoch FROM patience)), coalesce(others, 'unknown')
                    USING ERRCODE = 'lock_not_available', HINT = 'End the long query, or run it again later.';
            END IF;
        END;
        PERFORM pg_sleep(0.1 + 0.2 * random());
    END LOOP;
END
$$;
COMMENT ON FUNCTION tunnel_internal.partition_lock(int, int) IS
'Lock a kilometre of a survey and its parent table before a swap or a drop, without blocking readers while it waits. Gives up after the session''s lock_timeout, or 10 minutes';


-- Create the parent table of a survey's partitions if it is missing, and attach it, which does not block readers.
CREATE OR REPLACE FUNCTION tunnel_internal.partition_parent(survey_id int)
RETURNS void
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT
AS $$
DECLARE
    name constant text := 'point_s' || survey_id;
    owner constant regrole := (SELECT c.relowner FROM pg_class c WHERE c.oid = 'tunnel.point'::regclass);
BEGIN
    IF to_regclass('tunnel.' || quote_ident(name)) IS NULL THEN
        LOCK TABLE ONLY tunnel.point IN SHARE UPDATE EXCLUSIVE MODE;  -- two workers make it once
    END IF;
    IF to_regclass('tunnel.' || quote_ident(name)) IS NULL THEN
        EXECUTE format('CREATE TABLE tunnel.%I (LIKE tunnel.point) PARTITION BY LIST (km)', name);
        EXECUTE format('ALTER TABLE tunnel.%I OWNER TO %s', name, owner);
        EXECUTE format('ALTER TABLE tunnel.point ATTACH PARTITION tunnel.%I FOR VALUES IN (%s)', name, survey_id);
    END IF;
END
$$;
COMMENT ON FUNCTION tunnel_internal.partition_parent(int) IS
'Create the parent table of a survey''s partitions if there is none';


-- Create the empty table <partition>_new for the new points of a kilometre. Its check constraint saves ATTACH a scan under
-- the lock, and costs least while rows are written.
CREATE OR REPLACE FUNCTION tunnel_internal.partition_new(survey_id int, km int)
RETURNS void
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT
AS $$
DECLARE
    name constant text := tunnel_internal.partition_name(survey_id, km) || '_new';
BEGIN
    IF to_regclass('tunnel.' || quote_ident(name)) IS NOT NULL THEN
        EXECUTE format('DROP TABLE tunnel.%I', name);
    END IF;
    EXECUTE format('CREATE TABLE tunnel.%I (LIKE tunnel.point, CONSTRAINT part CHECK (survey_id = %s AND km = %s))',
        name, survey_id, km);
END
$$;
COMMENT ON FUNCTION tunnel_internal.partition_new(int, int) IS
'Create the empty table <partition>_new, in which partition_swap expects the new points of a kilometre';


-- Replace the partition of a kilometre by <partition>_new, which partition_new created and which was filled roughly in order of
-- chainage: create the BRIN index and statistics, drop the old partition and attach the new one, in the caller's transaction.
-- Readers see the old kilometre until it commits, then the new one.
CREATE OR REPLACE FUNCTION tunnel_internal.partition_swap(survey_id int, km int)
RETURNS void
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT
AS $$
DECLARE
    name constant text := tunnel_internal.partition_name(survey_id, km);
    parent constant text := 'point_s' || survey_id;
    owner constant regrole := (SELECT c.relowner FROM pg_class c WHERE c.oid = 'tunnel.point'::regclass);
BEGIN
    -- it is written once and analysed here: autovacuum has nothing to do on it
    EXECUTE format('ALTER TABLE tunnel.%I SET (autovacuum_enabled = off)', name || '_new');
    EXECUTE format('CREATE INDEX ON tunnel.%I USING brin (chainage) WITH (pages_per_range = 16)', name || '_new');
    -- geometry is never searched by its box here: its statistics would cost more than the index
    EXECUTE format('ANALYZE tunnel.%I (survey_id, km, chainage, segment)', name || '_new');
    -- any operator may swap what another one loaded
    EXECUTE format('ALTER TABLE tunnel.%I OWNER TO %s', name || '_new', owner);
    PERFORM tunnel_internal.partition_parent(survey_id);
    PERFORM tunnel_internal.partition_lock(survey_id, km);
    EXECUTE format('DROP TABLE IF EXISTS tunnel.%I', name);
    EXECUTE format('ALTER TABLE tunnel.%I RENAME TO %I', name || '_new', name);
    EXECUTE format('ALTER TABLE tunnel.%I ATTACH PARTITION tunnel.%I FOR VALUES IN (%s)', parent, name, km);
    EXECUTE format('ALTER TABLE tunnel.%I DROP CONSTRAINT part', name);
END
$$;
COMMENT ON FUNCTION tunnel_internal.partition_swap(int, int) IS
'Replace the partition of a survey''s kilometre by the table <partition>_new, with its index, in the caller''s transaction. Call it as late as possible. Long readers delay it and are not blocked';


-- Create the empty table tunnel.fragment_s<survey>_f<file>_km<km>, replacing an older one. It belongs to the owner of
-- tunnel.point, so that any operator can load it.
CREATE OR REPLACE FUNCTION tunnel_internal.fragment_create(survey_id int, file_id int, km int)
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
    EXECUTE format('ALTER TABLE tunnel.%I OWNER TO %s', name, owner);
END
$$;
COMMENT ON FUNCTION tunnel_internal.fragment_create(int, int, int) IS
'Create an empty table for points that were read from a file and not yet loaded into a kilometre: blocks of packed rows';
