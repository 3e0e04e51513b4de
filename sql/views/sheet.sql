-- Sheets on which a survey is drawn and printed: 50 m of tunnel each, as the blocks of its images. Needs stationing
-- (geometry/stationing.sql).

-- Joints and dry dark areas are numerous: sheets show them only if people redrew them or gave them a severity. Leaks have the
-- table of leaks (sheet_leak); their severities are drawn, and drips as points.
CREATE OR REPLACE VIEW tunnel_api.sheet_finding AS
SELECT f.id, f.survey_id, f.survey, f.km, f.chainage_from, f.chainage_to, f.label, f.arc_from, f.arc_to, f.clock,
       f.kind, f.kind_label, k.position, f.wet, f.origin, f.manual, f.severity, f.severity_label, f.width_mm, f.length, f.area,
       f.counted, f.state, f.remark, p.shown, p.shown AND NOT f.wet AS listed, f.geom
  FROM tunnel_api.finding_unrolled f
  LEFT JOIN tunnel.finding_kind k ON k.code = f.kind
 CROSS JOIN LATERAL (
        SELECT f.counted AND (f.origin <> 'detected' OR f.severity IS NOT NULL
                              OR f.kind NOT IN ('leak', 'joint', 'dark')) AS shown) p;
COMMENT ON VIEW tunnel_api.sheet_finding IS
    'Findings as drawn and listed on sheets: drawn by people, or given a kind or a severity by people';
COMMENT ON COLUMN tunnel_api.sheet_finding.position IS 'Position of its kind in lists';
COMMENT ON COLUMN tunnel_api.sheet_finding.shown IS 'True if it is drawn as a finding: it counts, and people edited it';
COMMENT ON COLUMN tunnel_api.sheet_finding.listed IS 'True if it is in the table of findings: those shown that are not wet';
COMMENT ON COLUMN tunnel_api.sheet_finding.geom IS 'Polygon, line or point in the unrolled plane (chainage, arc), m';

CREATE OR REPLACE VIEW tunnel_api.sheet_leak AS
SELECT l.id, l.survey_id, l.survey, l.km, l.chainage_from, l.chainage_to, l.label, l.arc_from, l.arc_to, l.clock, l.kind,
       l.area, l.darkening_mean, CASE WHEN l.kind = l.kind_detected THEN l.confidence END AS confidence, l.review, l.remark, l.detected,
       concat_ws('; ', nullif(concat_ws(', ', CASE WHEN l.kind <> 'leak' THEN k.label END, v.label), ''), nullif(l.remark, ''))
           AS note,
       l.geom
  FROM tunnel_api.leak_unrolled l
  JOIN tunnel.finding a ON a.id = l.id
  LEFT JOIN tunnel.finding_kind k ON k.code = l.kind
  LEFT JOIN tunnel.severity v ON v.id = a.severity;
COMMENT ON VIEW tunnel_api.sheet_leak IS 'Leaks as drawn and listed on sheets';
COMMENT ON COLUMN tunnel_api.sheet_leak.note IS
    'Kind, unless it is leak, severity in the owner''s words, and remark; empty if there are none';
COMMENT ON COLUMN tunnel_api.sheet_leak.geom IS 'Polygon in the unrolled plane (chainage, arc), m';

-- All sheets of a survey have the width of its widest section, for a common scale. Each section counts as the median of
-- itself and its neighbours, so that a single wrong one (e.g. at a portal) does not enlarge all sheets. Statistics are joined
-- so that the planner can omit them for drawing. Gaps and notes are computed for all sheets of a survey at once, which costs
-- no more than for one.
CREATE OR REPLACE VIEW tunnel_api.sheet AS
SELECT s.id::bigint * 1000000 + 500000 + r.number AS id, s.id AS survey_id, s.name AS survey, r.number, b.km,
       b.chainage_from, b.chainage_to, k.labels[1] AS label_from, k.labels[6] AS label_to, k.labels AS ticks,
       c.lining AS lining_area, c.seen / nullif(c.lining, 0) AS seen_share, l.wet_area, l.leaks,
       w.said[array_position(w.places, r.place::integer)] AS gaps,
       y.said[array_position(y.places, r.place::integer)] AS remarks, f.findings, f.left_out,
       public.st_makeenvelope(b.chainage_from, a.arc_from, b.chainage_to, a.arc_to, 0)::public.geometry(Polygon, 0) AS geom
  FROM tunnel.survey s
 CROSS JOIN LATERAL (
        SELECT min(least(greatest(q.left_end, q.left_before), greatest(q.left_end, q.left_after),
                         greatest(q.left_before, q.left_after))) AS arc_from,
               max(greatest(least(q.right_end, q.right_before), least(q.right_end, q.right_after),
                            least(q.right_before, q.right_after))) AS arc_to
          FROM (SELECT e.left_end, e.right_end,
                       coalesce(lag(e.left_end) OVER w, lead(e.left_end) OVER w) AS left_before,
                       coalesce(lead(e.left_end) OVER w, lag(e.left_end) OVER w) AS left_after,
                       coalesce(lag(e.right_end) OVER w, lead(e.right_end) OVER w) AS right_before,
                       coalesce(lead(e.right_end) OVER w, lag(e.right_end) OVER w) AS right_after
                  FROM (SELECT t.chainage, t.arc[1] AS left_end, t.arc[361] AS right_end
                          FROM (SELECT q.chainage, q.arc[:] AS arc  -- [:] takes it out of its storage once
                                  FROM tunnel.section q WHERE q.survey_id = s.id OFFSET 0) t OFFSET 0) e
                WINDOW w AS (ORDER BY e.chainage)) q) a
 CROSS JOIN LATERAL tunnel_api.survey_ends(s.id) e
 CROSS JOIN LATERAL (
        SELECT array_agg(q.number) AS numbers, array_agg(r.chainage_from) AS starts, array_agg(r.chainage_to) AS ends
          FROM (  -- a survey that ends some centimetres into the next sheet has none for them, unless it leaks there
                SELECT i AS number
                  FROM (SELECT q.chainage_from, q.chainage_to FROM tunnel.segment q WHERE q.survey_id = s.id
                         UNION ALL  -- a kilometre without segments has empty ones, which say so
                        SELECT k.chainage_from, k.chainage_to FROM tunnel_internal.km_ends k
                         WHERE k.survey_id = s.id
                           AND NOT EXISTS (SELECT FROM tunnel.segment q WHERE q.survey_id = k.survey_id AND q.km = k.km)) g
                 CROSS JOIN generate_series(floor(g.chainage_from / 50)::integer, ceil(g.chainage_to / 50)::integer - 1) AS i
                 GROUP BY i
                HAVING sum(least(g.chainage_to, e.chainage_to, (i + 1) * 50) - greatest(g.chainage_from, e.chainage_from, i * 50))
                           >= 1
                    OR EXISTS (SELECT FROM tunnel.finding x
                                WHERE x.survey_id = s.id AND x.detected AND x.review <> 'rejected' AND x.wet AND NOT x.superseded
                                  AND x.unrolled OPERATOR(public.&&) public.st_makeenvelope(i * 50, -1e4, (i + 1) * 50, 1e4)
                                  AND x.chainage_to > greatest(e.chainage_from, i * 50)
                                  AND x.chainage_from < least(e.chainage_to, (i + 1) * 50))) q
         CROSS JOIN LATERAL (  -- as far as the survey reaches
                SELECT f.chainage_from, greatest(least((q.number + 1) * 50, e.chainage_to), f.chainage_from) AS chainage_to
                  FROM (SELECT least(greatest(q.number * 50, e.chainage_from), (q.number + 1) * 50) AS chainage_from) f) r) h
  LEFT JOIN LATERAL (
        SELECT array_agg(q.n) AS places, array_agg(q.said) AS said
          FROM tunnel_internal.coverage_statements(s.id, h.starts, h.ends) q) w ON true
  LEFT JOIN LATERAL (
        SELECT array_agg(q.n) AS places, array_agg(q.said) AS said
          FROM tunnel_internal.remark_statements(s.id, h.starts, h.ends) q) y ON true
 CROSS JOIN LATERAL unnest(h.numbers, h.starts, h.ends) WITH ORDINALITY AS r (number, chainage_from, chainage_to, place)
 CROSS JOIN LATERAL (
        SELECT r.number * 50::float8 AS chainage_from, (r.number + 1) * 50::float8 AS chainage_to,
               floor(r.number / 20.0)::integer AS km) b
  LEFT JOIN LATERAL (
        SELECT array_agg(regexp_replace(t.label, '\.0+$', '') ORDER BY i) AS labels
          FROM generate_series(0, 5) AS i
         CROSS JOIN LATERAL tunnel_api.stationing(s.tunnel_id, b.chainage_from + 10 * i) t) k ON true
  LEFT JOIN LATERAL (
        SELECT sum(v.lining::float8) AS lining, sum(v.seen::float8) AS seen
          FROM tunnel.coverage q
         CROSS JOIN LATERAL (
                SELECT round((r.chainage_from - b.km * 1000) / q.step)::integer + 1 AS first,
                       round((r.chainage_to - b.km * 1000) / q.step)::integer AS last) p
         CROSS JOIN LATERAL unnest(q.lining[p.first:p.last], q.seen[p.first:p.last]) AS v (lining, seen)
         WHERE q.survey_id = s.id AND q.km = b.km) c ON true
  LEFT JOIN LATERAL (
        SELECT CASE WHEN c.lining IS NOT NULL OR count(*) > 0 THEN count(*) END AS leaks,
               coalesce(sum(tunnel_internal.area_between(x.unrolled, x.area, r.chainage_from, r.chainage_to)),
                        CASE WHEN c.lining IS NOT NULL THEN 0 END) AS wet_area
          FROM tunnel.finding x
         WHERE x.survey_id = s.id AND x.detected AND x.review <> 'rejected' AND x.wet AND NOT x.superseded
           AND x.unrolled OPERATOR(public.&&) public.st_makeenvelope(b.chainage_from, -1e4, b.chainage_to, 1e4)
           AND x.chainage_to > r.chainage_from AND x.chainage_from < r.chainage_to) l ON true
  LEFT JOIN LATERAL (
        SELECT sum(t.findings) FILTER (WHERE t.listed)::bigint AS findings,
               string_agg(t.findings || ' ' || t.state, ', ' ORDER BY t.state)
                   FILTER (WHERE t.state IN ('rejected', 'merged', 'same', 'dry')) AS left_out
          FROM (SELECT q.state, q.listed, count(*) AS findings
                  FROM tunnel.finding x
                  JOIN tunnel_api.sheet_finding q ON q.id = x.id
                 WHERE x.survey_id = s.id
                   AND x.unrolled OPERATOR(public.&&) public.st_makeenvelope(b.chainage_from, -1e4, b.chainage_to, 1e4)
                   AND x.chainage_to > b.chainage_from AND x.chainage_from < b.chainage_to
                 GROUP BY q.state, q.listed) t) f ON true
 WHERE a.arc_from IS NOT NULL;
COMMENT ON VIEW tunnel_api.sheet IS
    'Sheets of 50 m for drawings of a survey: rectangles of the unrolled plane (chainage, arc), SRID 0';
COMMENT ON COLUMN tunnel_api.sheet.number IS 'floor(chainage / 50), as in the blocks of the images';
COMMENT ON COLUMN tunnel_api.sheet.ticks IS 'Stations each 10 m from its beginning to its end, as 12+350';
COMMENT ON COLUMN tunnel_api.sheet.lining_area IS 'Lining, inspected or not, m²; NULL before detection';
COMMENT ON COLUMN tunnel_api.sheet.seen_share IS
    'Inspected share of the lining, as in leak_statistics; leaks are searched for on the inspected lining only';
COMMENT ON COLUMN tunnel_api.sheet.wet_area IS
    'Area of the leaks within the sheet, m²; a leak across its edge counts in part';
COMMENT ON COLUMN tunnel_api.sheet.leaks IS
    'Number of leaks on the sheet or across its edges. Rejected leaks and leaks that the last detection did not find are left out. NULL if it was not searched';
COMMENT ON COLUMN tunnel_api.sheet.gaps IS
    'Stretches where leaks could be missed (coverage_statement); NULL if there are none';
COMMENT ON COLUMN tunnel_api.sheet.remarks IS 'Notes on the results (remark_statement); NULL if there are none';
COMMENT ON COLUMN tunnel_api.sheet.findings IS
    'Number of findings in its table (sheet_finding, listed), besides leaks; NULL if there are none';
COMMENT ON COLUMN tunnel_api.sheet.left_out IS
    'Number of findings, including leaks, that do not count and are not drawn: rejected, merged, same, dry; NULL if there are none';
COMMENT ON COLUMN tunnel_api.sheet.geom IS 'Rectangle over the full width of the survey';
