"""Stationing: a tunnel whose stations jump, overlap and run backwards, worked out by hand."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import psycopg
import pytest
from click.testing import CliRunner, Result
from psycopg import sql
from support.example_change import add_change
from support.example_deviation import add_surfaces
from support.example_sonar import save_example_registration
from support.example_structures import save_example_structures

from tests.qgis.test_project import act
from tunneldb.cli.main import main
from tunneldb.errors import UserError
from tunneldb.geometry.stationing import Equation, Stationing, chainage_label
from tunneldb.store.alignment import load_stationing, save_equations

AXIS = "x,y,z\n500000,4640000,100\n500000,4641000,104\n"
EQUATIONS = "chainage,station,direction\n100,12100,1\n400,12350,1\n700,13000,1\n900,20000,-1\n"
"""Of a tunnel from 0 to 1000 m: 50 m of overlap at 400, a gap of 350 m at 700, backwards from 900 on."""

BY_HAND = [  # chainage, station
    (-5.0, 11995.0),
    (0.0, 12000.0),
    (99.0, 12099.0),
    (100.0, 12100.0),
    (399.0, 12399.0),
    (400.0, 12350.0),
    (699.0, 12649.0),
    (700.0, 13000.0),
    (899.5, 13199.5),
    (900.0, 20000.0),
    (1000.0, 19900.0),
]

ASKED = [  # station, chainages
    ("12+000", [0.0]),
    ("12+349.9", [349.9]),
    ("12+350", [350.0, 400.0]),
    ("12360.5", [360.5, 410.5]),
    ("12+400", [400.0, 450.0]),
    ("12+401", [451.0]),
    ("12+650", [700.0]),
    ("13+000", [700.0]),
    ("12+651", []),
    ("12+999.999", []),
    ("13+200", [900.0]),
    ("20+000", [900.0]),
    ("19+900", [1000.0]),
    ("19+985.25", [914.75]),
    ("20+000.1", []),
    ("19+890", [1010.0]),  # the measured axis may be longer by a vertex
    ("19+889", []),
    ("5+000", []),
]

OWN = [Equation(12300.0, 500.0), Equation(12400.0, 580.0), Equation(12430.0, 3000.0, -1)]
"""Of the example survey, 12+300 to 12+500: an overlap of 20 m, then backwards."""


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def refused(result: Result, *parts: str) -> None:
    """One line on stderr, exit code 2, no traceback."""
    assert result.exit_code == 2, (result.stderr, result.exception)
    assert result.stderr.startswith("tunneldb: ")
    assert result.stderr.count("\n") == 1
    for part in parts:
        assert part in result.stderr


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "axis.csv").write_text(AXIS)
    (tmp_path / "own.csv").write_text(EQUATIONS)
    return tmp_path


@pytest.fixture
def tunnel(conn: psycopg.Connection, files: Path) -> int:
    result = run("tunnel", "add", "t", "--srid", "25830", "--axis", "axis.csv", "--stationing", "own.csv")
    assert result.exit_code == 0, result.stderr
    return conn.execute("SELECT tunnel_api.tunnel_id('t')").fetchone()[0]


def asked(conn: psycopg.Connection, tunnel: int, station: str) -> list[float]:
    rows = conn.execute("SELECT c FROM tunnel_api.station_chainages(%s, %s) c", (tunnel, station))
    return [row[0] for row in rows]


def test_stations_by_hand(conn: psycopg.Connection, tunnel: int) -> None:
    own = load_stationing(conn, tunnel)
    for chainage, station in BY_HAND:
        row = conn.execute(
            "SELECT tunnel_api.station(%(t)s, %(c)s), tunnel_api.station_label(%(t)s, %(c)s)", {"t": tunnel, "c": chainage}
        ).fetchone()
        label = f"{station // 1000:.0f}+{station % 1000:07.3f}"
        assert row == (pytest.approx(station, abs=1e-9), label)
        assert own.station(chainage) == pytest.approx(station, abs=1e-9)
        assert own.label(chainage) == label


def test_chainages_of_stations_by_hand(conn: psycopg.Connection, tunnel: int) -> None:
    for station, chainages in ASKED:
        assert asked(conn, tunnel, station) == pytest.approx(chainages, abs=1e-9), station
    with pytest.raises(psycopg.errors.InvalidTextRepresentation):
        asked(conn, tunnel, "km 12")


def test_every_place_is_among_those_that_its_label_finds(conn: psycopg.Connection, tunnel: int) -> None:
    rng = np.random.default_rng(6)
    ends = [0.0, 100.0, 400.0, 700.0, 900.0, 1000.0]
    places = [*rng.uniform(0, 1000, 150), *ends, *(end - 1e-4 for end in ends[1:]), *(end + 1e-4 for end in ends[:-1])]
    rows = conn.execute(
        "SELECT p, tunnel_api.station_label(%(t)s, p), (SELECT min(abs(c - p))"
        " FROM tunnel_api.station_chainages(%(t)s, tunnel_api.station_label(%(t)s, p)) c) FROM unnest(%(p)s::float8[]) p",
        {"t": tunnel, "p": places},
    ).fetchall()
    assert len(rows) == len(places)
    own = load_stationing(conn, tunnel)
    for place, label, off in rows:
        assert off is not None, (place, label)
        assert off <= 0.0005 + 1e-9, (place, label)
        assert own.label(place) == label


def test_a_tunnel_without_equations_has_its_chainage_for_station(conn: psycopg.Connection, example: str) -> None:
    tunnel = conn.execute("SELECT tunnel_api.tunnel_id('demo')").fetchone()[0]
    assert asked(conn, tunnel, "12+345.678") == [12345.678]
    assert asked(conn, tunnel, "12+100") == []
    row = conn.execute("SELECT tunnel_api.station_label(%s, 12345.678), tunnel_api.station(%s, 5)", (tunnel, tunnel)).fetchone()
    assert row == ("12+345.678", 5.0)
    assert load_stationing(conn, tunnel) == Stationing([])
    pieces = conn.execute("SELECT * FROM tunnel_api.station_pieces(%s)", (tunnel,)).fetchall()
    assert [(row[0], row[5], row[6]) for row in pieces] == [(1, 1, "12+300.000")]
    with pytest.raises(psycopg.errors.RaiseException, match="no tunnel gone"):
        conn.execute("SELECT tunnel_api.tunnel_id('gone')")


def test_pieces_lie_between_the_ends_of_the_tunnel(conn: psycopg.Connection, tunnel: int) -> None:
    rows = conn.execute(
        "SELECT n, chainage_from, chainage_to, station_from, station_to, direction, label_to"
        " FROM tunnel_api.station_pieces(%s)", (tunnel,),
    ).fetchall()  # fmt: skip
    assert rows == [
        (1, 0.0, 400.0, 12000.0, 12400.0, 1, "12+400.000"),
        (2, 400.0, 700.0, 12350.0, 12650.0, 1, "12+650.000"),
        (3, 700.0, 900.0, 13000.0, 13200.0, 1, "13+200.000"),
        (4, 900.0, 1000.0, 20000.0, 19900.0, -1, "19+900.000"),
    ]
    save_equations(conn, tunnel, [Equation(-500.0, 1.0), Equation(-100.0, 0.0), Equation(1000.0 - 1e-6, 7.0)])
    rows = conn.execute("SELECT chainage_from, station_from FROM tunnel_api.station_pieces(%s)", (tunnel,)).fetchall()
    assert rows == [(0.0, 100.0), (1000.0 - 1e-6, 7.0)]


def test_equations_are_shown_with_the_station_back(conn: psycopg.Connection, tunnel: int) -> None:
    rows = conn.execute(
        "SELECT tunnel, chainage, station_back, station, direction, label FROM tunnel_api.station_equation ORDER BY chainage"
    ).fetchall()
    assert rows == [
        ("t", 100.0, None, 12100.0, 1, "12+100.000"),
        ("t", 400.0, 12400.0, 12350.0, 1, "12+350.000"),
        ("t", 700.0, 12650.0, 13000.0, 1, "13+000.000"),
        ("t", 900.0, 13200.0, 20000.0, -1, "20+000.000"),
    ]


def labelled_views(conn: psycopg.Connection) -> list[tuple[str, str, str]]:
    """View, column of labels, and what gives the chainage of each; the labels of catalogues are words."""
    rows = conn.execute(
        "SELECT c.relname, array_agg(a.attname::text) FROM pg_class c"
        " JOIN pg_attribute a ON a.attrelid = c.oid AND a.attnum > 0"
        " WHERE c.relnamespace = 'tunnel_api'::regnamespace AND c.relkind = 'v'"
        " AND c.relname NOT IN ('station_equation', 'finding_kind', 'severity')"
        " GROUP BY c.relname HAVING array_agg(a.attname::text) && '{label,label_from,label_to}'"
    ).fetchall()
    return [
        (view, label, place if place in columns else "(chainage_from + chainage_to) / 2")
        for view, columns in rows
        for label, place in (("label", "chainage"), ("label_from", "chainage_from"), ("label_to", "chainage_to"))
        if label in columns
    ]


def test_labels_of_every_view_are_stations(conn: psycopg.Connection, example: str) -> None:
    save_example_structures(conn, example)
    save_example_registration(conn, example)
    add_change(conn, example)
    add_surfaces(conn, conn.execute("SELECT id FROM tunnel.survey WHERE name = %s", [example]).fetchone()[0])
    for table in ("member", "face", "spot"):
        conn.execute(sql.SQL("UPDATE tunnel.{} SET chainage = 12345.678 + id").format(sql.Identifier(table)))
    conn.execute("INSERT INTO tunnel.dark_band SELECT id, 12, 0, 12350, 12400, -7, -6.6, 3, 20 FROM tunnel.survey")
    inner = "SELECT survey_id, n, geom FROM tunnel.axis_vertex ORDER BY n OFFSET 2 LIMIT 7"
    conn.execute(f"INSERT INTO tunnel.pose (survey_id, time, geom) {inner}")
    conn.execute(f"INSERT INTO tunnel.station {inner}")
    conn.execute("UPDATE tunnel.alarm_limit SET chainage_from = 12310, chainage_to = 12400")
    views = labelled_views(conn)
    seen = set()
    for equations in (OWN, []):
        save_equations(conn, conn.execute("SELECT tunnel_api.tunnel_id('demo')").fetchone()[0], equations)
        own = Stationing(equations)
        for view, label, place in views:
            names = {"view": sql.Identifier(view), "label": sql.Identifier(label), "place": sql.SQL(place)}
            rows = conn.execute(sql.SQL("SELECT {label}, {place} FROM tunnel_api.{view}").format(**names)).fetchall()
            wrong = [(text, at) for text, at in rows if text not in (own.label(at), own.label(at).removesuffix(".000"))]
            assert not wrong, (view, label, wrong[:3])
            if rows:
                seen.add(view)
    assert seen == {view for view, _, _ in views} >= {"leak", "axis_deviation", "alignment_element", "target_sphere"}


def test_rings_and_verdicts_speak_of_stations(conn: psycopg.Connection, example: str) -> None:
    save_equations(conn, conn.execute("SELECT tunnel_api.tunnel_id('demo')").fetchone()[0], OWN)
    own = Stationing(OWN)
    rows = conn.execute("SELECT chainage_from, label FROM tunnel_api.ring_statistics(%s, 1.5, 12300)", (example,)).fetchall()
    assert len(rows) == 134
    assert all(own.label(at) == label for at, label in rows)
    (area, middle), = conn.execute(
        "SELECT area, (chainage_from + chainage_to) / 2 FROM tunnel_api.leak"
        " WHERE review <> 'rejected' ORDER BY area DESC LIMIT 1"
    ).fetchall()  # fmt: skip
    (breaks,), = conn.execute(
        "SELECT breaks FROM tunnel_api.waterproof_class(%s, 12300, 12500) WHERE class = 3", (example,)
    ).fetchall()  # fmt: skip
    assert f"patch of {area:.3f} m² at {own.label(middle)} > 0.3 m²" in breaks[0]


def test_a_leak_is_reviewed_and_a_vertex_moved_where_stations_jump(conn: psycopg.Connection, example: str) -> None:
    save_equations(conn, conn.execute("SELECT tunnel_api.tunnel_id('demo')").fetchone()[0], OWN)
    assert conn.execute("UPDATE tunnel_api.leak_map SET review = 'confirmed' WHERE review = 'open'").rowcount == 4
    moved = conn.execute("UPDATE tunnel_api.axis_vertex SET geom = ST_Translate(geom, 0, 0, 0.1) WHERE label = '0+550.000'")
    assert moved.rowcount == 1
    assert conn.execute("SELECT chainage FROM tunnel_api.axis_vertex WHERE source = 'edited'").fetchall() == [(12350.0,)]


def test_who_only_reads_sees_stations(conn: psycopg.Connection, example: str) -> None:
    save_equations(conn, conn.execute("SELECT tunnel_api.tunnel_id('demo')").fetchone()[0], OWN)
    conn.execute("SET LOCAL ROLE tunnel_viewer")
    labels = [row[0] for row in conn.execute("SELECT label FROM tunnel_api.section WHERE chainage < 12310 ORDER BY chainage")]
    assert labels == ["0+502.500", "0+507.500"]
    row = conn.execute(
        "SELECT tunnel_api.station_label(t, 12431), array(SELECT tunnel_api.station_chainages(t, '0+590'))"
        " FROM tunnel_api.tunnel_id('demo') t"
    ).fetchone()
    assert row == ("2+999.000", [12390.0, 12410.0])
    with pytest.raises(psycopg.errors.InsufficientPrivilege):
        conn.execute("INSERT INTO tunnel.station_equation (tunnel_id, chainage, station) VALUES (1, 12301, 0)")


def test_labels_cost_a_lookup_and_only_where_they_are_asked_for(conn: psycopg.Connection, example: str) -> None:
    def plan(query: str) -> str:
        return "\n".join(row[0] for row in conn.execute(f"EXPLAIN (VERBOSE) {query}"))

    shown = plan("SELECT label FROM tunnel_api.leak")
    assert "station_equation" in shown
    assert "tunnel_api." not in shown, "no function of ours is called for each row"
    assert "station_equation" not in plan("SELECT id, chainage_from, area FROM tunnel_api.leak")


def test_qgis_labels_are_stations(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    save_equations(conn, conn.execute("SELECT tunnel_api.tunnel_id('demo')").fetchone()[0], OWN)
    conn.execute("UPDATE tunnel.cluster SET height_from = -0.1, height_to = -0.04 WHERE height_to = 1.8")
    conn.commit()
    assert run("qgis", example, "-o", tmp_path / "demo.qgz").exit_code == 0
    vertices = act(tmp_path / "demo.qgz", "labels", "axis_vertex")
    assert vertices["error"] == ""
    own = Stationing(OWN)
    assert vertices["texts"] == [own.label(chainage, 0) for chainage in range(12300, 12501, 10)]
    clusters = act(tmp_path / "demo.qgz", "labels", "cluster")
    assert sorted(clusters["texts"]) == ["object 1.1 m"], "not the sunk one, nor what is no object"


def test_the_commands_show_and_take_stations(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    (tmp_path / "own.csv").write_text("chainage,station,direction\n" + "".join(f"{c},{s},{d}\n" for c, s, d in OWN))
    result = run("tunnel", "stationing", "demo", tmp_path / "own.csv")
    assert result.exit_code == 0, result.stderr
    assert run("tunnel", "stationing", "demo", "--show").stdout == result.stdout
    assert [line.split() for line in result.stdout.splitlines()[1:3]] == [
        ["12300.000", "12400.000", "0+500.000", "0+600.000", "up"],
        ["12400.000", "12430.000", "0+580.000", "0+610.000", "up"],
    ]
    assert "0+500.000" in run("tunnel", "list").stdout
    assert "0+500.000" in run("status", example).stdout
    assert "2+930.000" in run("survey", "list").stdout

    def listed(*options: str, code: int = 0) -> list[str]:
        result = run("leaks", example, "--format", "csv", *options)
        assert result.exit_code == code, result.stderr
        return [row["label"][:5] for row in csv.DictReader(result.stdout.splitlines()) if row["id"]]

    every = listed()
    assert len(every) == 7
    assert listed("--from", "0+530", "--to", "0+560") == every[1:2]
    assert listed("--from", "2+980", "--to", "2+940") == listed("--from", "2+940", "--to", "2+980") == every[-1:]
    assert listed("--to", "12350") == every[:2]
    for ends in (("--from", "560", "--to", "530"), ("--from", "0+560", "--to", "0+530")):
        result = run("leaks", example, *ends)
        assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
        assert f"{' '.join(ends)} runs backwards: give the smaller one first" in result.stderr
    assert listed("--from", "12000", "--to", "13000", code=1) == every  # nothing was scanned of its ends
    refused(run("leaks", example, "--from", "0+590"), "--from 0+590", "2 times", "12390.000 and 12410.000", "--from 12390.000")
    refused(run("leaks", example, "--to", "7+000"), "no such station", "tunneldb tunnel stationing demo --show")
    refused(run("leaks", example, "--to", "km 7"), "--to takes a station", "'km 7'")

    assert run("tunnel", "stationing", "demo", "--clear").exit_code == 0
    assert listed("--from", "12+330", "--to", "12+350") == ["12+34"]


@pytest.mark.parametrize(
    ("clock", "wanted"),
    [("10-2", lambda c: c >= 10 or c <= 2), ("2-10", lambda c: 2 <= c <= 10), ("12-1:30", lambda c: c <= 1.5),
     ("9:30-12", lambda c: c >= 9.5)],
)  # fmt: skip
def test_leaks_by_the_clock(conn: psycopg.Connection, example: str, clock: str, wanted) -> None:
    hours = dict(conn.execute("SELECT id, clock FROM tunnel_api.leak").fetchall())
    expected = sorted(key for key, hour in hours.items() if wanted(hour))
    assert 0 < len(expected) < len(hours)
    result = run("leaks", example, "--format", "csv", "--clock", clock)
    assert sorted(int(row["id"]) for row in csv.DictReader(result.stdout.splitlines()) if row["id"]) == expected


def test_what_is_no_part_of_the_clock_is_refused(example: str) -> None:
    for clock in ("10", "0-3", "13-1", "10-2-3", "3:60-4", "a-b", "-"):
        refused(run("leaks", example, "--clock", clock), "--clock takes hours from 1 to 12")
    refused(run("leaks", example, "--clock", "3-3:00"), "is one position")
    refused(run("leaks", example, "--by-km", "--clock", "10-2"), "--by-km")


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("", ["own.csv is empty", "chainage,station"]),
        ("chainage,direction\n1,1\n", ["no column station"]),
        ("chainage;direction\n1;1\n", ["no column station"]),
        ("chainage,station\n", ["no row"]),
        ("chainage,station\n0,abc\n", ["line 2", "station is 'abc'"]),
        ("chainage,station\n0,nan\n", ["line 2", "station is nan"]),
        ("chainage,station\n0,1\n10,2\n5,3\n", ["line 4", "chainage 5 is less than"]),
        ("chainage,station\n0,1\n0,2\n", ["line 3", "chainage 0 repeats"]),
        ("chainage,station,direction\n0,1,1\n5,2,0\n", ["line 3", "direction 0 is neither 1"]),
        ("chainage,station,direction\n0,1,\n", ["line 2", "direction is empty"]),
        ("chainage,station,direction,direction\n0,1,1,1\n", ["column direction twice"]),
        (
            "chainage,station\n0,12000\n12500,13000\n",
            ["12500.000 m is beyond the end", "0.000 to 1000.000 m", "not a station"],
        ),
    ],
)
def test_wrong_equations_are_refused(conn: psycopg.Connection, files: Path, text: str, parts: list[str]) -> None:
    (files / "own.csv").write_text(text)
    add = ["tunnel", "add", "t", "--srid", "25830", "--axis", "axis.csv"]
    refused(run(*add, "--stationing", "own.csv"), *parts)
    assert conn.execute("SELECT count(*) FROM tunnel.tunnel").fetchone() == (0,)
    conn.rollback()
    assert run(*add).exit_code == 0
    refused(run("tunnel", "stationing", "t", "own.csv"), *parts)
    assert conn.execute("SELECT count(*) FROM tunnel.station_equation").fetchone() == (0,)


def test_wrong_words(conn: psycopg.Connection, tunnel: int, files: Path) -> None:
    refused(run("tunnel", "stationing", "t"), "give either a FILE, or --show, or --clear")
    refused(run("tunnel", "stationing", "t", "own.csv", "--clear"), "give either")
    refused(run("tunnel", "stationing", "gone", "--show"), "no tunnel 'gone'", "has t")
    refused(run("tunnel", "stationing", "t", "gone.csv"), "gone.csv: No such file")
    assert conn.execute("SELECT count(*) FROM tunnel.station_equation").fetchone() == (4,)
    for equations, part in (
        ([Equation(0.0, float("inf"))], "finite"),
        ([Equation(5.0, 0.0), Equation(5.0, 1.0)], "growing"),
        ([Equation(5.0, 0.0, 2)], "1 or -1, not 2"),
    ):
        with pytest.raises(UserError, match=part):
            save_equations(conn, tunnel, equations)


def test_equations_go_with_their_tunnel(conn: psycopg.Connection, tunnel: int) -> None:
    assert run("tunnel", "remove", "t").exit_code == 0
    assert conn.execute("SELECT count(*) FROM tunnel.station_equation").fetchone() == (0,)


def test_labels_in_python_are_those_of_the_database(conn: psycopg.Connection) -> None:
    values = [0.0, 0.0004, -0.0004, 999.9996, 12345.678, -5.25, 511746.75, -1234.5, 1e6]
    rows = conn.execute("SELECT v, tunnel_api.chainage_label(v) FROM unnest(%s::float8[]) v", (values,)).fetchall()
    assert [chainage_label(value) for value, _ in rows] == [label for _, label in rows]
    assert [chainage_label(value, 0) for value in (0.4, 12345.678, -5.25, 999.7)] == ["0+000", "12+346", "-0+005", "1+000"]
    assert chainage_label(12005.06, 1) == "12+005.1"


def test_clock_positions_are_written_as_on_a_clock(conn: psycopg.Connection) -> None:
    said = {0.0: "12:00", 0.5: "12:30", 1.0: "1:00", 3.25: "3:15", 11.999: "12:00", 11.98: "11:59", 12.0: "12:00", 9.1: "9:06"}
    rows = conn.execute("SELECT v, tunnel_api.clock_text(v) FROM unnest(%s::float8[]) v", (list(said),)).fetchall()
    assert dict(rows) == said


def test_between_two_clock_positions(conn: psycopg.Connection) -> None:
    between = {  # from, to: positions within, of all hours
        (10, 2): {10, 11, 12, 0, 1, 2}, (2, 10): {2, 3, 4, 5, 6, 7, 8, 9, 10}, (12, 3): {12, 0, 1, 2, 3},
        (0, 3): {12, 0, 1, 2, 3}, (9, 12): {9, 10, 11, 12, 0}, (9, 0): {9, 10, 11, 12, 0},
    }  # fmt: skip
    for (low, high), expected in between.items():
        rows = conn.execute("SELECT h FROM generate_series(0, 12) h WHERE tunnel_api.clock_between(h, %s, %s)", (low, high))
        assert {row[0] for row in rows} == expected, (low, high)


def test_rings_are_numbered_as_in_their_statistics(conn: psycopg.Connection, example: str) -> None:
    rows = conn.execute(
        "SELECT number, tunnel_api.ring_number(chainage_from, 1.2, 12300.1),"
        " tunnel_api.ring_number((chainage_from + chainage_to) / 2, 1.2, 12300.1)"
        " FROM tunnel_api.ring_statistics(%s, 1.2, 12300.1)", (example,),
    ).fetchall()  # fmt: skip
    assert len(rows) > 150
    assert all(number == at == inside for number, at, inside in rows)
    assert conn.execute("SELECT tunnel_api.ring_number(12300, 1.2, 12300.1)").fetchone() == (0,)
