"""Which jobs are ready, on ledgers made by hand: one letter a stage, of load, axis, segments, sections, ground and detect.

d done, R ready, w waits, f failed, b blocked by an earlier failure, e empty, q queued, r running.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any

import psycopg
import pytest
from psycopg import sql
from psycopg.types.json import Jsonb

STAGES = ("load", "axis", "segments", "sections", "ground", "detect")
LETTERS = {"ready": "R", "running": "r"}
# What each stage needs, (kilometre, stage) relative to its own: written down apart from the SQL.
NEEDS = {
    "load": [],
    "axis": [(-1, "load"), (0, "load"), (1, "load")],
    "segments": [(-1, "axis"), (0, "axis"), (1, "axis"), (0, "load")],
    "sections": [(-1, "segments"), (0, "segments"), (1, "segments")],
    "ground": [(-1, "sections"), (0, "sections"), (1, "sections")],
    "detect": [(-1, "ground"), (0, "ground"), (1, "ground")],
}


class Ledger:
    """A survey whose history is written row by row; each run lasts half a minute and begins a minute after the one before."""

    def __init__(self, conn: psycopg.Connection) -> None:
        self.conn = conn
        self.minute = 0
        tunnel = self.one(
            "INSERT INTO tunnel.tunnel (name, srid, start_chainage, alignment) VALUES ('t', 25830, 0, "
            "'SRID=25830;LINESTRING Z (0 0 0, 9000 0 0)') RETURNING id"
        )
        self.survey = self.one(
            "INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_kind, platform) "
            "VALUES (%s, 's', '2024-05-04', 'none', 'static') RETURNING id",
            tunnel,
        )
        conn.execute(
            sql.SQL("CREATE TABLE tunnel.{} PARTITION OF tunnel.point FOR VALUES IN ({}) PARTITION BY LIST (km)").format(
                sql.Identifier(f"point_s{self.survey}"), sql.Literal(self.survey)
            )
        )

    def one(self, query: str, *arguments: Any) -> Any:
        row = self.conn.execute(query, arguments).fetchone()
        assert row is not None
        return row[0]

    def want(self, *kilometres: int, stage: str = "detect", **parameters: Any) -> Ledger:
        for km in kilometres:
            self.conn.execute(
                "INSERT INTO tunnel.goal (survey_id, km, stage, parameters) VALUES (%s, %s, %s, %s)"
                " ON CONFLICT (survey_id, km) DO UPDATE SET stage = excluded.stage, parameters = excluded.parameters",
                [self.survey, km, stage, Jsonb({name.replace("__", "."): value for name, value in parameters.items()})],
            )
        return self

    def ran(self, km: int, stage: str, outcome: str = "done", message: str | None = None, **parameters: Any) -> Ledger:
        self.minute += 1
        if stage == "load" and outcome == "done":
            self.conn.execute(
                sql.SQL("CREATE TABLE IF NOT EXISTS tunnel.{} PARTITION OF tunnel.{} FOR VALUES IN ({})").format(
                    sql.Identifier(f"point_s{self.survey}_km{km}"), sql.Identifier(f"point_s{self.survey}"), sql.Literal(km)
                )
            )
            self.conn.execute("UPDATE tunnel.file_km SET loaded_at = clock_timestamp() WHERE km = %s", [km])
        self.conn.execute(
            "INSERT INTO tunnel.run (survey_id, km, stage, outcome, message, parameters, started_at, finished_at, backend_pid,"
            " backend_start) SELECT %s, %s, %s, %s, %s, %s, t, t + '30 s', 999999, '2020-01-01'"
            " FROM (SELECT timestamptz '2024-05-05' + make_interval(mins => %s)) AS m (t)",
            [
                self.survey, km, stage, "running" if outcome == "interrupted" else outcome, message,
                Jsonb({name.replace("__", "."): value for name, value in parameters.items()}), self.minute,
            ],
        )  # fmt: skip
        return self

    def through(self, *kilometres: int, stage: str = "detect") -> Ledger:
        for step in STAGES[: STAGES.index(stage) + 1]:
            for km in kilometres:
                self.ran(km, step)
        return self

    def read(self, name: str, *kilometres: int) -> Ledger:
        """A file that was read and waits to be loaded."""
        self.minute += 1
        file = self.one(
            "INSERT INTO tunnel.scan_file (survey_id, name, path, checksum, bytes, points, noise, outside, thinned, kept)"
            " VALUES (%s, %s, %s, 'x', 1, 1, 0, 0, 0, 0) RETURNING id",
            self.survey,
            name,
            f"/scans/{name}",
        )
        for km in kilometres:
            self.conn.execute(
                "INSERT INTO tunnel.file_km (file_id, km, rows, points, read_at)"
                " VALUES (%s, %s, 1, '{[0,1)}', timestamptz '2024-05-05' + make_interval(mins => %s))",
                [file, km, self.minute],
            )
        return self

    def await_file(self, name: str, first: int | None, last: int | None, message: str | None = None) -> Ledger:
        self.conn.execute(
            "INSERT INTO tunnel.incoming (survey_id, name, path, bytes, points, km_from, km_to, failed_at, message)"
            " VALUES (%s, %s, %s, 1, 1, %s, %s, CASE WHEN %s::text IS NOT NULL THEN clock_timestamp() END, %s)",
            [self.survey, name, f"/scans/{name}", first, last, message, message],
        )
        return self

    def states(self) -> dict[int, str]:
        found: dict[int, str] = {}
        for km, state in self.conn.execute(
            "SELECT km, state FROM tunnel_internal.queue_state(%s) ORDER BY km, step", [self.survey]
        ).fetchall():
            found[km] = found.get(km, "") + LETTERS.get(state, state[0])
        return found

    def plan(self) -> list[tuple[int | str, str]]:
        """Jobs that wait, in the order in which workers take them, after planning."""
        self.conn.execute("SELECT tunnel_internal.queue_plan(%s)", [self.survey])
        return [
            (args["km"] if "km" in args else args["file"], args["stage"])
            for (args,) in self.conn.execute(
                "SELECT args FROM tunnel_queue.procrastinate_jobs WHERE status = 'todo' ORDER BY priority DESC, id"
            ).fetchall()
        ]


@pytest.fixture
def ledger(conn: psycopg.Connection) -> Ledger:
    return Ledger(conn)


CASES: dict[str, tuple[Callable[[Ledger], object], dict[int, str]]] = {
    "a file is awaited": (lambda s: s.want(0).await_file("a", 0, 0), {0: "wwwwww"}),
    "a file was read": (lambda s: s.want(0).read("a", 0), {0: "Rwwwww"}),
    "one was read, another is awaited": (lambda s: s.want(0).read("a", 0).await_file("b", 0, 0), {0: "wwwwww"}),
    "the axis waits for the neighbours' points": (
        lambda s: s.want(0, 1, 2).ran(0, "load").ran(1, "load").read("a", 2),
        {0: "dRwwww", 1: "dwwwww", 2: "Rwwwww"},
    ),
    "segments wait for the neighbours' axes": (
        lambda s: s.want(0, 1, 2).through(0, 1, 2, stage="load").ran(0, "axis").ran(1, "axis"),
        {0: "ddRwww", 1: "ddwwww", 2: "dRwwww"},
    ),
    "the ground waits for the neighbours' sections": (
        lambda s: s.want(0, 1).through(0, 1, stage="segments").ran(0, "sections"),
        {0: "ddddww", 1: "dddRww"},
    ),
    "detection waits for the neighbours' ground": (
        lambda s: s.want(0, 1).through(0, 1, stage="sections").ran(0, "ground"),
        {0: "dddddw", 1: "ddddRw"},
    ),
    "detection of a database from before there was a ground": (
        lambda s: s.want(0).through(0, stage="sections").ran(0, "detect"),
        {0: "ddddRw"},
    ),
    "other parameters of the ground are wanted": (
        lambda s: s.want(0, cluster__region=0.2).through(0, stage="sections").ran(0, "ground", cluster__region=0.4),
        {0: "ddddRw"},
    ),
    "all is done": (lambda s: s.want(0, 1).through(0, 1), {0: "dddddd", 1: "dddddd"}),
    "the goal ends before the last stage": (lambda s: s.want(0, stage="segments").through(0, stage="axis"), {0: "ddR"}),
    "a neighbour that failed is not waited for": (
        lambda s: s.want(0, 1).ran(0, "load").read("a", 1).ran(1, "load", "failed", "why"),
        {0: "dRwwww", 1: "fbbbbb"},
    ),
    "nor one that failed earlier": (
        lambda s: s.want(0, 1).through(0, 1, stage="load").ran(0, "axis").ran(1, "axis", "failed", "why"),
        {0: "ddRwww", 1: "dfbbbb"},
    ),
    "nor one whose file failed": (
        lambda s: s.want(0, 1).ran(0, "load").await_file("a", 1, 1, "torn"),
        {0: "dRwwww", 1: "fbbbbb"},
    ),
    "nor an empty one": (lambda s: s.want(0, 1).ran(0, "load"), {0: "dRwwww", 1: "eeeeee"}),
    "nor one that is not wanted": (lambda s: s.want(0).ran(0, "load").ran(1, "load"), {0: "dRwwww"}),
    "nor one that is wanted less far": (
        lambda s: s.want(0).want(1, stage="load").through(0, stage="axis").ran(1, "load").ran(0, "axis"),
        {0: "ddRwww", 1: "d"},
    ),
    "a file that may lie anywhere holds up nothing": (
        lambda s: s.want(0).ran(0, "load").await_file("a", None, None, "torn"),
        {0: "dRwwww"},
    ),
    "a file that failed holds up its kilometres, loaded or not": (
        lambda s: s.want(0, 1, 2).through(0, 1, 2, stage="load").await_file("a", 1, 1, "torn"),
        {0: "dRwwww", 1: "fbbbbb", 2: "dRwwww"},
    ),
    "a neighbour that comes later is taken in": (
        lambda s: s.want(0, 1, 2).through(0, 1).read("a", 2).ran(2, "load"),
        {0: "ddwwww", 1: "dRwwww", 2: "dRwwww"},
    ),
    "what rests on an open neighbour waits, though it was done": (
        lambda s: s.want(0, 1, 2).through(0, 1, 2).read("a", 2),
        {0: "ddwwww", 1: "dwwwww", 2: "Rwwwww"},
    ),
    "a stage that failed is left": (lambda s: s.want(0).ran(0, "load").ran(0, "axis", "failed", "why"), {0: "dfbbbb"}),
    "until what it rests on changes": (
        lambda s: s.want(0).ran(0, "load").ran(0, "axis", "failed", "why").ran(0, "load"),
        {0: "dRwwww"},
    ),
    "or a neighbour does": (
        lambda s: s.want(0, 1).ran(0, "load").ran(0, "axis", "failed", "why").ran(1, "load"),
        {0: "dRwwww", 1: "dRwwww"},
    ),
    "or its parameters": (
        lambda s: s.want(0, axis__tolerance=0.1).ran(0, "load").ran(0, "axis", "failed", "why", axis__tolerance=0.2),
        {0: "dRwwww"},
    ),
    "but not those of other stages": (
        lambda s: s.want(0, leak__min_area=0.1).ran(0, "load").ran(0, "axis", "failed", "why", axis__tolerance=0.2),
        {0: "dfbbbb"},
    ),
    "a load that failed is tried again with another file": (
        lambda s: s.want(0).read("a", 0).ran(0, "load", "failed", "why").read("b", 0),
        {0: "Rwwwww"},
    ),
    "a run whose session is gone is repeated": (
        lambda s: s.want(0).ran(0, "load").ran(0, "axis", "interrupted"),
        {0: "dRwwww"},
    ),
    "a later failure does not undo what is there": (
        lambda s: s.want(0).through(0).ran(0, "sections", "failed", "why"),
        {0: "dddddd"},
    ),
    "other parameters are wanted": (
        lambda s: s.want(0, section__angle_step=10).through(0, stage="segments").ran(0, "sections", section__angle_step=5),
        {0: "dddRww"},
    ),
    "the same parameters are wanted": (
        lambda s: s.want(0, section__angle_step=5).through(0, stage="segments").ran(
            0, "sections", section__angle_step=5.0, section__min_points=5),
        {0: "ddddRw"},
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_what_is_ready(ledger: Ledger, case: str) -> None:
    make, expected = CASES[case]
    make(ledger)
    assert ledger.states() == expected


def test_failures_say_why(ledger: Ledger) -> None:
    ledger.want(0, 1).ran(0, "load").ran(0, "axis", "failed", "too few points").await_file("a.laz", 1, 1, "torn").await_file(
        "b.laz", 2, 2, "/b.laz: torn"
    ).want(2)
    failed = ledger.conn.execute(
        "SELECT km, stage, message FROM tunnel_internal.queue_state(%s) WHERE state = 'failed' ORDER BY km", [ledger.survey]
    )
    assert failed.fetchall() == [
        (0, "axis", "too few points"),
        (1, "load", "file a.laz: torn"),
        (2, "load", "/b.laz: torn"),
    ]


def test_what_failed_before_it_was_asked_for_again_is_tried_again(ledger: Ledger) -> None:
    ledger.want(0).ran(0, "load").ran(0, "axis", "failed", "why")
    ledger.conn.execute("UPDATE tunnel.goal SET retry_after = '2024-05-05 00:02:29'")  # it failed at 00:02:30
    assert ledger.states() == {0: "dfbbbb"}
    ledger.conn.execute("UPDATE tunnel.goal SET retry_after = '2024-05-05 00:02:31'")
    assert ledger.states() == {0: "dRwwww"}


def test_a_vertex_moved_by_hand_has_segments_made_anew(ledger: Ledger) -> None:
    ledger.want(0, 1).through(0, 1)
    ledger.conn.execute(
        "INSERT INTO tunnel.axis_vertex (survey_id, n, km, geom, given, points, source, edited_by, edited_at)"
        " SELECT %s, 50, 0, g, g, 0, 'edited', 'me', clock_timestamp()"
        "   FROM (SELECT ST_SetSRID(ST_MakePoint(500, 1, 0), 25830)) AS p (g)",
        [ledger.survey],
    )
    # a segment that was made while it stood a metre aside
    ledger.conn.execute(
        "INSERT INTO tunnel.segment (survey_id, n, km, chainage_from, chainage_to, vertex_from, vertex_to, tangent_from,"
        " tangent_to, geom, points) SELECT %s, 50, 0, 500, 510, '{500,0,0}', '{510,0,0}', '{1,0,0}', '{1,0,0}',"
        " ST_SetSRID(ST_GeomFromText('LINESTRING Z (500 0 0, 510 0 0)'), 25830), 0",
        [ledger.survey],
    )
    assert ledger.states() == {0: "ddRwww", 1: "dddwww"}


def test_jobs_are_deferred_once(ledger: Ledger) -> None:
    ledger.want(0, 1).ran(0, "load").read("a", 1).await_file("b", 3, 4)
    assert ledger.plan() == [(1, "load"), ("b", "read")]
    assert ledger.plan() == [(1, "load"), ("b", "read")]
    assert ledger.states() == {0: "dwwwww", 1: "qwwwww"}
    ledger.conn.execute("UPDATE tunnel_queue.procrastinate_jobs SET status = 'doing'")
    assert ledger.plan() == []
    assert ledger.states() == {0: "dwwwww", 1: "rwwwww"}


def test_a_kilometre_is_finished_before_the_next_is_begun(ledger: Ledger) -> None:
    ledger.want(0, 2, 4, 5).through(0, stage="ground").through(2, stage="segments").read("a", 4)
    ledger.await_file("b", 5, 5).await_file("c", 9, 9)
    # detection holds nothing up, and lags behind
    assert ledger.plan() == [(2, "sections"), (4, "load"), ("b", "read"), (0, "detect"), ("c", "read")]


def test_a_part_is_planned_as_the_whole_is(ledger: Ledger) -> None:
    """The end of a stage looks at five kilometres to both sides only: no other can have become ready."""
    rng = random.Random(1)
    ledger.want(*range(30))
    for km in range(30):
        ledger.ran(km, "load")
    for _ in range(150):
        km, stage = rng.randrange(30), rng.choice(STAGES)
        ledger.ran(km, stage, rng.choice(["done", "done", "done", "failed"]), "why")
    whole = ledger.states()
    for km in range(30):
        part = ledger.conn.execute(
            "SELECT km, string_agg(CASE state WHEN 'ready' THEN 'R' ELSE left(state, 1) END, '' ORDER BY step)"
            "  FROM tunnel_internal.queue_state(%s, %s, %s) GROUP BY km",
            [ledger.survey, km, km],
        ).fetchall()
        assert part == [(km, whole[km])]


@pytest.mark.parametrize("seed", range(3))
def test_from_files_to_leaks_each_stage_is_done_once_and_after_what_it_needs(ledger: Ledger, seed: int) -> None:
    """Workers that take and end jobs at random, some of which fail: nothing is forgotten, done twice or too early."""
    rng = random.Random(seed)
    kilometres = range(8)
    ledger.want(*kilometres)
    files = {f"f{km}": range(km, min(km + 2, 8)) for km in kilometres}
    for name, reach in files.items():
        ledger.await_file(name, reach[0], reach[-1])
    failing = {(3, "axis"), (6, "sections")}
    done: list[tuple[int | str, str]] = []
    failed: set[int] = set()
    doing: dict[int, tuple[int | str, str]] = {}
    ledger.plan()
    while True:
        row = ledger.conn.execute(
            "SELECT id, args FROM tunnel_queue.procrastinate_fetch_job_v2(ARRAY['tunneldb'], NULL) WHERE id IS NOT NULL"
        ).fetchone()
        if row is not None:
            what = (row[1].get("km", row[1].get("file")), row[1]["stage"])
            _may_begin(what, done, failed, files)
            doing[row[0]] = what
        if row is not None and len(doing) < 3:
            continue
        if not doing:
            break
        job = rng.choice(list(doing))
        subject, stage = doing.pop(job)
        if (subject, stage) in failing:
            _record(ledger, subject, stage, "failed")
            failed.add(subject)
            ledger.conn.execute("SELECT tunnel_internal.queue_fail(%s, 'why')", [job])
            continue
        done.append((subject, stage))
        if stage == "read":
            ledger.read(str(subject), *files[str(subject)])
        else:
            _record(ledger, subject, stage, "done")
        ledger.conn.execute("SELECT tunnel_internal.queue_done(%s, clock_timestamp())", [job])
    assert sorted(map(str, done)) == sorted(
        map(
            str,
            [(name, "read") for name in files]
            + [(km, stage) for km in kilometres for stage in STAGES if not _behind(km, stage, failing)],
        )
    )


def _record(ledger: Ledger, km: Any, stage: str, outcome: str) -> None:
    ledger.ran(km, stage, outcome)
    ledger.conn.execute(
        "UPDATE tunnel.run SET started_at = clock_timestamp(), finished_at = clock_timestamp()"
        " WHERE id = (SELECT max(id) FROM tunnel.run)"
    )


def _behind(km: int, stage: str, failing: set[tuple[int, str]]) -> bool:
    return any(km == other and STAGES.index(stage) >= STAGES.index(first) for other, first in failing)


def _may_begin(what: tuple[Any, str], done: list[tuple[int | str, str]], failed: set[int], files: dict[str, range]) -> None:
    subject, stage = what
    if stage == "read":
        return
    if stage == "load":
        assert all((name, "read") in done for name, reach in files.items() if subject in reach)
    for way, needed in NEEDS[stage]:
        other = subject + way
        if other in range(8) and other not in failed:
            assert (other, needed) in done, f"{what} before {needed} of {other}"
