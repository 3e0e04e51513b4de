"""QGIS Desktop on a screen of its own, used by mouse and keys (xdotool), with eyes in it (``review_dock_in_qgis.py``).

Needs QGIS Desktop, Xvfb, a window manager and xdotool (packages ``qgis``, ``xvfb``, ``openbox``, ``xdotool``).
"""

from __future__ import annotations

import json
import os
import shutil
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

SCREEN = "1600x1000x24"
EYES = Path(__file__).with_name("review_dock_in_qgis.py")
PATIENCE = 60.0
"""Seconds after which something that was to happen has not happened."""

_POLL = 0.02


@contextmanager
def screen() -> Iterator[str]:
    """Start an X server without a screen, with a window manager; yield its display."""
    missing = [program for program in ("qgis", "Xvfb", "openbox", "xdotool") if shutil.which(program) is None]
    if missing:
        raise SystemExit(f"not found: {', '.join(missing)}; install the packages qgis, xvfb, openbox, xdotool")
    read, write = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write), "-screen", "0", SCREEN, "-nolisten", "tcp"],
        pass_fds=[write], stderr=subprocess.DEVNULL,
    )  # fmt: skip
    os.close(write)
    with os.fdopen(read) as told:
        display = f":{told.readline().strip()}"
    manager = subprocess.Popen(["openbox"], env=os.environ | {"DISPLAY": display}, stderr=subprocess.DEVNULL)
    try:
        yield display
    finally:
        for process in (manager, server):
            process.terminate()
            process.wait()


class Hands:
    """Mouse and keyboard of a display; counts what a person would have done.

    Attributes
    ----------
    keys, clicks : int
        Keys pressed and buttons clicked; a letter of a text is a key.
    """

    def __init__(self, display: str) -> None:
        self.environment = os.environ | {"DISPLAY": display}
        self.keys = self.clicks = 0

    def press(self, *keys: str) -> None:
        """Press keys, or chords of them (``ctrl+s``), by their X names."""
        self._do("key", "--delay", "0", *keys)
        self.keys += len(keys)

    def type(self, text: str) -> None:
        """Type a text."""
        self._do("type", "--delay", "4", text)
        self.keys += len(text)

    def click(self, place: tuple[int, int] | list[int], times: int = 1) -> None:
        """Click at a place."""
        x, y = place
        self._do("mousemove", str(x), str(y), "click", "--repeat", str(times), "--delay", "60", "1")
        self.clicks += times

    def move(self, place: tuple[int, int] | list[int]) -> None:
        """Move the mouse to a place."""
        self._do("mousemove", *map(str, place))

    @property
    def events(self) -> tuple[int, int]:
        """Keys and clicks until now."""
        return self.keys, self.clicks

    def _do(self, *words: str) -> None:
        subprocess.run(["xdotool", *words], env=self.environment, check=True, stdout=subprocess.DEVNULL)


class Eyes:
    """Asks QGIS what is on its screen."""

    def __init__(self, path: Path) -> None:
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.connect(str(path))
        self.lines = self.socket.makefile()

    def ask(self, name: str, *arguments: Any) -> Any:
        """Ask a function of ``review_dock_in_qgis.py``."""
        self.socket.sendall(json.dumps([name, *arguments]).encode() + b"\n")
        told = json.loads(self.lines.readline())
        if "wrong" in told:
            raise RuntimeError(told["wrong"])
        return told["is"]

    def place(self, kind: str, *name: Any) -> list[int]:
        """Wait until something is to be seen, and return where: a widget, an entry of a menu, an action's button, a layer."""
        found: list[int] = until(f"{kind} {name}", lambda: self.ask(kind, *name))
        return found

    def until(self, what: str, seen: Callable[[dict[str, Any]], Any]) -> dict[str, Any]:
        """Wait until the state is as it should be, and return it."""
        last: dict[str, Any] = {}

        def look() -> bool:
            last.clear()
            last.update(self.ask("state"))
            return bool(seen(last))

        try:
            until(what, look)
        except TimeoutError as error:
            raise TimeoutError(f"{error}: {last}") from None
        return dict(last)


def until(what: str, seen: Callable[[], Any], patience: float = PATIENCE) -> Any:
    """Wait until something is true, and return it.

    Raises
    ------
    TimeoutError
        It did not become true.
    """
    end = time.monotonic() + patience
    while time.monotonic() < end:
        found = seen()
        if found:
            return found
        time.sleep(_POLL)
    raise TimeoutError(f"waited in vain for: {what}")


@contextmanager
def desktop(folder: Path, display: str, environment: dict[str, str]) -> Iterator[tuple[Hands, Eyes]]:
    """Start QGIS with a fresh profile; yield hands and eyes.

    Parameters
    ----------
    folder : Path
        Where profile, socket and QGIS's own lines are kept.
    display : str
    environment : dict
        Variables of QGIS.
    """
    path, profile = folder / "eyes", folder / "profile"
    path.unlink(missing_ok=True)
    profile.mkdir(exist_ok=True)
    variables = {
        "PATH": "/usr/bin:/bin", "HOME": str(profile), "LC_ALL": "C.UTF-8", "DISPLAY": display, "REVIEW_SOCKET": str(path),
        **environment,
    }  # fmt: skip
    command = ["qgis", "--nologo", "--noversioncheck", "--profiles-path", str(profile), "--code", str(EYES)]
    with (folder / "qgis.log").open("w") as log:
        process = subprocess.Popen(command, env=variables, stdout=log, stderr=log)
    try:
        until("QGIS", lambda: path.exists() or process.poll() is not None)
        if process.poll() is not None:
            raise SystemExit(f"QGIS ended with {process.returncode}, see {folder / 'qgis.log'}")
        eyes = Eyes(path)
        yield Hands(display), eyes
        eyes.ask("leave")
        process.wait(20)
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()
