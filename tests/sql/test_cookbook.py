"""Each question of the cookbook has the right answer: by closed formulas, NumPy and shapely, not by the views that it asks."""

from __future__ import annotations

import datetime as dt
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
import pytest
import shapely
from psycopg import sql
from psycopg.conninfo import make_conninfo
from psycopg.rows import dict_row
from support import cookbook_network as network
from support import cookbook_owner as owner
from support import example_change
from support.cookbook_survey import CONFIRMED, GONE, MOVED, NICHE, OLD, POINTS, SPARSE, draw_findings, prepare
from support.example_alarm import OVALITY as OVAL_LIMITS
from support.example_clearance import TIGHT
from support.example_deviation import BULGE, OVER, THICK, THIN, THIN_PLACE, UNDER, UNEVEN
from support.example_objects import FLOOR, HALF_FLOOR, SPHERES, THINGS, beside
from support.example_rings import COUNT, OVALITY, STEP
from support.example_survey import GIRTH, NAME, SEEN_FROM, WET, example_surface

from tunneldb.classification.classes import PointClass
from tunneldb.database import connect

PAGE = Path(__file__).parents[2] / "docs" / "cookbook.md"
QUESTION = re.compile(r"^### (.+?)$(?:(?!^#).)*?^```sql\n(.*?)^```$", re.MULTILINE | re.DOTALL)
QUESTIONS = dict(QUESTION.findall(PAGE.read_text("utf-8")))
OF_FINDINGS = dict(QUESTION.findall(PAGE.read_text("utf-8").partition("\n## Findings\n")[2]))
"""Those that are asked after findings were drawn."""
OF_OWNERS = dict(QUESTION.findall(PAGE.read_text("utf-8").partition("\n## Ratings, actions and alarms\n")[2]))
"""Those of them that are asked after a later inspection, with actions."""

PLACE = (12345.0, 2.0, 0.1)
"""Chainage, arc and offset of the point that is asked about in place of the page's, m."""

Rows = list[dict[str, Any]]
SURFACE, VERTICES = example_surface()
WHO = "SELECT session_user"


@dataclass(frozen=True)
class Leak:
    """An anomaly as its table holds it."""

    id: int
    kind: str
    detected: bool
    review: str
    area: float
    confidence: float
    unrolled: shapely.Polygon
    map: shapely.Polygon
    surface: shapely.Polygon

    @property
    def low(self) -> float:
        return float(self.unrolled.bounds[0])

    @property
    def high(self) -> float:
        return float(self.unrolled.bounds[2])

    @property
    def middle(self) -> float:
        return (self.low + self.high) / 2

    def part(self, low: float, high: float) -> float:
        """Area between two chainages, m²."""
        cut = shapely.intersection(self.unrolled, shapely.box(low, -20, high, 20))
        return self.area * float(cut.area / self.unrolled.area)


@dataclass(frozen=True)
class Asked:
    """The answers to all questions, and what the tables hold."""

    answers: dict[str, Rows]
    anomalies: list[Leak]
    who: str
    drawn: dict[str, int]
    actions: dict[str, int]

    @property
    def leaks(self) -> list[Leak]:
        """Leaks that the last detection found, rejected ones too."""
        return [leak for leak in self.anomalies if leak.kind == "leak" and leak.detected]

    @property
    def wet(self) -> list[Leak]:
        """Leaks that count."""
        return [leak for leak in self.leaks if leak.review != "rejected"]

    def at(self, chainage: float) -> int:
        """Id of the leak there."""
        return next(leak.id for leak in self.anomalies if leak.low < chainage < leak.high)


@pytest.fixture(scope="module")
def asked(server_dsn: str, example_template: str) -> Iterator[Asked]:
    database = "test_cookbook"
    with psycopg.connect(server_dsn, autocommit=True) as admin:
        admin.execute(
            sql.SQL("CREATE DATABASE {} TEMPLATE {}").format(sql.Identifier(database), sql.Identifier(example_template))
        )
    with connect(make_conninfo(server_dsn, dbname=database)) as conn:
        prepare(conn, NAME)
        network.add_network(conn, NAME)
        conn.commit()
        answers = {title: put(conn, query) for title, query in QUESTIONS.items() if title not in OF_FINDINGS}
        rows = conn.execute(
            "SELECT id, kind, detected, review, area, confidence, ST_AsBinary(unrolled), ST_AsBinary(map), ST_AsBinary(surface)"
            " FROM tunnel.finding WHERE survey_id = 1 ORDER BY chainage_from"
        ).fetchall()
        anomalies = [Leak(*row[:6], *(shapely.from_wkb(bytes(wkb)) for wkb in row[6:])) for row in rows]
        drawn = draw_findings(conn, NAME)
        conn.commit()
        answers |= {title: put(conn, query) for title, query in OF_FINDINGS.items() if title not in OF_OWNERS}
        actions = owner.add_owner(conn, NAME, drawn)
        conn.commit()
        answers |= {title: put(conn, query) for title, query in OF_OWNERS.items()}
        yield Asked(answers, anomalies, conn.execute(WHO).fetchone()[0], drawn, actions)
    with psycopg.connect(server_dsn, autocommit=True) as admin:
        admin.execute(sql.SQL("DROP DATABASE {} WITH (FORCE)").format(sql.Identifier(database)))


def put(conn: psycopg.Connection, query: str) -> Rows:
    """The rows of an answer, of several statements the last one's; a point written out is taken to PLACE."""
    x, y, z = SURFACE.to_space(*(np.array([value]) for value in PLACE))[0].tolist()
    query = re.sub(r"ST_MakePoint\([\d.]+, [\d.]+, [\d.]+\)", f"ST_MakePoint({x}, {y}, {z})", query)
    rows: Rows = []
    with conn.cursor(row_factory=dict_row) as cursor:
        cursor.execute(query.encode())
        for result in cursor.results():
            rows = result.fetchall() if result.description else rows
    return rows


def ids(rows: Rows) -> list[int]:
    return [row["id"] for row in rows]


def label(chainage: float) -> str:
    return f"{int(chainage // 1000)}+{chainage % 1000:07.3f}"


def close(row: dict[str, Any], digits: int = 2, **expected: float) -> None:
    """The numbers of a row, as the answer rounds them."""
    for name, value in expected.items():
        assert float(row[name]) == pytest.approx(value, abs=0.6 * 10**-digits), name


def over(rows: Rows, a: Asked) -> None:
    wanted = [leak for leak in a.wet if leak.area > 0.2]
    assert ids(rows) == [leak.id for leak in wanted] != []
    for row, leak in zip(rows, wanted, strict=True):
        close(row, area_m2=leak.area)
        assert row["label"] == label(leak.middle)
        assert row["segment"] == leak.middle // 10
        assert (row["label_from"], row["label_to"]) == (label(leak.middle // 10 * 10), label(leak.middle // 10 * 10 + 10))


def above(rows: Rows, a: Asked) -> None:
    """At 10 and 2 o'clock the arch of 4 m has gone round by 60° from the crown."""
    wanted = [leak for leak in a.wet if abs(leak.unrolled.centroid.y) < 4 * np.pi / 3]
    assert ids(rows) == [leak.id for leak in wanted] != []
    for row, leak in zip(rows, wanted, strict=True):
        close(row, 1, clock=(leak.unrolled.centroid.y / 4 * 6 / np.pi - 0.001) % 12)


def largest(rows: Rows, a: Asked) -> None:
    assert ids(rows) == [leak.id for leak in sorted(a.wet, key=lambda leak: -leak.area)]


def nearest(rows: Rows, a: Asked) -> None:
    wanted = sorted(a.wet, key=lambda leak: leak.unrolled.distance(shapely.Point(12410, 0)))[:5]
    assert ids(rows) == [leak.id for leak in wanted]
    for row, leak in zip(rows, wanted, strict=True):
        close(row, away_m=leak.unrolled.distance(shapely.Point(12410, 0)))


def together(rows: Rows, a: Asked) -> None:
    begins = {leak.id: 12415 <= leak.low <= 12440 for leak in a.wet}
    pairs = {
        frozenset((p.id, q.id)): p.unrolled.distance(q.unrolled)
        for p, q in combinations(a.wet, 2)
        if (begins[p.id] or begins[q.id]) and p.unrolled.distance(q.unrolled) <= 10
    }
    found = [frozenset((row["id"], row["next"])) for row in rows]
    assert set(found) == set(pairs)
    assert len(found) == len(pairs)
    assert {sum(begins[key] for key in pair) for pair in pairs} == {1, 2}
    assert any(begins[max(pair)] > begins[min(pair)] for pair in pairs)
    for row, pair in zip(rows, found, strict=True):
        close(row, apart_m=pairs[pair])


def repaired(rows: Rows, a: Asked) -> None:
    patch = shapely.box(12400, 2, 12430, 8)
    wanted = {leak.id: leak.unrolled.intersection(patch).area / leak.unrolled.area for leak in a.leaks}
    wanted = {key: share for key, share in wanted.items() if share > 0}
    assert set(ids(rows)) == set(wanted) != set()
    for row in rows:
        close(row, covered=wanted[row["id"]])


def on_the_map(rows: Rows, a: Asked) -> None:
    x, y, _ = VERTICES[10]
    frame = shapely.box(x - 25, y - 25, x + 25, y + 25)
    wanted = {leak.id for leak in a.leaks if frame.intersects(shapely.box(*leak.map.bounds))}
    assert set(ids(rows)) == wanted
    assert 0 < len(wanted) < len(a.leaks)


def by_the_niche(rows: Rows, a: Asked) -> None:
    low, high, left, right = NICHE
    corners = [(low, left), (high, left), (high, right), (low, right)]
    niche = shapely.Polygon([beside(SURFACE, chainage, np.array([across]), 0)[0, :2] for chainage, across in corners])
    lines = {leak.id: shapely.LineString(shapely.get_coordinates(leak.surface.exterior)) for leak in a.anomalies}
    near = {leak.id: lines[leak.id].distance(niche) for leak in a.leaks}
    near = {key: away for key, away in near.items() if away <= 3}
    assert set(ids(rows)) == set(near) != set()
    for row in rows:
        close(row, 1, away_m=near[row["id"]])
        assert row["niche"] == label((low + high) / 2)


def behind(rows: Rows, a: Asked) -> None:
    objects = [thing for thing in THINGS if thing[0] == PointClass.OBJECT]
    wanted = [
        (leak.id, label(thing[1]), thing[6])
        for leak in a.leaks for thing in objects
        if leak.high >= thing[1] - thing[3] / 2 - 10 and leak.low <= thing[1] + thing[3] / 2 + 10
    ]  # fmt: skip
    assert [(row["id"], row["object"], float(row["tall_m"])) for row in rows] == wanted != []


def second_look(rows: Rows, a: Asked) -> None:
    wanted = [one for one in a.anomalies if one.detected and one.review == "open" and one.confidence < 0.85]
    assert set(ids(rows)) == {one.id for one in wanted} != set()
    assert [float(row["confidence"]) for row in rows] == sorted(round(one.confidence, 2) for one in wanted)
    assert {row["kind"] for row in rows} == {"leak", "joint", "dark"}


def kilometres(rows: Rows, a: Asked) -> None:
    (row,) = rows
    close(row, 0, lining_m2=200 * GIRTH, seen_percent=100 * (12500 - SEEN_FROM) / 200)
    close(row, wet_m2=sum(leak.area for leak in a.wet), largest_m2=max(leak.area for leak in a.wet))
    assert (row["km"], row["leaks"]) == (12, len(a.wet))


def hundreds(rows: Rows, a: Asked) -> None:
    assert [row["chainage"] for row in rows] == [label(12000 + 100 * i) for i in range(10)]
    for i, row in enumerate(rows):
        close(row, wet_m2=sum(leak.part(12000 + 100 * i, 12100 + 100 * i) for leak in a.wet))
    assert sum(float(row["wet_m2"]) for row in rows) > 3


def stretch(rows: Rows, a: Asked) -> None:
    (row,) = rows
    close(row, 0, lining_m2=110 * GIRTH)
    close(row, 3, seen_share=1, wet_pixel_share=0.1 * (WET[1] - WET[0]) / 110)


def classes(rows: Rows, a: Asked) -> None:
    assert max(leak.area for leak in a.wet) > 0.3  # so that only the last class is left
    assert [(row["class"], row["holds"]) for row in rows] == [(1, False), (2, False), (3, False), (4, True)]
    assert [row["leaks"] for row in rows] == [len(a.wet)] * 3 + [0]
    close(rows[0], seen_share=(12500 - SEEN_FROM) / 200)


def worst(rows: Rows, a: Asked) -> None:
    """The most leaks that any window as long as 100 m² of lining reaches into, each tried from just before its end."""
    long = 100 / GIRTH
    most = max(sum(q.low <= p.high - 1e-6 + long and q.high >= p.high - 1e-6 for q in a.wet) for p in a.wet)
    (row,) = rows
    assert row["window_patches"] == len(row["window_leaks"]) == most
    start, end = (1000 * int(text[:2]) + float(text[3:]) for text in (row["chainage_from"], row["chainage_to"]))
    assert end - start == pytest.approx(long, abs=0.002)
    assert row["window_leaks"] == sorted(leak.id for leak in a.wet if leak.low <= end and leak.high >= start)


def kilometre_classes(rows: Rows, a: Asked) -> None:
    (row,) = rows
    assert (row["km"], row["patches"], row["class"]) == (12, len(a.wet), 4)
    close(row, wet_permille=1000 * sum(leak.area for leak in a.wet) / (GIRTH * (12500 - SEEN_FROM)))
    assert row["window_patches"] == a.answers["Where are the worst 100 m² of a stretch?"][0]["window_patches"]


def rings(rows: Rows, a: Asked) -> None:
    wanted = {
        n + 1: (sum(leak.part(12300 + 1.5 * n, 12301.5 + 1.5 * n) for leak in a.wet), sum(
            leak.high > 12300 + 1.5 * n and leak.low < 12301.5 + 1.5 * n for leak in a.wet))
        for n in range(134)
    }  # fmt: skip
    wanted = {number: ring for number, ring in wanted.items() if ring[1]}
    assert [row["number"] for row in rows] == sorted(wanted, key=lambda n: -wanted[n][0])[:10]
    assert len(rows) > 5
    for row in rows:
        close(row, wet_m2=wanted[row["number"]][0])
        assert row["patches"] == wanted[row["number"]][1]
        assert row["label"] == label(12300 + 1.5 * (row["number"] - 1))


def progress(rows: Rows, a: Asked) -> None:
    count = {review: sum(leak.review == review for leak in a.leaks) for review in ("open", "confirmed", "rejected")}
    (row,) = rows
    assert {review: row[f"leaks_{review}"] for review in count} == count
    assert min(count.values()) > 0
    close(row, 0, open_percent=100 * count["open"] / sum(count.values()))


def confirmed(rows: Rows, a: Asked) -> None:
    (row,) = rows
    assert (row["id"], row["who"], row["before"], row["remark"]) == (a.at(CONFIRMED), a.who, "open", "seen")


def history(rows: Rows, a: Asked) -> None:
    (row,) = rows
    assert row["who"] == a.who
    assert row["before"] == {"review": "open", "remark": None}
    assert row["after"] == {"review": "rejected", "remark": "seen"}


def reviewers(rows: Rows, a: Asked) -> None:
    (row,) = rows
    assert (row["who"], row["edits"], row["confirmed"], row["rejected"]) == (a.who, 2, 1, 1)


def changes(rows: Rows, a: Asked) -> None:
    times = [row["at"] for row in rows]
    assert times == sorted(times, reverse=True)
    edits = [(row["what"], row["detail"]) for row in rows if row["who"] == a.who]
    assert f"update {a.at(CONFIRMED)}: remark - -> seen, review open -> confirmed" in [text for _, text in edits]
    assert [what for what, _ in edits] == ["axis_vertex", "finding", "finding", "region"]
    assert [row["what"] for row in rows[len(edits) :]] == ["detect", "ground", "sections", "segments", "axis", "load"]
    assert {row["detail"] for row in rows[len(edits) :]} == {"done"}
    assert {row["km"] for row in rows} == {12, None}  # the region has none


def new(rows: Rows, a: Asked) -> None:
    """All but that of OLD, and that which is gone."""
    assert ids(rows) == [leak.id for leak in a.leaks if leak.id != a.at(OLD)]


def gone(rows: Rows, a: Asked) -> None:
    assert ids(rows) == [a.at(GONE)]


def stale(rows: Rows, a: Asked) -> None:
    """A moved vertex makes the segments stale, and all that rests on them."""
    assert [(row["km"], row["stage"]) for row in rows] == [
        (12, stage) for stage in ("segments", "sections", "ground", "detect")
    ]
    assert rows[0]["reason"] == "axis edited since"


def dates(rows: Rows, a: Asked) -> None:
    (row,) = rows
    assert (row["km"], row["files"]) == (12, "demo.laz")
    assert row["loaded"].timestamp() == 1714897800  # 2024-05-05 08:30 UTC
    assert (row["detected"] - row["loaded"]).total_seconds() == 5 * 3600


def place(rows: Rows, a: Asked) -> None:
    (row,) = rows
    assert row["chainage"] == label(PLACE[0])
    close(row, 3, arc=PLACE[1], offset=PLACE[2])


def click(rows: Rows, a: Asked) -> None:
    (row,) = rows
    there = SURFACE.to_space(np.array([PLACE[0]]), np.array([PLACE[1]]), np.zeros(1))[0]
    np.testing.assert_allclose([row["x"], row["y"], row["z"]], there, rtol=0, atol=1e-4)


def sizes(rows: Rows, a: Asked) -> None:
    assert [row["chainage"] for row in rows] == [label(12300 + 20 * i) for i in range(11)]
    for row in rows:
        close(row, 3, width_m=8, height_m=4 + FLOOR)


def doubtful(rows: Rows, a: Asked) -> None:
    assert [(row["label"], row["interpolated"]) for row in rows] == [(label(12412.5), 4), (label(12417.5), 4)]


def steep(rows: Rows, a: Asked) -> None:
    assert len(rows) == 10
    for row in rows:
        close(row, percent=2)


def not_measured(rows: Rows, a: Asked) -> None:
    assert [(row["n"], row["source"], row["edited_by"]) for row in rows] == [
        (1241, "interpolated", None), (1242, "interpolated", None), (MOVED, "edited", a.who)
    ]  # fmt: skip
    assert [row["edited_at"] is None for row in rows] == [True, True, False]


def points(rows: Rows, a: Asked) -> None:
    (row,) = rows
    assert row["points"] == sum(POINTS.values())
    close(row, intensity_db=-12)


def lie_on(rows: Rows, a: Asked) -> None:
    assert {row["name"]: row["points"] for row in rows} == {klass.name.lower(): count for klass, count in POINTS.items()}


def sparse(rows: Rows, a: Asked) -> None:
    assert (rows[0]["label_from"], float(rows[0]["points_per_m"])) == (label(10 * SPARSE), 10)
    assert {float(row["points_per_m"]) for row in rows[1:]} == {250}


def tall(rows: Rows, a: Asked) -> None:
    objects = [thing for thing in THINGS if thing[0] == PointClass.OBJECT and thing[6] > 1]
    assert [row["label"] for row in rows] == [label(thing[1]) for thing in objects] != []
    for row, thing in zip(rows, objects, strict=True):
        close(row, length_m=thing[3], tall_m=thing[6])


def ground(rows: Rows, a: Asked) -> None:
    assert [row["label"] for row in rows] == [label(12300 + 50 * i) for i in range(5)]
    for row, chainage in zip(rows, range(12300, 12501, 50), strict=True):
        close(row, 3, height_m=600 + 0.02 * (chainage - 12300) - FLOOR)
        close(row, width_m=2 * HALF_FLOOR)


def spheres(rows: Rows, a: Asked) -> None:
    """Every other sphere was seen twice, 0.2 mm apart in each coordinate."""
    assert {row["number"] for row in rows} == {number for number in range(1, len(SPHERES) + 1) if number % 2}
    for row in rows:
        close(row, 1, apart_mm=0.2 * np.sqrt(3))


def adit(a: Asked) -> list[Leak]:
    """Leaks of the other tunnel's newer survey, as the example's of which they are copies."""
    return [leak for leak in a.anomalies if leak.kind == "leak" and leak.area >= network.LEAST]


def all_by_class(rows: Rows, a: Asked) -> None:
    """Of the example's tunnel the survey of 2024 stands for it: that of 2026 was not searched."""
    counted = [leak for leak in adit(a) if leak.detected and leak.review != "rejected"]
    by_tunnel = {row["tunnel"]: row for row in rows}
    assert {name: row["survey"] for name, row in by_tunnel.items()} == {"demo": NAME, network.TUNNEL: network.NEWER}
    assert [row["leaks_per_km"] for row in rows] == sorted((row["leaks_per_km"] for row in rows), reverse=True)
    for name, leaks in (("demo", a.wet), (network.TUNNEL, counted)):
        row = by_tunnel[name]
        assert (row["kilometres"], row["leaks"], row["class"]) == (1, len(leaks), 4)
        close(row, 1, leaks_per_km=len(leaks) / 0.2)
        close(row, wet_m2=sum(leak.area for leak in leaks))


def wetter(rows: Rows, a: Asked) -> None:
    """Three that changed in one, two in the other; what stayed the same and what was not seen is left out."""
    demo, other = sorted(rows, key=lambda row: str(row["tunnel"]), reverse=True)
    changes = [after - before for state, (before, after) in example_change.LEAKS.items() if state != "same"]
    assert (demo["since"], demo["survey"], demo["new"], demo["grown"], demo["dry"]) == (NAME, "demo-2026", 1, 1, 1)
    close(demo, wet_more_m2=sum(changes), wet_more_se=0.05 * np.sqrt(len(changes)))
    seen = [after - before for state, before, after in network.WORSE if state != "unseen"]
    assert (other["since"], other["survey"], other["new"], other["grown"]) == (network.OLDER, network.NEWER, 1, 1)
    close(other, wet_more_m2=sum(seen), wet_more_se=0.05 * np.sqrt(len(seen)))
    assert rows == [demo, other]


def open_of_all(rows: Rows, a: Asked) -> None:
    wanted = [(NAME, leak) for leak in a.leaks if leak.review == "open"]
    wanted += [(network.NEWER, leak) for leak in adit(a) if leak.detected and leak.review == "open"]
    assert [row["survey"] for row in rows].count(network.NEWER) > 1
    expected = sorted(((survey, round(leak.area, 2)) for survey, leak in wanted), key=lambda one: (-one[1], one[0]))
    assert sorted(((row["survey"], float(row["area_m2"])) for row in rows), key=lambda one: (-one[1], one[0])) == expected
    areas = [row["area_m2"] for row in rows]
    assert areas == sorted(areas, reverse=True)


def review_of_all(rows: Rows, a: Asked) -> None:
    assert [row["survey"] for row in rows] == [network.NEWER, network.OLDER, NAME]
    leaks = [leak for leak in a.anomalies if leak.kind == "leak"]
    for row, there in zip(rows, (adit(a), leaks, leaks), strict=True):
        count = {
            "open": sum(leak.review == "open" and leak.detected for leak in there),
            "confirmed": sum(leak.review == "confirmed" and leak.detected for leak in there),
            "rejected": sum(leak.review == "rejected" for leak in there),
        }
        assert {state: row[state] for state in count} == count
        close(row, 0, open_percent=100 * count["open"] / sum(count.values()))


def kinds(rows: Rows, a: Asked) -> None:
    found = {(row["kind"], row["origin"]): row for row in rows}
    cracks = found["crack", "drawn"]
    assert (cracks["counted"], cracks["confirmed"]) == (3, 3)
    close(cracks, 3, area_m2=3 * 0.002 + 4 * 0.001)
    assert float(cracks["length_m"]) == pytest.approx(7.5, rel=0.01)
    assert found["spall", "merged"]["counted"] == 1
    close(found["spall", "merged"], area_m2=1.25)
    assert found["spall", "drawn"]["counted"] == 0
    assert found["leak", "detected"]["counted"] == len(a.wet) - 2  # one is drawn over, one in a dry region


def cracks(rows: Rows, a: Asked) -> None:
    assert ids(rows) == [a.drawn["longer crack"], a.drawn["long crack"]]
    assert [row["severity_label"] for row in rows] == ["critical", "moderate"]
    assert [float(row["width_mm"]) for row in rows] == [1.0, 2.0]
    assert [float(row["length_m"]) for row in rows] == pytest.approx([4.0, 3.0], rel=0.01)


def densest(rows: Rows, a: Asked) -> None:
    (row,) = rows  # all are between 12+350 and 12+400, along the tunnel
    assert (row["name"], row["cracks"], float(row["width_mm"])) == ("block 2", 3, 2.0)
    close(row, 0.01, length_m=7.5, longitudinal_m=7.5, density=7.5 / (50 * GIRTH))
    close(row, transverse_m=0)


def without_photo(rows: Rows, a: Asked) -> None:
    assert ids(rows) == [a.drawn["short crack"], a.drawn["longer crack"], a.drawn["bolt"]]


def drawers(rows: Rows, a: Asked) -> None:
    assert [(row["drawn_by"], row["origin"], row["findings"]) for row in rows] == [(a.who, "drawn", 6), (a.who, "merged", 1)]


def not_counted(rows: Rows, a: Asked) -> None:
    said = {row["id"]: (row["state"], row["stands_for_it"], row["dry_region_id"]) for row in rows}
    assert said[a.drawn["other spall"]] == ("merged", a.drawn["spall"], None)
    assert said[a.drawn["leak"]] == ("same", a.drawn["leak over it"], None)
    assert said[a.drawn["dry leak"]] == ("dry", None, a.drawn["region"])
    assert said[a.at(GONE)] == ("gone", None, None)
    rejected = {leak.id for leak in a.anomalies if leak.review == "rejected"}
    assert {key for key, (state, *_) in said.items() if state == "rejected"} == rejected != set()


def found_too(rows: Rows, a: Asked) -> None:
    assert [(row["id"], row["detected_as"]) for row in rows] == [(a.drawn["leak over it"], [a.drawn["leak"]])]


def to_measure(rows: Rows, a: Asked) -> None:
    names = ("long crack", "longer crack", "short crack", "bolt", "spall", "leak over it")
    assert ids(rows) == [a.drawn[name] for name in names]


def dry_regions(rows: Rows, a: Asked) -> None:
    (row,) = [row for row in rows if row["id"] == a.drawn["region"]]
    assert (row["reason"], row["drawn_by"], row["leaks"], row["leak_ids"]) == ("seen dry", a.who, 1, [a.drawn["dry leak"]])
    leak = next(leak for leak in a.anomalies if leak.id == a.drawn["dry leak"])
    close(row, 1, area_m2=leak.unrolled.buffer(0.1).envelope.area)


def conditions(rows: Rows, a: Asked) -> None:
    said = {row["element"]: [float(row[f"cs{n}"]) for n in range(1, 5)] for row in rows}
    assert said["cracks"] == pytest.approx([0, 3.0, 0, 4.5], rel=0.01)
    assert said["bolts"] == [0, 0, 1, 0]
    assert said["liner"][2] == pytest.approx(1.25, abs=0.01)


def before_redrawn(rows: Rows, a: Asked) -> None:
    assert [(row["who"], row["became"]) for row in rows] == [(a.who, None), (a.who, "merged")]
    assert all(row["outline_before"].startswith("POLYGON((") for row in rows)


def gauge_fails(rows: Rows, a: Asked) -> None:
    (row,) = rows
    assert (row["class"], row["depth_mm"], row["clock"], row["points"]) == ("appendage", 50, 90, 7)
    assert row["label"].startswith("12+350")


def least_margins(rows: Rows, a: Asked) -> None:
    first, second = rows
    assert (first["chainage_from"], second["metres"]) == (12300, 100)
    close(first, margin_m=-0.05, seen_percent=90)
    close(second, margin_m=0.2)


def tightest(rows: Rows, a: Asked) -> None:
    (row,) = rows
    assert (row["class"], row["metres"]) == ("appendage", 1)
    assert 12300 < TIGHT < 12400


def underbreaks(rows: Rows, a: Asked) -> None:
    """Of sections n = 1, 2, … it is n times the first one's."""
    assert [row["label"] for row in rows] == ["12+300.000", "12+400.000"]
    for row, first in zip(rows, (1, 101), strict=True):
        close(row, underbreak_m3=UNDER * sum(range(first, first + 100)), overbreak_m3=100 * OVER)
        close(row, 0, seen_percent=90)


def most_inside(rows: Rows, a: Asked) -> None:
    assert [row["label"] for row in rows] == [label(12499.5 - n) for n in range(10)]
    for n, row in enumerate(rows):
        close(row, 3, underbreak_m2=UNDER * (200 - n))


def bulges(rows: Rows, a: Asked) -> None:
    (row,) = rows
    assert (row["chainage_from"], row["chainage_to"], row["greatest_mm"]) == (*BULGE, 60)


def wrong_axis(rows: Rows, a: Asked) -> None:
    """150.5 sections, whose areas grow by 2 and 3 m² by metre of axis; half of the last counts."""
    (row,) = rows
    close(row, underbreak_m3=UNDER * (sum(range(1, 151)) + 75.5), overbreak_m3=150.5 * OVER)
    close(row, underbreak_sigma=0.01 * 2 * 150.5, overbreak_sigma=0.01 * 3 * 150.5)


def off_the_profile(rows: Rows, a: Asked) -> None:
    """Of four cells of 6.25 m one is 100 mm outside."""
    assert [row["hundred"] for row in rows] == ["12+300.000", "12+400.000"]
    for row in rows:
        close(row, 2, inside_m2=0.0, outside_m2=100 * 6.25)


def thin(rows: Rows, a: Asked) -> None:
    low, high = THIN_PLACE
    assert [row["label"] for row in rows] == [label(low + 0.5 + n) for n in range(int(high - low))]
    for row in rows:
        close(row, 0, least_mm=1000 * THIN)


def put_on(rows: Rows, a: Asked) -> None:
    assert len(rows) == 2
    for row, cells in zip(rows, (THIN_PLACE[1] - THIN_PLACE[0], 0.0), strict=True):
        close(row, 2, volume_m3=750.0, mean_m=THICK, thin_m2=6.25 * cells)
        close(row, 0, compared_percent=90)


def uneven(rows: Rows, a: Asked) -> None:
    for row, greatest in zip(rows, (19.9, 29.9), strict=True):
        close(row, 1, over_m2=100 * UNEVEN, measured_m2=2200.0, not_measured_m2=50.0)
        close(row, 0, gap_mm=greatest)


def most_uneven(rows: Rows, a: Asked) -> None:
    assert [row["label"] for row in rows] == [label(12420.5 - 10 * n) for n in range(10)]
    assert [row["gap_mm"] for row in rows] == [32 - n for n in range(10)]


def measures_stale(rows: Rows, a: Asked) -> None:
    """An edited vertex makes the image stale that the deviation is computed from."""
    (row,) = [row for row in rows if row["stage"] == "deviation"]
    assert (row["km"], row["subject"], row["done_at"], row["blocked_by"]) == (12, "lining", None, "detect")
    assert row["reason"].startswith("detect is stale: ")


def oval(rows: Rows, a: Asked) -> None:
    assert [row["number"] for row in rows] == list(range(COUNT, 50, -1))
    close(rows[0], ovality=1000 * COUNT * OVALITY, design_diameter=8)


def great_steps(rows: Rows, a: Asked) -> None:
    assert [row["number"] for row in rows] == list(range(COUNT, COUNT - 10, -1))
    close(rows[0], step_mm=-1000 * COUNT * STEP, se_mm=0.4, arc=0)


def converged(rows: Rows, a: Asked) -> None:
    """Held against itself, no chord has changed."""
    assert len(rows) == 20
    close(rows[0], convergence_mm=0, se_mm=0.7)


def ring_by_survey(rows: Rows, a: Asked) -> None:
    """Rings are 2 m long from 12+300 on: 12+345 lies in the 23rd."""
    assert [(row["survey"], row["number"]) for row in rows] == [(NAME, 23), (example_change.LATER, 23)]
    close(rows[0], ovality=23000 * OVALITY, se=0.1, radius_mm=4000)
    close(rows[1], ovality=23000 * OVALITY * example_change.OVALER, se=0.1, radius_mm=4000)


def new_leaks(rows: Rows, a: Asked) -> None:
    (row,) = rows
    assert row["label"] == label(12330.5)
    close(row, area_m2=example_change.LEAKS["new"][1], area_se=0.04, seen_before_percent=100)


def grown_leaks(rows: Rows, a: Asked) -> None:
    (row,) = rows
    close(row, before_m2=1.0, after_m2=3.0, growth_m2=2.0, growth_se=0.05)


def moved_sections(rows: Rows, a: Asked) -> None:
    assert [row["label"] for row in rows] == [label(12300 + 1.5 * n + 0.75) for n in range(99, 89, -1)]
    close(rows[0], shift_mm=0.99, shape_mm=1.98)


def changed_area(rows: Rows, a: Asked) -> None:
    low, high = example_change.UNSEEN
    girth = example_change.GIRTH
    close(rows[0], changed_m2=2.0, inwards_m2=2.0, compared_m2=girth * (100.5 - high + low), wet_more_m2=2.0 + 0.4 - 0.3 + 0.02)
    close(rows[1], changed_m2=5.0, inwards_m2=0.0, compared_m2=girth * 49.5, wet_more_m2=0.0)
    assert [row["regions"] for row in rows] == [1, 1]


def not_seen(rows: Rows, a: Asked) -> None:
    (row,) = rows
    assert (row["chainage_from"], row["chainage_to"]) == example_change.UNSEEN
    close(row, 1, unseen_m2=example_change.GIRTH * (example_change.UNSEEN[1] - example_change.UNSEEN[0]))


BLOCK = 50 * GIRTH
"""Lining of an element of the division ``blocks``, m²; of block 1 a fifth was not inspected."""


def results(rows: Rows, a: Asked) -> None:
    """Block 1 and 3 have more than 0.2 % wet lining, block 2 a crack of severity 4, block 4 0.05 % to 0.2 %."""
    assert [(row["result"], row["elements"], row["lower_bounds"]) for row in rows] == [("D", 1, 0), ("C", 2, 1), ("B", 1, 0)]


def too_little(rows: Rows, a: Asked) -> None:
    (row,) = rows
    assert (row["name"], row["at_least"], row["remark"]) == ("block 1", "C", "80 % inspected")
    close(row, 0, inspected_percent=100 * (12350 - SEEN_FROM) / 50)


def rated_worse(rows: Rows, a: Asked) -> None:
    """Block 4: its leak has become larger. Block 2 became better, and the others are as they were."""
    (row,) = rows
    assert (row["name"], row["earlier_survey"], row["earlier_result"], row["result"]) == ("block 4", NAME, "B", "C")
    assert (row["change"], row["known"]) == (1, True)
    (leak,) = [leak for leak in a.wet if leak.low > owner.WETTER_FROM]
    text, value = row["why"].removesuffix(" > 0.002").split(": ")
    assert text == "share of wet lining"
    assert float(value) == pytest.approx(owner.WETTER * leak.area / BLOCK, abs=1e-4)


def schemes(rows: Rows, a: Asked) -> None:
    """The first has four results, the second two: C is 2/3 of the way to the worst, and bad is the worst."""
    assert [(row["name"], row["result"], row["other_result"]) for row in rows] == [
        ("block 2", "D", "good"), ("block 1", "C", "good"), ("block 3", "C", "bad"), ("block 4", "B", "good"),
    ]  # fmt: skip
    for row, difference in zip(rows, (-1, -2 / 3, 1 / 3, -1 / 3), strict=True):
        close(row, difference=difference)
    assert rows[0]["why"] == "severity: 4 ≥ 4"
    assert rows[2]["other_why"].startswith("number of leaks: 3 > 1")


def rating_then(rows: Rows, a: Asked) -> None:
    """Before the reviews and drawings: block 2 had no crack, and block 1 another leak."""
    assert [(row["name"], row["result"], row["complete"]) for row in rows] == [
        ("block 1", "C", False), ("block 2", "A", True), ("block 3", "C", True), ("block 4", "B", True),
    ]  # fmt: skip
    wet = sum(leak.area for leak in a.leaks if leak.high < 12350)
    share = float(rows[0]["why"].removeprefix("share of wet lining: ").removesuffix(" > 0.002"))
    assert share == pytest.approx(wet / (BLOCK - GIRTH * (SEEN_FROM - 12300)), abs=1e-4)


def overdue(rows: Rows, a: Asked) -> None:
    (row,) = rows
    assert (row["id"], row["measure"], row["responsible"], row["state"]) == (a.actions["late"], "inject", "Works Ltd", "open")
    assert row["days"] == (dt.date.today() - dt.date(2025, 3, 31)).days


def costs(rows: Rows, a: Asked) -> None:
    assert [(row["urgency"], row["currency"], row["actions"], row["cost"]) for row in rows] == [
        ("immediate", None, 1, None), ("urgent", "EUR", 2, 1300), ("planned", "EUR", 1, 1200)
    ]  # fmt: skip


def not_dry(rows: Rows, a: Asked) -> None:
    before, after = example_change.LEAKS["same"]
    assert [(row["id"], row["follow_up"]) for row in rows] == [
        (a.actions["still wet"], f"same on 2026-05-04: {before:.2f} to {after:.2f} m²"),
        (a.actions["not compared"], "not compared"),
    ]


def without_action(rows: Rows, a: Asked) -> None:
    """The longer crack has one; of both spalls the merged one is left."""
    assert [(row["id"], row["severity"]) for row in rows[:2]] == [(a.drawn["short crack"], 4), (a.drawn["bolt"], 3)]
    assert [(row["kind_label"], row["severity"]) for row in rows[2:]] == [("Spall", 3)]


def actions_changed(rows: Rows, a: Asked) -> None:
    assert [(row["action"], row["id"]) for row in rows] == [
        ("update", a.actions["drain"]),
        *(("insert", key) for name, key in reversed(a.actions.items()) if name != "seal"),
    ]
    assert {row["who"] for row in rows} == {a.who}
    assert rows[0]["before"] == {"state": "open"}
    assert rows[0]["after"] == {"state": "ordered", "responsible": "Drains Ltd"}


def exceeded(rows: Rows, a: Asked) -> None:
    oval = [example_change.OVALER * OVALITY * number for number in range(1, COUNT + 1)]
    found = {(row["name"], row["level"]): row for row in rows}
    warning, alarm = OVAL_LIMITS
    assert found["oval", "alarm"]["places"] == sum(one >= alarm for one in oval)
    assert found["oval", "warning"]["places"] == sum(warning <= one < alarm for one in oval)
    close(found["oval", "alarm"], 4, greatest=max(oval))
    wet = found["wet", "alarm"]
    assert (wet["places"], wet["chainage_from"], wet["chainage_to"]) == (3, 12300, 12500)
    assert [row["level"] for row in rows] == sorted((row["level"] for row in rows), key=["alarm", "warning", "unknown"].index)


CHECKS: dict[str, Callable[[Rows, Asked], None]] = {
    "Which leaks over 0.2 m² are there between two chainages, and on which segment?": over,
    "Which drip from above?": above,
    "Which are the largest of the whole tunnel?": largest,
    "Which leak is nearest to a point?": nearest,
    "Which leaks are so close together that they may be one?": together,
    "Which leaks does a repair cover?": repaired,
    "Which leaks lie in a part of the map?": on_the_map,
    "Which leaks are near a niche?": by_the_niche,
    "Which leaks may continue behind an object in front of them?": behind,
    "Which deserve a second look?": second_look,
    "How much of each kilometre is wet?": kilometres,
    "How much of each 100 m is wet?": hundreds,
    "How much of a stretch is wet?": stretch,
    "Which class of waterproofing does a stretch meet, and which limits are exceeded?": classes,
    "Where are the worst 100 m² of a stretch?": worst,
    "Which class does each kilometre meet?": kilometre_classes,
    "Which rings of a segmental lining are the wettest?": rings,
    "What is the progress of the review?": progress,
    "Who confirmed which leaks of a stretch, and when?": confirmed,
    "What is the history of a leak?": history,
    "Who reviewed how many leaks?": reviewers,
    "What changed since a date?": changes,
    "Which leaks were found for the first time in the last week?": new,
    "Which leaks did the last detection not find again?": gone,
    "Which kilometres are stale, and why?": stale,
    "When was each kilometre loaded and detected, and from which files?": dates,
    "At which chainage is a point, and how far from the lining?": place,
    "Where in space is a click on the unrolled image?": click,
    "How wide and high is the tunnel every 20 m?": sizes,
    "Which sections are doubtful?": doubtful,
    "Where is the tunnel steepest?": steep,
    "Which vertices of the axis are not measured?": not_measured,
    "How many points lie in a stretch, and how bright are they?": points,
    "On which classes of objects do they lie?": lie_on,
    "Where are the points too sparse?": sparse,
    "Which objects are in the tunnel?": tall,
    "How high is the ground, and how wide?": ground,
    "How well do the scans agree on a target sphere?": spheres,
    "Where does a loading gauge fail?": gauge_fails,
    "What is the least margin of each 100 m?": least_margins,
    "What causes the tightest places?": tightest,
    "How many m³ of underbreak are there per 100 m?": underbreaks,
    "Which ten sections have the most underbreak?": most_inside,
    "In which stretches does the lining protrude more than 50 mm into the profile?": bulges,
    "How does an axis error of 10 mm change the volumes?": wrong_axis,
    "How many m² of a stretch deviate more than 50 mm from the profile?": off_the_profile,
    "Where is the new layer thinner than 0.2 m?": thin,
    "How many m³ were applied per 100 m, and how many m² are thinner than 0.2 m?": put_on,
    "How much of each 100 m is uneven?": uneven,
    "Which ten places are the most uneven?": most_uneven,
    "Which measures are out of date, and why?": measures_stale,
    "Which rings are oval by more than 5 ‰?": oval,
    "Which are the ten greatest steps between rings?": great_steps,
    "How has a chord changed since another survey?": converged,
    "How did a ring change from survey to survey?": ring_by_survey,
    "What is new since a survey?": new_leaks,
    "Which leaks grew most?": grown_leaks,
    "Which ten sections moved most, and which changed their shape most?": moved_sections,
    "How much of the lining changed, per 100 m?": changed_area,
    "Which parts did the newer survey not inspect?": not_seen,
    "How many leaks per km do all tunnels have, by class of waterproofing?": all_by_class,
    "Which tunnels became wetter since their last survey?": wetter,
    "Which leaks of all tunnels are not reviewed yet?": open_of_all,
    "What is the progress of the review in each survey of all tunnels?": review_of_all,
    "How many findings of each kind and origin are there?": kinds,
    "Which cracks are longer than a metre, the most severe first?": cracks,
    "In which blocks are the cracks densest, and how do they run?": densest,
    "Which severe findings have no photo?": without_photo,
    "Who drew what, and when?": drawers,
    "Which findings are not counted, and why?": not_counted,
    "Which drawn findings were also detected?": found_too,
    "Which findings wait to be measured?": to_measure,
    "Which leaks do dry regions exclude?": dry_regions,
    "How much of each element is in which condition?": conditions,
    "What was the outline of a finding before it was redrawn?": before_redrawn,
    "How many elements have each result?": results,
    "Of which elements was too little inspected for a result?": too_little,
    "Which elements were rated worse than in the last inspection, and why?": rated_worse,
    "Where do two schemes differ, and why?": schemes,
    "What was the rating on a date?": rating_then,
    "Which actions are overdue, and who is responsible?": overdue,
    "What do the open actions cost, by urgency and currency?": costs,
    "Which leaks are not known to be dry although their action is done?": not_dry,
    "Which severe findings have no action?": without_action,
    "Which actions were added or changed since a date, and by whom?": actions_changed,
    "Which limits does the latest survey exceed, and what is unknown?": exceeded,
}


def test_every_question_has_an_answer_that_is_checked() -> None:
    assert list(QUESTIONS) == list(CHECKS)
    assert len(QUESTIONS) >= 20
    assert PAGE.read_text("utf-8").count("\n### ") == len(QUESTIONS)


@pytest.mark.parametrize("title", CHECKS)
def test_answer(asked: Asked, title: str) -> None:
    CHECKS[title](asked.answers[title], asked)
