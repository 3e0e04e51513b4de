-- Outlines of findings that people draw: checks, computed values, new and changed outlines. Needs drawn_figures
-- (geometry/drawn.sql).

-- Refuse a kind that does not exist, is inactive, or may not be drawn with this geometry.
CREATE OR REPLACE FUNCTION tunnel_internal.check_kind(kind text, drawn geometry) RETURNS void
LANGUAGE plpgsql STABLE PARALLEL SAFE CALLED ON NULL INPUT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
#variable_conflict use_variable
DECLARE
    way constant text := CASE public.ST_Dimension(drawn) WHEN 0 THEN 'point' WHEN 1 THEN 'line' WHEN 2 THEN 'polygon' END;
    its tunnel.finding_kind;
BEGIN
    SELECT k.* INTO its FROM tunnel.finding_kind k WHERE k.code = kind AND k.active;
    IF NOT FOUND THEN
        RAISE EXCEPTION 'the kind of a finding can be %, not %',
            (SELECT string_agg(k.code, ', ' ORDER BY k.position, k.code) FROM tunnel.finding_kind k WHERE k.active),
            coalesce(tunnel_internal.excerpt(kind), 'empty') USING ERRCODE = 'check_violation';
    ELSIF way <> ALL (its.geometries) THEN
        RAISE EXCEPTION '% is drawn as %, not as %', kind, array_to_string(its.geometries, ' or '), way
            USING ERRCODE = 'check_violation';
    END IF;
END
$$;
COMMENT ON FUNCTION tunnel_internal.check_kind(text, geometry) IS
    'Raise an error unless a kind of findings with this code can be drawn with this geometry, or with any if none is given';

CREATE OR REPLACE FUNCTION tunnel_internal.check_finding(kind text, severity int, width_mm float8, review text, remark text)
RETURNS void
LANGUAGE plpgsql IMMUTABLE PARALLEL SAFE CALLED ON NULL INPUT SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    widest constant int := CASE kind WHEN 'crack' THEN 100 ELSE 10000 END;  -- mm
BEGIN
    IF severity NOT BETWEEN 1 AND 4 THEN
        RAISE EXCEPTION 'the severity of a finding is 1 to 4, not %', severity USING ERRCODE = 'check_violation';
    ELSIF NOT width_mm BETWEEN 0.01 AND widest THEN
        RAISE EXCEPTION 'a % is 0.01 to % mm wide, not % mm: widths are in millimetres',
            kind, widest, width_mm USING ERRCODE = 'check_violation';
    END IF;
    PERFORM tunnel_internal.check_review('a finding', review, remark);
END
$$;
COMMENT ON FUNCTION tunnel_internal.check_finding(text, int, float8, text, text) IS
    'Raise an error unless severity, width (mm; of a crack at most 100), review and remark are valid';

-- Shape drawn in a view, in the unrolled plane: drawn there (finding_unrolled), on the map strip (finding_map) or in space
-- (finding_3d).
CREATE OR REPLACE FUNCTION tunnel_internal.drawn_in(survey_id int, place text, geom geometry) RETURNS geometry
LANGUAGE plpgsql STABLE PARALLEL SAFE CALLED ON NULL INPUT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
#variable_conflict use_variable
DECLARE
    given constant public.geometry := CASE WHEN public.ST_NumGeometries(geom) = 1 THEN public.ST_GeometryN(geom, 1) ELSE geom END;
    srid constant int := CASE place WHEN 'unrolled' THEN 0
        ELSE (SELECT t.srid FROM tunnel.survey s JOIN tunnel.tunnel t ON t.id = s.tunnel_id WHERE s.id = survey_id) END;
    unrolled public.geometry;
BEGIN
    PERFORM tunnel_internal.check_shape('the drawing', geom);
    IF given IS NULL OR public.ST_IsEmpty(given) OR public.ST_NumGeometries(given) > 1 THEN
        RETURN given;  -- drawn_figures reports it
    ELSIF public.ST_SRID(given) NOT IN (srid, 0) THEN
        RAISE EXCEPTION 'the drawing is in SRID %, the view in SRID %', public.ST_SRID(given), srid
            USING ERRCODE = 'invalid_parameter_value', HINT = 'Transform it first (ST_Transform).';
    ELSIF place = '3d' AND public.ST_NDims(given) < 3 THEN
        RAISE EXCEPTION 'a drawing in space needs heights'
            USING ERRCODE = 'invalid_parameter_value', HINT = 'Draw it with z, or in finding_map or finding_unrolled.';
    END IF;
    unrolled := CASE place WHEN 'unrolled' THEN given
                           WHEN 'map' THEN tunnel_internal.unmap_strip(survey_id, public.ST_SetSRID(given, srid))
                           ELSE tunnel_api.unroll_shape(survey_id, public.ST_SetSRID(given, srid)) END;
    IF unrolled IS NULL THEN
        RAISE EXCEPTION 'the drawing reaches beyond the lining: it lies between % and %',
            public.ST_AsText(public.ST_MakePoint(public.ST_XMin(given), public.ST_YMin(given)), 1),
            public.ST_AsText(public.ST_MakePoint(public.ST_XMax(given), public.ST_YMax(given)), 1)
            USING ERRCODE = 'invalid_parameter_value';
    END IF;
    RETURN unrolled;
END
$$;
COMMENT ON FUNCTION tunnel_internal.drawn_in(int, text, geometry) IS
    'Unrolled geometry of a shape drawn in a view (unrolled, map or 3d). Raises an error if it does not lie on the tunnel';

-- New outline of a finding: compute all dependent values, and clear the measured ones until the next detection measures the new
-- outline.
CREATE OR REPLACE FUNCTION tunnel_internal.redraw(id bigint, drawn geometry, width_mm float8, origin text) RETURNS void
LANGUAGE sql VOLATILE PARALLEL UNSAFE CALLED ON NULL INPUT SET search_path = pg_catalog, pg_temp AS $$
    UPDATE tunnel.finding a
       SET km = f.km, chainage_from = f.chainage_from, chainage_to = f.chainage_to, arc_from = f.arc_from, arc_to = f.arc_to,
           clock = f.clock, area = f.area, length = f.length, width_mm = $3, unrolled = f.unrolled, map = f.map, surface = f.surface,
           shape = f.shape, shape_map = f.shape_map, shape_surface = f.shape_surface, origin = $4, drawn_by = session_user,
           drawn_at = clock_timestamp(), detected = true, darkening_mean = NULL, darkening_max = NULL, image_share = NULL, contrast = NULL,
           confidence = NULL, reasons = '{}', evidence = NULL, features = NULL, feature_list_id = NULL, model = NULL,
           same_as = NULL, dry_region_id = NULL
      FROM tunnel.finding w
     CROSS JOIN LATERAL tunnel_internal.drawn_figures(w.survey_id, $2, $3) f
     WHERE w.id = $1 AND a.id = w.id
$$;
COMMENT ON FUNCTION tunnel_internal.redraw(bigint, geometry, float8, text) IS
    'Change the outline (unrolled plane) and origin of a finding, compute its values, and clear the measured ones. Only draw_finding, finding_split and finding_merge call it';

-- New finding, alone or as a part of another one. A finding that is restored keeps its id.
CREATE OR REPLACE FUNCTION tunnel_internal.add_finding(
    survey_id int, kind text, drawn geometry, width_mm float8, severity int, review text, remark text, origin text, manual boolean,
    parent_id bigint, id bigint DEFAULT NULL) RETURNS bigint
LANGUAGE sql VOLATILE PARALLEL UNSAFE CALLED ON NULL INPUT SET search_path = pg_catalog, pg_temp AS $$
    INSERT INTO tunnel.finding (id, survey_id, kind, width_mm, severity, review, reviewed_by, reviewed_at, remark, origin, manual,
        parent_id, drawn_by, drawn_at, km, chainage_from, chainage_to, arc_from, arc_to, clock, area, length, unrolled, map,
        surface, shape, shape_map, shape_surface, created_at) OVERRIDING SYSTEM VALUE
    SELECT coalesce($11, nextval('tunnel.finding_id_seq')), $1, $2, $4, $5, $6, CASE WHEN $6 <> 'open' THEN session_user END,
           CASE WHEN $6 <> 'open' THEN clock_timestamp() END, $7, $8, $9, $10, session_user, clock_timestamp(), f.km,
           f.chainage_from, f.chainage_to, f.arc_from, f.arc_to, f.clock, f.area, f.length, f.unrolled, f.map, f.surface, f.shape,
           f.shape_map, f.shape_surface, clock_timestamp()
      FROM tunnel_internal.drawn_figures($1, $3, $4) f
    RETURNING id
$$;
COMMENT ON FUNCTION tunnel_internal.add_finding(int, text, geometry, float8, int, text, text, text, boolean, bigint, bigint) IS
    'Insert a finding (unrolled plane) with all values computed from its outline, and return its id. Only draw_finding, finding_split and finding_undo call it';

-- After the surface changed, outlines in the unrolled plane stay. A finding that now extends beyond the lining stays as it was.
CREATE OR REPLACE FUNCTION tunnel_internal.renew_findings(survey_id int, km int) RETURNS void
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT SET search_path = pg_catalog, pg_temp AS $$
#variable_conflict use_column
DECLARE
    survey_key constant int := survey_id;
    kilometre constant int := km;
    was tunnel.finding;
BEGIN
    FOR was IN SELECT a.* FROM tunnel.finding a
                WHERE a.survey_id = survey_key AND a.km = kilometre AND a.origin <> 'detected' ORDER BY a.id FOR UPDATE LOOP
        BEGIN
            UPDATE tunnel.finding a
               SET clock = f.clock, area = f.area, length = f.length, map = f.map, surface = f.surface, shape_map = f.shape_map,
                   shape_surface = f.shape_surface
              FROM tunnel_internal.drawn_figures(survey_key, coalesce(was.shape, was.unrolled), was.width_mm) f
             WHERE a.id = was.id AND NOT (f.surface OPERATOR(public.=) was.surface AND f.map OPERATOR(public.=) was.map);
        EXCEPTION WHEN invalid_parameter_value THEN
            NULL;
        END;
    END LOOP;
END
$$;
COMMENT ON FUNCTION tunnel_internal.renew_findings(int, int) IS
'Compute the map and space geometries of drawn findings of a kilometre again after the axis or the sections changed; called by detection. Outlines in the unrolled plane stay';
