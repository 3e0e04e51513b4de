"""Deviation, thickness and evenness against closed formulas and shapely; time, memory and images of a kilometre.

python -m benchmarks.deviation              # a minute on two cores
python -m benchmarks.deviation --pixel 0.02 # of the kilometre that is timed
"""

from __future__ import annotations

import argparse
import resource
import sys
import time
from pathlib import Path

import numpy as np
import shapely
from affine import Affine

from benchmarks.common import print_table, save
from tunneldb.geometry.surface import Surface
from tunneldb.measures.deviation.compute import Design, block_steps
from tunneldb.measures.evenness.compute.evenness import evenness, step_evenness
from tunneldb.measures.evenness.compute.sections import CellGrid, polygons_of
from tunneldb.measures.evenness.compute.straightedge import Cells, cell_means, gaps_beneath
from tunneldb.measures.thickness.compute import section_thickness
from tunneldb.raster.geotiff import Raster, encode
from tunneldb.raster.grid import BLOCK
from tunneldb.shape.outline import Outline
from tunneldb.shape.profile import Profile, signed_distance, stretches

sys.path.append(str(Path(__file__).parent.parent / "tests"))
from support.curved_lining import arc, block, circle, made
from support.eccentric_circles import held_against, ray

ANYWHERE = (-np.inf, np.inf)


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


def thicknesses(pixel: float) -> list[tuple[object, ...]]:
    """Between two eccentric circles held against either's design: greatest error, mm, and that of the volume of a metre, %."""
    rows: list[tuple[object, ...]] = []
    pairs = {
        "0.4 m, 36 mm off": ((4.4, 0.02, -0.01), (4.0, -0.01, 0.01)),
        "0.25 m, 100 mm off": ((4.25, 0.05, 0.0), (4.0, -0.05, 0.0)),
    }
    for name, (before, after) in pairs.items():
        for radius in (after[0], before[0]):
            outline = circle(radius)
            cells = [held_against(outline, *one, pixel) for one in (before, after)]
            found = section_thickness(*cells, outline)
            count = len(found.thickness)
            angle = np.pi + 2.0 * np.pi * (np.arange(count) + 0.5) / count
            wanted = np.subtract(*(ray(angle, *one) for one in (before, after)))
            off = 1e3 * float(np.abs(found.thickness - wanted).max())
            area = np.pi * (before[0] ** 2 - after[0] ** 2)
            rows.append((name, f"{radius:g}", round(off, 4), round(100.0 * abs(found.area / area - 1.0), 4)))
    return rows


def gaps() -> list[tuple[object, ...]]:
    """Greatest gap beneath 2 m on cells of 0.1 m, mm, by formula and as found, and of an even lining with noisy pixels."""
    x = 0.1 * np.arange(2000)
    shapes = {
        "waves of 1 m, 10 mm": (0.01 * np.cos(2.0 * np.pi * x), 20.0),
        "waves of 2 m, 10 mm": (0.01 * np.cos(np.pi * x), 20.0),
        "waves of 5 m, 10 mm": (0.01 * np.cos(2.0 * np.pi * x / 5.0), 10.0 * (1.0 - np.cos(np.pi * 2.0 / 5.0))),
        "a step of 30 mm": (np.where(x < 100.0, 0.03, 0.0), 30.0 * 19.0 / 20.0),
        "a bump of 30 mm": (np.where(np.abs(x - 100.0) < 0.01, 0.03, 0.0), 30.0 * 19.0 / 20.0),
    }
    rows: list[tuple[object, ...]] = [
        (name, round(wanted, 4), round(1e3 * float(np.nanmax(gaps_beneath(height[None], 2.0, 0.1).gap)), 4))
        for name, (height, wanted) in shapes.items()
    ]
    rng = np.random.default_rng(1)
    noise = gaps_beneath(rng.normal(0.0, 0.003 / 5.0, (100, 2000)), 2.0, 0.1).gap
    rows.append(
        (
            "even, pixels of 20 mm scatter by 3 mm: median, 99 %",
            0.0,
            str(np.round(1e3 * np.nanquantile(noise, [0.5, 0.99]), 2).tolist()),
        )
    )
    return rows


def timed_evenness() -> list[tuple[object, ...]]:
    """Seconds of CPU for a kilometre of rough lining beneath 2 m and 4 m, along and around, and the most memory, MB."""
    rng = np.random.default_rng(1)
    cells = cell_means(rng.normal(0.0, 0.02, (1250, 2500)).astype(np.float32), 5, 3)
    evenness(cells, 2.0, 0.1)
    rows: list[tuple[object, ...]] = []
    for length in (2.0, 4.0):
        began = time.process_time()
        parts = [cell_means(rng.normal(0.0, 0.02, (1250, 2500)).astype(np.float32), 5, 3) for _ in range(20)]
        made = time.process_time()
        whole = Cells(*(np.hstack([getattr(part, name) for part in parts]) for name in ("mean", "sigma", "seen")))
        found = evenness(whole, length, 0.1)
        steps = [step_evenness(found, slice(k, k + 10), 0.02) for k in range(0, 10_000, 10)]
        laid = time.process_time()
        grid = CellGrid(0.1, 0.0, -12.5, whole)
        areas = sum(1 for _ in polygons_of(grid, found, 0, 0.012))
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
        rows.append(
            (
                length,
                len(steps),
                areas,
                *np.round([made - began, laid - made, time.process_time() - laid], 1).tolist(),
                round(memory),
            )
        )
    return rows


def stored(pixel: float) -> list[tuple[object, ...]]:
    """Images of offset and deviation as they are stored, with 3 mm of noise: MB and CPU seconds a kilometre."""
    surface, axis = made(5.0, 1000.0, 0.03, 0.02)
    design = Design(surface, axis, stretches([Profile("a", 0.0, 1000.0, horseshoe(5.0, 4.0))]))
    image = block(surface, 0.0, pixel)
    noise = np.random.default_rng(1).normal(0.0, 0.003, image.values.shape)
    offset = Raster((image.values + noise).astype(np.float32), image.transform)
    _, found = design.deviation(offset, np.ones(offset.values.shape, np.bool_))
    deviation = Raster(np.ascontiguousarray(found.distance.T, np.float32), image.transform)
    rows: list[tuple[object, ...]] = []
    for kind, raster in (("offset", offset), ("deviation_lining", deviation)):
        began = time.process_time()
        size = len(encode(raster, kind))
        rows.append((kind, round(size * 1000.0 / BLOCK / 1e6, 1), round((time.process_time() - began) * 1000.0 / BLOCK, 1)))
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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pixel", type=float, default=0.02, help="of the images, m")
    options = parser.parse_args()
    results = {
        "distances": distances(), "curve": on_the_curve(), "areas": areas(options.pixel),
        "thickness": thicknesses(options.pixel), "gaps": gaps(), "timed": timed(options.pixel),
        "evenness": timed_evenness(), "stored": stored(options.pixel),
    }  # fmt: skip
    print_table("signed distance against shapely's", ("outline", "points", "greatest error mm"), results["distances"])
    print_table(
        "a lining that is its design, R = 300 m, 2 % up: deviation, mm",
        ("measured axis off by, mm", "mean", "greatest"),
        results["curve"],
    )
    header = ("50 m of lining, m³", "overbreak", "underbreak", "shapely's", "", "off %")
    print_table(f"volumes, pixels of {options.pixel:g} m", header, results["areas"])
    print_table(
        "thickness between eccentric circles", ("put on", "design of radius m", "off mm", "volume off %"), results["thickness"]
    )
    print_table("gap beneath a straightedge of 2 m, mm", ("lining", "by formula", "found"), results["gaps"])
    header = ("straightedge m", "sections", "areas", "cells, CPU s", "gaps, CPU s", "outlines, CPU s", "most memory MB")
    print_table("evenness of a kilometre, 25 m around, cells of 0.1 m", header, results["evenness"])
    print_table("images of a kilometre as they are stored", ("image", "MB", "CPU s"), results["stored"])
    print_table("a kilometre", ("pixel m", "million pixels", "seconds", "most memory MB"), results["timed"])
    save("deviation", results)


if __name__ == "__main__":
    main()
