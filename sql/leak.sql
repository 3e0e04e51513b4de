-- Chainage as it is written and read, and sums over leaks.

-- Chainage written as km + m: 12345.678 m is 12+345.678, -5 m is -0+005.000. Rounded to mm first, so that 12999.9999 m
-- is 13+000.000. One call of to_char on whole mm, which the planner puts in its place: ten times as fast as arithmetic on
-- numeric. STABLE, for to_char is.
CREATE OR REPLACE FUNCTION tunnel_api.chainage_label(chainage float8)
RETURNS text
LANGUAGE sql STABLE STRICT PARALLEL SAFE
AS $$
    SELECT to_char(round($1 * 1000)::bigint, 'FM999999990"+"000"."000')
$$;
COMMENT ON FUNCTION tunnel_api.chainage_label(float8) IS
'Chainage (m) as text, km + m with mm: 12345.678 -> 12+345.678.';


-- The way back: '12+345.678', '12+345', '-0+005' or plain metres ('12345.678') -> m. Anything else is an error.
CREATE OR REPLACE FUNCTION tunnel_api.chainage_parse(label text)
RETURNS float8
LANGUAGE plpgsql IMMUTABLE STRICT PARALLEL SAFE
SET search_path = pg_catalog, pg_temp
AS $$
DECLARE
    part text[];
BEGIN
    part := regexp_match(btrim(label), '^(-?)(\d+)\+(\d{3}(?:\.\d*)?)$');
    IF part IS NOT NULL THEN
        RETURN ((part[1] || '1')::numeric * (part[2]::numeric * 1000 + part[3]::numeric))::float8;
    END IF;
    part := regexp_match(btrim(label), '^(-?\d+(?:\.\d*)?)$');
    IF part IS NOT NULL THEN
        RETURN part[1]::float8;
    END IF;
    RAISE EXCEPTION '"%" is no chainage: write 12+345.678 or metres', label USING ERRCODE = 'invalid_text_representation';
END
$$;
COMMENT ON FUNCTION tunnel_api.chainage_parse(text) IS
'Chainage in m of its text: 12+345.678 -> 12345.678; plain metres are taken as they are.';


-- Wet area of a stretch of a survey, m² on the lining: the leaks (of kind leak, after judging) that were found last and are
-- not rejected, cut at both ends. Runs with the owner's rights, for it reads the tables themselves. Those that are not cut come
-- from the index alone, of which no more is read than the longest leak can reach.
CREATE OR REPLACE FUNCTION tunnel_api.wet_area(survey text, chainage_from float8, chainage_to float8)
RETURNS float8
LANGUAGE sql STABLE STRICT PARALLEL SAFE SECURITY DEFINER
SET search_path = pg_catalog, public, pg_temp
AS $$
    WITH given AS MATERIALIZED (
        SELECT s.id, (SELECT max(l.chainage_to - l.chainage_from) FROM tunnel.anomaly l WHERE l.survey_id = s.id) AS longest
        FROM tunnel.survey s WHERE s.name = $1
    )
    SELECT coalesce(sum(CASE WHEN l.chainage_from >= $2 AND l.chainage_to <= $3 THEN l.area
        ELSE l.area * (SELECT ST_Area(ST_ClipByBox2D(a.unrolled, ST_MakeBox2D(
            ST_MakePoint($2, -1e4), ST_MakePoint($3, 1e4)))) / ST_Area(a.unrolled)
            FROM tunnel.anomaly a WHERE a.id = l.id) END), 0)
    FROM tunnel.anomaly l
    WHERE l.survey_id = (SELECT g.id FROM given g) AND l.detected AND l.review <> 'rejected'
        AND coalesce(l.judged, l.kind) = 'leak'
        AND l.chainage_from > $2 - 1e-6 - (SELECT g.longest FROM given g)
        AND l.chainage_to > $2 AND l.chainage_from < $3 AND $2 < $3
$$;
COMMENT ON FUNCTION tunnel_api.wet_area(text, float8, float8) IS
'Wet area (m² on the lining) of a survey between two chainages (m), of leaks found last and not rejected.';
