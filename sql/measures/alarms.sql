-- Limits of series of tunnels, and where the latest survey reaches them. Needs survey_copy (views/survey.sql), survey_ends
-- (geometry/survey_ends.sql), stretch_leaks and stretch_bands (leaks/stretch_leaks.sql), convergence_at (measures/change.sql) and
-- earlier_inspection (measures/rating.sql).

CREATE OR REPLACE VIEW tunnel_api.alarm_limit AS
SELECT l.id, l.tunnel_id, t.name AS tunnel, l.name, l.quantity, u.unit, l.warning, l.alarm, l.chainage_from, l.chainage_to,
       tunnel_api.station_label(t.id, l.chainage_from) AS label_from, tunnel_api.station_label(t.id, l.chainage_to) AS label_to,
       l.step, l.clock_from, l.clock_to, l.reference, l.min_inspected, l.added_at
  FROM tunnel.alarm_limit l
  JOIN tunnel.tunnel t ON t.id = l.tunnel_id
  JOIN (VALUES ('ovality', ''), ('convergence', 'm'), ('wet_area', 'm²'), ('growth', 'm²/year')) AS u (quantity, unit)
       ON u.quantity = l.quantity;
COMMENT ON VIEW tunnel_api.alarm_limit IS
    'Limits of series of tunnels, written by tunneldb alarms add; alarms(tunnel) compares the latest survey with them';
COMMENT ON COLUMN tunnel_api.alarm_limit.name IS 'Name of the limit';
COMMENT ON COLUMN tunnel_api.alarm_limit.quantity IS
    'ovality (of each ring, share of the design diameter), convergence (change of a chord since the reference survey, m, either sign), wet_area (of each stretch, m²) or growth (of the wet area of each stretch since the earlier inspection, m² per year)';
COMMENT ON COLUMN tunnel_api.alarm_limit.unit IS 'Unit of warning and alarm; empty for a share';
COMMENT ON COLUMN tunnel_api.alarm_limit.warning IS 'Value from which it is a warning';
COMMENT ON COLUMN tunnel_api.alarm_limit.alarm IS 'Value from which it is an alarm';
COMMENT ON COLUMN tunnel_api.alarm_limit.chainage_from IS 'Chainage from which it applies, m; NULL: beginning of the tunnel';
COMMENT ON COLUMN tunnel_api.alarm_limit.chainage_to IS 'Chainage up to which it applies, m; NULL: end of the tunnel';
COMMENT ON COLUMN tunnel_api.alarm_limit.step IS 'Length of the stretches of wet_area and growth, from multiples of it, m';
COMMENT ON COLUMN tunnel_api.alarm_limit.clock_from IS 'Clock position of one end of the chord of convergence, hours';
COMMENT ON COLUMN tunnel_api.alarm_limit.clock_to IS 'Clock position of the other end, opposite, hours';
COMMENT ON COLUMN tunnel_api.alarm_limit.reference IS
    'Name of the survey since which convergence counts; NULL: the earliest that another one was compared with';
COMMENT ON COLUMN tunnel_api.alarm_limit.min_inspected IS
    'Inspected share below which a value below the limits is unknown, 0 to 1';

CREATE OR REPLACE FUNCTION tunnel_internal.latest_survey(tunnel_id int) RETURNS int
LANGUAGE sql STABLE STRICT PARALLEL SAFE SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
    SELECT s.id FROM tunnel.survey s
     WHERE s.tunnel_id = $1 AND s.id NOT IN (SELECT c.survey_id FROM tunnel_internal.survey_copy c)
     ORDER BY s.date DESC, s.id DESC LIMIT 1
$$;
COMMENT ON FUNCTION tunnel_internal.latest_survey(int) IS
'Key of the latest survey of a tunnel by date, without copies from archives; NULL if there is none';

CREATE OR REPLACE FUNCTION tunnel_internal.alarm_extent(
    survey_id int, chainage_from float8, chainage_to float8, OUT low float8, OUT high float8)
LANGUAGE sql STABLE CALLED ON NULL INPUT PARALLEL SAFE SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
    SELECT greatest($2, least(t.start_chainage, e.chainage_from)),
           least($3, greatest(t.start_chainage + public.ST_Length(t.alignment), e.chainage_to))
      FROM tunnel.survey s
      JOIN tunnel.tunnel t ON t.id = s.tunnel_id
     CROSS JOIN LATERAL tunnel_api.survey_ends(s.id) e
     WHERE s.id = $1 AND t.alignment IS NOT NULL AND coalesce(tunnel_internal.in_order($2, $3), true)
$$;
COMMENT ON FUNCTION tunnel_internal.alarm_extent(int, float8, float8) IS
'Part of a tunnel to which a limit with these chainages (m) applies: NULL for an end of the tunnel, or of the survey if that reaches farther';

-- Wet areas and shares are those of leak_statistics. The part of a stretch beyond the survey was not inspected.
CREATE OR REPLACE FUNCTION tunnel_internal.wet_stretches(survey_id int, starts float8[], ends float8[])
RETURNS TABLE (n int, wet_area float8, undecided_area float8, inspected_share float8)
LANGUAGE plpgsql STABLE STRICT PARALLEL SAFE SECURITY DEFINER ROWS 1000 SET search_path = pg_catalog, pg_temp
SET jit = off
SET enable_nestloop = off  -- the number of rows is unknown at planning
SET enable_mergejoin = off
AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := survey_id;
    given_starts constant float8[] := starts;
    given_ends constant float8[] := ends;
    extent record;
    numbers int[];
    lows float8[];
    highs float8[];
BEGIN
    SELECT e.* INTO extent FROM tunnel_api.survey_ends(survey_key) e;
    SELECT array_agg(p.n ORDER BY p.n), array_agg(greatest(p.low, extent.chainage_from) ORDER BY p.n),
           array_agg(least(p.high, extent.chainage_to) ORDER BY p.n)
      INTO numbers, lows, highs
      FROM unnest(given_starts, given_ends) WITH ORDINALITY AS p (low, high, n)
     WHERE p.low < extent.chainage_to AND p.high > extent.chainage_from;
    IF numbers IS NULL THEN
        RETURN;
    END IF;
    RETURN QUERY
    WITH leak AS (
        SELECT l.n, sum(l.area) AS area FROM tunnel_internal.stretch_leaks(survey_key, lows, highs) l GROUP BY l.n
    ), first AS (
        SELECT c.* FROM tunnel_internal.coverage_at(survey_key, lows) c
    ), last AS (
        SELECT c.* FROM tunnel_internal.coverage_at(survey_key, highs) c
    )
    SELECT numbers[f.n], CASE WHEN t.length > f.length THEN coalesce(l.area, 0) ELSE l.area END, b.area,
           CASE WHEN t.length > f.length
                THEN (t.seen - f.seen) / nullif(t.lining - f.lining, 0)
                     * least((t.length - f.length) / (given_ends[numbers[f.n]] - given_starts[numbers[f.n]]), 1)
                ELSE 0 END
      FROM first f
      JOIN last t ON t.n = f.n
      LEFT JOIN leak l ON l.n = f.n
      LEFT JOIN tunnel_internal.stretch_bands(survey_key, lows, highs) b ON b.n = f.n;
END
$$;
COMMENT ON FUNCTION tunnel_internal.wet_stretches(int, float8[], float8[]) IS
'Wet area of stretches of a tunnel in a survey as in leak_statistics, and dark bands that may be wet (m²); NULL where leaks were not searched for. inspected_share: share of the lining of the whole stretch. No row for a stretch outside the survey';

CREATE OR REPLACE FUNCTION tunnel_internal.wet_values(survey_id int, stretch_from float8, stretch_to float8, step float8)
RETURNS TABLE (chainage_from float8, chainage_to float8, wet_area float8, highest float8, inspected_share float8, earlier_id int,
    earlier_area float8, earlier_share float8)
LANGUAGE plpgsql STABLE CALLED ON NULL INPUT PARALLEL SAFE SECURITY DEFINER ROWS 1000 SET search_path = pg_catalog, pg_temp
SET jit = off
SET enable_nestloop = off  -- the number of rows is unknown at planning
SET enable_mergejoin = off
AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := survey_id;
    earlier_key constant int := tunnel_internal.earlier_inspection(survey_id);
    length constant float8 := step;
    extent record;
    starts float8[];
    ends float8[];
BEGIN
    SELECT e.* INTO extent FROM tunnel_internal.alarm_extent(survey_id, stretch_from, stretch_to) e;
    SELECT array_agg(greatest(k * length, extent.low) ORDER BY k), array_agg(least((k + 1) * length, extent.high) ORDER BY k)
      INTO starts, ends
      FROM generate_series(floor(extent.low / length + 1e-9)::int, ceil(extent.high / length - 1e-9)::int - 1) k;
    RETURN QUERY
    SELECT p.low, p.high, n.wet_area, n.wet_area + coalesce(n.undecided_area, 0), coalesce(n.inspected_share, 0), earlier_key,
           b.wet_area, coalesce(b.inspected_share, 0)
      FROM unnest(starts, ends) WITH ORDINALITY AS p (low, high, n)
      LEFT JOIN tunnel_internal.wet_stretches(survey_key, starts, ends) n ON n.n = p.n
      LEFT JOIN tunnel_internal.wet_stretches(earlier_key, starts, ends) b ON b.n = p.n;
END
$$;
COMMENT ON FUNCTION tunnel_internal.wet_values(int, float8, float8, float8) IS
'Wet area (m²) and inspected share of stretches between multiples of step (m) in a survey and in the earlier inspection. highest: wet area if undecided dark bands are wet. No row if there is no such part of the tunnel';

CREATE OR REPLACE FUNCTION tunnel_internal.gaps_between(low float8, high float8, starts float8[], ends float8[])
RETURNS TABLE (chainage_from float8, chainage_to float8)
LANGUAGE sql IMMUTABLE CALLED ON NULL INPUT PARALLEL SAFE ROWS 10 SET search_path = pg_catalog, pg_temp
AS $$
    WITH place AS (
        SELECT p.low, p.high FROM unnest($3, $4) AS p (low, high)
        UNION ALL
        SELECT $2, $2
    ), gap AS (
        SELECT coalesce(max(p.high) OVER before, $1) AS low, p.low AS high
          FROM place p
        WINDOW before AS (ORDER BY p.low, p.high ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING)
    )
    SELECT g.low, g.high FROM gap g
     WHERE g.low < g.high AND g.high - g.low >= (
           SELECT coalesce(percentile_cont(0.5) WITHIN GROUP (ORDER BY p.high - p.low), 0) - 1e-6
             FROM unnest($3, $4) AS p (low, high))
     ORDER BY g.low
$$;
COMMENT ON FUNCTION tunnel_internal.gaps_between(float8, float8, float8[], float8[]) IS
'Stretches between two chainages (m) without a place, where one of median length has room';

CREATE OR REPLACE FUNCTION tunnel_internal.ovality_values(survey_id int, stretch_from float8, stretch_to float8)
RETURNS TABLE (chainage_from float8, chainage_to float8, value float8, inspected_share float8, previous_id int,
    previous_value float8, remark text)
LANGUAGE plpgsql STABLE CALLED ON NULL INPUT PARALLEL SAFE SECURITY DEFINER ROWS 1000 SET search_path = pg_catalog, pg_temp
SET jit = off
AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := survey_id;
    earlier_key int;
    extent record;
    starts float8[];
    ends float8[];
BEGIN
    SELECT e.* INTO extent FROM tunnel_internal.alarm_extent(survey_id, stretch_from, stretch_to) e;
    SELECT o.id INTO earlier_key
      FROM tunnel.survey s
      JOIN tunnel.survey o ON o.tunnel_id = s.tunnel_id AND o.date < s.date
     WHERE s.id = survey_key AND o.id NOT IN (SELECT c.survey_id FROM tunnel_internal.survey_copy c)
       AND EXISTS (SELECT FROM tunnel.ring r WHERE r.survey_id = o.id AND r.ovality IS NOT NULL)
     ORDER BY o.date DESC, o.id LIMIT 1;
    SELECT array_agg(r.chainage_from ORDER BY r.chainage_from), array_agg(r.chainage_to ORDER BY r.chainage_from)
      INTO starts, ends
      FROM tunnel.ring r
     WHERE r.survey_id = survey_key AND (r.chainage_from + r.chainage_to) / 2 >= extent.low
       AND (r.chainage_from + r.chainage_to) / 2 < extent.high;
    RETURN QUERY
    SELECT r.chainage_from, r.chainage_to, nullif(r.ovality, 'NaN'), coalesce(r.seen_share, 0), earlier_key,
           CASE WHEN o.chainage_to > m.chainage THEN nullif(o.ovality, 'NaN') END,
           CASE WHEN r.ovality IS NULL OR r.ovality = 'NaN' THEN 'ovality not measured' END
      FROM tunnel.ring r
     CROSS JOIN LATERAL (SELECT (r.chainage_from + r.chainage_to) / 2 AS chainage) m
      LEFT JOIN LATERAL (SELECT q.chainage_to, q.ovality FROM tunnel.ring q
                          WHERE q.survey_id = earlier_key AND q.chainage_from <= m.chainage
                          ORDER BY q.chainage_from DESC LIMIT 1) o ON true
     WHERE r.survey_id = survey_key AND m.chainage >= extent.low AND m.chainage < extent.high
    UNION ALL
    SELECT g.chainage_from, g.chainage_to, NULL, 0, earlier_key, NULL, 'no ring measured'
      FROM tunnel_internal.gaps_between(extent.low, extent.high, starts, ends) g;
END
$$;
COMMENT ON FUNCTION tunnel_internal.ovality_values(int, float8, float8) IS
'Ovality of the rings of a survey whose middle lies between two chainages (m), and of the ring there in the last earlier survey with rings; stretches without a ring have no value. remark: reason why the value is unknown';

CREATE OR REPLACE FUNCTION tunnel_internal.convergence_values(
    survey_id int, stretch_from float8, stretch_to float8, clock_from float8, clock_to float8, reference text)
RETURNS TABLE (chainage_from float8, chainage_to float8, value float8, inspected_share float8, previous_id int,
    previous_value float8, remark text)
LANGUAGE plpgsql STABLE CALLED ON NULL INPUT PARALLEL SAFE SECURITY DEFINER ROWS 1000 SET search_path = pg_catalog, pg_temp
SET jit = off
AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := survey_id;
    first_clock constant float8 := clock_from;
    second_clock constant float8 := clock_to;
    reference_name constant text := reference;
    since tunnel.survey;
    earlier_key int;
    extent record;
    starts float8[];
    ends float8[];
BEGIN
    SELECT e.* INTO extent FROM tunnel_internal.alarm_extent(survey_id, stretch_from, stretch_to) e;
    SELECT o.* INTO since
      FROM tunnel.survey s
      JOIN tunnel.survey o ON o.tunnel_id = s.tunnel_id
     WHERE s.id = survey_key AND (o.name = reference_name OR (
           reference_name IS NULL AND o.id NOT IN (SELECT c.survey_id FROM tunnel_internal.survey_copy c)
           AND EXISTS (SELECT FROM tunnel.survey n WHERE n.tunnel_id = o.tunnel_id AND n.date > o.date
                          AND EXISTS (SELECT FROM tunnel.change_section c WHERE c.old_survey_id = o.id AND c.survey_id = n.id))))
     ORDER BY o.date, o.id LIMIT 1;
    SELECT o.id INTO earlier_key
      FROM tunnel.survey s
      JOIN tunnel.survey o ON o.tunnel_id = s.tunnel_id AND o.date < s.date AND o.date > since.date
     WHERE s.id = survey_key AND o.id NOT IN (SELECT c.survey_id FROM tunnel_internal.survey_copy c)
       AND EXISTS (SELECT FROM tunnel.change_section c WHERE c.old_survey_id = since.id AND c.survey_id = o.id)
     ORDER BY o.date DESC, o.id LIMIT 1;
    SELECT array_agg(c.chainage_from ORDER BY c.chainage_from), array_agg(c.chainage_to ORDER BY c.chainage_from)
      INTO starts, ends
      FROM tunnel.change_section c
     WHERE c.survey_id = survey_key AND c.old_survey_id = since.id AND (c.chainage_from + c.chainage_to) / 2 >= extent.low
       AND (c.chainage_from + c.chainage_to) / 2 < extent.high;
    RETURN QUERY
    WITH place AS MATERIALIZED (
        SELECT p.low, p.high, p.n FROM unnest(starts, ends) WITH ORDINALITY AS p (low, high, n)
    ), chord AS MATERIALIZED (
        SELECT c.* FROM tunnel_internal.convergence_at(
            since.id, array_remove(ARRAY[survey_key, earlier_key], NULL),
            (SELECT array_agg((p.low + p.high) / 2 ORDER BY p.n) FROM place p), first_clock, second_clock) c
    ), pair AS (
        SELECT c.n, max(c.convergence) FILTER (WHERE c.survey_id = survey_key) AS now,
               max(c.convergence) FILTER (WHERE c.survey_id = earlier_key) AS before
          FROM chord c GROUP BY c.n
    )
    SELECT p.low, p.high, c.now, CASE WHEN c.now IS NULL THEN 0 ELSE 1 END::float8, coalesce(earlier_key, since.id),
           CASE WHEN earlier_key IS NULL THEN 0 ELSE c.before END,
           CASE WHEN c.now IS NULL THEN 'an end of the chord was not inspected' END
      FROM place p LEFT JOIN pair c ON c.n = p.n
    UNION ALL
    SELECT g.chainage_from, g.chainage_to, NULL, 0, coalesce(earlier_key, since.id), NULL,
           CASE WHEN since.id IS NOT NULL THEN format('not compared with %s', since.name)
                WHEN reference_name IS NOT NULL THEN format('the tunnel has no survey %s', reference_name)
                ELSE 'no survey was compared with an earlier one' END
      FROM tunnel_internal.gaps_between(extent.low, extent.high, starts, ends) g;
END
$$;
COMMENT ON FUNCTION tunnel_internal.convergence_values(int, float8, float8, float8, float8, text) IS
'Convergence (m) between two clock positions in the sections of a survey, whose middle lies between two chainages (m), that were compared with the reference survey, and that of the last earlier survey compared with it, else 0 at the reference; stretches that were not compared have no value. inspected_share: 1 if both ends of the chord were inspected. remark: reason why the value is unknown';

CREATE OR REPLACE FUNCTION tunnel_api.alarms(tunnel text)
RETURNS TABLE (limit_id int, name text, quantity text, unit text, chainage_from float8, chainage_to float8, label text, survey text,
    date date, value float8, inspected_share float8, warning float8, alarm float8, level text, previous_survey text,
    previous_date date, previous_value float8, rate float8, why text)
LANGUAGE plpgsql STABLE STRICT PARALLEL SAFE SECURITY DEFINER ROWS 1000 SET search_path = pg_catalog, pg_temp SET jit = off
AS $$
#variable_conflict use_column
DECLARE
    tunnel_key constant int := tunnel_api.tunnel_id(tunnel);
    latest tunnel.survey;
BEGIN
    SELECT s.* INTO latest FROM tunnel.survey s WHERE s.id = tunnel_internal.latest_survey(tunnel_key);
    RETURN QUERY
    WITH goal AS MATERIALIZED (
        SELECT l.* FROM tunnel_api.alarm_limit l WHERE l.tunnel_id = tunnel_key
    ), wet AS MATERIALIZED (  -- once for all limits of the same stretches
        SELECT w.*, d.ids
          FROM (SELECT array_agg(g.id) AS ids, g.chainage_from, g.chainage_to, g.step FROM goal g WHERE g.step IS NOT NULL
                 GROUP BY g.chainage_from, g.chainage_to, g.step) d
         CROSS JOIN LATERAL tunnel_internal.wet_values(latest.id, d.chainage_from, d.chainage_to, d.step) w
    ), wet_pair AS (
        SELECT g.id, g.quantity, g.min_inspected, w.*,
               CASE WHEN w.earlier_share >= g.min_inspected - 1e-9 THEN w.earlier_area END AS known_area,
               CASE WHEN isfinite(latest.date) AND isfinite(o.date) THEN (latest.date - o.date) / 365.25 END AS years, o.name AS earlier
          FROM goal g
          JOIN wet w ON g.id = ANY (w.ids)
          LEFT JOIN tunnel.survey o ON o.id = w.earlier_id
    ), fact AS (
        SELECT g.id, v.chainage_from, v.chainage_to, v.value, v.value AS highest, v.inspected_share, v.previous_id, v.previous_value,
               v.remark
          FROM goal g
         CROSS JOIN LATERAL tunnel_internal.ovality_values(latest.id, g.chainage_from, g.chainage_to) v
         WHERE g.quantity = 'ovality'
        UNION ALL
        SELECT g.id, v.chainage_from, v.chainage_to, v.value, v.value, v.inspected_share, v.previous_id, v.previous_value, v.remark
          FROM goal g
         CROSS JOIN LATERAL tunnel_internal.convergence_values(
               latest.id, g.chainage_from, g.chainage_to, g.clock_from, g.clock_to, g.reference) v
         WHERE g.quantity = 'convergence'
        UNION ALL
        SELECT w.id, w.chainage_from, w.chainage_to, w.wet_area, w.highest, w.inspected_share, w.earlier_id, w.known_area, NULL
          FROM wet_pair w WHERE w.quantity = 'wet_area'
        UNION ALL
        SELECT w.id, w.chainage_from, w.chainage_to, (w.wet_area - w.known_area) / w.years, (w.highest - w.known_area) / w.years,
               w.inspected_share, w.earlier_id, NULL,
               CASE WHEN w.earlier_id IS NULL THEN 'no earlier inspection'
                    WHEN w.known_area IS NULL THEN format('%s %% inspected in %s', trunc(100 * w.earlier_share::numeric), w.earlier) END
          FROM wet_pair w WHERE w.quantity = 'growth'
    ), known AS (
        SELECT g.id, g.name, g.quantity, g.unit, g.warning, g.alarm, f.chainage_from, f.chainage_to, f.value, f.inspected_share,
               f.previous_id, f.previous_value, CASE WHEN g.quantity = 'convergence' THEN abs(f.value) ELSE f.value END AS size,
               nullif(concat_ws('; ',
                   CASE WHEN latest.id IS NULL THEN 'the tunnel has no survey'
                        WHEN f.id IS NULL THEN 'the limit applies to no part of the tunnel'
                        WHEN g.quantity IN ('ovality', 'convergence') AND f.remark IS NOT NULL THEN f.remark
                        WHEN f.inspected_share > 0 AND f.inspected_share < g.min_inspected - 1e-9
                        -- never rounded up to the limit
                        THEN format('%s %% inspected', trunc(100 * f.inspected_share::numeric))
                        WHEN coalesce(f.inspected_share, 0) = 0 THEN 'not inspected' END,
                   CASE WHEN g.quantity = 'growth' THEN f.remark END,
                   CASE WHEN f.highest >= g.warning AND f.highest > f.value THEN 'has dark bands that may be wet' END), '') AS remark
          FROM goal g LEFT JOIN fact f ON f.id = g.id
    ), graded AS (
        SELECT k.*, CASE WHEN k.size >= k.alarm THEN 'alarm' WHEN k.size >= k.warning THEN 'warning'
                         WHEN k.remark IS NOT NULL OR k.size IS NULL THEN 'unknown' ELSE 'ok' END AS level
          FROM known k
    )
    SELECT g.id, g.name, g.quantity, g.unit, g.chainage_from, g.chainage_to,
           (SELECT s.label FROM tunnel_api.stationing(tunnel_key, g.chainage_from) s), latest.name, latest.date, g.value,
           g.inspected_share, g.warning, g.alarm, g.level, p.name, p.date, g.previous_value,
           CASE WHEN g.remark IS NULL AND isfinite(latest.date) AND isfinite(p.date)
                THEN (g.value - g.previous_value) / nullif((latest.date - p.date) / 365.25, 0) END,
           nullif(concat_ws('; ',
               CASE WHEN g.level IN ('warning', 'alarm')
                    THEN concat_ws(' ', replace(g.quantity, '_', ' '), round(g.value::numeric, 6)::float8, nullif(g.unit, ''),
                                   'reaches the', g.level, CASE g.level WHEN 'alarm' THEN g.alarm ELSE g.warning END) END,
               g.remark), '')
      FROM graded g
      LEFT JOIN tunnel.survey p ON p.id = g.previous_id
     ORDER BY g.name, g.chainage_from;
END
$$;
COMMENT ON FUNCTION tunnel_api.alarms(text) IS
'Values of the latest survey of a tunnel, without copies from archives, compared with the limits of the tunnel: a row for each limit and ring (ovality), section of the comparison (convergence) or stretch (wet_area, growth). level: alarm or warning if the value reaches that limit, also where it was inspected in part; unknown if it does not, and the place was not inspected or less than min_inspected of it (why); else ok. label: station of its beginning. previous_value: that of the last earlier survey, at the same place; of growth, NULL, and previous_survey is the earlier inspection. rate: change since then per year; NULL if either value is unknown. A limit that applies nowhere has one unknown row';
