-- Layers of clearance: margins along the track on the map and below the unrolled lining, infringements in space and on the
-- lining. Needs clearance_section and clearance_infringement (measures/clearance.sql), whose comments these views take over
-- (views/comment.sql).

-- A metre of the track lies beside the chord of the given axis that holds its middle.
CREATE OR REPLACE VIEW tunnel_api.clearance_map AS
SELECT c.id, c.survey_id, c.survey, c.km, c.gauge, c.track, c.chainage_from, c.chainage_to, c.label, c.margin, c.margin_se,
       c.clock, c.class, c.cluster_id, c.seen_share, c.inside, c.passing, g.geom::public.geometry AS geom
  FROM tunnel_api.clearance_section c
  JOIN tunnel.survey s ON s.id = c.survey_id
  JOIN tunnel.tunnel t ON t.id = s.tunnel_id
 CROSS JOIN LATERAL (SELECT (c.chainage_from + c.chainage_to) / 2 / t.spacing AS at OFFSET 0) m
 CROSS JOIN LATERAL (
    SELECT v.n * t.spacing AS begin, public.ST_X(v.given) AS x, public.ST_Y(v.given) AS y,
           (public.ST_X(w.given) - public.ST_X(v.given)) / t.spacing AS dx,
           (public.ST_Y(w.given) - public.ST_Y(v.given)) / t.spacing AS dy, public.ST_SRID(v.given) AS srid
      FROM tunnel.axis_vertex v JOIN tunnel.axis_vertex w ON w.survey_id = v.survey_id AND w.n = v.n + 1
     WHERE v.survey_id = c.survey_id AND v.n BETWEEN floor(m.at)::int - 1 AND floor(m.at)::int + 1
     ORDER BY abs(v.n + 0.5 - m.at) LIMIT 1) a
 CROSS JOIN LATERAL (SELECT c.track_right / nullif(sqrt(a.dx ^ 2 + a.dy ^ 2), 0) AS aside OFFSET 0) r
 CROSS JOIN LATERAL (
    SELECT public.ST_SetSRID(public.ST_MakeLine(
               public.ST_MakePoint(a.x + (c.chainage_from - a.begin) * a.dx + r.aside * a.dy,
                                   a.y + (c.chainage_from - a.begin) * a.dy - r.aside * a.dx),
               public.ST_MakePoint(a.x + (c.chainage_to - a.begin) * a.dx + r.aside * a.dy,
                                   a.y + (c.chainage_to - a.begin) * a.dy - r.aside * a.dx)), a.srid) AS geom) g
 WHERE g.geom IS NOT NULL;
COMMENT ON VIEW tunnel_api.clearance_map IS
    'Smallest distance from a gauge for each metre, along the centre of the track on the map';
COMMENT ON COLUMN tunnel_api.clearance_map.geom IS 'One metre of the track in plan, tunnel''s SRID';

-- Beyond the lining's left end each outline and track has a row of its own, from the lining outwards.
CREATE OR REPLACE VIEW tunnel_api.clearance_unrolled AS
SELECT c.id, c.survey_id, s.name AS survey, c.km, c.gauge, c.track, c.chainage_from, c.chainage_to, c.label, c.margin,
       c.margin_se, c.clock, c.class, c.cluster_id, c.seen_share, c.inside, c.passing,
       public.ST_MakeEnvelope(c.chainage_from, e.arc - 1.5 * r.number, c.chainage_to, e.arc - 1.5 * r.number + 1, 0)
           ::public.geometry(Polygon, 0) AS geom
  FROM tunnel.survey s
 CROSS JOIN LATERAL (
    -- not the widest: a section that is measured astray would move all
    SELECT coalesce(percentile_cont(0.02) WITHIN GROUP (ORDER BY t.arc[1]), 0) AS arc
      FROM tunnel.section t WHERE t.survey_id = s.id OFFSET 0) e
 CROSS JOIN LATERAL (
    SELECT d.gauge, d.track, row_number() OVER (ORDER BY d.gauge, d.track) AS number
      FROM (SELECT DISTINCT q.gauge, q.track FROM tunnel.clearance_section q WHERE q.survey_id = s.id) d) r
  JOIN tunnel_api.clearance_section c ON c.survey_id = s.id AND c.gauge = r.gauge AND c.track = r.track;
COMMENT ON VIEW tunnel_api.clearance_unrolled IS
    'Smallest distance from a gauge for each metre, in one strip for each gauge and track below the unrolled lining';
COMMENT ON COLUMN tunnel_api.clearance_unrolled.geom IS 'In the unrolled plane (chainage, arc), m, below the lining''s left end';

CREATE OR REPLACE VIEW tunnel_api.clearance_infringement_3d AS
SELECT i.id, i.survey_id, i.survey, i.km, i.gauge, i.track, i.chainage_from, i.chainage_to, i.label, i.depth, i.clock, i.class,
       i.counts, i.cluster_id, i.points, i.geom
  FROM tunnel_api.clearance_infringement i;
COMMENT ON VIEW tunnel_api.clearance_infringement_3d IS 'Groups of points inside a gauge, in space';
COMMENT ON COLUMN tunnel_api.clearance_infringement_3d.geom IS 'Points, at most 200, deepest first, tunnel''s SRID';

CREATE OR REPLACE VIEW tunnel_api.clearance_infringement_unrolled AS
SELECT i.id, i.survey_id, i.survey, i.km, i.gauge, i.track, i.chainage_from, i.chainage_to, i.label, i.depth, i.clock, i.class,
       i.counts, i.cluster_id, i.points, i.unrolled AS geom
  FROM tunnel_api.clearance_infringement i WHERE i.unrolled IS NOT NULL;
COMMENT ON VIEW tunnel_api.clearance_infringement_unrolled IS
    'Areas of the unrolled lining covered by points inside a gauge. Objects away from the lining are not included';
COMMENT ON COLUMN tunnel_api.clearance_infringement_unrolled.geom IS 'In the unrolled plane (chainage, arc), m';
