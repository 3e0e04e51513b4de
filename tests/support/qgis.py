"""Real QGIS, where it is installed: what it sees of a project, and does with it."""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, Protocol

from support.system import missing

SCRIPT = Path(__file__).parents[1] / "qgis" / "open_in_qgis.py"
PYTHON = "/usr/bin/python3"
ENVIRONMENT = {**os.environ, "QT_QPA_PLATFORM": "offscreen", "LC_ALL": "C.UTF-8", "PYTHONPATH": ""}


@cache
def has_qgis() -> bool:
    try:
        found = subprocess.run([PYTHON, "-c", "import qgis.core, qgis._3d"], env=ENVIRONMENT, capture_output=True, check=False)
    except FileNotFoundError:
        return False
    return found.returncode == 0


def act(project: Path | str, *arguments: str, before: tuple[str, ...] = (), **environment: str) -> dict[str, Any]:
    """Run an action on a project in QGIS, by a command if one is to stand before it."""
    if not has_qgis():
        missing("QGIS")
    done = subprocess.run(
        [*before, PYTHON, str(SCRIPT), str(project), *arguments],
        env=ENVIRONMENT | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout.splitlines()[-1])
    assert isinstance(result, dict)
    return result


class Look(Protocol):
    """An action on a project that is open, in words."""

    def __call__(self, *words: str) -> dict[str, Any]: ...


@contextmanager
def opened(project: Path) -> Iterator[Look]:
    """Open a project once; return a function that runs an action on it, as `act` does."""
    if not has_qgis():
        missing("QGIS")
    with tempfile.TemporaryFile("w+") as errors:
        process = subprocess.Popen(
            [PYTHON, str(SCRIPT), str(project), "serve"],
            env=ENVIRONMENT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors, text=True,
        )  # fmt: skip
        assert process.stdin is not None
        assert process.stdout is not None
        asked, answers = process.stdin, process.stdout

        def look(*words: str) -> dict[str, Any]:
            asked.write(json.dumps(words) + "\n")
            asked.flush()
            answer = answers.readline()
            if not answer:
                process.wait()
                errors.seek(0)
                raise AssertionError(errors.read())
            result = json.loads(answer)
            assert isinstance(result, dict)
            return result

        try:
            yield look
        finally:
            if process.poll() is None:
                asked.close()
            process.wait()
            answers.close()
