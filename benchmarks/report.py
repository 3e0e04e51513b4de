"""The report of a long tunnel: time and memory to write it, its size, and how a browser bears it.

    python -m benchmarks.report --km 25 --leaks 5000            # --pixel 0.02 --keep FOLDER --no-pdf

The survey is that of benchmarks.synthetic, with images of noise in which the leaks are dark and stretches are unseen.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import psycopg
import shapely
from playwright.sync_api import Page, sync_playwright
from rasterio.features import rasterize

from benchmarks.common import COMMAND, print_table, progress, save, scratch_database
from benchmarks.synthetic import CORNER, Size, make
from tunneldb.database import connect
from tunneldb.raster.geotiff import Raster, encode
from tunneldb.raster.grid import Grid
from tunneldb.raster.state import PixelState
from tunneldb.report.pdf import find_browser

SURVEY = "demo-2024"
REACH = CORNER + 3.0
"""Greatest arc of the images: the wall's foot and half the floor, m."""


def images(conn: psycopg.Connection[Any], survey_id: int, kilometres: int, pixel: float) -> None:
    """Store images of corrected intensity and of states, block by block."""
    rng = np.random.default_rng(1)
    for km in range(kilometres):
        progress(f"images of kilometre {km}")
        grid = Grid.covering(km, pixel, -REACH, REACH)
        rows = conn.execute(
            "SELECT ST_AsBinary(unrolled) FROM tunnel.finding WHERE survey_id = %s AND km = %s", (survey_id, km)
        ).fetchall()
        outlines = shapely.from_wkb([bytes(wkb) for (wkb,) in rows])
        tree = shapely.STRtree(outlines)
        noise = rng.standard_normal((grid.rows, grid.block_columns), np.float32)
        wall = np.abs(grid.arcs()) < CORNER
        for n in range(20):
            columns = slice(n * grid.block_columns, (n + 1) * grid.block_columns)
            transform, chainages = grid.transform(columns.start), grid.chainages(columns)
            near = outlines[tree.query(shapely.box(chainages[0], -REACH, chainages[-1], REACH))]
            dark = rasterize(near, noise.shape, transform=transform).astype(bool) if len(near) else np.zeros(noise.shape, bool)
            values = (-12.0 + 0.5 * np.roll(noise, 37 * n, axis=1) - 5.0 * dark).astype(np.float32)
            state = np.where(wall[:, None], np.where(dark, PixelState.DARK, PixelState.LINING), PixelState.FLOOR).astype(
                np.float32
            )
            hidden = (chainages % 800 < 6)[None, :] & wall[:, None]
            values[hidden], state[hidden] = np.nan, PixelState.EMPTY
            for kind, shown in (("corrected", values), ("state", state)):
                conn.execute(
                    "INSERT INTO tunnel.image (survey_id, km, kind, block, tiff) VALUES (%s, %s, %s, %s, %b)",
                    (survey_id, km, kind, grid.first_block + n, encode(Raster(shown, transform), kind)),
                )
        conn.commit()


def written(dsn: str, path: Path, listed: int) -> dict[str, float]:
    """Write a report as its user would; seconds, MB of the file, and MB that its greatest process took."""
    start = time.perf_counter()
    command = [*COMMAND, "--dsn", dsn, "report", SURVEY, "-o", str(path), "--list", str(listed)]
    with subprocess.Popen(command, stderr=subprocess.DEVNULL) as process:
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"tunneldb report {path} failed")
    return {"seconds": time.perf_counter() - start, "megabytes": path.stat().st_size / 1e6, "memory_mb": usage.ru_maxrss / 1024}


def browsed(path: Path) -> dict[str, float]:
    """Open a report in Chromium, on a desk and as a phone; sort, open a leak, go along the lining; seconds and MB."""
    found: dict[str, float] = {}
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=find_browser(), args=["--no-sandbox"])
        for name, width in (("desk", 1280), ("phone", 390)):
            page = browser.new_page(viewport={"width": width, "height": 800})
            found[f"{name}_load"] = timed(lambda page=page: page.goto(path.as_uri()))
            found[f"{name}_wide"] = page.evaluate("document.documentElement.scrollWidth - innerWidth")
            if name == "desk":
                found |= used(page)
            page.close()
        browser.close()
    return found


def used(page: Page) -> dict[str, float]:
    """Seconds of what one does in the report, and MB that it takes."""
    found = {"sort": timed(lambda: page.get_by_role("button", name="Area m²").click())}
    search = page.get_by_label("Search")
    found["search"] = timed(lambda: search.fill("12+3"))
    search.fill("")
    found["open"] = timed(lambda: page.locator("#table tbody tr").nth(50).click())
    page.get_by_role("dialog").get_by_role("button", name="Close").click()
    found["scroll"] = timed(lambda: through(page))
    found["heap_mb"] = page.evaluate("performance.memory.usedJSHeapSize") / 1e6
    renderers = [child for child in psutil.Process().children(recursive=True) if "--type=renderer" in " ".join(child.cmdline())]
    found["renderer_mb"] = max(child.memory_info().rss for child in renderers) / 1e6
    return found


def through(page: Page) -> None:
    """Show one strip after another, each painted."""
    for strip in page.locator(".strip").element_handles():
        strip.scroll_into_view_if_needed()
        page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")


def timed(work: Any) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dsn", help="server to use; default: the embedded one")
    parser.add_argument("--km", type=int, default=25, help="length of the tunnel")
    parser.add_argument("--leaks", type=int, default=5000)
    parser.add_argument("--list", type=int, default=10_000, help="leaks that are listed at most")
    parser.add_argument("--pixel", type=float, default=0.02, help="of the images, m")
    parser.add_argument("--keep", type=Path, help="folder in which the reports stay")
    parser.add_argument("--no-pdf", action="store_true")
    asked = parser.parse_args(arguments)
    figures: dict[str, Any] = {"km": asked.km, "leaks": asked.leaks, "list": asked.list, "pixel": asked.pixel}
    with tempfile.TemporaryDirectory() as temporary, scratch_database(asked.dsn) as dsn:
        folder = asked.keep or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        with connect(dsn) as conn:
            survey_id = make(conn, SURVEY, Size(asked.km, asked.leaks, 0, asked.leaks // 10))
            images(conn, survey_id, asked.km, asked.pixel)
        progress("report.html")
        figures["html"] = written(dsn, folder / "report.html", asked.list)
        progress("the browser")
        figures["browser"] = browsed(folder / "report.html")
        if not asked.no_pdf:
            progress("report.pdf")
            figures["pdf"] = written(dsn, folder / "report.pdf", asked.list)
    for part in ("html", "pdf", "browser"):
        if part in figures:
            print_table(part, ("figure", "value"), [(name, float(value)) for name, value in figures[part].items()])
    print(f"\n{save('report', figures)}")


if __name__ == "__main__":
    main()
