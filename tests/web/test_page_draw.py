"""Drawing, sections and files in Chromium, by mouse and by keyboard."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import openpyxl
import psycopg
import pytest
from playwright.sync_api import BrowserContext, Locator, Page, expect
from support.desk_page import at, opened, settled, tab
from support.example_survey import NAME

PLACE = 12350.0, 2.0
"""Middle of the view: chainage and arc, m."""


@pytest.fixture
def drawing(page: Page) -> Page:
    """The panel of drawing, with PLACE in the middle of the map."""
    tab(page, "Draw")
    page.goto(f"/#/{NAME}?x={PLACE[0]}&y={PLACE[1]}&z=23")
    settled(page)
    return page


def drawn(database: psycopg.Connection, key: int | None = None) -> dict[str, Any]:
    """Return a finding, the last one that was added if none is named."""
    with database.cursor(row_factory=psycopg.rows.dict_row) as cursor:
        cursor.execute(
            "SELECT id, kind, severity, width_mm, remark, area, length, chainage_from, chainage_to, arc_from, arc_to, state,"
            " drawn_by FROM tunnel_api.finding WHERE %(key)s::bigint IS NULL OR id = %(key)s ORDER BY id DESC LIMIT 1",
            {"key": key},
        )
        row = cursor.fetchone()
    assert row is not None
    return row


def save(page: Page) -> int:
    """Save; return the number of the finding that the page then shows."""
    page.locator("#state").evaluate("(node) => { node.textContent = ''; }")
    page.locator(".draw").get_by_role("button", name="Save").click()
    expect(page.locator("#state")).to_contain_text("Saved: finding")
    key = int(re.findall(r"Saved: finding (\d+)", page.locator("#state").inner_text())[0])
    expect(page.locator(".draw")).to_contain_text(f"Shown: finding {key}.")
    return key


def click(page: Page, *places: tuple[float, float], last: str = "double") -> None:
    """Click places of the lining, given from PLACE, m."""
    for n, (x, y) in enumerate(places, start=1):
        pixel = at(page, PLACE[0] + x, PLACE[1] + y)
        if n == len(places) and last == "double":
            page.mouse.dblclick(*pixel)
        else:
            page.mouse.click(*pixel)


def square(page: Page, x: float = 0.0) -> int:
    """Draw a square of 1 m, whose middle lies so far up-chainage of PLACE."""
    page.get_by_role("button", name="Polygon").click()
    page.get_by_role("combobox", name="Kind").last.select_option("spall")
    click(page, (x - 0.5, -0.5), (x + 0.5, -0.5), (x + 0.5, 0.5), (x - 0.5, 0.5))
    expect(page.locator(".draw")).to_contain_text(re.compile(r"\((0\.9|1\.0)\d\u00a0m²\)"))
    return save(page)


def test_polygon_line_and_point_by_mouse(drawing: Page, database: psycopg.Connection) -> None:
    """Kinds are those that may have the shape; the database holds the outline and the values."""
    page = drawing
    form = page.locator(".draw .form")
    page.get_by_role("button", name="Polygon").click()
    form.get_by_label("Kind").select_option("spall")
    form.get_by_label("Severity").select_option("2")
    form.get_by_label("Remark").fill("edge, c and r")
    click(page, (-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))
    one = drawn(database, save(page))
    assert (one["kind"], one["severity"], one["remark"], one["drawn_by"]) == ("spall", 2, "edge, c and r", "ines_web")
    assert one["area"] == pytest.approx(1, abs=0.1)
    assert (one["chainage_from"], one["arc_to"]) == (pytest.approx(12349.5, abs=0.05), pytest.approx(2.5, abs=0.05))
    page.get_by_role("button", name="Line").click()
    form.get_by_label("Kind").select_option("crack")
    form.get_by_label("Width, mm").fill("0.4")
    click(page, (-1, 1), (0, 1.5), (1, 1))
    line = drawn(database, save(page))
    assert (line["kind"], line["width_mm"], line["severity"]) == ("crack", 0.4, None)
    assert line["length"] == pytest.approx(2 * 1.25**0.5, abs=0.1)
    page.get_by_role("button", name="Point").click()
    form.get_by_label("Kind").select_option("missing_bolt")
    click(page, (1.5, -0.5), last="single")
    point = drawn(database, save(page))
    assert (point["kind"], point["chainage_from"]) == ("missing_bolt", pytest.approx(12351.5, abs=0.05))
    expect(form).to_be_hidden()


def press(control: Locator, *keys: str) -> None:
    control.focus()
    for key in keys:
        control.page.keyboard.press(key)


def test_drawing_by_keyboard_alone(drawing: Page, database: psycopg.Connection) -> None:
    """Arrow keys move the map under its middle, and a button adds the middle to the outline."""
    page = drawing
    press(page.get_by_role("button", name="Polygon"), "Enter")
    for keys in ([], ["ArrowRight"], ["ArrowUp"], ["ArrowLeft"]):
        press(page.locator("#map"), *keys)
        settled(page)
        press(page.get_by_role("button", name="Add point in the middle"), "Enter")
    press(page.get_by_role("button", name="Finish"), "Enter")
    expect(page.locator(".draw")).to_contain_text("m²), then save.")
    step = 128 * 156543.03392804097 / 2**23
    press(page.locator(".draw").get_by_role("button", name="Save"), "Enter")
    expect(page.locator(".draw")).to_contain_text("Shown: finding")
    one = drawn(database)
    assert one["area"] == pytest.approx(step**2, rel=0.1)
    press(page.get_by_role("button", name="Point"), "Enter")
    press(page.get_by_role("button", name="Add point in the middle"), "Enter")
    press(page.locator(".draw").get_by_role("button", name="Save"), "Enter")
    expect(page.locator(".draw")).not_to_contain_text(f"Shown: finding {one['id']}.")
    expect(page.locator(".draw")).to_contain_text("Shown: finding")
    assert drawn(database)["id"] > one["id"]


def test_redraw_split_merge_delete(drawing: Page, database: psycopg.Connection) -> None:
    """A corner is dragged; a line splits; two findings become one; what was drawn can be deleted."""
    page = drawing
    first = square(page)
    page.get_by_role("button", name="Redraw").click()
    page.mouse.move(*at(page, PLACE[0] + 0.5, PLACE[1] + 0.5))
    page.mouse.down()
    page.mouse.move(*at(page, PLACE[0] + 1.5, PLACE[1] + 0.5), steps=8)
    page.mouse.up()
    save(page)
    assert drawn(database, first)["area"] == pytest.approx(1.5, abs=0.1)
    page.get_by_role("button", name="Split").click()
    click(page, (0, -1), (0, 1))
    save(page)
    parts = database.execute(
        "SELECT id, area FROM tunnel_api.finding WHERE drawn_by = 'ines_web' AND state <> 'merged' ORDER BY id"
    ).fetchall()
    assert [round(area, 1) for _, area in parts] in ([0.5, 1.0], [1.0, 0.5])
    settled(page)
    shown = int(re.findall(r"Shown: finding (\d+)", page.locator(".draw").inner_text())[0])
    (left, _), (right, _) = sorted(parts, key=lambda part: drawn(database, part[0])["chainage_from"])
    page.get_by_role("button", name="Merge").click()
    click(page, (-0.25, 0) if shown == right else (0.5, 0), last="single")
    expect(page.locator(".draw")).to_contain_text(f"Click the findings to merge: {shown}, {left if shown == right else right}.")
    merged = save(page)
    assert drawn(database, merged)["area"] == pytest.approx(1.5, abs=0.1)
    page.get_by_role("button", name="Delete").click()
    page.get_by_role("dialog").get_by_role("button", name="Keep").click()
    assert drawn(database, merged)["id"] == merged
    other = square(page, 4.0)
    page.get_by_role("button", name="Delete").click()
    page.get_by_role("dialog").get_by_role("button", name="Delete").click()
    expect(page.locator("#state")).to_contain_text(f"Finding {other} deleted.")
    assert database.execute("SELECT count(*) FROM tunnel_api.finding WHERE id = %s", [other]).fetchone() == (0,)
    expect(page.locator(".draw")).to_contain_text("Click a finding on the lining to change it.")


def on_section(page: Page, offset: float, height: float) -> tuple[float, float]:
    """Return where a place of the section is on the page."""
    x, y = page.locator("svg.section").evaluate(
        "(node, [x, y]) => { const p = new DOMPoint(x, -y).matrixTransform(node.getScreenCTM()); return [p.x, p.y]; }",
        [offset, height],
    )
    return x, y


def test_section_with_distance_and_file(page: Page, tmp_path: Path) -> None:
    """The example is a circle of 4 m: its diameter is measured by mouse, and 2 m by keyboard."""
    panel = tab(page, "Section")
    panel.get_by_label("Chainage").fill("12+350")
    panel.get_by_role("button", name="Show").click()
    status = panel.get_by_role("status")
    expect(status).to_contain_text("12+350.000")
    page.mouse.click(*on_section(page, -4, 0))
    expect(status).to_contain_text("First point: offset -4.0")
    page.mouse.click(*on_section(page, 4, 0))
    expect(status).to_contain_text("Distance")
    assert float(re.findall(r"Distance ([\d.]+)", status.inner_text())[0]) == pytest.approx(8, abs=0.05)
    panel.get_by_role("button", name="Clear distance").click()
    press(page.locator("svg.section"), "Enter", *["Shift+ArrowRight"] * 4, "Enter")
    expect(status).to_contain_text("Distance 2.000\u00a0m")
    with page.expect_download() as download:
        panel.get_by_role("button", name="Download SVG").click()
    assert download.value.suggested_filename == f"section-{NAME}-12+350.00.svg"
    download.value.save_as(tmp_path / "section.svg")
    lines = ElementTree.parse(tmp_path / "section.svg").findall(".//{http://www.w3.org/2000/svg}polyline")
    curve = [[float(number) for number in pair.split(",")] for pair in (lines[0].get("points") or "").split()]
    assert max(x for x, _ in curve) == pytest.approx(4, abs=0.05)
    panel.get_by_label("Chainage").fill("nowhere")
    panel.get_by_label("Chainage").press("Enter")
    expect(status).to_contain_text("Enter a chainage in m or as 12+345.")


def test_section_marks_the_finding(page: Page) -> None:
    page.goto(f"/#/{NAME}/finding/1")
    expect(page.locator(".finding-head")).to_contain_text("no. 1")
    panel = tab(page, "Section")
    panel.get_by_role("button", name="At the finding").click()
    expect(panel.locator("svg.section polyline[stroke='#e67e00']")).to_be_attached()


def test_a_workbook_of_the_stretch(
    context_of: Callable[..., BrowserContext], database: psycopg.Connection, tmp_path: Path
) -> None:
    """The file has the findings of the stretch, and no others."""
    with opened(context_of("olga_web"), f"/#/{NAME}") as page:
        panel = tab(page, "Download")
        panel.get_by_label("From").fill("12+400")
        panel.get_by_label("To").fill("12+430")
        with page.expect_download() as download:
            panel.get_by_role("button", name="Spreadsheet").click()
        assert download.value.suggested_filename == f"{NAME}-12400-12430.xlsx"
        expect(panel.get_by_role("status")).to_have_text(f"{NAME}-12400-12430.xlsx: downloaded.")
        download.value.save_as(tmp_path / "stretch.xlsx")
        sheet = openpyxl.load_workbook(tmp_path / "stretch.xlsx")["Findings"]
        found = {row[0].value for row in sheet.iter_rows()} & set(range(1, 10))
        assert {3, 5} <= found
        assert 1 not in found
        panel.get_by_label("To").fill("12+300")
        panel.get_by_role("button", name="Report").click()
        expect(panel.get_by_role("status")).to_contain_text("the smaller one first")


def test_downloads_are_for_operators(page: Page) -> None:
    """An inspector sees why there is no file."""
    panel = tab(page, "Download")
    expect(panel).to_contain_text("Downloads need the role tunnel_operator.")
    for name in ("Report", "Spreadsheet", "GeoPackage"):
        expect(panel.get_by_role("button", name=name)).to_be_disabled()
