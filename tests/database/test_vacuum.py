"""What surveys take of the database, what dead rows take, and who may free that."""

from __future__ import annotations

import json
from typing import Any

import psycopg
import pytest
from click.testing import CliRunner, Result
from psycopg.conninfo import make_conninfo
from support.example_change import EARLIER, add_earlier
from support.queue_rows import add_job

from tunneldb.cli.main import main
from tunneldb.database.vacuum import tables_to_vacuum, vacuum

DEAD = "SELECT coalesce(sum(pg_stat_get_dead_tuples(oid)), 0) FROM pg_class WHERE relname IN ('boundary_region', 'section')"


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def run(*words: str) -> Result:
    return CliRunner().invoke(main, words)


def told(*words: str) -> Any:
    result = run(*words, "--json")
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


def test_sizes_of_surveys_add_up_to_their_tables_and_rows_to_what_there_is(example: str, conn: psycopg.Connection) -> None:
    add_earlier(conn, example)
    conn.execute(
        "INSERT INTO tunnel.run (survey_id, km, stage) SELECT id, 1, 'load' FROM tunnel.survey, generate_series(1, 30)"
        " WHERE name = %s",
        [EARLIER],
    )
    conn.commit()
    unknown = {row["kind"] for row in told("survey", "sizes")["sizes"] if row["survey"] is None}
    assert "results" in unknown  # never analyzed: nobody's
    conn.autocommit = True
    conn.execute("ANALYZE")
    sizes = told("survey", "sizes")["sizes"]
    assert {row["survey"] for row in sizes} == {example, EARLIER}
    held = conn.execute(
        "SELECT sum(pg_total_relation_size(c.oid)) FROM pg_class c WHERE c.relnamespace = 'tunnel'::regnamespace"
        " AND c.relkind = 'r' AND pg_relation_size(c.oid) > 0 AND (c.relname ~ '^image_s' OR c.relname IN"
        " ('survey', 'file_km', 'ring_chord', 'photo') OR EXISTS (SELECT FROM pg_attribute a"
        " WHERE a.attrelid = c.oid AND a.attname = 'survey_id'))"
    ).fetchone()
    assert held is not None
    assert sum(row["bytes"] for row in sizes) == pytest.approx(int(held[0]), rel=0.01)  # images' own empty tables are in it
    counted = {
        "sections": "SELECT (SELECT count(*) FROM tunnel.axis_vertex v WHERE v.survey_id = s.id)"
        " + (SELECT count(*) FROM tunnel.segment g WHERE g.survey_id = s.id)"
        " + (SELECT count(*) FROM tunnel.section t WHERE t.survey_id = s.id)"
        " + (SELECT count(*) FROM tunnel.section_class c JOIN tunnel.section t ON t.id = c.section_id"
        " WHERE t.survey_id = s.id)",
        "runs": "SELECT (SELECT count(*) FROM tunnel.run r WHERE r.survey_id = s.id)",
        "images": "SELECT (SELECT count(*) FROM tunnel.image i WHERE i.survey_id = s.id)"
        " + (SELECT count(*) FROM tunnel.change_image c WHERE c.survey_id = s.id)",
    }
    for survey in (example, EARLIER):
        for kind, query in counted.items():
            found = [row["rows"] for row in sizes if (row["survey"], row["kind"]) == (survey, kind)]
            there = conn.execute(f"{query} FROM tunnel.survey s WHERE s.name = %s".encode(), [survey]).fetchone()
            assert there is not None
            assert found == [there[0]], (survey, kind)


def test_dead_rows_are_shown_first_and_gone_afterwards(example: str, conn: psycopg.Connection) -> None:
    conn.execute("UPDATE tunnel.section SET interpolated = interpolated")
    conn.commit()
    conn.autocommit = True
    conn.execute("SELECT pg_stat_force_next_flush()")
    changed = conn.execute("SELECT count(*) FROM tunnel.section").fetchone()
    shown = {row["table"]: row for row in told("vacuum")["tables"]}
    assert changed is not None
    assert shown["section"]["dead"] >= changed[0] > 30
    assert 0 < shown["section"]["dead_bytes"] < shown["section"]["bytes"]
    done = told("vacuum", "--yes")
    assert (done["done"], done["locked"], done["not_owned"]) == (True, [], [])
    assert conn.execute(DEAD).fetchone() == (0,)
    assert not {row["table"] for row in told("vacuum")["tables"]} & {"section", "image_s1"}


def test_a_table_that_is_dropped_meanwhile_is_passed_over(example: str, conn: psycopg.Connection) -> None:
    conn.execute("CREATE TABLE tunnel.image_s99 AS SELECT 1 AS id")
    conn.commit()
    tables = [table for table in tables_to_vacuum(conn) if table.table == "image_s99"]
    conn.execute("DROP TABLE tunnel.image_s99")
    conn.commit()
    assert len(tables) == 1
    assert vacuum(conn, tables, lambda _, __: lambda ___: None) == []


def test_operators_vacuum_their_tables_and_prune_and_others_are_told_in_a_line(
    people: None, example: str, conn: psycopg.Connection, dsn: str
) -> None:
    conn.execute("DELETE FROM tunnel.section")
    add_job(conn, example, 12, "detect")
    conn.execute("UPDATE tunnel_queue.procrastinate_jobs SET status = 'succeeded'")
    conn.commit()
    conn.execute("SELECT pg_stat_force_next_flush()")
    conn.rollback()
    for verb in ("vacuum", "prune"):
        refused = run("--dsn", make_conninfo(dsn, user="ines"), verb, "--yes")
        assert refused.exit_code == 2
        assert "ask its owner for the role tunnel_operator" in refused.stderr
        assert refused.stderr.count("\n") == 1
    with conn.transaction():
        conn.execute("LOCK TABLE tunnel.axis_vertex IN SHARE MODE")
        done = run("--dsn", make_conninfo(dsn, user="otto"), "vacuum", "--yes")
    assert done.exit_code == 0, done.stderr
    assert "left out, for others are at work on them: tunnel.axis_vertex" in done.stderr
    assert "not yours to vacuum, as tunnel_queue." in done.stderr
    pruned = run("--dsn", make_conninfo(dsn, user="otto"), "prune", "--yes")
    assert (pruned.exit_code, "deleted: 0 runs and 1 job;" in pruned.stderr) == (0, True), pruned.stderr
    assert conn.execute(DEAD).fetchone() == (0,)
