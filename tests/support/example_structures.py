"""Structures made by hand: a wall in two parts, turned out of the axes, and a pipe in two, each with spots."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import psycopg
from click.testing import CliRunner
from psycopg.types.json import Jsonb
from shapely.geometry import MultiPolygon, Point, box

from tunneldb.arrays import Float
from tunneldb.cli.main import main
from tunneldb.pipeline.replace_structures import replace_structures
from tunneldb.store.survey import get_survey
from tunneldb.structures.models import with_directions
from tunneldb.structures.results import Face, Member, Spot, Structures

ORIGIN = np.array([400000.0, 5700000.0, 100.0])
NORMAL = np.array([0.6, -0.8, 0.0])
"""Of the wall."""
ALONG = np.array([0.8, 0.6, 0.0])
"""The wall's level direction, to the right of who looks at it."""
GAP, RADIUS = 0.4, 0.2
"""Between the parts of the wall and of the pipe, and the pipe's radius, m."""

SPOTS = {1: "dark", 2: "bright", 3: "dark"}
"""Kind of each spot, by number: two on the wall's parts, one on the pipe."""


def model(point: Float, axis: Float, middle: Float, radius: float = 0.0) -> Float:
    row = np.zeros((1, 11))
    row[0, 0:3], row[0, 3:6], row[0, 6], row[0, 7] = point, axis, radius, 1.0
    return with_directions(row, np.array([middle]))[0]


def example_structures() -> Structures:
    """Member 1: 2 m × 2 m and 1 m × 2 m of a wall, 0.4 m apart; member 2: 1 m and 0.5 m of a pipe, whose axes run against
    each other and whose middles are 0.5 rad apart."""
    right = (2.0 + GAP) * ALONG
    axis = np.array([0.0, 0.0, 1.0])
    turned = np.array([np.sin(0.5), -np.cos(0.5), 0.0])
    centre = np.array([5.0, 1.0, 0.0])
    models = [
        model(np.zeros(3), NORMAL, np.zeros(3)),
        model(right, NORMAL, right),
        model(centre, axis, centre + np.array([0.0, -1.0, 0.0]), RADIUS),
        model(centre + (1.0 + GAP) * axis, -axis, centre + turned, RADIUS),
    ]
    outlines = [box(0, 0, 2, 2), box(0, 0, 1, 2), box(0, -0.3, 1, 0.3), box(-0.5, -0.3, 0, 0.3)]
    seen = [1.0, 0.9, 0.8, 0.0]
    faces = [
        Face(
            k + 1, 1 if k < 2 else 2, 1, "flat" if k < 2 else "pipe", models[k], ORIGIN, 1000, outlines[k].area,
            0.0 if k < 2 else RADIUS, 0.002, seen[k], (5.0, 40.0) if seen[k] else (np.nan, np.nan),
            20.0 if seen[k] else np.nan, 0.3 if seen[k] else np.nan, False, MultiPolygon([outlines[k]]),
        )
        for k in range(4)
    ]  # fmt: skip
    places = [(1, 1, Point(1.5, 1.0).buffer(0.3)), (2, 1, Point(0.5, 1.5).buffer(0.2)), (3, 2, box(0.2, -0.1, 0.4, 0.1))]
    spots = [
        Spot(n + 1, face, member, SPOTS[n + 1], ("sharp",), 0.9, 10.0, 3.0, outline.area, 200, 1, outline,  # type: ignore[arg-type]
             (120, 60, 30) if n == 0 else None)
        for n, (face, member, outline) in enumerate(places)
    ]  # fmt: skip
    line = np.array([np.zeros(3), 3.4 * ALONG]) + ORIGIN
    pipe = np.array([centre, centre + 1.9 * axis]) + ORIGIN
    members = [
        Member(1, "flat", (1, 2), 6.0, 3.4, line, False),
        Member(2, "pipe", (3, 4), 0.9, 1.9, pipe, True),
    ]
    return Structures(members, faces, spots)


def save_example_structures(conn: psycopg.Connection, survey: str) -> None:
    """Save them as what stage members found in a survey, which is noted as done."""
    its = get_survey(conn, survey, site=True)
    replace_structures(conn, its, example_structures(), None)
    conn.execute(
        "INSERT INTO tunnel.run (survey_id, stage, outcome, parameters, counts, started_at, finished_at)"
        " VALUES (%s, 'members', 'done', tunnel_internal.members_inputs(%s), %s, now(), now())",
        [its.id, its.id, Jsonb({"left_out": {"labels": 2, "bands": 0, "stray": 1}})],
    )
    conn.commit()


def add_example_site(folder: Path) -> None:
    """Add the site hall and its survey hall-1, without files."""
    stations = folder / "stations.csv"
    stations.write_text("scan_id,x,y,z\n1,400000,5699995,101.5\n")
    for words in (
        ["tunnel", "add", "hall", "--srid", "25829", "--site"],
        ["survey", "add", "hall-1", "--tunnel", "hall", "--date", "2024-05-04", "--intensity-kind", "none",
         "--stations", str(stations)],
    ):  # fmt: skip
        done = CliRunner().invoke(main, words)
        assert done.exit_code == 0, done.output
