"""Place an image in the unrolled plane: by its own coordinates, by control points, or by a table of frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import psycopg

from tunneldb.arrays import Float
from tunneldb.counted import counted
from tunneldb.errors import InputError
from tunneldb.pipeline.image_files import Controls, ImageFile, open_image, own_controls, read_controls, read_frames
from tunneldb.raster.placement.checks import Lining, Placed, check_extent, check_fit, check_placement, scale_error
from tunneldb.raster.placement.control import ControlFit, fit_control
from tunneldb.raster.placement.mapping import AffineMapping, pixel_sides
from tunneldb.raster.placement.resample import Frame
from tunneldb.store.survey import Survey

TABLES = (".csv", ".txt")
"""Extensions of tables of frames."""

MAX_FRAME_STRETCH = 0.1
"""Ratio of the sides of a frame's pixels, minus 1, from which there is a warning."""


@dataclass(frozen=True)
class ImportSettings:
    """Settings of an import.

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
