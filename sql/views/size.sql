-- Disk space of surveys. Reads the catalogue, its statistics and file sizes only: a survey of thousands of kilometres has as
-- many partitions.

-- Kind of data in each table. A table that is not listed is a result.
CREATE OR REPLACE FUNCTION tunnel_internal.table_kind(name text) RETURNS text
LANGUAGE sql IMMUTABLE PARALLEL SAFE STRICT
AS $$
    SELECT CASE WHEN $1 ~ '^(point|fragment)_s[0-9]+' OR $1 IN ('point', 'sonar_point') THEN 'points'
                WHEN $1 ~ '^image_s[0-9]+' OR $1 IN ('image', 'change_image') THEN 'images'
                WHEN $1 IN ('axis_vertex', 'segment', 'section', 'section_class') THEN 'sections'
                WHEN $1 = 'run' THEN 'runs'
                WHEN $1 IN ('survey', 'pose', 'station', 'reference', 'scan_file', 'file_km', 'incoming', 'goal', 'sonar_scan', 'ladder')
                    THEN 'inputs'
                ELSE 'results' END
$$;
COMMENT ON FUNCTION tunnel_internal.table_kind(text) IS
    'Kind of data in a table of schema tunnel: points, images, sections, results, runs or inputs';

-- Points and images have tables for each survey. For other tables, surveys get their share of the rows by the planner's
-- statistics: the frequency of a survey among the most common values, equal parts of the rest for the others. A table without
-- a survey's key takes the shares of its parent table. A table without statistics belongs to no survey.
CREATE OR REPLACE FUNCTION tunnel_internal.survey_sizes()
RETURNS TABLE (survey_id integer, kind text, rows bigint, bytes bigint, estimated boolean)
LANGUAGE sql STABLE PARALLEL RESTRICTED STRICT SECURITY DEFINER ROWS 100 SET search_path = pg_catalog, pg_temp SET jit = off
AS $$
    WITH relation AS MATERIALIZED (
        SELECT c.oid, c.relname::text AS name, c.reltuples, pg_total_relation_size(c.oid) AS bytes, pg_relation_size(c.oid) AS heap,
               substring(c.relname FROM '^(?:point|fragment|image)_s([0-9]+)(?:_|$)')::integer AS survey_id
          FROM pg_class c
         WHERE c.relnamespace = 'tunnel'::regnamespace AND c.relkind = 'r'
    ), own AS (
        SELECT r.survey_id, tunnel_internal.table_kind(r.name) AS kind,
               sum(CASE WHEN r.heap = 0 THEN 0 WHEN r.reltuples >= 0 THEN r.reltuples END)
                   + CASE WHEN bool_or(r.heap > 0 AND r.reltuples < 0) THEN NULL ELSE 0 END AS rows,
               sum(r.bytes) AS bytes, false AS shared
          FROM relation r
         WHERE r.survey_id IS NOT NULL
         GROUP BY 1, 2
    ), keyed AS MATERIALIZED (  -- tables in common, and the one that has the survey's key: itself, or the one that it belongs to
        SELECT DISTINCT ON (r.oid) r.oid, r.name, r.reltuples, r.bytes, r.heap, coalesce(a.attrelid, p.attrelid) AS key_table,
               coalesce(a.attname, p.attname)::text AS key_column
          FROM relation r
          LEFT JOIN pg_attribute a ON a.attrelid = r.oid AND NOT a.attisdropped
               AND a.attname = CASE r.name WHEN 'survey' THEN 'id' ELSE 'survey_id' END
          LEFT JOIN pg_constraint f ON f.conrelid = r.oid AND f.contype = 'f' AND a.attrelid IS NULL
          LEFT JOIN pg_attribute p ON p.attrelid = f.confrelid AND p.attname = 'survey_id' AND NOT p.attisdropped
         WHERE r.survey_id IS NULL AND coalesce(a.attrelid, p.attrelid) IS NOT NULL
         ORDER BY r.oid, f.conname
    ), common AS (
        SELECT s.schemaname, s.tablename, v.survey_id, v.share
          FROM pg_stats s
         CROSS JOIN LATERAL unnest(s.most_common_vals::text::integer[], s.most_common_freqs) AS v (survey_id, share)
         WHERE s.schemaname = 'tunnel' AND s.attname = 'survey_id' AND NOT s.inherited
    ), share AS MATERIALIZED (
        SELECT k.oid, s.id AS survey_id,
               coalesce(m.share, greatest(1 - coalesce(sum(m.share) OVER (PARTITION BY k.oid), 0), 0)
                                 / count(*) FILTER (WHERE m.share IS NULL) OVER (PARTITION BY k.oid))::float8 AS share
          FROM keyed k
          JOIN pg_class t ON t.oid = k.key_table
         CROSS JOIN tunnel.survey s
          LEFT JOIN common m ON m.tablename = t.relname AND m.survey_id = s.id
    ), part AS (
        SELECT h.survey_id, tunnel_internal.table_kind(k.name) AS kind, CASE WHEN k.heap = 0 THEN 0 ELSE k.reltuples * h.share END AS rows,
               CASE WHEN k.heap = 0 THEN 0 ELSE k.bytes * h.share END AS bytes, true AS shared
          FROM keyed k
          JOIN share h ON h.oid = k.oid
         WHERE k.heap = 0 OR k.reltuples >= 0
         UNION ALL
        SELECT NULL, tunnel_internal.table_kind(k.name), NULL, k.bytes, false
          FROM keyed k
         WHERE k.heap > 0 AND k.reltuples < 0
         UNION ALL
        SELECT o.survey_id, o.kind, o.rows, o.bytes, o.shared FROM own o
    )
    SELECT p.survey_id, p.kind, CASE WHEN bool_or(p.rows IS NULL) THEN NULL ELSE round(sum(p.rows))::bigint END,
           round(sum(p.bytes))::bigint, bool_or(p.shared AND p.bytes > 0)
      FROM part p
     GROUP BY p.survey_id, p.kind
$$;
COMMENT ON FUNCTION tunnel_internal.survey_sizes() IS 'Disk space of each survey, by kind of data, from the catalogue';

CREATE OR REPLACE VIEW tunnel_api.survey_size AS
SELECT coalesce(z.survey_id, 0)::bigint * 10
           + array_position(ARRAY['points', 'images', 'sections', 'results', 'runs', 'inputs'], z.kind) AS id,
       z.survey_id, s.name AS survey, z.kind, z.rows, z.bytes, z.estimated
  FROM tunnel_internal.survey_sizes() z
  LEFT JOIN tunnel.survey s ON s.id = z.survey_id;
COMMENT ON VIEW tunnel_api.survey_size IS
    'Disk space of each survey, by kind of data. Fast: reads the catalogue only. Data of a tunnel or of the database as a whole are not included';
COMMENT ON COLUMN tunnel_api.survey_size.survey_id IS
    'Key of the survey; NULL for shared tables without statistics (ANALYZE)';
COMMENT ON COLUMN tunnel_api.survey_size.survey IS 'Name of the survey; NULL if it was deleted and points or images remain';
COMMENT ON COLUMN tunnel_api.survey_size.kind IS
    'points (including those that wait to be loaded), images, sections (with axis and segments), results, runs (ledger) or inputs (files, scanner positions, goals)';
COMMENT ON COLUMN tunnel_api.survey_size.rows IS 'Number of rows by the last ANALYZE; NULL before the first one';
COMMENT ON COLUMN tunnel_api.survey_size.bytes IS 'Bytes on disk, with indexes and TOAST';
COMMENT ON COLUMN tunnel_api.survey_size.estimated IS
    'True if estimated as a share of tables that several surveys use; false if exact';
