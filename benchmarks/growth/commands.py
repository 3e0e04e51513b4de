"""CPU time of commands that are asked of one survey, as their user waits for them: of the program, and of its backends."""

from __future__ import annotations

import os
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

import psycopg

from benchmarks.common import COMMAND

REPEATS = 2
TICK = os.sysconf("SC_CLK_TCK")

VERBS = {
    "status SURVEY": ("status", "{survey}"),
    "leaks SURVEY, 1 km": ("leaks", "{survey}", "--from", "5+000", "--to", "6+000", "-o", "{folder}/leaks.csv"),
    "findings SURVEY, 1 km": ("findings", "{survey}", "--from", "5+000", "--to", "6+000", "-o", "{folder}/findings.csv"),
    "axis SURVEY": ("axis", "{survey}"),
    "qgis SURVEY": ("qgis", "{survey}", "-o", "{folder}/survey.qgs"),
    "survey list": ("survey", "list"),
    "status": ("status",),
    "check": ("check",),
}
"""The last three are asked of the whole database, and grow with it."""


@dataclass(frozen=True)
class Run:
    """CPU time of a command: of the program and of its backends, s."""

    name: str
    program: float
    backends: float

    @property
    def total(self) -> float:
        """Total of both, s."""
        return self.program + self.backends


def ask_commands(dsn: str, survey: str, folder: Path, only: str = "") -> list[Run]:
    """Run each command some times, or those whose names hold one of some words, parted by commas; the least counts."""
    postmaster = postmaster_of(dsn)
    found = []
    for name, verb in VERBS.items():
        if not any(word in name for word in only.split(",")):
            continue
        arguments = [word.format(survey=survey, folder=folder) for word in verb]
        runs = [cpu_times(dsn, arguments, postmaster) for _ in range(REPEATS)]
        found.append(Run(name, min(run[0] for run in runs), min(run[1] for run in runs)))
    return found


def cpu_times(dsn: str, arguments: list[str], postmaster: int) -> tuple[float, float]:
    """CPU time of a command, of the program and of its backends, s."""
    before = _ended(postmaster)
    with subprocess.Popen(
        [*COMMAND, "--dsn", dsn, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stderr is not None
        said = process.stderr.read()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode not in (0, 1):  # 1: check has found something
        raise SystemExit(f"tunneldb {' '.join(arguments)}\n{said}")
    time.sleep(0.2)  # until its backends have ended
    return usage.ru_utime + usage.ru_stime, _ended(postmaster) - before


def postmaster_of(dsn: str) -> int:
    """Process of the server that a database is on, which runs on this machine."""
    with psycopg.connect(dsn) as connection:
        row = connection.execute("SELECT current_setting('data_directory')").fetchone()
    assert row is not None
    return int((Path(row[0]) / "postmaster.pid").read_text().split()[0])


def _ended(postmaster: int) -> float:
    """CPU time of those children of a server on this machine that have ended, s."""
    fields = Path(f"/proc/{postmaster}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[13]) + int(fields[14])) / TICK
