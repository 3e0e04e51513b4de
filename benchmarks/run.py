"""Speed and memory, each figure with what it is compared to, in one run on one server.

    make bench                                    # everything but the memory of 100 million points
    python -m benchmarks.run --only pipeline,peer --length 100
    python -m benchmarks.run --only memory --memory

pipeline  a kilometre at survey density: load, axis, segments, sections
peer      the same file through the paper's five stages in plain SQL (benchmarks/peer), as worded; and
careful-peer  by somebody who knows the planner and stops early
copy      a bare binary COPY of the pipeline's rows into a table without an index
density   at full density: LAZ decoding, unrolling and detection, points per second
memory    peak memory of loading a file of 100 million points (minutes; only with --memory)
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

from benchmarks import density, memory, peer, pipeline
from benchmarks.common import print_table, progress, save, scratch_database

PEERS = ("peer", "careful-peer")
PARTS = ("pipeline", *PEERS, "copy", "density", "memory")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dsn", help="server to use; default: the embedded one")
    parser.add_argument("--only", default=",".join(PARTS), help=f"parts, of {','.join(PARTS)}")
    parser.add_argument("--length", type=float, default=1000.0, help="tunnel at survey density, m")
    parser.add_argument("--dense-length", type=float, default=60.0, help="tunnel at full density, m")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--memory", action="store_true", help="also load 100 million points")
    parser.add_argument("--points", type=int, default=100_000_000, help="for --memory")
    arguments = parser.parse_args()
    parts = arguments.only.split(",")
    if unknown := set(parts) - set(PARTS):
        parser.error(f"unknown part {', '.join(sorted(unknown))}")
    figures: dict[str, Any] = {"length": arguments.length, "seed": arguments.seed}
    with tempfile.TemporaryDirectory() as temporary, scratch_database(arguments.dsn) as dsn:
        folder = Path(temporary)
        if {"pipeline", "copy", *PEERS} & set(parts):
            figures |= survey_density(dsn, folder, parts, arguments.length, arguments.seed)
        if "density" in parts:
            progress("full density")
            figures["density"] = density.measure(dsn, folder, arguments.dense_length, arguments.seed)
            density.report(figures["density"])
        if "memory" in parts and arguments.memory:
            progress(f"memory of {arguments.points:,} points")
            figures["memory"] = memory.measure(dsn, folder, arguments.points)
            memory.report(figures["memory"])
    name = "run" if set(parts) == set(PARTS) else f"run-{'-'.join(parts)}"
    print(f"\n{save(name, figures)}")


def survey_density(dsn: str, folder: Path, parts: list[str], length: float, seed: int) -> dict[str, Any]:
    """Pipeline, bare COPY and peer on one file, and their ratios."""
    figures: dict[str, Any] = {}
    progress(f"simulating {length:g} m at survey density")
    scene = pipeline.survey_density(folder, length, seed)
    if {"pipeline", "copy"} & set(parts):
        progress("pipeline")
        figures["pipeline"] = pipeline.measure(dsn, folder, scene)
    if "copy" in parts:
        progress("bare COPY")
        figures["copy"] = pipeline.bare_copy(dsn, scene.name)
    for name in PEERS:
        if name in parts:
            progress(name)
            found = peer.run(dsn, scene.scans, scene.file("axis.csv"), careful=name == "careful-peer")
            figures[name] = {
                "seconds": found.seconds | {"total": found.total},
                "points": found.points,
                "projected": found.projected,
                "axis_passes": found.axis_passes,
            }
    report(figures)
    return figures


def report(figures: dict[str, Any]) -> None:
    """Print the stages side by side, and the ratios."""
    ours = figures.get("pipeline", {}).get("seconds", {})
    theirs = [figures[name]["seconds"] if name in figures else {} for name in PEERS]
    names = ("load", "index", "axis", "segments", "sections", "projection", "start-up of run", "total")
    rows = [(name, *(f"{side[name]:.2f}" if name in side else "" for side in (ours, *theirs))) for name in names]
    print_table("Survey density, seconds", ("stage", "tunneldb", *PEERS), rows)
    if ours:
        kept = figures["pipeline"]
        print(f"tunneldb: {kept['points']:,} points, {kept['kept']:,} kept; axis {kept['axis_passes']} passes")
    for name, seconds in zip(PEERS, theirs, strict=True):
        if seconds:
            print(f"{name}: {figures[name]['points']:,} points; axis {figures[name]['axis_passes']} passes")
        if seconds and ours:
            figures[f"ratio_{name}"] = seconds["total"] / ours["total"]
            print(f"{name} / tunneldb: {figures[f'ratio_{name}']:.1f} by the clock, start-up of two commands included")
    if "copy" in figures:
        bare = figures["copy"]["seconds"]
        print(
            f"bare COPY of the same {figures['copy']['rows']:,} rows: {bare:.2f} s,"
            f" {bare / ours['load']:.0%} of the load, {bare / ours['total']:.0%} of all"
        )


if __name__ == "__main__":
    main()
