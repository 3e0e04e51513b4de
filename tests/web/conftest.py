"""A desk on the example survey, and people who sign in with passwords."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import httpx
import psycopg
import pytest
from psycopg import sql
from starlette.testclient import TestClient

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


def sign_in(browser: TestClient, user: str, password: str = PASSWORD) -> httpx.Response:
    """Fill in the form."""
    form = browser.get("/login").text
    token = form.partition('name="csrf" value="')[2].partition('"')[0]
    return browser.post("/login", data={"user": user, "password": password, "csrf": token})
