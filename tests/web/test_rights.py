"""Rights of each login: attempts to do more are refused."""

from __future__ import annotations

import json

import psycopg
import pytest
from web.conftest import SignIn

from tunneldb.web.pages import STATIC
from tunneldb.web.security import HEADERS, MAX_BODY

SEEN = {"review": "open", "remark": None, "kind": "leak"}
DRAWING = {"geometry": {"type": "Point", "coordinates": [12350, 0]}, "kind": "other"}
NOTHING = {"severity": None, "width_mm": None, "remark": None}

WRITES = [
    ("PATCH", "/api/findings/1", {"seen": SEEN, "values": {"review": "confirmed"}}),
    ("POST", "/api/findings/1/undo", {}),
    ("PUT", "/api/findings/1/outline", {"geometry": {"type": "Point", "coordinates": [12350, 0]}}),
    ("POST", "/api/findings/1/split", {"line": {"type": "LineString", "coordinates": [[12300, -5], [12400, 5]]}}),
    ("POST", "/api/findings/merge", {"ids": [1, 2]}),
    ("DELETE", "/api/findings/1", None),
    ("POST", "/api/surveys/demo-2024/findings", DRAWING | NOTHING),
    ("POST", "/api/surveys/demo-2024/actions", {"finding_id": 1, "measure": "seal"}),
    ("PATCH", "/api/actions/1", {"seen": {"state": "open"}, "values": {"state": "done"}}),
    ("DELETE", "/api/actions/1", None),
]  # fmt: skip


@pytest.mark.parametrize(("method", "path", "body"), WRITES)
def test_a_viewer_cannot_write(signed_in: SignIn, conn: psycopg.Connection, method: str, path: str, body: object) -> None:
    before = conn.execute("SELECT count(*), sum(hashtext(f::text)) FROM tunnel.finding f").fetchone()
    answer = signed_in("viola_web").request(method, path, json=body)
    assert answer.status_code == 403, answer.text
    assert "no right" in answer.json()["error"]
    conn.rollback()
    assert conn.execute("SELECT count(*), sum(hashtext(f::text)) FROM tunnel.finding f").fetchone() == before


@pytest.mark.parametrize(("method", "path", "body"), WRITES)
def test_a_request_of_another_page_is_refused(signed_in: SignIn, method: str, path: str, body: object) -> None:
    browser = signed_in("ines_web")
    foreign = browser.request(method, path, json=body, headers={"Origin": "http://evil.example.org"})
    assert (foreign.status_code, foreign.json()["error"]) == (403, "the request comes from another page")
    assert browser.request(method, path, json=body, headers={"X-CSRF-Token": "guess"}).status_code == 403


PATHS = [
    "/api/surveys/demo-2024'--", "/api/surveys/nothing/ribbon", "/api/findings/0", "/api/findings/99999999999999999999999",
    "/api/surveys/demo-2024/section?chainage=nan", "/api/surveys/demo-2024/section?chainage=1e300",
    "/api/surveys/demo-2024/worklist?order=id;DROP", "/api/surveys/demo-2024/worklist?from=x",
    "/tiles/demo-2024/corrected/99/0/0.png", "/tiles/demo-2024/corrected/-1/0/0.png", "/tiles/demo-2024/secret/15/0/0.png",
    "/tiles/demo-2024/corrected/15/999999999999/0.png", "/tiles/demo-2024/findings/15/x/0.mvt", "/tiles/nothing/raw/15/1/1.png",
    f"{STATIC}/../app.py", f"{STATIC}/%2e%2e/app.py", f"{STATIC}/..%2fconfig.py", "/static/main.js",
    "/collections/pg_authid/items",
    "/collections/finding_map/items?pg_sleep(9)=1", "/collections/finding_map/items?bbox=1,2",
    "/collections/finding_map/items?limit=-1",
    "/api/findings/" + "9" * 4400, "/api/surveys?" + "&".join(f"a{n}=1" for n in range(4000)),
    "/tileMatrixSets/other", "/tiles/demo-2024/secret",
    "/api/surveys/demo-2024/rating", "/api/surveys/demo-2024/rating?elements=blocks&scheme=nothing",
    "/api/surveys/demo-2024/rating?elements=nothing&scheme=example", "/api/surveys/nothing/actions",
    "/api/surveys/demo-2024/rating/change?elements=blocks&scheme=example&version=9",
]  # fmt: skip


@pytest.mark.parametrize("path", PATHS)
def test_hostile_paths_get_one_line(signed_in: SignIn, path: str) -> None:
    answer = signed_in("viola_web").get(path)
    assert answer.status_code in (400, 404), answer.text
    assert "Traceback" not in answer.text
    assert len(answer.text.splitlines()) == 1


BODIES = [
    b"", b"{", b"[]", b"null", b'"x"', b'{"seen": 1}', b"[" * 100_000, b"\xff\xfe", b'{"a": "\\u0000"}',
    *(json.dumps(body).encode() for body in (
        {"ids": ["1"]}, {"ids": [1e99]}, {"ids": [True]},
        DRAWING | {"geometry": {"type": "Point", "coordinates": [1e308, 0]}},
        DRAWING | {"geometry": {"type": "Nothing"}},
        DRAWING | {"geometry": {"type": "Polygon", "coordinates": []}},
        {"geometry": {}, "kind": 5},
        {"line": {"type": "LineString", "coordinates": [[1]]}},
        {"seen": SEEN, "values": {"id": "9"}},
        {"seen": SEEN, "values": {"review": {"a": 1}}},
        {"seen": SEEN, "values": {"review": "\0"}},
        {"seen": SEEN, "values": {"remark": "\ud800"}},
    )),
]  # fmt: skip


@pytest.mark.parametrize("body", BODIES, ids=range(len(BODIES)))
def test_hostile_bodies_get_one_line(signed_in: SignIn, conn: psycopg.Connection, body: bytes) -> None:
    browser = signed_in("ines_web")
    before = conn.execute("SELECT count(*), sum(hashtext(f::text)) FROM tunnel.finding f").fetchone()
    for method, path, _ in WRITES:
        if method == "DELETE" or path.endswith("undo"):
            continue
        answer = browser.request(method, path, content=body)
        assert 400 <= answer.status_code < 500, (path, answer.text)
        assert len(answer.json()["error"].splitlines()) == 1
    conn.rollback()
    assert conn.execute("SELECT count(*), sum(hashtext(f::text)) FROM tunnel.finding f").fetchone() == before


def test_long_requests_are_refused(signed_in: SignIn) -> None:
    answer = signed_in("ines_web").post("/api/findings/merge", content=b" " * (MAX_BODY + 1))
    assert answer.status_code == 413


def test_every_answer_has_the_headers(signed_in: SignIn) -> None:
    browser = signed_in("viola_web")
    for path in ("/", "/healthz", "/api/surveys", "/api/nothing", f"{STATIC}/main.js", "/tiles/demo-2024/corrected/15/1/1.png"):
        answer = browser.get(path)
        for name, value in HEADERS.items():
            assert answer.headers[name] == value, path


def test_a_host_with_a_path_makes_no_answer_public(signed_in: SignIn) -> None:
    answer = signed_in("viola_web").get("/api/surveys", headers={"Host": f"desk.example.org{STATIC}/?"})
    assert (answer.status_code, answer.headers["cache-control"]) == (200, "no-store")


def test_nothing_is_read_without_a_session(signed_in: SignIn) -> None:
    browser = signed_in("viola_web")
    browser.cookies.clear()
    for path in (
        "/api/surveys",
        "/api/findings/1",
        "/tiles/demo-2024/corrected/15/1/1.png",
        "/collections",
        "/tiles",
        "/conformance",
    ):
        assert browser.get(path).status_code == 401
    assert browser.get("/").headers["location"] == "/login"
