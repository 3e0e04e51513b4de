-- Findings: kinds, severities, and the triggers that keep what is worked out of them.

INSERT INTO tunnel.finding_kind (code, label, geometries, wet, position) VALUES
    ('leak', 'Leak', '{polygon}', true, 10),
    ('drip', 'Drip', '{point, polygon}', true, 20),
    ('crack', 'Crack', '{line}', false, 30),
    ('spall', 'Spall', '{polygon, point}', false, 40),
    ('delamination', 'Delamination', '{polygon}', false, 50),
    ('efflorescence', 'Efflorescence', '{polygon, line, point}', false, 60),
    ('damaged_joint', 'Damaged joint', '{line, polygon, point}', false, 70),
    ('missing_bolt', 'Missing bolt', '{point}', false, 80),
    ('corroded', 'Corroded', '{polygon, line, point}', false, 90),
    ('obstruction', 'Obstruction', '{polygon, line, point}', false, 100),
    ('other', 'Other', '{polygon, line, point}', false, 110),
    ('joint', 'Joint', '{polygon, line}', false, 120),
    ('dark', 'Dry dark area', '{polygon}', false, 130);
INSERT INTO tunnel.severity (id, label, text) VALUES
    (1, 'minor', 'No action; to be looked at in the next inspection'),
    (2, 'moderate', 'To be watched, or repaired with other works'),
    (3, 'serious', 'To be repaired soon'),
    (4, 'critical', 'To be dealt with at once');

-- Without it the planner takes one row in 200 for a leak.
CREATE STATISTICS tunnel.finding_kinds ON (coalesce(kind_override, kind)) FROM tunnel.finding;

-- Sums over a hundred thousand findings read this from an index, and need not look each kind up.
CREATE FUNCTION tunnel.set_wet() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SET search_path = pg_catalog, pg_temp
AS $$
BEGIN
    NEW.wet := coalesce((SELECT k.wet FROM tunnel.finding_kind k WHERE k.code = coalesce(NEW.kind_override, NEW.kind)), false);
    RETURN NEW;
END
$$;
COMMENT ON FUNCTION tunnel.set_wet() IS 'Trigger on tunnel.finding: whether its kind, as kind_override, counts as wet';
CREATE TRIGGER set_wet BEFORE INSERT OR UPDATE OF kind, kind_override, wet ON tunnel.finding
    FOR EACH ROW EXECUTE FUNCTION tunnel.set_wet();

CREATE FUNCTION tunnel.wet_of_kind() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SET search_path = pg_catalog, pg_temp
AS $$
BEGIN
    UPDATE tunnel.finding a SET wet = NEW.wet WHERE coalesce(a.kind_override, a.kind) = NEW.code;
    RETURN NULL;
END
$$;
COMMENT ON FUNCTION tunnel.wet_of_kind() IS 'Trigger on tunnel.finding_kind: findings of a kind follow whether it is wet';
CREATE TRIGGER wet_of_kind AFTER UPDATE OF wet ON tunnel.finding_kind
    FOR EACH ROW WHEN (OLD.wet IS DISTINCT FROM NEW.wet) EXECUTE FUNCTION tunnel.wet_of_kind();

-- Sums over a hundred thousand findings are added up from some dozens of rows: each statement adds one for each group, by the state
-- that finding says; open and confirmed count. What is no line is as long as it is along the tunnel.
CREATE FUNCTION tunnel.count_insert() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SET search_path = pg_catalog, pg_temp
AS $$
BEGIN
    INSERT INTO tunnel.finding_sum (survey_id, kind, wet, origin, severity, state, measured, findings, area, length, extent)
    SELECT c.survey_id, c.kind, c.wet, c.origin, c.severity, c.state, c.measured, sum(c.n), sum(c.n * c.area),
           sum(c.n * c.length), sum(c.n * c.extent)
      FROM (
        SELECT survey_id, coalesce(kind_override, kind), wet, origin, severity,
               CASE WHEN merged_into IS NOT NULL THEN 'merged' WHEN same_as IS NOT NULL THEN 'same'
                    WHEN review = 'rejected' THEN 'rejected' WHEN superseded THEN 'dry' WHEN NOT detected THEN 'gone'
                    ELSE review END,
               image_share IS NOT NULL, 1, area, coalesce(length, 0), coalesce(length, chainage_to - chainage_from)
          FROM is_now
      ) AS c (survey_id, kind, wet, origin, severity, state, measured, n, area, length, extent)
      JOIN tunnel.survey s ON s.id = c.survey_id
     GROUP BY 1, 2, 3, 4, 5, 6, 7
    HAVING sum(c.n) <> 0 OR sum(c.n * c.area) <> 0 OR sum(c.n * c.length) <> 0 OR sum(c.n * c.extent) <> 0;
    RETURN NULL;
END
$$;
COMMENT ON FUNCTION tunnel.count_insert() IS
'Trigger on tunnel.finding: adds to the sums of findings by how much what is new changes them';
CREATE TRIGGER count_insert AFTER INSERT ON tunnel.finding
    REFERENCING NEW TABLE AS is_now FOR EACH STATEMENT EXECUTE FUNCTION tunnel.count_insert();

CREATE FUNCTION tunnel.count_update() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SET search_path = pg_catalog, pg_temp
AS $$
BEGIN
    INSERT INTO tunnel.finding_sum (survey_id, kind, wet, origin, severity, state, measured, findings, area, length, extent)
    SELECT c.survey_id, c.kind, c.wet, c.origin, c.severity, c.state, c.measured, sum(c.n), sum(c.n * c.area),
           sum(c.n * c.length), sum(c.n * c.extent)
      FROM (
        SELECT survey_id, coalesce(kind_override, kind), wet, origin, severity,
               CASE WHEN merged_into IS NOT NULL THEN 'merged' WHEN same_as IS NOT NULL THEN 'same'
                    WHEN review = 'rejected' THEN 'rejected' WHEN superseded THEN 'dry' WHEN NOT detected THEN 'gone'
                    ELSE review END,
               image_share IS NOT NULL, 1, area, coalesce(length, 0), coalesce(length, chainage_to - chainage_from)
          FROM is_now
        UNION ALL
        SELECT survey_id, coalesce(kind_override, kind), wet, origin, severity,
               CASE WHEN merged_into IS NOT NULL THEN 'merged' WHEN same_as IS NOT NULL THEN 'same'
                    WHEN review = 'rejected' THEN 'rejected' WHEN superseded THEN 'dry' WHEN NOT detected THEN 'gone'
                    ELSE review END,
               image_share IS NOT NULL, -1, area, coalesce(length, 0), coalesce(length, chainage_to - chainage_from)
          FROM was
      ) AS c (survey_id, kind, wet, origin, severity, state, measured, n, area, length, extent)
      JOIN tunnel.survey s ON s.id = c.survey_id
     GROUP BY 1, 2, 3, 4, 5, 6, 7
    HAVING sum(c.n) <> 0 OR sum(c.n * c.area) <> 0 OR sum(c.n * c.length) <> 0 OR sum(c.n * c.extent) <> 0;
    RETURN NULL;
END
$$;
COMMENT ON FUNCTION tunnel.count_update() IS
'Trigger on tunnel.finding: adds to the sums of findings by how much what is changed changes them';
CREATE TRIGGER count_update AFTER UPDATE ON tunnel.finding
    REFERENCING OLD TABLE AS was NEW TABLE AS is_now FOR EACH STATEMENT EXECUTE FUNCTION tunnel.count_update();

CREATE FUNCTION tunnel.count_delete() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SET search_path = pg_catalog, pg_temp
AS $$
BEGIN
    INSERT INTO tunnel.finding_sum (survey_id, kind, wet, origin, severity, state, measured, findings, area, length, extent)
    SELECT c.survey_id, c.kind, c.wet, c.origin, c.severity, c.state, c.measured, sum(c.n), sum(c.n * c.area),
           sum(c.n * c.length), sum(c.n * c.extent)
      FROM (
        SELECT survey_id, coalesce(kind_override, kind), wet, origin, severity,
               CASE WHEN merged_into IS NOT NULL THEN 'merged' WHEN same_as IS NOT NULL THEN 'same'
                    WHEN review = 'rejected' THEN 'rejected' WHEN superseded THEN 'dry' WHEN NOT detected THEN 'gone'
                    ELSE review END,
               image_share IS NOT NULL, -1, area, coalesce(length, 0), coalesce(length, chainage_to - chainage_from)
          FROM was
      ) AS c (survey_id, kind, wet, origin, severity, state, measured, n, area, length, extent)
      JOIN tunnel.survey s ON s.id = c.survey_id
     GROUP BY 1, 2, 3, 4, 5, 6, 7
    HAVING sum(c.n) <> 0 OR sum(c.n * c.area) <> 0 OR sum(c.n * c.length) <> 0 OR sum(c.n * c.extent) <> 0;
    RETURN NULL;
END
$$;
COMMENT ON FUNCTION tunnel.count_delete() IS
'Trigger on tunnel.finding: adds to the sums of findings by how much what is gone changes them';
CREATE TRIGGER count_delete AFTER DELETE ON tunnel.finding
    REFERENCING OLD TABLE AS was FOR EACH STATEMENT EXECUTE FUNCTION tunnel.count_delete();

CREATE FUNCTION tunnel.forget_findings() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SET search_path = pg_catalog, pg_temp
AS $$
BEGIN
    DELETE FROM tunnel.finding_sum;
    RETURN NULL;
END
$$;
COMMENT ON FUNCTION tunnel.forget_findings() IS
'Trigger on tunnel.finding: where it is emptied at once, so are the sums of findings';
CREATE TRIGGER count_truncate AFTER TRUNCATE ON tunnel.finding FOR EACH STATEMENT EXECUTE FUNCTION tunnel.forget_findings();
