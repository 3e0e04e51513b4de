"""Actions by command: add, change, list; a list that goes through a spreadsheet and back."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import openpyxl
import psycopg
import pytest
from support.command import command, refused
from support.example_change import LATER, add_change, add_change_run
from support.example_survey import NAME


@pytest.fixture
def two(dsn: str, example: str, conn: psycopg.Connection) -> list[int]:
    """Ids of two actions: of a leak, overdue; and of a stretch."""
    conn.execute("DELETE FROM tunnel.action")
    conn.commit()
    (leak,) = conn.execute("SELECT min(id) FROM tunnel_api.finding WHERE survey = %s AND wet AND counted", [NAME]).fetchone()  # type: ignore[misc]
    words = ["--measure", "Inject the joint", "--urgency", "urgent", "--due", "2020-03-31", "--cost", "1200.50 EUR"]
    command("actions", "add", NAME, "--finding", str(leak), *words)
    command(
        "actions", "add", NAME, "--from", "12+310", "--to", "12+320", "--measure", "=Clean the drain", "--element", "block 1"
    )
    return [key for (key,) in conn.execute("SELECT id FROM tunnel_api.action ORDER BY id")]


def rows(conn: psycopg.Connection) -> list[tuple[Any, ...]]:
    conn.rollback()
    return conn.execute(
        "SELECT id, measure, urgency, responsible, due::text, cost, currency, state, remark FROM tunnel_api.action ORDER BY id"
    ).fetchall()


def test_actions_are_added_changed_listed_and_removed(two: list[int], conn: psycopg.Connection) -> None:
    first, second = two
    command("actions", "set", str(second), "--state", "ordered", "--responsible", "Works Ltd")
    shown = json.loads(command("actions", "list", "demo", "--json").stdout)["actions"]
    assert [row["id"] for row in shown] == [first, second], "by due date"
    assert [row["overdue"] for row in shown] == [True, None]
    assert (shown[1]["state"], shown[1]["responsible"], shown[1]["chainage_from"]) == ("ordered", "Works Ltd", 12310)
    late = command("actions", "list", "demo", "--overdue").output
    assert "2020-03-31, overdue" in late
    assert f"finding {shown[0]['finding_id']}" in late
    assert "element block 1" in command("actions", "list", "demo", "--state", "ordered").output
    assert "1200.50 EUR" in late
    assert "Clean" not in late
    assert "not compared" in late
    assert "Inject" not in command("actions", "list", "demo", "--state", "ordered").output
    command("actions", "remove", str(first))
    assert [row[0] for row in rows(conn)] == [second]


def test_a_done_action_whose_leak_is_still_wet_is_named(two: list[int], conn: psycopg.Connection) -> None:
    """Leak 2 is dry in the later survey, and leak 3 is as it was."""
    add_change(conn, NAME)
    conn.commit()
    assert "wet in a later survey" not in command("actions", "list", "demo").output
    for finding in ("2", "3"):
        command("actions", "add", NAME, "--finding", finding, "--measure", "inject", "--state", "done")
    result = command("actions", "list", "demo", "--state", "done")
    assert "dry since 2026-05-04" in result.output
    key = max(row[0] for row in rows(conn))
    assert f"done, but wet in a later survey: 1 action ({key})" in result.stderr


def test_an_outdated_comparison_is_named(two: list[int], conn: psycopg.Connection, tmp_path: Path) -> None:
    """The later survey has no results of detection any more."""
    add_change(conn, NAME)
    conn.commit()
    assert "outdated" not in command("actions", "list", "demo").output
    add_change_run(conn, NAME)
    conn.commit()
    message = (
        f"follow-ups in {LATER} are outdated (one of the surveys has nothing there any more): tunneldb compare {NAME} {LATER}"
    )
    assert message in command("actions", "list", "demo").stderr
    assert message in command("actions", "export", "demo", "-o", str(tmp_path / "list.csv")).stderr


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["add", NAME, "--finding", "1"], "--measure is missing"),
        (["add", NAME, "--measure", "x"], "either --finding ID, or --from and --to"),
        (["add", NAME, "--measure", "x", "--element", "block 1"], "--from and --to, also with --element"),
        (["add", NAME, "--measure", "x", "--finding", "1", "--from", "12+310"], "either --finding ID, or --from and --to"),
        (["add", NAME, "--measure", "x", "--finding", "999999"], "the survey has no finding 999999"),
        (["add", NAME, "--measure", "x", "--finding", "1", "--cost", "12"], "a cost needs its currency"),
        (["add", NAME, "--measure", "x", "--finding", "1", "--cost", "much EUR"], "as '1200.50 EUR'"),
        (["add", NAME, "--measure", "x", "--finding", "1", "--due", "31.3.2027"], "write the day as 2027-03-31"),
        (["set", "999", "--state", "done"], "there is no action 999"),
        (["set", "999"], "nothing to change"),
        (["remove", "999"], "there is no action 999"),
        (["list", "nothing"], "nothing"),
        (["export", "demo", "-o", "a.pdf"], "is written as .xlsx or .csv"),
        (["export", "demo"], "--output FILE is missing"),
    ],
)
def test_wrong_words_are_refused(dsn: str, example: str, words: list[str], message: str) -> None:
    assert message in refused("actions", *words)


Edit = Callable[[Path, dict[tuple[int, str], Any], list[dict[str, Any]]], None]


def edit_xlsx(path: Path, cells: dict[tuple[int, str], Any], more: list[dict[str, Any]]) -> None:
    """Change cells (line, column) and append rows, as a person does in a spreadsheet."""
    book = openpyxl.load_workbook(path)
    page = book.worksheets[0]
    columns = {cell.value: n for n, cell in enumerate(page[1], start=1)}
    for (line, name), value in cells.items():
        page.cell(line, columns[name]).value = value
    for row in more:
        page.append([row.get(name) for name in columns])
    book.save(path)


def edit_csv(path: Path, cells: dict[tuple[int, str], Any], more: list[dict[str, Any]]) -> None:
    with path.open(newline="") as file:
        table = list(csv.DictReader(file))
    for (line, name), value in cells.items():
        table[line - 2][name] = value
    table += more
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, list(table[0]))
        writer.writeheader()
        writer.writerows(table)


@pytest.mark.parametrize(("ending", "edit"), [("xlsx", edit_xlsx), ("csv", edit_csv)])
def test_a_list_goes_through_a_spreadsheet_and_back(
    two: list[int], conn: psycopg.Connection, tmp_path: Path, ending: str, edit: Edit
) -> None:
    path = tmp_path / f"actions.{ending}"
    before = rows(conn)
    command("actions", "export", "demo", "-o", str(path))
    assert "0 added, 0 changed, 2 unchanged" in command("actions", "import", "demo", str(path)).output
    assert rows(conn) == before
    new = {"survey": NAME, "measure": "Repair", "chainage_from": 12330, "chainage_to": 12331.5, "cost": 10, "currency": "CHF"}
    edit(path, {(2, "state"): "done", (2, "remark"): "injected", (3, "due"): "2027-03-31"}, [new])
    assert "1 added, 2 changed, 0 unchanged" in command("actions", "import", "demo", str(path)).output
    first, second, third = rows(conn)
    assert (first[7], first[8], first[1:7]) == ("done", "injected", before[0][1:7])
    assert (second[4], second[1]) == ("2027-03-31", "=Clean the drain")
    assert (third[1], float(third[5]), third[6], third[7]) == ("Repair", 10.0, "CHF", "open")


@pytest.mark.parametrize(
    ("cells", "message"),
    [
        ({(3, "state"): "closed"}, "line 3: the state can be open, ordered, done or verified, not closed"),
        ({(3, "due"): "soon"}, "line 3: due: 'soon' is no day"),
        ({(3, "cost"): "much"}, "line 3: cost: 'much' is no number"),
        ({(3, "cost"): 5}, "line 3: a cost needs its currency"),
        ({(3, "id"): 777}, "line 3: id: the tunnel has no action 777"),
        ({(3, "id"): 1.5}, "line 3: id: 1.5 is no whole number"),
        ({(3, "id"): None, (3, "survey"): None}, "line 3: survey: a new action needs the survey"),
        ({(3, "measure"): None}, "line 3: an action needs a measure"),
        ({(1, "state"): "stat"}, "there is no column 'stat' Did you mean 'state'?"),
        ({(1, "id"): None}, "the column id is missing"),
    ],
)
def test_wrong_cells_are_refused_whole(
    two: list[int], conn: psycopg.Connection, tmp_path: Path, cells: dict[tuple[int, str], Any], message: str
) -> None:
    """The line is named, and the change in the line before it is not written, either."""
    path, before = tmp_path / "actions.xlsx", rows(conn)
    command("actions", "export", "demo", "-o", str(path))
    edit_xlsx(path, {(2, "remark"): "x"} | cells, [])
    assert message in refused("actions", "import", "demo", str(path))
    assert rows(conn) == before


def test_what_somebody_changed_since_is_not_overwritten(two: list[int], conn: psycopg.Connection, tmp_path: Path) -> None:
    path = tmp_path / "actions.xlsx"
    command("actions", "export", "demo", "-o", str(path))
    command("actions", "set", str(two[1]), "--state", "ordered")
    assert "0 changed, 2 unchanged" not in refused("actions", "import", "demo", str(path)), (
        "open in the file is the older state"
    )
    edit_xlsx(path, {(3, "state"): "done"}, [])
    message = refused("actions", "import", "demo", str(path))
    assert f"line 3: state: action {two[1]} was changed by" in message
    assert "export the list again" in message
    assert rows(conn)[1][7] == "ordered"
    command("actions", "export", "demo", "-o", str(path))
    edit_xlsx(path, {(3, "state"): "done"}, [])
    command("actions", "import", "demo", str(path))
    assert rows(conn)[1][7] == "done"


def test_files_that_are_no_list_are_refused(two: list[int], tmp_path: Path) -> None:
    path = tmp_path / "actions.xlsx"
    path.write_text("nothing")
    assert "cannot be read as a workbook" in refused("actions", "import", "demo", str(path))
    path = tmp_path / "actions.csv"
    path.write_text("id,measure\n1\n")
    assert "actions.csv" in refused("actions", "import", "demo", str(path))
