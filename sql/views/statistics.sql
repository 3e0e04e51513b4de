-- Views of what the leaks of each kilometre sum up to, and of the radiometry they rest on. Classes of waterproofing are in
-- leaks/waterproof.sql.

CREATE OR REPLACE VIEW tunnel_api.range_curve AS
SELECT (r.survey_id::bigint * 1000000 + 500000 + r.km) * 10000 + c.n AS id, r.survey_id, s.name AS survey, r.km,
       c.range_m, c.intensity_db, c.sigma_db
  FROM tunnel.range_curve r
  JOIN tunnel.survey s ON s.id = r.survey_id
 CROSS JOIN LATERAL unnest(r.range_m, r.intensity_db, r.sigma_db) WITH ORDINALITY AS c (range_m, intensity_db, sigma_db, n);
COMMENT ON VIEW tunnel_api.range_curve IS
    'Range curve of the intensity, estimated on the lining of each kilometre in surveys with reference auto: one row for each range';
COMMENT ON COLUMN tunnel_api.range_curve.range_m IS 'Range, m';
COMMENT ON COLUMN tunnel_api.range_curve.intensity_db IS
    'Intensity of dry lining at perpendicular incidence at this range, dB';
COMMENT ON COLUMN tunnel_api.range_curve.sigma_db IS
    'Standard deviation of the shape of the curve, dB; NULL where the curve is extrapolated';

CREATE OR REPLACE VIEW tunnel_api.radiometry AS
SELECT r.survey_id::bigint * 1000000 + 500000 + r.km AS id, r.survey_id, s.name AS survey, r.km, s.reference,
       c.range_from, c.range_to, c.range_sigma, r.roughness, r.dry_mean, r.dry_sigma, r.threshold, r.sigma_raw,
       r.sigma_lambert, r.sigma_oren_nayar, r.regions, r.pixels, r.wet_pixels
  FROM tunnel.radiometry r
  JOIN tunnel.survey s ON s.id = r.survey_id
  LEFT JOIN LATERAL (SELECT min(v.range_m) AS range_from, max(v.range_m) AS range_to, max(v.sigma_db) AS range_sigma
                       FROM tunnel.range_curve q CROSS JOIN LATERAL unnest(q.range_m, q.sigma_db) AS v (range_m, sigma_db)
                      WHERE q.survey_id = r.survey_id AND q.km = r.km AND v.sigma_db IS NOT NULL) c ON true;
COMMENT ON VIEW tunnel_api.radiometry IS 'Intensity correction of each kilometre (Xu et al., 2018)';
COMMENT ON COLUMN tunnel_api.radiometry.reference IS 'Range curve of the survey: none, measured or auto';
COMMENT ON COLUMN tunnel_api.radiometry.range_from IS
    'Smallest range on which the curve was estimated (tunnel_api.range_curve), m; NULL unless the reference is auto';
COMMENT ON COLUMN tunnel_api.radiometry.range_to IS 'Greatest range on which the curve was estimated, m';
COMMENT ON COLUMN tunnel_api.radiometry.range_sigma IS
    'Largest standard deviation of the shape of the curve between them, dB; the criterion of acceptance';
COMMENT ON COLUMN tunnel_api.radiometry.roughness IS
    'Roughness angle of Oren-Nayar, degrees (eq. 13-18); NULL if it could not be estimated and that of concrete is used, as stated in the remark';
COMMENT ON COLUMN tunnel_api.radiometry.threshold IS
    'Threshold of corrected intensity, dB; darker lining is wet (eq. 19-20)';
COMMENT ON COLUMN tunnel_api.radiometry.sigma_raw IS 'Standard deviation of dry lining before correction, dB';
COMMENT ON COLUMN tunnel_api.radiometry.sigma_lambert IS
    'Standard deviation of dry lining after correction by Lambert''s law, dB';
COMMENT ON COLUMN tunnel_api.radiometry.sigma_oren_nayar IS
    'Standard deviation of dry lining after correction by Oren-Nayar, dB';

-- Leaks, areas and shares are those of km_waterproof. Of a kilometre that was detected before there was a coverage the lining
-- seen is what that detection counted: pixels of lining that hold measurements × the area of a pixel.
CREATE OR REPLACE VIEW tunnel_api.km_statistics AS
SELECT g.id, g.survey_id, g.survey, g.km, g.chainage_from, g.chainage_to, g.lining_area, d.seen AS seen_area,
       d.seen / nullif(g.lining_area, 0) AS seen_share, g.wet_area, g.wet_area / nullif(d.seen, 0) AS wet_share,
       c.wet / nullif(c.seen, 0) AS wet_pixel_share, g.patches AS leaks,
       CASE WHEN g.patches IS NOT NULL THEN l.leaks_open END AS leaks_open,
       CASE WHEN g.patches IS NOT NULL THEN l.leaks_confirmed END AS leaks_confirmed,
       CASE WHEN g.patches IS NOT NULL THEN l.leaks_rejected ELSE nullif(l.leaks_rejected, 0) END AS leaks_rejected,
       g.largest_area, l.greatest_darkening
  FROM tunnel_api.km_waterproof g
  LEFT JOIN LATERAL (
        SELECT max(q.seen) - min(q.seen) AS seen, max(q.wet) - min(q.wet) AS wet
          FROM tunnel_internal.coverage_at(g.survey_id, ARRAY[g.chainage_from, g.chainage_to]) q) c ON g.lining_area IS NOT NULL
 CROSS JOIN LATERAL (SELECT coalesce(c.seen, (
        SELECT (r.counts ->> 'lining_pixels')::float8 * coalesce(r.counts ->> 'pixel', r.parameters ->> 'image.pixel')::float8 ^ 2
          FROM tunnel.run r
         WHERE r.survey_id = g.survey_id AND r.km = g.km AND r.stage = 'detect' AND r.outcome = 'done'
         ORDER BY r.finished_at DESC, r.id DESC LIMIT 1)) AS seen) d
 CROSS JOIN LATERAL (
        SELECT count(*) FILTER (WHERE k.detected AND k.review = 'open') AS leaks_open,
               count(*) FILTER (WHERE k.detected AND k.review = 'confirmed') AS leaks_confirmed,
               count(*) FILTER (WHERE k.detected AND k.review = 'rejected') AS leaks_rejected,
               max(k.darkening_max) FILTER (WHERE k.detected AND k.review <> 'rejected') AS greatest_darkening
          FROM tunnel.finding k
         WHERE k.survey_id = g.survey_id AND k.chainage_to > g.chainage_from AND k.chainage_from < g.chainage_to
           AND k.chainage_from >= g.chainage_from - (  -- no more of the index is read than the longest can reach
                   SELECT max(m.chainage_to - m.chainage_from) FROM tunnel.finding m WHERE m.survey_id = g.survey_id) - 1e-6
           AND k.wet AND NOT k.superseded) l;
COMMENT ON VIEW tunnel_api.km_statistics IS
    'Statistics of leaks for each kilometre, consistent with km_waterproof. Rejected leaks and leaks that the last detection did not find are left out';
COMMENT ON COLUMN tunnel_api.km_statistics.lining_area IS 'Lining, inspected or not, m²; NULL before detection';
COMMENT ON COLUMN tunnel_api.km_statistics.seen_area IS 'Lining inspected by the last detection, m²; NULL before it';
COMMENT ON COLUMN tunnel_api.km_statistics.seen_share IS 'seen_area / lining_area';
COMMENT ON COLUMN tunnel_api.km_statistics.wet_area IS
    'Area of the leaks within the kilometre, m²; a leak across a kilometre boundary counts in part';
COMMENT ON COLUMN tunnel_api.km_statistics.wet_share IS 'wet_area / seen_area';
COMMENT ON COLUMN tunnel_api.km_statistics.wet_pixel_share IS
    'Share of wet pixels, after the median filter, in the inspected lining (Xu et al., 2018)';
COMMENT ON COLUMN tunnel_api.km_statistics.leaks IS
    'Number of leaks in the kilometre or across its boundaries, open or confirmed; NULL if it was not searched';
