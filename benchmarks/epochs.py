"""Change between two scans of a round lining on a curve and a grade, by compare and by M3C2 (py4dgeo) on the same points.

python -m benchmarks.epochs          # two minutes on two cores
python -m benchmarks.epochs --m3c2   # with the peer: pip install py4dgeo

Pixels of 2 cm hold a point each, of 3 mm noise; the second scan has patches of 1 m² that moved by 3 mm, and a pose that is off
by 20 mm and 0.02°. M3C2 gets the points with the true pose, and with the one that is off: it takes nothing out. Its core points
are the middles of the cells, its cylinders have the area of a cell, its normals are found within 0.5 m.
"""

from __future__ import annotations

import argparse
import resource
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from scipy import ndimage

from benchmarks.common import print_table, save
from tunneldb.arrays import Bool, Float
from tunneldb.geometry.surface import Surface
from tunneldb.measures.change.compute.cells import CellGrid, Cells, CellSums, without_edges
from tunneldb.measures.change.compute.change import WINDOW, change_regions
from tunneldb.measures.change.compute.sections import Change, measure_change

sys.path.append(str(Path(__file__).parent.parent / "tests"))
from support.curved_lining import made

RADIUS, WEST, PIXEL, NOISE, CHANGE, CELL = 4.0, 20.0, 0.02, 0.003, 0.003, 0.1
HALF = 9.0  # of the arc that is lining
POSE, TURN = 0.02, np.radians(0.02)
APART = 5.0  # m from patch to patch


def pixels(length: float) -> tuple[Float, Float]:
    """Chainage and arc of all pixels."""
    chainage, arc = np.meshgrid(
        WEST + (np.arange(round(length / PIXEL)) + 0.5) * PIXEL, -HALF + (np.arange(round(2.0 * HALF / PIXEL)) + 0.5) * PIXEL
    )
    return chainage.ravel(), arc.ravel()


def patches(chainage: Float, arc: Float, length: float) -> Float:
    """Number of the patch that a place lies in, from 1; 0 beside them."""
    found = np.zeros(len(chainage))
    for k in range(int(length / APART)):
        west, south = WEST + APART * k + 2.0, (-5.0, 0.5, 4.2)[k % 3]
        found[(chainage > west) & (chainage < west + 1.0) & (arc > south) & (arc < south + 1.0)] = k + 1
    return found


def scan(surface: Surface, length: float, seed: int, changed: bool, off: bool) -> Float:
    """Points (n, 3) of a scan."""
    chainage, arc = pixels(length)
    offset = np.random.default_rng(seed).normal(0.0, NOISE, len(arc))
    if changed:
        offset += CHANGE * (patches(chainage, arc, length) > 0)
    points = surface.to_space(chainage, arc, offset)
    if off:
        middle = points.mean(axis=0)
        turn = np.array([[1.0, -TURN, TURN], [TURN, 1.0, -TURN], [-TURN, TURN, 1.0]])
        points = middle + (points - middle) @ turn.T + POSE / np.sqrt(3.0)
    return points


def cells(surface: Surface, grid: CellGrid, points: Float) -> Cells:
    """Cells of a scan, by way of the image of rounded offsets that is stored."""
    there = surface.unroll(points)
    sums = CellSums(grid, PIXEL)
    sums.add(there.chainage, there.arc, np.round(there.offset, 3), np.ones(len(points), np.bool_))
    return without_edges(sums.cells())


def judge(significant: Bool, truth: Float, compared: Bool, holds: float, seconds: float) -> tuple[object, ...]:
    """Row of the table: unchanged cells where the level of detection holds, patches found, false regions by 1000 m²."""
    labels, count = ndimage.label(significant)
    sizes = ndimage.sum_labels(significant, labels, np.arange(1, count + 1))
    regions = [labels == k + 1 for k in np.flatnonzero(sizes >= WINDOW**2)]
    met = [np.unique(truth[region][truth[region] > 0.0]) for region in regions]
    found = {int(one) for some in met for one in some}
    false = sum(len(some) == 0 for some in met)
    wanted = int(truth.max())
    area = compared.sum() * CELL**2
    return f"{100.0 * holds:.1f} %", f"{len(found)} of {wanted}", f"{1000.0 * false / area:.1f}", f"{seconds:.1f} s"


def ours(surface: Surface, grid: CellGrid, old: Float, new: Float, truth: Float) -> tuple[tuple[object, ...], Change]:
    """Return the result of compare."""
    begun = time.perf_counter()
    found = measure_change(surface, grid, cells(surface, grid, old), cells(surface, grid, new), 1.5, PIXEL)
    regions = change_regions(found.difference, found.variance, found.removed_error, found.scatter, found.place_error)
    seconds = time.perf_counter() - begun
    compared = np.isfinite(found.difference)
    plain = compared & (truth == 0.0)
    significant = np.zeros(truth.shape, np.bool_)
    for region in regions:
        significant[region.rows, region.columns] = True
    holds = float(np.mean(np.abs(found.difference[plain]) <= found.lod[plain]))
    return judge(significant, truth, compared, holds, seconds), found


def m3c2(surface: Surface, grid: CellGrid, old: Float, new: Float, truth: Float) -> tuple[object, ...]:
    """Return the result of M3C2: a cell is significant if its distance exceeds its own level of detection."""
    import py4dgeo

    chainage, arc = (values.ravel() for values in np.meshgrid(grid.chainage, grid.arc))
    core = surface.to_space(chainage, arc, np.zeros(len(chainage)))
    shift = core.mean(axis=0)
    begun = time.perf_counter()
    epochs: list[Any] = [py4dgeo.Epoch(points - shift) for points in (old, new)]
    method = py4dgeo.M3C2(
        epochs=tuple(epochs), corepoints=core - shift, cyl_radius=CELL / np.sqrt(np.pi), normal_radii=(0.5,), max_distance=0.2
    )
    distance, uncertainty = method.run()
    seconds = time.perf_counter() - begun
    distance, lod = (np.reshape(values, truth.shape) for values in (distance, uncertainty["lodetection"]))
    compared = np.isfinite(distance) & np.isfinite(lod)
    plain = compared & (truth == 0.0)
    with np.errstate(invalid="ignore"):
        significant = compared & (np.abs(distance) > lod)
    return judge(significant, truth, compared, float(np.mean(np.abs(distance[plain]) <= lod[plain])), seconds)


def main() -> None:
    """Print both."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--length", type=float, default=60.0, help="of the tunnel, m")
    parser.add_argument("--m3c2", action="store_true", help="with py4dgeo")
    arguments = parser.parse_args()
    length = arguments.length
    surface, _ = made(RADIUS, length + 2.0 * WEST + 60.0, 0.0, 0.0)
    grid = CellGrid(CELL, WEST, -HALF, round(length / CELL), round(2.0 * HALF / CELL))
    chainage, arc = (values.ravel() for values in np.meshgrid(grid.chainage, grid.arc))
    truth = patches(chainage, arc, length).reshape(grid.rows, grid.columns)
    old = scan(surface, length, 1, changed=False, off=False)
    rows: list[tuple[object, ...]] = []
    for name, changed, off in (
        ("unchanged, pose true", False, False), ("unchanged, pose off", False, True), ("patches of 3 mm, pose off", True, True),
        ("patches of 3 mm, pose true", True, False),
    ):  # fmt: skip
        new = scan(surface, length, 2, changed, off)
        shown = truth if changed else np.zeros_like(truth)
        row, _ = ours(surface, grid, old, new, shown)
        rows.append((name, "compare", *row))
        if arguments.m3c2:
            rows.append((name, "M3C2", *m3c2(surface, grid, old, new, shown)))
    headings = ("scene", "by", "LoD holds", "patches found", "false in 1000 m²", "time")
    print_table("Change between two scans", headings, rows)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{2 * HALF * length:.0f} m², {len(old)} points a scan; greatest memory {memory:.0f} MB")
    save("epochs", {"rows": [dict(zip(headings, map(str, row), strict=True)) for row in rows], "memory_mb": memory})


if __name__ == "__main__":
    main()
