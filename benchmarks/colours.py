"""The stage ``detect`` on coloured points, with and without reading the colours: time, memory and size of the images.

    python -m benchmarks.colours                       # 25 km at survey density, about 61 million points
    python -m benchmarks.colours --length 2000
    python -m benchmarks.colours --length 100 --full   # at full density: 100,000 points a metre

A simulated profiler scan is painted (LAS point format 7) and run up to its ground. Then `detect` runs in a process of its own,
in turn without and with the image in colour, and again: the less of two is stated. Without it, the same files are read, and
their colours are not decoded.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path
from typing import Any

import laspy
import numpy as np
import psycopg

from benchmarks.common import print_table, progress, save, scratch_database, tunneldb
from benchmarks.detect import Cost, watch
from benchmarks.scene import Scene

NAME = "painted"
DETECT = """
import sys
from tunneldb.pipeline import detect
if sys.argv[1] == "without":
    detect.coloured_sources = lambda files: (files, ())
from tunneldb.cli.main import main
main(["run", sys.argv[2], "--from", "detect"])
"""


def paint(path: Path) -> None:
    """Give the points of a LAZ file colours: large spots, and noise of some levels."""
    rng = np.random.default_rng(1)
    painted = path.with_suffix(".painted.laz")
    with laspy.open(path) as reader:
        header = laspy.convert(laspy.LasData(reader.header), point_format_id=7).header
        with laspy.open(painted, "w", header=header) as writer:
            for points in reader.chunk_iterator(1_000_000):
                record = laspy.ScaleAwarePointRecord.zeros(len(points), header=header)
                record.copy_fields_from(points)
                wave = (
                    np.sin(np.asarray(points.x) * 2.1) + np.sin(np.asarray(points.y) * 1.7) + np.sin(np.asarray(points.z) * 2.9)
                )
                for name, level in (("red", 120), ("green", 110), ("blue", 100)):
                    record[name] = (257 * np.clip(level + 20 * wave + rng.normal(0.0, 4.0, len(wave)), 1, 255)).astype(
                        np.uint16
                    )
                writer.write_points(record)
    painted.replace(path)


def measure(dsn: str, folder: Path, length: float, full: bool, turns: int) -> dict[str, Any]:
    """Simulate, paint and prepare a tunnel; run `detect` on it in both ways, in turns."""
    progress(f"simulating {length:g} m")
    density = () if full else ("--density", 100)
    options = ("--length", length, "--radius", 4000, "--s-curve", "--scanner", "profiler", "--no-truth", *density)
    scene = Scene.simulate(folder, NAME, *options)
    progress("painting")
    for path in scene.scans:
        paint(path)
    scene.register(dsn)
    progress("to its ground")
    tunneldb("batch", NAME, *scene.scans, "--to", "ground", dsn=dsn)
    found: dict[str, list[Cost]] = {"without": [], "with": []}
    for turn in range(1, turns + 1):
        for name, costs in found.items():
            progress(f"detect, {name} colours, turn {turn}")
            costs.append(watch([[sys.executable, "-c", DETECT, name, NAME]], dsn))
    with psycopg.connect(dsn) as conn:
        sizes = conn.execute(
            "SELECT kind, sum(length(tiff))::bigint FROM tunnel.image i JOIN tunnel.survey s ON s.id = i.survey_id"
            " WHERE s.name = %s GROUP BY kind ORDER BY kind",
            [NAME],
        ).fetchall()
    points = 0
    for path in scene.scans:
        with laspy.open(path) as reader:
            points += reader.header.point_count
    return {
        "length": length,
        "points": points,
        "runs": {
            name: {part: min(getattr(cost, part) for cost in costs) for part in ("seconds", "cpu")}
            | {"peak": max(cost.peaks[0] for cost in costs)}
            for name, costs in found.items()
        },
        "bytes": dict(sizes),
    }


def report(figures: dict[str, Any]) -> None:
    """Print the tables."""
    rows = [
        (
            name,
            f"{run['seconds']:.1f}",
            f"{run['cpu']:.1f}",
            f"{run['cpu'] / figures['points'] * 1e9:.0f}",
            f"{run['peak'] / 1e6:.0f}",
        )
        for name, run in figures["runs"].items()
    ]
    title = f"detect of {figures['length'] / 1000:g} km, {figures['points']:,} points"
    print_table(title, ("colours", "s", "s of cores", "ns of a core/point", "peak, MB"), rows)
    print_table("images", ("kind", "MB/km"), [(k, f"{n / 1e3 / figures['length']:.2f}") for k, n in figures["bytes"].items()])


def main() -> None:
    """Measure and report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dsn", help="server to use; default: the embedded one")
    parser.add_argument("--length", type=float, default=25_000.0, help="length of the tunnel, m")
    parser.add_argument("--turns", type=int, default=2, help="number of runs in each way; the least time is stated")
    parser.add_argument("--full", action="store_true", help="full density")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary, scratch_database(arguments.dsn) as dsn:
        figures = measure(dsn, Path(temporary), arguments.length, arguments.full, arguments.turns)
    report(figures)
    print(f"\n{save('colours', figures)}")


if __name__ == "__main__":
    main()
