"""LAZ: all dimensions of a file against those that are needed, by one thread and by two.

    python -m benchmarks.laz                     # a simulated file of format 6, 10 million points
    python -m benchmarks.laz SCAN.laz ...        # files at hand, with the dimension Amplitude or their intensity

all        laspy decodes whole records
needed     `tunneldb.pointcloud.formats.las.read_las`: coordinates, time, source, class and intensity alone, where the
           point format lets fields be decoded apart (6 to 10)

Seconds of the processor per point, in processes of their own, so that each has its number of threads.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.common import print_table, progress, save
from benchmarks.scene import Scene

PROGRAM = """
import json, sys, time
from pathlib import Path
threads = int(sys.argv[1])
from tunneldb.threads import use_threads
use_threads(threads)
import laspy
from tunneldb.pointcloud.formats.las import read_las
path = Path(sys.argv[3])
with laspy.open(path) as las:
    header = las.header
    dimension = "Amplitude" if "Amplitude" in header.point_format.dimension_names else None
def all_fields():
    backend = laspy.LazBackend.Lazrs if threads == 1 else laspy.LazBackend.LazrsParallel
    with laspy.open(path, laz_backend=backend) as las:
        for _ in las.chunk_iterator(50_000 if threads == 1 else 1_000_000):
            pass
def needed():
    for _ in read_las(path, dimension, 1_000_000):
        pass
work = {"all": all_fields, "needed": needed}[sys.argv[2]]
cpu, clock = time.process_time(), time.perf_counter()
work()
print(json.dumps([time.process_time() - cpu, time.perf_counter() - clock, header.point_count, header.point_format.id]))
"""


def decode(path: Path, what: str, threads: int) -> tuple[float, float, int, int]:
    """Return seconds of the processor and by the clock, the number of points, and the point format."""
    command = [sys.executable, "-c", PROGRAM, str(threads), what, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=dict(os.environ))
    cpu, clock, points, form = json.loads(done.stdout)
    return cpu, clock, points, form


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", type=Path)
    parser.add_argument("--repeat", type=int, default=3)
    asked = parser.parse_args()
    figures = []
    with tempfile.TemporaryDirectory() as folder:
        files = asked.files
        if not files:
            progress("simulating")
            files = Scene.simulate(Path(folder), "laz", "--length", 100, "--density", 4000, "--no-truth").scans
        for path in files:
            for threads in (1, 2):
                for what in ("all", "needed"):
                    runs = [decode(path, what, threads) for _ in range(asked.repeat)]
                    cpu, clock = (min(run[k] for run in runs) for k in (0, 1))
                    figures.append(
                        {"file": path.name, "format": runs[0][3], "points": runs[0][2], "threads": threads, "fields": what,
                         "cpu_ns": cpu / runs[0][2] * 1e9, "clock_ns": clock / runs[0][2] * 1e9}
                    )  # fmt: skip
    print_table(
        "Decoding",
        ("file", "format", "points", "threads", "fields", "ns of a core/point", "ns by the clock/point"),
        [(*list(one.values())[:5], f"{one['cpu_ns']:.0f}", f"{one['clock_ns']:.0f}") for one in figures],
    )
    print(save("laz", {"runs": figures}))


if __name__ == "__main__":
    main()
