-- Layers of overbreak and underbreak: bars beside the unrolled lining, and the axis on the map. Needs stationing
-- (geometry/stationing.sql).

-- The bars begin at the median width of the kilometre's sections, so that sections at a portal do not move them.
CREATE OR REPLACE VIEW tunnel_api.deviation_bar AS
SELECT d.id * 2 + b.side AS id, d.survey_id, s.name AS survey, d.km, d.layer, d.profile, d.chainage_from, d.chainage_to,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, (d.chainage_from + d.chainage_to) / 2) l) AS label,
       b.kind, b.area, b.area * (d.chainage_to - d.chainage_from) AS volume, d.seen_length / d.design_length AS seen_share,
       public.st_makeenvelope(d.chainage_from, least(b.foot, b.top), d.chainage_to, greatest(b.foot, b.top), 0)
           ::public.geometry(Polygon, 0) AS geom
  FROM tunnel.survey s
 CROSS JOIN LATERAL (
    SELECT c.km, percentile_cont(0.5) WITHIN GROUP (ORDER BY c.arc[1]) - 0.5 AS low,
           percentile_cont(0.5) WITHIN GROUP (ORDER BY c.arc[361]) + 0.5 AS high
      FROM tunnel.section c WHERE c.survey_id = s.id GROUP BY c.km) a
  JOIN tunnel.deviation_section d ON d.survey_id = s.id AND d.km = a.km
 CROSS JOIN LATERAL (
    VALUES (0, 'overbreak', d.overbreak, a.low, a.low - d.overbreak),
           (1, 'underbreak', d.underbreak, a.high, a.high + d.underbreak)) AS b (side, kind, area, foot, top);
COMMENT ON VIEW tunnel_api.deviation_bar IS
    'Overbreak and underbreak of each metre as bars beside the unrolled lining: overbreak below its left edge, underbreak above its right edge, 1 m for each m²';
COMMENT ON COLUMN tunnel_api.deviation_bar.layer IS 'Layer of the profile';
COMMENT ON COLUMN tunnel_api.deviation_bar.profile IS 'Name of the profile; in a transition, both names';
COMMENT ON COLUMN tunnel_api.deviation_bar.label IS 'Station of its middle, as 12+345.678';
COMMENT ON COLUMN tunnel_api.deviation_bar.kind IS 'overbreak or underbreak';
COMMENT ON COLUMN tunnel_api.deviation_bar.area IS 'Area of the section, inspected part, m²';
COMMENT ON COLUMN tunnel_api.deviation_bar.volume IS 'Volume over its length of tunnel, m³';
COMMENT ON COLUMN tunnel_api.deviation_bar.seen_share IS 'Inspected share of the profile, 0 to 1';
COMMENT ON COLUMN tunnel_api.deviation_bar.geom IS 'In the unrolled plane (chainage, arc), m';

CREATE OR REPLACE VIEW tunnel_api.deviation_map AS
SELECT g.id * 10 + v.place AS id, g.survey_id, s.name AS survey, g.km,
       v.layer, g.chainage_from, g.chainage_to,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, g.chainage_from) l) AS label_from,
       w.overbreak, w.underbreak, w.seen_share, w.greatest, public.st_force2d(g.geom) AS geom
  FROM tunnel.segment g
  JOIN tunnel.survey s ON s.id = g.survey_id
 CROSS JOIN (VALUES ('lining', 1), ('shotcrete', 2), ('excavation', 3)) AS v (layer, place)
 CROSS JOIN LATERAL (  -- of one layer each, so that the index is gone into at the segment's beginning
    SELECT sum(p.long * d.overbreak) / sum(p.long) AS overbreak, sum(p.long * d.underbreak) / sum(p.long) AS underbreak,
           sum(p.long * d.seen_length) / sum(p.long * d.design_length) AS seen_share,
           max(greatest(d.deviation_greatest, -d.deviation_least)) AS greatest
      FROM tunnel.deviation_section d
     CROSS JOIN LATERAL (SELECT d.chainage_to - d.chainage_from AS long) p
     WHERE d.survey_id = g.survey_id AND d.layer = v.layer
       AND d.chainage_from >= g.chainage_from - 0.5 AND d.chainage_from < g.chainage_to - 0.5
    HAVING count(*) > 0) w;
COMMENT ON VIEW tunnel_api.deviation_map IS
    'Overbreak and underbreak of each segment on the axis: means of the sections with their middle in it';
COMMENT ON COLUMN tunnel_api.deviation_map.layer IS 'Layer of the profile';
COMMENT ON COLUMN tunnel_api.deviation_map.label_from IS 'Station at its beginning, as 12+345.678';
COMMENT ON COLUMN tunnel_api.deviation_map.overbreak IS 'Overbreak for each metre of tunnel, inspected part, m²';
COMMENT ON COLUMN tunnel_api.deviation_map.underbreak IS 'Underbreak for each metre of tunnel, inspected part, m²';
COMMENT ON COLUMN tunnel_api.deviation_map.seen_share IS 'Inspected share of the profile, 0 to 1';
COMMENT ON COLUMN tunnel_api.deviation_map.greatest IS 'Greatest deviation of a cell, inwards or outwards, m';
COMMENT ON COLUMN tunnel_api.deviation_map.geom IS 'Axis of the segment in plan, tunnel''s SRID';
