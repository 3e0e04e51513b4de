"""A kilometre is swapped without holding up those who read, and those who read for long only delay it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import psycopg
import pytest
from support.loaded_survey import SURVEY, add_survey, load, tube, write

from tunneldb.store.sources import sample
from tunneldb.store.survey import get_survey

COUNT = "SELECT count(*) FROM tunnel.point WHERE survey_id = 1 AND km = 1"


@pytest.fixture
def survey(conn: psycopg.Connection, tmp_path: Path) -> psycopg.Connection:
    """Two kilometres, and a hundred rows that are to take the place of the second."""
    add_survey(conn)
    load(conn, [write(tmp_path / "a.laz", tube(980, 1020, 200, seed=1))])
    return conn


@pytest.fixture
def session(survey: psycopg.Connection, dsn: str) -> Iterator[Callable[[], psycopg.Connection]]:
    opened: list[psycopg.Connection] = []

    def another() -> psycopg.Connection:
        opened.append(psycopg.connect(dsn))
        return opened[-1]

    yield another
    for connection in opened:
        connection.close()


def build(conn: psycopg.Connection, km: int = 1) -> None:
    conn.execute("SELECT tunnel_internal.partition_new(1, %s)", [km])
    conn.execute(f"INSERT INTO tunnel.point_s1_km{km}_new SELECT * FROM tunnel.point_s1_km{km} ORDER BY chainage LIMIT 100")


def test_a_long_reader_delays_the_swap_and_nobody_else(
    survey: psycopg.Connection, session: Callable[[], psycopg.Connection]
) -> None:
    long, worker, short = session(), session(), session()
    (before,) = long.execute(COUNT).fetchone()  # in a transaction that stays open
    build(worker)
    swap = threading.Thread(target=worker.execute, args=("SELECT tunnel_internal.partition_swap(1, 1)",))
    swap.start()
    for _ in range(20):
        time.sleep(0.05)
        short.execute("SET statement_timeout = '1s'")
        assert short.execute(COUNT).fetchone() == (before,)
        short.rollback()
    assert swap.is_alive()
    assert long.execute(COUNT).fetchone() == (before,)
    long.commit()
    swap.join(20)
    assert not swap.is_alive()
    worker.commit()
    assert long.execute(COUNT).fetchone() == short.execute(COUNT).fetchone() == (100,)


def test_a_swap_that_gives_up_says_why(survey: psycopg.Connection, session: Callable[[], psycopg.Connection]) -> None:
    long, worker = session(), session()
    before = long.execute(COUNT).fetchone()
    build(worker)
    worker.execute("SET LOCAL lock_timeout = '300ms'")
    with pytest.raises(
        psycopg.errors.LockNotAvailable, match=rf"kilometre 1 cannot be swapped in: .* \(sessions {long.info.backend_pid}\)"
    ):
        worker.execute("SELECT tunnel_internal.partition_swap(1, 1)")
    worker.rollback()
    assert worker.execute(COUNT).fetchone() == before


def test_the_sessions_own_timeout_stays(survey: psycopg.Connection) -> None:
    build(survey)
    survey.execute("SET LOCAL lock_timeout = '7s'")
    survey.execute("SELECT tunnel_internal.partition_swap(1, 1)")
    assert survey.execute("SHOW lock_timeout").fetchone() == ("7s",)


def test_what_a_stage_reads_of_a_kilometre_does_not_lock_the_others(
    survey: psycopg.Connection, session: Callable[[], psycopg.Connection]
) -> None:
    """Two workers on different kilometres never wait for each other."""
    reader, worker = session(), session()
    shifts = reader.execute(
        "SELECT count(*) FROM tunnel_internal.axis_shift(1, '{98,99}', '{500010,500020}', '{4500000,4500000}', '{100,100}')"
    ).fetchone()
    assert shifts == (2,)
    frame = "{500010,4500000,100, 1,0,0, 0,-1,0, 0,0,1}"
    slab = reader.execute("SELECT count(*) FROM tunnel_internal.section_slab(1, 981, %s, 0.5)", [frame]).fetchone()
    assert slab > (100,)
    assert len(sample(reader, get_survey(reader, SURVEY), 0)) > 1000
    build(worker)
    worker.execute("SET LOCAL lock_timeout = '500ms'")
    worker.execute("SELECT tunnel_internal.partition_swap(1, 1)")
    worker.commit()
    assert reader.execute(COUNT).fetchone() == (100,)


def test_slabs_reach_into_the_kilometre_next_door(survey: psycopg.Connection) -> None:
    frame = "{500030,4500000,100, 1,0,0, 0,-1,0, 0,0,1}"
    both, here = (
        survey.execute(f"SELECT count(*) FROM {source}", parameters).fetchone()
        for source, parameters in (
            ("tunnel_internal.section_slab(1, 1000, %s, 2)", [frame]),
            ("tunnel.point WHERE chainage BETWEEN 998 AND 1002", []),
        )
    )
    assert both == here


def test_first_kilometres_of_a_survey_at_once(survey: psycopg.Connection, session: Callable[[], psycopg.Connection]) -> None:
    """The table that holds them is made once; nobody who reads waits."""
    survey.execute("INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_kind, platform)"
                   " SELECT tunnel_id, 'other', date, 'none', platform FROM tunnel.survey")  # fmt: skip
    (number,) = survey.execute("SELECT max(id) FROM tunnel.survey").fetchone()
    survey.commit()
    reader, one, two = session(), session(), session()
    reader.execute("SELECT count(*) FROM tunnel.point")
    for worker, km in ((one, 0), (two, 1)):
        worker.execute("SELECT tunnel_internal.partition_new(%s, %s)", [number, km])
    one.execute("SET LOCAL lock_timeout = '500ms'")
    one.execute("SELECT tunnel_internal.partition_swap(%s, 0)", [number])
    swap = threading.Thread(target=two.execute, args=("SELECT tunnel_internal.partition_swap(%s, 1)", [number]))
    swap.start()
    one.commit()
    swap.join(20)
    two.commit()
    assert reader.execute(
        "SELECT count(*) FROM pg_partition_tree(%s) WHERE isleaf", [f"tunnel.point_s{number}"]
    ).fetchone() == (2,)
