-- Stage 3: at each vertex a plane perpendicular to the axis (direction from the previous to the next vertex),
-- materialised 15 m to either side; between two planes lies a segment, and every point is tagged with its own.

CREATE TABLE peer.segment AS
WITH neighbour AS (
    SELECT n, geom,
        ST_Azimuth(coalesce(lag(geom) OVER along, geom), coalesce(lead(geom) OVER along, geom)) AS azimuth
    FROM peer.axis
    WINDOW along AS (ORDER BY n)
), plane AS (
    SELECT n, geom,
        ST_MakePoint(ST_X(geom) - 15 * cos(azimuth), ST_Y(geom) + 15 * sin(azimuth)) AS left_end,
        ST_MakePoint(ST_X(geom) + 15 * cos(azimuth), ST_Y(geom) - 15 * sin(azimuth)) AS right_end
    FROM neighbour
), pair AS (
    SELECT n AS id, geom AS first, lead(geom) OVER along AS last,
        left_end AS l0, right_end AS r0, lead(left_end) OVER along AS l1, lead(right_end) OVER along AS r1
    FROM plane
    WINDOW along AS (ORDER BY n)
)
SELECT id,
    coalesce(sum(ST_Distance(first, last)) OVER (ORDER BY id ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING), 0)
        AS chainage,
    ST_MakeLine(first, last) AS axis,
    ST_SetSRID(ST_MakePolygon(ST_MakeLine(ARRAY[l0, r0, r1, l1, l0])), 25830) AS geom
FROM pair
WHERE last IS NOT NULL;

ALTER TABLE peer.segment ADD PRIMARY KEY (id);
CREATE INDEX segment_geom_idx ON peer.segment USING gist (geom);
ANALYZE peer.segment;

UPDATE peer.point AS p
SET segment = s.id
FROM peer.segment AS s
WHERE ST_Contains(s.geom, p.geom);

CREATE INDEX point_segment_idx ON peer.point (segment);
ANALYZE peer.point;
