-- A survey as it was at a moment, from the audit: show_as_of takes back all later edits of its findings, photos, dry regions, spots and
-- actions. All views and functions then show the survey as it was, in this transaction only: it cannot be committed.

-- Stages that findings result from. A later run replaced what was there before.
CREATE OR REPLACE FUNCTION tunnel_internal.runs_since(survey_id int, moment timestamptz)
RETURNS TABLE (stage text, km int, finished_at timestamptz)
LANGUAGE sql STABLE STRICT PARALLEL SAFE SECURITY DEFINER ROWS 10 SET search_path = pg_catalog, pg_temp AS $$
    SELECT r.stage, r.km, r.finished_at
      FROM tunnel.run r
     WHERE r.survey_id = $1 AND r.outcome = 'done' AND r.finished_at > $2
       AND (r.stage IN ('detect', 'members', 'spheres', 'import', 'read')
            OR EXISTS (SELECT FROM tunnel.stage s JOIN tunnel.stage d ON d.name = 'detect' WHERE s.name = r.stage AND s.step < d.step))
     ORDER BY r.finished_at
$$;
COMMENT ON FUNCTION tunnel_internal.runs_since(int, timestamptz) IS
    'Runs of stages since a moment whose results findings depend on: what was there before is not stored';

CREATE OR REPLACE FUNCTION tunnel_internal.revert_finding(survey_id int, step tunnel_audit.entry) RETURNS void
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    place public.geometry := (SELECT a.unrolled FROM tunnel.finding a WHERE a.id = step.row_id);
BEGIN
    IF step.action = 'insert' THEN
        DELETE FROM tunnel.finding a WHERE a.id = step.row_id;
    ELSIF step.action = 'delete' THEN
        PERFORM tunnel_internal.revive_finding(survey_id, step);
    ELSE
        PERFORM tunnel_internal.restore_finding(step.row_id, step);
    END IF;
    place := public.ST_Collect(place, (SELECT a.unrolled FROM tunnel.finding a WHERE a.id = step.row_id));
    IF place IS NOT NULL THEN
        PERFORM tunnel_internal.settle_findings(survey_id, place);
    END IF;
END
$$;
COMMENT ON FUNCTION tunnel_internal.revert_finding(int, tunnel_audit.entry) IS
    'Take back a step of a finding, whoever made it; only show_as_of calls it';

CREATE OR REPLACE FUNCTION tunnel_internal.revert_other(survey_id int, step tunnel_audit.entry) RETURNS void
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT SET search_path = pg_catalog, pg_temp AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := survey_id;
    was constant jsonb := coalesce(step.before, '{}');
    gone constant text[] := ARRAY(SELECT jsonb_object_keys(coalesce(step.after, '{}')));  -- columns without a value before
    photo tunnel.photo;
    action tunnel.action;
    place public.geometry;
BEGIN
    IF step.view = 'photo' THEN
        IF step.action = 'insert' THEN
            DELETE FROM tunnel.photo p WHERE p.id = step.row_id;
        ELSIF step.action = 'update' THEN
            SELECT p.* INTO photo FROM tunnel.photo p WHERE p.id = step.row_id;
            photo := jsonb_populate_record(photo, to_jsonb(photo) - gone || was);
            UPDATE tunnel.photo p SET path = photo.path, caption = photo.caption WHERE p.id = step.row_id;
        ELSIF step.part_of IS NULL THEN  -- those of a deleted finding come back with it
            INSERT INTO tunnel.photo (id, finding_id, path, caption) OVERRIDING SYSTEM VALUE
            VALUES (step.row_id, (was ->> 'finding_id')::bigint, was ->> 'path', was ->> 'caption');
        END IF;
    ELSIF step.view = 'region' THEN
        place := (SELECT r.geom FROM tunnel.region r WHERE r.id = step.row_id);
        IF step.action = 'insert' THEN
            DELETE FROM tunnel.region r WHERE r.id = step.row_id;
        ELSE
            INSERT INTO tunnel.region (id, survey_id, kind, geom, drawn_by, reason, pending_approval, approved_by) OVERRIDING SYSTEM VALUE
            SELECT step.row_id, survey_key, s.state ->> 'kind', public.ST_GeomFromEWKT(s.state ->> 'geom'),
                   coalesce((SELECT e.who FROM tunnel_audit.entry e WHERE e.view = 'region' AND e.row_id = step.row_id AND e.id < step.id
                                AND e.after ?| ARRAY['geom', 'kind'] ORDER BY e.id DESC LIMIT 1), step.who),
                   s.state ->> 'reason', coalesce((s.state ->> 'pending_approval')::boolean, false), s.state ->> 'approved_by'
              FROM (SELECT coalesce(tunnel_internal.region_state(step.row_id::int), '{}') - gone || was AS state) s
            ON CONFLICT (id) DO UPDATE SET kind = excluded.kind, geom = excluded.geom, reason = excluded.reason, drawn_by = excluded.drawn_by,
                pending_approval = excluded.pending_approval, approved_by = excluded.approved_by;
        END IF;
        place := public.ST_Collect(place, (SELECT r.geom FROM tunnel.region r WHERE r.id = step.row_id));
        PERFORM tunnel_internal.mark_dry(survey_key, place);
    ELSIF step.view = 'spot' THEN
        UPDATE tunnel.spot p
           SET review = CASE WHEN was ? 'review' OR 'review' = ANY (gone) THEN was ->> 'review' ELSE p.review END,
               remark = CASE WHEN was ? 'remark' OR 'remark' = ANY (gone) THEN was ->> 'remark' ELSE p.remark END
         WHERE p.id = step.row_id;
    ELSIF step.view = 'action' THEN
        IF step.action = 'insert' THEN
            DELETE FROM tunnel.action a WHERE a.id = step.row_id;
        ELSE
            SELECT a.* INTO action FROM tunnel.action a WHERE a.id = step.row_id;
            action := jsonb_populate_record(NULL::tunnel.action, coalesce(to_jsonb(action), '{}') - gone || was);
            INSERT INTO tunnel.action (id, survey_id, finding_id, element, chainage_from, chainage_to, arc, measure, urgency, responsible, due,
                                       cost, currency, state, remark) OVERRIDING SYSTEM VALUE
            VALUES (step.row_id, survey_key, (SELECT a.id FROM tunnel.finding a WHERE a.id = action.finding_id), action.element,
                    action.chainage_from, action.chainage_to, action.arc, action.measure, action.urgency, action.responsible, action.due,
                    action.cost, action.currency, action.state, action.remark)
            ON CONFLICT (id) DO UPDATE SET finding_id = excluded.finding_id, element = excluded.element,
                chainage_from = excluded.chainage_from, chainage_to = excluded.chainage_to, arc = excluded.arc, measure = excluded.measure,
                urgency = excluded.urgency, responsible = excluded.responsible, due = excluded.due, cost = excluded.cost,
                currency = excluded.currency, state = excluded.state, remark = excluded.remark;
        END IF;
    END IF;
END
$$;
COMMENT ON FUNCTION tunnel_internal.revert_other(int, tunnel_audit.entry) IS
    'Take back an edit of a photo, a dry region, a spot or an action; only show_as_of calls it';

CREATE OR REPLACE FUNCTION tunnel_api.show_as_of(survey text, moment timestamptz) RETURNS int
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := tunnel_api.survey_id(survey);
    name constant text := survey;
    day constant timestamptz := moment;
    step tunnel_audit.entry;
    later record;
    reverted int := 0;
BEGIN
    INSERT INTO tunnel.as_of (moment) VALUES (day);  -- the commit is refused from here on
    IF (SELECT s.created_at FROM tunnel.survey s WHERE s.id = survey_key) > day THEN
        RAISE EXCEPTION 'survey % was added after %', name, day USING ERRCODE = 'invalid_parameter_value';
    END IF;
    SELECT r.* INTO later FROM tunnel_internal.runs_since(survey_key, day) r LIMIT 1;
    IF FOUND THEN
        RAISE EXCEPTION 'survey % cannot be shown as of %: stage % ran on %', name, day,
            later.stage || coalesce(' of km ' || later.km, ''), later.finished_at
            USING ERRCODE = 'invalid_parameter_value', HINT = 'What it had found before is not stored: take a later moment, or an archive of that time.';
    END IF;
    PERFORM tunnel_internal.lock_findings(survey_key);
    FOR step IN SELECT e.* FROM tunnel_audit.entry e
                 WHERE e.survey = name AND e.at > day AND e.view IN ('finding', 'photo', 'region', 'spot', 'action')
                   AND e.imported_at IS NULL ORDER BY e.id DESC LOOP
        IF step.view = 'finding' THEN
            PERFORM tunnel_internal.revert_finding(survey_key, step);
        ELSE
            PERFORM tunnel_internal.revert_other(survey_key, step);
        END IF;
        reverted := reverted + 1;
    END LOOP;
    RETURN reverted;
END
$$;
COMMENT ON FUNCTION tunnel_api.show_as_of(text, timestamptz) IS
'Show a survey as it was at a moment, in this transaction only: take back all later edits of its findings, photos, dry regions, spots and actions, and return their number. The transaction cannot be committed; roll it back. Edits of these rows by other people wait until then. Refused if a stage that findings depend on ran since: what it had found before is not stored';
