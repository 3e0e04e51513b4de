"""Speed and memory of writing scan files again with classes, beside reading and writing the same file without a thought.

    python -m benchmarks.files                    # points/s of both verbs and of the bare rewriting
    python -m benchmarks.files --memory           # peak memory of `tunneldb ground` at 100 million points, too (minutes)

A straight tunnel with people, equipment, cables and ballast is simulated, and repeated end to end to the length wanted.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import laspy
import numpy as np
from laspy import LazBackend

from benchmarks.common import COMMAND, print_table, progress, save, scratch_database
from benchmarks.memory import WATCH
from benchmarks.scene import Scene
from tunneldb.simulate import Parameters, Simulation, write

LENGTH = 40.0  # m of tunnel that are simulated
CHUNK = 1_000_000
BACKEND = LazBackend.LazrsParallel
VERBS = {"bare": "laspy, read and write", "ground": "tunneldb ground", "export": "tunneldb export --classified"}


def simulate(folder: Path, repeats: int, name: str = "files") -> Scene:
    """Simulate a piece of straight, level tunnel, and put it end to end so many times; its axis is that of the whole."""
    parameters = Parameters(
        name=name, length=LENGTH, radius=0.0, slope=0.0, azimuth=90.0, scanner="profiler",
        people=3, equipment=4, spheres=2, ballast=0.02, sleepers=True, free_cables=1, catenary=True,
    )  # fmt: skip
    piece = folder / "piece"
    piece.mkdir()
    made = write(Simulation(parameters), piece, truth=False)
    scene = Scene(folder, name, 0.0)
    points = [laspy.read(cloud) for cloud in made.clouds]
    header = points[0].header
    step = round(LENGTH / header.scales[0])
    with laspy.open(folder / f"{name}.laz", "w", header=header, laz_backend=BACKEND) as writer:
        for repeat in range(repeats):
            for cloud in points:
                moved = cloud.points.copy()
                moved.array["X"] += repeat * step
                moved["gps_time"] += repeat * LENGTH
                writer.write_points(moved)
    for ending in ("axis.csv", "trajectory.csv", "reference.csv"):
        (folder / f"{name}.{ending}").write_bytes((piece / f"{name}.{ending}").read_bytes())
    for ending, columns in (("axis.csv", 3), ("trajectory.csv", 4)):
        _lengthen(folder / f"{name}.{ending}", repeats, columns)
    return scene


def _lengthen(path: Path, repeats: int, columns: int) -> None:
    """Repeat the rows of a CSV along x, and along the time where there is one."""
    header, *lines = path.read_text().splitlines()
    rows = np.array([[float(value) for value in line.split(",")] for line in lines])
    shift = np.array([LENGTH, LENGTH, 0.0, 0.0] if columns == 4 else [LENGTH, 0.0, 0.0])
    along = columns - 3
    every = np.concatenate([rows + repeat * shift for repeat in range(repeats)])
    kept = np.concatenate([[True], np.diff(np.maximum.accumulate(every[:, along])) > 1e-3])
    text = "\n".join(",".join(f"{value:.6f}" for value in row) for row in every[kept])
    path.write_text(f"{header}\n{text}\n")


def bare(source: Path, target: Path) -> dict[str, float]:
    """Read and write a file with laspy, all points of one class: seconds and CPU seconds."""
    start, cpu = time.perf_counter(), time.process_time()
    with (
        laspy.open(source, laz_backend=BACKEND) as reader,
        laspy.open(target, "w", header=reader.header, laz_backend=BACKEND) as writer,
    ):
        for points in reader.chunk_iterator(CHUNK):
            points["classification"] = np.full(len(points), 64, np.uint8)
            writer.write_points(points)
    return {"seconds": time.perf_counter() - start, "cpu": time.process_time() - cpu}


def watched(arguments: Sequence[object], dsn: str | None = None) -> dict[str, float]:
    """Run a command in a process of its own: seconds, CPU seconds and peak memory."""
    done = subprocess.run(
        [sys.executable, "-c", WATCH, *COMMAND, *map(str, arguments)],
        env=dict(os.environ) | ({"TUNNELDB_DSN": dsn} if dsn else {}),
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    figures: dict[str, float] = json.loads(done.stdout)
    if figures.pop("status") != 0:
        raise SystemExit(f"tunneldb {' '.join(map(str, arguments))} failed")
    return figures


def speed(folder: Path, repeats: int, server: str | None) -> dict[str, Any]:
    """Both commands and the bare rewriting, on one file; each command once before, for what Numba compiles."""
    progress(f"simulating {repeats} × {LENGTH:g} m")
    scene = simulate(folder, repeats)
    (source,) = scene.scans
    with laspy.open(source) as reader:
        count = reader.header.point_count
    out = folder / "out"
    out.mkdir()
    figures: dict[str, Any] = {"points": count, "bytes": source.stat().st_size}
    verb = ["ground", source, "-o", out / "bare.laz"]
    with scratch_database(server) as dsn:
        progress("load and stages up to ground")
        scene.register(dsn)
        scene.load(dsn)
        figures["stages"] = scene.run(dsn, "axis", "ground")
        export = ["export", scene.name, "--classified", "-o", out]
        for arguments in (verb, export):
            watched(arguments, dsn)
        progress("measuring")
        figures["bare"] = [bare(source, out / "laspy.laz") for _ in range(3)]
        figures["ground"] = [watched(verb) for _ in range(3)]
        figures["export"] = [watched(export, dsn) for _ in range(3)]
    return figures


def memory(folder: Path, points: int) -> dict[str, Any]:
    """Peak memory of the bare command on a file of about that many points, and its speed."""
    progress(f"{points:,} points")
    scene = simulate(folder, max(1, round(points / (100_000 * LENGTH))), "large")
    (source,) = scene.scans
    with laspy.open(source) as reader:
        count = reader.header.point_count
    progress("measuring")
    return {"points": count, "bytes": source.stat().st_size} | watched(["ground", source, "-o", folder / "large-out.laz"])


def report(figures: dict[str, Any]) -> None:
    """Print what was measured."""
    if "bare" in figures:
        count = figures["points"]
        best = {name: min(figures[name], key=lambda run: run["seconds"]) for name in VERBS}
        whole = best["bare"]
        rows: list[Sequence[object]] = [
            (
                title, run["seconds"], count / run["seconds"] / 1e6, f"{whole['seconds'] / run['seconds']:.0%}", run["cpu"],
                f"{whole['cpu'] / run['cpu']:.0%}", f"{run['peak'] / 1e9:.2f}" if "peak" in run else "",
            )
            for title, run in ((title, best[name]) for name, title in VERBS.items())
        ]  # fmt: skip
        header = ("", "s", "million/s", "of bare", "CPU s", "of bare", "peak GB")
        print_table(f"{count:,} points, best of 3", header, rows)
    if "memory" in figures:
        large = figures["memory"]
        print(
            f"\ntunneldb ground, {large['points']:,} points ({large['bytes'] / 1e9:.2f} GB of LAZ): peak memory"
            f" {large['peak'] / 1e9:.2f} GB, {large['seconds']:.0f} s"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dsn", help="server to use; default: the embedded one")
    parser.add_argument("--repeats", type=int, default=3, help=f"pieces of {LENGTH:g} m, about 4 million points each")
    parser.add_argument("--memory", action="store_true", help="also class a large file")
    parser.add_argument("--points", type=int, default=100_000_000, help="for --memory")
    parser.add_argument("--only-memory", action="store_true", help="nothing but that")
    arguments = parser.parse_args()
    figures: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        if not arguments.only_memory:
            figures |= speed(folder, arguments.repeats, arguments.dsn)
        if arguments.memory or arguments.only_memory:
            large = folder / "large"
            large.mkdir()
            figures["memory"] = memory(large, arguments.points)
    report(figures)
    print(f"\n{save('files-memory' if arguments.only_memory else 'files', figures)}")


if __name__ == "__main__":
    main()
