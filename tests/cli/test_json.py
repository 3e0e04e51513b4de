"""``--json`` of every command: one object on standard output, which says what the database and the files say."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import laspy
import psycopg
import pytest
import shapely
from click.testing import CliRunner
from psycopg.conninfo import make_conninfo

from tunneldb.cli.main import COMMANDS, main

TUNNELDB = [sys.executable, "-c", "from tunneldb.cli.main import main; main()"]


def told(code: int, *words: object) -> dict[str, Any]:
    """Run a command in this process; returns its object, which must be all of standard output, and without NaN."""
    result = CliRunner().invoke(main, [*map(str, words), "--json"])
    assert result.exit_code == code, result.output
    said = json.loads(result.stdout, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    assert isinstance(said, dict)
    assert (said["ok"], said["exit_code"]) == (code == 0, code)
    assert " ".join(map(str, words)).startswith(said["command"])
    assert 0 <= said["seconds"] < 600
    assert ("error" in said) is (code == 2)
    return said


def rows(conn: psycopg.Connection, query: str) -> list[tuple[Any, ...]]:
    found = conn.execute(query.encode()).fetchall()
    conn.rollback()
    return found


def test_what_is_listed_is_what_the_views_hold(example: str, conn: psycopg.Connection) -> None:
    leaks = told(0, "leaks", example)
    held = rows(
        conn, "SELECT id, area, chainage_from, review, ST_AsGeoJSON(unrolled, 15)::json FROM tunnel_api.leak WHERE detected"
    )
    assert leaks["listed"] == len(leaks["leaks"]) == len(held)
    counted = "SELECT count(*)::int, sum(area) FROM tunnel_api.leak WHERE counted"
    assert [(leaks["count"], pytest.approx(leaks["area"]))] == rows(conn, counted)
    by_id = {leak["id"]: leak for leak in leaks["leaks"]}
    for key, area, chainage, review, outline in held:
        assert (by_id[key]["area"], by_id[key]["chainage_from"], by_id[key]["review"]) == (area, chainage, review)
        assert shapely.equals_exact(shapely.geometry.shape(by_id[key]["geometry"]), shapely.geometry.shape(outline), 1e-9)
    by_km = told(0, "leaks", example, "--by-km")["kilometres"]
    assert [(km["km"], km["wet_area"]) for km in by_km] == rows(conn, "SELECT km, wet_area FROM tunnel_api.km_waterproof")
    (survey,) = told(0, "survey", "list")["surveys"]
    assert (survey["name"], survey["points"], survey["date"]) == (example, 60, "2024-05-04")
    (tunnel,) = told(0, "tunnel", "list")["tunnels"]
    assert (tunnel["name"], tunnel["srid"], tunnel["spacing"], tunnel["surveys"]) == ("demo", 25830, 10.0, 1)
    (short,) = told(0, "status")["surveys"]
    assert short["done"] == dict.fromkeys(("load", "axis", "segments", "sections", "ground", "detect"), 1)
    status = told(0, "status", example)
    assert status["survey"] == example
    assert {cell["state"] for cell in status["kilometres"]["12"].values()} == {"done"}
    vertices = rows(conn, "SELECT count(*)::int FROM tunnel_api.axis_vertex WHERE source <> 'interpolated'")[0][0]
    assert all(0 < element["vertices"] <= vertices for element in told(0, "axis", example)["elements"])
    assert told(0, "tunnel", "stationing", "demo", "--show")["tunnel"] == "demo"
    (blocks, zones) = told(0, "elements", "list", "demo")["element_sets"]
    assert (blocks["elements"], zones["elements"]) == (4, 16)
    (scheme,) = told(0, "rating", "list")["schemes"]
    assert len(told(0, "rating", "show", scheme["name"])["rules"]) == scheme["rules"] == 2
    ratings = told(0, "rating", "apply", example, "--elements", "blocks", "--scheme", "example")["ratings"]
    held = rows(conn, f"SELECT name, result, level FROM tunnel_api.rating('{example}', 'blocks', 'example')")
    assert [(one["name"], one["result"], one["level"]) for one in ratings] == held
    (action,) = told(0, "actions", "list", "demo")["actions"]
    assert (action["measure"], action["cost"], action["currency"]) == ("seal the joint", 1200.0, "EUR")
    both = told(0, "rating", "compare", example, "--elements", "blocks", "--scheme", "example", "--scheme", "example:1")
    assert {one["difference"] for one in both["ratings"]} == {0}
    assert [limit["name"] for limit in told(0, "alarms", "list", "demo")["limits"]] == ["chord", "growth", "oval", "wet"]
    alarms = told(4, "alarms", "check", "demo")
    held = rows(conn, "SELECT name, value, level FROM tunnel_api.alarms('demo')")
    assert [(one["name"], one["value"], one["level"]) for one in alarms["alarms"]] == held
    assert alarms["levels"]["alarm"] == sum(level == "alarm" for _, _, level in held) > 0


LEAK = (
    "id", "km", "chainage_from", "chainage_to", "label", "arc_from", "arc_to", "clock", "kind", "confidence", "reasons",
    "contrast", "area", "drop_mean", "drop_max", "image_share", "review", "reviewed_by", "reviewed_at", "detected", "counted",
    "geometry", "severity", "severity_label", "remark", "easting", "northing", "height",
    "other_images", "other_contrast",
)  # fmt: skip
"""Columns that programs rely on."""


def test_a_leak_has_the_same_names_in_json_and_in_files(example: str) -> None:
    leaks = told(0, "leaks", example, "--kind", "all")["leaks"]
    header = CliRunner().invoke(main, ["leaks", example, "--kind", "all", "--format", "csv"]).stdout.splitlines()[0]
    assert leaks
    assert all(tuple(leak) == LEAK for leak in leaks)
    assert header == ",".join(LEAK)


def test_what_is_written_is_named(example: str, tmp_path: Path, conn: psycopg.Connection) -> None:
    images = told(0, "image", "write", example, "-o", tmp_path / "images")["files"]
    assert {Path(path).suffix for path in images} == {".tif", ".png"}
    assert sorted(map(str, (tmp_path / "images").iterdir())) == sorted(images)
    leaks = told(0, "leaks", example, "-o", tmp_path / "leaks.csv")
    assert len(Path(leaks["file"]).read_text("utf-8").splitlines()) == 1 + len(leaks["gaps"]) + leaks["listed"]
    assert "leaks" not in leaks
    project = told(0, "qgis", example, "-o", tmp_path / "demo.qgz")
    assert project["written"] == [str(tmp_path / "demo.qgz")]
    assert all(Path(path).is_file() for path in project["images"])
    plain = told(0, "export", example, "-o", tmp_path / "demo.dxf", "--from", "12+300", "--to", "12+400")
    assert plain["file"] == str(tmp_path / "demo.dxf")
    assert plain["layers"]
    report = told(0, "report", example, "-o", tmp_path / "demo.html")
    assert report["bytes"] == (tmp_path / "demo.html").stat().st_size
    assert report["leaks"] == rows(conn, "SELECT count(*)::int FROM tunnel_api.leak WHERE counted")[0][0]


def test_what_is_compared_and_computed(example: str, tmp_path: Path, conn: psycopg.Connection) -> None:
    conn.execute(
        "INSERT INTO tunnel.station (survey_id, scan_id, geom) SELECT survey_id, 1, geom FROM tunnel.axis_vertex WHERE n = 1240"
    )
    conn.commit()
    assert told(0, "leaks", example, "-o", tmp_path / "truth.geojson")["listed"] == 7
    figures = told(0, "evaluate", example, tmp_path / "truth.geojson")
    everything = next(group for group in figures["groups"] if group["group"] == "all")
    assert everything["area_recall"] < 1.0  # one leak was rejected, and counts as not found
    assert len(figures["true"]) == 7
    points = tmp_path / "points.csv"
    points.write_text("name,chainage,arc\na,12345,2\nb,99999,0\n")
    unrolled = told(0, "unroll", example, points, "--inverse")
    assert (unrolled["points"], unrolled["off_tunnel"]) == (2, 1)
    on, off = unrolled["rows"]
    survey = rows(conn, "SELECT id FROM tunnel.survey")[0][0]
    place = rows(conn, f"SELECT ST_X(g), ST_Y(g), ST_Z(g) FROM tunnel_api.roll({survey}, 12345.0, 2.0, 0.0) g")[0]
    assert [float(on[name]) for name in "xyz"] == pytest.approx(place, abs=1e-3)
    assert off["x"] == ""


def test_what_is_wrong_is_told_with_what_was_done_before(example: str, tmp_path: Path) -> None:
    for words in (
        ["load", example, "nowhere.laz"], ["run", example], ["batch", example, "--to", "roof"],
        ["ground", "a.laz", "-o", "b.laz"],
        ["spheres", "nobody", "--radius", "0.07"], ["intensity", "nobody"], ["server", "stop"], ["server", "status"],
        ["server", "start"], ["tunnel", "remove", "demo"], ["survey", "remove", "nobody", "--yes"], ["tunnel", "add", "demo"],
        ["members", "nobody"], ["spots", "nobody"], ["learn", example],
        ["simulate-structure", str(tmp_path), "--stations", "0"],
        ["simulate-canal", str(tmp_path), "--length", "1"],
        ["profile", "add", "demo", "nowhere.csv"], ["deviation", "nobody"], ["clearance", "nobody", "--gauge", "nowhere.csv"],
        ["thickness", "nobody", example], ["evenness", "nobody"], ["compare", "nobody", "nobody"],
        ["rings", "--points", "nowhere.csv", "--axis", "nowhere.csv", "--diameter", "6"],
        ["survey", "add", "x"], ["export", example, "-o", str(tmp_path / "x.pdf")], ["status", example, "--watch"],
    ):  # fmt: skip
        assert told(2, *words)["error"]


def test_check_tells_what_is_wrong_and_what_mends_it(dsn: str, conn: psycopg.Connection) -> None:
    assert {finding["level"] for finding in told(0, "check")["findings"]} <= {"ok", "note"}
    conn.execute("COMMENT ON SCHEMA tunnel_api IS 'Functions and views of tunneldb 0.0.9, abc'")
    conn.commit()
    (wrong,) = [finding for finding in told(1, "check")["findings"] if finding["level"] == "wrong"]
    assert (wrong["subject"], wrong["remedy"]) == ("schema tunnel_api", "tunneldb init")
    assert told(0, "init")["revision"] == told(0, "init")["before"]


def test_a_survey_from_its_scan_to_its_end(dsn: str, tmp_path: Path, conn: psycopg.Connection) -> None:
    made = told(0, "simulate", tmp_path, "--name", "s", "--length", 40, "--density", 100, "--scanner", "profiler", "--leaks", 2)
    with laspy.open(made["files"]["clouds"][0]) as scan:
        points = scan.header.point_count
    assert made["points"] == points
    added = told(0, "tunnel", "add", "t", "--srid", 25830, "--axis", made["files"]["axis"])
    assert added["chainage_to"] == pytest.approx(40.0, abs=0.01)
    posed = told(
        0, "survey", "add", "s", "--tunnel", "t", "--date", "2024-05-04", "--trajectory", made["files"]["poses"],
        "--intensity", "Amplitude", "--intensity-kind", "amplitude", "--reference", made["files"]["reference"],
    )  # fmt: skip
    assert posed["poses"] == rows(conn, "SELECT count(*)::int FROM tunnel.pose")[0][0]
    (file,) = told(0, "load", "s", made["files"]["clouds"][0])["files"]
    assert (file["points"], file["kept"]) == (points, rows(conn, "SELECT count(*)::int FROM tunnel.point")[0][0])
    ran = told(0, "run", "s", "--to", "sections")["stages"]
    assert [(done["stage"], done["km"]) for done in ran] == [("axis", 0), ("segments", 0), ("sections", 0)]
    assert ran[1]["counts"] == rows(conn, "SELECT counts FROM tunnel.run WHERE stage = 'segments'")[0][0]
    found = told(0, "spheres", "s", "--radius", 0.0725)
    assert (found["points"], found["count"], found["spheres"]) == (points, 0, [])
    preview = told(0, "batch", "s", "--to", "sections", "--preview")
    assert preview["fits"] is True
    batch = told(0, "batch", "s", "--to", "sections", "--workers", 1)
    assert [(km["km"], km["state"]) for km in batch["kilometres"]] == [(0, "done")]
    assert told(0, "survey", "remove", "s", "--yes")["points"] == file["kept"]
    assert told(0, "tunnel", "remove", "t")["tunnel"] == "t"


def test_a_worker_tells_when_it_leaves(dsn: str, conn: psycopg.Connection) -> None:
    with subprocess.Popen([*TUNNELDB, "worker", "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as worker:
        while not rows(conn, "SELECT 1 FROM tunnel.worker"):
            assert worker.poll() is None
            time.sleep(0.05)
        assert told(0, "stop", "--wait")["workers"] == 1
        output, errors = worker.communicate(timeout=60)
    assert (json.loads(output)["jobs"], errors) == (0, "")


def test_a_desk_tells_its_address_when_it_is_stopped(dsn: str) -> None:
    with subprocess.Popen(
        [*TUNNELDB, "serve", "--json", "--no-open", "--port", "0"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as desk:
        assert desk.stderr is not None
        address = desk.stderr.readline().strip()
        desk.terminate()
        output, _ = desk.communicate(timeout=60)
    assert json.loads(output)["address"] == address


def test_what_a_scan_holds_is_told(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("x,y,z,Amplitude\n" + "".join(f"{i % 9},{i % 7},{i % 5},{i}\n" for i in range(900)))
    (look,) = told(0, "inspect", tmp_path / "a.csv")["files"]
    assert (look["points"], look["high"], look["intensities"][0]["values"]["most"]) == (900, [8.0, 6.0, 4.0], 899.0)


def test_a_program_reads_it_from_the_pipe(example: str) -> None:
    piped = (
        " ".join(f"'{word}'" for word in [*TUNNELDB, "leaks", example, "--json"])
        + f" | {sys.executable} -m json.tool --compact"
    )
    done = subprocess.run(["bash", "-o", "pipefail", "-c", piped], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)["listed"] == 7


def test_scans_that_cannot_be_registered_are_told(example: str, tmp_path: Path) -> None:
    ladders = tmp_path / "ladders.csv"
    ladders.write_text("ladder,rung,height,stile_gap,diameter\n")
    said = told(2, "register", example, tmp_path / "a.xyz", "--ladders", ladders, "--up", "+z", "--water-level", 1.0)
    assert "has no ladder" in said["error"]


def test_what_is_pruned_and_vacuumed_is_told_in_rows_and_bytes(example: str, conn: psycopg.Connection) -> None:
    conn.execute("UPDATE tunnel.run SET stage = 'axis', parameters = '{}'")  # six runs of one stage: the last one stays
    conn.commit()
    length = "SELECT count(*), sum(pg_column_size(r.*))::int FROM tunnel.run r WHERE id < (SELECT max(id) FROM tunnel.run)"
    shown = told(0, "prune", example)
    assert [(shown["rows"], pytest.approx(shown["bytes"], rel=0.05))] == rows(conn, length)
    assert told(0, "prune", example, "--yes")["deleted"] == {"runs": 5, "jobs": 0}
    dead = told(0, "vacuum")
    assert dead["dead_bytes"] == sum(table["dead_bytes"] for table in dead["tables"])
    assert not dead["done"]


def test_a_hub_tells_its_servers(people: None, example: str, dsn: str, empty_dsn: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TUNNELDB_DSN", empty_dsn)
    assert told(0, "federate", "list")["servers"] == []
    added = told(0, "federate", "add", "north", "--dsn", make_conninfo(dsn, user="vera"))
    assert (added["name"], added["tunnels"], added["surveys"], added["warnings"]) == ("north", 1, 1, [])
    (listed,) = told(0, "federate", "list")["servers"]
    assert (listed["name"], listed["state"], listed["user"], listed["surveys"]) == ("north", "present", "vera", 1)
    checked = told(0, "federate", "check")
    assert [server["state"] for server in checked["servers"]] == ["present"]
    assert (checked["went_away"], checked["returned"], checked["warnings"]) == ([], [], [])
    assert told(0, "federate", "remove", "north")["remaining"] == 0


def test_no_verb_was_left_out() -> None:
    text = Path(__file__).read_text("utf-8")
    assert [name for name in COMMANDS if name != "psql" and f'"{name}"' not in text] == []
