"""Extreme values through every column that a role can write: refused with one line, or harmless to all commands."""

from __future__ import annotations

import json
from typing import Any

import psycopg
import pytest
from click.testing import CliRunner, Result
from psycopg.conninfo import make_conninfo
from support.fuzz.writes import ARGUMENTS, CALLABLE, HARMLESS, REFUSED, SURVEY, WRITABLE, placed, statements

from tunneldb.cli.main import main


def attempt(person: psycopg.Connection, statement: str) -> str | None:
    """Run a statement; return the message if it is refused, None if it changes a row."""
    try:
        return None if person.execute(statement.encode()).rowcount else "no row"
    except psycopg.Error as error:
        state, message = error.sqlstate or "", error.diag.message_primary or ""
    assert state[:2] in ("22", "23", "0A"), (statement[:200], state, message)
    assert "\n" not in message, statement[:200]
    assert len(message) < 300, statement[:200]
    return message


def works(arguments: list[str], codes: tuple[int, ...] = (0, 1)) -> Result:
    """Run a command, which must end without a traceback."""
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code in codes, (arguments, result.output, result.exception)
    assert result.exception is None or isinstance(result.exception, SystemExit), arguments
    return result


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


@pytest.mark.slow
@pytest.mark.parametrize(("person", "role"), [("ines", "tunnel_inspector"), ("otto", "tunnel_operator")], indirect=["person"])
def test_extreme_values_are_refused_or_harmless(
    person: psycopg.Connection, role: str, conn: psycopg.Connection, dsn: str, tmp_path: Any
) -> None:
    """Values that are accepted stay in the database while the commands run."""
    columns = conn.execute(WRITABLE, {"role": role}).fetchall()
    conn.rollback()
    person.execute("SET statement_timeout = '20 s'")
    tried, taken = 0, []
    person.execute("INSERT INTO tunnel_api.finding_photo (finding_id, path) VALUES (1, 'a.jpg')")
    for view, column, kind, update, insert in columns:
        for value in REFUSED.get(kind, []):
            wrong = value if kind != "geometry" or value == "NULL" else placed(view, value)
            for statement in statements(view, column, wrong, update, insert):
                tried += 1
                if attempt(person, statement) is None:
                    taken.append((view, column, value[:80]))
        for value in HARMLESS.get(kind, []):
            for statement in statements(view, column, value, update, insert):
                attempt(person, statement)
    assert tried > 200
    empty = {"kind", "severity", "review", "geom", "finding_id", "survey", "survey_id"}
    taken = [one for one in taken if one[1:] != ("arc", "'-1'")]  # 1 m left of the crown
    assert [(view, column, value) for view, column, value in taken if value != "NULL" or column not in empty] == []
    person.close()
    assert conn.execute("SELECT count(*) FROM tunnel_api.stage_status").fetchone() == (6,)
    conn.rollback()
    for arguments in (["status"], ["status", SURVEY], ["check"], ["leaks", SURVEY], ["findings", SURVEY, "--state", "all"]):
        works(arguments)
    works(["run", SURVEY, "--stale"], (0, 2))
    works(["report", SURVEY, "-o", str(tmp_path / "report.html")])


@pytest.mark.parametrize("person", ["ines"], indirect=True)
@pytest.mark.parametrize(
    "path", ["/proc/kmsg", "//proc/./kmsg", "file:///dev/zero", "../../proc/kmsg", "a/../../sys/kernel/notes", "/DEV/zero"]
)
def test_a_photo_is_no_file_of_the_kernel(person: psycopg.Connection, path: str) -> None:
    """QGIS 3.22 hangs when a form shows /proc/kmsg as a picture."""
    add = "INSERT INTO tunnel_api.finding_photo (finding_id, path) VALUES (1, %s)"
    for right in ("/photos/dev/a.jpg", "dev/a.jpg", "https://example.org/proc/a.jpg", "../photos/a.jpg", "C:\\sys\\a.jpg"):
        with person.transaction(force_rollback=True):
            person.execute(add, [right])
    with pytest.raises(psycopg.errors.InvalidParameterValue, match="is a device or a file of the kernel, not a picture"):
        person.execute(add, [path])


@pytest.mark.parametrize("person", ["ines"], indirect=True)
@pytest.mark.parametrize(
    ("path", "says"),
    [
        ("file:///%70roc/kmsg", "has codes where letters do"),
        ("file:///photos/..%2F..%2fproc/kmsg", "has codes where letters do"),
        (r"\\server\photos\a.jpg", "is on another computer"),
        ("//server/photos/a.jpg", "is on another computer"),
        ("file://server/photos/a.jpg", "is on another computer"),
        ("file:////server/photos/a.jpg", "is on another computer"),
    ],
)
def test_a_photo_hides_no_folder_and_no_server(person: psycopg.Connection, path: str, says: str) -> None:
    """QGIS on Windows sends the reader's login to the server of a path such as //server/photos."""
    add = "INSERT INTO tunnel_api.finding_photo (finding_id, path) VALUES (1, %s)"
    for right in ("file:///photos/a%20b.jpg", "a%41.jpg", "photos//a.jpg", "C:\\photos\\a.jpg", "https://example.org/%41.jpg"):
        with person.transaction(force_rollback=True):
            person.execute(add, [right])
    with pytest.raises(psycopg.errors.InvalidParameterValue, match=says):
        person.execute(add, [path])


@pytest.mark.parametrize("person", ["vera"], indirect=True)
def test_no_function_of_viewers_takes_the_server_down(person: psycopg.Connection) -> None:
    """Each ends within seconds, with few rows or one line."""
    functions = person.execute(CALLABLE, {"role": "vera"}).fetchall()
    assert len(functions) > 50
    person.execute("SET statement_timeout = '10 s'")
    for name, kinds in functions:
        for number in range(7):
            values = [ARGUMENTS[kind][(number + place) % len(ARGUMENTS[kind])] for place, kind in enumerate(kinds)]
            given = ", ".join(f"{value}::{kind}" for value, kind in zip(values, kinds, strict=True))
            state = None
            try:
                row = person.execute(f"SELECT count(*) FROM tunnel_api.{name}({given}) q".encode()).fetchone()
                assert row is not None and row[0] <= 100_000, (name, values)  # noqa: PT018
            except psycopg.Error as error:
                state = error.sqlstate
            assert state not in ("57014", "53200"), (name, values)
            assert not person.closed, (name, values)


def bad(conn: psycopg.Connection, table: str, change: str) -> None:
    """Change rows of a table, whose constraints a superuser has dropped."""
    for (name,) in conn.execute(
        "SELECT conname FROM pg_constraint WHERE conrelid = %s::regclass AND contype = 'c'", [f"tunnel.{table}"]
    ).fetchall():
        conn.execute(f'ALTER TABLE tunnel.{table} DROP CONSTRAINT "{name}"'.encode())
    conn.execute("SET session_replication_role = replica")
    conn.execute(f"UPDATE tunnel.{table} SET {change}".encode())
    conn.execute("RESET session_replication_role")
    conn.commit()


EDITED = "source = 'edited', edited_at = now(), edited_by = 'root'"
EXTREME = [
    *(("axis_vertex", f"{EDITED}, geom = ST_SetSRID({point}, 25830) WHERE n = 1240", "axis vertex 1240")
      for point in ("ST_MakePoint(1e300, 1e300, 1e300)", "ST_MakePoint('NaN', 0, 0)", "ST_MakePoint(0, 0, 0)",
                    "'POINT Z EMPTY'::geometry")),
    ("segment", "vertex_from = '{1e300,NaN,Infinity}', tangent_to = '{NaN,1e300,0}' WHERE n = 1240", "segment 1240"),
    ("section", "radius = array_fill('NaN'::float8, ARRAY[361]), arc = array_fill('1e300'::float8, ARRAY[361])", "section"),
    ("finding", "area = 'NaN', chainage_from = '-Infinity', chainage_to = 1e300 WHERE id = 2", "finding 2"),
    ("survey", "date = 'infinity'", "survey demo-2024"),
    ("tunnel", "start_chainage = 'NaN', spacing = 1e300", "tunnel demo"),
]  # fmt: skip
"""Rows that cannot come about by the views: table, change, and how the row is named."""


@pytest.mark.slow
@pytest.mark.parametrize(("table", "change", "name"), EXTREME)
def test_a_bad_row_of_one_survey_breaks_no_other(
    table: str, change: str, name: str, people: None, conn: psycopg.Connection, dsn: str, tmp_path: Any
) -> None:
    """A second survey of another tunnel is there, whose commands work; those of the first end with one line."""
    conn.execute(
        "INSERT INTO tunnel.tunnel (name, srid, start_chainage, alignment)"
        " SELECT 'good', srid, start_chainage, alignment FROM tunnel.tunnel;"
        "INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_kind, platform)"
        " SELECT id, 'good-2024', '2024-05-04', 'none', 'static' FROM tunnel.tunnel WHERE name = 'good'"
    )
    limit = {"axis_vertex": "", "tunnel": " WHERE name = 'demo'", "survey": f" WHERE name = '{SURVEY}'"}.get(table, "")
    bad(conn, table, change + limit)
    listed = json.loads(works(["status", "--json"]).stdout)["surveys"]
    assert {row["name"] for row in listed} == {SURVEY, "good-2024"}
    works(["status", "good-2024"])
    works(["leaks", "good-2024"], (0, 1, 2))
    checked = works(["check"], (1,)).output
    assert f"{name}" in next(line for line in checked.splitlines() if line.startswith("✗ values"))
    with psycopg.connect(make_conninfo(dsn, user="vera")) as vera:
        vera.execute("SELECT * FROM tunnel_api.stage_status").fetchall()
    for arguments in (
        ["status", SURVEY],
        ["leaks", SURVEY],
        ["findings", SURVEY],
        ["report", SURVEY, "-o", str(tmp_path / "r.html")],
    ):
        result = works(arguments, (0, 1, 2))
        if result.exit_code == 2:
            assert len(result.stderr.splitlines()) == 1
        if arguments[0] == "status":
            assert name in result.output
