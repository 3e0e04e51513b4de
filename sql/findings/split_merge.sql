-- Splitting and merging findings.

-- Split a polygon or a line along a line of the unrolled plane or, in the tunnel's SRID, of the map strip.
CREATE OR REPLACE FUNCTION tunnel_api.finding_split(id bigint, line geometry) RETURNS bigint[]
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
#variable_conflict use_column
DECLARE
    finding constant bigint := id;
    was tunnel.finding;
    made bigint;
    before jsonb;
    name text;
    survey_key int;
    blade public.geometry;
    parts public.geometry[];
    part public.geometry;
    ids bigint[];
    kept jsonb;
    step bigint;
BEGIN
    SELECT a.survey_id, s.name INTO survey_key, name
      FROM tunnel.finding a JOIN tunnel.survey s ON s.id = a.survey_id WHERE a.id = finding;
    IF survey_key IS NULL THEN
        RAISE EXCEPTION 'there is no finding %', finding USING ERRCODE = 'invalid_parameter_value';
    END IF;
    PERFORM tunnel_internal.lock_findings(survey_key);
    SELECT a.* INTO was FROM tunnel.finding a WHERE a.id = finding FOR UPDATE;
    IF was.id IS NULL OR was.merged_into IS NOT NULL THEN
        RAISE EXCEPTION 'finding % is %', finding, coalesce('merged into ' || was.merged_into || ', which stands for it', 'gone')
            USING ERRCODE = 'feature_not_supported';
    END IF;
    PERFORM tunnel_internal.check_shape('the line', line);
    IF public.GeometryType(line) <> 'LINESTRING' OR public.GeometryType(was.shape) = 'POINT' THEN
        RAISE EXCEPTION 'a polygon or a line is split, by one line' USING ERRCODE = 'invalid_parameter_value';
    END IF;
    blade := public.ST_Force2D(tunnel_internal.drawn_in(survey_key, CASE public.ST_SRID(line) WHEN 0 THEN 'unrolled' ELSE 'map' END, line));
    SELECT array_agg(d.geom ORDER BY public.ST_Area(d.geom) DESC, public.ST_Length(d.geom) DESC, d.path) INTO parts
      FROM public.ST_Dump(public.ST_Split(coalesce(was.shape, was.unrolled), blade)) d;
    IF coalesce(cardinality(parts), 0) < 2 THEN
        RAISE EXCEPTION 'the line does not split finding %: it must cross it from side to side', finding
            USING ERRCODE = 'invalid_parameter_value';
    END IF;
    before := tunnel_internal.finding_state(finding);
    kept := tunnel_internal.finding_measured(finding);
    PERFORM tunnel_internal.redraw(finding, parts[1], was.width_mm, 'split');
    ids := ARRAY[finding];
    FOREACH part IN ARRAY parts[2:] LOOP
        ids := ids || tunnel_internal.add_finding(survey_key, coalesce(was.kind_override, was.kind), part, was.width_mm, was.severity, was.review,
                                             was.remark, 'split', was.manual, finding);
    END LOOP;
    step := tunnel_internal.note_edit(name, 'finding', finding, before, tunnel_internal.finding_state(finding), kept => kept);
    FOREACH made IN ARRAY ids[2:] LOOP
        PERFORM tunnel_internal.note_edit(name, 'finding', made, NULL, tunnel_internal.finding_state(made), part_of => step);
    END LOOP;
    PERFORM tunnel_internal.settle_findings(survey_key, was.unrolled);
    RETURN ids;
END
$$;
COMMENT ON FUNCTION tunnel_api.finding_split(bigint, geometry) IS
'Split a finding (a polygon or a line) along a line of the unrolled plane (SRID 0) or of the map strip (tunnel''s SRID). The larger part keeps the id and the review; the other parts are new findings with the same columns. Returns the ids, that of the larger part first';

-- Findings with a gap of less than 1 m are connected by a strip of 1 cm.
CREATE OR REPLACE FUNCTION tunnel_api.finding_merge(ids bigint[]) RETURNS bigint
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
#variable_conflict use_column
DECLARE
    wanted constant bigint[] := ARRAY(SELECT DISTINCT i FROM unnest(ids) i ORDER BY i);
    gap constant float8 := 1.0;
    most constant int := 1000;
    lapses boolean;
    surveys int[];
    name text;
    oldest tunnel.finding;
    was tunnel.finding;
    before jsonb;
    whole public.geometry;
    a_part public.geometry;
    rest public.geometry;
    place public.geometry;
    kept jsonb;
    step bigint;
BEGIN
    IF cardinality(wanted) < 2 THEN
        RAISE EXCEPTION 'at least two findings are merged' USING ERRCODE = 'invalid_parameter_value';
    ELSIF cardinality(wanted) > most THEN
        RAISE EXCEPTION '% findings are given, more than % that are merged at a time', cardinality(wanted), most
            USING ERRCODE = 'invalid_parameter_value';
    END IF;
    surveys := ARRAY(SELECT DISTINCT a.survey_id FROM tunnel.finding a WHERE a.id = ANY (wanted));
    IF cardinality(surveys) <> 1 OR (SELECT count(*) FROM tunnel.finding a WHERE a.id = ANY (wanted)) <> cardinality(wanted) THEN
        RAISE EXCEPTION 'findings % are not all there, or of several surveys', array_to_string(wanted, ', ')
            USING ERRCODE = 'invalid_parameter_value';
    END IF;
    PERFORM tunnel_internal.lock_findings(surveys[1]);
    PERFORM FROM tunnel.finding a WHERE a.id = ANY (wanted) ORDER BY a.id FOR UPDATE;
    name := (SELECT s.name FROM tunnel.survey s WHERE s.id = surveys[1]);
    SELECT a.* INTO oldest FROM tunnel.finding a WHERE a.id = ANY (wanted) ORDER BY a.created_at, a.id LIMIT 1;
    SELECT a.* INTO was FROM tunnel.finding a
     WHERE a.id = ANY (wanted) AND (a.merged_into IS NOT NULL OR a.review = 'rejected'
           OR coalesce(a.kind_override, a.kind) <> coalesce(oldest.kind_override, oldest.kind)
           OR public.ST_Dimension(coalesce(a.shape, a.unrolled)) <> public.ST_Dimension(coalesce(oldest.shape, oldest.unrolled))
           OR public.GeometryType(a.shape) = 'POINT')
     ORDER BY a.id LIMIT 1;
    IF FOUND THEN
        RAISE EXCEPTION 'finding % cannot be merged: %', was.id,
            CASE WHEN was.merged_into IS NOT NULL THEN 'it is merged into ' || was.merged_into
                 WHEN was.review = 'rejected' THEN 'it is rejected'
                 WHEN coalesce(was.kind_override, was.kind) <> coalesce(oldest.kind_override, oldest.kind)
                     THEN format('it is %s, finding %s %s', coalesce(was.kind_override, was.kind), oldest.id, coalesce(oldest.kind_override, oldest.kind))
                 ELSE 'polygons are merged with polygons, lines with lines, and points not' END
            USING ERRCODE = 'feature_not_supported';
    END IF;
    SELECT public.ST_Union(coalesce(a.shape, a.unrolled)), public.ST_Collect(a.unrolled) INTO whole, place
      FROM tunnel.finding a WHERE a.id = ANY (wanted);
    WHILE public.ST_NumGeometries(whole) > 1 LOOP
        IF public.ST_Dimension(whole) = 1 THEN
            whole := public.ST_LineMerge(whole);
            EXIT WHEN public.ST_NumGeometries(whole) = 1;
        END IF;
        a_part := public.ST_GeometryN(whole, 1);
        rest := (SELECT public.ST_Collect(d.geom) FROM public.ST_Dump(whole) d WHERE d.path[1] > 1);
        IF public.ST_Distance(a_part, rest) > gap OR (public.ST_Dimension(whole) = 1 AND public.ST_Distance(a_part, rest) = 0) THEN
            RAISE EXCEPTION 'findings % do not make one: %', array_to_string(wanted, ', '),
                CASE WHEN public.ST_Distance(a_part, rest) = 0 THEN 'the lines cross or branch'
                     ELSE format('they lie %s m apart, more than %s m', round(public.ST_Distance(a_part, rest)::numeric, 2), gap) END
                USING ERRCODE = 'invalid_parameter_value';
        END IF;
        whole := public.ST_Union(whole, CASE public.ST_Dimension(whole) WHEN 1 THEN public.ST_ShortestLine(a_part, rest)
                                      ELSE public.ST_Buffer(public.ST_ShortestLine(a_part, rest), 0.005) END);
    END LOOP;
    before := tunnel_internal.finding_state(oldest.id);
    kept := tunnel_internal.finding_measured(oldest.id);
    lapses := tunnel_internal.review_lapses(oldest.id, (SELECT public.ST_Union(coalesce(a.shape, a.unrolled)) FROM tunnel.finding a
                                                         WHERE a.id = ANY (wanted) AND a.review = oldest.review), whole);
    PERFORM tunnel_internal.redraw(oldest.id, whole, oldest.width_mm, 'merged');
    UPDATE tunnel.finding a
       SET severity = m.severity, remark = m.remark, review = CASE WHEN lapses THEN 'open' ELSE a.review END,
           reviewed_by = CASE WHEN lapses THEN NULL ELSE a.reviewed_by END,
           reviewed_at = CASE WHEN lapses THEN NULL ELSE a.reviewed_at END
      FROM (SELECT max(x.severity) AS severity, left(string_agg(DISTINCT x.remark, '; '), 10000) AS remark
              FROM tunnel.finding x WHERE x.id = ANY (wanted)) m
     WHERE a.id = oldest.id;
    -- the merged ids are listed even if the outline of the oldest did not change
    step := tunnel_internal.note_edit(name, 'finding', oldest.id, before,
        tunnel_internal.finding_state(oldest.id) || jsonb_build_object('merged', array_remove(wanted, oldest.id)), kept => kept);
    FOR was IN SELECT a.* FROM tunnel.finding a
                WHERE (a.id = ANY (wanted) OR a.merged_into = ANY (wanted)) AND a.id <> oldest.id
                  AND a.merged_into IS DISTINCT FROM oldest.id ORDER BY a.id FOR UPDATE LOOP
        before := tunnel_internal.finding_state(was.id);
        UPDATE tunnel.finding a SET merged_into = oldest.id, same_as = NULL WHERE a.id = was.id;
        PERFORM tunnel_internal.note_edit(name, 'finding', was.id, before, tunnel_internal.finding_state(was.id), part_of => step);
    END LOOP;
    PERFORM tunnel_internal.settle_findings(surveys[1], place);
    RETURN oldest.id;
END
$$;
COMMENT ON FUNCTION tunnel_api.finding_merge(bigint[]) IS
'Merge findings of one kind (polygons, or lines end to end) that touch or lie within 1 m. The oldest keeps its id and gets the outline of all, the highest severity and all remarks. It keeps its review, unless somebody else reviewed less than most of the outline. The others get the state merged and are not counted. Returns the id of the oldest';
