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
