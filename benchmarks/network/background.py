"""Compare ways to find leaks in which a dark band along the tunnel is no part of the level of dry lining.

    python -m benchmarks.network.background --cache DIR round_09 metro     # 10 s a scene and way

Ways: today's detection; without the level of rows; with that level closed, as narrow dark rings are, so that no row lies more
than some decibels below the brightest rows about it; and, as a measure of what the eye has to go by, all that is 2 dB darker
than the mean level within 3 m, without a verdict.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from unittest import mock

import numpy as np

from benchmarks.blind.run import Outcome
from benchmarks.common import print_table
from benchmarks.evidence.detection import detect
from benchmarks.network.features import CONTRAST, NAMES, see
from benchmarks.network.measure import HEADER, cells, picture_of, regions
from benchmarks.network.sample import Sample
from tunneldb.anomalies.background.model import BackgroundFit
from tunneldb.anomalies.bands import close_rows
from tunneldb.raster.pixel_state import PixelState

CLOSED = ((2.0, 1.0), (2.0, 2.0))
"""Widths, m, of the dark bands that are no background, and from how many decibels on."""

DARKER = 2.0
"""Of the way without a verdict, dB."""

Way = Callable[[Path, str, Path], Outcome]


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.network.background", description=__doc__.splitlines()[0])
    parser.add_argument("families", nargs="+", metavar="FAMILY")
    parser.add_argument("--cache", type=Path, required=True, metavar="DIR")
    arguments = parser.parse_args()
    ways: list[tuple[str, Way]] = [
        ("today", detected(nullcontext)),
        ("no level of rows", detected(lambda: mock.patch.object(BackgroundFit, "add_bands"))),
        *((f"bands of {w:g} m, {db:g} dB", detected(lambda w=w, db=db: closed(w, db))) for w, db in CLOSED),
        (f"{DARKER:g} dB below 3 m", darker),
    ]
    for family in arguments.families:
        paths = sorted((arguments.cache / "scenes" / family).glob("*.npz"))
        rows = [cells(name, 0.5, [way(arguments.cache, family, path) for path in paths]) for name, way in ways]
        print_table(f"{family}: {len(paths)} scenes", HEADER, rows)


def detected(within: Callable[[], AbstractContextManager[object]]) -> Way:
    """Return the way of detection with the background fitted in some context."""

    def way(cache: Path, family: str, path: Path) -> Outcome:
        with within():
            return detect(*picture_of(cache, family, path.stem, Sample.load(path)))[0]

    return way


def closed(width: float, least: float) -> AbstractContextManager[object]:
    """Have the levels of rows closed where they lie that far below the brightest rows about them."""
    original = BackgroundFit.add_bands

    def add_bands(self: BackgroundFit) -> None:
        original(self)
        state = self.picture.state
        rows = np.flatnonzero(((state == PixelState.LINING) | (state == PixelState.RECESS)).any(axis=1))
        seen = slice(rows[0], rows[-1] + 1)
        level = close_rows(self.bands[seen], round(width / self.grid.pixel / 2))
        self.bands[seen] = np.where(level - self.bands[seen] > least, level, self.bands[seen])

    return mock.patch.object(BackgroundFit, "add_bands", add_bands)


def darker(cache: Path, family: str, path: Path) -> Outcome:
    """Take all for wet that is darker than the mean level within 3 m."""
    sample = Sample.load(path)
    _, truth = picture_of(cache, family, path.stem, sample)
    drop = -CONTRAST * see(sample).images[..., NAMES.index("smoothed level to 3 m")]
    return regions(sample, np.where(drop >= DARKER, 1.0, 0.0), truth)


if __name__ == "__main__":
    main()
