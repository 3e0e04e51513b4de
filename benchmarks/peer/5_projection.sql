-- Stage 5: for every point the nearest section, its two nearest points and the corresponding points of the other
-- section; the length along either section to the top, and their average, weighted so that the nearer section
-- counts more; on the map by equation (1). Points farther than 0.5 m from the section are not on the surface.

CREATE TABLE peer.projected AS
WITH in_planes AS (
    SELECT p.id, p.intensity, p.segment, a.azimuth, a.geom AS main,
        a.chainage + ea * cos(a.slope) AS chainage, ea AS along_a, eb AS along_b,
        ST_MakePoint(ax * cos(a.azimuth) - ay * sin(a.azimuth),
                     az * cos(a.slope) - (ax * sin(a.azimuth) + ay * cos(a.azimuth)) * sin(a.slope)) AS in_a,
        ST_MakePoint(bx * cos(b.azimuth) - by * sin(b.azimuth),
                     bz * cos(b.slope) - (bx * sin(b.azimuth) + by * cos(b.azimuth)) * sin(b.slope)) AS in_b
    FROM peer.point AS p
    JOIN peer.section AS a ON a.segment = p.segment AND a.half = 25
    JOIN peer.section AS b ON b.segment = p.segment AND b.half = 75
    CROSS JOIN LATERAL (SELECT ST_X(p.geom) - ST_X(a.geom) AS ax, ST_Y(p.geom) - ST_Y(a.geom) AS ay,
                               ST_Z(p.geom) - ST_Z(a.geom) AS az) AS from_a
    CROSS JOIN LATERAL (SELECT ST_X(p.geom) - ST_X(b.geom) AS bx, ST_Y(p.geom) - ST_Y(b.geom) AS by,
                               ST_Z(p.geom) - ST_Z(b.geom) AS bz) AS from_b
    CROSS JOIN LATERAL (
        SELECT (ax * sin(a.azimuth) + ay * cos(a.azimuth)) * cos(a.slope) + az * sin(a.slope) AS ea,
               (bx * sin(b.azimuth) + by * cos(b.azimuth)) * cos(b.slope) + bz * sin(b.slope) AS eb) AS e
), nearest AS MATERIALIZED (
    SELECT id, intensity, segment, azimuth, main, chainage, along_a,
        CASE WHEN abs(along_a) <= abs(along_b) THEN 25 ELSE 75 END AS near,
        CASE WHEN abs(along_a) <= abs(along_b) THEN 75 ELSE 25 END AS far,
        CASE WHEN abs(along_a) <= abs(along_b) THEN in_a ELSE in_b END AS in_near,
        CASE WHEN abs(along_a) <= abs(along_b) THEN in_b ELSE in_a END AS in_far,
        least(abs(along_a), abs(along_b)) AS d1, greatest(abs(along_a), abs(along_b)) AS d2
    FROM in_planes
), located AS (
    SELECT q.id, q.intensity, q.azimuth, q.main, q.along_a, q.chainage, q.d1, q.d2,
        ST_Distance(ST_MakeLine(n[1], n[2]), q.in_near) AS off_surface,
        n_arc[1] + (n_arc[2] - n_arc[1]) * ST_LineLocatePoint(ST_MakeLine(n[1], n[2]), q.in_near) AS d3,
        f_arc[1] + (f_arc[2] - f_arc[1]) * ST_LineLocatePoint(ST_MakeLine(f[1], f[2]), q.in_far) AS d4
    FROM nearest AS q
    CROSS JOIN LATERAL (
        SELECT array_agg(two.geom) AS n, array_agg(two.arc) AS n_arc,
            array_agg(other.geom) AS f, array_agg(other.arc) AS f_arc
        FROM (
            SELECT class, geom, arc
            FROM peer.section_point
            WHERE segment = q.segment AND half = q.near
            ORDER BY ST_Distance(geom, q.in_near)
            LIMIT 2
        ) AS two
        JOIN peer.section_point AS other
            ON other.segment = q.segment AND other.half = q.far AND other.class = two.class
    ) AS four
), unrolled AS (
    SELECT id, intensity, azimuth, main, along_a, chainage, (d2 * d3 + d1 * d4) / (d1 + d2) AS arc
    FROM located
    WHERE off_surface <= 0.5
)
SELECT id, intensity, chainage, arc, ST_SetSRID(ST_MakePoint(
    ST_X(main) + along_a * sin(azimuth) + arc * cos(azimuth),
    ST_Y(main) + along_a * cos(azimuth) - arc * sin(azimuth)), 25830) AS geom
FROM unrolled;
