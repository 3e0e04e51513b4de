-- A review applies to the outline that was reviewed. If somebody else draws another one, the finding is open again.

-- Lines and points are compared as strips and circles of 0.1 m.
CREATE OR REPLACE FUNCTION tunnel_internal.outline_change(before geometry, after geometry) RETURNS float8
LANGUAGE sql IMMUTABLE PARALLEL SAFE STRICT SET search_path = pg_catalog, pg_temp AS $$
    SELECT public.ST_Area(public.ST_SymDifference(o.before, o.after)) / public.ST_Area(o.before)
      FROM (SELECT CASE public.ST_Dimension($1) WHEN 2 THEN $1 ELSE public.ST_Buffer($1, 0.1) END AS before,
                   CASE public.ST_Dimension($2) WHEN 2 THEN $2 ELSE public.ST_Buffer($2, 0.1) END AS after) o
$$;
COMMENT ON FUNCTION tunnel_internal.outline_change(geometry, geometry) IS
    'Area that two outlines of the unrolled plane do not share, as a share of the first';

-- Outline at the last review: the one before the first change of the outline alone since.
CREATE OR REPLACE FUNCTION tunnel_internal.reviewed_outline(finding_id bigint) RETURNS geometry
LANGUAGE sql VOLATILE PARALLEL UNSAFE STRICT SET search_path = pg_catalog, pg_temp AS $$
    SELECT coalesce((SELECT public.ST_GeomFromEWKT(e.before ->> 'geom') FROM tunnel_audit.entry e
                      WHERE e.view = 'finding' AND e.row_id = a.id AND e.at > a.reviewed_at AND e.before ? 'geom'
                        AND NOT coalesce(e.after, '{}') ?| ARRAY['review', 'remark', 'kind'] ORDER BY e.id LIMIT 1),
                    a.shape, a.unrolled)
      FROM tunnel.finding a WHERE a.id = $1
$$;
COMMENT ON FUNCTION tunnel_internal.reviewed_outline(bigint) IS
    'Outline of a finding (unrolled plane) when it was last reviewed; only review_lapses calls it';

-- A fifth: outlines that two people draw of one leak differ by less, those of two leaks by more.
CREATE OR REPLACE FUNCTION tunnel_internal.review_lapses(finding_id bigint, before geometry, after geometry) RETURNS boolean
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE CALLED ON NULL INPUT SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    most constant float8 := 0.2;
    was tunnel.finding;
BEGIN
    SELECT a.* INTO was FROM tunnel.finding a WHERE a.id = finding_id;
    IF was.review = 'open' OR was.reviewed_by = session_user
       OR tunnel_internal.outline_change(coalesce(before, tunnel_internal.reviewed_outline(finding_id)), after) <= most THEN
        RETURN false;
    END IF;
    RAISE NOTICE 'finding % was % by % with another outline: it is open again', finding_id, was.review,
        coalesce(was.reviewed_by, 'somebody');
    RETURN true;
END
$$;
COMMENT ON FUNCTION tunnel_internal.review_lapses(bigint, geometry, geometry) IS
    'True if a new outline (after) of a finding that somebody else reviewed differs from the reviewed one by more than a fifth of its area. before: outline that was reviewed, NULL for the one at the last review';
