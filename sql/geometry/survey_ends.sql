-- Ends of a survey: its first and last point, within its segments. Segments end at vertices, up to one spacing beyond the
-- points; lining out there does not count as missing. Files state their range along the given axis, where segment n extends
-- from n to n + 1 times the spacing; the fraction is applied to the measured axis. A kilometre without segments, in a survey
-- that has some, extends as far as its points along the given axis: it was scanned, and must appear where results are
-- missing.
CREATE OR REPLACE VIEW tunnel_internal.km_ends AS
SELECT k.survey_id::bigint * 1000000 + 500000 + k.km AS id, k.survey_id, k.km, k.chainage_from, k.chainage_to
  FROM (
    SELECT g.survey_id, g.km,
           min(g.chainage_from + (g.chainage_to - g.chainage_from) * greatest(0, f.first - g.n)) AS chainage_from,
           max(g.chainage_to - (g.chainage_to - g.chainage_from) * greatest(0, g.n + 1 - f.last)) AS chainage_to
      FROM (SELECT s.id AS survey_id, coalesce(min(q.chainage_from) / t.spacing, '-Infinity') AS first,
                   coalesce(max(q.chainage_to) / t.spacing, 'Infinity') AS last
              FROM tunnel.survey s
              JOIN tunnel.tunnel t ON t.id = s.tunnel_id
              LEFT JOIN tunnel.scan_file q ON q.survey_id = s.id
             GROUP BY s.id, t.spacing) f
      JOIN tunnel.segment g ON g.survey_id = f.survey_id AND g.n < f.last AND g.n + 1 > f.first
     GROUP BY g.survey_id, g.km
     UNION ALL
    SELECT q.survey_id, i.km, min(greatest(q.chainage_from, i.km * 1000)), max(least(q.chainage_to, (i.km + 1) * 1000))
      FROM tunnel.scan_file q
     CROSS JOIN LATERAL generate_series(floor(q.chainage_from / 1000)::integer, ceil(q.chainage_to / 1000)::integer - 1) AS i (km)
     WHERE EXISTS (SELECT FROM tunnel.segment g WHERE g.survey_id = q.survey_id)
       AND NOT EXISTS (SELECT FROM tunnel.segment g WHERE g.survey_id = q.survey_id AND g.km = i.km)
     GROUP BY q.survey_id, i.km) k;
COMMENT ON VIEW tunnel_internal.km_ends IS
    'Beginning and end of each kilometre of a survey: of the scanned part of its segments; of its points if it has no segments';


CREATE OR REPLACE FUNCTION tunnel_api.survey_ends(survey_id int, OUT chainage_from float8, OUT chainage_to float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT
COST 5000  -- once a survey, not once a kilometre
SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$ SELECT min(k.chainage_from), max(k.chainage_to) FROM tunnel_internal.km_ends k WHERE k.survey_id = $1 $$;
COMMENT ON FUNCTION tunnel_api.survey_ends(int) IS
'Smallest and greatest chainage (m) that a survey scanned: its first and last point, within its segments. NULL before it has segments';
