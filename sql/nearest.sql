-- The leaks nearest to a point.

-- Distances are taken in the unrolled plane, along the lining, so that a leak behind a corner or on the other wall is as far as
-- one has to go. There the index on the polygons gives the nearest ones first.
CREATE OR REPLACE FUNCTION tunnel_api.nearest_leaks(survey_id int, point geometry, wanted int DEFAULT 5)
RETURNS TABLE (id bigint, label text, chainage_from float8, chainage_to float8, clock float8, area float8, distance float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT
ROWS 5
SECURITY DEFINER SET search_path = pg_catalog, public, pg_temp
AS $$
    SELECT l.id, l.label, l.chainage_from, l.chainage_to, l.clock, l.area, l.distance
    FROM tunnel_api.unroll($1, $2) u
    CROSS JOIN LATERAL (SELECT ST_MakePoint(u.chainage, u.arc) AS place) p
    CROSS JOIN LATERAL (
        SELECT a.id, a.label, a.chainage_from, a.chainage_to, a.clock, a.area, a.unrolled <-> p.place AS distance
        FROM tunnel_api.leak a
        WHERE a.survey_id = $1 AND a.detected AND a.review <> 'rejected'
        ORDER BY a.unrolled <-> p.place
        LIMIT $3) l
    WHERE u.chainage IS NOT NULL
    ORDER BY l.distance
$$;
COMMENT ON FUNCTION tunnel_api.nearest_leaks(int, geometry, int) IS
'The leaks, found last and not rejected, nearest to a point in the tunnel''s SRID, nearest first: distance along the lining from where the point stands over it (m), 0 on a leak; not across the seam in the middle of the floor, so that a leak beyond it is as far as over the crown. None where the point lies off the tunnel.';
