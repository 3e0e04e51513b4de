-- What the desk in a browser (tunneldb serve) reads of a survey: image blocks, the ribbon of the whole tunnel, and vector tiles of
-- findings. Needs stretch_statistics (leaks/statistics.sql).

-- Images are partitioned by survey. A generic plan would open the partitions of all surveys.
CREATE OR REPLACE FUNCTION tunnel_api.image_versions(survey_id int, kind text, first_block int, last_block int)
RETURNS TABLE (block int, version bigint)
LANGUAGE plpgsql STABLE STRICT PARALLEL SAFE SECURITY DEFINER ROWS 20
SET search_path = pg_catalog, pg_temp
SET plan_cache_mode = force_custom_plan
AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := survey_id;
    wanted constant text := kind;
BEGIN
    RETURN QUERY SELECT i.block, i.xmin::text::bigint FROM tunnel.image i
                  WHERE i.survey_id = survey_key AND i.kind = wanted AND i.block BETWEEN first_block AND last_block
                    AND i.km BETWEEN floor(first_block / 20.0) AND floor(last_block / 20.0) ORDER BY i.block;
END
$$;
COMMENT ON FUNCTION tunnel_api.image_versions(int, text, int, int) IS
'Blocks of 50 m of an unrolled image that exist, from a first to a last one (floor(chainage / 50)), each with a number that changes if the block is written again. Kinds are those of image_value, and overview_KIND: one image of a kilometre with pixels of about 0.4 m, under the number of its first block';

CREATE OR REPLACE FUNCTION tunnel_api.image_tiffs(survey_id int, kind text, blocks int[])
RETURNS TABLE (block int, tiff bytea)
LANGUAGE plpgsql STABLE STRICT PARALLEL SAFE SECURITY DEFINER ROWS 5
SET search_path = pg_catalog, pg_temp
SET plan_cache_mode = force_custom_plan
AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := survey_id;
    wanted constant text := kind;
    chosen constant int[] := blocks;
BEGIN
    RETURN QUERY SELECT i.block, i.tiff FROM tunnel.image i
                  WHERE i.survey_id = survey_key AND i.kind = wanted AND i.block = ANY (chosen)
                    AND i.km = ANY (SELECT floor(b / 20.0)::int FROM unnest(chosen) AS b) ORDER BY i.block;
END
$$;
COMMENT ON FUNCTION tunnel_api.image_tiffs(int, text, int[]) IS
'Blocks of an unrolled image as GeoTIFF in the unrolled plane (chainage, arc; m), by their numbers (image_versions): 16-bit integers with a scale, in dB, m, or the unit of an imported image; red, green and blue of 8 bits of an image in colour';

CREATE OR REPLACE FUNCTION tunnel_api.image_kinds(survey_id int)
RETURNS SETOF text
LANGUAGE plpgsql STABLE STRICT PARALLEL SAFE SECURITY DEFINER ROWS 10
SET search_path = pg_catalog, pg_temp
SET plan_cache_mode = force_custom_plan
AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := survey_id;
BEGIN
    RETURN QUERY SELECT DISTINCT i.kind FROM tunnel.image i WHERE i.survey_id = survey_key ORDER BY 1;
END
$$;
COMMENT ON FUNCTION tunnel_api.image_kinds(int) IS
'Kinds of the unrolled images of a survey: raw, corrected, offset, rgb, state, deviation_…, imported_NAME, and their overviews (image_versions)';

CREATE OR REPLACE FUNCTION tunnel_api.ribbon(survey_id int, chainage_from float8, chainage_to float8, bins int)
RETURNS TABLE (n int, seen_share float8, wet_area float8, findings jsonb, reviewed int, probability float8,
    layer text, deviation_least float8, deviation_greatest float8)
LANGUAGE plpgsql STABLE STRICT PARALLEL SAFE SECURITY DEFINER ROWS 1000
SET search_path = pg_catalog, pg_temp
SET jit = off
AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := survey_id;
    low constant float8 := chainage_from;
    step constant float8 := (chainage_to - chainage_from) / bins;
    count constant int := bins;
BEGIN
    PERFORM tunnel_internal.in_order(chainage_from, chainage_to);
    IF count NOT BETWEEN 1 AND 2000 OR NOT step > 0 THEN
        RAISE EXCEPTION 'a ribbon has 1 to 2000 bins and a length above 0' USING ERRCODE = 'invalid_parameter_value';
    END IF;
    RETURN QUERY
    WITH place AS MATERIALIZED (
        SELECT least(floor(((a.chainage_from + a.chainage_to) / 2 - low) / step)::int + 1, count) AS n,
               coalesce(a.kind_override, a.kind) AS kind, a.review
          FROM tunnel.finding a
         WHERE a.survey_id = survey_key AND a.detected AND a.review <> 'rejected' AND NOT a.superseded
    ), kinds AS (
        SELECT c.n, jsonb_object_agg(c.kind, c.number) AS findings
          FROM (SELECT p.n, p.kind, count(*) AS number FROM place p GROUP BY p.n, p.kind) c GROUP BY c.n
    ), reviews AS (
        SELECT p.n, count(*) FILTER (WHERE p.review <> 'open')::int AS reviewed FROM place p GROUP BY p.n
    ), found AS (
        SELECT g.n, sum(d.probability * d.lining_area) / nullif(sum(d.lining_area) FILTER (WHERE d.probability IS NOT NULL), 0) AS probability
          FROM tunnel.detectability d
         CROSS JOIN LATERAL generate_series(greatest(floor((d.chainage_from - low) / step)::int + 1, 1),
                                            least(ceil((d.chainage_to - low) / step)::int, count)) AS g (n)
         WHERE d.survey_id = survey_key
         GROUP BY g.n
    ), deviations AS (
        SELECT g.n, min(d.layer) AS layer, min(d.deviation_least) AS least, max(d.deviation_greatest) AS greatest
          FROM tunnel.deviation_section d
         CROSS JOIN LATERAL generate_series(greatest(floor((d.chainage_from - low) / step)::int + 1, 1),
                                            least(ceil((d.chainage_to - low) / step)::int, count)) AS g (n)
         WHERE d.survey_id = survey_key AND d.layer = (
                SELECT o.layer FROM unnest(ARRAY['lining', 'shotcrete', 'excavation']) WITH ORDINALITY AS o (layer, place)
                 WHERE EXISTS (SELECT FROM tunnel.deviation_section e WHERE e.survey_id = survey_key AND e.layer = o.layer)
                 ORDER BY o.place LIMIT 1)
         GROUP BY g.n
    )
    SELECT t.n, t.seen_share, t.wet_area, coalesce(k.findings, '{}'), coalesce(r.reviewed, 0), f.probability,
           v.layer, v.least, v.greatest
      FROM tunnel_internal.stretch_statistics(survey_key,
                (SELECT array_agg(low + (b - 1) * step ORDER BY b) FROM generate_series(1, count) b),
                (SELECT array_agg(low + b * step ORDER BY b) FROM generate_series(1, count) b)) t
      LEFT JOIN kinds k ON k.n = t.n
      LEFT JOIN reviews r ON r.n = t.n
      LEFT JOIN found f ON f.n = t.n
      LEFT JOIN deviations v ON v.n = t.n
     ORDER BY t.n;
END
$$;
COMMENT ON FUNCTION tunnel_api.ribbon(int, float8, float8, int) IS
'A survey from one chainage to another in bins of one length: inspected share and wet area as in leak_statistics (NULL where leaks were not searched for), number of the findings that count by kind and how many of them are reviewed (by their middle), mean probability of finding the leaks of the demand (detectability), and smallest and greatest deviation from the design, m, of the first of the layers lining, shotcrete and excavation that was measured';

-- A far tile shows places with findings, a near one outlines.
CREATE OR REPLACE FUNCTION tunnel_api.finding_tile(
    survey_id int, west float8, south float8, east float8, north float8, outlines boolean)
RETURNS bytea
LANGUAGE plpgsql STABLE STRICT PARALLEL SAFE SECURITY DEFINER
SET search_path = pg_catalog, pg_temp
SET jit = off
AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := survey_id;
    frame constant public.box2d := public.ST_MakeBox2D(public.ST_MakePoint(west, south), public.ST_MakePoint(east, north));
    margin constant float8 := (east - west) / 16;
    cell constant float8 := (east - west) / 32;
BEGIN
    IF NOT outlines THEN
        RETURN (
            WITH place AS (
                SELECT floor((a.chainage_from + a.chainage_to) / 2 / cell) AS i, floor((a.arc_from + a.arc_to) / 2 / cell) AS k,
                       coalesce(a.kind_override, a.kind) AS kind, a.review, a.id,
                       tunnel_api.leak_probability(a.kind, a.confidence, a.wet) AS probability, a.wet
                  FROM tunnel.finding a
                 WHERE a.survey_id = survey_key AND a.chainage_to > west AND a.chainage_from < east
                   AND (a.chainage_from + a.chainage_to) / 2 >= west AND (a.chainage_from + a.chainage_to) / 2 < east
                   AND (a.arc_from + a.arc_to) / 2 >= south AND (a.arc_from + a.arc_to) / 2 < north
                   AND a.detected AND a.review <> 'rejected' AND NOT a.superseded
            ), grouped AS (
                SELECT min(p.id) AS id, count(*)::int AS count, bool_or(p.wet) AS wet, max(p.probability) AS probability,
                       mode() WITHIN GROUP (ORDER BY p.kind) AS kind,
                       CASE WHEN bool_or(p.review = 'open') THEN 'open' ELSE 'confirmed' END AS review,
                       CASE WHEN bool_or(p.review = 'open') THEN 'open' ELSE 'confirmed' END AS state,
                       public.ST_AsMVTGeom(public.ST_MakePoint((p.i + 0.5) * cell, (p.k + 0.5) * cell), frame, 4096, 64, false) AS geom
                  FROM place p GROUP BY p.i, p.k)
            SELECT public.ST_AsMVT(g, 'findings', 4096, 'geom') FROM grouped g);
    END IF;
    RETURN (
        WITH shown AS (
            SELECT a.id, coalesce(a.kind_override, a.kind) AS kind, a.review, a.wet,
                   tunnel_internal.finding_state_name(
                       a.review, a.merged_into IS NOT NULL, a.same_as IS NOT NULL, a.superseded, a.detected) AS state,
                   tunnel_api.leak_probability(a.kind, a.confidence, a.wet) AS probability,
                   public.ST_AsMVTGeom(coalesce(a.shape, a.unrolled), frame, 4096, 256, true) AS geom
              FROM tunnel.finding a
             WHERE a.survey_id = survey_key AND a.chainage_to > west - margin AND a.chainage_from < east + margin
               AND a.arc_to > south - margin AND a.arc_from < north + margin
               AND a.merged_into IS NULL AND a.same_as IS NULL
             ORDER BY a.area DESC, a.id LIMIT 5000)
        SELECT public.ST_AsMVT(s, 'findings', 4096, 'geom', 'id') FROM shown s WHERE s.geom IS NOT NULL);
END
$$;
COMMENT ON FUNCTION tunnel_api.finding_tile(int, float8, float8, float8, float8, boolean) IS
'Findings in a rectangle of the unrolled plane (chainage, arc; m) as a vector tile (MVT), layer findings: outlines of at most 5000, the largest; or, without outlines, one point for each group in a raster of 32 × 32 with its number (count)';

CREATE OR REPLACE FUNCTION tunnel_api.segment_planes(survey_id int, chainage_from float8, chainage_to float8)
RETURNS TABLE (n int, first float8, last float8, planes float8[])
LANGUAGE sql STABLE STRICT PARALLEL SAFE SECURITY DEFINER ROWS 10
SET search_path = pg_catalog, pg_temp
AS $$
    SELECT g.n, g.chainage_from, g.chainage_to, g.vertex_from || g.vertex_to || g.tangent_from || g.tangent_to
      FROM tunnel.segment g
     WHERE g.survey_id = $1 AND g.chainage_to >= $2 AND g.chainage_from <= $3 AND tunnel_internal.in_order($2, $3)
     ORDER BY g.n
$$;
COMMENT ON FUNCTION tunnel_api.segment_planes(int, float8, float8) IS
'Segments between two chainages: number, chainages (m) of their two planes, and these: vertices and tangents of the measured axis, each first and last (x, y, z)';

-- Each point is kept or not by the hash of its place in the table, so that scans of any number of workers choose the same points.
CREATE OR REPLACE FUNCTION tunnel_api.point_sample(survey_id int, chainage_from float8, chainage_to float8, max_points int)
RETURNS TABLE (x float8, y float8, z float8, intensity float4, class smallint, total bigint)
LANGUAGE plpgsql STABLE STRICT PARALLEL SAFE SECURITY DEFINER ROWS 100000
SET search_path = pg_catalog, pg_temp
SET plan_cache_mode = force_custom_plan
SET jit = off
AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := survey_id;
    low constant float8 := chainage_from;
    high constant float8 := chainage_to;
    km_low constant int := greatest(floor((chainage_from - 50) / 1000), -1e6);
    km_high constant int := least(floor((chainage_to + 50) / 1000), 1e6);
    count bigint;
    hashes bigint;
BEGIN
    PERFORM tunnel_internal.in_order(chainage_from, chainage_to);
    IF max_points NOT BETWEEN 1000 AND 1000000 OR NOT high - low <= 50 THEN
        RAISE EXCEPTION 'a sample has 1000 to 1000000 points of at most 50 m' USING ERRCODE = 'invalid_parameter_value';
    END IF;
    SELECT count(*) INTO count FROM tunnel.point p
     WHERE p.survey_id = survey_key AND p.km BETWEEN km_low AND km_high AND p.chainage >= low AND p.chainage < high;
    -- four standard deviations fewer than may come: the limit itself would cut off the end of the stretch
    hashes := CASE WHEN count <= max_points THEN 1 ELSE (max_points - 4 * sqrt(max_points)) / count END * 4294967296;
    RETURN QUERY
    SELECT public.ST_X(p.geom), public.ST_Y(p.geom), public.ST_Z(p.geom), p.intensity, coalesce(p.class, 0::smallint), count
      FROM tunnel.point p
     WHERE p.survey_id = survey_key AND p.km BETWEEN km_low AND km_high AND p.chainage >= low AND p.chainage < high
       AND hashtid(p.ctid) + 2147483648 < hashes
     LIMIT max_points;
END
$$;
COMMENT ON FUNCTION tunnel_api.point_sample(int, float8, float8, int) IS
'Points of at most 50 m of a survey, thinned evenly to at most max_points. total: number of points of the stretch. Intensity as in the file; class 0: not classified';
