"""Reasons why coordinates are far from their expected place: common mistakes, tested one by one."""

from __future__ import annotations

import numpy as np
import scipy  # its modules are imported on first use: they take long

from tunneldb.arrays import Float

_FOOT = 0.3048  # m


def explain_misplacement(xyz: Float, vertices: Float, reach: float) -> str | None:
    """Return a guess which change of coordinates brings most points near a line; None if none of those tested does.

    Parameters
    ----------
    xyz : (n, 3) float array
        Points that are far from the line, finite.
    vertices : (k, 3) float array
        Vertices of the line, m.
    reach : float
        Greatest distance of near points, in plan, m; at least the distance between vertices.
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
    for factor, unit in ((0.001, "millimetres"), (_FOOT, "feet")):
        if np.median(scipy.spatial.cKDTree(factor * vertices[:, :2]).query(xyz[:, :2])[0]) <= reach:
            return f"they would fit if the axis is in {unit}"
    return None
