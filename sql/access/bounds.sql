-- Bounds of the values that people can write through views and functions. Triggers call these checks first, before a value is
-- copied or computed with. Constraints of the tables repeat them for numbers and texts, because operators own the tables.

-- Text of a person as part of a message: one line of at most 60 characters.
CREATE OR REPLACE FUNCTION tunnel_internal.excerpt(value text) RETURNS text
LANGUAGE sql IMMUTABLE PARALLEL SAFE STRICT SET search_path = pg_catalog, pg_temp AS $$
    SELECT regexp_replace(left($1, 60), '[[:cntrl:]]', '?', 'g') || CASE WHEN length($1) > 60 THEN '…' ELSE '' END
$$;
COMMENT ON FUNCTION tunnel_internal.excerpt(text) IS 'First 60 characters of a text without control characters, for messages';

CREATE OR REPLACE FUNCTION tunnel_internal.check_text(what text, value text, most int) RETURNS void
LANGUAGE plpgsql IMMUTABLE PARALLEL SAFE STRICT SET search_path = pg_catalog, pg_temp AS $$
BEGIN
    IF length(value) > most THEN
        RAISE EXCEPTION '% has % characters, more than %', what, length(value), most USING ERRCODE = 'string_data_right_truncation';
    END IF;
END
$$;
COMMENT ON FUNCTION tunnel_internal.check_text(text, text, int) IS 'Raise an error if a text has more characters than a number';

-- Any coordinate is within 100,000 km, so that no computation with it overflows. The number of vertices is checked first: all
-- others read each vertex.
CREATE OR REPLACE FUNCTION tunnel_internal.check_coordinates(what text, shape geometry) RETURNS void
LANGUAGE plpgsql IMMUTABLE PARALLEL SAFE STRICT SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    most_vertices constant int := 20000;
    most constant float8 := 1e8;  -- m
    worst float8;
BEGIN
    IF public.GeometryType(shape) NOT IN ('POINT', 'LINESTRING', 'POLYGON', 'MULTIPOINT', 'MULTILINESTRING', 'MULTIPOLYGON') THEN
        RAISE EXCEPTION '% is a %, not a point, a line or a polygon', what, lower(public.GeometryType(shape))
            USING ERRCODE = 'invalid_parameter_value';
    ELSIF public.ST_NPoints(shape) > most_vertices THEN
        RAISE EXCEPTION '% has % vertices, more than %', what, public.ST_NPoints(shape), most_vertices
            USING ERRCODE = 'invalid_parameter_value', HINT = 'Simplify it (ST_Simplify).';
    END IF;
    SELECT c.value INTO worst
      FROM public.ST_DumpPoints(shape) d
     CROSS JOIN LATERAL (VALUES (public.ST_X(d.geom)), (public.ST_Y(d.geom)), (coalesce(public.ST_Z(d.geom), 0))) AS c (value)
     WHERE c.value NOT BETWEEN -most AND most LIMIT 1;
    IF FOUND THEN
        RAISE EXCEPTION '% has the coordinate %, which is not between % and % m', what, worst, -most::int, most::int
            USING ERRCODE = 'invalid_parameter_value';
    END IF;
END
$$;
COMMENT ON FUNCTION tunnel_internal.check_coordinates(text, geometry) IS
    'Raise an error unless a geometry is a point, a line or a polygon of at most 20,000 vertices with finite coordinates, in metres';

-- Shapes that are transformed to another plane, piece by piece.
CREATE OR REPLACE FUNCTION tunnel_internal.check_shape(what text, shape geometry) RETURNS void
LANGUAGE plpgsql IMMUTABLE PARALLEL SAFE STRICT SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    most constant float8 := 5000;  -- m: 50,000 pieces on the lining
    length float8;
BEGIN
    PERFORM tunnel_internal.check_coordinates(what, shape);
    length := public.ST_Length(shape) + public.ST_Perimeter(shape);
    IF length > most THEN
        RAISE EXCEPTION '% is % m long, more than % m', what, round(length::numeric), most USING ERRCODE = 'invalid_parameter_value';
    END IF;
END
$$;
COMMENT ON FUNCTION tunnel_internal.check_shape(text, geometry) IS
    'Raise an error as check_coordinates does, and for a line or an outline of more than 5,000 m';

-- Review and remark of a finding or a spot.
CREATE OR REPLACE FUNCTION tunnel_internal.check_review(what text, review text, remark text) RETURNS void
LANGUAGE plpgsql IMMUTABLE PARALLEL SAFE CALLED ON NULL INPUT SET search_path = pg_catalog, pg_temp AS $$
BEGIN
    IF review IS NULL OR review NOT IN ('open', 'confirmed', 'rejected') THEN
        RAISE EXCEPTION 'the review of % can be open, confirmed or rejected, not %', what,
            coalesce(tunnel_internal.excerpt(review), 'empty') USING ERRCODE = 'check_violation';
    END IF;
    PERFORM tunnel_internal.check_text('the remark', remark, 10000);
END
$$;
COMMENT ON FUNCTION tunnel_internal.check_review(text, text, text) IS
    'Raise an error unless a review is valid and a remark has at most 10,000 characters';
