"""The command ``tunneldb``, called as a program of its own: it may run under another Python than QGIS."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Callable, Dict, List, Optional, Sequence

from qgis.PyQt.QtCore import QProcess, QProcessEnvironment

from .commands import error_of

POLL = 200  # ms
PATIENCE = (30.0, 10.0)
"""Time for a command to end its current step, and after a second request, before it is killed, s."""

_START, _ANSWER = 15_000, 120_000  # ms
# of QGIS's own Python, which would mislead another; the DSN, which the plugin names itself
_NOT_PASSED = ("PYTHONHOME", "PYTHONPATH", "TUNNELDB_DSN")


class CommandError(Exception):
    """Reason why a command cannot run, or its error, in one line."""


@dataclass(frozen=True)
class Ended:
    """Result of a command."""

    code: int
    output: str
    error: str
    cancelled: bool


def run(
    program: str,
    arguments: Sequence[str],
    environment: Dict[str, str],
    told: Callable[[str, bool], None],
    cancelled: Optional[Callable[[], bool]] = None,
) -> Ended:
    """Run a command to its end.

    Parameters
    ----------
    program : str
    arguments : sequence of str
    environment : dict
        Variables beside those of QGIS.
    told : callable
        Is given each line, and whether it came by standard error.
    cancelled : callable, optional
        Whether the user has cancelled: the command is asked to end, as by Ctrl-C, and killed if it does not.

    Raises
    ------
    CommandError
        It can't be started.
    """
    process = QProcess()
    process.setProcessEnvironment(_environment(environment))
    process.start(program, list(arguments))
    if not process.waitForStarted(_START):
        raise CommandError(f"{program} cannot be started ({process.errorString()}): set the command in Connect")
    process.closeWriteChannel()
    output, error = _Lines(lambda line: told(line, False)), _Lines(lambda line: told(line, True))
    asked: List[float] = []
    while process.state() != QProcess.ProcessState.NotRunning:
        process.waitForFinished(POLL)
        output.add(bytes(process.readAllStandardOutput()))
        error.add(bytes(process.readAllStandardError()))
        if cancelled is not None and cancelled():
            _ask_to_end(process, asked)
    output.end()
    error.end()
    crashed = process.exitStatus() != QProcess.ExitStatus.NormalExit
    return Ended(-1 if crashed else process.exitCode(), output.text, error.text, bool(asked))


def answer(program: str, arguments: Sequence[str], environment: Dict[str, str]) -> str:
    """Return the output of a short command.

    Raises
    ------
    CommandError
        It can't be started, or fails; in the command's own line.
    """
    until = time.monotonic() + _ANSWER / 1000
    ended = run(program, arguments, environment, lambda line, wrong: None, lambda: time.monotonic() > until)
    if ended.code:
        raise CommandError(error_of(ended.error) or f"{program} ended with exit code {ended.code}")
    return ended.output.strip()


def _ask_to_end(process: QProcess, asked: List[float]) -> None:
    """Ask it, a second time after a while, and kill it at last."""
    now = time.monotonic()
    if not asked or (len(asked) == 1 and now - asked[0] > PATIENCE[0]):
        asked.append(now)
        process.terminate()
    elif len(asked) == 2 and now - asked[1] > PATIENCE[1]:
        process.kill()


def _environment(more: Dict[str, str]) -> QProcessEnvironment:
    environment = QProcessEnvironment.systemEnvironment()
    for name in _NOT_PASSED:
        environment.remove(name)
    environment.insert("PYTHONUNBUFFERED", "1")
    environment.insert("PYTHONIOENCODING", "utf-8")
    for name, value in more.items():
        environment.insert(name, value)
    return environment


class _Lines:
    """Assembles bytes to lines, and reports each complete line."""

    def __init__(self, told: Callable[[str], None]) -> None:
        self.told = told
        self.text = ""
        self._rest = b""

    def add(self, more: bytes) -> None:
        *lines, self._rest = (self._rest + more).split(b"\n")
        for line in lines:
            text = line.decode("utf-8", "replace").rstrip("\r")
            self.text += text + "\n"
            self.told(text)

    def end(self) -> None:
        if self._rest:
            self.add(b"\n")
