-- Drawing, redrawing, reviewing and deleting findings through the views finding_unrolled, finding_map and finding_3d. The rows are
-- locked; a concurrent change of the same value is refused; each edit is written to the audit, as in views/edit.sql.

CREATE OR REPLACE FUNCTION tunnel_internal.draw_finding() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    place CONSTANT text := TG_ARGV[0];
    editable CONSTANT text[] := ARRAY['kind', 'severity', 'width_mm', 'review', 'remark'];
    key text;
    its tunnel.survey;
    was tunnel.finding;
    is_now tunnel.finding;
    before jsonb;
    old_row jsonb;
    new_row jsonb;
    was_row jsonb;
    drawn public.geometry;
    shape_before public.geometry;
    redrawn boolean;
    lapses boolean := false;  -- the review does not apply to the new outline
    kept jsonb;
    step bigint;
BEGIN
    IF TG_OP <> 'DELETE' THEN
        PERFORM tunnel_internal.check_text('the remark', NEW.remark, 10000);
        IF TG_OP = 'INSERT' OR public.ST_AsEWKB(NEW.geom) IS DISTINCT FROM public.ST_AsEWKB(OLD.geom) THEN
            PERFORM tunnel_internal.check_shape('the drawing', NEW.geom);
        END IF;
    END IF;
    IF TG_OP = 'INSERT' THEN
        SELECT s.* INTO its FROM tunnel.survey s
         WHERE CASE WHEN NEW.survey_id IS NULL THEN s.name = NEW.survey ELSE s.id = NEW.survey_id END;
        IF NOT FOUND THEN
            RAISE EXCEPTION 'a finding needs the survey it belongs to; there is none %',
                coalesce('with id ' || NEW.survey_id, 'named ' || tunnel_internal.excerpt(NEW.survey), 'without a name')
                USING ERRCODE = 'invalid_parameter_value';
        END IF;
        drawn := tunnel_internal.drawn_in(its.id, place, NEW.geom);
        PERFORM tunnel_internal.check_kind(NEW.kind, drawn);
        PERFORM tunnel_internal.check_finding(NEW.kind, NEW.severity, NEW.width_mm, coalesce(NEW.review, 'confirmed'), NEW.remark);
        PERFORM tunnel_internal.lock_findings(its.id);
        NEW.id := tunnel_internal.add_finding(its.id, NEW.kind, drawn, NEW.width_mm, NEW.severity, coalesce(NEW.review, 'confirmed'),
                                         NEW.remark, 'drawn', true, NULL);
    ELSE
        PERFORM tunnel_internal.lock_findings(OLD.survey_id);
        SELECT a.* INTO was FROM tunnel.finding a WHERE a.id = OLD.id FOR UPDATE;
        IF NOT FOUND THEN
            RETURN NULL;  -- deleted meanwhile
        END IF;
        before := tunnel_internal.finding_state(was.id);
        IF was.merged_into IS NOT NULL THEN
            RAISE EXCEPTION 'finding % is merged into %, which stands for it', was.id, was.merged_into
                USING ERRCODE = 'feature_not_supported';
        END IF;
    END IF;
    IF TG_OP = 'DELETE' THEN
        IF NOT was.manual THEN
            RAISE EXCEPTION 'finding % was detected: reject it instead', was.id USING ERRCODE = 'feature_not_supported';
        ELSIF EXISTS (SELECT FROM tunnel.finding x WHERE x.merged_into = was.id) THEN
            RAISE EXCEPTION 'finding % stands for others that are merged into it: reject it instead', was.id
                USING ERRCODE = 'feature_not_supported';
        END IF;
        step := tunnel_internal.note_edit(OLD.survey, 'finding', was.id, before, NULL, kept => tunnel_internal.finding_measured(was.id));
        PERFORM tunnel_internal.note_edit(OLD.survey, 'photo', p.id, to_jsonb(p) - 'id',
                                     NULL, part_of => step)
           FROM tunnel.photo p WHERE p.finding_id = was.id;
        DELETE FROM tunnel.finding a WHERE a.id = was.id;
        PERFORM tunnel_internal.settle_findings(was.survey_id, was.unrolled);
        RETURN OLD;
    END IF;
    IF TG_OP = 'UPDATE' THEN
        old_row := to_jsonb(OLD) - 'geom';
        new_row := to_jsonb(NEW) - 'geom';
        IF old_row - editable IS DISTINCT FROM new_row - editable THEN
            RAISE EXCEPTION 'of a finding only the kind, the severity, the width, the review, the remark and the geometry can be edited'
                USING ERRCODE = 'feature_not_supported';
        END IF;
        was_row := jsonb_build_object('kind', coalesce(was.kind_override, was.kind), 'severity', was.severity, 'width_mm', was.width_mm,
                                      'review', was.review, 'remark', was.remark);
        shape_before := CASE place WHEN 'unrolled' THEN coalesce(was.shape, was.unrolled) WHEN 'map' THEN coalesce(was.shape_map, was.map)
                                   ELSE coalesce(was.shape_surface, was.surface) END;
        redrawn := public.ST_AsEWKB(NEW.geom) IS DISTINCT FROM public.ST_AsEWKB(OLD.geom)
            AND public.ST_AsEWKB(NEW.geom) IS DISTINCT FROM public.ST_AsEWKB(shape_before);
        FOREACH key IN ARRAY editable LOOP
            IF new_row -> key = old_row -> key THEN
                new_row := jsonb_set(new_row, ARRAY[key], was_row -> key);
            ELSIF was_row -> key <> old_row -> key AND was_row -> key <> new_row -> key THEN
                RAISE EXCEPTION 'finding % was changed meanwhile: its % is %', was.id, key, coalesce(was_row ->> key, 'empty')
                    USING ERRCODE = 'serialization_failure', HINT = 'Reload the row, then edit it again.';
            END IF;
        END LOOP;
        IF redrawn AND public.ST_AsEWKB(shape_before) IS DISTINCT FROM public.ST_AsEWKB(OLD.geom) THEN
            RAISE EXCEPTION 'finding % was redrawn meanwhile', was.id
                USING ERRCODE = 'serialization_failure', HINT = 'Reload the row, then edit it again.';
        END IF;
        NEW.kind := new_row ->> 'kind';
        NEW.severity := (new_row ->> 'severity')::smallint;
        NEW.width_mm := (new_row ->> 'width_mm')::float8;
        NEW.review := new_row ->> 'review';
        NEW.remark := new_row ->> 'remark';
        PERFORM tunnel_internal.check_finding(NEW.kind, NEW.severity, NEW.width_mm, NEW.review, NEW.remark);
        IF redrawn THEN
            drawn := tunnel_internal.drawn_in(was.survey_id, place, NEW.geom);
        ELSE
            drawn := coalesce(was.shape, was.unrolled);
        END IF;
        -- a finding of an inactive kind may still be redrawn
        IF new_row -> 'kind' <> was_row -> 'kind'
           OR (redrawn AND EXISTS (SELECT FROM tunnel.finding_kind k WHERE k.code = NEW.kind AND k.active)) THEN
            PERFORM tunnel_internal.check_kind(NEW.kind, CASE WHEN was.manual OR redrawn THEN drawn END);
        END IF;
        IF redrawn OR (was.shape IS NOT NULL AND new_row -> 'width_mm' <> was_row -> 'width_mm') THEN
            kept := tunnel_internal.finding_measured(was.id);
            lapses := redrawn AND new_row -> 'review' = was_row -> 'review' AND tunnel_internal.review_lapses(was.id, NULL, drawn);
            PERFORM tunnel_internal.redraw(was.id, drawn, NEW.width_mm, CASE was.origin WHEN 'detected' THEN 'redrawn' ELSE was.origin END);
        END IF;
        IF lapses THEN
            NEW.review := 'open';
            NEW.reviewed_by := NULL;
            NEW.reviewed_at := NULL;
        ELSIF new_row -> 'review' <> was_row -> 'review' OR new_row -> 'remark' <> was_row -> 'remark'
           OR new_row -> 'kind' <> was_row -> 'kind' THEN
            NEW.reviewed_by := session_user;
            NEW.reviewed_at := clock_timestamp();
        ELSE
            NEW.reviewed_by := was.reviewed_by;
            NEW.reviewed_at := was.reviewed_at;
        END IF;
        UPDATE tunnel.finding a
           SET severity = NEW.severity, width_mm = NEW.width_mm, review = NEW.review, remark = NEW.remark,
               reviewed_by = NEW.reviewed_by, reviewed_at = NEW.reviewed_at,
               kind = CASE WHEN a.manual THEN NEW.kind ELSE a.kind END,
               kind_override = CASE WHEN a.manual THEN NULL WHEN NEW.kind = coalesce(a.kind_override, a.kind) THEN a.kind_override
                             ELSE nullif(NEW.kind, a.kind) END
         WHERE a.id = was.id;
    END IF;
    SELECT a.* INTO is_now FROM tunnel.finding a WHERE a.id = NEW.id;
    PERFORM tunnel_internal.note_edit((SELECT s.name FROM tunnel.survey s WHERE s.id = is_now.survey_id), 'finding', is_now.id,
                                 before, tunnel_internal.finding_state(is_now.id), kept => kept);
    PERFORM tunnel_internal.check_hidden(is_now.id);
    PERFORM tunnel_internal.settle_findings(is_now.survey_id, public.ST_Collect(was.unrolled, is_now.unrolled));
    RETURN NEW;
END
$$;
COMMENT ON FUNCTION tunnel_internal.draw_finding() IS
    'Trigger of the views of findings: insert, redraw, review or delete a finding, compute its values, and write role and time';

DO $$
DECLARE
    place text;
BEGIN
    FOREACH place IN ARRAY ARRAY['unrolled', 'map', '3d'] LOOP
        EXECUTE format('CREATE OR REPLACE TRIGGER edit INSTEAD OF INSERT OR UPDATE OR DELETE ON tunnel_api.%I FOR EACH ROW'
                       ' EXECUTE FUNCTION tunnel_internal.draw_finding(%L)', 'finding_' || place, place);
    END LOOP;
END
$$;
