"""More and more workers on one machine, LAZ to sections by `tunneldb batch`: what they wait for.

    python -m benchmarks.workers                        # 8 km, 19.6 million points, with 1, 2, 4 and 8 workers
    python -m benchmarks.workers --km 4 --workers 1,2

For each number of workers:

seconds     of the ledger, from the first stage that began to the last that ended
server      seconds of the processor of the server's processes, sampled; workers: of the command's
waits       sessions of workers by what they waited for (pg_stat_activity, sampled each INTERVAL), as a share of all samples in
            which a worker's session was active. "running" is none of PostgreSQL's waits: computing, or waiting for a core
WAL, read   megabytes written to the WAL (pg_stat_wal), and read from files (pg_stat_database)

More workers than cores show what they contend for besides cores: locks, WAL, buffers.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections import Counter
from pathlib import Path
from threading import Event, Thread
from typing import Any

import psutil
import psycopg

from benchmarks.common import print_table, progress, save, scratch_database, tunneldb
from benchmarks.long import register, run_batch, simulate
from benchmarks.scene import Scene

INTERVAL = 0.05  # s
WAITS = """
SELECT CASE WHEN wait_event_type IS NULL THEN 'running' ELSE wait_event_type || ': ' || wait_event END
  FROM pg_stat_activity
 WHERE datname = current_database() AND backend_type IN ('client backend', 'parallel worker') AND state = 'active'
   AND pid <> pg_backend_pid()
"""
COUNTERS = """
SELECT (SELECT wal_bytes FROM pg_stat_wal), blks_read * current_setting('block_size')::bigint, temp_bytes, deadlocks
  FROM pg_stat_database WHERE datname = current_database()
"""
COUNTED = ("wal", "read", "temporary", "deadlocks")


class Watch:
    """Waits of the sessions of a database, and processor time of its server, sampled while it runs.

    Attributes
    ----------
    waits : Counter
        Samples of active sessions by what they waited for.
    """

    def __init__(self, dsn: str) -> None:
        self.waits: Counter[str] = Counter()
        self._dsn = dsn
        self._ended = Event()
        self._thread = Thread(target=self._look)
        with psycopg.connect(dsn) as connection:
            (pid,) = connection.execute("SELECT setting FROM pg_settings WHERE name = 'data_directory'").fetchone() or ("",)
        self._postmaster = psutil.Process(int((Path(pid) / "postmaster.pid").read_text().split()[0]))
        self._spent: dict[int, float] = {}

    @property
    def seconds(self) -> float:
        """Processor time of the server's processes."""
        return sum(self._spent.values())

    def __enter__(self) -> Watch:
        self._note()
        self._before = dict(self._spent)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()
        self._note()
        self._spent = {pid: spent - self._before.get(pid, 0.0) for pid, spent in self._spent.items()}

    def _look(self) -> None:
        with psycopg.connect(self._dsn, autocommit=True) as connection:
            while not self._ended.wait(INTERVAL):
                self.waits.update(name for (name,) in connection.execute(WAITS))
                self._note()

    def _note(self) -> None:
        for process in self._postmaster.children():
            try:
                times = process.cpu_times()
            except psutil.NoSuchProcess:
                continue
            self._spent[process.pid] = times.user + times.system


def counters(dsn: str) -> list[int]:
    """Return bytes of WAL, bytes read from files, bytes of temporary files, and deadlocks, since the server began."""
    with psycopg.connect(dsn) as connection:
        row = connection.execute(COUNTERS).fetchone()
    assert row is not None
    return [int(value) for value in row]


def measure(dsn: str, folder: Path, kilometres: int, workers: list[int]) -> list[dict[str, Any]]:
    """Run the batch with each number of workers."""
    progress(f"simulating {kilometres} km")
    scene, _ = simulate(folder, kilometres, 1)
    tunneldb("tunnel", "add", scene.name, "--srid", 25830, "--axis", scene.file("axis.csv"), dsn=dsn)
    progress("compiling ahead")
    warm = Scene.simulate(folder, "warm", "--length", 40, "--density", 100)
    warm.register(dsn)
    run_batch(dsn, warm.name, warm.scans, 1, "all")
    figures = []
    for count in workers:
        progress(f"{count} workers")
        register(dsn, scene, "measured")
        before, start = counters(dsn), time.process_time()
        with Watch(dsn) as watch:
            batch = run_batch(dsn, "measured", scene.scans, count, "all")
        after = counters(dsn)
        figures.append(
            {
                "workers": count,
                "seconds": batch["ledger_seconds"],
                "stages": batch["stages"],
                "server": watch.seconds,
                "watching": time.process_time() - start,
                "waits": dict(watch.waits.most_common()),
                **{name: b - a for name, a, b in zip(COUNTED, before, after, strict=True)},
                "points": batch["points"],
            }
        )
        tunneldb("survey", "remove", "measured", "--yes", dsn=dsn)
    return figures


def report(figures: list[dict[str, Any]]) -> None:
    """Print the figures, and the waits of each run."""
    first = figures[0]["seconds"]
    print_table(
        "LAZ to sections",
        ("workers", "seconds", "speed", "server, CPU s", "WAL, MB", "read, MB", "temporary, MB", "deadlocks"),
        [
            (one["workers"], f"{one['seconds']:.1f}", f"{first / one['seconds']:.2f}", f"{one['server']:.1f}",
             *(f"{one[name] / 1e6:.0f}" for name in ("wal", "read", "temporary")), one["deadlocks"])
            for one in figures
        ],
    )  # fmt: skip
    names = [name for name, _ in sum((Counter(one["waits"]) for one in figures), Counter()).most_common(12)]
    rows = [
        (name, *(f"{100.0 * one['waits'].get(name, 0) / max(sum(one['waits'].values()), 1):.1f} %" for one in figures))
        for name in names
    ]
    print_table("Active sessions", ("sessions", *(f"{one['workers']} workers" for one in figures)), rows)
    stages = figures[0]["stages"]
    print_table(
        "Stages",
        ("stage, s in all", *(f"{one['workers']} workers" for one in figures)),
        [(stage, *(f"{one['stages'][stage]:.1f}" for one in figures)) for stage in stages],
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--km", type=int, default=8)
    parser.add_argument("--workers", default="1,2,4,8", help="numbers of workers, parted by commas")
    asked = parser.parse_args()
    with scratch_database(None) as dsn, tempfile.TemporaryDirectory() as folder:
        figures = measure(dsn, Path(folder), asked.km, [int(count) for count in asked.workers.split(",")])
    report(figures)
    print(save("workers", {"runs": figures}))


if __name__ == "__main__":
    main()
