-- Over- and underbreak by metre, to be drawn: bars beside the unrolled lining, and the axis on the map. Needs deviation_section
-- (views/deviation.sql).

-- Beyond half the profile's length from the crown nothing of the lining lies: there each layer has its own row of bars.
CREATE OR REPLACE VIEW tunnel_api.deviation_bar AS
SELECT d.id * 2 + b.number AS id, d.survey_id, d.survey, d.layer, b.side, d.chainage_from, d.chainage_to, d.label, b.area,
       d.seen_share, b.extreme,
       public.ST_MakeEnvelope(d.chainage_from, b.way * p.base, d.chainage_to, b.way * (p.base + b.area), 0)::public.geometry(Polygon, 0) AS geom
  FROM tunnel_api.deviation_section d
 CROSS JOIN LATERAL (
    SELECT d.design_length / 2 + 1 + CASE d.layer WHEN 'lining' THEN 0 WHEN 'shotcrete' THEN 4 ELSE 8 END AS base) p
 CROSS JOIN LATERAL (VALUES (0, 'underbreak', 1, d.underbreak, d.deviation_greatest),
                            (1, 'overbreak', -1, d.overbreak, d.deviation_least)) AS b (number, side, way, area, extreme)
 WHERE b.area > 0;
COMMENT ON VIEW tunnel_api.deviation_bar IS
    'Over- and underbreak by metre as bars beside the unrolled lining (chainage, arc): underbreak above it, overbreak below, a metre tall for each m²';
COMMENT ON COLUMN tunnel_api.deviation_bar.layer IS 'Layer of the profile';
COMMENT ON COLUMN tunnel_api.deviation_bar.side IS 'underbreak, which stands inside, or overbreak';
COMMENT ON COLUMN tunnel_api.deviation_bar.label IS 'Station of its middle, as 12+345.678';
COMMENT ON COLUMN tunnel_api.deviation_bar.area IS 'Its area in the section, of what was seen, m²';
COMMENT ON COLUMN tunnel_api.deviation_bar.seen_share IS 'Share of the profile that was seen, 0 to 1';
COMMENT ON COLUMN tunnel_api.deviation_bar.extreme IS 'Mean deviation of the cell that stands in, or lies out, most, m, positive inside';

CREATE OR REPLACE VIEW tunnel_api.deviation_map AS
SELECT d.id, d.survey_id, d.survey, d.layer, d.chainage_from, d.chainage_to, d.label, d.underbreak, d.overbreak,
       d.underbreak - d.overbreak AS balance, d.seen_share, g.geom
  FROM tunnel_api.deviation_section d
 CROSS JOIN LATERAL (
    SELECT public.ST_LineSubstring(public.ST_Force2D(s.geom),
               greatest((d.chainage_from - s.chainage_from) / (s.chainage_to - s.chainage_from), 0),
               least((d.chainage_to - s.chainage_from) / (s.chainage_to - s.chainage_from), 1)) AS geom
      FROM tunnel.segment s
     WHERE s.survey_id = d.survey_id AND s.chainage_from <= (d.chainage_from + d.chainage_to) / 2
       AND s.chainage_to > (d.chainage_from + d.chainage_to) / 2
     LIMIT 1) g;
COMMENT ON VIEW tunnel_api.deviation_map IS 'Over- and underbreak by metre on the measured axis, in the map: tunnel''s SRID, 2D';
COMMENT ON COLUMN tunnel_api.deviation_map.layer IS 'Layer of the profile';
COMMENT ON COLUMN tunnel_api.deviation_map.label IS 'Station of its middle, as 12+345.678';
COMMENT ON COLUMN tunnel_api.deviation_map.underbreak IS 'Area inside the profile, of what was seen, m²';
COMMENT ON COLUMN tunnel_api.deviation_map.overbreak IS 'Area outside the profile, of what was seen, m²';
COMMENT ON COLUMN tunnel_api.deviation_map.balance IS 'Underbreak less overbreak, m²';
COMMENT ON COLUMN tunnel_api.deviation_map.seen_share IS 'Share of the profile that was seen, 0 to 1';
COMMENT ON COLUMN tunnel_api.deviation_bar.geom IS 'The bar: chainage and arc, m; SRID 0';
COMMENT ON COLUMN tunnel_api.deviation_map.geom IS 'The metre of the measured axis, tunnel''s SRID';
