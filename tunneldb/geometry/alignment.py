"""Given axis of a tunnel, as stations at constant spacing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy  # its modules are imported on first use: they take long

from tunneldb.arrays import Float, Int32, Int64
from tunneldb.compiled import point_kernel
from tunneldb.errors import UserError
from tunneldb.geometry.frame import frame_of, frames_at, locate, nearest_segment, segment_rows, tangents
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.threads import in_blocks

BLOCK = 1 << 14
"""Number of points located at a time."""

MILLIMETRE = 0.001
MIN_SPACING = 0.1
"""Least distance between axis vertices, m; scan points do not resolve more."""

MAX_DENSE_SPACING = 2.0  # m; distance between vertices below which a line is dense


@dataclass(frozen=True)
class Alignment:
    """Given axis: stations at whole multiples of the spacing, with tangents.

    Attributes
    ----------
    spacing : float
        Distance between stations in plan, m.
    number : (n,) int array
        Station numbers; station ``k`` is at chainage ``k * spacing``.
    vertices : (n, 3) float array
        Stations in the tunnel's SRID, m.
    start, end : float
        Chainage of the first and of the last given vertex, m. The first and the last station are up to one spacing outside,
        on the straight continuation.
    """

    spacing: float
    number: Int64
    vertices: Float
    start: float
    end: float

    @classmethod
    def from_polyline(cls, xyz: Float, start_chainage: float, spacing: float = 10.0) -> Alignment:
        """Fit a smooth curve through the given vertices, with stations on it.

        The curve is a cubic spline over the chord length in plan; chainage is its length in plan, as stationing is.

        Parameters
        ----------
        xyz : (n, 3) float array
            Vertices in ascending chainage, m, n ≥ 2; consecutive ones differ in plan.
        start_chainage : float
            Chainage of the first vertex, m.
        spacing : float
            Distance between stations, m; it must divide a kilometre, so that each kilometre begins at a station.

        Raises
        ------
        UserError
            If there are fewer than two vertices, two coincide in plan, or the spacing doesn't divide 1000 m.
        """
        xyz = np.asarray(xyz, dtype=np.float64)
        if len(xyz) < 2:
            raise UserError(f"an axis needs at least 2 points, this one has {len(xyz)}")
        if spacing < MIN_SPACING or abs(KILOMETRE / spacing - round(KILOMETRE / spacing)) > 1e-9:
            raise UserError(
                f"the spacing of axis vertices must divide 1000 m and be {MIN_SPACING} m or more, not {spacing:g} m"
            )
        chord = np.hypot(*np.diff(xyz[:, :2], axis=0).T)
        if np.any(chord == 0):
            row = int(np.argmin(chord)) + 2
            raise UserError(f"axis point {row} has the same plan position as the previous one; remove one of them")
        parameter, chainage, position = _curve(xyz, chord)
        end = start_chainage + float(chainage[-1])
        first, last = int(np.floor(start_chainage / spacing)), int(np.ceil((end - MILLIMETRE) / spacing))
        number = np.arange(first, max(last, first + 1) + 1)
        distances = number * spacing - start_chainage
        inside = np.clip(distances, 0.0, chainage[-1])
        stations = position(np.interp(inside, chainage, parameter))
        beyond = (distances - inside)[:, None]
        slope = position(np.where(beyond[:, 0] < 0.0, 0.0, parameter[-1]), 1)
        stations = stations + beyond * slope / np.hypot(slope[:, :1], slope[:, 1:2])
        return cls(spacing, number, stations, start_chainage, end)

    def chainage(self, points: Float) -> Float:
        """Return the chainage of points, m, by the planes of the stations; NaN beyond the first and last given vertex."""
        return self.locate(points)[0]

    def distance(self, points: Float) -> Float:
        """Return the distance of points from the axis in their plane, m; NaN beyond the ends."""
        return self.locate(points)[1]

    def locate(self, points: Float) -> tuple[Float, Float]:
        """Return chainage and distance from the axis of points (n, 3), both (n,), m; NaN beyond the ends."""
        chainage, distance, _ = self._located(points)
        return chainage, distance

    def across(self, points: Float) -> Float:
        """Return chainage of points (n, 3), and their position right and up in the plane across the axis there, (n, 3), m.

        NaN beyond the ends. Right is horizontal, up is at right angles to it and to the axis.
        """
        chainage, _, segment = self._located(points)
        located = np.flatnonzero(np.isfinite(chainage))
        k = segment[located].astype(np.int64)
        frame = frames_at(self._segments, k, chainage[located] / self.spacing - self.number[k])
        away = points[located] - frame[:, 0]
        found = np.full((len(points), 3), np.nan)
        found[located, 0] = chainage[located]
        found[located, 1:] = np.einsum("ij,ikj->ik", away, frame[:, 2:])
        return found

    @cached_property
    def _segments(self) -> Float:
        return segment_rows(self.vertices, tangents(self.vertices))

    def in_space(self, places: Float) -> Float:
        """Return points (n, 3), m, of chainage, right and up across the axis (n, 3), m: the inverse of `across`."""
        station = places[:, 0] / self.spacing - self.number[0]
        k = np.clip(np.floor(station), 0, len(self.number) - 2).astype(np.int64)
        frame = frames_at(self._segments, k, station - k)
        return frame[:, 0] + np.einsum("ij,ijk->ik", places[:, 1:], frame[:, 2:])

    def _located(self, points: Float) -> tuple[Float, Float, Int32]:
        """Return chainage and distance from the axis, m, NaN beyond the ends, and index of the segment, each (n,)."""
        segments = self._segments
        points = np.ascontiguousarray(points, np.float64)
        start, segment = np.full(len(points), -1, np.int32), np.empty(len(points), np.int32)
        chainage, distance = np.empty(len(points)), np.empty(len(points))

        def block(begin: int, end: int) -> None:
            part = slice(begin, end)
            locate_points(
                segments, self.number, float(self.spacing), points[part],
                start[part], chainage[part], distance[part], segment[part],
            )  # fmt: skip

        in_blocks(block, len(points), BLOCK)
        beyond = np.isinf(distance) | (chainage < self.start) | (chainage > self.end)
        chainage[beyond] = np.nan
        distance[beyond] = np.nan
        return chainage, distance, segment

    def places(self, points: Float) -> tuple[Float, Float]:
        """Return chainage of points (n, 3), and distance right of the axis in plan, both (n,), m; NaN beyond the ends."""
        chainage = self.chainage(points)
        on_axis, along = self._plan(chainage)
        away = points[:, :2] - on_axis
        return chainage, away[:, 0] * along[:, 1] - away[:, 1] * along[:, 0]

    def plan_points(self, chainage: Float, across: Float) -> Float:
        """Return points in plan (n, 2), m, at chainages and distances right of the axis (n,), m: the inverse of `places`."""
        on_axis, along = self._plan(chainage)
        return on_axis + across[:, None] * np.column_stack([along[:, 1], -along[:, 0]])

    def _plan(self, chainage: Float) -> tuple[Float, Float]:
        """Return points on the axis in plan, and unit vectors along it, both (n, 2), at chainages (n,), m."""
        stations = self.number * self.spacing
        slope = np.gradient(self.vertices[:, :2], stations, axis=0)
        on_axis, along = (
            np.column_stack([np.interp(chainage, stations, of[:, k]) for k in range(2)]) for of in (self.vertices, slope)
        )
        return on_axis, along / np.linalg.norm(along, axis=1)[:, None]


def _curve(xyz: Float, chord: Float) -> tuple[Float, Float, Callable[..., Float]]:
    """Return a spline over the chord length, with a table of its parameter by length in plan."""
    knots = np.concatenate([[0.0], np.cumsum(chord)])
    position = scipy.interpolate.CubicSpline(knots, xyz)
    # A design alignment has a vertex every metre, between which the curve is nearly straight.
    steps = np.where(chord > MAX_DENSE_SPACING, 64, 4)
    within = np.arange(steps.sum()) - np.repeat(np.cumsum(steps) - steps, steps)
    parameter = np.append(np.repeat(knots[:-1], steps) + within * np.repeat(chord / steps, steps), knots[-1])
    slope = position(parameter, 1)
    middle = position((parameter[1:] + parameter[:-1]) / 2, 1)
    speed, between = np.hypot(slope[:, 0], slope[:, 1]), np.hypot(middle[:, 0], middle[:, 1])
    length = np.diff(parameter) * (speed[1:] + 4 * between + speed[:-1]) / 6
    return parameter, np.concatenate([[0.0], np.cumsum(length)]), position


@point_kernel
def locate_points(
    segments: Float,
    number: Int64,
    spacing: float,
    points: Float,
    start: Int32,
    chainage: Float,
    distance: Float,
    segment: Int32,
) -> None:  # pragma: no cover - compiled
    """Locate a block of points along the axis.

    Parameters
    ----------
    segments, number, spacing
        Rows of :func:`tunneldb.geometry.frame.segment_rows`, their numbers, and their length in plan, m.
    points : (n, 3) float array
        Points, m.
    start : (n,) int32 array
        Segment at which the search begins for each point; -1 for that of the previous point.
    chainage, distance : (n,) float arrays
        Overwritten: chainage and distance from the axis in the point's plane, m. Beyond the ends: the chainage of the nearest
        end, and infinity. No distances are computed if the array is empty.
    segment : (n,) int32 array
        Overwritten: index of the segment, beyond the ends of the nearest one.
    """
    k = np.int64(-1)
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        if start[i] >= 0:
            k = np.int64(start[i])
        elif k < 0:
            k = nearest_segment(segments, x, y, z)
        k, f = locate(segments, number, k, x, y, z)
        if k < 0:
            nearest = nearest_segment(segments, x, y, z)
            last = 2 * nearest >= segments.shape[0]
            chainage[i] = (number[nearest] + (1 if last else 0)) * spacing
            segment[i] = nearest
            if distance.shape[0] > 0:
                distance[i] = np.inf
            continue
        chainage[i] = (number[k] + f) * spacing
        segment[i] = k
        if distance.shape[0] > 0:
            ox, oy, oz, _, _, _, _, _ = frame_of(segments, k, f)
            distance[i] = np.sqrt((x - ox) ** 2 + (y - oy) ** 2 + (z - oz) ** 2)
