-- Values derived from shapes that people draw on the lining, on the unrolled image or on the map strip. Needs roll, unroll
-- and carry_over (geometry/shape.sql).

-- Unrolled coordinates (chainage, arc; SRID 0) of a point of the map strip (tunnel's SRID), from a near chainage: the plane
-- of the axis through the point is found by iteration; each step reduces the error to the ratio of arc to radius of
-- curvature. NULL where there is no axis. Inverse of map_point.
CREATE OR REPLACE FUNCTION tunnel_internal.unmap_point(survey_id int, point geometry, near float8)
RETURNS geometry
LANGUAGE plpgsql STABLE PARALLEL SAFE STRICT
AS $$
DECLARE
    at float8 := near;
    axis public.geometry;
    beside public.geometry;
    right_x float8;
    right_y float8;
    along float8;
BEGIN
    FOR n IN 1..50 LOOP
        axis := tunnel_internal.map_point(survey_id, at, 0);
        beside := tunnel_internal.map_point(survey_id, at, 1);
        IF axis IS NULL THEN
            RETURN NULL;
        END IF;
        right_x := public.ST_X(beside) - public.ST_X(axis);
        right_y := public.ST_Y(beside) - public.ST_Y(axis);
        along := (public.ST_Y(point) - public.ST_Y(axis)) * right_x - (public.ST_X(point) - public.ST_X(axis)) * right_y;
        IF abs(along) < 1e-7 THEN
            RETURN public.ST_MakePoint(at, (public.ST_X(point) - public.ST_X(axis)) * right_x + (public.ST_Y(point) - public.ST_Y(axis)) * right_y);
        END IF;
        at := at + along;
    END LOOP;
    RETURN NULL;
END
$$;
COMMENT ON FUNCTION tunnel_internal.unmap_point(int, geometry, float8) IS
'Unrolled coordinates (chainage, arc; m) of a point of the map strip (tunnel''s SRID), searched from a near chainage; NULL where there is no axis. Inverse of map_point';


CREATE OR REPLACE FUNCTION tunnel_internal.unmap_strip(survey_id int, shape geometry)
RETURNS geometry
LANGUAGE plpgsql STABLE PARALLEL SAFE STRICT
SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
DECLARE
    survey_key constant int := survey_id;
    kind constant text := public.GeometryType(shape);
    middle public.geometry;
    near float8;
    rings public.geometry[];
BEGIN
    PERFORM tunnel_internal.check_shape('the drawing', shape);
    IF kind NOT IN ('POINT', 'LINESTRING', 'POLYGON') THEN
        RAISE EXCEPTION 'a point, a line or a polygon is needed, not a %', kind USING HINT = 'Use ST_Dump for the parts.';
    END IF;
    middle := public.ST_Force2D(public.ST_PointOnSurface(shape));
    SELECT g.chainage_from + public.ST_LineLocatePoint(public.ST_Force2D(g.geom), middle) * (g.chainage_to - g.chainage_from) INTO near
      FROM tunnel.segment g WHERE g.survey_id = survey_key ORDER BY public.ST_Distance(public.ST_Force2D(g.geom), middle) LIMIT 1;
    SELECT array_agg(q.ring ORDER BY q.i) INTO rings
    FROM (SELECT r.i, CASE WHEN bool_or(p.carried IS NULL) THEN NULL
                           WHEN kind = 'POINT' THEN (array_agg(p.carried))[1]
                           ELSE public.ST_MakeLine(p.carried ORDER BY p.j) END AS ring
          FROM (SELECT d.path[1] AS i, public.ST_Segmentize(public.ST_ExteriorRing(d.geom), 1.0) AS line
                FROM public.ST_DumpRings(CASE WHEN kind = 'POLYGON' THEN public.ST_Force2D(shape) END) d
                UNION ALL
                SELECT 0, public.ST_Segmentize(public.ST_Force2D(shape), 1.0) WHERE kind <> 'POLYGON') r
          CROSS JOIN LATERAL (
              SELECT coalesce(v.path[1], 1) AS j, tunnel_internal.unmap_point(survey_key, v.geom, near) AS carried
              FROM public.ST_DumpPoints(r.line) v
              OFFSET 0) p  -- else each mention of carried computes it again
          GROUP BY r.i) q;
    IF rings IS NULL OR array_position(rings, NULL) IS NOT NULL THEN
        RETURN NULL;
    ELSIF kind = 'POLYGON' THEN
        RETURN public.ST_MakePolygon(rings[1], rings[2:]);
    END IF;
    RETURN rings[1];
END
$$;
COMMENT ON FUNCTION tunnel_internal.unmap_strip(int, geometry) IS
'Unrolled plane (chainage, arc; m; SRID 0) of a point, line or polygon of the map strip (tunnel''s SRID). Edges are split into pieces of 1 m. NULL if a vertex lies beyond the ends of the axis. Inverse of map_strip';


-- Clock position of a point on the lining, as in detection: of the ray from the axis to it, more than 0 to 12.
CREATE OR REPLACE FUNCTION tunnel_internal.clock_at(survey_id int, chainage float8, arc float8)
RETURNS float8
LANGUAGE plpgsql STABLE PARALLEL SAFE STRICT
SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
DECLARE
    place constant public.geometry := tunnel_api.roll(survey_id, chainage, arc, 0);
    s tunnel.segment;
    frame float8[];
    hours float8;
BEGIN
    SELECT q.* INTO s FROM tunnel.segment q
    WHERE q.survey_id = clock_at.survey_id AND q.chainage_from <= clock_at.chainage ORDER BY q.chainage_from DESC LIMIT 1;
    IF place IS NULL OR s.n IS NULL THEN
        RETURN NULL;
    END IF;
    frame := tunnel_internal.segment_frame(s.vertex_from || s.vertex_to || s.tangent_from || s.tangent_to,
        (chainage - s.chainage_from) / (s.chainage_to - s.chainage_from));
    hours := degrees(atan2(
        (public.ST_X(place) - frame[1]) * frame[7] + (public.ST_Y(place) - frame[2]) * frame[8] + (public.ST_Z(place) - frame[3]) * frame[9],
        (public.ST_X(place) - frame[1]) * frame[10] + (public.ST_Y(place) - frame[2]) * frame[11] + (public.ST_Z(place) - frame[3]) * frame[12])) / 30;
    RETURN CASE WHEN hours > 0 THEN hours ELSE hours + 12 END;
END
$$;
COMMENT ON FUNCTION tunnel_internal.clock_at(int, float8, float8) IS
'Clock position (hours, more than 0 to 12; 12 is the crown, 3 is right looking up-chainage) of a point of the unrolled plane (m); NULL off the tunnel';


-- A polygon is its own outline. A line has an outline of its width, at least 1 cm; a point one of 5 cm radius: so all can be
-- found, drawn and exported as polygons. The area on the surface is the area in the unrolled plane times the mean stretch of
-- the surface (slope, curve) at 16 places.
CREATE OR REPLACE FUNCTION tunnel_internal.drawn_figures(
    survey_id int, drawn geometry, width_mm float8,
    OUT km int, OUT chainage_from float8, OUT chainage_to float8, OUT arc_from float8, OUT arc_to float8, OUT clock float8,
    OUT area float8, OUT length float8, OUT unrolled geometry, OUT map geometry, OUT surface geometry,
    OUT shape geometry, OUT shape_map geometry, OUT shape_surface geometry)
LANGUAGE plpgsql STABLE PARALLEL SAFE CALLED ON NULL INPUT
SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
#variable_conflict use_variable
DECLARE
    given constant public.geometry := public.ST_SetSRID(public.ST_Force2D(
        CASE WHEN public.ST_NumGeometries(drawn) = 1 THEN public.ST_GeometryN(drawn, 1) ELSE drawn END), 0);
    kind constant text := public.GeometryType(given);
    step constant float8 := 0.01;
    middle public.geometry;
BEGIN
    IF given IS NULL OR public.ST_IsEmpty(given) THEN
        RAISE EXCEPTION 'a finding needs a place: a polygon, a line or a point' USING ERRCODE = 'null_value_not_allowed';
    ELSIF kind NOT IN ('POINT', 'LINESTRING', 'POLYGON') THEN
        RAISE EXCEPTION 'a finding is one polygon, line or point, not a %', lower(kind) USING ERRCODE = 'invalid_parameter_value';
    ELSIF NOT (public.ST_XMin(given) > '-Infinity' AND public.ST_XMax(given) < 'Infinity' AND public.ST_YMin(given) > '-Infinity'
               AND public.ST_YMax(given) < 'Infinity') THEN
        RAISE EXCEPTION 'the drawing has a coordinate that is no finite number' USING ERRCODE = 'invalid_parameter_value';
    ELSIF kind = 'POLYGON' AND NOT public.ST_IsValid(given) OR kind = 'LINESTRING' AND public.ST_Length(given) = 0 THEN
        RAISE EXCEPTION 'the drawing is not valid: %', CASE kind WHEN 'POLYGON' THEN public.ST_IsValidReason(given) ELSE 'no length' END
            USING ERRCODE = 'invalid_parameter_value';
    END IF;
    unrolled := CASE kind WHEN 'POLYGON' THEN given
                          WHEN 'LINESTRING' THEN public.ST_Buffer(given, greatest(width_mm / 1000, 0.01) / 2, 'endcap=flat join=mitre')
                          ELSE public.ST_Buffer(given, 0.05, 'quad_segs=4') END;
    surface := tunnel_api.roll(survey_id, unrolled);
    IF surface IS NULL AND kind <> 'POLYGON' THEN  -- at the very edge of the lining
        unrolled := public.ST_Buffer(given, 1e-4, 'endcap=flat join=mitre');
        surface := tunnel_api.roll(survey_id, unrolled);
    END IF;
    map := tunnel_api.map_strip(survey_id, unrolled);
    IF surface IS NULL OR map IS NULL THEN
        RAISE EXCEPTION 'the drawing reaches beyond the lining: it lies between chainage % and % m, arc % and % m',
            round(public.ST_XMin(given)::numeric, 2), round(public.ST_XMax(given)::numeric, 2), round(public.ST_YMin(given)::numeric, 2),
            round(public.ST_YMax(given)::numeric, 2) USING ERRCODE = 'invalid_parameter_value';
    END IF;
    middle := CASE kind WHEN 'POLYGON' THEN CASE WHEN public.ST_Contains(given, public.ST_Centroid(given)) THEN public.ST_Centroid(given)
                                                   ELSE public.ST_PointOnSurface(given) END WHEN 'POINT' THEN given
                        ELSE public.ST_LineInterpolatePoint(given, 0.5) END;
    IF kind = 'POLYGON' THEN
        SELECT public.ST_Area(given)
               * coalesce(avg(sqrt((l.y * c.z - l.z * c.y) ^ 2 + (l.z * c.x - l.x * c.z) ^ 2 + (l.x * c.y - l.y * c.x) ^ 2)), 1)
          INTO area
          FROM public.ST_Dump(public.ST_GeneratePoints(given, 16, 1)) d
         CROSS JOIN LATERAL (
            SELECT tunnel_api.roll(survey_id, public.ST_X(d.geom), public.ST_Y(d.geom)) AS here,
                   tunnel_api.roll(survey_id, public.ST_X(d.geom) + step, public.ST_Y(d.geom)) AS along,
                   tunnel_api.roll(survey_id, public.ST_X(d.geom), public.ST_Y(d.geom) + step) AS across
            OFFSET 0) p  -- else each mention of here, along and across computes it again
         CROSS JOIN LATERAL (
            SELECT (public.ST_X(p.along) - public.ST_X(p.here)) / step AS x, (public.ST_Y(p.along) - public.ST_Y(p.here)) / step AS y,
                   (public.ST_Z(p.along) - public.ST_Z(p.here)) / step AS z) l
         CROSS JOIN LATERAL (
            SELECT (public.ST_X(p.across) - public.ST_X(p.here)) / step AS x, (public.ST_Y(p.across) - public.ST_Y(p.here)) / step AS y,
                   (public.ST_Z(p.across) - public.ST_Z(p.here)) / step AS z) c;
    ELSE
        shape := given;
        shape_map := tunnel_api.map_strip(survey_id, given);
        shape_surface := tunnel_api.roll(survey_id, given);
        length := CASE kind WHEN 'LINESTRING' THEN public.ST_3DLength(shape_surface) END;
        area := coalesce(length * width_mm / 1000, 0);
    END IF;
    chainage_from := public.ST_XMin(unrolled);
    chainage_to := public.ST_XMax(unrolled);
    arc_from := public.ST_YMin(unrolled);
    arc_to := public.ST_YMax(unrolled);
    km := floor((chainage_from + chainage_to) / 2000);
    clock := tunnel_internal.clock_at(survey_id, public.ST_X(middle), public.ST_Y(middle));
END
$$;
COMMENT ON FUNCTION tunnel_internal.drawn_figures(int, geometry, float8) IS
'Values derived from a polygon, a line (with its width, mm) or a point drawn in the unrolled plane (chainage, arc; m): kilometre and clock position of the middle, extent, area and length on the surface, outline and three geometries. Raises an error if the shape is invalid or extends beyond the lining';
