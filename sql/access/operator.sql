-- Values that only operators see in views that everybody reads: paths of files on processing machines.

CREATE OR REPLACE FUNCTION tunnel_internal.for_operators(said text) RETURNS text
LANGUAGE sql STABLE PARALLEL SAFE STRICT SET search_path = pg_catalog, pg_temp AS $$
    SELECT CASE WHEN coalesce(pg_has_role(to_regrole('tunnel_operator'), 'USAGE'), true) THEN said END
$$;
COMMENT ON FUNCTION tunnel_internal.for_operators(text) IS
    'Return the text if the caller is an operator, else NULL. Without the role tunnel_operator, everybody gets the text';
