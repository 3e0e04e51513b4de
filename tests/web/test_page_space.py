"""The 3D view in Chromium, drawn by its software renderer: points in their colours, findings, keys, touch, and no WebGL."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import psycopg
import pytest
from PIL import Image
from playwright.sync_api import Browser, BrowserContext, Locator, Page, expect, sync_playwright
from support.desk_page import DESKTOP, accessibility_findings, comes_to, enter, forgive, opened, tab
from support.desk_server import DeskServer
from support.example_points import add_points
from support.example_survey import NAME
from web.conftest import PASSWORD

SOFTWARE = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
LINING, GROUND, OPEN, CONFIRMED, MARKED = (74, 90, 104), (138, 106, 63), (230, 126, 0), (0, 92, 175), (208, 2, 27)
PLACE = f"/#/{NAME}?x=12350&y=0&z=19"


@pytest.fixture(scope="module")
def chrome(chromium: Path) -> Iterator[Browser]:
    """Chromium with WebGL."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=SOFTWARE)
        yield browser
        browser.close()


@pytest.fixture(scope="module", autouse=True)
def points(survey_dsn: str) -> None:
    with psycopg.connect(survey_dsn) as conn:
        add_points(conn, 240_000, 12_300.0, 12_500.0)


@pytest.fixture
def space(ines_context: BrowserContext, database: psycopg.Connection) -> Iterator[Page]:
    """Page of the example survey with the 3D view around 12+350."""
    with opened(ines_context, PLACE) as page:
        show(page)
        yield page


def show(page: Page) -> None:
    """Open the 3D view, and wait for its points."""
    page.get_by_role("button", name="3D", exact=True).click()
    expect(page.locator("#space .told")).to_have_text("")
    expect(page.locator("#space .readout")).to_contain_text("points")
    expect(page.locator("#limits")).to_contain_text("Inspected: 95.0")  # above the view: it moves no more


def view(page: Page) -> Locator:
    return page.locator("#space canvas")


def picture(page: Page) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(view(page).screenshot())).convert("RGB")).astype(int)


def near(shot: np.ndarray, colour: tuple[int, int, int], reach: int = 24) -> np.ndarray:
    """Return which pixels have a colour."""
    return np.abs(shot - colour).sum(axis=2) < reach


def shows(page: Page, colour: tuple[int, int, int], least: int) -> None:
    """Wait until so many pixels have a colour."""
    for _ in range(100):
        found = int(near(picture(page), colour).sum())
        if found >= least:
            return
        page.wait_for_timeout(100)
    pytest.fail(f"{found} pixels have the colour {colour}, not {least}")


def outline(page: Page) -> tuple[float, float]:
    """Return a place of the outline of an open leak in the view."""
    shows(page, OPEN, 20)
    rows, columns = np.nonzero(near(picture(page), OPEN))
    middle = len(rows) // 2
    return float(columns[middle]), float(rows[middle])


def chainage(page: Page) -> Locator:
    return page.locator("#space").get_by_label("Chainage", exact=True)


def place(page: Page) -> float:
    """Return the chainage that the view states."""
    text = page.locator("#space .position").inner_text()
    return 1000 * float(text.split("+")[0]) + float(text.split("+")[1])


def test_points_of_the_stretch_take_the_place_of_the_lining(ines_context: BrowserContext, database: psycopg.Connection) -> None:
    """The library is read when the view opens, not before; closing leads back, and leaves nothing behind."""
    with opened(ines_context, PLACE) as page:
        loaded = "performance.getEntriesByType('resource').filter(({ name }) => name.includes('/three/')).length"
        assert page.evaluate(loaded) == 0
        show(page)
        assert page.evaluate(loaded) == 1
        expect(page.locator("#lining")).to_be_hidden()
        expect(page.locator("#space .readout")).to_contain_text("24,000 points")
        expect(chainage(page)).to_have_value("12+350.0")
        assert place(page) == pytest.approx(12341, abs=0.11)
        page.get_by_role("button", name="Unrolled lining").click()
        expect(page.locator("#space")).to_be_hidden()
        expect(view(page)).to_have_count(0)
        expect(page.locator("#lining")).to_be_visible()
        comes_to(page, lambda seen: abs(seen["x"] - 12350) < 1)


def test_points_have_the_colours_of_the_choice(space: Page) -> None:
    """Classes, as the legend has them; greys; blue and red."""
    page = space
    shows(page, LINING, 20_000)
    shows(page, GROUND, 5_000)
    legend = page.locator("#space .key")
    expect(legend).to_have_text("groundliningfixture")
    choice = page.get_by_role("combobox", name="Colour")
    assert choice.locator("option").all_inner_texts() == [
        "Class", "Raw intensity", "Corrected intensity", "Offset from the surface",
    ]  # fmt: skip
    choice.select_option(label="Corrected intensity")
    expect(legend).to_contain_text("dB")
    shot = picture(page)
    assert near(shot, LINING, 12).sum() < 5_000
    assert (np.ptp(shot, axis=2) < 12).mean() > 0.3
    choice.select_option(label="Offset from the surface")
    expect(legend).to_contain_text("m")
    shot = picture(page)
    assert (shot[..., 0] > shot[..., 2] + 60).sum() > 1000  # the cable is in front of the lining: red
    page.get_by_label("Point size").fill("0.5")
    assert near(picture(page), (34, 45, 54), 6).sum() > near(shot, (34, 45, 54), 6).sum() + 10_000


def test_a_finding_is_selected_by_its_outline(space: Page, database: psycopg.Connection) -> None:
    """A click shows it, as on the lining; a verdict changes its colour; the view follows the finding; outlines can be off."""
    page = space
    x, y = outline(page)
    view(page).click(position={"x": x, "y": y})
    expect(page.locator(".finding-head")).to_contain_text("no. 2")
    expect(page).to_have_url(re.compile("/finding/2"))
    shows(page, MARKED, 20)
    page.locator(".verdicts").get_by_role("button", name="Confirm").click()
    expect(page.locator("#state")).to_contain_text("Saved. Finding 2: confirmed.")
    page.goto(f"/#/{NAME}/finding/7")
    expect(page.locator(".finding-head")).to_contain_text("no. 7")
    expect(chainage(page)).to_have_value("12+471.0")
    expect(page.locator("#space .told")).to_have_text("")
    chainage(page).fill("12350")
    chainage(page).press("Enter")
    shows(page, CONFIRMED, 20)
    view(page).press("h")
    expect(page.locator("#state")).to_contain_text("Outlines off.")
    assert not near(picture(page), CONFIRMED).any()


def test_keys_and_buttons_lead_along_the_tunnel(space: Page) -> None:
    """Arrow keys, five metres with Shift; beyond the end the next stretch follows; both views; the whole length of 50 m."""
    page = space
    view(page).press("ArrowUp")
    assert place(page) == pytest.approx(12342, abs=0.11)
    view(page).press("Shift+ArrowRight")
    assert place(page) == pytest.approx(12347, abs=0.11)
    view(page).press("ArrowDown")
    assert place(page) == pytest.approx(12346, abs=0.11)
    for _ in range(3):
        view(page).press("Shift+ArrowUp")
    expect(chainage(page)).to_have_value("12+369.0")
    expect(page.locator("#space .told")).to_have_text("")
    assert place(page) == pytest.approx(12361, abs=0.2)
    shows(page, LINING, 10_000)
    page.get_by_role("button", name="Forward 5 m").click()
    assert place(page) == pytest.approx(12366, abs=0.2)
    page.get_by_role("button", name="Outside").click()
    expect(page.get_by_role("button", name="Outside")).to_have_attribute("aria-pressed", "true")
    assert place(page) == pytest.approx(12369, abs=0.2)
    outside = picture(page)
    assert near(outside[:20], (34, 45, 54), 6).all()  # the tunnel is in the middle
    page.get_by_role("combobox", name="Length").select_option("50 m")
    expect(page.locator("#space .readout")).to_contain_text("60,000 points")
    page.get_by_role("button", name="Inside").click()
    assert place(page) == pytest.approx(12345, abs=0.2)


def test_a_mouse_turns_and_moves(space: Page) -> None:
    page = space
    box = view(page).bounding_box()
    assert box is not None
    before = picture(page)
    page.mouse.move(box["x"] + 300, box["y"] + 200)
    page.mouse.down()
    page.mouse.move(box["x"] + 500, box["y"] + 200, steps=5)
    page.mouse.up()
    assert (np.abs(picture(page) - before).sum(axis=2) > 30).mean() > 0.1
    page.mouse.wheel(0, -100)
    expect(page.locator("#space .position")).to_have_text(re.compile(r"12\+342\.\d"))


def test_the_ribbon_and_a_chainage_lead_the_view(space: Page) -> None:
    page = space
    chainage(page).fill("12+400")
    page.locator("#space").get_by_role("button", name="Show", exact=True).click()
    expect(page.locator("#space .position")).to_have_text("12+391.0")
    strip = page.get_by_role("slider", name="Chainage in view")
    box = strip.bounding_box()
    assert box is not None
    strip.click(position={"x": box["width"] * 0.375, "y": 20})
    expect(chainage(page)).to_have_value(re.compile(r"12\+37[45]\.\d"))
    expect(page.locator("#space .told")).to_have_text("")
    chainage(page).fill("far")
    chainage(page).press("Enter")
    expect(page.locator("#space .told")).to_have_text("Enter a chainage in m or as 12+345.")
    tab(page, "Draw")
    expect(page.locator("#lining")).to_be_visible()


def test_opening_many_times_keeps_no_graphics(space: Page) -> None:
    """A browser has 16 contexts of WebGL, and warns when it drops one."""
    page = space
    warned: list[str] = []
    page.on("console", lambda message: warned.append(message.text))
    for _ in range(17):
        page.get_by_role("button", name="Unrolled lining").click()
        show(page)
    assert not [text for text in warned if "context" in text.lower()]
    shows(page, LINING, 20_000)


@pytest.mark.parametrize("settings", [{}, PHONE], ids=["1440", "390"])
def test_axe_has_no_serious_finding(
    settings: dict, context_of: Callable[..., BrowserContext], database: psycopg.Connection
) -> None:
    with opened(context_of("ines_web", **settings), PLACE) as page:
        show(page)
        assert accessibility_findings(page) == []
        page.get_by_role("combobox", name="Colour").select_option("raw")
        assert accessibility_findings(page) == []


def test_a_phone_turns_and_selects_by_touch(context_of: Callable[..., BrowserContext], database: psycopg.Connection) -> None:
    """Fewer points, nothing wider than the screen, and buttons of at least 44 px."""
    with opened(context_of("ines_web", **PHONE), PLACE) as page:
        show(page)
        assert not page.evaluate("document.documentElement.scrollWidth > innerWidth || document.body.scrollWidth > innerWidth")
        for name in ("Unrolled lining", "Inside", "Outside", "Forward 5 m"):
            box = page.get_by_role("button", name=name).bounding_box()
            assert box is not None
            assert box["height"] >= 44
        before = picture(page)
        box = view(page).bounding_box()
        assert box is not None
        assert box["height"] > 200
        finger = page.context.new_cdp_session(page)
        x, y = box["x"] + 100, box["y"] + 100
        for kind, places in (("touchStart", [x]), ("touchMove", [x + 60]), ("touchMove", [x + 120]), ("touchEnd", [])):
            touched = [{"x": at, "y": y} for at in places]
            finger.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": touched})
        assert (np.abs(picture(page) - before).sum(axis=2) > 30).mean() > 0.1
        page.get_by_role("button", name="Outside").tap()
        x, y = outline(page)
        view(page).tap(position={"x": x, "y": y})
        expect(page.locator(".finding-head")).to_contain_text("no. 2")


def test_a_survey_without_points_says_so(ines_context: BrowserContext, database: psycopg.Connection) -> None:
    with opened(ines_context, PLACE.replace(NAME, "demo-2026")) as page:
        page.get_by_role("button", name="3D", exact=True).click()
        expect(page.locator("#space .told")).to_contain_text("no points of demo-2026 are stored from 12340.0 to 12360.0 m")
        forgive(page, "404")


def test_a_browser_without_webgl_says_what_to_do(
    chrome: Browser, chromium: Path, server: DeskServer, database: psycopg.Connection
) -> None:
    browser = chrome.browser_type.launch(executable_path=chromium, args=["--no-sandbox", "--disable-3d-apis"])
    context = browser.new_context(base_url=server.address, viewport=DESKTOP)
    enter(context, "ines_web", PASSWORD)
    with opened(context, PLACE) as page:
        page.get_by_role("button", name="3D", exact=True).click()
        told = page.locator("#space .told")
        expect(told).to_contain_text("This browser shows no 3D: WebGL is off. Switch on hardware acceleration")
        assert "/three/" not in str(page.evaluate("performance.getEntriesByType('resource').map(({ name }) => name)"))
        page.get_by_role("button", name="Unrolled lining").click()
        expect(page.locator("#lining")).to_be_visible()
    browser.close()
