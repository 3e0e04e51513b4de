"""How amplitude falls with range and incidence, for a few kinds of instruments and surfaces, and patterns of masonry."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import ndimage

from .canvas import Canvas, Window

Law = Callable[[np.ndarray], np.ndarray]


def pulsed(near: float, power: float = 2.2) -> Law:
    """Time of flight: the square of the range, and less close by, where the receiver does not see the whole spot."""

    def fall(far: np.ndarray) -> np.ndarray:
        far = np.maximum(far, 0.3)
        return -20 * np.log10(far / 10) + 10 * np.log10(1 - np.exp(-((far / near) ** power)))

    return fall


def phase(near: float, slope: float, haze: float) -> Law:
    """Phase comparison with a logarithmic receiver: a flatter fall, a maximum some metres away."""

    def fall(far: np.ndarray) -> np.ndarray:
        far = np.maximum(far, 0.3)
        return -slope * np.log10(1 + (far / near) ** 2) / 2 - haze * far - 2.5 * np.exp(-((far / (0.6 * near)) ** 2))

    return fall


def matt(flat: float) -> Law:
    """A rough surface: Lambert's cosine, softened by ``flat``."""
    return lambda square: 10 * np.log10(flat + (1 - flat) * square)


def glossy(flat: float, shine: float, width: float) -> Law:
    """Paint or smooth concrete: as :func:`matt`, and brighter where the beam is square; ``width`` in radians."""

    def tilt(square: np.ndarray) -> np.ndarray:
        angle = np.arccos(np.clip(square, 0, 1))
        return 10 * np.log10(flat + (1 - flat) * square + shine * np.exp(-((angle / width) ** 2)))

    return tilt


def masonry(
    canvas: Canvas,
    window: Window,
    course: float,
    length: float,
    joint: float,
    spread: float,
    mortar: float,
    depth: float,
    uneven: float = 0.0,
    relief: float = 0.0,
) -> np.ndarray:
    """Paint courses of bricks or stones along the tunnel; returns a number for each pixel's stone, of unit spread.

    ``joint`` is the half width of the mortar joints, ``spread`` that of tones (dB), ``mortar`` its tone, ``depth`` how
    far it is set back, ``uneven`` how much sizes of courses and stones differ as a share, ``relief`` how much stones
    stand out (metres).
    """
    rng, pixel = canvas.rng, canvas.pixel
    u, s = window.u[:, 0], window.s[0]
    edges = np.cumsum(course * (1 + uneven * rng.uniform(-1, 1, int((u[-1] - u[0]) / course * 1.6) + 4))) + u[0] - course
    number = np.searchsorted(edges, u)
    value = np.zeros(window.shape, dtype=np.float32)
    share = np.zeros(window.shape, dtype=np.float32)
    stand = np.zeros(window.shape, dtype=np.float32)
    for row in np.unique(number):
        at = np.flatnonzero(number == row)
        count = int((s[-1] - s[0]) / length * 1.7) + 4
        sizes = length * (1 + uneven * rng.uniform(-1, 1, count))
        if not uneven:
            sizes = np.where(row % 2, length, length / 2) * np.ones(2 * count)
        heads = np.cumsum(sizes) + s[0] - length * rng.uniform(0.9, 1.1)
        stone = np.searchsorted(heads, s)
        tones = rng.standard_normal(stone.max() + 1)
        value[at] = tones[stone]
        stand[at] = rng.standard_normal(stone.max() + 1)[stone]
        sway = 0.15 * joint * rng.standard_normal()
        upright = np.abs(s - heads[np.clip(stone, 0, len(heads) - 1)])
        upright = np.minimum(upright, np.abs(s - heads[np.clip(stone - 1, 0, len(heads) - 1)]))
        lying = np.minimum(np.abs(u[at] - edges[row]), np.abs(u[at] - edges[max(row - 1, 0)])) + sway
        away = np.minimum(lying[:, None], upright[None, :])
        share[at] = np.clip((joint - away) / pixel + 0.5, 0, 1)
    share *= np.clip(0.75 + 0.35 * canvas.fractal(window, 0.8, 0.05), 0, 1.2)
    canvas.base[window.at] += spread * value * (1 - share) + mortar * share
    canvas.bump[window.at] += ndimage.gaussian_filter(relief * stand * (1 - share) - depth * share, 0.6)
    return value
