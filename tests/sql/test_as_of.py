"""A survey as it was: after any edits the views show what they showed at the moment, and nothing of it can be committed."""

from __future__ import annotations

import json
import random
from collections.abc import Callable
from datetime import datetime
from typing import Any

import psycopg
import pytest
from support.example_survey import NAME

VIEWS = {
    "finding": "chainage_from",
    "finding_photo": "id",
    "region": "id",
    "action": "id",
}
"""Views that are compared, and a column to sort by."""

IGNORED = {"added_by", "added_at", "changed_by", "changed_at", "drawn_at", "reviewed_at", "approved_at", "created_at"}
"""Columns that say when something was written."""

RECOMPUTED = {"map"}
"""A redrawn outline gets its place on the map from the axis; the example's own outlines there are simpler."""


def shown(conn: psycopg.Connection) -> dict[str, list[dict[str, Any]]]:
    """Return the rows of the views, and the totals and ratings that follow from them."""
    found = {}
    for view in VIEWS:
        rows = conn.execute(f"SELECT to_jsonb(v) FROM tunnel_api.{view} v ORDER BY id").fetchall()  # type: ignore[arg-type]
        found[view] = [{name: value for name, value in row.items() if name not in IGNORED | RECOMPUTED} for (row,) in rows]
    for name, query in {
        "totals": "SELECT to_jsonb(s) FROM tunnel_api.leak_statistics(%s, '-infinity', 'infinity') s",
        "rating": "SELECT to_jsonb(r) FROM tunnel_api.rating(%s, 'blocks', 'example') r ORDER BY r.number",
    }.items():
        found[name] = [row for (row,) in conn.execute(query, [NAME]).fetchall()]
    return json.loads(json.dumps(found, default=str))  # type: ignore[no-any-return]


def now(conn: psycopg.Connection) -> datetime:
    (moment,) = conn.execute("SELECT clock_timestamp()").fetchone()  # type: ignore[misc]
    return moment  # type: ignore[no-any-return]


def rounded(value: Any) -> Any:
    """Return numbers with nine digits: outlines are computed anew."""
    if isinstance(value, float):
        return float(f"{value:.9g}")
    if isinstance(value, dict):
        return {name: rounded(one) for name, one in value.items()}
    return [rounded(one) for one in value] if isinstance(value, list) else value


def differences(before: dict[str, Any], after: dict[str, Any]) -> list[str]:
    """Return what differs, in words."""
    found = []
    for name in before:
        old, new = ({row.get("id", n): row for n, row in enumerate(state[name])} for state in (before, after))
        found += [f"{name}: {key} is in one only" for key in old.keys() ^ new.keys()]
        found += [
            f"{name} {key}: {column} {old[key][column]} -> {new[key][column]}"
            for key in old.keys() & new.keys()
            for column in old[key]
            if old[key][column] != new[key][column]
        ]
    return found


Act = Callable[[psycopg.Connection, random.Random], None]


def _some(conn: psycopg.Connection, chance: random.Random, query: str) -> int | None:
    keys = [key for (key,) in conn.execute(query).fetchall()]  # type: ignore[arg-type]
    return chance.choice(keys) if keys else None


LEAKS = (
    "SELECT id FROM tunnel_api.finding WHERE wet AND merged_into IS NULL AND geometrytype(unrolled) <> 'LINESTRING' ORDER BY id"
)


def review(conn: psycopg.Connection, chance: random.Random) -> None:
    key = _some(conn, chance, "SELECT id FROM tunnel_api.finding WHERE merged_into IS NULL ORDER BY id")
    word, remark = chance.choice(["open", "confirmed", "rejected"]), chance.choice(["a", "b", None])
    conn.execute("UPDATE tunnel_api.finding SET review = %s, remark = %s WHERE id = %s", [word, remark, key])


def relabel(conn: psycopg.Connection, chance: random.Random) -> None:
    kind = chance.choice(["leak", "joint", "dark"])
    conn.execute("UPDATE tunnel_api.finding SET kind = %s WHERE id = %s", [kind, _some(conn, chance, LEAKS)])


def grade(conn: psycopg.Connection, chance: random.Random) -> None:
    conn.execute(
        "UPDATE tunnel_api.finding_unrolled SET severity = %s WHERE id = %s",
        [chance.choice([1, 2, 4]), _some(conn, chance, LEAKS)],
    )


def redraw(conn: psycopg.Connection, chance: random.Random) -> None:
    conn.execute(
        "UPDATE tunnel_api.finding_unrolled SET geom = public.ST_Translate(geom, %s, 0) WHERE id = %s",
        [chance.choice([0.03, -0.04, 0.5]), _some(conn, chance, LEAKS)],
    )


def draw(conn: psycopg.Connection, chance: random.Random) -> None:
    x = 12310 + 180 * chance.random()
    conn.execute(
        "INSERT INTO tunnel_api.finding_unrolled (survey, kind, geom)"
        " VALUES (%s, 'leak', public.ST_MakeEnvelope(%s, 1, %s, 1.6))",
        [NAME, x, x + 0.7],
    )


def erase(conn: psycopg.Connection, chance: random.Random) -> None:
    key = _some(
        conn, chance, "SELECT id FROM tunnel_api.finding WHERE manual AND merged_into IS NULL AND merged IS NULL ORDER BY id"
    )
    conn.execute("DELETE FROM tunnel_api.finding_unrolled WHERE id = %s", [key])


def merge(conn: psycopg.Connection, chance: random.Random) -> None:
    conn.execute("SELECT tunnel_api.finding_merge(%s)", [[_some(conn, chance, LEAKS), _some(conn, chance, LEAKS)]])


def undo(conn: psycopg.Connection, chance: random.Random) -> None:
    conn.execute("SELECT tunnel_api.finding_undo(%s)", [_some(conn, chance, LEAKS)])


def photograph(conn: psycopg.Connection, chance: random.Random) -> None:
    key = _some(conn, chance, LEAKS)
    conn.execute("INSERT INTO tunnel_api.finding_photo (finding_id, path) VALUES (%s, %s)", [key, f"{chance.random()}.jpg"])


def caption(conn: psycopg.Connection, chance: random.Random) -> None:
    key = _some(conn, chance, "SELECT id FROM tunnel_api.finding_photo ORDER BY id")
    conn.execute("UPDATE tunnel_api.finding_photo SET caption = %s WHERE id = %s", [chance.choice(["x", None]), key])


def discard(conn: psycopg.Connection, chance: random.Random) -> None:
    key = _some(conn, chance, "SELECT id FROM tunnel_api.finding_photo ORDER BY id")
    conn.execute("DELETE FROM tunnel_api.finding_photo WHERE id = %s", [key])


def dry(conn: psycopg.Connection, chance: random.Random) -> None:
    key = _some(conn, chance, LEAKS)
    conn.execute(
        "INSERT INTO tunnel_api.region (survey, kind, reason, geom) SELECT survey, 'dry', 'grease',"
        " public.ST_Envelope(public.ST_Buffer(unrolled, 0.1)) FROM tunnel_api.finding WHERE id = %s",
        [key],
    )


def redry(conn: psycopg.Connection, chance: random.Random) -> None:
    key = _some(conn, chance, "SELECT id FROM tunnel_api.region ORDER BY id")
    conn.execute(
        "UPDATE tunnel_api.region SET reason = %s, geom = public.ST_Translate(geom, %s, 0) WHERE id = %s",
        [chance.choice(["grease", "paint"]), chance.choice([0.0, 3.0]), key],
    )


def undry(conn: psycopg.Connection, chance: random.Random) -> None:
    conn.execute(
        "DELETE FROM tunnel_api.region WHERE id = %s", [_some(conn, chance, "SELECT id FROM tunnel_api.region ORDER BY id")]
    )


def demand(conn: psycopg.Connection, chance: random.Random) -> None:
    key = _some(conn, chance, LEAKS)
    conn.execute("INSERT INTO tunnel_api.action (survey, finding_id, measure) VALUES (%s, %s, 'seal')", [NAME, key])


def proceed(conn: psycopg.Connection, chance: random.Random) -> None:
    key = _some(conn, chance, "SELECT id FROM tunnel_api.action ORDER BY id")
    values = [
        chance.choice(["ordered", "done"]),
        chance.choice(["2030-01-01", None]),
        chance.choice([("EUR", 3), (None, None)]),
    ]
    conn.execute(
        "UPDATE tunnel_api.action SET state = %s, due = %s, currency = %s, cost = %s WHERE id = %s",
        [*values[:2], *values[2], key],
    )


def drop(conn: psycopg.Connection, chance: random.Random) -> None:
    conn.execute(
        "DELETE FROM tunnel_api.action WHERE id = %s", [_some(conn, chance, "SELECT id FROM tunnel_api.action ORDER BY id")]
    )


ACTS: tuple[Act, ...] = (
    review, review, relabel, grade, redraw, draw, erase, merge, undo, photograph, caption, discard, dry, redry, undry, demand,
    proceed, drop,
)  # fmt: skip


def edit(conn: psycopg.Connection, chance: random.Random, count: int) -> int:
    """Make random edits, each a transaction; return how many were accepted."""
    done = 0
    for _ in range(count):
        act = chance.choice(ACTS)
        try:
            act(conn, chance)
            conn.commit()
            done += 1
        except psycopg.Error:  # refused: of a finding that is split, an undo of nothing, …
            conn.rollback()
    return done


@pytest.mark.parametrize("seed", range(8))
def test_after_any_edits_the_views_show_what_they_showed(conn: psycopg.Connection, example: str, seed: int) -> None:
    chance = random.Random(seed)
    conn.execute("SET jit = off")
    edit(conn, chance, 25)
    moment, before = now(conn), shown(conn)
    assert edit(conn, chance, 40) > 10
    assert shown(conn) != before
    conn.commit()
    (reverted,) = conn.execute("SELECT tunnel_api.show_as_of(%s, %s)", [NAME, moment]).fetchone()  # type: ignore[misc]
    assert reverted > 10
    assert differences(rounded(before), rounded(shown(conn))) == []
    conn.rollback()


def test_nothing_of_the_past_can_be_committed(conn: psycopg.Connection, example: str) -> None:
    moment = now(conn)
    conn.execute("UPDATE tunnel_api.finding SET review = 'rejected' WHERE id = 1")
    conn.commit()
    conn.execute("SELECT tunnel_api.show_as_of(%s, %s)", [NAME, moment])
    assert conn.execute("SELECT review FROM tunnel_api.finding WHERE id = 1").fetchone() != ("rejected",)
    with pytest.raises(psycopg.Error, match="cannot be committed"):
        conn.commit()
    assert conn.execute("SELECT review FROM tunnel_api.finding WHERE id = 1").fetchone() == ("rejected",)


def test_what_a_later_detection_replaced_is_not_shown(conn: psycopg.Connection, example: str) -> None:
    moment = now(conn)
    conn.execute(
        "INSERT INTO tunnel.run (survey_id, km, stage, outcome, finished_at)"
        " VALUES (tunnel_api.survey_id(%s), 12, 'detect', 'done', clock_timestamp())",
        [NAME],
    )
    conn.commit()
    with pytest.raises(psycopg.Error, match=r"cannot be shown as of .*: stage detect of km 12 ran on"):
        conn.execute("SELECT tunnel_api.show_as_of(%s, %s)", [NAME, moment])


def test_a_survey_is_not_shown_before_it_was_added(conn: psycopg.Connection, example: str) -> None:
    with pytest.raises(psycopg.Error, match="was added after"):
        conn.execute("SELECT tunnel_api.show_as_of(%s, '2001-01-01')", [NAME])


@pytest.mark.parametrize("person", ["ines"], indirect=True)
def test_inspectors_may_look_and_viewers_may_not(person: psycopg.Connection, conn: psycopg.Connection, example: str) -> None:
    moment = now(conn)
    conn.execute("UPDATE tunnel_api.finding SET review = 'rejected' WHERE id = 1")
    conn.commit()
    with person.transaction(force_rollback=True):
        assert person.execute("SELECT tunnel_api.show_as_of(%s, %s)", [NAME, moment]).fetchone() == (1,)
    person.execute("SET ROLE tunnel_viewer")
    with pytest.raises(psycopg.errors.InsufficientPrivilege):
        person.execute("SELECT tunnel_api.show_as_of(%s, %s)", [NAME, moment])
