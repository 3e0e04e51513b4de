"""The page in Chromium: links from elsewhere, and PostgreSQL that restarts under an open page."""

from __future__ import annotations

import psycopg
from playwright.sync_api import Browser, BrowserContext, Page, expect
from support.desk_page import DESKTOP, PATIENCE, enter, forgive, opened, sign_in
from support.desk_server import DeskServer
from support.example_survey import NAME
from web.conftest import PASSWORD


def a_leak(database: psycopg.Connection) -> int:
    row = database.execute("SELECT min(id) FROM tunnel_api.leak WHERE survey = %s AND review = 'open'", [NAME]).fetchone()
    assert row is not None
    return int(row[0])


def test_a_link_in_another_page_opens_the_finding(
    ines_context: BrowserContext, server: DeskServer, database: psycopg.Connection
) -> None:
    """As from an e-mail in a browser: the strict cookie is not sent with it, and yet the person stays signed in."""
    key = a_leak(database)
    page = ines_context.new_page()
    link = f'<a href="{server.address}/#/{NAME}/finding/{key}">leak</a>'
    page.route("http://mail.example.org/", lambda route: route.fulfill(content_type="text/html", body=link))
    page.goto("http://mail.example.org/")
    page.get_by_role("link").click()
    expect(page.locator("#panel-body")).to_contain_text(str(key))
    page.close()


def test_a_link_in_another_page_leads_to_the_sign_in_and_then_to_the_finding(
    chrome: Browser, server: DeskServer, database: psycopg.Connection
) -> None:
    key = a_leak(database)
    context = chrome.new_context(viewport=DESKTOP)
    context.set_default_timeout(PATIENCE)
    page = context.new_page()
    link = f'<a href="{server.address}/#/{NAME}/finding/{key}">leak</a>'
    page.route("http://mail.example.org/", lambda route: route.fulfill(content_type="text/html", body=link))
    page.goto("http://mail.example.org/")
    page.get_by_role("link").click()
    sign_in(page, "viola_web", PASSWORD)
    expect(page.locator("#panel-body")).to_contain_text(str(key))
    context.close()


def test_a_restart_of_postgresql_loses_no_verdict(chrome: Browser, server: DeskServer, database: psycopg.Connection) -> None:
    """All connections are cut under the page. The verdict is not shown as saved; after the sign-in it is sent."""
    key = a_leak(database)
    context = chrome.new_context(viewport=DESKTOP, base_url=server.address)
    context.set_default_timeout(PATIENCE)
    first = context.new_page()
    first.goto(f"/login#/{NAME}/finding/{key}")
    sign_in(first, "ivo_web", PASSWORD)
    expect(first.locator("#panel-body")).to_contain_text(str(key))
    first.close()
    with opened(context, f"/#/{NAME}/finding/{key}") as page:
        expect(page.locator("#limits")).to_contain_text("Inspected: 95.0")  # the last answer that the page waits for
        page.wait_for_load_state("networkidle")
        database.execute(
            "SELECT pg_terminate_backend(pid, 5000) FROM pg_stat_activity"
            " WHERE datname = current_database() AND usename = 'ivo_web'"
        )
        page.keyboard.press("c")
        expect(page.get_by_label("Password")).to_be_visible()
        assert reviewed(database, key) == ("open", None)
        sign_in(page, "ivo_web", PASSWORD)
        expect(page.locator("#state")).to_contain_text("Saved.")
        assert reviewed(database, key) == ("confirmed", "ivo_web")
        forgive(page, "status of (401|503)")
    context.close()


def hold(page: Page, *names: str) -> None:
    """Make caches as of stretches that were taken offline."""
    page.evaluate("(names) => Promise.all(names.map((name) => caches.open(name)))", names)


def held(page: Page) -> list[str]:
    return page.evaluate("caches.keys()")


def test_a_user_whose_name_begins_with_that_of_another_sees_nothing(chrome: Browser, server: DeskServer) -> None:
    """Names of users may have full stops: viola_web.b took a stretch before."""
    context = chrome.new_context(base_url=server.address, viewport=DESKTOP)
    enter(context, "viola_web", PASSWORD)
    with opened(context, f"/#/{NAME}") as page:
        now = page.evaluate("Date.now()")
        own, other = f"tunneldb.stretch.viola_web.{now}", f"tunneldb.stretch.viola_web.b.{now}"
        hold(page, own, other, "tunneldb.shell.viola_web", "tunneldb.shell.viola_web.b")
        page.reload()
        expect(page.locator("#panel-body")).to_be_visible()
        page.wait_for_function("caches.keys().then((names) => names.length === 2)")
        assert sorted(held(page)) == ["tunneldb.shell.viola_web", own]
    context.close()


def test_sign_out_after_the_session_has_ended_removes_what_is_held(chrome: Browser, server: DeskServer) -> None:
    """The person who hands on the tablet sees the sign-in form, and nothing is left."""
    context = chrome.new_context(base_url=server.address, viewport=DESKTOP)
    enter(context, "viola_web", PASSWORD)
    with opened(context, f"/#/{NAME}") as page:
        expect(page.locator("#limits")).to_contain_text("Inspected: 95.0")
        page.wait_for_load_state("networkidle")
        hold(page, f"tunneldb.stretch.viola_web.{page.evaluate('Date.now()')}")
        context.clear_cookies()
        page.get_by_role("button", name="Sign out").click()
        expect(page.get_by_label("Password")).to_be_visible()
        assert held(page) == []
        forgive(page, "status of 401")
    context.close()


def reviewed(database: psycopg.Connection, key: int) -> tuple[str, str | None] | None:
    return database.execute("SELECT review, reviewed_by FROM tunnel_api.finding WHERE id = %s", [key]).fetchone()
