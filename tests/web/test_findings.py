"""Review and drawing by requests: the rules of the database and of the QGIS plugin."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import psycopg
import pytest
from starlette.testclient import TestClient
from web.conftest import SignIn

POLYGON = {"type": "Polygon", "coordinates": [[[12350, 1], [12351, 1], [12351, 2], [12350, 2], [12350, 1]]]}


def first_open(browser: TestClient) -> dict:
    listed = browser.get("/api/surveys/demo-2024/worklist?order=likely").json()
    key = next(one["id"] for one in listed if one["review"] == "open")
    return browser.get(f"/api/findings/{key}").json()


def verdict(browser: TestClient, finding: dict, **values: object):  # type: ignore[no-untyped-def]
    seen = {name: finding[name] for name in ("review", "remark", "kind")}
    return browser.patch(f"/api/findings/{finding['id']}", json={"seen": seen, "values": values})


def test_a_verdict_is_written_as_the_person(signed_in: SignIn, conn: psycopg.Connection) -> None:
    browser = signed_in("ines_web")
    finding = first_open(browser)
    answer = verdict(browser, finding, review="confirmed", remark="drips")
    assert answer.json()["written"]
    assert answer.json()["finding"]["review"] == "confirmed"
    row = conn.execute("SELECT review, remark, reviewed_by FROM tunnel_api.finding WHERE id = %s", [finding["id"]]).fetchone()
    assert row == ("confirmed", "drips", "ines_web")
    assert browser.get(f"/api/findings/{finding['id']}").json()["history"][0]["by"] == "ines_web"


def test_two_at_once_and_nothing_is_lost(signed_in: SignIn) -> None:
    ines, ivo = signed_in("ines_web"), signed_in("ivo_web")
    finding = first_open(ines)
    assert verdict(ines, finding, review="confirmed").status_code == 200
    late = verdict(ivo, finding, review="rejected")
    assert late.status_code == 409
    assert "ines_web has changed finding" in late.json()["error"]
    assert late.json()["finding"]["review"] == "confirmed"
    same = verdict(ivo, finding, review="confirmed")
    assert (same.status_code, same.json()["written"], same.json()["finding"]["reviewed_by"]) == (200, False, "ines_web")


def test_undo(signed_in: SignIn) -> None:
    browser = signed_in("ines_web")
    finding = first_open(browser)
    verdict(browser, finding, review="rejected")
    answer = browser.post(f"/api/findings/{finding['id']}/undo")
    assert answer.json()["finding"]["review"] == "open"
    other = signed_in("ivo_web")
    verdict(browser, answer.json()["finding"], review="rejected")
    refused = other.post(f"/api/findings/{finding['id']}/undo")
    assert refused.status_code in (403, 409)


def test_draw_redraw_split_merge_delete(signed_in: SignIn) -> None:
    browser = signed_in("ines_web")
    body = {"geometry": POLYGON, "kind": "spall", "severity": 2, "width_mm": None, "remark": "edge"}
    drawn = browser.post("/api/surveys/demo-2024/findings", json=body)
    assert drawn.status_code == 201, drawn.text
    one = drawn.json()
    assert (one["kind"], one["severity"], one["review"], one["drawn_by"]) == ("spall", 2, "confirmed", "ines_web")
    wider = {"type": "Polygon", "coordinates": [[[12350, 1], [12352, 1], [12352, 2], [12350, 2], [12350, 1]]]}
    moved = browser.put(f"/api/findings/{one['id']}/outline", json={"geometry": wider})
    assert moved.json()["chainage_to"] == 12352
    parts = browser.post(
        f"/api/findings/{one['id']}/split", json={"line": {"type": "LineString", "coordinates": [[12351, 0], [12351, 3]]}}
    ).json()["ids"]
    ids = sorted({one["id"], *parts})
    assert len(ids) == 2
    assert browser.post("/api/findings/merge", json={"ids": ids}).json()["id"] == one["id"]
    assert browser.delete(f"/api/findings/{one['id']}").status_code in (204, 409)


LINE = {"type": "LineString", "coordinates": [[12351.1234, 1.5], [12352.5, 2.0001], [12353, 1]]}
POINT = {"type": "Point", "coordinates": [12354.1111, 1.2222]}


@pytest.mark.parametrize(("geometry", "kind"), [(POLYGON, "spall"), (LINE, "crack"), (POINT, "missing_bolt")])
def test_a_drawing_that_is_sent_again_is_one_finding(signed_in: SignIn, geometry: dict, kind: str) -> None:
    """Also after it was changed, redrawn or deleted; another person and another outline make another finding."""
    browser, path = signed_in("ines_web"), "/api/surveys/demo-2024/findings"
    body = {"geometry": geometry, "kind": kind, "severity": 2, "width_mm": None, "remark": "edge", "again": True}
    first = browser.post(path, json=body).json()["id"]
    assert browser.post(path, json=body).json()["id"] == first
    verdict(browser, browser.get(f"/api/findings/{first}").json(), kind="other", remark="niche")
    assert browser.post(path, json=body).json()["remark"] == "niche"
    moved = {**geometry, "coordinates": [12355, 1] if kind == "missing_bolt" else LINE["coordinates"][:2]}
    if kind != "spall":
        assert browser.put(f"/api/findings/{first}/outline", json={"geometry": moved}).status_code == 200
        assert browser.post(path, json=body).json()["id"] == first
    assert signed_in("ivo_web").post(path, json=body).json()["id"] != first
    second = browser.post(path, json={**body, "again": False}).json()["id"]
    assert second > first
    assert browser.delete(f"/api/findings/{second}").status_code == 204
    answer = browser.post(path, json=body)
    assert (answer.status_code, answer.json()["error"]) == (404, f"finding {second} does not exist")
    assert browser.post(path, json={**body, "again": "yes"}).status_code == 400


def test_a_drawing_that_is_sent_twice_at_once_is_one_finding(signed_in: SignIn) -> None:
    browser, path = signed_in("ines_web"), "/api/surveys/demo-2024/findings"
    body = {"geometry": POLYGON, "kind": "spall", "severity": None, "width_mm": None, "remark": None, "again": True}
    with ThreadPoolExecutor(3) as threads:
        answers = list(threads.map(lambda _: browser.post(path, json=body).json()["id"], range(3)))
    assert len(set(answers)) == 1


def test_drawings_off_the_lining_are_refused_in_one_line(signed_in: SignIn) -> None:
    far = {"type": "Point", "coordinates": [90_000, 0]}
    answer = signed_in("ines_web").post(
        "/api/surveys/demo-2024/findings",
        json={"geometry": far, "kind": "other", "severity": None, "width_mm": None, "remark": None},
    )
    assert 400 <= answer.status_code < 500
    assert answer.json()["error"]


def test_order_of_the_work_list(signed_in: SignIn) -> None:
    browser = signed_in("viola_web")
    for order, key in (
        ("likely", lambda f: -f["probability"]),
        ("chainage", lambda f: f["chainage_from"]),
        ("large", lambda f: -f["area"]),
    ):
        listed = browser.get(f"/api/surveys/demo-2024/worklist?order={order}").json()
        assert len(listed) > 2
        assert [key(one) for one in listed] == sorted(key(one) for one in listed)
    only = browser.get("/api/surveys/demo-2024/worklist?kind=leak&from=12340&to=12400&min_area=0.1").json()
    assert all(one["kind"] == "leak" and one["area"] >= 0.1 and one["chainage_to"] > 12340 for one in only)
