-- Views of a tunnel and its geometry: tunnel, survey, file, point, axis, axis_vertex, segment, section, section_unrolled,
-- region. Each has a stable integer key first and its geometry last; all lengths are metres. Labels are
-- stations. Needs stationing (geometry/stationing.sql).
--
-- Tunnels differ in SRID, so what lies on the map is cast to plain geometry: a column that states a type but no SRID
-- makes QGIS look for rows of SRID 0, of which there are none. Of a plain column QGIS reads 100 rows (with "estimated
-- table metadata" in its connection) to find type, SRID and Z.

CREATE OR REPLACE VIEW tunnel_api.tunnel AS
SELECT t.id, t.name, t.srid, t.start_chainage, t.spacing, t.dry_region_limit, t.design, t.created_at,
       t.alignment IS NULL AS site, t.alignment::public.geometry AS geom
  FROM tunnel.tunnel t;
COMMENT ON VIEW tunnel_api.tunnel IS 'Tunnels, with their given axis';
COMMENT ON COLUMN tunnel_api.tunnel.srid IS 'Coordinate reference system of the tunnel''s geometry; 0: local coordinates, m';
COMMENT ON COLUMN tunnel_api.tunnel.start_chainage IS 'Chainage of the first vertex of the given axis, m';
COMMENT ON COLUMN tunnel_api.tunnel.spacing IS 'Distance between the vertices of a survey''s axis, m';
COMMENT ON COLUMN tunnel_api.tunnel.dry_region_limit IS
    'Area above which a dry region needs a reason and the approval of an operator, m²';
COMMENT ON COLUMN tunnel_api.tunnel.design IS
    'Source of the given axis: file and alignment, file and layer, or scan; NULL for a table';
COMMENT ON COLUMN tunnel_api.tunnel.geom IS 'Given axis, tunnel''s SRID; NULL for a site';
COMMENT ON COLUMN tunnel_api.tunnel.site IS 'True if it is a site: no axis, chainage, sections or unrolled lining';

CREATE OR REPLACE VIEW tunnel_api.survey AS
SELECT s.id, s.tunnel_id, t.name AS tunnel, s.name, s.date, s.platform, s.intensity_dimension, s.intensity_kind,
       s.reference, t.srid, s.created_at, f.files, f.points, f.chainage_from, f.chainage_to, s.time_offset,
       s.poses_accepted
  FROM tunnel.survey s
  JOIN tunnel.tunnel t ON t.id = s.tunnel_id
  LEFT JOIN LATERAL (SELECT count(*) AS files, coalesce(sum(kept), 0)::bigint AS points,
                            min(chainage_from) AS chainage_from, max(chainage_to) AS chainage_to
                       FROM tunnel.scan_file WHERE survey_id = s.id) f ON true;
COMMENT ON VIEW tunnel_api.survey IS 'Surveys (scanning campaigns) of tunnels, with their loaded data';
COMMENT ON COLUMN tunnel_api.survey.time_offset IS 'Seconds added to the times of the trajectory''s file; 0 if none';
COMMENT ON COLUMN tunnel_api.survey.poses_accepted IS
    'True if files are loaded although their points do not fit the scanner positions (survey set --accept-poses); each such file has a remark';
COMMENT ON COLUMN tunnel_api.survey.points IS 'Number of points in the database, at survey density';
COMMENT ON COLUMN tunnel_api.survey.intensity_kind IS 'amplitude (dB), reflectance (dB, range removed), linear (counts) or none';
COMMENT ON COLUMN tunnel_api.survey.reference IS
    'Range curve of the intensity: none, measured (on a target) or auto (from the lining of each kilometre, tunnel_api.range_curve)';

-- An archive that is imported while the survey is there, or twice, makes a second survey of one scan. Its first import names the
-- survey that it was. The one with that name is the original; if it was removed, the one that was imported first.
CREATE OR REPLACE VIEW tunnel_internal.survey_copy AS
WITH origin AS (
    SELECT s.id, s.tunnel_id, s.date, s.name, coalesce(i.name, s.name) AS first_name
      FROM tunnel.survey s
      LEFT JOIN LATERAL (SELECT r.parameters ->> 'survey' AS name FROM tunnel.run r
                          WHERE r.survey_id = s.id AND r.stage = 'import' AND r.outcome = 'done' ORDER BY r.id LIMIT 1) i ON true
), ranked AS (
    SELECT o.id, first_value(o.id) OVER (PARTITION BY o.tunnel_id, o.date, o.first_name
                                         ORDER BY o.name = o.first_name DESC, o.id) AS of_id
      FROM origin o
)
SELECT r.id AS survey_id, r.of_id FROM ranked r WHERE r.id <> r.of_id;
COMMENT ON VIEW tunnel_internal.survey_copy IS
    'Surveys that are copies of another survey (of_id) of the same tunnel, from an archive of it (survey import): not another scan, so not listed in series by date';
COMMENT ON COLUMN tunnel_internal.survey_copy.of_id IS 'Key of the survey that it is a copy of';

CREATE OR REPLACE VIEW tunnel_api.file AS
SELECT f.id, f.survey_id, s.name AS survey, f.name, tunnel_internal.for_operators(f.path) AS path, f.checksum, f.bytes, f.points, f.noise, f.outside, f.thinned,
       f.kept, f.chainage_from, f.chainage_to, f.extent, f.srid, f.loaded_at, f.invalid, f.unposed
  FROM tunnel.scan_file f
  JOIN tunnel.survey s ON s.id = f.survey_id;
COMMENT ON VIEW tunnel_api.file IS 'Loaded scan files, with the number of points dropped for each reason';
COMMENT ON COLUMN tunnel_api.file.path IS 'Path of the file; visible to operators only';
COMMENT ON COLUMN tunnel_api.file.checksum IS 'SHA-256 of the file';
COMMENT ON COLUMN tunnel_api.file.points IS 'Points in the file = invalid + outside + unposed + noise + thinned + kept';
COMMENT ON COLUMN tunnel_api.file.noise IS 'Points dropped as isolated noise (Xu et al., 2018, section II-D)';
COMMENT ON COLUMN tunnel_api.file.outside IS 'Points dropped because they lie too far from the axis or beyond its ends';
COMMENT ON COLUMN tunnel_api.file.invalid IS
    'Points dropped because a coordinate, their time or their intensity is not a number';
COMMENT ON COLUMN tunnel_api.file.unposed IS
    'Points dropped because the scanner position is unknown: outside the trajectory, in its gaps, or in a scan without a station';
COMMENT ON COLUMN tunnel_api.file.thinned IS 'Points dropped by thinning to survey density';

-- The key is the position of the row in its partition; it changes when the kilometre is rewritten. A condition on survey_id and km
-- reads these partitions only, one on chainage (BRIN) only a part of them.
CREATE OR REPLACE VIEW tunnel_api.point AS
SELECT ((p.km::bigint & 65535) << 44) | ((p.ctid::text::pg_catalog.point)[0]::bigint << 12)
         | (p.ctid::text::pg_catalog.point)[1]::bigint AS id,
       p.survey_id, s.name AS survey, p.km, p.chainage, p.segment, p.gps_time, p.scan_id, p.file_id, p.intensity,
       p.classification, p.class, p.geom::public.geometry AS geom
  FROM tunnel.point p
  LEFT JOIN tunnel.survey s ON s.id = p.survey_id;  -- LEFT: the planner omits the table if the name is not used
COMMENT ON VIEW tunnel_api.point IS
    'Points at survey density, in chainage order. Filter by survey_id and km (and chainage), or use the function points, to read one partition only';
COMMENT ON COLUMN tunnel_api.point.survey IS 'Name of the survey. A filter by it alone reads the points of all surveys: use survey_id = tunnel_api.survey_id(name)';
COMMENT ON COLUMN tunnel_api.point.id IS 'Key within a survey, valid until the kilometre is loaded or tagged again';
COMMENT ON COLUMN tunnel_api.point.km IS 'floor(chainage / 1000) on the given axis, at loading';
COMMENT ON COLUMN tunnel_api.point.chainage IS
    'Chainage, m: on the given axis after loading, on the measured axis after stage segments';
COMMENT ON COLUMN tunnel_api.point.segment IS
    'Number of the segment of the point; NULL before stage segments or off the tunnel';
COMMENT ON COLUMN tunnel_api.point.intensity IS 'As in the file, in the unit of the survey''s intensity_kind; 0 if none';

CREATE OR REPLACE VIEW tunnel_api.axis AS
SELECT s.id, s.id AS survey_id, s.name AS survey, t.name AS tunnel, a.vertices, a.interpolated, a.edited,
       a.first * t.spacing AS chainage_from, a.last * t.spacing AS chainage_to,
       (SELECT l.label FROM tunnel_api.stationing(t.id, a.first * t.spacing) l) AS label_from,
       (SELECT l.label FROM tunnel_api.stationing(t.id, a.last * t.spacing) l) AS label_to,
       a.geom::public.geometry AS geom
  FROM tunnel.survey s
  JOIN tunnel.tunnel t ON t.id = s.tunnel_id
  JOIN LATERAL (SELECT count(*) AS vertices,
                       count(*) FILTER (WHERE source = 'interpolated') AS interpolated,
                       count(*) FILTER (WHERE source = 'edited') AS edited,
                       min(n) AS first, max(n) AS last, public.st_makeline(v.geom ORDER BY n) AS geom
                  FROM tunnel.axis_vertex v WHERE v.survey_id = s.id) a ON a.vertices > 1;
COMMENT ON VIEW tunnel_api.axis IS 'Measured axis of each survey, one line';
COMMENT ON COLUMN tunnel_api.axis.id IS 'Key of the survey';
COMMENT ON COLUMN tunnel_api.axis.interpolated IS 'Number of vertices without enough points';
COMMENT ON COLUMN tunnel_api.axis.edited IS 'Number of vertices placed by hand';

CREATE OR REPLACE VIEW tunnel_api.axis_vertex AS
SELECT v.id, v.survey_id, s.name AS survey, v.n, v.km, v.n * t.spacing AS chainage,
       (SELECT l.label FROM tunnel_api.stationing(t.id, v.n * t.spacing) l) AS label, v.points, v.source, v.edited_by, v.edited_at,
       v.geom::public.geometry AS geom, v.remark
  FROM tunnel.axis_vertex v
  JOIN tunnel.survey s ON s.id = v.survey_id
  JOIN tunnel.tunnel t ON t.id = s.tunnel_id;
COMMENT ON VIEW tunnel_api.axis_vertex IS
    'Vertices of the measured axes. A vertex that is moved (UPDATE of geom) becomes edited and stays so; segments and later stages become stale';
COMMENT ON COLUMN tunnel_api.axis_vertex.n IS 'Number: the vertex has chainage n × spacing on the given axis';
COMMENT ON COLUMN tunnel_api.axis_vertex.points IS 'Number of averaged points';
COMMENT ON COLUMN tunnel_api.axis_vertex.source IS 'measured, interpolated or edited (by hand)';
COMMENT ON COLUMN tunnel_api.axis_vertex.remark IS
    'Reason why the measured position is not used, if it is not: it did not converge, or deviates from its neighbours';
COMMENT ON COLUMN tunnel_api.axis_vertex.edited_by IS 'Role that moved it last, set by the database';
COMMENT ON COLUMN tunnel_api.axis_vertex.edited_at IS 'Time of the last move, set by the database';

-- A segment is stale if its planes differ from those of the present axis (segment_moved).
CREATE OR REPLACE VIEW tunnel_api.segment AS
SELECT g.id, g.survey_id, s.name AS survey, g.n, g.km, g.chainage_from, g.chainage_to,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, g.chainage_from) l) AS label_from,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, g.chainage_to) l) AS label_to,
       g.points,
       100 * (g.vertex_to[3] - g.vertex_from[3]) / nullif(g.chainage_to - g.chainage_from, 0) AS slope,
       tunnel_internal.segment_moved(g.survey_id, g.n, g.vertex_from || g.vertex_to || g.tangent_from || g.tangent_to) AS stale,
       g.geom::public.geometry AS geom
  FROM tunnel.segment g
  JOIN tunnel.survey s ON s.id = g.survey_id;
COMMENT ON VIEW tunnel_api.segment IS
    'Segments: parts of the tunnel between planes perpendicular to the axis at consecutive vertices';
COMMENT ON COLUMN tunnel_api.segment.n IS 'Number: that of the vertex at its beginning';
COMMENT ON COLUMN tunnel_api.segment.slope IS 'Grade of the axis up-chainage, %';
COMMENT ON COLUMN tunnel_api.segment.stale IS 'True if the axis moved since the segment was made: run stage segments again';

CREATE OR REPLACE VIEW tunnel_api.section AS
SELECT c.id, c.survey_id, s.name AS survey, c.km, c.segment, c.half, c.chainage,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, c.chainage) l) AS label, c.half_width, c.angle_step, c.points, c.interpolated,
       c.geom::public.geometry AS geom
  FROM tunnel.section c
  JOIN tunnel.survey s ON s.id = c.survey_id;
COMMENT ON VIEW tunnel_api.section IS 'Cross-sections at 25 % and 75 % of each segment, in space';
COMMENT ON COLUMN tunnel_api.section.half IS 'Position in the segment, %: 25 or 75';
COMMENT ON COLUMN tunnel_api.section.half_width IS 'Half the length of tunnel whose points were used, m';
COMMENT ON COLUMN tunnel_api.section.angle_step IS 'Width of an angular class, degrees';
COMMENT ON COLUMN tunnel_api.section.interpolated IS
    'Number of angular classes filled from their neighbours: empty, or rejected as a fixture in front of the wall';

CREATE OR REPLACE VIEW tunnel_api.section_unrolled AS
SELECT c.id, c.survey_id, s.name AS survey, c.km, c.segment, c.half, c.chainage,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, c.chainage) l) AS label, e.arc_from, e.arc_to, c.angle_step, c.interpolated,
       public.st_makeline(public.st_makepoint(c.chainage, e.arc_from), public.st_makepoint(c.chainage, e.arc_to)
           )::public.geometry(LineString, 0) AS geom
  FROM tunnel.section c
  JOIN tunnel.survey s ON s.id = c.survey_id
 CROSS JOIN LATERAL (SELECT c.arc[1] AS arc_from, c.arc[cardinality(c.arc)] AS arc_to) e;
COMMENT ON VIEW tunnel_api.section_unrolled IS 'Cross-sections in the unrolled plane (chainage, arc), SRID 0';
COMMENT ON COLUMN tunnel_api.section_unrolled.arc_from IS 'Arc at the left end, straight below the axis, m';
COMMENT ON COLUMN tunnel_api.section_unrolled.arc_to IS 'Arc at the right end, straight below the axis, m';

CREATE OR REPLACE VIEW tunnel_api.region AS
SELECT r.id, r.survey_id, s.name AS survey, r.kind, r.drawn_by, r.drawn_at, r.reason, r.pending_approval, r.approved_by, r.approved_at,
       r.geom::public.geometry(Polygon, 0) AS geom
  FROM tunnel.region r
  JOIN tunnel.survey s ON s.id = r.survey_id;
COMMENT ON VIEW tunnel_api.region IS
    'Regions of the unrolled plane drawn by hand for the intensity correction; rows may be added, changed and deleted';
COMMENT ON COLUMN tunnel_api.region.kind IS 'homogeneous (one material: gives the roughness) or dry (dry lining: gives the threshold)';
COMMENT ON COLUMN tunnel_api.region.reason IS
    'Reason why it was drawn; required for a dry region larger than the tunnel''s limit (dry_region)';
COMMENT ON COLUMN tunnel_api.region.pending_approval IS
    'True if it waits for the approval of an operator (dry_region_approve); until then it has no effect';
COMMENT ON COLUMN tunnel_api.region.approved_by IS 'Operator who approved it, where approval was required';
COMMENT ON COLUMN tunnel_api.region.approved_at IS 'Time of the approval';
COMMENT ON COLUMN tunnel_api.region.geom IS 'Polygon in the unrolled plane (chainage, arc), m';
