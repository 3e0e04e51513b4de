-- Views with one geometry for QGIS and other programs, whose layers have one geometry. For each view with three geometries
-- (plane, map, space) there are three views with the same columns and comments, whose geometry is geom. Needs nothing.

CREATE OR REPLACE PROCEDURE tunnel_internal.make_geometry_views(
    base text, stem text, subject text, remark text DEFAULT '', plane text DEFAULT 'unrolled', plane_suffix text DEFAULT 'unrolled',
    plane_text text DEFAULT 'in the unrolled plane (chainage, arc), SRID 0', map_text text DEFAULT 'on the map strip beside the axis, in the tunnel''s SRID',
    surface_text text DEFAULT 'on the lining in space, in the tunnel''s SRID')
LANGUAGE plpgsql SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    source CONSTANT regclass := format('tunnel_api.%I', base);
    geometries CONSTANT text[] := ARRAY[plane, 'map', 'surface'];
    others text;
    shown record;
    said record;
BEGIN
    SELECT string_agg(quote_ident(a.attname), ', ' ORDER BY a.attnum) INTO others
      FROM pg_attribute a WHERE a.attrelid = source AND a.attnum > 0 AND a.attname <> ALL (geometries);
    FOR shown IN SELECT format('tunnel_api.%I', stem || '_' || g.suffix) AS view, g.* FROM (VALUES
        (plane_suffix, plane, plane_text), ('map', 'map', map_text), ('3d', 'surface', surface_text)) AS g (suffix, geometry, text)
    LOOP
        EXECUTE format('CREATE OR REPLACE VIEW %s AS SELECT %s, %I AS geom FROM %s', shown.view, others, shown.geometry, source);
        EXECUTE format('COMMENT ON VIEW %s IS %L', shown.view, subject || ' ' || shown.text || remark);
        EXECUTE format('COMMENT ON COLUMN %s.geom IS %L', shown.view, upper(left(shown.text, 1)) || substr(shown.text, 2));
        FOR said IN
            SELECT a.attname AS name, col_description(source, a.attnum) AS text
              FROM pg_attribute a WHERE a.attrelid = source AND a.attnum > 0 AND a.attname <> ALL (geometries)
        LOOP
            EXECUTE format('COMMENT ON COLUMN %s.%I IS %L', shown.view, said.name, said.text);  -- NULL: none
        END LOOP;
    END LOOP;
END
$$;
COMMENT ON PROCEDURE tunnel_internal.make_geometry_views(text, text, text, text, text, text, text, text, text) IS
    'Create, for a view with three geometries, three views with one geometry each, named by stem and suffix, with its comments. subject and remark are the beginning and the end of their own comments';
