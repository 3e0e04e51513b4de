-- Actions that inspections demand: measure, urgency, responsible, due date, cost and state. Inspectors add, change and delete them
-- through the views; each edit is written to the audit. Needs stationing (geometry/stationing.sql), map_point (geometry/unroll.sql)
-- and leak_change (measures/change.sql).

-- State of a leak in each later survey that was compared with the survey of the leak (tunneldb compare).
CREATE OR REPLACE FUNCTION tunnel_internal.leak_later(survey_id int, finding_id bigint)
RETURNS TABLE (survey text, date date, state text, area_old float8, area_new float8)
LANGUAGE sql STABLE STRICT PARALLEL SAFE SECURITY DEFINER ROWS 3 SET search_path = pg_catalog, pg_temp AS $$
    SELECT s.name, s.date, c.state, c.area_old, c.area_new
      FROM tunnel.leak_change c
      JOIN tunnel.survey s ON s.id = c.survey_id
     WHERE c.old_survey_id = $1 AND c.old_ids @> ARRAY[$2] AND s.id NOT IN (SELECT k.survey_id FROM tunnel_internal.survey_copy k)
     ORDER BY s.date, s.name
$$;
COMMENT ON FUNCTION tunnel_internal.leak_later(int, bigint) IS
'State and area of a leak (m², then and now) in each later survey that was compared with its survey, by date';

-- "dry since": from the first of the last surveys in a row in which the leak was dry. A survey that did not see the place changes nothing.
CREATE OR REPLACE FUNCTION tunnel_internal.follow_up(survey_id int, finding_id bigint) RETURNS text
LANGUAGE sql STABLE STRICT PARALLEL SAFE SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    WITH later AS (
        SELECT l.*, row_number() OVER (ORDER BY l.date DESC, l.survey DESC) AS back
          FROM tunnel_internal.leak_later($1, $2) l
    ), judged AS (
        SELECT l.* FROM later l WHERE l.state <> 'unseen'
    ), last AS (
        SELECT j.* FROM judged j ORDER BY j.back LIMIT 1
    ), dry AS (
        SELECT min(j.date) AS since FROM judged j
         WHERE j.state = 'dry' AND NOT EXISTS (SELECT FROM judged o WHERE o.back < j.back AND o.state <> 'dry')
    )
    SELECT CASE WHEN NOT EXISTS (SELECT FROM later) THEN 'not compared'
                WHEN NOT EXISTS (SELECT FROM last) THEN (SELECT format('not inspected on %s', l.date) FROM later l WHERE l.back = 1)
                WHEN (SELECT l.state FROM last l) = 'dry' THEN (SELECT format('dry since %s', d.since) FROM dry d)
                ELSE (SELECT format('%s on %s: %s to %s m²', l.state, l.date, round(l.area_old::numeric, 2), round(l.area_new::numeric, 2))
                        FROM last l) END
           || coalesce((SELECT format('; not inspected on %s', l.date) FROM later l
                         WHERE l.back = 1 AND l.state = 'unseen' AND EXISTS (SELECT FROM last)), '')
$$;
COMMENT ON FUNCTION tunnel_internal.follow_up(int, bigint) IS
'State of a leak in later surveys, from their comparisons (tunneldb compare): dry since a date, grown, same or shrunk with areas (m²); not inspected; not compared';

CREATE OR REPLACE VIEW tunnel_api.action AS
SELECT a.id, a.survey_id, s.name AS survey, s.tunnel_id, t.name AS tunnel, a.finding_id,
       (SELECT coalesce(f.kind_override, f.kind) FROM tunnel.finding f WHERE f.id = a.finding_id) AS finding_kind,
       a.element, a.chainage_from, a.chainage_to, a.arc,
       tunnel_api.station_label(s.tunnel_id, (a.chainage_from + a.chainage_to) / 2) AS label,
       a.measure, a.urgency, a.responsible, a.due,
       a.due < CURRENT_DATE AND a.state IN ('open', 'ordered') AS overdue,
       a.cost, a.currency, a.state, a.remark,
       (SELECT count(*) FROM tunnel.photo p WHERE p.finding_id = a.finding_id) AS photos,
       tunnel_internal.follow_up(a.survey_id, a.finding_id) AS follow_up,
       a.added_by, a.added_at, a.changed_by, a.changed_at
  FROM tunnel.action a
  JOIN tunnel.survey s ON s.id = a.survey_id
  JOIN tunnel.tunnel t ON t.id = s.tunnel_id;
COMMENT ON VIEW tunnel_api.action IS
'Actions that inspections demand. Rows may be added, changed and deleted: survey, finding_id or element and chainages, measure, urgency, responsible, due, cost, currency, state, remark';

CREATE OR REPLACE VIEW tunnel_api.action_map AS
SELECT a.*, tunnel_internal.map_point(a.survey_id, (a.chainage_from + a.chainage_to) / 2, coalesce(a.arc, 0))::public.geometry AS geom
  FROM tunnel_api.action a;
COMMENT ON VIEW tunnel_api.action_map IS 'Actions that inspections demand, on the map strip beside the axis, in the tunnel''s SRID';

CREATE OR REPLACE VIEW tunnel_api.action_unrolled AS
SELECT a.*, public.ST_MakePoint((a.chainage_from + a.chainage_to) / 2, coalesce(a.arc, 0))::public.geometry(Point, 0) AS geom
  FROM tunnel_api.action a;
COMMENT ON VIEW tunnel_api.action_unrolled IS 'Actions that inspections demand, in the unrolled plane (chainage, arc), SRID 0';

DO $$
DECLARE
    comment record;
BEGIN
    FOR comment IN SELECT v.view, t.* FROM (VALUES ('action'), ('action_map'), ('action_unrolled')) AS v (view)
     CROSS JOIN (VALUES
        ('survey', 'Name of the survey that demands it'),
        ('tunnel', 'Name of the tunnel'),
        ('finding_id', 'Finding that it is about; NULL: an element or a stretch'),
        ('finding_kind', 'Code of the kind of the finding'),
        ('element', 'Name of the element that it is about'),
        ('chainage_from', 'Chainage of its beginning, m; by default that of the finding'),
        ('chainage_to', 'Chainage of its end, m'),
        ('arc', 'Arc of its place, m from the crown; NULL: the whole circumference'),
        ('label', 'Station of its middle, as 12+345.678'),
        ('measure', 'What is to be done'),
        ('urgency', 'immediate, urgent, planned or monitor (observe only)'),
        ('responsible', 'Person or firm that does it'),
        ('due', 'Day until which it is to be done'),
        ('overdue', 'True if it is open or ordered after its due date'),
        ('cost', 'Cost, in currency'),
        ('currency', 'Currency of the cost, ISO 4217'),
        ('state', 'open, ordered, done or verified'),
        ('remark', 'Remark'),
        ('photos', 'Number of photos of the finding (finding_photo)'),
        ('follow_up', 'State of the leak in later surveys that were compared with this one: dry since a date, grown, same, shrunk, not inspected or not compared; NULL without a finding'),
        ('added_by', 'Role that added it, set by the database'),
        ('added_at', 'Time when it was added, set by the database'),
        ('changed_by', 'Role that changed it last, set by the database'),
        ('changed_at', 'Time of the last change, set by the database')) AS t (name, text)
    LOOP
        EXECUTE format('COMMENT ON COLUMN tunnel_api.%I.%I IS %L', comment.view, comment.name, comment.text);
    END LOOP;
END
$$;
COMMENT ON COLUMN tunnel_api.action_map.geom IS 'Its place on the map strip beside the axis, in the tunnel''s SRID';
COMMENT ON COLUMN tunnel_api.action_unrolled.geom IS 'Its place in the unrolled plane (chainage, arc), SRID 0';

-- Editable columns of an action, as the audit keeps them.
CREATE OR REPLACE FUNCTION tunnel_internal.action_state(id bigint) RETURNS jsonb
LANGUAGE sql STABLE PARALLEL SAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT jsonb_strip_nulls(to_jsonb(a) - ARRAY['id', 'survey_id', 'added_by', 'added_at', 'changed_by', 'changed_at'])
      FROM tunnel.action a WHERE a.id = $1
$$;
COMMENT ON FUNCTION tunnel_internal.action_state(bigint) IS 'Editable columns of an action for the audit';

-- Insert, change or delete an action. Only the changed columns are written, so that concurrent edits of other columns stay.
CREATE OR REPLACE FUNCTION tunnel_internal.edit_action() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    editable CONSTANT text[] := ARRAY['finding_id', 'element', 'chainage_from', 'chainage_to', 'arc', 'measure', 'urgency', 'responsible', 'due',
                                      'cost', 'currency', 'state', 'remark'];
    its tunnel.survey;
    place tunnel.finding;
    was tunnel.action;
    becomes tunnel.action;
    before jsonb;
    changed text[];
    key text;
BEGIN
    IF TG_OP = 'INSERT' THEN
        SELECT s.* INTO its FROM tunnel.survey s
         WHERE CASE WHEN NEW.survey_id IS NULL THEN s.name = NEW.survey ELSE s.id = NEW.survey_id END;
        IF NOT FOUND THEN
            RAISE EXCEPTION 'an action needs the survey that demands it; there is none %',
                coalesce('with id ' || NEW.survey_id, 'named ' || tunnel_internal.excerpt(NEW.survey), 'without a name')
                USING ERRCODE = 'invalid_parameter_value';
        END IF;
        becomes := jsonb_populate_record(NULL::tunnel.action, to_jsonb(NEW));
        becomes.survey_id := its.id;
    ELSE
        SELECT a.* INTO was FROM tunnel.action a WHERE a.id = OLD.id FOR UPDATE;
        IF NOT FOUND THEN
            RETURN NULL;  -- deleted meanwhile
        END IF;
        its.id := was.survey_id;
        before := tunnel_internal.action_state(was.id);
    END IF;
    IF TG_OP = 'DELETE' THEN
        DELETE FROM tunnel.action a WHERE a.id = OLD.id;
        PERFORM tunnel_internal.note_edit(OLD.survey, 'action', OLD.id, before, NULL);
        RETURN OLD;
    END IF;
    IF TG_OP = 'UPDATE' THEN
        changed := ARRAY(SELECT n.key FROM jsonb_each(to_jsonb(NEW)) n WHERE n.value IS DISTINCT FROM to_jsonb(OLD) -> n.key AND n.key <> 'geom');
        IF NOT changed <@ editable THEN
            RAISE EXCEPTION 'of an action only % can be edited', array_to_string(editable, ', ') USING ERRCODE = 'feature_not_supported';
        END IF;
        SELECT c INTO key FROM unnest(changed) c
         WHERE to_jsonb(was) -> c IS DISTINCT FROM to_jsonb(OLD) -> c AND to_jsonb(was) -> c IS DISTINCT FROM to_jsonb(NEW) -> c LIMIT 1;
        IF FOUND THEN
            RAISE EXCEPTION 'the % of action % was changed meanwhile to %', key, OLD.id,
                coalesce(quote_literal(tunnel_internal.excerpt(to_jsonb(was) ->> key)), 'none')
                USING ERRCODE = 'serialization_failure', HINT = 'Reload the row, then edit it again.';
        END IF;
        becomes := jsonb_populate_record(was, (SELECT coalesce(jsonb_object_agg(c, to_jsonb(NEW) -> c), '{}') FROM unnest(changed) c));
    END IF;
    becomes.urgency := coalesce(becomes.urgency, 'planned');
    becomes.state := coalesce(becomes.state, 'open');
    IF coalesce(becomes.measure, '') = '' THEN
        RAISE EXCEPTION 'an action needs a measure: what is to be done' USING ERRCODE = 'null_value_not_allowed';
    END IF;
    PERFORM tunnel_internal.check_text('the measure', becomes.measure, 2000), tunnel_internal.check_text('the element', becomes.element, 200),
            tunnel_internal.check_text('the responsible', becomes.responsible, 200), tunnel_internal.check_text('the remark', becomes.remark, 10000);
    IF becomes.urgency NOT IN ('immediate', 'urgent', 'planned', 'monitor') THEN
        RAISE EXCEPTION 'the urgency can be immediate, urgent, planned or monitor, not %', tunnel_internal.excerpt(becomes.urgency)
            USING ERRCODE = 'check_violation';
    ELSIF becomes.state NOT IN ('open', 'ordered', 'done', 'verified') THEN
        RAISE EXCEPTION 'the state can be open, ordered, done or verified, not %', tunnel_internal.excerpt(becomes.state)
            USING ERRCODE = 'check_violation';
    ELSIF (becomes.cost IS NULL) <> (becomes.currency IS NULL) OR becomes.currency !~ '^[A-Z]{3}$' THEN
        RAISE EXCEPTION 'a cost needs its currency, in three letters such as EUR, and a currency a cost' USING ERRCODE = 'check_violation';
    END IF;
    IF becomes.finding_id IS NOT NULL AND (TG_OP = 'INSERT' OR becomes.finding_id IS DISTINCT FROM was.finding_id) THEN
        SELECT f.* INTO place FROM tunnel.finding f WHERE f.id = becomes.finding_id AND f.survey_id = its.id;
        IF NOT FOUND THEN
            RAISE EXCEPTION 'the survey has no finding %', becomes.finding_id USING ERRCODE = 'invalid_parameter_value';
        END IF;
        becomes.chainage_from := place.chainage_from;
        becomes.chainage_to := place.chainage_to;
        becomes.arc := (place.arc_from + place.arc_to) / 2;
    END IF;
    IF becomes.chainage_from IS NULL OR becomes.chainage_to IS NULL OR becomes.chainage_from > becomes.chainage_to THEN
        RAISE EXCEPTION 'an action needs a finding, or chainage_from and a chainage_to that is not less' USING ERRCODE = 'invalid_parameter_value';
    END IF;
    IF place.id IS NULL AND (becomes.chainage_from, becomes.chainage_to) IS DISTINCT FROM (was.chainage_from, was.chainage_to)
       AND EXISTS (SELECT FROM tunnel_api.survey_ends(its.id) v
                    WHERE becomes.chainage_from < v.chainage_from - 1 OR becomes.chainage_to > v.chainage_to + 1) THEN
        RAISE EXCEPTION 'an action from chainage % to % is not within the survey', becomes.chainage_from, becomes.chainage_to
            USING ERRCODE = 'invalid_parameter_value';
    END IF;
    IF TG_OP = 'INSERT' THEN
        INSERT INTO tunnel.action (survey_id, finding_id, element, chainage_from, chainage_to, arc, measure, urgency, responsible, due, cost,
                                   currency, state, remark)
        VALUES (becomes.survey_id, becomes.finding_id, becomes.element, becomes.chainage_from, becomes.chainage_to, becomes.arc,
                becomes.measure, becomes.urgency, becomes.responsible, becomes.due, becomes.cost, becomes.currency, becomes.state, becomes.remark)
        RETURNING id INTO NEW.id;
        SELECT s.name INTO NEW.survey FROM tunnel.survey s WHERE s.id = its.id;
    ELSIF becomes IS DISTINCT FROM was THEN
        UPDATE tunnel.action a
           SET finding_id = becomes.finding_id, element = becomes.element, chainage_from = becomes.chainage_from,
               chainage_to = becomes.chainage_to, arc = becomes.arc, measure = becomes.measure, urgency = becomes.urgency,
               responsible = becomes.responsible, due = becomes.due, cost = becomes.cost, currency = becomes.currency,
               state = becomes.state, remark = becomes.remark, changed_by = session_user, changed_at = clock_timestamp()
         WHERE a.id = was.id;
    END IF;
    PERFORM tunnel_internal.note_edit(NEW.survey, 'action', NEW.id, before, tunnel_internal.action_state(NEW.id));
    RETURN NEW;
END
$$;
COMMENT ON FUNCTION tunnel_internal.edit_action() IS
    'Trigger of the views of actions: insert, change or delete an action, and write role and time';

DO $$
DECLARE
    name text;
BEGIN
    FOREACH name IN ARRAY ARRAY['action', 'action_map', 'action_unrolled'] LOOP
        EXECUTE format('CREATE OR REPLACE TRIGGER edit INSTEAD OF INSERT OR UPDATE OR DELETE ON tunnel_api.%I FOR EACH ROW'
                       ' EXECUTE FUNCTION tunnel_internal.edit_action()', name);
    END LOOP;
END
$$;
