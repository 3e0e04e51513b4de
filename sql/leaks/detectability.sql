-- Leaks that detection would find, by blocks of the inspected lining, and whether that meets the owner's demand. Written by stage
-- detect (tunnel.detectability). Needs stationing and map_point.

CREATE OR REPLACE VIEW tunnel_api.detectability AS
SELECT d.id, d.survey_id, s.name AS survey, d.km, d.chainage_from, d.chainage_to,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, (d.chainage_from + d.chainage_to) / 2) l) AS label,
       d.arc_from, d.arc_to, d.lining_area,
       CASE WHEN d.probability >= 0.9 THEN 'met' WHEN d.probability < 0.9 THEN 'not met' ELSE 'unknown' END AS demand,
       d.probability, d.demand_area, d.demand_drop, d.smallest_1_5_db, d.smallest_3_db, d.smallest_6_db, d.trials,
       public.st_makeenvelope(d.chainage_from, d.arc_from, d.chainage_to, d.arc_to, 0)::public.geometry(Polygon, 0) AS geom
  FROM tunnel.detectability d
  JOIN tunnel.survey s ON s.id = d.survey_id;
COMMENT ON VIEW tunnel_api.detectability IS
    'Leaks that detection would find in a survey, by blocks of the inspected lining of about 10 m by 3 m in the unrolled plane (chainage, arc), SRID 0. Estimated from synthetic leaks in the survey''s own images; lining that was not inspected is in no block';
COMMENT ON COLUMN tunnel_api.detectability.label IS 'Station of its middle, as 12+345.678';
COMMENT ON COLUMN tunnel_api.detectability.demand IS
    'met: a leak of demand_area and demand_drop anywhere in the block is found with at least 90 % probability; not met: with less; unknown: too few places for synthetic leaks, or conditions worse than at all of them';
COMMENT ON COLUMN tunnel_api.detectability.geom IS 'Rectangle of the unrolled plane around its inspected lining';

CREATE OR REPLACE VIEW tunnel_api.detectability_map AS
SELECT d.id, d.survey_id, d.survey, d.km, d.chainage_from, d.chainage_to, d.label, d.arc_from, d.arc_to, d.lining_area, d.demand,
       d.probability, d.demand_area, d.demand_drop, d.smallest_1_5_db, d.smallest_3_db, d.smallest_6_db, d.trials,
       public.st_makepolygon(public.st_makeline(ARRAY[c.a, c.b, c.c, c.d, c.a]))::public.geometry AS geom
  FROM tunnel_api.detectability d
 CROSS JOIN LATERAL (  -- the survey ends between the ends of its outermost pixels
        SELECT greatest(d.chainage_from, min(k.chainage_from)) AS low, least(d.chainage_to, max(k.chainage_to)) AS high
          FROM tunnel_internal.km_ends k WHERE k.survey_id = d.survey_id) e
 CROSS JOIN LATERAL (
        SELECT tunnel_internal.map_point(d.survey_id, e.low, d.arc_from) AS a,
               tunnel_internal.map_point(d.survey_id, e.high, d.arc_from) AS b,
               tunnel_internal.map_point(d.survey_id, e.high, d.arc_to) AS c,
               tunnel_internal.map_point(d.survey_id, e.low, d.arc_to) AS d) c
 WHERE c.a IS NOT NULL AND c.b IS NOT NULL AND e.low < e.high;
COMMENT ON VIEW tunnel_api.detectability_map IS
    'Leaks that detection would find in a survey, by blocks of the inspected lining, on the map strip beside the axis';
COMMENT ON COLUMN tunnel_api.detectability_map.label IS 'Station of its middle, as 12+345.678';
COMMENT ON COLUMN tunnel_api.detectability_map.demand IS 'met, not met or unknown: see tunnel_api.detectability';
COMMENT ON COLUMN tunnel_api.detectability_map.geom IS 'Block on the map strip, tunnel''s SRID';


-- The one source of these shares: run, status, report and QGIS state them from here.
CREATE OR REPLACE FUNCTION tunnel_internal.detectability_shares(survey_id int, chainage_from float8, chainage_to float8)
RETURNS TABLE (
    demand_area float8, demand_drop float8, lining_area float8, met_share float8, not_met_share float8, unknown_share float8)
LANGUAGE sql STABLE STRICT PARALLEL SAFE
ROWS 1
SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
    SELECT d.demand_area, d.demand_drop, sum(p.area), coalesce(sum(p.area) FILTER (WHERE d.probability >= 0.9), 0) / sum(p.area),
        coalesce(sum(p.area) FILTER (WHERE d.probability < 0.9), 0) / sum(p.area),
        coalesce(sum(p.area) FILTER (WHERE d.probability IS NULL), 0) / sum(p.area)
    FROM tunnel.detectability d
    CROSS JOIN LATERAL (
        SELECT d.lining_area * (least(d.chainage_to, $3) - greatest(d.chainage_from, $2)) / (d.chainage_to - d.chainage_from)
               AS area) p
    WHERE d.survey_id = $1 AND d.chainage_from < $3 AND d.chainage_to > $2 AND tunnel_internal.in_order($2, $3)
    GROUP BY d.demand_area, d.demand_drop
    ORDER BY d.demand_area, d.demand_drop
$$;
COMMENT ON FUNCTION tunnel_internal.detectability_shares(int, float8, float8) IS
'Result of detectability_shares for a survey given by its key';


CREATE OR REPLACE FUNCTION tunnel_api.detectability_shares(
    survey text, chainage_from float8 DEFAULT '-Infinity', chainage_to float8 DEFAULT 'Infinity')
RETURNS TABLE (
    demand_area float8, demand_drop float8, lining_area float8, met_share float8, not_met_share float8, unknown_share float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT
ROWS 1
AS $$ SELECT f.* FROM tunnel_internal.detectability_shares(tunnel_api.survey_id($1), $2, $3) f $$;
COMMENT ON FUNCTION tunnel_api.detectability_shares(text, float8, float8) IS
'Shares of a survey''s inspected lining between two chainages (m) on which a leak of demand_area (m²) and demand_drop (dB) is found with at least 90 % probability (met_share), with less (not_met_share), or on which this is unknown. One row for each demand with which stage detect ran; none without detection';


-- Stretches are those of 10 m and more where most of the lining does not meet the demand; at most three are named.
CREATE OR REPLACE FUNCTION tunnel_internal.detectability_statement(survey_id int, stretch_from float8, stretch_to float8)
RETURNS text
LANGUAGE sql STABLE STRICT PARALLEL SAFE
SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
    WITH slice AS (
        SELECT d.demand_area, d.demand_drop, min(d.chainage_from) AS low, max(d.chainage_to) AS high
        FROM tunnel.detectability d
        WHERE d.survey_id = $1 AND d.chainage_from < $3 AND d.chainage_to > $2
        GROUP BY d.demand_area, d.demand_drop, floor(((d.chainage_from + d.chainage_to) / 20))
        HAVING sum(d.lining_area) FILTER (WHERE d.probability < 0.9) > 0.5 * sum(d.lining_area)
    ), part AS (
        SELECT s.*, count(*) FILTER (WHERE s.low > s.before) OVER (
            PARTITION BY s.demand_area, s.demand_drop ORDER BY s.low) AS part
        FROM (SELECT s.*, lag(s.high) OVER (PARTITION BY s.demand_area, s.demand_drop ORDER BY s.low) + 1 AS before
              FROM slice s) s
    ), stretch AS (
        SELECT p.demand_area, p.demand_drop, greatest(min(p.low), $2) AS low, least(max(p.high), $3) AS high,
            row_number() OVER (PARTITION BY p.demand_area, p.demand_drop ORDER BY min(p.low)) AS n
        FROM part p
        GROUP BY p.demand_area, p.demand_drop, p.part
    ), named AS (
        SELECT t.demand_area, t.demand_drop,
            string_agg(format('%s–%s', f.label, l.label), ', ' ORDER BY t.n) FILTER (WHERE t.n <= 3)
                || CASE WHEN max(t.n) > 3 THEN format(' and %s more', max(t.n) - 3) ELSE '' END AS places
        FROM tunnel.survey s
        CROSS JOIN stretch t
        CROSS JOIN LATERAL (SELECT regexp_replace(q.label, '\.\d+$', '') AS label
                            FROM tunnel_api.stationing(s.tunnel_id, round(t.low)) q) f
        CROSS JOIN LATERAL (SELECT regexp_replace(q.label, '\.\d+$', '') AS label
                            FROM tunnel_api.stationing(s.tunnel_id, round(t.high)) q) l
        WHERE s.id = $1
        GROUP BY t.demand_area, t.demand_drop
    )
    SELECT string_agg(
        CASE WHEN h.not_met_share < 0.05
             THEN format('it is unknown on %s %% of the inspected lining whether leaks of %s m² and %s dB would be found',
                         round((100 * h.unknown_share)::numeric), h.demand_area, h.demand_drop)
             ELSE format('leaks of %s m² and %s dB would be found with less than 90 %% probability on %s %% of the inspected lining',
                         h.demand_area, h.demand_drop, round((100 * h.not_met_share)::numeric))
                  || coalesce(' (' || n.places || ')', '')
                  || CASE WHEN h.unknown_share >= 0.05
                          THEN format(', and on %s %% it is unknown', round((100 * h.unknown_share)::numeric)) ELSE '' END
        END, '; ' ORDER BY h.demand_area, h.demand_drop)
    FROM tunnel_internal.detectability_shares($1, $2, $3) h
    LEFT JOIN named n ON n.demand_area = h.demand_area AND n.demand_drop = h.demand_drop
    WHERE h.not_met_share >= 0.05 OR h.unknown_share >= 0.05
$$;
COMMENT ON FUNCTION tunnel_internal.detectability_statement(int, float8, float8) IS
'Shares of detectability_shares in words, for a stretch of a survey (m) where the demand is not met, or this is unknown, on 5 % of the inspected lining or more; else NULL';
