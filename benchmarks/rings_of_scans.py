"""Rings of simulated scans against their truth: segmental linings that are oval, shifted and stepped; plain, dirty, leaking.

python -m benchmarks.rings_of_scans                                         # simulate, load, run, measure: minutes
python -m benchmarks.rings_of_scans --survey NAME --truth scan/NAME.json    # of a survey that is there, rings measured

53 rings of 1.5 m each, 8 m wide, 3 mm of range noise, cables and niches, on a curve of 400 m and a grade. Truth of radius,
centre and ovality is the ellipse of least squares through the ring as built; of steps the mean over the cell of arc. Centres to
the right are not compared: the axis that simulate writes has a vertex every 20 m.
"""

from __future__ import annotations

import argparse
import csv
import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import psycopg
from psycopg import sql

from benchmarks.common import print_table, progress, save, scratch_database, tunneldb
from benchmarks.scene import Scene
from tunneldb.arrays import Bool, Float
from tunneldb.database import resolve_dsn
from tunneldb.measures.rings.compute.joint_steps import CELL_ROWS
from tunneldb.measures.rings.compute.patches import PATCH
from tunneldb.simulate import Parameters, Simulation
from tunneldb.simulate.ring_truth import lips, ring_heights

COMMON = (
    "--length", 80, "--radius", 400, "--slope", 1, "--scanner", "profiler", "--profile-spacing", 0.02, "--profile-points", 1250,
    "--lining", "segments", "--ovality", 0.2, 0.6, "--ring-step", 0.001, "--ring-shift", 0.002, "--segment-step", 0.001,
    "--no-truth",
)  # fmt: skip
KINDS: dict[str, tuple[object, ...]] = {
    "plain": ("--leaks", 0, "--seed", 11),
    "dirty": ("--leaks", 4, "--soot", 4, "--grime", 3, "--salts", 3, "--paint", 4, "--patches", 6, "--seed", 12),
    "leaking": ("--leaks", 14, "--joint-leaks", 6, "--ring-leaks", 1, "--drips", "--seed", 13),
}
START = 100.0
SAME = 0.1
"""A ring is one of the truth if its joints lie so near to the true ones, m."""

WIDE = 0.5 * CELL_ROWS * PATCH
LEAST_LIP = 0.0015
"""Lips of so much and more are asked for, m."""


def truth_of(path: Path) -> tuple[Simulation, list[dict[str, float]]]:
    """The simulation of its record, and the rows of its rings."""
    given = json.loads(path.read_text())["parameters"]
    values = {name: tuple(value) if isinstance(value, list) else value for name, value in given.items()}
    with path.with_suffix(".rings.csv").open(encoding="utf-8") as file:
        rows = [{name: float(value) for name, value in row.items() if value} for row in csv.DictReader(file)]
    return Simulation(Parameters(**values)), rows


def row(name: str, off: Float, se: Float, factor: float) -> tuple[object, ...]:
    """Return median, 95 % quantile and maximum of differences (n,), and the share within 1.96 standard errors."""
    size = factor * np.abs(off)
    held = 100.0 * float(np.mean(np.abs(off) <= 1.96 * se))
    ratio = float(np.sqrt(np.mean((off / se) ** 2)))
    return name, len(off), *(round(float(q), 4) for q in np.quantile(size, [0.5, 0.95, 1.0])), round(held, 1), round(ratio, 2)


def judge(conn: psycopg.Connection[Any], survey: str, path: Path) -> list[tuple[object, ...]]:
    """Rows of the table of a survey."""
    simulation, truth = truth_of(path)
    columns = ("number", "chainage_from", "chainage_to", "radius", "radius_se", "ovality", "ovality_se", "design_diameter",
               "centre_up", "centre_up_se", "seen_share", "lip", "lip_se", "lip_arc")  # fmt: skip
    query = sql.SQL("SELECT {} FROM tunnel_api.ring WHERE survey = %s ORDER BY number").format(
        sql.SQL(", ").join(map(sql.Identifier, columns))
    )
    found = [dict(zip(columns, one, strict=True)) for one in conn.execute(query, [survey]).fetchall()]
    begin = np.array([one["chainage_from"] for one in truth])
    at = np.array([int(np.argmin(np.abs(begin - one["chainage_from"]))) for one in found])
    joints = np.array([one["chainage_from"] for one in found]) - begin[at]
    ends = np.array([one["chainage_to"] for one in found]) - np.array([truth[k]["chainage_to"] for k in at])
    both = [
        (one, truth[k])
        for one, k, first, last in zip(found, at, joints, ends, strict=True)
        if max(abs(first), abs(last)) < SAME
    ]
    measured = [(one, true) for one, true in both if one["ovality"] is not None]
    rows: list[tuple[object, ...]] = [
        (
            "rings",
            len(both),
            "",
            "",
            f"{len(truth)} true",
            f"{100 * np.mean([one['seen_share'] for one, _ in both]):.0f} % seen",
            "",
        ),
        row("joint, mm", joints, np.full(len(joints), np.nan), 1e3),
    ]
    for name, label, factor in (("radius", "radius, mm", 1e3), ("centre_up", "centre up, mm", 1e3)):
        off = np.array([one[name] - true[name] for one, true in measured])
        rows.append(row(label, off, np.array([one[f"{name}_se"] for one, _ in measured]), factor))
    share = [2.0 * true["radius"] / one["design_diameter"] for one, true in measured]
    off = np.array([one["ovality"] - true["ovality"] * part for (one, true), part in zip(measured, share, strict=True)])
    rows.append(row("ovality, %", off, np.array([one["ovality_se"] for one, _ in measured]), 100.0))
    return rows + steps(conn, survey, simulation, both) + lips_found(simulation, both)


def steps(
    conn: psycopg.Connection[Any], survey: str, simulation: Simulation, both: list[tuple[dict[str, Any], dict[str, float]]]
) -> list[tuple[object, ...]]:
    """Rows of steps: of all cells, of those without a joint of segments, and of the greatest of each ring."""
    number = {one["number"]: int(true["number"]) - 1 for one, true in both}
    cells = [
        one
        for one in conn.execute(
            "SELECT number, arc, step, step_se FROM tunnel_api.ring_step WHERE survey = %s ORDER BY number, cell", [survey]
        ).fetchall()
        if number.get(one[0], 0) > 0
    ]
    ring = np.array([number[one[0]] for one in cells])
    arc, step, se = np.array([one[1:] for one in cells]).T
    parts = np.arange(-WIDE + 0.005, WIDE, 0.01)
    true, split = np.empty(len(cells)), np.zeros(len(cells), np.bool_)
    for k in range(len(cells)):
        here = ring_heights(simulation, arc[k] + parts)[[ring[k] - 1, ring[k]]]
        true[k] = (here[1] - here[0]).mean()
        split[k] = any((np.abs(lips(simulation, j)[0] - arc[k]) < WIDE + PATCH).any() for j in (ring[k] - 1, ring[k]))
    off = step - true
    rows = [row("steps, mm", off, se, 1e3), row("steps, no joint of segments in the cell, mm", off[~split], se[~split], 1e3)]
    of_ring = [ring == one for one in np.unique(ring)]
    told = [np.flatnonzero(one & (se <= 2.0 * np.median(se[one]))) for one in of_ring]
    most = np.array([one[np.argmax(np.abs(step[one]))] for one in told])
    rows.append(row("greatest step of a ring, mm", off[most], se[most], 1e3))
    return rows


def lips_found(simulation: Simulation, both: list[tuple[dict[str, Any], dict[str, float]]]) -> list[tuple[object, ...]]:
    """Rows of lips: how many of the large ones were told, and errors of those told; false ones lie at no joint of segments."""
    off, se, false = [], [], 0
    large = hit = 0
    for one, true in both:
        arc, size = lips(simulation, int(true["number"]) - 1)
        asked: Bool = np.abs(size) >= LEAST_LIP
        large += bool(asked.any())
        if one["lip"] is None:
            continue
        near = int(np.argmin(np.abs(arc - one["lip_arc"])))
        if abs(arc[near] - one["lip_arc"]) > 2.0 * PATCH:
            false += 1
            continue
        hit += bool(asked.any())
        off.append(one["lip"] - size[near])
        se.append(one["lip_se"])
    if not off:
        return [("lips", 0, "", "", "", "", "")]
    return [
        row("lips told, mm", np.array(off), np.array(se), 1e3),
        (f"rings with a lip of {1e3 * LEAST_LIP:g} mm, told of", large, hit, "", f"{false} elsewhere", "", ""),
    ]


def made(dsn: str, folder: Path, kind: str, options: tuple[object, ...]) -> Path:
    """Simulate, load, run and measure a survey; its record."""
    scene = Scene.simulate(folder, kind, *COMMON, *options, start_chainage=START)
    scene.register(dsn)
    scene.load(dsn)
    scene.run(dsn)
    tunneldb("rings", kind, "--find", "--diameter", 8, "-o", folder / f"{kind}.csv", dsn=dsn)
    return scene.file("json")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dsn")
    parser.add_argument("--kinds", nargs="*", default=list(KINDS), choices=list(KINDS))
    parser.add_argument("--survey", help="one that is there")
    parser.add_argument("--truth", type=Path, help="record of its simulation, NAME.json")
    options = parser.parse_args()
    tables: dict[str, list[tuple[object, ...]]] = {}
    if options.survey:
        with psycopg.connect(resolve_dsn(options.dsn)) as conn:
            tables[options.survey] = judge(conn, options.survey, options.truth)
    else:
        with TemporaryDirectory() as folder, scratch_database(options.dsn) as dsn:
            for kind in options.kinds:
                record = made(dsn, Path(folder), kind, KINDS[kind])
                with psycopg.connect(dsn) as conn:
                    tables[kind] = judge(conn, kind, record)
                progress(kind)
    header = ("found less true", "n", "half below", "95 % below", "greatest", "% in 1.96 se", "rms / se")
    for name, rows in tables.items():
        print_table(f"rings of {name}", header, rows)
    save("rings_of_scans", {"tables": tables})


if __name__ == "__main__":
    main()
