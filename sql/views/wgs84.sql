-- Views of what lies on the map in WGS 84 (EPSG:4326), whose geometry states type and SRID: for programs that show one coordinate
-- system only, or ask geometry_columns for it, as servers of OGC API Features and of vector tiles do. The other views of the map hold
-- tunnels of several SRIDs and state none, which such servers take for WGS 84. Columns and comments are those of the view behind.
-- Tunnels in local coordinates have no place on Earth, and no rows here. Needs all views of the map and their comments.
--
-- The condition is in a CASE as well, since a filter on the geometry may come before that of WHERE, and st_transform fails of SRID 0.

DO $$
DECLARE
    shown record;
    others text;
    col record;
    remark text;
BEGIN
    FOR shown IN SELECT g.*, g.name || '_wgs84' AS view FROM (VALUES
            ('tunnel', 'tunnel', 'LineStringZ', 'geom', 'true'),
            ('axis', 'axis', 'LineStringZ', 'geom', 'true'),
            ('axis_vertex', 'axis_vertex', 'PointZ', 'geom', 'true'),
            ('segment', 'segment', 'LineStringZ', 'geom', 'true'),
            ('section', 'section', 'LineStringZ', 'geom', 'true'),
            ('trajectory', 'trajectory', 'LineStringZ', 'geom', 'true'),
            ('scan_station', 'scan_station', 'PointZ', 'geom', 'true'),
            ('target_sphere', 'target_sphere', 'PointZ', 'geom', 'true'),
            ('outline', 'outline', 'MultiLineString', 'public.st_multi(public.st_force2d(geom))', 'true'),
            ('cluster', 'cluster', 'MultiPolygon', 'public.st_multi(public.st_force2d(geom))', 'true'),
            ('leak_map', 'leak', 'MultiPolygon', 'public.st_multi(public.st_force2d(geom))', 'true'),
            ('anomaly_map', 'anomaly', 'MultiPolygon', 'public.st_multi(public.st_force2d(geom))', 'true'),
            ('finding_map', 'finding_point', 'MultiPoint', 'public.st_multi(public.st_force2d(geom))', 'public.st_dimension(geom) = 0'),
            ('finding_map', 'finding_line', 'MultiLineString', 'public.st_multi(public.st_force2d(geom))', 'public.st_dimension(geom) = 1'),
            ('finding_map', 'finding_area', 'MultiPolygon', 'public.st_multi(public.st_force2d(geom))', 'public.st_dimension(geom) = 2'),
            ('ring_map', 'ring', 'MultiPolygon', 'public.st_multi(public.st_force2d(geom))', 'true'),
            ('deviation_map', 'deviation', 'MultiLineString', 'public.st_multi(public.st_force2d(geom))', 'true'),
            ('clearance_map', 'clearance', 'MultiLineString', 'public.st_multi(public.st_force2d(geom))', 'true'),
            ('change_region_map', 'change_region', 'MultiPolygon', 'public.st_multi(public.st_force2d(geom))', 'true'),
            ('leak_change_map', 'leak_change', 'MultiPolygon', 'public.st_multi(public.st_force2d(geom))', 'true'),
            ('spot_map', 'spot', 'MultiPolygon', 'public.st_multi(public.st_force2d(geom))', 'true')
        ) AS g (source, name, type, geometry, condition)
    LOOP
        SELECT string_agg(quote_ident(attname), ', ' ORDER BY attnum) INTO others
          FROM pg_attribute
         WHERE attrelid = format('tunnel_api.%I', shown.source)::regclass AND attnum > 0 AND attname <> 'geom';
        EXECUTE format(
            'CREATE OR REPLACE VIEW tunnel_api.%I AS SELECT %s,'
            ' CASE WHEN public.st_srid(geom) > 0 THEN public.st_transform(%s, 4326) END::public.geometry(%s, 4326) AS geom'
            ' FROM tunnel_api.%I WHERE public.st_srid(geom) > 0 AND %s',
            shown.view, others, shown.geometry, shown.type, shown.source, shown.condition);
        EXECUTE format('COMMENT ON VIEW tunnel_api.%I IS %L', shown.view,
                       format('The view %s in WGS 84, for servers of maps%s; tunnels in local coordinates are left out', shown.source,
                              CASE WHEN shown.source = 'finding_map' THEN ': ' || split_part(shown.name, '_', 2) || 's' ELSE '' END));
        FOR col IN SELECT attname AS name, col_description(attrelid, attnum) AS text
                     FROM pg_attribute
                    WHERE attrelid = format('tunnel_api.%I', shown.source)::regclass AND attnum > 0
        LOOP
            remark := CASE WHEN col.name = 'geom' THEN 'As in ' || shown.source || ', in WGS 84: longitude, latitude' ELSE col.text END;
            EXECUTE format('COMMENT ON COLUMN tunnel_api.%I.%I IS %L', shown.view, col.name, remark);
        END LOOP;
    END LOOP;
END
$$;
