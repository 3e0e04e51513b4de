"""Limits and alarms by command: exit codes, files, advice."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import psycopg
import pytest
from support.command import command, refused
from support.example_survey import NAME


@pytest.fixture
def bare(conn: psycopg.Connection, example: str) -> None:
    """The example's tunnel without limits, inspected all over."""
    conn.execute("DELETE FROM tunnel.alarm_limit")
    conn.execute("UPDATE tunnel.coverage SET seen = lining")
    conn.commit()


OVAL = ("alarms", "add", "demo", "own", "--quantity", "ovality", "--min-inspected", "0.7")


@pytest.mark.parametrize(
    ("limits", "code", "said"),
    [
        (("0.02", "0.03"), 0, "0 alarm, 0 warning, 0 unknown, 100 ok"),
        (("0.01", "0.03"), 3, "0 alarm, 1 warning, 0 unknown, 99 ok"),
        (("0.009", "0.01"), 4, "1 alarm, 10 warning, 0 unknown, 89 ok"),
    ],
)
def test_the_exit_code_is_the_worst_level(bare: None, limits: tuple[str, str], code: int, said: str) -> None:
    """Rings have an ovality of 0.0001 to 0.01."""
    command(*OVAL, "--warning", limits[0], "--alarm", limits[1])
    assert said in command("alarms", "check", "demo", code=code).stderr


def test_what_could_not_be_judged_has_its_own_code(bare: None, conn: psycopg.Connection) -> None:
    """5 without a warning; a warning is said before what is unknown; the others of an alarm likewise."""
    command(*OVAL, "--warning", "0.02", "--alarm", "0.03")
    conn.execute("DELETE FROM tunnel.ring WHERE number BETWEEN 11 AND 20")
    conn.commit()
    result = command("alarms", "check", "demo", code=5)
    (line,) = [line for line in result.stdout.splitlines() if line.startswith("unknown")]
    assert line.split()[:4] == ["unknown", "own", "12320.000", "12340.000"]
    assert line.endswith("no ring measured")
    command("alarms", "add", "demo", "wet", "--quantity", "wet_area", "--warning", "5", "--alarm", "1000")
    lines = command("alarms", "check", "demo", code=3).stdout.splitlines()[1:]
    assert [line.split()[0] for line in lines] == ["warning", "unknown"]
    command("alarms", "add", "demo", "wetter", "--quantity", "wet_area", "--warning", "1", "--alarm", "5")
    lines = command("alarms", "check", "demo", code=4).stdout.splitlines()[1:]
    assert [line.split()[0] for line in lines] == ["alarm", "warning", "warning", "unknown"]


def test_consecutive_unknown_places_are_one_line(bare: None, conn: psycopg.Connection) -> None:
    command("alarms", "add", "demo", "growth", "--quantity", "growth", "--step", "10", "--warning", "1", "--alarm", "2")
    lines = command("alarms", "check", "demo", code=5).stdout.splitlines()
    assert len(lines) == 2
    assert lines[1].split()[:3] == ["unknown", "growth", "12300.000"]
    assert lines[1].endswith("20 places: no earlier inspection")


def test_a_tunnel_without_limits_is_no_all_clear(bare: None) -> None:
    message = refused("alarms", "check", "demo")
    assert "tunnel demo has no limits: tunneldb alarms add demo NAME --quantity" in message


def test_files_and_json_are_what_sql_says(dsn: str, example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    path = tmp_path / "alarms.csv"
    assert f"written to {path}" in command("alarms", "check", "demo", "-o", str(path), code=4).stderr
    rows = list(csv.DictReader(path.open()))
    known = conn.execute("SELECT name, chainage_from, level, why FROM tunnel_api.alarms('demo')").fetchall()
    assert [(row["name"], float(row["chainage_from"]), row["level"], row["why"] or None) for row in rows] == known
    shown = json.loads(command("alarms", "check", "demo", "--json", code=4).stdout)
    assert [(one["name"], one["chainage_from"], one["level"], one["why"]) for one in shown["alarms"]] == known
    assert (shown["ok"], shown["survey"], shown["date"]) == (False, NAME, "2024-05-04")
    assert sum(shown["levels"].values()) == len(known)


def test_limits_are_listed_and_removed(bare: None, conn: psycopg.Connection) -> None:
    command(*OVAL, "--warning", "0.006", "--alarm", "0.01")
    command(
        "alarms", "add", "demo", "walls", "--quantity", "convergence", "--warning", "0.01", "--alarm", "0.02",
        "--clock", "10", "4", "--reference", NAME,
    )  # fmt: skip
    words = ("--warning", "1", "--alarm", "5", "--from", "12+310", "--to", "12+400")
    command("alarms", "add", "demo", "wet", "--quantity", "wet_area", *words)
    rows = conn.execute(
        "SELECT name, quantity, warning, alarm, chainage_from, chainage_to, step, clock_from, clock_to, reference,"
        " min_inspected FROM tunnel_api.alarm_limit ORDER BY name"
    ).fetchall()
    assert rows == [
        ("own", "ovality", 0.006, 0.01, None, None, None, None, None, None, 0.7),
        ("walls", "convergence", 0.01, 0.02, None, None, None, 10, 4, NAME, 0.95),
        ("wet", "wet_area", 1, 5, 12310, 12400, 100, None, None, None, 0.95),
    ]
    listed = command("alarms", "list", "demo").stdout
    for text in ("rings", f"chord 10 to 4 o'clock since {NAME}", "stretches of 100 m", "12+310.000"):
        assert text in listed
    command("alarms", "remove", "demo", "own")
    assert refused("alarms", "remove", "demo", "own").endswith("no limit named 'own': tunneldb alarms list demo")
    limits = json.loads(command("alarms", "list", "demo", "--json").stdout)["limits"]
    assert [limit["name"] for limit in limits] == ["walls", "wet"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["ovality", "0.02", "0.01"], "--alarm 0.01 is below --warning 0.02"),
        (["ovality", "0.6", "1"], "--alarm 1 is too high: ovality is a share of the design diameter: 1 % is 0.01"),
        (["convergence", "10", "20"], "--alarm 20 is too high: convergence is in m: 10 mm is 0.01"),
        (["convergence", "0.01", "0.02", "--clock", "9", "12"], "--clock 9 12: the positions must be opposite each other"),
        (["convergence", "0.01", "0.02", "--reference", "nothing"], "no survey 'nothing'"),
        (["convergence", "0.01", "0.02", "--step", "5"], "--step is for wet_area and growth"),
        (["wet_area", "1", "2", "--clock", "9", "3"], "--clock is for convergence: leave it out"),
        (["wet_area", "1", "2", "--reference", NAME], "--reference is for convergence: leave it out"),
        (["wet_area", "1", "2", "--from", "12+400", "--to", "12+310"], "runs backwards: give the smaller one first"),
        (["wet_area", "0", "2"], "--warning"),
        (["wet_area", "nan", "2"], "--warning nan"),
        (["speed", "1", "2"], "'speed' is not one of 'ovality', 'convergence', 'wet_area', 'growth'"),
    ],
)
def test_wrong_limits_are_refused_with_advice(bare: None, words: list[str], message: str) -> None:
    quantity, warning, alarm, *rest = words
    given = ("--quantity", quantity, "--warning", warning, "--alarm", alarm, *rest)
    assert message in refused("alarms", "add", "demo", "own", *given)


def test_wrong_names_are_refused_with_advice(dsn: str, example: str, tmp_path: Path) -> None:
    taken = ("alarms", "add", "demo", "oval", "--quantity", "ovality", "--warning", "0.01", "--alarm", "0.02")
    assert refused(*taken).endswith("tunneldb alarms remove demo oval")
    command("alarms", "remove", "demo", "oval")
    command(*taken)
    for words in (("check", "nothing"), ("list", "nothing"), ("remove", "nothing", "oval")):
        assert "nothing" in refused("alarms", *words)
    assert "written as .csv" in refused("alarms", "check", "demo", "-o", str(tmp_path / "alarms.txt"))


def test_the_help_has_the_exit_codes() -> None:
    text = " ".join(command("alarms", "check", "--help").output.split())
    for code in ("3 a value reaches a warning", "4 a value reaches an alarm", "5 no value reaches a warning, but something"):
        assert code in text
