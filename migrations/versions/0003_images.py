"""Images in a partition per survey, so that they go with it at once and give their disk back.

Revision: 0003, after 0002.
"""

from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None

# A foreign key would be copied to each partition, under a lock on tunnel.survey that two new surveys would fight over. A survey
# that is gone has no partition, so no image can be without its survey.
PARTITION = """
ALTER TABLE tunnel.image RENAME TO image_before;
ALTER TABLE tunnel.image_before RENAME CONSTRAINT image_pkey TO image_before_pkey;
CREATE TABLE tunnel.image (LIKE tunnel.image_before INCLUDING COMMENTS INCLUDING CONSTRAINTS) PARTITION BY LIST (survey_id);
ALTER TABLE tunnel.image ADD CONSTRAINT image_pkey PRIMARY KEY (survey_id, km, kind, block);
COMMENT ON TABLE tunnel.image IS 'Unrolled images in blocks of 50 m: partition image_s<survey>';
DO $$
BEGIN
    EXECUTE format('ALTER TABLE tunnel.image OWNER TO %s',
        (SELECT c.relowner::regrole FROM pg_class c WHERE c.oid = 'tunnel.image_before'::regclass));
END
$$;
"""

# Attached, for that lets others read on meanwhile. In a restored dump the partition is there before its survey.
MAKE_IMAGES = """
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
"""

MOVE_IMAGES = """
DO $$
DECLARE
    survey int;
    name text;
    owner constant regrole := (SELECT c.relowner FROM pg_class c WHERE c.oid = 'tunnel.image'::regclass);
BEGIN
    FOR survey IN SELECT s.id FROM tunnel.survey s LOOP
        name := 'image_s' || survey;
        EXECUTE format('CREATE TABLE tunnel.%I (LIKE tunnel.image INCLUDING ALL)', name);
        EXECUTE format('ALTER TABLE tunnel.%I OWNER TO %s', name, owner);
        EXECUTE format('INSERT INTO tunnel.%I SELECT * FROM tunnel.image_before WHERE survey_id = %s', name, survey);
        EXECUTE format('ALTER TABLE tunnel.image ATTACH PARTITION tunnel.%I FOR VALUES IN (%s)', name, survey);
    END LOOP;
    DROP TABLE tunnel.image_before;
END
$$;
"""

# The tables that hold the partitions of all surveys must be locked to drop one. Behind a lock that waits, everybody else waits
# too: it waits for a tenth of a second, lets those who came meanwhile pass, and tries again.
DROP_POINTS = """
CREATE OR REPLACE FUNCTION tunnel.drop_points() RETURNS trigger
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
COMMENT ON TRIGGER drop_points ON tunnel.survey IS 'Drops the survey''s partitions of tunnel.point and tunnel.image';
"""


def upgrade() -> None:
    for statement in (PARTITION, MOVE_IMAGES, MAKE_IMAGES, DROP_POINTS):
        op.execute(statement)
