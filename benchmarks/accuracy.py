"""Accuracy of unrolling, against the truth of simulated tunnels.

    python -m benchmarks.accuracy [--section circular] [--seed 1] [--scanner profiler] [--set PARAMETER=VALUE]

A tunnel of 120 m with a radius of 300 m and a slope of 4 % is simulated, loaded and run to its sections;
a kilometre begins in its middle. The curve follows a straight of 24 m without a transition, unless --straight
says otherwise. All points of the scan are unrolled and compared with the truth.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import psycopg

from benchmarks.common import print_table, progress, save, scratch_database
from benchmarks.scene import LINING, Scene
from tunneldb.database import connect
from tunneldb.geometry.surface import Surface
from tunneldb.store.surface import load_surface
from tunneldb.store.survey import get_survey

Figures = dict[str, Any]

LENGTH = 120.0
START = 940.0
RADIUS = 300.0
SLOPE = 4.0  # %
SPACING = 10.0
SQL_POINTS = 5000
HEADER = (
    "section", "seed", "points", "unrolled %", "arc bias", "arc p95", "chainage p95", "offset p95", "jump",
    "SQL-Python", "there and back",
)  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dsn", help="server to use; default: the embedded one")
    parser.add_argument("--section", action="append", choices=("circular", "horseshoe", "box"))
    parser.add_argument("--seed", action="append", type=int)
    parser.add_argument("--scanner", default="profiler", choices=("profiler", "static"))
    parser.add_argument("--length", type=float, default=LENGTH)
    parser.add_argument("--straight", type=float, default=24.0, help="before the curve, m")
    parser.add_argument("--set", action="append", default=[], metavar="PARAMETER=VALUE", help="as in tunneldb run")
    arguments = parser.parse_args()
    rows = []
    for section in arguments.section or ("circular", "horseshoe", "box"):
        for seed in arguments.seed or (1, 2, 3):
            progress(f"{section}, seed {seed}")
            rows.append(measure(arguments, section, seed))
    print_table("Unrolling against the truth (mm; lining only)", HEADER, [list(row.values()) for row in rows])
    save("accuracy", {"arguments": vars(arguments), "rows": rows})


def measure(arguments: argparse.Namespace, section: str, seed: int) -> Figures:
    """Figures of one simulated tunnel, lengths in mm."""
    options = [item for setting in arguments.set for item in ("--set", setting)]
    with tempfile.TemporaryDirectory() as folder, scratch_database(arguments.dsn) as database:
        scene = Scene.simulate(
            Path(folder), "tunnel", "--section", section, "--length", arguments.length,
            "--radius", RADIUS, "--slope", SLOPE, "--straight", arguments.straight,
            "--scanner", arguments.scanner, "--seed", seed, start_chainage=START,
        )  # fmt: skip
        scene.register(database)
        scene.load(database)
        scene.run(database, "axis", "sections", *options)
        with connect(database) as connection:
            survey = get_survey(connection, scene.name)
            surface = load_surface(connection, survey)
            return {"section": section, "seed": seed} | compare(connection, survey.id, scene, surface)


def compare(connection: psycopg.Connection, survey_id: int, scene: Scene, surface: Surface) -> Figures:
    """Unroll the scene's points and compare; lengths in mm."""
    truth = scene.truth
    on_lining = np.flatnonzero(truth["class"] == LINING)
    points = scene.xyz[on_lining]
    found = surface.unroll(points)
    known = np.isfinite(found.arc)
    arc, chainage, offset = (
        1000 * (getattr(found, name) - truth[name][on_lining])[known] for name in ("arc", "chainage", "offset")
    )
    back = surface.to_space(found.chainage[known], found.arc[known], found.offset[known])
    return {
        "points": len(points),
        "unrolled": 100 * float(known.mean()),
        "arc_bias": float(arc.mean()),
        "arc_p95": p95(arc),
        "chainage_p95": p95(chainage),
        "offset_p95": p95(offset),
        "jump": 1000 * jump(surface, scene.start_chainage, float(truth["chainage"].max())),
        "sql_python": 1000 * sql_difference(connection, survey_id, surface, points[known]),
        "round_trip": 1000 * float(np.linalg.norm(back - points[known], axis=1).max()),
    }


def p95(error: np.ndarray) -> float:
    return float(np.percentile(np.abs(error), 95))


def jump(surface: Surface, start: float, end: float) -> float:
    """Largest step of the surface, m, across the planes between segments, of which some part kilometres.

    It is taken between the positions of the same arc a micrometre before and after the plane.
    """
    apart = 1e-6
    largest = 0.0
    for plane in np.arange(np.floor(start / SPACING) + 1, np.ceil(end / SPACING)) * SPACING:
        arc_from, arc_to = surface.arc_range(plane)
        arcs = np.arange(arc_from + 0.05, arc_to - 0.05, 0.05)
        before = surface.to_space(np.full_like(arcs, plane - apart), arcs, np.zeros_like(arcs))
        after = surface.to_space(np.full_like(arcs, plane + apart), arcs, np.zeros_like(arcs))
        largest = max(largest, float(np.linalg.norm(after - before, axis=1).max()))
    return largest


def sql_difference(connection: psycopg.Connection, survey_id: int, surface: Surface, points: np.ndarray) -> float:
    """Largest difference between ``tunnel_api.unroll`` and Python in chainage, arc and offset, m."""
    sample = points[np.random.default_rng(1).choice(len(points), min(SQL_POINTS, len(points)), replace=False)]
    with connection.cursor() as cursor:
        rows = cursor.execute(
            """
            SELECT u.chainage, u.arc, u."offset"
            FROM unnest(%s::float8[], %s::float8[], %s::float8[]) WITH ORDINALITY AS p (x, y, z, n)
            LEFT JOIN LATERAL tunnel_api.unroll(%s, public.ST_MakePoint(x, y, z)) AS u ON true
            ORDER BY n
            """,
            (*(column.tolist() for column in sample.T), survey_id),
        ).fetchall()
    found = surface.unroll(sample)
    python = np.column_stack([found.chainage, found.arc, found.offset])
    return float(np.abs(np.array(rows, dtype=float) - python).max())


if __name__ == "__main__":
    main()
