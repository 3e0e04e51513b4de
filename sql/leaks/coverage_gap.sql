-- Stretches where leaks could be missed: not loaded, not searched, failed, searched before something changed, with little
-- inspected lining, or with dark bands that may be wet. Every document that lists leaks reads this. Needs stage_state
-- (stages/status.sql), coverage_at and km_ends (leaks/coverage.sql), and dark_band (leaks/dark_band.sql).

-- A kilometre was searched if detection wrote the inspected lining (tunnel.coverage). A kilometre that was not searched
-- begins and ends with its segments, or else with the points of its files along the given axis; the two differ by
-- centimetres, so gaps shorter than 1 m are ignored. Lining is examined in bins of 1 m.
CREATE OR REPLACE FUNCTION tunnel_internal.coverage_gaps_of(survey_id int, starts float8[], ends float8[])
RETURNS TABLE (
    n int, chainage_from float8, chainage_to float8, state text, reason text, searched boolean, seen_share float8)
LANGUAGE plpgsql STABLE STRICT PARALLEL RESTRICTED
COST 100000  -- once a survey, not once a stretch
ROWS 10
SECURITY DEFINER SET search_path = pg_catalog, pg_temp
SET jit = off
SET plan_cache_mode = force_generic_plan  -- planning takes longer than a short stretch
AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := survey_id;
    first_place constant float8 := (SELECT min(p) FROM unnest(starts) p);
    last_place constant float8 := (SELECT max(p) FROM unnest(ends) p);
    blind constant boolean := (SELECT s.intensity_kind = 'none' FROM tunnel.survey s WHERE s.id = survey_key);
    least_share constant float8 := 0.5;  -- of the lining seen
    least_length constant float8 := 5;  -- over which it was not, m
BEGIN
    PERFORM tunnel_internal.in_order(s.low, s.high) FROM unnest(starts, ends) AS s (low, high);
    RETURN QUERY
    WITH stretch AS MATERIALIZED (
        SELECT s.n::int, s.low, s.high FROM unnest(starts, ends) WITH ORDINALITY AS s (low, high, n)
    ), scanned AS (  -- along the given axis
        SELECT k.km, min(greatest(f.chainage_from, k.km * 1000)) AS low, max(least(f.chainage_to, (k.km + 1) * 1000)) AS high
        FROM tunnel.scan_file f
        CROSS JOIN LATERAL generate_series(floor(f.chainage_from / 1000)::int, ceil(f.chainage_to / 1000)::int - 1) AS k (km)
        WHERE f.survey_id = survey_key
        GROUP BY k.km
    ), kilometre AS MATERIALIZED (
        SELECT p.km, p.low, p.high, c.km IS NOT NULL AND NOT blind AS searched
        FROM (SELECT coalesce(q.km, e.km) AS km, coalesce(e.chainage_from, q.low) AS low, coalesce(e.chainage_to, q.high) AS high
              FROM scanned q
              FULL JOIN (SELECT k.* FROM tunnel_internal.km_ends k WHERE k.survey_id = survey_key) e ON e.km = q.km) p
        LEFT JOIN tunnel.coverage c ON c.survey_id = survey_key AND c.km = p.km
    ), stage AS MATERIALIZED (
        SELECT t.km, t.step, t.stage, t.outcome, t.reason, t.done_at, split_part(t.message, E'\n', 1) AS message
        -- staleness comes from as many kilometres away as there are stages
        FROM tunnel_internal.stage_state(survey_key, greatest(first_place / 1000 - 7, -1000000)::int,
                                    least(last_place / 1000 + 6, 1000000)::int) t
        WHERE t.step <= (SELECT d.step FROM tunnel.stage d WHERE d.name = 'detect')
    ), first_bad AS (  -- of what a kilometre has not, or failed to renew, the first
        SELECT DISTINCT ON (t.km) t.* FROM stage t
        WHERE t.done_at IS NULL OR t.outcome IN ('failed', 'interrupted')
        ORDER BY t.km, t.step
    ), judged AS (
        SELECT k.low, k.high, k.searched,
            CASE WHEN blind THEN 'no intensity'
                 WHEN b.outcome IN ('failed', 'interrupted') THEN b.outcome
                 WHEN k.searched THEN CASE WHEN d.reason IS NOT NULL THEN 'stale' END
                 WHEN b.stage = 'load' THEN 'not loaded'
                 ELSE 'not searched' END AS state,
            CASE WHEN blind THEN 'by which wet lining is told from dry'
                 WHEN b.outcome = 'failed' THEN b.stage || ': ' || coalesce(b.message, 'no reason was noted')
                 WHEN b.outcome = 'interrupted' THEN b.stage || ': the program that ran it is gone'
                 WHEN k.searched THEN d.reason
                 WHEN b.outcome = 'running' THEN b.stage || ' is running'
                 WHEN b.stage IS NOT NULL THEN b.stage || ' has not run'
                 WHEN d.done_at IS NOT NULL THEN 'detect of an earlier version did not note what it saw'
                 ELSE 'detect has not run' END AS reason
        FROM kilometre k
        LEFT JOIN first_bad b ON b.km = k.km
        LEFT JOIN stage d ON d.km = k.km AND d.stage = 'detect'
    ), unread AS (  -- what a file that was not read would have filled, as far as its header tells
        SELECT greatest(coalesce(i.km_from * 1000::float8, '-Infinity'), t.start_chainage) AS low,
            least(coalesce((i.km_to + 1) * 1000::float8, 'Infinity'), t.start_chainage + public.ST_Length(t.alignment)) AS high,
            CASE WHEN i.failed_at IS NULL THEN i.name || ' waits to be read'
                 ELSE i.name || ' was not read: ' || split_part(i.message, E'\n', 1) END AS reason
        FROM tunnel.incoming i
        JOIN tunnel.survey s ON s.id = i.survey_id
        JOIN tunnel.tunnel t ON t.id = s.tunnel_id
        WHERE i.survey_id = survey_key
    ), beyond AS (  -- between kilometres, and where a stretch asked for reaches farther than the survey
        SELECT s.n, b.low, b.high
        FROM (SELECT lag(k.high) OVER (ORDER BY k.km) AS low, k.low AS high FROM kilometre k) b
        JOIN stretch s ON b.low < s.high AND b.high > s.low
        UNION ALL
        SELECT s.n, s.low, f.low FROM stretch s CROSS JOIN (SELECT k.low FROM kilometre k ORDER BY k.km LIMIT 1) f
        UNION ALL
        SELECT s.n, l.high, s.high FROM stretch s CROSS JOIN (SELECT max(k.high) AS high FROM kilometre k HAVING count(*) > 0) l
        UNION ALL
        SELECT s.n, greatest(s.low, t.start_chainage), least(s.high, t.start_chainage + public.ST_Length(t.alignment))
        FROM stretch s CROSS JOIN tunnel.survey v JOIN tunnel.tunnel t ON t.id = v.tunnel_id
        WHERE v.id = survey_key AND NOT EXISTS (SELECT FROM kilometre)
    ), place AS MATERIALIZED (
        SELECT array_agg(q.n) AS n, array_agg(q.at) AS at
        FROM (
            SELECT DISTINCT s.n, p.at
            FROM kilometre k
            JOIN stretch s ON k.low < s.high AND k.high > s.low
            CROSS JOIN LATERAL (SELECT greatest(k.low, s.low) AS low, least(k.high, s.high) AS high) c
            CROSS JOIN LATERAL (
                SELECT c.low AS at UNION ALL SELECT c.high
                UNION ALL SELECT generate_series(ceil(c.low)::int, floor(c.high)::int)) p
            WHERE k.searched AND c.low < c.high
            ORDER BY s.n, p.at) q
    ), bin AS (
        SELECT b.*, CASE WHEN b.lining < 1e-6 THEN 'not scanned' WHEN b.seen < least_share * b.lining THEN 'unseen' END AS state
        FROM (
            SELECT p.n, c.chainage AS low, lead(c.chainage) OVER along AS high, lead(c.lining) OVER along - c.lining AS lining,
                lead(c.seen) OVER along - c.seen AS seen
            FROM tunnel_internal.coverage_at(survey_key, (SELECT p.at FROM place p)) c
            JOIN unnest((SELECT p.n FROM place p)) WITH ORDINALITY AS p (n, place) ON p.place = c.n
            WINDOW along AS (PARTITION BY p.n ORDER BY c.chainage)) b
        WHERE b.high < b.low + 1 + 1e-6
    ), dim AS (  -- what lacks something: in parts of one state, and in wholes that lack something all along
        SELECT b.n, b.low, b.high, b.lining, b.seen, b.state,
            sum(CASE WHEN b.state = b.before AND b.low = b.behind THEN 0 ELSE 1 END) OVER along AS part,
            sum(CASE WHEN b.low = b.behind THEN 0 ELSE 1 END) OVER along AS whole
        FROM (
            SELECT b.*, lag(b.state) OVER along AS before, lag(b.high) OVER along AS behind
            FROM bin b
            WHERE b.state IS NOT NULL
            WINDOW along AS (PARTITION BY b.n ORDER BY b.low)) b
        WINDOW along AS (PARTITION BY b.n ORDER BY b.low)
    ), dark AS (  -- of a whole that is long enough, what is too short to be told by itself is unseen
        SELECT d.*, sum(CASE WHEN d.said = d.before AND d.whole = d.whole_before THEN 0 ELSE 1 END) OVER (
            PARTITION BY d.n ORDER BY d.low) AS piece
        FROM (
            SELECT l.*, lag(l.said) OVER along AS before, lag(l.whole) OVER along AS whole_before
            FROM (
                SELECT d.n, d.low, d.high, d.lining, d.seen, d.whole,
                    CASE WHEN d.state = 'not scanned' AND max(d.high) OVER of_part - min(d.low) OVER of_part >= least_length
                         THEN d.state ELSE 'unseen' END AS said,
                    max(d.high) OVER of_whole - min(d.low) OVER of_whole AS length
                FROM dim d
                WINDOW of_part AS (PARTITION BY d.n, d.part), of_whole AS (PARTITION BY d.n, d.whole)) l
            WHERE l.length >= least_length
            WINDOW along AS (PARTITION BY l.n ORDER BY l.low)) d
    ), band AS (  -- dark bands that may be wet or dirty, as far as they lie in a stretch
        SELECT s.n, greatest(b.chainage_from, s.low) AS low, least(b.chainage_to, s.high) AS high,
            b.area * (least(b.chainage_to, s.high) - greatest(b.chainage_from, s.low)) / (b.chainage_to - b.chainage_from) AS area
        FROM tunnel_api.dark_band b
        JOIN stretch s ON b.chainage_from < s.high AND b.chainage_to > s.low
        WHERE b.survey_id = survey_key AND NOT b.decided AND NOT blind
    ), banded AS (
        SELECT r.n, lower(r.part)::float8 AS low, upper(r.part)::float8 AS high
        FROM (SELECT b.n, unnest(range_agg(numrange(b.low::numeric, b.high::numeric))) AS part FROM band b GROUP BY b.n) r
    ), gap AS (
        SELECT s.n, j.low, j.high, j.state, j.reason, j.searched, NULL::float8 AS seen
        FROM judged j JOIN stretch s ON j.low < s.high AND j.high > s.low
        WHERE j.state IS NOT NULL
        UNION ALL
        SELECT s.n, u.low, u.high, 'not loaded', u.reason, false, NULL
        FROM unread u JOIN stretch s ON u.low < s.high AND u.high > s.low
        UNION ALL
        SELECT b.n, b.low, b.high, 'not scanned', 'the survey has no points there', false, NULL FROM beyond b
        WHERE b.low > '-Infinity' AND b.high < 'Infinity' AND b.high - b.low >= 1
        UNION ALL
        SELECT d.n, min(d.low), max(d.high), d.said,
            CASE d.said WHEN 'unseen' THEN 'less than half of the lining was seen' ELSE 'no lining is known there' END, true,
            coalesce(sum(d.seen) / nullif(sum(d.lining), 0), 0)
        FROM dark d
        GROUP BY d.n, d.piece, d.said
        UNION ALL
        SELECT r.n, r.low, r.high, 'undecided',
            format('dark bands along the tunnel, %s m²: wet or dirty', round((
                SELECT sum(b.area) FROM band b WHERE b.n = r.n AND b.low < r.high AND b.high > r.low)::numeric, 1)), true, NULL
        FROM banded r
    ), cut AS (
        SELECT s.n, greatest(g.low, s.low) AS low, least(g.high, s.high) AS high, g.state, g.reason, g.searched, g.seen
        FROM gap g
        JOIN stretch s ON s.n = g.n
        WHERE g.low < s.high AND g.high > s.low
    ), joined AS (  -- of kilometres in a row of which the same is to be said
        SELECT c.*, sum(CASE WHEN c.low <= c.before + CASE c.state WHEN 'unseen' THEN 0 ELSE 1 END THEN 0 ELSE 1 END) OVER (
            PARTITION BY c.n, c.state, c.reason, c.searched ORDER BY c.low) AS part
        FROM (SELECT c.*, lag(c.high) OVER (PARTITION BY c.n, c.state, c.reason, c.searched ORDER BY c.low) AS before FROM cut c) c
    )
    SELECT j.n, min(j.low) AS low, max(j.high), j.state, j.reason, j.searched, max(j.seen)
    FROM joined j
    GROUP BY j.n, j.state, j.reason, j.searched, j.part
    ORDER BY 1, 6, 2, 3 DESC, 4, 5;
END
$$;
COMMENT ON FUNCTION tunnel_internal.coverage_gaps_of(int, float8[], float8[]) IS
'Result of coverage_gaps for several stretches of a survey, given by their beginnings and ends (m). n: number of the stretch, from 1';


-- The planner inlines the body.
CREATE OR REPLACE FUNCTION tunnel_api.coverage_gaps(
    survey_id int, stretch_from float8 DEFAULT '-Infinity', stretch_to float8 DEFAULT 'Infinity')
RETURNS TABLE (chainage_from float8, chainage_to float8, state text, reason text, searched boolean, seen_share float8)
LANGUAGE sql STABLE CALLED ON NULL INPUT PARALLEL RESTRICTED
ROWS 10
AS $$
    SELECT g.chainage_from, g.chainage_to, g.state, g.reason, g.searched, g.seen_share
    FROM tunnel_internal.coverage_gaps_of($1, ARRAY[$2], ARRAY[$3]) g
$$;
COMMENT ON FUNCTION tunnel_api.coverage_gaps(int, float8, float8) IS
'Stretches between two chainages (m) of a survey where leaks could be missed, and why; stretches that were not searched come first. state: not scanned (no points or no lining), not loaded, not searched, failed, interrupted, stale (something changed since the search), unseen (5 m or more with less than half of the lining inspected), undecided (dark bands that may be wet or dirty: dark_band), no intensity. searched: true if the stretch has results of a search. No rows: everything was searched, is up to date, and decided, and more than half of the lining was inspected';


CREATE OR REPLACE FUNCTION tunnel_internal.coverage_statements(survey_id int, starts float8[], ends float8[])
RETURNS TABLE (n int, said text)
LANGUAGE sql STABLE STRICT PARALLEL RESTRICTED
COST 100000  -- once a survey, not once a stretch
ROWS 10
SECURITY DEFINER SET search_path = pg_catalog, pg_temp
SET jit = off
AS $$
    SELECT k.stretch, string_agg(k.said, '; ' ORDER BY k.searched, k.n)
    FROM (
        SELECT w.stretch, w.searched, min(w.n) AS n,
            CASE WHEN w.searched THEN 'Searched, but ' ELSE 'Not searched for leaks: ' END
            || string_agg(CASE WHEN w.n <= 6 THEN w.said END, ', ' ORDER BY w.n)
            || CASE WHEN max(w.n) > 6 THEN format(', and %s more', max(w.n) - 6) ELSE '' END AS said
        FROM (
            SELECT g.n AS stretch, g.searched, row_number() OVER (PARTITION BY g.n, g.searched ORDER BY g.chainage_from) AS n,
                format(CASE WHEN g.searched THEN '%3$s %1$s–%2$s%4$s' ELSE '%1$s–%2$s %3$s%4$s' END,
                    f.label, t.label, g.state, CASE g.state
                        WHEN 'unseen' THEN format(' (%s %% of the lining inspected)', round((100 * g.seen_share)::numeric))
                        ELSE format(' (%s)', g.reason) END) AS said
            FROM tunnel.survey s
            CROSS JOIN LATERAL tunnel_internal.coverage_gaps_of(s.id, $2, $3) g
            CROSS JOIN LATERAL (SELECT regexp_replace(l.label, '\.0+$', '') AS label
                                FROM tunnel_api.stationing(s.tunnel_id, g.chainage_from) l) f
            CROSS JOIN LATERAL (SELECT regexp_replace(l.label, '\.0+$', '') AS label
                                FROM tunnel_api.stationing(s.tunnel_id, g.chainage_to) l) t
            WHERE s.id = $1) w
        GROUP BY w.stretch, w.searched) k
    GROUP BY k.stretch
    ORDER BY k.stretch
$$;
COMMENT ON FUNCTION tunnel_internal.coverage_statements(int, float8[], float8[]) IS
'Result of coverage_statement for several stretches of a survey, given by their beginnings and ends (m). n: number of the stretch, from 1. No row for a stretch without gaps';


CREATE OR REPLACE FUNCTION tunnel_api.coverage_statement(
    survey_id int, chainage_from float8 DEFAULT '-Infinity', chainage_to float8 DEFAULT 'Infinity')
RETURNS text
LANGUAGE sql STABLE STRICT PARALLEL RESTRICTED
AS $$ SELECT s.said FROM tunnel_internal.coverage_statements($1, ARRAY[$2], ARRAY[$3]) s $$;
COMMENT ON FUNCTION tunnel_api.coverage_statement(int, float8, float8) IS
'Result of coverage_gaps for a stretch of a survey (m) in words, at most six stretches of each kind; NULL if there are no gaps. Every document states it before it counts leaks';


-- Numbered by name as well, so that a condition on the name excludes the other surveys.
CREATE OR REPLACE VIEW tunnel_api.coverage_gap AS
SELECT s.id::bigint * 1000000 + row_number() OVER (PARTITION BY s.id, s.name) AS id, s.id AS survey_id, s.name AS survey,
       g.chainage_from, g.chainage_to, tunnel_api.station_label(s.tunnel_id, g.chainage_from) AS label_from,
       tunnel_api.station_label(s.tunnel_id, g.chainage_to) AS label_to, g.state, g.reason, g.searched, g.seen_share,
       public.st_makeenvelope(g.chainage_from, a.arc_from, g.chainage_to, a.arc_to, 0)::public.geometry(Polygon, 0) AS geom
  FROM tunnel.survey s
 CROSS JOIN LATERAL tunnel_api.coverage_gaps(s.id) g
 CROSS JOIN LATERAL (  -- not of the widest section: one that was measured astray would make all higher
        SELECT percentile_cont(0.02) WITHIN GROUP (ORDER BY t.arc[1]) AS arc_from,
               percentile_cont(0.98) WITHIN GROUP (ORDER BY t.arc[361]) AS arc_to
          FROM tunnel.section t WHERE t.survey_id = s.id) a;
COMMENT ON VIEW tunnel_api.coverage_gap IS
    'Stretches of surveys where leaks could be missed, and why (see coverage_gaps), as rectangles of the unrolled plane (chainage, arc), SRID 0';
COMMENT ON COLUMN tunnel_api.coverage_gap.id IS 'Key, valid until something is loaded, run or edited';
COMMENT ON COLUMN tunnel_api.coverage_gap.state IS 'not scanned, not loaded, not searched, failed, interrupted, stale, unseen, undecided or no intensity';
COMMENT ON COLUMN tunnel_api.coverage_gap.reason IS 'Cause of the gap';
COMMENT ON COLUMN tunnel_api.coverage_gap.searched IS 'True if the stretch has results of a search for leaks';
COMMENT ON COLUMN tunnel_api.coverage_gap.seen_share IS
    'Inspected share of the lining, where it is less than half; else NULL';
COMMENT ON COLUMN tunnel_api.coverage_gap.geom IS
    'Rectangle of the unrolled plane over the full width of the sections; NULL before the survey has sections';
