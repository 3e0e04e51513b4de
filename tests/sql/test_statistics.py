"""Coverage, statistics of leaks and classes of waterproofing, against sums, clips and sliding windows made in Python."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import psycopg
import pytest
import shapely
from psycopg import sql
from psycopg.conninfo import make_conninfo
from psycopg.rows import dict_row
from shapely.affinity import rotate
from shapely.geometry import Point, Polygon, box

from tunneldb.database import connect

GIRTH = 18.0
STEP = 0.1


Sums = tuple[np.ndarray, np.ndarray]
"""Chainages and what lies before each."""


def summed(start: float, what: dict[int, np.ndarray]) -> Sums:
    """Sum up the steps of kilometres; nothing is known of those between."""
    x, y = [start], [0.0]
    for km in sorted(what):
        x += (km * 1000 + STEP * np.arange(len(what[km]) + 1)).tolist()
        y += (y[-1] + np.concatenate([[0.0], np.cumsum(what[km].astype(float))])).tolist()
    return np.array(x), np.array(y)


@dataclass
class Made:
    """A survey in three kilometres, of which the second is not detected yet.

    Attributes
    ----------
    start, end : float
        Its segments, m.
    lining, seen, wet : Sums
        Coverage of the kilometres.
    leaks : dict of int to (Polygon, area)
        What counts as a leak, by id, with the area on the surface, which differs from that in the plane.
    """

    start: float
    end: float
    lining: Sums
    seen: Sums
    wet: Sums
    leaks: dict[int, tuple[Polygon, float]]

    def upto(self, what: Sums, chainage: Any) -> Any:
        return np.interp(chainage, *what)

    def between(self, what: Sums, low: float, high: float) -> float:
        return float(np.diff(self.upto(what, [low, high]))[0])

    def parts(self, low: float, high: float) -> dict[int, tuple[float, float, float]]:
        """Leaks in a stretch: area of the part in it, and where that begins and ends."""
        found = {}
        for key, (outline, area) in self.leaks.items():
            west, _, east, _ = outline.bounds
            if east > low and west < high:
                share = outline.intersection(box(low, -50, high, 50)).area / outline.area
                found[key] = (area * share, max(west, low), min(east, high))
        return found


def add_survey(conn: psycopg.Connection, start: int, end: int) -> int:
    tunnel = conn.execute(
        "INSERT INTO tunnel.tunnel (name, srid, start_chainage, spacing, alignment) "
        "VALUES ('t', 25830, 0, 10, 'SRID=25830;LINESTRING Z (0 0 0, 1 0 0)') RETURNING id"
    ).fetchone()[0]
    survey = conn.execute(
        "INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_dimension, intensity_kind, platform) "
        "VALUES (%s, 's', '2024-01-01', 'Reflectance', 'reflectance', 'mobile') RETURNING id",
        (tunnel,),
    ).fetchone()[0]
    conn.execute(
        "INSERT INTO tunnel.segment (survey_id, n, km, chainage_from, chainage_to, vertex_from, vertex_to, tangent_from, "
        "tangent_to, geom, points) SELECT %s, n, n / 100, 10 * n, 10 * n + 10, '{0,0,0}', '{1,0,0}', '{1,0,0}', '{1,0,0}', "
        "'SRID=25830;LINESTRING Z (0 0 0, 1 0 0)', 1 FROM generate_series(%s::int, %s::int) n",
        (survey, start // 10, end // 10 - 1),
    )
    return int(survey)


def add_leak(conn: psycopg.Connection, survey: int, outline: Polygon, area: float, **others: object) -> int:
    west, south, east, north = outline.bounds
    values = {
        "survey_id": survey, "km": int((west + east) / 2 // 1000), "chainage_from": west, "chainage_to": east,
        "arc_from": south, "arc_to": north, "clock": 12, "area": area, "darkening_mean": 3, "darkening_max": 4,
        "image_share": 1,
        "unrolled": outline.wkt, "map": outline.wkt, "surface": shapely.force_3d(outline).wkt, **others,
    }  # fmt: skip
    places = ", ".join(f"%({name})s" for name in values)
    row = conn.execute(
        f"INSERT INTO tunnel.finding ({', '.join(values)}) VALUES ({places}) RETURNING id",  # type: ignore[arg-type]
        values,
    ).fetchone()
    assert row is not None
    return int(row[0])


def add_coverage(conn: psycopg.Connection, survey: int, km: int, *what: np.ndarray) -> None:
    conn.execute(
        "INSERT INTO tunnel.coverage (survey_id, km, step, lining, seen, wet) VALUES (%s, %s, %s, %s, %s, %s)",
        (survey, km, STEP, *(values.tolist() for values in what)),
    )


@pytest.fixture(scope="module", params=[1, 2])
def rows(request: pytest.FixtureRequest, server_dsn: str, template: str) -> Iterator[psycopg.Connection]:
    """Connection to a database of the tests that only read."""
    name = sql.Identifier(f"statistics_{request.param}")
    with psycopg.connect(server_dsn, autocommit=True) as connection:
        connection.execute(sql.SQL("CREATE DATABASE {} TEMPLATE {}").format(name, sql.Identifier(template)))
    with connect(make_conninfo(server_dsn, dbname=f"statistics_{request.param}")) as connection:
        yield connection


@pytest.fixture(scope="module")
def made(rows: psycopg.Connection) -> Made:
    """Leaks of all sizes and directions on lining of changing width, some of it unseen, with what does not count."""
    conn = rows
    rng = np.random.default_rng(int(conn.info.dbname.removeprefix("statistics_")))
    start, end = 3200, 5850
    survey = add_survey(conn, start, end)
    lining, seen, wet = {}, {}, {}
    for km in (3, 5):
        at = km * 1000 + STEP * (np.arange(10_000) + 0.5)
        width = GIRTH + 4 * np.sin(at / 37) + rng.normal(0, 0.2, len(at))
        width[(at > 3700) & (at < 3712)] = 0  # open to the sky
        lining[km] = np.where((at > start) & (at < end), STEP * width, 0).astype(np.float32)
        seen[km] = (lining[km] * rng.uniform(0.7, 1, len(at))).astype(np.float32)
        wet[km] = (seen[km] * rng.uniform(0, 0.1, len(at))).astype(np.float32)
        add_coverage(conn, survey, km, lining[km], seen[km], wet[km])
    leaks = {}
    for number in range(260):
        middle = rng.uniform(start + 4, end - 4) if number < 220 else rng.normal(5300, 6)
        shape = Polygon([(0, -1), (0.3, -1.2), (1, 0), (0.2, 0.9), (0.4, 0.1), (-0.8, 0.3)])
        scale = np.exp(rng.normal(-0.8, 0.8, 2))
        outline = shapely.transform(rotate(shape, rng.uniform(0, 360)), lambda xy, s=scale: xy * s)  # type: ignore[misc]
        outline = shapely.transform(outline, lambda xy, m=middle: xy + np.array([m, rng.uniform(-7, 7)]))  # type: ignore[misc]
        area = outline.area * rng.uniform(0.95, 1.05)
        leaks[add_leak(conn, survey, outline, area)] = (outline, area)
    for others in ({"kind": "joint"}, {"kind_override": "dark"}, {"review": "rejected"}, {"detected": False}):
        add_leak(conn, survey, Point(3500, 1).buffer(3), 28, **others)
    judged = Point(3300, 1).buffer(0.4)
    leaks[add_leak(conn, survey, judged, 0.5, kind="joint", kind_override="leak", review="confirmed")] = (judged, 0.5)
    return Made(start, end, summed(3000, lining), summed(3000, seen), summed(3000, wet), leaks)


def ask(conn: psycopg.Connection, query: str, *values: object) -> list[dict[str, Any]]:
    with conn.cursor(row_factory=dict_row) as cursor:
        return cursor.execute(query, values).fetchall()  # type: ignore[arg-type]


def searched(low: float, high: float) -> float:
    """Share of a stretch that was searched: nothing is known of kilometre 4, which counts as unseen."""
    return (high - low - max(0, min(high, 5000) - max(low, 4000))) / (high - low)


def windows(made: Made, low: float, high: float) -> tuple[int, float]:
    """Most leaks and greatest wet area in 100 m² of lining, by sliding a window in small steps."""
    a, b = made.upto(made.lining, [low, high])
    area, west, east = np.array([*made.parts(low, high).values()]).reshape(-1, 3).T
    if b - a <= 100:
        return len(area), float(area.sum())
    p, q = made.upto(made.lining, west), made.upto(made.lining, east)
    area, p, q = area[q > p], p[q > p], q[q > p]
    places = np.concatenate([p, p - 100, q, q - 100, [a, b - 100], np.arange(a, b - 100, 5.0)])
    places = np.unique(places[(places >= a) & (places <= b - 100)])
    s = np.concatenate([places, (places[:-1] + places[1:]) / 2])[:, None]
    shared = np.clip(np.minimum(q, s + 100) - np.maximum(p, s), 0, None)
    return int(((p <= s + 100) & (q >= s)).sum(axis=1).max()), float((area * shared / (q - p)).sum(axis=1).max())


STRETCHES = [(3200, 5850), (3333.33, 3487.654), (5290, 5310), (5298.4, 5299.8), (3695, 3705), (3650, 3990), (3900, 5100)]


@pytest.mark.parametrize(("low", "high"), STRETCHES)
def test_coverage_is_summed_with_shares_of_steps(rows: psycopg.Connection, made: Made, low: float, high: float) -> None:
    (row,) = ask(rows, "SELECT * FROM tunnel_api.coverage('s', %s, %s)", low, high)
    lining, seen, wet = (made.between(what, low, high) for what in (made.lining, made.seen, made.wet))
    assert row == {
        "lining_area": pytest.approx(lining), "seen_area": pytest.approx(seen),
        "seen_share": pytest.approx(seen / lining * searched(low, high)),
        "wet_pixel_area": pytest.approx(wet), "wet_pixel_share": pytest.approx(wet / seen),
    }  # fmt: skip


@pytest.mark.parametrize(("low", "high"), STRETCHES)
def test_statistics_are_those_of_clipped_leaks_and_sliding_windows(
    rows: psycopg.Connection, made: Made, low: float, high: float
) -> None:
    (row,) = ask(rows, "SELECT * FROM tunnel_api.leak_statistics('s', %s, %s)", low, high)
    parts = made.parts(low, high)
    wet = sum(area for area, _, _ in parts.values())
    seen = made.between(made.seen, low, high)
    lining = made.between(made.lining, low, high)
    assert (row["lining_area"], row["seen_area"]) == (pytest.approx(lining), pytest.approx(seen))
    assert row["seen_share"] == pytest.approx(seen / lining * searched(low, high))
    assert row["searched_share"] == pytest.approx(searched(low, high))
    assert (row["wet_area"], row["wet_ratio"]) == (pytest.approx(wet), pytest.approx(wet / seen))
    whole = {key: made.leaks[key][1] for key in parts}
    assert (row["patches"], row["largest_area"]) == (len(parts), max(whole.values(), default=None))
    assert whole.get(row["largest_leak"]) == row["largest_area"]
    most, wettest = windows(made, low, high)
    assert row["window_patches"] == most == len(row["window_leaks"] or [])
    assert row["window_wet_area"] == pytest.approx(wettest, rel=1e-6)
    # that window holds those leaks, and 100 m² of lining if there is so much
    assert low <= row["window_from"] < row["window_to"] <= high
    assert made.between(made.lining, row["window_from"], row["window_to"]) == pytest.approx(min(100, lining), rel=1e-6)
    assert set(row["window_leaks"] or []) == set(made.parts(row["window_from"], row["window_to"]))


@pytest.mark.parametrize(("length", "first"), [(1.5, 3199.2), (10.0, 3250.0), (300.0, 2000.0)])
def test_rings_are_stretches_of_their_own(rows: psycopg.Connection, made: Made, length: float, first: float) -> None:
    rings = ask(rows, "SELECT * FROM tunnel_api.ring_statistics('s', %s, %s)", length, first)
    assert rings[0]["chainage_from"] <= max(made.start, first) < rings[0]["chainage_to"]
    assert rings[-1]["chainage_from"] < made.end <= rings[-1]["chainage_to"]
    assert [row["number"] for row in rings] == list(range(rings[0]["number"], rings[-1]["number"] + 1))
    assert rings[0]["chainage_from"] == pytest.approx(first + (rings[0]["number"] - 1) * length)
    for row in rings:
        low, high = row["chainage_from"], row["chainage_to"]
        parts = made.parts(low, high)
        wet, seen = sum(area for area, _, _ in parts.values()), made.between(made.seen, low, high)
        none = not parts and not searched(low, high)  # that there are none is said only where they were searched for
        assert (row["patches"], row["wet_area"]) == ((None, None) if none else (len(parts), pytest.approx(wet, abs=1e-9)))
        assert row["wet_ratio"] == (pytest.approx(wet / seen) if seen else None)
        largest = max((made.leaks[key][1] for key in parts), default=0)
        assert row["largest_area"] == (largest or None)
        most = windows(made, low, high)[0]
        best = 1 if not parts else 2 if wet <= 0.002 * seen and largest <= 0.2 and most <= 3 else 3
        best = 4 if best == 3 and (largest > 0.3 or most > 7) else best
        assert row["class"] == (best if seen else None), row
    assert {row["class"] for row in rings} >= ({1, 4, None} if length < 20 else {4})


def test_rings_of_a_stretch_are_those_that_reach_into_it(rows: psycopg.Connection, made: Made) -> None:
    every = ask(rows, "SELECT * FROM tunnel_api.ring_statistics('s', 1.5, 3199.2)")
    some = ask(rows, "SELECT * FROM tunnel_api.ring_statistics('s', 1.5, 3199.2, 3300, 3350)")
    inside = [ring for ring in every if ring["chainage_to"] > 3300 and ring["chainage_from"] < 3350]
    assert [ring["number"] for ring in some] == [ring["number"] for ring in inside]
    assert 33 <= len(some) <= 36
    for ring, same in zip(some, inside, strict=True):
        assert (ring["patches"], ring["largest_area"], ring["class"]) == (same["patches"], same["largest_area"], same["class"])
        assert (ring["lining_area"], ring["wet_area"]) == (pytest.approx(same["lining_area"]), pytest.approx(same["wet_area"]))
    assert ask(rows, "SELECT * FROM tunnel_api.ring_statistics('s', 1.5, 3199.2, 9000, 9100)") == []


@pytest.mark.parametrize(("low", "high"), [(0, 10), (1, 2), (7, 9), (33, 100)])
def test_a_stretch_from_joint_to_joint_has_no_ring_more(conn: psycopg.Connection, low: int, high: int) -> None:
    """The joints of such rings are no round numbers, and a stretch may be given rounded."""
    add_survey(conn, 12300, 12500)
    for joint in (lambda n: 12300.1 + n * 1.2, lambda n: round(12300.1 + n * 1.2, 1)):
        found = ask(conn, "SELECT number FROM tunnel_api.ring_statistics('s', 1.2, 12300.1, %s, %s)", joint(low), joint(high))
        assert [row["number"] for row in found] == list(range(low + 1, high + 1))


def test_a_whole_kilometre_is_the_sum_of_its_steps(rows: psycopg.Connection, made: Made) -> None:
    """The second kilometre lies in the tunnel from end to end; the others are cut by it."""
    steps = np.random.default_rng(3).random((3, 10_000)).astype(np.float32)
    with rows.transaction(force_rollback=True):
        add_coverage(rows, 1, 4, *steps)
        (row,) = ask(rows, "SELECT lining_area, seen_area, wet_pixel_share FROM tunnel_api.km_statistics WHERE km = 4")
    lining, seen, wet = steps.astype(float).sum(axis=1)
    assert (row["lining_area"], row["seen_area"]) == (pytest.approx(lining), pytest.approx(seen))
    assert row["wet_pixel_share"] == pytest.approx(wet / seen)


def test_kilometres_are_stretches_too(rows: psycopg.Connection, made: Made) -> None:
    kilometres = ask(rows, "SELECT * FROM tunnel_api.km_waterproof ORDER BY km")
    assert [(row["km"], row["chainage_from"], row["chainage_to"]) for row in kilometres] == [
        (3, 3200, 4000), (4, 4000, 5000), (5, 5000, 5850),
    ]  # fmt: skip
    for row in kilometres:
        (one,) = ask(rows, "SELECT * FROM tunnel_api.leak_statistics('s', %s, %s)", row["chainage_from"], row["chainage_to"])
        for name in one.keys() & row.keys():
            assert row[name] == (None if one[name] is None else pytest.approx(one[name], rel=1e-9)), name
    assert (kilometres[1]["lining_area"], kilometres[1]["seen_share"], kilometres[1]["class"]) == (None, 0, None)
    assert kilometres[1]["patches"] > 0
    sums = ask(rows, "SELECT * FROM tunnel_api.km_statistics ORDER BY km")
    for row, total in zip(kilometres, sums, strict=True):
        assert total["lining_area"] == (pytest.approx(row["lining_area"]) if row["lining_area"] else None)
        assert total["seen_share"] == (pytest.approx(row["seen_share"]) if row["seen_share"] else None)
    assert sums[0]["wet_pixel_share"] == pytest.approx(made.between(made.wet, 3200, 4000) / sums[0]["seen_area"])


@pytest.fixture
def plain(conn: psycopg.Connection) -> int:
    """500 m of tunnel with 20 m² of lining a metre, all of it seen: 10 000 m²."""
    survey = add_survey(conn, 0, 500)
    lining = np.where(np.arange(10_000) < 5000, 2.0, 0.0)
    add_coverage(conn, survey, 0, lining, lining, 0.01 * lining)
    return survey


def classes(conn: psycopg.Connection, low: float = 0, high: float = 500) -> dict[int, tuple[bool | None, list[str], list[int]]]:
    rows = ask(conn, "SELECT * FROM tunnel_api.waterproof_class('s', %s, %s)", low, high)
    best = ask(conn, "SELECT class FROM tunnel_api.leak_statistics('s', %s, %s)", low, high)[0]["class"]
    assert best == min((row["class"] for row in rows if row["holds"]), default=None)
    return {row["class"]: (row["holds"], row["breaks"], row["leaks"]) for row in rows}


def square(conn: psycopg.Connection, survey: int, chainage: float, area: float, arc: float = 0.0) -> int:
    side = np.sqrt(area) / 2
    return add_leak(conn, survey, box(chainage - side, arc - side, chainage + side, arc + side), area)


def test_dry_tunnel_is_of_the_first_class(conn: psycopg.Connection, plain: int) -> None:
    assert classes(conn) == dict.fromkeys((1, 2, 3, 4), (True, [], []))


def test_limits_are_those_of_the_standard(conn: psycopg.Connection, plain: int) -> None:
    """Table 3.2.1 of GB 50108-2008: up to the limit a class holds, above it does not."""
    small = square(conn, plain, 100, 0.2)
    assert classes(conn)[1] == (False, ["wet patches: 1"], [small])
    assert classes(conn)[2] == (True, [], [])
    larger = square(conn, plain, 200.5, 0.201)
    assert classes(conn)[2] == (False, ["patch of 0.201 m² at 0+200.500 > 0.2 m²"], [larger])
    assert classes(conn)[3][0] is True
    largest = square(conn, plain, 300, 0.31)
    assert classes(conn)[2][1] == ["patch of 0.310 m² at 0+300.000 > 0.2 m², the largest of 2"]
    assert classes(conn)[2][2] == [larger, largest]
    assert classes(conn)[3] == (False, ["patch of 0.310 m² at 0+300.000 > 0.3 m²"], [largest])
    assert classes(conn)[4] == (True, [], [])
    assert classes(conn, 0, 150)[2][0] is True


@pytest.mark.parametrize(("number", "best"), [(3, 2), (4, 3), (7, 3), (8, 4)])
def test_patches_are_counted_in_any_100_square_metres(conn: psycopg.Connection, plain: int, number: int, best: int) -> None:
    """100 m² are 5 m of tunnel; patches of 2 cm stand on 4.9 m of it, others far away."""
    together = [square(conn, plain, 200 + 4.9 * i / (number - 1), 0.0004, arc=i) for i in range(number)]
    for chainage in np.arange(10, 190, 5.1):
        square(conn, plain, chainage, 0.0004)
    found = classes(conn)
    assert min(c for c, (holds, _, _) in found.items() if holds) == best
    if best > 2:
        ((text,), leaks) = found[best - 1][1:]
        assert text.startswith(f"{number} patches in 100 m² between 0+199.9")
        assert leaks == together


def test_wet_area_is_held_against_the_lining_seen(conn: psycopg.Connection, plain: int) -> None:
    keys = [square(conn, plain, 2.5 + 3.96 * i, 0.159) for i in range(125)]  # 19.9 m² of 10 000 m²
    assert classes(conn)[2] == (True, [], [])
    conn.execute("UPDATE tunnel.coverage SET seen = (SELECT array_agg(0.99 * v ORDER BY n) FROM unnest(lining) "
                 "WITH ORDINALITY AS l (v, n))")  # fmt: skip
    assert classes(conn)[2] == (False, ["wet area is 2.01 ‰ of the inspected lining > 2 ‰"], keys)
    assert classes(conn)[3][0] is True
    shares = [row["seen_share"] for row in ask(conn, "SELECT * FROM tunnel_api.waterproof_class('s', 0, 500)")]
    assert shares == pytest.approx([0.99] * 4)


def test_what_was_not_seen_holds_no_class(conn: psycopg.Connection, plain: int) -> None:
    conn.execute("DELETE FROM tunnel.coverage")
    assert classes(conn) == dict.fromkeys((1, 2, 3, 4), (None, [], []))
    key = square(conn, plain, 100, 0.4)
    assert {number: holds for number, (holds, _, _) in classes(conn).items()} == {1: False, 2: False, 3: False, 4: None}
    assert classes(conn)[3][2] == [key]
    assert ask(conn, "SELECT seen_share FROM tunnel_api.leak_statistics('s', 0, 500)") == [{"seen_share": 0}]


def test_leak_where_no_lining_is_known_is_no_first_class(conn: psycopg.Connection) -> None:
    """One kilometre was detected before there was a coverage; its leaks are in no window of 100 m²."""
    survey = add_survey(conn, 0, 2000)
    lining = np.full(10_000, 2.0)
    add_coverage(conn, survey, 1, lining, lining, 0 * lining)
    key = square(conn, survey, 500, 0.1)
    found = classes(conn, 0, 2000)
    assert found[1] == (False, ["wet patches: 1"], [key])
    assert found[2][0] is True


def test_leak_over_the_end_counts_by_its_part_as_one_patch_of_its_whole_size(conn: psycopg.Connection, plain: int) -> None:
    triangle = Polygon([(99, 0), (101, 0), (101, 0.4)])  # three quarters of its area beyond the middle
    add_leak(conn, plain, triangle, 0.4)
    (left,) = ask(conn, "SELECT * FROM tunnel_api.leak_statistics('s', 0, 100)")
    (right,) = ask(conn, "SELECT * FROM tunnel_api.leak_statistics('s', 100, 500)")
    assert (left["wet_area"], right["wet_area"]) == (pytest.approx(0.1), pytest.approx(0.3))
    for row in (left, right):
        assert (row["patches"], row["largest_area"], row["class"]) == (1, 0.4, 4)


def test_ranges_are_cut_to_the_survey(conn: psycopg.Connection, plain: int) -> None:
    (row,) = ask(conn, "SELECT * FROM tunnel_api.leak_statistics('s', '-Infinity', 'Infinity')")
    assert (row["chainage_from"], row["chainage_to"], row["lining_area"], row["class"]) == (0, 500, pytest.approx(10_000), 1)
    assert ask(conn, "SELECT * FROM tunnel_api.leak_statistics('s', 600, 700)") == []
    (row,) = ask(conn, "SELECT * FROM tunnel_api.coverage('s', '-Infinity', 100)")
    assert row["lining_area"] == pytest.approx(2000)
    for bad in (0, -1, "NaN", "Infinity"):
        with pytest.raises(psycopg.errors.InvalidParameterValue, match="at least"), conn.transaction():
            conn.execute("SELECT tunnel_api.ring_statistics('s', %s, 0)", (bad,))
    with pytest.raises(psycopg.errors.InvalidParameterValue, match="finite"), conn.transaction():
        conn.execute("SELECT tunnel_api.ring_statistics('s', 1, '-Infinity')")
    conn.execute("DELETE FROM tunnel.segment")
    for function in ("coverage", "leak_statistics"):
        assert ask(conn, f"SELECT * FROM tunnel_api.{function}('s', '-Infinity', 'Infinity') f WHERE f.lining_area > 0") == []
    assert ask(conn, "SELECT * FROM tunnel_api.ring_statistics('s', 1.5, 0)") == []
    assert ask(conn, "SELECT * FROM tunnel_api.ring_statistics('s', 1.5, 0, 100, 200)") == []
    with pytest.raises(psycopg.Error, match="there is no survey x"):
        conn.execute("SELECT tunnel_api.coverage('x', 0, 1)")


def test_lining_seen_before_there_was_a_coverage_is_that_of_the_ledger(conn: psycopg.Connection, plain: int) -> None:
    conn.execute("DELETE FROM tunnel.coverage")
    conn.execute(
        "INSERT INTO tunnel.run (survey_id, km, stage, outcome, finished_at, counts, parameters) VALUES (%s, 0, 'detect', "
        """'done', now(), '{"lining_pixels": 100000}', '{"image.pixel": 0.1}')""",
        (plain,),
    )
    square(conn, plain, 100, 0.5)
    add_leak(conn, plain, box(10, 0, 11, 1), 1.0, kind="joint")
    for review in ("rejected", "confirmed"):
        add_leak(conn, plain, box(20, 0, 21, 1), 1.0, review=review)
    add_leak(conn, plain, box(30, 0, 31, 1), 1.0, detected=False)
    (row,) = ask(conn, "SELECT * FROM tunnel_api.km_statistics")
    assert (row["lining_area"], row["seen_area"], row["seen_share"]) == (None, pytest.approx(1000), None)
    assert (row["wet_area"], row["wet_share"], row["leaks"], row["leaks_open"], row["leaks_rejected"]) == (
        1.5, pytest.approx(0.0015), 2, 1, 1,
    )  # fmt: skip
