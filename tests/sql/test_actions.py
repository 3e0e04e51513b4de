"""Actions: places, checks, conflicts, audit, what became of a leak in later surveys, and rights."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from datetime import date, timedelta
from typing import Any

import psycopg
import pytest
from psycopg.rows import dict_row
from support.example_survey import NAME

TODAY = date.today()


def ask(conn: psycopg.Connection, query: str, values: Any = ()) -> list[dict[str, Any]]:
    return conn.cursor(row_factory=dict_row).execute(query, values).fetchall()


def add(conn: psycopg.Connection, **values: Any) -> int:
    """Add an action by the view and return its id."""
    values = {"survey": NAME, "measure": "seal the joint"} | values
    names = ", ".join(values)
    (key,) = conn.execute(
        f"INSERT INTO tunnel_api.action ({names}) VALUES ({', '.join(['%s'] * len(values))}) RETURNING id",  # type: ignore[arg-type]
        list(values.values()),
    ).fetchone()  # type: ignore[misc]
    return int(key)


def one(conn: psycopg.Connection, key: int) -> dict[str, Any]:
    (row,) = ask(conn, "SELECT * FROM tunnel_api.action WHERE id = %s", [key])
    return row


@pytest.fixture
def leak(conn: psycopg.Connection, example: str) -> dict[str, Any]:
    """A counted leak of the example."""
    return ask(conn, "SELECT * FROM tunnel_api.finding WHERE survey = %s AND wet AND counted ORDER BY id LIMIT 1", [NAME])[0]


def test_an_action_lies_at_its_finding(conn: psycopg.Connection, leak: dict[str, Any]) -> None:
    """Chainages are those of the finding, and the point on the map is that of its middle."""
    key = add(conn, finding_id=leak["id"], cost=1200.5, currency="EUR", due="2030-01-31", responsible="Works Ltd")
    row = one(conn, key)
    assert (row["chainage_from"], row["chainage_to"]) == (leak["chainage_from"], leak["chainage_to"])
    assert (row["urgency"], row["state"], row["overdue"], row["finding_kind"]) == ("planned", "open", False, "leak")
    assert row["label"] == leak["label"]
    (away,) = conn.execute(
        "SELECT public.ST_Distance(a.geom, f.map) FROM tunnel_api.action_map a JOIN tunnel_api.finding f ON f.id = a.finding_id"
        " WHERE a.id = %s AND f.id = %s",
        [key, leak["id"]],
    ).fetchone()  # type: ignore[misc]
    assert away < 0.05
    (x, y) = conn.execute(
        "SELECT public.ST_X(geom), public.ST_Y(geom) FROM tunnel_api.action_unrolled WHERE id = %s", [key]
    ).fetchone()  # type: ignore[misc]
    assert x == pytest.approx((leak["chainage_from"] + leak["chainage_to"]) / 2)
    assert y == pytest.approx((leak["arc_from"] + leak["arc_to"]) / 2)


def test_overdue_is_what_is_not_done_after_its_day(conn: psycopg.Connection, example: str) -> None:
    place = {"chainage_from": 12310, "chainage_to": 12320}
    cases = {
        (TODAY - timedelta(days=1), "open"): True, (TODAY - timedelta(days=1), "ordered"): True,
        (TODAY - timedelta(days=1), "done"): False, (TODAY - timedelta(days=400), "verified"): False,
        (TODAY + timedelta(days=1), "open"): False,
    }  # fmt: skip
    for (due, state), expected in cases.items():
        assert one(conn, add(conn, due=due, state=state, **place))["overdue"] is expected
    assert one(conn, add(conn, **place))["overdue"] is None, "without a due date nothing is overdue"


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"measure": ""}, "needs a measure"),
        ({"urgency": "soon"}, "immediate, urgent, planned or monitor, not soon"),
        ({"state": "closed"}, "open, ordered, done or verified, not closed"),
        ({"cost": 100}, "a cost needs its currency"),
        ({"cost": 100, "currency": "euro"}, "a cost needs its currency"),
        ({"currency": "EUR"}, "a cost needs its currency"),
        ({"finding_id": 999_999}, "has no finding 999999"),
        ({"chainage_from": 12330}, "chainage_to that is not less"),
        ({"chainage_from": 12290}, "from chainage 12290 to 12320 is not within the survey"),
        ({"chainage_from": None}, "needs a finding, or chainage_from"),
        ({"survey": "nothing"}, "there is none named nothing"),
    ],
)
def test_wrong_actions_are_refused(conn: psycopg.Connection, example: str, values: dict[str, Any], message: str) -> None:
    with pytest.raises(psycopg.Error, match=message):
        add(conn, **({"chainage_from": 12310, "chainage_to": 12320} | values))


def test_edits_are_in_the_audit(conn: psycopg.Connection, leak: dict[str, Any]) -> None:
    key = add(conn, finding_id=leak["id"])
    conn.execute("UPDATE tunnel_api.action SET state = 'ordered', responsible = 'Works Ltd' WHERE id = %s", [key])
    conn.execute("UPDATE tunnel_api.action_map SET state = 'done' WHERE id = %s", [key])
    conn.execute("DELETE FROM tunnel_api.action WHERE id = %s", [key])
    rows = ask(
        conn, "SELECT action, before, after FROM tunnel_api.audit WHERE view = 'action' AND row_id = %s ORDER BY id", [key]
    )
    assert [row["action"] for row in rows] == ["insert", "update", "update", "delete"]
    assert rows[0]["after"]["measure"] == "seal the joint"
    assert rows[1]["before"] == {"state": "open"}
    assert rows[1]["after"] == {"state": "ordered", "responsible": "Works Ltd"}
    assert rows[3]["before"]["state"] == "done"
    assert not ask(conn, "SELECT 1 FROM tunnel_api.action WHERE id = %s", [key])


def test_an_action_outlives_its_drawn_finding(conn: psycopg.Connection, example: str) -> None:
    (finding,) = conn.execute(
        "INSERT INTO tunnel_api.finding_unrolled (survey, kind, width_mm, geom)"
        " VALUES (%s, 'crack', 0.4, 'LINESTRING(12350 1, 12353 1)') RETURNING id",
        [NAME],
    ).fetchone()  # type: ignore[misc]
    key = add(conn, finding_id=finding)
    conn.execute("DELETE FROM tunnel_api.finding_unrolled WHERE id = %s", [finding])
    row = one(conn, key)
    assert (row["finding_id"], row["follow_up"]) == (None, None)
    assert row["chainage_from"] == pytest.approx(12350)


@pytest.mark.parametrize(
    ("theirs", "mine", "result"),
    [
        ("state = 'ordered'", "responsible = 'Works Ltd'", ("ordered", "Works Ltd")),
        ("state = 'ordered'", "state = 'ordered'", ("ordered", None)),
        ("state = 'ordered'", "state = 'done'", None),
    ],
)
@pytest.mark.parametrize("person", ["ines"], indirect=True)
def test_two_people_do_not_overwrite_each_other(
    person: psycopg.Connection, conn: psycopg.Connection, example: str, theirs: str, mine: str, result: tuple[Any, ...] | None
) -> None:
    """Another person's change is not committed yet when mine begins: other columns are both kept, the same one is refused."""
    key = add(conn, chainage_from=12310, chainage_to=12320)
    conn.commit()
    update = "UPDATE tunnel_api.action SET {} WHERE id = %s"
    conn.execute(update.format(theirs), [key])  # type: ignore[arg-type]
    with ThreadPoolExecutor(1) as pool:
        waiting = pool.submit(person.execute, update.format(mine), [key])  # type: ignore[arg-type]
        while not conn.execute("SELECT 1 FROM pg_locks WHERE NOT granted").fetchone():
            assert not waiting.done()
        conn.commit()
        if result is None:
            with pytest.raises(
                psycopg.errors.SerializationFailure, match=r"the state of action .* was changed meanwhile to 'ordered'"
            ):
                waiting.result()
            return
        waiting.result()
    person.commit()
    row = one(conn, key)
    assert (row["state"], row["responsible"]) == result


LATER = [
    # states of later surveys by date, and what is said of the leak
    ([], "not compared"),
    ([("2026-05-04", "dry", 0.3, 0.0)], "dry since 2026-05-04"),
    ([("2026-05-04", "dry", 0.3, 0.0), ("2028-05-04", "dry", 0.3, 0.0)], "dry since 2026-05-04"),
    (
        [("2026-05-04", "dry", 0.3, 0.0), ("2028-05-04", "unseen", 0.3, 0.0)],
        "dry since 2026-05-04; not inspected on 2028-05-04",
    ),
    ([("2026-05-04", "dry", 0.3, 0.0), ("2028-05-04", "grown", 0.3, 0.8)], "grown on 2028-05-04: 0.30 to 0.80 m²"),
    ([("2026-05-04", "grown", 0.3, 0.5), ("2028-05-04", "dry", 0.3, 0.0)], "dry since 2028-05-04"),
    ([("2026-05-04", "unseen", 0.3, 0.0)], "not inspected on 2026-05-04"),
]


@pytest.mark.parametrize(("later", "said"), LATER)
def test_what_became_of_the_leak(conn: psycopg.Connection, leak: dict[str, Any], later: list[Any], said: str) -> None:
    """Later surveys that were compared with this one: a survey that did not see the place is no proof that it is dry."""
    key = add(conn, finding_id=leak["id"])
    for day, state, before, after in later:
        conn.execute(
            "WITH s AS (INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_kind, platform)"
            " SELECT tunnel_id, 'demo-' || %(day)s, %(day)s::date, 'none', 'static' FROM tunnel.survey WHERE name = %(name)s"
            " RETURNING id)"
            " INSERT INTO tunnel.leak_change (survey_id, old_survey_id, km, state, chainage_from, chainage_to, clock, area_old,"
            " area_old_se, area_new, area_new_se, seen_old, seen_new, old_kinds, new_kinds, old_ids, new_ids, unrolled,"
            " map, surface)"
            " SELECT s.id, f.survey_id, 12, %(state)s, f.chainage_from, f.chainage_to, 12, %(before)s, 0, %(after)s, 0, 1,"
            " CASE WHEN %(state)s = 'unseen' THEN 0 ELSE 1 END, '{leak}', '{}', ARRAY[f.id], '{}',"
            " public.ST_Multi(f.unrolled), public.ST_Multi(f.map),"
            " public.ST_Multi(f.surface)"
            " FROM s, tunnel.finding f WHERE f.id = %(id)s",
            {"day": day, "name": NAME, "state": state, "before": before, "after": after, "id": leak["id"]},
        )
    assert one(conn, key)["follow_up"] == said


@pytest.mark.parametrize("person", ["vera"], indirect=True)
def test_viewers_read_only(person: psycopg.Connection, conn: psycopg.Connection, example: str) -> None:
    key = add(conn, chainage_from=12310, chainage_to=12320)
    conn.commit()
    assert person.execute("SELECT measure FROM tunnel_api.action WHERE id = %s", [key]).fetchall() == [("seal the joint",)]
    with pytest.raises(psycopg.errors.InsufficientPrivilege):
        person.execute("UPDATE tunnel_api.action SET state = 'done' WHERE id = %s", [key])


@pytest.mark.parametrize("person", ["ines"], indirect=True)
def test_inspectors_write_under_their_own_name(person: psycopg.Connection, example: str) -> None:
    key = add(person, chainage_from=12310, chainage_to=12320)
    person.execute("UPDATE tunnel_api.action SET state = 'done' WHERE id = %s", [key])
    row = one(person, key)
    assert (row["added_by"], row["changed_by"], row["state"]) == ("ines", "ines", "done")
    with pytest.raises(psycopg.errors.InsufficientPrivilege):
        person.execute("UPDATE tunnel_api.action SET added_by = 'vera' WHERE id = %s", [key])
