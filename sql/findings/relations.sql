-- Relations between findings: same area, excluded by a dry region; and sums of findings.

-- Relations "same" between wet findings near a place of the unrolled plane. A detected finding is the same as what a person drew,
-- redrew, split or merged if these together cover at least half of it: the drawn outline counts, also if it is rejected. A drawn
-- finding is the same as a detected one that covers at least half of it and is much larger: the detected one counts, unless it is
-- rejected. Lines and points have no area of their own and are never the same.
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

-- A detected leak lies in a dry region if at least half of its area does; redrawn, split and merged leaks, too. A region that waits
-- for the approval of an operator has no effect. A finding that is no longer a leak lies in no region.
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

-- Consequences of a change of findings for other findings.
CREATE OR REPLACE FUNCTION tunnel_internal.settle_findings(survey_id int, place geometry) RETURNS void
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT SET search_path = pg_catalog, pg_temp AS $$
BEGIN
    PERFORM tunnel_internal.link_findings(survey_id, place);
    PERFORM tunnel_internal.mark_dry(survey_id, place);
END
$$;
COMMENT ON FUNCTION tunnel_internal.settle_findings(int, geometry) IS
'Update the relations between findings of a survey near a place (unrolled plane): link_findings and mark_dry. Called after each change of an outline, a kind or a review, and by detection';

-- Each change of findings adds rows to their sums; this combines them to one row for each sum. Concurrent callers skip each
-- other's rows.
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
