"""A thousand surveys beside one: rows of the sample survey set again and again under other surveys, set by set in SQL.

The sample is that of `benchmarks.synthetic`, with the runs of shape in its ledger. Each other survey has its partitions of
points, one row in each, all rows of the catalogue and the ledger, and of what was measured a part, as `ROWS` has it: enough
that nothing of another survey's is found for nothing, little enough that a thousand of them are made in minutes.
"""

from __future__ import annotations

from typing import Any

import psycopg
from psycopg import sql

from benchmarks.common import progress

Connection = psycopg.Connection[Any]

AT_ONCE = 10
"""Surveys that are made in one transaction: their partitions take some four locks each."""

ROWS = {"finding": 200, "run": 300, "segment": 250, "axis_vertex": 250, "coverage": 1}
OTHERS = 50
"""Rows of a table that each other survey has, at most: of those named, and of all others."""

RERUNS = 4
"""How often each stage of each kilometre of the other surveys ran."""

LEFT_OUT = ("survey", "point", "image", "boundary_region")
CLEARED = ("same_as", "parent_id", "merged_into", "dry_region_id", "cluster_id", "feature_list_id")
"""Columns that name a row of the sample survey."""

SURVEYS = """
INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_dimension, intensity_kind, platform, reference)
SELECT t.id, t.name || '-' || y.year, make_date(y.year, 5, 4), s.intensity_dimension, s.intensity_kind, s.platform, s.reference
FROM tunnel.tunnel t CROSS JOIN (VALUES (2022), (2024)) AS y (year) JOIN tunnel.survey s ON s.id = %(sample)s
WHERE t.name LIKE 'other%%' ORDER BY t.id, y.year
"""

TUNNELS = """
INSERT INTO tunnel.tunnel (name, srid, start_chainage, spacing, alignment)
SELECT 'other' || n, t.srid, t.start_chainage, t.spacing, t.alignment
FROM tunnel.tunnel t JOIN tunnel.survey s ON s.tunnel_id = t.id AND s.id = %(sample)s, generate_series(1, %(tunnels)s) AS n
"""

PROFILES = """
INSERT INTO tunnel.design_profile (tunnel_id, name, layer, chainage_from, chainage_to, outline, source)
SELECT o.id, p.name, p.layer, p.chainage_from, p.chainage_to, p.outline, p.source
FROM tunnel.design_profile p JOIN tunnel.survey s ON s.tunnel_id = p.tunnel_id AND s.id = %(sample)s, tunnel.tunnel o
WHERE o.name LIKE 'other%%'
"""

PARTITIONS = """
DO $$
DECLARE survey int; km int;
BEGIN
    FOREACH survey IN ARRAY {surveys}::int[] LOOP
        PERFORM tunnel_internal.partition_parent(survey);
        FOR km IN 0 .. {kilometres} - 1 LOOP
            EXECUTE format('CREATE TABLE tunnel.%I PARTITION OF tunnel.%I FOR VALUES IN (%s) WITH (autovacuum_enabled = off)',
                tunnel_internal.partition_name(survey, km), 'point_s' || survey, km);
        END LOOP;
        EXECUTE format('INSERT INTO tunnel.%I SELECT %s, p.km, p.chainage, p.gps_time, p.geom, p.segment, p.scan_id, p.file_id,'
            'p.intensity, p.classification, p.class FROM first_point p', 'point_s' || survey, survey);
        FOR km IN 0 .. {kilometres} - 1 LOOP
            EXECUTE format('ANALYZE tunnel.%I (survey_id, km, chainage, segment)', tunnel_internal.partition_name(survey, km));
        END LOOP;
    END LOOP;
END
$$
"""

FIRST_POINTS = """
CREATE TEMPORARY TABLE first_point AS
SELECT DISTINCT ON (km) * FROM tunnel.point WHERE survey_id = {sample} AND km < {kilometres} ORDER BY km, chainage
"""

HANGING = (
    """
    INSERT INTO tunnel.ring_chord (ring_id, clock_from, clock_to, length, length_se)
    SELECT id, 270, 90, 8, 0.0005 FROM tunnel.ring WHERE survey_id = ANY (%(surveys)s)
    """,
    """
    INSERT INTO tunnel.photo (finding_id, path) SELECT a.id, 'photos/' || a.id || '.jpg'
    FROM tunnel.finding a WHERE a.survey_id = ANY (%(surveys)s) AND a.manual AND a.id %% 4 = 0
    """,
    """
    INSERT INTO tunnel.file_km (file_id, km, rows, points, loaded_at)
    SELECT f.id, f.chainage_from / 1000, f.kept, '{[0,1000)}', f.loaded_at
    FROM tunnel.scan_file f WHERE f.survey_id = ANY (%(surveys)s)
    """,
    """
    INSERT INTO tunnel_audit.entry (at, who, survey, view, row_id, action, before, after)
    SELECT a.reviewed_at, a.reviewed_by, s.name, 'finding', a.id, 'update', '{"review": "open"}',
        jsonb_build_object('review', a.review)
    FROM tunnel.finding a JOIN tunnel.survey s ON s.id = a.survey_id
    WHERE a.survey_id = ANY (%(surveys)s) AND a.reviewed_at IS NOT NULL ORDER BY a.reviewed_at LIMIT 1000
    """,
    """
    INSERT INTO tunnel.run (survey_id, km, stage, started_at, finished_at, outcome, parameters, versions, counts)
    SELECT r.survey_id, r.km, r.stage, r.started_at - n * interval '1 day', r.finished_at - n * interval '1 day', r.outcome,
        r.parameters, r.versions, r.counts
    FROM tunnel.run r, generate_series(1, %(reruns)s - 1) AS n WHERE r.survey_id = ANY (%(surveys)s)
    """,
)


MEASURED = """
INSERT INTO tunnel.run (survey_id, km, stage, started_at, finished_at, outcome, parameters)
SELECT s.id, km, q.stage, clock_timestamp(), clock_timestamp(), 'done', q.parameters
FROM generate_series(0, %(kilometres)s - 1) AS km
CROSS JOIN tunnel.survey s
JOIN tunnel.survey o ON o.tunnel_id = s.tunnel_id AND o.date < s.date
CROSS JOIN LATERAL (
    SELECT '{stage}', {given} || tunnel_internal.result_inputs(s.id, '{stage}', km, {subject})) AS q (stage, parameters)
WHERE %(sample)s = {of}
"""

RUNS = (
    ("s.id", "deviation", "jsonb_build_object('layer', 'lining')", "'lining'"),
    ("s.id", "evenness", "jsonb_build_object('layer', 'lining', 'length', 2)", "'lining'"),
    ("s.id", "thickness", "jsonb_build_object('before', o.id, 'layer', 'lining')", "o.id || ' lining'"),
    ("s.id", "clearance", "jsonb_build_object('track', 'single', 'gauge', 'A')", "'single A'"),
    ("s.id", "rings", "'{}'::jsonb", "''"),
    ("o.id", "compare", "jsonb_build_object('old', o.id, 'cell', 0.1)", "o.id::text"),
)
"""Runs of the measures, of the sample or of the later survey: parameters, and the subject."""


IMAGES = """
INSERT INTO tunnel.image (survey_id, km, kind, block, tiff)
SELECT %(sample)s, km, 'offset', 20 * km, '' FROM generate_series(0, %(kilometres)s - 1) AS km
"""


def note_shape(connection: Connection, sample: int, kilometres: int) -> None:
    """Note in the ledger that deviation, evenness, thickness, clearance, rings and change of the sample were measured."""
    connection.execute(IMAGES, {"sample": sample, "kilometres": kilometres})
    for of, stage, given, subject in RUNS:
        connection.execute(
            MEASURED.format(of=of, stage=stage, given=given, subject=subject), {"sample": sample, "kilometres": kilometres}
        )
    connection.commit()


def surround(connection: Connection, sample: int, surveys: int, kilometres: int) -> None:
    """Put other surveys beside the sample, until there are so many; each batch is committed, and a call goes on with the rest.

    Parameters
    ----------
    connection
        As a superuser: triggers and foreign keys are passed over while rows are copied.
    sample : int
        Id of the survey that rows are taken of.
    surveys : int
        How many there are to be in all.
    kilometres : int
        Partitions of points that each other survey gets.
    """
    connection.execute("SET synchronous_commit = off")
    _catalogue(connection, sample, surveys)
    tables = _tables(connection)
    for table, columns in tables.items():
        connection.execute(_extract(table, columns), {"sample": sample, "rows": ROWS.get(table, OTHERS)})
    connection.execute(FIRST_POINTS.format(sample=sample, kilometres=kilometres))
    connection.commit()
    waiting = [
        (row[0], row[1])
        for row in connection.execute(
            "SELECT s.id, lag(s.id) OVER (PARTITION BY s.tunnel_id ORDER BY s.id) FROM tunnel.survey s"
            " JOIN tunnel.tunnel t ON t.id = s.tunnel_id WHERE t.name LIKE 'other%'"
            " AND to_regclass('tunnel.point_s' || s.id) IS NULL ORDER BY s.id"
        ).fetchall()
    ]
    for first in range(0, len(waiting), AT_ONCE):
        batch = waiting[first : first + AT_ONCE]
        if first % 100 == 0:
            progress(f"surveys {len(waiting) - first} to go")
        _copy(connection, tables, batch, kilometres)
        connection.commit()
    connection.autocommit = True
    connection.execute("RESET session_replication_role")
    for table in (*tables, "survey", "tunnel", "ring_chord", "photo", "file_km", "design_profile"):
        connection.execute(sql.SQL("VACUUM ANALYZE tunnel.{}").format(sql.Identifier(table)))
    connection.execute("VACUUM ANALYZE tunnel_audit.entry")
    for catalogue in ("pg_class", "pg_attribute", "pg_depend", "pg_inherits", "pg_index", "pg_constraint", "pg_type"):
        connection.execute(sql.SQL("VACUUM ANALYZE pg_catalog.{}").format(sql.Identifier(catalogue)))
    connection.autocommit = False


def _catalogue(connection: Connection, sample: int, surveys: int) -> None:
    there = connection.execute("SELECT count(*) FROM tunnel.tunnel WHERE name LIKE 'other%'").fetchone()
    assert there is not None
    if there[0]:
        return
    own = connection.execute("SELECT count(*) FROM tunnel.survey").fetchone()
    assert own is not None
    values = {"sample": sample, "tunnels": (surveys - own[0] + 1) // 2}
    for step in (TUNNELS, SURVEYS, PROFILES):
        connection.execute(step, values)
    connection.commit()


def _tables(connection: Connection) -> dict[str, list[str]]:
    """Tables that hold a survey's rows, and those columns of them that may be written."""
    rows = connection.execute(
        "SELECT c.relname, array_agg(a.attname::text ORDER BY a.attnum) FROM pg_class c"
        " JOIN pg_attribute a ON a.attrelid = c.oid AND a.attnum > 0 AND NOT a.attisdropped AND a.attidentity = ''"
        " AND a.attgenerated = '' WHERE c.relnamespace = 'tunnel'::regnamespace AND c.relkind = 'r' AND NOT c.relispartition"
        " GROUP BY c.relname HAVING 'survey_id' = ANY (array_agg(a.attname)) ORDER BY c.relname"
    ).fetchall()
    return {table: columns for table, columns in rows if table not in LEFT_OUT}


def _extract(table: str, columns: list[str]) -> sql.Composed:
    """Set aside, of a table, that part of the sample's rows that others get, spread evenly."""
    return sql.SQL(
        "CREATE TEMPORARY TABLE {part} AS SELECT {columns} FROM (SELECT t.*, row_number() OVER () AS row,"
        " count(*) OVER () AS rows FROM tunnel.{table} t WHERE survey_id = %(sample)s) q"
        " WHERE row %% greatest(1, ceil(rows::numeric / %(rows)s)::int) = 0"
    ).format(
        part=sql.Identifier(f"part_{table}"),
        table=sql.Identifier(table),
        columns=sql.SQL(", ").join(map(sql.Identifier, columns)),
    )


def _copy(connection: Connection, tables: dict[str, list[str]], batch: list[tuple[int, int | None]], kilometres: int) -> None:
    """Fill surveys, given with the survey before each."""
    surveys = [survey for survey, _ in batch]
    connection.execute("SET LOCAL session_replication_role = replica")
    for table, columns in tables.items():
        values = [_value(column) for column in columns]
        connection.execute(
            sql.SQL(
                "INSERT INTO tunnel.{table} ({columns}) SELECT {values} FROM {part} t,"
                " unnest(%(surveys)s::int[], %(before)s::int[]) AS s (id, before) WHERE {paired}"
            ).format(
                table=sql.Identifier(table),
                columns=sql.SQL(", ").join(map(sql.Identifier, columns)),
                values=sql.SQL(", ").join(values),
                part=sql.Identifier(f"part_{table}"),
                paired=sql.SQL("s.before IS NOT NULL" if {"old_survey_id", "before_id"} & set(columns) else "true"),
            ),
            {"surveys": surveys, "before": [before for _, before in batch]},
        )
    for step in HANGING:
        connection.execute(step, {"surveys": surveys, "reruns": RERUNS})
    listed = sql.Literal("{" + ",".join(map(str, surveys)) + "}")
    connection.execute(sql.SQL(PARTITIONS).format(surveys=listed, kilometres=sql.Literal(kilometres)))


def _value(column: str) -> sql.Composable:
    if column == "survey_id":
        return sql.SQL("s.id")
    if column in ("old_survey_id", "before_id"):
        return sql.SQL("s.before")
    if column in CLEARED:
        return sql.SQL("NULL")
    return sql.SQL("t.{}").format(sql.Identifier(column))
