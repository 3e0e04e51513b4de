-- Walls of the tunnel in plan. Needs survey_ends (geometry/survey_ends.sql) and map_point (geometry/unroll.sql).

-- The widest place of the lining at each section, left and right of the axis. A line ends where segments without sections
-- begin; its first and last section extend to the end of their segments, as far as these were scanned.
CREATE OR REPLACE VIEW tunnel_api.outline AS
SELECT s.id::bigint * 100000000 + 50000000 + 2 * w.first + (w.side = 'right')::integer AS id, s.id AS survey_id, s.name AS survey,
       w.side, w.chainage_from, w.chainage_to,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, w.chainage_from) l) AS label_from,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, w.chainage_to) l) AS label_to,
       w.nearest, w.farthest, w.geom::public.geometry AS geom
  FROM tunnel.survey s
 CROSS JOIN LATERAL tunnel_api.survey_ends(s.id) e
 CROSS JOIN LATERAL (
    SELECT p.side, min(p.segment) AS first, min(p.chainage) AS chainage_from, max(p.chainage) AS chainage_to,
           min(abs(p.across)) AS nearest, max(abs(p.across)) AS farthest,
           public.st_makeline(tunnel_internal.map_point(s.id, p.chainage, p.across) ORDER BY p.chainage) AS geom
      FROM (
        SELECT h.piece, h.segment, q.side, q.across, r.chainage
          FROM (SELECT c.id, c.segment, c.chainage, c.radius, c.piece,
                       row_number() OVER (PARTITION BY c.piece ORDER BY c.chainage) = 1 AS is_first,
                       row_number() OVER (PARTITION BY c.piece ORDER BY c.chainage DESC) = 1 AS is_last
                  FROM (SELECT b.*, b.segment - dense_rank() OVER (ORDER BY b.segment) AS piece
                          FROM tunnel.section b WHERE b.survey_id = s.id) c) h
          JOIN tunnel.segment g ON g.survey_id = s.id AND g.n = h.segment
         CROSS JOIN LATERAL (
            SELECT min(a.radius * sind(a.n - 181)) AS widest_left, max(a.radius * sind(a.n - 181)) AS widest_right
              FROM unnest(h.radius) WITH ORDINALITY a (radius, n)) u
         CROSS JOIN LATERAL (VALUES ('left', u.widest_left), ('right', u.widest_right)) q (side, across)
         CROSS JOIN LATERAL (
            SELECT h.chainage
             UNION SELECT greatest(g.chainage_from, e.chainage_from) WHERE h.is_first
             UNION SELECT least(g.chainage_to, e.chainage_to) WHERE h.is_last) r) p
     GROUP BY p.piece, p.side) w;
COMMENT ON VIEW tunnel_api.outline IS
    'Walls of the tunnel in plan, left and right: the widest place of the lining at each cross-section. Lines end where segments have no sections';
COMMENT ON COLUMN tunnel_api.outline.side IS 'left or right, looking up-chainage';
COMMENT ON COLUMN tunnel_api.outline.nearest IS 'Smallest distance from the axis, m';
COMMENT ON COLUMN tunnel_api.outline.farthest IS 'Greatest distance from the axis, m';
COMMENT ON COLUMN tunnel_api.outline.geom IS 'Line in plan, tunnel''s SRID';
