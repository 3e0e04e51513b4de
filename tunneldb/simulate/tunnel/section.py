"""Cross-sections of synthetic tunnels, with an exact arc-length parametrisation.

A section is symmetric, convex and closed. Its right half is a chain of circular arcs and straight lines from the
crown, clockwise, to the middle of the floor. Coordinates are (u, w): to the right and upward from the axis, m.
Arc is measured from the crown, positive to the right; at the middle of the floor it ends with plus or minus half
the perimeter.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float
from tunneldb.compiled import inner, kernel
from tunneldb.errors import UserError

LINE, ARC = 0.0, 1.0
# Columns of a primitive: kind, arc at its start, length, then
#   line: u, w of its start, unit direction u, w
#   arc:  u, w of its centre, radius, angle at its start (clockwise from up)
# Centres of arcs lie on the axis of symmetry, so that angles of the right half run from 0 to pi.


@inner
def nearest(parts: Float, u: float, w: float) -> tuple[float, float, float, float]:
    """Return the nearest point of a section: arc, offset (positive inside) and the gradient (u, w) of the offset.

    In the interior of a convex section the nearest point is never a corner, so the side of a point follows from the normal at
    the nearest point of the nearest part.
    """
    side = 1.0 if u >= 0.0 else -1.0
    a = abs(u)
    best = 1e300
    arc = 0.0
    offset = 0.0
    gu = 0.0
    gw = 0.0
    for i in range(parts.shape[0]):
        length = parts[i, 2]
        if parts[i, 0] == LINE:
            eu, ew = parts[i, 5], parts[i, 6]
            along = (a - parts[i, 3]) * eu + (w - parts[i, 4]) * ew
            along = min(max(along, 0.0), length)
            qu = parts[i, 3] + along * eu
            qw = parts[i, 4] + along * ew
            nu, nw = ew, -eu
        else:
            radius = parts[i, 5]
            du, dw = a - parts[i, 3], w - parts[i, 4]
            angle = math.atan2(du, dw)
            along = min(max((angle - parts[i, 6]) * radius, 0.0), length)
            angle = parts[i, 6] + along / radius
            nu, nw = -math.sin(angle), -math.cos(angle)
            qu = parts[i, 3] - radius * nu
            qw = parts[i, 4] - radius * nw
        pu, pw = a - qu, w - qw
        square = pu * pu + pw * pw
        if square < best:
            best = square
            arc = parts[i, 1] + along
            distance = math.sqrt(square)
            inside = pu * nu + pw * nw >= 0.0
            if distance < 1e-6:
                offset = pu * nu + pw * nw
                gu, gw = nu, nw
            elif inside:
                offset = distance
                gu, gw = pu / distance, pw / distance
            else:
                offset = -distance
                gu, gw = -pu / distance, -pw / distance
    return side * arc, offset, side * gu, gw


@kernel
def _points(parts: Float, arc: Float, out: Float) -> None:
    """Write positions (u, w) and inward unit normals (u, w) of a section at arcs (n,) into ``out`` (4, n)."""
    for k in range(arc.shape[0]):
        side = 1.0 if arc[k] >= 0.0 else -1.0
        a = abs(arc[k])
        i = 0
        while i + 1 < parts.shape[0] and a >= parts[i + 1, 1]:
            i += 1
        along = a - parts[i, 1]
        if parts[i, 0] == LINE:
            nu, nw = parts[i, 6], -parts[i, 5]
            u = parts[i, 3] + along * parts[i, 5]
            w = parts[i, 4] + along * parts[i, 6]
        else:
            angle = parts[i, 6] + along / parts[i, 5]
            nu, nw = -math.sin(angle), -math.cos(angle)
            u = parts[i, 3] - parts[i, 5] * nu
            w = parts[i, 4] - parts[i, 5] * nw
        out[0, k] = side * u
        out[1, k] = w
        out[2, k] = side * nu
        out[3, k] = nw


@dataclass(frozen=True)
class Section:
    """Cross-section of a tunnel.

    Attributes
    ----------
    name : str
        circular, horseshoe or box.
    parts : (m, 7) array
        Right half, crown to middle of the floor.
    half_perimeter : float
        Arc at the middle of the floor, m.
    floor_arc : float
        Arc of the corner between wall and floor, m; greater arcs are on the floor.
    floor : float
        Height w of the floor, m (negative: below the axis).
    half_width : float
        Half the width of the floor, m.
    """

    name: str
    parts: Float
    half_perimeter: float
    floor_arc: float
    floor: float
    half_width: float

    def point(self, arc: Float) -> tuple[Float, Float]:
        """Return positions (n, 2) and inward unit normals (n, 2) in (u, w) at arcs (n,)."""
        a = np.ascontiguousarray(np.atleast_1d(arc), dtype=np.float64)
        out = np.empty((4, a.size))
        _points(self.parts, a, out)
        return out[:2].T, out[2:].T

    def project(self, u: Float, w: Float) -> tuple[Float, Float, Float]:
        """Return arc (n,), offset (n,) (positive inside) and gradient of the offset (n, 2) of a few points (u, w)."""
        # Interpreted: many points use compiled loops instead.
        rows = [nearest.py_func(self.parts, a, b) for a, b in zip(np.atleast_1d(u), np.atleast_1d(w), strict=True)]
        out = np.array(rows).reshape(-1, 4)
        return out[:, 0], out[:, 1], out[:, 2:]


def _assemble(name: str, pieces: list[tuple[float, ...]], floor: float, half_width: float) -> Section:
    """Assign arcs to the pieces (kind, length, ...) and close with the floor, to the middle."""
    pieces = [p for p in pieces if p[1] > 0.0]
    pieces.append((LINE, half_width, half_width, floor, -1.0, 0.0))
    arc, rows = 0.0, []
    for kind, length, *rest in pieces:
        rows.append([kind, arc, length, *rest])
        arc += length
    return Section(name, np.array(rows), arc, arc - half_width, floor, half_width)


def circular(radius: float = 4.0, invert: float = 2.8) -> Section:
    """Return a circle with a flat invert ``invert`` m below its centre; the axis is the circle's centre."""
    if not 0.0 < radius <= 20.0:
        raise UserError(f"radius of the section is {radius:g} m: give more than 0 and up to 20 m")
    if not 0.0 < invert < radius:
        raise UserError(f"invert is {invert:g} m below the centre: give a depth between 0 and {radius:g} m")
    corner = math.pi - math.acos(invert / radius)
    half_width = math.sqrt(radius**2 - invert**2)
    return _assemble("circular", [(ARC, radius * corner, 0.0, 0.0, radius, 0.0)], -invert, half_width)


def horseshoe(radius: float = 4.0, wall: float = 3.0, inclination: float = 0.0) -> Section:
    """Return an arch of one radius over straight walls of height ``wall`` and a flat floor; the axis is at mid height.

    ``inclination`` (degrees) leans the walls inwards towards the floor; the arch then continues below its centre by that
    angle, so that arch and wall meet with a common tangent.
    """
    if not 0.0 < radius <= 20.0:
        raise UserError(f"radius of the arch is {radius:g} m: give more than 0 and up to 20 m")
    if not 0.0 <= inclination <= 30.0:
        raise UserError(f"walls lean by {inclination:g} degrees: give 0 to 30")
    lean = math.radians(inclination)
    end = 0.5 * math.pi + lean
    start_u, start_w = radius * math.sin(end), radius * math.cos(end)
    length = wall / math.cos(lean)
    half_width = start_u - length * math.sin(lean)
    if wall <= 0.0 or half_width < 0.3 * radius:
        raise UserError(f"walls of {wall:g} m height leave a floor of {2 * half_width:g} m: change wall height")
    floor = start_w - wall
    middle = 0.5 * (radius + floor)
    return _assemble(
        "horseshoe",
        [
            (ARC, radius * end, 0.0, -middle, radius, 0.0),
            (LINE, length, start_u, start_w - middle, -math.sin(lean), -math.cos(lean)),
        ],
        floor - middle,
        half_width,
    )


def box(width: float = 8.0, height: float = 6.0) -> Section:
    """Return a rectangle with sharp corners; the axis is its centre."""
    for what, value in (("width", width), ("height", height)):
        if not 1.0 <= value <= 40.0:
            raise UserError(f"{what} of the box is {value:g} m: give 1 to 40 m")
    a, h = 0.5 * width, 0.5 * height
    return _assemble("box", [(LINE, a, 0.0, h, 1.0, 0.0), (LINE, height, a, h, 0.0, -1.0)], -h, a)
