-- Statistics of waterproofing hold until a leak or the lining of their kilometre changes: triggers note each change.

-- A note a kilometre, by whoever changes something, in the same transaction: new rows only, so that nobody waits for anybody. A
-- survey that is being deleted takes its notes along.
CREATE FUNCTION tunnel.note_finding() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SET search_path = pg_catalog, pg_temp
AS $$
BEGIN
    INSERT INTO tunnel.waterproof (survey_id, km)
    SELECT DISTINCT c.survey_id, k.km
      FROM changed c
      JOIN tunnel.survey s ON s.id = c.survey_id
     CROSS JOIN generate_series(
            floor((c.chainage_from - 0.01) / 1000)::int, floor((c.chainage_to + 0.01) / 1000)::int) AS k (km);
    RETURN NULL;
END
$$;
COMMENT ON FUNCTION tunnel.note_finding() IS
'Trigger on tunnel.finding: notes the kilometres that what changed reaches into';
CREATE TRIGGER note_insert AFTER INSERT ON tunnel.finding
    REFERENCING NEW TABLE AS changed FOR EACH STATEMENT EXECUTE FUNCTION tunnel.note_finding();
CREATE TRIGGER note_delete AFTER DELETE ON tunnel.finding
    REFERENCING OLD TABLE AS changed FOR EACH STATEMENT EXECUTE FUNCTION tunnel.note_finding();

-- Most reviews confirm what was counted before: then the statistics hold.
CREATE FUNCTION tunnel.note_finding_update() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SET search_path = pg_catalog, pg_temp
AS $$
BEGIN
    INSERT INTO tunnel.waterproof (survey_id, km)
    WITH earlier AS MATERIALIZED (
        SELECT f.id, f.survey_id, f.chainage_from, f.chainage_to, f.detected, f.area, f.unrolled::bytea AS shape
          FROM old_rows f WHERE f.wet AND f.review <> 'rejected' AND NOT f.superseded
    ), later AS MATERIALIZED (
        SELECT f.id, f.survey_id, f.chainage_from, f.chainage_to, f.detected, f.area, f.unrolled::bytea AS shape
          FROM new_rows f WHERE f.wet AND f.review <> 'rejected' AND NOT f.superseded
    ), changed AS (
        (TABLE earlier EXCEPT TABLE later) UNION ALL (TABLE later EXCEPT TABLE earlier)
    )
    SELECT DISTINCT c.survey_id, k.km
      FROM changed c
      JOIN tunnel.survey s ON s.id = c.survey_id
     CROSS JOIN generate_series(
            floor((c.chainage_from - 0.01) / 1000)::int, floor((c.chainage_to + 0.01) / 1000)::int) AS k (km);
    RETURN NULL;
END
$$;
COMMENT ON FUNCTION tunnel.note_finding_update() IS
'Trigger on tunnel.finding: notes the kilometres of wet findings that began or ceased to count, or changed their place';
CREATE TRIGGER note_update AFTER UPDATE ON tunnel.finding
    REFERENCING OLD TABLE AS old_rows NEW TABLE AS new_rows FOR EACH STATEMENT EXECUTE FUNCTION tunnel.note_finding_update();

CREATE FUNCTION tunnel.note_coverage() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SET search_path = pg_catalog, pg_temp
AS $$
BEGIN
    INSERT INTO tunnel.waterproof (survey_id, km)
    SELECT c.survey_id, c.km FROM changed c JOIN tunnel.survey s ON s.id = c.survey_id;
    RETURN NULL;
END
$$;
COMMENT ON FUNCTION tunnel.note_coverage() IS 'Trigger on tunnel.coverage: notes the kilometres whose lining changed';
CREATE TRIGGER note_insert AFTER INSERT ON tunnel.coverage
    REFERENCING NEW TABLE AS changed FOR EACH STATEMENT EXECUTE FUNCTION tunnel.note_coverage();
CREATE TRIGGER note_update_old AFTER UPDATE ON tunnel.coverage
    REFERENCING OLD TABLE AS changed FOR EACH STATEMENT EXECUTE FUNCTION tunnel.note_coverage();
CREATE TRIGGER note_update_new AFTER UPDATE ON tunnel.coverage
    REFERENCING NEW TABLE AS changed FOR EACH STATEMENT EXECUTE FUNCTION tunnel.note_coverage();
CREATE TRIGGER note_delete AFTER DELETE ON tunnel.coverage
    REFERENCING OLD TABLE AS changed FOR EACH STATEMENT EXECUTE FUNCTION tunnel.note_coverage();

CREATE FUNCTION tunnel.forget_waterproof() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SET search_path = pg_catalog, pg_temp
AS $$
BEGIN
    BEGIN
        TRUNCATE tunnel.waterproof;
    EXCEPTION
        WHEN object_in_use THEN  -- it is being emptied with the others, or changes in them are still to be worked out
            DELETE FROM tunnel.waterproof;
    END;
    RETURN NULL;
END
$$;
COMMENT ON FUNCTION tunnel.forget_waterproof() IS
'Trigger on tunnel.finding and tunnel.coverage: where they are emptied at once, what is kept of their kilometres goes, too';
CREATE TRIGGER note_truncate AFTER TRUNCATE ON tunnel.finding
    FOR EACH STATEMENT EXECUTE FUNCTION tunnel.forget_waterproof();
CREATE TRIGGER note_truncate AFTER TRUNCATE ON tunnel.coverage
    FOR EACH STATEMENT EXECUTE FUNCTION tunnel.forget_waterproof();
