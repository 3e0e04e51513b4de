-- Views of what is darker than dry lining. A leak on a vertical wall has no area in plan, so there are three geometries,
-- each with a view of its own for QGIS: unrolled (chainage, arc; SRID 0), on the map beside the axis, and in space.
-- Views named leak hold the wet ones: of kind leak, and drips that people drew. What is merged into another, the same as what a
-- person drew, or taken away by a dry region is in views/finding.sql alone. Needs stationing
-- (geometry/stationing.sql) and make_geometry_views (views/geometry.sql).

-- What each reason adds to the logarithm of the odds of a leak, the strongest first, as "faint +2.3, rectangular -1.2".
CREATE OR REPLACE FUNCTION tunnel_internal.evidence_text(evidence jsonb) RETURNS text
LANGUAGE sql IMMUTABLE STRICT PARALLEL SAFE SET search_path = pg_catalog, pg_temp AS $$
    SELECT string_agg(e.key || ' ' || to_char(e.value::numeric, 'FMSG990.0'), ', ' ORDER BY abs(e.value::numeric) DESC, e.key)
      FROM jsonb_each_text($1) e WHERE abs(e.value::numeric) >= 0.05
$$;
COMMENT ON FUNCTION tunnel_internal.evidence_text(jsonb) IS
    'What speaks for a leak and against it, in words: logarithms of odds by reason, the strongest first';

CREATE OR REPLACE VIEW tunnel_api.anomaly AS
SELECT a.id, a.survey_id, s.name AS survey, a.km,
       (SELECT min(g.n) FROM tunnel.segment g
         WHERE g.survey_id = a.survey_id AND g.n BETWEEN m.near - 2 AND m.near + 2
           AND m.chainage BETWEEN g.chainage_from AND g.chainage_to) AS segment,
       a.chainage_from, a.chainage_to,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, m.chainage) l) AS label,
       a.arc_from, a.arc_to, a.clock,
       coalesce(a.judged, a.kind) AS kind, a.kind AS found, a.reasons, a.confidence, a.contrast,
       a.area, a.drop_mean, a.drop_max, a.image_share,
       a.review, a.reviewed_by, a.reviewed_at, a.remark, a.detected, a.created_at, a.detected_at,
       a.detected AND a.review <> 'rejected' AS counted,
       tunnel_internal.evidence_text(a.evidence) AS evidence, a.model, a.wet, a.origin,
       a.unrolled::public.geometry(Polygon, 0) AS unrolled,
       a.map::public.geometry AS map,
       a.surface::public.geometry AS surface
  FROM tunnel.anomaly a
  JOIN tunnel.survey s ON s.id = a.survey_id
  JOIN tunnel.tunnel t ON t.id = s.tunnel_id
 CROSS JOIN LATERAL (SELECT (a.chainage_from + a.chainage_to) / 2 AS chainage,
                            floor((a.chainage_from + a.chainage_to) / 2 / t.spacing)::integer AS near) m
 WHERE NOT a.aside AND (a.wet OR a.kind IN ('leak', 'joint', 'dark'));

CREATE OR REPLACE VIEW tunnel_api.leak AS SELECT * FROM tunnel_api.anomaly WHERE wet;

COMMENT ON VIEW tunnel_api.anomaly IS
    'What is darker than dry lining or was drawn as wet, with three geometries: leaks, joints, other dark spots; review, remark and kind can be updated';
COMMENT ON VIEW tunnel_api.leak IS 'Water leaks: anomalies that are wet, detected and drawn, with their three geometries; review, remark and kind can be updated';

CREATE OR REPLACE VIEW tunnel_api.anomaly_evidence AS
SELECT a.id * 100 + e.n AS id, a.id AS anomaly_id, a.survey_id, s.name AS survey, e.reason, e.log_odds
  FROM tunnel.anomaly a
  JOIN tunnel.survey s ON s.id = a.survey_id
 CROSS JOIN LATERAL (SELECT v.key AS reason, v.value::double precision AS log_odds, row_number() OVER (ORDER BY v.key) AS n
                       FROM jsonb_each_text(a.evidence) v) e;
COMMENT ON VIEW tunnel_api.anomaly_evidence IS 'What speaks for each anomaly being a leak and against it: a row for each reason';
COMMENT ON COLUMN tunnel_api.anomaly_evidence.anomaly_id IS 'Its id in the view anomaly';
COMMENT ON COLUMN tunnel_api.anomaly_evidence.reason IS 'What was measured: faint, thin, rectangular, …';
COMMENT ON COLUMN tunnel_api.anomaly_evidence.log_odds IS 'What it adds to the logarithm of the odds of a leak; negative: against one';

-- The comments on the columns of both, and their views of one geometry.
DO $$
DECLARE
    comment record;
BEGIN
    FOR comment IN SELECT c.relname AS view, a.attname AS "column", t.text FROM (VALUES
        ('segment', 'Number of the segment that holds its middle'),
        ('label', 'Station of its middle, as 12+345.678'),
        ('chainage_from', 'Least chainage, m'),
        ('chainage_to', 'Greatest chainage, m'),
        ('arc_from', 'Least arc, m from the crown, positive right looking up-chainage'),
        ('arc_to', 'Greatest arc, m'),
        ('clock', 'Clock position of the middle, hours: 12 is the crown, 3 the right wall looking up-chainage'),
        ('kind', 'leak, joint or dark (dark but dry), or another of finding_kind: as an inspector judged it, else as found'),
        ('found', 'What detection takes it for'),
        ('reasons', 'Why detection takes it for that'),
        ('confidence', 'How sure detection is of that, 0-1; NULL from before there were kinds'),
        ('contrast', 'Mean drop in standard deviations of the dry lining about it; NULL from before there were kinds'),
        ('area', 'Area on the lining, m²'),
        ('drop_mean', 'Mean drop of corrected intensity below dry lining, dB; NULL until what was drawn is measured'),
        ('drop_max', 'Greatest drop of corrected intensity below dry lining, dB; NULL until then'),
        ('image_share', 'Share of the polygon on which the image holds measurements, 0-1; NULL until then'),
        ('review', 'open, confirmed or rejected'),
        ('reviewed_by', 'Who reviewed or judged it last, set by the database'),
        ('reviewed_at', 'When it was reviewed or judged last, set by the database'),
        ('remark', 'The reviewer''s remark'),
        ('detected', 'False when the last detection found it no more (kept for its review)'),
        ('counted', 'Whether sums count it: found last, and not rejected'),
        ('wet', 'Whether its kind counts as wet: those are in the views of leaks'),
        ('origin', 'How its outline came about: detected, drawn, redrawn, split or merged (lining_finding has more of it)'),
        ('evidence', 'What speaks for a leak (+) and against it (-): logarithms of odds by reason, the strongest first; NULL from before'),
        ('model', 'Version of the model of evidence that judged it; NULL from before')) AS t (name, text)
      JOIN pg_attribute a ON a.attname = t.name AND a.attnum > 0
      JOIN pg_class c ON c.oid = a.attrelid
     WHERE c.relnamespace = 'tunnel_api'::regnamespace AND c.relkind = 'v' AND c.relname IN ('anomaly', 'leak')
    LOOP
        EXECUTE format('COMMENT ON COLUMN tunnel_api.%I.%I IS %L', comment.view, comment."column", comment.text);
    END LOOP;
END
$$;

CALL tunnel_internal.make_geometry_views('anomaly', 'anomaly', 'Anomalies', '; review, remark and kind can be updated');
CALL tunnel_internal.make_geometry_views('leak', 'leak', 'Leaks', '; review, remark and kind can be updated');
