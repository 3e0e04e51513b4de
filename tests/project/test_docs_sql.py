"""The SQL of the documentation runs, and the generated reference is complete."""

from __future__ import annotations

import re
from pathlib import Path

import psycopg
import pytest
from support.cookbook_owner import add_owner
from support.cookbook_survey import draw_findings, prepare
from support.queue_rows import add_file, add_job, add_worker
from support.reference import docs_script

from tunneldb.cli.main import COMMANDS
from tunneldb.database.schema import sql_files
from tunneldb.stages.parameters import PARAMETERS

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
BLOCK = re.compile(r"^```sql\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def test_every_query_runs(conn: psycopg.Connection, example: str) -> None:
    """Each by itself, on the example survey with edits and a batch under way; one that selects must find something there."""
    prepare(conn, example)
    add_owner(conn, example, draw_findings(conn, example))
    add_job(conn, example, 12, "axis", add_worker(conn, "calc-1", 4711))
    add_file(conn, example, "km-13.laz", 13)
    conn.commit()
    wrong = []
    for page in sorted([ROOT / "README.md", *(ROOT / "docs").glob("*.md")]):
        text = page.read_text("utf-8")
        for block in BLOCK.finditer(text):
            place = f"{page.name}:{text[: block.start()].count(chr(10)) + 2}"
            try:
                cursor = conn.execute(block[1].encode())
                while cursor.nextset():
                    pass
                if cursor.rowcount == 0:
                    wrong.append(f"{place}: no row")
            except psycopg.Error as error:
                wrong.append(f"{place}: {error}")
            conn.rollback()
    assert not wrong, "\n".join(wrong)


def test_the_reference_has_every_command_parameter_view_and_function(conn: psycopg.Connection) -> None:
    text = {part: write(conn) for part, write in docs_script("generate_reference").PARTS.items()}
    assert re.findall(r"^## (\S+)$", text["commands"], re.MULTILINE) == list(COMMANDS)
    assert re.findall(r"^\| `([\w.]+)`", text["parameters"], re.MULTILINE) == list(PARAMETERS)
    views = [name for (name,) in conn.execute("SELECT viewname FROM pg_views WHERE schemaname = 'tunnel_api'")]
    assert sorted(re.findall(r"^### (\w+)$", text["views"], re.MULTILINE)) == sorted(views)
    functions = conn.execute(
        "SELECT proname FROM pg_proc WHERE pronamespace = 'tunnel_api'::regnamespace AND prorettype <> 'trigger'::regtype"
    ).fetchall()
    assert sorted(re.findall(r"^```text\n(?:CALL )?(\w+)\(", text["functions"], re.MULTILINE)) == sorted(
        name for (name,) in functions
    )


def test_a_sister_view_has_the_columns_of_its_base_view_and_a_geometry(conn: psycopg.Connection) -> None:
    text = docs_script("generate_reference").views(conn)
    sisters = re.findall(
        r"^### (\w+)\n\n.*\n\nColumns of \[(\w+)\]\(#\w+\)(?: without (.*?))?; geometry: `(\w+)`", text, re.MULTILINE
    )
    assert ("leak_map", "leak", "", "geom") in sisters
    for view, base, dropped, geometry in sisters:
        without = set(re.findall(r"`(\w+)`", dropped))
        columns = {name for one in (view, base) for name in _columns(conn, one)} - {geometry}
        assert columns - set(_columns(conn, view)) <= without | _geometries(conn, base)


def _columns(conn: psycopg.Connection, view: str, kind: str = "%") -> list[str]:
    query = (
        "SELECT attname FROM pg_attribute WHERE attrelid = to_regclass(%s) AND attnum > 0"
        " AND format_type(atttypid, atttypmod) LIKE %s"
    )
    return [name for (name,) in conn.execute(query, [f"tunnel_api.{view}", kind])]


def _geometries(conn: psycopg.Connection, view: str) -> set[str]:
    return set(_columns(conn, view, "geometry%"))


def test_topics_show_every_view_once_and_name_files_that_are_there(conn: psycopg.Connection) -> None:
    script = docs_script("view_topics")
    shown = []
    for _, lines in script.views_by_topic(conn):
        for line in lines:
            names = re.findall(r"\w+", line.partition(" → ")[0])
            shown += [name if not name.startswith("_") else names[0] + name for name in names]
    views = conn.execute("SELECT viewname FROM pg_views WHERE schemaname = 'tunnel_api'").fetchall()
    assert sorted([*shown, "tunnel", "survey"]) == sorted(name for (name,) in views)
    files = {name for path in sql_files() for name in (path.stem, f"{path.parent.name}/{path.stem}")}
    assert {stem for stems in script.TOPICS.values() for stem in stems} <= files
