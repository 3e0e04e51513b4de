-- Drawing, redrawing, splitting, merging and deleting findings, through the views of views/finding.sql, with the rights and the
-- care of views/edit.sql: rows are locked, what somebody else did meanwhile stays or refuses the later one, and the audit has it.

-- What the audit has of a finding.
CREATE OR REPLACE FUNCTION tunnel_internal.finding_state(id bigint) RETURNS jsonb
LANGUAGE sql STABLE PARALLEL SAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT jsonb_strip_nulls(jsonb_build_object(
        'kind', coalesce(a.kind_override, a.kind), 'severity', a.severity, 'width', a.width, 'review', a.review, 'remark', a.remark,
        'origin', a.origin, 'parent_id', a.parent_id, 'merged_into', a.merged_into,
        'geom', public.ST_AsEWKT(coalesce(a.shape, a.unrolled))))
      FROM tunnel.finding a WHERE a.id = $1
$$;
COMMENT ON FUNCTION tunnel_internal.finding_state(bigint) IS
    'Editable columns of a finding for the audit, geometry in the unrolled plane as EWKT';

-- What was measured of a finding, which goes with its outline.
CREATE OR REPLACE FUNCTION tunnel_internal.finding_measured(id bigint) RETURNS jsonb
LANGUAGE sql STABLE PARALLEL SAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT jsonb_build_object(
        'darkening_mean', a.darkening_mean, 'darkening_max', a.darkening_max, 'image_share', a.image_share, 'contrast', a.contrast,
        'confidence', a.confidence, 'reasons', a.reasons, 'evidence', a.evidence, 'features', a.features,
        'feature_list_id', a.feature_list_id, 'model', a.model, 'detected', a.detected, 'area', a.area, 'clock', a.clock)
      FROM tunnel.finding a WHERE a.id = $1 AND a.image_share IS NOT NULL
$$;
COMMENT ON FUNCTION tunnel_internal.finding_measured(bigint) IS
    'Measured values of a finding for the audit, before its outline changes; NULL if it was not measured';

-- Which wet findings are the same, about a place of the unrolled plane. One that was detected is the same as what a person drew,
-- redrew, split or merged when these together cover half of it: the person's outline counts, also where he rejects it. One that a
-- person drew is the same as a detected one that covers half of it and much more: that one counts, unless it is rejected. Lines
-- and points are none, for they have no area of their own.
CREATE OR REPLACE FUNCTION tunnel_internal.link_findings(survey_id int, place geometry) RETURNS void
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT SET search_path = pg_catalog, pg_temp AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := survey_id;
    about constant public.geometry := public.ST_Expand(place, 0.01);
    changed record;
BEGIN
    FOR changed IN
    WITH near AS MATERIALIZED (
        SELECT a.id, a.origin <> 'detected' AS by_person, a.review, a.same_as, a.unrolled, a.wet AND a.detected
               AND a.merged_into IS NULL AND a.shape IS NULL AS apt
          FROM tunnel.finding a
         WHERE a.survey_id = survey_key AND a.unrolled OPERATOR(public.&&) about
    ), pair AS MATERIALIZED (
        SELECT d.id AS found, h.id AS drawn, d.review, public.ST_Area(public.ST_Intersection(d.unrolled, h.unrolled)) AS shared,
               public.ST_Area(d.unrolled) AS found_area, public.ST_Area(h.unrolled) AS drawn_area
          FROM near d
          JOIN tunnel.finding h ON h.survey_id = survey_key AND h.unrolled OPERATOR(public.&&) d.unrolled
           AND h.origin <> 'detected' AND h.wet
               AND h.merged_into IS NULL AND h.shape IS NULL
         WHERE d.apt AND NOT d.by_person
         UNION
        SELECT d.id, h.id, d.review, public.ST_Area(public.ST_Intersection(d.unrolled, h.unrolled)),
               public.ST_Area(d.unrolled), public.ST_Area(h.unrolled)
          FROM near h
          JOIN tunnel.finding d ON d.survey_id = survey_key AND d.unrolled OPERATOR(public.&&) h.unrolled
           AND d.origin = 'detected' AND d.wet AND d.detected
               AND d.merged_into IS NULL AND d.shape IS NULL
         WHERE h.apt AND h.by_person
    ), covered AS (
        SELECT DISTINCT ON (p.found) p.found, p.drawn, sum(p.shared) OVER (PARTITION BY p.found) / p.found_area AS share
          FROM pair p WHERE p.shared > 0 ORDER BY p.found, p.shared DESC, p.drawn
    ), link AS (
        SELECT c.found AS id, c.drawn AS other FROM covered c WHERE c.share >= 0.5
         UNION ALL
        (SELECT DISTINCT ON (p.drawn) p.drawn, p.found
           FROM pair p JOIN covered c ON c.found = p.found
          WHERE c.share < 0.5 AND p.shared >= 0.5 * p.drawn_area AND p.review <> 'rejected'
          ORDER BY p.drawn, p.shared DESC, p.found)
    ), concerned AS (
        SELECT n.id, n.same_as FROM near n
         UNION
        SELECT a.id, a.same_as FROM link l JOIN tunnel.finding a ON a.id = l.id
    )
    SELECT c.id, l.other FROM concerned c LEFT JOIN link l ON l.id = c.id
     WHERE c.same_as IS DISTINCT FROM l.other ORDER BY c.id
    LOOP
        UPDATE tunnel.finding a SET same_as = changed.other WHERE a.id = changed.id;
    END LOOP;
END
$$;
COMMENT ON FUNCTION tunnel_internal.link_findings(int, geometry) IS
'Mark wet findings of a survey near a place (unrolled plane) with the same area, so that each area counts once: see settle_findings';

-- Leaks that detection found lie in a dry region when half of them does, redrawn, split and merged ones too. One that waits for
-- an operator has none. What is no longer a leak lies in none.
CREATE OR REPLACE FUNCTION tunnel_internal.mark_dry(survey_id int, place geometry) RETURNS void
LANGUAGE sql VOLATILE PARALLEL UNSAFE STRICT SET search_path = pg_catalog, pg_temp AS $$
    UPDATE tunnel.finding a SET dry_region_id = w.region
      FROM (SELECT x.id, (SELECT r.id FROM tunnel.region r
                           WHERE x.wet AND r.survey_id = x.survey_id AND r.kind = 'dry' AND NOT r.pending_approval
                             AND r.geom OPERATOR(public.&&) x.unrolled
                             AND public.ST_Area(public.ST_Intersection(r.geom, x.unrolled)) >= 0.5 * public.ST_Area(x.unrolled)
                           ORDER BY r.id LIMIT 1) AS region
              FROM tunnel.finding x
             WHERE x.survey_id = $1 AND x.unrolled OPERATOR(public.&&) $2 AND NOT x.manual) w
     WHERE a.id = w.id AND a.dry_region_id IS DISTINCT FROM w.region
$$;
COMMENT ON FUNCTION tunnel_internal.mark_dry(int, geometry) IS
'Mark the detected leaks of a survey near a place (unrolled plane) that lie in a dry region with at least half of their area, and unmark the others. Called after each change of a region, and by settle_findings';

-- What follows for other findings from a change of some.
CREATE OR REPLACE FUNCTION tunnel_internal.settle_findings(survey_id int, place geometry) RETURNS void
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT SET search_path = pg_catalog, pg_temp AS $$
BEGIN
    PERFORM tunnel_internal.link_findings(survey_id, place);
    PERFORM tunnel_internal.mark_dry(survey_id, place);
END
$$;
COMMENT ON FUNCTION tunnel_internal.settle_findings(int, geometry) IS
'Update the relations between findings of a survey near a place (unrolled plane): link_findings and mark_dry. Called after each change of an outline, a kind or a review, and by detection';

-- Each change of findings adds rows to their sums; there need be no more of them than sums. Who does the same meanwhile has the
-- rows that he has.
CREATE OR REPLACE FUNCTION tunnel_internal.pack_sums(survey_id int) RETURNS void
LANGUAGE sql VOLATILE PARALLEL UNSAFE STRICT SET search_path = pg_catalog, pg_temp AS $$
    WITH apart AS (
        DELETE FROM tunnel.finding_sum f
         WHERE f.id IN (SELECT o.id FROM tunnel.finding_sum o WHERE o.survey_id = $1 FOR UPDATE SKIP LOCKED)
        RETURNING f.*
    )
    INSERT INTO tunnel.finding_sum (survey_id, kind, wet, origin, severity, state, measured, findings, area, length, extent)
    SELECT a.survey_id, a.kind, a.wet, a.origin, a.severity, a.state, a.measured, sum(a.findings), sum(a.area), sum(a.length), sum(a.extent)
      FROM apart a
     GROUP BY 1, 2, 3, 4, 5, 6, 7
    HAVING sum(a.findings) <> 0 OR abs(sum(a.area)) + abs(sum(a.length)) + abs(sum(a.extent)) > 1e-9
$$;
COMMENT ON FUNCTION tunnel_internal.pack_sums(int) IS
    'Combine the rows that changes of findings added to tunnel.finding_sum; called by detection and imports';

-- Refuses a kind that there is not, is not offered any more, or is not drawn so.
CREATE OR REPLACE FUNCTION tunnel_internal.check_kind(kind text, drawn geometry) RETURNS void
LANGUAGE plpgsql STABLE PARALLEL SAFE CALLED ON NULL INPUT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
#variable_conflict use_variable
DECLARE
    way constant text := CASE public.ST_Dimension(drawn) WHEN 0 THEN 'point' WHEN 1 THEN 'line' WHEN 2 THEN 'polygon' END;
    its tunnel.finding_kind;
BEGIN
    SELECT k.* INTO its FROM tunnel.finding_kind k WHERE k.code = kind AND k.active;
    IF NOT FOUND THEN
        RAISE EXCEPTION 'the kind of a finding can be %, not %',
            (SELECT string_agg(k.code, ', ' ORDER BY k.position, k.code) FROM tunnel.finding_kind k WHERE k.active),
            coalesce(kind, 'empty') USING ERRCODE = 'check_violation';
    ELSIF way <> ALL (its.geometries) THEN
        RAISE EXCEPTION '% is drawn as %, not as %', kind, array_to_string(its.geometries, ' or '), way
            USING ERRCODE = 'check_violation';
    END IF;
END
$$;
COMMENT ON FUNCTION tunnel_internal.check_kind(text, geometry) IS
    'Raise an error unless a kind of findings with this code can be drawn with this geometry, or with any if none is given';

-- What was drawn in a view, in the unrolled plane: of view finding_unrolled it lies there, of finding_map on the strip beside the
-- axis, of finding_3d in space.
CREATE OR REPLACE FUNCTION tunnel_internal.drawn_in(survey_id int, place text, geom geometry) RETURNS geometry
LANGUAGE plpgsql STABLE PARALLEL SAFE CALLED ON NULL INPUT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
#variable_conflict use_variable
DECLARE
    given constant public.geometry := CASE WHEN public.ST_NumGeometries(geom) = 1 THEN public.ST_GeometryN(geom, 1) ELSE geom END;
    srid constant int := CASE place WHEN 'unrolled' THEN 0
        ELSE (SELECT t.srid FROM tunnel.survey s JOIN tunnel.tunnel t ON t.id = s.tunnel_id WHERE s.id = survey_id) END;
    unrolled public.geometry;
BEGIN
    IF given IS NULL OR public.ST_IsEmpty(given) OR public.ST_NumGeometries(given) > 1 THEN
        RETURN given;  -- drawn_figures says so
    ELSIF public.ST_SRID(given) NOT IN (srid, 0) THEN
        RAISE EXCEPTION 'the drawing is in SRID %, the view in SRID %', public.ST_SRID(given), srid
            USING ERRCODE = 'invalid_parameter_value', HINT = 'Transform it first (ST_Transform).';
    ELSIF place = '3d' AND public.ST_NDims(given) < 3 THEN
        RAISE EXCEPTION 'a drawing in space needs heights' USING ERRCODE = 'invalid_parameter_value';
    END IF;
    unrolled := CASE place WHEN 'unrolled' THEN given
                           WHEN 'map' THEN tunnel_internal.unmap_strip(survey_id, public.ST_SetSRID(given, srid))
                           ELSE tunnel_api.unroll_shape(survey_id, public.ST_SetSRID(given, srid)) END;
    IF unrolled IS NULL THEN
        RAISE EXCEPTION 'the drawing reaches beyond the lining: it lies between % and %',
            public.ST_AsText(public.ST_MakePoint(public.ST_XMin(given), public.ST_YMin(given)), 1),
            public.ST_AsText(public.ST_MakePoint(public.ST_XMax(given), public.ST_YMax(given)), 1)
            USING ERRCODE = 'invalid_parameter_value';
    END IF;
    RETURN unrolled;
END
$$;
COMMENT ON FUNCTION tunnel_internal.drawn_in(int, text, geometry) IS
    'Unrolled geometry of a shape drawn in a view (unrolled, map or 3d). Raises an error if it does not lie on the tunnel';

-- Gives a finding an outline of a person's: all that follows is worked out, what was measured of the old one goes until the next
-- detection measures the new one.
CREATE OR REPLACE FUNCTION tunnel_internal.redraw(id bigint, drawn geometry, width float8, origin text) RETURNS void
LANGUAGE sql VOLATILE PARALLEL UNSAFE CALLED ON NULL INPUT SET search_path = pg_catalog, pg_temp AS $$
    UPDATE tunnel.finding a
       SET km = f.km, chainage_from = f.chainage_from, chainage_to = f.chainage_to, arc_from = f.arc_from, arc_to = f.arc_to,
           clock = f.clock, area = f.area, length = f.length, width = $3, unrolled = f.unrolled, map = f.map, surface = f.surface,
           shape = f.shape, shape_map = f.shape_map, shape_surface = f.shape_surface, origin = $4, drawn_by = session_user,
           drawn_at = clock_timestamp(), detected = true, darkening_mean = NULL, darkening_max = NULL, image_share = NULL, contrast = NULL,
           confidence = NULL, reasons = '{}', evidence = NULL, features = NULL, feature_list_id = NULL, model = NULL,
           same_as = NULL, dry_region_id = NULL
      FROM tunnel.finding w
     CROSS JOIN LATERAL tunnel_internal.drawn_figures(w.survey_id, $2, $3) f
     WHERE w.id = $1 AND a.id = w.id
$$;
COMMENT ON FUNCTION tunnel_internal.redraw(bigint, geometry, float8, text) IS
    'Change the outline (unrolled plane) and origin of a finding, compute its values, and clear the measured ones. Only draw_finding, finding_split and finding_merge call it';

-- A new finding of a person's, like another or on its own; its id, which is given for one that comes back.
CREATE OR REPLACE FUNCTION tunnel_internal.add_finding(
    survey_id int, kind text, drawn geometry, width float8, severity int, review text, remark text, origin text, manual boolean,
    parent_id bigint, id bigint DEFAULT NULL) RETURNS bigint
LANGUAGE sql VOLATILE PARALLEL UNSAFE CALLED ON NULL INPUT SET search_path = pg_catalog, pg_temp AS $$
    INSERT INTO tunnel.finding (id, survey_id, kind, width, severity, review, reviewed_by, reviewed_at, remark, origin, manual,
        parent_id, drawn_by, drawn_at, km, chainage_from, chainage_to, arc_from, arc_to, clock, area, length, unrolled, map,
        surface, shape, shape_map, shape_surface, created_at) OVERRIDING SYSTEM VALUE
    SELECT coalesce($11, nextval('tunnel.finding_id_seq')), $1, $2, $4, $5, $6, CASE WHEN $6 <> 'open' THEN session_user END,
           CASE WHEN $6 <> 'open' THEN clock_timestamp() END, $7, $8, $9, $10, session_user, clock_timestamp(), f.km,
           f.chainage_from, f.chainage_to, f.arc_from, f.arc_to, f.clock, f.area, f.length, f.unrolled, f.map, f.surface, f.shape,
           f.shape_map, f.shape_surface, clock_timestamp()
      FROM tunnel_internal.drawn_figures($1, $3, $4) f
    RETURNING id
$$;
COMMENT ON FUNCTION tunnel_internal.add_finding(int, text, geometry, float8, int, text, text, text, boolean, bigint, bigint) IS
    'Insert a finding (unrolled plane) with all values computed from its outline, and return its id. Only draw_finding, finding_split and finding_undo call it';

-- After the surface has changed: outlines in the unrolled plane stay. One that now reaches beyond the lining stays as it was.
CREATE OR REPLACE FUNCTION tunnel_internal.renew_findings(survey_id int, km int) RETURNS void
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT SET search_path = pg_catalog, pg_temp AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := survey_id;
    kilometre constant int := km;
    was tunnel.finding;
BEGIN
    FOR was IN SELECT a.* FROM tunnel.finding a
                WHERE a.survey_id = survey_key AND a.km = kilometre AND a.origin <> 'detected' ORDER BY a.id FOR UPDATE LOOP
        BEGIN
            UPDATE tunnel.finding a
               SET clock = f.clock, area = f.area, length = f.length, map = f.map, surface = f.surface, shape_map = f.shape_map,
                   shape_surface = f.shape_surface
              FROM tunnel_internal.drawn_figures(survey_key, coalesce(was.shape, was.unrolled), was.width) f
             WHERE a.id = was.id AND NOT (f.surface OPERATOR(public.=) was.surface AND f.map OPERATOR(public.=) was.map);
        EXCEPTION WHEN invalid_parameter_value THEN
            NULL;
        END;
    END LOOP;
END
$$;
COMMENT ON FUNCTION tunnel_internal.renew_findings(int, int) IS
'Compute the map and space geometries of drawn findings of a kilometre again after the axis or the sections changed; called by detection. Outlines in the unrolled plane stay';

-- Detection writes its findings of a survey under this lock, and so sees all that was drawn before, and none is drawn meanwhile;
-- who draws does not wait for who draws.
CREATE OR REPLACE FUNCTION tunnel_internal.lock_findings(survey_id int) RETURNS void
LANGUAGE sql VOLATILE PARALLEL UNSAFE STRICT SET search_path = pg_catalog, pg_temp AS $$
    SELECT pg_advisory_xact_lock_shared(-3, $1)
$$;
COMMENT ON FUNCTION tunnel_internal.lock_findings(int) IS
    'Block detection from writing the findings of a survey, or wait for it, until the transaction ends';

CREATE OR REPLACE FUNCTION tunnel_internal.draw_finding() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    place CONSTANT text := TG_ARGV[0];
    editable CONSTANT text[] := ARRAY['kind', 'severity', 'width', 'review', 'remark'];
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
    kept jsonb;
    step bigint;
BEGIN
    IF TG_OP = 'INSERT' THEN
        SELECT s.* INTO its FROM tunnel.survey s
         WHERE CASE WHEN NEW.survey_id IS NULL THEN s.name = NEW.survey ELSE s.id = NEW.survey_id END;
        IF NOT FOUND THEN
            RAISE EXCEPTION 'a finding needs the survey it belongs to; there is none %',
                coalesce('with id ' || NEW.survey_id, 'named ' || NEW.survey, 'without a name')
                USING ERRCODE = 'invalid_parameter_value';
        END IF;
        drawn := tunnel_internal.drawn_in(its.id, place, NEW.geom);
        PERFORM tunnel_internal.check_kind(NEW.kind, drawn);
        PERFORM tunnel_internal.check_finding(NEW.severity, NEW.width, coalesce(NEW.review, 'confirmed'));
        PERFORM tunnel_internal.lock_findings(its.id);
        NEW.id := tunnel_internal.add_finding(its.id, NEW.kind, drawn, NEW.width, NEW.severity, coalesce(NEW.review, 'confirmed'),
                                         NEW.remark, 'drawn', true, NULL);
    ELSE
        PERFORM tunnel_internal.lock_findings(OLD.survey_id);
        SELECT a.* INTO was FROM tunnel.finding a WHERE a.id = OLD.id FOR UPDATE;
        IF NOT FOUND THEN
            RETURN NULL;  -- gone meanwhile
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
        was_row := jsonb_build_object('kind', coalesce(was.kind_override, was.kind), 'severity', was.severity, 'width', was.width,
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
                    USING ERRCODE = 'serialization_failure', HINT = 'Look at it again.';
            END IF;
        END LOOP;
        IF redrawn AND public.ST_AsEWKB(shape_before) IS DISTINCT FROM public.ST_AsEWKB(OLD.geom) THEN
            RAISE EXCEPTION 'finding % was redrawn meanwhile', was.id
                USING ERRCODE = 'serialization_failure', HINT = 'Look at it again.';
        END IF;
        NEW.kind := new_row ->> 'kind';
        NEW.severity := (new_row ->> 'severity')::smallint;
        NEW.width := (new_row ->> 'width')::float8;
        NEW.review := new_row ->> 'review';
        NEW.remark := new_row ->> 'remark';
        PERFORM tunnel_internal.check_finding(NEW.severity, NEW.width, NEW.review);
        IF redrawn THEN
            drawn := tunnel_internal.drawn_in(was.survey_id, place, NEW.geom);
        ELSE
            drawn := coalesce(was.shape, was.unrolled);
        END IF;
        -- one of a kind that is offered no more may still be redrawn
        IF new_row -> 'kind' <> was_row -> 'kind'
           OR (redrawn AND EXISTS (SELECT FROM tunnel.finding_kind k WHERE k.code = NEW.kind AND k.active)) THEN
            PERFORM tunnel_internal.check_kind(NEW.kind, CASE WHEN was.manual OR redrawn THEN drawn END);
        END IF;
        IF redrawn OR (was.shape IS NOT NULL AND new_row -> 'width' <> was_row -> 'width') THEN
            kept := tunnel_internal.finding_measured(was.id);
            PERFORM tunnel_internal.redraw(was.id, drawn, NEW.width, CASE was.origin WHEN 'detected' THEN 'redrawn' ELSE was.origin END);
        END IF;
        IF new_row -> 'review' <> was_row -> 'review' OR new_row -> 'remark' <> was_row -> 'remark'
           OR new_row -> 'kind' <> was_row -> 'kind' THEN
            NEW.reviewed_by := session_user;
            NEW.reviewed_at := clock_timestamp();
        ELSE
            NEW.reviewed_by := was.reviewed_by;
            NEW.reviewed_at := was.reviewed_at;
        END IF;
        UPDATE tunnel.finding a
           SET severity = NEW.severity, width = NEW.width, review = NEW.review, remark = NEW.remark,
               reviewed_by = NEW.reviewed_by, reviewed_at = NEW.reviewed_at,
               kind = CASE WHEN a.manual THEN NEW.kind ELSE a.kind END,
               kind_override = CASE WHEN a.manual THEN NULL WHEN NEW.kind = coalesce(a.kind_override, a.kind) THEN a.kind_override
                             ELSE nullif(NEW.kind, a.kind) END
         WHERE a.id = was.id;
    END IF;
    SELECT a.* INTO is_now FROM tunnel.finding a WHERE a.id = NEW.id;
    PERFORM tunnel_internal.note_edit((SELECT s.name FROM tunnel.survey s WHERE s.id = is_now.survey_id), 'finding', is_now.id,
                                 before, tunnel_internal.finding_state(is_now.id), kept => kept);
    PERFORM tunnel_internal.settle_findings(is_now.survey_id, public.ST_Collect(was.unrolled, is_now.unrolled));
    RETURN NEW;
END
$$;
COMMENT ON FUNCTION tunnel_internal.draw_finding() IS
    'Trigger of the views of findings: insert, redraw, review or delete a finding, compute its values, and write role and time';

CREATE OR REPLACE FUNCTION tunnel_internal.check_finding(severity int, width float8, review text) RETURNS void
LANGUAGE plpgsql IMMUTABLE PARALLEL SAFE CALLED ON NULL INPUT SET search_path = pg_catalog, pg_temp AS $$
BEGIN
    IF severity NOT BETWEEN 1 AND 4 THEN
        RAISE EXCEPTION 'the severity of a finding is 1 to 4, not %', severity USING ERRCODE = 'check_violation';
    ELSIF NOT (width > 0 AND width <= 10) THEN
        RAISE EXCEPTION 'the width of a line is above 0 and at most 10 m, not %', width USING ERRCODE = 'check_violation';
    ELSIF review IS NULL OR review NOT IN ('open', 'confirmed', 'rejected') THEN
        RAISE EXCEPTION 'the review of a finding can be open, confirmed or rejected, not %', coalesce(review, 'empty')
            USING ERRCODE = 'check_violation';
    END IF;
END
$$;
COMMENT ON FUNCTION tunnel_internal.check_finding(int, float8, text) IS
    'Raise an error unless severity, width (m) and review are valid';

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

-- Splits a polygon or a line along a line of the unrolled plane or, in the tunnel's SRID, of the map strip.
CREATE OR REPLACE FUNCTION tunnel_api.finding_split(id bigint, line geometry) RETURNS bigint[]
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
#variable_conflict use_column
DECLARE
    finding constant bigint := id;
    was tunnel.finding;
    made bigint;
    before jsonb;
    name text;
    survey_key int;
    blade public.geometry;
    parts public.geometry[];
    part public.geometry;
    ids bigint[];
    kept jsonb;
    step bigint;
BEGIN
    SELECT a.survey_id, s.name INTO survey_key, name
      FROM tunnel.finding a JOIN tunnel.survey s ON s.id = a.survey_id WHERE a.id = finding;
    IF survey_key IS NULL THEN
        RAISE EXCEPTION 'there is no finding %', finding USING ERRCODE = 'invalid_parameter_value';
    END IF;
    PERFORM tunnel_internal.lock_findings(survey_key);
    SELECT a.* INTO was FROM tunnel.finding a WHERE a.id = finding FOR UPDATE;
    IF was.id IS NULL OR was.merged_into IS NOT NULL THEN
        RAISE EXCEPTION 'finding % is %', finding, coalesce('merged into ' || was.merged_into || ', which stands for it', 'gone')
            USING ERRCODE = 'feature_not_supported';
    ELSIF public.GeometryType(line) <> 'LINESTRING' OR public.GeometryType(was.shape) = 'POINT' THEN
        RAISE EXCEPTION 'a polygon or a line is split, by one line' USING ERRCODE = 'invalid_parameter_value';
    END IF;
    blade := public.ST_Force2D(tunnel_internal.drawn_in(survey_key, CASE public.ST_SRID(line) WHEN 0 THEN 'unrolled' ELSE 'map' END, line));
    SELECT array_agg(d.geom ORDER BY public.ST_Area(d.geom) DESC, public.ST_Length(d.geom) DESC, d.path) INTO parts
      FROM public.ST_Dump(public.ST_Split(coalesce(was.shape, was.unrolled), blade)) d;
    IF coalesce(cardinality(parts), 0) < 2 THEN
        RAISE EXCEPTION 'the line does not split finding %: it must cross it from side to side', finding
            USING ERRCODE = 'invalid_parameter_value';
    END IF;
    before := tunnel_internal.finding_state(finding);
    kept := tunnel_internal.finding_measured(finding);
    PERFORM tunnel_internal.redraw(finding, parts[1], was.width, 'split');
    ids := ARRAY[finding];
    FOREACH part IN ARRAY parts[2:] LOOP
        ids := ids || tunnel_internal.add_finding(survey_key, coalesce(was.kind_override, was.kind), part, was.width, was.severity, was.review,
                                             was.remark, 'split', was.manual, finding);
    END LOOP;
    step := tunnel_internal.note_edit(name, 'finding', finding, before, tunnel_internal.finding_state(finding), kept => kept);
    FOREACH made IN ARRAY ids[2:] LOOP
        PERFORM tunnel_internal.note_edit(name, 'finding', made, NULL, tunnel_internal.finding_state(made), part_of => step);
    END LOOP;
    PERFORM tunnel_internal.settle_findings(survey_key, was.unrolled);
    RETURN ids;
END
$$;
COMMENT ON FUNCTION tunnel_api.finding_split(bigint, geometry) IS
'Split a finding (a polygon or a line) along a line of the unrolled plane (SRID 0) or of the map strip (tunnel''s SRID). The larger part keeps the id and the review; the other parts are new findings with the same columns. Returns the ids, that of the larger part first';

-- What lies apart by less than a metre is joined by a strip of a centimetre.
CREATE OR REPLACE FUNCTION tunnel_api.finding_merge(ids bigint[]) RETURNS bigint
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
#variable_conflict use_column
DECLARE
    wanted constant bigint[] := ARRAY(SELECT DISTINCT i FROM unnest(ids) i ORDER BY i);
    gap constant float8 := 1.0;
    surveys int[];
    name text;
    oldest tunnel.finding;
    was tunnel.finding;
    before jsonb;
    whole public.geometry;
    a_part public.geometry;
    rest public.geometry;
    place public.geometry;
    kept jsonb;
    step bigint;
BEGIN
    IF cardinality(wanted) < 2 THEN
        RAISE EXCEPTION 'at least two findings are merged' USING ERRCODE = 'invalid_parameter_value';
    END IF;
    surveys := ARRAY(SELECT DISTINCT a.survey_id FROM tunnel.finding a WHERE a.id = ANY (wanted));
    IF cardinality(surveys) <> 1 OR (SELECT count(*) FROM tunnel.finding a WHERE a.id = ANY (wanted)) <> cardinality(wanted) THEN
        RAISE EXCEPTION 'findings % are not all there, or of several surveys', array_to_string(wanted, ', ')
            USING ERRCODE = 'invalid_parameter_value';
    END IF;
    PERFORM tunnel_internal.lock_findings(surveys[1]);
    PERFORM FROM tunnel.finding a WHERE a.id = ANY (wanted) ORDER BY a.id FOR UPDATE;
    name := (SELECT s.name FROM tunnel.survey s WHERE s.id = surveys[1]);
    SELECT a.* INTO oldest FROM tunnel.finding a WHERE a.id = ANY (wanted) ORDER BY a.created_at, a.id LIMIT 1;
    SELECT a.* INTO was FROM tunnel.finding a
     WHERE a.id = ANY (wanted) AND (a.merged_into IS NOT NULL OR a.review = 'rejected'
           OR coalesce(a.kind_override, a.kind) <> coalesce(oldest.kind_override, oldest.kind)
           OR public.ST_Dimension(coalesce(a.shape, a.unrolled)) <> public.ST_Dimension(coalesce(oldest.shape, oldest.unrolled))
           OR public.GeometryType(a.shape) = 'POINT')
     ORDER BY a.id LIMIT 1;
    IF FOUND THEN
        RAISE EXCEPTION 'finding % cannot be merged: %', was.id,
            CASE WHEN was.merged_into IS NOT NULL THEN 'it is merged into ' || was.merged_into
                 WHEN was.review = 'rejected' THEN 'it is rejected'
                 WHEN coalesce(was.kind_override, was.kind) <> coalesce(oldest.kind_override, oldest.kind)
                     THEN format('it is %s, finding %s %s', coalesce(was.kind_override, was.kind), oldest.id, coalesce(oldest.kind_override, oldest.kind))
                 ELSE 'polygons are merged with polygons, lines with lines, and points not' END
            USING ERRCODE = 'feature_not_supported';
    END IF;
    SELECT public.ST_Union(coalesce(a.shape, a.unrolled)), public.ST_Collect(a.unrolled) INTO whole, place
      FROM tunnel.finding a WHERE a.id = ANY (wanted);
    WHILE public.ST_NumGeometries(whole) > 1 LOOP
        IF public.ST_Dimension(whole) = 1 THEN
            whole := public.ST_LineMerge(whole);
            EXIT WHEN public.ST_NumGeometries(whole) = 1;
        END IF;
        a_part := public.ST_GeometryN(whole, 1);
        rest := (SELECT public.ST_Collect(d.geom) FROM public.ST_Dump(whole) d WHERE d.path[1] > 1);
        IF public.ST_Distance(a_part, rest) > gap OR (public.ST_Dimension(whole) = 1 AND public.ST_Distance(a_part, rest) = 0) THEN
            RAISE EXCEPTION 'findings % do not make one: %', array_to_string(wanted, ', '),
                CASE WHEN public.ST_Distance(a_part, rest) = 0 THEN 'the lines cross or branch'
                     ELSE format('they lie %s m apart, more than %s m', round(public.ST_Distance(a_part, rest)::numeric, 2), gap) END
                USING ERRCODE = 'invalid_parameter_value';
        END IF;
        whole := public.ST_Union(whole, CASE public.ST_Dimension(whole) WHEN 1 THEN public.ST_ShortestLine(a_part, rest)
                                      ELSE public.ST_Buffer(public.ST_ShortestLine(a_part, rest), 0.005) END);
    END LOOP;
    before := tunnel_internal.finding_state(oldest.id);
    kept := tunnel_internal.finding_measured(oldest.id);
    PERFORM tunnel_internal.redraw(oldest.id, whole, oldest.width, 'merged');
    UPDATE tunnel.finding a SET severity = m.severity, remark = m.remark
      FROM (SELECT max(x.severity) AS severity, string_agg(DISTINCT x.remark, '; ') AS remark
              FROM tunnel.finding x WHERE x.id = ANY (wanted)) m
     WHERE a.id = oldest.id;
    -- named also where the outline of the oldest is that of all
    step := tunnel_internal.note_edit(name, 'finding', oldest.id, before,
        tunnel_internal.finding_state(oldest.id) || jsonb_build_object('merged', array_remove(wanted, oldest.id)), kept => kept);
    FOR was IN SELECT a.* FROM tunnel.finding a
                WHERE (a.id = ANY (wanted) OR a.merged_into = ANY (wanted)) AND a.id <> oldest.id
                  AND a.merged_into IS DISTINCT FROM oldest.id ORDER BY a.id FOR UPDATE LOOP
        before := tunnel_internal.finding_state(was.id);
        UPDATE tunnel.finding a SET merged_into = oldest.id, same_as = NULL WHERE a.id = was.id;
        PERFORM tunnel_internal.note_edit(name, 'finding', was.id, before, tunnel_internal.finding_state(was.id), part_of => step);
    END LOOP;
    PERFORM tunnel_internal.settle_findings(surveys[1], place);
    RETURN oldest.id;
END
$$;
COMMENT ON FUNCTION tunnel_api.finding_merge(bigint[]) IS
'Merge findings of one kind (polygons, or lines end to end) that touch or lie within 1 m. The oldest keeps its id and review, and gets the outline of all, the highest severity and all remarks. The others get the state merged and are not counted. Returns the id of the oldest';

-- Adds, changes or deletes a photo of a finding: a path or URL, and what it shows.
CREATE OR REPLACE FUNCTION tunnel_internal.edit_photo() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    name text;
BEGIN
    IF TG_OP = 'DELETE' THEN
        DELETE FROM tunnel.photo p WHERE p.id = OLD.id;
        IF NOT FOUND THEN
            RETURN NULL;  -- gone meanwhile
        END IF;
        PERFORM tunnel_internal.note_edit(OLD.survey, 'photo', OLD.id,
            jsonb_build_object('finding_id', OLD.finding_id, 'path', OLD.path, 'caption', OLD.caption), NULL);
        RETURN OLD;
    END IF;
    IF coalesce(NEW.path, '') = '' THEN
        RAISE EXCEPTION 'a photo needs a path or URL' USING ERRCODE = 'null_value_not_allowed';
    END IF;
    SELECT s.name INTO name FROM tunnel.finding a JOIN tunnel.survey s ON s.id = a.survey_id WHERE a.id = NEW.finding_id;
    IF NOT FOUND OR (TG_OP = 'UPDATE' AND NEW.finding_id <> OLD.finding_id) THEN
        RAISE EXCEPTION 'a photo is of one finding, which stays; there is no finding %', NEW.finding_id
            USING ERRCODE = 'invalid_parameter_value';
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
