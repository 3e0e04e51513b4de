-- Stage 1, its start: points at a constant spacing of 10 m along the axis that was given.

CREATE TABLE peer.axis AS
WITH spaced AS (
    SELECT geom, ceil(ST_Length(geom) / 10)::integer AS steps, ST_Length(geom) AS length
    FROM peer.given_axis
)
SELECT n, ST_LineInterpolatePoint(geom, least(n * 10 / length, 1)) AS geom, NULL::double precision AS moved
FROM spaced, generate_series(0, steps) AS n;

ALTER TABLE peer.axis ADD PRIMARY KEY (n);
ANALYZE peer.axis;
