"""Chainage of the points of a chunk, looked up by cells of space instead of point by point."""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Float, Int32, Int64, Intp, Single, UInt8
from tunneldb.compiled import kernel
from tunneldb.geometry.alignment import Alignment, locate_points
from tunneldb.geometry.frame import segment_rows, tangents
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.pointcloud.points import Points
from tunneldb.pointcloud.spool import BINS_PER_METRE, ROW, Rows
from tunneldb.pointcloud.voxels import CellCounts

# Greatest ratio of a difference in chainage to the distance in space: a point 25 m inside a curve of 75 m radius.
STRETCHING = 1.5

_BLOCK = 8192  # points whose rows are filled at a time; they fit into the processor's cache


class ChainageLookup:
    """Chainage of cells of space, and of the points in them.

    Parameters
    ----------
    alignment : Alignment
        Given axis.
    limit : float
        Distance from the axis beyond which points are outside, m.
    edge : float
        Edge of a cell, m.
    """

    def __init__(self, alignment: Alignment, limit: float, edge: float) -> None:
        self.alignment = alignment
        self.limit = limit
        self.segments = segment_rows(alignment.vertices, tangents(alignment.vertices))
        # Greatest distance of a point from the centre of its cell.
        self.slack = edge * np.sqrt(3.0) / 2.0 * STRETCHING
        self.chainage = np.empty(0)
        self.bin = np.empty(0, np.int64)
        self.segment = np.empty(0, np.int32)
        self.near = np.empty(0, np.bool_)
        self.whole = np.empty(0, np.bool_)

    def update(self, cells: CellCounts) -> None:
        """Locate the cells that are new."""
        known, centres = len(self.chainage), cells.centres
        if known == len(centres):
            return
        new = centres[known:]
        a = self.alignment
        chainage, distance, segment = self._located(new, np.full(len(new), -1, np.int32), True)
        near = (distance + self.slack <= self.limit) & (chainage - self.slack >= a.start) & (chainage + self.slack <= a.end)
        chainage = np.clip(chainage, a.start, a.end)
        self.chainage = np.concatenate([self.chainage, chainage])
        self.bin = np.concatenate([self.bin, np.floor(chainage * BINS_PER_METRE).astype(np.int64)])
        self.segment = np.concatenate([self.segment, segment])
        self.near = np.concatenate([self.near, near])
        # True if all points of the cell are in one kilometre.
        first, last = ((chainage + slack) // KILOMETRE for slack in (-self.slack, self.slack))
        self.whole = np.concatenate([self.whole, first == last])

    def outside(self, points: Points, cell: Int32) -> Intp:
        """Return the indices of points beyond the ends of the axis or too far from it."""
        doubtful = np.flatnonzero(~self.near[cell])
        if len(doubtful) == 0:
            return doubtful
        distance = self.alignment.distance(points.xyz[doubtful])
        with np.errstate(invalid="ignore"):
            return doubtful[~(distance <= self.limit)]

    @property
    def bins_off(self) -> int:
        """Greatest number of chainage bins between a point and its cell."""
        return int(np.ceil(self.slack * BINS_PER_METRE)) + 1

    def span(self, number: Int64, cell: Int32, block: int) -> tuple[Int64, Float, Float]:
        """Return the blocks of ``block`` point numbers that points with ascending numbers (n,) lie in, with chainages, m."""
        found = np.arange(number[0] // block, number[-1] // block + 1)
        starts = np.searchsorted(number, found * block)
        found, starts = found[(occupied := np.diff(starts, append=len(number)) > 0)], starts[occupied]
        chainage = self.chainage[cell]
        low, high = np.minimum.reduceat(chainage, starts), np.maximum.reduceat(chainage, starts)
        return found, low - self.slack, high + self.slack

    def rows(self, points: Points, cell: Int32, picked: Int32, tag: Int32) -> Rows:
        """Return rows of the picked points (k,), with their chainage, m, and their tags (k,)."""
        rows: Rows = np.empty(len(picked), ROW)
        for begin in range(0, len(picked), _BLOCK):
            part, chosen = rows[begin : begin + _BLOCK], picked[begin : begin + _BLOCK]
            xyz = points.xyz.take(chosen, axis=0)
            chainage, _, _ = self._located(xyz, self.segment.take(cell.take(chosen)), False)
            fields = [part[name] for name in _FIELDS]
            _fill(
                xyz, chainage, self.alignment.start, self.alignment.end, chosen, points.time, points.intensity, points.scan_id,
                points.classification, tag[begin : begin + _BLOCK], *fields,
            )  # fmt: skip
        return rows

    def _located(self, xyz: Float, start: Int32, distances: bool) -> tuple[Float, Float, Int32]:
        """Return chainage, distance from the axis (optional) and segment of points (n, 3); search from ``start`` on."""
        chainage, distance, segment = np.empty(len(xyz)), np.empty(len(xyz) if distances else 0), np.empty(len(xyz), np.int32)
        a = self.alignment
        locate_points(self.segments, a.number, float(a.spacing), xyz, start, chainage, distance, segment)
        return chainage, distance, segment


_FIELDS = ("x", "y", "z", "chainage", "time", "intensity", "scan_id", "classification", "tag")


@kernel
def _fill(
    xyz: Float, along: Float, low: float, high: float, chosen: Int32,
    times: Float, intensities: Single, scan_ids: Int32, classifications: UInt8, tags: Int32,
    x: Float, y: Float, z: Float, chainage: Float, time: Float, intensity: Single, scan_id: Int32, classification: UInt8,
    tag: Int32,
) -> None:  # pragma: no cover - compiled  # fmt: skip
    """Write the fields of rows: computed values, and those of the chosen points."""
    for i in range(chosen.shape[0]):
        k = chosen[i]
        x[i], y[i], z[i] = xyz[i, 0], xyz[i, 1], xyz[i, 2]
        chainage[i] = min(max(along[i], low), high)
        time[i], intensity[i], scan_id[i] = times[k], intensities[k], scan_ids[k]
        classification[i], tag[i] = classifications[k], tags[i]
