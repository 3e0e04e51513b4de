-- Elements of tunnels, and their ratings by owners' schemes. Needs coverage_at (leaks/coverage.sql), survey_ends
-- (geometry/survey_ends.sql) and stationing (geometry/stationing.sql).

CREATE OR REPLACE VIEW tunnel_api.element AS
SELECT e.id, t.id AS tunnel_id, t.name AS tunnel, d.name AS element_set, d.source, e.number, e.name, e.chainage_from, e.chainage_to,
       tunnel_api.station_label(t.id, e.chainage_from) AS label_from, tunnel_api.station_label(t.id, e.chainage_to) AS label_to,
       e.clock_from, e.clock_to
  FROM tunnel.element e
  JOIN tunnel.element_set d ON d.id = e.element_set_id
  JOIN tunnel.tunnel t ON t.id = d.tunnel_id;
COMMENT ON VIEW tunnel_api.element IS
    'Elements of tunnels that are rated: rings, blocks, stretches or zones, written by tunneldb elements add';
COMMENT ON COLUMN tunnel_api.element.element_set IS 'Name of the division of the tunnel';
COMMENT ON COLUMN tunnel_api.element.source IS 'Source of the division: file, length, rings or joints';
COMMENT ON COLUMN tunnel_api.element.number IS 'Number in its division, from 1';
COMMENT ON COLUMN tunnel_api.element.name IS 'Name of the element';
COMMENT ON COLUMN tunnel_api.element.clock_from IS
    'Clock position at which it begins, clockwise looking up-chainage, hours; NULL: all round';
COMMENT ON COLUMN tunnel_api.element.clock_to IS 'Clock position at which it ends, hours';

CREATE OR REPLACE VIEW tunnel_api.rating_scheme AS
SELECT r.id, r.name, r.version, r.source, r.valid_from, r.results, r.min_inspected, r.totals, r.total_results, r.totals_inclusive,
       r.added_at, (SELECT count(*) FROM tunnel.rating_rule u WHERE u.scheme_id = r.id) AS rules
  FROM tunnel.rating_scheme r;
COMMENT ON VIEW tunnel_api.rating_scheme IS 'Schemes by which owners rate elements, written by tunneldb rating add';
COMMENT ON COLUMN tunnel_api.rating_scheme.version IS 'Version; a version is never changed';
COMMENT ON COLUMN tunnel_api.rating_scheme.source IS 'Directive or standard, in the owner''s words';
COMMENT ON COLUMN tunnel_api.rating_scheme.valid_from IS 'Date from which it is valid';
COMMENT ON COLUMN tunnel_api.rating_scheme.results IS 'Results from the best to the worst';
COMMENT ON COLUMN tunnel_api.rating_scheme.min_inspected IS 'Inspected share below which a result is a lower bound, 0 to 1';
COMMENT ON COLUMN tunnel_api.rating_scheme.totals IS
    'Limits of the sum of the rules'' points, ascending; NULL: the worst result of all rules is that of an element';
COMMENT ON COLUMN tunnel_api.rating_scheme.total_results IS 'Result at each total';
COMMENT ON COLUMN tunnel_api.rating_scheme.totals_inclusive IS 'True if a sum equal to a total reaches it';
COMMENT ON COLUMN tunnel_api.rating_scheme.rules IS 'Number of rules';

CREATE OR REPLACE VIEW tunnel_api.rating_rule AS
SELECT r.scheme_id::bigint * 1000 + r.number AS id, r.scheme_id, s.name AS scheme, s.version, r.number, r.text, r.kinds, r.measure,
       r.inclusive, r.limits, r.results, r.points, r.by_measure, r.by_kinds, r.by_inclusive, r.by_limits
  FROM tunnel.rating_rule r JOIN tunnel.rating_scheme s ON s.id = r.scheme_id;
COMMENT ON VIEW tunnel_api.rating_rule IS 'Rules of rating schemes: an element that reaches a limit has at least its result';
COMMENT ON COLUMN tunnel_api.rating_rule.scheme IS 'Name of the scheme';
COMMENT ON COLUMN tunnel_api.rating_rule.version IS 'Version of the scheme';
COMMENT ON COLUMN tunnel_api.rating_rule.number IS 'Number of the rule in its scheme, from 1';
COMMENT ON COLUMN tunnel_api.rating_rule.text IS 'Rule in the owner''s words';
COMMENT ON COLUMN tunnel_api.rating_rule.kinds IS 'Codes of the kinds of findings (finding_kind); empty: all wet ones';
COMMENT ON COLUMN tunnel_api.rating_rule.measure IS
    'area (m², sum), share (area over the inspected lining), largest_area (m²), length (m, sum), density_length (m per m² of inspected lining), width_mm (greatest), severity (greatest), count, or growth (m² of area per year since the earlier inspection)';
COMMENT ON COLUMN tunnel_api.rating_rule.inclusive IS 'True if a value equal to a limit reaches it';
COMMENT ON COLUMN tunnel_api.rating_rule.limits IS 'Limits in ascending order';
COMMENT ON COLUMN tunnel_api.rating_rule.results IS
    'Result at each limit; of a matrix, row by row, one row for each class of the measure, from below the first limit; empty if the rule has points';
COMMENT ON COLUMN tunnel_api.rating_rule.points IS 'Points at each limit, of a scheme with totals';
COMMENT ON COLUMN tunnel_api.rating_rule.by_measure IS 'Second measure of a matrix, whose classes are its columns';
COMMENT ON COLUMN tunnel_api.rating_rule.by_kinds IS 'Codes of the kinds of findings of the second measure; empty: all wet ones';
COMMENT ON COLUMN tunnel_api.rating_rule.by_inclusive IS 'True if a value equal to a limit of the second measure reaches it';
COMMENT ON COLUMN tunnel_api.rating_rule.by_limits IS 'Limits of the second measure in ascending order';

-- A zone between two clock positions is one rectangle of the unrolled plane, or two if it goes through 6 o'clock, where the plane
-- is cut. Its arcs are those of the section nearest to the element's middle.
CREATE OR REPLACE FUNCTION tunnel_internal.element_boxes(survey_id int, set_id int)
RETURNS TABLE (element_id int, low float8, high float8, arc_from float8, arc_to float8, girth_share float8)
LANGUAGE plpgsql STABLE STRICT PARALLEL SAFE SECURITY DEFINER ROWS 1000 SET search_path = pg_catalog, pg_temp SET jit = off
AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := survey_id;
    set_key constant int := set_id;
BEGIN
    RETURN QUERY
    WITH part AS MATERIALIZED (
        SELECT e.id, greatest(e.chainage_from, v.chainage_from) AS low, least(e.chainage_to, v.chainage_to) AS high,
               -- degrees clockwise from the crown, -180 to 180
               mod((e.clock_from * 30 + 180)::numeric, 360)::float8 - 180 AS begins,
               mod((e.clock_to * 30 + 180)::numeric, 360)::float8 - 180 AS ends
          FROM tunnel.element e CROSS JOIN tunnel_api.survey_ends(survey_key) v
         WHERE e.element_set_id = set_key AND e.chainage_to > v.chainage_from AND e.chainage_from < v.chainage_to
    ), middle AS MATERIALIZED (
        SELECT DISTINCT (p.low + p.high) / 2 AS chainage FROM part p WHERE p.begins IS NOT NULL
    ), curve AS MATERIALIZED (
        SELECT m.chainage, n.arc
          FROM middle m
         CROSS JOIN LATERAL (
               SELECT c.arc FROM (
                   (SELECT s.chainage, s.arc FROM tunnel.section s
                     WHERE s.survey_id = survey_key AND s.chainage <= m.chainage ORDER BY s.chainage DESC LIMIT 1)
                   UNION ALL
                   (SELECT s.chainage, s.arc FROM tunnel.section s
                     WHERE s.survey_id = survey_key AND s.chainage > m.chainage ORDER BY s.chainage LIMIT 1)) c
                ORDER BY abs(c.chainage - m.chainage) LIMIT 1) n
    ), zone AS (
        SELECT p.id, p.low, p.high, p.begins, p.ends, c.arc[1] AS first, c.arc[361] AS last,
               c.arc[round(p.begins)::int + 181] AS a, c.arc[round(p.ends)::int + 181] AS b
          FROM part p JOIN curve c ON c.chainage = (p.low + p.high) / 2
         WHERE p.begins IS NOT NULL
    ), box AS (
        SELECT p.id, p.low, p.high, '-infinity'::float8 AS arc_from, 'infinity'::float8 AS arc_to, 1::float8 AS share
          FROM part p WHERE p.begins IS NULL
        UNION ALL
        SELECT z.id, z.low, z.high, z.a, z.b, (z.b - z.a) / (z.last - z.first) FROM zone z WHERE z.begins < z.ends
        UNION ALL
        SELECT z.id, z.low, z.high, z.a, z.last, (z.last - z.a) / (z.last - z.first) FROM zone z WHERE z.begins > z.ends
        UNION ALL
        SELECT z.id, z.low, z.high, z.first, z.b, (z.b - z.first) / (z.last - z.first) FROM zone z WHERE z.begins > z.ends
    )
    SELECT b.id, b.low, b.high, b.arc_from, b.arc_to, b.share FROM box b WHERE b.arc_from < b.arc_to;
END
$$;
COMMENT ON FUNCTION tunnel_internal.element_boxes(int, int) IS
'Elements of a division in the unrolled plane of a survey: chainages and arcs (m), and share of the circumference. An element that goes through 6 o''clock has two rows; one outside the survey has none';

CREATE OR REPLACE FUNCTION tunnel_internal.element_extent(survey_id int, set_id int)
RETURNS TABLE (element_id int, lining float8, inspected_share float8)
LANGUAGE plpgsql STABLE STRICT PARALLEL SAFE SECURITY DEFINER ROWS 1000 SET search_path = pg_catalog, pg_temp SET jit = off
AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := survey_id;
    set_key constant int := set_id;
BEGIN
    RETURN QUERY
    WITH box AS MATERIALIZED (
        SELECT b.element_id, min(b.low) AS low, min(b.high) AS high, sum(b.girth_share) AS share
          FROM tunnel_internal.element_boxes(survey_key, set_key) b GROUP BY b.element_id
    ), place AS MATERIALIZED (
        SELECT array_agg(DISTINCT p.chainage) AS chainages FROM (SELECT b.low AS chainage FROM box b UNION SELECT b.high FROM box b) p
    ), sums AS MATERIALIZED (
        SELECT c.* FROM place CROSS JOIN LATERAL tunnel_internal.coverage_at(survey_key, place.chainages) c
    )
    SELECT e.id, coalesce((t.lining - f.lining) * b.share, 0),
           CASE WHEN t.length > f.length
                -- what of the element lies beyond the survey was not inspected either
                THEN (t.seen - f.seen) / nullif(t.lining - f.lining, 0) * least((t.length - f.length) / (e.chainage_to - e.chainage_from), 1)
                ELSE 0 END
      FROM tunnel.element e
      LEFT JOIN box b ON b.element_id = e.id
      LEFT JOIN sums f ON f.chainage = b.low
      LEFT JOIN sums t ON t.chainage = b.high
     WHERE e.element_set_id = set_key;
END
$$;
COMMENT ON FUNCTION tunnel_internal.element_extent(int, int) IS
'Lining of the elements of a division in a survey, searched for leaks, m², and its inspected share. The share is that of the stretch, all round: coverage is known by chainage only. 0 where leaks were not searched for';

CREATE OR REPLACE FUNCTION tunnel_internal.element_parts(survey_id int, set_id int)
RETURNS TABLE (element_id int, finding_id bigint, kind text, wet boolean, severity int, width_mm float8, area float8, part float8,
    length float8)
LANGUAGE plpgsql STABLE STRICT PARALLEL SAFE SECURITY DEFINER ROWS 10000 SET search_path = pg_catalog, pg_temp
SET jit = off
SET enable_nestloop = off  -- the number of rows is unknown at planning
SET enable_mergejoin = off
AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := survey_id;
    set_key constant int := set_id;
    cell constant float8 := 20;  -- m: pairs are sought by equal cells of this length
    first constant float8 := (SELECT min(e.chainage_from) FROM tunnel.element e WHERE e.element_set_id = set_key);
    last constant float8 := (SELECT max(e.chainage_to) FROM tunnel.element e WHERE e.element_set_id = set_key);
    longest constant float8 := (
        SELECT coalesce(max(f.chainage_to - f.chainage_from), 0) FROM tunnel.finding f WHERE f.survey_id = survey_key);
BEGIN
    RETURN QUERY
    WITH box AS MATERIALIZED (
        SELECT b.*, g.n FROM tunnel_internal.element_boxes(survey_key, set_key) b
         CROSS JOIN LATERAL generate_series(floor(b.low / cell)::int, floor(b.high / cell)::int) AS g (n)
    ), found AS MATERIALIZED (
        SELECT f.id, f.chainage_from, f.chainage_to, f.arc_from, f.arc_to, f.unrolled, coalesce(f.kind_override, f.kind) AS kind, f.wet,
               f.severity, f.width_mm, f.area, f.length, g.n
          FROM tunnel.finding f
         CROSS JOIN LATERAL generate_series(floor(f.chainage_from / cell)::int, floor(f.chainage_to / cell)::int) AS g (n)
         WHERE f.survey_id = survey_key AND f.detected AND f.review <> 'rejected' AND NOT f.superseded
           AND f.chainage_from > first - longest AND f.chainage_from < last
    ), pair AS (
        SELECT b.element_id, f.*,
               CASE WHEN f.chainage_from >= b.low AND f.chainage_to <= b.high AND f.arc_from >= b.arc_from AND f.arc_to <= b.arc_to
                    THEN 1
                    ELSE public.ST_Area(public.ST_ClipByBox2D(f.unrolled, public.ST_MakeBox2D(
                            public.ST_MakePoint(b.low, greatest(b.arc_from, -1e4)), public.ST_MakePoint(b.high, least(b.arc_to, 1e4)))))
                         / nullif(public.ST_Area(f.unrolled), 0) END AS share
          FROM box b JOIN found f ON f.n = b.n AND f.n = floor(greatest(f.chainage_from, b.low) / cell)::int
           AND f.chainage_to > b.low AND f.chainage_from < b.high AND f.arc_to > b.arc_from AND f.arc_from < b.arc_to
    )
    SELECT p.element_id, p.id, p.kind, p.wet, p.severity::int, p.width_mm, p.area, p.area * sum(p.share), p.length * sum(p.share)
      FROM pair p WHERE p.share > 0
     GROUP BY p.element_id, p.id, p.kind, p.wet, p.severity, p.width_mm, p.area, p.length;
END
$$;
COMMENT ON FUNCTION tunnel_internal.element_parts(int, int) IS
'Counted findings of a survey in the elements of a division: area of the whole finding and of its part in the element (m²), and length of that part (m)';

CREATE OR REPLACE FUNCTION tunnel_internal.element_set_id(survey text, element_set text) RETURNS int
LANGUAGE plpgsql STABLE STRICT PARALLEL SAFE SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
DECLARE
    found int;
BEGIN
    SELECT d.id INTO found
      FROM tunnel.survey s JOIN tunnel.element_set d ON d.tunnel_id = s.tunnel_id
     WHERE s.id = tunnel_api.survey_id(element_set_id.survey) AND d.name = element_set_id.element_set;
    IF found IS NULL THEN
        RAISE EXCEPTION 'the tunnel of survey % has no elements named %', survey, left(element_set, 63)
            USING ERRCODE = 'no_data_found', HINT = 'tunneldb elements list shows them';
    END IF;
    RETURN found;
END
$$;
COMMENT ON FUNCTION tunnel_internal.element_set_id(text, text) IS
'Key of a division of a survey''s tunnel, by its name. Raises an error if there is none';

CREATE OR REPLACE FUNCTION tunnel_api.element_findings(survey text, element_set text)
RETURNS TABLE (element_id int, number int, name text, lining_area float8, inspected_share float8, findings int, leaks int,
    wet_area float8, wet_share float8, largest_leak float8, crack_length float8, crack_width_mm float8, worst_severity int)
LANGUAGE sql STABLE STRICT PARALLEL SAFE SECURITY DEFINER ROWS 1000 SET search_path = pg_catalog, pg_temp
AS $$
    WITH key AS MATERIALIZED (
        SELECT tunnel_api.survey_id($1) AS survey, tunnel_internal.element_set_id($1, $2) AS part
    ), sum AS MATERIALIZED (
        SELECT p.element_id, count(*)::int AS findings, (count(*) FILTER (WHERE p.kind = 'leak'))::int AS leaks,
               coalesce(sum(p.part) FILTER (WHERE p.wet), 0) AS wet, max(p.area) FILTER (WHERE p.kind = 'leak') AS largest,
               sum(p.length) FILTER (WHERE p.kind = 'crack') AS cracks, max(p.width_mm) FILTER (WHERE p.kind = 'crack') AS width,
               max(p.severity) AS severity
          FROM key CROSS JOIN LATERAL tunnel_internal.element_parts(key.survey, key.part) p GROUP BY p.element_id
    )
    SELECT e.id, e.number, e.name, x.lining, x.inspected_share, coalesce(s.findings, 0), coalesce(s.leaks, 0), coalesce(s.wet, 0),
           coalesce(s.wet, 0) / nullif(x.lining * x.inspected_share, 0), s.largest, s.cracks, s.width, s.severity
      FROM key
     CROSS JOIN LATERAL tunnel_internal.element_extent(key.survey, key.part) x
      JOIN tunnel.element e ON e.id = x.element_id
      LEFT JOIN sum s ON s.element_id = e.id
     ORDER BY e.number
$$;
COMMENT ON FUNCTION tunnel_api.element_findings(text, text) IS
'Elements of a division in a survey with their lining that was searched for leaks (m²), its inspected share, counted findings, number of leaks, wet area (m²) and its share of the inspected lining, largest leak (m²), length of cracks (m), greatest width of a crack (mm) and worst severity. An element with inspected_share 0 was not inspected: 0 findings do not mean that it is dry';

CREATE OR REPLACE FUNCTION tunnel_internal.rating_scheme_id(scheme text, version text) RETURNS int
LANGUAGE plpgsql STABLE CALLED ON NULL INPUT PARALLEL SAFE SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
DECLARE
    found int;
BEGIN
    SELECT r.id INTO found FROM tunnel.rating_scheme r
     WHERE r.name = rating_scheme_id.scheme AND (rating_scheme_id.version IS NULL OR r.version = rating_scheme_id.version)
     ORDER BY r.added_at DESC, r.id DESC LIMIT 1;
    IF found IS NULL THEN
        RAISE EXCEPTION 'there is no rating scheme % %', left(scheme, 63), left(coalesce(version, ''), 63)
            USING ERRCODE = 'no_data_found', HINT = 'tunneldb rating list shows them';
    END IF;
    RETURN found;
END
$$;
COMMENT ON FUNCTION tunnel_internal.rating_scheme_id(text, text) IS
'Key of a rating scheme by name and version; without a version the one added last. Raises an error if there is none';

CREATE OR REPLACE FUNCTION tunnel_internal.earlier_inspection(survey_id int) RETURNS int
LANGUAGE sql STABLE STRICT PARALLEL SAFE SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
    SELECT o.id
      FROM tunnel.survey s
      JOIN tunnel.survey o ON o.tunnel_id = s.tunnel_id AND o.date < s.date
     WHERE s.id = $1 AND o.id NOT IN (SELECT c.survey_id FROM tunnel_internal.survey_copy c)
       AND EXISTS (SELECT FROM tunnel.coverage c WHERE c.survey_id = o.id)
     ORDER BY o.date DESC, o.id LIMIT 1
$$;
COMMENT ON FUNCTION tunnel_internal.earlier_inspection(int) IS
'Key of the last earlier survey of the same tunnel in which leaks were searched for, without copies from archives; NULL if there is none';

-- Number of limits that a value reaches.
CREATE OR REPLACE FUNCTION tunnel_internal.limits_reached(value float8, limits float8[], inclusive boolean) RETURNS int
LANGUAGE sql IMMUTABLE STRICT PARALLEL SAFE SET search_path = pg_catalog, pg_temp
RETURN width_bucket(value, limits) - CASE WHEN NOT inclusive AND value = ANY (limits) THEN 1 ELSE 0 END;
COMMENT ON FUNCTION tunnel_internal.limits_reached(float8, float8[], boolean) IS
'Number of ascending limits that a value reaches; inclusive: a value equal to a limit reaches it';

CREATE OR REPLACE FUNCTION tunnel_internal.rating_number(value float8) RETURNS text
LANGUAGE sql IMMUTABLE STRICT PARALLEL SAFE SET search_path = pg_catalog, pg_temp
RETURN round(value::numeric, 4)::float8::text;
COMMENT ON FUNCTION tunnel_internal.rating_number(float8) IS 'Value of a rule as text, with at most four decimals';

-- Values of all rules, one for each measure: axis 2 is the second measure of a matrix.
CREATE OR REPLACE FUNCTION tunnel_internal.rule_values(survey_id int, earlier_id int, set_id int, scheme_id int)
RETURNS TABLE (element_id int, rule int, axis int, value float8, finding_id bigint)
LANGUAGE plpgsql STABLE CALLED ON NULL INPUT PARALLEL SAFE SECURITY DEFINER ROWS 10000 SET search_path = pg_catalog, pg_temp
SET jit = off
SET enable_nestloop = off  -- the number of rows is unknown at planning
SET enable_mergejoin = off
AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := survey_id;
    earlier_key constant int := earlier_id;
    set_key constant int := set_id;
    scheme_key constant int := scheme_id;
    years constant float8 := (SELECT (n.date - o.date) / 365.25 FROM tunnel.survey n, tunnel.survey o
                               WHERE n.id = survey_key AND o.id = earlier_key);
BEGIN
    RETURN QUERY
    WITH part AS MATERIALIZED (
        SELECT true AS now, p.* FROM tunnel_internal.element_parts(survey_key, set_key) p
        UNION ALL
        SELECT false, p.* FROM tunnel_internal.element_parts(earlier_key, set_key) p
    ), axis AS (
        SELECT r.number, 1 AS axis, r.measure, r.kinds FROM tunnel.rating_rule r WHERE r.scheme_id = scheme_key
        UNION ALL
        SELECT r.number, 2, r.by_measure, r.by_kinds FROM tunnel.rating_rule r WHERE r.scheme_id = scheme_key AND r.by_measure IS NOT NULL
    ), axis_kind AS MATERIALIZED (
        SELECT a.number, a.axis, a.measure, k.code
          FROM axis a JOIN tunnel.finding_kind k ON k.code = ANY (a.kinds) OR (cardinality(a.kinds) = 0 AND k.wet)
    ), term AS (
        SELECT p.element_id, a.number, a.axis, a.measure, p.finding_id,
               CASE a.measure WHEN 'largest_area' THEN p.area WHEN 'length' THEN p.length WHEN 'density_length' THEN p.length
                              WHEN 'width_mm' THEN p.width_mm WHEN 'severity' THEN p.severity WHEN 'count' THEN 1
                              WHEN 'growth' THEN CASE WHEN p.now THEN p.part ELSE -p.part END / years
                              ELSE p.part END AS amount
          FROM part p JOIN axis_kind a ON a.code = p.kind
         WHERE p.now OR a.measure = 'growth'
    ), fact AS (
        SELECT t.element_id, t.number, t.axis, t.measure,
               CASE WHEN t.measure IN ('largest_area', 'width_mm', 'severity') THEN max(t.amount) ELSE sum(t.amount) END AS amount,
               (array_agg(t.finding_id ORDER BY t.amount DESC NULLS LAST, t.finding_id))[1] AS decisive
          FROM term t GROUP BY t.element_id, t.number, t.axis, t.measure
    ), extent AS (
        SELECT x.* FROM tunnel_internal.element_extent(survey_key, set_key) x
    )
    SELECT f.element_id, f.number, f.axis,
           CASE WHEN f.measure IN ('share', 'density_length') THEN f.amount / nullif(x.lining * x.inspected_share, 0) ELSE f.amount END,
           f.decisive
      FROM fact f JOIN extent x ON x.element_id = f.element_id
    UNION ALL
    SELECT p.element_id, 0, 0, count(*), NULL FROM part p WHERE p.now GROUP BY p.element_id;
END
$$;
COMMENT ON FUNCTION tunnel_internal.rule_values(int, int, int, int) IS
'Values of the rules of a scheme in the elements of a division of a survey: axis 1 the measure of a rule, axis 2 the second measure of a matrix, and the finding that contributed most. earlier_id: earlier survey, for rules on growth. An element without findings of the rule''s kinds has no row. Rule 0, axis 0: number of findings';

CREATE OR REPLACE FUNCTION tunnel_api.rating(survey text, element_set text, scheme text, version text DEFAULT NULL)
RETURNS TABLE (element_id int, number int, name text, chainage_from float8, chainage_to float8, clock_from float8, clock_to float8,
    inspected_share float8, findings int, result text, level int, complete boolean, rule int, measure text, value float8,
    limit_reached float8, finding_id bigint, why text, remark text)
LANGUAGE plpgsql STABLE CALLED ON NULL INPUT PARALLEL SAFE SECURITY DEFINER ROWS 1000 SET search_path = pg_catalog, pg_temp
SET jit = off
SET enable_nestloop = off  -- the number of rows is unknown at planning
SET enable_mergejoin = off
AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := tunnel_api.survey_id(survey);
    set_key constant int := tunnel_internal.element_set_id(survey, element_set);
    scheme_key constant int := tunnel_internal.rating_scheme_id(scheme, version);
    on_growth constant boolean := EXISTS (
        SELECT FROM tunnel.rating_rule r WHERE r.scheme_id = scheme_key AND 'growth' IN (r.measure, r.by_measure));
    earlier_key constant int := CASE WHEN on_growth THEN tunnel_internal.earlier_inspection(survey_key) END;
    chosen tunnel.rating_scheme;
BEGIN
    SELECT r.* INTO chosen FROM tunnel.rating_scheme r WHERE r.id = scheme_key;
    RETURN QUERY
    WITH extent AS MATERIALIZED (
        SELECT x.* FROM tunnel_internal.element_extent(survey_key, set_key) x
    ), earlier AS MATERIALIZED (
        SELECT x.* FROM tunnel_internal.element_extent(earlier_key, set_key) x
    ), value AS MATERIALIZED (
        SELECT v.* FROM tunnel_internal.rule_values(survey_key, earlier_key, set_key, scheme_key) v
    ), pair AS (
        SELECT v.element_id, v.rule, max(v.value) FILTER (WHERE v.axis = 1) AS amount, max(v.value) FILTER (WHERE v.axis = 2) AS by_amount,
               coalesce(max(v.finding_id) FILTER (WHERE v.axis = 1), max(v.finding_id)) AS decisive
          FROM value v WHERE v.rule > 0 GROUP BY v.element_id, v.rule
    ), class AS (
        SELECT p.*, r.text, r.measure, r.inclusive, r.limits, r.results, r.points, r.by_measure, r.by_limits,
               tunnel_internal.limits_reached(coalesce(p.amount, 0), r.limits, r.inclusive) AS n,
               tunnel_internal.limits_reached(coalesce(p.by_amount, 0), r.by_limits, r.by_inclusive) AS m
          FROM pair p
          JOIN tunnel.rating_rule r ON r.scheme_id = chosen.id AND r.number = p.rule
          LEFT JOIN earlier x ON x.element_id = p.element_id
               -- growth since an inspection that did not see the element is unknown
         WHERE 'growth' NOT IN (r.measure, coalesce(r.by_measure, '')) OR x.inspected_share >= chosen.min_inspected
    ), single AS (
        SELECT c.element_id, c.rule, c.measure, c.amount, c.decisive, c.text, c.inclusive,
               CASE WHEN c.n > 0 THEN c.limits[c.n] END AS boundary,
               CASE WHEN c.by_measure IS NOT NULL THEN c.results[c.n * (cardinality(c.by_limits) + 1) + c.m + 1]
                    WHEN c.n > 0 THEN c.results[c.n] END AS result,
               CASE WHEN c.by_measure IS NULL
                    THEN format('%s: %s %s %s', c.text, tunnel_internal.rating_number(c.amount),
                                CASE WHEN c.inclusive THEN '≥' ELSE '>' END, c.limits[c.n])
                    ELSE format('%s: %s and %s', c.text, tunnel_internal.rating_number(coalesce(c.amount, 0)),
                                tunnel_internal.rating_number(coalesce(c.by_amount, 0))) END AS why
          FROM class c WHERE chosen.totals IS NULL
    ), summed AS (
        SELECT s.element_id, s.points, s.rule, s.decisive, s.terms,
               tunnel_internal.limits_reached(s.points, chosen.totals, chosen.totals_inclusive) AS n
          FROM (SELECT c.element_id, sum(c.points[c.n]) AS points,
                       (array_agg(c.rule ORDER BY c.points[c.n] DESC, c.rule))[1] AS rule,
                       (array_agg(c.decisive ORDER BY c.points[c.n] DESC, c.rule))[1] AS decisive,
                       string_agg(format('%s %s (%s)', c.text, c.points[c.n], tunnel_internal.rating_number(c.amount)), ', '
                                  ORDER BY c.points[c.n] DESC, c.rule) AS terms
                  FROM class c WHERE chosen.totals IS NOT NULL AND c.n > 0 GROUP BY c.element_id) s
    ), reached AS (
        SELECT s.element_id, s.rule, s.measure, s.amount, s.boundary, s.decisive, s.result, s.why,
               array_position(chosen.results, s.result) AS level
          FROM single s WHERE s.result IS NOT NULL
        UNION ALL
        SELECT s.element_id, s.rule, 'sum', s.points, chosen.totals[s.n], s.decisive, chosen.total_results[s.n],
               format('%s points: %s', s.points, s.terms), array_position(chosen.results, chosen.total_results[s.n])
          FROM summed s WHERE s.n > 0
    ), worst AS (
        SELECT DISTINCT ON (r.element_id) r.* FROM reached r ORDER BY r.element_id, r.level DESC, r.rule
    )
    SELECT e.id, e.number, e.name, e.chainage_from, e.chainage_to, e.clock_from, e.clock_to, x.inspected_share,
           coalesce(c.value, 0)::int,
           -- where nothing was inspected, no finding is no good result
           CASE WHEN w.result IS NOT NULL THEN w.result WHEN x.inspected_share > 0 THEN chosen.results[1] END,
           CASE WHEN w.level IS NOT NULL THEN w.level WHEN x.inspected_share > 0 THEN 1 END,
           x.inspected_share >= chosen.min_inspected AND (NOT on_growth OR coalesce(o.inspected_share, 0) >= chosen.min_inspected),
           w.rule, w.measure, w.amount, w.boundary, w.decisive, w.why,
           nullif(concat_ws('; ',
               CASE WHEN x.inspected_share = 0 THEN 'not inspected'
                    WHEN x.inspected_share < chosen.min_inspected
                    -- never rounded up to the limit
                    THEN format('%s %% inspected', trunc(100 * x.inspected_share::numeric)) END,
               CASE WHEN on_growth AND earlier_key IS NULL THEN 'growth unknown: no earlier inspection'
                    WHEN on_growth AND coalesce(o.inspected_share, 0) < chosen.min_inspected
                    THEN format('growth unknown: %s %% inspected then', trunc(100 * coalesce(o.inspected_share, 0)::numeric)) END), '')
      FROM tunnel.element e
      JOIN extent x ON x.element_id = e.id
      LEFT JOIN earlier o ON o.element_id = e.id
      LEFT JOIN value c ON c.element_id = e.id AND c.rule = 0
      LEFT JOIN worst w ON w.element_id = e.id
     WHERE e.element_set_id = set_key
     ORDER BY e.number;
END
$$;
COMMENT ON FUNCTION tunnel_api.rating(text, text, text, text) IS
'Rating of the elements of a division in a survey by a scheme; without a version by the one added last. result: the worst of all rules, or that of the sum of their points, with its place in the scheme''s results (level, from 1, the best); the scheme''s best result without a rule that was reached; NULL where nothing was inspected and nothing found. complete: false if less than min_inspected of the element was inspected, or its growth is unknown (remark): the result is then a lower bound. rule, measure, value, limit_reached, finding_id and why: what decided, and the finding that contributed most';

CREATE OR REPLACE FUNCTION tunnel_api.rating_comparison(
    survey text, element_set text, scheme text, other_scheme text, version text DEFAULT NULL, other_version text DEFAULT NULL)
RETURNS TABLE (element_id int, number int, name text, result text, other_result text, complete boolean, other_complete boolean,
    difference float8, why text, other_why text)
LANGUAGE sql STABLE CALLED ON NULL INPUT PARALLEL SAFE SECURITY DEFINER ROWS 1000 SET search_path = pg_catalog, pg_temp
AS $$
    SELECT a.element_id, a.number, a.name, a.result, b.result, a.complete, b.complete,
           (b.level - 1.0) / (cardinality(q.results) - 1) - (a.level - 1.0) / (cardinality(p.results) - 1), a.why, b.why
      FROM tunnel_api.rating($1, $2, $3, $5) a
      JOIN tunnel_api.rating($1, $2, $4, $6) b ON b.element_id = a.element_id
      JOIN tunnel.rating_scheme p ON p.id = tunnel_internal.rating_scheme_id($3, $5)
      JOIN tunnel.rating_scheme q ON q.id = tunnel_internal.rating_scheme_id($4, $6)
     ORDER BY a.number
$$;
COMMENT ON FUNCTION tunnel_api.rating_comparison(text, text, text, text, text, text) IS
'Ratings of the same elements and findings by two schemes, or two versions of one. difference: place of the second result in its scheme (0 best, 1 worst) minus that of the first; NULL if one of them is missing. why and other_why: what decided in each';

CREATE OR REPLACE FUNCTION tunnel_api.rating_change(survey text, element_set text, scheme text, version text DEFAULT NULL)
RETURNS TABLE (element_id int, number int, name text, earlier_survey text, earlier_date date, earlier_result text, result text,
    change int, known boolean, earlier_why text, why text)
LANGUAGE plpgsql STABLE CALLED ON NULL INPUT PARALLEL SAFE SECURITY DEFINER ROWS 1000 SET search_path = pg_catalog, pg_temp
AS $$
#variable_conflict use_column
DECLARE
    earlier tunnel.survey;
BEGIN
    SELECT s.* INTO earlier FROM tunnel.survey s WHERE s.id = tunnel_internal.earlier_inspection(tunnel_api.survey_id(survey));
    RETURN QUERY
    SELECT n.element_id, n.number, n.name, earlier.name, earlier.date, o.result, n.result, n.level - o.level,
           n.complete AND coalesce(o.complete, false), o.why, n.why
      FROM tunnel_api.rating(survey, element_set, scheme, version) n
      LEFT JOIN tunnel_api.rating(earlier.name, element_set, scheme, version) o ON o.element_id = n.element_id AND earlier.name IS NOT NULL
     ORDER BY n.number;
END
$$;
COMMENT ON FUNCTION tunnel_api.rating_change(text, text, text, text) IS
'Rating of each element now and in the last earlier inspection of the tunnel, by the same scheme. change: levels by which it became worse (positive) or better; NULL if it has no result in one of them. known: false if either result is a lower bound: the change can then be one of the inspection, not of the tunnel. earlier_survey is NULL if there is no earlier inspection';
