"""Images of other instruments into the unrolled plane of a survey: whole, or not at all."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import psycopg

from tunneldb.arrays import Float
from tunneldb.counted import counted
from tunneldb.errors import InputError
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.pipeline.image_files import Controls, ImageFile, open_image, own_controls, read_controls, read_frames
from tunneldb.raster.grid import BLOCK, Grid
from tunneldb.raster.overview import Overview
from tunneldb.raster.placement.checks import Lining, Placed, check_extent, check_fit, check_placement, scale_error
from tunneldb.raster.placement.control import ControlFit, fit_control
from tunneldb.raster.placement.mapping import AffineMapping, pixel_sides
from tunneldb.raster.placement.resample import PIXELS, Frame, resample, usual_pixel
from tunneldb.store.imported_images import ImportedImage, insert_overviews, insert_pixels, replace_imported, section_extent
from tunneldb.store.survey import Survey

UNITS = {"thermal": "°C", "photo": "", "radar": "", "moisture": "%", "other": ""}
"""Kinds of imported images, and the unit of one whose file states none."""

TABLES = (".csv", ".txt")
"""Extensions of tables of frames."""

MAX_FRAME_STRETCH = 0.1
"""Ratio of the sides of a frame's pixels, minus 1, from which there is a warning."""

MAX_BLOCK = 10**8
"""Maximum number of pixels of a block."""

MAX_STEPS = 32000
"""Number of steps from 0 to the greatest value that are stored."""


@dataclass(frozen=True)
class ImportSettings:
    """How an image is imported.

    Attributes
    ----------
    name, kind : str
    points : Path, optional
        File of control points.
    pixel : float, optional
        Side of a pixel, m.
    unit : str, optional
        In place of the unit that the file states.
    band : int, optional
        Band of the file.
    scale, offset : float, optional
        Value of a stored number n: scale n + offset.
    """

    name: str
    kind: str
    points: Path | None = None
    pixel: float | None = None
    unit: str | None = None
    band: int | None = None
    scale: float | None = None
    offset: float | None = None


@dataclass(frozen=True)
class ControlPoint:
    """Control point with its residual, given minus fitted place, m."""

    name: str
    column: float
    row: float
    chainage: float
    arc: float
    chainage_residual: float
    arc_residual: float
    used: bool


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


@dataclass
class Placement:
    """Frames of an image with their extent.

    Attributes
    ----------
    frames : list of Frame
    placed : Placed
        Extent with warnings.
    way : str
        coordinates, points or frames.
    fit : ControlFit, optional
    points : list of ControlPoint
    notes : list of str
        Remarks about the control points.
    """

    frames: list[Frame]
    placed: Placed
    way: str
    fit: ControlFit | None = None
    points: list[ControlPoint] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def import_image(
    conn: psycopg.Connection[Any],
    survey: Survey,
    path: Path,
    settings: ImportSettings,
    progress: Callable[[str, float | None], Callable[[float], None]],
) -> ImportedResult:
    """Import an image, or a table of images, in one transaction; replaces the image of that name.

    Raises
    ------
    UserError
        If a file cannot be read, or the image cannot be placed in the survey.
    """
    lining = Lining(*section_extent(conn, survey))
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
    replaced = replace_imported(conn, survey, image)
    blocks = 0
    found = []
    kilometres = range(*_kilometres(done.placed, lining))
    advance = progress("image", len(kilometres))
    for km in kilometres:
        stored = _store(conn, survey, km, image, done.frames, lining)
        found += [km] if stored else []
        blocks += stored
        advance(1)
    if not blocks:
        raise InputError(f"{path}: the image has no values within the lining of survey {survey.name}")
    conn.commit()
    return ImportedResult(image, replaced, found, blocks, done.points, done.notes)


def _store(
    conn: psycopg.Connection[Any], survey: Survey, km: int, image: ImportedImage, frames: Sequence[Frame], lining: Lining
) -> int:
    """Write the blocks of a kilometre, and its overview; return their number."""
    arcs = max(image.arc_from, lining.arc_from), min(image.arc_to, lining.arc_to)
    ends = max(image.chainage_from, lining.chainage_from), min(image.chainage_to, lining.chainage_to)
    grid = Grid.covering(km, image.pixel, *arcs, chainages=ends)
    overviews = [Overview(kind) for kind in image.image_kinds]
    count = 0
    for block, bands in resample(frames, grid):
        insert_pixels(conn, survey, km, image, overviews, block, bands)
        count += 1
    insert_overviews(conn, survey, km, image, overviews)
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


def _value_range(
    path: Path, sources: Sequence[Any], progress: Callable[[str, float | None], Callable[[float], None]]
) -> tuple[float, float]:
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


def place_image(
    conn: psycopg.Connection[Any], survey: Survey, path: Path, settings: ImportSettings, lining: Lining
) -> Placement:
    """Open an image or a table of frames, and place it in the unrolled plane.

    Raises
    ------
    InputError
        If a file cannot be read, or the image does not fit the survey.
    """
    if path.suffix.lower() in TABLES:
        if settings.points is not None:
            raise InputError(f"{path} is a table of frames, which states places itself: leave out --points")
        frames = read_frames(conn, survey, path, settings.band, settings.scale, settings.offset)
        return Placement(frames, _union(frames, lining), "frames")
    image = open_image(path, settings.band, settings.scale, settings.offset)
    if settings.points is not None or (image.transform is None and image.ground):
        controls = own_controls(image) if settings.points is None else read_controls(conn, survey, settings.points, image)
        return _by_points(settings.points or path, image, controls, lining)
    if image.transform is None:
        raise InputError(
            f"{path} has no coordinates: give control points with column, row, chainage and arc (--points FILE), a world file,"
            " or a table of frames"
        )
    mapping = AffineMapping(image.transform)
    try:
        placed = check_placement(mapping, image.columns, image.rows, lining)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    return Placement([Frame(image, mapping)], placed, "coordinates")


def _union(frames: Sequence[Frame], lining: Lining) -> Placed:
    """Return the extent of frames together, with warnings."""
    each = []
    for frame in frames:
        linear, source = frame.mapping.linear, frame.source
        x = (linear.c, linear.c + linear.a * source.columns)
        y = (linear.f, linear.f + linear.e * source.rows)
        each.append((min(x), max(x), min(y), max(y)))
    west, east, low, high = np.array(each).T
    placed = Placed(float(west.min()), float(east.max()), float(low.min()), float(high.max()))
    check_extent(placed, lining)
    outside = (east <= lining.chainage_from) | (west >= lining.chainage_to) | (high <= lining.arc_from) | (low >= lining.arc_to)
    if outside.any():
        placed.warnings.append(f"{counted(int(outside.sum()), 'frame')} of {len(frames)} outside the survey's lining")
    ratios = [max(sides) / min(sides) - 1.0 for sides in (pixel_sides(frame.mapping) for frame in frames)]
    if max(ratios) > MAX_FRAME_STRETCH:
        placed.warnings.append(
            f"pixels of a frame differ by up to {100 * max(ratios):.0f} % along and around the tunnel: check chainages and arcs"
        )
    return placed


def _by_points(path: Path, image: ImageFile, controls: Controls, lining: Lining) -> Placement:
    try:
        fit = fit_control(controls.pixels, controls.places)
        warnings = check_fit(fit)
        placed = check_placement(fit.mapping, image.columns, image.rows, lining)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    points = [
        _control_point(name, controls.pixels[k], controls.places[k], fit.residuals[k], bool(fit.outliers[k]))
        for k, name in enumerate(controls.names)
    ]
    notes = [
        f"control point {point.name} is not used: it deviates by {point.chainage_residual:+.3f} m along and"
        f" {point.arc_residual:+.3f} m around the tunnel"
        for point in points
        if not point.used
    ]
    if image.transform is not None:
        scale, along, around = scale_error(AffineMapping(image.transform), fit.mapping, image.columns, image.rows)
        if np.isfinite([scale, along, around]).all() and abs(scale) < 0.5 and max(abs(along), abs(around)) < 100.0:
            length = "long" if scale > 0 else "short"
            notes.append(
                f"by its own coordinates the image is {abs(100 * scale):.2f} % too {length}, and its start is off by"
                f" {along:+.3f} m along and {around:+.3f} m around the tunnel"
            )
    placed.warnings.extend(warnings)
    return Placement([Frame(image, fit.mapping)], placed, "points", fit, points, notes)


def _control_point(name: str, pixel: Float, place: Float, residual: Float, outlier: bool) -> ControlPoint:
    (column, row), (chainage, arc), (along, around) = (each.tolist() for each in (pixel, place, residual))
    return ControlPoint(name, column, row, chainage, arc, along, around, not outlier)
