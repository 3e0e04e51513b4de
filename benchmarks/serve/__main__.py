"""Measure the desk: first picture, tiles, 20 reviewers at once, memory, weight of the page.

    python -m benchmarks.serve                       # 25 km, 100,000 findings; makes them first: 15 minutes
    python -m benchmarks.serve --km 2 --findings 5000

Needs Chromium. The server is one of its own, in a temporary folder, with passwords.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import psutil
import psycopg
from playwright.sync_api import sync_playwright

from benchmarks.common import COMMAND, print_table, progress, save
from benchmarks.serve.clients import Person, review_all, sign_in, tile_seconds
from benchmarks.serve.survey import PASSWORD, SURVEY, add_people, make
from tunneldb.database import connect, install, open_connection
from tunneldb.database.server import Server
from tunneldb.stages.registry import REGISTRY

BYTES = (
    "performance.getEntriesByType('resource').filter(r => !r.name.includes('/tiles/'))"
    ".reduce((sum, r) => sum + r.encodedBodySize, 0)"
)
"""Script that returns the compressed size of what the page loaded, without tiles."""

REVIEWERS, VERDICTS, TILES = 20, 40, 240

PATIENCE = 60.0
"""Time after which no picture is waited for, s."""


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.serve", description=__doc__.splitlines()[0])
    parser.add_argument("--km", type=int, default=25)
    parser.add_argument("--findings", type=int, default=100_000)
    parser.add_argument("--points", type=int, default=0, help="points in the database")
    arguments = parser.parse_args()
    with database() as dsn:
        with open_connection(dsn) as conn:
            install(conn, REGISTRY)
        with connect(dsn) as conn:
            make(conn, arguments.km, arguments.findings, arguments.points)
            names = add_people(conn, REVIEWERS)
        with served(dsn) as (address, process):
            figures = measure(dsn, address, process, names, arguments.km * 1000.0)
    save("serve", figures)
    print_table(
        f"{arguments.km} km, {arguments.findings:,} findings",
        ("figure", "value"),
        [(k, f"{v:.3g}") for k, v in figures.items()],
    )


@contextmanager
def database() -> Iterator[str]:
    """Start a server that asks reviewers for their passwords."""
    with tempfile.TemporaryDirectory(prefix="tunneldb-serve-") as folder:
        server = Server(Path(folder))
        dsn = server.start()
        with psycopg.connect(dsn, autocommit=True) as conn:
            (path,) = conn.execute("SHOW hba_file").fetchone()  # type: ignore[misc]
            rules = Path(path)
            names = ",".join(f"reviewer_{n:02}" for n in range(REVIEWERS))
            rules.write_text(f"local all {names} scram-sha-256\n" + rules.read_text())
            conn.execute("SELECT pg_reload_conf()")
        try:
            yield dsn
        finally:
            server.stop()


@contextmanager
def served(dsn: str) -> Iterator[tuple[str, psutil.Process]]:
    """Start the desk."""
    command = [*COMMAND, "serve", "--no-open", "--port", "0"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, text=True, env={**os.environ, "TUNNELDB_DSN": dsn}, stderr=sys.stderr
    ) as process:
        assert process.stdout is not None
        try:
            yield process.stdout.readline().strip().rstrip("/"), psutil.Process(process.pid)
        finally:
            process.terminate()


def measure(dsn: str, address: str, process: psutil.Process, names: list[str], length: float) -> dict[str, float]:
    """Measure all figures."""
    progress("first picture")
    first, weight = first_picture(address, names[0])
    progress("tiles")
    people = [sign_in(address, name) for name in names]
    cold, warm = tile_seconds(people[0], length, TILES)
    progress("reviewers")
    review_all(people, VERDICTS)
    lost, doubled = check(dsn, people)
    seconds = [s for person in people for s in person.seconds]
    return {
        "first picture, s": first,
        "page before the first tile, kB compressed": weight / 1000.0,
        "tile for the first time, p95, ms": 1000 * float(np.percentile(cold, 95)),
        "tile again, p95, ms": 1000 * float(np.percentile(warm, 95)),
        f"verdict of {len(people)} reviewers at once, p95, ms": 1000 * float(np.percentile(seconds, 95)),
        "verdicts": float(len(seconds)),
        "verdicts lost": float(lost),
        "verdicts doubled": float(doubled),
        "refused or failed": float(sum(len(person.errors) for person in people)),
        "memory of the server, MB": process.memory_info().rss / 1e6,
    }


def first_picture(address: str, name: str) -> tuple[float, float]:
    """Return the seconds from the request for a survey to its first tile, and the bytes of the page."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1440, "height": 900})
        page.goto(f"{address}/login")
        page.fill("input[name=user]", name)
        page.fill("input[name=password]", PASSWORD)
        page.click("button[type=submit]")
        page.wait_for_url(f"{address}/*")
        page.wait_for_selector("main")
        page.goto("about:blank")
        seen: list[float] = []

        def note(response) -> None:  # type: ignore[no-untyped-def]
            if "/tiles/" in response.url and response.url.endswith(".png"):
                seen.append(time.perf_counter())

        page.on("response", note)
        start = time.perf_counter()
        page.goto(f"{address}/#/{SURVEY}")
        while not seen and time.perf_counter() - start < PATIENCE:
            page.wait_for_timeout(20)
        weight = page.evaluate(BYTES)
        browser.close()
    return seen[0] - start if seen else float("nan"), float(weight)


def check(dsn: str, people: list[Person]) -> tuple[int, int]:
    """Return the verdicts that were shown as written and are not in the database, and those that the audit has twice."""
    with connect(dsn) as conn:
        lost = doubled = 0
        for person in people:
            rows = conn.execute(
                "SELECT id FROM tunnel_api.finding WHERE id = ANY(%s) AND review = 'confirmed' AND reviewed_by = %s",
                [person.written, person.name],
            ).fetchall()
            lost += len(person.written) - len(rows)
            audit = conn.execute(
                "SELECT count(*), count(DISTINCT row_id) FROM tunnel_api.audit WHERE who = %s AND row_id = ANY(%s)",
                [person.name, person.written],
            ).fetchone()
            assert audit is not None
            doubled += audit[0] - audit[1]
        return lost, doubled


if __name__ == "__main__":
    main()
