"""Sums over all leaks of a stretch, read in blocks, so that memory does not grow with their number."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
import psycopg
from psycopg import sql

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.report.data import REPORTED
from tunneldb.report.drawing import wet_bins
from tunneldb.report.text import DASH
from tunneldb.store.survey import Survey

BLOCK = 20_000
"""Number of leaks read at a time."""

SIZES = (0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0)
"""Limits of the classes of size, m²; 0.2 and 0.3 are limits of GB 50108-2008."""

HOURS = (7, 8, 9, 10, 11, 12, 1, 2, 3, 4, 5, 6)
"""Clock sectors: up the left wall, down the right one, and below."""

_ROW = sql.SQL(
    "SELECT id, review, detected, reviewed_by, remark, area, public.ST_AsBinary(unrolled), chainage_from, chainage_to, clock,"
    " tunnel_internal.area_between(unrolled, area, %(low)s, %(high)s) {reported} ORDER BY id"
).format(reported=REPORTED)


@dataclass
class LeakSums:
    """Totals of all leaks of a stretch, listed or not.

    Attributes
    ----------
    edges : (n + 1,) float64 array
        Bins of chainage, m.
    digest : hash
        Called with each reported leak, in the order of their ids.
    leaks, counted, lost : int
        Number in total; number included in totals, found last and not rejected; number confirmed and not found again.
    ids : (leaks,) int64 array
        Their ids, growing.
    reach : float
        Greatest chainage, m.
    wet : (n,) float64 array
        Wet area in the bins, m².
    by_hour, by_size : (12, 2) and (8, 2) float64 arrays
        Number of leaks that count, and their area in the stretch, m², by HOURS and by SIZES.
    """

    edges: Float
    digest: hashlib._Hash
    leaks: int = 0
    counted: int = 0
    lost: int = 0
    ids: Int64 = field(default_factory=lambda: np.empty(0, np.int64))
    reach: float = -np.inf
    wet: Float = field(init=False)
    by_hour: Float = field(default_factory=lambda: np.zeros((12, 2)))
    by_size: Float = field(default_factory=lambda: np.zeros((len(SIZES) + 1, 2)))

    def __post_init__(self) -> None:
        self.wet = np.zeros(len(self.edges) - 1)

    def add(self, rows: Sequence[tuple[Any, ...]]) -> None:
        """Add a block of leaks."""
        for key, review, detected, reviewer, remark, area, outline, *_ in rows:
            stated = (key, review, detected, reviewer, remark, f"{area:.4f}", bytes(outline).hex().upper())
            self.digest.update(repr(stated).encode())
        detected = np.array([row[2] for row in rows], np.bool_)
        counts: Bool = detected & np.array([row[1] != "rejected" for row in rows], np.bool_)
        area, low, high, clock, inside = np.array([(row[5], *row[7:]) for row in rows], float).T
        self.leaks += len(rows)
        self.ids = np.concatenate([self.ids, np.array([row[0] for row in rows], np.int64)])
        self.lost += int(np.count_nonzero(~detected))
        self.counted += int(np.count_nonzero(counts))
        self.reach = max(self.reach, float(high.max(initial=-np.inf)))
        self.wet += wet_bins(low[counts], high[counts], inside[counts], self.edges)
        hour = (np.round(clock[counts]).astype(int) - HOURS[0]) % 12
        size = (area[counts, None] > SIZES).sum(axis=1)
        for sums, place in ((self.by_hour, hour), (self.by_size, size)):
            np.add.at(sums, place, np.column_stack([np.ones(len(place)), inside[counts]]))

    @property
    def clock_bars(self) -> list[dict[str, Any]]:
        """Number and area by hour."""
        return _bars([str(hour) for hour in HOURS], self.by_hour)

    @property
    def size_bars(self) -> list[dict[str, Any]]:
        """Number and area by size."""
        names = [f"≤ {SIZES[0]:g}", *(f"{a:g}{DASH}{b:g}" for a, b in pairwise(SIZES)), f"> {SIZES[-1]:g}"]
        return _bars(names, self.by_size)


def _bars(names: Sequence[str], sums: Float) -> list[dict[str, Any]]:
    """Return bars with their number in per cent of the greatest."""
    most = float(sums[:, 0].max()) or 1.0
    return [
        {"name": name, "count": int(count), "area": area, "width": round(100 * count / most, 1)}
        for name, (count, area) in zip(names, sums.tolist(), strict=True)
    ]


def sum_leaks(
    conn: psycopg.Connection[Any], survey: Survey, low: float, high: float, edges: Float, digest: hashlib._Hash
) -> LeakSums:
    """Sum up the leaks of a stretch, a block at a time, within the transaction that is open.

    Parameters
    ----------
    low, high : float
        The stretch, m.
    edges, digest
        As in `LeakSums`.
    """
    sums = LeakSums(edges, digest)
    with conn.cursor(name="reported_leaks", binary=True) as cursor:
        cursor.execute(_ROW, {"survey": survey.id, "low": low, "high": high})
        while rows := cursor.fetchmany(BLOCK):
            sums.add(rows)
    return sums
