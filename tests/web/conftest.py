"""A desk on the example survey, and people who sign in with passwords."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx2
import psycopg
import pytest
from playwright.sync_api import Browser, BrowserContext, Page, sync_playwright
from psycopg import sql
from starlette.testclient import TestClient
from support.databases import Copies
from support.desk_page import DESKTOP, enter, opened, token_of
from support.desk_server import DeskServer
from support.example_survey import NAME, add_later_survey

from tunneldb.web.app import create_app
from tunneldb.web.config import Desk

PASSWORD = "correct horse"

LOGINS = {
    "viola_web": "tunnel_viewer",
    "ines_web": "tunnel_inspector",
    "ivo_web": "tunnel_inspector",
    "olga_web": "tunnel_operator",
    "nemo_web": None,
}
"""Roles that sign in, and the group of each."""


@pytest.fixture(scope="session")
def logins(server_dsn: str, installed: str, _own_home: Path) -> None:
    """Make roles with passwords, for which the server asks them."""
    with psycopg.connect(server_dsn, autocommit=True) as conn:
        for name, group in LOGINS.items():
            conn.execute(sql.SQL("CREATE ROLE {} LOGIN PASSWORD {}").format(sql.Identifier(name), sql.Literal(PASSWORD)))
            if group is not None:
                conn.execute(sql.SQL("GRANT {} TO {}").format(sql.Identifier(group), sql.Identifier(name)))
        (path,) = conn.execute("SHOW hba_file").fetchone()  # type: ignore[misc]
        rules = Path(path)
        rules.write_text(f"local all {','.join(LOGINS)} scram-sha-256\n" + rules.read_text())
        conn.execute("SELECT pg_reload_conf()")


@pytest.fixture
def desk(logins: None, dsn: str, example: str) -> Desk:
    """State of a desk at which people sign in with passwords."""
    return Desk(dsn, None, loopback=False)


@pytest.fixture
def client(desk: Desk) -> Iterator[TestClient]:
    """A browser that nobody has signed in with."""
    with TestClient(create_app(desk), base_url="http://desk.example.org", follow_redirects=False) as browser:
        yield browser


SignIn = Callable[..., TestClient]


@pytest.fixture
def signed_in(desk: Desk) -> Iterator[SignIn]:
    """Return a function that signs somebody in, in a browser of their own."""
    browsers: list[TestClient] = []

    def enter(user: str) -> TestClient:
        browser = TestClient(create_app(desk), base_url="http://desk.example.org", follow_redirects=False)
        browsers.append(browser)
        assert sign_in(browser, user).status_code == 303
        page = browser.get("/")
        assert page.status_code == 200
        browser.headers["X-CSRF-Token"] = page.text.partition('name="csrf" content="')[2].partition('"')[0]
        return browser

    yield enter
    for browser in browsers:
        browser.close()
    desk.sessions.close()


def sign_in(browser: TestClient, user: str, password: str = PASSWORD) -> httpx2.Response:
    """Fill in the form."""
    token = token_of(browser.get("/login").text)
    return browser.post("/login", data={"user": user, "password": password, "csrf": token})


@pytest.fixture(scope="module")
def survey_dsn(logins: None, copies: Copies, example_template: str) -> Iterator[str]:
    """DSN of the database that the tests of a module share: the example, and a later survey of its tunnel."""
    with copies.copy(example_template) as dsn:
        with psycopg.connect(dsn) as conn:
            add_later_survey(conn)
            conn.execute("CREATE TABLE public.as_detected AS SELECT id, review, kind_override, wet, remark FROM tunnel.finding")
        yield dsn


@pytest.fixture
def database(survey_dsn: str) -> Iterator[psycopg.Connection]:
    """Connection to the database under the desk, whose detected findings are as they were before the tests."""
    with psycopg.connect(survey_dsn, autocommit=True) as conn:
        conn.execute("DELETE FROM tunnel.finding WHERE id NOT IN (SELECT id FROM public.as_detected)")
        conn.execute(
            "UPDATE tunnel.finding f SET review = d.review, kind_override = d.kind_override, wet = d.wet, remark = d.remark,"
            " reviewed_by = NULL, reviewed_at = NULL FROM public.as_detected d WHERE d.id = f.id"
        )
        yield conn


@pytest.fixture(scope="module")
def server(survey_dsn: str) -> Iterator[DeskServer]:
    """The desk as a server."""
    desk = DeskServer(survey_dsn)
    yield desk
    desk.stop()


@pytest.fixture(scope="module")
def chrome(chromium: Path) -> Iterator[Browser]:
    """Chromium."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def context_of(chrome: Browser, server: DeskServer) -> Iterator[Callable[..., BrowserContext]]:
    """Return a function that returns the browser in which somebody is signed in, the same one each time."""
    contexts: dict[str, BrowserContext] = {}

    def make(user: str, **settings: Any) -> BrowserContext:
        key = f"{user} {settings}"
        if key not in contexts:
            contexts[key] = chrome.new_context(base_url=server.address, **{"viewport": DESKTOP, **settings})
            enter(contexts[key], user, PASSWORD)
        return contexts[key]

    yield make
    for context in contexts.values():
        context.close()


@pytest.fixture(scope="module")
def ines_context(context_of: Callable[..., BrowserContext]) -> BrowserContext:
    """Browser in which an inspector is signed in."""
    return context_of("ines_web")


@pytest.fixture
def page(ines_context: BrowserContext, database: psycopg.Connection) -> Iterator[Page]:
    """Page of the example survey at the desk of an inspector; at the end nothing went wrong in it."""
    with opened(ines_context, f"/#/{NAME}") as page:
        yield page
