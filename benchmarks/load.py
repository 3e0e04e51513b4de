"""Loading against the least that it could take: bare LAZ decoding, and a bare binary COPY of the rows that are kept.

    python -m benchmarks.load                      # a kilometre at survey density and 50 million points at full density
    python -m benchmarks.load --only survey --repeat 5
    python -m benchmarks.load --length 100         # of the tunnel at full density, m: 100 000 points each
    python -m benchmarks.load --threads 1          # all in one thread, as each of several workers does

Decoding is laspy's chunks and nothing else. COPY puts rows that are packed already into a table without index, made in the
same transaction. What is loaded is dropped between repeats; each figure is the least of them.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from pathlib import Path
from typing import Any

import laspy

from benchmarks import pipeline
from benchmarks.common import print_table, progress, save, scratch_database, tunneldb
from benchmarks.scene import Scene
from tunneldb.database import connect
from tunneldb.pipeline.load import load_files
from tunneldb.pointcloud.selection import FilterSettings
from tunneldb.store.survey import get_survey
from tunneldb.threads import threads, use_threads

CHUNK = 1_000_000
POINTS_PER_METRE = 100_000  # of the simulated profiler


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dsn", help="server to use; default: the embedded one")
    parser.add_argument("--only", choices=("survey", "full"), help="one of the two")
    parser.add_argument("--length", type=float, default=500.0, help="tunnel at full density, m")
    parser.add_argument("--survey-length", type=float, default=1000.0, help="tunnel at survey density, m")
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--repeat", type=int, default=3)
    arguments = parser.parse_args()
    use_threads(arguments.threads)
    figures: dict[str, Any] = {"threads": threads()}
    with tempfile.TemporaryDirectory() as temporary, scratch_database(arguments.dsn) as dsn:
        folder = Path(temporary)
        pipeline.compile_ahead(dsn, folder)
        if arguments.only != "full":
            progress(f"simulating {arguments.survey_length:g} m at survey density")
            scene = pipeline.survey_density(folder, arguments.survey_length, 1)
            figures["survey"] = measure(dsn, scene, arguments.repeat)
        if arguments.only != "survey":
            progress(f"simulating {arguments.length * POINTS_PER_METRE:,.0f} points")
            options = ("--length", arguments.length, "--scanner", "profiler", "--no-truth")
            figures["full"] = measure(dsn, Scene.simulate(folder, "full", *options), arguments.repeat)
    report(figures)
    print(f"\n{save('load', figures)}")


def measure(dsn: str, scene: Scene, repeat: int) -> dict[str, Any]:
    """Seconds of decoding, COPY, loading, and of the command with its start-up, the least of several."""
    progress(f"loading {scene.name}")
    scene.register(dsn)
    times: dict[str, list[float]] = {"decode": [], "load": [], "command": [], "copy": []}
    for _ in range(repeat):
        times["decode"].append(decode(scene.scans))
        times["load"].append(load(dsn, scene))
        times["copy"].append(pipeline.bare_copy(dsn, scene.name)["seconds"])
        forget(dsn, scene.name)
        times["command"].append(tunneldb("load", scene.name, *scene.scans, dsn=dsn))
        kept = forget(dsn, scene.name)
    seconds = {name: min(values) for name, values in times.items()}
    with laspy.open(scene.scans[0]) as file:
        points = file.header.point_count
    return {"points": points, "kept": kept, "seconds": seconds, "load_average": os.getloadavg()[0]}


def decode(files: list[Path]) -> float:
    """Seconds to decode files, and nothing else."""
    backend = laspy.LazBackend.Lazrs if threads() == 1 else laspy.LazBackend.LazrsParallel
    start = time.perf_counter()
    for file in files:
        with laspy.open(file, laz_backend=backend) as reader:
            for _ in reader.chunk_iterator(CHUNK):
                pass
    return time.perf_counter() - start


def load(dsn: str, scene: Scene) -> float:
    """Seconds to load files in this process."""
    with connect(dsn) as connection:
        survey = get_survey(connection, scene.name)
        connection.rollback()
        start = time.perf_counter()
        list(load_files(connection, survey, scene.scans, FilterSettings()))
        return time.perf_counter() - start


def forget(dsn: str, name: str) -> int:
    """Take out of a survey what was loaded; returns how many rows it held."""
    with connect(dsn) as connection:
        survey = get_survey(connection, name).id
        row = connection.execute("SELECT sum(kept)::int8 FROM tunnel.scan_file WHERE survey_id = %s", [survey]).fetchone()
        assert row is not None
        connection.execute("DELETE FROM tunnel.scan_file WHERE survey_id = %s", [survey])
        connection.execute("DELETE FROM tunnel.run WHERE survey_id = %s", [survey])
        connection.execute(f"DROP TABLE tunnel.point_s{survey}")  # type: ignore[arg-type]
        connection.commit()
    return int(row[0])


def report(figures: dict[str, Any]) -> None:
    """Print seconds, rates and shares."""
    rows = []
    for name in ("survey", "full"):
        if name in figures:
            found = figures[name]
            seconds = found["seconds"]
            bare = seconds["decode"] + seconds["copy"]
            found["share"] = bare / seconds["load"]
            found["share_command"] = bare / seconds["command"]
            rows.append(
                (
                    f"{name}, {found['points']:,} points, {found['kept']:,} kept",
                    *(f"{seconds[key]:.2f}" for key in ("decode", "copy", "load", "command")),
                    f"{found['points'] / seconds['load'] / 1e6:.2f}",
                    f"{found['share']:.2f}",
                    f"{found['share_command']:.2f}",
                    f"{found['load_average']:.1f}",
                )
            )
    header = ("seconds", "decode", "COPY", "load", "command", "million/s", "share", "… command", "load average")
    print_table(f"Loading with {figures['threads']} threads; share = (decode + COPY) / load", header, rows)


if __name__ == "__main__":
    main()
