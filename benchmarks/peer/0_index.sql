-- After the load: the spatial index, and statistics for the planner.

CREATE INDEX point_geom_idx ON peer.point USING gist (geom);
ANALYZE peer.point;
