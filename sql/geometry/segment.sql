-- Stage 3 of Gonçalves et al. (2012): segments between planes perpendicular to the axis, and the segment of every point.

-- The plane at the fraction f (0-1) of a segment: origin, tangent, right and up, 12 numbers, in the tunnel's SRID.
--
-- The plane turns steadily from the first to the second one; its normal is (1 - f) t_from + f t_to. The origin is where the
-- cubic Hermite curve through the vertices meets it. The same as tunneldb.geometry.frame.frame_at.
-- segment: vertex_from, vertex_to, tangent_from, tangent_to, 3 numbers each.
CREATE OR REPLACE FUNCTION tunnel_internal.segment_frame(segment float8[], f float8)
RETURNS float8[]
LANGUAGE plpgsql IMMUTABLE PARALLEL SAFE STRICT
AS $$
DECLARE
    g constant float8 := 1 - f;
    nx float8 := g * segment[7] + f * segment[10];
    ny float8 := g * segment[8] + f * segment[11];
    nz float8 := g * segment[9] + f * segment[12];
    norm constant float8 := sqrt(nx * nx + ny * ny + nz * nz);
    level constant float8 := (
        g * (segment[1] * segment[7] + segment[2] * segment[8] + segment[3] * segment[9])
        + f * (segment[4] * segment[10] + segment[5] * segment[11] + segment[6] * segment[12])) / norm;
    length constant float8 := sqrt(
        (segment[4] - segment[1]) ^ 2 + (segment[5] - segment[2]) ^ 2 + (segment[6] - segment[3]) ^ 2);
    h00 constant float8 := (1 + 2 * f) * g * g;
    h10 constant float8 := f * g * g * length;
    h01 constant float8 := f * f * (3 - 2 * f);
    h11 constant float8 := -f * f * g * length;
    px constant float8 := h00 * segment[1] + h10 * segment[7] + h01 * segment[4] + h11 * segment[10];
    py constant float8 := h00 * segment[2] + h10 * segment[8] + h01 * segment[5] + h11 * segment[11];
    pz constant float8 := h00 * segment[3] + h10 * segment[9] + h01 * segment[6] + h11 * segment[12];
    gap float8;
    flat float8;
BEGIN
    nx := nx / norm;
    ny := ny / norm;
    nz := nz / norm;
    gap := level - (px * nx + py * ny + pz * nz);
    flat := sqrt(nx * nx + ny * ny);
    RETURN ARRAY[
        px + gap * nx, py + gap * ny, pz + gap * nz,
        nx, ny, nz,
        ny / flat, -nx / flat, 0,
        -nx / flat * nz, -ny / flat * nz, flat];
END
$$;
COMMENT ON FUNCTION tunnel_internal.segment_frame(float8[], float8) IS
'Plane at the fraction f (0-1) of a segment: origin, tangent, right and up (12 numbers), tunnel''s SRID, m. segment: vertex_from, vertex_to, tangent_from, tangent_to';


-- Segments of a kilometre computed from the axis vertices. Chainage is measured in plan along the measured axis, arc by arc,
-- from the start of the kilometre. If the axis continues beyond its end, the kilometre is closed at the given axis' full
-- kilometre, so that kilometres are independent. line: vertex_from, vertex_to, tangent_from, tangent_to.
CREATE OR REPLACE FUNCTION tunnel_internal.segment_plan(survey_id int, km int)
RETURNS TABLE (n int, chainage_from float8, chainage_to float8, line float8[])
LANGUAGE sql STABLE PARALLEL SAFE STRICT
ROWS 100
AS $$
    WITH setting AS (
        SELECT ceil(segment_plan.km * 1000 / t.spacing)::int AS first,
            ceil((segment_plan.km + 1) * 1000 / t.spacing)::int AS last, t.spacing
        FROM tunnel.survey s JOIN tunnel.tunnel t ON t.id = s.tunnel_id
        WHERE s.id = segment_plan.survey_id
    ), vertex AS (
        SELECT array_agg(v.n ORDER BY v.n) AS n, array_agg(public.ST_X(v.geom) ORDER BY v.n) AS x,
            array_agg(public.ST_Y(v.geom) ORDER BY v.n) AS y, array_agg(public.ST_Z(v.geom) ORDER BY v.n) AS z
        FROM tunnel.axis_vertex v, setting s
        WHERE v.survey_id = segment_plan.survey_id AND v.n BETWEEN s.first - 2 AND s.last + 2
    ), frame AS (
        SELECT f.* FROM vertex v, tunnel_internal.axis_frame(v.n, v.x, v.y, v.z) f
    ), pair AS (
        SELECT a.n, ARRAY[a.x, a.y, a.z, b.x, b.y, b.z, a.tx, a.ty, a.tz, b.tx, b.ty, b.tz] AS line,
            sqrt((b.x - a.x) ^ 2 + (b.y - a.y) ^ 2) AS chord,
            -- half the angle in plan between the two tangents
            atan2(a.tx * b.ty - a.ty * b.tx, a.tx * b.tx + a.ty * b.ty) / 2 AS half
        FROM setting s, frame a JOIN frame b ON b.n = a.n + 1
        WHERE a.n >= s.first AND a.n < s.last
    ), measured AS (
        SELECT p.n, p.line, l.length,
            sum(l.length) OVER (ORDER BY p.n) AS "to", sum(l.length) OVER () AS total,
            min(p.n) OVER () AS first, max(p.n) OVER () + 1 AS last
        FROM pair p
        CROSS JOIN LATERAL (
            SELECT CASE WHEN abs(p.half) < 1e-9 THEN p.chord ELSE p.chord * p.half / sin(p.half) END AS length) l
    )
    SELECT m.n, m.first * s.spacing + c.scale * (m."to" - m.length), m.first * s.spacing + c.scale * m."to", m.line
    FROM setting s, measured m
    CROSS JOIN LATERAL (
        SELECT CASE WHEN m.last = s.last THEN (m.last - m.first) * s.spacing / m.total ELSE 1 END AS scale) c
    ORDER BY m.n
$$;
COMMENT ON FUNCTION tunnel_internal.segment_plan(int, int) IS
'Segments of a kilometre computed from the axis vertices: number, chainage of both planes (m, in plan), vertex_from, vertex_to, tangent_from, tangent_to (12 numbers, tunnel''s SRID). Source: Gonçalves et al. (2012), stage 3';


-- Numbers that are none, or too large to be coordinates, must not end the status of all surveys with an error.
CREATE OR REPLACE FUNCTION tunnel_internal.coordinate(value float8) RETURNS float8
LANGUAGE sql IMMUTABLE PARALLEL SAFE CALLED ON NULL INPUT
AS $$ SELECT greatest(least($1, 1e9), -1e9) $$;
COMMENT ON FUNCTION tunnel_internal.coordinate(float8) IS
'A number limited to ±1,000,000 km, m; the greatest one for NULL and NaN';


-- True if the planes of a segment differ from the present axis: a vertex at one of its ends moved by more than 0.1 mm since
-- the segment was made, or a plane turned by as much there because the vertex beyond moved. A plane at the end of the axis
-- turns with the vertices of the other plane. The neighbouring segments are not used: they can belong to another kilometre
-- and be newer.
CREATE OR REPLACE FUNCTION tunnel_internal.segment_moved(survey_id int, n int, segment float8[])
RETURNS boolean
LANGUAGE sql STABLE PARALLEL SAFE STRICT SECURITY DEFINER
SET search_path = pg_catalog, pg_temp
AS $$
    WITH vertex AS MATERIALIZED (
        SELECT v.n - $2 AS i, tunnel_internal.coordinate(public.st_x(v.geom)) AS x, tunnel_internal.coordinate(public.st_y(v.geom)) AS y,
               tunnel_internal.coordinate(public.st_z(v.geom)) AS z
          FROM tunnel.axis_vertex v WHERE v.survey_id = $1 AND v.n BETWEEN $2 - 1 AND $2 + 2
    )
    SELECT EXISTS (
        SELECT FROM vertex v
         WHERE v.i IN (0, 1)
           AND (v.x - tunnel_internal.coordinate($3[3 * v.i + 1])) ^ 2 + (v.y - tunnel_internal.coordinate($3[3 * v.i + 2])) ^ 2
               + (v.z - tunnel_internal.coordinate($3[3 * v.i + 3])) ^ 2 > 1e-8
    ) OR EXISTS (
        SELECT FROM vertex a
          JOIN vertex b ON b.i = a.i + 2
         CROSS JOIN LATERAL (SELECT sqrt((b.x - a.x) ^ 2 + (b.y - a.y) ^ 2 + (b.z - a.z) ^ 2) AS length) c
         WHERE (b.x - a.x - c.length * tunnel_internal.coordinate($3[3 * a.i + 10])) ^ 2
               + (b.y - a.y - c.length * tunnel_internal.coordinate($3[3 * a.i + 11])) ^ 2
               + (b.z - a.z - c.length * tunnel_internal.coordinate($3[3 * a.i + 12])) ^ 2 > 1e-8
    )
$$;
COMMENT ON FUNCTION tunnel_internal.segment_moved(int, int, float8[]) IS
'True if the planes of a segment differ from those of the present axis. n: number of the segment; segment: vertex_from, vertex_to, tangent_from, tangent_to, 3 numbers each';


-- Write the segments of a kilometre to tunnel.segment, replacing existing ones, and return their number.
CREATE OR REPLACE FUNCTION tunnel_internal.segment_build(survey_id int, km int)
RETURNS int
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT
AS $$
DECLARE
    built int;
BEGIN
    DELETE FROM tunnel.segment s WHERE s.survey_id = segment_build.survey_id AND s.km = segment_build.km;
    INSERT INTO tunnel.segment (survey_id, n, km, chainage_from, chainage_to,
        vertex_from, vertex_to, tangent_from, tangent_to, geom, points)
    SELECT segment_build.survey_id, p.n, segment_build.km, p.chainage_from, p.chainage_to,
        p.line[1:3], p.line[4:6], p.line[7:9], p.line[10:12],
        (SELECT public.ST_MakeLine(array_agg(public.ST_SetSRID(public.ST_MakePoint(f.frame[1], f.frame[2], f.frame[3]), t.srid) ORDER BY i))
         FROM generate_series(0, 4) AS i, LATERAL (SELECT tunnel_internal.segment_frame(p.line, i / 4.0) AS frame) f),
        0
    FROM tunnel_internal.segment_plan(segment_build.survey_id, segment_build.km) p,
        tunnel.survey s JOIN tunnel.tunnel t ON t.id = s.tunnel_id
    WHERE s.id = segment_build.survey_id;
    GET DIAGNOSTICS built = ROW_COUNT;
    RETURN built;
END
$$;
COMMENT ON FUNCTION tunnel_internal.segment_build(int, int) IS
'Stage segments for one kilometre: rewrite tunnel.segment from the axis vertices, and return the number of segments. Source: Gonçalves et al. (2012), stage 3';


-- Segment and chainage of every point of a kilometre: the partition is rewritten with both and swapped in. Rows keep the
-- order of the previous chainage, which is close enough for a BRIN index; not sorting saves a fifth of the time. The fraction
-- of a point in a segment is its distance from the first plane over the sum of its distances from both planes. The segment is
-- first found by the previous chainage; a point before its first plane or beyond its second one belongs to the neighbour.
-- Points before the first or after the last plane of the tunnel keep their chainage and have no segment.
CREATE OR REPLACE FUNCTION tunnel_internal.segment_tag(survey_id int, km int)
RETURNS bigint
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT
SET synchronize_seqscans = off  -- rows keep their order
SET enable_mergejoin = off  -- it would sort all points by their segment first, though the segments fit a small hash
SET plan_cache_mode = force_custom_plan  -- a generic plan is made for, and locks, every partition of every survey
AS $$
DECLARE
    building constant text := tunnel_internal.partition_name(survey_id, km) || '_new';
    spacing float8;
    tagged bigint;
    numbers int[]; counts bigint[];
    n int[]; a float8[]; b float8[];
    px float8[]; py float8[]; pz float8[]; pl float8[];
    qx float8[]; qy float8[]; qz float8[]; ql float8[];
BEGIN
    SELECT t.spacing INTO STRICT spacing
    FROM tunnel.survey s JOIN tunnel.tunnel t ON t.id = s.tunnel_id WHERE s.id = segment_tag.survey_id;

    -- both planes of each segment: normal and how far along it
    SELECT array_agg(p.n), array_agg(p.chainage_from), array_agg(p.chainage_to),
        array_agg(p.line[7]), array_agg(p.line[8]), array_agg(p.line[9]),
        array_agg(p.line[1] * p.line[7] + p.line[2] * p.line[8] + p.line[3] * p.line[9]),
        array_agg(p.line[10]), array_agg(p.line[11]), array_agg(p.line[12]),
        array_agg(p.line[4] * p.line[10] + p.line[5] * p.line[11] + p.line[6] * p.line[12])
    INTO n, a, b, px, py, pz, pl, qx, qy, qz, ql
    FROM generate_series(segment_tag.km - 1, segment_tag.km + 1) AS k, tunnel_internal.segment_plan(segment_tag.survey_id, k) p;

    PERFORM tunnel_internal.partition_new(segment_tag.survey_id, segment_tag.km);
    -- OFFSET 0: what stands before it is reckoned once.
    -- The segments beside share a plane: a point lies as far before theirs as beyond one's own.
    EXECUTE format($query$
        INSERT INTO tunnel.%I (survey_id, km, chainage, gps_time, geom, segment, scan_id, file_id, intensity, classification, "class")
        SELECT c.survey_id, c.km,
            coalesce(CASE
                WHEN c.before < 0 THEN c.previous[1] + (c.previous[2] - c.previous[1]) * m.before / nullif(m.before - c.before, 0)
                WHEN c.after <= 0 THEN c.next[1] - (c.next[2] - c.next[1]) * c.after / nullif(m.after - c.after, 0)
                ELSE c.a + (c.b - c.a) * c.before / nullif(c.before + c.after, 0) END, c.chainage) AS chainage,
            c.gps_time, c.geom,
            CASE WHEN c.before < 0 THEN c.previous_n WHEN c.after <= 0 THEN c.next_n ELSE c.n END AS segment,
            c.scan_id, c.file_id, c.intensity, c.classification, c."class"
        FROM (SELECT p.*, s.n, s.a, s.b, s.previous_n, s.previous, s.next_n, s.next,
                  p.x * s.px + p.y * s.py + p.z * s.pz - s.pl AS before,
                  s.ql - (p.x * s.qx + p.y * s.qy + p.z * s.qz) AS after
              FROM (SELECT p.*, public.ST_X(p.geom) AS x, public.ST_Y(p.geom) AS y, public.ST_Z(p.geom) AS z
                    -- the partition by its name: no lock on its parent, whose partitions others may be swapping
                    FROM tunnel.%I p OFFSET 0) p
              LEFT JOIN (
                  SELECT s.*, q.n AS previous_n, ARRAY[q.a, q.b, q.px, q.py, q.pz, q.pl] AS previous,
                      r.n AS next_n, ARRAY[r.a, r.b, r.qx, r.qy, r.qz, r.ql] AS next
                  FROM unnest($2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12) AS s (n, a, b, px, py, pz, pl, qx, qy, qz, ql)
                  LEFT JOIN unnest($2, $3, $4, $5, $6, $7, $8) AS q (n, a, b, px, py, pz, pl) ON q.n = s.n - 1
                  LEFT JOIN unnest($2, $3, $4, $9, $10, $11, $12) AS r (n, a, b, qx, qy, qz, ql) ON r.n = s.n + 1) s
                  ON s.n = floor(p.chainage / $1)::int
              OFFSET 0) c
        CROSS JOIN LATERAL (
            SELECT c.x * c.previous[3] + c.y * c.previous[4] + c.z * c.previous[5] - c.previous[6] AS before,
                c.next[6] - (c.x * c.next[3] + c.y * c.next[4] + c.z * c.next[5]) AS after) m
    $query$, building, tunnel_internal.partition_name(survey_id, km))
    USING spacing, n, a, b, px, py, pz, pl, qx, qy, qz, ql;

    EXECUTE format($query$
        SELECT array_agg(c.segment), array_agg(c.points), coalesce(sum(c.points), 0)
        FROM (SELECT p.segment, count(*) AS points FROM tunnel.%I p WHERE p.segment IS NOT NULL GROUP BY p.segment) c
    $query$, building) INTO numbers, counts, tagged;
    UPDATE tunnel.segment s SET points = c.points
    FROM unnest(numbers, counts) AS c (n, points)
    WHERE s.survey_id = segment_tag.survey_id AND s.km = segment_tag.km AND s.n = c.n;
    PERFORM tunnel_internal.partition_swap(segment_tag.survey_id, segment_tag.km);
    RETURN tagged;
END
$$;
COMMENT ON FUNCTION tunnel_internal.segment_tag(int, int) IS
'Stage segments for the points of one kilometre: rewrite their partition with segment and chainage (m, in plan), and return the number of tagged points. Source: Gonçalves et al. (2012), stage 3';
