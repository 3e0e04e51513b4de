"""Peak memory of loading a large file, as the kernel counts it for the loading process alone."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path

from benchmarks.common import COMMAND
from benchmarks.scene import Scene
from tunneldb.simulate import Parameters, Simulation, write

POINTS_PER_METRE = 100_000  # of the simulated profiler: 1500 points a profile, one every 15 mm
# Runs in a process of its own with nothing else in it: Linux counts the parent's memory at the start of a
# child as the child's.
WATCH = """
import json, os, subprocess, sys, time
start = time.perf_counter()
child = subprocess.Popen(sys.argv[1:], stdout=subprocess.DEVNULL)
_, status, usage = os.wait4(child.pid, 0)
seconds = time.perf_counter() - start
code, cpu = os.waitstatus_to_exitcode(status), usage.ru_utime + usage.ru_stime
print(json.dumps({"status": code, "peak": usage.ru_maxrss * 1024, "cpu": cpu, "seconds": seconds}))
"""


def measure(dsn: str, folder: Path, points: int) -> dict[str, float]:
    """Simulate a file of about that many points and load it; bytes and seconds."""
    parameters = Parameters(name="large", length=points / POINTS_PER_METRE, scanner="profiler")
    made = write(Simulation(parameters), folder, truth=False)
    scene = Scene(folder, "large", 0.0)
    scene.register(dsn)
    load = [*COMMAND, "load", scene.name, *map(str, made.clouds)]
    start = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", WATCH, *load],
        env=dict(os.environ) | {"TUNNELDB_DSN": dsn},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    seconds = time.perf_counter() - start
    watched = json.loads(done.stdout)
    if watched["status"] != 0:
        raise SystemExit("loading failed")
    return {
        "points": made.points,
        "file_bytes": sum(file.stat().st_size for file in made.clouds),
        "peak_bytes": watched["peak"],
        "seconds": seconds,
    }


def report(figures: dict[str, float]) -> None:
    """Print the peak."""
    print(
        f"\nLoading {figures['points']:,} points ({figures['file_bytes'] / 1e9:.2f} GB of LAZ):"
        f" peak memory {figures['peak_bytes'] / 1e9:.2f} GB, {figures['seconds']:.0f} s"
    )
