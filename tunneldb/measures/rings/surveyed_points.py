"""Read surveyed points and the design axis of rings, and check them as a whole."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tunneldb.arrays import Float
from tunneldb.csvfile import CsvTable, read_csv, read_texts
from tunneldb.errors import UserError
from tunneldb.shape.axis import DesignAxis

MAX_OFFSET = 1.0
"""Maximum distance of prisms from the lining, m."""

_UNITS = {1000.0: "millimetres", 100.0: "centimetres", 3.2808: "feet"}
_STRETCH = 0.01  # of the axis: chainage in plan against its vertices; a grade of 14 % along the slope


@dataclass(frozen=True)
class SurveyedRing:
    """Points of one ring as they were surveyed.

    Attributes
    ----------
    name : str
        Name in the file.
    points : tuple of str
        Names of its points.
    xyz : (n, 3) float array
        m.
    offset : (n,) float array
        Distance of each point from the lining, m.
    remarks : tuple of str
        Points left out.
    refused : str or None
        Why nothing can be made of it.
    """

    name: str
    points: tuple[str, ...]
    xyz: Float
    offset: Float
    remarks: tuple[str, ...] = ()
    refused: str | None = None


def read_points(path: Path) -> list[SurveyedRing]:
    """Read the points of rings, in the order in which the file has the rings.

    Raises
    ------
    UserError
        If the file cannot be read, has no such column or no point, or an offset is implausible in metres.
    """
    hint = dict.fromkeys(("x", "y", "z"), "required are ring,point,x,y,z and perhaps offset")
    table = read_csv(path, ("x", "y", "z", "offset"), {"offset": 0.0}, hint)
    rings, points = read_texts(path, "ring"), read_texts(path, "point")
    if not len(table):
        raise UserError(f"{path} has no point")
    far = np.flatnonzero(np.abs(table["offset"]) > MAX_OFFSET)
    if len(far):
        row = int(far[0])
        raise table.error(
            row, f"offset is {table['offset'][row]:g}, too far from the lining for a prism; offsets are in metres"
        )
    rows: dict[str, list[int]] = {}
    for row, name in enumerate(rings):
        rows.setdefault(name, []).append(row)
    return [_ring(name, [points[row] for row in where], table, where) for name, where in rows.items()]


def _ring(name: str, points: Sequence[str], table: CsvTable, rows: Sequence[int]) -> SurveyedRing:
    """Return a ring without duplicate points; refuse a name with two places."""
    xyz, offset = table.columns(("x", "y", "z"))[rows], table["offset"][rows]
    kept: list[int] = []
    remarks: list[str] = []
    refused = None
    for k, point in enumerate(points):
        same_name = next((j for j in kept if points[j] == point), None)
        same_place = next((j for j in kept if (xyz[j] == xyz[k]).all()), None)
        if same_name is not None and same_place != same_name:
            refused = f"point {point} occurs twice, at different places"
            break
        if same_place is not None:
            twice = (
                f"point {point} occurs twice"
                if same_name is not None
                else f"points {points[same_place]} and {point} are at one place"
            )
            remarks.append(f"{twice}: counted once")
            continue
        kept.append(k)
    names = tuple(points[k] for k in kept)
    return SurveyedRing(name, names, xyz[kept], offset[kept], tuple(remarks), refused)


def read_axis(path: Path) -> DesignAxis:
    """Read a design axis of vertices with chainages.

    Raises
    ------
    UserError
        If the file cannot be read, chainage does not increase, or the distance of vertices contradicts it.
    """
    table = read_csv(path, ("chainage", "x", "y", "z"))
    if len(table) < 2:
        raise UserError(f"{path}: an axis needs at least 2 points, this one has {len(table)}")
    table.require_growing("chainage")
    xyz, chainage = table.columns(("x", "y", "z")), table["chainage"]
    length = np.hypot(*np.diff(xyz[:, :2], axis=0).T)
    standing = np.flatnonzero(length == 0.0)
    if len(standing):
        raise table.error(int(standing[0]) + 1, "the same x,y as the point before; remove one of them")
    ratio = length / np.diff(chainage)
    usual = float(np.median(ratio))
    if abs(usual - 1.0) > _STRETCH:
        raise UserError(
            f"{path}: for 1 m of chainage, the axis is {usual:.4g} long in plan{_unit(usual)}; all must be metres, "
            "chainage in plan"
        )
    far = np.flatnonzero(length > (1.0 + _STRETCH) * np.diff(chainage) + 1.0)
    if len(far):
        raise table.error(
            int(far[0]) + 1,
            f"{length[far[0]]:.3f} m from the previous point in plan, but chainage grows by {np.diff(chainage)[far[0]]:.3f} m",
        )
    return DesignAxis(xyz, chainage)


def require_size(path: Path, radii: Float, diameter: float) -> None:
    """Raise a UserError if most rings have another size: another unit, or a radius given as diameter."""
    ratio = float(np.median(radii)) / (diameter / 2.0) if len(radii) else 1.0
    if 0.8 < ratio < 1.25:
        return
    hint = _unit(ratio) or "; all must be metres"
    if 0.4 < ratio < 0.6 or 1.6 < ratio < 2.5:
        hint = f": is {diameter:g} m {'twice the diameter' if ratio < 1.0 else 'the radius'}?"
    measured = f"half of the rings have a diameter of {diameter * ratio:.4g} and more"
    raise UserError(f"{path}: {measured}, --diameter is {diameter:g} m{hint}")


def require_near(path: Path, distance: Float, limit: float) -> None:
    """Raise a UserError if most rings are farther from the axis than a limit, m."""
    middle = float(np.median(distance))
    if middle > limit:
        asked = "check that it is the axis of this tunnel, in the same system, with x and y in the same order"
        raise UserError(f"{path}: half of the rings are {middle:.4g} m or more from the axis: {asked}")


def _unit(ratio: float) -> str:
    """Return a hint at the unit of a length that is wrong by this factor; empty without one."""
    found = [name for factor, name in _UNITS.items() if abs(ratio / factor - 1.0) < 0.2]
    return f": are the points in {found[0]}?" if found else ""
