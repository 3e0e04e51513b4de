"""The command report on a survey made by hand: what it states, what its pictures show, and the page in a real Chromium."""

from __future__ import annotations

import base64
import io
import itertools
import json
import math
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
import pypdf
import pytest
import shapely
from click.testing import CliRunner, Result
from PIL import Image
from playwright.sync_api import Browser, Page, expect, sync_playwright
from psycopg import sql
from psycopg.conninfo import make_conninfo
from support.example_survey import without_intensity

from tunneldb.cli.main import main
from tunneldb.database import connect
from tunneldb.report.page import write_html
from tunneldb.store.survey import get_survey

SURVEY = "demo-2024"
LENGTH, STRIP = 200.0, 50.0
REMARK = "drips <b>after</b> rain</script><script>document.title='broken'</script>"


def run(*arguments: object, code: int = 0) -> Result:
    result = CliRunner().invoke(main, [str(a) for a in arguments], catch_exceptions=False)
    assert result.exit_code == code, result.output
    return result


@pytest.fixture(scope="module")
def shared(server_dsn: str, example_template: str) -> Iterator[str]:
    """DSN of a copy of the example that the whole module reads, with a remark that would break a careless page."""
    database = sql.Identifier("tunneldb_report")
    with psycopg.connect(server_dsn, autocommit=True) as admin:
        admin.execute(sql.SQL("CREATE DATABASE {} TEMPLATE {}").format(database, sql.Identifier(example_template)))
        dsn = make_conninfo(server_dsn, dbname="tunneldb_report")
        with connect(dsn) as conn:
            conn.execute("UPDATE tunnel_api.leak SET review = 'confirmed', remark = %s WHERE id = 1", [REMARK])
        yield dsn
        admin.execute(sql.SQL("DROP DATABASE {} WITH (FORCE)").format(database))


@pytest.fixture(scope="module")
def report(shared: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "report.html"
    run("--dsn", shared, "report", SURVEY, "-o", path)
    assert [file.name for file in path.parent.iterdir()] == ["report.html"]
    return path


@pytest.fixture(scope="module")
def leaks(shared: str) -> list[dict[str, Any]]:
    """The leaks, straight from their table."""
    with connect(shared) as conn, conn.cursor(row_factory=psycopg.rows.dict_row) as cursor:
        return cursor.execute(
            "SELECT id, (chainage_from + chainage_to) / 2 AS chainage, arc_from, arc_to, clock, area, review,"
            " ST_AsText(unrolled) AS outline FROM tunnel.finding WHERE kind = 'leak' ORDER BY chainage_from"
        ).fetchall()


class Reading:
    """What the file of a report holds, read without its script."""

    def __init__(self, path: Path) -> None:
        self.text = path.read_text("utf-8")
        (table,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', self.text)
        self.table = json.loads(table)
        self.rows = [dict(zip(self.table["columns"], row, strict=True)) for row in self.table["rows"]]
        self.strips = dict(re.findall(r'<figure class="strip" id="strip-(\d+)">(.*?)</figure>', self.text, re.DOTALL))
        scripts = re.findall(r'<script type="application/json">(.*?)</script>', self.text)
        self.details = {int(key): value for text in scripts for key, value in json.loads(text).items()}

    def strip(self, start: int) -> tuple[np.ndarray, tuple[float, float, float, float]]:
        """Picture of a strip, and where it is drawn: x, y, width, height."""
        image = r'<image x="(\S+)" y="(\S+)" width="(\S+)" height="(\S+)" .*?href="data:image/webp;base64,([^"]+)"'
        ((*place, picture),) = re.findall(image, self.strips[str(start)])
        x, y, width, height = map(float, place)
        return decode(picture), (x, y, width, height)


def decode(text: str) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(base64.b64decode(text))).convert("RGB")).astype(int)


def points(path: str) -> list[np.ndarray]:
    """The rings of an SVG path of straight lines."""
    rings = re.findall(r"M([^MZ]*)Z?", path)
    return [np.array([list(map(float, point.split())) for point in ring.split("L")]) for ring in rings]


@pytest.fixture(scope="module")
def reading(report: Path) -> Reading:
    return Reading(report)


def test_leaks_are_those_of_the_database(reading: Reading, leaks: list[dict[str, Any]]) -> None:
    assert [row["id"] for row in reading.rows] == [leak["id"] for leak in leaks]
    for row, leak in zip(reading.rows, leaks, strict=True):
        assert (row["review"], row["area"]) == (leak["review"], pytest.approx(leak["area"], abs=0.001))
        assert row["chainage"] == pytest.approx(leak["chainage"], abs=0.001)
        assert row["label"] == f"12+{leak['chainage'] - 12000:.3f}"
        assert row["strip"] == leak["chainage"] // STRIP * STRIP
    wet = sum(leak["area"] for leak in leaks if leak["review"] != "rejected")
    assert f"<dt>Wet area</dt><dd>{wet:.2f} " in reading.text
    assert "<dt>Review</dt><dd>3 confirmed, 1 rejected, 3 open</dd>" in reading.text


def test_unseen_lining_is_stated(reading: Reading) -> None:
    """The first ten of the 200 m were not seen: stated as a share, as a stretch, and drawn."""
    assert "<dt>Lining inspected</dt><dd>95.0 %</dd>" in reading.text
    stretch = ("<td>12+300.000</td>", "<td>12+310.000</td>", '<td class="n">10.0</td>', '<td class="n">0.0 %</td>')
    assert "".join(stretch) in reading.text
    picture, (_, _, width, height) = reading.strip(12300)
    side = width / picture.shape[1]
    unseen = np.abs(picture - [216, 200, 230]).max(axis=2) < 16
    middle = slice(int((height / 2 - 3) / side), int((height / 2 + 3) / side))
    assert unseen[middle, : int(9.8 / side)].mean() > 0.97
    assert unseen[middle, int(10.2 / side) :].mean() < 0.01


def test_strip_shows_each_leak_where_its_outline_is(reading: Reading, leaks: list[dict[str, Any]]) -> None:
    for leak in leaks:
        start = int(leak["chainage"] // STRIP * STRIP)
        outline = shapely.from_wkt(leak["outline"])
        link = rf'<a href="#leak-{leak["id"]}" class="{leak["review"]}">.*?<path d="([^"]+)"'
        (drawn,) = re.findall(link, reading.strips[str(start)])
        ring = shapely.Polygon(points(drawn)[0])
        assert ring.area == pytest.approx(shapely.Polygon(outline.exterior).area, rel=0.05)
        assert ring.centroid.x + start == pytest.approx(outline.centroid.x, abs=0.05)
        picture, (x, y, width, _) = reading.strip(start)
        side = width / picture.shape[1]
        row, column = np.mgrid[: picture.shape[0], : picture.shape[1]]
        across, along = x + (column + 0.5) * side, y + (row + 0.5) * side
        inside = shapely.contains_xy(ring.buffer(-0.1), across, along)
        about = shapely.contains_xy(ring.buffer(0.9), across, along) & ~shapely.contains_xy(ring.buffer(0.2), across, along)
        grey = np.ptp(picture, axis=2) < 24  # not what hangs before it, nor unseen
        assert picture[inside & grey].mean() < picture[about & grey].mean() - 60, leak


def test_details_show_picture_outline_and_section(reading: Reading, leaks: list[dict[str, Any]]) -> None:
    assert set(reading.details) == {leak["id"] for leak in leaks}
    for leak in leaks:
        detail = reading.details[leak["id"]]
        width, height = detail["size"]
        picture = decode(detail["picture"].removeprefix("data:image/webp;base64,"))
        assert picture.shape[1] / picture.shape[0] == pytest.approx(width / height, rel=0.02)
        ring = shapely.Polygon(points(detail["outline"])[0])
        assert ring.area == pytest.approx(shapely.from_wkt(leak["outline"]).area, rel=0.05)
        assert (ring.centroid.x, ring.centroid.y) == pytest.approx((width / 2, height / 2), rel=0.2)
        inside = picture[int(ring.centroid.y / height * picture.shape[0]), int(ring.centroid.x / width * picture.shape[1])]
        assert inside.mean() < 90, "the leak's middle is dark"
        # the tunnel is a circle of 4 m about its axis: the middle of the band stands at the leak's hour
        band = shapely.LineString(points(detail["band"])[0])
        assert band.length == pytest.approx(leak["arc_to"] - leak["arc_from"], rel=0.02)
        middle = band.interpolate(0.5, normalized=True)
        assert math.hypot(middle.x, middle.y) == pytest.approx(4.0, abs=0.02)
        hour = math.degrees(math.atan2(middle.x, -middle.y)) / 30 % 12
        assert abs((hour - leak["clock"] + 6) % 12 - 6) < 0.15
        assert abs(detail["at"]) <= 2.5 + 0.1


STANDARD = re.compile(r"GB 50108|standard’s|[Cc]lass(?:es)? (?:\d|of waterproofing)|>Waterproofing<")
"""Words of a rating scheme."""


def test_without_a_scheme_facts_are_the_headline(reading: Reading, leaks: list[dict[str, Any]]) -> None:
    wet = [leak["area"] for leak in leaks if leak["review"] != "rejected"]
    lead = re.findall(r'<p class="lead">\s*(.*?)\s*</p>', reading.text, re.DOTALL)
    assert lead == [f"{len(wet)} leaks on the inspected lining, wet area {sum(wet):.2f} m²."]
    body = reading.text[reading.text.index("<body>") : reading.text.index('<script type="application/json" id="data">')]
    assert STANDARD.findall(body) == []
    assert 'class="grade"' not in body
    assert 'id="classes"' not in body


@pytest.mark.parametrize("language", ["en", "de", "sl"])
def test_class_is_the_databases_where_the_template_asks_for_it(shared: str, tmp_path: Path, language: str) -> None:
    template = tmp_path / "owner.toml"
    template.write_text(
        f'language = "{language}"\nwaterproofing = "GB 50108-2008"\nheadline = "waterproofing"\n'
        'chapters = ["summary", "classes"]',
        "utf-8",
    )
    run("--dsn", shared, "report", SURVEY, "-o", tmp_path / "r.html", "--template", template)
    text = (tmp_path / "r.html").read_text("utf-8")
    with connect(shared) as conn:
        query = "SELECT class, holds, breaks FROM tunnel_api.waterproof_class(%s, 12300, 12500)"
        rows = conn.execute(query, [SURVEY]).fetchall()
    best = min(klass for klass, holds, _ in rows if holds)
    assert f'<p class="grade">{best}</p>' in text
    (lead,) = re.findall(r'<p class="lead">(.*?)</p>', text)
    assert f"{best}" in lead
    assert "GB 50108-2008" in lead
    assert ">None" not in text
    for _, _, breaks in rows:
        for said in breaks:
            assert said.replace(">", "&gt;") in text


def test_stretch(shared: str, leaks: list[dict[str, Any]], tmp_path: Path) -> None:
    path = tmp_path / "part.html"
    told = json.loads(
        run("--dsn", shared, "report", SURVEY, "-o", path, "--from", "12+400", "--to", "12+432.5", "--json").stdout
    )
    assert (told["ok"], told["leaks"], told["bytes"]) == (True, 2, path.stat().st_size)
    part = Reading(path)
    assert [row["id"] for row in part.rows] == [leak["id"] for leak in leaks if 12400 < leak["chainage"] < 12432]
    assert "12+400.000 to 12+432.500" in part.text
    assert "> 99.9 %" not in part.text
    assert "<dt>Lining inspected</dt><dd>100.0 %</dd>" in part.text
    assert list(part.strips) == ["12400"]


def digest(path: Path) -> str:
    (found,) = set(re.findall(r"digest ([0-9a-f]{16})", path.read_text("utf-8")))
    return str(found)


def test_digest_tells_another_state(example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    paths = [tmp_path / f"{n}.html" for n in range(3)]
    for path in paths[:2]:
        run("report", example, "-o", path)
    conn.execute("UPDATE tunnel_api.leak SET review = 'rejected' WHERE id = 2")
    conn.commit()
    run("report", example, "-o", paths[2])
    assert digest(paths[0]) == digest(paths[1]) != digest(paths[2])
    text = paths[2].read_text("utf-8")
    assert "finding 2</td><td>review: open → rejected</td>" in text, "the audit"
    assert re.search(r"<td class=\"n\">0</td><td class=\"n\">1</td><td class=\"n\">0</td>", text), "and by whom"


def test_what_was_rejected_and_not_found_again_counts_alike_everywhere(
    example: str, conn: psycopg.Connection, tmp_path: Path
) -> None:
    conn.execute("UPDATE tunnel_api.leak SET review = CASE id WHEN 2 THEN 'rejected' ELSE 'confirmed' END WHERE id IN (1, 2)")
    conn.execute("UPDATE tunnel.finding SET detected = false WHERE id IN (1, 2)")
    conn.commit()
    run("report", example, "-o", tmp_path / "r.html")
    text = (tmp_path / "r.html").read_text("utf-8")
    stated = re.findall(r"<dt>Review</dt><dd>(\d+) confirmed, (\d+) rejected, (\d+) open</dd>", text)
    said = re.findall(r"confirmed by inspectors: (\d+); rejected: (\d+); not reviewed yet, [a-z ]+: (\d+)", text)
    row = re.findall(r'<tr><td><a href="#kind-leak">.*?</tr>', text)[0]
    cells = re.findall(r'<td class="n(?: apart)?">(?:<b>)?([^<]*)', row)
    assert stated == said == [(cells[0], cells[5], cells[1])]
    assert conn.execute(
        "SELECT sum(confirmed)::text, sum(rejected)::text, sum(open)::text FROM tunnel_api.finding_count WHERE wet"
    ).fetchall() == stated  # fmt: skip


def test_state_that_does_not_hold_is_warned_of(example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    conn.execute("UPDATE tunnel_api.axis_vertex SET geom = ST_Translate(geom, 0.03, 0.04, 0) WHERE n = 1240")
    conn.execute("UPDATE tunnel.finding SET detected = false WHERE id = 3")
    conn.execute("DELETE FROM tunnel.coverage")
    conn.execute("UPDATE tunnel.scan_file SET unposed = 3, points = points + 3")
    conn.execute("""UPDATE tunnel.run SET counts = counts || '{"note": "roughness 9° is taken"}' WHERE stage = 'detect'""")
    conn.commit()
    run("report", example, "-o", tmp_path / "r.html")
    text = (tmp_path / "r.html").read_text("utf-8")
    remarks = ["3 points", "left out: the scanner&#39;s position is not known", "km 12, detect: roughness 9° is taken"]
    for remark in remarks:
        assert remark in text
    assert "km 12, detect: roughness 9° is taken" in run("status", example).output
    assert "<li>stage segments of kilometre 12</li>" in text
    assert "Why: axis edited since (12)." in text
    assert "moved by 0.050 m" in text
    assert "1 confirmed leak that the last detection did not find again" in text
    assert "The lining was not searched for leaks." in text
    assert "Leaks were not searched for in 200.0 m of the stretch" in text


def test_edits_are_those_of_this_survey_not_of_a_former_one(example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    edit = "UPDATE tunnel_api.leak SET remark = %s WHERE id = 2"
    conn.execute(edit, ["of the former"])
    conn.commit()
    conn.execute("UPDATE tunnel.survey SET created_at = clock_timestamp()")
    conn.execute("UPDATE tunnel.finding SET remark = NULL")
    conn.execute(edit, ["of this one"])
    conn.commit()
    run("report", example, "-o", tmp_path / "r.html", "--from", "12+400", "--to", "12+450")
    text = (tmp_path / "r.html").read_text("utf-8")
    assert "of this one" in text
    assert "of the former" not in text
    assert "1 edit in the audit of the whole survey" in text


def test_coordinate_system_of_its_own(example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    conn.execute(
        "INSERT INTO spatial_ref_sys SELECT 990001, NULL, NULL, replace(srtext, 'UTM zone 30N', 'shifted'), proj4text"
        " FROM spatial_ref_sys WHERE srid = 25830"
    )
    survey = get_survey(conn, example)
    conn.commit()
    for srid, said in ((25830, "EPSG:25830"), (990001, "ETRS89 / shifted")):
        write_html(conn, replace(survey, srid=srid), tmp_path / "r.html")
        assert f"<dt>Coordinates</dt><dd>{said}</dd>" in (tmp_path / "r.html").read_text("utf-8")


def test_without_intensity_the_offset_is_shown(
    example: str, conn: psycopg.Connection, tmp_path: Path, browser: Browser
) -> None:
    without_intensity(conn, every=6)
    path = tmp_path / "r.html"
    assert "leaks were not searched for" in run("report", example, "-o", path).stderr
    reading = Reading(path)
    for strip in (12350, 12400):
        picture, _ = reading.strip(strip)
        inner = picture[4:-4].mean(axis=2)
        assert np.ptp(inner[::4, ::4]) > 200, "from black to white"
        assert (inner > 250).mean(axis=0).max() < 0.5, "no gap between profiles 0.6 m apart, nor where blocks of the image end"
    run("report", example, "-o", tmp_path / "part.html", "--from", "12+346")
    _, (x, _, width, _) = Reading(tmp_path / "part.html").strip(12300)
    assert (x, width) == (pytest.approx(0, abs=0.2), pytest.approx(4, abs=0.3)), "no blank before a stretch's first strip"
    page = browser.new_page()
    troubles = watch(page)
    page.goto(path.as_uri())
    for chapter in ("deviation", "clearance", "rings", "change"):  # which say what was seen of the lining's shape
        page.evaluate("name => document.getElementById(name)?.remove()", chapter)
    for media in ("screen", "print"):
        page.emulate_media(media=media)
        shown = page.locator("body").inner_text()
        assert shown.count("Leaks were not searched for: the survey has no intensity") == 1
        assert "gaps up to 0.6 m filled with the nearest value" in shown
        for word in ("0 leaks", "class", "0.0 %", "seen", "wet or dark"):
            assert word not in shown, (media, word)
    assert troubles == []
    page.close()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["-o", "report.doc"], ".html or .pdf"),
        (["-o", "nowhere/report.html"], "cannot be written"),
        (["-o", "report.html", "--from", "13+000"], "no such station"),
        (["-o", "report.html", "--from", "12+4x"], "--from"),
    ],
)
def test_mistakes(
    example: str, dsn: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    result = run("report", example, *arguments, code=2)
    assert message in result.output
    assert result.output.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_nothing_to_report_and_no_browser(
    conn: psycopg.Connection, example: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TUNNELDB_BROWSER", "/nowhere/chrome")
    assert "TUNNELDB_BROWSER is /nowhere/chrome" in run("report", example, "-o", tmp_path / "r.pdf", code=2).output
    monkeypatch.setenv("TUNNELDB_BROWSER", "/bin/false")
    assert "did not print the report" in run("report", example, "-o", tmp_path / "r.pdf", code=2).output
    conn.execute("DELETE FROM tunnel.segment")
    conn.commit()
    assert "nothing to report yet" in run("report", example, "-o", tmp_path / "r.html", code=2).output
    assert list(tmp_path.iterdir()) == []


@pytest.fixture(scope="module")
def browser(chromium: Path) -> Iterator[Browser]:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.fixture
def page(browser: Browser, report: Path) -> Iterator[Page]:
    """The report, opened; at the end nothing went wrong in it, and nothing was asked of any network."""
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    troubles = watch(page)
    page.goto(report.as_uri())
    yield page
    assert troubles == []
    assert page.title() == f"Leak inspection report: {SURVEY}"
    page.close()


def watch(page: Page) -> list[str]:
    troubles: list[str] = []
    page.on("console", lambda message: troubles.append(message.text))
    page.on("pageerror", lambda error: troubles.append(str(error)))
    page.on("request", lambda request: troubles.append(request.url) if not request.url.startswith(("file:", "data:")) else None)
    return troubles


def column(page: Page, number: int) -> list[str]:
    return page.locator(f"#table tbody td:nth-child({number})").all_inner_texts()


def test_table_sorts_and_filters(page: Page, leaks: list[dict[str, Any]]) -> None:
    counted = [leak for leak in leaks if leak["review"] != "rejected"]
    assert column(page, 1) == [str(leak["id"]) for leak in counted], "in order of chainage, without the rejected"
    page.get_by_role("button", name="Area m²").click()
    assert column(page, 1) == [str(leak["id"]) for leak in sorted(counted, key=lambda leak: -leak["area"])]
    page.get_by_role("button", name="Area m²").click()
    assert column(page, 1) == [str(leak["id"]) for leak in sorted(counted, key=lambda leak: leak["area"])]
    assert page.locator("#table th[aria-sort]").inner_text().startswith("Area m²")
    page.get_by_label("Review").select_option("rejected")
    assert column(page, 1) == [str(leak["id"]) for leak in leaks if leak["review"] == "rejected"]
    page.get_by_label("Review").select_option("all")
    page.get_by_label("Clock").select_option("left wall, 6 to 10")
    assert set(column(page, 1)) == {str(leak["id"]) for leak in leaks if 6 <= leak["clock"] <= 10}
    page.get_by_label("Clock").select_option("all round")
    page.get_by_label("Area from").fill("1.5")
    large = [leak for leak in leaks if leak["area"] >= 1.5]
    assert 0 < len(large) < len(leaks)
    assert set(column(page, 1)) == {str(leak["id"]) for leak in large}
    assert page.locator("#found").inner_text() == f"Leaks: {len(large)} of 7, {sum(leak['area'] for leak in large):.2f} m²"
    page.get_by_label("Area from").fill("")
    page.get_by_label("Search").fill("AFTER</b> rain")
    assert column(page, 1) == ["1"]
    assert column(page, 12) == [REMARK]


def test_from_the_lining_to_the_leak_and_back(page: Page, leaks: list[dict[str, Any]]) -> None:
    page.locator('#strip-12400 a[href="#leak-3"] path').click()
    dialog = page.get_by_role("dialog")
    expect(dialog.locator("header b")).to_have_text("Leak 3")
    assert dialog.locator("svg.view image").evaluate("image => image.getBBox().width") > 2
    assert page.url.endswith("#leak-3")
    dialog.get_by_role("button", name="Show in the table").click()
    assert not dialog.is_visible()
    assert page.locator("#table tr.here td:first-child").inner_text() == "3"
    page.locator("#table tr.here").click()
    dialog.get_by_role("button", name="Next").click()
    expect(dialog.locator("header b"), "4 is rejected, and not in the table").to_have_text("Leak 5")
    dialog.get_by_role("button", name="Show on the lining").click()
    assert page.locator("#strip-12400 a.here").get_attribute("href") == "#leak-5"
    page.locator("#strip-12400 figcaption button").click()
    assert set(column(page, 1)) == {str(leak["id"]) for leak in leaks if leak["chainage"] < 12450 and leak["id"] in (3, 5, 6)}
    page.get_by_role("button", name="Only 12+400 to 12+450").click()
    assert len(column(page, 1)) == 6


def test_address_of_a_leak_opens_it(browser: Browser, report: Path) -> None:
    page = browser.new_page()
    page.goto(f"{report.as_uri()}#leak-4")
    assert page.get_by_role("dialog").locator("header").inner_text().startswith("Leak 4")
    page.keyboard.press("Escape")
    assert not page.get_by_role("dialog").is_visible()
    page.wait_for_url(lambda url: "#" not in url)  # a dialog's event of being closed comes after it
    page.close()


@pytest.mark.parametrize("width", [360, 768])
def test_fits_a_small_screen(browser: Browser, report: Path, width: int) -> None:
    page = browser.new_page(viewport={"width": width, "height": 740}, has_touch=True)
    for address in (report.as_uri(), f"{report.as_uri()}#leak-2"):
        page.goto(address)
        assert page.evaluate("document.documentElement.scrollWidth") <= width
    chart = page.locator("svg.glance").bounding_box()
    assert chart is not None
    assert 0 <= chart["x"] <= chart["x"] + chart["width"] <= width, "it is not cut"
    boxes = "[...document.querySelectorAll('.glance .tick text')].map(label => label.getBoundingClientRect())"
    labels = page.evaluate(f"{boxes}.filter(box => box.width > 0).map(box => [box.left, box.right])")
    assert len(labels) >= 3
    assert all(0 <= left < right <= width for left, right in labels)
    assert all(one[1] < following[0] for one, following in itertools.pairwise(labels))
    card = page.get_by_role("dialog").bounding_box()
    assert card is not None
    assert card["width"] <= width
    page.close()


def test_on_paper_all_leaks_are_there(page: Page, leaks: list[dict[str, Any]]) -> None:
    page.get_by_label("Search").fill("rain")
    pdf = page.pdf(prefer_css_page_size=True)
    sheets = [" ".join(sheet.extract_text().split()) for sheet in pypdf.PdfReader(io.BytesIO(pdf)).pages]
    for leak in leaks:
        assert sum(f"Leak {leak['id']} 12+" in sheet for sheet in sheets) == 1
    assert column(page, 1) == ["1"], "and the screen is as it was"


def lowest_text(sheet: pypdf.PageObject) -> float:
    """Height of the lowest text of a page above its foot, points; without the footer."""
    heights: list[float] = []

    def note(text: str, page: list[float], place: list[float], *_: Any) -> None:
        if text.strip():
            heights.append(place[4] * page[1] + place[5] * page[3] + page[5])

    sheet.extract_text(visitor_text=note)
    return min(height for height in heights if height > 45)


def test_pdf(shared: str, leaks: list[dict[str, Any]], tmp_path: Path, chromium: Path) -> None:
    path = tmp_path / "report.pdf"
    run("--dsn", shared, "report", SURVEY, "-o", path)
    assert [file.name for file in tmp_path.iterdir()] == ["report.pdf"]
    reader = pypdf.PdfReader(path)
    sheets = [" ".join(sheet.extract_text().split()) for sheet in reader.pages]
    for number, sheet in enumerate(reader.pages, start=1):
        if number < len(reader.pages):
            assert lowest_text(sheet) < 420, f"page {number} is half empty"
        assert (float(sheet.mediabox.width), float(sheet.mediabox.height)) == pytest.approx((595, 842), abs=1.5), "A4"
        assert f"Page {number} of {len(sheets)}" in sheets[number - 1]
        assert f"{SURVEY} · digest" in sheets[number - 1]
    (cards,) = (n for n, sheet in enumerate(sheets) if "Leaks one by one" in sheet)
    for leak in leaks:
        (on,) = (n for n, sheet in enumerate(sheets) if f"Leak {leak['id']} 12+" in sheet)
        assert on >= cards
    pictures = sum(len(sheet.images) for sheet in reader.pages)
    assert pictures == len(leaks) + LENGTH / STRIP
    assert "Signature" in sheets[-1]
    assert [entry["/Title"] for entry in reader.outline if not isinstance(entry, list)], "bookmarks"


def test_of_too_many_leaks_the_largest_are_listed_and_all_counted(
    shared: str, leaks: list[dict[str, Any]], tmp_path: Path
) -> None:
    for name, listed in (("all", 1000), ("few", 2)):
        run("--dsn", shared, "report", SURVEY, "-o", tmp_path / f"{name}.html", "--list", listed)
    whole, few = Reading(tmp_path / "all.html"), Reading(tmp_path / "few.html")
    largest = sorted(leaks, key=lambda leak: (leak["review"] == "rejected", -leak["area"]))[:2]
    assert {row["id"] for row in few.rows} == {leak["id"] for leak in largest}
    assert "Largest leaks, listed and drawn, rejected ones last: 2. " in few.text
    assert f"Not listed, but included in all totals: {len(leaks) - 2};" in few.text
    assert (len(whole.rows), "Largest leaks, listed" in whole.text) == (len(leaks), False)
    digests = [re.findall(r"digest ([0-9a-f]{16})", reading.text) for reading in (whole, few)]
    assert digests[0] == digests[1] != [], "it is of all leaks"


def test_the_digest_is_of_leaks_listed_or_not(example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    survey = get_survey(conn, example)
    conn.rollback()

    def digest(listed: int) -> str:
        write_html(conn, survey, tmp_path / "d.html", pictures=0, listed=listed)
        (found,) = set(re.findall(r"digest ([0-9a-f]{16})", Reading(tmp_path / "d.html").text))
        return str(found)

    before = digest(1000)
    conn.execute(
        "UPDATE tunnel_api.leak SET review = 'rejected', remark = 'a sign'"
        " WHERE id = (SELECT id FROM tunnel_api.leak ORDER BY area LIMIT 1)"
    )
    conn.commit()
    assert digest(2) == digest(1000) != before


def test_thousands_of_leaks_come_by_pages(example: str, conn: psycopg.Connection, browser: Browser, tmp_path: Path) -> None:
    rows = conn.execute(
        "SELECT attname FROM pg_attribute"
        " WHERE attrelid = 'tunnel.finding'::regclass AND attnum > 0 AND attname <> 'id' AND attgenerated = ''"
    ).fetchall()
    copy = "INSERT INTO tunnel.finding ({0}) SELECT {0} FROM tunnel.finding, generate_series(1, 500) WHERE id = 3"
    conn.execute(sql.SQL(copy).format(sql.SQL(", ").join(sql.Identifier(name) for (name,) in rows)))
    survey = get_survey(conn, example)
    conn.commit()
    path = tmp_path / "many.html"
    assert write_html(conn, survey, path, pictures=5).leaks == 506, "and one is rejected"
    page = browser.new_page()
    troubles = watch(page)
    page.goto(path.as_uri())
    assert len(column(page, 1)) == 100
    page.get_by_role("button", name="Next").click()
    assert "Page 2 of 6" in page.locator("#pages").inner_text()
    assert len(column(page, 1)) == 100
    for _ in range(2):
        page.get_by_role("button", name="No.").click()
    assert column(page, 1)[0] == str(max(row["id"] for row in Reading(path).rows))
    pdf = page.pdf(prefer_css_page_size=True)
    sheets = [" ".join(sheet.extract_text().split()) for sheet in pypdf.PdfReader(io.BytesIO(pdf)).pages]
    listed = [sheet for sheet in sheets if sheet.count(" open ") + sheet.count(" confirmed ") > 20]
    assert len(listed) > 5
    assert all("Chainage Clock Arc m" in sheet for sheet in listed), "headings on each sheet"
    assert troubles == []
    page.close()
