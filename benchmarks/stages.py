"""A kilometre at survey density from its scan file to sections, against bare decoding and a bare COPY of its rows.

    python -m benchmarks.stages                      # 1 km, 2.45 million points; the median of five
    python -m benchmarks.stages --repeat 3 --folder /tmp/km   # the simulated files stay there for the next time

decode     laspy reads the file's points, and takes coordinates, time and intensity out of them
COPY       a binary COPY of the rows that are kept, packed already, into a table without index, in the transaction that makes it
load       the command `tunneldb load --density all`, its stage by the ledger: the points are at survey density already
axis, …    the command `tunneldb run --from axis --to sections`, its stages by the ledger
start-up   what the two commands take beside their stages: imports, connecting, ending

Times are those of the processor, user and system, of the command and of the server with all its processes, and by the clock.
The server is the embedded one, which does nothing else meanwhile. The processor's are sampled every INTERVAL and told apart
by when the ledger has the stages begin and end. Loops are compiled before.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from statistics import median
from threading import Event, Thread
from typing import Any, NamedTuple

import laspy
import numpy as np
import psycopg

from benchmarks import long, pipeline
from benchmarks.common import COMMAND, print_table, progress, save, scratch_database, tunneldb
from benchmarks.scene import Scene
from tunneldb.database import connect
from tunneldb.store.survey import get_survey

INTERVAL = 0.02  # s
TICK = 1 / os.sysconf("SC_CLK_TCK")  # s
STAGES = ("load", "axis", "segments", "sections")
CHUNK = 1_000_000


class Spent(NamedTuple):
    """Seconds of the processor, of client and server, and by the clock."""

    client: float
    server: float
    clock: float

    @property
    def processor(self) -> float:
        return self.client + self.server


class Server:
    """The processor time of a server on this machine: the postmaster, the processes that it has and those that it had."""

    def __init__(self, dsn: str) -> None:
        with psycopg.connect(dsn) as connection:
            row = connection.execute("SELECT pg_backend_pid()").fetchone()
            assert row is not None
            self.pid = int(_stat(row[0])[1])

    def seconds(self) -> float:
        """Seconds of user and system since it was started."""
        children = Path(f"/proc/{self.pid}/task/{self.pid}/children").read_text().split()
        ticks = sum(int(ticks) for ticks in _stat(self.pid)[11:15])
        for child in children:
            with suppress(FileNotFoundError, ProcessLookupError):  # it has just ended
                ticks += sum(int(ticks) for ticks in _stat(int(child))[11:13])
        return ticks * TICK


def _stat(pid: int) -> list[str]:
    """Fields of /proc/PID/stat from the third on: state, parent, …; user and system time are the 12th and 13th of these."""
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()


class Samples:
    """Processor time of a command and of the server while it runs."""

    def __init__(self, pid: int, server: Server) -> None:
        self.rows: list[tuple[float, float, float]] = []  # seconds since the epoch, of the client, of the server
        self._pid, self._server = pid, server
        self._ended = Event()
        self._thread = Thread(target=self._watch)

    def __enter__(self) -> Samples:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._ended.wait(INTERVAL):
            with suppress(FileNotFoundError, ProcessLookupError):
                own = sum(int(ticks) for ticks in _stat(self._pid)[11:13]) * TICK
                self.rows.append((time.time(), own, self._server.seconds()))

    def between(self, begin: float, end: float) -> Spent:
        """Return the resources used between two times."""
        at, client, server = np.array(self.rows).T
        at_ends = [np.interp([begin, end], at, np.maximum.accumulate(values)) for values in (client, server)]
        of_client, of_server = (float(values[1] - values[0]) for values in at_ends)
        return Spent(of_client, of_server, end - begin)


def command(server: Server, dsn: str, survey: str, *arguments: object) -> tuple[Spent, dict[str, Spent]]:
    """Run a command on a survey; what it took, and what its stages did."""
    begun, clock = time.time(), time.perf_counter()
    own, servers = _of_children(), server.seconds()
    with (
        subprocess.Popen(
            [*COMMAND, *map(str, arguments)], env=dict(os.environ) | {"TUNNELDB_DSN": dsn},
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        ) as process,
        Samples(process.pid, server) as samples,
    ):  # fmt: skip
        said, _ = process.communicate()
    if process.returncode != 0:
        raise SystemExit(f"tunneldb {' '.join(map(str, arguments))}\n{said}")
    time.sleep(0.1)  # for the server to see off the command's session
    total = Spent(_of_children() - own, server.seconds() - servers, time.perf_counter() - clock - 0.1)
    with connect(dsn) as connection:
        runs = connection.execute(
            "SELECT stage, min(extract(epoch FROM started_at))::float8, max(extract(epoch FROM finished_at))::float8"
            " FROM tunnel.run WHERE survey_id = %s AND outcome = 'done' AND started_at >= to_timestamp(%s) GROUP BY stage",
            (get_survey(connection, survey).id, begun),
        ).fetchall()
    return total, {stage: samples.between(begin, end) for stage, begin, end in runs}


def _of_children() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def timed(server: Server, work: Callable[[], object]) -> Spent:
    """Measure the time of work in this process."""
    servers, own, clock = server.seconds(), time.process_time(), time.perf_counter()
    work()
    return Spent(time.process_time() - own, server.seconds() - servers, time.perf_counter() - clock)


def decode(files: Sequence[Path], dimension: str) -> int:
    """Decode files into arrays, and nothing else; returns how many points they hold."""
    points = 0
    for file in files:
        with laspy.open(file) as reader:
            for chunk in reader.chunk_iterator(CHUNK):
                xyz, _, _ = np.column_stack([chunk.x, chunk.y, chunk.z]), np.array(chunk.gps_time), np.array(chunk[dimension])
                points += len(xyz)
    return points


def bare_copy(server: Server, dsn: str, survey: str) -> Spent:
    """Copy a survey's rows, packed already, into a table made in the same transaction."""
    names = ("survey_id", "km", "chainage", "gps_time", "geom", "scan_id", "file_id", "intensity", "classification")
    columns = ", ".join(names)  # those that loading writes
    with psycopg.connect(dsn) as connection, connection.cursor() as cursor:
        source = f"SELECT {columns} FROM tunnel.point WHERE survey_id = {get_survey(connection, survey).id}"
        with cursor.copy(f"COPY ({source}) TO STDOUT (FORMAT binary)") as copy:
            blocks = b"".join(copy)
        connection.commit()

        def work() -> None:
            cursor.execute(f"CREATE TABLE public.bare AS {source} WITH NO DATA")
            with cursor.copy("COPY public.bare FROM STDIN (FORMAT binary, FREEZE)") as copy:
                for at in range(0, len(blocks), 1 << 20):
                    copy.write(blocks[at : at + (1 << 20)])
            connection.commit()

        spent = timed(server, work)
        cursor.execute("DROP TABLE public.bare")
    return spent


def once(server: Server, dsn: str, scene: Scene, survey: str, density: str) -> dict[str, Spent]:
    """All parts one after the other, on a survey that is made for it and taken out again."""
    long.register(dsn, scene, survey)
    spent = {"decode": timed(server, lambda: decode(scene.scans, "Amplitude"))}
    loaded, stages = command(server, dsn, survey, "load", survey, "--density", density, *scene.scans)
    spent["COPY"] = bare_copy(server, dsn, survey)
    ran, others = command(server, dsn, survey, "run", survey, "--from", "axis", "--to", "sections")
    spent |= stages | others
    spent["commands"] = Spent(*np.sum([loaded, ran], axis=0).tolist())
    beside = np.array(spent["commands"]) - np.sum([spent[stage] for stage in STAGES], axis=0)
    spent["start-up"] = Spent(*beside.tolist())
    tunneldb("survey", "remove", survey, "--yes", dsn=dsn)
    return spent


def medians(runs: Sequence[dict[str, Spent]]) -> dict[str, Spent]:
    """Return the medians of client, server and clock times of each part."""
    return {part: Spent(*(median(run[part][i] for run in runs) for i in range(3))) for part in runs[0]}


def ratios(run: dict[str, Spent]) -> dict[str, float]:
    """Stages, and the whole commands, as multiples of decoding and COPY: of the processor and by the clock."""
    floor = run["decode"].processor + run["COPY"].processor
    stages = [run[stage] for stage in STAGES]
    return {
        "stages / floor, processor": sum(one.processor for one in stages) / floor,
        "commands / floor, processor": run["commands"].processor / floor,
        "stages / floor, clock": sum(one.clock for one in stages) / (run["decode"].clock + run["COPY"].clock),
        "commands / floor, clock": run["commands"].clock / (run["decode"].clock + run["COPY"].clock),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--km", type=int, default=1, help="length of the tunnel, km")
    parser.add_argument("--density", default="all", help="points per m² to keep, or all")
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--folder", type=Path, help="where the simulated files stay for the next time; default: nowhere")
    arguments = parser.parse_args()
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as temporary, scratch_database(None) as dsn:
        folder = arguments.folder or Path(temporary)
        progress("compiling ahead")
        pipeline.compile_ahead(dsn, Path(temporary))
        scene = Scene(folder, "long", 0.0)
        if not scene.file("json").exists():
            progress(f"simulating {arguments.km} km")
            scene, _ = long.simulate(folder, arguments.km, arguments.seed)
        tunneldb("tunnel", "add", scene.name, "--srid", 25830, "--axis", scene.file("axis.csv"), dsn=dsn)
        server, runs = Server(dsn), []
        for number in range(arguments.repeat):
            progress(f"run {number + 1} of {arguments.repeat}")
            runs.append(once(server, dsn, scene, f"run{number + 1}", arguments.density))
        points = decode(scene.scans, "Amplitude")
    figures = report(runs, points)
    print(f"\n{save('stages', figures | {'load_average_before': load})}")


def report(runs: Sequence[dict[str, Spent]], points: int) -> dict[str, Any]:
    """Print the parts one below the other, and the ratios."""
    middle = medians(runs)
    parts = ("decode", "COPY", *STAGES, "start-up", "commands")
    header = ("seconds", "client", "server", "processor", "clock")
    rows = []
    for part in parts:
        spent = middle[part]
        rows.append((part, *(f"{value:.2f}" for value in (spent.client, spent.server, spent.processor, spent.clock))))
    print_table(f"{points:,} points from LAZ to sections, medians of {len(runs)}", header, rows)
    each = [ratios(run) for run in runs]
    found = {name: median(one[name] for one in each) for name in each[0]}
    for name, value in found.items():
        print(f"{name}: {value:.2f} ({min(one[name] for one in each):.2f}–{max(one[name] for one in each):.2f})")
    return {
        "points": points,
        "ratios": found,
        "medians": {part: spent._asdict() for part, spent in middle.items()},
        "runs": [{part: spent._asdict() for part, spent in run.items()} for run in runs],
    }


if __name__ == "__main__":
    main()
