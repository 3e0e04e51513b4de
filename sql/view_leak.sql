-- Views of the leaks and of the radiometry they rest on. A leak on a vertical wall has no area in plan, so there are
-- three geometries, each with a view of its own for QGIS: unrolled (chainage, arc; SRID 0), on the map beside the axis,
-- and in space. Needs chainage_label (leak.sql).

CREATE OR REPLACE VIEW tunnel_api.leak AS
SELECT l.id, l.survey_id, s.name AS survey, l.km,
       (SELECT min(g.n) FROM tunnel.segment g
         WHERE g.survey_id = l.survey_id AND g.n BETWEEN m.near - 2 AND m.near + 2
           AND m.chainage BETWEEN g.chainage_from AND g.chainage_to) AS segment,
       l.chainage_from, l.chainage_to,
       tunnel_api.chainage_label(m.chainage) AS label,
       l.arc_from, l.arc_to, l.clock, l.area, l.drop_mean, l.drop_max, l.image_share,
       l.review, l.reviewed_by, l.reviewed_at, l.remark, l.detected, l.created_at, l.detected_at,
       l.unrolled::public.geometry(Polygon, 0) AS unrolled,
       l.map::public.geometry AS map,
       l.surface::public.geometry AS surface
  FROM tunnel.anomaly l
  JOIN tunnel.survey s ON s.id = l.survey_id
  JOIN tunnel.tunnel t ON t.id = s.tunnel_id
 CROSS JOIN LATERAL (SELECT (l.chainage_from + l.chainage_to) / 2 AS chainage,
                            floor((l.chainage_from + l.chainage_to) / 2 / t.spacing)::integer AS near) m;

CREATE OR REPLACE VIEW tunnel_api.leak_unrolled AS
SELECT id, survey_id, survey, km, segment, chainage_from, chainage_to, label, arc_from, arc_to, clock, area, drop_mean,
       drop_max, image_share, review, reviewed_by, reviewed_at, remark, detected, created_at, detected_at,
       unrolled AS geom
  FROM tunnel_api.leak;

CREATE OR REPLACE VIEW tunnel_api.leak_map AS
SELECT id, survey_id, survey, km, segment, chainage_from, chainage_to, label, arc_from, arc_to, clock, area, drop_mean,
       drop_max, image_share, review, reviewed_by, reviewed_at, remark, detected, created_at, detected_at,
       map AS geom
  FROM tunnel_api.leak;

CREATE OR REPLACE VIEW tunnel_api.leak_3d AS
SELECT id, survey_id, survey, km, segment, chainage_from, chainage_to, label, arc_from, arc_to, clock, area, drop_mean,
       drop_max, image_share, review, reviewed_by, reviewed_at, remark, detected, created_at, detected_at,
       surface AS geom
  FROM tunnel_api.leak;

COMMENT ON VIEW tunnel_api.leak IS 'Water leaks with their three geometries; review and remark can be updated';
COMMENT ON VIEW tunnel_api.leak_unrolled IS 'Leaks in the unrolled plane (chainage, arc), SRID 0; review and remark can be updated';
COMMENT ON VIEW tunnel_api.leak_map IS 'Leaks on the map strip beside the axis, in the tunnel''s SRID; review and remark can be updated';
COMMENT ON VIEW tunnel_api.leak_3d IS 'Leaks on the lining in space, in the tunnel''s SRID; review and remark can be updated';

DO $$
DECLARE
    v text;
    c record;
BEGIN
    FOREACH v IN ARRAY ARRAY['leak', 'leak_unrolled', 'leak_map', 'leak_3d'] LOOP
        FOR c IN SELECT * FROM (VALUES
            ('segment', 'Number of the segment that holds the leak''s middle'),
            ('label', 'Chainage of the leak''s middle, as 12+345.678'),
            ('chainage_from', 'Least chainage of the leak, m'),
            ('chainage_to', 'Greatest chainage of the leak, m'),
            ('arc_from', 'Least arc of the leak, m from the crown, positive right looking up-chainage'),
            ('arc_to', 'Greatest arc of the leak, m'),
            ('clock', 'Clock position of the middle, hours: 12 is the crown, 3 the right wall looking up-chainage'),
            ('area', 'Area on the lining, m²'),
            ('drop_mean', 'Mean drop of corrected intensity below dry lining, dB'),
            ('drop_max', 'Greatest drop of corrected intensity below dry lining, dB'),
            ('image_share', 'Share of the polygon on which the image holds measurements, 0-1'),
            ('review', 'open, confirmed or rejected'),
            ('reviewed_by', 'Who reviewed it last, set by the database'),
            ('reviewed_at', 'When it was reviewed last, set by the database'),
            ('remark', 'The reviewer''s remark'),
            ('detected', 'False when the last detection found it no more (kept for its review)')) AS t (name, text)
        LOOP
            EXECUTE format('COMMENT ON COLUMN tunnel_api.%I.%I IS %L', v, c.name, c.text);
        END LOOP;
    END LOOP;
END
$$;

CREATE OR REPLACE VIEW tunnel_api.radiometry AS
SELECT r.survey_id::bigint * 1000000 + 500000 + r.km AS id, r.survey_id, s.name AS survey, r.km, r.roughness, r.dry_mean,
       r.dry_sigma, r.threshold, r.sigma_raw, r.sigma_lambert, r.sigma_oren_nayar, r.regions, r.pixels, r.wet_pixels
  FROM tunnel.radiometry r
  JOIN tunnel.survey s ON s.id = r.survey_id;
COMMENT ON VIEW tunnel_api.radiometry IS 'Intensity correction of each kilometre (Xu et al., 2018)';
COMMENT ON COLUMN tunnel_api.radiometry.roughness IS 'Roughness angle of Oren-Nayar, degrees (eq. 13-18)';
COMMENT ON COLUMN tunnel_api.radiometry.threshold IS 'Corrected intensity below which lining is wet, dB (eq. 19-20)';
COMMENT ON COLUMN tunnel_api.radiometry.sigma_raw IS 'Standard deviation of dry lining before correction, dB';
COMMENT ON COLUMN tunnel_api.radiometry.sigma_lambert IS 'The same after correction by Lambert''s law, dB';
COMMENT ON COLUMN tunnel_api.radiometry.sigma_oren_nayar IS 'The same after correction by Oren-Nayar, dB';

-- The lining seen is what the last detection counted: pixels of lining that hold measurements × the area of a pixel.
CREATE OR REPLACE VIEW tunnel_api.km_statistics AS
SELECT s.id::bigint * 1000000 + 500000 + g.km AS id, s.id AS survey_id, s.name AS survey, g.km, g.chainage_from,
       g.chainage_to, d.lining_area, l.wet_area, l.wet_area / nullif(d.lining_area, 0) AS wet_share, l.leaks, l.leaks_open,
       l.leaks_confirmed, l.leaks_rejected, l.largest_area, l.greatest_drop
  FROM tunnel.survey s
  JOIN (SELECT survey_id, km, min(chainage_from) AS chainage_from, max(chainage_to) AS chainage_to
          FROM tunnel.segment GROUP BY survey_id, km) g ON g.survey_id = s.id
  LEFT JOIN LATERAL (
        SELECT (r.counts ->> 'lining_pixels')::float8 * (r.parameters ->> 'image.pixel')::float8 ^ 2 AS lining_area
          FROM tunnel.run r
         WHERE r.survey_id = g.survey_id AND r.km = g.km AND r.stage = 'detect' AND r.outcome = 'done'
         ORDER BY r.finished_at DESC, r.id DESC LIMIT 1) d ON true
 CROSS JOIN LATERAL (
        SELECT count(*) FILTER (WHERE k.detected AND k.review <> 'rejected') AS leaks,
               count(*) FILTER (WHERE k.detected AND k.review = 'open') AS leaks_open,
               count(*) FILTER (WHERE k.detected AND k.review = 'confirmed') AS leaks_confirmed,
               count(*) FILTER (WHERE k.detected AND k.review = 'rejected') AS leaks_rejected,
               coalesce(sum(k.area) FILTER (WHERE k.detected AND k.review <> 'rejected'), 0) AS wet_area,
               max(k.area) FILTER (WHERE k.detected AND k.review <> 'rejected') AS largest_area,
               max(k.drop_max) FILTER (WHERE k.detected AND k.review <> 'rejected') AS greatest_drop
          FROM tunnel.anomaly k
         WHERE k.survey_id = g.survey_id AND k.km = g.km) l;
COMMENT ON VIEW tunnel_api.km_statistics IS 'Leaks of each kilometre, summed; without those rejected or no longer found';
COMMENT ON COLUMN tunnel_api.km_statistics.lining_area IS 'Lining that the last detection saw, m²; NULL before it';
COMMENT ON COLUMN tunnel_api.km_statistics.wet_area IS 'Area of the leaks on the lining, m²';
COMMENT ON COLUMN tunnel_api.km_statistics.wet_share IS 'wet_area / lining_area';
COMMENT ON COLUMN tunnel_api.km_statistics.leaks IS 'Leaks open or confirmed';
