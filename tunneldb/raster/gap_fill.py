"""Gaps between profiles, filled for display only: previews, the lining in QGIS and in the report.

If profiles are far apart, an image has gaps between them. A pixel without a point takes the value of the nearest one within
0.3 m, so that profiles up to 0.6 m apart join. Filled values are marked, and nothing is computed from them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from scipy import ndimage

from tunneldb.arrays import Single

MAX_FILL_DISTANCE = 0.3
"""Maximum distance of the value used to fill a gap, m."""

FILL_NOTE = f"gaps up to {2 * MAX_FILL_DISTANCE:g} m filled"
"""Note on a filled image."""


def fill_gaps(values: Single, reach: float) -> Single:
    """Fill pixels without a value or colour, NaN, with that of the nearest one within ``reach`` pixels."""
    empty = np.isnan(values if values.ndim == 2 else values[:, :, 0])
    if empty.all() or not empty.any():
        return values
    distance, (row, column) = ndimage.distance_transform_edt(empty, return_indices=True)
    filled = values[row, column]
    filled[distance > reach + 1e-6] = np.nan  # 0.3 m may be slightly less than three pixels of 0.1 m
    return np.asarray(filled, dtype=np.float32)


def fill_blocks(blocks: Iterable[tuple[int, Single]], reach: float) -> Iterator[tuple[int, Single]]:
    """Fill the gaps of consecutive blocks of columns, including gaps across a border between two of them.

    Parameters
    ----------
    blocks : iterable of (int, (rows, columns) float32 array)
        First column and values of each block, in increasing order, not necessarily adjacent. All have the same rows.
    reach : float
        Maximum distance as in :func:`fill_gaps`, pixels.

    Yields
    ------
    (int, (rows, columns) float32 array)
        The same blocks, filled; three of them are in memory.
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
    """Fill a block, with some columns of its neighbours if they are adjacent."""
    column, values = here
    parts, left = [values], 0
    if before is not None and before[0] + before[1].shape[1] == column:
        parts.insert(0, before[1][:, -edge:])
        left = parts[0].shape[1]
    if after is not None and column + values.shape[1] == after[0]:
        parts.append(after[1][:, :edge])
    return fill_gaps(np.concatenate(parts, axis=1), reach)[:, left : left + values.shape[1]]
