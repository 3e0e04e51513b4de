"""Checks of an image's placement in the unrolled plane of a survey."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from tunneldb.errors import InputError
from tunneldb.raster.placement.control import ControlFit
from tunneldb.raster.placement.mapping import Mapping, outline, pixel_sides

MAX_STRETCH = 0.03
"""Ratio of a pixel's sides, minus 1, from which the placement by control points gets a warning."""

MAX_DISTORTION = 0.25
"""The same from which it is refused if no redundant points confirm it; also the maximum shear, rad."""

MAX_TURN = np.radians(2.0)
"""Angle between the image's edges and the tunnel's axis, from which the placement gets a warning."""

SLACK = 0.25
"""Length that an image may exceed the survey's lining by, m, without a warning."""

SEAM_SHIFT, SEAM_WIDTH = 0.25, 0.15
"""Minimum shift of an image whose seam is at the wrong side, and maximum difference of its width, as shares of the lining's."""

MAX_RESIDUAL, MAX_RESIDUAL_PIXELS = 0.1, 3.0
"""Residual of control points from which the placement gets a warning, m, and its minimum in pixels."""

MAX_ERROR = 1.0
"""Residual of control points from which the placement is refused, m."""


@dataclass(frozen=True)
class Lining:
    """Extent of a survey's lining in the unrolled plane, m."""

    chainage_from: float
    chainage_to: float
    arc_from: float
    arc_to: float

    @property
    def width(self) -> float:
        """Extent around the section, m."""
        return self.arc_to - self.arc_from


@dataclass(frozen=True)
class Placed:
    """Extent of a placed image, m, and warnings about it."""

    chainage_from: float
    chainage_to: float
    arc_from: float
    arc_to: float
    warnings: list[str] = field(default_factory=list)


def check_placement(mapping: Mapping, columns: int, rows: int, lining: Lining) -> Placed:
    """Return the extent of an image, with warnings if it does not fit the survey well.

    Raises
    ------
    InputError
        If the image is mirrored, outside the survey, or has its seam at the wrong side.
    """
    linear = mapping.linear
    if not linear.determinant < 0:
        raise InputError(
            "the image is mirrored: if its chainage grows from left to right, its arc must grow upwards; mirror it, or change"
            " the sign of the arcs (arc is positive to the right, looking up-chainage)"
        )
    chainage, arc = outline(mapping, columns, rows)
    placed = Placed(float(chainage.min()), float(chainage.max()), float(arc.min()), float(arc.max()))
    check_extent(placed, lining)
    if linear.a < 0 and abs(linear.a) > abs(linear.b):
        placed.warnings.append("the image is turned by 180°: its chainage falls from left to right")
    return placed


def check_extent(placed: Placed, lining: Lining) -> None:
    """Add warnings for an image that exceeds the survey's lining.

    Raises
    ------
    InputError
        If the image is outside the survey, or its seam is at the wrong side.
    """
    own = f"chainage {placed.chainage_from:.2f} to {placed.chainage_to:.2f} m"
    ends = f"the survey's sections are from {lining.chainage_from:.2f} to {lining.chainage_to:.2f} m"
    if placed.chainage_to <= lining.chainage_from or placed.chainage_from >= lining.chainage_to:
        raise InputError(f"the image is outside the survey: {own}; {ends}; give the chainage of the survey, in m")
    beyond = [lining.chainage_from - placed.chainage_from, placed.chainage_to - lining.chainage_to]
    if max(beyond) > SLACK:
        where = " and ".join(
            f"{over:.2f} m {side}"
            for over, side in zip(beyond, ("before its start", "after its end"), strict=True)
            if over > SLACK
        )
        placed.warnings.append(f"the image exceeds the survey by {where}: {own}; {ends}")
    width = placed.arc_to - placed.arc_from
    around = f"arc {placed.arc_from:.2f} to {placed.arc_to:.2f} m"
    limits = f"the survey's lining is from {lining.arc_from:.2f} to {lining.arc_to:.2f} m, 0 at the crown"
    shift = abs(placed.arc_from + placed.arc_to - lining.arc_from - lining.arc_to) / 2.0
    if abs(width - lining.width) < SEAM_WIDTH * lining.width and shift > SEAM_SHIFT * lining.width:
        raise InputError(
            f"the seam of the image is at the wrong side: {around}; {limits}; cut the image at the survey's seam, and join it"
            " at its own"
        )
    if placed.arc_to <= lining.arc_from or placed.arc_from >= lining.arc_to:
        raise InputError(f"the image is beside the lining: {around}; {limits}")
    over = max(lining.arc_from - placed.arc_from, placed.arc_to - lining.arc_to)
    if over > SLACK:
        placed.warnings.append(f"the image exceeds the lining by {over:.2f} m: {around}; {limits}")


def check_fit(fit: ControlFit) -> list[str]:
    """Return warnings about a placement by control points.

    Raises
    ------
    InputError
        If its residuals are too large, or the image is distorted.
    """
    along, around = pixel_sides(fit.mapping)
    pixel = min(along, around)
    if not pixel > 0:
        raise InputError("the control points give pixels without a size: check columns, rows, chainages and arcs")
    if fit.rms > MAX_ERROR:
        raise InputError(
            f"the control points contradict each other: residual {fit.rms:.2f} m; check columns, rows, chainages and arcs"
        )
    warnings = []
    if fit.rms > max(MAX_RESIDUAL, MAX_RESIDUAL_PIXELS * pixel):
        warnings.append(f"the residual of the control points is {fit.rms:.3f} m")
    if fit.model == "similarity":
        warnings.append("the control points are on one line or only two: the scale around the section is that along the tunnel")
        return warnings
    ratio = max(along, around) / pixel - 1.0
    linear = fit.mapping.linear
    shear = abs(linear.a * linear.b + linear.d * linear.e) / (along * around)
    if ratio > MAX_DISTORTION and fit.predicted is None:
        raise InputError(
            f"the control points give pixels of {1000 * along:.1f} mm along and {1000 * around:.1f} mm around the tunnel, and"
            " no further points confirm it: check them, or give more"
        )
    if ratio > MAX_STRETCH:
        warnings.append(f"pixels are {1000 * along:.1f} mm along and {1000 * around:.1f} mm around the tunnel")
    if shear > MAX_DISTORTION:
        raise InputError(
            f"the control points shear the image by {np.degrees(np.arcsin(min(shear, 1.0))):.0f}°: check columns, rows,"
            " chainages and arcs"
        )
    turn = np.arctan2(linear.d, linear.a) % (np.pi / 2)
    if min(turn, np.pi / 2 - turn) > MAX_TURN:
        warnings.append(f"the image is turned by {np.degrees(np.arctan2(linear.d, linear.a)):.1f}° against the tunnel")
    return warnings


def scale_error(stated: Mapping, fitted: Mapping, columns: int, rows: int) -> tuple[float, float, float]:
    """Compare the placement that an image states with one by control points.

    Returns
    -------
    scale : float
        Stated length along the tunnel as a share of the fitted one, minus 1.
    chainage, arc : float
        Stated minus fitted place of the middle of the image's left edge, m.
    """
    ends = np.array([0.0, float(columns)]), np.full(2, rows / 2.0)
    first, second = stated.forward(*ends), fitted.forward(*ends)
    scale = (first[0][1] - first[0][0]) / (second[0][1] - second[0][0]) - 1.0
    return float(scale), float(first[0][0] - second[0][0]), float(first[1][0] - second[1][0])


def joined(warnings: Sequence[str]) -> str | None:
    """Return warnings in one line, None without any."""
    return "; ".join(warnings) or None
