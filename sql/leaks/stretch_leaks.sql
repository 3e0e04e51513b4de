-- Leaks in stretches of a survey, which are given as in stretch_statistics: a row for each leak and stretch. A leak that an end
-- of a stretch cuts counts in part.
CREATE OR REPLACE FUNCTION tunnel_internal.stretch_leaks(survey_id int, starts float8[], ends float8[])
RETURNS TABLE (n int, id bigint, whole float8, area float8, a float8, b float8)
LANGUAGE plpgsql STABLE PARALLEL SAFE STRICT
ROWS 1000
SECURITY DEFINER SET search_path = pg_catalog, pg_temp
SET jit = off
SET enable_nestloop = off  -- the number of rows is unknown at planning
SET enable_mergejoin = off  -- it would sort rows that contain the sums of a kilometre
SET plan_cache_mode = force_generic_plan  -- planning takes longer than a short stretch
AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := survey_id;
    first_start constant float8 := starts[1];
    last_end constant float8 := ends[cardinality(ends)];
    first_km constant int := (
        SELECT coalesce(max(c.km) FILTER (WHERE c.km <= floor(first_start / 1000)), min(c.km))
        FROM tunnel.coverage c WHERE c.survey_id = survey_key);
    -- leaks that begin before this reach into no stretch
    first_leak constant float8 := first_start - 1e-6 - (
        SELECT coalesce(max(l.chainage_to - l.chainage_from), 0) FROM tunnel.finding l WHERE l.survey_id = survey_key);
BEGIN
    RETURN QUERY
    WITH given AS MATERIALIZED (
        SELECT starts AS low, ends AS high
    ), km AS MATERIALIZED (  -- [:] takes the sums out of their storage once, not for each leak
        SELECT c.km, c.km * 1000::float8 AS start, c.step, c.lining_before AS before, c.lining_sums[:] AS lining
        FROM tunnel_internal.coverage_sums c
        WHERE c.survey_id = survey_key AND c.km BETWEEN first_km AND floor(last_end / 1000)
    ), known AS MATERIALIZED (
        SELECT array_agg(k.km ORDER BY k.km) AS km, array_agg(k.before ORDER BY k.km) AS before FROM km k
    ), leak AS (
        SELECT l.id, l.area, l.chainage_from AS low, l.chainage_to AS high, generate_series(
            greatest(width_bucket(l.chainage_from, g.low), 1), width_bucket(l.chainage_to, g.low)) AS n
        FROM given g CROSS JOIN tunnel.finding l
        WHERE l.survey_id = survey_key AND l.detected AND l.review <> 'rejected' AND l.wet AND NOT l.superseded
            AND l.chainage_from > first_leak AND l.chainage_to > first_start AND l.chainage_from < last_end
    ), cut AS (
        SELECT l.n, l.id, greatest(l.low, g.low[l.n]) AS low, least(l.high, g.high[l.n]) AS high, l.area AS whole,
            CASE WHEN l.low >= g.low[l.n] AND l.high <= g.high[l.n] THEN l.area
                 -- few leaks are cut: only these are read from the table, the others from the index
                 ELSE (SELECT tunnel_internal.area_between(a.unrolled, a.area, g.low[l.n], g.high[l.n])
                     FROM tunnel.finding a WHERE a.id = l.id) END AS area
        FROM leak l CROSS JOIN given g
        WHERE l.high > g.low[l.n] AND l.low < g.high[l.n]
    )
    SELECT c.n, c.id, c.whole, c.area,
        coalesce(f.before + tunnel_internal.sum_upto(f.lining, f.step, least(c.low - f.start, 1000)), 0) AS a,
        coalesce(t.before + tunnel_internal.sum_upto(t.lining, t.step, least(c.high - t.start, 1000)), 0) AS b
    FROM cut c CROSS JOIN known
    LEFT JOIN km f ON f.km = known.km[width_bucket(floor(c.low / 1000)::int, known.km)]
    LEFT JOIN km t ON t.km = known.km[width_bucket(floor(c.high / 1000)::int, known.km)];
END
$$;
COMMENT ON FUNCTION tunnel_internal.stretch_leaks(int, float8[], float8[]) IS
'Leaks in stretches of a survey: number of the stretch, from 1; id; area of the whole leak and of its part in the stretch (m²); lining from the beginning of the survey to both ends of that part (m²), 0 if no lining is known';


CREATE OR REPLACE FUNCTION tunnel_internal.stretch_bands(survey_id int, starts float8[], ends float8[])
RETURNS TABLE (n int, area float8, largest float8, bands int)
LANGUAGE sql STABLE PARALLEL SAFE STRICT
ROWS 10
SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
    SELECT b.n, sum(b.area * (least(b.high, $3[b.n]) - greatest(b.low, $2[b.n])) / (b.high - b.low)), max(b.area), count(*)::int
    FROM (
        SELECT d.chainage_from AS low, d.chainage_to AS high, d.area, generate_series(
            greatest(width_bucket(d.chainage_from, $2), 1), width_bucket(d.chainage_to, $2)) AS n
        FROM tunnel_api.dark_band d
        WHERE d.survey_id = $1 AND NOT d.decided AND d.chainage_to > $2[1] AND d.chainage_from < $3[cardinality($3)]) b
    WHERE b.high > $2[b.n] AND b.low < $3[b.n]
    GROUP BY b.n
$$;
COMMENT ON FUNCTION tunnel_internal.stretch_bands(int, float8[], float8[]) IS
'Dark bands that may be wet or dirty (dark_band) in stretches of a survey: number of the stretch, from 1; area in the stretch and of the largest whole band (m²); number of bands';
