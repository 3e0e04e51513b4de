"""The stage ``detect`` at full density, against bare decoding of the same LAZ files on the same two cores.

    python -m benchmarks.detect                       # 200 million points, about 2 GB of LAZ; 20 minutes and more
    python -m benchmarks.detect --points 20000000
    python -m benchmarks.detect --folder DIR          # files that an earlier run made there

Files are decoded whole by laspy, all dimensions, by two processes of one thread and by one process of two threads; and a
survey of two kilometres is detected, all of the stage, by two processes of one thread with a kilometre each and by one
process of two threads. The share is the faster decoding's time over the detection's. Seconds by the clock count the start
of processes; on a machine that does other things too, seconds of the processors tell more.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.common import print_table, progress, save, scratch_database
from benchmarks.memory import POINTS_PER_METRE, WATCH
from benchmarks.scene import Scene
from tunneldb.threads import use_threads

NAME, BORDER = "dense", 13_000.0
PARTS = 2_000_000  # points whose parts are timed
COMMAND = (
    "from tunneldb.threads import use_threads\nuse_threads({threads})\nfrom tunneldb.cli.main import main\nmain({arguments})"
)
DECODE = """
import sys, laspy
backend = laspy.LazBackend.Lazrs if int(sys.argv[1]) == 1 else laspy.LazBackend.LazrsParallel
size = 50_000 if int(sys.argv[1]) == 1 else 1_000_000
for task in sys.argv[2:]:
    path, begin, end = task.rsplit(":", 2)
    with laspy.open(path, laz_backend=backend) as reader:
        reader.seek(int(begin))
        left = int(end) - int(begin)
        while left:
            left -= len(reader.read_points(min(size, left)))
"""


@dataclass(frozen=True)
class Cost:
    """Of processes that ran at the same time: seconds by the clock and of the processors, and each one's peak, bytes."""

    seconds: float
    cpu: float
    peaks: list[int]


def watch(commands: Sequence[Sequence[str]], dsn: str | None = None) -> Cost:
    """Run commands at the same time."""
    environment = dict(os.environ) | ({"TUNNELDB_DSN": dsn} if dsn else {})
    start = time.perf_counter()
    running = [
        subprocess.Popen([sys.executable, "-c", WATCH, *command], env=environment, stdout=subprocess.PIPE, text=True)
        for command in commands
    ]
    found = [json.loads(process.communicate()[0]) for process in running]
    seconds = time.perf_counter() - start
    if any(one["status"] for one in found):
        raise SystemExit("a command failed")
    return Cost(seconds, sum(one["cpu"] for one in found), [one["peak"] for one in found])


def decoding(files: Sequence[tuple[Path, int]], processes: int, threads: int) -> Cost:
    """Decode files, each process a part of each."""
    commands = []
    for k in range(processes):
        tasks = [f"{path}:{count * k // processes}:{count * (k + 1) // processes}" for path, count in files]
        commands.append([sys.executable, "-c", DECODE, str(threads), *tasks])
    return watch(commands)


def detection(dsn: str, kilometres: Sequence[str], threads: int) -> Cost:
    """Detect ranges of kilometres, a process for each."""
    commands = []
    for km in kilometres:
        arguments = ["run", NAME, "--km", km, "--from", "detect"]
        commands.append([sys.executable, "-c", COMMAND.format(threads=threads, arguments=arguments)])
    return watch(commands, dsn)


@contextmanager
def timed(spent: dict[str, float], name: str) -> Iterator[None]:
    """Add up processor time under a name."""
    start = time.process_time()
    yield
    spent[name] = spent.get(name, 0.0) + time.process_time() - start


def parts(dsn: str, path: Path, count: int) -> dict[str, float]:
    """Seconds of one core for each part of what is done with a point, per point, from the end of a file."""
    use_threads(1)  # before Numba is imported
    from tunneldb.database import connect
    from tunneldb.pipeline.detect import load_floor
    from tunneldb.pointcloud.formats.raw import read_raw
    from tunneldb.pointcloud.points import Points
    from tunneldb.raster.accumulator import Accumulator
    from tunneldb.raster.grid import Grid
    from tunneldb.raster.observation import Observer, Radiometer
    from tunneldb.raster.rasterize import CHUNK, Projector
    from tunneldb.store.images import load_reference
    from tunneldb.store.poses import load_poses
    from tunneldb.store.surface import load_surface
    from tunneldb.store.survey import get_survey

    km = int(BORDER) // 1000
    spent: dict[str, float] = {}
    with connect(dsn) as conn:
        survey = get_survey(conn, NAME)
        surface = load_surface(conn, survey, km * 1000.0, (km + 1) * 1000.0)
        radiometer = Radiometer("amplitude", load_poses(conn, survey), load_reference(conn, survey), 75.0, 40.0, 0.05)
        floor = load_floor(conn, survey, surface, km, 0.0)
    observer = Observer.of(surface, km, (0.5, 1.2), radiometer, floor)
    grid = Grid.covering(km, 0.02, float(surface.arcs.min()), float(surface.arcs.max()))
    projector = Projector.of(observer, grid, 12.0)
    with Accumulator(grid) as image:
        wanted = min(PARTS, count // 4)
        chunks = read_raw(path, "Amplitude", CHUNK, [(count - wanted - CHUNK, count)])
        image.add(projector.project(Points.of(next(chunks)))[0], CHUNK)  # compiled, and memory at hand
        done = 0
        while done < wanted:
            with timed(spent, "decoding what is needed"):
                raw = next(chunks)
            with timed(spent, "coordinates"):
                points = Points.of(raw)
            with timed(spent, "unrolling, view, correction, pixel"):
                pixels, _ = projector.project(points)
            with timed(spent, "sums of the image"):
                image.add(pixels, len(points))
            done += len(points)
    return {name: seconds / done for name, seconds in spent.items()}


def prepare(folder: Path, points: int, dsn: str) -> Scene:
    """Simulate a tunnel on both sides of a kilometre's border, load it, and run it up to its ground."""
    with tempfile.TemporaryDirectory() as small:
        progress("a short one, so that all is compiled")
        warm = Scene.simulate(Path(small), "short", "--length", 12, "--scanner", "profiler", "--profile-spacing", 0.03)
        warm.register(dsn)
        warm.load(dsn)
        warm.run(dsn)
    length = points / POINTS_PER_METRE
    start = BORDER - length / 2
    scene = Scene(folder, NAME, start)
    if not scene.file("json").exists():
        progress(f"simulating {length:g} m")
        options = ["--length", length, "--radius", 300, "--s-curve", "--scanner", "profiler", "--no-truth"]
        scene = Scene.simulate(folder, NAME, *options, start_chainage=start)
    scene.register(dsn)
    progress("loading")
    scene.load(dsn)
    progress("axis, segments, sections, ground")
    scene.run(dsn, "axis", "ground")
    return scene


def measure(dsn: str, scene: Scene) -> dict[str, Any]:
    """Decode and detect by two processes and by two threads; seconds, shares and memory."""
    import laspy

    files = []
    for path in scene.scans:
        with laspy.open(path) as reader:
            files.append((path, int(reader.header.point_count)))
    points = sum(count for _, count in files)
    first, last = int(BORDER) // 1000 - 1, int(BORDER) // 1000
    progress("time of each part")
    each = parts(dsn, *files[-1])
    found: dict[str, Cost] = {}
    for processes, threads in ((2, 1), (1, 2)):
        what = "2 processes" if processes == 2 else "2 threads"
        progress(what)
        kilometres = [str(first), str(last)] if processes == 2 else [f"{first}-{last}"]
        found[f"decoding, {what}"] = decoding(files, processes, threads)
        found[f"detection, {what}"] = detection(dsn, kilometres, threads)
    bare = {kind: min(getattr(cost, kind) for name, cost in found.items() if "decoding" in name) for kind in ("seconds", "cpu")}
    return {
        "points": points,
        "files": len(files),
        "bytes": sum(path.stat().st_size for path, _ in files),
        "parts": each,
        "runs": {
            name: {
                "seconds": cost.seconds,
                "cpu": cost.cpu,
                "peaks": cost.peaks,
                "share": bare["seconds"] / cost.seconds,
                "share_cpu": bare["cpu"] / cost.cpu,
            }
            for name, cost in found.items()
        },
    }


def report(figures: dict[str, Any]) -> None:
    """Print the tables."""
    points = figures["points"]
    rows = [
        (
            name,
            f"{points / run['seconds'] / 1e6:.2f}",
            f"{run['share']:.2f}",
            f"{run['cpu'] / points * 1e9:.0f}",
            f"{run['share_cpu']:.2f}",
            " ".join(f"{peak / 1e9:.2f}" for peak in run["peaks"]),
        )
        for name, run in figures["runs"].items()
    ]
    title = f"Full density, {points:,} points in {figures['files']} files, {figures['bytes'] / 1e9:.2f} GB"
    print_table(title, ("", "million points/s", "share", "ns of a core/point", "share", "peak, GB"), rows)
    print_table(
        "Each point, one thread",
        ("part", "ns"),
        [(name, f"{seconds * 1e9:.0f}") for name, seconds in figures["parts"].items()],
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dsn", help="server to use; default: the embedded one")
    parser.add_argument("--points", type=int, default=200_000_000, help="points to simulate, about")
    parser.add_argument("--folder", type=Path, help="where to make the files, or where they are; default: a temporary one")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary, scratch_database(arguments.dsn) as dsn:
        folder = arguments.folder or Path(temporary)
        figures = measure(dsn, prepare(folder, arguments.points, dsn))
    report(figures)
    print(f"\n{save('detect', figures)}")


if __name__ == "__main__":
    main()
