"""Shapes on the unrolled lining, as fields that are positive inside and measure metres from the rim."""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial import KDTree

from .arrays import FloatArray
from .canvas import CELL, Canvas, Window
from .noise import fractal, line

Path = list[tuple[float, float]]


def blobs(canvas: Canvas, parts: list[tuple[float, float, float, float]], margin: float) -> tuple[Window, FloatArray]:
    """Union of ellipses, each (s, t, half length along s, half length along t)."""
    low_s, high_s = min(p[0] - p[2] for p in parts) - margin, max(p[0] + p[2] for p in parts) + margin
    low_t, high_t = min(p[1] - p[3] for p in parts) - margin, max(p[1] + p[3] for p in parts) + margin
    window = canvas.window(low_s, high_s, low_t, high_t)
    field = np.full(window.shape, -np.inf)
    for s, t, a, b in parts:
        radius = np.hypot((window.s[:, None] - s) / a, (window.t[None, :] - t) / b)
        field = np.maximum(field, (1 - radius) * min(a, b))
    return window, field


def strip(canvas: Canvas, path: FloatArray, widths: FloatArray, margin: float) -> tuple[Window, FloatArray]:
    """Strip along a path of rows (s, t) with a half width at each."""
    reach = margin + float(widths.max())
    low, high = path.min(0) - reach, path.max(0) + reach
    window = canvas.window(low[0], high[0], low[1], high[1])
    steps = np.hypot(*np.diff(path, axis=0).T)
    along = np.concatenate([[0], np.cumsum(steps)])
    fine = np.linspace(0, along[-1], max(2, int(along[-1] / 0.015)))
    nodes = np.stack([np.interp(fine, along, path[:, i]) for i in range(2)], axis=1)
    half = np.interp(fine, along, widths)
    s, t = np.meshgrid(window.s, window.t, indexing="ij")
    distance, nearest = KDTree(nodes).query(np.stack([s.ravel(), t.ravel()], axis=1), distance_upper_bound=reach)
    half = np.append(half, 0.0)
    return window, (half[nearest] - np.minimum(distance, reach)).reshape(s.shape)


def rectangle(canvas: Canvas, s0: float, s1: float, t0: float, t1: float, margin: float) -> tuple[Window, FloatArray]:
    """Rectangle between two chainages and two girths, the girths in any order."""
    t0, t1 = sorted((t0, t1))
    window = canvas.window(s0 - margin, s1 + margin, t0 - margin, t1 + margin)
    gap_s = np.abs(window.s - (s0 + s1) / 2)[:, None] - (s1 - s0) / 2
    gap_t = np.abs(window.t - (t0 + t1) / 2)[None, :] - (t1 - t0) / 2
    outside = np.hypot(np.maximum(gap_s, 0), np.maximum(gap_t, 0))
    return window, -(outside + np.minimum(np.maximum(gap_s, gap_t), 0))


def falling(
    rng: np.random.Generator, s: float, t: float, length: float, width: float, wander: float = 0.08
) -> tuple[FloatArray, FloatArray]:
    """Path and half widths of water that runs down the lining: narrow above, broad in the middle, thin below."""
    x = np.linspace(0, 1, max(6, int(length / 0.06)))
    down = math.copysign(1.0, t)
    aside = wander * line(rng, x, 0.28) * x**0.5
    path = np.stack([s + aside, t + down * length * x], axis=1)
    profile = np.interp(x, [0, 0.1, 0.4, 0.8, 1.0], [0.55, 0.9, 1.0, 0.75, 0.35])
    return path, width / 2 * profile * np.clip(1 + 0.22 * line(rng, x, 0.12), 0.5, 1.6)


def wandering(
    rng: np.random.Generator, corners: Path, width: float, wander: float, uneven: float
) -> tuple[FloatArray, FloatArray]:
    """Path through corners that deviates by `wander` metres, with half widths that vary by the share `uneven`."""
    nodes = np.array(corners, dtype=float)
    steps = np.hypot(*np.diff(nodes, axis=0).T)
    along = np.concatenate([[0], np.cumsum(steps)])
    fine = np.linspace(0, along[-1], max(6, int(along[-1] / 0.05)))
    path = np.stack([np.interp(fine, along, nodes[:, i]) + wander * line(rng, fine, 0.5) for i in range(2)], axis=1)
    return path, width / 2 * np.clip(1 + uneven * line(rng, fine, 0.6), 0.25, 2.0)


def ragged(
    rng: np.random.Generator, canvas: Canvas, window: Window, field: FloatArray, rough: float, units: float
) -> FloatArray:
    """Field with a rim that is uneven by `rough` metres and that follows bricks or stones by `units` metres."""
    noise = fractal(rng, window.shape, CELL, (0.45, 0.14, 0.05), (0.75, 0.45, 0.15))
    return np.asarray(field + rough * noise + units * canvas.units[window.index])
