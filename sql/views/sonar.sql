-- Views of sonar scans below the water: where they stood, how well that is known and by what, and the ladders (Moisan et al., 2015).

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
    'Sonar scans below the water: a point of the file lies in the tunnel at rotation · (scale · point) + translation';
COMMENT ON COLUMN tunnel_api.sonar_scan.sigma_x IS 'Standard deviation of its place along x, m';
COMMENT ON COLUMN tunnel_api.sonar_scan.sigma_y IS 'Standard deviation of its place along y, m';
COMMENT ON COLUMN tunnel_api.sonar_scan.sigma_z IS 'Standard deviation of its height, m';
COMMENT ON COLUMN tunnel_api.sonar_scan.geom IS 'Place of the sonar, in the tunnel''s SRID; NULL where no pose was found, or none is needed';

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
    'Ellipses in which the places of sonar scans in plan lie with a probability of 95 %, drawn 100 times as large';
COMMENT ON COLUMN tunnel_api.sonar_ellipse.name IS 'Name of the scan''s file';
COMMENT ON COLUMN tunnel_api.sonar_ellipse.state IS 'determined, or weak (known worse than it should be)';
COMMENT ON COLUMN tunnel_api.sonar_ellipse.exaggeration IS 'So many times as large as it is';
COMMENT ON COLUMN tunnel_api.sonar_ellipse.half_major IS 'Greater half axis, m';
COMMENT ON COLUMN tunnel_api.sonar_ellipse.half_minor IS 'Lesser half axis, m';
COMMENT ON COLUMN tunnel_api.sonar_ellipse.geom IS 'Ellipse, drawn 100 times as large, in plan, tunnel''s SRID';

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
       public.ST_SetSRID(public.ST_MakePoint(l.origin[1], l.origin[2], l.origin[3]), t.srid)::public.geometry AS geom
  FROM tunnel.ladder l
  JOIN tunnel.survey s ON s.id = l.survey_id
  JOIN tunnel.tunnel t ON t.id = s.tunnel_id;
COMMENT ON VIEW tunnel_api.ladder IS 'Ladders that stand in the water, as the laser sees them above it';
COMMENT ON COLUMN tunnel_api.ladder.geom IS 'Its origin, in the tunnel''s SRID';

CREATE OR REPLACE VIEW tunnel_api.sonar_point AS
SELECT p.id, p.survey_id, p.km, p.scan_id, c.name AS scan, p.chainage, p.across, p.classification,
       public.ST_Z(p.geom) - c.water_level AS over_water, p.geom::public.geometry AS geom
  FROM tunnel.sonar_point p
  JOIN tunnel.sonar_scan c ON c.id = p.scan_id;
COMMENT ON VIEW tunnel_api.sonar_point IS 'Points of sonar scans in the tunnel, thinned and without false echoes';
COMMENT ON COLUMN tunnel_api.sonar_point.scan IS 'Name of the sonar scan';
COMMENT ON COLUMN tunnel_api.sonar_point.over_water IS 'Height above the water, m; below it less than 0';

CREATE OR REPLACE VIEW tunnel_api.bed AS
SELECT b.id, b.survey_id, s.name AS survey, b.km, b.n + 0.5::float8 AS chainage, (b.across_n + 0.5::float8) / 10 AS across, b.height, b.depth,
       b.sigma, b.points
  FROM tunnel.bed b
  JOIN tunnel.survey s ON s.id = b.survey_id;
COMMENT ON VIEW tunnel_api.bed IS
    'The bed below the water in cells of 1 m along and 0.1 m across; cells that no sonar saw are not there. Of silt it is the top';
COMMENT ON COLUMN tunnel_api.bed.chainage IS 'Chainage of the cell''s middle, m';
COMMENT ON COLUMN tunnel_api.bed.across IS 'Place of the cell''s middle right of the given axis, m';

CREATE OR REPLACE FUNCTION tunnel_api.depth(survey text, chainage float8, across float8, OUT depth float8, OUT sigma float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT b.depth, b.sigma
      FROM tunnel.bed b
      JOIN tunnel.survey s ON s.id = b.survey_id
     WHERE s.name = $1 AND b.n = floor($2) AND b.across_n = floor($3 * 10)
$$;
COMMENT ON FUNCTION tunnel_api.depth(text, float8, float8) IS
    'Depth of the water, m, over the cell of the bed at a chainage and a place right of the given axis, m, and its standard deviation; NULL where no sonar saw the bed';

CREATE OR REPLACE FUNCTION tunnel_api.bed_volume(
    survey text, chainage_from float8, chainage_to float8, height float8,
    OUT above float8, OUT below float8, OUT sigma float8, OUT seen_area float8, OUT unseen_area float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    WITH cell AS (
        SELECT b.n, b.across_n, b.height, b.sigma,
               0.1 * (least($3, b.n + 1) - greatest($2, b.n)) AS area
          FROM tunnel.bed b
          JOIN tunnel.survey s ON s.id = b.survey_id
         WHERE s.name = $1 AND b.n >= floor($2) AND b.n < $3 AND tunnel_internal.in_order($2, $3)),
    width AS (
        SELECT percentile_cont(0.95) WITHIN GROUP (ORDER BY span) AS span
          FROM (SELECT 0.1 * (max(across_n) - min(across_n) + 1) AS span FROM cell GROUP BY n) metre)
    SELECT sum(area * greatest(cell.height - $4, 0)), sum(area * greatest($4 - cell.height, 0)),
           sum(area * cell.sigma), sum(area), greatest(max(width.span) * ($3 - $2) - sum(area), 0)
      FROM cell, width
$$;
COMMENT ON FUNCTION tunnel_api.bed_volume(text, float8, float8, float8) IS
    'Volume of the bed above a height (tunnel''s system, m) between two chainages, as silt above a design bed, and of the room below it, m³; its standard deviation if all cells err alike, as a pose does; the area seen, and that which no sonar saw, taken as wide as the bed mostly is, m²: nothing is said of the latter';

CREATE OR REPLACE VIEW tunnel_api.water_level AS
SELECT w.id, w.survey_id, s.name AS survey, w.km, w.height, w.changed_at
  FROM tunnel.water_level w
  JOIN tunnel.survey s ON s.id = w.survey_id
 WHERE w.height IS NOT NULL;
COMMENT ON VIEW tunnel_api.water_level IS 'The water in kilometres into which sonar scans were loaded';
COMMENT ON COLUMN tunnel_api.water_level.height IS 'Of the water, m';
