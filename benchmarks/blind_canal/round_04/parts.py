"""Parts that the sections and surfaces of the scenes share."""

from __future__ import annotations

import numpy as np

from .trace import Field, Noise


def arch(right: float, left: float, springing: float, rise: float, count: int = 36) -> list[tuple[float, float]]:
    """Give points of half an ellipse, from the left springing over the crown to the right one."""
    angle = np.linspace(0.0, np.pi, count)
    middle, half = (right + left) / 2, (left - right) / 2
    return list(zip(middle + half * np.cos(angle), springing + rise * np.sin(angle), strict=True))


def masonry(
    seed: int, springing: float, bed: float, *, course: float, block: float, joint: float, deep: float, proud: float, mud: float
) -> Field:
    """Give the relief of walls of bricks or blocks, and of a muddy bed.

    Each block stands out by chance, `proud` is the deviation. `mud` is the deviation of the bed. All in m.
    """
    table = np.random.default_rng(seed).normal(size=(257, 263)) * proud
    wave, grain = Noise(seed + 1, 3, 0.5), Noise(seed + 2, 3, 0.09)
    broad, ripple = Noise(seed + 3, 2, 0.8), Noise(seed + 4, 2, 0.16)

    def wall(s: np.ndarray, q: np.ndarray, z: np.ndarray) -> np.ndarray:
        over = np.maximum(z - springing, 0.0)
        height = np.minimum(z, springing) + np.arctan2(over, np.abs(q)) * np.hypot(q, over)
        row = np.floor(height / course).astype(int)
        along = s / block + 0.5 * (row % 2)
        column = np.floor(along).astype(int)
        gap = (height - row * course < joint) | ((along - column) * block < joint)
        out = np.where(gap, -deep, table[row % 257, (column + (q > 0) * 101) % 263])
        return out + 0.006 * wave(s, q, z) + 0.0015 * grain(s, q, z)

    def floor(s: np.ndarray, q: np.ndarray, _: np.ndarray) -> np.ndarray:
        return mud * (0.8 * broad(s, q) + 0.25 * ripple(s, q))

    return blend(wall, floor, bed + 0.15, 0.25)


def blend(wall: Field, floor: Field, low: float, over: float) -> Field:
    """Give the relief of the floor below a height, of the wall above it, and of both in a band between."""

    def relief(s: np.ndarray, q: np.ndarray, z: np.ndarray) -> np.ndarray:
        share = np.clip((z - low) / over, 0.0, 1.0)
        out = np.zeros(len(s))
        for part, weight in ((wall, share), (floor, 1.0 - share)):
            w = np.flatnonzero(weight > 0.0)
            out[w] += weight[w] * part(s[w], q[w], z[w])
        return out

    return relief


def patches(seed: int, low: float, high: float, thick: float, cover: float) -> Field:
    """Give the thickness of weed at the walls, in m, in patches between two heights."""
    noise = Noise(seed, 2, 0.45)

    def weed(s: np.ndarray, q: np.ndarray, z: np.ndarray) -> np.ndarray:
        here = np.clip(noise(s, z * 0.6 + 40.0 * (q > 0)) + cover, 0.0, 1.5) / 1.5
        return thick * here * ((z > low) & (z < high))

    return weed
