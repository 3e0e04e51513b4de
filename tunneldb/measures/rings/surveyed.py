"""Rings from points of a total station (``rings --points``): read, fit, compare with the design axis. No database."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tunneldb.arrays import Float
from tunneldb.counted import counted
from tunneldb.errors import UserError
from tunneldb.measures.rings.surveyed_points import SurveyedRing, read_axis, read_points, require_near, require_size
from tunneldb.shape.axis import DesignAxis
from tunneldb.shape.plane import OFF_PLANE_LIMIT
from tunneldb.shape.rings import MIN_POINTS, Ring, RingPoints, fit_rings

MAX_TURN = 10.0
"""Maximum angle of a ring's plane to the axis, °."""

OTHER_SIZE = 0.1
"""Deviation of a ring's radius from the design's, as a share, from which there is a remark."""

_NOTED_SAGITTA = 0.001  # m


@dataclass(frozen=True)
class Placed:
    """Value with its standard error, m or °."""

    value: float
    se: float


@dataclass(frozen=True)
class RingPlace:
    """Position of a ring relative to the design axis.

    Attributes
    ----------
    chainage, right, up : Placed
        Place of the centre along the axis, and its deviations from it, m.
    turn_right, turn_up : Placed
        Turn of the plane from across the axis: its up-chainage direction turned to the right, or upwards, °.
    """

    chainage: Placed
    right: Placed
    up: Placed
    turn_right: Placed
    turn_up: Placed


@dataclass(frozen=True)
class RingRow:
    """Result of one ring.

    Attributes
    ----------
    name : str
        Its name in the file.
    points : tuple of str
        Names of its points, those counted twice left out.
    ring : Ring or None
        Shape; None without one.
    place : RingPlace or None
        None without a ring, or without an axis beside it.
    remarks : tuple of str
        Remarks on it.
    """

    name: str
    points: tuple[str, ...]
    ring: Ring | None
    place: RingPlace | None
    remarks: tuple[str, ...]


@dataclass(frozen=True)
class SurveyedRings:
    """Results of the rings of a file.

    Attributes
    ----------
    rows : list of RingRow
        In the order of the file.
    diameter : float
        Design diameter, m.
    sigma : float or None
        Standard deviation of a point that was used, m.
    sigma_given : bool
        True if that was given; else it is estimated from all rings.
    notes : tuple of str
        Remarks on all of them.
    """

    rows: list[RingRow]
    diameter: float
    sigma: float | None
    sigma_given: bool
    notes: tuple[str, ...] = field(default=())


def measure_rings(points: Path, axis: Path, diameter: float, sigma: float | None = None, orders: int = 3) -> SurveyedRings:
    """Measure rings from points of a total station.

    Parameters
    ----------
    points, axis
        CSV files: ring,point,x,y,z and perhaps offset; chainage,x,y,z.
    diameter : float
        Inner diameter of the design, m.
    sigma : float, optional
        Standard deviation of a point, m; None: estimated from all rings.
    orders : int
        Harmonics of the radius that are wanted.

    Raises
    ------
    UserError
        If a file cannot be read, or all results would be wrong.
    """
    line, surveyed = read_axis(axis), read_points(points)
    middle = np.array([np.median(ring.xyz, axis=0) for ring in surveyed])
    chainage, right, up = line.place(middle)
    radii = [np.median(np.linalg.norm(ring.xyz - at, axis=1)) for ring, at in zip(surveyed, middle, strict=True)]
    require_size(
        points, np.array([r for r, ring in zip(radii, surveyed, strict=True) if len(ring.xyz) >= MIN_POINTS]), diameter
    )
    away = np.hypot(
        np.hypot(right, up), np.maximum(line.chainage[0] - chainage, 0) + np.maximum(chainage - line.chainage[-1], 0)
    )
    require_near(points, away, diameter)
    ahead = line.tangent(chainage)
    results: list[Ring | str | None] = [_refusal(ring, far, diameter) for ring, far in zip(surveyed, away, strict=True)]
    good = [k for k, refused in enumerate(results) if refused is None]
    fitted, found = fit_rings([RingPoints(surveyed[k].xyz, ahead[k], surveyed[k].offset) for k in good], sigma, orders)
    for k, ring in zip(good, fitted, strict=True):
        results[k] = ring
    rows = [_row(ring, result, line, diameter) for ring, result in zip(surveyed, results, strict=True)]
    if not any(row.ring for row in rows):
        raise UserError(f"{points}: no ring could be fitted; ring {rows[0].name}: {rows[0].remarks[-1]}")
    return SurveyedRings(rows, diameter, found, sigma is not None, tuple(_notes(line, found)))


def _refusal(ring: SurveyedRing, away: float, diameter: float) -> str | None:
    """Return why a ring cannot be fitted; None if it can."""
    if ring.refused is not None:
        return ring.refused
    if len(ring.xyz) < MIN_POINTS:
        return f"only {counted(len(ring.xyz), 'point')}; a ring needs {MIN_POINTS}"
    return f"the points are {away:.1f} m from the axis" if away > diameter else None


def _row(surveyed: SurveyedRing, ring: Ring | str | None, line: DesignAxis, diameter: float) -> RingRow:
    remarks = list(surveyed.remarks)
    if not isinstance(ring, Ring):
        return RingRow(surveyed.name, surveyed.points, None, None, (*remarks, ring or ""))
    (chainage,), _, _ = line.place(ring.centre[None])
    tangent = line.tangent(np.array([chainage]))[0]
    turn = np.degrees(np.arccos(min(1.0, abs(float(ring.plane.normal @ tangent)))))
    if turn > MAX_TURN:
        askew = f"the points' plane is {turn:.0f}° askew to the axis: check that they are of one ring"
        return RingRow(surveyed.name, surveyed.points, None, None, (*remarks, askew))
    remarks += _remarks(surveyed, ring, diameter)
    place = _place(ring, line, tangent) if line.covers(chainage) else None
    if place is None:
        remarks.append("the ring is beyond the axis: no chainage, no deviation")
    return RingRow(surveyed.name, surveyed.points, ring, place, tuple(remarks))


def _place(ring: Ring, line: DesignAxis, tangent: Float) -> RingPlace:
    """Return chainage, deviations and turns with their standard errors."""
    along = np.array([tangent[0], tangent[1], 0.0]) / np.hypot(tangent[0], tangent[1])
    grade = tangent[2] / np.hypot(tangent[0], tangent[1])
    # Up is above the axis at the centre's own chainage, which is as uncertain as the grade is steep.
    ways = (along, np.array([along[1], -along[0], 0.0]), np.array([0.0, 0.0, 1.0]) - grade * along)
    spreads = (float(np.sqrt(way @ ring.centre_covariance @ way)) for way in ways)
    values = (float(value[0]) for value in line.place(ring.centre[None]))
    chainage, right, up = (Placed(value, se) for value, se in zip(values, spreads, strict=True))
    return RingPlace(chainage, right, up, *_turns(ring, tangent))


def _turns(ring: Ring, tangent: Float) -> tuple[Placed, Placed]:
    """Return the turn of the ring's plane against the axis, to the right and upwards."""
    normal = ring.plane.normal
    plan = np.arctan2(normal[0], normal[1]) - np.arctan2(tangent[0], tangent[1])
    right = np.degrees((plan + np.pi) % (2.0 * np.pi) - np.pi)
    up = np.degrees(np.arcsin(normal[2]) - np.arcsin(tangent[2]))
    se = float(np.degrees(ring.plane.spread / (ring.adjustment.ellipse.radius * np.sqrt(max(len(ring.along), 1) / 2.0))))
    return Placed(float(right), se), Placed(float(up), se)


def _remarks(surveyed: SurveyedRing, ring: Ring, diameter: float) -> Iterator[str]:
    adjustment = ring.adjustment
    shape = "ellipse" if ring.is_ellipse else "circle"
    for k in np.flatnonzero(~ring.used):
        off = adjustment.distance[k]
        side = "outside" if off > 0.0 else "inside"
        yield f"point {surveyed.points[k]} rejected: {1e3 * abs(off):.1f} mm {side} the {shape} through the others"
    for k in np.flatnonzero(np.abs(ring.along) > OFF_PLANE_LIMIT):
        off = 1e3 * abs(ring.along[k])
        yield f"point {surveyed.points[k]} is {off:.0f} mm along the tunnel from the plane of the others"
    if not ring.is_ellipse:
        why = f"{int(ring.used.sum())} points" if len(ring.used) <= MIN_POINTS else f"a gap of {ring.gap:.0f}° between points"
        yield f"ellipse not determined ({why}): centre and radius are from a circle and biased if the ring is oval"
    ratio = adjustment.ellipse.radius / (diameter / 2.0)
    if abs(ratio - 1.0) > OTHER_SIZE:
        yield f"the radius is {100.0 * abs(ratio - 1.0):.0f} % {'more' if ratio > 1.0 else 'less'} than the design's"


def _notes(line: DesignAxis, sigma: float | None) -> Iterator[str]:
    if line.sagitta > _NOTED_SAGITTA:
        yield (
            f"the axis is straight between its vertices; on its curves the error is up to {1e3 * line.sagitta:.0f} mm: "
            "give vertices at smaller distances"
        )
    if sigma is None:
        yield "too few rings to estimate the accuracy of points: only gross errors are found; give it with --sigma"
