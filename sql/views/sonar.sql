-- Views of sonar scans below the water: positions with their accuracy, residuals, ladders (Moisan et al., 2015).

CREATE OR REPLACE VIEW tunnel_api.sonar_scan AS
SELECT c.id, c.survey_id, s.name AS survey, c.name, c.up, c.water_level, c.state, c.undetermined, c.rotation,
       c.translation, c.scale, c.covariance, sqrt(c.covariance[25]) AS sigma_x, sqrt(c.covariance[33]) AS sigma_y,
       sqrt(c.covariance[41]) AS sigma_z, c.registered_at,
       public.ST_SetSRID(public.ST_MakePoint(c.translation[1], c.translation[2], c.translation[3]), t.srid)
           ::public.geometry AS geom
  FROM tunnel.sonar_scan c
  JOIN tunnel.survey s ON s.id = c.survey_id
  JOIN tunnel.tunnel t ON t.id = s.tunnel_id;
COMMENT ON VIEW tunnel_api.sonar_scan IS
    'Sonar scans below the water. A point of the file lies in the tunnel at rotation · (scale · point) + translation';
COMMENT ON COLUMN tunnel_api.sonar_scan.sigma_x IS 'Standard deviation of the position along x, m';
COMMENT ON COLUMN tunnel_api.sonar_scan.sigma_y IS 'Standard deviation of the position along y, m';
COMMENT ON COLUMN tunnel_api.sonar_scan.sigma_z IS 'Standard deviation of the height, m';
COMMENT ON COLUMN tunnel_api.sonar_scan.geom IS
    'Position of the sonar, tunnel''s SRID; NULL if no pose was found or none is needed';

-- The ellipse in which a scan's place in plan lies with a probability of 95 % is that of covariance × 5.991 (chi², two degrees of
-- freedom); its half axes are the roots of the eigenvalues.
CREATE OR REPLACE VIEW tunnel_api.sonar_ellipse AS
SELECT c.id, c.survey_id, c.survey, c.name, c.state, 100 AS exaggeration, e.half_major, e.half_minor,
       public.ST_SetSRID(public.ST_Translate(public.ST_Rotate(public.ST_Scale(
           public.ST_Buffer(public.ST_MakePoint(0, 0), 1, 16), 100 * e.half_major, 100 * e.half_minor), e.turn),
           c.translation[1], c.translation[2]), public.ST_SRID(c.geom))::public.geometry AS geom
  FROM tunnel_api.sonar_scan c
 CROSS JOIN LATERAL (
    SELECT (c.covariance[25] + c.covariance[33]) / 2 AS mean, c.covariance[26] AS xy,
           sqrt(((c.covariance[25] - c.covariance[33]) / 2) ^ 2 + c.covariance[26] ^ 2) AS half) v
 CROSS JOIN LATERAL (
    SELECT sqrt(5.991 * (v.mean + v.half)) AS half_major, sqrt(5.991 * greatest(v.mean - v.half, 0)) AS half_minor,
           atan2(2 * v.xy, c.covariance[25] - c.covariance[33]) / 2 AS turn) e
 WHERE c.geom IS NOT NULL;
COMMENT ON VIEW tunnel_api.sonar_ellipse IS
    '95 % confidence ellipses of the horizontal positions of sonar scans, drawn 100 times enlarged';
COMMENT ON COLUMN tunnel_api.sonar_ellipse.name IS 'Name of the scan''s file';
COMMENT ON COLUMN tunnel_api.sonar_ellipse.state IS 'determined, or weak (less precise than required)';
COMMENT ON COLUMN tunnel_api.sonar_ellipse.exaggeration IS 'Factor of enlargement';
COMMENT ON COLUMN tunnel_api.sonar_ellipse.half_major IS 'Semi-major axis, m';
COMMENT ON COLUMN tunnel_api.sonar_ellipse.half_minor IS 'Semi-minor axis, m';
COMMENT ON COLUMN tunnel_api.sonar_ellipse.geom IS 'Ellipse, 100 times enlarged, in plan, tunnel''s SRID';

CREATE OR REPLACE VIEW tunnel_api.registration_residual AS
SELECT r.id, c.survey_id, s.name AS survey, r.scan_id, c.name AS scan, r.kind, r.name, r.count, r.median, r.p95
  FROM tunnel.registration_residual r
  JOIN tunnel.sonar_scan c ON c.id = r.scan_id
  JOIN tunnel.survey s ON s.id = c.survey_id;
COMMENT ON VIEW tunnel_api.registration_residual IS
    'Residuals between sonar scans and the walls, ladders and other scans that they were fitted to';
COMMENT ON COLUMN tunnel_api.registration_residual.scan IS 'Name of the sonar scan';

CREATE OR REPLACE VIEW tunnel_api.ladder AS
SELECT l.id, l.survey_id, s.name AS survey, l.name, l.origin, l.axes, l.rms, l.rungs, l.scans,
       public.ST_SetSRID(public.ST_MakePoint(l.origin[1], l.origin[2], l.origin[3]), t.srid)::public.geometry AS geom
  FROM tunnel.ladder l
  JOIN tunnel.survey s ON s.id = l.survey_id
  JOIN tunnel.tunnel t ON t.id = s.tunnel_id;
COMMENT ON VIEW tunnel_api.ladder IS 'Ladders in the water, as the laser shows them above it';
COMMENT ON COLUMN tunnel_api.ladder.geom IS 'Origin of the ladder, tunnel''s SRID';

CREATE OR REPLACE VIEW tunnel_api.sonar_point AS
SELECT p.id, p.survey_id, s.name AS survey, p.km, p.scan_id, c.name AS scan, p.chainage, p.across, p.classification,
       public.ST_Z(p.geom) - c.water_level AS over_water, p.geom::public.geometry AS geom
  FROM tunnel.sonar_point p
  JOIN tunnel.sonar_scan c ON c.id = p.scan_id
  LEFT JOIN tunnel.survey s ON s.id = p.survey_id;
COMMENT ON VIEW tunnel_api.sonar_point IS 'Points of sonar scans in the tunnel, thinned, without false echoes';
COMMENT ON COLUMN tunnel_api.sonar_point.scan IS 'Name of the sonar scan';
COMMENT ON COLUMN tunnel_api.sonar_point.over_water IS 'Height above the water, m; negative below it';

CREATE OR REPLACE VIEW tunnel_api.bed AS
SELECT b.id, b.survey_id, s.name AS survey, b.km, b.n + 0.5::float8 AS chainage, (b.across_n + 0.5::float8) / 10 AS across, b.height, b.depth,
       b.sigma, b.points
  FROM tunnel.bed b
  JOIN tunnel.survey s ON s.id = b.survey_id;
COMMENT ON VIEW tunnel_api.bed IS
    'Bed below the water in cells of 1 m along and 0.1 m across the axis. Cells without sonar are missing. Where there is silt, its top';
COMMENT ON COLUMN tunnel_api.bed.chainage IS 'Chainage of the middle of the cell, m';
COMMENT ON COLUMN tunnel_api.bed.across IS 'Distance of the middle of the cell to the right of the given axis, m';

CREATE OR REPLACE FUNCTION tunnel_api.depth(survey text, chainage float8, across float8, OUT depth float8, OUT sigma float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT b.depth, b.sigma
      FROM tunnel.bed b
      JOIN tunnel.survey s ON s.id = b.survey_id
     WHERE s.id = tunnel_api.survey_id($1) AND b.n = floor($2) AND b.across_n = floor($3 * 10)
$$;
COMMENT ON FUNCTION tunnel_api.depth(text, float8, float8) IS
    'Depth of water over the bed (m) at a chainage and a distance to the right of the given axis (m), with its standard deviation; NULL without sonar';

CREATE OR REPLACE FUNCTION tunnel_api.bed_volume(
    survey text, chainage_from float8, chainage_to float8, height float8,
    OUT above float8, OUT below float8, OUT sigma float8, OUT seen_area float8, OUT unseen_area float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    WITH cell AS (
        SELECT b.n, b.across_n, b.height, b.sigma,
               0.1 * (least($3, b.n + 1) - greatest($2, b.n)) AS area
          FROM tunnel.bed b
          JOIN tunnel.survey s ON s.id = b.survey_id
         WHERE s.id = tunnel_api.survey_id($1) AND b.n >= floor($2) AND b.n < $3 AND tunnel_internal.in_order($2, $3)),
    width AS (
        SELECT percentile_cont(0.95) WITHIN GROUP (ORDER BY span) AS span
          FROM (SELECT 0.1 * (max(across_n) - min(across_n) + 1) AS span FROM cell GROUP BY n) metre)
    SELECT sum(area * greatest(cell.height - $4, 0)), sum(area * greatest($4 - cell.height, 0)),
           sum(area * cell.sigma), sum(area), greatest(max(width.span) * ($3 - $2) - sum(area), 0)
      FROM cell, width
$$;
COMMENT ON FUNCTION tunnel_api.bed_volume(text, float8, float8, float8) IS
    'Volumes between two chainages (m): bed above a height (m, e.g. silt above a design bed) and space below it, m³, with their standard deviation for an error common to all cells (the pose). seen_area: area with sonar; unseen_area: area without, assuming the usual width of the bed, m². Areas without sonar are in no volume';

CREATE OR REPLACE VIEW tunnel_api.water_level AS
SELECT w.id, w.survey_id, s.name AS survey, w.km, w.height, w.changed_at
  FROM tunnel.water_level w
  JOIN tunnel.survey s ON s.id = w.survey_id
 WHERE w.height IS NOT NULL;
COMMENT ON VIEW tunnel_api.water_level IS 'Height of the water in kilometres with sonar scans';
COMMENT ON COLUMN tunnel_api.water_level.height IS 'Height of the water surface, m';
