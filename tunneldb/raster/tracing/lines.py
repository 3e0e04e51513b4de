"""Centre lines of the areas of a mask, in pixels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.spatial import KDTree

from tunneldb.arrays import Float, Int64
from tunneldb.raster.tracing.graph import SIDES, join_edges, make_graph, pixels_beside, remove_spurs

SMOOTHING = 2.0
"""Standard deviation of the smoothing along a line, pixels: the steps of pixels would lengthen a line by up to 8 %."""

SPUR = 1.5
"""Maximum length of a spur in half widths of the area, besides MIN_SPUR."""

MIN_SPUR = 2.0
"""Length that is added to the maximum length of a spur, pixels."""

REACH = 8
"""Number of pixels at an end that give its direction."""


@dataclass(frozen=True)
class Centreline:
    """Centre line of a part of a mask.

    Attributes
    ----------
    points : (n, 2) array
        Row and column of its vertices; the middle of the first pixel of an image is at 0.5, 0.5.
    pixels : float
        Number of the mask's pixels that belong to it.
    """

    points: Float
    pixels: float


def trace(thinned: Int64, mask: Int64) -> list[Centreline]:
    """Return the centre lines of a mask.

    Parameters
    ----------
    thinned : (n, 2) array
        Row and column of the thinned pixels.
    mask : (m, 2) array
        Row and column of all pixels of the mask.
    """
    if not len(thinned):
        return []
    graph = make_graph(thinned)
    _, nearest = KDTree(thinned).query(mask)
    rim = mask[(np.stack(pixels_beside(mask, SIDES)) < 0).any(axis=0)]
    half = KDTree(rim).query(thinned)[0] + 0.5
    owner = np.arange(len(thinned))
    for spur in remove_spurs(graph, SPUR * half + MIN_SPUR):
        owner[spur.pixels] = spur.pixels[0] if spur.nodes[0] >= 0 else spur.pixels[-1]
    lines = join_edges(graph, int(2 * np.median(half)))
    uses = np.bincount(np.concatenate([np.zeros(0, np.int64), *lines]), minlength=len(thinned))
    area = np.bincount(owner[nearest], minlength=len(thinned)) / np.maximum(uses, 1)
    free = graph.free_ends()
    by_owner = np.argsort(owner[nearest], kind="stable")
    first = np.searchsorted(owner[nearest][by_owner], np.arange(len(thinned) + 1))
    found = []
    for pixels in lines:
        points = thinned[pixels].astype(np.float64) + 0.5
        ends = [
            mask[by_owner[first[pixel] : first[pixel + 1]]].astype(np.float64) + 0.5
            if pixel in free and pixels[0] != pixels[-1]
            else None
            for pixel in (pixels[0], pixels[-1])
        ]
        found.append(Centreline(_extended(_smoothed(points), points, ends), float(area[pixels].sum())))
    return found


def _smoothed(points: Float) -> Float:
    """Return the vertices of a line without the steps of pixels; its ends stay, a ring stays closed."""
    if len(points) > 3 and (points[0] == points[-1]).all():
        ring = ndimage.gaussian_filter1d(points[:-1], SMOOTHING, axis=0, mode="wrap")
        return np.concatenate([ring, ring[:1]])
    smooth = np.asarray(ndimage.gaussian_filter1d(points, SMOOTHING, axis=0, mode="nearest"))
    smooth[0], smooth[-1] = points[0], points[-1]
    return smooth


def _extended(line: Float, points: Float, ends: Sequence[Float | None]) -> Float:
    """Return a line extended at its free ends to the rim of the mask, from which thinning shortened it.

    Parameters
    ----------
    line, points : (n, 2) array
        Line, smoothed and not.
    ends : sequence of (k, 2) array or None
        Pixels of the mask that belong to its first and its last pixel; None where it is not extended.
    """
    parts = [line]
    for side, (own, along) in enumerate(zip(ends, (points, points[::-1]), strict=True)):
        away = along[0] - along[min(REACH, len(along) - 1)]
        size = float(np.hypot(*away))
        if own is None or not size > 0:
            continue
        rim = along[0] + away / size * (max(float(((own - along[0]) @ away).max(initial=0.0)) / size, 0.0) + 0.5)
        parts.insert(0 if side == 0 else len(parts), rim[None])
    return np.concatenate(parts)
