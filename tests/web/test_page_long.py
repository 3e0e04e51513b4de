"""The page in Chromium on a tunnel of 25 km with 100,000 findings: whole tunnel, one pixel, review, two who work at once."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import psycopg
import pytest
from playwright.sync_api import BrowserContext, Page, expect
from support.databases import Copies
from support.desk_page import comes_to, forgive, opened, position, settled, tab
from support.long_survey import FINDINGS, KILOMETRES, NAME, make_long_survey

TWENTY = 20_000.0
"""Chainage at which the tests work, m."""


@pytest.fixture(scope="module")
def survey_dsn(logins: None, copies: Copies, installed: str) -> Iterator[str]:
    """DSN of the database that the tests of this module share."""
    with copies.copy(installed) as dsn:
        with psycopg.connect(dsn) as conn:
            make_long_survey(conn)
        yield dsn


@pytest.fixture
def database(survey_dsn: str) -> Iterator[psycopg.Connection]:
    """Connection to the database under the desk."""
    with psycopg.connect(survey_dsn, autocommit=True) as conn:
        yield conn


def test_whole_tunnel_is_on_one_screen_and_leads_to_a_pixel(page: Page) -> None:
    """The ribbon goes to 20 km; the wheel goes on to single pixels, which are drawn from the stored image."""
    page.get_by_role("button", name="Whole survey").click()
    whole = comes_to(page, lambda view: abs(view["x"] - 500 * KILOMETRES) < 100)
    assert 1440 * 156543.034 / 2 ** whole["z"] > 900 * KILOMETRES
    strip = page.get_by_role("slider", name="Chainage in view")
    box = strip.bounding_box()
    assert box is not None
    strip.click(position={"x": box["width"] * 0.8, "y": 20})
    comes_to(page, lambda view: abs(view["x"] - TWENTY) < 30)
    expect(page.locator(".tip")).to_contain_text("inspected 97.0\u00a0%")
    page.locator("#map").hover()
    for _ in range(40):
        page.mouse.wheel(0, -400)
        page.wait_for_timeout(100)
        if position(page)["z"] > 22.9:
            break
    near = settled(page)
    assert near["z"] > 22.9
    assert abs(near["x"] - TWENTY) < 30
    expect(page.locator("#limits")).to_contain_text("Inspected: 97.0\u00a0% of the lining.")


def test_work_list_of_a_long_tunnel_says_that_it_ends(page: Page) -> None:
    """The list holds 5000 of the findings, and says so; a stretch of 1 km has all of its own."""
    panel = tab(page, "Review")
    expect(panel).to_contain_text("The list ends after 5000 findings: choose a stretch.")
    page.goto(f"/#/{NAME}?x={TWENTY}&y=0&z=14&tab=review")
    page.reload()
    expect(tab(page, "Review")).to_contain_text("of 5000 reviewed")


def test_verdicts_far_along_are_saved(page: Page, database: psycopg.Connection) -> None:
    """An inspector opens a finding at 20 km by its link and confirms it by its key."""
    (key,) = database.execute(
        "SELECT id FROM tunnel.finding WHERE kind = 'leak' AND chainage_from > %s ORDER BY chainage_from LIMIT 1", [TWENTY]
    ).fetchone()  # type: ignore[misc]
    page.goto(f"/#/{NAME}/finding/{key}")
    comes_to(page, lambda view: abs(view["x"] - TWENTY) < 5)
    expect(page.locator("#panel-body")).to_contain_text(f"{key}")
    page.keyboard.press("c")
    expect(page.locator("#state")).to_contain_text("Saved.")
    row = database.execute("SELECT review, reviewed_by FROM tunnel_api.finding WHERE id = %s", [key]).fetchone()
    assert row == ("confirmed", "ines_web")


def test_a_conflict_is_shown_and_neither_verdict_is_lost(
    page: Page, context_of: Callable[..., BrowserContext], database: psycopg.Connection
) -> None:
    """Two inspectors have the same finding open: the second sees what the first wrote, and decides."""
    (key,) = database.execute(
        "SELECT id FROM tunnel.finding WHERE kind = 'leak' AND chainage_from > %s ORDER BY chainage_from LIMIT 1", [15_000.0]
    ).fetchone()  # type: ignore[misc]
    page.goto(f"/#/{NAME}/finding/{key}")
    expect(page.locator("#panel-body")).to_contain_text(f"{key}")
    with opened(context_of("ivo_web"), f"/#/{NAME}/finding/{key}") as other:
        expect(other.locator("#panel-body")).to_contain_text(f"{key}")
        other.keyboard.press("r")
        expect(other.locator("#state")).to_contain_text("Saved.")
    page.keyboard.press("c")
    conflict = page.get_by_text("ivo_web has changed finding")
    expect(conflict).to_be_visible()
    forgive(page, "status of 409")
    page.get_by_role("button", name="Write mine").click()
    expect(page.locator("#state")).to_contain_text("Saved.")
    rows = database.execute(
        "SELECT who, after ->> 'review' FROM tunnel_api.audit WHERE view = 'finding' AND row_id = %s ORDER BY id", [key]
    ).fetchall()
    assert rows == [("ivo_web", "rejected"), ("ines_web", "confirmed")]


def test_table_counts_all_findings(ines_context: BrowserContext, database: psycopg.Connection) -> None:
    """The number of findings is there at once; class and wet area follow."""
    (patches,) = database.execute(
        "SELECT patches FROM tunnel_api.leak_statistics(%s, '-infinity', 'infinity')", [NAME]
    ).fetchone()  # type: ignore[misc]
    with opened(ines_context, "/") as page:
        row = page.locator("#surveys tbody tr")
        expect(row.get_by_role("cell", name=str(patches), exact=True)).to_be_visible()
        counted = database.execute("SELECT count(*) FROM tunnel_api.finding WHERE counted").fetchone()
        assert counted is not None
        assert counted[0] > 0.99 * FINDINGS
        expect(row.get_by_role("cell", name=str(counted[0]), exact=True)).to_be_visible()


@pytest.fixture
def page(ines_context: BrowserContext, database: psycopg.Connection) -> Iterator[Page]:
    """Page of the survey at the desk of an inspector; at the end nothing went wrong in it."""
    with opened(ines_context, f"/#/{NAME}") as page:
        yield page
