"""Scenes as the network sees them: the images of the stage ``detect`` at full resolution, with the truth drawn into them.

    python -m benchmarks.network.scenes --cache DIR round_01 round_09    # a minute a scene that is not there
    python -m benchmarks.network.scenes --cache DIR set-1 --only tiles

Each scene becomes ``DIR/scenes/FAMILY/NAME.npz``, by the pictures of ``benchmarks.evidence`` in ``DIR/pictures``.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import rasterio.features
from shapely.geometry.base import BaseGeometry

from benchmarks.blind.run import Outcome
from benchmarks.common import progress
from benchmarks.evidence.pictures import names, pictures
from benchmarks.network.sample import DRY, LIMIT, OTHER, WET, Sample
from tunneldb.raster.image import LiningImage
from tunneldb.raster.state import PixelState


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
    for picture, truth in pictures(family, cache / "pictures", dsn, name):
        if truth.scene == name:
            sample_of(picture, truth).save(target)
            progress(f"{family} {name}")


def sample_of(picture: LiningImage, truth: Outcome) -> Sample:
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
    images = (image[:, kept] for image in (picture.state, picture.level, label))
    return Sample(*images, grid.pixel, grid.west + kept.start * grid.pixel, grid.bottom)


def draw(image: np.ndarray, shapes: Sequence[BaseGeometry], value: int, transform: Sequence[float]) -> None:
    """Set the pixels whose centre lies in one of the shapes."""
    found = [(shape, value) for shape in shapes if not shape.is_empty]
    if found:
        rasterio.features.rasterize(found, out=image, transform=rasterio.Affine(*transform))


if __name__ == "__main__":
    main()
