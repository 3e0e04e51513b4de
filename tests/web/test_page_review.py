"""Review by keys in Chromium: after each of them the database holds what the page says.

The server or the network goes away during a verdict: nothing is lost, and nothing is called saved that is not.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import psycopg
import pytest
from playwright.sync_api import APIResponse, BrowserContext, Page, Route, expect
from support.desk_page import forgive, opened, sign_in, tab
from support.desk_server import DeskServer
from support.example_survey import NAME
from web.conftest import PASSWORD

Contexts = Callable[..., BrowserContext]


def stored(database: psycopg.Connection, key: int) -> tuple[Any, ...]:
    """Return review, kind, remark and reviewer of a finding."""
    row = database.execute("SELECT review, kind, remark, reviewed_by FROM tunnel_api.finding WHERE id = %s", [key]).fetchone()
    assert row is not None
    return row


def shows(page: Page, key: int, review: str | None = None) -> None:
    """Wait until a finding is shown, with its review, and nothing is under way."""
    expect(page.locator(".finding-head")).to_contain_text(re.compile(f"{review or ''}.*no. {key}$"))
    expect(page.locator(".review:not([aria-busy])")).to_be_attached()


def says(page: Page, text: str) -> None:
    expect(page.locator("#state")).to_contain_text(text)


@pytest.fixture
def review(page: Page) -> Page:
    """The review, at its first finding."""
    tab(page, "Review")
    shows(page, 1)
    return page


def test_keys_write_verdicts_and_step(review: Page, database: psycopg.Connection) -> None:
    """C, R, N, P, Z and O in the order of probability; progress counts."""
    page = review
    page.keyboard.press("c")
    says(page, "Saved. Finding 1: confirmed.")
    assert stored(database, 1) == ("confirmed", "leak", None, "ines_web")
    shows(page, 2)
    page.keyboard.press("R")
    says(page, "Saved. Finding 2: rejected.")
    assert stored(database, 2) == ("rejected", "leak", None, "ines_web")
    shows(page, 5)
    expect(page.locator(".pace")).to_contain_text("5 of 9 reviewed")
    page.keyboard.press("n")
    shows(page, 7)
    page.keyboard.press("p")
    shows(page, 5)
    page.keyboard.press("ArrowRight")
    shows(page, 7)
    page.keyboard.press("ArrowLeft")
    shows(page, 5)
    page.keyboard.press("z")
    says(page, "Finding 2: undone")
    assert stored(database, 2)[0] == "open"
    shows(page, 2, "open")
    page.keyboard.press("z")
    says(page, "Finding 1: undone")
    assert stored(database, 1)[0] == "open"
    page.keyboard.press("z")
    says(page, "There is no review to undo.")
    shows(page, 1, "open")
    page.keyboard.press("c")
    shows(page, 2)
    page.get_by_role("tab", name="Finding").click()
    page.goto(f"/#/{NAME}/finding/1")
    shows(page, 1, "confirmed")
    page.keyboard.press("o")
    says(page, "Saved. Finding 1: open.")
    assert stored(database, 1)[0] == "open"
    shows(page, 1, "open")


def test_keys_set_kinds_and_remarks(review: Page, database: psycopg.Connection) -> None:
    """1–9, J and D; M and Enter, Escape; a remark that was typed is written with the verdict."""
    page = review
    kinds = [
        code
        for (code,) in database.execute(
            "SELECT code FROM tunnel_api.finding_kind WHERE active AND code NOT IN ('joint', 'dark') ORDER BY position, code"
        )
    ][:9]
    assert len(kinds) == 9
    for key, kind in [
        *((str(n), kind) for n, kind in enumerate(kinds, start=1) if kind != "leak"),
        ("j", "joint"),
        ("D", "dark"),
    ]:
        page.keyboard.press(key)
        says(page, f"Saved. Finding 1: {kind}.")
        assert stored(database, 1)[:2] == ("open", kind)
        shows(page, 1)
    expect(page.get_by_role("combobox", name="Kind")).to_have_value("dark")
    page.keyboard.press("m")
    remark = page.get_by_role("textbox", name="Remark")
    expect(remark).to_be_focused()
    page.keyboard.type("dry in c and r")
    page.keyboard.press("Escape")
    expect(remark).to_have_value("")
    page.keyboard.press("m")
    page.keyboard.type("drips after rain")
    page.keyboard.press("Enter")
    says(page, "Saved. Finding 1: drips after rain.")
    assert stored(database, 1) == ("open", "dark", "drips after rain", "ines_web")
    expect(remark).not_to_be_focused()
    page.keyboard.press("z")
    says(page, "Finding 1: undone")
    assert stored(database, 1)[2] is None
    shows(page, 1)
    page.keyboard.press("m")
    page.keyboard.type("typed")
    page.get_by_role("button", name="Confirm").click()
    says(page, "Saved. Finding 1: confirmed, typed.")
    assert stored(database, 1) == ("confirmed", "dark", "typed", "ines_web")


def test_the_selection_is_that_of_the_database(review: Page, database: psycopg.Connection) -> None:
    """Order, kind, stretch and area decide what is shown."""
    page = review
    page.locator("summary", has_text="Selection").click()
    page.get_by_role("combobox", name="Order").select_option("chainage")
    keys = database.execute(
        "SELECT id FROM tunnel_api.finding WHERE survey = %s AND review = 'open' AND state = 'open' ORDER BY chainage_from",
        [NAME],
    ).fetchall()
    assert len(keys) == 6
    for (key,) in keys:
        shows(page, key)
        page.get_by_role("button", name="Next").click()
    says(page, "That was the last finding of this selection.")
    page.get_by_role("checkbox", name="Dry dark area", exact=True).check()
    expect(page.locator(".pace")).to_contain_text("0 of 1 reviewed")
    shows(page, 9)
    page.get_by_role("checkbox", name="Dry dark area", exact=True).uncheck()
    expect(page.locator(".pace")).to_contain_text("3 of 9 reviewed")
    page.get_by_label("From", exact=True).fill("12+430")
    page.get_by_label("From", exact=True).press("Enter")
    expect(page.locator(".pace")).to_contain_text("1 of 3 reviewed")
    page.get_by_label("To", exact=True).fill("12+300")
    page.get_by_label("To", exact=True).press("Enter")
    expect(page.locator(".filter [role=alert]")).to_contain_text("the smaller one first")


@pytest.mark.parametrize(("key", "button", "expected"), [(1, "Keep theirs", "rejected"), (2, "Write mine", "confirmed")])
def test_two_inspectors_at_once(
    page: Page, context_of: Contexts, database: psycopg.Connection, key: int, button: str, expected: str
) -> None:
    """Nothing is written over the verdict of another person unless that is asked for."""
    page.goto(f"/#/{NAME}/finding/{key}")
    shows(page, key, "open")
    with opened(context_of("ivo_web"), f"/#/{NAME}/finding/{key}") as other:
        shows(other, key, "open")
        other.get_by_role("button", name="Reject").click()
        says(other, f"Saved. Finding {key}: rejected.")
    page.keyboard.press("c")
    box = page.get_by_role("alertdialog", name="Conflict")
    expect(box).to_contain_text(f"Not saved. ivo_web has changed finding {key} in the meantime: it is rejected")
    expect(box).to_contain_text("Yours: review: confirmed.")
    says(page, "Not saved")
    assert stored(database, key) == ("rejected", "leak", None, "ivo_web")
    page.get_by_role("button", name=button).click()
    expect(box).to_be_hidden()
    shows(page, key, expected)
    assert stored(database, key)[0] == expected
    assert stored(database, key)[3] == ("ivo_web" if expected == "rejected" else "ines_web")
    forgive(page, "status of 409")


def test_a_viewer_looks_and_cannot_write(context_of: Contexts, database: psycopg.Connection) -> None:
    """Buttons are disabled, keys say why, and drawing is off."""
    with opened(context_of("viola_web"), f"/#/{NAME}?tab=review") as page:
        shows(page, 1)
        for name in ("Confirm", "Reject", "Open", "Undo"):
            expect(page.locator(".verdicts").get_by_role("button", name=name)).to_be_disabled()
        expect(page.get_by_role("textbox", name="Remark")).to_be_disabled()
        page.keyboard.press("c")
        says(page, "A viewer cannot review.")
        page.keyboard.press("n")
        shows(page, 2)
        panel = tab(page, "Draw")
        expect(panel).to_contain_text("A viewer cannot draw")
        for name in ("Polygon", "Line", "Point", "Redraw", "Split", "Merge", "Delete"):
            expect(panel.get_by_role("button", name=name)).to_be_disabled()
        assert stored(database, 1) == ("open", "leak", None, None)


@pytest.fixture
def finding(page: Page) -> Page:
    """The page of finding 1."""
    page.goto(f"/#/{NAME}/finding/1")
    expect(page.locator(".finding-head")).to_contain_text("no. 1")
    return page


def verdict(database: psycopg.Connection) -> str:
    (value,) = database.execute("SELECT review FROM tunnel_api.finding WHERE id = 1").fetchone()  # type: ignore[misc]
    return str(value)


WAITS = "Recorded on this device, not in the database yet: 1."


def test_a_verdict_waits_for_the_network(finding: Page, database: psycopg.Connection) -> None:
    """It is sent by itself, and can be discarded."""
    page = finding
    alert = page.locator("#alerts")
    page.context.set_offline(True)
    page.keyboard.press("c")
    expect(alert).to_contain_text(WAITS)
    says(page, "Recorded on this device. Finding 1: confirmed.")
    expect(page.locator(".finding-head")).to_contain_text("confirmed")
    expect(page.locator(".finding-head")).to_contain_text("Recorded on this device, not in the database yet.")
    assert verdict(database) == "open"
    page.context.set_offline(False)
    says(page, "Saved. Finding 1: confirmed.")
    assert verdict(database) == "confirmed"
    expect(alert).to_be_empty()
    shows(page, 1, "confirmed")
    expect(page.locator(".finding-head")).not_to_contain_text("Recorded")
    page.context.set_offline(True)
    page.keyboard.press("r")
    expect(alert).to_contain_text(WAITS)
    alert.locator("summary").click()
    expect(alert).to_contain_text("Finding 1: rejected")
    alert.get_by_role("button", name="Discard").click()
    expect(alert).to_be_empty()
    page.context.set_offline(False)
    page.reload()
    shows(page, 1, "confirmed")
    assert verdict(database) == "confirmed"
    forgive(page, "ERR_INTERNET_DISCONNECTED")


def test_undo_takes_a_verdict_back_that_waits(finding: Page, database: psycopg.Connection) -> None:
    page = finding
    page.context.set_offline(True)
    page.keyboard.press("r")
    expect(page.locator("#alerts")).to_contain_text(WAITS)
    page.keyboard.press("z")
    says(page, "Finding 1: undone; the database did not have it yet.")
    shows(page, 1, "open")
    expect(page.locator("#alerts")).to_be_empty()
    page.context.set_offline(False)
    page.reload()
    shows(page, 1, "open")
    assert verdict(database) == "open"
    forgive(page, "ERR_INTERNET_DISCONNECTED")


def test_a_verdict_of_the_last_visit_meets_that_of_another_person(finding: Page, database: psycopg.Connection) -> None:
    """It is not written over the other one, and stays on offer until the person decides."""
    page = finding
    alert = page.locator("#alerts")
    page.route("**/api/findings/1", lambda route: route.abort() if route.request.method == "PATCH" else route.fallback())
    page.keyboard.press("c")
    expect(alert).to_contain_text(WAITS)
    database.execute("UPDATE tunnel.finding SET review = 'rejected', reviewed_by = 'ivo_web', reviewed_at = now() WHERE id = 1")
    page.unroute("**/api/findings/1")
    page.goto("/#/")
    page.reload()
    expect(alert).to_contain_text(f"{WAITS} Your decision is needed: 1.")
    assert verdict(database) == "rejected"
    alert.locator("summary").click()
    expect(alert).to_contain_text("In the database: rejected, Leak, no remark, by ivo_web. Yours: review: confirmed.")
    alert.get_by_role("link", name="Finding 1: confirmed").click()
    shows(page, 1, "rejected")
    page.reload()
    alert.locator("summary").click()
    alert.get_by_role("button", name="Keep theirs").click()
    expect(alert).to_be_empty()
    page.reload()
    shows(page, 1, "rejected")
    expect(alert).to_be_empty()
    assert verdict(database) == "rejected"
    forgive(page, "status of 409|ERR_FAILED")


def test_a_verdict_survives_a_restart_of_the_server(finding: Page, database: psycopg.Connection, server: DeskServer) -> None:
    """The restart ends all sessions: after the sign-in the finding is shown, and the verdict is sent."""
    page = finding
    server.stop()
    page.keyboard.press("c")
    expect(page.locator("#alerts")).to_contain_text(WAITS)
    assert "Saved." not in page.locator("#state").inner_text()
    assert verdict(database) == "open"
    server.start()
    expect(page.get_by_label("Password")).to_be_visible()
    assert verdict(database) == "open"
    sign_in(page, "ines_web", PASSWORD)
    shows(page, 1, "confirmed")
    expect(page.locator("#alerts")).to_be_empty()
    assert verdict(database) == "confirmed"
    page.reload()
    shows(page, 1, "confirmed")
    expect(page.locator("#alerts")).to_be_empty()
    forgive(page, "ERR_CONNECTION_REFUSED|status of 401|ERR_EMPTY_RESPONSE|ERR_CONNECTION_RESET")


def test_a_verdict_that_is_written_while_its_finding_is_read_is_shown(finding: Page, database: psycopg.Connection) -> None:
    """The finding is read before the verdict, and the answer comes after it: what is shown is what the database has."""
    page = finding
    page.route("**/api/findings/1", lambda route: route.abort())
    page.keyboard.press("c")
    expect(page.locator("#alerts")).to_contain_text(WAITS)
    page.unroute("**/api/findings/1")
    reads: list[tuple[Route, APIResponse]] = []
    writes: list[Route] = []

    def hold(route: Route) -> None:
        if route.request.method == "PATCH":
            writes.append(route)
        elif reads:
            route.continue_()
        else:
            reads.append((route, route.fetch()))

    page.route("**/api/findings/1", hold)
    page.reload()
    while not (reads and writes):
        page.wait_for_timeout(50)
    with page.expect_response(lambda response: response.request.method == "PATCH"):
        writes[0].continue_()
    assert verdict(database) == "confirmed"
    expect(page.locator("#alerts")).to_be_empty()
    route, response = reads[0]
    assert response.json()["review"] == "open"
    route.fulfill(response=response)
    shows(page, 1, "confirmed")
    page.unroute("**/api/findings/1")
    forgive(page, "ERR_FAILED")


def test_list_asked_for_while_a_finding_is_read_is_read_after_it(page: Page) -> None:
    """The review was chosen before the finding of a link had come: the list is read, and is not called empty."""
    held: list[Route] = []
    page.route("**/api/findings/5", lambda route: held.append(route))
    with page.expect_request("**/api/findings/5"):
        page.goto(f"/#/{NAME}/finding/5")
    expect(tab(page, "Review")).to_contain_text("The list of findings has not been read.")
    held[0].continue_()
    expect(page.locator(".pace")).to_contain_text("of 9 reviewed")
    page.unroute("**/api/findings/5")
