"""Run cases, each in a process of its own, and judge what came of them.

    python -m support.fuzz.run --cases 10000 --seed 1 --seeds FOLDER     # as tests/cli/test_fuzz.py does

Right is: exit code 0; or 2 with one line on standard error that is no traceback, all rows as they were and no file left behind.
A statement is done or refused in one line, and the command after it like any other.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import pkgutil
import random
import resource
import signal
import socket
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path

import psycopg
from click.testing import CliRunner
from psycopg import sql
from psycopg.conninfo import conninfo_to_dict, make_conninfo

import tunneldb
from support.databases import create_database
from support.fuzz.cases import Case, Ground, make_case, right_cases, verb_of
from support.fuzz.sources import serve_drips
from support.fuzz.writes import read_rights
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

PATIENCE = 20
"""Seconds of computing that a case may take: small files are read in one or two."""

WAITING = 120
"""Seconds that it may take on a machine that others are busy on, or waiting for what never comes."""

MEMORY = 2 * 1024**3
"""Bytes that a case, or the server's session of a statement, may take beyond what the process has."""

USAGE = 3
"""Lines of click's own complaint: usage, where help is, what is wrong."""

PEOPLE = {"vera": "tunnel_viewer", "ines": "tunnel_inspector", "otto": "tunnel_operator"}
"""Who runs statements, with the role."""

NOTED = {"tunnel.run"}
"""Tables that may change although a command is refused: the ledger notes what failed."""

Rows = dict[str, tuple[object, ...]]


@dataclass(frozen=True)
class Outcome:
    """What came of a case."""

    number: int
    command: str
    verb: str
    wrong: str
    kind: str
    code: int | None
    said: str
    fault: str
    seconds: float


class Fresh:
    """A copy of a database, made anew when asked, so that no case meets what one before it did."""

    def __init__(self, dsn: str) -> None:
        self._template = str(conninfo_to_dict(dsn)["dbname"])
        self._server = make_conninfo(dsn, dbname="postgres")
        self._name = f"{self._template}_case"
        self.dsn = make_conninfo(dsn, dbname=self._name)

    def __enter__(self) -> Fresh:
        """Return the copy."""
        self.renew()
        return self

    def __exit__(self, *error: object) -> None:
        """Drop it."""
        self._drop()

    def renew(self) -> None:
        """Drop the copy and make another."""
        self._drop()
        create_database(self._server, self._name, self._template)

    def _drop(self) -> None:
        with psycopg.connect(self._server, autocommit=True) as conn:
            conn.execute(sql.SQL("DROP DATABASE IF EXISTS {} WITH (FORCE)").format(sql.Identifier(self._name)))


def run_cases(seed: int, numbers: Iterable[int], seconds: float, ground: Ground, fresh: Fresh) -> list[Outcome]:
    """Run cases until they, or so many seconds, are over; each begins with the database as it was given."""
    began = time.monotonic()
    before = _rows(fresh.dsn)
    done: list[Outcome] = []
    for number in numbers:
        if time.monotonic() - began > seconds:
            break
        with tempfile.TemporaryDirectory(prefix="fuzz-") as name:
            done.append(_judged(number, make_case(seed, number, ground, Path(name)), Path(name), fresh, before))
        if done[-1].fault:  # a long run shows at once what it finds
            print(f"{number}: {done[-1].command} ({done[-1].wrong[:200]}): {done[-1].fault}", file=sys.stderr, flush=True)
        elif number % 500 == 499:
            print(f"{number + 1} cases, {time.monotonic() - began:.0f} s", file=sys.stderr, flush=True)
    return done


def run_right(seed: int, most: int, seeds: Path, fresh: Fresh) -> list[Outcome]:
    """Run each command, or the most of them, with the right file: it is to be done, or refused as it ought to be."""
    before = _rows(fresh.dsn)
    with tempfile.TemporaryDirectory(prefix="fuzz-") as name:
        folder = Path(name)
        cases = right_cases(seeds, folder)
        chosen = random.Random(seed).sample(cases, min(most, len(cases)))
        return [_judged(-1, case, folder, fresh, before) for case in chosen]


def _run_before(seeds: Path) -> None:
    """Run the commands of BEFORE, which leave the database as it was."""
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        for command in BEFORE:
            result = CliRunner().invoke(main, command.format(seeds=seeds, folder=folder).split())
            assert result.exit_code == 0, f"{command}: {result.output}"


def _judged(number: int, case: Case, folder: Path, fresh: Fresh, before: Rows) -> Outcome:
    """Run a case, judge it, and put the database back if it changed."""
    given = set(folder.rglob("*"))
    start = time.monotonic()
    written = False
    code, said, fault = None, "", ""
    if case.statement:
        said, fault, written = execute(fresh.dsn, case.login, case.statement)
        code = 2 if said else 0
        if written:
            before = _rows(fresh.dsn)
    if case.words and not said and not fault:
        code, said, fault = _run(case, folder, fresh.dsn)
        fault = fault or _fault(case.words, code, said)
    took = time.monotonic() - start
    after = _rows(fresh.dsn)
    changed = sorted(name for name in {*before, *after} if after.get(name) != before.get(name))
    if not fault and code == 2 and set(changed) - NOTED:
        fault = "rows changed: " + ", ".join(changed)
    left = [path.name for path in folder.rglob("*") if path not in given]
    if not fault and code == 2 and left:
        fault = f"left {', '.join(left)}"
    if changed or fault or written:
        fresh.renew()
    verb = verb_of(case.words) if case.words else "SELECT"
    return Outcome(number, f"{case.login} {' '.join(case.words)}".strip(), verb, case.wrong, case.kind, code, said, fault, took)


def execute(dsn: str, login: str, statement: str) -> tuple[str, str, bool]:
    """Run somebody's statement; return the refusal, the fault, and whether it changed a row."""
    with psycopg.connect(make_conninfo(dsn, user=login), autocommit=True) as person:
        person.execute("SELECT set_config('statement_timeout', %s, false)", [f"{PATIENCE}s"])
        held = peak_memory(person)
        refusal, changed = "", False
        try:
            changed = person.execute(statement.encode("utf-8", "surrogatepass")).rowcount > 0 and not statement.startswith(
                "SELECT"
            )
        except psycopg.Error as error:
            if person.closed:
                wait_for_server(dsn)
                return "", f"the server's session ended: {str(error).splitlines()[0]}", True
            refusal = error.diag.message_primary or "?"
            of_postgis = error.sqlstate == "XX000" and statement.startswith("SELECT")  # the only state that PostGIS has
            if (error.sqlstate or "")[:2] not in REFUSALS and error.sqlstate != DENIED and not of_postgis:
                return refusal, f"{error.sqlstate} {refusal}", False
            if ("\n" in refusal and not statement.startswith("SELECT")) or len(refusal) > LINE:
                return refusal, "more than one line", False
        if (took := peak_memory(person) - held) > MEMORY:
            return refusal, f"the server's session took {took >> 20} MB", changed
        return refusal, "", changed


def wait_for_server(dsn: str) -> None:
    """Wait until the server has recovered from the end of a process."""
    for _ in range(WAITING):
        with suppress(psycopg.OperationalError), psycopg.connect(dsn):
            return
        time.sleep(1)


def peak_memory(session: psycopg.Connection) -> int:
    """Return the most memory that the server's process of a session has had, bytes."""
    status = Path(f"/proc/{session.info.backend_pid}/status").read_text()
    return int(status.split("VmHWM:")[1].split()[0]) << 10


REFUSALS = ("22", "23", "0A", "P0")
"""Classes of the refusals of a value: wrong data, a constraint, unsupported, a message of a function."""

DENIED = "42501"

LINE = 300
"""Most letters of a refusal."""


def _run(case: Case, folder: Path, dsn: str) -> tuple[int | None, str, str]:
    """Exit code, standard error and fault of a case that is run in a child."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reader)
        os.chdir(folder)
        os.environ["TUNNELDB_DSN"] = dsn
        with os.fdopen(writer, "w") as pipe:
            json.dump(_invoke(case), pipe)
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader) as pipe:
        text = pipe.read()
    _, status = os.waitpid(child, 0)
    if not text:
        late = {signal.SIGPROF: f"computed for {PATIENCE} s", signal.SIGALRM: f"not done in {WAITING} s"}
        how = late.get(signal.Signals(os.WTERMSIG(status)), "died") if os.WIFSIGNALED(status) else "died"
        return None, "", f"{how}: status {status}"
    code, said, fault = json.loads(text)
    return code, said, fault


def _invoke(case: Case) -> tuple[int, str, str]:
    signal.setitimer(signal.ITIMER_PROF, PATIENCE)
    signal.alarm(WAITING)
    held = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (held + MEMORY, held + MEMORY))
    result = CliRunner().invoke(main, case.words)
    fault = ""
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        lines = traceback.format_exception(result.exception)
        fault = "traceback: " + "".join(lines[-3:]).strip()
    return result.exit_code, result.stderr.encode("utf-8", "replace").decode(), fault


def _fault(words: list[str], code: int | None, said: str) -> str:
    further = (3, 4, 5) if words[:2] in (["alarms", "check"], ["report", "--verify"]) else ()
    if code not in (0, 1, 2, *further):
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


def _rows(dsn: str) -> Rows:
    """Return values that any change of a table's rows changes: their number, and the transactions that made them."""
    tables = "SELECT schemaname, tablename FROM pg_tables WHERE schemaname IN ('tunnel', 'tunnel_audit', 'tunnel_queue')"
    one = sql.SQL("SELECT {}, count(*), sum(xmin::text::bigint), max(ctid::text) FROM {}")
    with psycopg.connect(dsn, autocommit=True) as conn:
        names = conn.execute(tables).fetchall()
        query = sql.SQL(" UNION ALL ").join(one.format(sql.Literal(".".join(name)), sql.Identifier(*name)) for name in names)
        return {name: tuple(rest) for name, *rest in conn.execute(query).fetchall()}


def table(outcomes: list[Outcome], by: str) -> str:
    """Outcomes by an attribute of them, as Markdown."""
    lines = [f"| {by} | cases | done | refused in one line | faults |", "|---|---|---|---|---|"]
    for value, count in sorted(Counter(getattr(one, by) for one in outcomes).items()):
        of = [one for one in outcomes if getattr(one, by) == value]
        done = sum(one.code in (0, 1) and not one.fault for one in of)
        refused = sum(one.code == 2 and not one.fault for one in of)
        lines.append(f"| {value} | {count} | {done} | {refused} | {sum(bool(one.fault) for one in of)} |")
    return "\n".join(lines)


@contextmanager
def dripping() -> Iterator[str]:
    """Host and port of a server that drips."""
    with socket.create_server(("127.0.0.1", 0)) as listening:
        child = os.fork()
        if child == 0:
            serve_drips(listening)
        try:
            yield "{}:{}".format(*listening.getsockname())
        finally:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)


def _main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--right", type=int, default=1000, help="how many of the right commands are run, too")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=float("inf"))
    parser.add_argument("--seeds", type=Path, required=True)
    given = parser.parse_args()
    for module in pkgutil.walk_packages(tunneldb.__path__, "tunneldb."):  # else each child would import what it needs
        importlib.import_module(module.name)
    _run_before(given.seeds)
    with Fresh(os.environ["TUNNELDB_DSN"]) as fresh, dripping() as server:
        ground = Ground(given.seeds, read_rights(fresh.dsn, PEOPLE), server)
        numbers = range(given.first, given.first + given.cases)
        outcomes = run_right(given.seed, given.right, given.seeds, fresh)
        outcomes += run_cases(given.seed, numbers, given.seconds, ground, fresh)
    json.dump([asdict(one) for one in outcomes], sys.stdout)


if __name__ == "__main__":
    _main()
