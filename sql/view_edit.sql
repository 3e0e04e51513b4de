-- What may be written through the views, by INSTEAD OF triggers: the position of axis vertices, review, remark and kind of
-- leaks and other anomalies (view_anomaly.sql), and regions drawn by hand. The functions run with the owner's rights, so that who edits
-- needs no right on schema tunnel, and stamp each row with session_user, which stays the person's own name in them.

-- Moves an axis vertex. Frame and unit: the tunnel's SRID, m.
CREATE OR REPLACE FUNCTION tunnel_api.edit_axis_vertex() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SECURITY DEFINER SET search_path = pg_catalog, public, pg_temp AS $$
BEGIN
    IF (NEW.id, NEW.survey_id, NEW.survey, NEW.n, NEW.km, NEW.chainage, NEW.label, NEW.points, NEW.source,
        NEW.edited_by, NEW.edited_at) IS DISTINCT FROM
       (OLD.id, OLD.survey_id, OLD.survey, OLD.n, OLD.km, OLD.chainage, OLD.label, OLD.points, OLD.source,
        OLD.edited_by, OLD.edited_at) THEN
        RAISE EXCEPTION 'of an axis vertex only the position (geom) can be edited'
            USING ERRCODE = 'feature_not_supported';
    END IF;
    IF NEW.geom IS NULL OR ST_IsEmpty(NEW.geom) THEN
        RAISE EXCEPTION 'axis vertex % at chainage % cannot be without a position', OLD.n, OLD.label
            USING ERRCODE = 'null_value_not_allowed';
    END IF;
    IF ST_SRID(NEW.geom) <> ST_SRID(OLD.geom) THEN
        RAISE EXCEPTION 'axis vertex % is in SRID %, its new position in SRID %',
            OLD.n, ST_SRID(OLD.geom), ST_SRID(NEW.geom)
            USING ERRCODE = 'invalid_parameter_value', HINT = 'Transform the position first (ST_Transform).';
    END IF;
    IF ST_X(NEW.geom) IN ('NaN', 'Infinity', '-Infinity') OR ST_Y(NEW.geom) IN ('NaN', 'Infinity', '-Infinity')
       OR coalesce(ST_Z(NEW.geom), 'NaN') IN ('NaN', 'Infinity', '-Infinity') THEN
        RAISE EXCEPTION 'the new position of axis vertex % needs three finite coordinates, got %',
            OLD.n, ST_AsText(NEW.geom)
            USING ERRCODE = 'invalid_parameter_value';
    END IF;
    IF NEW.geom = OLD.geom THEN
        RETURN NEW;
    END IF;
    NEW.source := 'edited';
    NEW.edited_by := session_user;
    NEW.edited_at := clock_timestamp();
    UPDATE tunnel.axis_vertex
       SET geom = NEW.geom, source = NEW.source, edited_by = NEW.edited_by, edited_at = NEW.edited_at
     WHERE id = OLD.id;
    RETURN NEW;
END
$$;
COMMENT ON FUNCTION tunnel_api.edit_axis_vertex() IS 'Trigger of view axis_vertex: moves a vertex and notes who and when';

CREATE OR REPLACE TRIGGER edit INSTEAD OF UPDATE ON tunnel_api.axis_vertex
    FOR EACH ROW EXECUTE FUNCTION tunnel_api.edit_axis_vertex();

-- Sets the review, the remark and the kind of an anomaly; for the views anomaly, leak and those of one geometry alike.
-- A kind other than the one that was found is noted as judged; the one that was found takes that back.
-- Geometries, whose columns differ between the views, are never written back.
CREATE OR REPLACE FUNCTION tunnel_api.review_anomaly() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SECURITY DEFINER SET search_path = pg_catalog, public, pg_temp AS $$
BEGIN
    IF (NEW.id, NEW.survey_id, NEW.survey, NEW.km, NEW.segment, NEW.chainage_from, NEW.chainage_to, NEW.label,
        NEW.arc_from, NEW.arc_to, NEW.clock, NEW.found, NEW.reasons, NEW.confidence, NEW.contrast, NEW.area, NEW.drop_mean,
        NEW.drop_max, NEW.image_share, NEW.reviewed_by, NEW.reviewed_at, NEW.detected, NEW.created_at, NEW.detected_at)
       IS DISTINCT FROM
       (OLD.id, OLD.survey_id, OLD.survey, OLD.km, OLD.segment, OLD.chainage_from, OLD.chainage_to, OLD.label,
        OLD.arc_from, OLD.arc_to, OLD.clock, OLD.found, OLD.reasons, OLD.confidence, OLD.contrast, OLD.area, OLD.drop_mean,
        OLD.drop_max, OLD.image_share, OLD.reviewed_by, OLD.reviewed_at, OLD.detected, OLD.created_at, OLD.detected_at) THEN
        RAISE EXCEPTION 'of a leak or another anomaly only the review, the remark and the kind can be edited'
            USING ERRCODE = 'feature_not_supported';
    END IF;
    IF NEW.review IS NULL OR NEW.review NOT IN ('open', 'confirmed', 'rejected') THEN
        RAISE EXCEPTION 'the review of % % can be open, confirmed or rejected, not %',
            OLD.kind, OLD.id, coalesce(NEW.review, 'empty')
            USING ERRCODE = 'check_violation';
    END IF;
    IF NEW.kind IS NULL OR NEW.kind NOT IN ('leak', 'joint', 'dark') THEN
        RAISE EXCEPTION 'the kind of % % can be leak, joint or dark, not %', OLD.kind, OLD.id, coalesce(NEW.kind, 'empty')
            USING ERRCODE = 'check_violation';
    END IF;
    IF (NEW.review, NEW.remark, NEW.kind) IS NOT DISTINCT FROM (OLD.review, OLD.remark, OLD.kind) THEN
        RETURN NEW;
    END IF;
    NEW.reviewed_by := session_user;
    NEW.reviewed_at := clock_timestamp();
    UPDATE tunnel.anomaly a
       SET review = NEW.review, remark = NEW.remark, reviewed_by = NEW.reviewed_by, reviewed_at = NEW.reviewed_at,
           judged = CASE WHEN NEW.kind = OLD.kind THEN a.judged ELSE nullif(NEW.kind, a.kind) END
     WHERE a.id = OLD.id;
    RETURN NEW;
END
$$;
COMMENT ON FUNCTION tunnel_api.review_anomaly() IS
    'Trigger of the views of anomalies and leaks: sets review, remark and kind and notes who and when';

DO $$
DECLARE
    name text;
BEGIN
    FOREACH name IN ARRAY ARRAY['anomaly', 'anomaly_unrolled', 'anomaly_map', 'anomaly_3d',
                                'leak', 'leak_unrolled', 'leak_map', 'leak_3d'] LOOP
        EXECUTE format('CREATE OR REPLACE TRIGGER edit INSTEAD OF UPDATE ON tunnel_api.%I
                            FOR EACH ROW EXECUTE FUNCTION tunnel_api.review_anomaly()', name);
    END LOOP;
END
$$;

-- Adds, changes or deletes a region drawn by hand in the unrolled plane (m). A new one names its survey by survey_id or,
-- without that, by name.
CREATE OR REPLACE FUNCTION tunnel_api.edit_region() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SECURITY DEFINER SET search_path = pg_catalog, public, pg_temp AS $$
BEGIN
    IF TG_OP = 'DELETE' THEN
        DELETE FROM tunnel.region WHERE id = OLD.id;
        RETURN OLD;
    END IF;
    IF NOT coalesce(ST_IsValid(NEW.geom), false) THEN
        RAISE EXCEPTION 'a region must be a valid polygon: %', coalesce(ST_IsValidReason(NEW.geom), 'it is empty')
            USING ERRCODE = 'invalid_parameter_value';
    END IF;
    IF TG_OP = 'INSERT' AND NEW.survey_id IS NULL THEN
        SELECT s.id INTO NEW.survey_id FROM tunnel.survey s WHERE s.name = NEW.survey;
        IF NOT FOUND THEN
            RAISE EXCEPTION 'a region needs the survey it belongs to; there is none named %', coalesce(NEW.survey, '(empty)')
                USING ERRCODE = 'invalid_parameter_value';
        END IF;
    END IF;
    NEW.drawn_by := session_user;
    NEW.drawn_at := clock_timestamp();
    IF TG_OP = 'INSERT' THEN
        INSERT INTO tunnel.region (survey_id, kind, geom, drawn_by, drawn_at)
        VALUES (NEW.survey_id, NEW.kind, NEW.geom, NEW.drawn_by, NEW.drawn_at)
        RETURNING id INTO NEW.id;
    ELSE
        UPDATE tunnel.region
           SET kind = NEW.kind, geom = NEW.geom, drawn_by = NEW.drawn_by, drawn_at = NEW.drawn_at
         WHERE id = OLD.id;
    END IF;
    RETURN NEW;
END
$$;
COMMENT ON FUNCTION tunnel_api.edit_region() IS 'Trigger of view region: writes a region and notes who and when';

CREATE OR REPLACE TRIGGER edit INSTEAD OF INSERT OR UPDATE OR DELETE ON tunnel_api.region
    FOR EACH ROW EXECUTE FUNCTION tunnel_api.edit_region();
