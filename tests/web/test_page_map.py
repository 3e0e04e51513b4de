"""The page in Chromium: sign-in, surveys, ribbon, lining, two surveys, and the link to a finding."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
import pytest
from click.testing import CliRunner
from PIL import Image
from playwright.sync_api import Browser, BrowserContext, Page, Route, expect
from support.desk_page import DESKTOP, PATIENCE, at, comes_to, forgive, opened, position, settled, sign_in
from support.desk_server import DeskServer
from support.example_survey import LEAKS, NAME
from support.imported_image import STATED, strip, write
from web.conftest import PASSWORD

from tunneldb.cli.main import main
from tunneldb.numerals import percent_number

ORANGE = (230, 126, 0)
"""Colour of the outline of an open leak."""


def orange(page: Page) -> int:
    """Return the number of pixels of the map that have the colour of open leaks."""
    shot = np.asarray(Image.open(io.BytesIO(page.locator(".first").screenshot())).convert("RGB")).astype(int)
    return int((np.abs(shot - ORANGE).sum(axis=2) < 30).sum())


def wait_for_orange(page: Page, shown: bool) -> None:
    for _ in range(100):
        if (orange(page) > 20) == shown:
            return
        page.wait_for_timeout(100)
    pytest.fail(f"outlines are {'not ' if shown else ''}shown")


def test_a_survey_is_chosen_from_the_table_and_from_the_list(
    ines_context: BrowserContext, database: psycopg.Connection
) -> None:
    """Table, filter and order; the bar leads from one survey to another and back to the table."""
    with opened(ines_context, "/") as page:
        rows = page.locator("#surveys tbody tr")
        expect(rows).to_have_count(2)
        expect(page.get_by_role("status").filter(has_text="2 of 2 surveys")).to_be_visible()
        page.get_by_role("button", name="Survey", exact=True).click()
        assert [row.split()[0] for row in rows.all_inner_texts()] == [NAME, "demo-2026"]
        page.get_by_label("Filter").fill("2024")
        expect(rows).to_have_count(1)
        (share,) = database.execute(
            "SELECT seen_share FROM tunnel_api.leak_statistics(%s, '-infinity', 'infinity')", [NAME]
        ).fetchone()  # type: ignore[misc]
        shown = f"{percent_number(share)}\u00a0%"
        expect(rows.first).to_contain_text(shown)
        page.get_by_role("link", name=NAME).click()
        expect(page.locator("#limits")).to_contain_text(f"Inspected: {shown} of the lining.")
        expect(page).to_have_title(f"{NAME} – tunneldb desk")
        page.get_by_role("combobox", name="Survey", exact=True).select_option("demo-2026")
        expect(page).to_have_title("demo-2026 – tunneldb desk")
        page.get_by_role("combobox", name="Survey", exact=True).select_option("")
        expect(rows).to_have_count(2)


def test_sign_in_leads_to_what_was_asked_for(chrome: Browser, server: DeskServer, database: psycopg.Connection) -> None:
    """A permanent link, a wrong password, the right one, and signing out."""
    context = chrome.new_context(base_url=server.address, viewport=DESKTOP)
    context.set_default_timeout(PATIENCE)
    with opened(context, f"/#/{NAME}/finding/3") as page:
        expect(page.locator("h1")).to_have_text("tunneldb desk")
        sign_in(page, "ines_web", "wrong")
        expect(page.get_by_role("alert")).to_contain_text("user or password is wrong")
        sign_in(page, "ines_web", PASSWORD)
        expect(page.locator(".finding-head")).to_contain_text("no. 3")
        assert f"/#/{NAME}/finding/3" in page.url
        page.get_by_role("button", name="Sign out").click()
        expect(page.get_by_label("Password")).to_be_visible()
        page.goto("/")
        expect(page.get_by_label("Password")).to_be_visible()
        forgive(page, "status of 40[13]")
    context.close()


def test_ribbon_leads_along_the_tunnel(page: Page) -> None:
    """A click, a drag and the keys move the lining; the ribbon says where it is, and what is there."""
    strip = page.get_by_role("slider", name="Chainage in view")
    box = strip.bounding_box()
    assert box is not None
    strip.click(position={"x": box["width"] / 2, "y": 20})
    comes_to(page, lambda view: abs(view["x"] - 12400) < 1)
    expect(page.locator(".tip")).to_contain_text("12+400; inspected 100\u00a0%; wet area")
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 20)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * 0.75, box["y"] + 20, steps=3)
    page.mouse.up()
    comes_to(page, lambda view: abs(view["x"] - 12450) < 1)
    strip.press("Home")
    comes_to(page, lambda view: abs(view["x"] - 12300) < 1)
    strip.press("ArrowRight")
    comes_to(page, lambda view: 12301 < view["x"] < 12350)
    strip.press("End")
    comes_to(page, lambda view: abs(view["x"] - 12500) < 1)
    assert float(strip.get_attribute("aria-valuenow") or 0) == pytest.approx(12500, abs=1)


def test_lining_pans_and_zooms_and_shows_outlines(page: Page) -> None:
    """Mouse, wheel, keys and buttons; outlines are drawn and can be switched off; other images can be chosen."""
    start = settled(page)
    wait_for_orange(page, True)
    x, y = at(page, start["x"], start["y"])
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x - 200, y, steps=20)
    page.wait_for_timeout(200)  # without it the map goes on by its inertia
    page.mouse.up()
    way = 200 * 156543.03392804097 / 2 ** start["z"]
    moved = comes_to(page, lambda view: abs(view["x"] - start["x"] - way) < 0.1 * way)
    page.mouse.wheel(0, -400)
    comes_to(page, lambda view: view["z"] > moved["z"] + 0.5)
    page.locator("#map").focus()
    near = settled(page)
    page.keyboard.press("ArrowLeft")
    comes_to(page, lambda view: view["x"] < near["x"])
    page.get_by_role("button", name="Zoom out").click()
    comes_to(page, lambda view: view["z"] < near["z"])
    page.get_by_role("button", name="Whole survey").click()
    whole = comes_to(page, lambda view: abs(view["x"] - 12400) < 1)
    page.get_by_role("button", name="Fit height").click()
    comes_to(page, lambda view: view["z"] > whole["z"])
    page.get_by_role("slider", name="Chainage in view").press("Home")
    wait_for_orange(page, True)
    page.locator("summary", has_text="Layers").click()
    page.get_by_label("Findings (H)").uncheck()
    page.keyboard.press("Escape")  # the key of colours is orange too
    wait_for_orange(page, False)
    page.locator("#map").press("h")
    wait_for_orange(page, True)
    with page.expect_response(lambda answer: f"/tiles/{NAME}/offset/" in answer.url and answer.status == 200):
        page.get_by_label("Image").select_option("offset")
    expect(page.locator(".legend")).to_contain_text("m")


def test_the_legend_has_range_and_unit_of_an_imported_image(
    ines_context: BrowserContext, database: psycopg.Connection, survey_dsn: str, tmp_path: Path
) -> None:
    image = write(tmp_path / "a.tif", strip(STATED), STATED, "°C")
    words = ["--dsn", survey_dsn, "image", "import", NAME, str(image), "--kind", "thermal"]
    assert CliRunner().invoke(main, words).exit_code == 0
    with opened(ines_context, f"/#/{NAME}") as page:
        page.get_by_label("Image").select_option("imported_thermal")
        expect(page.locator(".legend")).to_have_text(re.compile(r"^10\.001\d\.\d\d\s°C$"))
        page.get_by_label("Image").select_option("offset")
        expect(page.locator(".legend")).to_contain_text("m")


def test_two_surveys_by_a_swipe_and_one_above_the_other(page: Page) -> None:
    """The later survey of the example has no finding: at the left of the swipe are those of the earlier."""
    wait_for_orange(page, True)
    page.locator("summary", has_text="Compare").click()
    with page.expect_response(lambda answer: "/tiles/demo-2026/corrected/" in answer.url and answer.status == 200):
        page.get_by_role("combobox", name="Other survey").select_option("demo-2026")
    page.keyboard.press("Escape")
    swipe = page.get_by_role("slider", name="Position of the swipe")
    expect(page.locator(".swipe-names")).to_have_text(f"{NAME}demo-2026")
    swipe.press("Home")
    wait_for_orange(page, False)
    swipe.press("End")
    wait_for_orange(page, True)
    page.locator("summary", has_text="Compare").click()
    page.get_by_role("combobox", name="Show", exact=True).select_option("stack")
    expect(page.locator(".map.second canvas").first).to_be_attached()
    expect(page.locator(".map-name")).to_have_text("demo-2026")
    page.get_by_role("combobox", name="Other survey").select_option("")
    expect(page.locator(".map.second")).to_be_hidden()


def test_a_finding_opens_by_a_click_by_keys_and_by_its_link(page: Page, database: psycopg.Connection) -> None:
    """The link of a finding leads to it from anywhere; its values are those of the database."""
    settled(page)
    wait_for_orange(page, True)
    page.mouse.click(*at(page, *LEAKS[0][:2]))
    panel = page.locator("#panel-body")
    expect(panel.locator(".finding-head")).to_contain_text("Leak, no. 1")
    area, label = database.execute("SELECT round(area::numeric, 2), label FROM tunnel_api.finding WHERE id = 1").fetchone()  # type: ignore[misc]
    expect(panel.locator(".values").first).to_contain_text(f"{area}\u00a0m²")
    expect(panel.locator(".finding-head")).to_contain_text(label)
    link = panel.get_by_role("link", name="Permanent link").get_attribute("href")
    assert link == f"#/{NAME}/finding/1"
    page.goto(f"/#/{NAME}/finding/3")
    expect(panel.locator(".finding-head")).to_contain_text("no. 3")
    comes_to(page, lambda view: abs(view["x"] - LEAKS[2][0]) < 1.5)
    page.goto(f"/{link}")
    expect(panel.locator(".finding-head")).to_contain_text("no. 1")
    comes_to(page, lambda view: abs(view["x"] - LEAKS[0][0]) < 1.5)
    page.goto(f"/#/{NAME}/finding/2")
    expect(panel.locator(".finding-head")).to_contain_text("no. 2")
    settled(page)
    page.locator("#map").press("Enter")
    expect(panel.locator(".finding-head")).to_contain_text("no. 2")
    page.reload()
    expect(panel.locator(".finding-head")).to_contain_text("no. 2")
    assert position(page)["x"] == pytest.approx(LEAKS[1][0], abs=1.5)


@contextmanager
def altered(page: Page, **values: Any) -> Iterator[None]:
    """Let the server answer otherwise for the survey."""

    def answer(route: Route) -> None:
        response = route.fetch()
        route.fulfill(response=response, json={**response.json(), **values})

    page.route(f"**/api/surveys/{NAME}/summary", answer)
    yield
    page.unroute(f"**/api/surveys/{NAME}/summary")


def test_what_was_not_inspected_is_stated_above_the_map(page: Page, database: psycopg.Connection) -> None:
    """The statement of the database, and remarks by their number; where there is nothing to state, nothing is stated."""
    (statement,) = database.execute("SELECT tunnel_api.coverage_statement(%s)", [NAME]).fetchone()  # type: ignore[misc]
    limits = page.locator("#limits")
    expect(limits).to_contain_text(statement)
    with altered(page, statement=None, remarks=["Kilometre 12: rails were not found.", "Scan 3 has no pose."]):
        page.reload()
        expect(limits.locator("p")).to_have_text("Inspected: 95.0\u00a0% of the lining.")
        limits.get_by_text("2 remarks").click()
        expect(limits).to_contain_text("Scan 3 has no pose.")
        page.get_by_role("tab", name="Notes").click()
        expect(page.locator("#panel-body")).to_contain_text("Scan 3 has no pose.")
        expect(page.locator("#panel-body")).not_to_contain_text("etectability")
