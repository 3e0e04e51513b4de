"""Today's detection, the network, and both, on the same scenes: leaks, areas and false ones by the scores of blind rounds.

    python -m benchmarks.network.measure --cache DIR --model NAME round_09 metro

Reads the probabilities that ``benchmarks.network.predict`` wrote. The network's regions are pixels of half probability and more
that hang together; one counts as a leak from some mean probability on. Rows give it at 0.5, and where there are as many false
leaks as today's detection has: that is read off these scenes, and says what is lost for it, not what to choose.
"""

from __future__ import annotations

import argparse
import pickle
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import rasterio.features
import shapely
from rasterio import Affine
from scipy import ndimage

from benchmarks.blind.run import Outcome
from benchmarks.blind.score import calibration_error, hold, row
from benchmarks.common import print_table
from benchmarks.evidence.detection import detect
from benchmarks.network.features import PIXEL, see
from benchmarks.network.sample import LIMIT, OTHER, WET, Sample
from tunneldb.raster.grid import Grid
from tunneldb.raster.image import LiningImage
from tunneldb.raster.pixel_state import PixelState

HEADER = ("method", "p from", "true", "found", "called", "right", "false", "leak F1", "area R", "area P", "area F1",
          "false/1000", "calibration")  # fmt: skip

HALF, LEAST = 0.5, 0.05
"""Probability of the pixels of a region, and its least area, m²."""

LEVELS = np.arange(0.5, 1.0, 0.01)
"""Mean probabilities from which regions may count as leaks."""


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.network.measure", description=__doc__.splitlines()[0])
    parser.add_argument("families", nargs="+", metavar="FAMILY")
    parser.add_argument("--cache", type=Path, required=True, metavar="DIR")
    parser.add_argument("--model", required=True, metavar="NAME", help="name of the model's file without .onnx")
    arguments = parser.parse_args()
    for family in arguments.families:
        today, network, both = [], [], []
        for path in sorted((arguments.cache / "scenes" / family).glob("*.npz")):
            sample = Sample.load(path)
            p = np.load(arguments.cache / "probabilities" / arguments.model / family / f"{path.stem}.npy")[WET].astype(
                np.float32
            )
            picture, truth = picture_of(arguments.cache, family, path.stem, sample)
            old = detect(picture, truth)[0]
            today.append(old)
            network.append(regions(sample, p, old))
            both.append(judged(sample, p, old))
        rows = [cells("today", 0.5, today)]
        for name, outcomes in (("network", network), ("today's regions, network's verdict", both)):
            rows.append(cells(name, 0.5, outcomes))
            level = as_many_false(outcomes, row(hold(today))["false"])
            rows.append(cells(f"{name}, as many false", level, called(outcomes, level)))
        print_table(f"{family}: {len(today)} scenes", HEADER, rows)
        print_table(f"{family}: area F1", ("scene", "today", "network", "both"), [
            (one.scene, *(f"{row(hold([o]))['area_f1']:.3f}" for o in (one, two, three)))
            for one, two, three in zip(today, network, both, strict=True)
        ])  # fmt: skip


def picture_of(cache: Path, family: str, name: str, sample: Sample) -> tuple[LiningImage, Outcome]:
    """Picture that today's detection is given, and the truth; of a sample that is no scan, that sample itself."""
    path = cache / "pictures" / family / f"{name}.pickle"
    if path.is_file():
        picture, truth = pickle.loads(path.read_bytes())
        return picture, truth
    rows, columns = sample.state.shape
    grid = Grid(0, sample.pixel, sample.bottom, rows, 0, (0, -(-round(columns * sample.pixel * 1000) // 50_000)))
    state = np.full((rows, grid.columns), PixelState.OFF, np.uint8)
    level = np.full(state.shape, -32768, np.int16)
    state[:, :columns], level[:, :columns] = sample.state, sample.level
    true, limit = (outlines(sample.label == value, sample, 1.0) for value in (WET, LIMIT))
    marks = outlines((sample.label == OTHER), sample, 1.0)
    limits = [""] * len(true) + ["not told"] * len(limit)
    shapes, nothing = [*true, *limit], [""] * len(limits)
    seen = float((sample.state == PixelState.LINING).sum() * sample.pixel**2)
    return LiningImage(grid, state, level), Outcome(
        name, family, family, shapes, [np.nan] * len(limits), nothing, limits, [], [], [], [], seen, 0.0, marks,
        ["dry"] * len(marks),
    )  # fmt: skip


def outlines(mask: np.ndarray, sample: Sample, by: float) -> list[shapely.Geometry]:
    """Shapes of the pieces of a mask whose pixels are so many times those of the sample."""
    side = sample.pixel * by
    top = sample.bottom * sample.pixel + len(mask) * side
    transform = Affine(side, 0.0, sample.west, 0.0, -side, top)
    found = rasterio.features.shapes(mask.astype(np.uint8), mask=mask, connectivity=8, transform=transform)
    return [shapely.make_valid(shapely.geometry.shape(shape)) for shape, _ in found]


def regions(sample: Sample, p: np.ndarray, truth: Outcome) -> Outcome:
    """What the network takes for wet: its regions, each with its mean probability."""
    wet = (p >= HALF) & see(sample).lining
    label, count = ndimage.label(wet, np.ones((3, 3)))
    mean = ndimage.mean(p, label, np.arange(1, count + 1)) if count else np.empty(0)
    shapes, found = [], []
    for k in range(1, count + 1):
        for shape in outlines(label == k, sample, PIXEL / sample.pixel) if (label == k).sum() * PIXEL**2 >= LEAST else []:
            shapes.append(shapely.simplify(shape, 0.5 * PIXEL))
            found.append(float(mean[k - 1]))
    return replace(truth, found=shapes, kinds=["leak"] * len(shapes), probabilities=found, reasons=[[]] * len(shapes))


def judged(sample: Sample, p: np.ndarray, today: Outcome) -> Outcome:
    """Return today's regions with the network's mean probability in each."""
    height = len(p) * PIXEL + sample.bottom * sample.pixel
    transform = Affine(PIXEL, 0.0, sample.west, 0.0, -PIXEL, height)
    means = []
    for shape in today.found:
        inside = rasterio.features.rasterize([(shape, 1)], p.shape, transform=transform, all_touched=True).astype(bool)
        means.append(float(p[inside].mean()) if inside.any() else 0.0)
    return called([replace(today, probabilities=means)], 0.5)[0]


def called(outcomes: Sequence[Outcome], level: float) -> list[Outcome]:
    """Take for leaks what has a probability from a level on."""
    return [replace(one, kinds=["leak" if p >= level else "dark" for p in one.probabilities]) for one in outcomes]


def as_many_false(outcomes: Sequence[Outcome], most: float) -> float:
    """Return the least level at which there are no more false leaks than that."""
    return next((float(level) for level in LEVELS if row(hold(called(outcomes, level)))["false"] <= most), 1.0)


def cells(name: str, level: float, outcomes: Sequence[Outcome]) -> list[str]:
    """Row of a table with HEADER."""
    v = row(hold(outcomes))
    counts = [str(int(v[key])) for key in ("true", "found", "called", "right", "false")]
    shares = [f"{v[key]:.3f}" for key in ("f1", "area_recall", "area_precision", "area_f1")]
    return [name, f"{level:.2f}", *counts, *shares, f"{v['false_per_1000']:.2f}", f"{calibration_error(outcomes):.3f}"]


if __name__ == "__main__":
    main()
