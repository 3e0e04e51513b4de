-- Lines and polygons between space, the unrolled plane and the map, transformed vertex by vertex after splitting long edges.

-- Key of a survey, by its name.
CREATE OR REPLACE FUNCTION tunnel_api.survey_id(survey text)
RETURNS int
LANGUAGE plpgsql STABLE PARALLEL SAFE STRICT
SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
DECLARE
    found int;
BEGIN
    SELECT s.id INTO found FROM tunnel.survey s WHERE s.name = survey;
    IF found IS NULL THEN
        RAISE EXCEPTION 'there is no survey %', left(survey, 63) USING HINT = 'SELECT name FROM tunnel_api.survey';
    END IF;
    RETURN found;
END
$$;
COMMENT ON FUNCTION tunnel_api.survey_id(text) IS 'Key of a survey, by its name. Raises an error if there is none';


-- Transform each vertex of a point, line or polygon: 'roll' (unrolled plane to surface), 'map' (unrolled plane to map strip)
-- or 'unroll' (space to unrolled plane). Edges are split into pieces of at most step metres first, so that they follow the
-- surface. NULL if a vertex lies off the tunnel.
CREATE OR REPLACE FUNCTION tunnel_internal.carry_over(survey_id int, shape geometry, way text, step float8)
RETURNS geometry
LANGUAGE plpgsql STABLE PARALLEL SAFE STRICT
AS $$
DECLARE
    kind constant text := public.GeometryType(shape);
    rings public.geometry[];
BEGIN
    PERFORM tunnel_internal.check_shape('the shape', shape);
    IF kind NOT IN ('POINT', 'LINESTRING', 'POLYGON') THEN
        RAISE EXCEPTION 'a point, a line or a polygon is needed, not a %', kind USING HINT = 'Use ST_Dump for the parts.';
    END IF;
    SELECT array_agg(q.ring ORDER BY q.i) INTO rings
    FROM (SELECT r.i, CASE WHEN bool_or(p.carried IS NULL) THEN NULL
                           WHEN kind = 'POINT' THEN (array_agg(p.carried))[1]
                           ELSE public.ST_MakeLine(p.carried ORDER BY p.j) END AS ring
          FROM (SELECT d.path[1] AS i, public.ST_Segmentize(public.ST_ExteriorRing(d.geom), step) AS line
                FROM public.ST_DumpRings(CASE WHEN kind = 'POLYGON' THEN shape END) d
                UNION ALL
                SELECT 0, public.ST_Segmentize(shape, step) WHERE kind <> 'POLYGON') r
          CROSS JOIN LATERAL (
              SELECT coalesce(v.path[1], 1) AS j,
                  CASE way
                      WHEN 'roll' THEN tunnel_api.roll(survey_id, public.ST_X(v.geom), public.ST_Y(v.geom))
                      WHEN 'map' THEN tunnel_internal.map_point(survey_id, public.ST_X(v.geom), public.ST_Y(v.geom))
                      WHEN 'unroll' THEN (SELECT public.ST_MakePoint(u.chainage, u.arc) FROM tunnel_api.unroll(survey_id, v.geom) u)
                  END AS carried
              FROM public.ST_DumpPoints(r.line) v
              OFFSET 0) p  -- else each mention of carried computes it again
          GROUP BY r.i) q;
    IF array_position(rings, NULL) IS NOT NULL THEN
        RETURN NULL;
    ELSIF kind = 'POLYGON' THEN
        RETURN public.ST_MakePolygon(rings[1], rings[2:]);
    END IF;
    RETURN rings[1];
END
$$;
COMMENT ON FUNCTION tunnel_internal.carry_over(int, geometry, text, float8) IS
'Transform a point, line or polygon vertex by vertex. way: roll (unrolled plane to surface), map (unrolled plane to map strip) or unroll (space to unrolled plane). Edges are split into pieces of step metres first. NULL if a vertex lies off the tunnel';


CREATE OR REPLACE FUNCTION tunnel_api.roll(survey_id int, unrolled geometry)
RETURNS geometry
LANGUAGE sql STABLE PARALLEL SAFE STRICT
AS $$ SELECT tunnel_internal.carry_over(survey_id, unrolled, 'roll', 0.1) $$;
COMMENT ON FUNCTION tunnel_api.roll(int, geometry) IS
'Point, line or polygon of the unrolled plane (chainage, arc; m) on the tunnel''s surface: 3D, tunnel''s SRID. NULL if any part lies off the tunnel';


CREATE OR REPLACE FUNCTION tunnel_api.map_strip(survey_id int, unrolled geometry)
RETURNS geometry
LANGUAGE sql STABLE PARALLEL SAFE STRICT
AS $$ SELECT tunnel_internal.carry_over(survey_id, unrolled, 'map', 1.0) $$;
COMMENT ON FUNCTION tunnel_api.map_strip(int, geometry) IS
'Point, line or polygon of the unrolled plane (chainage, arc; m) on the map beside the axis, tunnel''s SRID. Source: Gonçalves et al. (2012), eq. 1';


CREATE OR REPLACE FUNCTION tunnel_api.unroll_shape(survey_id int, shape geometry)
RETURNS geometry
LANGUAGE sql STABLE PARALLEL SAFE STRICT
AS $$ SELECT tunnel_internal.carry_over(survey_id, shape, 'unroll', 0.1) $$;
COMMENT ON FUNCTION tunnel_api.unroll_shape(int, geometry) IS
'Point, line or polygon in space (3D, tunnel''s SRID) in the unrolled plane (chainage, arc; m; SRID 0). NULL if any part lies off the tunnel';
