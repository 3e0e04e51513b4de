"""Rows that the preview of a batch estimates, compared with those that loading keeps.

``python -m benchmarks.row_estimates SCAN AXIS.csv [SCAN AXIS.csv ...]``
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from tunneldb.geometry.alignment import Alignment
from tunneldb.pointcloud.file_sample import BLOCK, read_runs
from tunneldb.pointcloud.pose_coverage import PoseCoverage
from tunneldb.pointcloud.reader import read_header
from tunneldb.pointcloud.row_estimate import FileSample, estimate_rows
from tunneldb.pointcloud.selection import FilterSettings, filter_file
from tunneldb.pointcloud.spool import Spool
from tunneldb.queue.preview import SAMPLED_RUNS

DENSITIES = (25.0, 100.0, 400.0)
NO_POSES = PoseCoverage(np.empty(0, np.int64), None, np.empty((0, 2)))


def compare(scan: Path, alignment: Alignment, density: float) -> str:
    """Return a line of the table for one scan and density."""
    settings, points = FilterSettings(density), read_header(scan).points
    found = estimate_rows([FileSample(points, list(read_runs(scan, points, SAMPLED_RUNS, BLOCK)))], alignment, settings)
    with Spool(1 << 30) as rows:
        kept = filter_file(scan, None, alignment, NO_POSES, settings, rows, 0).kept
    fits = "yes" if found.low <= kept <= found.high else "no"
    numbers = (points, density, found.low, found.likely, found.high, kept)
    return " | ".join([scan.stem, *(f"{number:,.0f}" for number in numbers), f"{found.likely / kept:.2f}", fits])


def main() -> None:
    """Print the table."""
    print("scan | points | density | low | estimate | high | loaded | estimate / loaded | within")
    pairs = zip(sys.argv[1::2], sys.argv[2::2], strict=True)
    for scan, axis in pairs:
        xyz = np.loadtxt(axis, delimiter=",", skiprows=1, usecols=(0, 1, 2))
        alignment = Alignment.from_polyline(xyz, 0.0)
        for density in DENSITIES:
            print(compare(Path(scan), alignment, density), flush=True)


if __name__ == "__main__":
    main()
