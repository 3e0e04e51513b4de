"""Ratings and actions by requests: the values of the database, and its rules."""

from __future__ import annotations

from datetime import date, timedelta
from typing import Any

import psycopg
import pytest
from psycopg.rows import dict_row
from starlette.testclient import TestClient
from support.example_survey import NAME, add_later_survey
from web.conftest import SignIn

SURVEY = f"/api/surveys/{NAME}"
RATING = f"{SURVEY}/rating?elements=blocks&scheme=example"


def ask(conn: psycopg.Connection, query: str, values: Any = ()) -> list[dict[str, Any]]:
    return conn.cursor(row_factory=dict_row).execute(query, values).fetchall()


@pytest.fixture(autouse=True)
def no_action(conn: psycopg.Connection, example: str) -> None:
    conn.execute("DELETE FROM tunnel.action")
    conn.commit()


def test_what_can_be_chosen(signed_in: SignIn) -> None:
    found = signed_in("viola_web").get(f"{SURVEY}/rating/choices").json()
    assert [(one["name"], one["elements"]) for one in found["element_sets"]] == [("blocks", 4), ("zones", 16)]
    (scheme,) = found["schemes"]
    assert (scheme["name"], scheme["version"], scheme["source"]) == ("example", "1", "example of the tests")
    assert scheme["results"] == ["A", "B", "C", "D"]


@pytest.mark.parametrize("elements", ["blocks", "zones"])
def test_a_rating_is_that_of_the_database(signed_in: SignIn, conn: psycopg.Connection, elements: str) -> None:
    """Also after a review; an element without inspected lining has no result."""
    browser = signed_in("viola_web")
    conn.execute("UPDATE tunnel.element SET chainage_from = 20000, chainage_to = 20050 WHERE number = 4")
    conn.commit()
    for _ in range(2):
        found = browser.get(f"{SURVEY}/rating?elements={elements}&scheme=example").json()
        known = ask(conn, "SELECT * FROM tunnel_api.rating(%s, %s, 'example')", [NAME, elements])
        for name in (
            "number",
            "name",
            "inspected_share",
            "findings",
            "result",
            "level",
            "complete",
            "finding_id",
            "why",
            "remark",
        ):
            assert [one[name] for one in found["elements"]] == [row[name] for row in known], name
        unseen = next(one for one in found["elements"] if one["number"] == 4)
        assert (unseen["result"], unseen["result_text"], unseen["boxes"]) == (None, "not rated", [])
        assert all(
            len(one["boxes"]) == (2 if "invert" in one["name"] else 1) for one in found["elements"] if one["number"] != 4
        )
        conn.execute("UPDATE tunnel.finding SET review = 'rejected'")
        conn.commit()


def test_change_since_the_earlier_inspection(signed_in: SignIn, conn: psycopg.Connection) -> None:
    add_later_survey(conn)
    conn.commit()
    browser = signed_in("viola_web")
    found = browser.get("/api/surveys/demo-2026/rating/change?elements=blocks&scheme=example").json()
    assert found["earlier"] == {"survey": NAME, "date": "2024-05-04"}
    known = ask(conn, "SELECT change, known, earlier_result FROM tunnel_api.rating_change('demo-2026', 'blocks', 'example')")
    assert [{name: one[name] for name in known[0]} for one in found["elements"]] == known
    assert browser.get(f"{SURVEY}/rating/change?elements=blocks&scheme=example").json()["earlier"] is None


def added(browser: TestClient, **values: Any) -> dict[str, Any]:
    answer = browser.post(f"{SURVEY}/actions", json={"measure": "seal the joint", **values})
    assert answer.status_code == 201, answer.text
    return answer.json()  # type: ignore[no-any-return]


def patched(browser: TestClient, action: dict[str, Any], **values: Any):  # type: ignore[no-untyped-def]
    seen = {name: action[name] for name in values}
    return browser.patch(f"/api/actions/{action['id']}", json={"seen": seen, "values": values})


def test_an_inspector_adds_changes_and_deletes_an_action(signed_in: SignIn, conn: psycopg.Connection) -> None:
    browser = signed_in("ines_web")
    one = added(browser, finding_id=1, urgency="urgent", due="2030-01-31", cost=1200.5, currency="EUR", responsible="Works Ltd")
    (row,) = ask(conn, "SELECT * FROM tunnel_api.action")
    assert (row["id"], row["finding_id"], row["added_by"], float(row["cost"])) == (one["id"], 1, "ines_web", 1200.5)
    assert (one["label"], one["due"], one["overdue"], one["state"]) == (row["label"], "2030-01-31", False, "open")
    assert browser.get("/api/findings/1").json()["actions"] == [one]
    done = patched(browser, one, state="done", cost=None, currency=None, due=None).json()
    assert done["written"]
    assert (done["action"]["state"], done["action"]["cost"], done["action"]["due"]) == ("done", None, None)
    assert done["action"]["changed_by"] == "ines_web"
    assert browser.delete(f"/api/actions/{one['id']}").status_code == 204
    assert browser.delete(f"/api/actions/{one['id']}").status_code == 404
    assert patched(browser, one, state="done").status_code == 404
    assert browser.get(f"{SURVEY}/actions").json() == []


def test_two_at_once_and_no_action_is_lost(signed_in: SignIn) -> None:
    """The same column conflicts, and nothing is written; another column is written beside."""
    ines, ivo = signed_in("ines_web"), signed_in("ivo_web")
    one = added(ines, finding_id=1)
    assert patched(ines, one, state="ordered").status_code == 200
    late = patched(ivo, one, state="done")
    assert late.status_code == 409
    assert f"ines_web has changed action {one['id']}" in late.json()["error"]
    assert late.json()["action"]["state"] == "ordered"
    same = patched(ivo, one, state="ordered")
    assert (same.status_code, same.json()["written"]) == (200, False)
    beside = patched(ivo, one, remark="scaffold needed").json()["action"]
    assert (beside["state"], beside["remark"]) == ("ordered", "scaffold needed")


def test_actions_of_the_tunnel_begin_with_overdue_ones(signed_in: SignIn, conn: psycopg.Connection) -> None:
    """Those of its other surveys are listed, too."""
    add_later_survey(conn)
    conn.commit()
    browser = signed_in("ines_web")
    today = date.today()
    late = str(today - timedelta(days=3))
    keys = {
        "done": added(browser, finding_id=1, due=late, state="done")["id"],
        "free": added(browser, chainage_from=12350, chainage_to=12360, element="block 2")["id"],
        "later": added(browser, finding_id=2, due=str(today + timedelta(days=9)))["id"],
        "late": added(browser, finding_id=3, due=late)["id"],
    }
    listed = browser.get("/api/surveys/demo-2026/actions").json()
    assert [one["id"] for one in listed] == [keys[name] for name in ("late", "later", "free", "done")]
    assert [one["overdue"] for one in listed] == [True, False, None, False]
    assert {one["survey"] for one in listed} == {NAME}


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"measure": ""}, "measure is missing"),
        ({"finding_id": 1, "urgency": "soon"}, "urgency"),
        ({"finding_id": 1, "cost": 5}, "currency"),
        ({"finding_id": 1, "cost": "5"}, "cost is not a number"),
        ({"finding_id": 1, "due": "tomorrow"}, "due is not a date"),
        ({"finding_id": 99999}, "no finding 99999"),
        ({}, "needs a finding"),
        ({"added_by": "me"}, "an action has"),
    ],
)
def test_bad_actions_are_refused_in_one_line(signed_in: SignIn, values: dict[str, Any], words: str) -> None:
    answer = signed_in("ines_web").post(f"{SURVEY}/actions", json={"measure": "seal", **values})
    assert 400 <= answer.status_code < 500
    assert words in answer.json()["error"]
    assert len(answer.json()["error"].splitlines()) == 1


def test_elements_and_actions_are_features(signed_in: SignIn, conn: psycopg.Connection) -> None:
    browser = signed_in("ines_web")
    one = added(browser, finding_id=1)
    layers = {layer["id"] for layer in browser.get("/collections").json()["collections"]}
    assert {"action_map", "rating_map"} <= layers
    (feature,) = browser.get("/collections/action_map/items").json()["features"]
    assert (feature["id"], feature["properties"]["measure"]) == (one["id"], "seal the joint")
    asked = f"survey={NAME}&element_set=blocks&scheme=example&version=1"
    found = browser.get(f"/collections/rating_map/items?{asked}").json()["features"]
    known = ask(conn, "SELECT result FROM tunnel_api.rating(%s, 'blocks', 'example')", [NAME])
    assert [one["properties"]["result"] for one in found] == [row["result"] for row in known]
    assert {one["geometry"]["type"] for one in found} == {"MultiPolygon"}
