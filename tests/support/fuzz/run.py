"""Run cases, each in a process of its own, and judge what came of them.

    python -m support.fuzz.run --cases 10000 --seed 1 --seeds FOLDER     # as tests/cli/test_fuzz.py does

Right is: exit code 0; or 2 with one line on standard error that is no traceback, all rows as they were and no file left behind.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import pkgutil
import resource
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path

import psycopg
from click.testing import CliRunner
from psycopg import sql

import tunneldb
from support.fuzz.cases import Case, make_case, right_cases
from tunneldb.cli.main import main

BEFORE = (
    "unroll demo-2024 {seeds}/points.csv -o {folder}/unrolled.csv",
    "rings --points {seeds}/rings-points.csv --axis {seeds}/rings-axis.csv --diameter 5.8 -o {folder}/rings.csv",
    "inspect {seeds}/points.csv",
    "load scan-2024 {seeds}/cloud.las",
    "survey remove-file scan-2024 cloud.las --yes",
)
"""Commands that are run before all cases, in this process: each case begins with the compiled loops that they load, and need
not load them itself. None reads LAZ, whose decoder keeps threads that a child would wait for in vain."""

PATIENCE = 30
"""Seconds that a case may take: small files are read in one or two."""

MEMORY = 4 * 1024**3
"""Bytes that a case may take beyond what the process has."""

USAGE = 3
"""Lines of click's own complaint: usage, where help is, what is wrong."""


@dataclass(frozen=True)
class Outcome:
    """What came of a case."""

    number: int
    command: str
    wrong: str
    kind: str
    code: int | None
    said: str
    fault: str
    seconds: float


def run_cases(seed: int, count: int, seconds: float, seeds: Path, dsn: str) -> list[Outcome]:
    """Run cases until so many, or so many seconds, are over."""
    done: list[Outcome] = []
    began = time.monotonic()
    with psycopg.connect(dsn, autocommit=True) as conn:
        before = _rows(conn)
        for number in range(count):
            if time.monotonic() - began > seconds:
                break
            with tempfile.TemporaryDirectory(prefix="fuzz-") as name:
                folder = Path(name)
                case = make_case(seed, number, seeds, folder)
                given = set(folder.rglob("*"))
                start = time.monotonic()
                code, said, fault = _run(case, folder)
                after = _rows(conn)
                fault = fault or _fault(code, said)
                if not fault and code == 2 and after != before:
                    fault = "rows changed: " + ", ".join(sorted(name for name in after if after[name] != before.get(name)))
                left = [path.name for path in folder.rglob("*") if path not in given]
                if not fault and code == 2 and left:
                    fault = f"left {', '.join(left)}"
                before = after
                done.append(
                    Outcome(number, " ".join(case.words), case.wrong, case.kind, code, said, fault, time.monotonic() - start)
                )
    return done


def run_right(seeds: Path) -> list[Outcome]:
    """Run each command with the right file: it is to be done."""
    with tempfile.TemporaryDirectory(prefix="fuzz-") as name:
        cases = right_cases(seeds, Path(name))
        return [Outcome(-1, " ".join(case.words), "", case.kind, *_run(case, Path(name)), 0.0) for case in cases]


def _run_before(seeds: Path) -> None:
    """Run the commands of BEFORE, which leave the database as it was."""
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        for command in BEFORE:
            result = CliRunner().invoke(main, command.format(seeds=seeds, folder=folder).split())
            assert result.exit_code == 0, f"{command}: {result.output}"


def _run(case: Case, folder: Path) -> tuple[int | None, str, str]:
    """Exit code, standard error and fault of a case that is run in a child."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reader)
        os.chdir(folder)
        with os.fdopen(writer, "w") as pipe:
            json.dump(_invoke(case), pipe)
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader) as pipe:
        text = pipe.read()
    _, status = os.waitpid(child, 0)
    if not text:
        how = "too long" if os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGALRM else "died"
        return None, "", f"{how}: status {status}"
    code, said, fault = json.loads(text)
    return code, said, fault


def _invoke(case: Case) -> tuple[int, str, str]:
    signal.alarm(PATIENCE)
    held = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (held + MEMORY, held + MEMORY))
    result = CliRunner().invoke(main, case.words)
    fault = ""
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        lines = traceback.format_exception(result.exception)
        fault = "traceback: " + "".join(lines[-3:]).strip()
    return result.exit_code, result.stderr.encode("utf-8", "replace").decode(), fault


def _fault(code: int | None, said: str) -> str:
    if code not in (0, 1, 2):
        return f"exit code {code}"
    if code != 2:
        return ""
    lines = [line for line in said.splitlines() if line.strip()]
    if lines and lines[0].startswith("Usage:") and len(lines) <= USAGE + 6:
        return ""
    errors = [line for line in lines if line.startswith("tunneldb: ")]
    if not errors:
        return "nothing said"
    return "more than one line" if len(errors) > 1 or lines[-1] != errors[0] else ""


def _rows(conn: psycopg.Connection) -> dict[str, tuple[object, ...]]:
    """What any change of a table's rows changes: their number, and the transactions that made them."""
    tables = "SELECT tablename FROM pg_tables WHERE schemaname = 'tunnel' AND tablename <> 'run'"  # which notes what failed
    names = [name for (name,) in conn.execute(tables)]
    one = sql.SQL("SELECT {}, count(*), sum(xmin::text::bigint), max(ctid::text) FROM tunnel.{}")
    query = sql.SQL(" UNION ALL ").join(one.format(sql.Literal(name), sql.Identifier(name)) for name in names)
    return {name: tuple(rest) for name, *rest in conn.execute(query).fetchall()}


def table(outcomes: list[Outcome]) -> str:
    """Outcomes by kind of file, as Markdown."""
    lines = ["| file | cases | done | refused in one line | faults |", "|---|---|---|---|---|"]
    kinds = Counter(one.kind for one in outcomes)
    for kind, count in sorted(kinds.items()):
        of = [one for one in outcomes if one.kind == kind]
        done = sum(one.code in (0, 1) and not one.fault for one in of)
        refused = sum(one.code == 2 and not one.fault for one in of)
        lines.append(f"| {kind} | {count} | {done} | {refused} | {sum(bool(one.fault) for one in of)} |")
    return "\n".join(lines)


def _main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=float("inf"))
    parser.add_argument("--seeds", type=Path, required=True)
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    for module in pkgutil.walk_packages(tunneldb.__path__, "tunneldb."):  # else each child would import what it needs
        importlib.import_module(module.name)
    _run_before(given.seeds)
    outcomes = run_cases(given.seed, given.cases, given.seconds, given.seeds, os.environ["TUNNELDB_DSN"])
    outcomes += run_right(given.seeds)
    if given.json:
        json.dump([asdict(one) for one in outcomes], sys.stdout)
        return
    print(table(outcomes))
    for one in outcomes:
        if one.fault:
            print(f"{one.number}: {one.command} ({one.wrong}): {one.fault}")


if __name__ == "__main__":
    _main()
