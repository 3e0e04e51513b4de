-- Stage 4 of Gonçalves et al. (2012) for a kilometre: collect classes, compute curves, compare neighbours, write rows.

-- The narrowest slab in which each section of a kilometre may have what section_gather asks for: half_width, twice that, or
-- four times where nine classes of ten do not hold enough points even before any is left out. For who need not try the others.
-- section: segment * 100 + half.
CREATE OR REPLACE FUNCTION tunnel_internal.section_least_width(
    survey_id int, km int, angle_step float8, half_width float8, min_points int)
RETURNS TABLE (section int, width float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT
ROWS 200
AS $$
    WITH polar AS (
        SELECT p.segment * 100 + p.half AS section, q.away,
            floor((degrees(atan2(q.u, q.w)) + 180) / section_least_width.angle_step) AS class
        FROM tunnel_internal.section_plane(section_least_width.survey_id, section_least_width.km) p
        CROSS JOIN LATERAL tunnel_internal.section_slab(
            section_least_width.survey_id, p.chainage, p.frame, 2 * section_least_width.half_width) q
        OFFSET 0
    ), class AS (
        SELECT p.section, count(*) AS twice,
            count(*) FILTER (WHERE p.away <= section_least_width.half_width + 1e-6) AS once  -- rounding must leave none out
        FROM polar p
        GROUP BY p.section, p.class
        HAVING count(*) >= 4 * section_least_width.min_points
    ), filled AS (
        SELECT c.section, count(*) AS twice, count(*) FILTER (WHERE c.once >= 4 * section_least_width.min_points) AS once
        FROM class c
        GROUP BY c.section
    )
    SELECT p.segment * 100 + p.half, section_least_width.half_width
        * CASE WHEN f.once >= 0.9 * n.classes THEN 1 WHEN f.twice >= 0.9 * n.classes THEN 2 ELSE 4 END
    FROM tunnel_internal.section_plane(section_least_width.survey_id, section_least_width.km) p
    CROSS JOIN (SELECT round(360 / section_least_width.angle_step) AS classes) n
    LEFT JOIN filled f ON f.section = p.segment * 100 + p.half
$$;
COMMENT ON FUNCTION tunnel_internal.section_least_width(int, int, float8, float8, int) IS
'Narrowest slab of each section (segment * 100 + half) of a kilometre in which 90 % of the angular classes hold four times min_points points: half_width, or a width of at least four times that, m';


-- Angular classes of each section of a kilometre, as arrays over the classes (NULL for an empty one).
--
-- The slab of a section begins at half_width to both sides of its plane and doubles, up to four times that, until nine classes
-- of ten hold four times min_points points: enough for their median to tell the wall from the cables and brackets before it,
-- the bolt pockets in it. Where profiles are far apart it widens further, up to max_half_width, until nine of ten hold
-- min_points: a class of so many counts. Slabs that have too few points from the outset are passed over.
CREATE OR REPLACE FUNCTION tunnel_internal.section_gather(
    survey_id int, km int, angle_step float8, half_width float8, max_half_width float8, min_points int)
RETURNS TABLE (
    segment int, half int2, width float8,
    radius float8[], slope float8[], sigma float8[], spread float8[], points bigint[])
LANGUAGE plpgsql STABLE PARALLEL SAFE STRICT
ROWS 200
SET enable_mergejoin = off  -- it would match classes by their section alone
AS $$
#variable_conflict use_column
DECLARE
    classes constant int := round(360 / angle_step);
    slab float8 := least(half_width, max_half_width);
    pending int[];  -- sections, segment * 100 + half
    widths float8[];  -- where each begins
    finished int[] := '{}'::int[];
BEGIN
    SELECT array_agg(l.section), array_agg(least(l.width, max_half_width)) INTO pending, widths
    FROM tunnel_internal.section_least_width(
        section_gather.survey_id, section_gather.km, section_gather.angle_step, slab, section_gather.min_points) l;
    WHILE cardinality(pending) > 0 LOOP
        FOR segment, half, width, radius, slope, sigma, spread, points IN
            WITH class AS MATERIALIZED (
                SELECT c.* FROM tunnel_internal.section_classes(
                    section_gather.survey_id, section_gather.km, slab, section_gather.angle_step,
                    ARRAY(SELECT w.section FROM unnest(pending, widths) AS w (section, width) WHERE w.width <= slab)) c
                WHERE c.points >= section_gather.min_points
            ), done AS (
                SELECT c.segment, c.half
                FROM class c
                GROUP BY c.segment, c.half
                HAVING count(*) FILTER (WHERE c.points >= section_gather.min_points
                                            * CASE WHEN slab < 4 * section_gather.half_width THEN 4 ELSE 1 END) >= 0.9 * classes
                    OR slab >= section_gather.max_half_width
            )
            SELECT d.segment, d.half, slab, array_agg(c.radius ORDER BY i), array_agg(c.slope ORDER BY i),
                array_agg(c.sigma ORDER BY i), array_agg(c.spread ORDER BY i), array_agg(coalesce(c.points, 0) ORDER BY i)
            FROM done d
            CROSS JOIN generate_series(0, classes - 1) AS i
            LEFT JOIN class c ON c.segment = d.segment AND c.half = d.half AND c.class = i
            GROUP BY d.segment, d.half
        LOOP
            RETURN NEXT;
            finished := finished || (segment * 100 + half);
        END LOOP;
        SELECT array_agg(w.section), array_agg(w.width) INTO pending, widths
        FROM unnest(pending, widths) AS w (section, width) WHERE w.section <> ALL (finished);
        EXIT WHEN slab >= max_half_width;
        slab := least(2 * slab, max_half_width);
    END LOOP;
END
$$;
COMMENT ON FUNCTION tunnel_internal.section_gather(int, int, float8, float8, float8, int) IS
'Angular classes of each section of a kilometre as arrays. The slab (width: half its length, m) is widened until 90 % of the classes hold four times min_points points, or min_points points from four times half_width on. Classes with that many points are used';


-- True if a section has a roof: at least a third of the classes within 45° of upwards show a surface (sigma: of the classes,
-- NULL for an empty one). Points that scatter by more than 0.25 m along their class are not on a surface across it: a portal's
-- face fills classes from the lining outwards. Portals and open cuts have no roof and no lining.
CREATE OR REPLACE FUNCTION tunnel_internal.section_roofed(angle_step float8, sigma float8[])
RETURNS boolean
LANGUAGE sql IMMUTABLE PARALLEL SAFE STRICT
AS $$
    SELECT count(*) FILTER (WHERE k.sigma <= 0.25) * 3 >= count(*)
    FROM unnest($2) WITH ORDINALITY AS k (sigma, class)
    WHERE abs((k.class - 0.5) * $1 - 180) < 45
$$;
COMMENT ON FUNCTION tunnel_internal.section_roofed(float8, float8[]) IS
'True if at least a third of the angular classes within 45° of upwards show a surface; without a roof there is no lining. sigma: standard deviation of the points of the classes from -180°, m, at most 0.25 on a surface; NULL for an empty class';


-- Parts of a kilometre with a floor and no roof, and therefore without sections: chainage that each such plane represents, m.
CREATE OR REPLACE FUNCTION tunnel_internal.section_open(
    survey_id int, km int, angle_step float8, max_half_width float8, min_points int)
RETURNS TABLE (chainage_from float8, chainage_to float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT
ROWS 10
AS $$
    WITH class AS MATERIALIZED (
        SELECT c.segment, c.half, c.class, c.radius, c.sigma
        FROM (SELECT coalesce(array_agg(p.segment * 100 + p.half), '{}') AS missing
              FROM tunnel_internal.section_plane($1, $2) p
              WHERE NOT EXISTS (SELECT FROM tunnel.section s
                                WHERE s.survey_id = $1 AND s.km = $2 AND s.segment = p.segment AND s.half = p.half)) m
        CROSS JOIN LATERAL tunnel_internal.section_classes($1, $2, $4, $3, m.missing) c
        WHERE c.points >= $5
    ), seen AS (
        SELECT d.segment, d.half, array_agg(c.sigma ORDER BY i) AS sigma,
            count(c.radius) FILTER (WHERE abs((i + 0.5) * $3 - 180) > 135) * 3
                >= count(*) FILTER (WHERE abs((i + 0.5) * $3 - 180) > 135) AS floored
        FROM (SELECT DISTINCT c.segment, c.half FROM class c) d
        CROSS JOIN generate_series(0, round(360 / $3)::int - 1) AS i
        LEFT JOIN class c ON c.segment = d.segment AND c.half = d.half AND c.class = i
        GROUP BY d.segment, d.half
    )
    SELECT s.chainage_from + (q.half - 25) / 100.0 * (s.chainage_to - s.chainage_from),
        s.chainage_from + (q.half + 25) / 100.0 * (s.chainage_to - s.chainage_from)
    FROM seen q JOIN tunnel.segment s ON s.survey_id = $1 AND s.km = $2 AND s.n = q.segment
    WHERE q.floored AND NOT tunnel_internal.section_roofed($3, q.sigma)
    ORDER BY 1
$$;
COMMENT ON FUNCTION tunnel_internal.section_open(int, int, float8, float8, int) IS
'Parts of a kilometre with a floor but no roof (portals, open cuts), which have no sections: chainage from and to of each plane, m';


-- Curves of the sections of a kilometre. Sections without a roof are left out. Each section is compared with the two before
-- and the two after it (at the ends of the kilometre, with the nearest four), class by class. A class that protrudes from
-- their median by more than protrusion, and by more than the usual difference between sections there, contains a fixture that
-- the section alone did not separate from the wall: it is rejected, and the curve is computed again. If more than a quarter
-- of the classes protrude, the tunnel is narrower there, and nothing is rejected. Below the water nothing is rejected:
-- objects there were removed by the class of their points, and the bed varies freely.
CREATE OR REPLACE FUNCTION tunnel_internal.section_curves(
    survey_id int, km int, angle_step float8, half_width float8, max_half_width float8, min_points int, protrusion float8)
RETURNS TABLE (
    segment int, half int2, width float8, slope float8[], sigma float8[], points bigint[],
    node_radius float8[], node_arc float8[], class_radius float8[], class_state text[])
LANGUAGE sql STABLE PARALLEL SAFE STRICT
ROWS 200
SET enable_nestloop = off  -- the planner expects few classes and would compare each with every other
AS $$
    WITH gathered AS MATERIALIZED (
        SELECT row_number() OVER (ORDER BY g.segment, g.half) AS i, g.*
        FROM tunnel_internal.section_gather(section_curves.survey_id, section_curves.km, section_curves.angle_step,
            section_curves.half_width, section_curves.max_half_width, section_curves.min_points) g
        WHERE tunnel_internal.section_roofed(section_curves.angle_step, g.sigma)
    ), alone AS MATERIALIZED (
        SELECT g.i, q.*
        FROM gathered g
        CROSS JOIN LATERAL tunnel_internal.section_curve(
            section_curves.angle_step, g.radius, g.slope, g.sigma, g.spread, section_curves.protrusion) q
        WHERE q.node_radius IS NOT NULL
    ), class AS (
        SELECT a.i, k.class, k.radius
        FROM alone a CROSS JOIN LATERAL unnest(a.class_radius) WITH ORDINALITY AS k (radius, class)
    ), beside AS (
        SELECT c.i, c.class, c.radius, c.radius - percentile_cont(0.5) WITHIN GROUP (ORDER BY o.radius) AS apart
        FROM (SELECT c.*, greatest(least(c.i - 2, n.sections - 4), 1) + d AS other
              FROM class c CROSS JOIN (SELECT count(*) AS sections FROM gathered) n CROSS JOIN generate_series(0, 4) AS d) c
        JOIN class o ON o.i = c.other AND o.i <> c.i AND o.class = c.class
        GROUP BY c.i, c.class, c.radius
        HAVING count(*) >= 3
    ), usual AS (
        SELECT b.i, greatest(section_curves.protrusion,
            3 * 1.4826 * percentile_cont(0.5) WITHIN GROUP (ORDER BY abs(b.apart))) AS tolerance
        FROM beside b
        GROUP BY b.i
    ), hung AS (
        SELECT b.i, array_agg(b.class::int) AS classes
        FROM beside b JOIN usual u ON u.i = b.i
        JOIN gathered g ON g.i = b.i
        JOIN tunnel_internal.section_plane(section_curves.survey_id, section_curves.km) p ON p.segment = g.segment AND p.half = g.half
        WHERE b.apart < -u.tolerance AND NOT EXISTS (
            SELECT FROM tunnel.water_level w
            WHERE w.survey_id = section_curves.survey_id AND w.km = section_curves.km
                AND p.frame[3] - p.frame[12] * b.radius * cosd((b.class - 0.5) * section_curves.angle_step) < w.height)
        GROUP BY b.i
        HAVING count(*) * 4 <= round(360 / section_curves.angle_step)
    ), again AS (
        SELECT h.i, h.classes, q.*
        FROM hung h
        JOIN gathered g ON g.i = h.i
        CROSS JOIN LATERAL (
            SELECT array_agg(CASE WHEN k.class = ANY (h.classes) THEN NULL ELSE k.radius END ORDER BY k.class) AS radius
            FROM unnest(g.radius) WITH ORDINALITY AS k (radius, class)) r
        CROSS JOIN LATERAL tunnel_internal.section_curve(
            section_curves.angle_step, r.radius, g.slope, g.sigma, g.spread, section_curves.protrusion) q
        WHERE q.node_radius IS NOT NULL
    )
    SELECT g.segment, g.half, g.width, g.slope, g.sigma, g.points,
        coalesce(b.node_radius, a.node_radius), coalesce(b.node_arc, a.node_arc), coalesce(b.class_radius, a.class_radius),
        CASE WHEN b.i IS NULL THEN a.class_state
             ELSE (SELECT array_agg(CASE WHEN k.class = ANY (b.classes) THEN 'rejected' ELSE k.state END ORDER BY k.class)
                   FROM unnest(b.class_state) WITH ORDINALITY AS k (state, class)) END
    FROM gathered g
    JOIN alone a ON a.i = g.i
    LEFT JOIN again b ON b.i = g.i
    ORDER BY g.i
$$;
COMMENT ON FUNCTION tunnel_internal.section_curves(int, int, float8, float8, float8, int, float8) IS
'Curves of the sections of a kilometre, each checked against its neighbours: radius and arc (m) at each degree from -180° to 180°; radius and state of each angular class';


-- Write the sections of a kilometre to tunnel.section and tunnel.section_class, replacing existing ones, and return their
-- number.
CREATE OR REPLACE FUNCTION tunnel_internal.section_build(
    survey_id int, km int,
    angle_step float8 DEFAULT 5.0, half_width float8 DEFAULT 0.15, max_half_width float8 DEFAULT 2.5, min_points int DEFAULT 5,
    protrusion float8 DEFAULT 0.03)
RETURNS int
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT
AS $$
DECLARE
    built int;
BEGIN
    IF abs(180 / angle_step - round(180 / angle_step)) > 1e-9 OR angle_step < 1 THEN
        RAISE EXCEPTION 'angle_step must divide 180 degrees and be at least 1, not %', angle_step;
    END IF;
    DELETE FROM tunnel.section s WHERE s.survey_id = section_build.survey_id AND s.km = section_build.km;
    WITH curve AS MATERIALIZED (
        SELECT c.*, p.chainage, p.frame
        FROM tunnel_internal.section_curves(section_build.survey_id, section_build.km, section_build.angle_step,
            section_build.half_width, section_build.max_half_width, section_build.min_points, section_build.protrusion) c
        JOIN tunnel_internal.section_plane(section_build.survey_id, section_build.km) p ON p.segment = c.segment AND p.half = c.half
    ), written AS (
        INSERT INTO tunnel.section (survey_id, km, segment, half, chainage, half_width, angle_step, radius, arc, geom,
            points, interpolated)
        SELECT section_build.survey_id, section_build.km, c.segment, c.half, c.chainage, c.width, section_build.angle_step,
            c.node_radius, c.node_arc,
            (SELECT public.ST_MakeLine(array_agg(public.ST_SetSRID(public.ST_MakePoint(
                c.frame[1] + g.u * c.frame[7] + g.w * c.frame[10],
                c.frame[2] + g.u * c.frame[8] + g.w * c.frame[11],
                c.frame[3] + g.w * c.frame[12]), t.srid) ORDER BY g.i))
             FROM (SELECT i, c.node_radius[i] * sind(i - 181) AS u, c.node_radius[i] * cosd(i - 181) AS w
                   FROM generate_series(1, 361) AS i) g),
            (SELECT sum(q) FROM unnest(c.points) q),
            (SELECT count(*) FROM unnest(c.class_state) q WHERE q <> 'measured')
        FROM curve c
        CROSS JOIN tunnel.survey s JOIN tunnel.tunnel t ON t.id = s.tunnel_id
        WHERE s.id = section_build.survey_id
        RETURNING section.id, section.segment, section.half
    ), detail AS (
        INSERT INTO tunnel.section_class (section_id, class, angle, radius, slope, sigma, points, state)
        SELECT w.id, k.class - 1, -180 + (k.class - 0.5) * section_build.angle_step, k.radius, k.slope, k.sigma, k.points, k.state
        FROM written w
        JOIN curve c ON c.segment = w.segment AND c.half = w.half
        CROSS JOIN LATERAL ROWS FROM (
            unnest(c.class_radius), unnest(c.slope), unnest(c.sigma), unnest(c.points), unnest(c.class_state))
            WITH ORDINALITY AS k (radius, slope, sigma, points, state, class)
    )
    SELECT count(*) INTO built FROM written;
    RETURN built;
END
$$;
COMMENT ON FUNCTION tunnel_internal.section_build(int, int, float8, float8, float8, int, float8) IS
'Stage sections for one kilometre: rewrite tunnel.section and tunnel.section_class, and return the number of sections. angle_step in degrees, widths in m. Source: Gonçalves et al. (2012), stage 4';
