-- Undo of a person's change of a finding, from the audit. The audit only grows: an undo is a new entry that names the entry it
-- reverses.

-- Last change of a finding that was not undone.
CREATE OR REPLACE FUNCTION tunnel_internal.last_step(finding_id bigint) RETURNS tunnel_audit.entry
LANGUAGE sql VOLATILE PARALLEL UNSAFE STRICT SET search_path = pg_catalog, pg_temp AS $$
    SELECT e.* FROM tunnel_audit.entry e
     WHERE e.view = 'finding' AND e.row_id = $1 AND e.undoes IS NULL
       AND NOT EXISTS (SELECT FROM tunnel_audit.entry u WHERE u.undoes = e.id)
     ORDER BY e.id DESC LIMIT 1
$$;
COMMENT ON FUNCTION tunnel_internal.last_step(bigint) IS
    'Last entry of the audit of a finding that was not undone; only finding_undo calls it';

-- Refuse to undo a step of somebody else, or one that a later change depends on.
CREATE OR REPLACE FUNCTION tunnel_internal.check_undo(finding_id bigint, step tunnel_audit.entry) RETURNS void
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE CALLED ON NULL INPUT SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    is_now constant jsonb := tunnel_internal.finding_state(finding_id);
    part tunnel_audit.entry;
    why text;
BEGIN
    IF step.part_of IS NOT NULL THEN
        why := (SELECT format('it was %s finding %s: take that back', CASE step.action WHEN 'insert' THEN 'split off' ELSE 'merged into' END,
                              e.row_id) FROM tunnel_audit.entry e WHERE e.id = step.part_of);
    ELSIF step.who <> session_user AND NOT (CASE WHEN to_regrole('tunnel_operator') IS NULL THEN false
                                                 ELSE pg_has_role(session_user, 'tunnel_operator', 'USAGE') END) THEN
        why := format('its last change is of %s: only who made it, or an operator, takes it back', step.who);
    ELSIF (is_now IS NULL) <> (step.action = 'delete') THEN
        why := CASE WHEN is_now IS NULL THEN 'it is gone' ELSE 'it is there' END;
    ELSIF step.action = 'insert' AND EXISTS (SELECT FROM tunnel.photo p WHERE p.finding_id = check_undo.finding_id) THEN
        why := 'it has photos: delete them first';
    ELSIF step.action = 'update' AND NOT step.after ? 'merged' AND step.after ->> 'origin' IN ('split', 'merged')
          AND NOT EXISTS (SELECT FROM tunnel_audit.entry e WHERE e.part_of = step.id) THEN
        why := 'it was split or merged before that could be taken back';
    ELSIF step.action <> 'delete' THEN
        SELECT format('its %s was changed since by other means', string_agg(k.key, ', ' ORDER BY k.key)) INTO why
          FROM jsonb_object_keys(coalesce(step.before, '{}') || step.after - ARRAY['merged', 'parent_id']) AS k (key)
         WHERE is_now ->> k.key IS DISTINCT FROM step.after ->> k.key
        HAVING count(*) > 0;
    END IF;
    FOR part IN SELECT e.* FROM tunnel_audit.entry e WHERE e.part_of = step.id AND e.view = 'finding' ORDER BY e.id LOOP
        EXIT WHEN why IS NOT NULL;
        IF (tunnel_internal.last_step(part.row_id)).id <> part.id THEN
            why := format('finding %s, a part of it, was changed since: take that back first', part.row_id);
        ELSIF part.action = 'insert' AND EXISTS (SELECT FROM tunnel.photo p WHERE p.finding_id = part.row_id) THEN
            why := format('finding %s, a part of it, has photos: delete them first', part.row_id);
        ELSIF NOT EXISTS (SELECT FROM tunnel.finding a WHERE a.id = part.row_id) THEN
            why := format('finding %s, a part of it, is gone', part.row_id);
        END IF;
    END LOOP;
    IF why IS NOT NULL THEN
        RAISE EXCEPTION 'the last change of finding % is not taken back: %', finding_id, why USING ERRCODE = 'feature_not_supported';
    END IF;
END
$$;
COMMENT ON FUNCTION tunnel_internal.check_undo(bigint, tunnel_audit.entry) IS
    'Raise an error unless the caller can undo the last step of a finding; only finding_undo calls it';

-- Roles and times of drawing and review, from the steps before the one that is undone.
CREATE OR REPLACE FUNCTION tunnel_internal.stamp_finding(finding_id bigint, step tunnel_audit.entry) RETURNS void
LANGUAGE sql VOLATILE PARALLEL UNSAFE STRICT SET search_path = pg_catalog, pg_temp AS $$
    WITH stood AS MATERIALIZED (
        SELECT e.* FROM tunnel_audit.entry e
         WHERE e.view = 'finding' AND e.row_id = $1 AND e.id < $2.id AND e.undoes IS NULL
           AND NOT EXISTS (SELECT FROM tunnel_audit.entry u WHERE u.undoes = e.id AND u.id < $2.id)
    )
    UPDATE tunnel.finding a
       SET drawn_by = CASE WHEN a.origin <> 'detected' THEN coalesce(d.who, a.drawn_by, session_user) END,
           drawn_at = CASE WHEN a.origin <> 'detected' THEN coalesce(d.at, a.drawn_at, clock_timestamp()) END,
           reviewed_by = CASE WHEN c.reviewed AND NOT r.opened THEN r.who WHEN NOT c.reviewed THEN a.reviewed_by END,
           reviewed_at = CASE WHEN c.reviewed AND NOT r.opened THEN r.at WHEN NOT c.reviewed THEN a.reviewed_at END
      FROM (SELECT coalesce($2.before, '{}') || coalesce($2.after, '{}') ?| ARRAY['review', 'remark', 'kind'] AS reviewed) c
      LEFT JOIN LATERAL (SELECT s.who, s.at FROM stood s WHERE s.after ? 'geom' ORDER BY s.id DESC LIMIT 1) d ON true
      LEFT JOIN LATERAL (SELECT s.who, s.at, coalesce(s.after ->> 'review' = 'open' AND s.after ? 'geom', false) AS opened FROM stood s
                          WHERE s.after ?| ARRAY['review', 'remark', 'kind'] ORDER BY s.id DESC LIMIT 1) r ON true
     WHERE a.id = $1
$$;
COMMENT ON FUNCTION tunnel_internal.stamp_finding(bigint, tunnel_audit.entry) IS
    'Restore the roles and times of a finding''s last drawing and review before a step, from the audit';

-- Restore the columns of a finding before a step.
CREATE OR REPLACE FUNCTION tunnel_internal.restore_finding(finding_id bigint, step tunnel_audit.entry) RETURNS void
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    changed constant jsonb := step.after || coalesce(step.before, '{}');
    becomes jsonb := tunnel_internal.finding_state(finding_id) - ARRAY(SELECT jsonb_object_keys(changed)) || coalesce(step.before, '{}');
BEGIN
    IF changed ?| ARRAY['geom', 'origin']
       OR (changed ? 'width_mm' AND EXISTS (SELECT FROM tunnel.finding a WHERE a.id = finding_id AND a.shape IS NOT NULL)) THEN
        -- a detection since would count twice if the finding were detected again
        IF becomes ->> 'origin' = 'detected' AND EXISTS (
            SELECT FROM tunnel.finding x WHERE x.same_as = finding_id AND x.origin = 'detected' AND x.created_at > step.at) THEN
            becomes := becomes || '{"origin": "redrawn"}';
        END IF;
        PERFORM tunnel_internal.redraw(finding_id, public.ST_GeomFromEWKT(becomes ->> 'geom'), (becomes ->> 'width_mm')::float8, becomes ->> 'origin');
        UPDATE tunnel.finding a
           SET darkening_mean = k.darkening_mean, darkening_max = k.darkening_max, image_share = k.image_share, contrast = k.contrast,
               confidence = k.confidence, reasons = k.reasons, evidence = k.evidence, features = k.features,
               feature_list_id = k.feature_list_id, model = k.model, detected = k.detected, area = k.area, clock = k.clock
          FROM jsonb_populate_record(NULL::tunnel.finding, step.kept) k
         WHERE a.id = finding_id AND step.kept IS NOT NULL;
    END IF;
    UPDATE tunnel.finding a
       SET severity = (becomes ->> 'severity')::smallint, width_mm = (becomes ->> 'width_mm')::float8, review = becomes ->> 'review',
           remark = becomes ->> 'remark', merged_into = (becomes ->> 'merged_into')::bigint,
           kind = CASE WHEN a.manual THEN becomes ->> 'kind' ELSE a.kind END,
           kind_override = CASE WHEN NOT a.manual THEN nullif(becomes ->> 'kind', a.kind) END
     WHERE a.id = finding_id;
    PERFORM tunnel_internal.stamp_finding(finding_id, step);
END
$$;
COMMENT ON FUNCTION tunnel_internal.restore_finding(bigint, tunnel_audit.entry) IS
    'Restore the columns, the outline and the measured values of a finding before a step';

-- Restore a deleted finding with its photos.
CREATE OR REPLACE FUNCTION tunnel_internal.revive_finding(survey_id int, step tunnel_audit.entry) RETURNS void
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    had constant jsonb := step.before;
BEGIN
    PERFORM tunnel_internal.add_finding(
        survey_id, had ->> 'kind', public.ST_GeomFromEWKT(had ->> 'geom'), (had ->> 'width_mm')::float8, (had ->> 'severity')::int,
        had ->> 'review', had ->> 'remark', had ->> 'origin', true,
        (SELECT a.id FROM tunnel.finding a WHERE a.id = (had ->> 'parent_id')::bigint), step.row_id);
    UPDATE tunnel.finding a SET darkening_mean = k.darkening_mean, darkening_max = k.darkening_max, image_share = k.image_share, contrast = k.contrast
      FROM jsonb_populate_record(NULL::tunnel.finding, step.kept) k
     WHERE a.id = step.row_id AND step.kept IS NOT NULL;
    PERFORM tunnel_internal.stamp_finding(step.row_id, step);
    INSERT INTO tunnel.photo (id, finding_id, path, caption, added_by, added_at) OVERRIDING SYSTEM VALUE
    SELECT e.row_id, step.row_id, e.before ->> 'path', e.before ->> 'caption', e.before ->> 'added_by', (e.before ->> 'added_at')::timestamptz
      FROM tunnel_audit.entry e WHERE e.part_of = step.id AND e.view = 'photo';
END
$$;
COMMENT ON FUNCTION tunnel_internal.revive_finding(int, tunnel_audit.entry) IS
    'Restore a deleted finding with its id and photos';

CREATE OR REPLACE FUNCTION tunnel_api.finding_undo(id bigint) RETURNS text
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
#variable_conflict use_column
DECLARE
    finding constant bigint := id;
    step tunnel_audit.entry := tunnel_internal.last_step(id);
    part tunnel_audit.entry;
    survey_key int;
    before jsonb;
    place public.geometry;
    done bigint;
BEGIN
    -- not a survey of the same name that was added later
    survey_key := (SELECT s.id FROM tunnel.survey s WHERE s.name = step.survey AND s.created_at <= step.at);
    IF survey_key IS NULL THEN
        RAISE EXCEPTION 'there is no change of a finding % to be taken back', finding USING ERRCODE = 'invalid_parameter_value';
    END IF;
    PERFORM tunnel_internal.lock_findings(survey_key);
    PERFORM FROM tunnel.finding a
      WHERE a.id = finding OR a.id IN (SELECT e.row_id FROM tunnel_audit.entry e WHERE e.part_of = step.id AND e.view = 'finding')
      ORDER BY a.id FOR UPDATE;
    step := tunnel_internal.last_step(finding);  -- read again under the lock
    PERFORM tunnel_internal.check_undo(finding, step);
    before := tunnel_internal.finding_state(finding);
    place := (SELECT a.unrolled FROM tunnel.finding a WHERE a.id = finding);
    IF step.action = 'insert' THEN
        DELETE FROM tunnel.finding a WHERE a.id = finding;
    ELSIF step.action = 'delete' THEN
        PERFORM tunnel_internal.revive_finding(survey_key, step);
    ELSE
        PERFORM tunnel_internal.restore_finding(finding, step);
    END IF;
    done := tunnel_internal.note_edit(step.survey, 'finding', finding, before, tunnel_internal.finding_state(finding), undoes => step.id);
    IF done IS NULL THEN  -- a merge that did not change the outline
        done := tunnel_internal.note_edit(step.survey, 'finding', finding, before || jsonb_build_object('merged', step.after -> 'merged'),
                                     tunnel_internal.finding_state(finding), undoes => step.id);
    END IF;
    FOR part IN SELECT e.* FROM tunnel_audit.entry e WHERE e.part_of = step.id ORDER BY e.id LOOP
        before := CASE part.view WHEN 'finding' THEN tunnel_internal.finding_state(part.row_id) END;
        IF part.view = 'photo' THEN
            PERFORM tunnel_internal.note_edit(step.survey, 'photo', part.row_id, NULL, part.before, undoes => part.id, part_of => done);
            CONTINUE;
        ELSIF part.action = 'insert' THEN
            DELETE FROM tunnel.finding a WHERE a.id = part.row_id;
        ELSE
            PERFORM tunnel_internal.restore_finding(part.row_id, part);
        END IF;
        PERFORM tunnel_internal.note_edit(step.survey, 'finding', part.row_id, before, tunnel_internal.finding_state(part.row_id),
                                     undoes => part.id, part_of => done);
    END LOOP;
    PERFORM tunnel_internal.check_hidden(finding);
    place := public.ST_Collect(place, (SELECT a.unrolled FROM tunnel.finding a WHERE a.id = finding));
    PERFORM tunnel_internal.settle_findings(survey_key, place);
    RETURN CASE WHEN step.action = 'insert' THEN 'drawn' WHEN step.action = 'delete' THEN 'deleted'
                WHEN step.after ? 'merged' THEN 'merged'
                WHEN EXISTS (SELECT FROM tunnel_audit.entry e WHERE e.part_of = step.id) THEN 'split'
                WHEN step.after ? 'geom' THEN 'redrawn' ELSE 'reviewed' END;
END
$$;
COMMENT ON FUNCTION tunnel_api.finding_undo(bigint) IS
'Undo the last change of a finding (drawn, redrawn, reviewed, split, merged or deleted) and return its kind. Only the role that made the change, or an operator, can undo it. Refused if a later change depends on it. Undo a split or a merge on the finding that kept its id';
