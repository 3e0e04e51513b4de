"""Gaps between profiles, closed in what is only looked at: previews, the lining in QGIS and in the report.

Where profiles lie far apart, an image has gaps between them. A pixel without a point takes the value of the nearest one within
0.3 m, so that profiles up to 0.6 m apart join. Nobody measured there: what is filled says so, and nothing is computed from it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from scipy import ndimage

from tunneldb.arrays import Single

FILL = 0.3
"""Gaps are filled from values at most so far away, m."""

TOLD = f"gaps up to {2 * FILL:g} m filled"
"""How an image says it."""


def fill_gaps(values: Single, reach: float) -> Single:
    """Give pixels without a value, NaN, that of the nearest one within ``reach`` pixels."""
    empty = np.isnan(values)
    if empty.all() or not empty.any():
        return values
    distance, (row, column) = ndimage.distance_transform_edt(empty, return_indices=True)
    filled = values[row, column]
    filled[distance > reach + 1e-6] = np.nan  # 0.3 m may be a hair less than three pixels of 0.1 m
    return np.asarray(filled, dtype=np.float32)


def fill_blocks(blocks: Iterable[tuple[int, Single]], reach: float) -> Iterator[tuple[int, Single]]:
    """Fill the gaps of blocks of columns one after another, also those that a border between two of them crosses.

    Parameters
    ----------
    blocks : iterable of (int, (rows, columns) float32 array)
        First column and values of each block, in growing order; they need not touch. All have the same rows.
    reach : float
        As in :func:`fill_gaps`, pixels.

    Yields
    ------
    (int, (rows, columns) float32 array)
        The same blocks, filled; three of them lie in memory.
    """
    edge = int(np.ceil(reach))
    before: tuple[int, Single] | None = None
    here: tuple[int, Single] | None = None
    for after in blocks:
        if here is not None:
            yield here[0], _filled(before, here, after, edge, reach)
        before, here = here, after
    if here is not None:
        yield here[0], _filled(before, here, None, edge, reach)


def _filled(
    before: tuple[int, Single] | None, here: tuple[int, Single], after: tuple[int, Single] | None, edge: int, reach: float
) -> Single:
    """Fill a block, knowing so many columns of those beside it if they touch it."""
    column, values = here
    parts, left = [values], 0
    if before is not None and before[0] + before[1].shape[1] == column:
        parts.insert(0, before[1][:, -edge:])
        left = parts[0].shape[1]
    if after is not None and column + values.shape[1] == after[0]:
        parts.append(after[1][:, :edge])
    return fill_gaps(np.concatenate(parts, axis=1), reach)[:, left : left + values.shape[1]]
