-- Wet area of a stretch, and the leaks nearest to a point.

-- Distances are measured in the unrolled plane, along the lining. There the index of the polygons returns the nearest ones first.
CREATE OR REPLACE FUNCTION tunnel_api.nearest_leaks(survey_id int, point geometry, wanted int DEFAULT 5)
RETURNS TABLE (id bigint, label text, chainage_from float8, chainage_to float8, clock float8, area float8, distance float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT
ROWS 5
SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
    SELECT l.id, l.label, l.chainage_from, l.chainage_to, l.clock, l.area, l.distance
    FROM tunnel_api.unroll($1, $2) u
    CROSS JOIN LATERAL (SELECT public.ST_MakePoint(u.chainage, u.arc) AS place) p
    CROSS JOIN LATERAL (
        SELECT a.id, a.label, a.chainage_from, a.chainage_to, a.clock, a.area, a.unrolled OPERATOR(public.<->) p.place AS distance
        FROM tunnel_api.leak a
        WHERE a.survey_id = $1 AND a.detected AND a.review <> 'rejected'
        ORDER BY a.unrolled OPERATOR(public.<->) p.place
        LIMIT $3) l
    WHERE u.chainage IS NOT NULL
    ORDER BY l.distance
$$;
COMMENT ON FUNCTION tunnel_api.nearest_leaks(int, geometry, int) IS
'Leaks nearest to a 3D point in the tunnel''s SRID, nearest first. Rejected leaks and leaks that the last detection did not find are left out. distance: along the lining, m, 0 on a leak, never across the seam in the middle of the floor. No rows if the point lies off the tunnel';


-- Wet area of a stretch of a survey, m² on the lining: leaks that the last detection found and nobody rejected, cut at both ends
-- of the stretch and of the survey. Leaks that are not cut are read from the index only, no farther than the longest leak can
-- reach.
CREATE OR REPLACE FUNCTION tunnel_api.wet_area(survey text, chainage_from float8, chainage_to float8)
RETURNS float8
LANGUAGE sql STABLE STRICT PARALLEL SAFE SECURITY DEFINER
SET search_path = pg_catalog, pg_temp
AS $$
    WITH given AS MATERIALIZED (
        SELECT s.id, greatest($2, e.chainage_from) AS low, least($3, e.chainage_to) AS high,
            (SELECT max(l.chainage_to - l.chainage_from) FROM tunnel.finding l WHERE l.survey_id = s.id) AS longest
        FROM tunnel.survey s CROSS JOIN LATERAL tunnel_api.survey_ends(s.id) e WHERE s.id = tunnel_api.survey_id($1)
    )
    SELECT CASE WHEN w.area IS NOT NULL OR w.searched THEN coalesce(w.area, 0) END
    FROM (
        SELECT sum(CASE WHEN l.chainage_from >= g.low AND l.chainage_to <= g.high THEN l.area
            ELSE (SELECT tunnel_internal.area_between(a.unrolled, a.area, g.low, g.high) FROM tunnel.finding a WHERE a.id = l.id) END)
            AS area,
            EXISTS (SELECT FROM given n JOIN tunnel.coverage c
                        ON c.survey_id = n.id AND c.km * 1000 < n.high AND (c.km + 1) * 1000 > n.low) AS searched
        FROM given g
        JOIN tunnel.finding l ON l.survey_id = g.id AND l.detected AND l.review <> 'rejected' AND l.wet AND NOT l.superseded
            AND l.chainage_from > g.low - 1e-6 - g.longest AND l.chainage_to > g.low AND l.chainage_from < g.high
        WHERE g.low < g.high AND tunnel_internal.in_order($2, $3)) w
$$;
COMMENT ON FUNCTION tunnel_api.wet_area(text, float8, float8) IS
'Wet area (m² on the lining) of a survey between two chainages (m). Rejected leaks and leaks that the last detection did not find are left out. NULL if no part was searched for leaks and no leak was drawn; coverage_gaps names stretches that were not searched';
