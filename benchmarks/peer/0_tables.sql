-- The peer: the five stages of Gonçalves et al. (2012) as a GIS person would first write them in plain SQL.
-- One table of points, one GiST index on it; all lengths in metres, coordinates in EPSG:25830.
-- Stage 2, editing the axis by hand, has nothing to run.

DROP SCHEMA IF EXISTS peer CASCADE;
CREATE SCHEMA peer;

CREATE TABLE peer.given_axis (geom geometry(LineStringZ, 25830));

CREATE TABLE peer.point (
    id        bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
    geom      geometry(PointZ, 25830),
    intensity real,
    gps_time  double precision,
    scan_id   integer,
    segment   integer
);
