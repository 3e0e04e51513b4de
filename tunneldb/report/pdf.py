"""A page as PDF, by the Chromium or Chrome that is installed."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from tunneldb.errors import UserError

BROWSERS = (
    *("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "microsoft-edge"),
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
)
"""Names under which a browser that prints may be installed."""

PATIENCE = 1800
"""Seconds that a browser may print at most."""


def find_browser() -> str:
    """Return the path of the browser that prints: that of TUNNELDB_BROWSER, or the first of BROWSERS that is installed.

    Raises
    ------
    UserError
        If there is none.
    """
    stated = os.environ.get("TUNNELDB_BROWSER")
    found = shutil.which(stated) if stated else next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if found is None:
        lacking = "a PDF needs Chromium or Chrome, and none is installed"
        said = f"TUNNELDB_BROWSER is {stated}, which is no program" if stated else lacking
        raise UserError(f"{said}: install one, or write the report as .html and print it from a browser")
    return found


def print_pdf(browser: str, page: Path, pdf: Path) -> None:
    """Print a page, with all that belongs on paper, as PDF.

    Raises
    ------
    UserError
        If the browser makes no PDF.
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
            done = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=PATIENCE, check=False)
        except subprocess.TimeoutExpired:
            raise UserError(
                f"{browser} did not print the report within {PATIENCE // 60} minutes: report a shorter stretch (--from, --to),"
                " or write it as .html"
            ) from None
    if done.returncode != 0 or not pdf.exists():
        said = done.stderr.strip().splitlines()
        raise UserError(f"{browser} did not print the report: {said[-1] if said else f'exit code {done.returncode}'}")
