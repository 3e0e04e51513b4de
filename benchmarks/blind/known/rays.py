"""Rays of a scanner, in coordinates of the tunnel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.known.section import Array

Index = NDArray[np.intp]


@dataclass
class Hits:
    """Where rays meet a surface: distance, chainage, outline coordinate, cosine of the incidence."""

    t: Array
    u: Array
    s: Array
    cos: Array


class Rays:
    """Rays from about one place in the section; kept in the order of their direction across the tunnel.

    ``wander`` is how far the origins leave their mean position.
    """

    def __init__(self, origin: Array, direction: Array, time: Array, wander: float) -> None:
        phi = np.arctan2(direction[:, 2], direction[:, 1])
        order = np.argsort(phi)
        self.phi = phi[order]
        self.origin = origin[order]
        self.direction = direction[order]
        self.time = time[order]
        self.order = order
        self.wander = wander
        self.middle = origin[:, 1:].mean(axis=0)

    def window(self, y: float, z: float, radius: float) -> Index:
        """Rays that may pass within a radius of a line along the tunnel at (y, z)."""
        dy, dz = y - self.middle[0], z - self.middle[1]
        gap = np.hypot(dy, dz)
        reach = np.arcsin(min((radius + self.wander) / gap, 0.99)) + 0.003
        middle = np.arctan2(dz, dy)
        pieces = []
        for shift in (-2 * np.pi, 0.0, 2 * np.pi):
            low, high = np.searchsorted(self.phi, [middle - reach + shift, middle + reach + shift])
            pieces.append(np.arange(low, high))
        return np.concatenate(pieces)

    def take(self, index: Index) -> tuple[Array, Array]:
        """Origins and directions of some rays, each as three rows."""
        return self.origin[index].T, self.direction[index].T
