-- Limits of series of tunnels, and where the latest survey reaches them. Needs survey_copy (views/survey.sql), survey_ends
-- (geometry/survey_ends.sql), stretch_statistics (leaks/statistics.sql), convergence_at (measures/change.sql) and
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

-- The part of a stretch beyond the survey was not inspected.
CREATE OR REPLACE FUNCTION tunnel_internal.wet_stretches(survey_id int, starts float8[], ends float8[])
RETURNS TABLE (n int, wet_area float8, undecided_area float8, inspected_share float8)
LANGUAGE sql STABLE STRICT PARALLEL SAFE SECURITY DEFINER ROWS 100 SET search_path = pg_catalog, pg_temp SET jit = off
AS $$
    WITH part AS MATERIALIZED (
        SELECT p.n, p.low, p.high, greatest(p.low, e.chainage_from) AS first, least(p.high, e.chainage_to) AS last,
               row_number() OVER (ORDER BY p.n) AS k
          FROM tunnel_api.survey_ends($1) e
         CROSS JOIN unnest($2, $3) WITH ORDINALITY AS p (low, high, n)
         WHERE p.low < e.chainage_to AND p.high > e.chainage_from
    ), listed AS (
        SELECT array_agg(p.first ORDER BY p.k) AS starts, array_agg(p.last ORDER BY p.k) AS ends FROM part p
    )
    SELECT p.n::int, t.wet_area, t.undecided_area, t.seen_share * (p.last - p.first) / (p.high - p.low)
      FROM listed l
     CROSS JOIN LATERAL tunnel_internal.stretch_statistics($1, l.starts, l.ends) t
      JOIN part p ON p.k = t.n
$$;
COMMENT ON FUNCTION tunnel_internal.wet_stretches(int, float8[], float8[]) IS
'Wet area of stretches of a tunnel in a survey as in leak_statistics, and dark bands that may be wet (m²); NULL where leaks were not searched for. inspected_share: share of the lining of the whole stretch. No row for a stretch outside the survey';

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

CREATE OR REPLACE FUNCTION tunnel_internal.alarm_values(limit_id int, survey_id int)
RETURNS TABLE (chainage_from float8, chainage_to float8, value float8, highest float8, inspected_share float8, previous_id int,
    previous_value float8, remark text)
LANGUAGE plpgsql STABLE STRICT PARALLEL SAFE SECURITY DEFINER ROWS 1000 SET search_path = pg_catalog, pg_temp SET jit = off
AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := survey_id;
    own tunnel.alarm_limit;
    latest tunnel.survey;
    earlier tunnel.survey;
    reference tunnel.survey;
    low float8;
    high float8;
    starts float8[];
    ends float8[];
    years float8;
BEGIN
    SELECT l.* INTO own FROM tunnel.alarm_limit l WHERE l.id = limit_id;
    SELECT s.* INTO latest FROM tunnel.survey s WHERE s.id = survey_key;
    SELECT greatest(own.chainage_from, least(t.start_chainage, e.chainage_from)),
           least(own.chainage_to, greatest(t.start_chainage + public.ST_Length(t.alignment), e.chainage_to))
      INTO low, high
      FROM tunnel.tunnel t LEFT JOIN LATERAL tunnel_api.survey_ends(survey_key) e ON true WHERE t.id = own.tunnel_id;
    IF low IS NULL OR high IS NULL OR low >= high THEN
        RETURN;
    END IF;

    IF own.quantity IN ('wet_area', 'growth') THEN
        SELECT array_agg(greatest(k * own.step, low) ORDER BY k), array_agg(least((k + 1) * own.step, high) ORDER BY k)
          INTO starts, ends
          FROM generate_series(floor(low / own.step + 1e-9)::int, ceil(high / own.step - 1e-9)::int - 1) k;
        SELECT s.* INTO earlier FROM tunnel.survey s WHERE s.id = tunnel_internal.earlier_inspection(survey_key);
        IF isfinite(latest.date) AND isfinite(earlier.date) THEN
            years := (latest.date - earlier.date) / 365.25;
        END IF;
        RETURN QUERY
        WITH now AS MATERIALIZED (
            SELECT w.* FROM tunnel_internal.wet_stretches(survey_key, starts, ends) w
        ), before AS MATERIALIZED (
            SELECT w.* FROM tunnel_internal.wet_stretches(earlier.id, starts, ends) w
        ), pair AS (
            SELECT p.low, p.high, n.wet_area, n.wet_area + coalesce(n.undecided_area, 0) AS highest,
                   coalesce(n.inspected_share, 0) AS share, coalesce(b.inspected_share, 0) AS earlier_share,
                   CASE WHEN b.inspected_share >= own.min_inspected - 1e-9 THEN b.wet_area END AS earlier_area
              FROM unnest(starts, ends) WITH ORDINALITY AS p (low, high, n)
              LEFT JOIN now n ON n.n = p.n
              LEFT JOIN before b ON b.n = p.n
        )
        SELECT p.low, p.high, p.wet_area, p.highest, p.share, earlier.id, p.earlier_area, NULL::text
          FROM pair p WHERE own.quantity = 'wet_area'
        UNION ALL
        SELECT p.low, p.high, (p.wet_area - p.earlier_area) / years, (p.highest - p.earlier_area) / years, p.share, earlier.id, NULL,
               CASE WHEN earlier.id IS NULL THEN 'no earlier inspection'
                    WHEN p.earlier_area IS NULL
                    -- never rounded up to the limit
                    THEN format('%s %% inspected in %s', trunc(100 * p.earlier_share::numeric), earlier.name) END
          FROM pair p WHERE own.quantity = 'growth'
        ORDER BY 1;
        RETURN;
    END IF;

    IF own.quantity = 'ovality' THEN
        SELECT s.* INTO earlier FROM tunnel.survey s
         WHERE s.tunnel_id = own.tunnel_id AND s.date < latest.date
           AND s.id NOT IN (SELECT c.survey_id FROM tunnel_internal.survey_copy c)
           AND EXISTS (SELECT FROM tunnel.ring r WHERE r.survey_id = s.id AND r.ovality IS NOT NULL)
         ORDER BY s.date DESC, s.id LIMIT 1;
        SELECT array_agg(r.chainage_from ORDER BY r.chainage_from), array_agg(r.chainage_to ORDER BY r.chainage_from)
          INTO starts, ends
          FROM tunnel.ring r
         WHERE r.survey_id = survey_key AND (r.chainage_from + r.chainage_to) / 2 >= low AND (r.chainage_from + r.chainage_to) / 2 < high;
        RETURN QUERY
        SELECT r.chainage_from, r.chainage_to, nullif(r.ovality, 'NaN'), nullif(r.ovality, 'NaN'),
               CASE WHEN r.ovality IS NULL THEN 0 ELSE coalesce(r.seen_share, 0) END, earlier.id,
               CASE WHEN o.chainage_to > m.chainage THEN nullif(o.ovality, 'NaN') END,
               CASE WHEN r.ovality IS NULL THEN 'ovality not measured' END
          FROM tunnel.ring r
         CROSS JOIN LATERAL (SELECT (r.chainage_from + r.chainage_to) / 2 AS chainage) m
          LEFT JOIN LATERAL (SELECT q.chainage_to, q.ovality FROM tunnel.ring q
                              WHERE q.survey_id = earlier.id AND q.chainage_from <= m.chainage
                              ORDER BY q.chainage_from DESC LIMIT 1) o ON true
         WHERE r.survey_id = survey_key AND m.chainage >= low AND m.chainage < high
        UNION ALL
        SELECT g.chainage_from, g.chainage_to, NULL, NULL, 0, earlier.id, NULL, 'no ring measured'
          FROM tunnel_internal.gaps_between(low, high, starts, ends) g
        ORDER BY 1;
        RETURN;
    END IF;

    IF own.reference IS NULL THEN
        SELECT s.* INTO reference FROM tunnel.survey s
         WHERE s.tunnel_id = own.tunnel_id AND s.id NOT IN (SELECT c.survey_id FROM tunnel_internal.survey_copy c)
           AND EXISTS (SELECT FROM tunnel.change_section c WHERE c.old_survey_id = s.id AND c.survey_id IN (
                       SELECT n.id FROM tunnel.survey n WHERE n.tunnel_id = own.tunnel_id AND n.date > s.date))
         ORDER BY s.date, s.id LIMIT 1;
    ELSE
        SELECT s.* INTO reference FROM tunnel.survey s WHERE s.name = own.reference AND s.tunnel_id = own.tunnel_id;
    END IF;
    SELECT s.* INTO earlier FROM tunnel.survey s
     WHERE s.tunnel_id = own.tunnel_id AND s.date < latest.date AND s.date > reference.date
       AND s.id NOT IN (SELECT c.survey_id FROM tunnel_internal.survey_copy c)
       AND EXISTS (SELECT FROM tunnel.change_section c WHERE c.old_survey_id = reference.id AND c.survey_id = s.id)
     ORDER BY s.date DESC, s.id LIMIT 1;
    SELECT array_agg(c.chainage_from ORDER BY c.chainage_from), array_agg(c.chainage_to ORDER BY c.chainage_from)
      INTO starts, ends
      FROM tunnel.change_section c
     WHERE c.survey_id = survey_key AND c.old_survey_id = reference.id AND (c.chainage_from + c.chainage_to) / 2 >= low
       AND (c.chainage_from + c.chainage_to) / 2 < high;
    RETURN QUERY
    WITH place AS MATERIALIZED (
        SELECT p.low, p.high, p.n FROM unnest(starts, ends) WITH ORDINALITY AS p (low, high, n)
    ), chord AS MATERIALIZED (
        SELECT c.* FROM tunnel_internal.convergence_at(
            reference.id, array_remove(ARRAY[survey_key, earlier.id], NULL),
            (SELECT array_agg((p.low + p.high) / 2 ORDER BY p.n) FROM place p), own.clock_from, own.clock_to) c
    )
    SELECT p.low, p.high, c.convergence, c.convergence, CASE WHEN c.convergence IS NULL THEN 0 ELSE 1 END::float8,
           coalesce(earlier.id, reference.id), CASE WHEN earlier.id IS NULL THEN 0 ELSE o.convergence END,
           CASE WHEN c.convergence IS NULL THEN 'an end of the chord was not inspected' END
      FROM place p
      LEFT JOIN chord c ON c.n = p.n AND c.survey_id = survey_key
      LEFT JOIN chord o ON o.n = p.n AND o.survey_id = earlier.id
    UNION ALL
    SELECT g.chainage_from, g.chainage_to, NULL, NULL, 0, coalesce(earlier.id, reference.id), NULL,
           CASE WHEN reference.id IS NOT NULL THEN format('not compared with %s', reference.name)
                WHEN own.reference IS NOT NULL THEN format('the tunnel has no survey %s', own.reference)
                ELSE 'no survey was compared with an earlier one' END
      FROM tunnel_internal.gaps_between(low, high, starts, ends) g
    ORDER BY 1;
END
$$;
COMMENT ON FUNCTION tunnel_internal.alarm_values(int, int) IS
'Values of the quantity of a limit in a survey, by ring, stretch or section. highest: value if undecided dark bands are wet. remark: reason why the value is unknown. previous_id: survey with the previous value; of growth, the earlier inspection. No row if the limit applies to no part of the tunnel';

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
    WITH fact AS (
        SELECT l.id, l.name, l.quantity, l.unit, l.warning, l.alarm, l.min_inspected, v.chainage_from, v.chainage_to, v.value,
               v.inspected_share, v.previous_id, v.previous_value,
               CASE WHEN l.quantity = 'convergence' THEN abs(v.value) ELSE v.value END AS size,
               CASE WHEN latest.id IS NULL THEN 'the tunnel has no survey'
                    WHEN v.chainage_from IS NULL THEN 'the limit applies to no part of the tunnel'
                    WHEN v.remark IS NOT NULL THEN v.remark
                    WHEN v.value IS NULL OR v.inspected_share = 0 THEN 'not inspected'
                    -- never rounded up to the limit
                    WHEN v.inspected_share < l.min_inspected - 1e-9
                    THEN format('%s %% inspected', trunc(100 * v.inspected_share::numeric))
                    WHEN v.highest >= l.warning AND v.highest > v.value THEN 'dark bands that may be wet' END AS remark
          FROM tunnel_api.alarm_limit l
          LEFT JOIN LATERAL tunnel_internal.alarm_values(l.id, latest.id) v ON true
         WHERE l.tunnel_id = tunnel_key
    ), graded AS (
        SELECT f.*, CASE WHEN f.size >= f.alarm THEN 'alarm' WHEN f.size >= f.warning THEN 'warning'
                         WHEN f.remark IS NOT NULL THEN 'unknown' ELSE 'ok' END AS level
          FROM fact f
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
