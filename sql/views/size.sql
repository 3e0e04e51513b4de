-- Disk space of surveys. Reads only the catalogue, its statistics and file sizes. There may be thousands of partitions of points:
-- their sizes are read from the catalogue, because reading the sizes of their files takes six times as long.

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
    WITH named AS MATERIALIZED (  -- point_s12_km3, image_s12 and the like by their survey; text functions, for there are many
        SELECT c.oid, c.relname::text AS name, c.reltuples, c.relpages,
               CASE WHEN c.relname LIKE ANY ('{point\\_s%,fragment\\_s%,image\\_s%}')
                    THEN split_part(split_part(c.relname, '_s', 2), '_', 1) END AS survey
          FROM pg_class c
         WHERE c.relnamespace = 'tunnel'::regnamespace AND c.relkind = 'r'
    ), index AS (
        SELECT i.indrelid, sum(x.relpages) AS pages
          FROM pg_index i
          JOIN pg_class x ON x.oid = i.indexrelid
         GROUP BY i.indrelid
    ), relation AS MATERIALIZED (  -- partitions of points are written once and analysed: the catalogue knows their pages
        SELECT n.oid, n.name, n.reltuples,
               CASE WHEN translate(n.survey, '0123456789', '') = '' AND n.survey <> '' THEN n.survey::integer END AS survey_id,
               CASE WHEN k.known THEN (n.relpages + coalesce(i.pages, 0)) * current_setting('block_size')::integer
                    ELSE pg_total_relation_size(n.oid) END AS bytes,
               CASE WHEN k.known THEN n.relpages ELSE pg_relation_size(n.oid) END AS heap
          FROM named n
         CROSS JOIN LATERAL (SELECT n.name LIKE 'point\_s%' AND n.relpages > 0 AND n.reltuples >= 0) k (known)
          LEFT JOIN index i ON i.indrelid = n.oid
    ), own AS (
        SELECT r.survey_id, tunnel_internal.table_kind(min(r.name)) AS kind,
               sum(CASE WHEN r.heap = 0 THEN 0 WHEN r.reltuples >= 0 THEN r.reltuples END)
                   + CASE WHEN bool_or(r.heap > 0 AND r.reltuples < 0) THEN NULL ELSE 0 END AS rows,
               sum(r.bytes) AS bytes
          FROM relation r
         WHERE r.survey_id IS NOT NULL
         GROUP BY r.survey_id, r.name LIKE 'image%'
    ), keyed AS MATERIALIZED (  -- tables in common, and the one that has the survey's key: itself, or the one that it belongs to
        SELECT DISTINCT ON (r.oid) r.oid, tunnel_internal.table_kind(r.name) AS kind, coalesce(a.attrelid, p.attrelid) AS key_table,
               r.heap > 0 AND r.reltuples < 0 AS unknown, CASE WHEN r.heap = 0 THEN 0 ELSE r.reltuples END AS rows,
               CASE WHEN r.heap = 0 THEN 0 ELSE r.bytes END AS bytes
          FROM relation r
          LEFT JOIN pg_attribute a ON a.attrelid = r.oid AND NOT a.attisdropped
               AND a.attname = CASE r.name WHEN 'survey' THEN 'id' ELSE 'survey_id' END
          LEFT JOIN pg_constraint f ON f.conrelid = r.oid AND f.contype = 'f' AND a.attrelid IS NULL
          LEFT JOIN pg_attribute p ON p.attrelid = f.confrelid AND p.attname = 'survey_id' AND NOT p.attisdropped
         WHERE r.survey_id IS NULL AND coalesce(a.attrelid, p.attrelid) IS NOT NULL
         ORDER BY r.oid, f.conname
    ), common AS MATERIALIZED (
        SELECT t.oid AS key_table, v.survey_id, v.share
          FROM pg_class t
          JOIN pg_stats s ON s.tablename = t.relname
         CROSS JOIN LATERAL unnest(s.most_common_vals::text::integer[], s.most_common_freqs) AS v (survey_id, share)
          JOIN tunnel.survey u ON u.id = v.survey_id
         WHERE t.oid = ANY (ARRAY(SELECT k.key_table FROM keyed k)) AND s.schemaname = 'tunnel' AND s.attname = 'survey_id'
               AND NOT s.inherited
    ), rest AS (  -- the share of each survey that is not among the most common values
        SELECT k.oid, greatest(1 - coalesce(c.share, 0), 0) / nullif((SELECT count(*) FROM tunnel.survey) - coalesce(c.surveys, 0), 0)
                   AS share
          FROM keyed k
          LEFT JOIN (SELECT c.key_table, sum(c.share)::float8 AS share, count(*) AS surveys FROM common c GROUP BY c.key_table) c
               ON c.key_table = k.key_table
    ), shared AS (  -- all surveys have the rest of each table, and those among the common values the difference
        SELECT s.id AS survey_id, r.kind, r.rows, r.bytes
          FROM tunnel.survey s
         CROSS JOIN (SELECT k.kind, sum(k.rows * coalesce(e.share, 0)) AS rows, sum(k.bytes * coalesce(e.share, 0)) AS bytes
                       FROM keyed k JOIN rest e ON e.oid = k.oid WHERE NOT k.unknown GROUP BY k.kind) r
         UNION ALL
        SELECT c.survey_id, k.kind, k.rows * (c.share - coalesce(e.share, 0)), k.bytes * (c.share - coalesce(e.share, 0))
          FROM keyed k
          JOIN rest e ON e.oid = k.oid
          JOIN common c ON c.key_table = k.key_table
         WHERE NOT k.unknown
    ), part AS (
        SELECT h.survey_id, h.kind, sum(h.rows) AS rows, round(sum(h.bytes)) AS bytes, round(sum(h.bytes)) > 0 AS shared
          FROM shared h
         GROUP BY h.survey_id, h.kind
         UNION ALL
        SELECT NULL, k.kind, NULL, k.bytes, false FROM keyed k WHERE k.unknown
         UNION ALL
        SELECT o.survey_id, o.kind, o.rows, o.bytes, false FROM own o
    )
    SELECT p.survey_id, p.kind, CASE WHEN bool_or(p.rows IS NULL) THEN NULL ELSE round(sum(p.rows))::bigint END,
           round(sum(p.bytes))::bigint, bool_or(p.shared)
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
