"""Match leaks of an earlier run with those found now, as a whole or in parts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon

MIN_IOU = 0.3
"""Minimum intersection over union of two outlines of the same leak."""


def match(before: Sequence[Polygon], now: Sequence[Polygon], min_iou: float = MIN_IOU) -> dict[int, int]:
    """Pair earlier leaks with those found now, by mutual best overlap.

    Parameters
    ----------
    before, now : sequences of Polygon
        Outlines in the unrolled plane, m.
    min_iou : float
        Minimum intersection over union of a pair.

    Returns
    -------
    dict
        Index in ``now`` → index in ``before``; each index occurs at most once.
    """
    if not before or not now:
        return {}
    earlier, later = np.asarray(before, dtype=object), np.asarray(now, dtype=object)
    n, b = shapely.STRtree(earlier).query(later, predicate="intersects")
    shared = shapely.area(shapely.intersection(later[n], earlier[b]))
    iou = shared / (shapely.area(later[n]) + shapely.area(earlier[b]) - shared)
    best_now, best_before = _best(n, iou, len(later)), _best(b, iou, len(earlier))
    return {int(n[k]): int(b[k]) for k in range(len(n)) if iou[k] >= min_iou and best_now[n[k]] == k and best_before[b[k]] == k}


def match_parts(
    before: Sequence[Polygon], reviewed: Sequence[bool], now: Sequence[Polygon], min_share: float = MIN_IOU
) -> dict[int, int]:
    """Pair leaks across a kilometre boundary with earlier ones that contain them, or the reverse.

    They are the same if they share enough of the smaller one. Among several, a reviewed one is preferred, then the one
    with the largest overlap.

    Parameters
    ----------
    before, now : sequences of Polygon
        Outlines in the unrolled plane, m.
    reviewed : sequence of bool
        True for reviewed earlier leaks.
    min_share : float
        Minimum intersection of a pair divided by the area of the smaller one.

    Returns
    -------
    dict
        Index in ``now`` → index in ``before``; each index occurs at most once.
    """
    pairs = []
    for n, later in enumerate(now):
        for b, earlier in enumerate(before):
            shared = later.intersection(earlier).area if later.intersects(earlier) else 0.0
            if shared >= min_share * min(later.area, earlier.area) and shared > 0.0:
                pairs.append((not reviewed[b], -shared, b, n))
    found: dict[int, int] = {}
    for _, _, b, n in sorted(pairs):
        if n not in found and b not in found.values():
            found[n] = b
    return found


def _best(owner: NDArray[Any], iou: NDArray[Any], count: int) -> NDArray[Any]:
    """Return the pair with the greatest overlap for each owner, the first of several; -1 if there is none."""
    best = np.full(count, -1)
    for k in np.argsort(-iou, kind="stable")[::-1]:
        best[owner[k]] = k
    return best
