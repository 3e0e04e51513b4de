-- Change between two surveys of a tunnel: of the lining, by section and region, and of leaks; series over several surveys.
-- Needs stationing (geometry/stationing.sql), survey_id and stage_state (stages/status.sql).

CREATE OR REPLACE VIEW tunnel_api.change_section AS
SELECT c.id, c.survey_id, s.name AS survey, c.old_survey_id, o.name AS old_survey, c.km, c.chainage_from, c.chainage_to,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, (c.chainage_from + c.chainage_to) / 2) l) AS label,
       c.seen_old, c.seen_new, c.seen_both, c.seen_old - c.seen_both AS unseen,
       c.shift, c.shift_right, c.shift_right_se, c.shift_up, c.shift_up_se,
       c.shift_along, c.shift_along_se, c.roll, c.roll_se, c.yaw, c.yaw_se, c.pitch, c.pitch_se,
       c.change_rms, c.change_least, c.change_greatest, c.lod, c.cell, c.arc_from, c.change
  FROM tunnel.change_section c
  JOIN tunnel.survey s ON s.id = c.survey_id
  JOIN tunnel.survey o ON o.id = c.old_survey_id;
COMMENT ON VIEW tunnel_api.change_section IS
    'Rigid motion of lining sections between two surveys, and the change that remains, written by tunneldb compare. Only control points can separate registration error from movement';
COMMENT ON COLUMN tunnel_api.change_section.label IS 'Station of its middle, as 12+345.678';
COMMENT ON COLUMN tunnel_api.change_section.old_survey IS 'Name of the survey that it is compared with';
COMMENT ON COLUMN tunnel_api.change_section.unseen IS
    'Lining that the older survey inspected and the newer one did not, m²; its change is unknown';

CREATE OR REPLACE VIEW tunnel_api.change_region AS
SELECT c.id, c.survey_id, s.name AS survey, c.old_survey_id, o.name AS old_survey, c.km, c.chainage_from, c.chainage_to,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, (c.chainage_from + c.chainage_to) / 2) l) AS label,
       c.arc_from, c.arc_to, c.clock, c.area, c.change_mean, c.lod, c.change_extreme,
       c.unrolled::public.geometry(Polygon, 0) AS unrolled, c.map::public.geometry AS map, c.surface::public.geometry AS surface
  FROM tunnel.change_region c
  JOIN tunnel.survey s ON s.id = c.survey_id
  JOIN tunnel.survey o ON o.id = c.old_survey_id;
COMMENT ON VIEW tunnel_api.change_region IS
    'Areas of lining that changed significantly between two surveys, after removal of the rigid motion of the section, with three geometries; written by tunneldb compare';

CREATE OR REPLACE VIEW tunnel_api.leak_change AS
SELECT c.id, c.survey_id, s.name AS survey, c.old_survey_id, o.name AS old_survey, c.km, c.state, c.chainage_from, c.chainage_to,
       (SELECT l.label FROM tunnel_api.stationing(s.tunnel_id, (c.chainage_from + c.chainage_to) / 2) l) AS label,
       c.clock, c.area_old, c.area_old_se, c.area_new, c.area_new_se, c.area_new - c.area_old AS area_change,
       sqrt(c.area_old_se ^ 2 + c.area_new_se ^ 2) AS area_change_se, c.seen_old, c.seen_new, c.old_kinds, c.new_kinds,
       c.old_ids, c.new_ids,
       c.unrolled::public.geometry(MultiPolygon, 0) AS unrolled, c.map::public.geometry AS map, c.surface::public.geometry AS surface
  FROM tunnel.leak_change c
  JOIN tunnel.survey s ON s.id = c.survey_id
  JOIN tunnel.survey o ON o.id = c.old_survey_id;
COMMENT ON VIEW tunnel_api.leak_change IS
    'Change of leaks between two surveys, written by tunneldb compare: state, area before and after, three geometries. What one survey did not inspect is unseen, never new or dry';
COMMENT ON COLUMN tunnel_api.leak_change.area_change IS 'Wet area of the newer survey minus that of the older one, m²';
COMMENT ON COLUMN tunnel_api.leak_change.area_change_se IS 'Standard error of area_change from resolution and threshold, m²';

DO $$
DECLARE
    base text;
    bare record;
BEGIN
    FOREACH base IN ARRAY ARRAY['change_region', 'leak_change'] LOOP
        FOR bare IN
            SELECT a.attname AS name, t.text FROM (VALUES
                ('label', 'Station of its middle, as 12+345.678'),
                ('old_survey', 'Name of the survey that it is compared with'),
                ('unrolled', 'In the unrolled plane (chainage, arc) of the older survey, SRID 0'),
                ('map', 'On the map strip beside the axis, tunnel''s SRID'),
                ('surface', 'On the lining in space, tunnel''s SRID')) AS t (name, text)
              JOIN pg_attribute a ON a.attname = t.name AND a.attrelid = format('tunnel_api.%I', base)::regclass
        LOOP
            EXECUTE format('COMMENT ON COLUMN tunnel_api.%I.%I IS %L', base, bare.name, bare.text);
        END LOOP;
    END LOOP;
END
$$;

CALL tunnel_internal.make_geometry_views(
    'change_region', 'change_region', 'Lining that changed significantly,',
    plane_text => 'in the unrolled plane (chainage, arc) of the older survey, SRID 0');
CALL tunnel_internal.make_geometry_views(
    'leak_change', 'leak_change', 'Change of leaks,',
    plane_text => 'in the unrolled plane (chainage, arc) of the older survey, SRID 0');

CREATE OR REPLACE FUNCTION tunnel_internal.leaks_checksum(survey_id int, chainage_from float8, chainage_to float8) RETURNS text
LANGUAGE sql STABLE PARALLEL SAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT md5(string_agg(concat_ws(' ', a.id, coalesce(a.kind_override, a.kind), a.wet, a.area, a.chainage_from, a.chainage_to), ';' ORDER BY a.id))
      FROM tunnel.finding a
     WHERE a.survey_id = $1 AND a.chainage_to > $2 AND a.chainage_from < $3 AND a.detected AND a.review <> 'rejected'
       AND NOT a.superseded AND (a.wet OR a.kind IN ('leak', 'joint', 'dark')) AND tunnel_internal.in_order($2, $3)
$$;
COMMENT ON FUNCTION tunnel_internal.leaks_checksum(int, float8, float8) IS
    'Checksum of the counted leaks, joints and dark areas between two chainages (m); changes with each review, drawing or detection. NULL if there are none';

CREATE OR REPLACE FUNCTION tunnel_internal.compare_inputs(survey_id int, km int, subject text) RETURNS jsonb
LANGUAGE sql STABLE PARALLEL SAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT jsonb_build_object(
               'detect_old', tunnel_internal.last_run($3::int, 'detect', $2),
               'detect_new', tunnel_internal.last_run($1, 'detect', $2),
               'leaks_old', tunnel_internal.leaks_checksum($3::int, $2 * 1000 - 100, ($2 + 1) * 1000 + 100),
               'leaks_new', tunnel_internal.leaks_checksum($1, $2 * 1000 - 100, ($2 + 1) * 1000 + 100))
$$;
COMMENT ON FUNCTION tunnel_internal.compare_inputs(int, int, text) IS
    'Inputs of the comparison of a kilometre with an older survey: runs of stage detect and checksums of the leaks of both';

CREATE OR REPLACE FUNCTION tunnel_internal.compare_places(survey_id int, of_subject text DEFAULT NULL)
RETURNS TABLE (km int, subject text, present boolean, reason text)
LANGUAGE sql STABLE CALLED ON NULL INPUT PARALLEL RESTRICTED SECURITY DEFINER ROWS 50
SET search_path = pg_catalog, pg_temp SET jit = off AS $$
    WITH pair AS MATERIALIZED (
        SELECT o.id
          FROM (SELECT DISTINCT r.subject FROM tunnel_internal.last_runs($1, 'compare') r WHERE $2 IS NULL
                 UNION ALL SELECT $2 WHERE $2 IS NOT NULL) p
          JOIN tunnel.survey o ON o.id = p.subject::int
    ), seen AS (
        SELECT p.id, n.km
          FROM pair p
         CROSS JOIN LATERAL tunnel_internal.image_kilometres($1, 'offset') n (km)
          JOIN LATERAL tunnel_internal.image_kilometres(p.id, 'offset') o (km) ON o.km = n.km
    )
    SELECT k.km, k.id::text, true, NULL::text FROM seen k
     UNION ALL  -- what was made of it is still there
    SELECT DISTINCT c.km, c.old_survey_id::text, false, 'one of the surveys has nothing there any more'
      FROM pair p
      JOIN tunnel.change_section c ON c.survey_id = $1 AND c.old_survey_id = p.id
     WHERE NOT EXISTS (SELECT FROM seen k WHERE k.id = p.id AND k.km = c.km)
$$;
COMMENT ON FUNCTION tunnel_internal.compare_places(int, text) IS
    'Kilometres that a survey and an older one both inspected or that were compared: for all older surveys, or for a given one';

CREATE OR REPLACE FUNCTION tunnel_api.change_stretches(old_survey text, new_survey text, step float8 DEFAULT 100)
RETURNS TABLE (chainage_from float8, chainage_to float8, label text, compared float8, unseen float8, changed float8,
               inwards float8, outwards float8, regions bigint, shift float8, wet_old float8, wet_new float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT ROWS 250 SECURITY DEFINER SET search_path = pg_catalog, pg_temp SET jit = off AS $$
    WITH pair AS MATERIALIZED (
        SELECT n.id AS new, o.id AS old, n.tunnel_id
          FROM tunnel.survey n, tunnel.survey o
         WHERE n.id = tunnel_api.survey_id($2) AND o.id = tunnel_api.survey_id($1) AND $3 > 0
    ), section AS (  -- a section counts where its middle lies
        SELECT floor((c.chainage_from + c.chainage_to) / 2 / $3) AS k, sum(c.seen_both) AS compared,
               sum(c.seen_old - c.seen_both) AS unseen, max(c.shift) AS shift
          FROM pair p JOIN tunnel.change_section c ON c.survey_id = p.new AND c.old_survey_id = p.old
         GROUP BY 1
    ), region AS (
        SELECT floor((c.chainage_from + c.chainage_to) / 2 / $3) AS k, count(*) AS regions, sum(c.area) AS changed,
               sum(c.area) FILTER (WHERE c.change_mean > 0) AS inwards, sum(c.area) FILTER (WHERE c.change_mean < 0) AS outwards
          FROM pair p JOIN tunnel.change_region c ON c.survey_id = p.new AND c.old_survey_id = p.old
         GROUP BY 1
    ), leak AS (
        SELECT floor((c.chainage_from + c.chainage_to) / 2 / $3) AS k, sum(c.area_old) AS wet_old, sum(c.area_new) AS wet_new
          FROM pair p JOIN tunnel.leak_change c ON c.survey_id = p.new AND c.old_survey_id = p.old
         GROUP BY 1
    )
    SELECT s.k * $3, (s.k + 1) * $3, tunnel_api.station_label(p.tunnel_id, s.k * $3), s.compared, s.unseen,
           coalesce(r.changed, 0), coalesce(r.inwards, 0), coalesce(r.outwards, 0), coalesce(r.regions, 0), s.shift,
           coalesce(l.wet_old, 0), coalesce(l.wet_new, 0)
      FROM pair p CROSS JOIN section s LEFT JOIN region r ON r.k = s.k LEFT JOIN leak l ON l.k = s.k
     ORDER BY s.k
$$;
COMMENT ON FUNCTION tunnel_api.change_stretches(text, text, float8) IS
'Change between two surveys in stretches of step metres: lining compared, and lining that only the older survey inspected (unseen), m²; area and number of significant changes, inwards and outwards; largest rigid shift of a section (m); wet area of each survey (m²). unseen is included in no other column';

CREATE OR REPLACE FUNCTION tunnel_api.change_at(old_survey text, chainage float8, arc float8)
RETURNS TABLE (survey text, date date, change float8, lod float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT ROWS 10 SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT s.name, s.date, nullif(c.change[floor(($3 - c.arc_from) / c.cell)::int + 1], 'NaN')::float8, c.lod
      FROM tunnel.change_section c
      JOIN tunnel.survey s ON s.id = c.survey_id
     WHERE c.old_survey_id = tunnel_api.survey_id($1) AND c.chainage_from <= $2 AND c.chainage_to > $2
     ORDER BY s.date, s.name
$$;
COMMENT ON FUNCTION tunnel_api.change_at(text, float8, float8) IS
'Change of the lining at a place (chainage and arc of the older survey, m) in each survey that was compared with it, by date: mean over the length of the section, m, positive inwards, without rigid motion; NULL if not inspected. lod: level of detection of a single cell, m';

-- Nodes of a section lie at each whole degree from -180 to 180. The arcs of a clock position are interpolated once for each
-- section, not for each place.
CREATE OR REPLACE FUNCTION tunnel_internal.convergence_at(old_id int, survey_ids int[], places float8[], clock_from float8, clock_to float8)
RETURNS TABLE (n int, survey_id int, convergence float8)
LANGUAGE plpgsql STABLE PARALLEL SAFE STRICT ROWS 100 SECURITY DEFINER SET search_path = pg_catalog, pg_temp SET jit = off AS $$
#variable_conflict use_column
DECLARE
    old_key constant int := old_id;
    wanted constant float8[] := places;
    lowest constant float8 := (SELECT min(p) - 10 FROM unnest(places) p);
    highest constant float8 := (SELECT max(p) + 10 FROM unnest(places) p);
    -- degrees from the crown, -180 to 180
    degrees constant float8[] := (
        SELECT array_agg(d.degree - 360 * floor(d.degree / 360) - 180 ORDER BY d.n)
          FROM (VALUES (1, clock_from * 30 + 180), (2, clock_to * 30 + 180)) AS d (n, degree));
    nodes constant int[] := ARRAY[floor(degrees[1]) + 181, floor(degrees[2]) + 181];
BEGIN
    RETURN QUERY
    WITH curve AS MATERIALIZED (  -- [:] takes the arcs out of their storage once
        SELECT c.chainage, c.arc[:] AS arc FROM tunnel.section c
         WHERE c.survey_id = old_key AND c.chainage >= lowest AND c.chainage <= highest
    ), known AS MATERIALIZED (
        SELECT array_agg(c.chainage ORDER BY c.chainage) AS chainage,
               array_agg(c.arc[nodes[1]] + (degrees[1] - floor(degrees[1])) * (c.arc[least(nodes[1] + 1, 361)] - c.arc[nodes[1]])
                         ORDER BY c.chainage) AS first,
               array_agg(c.arc[nodes[2]] + (degrees[2] - floor(degrees[2])) * (c.arc[least(nodes[2] + 1, 361)] - c.arc[nodes[2]])
                         ORDER BY c.chainage) AS second
          FROM curve c
    ), chord AS MATERIALIZED (  -- of the section nearest to each place, if it lies within 10 m
        SELECT q.n, q.chainage, q.first, q.second
          FROM (SELECT p.n, p.chainage, k.first[i.k] AS first, k.second[i.k] AS second, abs(k.chainage[i.k] - p.chainage) AS away
                  FROM known k CROSS JOIN unnest(wanted) WITH ORDINALITY AS p (chainage, n)
                 CROSS JOIN LATERAL (SELECT width_bucket(p.chainage, k.chainage) AS below) w
                 CROSS JOIN LATERAL (
                       SELECT CASE WHEN w.below = 0
                                     OR k.chainage[w.below + 1] - p.chainage < p.chainage - k.chainage[w.below]
                                   THEN w.below + 1 ELSE w.below END AS k) i) q
         WHERE q.away <= 10
    )
    SELECT c.n::int, s.id,
           -(nullif(x.change[floor((c.first - x.arc_from) / x.cell)::int + 1], 'NaN')::float8
             + nullif(x.change[floor((c.second - x.arc_from) / x.cell)::int + 1], 'NaN')::float8)
      FROM chord c CROSS JOIN unnest(survey_ids) AS s (id)
     CROSS JOIN LATERAL (SELECT o.* FROM tunnel.change_section o
                          WHERE o.survey_id = s.id AND o.old_survey_id = old_key AND o.chainage_from <= c.chainage
                          ORDER BY o.chainage_from DESC LIMIT 1) x
     WHERE x.chainage_to > c.chainage;
END
$$;
COMMENT ON FUNCTION tunnel_internal.convergence_at(int, int[], float8[], float8, float8) IS
'Change of the length of the chord between two opposite clock positions (hours) since an older survey, m, at places (chainages, m) in later surveys; negative if the walls approach each other, NULL if an end is not inspected. No row where a survey was not compared';

CREATE OR REPLACE FUNCTION tunnel_api.convergence(old_survey text, chainage float8, clock_from float8 DEFAULT 9, clock_to float8 DEFAULT 3)
RETURNS TABLE (survey text, date date, convergence float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT ROWS 10 SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT s.name, s.date, c.convergence
      FROM tunnel.survey o
     CROSS JOIN LATERAL tunnel_internal.convergence_at(
           o.id, (SELECT array_agg(n.id) FROM tunnel.survey n WHERE n.tunnel_id = o.tunnel_id), ARRAY[$2], $3, $4) c
      JOIN tunnel.survey s ON s.id = c.survey_id
     WHERE o.id = tunnel_api.survey_id($1)
     ORDER BY s.date, s.name
$$;

COMMENT ON FUNCTION tunnel_api.convergence(text, float8, float8, float8) IS
'Change of the length of the chord between two clock positions (default 9 and 3) since the older survey, m, in each survey that was compared with it, by date; negative if the walls approach each other. The clock positions must be opposite each other';

CREATE OR REPLACE FUNCTION tunnel_api.ring_series(tunnel text, chainage float8)
RETURNS TABLE (survey text, date date, number int, label text, seen_share float8, radius float8, radius_se float8, ovality float8,
               ovality_se float8, largest_clock float8, largest_clock_se float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT ROWS 10 SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT s.name, s.date, r.number, tunnel_api.station_label(s.tunnel_id, (r.chainage_from + r.chainage_to) / 2), r.seen_share,
           r.radius, r.radius_se, r.ovality, r.ovality_se, r.largest_clock, r.largest_clock_se
      FROM tunnel.tunnel t
      JOIN tunnel.survey s ON s.tunnel_id = t.id
     CROSS JOIN LATERAL (SELECT q.* FROM tunnel.ring q WHERE q.survey_id = s.id AND q.chainage_from <= $2
                          ORDER BY q.chainage_from DESC LIMIT 1) r
     WHERE t.id = tunnel_api.tunnel_id($1) AND r.chainage_to > $2
       AND s.id NOT IN (SELECT c.survey_id FROM tunnel_internal.survey_copy c)
     ORDER BY s.date, s.name
$$;
COMMENT ON FUNCTION tunnel_api.ring_series(text, float8) IS
'Shape of the ring at a chainage (m) in each survey of a tunnel with rings, without copies from archives, by date: inspected share, mean radius (m), ovality as a share of the design diameter, clock position of the largest diameter (degrees), with standard errors; NULL if not measured. Ring numbers can differ between surveys';

CREATE OR REPLACE FUNCTION tunnel_api.leak_area_series(tunnel text, step float8 DEFAULT 100)
RETURNS TABLE (chainage_from float8, chainage_to float8, label text, survey text, date date, leaks bigint, area float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT ROWS 1000 SECURITY DEFINER SET search_path = pg_catalog, pg_temp SET jit = off AS $$
    SELECT q.k * $2, (q.k + 1) * $2, tunnel_api.station_label(q.tunnel_id, q.k * $2), q.name, q.date, q.leaks, q.area
      FROM (SELECT s.tunnel_id, s.name, s.date, floor((a.chainage_from + a.chainage_to) / 2 / $2) AS k, count(*) AS leaks,
                   sum(a.area) AS area
              FROM tunnel.tunnel t
              JOIN tunnel.survey s ON s.tunnel_id = t.id
              JOIN tunnel.finding a ON a.survey_id = s.id AND a.detected AND a.review <> 'rejected' AND a.wet AND NOT a.superseded
             WHERE t.id = tunnel_api.tunnel_id($1) AND $2 > 0
               AND s.id NOT IN (SELECT c.survey_id FROM tunnel_internal.survey_copy c)
             GROUP BY s.tunnel_id, s.id, s.name, s.date, 4) q
     ORDER BY q.k, q.date, q.name
$$;
COMMENT ON FUNCTION tunnel_api.leak_area_series(text, float8) IS
'Wet area (m²) of each survey of a tunnel, without copies from archives, in stretches of step metres, by date: counted leaks, each with its whole area in the stretch of its middle (wet_area divides a leak between stretches). A stretch without a row has no leak or was not inspected (tunnel_api.coverage_gaps)';
