"""A page as PDF, by the Chromium or Chrome that is installed."""

from __future__ import annotations

import errno
import os
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from pathlib import Path

from tunneldb.errors import UserError

BROWSERS = (
    *("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "microsoft-edge"),
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
)
"""Names of browsers that can print."""

PRINT_TIMEOUT = 1800
"""Maximum time for printing, s."""

_TICK = 0.5  # seconds from one word on the wait to the next

MAX_SOCKET_FOLDER_BYTES = 60
"""Maximum bytes of a folder's path in which a browser can open its socket: with its name at most 107."""


def find_browser() -> str:
    """Return the path of the browser that prints: that of TUNNELDB_BROWSER, or the first of BROWSERS that is installed.

    Raises
    ------
    UserError
        If there is none, or only snaps.
    """
    stated = os.environ.get("TUNNELDB_BROWSER")
    found = [path for name in ((stated,) if stated else BROWSERS) if (path := shutil.which(name))]
    if not found:
        lacking = "a PDF needs Chromium or Chrome, but none is installed"
        said = f"TUNNELDB_BROWSER is {stated}, which is not a program" if stated else lacking
        raise UserError(f"{said}: install one, or write the report as .html and print it from a browser")
    chosen = next((path for path in found if not _is_snap(Path(path))), None)
    if chosen is None:
        raise UserError(
            f"{found[0]} is a snap, which cannot access /tmp or hidden folders, so cannot print the report: install Chrome,"
            " set TUNNELDB_BROWSER to another browser, or write the report as .html and print it from the browser"
        )
    return chosen


def _is_snap(program: Path) -> bool:
    """Return True if a program is a snap, a link to one, or a script that starts one, as on Ubuntu."""
    target = program.resolve()  # of a snap the program snap itself
    if target.name == "snap" or "/snap/" in f"{program} {target}":
        return True
    try:
        with target.open("rb") as file:
            head = file.read(8192)
    except OSError:  # one that may be run, but not read
        return False
    return head.startswith(b"#!") and b"/snap/" in head


def print_pdf(browser: str, page: Path, pdf: Path, waiting: Callable[[float], None] = lambda seconds: None) -> None:
    """Print a page, with all that belongs on paper, as PDF.

    Parameters
    ----------
    browser, page, pdf
        Browser, page, and target.
    waiting : callable
        Called now and then with the seconds of printing so far; the browser does not report its progress.

    Raises
    ------
    UserError
        If the browser makes no PDF.
    OSError
        If it makes one that is cut off, for lack of room.
    """
    with tempfile.TemporaryDirectory(prefix="tunneldb-browser-", ignore_cleanup_errors=True) as profile:
        command = [
            browser, "--headless", "--disable-gpu", "--disable-extensions", "--disable-dev-shm-usage", "--no-first-run",
            "--hide-scrollbars", "--no-pdf-header-footer", "--generate-pdf-document-outline",
            f"--user-data-dir={profile}", f"--print-to-pdf={pdf.absolute()}",
            *(["--no-sandbox"] if hasattr(os, "geteuid") and os.geteuid() == 0 else []),  # as root there is no sandbox
            f"{page.absolute().as_uri()}#print",
        ]  # fmt: skip
        try:
            code, output = _run(command, profile, waiting)
        except subprocess.TimeoutExpired:
            raise UserError(
                f"{browser} did not print the report within {PRINT_TIMEOUT // 60} minutes: report a shorter stretch"
                " (--from, --to), or write it as .html"
            ) from None
    if code != 0 or not pdf.exists():
        said = output.strip().splitlines()
        raise UserError(f"{browser} did not print the report: {said[-1] if said else f'exit code {code}'}")
    if not _is_whole(pdf):  # of a disk that is full a browser says nothing
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(pdf))


def _is_whole(pdf: Path) -> bool:
    """Return True if a PDF has its end, by ISO 32000-1, 7.5.5."""
    with pdf.open("rb") as file:
        file.seek(max(0, pdf.stat().st_size - 1024))
        return b"%%EOF" in file.read()


def _run(command: Sequence[str], folder: str, waiting: Callable[[float], None]) -> tuple[int, str]:
    """Run a browser, its temporary files in a folder; returns exit code and standard error.

    Any interruption of the wait ends the browser and all processes that it started.
    """
    temporary = {"TMPDIR": folder} if len(os.fsencode(folder)) <= MAX_SOCKET_FOLDER_BYTES else {}
    start = partial(
        subprocess.Popen, command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, errors="replace",
        env=os.environ | temporary, start_new_session=True,
    )  # fmt: skip
    # Started by a thread, which no signal interrupts: else Ctrl-C just then would leave a browser that nobody knows of.
    with ThreadPoolExecutor(1, "browser") as pool:
        started = pool.submit(start)
        try:
            process = started.result()
            output = _wait(process, waiting)
        except BaseException:
            with started.result() as lost, suppress(ProcessLookupError):
                os.killpg(lost.pid, signal.SIGKILL)
            raise
    return process.returncode, output


def _wait(process: subprocess.Popen[str], waiting: Callable[[float], None]) -> str:
    """Wait for a browser's end; returns its standard error."""
    began = time.monotonic()
    while True:
        try:
            return process.communicate(timeout=min(_TICK, PRINT_TIMEOUT))[1]
        except subprocess.TimeoutExpired:
            seconds = time.monotonic() - began
            if seconds >= PRINT_TIMEOUT:
                raise
            waiting(seconds)
