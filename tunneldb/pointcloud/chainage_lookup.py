"""Where along the axis the points of a chunk are, found out cell by cell of space and not point by point."""

from __future__ import annotations

import numpy as np
from numba import njit

from tunneldb.arrays import Float, Int32, Int64, Intp, Single, UInt8
from tunneldb.geometry.alignment import Alignment
from tunneldb.geometry.frame import frame_of, locate, nearest_segment, segment_rows, tangents
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.pointcloud.noise import CellCounts
from tunneldb.pointcloud.points import Points
from tunneldb.pointcloud.spool import BINS_PER_METRE, ROW, Rows

# A distance in space is at most this many times as long in chainage: a point 25 m inside a curve of 75 m radius.
STRETCHING = 1.5


class ChainageLookup:
    """Chainage of the cells of space, and of points in them.

    Parameters
    ----------
    alignment : Alignment
        The given axis.
    limit : float
        Points farther than this from it are outside, m.
    edge : float
        Edge of a cell, m.
    """

    def __init__(self, alignment: Alignment, limit: float, edge: float) -> None:
        self.alignment = alignment
        self.limit = limit
        self.segments = segment_rows(alignment.vertices, tangents(alignment.vertices))
        # How far a point may be from the centre of its cell.
        self.slack = edge * np.sqrt(3.0) / 2.0 * STRETCHING
        self.chainage = np.empty(0)
        self.bin = np.empty(0, np.int64)
        self.segment = np.empty(0, np.int32)
        self.near = np.empty(0, np.bool_)
        self.whole = np.empty(0, np.bool_)

    def update(self, cells: CellCounts) -> None:
        """Look at the cells that are new."""
        known, centres = len(self.chainage), cells.centres
        if known == len(centres):
            return
        new = centres[known:]
        a = self.alignment
        chainage, distance, segment = _locate(self.segments, a.number, a.spacing, new)
        near = (distance + self.slack <= self.limit) & (chainage - self.slack >= a.start) & (chainage + self.slack <= a.end)
        chainage = np.clip(chainage, a.start, a.end)
        self.chainage = np.concatenate([self.chainage, chainage])
        self.bin = np.concatenate([self.bin, np.floor(chainage * BINS_PER_METRE).astype(np.int64)])
        self.segment = np.concatenate([self.segment, segment])
        self.near = np.concatenate([self.near, near])
        # Whether all points of the cell are in one kilometre.
        first, last = ((chainage + slack) // KILOMETRE for slack in (-self.slack, self.slack))
        self.whole = np.concatenate([self.whole, first == last])

    def outside(self, points: Points, cell: Int32) -> Intp:
        """Numbers of the points that lie beyond the ends of the axis or too far from it."""
        doubtful = np.flatnonzero(~self.near[cell])
        if len(doubtful) == 0:
            return doubtful
        distance = self.alignment.distance(points.xyz[doubtful])
        with np.errstate(invalid="ignore"):
            return doubtful[~(distance <= self.limit)]

    @property
    def bins_off(self) -> int:
        """How many bins of chainage a point may be from where its cell is."""
        return int(np.ceil(self.slack * BINS_PER_METRE)) + 1

    def span(self, number: Int64, cell: Int32, block: int) -> tuple[Int64, Float, Float]:
        """Blocks of so many point numbers that points with growing numbers (n,) lie in, and chainage from and to of each, m."""
        found, low, high = _span(number, cell, self.chainage, block)
        return found, low - self.slack, high + self.slack

    def rows(self, points: Points, cell: Int32, picked: Int32, tag: Int32) -> Rows:
        """Rows of the picked points (k,), with their chainage, m, and these tags (k,)."""
        rows: Rows = np.empty(len(picked), ROW)
        _fill(
            rows, points.xyz, points.time, points.intensity, points.scan_id, points.classification, cell, picked, tag,
            self.segments, self.alignment.number, self.alignment.spacing, self.segment,
        )  # fmt: skip
        np.clip(rows["chainage"], self.alignment.start, self.alignment.end, out=rows["chainage"])
        return rows


@njit(cache=True, nogil=True)
def _locate(
    segments: Float, number: Int64, spacing: float, xyz: Float
) -> tuple[Float, Float, Int32]:  # pragma: no cover - compiled
    """Chainage, distance from the axis and segment of points; beyond the ends the nearest end, infinitely far."""
    n = len(xyz)
    chainage, distance, segment = np.empty(n), np.empty(n), np.empty(n, np.int32)
    k = -1
    for i in range(n):
        x, y, z = xyz[i, 0], xyz[i, 1], xyz[i, 2]
        if k < 0:
            k = nearest_segment(segments, x, y, z)
        k, f = locate(segments, number, k, x, y, z)
        if k < 0:
            nearest = nearest_segment(segments, x, y, z)
            last = 2 * nearest >= segments.shape[0]
            chainage[i] = (number[nearest] + (1 if last else 0)) * spacing
            distance[i] = np.inf
            segment[i] = nearest
            continue
        plane = frame_of(segments, k, f)
        chainage[i] = (number[k] + f) * spacing
        distance[i] = np.sqrt((x - plane[0]) ** 2 + (y - plane[1]) ** 2 + (z - plane[2]) ** 2)
        segment[i] = k
    return chainage, distance, segment


@njit(cache=True, nogil=True)
def _span(number: Int64, cell: Int32, chainage: Float, block: int) -> tuple[Int64, Float, Float]:  # pragma: no cover - compiled
    most = (number[-1] - number[0]) // block + 2
    found, low, high = np.empty(most, np.int64), np.empty(most), np.empty(most)
    used = -1
    end = -1
    for i in range(len(number)):
        c = chainage[cell[i]]
        if number[i] >= end:
            used += 1
            found[used] = number[i] // block
            end = (found[used] + 1) * block
            low[used] = high[used] = c
        low[used] = min(low[used], c)
        high[used] = max(high[used], c)
    return found[: used + 1], low[: used + 1], high[: used + 1]


@njit(cache=True, nogil=True)
def _fill(
    rows: Rows, xyz: Float, time: Float, intensity: Single, scan_id: Int32,
    classification: UInt8, cell: Int32, picked: Int32, tag: Int32,
    segments: Float, number: Int64, spacing: float, segment: Int32,
) -> None:  # fmt: skip  # pragma: no cover - compiled
    for k in range(len(picked)):
        i = picked[k]
        row = rows[k]
        x, y, z = xyz[i, 0], xyz[i, 1], xyz[i, 2]
        row.x, row.y, row.z = x, y, z
        s, f = locate(segments, number, segment[cell[i]], x, y, z)
        row.chainage = (number[s] + f) * spacing
        row.time = time[i]
        row.intensity = intensity[i]
        row.scan_id = scan_id[i]
        row.tag = tag[k]
        row.classification = classification[i]
