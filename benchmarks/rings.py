"""Rings against results published by others, and against the rings that points were simulated from.

python -m benchmarks.rings               # about a minute on two cores
python -m benchmarks.rings --rings 100   # of each kind of simulated ring; 15 without it
"""

from __future__ import annotations

import argparse
import csv
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from benchmarks.common import print_table, save
from tunneldb.arrays import Float
from tunneldb.measures.rings.surveyed import RingRow, measure_rings
from tunneldb.shape.rings import fit_ring

DATA = Path(__file__).parents[1] / "tests" / "data" / "wriggle"
RADIUS, DIAMETER, NOISE = 2.9, 5.8, 0.003
KINDS = {
    "ellipse": {"flattening": 0.01},
    "ellipse, floor unseen": {"flattening": 0.01, "gap": 90.0},
    "ellipse, floor unseen, cables": {"flattening": 0.01, "gap": 90.0, "cables": 0.05},
    "circle, floor unseen, cables": {"gap": 90.0, "cables": 0.05},
    "with 2 mm of third order, cables": {"flattening": 0.01, "third": 0.002, "cables": 0.05},
    "the same, floor unseen": {"flattening": 0.01, "third": 0.002, "gap": 90.0, "cables": 0.05},
}


def published() -> dict[str, Float]:
    """Centre (3), chainage, deviation right and up, radius, by ring."""
    with (DATA / "published.csv").open(encoding="utf-8") as file:
        rows = list(csv.reader(file))[1:]
    return {str(int(float(row[0]))): np.array(row[1:], dtype=float) for row in rows}


def difference(row: RingRow, other: Float) -> Float:
    """Ours less theirs, mm: along the tunnel, right and up of the centre; chainage; deviation right, up; radius."""
    assert row.ring is not None
    assert row.place is not None
    off = row.ring.centre - other[:3]
    plane = row.ring.plane
    place = [row.place.chainage.value, row.place.right.value, row.place.up.value, row.ring.adjustment.ellipse.radius]
    return 1e3 * np.array([off @ plane.normal, off @ plane.right, off @ plane.up, *(np.array(place) - other[3:])])


def against_published() -> tuple[list[tuple[object, ...]], list[tuple[object, ...]]]:
    """Rows of how differences are distributed, and of each ring that differs by more than the targets."""
    rows = measure_rings(DATA / "points.csv", DATA / "axis.csv", DIAMETER).rows
    theirs = published()
    off = np.array([difference(row, theirs[row.name]) for row in rows])
    sizes = {
        "centre in space": (np.linalg.norm(off[:, :3], axis=1), 1.0),
        "centre across the tunnel": (np.hypot(off[:, 1], off[:, 2]), 1.0),
        "radius": (np.abs(off[:, 6]), 1.0),
        "chainage": (np.abs(off[:, 3]), 2.0),
        "deviation to the right": (np.abs(off[:, 4]), 1.0),
        "deviation up": (np.abs(off[:, 5]), 1.0),
    }
    table: list[tuple[object, ...]] = [
        (name, *np.percentile(size, [50, 95, 100]).round(2).tolist(), limit, round(100.0 * float((size <= limit).mean()), 1))
        for name, (size, limit) in sizes.items()
    ]
    larger = np.zeros(len(rows), bool)
    for size, limit in sizes.values():
        larger |= size > limit
    each: list[tuple[object, ...]] = [
        (rows[k].name, *off[k, [3, 4, 5, 6]].round(2).tolist(), "; ".join(rows[k].remarks)) for k in np.flatnonzero(larger)
    ]
    return table, each


def as_published() -> list[tuple[object, ...]]:
    """Return the deviations of the published centres from least-squares circles through all eight points, vertical, mm."""
    theirs = published()
    off = []
    for name, points in surveyed().items():
        middle = points.mean(axis=0)
        away = points - middle
        along = np.linalg.eigh(away[:, :2].T @ away[:, :2])[1][:, 1]
        flat = np.column_stack([away[:, :2] @ along, away[:, 2]])
        found = least_squares(
            lambda x, flat=flat: np.hypot(flat[:, 0] - x[0], flat[:, 1] - x[1]) - x[2], [0.0, 0.0, RADIUS],
            xtol=1e-14, ftol=1e-14, gtol=1e-14,
        ).x  # fmt: skip
        centre = np.array([*(middle[:2] + found[0] * along), middle[2] + found[1]])
        off.append(1e3 * float(np.linalg.norm(centre - theirs[name][:3])))
    return [(*np.percentile(off, [50, 95, 100]).round(4).tolist(), f"{sum(one <= 1.0 for one in off)} of {len(off)}")]


def alone(names: Sequence[str]) -> list[tuple[object, ...]]:
    """Return for each ring the greatest distance of a point from the plane of the other seven, and theirs, mm."""
    rows: list[tuple[object, ...]] = []
    for name, points in surveyed().items():
        if name not in names:
            continue
        apart = []
        for k in range(len(points)):
            others = np.delete(points, k, axis=0)
            middle = others.mean(axis=0)
            _, values, axes = np.linalg.svd(others - middle)
            apart.append((abs(float((points[k] - middle) @ axes[2])), float(values[2] / np.sqrt(len(others) - 3.0)), k + 1))
        distance, scatter, point = max(apart, key=lambda one: one[0] / one[1])
        rows.append((name, point, round(1e3 * distance, 1), round(1e3 * scatter, 1)))
    return rows


def surveyed() -> dict[str, Float]:
    """Points (8, 3) of each ring."""
    points: dict[str, list[list[float]]] = {}
    with (DATA / "points.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            points.setdefault(row["ring"], []).append([float(row[axis]) for axis in "xyz"])
    return {name: np.array(of) for name, of in points.items()}


def simulated(
    rng: np.random.Generator, count: int, flattening: float = 0.0, third: float = 0.0, gap: float = 0.0, cables: float = 0.0
) -> Float:
    """Points (n, 2) of a ring about (0.03, -0.02): the gap, in degrees, is at the floor, cables stand 5 to 20 cm in."""
    clock = np.radians(180.0 + rng.uniform(gap / 2.0, 360.0 - gap / 2.0, count))
    turned = clock - rng.uniform(0.0, np.pi)
    radius = 1.0 / np.hypot(np.cos(turned) / (RADIUS + flattening), np.sin(turned) / (RADIUS - flattening))
    radius += third * np.cos(3.0 * (clock - rng.uniform(0.0, 2.0))) + rng.normal(0.0, NOISE, count)
    hung = np.radians(rng.uniform(200.0, 340.0, 3))
    nearest = np.argsort(np.abs(np.subtract.outer(clock % (2.0 * np.pi), hung)).min(axis=1))[: int(cables * count)]
    radius[nearest] -= rng.uniform(0.05, 0.2, len(nearest))
    return np.column_stack([radius * np.sin(clock) + 0.03, radius * np.cos(clock) - 0.02])


def against_truth(rings: int, count: int) -> list[tuple[object, ...]]:
    """Row of each kind of ring: what 95 % of the errors are below, and the time."""
    table: list[tuple[object, ...]] = []
    for name, kind in KINDS.items():
        errors, began = [], time.perf_counter()
        for seed in range(rings):
            ring = fit_ring(simulated(np.random.default_rng(seed), count, **kind))
            ellipse = ring.adjustment.ellipse
            wrong = 4.0 * (ellipse.flattening - kind.get("flattening", 0.0)) / DIAMETER
            away = float(np.linalg.norm(ellipse.centre - [0.03, -0.02]))
            errors.append([1e3 * abs(ellipse.radius - RADIUS), 100.0 * abs(wrong), 1e3 * away])
        seconds = (time.perf_counter() - began) / rings
        table.append((name, *np.percentile(errors, 95, axis=0).round(3).tolist(), round(1e3 * seconds)))
    return table


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rings", type=int, default=15, help="simulated rings of each kind")
    parser.add_argument("--points", type=int, default=4000, help="points of each")
    options = parser.parse_args()
    table, each = against_published()
    header = ("mm", "median", "95 % below", "greatest", "target", "within %")
    print_table("217 surveyed rings against the published results", header, table)
    print_table(
        "rings that differ by more: ours less theirs, mm", ("ring", "chainage", "right", "up", "radius", "remark"), each
    )
    again = as_published()
    circles = ("median mm", "95 % below", "greatest", "within 1 mm")
    print_table("circles of least squares through all eight points, in vertical planes, against the published", circles, again)
    apart = alone([str(row[0]) for row in each])
    print_table("of these rings: the point off the plane of the others", ("ring", "point", "off by mm", "others mm"), apart)
    truth = against_truth(options.rings, options.points)
    titles = ("95 % of errors below", "radius mm", "ovality %", "centre mm", "ms a ring")
    print_table(f"simulated rings of {options.points} points, {1e3 * NOISE:g} mm noise", titles, truth)
    save("rings", {"published": table, "larger": each, "as_published": again, "alone": apart, "simulated": truth})


if __name__ == "__main__":
    main()
