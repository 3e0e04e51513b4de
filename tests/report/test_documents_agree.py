"""What is said of the same leaks by the table, JSON, CSV, GeoJSON, GeoPackage, DXF, report, PDF, sheets, QGIS and by kilometre.

The truth is that of the rectangles which the surveys are made of, cut by hand.
"""

from __future__ import annotations

import csv
import html
import json
import re
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import ezdxf
import numpy as np
import openpyxl
import psycopg
import pyogrio
import pyogrio.raw
import pypdf
import pytest
import shapely
from click.testing import CliRunner, Result
from psycopg import sql
from psycopg.conninfo import make_conninfo
from support.straight_survey import FIRST, LAST, Scene, Wet, make_survey

from tunneldb.cli.main import main
from tunneldb.database import connect


@dataclass(frozen=True)
class Case:
    """A survey, and what is to be said of it.

    Between which chainages, how much was searched, where leaks could be missed, whether all was searched, what else is to be
    known.
    """

    scene: Scene
    low: float
    high: float
    searched: float
    said: tuple[str, ...]
    complete: bool
    known: tuple[str, ...] = ()

    @property
    def counted(self) -> list[Wet]:
        return [leak for leak in self.scene.leaks if leak.counts and leak.east > self.low and leak.west < self.high]

    @property
    def area(self) -> float:
        return sum(leak.between(self.low, self.high) for leak in self.counted)

    def searched_between(self, low: float, high: float) -> bool:
        """Whether anything of a stretch was searched."""
        return bool(self.searched) and (self.searched == 1 or low < 1000)

    @property
    def seen(self) -> float:
        dark = max(min(self.scene.dark[1], self.high) - max(self.scene.dark[0], self.low), 0) / (self.high - self.low)
        return self.scene.seen * (self.searched - dark)


INSIDE = [
    Wet(950, 951, 0, 0.5), Wet(962, 962.5, -3, -2, "confirmed"), Wet(970, 971, 1, 2, "rejected"),
    Wet(975, 976, 4, 5, "confirmed", False), Wet(978, 979, 2, 3, kind="joint"), Wet(984, 986, -1, 1, confidence=0.6),
]  # fmt: skip
CROWD = [Wet(1010 + 0.04 * n, 1010.03 + 0.04 * n, -6 + n, -5.5 + n) for n in range(12)]
"""Leaks so near one another that their numbers do not fit side by side."""

WHOLE = Case(
    Scene("whole", leaks=[*INSIDE, *CROWD], dark=(1030.0, 1040.0), notes=dict.fromkeys((0, 1), "2 of 7 are bent"), unposed=7),
    FIRST, LAST, 1.0, ("Searched, but unseen 1+030–1+040 (0 % of the lining inspected)",), True,
    ("a.laz: 7 points (0.70 %) left out: the scanner's position is not known", "km 0–1, axis: 2 of 7 are bent"),
)  # fmt: skip
BY_AXIS = Case(
    Scene(
        "by_axis", (945.0, 1055.0),
        [
            *INSIDE, Wet(944, 946, 0, 1), Wet(1054, 1057, 0, 1), Wet(941, 944, 2, 3), Wet(1056, 1058, 2, 3),
            Wet(1049, 1050, 0, 1),
        ],
        notes={0: "<wide> & \"long\", 9 %"},
    ), 945.0, 1055.0, 1.0, (), True, ("km 0, axis: <wide> & \"long\", 9 %",),
)  # fmt: skip
FAILED = Case(
    Scene(
        "failed", leaks=INSIDE, done={0: "detect", 1: "load"}, failed={1: ("axis", "no points near vertex 101")},
        notes={0: "one is bent"},
    ),
    FIRST, LAST, 0.5, ("Not searched for leaks: 1+000–1+060 failed (axis: no points near vertex 101)",), False,
    ("km 0, axis: one is bent",),
)  # fmt: skip
NEVER = Case(
    Scene("never", done={0: "ground", 1: "ground"}), FIRST, LAST, 0.0,
    ("Not searched for leaks: 0+940–1+060 not searched (detect has not run)",), False,
)  # fmt: skip
OVER_END = Case(
    Scene("over_end", leaks=[*INSIDE, Wet(998, 1003, 0, 1), Wet(999.5, 1000.5, 3, 4), Wet(1000, 1001, 5, 6)], seen=0.5),
    FIRST, LAST, 1.0, (), True,
)  # fmt: skip
CASES = {case.scene.name: case for case in (WHOLE, BY_AXIS, FAILED, NEVER, OVER_END)}


@pytest.fixture(scope="module")
def documents(server_dsn: str, template: str) -> Iterator[str]:
    """Database with all of them, which is only read."""
    name = sql.Identifier("documents")
    with psycopg.connect(server_dsn, autocommit=True) as admin:
        admin.execute(sql.SQL("CREATE DATABASE {} TEMPLATE {}").format(name, sql.Identifier(template)))
        dsn = make_conninfo(server_dsn, dbname="documents")
        with connect(dsn) as conn:
            for case in CASES.values():
                make_survey(conn, case.scene)
            add_elements(conn)
        yield dsn
        admin.execute(sql.SQL("DROP DATABASE {} WITH (FORCE)").format(name))


def add_elements(conn: psycopg.Connection) -> None:
    """Elements of 10 m in each tunnel, and a scheme that rates them by the share of wet lining and the largest leak."""
    conn.execute(
        "WITH d AS (INSERT INTO tunnel.element_set (tunnel_id, name, source) SELECT id, 'tens', 'length' FROM tunnel.tunnel"
        " RETURNING id) INSERT INTO tunnel.element (element_set_id, number, name, chainage_from, chainage_to)"
        " SELECT d.id, n, '<' || n || '>', %s + 10 * n, %s + 10 * n FROM d, generate_series(1, 12) AS n",
        [FIRST - 10, FIRST],
    )
    conn.execute(
        "WITH s AS (INSERT INTO tunnel.rating_scheme (name, version, source, valid_from, results, min_inspected)"
        " VALUES ('agreed', '7', 'of the tests', '2024-01-01', '{good,fair,poor}', 0.85) RETURNING id)"
        " INSERT INTO tunnel.rating_rule (scheme_id, number, text, kinds, measure, inclusive, limits, results)"
        " SELECT s.id, r.* FROM s, (VALUES"
        " (1, 'wet share', '{}'::text[], 'share', false, '{0.001}'::float8[], '{fair}'::text[]),"
        " (2, 'largest', '{leak}', 'largest_area', true, '{1}', '{poor}')) AS r"
    )


@pytest.fixture(params=list(CASES))
def case(request: pytest.FixtureRequest) -> Case:
    return CASES[request.param]


def run(dsn: str, *arguments: object, code: int = 0) -> Result:
    result = CliRunner().invoke(main, ["--dsn", dsn, *map(str, arguments)], catch_exceptions=False)
    assert result.exit_code == code, result.output
    return result


def leaks(dsn: str, case: Case, *arguments: object) -> Result:
    return run(dsn, "leaks", case.scene.name, *arguments, code=0 if case.complete else 1)


def total(case: Case) -> str:
    return f"{len(case.counted)} leaks, {case.area:.2f} m²"


def outlines(case: Case) -> list[tuple[float, ...]]:
    return sorted(leak.outline.bounds for leak in case.counted)


def bounds(shapes: Any) -> list[Any]:
    return [pytest.approx(row) for row in sorted(map(tuple, shapely.bounds(np.array(shapes, dtype=object)).tolist()))]


def test_table(documents: str, case: Case) -> None:
    result = leaks(documents, case)
    lines = result.stdout.splitlines()
    if case.said:
        assert lines[0] == case.said[0], "first of all"
    assert said_on_stderr(result) >= set(case.known)
    text = "\n".join(lines)
    assert (total(case) in text) == bool(case.searched)
    assert "0 leaks" not in text


def said_on_stderr(result: Result) -> set[str]:
    return set(result.stderr.splitlines())


def test_json(documents: str, case: Case) -> None:
    told = json.loads(leaks(documents, case, "--json").stdout)
    assert (told["ok"], told["count"]) == (case.complete, len(case.counted))
    assert told["area"] == pytest.approx(case.area)
    assert told["statement"] == ("; ".join(case.said) or None)
    assert (told["seen_share"], told["searched_share"]) == (pytest.approx(case.seen), pytest.approx(case.searched))
    assert sum(leak["counted"] for leak in told["leaks"]) == told["count"]
    assert bool(told["gaps"]) == bool(case.said)
    assert [remark["said"] for remark in told["remarks"]] == list(case.known)


def test_csv_and_geojson(documents: str, case: Case) -> None:
    result = leaks(documents, case, "--format", "csv")
    rows = list(csv.DictReader(result.stdout.splitlines()))
    counted = [row for row in rows if row["counted"] == "True"]
    assert outlines(case) == bounds([shapely.from_wkt(row["geometry"]) for row in counted])
    besides = [row["reasons"] for row in rows if row["kind"] not in ("leak", "joint")]
    assert besides == [*(gap_reason(said) for said in case.said), *case.known]
    assert [row["reasons"] for row in rows if row["kind"] == "remark"] == list(case.known)
    assert said_on_stderr(result) >= {*case.said, *case.known}
    found = json.loads(leaks(documents, case, "--format", "geojson").stdout)
    assert (found["count"], found["area"]) == (len(case.counted), pytest.approx(case.area, abs=1e-4))
    assert found["statement"] == ("; ".join(case.said) or None)
    assert [remark["said"] for remark in found["remarks"]] == list(case.known)
    shapes = [shapely.geometry.shape(f["geometry"]) for f in found["features"] if f["properties"]["counted"]]
    assert outlines(case) == bounds(shapes)


def gap_reason(said: str) -> str:
    return "less than half of the lining was seen" if "unseen" in said else said[said.rindex("(") + 1 : -1]


def test_geopackages(documents: str, case: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OGR_SQLITE_SYNCHRONOUS", "OFF")  # nothing of value is in them
    leaks(documents, case, "-o", tmp_path / "leaks.gpkg")
    run(documents, "export", case.scene.name, "-o", tmp_path / "survey.gpkg")
    for path in ("leaks.gpkg", "survey.gpkg"):
        _, _, geometry, values = pyogrio.raw.read(tmp_path / path, layer="leak_unrolled", columns=["counted"])
        counted = np.array(values[0], bool)
        assert outlines(case) == bounds(shapely.from_wkb(geometry[counted]))
        layers = {name for name, _ in pyogrio.list_layers(tmp_path / path)}
        if case.said or path == "survey.gpkg":
            gaps = pyogrio.raw.read(tmp_path / path, layer="coverage_gap", columns=["reason"], read_geometry=False)[3][0]
            assert list(gaps) == [gap_reason(said) for said in case.said]
        else:
            assert "coverage_gap" not in layers
        if case.known or path == "survey.gpkg":
            remarks = pyogrio.raw.read(tmp_path / path, layer="remark", columns=["said"], read_geometry=False)[3][0]
            assert list(remarks) == list(case.known)
        else:
            assert "remark" not in layers
    said = pyogrio.read_info(tmp_path / "leaks.gpkg", layer="leak_unrolled")["layer_metadata"]["DESCRIPTION"]
    assert all(text in said for text in (*case.said, *case.known))
    assert (total(case) in said) == bool(case.searched)


def test_drawing(documents: str, case: Case, tmp_path: Path) -> None:
    result = run(documents, "export", case.scene.name, "-o", tmp_path / "survey.dxf")
    assert said_on_stderr(result) >= {*case.said, *case.known}
    drawing = ezdxf.readfile(tmp_path / "survey.dxf")
    facts = [
        [value for _, value in line.get_xdata("TUNNELDB")] for line in drawing.modelspace().query('*[layer=="LEAK_UNROLLED"]')
    ]
    assert sum("counted=yes" in fact for fact in facts) == len(case.counted)
    properties = dict(drawing.header.custom_vars.properties)
    assert properties.get("Coverage", "") == "; ".join(case.said)
    assert [properties[name] for name in sorted(properties) if name.startswith("Remark ")] == list(case.known)
    written = drawing.modelspace().query('TEXT[layer=="REMARK"]')
    lines = [text.dxf.text for text in sorted(written, key=lambda text: -text.dxf.insert.y)]
    said = " ".join(line.strip() for line in lines[1:])
    assert said == " ".join(f"– {text}" for text in (*case.said, *case.known))
    north = max(vertex.dxf.location.y for vertex in drawing.modelspace().query('POINT[layer=="AXIS_VERTEX"]'))
    assert all(text.dxf.insert.y > north for text in written), "above the map"
    inside = [said for said in case.said if "1+000–1+060" not in said]  # what lies beyond the drawing has no place in it
    assert len(drawing.modelspace().query('TEXT[layer=="COVERAGE_GAP"]')) == len(inside)


def test_report(documents: str, case: Case, tmp_path: Path) -> None:
    path = tmp_path / "report.html"
    told = json.loads(run(documents, "report", case.scene.name, "-o", path, "--json").stdout)
    assert (told["leaks"], told["statement"]) == (len(case.counted), "; ".join(case.said) or None)
    text = path.read_text("utf-8")
    for said in case.said:
        assert 0 < text.index(said) < text.index('class="verdict'), "before the verdict"
    assert re.findall(r"<li>(.*)</li>", text.partition("Notes and limitations")[2].partition("</ul>")[0]) == [
        html.escape(said, quote=True).replace("&#x27;", "&#39;").replace("&quot;", "&#34;") for said in case.known
    ]
    figures = dict(re.findall(r"<dt>([^<]+)</dt><dd>([^<]+?) ?<", text))
    assert figures["Leaks"] == (str(len(case.counted)) if case.searched else "–")
    assert figures["Wet area"] == (f"{case.area:.2f}" if case.searched else "–")
    assert figures["Lining inspected"] == (f"{100 * case.seen:.1f} %" if case.searched else "–")
    strips = re.findall(r'<figure class="strip" id="strip-(\d+)">(.*?)</figure>', text, re.DOTALL)
    numbered: set[str] = set()
    for start, strip in strips:
        here = [leak for leak in case.counted if leak.east > int(start) and leak.west < int(start) + 50]
        caption = re.search(r"<figcaption>.*?<span>(.*?)</span>", strip)
        assert caption is not None
        signs = re.findall(r'class="sign">.*?>(\d+)</text>', strip)
        if case.searched_between(int(start), int(start) + 50):
            assert caption[1].startswith(f"{len(here)} leak{'s' * (len(here) != 1)}, ")
            assert len(set(signs)) == len(here), "each leak that the caption counts has its number"
            places = re.findall(r'<text x="([^"]+)" y="([^"]+)">\d+</text>', strip)
            assert len(set(places)) == len(places)
        else:
            assert caption[1] == "leaks were not searched for"
        numbered |= set(signs)
    assert len(numbered) == len(case.counted)


@pytest.mark.parametrize("name", ["by_axis", "never"])
def test_words_of_the_pdf(documents: str, name: str, tmp_path: Path, chromium: Path) -> None:
    case = CASES[name]
    run(documents, "report", name, "-o", tmp_path / "report.pdf")
    words = " ".join(" ".join(page.extract_text() for page in pypdf.PdfReader(tmp_path / "report.pdf").pages).split())
    for said in case.said:
        assert "".join(said.split()) in "".join(words.split())
    for known in case.known:
        assert "".join(known.split()) in "".join(words.split())
    if case.searched:
        assert f" {len(case.counted)} Leaks {case.area:.2f} m² Wet area" in words
    else:
        assert "Leaks were not searched for" in words
        assert "leaks were not searched for" in words
        assert not re.search(r"(?<!\d)0 leaks", words)
        assert "there are no numbers" in words
        assert "0.0 %" not in words


def rating_of(dsn: str, case: Case) -> list[tuple[Any, ...]]:
    """Name, result, whether it is a lower bound, inspected share, value and finding of each element, by SQL."""
    with connect(dsn) as conn:
        return conn.execute(
            "SELECT name, result, result IS NOT NULL AND NOT complete, inspected_share, value, finding_id, chainage_from,"
            " chainage_to FROM tunnel_api.rating(%s, 'tens', 'agreed')", [case.scene.name],
        ).fetchall()  # fmt: skip


def shown_result(row: tuple[Any, ...]) -> str:
    return "not rated" if row[1] is None else f"at least {row[1]}" if row[2] else row[1]


RATED = 'headline = "rating"\n[rating]\nscheme = "agreed"\nelements = "tens"\n'


def test_ratings(documents: str, case: Case, tmp_path: Path) -> None:
    """The same results, values and findings in the report, a workbook, a table and SQL."""
    known = rating_of(documents, case)
    inside = [row for row in known if row[7] > case.low and row[6] < case.high]
    (tmp_path / "owner.toml").write_text(RATED, "utf-8")
    run(documents, "report", case.scene.name, "-o", tmp_path / "r.html", "--template", tmp_path / "owner.toml")
    text = (tmp_path / "r.html").read_text("utf-8")
    chapter = text.partition('<section id="rating">')[2].partition("</section>")[0]
    lines = re.findall(r"<tr><td>(&lt;.*?)</tr>", chapter)
    cells = [[html.unescape(re.sub("<[^>]*>", "", cell)) for cell in line.split("</td>")[:-1]] for line in lines]
    assert [row[0] for row in cells] == [row[0] for row in inside]
    assert [row[2] for row in cells] == [shown_result(row) for row in inside]
    assert [row[8] for row in cells] == ["–" if row[5] is None else str(row[5]) for row in inside]
    counts = dict(re.findall(r'<b class="chip rated"[^>]*>(\w+)</b></td><td class="n">(\d+)</td></tr>', chapter))
    if case.searched:
        assert counts == {result: str(sum(row[1] == result for row in inside)) for result in ("good", "fair", "poor")}
    lead = re.findall(r'<p class="lead">(.*?)</p>', text)
    unknown = any(row[1] is None or row[2] for row in inside)
    assert lead == (
        [f"Worst result by agreed 7: {'at least ' if unknown else ''}poor"] if case.searched
        else ["No result by agreed 7: nothing was inspected."]
    )  # fmt: skip
    if any(row[1] is None for row in inside):
        assert text.index("Not rated, because nothing was inspected:") < text.index('<dl class="figures">'), "before any figure"
    rating = ("--elements", "tens", "--scheme", "agreed")
    told = json.loads(run(documents, "rating", "apply", case.scene.name, *rating, "-o", tmp_path / "r.xlsx", "--json").stdout)
    assert [row["result"] for row in told["ratings"]] == [row[1] for row in known]
    book = openpyxl.load_workbook(tmp_path / "r.xlsx")
    head, *rows = book["Rating"].iter_rows(values_only=True)
    found = [dict(zip(head, row, strict=True)) for row in rows]
    assert [row["Element"] for row in found] == [row[0] for row in known]
    assert [row["Result"] for row in found] == [row[1] or "not rated" for row in known]
    assert [row["Lower bound"] for row in found] == [row[2] for row in known]
    assert [row["Finding No."] for row in found] == [row[5] for row in known]
    for name, place in (("Inspected", 3), ("Value", 4)):
        assert [row[name] for row in found] == [
            row[place] if row[place] is None else pytest.approx(row[place]) for row in known
        ]
    assert book["Scheme"]["B5"].value == "7"
    with connect(documents) as conn:
        wet = conn.execute(
            "SELECT name, wet_area FROM tunnel_api.element_findings(%s, 'tens') ORDER BY number", [case.scene.name]
        ).fetchall()
    assert [(row[1], row[6]) for row in book["Elements"].iter_rows(min_row=2, values_only=True)] == [
        (name, pytest.approx(area)) for name, area in wet
    ]


@pytest.mark.parametrize("name", ["whole", "never"])
def test_ratings_of_the_pdf(documents: str, name: str, tmp_path: Path, chromium: Path) -> None:
    case = CASES[name]
    (tmp_path / "owner.toml").write_text(RATED + 'version = "7"', "utf-8")
    run(documents, "report", name, "-o", tmp_path / "r.pdf", "--template", tmp_path / "owner.toml")
    words = " ".join(" ".join(page.extract_text() for page in pypdf.PdfReader(tmp_path / "r.pdf").pages).split())
    for row in rating_of(documents, case):
        line = rf"{row[0]} 0?\+?\S+ {shown_result(row)}"
        assert re.search(line, words), line


def test_sheets(documents: str, case: Case) -> None:
    with connect(documents) as conn:
        rows = conn.execute(
            "SELECT chainage_from, chainage_to, leaks, wet_area, seen_share, gaps, remarks FROM tunnel_api.sheet"
            " WHERE survey = %s ORDER BY number", [case.scene.name],
        ).fetchall()  # fmt: skip
    seen = 0.0
    for first, last, count, area, share, gaps, remarks in rows:
        here = [
            known.replace("km 0–1", f"km {first // 1000:.0f}") for known in case.known if "km 0," not in known or first < 1000
        ]
        assert remarks == ("; ".join(here) or None)
        low, high = max(first, case.low), min(last, case.high)
        here = [leak for leak in case.counted if leak.east > low and leak.west < high]
        searched = case.searched_between(low, high)
        assert count == (len(here) if searched else None)
        assert area == (pytest.approx(sum(leak.between(low, high) for leak in here)) if searched else None)
        assert (gaps or "").startswith("Not searched for leaks: ") == (not searched)
        seen += (share or 0) * (high - low)
    assert sum(row[3] or 0 for row in rows) == pytest.approx(case.area)
    assert seen / (case.high - case.low) == pytest.approx(case.seen)


def test_layers_of_qgis(documents: str, case: Case, tmp_path: Path) -> None:
    """What the sources of the layers select."""
    result = run(documents, "qgis", case.scene.name, "-o", tmp_path / "p.qgz", "--images", tmp_path)
    assert said_on_stderr(result) >= {*case.said, *case.known}
    with zipfile.ZipFile(tmp_path / "p.qgz") as archive:
        project = ElementTree.fromstring(archive.read("p.qgs"))
    abstract = project.findtext("projectMetadata/abstract") or ""
    assert abstract.splitlines()[1:] == ["; ".join(case.said)] * bool(case.said) + list(case.known)
    sources = {layer.findtext("id"): layer.findtext("datasource") or "" for layer in project.iter("maplayer")}
    counted = {}
    with connect(documents) as conn:
        for name in ("leak_sheet", "coverage_gap"):
            table, where = re.findall(r'table="tunnel_api"\."(\w+)".* sql=(.*)$', sources[f"tunneldb_layer_{name}"])[0]
            counted[name] = conn.execute(f"SELECT count(*) FROM tunnel_api.{table} WHERE {where}").fetchone()[0]  # type: ignore
        table, where = re.findall(r'table="tunnel_api"\."(\w+)" sql=(.*)$', sources["tunneldb_layer_remark"])[0]
        rows = conn.execute(f"SELECT km, file, remark FROM tunnel_api.{table} WHERE {where}").fetchall()  # type: ignore
    assert sorted(rows, key=str) == sorted(
        [
            *((km, None, note) for km, note in case.scene.notes.items()),
            *((None, "a.laz", known[7:]) for known in case.known if "a.laz" in known),
        ],
        key=str,
    )
    beyond = [leak for leak in case.scene.leaks if leak.counts and leak not in case.counted]
    assert counted == {"leak_sheet": len(case.counted) + len(beyond), "coverage_gap": len(case.said)}


def test_by_kilometre(documents: str, case: Case) -> None:
    told = json.loads(leaks(documents, case, "--by-km", "--json").stdout)
    everything = told["total"]
    assert everything["patches"] == (len(case.counted) if case.searched else None)
    assert everything["wet_area"] == (pytest.approx(case.area) if case.searched else None)
    assert everything["seen_share"] == pytest.approx(case.seen)
    for row in told["kilometres"]:
        low, high = max(1000.0 * row["km"], case.low), min(1000.0 * row["km"] + 1000, case.high)
        here = [leak for leak in case.counted if leak.east > low and leak.west < high]
        searched = case.searched_between(low, high)
        assert row["patches"] == (len(here) if searched else None)
        assert row["wet_area"] == (pytest.approx(sum(leak.between(low, high) for leak in here)) if searched else None)
    lines = leaks(documents, case, "--by-km").stdout.splitlines()
    assert lines[-1].split()[0] == "all"
    if case.said:
        assert lines[0] == case.said[0]


def test_views(documents: str, case: Case) -> None:
    with connect(documents) as conn:
        name = case.scene.name
        area, count = conn.execute(
            "SELECT sum(wet_area), sum(leaks) FROM tunnel_api.km_statistics WHERE survey = %s", [name]
        ).fetchone()
        assert (area is None) == (not case.searched)
        assert (area or 0) == pytest.approx(case.area)
        over = sum(leak.west < 1000 < leak.east for leak in case.counted)
        assert (count or 0) == len(case.counted) + over
        (wet,) = conn.execute("SELECT tunnel_api.wet_area(%s, '-Infinity', 'Infinity')", [name]).fetchone()
        assert wet == (pytest.approx(case.area) if case.searched else None)
        (seen,) = conn.execute("SELECT seen_share FROM tunnel_api.coverage(%s, '-Infinity', 'Infinity')", [name]).fetchone()
        assert (seen or 0) == pytest.approx(case.seen)
        holds = conn.execute("SELECT holds FROM tunnel_api.waterproof_class(%s, '-Infinity', 'Infinity')", [name]).fetchall()
        assert any(row[0] for row in holds) == bool(case.searched)


def test_a_kilometre_is_a_stretch(documents: str) -> None:
    """Leaks over its end count in both, as by kilometre."""
    rows = json.loads(run(documents, "leaks", "over_end", "--by-km", "--json").stdout)["kilometres"]
    for row in rows:
        place = ("--from", max(1000 * row["km"], FIRST), "--to", min(1000 * row["km"] + 1000, LAST))
        one = json.loads(run(documents, "leaks", "over_end", *place, "--json").stdout)
        assert (one["count"], one["area"]) == (row["patches"], pytest.approx(row["wet_area"]))


def test_a_stretch_is_cut_alike(documents: str, tmp_path: Path) -> None:
    """A leak over the end of what is asked for counts as one, with the part of its area that lies there."""
    asked = ("over_end", "--from", "985", "--to", "999")
    told = json.loads(run(documents, "leaks", *asked, "--json").stdout)
    assert (told["count"], told["area"]) == (2, pytest.approx(2 + 1))
    run(documents, "report", *asked, "-o", tmp_path / "r.html")
    text = (tmp_path / "r.html").read_text("utf-8")
    assert "<dt>Leaks</dt><dd>2</dd>" in text
    assert "<dt>Wet area</dt><dd>3.00 " in text


def test_less_certain_leaks_are_left_out(documents: str) -> None:
    told = json.loads(run(documents, "leaks", "whole", "--min-confidence", "0.6", "--json").stdout)
    assert told["count"] == len(WHOLE.counted)
    told = json.loads(run(documents, "leaks", "whole", "--min-confidence", "0.61", "--json").stdout)
    assert told["count"] == len(WHOLE.counted) - 1
    run(documents, "leaks", "whole", "--min-confidence", "1.1", code=2)


@pytest.mark.parametrize(
    ("asked", "said"),
    [(("--from", "100", "--to", "200"), "not scanned"), (("--from", "1050", "--to", "1100"), "1+060–1+100 not scanned")],
)
def test_places_that_were_not_scanned_are_no_all_clear(documents: str, asked: tuple[str, ...], said: str) -> None:
    assert said in run(documents, "leaks", "whole", *asked, code=1).stdout


def test_what_changed_since_the_search_is_said(conn: psycopg.Connection) -> None:
    make_survey(conn, WHOLE.scene)
    conn.execute("UPDATE tunnel_api.axis_vertex SET geom = ST_Translate(geom, 0.1, 0, 0) WHERE n = 95")
    conn.execute(
        "INSERT INTO tunnel.run (survey_id, km, stage, started_at, finished_at, outcome, message)"
        " SELECT id, 1, 'ground', now(), now(), 'failed', E'out of memory\\nand more' FROM tunnel.survey"
    )
    conn.execute(
        "INSERT INTO tunnel.incoming (survey_id, name, path, bytes, points, km_from, km_to, failed_at, message)"
        " SELECT id, 'b.laz', '/b.laz', 1, 1, 1, 1, now(), 'truncated' FROM tunnel.survey"
    )
    rows = conn.execute(
        "SELECT chainage_from, chainage_to, state, reason, searched FROM tunnel_api.coverage_gaps("
        "(SELECT id FROM tunnel.survey)) WHERE state <> 'unseen'"
    ).fetchall()
    assert rows == [
        (1000, 1060, "not loaded", "b.laz was not read: truncated", False),
        (940, 1000, "stale", "segments is stale", True),
        (1000, 1060, "failed", "ground: out of memory", True),
    ]


def test_a_survey_without_anything_is_not_dry(conn: psycopg.Connection) -> None:
    make_survey(conn, Scene("empty", done={}))
    conn.execute("DELETE FROM tunnel.scan_file")
    ((low, high, state, searched),) = conn.execute(
        "SELECT chainage_from, chainage_to, state, searched FROM tunnel_api.coverage_gaps((SELECT id FROM tunnel.survey))"
    ).fetchall()
    assert (low, high, state, searched) == (FIRST, LAST, "not scanned", False)
