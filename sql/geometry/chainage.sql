-- Chainage as text.

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
'Chainage (m) as text, km + m with mm: 12345.678 → 12+345.678';


-- Inverse: '12+345.678', '12+345', '-0+005' or plain metres ('12345.678') → m. Anything else is an error.
CREATE OR REPLACE FUNCTION tunnel_api.chainage_parse(label text)
RETURNS float8
LANGUAGE plpgsql IMMUTABLE STRICT PARALLEL SAFE
SET search_path = pg_catalog, pg_temp
AS $$
DECLARE
    part text[];
    given constant text := CASE WHEN length(label) <= 40 THEN btrim(label) END;
BEGIN
    part := regexp_match(given, '^(-?)(\d+)\+(\d{3}(?:\.\d*)?)$');
    IF part IS NOT NULL THEN
        RETURN ((part[1] || '1')::numeric * (part[2]::numeric * 1000 + part[3]::numeric))::float8;
    END IF;
    part := regexp_match(given, '^(-?\d+(?:\.\d*)?)$');
    IF part IS NOT NULL THEN
        RETURN part[1]::float8;
    END IF;
    RAISE EXCEPTION '"%" is no chainage: write 12+345.678 or metres', left(label, 40) USING ERRCODE = 'invalid_text_representation';
END
$$;
COMMENT ON FUNCTION tunnel_api.chainage_parse(text) IS
'Chainage (m) from text: 12+345.678 → 12345.678. Plain metres are accepted';


-- Check of functions over a stretch or a range of kilometres: a reversed range would silently be empty.
CREATE OR REPLACE FUNCTION tunnel_internal.in_order(first float8, last float8, unit text DEFAULT 'm')
RETURNS boolean
LANGUAGE plpgsql IMMUTABLE STRICT PARALLEL SAFE
SET search_path = pg_catalog, pg_temp
AS $$
BEGIN
    IF first <= last AND last < 'NaN' THEN
        RETURN true;
    END IF;
    RAISE EXCEPTION '%', CASE WHEN 'NaN' IN (first, last) THEN format('from %s to %s %s is no stretch', first, last, unit)
        ELSE format('from %s to %s %s runs backwards: give the smaller one first', first, last, unit) END
        USING ERRCODE = 'invalid_parameter_value';
END
$$;
COMMENT ON FUNCTION tunnel_internal.in_order(float8, float8, text) IS
'Return true; raise an error if the end of a stretch (m) or of a range of kilometres is smaller than its beginning';
