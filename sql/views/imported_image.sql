-- Images of other instruments in the unrolled plane. Their pixels are read like those of the survey's own images: image_values
-- (leaks/image.sql), image_tiffs (views/desk.sql).

CREATE OR REPLACE VIEW tunnel_api.imported_image AS
SELECT i.id, i.survey_id, s.name AS survey, i.name, i.kind, 'imported_' || i.name AS image, i.colour, i.unit, i.value_from,
       i.value_to, i.step, i.pixel, i.placement, i.model, i.frames, i.points, i.outliers, i.residual, i.predicted, i.chainage_from, i.chainage_to,
       i.arc_from, i.arc_to, i.source, i.warnings, i.imported_by, i.imported_at
  FROM tunnel.imported_image i
  JOIN tunnel.survey s ON s.id = i.survey_id;
COMMENT ON VIEW tunnel_api.imported_image IS
    'Images of other instruments, such as thermal cameras, placed in the unrolled plane of a survey by tunneldb image import';
COMMENT ON COLUMN tunnel_api.imported_image.image IS
    'Its kind for image_values (if it has values, not colours) and image_tiffs: imported_NAME';

CREATE OR REPLACE VIEW tunnel_api.finding_image AS
SELECT v.id, v.finding_id, f.survey_id, s.name AS survey, coalesce('imported_' || i.name, 'rgb') AS image, coalesce(i.kind, 'rgb') AS kind,
       CASE WHEN i.colour IS NOT FALSE THEN 'L*' ELSE i.unit END AS unit, v.mean, v.surroundings,
       v.mean - v.surroundings AS contrast, v.spread, abs(v.mean - v.surroundings) / nullif(v.spread, 0) AS relative_contrast, v.share
  FROM tunnel.finding_image v
  JOIN tunnel.finding f ON f.id = v.finding_id
  JOIN tunnel.survey s ON s.id = f.survey_id
  LEFT JOIN tunnel.imported_image i ON i.id = v.imported_image_id
 WHERE v.outline_key = tunnel_internal.outline_key(f.unrolled);
COMMENT ON VIEW tunnel_api.finding_image IS
    'Values of other images under findings, and on the lining around them: the colours of the scan and imported images. They change no verdict. detect and tunneldb image import measure them';
COMMENT ON COLUMN tunnel_api.finding_image.id IS 'Key; another one each time that it is measured';
COMMENT ON COLUMN tunnel_api.finding_image.finding_id IS 'Id of the finding';
COMMENT ON COLUMN tunnel_api.finding_image.image IS 'rgb, or imported_NAME';
COMMENT ON COLUMN tunnel_api.finding_image.kind IS 'rgb, or the kind of the imported image: thermal, photo, radar, moisture, other';
COMMENT ON COLUMN tunnel_api.finding_image.unit IS 'Unit of the values; L* (CIE lightness, 0 to 100) of images in colour';
COMMENT ON COLUMN tunnel_api.finding_image.mean IS 'Mean under the outline';
COMMENT ON COLUMN tunnel_api.finding_image.surroundings IS 'Median of the lining around it: 0.05 m to 0.35 m from the outline, other findings left out';
COMMENT ON COLUMN tunnel_api.finding_image.contrast IS 'Mean minus surroundings; negative: colder, darker';
COMMENT ON COLUMN tunnel_api.finding_image.spread IS 'Standard deviation of the surroundings, from the median absolute deviation';
COMMENT ON COLUMN tunnel_api.finding_image.relative_contrast IS 'Size of the contrast in standard deviations of the surroundings; NULL where they are all equal';
COMMENT ON COLUMN tunnel_api.finding_image.share IS 'Share of the pixels under the outline that have values, 0 to 1';
