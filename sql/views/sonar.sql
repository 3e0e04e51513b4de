-- Views of sonar scans below the water: where they stood, how well that is known and by what, and the ladders (Moisan et al., 2015).

CREATE OR REPLACE VIEW tunnel_api.sonar_scan AS
SELECT c.id, c.survey_id, s.name AS survey, c.name, c.up, c.water_level, c.state, c.undetermined, c.rotation,
       c.translation, c.scale, c.covariance, sqrt(c.covariance[25]) AS sigma_x, sqrt(c.covariance[33]) AS sigma_y,
       sqrt(c.covariance[41]) AS sigma_z, c.registered_at,
       public.ST_SetSRID(public.ST_MakePoint(c.translation[1], c.translation[2], c.translation[3]), t.srid)
           ::public.geometry(PointZ) AS geom
  FROM tunnel.sonar_scan c
  JOIN tunnel.survey s ON s.id = c.survey_id
  JOIN tunnel.tunnel t ON t.id = s.tunnel_id;
COMMENT ON VIEW tunnel_api.sonar_scan IS
    'Sonar scans below the water: a point of the file lies in the tunnel at rotation · (scale · point) + translation';
COMMENT ON COLUMN tunnel_api.sonar_scan.sigma_x IS 'Standard deviation of its place along x, m';
COMMENT ON COLUMN tunnel_api.sonar_scan.sigma_y IS 'Standard deviation of its place along y, m';
COMMENT ON COLUMN tunnel_api.sonar_scan.sigma_z IS 'Standard deviation of its height, m';
COMMENT ON COLUMN tunnel_api.sonar_scan.geom IS 'Place of the sonar, in the tunnel''s SRID; NULL where no pose was found';

CREATE OR REPLACE VIEW tunnel_api.registration_residual AS
SELECT r.id, c.survey_id, s.name AS survey, r.scan_id, c.name AS scan, r.kind, r.name, r.count, r.median, r.p95
  FROM tunnel.registration_residual r
  JOIN tunnel.sonar_scan c ON c.id = r.scan_id
  JOIN tunnel.survey s ON s.id = c.survey_id;
COMMENT ON VIEW tunnel_api.registration_residual IS
    'What is left between sonar scans and the walls, ladders and other scans that they were fitted to';
COMMENT ON COLUMN tunnel_api.registration_residual.scan IS 'Name of the sonar scan';

CREATE OR REPLACE VIEW tunnel_api.ladder AS
SELECT l.id, l.survey_id, s.name AS survey, l.name, l.origin, l.axes, l.rms, l.rungs, l.scans,
       public.ST_SetSRID(public.ST_MakePoint(l.origin[1], l.origin[2], l.origin[3]), t.srid)::public.geometry(PointZ) AS geom
  FROM tunnel.ladder l
  JOIN tunnel.survey s ON s.id = l.survey_id
  JOIN tunnel.tunnel t ON t.id = s.tunnel_id;
COMMENT ON VIEW tunnel_api.ladder IS 'Ladders that stand in the water, as the laser sees them above it';
COMMENT ON COLUMN tunnel_api.ladder.geom IS 'Its origin, in the tunnel''s SRID';
