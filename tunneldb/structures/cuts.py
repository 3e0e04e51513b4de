"""Straight edges that cut a region off its face, from rim to rim: of a coat of paint, a tape, or another part in its plane.

Rust and damp can cover a beam from rim to rim, but their edge is ragged. The edge of a coat or of a plate is straight.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from tunneldb.arrays import Bool, Float, Int64

MAX_DEVIATION = 0.5
"""Maximum mean deviation of the edge from its lines, pixels: an edge can lie anywhere in a pixel."""

MIN_LENGTH = 8
"""Minimum length of an edge, pixels, as of a block along a line between materials: a shorter one is straight by chance."""

MIN_DEPTH = 4.0
"""Minimum depth of the region behind an edge, pixels: the edge of a half disc of that depth deviates by about 0.9."""

NEAR = 2.0
"""Maximum distance of the pixels that a line is fitted to, pixels."""

MIN_SHARE = 0.9
"""Minimum share of the edge that is on its lines: the rest may be gaps between points."""

SIDES, FITS = 2, 3


def cuts_of(mask: Bool, face: Bool) -> int:
    """Return the number of straight lines, 1 or 2, that cut a region off the rest of its face; 0 if other edges do.

    Parameters
    ----------
    mask : (rows, columns) bool array
        The region, with a margin of a pixel.
    face : (rows, columns) bool array
        The judged part of the face there.
    """
    points, piece = edge_of(mask, face & ~mask)
    centres = np.argwhere(mask)[:, ::-1] + 0.5
    off, count = np.full(len(points), np.inf), 0
    for _ in range(SIDES):
        left = off > NEAR
        if left.sum() < MIN_LENGTH:
            break
        near = left & (piece == np.bincount(piece[left]).argmax())
        for _ in range(FITS):
            if near.sum() < MIN_LENGTH:
                return 0
            middle, normal = line_of(points[near])
            away = np.abs((points - middle) @ normal)
            near = away <= NEAR
        if np.abs((centres - middle) @ normal).max() < MIN_DEPTH:
            return 0
        off, count = np.minimum(off, away), count + 1
    on = off <= NEAR
    return count if count and on.mean() >= MIN_SHARE and off[on].mean() <= MAX_DEVIATION else 0


def edge_of(mask: Bool, rest: Bool) -> tuple[Float, Int64]:
    """Return the middles (n, 2) of pixel sides between a region and the rest, x and y, and the piece of the edge of each."""
    piece = ndimage.label(ndimage.binary_dilation(mask) & rest, np.ones((3, 3)))[0]
    points, pieces = [np.empty((0, 2))], [np.empty(0, np.int64)]
    for axis, step in ((0, 1), (0, -1), (1, 1), (1, -1)):
        beyond = np.roll(rest, -step, axis) & mask  # the margin is empty, so nothing comes around
        at = np.argwhere(beyond)
        shift = np.zeros(2)
        shift[axis] = 0.5 * step
        points.append((at + 0.5 + shift)[:, ::-1])
        pieces.append(np.roll(piece, -step, axis)[beyond].astype(np.int64))
    return np.concatenate(points), np.concatenate(pieces)


def line_of(points: Float) -> tuple[Float, Float]:
    """Return middle and normal of the line through points (n, 2)."""
    middle = points.mean(axis=0)
    return middle, np.linalg.svd(points - middle, full_matrices=False)[2][1]
