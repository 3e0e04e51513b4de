"""The program as its user runs it: commands on the command line, one server for all scenes.

Each verb is the program's own ``main`` in a process of its own, forked from one that has the libraries loaded already: with a
hundred scenes of seven verbs loading them would take longer than all else.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Call:
    """One command: what was typed and what came of it."""

    words: tuple[str, ...]
    code: int
    out: str
    err: str
    seconds: float

    @property
    def text(self) -> str:
        return f"{self.out}\n{self.err}"

    @property
    def line(self) -> str:
        return "tunneldb " + " ".join(self.words)

    @property
    def json(self) -> dict[str, Any]:
        return json.loads(self.out)


class Program:
    """Run commands on the server of `home`."""

    def __init__(self, home: Path) -> None:
        environment = dict(os.environ) | {"TUNNELDB_HOME": str(home), "COLUMNS": "200"}
        environment.pop("TUNNELDB_DSN", None)
        command = [sys.executable, "-m", "benchmarks.any_scan.forks"]
        self._forks = subprocess.Popen(command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def __call__(self, folder: Path, *words: object) -> Call:
        typed = [str(word) for word in words]
        start = time.perf_counter()
        assert self._forks.stdin is not None
        assert self._forks.stdout is not None
        self._forks.stdin.write(json.dumps({"folder": str(folder.resolve()), "words": typed}) + "\n")
        self._forks.stdin.flush()
        answer = json.loads(self._forks.stdout.readline())
        return Call(tuple(typed), answer["code"], answer["out"], answer["err"], time.perf_counter() - start)

    def close(self) -> None:
        """End the process; the server is stopped by ``server stop``."""
        self._forks.communicate()
