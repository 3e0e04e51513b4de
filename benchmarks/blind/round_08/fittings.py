"""What is fitted to a lining or stands in front of it: boxes and rods, and where rays meet them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.round_08.tunnel import Array, Axis, Section

# Long things follow the axis in pieces of this length, in metres.
PIECE = 1.0


@dataclass(frozen=True)
class Piece:
    """A box, or a rod along its first direction.

    Attributes
    ----------
    centre : array of (3,)
        Relative to the origin of the axis.
    frame : array of (3, 3)
        Its directions, in rows.
    half : array of (3,)
        Half sizes; of a rod half its length and, twice, its radius.
    db : float
        Reflectance relative to that of the lining's level 0, in dB.
    gloss : float
        Share of mirroring.
    rod : bool
        Whether it is a rod.
    """

    centre: Array
    frame: Array
    half: Array
    db: float
    gloss: float
    rod: bool

    @property
    def radius(self) -> float:
        """Of the ball around it."""
        return float(np.linalg.norm(self.half))

    def meet(self, origin: Array, direction: Array) -> tuple[Array, Array]:
        """Distance to the first point along rays (infinite if they miss), and the cosine of the incidence."""
        o, d = (origin - self.centre) @ self.frame.T, direction @ self.frame.T
        d = np.where(np.abs(d) < 1e-9, 1e-9, d)
        if self.rod:
            r = self.half[1]
            a = d[:, 1] ** 2 + d[:, 2] ** 2
            b = o[:, 1] * d[:, 1] + o[:, 2] * d[:, 2]
            root = b * b - a * (o[:, 1] ** 2 + o[:, 2] ** 2 - r * r)
            t = (-b - np.sqrt(np.maximum(root, 0.0))) / a
            hit = (root > 0.0) & (t > 0.0) & (np.abs(o[:, 0] + t * d[:, 0]) <= self.half[0])
            cosine = np.sqrt(np.maximum(root, 0.0)) / r
        else:
            one, two = (-self.half - o) / d, (self.half - o) / d
            enter = np.minimum(one, two)
            t = enter.max(axis=1)
            hit = (t > 0.0) & (t <= np.maximum(one, two).min(axis=1))
            cosine = np.abs(np.take_along_axis(d, enter.argmax(axis=1)[:, None], axis=1)[:, 0])
        return np.where(hit, t, np.inf), np.clip(cosine, 0.02, 1.0)


class Fittings:
    """The fittings of a tunnel.

    Parameters
    ----------
    axis : Axis
        Axis that they follow.
    section : Section
        Section on which they are mounted.
    """

    def __init__(self, axis: Axis, section: Section) -> None:
        self.axis, self.section = axis, section
        self.pieces: list[Piece] = []

    def _add(
        self, s: tuple[float, float], at: tuple[float, float], up: Array, half: tuple[float, float], look: tuple, rod: bool
    ) -> None:
        """Add a thing from chainage to chainage; ``up`` is its third direction as (h, v), ``half`` goes across and up."""
        count = max(1, int(np.ceil((s[1] - s[0]) / PIECE)))
        ends = np.linspace(s[0], s[1], count + 1)
        for a, b in pairwise(ends):
            middle = 0.5 * (a + b)
            ahead, right = self.axis.frame(np.array(middle))
            third = up[0] * right + up[1] * np.array([0.0, 0.0, 1.0])
            centre = self.axis.to_local(middle, at[0], at[1])
            frame = np.stack([ahead, np.cross(third, ahead), third])
            # A little longer than the piece, so that bends leave no slits.
            self.pieces.append(Piece(centre, frame, np.array([0.5 * (b - a) + 1e-3, *half]), look[0], look[1], rod))

    def box(
        self, s: tuple[float, float], h: tuple[float, float], v: tuple[float, float], db: float, gloss: float = 0.0
    ) -> None:
        """Add a box that stands upright: walkway, cabinet, channel."""
        at = (0.5 * (h[0] + h[1]), 0.5 * (v[0] + v[1]))
        half = (0.5 * (h[1] - h[0]), 0.5 * (v[1] - v[0]))
        self._add(s, at, np.array([0.0, 1.0]), half, (db, gloss), rod=False)

    def rod(self, s: tuple[float, float], h: float, v: float, radius: float, db: float, gloss: float = 0.0) -> None:
        """Add a rod along the tunnel: pipe, wire, handrail."""
        self._add(s, (h, v), np.array([0.0, 1.0]), (radius, radius), (db, gloss), rod=True)

    def cable(self, s: tuple[float, float], u: float, off: float, radius: float, db: float, gloss: float = 0.0) -> None:
        """Add a rod whose middle is ``off`` metres in front of the lining at ``u``."""
        h, v, normal_h, normal_v = (float(value) for value in self.section.at(np.array(u)))
        self.rod(s, h + off * normal_h, v + off * normal_v, radius, db, gloss)

    def mount(
        self, s: tuple[float, float], u: tuple[float, float], off: tuple[float, float], db: float, gloss: float = 0.0
    ) -> None:
        """Add a box on the lining, from ``off[0]`` to ``off[1]`` metres in front of it; where that bends, in strips."""
        count = max(1, int(np.ceil((u[1] - u[0]) / 0.6)))
        ends = np.linspace(u[0], u[1], count + 1)
        for a, b in pairwise(ends):
            h, v, normal_h, normal_v = (float(value) for value in self.section.at(np.array(0.5 * (a + b))))
            normal = np.array([normal_h, normal_v]) / np.hypot(normal_h, normal_v)
            middle = 0.5 * (off[0] + off[1])
            at = (h + middle * normal[0], v + middle * normal[1])
            self._add(s, at, normal, (0.5 * (b - a), 0.5 * (off[1] - off[0])), (db, gloss), rod=False)

    def post(self, s: float, h: float, v: tuple[float, float], width: float, db: float) -> None:
        """Add an upright post."""
        self.box((s - width / 2, s + width / 2), (h - width / 2, h + width / 2), v, db)

    def rails(self, s: tuple[float, float], middle: float, db: float = -2.0, gauge: float = 1.435) -> None:
        """Add the two rails of a track, their heads bright from the wheels."""
        for side in (-1, 1):
            h = middle + side * (gauge / 2 + 0.035)
            self.box(s, (h - 0.035, h + 0.035), (-0.05, 0.16), db, gloss=1.5)


def windows(values: NDArray[np.float64], middle: float, half: float, period: float | None) -> NDArray[np.intp]:
    """Indices of values within half a width of a middle, round a circle if there is a period."""
    apart = np.abs(values - middle)
    if period is not None:
        apart = np.abs((apart + period / 2) % period - period / 2)
    return np.flatnonzero(apart <= half)
