"""Who may come in, and what a session is worth."""

from __future__ import annotations

import psycopg
import pytest
from starlette.testclient import TestClient
from web.conftest import PASSWORD, SignIn, sign_in

from tunneldb.web.app import create_app
from tunneldb.web.config import Desk
from tunneldb.web.rate_limit import MAX_FAILURES, PERIOD, RateLimit
from tunneldb.web.sessions import Sessions, open_for, open_own


def test_role_and_password_let_in_with_a_strict_cookie(client: TestClient) -> None:
    answer = sign_in(client, "viola_web")
    assert (answer.status_code, answer.headers["location"]) == (303, "/")
    cookie = answer.headers["set-cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=strict" in cookie
    assert PASSWORD not in cookie
    assert client.get("/api/surveys").status_code == 200


def test_cookie_is_for_tls_only_where_there_is_tls(logins: None, dsn: str, example: str) -> None:
    desk = Desk(dsn, None, loopback=False, secure=True)
    with TestClient(create_app(desk), base_url="https://desk.example.org", follow_redirects=False) as browser:
        assert "Secure" in sign_in(browser, "viola_web").headers["set-cookie"]


@pytest.mark.parametrize(
    ("user", "password"),
    [("viola_web", "wrong"), ("nobody", PASSWORD), ("viola_web", ""), ("", PASSWORD), ("nemo_web", PASSWORD),
     ("viola_web' --", PASSWORD),     ("viola_web dbname=postgres", PASSWORD), ("v" * 5000, PASSWORD)],
)  # fmt: skip
def test_others_stay_outside(client: TestClient, user: str, password: str) -> None:
    answer = sign_in(client, user, password)
    assert answer.status_code == 403
    assert "Not signed in" in answer.text
    assert client.get("/api/surveys").status_code == 401


def test_a_server_that_trusts_is_no_way_in(client: TestClient, desk: Desk) -> None:
    """The owner of the database is let in by its socket, whatever the password: not by the desk."""
    with psycopg.connect(desk.dsn) as conn:
        (owner,) = conn.execute("SELECT current_user").fetchone()  # type: ignore[misc]
    answer = sign_in(client, owner, "anything")
    assert answer.status_code == 403
    assert "does not ask for passwords" in answer.text


def test_form_of_another_page_is_refused(client: TestClient) -> None:
    client.get("/login")
    answer = client.post("/login", data={"user": "viola_web", "password": PASSWORD, "csrf": "guess"})
    assert answer.status_code == 403
    assert client.get("/api/surveys").status_code == 401


def test_guessing_is_slowed_down(client: TestClient) -> None:
    for _ in range(MAX_FAILURES):
        assert sign_in(client, "viola_web", "wrong").status_code == 403
    assert sign_in(client, "viola_web").status_code == 429


def test_failures_are_forgotten_after_a_while() -> None:
    now = [0.0]
    limit = RateLimit(lambda: now[0])
    for _ in range(MAX_FAILURES):
        limit.failed("a")
    assert limit.refuses("a", "b")
    assert not limit.refuses("b")
    now[0] = PERIOD + 1
    assert not limit.refuses("a")


def test_session_ends_without_requests(logins: None, dsn: str, example: str) -> None:
    now = [0.0]
    sessions = Sessions(60.0, lambda: now[0])
    session = sessions.begin(open_for(dsn, "viola_web", PASSWORD), None)
    now[0] = 59.0
    assert sessions.find(session.key) is session
    now[0] = 120.0
    assert sessions.find(session.key) is None
    assert session.idle.empty()


def test_signing_out_ends_the_session(signed_in: SignIn) -> None:
    browser = signed_in("viola_web")
    cookie = browser.cookies["tunneldb_session"]
    assert browser.post("/logout").status_code == 200
    browser.cookies.set("tunneldb_session", cookie)
    assert browser.get("/api/surveys").status_code == 401


def test_lost_connection_ends_a_session_with_a_password(signed_in: SignIn, desk: Desk) -> None:
    browser = signed_in("viola_web")
    _cut(desk.dsn, "viola_web")
    answers = [browser.get("/api/surveys").status_code for _ in range(6)]
    assert set(answers) <= {503, 401}
    assert answers[-1] == 401


def test_embedded_server_is_entered_by_a_token_of_one_use(dsn: str, example: str) -> None:
    desk = Desk(dsn, "secret-token")
    with TestClient(create_app(desk), base_url="http://localhost:8080", follow_redirects=False) as browser:
        assert browser.get("/enter?token=wrong").status_code == 403
        assert browser.get("/enter?token=secret-token").headers["location"] == "/"
        assert browser.get("/api/surveys").status_code == 200
        assert browser.get("/enter?token=secret-token").status_code == 403
        assert browser.get("/enter?token=").status_code == 403
        _cut(dsn, None)
        answers = [browser.get("/api/surveys").status_code for _ in range(8)]
        assert answers[-1] == 200


def test_desk_of_this_machine_answers_to_its_names_only(dsn: str, example: str) -> None:
    with TestClient(create_app(Desk(dsn, "token")), base_url="http://evil.example.org") as browser:
        assert browser.get("/healthz").status_code == 421


def test_programs_sign_in_by_http_basic_to_read(client: TestClient) -> None:
    assert client.get("/collections", auth=("viola_web", PASSWORD)).status_code == 200
    refused = client.get("/collections", auth=("viola_web", "wrong"))
    assert (refused.status_code, refused.headers["www-authenticate"][:5]) == (401, "Basic")
    assert client.get("/collections", headers={"Authorization": "Basic ???"}).status_code == 401
    assert client.post("/api/findings/1/undo", auth=("ines_web", PASSWORD)).status_code == 401


def test_programs_share_a_session_by_their_password(client: TestClient, desk: Desk) -> None:
    for _ in range(3):
        assert client.get("/collections", auth=("viola_web", PASSWORD)).status_code == 200
    with psycopg.connect(desk.dsn) as conn:
        row = conn.execute("SELECT count(*) FROM pg_stat_activity WHERE usename = 'viola_web' AND datname = current_database()")
        assert row.fetchone() == (3,)


def _cut(dsn: str, user: str | None) -> None:
    """Cut the connections of a role to the database, as a restart does."""
    with open_own(dsn) as conn:
        conn.execute(
            "SELECT pg_terminate_backend(pid, 5000) FROM pg_stat_activity WHERE datname = current_database()"
            " AND pid <> pg_backend_pid() AND backend_type = 'client backend' AND (%s::text IS NULL OR usename = %s)",
            [user, user],
        )
