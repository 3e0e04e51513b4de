"""The page on a phone or a tablet, by keyboard alone, and what axe says of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import psycopg
import pytest
from playwright.sync_api import BrowserContext, Page, expect
from support.desk_page import accessibility_findings, at, opened, settled, tab
from support.example_survey import LEAKS, NAME

PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}

TABS = ["Finding", "Review", "Draw", "Section", "Rating", "Actions", "Download", "Notes"]


@pytest.fixture(scope="module")
def phone_context(context_of: Callable[..., BrowserContext]) -> BrowserContext:
    """Phone on which an inspector is signed in."""
    return context_of("ines_web", **PHONE)


@pytest.fixture
def phone(phone_context: BrowserContext, database: psycopg.Connection) -> Iterator[Page]:
    """Page of the example survey on a phone."""
    with opened(phone_context, f"/#/{NAME}") as page:
        yield page


def overflows(page: Page) -> bool:
    """Return True if the page is wider than the screen."""
    return bool(page.evaluate("document.documentElement.scrollWidth > innerWidth || document.body.scrollWidth > innerWidth"))


def test_a_phone_reviews_by_touch(phone: Page, database: psycopg.Connection) -> None:
    """A finding is tapped, and judged by buttons of at least 44 px; nothing is wider than the screen."""
    page = phone
    settled(page)
    expect(page.locator("#panel-body")).to_be_hidden()
    page.touchscreen.tap(*at(page, *LEAKS[0][:2]))
    expect(page.locator(".finding-head")).to_contain_text("no. 1")
    assert not overflows(page)
    for name in ("Confirm", "Reject", "Open", "Undo"):
        button = page.locator(".verdicts").get_by_role("button", name=name)
        box = button.bounding_box()
        assert box is not None
        assert box["height"] >= 44
        expect(button).to_be_in_viewport()
    page.locator(".verdicts").get_by_role("button", name="Confirm").tap()
    expect(page.locator("#state")).to_contain_text("Saved. Finding 1: confirmed.")
    assert database.execute("SELECT review FROM tunnel_api.finding WHERE id = 1").fetchone() == ("confirmed",)
    page.locator(".verdicts").get_by_role("button", name="Undo").tap()
    expect(page.locator(".badge")).to_have_text("open")
    assert database.execute("SELECT review FROM tunnel_api.finding WHERE id = 1").fetchone() == ("open",)
    page.get_by_role("tab", name="Review").tap()
    expect(page.locator(".pace")).to_contain_text("reviewed")  # the list is there, from which the next one comes
    page.locator(".verdicts").get_by_role("button", name="Reject").tap()
    expect(page.locator(".finding-head")).to_contain_text("no. 2")
    assert database.execute("SELECT review FROM tunnel_api.finding WHERE id = 1").fetchone() == ("rejected",)
    page.goto(f"/#/{NAME}/finding/3")
    expect(page.locator(".finding-head")).to_contain_text("no. 3")
    page.get_by_role("button", name="Hide").tap()
    expect(page.locator("#panel-body")).to_be_hidden()
    page.get_by_role("button", name="Show", exact=True).tap()
    expect(page.locator("#panel-body")).to_be_visible()
    page.get_by_role("button", name="Hide").tap()
    page.goto(f"/#/{NAME}/finding/6")
    expect(page.locator(".finding-head")).to_contain_text("no. 6")
    expect(page.locator(".finding-head")).to_be_visible()


def test_nothing_is_wider_than_the_phone(phone: Page) -> None:
    """Every tab, the menus, the table of surveys and the sign-in."""
    page = phone
    for name in TABS:
        tab(page, name)
        page.wait_for_timeout(200)
        assert not overflows(page), name
    page.locator("summary", has_text="Layers").tap()
    assert not overflows(page)
    box = page.locator(".menu[open] .menu-box").bounding_box()
    assert box is not None
    assert box["x"] >= 0
    assert box["x"] + box["width"] <= 390
    page.goto("/#/")
    expect(page.get_by_role("heading", name="Surveys")).to_be_visible()
    assert not overflows(page)
    page.get_by_role("link", name=NAME).tap()
    expect(page).to_have_title(f"{NAME} – tunneldb desk")


@pytest.mark.parametrize("settings", [{}, PHONE], ids=["1440", "390"])
def test_axe_has_no_serious_finding(
    settings: dict, chrome: object, context_of: Callable[..., BrowserContext], database: psycopg.Connection
) -> None:
    """Each main state of the page."""
    found = {}
    with opened(context_of("ines_web", **settings), f"/#/{NAME}/finding/1") as page:
        expect(page.locator(".finding-head")).to_contain_text("no. 1")
        for name in TABS:
            tab(page, name)
            if name == "Section":
                expect(page.locator("svg.section")).to_be_attached()
            page.wait_for_timeout(150)
            found[name] = accessibility_findings(page)
        page.locator("summary", has_text="Compare").click()
        page.get_by_role("combobox", name="Other survey").select_option("demo-2026")
        found["two surveys"] = accessibility_findings(page)
        tab(page, "Draw").get_by_role("button", name="Line").click()
        found["drawing"] = accessibility_findings(page)
        page.goto("/#/")
        expect(page.locator("#surveys tbody tr")).to_have_count(2)
        found["surveys"] = accessibility_findings(page)
        page.goto("/login")
        found["sign in"] = accessibility_findings(page)
    assert {name: some for name, some in found.items() if some} == {}


def test_the_keyboard_alone_is_enough(page: Page, database: psycopg.Connection) -> None:
    """From the table to a verdict without a mouse; the focus is always visible."""
    page.goto("/#/")
    link = page.get_by_role("link", name=NAME)
    expect(link).to_be_visible()
    for _ in range(25):
        page.keyboard.press("Tab")
        if link.evaluate("(node) => node === document.activeElement"):
            break
    page.keyboard.press("Enter")
    expect(page).to_have_title(f"{NAME} – tunneldb desk")
    review = page.get_by_role("tab", name="Finding")
    for _ in range(40):
        page.keyboard.press("Tab")
        style = "document.activeElement === document.body || getComputedStyle(document.activeElement).outlineStyle !== 'none'"
        assert page.evaluate(style), page.evaluate("document.activeElement.outerHTML.slice(0, 200)")
        if review.evaluate("(node) => node === document.activeElement"):
            break
    page.keyboard.press("ArrowRight")
    expect(page.locator(".finding-head")).to_contain_text("no. 1")
    page.keyboard.press("c")
    expect(page.locator(".finding-head")).to_contain_text("no. 2")
    assert database.execute("SELECT review FROM tunnel_api.finding WHERE id = 1").fetchone() == ("confirmed",)
