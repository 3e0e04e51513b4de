"""Draw a scene with its truth and what was taken for leaks: the picture in which they were sought, unrolled.

    python -m benchmarks.blind.look round_02 SCENE --pictures DIR -o FILE.png
    python -m benchmarks.blind.look round_02 SCENE --pictures DIR --box 10 16 -3 1 -o FILE.png   # chainage and arc, m

Green: true leaks of which half was found. Red: the others. Dotted: those that can't be told. Blue: what was taken
for a leak.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from shapely.geometry.base import BaseGeometry

from benchmarks.blind.run import Outcome
from benchmarks.evidence.detection import detect
from benchmarks.evidence.pictures import names, pictures
from tunneldb.evaluate.measure import MIN_OVERLAP
from tunneldb.raster.geotiff import NODATA
from tunneldb.raster.image import LiningImage
from tunneldb.raster.state import PixelState
from tunneldb.segmentation.network import standard_network

GREEN, RED, BLUE = "#00a050", "#e02020", "#2060ff"


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.blind.look", description=__doc__.splitlines()[0])
    parser.add_argument("round")
    parser.add_argument("scene")
    parser.add_argument("--pictures", type=Path, required=True, metavar="DIR", help="where pictures are kept")
    parser.add_argument("--box", type=float, nargs=4, metavar="M", help="chainage from, to, arc from, to")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="FILE")
    parser.add_argument("--dsn", help="server to use; default: the embedded one")
    arguments = parser.parse_args()
    if arguments.scene not in names(arguments.round):
        parser.error(f"{arguments.round} has no scene {arguments.scene}")
    for picture, truth in pictures(arguments.round, arguments.pictures, arguments.dsn, arguments.scene):
        draw(picture, detect(picture, truth, standard_network())[0], arguments.box, arguments.output)


def draw(picture: LiningImage, outcome: Outcome, box: list[float] | None, path: Path) -> None:
    """Draw a picture, or a box of it, with what is true and what was found."""
    grid = picture.grid
    left, top = grid.west, (grid.bottom + grid.rows) * grid.pixel
    lining = (picture.state == PixelState.LINING) | (picture.state == PixelState.RECESS)
    level = np.where(lining & (picture.level != NODATA), picture.level, np.nan).astype(np.float64)
    if box is None:
        columns, rows = np.flatnonzero(lining.any(axis=0)), np.flatnonzero(lining.any(axis=1))
        along = left + grid.pixel * np.array([columns[0], columns[-1] + 1])
        around = top - grid.pixel * np.array([rows[-1] + 1, rows[0]])
        box = [*along.tolist(), *around.tolist()]
    figure = Figure(figsize=(11.0, 1.0 + 11.0 * (box[3] - box[2]) / (box[1] - box[0])), layout="constrained")
    axes = figure.subplots()
    low, high = np.nanpercentile(level, [2, 98])
    extent = (left, left + grid.columns * grid.pixel, grid.bottom * grid.pixel, top)
    axes.imshow(level, cmap="gray", vmin=low, vmax=high, extent=extent, interpolation="nearest")
    axes.set_facecolor("#b0c4de")
    called = shapely.union_all([outcome.found[k] for k in outcome.leaks])
    _outline(axes, called, BLUE, "-")
    for shape, limit in zip(outcome.true, outcome.limits, strict=True):
        found = shape.intersection(called).area >= MIN_OVERLAP * shape.area
        _outline(axes, shape, GREEN if found else RED, ":" if limit else "-")
    axes.set(xlim=box[:2], ylim=box[2:], xlabel="chainage, m", ylabel="arc from the crown, m", aspect="equal")
    axes.set_title(f"{outcome.scene} ({outcome.lining})")
    figure.savefig(path, dpi=90)


def _outline(axes: Axes, shape: BaseGeometry, colour: str, style: str) -> None:
    for part in shapely.get_parts(shape):
        if isinstance(part, shapely.Polygon) and not part.is_empty:
            axes.plot(*part.exterior.xy, color=colour, linestyle=style, linewidth=1.2)


if __name__ == "__main__":
    main()
