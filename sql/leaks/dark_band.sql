-- Dark bands along the tunnel that detection takes for the level of dry lining, because they are as long as soot and grime are.
-- Whether they are wet is not decided. Needs station_label (geometry/stationing.sql).

CREATE OR REPLACE VIEW tunnel_api.dark_band AS
SELECT (b.survey_id::bigint * 1000000 + 500000 + b.km) * 10000 + b.n AS id, b.survey_id, s.name AS survey, b.km, b.chainage_from,
       b.chainage_to, tunnel_api.station_label(s.tunnel_id, b.chainage_from) AS label_from,
       tunnel_api.station_label(s.tunnel_id, b.chainage_to) AS label_to, b.arc_from, b.arc_to, b.darkening, b.area,
       w.area >= 0.5 * public.st_area(e.geom) AS decided, e.geom::public.geometry(Polygon, 0) AS geom
  FROM tunnel.dark_band b
  JOIN tunnel.survey s ON s.id = b.survey_id
 CROSS JOIN LATERAL (
        SELECT public.st_makeenvelope(b.chainage_from, b.arc_from, b.chainage_to, b.arc_to, 0) AS geom) e
 CROSS JOIN LATERAL (
        SELECT coalesce(sum(public.st_area(public.st_intersection(f.unrolled, e.geom))), 0) AS area
          FROM tunnel.finding f
         WHERE f.survey_id = b.survey_id AND f.wet AND f.review <> 'rejected' AND NOT f.superseded
           AND f.chainage_from < b.chainage_to AND f.chainage_to > b.chainage_from
           AND f.arc_from < b.arc_to AND f.arc_to > b.arc_from) w;
COMMENT ON VIEW tunnel_api.dark_band IS
    'Dark bands along the tunnel, in pieces: they may be wet or dirty, and detection uses them as the level of dry lining. To decide, draw a leak over them or, if they are dry, a dry region, then run detect';
COMMENT ON COLUMN tunnel_api.dark_band.id IS 'Key, valid until detect runs';
COMMENT ON COLUMN tunnel_api.dark_band.arc_from IS 'Smallest arc, m';
COMMENT ON COLUMN tunnel_api.dark_band.arc_to IS 'Greatest arc, m';
COMMENT ON COLUMN tunnel_api.dark_band.darkening IS 'Mean difference from the brightest lining beside it, dB';
COMMENT ON COLUMN tunnel_api.dark_band.area IS 'Lining in it that was seen, m²';
COMMENT ON COLUMN tunnel_api.dark_band.decided IS 'True if leaks cover at least half of it';
COMMENT ON COLUMN tunnel_api.dark_band.geom IS 'Rectangle of the unrolled plane (chainage, arc), SRID 0';
