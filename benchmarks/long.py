"""A long tunnel at survey density, LAZ to sections, by `tunneldb batch`: time, memory and disk per kilometre.

    python -m benchmarks.long                           # 25 km, 61 million points; some ten minutes
    python -m benchmarks.long --km 2 --only one,parallel
    python -m benchmarks.long --workers 4 --density 100

one       a kilometre from the middle, by one worker
serial    the whole tunnel, by one worker
parallel  the whole tunnel, by --workers of them
peer      the same kilometre by the paper's stages in plain SQL (benchmarks/peer), by somebody who knows the planner;
          peer-as-worded by one who doesn't

The points are at survey density already: all are kept (--density all), so that the peer has the same rows. Each time is the
command's by the clock, start-up included, and the ledger's from the first stage that began to the last that ended.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from threading import Event, Thread
from typing import Any

import psutil
import psycopg

from benchmarks import peer
from benchmarks.common import COMMAND, print_table, progress, save, scratch_database, tunneldb
from benchmarks.scene import Scene
from tunneldb.database import connect
from tunneldb.store.survey import get_survey

PARTS = ("one", "serial", "parallel", "peer", "peer-as-worded")
DEFAULT = PARTS[:4]
STAGES = ("read", "load", "axis", "segments", "sections")
INTERVAL = 0.1  # s between looks at the workers' memory


class Memory:
    """Resident memory of a process's descendants, sampled while it runs."""

    def __init__(self, pid: int) -> None:
        self.samples: list[tuple[float, int, int]] = []  # time since the epoch, process, bytes
        self._root = psutil.Process(pid)
        self._ended = Event()
        self._thread = Thread(target=self._watch)

    def __enter__(self) -> Memory:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._ended.wait(INTERVAL):
            try:
                children = self._root.children(recursive=True)
            except psutil.NoSuchProcess:
                return
            for child in children:
                try:
                    self.samples.append((time.time(), child.pid, child.memory_info().rss))
                except psutil.NoSuchProcess:
                    continue

    def peak(self, pid: int, begin: float, end: float) -> int | None:
        """Return the most that a process had between two times, None if it was not seen then."""
        return max((rss for at, process, rss in self.samples if process == pid and begin <= at <= end), default=None)


def simulate(folder: Path, kilometres: int, seed: int) -> tuple[Scene, dict[str, float]]:
    """Make the tunnel: an S of radius 4000 m that rises by 1.7 %, scanned by a profiler."""
    start = time.perf_counter()
    scene = Scene.simulate(
        folder, "long", "--length", 1000 * kilometres, "--radius", 4000, "--s-curve", "--slope", 1.7, "--scanner", "profiler",
        "--density", 100, "--no-truth", "--leaks", 80 * kilometres, "--seed", seed,
    )  # fmt: skip
    size = sum(file.stat().st_size for file in scene.scans)
    return scene, {"seconds": time.perf_counter() - start, "files": len(scene.scans), "bytes": size}


def register(dsn: str, scene: Scene, survey: str) -> None:
    tunneldb(
        "survey", "add", survey, "--tunnel", scene.name, "--date", "2024-05-04", "--trajectory", scene.file("trajectory.csv"),
        "--reference", scene.file("reference.csv"), "--intensity", "Amplitude", "--intensity-kind", "amplitude", dsn=dsn,
    )  # fmt: skip


def run_batch(dsn: str, survey: str, files: Sequence[Path], workers: int, density: str) -> dict[str, Any]:
    """Bring files to sections, and say what it took."""
    before = _database_size(dsn)
    command = [*COMMAND, "batch", survey, *map(str, files), "--workers", str(workers), "--to", "sections", "--density", density]
    start = time.perf_counter()
    with (
        subprocess.Popen(
            command, env=dict(os.environ) | {"TUNNELDB_DSN": dsn}, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        ) as process,
        Memory(process.pid) as memory,
    ):
        said, _ = process.communicate()
    seconds = time.perf_counter() - start
    if process.returncode != 0:
        raise SystemExit(f"tunneldb batch {survey}\n{said}")
    return {"workers": workers, "seconds": seconds} | _account(dsn, survey, memory, before)


def _account(dsn: str, survey: str, memory: Memory, before: int) -> dict[str, Any]:
    """Figures of a batch that is done, from the ledger and the catalogue."""
    with connect(dsn) as connection:
        key = get_survey(connection, survey).id
        runs = connection.execute(
            "SELECT stage, km, split_part(worker, '/', 2)::int, extract(epoch FROM started_at)::float8,"
            " extract(epoch FROM finished_at)::float8 FROM tunnel.run WHERE survey_id = %s AND outcome = 'done'",
            (key,),
        ).fetchall()
        counted = connection.execute(
            "SELECT count(*), sum(points)::int8, sum(kept)::int8, sum(bytes)::int8 FROM tunnel.scan_file WHERE survey_id = %s",
            (key,),
        ).fetchone()
        rows = connection.execute(
            "SELECT sum(pg_total_relation_size(relid))::int8 FROM pg_partition_tree(%s)", (f"tunnel.point_s{key}",)
        ).fetchone()
    assert counted is not None
    assert rows is not None
    stages = {stage: sum(end - begin for name, _, _, begin, end in runs if name == stage) for stage in STAGES}
    peaks: dict[int, int] = {}
    for _, km, pid, begin, end in runs:
        peak = memory.peak(pid, begin, end)
        if km is not None and peak is not None:
            peaks[km] = max(peaks.get(km, 0), peak)
    workers = {pid for _, _, pid, _, _ in runs}
    kilometres = len({km for _, km, *_ in runs if km is not None})
    return {
        "ledger_seconds": max(run[4] for run in runs) - min(run[3] for run in runs),
        "stages": stages,
        "kilometres": kilometres,
        "files": counted[0],
        "points": counted[1],
        "kept": counted[2],
        "database_bytes_per_km": (_database_size(dsn) - before) / kilometres,
        "point_bytes_per_km": rows[0] / kilometres,
        "peak_bytes_of_km": peaks,
        "peak_bytes": max(memory.peak(pid, 0, float("inf")) or 0 for pid in workers),
    }


def _database_size(dsn: str) -> int:
    with psycopg.connect(dsn, autocommit=True) as connection:
        connection.execute("CHECKPOINT")
        row = connection.execute("SELECT pg_database_size(current_database())").fetchone()
    assert row is not None
    return int(row[0])


def measure(dsn: str, folder: Path, parts: Sequence[str], arguments: argparse.Namespace) -> dict[str, Any]:
    """Run the parts that are wanted, one after the other."""
    progress(f"simulating {arguments.km} km")
    scene, made = simulate(folder, arguments.km, arguments.seed)
    figures: dict[str, Any] = {"simulation": made}
    tunneldb("tunnel", "add", scene.name, "--srid", 25830, "--axis", scene.file("axis.csv"), dsn=dsn)
    middle = scene.scans[len(scene.scans) // 2]
    batches = {"one": ([middle], 1), "serial": (scene.scans, 1), "parallel": (scene.scans, arguments.workers)}
    if batches.keys() & set(parts):
        progress("compiling ahead")
        warm = Scene.simulate(folder, "warm", "--length", 40, "--density", 100)
        warm.register(dsn)
        run_batch(dsn, warm.name, warm.scans, 1, arguments.density)
    for name, (files, workers) in batches.items():
        if name in parts:
            progress(f"{name}: {len(files)} km, {workers} worker{'s' * (workers > 1)}")
            register(dsn, scene, name)
            figures[name] = run_batch(dsn, name, files, workers, arguments.density)
            if name != parts[-1]:
                tunneldb("survey", "remove", name, "--yes", dsn=dsn)
    for name in ("peer", "peer-as-worded"):
        if name in parts:
            progress(f"{name}: 1 km")
            found = peer.run(dsn, [middle], scene.file("axis.csv"), careful=name == "peer")
            seconds = found.seconds | {"total": found.total}
            figures[name] = {"seconds": seconds, "points": found.points, "axis_passes": found.axis_passes}
    return figures | {"ratios": ratios(figures)}


def ratios(figures: dict[str, Any]) -> dict[str, float]:
    """Return what the parts say of each other, as far as they were run."""
    one, serial, parallel = (figures.get(name) for name in ("one", "serial", "parallel"))
    found = {}
    for kind in ("seconds", "ledger_seconds"):
        if one and serial:
            found[f"serial / (km × one), {kind}"] = serial[kind] / (serial["kilometres"] * one[kind])
        if serial and parallel:
            found[f"serial / parallel, {kind}"] = serial[kind] / parallel[kind]
    for name in ("peer", "peer-as-worded"):
        for ours in ("one", "serial", "parallel"):
            if name in figures and ours in figures:
                each = figures[ours]["seconds"] / figures[ours]["kilometres"]
                found[f"{name} / {ours}, per km"] = figures[name]["seconds"]["total"] / each
    return found


def report(figures: dict[str, Any]) -> None:
    """Print what the batches took, and how they compare."""
    made = figures["simulation"]
    print(f"\nsimulated {made['files']} files of {made['bytes'] / 1e6:,.0f} MB in {made['seconds']:.0f} s")
    names = [name for name in ("one", "serial", "parallel") if name in figures]
    batches = [figures[name] for name in names]
    rows: list[tuple[object, ...]] = [
        ("kilometres", *(b["kilometres"] for b in batches)),
        ("workers", *(b["workers"] for b in batches)),
        ("points in the files", *(b["points"] for b in batches)),
        ("rows kept", *(b["kept"] for b in batches)),
        ("seconds, by the clock", *(f"{b['seconds']:.1f}" for b in batches)),
        ("seconds, by the ledger", *(f"{b['ledger_seconds']:.1f}" for b in batches)),
        ("points/s", *(round(b["points"] / b["seconds"]) for b in batches)),
        *((f"{stage}, s/km", *(f"{b['stages'][stage] / b['kilometres']:.2f}" for b in batches)) for stage in STAGES),
        ("peak of a worker, MB", *(round(b["peak_bytes"] / 1e6) for b in batches)),
        ("… in the first kilometre", *(_peak(b, min) for b in batches)),
        ("… in the last kilometre", *(_peak(b, max) for b in batches)),
        ("database, MB/km", *(round(b["database_bytes_per_km"] / 1e6) for b in batches)),
        ("… points, MB/km", *(round(b["point_bytes_per_km"] / 1e6) for b in batches)),
    ]
    if batches:
        print_table("LAZ to sections by tunneldb batch", ("", *names), rows)
    for name in ("peer", "peer-as-worded"):
        if name in figures:
            print(f"{name}: {figures[name]['seconds']['total']:.1f} s for {figures[name]['points']:,} points")
    for name, value in figures["ratios"].items():
        print(f"{name}: {value:.2f}")


def _peak(batch: dict[str, Any], which: Any) -> str:
    peaks = batch["peak_bytes_of_km"]
    return f"{peaks[which(peaks)] / 1e6:.0f}" if peaks else ""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dsn", help="server to use; default: the embedded one")
    parser.add_argument("--km", type=int, default=25, help="length of the tunnel, km")
    parser.add_argument("--workers", type=int, default=2, help="of the part parallel")
    parser.add_argument("--density", default="all", help="points per m² to keep, or all")
    parser.add_argument("--only", default=",".join(DEFAULT), help=f"parts, of {','.join(PARTS)}")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--folder", type=Path, help="where to put the simulated files; default: a temporary folder")
    arguments = parser.parse_args()
    parts = arguments.only.split(",")
    if unknown := set(parts) - set(PARTS):
        parser.error(f"unknown part {', '.join(sorted(unknown))}")
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory(dir=arguments.folder) as temporary, scratch_database(arguments.dsn) as dsn:
        figures = measure(dsn, Path(temporary), parts, arguments)
    report(figures)
    settings = {"km": arguments.km, "density": arguments.density, "load_average_before": load, "command": sys.argv[1:]}
    print(f"\n{save('long', settings | figures)}")


if __name__ == "__main__":
    main()
