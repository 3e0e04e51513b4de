-- Findings on the lining, detected and drawn, of all kinds and states; leaks are the wet ones. A finding on a vertical wall has no
-- area in plan, so there are three geometries, each with a view of its own for QGIS: unrolled (chainage,
-- arc; SRID 0), on the map beside the axis, and in space. Findings are drawn and edited through finding_unrolled, finding_map and
-- finding_3d (findings/draw.sql). Needs stationing (geometry/stationing.sql), line_orientation (findings/orientation.sql) and
-- make_geometry_views (views/geometry.sql).

-- Words for a reason: one text if it supports a leak, another if it does not. A reason without a text keeps its name.
CREATE OR REPLACE FUNCTION tunnel_internal.evidence_words(reason text, log_odds float8) RETURNS text
LANGUAGE sql IMMUTABLE STRICT PARALLEL SAFE SET search_path = pg_catalog, pg_temp AS $$
    SELECT coalesce((
        SELECT CASE WHEN $2 > 0 THEN w.leak ELSE w.dry END
          FROM (VALUES
            ('faint', 'clearly dark', 'faint'),
            ('thin', 'wider or more wavy than a joint', 'thin and straight like a joint'),
            ('recess', 'not set back', 'set back like a bolt pocket'),
            ('gradual', 'sharp edge', 'fades out like soot'),
            ('rectangular', 'irregular outline', 'straight sides like a repair'),
            ('stripe', 'no stripe along the tunnel', 'stripe along the tunnel'),
            ('shadow', 'no fixture beside it', 'beside a fixture like its shadow'),
            ('shape', 'shape of running water', 'shape unlike running water'),
            ('salts', 'salts at the rim', 'no salts at the rim'),
            ('picture', 'looks like water in its surroundings', 'looks unlike water in its surroundings'),
            ('foot', 'place at the floor', 'place at the floor'),
            ('small', 'large', 'small'),
            ('repeated', 'not repeated along the tunnel', 'repeated along the tunnel')) AS w (reason, leak, dry)
         WHERE w.reason = $1), $1)
$$;
COMMENT ON FUNCTION tunnel_internal.evidence_words(text, float8) IS
    'Words for a reason of detection, by the sign of its contribution to the logarithm of the odds of a leak';

-- As "for a leak: irregular outline 1.9, clearly dark 0.4; against: fades out like soot 0.8".
CREATE OR REPLACE FUNCTION tunnel_internal.evidence_text(evidence jsonb) RETURNS text
LANGUAGE sql IMMUTABLE STRICT PARALLEL SAFE SET search_path = pg_catalog, pg_temp AS $$
    SELECT nullif(concat_ws('; ',
        'for a leak: ' || string_agg(e.words, ', ' ORDER BY e.value DESC, e.words) FILTER (WHERE e.value > 0),
        'against: ' || string_agg(e.words, ', ' ORDER BY e.value, e.words) FILTER (WHERE e.value < 0)), '')
      FROM (SELECT v.value::numeric AS value, tunnel_internal.evidence_words(v.key, v.value::float8)
                   || to_char(abs(v.value::numeric), 'FM" "990.0') AS words
              FROM jsonb_each_text($1) v WHERE abs(v.value::numeric) >= 0.05) e
$$;
COMMENT ON FUNCTION tunnel_internal.evidence_text(jsonb) IS
    'Evidence for a leak and against it in words, each with the logarithm of odds that it contributes, the strongest first';

CREATE OR REPLACE FUNCTION tunnel_internal.finding_state_name(
    review text, merged boolean, same boolean, superseded boolean, detected boolean) RETURNS text
LANGUAGE sql IMMUTABLE CALLED ON NULL INPUT PARALLEL SAFE
RETURN CASE WHEN merged THEN 'merged' WHEN same THEN 'same' WHEN review = 'rejected' THEN 'rejected' WHEN superseded THEN 'dry'
            WHEN NOT detected THEN 'gone' ELSE review END;
COMMENT ON FUNCTION tunnel_internal.finding_state_name(text, boolean, boolean, boolean, boolean) IS
    'State of a finding: merged or same (it is part of another one), rejected, dry (a dry region covers it), gone (no longer detected), open or confirmed';

CREATE OR REPLACE FUNCTION tunnel_api.leak_probability(kind_detected text, confidence float8, wet boolean) RETURNS float8
LANGUAGE sql IMMUTABLE CALLED ON NULL INPUT PARALLEL SAFE
RETURN CASE WHEN confidence IS NULL THEN CASE WHEN wet THEN 1.0 ELSE 0.0 END
            WHEN kind_detected = 'leak' THEN confidence ELSE 1.0 - confidence END;
COMMENT ON FUNCTION tunnel_api.leak_probability(text, float8, boolean) IS
    'Probability that a finding is a leak, by its columns kind_detected and confidence; of a drawn finding, which has no confidence, 1 if it is wet and 0 if not';

CREATE OR REPLACE VIEW tunnel_api.finding_kind AS
SELECT k.id, k.code, k.label, k.geometries, k.wet, k.position, k.active FROM tunnel.finding_kind k;
COMMENT ON VIEW tunnel_api.finding_kind IS
    'Kinds of findings. Operators add kinds and change labels, order and availability. A kind that was used cannot be deleted, only set inactive';
COMMENT ON COLUMN tunnel_api.finding_kind.code IS 'Code, in lower case';
COMMENT ON COLUMN tunnel_api.finding_kind.label IS 'Name, in the owner''s words';
COMMENT ON COLUMN tunnel_api.finding_kind.geometries IS 'Permitted geometries: polygon, line, point';
COMMENT ON COLUMN tunnel_api.finding_kind.wet IS 'True if findings of this kind count as wet in statistics and classes';
COMMENT ON COLUMN tunnel_api.finding_kind.position IS 'Position in lists';
COMMENT ON COLUMN tunnel_api.finding_kind.active IS 'True if new findings can be drawn with this kind';

CREATE OR REPLACE VIEW tunnel_api.severity AS SELECT s.id::int AS id, s.label, s.text FROM tunnel.severity s;
COMMENT ON VIEW tunnel_api.severity IS 'Degrees of severity, 1 (lowest) to 4. Operators can change the words';
COMMENT ON COLUMN tunnel_api.severity.id IS 'Severity, 1 (lowest) to 4';
COMMENT ON COLUMN tunnel_api.severity.label IS 'Name, in the owner''s words';
COMMENT ON COLUMN tunnel_api.severity.text IS 'Meaning';

CREATE OR REPLACE VIEW tunnel_api.finding AS
SELECT a.id, a.survey_id, s.name AS survey, a.km,
       (SELECT min(g.n) FROM tunnel.segment g
         WHERE g.survey_id = a.survey_id AND g.n BETWEEN m.near - 2 AND m.near + 2
           AND m.chainage BETWEEN g.chainage_from AND g.chainage_to) AS segment,
       a.chainage_from, a.chainage_to,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, m.chainage) l) AS label,
       a.arc_from, a.arc_to, a.clock,
       coalesce(a.kind_override, a.kind) AS kind, k.label AS kind_label, CASE WHEN NOT a.manual THEN a.kind END AS kind_detected, a.wet,
       a.origin, a.manual, a.severity, v.label AS severity_label, a.width_mm, a.length, o.orientation,
       tunnel_api.orientation_class(o.orientation) AS orientation_class, a.area,
       a.image_share IS NOT NULL AS measured, a.darkening_mean, a.darkening_max, a.image_share, a.contrast, a.confidence, a.reasons,
       a.review, a.reviewed_by, a.reviewed_at, a.remark, a.drawn_by, a.drawn_at,
       a.detected, a.created_at, CASE WHEN NOT a.manual THEN a.detected_at END AS detected_at,
       EXISTS (SELECT FROM tunnel.finding x
                WHERE x.same_as = a.id AND x.same_as IS NOT NULL AND NOT x.manual AND x.detected) AS also_detected,
       (SELECT array_agg(x.id ORDER BY x.id) FROM tunnel.finding x
         WHERE x.same_as = a.id AND NOT x.manual AND x.detected) AS detected_as,
       a.parent_id, a.merged_into, (SELECT array_agg(x.id ORDER BY x.id) FROM tunnel.finding x WHERE x.merged_into = a.id) AS merged,
       a.same_as, a.dry_region_id,
       a.detected AND a.review <> 'rejected' AND NOT a.superseded AS counted,
       tunnel_internal.finding_state_name(a.review, a.merged_into IS NOT NULL, a.same_as IS NOT NULL, a.superseded, a.detected)
           AS state,
       (SELECT count(*) FROM tunnel.photo p WHERE p.finding_id = a.id) AS photos,
       tunnel_internal.evidence_text(a.evidence) AS evidence, a.model, a.superseded,
       (SELECT i.words FROM tunnel_internal.other_images i
         WHERE i.finding_id = a.id AND i.outline_key = tunnel_internal.outline_key(a.unrolled)) AS other_images,
       (SELECT i.contrast FROM tunnel_internal.other_images i
         WHERE i.finding_id = a.id AND i.outline_key = tunnel_internal.outline_key(a.unrolled)) AS other_contrast,
       (public.st_xmin(coalesce(a.shape_surface, a.surface)) + public.st_xmax(coalesce(a.shape_surface, a.surface))) / 2 AS easting,
       (public.st_ymin(coalesce(a.shape_surface, a.surface)) + public.st_ymax(coalesce(a.shape_surface, a.surface))) / 2 AS northing,
       (public.st_zmin(coalesce(a.shape_surface, a.surface)) + public.st_zmax(coalesce(a.shape_surface, a.surface))) / 2 AS height,
       coalesce(a.shape, a.unrolled) AS unrolled,
       coalesce(a.shape_map, a.map) AS map,
       coalesce(a.shape_surface, a.surface) AS surface
  FROM tunnel.finding a
  JOIN tunnel.survey s ON s.id = a.survey_id
  JOIN tunnel.tunnel t ON t.id = s.tunnel_id
  LEFT JOIN tunnel.finding_kind k ON k.code = coalesce(a.kind_override, a.kind)
  LEFT JOIN tunnel.severity v ON v.id = a.severity
 CROSS JOIN LATERAL (SELECT (a.chainage_from + a.chainage_to) / 2 AS chainage,
                            floor((a.chainage_from + a.chainage_to) / 2 / t.spacing)::integer AS near) m
 CROSS JOIN LATERAL (SELECT CASE WHEN a.length IS NOT NULL THEN tunnel_api.line_orientation(a.shape) END AS orientation) o;
COMMENT ON VIEW tunnel_api.finding IS
    'Findings on the lining, detected and drawn, of all kinds and states, with three geometries: polygons, lines and points. review, remark and kind can be updated; draw and edit outlines in finding_unrolled, finding_map and finding_3d';

-- Comments of its columns, and its views with one geometry.
DO $$
DECLARE
    comment record;
BEGIN
    FOR comment IN SELECT c.relname AS view, a.attname AS "column", t.text FROM (VALUES
        ('id', 'Number of the finding, the same in lists, sheets, reports and QGIS'),
        ('segment', 'Number of the segment at its middle'),
        ('label', 'Station of its middle, as 12+345.678'),
        ('chainage_from', 'Smallest chainage, m'),
        ('chainage_to', 'Greatest chainage, m'),
        ('arc_from', 'Smallest arc, m from the crown, positive right looking up-chainage'),
        ('arc_to', 'Greatest arc, m'),
        ('clock', 'Clock position of the middle, hours: 12 is the crown, 3 the right wall looking up-chainage'),
        ('easting', 'Easting of the centre (middle of the extent), m, in the tunnel''s SRID'),
        ('northing', 'Northing of the centre, m'),
        ('height', 'Height of the centre, m'),
        ('kind', 'Code of its kind (finding_kind): the one that an inspector gave, else the one that it was detected or drawn as'),
        ('kind_label', 'Name of its kind'),
        ('kind_detected', 'Kind that detection gave: leak, joint or dark (dry dark area); NULL for a drawn finding'),
        ('wet', 'True if its kind counts as wet'),
        ('origin', 'Origin of its outline: detected, drawn, redrawn, split or merged'),
        ('manual', 'True if it was drawn, never detected: only such findings can be deleted'),
        ('severity', 'Severity, 1 (lowest) to 4'),
        ('severity_label', 'Name of the severity'),
        ('width_mm', 'Width of a line, such as a crack, mm'),
        ('length', 'Length of a line on the surface, m'),
        ('orientation', 'Angle of a line to the axis in the unrolled plane, degrees: 0 along the tunnel, 90 around it'),
        ('orientation_class', 'longitudinal (less than 30°), oblique (30° to 60°) or transverse (more than 60°)'),
        ('area', 'Area on the lining, m²; for a line, length × width; for a point, 0'),
        ('measured', 'True if it was measured on the image; the next detect measures drawn and redrawn findings'),
        ('darkening_mean', 'Mean darkening, dB: how much lower than dry lining the corrected intensity is'),
        ('darkening_max', 'Greatest darkening, dB'),
        ('image_share', 'Share of its outline on which the image holds measurements, 0 to 1'),
        ('contrast', 'Mean darkening in standard deviations of the surrounding dry lining'),
        ('confidence', 'Confidence of detection in its kind, 0 to 1; NULL for a drawn finding'),
        ('reasons', 'Reasons of detection for its kind'),
        ('review', 'open, confirmed or rejected; drawn findings are confirmed by default'),
        ('reviewed_by', 'Role that reviewed it last, set by the database'),
        ('reviewed_at', 'Time of the last review, set by the database'),
        ('drawn_by', 'Role that drew its outline last, set by the database'),
        ('drawn_at', 'Time of the last drawing of its outline, set by the database'),
        ('detected', 'False if the last detection did not find it again (kept for its review); true for a drawn finding'),
        ('created_at', 'Time when it was first detected or drawn'),
        ('detected_at', 'Time of the last detection that found it; NULL for a drawn finding'),
        ('also_detected', 'True if the last detection found the same area'),
        ('detected_as', 'Ids of those detected findings: their state is same, and totals do not include them'),
        ('parent_id', 'Finding that it was split off'),
        ('merged_into', 'Finding that it is merged into, which totals include instead'),
        ('merged', 'Ids of the findings that are merged into it'),
        ('same_as', 'Finding with the same area, which totals include instead'),
        ('dry_region_id', 'Dry region (dry_region) that it lies in; totals do not include it while it is open'),
        ('counted', 'True if totals include it: detected or drawn, not rejected, not superseded'),
        ('state', 'open, confirmed, rejected, gone (not detected again), dry (in a dry region), same or merged (another is included instead)'),
        ('photos', 'Number of photos (finding_photo)'),
        ('evidence', 'Evidence for a leak and against it in words, with logarithms of odds, the strongest first; NULL for a drawn finding'),
        ('other_images', 'Differences from the lining around it in other images, such as thermal -0.8 K (finding_image); NULL if none shows it, or it was redrawn since'),
        ('other_contrast', 'Greatest of these differences in standard deviations of the lining around it'),
        ('model', 'Version of the model of evidence that classified it'),
        ('superseded', 'True if another finding (merged_into, same_as) or a dry region replaces it'),
        ('unrolled', 'Geometry in the unrolled plane (chainage, arc), m, SRID 0'),
        ('map', 'Geometry on the map strip beside the axis, tunnel''s SRID'),
        ('surface', 'Geometry on the lining in space (3D), tunnel''s SRID. ST_Area of it is 0 on a vertical wall: use area')) AS t (name, text)
      JOIN pg_attribute a ON a.attname = t.name AND a.attnum > 0
      JOIN pg_class c ON c.oid = a.attrelid
     WHERE c.relnamespace = 'tunnel_api'::regnamespace AND c.relkind = 'v' AND c.relname = 'finding'
    LOOP
        EXECUTE format('COMMENT ON COLUMN tunnel_api.%I.%I IS %L', comment.view, comment."column", comment.text);
    END LOOP;
END
$$;
CALL tunnel_internal.make_geometry_views(
    'finding', 'finding', 'Findings',
    ': polygons, lines and points are drawn, redrawn and reviewed here, and what was drawn is deleted');

CREATE OR REPLACE VIEW tunnel_api.finding_polygon AS
SELECT a.id, a.survey_id, s.name AS survey, a.unrolled::public.geometry(Polygon, 0) AS unrolled, a.map::public.geometry AS map,
       a.surface::public.geometry AS surface
  FROM tunnel.finding a
  JOIN tunnel.survey s ON s.id = a.survey_id;
COMMENT ON VIEW tunnel_api.finding_polygon IS
    'Findings as polygons: a line as a strip of its width, a point as a circle of 5 cm radius. Other columns are in finding, with the same id';
COMMENT ON COLUMN tunnel_api.finding_polygon.id IS 'Id in finding';
COMMENT ON COLUMN tunnel_api.finding_polygon.unrolled IS 'Polygon in the unrolled plane (chainage, arc), m, SRID 0';
COMMENT ON COLUMN tunnel_api.finding_polygon.map IS 'Polygon on the map strip beside the axis, tunnel''s SRID';
COMMENT ON COLUMN tunnel_api.finding_polygon.surface IS 'Polygon on the lining in space (3D), tunnel''s SRID';

CREATE OR REPLACE VIEW tunnel_api.finding_evidence AS
SELECT a.id * 100 + e.n AS id, a.id AS finding_id, a.survey_id, s.name AS survey, e.reason, e.log_odds,
       tunnel_internal.evidence_words(e.reason, e.log_odds) AS words
  FROM tunnel.finding a
  JOIN tunnel.survey s ON s.id = a.survey_id
 CROSS JOIN LATERAL (SELECT v.key AS reason, v.value::double precision AS log_odds, row_number() OVER (ORDER BY v.key) AS n
                       FROM jsonb_each_text(a.evidence) v) e;
COMMENT ON VIEW tunnel_api.finding_evidence IS 'Evidence for and against each finding being a leak: a row for each reason';
COMMENT ON COLUMN tunnel_api.finding_evidence.finding_id IS 'Id of the finding';
COMMENT ON COLUMN tunnel_api.finding_evidence.reason IS 'Measured property: faint, thin, rectangular, …';
COMMENT ON COLUMN tunnel_api.finding_evidence.log_odds IS
    'Contribution to the logarithm of the odds of a leak; negative: evidence against a leak';
COMMENT ON COLUMN tunnel_api.finding_evidence.words IS 'What the reason says for or against a leak: irregular outline, straight sides like a repair, …';

CREATE OR REPLACE VIEW tunnel_api.leak AS
SELECT a.id, a.survey_id, s.name AS survey, a.km,
       (SELECT min(g.n) FROM tunnel.segment g
         WHERE g.survey_id = a.survey_id AND g.n BETWEEN m.near - 2 AND m.near + 2
           AND m.chainage BETWEEN g.chainage_from AND g.chainage_to) AS segment,
       a.chainage_from, a.chainage_to,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, m.chainage) l) AS label,
       a.arc_from, a.arc_to, a.clock,
       coalesce(a.kind_override, a.kind) AS kind, a.kind AS kind_detected, a.reasons, a.confidence, a.contrast,
       a.area, a.darkening_mean, a.darkening_max, a.image_share,
       a.review, a.reviewed_by, a.reviewed_at, a.remark, a.detected, a.created_at, a.detected_at,
       a.detected AND a.review <> 'rejected' AS counted,
       tunnel_internal.evidence_text(a.evidence) AS evidence, a.model, a.wet, a.origin, a.severity,
       v.label AS severity_label, a.drawn_by, a.drawn_at,
       (SELECT i.words FROM tunnel_internal.other_images i
         WHERE i.finding_id = a.id AND i.outline_key = tunnel_internal.outline_key(a.unrolled)) AS other_images,
       (SELECT i.contrast FROM tunnel_internal.other_images i
         WHERE i.finding_id = a.id AND i.outline_key = tunnel_internal.outline_key(a.unrolled)) AS other_contrast,
       (public.st_xmin(coalesce(a.shape_surface, a.surface)) + public.st_xmax(coalesce(a.shape_surface, a.surface))) / 2 AS easting,
       (public.st_ymin(coalesce(a.shape_surface, a.surface)) + public.st_ymax(coalesce(a.shape_surface, a.surface))) / 2 AS northing,
       (public.st_zmin(coalesce(a.shape_surface, a.surface)) + public.st_zmax(coalesce(a.shape_surface, a.surface))) / 2 AS height,
       a.unrolled::public.geometry(Polygon, 0) AS unrolled,
       a.map::public.geometry AS map,
       a.surface::public.geometry AS surface
  FROM tunnel.finding a
  JOIN tunnel.survey s ON s.id = a.survey_id
  JOIN tunnel.tunnel t ON t.id = s.tunnel_id
  LEFT JOIN tunnel.severity v ON v.id = a.severity
 CROSS JOIN LATERAL (SELECT (a.chainage_from + a.chainage_to) / 2 AS chainage,
                            floor((a.chainage_from + a.chainage_to) / 2 / t.spacing)::integer AS near) m
 WHERE a.wet AND NOT a.superseded;

COMMENT ON VIEW tunnel_api.leak IS
    'Water leaks: findings whose kind is wet, detected and drawn, as polygons in three geometries; review, remark and kind can be updated';

-- Comments of its columns, and its views with one geometry.
DO $$
DECLARE
    comment record;
BEGIN
    FOR comment IN SELECT c.relname AS view, a.attname AS "column", t.text FROM (VALUES
        ('id', 'Number of the finding, the same in lists, sheets, reports and QGIS'),
        ('segment', 'Number of the segment at its middle'),
        ('label', 'Station of its middle, as 12+345.678'),
        ('chainage_from', 'Smallest chainage, m'),
        ('chainage_to', 'Greatest chainage, m'),
        ('arc_from', 'Smallest arc, m from the crown, positive right looking up-chainage'),
        ('arc_to', 'Greatest arc, m'),
        ('clock', 'Clock position of the middle, hours: 12 is the crown, 3 the right wall looking up-chainage'),
        ('easting', 'Easting of the centre (middle of the extent), m, in the tunnel''s SRID'),
        ('northing', 'Northing of the centre, m'),
        ('height', 'Height of the centre, m'),
        ('kind', 'Code of its kind (finding_kind): the one that an inspector gave, else the one that detection gave'),
        ('kind_detected', 'Kind that detection gave: leak, joint or dark (dry dark area)'),
        ('reasons', 'Reasons of detection for its kind'),
        ('confidence', 'Confidence of detection in its kind, 0 to 1'),
        ('contrast', 'Mean darkening in standard deviations of the surrounding dry lining'),
        ('area', 'Area on the lining, m²'),
        ('darkening_mean', 'Mean darkening, dB: how much lower than dry lining the corrected intensity is; NULL for a drawn leak until it is measured'),
        ('darkening_max', 'Greatest darkening, dB; NULL for a drawn leak until it is measured'),
        ('image_share', 'Share of the polygon on which the image holds measurements, 0 to 1; NULL for a drawn leak until it is measured'),
        ('review', 'open, confirmed or rejected'),
        ('reviewed_by', 'Role that reviewed it last, set by the database'),
        ('reviewed_at', 'Time of the last review, set by the database'),
        ('remark', 'Remark of the reviewer'),
        ('detected', 'False if the last detection did not find it again (kept for its review)'),
        ('counted', 'True if totals include it: detected last, and not rejected'),
        ('wet', 'True if its kind counts as wet: those are in the views of leaks'),
        ('origin', 'Origin of its outline: detected, drawn, redrawn, split or merged'),
        ('evidence', 'Evidence for a leak and against it in words, with logarithms of odds, the strongest first'),
        ('other_images', 'Differences from the lining around it in other images, such as thermal -0.8 K (finding_image); NULL if none shows it, or it was redrawn since'),
        ('other_contrast', 'Greatest of these differences in standard deviations of the lining around it'),
        ('model', 'Version of the model of evidence that classified it'),
        ('severity', 'Severity, 1 (lowest) to 4; edited in the views of findings'),
        ('severity_label', 'Name of the severity'),
        ('drawn_by', 'Role that drew its outline last, set by the database; NULL if it was detected'),
        ('drawn_at', 'Time of the last drawing of its outline, set by the database'),
        ('unrolled', 'Polygon in the unrolled plane (chainage, arc), m, SRID 0: measure and compare leaks here'),
        ('map', 'Polygon on the map strip beside the axis, tunnel''s SRID'),
        ('surface', 'Polygon on the lining in space (3D), tunnel''s SRID. ST_Area of it is 0 on a vertical wall: use area')) AS t (name, text)
      JOIN pg_attribute a ON a.attname = t.name AND a.attnum > 0
      JOIN pg_class c ON c.oid = a.attrelid
     WHERE c.relnamespace = 'tunnel_api'::regnamespace AND c.relkind = 'v' AND c.relname = 'leak'
    LOOP
        EXECUTE format('COMMENT ON COLUMN tunnel_api.%I.%I IS %L', comment.view, comment."column", comment.text);
    END LOOP;
END
$$;

CALL tunnel_internal.make_geometry_views('leak', 'leak', 'Leaks', '; review, remark and kind can be updated');

CREATE OR REPLACE VIEW tunnel_api.finding_photo AS
SELECT p.id, p.finding_id, a.survey_id, s.name AS survey, p.path, p.caption, p.added_by, p.added_at
  FROM tunnel.photo p
  JOIN tunnel.finding a ON a.id = p.finding_id
  JOIN tunnel.survey s ON s.id = a.survey_id;
COMMENT ON VIEW tunnel_api.finding_photo IS 'Photos of findings, by path or URL, or stored in the database (finding_photo_content); rows may be added, changed and deleted';
COMMENT ON COLUMN tunnel_api.finding_photo.finding_id IS 'Id of the finding';
COMMENT ON COLUMN tunnel_api.finding_photo.path IS
    'Path or URL; of a photo that the desk stored, the SHA-256 of its content in hexadecimal digits, and .jpg';
COMMENT ON COLUMN tunnel_api.finding_photo.caption IS 'Caption';
COMMENT ON COLUMN tunnel_api.finding_photo.added_by IS 'Role that added it, set by the database';
COMMENT ON COLUMN tunnel_api.finding_photo.added_at IS 'Time when it was added, set by the database';

-- Numbers of findings by kind, origin and state, from the sums that triggers on tunnel.finding maintain.
CREATE OR REPLACE VIEW tunnel_api.finding_count AS
SELECT (a.survey_id::bigint * 100000 + min(k.id)) * 10
           + array_position('{detected,drawn,redrawn,split,merged}'::text[], a.origin) AS id,
       a.survey_id, s.name AS survey, a.kind, a.wet, a.origin,
       coalesce(sum(a.findings) FILTER (WHERE c.counted), 0)::bigint AS counted,
       coalesce(sum(a.findings) FILTER (WHERE a.state = 'open'), 0)::bigint AS open,
       coalesce(sum(a.findings) FILTER (WHERE a.state = 'confirmed'), 0)::bigint AS confirmed,
       coalesce(sum(a.findings) FILTER (WHERE a.state = 'rejected'), 0)::bigint AS rejected,
       coalesce(sum(a.findings) FILTER (WHERE a.state = 'merged'), 0)::bigint AS merged,
       coalesce(sum(a.findings) FILTER (WHERE a.state = 'same'), 0)::bigint AS same,
       coalesce(sum(a.findings) FILTER (WHERE a.state = 'dry'), 0)::bigint AS dry,
       coalesce(sum(a.findings) FILTER (WHERE a.state = 'gone'), 0)::bigint AS gone,
       coalesce(sum(a.findings) FILTER (WHERE c.counted AND NOT a.measured), 0)::bigint AS to_measure,
       coalesce(sum(a.area) FILTER (WHERE c.counted), 0) AS area, coalesce(sum(a.length) FILTER (WHERE c.counted), 0) AS length
  FROM tunnel.finding_sum a
  JOIN tunnel.survey s ON s.id = a.survey_id
  JOIN tunnel.finding_kind k ON k.code = a.kind
 CROSS JOIN LATERAL (SELECT a.state IN ('open', 'confirmed') AS counted) c
 GROUP BY a.survey_id, s.name, a.kind, a.wet, a.origin
HAVING sum(a.findings) <> 0;
COMMENT ON VIEW tunnel_api.finding_count IS 'Number of findings of a survey by kind, origin and state';
COMMENT ON COLUMN tunnel_api.finding_count.id IS 'Key, of survey, kind and origin';
COMMENT ON COLUMN tunnel_api.finding_count.kind IS 'Code of the kind';
COMMENT ON COLUMN tunnel_api.finding_count.wet IS 'True if the kind counts as wet';
COMMENT ON COLUMN tunnel_api.finding_count.origin IS 'detected, drawn, redrawn, split or merged';
COMMENT ON COLUMN tunnel_api.finding_count.counted IS 'Number included in totals: open and confirmed';
COMMENT ON COLUMN tunnel_api.finding_count.open IS 'Number of these not reviewed yet';
COMMENT ON COLUMN tunnel_api.finding_count.confirmed IS 'Number of these confirmed or drawn';
COMMENT ON COLUMN tunnel_api.finding_count.rejected IS 'Number rejected';
COMMENT ON COLUMN tunnel_api.finding_count.merged IS 'Number merged into another finding';
COMMENT ON COLUMN tunnel_api.finding_count.same IS 'Number with the same area as another finding';
COMMENT ON COLUMN tunnel_api.finding_count.dry IS 'Number excluded by a dry region';
COMMENT ON COLUMN tunnel_api.finding_count.gone IS 'Number that the last detection did not find again, not rejected';
COMMENT ON COLUMN tunnel_api.finding_count.to_measure IS 'Number included in totals and not measured before the next detect';
COMMENT ON COLUMN tunnel_api.finding_count.area IS 'Area of the findings included in totals, m²';
COMMENT ON COLUMN tunnel_api.finding_count.length IS 'Length of the findings included in totals, m';

CREATE OR REPLACE VIEW tunnel_api.dry_region AS
SELECT r.id, r.survey_id, s.name AS survey, ST_XMin(r.geom) AS chainage_from, ST_XMax(r.geom) AS chainage_to,
       tunnel_api.station_label(s.tunnel_id, ST_XMin(r.geom)) AS label_from,
       tunnel_api.station_label(s.tunnel_id, ST_XMax(r.geom)) AS label_to,
       ST_YMin(r.geom) AS arc_from, ST_YMax(r.geom) AS arc_to, ST_Area(r.geom) AS area, t.dry_region_limit AS area_limit, r.reason,
       r.drawn_by, r.drawn_at, r.pending_approval, r.approved_by, r.approved_at, l.leaks, l.leaks_area, l.ids AS leak_ids, r.geom::public.geometry(Polygon, 0) AS geom
  FROM tunnel.region r
  JOIN tunnel.survey s ON s.id = r.survey_id
  JOIN tunnel.tunnel t ON t.id = s.tunnel_id
 CROSS JOIN LATERAL (
        SELECT count(*) AS leaks, coalesce(sum(a.area), 0) AS leaks_area, array_agg(a.id ORDER BY a.id) AS ids
          FROM tunnel.finding a
         WHERE a.dry_region_id = r.id AND a.review = 'open' AND a.merged_into IS NULL AND a.same_as IS NULL) l
 WHERE r.kind = 'dry';
COMMENT ON VIEW tunnel_api.dry_region IS
    'Dry regions and the leaks that each excludes: open leaks with at least half of their area in it are kept but not counted, and return when the region is deleted';
COMMENT ON COLUMN tunnel_api.dry_region.arc_from IS 'Smallest arc, m';
COMMENT ON COLUMN tunnel_api.dry_region.arc_to IS 'Greatest arc, m';
COMMENT ON COLUMN tunnel_api.dry_region.area IS 'Area in the unrolled plane, m²';
COMMENT ON COLUMN tunnel_api.dry_region.area_limit IS
    'Area that a person can take away in a survey without a reason and the approval of an operator (tunnel.tunnel.dry_region_limit), m²';
COMMENT ON COLUMN tunnel_api.dry_region.reason IS 'Reason why it was drawn';
COMMENT ON COLUMN tunnel_api.dry_region.pending_approval IS
    'True if it waits for the approval of an operator (dry_region_approve); until then it has no effect';
COMMENT ON COLUMN tunnel_api.dry_region.approved_by IS 'Operator who approved it, where approval was required';
COMMENT ON COLUMN tunnel_api.dry_region.approved_at IS 'Time of the approval';
COMMENT ON COLUMN tunnel_api.dry_region.leaks IS 'Number of open leaks that it excludes';
COMMENT ON COLUMN tunnel_api.dry_region.leaks_area IS 'Area of those leaks, m²';
COMMENT ON COLUMN tunnel_api.dry_region.leak_ids IS 'Ids of those leaks (finding)';
COMMENT ON COLUMN tunnel_api.dry_region.geom IS 'Polygon in the unrolled plane (chainage, arc), m';

-- Example of an owner's view, in the form of the Specifications for the National Tunnel Inventory (FHWA), without their limits: severity
-- 1 to 4 as condition states CS1 to CS4, findings without severity as CS2. The liner without findings is in CS1.
CREATE OR REPLACE VIEW tunnel_api.snti_condition AS
SELECT s.id::bigint * 10 + q.n AS id, s.id AS survey_id, s.name AS survey, q.element, q.unit,
       q.cs1 + CASE WHEN q.n = 1 THEN greatest(coalesce(i.seen, 0) - q.cs1 - q.cs2 - q.cs3 - q.cs4, 0) ELSE 0 END AS cs1,
       q.cs2, q.cs3, q.cs4, i.seen_share
  FROM tunnel.survey s
  LEFT JOIN LATERAL tunnel_api.coverage(s.name, '-infinity', 'infinity') i (lining, seen, seen_share) ON true
 CROSS JOIN LATERAL (
        SELECT e.n, e.element, e.unit, coalesce(sum(m.amount) FILTER (WHERE g.state = 1), 0) AS cs1,
               coalesce(sum(m.amount) FILTER (WHERE g.state = 2), 0) AS cs2,
               coalesce(sum(m.amount) FILTER (WHERE g.state = 3), 0) AS cs3,
               coalesce(sum(m.amount) FILTER (WHERE g.state = 4), 0) AS cs4
          FROM (VALUES
                (1, 'liner', 'm²', ARRAY['leak', 'spall', 'delamination', 'efflorescence', 'corroded']),
                (2, 'cracks', 'm', ARRAY['crack']),
                (3, 'joints', 'm', ARRAY['damaged_joint']),
                (4, 'bolts', 'each', ARRAY['missing_bolt']),
                (5, 'drips', 'each', ARRAY['drip'])) AS e (n, element, unit, kinds)
          LEFT JOIN (
                SELECT a.kind, coalesce(a.severity, 2) AS state, sum(a.findings)::float8 AS findings, sum(a.area) AS area,
                       sum(a.extent) AS length
                  FROM tunnel.finding_sum a
                 WHERE a.survey_id = s.id AND a.state IN ('open', 'confirmed')
                 GROUP BY 1, 2
                HAVING sum(a.findings) <> 0) g ON g.kind = ANY (e.kinds)
         CROSS JOIN LATERAL (
                SELECT CASE e.unit WHEN 'm²' THEN g.area WHEN 'each' THEN g.findings ELSE g.length END AS amount) m
         GROUP BY e.n, e.element, e.unit) q;
COMMENT ON VIEW tunnel_api.snti_condition IS
    'Example: quantities of elements in four condition states, as in FHWA''s SNTI, from the severity of counted findings (without severity: CS2). Limits of the SNTI are not applied. The rest of the inspected liner is in CS1. Owners can write their own view';
COMMENT ON COLUMN tunnel_api.snti_condition.element IS 'liner, cracks, joints, bolts or drips';
COMMENT ON COLUMN tunnel_api.snti_condition.unit IS 'm², m or each';
COMMENT ON COLUMN tunnel_api.snti_condition.cs1 IS 'Quantity in condition state 1, good';
COMMENT ON COLUMN tunnel_api.snti_condition.cs2 IS 'Quantity in condition state 2, fair';
COMMENT ON COLUMN tunnel_api.snti_condition.cs3 IS 'Quantity in condition state 3, poor';
COMMENT ON COLUMN tunnel_api.snti_condition.cs4 IS 'Quantity in condition state 4, severe';
COMMENT ON COLUMN tunnel_api.snti_condition.seen_share IS
    'Inspected share of the liner of the whole survey; the quantities say nothing about the rest. NULL if leaks were not searched for';
