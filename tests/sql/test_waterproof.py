"""What is kept of each kilometre's waterproofing is what working it out gives, whoever looks, whatever others do meanwhile."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import psycopg
import pytest
from shapely.geometry import box

from tests.sql.test_statistics import add_coverage, add_leak, add_survey, ask
from tunneldb.database import connect, install
from tunneldb.stages.registry import REGISTRY
from tunneldb.store.waterproof import keep_missing

NAMES = (
    "chainage_from", "chainage_to", "lining_area", "seen_share", "wet_area", "wet_ratio", "patches", "largest_area",
    "largest_leak", "window_patches", "window_from", "window_to", "window_wet_area", "class",
)  # fmt: skip

REJECT = """
    UPDATE tunnel_api.leak SET review = 'rejected'
     WHERE id = (SELECT id FROM tunnel.finding WHERE km = 4 ORDER BY id OFFSET %s LIMIT 1)
"""
"""Rejects one of the leaks of the middle kilometre."""


@pytest.fixture
def survey(conn: psycopg.Connection) -> int:
    """Three kilometres from 3+200 to 5+850, the middle one not detected yet, with leaks in and across them."""
    key = add_survey(conn, 3200, 5850)
    rng = np.random.default_rng(1)
    for km in (3, 5):
        add_coverage(conn, key, km, *np.sort(rng.uniform(1, 2, (3, 10_000)))[::-1])
    for chainage in (*rng.uniform(3210, 5840, 60), 3999.9, 4000.0, 4999.8):
        add_leak(conn, key, box(chainage - 0.2, 0, chainage + 0.2, 0.5), 0.2)
    conn.commit()
    return key


@pytest.fixture
def said(conn: psycopg.Connection) -> list[str]:
    """What the server has warned of."""
    messages: list[str] = []
    conn.add_notice_handler(lambda notice: messages.append(notice.message_primary or ""))
    return messages


def differences(conn: psycopg.Connection) -> list[str]:
    """Columns in which the view is not what the function gives, as this connection sees the database."""
    found = []
    for row in ask(conn, "SELECT * FROM tunnel_api.km_waterproof"):
        (one,) = ask(
            conn, "SELECT * FROM tunnel_internal.stretch_statistics(%s, ARRAY[%s], ARRAY[%s])",
            row["survey_id"], row["chainage_from"], row["chainage_to"],
        )  # fmt: skip
        found += [f"{row['km']}: {name}" for name in NAMES if row[name] != pytest.approx(one[name], abs=1e-9, nan_ok=True)]
    return found


def kept(conn: psycopg.Connection) -> list[int]:
    """Kilometres whose statistics are kept and hold."""
    rows = ask(
        conn, "SELECT km FROM tunnel.waterproof GROUP BY km HAVING count(*) = 1 AND min(chainage_from) < 'Infinity' ORDER BY km"
    )
    return [row["km"] for row in rows]


def test_statistics_are_kept_and_taken_from_there(conn: psycopg.Connection, survey: int) -> None:
    assert kept(conn) == [3, 4, 5]
    assert differences(conn) == []
    explained = "\n".join(row[0] for row in conn.execute("EXPLAIN (ANALYZE) SELECT * FROM tunnel_api.km_waterproof").fetchall())
    assert "Function Scan on stretch_statistics f" in explained
    assert explained.split("Function Scan on stretch_statistics f")[1].splitlines()[0].endswith("(never executed)")


def test_one_sees_what_one_has_changed_before_it_is_committed(conn: psycopg.Connection, survey: int, dsn: str) -> None:
    wet = "SELECT wet_area FROM tunnel_api.km_waterproof ORDER BY km"
    before = conn.execute(wet).fetchall()
    conn.execute("UPDATE tunnel_api.leak SET review = 'rejected' WHERE chainage_from > 4000 AND chainage_to < 4500")
    assert conn.execute(wet).fetchall()[1] < before[1]
    assert differences(conn) == []
    with connect(dsn) as other:
        assert other.execute(wet).fetchall() == before
    conn.rollback()
    assert conn.execute(wet).fetchall() == before
    assert kept(conn) == [3, 4, 5]


@pytest.mark.parametrize("first_to_commit", [0, 1])
def test_two_who_review_a_kilometre_at_once(conn: psycopg.Connection, survey: int, dsn: str, first_to_commit: int) -> None:
    """Neither waits; each is told apart, and together they are neither of what they were alone."""
    with connect(dsn) as other:
        pair = (conn, other)
        for number, one in enumerate(pair):
            one.execute("SET LOCAL lock_timeout = '2s'")
            one.execute(REJECT, (number,))
            one.execute("SET CONSTRAINTS ALL IMMEDIATE")  # as at the end of the transaction, which the other does not see yet
            assert differences(one) == []
        for number in (first_to_commit, 1 - first_to_commit):
            pair[number].commit()
            for one in pair:
                assert differences(one) == []
                if one is pair[number]:
                    one.commit()
        # what was worked out at the same time is not believed; the next change mends it
        conn.execute("UPDATE tunnel_api.leak SET review = 'confirmed'")
        conn.commit()
        assert kept(conn) == [3, 4, 5]
        assert differences(other) == []


def test_of_two_one_may_give_up(conn: psycopg.Connection, survey: int, dsn: str) -> None:
    with connect(dsn) as other:
        for number, one in enumerate((conn, other)):
            one.execute(REJECT, (number,))
            one.execute("SET CONSTRAINTS ALL IMMEDIATE")
        conn.rollback()
        other.commit()
        assert differences(conn) == []


@pytest.mark.parametrize("seed", range(6))
def test_whatever_two_do_in_turn_what_is_kept_is_right(conn: psycopg.Connection, survey: int, dsn: str, seed: int) -> None:
    """Reviews, new leaks, lost ones and lining, in two transactions that end in any way, some steps of which are taken back."""
    rng = np.random.default_rng(seed)
    with connect(dsn) as other:
        for _ in range(40):
            side = int(rng.integers(2))
            one = (conn, other)[side]
            one.execute("SAVEPOINT s")
            change(one, survey, side, rng)
            if rng.random() < 0.2:
                one.execute("ROLLBACK TO s")
            if rng.random() < 0.15:
                one.execute("SET CONSTRAINTS ALL IMMEDIATE")
                one.execute("SET CONSTRAINTS ALL DEFERRED")
            if rng.random() < 0.4:
                (one.rollback if rng.random() < 0.25 else one.commit)()
            if rng.random() < 0.3:
                assert differences(one) == []
        for one in (conn, other):
            one.commit()
            assert differences(one) == []


def change(conn: psycopg.Connection, survey: int, side: int, rng: np.random.Generator) -> None:
    """Change something of a leak or a kilometre that the other transaction leaves alone."""
    which = rng.integers(6)
    if which == 0:
        chainage = float(rng.choice([4000.1, 5000.0, rng.uniform(3200, 5800)]))
        add_leak(conn, survey, box(chainage - 0.3, 0, chainage + 0.3, 0.3), 0.18)
    elif which == 1:
        conn.execute("DELETE FROM tunnel.finding WHERE id = %s", (2 * int(rng.integers(35)) + side,))
    elif which == 2:
        conn.execute("UPDATE tunnel.coverage SET seen = lining WHERE km = %s", (3 + 2 * side,))
    else:
        fate = str(rng.choice(["open", "confirmed", "rejected"]))
        query = "UPDATE tunnel_api.leak SET review = %s WHERE id %% 2 = %s AND chainage_from BETWEEN %s AND %s"
        low = float(rng.uniform(3200, 5800))
        conn.execute(query, (fate, side, low, low + 400))


def notes_made(conn: psycopg.Connection) -> int:
    """Return the number of notes and statistics that were ever written."""
    return int(ask(conn, "SELECT last_value FROM tunnel.waterproof_id_seq")[0]["last_value"])


def test_many_reviews_of_a_transaction_are_worked_out_once(conn: psycopg.Connection, survey: int) -> None:
    rows = ask(conn, "SELECT id FROM tunnel_api.leak WHERE chainage_from BETWEEN 4010 AND 4900")
    before = notes_made(conn)
    for row in rows:
        conn.execute("UPDATE tunnel_api.leak SET review = 'rejected' WHERE id = %s", (row["id"],))
    conn.commit()
    assert len(rows) > 10
    assert notes_made(conn) == before + len(rows) + 1, "each leaves one note, and all leave one row of statistics"
    assert kept(conn) == [3, 4, 5]
    assert differences(conn) == []


@pytest.mark.parametrize(
    "change",
    [
        "UPDATE tunnel_api.leak SET review = 'confirmed'",
        "UPDATE tunnel_api.leak SET remark = 'seen'",
        "UPDATE tunnel_api.finding_unrolled SET review = 'rejected' WHERE NOT wet",
    ],
)
def test_reviews_that_change_no_number_keep_the_statistics(conn: psycopg.Connection, survey: int, change: str) -> None:
    before = notes_made(conn)
    conn.execute(change)
    conn.commit()
    assert notes_made(conn) == before
    assert differences(conn) == []


@pytest.mark.parametrize(
    "change",
    [
        "UPDATE tunnel.finding SET detected = false WHERE id = %(id)s",
        "UPDATE tunnel.finding SET area = area + 1 WHERE id = %(id)s",
        "UPDATE tunnel.finding SET chainage_to = chainage_to + 0.5 WHERE id = %(id)s",
        "UPDATE tunnel.finding SET unrolled = public.st_translate(unrolled, 0, 0.1) WHERE id = %(id)s",
        "UPDATE tunnel_api.leak SET kind = 'dark' WHERE id = %(id)s",
        "UPDATE tunnel.finding SET same_as = (SELECT min(id) FROM tunnel.finding WHERE id <> %(id)s) WHERE id = %(id)s",
    ],
)
def test_changes_of_what_counts_leave_a_note(conn: psycopg.Connection, survey: int, change: str) -> None:
    (row,) = ask(conn, "SELECT id FROM tunnel_api.leak WHERE chainage_from BETWEEN 4010 AND 4900 ORDER BY id LIMIT 1")
    before = notes_made(conn)
    conn.execute(change, {"id": row["id"]})
    conn.commit()
    assert notes_made(conn) == before + 2
    assert differences(conn) == []


@pytest.mark.parametrize("person", ["ines", "otto"], indirect=True)
def test_inspectors_and_operators_have_it_kept(conn: psycopg.Connection, survey: int, person: psycopg.Connection) -> None:
    query = "SELECT patches FROM tunnel_api.km_waterproof WHERE km = 4"
    before = ask(conn, query)[0]["patches"]
    conn.commit()
    person.execute("UPDATE tunnel_api.leak SET review = 'rejected' WHERE chainage_from > 4200 AND chainage_to < 4800")
    assert ask(conn, query)[0]["patches"] < before
    assert kept(conn) == [3, 4, 5]
    assert differences(conn) == []


@pytest.mark.parametrize("person", ["otto"], indirect=True)
def test_operators_have_it_kept_of_what_they_change_in_the_tables(
    conn: psycopg.Connection, survey: int, person: psycopg.Connection
) -> None:
    for statement in ("DELETE FROM tunnel.finding WHERE id < 20", "UPDATE tunnel.coverage SET seen = lining"):
        person.execute(statement)
        assert kept(conn) == [3, 4, 5]
        assert differences(conn) == []
        conn.commit()


def test_a_survey_takes_what_is_kept_along(conn: psycopg.Connection, survey: int) -> None:
    conn.execute("UPDATE tunnel_api.leak SET review = 'confirmed'")
    conn.execute("DELETE FROM tunnel.survey")
    conn.commit()
    assert conn.execute("SELECT count(*) FROM tunnel.waterproof").fetchone() == (0,)


def test_emptied_tables_leave_nothing_kept(conn: psycopg.Connection, survey: int) -> None:
    conn.execute("TRUNCATE tunnel.finding CASCADE")
    conn.commit()
    assert differences(conn) == []
    assert conn.execute("SELECT sum(patches) FROM tunnel_api.km_waterproof").fetchone() == (0,)


def test_leaks_with_changes_still_to_be_worked_out_can_be_emptied(conn: psycopg.Connection, survey: int) -> None:
    conn.execute("UPDATE tunnel_api.leak SET review = 'confirmed'")
    conn.execute("TRUNCATE tunnel.finding CASCADE")
    conn.commit()
    assert differences(conn) == []
    assert conn.execute("SELECT sum(patches) FROM tunnel_api.km_waterproof").fetchone() == (0,)


def test_all_surveys_can_be_emptied_at_once(conn: psycopg.Connection, survey: int) -> None:
    conn.execute("TRUNCATE tunnel.survey CASCADE")
    conn.commit()
    assert conn.execute("SELECT count(*) FROM tunnel.waterproof").fetchone() == (0,)


def test_where_nothing_can_be_kept_one_row_stands_for_all_changes(conn: psycopg.Connection, survey: int) -> None:
    # segments that do not end where the kilometres do, as with a spacing of 7 m
    conn.execute("UPDATE tunnel.segment SET chainage_to = chainage_to + 2 WHERE km = 3 AND chainage_to = 4000")
    for review in ("confirmed", "open", "rejected"):
        conn.execute("UPDATE tunnel_api.leak SET review = %s WHERE km = 3", [review])
        conn.commit()
    assert ask(conn, "SELECT count(*)::int AS n FROM tunnel.waterproof WHERE km = 3") == [{"n": 1}]
    assert differences(conn) == []
    install(conn, REGISTRY)
    assert ask(conn, "SELECT count(*)::int AS n FROM tunnel.waterproof WHERE km = 3") == [{"n": 1}]
    conn.execute("UPDATE tunnel.segment SET chainage_to = 4000 WHERE km = 3 AND chainage_to = 4002")
    conn.execute("UPDATE tunnel_api.leak SET review = 'open' WHERE km = 3")
    conn.commit()
    assert kept(conn) == [3, 4, 5]
    assert differences(conn) == []


def test_ends_that_moved_are_noticed(conn: psycopg.Connection, survey: int) -> None:
    conn.execute("DELETE FROM tunnel.segment WHERE chainage_to > 5500")
    assert differences(conn) == []
    conn.commit()
    assert ask(conn, "SELECT chainage_to FROM tunnel_api.km_waterproof WHERE km = 5") == [{"chainage_to": 5500}]


def test_under_a_stricter_isolation_nothing_is_kept_and_all_is_right(
    conn: psycopg.Connection, survey: int, dsn: str, said: list[str]
) -> None:
    conn.execute("SET TRANSACTION ISOLATION LEVEL REPEATABLE READ")
    conn.execute("UPDATE tunnel_api.leak SET review = 'rejected' WHERE chainage_from BETWEEN 4010 AND 4900")
    with connect(dsn) as other:  # whose change of another leak in the same kilometre is no reason to fail
        other.execute("UPDATE tunnel_api.leak SET review = 'confirmed' WHERE id = (SELECT max(id) FROM tunnel.finding)")
    conn.commit()
    assert differences(conn) == []
    assert kept(conn) == [3, 5]
    assert said == []


def test_what_cannot_be_worked_out_is_no_reason_to_refuse_a_change(
    conn: psycopg.Connection, survey: int, said: list[str]
) -> None:
    conn.execute("UPDATE tunnel.coverage SET step = 0 WHERE km = 3")
    conn.commit()
    assert [
        text for text in said if text.startswith(f"the waterproofing of kilometre 3 of survey {survey} is not kept: ")
    ] == said
    assert len(said) == 1  # however many changes there were
    assert ask(conn, "SELECT count(*)::int AS n FROM tunnel.waterproof WHERE km = 3") == [{"n": 1}]
    assert kept(conn) == [4, 5]
    conn.execute("UPDATE tunnel.coverage SET step = 0.1 WHERE km = 3")
    conn.commit()
    assert kept(conn) == [3, 4, 5]
    assert differences(conn) == []


def test_an_upgrade_keeps_what_was_not(conn: psycopg.Connection, survey: int) -> None:
    conn.execute("DELETE FROM tunnel.waterproof")
    assert differences(conn) == []
    conn.commit()
    install(conn, REGISTRY)
    conn.rollback()
    assert (kept(conn), differences(conn)) == ([], []), "right without, and slower"
    conn.rollback()

    def cut_off(_text: str, _total: float | None) -> Callable[[float], None]:
        def advance(_done: float) -> None:
            raise KeyboardInterrupt

        return advance

    with pytest.raises(KeyboardInterrupt):
        keep_missing(conn, cut_off)
    conn.rollback()
    assert kept(conn) == [3], "each kilometre is committed by itself"
    told: list[float | None] = []

    def begin(_text: str, total: float | None) -> Callable[[float], None]:
        told.append(total)
        return lambda _done: None

    assert (keep_missing(conn, begin), told) == (2, [2]), "it goes on with the rest"
    assert (kept(conn), differences(conn)) == ([3, 4, 5], [])
    conn.rollback()
    assert keep_missing(conn, begin) == 0
