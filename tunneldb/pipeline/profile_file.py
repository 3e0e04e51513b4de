"""Reading a design profile: a CSV of vertices and radii, a drawing, or points of an outline."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely

from tunneldb.arrays import Float, Int64
from tunneldb.csvfile import read_csv
from tunneldb.csvsheet import read_text
from tunneldb.errors import UserError
from tunneldb.numerals import parse_number
from tunneldb.pipeline.profile_drawing import METRES, read_drawing
from tunneldb.shape.outline import TOLERANCE, Outline

MIN_SIZE, MAX_SIZE = 1.0, 60.0
"""Limits of an outline's width and height, m; outside them it is in another unit."""

MAX_GAP = 0.5
"""Distance of consecutive points from which an outline is open there, m."""

SIMPLIFIED = 0.02
"""Maximum deviation of points from the fitted lines of an outline, m."""


@dataclass(frozen=True)
class ReadProfile:
    """An outline as a file has it.

    Attributes
    ----------
    outline : Outline
        About the axis.
    notes : tuple of str
        Remarks on the reading.
    """

    outline: Outline
    notes: tuple[str, ...] = ()


def read_profile(
    path: Path, origin: tuple[float, float] = (0.0, 0.0), unit: str | None = None, layer: str | None = None
) -> ReadProfile:
    """Read a design profile: CSV with right,up[,radius]; DXF; or text with two columns and no header, points of an outline.

    Parameters
    ----------
    path
        File; its extension is the format: .csv, .dxf, .txt.
    origin
        Place of the axis in the file, in its own unit.
    unit
        Unit of a drawing that states none, or of points: one of METRES.
    layer
        Layer of a drawing, if several have lines.

    Raises
    ------
    UserError
        If the file cannot be read, the outline has a gap, crosses itself, has an implausible size in metres, or is away from
        the axis; with file, line or entity, and value.
    """
    suffix = path.suffix.lower()
    if suffix != ".dxf" and layer is not None:
        raise UserError(f"{path}: --drawing-layer is for a .dxf; omit it")
    if suffix == ".csv":
        if unit not in (None, "m"):
            raise UserError(f"{path}: right, up and radius of a .csv are metres, not {unit}")
        return _read_vertices(path, origin)
    if suffix == ".dxf":
        drawn = read_drawing(path, unit, layer)
        elements = drawn.elements.copy()
        elements[:, :4] -= drawn.metres * np.tile(origin, 2)
        _require_sound(path, elements, lambda k: drawn.names[k])
        return ReadProfile(_outline(elements), drawn.notes)
    if suffix == ".txt":
        return _read_points(path, origin, unit)
    raise UserError(f"{path}: a profile is a .csv, a .dxf, or a .txt of points")


def _read_vertices(path: Path, origin: tuple[float, float]) -> ReadProfile:
    """Read vertices, each with the radius of the arc to the next: positive outwards, negative inwards, 0 straight."""
    hint = dict.fromkeys(("right", "up"), "a profile has the columns right,up and perhaps radius, m")
    table = read_csv(path, ("right", "up", "radius"), {"radius": 0.0}, hint)
    if len(table) < 2:
        raise UserError(f"{path}: {len(table)} vertices make no outline")
    vertices, radius = table.columns(("right", "up")) - np.array(origin), table["radius"]
    chord = np.hypot(*np.diff(vertices, axis=0).T)
    for row in range(len(chord)):
        if chord[row] < TOLERANCE:
            raise table.error(row + 1, f"the vertex {_place(vertices[row + 1])} repeats that of the line before")
        if radius[row] != 0.0 and 2.0 * abs(radius[row]) < chord[row] * (1.0 - 1e-6):
            raise table.error(
                row, f"radius {radius[row]:g} is too small for an arc to the next vertex, {chord[row]:.4f} m away; "
                f"it takes {np.ceil(5e3 * chord[row]) / 1e4:.4f} or more, and an arc of more than half a circle two lines"
            )  # fmt: skip
    if np.hypot(*(vertices[-1] - vertices[0])) >= TOLERANCE and radius[-1] != 0.0:
        raise table.error(len(table) - 1, f"radius {radius[-1]:g} leads nowhere: this is the last vertex; 0 there")
    turned = _clockwise(vertices)
    with np.errstate(divide="ignore", invalid="ignore"):
        half = np.arcsin(np.clip(chord / (2.0 * np.abs(radius[:-1])), 0.0, 1.0))  # of the angle that the arc turns through
    bulge = np.where(radius[:-1] == 0.0, 0.0, -np.sign(radius[:-1]) * np.tan(half / 2.0)) * (1.0 if turned else -1.0)
    elements = np.column_stack([vertices[:-1], vertices[1:], bulge])
    lines: Int64 = table.lines
    _require_sound(path, elements, lambda k: f"line {lines[k]}")
    return ReadProfile(_outline(elements))


def _clockwise(vertices: Float) -> bool:
    """Return True if vertices run clockwise, or, for two, upwards or to the right, as the left half or the crown."""
    x, y = vertices.T
    area = float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum())
    if abs(area) > TOLERANCE:
        return area < 0.0
    return True


def _read_points(path: Path, origin: tuple[float, float], unit: str | None) -> ReadProfile:
    """Order points of an outline by their direction from the middle, and connect them by lines."""
    if unit is None:
        raise UserError(f"{path}: points state no unit; say it by --unit {'|'.join(METRES)}")
    try:
        lines = read_text(path).splitlines()
    except OSError as error:
        raise UserError(f"{path}: {error.strerror}") from None
    rows = []
    for number, line in enumerate(lines, start=1):
        cells = re.split(r"\s*[;,\s]\s*", line.strip(" \t\x1a"))
        if not cells[0] or cells[0].startswith("#"):
            continue
        try:
            right, up = (parse_number(cell) for cell in cells)
        except ValueError:
            comma = "; write decimals with a point" if line.count(",") > 1 else ""
            raise UserError(f"{path}, line {number}: {line.strip()[:60]!r} is not two numbers, right and up{comma}") from None
        rows.append((right, up))
    if len(rows) < 8:
        raise UserError(f"{path}: {len(rows)} points make no outline; it takes 8")
    points = np.unique(METRES[unit] * (np.array(rows) - np.array(origin)), axis=0)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2.0
    ordered = points[np.argsort(np.arctan2(*(points - middle).T))]
    ordered = np.vstack([ordered, ordered[:1]])
    steps = np.hypot(*np.diff(ordered, axis=0).T)
    gaps = np.flatnonzero(steps > max(MAX_GAP, 3.0 * float(np.percentile(steps, 90))))
    if len(gaps) > 1:
        raise UserError(
            f"{path}: points leave {len(gaps)} gaps, of {steps[gaps[0]]:.2f} m at {_place(ordered[gaps[0]])} and of "
            f"{steps[gaps[1]]:.2f} m at {_place(ordered[gaps[1]])}; one at most, the floor"
        )
    if len(gaps):
        ordered = np.roll(ordered[:-1], -(int(gaps[0]) + 1), axis=0)
    line = shapely.LineString(ordered).simplify(SIMPLIFIED)
    vertices = shapely.get_coordinates(line)
    off = float(shapely.distance(shapely.points(points), line).max())
    elements = np.column_stack([vertices[:-1], vertices[1:], np.zeros(len(vertices) - 1)])
    _require_sound(path, elements, lambda k: f"at {_place(elements[k, :2])}")
    note = (
        f"{len(points)} points, in order of their direction from the middle, are {len(elements)} lines; a point is up to "
        f"{1e3 * off:.0f} mm off them: no deviation is better than that"
    )
    return ReadProfile(_outline(elements), (note,))


def _outline(elements: Float) -> Outline:
    closed = bool(np.hypot(*(elements[-1, 2:4] - elements[0, :2])) < TOLERANCE)
    vertices = elements[:, :2] if closed else np.vstack([elements[:, :2], elements[-1:, 2:4]])
    bulges = elements[:, 4] if closed else np.append(elements[:, 4], 0.0)
    return Outline.of(vertices, bulges, closed)


def _require_sound(path: Path, elements: Float, where: Callable[[int], str]) -> None:
    """Raise a UserError for an outline of implausible size, away from the axis, or crossing itself."""
    raw = Outline(elements)
    line = raw.flattened()
    size = np.ptp(line, axis=0)
    if not (size.min() >= MIN_SIZE / 2.0 and MIN_SIZE <= size.max() <= MAX_SIZE):
        far = int(np.argmax(np.abs(elements[:, :4]).max(axis=1)))
        raise UserError(
            f"{path}, {where(far)}: {_place(elements[far, :2])} m makes an outline {size[0]:g} m wide and {size[1]:g} m high; "
            f"tunnels have {MIN_SIZE:g} to {MAX_SIZE:g} m: is it in another unit?"
        )
    if (line.min(axis=0) > 0.5 * size).any() or (line.max(axis=0) < -0.5 * size).any():
        low, high = line.min(axis=0), line.max(axis=0)
        raise UserError(
            f"{path}: the outline lies from {_place(low)} to {_place(high)} m, away from the axis at 0,0; say where the file "
            "has the axis by --origin RIGHT,UP"
        )
    if (crossed := raw.crossing()) is not None:
        first, second = crossed
        raise UserError(
            f"{path}, {where(first)}: what begins at {_place(elements[first, :2])} crosses what begins at "
            f"{_place(elements[second, :2])} ({where(second)})"
        )


def _place(point: Float) -> str:
    return ",".join(f"{value:.10g}" for value in np.round(point, 4).tolist())
