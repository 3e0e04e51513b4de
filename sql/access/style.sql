-- Tables in which QGIS looks for styles and projects; `tunneldb qgis` fills them. They have QGIS's layout and are in schema
-- public. Runs after access/role.sql, for its grants.

DO $$
BEGIN
    IF to_regclass('public.layer_styles') IS NULL THEN
        BEGIN
            CREATE TABLE public.layer_styles (
                id serial PRIMARY KEY,
                f_table_catalog varchar,
                f_table_schema varchar,
                f_table_name varchar,
                f_geometry_column varchar,
                stylename text,
                styleqml xml,
                stylesld xml,
                useasdefault boolean,
                description text,
                owner varchar(63) DEFAULT current_user,
                ui xml,
                update_time timestamp DEFAULT current_timestamp,
                type varchar,
                r_raster_column varchar
            );
            COMMENT ON TABLE public.layer_styles IS 'Styles of layers, read by QGIS when a layer is added';
        EXCEPTION WHEN insufficient_privilege THEN
            RAISE WARNING '% may not create public.layer_styles, in which QGIS looks for styles', current_user;
        END;
    END IF;
END
$$;

DO $$
BEGIN
    IF to_regclass('public.qgis_projects') IS NULL THEN
        BEGIN
            CREATE TABLE public.qgis_projects (name text PRIMARY KEY, metadata jsonb, content bytea);
            COMMENT ON TABLE public.qgis_projects IS 'Projects that QGIS opens from the database';
        EXCEPTION WHEN insufficient_privilege THEN
            RAISE WARNING '% may not create public.qgis_projects, in which QGIS looks for projects', current_user;
        END;
    END IF;
END
$$;

-- Rights on them, if the installing user owns them; QGIS or another user may have created them before.
DO $$
DECLARE
    held regclass;
BEGIN
    FOR held IN
        SELECT c.oid FROM pg_class c
         WHERE c.oid IN (to_regclass('public.layer_styles'), to_regclass('public.qgis_projects'))
           AND pg_has_role(current_user, c.relowner, 'USAGE')
    LOOP
        IF to_regrole('tunnel_viewer') IS NOT NULL THEN
            EXECUTE format('GRANT SELECT ON %s TO tunnel_viewer', held);
        END IF;
        IF to_regrole('tunnel_operator') IS NOT NULL THEN
            EXECUTE format('GRANT INSERT, UPDATE, DELETE ON %s TO tunnel_operator', held);
            IF held = to_regclass('public.layer_styles') THEN
                GRANT USAGE ON SEQUENCE public.layer_styles_id_seq TO tunnel_operator;
            END IF;
        END IF;
    END LOOP;
END
$$;
