"""The SQL of the documentation runs, and its reference pages are what the program says of itself."""

from __future__ import annotations

import importlib
import importlib.util
import re
from pathlib import Path
from types import ModuleType

import psycopg
import pytest
from support.cookbook_survey import draw_findings, prepare
from support.queue_rows import add_file, add_job, add_worker

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
BLOCK = re.compile(r"^```sql\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def test_every_query_runs(conn: psycopg.Connection, example: str) -> None:
    """Each by itself, on the example survey with edits and a batch under way; one that selects must find something there."""
    prepare(conn, example)
    draw_findings(conn, example)
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


def test_reference_pages_are_up_to_date(conn: psycopg.Connection, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    script = generator()
    old = [page for page, write in script.PAGES.items() if (ROOT / "docs" / page).read_text("utf-8") != write(conn)]
    assert not old, "python docs/generate_reference.py writes them anew"


def test_the_diagram_shows_every_view_once(conn: psycopg.Connection, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    code = importlib.import_module("view_diagram").view_diagram(conn)
    shown = []
    for line in code.splitlines():
        names = re.findall(r"\w+", line.strip('`"]').partition(" → ")[0])
        if re.match(r"^\w+(, \w+)*( → .*)?[`\]\"]*$", line) and not line.startswith("flowchart"):
            shown += [name if not name.startswith("_") else names[0] + name for name in names]
    views = conn.execute("SELECT viewname FROM pg_views WHERE schemaname = 'tunnel_api'").fetchall()
    assert sorted([*shown, "tunnel", "survey"]) == sorted(name for (name,) in views)


def generator() -> ModuleType:
    """The script, which imports others beside it."""
    spec = importlib.util.spec_from_file_location("generate_reference", ROOT / "docs" / "generate_reference.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
