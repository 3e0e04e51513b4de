-- Waterproofing of each kilometre. Needs stretch_statistics (leaks/statistics.sql). The statistics of a kilometre are kept
-- (tunnel.waterproof) for who asks of all of a long tunnel.
--
-- Whoever changes leaks or coverage adds a note, a row without statistics, for each kilometre that he touches, in the same
-- transaction (triggers of schema tunnel). At its end the notes are replaced, and what was kept before, by new statistics; in
-- one statement, so that these know of all that the replaced rows stand for. Statistics are therefore right for whoever sees
-- their row and no other of its kilometre: any change that they do not know of has left a note, or statistics of its own, that
-- nobody has replaced. Nobody waits for anybody: what somebody else is just replacing is left alone, and then two rows are left,
-- of which none is believed until the next change. What is not kept is worked out when it is asked for.

CREATE OR REPLACE VIEW tunnel_api.km_waterproof AS
SELECT s.id::bigint * 1000000 + 500000 + k.km AS id, s.id AS survey_id, s.name AS survey, k.km,
       k.chainage_from, k.chainage_to, t.lining_area, t.seen_share, t.wet_area, t.wet_ratio, t.patches, t.largest_area,
       t.largest_leak, t.window_patches, t.window_from, t.window_to, t.window_wet_area, t.class,
       t.undecided_area, t.class_if_wet
  FROM tunnel.survey s
  CROSS JOIN LATERAL (SELECT e.* FROM tunnel_internal.km_ends e WHERE e.survey_id = s.id OFFSET 0) k  -- of this survey, not of all
  LEFT JOIN LATERAL (
        SELECT p.* FROM tunnel.waterproof p
         WHERE p.survey_id = s.id AND p.km = k.km AND p.chainage_from = k.chainage_from AND p.chainage_to = k.chainage_to
           AND NOT EXISTS (SELECT FROM tunnel.waterproof o WHERE o.survey_id = s.id AND o.km = k.km AND o.id <> p.id)
         LIMIT 1) w ON true
 CROSS JOIN LATERAL (
        SELECT w.lining_area, w.seen_share, w.wet_area, w.wet_ratio, w.patches, w.largest_area, w.largest_leak,
               w.window_patches, w.window_from, w.window_to, w.window_wet_area, w.class, w.undecided_area, w.class_if_wet
         WHERE w.id IS NOT NULL
         UNION ALL
        SELECT f.lining_area, f.seen_share, f.wet_area, f.wet_ratio, f.patches, f.largest_area, f.largest_leak,
               f.window_patches, f.window_from, f.window_to, f.window_wet_area, f.class, f.undecided_area, f.class_if_wet
          FROM tunnel_internal.stretch_statistics(s.id, ARRAY[k.chainage_from], ARRAY[k.chainage_to]) f
         WHERE w.id IS NULL) t;
COMMENT ON VIEW tunnel_api.km_waterproof IS
    'Waterproofing of each kilometre by GB 50108-2008, as far as a scan can check it: see leak_statistics and waterproof_class';
COMMENT ON COLUMN tunnel_api.km_waterproof.lining_area IS 'Lining, inspected or not, m²';
COMMENT ON COLUMN tunnel_api.km_waterproof.seen_share IS 'Inspected share of the lining; the rest cannot be certified';
COMMENT ON COLUMN tunnel_api.km_waterproof.wet_area IS
    'Area of the leaks within the kilometre, m²; a leak across a kilometre boundary counts in part';
COMMENT ON COLUMN tunnel_api.km_waterproof.wet_ratio IS 'wet_area / inspected lining';
COMMENT ON COLUMN tunnel_api.km_waterproof.patches IS
    'Number of leaks in the kilometre or across its boundaries; NULL if it was not searched';
COMMENT ON COLUMN tunnel_api.km_waterproof.largest_area IS
    'Area of the largest leak, including parts beyond the kilometre, m²';
COMMENT ON COLUMN tunnel_api.km_waterproof.largest_leak IS 'Id of the largest leak';
COMMENT ON COLUMN tunnel_api.km_waterproof.window_patches IS 'Largest number of leaks in any 100 m² of lining';
COMMENT ON COLUMN tunnel_api.km_waterproof.window_from IS 'Chainage at which those 100 m² begin, m';
COMMENT ON COLUMN tunnel_api.km_waterproof.window_to IS 'Chainage at which those 100 m² end, m';
COMMENT ON COLUMN tunnel_api.km_waterproof.window_wet_area IS 'Largest wet area in any 100 m² of lining, m²';
COMMENT ON COLUMN tunnel_api.km_waterproof.class IS
    'Best class that the inspected lining meets; NULL if nothing was inspected';
COMMENT ON COLUMN tunnel_api.km_waterproof.undecided_area IS
    'Dark bands that may be wet or dirty (dark_band), m²';
COMMENT ON COLUMN tunnel_api.km_waterproof.class_if_wet IS 'Best class if those bands are wet';

-- Compute the statistics of a kilometre and store them, replacing its marks and old values. An error is reported as a warning
-- and does not prevent the change that caused the call. A kilometre without segments, or whose segments extend beyond its
-- ends (leaks out there are marked elsewhere), is not stored: a row with NaN ends replaces its marks.
CREATE OR REPLACE FUNCTION tunnel_internal.keep_waterproof(survey_id int, km int) RETURNS void
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := survey_id;
    kilometre constant int := km;
BEGIN
    WITH gone AS (
        DELETE FROM tunnel.waterproof w
         WHERE w.id IN (SELECT o.id FROM tunnel.waterproof o WHERE o.survey_id = survey_key AND o.km = kilometre
                           FOR UPDATE SKIP LOCKED)
    )
    INSERT INTO tunnel.waterproof (survey_id, km, chainage_from, chainage_to, lining_area, seen_share, wet_area, wet_ratio,
        patches, largest_area, largest_leak, window_patches, window_from, window_to, window_wet_area, class,
        undecided_area, class_if_wet)
    SELECT survey_key, kilometre, coalesce(f.chainage_from, 'NaN'), coalesce(f.chainage_to, 'NaN'), f.lining_area, f.seen_share,
        f.wet_area, f.wet_ratio, f.patches, f.largest_area, f.largest_leak, f.window_patches, f.window_from, f.window_to,
        f.window_wet_area, f.class, f.undecided_area, f.class_if_wet
      FROM (SELECT) one
      LEFT JOIN (
        SELECT t.*
          FROM tunnel_internal.km_ends k
         CROSS JOIN LATERAL tunnel_internal.stretch_statistics(survey_key, ARRAY[k.chainage_from], ARRAY[k.chainage_to]) t
         WHERE k.survey_id = survey_key AND k.km = kilometre
           AND k.chainage_from > kilometre * 1000 - 0.01 AND k.chainage_to < (kilometre + 1) * 1000 + 0.01) f ON true;
EXCEPTION
    WHEN OTHERS THEN
        RAISE WARNING 'the waterproofing of kilometre % of survey % is not kept: %', kilometre, survey_key, SQLERRM;
        DELETE FROM tunnel.waterproof w
         WHERE w.id IN (SELECT o.id FROM tunnel.waterproof o WHERE o.survey_id = survey_key AND o.km = kilometre
                           FOR UPDATE SKIP LOCKED);
        INSERT INTO tunnel.waterproof (survey_id, km, chainage_from, chainage_to) VALUES (survey_key, kilometre, 'NaN', 'NaN');
END
$$;
COMMENT ON FUNCTION tunnel_internal.keep_waterproof(int, int) IS
'Store the statistics of a kilometre so that the view km_waterproof is fast; the view is correct without it. Called at the end of each transaction that changes leaks or coverage, and by tunneldb init';

-- At the end of a transaction, once for each kilometre: the first call removes the marks of the others. Under an isolation
-- level stricter than read committed this would make transactions fail that only read each other's kilometres, so nothing is
-- stored there.
CREATE OR REPLACE FUNCTION tunnel_internal.keep_at_commit() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
BEGIN
    IF current_setting('transaction_isolation') = 'read committed'
       AND EXISTS (SELECT FROM tunnel.waterproof w WHERE w.id = NEW.id) THEN
        PERFORM tunnel_internal.keep_waterproof(NEW.survey_id, NEW.km);
    END IF;
    RETURN NULL;
END
$$;
COMMENT ON FUNCTION tunnel_internal.keep_at_commit() IS
    'Trigger of tunnel.waterproof: store the statistics of a changed kilometre';

DROP TRIGGER IF EXISTS keep ON tunnel.waterproof;
CREATE CONSTRAINT TRIGGER keep AFTER INSERT ON tunnel.waterproof DEFERRABLE INITIALLY DEFERRED
    FOR EACH ROW WHEN (NEW.chainage_from IS NULL) EXECUTE FUNCTION tunnel_internal.keep_at_commit();

-- Kilometres of a survey without valid stored statistics: tunneldb init computes them, each in a transaction of its own.
-- Kilometres that are never stored (NaN) are left out until something changes.
CREATE OR REPLACE FUNCTION tunnel_internal.waterproof_unkept(survey_id int) RETURNS SETOF int
LANGUAGE sql STABLE STRICT PARALLEL SAFE SECURITY DEFINER ROWS 25 SET search_path = pg_catalog, pg_temp
AS $$
    SELECT k.km
      FROM tunnel_internal.km_ends k
     CROSS JOIN LATERAL (
            SELECT count(*) AS rows, min(w.chainage_from) AS chainage_from, min(w.chainage_to) AS chainage_to
              FROM tunnel.waterproof w WHERE w.survey_id = $1 AND w.km = k.km) w
     WHERE k.survey_id = $1
       AND (w.rows <> 1 OR w.chainage_from IS NULL
            OR w.chainage_from <> 'NaN' AND (w.chainage_from <> k.chainage_from OR w.chainage_to <> k.chainage_to))
     ORDER BY k.km
$$;
COMMENT ON FUNCTION tunnel_internal.waterproof_unkept(int) IS
'Kilometres of a survey whose statistics are not stored or out of date; the view km_waterproof computes them at each query. tunneldb init stores them';
