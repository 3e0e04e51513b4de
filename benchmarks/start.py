"""The first use against later ones: processor time with nothing compiled yet, and the same again.

    python -m benchmarks.start                                # 30 m of tunnel: simulate, load, run
    python -m benchmarks.start --demo                         # all verbs of scripts/demo.sh, at its size
    python -m benchmarks.start --tunneldb other/bin/tunneldb  # another installation, for before and after
    python -m benchmarks.start --lists                        # how long a list takes: leaks, findings, status
    python -m benchmarks.start --perf                         # also instructions, on a machine that is busy

cold    into an empty folder for compiled code; the user's own is not touched
warm    into the same folder, with another survey of the same kind
loops   how many functions the command compiled, one for each kind of arguments; below the table, how many the package has

Times are those of the processor, of user and system, summed over all cores and processes of a command, its start-up included,
but for the server's. Beside other work they may double: on a machine that is busy compare instructions, which don't.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.common import COMMAND, print_table, progress, save

SHORT = ("--length", "30", "--straight", "0", "--density", "400")
SCENERY = ("--lining", "segments", "--soot", "2", "--paint", "4", "--patches", "4", "--joint-leaks", "2", "--drips")

LISTS = {
    "leaks": ["leaks", "warm-2024"],
    "findings": ["findings", "warm-2024"],
    "status": ["status"],
    "survey list": ["survey", "list"],
    "actions list": ["actions", "list", "warm"],
    "elements list": ["elements", "list", "warm"],
}
REPEATS = 7

# Runs in the installation that is measured.
COUNT = """
import contextlib, importlib, json, pkgutil
import tunneldb

loops = {}
for module in pkgutil.walk_packages(tunneldb.__path__, "tunneldb.", onerror=lambda name: None):
    with contextlib.suppress(ImportError):
        for value in vars(importlib.import_module(module.name)).values():
            function = getattr(value, "py_func", None)
            if getattr(function, "__module__", "").startswith("tunneldb."):
                options = getattr(value, "options", None) or value.targetoptions
                loops[function.__module__, function.__qualname__] = bool(options.get("parallel"))
print(json.dumps({"functions": len(loops), "parallel": sum(loops.values())}))
"""


class Installation:
    """An installation of tunneldb, with a server of its own and folders for what it compiles.

    Attributes
    ----------
    folder
        Where all of it lies.
    cache
        Folder for compiled code.
    """

    def __init__(self, command: Sequence[str], folder: Path, perf: bool = False) -> None:
        self.folder = folder
        self._perf = perf
        self.cache = folder / "cache"
        self.cache.mkdir()
        self._command = list(command)
        self._other = command is not COMMAND
        self._environment = dict(os.environ) | {
            "TUNNELDB_HOME": str(folder / "home"),
            "NUMBA_CACHE_DIR": str(self.cache),
        }
        self._environment.pop("TUNNELDB_DSN", None)
        if self._other:
            self._environment.pop("PYTHONPATH", None)  # which leads to the one at hand

    def run(self, *arguments: object) -> dict[str, float]:
        """Run a command; return its seconds of the processor and by the clock, and how many functions it compiled."""
        counted = self.folder / "perf"
        perf = ["perf", "stat", "-x,", "-e", "instructions:u", "-o", str(counted), "--"] if self._perf else []
        compiled, before, start = self.compiled(), _processor_time(), time.perf_counter()
        done = subprocess.run(
            [*perf, *self._command, *map(str, arguments)], env=self._environment, capture_output=True, text=True, check=False
        )
        if done.returncode != 0:
            raise SystemExit(f"tunneldb {' '.join(map(str, arguments))}\n{done.stdout}{done.stderr}")
        found = {
            "processor": _processor_time() - before,
            "clock": time.perf_counter() - start,
            "compiled": self.compiled() - compiled,
        }
        if perf:
            line = next(line for line in counted.read_text().splitlines() if "instructions" in line)
            found["instructions"] = float(line.split(",")[0]) / 1e9
        return found

    def compiled(self) -> int:
        """Return the number of compilations in the folder of compiled code: one per function and types of arguments."""
        return sum(1 for _ in self.cache.rglob("*.nbc"))

    def loops(self) -> dict[str, int]:
        """Return the numbers of compiled functions in the package, and of parallel ones."""
        python, folder = self._command[0], None
        if self._other:
            python, folder = str(Path(python).parent / "python"), self.folder
        done = subprocess.run(
            [python, "-c", COUNT], cwd=folder, env=self._environment, capture_output=True, text=True, check=False
        )
        if done.returncode != 0:
            raise SystemExit(f"{python}: {done.stderr}")
        return dict(json.loads(done.stdout.splitlines()[-1]))


@contextmanager
def installation(command: Sequence[str], perf: bool) -> Iterator[Installation]:
    """An installation in a folder that lasts as long as it is needed, its server with it."""
    with tempfile.TemporaryDirectory() as temporary:
        Path(temporary).chmod(0o755)  # the server runs as another user where root starts it
        made = Installation(command, Path(temporary), perf)
        try:
            yield made
        finally:
            with suppress(SystemExit):  # what went wrong before is what matters
                made.run("server", "stop")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tunneldb", type=Path, metavar="PATH", help="the program to measure; default: the one at hand")
    parser.add_argument("--demo", action="store_true", help="all commands of the demo, at its size")
    parser.add_argument("--lists", action="store_true", help="the commands that list what is there, and nothing else")
    parser.add_argument("--perf", action="store_true", help="also count instructions, by Linux's perf")
    arguments = parser.parse_args()
    command = [str(arguments.tunneldb.absolute())] if arguments.tunneldb else COMMAND
    if arguments.perf and not shutil.which("perf"):
        parser.error("there is no perf")
    with installation(command, arguments.perf) as measured:
        loops = measured.loops()
        progress("init")
        measured.run("init")
        if arguments.lists:
            measure(measured, "warm", demo=False)
            report_lists({verb: repeat(measured, words) for verb, words in LISTS.items()})
            return
        passes = {name: measure(measured, name, arguments.demo) for name in ("cold", "warm")}
    figures: dict[str, Any] = {"demo": arguments.demo, "loops": loops, **passes, "load_average": os.getloadavg()[0]}
    report(figures)
    print(f"\n{save('start-demo' if arguments.demo else 'start', figures)}")


def repeat(measured: Installation, words: Sequence[str]) -> tuple[float, float]:
    """Return the medians of seconds of the processor and by the clock."""
    runs = [measured.run(*words) for _ in range(REPEATS)]
    return median(run["processor"] for run in runs), median(run["clock"] for run in runs)


def report_lists(found: dict[str, tuple[float, float]]) -> None:
    """Print and save what the lists took."""
    rows = [(name, f"{processor:.2f}", f"{clock:.2f}") for name, (processor, clock) in found.items()]
    print_table(f"Lists, medians of {REPEATS}", ("command", "processor, s", "clock, s"), rows)
    print(f"\nload average {os.getloadavg()[0]:.1f}\n{save('start-lists', {'lists': found})}")


def measure(measured: Installation, name: str, demo: bool) -> dict[str, dict[str, float]]:
    """Take a tunnel of that name through the commands; what each of them took."""
    found = {}
    for verb, words in steps(measured.folder, name, demo):
        progress(f"{name}: {verb}")
        found[verb] = measured.run(*words)
    return found


def steps(folder: Path, name: str, demo: bool) -> Iterator[tuple[str, list[str]]]:
    """Verbs and their command lines, those of scripts/demo.sh; without ``demo``, of scripts/compile.sh."""
    scan, out, survey = folder / f"{name}-scan", folder / f"{name}-out", f"{name}-2024"
    out.mkdir()

    def file(suffix: str) -> str:
        return str(scan / f"{name}.{suffix}")

    yield "simulate", ["simulate", str(scan), "--preset", "demo", "--name", name, *(SCENERY if demo else SHORT)]
    yield "tunnel add", ["tunnel", "add", name, "--srid", "25830", "--axis", file("axis.csv"), "--start-chainage", "12300"]
    yield (
        "survey add",
        [
            *("survey", "add", survey, "--tunnel", name, "--date", "2024-05-04", "--trajectory", file("trajectory.csv")),
            *("--reference", file("reference.csv"), "--intensity", "Amplitude", "--intensity-kind", "amplitude"),
        ],
    )
    yield "load", ["load", survey, *map(str, sorted(scan.glob("*.laz")))]
    yield "run", ["run", survey]
    if demo:
        yield "status", ["status"]
        yield "leaks", ["leaks", survey]
        yield "leaks --by-km", ["leaks", survey, "--by-km"]
        yield "evaluate", ["evaluate", survey, file("truth.gpkg")]
        yield "intensity", ["intensity", survey, "-o", str(out / "intensity.png")]
        yield "leaks --geometry map", ["leaks", survey, "--geometry", "map", "--format", "gpkg", "-o", str(out / "leaks.gpkg")]
        yield "image", ["image", survey, "-o", str(out / "images")]
        yield "qgis", ["qgis", survey, "-o", str(out / "demo.qgz")]
        yield "report", ["report", survey, "-o", str(out / "report.html")]


def report(figures: dict[str, Any]) -> None:
    """Print the commands one below the other, and their sums."""
    cold, warm = figures["cold"], figures["warm"]
    units = {"processor": "Processor time, s"}
    if "instructions" in cold["run"]:
        units["instructions"] = "Instructions, 10⁹"
    sums = {"load + run": ["load", "run"], "all": list(cold)}
    for unit, title in units.items():
        rows = []
        for name, verbs in ({verb: [verb] for verb in cold} | sums).items():
            first, later = (sum(side[verb][unit] for verb in verbs) for side in (cold, warm))
            loops = [int(sum(side[verb]["compiled"] for verb in verbs)) for side in (cold, warm)]
            rows.append((name, f"{first:.1f}", f"{later:.1f}", f"{first - later:.1f}", *loops))
        print_table(f"{title}: a first and a second use", ("command", "cold", "warm", "difference", "loops", "again"), rows)
    by_clock = [sum(verb["clock"] for verb in side.values()) for side in (cold, warm)]
    print(f"by the clock: {by_clock[0]:.0f} and {by_clock[1]:.0f} s, load average {figures['load_average']:.1f} at the end")
    package = figures["loops"]
    print(f"compiled functions in the package: {package['functions']}, {package['parallel']} of them parallel")


def _processor_time() -> float:
    """Seconds of user and system of all processes that were waited for."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


if __name__ == "__main__":
    main()
