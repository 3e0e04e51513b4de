-- Stationing. All positions are stored and computed as chainage, i.e. distance; stations are for display and queries.
-- Stations jump where a tunnel was measured again, and can decrease with chainage. Each row of tunnel.station_equation begins
-- a piece with station = station of the row + direction × (chainage − chainage of the row). The first piece also applies
-- before its row. In a tunnel without rows, station equals chainage. Needs chainage_label and chainage_parse
-- (geometry/chainage.sql).

-- Key of a tunnel, by its name.
CREATE OR REPLACE FUNCTION tunnel_api.tunnel_id(tunnel text)
RETURNS int
LANGUAGE plpgsql STABLE PARALLEL SAFE STRICT
SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
DECLARE
    found int;
BEGIN
    SELECT t.id INTO found FROM tunnel.tunnel t WHERE t.name = tunnel;
    IF found IS NULL THEN
        RAISE EXCEPTION 'there is no tunnel %', left(tunnel, 63) USING HINT = 'SELECT name FROM tunnel_api.tunnel';
    END IF;
    RETURN found;
END
$$;
COMMENT ON FUNCTION tunnel_api.tunnel_id(text) IS 'Key of a tunnel, by its name. Raises an error if there is none';


-- Read by `stationing` as well: a view, because `stationing` runs with the caller's rights. Unused columns are not computed.
CREATE OR REPLACE VIEW tunnel_api.station_equation AS
SELECT e.tunnel_id::bigint * 10000000000 + 5000000000 + round(e.chainage * 1000)::bigint AS id, e.tunnel_id,
       (SELECT t.name FROM tunnel.tunnel t WHERE t.id = e.tunnel_id) AS tunnel, e.chainage,
       (SELECT b.station + b.direction * (e.chainage - b.chainage) FROM tunnel.station_equation b
         WHERE b.tunnel_id = e.tunnel_id AND b.chainage < e.chainage ORDER BY b.chainage DESC LIMIT 1) AS station_back,
       e.station, e.direction::integer AS direction, tunnel_api.chainage_label(e.station) AS label
  FROM tunnel.station_equation e;
COMMENT ON VIEW tunnel_api.station_equation IS
    'Station equations: chainages at which the stations of a tunnel begin, jump or reverse. In tunnels without rows, station equals chainage';
COMMENT ON COLUMN tunnel_api.station_equation.chainage IS
    'Chainage from which the row applies, m; the first row applies before it as well';
COMMENT ON COLUMN tunnel_api.station_equation.station_back IS
    'Station at this chainage by the previous row, m; NULL in the first row';
COMMENT ON COLUMN tunnel_api.station_equation.station IS 'Station at this chainage, m';
COMMENT ON COLUMN tunnel_api.station_equation.direction IS '1 if stations increase with chainage, -1 if they decrease';
COMMENT ON COLUMN tunnel_api.station_equation.label IS 'Station at this chainage, as 12+345.678';


-- Station (m) and its written form at a chainage (m) of a tunnel, one row. Neither STRICT nor with the owner's rights, so
-- that the planner puts it in the place of a call in FROM: in a view of many rows write
--   (SELECT label FROM tunnel_api.stationing(tunnel_id, chainage)) AS label
-- which costs nothing where the label is not asked for. Tunnels with equations are put into a hash once a query, so that
-- others pay a look into that.
CREATE OR REPLACE FUNCTION tunnel_api.stationing(tunnel_id int, chainage float8)
RETURNS TABLE (station float8, label text)
LANGUAGE sql STABLE PARALLEL SAFE CALLED ON NULL INPUT
ROWS 1
AS $$
    SELECT s.station, tunnel_api.chainage_label(s.station)
    FROM (SELECT CASE WHEN $1 IN (SELECT e.tunnel_id FROM tunnel_api.station_equation e) THEN coalesce(
            (SELECT e.station + e.direction * ($2 - e.chainage) FROM tunnel_api.station_equation e
             WHERE e.tunnel_id = $1 AND e.chainage <= $2 ORDER BY e.chainage DESC LIMIT 1),
            (SELECT e.station + e.direction * ($2 - e.chainage) FROM tunnel_api.station_equation e
             WHERE e.tunnel_id = $1 ORDER BY e.chainage LIMIT 1))
          ELSE $2 END AS station) s
$$;
COMMENT ON FUNCTION tunnel_api.stationing(int, float8) IS
'Station (m) at a chainage (m) of a tunnel, and its label 12+345.678. For many rows, in FROM; else use station or station_label';


-- Station (m) at a chainage (m) of a tunnel.
CREATE OR REPLACE FUNCTION tunnel_api.station(tunnel_id int, chainage float8)
RETURNS float8
LANGUAGE sql STABLE PARALLEL SAFE STRICT
AS $$
    SELECT s.station FROM tunnel_api.stationing($1, $2) s
$$;
COMMENT ON FUNCTION tunnel_api.station(int, float8) IS
'Station (m) at a chainage (m) of a tunnel; at a station equation, the station ahead';


-- The same as text.
CREATE OR REPLACE FUNCTION tunnel_api.station_label(tunnel_id int, chainage float8)
RETURNS text
LANGUAGE sql STABLE PARALLEL SAFE STRICT
AS $$
    SELECT s.label FROM tunnel_api.stationing($1, $2) s
$$;
COMMENT ON FUNCTION tunnel_api.station_label(int, float8) IS
'Station at a chainage (m) of a tunnel, as 12+345.678';


-- Pieces of a tunnel's stationing between its ends, by increasing chainage (m); one piece without equations.
CREATE OR REPLACE FUNCTION tunnel_api.station_pieces(tunnel_id int)
RETURNS TABLE (n int, chainage_from float8, chainage_to float8, station_from float8, station_to float8, direction int,
               label_from text, label_to text)
LANGUAGE sql STABLE PARALLEL SAFE STRICT
ROWS 5
SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
    WITH tunnel AS (
        SELECT t.start_chainage AS low, t.start_chainage + public.ST_Length(t.alignment) AS high FROM tunnel.tunnel t WHERE t.id = $1
    ), equation AS (
        SELECT e.chainage, e.station, e.direction FROM tunnel.station_equation e WHERE e.tunnel_id = $1
        UNION ALL
        SELECT 0, 0, 1 WHERE NOT EXISTS (SELECT FROM tunnel.station_equation e WHERE e.tunnel_id = $1)
    ), piece AS (
        SELECT e.*, CASE WHEN lag(e.chainage) OVER along IS NULL THEN t.low ELSE greatest(e.chainage, t.low) END AS low,
            least(lead(e.chainage) OVER along, t.high) AS high
        FROM equation e CROSS JOIN tunnel t
        WINDOW along AS (ORDER BY e.chainage)
    )
    SELECT (row_number() OVER (ORDER BY p.low))::int, p.low, p.high, q.low, q.high, p.direction::int,
        tunnel_api.chainage_label(q.low), tunnel_api.chainage_label(q.high)
    FROM piece p
    CROSS JOIN LATERAL (SELECT p.station + p.direction * (p.low - p.chainage) AS low,
                               p.station + p.direction * (p.high - p.chainage) AS high) q
    WHERE p.low < p.high
    ORDER BY p.low
$$;
COMMENT ON FUNCTION tunnel_api.station_pieces(int) IS
'Pieces of a tunnel''s stationing: chainages and stations (m) of their ends; direction is -1 where stations decrease';


-- Chainages (m) of a tunnel that have a station, given as 12+345.678 or in metres: none, one, or several where stations
-- overlap. At an equation both the station back and the station ahead apply. Tolerances: 0.5 mm, to which labels are rounded,
-- and the vertex spacing at the tunnel's ends, because the measured axis can be longer than the given one.
CREATE OR REPLACE FUNCTION tunnel_api.station_chainages(tunnel_id int, station text)
RETURNS SETOF float8
LANGUAGE sql STABLE PARALLEL SAFE STRICT
ROWS 1
SECURITY DEFINER SET search_path = pg_catalog, pg_temp
AS $$
    WITH place AS (
        SELECT p.chainage_from AS low, p.chainage_to AS high,
            p.chainage_from + p.direction * (tunnel_api.chainage_parse($2) - p.station_from) AS chainage,
            CASE WHEN p.n = min(p.n) OVER () THEN t.spacing ELSE 0.0005 END AS before,
            CASE WHEN p.n = max(p.n) OVER () THEN t.spacing ELSE 0.0005 END AS beyond
        FROM tunnel_api.station_pieces($1) p JOIN tunnel.tunnel t ON t.id = $1
    )
    SELECT DISTINCT CASE WHEN abs(p.chainage - p.low) <= 0.0005 THEN p.low
                         WHEN abs(p.chainage - p.high) <= 0.0005 THEN p.high ELSE p.chainage END AS chainage
    FROM place p
    WHERE p.chainage BETWEEN p.low - p.before AND p.high + p.beyond
    ORDER BY chainage
$$;
COMMENT ON FUNCTION tunnel_api.station_chainages(int, text) IS
'Chainages (m) of a tunnel that have a station (12+345.678, or metres): none, one, or several where stations overlap';
