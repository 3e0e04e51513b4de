-- What lies between the linings of two surveys: by section, by stretch, by cell. Needs deviation_section (views/deviation.sql),
-- survey_id and station_label.

CREATE OR REPLACE VIEW tunnel_api.thickness_section AS
SELECT d.id, d.survey_id, s.name AS survey, d.before_id, b.name AS survey_before, d.km, d.layer, d.chainage_from, d.chainage_to,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, (d.chainage_from + d.chainage_to) / 2) l) AS label,
       d.design_length, d.compared_length, d.compared_length / d.design_length AS compared_share, d.area, d.noise_area,
       d.by_right, d.by_up, d.thickness_mean, d.thickness_least, d.least_at, d.thickness
  FROM tunnel.thickness_section d
  JOIN tunnel.survey s ON s.id = d.survey_id
  JOIN tunnel.survey b ON b.id = d.before_id;
COMMENT ON VIEW tunnel_api.thickness_section IS
    'What lies between the linings of two surveys, at right angles to a layer''s profiles, in steps of 1 m of chainage; what either did not see is in no area, and in compared_share';
COMMENT ON COLUMN tunnel_api.thickness_section.survey_id IS 'Later survey';
COMMENT ON COLUMN tunnel_api.thickness_section.survey IS 'Its name';
COMMENT ON COLUMN tunnel_api.thickness_section.before_id IS 'Earlier survey';
COMMENT ON COLUMN tunnel_api.thickness_section.survey_before IS 'Its name';
COMMENT ON COLUMN tunnel_api.thickness_section.layer IS 'Layer whose profiles both were held against';
COMMENT ON COLUMN tunnel_api.thickness_section.label IS 'Station of its middle, as 12+345.678';
COMMENT ON COLUMN tunnel_api.thickness_section.design_length IS 'Length of the profile, m';
COMMENT ON COLUMN tunnel_api.thickness_section.compared_length IS 'What of that both surveys saw, m';
COMMENT ON COLUMN tunnel_api.thickness_section.compared_share IS 'The same as a share, 0 to 1';
COMMENT ON COLUMN tunnel_api.thickness_section.area IS 'Area between the two, of what both saw, m²; negative where material went';
COMMENT ON COLUMN tunnel_api.thickness_section.noise_area IS 'Standard deviation of the area by the scatter of pixels, m²';
COMMENT ON COLUMN tunnel_api.thickness_section.by_right IS 'By how much the area grows when the later survey moves to the right, m² for 1 m';
COMMENT ON COLUMN tunnel_api.thickness_section.by_up IS 'By how much the area grows when the later survey moves up, m² for 1 m';
COMMENT ON COLUMN tunnel_api.thickness_section.thickness_mean IS 'Mean of the cells that both saw, m; NULL without any';
COMMENT ON COLUMN tunnel_api.thickness_section.thickness_least IS 'Least of a cell, m';
COMMENT ON COLUMN tunnel_api.thickness_section.least_at IS 'How far along the profile that is, from its left foot or lowest place clockwise, m';
COMMENT ON COLUMN tunnel_api.thickness_section.thickness IS 'Of cells of equal length along the profile, m; NaN where either saw nothing';

-- What the thickness in a kilometre is made from. It is up to date as long as this is the same as in its row of the ledger.
CREATE OR REPLACE FUNCTION tunnel_api.thickness_inputs(before_id int, survey_id int, km int, layer text) RETURNS jsonb
LANGUAGE sql STABLE PARALLEL SAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT jsonb_build_object('deviation', (SELECT jsonb_agg(r.last ORDER BY r.survey)
      FROM (SELECT s.id AS survey, (SELECT max(d.id) FROM tunnel.run d
                    WHERE d.survey_id = s.id AND d.km = $3 AND d.stage = 'deviation' AND d.outcome = 'done'
                      AND d.parameters ->> 'layer' = $4) AS last
              FROM unnest(ARRAY[$1, $2]) AS s (id)) r))
$$;
COMMENT ON FUNCTION tunnel_api.thickness_inputs(int, int, int, text) IS
    'What the thickness between an earlier and a later survey in a kilometre is made from: the runs of stage deviation of both. The run of stage thickness holds the same in its parameters';

CREATE OR REPLACE FUNCTION tunnel_api.thickness_state(before_id int, survey_id int)
RETURNS TABLE (km int, layer text, done_at timestamptz, reason text)
LANGUAGE sql STABLE PARALLEL RESTRICTED STRICT SECURITY DEFINER ROWS 50 SET search_path = pg_catalog, pg_temp SET jit = off AS $$
    WITH held AS (
        SELECT DISTINCT d.survey_id, d.km, d.layer FROM tunnel.deviation_section d WHERE d.survey_id IN ($1, $2)
    ), last AS (
        SELECT DISTINCT ON (r.km, r.parameters ->> 'layer') r.km, r.parameters ->> 'layer' AS layer, r.finished_at, r.parameters
          FROM tunnel.run r
         WHERE r.survey_id = $2 AND r.stage = 'thickness' AND r.outcome = 'done' AND (r.parameters ->> 'before')::int = $1
         ORDER BY r.km, r.parameters ->> 'layer', r.started_at DESC, r.id DESC
    )
    SELECT a.km, a.layer, l.finished_at,
           CASE WHEN b.reason IS NOT NULL THEN 'deviation of the earlier survey is stale: ' || b.reason
                WHEN n.reason IS NOT NULL THEN 'deviation is stale: ' || n.reason
                WHEN l.km IS NULL THEN 'never ran'
                WHEN l.parameters -> 'deviation' IS DISTINCT FROM
                     tunnel_api.thickness_inputs($1, $2, a.km, a.layer) -> 'deviation' THEN 'deviation ran since'
           END
      FROM held a
      JOIN held e ON e.survey_id = $1 AND e.km = a.km AND e.layer = a.layer
      LEFT JOIN tunnel_api.deviation_state($1) b ON b.km = a.km AND b.layer = a.layer
      LEFT JOIN tunnel_api.deviation_state($2) n ON n.km = a.km AND n.layer = a.layer
      LEFT JOIN last l ON l.km = a.km AND l.layer = a.layer
     WHERE a.survey_id = $2
$$;
COMMENT ON FUNCTION tunnel_api.thickness_state(int, int) IS
    'How far the thickness between an earlier and a later survey has come: of each kilometre and layer of which both have sections, when it was last made, and why it is out of date, if it is';

CREATE OR REPLACE FUNCTION tunnel_api.thickness_stretches(
    survey_before text, survey text, layer text, step float8 DEFAULT 100, minimum float8 DEFAULT 0, axis_sigma float8 DEFAULT 0,
    chainage_from float8 DEFAULT '-infinity', chainage_to float8 DEFAULT 'infinity')
RETURNS TABLE (stretch_from float8, stretch_to float8, label text, length float8, design_area float8, compared_area float8,
               compared_share float8, volume float8, volume_sigma float8, thickness_mean float8, thickness_least float8,
               below_area float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT ROWS 250 SET jit = off
AS $$
    SELECT w.low, w.high, tunnel_api.station_label(v.tunnel_id, w.low), w.length, w.design, w.compared,
           w.compared / nullif(w.design, 0), w.volume,
           sqrt(w.noise + ($6 * w.by_right) ^ 2 + ($6 * w.by_up) ^ 2), w.mean, w.least, w.below
      FROM tunnel_api.survey v
     CROSS JOIN LATERAL (
        SELECT n * $4 AS low, (n + 1) * $4 AS high, sum(p.long) AS length, sum(p.long * d.design_length) AS design,
               sum(p.long * d.compared_length) AS compared, sum(p.long * d.area) AS volume,
               sum((p.long * d.noise_area) ^ 2) AS noise, sum(p.long * d.by_right) AS by_right, sum(p.long * d.by_up) AS by_up,
               sum(p.long * d.compared_length * d.thickness_mean)
                   / nullif(sum(p.long * d.compared_length), 0) AS mean,
               min(d.thickness_least) AS least,
               sum(p.long * d.design_length * coalesce((
                   SELECT count(*)::float8 / cardinality(d.thickness) FROM unnest(d.thickness) AS c (t)
                    WHERE d.thickness_least < $5 AND c.t < $5), 0)) AS below
          FROM tunnel_api.thickness_section d
         CROSS JOIN (VALUES (0), (1)) AS k (further)  -- a section lies in one stretch or two
         CROSS JOIN LATERAL (SELECT floor(d.chainage_from / $4) + k.further AS n) f
         CROSS JOIN LATERAL (
            SELECT least(d.chainage_to, (n + 1) * $4, $8) - greatest(d.chainage_from, n * $4, $7) AS long) p
         WHERE d.survey_id = v.id AND d.before_id = tunnel_api.survey_id($1) AND d.layer = $3 AND $4 >= 1 AND p.long > 0
         GROUP BY n) w
     WHERE v.id = tunnel_api.survey_id($2)
$$;
COMMENT ON FUNCTION tunnel_api.thickness_stretches(text, text, text, float8, float8, float8, float8, float8) IS
'What was put on between an earlier and a later survey, by stretches of so many metres, 1 or more, from whole multiples of them on, between two chainages: volume (m³) of what both saw (compared_area of design_area, m²), its standard deviation by the scatter of pixels and by surveys that are uncertain against each other by axis_sigma (m) to the right and as much up, mean and least thickness of a cell (m), and area of the cells thinner than the minimum (m²)';

-- Cells under a minimum, of sections whose least is under it: an index finds those.
CREATE OR REPLACE FUNCTION tunnel_api.thickness_below(survey_before text, survey text, layer text, minimum float8)
RETURNS TABLE (chainage_from float8, chainage_to float8, label text, along_from float8, along_to float8, thickness_least float8,
               area float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT ROWS 1000 SET jit = off
AS $$
    SELECT d.chainage_from, d.chainage_to, d.label, r.low * g.each, r.high * g.each, r.least,
           (r.high - r.low) * g.each * (d.chainage_to - d.chainage_from)
      FROM tunnel_api.thickness_section d
     CROSS JOIN LATERAL (SELECT d.design_length / cardinality(d.thickness) AS each) g
     CROSS JOIN LATERAL (
        SELECT min(c.n) - 1 AS low, max(c.n) AS high, min(c.t) AS least
          FROM (SELECT u.n, u.t, u.n - row_number() OVER (ORDER BY u.n) AS run
                  FROM unnest(d.thickness) WITH ORDINALITY AS u (t, n) WHERE u.t < $4) c
         GROUP BY c.run) r
     WHERE d.survey_id = tunnel_api.survey_id($2) AND d.before_id = tunnel_api.survey_id($1) AND d.layer = $3
       AND d.thickness_least < $4
$$;
COMMENT ON FUNCTION tunnel_api.thickness_below(text, text, text, float8) IS
'Where what was put on between an earlier and a later survey is thinner than a minimum (m): runs of cells along the profile, of each section of 1 m; from where to where along the profile (m, from its left foot or lowest place clockwise), least thickness (m) and area (m²). What either did not see is not in it: see compared_share';
