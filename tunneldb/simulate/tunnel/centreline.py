"""Centre line of a synthetic tunnel: exact position and frame at every chainage.

Plan: straight, circular and clothoid elements joined with a common tangent. Profile: constant grades joined by
parabolas. Chainage is the length in plan. The frame at a chainage is ``t`` (unit tangent up-chainage, in 3D),
``u = t x z`` normalised (horizontal, to the right) and ``w = u x t`` (upward, perpendicular to the 3D axis).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tunneldb.arrays import Float
from tunneldb.compiled import inner, kernel
from tunneldb.errors import UserError

# 8-point Gauss-Legendre rule on [0, 1]; on the clothoids used here (turning by far less than 1 rad) it is exact
# to rounding.
_GAUSS_X, _GAUSS_W = np.polynomial.legendre.leggauss(8)
_GAUSS_X = 0.5 * (_GAUSS_X + 1.0)
_GAUSS_W = 0.5 * _GAUSS_W

PLAN_COLUMNS = 6  # chainage, x, y, direction (rad from east, anticlockwise), curvature, change of curvature per m
PROFILE_COLUMNS = 4  # chainage, z, grade, change of grade per m


@inner
def axis_at(plan: Float, profile: Float, s: float) -> tuple[float, float, float, float, float, float, float, float]:
    """Return the axis at chainage ``s``: x, y, z, cos and sin of direction, curvature, grade, change of grade.

    The first and last elements continue beyond the ends.
    """
    i = 0
    while i + 1 < plan.shape[0] and s >= plan[i + 1, 0]:
        i += 1
    sigma = s - plan[i, 0]
    direction, curvature, change = plan[i, 3], plan[i, 4], plan[i, 5]
    dx = 0.0
    dy = 0.0
    if change == 0.0:
        half = 0.5 * curvature * sigma
        chord = sigma if abs(half) < 1e-12 else sigma * math.sin(half) / half
        dx = chord * math.cos(direction + half)
        dy = chord * math.sin(direction + half)
    else:
        for node in range(8):
            r = sigma * _GAUSS_X[node]
            angle = direction + r * (curvature + 0.5 * change * r)
            dx += _GAUSS_W[node] * math.cos(angle)
            dy += _GAUSS_W[node] * math.sin(angle)
        dx *= sigma
        dy *= sigma
    end = direction + sigma * (curvature + 0.5 * change * sigma)
    j = 0
    while j + 1 < profile.shape[0] and s >= profile[j + 1, 0]:
        j += 1
    h = s - profile[j, 0]
    grade, rise = profile[j, 2], profile[j, 3]
    z = profile[j, 1] + h * (grade + 0.5 * rise * h)
    k = curvature + change * sigma
    return plan[i, 1] + dx, plan[i, 2] + dy, z, math.cos(end), math.sin(end), k, grade + rise * h, rise


@kernel
def _axis(plan: Float, profile: Float, s: Float, out: Float) -> None:
    """Write the columns of :func:`axis_at` at chainages (n,) into ``out`` (8, n)."""
    for i in range(s.shape[0]):
        x, y, z, c, n, k, g, dg = axis_at(plan, profile, s[i])
        out[0, i] = x
        out[1, i] = y
        out[2, i] = z
        out[3, i] = c
        out[4, i] = n
        out[5, i] = k
        out[6, i] = g
        out[7, i] = dg


def _axis_table(plan: Float, profile: Float, s: Float) -> Float:
    out = np.empty((8, s.size))
    _axis(plan, profile, s, out)
    return out


class Frame(NamedTuple):
    """Axis position and unit vectors, each (n, 3): position, t (up-chainage), u (right), w (up)."""

    position: Float
    t: Float
    u: Float
    w: Float


@dataclass(frozen=True)
class Element:
    """Plan element: length in m, curvature at its start and end in 1/m (positive to the left)."""

    length: float
    curvature_from: float
    curvature_to: float


@dataclass(frozen=True)
class CentreLine:
    """Centre line of a tunnel; build it with :meth:`from_elements` or :meth:`curve`.

    Attributes
    ----------
    plan : (m, 6) array
        Rows: chainage, x, y, direction, curvature, change of curvature, with x and y from ``origin``.
    profile : (k, 4) array
        Rows: chainage, z, grade, change of grade, with z from ``origin``.
    origin : (3,) array
        Coordinates of the start, m; separate, so that the arithmetic uses small numbers.
    start, end : float
        Chainage of both ends, m.
    """

    plan: Float
    profile: Float
    origin: Float
    start: float
    end: float

    @classmethod
    def from_elements(
        cls,
        elements: list[Element],
        *,
        slope: float = 0.0,
        slope_end: float | None = None,
        start_chainage: float = 0.0,
        azimuth: float = 60.0,
        origin: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> CentreLine:
        """Join plan elements; grades in m/m, azimuth in degrees from north, clockwise.

        With ``slope_end`` a parabola over the middle half of the length leads from ``slope`` to it.
        """
        rows, s, x, y, direction = [], start_chainage, 0.0, 0.0, math.radians(90.0 - azimuth)
        for e in elements:
            change = (e.curvature_to - e.curvature_from) / e.length
            element = [x, y, direction, e.curvature_from, change]
            rows.append([s, *element])
            x, y = _axis_table(np.array([[0.0, *element]]), np.zeros((1, 4)), np.array([float(e.length)]))[:2, 0].tolist()
            s += e.length
            direction += 0.5 * e.length * (e.curvature_from + e.curvature_to)
        length = s - start_chainage
        if slope_end is None or slope_end == slope:
            profile = [[start_chainage, 0.0, slope, 0.0]]
        else:
            quarter, half = 0.25 * length, 0.5 * length
            profile = [
                [start_chainage, 0.0, slope, 0.0],
                [start_chainage + quarter, slope * quarter, slope, (slope_end - slope) / half],
                [
                    start_chainage + quarter + half,
                    slope * quarter + 0.5 * (slope + slope_end) * half,
                    slope_end,
                    0.0,
                ],
            ]
        return cls(np.array(rows), np.array(profile), np.array(origin, dtype=float), start_chainage, s)

    @classmethod
    def curve(
        cls,
        length: float,
        radius: float,
        *,
        straight: float | None = None,
        transition: float = 0.0,
        s_curve: bool = False,
        slope: float = 0.0,
        slope_end: float | None = None,
        start_chainage: float = 0.0,
        azimuth: float = 60.0,
        origin: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> CentreLine:
        """Return a straight of ``straight`` m (default a fifth of the length), then an arc to the end.

        Parameters
        ----------
        radius : float
            m; positive bends to the right, negative to the left, 0 is straight throughout.
        transition : float
            Length of the clothoid between straight and arc (and, in an S-curve, between the two arcs), m.
        s_curve : bool
            True to bend one way for half of the curved length, then the other way.
        """
        lead = 0.2 * length if straight is None else straight
        curved = length - lead - transition * (2 if s_curve else 1)
        if radius and curved <= 0:
            raise UserError(
                f"straight ({lead:g} m) and transitions ({transition:g} m) leave no arc in {length:g} m of tunnel:"
                " shorten them or lengthen the tunnel"
            )
        if radius == 0:
            elements = [Element(length, 0.0, 0.0)]
        else:
            k = -1.0 / radius
            parts = [Element(lead, 0.0, 0.0), Element(transition, 0.0, k)]
            if s_curve:
                parts += [
                    Element(0.5 * curved, k, k),
                    Element(transition, k, -k),
                    Element(0.5 * curved, -k, -k),
                ]
            else:
                parts.append(Element(curved, k, k))
            elements = [e for e in parts if e.length > 0]
        return cls.from_elements(
            elements,
            slope=slope,
            slope_end=slope_end,
            start_chainage=start_chainage,
            azimuth=azimuth,
            origin=origin,
        )

    def table(self, chainage: Float) -> Float:
        """Return the columns of :func:`axis_at` at chainages (n,) -> (8, n), positions relative to ``origin``."""
        return _axis_table(self.plan, self.profile, np.ascontiguousarray(np.atleast_1d(chainage), dtype=np.float64))

    def position(self, chainage: Float) -> Float:
        """Return coordinates of the axis at chainages (n,) -> (n, 3), m."""
        return np.column_stack([*self.table(chainage)[:3]]) + self.origin

    def frame(self, chainage: Float) -> Frame:
        """Return position and unit vectors t, u, w of the axis at chainages (n,)."""
        x, y, z, c, n, _, g, _ = self.table(chainage)
        q = np.sqrt(1.0 + g * g)
        return Frame(
            np.column_stack([x, y, z]) + self.origin,
            np.column_stack([c / q, n / q, g / q]),
            np.column_stack([n, -c, np.zeros_like(c)]),
            np.column_stack([-g * c / q, -g * n / q, 1.0 / q]),
        )

    def vertices(self, spacing: float) -> Float:
        """Return axis vertices every ``spacing`` m of chainage, the last at the end of the tunnel; (n, 3)."""
        count = math.ceil((self.end - self.start) / spacing - 1e-9)
        s = np.append(self.start + spacing * np.arange(count), self.end)
        return self.position(s)
