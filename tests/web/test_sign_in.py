"""Who may come in, and what a session is worth."""

from __future__ import annotations

import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor

import psycopg
import pytest
from starlette.testclient import TestClient
from support.desk_page import token_of
from web.conftest import PASSWORD, SignIn, sign_in

from tunneldb.web.app import create_app
from tunneldb.web.config import Desk
from tunneldb.web.pages import STATIC
from tunneldb.web.rate_limit import MAX_ADDRESS_FAILURES, MAX_FAILURES, PERIOD, RateLimit
from tunneldb.web.sessions import CONNECTIONS, MAX_OF_USER, Sessions, SignedOutError, open_for, open_own


def test_the_service_worker_is_for_the_whole_desk(client: TestClient) -> None:
    answer = client.get("/worker.js")
    assert (answer.status_code, answer.headers["cache-control"], answer.headers["service-worker-allowed"]) == (
        200,
        "no-cache",
        "/",
    )
    assert answer.headers["content-type"].startswith("text/javascript")


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


def test_a_second_form_leaves_the_first_one_valid(client: TestClient) -> None:
    first, _ = client.get("/login").text, client.get("/login")
    token = token_of(first)
    assert client.post("/login", data={"user": "viola_web", "password": PASSWORD, "csrf": token}).status_code in (200, 303)
    assert client.get("/api/surveys").status_code == 200


def test_guessing_is_slowed_down(client: TestClient) -> None:
    for _ in range(MAX_FAILURES):
        assert sign_in(client, "viola_web", "wrong").status_code == 403
    assert sign_in(client, "viola_web").status_code == 429


def test_failures_are_forgotten_after_a_while() -> None:
    now = [0.0]
    limit = RateLimit(lambda: now[0])
    for _ in range(MAX_FAILURES):
        assert limit.attempt("ines", "10.0.0.1")
    assert not limit.attempt("ines", "10.0.0.1")
    assert limit.attempt("ines", "10.0.0.2")
    assert limit.attempt("ivo", "10.0.0.1")
    now[0] = PERIOD + 1
    assert limit.attempt("ines", "10.0.0.1")


def test_success_is_no_failure() -> None:
    limit = RateLimit(lambda: 0.0)
    for _ in range(3 * MAX_FAILURES):
        assert limit.attempt("ines", "10.0.0.1")
        limit.succeeded("ines", "10.0.0.1")


def test_one_address_cannot_try_all_users() -> None:
    limit = RateLimit(lambda: 0.0)
    passed = sum(limit.attempt(f"user {n}", "10.0.0.1") for n in range(100))
    assert passed == MAX_ADDRESS_FAILURES


def test_attempts_at_the_same_time_are_counted(client: TestClient) -> None:
    """The database answers later than all of them have come."""
    token = token_of(client.get("/login").text)

    def guess(n: int) -> int:
        return client.post("/login", data={"user": "ivo_web", "password": f"guess {n}", "csrf": token}).status_code

    with ThreadPoolExecutor(30) as threads:
        answers = Counter(threads.map(guess, range(30)))
    assert answers[303] == 0
    assert answers[429] + answers[403] == 30


@pytest.mark.parametrize(
    ("kind", "body"),
    [("multipart/form-data; boundary=XX; charset=punycode",
      b'--XX\r\nContent-Disposition: form-data; name="user"\r\n\r\n-' + b"a" * 1_000_000 + b"\r\n--XX--\r\n"),
     ("application/x-www-form-urlencoded", b"&" * 1_900_000), ("application/x-www-form-urlencoded", b"a=1&" * 100),
     ("application/x-www-form-urlencoded", b"user=\xff\xfe&csrf=%ff"), ("text/plain", b"user=a")],
)  # fmt: skip
def test_other_forms_are_refused_at_once(client: TestClient, kind: str, body: bytes) -> None:
    start = time.perf_counter()
    answer = client.post("/login", content=body, headers={"Content-Type": kind})
    assert answer.status_code == 403
    assert time.perf_counter() - start < 5.0  # decoding it takes 13 s


def test_a_user_has_so_many_sessions_at_most(logins: None, dsn: str, example: str) -> None:
    sessions = Sessions(60.0)
    made = [sessions.begin(open_for(dsn, "viola_web", PASSWORD), None) for _ in range(MAX_OF_USER + 2)]
    assert [sessions.find(one.key) is not None for one in made] == [False] * 2 + [True] * MAX_OF_USER
    with psycopg.connect(dsn) as conn:
        row = conn.execute("SELECT count(*) FROM pg_stat_activity WHERE usename = 'viola_web' AND datname = current_database()")
        assert row.fetchone() == (MAX_OF_USER * CONNECTIONS,)
    sessions.close()


def test_a_session_ends_although_it_is_used(logins: None, dsn: str, example: str) -> None:
    now = [0.0]
    sessions = Sessions(60.0, lambda: now[0])
    session = sessions.begin(open_for(dsn, "viola_web", PASSWORD), None, 100.0)
    for at in (50.0, 99.0):
        now[0] = at
        assert sessions.find(session.key) is session
    now[0] = 101.0
    assert sessions.find(session.key) is None


def test_what_waits_for_a_session_that_ends_is_not_done(logins: None, dsn: str, example: str) -> None:
    sessions = Sessions(60.0)
    session = sessions.begin(open_for(dsn, "ines_web", PASSWORD), None)
    with session.connection() as lent:
        sessions.end(session)
        with pytest.raises(SignedOutError), session.connection():
            pass
    assert lent.closed


def test_signing_in_again_ends_the_session_before(signed_in: SignIn, desk: Desk) -> None:
    browser = signed_in("viola_web")
    before = browser.cookies["tunneldb_session"]
    assert sign_in(browser, "ines_web").status_code == 303
    assert desk.sessions.find(before) is None


def test_a_browser_that_comes_from_a_file_gets_a_page_that_leads_on(dsn: str, example: str) -> None:
    with TestClient(create_app(Desk(dsn, "token")), base_url="http://localhost:8080", follow_redirects=False) as browser:
        answer = browser.get("/enter?token=token", headers={"Sec-Fetch-Site": "cross-site"})
        assert (answer.status_code, f"{STATIC}/again.js" in answer.text) == (200, True)
        assert browser.get("/api/surveys").status_code == 200


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
