"""Random fields, and outlines of stains as signed fields over the unrolled lining (negative inside)."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

Array = NDArray[Any]
Field = Callable[[Array, Array], Array]


class Part(NamedTuple):
    """A piece of a stain.

    Attributes
    ----------
    box : tuple of float
        Where it lies: least and greatest chainage, least and greatest distance from the crown (m).
    field : callable
        Signed distance (m, negative inside) for chainage and distance from the crown, growing downwards.
    ragged : float
        Its outline wanders by no more than this (m), lest thin ones fall into pieces.
    """

    box: tuple[float, float, float, float]
    field: Field
    ragged: float = 1.0


def noise(rng: np.random.Generator, shape: tuple[int, int], scale: float | tuple[float, float]) -> Array:
    """Smooth noise of mean 0 and deviation 1 whose features measure about ``scale`` cells (per axis)."""
    scales = (scale, scale) if isinstance(scale, int | float) else scale
    step = [max(1.0, value / 2.5) for value in scales]
    coarse = tuple(int(np.ceil(size / by)) + 4 for size, by in zip(shape, step, strict=True))
    sigma = [value / by / 2.5 for value, by in zip(scales, step, strict=True)]
    grid = ndimage.gaussian_filter(rng.standard_normal(coarse).astype(np.float32), sigma, mode="wrap")
    grid /= grid.std() + 1e-9
    if step == [1.0, 1.0]:
        return grid[: shape[0], : shape[1]]
    rows = (np.arange(shape[0], dtype=np.float32) / step[0])[:, None]
    columns = (np.arange(shape[1], dtype=np.float32) / step[1])[None, :]
    r0, c0 = rows.astype(np.int32), columns.astype(np.int32)
    fr, fc = _ease(rows - r0), _ease(columns - c0)
    upper = grid[r0, c0] * (1 - fc) + grid[r0, c0 + 1] * fc
    lower = grid[r0 + 1, c0] * (1 - fc) + grid[r0 + 1, c0 + 1] * fc
    return np.asarray(upper * (1 - fr) + lower * fr)


def _ease(t: Array) -> Array:
    return t * t * (3 - 2 * t)


def inside(field: Array, soft: Array | float) -> Array:
    """1 well inside, 0 well outside, one half on the outline."""
    return 1 / (1 + np.exp(np.clip(field / soft, -30, 30)))


def blob(s: float, v: float, rs: float, rv: float) -> Part:
    """Ellipse with half axes ``rs`` along and ``rv`` around the tunnel."""

    def field(S: Array, V: Array) -> Array:
        return (np.hypot((S - s) / rs, (V - v) / rv) - 1) * min(rs, rv)

    return Part((s - rs, s + rs, v - rv, v + rv), field, 0.4 * min(rs, rv))


def run(s: float, v0: float, v1: float, w0: float, w1: float, sway: float = 0.05, phase: float = 0.0) -> Part:
    """Water that runs down from ``v0`` to ``v1``; ``w0`` and ``w1`` are its widths there, ``sway`` how far it wanders."""

    def field(S: Array, V: Array) -> Array:
        t = np.clip((V - v0) / (v1 - v0), 0, 1)
        middle = s + sway * (np.sin(2.1 * (V - v0) + phase) + 0.5 * np.sin(5.3 * V + 2 * phase) - np.sin(phase))
        half = (w0 + (w1 - w0) * t) / 2
        return np.hypot(np.abs(S - middle), np.maximum(np.maximum(v0 - V, V - v1), 0)) - half

    wide = max(w0, w1) / 2 + 2 * sway
    return Part((s - wide, s + wide, v0 - w0 / 2, v1 + w1 / 2), field, 0.17 * min(w0, w1))


def line(points: tuple[tuple[float, float], ...], half: float) -> Part:
    """Strip of half width ``half`` along a polyline of (chainage, distance from the crown)."""

    def field(S: Array, V: Array) -> Array:
        nearest = np.full(np.broadcast(S, V).shape, np.inf, np.float32)
        for (s0, v0), (s1, v1) in pairwise(points):
            ds, dv = s1 - s0, v1 - v0
            t = np.clip(((S - s0) * ds + (V - v0) * dv) / (ds * ds + dv * dv), 0, 1)
            nearest = np.minimum(nearest, np.hypot(S - s0 - t * ds, V - v0 - t * dv))
        return nearest - half

    s, v = [p[0] for p in points], [p[1] for p in points]
    return Part((min(s) - half, max(s) + half, min(v) - half, max(v) + half), field, 0.35 * half)


def sheet(s0: float, s1: float, v0: float, v1: float) -> Part:
    """Rectangle."""

    def field(S: Array, V: Array) -> Array:
        x, y = np.abs(S - (s0 + s1) / 2) - (s1 - s0) / 2, np.abs(V - (v0 + v1) / 2) - (v1 - v0) / 2
        return np.hypot(np.maximum(x, 0), np.maximum(y, 0)) + np.minimum(np.maximum(x, y), 0)

    return Part((s0, s1, v0, v1), field)


def curtain(s0: float, s1: float, v0: float, lengths: tuple[float, ...], width: float) -> tuple[Part, ...]:
    """Several runs side by side between ``s0`` and ``s1``, hanging from a wet strip at ``v0``."""
    runs = []
    for i, (s, length) in enumerate(zip(np.linspace(s0, s1, len(lengths)), lengths, strict=True)):
        wide = width * (1.0 + 0.55 * np.sin(2.4 * i + s0))
        at = float(s + 0.3 * (s1 - s0) / len(lengths) * np.sin(5.1 * i + s1))
        runs.append(run(at, v0, v0 + length, wide, wide * 0.55, 0.05, 1.7 * i))
    sag = 0.35 * width
    strip = ((s0, v0), (s0 + 0.3 * (s1 - s0), v0 + sag), (s0 + 0.65 * (s1 - s0), v0 - sag), (s1, v0))
    return (line(strip, width * 0.75), blob((s0 + s1) / 2, v0 + width, (s1 - s0) / 3, 1.6 * width), *runs)
