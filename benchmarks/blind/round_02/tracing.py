"""Where rays from a scanner end: on the lining, the floor or a body."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from .alignment import Alignment
from .arrays import FloatArray, IntArray
from .canvas import Canvas
from .section import Section
from .solids import Place, Solid

CHUNK = 60_000
TOLERANCE = 0.0015
NEAR = 0.02
# Along a curved lining a metre of girth is shorter at some depth before it.
METRIC = 0.8
LINING, FLOOR, NOTHING = -1, -2, -3


@dataclass
class Tunnel:
    """A tunnel: line, section, lining and the bodies in it; `stride` is the share of the clearance that a step takes."""

    line: Alignment
    section: Section
    canvas: Canvas
    solids: tuple[Solid, ...]
    stride: float = 0.85
    _wall: tuple[int, ...] = field(init=False)
    _free: tuple[int, ...] = field(init=False)
    _reach: float = field(init=False)

    def __post_init__(self) -> None:
        numbers = range(len(self.solids))
        self._wall = tuple(i for i in numbers if math.isfinite(self.solids[i].reach))
        self._free = tuple(i for i in numbers if i not in self._wall)
        self._reach = max([self.solids[i].reach for i in self._wall] + [float(self.canvas.relief.max())]) + 0.08

    def place(self, xyz: FloatArray) -> Place:
        """Tunnel coordinates of local points."""
        s, u, v = self.line.tunnel(xyz)
        return Place(s, u, v, self.section.girth(u, v), self.section.depth(u, v))

    def clearance(self, xyz: FloatArray, slack: FloatArray | None = None) -> tuple[FloatArray, FloatArray, IntArray]:
        """Distance from all surfaces, from the nearest body, and the number of what is nearest.

        Parameters
        ----------
        xyz : ndarray
            Local coordinates.
        slack : ndarray, optional
            Below what the distances from bodies on the lining and from free ones are known not to lie, two rows; bodies
            that cannot matter are left out by it, and it is brought up to date.
        """
        bounds = np.zeros((2, len(xyz))) if slack is None else slack
        s, u, v = self.line.tunnel(xyz)
        depth = self.section.depth(u, v)
        close = np.flatnonzero(depth < self._reach + 0.05)
        girth = np.zeros_like(s)
        girth[close] = self.section.girth(u[close], v[close])
        gap = np.maximum(depth - self._reach, 0.04)
        gap[close] = depth[close] - self.canvas.sample(self.canvas.relief, s[close], girth[close])
        gap = np.minimum(gap, v)
        wide = np.maximum(gap, NEAR)
        place = Place(s, u, v, girth, depth)
        number = np.full(s.size, LINING)
        body = np.maximum(bounds[0], depth - self._reach)
        near = close[bounds[0, close] < wide[close]]
        body[near], number[near] = self._nearest(place.part(near), self._wall)
        bounds[0] = body * METRIC
        near = np.flatnonzero(bounds[1] < wide)
        bounds[1, near], which = self._nearest(place.part(near), self._free)
        closer = bounds[1, near] < body[near]
        number[near[closer]] = which[closer]
        body = np.minimum(body, bounds[1])
        number[body >= gap] = LINING
        gap = np.minimum(gap, body)
        number[v <= gap] = FLOOR
        return gap, body, number

    def _nearest(self, p: Place, bodies: tuple[int, ...]) -> tuple[FloatArray, IntArray]:
        """Distance from the nearest of some bodies, and its number."""
        best = np.full(p.s.size, np.inf)
        number = np.full(p.s.size, NOTHING)
        for i in bodies:
            gap = self.solids[i].distance(p)
            number[gap < best] = i
            np.minimum(best, gap, out=best)
        return best, number


@dataclass(frozen=True)
class Hits:
    """Ends of rays.

    Attributes
    ----------
    distance : ndarray
        Range, infinite where nothing was met.
    target : ndarray
        Number of the body, or `LINING`, `FLOOR`, `NOTHING`.
    miss : ndarray
        How closely the ray passed a body before, in radii of the beam.
    passed : ndarray
        Range at which that was.
    edge : ndarray
        Number of that body.
    """

    distance: FloatArray
    target: IntArray
    miss: FloatArray
    passed: FloatArray
    edge: IntArray


def trace(tunnel: Tunnel, origins: FloatArray, directions: FloatArray, beam: float, far: float = 26.0) -> Hits:
    """Follow rays to where they end.

    Parameters
    ----------
    tunnel : Tunnel
        What they meet.
    origins, directions : ndarray
        Local coordinates, one row a ray.
    beam : float
        Full angle of the beam, radians.
    far : float
        Where to give up.
    """
    count = len(directions)
    hits = Hits(
        np.full(count, np.inf), np.full(count, NOTHING), np.full(count, np.inf), np.zeros(count), np.full(count, NOTHING)
    )
    for start in range(0, count, CHUNK):
        part = slice(start, min(count, start + CHUNK))
        _march(tunnel, origins[part], directions[part], beam, far, hits, start)
    return hits


def _march(
    tunnel: Tunnel, origins: FloatArray, directions: FloatArray, beam: float, far: float, hits: Hits, start: int
) -> None:
    """Sphere tracing of one chunk; writes into `hits` from `start` on."""
    at = np.full(len(directions), 0.4)
    low = at.copy()
    slack = np.zeros((2, len(directions)))
    through: list[IntArray] = []
    active = np.arange(len(directions))
    for _ in range(160):
        part = slack[:, active]
        gap, body, number = tunnel.clearance(origins[active] + directions[active] * at[active, None], part)
        ratio = body / (0.002 + beam / 2 * at[active])
        index = active + start
        closest = (ratio < hits.miss[index]) & (gap > TOLERANCE)
        hits.miss[index[closest]] = ratio[closest]
        hits.passed[index[closest]] = at[active[closest]]
        edge = closest & (ratio < 1) & (number >= 0)
        hits.edge[index[edge]] = number[edge]
        done = gap < TOLERANCE
        hits.distance[active[done] + start] = at[active[done]]
        through.append(active[gap < -TOLERANCE])
        active, step = active[~done], np.maximum(gap[~done] * tunnel.stride, TOLERANCE)
        low[active] = at[active]
        at[active] += step
        slack[:, active] = part[:, ~done] - step
        active = active[at[active] < far]
        if not active.size:
            break
    beyond = np.concatenate(through)
    at[beyond] = _refine(tunnel, origins[beyond], directions[beyond], low[beyond], at[beyond])
    hits.distance[beyond + start] = at[beyond]
    found = np.flatnonzero(np.isfinite(hits.distance[start : start + len(directions)]))
    ends = origins[found] + directions[found] * at[found, None]
    hits.target[found + start] = tunnel.clearance(ends)[2]


def _refine(tunnel: Tunnel, origins: FloatArray, directions: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Halve the interval in which a ray went through a surface."""
    for _ in range(9):
        middle = (low + high) / 2
        beyond = tunnel.clearance(origins + directions * middle[:, None])[0] < 0
        high = np.where(beyond, middle, high)
        low = np.where(beyond, low, middle)
    return low
