-- A survey's partitions of tunnel.point and tunnel.image: made with the survey, dropped with it.

-- Attached, for that lets others read on meanwhile. In a restored dump the partition is there before its survey.
CREATE FUNCTION tunnel.make_images() RETURNS trigger
LANGUAGE plpgsql
AS $$
DECLARE
    name constant text := 'image_s' || NEW.id;
    owner constant regrole := (SELECT c.relowner FROM pg_class c WHERE c.oid = 'tunnel.image'::regclass);
BEGIN
    IF to_regclass('tunnel.' || quote_ident(name)) IS NULL THEN
        EXECUTE format('CREATE TABLE tunnel.%I (LIKE tunnel.image INCLUDING ALL)', name);
        EXECUTE format('ALTER TABLE tunnel.%I OWNER TO %s', name, owner);
        EXECUTE format('ALTER TABLE tunnel.image ATTACH PARTITION tunnel.%I FOR VALUES IN (%s)', name, NEW.id);
    END IF;
    RETURN NULL;
END
$$;
COMMENT ON FUNCTION tunnel.make_images() IS 'Trigger on tunnel.survey: makes the partition of tunnel.image for a new survey';
CREATE TRIGGER make_images AFTER INSERT ON tunnel.survey FOR EACH ROW EXECUTE FUNCTION tunnel.make_images();
COMMENT ON TRIGGER make_images ON tunnel.survey IS 'Makes the survey''s partition of tunnel.image';

-- Points go as their survey goes: a foreign key would have each new partition checked row by row. The tables that hold the partitions
-- of all surveys must be locked to drop one. Behind a lock that waits, everybody else waits too: it waits for a tenth of a second, lets
-- those who came meanwhile pass, and tries again.
CREATE FUNCTION tunnel.drop_points() RETURNS trigger
LANGUAGE plpgsql
AS $$
DECLARE
    own constant text := current_setting('lock_timeout');
    patience constant interval := coalesce(nullif(own::interval, '0'), '10 minutes');
    since constant timestamptz := clock_timestamp();
    root text;
    part text;
    name text;
BEGIN
    LOOP
        BEGIN
            PERFORM set_config('lock_timeout', '100ms', true);
            FOREACH root IN ARRAY ARRAY['point', 'image'] LOOP
                part := format('%s_s%s', root, OLD.id);
                IF to_regclass('tunnel.' || quote_ident(part)) IS NOT NULL THEN
                    EXECUTE format('LOCK TABLE tunnel.%I IN ACCESS EXCLUSIVE MODE', part);
                    EXECUTE format('LOCK TABLE ONLY tunnel.%I IN ACCESS EXCLUSIVE MODE', root);
                END IF;
            END LOOP;
            PERFORM set_config('lock_timeout', own, true);
            EXIT;
        EXCEPTION WHEN lock_not_available THEN
            IF clock_timestamp() - since > patience THEN
                RAISE EXCEPTION 'survey % cannot be removed: for % s points or images have been read without a break',
                    OLD.name, round(extract(epoch FROM patience))
                    USING ERRCODE = 'lock_not_available', HINT = 'End the long query, or run it again later.';
            END IF;
        END;
        PERFORM pg_sleep(0.1 + 0.2 * random());
    END LOOP;
    EXECUTE format('DROP TABLE IF EXISTS tunnel.%I, tunnel.%I', 'point_s' || OLD.id, 'image_s' || OLD.id);
    FOR name IN SELECT c.relname FROM pg_class c
                 WHERE c.relnamespace = 'tunnel'::regnamespace
                   AND c.relname ~ ('^fragment_s' || OLD.id || '_f[0-9]+_km-?[0-9]+$') LOOP
        EXECUTE format('DROP TABLE tunnel.%I', name);
    END LOOP;
    RETURN NULL;
END
$$;
COMMENT ON FUNCTION tunnel.drop_points() IS
'Trigger on tunnel.survey: drops the points and images of a survey that was deleted, and the fragments that wait';
CREATE TRIGGER drop_points AFTER DELETE ON tunnel.survey FOR EACH ROW EXECUTE FUNCTION tunnel.drop_points();
COMMENT ON TRIGGER drop_points ON tunnel.survey IS 'Drops the survey''s partitions of tunnel.point and tunnel.image';
