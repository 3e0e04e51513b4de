-- Results of stage ground and `tunneldb spheres`: classes of points, ground, clusters, target spheres. Needs stationing
-- (geometry/stationing.sql).

CREATE OR REPLACE VIEW tunnel_api.class AS
SELECT c.id, c.name, c.description
  FROM (VALUES
    (1, 'unassigned', 'Outside the surveyed tunnel: nothing is known of it'),
    (2, 'ground', 'Floor, ballast, sleepers, roadway, walkway'),
    (64, 'lining', 'Lining of the tunnel'),
    (65, 'niche', 'Lining of a niche or another recess, behind the surface of the sections'),
    (66, 'appendage', 'What hangs on the lining: cable, tray, pipe, box, lamp, catenary'),
    (67, 'rail', 'Rails, and other bars along the ground'),
    (68, 'object', 'What stands on the ground: people, trolleys, equipment, bollards'),
    (69, 'sphere', 'Target sphere'),
    (70, 'noise', 'Points by themselves in the air, or behind the lining')) AS c (id, name, description);
COMMENT ON VIEW tunnel_api.class IS
    'Classes of points: codes of LAS. 2 is defined by ASPRS; those from 64 on are free for the user';
COMMENT ON COLUMN tunnel_api.class.id IS 'Code, as in tunnel_api.point, tunnel_api.cluster and exported files';
COMMENT ON COLUMN tunnel_api.class.name IS 'Name of the class';
COMMENT ON COLUMN tunnel_api.class.description IS 'Surface or object that the points lie on';

CREATE OR REPLACE VIEW tunnel_api.ground AS
SELECT g.survey_id::bigint * 100000000 + 50000000 + g.n AS id, g.survey_id, s.name AS survey, g.km, g.n::float8 AS chainage,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, g.n) l) AS label, g.across, g.height, g.gamma,
       g.foot[1] AS foot_left, g.foot[2] AS foot_right, g.arc_left, g.arc_right, g.geom::public.geometry AS geom
  FROM tunnel.ground g
  JOIN tunnel.survey s ON s.id = g.survey_id;
COMMENT ON VIEW tunnel_api.ground IS 'Ground at each metre of chainage where there is one (Li et al., 2023)';
COMMENT ON COLUMN tunnel_api.ground.foot_left IS 'Foot of the left wall, m right of the axis; NaN where there is no wall';
COMMENT ON COLUMN tunnel_api.ground.foot_right IS 'Foot of the right wall, m right of the axis; NaN where there is no wall';

-- The cells that contain a cluster's points are for the export of classified files, and stay in the table.
CREATE OR REPLACE VIEW tunnel_api.cluster AS
SELECT c.id, c.survey_id, s.name AS survey, c.km,
       (SELECT min(g.n) FROM tunnel.segment g
         WHERE g.survey_id = c.survey_id AND g.n BETWEEN m.near - 2 AND m.near + 2
           AND m.chainage BETWEEN g.chainage_from AND g.chainage_to) AS segment,
       c.class, k.name AS class_name, c.chainage_from, c.chainage_to,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, m.chainage) l) AS label,
       c.height_from, c.height_to, c.points, public.st_area(c.geom) AS area, c.geom::public.geometry AS geom
  FROM tunnel.cluster c
  JOIN tunnel.survey s ON s.id = c.survey_id
  JOIN tunnel.tunnel t ON t.id = s.tunnel_id
  LEFT JOIN tunnel_api.class k ON k.id = c.class
 CROSS JOIN LATERAL (SELECT (c.chainage_from + c.chainage_to) / 2 AS chainage,
                            floor((c.chainage_from + c.chainage_to) / 2 / t.spacing)::integer AS near) m;
COMMENT ON VIEW tunnel_api.cluster IS
    'Objects in the tunnel, fixtures in front of the lining and niches behind it, found by stage ground (Li et al., 2023)';
COMMENT ON COLUMN tunnel_api.cluster.segment IS 'Number of the segment at its middle';
COMMENT ON COLUMN tunnel_api.cluster.class_name IS 'Name of the class';
COMMENT ON COLUMN tunnel_api.cluster.label IS 'Station of its middle, as 12+345.678';
COMMENT ON COLUMN tunnel_api.cluster.area IS 'Area of the hull in plan, m²';

CREATE OR REPLACE VIEW tunnel_api.target_sphere AS
SELECT p.id, p.survey_id, s.name AS survey, p.km,
       (SELECT min(g.n) FROM tunnel.segment g
         WHERE g.survey_id = p.survey_id AND g.n BETWEEN m.near - 2 AND m.near + 2
           AND p.chainage BETWEEN g.chainage_from AND g.chainage_to) AS segment,
       p.number, p.scan_id, p.chainage, (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, p.chainage) l) AS label,
       public.st_x(p.geom) AS x, public.st_y(p.geom) AS y, public.st_z(p.geom) AS z,
       p.radius, p.nominal, p.rms, p.sigma, p.coverage, p.points, p.found_at, p.geom::public.geometry AS geom
  FROM tunnel.target_sphere p
  JOIN tunnel.survey s ON s.id = p.survey_id
  JOIN tunnel.tunnel t ON t.id = s.tunnel_id
 CROSS JOIN LATERAL (SELECT floor(p.chainage / t.spacing)::integer AS near) m;
COMMENT ON VIEW tunnel_api.target_sphere IS 'Target spheres, one row for each scan that shows one, written by tunneldb spheres (Li et al., 2023)';
COMMENT ON COLUMN tunnel_api.target_sphere.segment IS 'Number of the segment at its centre';
COMMENT ON COLUMN tunnel_api.target_sphere.label IS 'Station of its centre, as 12+345.678';
COMMENT ON COLUMN tunnel_api.target_sphere.x IS 'Easting of the centre, tunnel''s SRID, m';
COMMENT ON COLUMN tunnel_api.target_sphere.y IS 'Northing of the centre, tunnel''s SRID, m';
COMMENT ON COLUMN tunnel_api.target_sphere.z IS 'Height of the centre, m';
