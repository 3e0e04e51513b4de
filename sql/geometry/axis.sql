-- Stage 1 of Gonçalves et al. (2012): axis from averaged points near each vertex, iterated until it converges.

-- Vertices with their frames. Tangent: from the vertex before to the one after (Gonçalves et al., 2012, fig. 5); at an end,
-- the parabola through three vertices; of two vertices, the chord. Right = tangent × vertical, up = right × tangent.
-- n: vertex numbers; x, y, z: coordinates in the tunnel's SRID, m. Neighbours are those whose numbers differ by one.
CREATE OR REPLACE FUNCTION tunnel_internal.axis_frame(n int[], x float8[], y float8[], z float8[])
RETURNS TABLE (
    n int, x float8, y float8, z float8,
    tx float8, ty float8, tz float8,
    ux float8, uy float8,
    wx float8, wy float8, wz float8)
LANGUAGE sql IMMUTABLE PARALLEL SAFE STRICT
ROWS 100
AS $$
    WITH vertex AS (
        SELECT v.n, v.x, v.y, v.z,
            CASE WHEN lag(v.n) OVER along = v.n - 1 THEN lag(v.p) OVER along END AS a,
            CASE WHEN lag(v.n, 2) OVER along = v.n - 2 THEN lag(v.p, 2) OVER along END AS a2,
            CASE WHEN lead(v.n) OVER along = v.n + 1 THEN lead(v.p) OVER along END AS b,
            CASE WHEN lead(v.n, 2) OVER along = v.n + 2 THEN lead(v.p, 2) OVER along END AS b2
        FROM (SELECT q.n, q.x, q.y, q.z, ARRAY[q.x, q.y, q.z] AS p
              FROM unnest(axis_frame.n, axis_frame.x, axis_frame.y, axis_frame.z) AS q (n, x, y, z)) v
        WINDOW along AS (ORDER BY v.n)
    ), direction AS (
        SELECT v.n, v.x, v.y, v.z,
            CASE
                WHEN v.a IS NOT NULL AND v.b IS NOT NULL THEN ARRAY[b[1] - a[1], b[2] - a[2], b[3] - a[3]]
                WHEN v.b2 IS NOT NULL THEN
                    ARRAY[4 * b[1] - 3 * v.x - b2[1], 4 * b[2] - 3 * v.y - b2[2], 4 * b[3] - 3 * v.z - b2[3]]
                WHEN v.b IS NOT NULL THEN ARRAY[b[1] - v.x, b[2] - v.y, b[3] - v.z]
                WHEN v.a2 IS NOT NULL THEN
                    ARRAY[3 * v.x - 4 * a[1] + a2[1], 3 * v.y - 4 * a[2] + a2[2], 3 * v.z - 4 * a[3] + a2[3]]
                ELSE ARRAY[v.x - a[1], v.y - a[2], v.z - a[3]]
            END AS d
        FROM vertex v
        OFFSET 0  -- a fence: each step is reckoned once, not in each place where it is used
    ), tangent AS (
        SELECT q.n, q.x, q.y, q.z, q.d[1] / q.length AS tx, q.d[2] / q.length AS ty, q.d[3] / q.length AS tz
        FROM (SELECT d.*, sqrt(d.d[1] ^ 2 + d.d[2] ^ 2 + d.d[3] ^ 2) AS length FROM direction d OFFSET 0) q
        OFFSET 0
    )
    SELECT t.n, t.x, t.y, t.z, t.tx, t.ty, t.tz,
        t.ty / p.plan, -t.tx / p.plan,
        -t.tx / p.plan * t.tz, -t.ty / p.plan * t.tz, p.plan
    FROM tangent t, LATERAL (SELECT sqrt(t.tx ^ 2 + t.ty ^ 2) AS plan) p
    ORDER BY t.n
$$;
COMMENT ON FUNCTION tunnel_internal.axis_frame(int[], float8[], float8[], float8[]) IS
'Vertices of an axis with unit vectors: tangent (t), right (u), up (w), in the tunnel''s SRID. Neighbours are vertices whose numbers differ by one. Source: Gonçalves et al. (2012), fig. 5';


-- FROM expression for the points that can lie within half_width (m) of the planes of vertices n, by chainage: number of the
-- vertex and coordinates.
CREATE OR REPLACE FUNCTION tunnel_internal.axis_source(survey_id int, n int[], half_width float8)
RETURNS text
LANGUAGE plpgsql STABLE PARALLEL SAFE STRICT
AS $$
DECLARE
    spacing float8 := (SELECT t.spacing FROM tunnel.survey s JOIN tunnel.tunnel t ON t.id = s.tunnel_id
                       WHERE s.id = axis_source.survey_id);
    low float8 := (SELECT (min(i) - 0.5) * spacing FROM unnest(n) i);
    high float8 := (SELECT (max(i) + 0.5) * spacing FROM unnest(n) i);
BEGIN
    RETURN format($query$
        SELECT round(p.chainage / %1$s)::int AS n, public.ST_X(p.geom) AS x, public.ST_Y(p.geom) AS y, public.ST_Z(p.geom) AS z,
            clock_timestamp()  -- a fence that lets the scan be parallel: the coordinates are taken out once
        FROM %5$s p
        WHERE p.chainage BETWEEN %2$s AND %3$s
          -- chainage is accurate to about a metre until the axis has converged; the plane decides
          AND abs(p.chainage - round(p.chainage / %1$s) * %1$s) <= %4$s + 1.5
    $query$, spacing, low, high, half_width,
        tunnel_internal.partition_source(survey_id, floor(low / 1000)::int, floor(high / 1000)::int));
END
$$;
COMMENT ON FUNCTION tunnel_internal.axis_source(int, int[], float8) IS
'FROM expression that reads the points near the planes of axis vertices n, by chainage: n, x, y, z (m)';


-- Table to which axis_near copies points of a kilometre.
CREATE OR REPLACE FUNCTION tunnel_internal.axis_near_name(survey_id int, km int)
RETURNS text
LANGUAGE sql IMMUTABLE PARALLEL SAFE STRICT
AS $$
    SELECT tunnel_internal.partition_name($1, $2) || '_axis'
$$;
COMMENT ON FUNCTION tunnel_internal.axis_near_name(int, int) IS
'Name of the temporary table of stage axis for a kilometre, in schema tunnel';


-- Copy the points near the planes of vertices to a table, replacing an older one, for the passes of axis_refine: those within
-- half_width + 0.5 m of their plane, and those 30 m or more from their vertex. Not a temporary table, which parallel workers
-- cannot read; it exists until the transaction ends.
CREATE OR REPLACE FUNCTION tunnel_internal.axis_near(
    survey_id int, km int, n int[], x float8[], y float8[], z float8[], half_width float8)
RETURNS void
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT
AS $$
DECLARE
    near constant text := tunnel_internal.axis_near_name(survey_id, km);
BEGIN
    EXECUTE format('DROP TABLE IF EXISTS tunnel.%I', near);
    EXECUTE format($query$
        CREATE UNLOGGED TABLE tunnel.%I AS
        SELECT p.n, p.x, p.y, p.z
        FROM (%s) p
        JOIN tunnel_internal.axis_frame($2, $3, $4, $5) f ON f.n = p.n
        CROSS JOIN LATERAL (SELECT p.x - f.x AS x, p.y - f.y AS y, p.z - f.z AS z) d
        WHERE abs(d.x * f.tx + d.y * f.ty + d.z * f.tz) <= $1 + 0.5 OR d.x * d.x + d.y * d.y + d.z * d.z > 900
    $query$, near, tunnel_internal.axis_source(axis_near.survey_id, axis_near.n, axis_near.half_width))
    USING axis_near.half_width, axis_near.n, axis_near.x, axis_near.y, axis_near.z;
END
$$;
COMMENT ON FUNCTION tunnel_internal.axis_near(int, int, int[], float8[], float8[], float8[], float8) IS
'Copy the points near the planes of a kilometre''s axis vertices to the table axis_near_name: n, x, y, z (m)';


-- True if the planes of vertices moved since points were copied by so much (0.5 m within 30 m of the vertex) that a point
-- within half_width can be missing. ox, oy, oz: vertices at that time.
CREATE OR REPLACE FUNCTION tunnel_internal.axis_astray(
    n int[], x float8[], y float8[], z float8[], ox float8[], oy float8[], oz float8[])
RETURNS boolean
LANGUAGE sql IMMUTABLE PARALLEL SAFE STRICT
AS $$
    SELECT coalesce(bool_or(abs((f.x - o.x) * f.tx + (f.y - o.y) * f.ty + (f.z - o.z) * f.tz)
        + 30.0 * sqrt((f.tx - o.tx) ^ 2 + (f.ty - o.ty) ^ 2 + (f.tz - o.tz) ^ 2) > 0.499), false)
    FROM tunnel_internal.axis_frame($1, $2, $3, $4) f
    JOIN tunnel_internal.axis_frame($1, $5, $6, $7) o ON o.n = f.n
$$;
COMMENT ON FUNCTION tunnel_internal.axis_astray(int[], float8[], float8[], float8[], float8[], float8[], float8[]) IS
'True if a plane of an axis vertex moved by 0.5 m or more within 30 m of its vertex since the vertices were at ox, oy, oz';


-- Shift from given vertices to the tunnel's centre, right and up in the plane of each vertex, m.
--
-- The points in the slab of the vertex (at most half_width from its plane) are averaged by angular class, so that a dense
-- floor weighs no more than a thin crown. Opposite classes are equally far from the centre. Sideways, the shift is the median
-- over pairs of classes that are mirrored in the upward direction, 45° to 135° from it. Upwards, it is the median over the
-- classes of the vault (45° about the upward direction) compared with the level of the floor. Medians ignore niches, cables and
-- equipment. In a tunnel more than twice as wide as high, most pairs lie on vault and floor. There, a pair counts only if its
-- distance is at least 0.8 of the width and within 10 % of that in the other slabs, so that a train in front of a wall is
-- ignored; a vertex without such a pair is left out. A vertex with a floor and no roof is left out, too, if others have a roof:
-- in an open cut, tops of walls and slopes do not show the tunnel's centre. If fewer than three pairs of classes are filled, the
-- centre is the mean of the points, as in the paper. A vertex whose slab contains fewer than min_points points is left out.
-- near: table of points that axis_near has copied; without it, all points are read.
CREATE OR REPLACE FUNCTION tunnel_internal.axis_shift(
    survey_id int, n int[], x float8[], y float8[], z float8[],
    half_width float8 DEFAULT 1.0, angle_step float8 DEFAULT 5.0, min_points int DEFAULT 100, near regclass DEFAULT '-')
RETURNS TABLE (vertex int, "right" float8, up float8, points bigint)
LANGUAGE plpgsql STABLE PARALLEL SAFE STRICT
ROWS 100
SET enable_nestloop = off  -- the planner expects few classes and would compare each with every other
AS $$
BEGIN
    RETURN QUERY EXECUTE format($query$
        WITH profile AS (
            SELECT f.n, q.u, q.w
            FROM (SELECT p.n, p.x, p.y, p.z FROM %s p) p
            JOIN tunnel_internal.axis_frame($4, $5, $6, $7) f ON f.n = p.n
            CROSS JOIN LATERAL (SELECT p.x - f.x AS dx, p.y - f.y AS dy, p.z - f.z AS dz) d
            CROSS JOIN LATERAL (SELECT d.dx * f.ux + d.dy * f.uy AS u, d.dx * f.wx + d.dy * f.wy + d.dz * f.wz AS w) q
            WHERE abs(d.dx * f.tx + d.dy * f.ty + d.dz * f.tz) <= $1
        ), class AS MATERIALIZED (
            SELECT p.n, (floor(degrees(atan2(p.u, p.w)) / $2) + 0.5) * $2 AS angle,
                avg(sqrt(p.u * p.u + p.w * p.w)) AS radius, sum(p.u) AS u, sum(p.w) AS w, count(*) AS points
            FROM profile p
            GROUP BY 1, 2
        ), floor_level AS (
            SELECT c.n, percentile_cont(0.5) WITHIN GROUP (ORDER BY -c.radius * cosd(c.angle)) AS depth, count(*) AS classes
            FROM class c
            WHERE abs(c.angle) > 135
            GROUP BY c.n
        ), upward AS (
            SELECT c.n, percentile_cont(0.5) WITHIN GROUP (ORDER BY (c.radius - f.depth / cosd(c.angle)) / 2) AS shift
            FROM class c JOIN floor_level f ON f.n = c.n
            WHERE abs(c.angle) < 45
            GROUP BY c.n
            HAVING count(*) >= 3 AND min(f.classes) >= 3
        ), pair AS (
            SELECT a.n, a.angle, (a.radius - b.radius) / 2 AS shift, (a.radius + b.radius) * sind(a.angle) AS apart
            FROM class a JOIN class b ON b.n = a.n AND b.angle = -a.angle
            WHERE a.angle BETWEEN 45 AND 135
        ), usual AS (  -- how far apart the pairs are where nothing stands before the walls
            SELECT q.angle, least(q.apart[2], 1.1 * max(q.apart[1]) OVER ()) AS apart
            FROM (SELECT p.angle, percentile_cont(ARRAY[0.5, 0.8]) WITHIN GROUP (ORDER BY p.apart) AS apart
                  FROM pair p GROUP BY p.angle) q
        ), low AS (  -- whether the tunnel is low and wide
            SELECT max(u.apart) AS width, max(u.apart) > 2 * (
                SELECT percentile_cont(0.5) WITHIN GROUP (ORDER BY f.depth + v.height)
                FROM floor_level f
                JOIN (SELECT c.n, percentile_cont(0.5) WITHIN GROUP (ORDER BY c.radius * cosd(c.angle)) AS height
                      FROM class c WHERE abs(c.angle) < 45 GROUP BY c.n) v ON v.n = f.n) AS is_low
            FROM usual u
        ), sideward AS (
            SELECT p.n, coalesce(l.is_low, false) AS is_low,
                percentile_cont(0.5) WITHIN GROUP (ORDER BY p.shift)
                    FILTER (WHERE l.is_low IS NOT TRUE
                              OR u.apart >= 0.8 * l.width AND abs(p.apart / u.apart - 1) <= 0.1) AS shift
            FROM pair p JOIN usual u ON u.angle = p.angle CROSS JOIN low l
            GROUP BY p.n, l.is_low
            HAVING count(*) >= 3
        ), roofed AS (  -- as section_roofed, by all filled classes
            SELECT c.n, count(*) FILTER (WHERE abs(c.angle) < 45) * 3 * $2 >= 90 AS has_roof,
                count(*) FILTER (WHERE abs(c.angle) > 135) * 3 * $2 >= 90 AS has_floor
            FROM class c
            GROUP BY c.n
        ), total AS (
            SELECT c.n, sum(c.points)::bigint AS points, sum(c.u) / sum(c.points) AS u, sum(c.w) / sum(c.points) AS w
            FROM class c
            GROUP BY c.n
        )
        SELECT t.n, coalesce(s.shift, t.u), coalesce(u.shift, t.w), t.points
        FROM total t
        LEFT JOIN sideward s ON s.n = t.n
        LEFT JOIN upward u ON u.n = t.n
        JOIN roofed r ON r.n = t.n
        WHERE (r.has_roof OR NOT r.has_floor OR NOT (SELECT bool_or(o.has_roof) FROM roofed o)) AND t.points >= $3 AND (s.shift IS NOT NULL OR s.is_low IS NOT TRUE)
        ORDER BY t.n
    $query$, CASE WHEN near = 0 THEN '(' || tunnel_internal.axis_source(axis_shift.survey_id, axis_shift.n, axis_shift.half_width) || ')'
                  ELSE near::text END)
    USING axis_shift.half_width, axis_shift.angle_step, axis_shift.min_points,
        axis_shift.n, axis_shift.x, axis_shift.y, axis_shift.z;
END
$$;
COMMENT ON FUNCTION tunnel_internal.axis_shift(int, int[], float8[], float8[], float8[], float8, float8, int, regclass) IS
'One pass of stage axis: offset of the tunnel''s centre from each vertex, to the right and up in its plane, m, from the points within half_width of the plane, averaged by angular class. After Gonçalves et al. (2012), stage 1';


-- Deviation of each vertex from its neighbours, m: the smaller of two values. First, the difference between its shift from
-- the given axis and the mean shift of its neighbours. Second, its distance from the parabola or cubic through its
-- neighbours. A given axis that bends where the tunnel does not makes the first large, a sudden curve of the tunnel the
-- second; a wrong vertex makes both large. At an end, the first uses the one neighbour, and the second extrapolates the
-- parabola through three vertices. x, y, z: positions; gx, gy, gz: positions on the given axis, m. Neighbours are adjacent in
-- the arrays.
CREATE OR REPLACE FUNCTION tunnel_internal.axis_residual(
    n int[], x float8[], y float8[], z float8[], gx float8[], gy float8[], gz float8[])
RETURNS TABLE (n int, deviation float8)
LANGUAGE sql IMMUTABLE PARALLEL SAFE STRICT
ROWS 100
AS $$
    WITH axis AS (  -- of each coordinate: its place p, and its shift d from the given axis
        SELECT v.n, c.p, c.p - c.g AS d, c.k
        FROM unnest($1, $2, $3, $4, $5, $6, $7) AS v (n, x, y, z, gx, gy, gz)
        CROSS JOIN LATERAL (VALUES (1, v.x, v.gx), (2, v.y, v.gy), (3, v.z, v.gz)) AS c (k, p, g)
    ), residual AS (
        SELECT a.n,
            a.d - coalesce((lag(a.d) OVER along + lead(a.d) OVER along) / 2, lag(a.d) OVER along, lead(a.d) OVER along) AS shift,
            a.p - coalesce(
                (4 * (lag(a.p) OVER along + lead(a.p) OVER along) - lag(a.p, 2) OVER along - lead(a.p, 2) OVER along) / 6,
                (lag(a.p) OVER along + lead(a.p) OVER along) / 2,
                3 * lag(a.p) OVER along - 3 * lag(a.p, 2) OVER along + lag(a.p, 3) OVER along,
                3 * lead(a.p) OVER along - 3 * lead(a.p, 2) OVER along + lead(a.p, 3) OVER along) AS place
        FROM axis a
        WINDOW along AS (PARTITION BY a.k ORDER BY a.n)
    )
    SELECT r.n, sqrt(least(sum(r.shift ^ 2), sum(r.place ^ 2))) FROM residual r GROUP BY r.n ORDER BY r.n
$$;
COMMENT ON FUNCTION tunnel_internal.axis_residual(int[], float8[], float8[], float8[], float8[], float8[], float8[]) IS
'Deviation of each vertex of an axis from its neighbours, m: the smaller of the difference between its shift and theirs, and its distance from the curve through them';


-- Move the vertices of a kilometre to the tunnel's centre, pass by pass, and write them to tunnel.axis_vertex. Every run
-- starts from the given axis (or from vertices edited by hand, which stay). Vertices up to two spacings beyond the kilometre
-- are computed as well, so that the result does not depend on the order of kilometres. A vertex without points gets the shift
-- of its neighbours and is marked interpolated. So is one that does not converge in max_iterations passes or deviates from
-- its neighbours by more than max_deviation (axis_residual; four times that if fewer than four vertices are measured, which
-- determine no curve); among adjacent ones the worst first, then the others are checked
-- again. axis_vertex.remark states the reason. Ends when all others converged, or when more than max_rejected (and more than
-- one) were rejected.
CREATE OR REPLACE FUNCTION tunnel_internal.axis_refine(
    survey_id int, km int,
    half_width float8 DEFAULT 1.0, angle_step float8 DEFAULT 5.0,
    tolerance float8 DEFAULT 0.002, max_iterations int DEFAULT 20, min_points int DEFAULT 100,
    max_deviation float8 DEFAULT 0.5, max_rejected float8 DEFAULT 0.3)
RETURNS TABLE (iteration int, moved float8, measured int)
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT
ROWS 10
AS $$
#variable_conflict use_column
DECLARE
    spacing float8;
    halo constant int := 2;
    share float8;
    vn int[]; vx float8[]; vy float8[]; vz float8[];
    gx float8[]; gy float8[]; gz float8[];
    fixed boolean[]; counts bigint[]; moves float8[];
    why text[];  -- why a vertex was rejected, NULL for others
    rejected int := 0;
    since int := 0;  -- pass in which the last one was
    worse text[];
    near constant text := tunnel_internal.axis_near_name(survey_id, km);
    ox float8[]; oy float8[]; oz float8[];  -- the vertices when the points near them were set aside
BEGIN
    SELECT t.spacing INTO STRICT spacing
    FROM tunnel.survey s JOIN tunnel.tunnel t ON t.id = s.tunnel_id WHERE s.id = axis_refine.survey_id;

    SELECT array_agg(a.n ORDER BY a.n), array_agg(public.ST_X(a.start) ORDER BY a.n), array_agg(public.ST_Y(a.start) ORDER BY a.n),
        array_agg(public.ST_Z(a.start) ORDER BY a.n), array_agg(a.source = 'edited' ORDER BY a.n)
    INTO vn, vx, vy, vz, fixed
    FROM (SELECT v.n, v.source, CASE WHEN v.source = 'edited' THEN v.geom ELSE v.given END AS start
          FROM tunnel.axis_vertex v
          WHERE v.survey_id = axis_refine.survey_id
            AND v.n BETWEEN ceil(axis_refine.km * 1000 / spacing) - halo
                        AND ceil((axis_refine.km + 1) * 1000 / spacing) - 1 + halo) a;
    IF vn IS NULL THEN
        RAISE EXCEPTION 'survey % has no axis in kilometre %', axis_refine.survey_id, axis_refine.km;
    END IF;
    gx := vx; gy := vy; gz := vz;
    why := array_fill(NULL::text, ARRAY[cardinality(vn)]);

    FOR pass IN 1 .. axis_refine.max_iterations * cardinality(vn) LOOP
        -- a vertex may oscillate by a few millimetres as points enter and leave the slab: later passes move it a part of the way
        share := least(1.0, 5.0 / pass);
        IF ox IS NULL OR tunnel_internal.axis_astray(vn, vx, vy, vz, ox, oy, oz) THEN
            PERFORM tunnel_internal.axis_near(axis_refine.survey_id, axis_refine.km, vn, vx, vy, vz, axis_refine.half_width);
            ox := vx; oy := vy; oz := vz;
        END IF;
        WITH frame AS (
            SELECT f.*, g.gx, g.gy, g.gz, g.fixed, g.why
            FROM tunnel_internal.axis_frame(vn, vx, vy, vz) f
            JOIN unnest(vn, gx, gy, gz, fixed, why) AS g (n, gx, gy, gz, fixed, why) ON g.n = f.n
        ), shifted AS (
            SELECT f.n, f.gx, f.gy, f.gz, f.fixed, f.x, f.y, f.z, s.points,
                -- in its plane, so that the given axis keeps its chainage
                f.x + share * (s."right" * f.ux + s.up * f.wx) AS sx,
                f.y + share * (s."right" * f.uy + s.up * f.wy) AS sy,
                f.z + share * s.up * f.wz AS sz
            FROM frame f
            LEFT JOIN tunnel_internal.axis_shift(axis_refine.survey_id, vn, vx, vy, vz,
                axis_refine.half_width, axis_refine.angle_step, axis_refine.min_points,
                to_regclass('tunnel.' || quote_ident(near))) s
                ON s.vertex = f.n AND NOT f.fixed AND f.why IS NULL
        ), bounded AS (
            SELECT f.*,
                max(f.n) FILTER (WHERE f.sx IS NOT NULL) OVER (ORDER BY f.n) AS before,
                min(f.n) FILTER (WHERE f.sx IS NOT NULL) OVER (ORDER BY f.n DESC) AS after
            FROM shifted f
        ), placed AS (
            SELECT b.n, b.points, b.x, b.y, b.z,
                CASE WHEN b.fixed THEN b.x WHEN b.sx IS NOT NULL THEN b.sx
                     ELSE b.gx + coalesce((1 - w.g) * (p.sx - p.gx) + w.g * (q.sx - q.gx), p.sx - p.gx, q.sx - q.gx, 0) END AS nx,
                CASE WHEN b.fixed THEN b.y WHEN b.sx IS NOT NULL THEN b.sy
                     ELSE b.gy + coalesce((1 - w.g) * (p.sy - p.gy) + w.g * (q.sy - q.gy), p.sy - p.gy, q.sy - q.gy, 0) END AS ny,
                CASE WHEN b.fixed THEN b.z WHEN b.sx IS NOT NULL THEN b.sz
                     ELSE b.gz + coalesce((1 - w.g) * (p.sz - p.gz) + w.g * (q.sz - q.gz), p.sz - p.gz, q.sz - q.gz, 0) END AS nz
            FROM bounded b
            LEFT JOIN shifted p ON p.n = b.before
            LEFT JOIN shifted q ON q.n = b.after
            CROSS JOIN LATERAL (SELECT (b.n - b.before)::float8 / nullif(b.after - b.before, 0) AS g) w
        )
        SELECT array_agg(p.nx ORDER BY p.n), array_agg(p.ny ORDER BY p.n), array_agg(p.nz ORDER BY p.n),
            array_agg(coalesce(p.points, 0) ORDER BY p.n), count(p.points)::int,
            array_agg(sqrt((p.nx - p.x) ^ 2 + (p.ny - p.y) ^ 2 + (p.nz - p.z) ^ 2) ORDER BY p.n)
        INTO vx, vy, vz, counts, measured, moves
        FROM placed p;
        iteration := pass;
        moved := (SELECT max(m) FROM unnest(moves) m);
        RETURN NEXT;
        CONTINUE WHEN moved >= axis_refine.tolerance AND pass - since < axis_refine.max_iterations;

        WITH measured_vertex AS (
            SELECT v.* FROM unnest(vn, vx, vy, vz, gx, gy, gz, moves, counts, fixed)
                AS v (n, x, y, z, gx, gy, gz, moved, points, fixed)
            WHERE v.points > 0 OR v.fixed
        ), deviating AS (
            SELECT d.n, d.deviation
            FROM (SELECT array_agg(v.n ORDER BY v.n) AS n, array_agg(v.x ORDER BY v.n) AS x, array_agg(v.y ORDER BY v.n) AS y,
                      array_agg(v.z ORDER BY v.n) AS z, array_agg(v.gx ORDER BY v.n) AS gx,
                      array_agg(v.gy ORDER BY v.n) AS gy, array_agg(v.gz ORDER BY v.n) AS gz
                  FROM measured_vertex v) a
            CROSS JOIN LATERAL tunnel_internal.axis_residual(a.n, a.x, a.y, a.z, a.gx, a.gy, a.gz) d
        ), bound AS (  -- up to three vertices determine no curve: a bend of 60 m radius is 1.7 m off a chord of 30 m
            SELECT axis_refine.max_deviation * CASE WHEN count(*) < 4 THEN 4 ELSE 1 END AS most FROM measured_vertex
        ), fault AS (  -- how many times the limit
            SELECT v.n, v.moved, d.deviation, d.deviation > b.most AS off,
                greatest(v.moved / axis_refine.tolerance, d.deviation / b.most) AS times
            FROM bound b CROSS JOIN measured_vertex v LEFT JOIN deviating d ON d.n = v.n
            WHERE NOT v.fixed AND (v.moved >= axis_refine.tolerance OR d.deviation > b.most)
        ), worst AS (
            SELECT f.n, CASE WHEN f.off THEN format('lies %s m off where its neighbours lead', round(f.deviation::numeric, 2))
                ELSE format('still moves by %s m after %s passes', round(f.moved::numeric, 4), pass - since) END AS why
            FROM fault f
            WHERE NOT EXISTS (SELECT FROM fault g WHERE g.n <> f.n AND abs(g.n - f.n) <= 2
                                AND (g.off, g.times, g.n) > (f.off, f.times, f.n))
        )
        SELECT array_agg(coalesce(o.why, w.why) ORDER BY o.n), count(w.n) + rejected
        INTO worse, rejected
        FROM unnest(vn, why) AS o (n, why) LEFT JOIN worst w ON w.n = o.n;
        EXIT WHEN worse IS NOT DISTINCT FROM why;
        why := worse;
        since := pass;
        EXIT WHEN rejected > greatest(1, axis_refine.max_rejected * measured);
    END LOOP;
    EXECUTE format('DROP TABLE tunnel.%I', near);

    UPDATE tunnel.axis_vertex v
    SET geom = public.ST_SetSRID(public.ST_MakePoint(p.x, p.y, p.z), public.ST_SRID(v.given)),
        points = p.points,
        source = CASE WHEN p.points > 0 THEN 'measured' ELSE 'interpolated' END,
        remark = p.why
    FROM unnest(vn, vx, vy, vz, counts, why) AS p (n, x, y, z, points, why)
    -- vertices of the next kilometre are written here if it has no points; else its own run writes them
    WHERE v.survey_id = axis_refine.survey_id AND v.n = p.n AND v.source <> 'edited'
      AND (v.km = axis_refine.km
           OR to_regclass(format('tunnel.%I', tunnel_internal.partition_name(v.survey_id, v.km))) IS NULL);
END
$$;
COMMENT ON FUNCTION tunnel_internal.axis_refine(int, int, float8, float8, float8, int, int, float8, float8) IS
'Stage axis for one kilometre: move the axis vertices to the tunnel''s centre until no vertex moves by more than tolerance (m) in a pass, and return the passes with their largest move, m. Vertices edited by hand stay. Vertices that do not converge in max_iterations passes, or deviate from their neighbours by more than max_deviation (m), are interpolated with a remark, up to a share max_rejected. After Gonçalves et al. (2012), stages 1 and 2';
