"""Thinning of masks to lines one pixel wide.

Z. Guo and R. W. Hall (1989): Parallel thinning with two-subiteration algorithms. Communications of the ACM 32(3), 359–373,
algorithm A1.
"""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Bool


def _table(first: bool) -> Bool:
    """Return for each code of the eight neighbours, clockwise from above, whether a subiteration deletes a pixel."""
    up, up_right, right, down_right, down, down_left, left, up_left = (np.arange(256)[:, None] >> np.arange(8) & 1).T.astype(
        bool
    )
    pieces = (
        (~up & (up_right | right)).astype(int) + (~right & (down_right | down)) + (~down & (down_left | left))
        + (~left & (up_left | up))
    )  # fmt: skip
    pairs = np.minimum(
        (up_left | up).astype(int) + (up_right | right) + (down_right | down) + (down_left | left),
        (up | up_right).astype(int) + (right | down_right) + (down | down_left) + (left | up_left),
    )
    side = (down | down_left | ~up_left) & left if first else (up | up_right | ~down_right) & right
    return np.asarray((pieces == 1) & (pairs >= 2) & (pairs <= 3) & ~side)


_TABLES = _table(True), _table(False)


def thin(mask: Bool) -> Bool:
    """Return the pixels (rows, columns) of the lines to which the areas of a mask are thinned.

    Connections and ends stay; holes of one pixel are filled.
    A pixel depends on pixels at most as far away as twice the width of the areas.
    """
    image = np.pad(mask, 1).astype(np.uint8)
    image[1:-1, 1:-1] |= image[:-2, 1:-1] & image[2:, 1:-1] & image[1:-1, :-2] & image[1:-1, 2:]
    flat, width = image.reshape(-1), image.shape[1]
    around = np.array([-width, 1 - width, 1, width + 1, width, width - 1, -1, -width - 1])
    weights = (1 << np.arange(8)).astype(np.uint8)
    left = np.flatnonzero(flat)
    while True:
        before = len(left)
        for table in _TABLES:
            deleted = table[(flat[left[:, None] + around] * weights).sum(axis=1, dtype=np.uint8)]
            flat[left[deleted]] = 0
            left = left[~deleted]
        if len(left) == before:
            return np.asarray(image[1:-1, 1:-1].astype(bool))
