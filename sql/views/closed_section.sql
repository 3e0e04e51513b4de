-- Sections of canal tunnels, closed below the water with sonar scans.

-- Pieces of each section in kilometres with water, from node to node (one for each degree, from straight below the axis to
-- the left): origin, length, and depth below the water.
CREATE OR REPLACE VIEW tunnel_internal.section_piece AS
SELECT c.id * 1000 + n.n AS id, c.id AS section_id, c.survey_id, c.km, n.n,
       CASE WHEN k.state = 'interpolated' THEN 'unseen'
            WHEN w.height > (public.ST_Z(n.here) + public.ST_Z(n.next)) / 2 THEN 'submerged'
            ELSE 'lining' END AS part,
       w.height > (public.ST_Z(n.here) + public.ST_Z(n.next)) / 2 AS below,
       public.ST_3DDistance(n.here, n.next) AS length, n.here, n.next,
       (c.radius[n.n] * sind(n.n - 181) - c.radius[n.n + 1] * sind(n.n - 180))
           * (greatest(w.height - public.ST_Z(n.here), 0) + greatest(w.height - public.ST_Z(n.next), 0)) / 2 AS wet_area,
       w.height - least(public.ST_Z(n.here), public.ST_Z(n.next)) AS depth
  FROM tunnel.section c
  JOIN tunnel.water_level w ON w.survey_id = c.survey_id AND w.km = c.km AND w.height IS NOT NULL
 CROSS JOIN LATERAL (
    SELECT i AS n, public.ST_PointN(c.geom, i) AS here, public.ST_PointN(c.geom, i + 1) AS next
      FROM generate_series(1, 360) AS i) n
  JOIN tunnel.section_class k ON k.section_id = c.id AND k.class = floor((n.n - 0.5::float8) / c.angle_step);
COMMENT ON VIEW tunnel_internal.section_piece IS
    'Pieces of closed sections, one for each degree from straight below the axis to the left, in kilometres with sonar scans. closed_section and section_part consist of them';
COMMENT ON COLUMN tunnel_internal.section_piece.section_id IS 'Key of the section';
COMMENT ON COLUMN tunnel_internal.section_piece.n IS 'Number in the section, from 1';
COMMENT ON COLUMN tunnel_internal.section_piece.part IS
    'lining (above the water), submerged (inspected by sonar) or unseen (interpolated across a gap)';
COMMENT ON COLUMN tunnel_internal.section_piece.below IS 'True if it lies below the water';
COMMENT ON COLUMN tunnel_internal.section_piece.length IS 'Length, m';
COMMENT ON COLUMN tunnel_internal.section_piece.here IS 'Beginning of the piece, tunnel''s SRID, m';
COMMENT ON COLUMN tunnel_internal.section_piece.next IS 'End of the piece, tunnel''s SRID, m';
COMMENT ON COLUMN tunnel_internal.section_piece.wet_area IS 'Area of the water above it, m²';
COMMENT ON COLUMN tunnel_internal.section_piece.depth IS 'Depth of its lower end below the water, m';

CREATE OR REPLACE VIEW tunnel_api.closed_section AS
SELECT c.id, c.survey_id, s.name AS survey, c.km, c.chainage,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, c.chainage) l) AS label, w.height AS water_level,
       p.unseen, CASE WHEN p.unseen <= 0.2 THEN p.wet_area END AS wet_area,
       CASE WHEN p.unseen <= 0.2 THEN p.depth END AS depth, c.geom::public.geometry AS geom
  FROM tunnel.section c
  JOIN tunnel.survey s ON s.id = c.survey_id
  JOIN tunnel.water_level w ON w.survey_id = c.survey_id AND w.km = c.km
  JOIN LATERAL (
    SELECT coalesce(sum(q.length) FILTER (WHERE q.below AND q.part = 'unseen'), 0) / sum(q.length) FILTER (WHERE q.below) AS unseen,
           sum(q.wet_area) AS wet_area, max(q.depth) FILTER (WHERE q.part = 'submerged') AS depth
      FROM tunnel_internal.section_piece q
     WHERE q.section_id = c.id
    HAVING bool_or(q.part = 'submerged')) p ON true
 WHERE w.height IS NOT NULL;
COMMENT ON VIEW tunnel_api.closed_section IS
    'Cross-sections of canal tunnels, closed through the bed, where sonar measured anything below the water';
COMMENT ON COLUMN tunnel_api.closed_section.water_level IS 'Height of the water surface, m';
COMMENT ON COLUMN tunnel_api.closed_section.unseen IS
    'Share of the line below the water without sonar, 0 to 1; interpolated there';
COMMENT ON COLUMN tunnel_api.closed_section.wet_area IS
    'Cross-sectional area of the water, m²; NULL if sonar is missing on more than 20 % of the line below the water';
COMMENT ON COLUMN tunnel_api.closed_section.depth IS
    'Greatest measured depth, m; NULL if sonar is missing on more than 20 % of the line below the water';
COMMENT ON COLUMN tunnel_api.closed_section.geom IS 'Closed line in space, tunnel''s SRID, m';

CREATE OR REPLACE VIEW tunnel_api.section_part AS
SELECT min(r.id) AS id, r.survey_id, s.name AS survey, r.km, r.section_id, c.chainage, r.part, sum(r.length) AS length,
       public.ST_MakeLine(array_agg(r.here ORDER BY r.n) || (array_agg(r.next ORDER BY r.n DESC))[1])
           ::public.geometry AS geom
  FROM (SELECT q.*, q.n - row_number() OVER (PARTITION BY q.section_id, q.part ORDER BY q.n) AS run
          FROM tunnel_internal.section_piece q) r
  JOIN tunnel.section c ON c.id = r.section_id
  JOIN tunnel.survey s ON s.id = r.survey_id
 GROUP BY r.survey_id, s.name, r.km, r.section_id, c.chainage, r.part, r.run;
COMMENT ON VIEW tunnel_api.section_part IS
    'Parts of closed sections by origin: lining above the water, submerged, or unseen';
COMMENT ON COLUMN tunnel_api.section_part.id IS 'Key';
COMMENT ON COLUMN tunnel_api.section_part.section_id IS 'Key of the section';
COMMENT ON COLUMN tunnel_api.section_part.part IS
    'lining (above the water), submerged (inspected by sonar) or unseen (interpolated across a gap)';
COMMENT ON COLUMN tunnel_api.section_part.length IS 'Length, m';
COMMENT ON COLUMN tunnel_api.section_part.geom IS 'Line in space, tunnel''s SRID, m';

-- Intersection of sections with the water, joined from section to section; a line ends where a segment has no section.
CREATE OR REPLACE VIEW tunnel_api.waterline AS
SELECT min(p.id) AS id, p.survey_id, s.name AS survey, p.side, min(p.chainage) AS chainage_from, max(p.chainage) AS chainage_to,
       p.height, public.ST_MakeLine(p.geom ORDER BY p.chainage)::public.geometry AS geom
  FROM (SELECT c.id * 2 + (q.n > 180)::int AS id, c.survey_id, c.chainage, w.height,
               CASE WHEN q.n > 180 THEN 'right' ELSE 'left' END AS side,
               c.segment - dense_rank() OVER (PARTITION BY c.survey_id ORDER BY c.segment) AS piece,
               public.ST_3DLineInterpolatePoint(public.ST_MakeLine(q.here, q.next),
                   (public.ST_Z(q.here) - w.height) / (public.ST_Z(q.here) - public.ST_Z(q.next))) AS geom
          FROM tunnel.section c
          JOIN tunnel.water_level w ON w.survey_id = c.survey_id AND w.km = c.km
          JOIN tunnel_internal.section_piece q ON q.section_id = c.id
         WHERE (public.ST_Z(q.here) > w.height) <> (public.ST_Z(q.next) > w.height)) p
  JOIN tunnel.survey s ON s.id = p.survey_id
 GROUP BY p.survey_id, s.name, p.side, p.piece, p.height
HAVING count(*) > 1;
COMMENT ON VIEW tunnel_api.waterline IS 'Lines where the walls meet the water, in kilometres with sonar scans';
COMMENT ON COLUMN tunnel_api.waterline.id IS 'Key';
COMMENT ON COLUMN tunnel_api.waterline.side IS 'left or right, looking up-chainage';
COMMENT ON COLUMN tunnel_api.waterline.height IS 'Height of the water surface, m';
COMMENT ON COLUMN tunnel_api.waterline.geom IS 'Line in space, tunnel''s SRID, m';
COMMENT ON COLUMN tunnel_api.waterline.chainage_from IS 'Chainage of its first section, m';
COMMENT ON COLUMN tunnel_api.waterline.chainage_to IS 'Chainage of its last section, m';
