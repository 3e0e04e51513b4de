-- Photos of findings: paths and URLs that people give, and photos that are stored in the database.

-- Insert, change or delete a photo of a finding: a path or URL, and a caption.
CREATE OR REPLACE FUNCTION tunnel_internal.edit_photo() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    most constant int := 100;  -- of a finding
    name text;
BEGIN
    IF TG_OP = 'DELETE' THEN
        DELETE FROM tunnel.photo p WHERE p.id = OLD.id;
        IF NOT FOUND THEN
            RETURN NULL;  -- deleted meanwhile
        END IF;
        PERFORM tunnel_internal.note_edit(OLD.survey, 'photo', OLD.id,
            jsonb_build_object('finding_id', OLD.finding_id, 'path', OLD.path, 'caption', OLD.caption), NULL);
        RETURN OLD;
    END IF;
    IF coalesce(NEW.path, '') = '' THEN
        RAISE EXCEPTION 'a photo needs a path or URL' USING ERRCODE = 'null_value_not_allowed';
    END IF;
    PERFORM tunnel_internal.check_text('the path of a photo', NEW.path, 2000),
            tunnel_internal.check_text('the caption of a photo', NEW.caption, 1000);
    IF NEW.path ~* '(^(file:)?/|\.\./)[./]*(dev|proc|sys)(/|$)' THEN  -- some never end, and QGIS would wait for them
        RAISE EXCEPTION 'the photo % is a device or a file of the kernel, not a picture', left(NEW.path, 60)
            USING ERRCODE = 'invalid_parameter_value';
    END IF;
    IF NEW.path ~* '^file:.*%(2[ef]|5c|[46][1-9a-f]|[57][0-9a])' THEN  -- a code for a letter, a full stop or a slash hides a folder
        RAISE EXCEPTION 'the photo % has codes where letters do, such as %%2F for /: write the path without them', left(NEW.path, 60)
            USING ERRCODE = 'invalid_parameter_value';
    END IF;
    IF NEW.path ~* '^(\\\\|//|file:(//[^/]|////|/*\\\\))' THEN  -- opening it sends the reader's login to that server
        RAISE EXCEPTION 'the photo % is on another computer: write its path from the folder of photos', left(NEW.path, 60)
            USING ERRCODE = 'invalid_parameter_value';
    END IF;
    SELECT s.name INTO name FROM tunnel.finding a JOIN tunnel.survey s ON s.id = a.survey_id WHERE a.id = NEW.finding_id;
    IF NOT FOUND OR (TG_OP = 'UPDATE' AND NEW.finding_id <> OLD.finding_id) THEN
        RAISE EXCEPTION 'a photo is of one finding, which stays; there is no finding %', NEW.finding_id
            USING ERRCODE = 'invalid_parameter_value';
    END IF;
    IF TG_OP = 'INSERT' AND (SELECT count(*) FROM tunnel.photo p WHERE p.finding_id = NEW.finding_id) >= most THEN
        RAISE EXCEPTION 'finding % has % photos, the most that a finding can have', NEW.finding_id, most USING ERRCODE = 'check_violation';
    END IF;
    NEW.survey := name;
    NEW.added_by := session_user;
    NEW.added_at := clock_timestamp();
    IF TG_OP = 'INSERT' THEN
        INSERT INTO tunnel.photo (finding_id, path, caption, added_by, added_at)
        VALUES (NEW.finding_id, NEW.path, NEW.caption, NEW.added_by, NEW.added_at) RETURNING id INTO NEW.id;
    ELSE
        UPDATE tunnel.photo p SET path = NEW.path, caption = NEW.caption, added_by = NEW.added_by, added_at = NEW.added_at
         WHERE p.id = OLD.id;
    END IF;
    PERFORM tunnel_internal.note_edit(name, 'photo', NEW.id,
        CASE TG_OP WHEN 'UPDATE' THEN jsonb_build_object('finding_id', OLD.finding_id, 'path', OLD.path, 'caption', OLD.caption) END,
        jsonb_build_object('finding_id', NEW.finding_id, 'path', NEW.path, 'caption', NEW.caption));
    RETURN NEW;
END
$$;
COMMENT ON FUNCTION tunnel_internal.edit_photo() IS 'Trigger of the view finding_photo: write a photo with role and time';

CREATE OR REPLACE TRIGGER edit INSTEAD OF INSERT OR UPDATE OR DELETE ON tunnel_api.finding_photo
    FOR EACH ROW EXECUTE FUNCTION tunnel_internal.edit_photo();

-- Photos that are stored in the database. A file stays as long as its survey: the audit can restore a deleted finding with its photos.
CREATE OR REPLACE FUNCTION tunnel_api.finding_photo_add(finding_id bigint, content bytea, caption text) RETURNS bigint
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE CALLED ON NULL INPUT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
#variable_conflict use_column
DECLARE
    finding_key constant bigint := finding_id;
    photo constant bytea := content;
    words constant text := caption;
    file constant text := encode(sha256(photo), 'hex') || '.jpg';
    most constant int := 30000000;  -- bytes
    survey_key int;
    photo_id bigint;
BEGIN
    IF octet_length(photo) > most OR (substr(photo, 1, 3) = '\xffd8ff') IS NOT TRUE THEN
        RAISE EXCEPTION 'a photo is a JPEG of at most % bytes', most USING ERRCODE = 'invalid_parameter_value';
    END IF;
    SELECT a.survey_id INTO survey_key FROM tunnel.finding a WHERE a.id = finding_key FOR NO KEY UPDATE;
    IF NOT FOUND THEN
        RAISE EXCEPTION 'there is no finding %', finding_key USING ERRCODE = 'invalid_parameter_value';
    END IF;
    SELECT p.id INTO photo_id FROM tunnel.photo p WHERE p.finding_id = finding_key AND p.path = file ORDER BY p.id LIMIT 1;
    IF FOUND THEN
        RETURN photo_id;  -- sent again, because the answer was lost
    END IF;
    INSERT INTO tunnel.photo_file (survey_id, name, content) VALUES (survey_key, file, photo) ON CONFLICT DO NOTHING;
    INSERT INTO tunnel_api.finding_photo (finding_id, path, caption) VALUES (finding_key, file, words) RETURNING id INTO photo_id;
    RETURN photo_id;
END
$$;
COMMENT ON FUNCTION tunnel_api.finding_photo_add(bigint, bytea, text) IS
'Store a photo, a JPEG of at most 30 MB, in the database, add it to a finding with a caption, and return its id in finding_photo. The same photo is stored once in a survey and shown once by a finding';

CREATE OR REPLACE FUNCTION tunnel_api.finding_photo_content(id bigint) RETURNS bytea
LANGUAGE sql STABLE STRICT PARALLEL SAFE SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT f.content
      FROM tunnel.photo p
      JOIN tunnel.finding a ON a.id = p.finding_id
      JOIN tunnel.photo_file f ON f.survey_id = a.survey_id AND f.name = p.path
     WHERE p.id = $1
$$;
COMMENT ON FUNCTION tunnel_api.finding_photo_content(bigint) IS
'A photo (id in finding_photo) as JPEG, if it is stored in the database; NULL if it is a path or URL';
