-- Photos of findings.

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
