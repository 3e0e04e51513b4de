"""The desk without a network, in Chromium: a stretch that was taken offline is shown, and what is not held is said."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import psycopg
import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect
from support.desk_page import DESKTOP, enter, opened, tab
from support.desk_server import DeskServer
from support.example_survey import NAME
from web.conftest import PASSWORD

STRETCH = "12+300", "12+360"


@pytest.fixture
def tablet(chrome: Browser, server: DeskServer, database: psycopg.Connection) -> Iterator[BrowserContext]:
    """Browser of its own, in which an inspector is signed in."""
    context = chrome.new_context(base_url=server.address, viewport=DESKTOP)
    enter(context, "ines_web", PASSWORD)
    yield context
    context.close()


def take(page: Page, stretch: tuple[str, str] = STRETCH) -> None:
    """Take a stretch offline."""
    panel = tab(page, "Offline")
    panel.get_by_label("From", exact=True).fill(stretch[0])
    panel.get_by_label("To", exact=True).fill(stretch[1])
    panel.get_by_role("button", name="State size").click()
    expect(panel.get_by_role("status")).to_contain_text("tiles of images")
    panel.get_by_role("button", name="Take offline").click()
    expect(panel.get_by_role("status")).to_contain_text("Taken offline:")


def test_a_stretch_is_shown_without_a_network(tablet: BrowserContext) -> None:
    with opened(tablet, f"/#/{NAME}?x=12330&y=0&z=20") as page:
        take(page)
        tablet.set_offline(True)
        page.reload()
        expect(page.locator("#network")).to_contain_text("Offline: as of 20")
        expect(page.locator("#network")).to_contain_text(f"{NAME}, 12+300.0 to 12+360.0. Elsewhere: not taken offline.")
