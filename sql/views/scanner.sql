-- Positions of the scanner: stations, and the trajectory of a mobile one. Needs stationing (geometry/stationing.sql) and
-- unroll (geometry/unroll.sql).

-- Without sections, or off them, the chainage is measured along the given axis, in plan.
CREATE OR REPLACE FUNCTION tunnel_internal.scanner_chainage(survey_id int, place geometry) RETURNS float8
LANGUAGE sql STABLE STRICT PARALLEL SAFE SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT coalesce((SELECT u.chainage FROM tunnel_api.unroll($1, $2) u),
                    (SELECT t.start_chainage + l.share * public.ST_Length(t.alignment)
                       FROM tunnel.survey s
                       JOIN tunnel.tunnel t ON t.id = s.tunnel_id
                      CROSS JOIN LATERAL (SELECT public.ST_LineLocatePoint(t.alignment, $2) AS share) l
                      WHERE s.id = $1 AND l.share > 0 AND l.share < 1))
$$;
COMMENT ON FUNCTION tunnel_internal.scanner_chainage(int, geometry) IS
    'Chainage (m) of a scanner position: from unroll, else along the given axis; NULL beyond its ends and on a site';

CREATE OR REPLACE VIEW tunnel_api.scan_station AS
SELECT (c.survey_id::bigint << 32) | (c.scan_id::bigint & 4294967295) AS id, c.survey_id, s.name AS survey, s.date, c.scan_id, k.chainage,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, k.chainage) l) AS label, public.st_z(c.geom) AS height,
       c.geom::public.geometry AS geom
  FROM tunnel.station c
  JOIN tunnel.survey s ON s.id = c.survey_id
 CROSS JOIN LATERAL (SELECT tunnel_internal.scanner_chainage(c.survey_id, c.geom) AS chainage OFFSET 0) k;
COMMENT ON VIEW tunnel_api.scan_station IS 'Positions of static scanners';
COMMENT ON COLUMN tunnel_api.scan_station.date IS 'Day of the survey';
COMMENT ON COLUMN tunnel_api.scan_station.scan_id IS 'Number of the scan, as in the points';
COMMENT ON COLUMN tunnel_api.scan_station.chainage IS 'Chainage, m; NULL beyond the ends of the axis';
COMMENT ON COLUMN tunnel_api.scan_station.label IS 'Station, as 12+345.678; NULL beyond the ends of the axis';
COMMENT ON COLUMN tunnel_api.scan_station.height IS 'Height of the scanner, m';
COMMENT ON COLUMN tunnel_api.scan_station.geom IS 'Position of the scanner, tunnel''s SRID';

-- One vertex for each second is enough for a map, and one line for each minute for its times. A line continues to the
-- beginning of the next one, and ends at gaps: intervals longer than survey.longest_interval.
CREATE OR REPLACE VIEW tunnel_api.trajectory AS
SELECT (s.id::bigint << 38) | ((m.minute & 4294967295) << 6) | m.part AS id, s.id AS survey_id, s.name AS survey, s.date,
       m.time_from, m.time_to, least(a.chainage, b.chainage) AS chainage_from, greatest(a.chainage, b.chainage) AS chainage_to,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, least(a.chainage, b.chainage)) l) AS label_from,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, greatest(a.chainage, b.chainage)) l) AS label_to,
       a.chainage <= b.chainage AS upwards, m.poses, public.st_3dlength(m.geom) / nullif(m.time_to - m.time_from, 0) AS speed,
       m.geom::public.geometry AS geom
  FROM tunnel.survey s
 CROSS JOIN LATERAL (
        SELECT g.minute, dense_rank() OVER (PARTITION BY g.minute ORDER BY g.piece) - 1 AS part, min(g.time) AS time_from,
               max(coalesce(g.next_time, g.time)) AS time_to, sum(g.poses)::bigint AS poses,
               CASE WHEN count(*) > 1 OR bool_or(g.next_geom IS NOT NULL) THEN
                   public.st_makeline(array_agg(g.geom ORDER BY g.time)
                       || coalesce((array_agg(g.next_geom ORDER BY g.time DESC))[1:1], '{}')) END AS geom
          FROM (SELECT v.*, floor(v.time / 60)::bigint AS minute,
                       lead(v.time) OVER w AS next_time, lead(v.geom) OVER w AS next_geom
                  FROM (SELECT q.second, q.piece, min(q.time) AS time, count(*) AS poses,
                               (array_agg(q.geom ORDER BY q.time))[1] AS geom
                          FROM (SELECT p.time, p.geom, floor(p.time)::bigint AS second,
                                       count(*) FILTER (WHERE p.apart > s.longest_interval) OVER (ORDER BY p.time) AS piece
                                  FROM (SELECT o.time, o.geom, o.time - lag(o.time) OVER (ORDER BY o.time) AS apart
                                          FROM tunnel.pose o
                                         WHERE o.survey_id = s.id) p) q
                         GROUP BY q.piece, q.second) v
                WINDOW w AS (PARTITION BY v.piece ORDER BY v.time)) g
         GROUP BY g.minute, g.piece) m
 CROSS JOIN LATERAL (SELECT tunnel_internal.scanner_chainage(s.id, public.st_startpoint(m.geom)) AS chainage OFFSET 0) a
 CROSS JOIN LATERAL (SELECT tunnel_internal.scanner_chainage(s.id, public.st_endpoint(m.geom)) AS chainage OFFSET 0) b
 WHERE m.geom IS NOT NULL;
COMMENT ON VIEW tunnel_api.trajectory IS
    'Path of a mobile scanner: a line for each minute, with a vertex for each second. Lines end at gaps';
COMMENT ON COLUMN tunnel_api.trajectory.date IS 'Day of the survey';
COMMENT ON COLUMN tunnel_api.trajectory.time_from IS 'Time of its beginning, s, as gps_time of the points';
COMMENT ON COLUMN tunnel_api.trajectory.time_to IS
    'Time of its end, s: beginning of the next line, or last vertex before a gap';
COMMENT ON COLUMN tunnel_api.trajectory.chainage_from IS
    'Smaller chainage of its two ends (or of the one end within the axis), m';
COMMENT ON COLUMN tunnel_api.trajectory.chainage_to IS
    'Greater chainage of its two ends (or of the one end within the axis), m';
COMMENT ON COLUMN tunnel_api.trajectory.upwards IS
    'True if the scanner moved up-chainage; NULL if an end lies beyond the ends of the axis';
COMMENT ON COLUMN tunnel_api.trajectory.poses IS 'Number of positions in the trajectory';
COMMENT ON COLUMN tunnel_api.trajectory.speed IS 'Mean speed, m/s';
COMMENT ON COLUMN tunnel_api.trajectory.geom IS 'Path of the scanner, tunnel''s SRID';
