"""Pixels of the lining averaged into patches of a few centimetres, for measuring rings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float, Int64, Single
from tunneldb.robust import MAD_TO_SIGMA
from tunneldb.shape.tukey import CUT, weights

PATCH = 0.06
"""Side of a patch, rounded to whole pixels, m: 3 mm of noise become less than 1 mm, and the bend within a patch is less."""

MIN_SEEN_SHARE = 0.3
"""Minimum seen share of a patch's pixels."""


_MIN_ROWS = 10
_ROUNDS = 5
_MIN_SCALE = 1e-5  # m


@dataclass(frozen=True)
class Patches:
    """Patches about the given axis.

    Attributes
    ----------
    chainage : (c,) float array
        Middles of the patches, m, increasing.
    arc : (r,) float array
        Middles of the patches, m, increasing.
    right, up : (c, r) float arrays
        Position about the given axis, m; NaN where unseen.
    """

    chainage: Float
    arc: Float
    right: Float
    up: Float

    def between(self, low: float, high: float) -> Patches:
        """Return the patches whose middles lie between two chainages, m."""
        first, stop = np.searchsorted(self.chainage, [low, high])
        return Patches(self.chainage[first:stop], self.arc, self.right[first:stop], self.up[first:stop])


def average(values: Single, chainage: Float, arc: Float, side: float) -> tuple[Float, Float, Single]:
    """Average an image into patches on whole multiples of their side.

    Parameters
    ----------
    values : (rows, columns) float32 array
        Offset of lining, m; NaN elsewhere.
    chainage, arc : (columns,), (rows,) float arrays
        Middles of the pixels, m.
    side : float
        Side of a patch, m.

    Returns
    -------
    chainage, arc : (c,), (r,) float arrays
        Middles of the patches, increasing, m.
    mean : (r, c) float32 array
        NaN where less than `MIN_SEEN_SHARE` of the pixels is seen.
    """
    if arc[0] > arc[-1]:
        values, arc = values[::-1], arc[::-1]
    (row, rows), (column, columns) = _bins(arc, side), _bins(chainage, side)
    seen = np.isfinite(values)
    count, total = (
        np.add.reduceat(np.add.reduceat(part, row, axis=0), column, axis=1)
        for part in (seen.astype(np.float32), np.where(seen, values, np.float32(0.0)))
    )
    pixels = np.outer(np.diff(row, append=len(arc)), np.diff(column, append=len(chainage)))
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(count >= np.maximum(MIN_SEEN_SHARE * pixels, 1.0), total / count, np.float32(np.nan))
    return (columns + 0.5) * side, (rows + 0.5) * side, mean.astype(np.float32)


def _bins(places: Float, side: float) -> tuple[Int64, Float]:
    """Return the first of the increasing places (n,) in each bin, and the bins' numbers."""
    number = np.floor(places / side + 1e-9)
    first = np.flatnonzero(np.diff(number, prepend=number[0] - 1.0))
    return first, number[first]


def join(parts: Sequence[Patches]) -> Patches:
    """Join consecutive patches, over all arcs that any of them has."""
    if len(parts) == 1:
        return parts[0]
    side = min((float(np.diff(part.arc).min()) for part in parts if len(part.arc) > 1), default=PATCH)
    low, high = min(part.arc[0] for part in parts), max(part.arc[-1] for part in parts)
    arc = low + side * np.arange(round((high - low) / side) + 1)
    chainage = np.concatenate([part.chainage for part in parts])
    out = [np.full((len(chainage), len(arc)), np.nan) for _ in range(2)]
    begin = 0
    for part in parts:
        rows = np.rint((part.arc - low) / side).astype(np.int64)
        stop = begin + len(part.chainage)
        out[0][begin:stop, rows], out[1][begin:stop, rows] = part.right, part.up
        begin = stop
    return Patches(chainage, arc, *out)


def row_medians(patches: Patches, least: float = 0.25) -> Float:
    """Return the median place of each row of arc (r, 2), right and up, m; NaN if less than ``least`` of it is seen."""
    count = np.isfinite(patches.right).sum(axis=0)
    out = np.full((len(patches.arc), 2), np.nan)
    indices = np.flatnonzero(count >= max(least * len(patches.chainage), 1.0))
    for k, values in enumerate((patches.right, patches.up)):
        ordered = np.sort(values[:, indices], axis=0)  # NaN last
        low, high = (count[indices] - 1) // 2, count[indices] // 2
        across = np.arange(len(indices))
        out[indices, k] = 0.5 * (ordered[low, across] + ordered[high, across])
    return out


def straightened(patches: Patches) -> Patches:
    """Remove the linear drift of a ring from the axis along its length, to the right and up.

    A row of arc that is seen over a part of the ring only would otherwise get the place of this part: beside fixtures the
    lining would seem to step by the skew between ring and axis. The drift is fitted with Tukey's biweight, each row about its
    own middle.
    """
    normals = inward_normals(row_medians(patches))
    inward = patches.right * normals[:, 0] + patches.up * normals[:, 1]
    along = np.where(np.isfinite(inward), patches.chainage[:, None], np.nan)
    count = np.isfinite(inward).sum(axis=0)
    selected = count > 1
    if selected.sum() < _MIN_ROWS:
        return patches
    away = (along[:, selected] - np.nanmean(along[:, selected], axis=0)).ravel()
    off = (inward[:, selected] - np.nanmedian(inward[:, selected], axis=0)).ravel()
    seen = np.isfinite(off)
    design = away[seen, None] * np.tile(normals[selected], (len(patches.chainage), 1))[seen]
    off, run = off[seen], np.zeros(2)
    for _ in range(_ROUNDS):
        left = off - design @ run
        scale = max(MAD_TO_SIGMA * float(np.median(np.abs(left))), _MIN_SCALE)
        weight = weights(left / (CUT * scale))[:, None]
        run = np.linalg.lstsq(design.T @ (weight * design), (weight * design).T @ off, rcond=1e-9)[0]
    middle = 0.5 * (patches.chainage[0] + patches.chainage[-1])
    shift = (patches.chainage - middle)[:, None] * run
    return Patches(patches.chainage, patches.arc, patches.right - shift[:, :1], patches.up - shift[:, 1:])


def inward_normals(places: Float) -> Float:
    """Return unit vectors (r, 2) into the tunnel, across the rows of places (r, 2), clockwise; NaN without neighbours."""
    filled = places.copy()
    seen = np.flatnonzero(np.isfinite(places[:, 0]))
    if len(seen) < 3:
        return np.full(places.shape, np.nan)
    index = np.arange(len(places))
    for k in range(2):
        filled[:, k] = np.interp(index, seen, places[seen, k])
    wide = 3
    padded = np.pad(filled, ((wide, wide), (0, 0)), mode="edge")
    along = padded[2 * wide :] - padded[: -2 * wide]
    length = np.hypot(along[:, 0], along[:, 1])
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.column_stack([along[:, 1], -along[:, 0]]) / length[:, None]
