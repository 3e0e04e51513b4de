-- Stage 1, one pass: a line perpendicular to the direction from the previous to the next point, 10 m to either
-- side, a buffer of 1 m around it, and the average of all points of the cloud inside the buffer. `moved` is how
-- far the vertex went sideways or in height: along the axis it only follows the chance density of the points.

WITH neighbour AS (
    SELECT n, geom,
        coalesce(lag(geom) OVER along, geom) AS previous,
        coalesce(lead(geom) OVER along, geom) AS next
    FROM peer.axis
    WINDOW along AS (ORDER BY n)
), direction AS (
    SELECT n, geom, ST_Azimuth(previous, next) AS azimuth
    FROM neighbour
), perpendicular AS (
    SELECT n, azimuth, ST_SetSRID(ST_MakeLine(
        ST_MakePoint(ST_X(geom) - 10 * cos(azimuth), ST_Y(geom) + 10 * sin(azimuth)),
        ST_MakePoint(ST_X(geom) + 10 * cos(azimuth), ST_Y(geom) - 10 * sin(azimuth))), 25830) AS geom
    FROM direction
), buffer AS (
    SELECT n, azimuth, ST_Buffer(geom, 1.0, 'endcap=flat') AS geom
    FROM perpendicular
), average AS (
    SELECT b.n, b.azimuth, avg(ST_X(p.geom)) AS x, avg(ST_Y(p.geom)) AS y, avg(ST_Z(p.geom)) AS z
    FROM buffer AS b
    JOIN peer.point AS p ON ST_Contains(b.geom, p.geom)
    GROUP BY b.n, b.azimuth
)
UPDATE peer.axis AS a
SET geom = ST_SetSRID(ST_MakePoint(v.x, v.y, v.z), 25830),
    moved = sqrt(power((v.x - ST_X(a.geom)) * cos(v.azimuth) - (v.y - ST_Y(a.geom)) * sin(v.azimuth), 2) + power(v.z - ST_Z(a.geom), 2))
FROM average AS v
WHERE v.n = a.n;
