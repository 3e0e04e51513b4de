-- Edits through the views, by INSTEAD OF triggers: positions of axis vertices; review, remark and kind of findings and leaks
-- (views/finding.sql); review and remark of spots (views/structures.sql); regions drawn by hand. The functions run with the owner's
-- rights, so that inspectors need no right on schema tunnel, and write session_user, the person's own role, into each row. They
-- lock the row and write only the changed columns, so that concurrent edits of other columns stay. If two people changed the
-- same column to different values, the later edit is refused with a serialization failure.

-- Move an axis vertex. Frame and unit: the tunnel's SRID, m.
CREATE OR REPLACE FUNCTION tunnel_internal.edit_axis_vertex() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    most constant float8 := 25;  -- m, the distance up to which points of the tunnel are selected
    was tunnel.axis_vertex;
    given public.geometry;
BEGIN
    IF (NEW.id, NEW.survey_id, NEW.survey, NEW.n, NEW.km, NEW.chainage, NEW.label, NEW.points, NEW.source,
        NEW.edited_by, NEW.edited_at, NEW.remark) IS DISTINCT FROM
       (OLD.id, OLD.survey_id, OLD.survey, OLD.n, OLD.km, OLD.chainage, OLD.label, OLD.points, OLD.source,
        OLD.edited_by, OLD.edited_at, OLD.remark) THEN
        RAISE EXCEPTION 'of an axis vertex only the position (geom) can be edited'
            USING ERRCODE = 'feature_not_supported';
    END IF;
    IF NEW.geom IS NULL OR public.ST_IsEmpty(NEW.geom) THEN
        RAISE EXCEPTION 'axis vertex % at chainage % cannot be without a position', OLD.n, OLD.label
            USING ERRCODE = 'null_value_not_allowed';
    END IF;
    IF public.GeometryType(NEW.geom) <> 'POINT' THEN
        RAISE EXCEPTION 'the position of axis vertex % is a point, not a %', OLD.n, lower(public.GeometryType(NEW.geom))
            USING ERRCODE = 'invalid_parameter_value';
    END IF;
    IF public.ST_SRID(NEW.geom) <> public.ST_SRID(OLD.geom) THEN
        RAISE EXCEPTION 'axis vertex % is in SRID %, its new position in SRID %',
            OLD.n, public.ST_SRID(OLD.geom), public.ST_SRID(NEW.geom)
            USING ERRCODE = 'invalid_parameter_value', HINT = 'Transform the position first (ST_Transform).';
    END IF;
    IF public.ST_X(NEW.geom) IN ('NaN', 'Infinity', '-Infinity') OR public.ST_Y(NEW.geom) IN ('NaN', 'Infinity', '-Infinity')
       OR coalesce(public.ST_Z(NEW.geom), 'NaN') IN ('NaN', 'Infinity', '-Infinity') THEN
        RAISE EXCEPTION 'the new position of axis vertex % needs three finite coordinates, got %',
            OLD.n, public.ST_AsText(NEW.geom)
            USING ERRCODE = 'invalid_parameter_value';
    END IF;
    PERFORM tunnel_internal.check_coordinates(format('the new position of axis vertex %s', OLD.n), NEW.geom);
    IF NEW.geom OPERATOR(public.=) OLD.geom THEN
        RETURN NEW;
    END IF;
    given := (SELECT v.given FROM tunnel.axis_vertex v WHERE v.id = OLD.id);
    IF public.ST_3DDistance(NEW.geom, given) > most THEN
        RAISE EXCEPTION 'the new position of axis vertex % at chainage % is % m from the given axis, more than % m', OLD.n,
            OLD.label, round(public.ST_3DDistance(NEW.geom, given)::numeric, 1), most USING ERRCODE = 'invalid_parameter_value';
    END IF;
    SELECT v.* INTO was FROM tunnel.axis_vertex v WHERE v.id = OLD.id FOR UPDATE;
    IF NOT FOUND THEN
        RETURN NULL;  -- deleted meanwhile
    END IF;
    IF was.geom OPERATOR(public.=) NEW.geom THEN
        RETURN NEW;
    END IF;
    IF NOT was.geom OPERATOR(public.=) OLD.geom THEN
        RAISE EXCEPTION 'axis vertex % at chainage % was moved meanwhile', OLD.n, OLD.label
            USING ERRCODE = 'serialization_failure', HINT = 'Reload the row, then edit it again.';
    END IF;
    NEW.source := 'edited';
    NEW.edited_by := session_user;
    NEW.edited_at := clock_timestamp();
    NEW.remark := NULL;
    UPDATE tunnel.axis_vertex
       SET geom = NEW.geom, source = NEW.source, edited_by = NEW.edited_by, edited_at = NEW.edited_at, remark = NEW.remark
     WHERE id = OLD.id;
    PERFORM tunnel_internal.note_edit(OLD.survey, 'axis_vertex', OLD.id,
                                 jsonb_build_object('geom', public.ST_AsEWKT(was.geom), 'source', was.source),
                                 jsonb_build_object('geom', public.ST_AsEWKT(NEW.geom), 'source', NEW.source));
    RETURN NEW;
END
$$;
COMMENT ON FUNCTION tunnel_internal.edit_axis_vertex() IS
    'Trigger of the view axis_vertex: move a vertex, and write role and time';

CREATE OR REPLACE TRIGGER edit INSTEAD OF UPDATE ON tunnel_api.axis_vertex
    FOR EACH ROW EXECUTE FUNCTION tunnel_internal.edit_axis_vertex();

-- Set review, remark and, where kinds are given, the kind of a finding or a spot. TG_ARGV: table in schema tunnel, name in
-- messages, permitted kinds (any: those of finding_kind). A kind other than the detected one is stored as kind_override; setting
-- the detected kind clears it. Geometries, whose columns differ between the views, are never written.
CREATE OR REPLACE FUNCTION tunnel_internal.review_finding() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    kinds CONSTANT text[] := TG_ARGV[2:];
    judging CONSTANT boolean := cardinality(kinds) > 0;
    editable CONSTANT text[] := CASE WHEN judging THEN ARRAY['review', 'remark', 'kind'] ELSE ARRAY['review', 'remark'] END;
    geometries CONSTANT text[] := ARRAY['unrolled', 'map', 'surface', 'outline', 'geom'];
    was record;
BEGIN
    PERFORM tunnel_internal.check_review(OLD.kind || ' ' || OLD.id, NEW.review, NEW.remark);
    IF to_jsonb(NEW) - editable - geometries IS DISTINCT FROM to_jsonb(OLD) - editable - geometries THEN
        RAISE EXCEPTION 'of % only % can be edited', TG_ARGV[1],
            CASE WHEN judging THEN 'the review, the remark and the kind' ELSE 'the review and the remark' END
            USING ERRCODE = 'feature_not_supported';
    END IF;
    IF kinds = ARRAY['any'] THEN
        IF NEW.kind IS DISTINCT FROM OLD.kind THEN
            PERFORM tunnel_internal.check_kind(NEW.kind, (SELECT coalesce(a.shape, a.unrolled) FROM tunnel.finding a WHERE a.id = OLD.id AND a.manual));
        END IF;
    ELSIF judging AND NEW.kind IS DISTINCT FROM OLD.kind AND (NEW.kind IS NULL OR NEW.kind <> ALL (kinds)) THEN
        RAISE EXCEPTION 'the kind of % % can be %, not %', OLD.kind, OLD.id,
            array_to_string(kinds[:cardinality(kinds) - 1], ', ') || ' or ' || kinds[cardinality(kinds)],
            coalesce(tunnel_internal.excerpt(NEW.kind), 'empty')
            USING ERRCODE = 'check_violation';
    END IF;
    IF (NEW.review, NEW.remark, NEW.kind) IS NOT DISTINCT FROM (OLD.review, OLD.remark, OLD.kind) THEN
        RETURN NEW;
    END IF;
    IF TG_ARGV[0] = 'spot' THEN
        SELECT p.review, p.remark, p.kind INTO was FROM tunnel.spot p WHERE p.id = OLD.id FOR UPDATE;
    ELSE
        PERFORM tunnel_internal.lock_findings(a.survey_id) FROM tunnel.finding a WHERE a.id = OLD.id;
        SELECT a.review, a.remark, coalesce(a.kind_override, a.kind) AS kind INTO was
          FROM tunnel.finding a WHERE a.id = OLD.id FOR UPDATE;
    END IF;
    IF NOT FOUND THEN
        RETURN NULL;  -- deleted meanwhile
    END IF;
    NEW.review := CASE WHEN NEW.review = OLD.review THEN was.review ELSE NEW.review END;
    NEW.remark := CASE WHEN NEW.remark IS NOT DISTINCT FROM OLD.remark THEN was.remark ELSE NEW.remark END;
    NEW.kind := CASE WHEN NEW.kind = OLD.kind THEN was.kind ELSE NEW.kind END;
    IF (NEW.review, NEW.remark, NEW.kind) IS NOT DISTINCT FROM (was.review, was.remark, was.kind) THEN
        RETURN NEW;
    END IF;
    IF was.review NOT IN (OLD.review, NEW.review) OR was.kind NOT IN (OLD.kind, NEW.kind)
       OR (was.remark IS DISTINCT FROM OLD.remark AND was.remark IS DISTINCT FROM NEW.remark) THEN
        RAISE EXCEPTION '% % % was changed meanwhile: it is %, with the kind % and %', OLD.kind, OLD.id,
            coalesce('at ' || OLD.label, 'of a site'), was.review, was.kind,
            coalesce('the remark ' || quote_literal(tunnel_internal.excerpt(was.remark)), 'no remark')
            USING ERRCODE = 'serialization_failure', HINT = 'Reload the row, then edit it again.';
    END IF;
    NEW.reviewed_by := session_user;
    NEW.reviewed_at := clock_timestamp();
    IF TG_ARGV[0] = 'spot' THEN
        UPDATE tunnel.spot p
           SET review = NEW.review, remark = NEW.remark, reviewed_by = NEW.reviewed_by, reviewed_at = NEW.reviewed_at
         WHERE p.id = OLD.id;
    ELSE
        UPDATE tunnel.finding a
           SET review = NEW.review, remark = NEW.remark, reviewed_by = NEW.reviewed_by, reviewed_at = NEW.reviewed_at,
               kind = CASE WHEN a.manual THEN NEW.kind ELSE a.kind END,
               kind_override = CASE WHEN a.manual THEN NULL WHEN NEW.kind = was.kind THEN a.kind_override ELSE nullif(NEW.kind, a.kind) END
         WHERE a.id = OLD.id;
        PERFORM tunnel_internal.check_hidden(OLD.id);
        PERFORM tunnel_internal.settle_findings(a.survey_id, a.unrolled) FROM tunnel.finding a WHERE a.id = OLD.id;
    END IF;
    PERFORM tunnel_internal.note_edit(OLD.survey, TG_ARGV[0], OLD.id, to_jsonb(was),
                                 jsonb_build_object('review', NEW.review, 'remark', NEW.remark, 'kind', NEW.kind));
    RETURN NEW;
END
$$;
COMMENT ON FUNCTION tunnel_internal.review_finding() IS
    'Trigger of the views of leaks, findings and spots: set review, remark and kind, and write role and time';

DO $$
DECLARE
    name text;
BEGIN
    FOREACH name IN ARRAY ARRAY['leak', 'leak_unrolled', 'leak_map', 'leak_3d'] LOOP
        EXECUTE format('CREATE OR REPLACE TRIGGER edit INSTEAD OF UPDATE ON tunnel_api.%I FOR EACH ROW EXECUTE FUNCTION'
                       ' tunnel_internal.review_finding(''finding'', ''a leak'', ''leak'', ''joint'', ''dark'')', name);
    END LOOP;
    CREATE OR REPLACE TRIGGER edit INSTEAD OF UPDATE ON tunnel_api.finding
        FOR EACH ROW EXECUTE FUNCTION tunnel_internal.review_finding('finding', 'a finding', 'any');
    FOREACH name IN ARRAY ARRAY['spot', 'spot_face', 'spot_map', 'spot_3d', 'spot_sheet'] LOOP
        EXECUTE format('CREATE OR REPLACE TRIGGER edit INSTEAD OF UPDATE ON tunnel_api.%I FOR EACH ROW EXECUTE FUNCTION'
                       ' tunnel_internal.review_finding(''spot'', ''a spot'')', name);
    END LOOP;
END
$$;

-- Insert, redraw and delete in a layer of leaks go through the views of findings; the kind is leak by default. TG_ARGV: place, see
-- draw_finding. Runs before the review of the same update.
CREATE OR REPLACE FUNCTION tunnel_internal.draw_leak() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    view CONSTANT text := 'finding_' || TG_ARGV[0];
    done bigint;
BEGIN
    IF TG_OP = 'INSERT' THEN
        EXECUTE format('INSERT INTO tunnel_api.%I (survey_id, survey, kind, review, remark, geom)'
                       ' VALUES ($1, $2, $3, $4, $5, $6) RETURNING id', view)
           INTO NEW.id USING NEW.survey_id, NEW.survey, coalesce(NEW.kind, 'leak'), NEW.review, NEW.remark, NEW.geom;
        RETURN NEW;
    ELSIF TG_OP = 'DELETE' THEN
        EXECUTE format('DELETE FROM tunnel_api.%I WHERE id = $1', view) USING OLD.id;
        GET DIAGNOSTICS done = ROW_COUNT;
        RETURN CASE done WHEN 0 THEN NULL ELSE OLD END;
    ELSIF public.ST_AsEWKB(NEW.geom) IS DISTINCT FROM public.ST_AsEWKB(OLD.geom) THEN
        EXECUTE format('UPDATE tunnel_api.%I SET geom = $1 WHERE id = $2', view) USING NEW.geom, OLD.id;
    END IF;
    RETURN NEW;
END
$$;
COMMENT ON FUNCTION tunnel_internal.draw_leak() IS
    'Trigger of the views of leaks with one geometry: insert, redraw and delete through the views of findings';

DO $$
DECLARE
    place text;
BEGIN
    FOREACH place IN ARRAY ARRAY['unrolled', 'map', '3d'] LOOP
        EXECUTE format('CREATE OR REPLACE TRIGGER draw INSTEAD OF INSERT OR UPDATE OR DELETE ON tunnel_api.%I FOR EACH ROW'
                       ' EXECUTE FUNCTION tunnel_internal.draw_leak(%L)', 'leak_' || place, place);
    END LOOP;
END
$$;

-- Columns of a region for the audit.
CREATE OR REPLACE FUNCTION tunnel_internal.region_state(id int) RETURNS jsonb
LANGUAGE sql STABLE PARALLEL SAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT jsonb_strip_nulls(jsonb_build_object('kind', r.kind, 'reason', r.reason, 'pending_approval', nullif(r.pending_approval, false),
        'approved_by', r.approved_by, 'geom', public.ST_AsEWKT(r.geom)))
      FROM tunnel.region r WHERE r.id = $1
$$;
COMMENT ON FUNCTION tunnel_internal.region_state(int) IS
    'Columns of a region for the audit: kind, reason, outline as EWKT, pending approval, operator who approved it';

-- Insert, change or delete a region drawn by hand in the unrolled plane (m). A new region needs survey_id or survey (name).
CREATE OR REPLACE FUNCTION tunnel_internal.edit_region() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    was tunnel.region;
    before jsonb;
    its tunnel.survey;
    most float8;
    area float8;
    taken float8 := 0;
BEGIN
    IF TG_OP = 'DELETE' THEN
        PERFORM FROM tunnel.region r WHERE r.id = OLD.id FOR UPDATE;
        before := tunnel_internal.region_state(OLD.id);
        DELETE FROM tunnel.region r WHERE r.id = OLD.id RETURNING r.* INTO was;
        IF NOT FOUND THEN
            RETURN NULL;  -- deleted meanwhile
        END IF;
        PERFORM tunnel_internal.note_edit(OLD.survey, 'region', OLD.id, before, NULL);
        PERFORM tunnel_internal.mark_dry(was.survey_id, was.geom);
        RETURN OLD;
    END IF;
    PERFORM tunnel_internal.check_text('the reason', NEW.reason, 10000);
    PERFORM tunnel_internal.check_coordinates('the region', NEW.geom);
    IF NEW.kind IS NULL OR NEW.kind NOT IN ('dry', 'homogeneous') THEN
        RAISE EXCEPTION 'the kind of a region can be dry or homogeneous, not %',
            coalesce(tunnel_internal.excerpt(NEW.kind), 'empty') USING ERRCODE = 'check_violation';
    END IF;
    IF NOT coalesce(public.ST_IsValid(NEW.geom) AND public.ST_Area(NEW.geom) > 0, false) THEN
        RAISE EXCEPTION 'a region must be a valid polygon: %',
            CASE WHEN NOT public.ST_IsValid(NEW.geom) THEN public.ST_IsValidReason(NEW.geom) ELSE 'it is empty' END
            USING ERRCODE = 'invalid_parameter_value';
    END IF;
    IF TG_OP = 'UPDATE' THEN
        IF (NEW.id, NEW.survey_id, NEW.survey, NEW.drawn_by, NEW.drawn_at, NEW.pending_approval, NEW.approved_by, NEW.approved_at) IS DISTINCT FROM
           (OLD.id, OLD.survey_id, OLD.survey, OLD.drawn_by, OLD.drawn_at, OLD.pending_approval, OLD.approved_by, OLD.approved_at) THEN
            RAISE EXCEPTION 'of a region only the kind, the reason and the outline (geom) can be edited'
                USING ERRCODE = 'feature_not_supported';
        END IF;
        IF (NEW.kind, NEW.reason) IS NOT DISTINCT FROM (OLD.kind, OLD.reason) AND NEW.geom OPERATOR(public.=) OLD.geom THEN
            RETURN NEW;
        END IF;
        SELECT r.* INTO was FROM tunnel.region r WHERE r.id = OLD.id FOR UPDATE;
        IF NOT FOUND THEN
            RETURN NULL;
        END IF;
        before := tunnel_internal.region_state(was.id);
        NEW.kind := CASE WHEN NEW.kind = OLD.kind THEN was.kind ELSE NEW.kind END;
        NEW.geom := CASE WHEN NEW.geom OPERATOR(public.=) OLD.geom THEN was.geom ELSE NEW.geom END;
        NEW.reason := CASE WHEN NEW.reason IS NOT DISTINCT FROM OLD.reason THEN was.reason ELSE NEW.reason END;
        IF (NEW.kind, NEW.reason) IS NOT DISTINCT FROM (was.kind, was.reason) AND NEW.geom OPERATOR(public.=) was.geom THEN
            RETURN NEW;
        END IF;
        IF was.kind NOT IN (OLD.kind, NEW.kind) OR NOT (was.geom OPERATOR(public.=) OLD.geom OR was.geom OPERATOR(public.=) NEW.geom)
           OR (was.reason IS DISTINCT FROM OLD.reason AND was.reason IS DISTINCT FROM NEW.reason) THEN
            RAISE EXCEPTION 'region % was changed meanwhile', OLD.id
                USING ERRCODE = 'serialization_failure', HINT = 'Reload the row, then edit it again.';
        END IF;
    ELSE
        SELECT s.* INTO its FROM tunnel.survey s
         WHERE CASE WHEN NEW.survey_id IS NULL THEN s.name = NEW.survey ELSE s.id = NEW.survey_id END;
        IF NOT FOUND THEN
            RAISE EXCEPTION 'a region needs the survey it belongs to; there is none %',
                coalesce('with id ' || NEW.survey_id, 'named ' || tunnel_internal.excerpt(NEW.survey), 'without a name')
                USING ERRCODE = 'invalid_parameter_value';
        END IF;
        NEW.survey_id := its.id;
        NEW.survey := its.name;
    END IF;
    SELECT t.dry_region_limit INTO most
      FROM tunnel.survey s JOIN tunnel.tunnel t ON t.id = s.tunnel_id WHERE s.id = NEW.survey_id;
    IF was.id IS NULL OR NEW.kind <> was.kind OR NOT NEW.geom OPERATOR(public.=) was.geom THEN
        NEW.drawn_by := session_user;
        NEW.drawn_at := clock_timestamp();
    ELSE
        NEW.drawn_by := was.drawn_by;
        NEW.drawn_at := was.drawn_at;
    END IF;
    area := public.ST_Area(NEW.geom);
    IF NEW.kind = 'dry' THEN
        taken := tunnel_internal.area_taken(NEW.survey_id, NEW.drawn_by, was.id);
        IF area + taken > most AND coalesce(trim(NEW.reason), '') = '' THEN
            RAISE EXCEPTION 'a dry region of % m²% is larger than % m²: its reason must say why', round(area::numeric, 1),
                CASE WHEN taken > 0 THEN format(', with %s m² that %s took away before in %s,', round(taken::numeric, 1), NEW.drawn_by, NEW.survey)
                     ELSE '' END, most USING ERRCODE = 'check_violation';
        END IF;
    END IF;
    -- the approval applies to the region with its reason at that time
    IF was.id IS NULL OR NEW.kind <> was.kind OR NOT NEW.geom OPERATOR(public.=) was.geom OR NEW.reason IS DISTINCT FROM was.reason THEN
        NEW.pending_approval := NEW.kind = 'dry' AND area + taken > most;
        NEW.approved_by := NULL;
        NEW.approved_at := NULL;
    ELSE
        NEW.pending_approval := was.pending_approval;
        NEW.approved_by := was.approved_by;
        NEW.approved_at := was.approved_at;
    END IF;
    IF TG_OP = 'INSERT' THEN
        INSERT INTO tunnel.region (survey_id, kind, geom, drawn_by, drawn_at, reason, pending_approval)
        VALUES (NEW.survey_id, NEW.kind, NEW.geom, NEW.drawn_by, NEW.drawn_at, NEW.reason, NEW.pending_approval)
        RETURNING id INTO NEW.id;
    ELSE
        UPDATE tunnel.region r
           SET kind = NEW.kind, geom = NEW.geom, drawn_by = NEW.drawn_by, drawn_at = NEW.drawn_at, reason = NEW.reason,
               pending_approval = NEW.pending_approval, approved_by = NEW.approved_by, approved_at = NEW.approved_at
         WHERE r.id = OLD.id;
    END IF;
    PERFORM tunnel_internal.note_edit(NEW.survey, 'region', NEW.id, before, tunnel_internal.region_state(NEW.id));
    PERFORM tunnel_internal.mark_dry(NEW.survey_id, public.ST_Collect(was.geom, NEW.geom));
    RETURN NEW;
END
$$;
COMMENT ON FUNCTION tunnel_internal.edit_region() IS 'Trigger of the view region: write a region, with role and time';

CREATE OR REPLACE TRIGGER edit INSTEAD OF INSERT OR UPDATE OR DELETE ON tunnel_api.region
    FOR EACH ROW EXECUTE FUNCTION tunnel_internal.edit_region();

-- A dry region has no effect until an operator approves it, if it is larger than the tunnel's limit, with all else that the same
-- person takes away in the survey (area_taken).
CREATE OR REPLACE FUNCTION tunnel_api.dry_region_approve(region_id int) RETURNS int
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    was tunnel.region;
    before constant jsonb := tunnel_internal.region_state(region_id);
BEGIN
    SELECT r.* INTO was FROM tunnel.region r WHERE r.id = region_id FOR UPDATE;
    IF was.id IS NULL OR NOT was.pending_approval THEN
        RAISE EXCEPTION '%', CASE WHEN was.id IS NULL THEN format('there is no region %s', region_id)
                                  ELSE format('region %s does not wait: it is in force', region_id) END
            USING ERRCODE = 'invalid_parameter_value';
    END IF;
    UPDATE tunnel.region r SET pending_approval = false, approved_by = session_user, approved_at = clock_timestamp()
     WHERE r.id = region_id;
    PERFORM tunnel_internal.note_edit((SELECT s.name FROM tunnel.survey s WHERE s.id = was.survey_id), 'region', region_id,
                                 before, tunnel_internal.region_state(region_id));
    PERFORM tunnel_internal.mark_dry(was.survey_id, was.geom);
    RETURN (SELECT d.leaks FROM tunnel_api.dry_region d WHERE d.id = region_id);
END
$$;
COMMENT ON FUNCTION tunnel_api.dry_region_approve(int) IS
'Approve a dry region that waits because its author takes away more than dry_region_limit of the tunnel; for operators. Returns the number of open leaks that it excludes';
