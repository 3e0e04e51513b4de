-- Stage 4: at 25 and 75 % of each segment a plane perpendicular to the axis and a box 0.2 m thick. The points in
-- the box are projected into the plane; polar coordinates from the upward direction; classes of 10 degrees; what
-- differs from the mean radius of its class by more than two standard deviations is left out; the centroids of
-- the classes are the section.

CREATE TABLE peer.section AS
WITH main AS (
    SELECT id AS segment, half, chainage + ST_Length(axis) * half / 100 AS chainage,
        ST_LineInterpolatePoint(axis, half / 100.0) AS geom,
        ST_Azimuth(ST_StartPoint(axis), ST_EndPoint(axis)) AS azimuth,
        atan2(ST_Z(ST_EndPoint(axis)) - ST_Z(ST_StartPoint(axis)), ST_Length(axis)) AS slope
    FROM peer.segment, unnest(ARRAY[25, 75]) AS half
)
SELECT segment, half, chainage, geom, azimuth, slope,
    ST_Buffer(ST_SetSRID(ST_MakeLine(
        ST_MakePoint(ST_X(geom) - 10 * cos(azimuth), ST_Y(geom) + 10 * sin(azimuth)),
        ST_MakePoint(ST_X(geom) + 10 * cos(azimuth), ST_Y(geom) - 10 * sin(azimuth))), 25830),
        0.1, 'endcap=flat') AS box
FROM main;

ALTER TABLE peer.section ADD PRIMARY KEY (segment, half);
ANALYZE peer.section;

CREATE TABLE peer.section_point AS
WITH inside AS (
    SELECT s.segment, s.half, s.azimuth, s.slope,
        ST_X(p.geom) - ST_X(s.geom) AS dx, ST_Y(p.geom) - ST_Y(s.geom) AS dy, ST_Z(p.geom) - ST_Z(s.geom) AS dz
    FROM peer.section AS s
    JOIN peer.point AS p ON ST_Contains(s.box, p.geom)
), in_plane AS (
    SELECT segment, half,
        dx * cos(azimuth) - dy * sin(azimuth) AS u,
        dz * cos(slope) - (dx * sin(azimuth) + dy * cos(azimuth)) * sin(slope) AS w
    FROM inside
), polar AS (
    SELECT segment, half, u, w, sqrt(u * u + w * w) AS radius,
        width_bucket(degrees(atan2(u, w)), -180, 180, 36) AS class
    FROM in_plane
), statistics AS (
    SELECT segment, half, class, avg(radius) AS mean, stddev(radius) AS sigma
    FROM polar
    GROUP BY segment, half, class
), centroid AS (
    SELECT segment, half, class, ST_MakePoint(avg(u), avg(w)) AS geom
    FROM polar
    JOIN statistics USING (segment, half, class)
    WHERE abs(radius - mean) <= 2 * sigma
    GROUP BY segment, half, class
), along AS (
    SELECT segment, half, class, geom,
        coalesce(ST_Distance(geom, lag(geom) OVER (PARTITION BY segment, half ORDER BY class)), 0) AS step
    FROM centroid
), measured AS (
    SELECT segment, half, class, geom, sum(step) OVER (PARTITION BY segment, half ORDER BY class) AS length
    FROM along
), top AS (
    SELECT DISTINCT ON (segment, half) segment, half, length
    FROM measured
    ORDER BY segment, half, abs(atan2(ST_X(geom), ST_Y(geom)))
)
-- geom: in the plane of the section, (right, up); arc: from the top, positive to the right
SELECT segment, half, class, geom, m.length - top.length AS arc
FROM measured AS m
JOIN top USING (segment, half);

ALTER TABLE peer.section_point ADD PRIMARY KEY (segment, half, class);
ANALYZE peer.section_point;
