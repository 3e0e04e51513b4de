"""`findings` and `findings import`: lists, files that other programs read, and imports that are whole or not at all."""

from __future__ import annotations

import csv
import datetime as dt
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import psycopg
import pyogrio.raw
import pytest
import shapely
from click.testing import CliRunner, Result
from support.example_survey import NAME, SRID

from tunneldb.cli.main import main


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def run(*arguments: object) -> Result:
    return CliRunner().invoke(main, [str(a) for a in arguments])


def import_csv(folder: Path, text: str, *options: str) -> Result:
    path = folder / "theirs.csv"
    path.write_text(text, encoding="utf-8")
    return run("findings", "import", NAME, path, *options)


def ids(result: Result) -> list[int]:
    assert result.exit_code == 0, result.output
    return [finding["id"] for finding in json.loads(result.stdout)["findings"]]


DRAWN = (
    "INSERT INTO tunnel_api.finding_unrolled (survey, kind, severity, width_mm, geom) VALUES "
    "('demo-2024', 'crack', 3, 2, 'LINESTRING(12350 1, 12353 1.5)'), "
    "('demo-2024', 'missing_bolt', 1, NULL, 'POINT(12360 -2)'), "
    "('demo-2024', 'leak', NULL, NULL, 'POLYGON((12350 0, 12351 0, 12351 1, 12350 0))')"
)


def test_the_list_is_what_counts_and_is_filtered(conn: psycopg.Connection) -> None:
    conn.execute(DRAWN)
    conn.commit()
    counted = [r[0] for r in conn.execute("SELECT id FROM tunnel_api.finding WHERE counted ORDER BY id")]
    conn.rollback()
    assert sorted(ids(run("findings", NAME, "--json"))) == counted
    assert len(ids(run("findings", NAME, "--kind", "crack", "--kind", "missing_bolt", "--json"))) == 2
    assert len(ids(run("findings", NAME, "--min-severity", 3, "--json"))) == 1
    assert len(ids(run("findings", NAME, "--origin", "drawn", "--from", "12+349", "--to", "12+352", "--json"))) == 2
    assert len(ids(run("findings", NAME, "--state", "rejected", "--json"))) == 1
    assert len(ids(run("findings", NAME, "--state", "all", "--json"))) == len(counted) + 1
    listed = run("findings", NAME).stdout
    assert listed.count("\n") == len(counted) + 2, "after the statement on what was not inspected, and the header"
    assert "missing_bolt" in listed
    assert "kind" in run("findings", NAME, "--count").stdout
    told = json.loads(run("findings", NAME, "--count", "--state", "all", "--kind", "crack", "--json").stdout)
    assert [(row["kind"], row["origin"]) for row in told["counts"]] == [("crack", "drawn")]
    refused = run("findings", NAME, "--count", "--from", "12+349", "-o", "counts.csv")
    assert (refused.exit_code, refused.stderr.count("\n")) == (2, 1)
    assert "leave out --from, -o" in refused.stderr
    wrong = run("findings", NAME, "--kind", "ghost")
    assert wrong.exit_code == 2
    assert wrong.stderr.count("\n") == 1


@pytest.mark.parametrize("geometry", ["unrolled", "map", "3d"])
def test_files_hold_what_the_database_has(conn: psycopg.Connection, tmp_path: Path, geometry: str) -> None:
    conn.execute(DRAWN)
    conn.commit()
    column = {"3d": "surface"}.get(geometry, geometry)
    rows = conn.execute(
        f"SELECT id, severity, length, remark, ST_AsBinary({column}) FROM tunnel_api.finding WHERE counted ORDER BY id".encode()
    ).fetchall()
    conn.rollback()
    for name in ("f.gpkg", "f.geojson", "f.csv"):
        assert run("findings", NAME, "--geometry", geometry, "-o", tmp_path / name).exit_code == 0
    meta, _, shapes, values = pyogrio.raw.read(str(tmp_path / "f.gpkg"), layer=f"finding_{geometry}")
    held = dict(zip(meta["fields"], values, strict=True))
    order = np.argsort(held["id"])
    assert held["id"][order].tolist() == [row[0] for row in rows]
    for k, row in zip(order, rows, strict=True):
        assert shapely.from_wkb(shapes[k]).equals_exact(shapely.from_wkb(bytes(row[4])), 1e-9)
        assert (None if np.isnan(held["severity"][k]) else held["severity"][k]) == row[1]
        assert (None if np.isnan(held["length"][k]) else held["length"][k]) == row[2]
    features = json.loads((tmp_path / "f.geojson").read_text())["features"]
    assert sorted(feature["id"] for feature in features) == [row[0] for row in rows]
    lines = [line for line in csv.DictReader(io.StringIO((tmp_path / "f.csv").read_text())) if line["id"]]
    assert {int(line["id"]): line["geometry"].split()[0] for line in lines} == {
        row[0]: shapely.from_wkb(bytes(row[4])).geom_type.upper() for row in rows
    }


def sheet(path: Path, name: str) -> list[dict[str, Any]]:
    """Rows of a sheet of a workbook by their headings, and each cell the type of which it is."""
    head, *rows = openpyxl.load_workbook(path)[name].iter_rows(values_only=True)
    return [dict(zip(head, row, strict=True)) for row in rows]


def test_the_workbook_is_what_the_database_has(conn: psycopg.Connection, tmp_path: Path) -> None:
    """Read by another library: numbers, moments, what is left out, counts as in `finding_count` and `--json`; no formulas."""
    conn.execute(DRAWN)
    formula = '=HYPERLINK("http://evil","x")'
    conn.execute("UPDATE tunnel_api.finding_unrolled SET remark = %s WHERE kind = 'crack'", [formula])
    conn.execute("UPDATE tunnel_api.finding_unrolled SET remark = '@SUM(1)', review = 'rejected' WHERE kind = 'missing_bolt'")
    conn.commit()
    select = "SELECT id, kind, severity, area, length, drawn_at, state, remark FROM tunnel_api.finding WHERE counted = %s"
    path = tmp_path / "f.xlsx"
    told = json.loads(run("findings", NAME, "-o", path, "--json").stdout)
    names = ("No.", "Code of kind", "Severity", "Area, m²", "Length, m", "Drawn, UTC", "State", "Remark")
    for name, counted in (("Findings", True), ("Left out", False)):
        rows = {row["No."]: row for row in sheet(path, name) if row["No."]}
        for key, *values in conn.execute(select, [counted]).fetchall():
            moment = values[4] and values[4].astimezone(dt.UTC).replace(tzinfo=None, microsecond=0)
            expected = [key, *values[:4], moment, *values[5:]]
            row = rows.pop(key)
            assert [row[n] for n in names] == [pytest.approx(v) if isinstance(v, float) else v for v in expected]
        assert rows == {}
    cells = [cell for page in openpyxl.load_workbook(path) for row in page.iter_rows() for cell in row]
    assert {cell.data_type for cell in cells} <= {"s", "n", "b", "d"}, "no formula"
    assert formula in [cell.value for cell in cells]
    rows = sheet(path, "Counts")
    counts = {row["Code of kind"]: row for row in rows if row["Code of kind"]}
    totals = [row["Counted"] for row in rows if not row["Code of kind"]]
    stated = conn.execute(
        "SELECT kind, sum(counted), sum(open), sum(rejected), sum(gone), sum(area), sum(length) FROM tunnel_api.finding_count"
        " GROUP BY kind"
    ).fetchall()
    names = ("Counted", "Open", "Not counted: rejected", "Not counted: gone", "Area, m²", "Length, m")
    assert {kind: [row[n] for n in names] for kind, row in counts.items()} == {
        kind: [*map(int, values[:4]), *map(pytest.approx, values[4:])] for kind, *values in stated
    }
    assert {row["kind"]: (row["counted"], row["area"]) for row in told["kinds"]} == {
        row[0]: (row[1], pytest.approx(row[5])) for row in stated
    }
    assert sum(totals) == len([row for row in sheet(path, "Findings") if row["No."]])
    assert [row["Their numbers"] for row in sheet(path, "Dry regions")] == [None]
    run("leaks", NAME, "-o", tmp_path / "l.xlsx")
    leaks = json.loads(run("leaks", NAME, "--json").stdout)
    *_, total = sheet(tmp_path / "l.xlsx", "Counts")
    assert (total["Counted"], total["Area in the stretch, m²"]) == (leaks["count"], pytest.approx(leaks["area"]))
    assert [row["No."] for row in sheet(tmp_path / "l.xlsx", "Leaks") if row["No."]] == [leak["id"] for leak in leaks["leaks"]]


def test_a_file_that_ends_otherwise_is_refused(conn: psycopg.Connection, tmp_path: Path) -> None:
    for arguments in (("findings", NAME, "-o", tmp_path / "f.txt"), ("findings", NAME, "--format", "xlsx")):
        done = run(*arguments)
        assert (done.exit_code, done.stderr.count("\n"), list(tmp_path.iterdir())) == (2, 1, [])
        assert ".xlsx" in done.stderr


def test_of_what_an_end_of_the_stretch_cuts_its_part_is_summed(conn: psycopg.Connection) -> None:
    conn.execute(DRAWN)
    conn.commit()
    told = json.loads(run("findings", NAME, "--from", "12+351", "--to", "12+400", "--kind", "crack", "--json").stdout)
    ((whole, share),) = [(row["length"], row["share"]) for row in told["findings"]]
    assert share == pytest.approx(2 / 3)
    assert told["kinds"][0]["length"] == pytest.approx(whole * 2 / 3)


def test_a_csv_of_another_system_is_imported_whole(conn: psycopg.Connection, tmp_path: Path) -> None:
    x, y, z = conn.execute("SELECT ST_X(p), ST_Y(p), ST_Z(p) FROM tunnel_api.roll(1, 12360, 1.5) p").fetchone()
    conn.rollback()
    text = (
        "Art;Station;Offset;x;y;z;wkt;chainage_from;chainage_to;arc_from;arc_to;severity;remark;photo\n"
        f";;;;;;;;;;;;;\nBolzen;12360,0;-2,0;;;;;;;;;2;fehlt;bilder/1.jpg\nBolzen;;;{x};{y};{z};;;;;;;;\n"
        "Riss;;;;;;LINESTRING(12350 0, 12352 1);;;;;4;;\nleak;;;;;;;12350;12351;1;2;;;\n"
    )
    done = import_csv(tmp_path, text, "--map", "Bolzen=missing_bolt", "--map", "Riss=crack", "--column", "kind=Art",
                      "--column", "chainage=Station", "--column", "arc=Offset")  # fmt: skip
    assert done.exit_code == 0, done.output
    assert done.stdout == f"{NAME}: 4 findings imported: 1 crack, 1 leak, 2 missing_bolt\n"
    rows = conn.execute(
        "SELECT kind, severity, remark, photos, (chainage_from + chainage_to) / 2, (arc_from + arc_to) / 2, origin "
        "FROM tunnel_api.finding WHERE manual ORDER BY id"
    ).fetchall()
    assert rows == [
        ("missing_bolt", 2, "fehlt", 1, pytest.approx(12360), pytest.approx(-2), "drawn"),
        ("missing_bolt", None, None, 0, pytest.approx(12360, abs=1e-3), pytest.approx(1.5, abs=1e-3), "drawn"),
        ("crack", 4, None, 0, pytest.approx(12351, abs=0.01), pytest.approx(0.5, abs=0.01), "drawn"),
        ("leak", None, None, 0, pytest.approx(12350.5), pytest.approx(1.5), "drawn"),
    ]


def test_each_bad_row_is_one_line_and_nothing_is_half_written(conn: psycopg.Connection, tmp_path: Path) -> None:
    text = (
        "kind,chainage,arc,severity\nmissing_bolt,12360,0,1\nghost,12360,0,1\nmissing_bolt,99999,0,1\nmissing_bolt,here,0,1\n"
        "missing_bolt,12361,0,7\nmissing_bolt,12361,0,big\nleak,12361,0,\n"
    )
    done = import_csv(tmp_path, text)
    assert done.exit_code == 2
    lines = done.stderr.splitlines()
    assert [line.split("row ")[1].split(":")[0] for line in lines[:-1]] == ["3", "4", "5", "6", "7", "8"]
    assert lines[-1].endswith("6 wrong rows, so nothing was imported")
    for line, said in zip(
        lines, ("not ghost", "beyond the lining", "chainage is 'here'", "1 to 4", "'big'", "not as point"), strict=False
    ):
        assert said in line
    assert conn.execute("SELECT count(*) FROM tunnel_api.finding WHERE manual").fetchone() == (0,)


def test_stations_are_read_and_what_is_no_place_is_told(conn: psycopg.Connection, tmp_path: Path) -> None:
    assert import_csv(tmp_path, "kind,chainage,arc\nmissing_bolt,12+308.5,1\n").exit_code == 0
    (place,) = conn.execute("SELECT (chainage_from + chainage_to) / 2 FROM tunnel_api.finding WHERE manual").fetchone()
    conn.rollback()
    assert place == pytest.approx(12308.5)
    text = (
        "kind,wkt,chainage,arc\ncrack,LINESTRING(1 2,,,\nmissing_bolt,,12308.5,\nmissing_bolt,,99+000,1\n"
        "missing_bolt,,12+3,1\nmissing_bolt,,,\nmissing_bolt,,12308.5,up\n"
    ).replace("LINESTRING(1 2,", '"LINESTRING(1 2,"')
    done = import_csv(tmp_path, text)
    assert (done.exit_code, done.stderr.count("\n")) == (2, 7)
    for line, said in zip(
        done.stderr.splitlines(),
        ("wkt is 'LINESTRING(1 2,', which is not WKT", "arc is empty", "chainage is 99+000: tunnel demo has no such station",
         "chainage is '12+3'", "all columns of it are empty", "arc is 'up', not a number"),
        strict=False,
    ):  # fmt: skip
        assert said in line


@pytest.mark.parametrize("ending", ["gpkg", "csv"])
@pytest.mark.parametrize("geometry", ["unrolled", "3d"])
def test_what_was_exported_is_imported_as_it_was(conn: psycopg.Connection, tmp_path: Path, geometry: str, ending: str) -> None:
    conn.execute(DRAWN)
    conn.commit()
    path = tmp_path / f"drawn.{ending}"
    assert run("findings", NAME, "--origin", "drawn", "--geometry", geometry, "-o", path).exit_code == 0
    query = (
        "SELECT kind, severity, width_mm, round(area::numeric, 3), round(length::numeric, 3) FROM tunnel_api.finding"
        " WHERE manual ORDER BY 1, 4, 5"
    )
    drawn = conn.execute(query).fetchall()
    assert len(drawn) == 3
    conn.execute("DELETE FROM tunnel_api.finding_unrolled WHERE manual")
    conn.commit()
    done = run("findings", "import", NAME, path)
    assert done.exit_code == 0, done.output
    assert conn.execute(query).fetchall() == drawn


@pytest.mark.parametrize(
    ("text", "options", "said"),
    [
        ("art,chainage,arc\n", (), "has no column kind"),
        ("kind,a,b\nleak,1,2\n", (), "has no place of the findings"),
        ("kind,chainage,arc\n", ("--column", "arc=Offset"), "has no column Offset"),
        ("kind,chainage,arc\ncrack,12350,0\n\ncrack,12351\n", (), "line 4: 2 values, but the header has 3 columns"),
        ("kind,chainage,arc\n", ("--map", "Riss"), "two names with = between"),
    ],
)
def test_a_file_that_cannot_be_read_is_one_line(
    conn: psycopg.Connection, tmp_path: Path, text: str, options: tuple[str, ...], said: str
) -> None:
    done = import_csv(tmp_path, text, *options)
    assert done.exit_code == 2
    assert said in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_layer_in_another_system_is_refused(conn: psycopg.Connection, tmp_path: Path) -> None:
    path = tmp_path / "far.gpkg"
    pyogrio.raw.write(
        str(path), shapely.to_wkb(np.array([shapely.Point(1, 2, 3)], object)), [np.array(["spall"], object)],
        np.array(["kind"]),
        geometry_type="Point Z", crs="EPSG:32633", driver="GPKG", layer="far",
    )  # fmt: skip
    done = run("findings", "import", NAME, path)
    assert done.exit_code == 2
    assert f"3D in EPSG:{SRID}" in done.stderr


def test_a_workbook_is_refused_and_of_several_layers_one_is_asked_for(conn: psycopg.Connection, tmp_path: Path) -> None:
    (tmp_path / "f.xlsx").write_bytes(b"PK")
    path = tmp_path / "two.gpkg"
    for name in ("cracks", "spalls"):
        pyogrio.raw.write(
            str(path), shapely.to_wkb(np.array([shapely.Point(12350, 1)], object)), [np.array(["missing_bolt"], object)],
            np.array(["kind"]), geometry_type="Point", crs=None, driver="GPKG", layer=name,
        )  # fmt: skip
    for file, said in ((tmp_path / "f.xlsx", ".csv, .txt, .gpkg, .geojson, .json"), (path, "--layer: cracks, spalls")):
        done = run("findings", "import", NAME, file)
        assert (done.exit_code, done.stderr.count("\n")) == (2, 1)
        assert said in done.stderr
    assert run("findings", "import", NAME, path, "--layer", "spalls").exit_code == 0


def test_what_was_drawn_is_in_the_list_of_leaks_and_in_the_report_without_figures_that_nobody_measured(
    conn: psycopg.Connection, tmp_path: Path
) -> None:
    conn.execute(DRAWN)
    conn.commit()
    key = conn.execute("SELECT max(id) FROM tunnel_api.leak WHERE origin = 'drawn'").fetchone()[0]
    conn.rollback()
    for name in ("leaks.gpkg", "leaks.geojson", "leaks.csv", "leaks.txt"):
        assert run("leaks", NAME, "-o", tmp_path / name).exit_code in (0, 1)
    printed = run("leaks", NAME, "--format", "table").stdout
    assert (tmp_path / "leaks.txt").read_text() == printed
    assert printed.count("\n") > 5
    for name in ("leaks.shp", "leaks"):
        refused = run("leaks", NAME, "-o", tmp_path / name)
        assert (refused.exit_code, refused.stderr.count("\n")) == (2, 1)
        assert "leaks are written as .csv, .geojson, .gpkg, .xlsx or .txt" in refused.stderr
    (drawn,) = [f for f in json.loads((tmp_path / "leaks.geojson").read_text())["features"] if f["id"] == key]
    assert (drawn["properties"]["drop_mean"], drawn["properties"]["counted"]) == (None, True)
    done = run("report", NAME, "-o", tmp_path / "report.html")
    assert done.exit_code in (0, 1), done.output
    written = run("export", NAME, "-o", tmp_path / "all.gpkg")
    assert written.exit_code in (0, 1)
    assert "finding_line_map 1" in written.stderr, "the crack"


def test_the_last_change_is_taken_back_or_why_not_is_one_line(conn: psycopg.Connection, tmp_path: Path) -> None:
    assert import_csv(tmp_path, "kind,chainage,arc\nmissing_bolt,12350,1\n").exit_code == 0
    (key,) = conn.execute("SELECT max(id) FROM tunnel_api.finding").fetchone()  # type: ignore[misc]
    conn.rollback()
    assert run("findings", "undo", key).output == f"finding {key}: change undone: drawn\n"
    assert conn.execute("SELECT count(*) FROM tunnel_api.finding WHERE id = %s", [key]).fetchone() == (0,)
    refused = run("findings", "undo", key)
    assert (refused.exit_code, refused.stderr.count("\n")) == (2, 1)
    assert f"there is no change of a finding {key} to be taken back" in refused.stderr
    beyond = run("findings", "undo", 2**63)  # more than an id of the database can be
    assert beyond.exit_code == 2
    assert "is not in the range" in beyond.stderr


def test_a_width_without_a_unit_is_refused_and_the_advice_helps(conn: psycopg.Connection, tmp_path: Path) -> None:
    text = 'kind,width,wkt\ncrack,"0,3","LINESTRING(12350 1, 12353 1)"\n'
    refused = import_csv(tmp_path, text)
    assert refused.exit_code == 2
    advice = refused.stderr.strip().rpartition("add ")[2].split()
    assert advice == ["--column", "width_mm=width"]
    done = import_csv(tmp_path, text, *advice)
    assert done.stdout == f"{NAME}: 1 finding imported: 1 crack\n"
    ((width, area, length),) = conn.execute("SELECT width_mm, area, length FROM tunnel_api.finding WHERE manual").fetchall()
    assert (width, area) == (0.3, pytest.approx(0.0003 * length))
    metres = import_csv(tmp_path, text.replace('"0,3"', "0.0003").replace("width", "width_mm"))
    assert (metres.exit_code, "a crack is 0.01 to 100 mm wide, not 0.0003 mm" in metres.stderr) == (2, True)


def test_rows_on_gaps_of_a_list_are_no_findings(conn: psycopg.Connection, tmp_path: Path) -> None:
    text = 'id,kind,remark,geometry\n,not searched,detect has not run,\n,remark,x,\n7,crack,y,"LINESTRING(12350 1, 12353 1)"\n'
    assert import_csv(tmp_path, text).stdout == f"{NAME}: 1 finding imported: 1 crack\n"
