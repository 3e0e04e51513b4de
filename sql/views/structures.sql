-- Views of structures: members, faces, and spots that differ from their own surface (Ono et al.). A spot has three geometries,
-- each with a view of its own for QGIS: in its face's own plane (SRID 0), on the map and in space. finding has leaks and
-- spots together. Needs stationing (geometry/stationing.sql) and views/anomaly.sql.

-- What members of a survey are found from: its files' checksums by name, and when its settings were last changed. A search is up
-- to date as long as these are the same as in its row of the ledger.
CREATE OR REPLACE FUNCTION tunnel_api.members_inputs(survey_id int) RETURNS jsonb
LANGUAGE sql STABLE PARALLEL SAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT jsonb_build_object(
               'files', (SELECT coalesce(jsonb_object_agg(f.name, f.checksum), '{}') FROM tunnel.scan_file f WHERE f.survey_id = s.id),
               'settings_at', extract(epoch FROM s.settings_at))
      FROM tunnel.survey s WHERE s.id = $1
$$;
COMMENT ON FUNCTION tunnel_api.members_inputs(int) IS
    'What members of a survey are found from: checksums of its files by name, and when its settings were last changed, s since 1970. The run of stage members holds the same in its parameters';

CREATE OR REPLACE VIEW tunnel_api.member AS
SELECT m.id, m.survey_id, s.name AS survey, m.number, m.kind, m.length, m.area, m.bimodal, m.chainage,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, m.chainage) l) AS label,
       m.line::public.geometry AS geom
  FROM tunnel.member m
  JOIN tunnel.survey s ON s.id = m.survey_id;
COMMENT ON VIEW tunnel_api.member IS 'Members of structures: faces that belong together, joined where others hide them';
COMMENT ON COLUMN tunnel_api.member.number IS 'Its number in the survey; dimension member of files written';
COMMENT ON COLUMN tunnel_api.member.kind IS 'flat (planes that lie in one) or pipe (cylinders about one axis)';
COMMENT ON COLUMN tunnel_api.member.length IS 'Length along its line, gaps counted, m';
COMMENT ON COLUMN tunnel_api.member.area IS 'Area of its faces, m²';
COMMENT ON COLUMN tunnel_api.member.bimodal IS 'Whether so much of it differs from the rest that neither is known to be its own surface';
COMMENT ON COLUMN tunnel_api.member.chainage IS 'Chainage of its middle, m; NULL of a site or beyond the sections';
COMMENT ON COLUMN tunnel_api.member.label IS 'Station of its middle, as 12+345.678';
COMMENT ON COLUMN tunnel_api.member.geom IS 'Its middle line, in the tunnel''s SRID';

CREATE OR REPLACE VIEW tunnel_api.face AS
SELECT f.id, f.survey_id, s.name AS survey, m.number AS member, f.number, f.kind, f.radius, f.rms, f.points, f.area,
       f.seen_share, f.incidence_from, f.incidence_to, f.level, f.sigma, f.bimodal, f.chainage,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, f.chainage) l) AS label,
       f.origin, f.axis, f.across, f.inside,
       f.outline::public.geometry(MultiPolygon, 0) AS outline, f.surface::public.geometry AS geom
  FROM tunnel.face f
  JOIN tunnel.member m ON m.id = f.member_id
  JOIN tunnel.survey s ON s.id = f.survey_id;
COMMENT ON VIEW tunnel_api.face IS 'Faces of members: planes and cylinders, with what of them could be judged';
COMMENT ON COLUMN tunnel_api.face.member IS 'Number of the member that it belongs to';
COMMENT ON COLUMN tunnel_api.face.number IS 'Its number in the survey; dimension face of files written';
COMMENT ON COLUMN tunnel_api.face.kind IS 'flat (a plane) or pipe (a part of a cylinder)';
COMMENT ON COLUMN tunnel_api.face.radius IS 'Radius of a pipe, m; NULL of a plane';
COMMENT ON COLUMN tunnel_api.face.rms IS 'Root mean square of its points'' distances from it, m';
COMMENT ON COLUMN tunnel_api.face.points IS 'Points of the scans on it';
COMMENT ON COLUMN tunnel_api.face.area IS 'Area within its outline, m²';
COMMENT ON COLUMN tunnel_api.face.seen_share IS 'Share of it that could be judged, 0 to 1: where there is less, nothing is said of the rest';
COMMENT ON COLUMN tunnel_api.face.incidence_from IS 'Least angle of incidence at which it was judged, degrees; NULL where nothing was';
COMMENT ON COLUMN tunnel_api.face.incidence_to IS 'Greatest angle of incidence at which it was judged, degrees';
COMMENT ON COLUMN tunnel_api.face.level IS 'Its own level of intensity, dB; NULL where none could be found: it was not judged';
COMMENT ON COLUMN tunnel_api.face.sigma IS 'Standard deviation about its level, dB';
COMMENT ON COLUMN tunnel_api.face.bimodal IS 'Whether more than half of it differs, so that nobody knows which half is its own';
COMMENT ON COLUMN tunnel_api.face.chainage IS 'Chainage of its middle, m; NULL of a site or beyond the sections';
COMMENT ON COLUMN tunnel_api.face.label IS 'Station of its middle, as 12+345.678';
COMMENT ON COLUMN tunnel_api.face.origin IS 'Where its unrolled coordinates are (0, 0), of a pipe on its axis: x, y, z, in the tunnel''s SRID, m';
COMMENT ON COLUMN tunnel_api.face.axis IS 'Axis of a pipe; of a plane its normal, towards the scanners';
COMMENT ON COLUMN tunnel_api.face.across IS 'Direction at right angles to it from which unrolled coordinates count: u of a plane, v = 0 of a pipe';
COMMENT ON COLUMN tunnel_api.face.inside IS 'Whether a pipe is seen from inside';
COMMENT ON COLUMN tunnel_api.face.outline IS 'Its outline in its own plane, of a pipe unrolled (along the axis, around it), m; SRID 0';
COMMENT ON COLUMN tunnel_api.face.geom IS 'Its outline in space, in the tunnel''s SRID';

CREATE OR REPLACE VIEW tunnel_api.spot AS
SELECT p.id, p.survey_id, s.name AS survey, p.number, m.number AS member, m.kind AS member_kind, f.number AS face, p.kind,
       p.chainage, (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, p.chainage) l) AS label,
       p.reasons, p.confidence, p.contrast, p.difference, p.area, p.points, p.scans,
       p.review, p.reviewed_by, p.reviewed_at, p.remark, p.detected, p.created_at, p.detected_at,
       p.detected AND p.review <> 'rejected' AS counted,
       p.outline::public.geometry(Polygon, 0) AS outline, p.map::public.geometry AS map, p.surface::public.geometry AS surface
  FROM tunnel.spot p
  JOIN tunnel.survey s ON s.id = p.survey_id
  LEFT JOIN tunnel.face f ON f.id = p.face_id
  LEFT JOIN tunnel.member m ON m.id = f.member_id;
COMMENT ON VIEW tunnel_api.spot IS
    'Spots on members that are darker or brighter than their own surface, with three geometries; review and remark can be updated';

-- The views of one geometry, and the comments on the columns of all four.
DO $$
DECLARE
    shown record;
    comment record;
    others text;
BEGIN
    SELECT string_agg(quote_ident(attname), ', ' ORDER BY attnum) INTO others
      FROM pg_attribute
     WHERE attrelid = 'tunnel_api.spot'::regclass AND attnum > 0 AND attname NOT IN ('outline', 'map', 'surface');
    FOR shown IN SELECT * FROM (VALUES
        ('spot_face', 'outline', 'in their face''s own plane, SRID 0'),
        ('spot_map', 'map', 'on the map, in the tunnel''s SRID'),
        ('spot_3d', 'surface', 'in space, in the tunnel''s SRID')) AS g (view, geometry, text)
    LOOP
        EXECUTE format('CREATE OR REPLACE VIEW tunnel_api.%I AS SELECT %s, %I AS geom FROM tunnel_api.spot',
                       shown.view, others, shown.geometry);
        EXECUTE format('COMMENT ON COLUMN tunnel_api.%I.geom IS %L', shown.view, initcap(left(shown.text, 1)) || substr(shown.text, 2));
        EXECUTE format('COMMENT ON VIEW tunnel_api.%I IS %L', shown.view,
                       'Spots ' || shown.text || '; review and remark can be updated');
    END LOOP;
    FOR comment IN SELECT c.relname AS view, a.attname AS "column", t.text FROM (VALUES
        ('number', 'Its number in the tunnel or site: the same in the next survey'),
        ('member', 'Number of the member that it is on; NULL where the last run found it no more'),
        ('member_kind', 'flat or pipe'),
        ('face', 'Number of its face'),
        ('kind', 'dark or bright, against its own surface; what caused it, the inspector says'),
        ('chainage', 'Chainage of its middle, m; NULL of a site or beyond the sections'),
        ('label', 'Station of its middle, as 12+345.678'),
        ('reasons', 'What speaks for it or against it'),
        ('confidence', 'How sure detection is that it differs, 0-1'),
        ('contrast', 'Mean difference from its surface, in standard deviations of that'),
        ('difference', 'Mean difference from its surface, dB'),
        ('area', 'Area on its face, m²'),
        ('points', 'Points of the scans on it'),
        ('scans', 'Scans that saw it'),
        ('review', 'open, confirmed or rejected'),
        ('reviewed_by', 'Who reviewed it last, set by the database'),
        ('reviewed_at', 'When it was reviewed last, set by the database'),
        ('remark', 'The reviewer''s remark'),
        ('detected', 'False when the last run found it no more (kept for its review)'),
        ('counted', 'Whether sums count it: found last, and not rejected')) AS t (name, text)
      JOIN pg_attribute a ON a.attname = t.name AND a.attnum > 0
      JOIN pg_class c ON c.oid = a.attrelid
     WHERE c.relnamespace = 'tunnel_api'::regnamespace AND c.relkind = 'v'
       AND c.relname IN ('spot', 'spot_face', 'spot_map', 'spot_3d')
    LOOP
        EXECUTE format('COMMENT ON COLUMN tunnel_api.%I.%I IS %L', comment.view, comment."column", comment.text);
    END LOOP;
END
$$;

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
COMMENT ON VIEW tunnel_api.member_statistics IS 'Members with what of them could be judged, and what of that differs from its own surface';
COMMENT ON COLUMN tunnel_api.member_statistics.number IS 'Its number in the survey';
COMMENT ON COLUMN tunnel_api.member_statistics.kind IS 'flat or pipe';
COMMENT ON COLUMN tunnel_api.member_statistics.length IS 'Length along its line, gaps counted, m';
COMMENT ON COLUMN tunnel_api.member_statistics.faces IS 'Its faces';
COMMENT ON COLUMN tunnel_api.member_statistics.area IS 'Area of its faces, m²';
COMMENT ON COLUMN tunnel_api.member_statistics.seen_share IS 'Share of that which could be judged, 0 to 1';
COMMENT ON COLUMN tunnel_api.member_statistics.bimodal IS 'Whether so much of it differs from the rest that neither is known to be its own surface';
COMMENT ON COLUMN tunnel_api.member_statistics.spots IS 'Spots on it that count';
COMMENT ON COLUMN tunnel_api.member_statistics.dark_area IS 'Area of those that are darker, m²';
COMMENT ON COLUMN tunnel_api.member_statistics.bright_area IS 'Area of those that are brighter, m²';
COMMENT ON COLUMN tunnel_api.member_statistics.spot_share IS 'Share of what could be judged that differs, 0 to 1';
COMMENT ON COLUMN tunnel_api.member_statistics.geom IS 'Its middle line, in the tunnel''s SRID';

CREATE OR REPLACE VIEW tunnel_api.finding AS
SELECT 2 * l.id AS id, 'leak' AS finding, l.id AS row_id, l.survey_id, l.survey, l.id AS number, l.kind,
       (l.chainage_from + l.chainage_to) / 2 AS chainage, l.label, l.area, l.confidence, l.contrast,
       l.review, l.reviewed_by, l.reviewed_at, l.remark, l.detected, l.counted, l.surface AS geom
  FROM tunnel_api.leak l
 UNION ALL
SELECT 2 * p.id + 1, 'spot', p.id, p.survey_id, p.survey, p.number, p.kind, p.chainage, p.label, p.area, p.confidence,
       p.contrast, p.review, p.reviewed_by, p.reviewed_at, p.remark, p.detected, p.counted, p.surface
  FROM tunnel_api.spot p;
COMMENT ON VIEW tunnel_api.finding IS 'Leaks and spots of structures together, in space. Waterproofing rests on leaks alone';
COMMENT ON COLUMN tunnel_api.finding.finding IS 'leak (a row of tunnel_api.leak) or spot (of tunnel_api.spot)';
COMMENT ON COLUMN tunnel_api.finding.row_id IS 'Its id there';
COMMENT ON COLUMN tunnel_api.finding.number IS 'The number by which people know it: of a leak its id';
COMMENT ON COLUMN tunnel_api.finding.kind IS 'leak; of a spot dark or bright';
COMMENT ON COLUMN tunnel_api.finding.chainage IS 'Chainage of its middle, m; NULL of a site';
COMMENT ON COLUMN tunnel_api.finding.counted IS 'Whether sums count it: found last, and not rejected';
COMMENT ON COLUMN tunnel_api.finding.geom IS 'In space, in the tunnel''s SRID';
COMMENT ON COLUMN tunnel_api.finding.label IS 'Station of its middle, as 12+345.678';
COMMENT ON COLUMN tunnel_api.finding.area IS 'Area on the lining, or on its face, m²';
COMMENT ON COLUMN tunnel_api.finding.confidence IS 'How sure detection is of it, 0-1';
COMMENT ON COLUMN tunnel_api.finding.contrast IS 'Mean difference from the surface about it, in standard deviations of that';
COMMENT ON COLUMN tunnel_api.finding.review IS 'open, confirmed or rejected';
COMMENT ON COLUMN tunnel_api.finding.reviewed_by IS 'Who reviewed it last';
COMMENT ON COLUMN tunnel_api.finding.reviewed_at IS 'When it was reviewed last';
COMMENT ON COLUMN tunnel_api.finding.remark IS 'The reviewer''s remark';
COMMENT ON COLUMN tunnel_api.finding.detected IS 'False when the last run found it no more (kept for its review)';
