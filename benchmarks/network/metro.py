"""A real intensity image of a metro lining as a sample: what an eye takes for wet is measured against, never trained on.

    python -m benchmarks.network.metro FOLDER --cache DIR     # FOLDER has intensity.png and wet-by-eye.png

The image must not be passed on; the sample goes to ``DIR/scenes/metro``, a family that training must leave out.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from PIL import Image

from benchmarks.network.sample import NONE, OTHER, WET, Sample
from tunneldb.raster.state import PixelState

GIRTH = np.pi * 5.5
"""Circumference, m: all rows of the image."""

PIXEL, STEP = 0.02, 0.08
"""Side of a pixel of the sample, m; decibels a grey step."""

CABLES = ((365, 443), (460, 477), (515, 532), (1062, 1093), (1222, 1241))
"""Rows of cables and pipes."""

WALLS = (84, 1492)
"""Rows of the lining; beyond are track and floor."""

WHITE = 250
"""Grey from which there is no data."""


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.network.metro", description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--cache", type=Path, required=True, metavar="DIR")
    arguments = parser.parse_args()
    target = arguments.cache / "scenes" / "metro" / "shanghai.npz"
    target.parent.mkdir(parents=True, exist_ok=True)
    grey, wet = (np.asarray(Image.open(arguments.folder / name).convert("L")) for name in ("intensity.png", "wet-by-eye.png"))
    metro_sample(grey, wet > 127).save(target)


def metro_sample(grey: np.ndarray, wet: np.ndarray) -> Sample:
    """Bring the image to square pixels of PIXEL, each the mean of the data in it."""
    own = GIRTH / len(grey)
    rows, columns = (round(n * own / PIXEL) for n in grey.shape)
    row, column = ((np.arange(n) * own / PIXEL).astype(int) for n in grey.shape)
    at = np.minimum(row, rows - 1)[:, None] * columns + np.minimum(column, columns - 1)[None]

    def mean(values: np.ndarray, use: np.ndarray) -> np.ndarray:
        total, count = (np.bincount(at[use], w, rows * columns).reshape(rows, columns) for w in (values[use], None))
        return np.where(count > 0, total / np.maximum(count, 1), np.nan)

    data = grey < WHITE
    level = mean(grey.astype(float) * STEP, data)
    lines = np.zeros(grey.shape, np.bool_)
    for first, stop in CABLES:
        lines[first:stop] = True
    floor = np.zeros(grey.shape, np.bool_)
    floor[: WALLS[0]] = floor[WALLS[1] :] = True
    every = np.ones(grey.shape, np.bool_)
    state = np.where(np.isnan(level), PixelState.EMPTY, PixelState.LINING)
    state = np.where(mean(lines, every) >= 0.5, PixelState.OFF, state)
    state = np.where(mean(floor, every) >= 0.5, PixelState.FLOOR, state).astype(np.uint8)
    # Row 0 of the image, at one end of the circumference, becomes the greatest arc; the crown is in the middle.
    steps = np.where(np.isnan(level), NONE, np.rint(100 * np.nan_to_num(level))).astype(np.int16)
    label = np.where(state == PixelState.OFF, OTHER, np.where(mean(wet, every) >= 0.5, WET, 0)).astype(np.uint8)
    return Sample(state, steps, label, PIXEL, 0.0, -(rows // 2))


if __name__ == "__main__":
    main()
