"""Scenes as the network sees them: the images of the stage ``detect`` at full resolution, with the truth drawn into them.

    python -m benchmarks.network.scenes --cache DIR round_01 round_09    # a minute a scene that is not there
    python -m benchmarks.network.scenes --cache DIR set-1 --only tiles

Each scene becomes ``DIR/scenes/FAMILY/NAME.npz``. Today's detection is measured on the pictures of ``benchmarks.evidence``, in
``DIR/pictures``.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import rasterio.features
from shapely.geometry.base import BaseGeometry

from benchmarks.blind.run import Outcome
from benchmarks.common import progress
from benchmarks.evidence.pictures import names, pictures
from benchmarks.network.sample import DRY, LIMIT, OTHER, WET, Sample, steps_of
from tunneldb.pipeline import detect as stage
from tunneldb.raster.accumulator import Window
from tunneldb.raster.image import LiningImage
from tunneldb.raster.pixel_state import PixelState


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.network.scenes", description=__doc__.splitlines()[0])
    parser.add_argument("families", nargs="+", metavar="FAMILY", help="a round of blind scenes, known, or set-SEED")
    parser.add_argument("--cache", type=Path, required=True, metavar="DIR")
    parser.add_argument("--only", default="", metavar="WORD", help="scenes with this in their name")
    parser.add_argument("--most", type=int, default=1000, metavar="N", help="so many scenes of each family")
    parser.add_argument("--dsn", help="server to use; default: the embedded one")
    arguments = parser.parse_args()
    for family in arguments.families:
        for name in [name for name in names(family) if arguments.only in name][: arguments.most]:
            make(family, name, arguments.cache, arguments.dsn)


def make(family: str, name: str, cache: Path, dsn: str | None) -> None:
    """Make the sample of one scene, unless it is there or the scene was refused."""
    target = cache / "scenes" / family / f"{name}.npz"
    if target.is_file():
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    (cache / "pictures" / family / f"{name}.pickle").unlink(missing_ok=True)
    with windows() as seen:
        for picture, truth in pictures(family, cache / "pictures", dsn, name):
            if truth.scene == name and seen:
                sample_of(picture, seen[-1], truth).save(target)
                progress(f"{family} {name}")


@contextmanager
def windows() -> Iterator[list[Window]]:
    """Keep the means of all pixels, offset and raw intensity among them, of each kilometre that is searched meanwhile."""
    seen: list[Window] = []
    original = stage.lining_image

    def tap(image: Any, *rest: Any) -> LiningImage:
        seen.append(image.window(0, image.grid.columns))
        return original(image, *rest)

    with mock.patch.object(stage, "lining_image", tap):
        yield seen


def sample_of(picture: LiningImage, window: Window, truth: Outcome) -> Sample:
    """Put image and truth together, cut to the columns with a surface."""
    grid = picture.grid
    columns = np.flatnonzero((picture.state != PixelState.OFF).any(axis=0))
    kept = slice(int(columns[0]), int(columns[-1]) + 1)
    label = np.full(picture.state.shape, DRY, np.uint8)
    transform = tuple(grid.transform())[:6]
    for shapes, value in (
        (truth.other, OTHER),
        ([shape for shape, limit in zip(truth.true, truth.limits, strict=True) if not limit], WET),
        ([shape for shape, limit in zip(truth.true, truth.limits, strict=True) if limit], LIMIT),
    ):
        draw(label, shapes, value, transform)
    kinds = np.zeros(label.shape, np.uint8)
    named = sorted(set(truth.other_kinds))
    for kind, shape in zip(truth.other_kinds, truth.other, strict=True):
        draw(kinds, [shape], 1 + named.index(kind), transform)
    return Sample(
        picture.state[:, kept], picture.level[:, kept], steps_of(window.offset[:, kept], 0.001),
        steps_of((window.raw - window.corrected)[:, kept], 0.01), np.minimum(window.weight[:, kept], 65535).astype(np.uint16),
        label[:, kept], kinds[:, kept], named, grid.pixel, grid.west + kept.start * grid.pixel, grid.bottom,
    )  # fmt: skip


def draw(image: np.ndarray, shapes: Sequence[BaseGeometry], value: int, transform: Sequence[float]) -> None:
    """Set the pixels whose centre lies in one of the shapes."""
    found = [(shape, value) for shape in shapes if not shape.is_empty]
    if found:
        rasterio.features.rasterize(found, out=image, transform=rasterio.Affine(*transform))


if __name__ == "__main__":
    main()
