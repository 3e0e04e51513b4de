-- Largest number of leaks and largest wet area in any 100 m² of lining: a window is moved along a stretch with more lining than
-- that. Positions along the stretch are measured in m² of lining, so that a leak is an interval [a, b] and every window has the
-- length 100. A window that begins at s contains a leak for s from a - 100 to b; the number of leaks changes at these positions
-- only. The area of a leak is spread evenly over its interval; the wet area in the window is then piecewise linear in s, and its
-- maximum lies at a bend or at an end of the stretch.
--
-- places: ends of the leaks and of the stretch, sorted; turns: change of the wet area per m² of lining there (positive at the
-- beginning of a leak, negative at its end, 0 at the ends of the stretch). A loop takes one pass; a query would take several sorts.
CREATE OR REPLACE FUNCTION tunnel_internal.slide_window(
    places float8[], turns float8[], OUT patches int, OUT window_from float8, OUT wet_area float8)
LANGUAGE plpgsql IMMUTABLE PARALLEL SAFE STRICT
AS $$
DECLARE
    size constant int := cardinality(places);
    first_begin constant float8 := places[1];
    last_begin constant float8 := places[size] - 100;
    entering int := 1;  -- index of the next place to enter the window
    leaving int := 1;  -- index of the next place to leave it
    enters float8 := places[1] - 100;  -- begin of the window at that moment
    leaves float8 := places[1];
    s float8 := enters;  -- begin of the window
    before float8;
    turn float8;
    slope float8 := 0;  -- of the wet area in the window
    held float8 := 0;
    inside int := 0;
    growing boolean := false;  -- true while the number of leaks is at its maximum since window_from
BEGIN
    patches := 0;
    window_from := first_begin;
    wet_area := 0;
    LOOP
        before := s;
        IF enters <= leaves THEN
            s := enters;
            held := held + slope * (s - before);
            turn := turns[entering];
            slope := slope + turn;
            IF turn > 0 THEN
                inside := inside + 1;
                IF inside > patches THEN
                    patches := inside;
                    window_from := greatest(s, first_begin);
                    growing := true;
                END IF;
            END IF;
            IF held > wet_area AND s >= first_begin THEN
                wet_area := held;
            END IF;
            EXIT WHEN entering = size;
            entering := entering + 1;
            enters := places[entering] - 100;
        ELSE
            s := leaves;
            held := held + slope * (s - before);
            turn := turns[leaving];
            slope := slope - turn;
            IF turn < 0 THEN
                inside := inside - 1;
                IF growing THEN  -- middle of the range with the maximum
                    window_from := (window_from + s) / 2;
                    growing := false;
                END IF;
            END IF;
            IF held > wet_area THEN
                wet_area := held;
            END IF;
            leaving := leaving + 1;
            leaves := places[leaving];
        END IF;
    END LOOP;
    IF growing THEN
        window_from := (window_from + last_begin) / 2;
    END IF;
    IF patches = 0 THEN
        window_from := NULL;
    END IF;
END
$$;
COMMENT ON FUNCTION tunnel_internal.slide_window(float8[], float8[]) IS
'Largest number of leaks in a window of 100 m² moved along a stretch, the beginning of that window (NULL without leaks), and the largest wet area in a window. places (m² of lining) and turns (wet area per m² of lining) are those of stretch_statistics';
