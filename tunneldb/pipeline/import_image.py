"""Images of other instruments into the unrolled plane of a survey: whole, or not at all."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import psycopg

from tunneldb.errors import InputError
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.pipeline.image_files import ImageFile
from tunneldb.pipeline.image_placement import ControlPoint, ImportSettings, place_image
from tunneldb.pipeline.other_images import measure_under_findings
from tunneldb.pipeline.pictures import find_pictures, project_kilometre
from tunneldb.pointcloud.formats.e57 import is_e57
from tunneldb.raster.geotiff import Raster
from tunneldb.raster.grid import BLOCK, Grid
from tunneldb.raster.overview import Overview
from tunneldb.raster.placement.checks import Lining, Placed
from tunneldb.raster.placement.resample import PIXELS, resample, usual_pixel
from tunneldb.store.imported_images import ImportedImage, insert_overview, insert_pixels, replace_imported, section_extent
from tunneldb.store.survey import Survey

UNITS = {"thermal": "°C", "photo": "", "radar": "", "moisture": "%", "other": ""}
"""Kinds of imported images, and the unit of one whose file states none."""

MAX_BLOCK = 10**8
"""Maximum number of pixels of a block."""

MAX_STEPS = 32000
"""Number of steps from 0 to the greatest value that are stored."""

_Progress = Callable[[str, float | None], Callable[[float], None]]


@dataclass(frozen=True)
class ImportedResult:
    """Result of an import.

    Attributes
    ----------
    image : ImportedImage
    replaced : bool
        True if there was an image of that name.
    kilometres : list of int
    blocks : int
        Number of stored blocks.
    points : list of ControlPoint
    notes : list of str
        Remarks about the control points.
    """

    image: ImportedImage
    replaced: bool
    kilometres: list[int]
    blocks: int
    points: list[ControlPoint]
    notes: list[str]


@dataclass(frozen=True)
class _Prepared:
    """Image that is to be stored.

    Attributes
    ----------
    image : ImportedImage
    placed : Placed
    blocks : callable
        Given a kilometre and its pixels; returns the blocks with values.
    points, notes
        As of `ImportedResult`.
    """

    image: ImportedImage
    placed: Placed
    blocks: Callable[[int, Grid], Iterator[tuple[int, Raster]]]
    points: list[ControlPoint]
    notes: list[str]


def import_image(
    conn: psycopg.Connection[Any],
    survey: Survey,
    path: Path,
    settings: ImportSettings,
    progress: _Progress,
) -> ImportedResult:
    """Import an image, a table of images, or the pictures of an E57 file, in one transaction; replaces the image of that name.

    Raises
    ------
    UserError
        If a file cannot be read, or the image cannot be placed in the survey.
    """
    lining = Lining(*section_extent(conn, survey))
    prepare = _prepare_pictures if is_e57(path) else _prepare_frames
    done = prepare(conn, survey, path, settings, lining, progress)
    image = done.image
    replaced = replace_imported(conn, survey, image)
    blocks = 0
    found = []
    kilometres = range(*_kilometres(done.placed, lining))
    advance = progress("image", len(kilometres))
    for km in kilometres:
        stored = _store(conn, survey, km, done, lining)
        found += [km] if stored else []
        blocks += stored
        advance(1)
    if not blocks:
        raise InputError(f"{path}: the image has no values within the lining of survey {survey.name}")
    measure_under_findings(conn, survey, -np.inf, np.inf, image.image_kind)
    conn.commit()
    return ImportedResult(image, replaced, found, blocks, done.points, done.notes)


def _prepare_frames(
    conn: psycopg.Connection[Any], survey: Survey, path: Path, settings: ImportSettings, lining: Lining, progress: _Progress
) -> _Prepared:
    """Place images that show the unrolled lining, and describe the one that is to be stored."""
    done = place_image(conn, survey, path, settings, lining)
    sources = [frame.source for frame in done.frames]
    low, high = _value_range(path, sources, progress)
    first = sources[0]
    pixel = settings.pixel or usual_pixel(done.frames[0].mapping)
    pixel = _checked_pixel(pixel, settings.pixel is not None, done.placed, lining)
    fit = done.fit
    stated = first.unit if isinstance(first, ImageFile) else ""
    image = ImportedImage(
        name=settings.name,
        kind=settings.kind,
        colour=first.bands == 3,
        unit=settings.unit if settings.unit is not None else stated or UNITS[settings.kind] if first.bands == 1 else "",
        value_from=low,
        value_to=high,
        step=stored_step(max(abs(low), abs(high))),
        pixel=pixel,
        placement=done.way,
        model=fit.model if fit else None,
        frames=len(done.frames),
        points=len(fit.outliers) if fit else None,
        outliers=int(fit.outliers.sum()) if fit else None,
        residual=fit.rms if fit else None,
        predicted=fit.predicted if fit else None,
        chainage_from=done.placed.chainage_from,
        chainage_to=done.placed.chainage_to,
        arc_from=done.placed.arc_from,
        arc_to=done.placed.arc_to,
        source=path.name,
        warnings=[*done.placed.warnings, *_of_values(settings, first.bands, low, high)],
    )
    return _Prepared(image, done.placed, lambda km, grid: resample(done.frames, grid), done.points, done.notes)


def _prepare_pictures(
    conn: psycopg.Connection[Any], survey: Survey, path: Path, settings: ImportSettings, lining: Lining, progress: _Progress
) -> _Prepared:
    """Find the pictures of an E57 file in the tunnel, and describe the image that is to be stored."""
    if settings.kind != "photo":
        raise InputError(f"{path}: pictures of an E57 file are colours, not values of kind {settings.kind}: give --kind photo")
    for option in ("points", "unit", "band", "scale", "offset"):
        if getattr(settings, option) is not None:
            raise InputError(
                f"{path}: pictures of an E57 file are placed by their poses and have no values: leave out --{option}"
            )
    found = find_pictures(conn, survey, path, lining)
    pixel = _checked_pixel(settings.pixel or found.pixel, settings.pixel is not None, found.placed, lining)
    image = ImportedImage(
        name=settings.name,
        kind=settings.kind,
        colour=True,
        unit="",
        value_from=0.0,
        value_to=255.0,
        step=stored_step(255.0),
        pixel=pixel,
        placement="poses",
        model=None,
        frames=len(found.pictures),
        points=None,
        outliers=None,
        residual=None,
        predicted=None,
        chainage_from=found.placed.chainage_from,
        chainage_to=found.placed.chainage_to,
        arc_from=found.placed.arc_from,
        arc_to=found.placed.arc_to,
        source=path.name,
        warnings=found.placed.warnings,
    )
    return _Prepared(image, found.placed, partial(project_kilometre, conn, survey, found), [], [])


def _store(conn: psycopg.Connection[Any], survey: Survey, km: int, done: _Prepared, lining: Lining) -> int:
    """Write the blocks of a kilometre, and its overview; return their number."""
    image = done.image
    arcs = max(image.arc_from, lining.arc_from), min(image.arc_to, lining.arc_to)
    ends = max(image.chainage_from, lining.chainage_from), min(image.chainage_to, lining.chainage_to)
    grid = Grid.covering(km, image.pixel, *arcs, chainages=ends)
    overview = Overview(image.image_kind)
    count = 0
    for block, raster in done.blocks(km, grid):
        insert_pixels(conn, survey, km, image, overview, block, raster)
        count += 1
    insert_overview(conn, survey, km, image, overview)
    return count


def _kilometres(placed: Placed, lining: Lining) -> tuple[int, int]:
    """Return the first kilometre of the image within the lining, and one after its last."""
    low = max(placed.chainage_from, lining.chainage_from)
    high = min(placed.chainage_to, lining.chainage_to)
    return int(np.floor(low / KILOMETRE)), int(np.ceil(high / KILOMETRE))


def stored_step(greatest: float) -> float:
    """Return the size of a stored step for values up to a greatest magnitude: 1, 2 or 5 times a power of ten."""
    least = max(greatest, 1e-20) / MAX_STEPS
    decade = 10.0 ** np.floor(np.log10(least))
    return float(next(f"{factor * decade:.6g}" for factor in (1, 2, 5, 10) if factor * decade >= least * (1 - 1e-9)))


def _of_values(settings: ImportSettings, bands: int, low: float, high: float) -> list[str]:
    """Return warnings about values that do not suit the kind."""
    if bands == 3 and settings.kind != "photo":
        return [f"it has colours, not values of kind {settings.kind}: it is shown, not measured"]
    if settings.kind == "thermal" and settings.unit is None and (low < -100.0 or high > 1000.0):
        return [f"its values, {low:g} to {high:g}, are no °C: give --scale and --offset, or --unit"]
    return []


def _value_range(path: Path, sources: Sequence[Any], progress: _Progress) -> tuple[float, float]:
    advance = progress("values", len(sources))
    low, high = np.inf, -np.inf
    for source in sources:
        least, greatest = source.value_range()
        low, high = min(low, least), max(high, greatest)
        advance(1)
    if not low <= high:
        raise InputError(f"{path}: the image has no values")
    return low, high


def _checked_pixel(pixel: float, given: bool, placed: Placed, lining: Lining) -> float:
    """Return the side of a pixel, m, by which a block is not too large.

    Raises
    ------
    InputError
        If the given side is too small, or does not divide a block.
    """
    width = min(placed.arc_to, lining.arc_to) - max(placed.arc_from, lining.arc_from)

    def fits(side: float) -> bool:
        return BLOCK / side * (width / side + 2) <= MAX_BLOCK

    if not given:
        return next(side for side in PIXELS if side >= pixel and (fits(side) or side == PIXELS[-1]))
    if not 0.002 <= pixel <= 5.0 or abs(BLOCK / pixel - round(BLOCK / pixel)) > 1e-6:
        raise InputError(
            f"--pixel {pixel:g}: it must be 0.002 m to 5 m and divide 50 m, as {', '.join(f'{p:g}' for p in PIXELS)}"
        )
    if not fits(pixel):
        least = next(side for side in PIXELS if fits(side))
        raise InputError(f"--pixel {pixel:g}: it must be at least {least:g} for an image {width:.1f} m wide")
    return pixel
