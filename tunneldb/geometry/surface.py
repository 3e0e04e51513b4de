"""Surface of a tunnel: segments and sections, and transformations between space and the unrolled plane."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float, Int64, Single
from tunneldb.geometry.frame import frames_at
from tunneldb.geometry.unrolling import NODES, section_points, sections_about, to_plane, to_space
from tunneldb.robust import MAD_TO_SIGMA
from tunneldb.threads import in_blocks

BLOCK = 1 << 14
"""Number of points that are transformed at a time."""

COLUMNS = 250
"""Number of columns of pixels that are transformed at a time."""

_ANYWHERE = np.full(3, -np.inf), np.full(3, np.inf)

MIN_SECTION_DEVIATION = 0.06
"""Deviation of a section from its neighbours above which it was not measured on the wall, m."""

MIN_SECTIONS = 4
"""Least number of sections for a comparison."""


@dataclass(frozen=True)
class Unrolled:
    """Points in the unrolled plane; NaN if a point is off the tunnel.

    Attributes
    ----------
    chainage, arc, offset : (n,) float arrays
        Along the axis in plan; along the section from the crown, positive right; from the surface, positive inwards; m.
    normal : (n, 3) float array
        Unit normal of the surface at the point's foot, into the tunnel, in the tunnel's frame.
    """

    chainage: Float
    arc: Float
    offset: Float
    normal: Float


@dataclass(frozen=True)
class Surface:
    """Segments and sections of a survey, sorted by chainage.

    Attributes
    ----------
    number : (m,) int array
        Segment numbers; segments with consecutive numbers touch.
    segments : (m, 12) float array
        Rows of vertex_from, vertex_to, tangent_from, tangent_to.
    ends : (m, 2) float array
        Chainage at the first and second plane, m.
    chainages : (k,) float array
        Chainages of the sections, m.
    radius, arcs : (k, 361) float arrays
        Distance from the axis and length from the crown at each whole degree from -180° to 180°, m.
    reach : float
        Distance between sections above which the surface has a gap, m: one spacing of the axis vertices.
    """

    number: Int64
    segments: Float
    ends: Float
    chainages: Float
    radius: Float
    arcs: Float
    reach: float

    def __post_init__(self) -> None:
        if self.radius.shape != (len(self.chainages), NODES) or self.arcs.shape != self.radius.shape:
            raise ValueError(f"sections must have {NODES} nodes, one per degree")

    def unroll(self, points: Float) -> Unrolled:
        """Return chainage, arc, offset and surface normal of points (n, 3) in the tunnel's SRID."""
        points = np.ascontiguousarray(points, dtype=np.float64)
        unrolled, normal = np.empty_like(points), np.empty_like(points)
        in_blocks(
            lambda begin, end: to_plane(
                *self.arrays, *_ANYWHERE, points[begin:end], unrolled[begin:end], normal[begin:end]
            ), len(points), BLOCK,
        )  # fmt: skip
        return Unrolled(unrolled[:, 0], unrolled[:, 1], unrolled[:, 2], normal)

    @property
    def arrays(self) -> tuple[Float, Int64, Float, Float, Float, Float, float]:
        """Return the arguments of :func:`tunneldb.geometry.unrolling.to_plane` for the surface."""
        return self.segments, self.number, self.ends, self.chainages, self.radius, self.arcs, self.reach

    def to_space(self, chainage: Float, arc: Float, offset: Float) -> Float:
        """Return points (n, 3) of coordinates in the unrolled plane (n,); NaN off the tunnel."""
        unrolled = np.column_stack(np.broadcast_arrays(chainage, arc, offset)).astype(np.float64, copy=False)
        which = self.segment_index(unrolled[:, 0])
        points = np.empty_like(unrolled)
        for begin in range(0, len(points), BLOCK):
            part = slice(begin, begin + BLOCK)
            points[part] = to_space(
                self.segments, which[part], self.ends, self.chainages, self.radius, self.arcs, self.reach, unrolled[part]
            )
        return points

    def section_points(self, chainage: Float, arc: Float, offset: Single) -> tuple[Float, Float]:
        """Return the positions of pixels in the planes of their columns: right of the axis and above it, (columns, rows), m.

        Parameters
        ----------
        chainage, arc : (columns,), (rows,) float arrays
            Coordinates of columns and rows, m.
        offset : (rows, columns) float32 array
            Offset from the surface, m; NaN where not measured.
        """
        right, up = (np.empty((len(chainage), len(arc))) for _ in range(2))

        def block(begin: int, end: int) -> None:
            section_points(
                self.chainages, self.radius, self.arcs, self.reach, chainage[begin:end], arc,
                np.ascontiguousarray(offset[:, begin:end]), right[begin:end], up[begin:end],
            )  # fmt: skip

        in_blocks(block, len(chainage), COLUMNS)
        return right, up

    def segment_index(self, chainage: Float) -> Int64:
        """Return the index of the segment at each chainage, -1 if there is none."""
        index = np.searchsorted(self.ends[:, 0], chainage, side="right") - 1
        inside = (index >= 0) & (chainage <= self.ends[index, 1])
        return np.where(inside, index, -1).astype(np.int64)

    def frames(self, chainage: Float) -> Float:
        """Return origin, tangent, right and up, (n, 4, 3), of the plane at each chainage (n,); NaN if there is no segment."""
        index = self.segment_index(np.asarray(chainage, dtype=np.float64))
        inside = index >= 0
        k, at = index[inside], np.asarray(chainage, dtype=np.float64)[inside]
        frames = np.full((len(index), 4, 3), np.nan)
        frames[inside] = frames_at(self.segments, k, (at - self.ends[k, 0]) / (self.ends[k, 1] - self.ends[k, 0]))
        return frames

    def arc_range(self, chainage: Float) -> tuple[Float, Float]:
        """Return the arcs (n,) at both ends of the sections at chainages (n,), straight below the axis (-180° and 180°), m.

        NaN where there is no section.
        """
        a, b, g = sections_about(self.chainages, np.asarray(chainage, dtype=np.float64), self.reach)
        low, high = ((1.0 - g) * self.arcs[a, end] + g * self.arcs[b, end] for end in (0, -1))
        return np.where(a >= 0, low, np.nan), np.where(a >= 0, high, np.nan)

    def waterline(self, chainage: Float, level: float) -> tuple[Float, Float]:
        """Return the arcs at which the surface meets the water on the left and on the right, at chainages (n,), m.

        NaN if there is no section, or if it does not extend down to the water.

        Parameters
        ----------
        chainage : (n,) float array
            Chainages, m.
        level : float
            Height of the water in the tunnel's SRID, m.
        """
        chainage = np.asarray(chainage, dtype=np.float64)
        a, b, g = sections_about(self.chainages, chainage, self.reach)
        blend = g[:, None]
        radius, arcs = ((1.0 - blend) * of[a] + blend * of[b] for of in (self.radius, self.arcs))
        frames = self.frames(chainage)
        angle = np.radians(np.arange(NODES) - (NODES // 2))
        height = frames[:, 0, 2, None] + radius * (
            np.sin(angle) * frames[:, 2, 2, None] + np.cos(angle) * frames[:, 3, 2, None]
        )
        above = np.where((a >= 0)[:, None], height - level, np.nan)
        crown = NODES // 2
        left, right = above[:, crown::-1], above[:, crown:]
        return _crossing(left, arcs[:, crown::-1]), _crossing(right, arcs[:, crown:])

    def section_outliers(self) -> Float:
        """Return the deviation of each section from its neighbours, (k, 361), m; 0 where it is on the lining.

        Sections in a niche or on fixtures on the wall deviate. Each is compared with the median of the three before and the
        three after it; the deviation must exceed the usual variation of the lining from section to section there, which is
        large for rock.
        """
        count = len(self.chainages)
        if count < MIN_SECTIONS:
            return np.zeros_like(self.radius)
        first = np.clip(np.arange(count) - 3, 0, max(count - 7, 0))
        neighbours = np.array([[n for n in range(f, f + min(7, count)) if n != k] for k, f in enumerate(first.tolist())])
        deviation = self.radius - np.median(self.radius[neighbours], axis=1)
        usual = 3.0 * MAD_TO_SIGMA * np.median(np.abs(deviation), axis=1)
        return np.where(np.abs(deviation) > np.maximum(usual, MIN_SECTION_DEVIATION)[:, None], deviation, 0.0)


def _crossing(above: Float, arcs: Float) -> Float:
    """Return the arc (n,) at which the heights of nodes above the water (n, k) first become negative; NaN if they never do."""
    under = above < 0.0
    after = np.maximum(under.argmax(axis=1), 1)[:, None]
    high, low = (np.take_along_axis(above, at, axis=1)[:, 0] for at in (after - 1, after))
    before, behind = (np.take_along_axis(arcs, at, axis=1)[:, 0] for at in (after - 1, after))
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = before + (behind - before) * high / (high - low)
    return np.where(under.any(axis=1), crossing, np.nan)
