-- Stage 5 of Gonçalves et al. (2012): transformation between space and the unrolled plane. The same steps as
-- tunneldb/geometry/unrolling.py.

-- The two sections between which a chainage lies: radius and arc at 361 nodes, m, and the weight of the second one. NULL if no
-- section is near. Two sections are neighbours if at most one vertex spacing apart; the last one extends for half of that.
CREATE OR REPLACE FUNCTION tunnel_internal.section_pair(
    survey_id int, chainage float8, OUT radius_a float8[], OUT radius_b float8[], OUT arc_a float8[], OUT arc_b float8[],
    OUT weight float8)
LANGUAGE plpgsql STABLE PARALLEL SAFE STRICT
SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
DECLARE
    reach float8;
    a tunnel.section;
    b tunnel.section;
BEGIN
    SELECT t.spacing INTO reach
    FROM tunnel.survey s JOIN tunnel.tunnel t ON t.id = s.tunnel_id WHERE s.id = section_pair.survey_id;
    SELECT s.* INTO a FROM tunnel.section s
    WHERE s.survey_id = section_pair.survey_id AND s.chainage <= section_pair.chainage ORDER BY s.chainage DESC LIMIT 1;
    SELECT s.* INTO b FROM tunnel.section s
    WHERE s.survey_id = section_pair.survey_id AND s.chainage > section_pair.chainage ORDER BY s.chainage LIMIT 1;
    weight := 0;
    IF a.chainage IS NOT NULL AND b.chainage - a.chainage <= reach THEN
        weight := (section_pair.chainage - a.chainage) / (b.chainage - a.chainage);
    ELSIF section_pair.chainage - a.chainage <= reach / 2 THEN
        b := a;
    ELSIF b.chainage - section_pair.chainage <= reach / 2 THEN
        a := b;
    ELSE
        RETURN;
    END IF;
    radius_a := a.radius;
    radius_b := b.radius;
    arc_a := a.arc;
    arc_b := b.arc;
END
$$;
COMMENT ON FUNCTION tunnel_internal.section_pair(int, float8) IS
'The two sections between which a chainage lies: radius and arc (m) at each degree from -180° to 180°, and the weight of the second one, 0 to 1; NULL if no section is near';


-- Section at a chainage, interpolated between its neighbours: radius and arc at 361 nodes, m. NULL if no section is near.
CREATE OR REPLACE FUNCTION tunnel_api.section_at(survey_id int, chainage float8, OUT radius float8[], OUT arc float8[])
LANGUAGE sql STABLE PARALLEL SAFE STRICT
AS $$
    SELECT array_agg((1 - p.weight) * q.ra + p.weight * q.rb ORDER BY q.i),
           array_agg((1 - p.weight) * q.la + p.weight * q.lb ORDER BY q.i)
      FROM tunnel_internal.section_pair($1, $2) p
     CROSS JOIN LATERAL unnest(p.radius_a, p.radius_b, p.arc_a, p.arc_b) WITH ORDINALITY AS q (ra, rb, la, lb, i)
$$;
COMMENT ON FUNCTION tunnel_api.section_at(int, float8) IS
'Section at a chainage, interpolated between its neighbours: radius and arc (m) at each degree from -180° to 180°; NULL if no section is near';


-- Node of the section between two others (modulo 360) and the unit direction of the section there, towards increasing angle:
-- u, w, du, dw. Only the nodes that a point needs are interpolated: all 361 would take ten times as long.
CREATE OR REPLACE FUNCTION tunnel_internal.section_node(radius_a float8[], radius_b float8[], weight float8, k int)
RETURNS float8[]
LANGUAGE plpgsql IMMUTABLE PARALLEL SAFE STRICT
AS $$
DECLARE
    i constant int := (k + 360) % 360;
    here constant float8 := (1 - weight) * radius_a[i + 1] + weight * radius_b[i + 1];
    before constant float8 := (1 - weight) * radius_a[(i + 359) % 360 + 1] + weight * radius_b[(i + 359) % 360 + 1];
    after constant float8 := (1 - weight) * radius_a[(i + 1) % 360 + 1] + weight * radius_b[(i + 1) % 360 + 1];
    du constant float8 := after * sind(i - 179) - before * sind(i - 181);
    dw constant float8 := after * cosd(i - 179) - before * cosd(i - 181);
    length constant float8 := sqrt(du * du + dw * dw);
BEGIN
    RETURN ARRAY[here * sind(i - 180), here * cosd(i - 180), du / length, dw / length];
END
$$;
COMMENT ON FUNCTION tunnel_internal.section_node(float8[], float8[], float8, int) IS
'Node k (0-359, at -180° + k) of the section between two others, with the weight of the second: right and up of the axis (m), and the unit direction of the section there';


-- Chainage, arc and offset of a point of a survey's tunnel; NULL off the tunnel. chainage: m in plan along the axis; arc: m
-- along the section from the crown, positive right looking up-chainage; offset: m from the section's surface, positive into
-- the tunnel. The point must be 3D, in the tunnel's SRID (or without one). Points beyond the ends, or more than 3 m outside
-- the surface, are off the tunnel.
CREATE OR REPLACE FUNCTION tunnel_api.unroll(
    survey_id int, point geometry, OUT chainage float8, OUT arc float8, OUT "offset" float8)
LANGUAGE plpgsql STABLE PARALLEL SAFE STRICT
SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
DECLARE
    max_outside constant float8 := 3.0;
    x constant float8 := public.ST_X(point);
    y constant float8 := public.ST_Y(point);
    z constant float8 := public.ST_Z(point);
    srid int;
    s tunnel.segment;
    number int;
    before float8;
    after float8;
    f float8;
    frame float8[];
    radius_a float8[]; radius_b float8[];
    arc_a float8[]; arc_b float8[];
    weight float8;
    u float8; w float8;
    k int;
    n0 float8[]; n1 float8[];
    here float8; following float8;
    t float8; c0 float8; c1 float8; c2 float8; slope float8;
    du float8; dw float8; length float8; inward float8;
BEGIN
    SELECT q.srid INTO srid FROM tunnel.survey v JOIN tunnel.tunnel q ON q.id = v.tunnel_id WHERE v.id = unroll.survey_id;
    IF srid IS NULL THEN
        RAISE EXCEPTION 'there is no survey %', survey_id;
    ELSIF public.ST_CoordDim(point) < 3 THEN
        RAISE EXCEPTION 'the point has no height: it must be 3D, in metres of the tunnel''s coordinate system'
            USING ERRCODE = 'invalid_parameter_value', HINT = 'public.ST_SetSRID(public.ST_MakePoint(x, y, z), srid)';
    ELSIF public.ST_SRID(point) NOT IN (0, srid) THEN
        RAISE EXCEPTION 'the point has SRID %, the tunnel %: use ST_Transform(point, %)', public.ST_SRID(point), srid, srid;
    END IF;

    SELECT q.* INTO s FROM tunnel.segment q
    WHERE q.survey_id = unroll.survey_id ORDER BY q.geom OPERATOR(public.<->) public.ST_SetSRID(point, srid) LIMIT 1;
    LOOP
        IF s.n IS NULL THEN
            RETURN;
        END IF;
        before := (x - s.vertex_from[1]) * s.tangent_from[1] + (y - s.vertex_from[2]) * s.tangent_from[2]
            + (z - s.vertex_from[3]) * s.tangent_from[3];
        after := (s.vertex_to[1] - x) * s.tangent_to[1] + (s.vertex_to[2] - y) * s.tangent_to[2]
            + (s.vertex_to[3] - z) * s.tangent_to[3];
        IF before < 0 THEN
            EXIT WHEN s.n - 1 = number;
            number := s.n;
            SELECT q.* INTO s FROM tunnel.segment q WHERE q.survey_id = unroll.survey_id AND q.n = number - 1;
        ELSIF after <= 0 THEN
            number := s.n;
            SELECT q.* INTO s FROM tunnel.segment q WHERE q.survey_id = unroll.survey_id AND q.n = number + 1;
        ELSE
            EXIT;
        END IF;
    END LOOP;
    -- a point between the planes of two segments (where they cross, far from the axis) lies on the later one's first plane
    f := CASE WHEN before < 0 THEN 0 ELSE before / (before + after) END;
    frame := tunnel_internal.segment_frame(s.vertex_from || s.vertex_to || s.tangent_from || s.tangent_to, f);
    SELECT q.* INTO radius_a, radius_b, arc_a, arc_b, weight
    FROM tunnel_internal.section_pair(survey_id, s.chainage_from + f * (s.chainage_to - s.chainage_from)) q;
    IF radius_a IS NULL THEN
        RETURN;
    END IF;
    u := (x - frame[1]) * frame[7] + (y - frame[2]) * frame[8];
    w := (x - frame[1]) * frame[10] + (y - frame[2]) * frame[11] + (z - frame[3]) * frame[12];

    -- the interval between whose normals the point lies
    k := (floor(degrees(atan2(u, w)) + 180))::int % 360;
    n0 := tunnel_internal.section_node(radius_a, radius_b, weight, k);
    n1 := tunnel_internal.section_node(radius_a, radius_b, weight, k + 1);
    here := (u - n0[1]) * n0[3] + (w - n0[2]) * n0[4];
    following := (u - n1[1]) * n1[3] + (w - n1[2]) * n1[4];
    FOR step IN 1 .. 180 LOOP
        IF here < 0 THEN
            k := (k + 359) % 360;
            n1 := n0;
            following := here;
            n0 := tunnel_internal.section_node(radius_a, radius_b, weight, k);
            here := (u - n0[1]) * n0[3] + (w - n0[2]) * n0[4];
            EXIT WHEN here >= 0;
        ELSIF following >= 0 THEN
            k := (k + 1) % 360;
            n0 := n1;
            here := following;
            n1 := tunnel_internal.section_node(radius_a, radius_b, weight, k + 1);
            following := (u - n1[1]) * n1[3] + (w - n1[2]) * n1[4];
            EXIT WHEN following < 0;
        ELSE
            EXIT;
        END IF;
    END LOOP;

    -- (q - t b) · (d0 + t e) = 0, q being the point seen from the first node, b the chord, e the change of direction
    c0 := (u - n0[1]) * n0[3] + (w - n0[2]) * n0[4];
    c1 := (u - n0[1]) * (n1[3] - n0[3]) + (w - n0[2]) * (n1[4] - n0[4])
        - (n1[1] - n0[1]) * n0[3] - (n1[2] - n0[2]) * n0[4];
    c2 := -((n1[1] - n0[1]) * (n1[3] - n0[3]) + (n1[2] - n0[2]) * (n1[4] - n0[4]));
    t := CASE WHEN here > following THEN here / (here - following) ELSE 0.5 END;
    FOR step IN 1 .. 4 LOOP
        slope := c1 + 2 * c2 * t;
        EXIT WHEN slope = 0;
        t := t - (c0 + t * (c1 + t * c2)) / slope;
    END LOOP;
    t := least(greatest(t, 0), 1);

    du := n0[3] + t * (n1[3] - n0[3]);
    dw := n0[4] + t * (n1[4] - n0[4]);
    length := sqrt(du * du + dw * dw);
    inward := ((u - n0[1] - t * (n1[1] - n0[1])) * dw - (w - n0[2] - t * (n1[2] - n0[2])) * du) / length;
    IF inward < -max_outside THEN
        RETURN;
    END IF;
    chainage := s.chainage_from + f * (s.chainage_to - s.chainage_from);
    arc := (1 - t) * ((1 - weight) * arc_a[k + 1] + weight * arc_b[k + 1])
        + t * ((1 - weight) * arc_a[k + 2] + weight * arc_b[k + 2]);
    "offset" := inward;
END
$$;
COMMENT ON FUNCTION tunnel_api.unroll(int, geometry) IS
'Chainage (m in plan along the axis), arc (m along the section from the crown, positive right looking up-chainage) and offset (m from the surface, positive into the tunnel) of a 3D point in the tunnel''s SRID; NULL off the tunnel. After Gonçalves et al. (2012), stage 5';


-- Point at chainage, arc and offset, in the tunnel's SRID; NULL off the tunnel. Inverse of unroll.
CREATE OR REPLACE FUNCTION tunnel_api.roll(survey_id int, chainage float8, arc float8, "offset" float8 DEFAULT 0)
RETURNS geometry
LANGUAGE plpgsql STABLE PARALLEL SAFE STRICT
SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
DECLARE
    s tunnel.segment;
    srid int;
    frame float8[];
    radius_a float8[]; radius_b float8[];
    arc_a float8[]; arc_b float8[];
    weight float8;
    low int := 1;
    high int := 361;
    middle int;
    before float8;
    t float8;
    n0 float8[]; n1 float8[];
    u float8; w float8; du float8; dw float8; length float8;
BEGIN
    SELECT q.* INTO s FROM tunnel.segment q
    WHERE q.survey_id = roll.survey_id AND q.chainage_from <= roll.chainage ORDER BY q.chainage_from DESC LIMIT 1;
    IF s.n IS NULL OR roll.chainage > s.chainage_to THEN
        RETURN NULL;
    END IF;
    SELECT q.* INTO radius_a, radius_b, arc_a, arc_b, weight FROM tunnel_internal.section_pair(survey_id, chainage) q;
    IF radius_a IS NULL OR arc < (1 - weight) * arc_a[1] + weight * arc_b[1] - 1e-6
       OR arc > (1 - weight) * arc_a[361] + weight * arc_b[361] + 1e-6 THEN
        RETURN NULL;
    END IF;
    WHILE high - low > 1 LOOP
        middle := (low + high) / 2;
        IF (1 - weight) * arc_a[middle] + weight * arc_b[middle] <= arc THEN
            low := middle;
        ELSE
            high := middle;
        END IF;
    END LOOP;
    before := (1 - weight) * arc_a[low] + weight * arc_b[low];
    t := (arc - before) / ((1 - weight) * arc_a[low + 1] + weight * arc_b[low + 1] - before);
    n0 := tunnel_internal.section_node(radius_a, radius_b, weight, low - 1);
    n1 := tunnel_internal.section_node(radius_a, radius_b, weight, low);
    du := n0[3] + t * (n1[3] - n0[3]);
    dw := n0[4] + t * (n1[4] - n0[4]);
    length := sqrt(du * du + dw * dw);
    u := n0[1] + t * (n1[1] - n0[1]) + "offset" * dw / length;
    w := n0[2] + t * (n1[2] - n0[2]) - "offset" * du / length;
    frame := tunnel_internal.segment_frame(s.vertex_from || s.vertex_to || s.tangent_from || s.tangent_to,
        (chainage - s.chainage_from) / (s.chainage_to - s.chainage_from));
    SELECT q.srid INTO srid FROM tunnel.survey v JOIN tunnel.tunnel q ON q.id = v.tunnel_id WHERE v.id = roll.survey_id;
    RETURN public.ST_SetSRID(public.ST_MakePoint(
        frame[1] + u * frame[7] + w * frame[10],
        frame[2] + u * frame[8] + w * frame[11],
        frame[3] + w * frame[12]), srid);
END
$$;
COMMENT ON FUNCTION tunnel_api.roll(int, float8, float8, float8) IS
'Point at chainage, arc and offset, m: 3D, tunnel''s SRID; NULL off the tunnel. Inverse of unroll';


-- Point of the unrolled plane on the map beside the axis, in the tunnel's SRID (Gonçalves et al., 2012, eq. 1): at its
-- chainage, arc metres to the right of the axis. NULL where there is no axis.
CREATE OR REPLACE FUNCTION tunnel_internal.map_point(survey_id int, chainage float8, arc float8)
RETURNS geometry
LANGUAGE plpgsql STABLE PARALLEL SAFE STRICT
SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
DECLARE
    s tunnel.segment;
    frame float8[];
BEGIN
    SELECT q.* INTO s FROM tunnel.segment q
    WHERE q.survey_id = map_point.survey_id AND q.chainage_from <= map_point.chainage ORDER BY q.chainage_from DESC LIMIT 1;
    IF s.n IS NULL OR map_point.chainage > s.chainage_to THEN
        RETURN NULL;
    END IF;
    frame := tunnel_internal.segment_frame(s.vertex_from || s.vertex_to || s.tangent_from || s.tangent_to,
        (chainage - s.chainage_from) / (s.chainage_to - s.chainage_from));
    RETURN public.ST_SetSRID(public.ST_MakePoint(frame[1] + arc * frame[7], frame[2] + arc * frame[8]), public.ST_SRID(s.geom));
END
$$;
COMMENT ON FUNCTION tunnel_internal.map_point(int, float8, float8) IS
'Point of the map strip (tunnel''s SRID) at chainage and arc, m: arc metres to the right of the axis. Source: Gonçalves et al. (2012), eq. 1';
