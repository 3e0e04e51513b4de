"""Why coordinates lie far from where they should: what people mix up most, tried out."""

from __future__ import annotations

import numpy as np
import scipy  # its parts when they are used: they take long to import

from tunneldb.arrays import Float

_FOOT = 0.3048  # m


def explain_misplacement(xyz: Float, vertices: Float, reach: float) -> str | None:
    """What would bring most places near a line, said as a guess; None if nothing that is tried does.

    Parameters
    ----------
    xyz : (n, 3) float array
        Places that lie far from the line, finite.
    vertices : (k, 3) float array
        Points of the line, m.
    reach : float
        How near is near, in plan, m; no less than the distance of the vertices.
    """
    tree = scipy.spatial.cKDTree(vertices[:, :2])
    tried = (
        (xyz[:, [1, 0]], "with x and y swapped"),
        (xyz[:, :2] / 1000.0, "as millimetres"),
        (xyz[:, :2] / 100.0, "as centimetres"),
        (xyz[:, :2] * _FOOT, "as feet"),
        (xyz[:, [1, 0]] / 1000.0, "as millimetres with x and y swapped"),
    )
    for plan, how in tried:
        if np.median(tree.query(plan)[0]) <= reach:
            return f"they would fit {how}"
    return None
