-- Ratings as layers: each element of each division, in each survey, by each version of each scheme. Conditions on survey,
-- element_set, scheme and version reach the tables before the ratings are computed, so a layer computes one rating only.
-- Needs rating and element_boxes (measures/rating.sql), map_point (geometry/unroll.sql).

-- Rectangle of the unrolled plane on the map strip; long sides follow the axis in steps of at most 5 m.
CREATE OR REPLACE FUNCTION tunnel_internal.map_box(survey_id int, low float8, high float8, arc_from float8, arc_to float8)
RETURNS public.geometry
LANGUAGE sql STABLE STRICT PARALLEL SAFE SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    WITH steps AS (
        SELECT n, $2 + ($3 - $2) * n / c.number AS chainage
          FROM (SELECT greatest(ceil(($3 - $2) / 5)::int, 1) AS number) c CROSS JOIN LATERAL generate_series(0, c.number) AS g (n)
    ), ring AS (
        SELECT n AS place, tunnel_internal.map_point($1, chainage, $4) AS point FROM steps
        UNION ALL
        SELECT 1000000 - n, tunnel_internal.map_point($1, chainage, $5) FROM steps
    ), line AS (
        SELECT array_agg(r.point ORDER BY r.place) AS points FROM ring r WHERE r.point IS NOT NULL
    )
    SELECT CASE WHEN cardinality(l.points) > 3
                THEN public.ST_MakePolygon(public.ST_MakeLine(l.points || l.points[1])) END
      FROM line l WHERE tunnel_internal.in_order($4, $5)
$$;
COMMENT ON FUNCTION tunnel_internal.map_box(int, float8, float8, float8, float8) IS
'Rectangle between two chainages and two arcs (m) on the map strip, in the tunnel''s SRID; NULL if the survey has no axis there';

CREATE OR REPLACE FUNCTION tunnel_internal.element_outline(survey_id int, set_id int)
RETURNS TABLE (element_id int, low float8, high float8, arc_from float8, arc_to float8)
LANGUAGE sql STABLE STRICT PARALLEL SAFE SECURITY DEFINER ROWS 1000 SET search_path = pg_catalog, pg_temp AS $$
    SELECT b.element_id, b.low, b.high, coalesce(e.first, b.arc_from), coalesce(e.last, b.arc_to)
      FROM tunnel_internal.element_boxes($1, $2) b
      LEFT JOIN LATERAL (
            SELECT q.first, q.last
              FROM ((SELECT t.chainage, t.arc[1] AS first, t.arc[361] AS last FROM tunnel.section t
                      WHERE t.survey_id = $1 AND t.chainage >= (b.low + b.high) / 2 ORDER BY t.chainage LIMIT 1)
                     UNION ALL
                    (SELECT t.chainage, t.arc[1], t.arc[361] FROM tunnel.section t
                      WHERE t.survey_id = $1 AND t.chainage < (b.low + b.high) / 2 ORDER BY t.chainage DESC LIMIT 1)) q
             ORDER BY abs(q.chainage - (b.low + b.high) / 2) LIMIT 1) e ON b.arc_from = '-infinity'
     WHERE b.arc_from > '-infinity' OR e.first IS NOT NULL
$$;
COMMENT ON FUNCTION tunnel_internal.element_outline(int, int) IS
'Elements of a division in the unrolled plane of a survey as rectangles with finite arcs (m): an element all round ends where the section nearest to its middle ends';

CREATE OR REPLACE VIEW tunnel_api.rating_unrolled AS
SELECT (c.id::bigint << 47) + (s.id::bigint << 31) + x.element_id AS id, s.id AS survey_id, s.name AS survey, s.tunnel_id,
       d.name AS element_set, c.name AS scheme, c.version, x.element_id, x.number, x.name, x.chainage_from, x.chainage_to,
       tunnel_api.station_label(s.tunnel_id, (x.chainage_from + x.chainage_to) / 2) AS label, x.clock_from, x.clock_to,
       x.inspected_share, x.findings, x.result, x.level, cardinality(c.results) AS levels, x.complete,
       CASE WHEN x.result IS NULL THEN 'not rated' WHEN x.complete THEN x.result ELSE 'at least ' || x.result END AS result_text,
       x.finding_id, x.why, x.remark, g.geom
  FROM tunnel.survey s
  JOIN tunnel.element_set d ON d.tunnel_id = s.tunnel_id
 CROSS JOIN tunnel.rating_scheme c
 CROSS JOIN LATERAL tunnel_api.rating(s.name, d.name, c.name, c.version) x
  LEFT JOIN LATERAL (
        SELECT b.element_id,
               public.ST_Collect(public.ST_MakeEnvelope(b.low, b.arc_from, b.high, b.arc_to, 0))::public.geometry(MultiPolygon, 0) AS geom
          FROM tunnel_internal.element_outline(s.id, d.id) b GROUP BY b.element_id) g ON g.element_id = x.element_id;
COMMENT ON VIEW tunnel_api.rating_unrolled IS
'Ratings of elements in the unrolled plane: of each survey, division and version of a scheme. Always with conditions on survey, element_set, scheme and version: each combination is a rating of its own, computed when it is read';

CREATE OR REPLACE VIEW tunnel_api.rating_map AS
SELECT (c.id::bigint << 47) + (s.id::bigint << 31) + x.element_id AS id, s.id AS survey_id, s.name AS survey, s.tunnel_id,
       d.name AS element_set, c.name AS scheme, c.version, x.element_id, x.number, x.name, x.chainage_from, x.chainage_to,
       tunnel_api.station_label(s.tunnel_id, (x.chainage_from + x.chainage_to) / 2) AS label, x.clock_from, x.clock_to,
       x.inspected_share, x.findings, x.result, x.level, cardinality(c.results) AS levels, x.complete,
       CASE WHEN x.result IS NULL THEN 'not rated' WHEN x.complete THEN x.result ELSE 'at least ' || x.result END AS result_text,
       x.finding_id, x.why, x.remark, g.geom
  FROM tunnel.survey s
  JOIN tunnel.element_set d ON d.tunnel_id = s.tunnel_id
 CROSS JOIN tunnel.rating_scheme c
 CROSS JOIN LATERAL tunnel_api.rating(s.name, d.name, c.name, c.version) x
  LEFT JOIN LATERAL (
        SELECT b.element_id, public.ST_Collect(tunnel_internal.map_box(s.id, b.low, b.high, b.arc_from, b.arc_to)) AS geom
          FROM tunnel_internal.element_outline(s.id, d.id) b GROUP BY b.element_id) g ON g.element_id = x.element_id;
COMMENT ON VIEW tunnel_api.rating_map IS
'Ratings of elements on the map strip beside the axis: of each survey, division and version of a scheme. Always with conditions on survey, element_set, scheme and version: each combination is a rating of its own, computed when it is read';

DO $$
DECLARE
    comment record;
BEGIN
    FOR comment IN SELECT v.view, t.* FROM (VALUES ('rating_unrolled'), ('rating_map')) AS v (view)
     CROSS JOIN (VALUES
        ('element_set', 'Name of the division of the tunnel'),
        ('scheme', 'Name of the scheme'),
        ('version', 'Version of the scheme'),
        ('element_id', 'Key of the element'),
        ('number', 'Number of the element in its division, from 1'),
        ('name', 'Name of the element'),
        ('label', 'Station of its middle, as 12+345.678'),
        ('clock_from', 'Clock position at which it begins, clockwise looking up-chainage, hours; NULL: all round'),
        ('clock_to', 'Clock position at which it ends, hours'),
        ('inspected_share', 'Inspected share of its lining, 0 to 1'),
        ('findings', 'Number of counted findings'),
        ('result', 'Result of the rating; NULL where nothing was inspected and nothing found'),
        ('level', 'Place of the result among those of the scheme, from 1, the best'),
        ('levels', 'Number of results of the scheme'),
        ('complete', 'False if the result is a lower bound: too little was inspected, or growth is unknown'),
        ('result_text', 'Result in words: "at least" before a lower bound, "not rated" without a result'),
        ('finding_id', 'Finding that contributed most to the deciding rule'),
        ('why', 'Rule, value and limit that decided'),
        ('remark', 'What was not inspected, or not known')) AS t (name, text)
    LOOP
        EXECUTE format('COMMENT ON COLUMN tunnel_api.%I.%I IS %L', comment.view, comment.name, comment.text);
    END LOOP;
END
$$;
COMMENT ON COLUMN tunnel_api.rating_unrolled.geom IS
    'Its rectangle in the unrolled plane (chainage, arc), two if it goes through 6 o''clock; NULL outside the survey';
COMMENT ON COLUMN tunnel_api.rating_map.geom IS 'Its place on the map strip beside the axis, in the tunnel''s SRID; NULL outside the survey';
