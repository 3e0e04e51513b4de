-- Comments of columns that have none of their own, for psql, QGIS and the reference: from the view behind it, else from this
-- list of common names, else from the table behind it. Needs all views.

COMMENT ON COLUMN tunnel_api.axis.geom IS 'Axis, tunnel''s SRID';
COMMENT ON COLUMN tunnel_api.section_unrolled.geom IS 'Section from its left to its right end, in the unrolled plane';

DO $$
DECLARE
    bare record;
BEGIN
    FOR bare IN
        SELECT v.oid::regclass AS view, a.attname AS name, coalesce(w.text, m.text, col_description(t.oid, b.attnum)) AS text
          FROM pg_class v
          JOIN pg_attribute a ON a.attrelid = v.oid AND a.attnum > 0
          LEFT JOIN (VALUES
                ('id', 'Key'),
                ('survey_id', 'Key of the survey'),
                ('survey', 'Name of the survey'),
                ('tunnel_id', 'Key of the tunnel'),
                ('tunnel', 'Name of the tunnel'),
                ('km', 'Kilometre'),
                ('n', 'Number'),
                ('segment', 'Number of the segment'),
                ('chainage', 'Chainage, m'),
                ('label', 'Station, as 12+345.678'),
                ('chainage_from', 'Smallest chainage, m'),
                ('chainage_to', 'Greatest chainage, m'),
                ('label_from', 'Station at the smallest chainage, as 12+345.678'),
                ('label_to', 'Station at the greatest chainage, as 12+345.678'),
                ('points', 'Number of points'),
                ('files', 'Number of files'),
                ('vertices', 'Number of vertices'),
                ('srid', 'Coordinate reference system of the tunnel'),
                ('half', 'Position in the segment, %: 25 or 75'),
                ('angle_step', 'Width of an angular class, degrees'),
                ('interpolated', 'Number of angular classes filled from their neighbours: empty or rejected'),
                ('duration', 'finished_at - started_at'),
                ('leaks_open', 'Number of these not reviewed yet'),
                ('leaks_confirmed', 'Number of these confirmed'),
                ('leaks_rejected', 'Number of rejected leaks'),
                ('largest_area', 'Area of the largest leak, m²'),
                ('greatest_darkening', 'Greatest darkening, dB'),
                ('remark', 'Remark of the reviewer'),
                ('created_at', 'Time when the row was created'),
                ('detected_at', 'Time of the last detection that found it'),
                ('drawn_by', 'Role that drew it last, set by the database'),
                ('drawn_at', 'Time of the last drawing, set by the database')) AS m (name, text) ON m.name = a.attname
          LEFT JOIN pg_class t
                 ON t.oid = to_regclass(CASE WHEN v.relname = 'file' THEN 'tunnel.scan_file'
                                             WHEN v.relname = 'stage_status' THEN 'tunnel.run'
                                             WHEN v.relname = 'sheet_finding' THEN 'tunnel_api.finding_unrolled'
                                             WHEN v.relname = 'sheet_leak' THEN 'tunnel_api.leak_unrolled'
                                             WHEN v.relname ~ '^clearance_(map|unrolled)$' THEN 'tunnel_api.clearance_section'
                                             WHEN v.relname = 'detectability_map' THEN 'tunnel.detectability'
                                             WHEN v.relname ~ '^clearance_infringement_' THEN 'tunnel_api.clearance_infringement'
                                             WHEN v.relname ~ '^(change_region|leak_change)(_|$)'
                                             THEN 'tunnel.' || substring(v.relname FROM '^(change_region|leak_change)')
                                             WHEN v.relname ~ '^leak(_|$)' THEN 'tunnel.finding'
                                             ELSE format('tunnel.%I', v.relname) END)
          LEFT JOIN pg_attribute b ON b.attrelid = t.oid AND b.attname = a.attname
          LEFT JOIN LATERAL (SELECT col_description(t.oid, b.attnum) AS text WHERE t.relkind = 'v') w ON true
         WHERE v.relnamespace IN ('tunnel_api'::regnamespace, 'tunnel_internal'::regnamespace) AND v.relkind = 'v'
           AND col_description(v.oid, a.attnum) IS NULL
    LOOP
        EXECUTE format('COMMENT ON COLUMN %s.%I IS %L', bare.view, bare.name, bare.text);
    END LOOP;
END
$$;
