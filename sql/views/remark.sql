-- Notes on the results of surveys, as every document states them.

-- Notes of the stages whose results are in the database, points that were left out of files, and doubts about their
-- intensity and coordinates. More than 20 % noise means that the filter does not suit the scan: it is made for isolated
-- returns (dust, edges, people), which are a few percent. Points beyond the ends of the given axis are reported from 1 % on:
-- a scan contains some points before a portal, but a tunnel that continues needs attention.
CREATE OR REPLACE VIEW tunnel_api.remark AS
SELECT 16 * r.id AS id, s.id AS survey_id, s.name AS survey, r.km, r.stage, NULL::text AS file,
       concat_ws('; ', r.counts ->> 'note', r.counts ->> 'place') AS remark
  FROM tunnel.survey s
 CROSS JOIN LATERAL tunnel_internal.stages_run(s.id) g (stage)
 CROSS JOIN LATERAL tunnel_internal.last_runs(s.id, g.stage) r
 WHERE r.counts ?| ARRAY['note', 'place']
 UNION ALL
SELECT 16 * f.id::bigint + w.k, f.survey_id, s.name, NULL, 'load', f.name, format('%s points (%s %%) left out: %s', w.points,
       round(100 * w.points / greatest(f.points - f.outside, 1)::numeric, 2), w.why)
  FROM tunnel.scan_file f
  JOIN tunnel.survey s ON s.id = f.survey_id
 CROSS JOIN LATERAL (VALUES
       (1, f.invalid, 0.0, 'a coordinate, their time or their intensity is no number'),
       (2, f.unposed, 0.0, 'the scanner''s position is not known'),
       (3, f.noise, 0.2, 'they count as noise; is the scan too sparse for load --noise-points?')) AS w (k, points, share, why)
 WHERE w.points > w.share * (f.points - f.outside)
 UNION ALL
SELECT 16 * f.id::bigint + b.k, f.survey_id, s.name, NULL, 'load', f.name,
       format('%s points (%s %%) lie %s of the given axis, up to %s m: they are not loaded, and nothing is looked for there; '
              'an axis that reaches as far takes them in',
              b.points, round(100 * b.points / b.near::numeric, 1), b.side, b.reach)
  FROM tunnel.scan_file f
  JOIN tunnel.survey s ON s.id = f.survey_id
 CROSS JOIN LATERAL (SELECT greatest(f.points - f.outside + f.beyond_before + f.beyond_after, 1) AS near) n
 CROSS JOIN LATERAL (VALUES
       (4, f.beyond_before, f.reach_before, n.near, 'beyond the beginning'),
       (5, f.beyond_after, f.reach_after, n.near, 'beyond the end')) AS b (k, points, reach, near, side)
 WHERE b.points > 0.01 * b.near
 UNION ALL
SELECT 16 * f.id::bigint + 7, f.survey_id, s.name, NULL, 'load', f.name,
       format('has the same content as %s: all its points count twice; tunneldb survey remove-file %s %s', o.name, s.name, f.name)
  FROM tunnel.scan_file f
  JOIN tunnel.survey s ON s.id = f.survey_id
 CROSS JOIN LATERAL (SELECT min(e.name) AS name FROM tunnel.scan_file e
                      WHERE e.survey_id = f.survey_id AND e.checksum = f.checksum AND e.id < f.id AND e.checksum <> '') o
 WHERE o.name IS NOT NULL
 UNION ALL
SELECT 16 * f.id::bigint + n.k, f.survey_id, s.name, NULL, 'load', f.name, n.note
  FROM tunnel.scan_file f
  JOIN tunnel.survey s ON s.id = f.survey_id
 CROSS JOIN LATERAL (VALUES (8, f.intensity_note), (9, f.pose_note), (10, f.header_note), (11, f.coordinate_note)) AS n (k, note)
 WHERE n.note IS NOT NULL
 UNION ALL
SELECT 16 * s.id::bigint + 6, s.id, s.name, NULL, 'survey', NULL, s.positions_note
  FROM tunnel.survey s
 WHERE s.positions_note IS NOT NULL
 UNION ALL
SELECT 16 * min(h.id) + CASE WHEN bool_or(h.way = 'dry region') THEN 12 ELSE 13 END, h.survey_id, s.name, h.km, 'review', NULL,
       format('%s not counted (%s m²), taken out by %s: %s', CASE sum(h.leaks) WHEN 1 THEN '1 leak is' ELSE sum(h.leaks) || ' leaks are' END,
              round(sum(h.leaks_area)::numeric, 2), h.who,
              string_agg(format('%s %s (%s m²%s)', h.way, h.id, round(h.area::numeric, 1), ', approved by ' || h.approved_by), ', '
                         ORDER BY h.way, h.id))
  FROM tunnel_internal.hiding h
  JOIN tunnel.survey s ON s.id = h.survey_id
 WHERE h.leaks > 0
 GROUP BY h.survey_id, s.name, h.km, h.who;
COMMENT ON VIEW tunnel_api.remark IS
    'Notes on the results of surveys: notes of stages by kilometre, points of files that were left out, doubtful intensity, scanner positions and coordinates of files, differences between header and points, notes on scanner positions, and leaks that people took out of the totals by drawing';
COMMENT ON COLUMN tunnel_api.remark.km IS 'Kilometre; NULL for a file or for the survey as a whole';
COMMENT ON COLUMN tunnel_api.remark.stage IS
    'Stage that wrote the note; survey for notes written when the survey was added or set; review for leaks that people took out of the totals';
COMMENT ON COLUMN tunnel_api.remark.file IS 'Name of the scan file; NULL for a kilometre';
COMMENT ON COLUMN tunnel_api.remark.remark IS 'Text of the note';


-- Files first, then kilometres; the same note of several kilometres is one row.
CREATE OR REPLACE FUNCTION tunnel_internal.remarks_of(survey_id int, starts float8[], ends float8[])
RETURNS TABLE (n int, file text, stage text, kilometres int[], remark text, said text)
LANGUAGE plpgsql STABLE STRICT PARALLEL RESTRICTED
COST 100000  -- once a survey, not once a stretch
ROWS 5
SECURITY DEFINER SET search_path = pg_catalog, pg_temp
SET jit = off
SET plan_cache_mode = force_generic_plan  -- planning takes longer than a survey
AS $$
#variable_conflict use_column
BEGIN
    PERFORM tunnel_internal.in_order(t.low, t.high) FROM unnest(starts, ends) AS t (low, high);
    RETURN QUERY
    WITH known AS (
        SELECT DISTINCT r.file, r.stage, r.km, r.remark, coalesce(r.km * 1000, f.chainage_from, '-Infinity') AS low,
               coalesce((r.km + 1) * 1000, f.chainage_to, 'Infinity') AS high
          FROM tunnel_api.remark r
          LEFT JOIN tunnel.scan_file f ON f.survey_id = r.survey_id AND f.name = r.file
         WHERE r.survey_id = $1
    ), here AS (
        SELECT t.n::int, k.file, k.stage, k.km, k.remark
          FROM unnest(starts, ends) WITH ORDINALITY AS t (low, high, n)
          JOIN known k ON k.low < t.high AND k.high > t.low
    ), part AS (  -- kilometres in a row
        SELECT h.*, h.km - row_number() OVER (PARTITION BY h.n, h.file, h.stage, h.remark ORDER BY h.km) AS part FROM here h
    ), span AS (
        SELECT p.n, p.file, p.stage, p.remark, min(p.km) AS first,
               concat_ws('–', min(p.km), nullif(max(p.km), min(p.km))) AS span
          FROM part p
         GROUP BY p.n, p.file, p.stage, p.remark, p.part
    ), whole AS (
        SELECT s.n, s.file, s.stage, s.remark, min(s.first) AS first, string_agg(s.span, ', ' ORDER BY s.first) AS spans
          FROM span s
         GROUP BY s.n, s.file, s.stage, s.remark
    ), listed AS (
        SELECT h.n, h.stage, h.remark, array_agg(h.km ORDER BY h.km) AS kilometres
          FROM here h
         WHERE h.km IS NOT NULL
         GROUP BY h.n, h.stage, h.remark
    )
    SELECT w.n, w.file, w.stage, coalesce(l.kilometres, '{}'), w.remark,
           coalesce(w.file, CASE WHEN w.spans <> '' THEN format('km %s, %s', w.spans, w.stage) END, 'scanner positions')
               || ': ' || w.remark
      FROM whole w
      LEFT JOIN listed l ON l.n = w.n AND l.stage = w.stage AND l.remark = w.remark AND w.file IS NULL
     ORDER BY w.n, w.file NULLS LAST, w.first, w.stage, w.remark;
END
$$;
COMMENT ON FUNCTION tunnel_internal.remarks_of(int, float8[], float8[]) IS
'Result of remarks for several stretches of a survey, given by their beginnings and ends (m). n: number of the stretch, from 1';


-- The planner inlines the body.
CREATE OR REPLACE FUNCTION tunnel_api.remarks(
    survey_id int, stretch_from float8 DEFAULT '-Infinity', stretch_to float8 DEFAULT 'Infinity')
RETURNS TABLE (file text, stage text, kilometres int[], remark text, said text)
LANGUAGE sql STABLE CALLED ON NULL INPUT PARALLEL RESTRICTED
ROWS 5
AS $$
    SELECT r.file, r.stage, r.kilometres, r.remark, r.said FROM tunnel_internal.remarks_of($1, ARRAY[$2], ARRAY[$3]) r
$$;
COMMENT ON FUNCTION tunnel_api.remarks(int, float8, float8) IS
'Notes on a survey''s results between two chainages (m), from the view remark: first those of files, then those of kilometres; the same note of several kilometres is one row. said: the note in words, as in every document';


CREATE OR REPLACE FUNCTION tunnel_internal.remark_statements(survey_id int, starts float8[], ends float8[])
RETURNS TABLE (n int, said text)
LANGUAGE sql STABLE STRICT PARALLEL RESTRICTED
COST 100000  -- once a survey, not once a stretch
ROWS 5
AS $$
    SELECT r.n, string_agg(r.said, '; ' ORDER BY r.place)
      FROM tunnel_internal.remarks_of($1, $2, $3) WITH ORDINALITY AS r (n, file, stage, kilometres, remark, said, place)
     GROUP BY r.n
$$;
COMMENT ON FUNCTION tunnel_internal.remark_statements(int, float8[], float8[]) IS
'Notes on several stretches of a survey, given by their beginnings and ends (m), one line each. n: number of the stretch, from 1. No row for a stretch without notes';


CREATE OR REPLACE FUNCTION tunnel_internal.remark_statement(
    survey_id int, stretch_from float8 DEFAULT '-Infinity', stretch_to float8 DEFAULT 'Infinity')
RETURNS text
LANGUAGE sql STABLE STRICT PARALLEL RESTRICTED
AS $$ SELECT r.said FROM tunnel_internal.remark_statements($1, ARRAY[$2], ARRAY[$3]) r $$;
COMMENT ON FUNCTION tunnel_internal.remark_statement(int, float8, float8) IS
'Notes on a stretch of a survey (m) in one line; NULL if there are none';
