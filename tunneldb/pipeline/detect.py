"""The stage ``detect``: from the scan files, at full density, to images and leaks of one kilometre."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import psycopg

from tunneldb.anomalies.background.contrast import contrast_image
from tunneldb.anomalies.background.level_map import map_background
from tunneldb.anomalies.coverage import measure_coverage
from tunneldb.anomalies.detect import find_anomalies
from tunneldb.errors import UserError
from tunneldb.geometry.section_outliers import MOST, SectionOutliers
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.geometry.surface import Surface
from tunneldb.pipeline.calibration import calibrate, dry_sigma, find_radiometer
from tunneldb.pointcloud.reader import ScanSource
from tunneldb.radiometry.roughness import Roughness
from tunneldb.raster.accumulator import Accumulator
from tunneldb.raster.floor import HIDDEN, Floor
from tunneldb.raster.geotiff import KINDS
from tunneldb.raster.grid import Grid
from tunneldb.raster.image import halo, lining_image
from tunneldb.raster.observation import Observer
from tunneldb.raster.rasterize import Counts, rasterize
from tunneldb.store.anomalies import save_anomalies
from tunneldb.store.images import (
    ImageStore,
    drop_coverage,
    drop_radiometry,
    load_regions,
    save_coverage,
    save_radiometry,
)
from tunneldb.store.range_curve import save_range_curve
from tunneldb.store.scene import load_arcs
from tunneldb.store.sources import sources
from tunneldb.store.surface import load_surface
from tunneldb.store.survey import Survey

ASIDE = 50.0
"""Length of the surface beyond the ends that is loaded too: sections are judged by the three before and after them, m."""


def detect(
    conn: psycopg.Connection[Any],
    survey: Survey,
    km: int,
    values: Mapping[str, float],
    progress: Callable[[float], None],
) -> Counts:
    """Make the unrolled images of a kilometre and find its leaks (Xu et al., 2018).

    The files are read chunk by chunk; only images and leaks are kept.

    Raises
    ------
    UserError
        If there are no sections, the ground was not sought, a file is gone or was changed, or intensity can't be corrected.
    """
    surface = load_surface(conn, survey, km * KILOMETRE - ASIDE, (km + 1) * KILOMETRE + ASIDE)
    grid = _grid(surface, km, values["image.pixel"])
    files = sources(conn, survey, km)
    radiometer = find_radiometer(conn, survey, values["intensity.max_incidence"], values["intensity.max_range"])
    beyond = grid.halo * grid.pixel
    depth = values["lining.tolerance"], values["lining.recess"]
    observer = Observer.of(surface, km, depth, radiometer, load_floor(conn, survey, km, beyond), beyond)
    with Accumulator(grid) as image:
        if radiometer is None:
            return _offset_only(conn, survey, observer, files, image, progress)
        known = calibrate(conn, survey, observer, load_regions(conn, survey, km, "homogeneous"))
        observer, view, roughness = known.observer, known.view, known.roughness
        counts = _gather(observer, files, image, roughness.sigma, progress)
        images = ImageStore(conn, survey, grid, KINDS)
        picture = lining_image(
            image, observer.floor, SectionOutliers.of(surface, MOST), values["appendage.distance"], images.save
        )
    dry_regions = load_regions(conn, survey, km, "dry")
    dry = map_background(picture, dry_regions)
    darker = contrast_image(picture, dry)
    found = find_anomalies(darker, dry, values["leak.min_area"])
    images.save_states(darker.state, found.dark)
    save_range_curve(conn, survey, km, known.found)
    save_radiometry(conn, survey, km, roughness, dry, found, dry_sigma(view, darker, found, roughness, dry_regions))
    coverage = measure_coverage(darker.state, found.wet, grid, found.size)
    save_coverage(conn, survey, km, coverage)
    matched = save_anomalies(conn, survey, km, surface, found.found, found.cut, values["leak.min_area"])
    return {
        **counts,
        "pixels": images.pixels,
        "lining_pixels": found.pixels,
        "wet_pixels": found.wet_pixels,
        "seen": round(float(coverage.seen.sum() / max(coverage.lining.sum(), 1e-9)), 4),
        "leaks": matched.new + matched.again,
        "joints": matched.kinds["joint"],
        "dark": matched.kinds["dark"],
        "leaks_over_ends": matched.over_ends,
        "leaks_new": matched.new,
        "leaks_again": matched.again,
        "leaks_kept_for_review": matched.kept,
        "leaks_gone": matched.gone,
        **_report(roughness, known.note, matched.other_pixels),
    }


def load_floor(conn: psycopg.Connection[Any], survey: Survey, km: int, halo: float) -> Floor:
    """Where the floor of a kilometre begins, and of so many metres beyond its ends: where stage ``ground`` has found it."""
    done = conn.execute(
        "SELECT FROM tunnel.run WHERE survey_id = %s AND km = %s AND stage = 'ground' AND outcome = 'done' LIMIT 1",
        (survey.id, km),
    ).fetchone()
    if done is None:
        raise UserError(f"the ground of kilometre {km} is not known yet: tunneldb run {survey.name} --km {km} --from ground")
    # Far enough for both kilometres to see the ground on both sides of a gap at their border.
    beyond = int(np.ceil(halo)) + HIDDEN
    first = int(km * KILOMETRE) - beyond
    return Floor.of(first, *load_arcs(conn, survey, first, int((km + 1) * KILOMETRE) + beyond))


def _offset_only(
    conn: psycopg.Connection[Any],
    survey: Survey,
    observer: Observer,
    files: list[ScanSource],
    image: Accumulator,
    progress: Callable[[float], None],
) -> Counts:
    """Make the offset image of a survey without intensity."""
    counts = _gather(observer, files, image, 0.0, progress)
    images = ImageStore(conn, survey, image.grid, ["offset"])
    for block in image.inner_blocks():
        images.save(image.window(block * image.grid.block_columns, (block + 1) * image.grid.block_columns))
    drop_radiometry(conn, survey, observer.km)
    drop_coverage(conn, survey, observer.km)
    save_range_curve(conn, survey, observer.km, None)
    save_anomalies(conn, survey, observer.km, observer.surface, [], [], 0.0)
    return {
        **counts,
        "pixels": images.pixels,
        "leaks": 0,
        "note": "no intensity: offset image only, no leaks sought",
    }


def _gather(
    observer: Observer, files: list[ScanSource], image: Accumulator, roughness: float, progress: Callable[[float], None]
) -> Counts:
    """Read the files into the image, which must not show the halo alone."""
    counts = rasterize(observer, files, image, roughness, progress)
    if not image.inner_blocks():
        raise UserError(
            f"no point of {', '.join(file.path.name for file in files)} lies on the lining of kilometre {observer.km}"
        )
    return counts


def _grid(surface: Surface, km: int, pixel: float) -> Grid:
    """Grid of a kilometre and its halo, from the lowest to the highest arc of their sections."""
    first, last = km * KILOMETRE - surface.reach, (km + 1) * KILOMETRE + surface.reach
    if not ((surface.chainages >= first) & (surface.chainages <= last)).any():
        raise UserError(f"kilometre {km} has no sections yet: run its stages segments and sections first")
    beyond = halo(pixel)
    inside = (surface.chainages >= first - beyond * pixel) & (surface.chainages <= last + beyond * pixel)
    return Grid.covering(km, pixel, float(surface.arcs[inside, 0].min()), float(surface.arcs[inside, -1].max()), beyond)


def _report(roughness: Roughness, note: str | None, other_pixels: list[int]) -> Counts:
    """What the ledger says about the roughness, and what else there is to note."""

    def known(value: float, digits: int) -> float | None:
        return round(value, digits) if np.isfinite(value) else None

    report: Counts = {
        "roughness": known(roughness.sigma, 2),
        "roughness_determined": roughness.determined,
        "roughness_contrast_db": known(roughness.contrast, 3),
        "regions": roughness.regions,
        "incidence_from": known(roughness.incidence_from, 1),
        "incidence_to": known(roughness.incidence_to, 1),
    }
    notes = [note] if note else []
    if text := roughness.note:
        notes.append(text)
    if other_pixels:
        notes.append(
            f"leaks over the end towards kilometre {' and '.join(map(str, other_pixels))} are in two pieces: its pixels are of"
            " another size; detect both with the same image.pixel"
        )
    if notes:
        report["note"] = "; ".join(notes)
    return report
