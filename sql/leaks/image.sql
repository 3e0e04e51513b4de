-- Values of the unrolled images. They are stored as GeoTIFF, in blocks of 50 m (tunnel.image), and read with the extension
-- postgis_raster; nothing else needs it.

-- A block is decoded once for all places in it. The scale of its integers is read from GDAL's metadata, which PostGIS
-- ignores. A superuser sets which formats GDAL may read; if the owner is not one, it must be set for the database.
CREATE OR REPLACE FUNCTION tunnel_api.image_values(survey_id int, kind text, chainage float8[], arc float8[])
RETURNS TABLE (n int, value float8)
LANGUAGE plpgsql STABLE STRICT PARALLEL UNSAFE
ROWS 100
SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
#variable_conflict use_column
DECLARE
    kinds constant text[] := ARRAY['raw', 'corrected', 'offset', 'state',
                                   'deviation_lining', 'deviation_shotcrete', 'deviation_excavation'];
    drivers constant text := current_setting('postgis.gdal_enabled_drivers', true);
    survey_key constant int := survey_id;
    wanted constant text := kind;
    x constant float8[] := chainage;
    y constant float8[] := arc;
    found float8[] := array_fill(NULL::float8, ARRAY[cardinality(chainage)]);
    block int;
    place record;
BEGIN
    IF wanted = 'rgb' OR EXISTS (SELECT FROM tunnel.imported_image m
                                  WHERE m.survey_id = survey_key AND 'imported_' || m.name = wanted AND m.colour) THEN
        RAISE EXCEPTION 'image % has colours, not values: read its blocks by tunnel_api.image_tiffs', quote_literal(left(wanted, 40))
            USING ERRCODE = 'invalid_parameter_value';
    END IF;
    IF wanted <> ALL (kinds) AND wanted !~ '^imported_' THEN
        RAISE EXCEPTION 'there is no image %: there are %, imported_NAME', quote_literal(left(wanted, 40)), array_to_string(kinds, ', ')
            USING ERRCODE = 'invalid_parameter_value';
    END IF;
    IF cardinality(x) <> cardinality(y) THEN
        RAISE EXCEPTION '% chainages and % arcs: there must be one arc for each chainage', cardinality(x), cardinality(y)
            USING ERRCODE = 'invalid_parameter_value';
    END IF;
    IF NOT EXISTS (SELECT FROM pg_extension e WHERE e.extname = 'postgis_raster') THEN
        RAISE EXCEPTION 'images are read by the extension postgis_raster, which this database does not have'
            USING ERRCODE = 'undefined_object', HINT = 'A superuser: CREATE EXTENSION postgis_raster SCHEMA public;';
    END IF;
    BEGIN
        PERFORM set_config('postgis.gdal_enabled_drivers', 'GTiff', true);
    EXCEPTION WHEN insufficient_privilege THEN
        NULL;  -- what the database has is tried
    END;
    FOR block IN SELECT DISTINCT floor(p.x / 50)::int FROM unnest(x) AS p (x) WHERE abs(p.x) < 1e8 ORDER BY 1 LOOP
        BEGIN
            -- OFFSET 0: the block is decoded first, and not for each place
            FOR place IN EXECUTE $query$
                SELECT p.n, public.ST_Value(b.image, 1, floor((p.x - b.left) / b.pixel)::int + 1,
                                            floor((b.top - p.y) / b.pixel)::int + 1) * b.scale AS value
                  FROM (SELECT d.image, d.scale, public.ST_UpperLeftX(d.image) AS left, public.ST_UpperLeftY(d.image) AS top,
                               public.ST_ScaleX(d.image) AS pixel, public.ST_Height(d.image) AS height
                          FROM (SELECT public.ST_FromGDALRaster(i.tiff, 0) AS image,
                                       CASE position('role="scale">'::bytea IN i.tiff) WHEN 0 THEN 1
                                            ELSE substring(encode(substring(i.tiff FROM position('role="scale">'::bytea IN i.tiff)
                                                                            FOR 40), 'escape') FROM '>([0-9.e-]+)<')::float8 END AS scale
                                  FROM tunnel.image i
                                 WHERE i.survey_id = $1 AND i.km = floor($3 / 20.0)::int AND i.kind = $2 AND i.block = $3
                                OFFSET 0) d) b
                 CROSS JOIN LATERAL (SELECT q.n::int AS n, q.x, q.y
                                       FROM unnest($4, $5) WITH ORDINALITY AS q (x, y, n)
                                      WHERE floor(q.x / 50) = $3 AND b.top - q.y BETWEEN 0 AND b.height * b.pixel * (1 - 1e-12)
                                     OFFSET 0) p
            $query$ USING survey_key, wanted, block, x, y LOOP
                found[place.n] := place.value;
            END LOOP;
        EXCEPTION WHEN raise_exception OR internal_error OR external_routine_exception THEN
            RAISE EXCEPTION 'the server may not read GeoTIFF: %', SQLERRM
                USING ERRCODE = 'object_not_in_prerequisite_state',
                      HINT = format('A superuser: ALTER DATABASE %I SET postgis.gdal_enabled_drivers = ''GTiff'';', current_database());
        END;
    END LOOP;
    BEGIN
        PERFORM set_config('postgis.gdal_enabled_drivers', coalesce(drivers, 'DISABLE_ALL'), true);
    EXCEPTION WHEN insufficient_privilege THEN
        NULL;
    END;
    RETURN QUERY SELECT p.n, found[p.n] FROM generate_subscripts(found, 1) AS p (n);
END
$$;
COMMENT ON FUNCTION tunnel_api.image_values(int, text, float8[], float8[]) IS
'Values of an unrolled image at places (chainage, arc; m), in their order: dB (raw, corrected), m (offset, deviation_…), the code of the pixel''s state (state), or the values of an imported image (imported_NAME) in its unit; NULL without a measurement or an image. Reads each block of 50 m once. Needs the extension postgis_raster';

CREATE OR REPLACE FUNCTION tunnel_api.image_value(survey_id int, kind text, chainage float8, arc float8)
RETURNS float8
LANGUAGE sql STABLE STRICT PARALLEL UNSAFE
AS $$
    SELECT v.value FROM tunnel_api.image_values($1, $2, ARRAY[$3], ARRAY[$4]) v
$$;
COMMENT ON FUNCTION tunnel_api.image_value(int, text, float8, float8) IS
'Value of an unrolled image (raw, corrected, offset, state, deviation_lining, …, imported_NAME) at one place (chainage, arc; m). Each call reads a block of 50 m: for many places use image_values';


-- Images are partitioned by survey. A generic plan would open the partitions of all surveys: this function plans for the
-- given one.
CREATE OR REPLACE FUNCTION tunnel_internal.image_kilometres(survey_id int, kind text) RETURNS SETOF int
LANGUAGE plpgsql STABLE STRICT PARALLEL SAFE SECURITY DEFINER ROWS 25
SET search_path = pg_catalog, pg_temp
SET plan_cache_mode = force_custom_plan
AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := survey_id;
    wanted constant text := kind;
BEGIN
    RETURN QUERY SELECT i.km FROM tunnel.image i WHERE i.survey_id = survey_key AND i.kind = wanted GROUP BY i.km;
END
$$;
COMMENT ON FUNCTION tunnel_internal.image_kilometres(int, text) IS
    'Kilometres of a survey that have images of a kind: raw, corrected, offset, state, deviation_lining, …';
