-- Typed layers. Tunnels can have different coordinate systems, so geometry_columns states no SRID for the views of
-- tunnel_api, and some programs then see no geometry. Each coordinate system in use therefore has a schema, tunnel_25830 or
-- tunnel_local, with each layer under its name in tunnel_api, limited to the tunnels of that system, with one typed geometry.
-- tunneldb init, tunnel add and tunnel remove create them from the list here. Needs all views; copies rights, so it is called
-- at the end of access/role.sql.

CREATE OR REPLACE FUNCTION tunnel_api.layer_types() RETURNS TABLE (layer text, type text, plane boolean)
LANGUAGE sql IMMUTABLE PARALLEL SAFE ROWS 60 SET search_path = pg_catalog, pg_temp AS $$
    VALUES
        ('tunnel', 'LineStringZ', false),
        ('alignment_element', 'LineStringZ', false),
        ('axis', 'LineStringZ', false),
        ('axis_vertex', 'PointZ', false),
        ('axis_deviation', 'PointZ', false),
        ('segment', 'LineStringZ', false),
        ('section', 'LineStringZ', false),
        ('section_unrolled', 'LineString', true),
        ('outline', 'LineString', false),
        ('point', 'PointZ', false),
        ('scan_station', 'PointZ', false),
        ('trajectory', 'LineStringZ', false),
        ('leak_unrolled', 'Polygon', true),
        ('leak_map', 'Polygon', false),
        ('leak_3d', 'PolygonZ', false),
        ('finding_unrolled', 'Geometry', true),  -- polygons, lines and points
        ('finding_map', 'Geometry', false),
        ('finding_3d', 'GeometryZ', false),
        ('dry_region', 'Polygon', true),
        ('region', 'Polygon', true),
        ('coverage_gap', 'Polygon', true),
        ('dark_band', 'Polygon', true),
        ('detectability', 'Polygon', true),
        ('detectability_map', 'Polygon', false),
        ('sheet', 'Polygon', true),
        ('sheet_finding', 'Geometry', true),
        ('sheet_leak', 'Polygon', true),
        ('ground', 'LineStringZ', false),
        ('cluster', 'Polygon', false),
        ('target_sphere', 'PointZ', false),
        ('deviation_bar', 'Polygon', true),
        ('deviation_map', 'LineString', false),
        ('ring_unrolled', 'Polygon', true),
        ('ring_map', 'Polygon', false),
        ('rating_unrolled', 'MultiPolygon', true),
        ('rating_map', 'MultiPolygon', false),
        ('action_unrolled', 'Point', true),
        ('action_map', 'Point', false),
        ('evenness_area', 'Polygon', true),
        ('clearance_section', 'PointZ', false),
        ('clearance_unrolled', 'Polygon', true),
        ('clearance_map', 'LineString', false),
        ('clearance_infringement_unrolled', 'MultiPolygon', true),
        ('clearance_infringement_3d', 'MultiPointZ', false),
        ('change_region_unrolled', 'Polygon', true),
        ('change_region_map', 'Polygon', false),
        ('change_region_3d', 'PolygonZ', false),
        ('leak_change_unrolled', 'MultiPolygon', true),
        ('leak_change_map', 'MultiPolygon', false),
        ('leak_change_3d', 'MultiPolygonZ', false),
        ('member', 'LineStringZ', false),
        ('member_statistics', 'LineStringZ', false),
        ('member_sheet', 'Polygon', true),
        ('face', 'MultiPolygonZ', false),
        ('face_3d', 'MultiPolygonZ', false),
        ('face_sheet', 'MultiPolygon', true),
        ('spot_face', 'Polygon', true),
        ('spot_map', 'Polygon', false),
        ('spot_3d', 'PolygonZ', false),
        ('spot_sheet', 'Polygon', true),
        ('closed_section', 'LineStringZ', false),
        ('section_part', 'LineStringZ', false),
        ('waterline', 'LineStringZ', false),
        ('ladder', 'PointZ', false),
        ('sonar_scan', 'PointZ', false),
        ('sonar_point', 'PointZ', false),
        ('sonar_ellipse', 'Polygon', false)
$$;
COMMENT ON FUNCTION tunnel_api.layer_types() IS
    'Views of tunnel_api that are layers, with the type of their geometry geom. plane: true if it lies in a plane of its own (SRID 0), false if in the tunnel''s coordinate system';

CREATE OR REPLACE FUNCTION tunnel_api.layer_schemas() RETURNS TABLE (schema text, srid int)
LANGUAGE sql STABLE PARALLEL SAFE ROWS 3 SET search_path = pg_catalog, pg_temp AS $$
    SELECT n.nspname::text, coalesce(nullif(substr(n.nspname, 8), 'local')::int, 0)
      FROM pg_namespace n
     WHERE n.nspname ~ '^tunnel_([0-9]{1,9}|local)$' AND obj_description(n.oid, 'pg_namespace') LIKE 'tunneldb: layers of %'
       AND n.nspowner = (SELECT a.nspowner FROM pg_namespace a WHERE a.nspname = 'tunnel_api')
     ORDER BY 1
$$;
COMMENT ON FUNCTION tunnel_api.layer_schemas() IS
    'Schemas of typed layers, one for each coordinate system in use, with its SRID (0: local coordinates)';

-- Runs with the owner's rights: operators add tunnels, but only the owner creates schemas. It takes no arguments.
CREATE OR REPLACE PROCEDURE tunnel_api.make_layers()
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp SET lock_timeout = '5s' AS $$
DECLARE
    wanted record;
    unused record;
    view record;
BEGIN
    PERFORM pg_advisory_xact_lock(7088630452);  -- any number, known to database/schema.py: two at a time wait for each other
    FOR unused IN
        SELECT l.schema FROM tunnel_api.layer_schemas() l WHERE NOT EXISTS (SELECT FROM tunnel.tunnel t WHERE t.srid = l.srid)
    LOOP
        BEGIN
            FOR view IN SELECT c.oid::regclass AS name FROM pg_class c JOIN tunnel_api.layer_types() t ON t.layer = c.relname
                         WHERE c.relnamespace = to_regnamespace(unused.schema) AND c.relkind = 'v' LOOP
                EXECUTE format('DROP VIEW %s', view.name);
            END LOOP;
            EXECUTE format('DROP SCHEMA %I', unused.schema);
        EXCEPTION WHEN dependent_objects_still_exist OR lock_not_available OR wrong_object_type THEN
            RAISE WARNING 'schema % stays, though no tunnel is in its coordinate system: %', unused.schema, SQLERRM;
        END;
    END LOOP;
    FOR wanted IN
        SELECT DISTINCT t.srid, 'tunnel_' || CASE t.srid WHEN 0 THEN 'local' ELSE t.srid::text END AS schema
          FROM tunnel.tunnel t
         WHERE NOT EXISTS (SELECT FROM tunnel_api.layer_schemas() l WHERE l.srid = t.srid)
    LOOP
        IF to_regnamespace(wanted.schema) IS NOT NULL THEN
            RAISE WARNING 'no layers of SRID % are made: there is a schema % already that is not tunneldb''s', wanted.srid, wanted.schema;
            CONTINUE;
        END IF;
        CALL tunnel_internal.make_layer_schema(wanted.schema, wanted.srid);
    END LOOP;
END
$$;
COMMENT ON PROCEDURE tunnel_api.make_layers() IS
    'Create the schemas of typed layers for all coordinate systems in use and drop unused ones. tunnel add and tunnel remove call it';

CREATE OR REPLACE PROCEDURE tunnel_internal.make_layer_schema(name text, srid int)
LANGUAGE plpgsql SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    layer record;
    said record;
    granted record;
    edited record;
BEGIN
    EXECUTE format('CREATE SCHEMA %I', name);
    EXECUTE format('COMMENT ON SCHEMA %I IS %L', name,
                   'tunneldb: layers of the tunnels in ' || CASE srid WHEN 0 THEN 'local coordinates' ELSE 'SRID ' || srid END
                   || ', typed; made anew by tunneldb init');
    FOR granted IN
        SELECT a.grantee::regrole AS role FROM pg_namespace n CROSS JOIN LATERAL aclexplode(n.nspacl) a
         WHERE n.nspname = 'tunnel_api' AND a.privilege_type = 'USAGE' AND a.grantee NOT IN (0, n.nspowner)
    LOOP
        EXECUTE format('GRANT USAGE ON SCHEMA %I TO %s', name, granted.role);
    END LOOP;
    FOR layer IN
        SELECT t.layer, c.oid AS source, format('%I.%I', name, t.layer) AS made,
               (SELECT string_agg(CASE WHEN a.attname = 'geom'
                                       THEN format('geom::public.geometry(%s, %s) AS geom', t.type, CASE WHEN t.plane THEN 0 ELSE srid END)
                                       ELSE quote_ident(a.attname) END, ', ' ORDER BY a.attnum)
                  FROM pg_attribute a
                 WHERE a.attrelid = c.oid AND a.attnum > 0
                   AND (a.attname = 'geom' OR a.atttypid <> 'public.geometry'::regtype)) AS columns,
               CASE WHEN EXISTS (SELECT FROM pg_attribute a WHERE a.attrelid = c.oid AND a.attname = 'survey_id')
                    THEN 'survey_id = ANY (ARRAY(SELECT s.id FROM tunnel.survey s JOIN tunnel.tunnel t ON t.id = s.tunnel_id WHERE t.srid = %s))'
                    WHEN t.layer = 'tunnel' THEN 'srid = %s'
                    ELSE 'tunnel_id = ANY (ARRAY(SELECT t.id FROM tunnel.tunnel t WHERE t.srid = %s))' END AS condition
          FROM tunnel_api.layer_types() t
          JOIN pg_class c ON c.oid = format('tunnel_api.%I', t.layer)::regclass
    LOOP
        EXECUTE format('CREATE VIEW %s AS SELECT %s FROM %s WHERE ' || layer.condition, layer.made, layer.columns,
                       layer.source::regclass, srid);
        FOR said IN  -- of the view and of its columns
            SELECT CASE d.objsubid WHEN 0 THEN format('VIEW %s', layer.made)
                        ELSE format('COLUMN %s.%I', layer.made, a.attname) END AS thing, d.description
              FROM pg_description d
              LEFT JOIN pg_attribute a ON a.attrelid = d.objoid AND a.attnum = d.objsubid
             WHERE d.objoid = layer.source AND d.classoid = 'pg_class'::regclass
               AND (d.objsubid = 0 OR a.attname = 'geom' OR a.atttypid <> 'public.geometry'::regtype)
        LOOP
            EXECUTE format('COMMENT ON %s IS %L', said.thing, said.description);
        END LOOP;
        FOR edited IN
            SELECT pg_get_triggerdef(t.oid) AS definition FROM pg_trigger t WHERE t.tgrelid = layer.source AND NOT t.tgisinternal
        LOOP
            EXECUTE replace(edited.definition, format(' ON tunnel_api.%I ', layer.layer), format(' ON %s ', layer.made));
        END LOOP;
        FOR granted IN
            SELECT a.privilege_type || coalesce(' (' || quote_ident(g.attname) || ')', '') AS privilege, a.grantee::regrole AS role
              FROM (SELECT c.relowner, c.relacl AS acl, NULL::name AS attname FROM pg_class c WHERE c.oid = layer.source
                     UNION ALL
                    SELECT c.relowner, b.attacl, b.attname
                      FROM pg_class c JOIN pg_attribute b ON b.attrelid = c.oid WHERE c.oid = layer.source) g
             CROSS JOIN LATERAL aclexplode(g.acl) a
             WHERE a.grantee NOT IN (0, g.relowner)
               AND (g.attname IS NULL OR EXISTS (SELECT FROM pg_attribute b WHERE b.attrelid = layer.made::regclass
                                                    AND b.attname = g.attname))
        LOOP
            EXECUTE format('GRANT %s ON %s TO %s', granted.privilege, layer.made, granted.role);
        END LOOP;
    END LOOP;
END
$$;
COMMENT ON PROCEDURE tunnel_internal.make_layer_schema(text, int) IS
    'Create one schema of typed layers for the tunnels with an SRID: views, comments, triggers and rights. make_layers calls it';
