"""Regions that the shape of a face or a straight line explains: parts flush with it, and seams.

A tab that is flush with a joist is within its plane, and no noise of ranges separates the two. But the rim of the joist goes on
along the foot of the tab. Rust on a face with a straight rim has the face beside it.

A weld, a joint or a wire is a straight line of one or two pixels, which goes on beyond the significant region. A crack is not
straight, and rust is wider.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from tunneldb.arrays import Bool, Float, Single
from tunneldb.structures.cuts import edge_of, line_of

REACH = 24
"""Distance around a region within which its face is compared with it, pixels: at most half of the length of a seam."""

MIN_FOOT, MIN_DEPTH = 6, 2.0
"""Minimum length of the foot of a part, in edges of pixels, and minimum height of the part, pixels."""

MAX_DEVIATION = 1.5
"""Maximum deviation of the foot from its line, and of the rim beside it, pixels: rims are not judged, feet are."""

FLANK = 8.0
"""Length of the rim beside the foot that is compared with it, pixels."""

BEHIND = 5.0
"""Depth of the strip of the face's own side that is looked at, pixels."""

MAX_BESIDE, MIN_BEHIND = 0.1, 0.4
"""Maximum share of the pixels beside the part that are on the face, and minimum share of those on the face's own side."""

ANGLES = np.radians(np.arange(0.0, 180.0, 2.0))
"""Directions of seams that are compared."""

BAND = 8
"""Distance from the line within which contrast is compared, pixels."""

MAX_WIDTH = 2.0
"""Maximum width of a seam, pixels: what is narrower than a pixel lies in one or two of them. A streak of rust is wider."""

SEGMENT, MIN_SEGMENTS, MIN_PRESENT = 4, 7, 0.75
"""Length of the segments of a seam, pixels, minimum number of them, and minimum share that shows the seam."""


def is_attached(mask: Bool, face: Bool) -> bool:
    """Return True if a region lies wholly beyond the straight rim of the rest of its face.

    Parameters
    ----------
    mask : (rows, columns) bool array
        The region, with a margin of a pixel or more.
    face : (rows, columns) bool array
        The judged part of the face there.
    """
    rest = face & ~mask
    foot, _ = edge_of(mask, rest)
    if len(foot) < MIN_FOOT:
        return False
    middle, normal = line_of(foot)
    if np.abs((foot - middle) @ normal).mean() > MAX_DEVIATION:
        return False
    direction = np.array([normal[1], -normal[0]])
    away, along = _placed(mask, middle, normal, direction)
    if away.mean() < 0.0:
        normal, away = -normal, -away
    depth = float(away.max())
    if depth < MIN_DEPTH or away.min() < -2.0 * MAX_DEVIATION:
        return False
    begin, end = np.percentile((foot - middle) @ direction, [0, 100])
    away, along = _placed(rest, middle, normal, direction)
    for flank in ((along > end + 1.0) & (along <= end + 1.0 + FLANK), (along < begin - 1.0) & (along >= begin - 1.0 - FLANK)):
        beside = np.count_nonzero(flank & (away > MAX_DEVIATION) & (away <= depth)) / (FLANK * max(depth - MAX_DEVIATION, 1.0))
        behind = np.count_nonzero(flank & (away < 0.0) & (away >= -BEHIND)) / (FLANK * BEHIND)
        if beside > MAX_BESIDE or behind < MIN_BEHIND:
            return False
    return True


def is_seam(mask: Bool, drop: Single, judged: Bool) -> bool:
    """Return True if a region is a part of a straight line of one or two pixels that goes on beyond it.

    Parameters
    ----------
    mask : (rows, columns) bool array
        The region, with a margin of `REACH`.
    drop : (rows, columns) float32 array
        Contrast, dB, positive where it is of the kind of the region.
    judged : (rows, columns) bool array
    """
    at = np.argwhere(judged)[:, ::-1] + 0.5
    value, inside = drop[judged].astype(np.float64), mask[judged]
    if not inside.any() or ndimage.binary_erosion(mask, iterations=3).any():  # wider than windows make a line
        return False
    middle = at[inside].mean(axis=0)
    off = at - middle
    near = np.hypot(*off.T) <= REACH
    off, value, inside = off[near], value[near], inside[near]
    found = [(*_peak(off @ np.array([-np.sin(a), np.cos(a)]), value), a) for a in ANGLES]
    peak, place, angle = max(found)
    across = off @ np.array([-np.sin(angle), np.cos(angle)]) - place
    along = off @ np.array([np.cos(angle), np.sin(angle)])
    beside = (np.abs(across) > 2.5) & (np.abs(across) <= BAND)
    if peak <= 0.0 or not beside.any():
        return False
    background = float(np.median(value[beside]))
    lines = [value[np.abs(across - shift) <= 0.5] for shift in (-2.0, -1.0, 0.0, 1.0, 2.0)]
    width = sum(float(line.mean()) - background for line in lines if len(line)) / peak
    aside = inside & (np.abs(across) > 2.0)
    if width > MAX_WIDTH or (aside.any() and value[aside].mean() > 0.5 * peak):
        return False
    line = np.abs(across) <= 1.0
    segment = np.floor((along[line] + REACH) / SEGMENT).astype(np.int64)
    count = np.bincount(segment, minlength=1)
    known = count >= SEGMENT // 2
    shown = np.bincount(segment, value[line], minlength=1)[known] / count[known] - background
    if len(shown) < MIN_SEGMENTS:
        return False
    present = int(np.count_nonzero(shown > 0.5 * max(float(np.median(shown)), 0.5 * peak)))
    return present >= max(MIN_SEGMENTS, MIN_PRESENT * len(shown))


def _peak(across: Float, value: Float) -> tuple[float, float]:
    """Return the greatest mean of a line of pixels, over the median of the lines about it, and its distance from the middle."""
    bin_ = np.floor(across + BAND + 0.5).astype(np.int64)
    use = (bin_ >= 0) & (bin_ <= 2 * BAND)
    count = np.bincount(bin_[use], minlength=2 * BAND + 1)
    mean = np.bincount(bin_[use], value[use], minlength=2 * BAND + 1) / np.maximum(count, 1)
    known = count >= REACH // 2
    if known.sum() < BAND:
        return 0.0, 0.0
    centre = np.where(known, mean, -np.inf)[BAND // 2 : -(BAND // 2)]
    best = int(np.argmax(centre)) + BAND // 2
    return float(centre.max() - np.median(mean[known])), float(best - BAND)


def _placed(mask: Bool, middle: Float, normal: Float, direction: Float) -> tuple[Float, Float]:
    """Return the distance of pixels from a line, and their place along it."""
    off = np.argwhere(mask)[:, ::-1] + 0.5 - middle
    return off @ normal, off @ direction
