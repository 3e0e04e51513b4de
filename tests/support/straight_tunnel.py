"""Straight tunnels whose sections are drawn by hand."""

import numpy as np

from tunneldb.geometry.frame import segment_rows, tangents
from tunneldb.geometry.surface import Surface

LENGTH = 60.0


def straight(radius: np.ndarray) -> Surface:
    """A level tunnel along x (right is −y) with sections every 5 m; radius (k, 361) or (361,)."""
    chainage = np.arange(0.0, LENGTH + 1, 10.0)
    vertices = np.column_stack([chainage, np.zeros(len(chainage)), np.full(len(chainage), 100.0)])
    at = np.arange(2.5, LENGTH, 5.0)
    radius = np.broadcast_to(radius, (len(at), 361)).copy()
    angle = np.radians(np.arange(361) - 180.0)
    u, w = radius * np.sin(angle), radius * np.cos(angle)
    length = np.concatenate([np.zeros((len(at), 1)), np.cumsum(np.hypot(np.diff(u), np.diff(w)), axis=1)], axis=1)
    rows = segment_rows(vertices, tangents(vertices))
    return Surface(
        np.arange(len(rows)),
        rows,
        np.column_stack([chainage[:-1], chainage[1:]]),
        at,
        radius,
        length - length[:, 180:181],
        10.0,
    )
