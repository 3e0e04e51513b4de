-- Views of structures: members, faces, and spots that differ from their own surface (Ono et al.). A spot has three
-- geometries, each with a view of its own for QGIS: in the plane of its face (SRID 0), on the map and in space. A fourth view
-- has it on a drawing plane, member below member, like *_sheet of members and faces. Needs stationing
-- (geometry/stationing.sql).

-- Inputs of the members of a survey: checksums of its files by name, and the last change of its settings. A search is up to
-- date as long as these equal the values in its run.
CREATE OR REPLACE FUNCTION tunnel_internal.members_inputs(survey_id int) RETURNS jsonb
LANGUAGE sql STABLE PARALLEL SAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT jsonb_build_object(
               'files', (SELECT coalesce(jsonb_object_agg(f.name, f.checksum), '{}') FROM tunnel.scan_file f WHERE f.survey_id = s.id),
               'settings_at', extract(epoch FROM s.settings_at))
      FROM tunnel.survey s WHERE s.id = $1
$$;
COMMENT ON FUNCTION tunnel_internal.members_inputs(int) IS
    'Inputs of the members of a survey: checksums of its files by name, and the last change of its settings, s since 1970';

CREATE OR REPLACE VIEW tunnel_api.member AS
SELECT m.id, m.survey_id, s.name AS survey, m.number, m.kind, m.length, m.area, m.bimodal, m.chainage,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, m.chainage) l) AS label,
       m.line::public.geometry AS geom
  FROM tunnel.member m
  JOIN tunnel.survey s ON s.id = m.survey_id;
COMMENT ON VIEW tunnel_api.member IS 'Members of structures: faces that belong together, connected where objects hide them';
COMMENT ON COLUMN tunnel_api.member.number IS 'Number in the survey';
COMMENT ON COLUMN tunnel_api.member.kind IS 'flat (planes that lie in one), pipe (cylinders about one axis) or profile (sides of one beam)';
COMMENT ON COLUMN tunnel_api.member.length IS 'Length along its line, including gaps, m';
COMMENT ON COLUMN tunnel_api.member.area IS 'Area of its faces, m²';
COMMENT ON COLUMN tunnel_api.member.bimodal IS
    'True if the reference surface is unknown, because too much of the surface differs';
COMMENT ON COLUMN tunnel_api.member.chainage IS 'Chainage of its middle, m; NULL on a site or beyond the sections';
COMMENT ON COLUMN tunnel_api.member.label IS 'Station of its middle, as 12+345.678';
COMMENT ON COLUMN tunnel_api.member.geom IS 'Middle line, tunnel''s SRID; for a flat member, along its longest side';

CREATE OR REPLACE VIEW tunnel_api.face AS
SELECT f.id, f.survey_id, s.name AS survey, m.number AS member, f.number, f.kind, f.radius, f.rms, f.points, f.area,
       f.seen_share, f.incidence_from, f.incidence_to, f.level, f.sigma, f.bimodal, f.chainage,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, f.chainage) l) AS label,
       f.origin, f.axis, f.across, f.inside, f.side,
       f.outline::public.geometry(MultiPolygon, 0) AS outline, f.surface::public.geometry AS geom
  FROM tunnel.face f
  JOIN tunnel.member m ON m.id = f.member_id
  JOIN tunnel.survey s ON s.id = f.survey_id;
COMMENT ON VIEW tunnel_api.face IS 'Faces of members: planes and cylinders, with the inspected part';
COMMENT ON COLUMN tunnel_api.face.member IS 'Number of its member';
COMMENT ON COLUMN tunnel_api.face.number IS 'Number in the survey';
COMMENT ON COLUMN tunnel_api.face.kind IS 'flat (a plane) or pipe (a part of a cylinder)';
COMMENT ON COLUMN tunnel_api.face.radius IS 'Radius of a pipe, m; NULL for a plane';
COMMENT ON COLUMN tunnel_api.face.rms IS 'Root mean square distance of its points, m';
COMMENT ON COLUMN tunnel_api.face.points IS 'Number of scan points on it';
COMMENT ON COLUMN tunnel_api.face.area IS 'Area within its outline, m²';
COMMENT ON COLUMN tunnel_api.face.seen_share IS 'Inspected share, 0 to 1; nothing is known of the rest';
COMMENT ON COLUMN tunnel_api.face.incidence_from IS
    'Smallest angle of incidence of the inspected part, degrees; NULL if nothing was inspected';
COMMENT ON COLUMN tunnel_api.face.incidence_to IS 'Greatest angle of incidence of the inspected part, degrees';
COMMENT ON COLUMN tunnel_api.face.level IS
    'Intensity of its own surface, dB; NULL if it could not be determined and the face was not inspected';
COMMENT ON COLUMN tunnel_api.face.sigma IS 'Standard deviation of the intensity of its own surface, dB';
COMMENT ON COLUMN tunnel_api.face.bimodal IS
    'True if more than half of it differs, so that the reference surface is unknown';
COMMENT ON COLUMN tunnel_api.face.chainage IS 'Chainage of its middle, m; NULL on a site or beyond the sections';
COMMENT ON COLUMN tunnel_api.face.label IS 'Station of its middle, as 12+345.678';
COMMENT ON COLUMN tunnel_api.face.origin IS
    'Origin of its unrolled coordinates, on the axis of a pipe: x, y, z, tunnel''s SRID, m';
COMMENT ON COLUMN tunnel_api.face.axis IS 'Axis of a pipe; normal of a plane, towards the scanners';
COMMENT ON COLUMN tunnel_api.face.across IS
    'Direction perpendicular to axis from which unrolled coordinates are measured: u of a plane, v = 0 of a pipe';
COMMENT ON COLUMN tunnel_api.face.inside IS 'True if a pipe was scanned from inside';
COMMENT ON COLUMN tunnel_api.face.side IS 'Side of its member, from 1; faces of one plane or pipe have the same side';
COMMENT ON COLUMN tunnel_api.face.outline IS
    'Outline in its own plane; for a pipe, unrolled (along the axis, around it), m; SRID 0';
COMMENT ON COLUMN tunnel_api.face.geom IS 'Outline in space, tunnel''s SRID';

CREATE OR REPLACE VIEW tunnel_api.spot AS
SELECT p.id, p.survey_id, s.name AS survey, p.number, m.number AS member, m.kind AS member_kind, f.number AS face, p.kind,
       p.chainage, (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, p.chainage) l) AS label,
       p.reasons, p.confidence, p.contrast, p.difference, p.area, p.points, p.scans,
       p.review, p.reviewed_by, p.reviewed_at, p.remark, p.detected, p.created_at, p.detected_at,
       p.detected AND p.review <> 'rejected' AS counted, p.rgb,
       p.outline::public.geometry(Polygon, 0) AS outline, p.map::public.geometry AS map, p.surface::public.geometry AS surface
  FROM tunnel.spot p
  JOIN tunnel.survey s ON s.id = p.survey_id
  LEFT JOIN tunnel.face f ON f.id = p.face_id
  LEFT JOIN tunnel.member m ON m.id = f.member_id;
COMMENT ON VIEW tunnel_api.spot IS
    'Spots on members, darker or brighter than their own surface, with three geometries; review and remark can be updated';

CREATE OR REPLACE VIEW tunnel_api.member_statistics AS
SELECT m.id, m.survey_id, s.name AS survey, m.number, m.kind, m.length, m.chainage,
       a.faces, m.area, a.seen_area / nullif(m.area, 0) AS seen_share, m.bimodal,
       p.spots, p.dark_area, p.bright_area, (p.dark_area + p.bright_area) / nullif(a.seen_area, 0) AS spot_share,
       m.line::public.geometry AS geom
  FROM tunnel.member m
  JOIN tunnel.survey s ON s.id = m.survey_id
 CROSS JOIN LATERAL (SELECT count(*) AS faces, coalesce(sum(f.area * f.seen_share), 0) AS seen_area
                       FROM tunnel.face f WHERE f.member_id = m.id) a
 CROSS JOIN LATERAL (SELECT count(*) AS spots, coalesce(sum(q.area) FILTER (WHERE q.kind = 'dark'), 0) AS dark_area,
                            coalesce(sum(q.area) FILTER (WHERE q.kind = 'bright'), 0) AS bright_area
                       FROM tunnel.spot q JOIN tunnel.face f ON f.id = q.face_id
                      WHERE f.member_id = m.id AND q.detected AND q.review <> 'rejected') p;
COMMENT ON VIEW tunnel_api.member_statistics IS
    'Members with their inspected part and the part of it that differs from their own surface';
COMMENT ON COLUMN tunnel_api.member_statistics.number IS 'Number in the survey';
COMMENT ON COLUMN tunnel_api.member_statistics.kind IS 'flat, pipe or profile';
COMMENT ON COLUMN tunnel_api.member_statistics.length IS 'Length along its line, including gaps, m';
COMMENT ON COLUMN tunnel_api.member_statistics.faces IS 'Number of faces';
COMMENT ON COLUMN tunnel_api.member_statistics.area IS 'Area of its faces, m²';
COMMENT ON COLUMN tunnel_api.member_statistics.seen_share IS 'Inspected share of the area, 0 to 1';
COMMENT ON COLUMN tunnel_api.member_statistics.bimodal IS
    'True if the reference surface is unknown, because too much of the surface differs';
COMMENT ON COLUMN tunnel_api.member_statistics.spots IS 'Number of spots included in totals';
COMMENT ON COLUMN tunnel_api.member_statistics.dark_area IS 'Area of darker spots, m²';
COMMENT ON COLUMN tunnel_api.member_statistics.bright_area IS 'Area of brighter spots, m²';
COMMENT ON COLUMN tunnel_api.member_statistics.spot_share IS 'Share of the inspected part that differs, 0 to 1';
COMMENT ON COLUMN tunnel_api.member_statistics.geom IS 'Middle line, tunnel''s SRID';

-- Dot and cross product of vectors in space, as arrays of three numbers.
CREATE OR REPLACE FUNCTION tunnel_internal.dot(a float8[], b float8[]) RETURNS float8
LANGUAGE sql IMMUTABLE STRICT PARALLEL SAFE
RETURN a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
COMMENT ON FUNCTION tunnel_internal.dot(float8[], float8[]) IS 'Dot product of two vectors in space';

CREATE OR REPLACE FUNCTION tunnel_internal.cross_product(a float8[], b float8[]) RETURNS float8[]
LANGUAGE sql IMMUTABLE STRICT PARALLEL SAFE
RETURN ARRAY[a[2] * b[3] - a[3] * b[2], a[3] * b[1] - a[1] * b[3], a[1] * b[2] - a[2] * b[1]];
COMMENT ON FUNCTION tunnel_internal.cross_product(float8[], float8[]) IS 'Cross product of two vectors in space';

-- A spot lies on its face; two surfaces in the same place flicker in a 3D view.
CREATE OR REPLACE VIEW tunnel_api.face_3d AS
SELECT f.id, f.survey_id, s.name AS survey, m.number AS member, f.number, f.kind, f.radius, f.area, f.seen_share, f.bimodal,
       CASE WHEN f.kind = 'flat' THEN public.st_translate(f.surface, -0.01 * f.axis[1], -0.01 * f.axis[2], -0.01 * f.axis[3])
            ELSE public.st_affine(f.surface,
                     k.k + (1 - k.k) * f.axis[1] * f.axis[1], (1 - k.k) * f.axis[1] * f.axis[2], (1 - k.k) * f.axis[1] * f.axis[3],
                     (1 - k.k) * f.axis[2] * f.axis[1], k.k + (1 - k.k) * f.axis[2] * f.axis[2], (1 - k.k) * f.axis[2] * f.axis[3],
                     (1 - k.k) * f.axis[3] * f.axis[1], (1 - k.k) * f.axis[3] * f.axis[2], k.k + (1 - k.k) * f.axis[3] * f.axis[3],
                     (1 - k.k) * (f.origin[1] - k.along * f.axis[1]), (1 - k.k) * (f.origin[2] - k.along * f.axis[2]),
                     (1 - k.k) * (f.origin[3] - k.along * f.axis[3]))
       END::public.geometry AS geom
  FROM tunnel.face f
  JOIN tunnel.member m ON m.id = f.member_id
  JOIN tunnel.survey s ON s.id = f.survey_id
 CROSS JOIN LATERAL (SELECT 1 + CASE WHEN f.inside THEN 1 ELSE -1 END * least(0.01 / f.radius, 0.25) AS k,
                            tunnel_internal.dot(f.origin, f.axis) AS along) k;
COMMENT ON VIEW tunnel_api.face_3d IS
    'Faces in space for 3D views, moved 1 cm back (a thin pipe: a quarter of its radius) so that spots are visible in front of them';
COMMENT ON COLUMN tunnel_api.face_3d.member IS 'Number of its member';
COMMENT ON COLUMN tunnel_api.face_3d.number IS 'Number in the survey';
COMMENT ON COLUMN tunnel_api.face_3d.kind IS 'flat (a plane) or pipe (a part of a cylinder)';
COMMENT ON COLUMN tunnel_api.face_3d.radius IS 'Radius of a pipe, m; NULL for a plane';
COMMENT ON COLUMN tunnel_api.face_3d.area IS 'Area within its outline, m²';
COMMENT ON COLUMN tunnel_api.face_3d.seen_share IS 'Inspected share, 0 to 1';
COMMENT ON COLUMN tunnel_api.face_3d.bimodal IS
    'True if more than half of it differs, so that the reference surface is unknown';
COMMENT ON COLUMN tunnel_api.face_3d.geom IS 'Outline in space, moved back, tunnel''s SRID';

-- How the faces of a survey are laid out on one plane to be drawn (SRID 0, m), member below member, so that no two lie on each
-- other. The faces of a side of a member lie there as they do in its plane or, of a pipe, about its axis: in the frame of its
-- largest face, which goes over into the drawing by a rotation, a shift and, of a pipe seen from outside, a reflection, for u, v
-- and the direction to the scanner are a right-handed frame in planes and in pipes seen from inside only. Of a profile the sides
-- lie below each other, 5 cm apart, turned so that its line runs to the right. Each member has a cell of the proportions of the
-- strip on its page (277 mm by 110 mm) with a margin of a twentieth. A window function is counted by survey and its name, so that
-- a condition on either reaches the tables.
CREATE OR REPLACE VIEW tunnel_internal.face_placement AS
WITH placed AS NOT MATERIALIZED (
    SELECT f.id, f.survey_id, s.name AS survey, f.member_id, m.number, f.side, f.outline,
           r.c * t.xx + r.s * t.yx AS xx, r.c * t.xy + r.s * t.yy AS xy, r.c * t.yx - r.s * t.xx AS yx,
           r.c * t.yy - r.s * t.xy AS yy, r.c * t.x + r.s * t.y + r.x AS x, r.c * t.y - r.s * t.x AS y
      FROM tunnel.face f
      JOIN tunnel.member m ON m.id = f.member_id
      JOIN tunnel.survey s ON s.id = f.survey_id
     CROSS JOIN LATERAL (SELECT g.origin, g.axis, g.across, tunnel_internal.cross_product(g.axis, g.across) AS other, g.radius, g.inside
                           FROM tunnel.face g WHERE g.member_id = m.id AND g.side = f.side ORDER BY g.area DESC, g.id LIMIT 1) b
     CROSS JOIN LATERAL (SELECT ARRAY[f.origin[1] - b.origin[1], f.origin[2] - b.origin[2], f.origin[3] - b.origin[3]] AS shift,
                                tunnel_internal.cross_product(f.axis, f.across) AS other,
                                CASE WHEN tunnel_internal.dot(f.axis, b.axis) < 0 THEN -1.0 ELSE 1.0 END AS way,
                                CASE WHEN b.inside THEN 1.0 ELSE -1.0 END AS side) o
     CROSS JOIN LATERAL (
            SELECT tunnel_internal.dot(f.across, b.across) AS xx, tunnel_internal.dot(o.other, b.across) AS xy,
                   tunnel_internal.dot(f.across, b.other) AS yx, tunnel_internal.dot(o.other, b.other) AS yy,
                   tunnel_internal.dot(o.shift, b.across) AS x, tunnel_internal.dot(o.shift, b.other) AS y
             WHERE m.kind <> 'pipe'
             UNION ALL
            SELECT o.way, 0.0, 0.0, o.side * o.way, tunnel_internal.dot(o.shift, b.axis),
                   o.side * b.radius * atan2(tunnel_internal.dot(f.across, b.other), tunnel_internal.dot(f.across, b.across))
             WHERE m.kind = 'pipe') t
     CROSS JOIN LATERAL (SELECT public.st_startpoint(m.line) AS begin, public.st_endpoint(m.line) AS finish) e
     CROSS JOIN LATERAL (SELECT ARRAY[public.st_x(e.finish) - public.st_x(e.begin), public.st_y(e.finish) - public.st_y(e.begin),
                                      public.st_z(e.finish) - public.st_z(e.begin)] AS line) d
     CROSS JOIN LATERAL (SELECT atan2(tunnel_internal.dot(d.line, b.other), tunnel_internal.dot(d.line, b.across)) AS angle) a
     CROSS JOIN LATERAL (
            SELECT 1.0::float8 AS c, 0.0::float8 AS s, 0.0::float8 AS x WHERE m.kind <> 'profile'
             UNION ALL
            SELECT cos(a.angle), sin(a.angle),
                   tunnel_internal.dot(ARRAY[b.origin[1] - public.st_x(e.begin), b.origin[2] - public.st_y(e.begin),
                                        b.origin[3] - public.st_z(e.begin)], d.line) / sqrt(tunnel_internal.dot(d.line, d.line))
             WHERE m.kind = 'profile') r
), sided AS (
    SELECT p.member_id, p.survey_id, p.survey, p.number, p.side,
           public.st_extent(public.st_affine(p.outline, p.xx, p.xy, p.yx, p.yy, p.x, p.y)) AS box
      FROM placed p
     GROUP BY p.member_id, p.survey_id, p.survey, p.number, p.side
), stacked AS (
    SELECT i.*, -public.st_ymin(i.box) - sum(public.st_ymax(i.box) - public.st_ymin(i.box) + 0.05)
                                         OVER (PARTITION BY i.survey_id, i.survey, i.member_id ORDER BY i.side) AS y
      FROM sided i
), boxed AS (
    SELECT k.member_id, k.survey_id, k.survey, k.number, min(public.st_xmin(k.box)) AS left, max(public.st_xmax(k.box)) AS right,
           min(public.st_ymin(k.box) + k.y) AS bottom, max(public.st_ymax(k.box) + k.y) AS top
      FROM stacked k
     GROUP BY k.member_id, k.survey_id, k.survey, k.number
), sized AS (
    SELECT b.*, (b.left + b.right) / 2 AS x, (b.bottom + b.top) / 2 AS y,
           1.1 * greatest(b.right - b.left, (b.top - b.bottom) * 277 / 110) AS width
      FROM boxed b
), cell AS (
    SELECT z.*, sum(z.width) OVER (PARTITION BY z.survey_id, z.survey ORDER BY z.number) * 110 / 277 AS depth FROM sized z
)
SELECT p.id, p.survey_id, p.survey, p.member_id, p.xx, p.xy, p.yx, p.yy,
       p.x - c.x + c.width / 2 AS x, p.y + k.y - c.y - c.depth + c.width * 55 / 277 AS y,
       public.st_makeenvelope(0, -c.depth, c.width, c.width * 110 / 277 - c.depth, 0) AS cell
  FROM placed p
  JOIN stacked k ON k.member_id = p.member_id AND k.side = p.side AND k.survey_id = p.survey_id AND k.survey = p.survey
  JOIN cell c ON c.member_id = p.member_id AND c.survey_id = p.survey_id AND c.survey = p.survey;
COMMENT ON VIEW tunnel_internal.face_placement IS
    'Placement of faces on one drawing plane, member below member: drawn x = xx u + xy v + x, y = yx u + yy v + y';
COMMENT ON COLUMN tunnel_internal.face_placement.id IS 'Key of the face';
COMMENT ON COLUMN tunnel_internal.face_placement.member_id IS 'Key of its member';
COMMENT ON COLUMN tunnel_internal.face_placement.xx IS 'Factor of its unrolled u in the drawn x';
COMMENT ON COLUMN tunnel_internal.face_placement.xy IS 'Factor of its unrolled v in the drawn x';
COMMENT ON COLUMN tunnel_internal.face_placement.yx IS 'Factor of its unrolled u in the drawn y';
COMMENT ON COLUMN tunnel_internal.face_placement.yy IS 'Factor of its unrolled v in the drawn y';
COMMENT ON COLUMN tunnel_internal.face_placement.x IS 'Drawn x of its unrolled origin, m';
COMMENT ON COLUMN tunnel_internal.face_placement.y IS 'Drawn y of its unrolled origin, m';
COMMENT ON COLUMN tunnel_internal.face_placement.cell IS 'Rectangle in which its member is drawn; SRID 0, m';

CREATE OR REPLACE VIEW tunnel_api.member_sheet AS
SELECT m.id, m.survey_id, m.survey, m.number, m.kind, m.length, m.chainage,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, m.chainage) l) AS label,
       m.faces, m.area, m.seen_share, m.bimodal, m.spots, m.dark_area, m.bright_area, m.spot_share,
       c.cell::public.geometry(Polygon, 0) AS geom
  FROM tunnel_api.member_statistics m
  JOIN tunnel.survey s ON s.id = m.survey_id
  JOIN (SELECT DISTINCT p.survey_id, p.survey, p.member_id, p.cell FROM tunnel_internal.face_placement p) c
    ON c.member_id = m.id AND c.survey_id = m.survey_id AND c.survey = m.survey;
COMMENT ON VIEW tunnel_api.member_sheet IS
    'Pages of members: where each is drawn with its faces unrolled, and its inspected part';
COMMENT ON COLUMN tunnel_api.member_sheet.number IS 'Number in the survey';
COMMENT ON COLUMN tunnel_api.member_sheet.kind IS 'flat, pipe or profile';
COMMENT ON COLUMN tunnel_api.member_sheet.length IS 'Length along its line, including gaps, m';
COMMENT ON COLUMN tunnel_api.member_sheet.chainage IS 'Chainage of its middle, m; NULL on a site or beyond the sections';
COMMENT ON COLUMN tunnel_api.member_sheet.label IS 'Station of its middle, as 12+345.678';
COMMENT ON COLUMN tunnel_api.member_sheet.faces IS 'Number of faces';
COMMENT ON COLUMN tunnel_api.member_sheet.area IS 'Area of its faces, m²';
COMMENT ON COLUMN tunnel_api.member_sheet.seen_share IS 'Inspected share of the area, 0 to 1';
COMMENT ON COLUMN tunnel_api.member_sheet.bimodal IS
    'True if the reference surface is unknown, because too much of the surface differs';
COMMENT ON COLUMN tunnel_api.member_sheet.spots IS 'Number of spots included in totals';
COMMENT ON COLUMN tunnel_api.member_sheet.dark_area IS 'Area of darker spots, m²';
COMMENT ON COLUMN tunnel_api.member_sheet.bright_area IS 'Area of brighter spots, m²';
COMMENT ON COLUMN tunnel_api.member_sheet.spot_share IS 'Share of the inspected part that differs, 0 to 1';
COMMENT ON COLUMN tunnel_api.member_sheet.geom IS 'Rectangle in which it is drawn; SRID 0, m';

CREATE OR REPLACE VIEW tunnel_api.face_sheet AS
SELECT f.id, f.survey_id, p.survey, m.number AS member, f.number, f.kind, f.radius, f.area, f.seen_share, f.bimodal,
       public.st_affine(f.outline, p.xx, p.xy, p.yx, p.yy, p.x, p.y)::public.geometry(MultiPolygon, 0) AS geom
  FROM tunnel_internal.face_placement p
  JOIN tunnel.face f ON f.id = p.id
  JOIN tunnel.member m ON m.id = p.member_id;
COMMENT ON VIEW tunnel_api.face_sheet IS 'Unrolled faces, member below member, viewed from the scanners'' side';
COMMENT ON COLUMN tunnel_api.face_sheet.member IS 'Number of its member';
COMMENT ON COLUMN tunnel_api.face_sheet.number IS 'Number in the survey';
COMMENT ON COLUMN tunnel_api.face_sheet.kind IS 'flat (a plane) or pipe (a part of a cylinder)';
COMMENT ON COLUMN tunnel_api.face_sheet.radius IS 'Radius of a pipe, m; NULL for a plane';
COMMENT ON COLUMN tunnel_api.face_sheet.area IS 'Area within its outline, m²';
COMMENT ON COLUMN tunnel_api.face_sheet.seen_share IS 'Inspected share, 0 to 1';
COMMENT ON COLUMN tunnel_api.face_sheet.bimodal IS
    'True if more than half of it differs, so that the reference surface is unknown';
COMMENT ON COLUMN tunnel_api.face_sheet.geom IS 'Outline on the drawing plane; SRID 0, m';

-- Drawing plane of face_sheet.
DO $$
BEGIN
    EXECUTE format('CREATE OR REPLACE VIEW tunnel_api.spot_sheet AS SELECT %s, public.st_affine(q.outline, f.xx, f.xy, f.yx, f.yy, f.x,'
                   ' f.y)::public.geometry(Polygon, 0) AS geom'
                   ' FROM tunnel_api.spot q JOIN tunnel.spot r ON r.id = q.id'
                   ' JOIN tunnel_internal.face_placement f ON f.id = r.face_id AND f.survey = q.survey AND f.survey_id = q.survey_id',
                   (SELECT string_agg('q.' || quote_ident(attname), ', ' ORDER BY attnum) FROM pg_attribute
                     WHERE attrelid = 'tunnel_api.spot'::regclass AND attnum > 0 AND attname NOT IN ('outline', 'map', 'surface')));
END
$$;
COMMENT ON VIEW tunnel_api.spot_sheet IS
    'Spots on unrolled faces, in the drawing plane of face_sheet; review and remark can be updated';
COMMENT ON COLUMN tunnel_api.spot_sheet.geom IS 'Outline on the drawing plane; SRID 0, m';

-- Comments of its columns, and its views with one geometry.
DO $$
DECLARE
    comment record;
BEGIN
    FOR comment IN SELECT c.relname AS view, a.attname AS "column", t.text FROM (VALUES
        ('number', 'Number in the tunnel or site, the same in the next survey'),
        ('member', 'Number of its member; NULL if the last run did not find it again'),
        ('member_kind', 'flat, pipe or profile'),
        ('face', 'Number of its face'),
        ('kind', 'dark or bright, compared with its own surface; the cause is for the inspector to state in the remark'),
        ('chainage', 'Chainage of its middle, m; NULL on a site or beyond the sections'),
        ('label', 'Station of its middle, as 12+345.678'),
        ('reasons', 'Evidence for and against it'),
        ('confidence', 'How sure detection is that it differs, 0-1'),
        ('contrast', 'Mean difference from its surface, in standard deviations of that'),
        ('difference', 'Mean difference from its surface, dB'),
        ('area', 'Area on its face, m²'),
        ('points', 'Number of scan points on it'),
        ('scans', 'Scans that cover it'),
        ('review', 'open, confirmed or rejected'),
        ('reviewed_by', 'Role that reviewed it last, set by the database'),
        ('reviewed_at', 'Time of the last review, set by the database'),
        ('remark', 'Remark of the reviewer'),
        ('detected', 'False if the last run did not find it again (kept for its review)'),
        ('counted', 'True if totals include it: found by the last run, and not rejected'),
        ('rgb', 'Mean colour of its points: red, green, blue, 0 to 255; NULL if the scan files have no colours')) AS t (name, text)
      JOIN pg_attribute a ON a.attname = t.name AND a.attnum > 0
      JOIN pg_class c ON c.oid = a.attrelid
     WHERE c.relnamespace = 'tunnel_api'::regnamespace AND c.relkind = 'v' AND c.relname IN ('spot', 'spot_sheet')
    LOOP
        EXECUTE format('COMMENT ON COLUMN tunnel_api.%I.%I IS %L', comment.view, comment."column", comment.text);
    END LOOP;
END
$$;

CALL tunnel_internal.make_geometry_views(
    'spot', 'spot', 'Spots', '; review and remark can be updated', 'outline', 'face', 'in their face''s own plane, SRID 0',
    'on the map, in the tunnel''s SRID', 'in space, in the tunnel''s SRID');
