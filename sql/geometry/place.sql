-- Clock positions and ring numbers. Short enough for the planner to inline them.

-- Clock position (hours) as text: 12.5 and 0.5 are 12:30, 11.999 is 12:00.
CREATE OR REPLACE FUNCTION tunnel_api.clock_text(clock float8)
RETURNS text
LANGUAGE sql IMMUTABLE STRICT PARALLEL SAFE
AS $$
    SELECT (((round($1 * 60)::int % 720 + 1380) % 720) / 60 + 1)::text || ':'
        || lpad(((round($1 * 60)::int % 720 + 720) % 60)::text, 2, '0')
$$;
COMMENT ON FUNCTION tunnel_api.clock_text(float8) IS
'Clock position (hours; 12 is the crown, 3 the right wall looking up-chainage) as text: 0.5 → 12:30';


-- True if a clock position lies between two others, clockwise, ends included; all in hours.
CREATE OR REPLACE FUNCTION tunnel_api.clock_between(clock float8, clock_from float8, clock_to float8)
RETURNS boolean
LANGUAGE sql IMMUTABLE STRICT PARALLEL SAFE
AS $$
    SELECT $1 - $2 - 12 * floor(($1 - $2) / 12) <= $3 - $2 - 12 * floor(($3 - $2) / 12)
$$;
COMMENT ON FUNCTION tunnel_api.clock_between(float8, float8, float8) IS
'True if a clock position lies between two others (hours), clockwise, ends included: 10 to 2 passes the crown, 2 to 10 the floor';


-- Number of the ring at a chainage, for rings of one length, the first of which begins at first_chainage; all in m. A joint
-- belongs to the ring that begins there, also after rounding.
CREATE OR REPLACE FUNCTION tunnel_api.ring_number(chainage float8, ring_length float8, first_chainage float8)
RETURNS int
LANGUAGE sql IMMUTABLE STRICT PARALLEL SAFE
AS $$
    SELECT floor(($1 - $3) / $2 + 1e-9)::int + 1
$$;
COMMENT ON FUNCTION tunnel_api.ring_number(float8, float8, float8) IS
'Number of the ring at a chainage (m), from the ring length (m) and the chainage of the beginning of ring 1 (m), as in ring_statistics; 0 or negative before ring 1';
