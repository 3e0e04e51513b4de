"""Noise of a file of soundings, against planes of its own: ``python -m benchmarks.canal.noise FILE...``.

In each cell in plan a plane is fitted by Tukey's biweight; what is left square to it is noise, relief finer than the cell, and
false echoes. Errors that neighbouring beams have in common do not show.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from tunneldb.arrays import Float
from tunneldb.pointcloud.sonar import read_soundings
from tunneldb.robust import MAD_TO_SIGMA

LEAST = 12  # points of a cell
STEEPEST = 2.0  # slope of what is fitted as a height: walls are left out
TUKEY, ROUNDS = 4.685, 8


def residuals(points: Float, edge: float) -> Float:
    """Distances of points (n, 3) from the planes of their cells of ``edge`` m, m; of cells with too few, and of walls, none."""
    cell = np.floor(points[:, :2] / edge).astype(np.int64)
    order = np.lexsort(cell.T)
    ends = np.flatnonzero(np.diff(cell[order], axis=0).any(axis=1)) + 1
    return np.concatenate([np.zeros(0), *(_of_cell(points[part]) for part in np.split(order, ends) if len(part) >= LEAST)])


def _of_cell(points: Float) -> Float:
    middle = np.median(points, axis=0)
    design = np.column_stack([np.ones(len(points)), points[:, :2] - middle[:2]])
    height, weight = points[:, 2] - middle[2], np.ones(len(points))
    if np.linalg.matrix_rank(design, tol=0.05) < 3:
        return np.zeros(0)
    for _ in range(ROUNDS):
        root = np.sqrt(weight)
        plane = np.linalg.lstsq(design * root[:, None], height * root, rcond=None)[0]
        off = height - design @ plane
        scale = max(MAD_TO_SIGMA * float(np.median(np.abs(off))), 1e-6)
        weight = np.clip(1.0 - (off / (TUKEY * scale)) ** 2, 0.0, None) ** 2
    if np.hypot(*plane[1:]) > STEEPEST:
        return np.zeros(0)
    freedom = np.sqrt(len(points) / (len(points) - 3.0))  # three parameters were fitted
    return np.asarray(off / np.hypot(1.0, np.hypot(*plane[1:])) * freedom)


def main() -> None:
    """Print a line for each file."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.canal.noise", description=__doc__)
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--cell", type=float, default=0.5, help="edge of a cell, m")
    asked = parser.parse_args()
    print(f"| file | points | compared, cells of {asked.cell:g} m | σ mm | 95 % mm | beyond 5 σ |\n|---|---|---|---|---|---|")
    for path in asked.files:
        points, _ = read_soundings(path)
        off = np.abs(residuals(points, asked.cell))
        sigma = MAD_TO_SIGMA * float(np.median(off))
        print(
            f"| {path.name} | {len(points)} | {len(off)} | {1e3 * sigma:.1f} | {1e3 * np.quantile(off, 0.95):.0f}"
            f" | {100.0 * (off > 5.0 * sigma).mean():.1f} % |"
        )


if __name__ == "__main__":
    main()
