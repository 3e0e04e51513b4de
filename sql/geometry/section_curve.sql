-- Curve of a cross-section through its angular classes.

-- Radius between two classes, by the cubic through both with their slopes: s from 0 to 1 is the share of the way, slopes are
-- in m over the whole way.
CREATE OR REPLACE FUNCTION tunnel_internal.section_between(
    s float8, radius_a float8, slope_a float8, radius_b float8, slope_b float8)
RETURNS float8
LANGUAGE sql IMMUTABLE PARALLEL SAFE CALLED ON NULL INPUT  -- so that it is inlined
AS $$
    SELECT radius_a + s * (slope_a + s * (
        3 * (radius_b - radius_a) - 2 * slope_a - slope_b + s * (2 * (radius_a - radius_b) + slope_a + slope_b)))
$$;
COMMENT ON FUNCTION tunnel_internal.section_between(float8, float8, float8, float8, float8) IS
'Radius (m) at the fraction s (0-1) between two angular classes: cubic Hermite curve through their radii (m) and slopes (m over the interval)';


-- Intersection of the lines of two classes: angle (degrees) and radius (m); NULL if it is not between the two classes.
-- The classes have the angles a and b (degrees); their lines have a radius (m) and a slope (m/m) in the frame of each class.
CREATE OR REPLACE FUNCTION tunnel_internal.section_corner(
    angle_a float8, radius_a float8, slope_a float8, angle_b float8, radius_b float8, slope_b float8)
RETURNS float8[]
LANGUAGE plpgsql IMMUTABLE PARALLEL SAFE STRICT
AS $$
DECLARE
    delta constant float8 := radians(angle_b - angle_a);
    -- in the frame of the first class: x to the right, y outwards
    x0 constant float8 := radius_b * sin(delta);
    y0 constant float8 := radius_b * cos(delta);
    dx constant float8 := cos(delta) + slope_b * sin(delta);
    dy constant float8 := slope_b * cos(delta) - sin(delta);
    cross_product constant float8 := dy - slope_a * dx;
    s float8;
    x float8;
    y float8;
    angle float8;
BEGIN
    IF abs(cross_product) < 1e-9 THEN
        RETURN NULL;
    END IF;
    s := (radius_a + slope_a * x0 - y0) / cross_product;
    x := x0 + s * dx;
    y := y0 + s * dy;
    angle := degrees(atan2(x, y));
    IF angle <= 0 OR angle >= angle_b - angle_a THEN
        RETURN NULL;
    END IF;
    RETURN ARRAY[angle_a + angle, sqrt(x * x + y * y)];
END
$$;
COMMENT ON FUNCTION tunnel_internal.section_corner(float8, float8, float8, float8, float8, float8) IS
'Angle (degrees) and radius (m) of the intersection of the lines of two angular classes; NULL if it does not lie between them';


-- Curve of a section: radius and arc at each whole degree from -180° to 180°, and the state of each class.
--
-- 1. Where the wall is curved, the points of a class lie inside its tangent by half the curvature times their variance
--    along it; the radius is corrected by this amount.
-- 2. A class that contains a corner (its points fit no line, and the lines of its neighbours meet in it) is replaced by the
--    corner. So are up to three adjacent classes if a pipe or a cable is next to the corner.
-- 3. Up to three adjacent classes are rejected as fixtures if they lie inwards of the smooth wall on both sides, by more than
--    `protrusion` and by more than the unevenness of the lining. The wall on both sides may begin behind up to three empty or
--    rejected classes. A chamfer between two walls is not a fixture: its points lie on a line.
-- 4. Between the remaining classes the curve is a cubic in polar coordinates, or two lines with a corner where the wall turns
--    by more than 30° at once. Empty and rejected classes are bridged and marked.
-- Arc is the length of this curve from the upward direction, positive to the right. NULL if less than a third of the classes
-- are filled, or if more than 120° in a row are empty.
-- radius (m), slope (m/m), sigma (m), spread (m²): of the classes in order from -180°, NULL for an empty one.
CREATE OR REPLACE FUNCTION tunnel_internal.section_curve(
    angle_step float8, radius float8[], slope float8[], sigma float8[], spread float8[], protrusion float8 DEFAULT 0.03,
    OUT node_radius float8[], OUT node_arc float8[], OUT class_radius float8[], OUT class_state text[])
LANGUAGE plpgsql IMMUTABLE PARALLEL SAFE CALLED ON NULL INPUT
AS $$
DECLARE
    classes constant int := round(360 / angle_step);
    step constant float8 := radians(angle_step);
    r float8[] := radius;       -- radius of each class
    b float8[] := slope;        -- slope of each class' line, m/m
    a int; c int; i int; j int; g int; first int; last int;
    turn float8; chord float8; usual float8; uneven float8; tolerance float8; loose float8;
    differences float8[] := '{}'::float8[];
    angles float8[] := '{}'::float8[]; radii float8[] := '{}'::float8[]; slopes float8[] := '{}'::float8[];   -- the classes left, once round and more
    apart boolean; chamfer boolean;
    beside int[];   -- classes before and after some, counted on from theirs
    wide float8; way float8;
    angle float8; x0 float8; y0 float8; x1 float8; y1 float8; cx float8; cy float8; length float8;
    corners float8[] := '{}'::float8[];   -- angle and radius of each corner
    at_corner float8[];
    pieces float8[] := array_fill(0::float8, ARRAY[360]);
BEGIN
    class_state := array_fill('measured'::text, ARRAY[classes]);
    FOR k IN 1 .. classes LOOP
        IF r[k] IS NULL THEN
            class_state[k] := 'interpolated';
        END IF;
    END LOOP;
    IF (SELECT count(*) FROM unnest(r) q WHERE q IS NOT NULL) * 3 < classes THEN
        RETURN;
    END IF;

    FOR k IN 1 .. classes LOOP
        CONTINUE WHEN r[k] IS NULL;
        a := (k + classes - 2) % classes + 1;
        c := k % classes + 1;
        -- points in less than half of the class determine no slope
        IF b[k] IS NULL OR spread[k] < (r[k] * step) ^ 2 / 48 THEN
            b[k] := coalesce((r[c] - r[a]) / (2 * step), (r[c] - r[k]) / step, (r[k] - r[a]) / step, 0) / r[k];
        END IF;
    END LOOP;

    -- 1. curvature
    FOR k IN 1 .. classes LOOP
        a := (k + classes - 2) % classes + 1;
        c := k % classes + 1;
        CONTINUE WHEN radius[k] IS NULL OR radius[a] IS NULL OR radius[c] IS NULL;
        turn := 2 * step - (atan(b[c]) - atan(b[a]));
        CONTINUE WHEN abs(turn) > radians(30) + 2 * step;
        chord := sqrt(radius[a] ^ 2 + radius[c] ^ 2 - 2 * radius[a] * radius[c] * cos(2 * step));
        r[k] := radius[k] + 0.5 * turn / chord * (1 + b[k] ^ 2) ^ 1.5
            * least(spread[k], (radius[k] * step) ^ 2 * (1 + b[k] ^ 2) / 8);
    END LOOP;

    -- unevenness of the lining: distance of each class from the curve through its neighbours
    FOR k IN 1 .. classes LOOP
        a := (k + classes - 2) % classes + 1;
        c := k % classes + 1;
        IF r[k] IS NOT NULL AND r[a] IS NOT NULL AND r[c] IS NOT NULL THEN
            differences := differences || abs(r[k] - tunnel_internal.section_between(
                0.5, r[a], 2 * step * r[a] * b[a], r[c], 2 * step * r[c] * b[c]));
        END IF;
    END LOOP;
    SELECT percentile_cont(0.5) WITHIN GROUP (ORDER BY q) INTO uneven FROM unnest(differences) q;
    SELECT percentile_cont(0.5) WITHIN GROUP (ORDER BY q) INTO usual FROM unnest(sigma) q;
    tolerance := greatest(protrusion, 3 * 1.4826 * uneven);

    -- 2. corners inside a class, or inside several classes without a line because of a corner and a fixture next to it
    FOR g IN 1 .. 3 LOOP
        loose := greatest(3 * usual, CASE WHEN g = 1 THEN 0.01 ELSE protrusion END);
        FOR k IN 1 .. classes LOOP
            -- classes k .. k+g-1 are between i and j, whose points lie on lines
            i := (k + classes - 2) % classes + 1;
            j := (k + g - 1) % classes + 1;
            CONTINUE WHEN r[i] IS NULL OR r[j] IS NULL OR sigma[i] > loose OR sigma[j] > loose;
            apart := true;
            FOR c IN 0 .. g - 1 LOOP
                a := (k + c - 1) % classes + 1;
                apart := apart AND r[a] IS NOT NULL AND sigma[a] > loose;
                EXIT WHEN NOT apart;
            END LOOP;
            CONTINUE WHEN NOT apart OR abs((g + 1) * step - (atan(b[j]) - atan(b[i]))) < radians(45)
                OR tunnel_internal.section_corner(0, r[i], b[i], (g + 1) * angle_step, r[j], b[j]) IS NULL;
            FOR c IN 0 .. g - 1 LOOP
                class_state[(k + c - 1) % classes + 1] := 'rejected';
            END LOOP;
        END LOOP;
    END LOOP;

    -- 3. fixtures on the wall
    FOR g IN 1 .. 3 LOOP
        FOR k IN 1 .. classes LOOP
            CONTINUE WHEN class_state[k] <> 'measured';
            -- classes k .. k+g-1 are between i and j, the next measured ones; the wall must be smooth before i and
            -- after j
            beside := ARRAY[k - 1, k - 2, k + g, k + g + 1];
            FOR c IN 1 .. 4 LOOP
                a := CASE WHEN c < 3 THEN -1 ELSE 1 END;
                IF c % 2 = 0 THEN
                    beside[c] := beside[c - 1] + a;
                END IF;
                FOR skipped IN 1 .. 3 LOOP
                    EXIT WHEN class_state[(beside[c] + 2 * classes - 1) % classes + 1] = 'measured';
                    beside[c] := beside[c] + a;
                END LOOP;
            END LOOP;
            first := (beside[2] + 2 * classes - 1) % classes + 1;
            i := (beside[1] + 2 * classes - 1) % classes + 1;
            j := (beside[3] - 1) % classes + 1;
            last := (beside[4] - 1) % classes + 1;
            CONTINUE WHEN class_state[first] <> 'measured' OR class_state[i] <> 'measured'
                OR class_state[j] <> 'measured' OR class_state[last] <> 'measured';
            way := (beside[3] - beside[1]) * step;
            -- if there is a corner between them, points that lie on lines are a chamfer
            chamfer := abs(way - (atan(b[j]) - atan(b[i]))) > radians(45);
            apart := true;
            FOR c IN k .. k + g - 1 LOOP
                a := (c - 1) % classes + 1;
                apart := apart AND class_state[a] = 'measured' AND NOT (chamfer AND sigma[a] <= greatest(3 * usual, 0.01))
                    AND r[a] < tunnel_internal.section_between((c - beside[1])::float8 / (beside[3] - beside[1]),
                        r[i], way * r[i] * b[i], r[j], way * r[j] * b[j]) - tolerance;
                EXIT WHEN NOT apart;
            END LOOP;
            CONTINUE WHEN NOT apart;
            wide := (beside[3] - beside[2]) * step;
            CONTINUE WHEN abs(r[i] - tunnel_internal.section_between(
                    (beside[1] - beside[2])::float8 / (beside[3] - beside[2]),
                    r[first], wide * r[first] * b[first], r[j], wide * r[j] * b[j])) > tolerance;
            wide := (beside[4] - beside[1]) * step;
            CONTINUE WHEN abs(r[j] - tunnel_internal.section_between(
                    (beside[3] - beside[1])::float8 / (beside[4] - beside[1]),
                    r[i], wide * r[i] * b[i], r[last], wide * r[last] * b[last])) > tolerance;
            FOR c IN 0 .. g - 1 LOOP
                class_state[(k + c - 1) % classes + 1] := 'rejected';
            END LOOP;
        END LOOP;
    END LOOP;

    -- the remaining classes, with the last ones repeated before -180° and the first ones after 180°
    FOR k IN 1 - classes .. 2 * classes LOOP
        c := (k + classes - 1) % classes + 1;
        IF class_state[c] = 'measured' THEN
            angle := -180 + (k - 0.5) * angle_step;
            IF angle > -360 AND angle < 360 THEN
                angles := angles || angle;
                radii := radii || r[c];
                slopes := slopes || b[c];
            END IF;
        END IF;
    END LOOP;

    -- 4. nodes, and the length between them
    node_radius := array_fill(0::float8, ARRAY[361]);
    i := 1;
    at_corner := NULL;
    FOR k IN -180 .. 180 LOOP
        IF k = -180 OR angles[i + 1] <= k THEN
            WHILE angles[i + 1] <= k LOOP
                i := i + 1;
            END LOOP;
            IF angles[i + 1] - angles[i] > 120 THEN
                node_radius := NULL;
                RETURN;
            END IF;
            turn := angles[i + 1] - angles[i] - degrees(atan(slopes[i + 1]) - atan(slopes[i]));
            way := radians(angles[i + 1] - angles[i]);
            at_corner := NULL;
            IF abs(turn) > greatest(30, 2.5 * (angles[i + 1] - angles[i])) THEN
                at_corner := tunnel_internal.section_corner(
                    angles[i], radii[i], slopes[i], angles[i + 1], radii[i + 1], slopes[i + 1]);
                IF at_corner IS NOT NULL THEN
                    corners := corners || at_corner;
                END IF;
            END IF;
        END IF;
        IF at_corner IS NULL THEN
            node_radius[k + 181] := tunnel_internal.section_between((k - angles[i]) / (angles[i + 1] - angles[i]),
                radii[i], way * radii[i] * slopes[i], radii[i + 1], way * radii[i + 1] * slopes[i + 1]);
        ELSE
            j := CASE WHEN k < at_corner[1] THEN i ELSE i + 1 END;
            node_radius[k + 181] := radii[j] / (cosd(k - angles[j]) - slopes[j] * sind(k - angles[j]));
        END IF;
    END LOOP;
    node_radius[361] := node_radius[1];

    g := 1;
    x1 := node_radius[1] * sind(-180);
    y1 := node_radius[1] * cosd(-180);
    FOR k IN 1 .. 360 LOOP
        x0 := x1;
        y0 := y1;
        x1 := node_radius[k + 1] * sind(k - 180);
        y1 := node_radius[k + 1] * cosd(k - 180);
        WHILE g < cardinality(corners) AND corners[g] < k - 181 LOOP
            g := g + 2;
        END LOOP;
        IF g < cardinality(corners) AND corners[g] < k - 180 THEN
            cx := corners[g + 1] * sind(corners[g]);
            cy := corners[g + 1] * cosd(corners[g]);
            pieces[k] := sqrt((cx - x0) ^ 2 + (cy - y0) ^ 2) + sqrt((x1 - cx) ^ 2 + (y1 - cy) ^ 2);
        ELSE
            pieces[k] := sqrt((x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0));
        END IF;
    END LOOP;
    node_arc := array_fill(0::float8, ARRAY[361]);
    length := 0;
    FOR k IN 181 .. 360 LOOP
        length := length + pieces[k];
        node_arc[k + 1] := length;
    END LOOP;
    length := 0;
    FOR k IN REVERSE 180 .. 1 LOOP
        length := length - pieces[k];
        node_arc[k] := length;
    END LOOP;

    class_radius := r;
    FOR k IN 1 .. classes LOOP
        IF class_state[k] <> 'measured' THEN
            angle := (k - 0.5) * angle_step;    -- from the first node
            i := floor(angle);
            class_radius[k] := node_radius[i + 1] + (angle - i) * (node_radius[i + 2] - node_radius[i + 1]);
        END IF;
    END LOOP;
END
$$;
COMMENT ON FUNCTION tunnel_internal.section_curve(float8, float8[], float8[], float8[], float8[], float8) IS
'Smooth closed curve of a section through its angular classes: radius and arc (m) at each degree from -180° to 180°; radius and state (measured, rejected, interpolated) of each class. After Gonçalves et al. (2012), stage 4, with a curve in place of the polygon';
