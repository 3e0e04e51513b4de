"""Deviation from design profiles against closed formulas and shapely, on a curved axis too; time and memory of a kilometre.

python -m benchmarks.deviation              # a minute on two cores
python -m benchmarks.deviation --pixel 0.02 # of the kilometre that is timed
"""

from __future__ import annotations

import argparse
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np
import shapely
from affine import Affine

from benchmarks.common import print_table, save
from tunneldb.geometry.surface import Surface
from tunneldb.pipeline.deviation import Design, block_steps
from tunneldb.raster.geotiff import DEVIATION_KINDS, Raster, encode
from tunneldb.raster.grid import BLOCK
from tunneldb.shape.evenness import evenness
from tunneldb.shape.outline import Outline
from tunneldb.shape.overbreak import LEAST_PIXELS
from tunneldb.shape.profile import Profile, signed_distance, stretches
from tunneldb.shape.straightedge import Cells, cell_means

sys.path.append(str(Path(__file__).parent.parent / "tests"))
from support.curved_lining import arc, block, circle, made

ANYWHERE = (-np.inf, np.inf)
KIND = DEVIATION_KINDS["lining"]

Result = TypeVar("Result")


def horseshoe(radius: float, wall: float = 2.0) -> Outline:
    """Half a circle on vertical walls, without a floor."""
    vertices = np.array([[-radius, -wall], [-radius, 0.0], [radius, 0.0], [radius, -wall]])
    return Outline.of(vertices, np.array([0.0, arc(180.0), 0.0, 0.0]), closed=False)


def section_about(surface: Surface, right: float, up: float) -> shapely.Polygon:
    """The section as it is stored, in chords of a degree, about the given axis."""
    angle = np.radians(np.arange(361) - 180.0)
    return shapely.Polygon(np.column_stack([right + surface.radius[0] * np.sin(angle), up + surface.radius[0] * np.cos(angle)]))


def distances() -> list[tuple[object, ...]]:
    """Greatest error of the signed distance of points, mm, against shapely's of the outline in chords of 10 nm."""
    rng = np.random.default_rng(1)
    corners = np.array([[-4.0, -1.0], [-3.0, 3.0], [0.5, 3.5], [4.0, 2.0], [3.0, -1.0]])
    outlines = {
        "circle": circle(3.0, 0.1, -0.2),
        "horseshoe with a floor": Outline.of(
            np.array([[-5.0, -2.0], [-5.0, 0.0], [5.0, 0.0], [5.0, -2.0]]), np.array([0, arc(180.0), 0, 0]), True
        ),
        "five arcs and lines": Outline.of(corners, np.array([arc(60.0), 0.0, arc(80.0), -arc(40.0), arc(20.0)]), True),
    }
    rows: list[tuple[object, ...]] = []
    for name, outline in outlines.items():
        polygon = shapely.Polygon(outline.flattened(1e-8))
        points = rng.uniform(-6.0, 6.0, (3000, 2))
        wanted = shapely.distance(polygon.exterior, shapely.points(points))
        wanted = np.where(shapely.contains_xy(polygon, *points.T), wanted, -wanted)
        rows.append((name, len(points), round(1e3 * float(np.abs(signed_distance(outline, points) - wanted).max()), 6)))
    return rows


def areas(pixel: float) -> list[tuple[object, ...]]:
    """Over- and underbreak of 50 m of lining on a curve, m³, against shapely's of each section's outlines."""
    rows: list[tuple[object, ...]] = []
    for name, radius, designs in (
        ("circle in a circle shifted by 50 mm", 4.0, (circle(4.0, 0.05), None)),
        ("circle in a larger one shifted by 30, -40 mm", 4.0, (circle(4.1, 0.03, -0.04), None)),
        ("transition from 3.9 to 4.1 m over 50 m", 4.0, (circle(3.9, 0.05), circle(4.1, 0.05))),
    ):
        surface, axis = made(radius, 200.0, 0.03, 0.02)
        first, second = designs
        profiles = [Profile("a", 0.0, 100.0 if second else 200.0, first)]
        if second:
            profiles.append(Profile("b", 150.0, 200.0, second))
        design = Design(surface, axis, stretches(profiles))
        image = block(surface, 100.0, pixel)
        along, found = design.deviation(image, np.ones(image.values.shape, np.bool_))
        steps = list(block_steps(design.stretches, image, along, found, ANYWHERE))
        ours = np.array([[s.figures.overbreak, s.figures.underbreak] for s in steps]).sum(axis=0)
        lining = section_about(surface, 0.03, 0.02)
        theirs = np.zeros(2)
        for step in steps:
            middle = (step.low + step.high) / 2.0
            outline = next(s for s in design.stretches if s.low <= middle < s.high).at(middle)
            polygon = shapely.Polygon(outline.flattened(1e-6))
            theirs += lining.difference(polygon).area, polygon.difference(lining).area
        off = 100.0 * np.abs(ours - theirs).sum() / theirs.sum()
        rows.append((name, *ours.round(4).tolist(), *theirs.round(4).tolist(), round(float(off), 3)))
    return rows


def on_the_curve() -> list[tuple[object, ...]]:
    """Deviation of a lining that is its design, on a curve and a grade, where the measured axis lies off the given one, mm."""
    rows: list[tuple[object, ...]] = []
    for right, up in ((0.0, 0.0), (0.03, 0.02), (-0.2, 0.1)):
        surface, axis = made(4.0, 200.0, right, up)
        design = Design(surface, axis, stretches([Profile("a", 0.0, 200.0, circle(4.0))]))
        image = block(surface, 50.0, 0.05)
        _, found = design.deviation(image, np.ones(image.values.shape, np.bool_))
        flat = 4.0 * (1.0 - np.cos(np.radians(0.5)))  # sections are chords of a degree
        off = 1e3 * (found.distance[np.isfinite(found.distance)] - flat / 1.5)
        rows.append((f"{1e3 * right:g}, {1e3 * up:g}", *np.round([off.mean(), np.abs(off).max()], 3).tolist()))
    return rows


def timed(pixel: float) -> list[tuple[object, ...]]:
    """Seconds of a kilometre with a horseshoe of a profile, and the most memory that the process had, MB."""
    surface, axis = made(5.0, 1000.0, 0.03, 0.02)
    design = Design(surface, axis, stretches([Profile("a", 0.0, 1000.0, horseshoe(5.0, 4.0))]))
    image = block(surface, 0.0, pixel)
    began, pixels = time.perf_counter(), 0
    for number in range(round(1000.0 / BLOCK)):
        here = Raster(image.values, Affine(pixel, 0.0, number * BLOCK, 0.0, -pixel, image.transform.f))
        along, found = design.deviation(here, np.ones(here.values.shape, np.bool_))
        sum(1 for _ in block_steps(design.stretches, here, along, found, ANYWHERE))
        pixels += image.values.size
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    return [(pixel, round(pixels / 1e6, 1), round(time.perf_counter() - began, 1), round(memory))]


def stored(pixel: float) -> list[tuple[object, ...]]:
    """What storing the image of deviation adds to a kilometre: MB and seconds, beside those of the offset image.

    Pixels have 3 mm of noise and waves of 10 mm, a fifth of them no point, and a quarter of the section is no lining.
    """
    surface, axis = made(5.0, 200.0, 0.03, 0.02)
    design = Design(surface, axis, stretches([Profile("a", 0.0, 200.0, horseshoe(5.0, 4.0))]))
    image = block(surface, 50.0, pixel)
    rng = np.random.default_rng(1)
    rows, columns = image.values.shape
    wave = 0.01 * np.sin(2.0 * np.pi * np.arange(columns) * pixel / 3.0)
    values = (wave + rng.normal(0.0, 0.003, (rows, columns))).astype(np.float32)
    values[rng.random((rows, columns)) < 0.2] = np.nan
    lining = np.ones((rows, columns), np.bool_)
    lining[: rows // 8] = lining[-rows // 8 :] = False
    offset = Raster(values, image.transform)
    blocks = round(1000.0 / BLOCK)
    design.deviation(offset, lining)  # compiles
    measured, (_, found) = _timed(lambda: design.deviation(offset, lining))
    written, tiff = _timed(lambda: encode(Raster(np.ascontiguousarray(found.distance.T, np.float32), offset.transform), KIND))
    before = len(encode(offset, "offset"))
    shown = np.ascontiguousarray(found.distance.T[: rows // 5 * 5, : columns // 5 * 5], np.float32)
    averaged, cells = _timed(lambda: cell_means(shown, 5, LEAST_PIXELS))
    cell = 5 * pixel
    evenness(cells, 2.0, cell)  # compiles
    means = Cells(*(np.tile(part, (1, blocks)) for part in (cells.mean, cells.sigma, cells.seen)))
    laid, _ = _timed(lambda: evenness(means, 2.0, cell))
    return [
        ("offset image, stored before, MB", round(blocks * before / 1e6, 1)),
        ("image of deviation, added, MB", round(blocks * len(tiff) / 1e6, 1)),
        ("deviation of the pixels, s", round(blocks * measured, 1)),
        ("writing its image, added, s", round(blocks * written, 1)),
        ("evenness: cells of the image, s", round(blocks * averaged, 1)),
        ("evenness: a straightedge of 2 m both ways, s", round(laid, 1)),
    ]


def _timed(work: Callable[[], Result]) -> tuple[float, Result]:
    """Seconds, and the result."""
    began = time.perf_counter()
    result = work()
    return time.perf_counter() - began, result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pixel", type=float, default=0.02, help="of the images, m")
    options = parser.parse_args()
    results = {
        "distances": distances(), "curve": on_the_curve(), "areas": areas(options.pixel), "timed": timed(options.pixel),
        "stored": stored(options.pixel),
    }  # fmt: skip
    print_table("signed distance against shapely's", ("outline", "points", "greatest error mm"), results["distances"])
    print_table(
        "a lining that is its design, R = 300 m, 2 % up: deviation, mm",
        ("measured axis off by, mm", "mean", "greatest"),
        results["curve"],
    )
    header = ("50 m of lining, m³", "overbreak", "underbreak", "shapely's", "", "off %")
    print_table(f"volumes, pixels of {options.pixel:g} m", header, results["areas"])
    print_table("a kilometre", ("pixel m", "million pixels", "seconds", "most memory MB"), results["timed"])
    title = f"a kilometre's image of deviation, and evenness, pixels of {options.pixel:g} m"
    print_table(title, ("of a kilometre", ""), results["stored"])
    save("deviation", results)


if __name__ == "__main__":
    main()
