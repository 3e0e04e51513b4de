"""Findings of all kinds in all outputs: number, kind, severity, remark, width, area and coordinates; and what was not searched.

The truth is that of rectangles, a line and a point on a circular tunnel, by hand.
"""

from __future__ import annotations

import csv
import io
import json
import math
import re
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from html import unescape
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import ezdxf
import openpyxl
import psycopg
import pyogrio
import pyogrio.raw
import pytest
from click.testing import CliRunner, Result
from psycopg import sql
from psycopg.conninfo import make_conninfo
from support.straight_survey import RADIUS, Scene, Wet, make_survey

from tunneldb.cli.main import main
from tunneldb.database import connect
from tunneldb.finding_kind import REVIEW_COLOURS
from tunneldb.store.coverage import GAP_STATES

NAME, NEVER = "outputs", "never"


@dataclass(frozen=True)
class Truth:
    """A finding: extent in the unrolled plane (m), and what is known of it."""

    kind: str
    west: float
    east: float
    south: float
    north: float
    review: str = "confirmed"
    severity: int | None = None
    remark: str | None = None
    width_mm: float | None = None
    area: float = 0.0
    drawn: str = ""

    @property
    def centre(self) -> tuple[float, float, float]:
        """Middle of its extent in space, m: the axis runs north, 100 m above zero; right is east."""
        ends = self.south / RADIUS, self.north / RADIUS
        across = [RADIUS * math.sin(angle) for angle in ends]
        up = [RADIUS * math.cos(angle) for angle in ends]
        return 5e5 + sum(across) / 2, 4.64e6 + (self.west + self.east) / 2, 100 + sum(up) / 2


TRUTH = (
    Truth("leak", 950, 951, 0, 0.5, "open", area=0.5),
    Truth("leak", 955, 956, 1, 2, "confirmed", 2, "Übergang – naß; 'quoted'", area=1),
    Truth("leak", 958, 959, 1, 2, "rejected", area=1),
    Truth("joint", 980, 981, 2, 3, "open", area=1),
    Truth("crack", 962, 965, 1, 1, "confirmed", 3, '=HYPERLINK("x")', 0.3, 3 * 0.0003, "LINESTRING(962 1, 965 1)"),
    Truth("spall", 970, 971, 0, 1, "confirmed", 4, "first line\nsecond <line>", area=1, drawn="box"),
    Truth("missing_bolt", 968, 968, -2, -2, "confirmed", drawn="POINT(968 -2)"),
    Truth("leak", 975, 976, 2, 3, "confirmed", 1, "@SUM(1)", area=1, drawn="box"),
)  # fmt: skip
WET = [truth for truth in TRUTH if truth.kind == "leak"]
DRAWN_LATE = [truth for truth in TRUTH if truth.review != "rejected"]
Facts = dict[int, dict[str, Any]]


@pytest.fixture(scope="module")
def outputs(server_dsn: str, template: str) -> Iterator[str]:
    """Database with the survey, of which a kilometre was not searched, and with one that was never searched; only read."""
    with psycopg.connect(server_dsn, autocommit=True) as admin:
        admin.execute(sql.SQL("CREATE DATABASE outputs TEMPLATE {}").format(sql.Identifier(template)))
        dsn = make_conninfo(server_dsn, dbname="outputs")
        with connect(dsn) as conn:
            make_survey(conn, Scene(NEVER, done={0: "ground", 1: "ground"}))
            found = [Wet(t.west, t.east, t.south, t.north, t.review, kind=t.kind) for t in TRUTH if not t.drawn]
            make_survey(conn, Scene(NAME, leaks=found, done={0: "detect", 1: "ground"}))
            for truth in TRUTH:
                _complete(conn, truth)
            conn.commit()
        yield dsn
        admin.execute("DROP DATABASE outputs WITH (FORCE)")


def _complete(conn: psycopg.Connection, truth: Truth) -> None:
    """Draw a finding, or write severity and remark of a detected one."""
    if truth.drawn:
        box = f"ST_MakeEnvelope({truth.west}, {truth.south}, {truth.east}, {truth.north}, 0)"
        conn.execute(
            "INSERT INTO tunnel_api.finding_unrolled (survey, kind, severity, width_mm, review, remark, geom)"
            f" VALUES (%s, %s, %s, %s, %s, %s, {box if truth.drawn == 'box' else repr(truth.drawn)})".encode(),
            [NAME, truth.kind, truth.severity, truth.width_mm, truth.review, truth.remark],
        )
    elif truth.severity:
        conn.execute(
            "UPDATE tunnel_api.finding_unrolled SET severity = %s, remark = %s WHERE chainage_from = %s",
            [truth.severity, truth.remark, truth.west],
        )


def run(dsn: str, *arguments: object, code: int = 1) -> Result:
    result = CliRunner().invoke(main, ["--dsn", dsn, *map(str, arguments)], catch_exceptions=False)
    assert result.exit_code == code, result.output
    return result


def flat(text: Any) -> str:
    return " ".join(str(text or "").split())


def agree(rows: Any, truths: Any, names: dict[str, str] | None = None, *, decimals: float = 0.003) -> None:
    """Compare rows of an output, by its names of columns, with the truth; columns that it does not have are left out."""
    names = names or {}
    told = {round((float(row["chainage_from"]) + float(row["chainage_to"])) / 2, 1): row for row in rows}
    assert len(told) == len(list(rows)) == len(truths)
    for truth in truths:
        row = told[round((truth.west + truth.east) / 2, 1)]
        assert row["kind"] == truth.kind
        assert int(row["severity"] or 0) == (truth.severity or 0)
        assert flat(row["remark"]).removeprefix("'") == flat(truth.remark), "CSV guards formulas by an apostrophe"
        assert [float(row[name]) for name in ("easting", "northing", "height")] == pytest.approx(truth.centre, abs=decimals)
        assert float(row[names.get("area", "area")]) == pytest.approx(truth.area, abs=0.006)
        if "width_mm" in row:
            assert (float(row["width_mm"]) if row["width_mm"] else None) == truth.width_mm
        if "counted" in row:
            assert str(row["counted"]).lower() in (("false", "no") if truth.review == "rejected" else ("true", "yes", "1"))


def notes(rows: list[dict[str, Any]], text: str) -> list[tuple[str, str]]:
    return [(row["kind"], row[text]) for row in rows if not row["id"]]


NOT_SEARCHED = "Not searched for leaks: 1+000–1+060 not searched (detect has not run)"
GAP = [("not searched", "detect has not run")]


def test_sql(outputs: str) -> None:
    with connect(outputs) as conn:
        cursor = conn.cursor(row_factory=psycopg.rows.dict_row)
        for view, truths in (("finding", TRUTH), ("leak", WET)):
            query = f"SELECT * FROM tunnel_api.{view} WHERE survey = %s"
            agree(cursor.execute(query.encode(), [NAME]).fetchall(), truths)
        rows = conn.execute(
            "SELECT km, leaks, leaks_open, leaks_confirmed, leaks_rejected, wet_area FROM tunnel_api.km_statistics"
            " WHERE survey = %s ORDER BY km",
            [NAME],
        ).fetchall()
        assert rows == [(0, 3, 1, 2, 1, pytest.approx(2.5, abs=1e-4)), (1, None, None, None, None, None)]
        ((area,),) = conn.execute("SELECT tunnel_api.wet_area(%s, '-infinity', 'infinity')", [NEVER]).fetchall()
        assert area is None
        ((good, share),) = conn.execute(
            "SELECT cs1, seen_share FROM tunnel_api.snti_condition WHERE survey = %s AND element = 'liner'", [NEVER]
        ).fetchall()
        assert (good, share) == (0, None), "what was not inspected is not in good condition"


def read_sheet(path: Path, name: str) -> list[dict[str, Any]]:
    head, *rows = openpyxl.load_workbook(path)[name].iter_rows(values_only=True)
    names = {
        "No.": "id", "Kind": "kind", "Chainage from, m": "chainage_from", "Chainage to, m": "chainage_to",
        "Severity": "severity", "Remark": "remark", "Easting, m": "easting", "Northing, m": "northing", "Height, m": "height",
        "Area, m²": "area", "Width, mm": "width_mm", "Counted": "counted", "Reasons": "reasons",
    }  # fmt: skip
    return [dict(zip([names.get(n, n) for n in head], row, strict=True)) for row in rows]


def read_layer(path: Path, name: str) -> list[dict[str, Any]]:
    meta, _, _, values = pyogrio.raw.read(path, layer=name)
    rows = [dict(zip(meta["fields"], row, strict=True)) for row in zip(*values, strict=True)]
    return [{key: None if value != value else value for key, value in row.items()} for row in rows]


@pytest.mark.parametrize(("command", "truths", "text"), [("findings", TRUTH, "remark"), ("leaks", WET, "reasons")])
def test_lists(outputs: str, tmp_path: Path, command: str, truths: tuple[Truth, ...], text: str) -> None:
    """As table, JSON, CSV, GeoJSON, GeoPackage and workbook."""
    asked = (command, NAME, *(["--state", "all"] if command == "findings" else []))
    table = run(outputs, *asked).stdout.splitlines()
    assert table[0] == NOT_SEARCHED
    told = json.loads(run(outputs, *asked, "--json").stdout)
    agree(told[command], truths)
    assert (told["statement"], told["ok"]) == (NOT_SEARCHED, False)
    rows = list(csv.DictReader(io.StringIO(run(outputs, *asked, "--format", "csv").stdout)))
    agree([row for row in rows if row["id"]], truths)
    assert notes(rows, text) == GAP
    found = json.loads(run(outputs, *asked, "--format", "geojson").stdout)
    agree([feature["properties"] for feature in found["features"]], truths)
    assert (found["statement"], len(found["gaps"])) == (NOT_SEARCHED, 1)
    run(outputs, *asked, "-o", tmp_path / "x.gpkg")
    agree(read_layer(tmp_path / "x.gpkg", f"{command.removesuffix('s')}_unrolled"), truths)
    assert [(gap["state"], gap["reason"]) for gap in read_layer(tmp_path / "x.gpkg", "coverage_gap")] == GAP
    assert (
        NOT_SEARCHED
        in pyogrio.read_info(tmp_path / "x.gpkg", layer=f"{command[:-1]}_unrolled")["layer_metadata"]["DESCRIPTION"]
    )
    run(outputs, *asked, "-o", tmp_path / "x.xlsx")
    rows = read_sheet(tmp_path / "x.xlsx", command.capitalize())
    for row in rows:
        row["kind"] = row.get("Code of kind") or row["kind"]
    agree([row for row in rows if row["id"]], truths)
    assert notes(rows, text) == GAP
    assert [(row["State"], row["Why"]) for row in read_sheet(tmp_path / "x.xlsx", "Could be missed")] == GAP


@pytest.mark.parametrize("command", ["findings", "leaks"])
def test_lists_of_what_was_never_searched_are_no_all_clear(outputs: str, tmp_path: Path, command: str) -> None:
    for form in ("table", "csv", "geojson"):
        text = run(outputs, command, NEVER, "--format", form).stdout
        assert "detect has not run" in text
        assert not re.search(rf"\b0 {command}", text)
    for options in (["--count"],) if command == "findings" else (["--by-km"],):
        assert "detect has not run" in run(outputs, command, NEVER, *options).stdout
    run(outputs, command, NEVER, "-o", tmp_path / "x.xlsx")
    assert [row["kind"] for row in read_sheet(tmp_path / "x.xlsx", command.capitalize())] == ["not searched"]
    assert 0 not in [value for row in read_sheet(tmp_path / "x.xlsx", "Counts") for value in row.values()]
    run(outputs, "findings", NEVER, "--kind", "crack", code=0)  # nobody searches for these but people


def test_only_drawn_kinds_need_no_search(outputs: str) -> None:
    told = json.loads(run(outputs, "findings", NAME, "--kind", "crack", "--json", code=0).stdout)
    assert (told["listed"], told["statement"]) == (1, NOT_SEARCHED)


def test_geopackage(outputs: str, tmp_path: Path) -> None:
    """Each finding is in one layer."""
    path = tmp_path / "s.gpkg"
    run(outputs, "export", NAME, "-o", path, code=0)
    names = [name for name, _ in pyogrio.list_layers(path)]
    for place in ("unrolled", "map", "3d"):
        layers = [name for name in names if re.fullmatch(rf"(leak|dark|finding_\w+)_{place}", name)]
        assert len(layers) == (4 if place == "3d" else 5)
        truths = [truth for truth in TRUTH if truth.kind != "joint" or place != "3d"]
        agree([row for name in layers for row in read_layer(path, name)], truths)
    assert [(gap["state"], gap["reason"]) for gap in read_layer(path, "coverage_gap")] == GAP
    for name in ("leak_unrolled", "finding_line_unrolled"):
        assert NOT_SEARCHED in pyogrio.read_info(path, layer=name)["layer_metadata"]["DESCRIPTION"]


def test_drawing(outputs: str, tmp_path: Path) -> None:
    """Each finding that is not rejected is drawn thrice; leaks in the colours of their review."""
    run(outputs, "export", NAME, "-o", tmp_path / "s.dxf", code=0)
    drawing = ezdxf.readfile(tmp_path / "s.dxf")
    colours = {"open": REVIEW_COLOURS["open"], "confirmed": REVIEW_COLOURS["confirmed"]}
    for place in ("UNROLLED", "MAP", "3D"):
        rows = []
        for entity in drawing.modelspace():
            if entity.has_xdata("TUNNELDB") and entity.dxf.layer.endswith(place):
                row: dict[str, Any] = dict.fromkeys(("severity", "remark", "width_mm"))
                row |= dict(value.split("=", 1) for _, value in entity.get_xdata("TUNNELDB"))
                assert entity.dxf.layer == f"{row['kind'].upper()}_{place}"
                if row["kind"] == "leak":
                    assert f"#{entity.dxf.true_color:06x}" == colours[row["review"]]
                rows.append(row)
        agree(rows, DRAWN_LATE, {"area": "area_m2"})
    texts = [text.dxf.text.split(": ")[1] for text in drawing.modelspace().query('TEXT[layer=="FINDING_TEXT"]')]
    assert sorted(texts) == ["Crack 3.00 m, 0.30 mm", "Missing bolt", "Spall 1.00 m²"]
    assert dict(drawing.header.custom_vars.properties)["Coverage"] == NOT_SEARCHED


def test_report(outputs: str, tmp_path: Path) -> None:
    """The table of leaks, the rows of other findings, and the sums, which add dry lining to no leaks."""
    path = tmp_path / "r.html"
    told = json.loads(run(outputs, "report", NAME, "-o", path, "--json", code=0).stdout)
    assert (told["leaks"], told["statement"]) == (3, NOT_SEARCHED)
    text = path.read_text("utf-8")
    (data,) = re.findall(r'<script type="application/json" id="\w*">(\{"columns".*?)</script>', text) or re.findall(
        r"<script[^>]*>(\{&#34;columns|\{\"columns\".*?)</script>", text
    )
    table = json.loads(data)
    leaks = [dict(zip(table["columns"], row, strict=True)) for row in table["rows"]]
    for leak in leaks:
        leak |= {"kind": "leak", "chainage_from": leak["chainage"], "chainage_to": leak["chainage"]}
    agree(leaks, WET)
    sums = re.search(r"By state.*?</table>", text, re.DOTALL)
    assert sums is not None
    rows = [
        [unescape(re.sub("<[^>]*>", "", cell)) for cell in re.findall(r"<td.*?</td>", row, re.DOTALL)]
        for row in re.findall(r'<tr class="sum">.*?</tr>', sums[0], re.DOTALL)
    ]
    assert [row[:6] for row in rows] == [
        ["All leaks", "2", "1", "3", "2.500", "–"], ["All other findings", "3", "0", "3", "1.001", "3.00"],
        ["All joints and dry dark areas", "0", "1", "1", "1.000", "–"],
    ]  # fmt: skip
    for truth in TRUTH:
        if truth.kind in ("crack", "spall", "missing_bolt"):
            (row,) = re.findall(rf'<section id="kind-{truth.kind}".*?<tr id="finding-\d+".*?>(.*?)</tr>', text, re.DOTALL)
            cells = [unescape(re.sub("<[^>]*>", " ", cell)) for cell in re.findall(r"<td.*?</td>", row, re.DOTALL)]
            assert [float(value) for value in cells[3].split()] == pytest.approx(truth.centre, abs=0.006)
            assert cells[6].strip() == ("–" if truth.width_mm is None else f"{truth.width_mm:.2f}")
            assert flat(cells[10]) == flat(truth.remark)


def test_layers_of_qgis(outputs: str, tmp_path: Path) -> None:
    """The rows that the sources of layers select, by group of the layer tree."""
    run(outputs, "qgis", NAME, "-o", tmp_path / "p.qgz", "--images", tmp_path, code=0)
    with zipfile.ZipFile(tmp_path / "p.qgz") as archive:
        project = ElementTree.fromstring(archive.read("p.qgs"))
    sources = {layer.findtext("id"): layer.findtext("datasource") or "" for layer in project.iter("maplayer")}

    def rows(name: str) -> list[dict[str, Any]]:
        table, where = re.findall(r'table="tunnel_api"\."(\w+)".* sql=(.*)$', sources[f"tunneldb_layer_{name}"])[0]
        with connect(outputs) as conn:
            cursor = conn.cursor(row_factory=psycopg.rows.dict_row)
            return cursor.execute(f"SELECT * FROM tunnel_api.{table} WHERE {where}".encode()).fetchall()

    for place in ("unrolled", "map"):
        agree(rows(f"leak_{place}"), WET)
        agree([row for shape in ("point", "line", "area") for row in rows(f"finding_{shape}_{place}")], TRUTH)
    assert [(row["state"], row["reason"]) for row in rows("coverage_gap")] == GAP


def test_states_of_gaps_are_those_of_the_function(conn: psycopg.Connection) -> None:
    ((text,),) = conn.execute("SELECT obj_description('tunnel_api.coverage_gaps(int,float8,float8)'::regprocedure)").fetchall()
    assert all(state in text for state in GAP_STATES)
