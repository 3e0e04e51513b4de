"""Rails whose track is known, and an example of an outline about it."""

from __future__ import annotations

import numpy as np

from tunneldb.measures.clearance.compute.track import GAUGE, HEAD
from tunneldb.shape.outline import Outline

BOX = Outline.of(np.array([[-1.6, 0.3], [-1.6, 3.0], [-1.0, 4.3], [1.0, 4.3], [1.6, 3.0], [1.6, 0.3]]), np.zeros(6), True)


def rails(middle: float, cant: float, rng: np.random.Generator, bend: float = 0.0, length: float = 200.0) -> np.ndarray:
    """Points of two heads: 15 a metre and rail on the top, 5 on the inner face, with 2 mm of noise."""
    parts = []
    for side in (-1.0, 1.0):
        for n, top in ((15, True), (5, False)):
            s = rng.uniform(0.0, length, round(n * length))
            across = rng.uniform(-HEAD / 2, HEAD / 2, len(s)) if top else np.full(len(s), -side * HEAD / 2)
            up = np.zeros(len(s)) if top else -rng.uniform(0.0, 0.12, len(s))
            x = side * (GAUGE + HEAD) / 2 + across
            angle = cant / (GAUGE + HEAD)
            place = np.column_stack([
                s, middle + bend * s**2 / 2 + np.cos(angle) * x + np.sin(angle) * up,
                -2.5 - np.sin(angle) * x + np.cos(angle) * up,
            ])  # fmt: skip
            parts.append(place + rng.normal(0.0, 0.002, place.shape) * [0, 1, 1])
    return np.vstack(parts)
