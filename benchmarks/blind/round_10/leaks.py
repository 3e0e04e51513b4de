"""Water on a lining: patches, wet joints, tongues, fans, streaks and damp feet of walls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from . import noise
from .canvas import Canvas, Leak, Window, cover, ellipse, stroke
from .dry import wander


@dataclass(frozen=True)
class Look:
    """How a leak looks.

    Attributes
    ----------
    drop : float
        About how much it is darker than the dry surface (dB).
    edge : tuple of float
        Widths of its sharpest and its softest edge (metres).
    rough : float
        How ragged its outline is (metres).
    scale : float
        Longest waves of the outline (metres).
    texture : float
        How uneven it is within, as a share.
    salt : float
        How much brighter a fringe of salts is (dB).
    salt_width : float
        Width of the fringe (metres).
    """

    drop: float
    edge: tuple[float, float] = (0.015, 0.08)
    rough: float = 0.025
    scale: float = 0.3
    texture: float = 0.15
    salt: float = 0.0
    salt_width: float = 0.06


def soak(canvas: Canvas, window: Window, inside: np.ndarray, look: Look, phenomenon: str, limit: str | None = None) -> None:
    """Wet the canvas where ``inside`` is positive.

    Water runs and dries along the section, so that outline and tone have threads in that direction; about the wet there is a
    haze of at most a fifth of its darkening, which is not part of the outline.
    """
    threads = canvas.fractal(window, 0.11, 0.02, stretch=3.5)
    rim = inside + look.rough * (0.85 * canvas.fractal(window, look.scale, 0.03) + 0.5 * threads)
    mix = 1 / (1 + np.exp(-1.5 * canvas.fractal(window, 0.6, 0.15)))
    edge = np.exp(np.log(look.edge[0]) + mix * np.log(look.edge[1] / look.edge[0]))
    share = cover(rim, edge)
    depth = (
        0.95
        + look.texture * canvas.fractal(window, 0.5, 0.04)
        + 0.25 * np.clip(rim / 0.12, 0, 1)
        + 0.6 * look.texture * threads
    )
    haze = np.clip(1 + rim / 0.14, 0, 1) ** 2 * np.clip(0.12 + 0.1 * canvas.fractal(window, 0.5, 0.1), 0, 0.2)
    dark = (look.drop * np.maximum(share * np.clip(depth, 0.7, 1.45), haze)).astype(np.float32)
    canvas.wet[window.at] = np.maximum(canvas.wet[window.at], dark)
    number = len(canvas.leaks) + 1
    label = canvas.label[window.at]
    label[(share > 0.5) & (label == 0)] = number
    canvas.leaks.append(Leak(number, phenomenon, limit))
    if look.salt:
        ring = np.exp(-(((rim + 0.6 * look.salt_width) / (0.5 * look.salt_width)) ** 2))
        spots = np.clip(0.5 + 0.6 * canvas.fractal(window, 0.3, 0.03), 0, 1.3)
        bright = look.salt * ring * spots * (share < 0.5)
        canvas.base[window.at] += bright.astype(np.float32)
        canvas.note("salt", window, bright > 0.5 * look.salt)


def tongue(
    canvas: Canvas, s: float, u: float, length: float, half: float, side: int, widen: float = 0.6
) -> tuple[np.ndarray, np.ndarray]:
    """A line down the lining and its half widths; ``widen`` is the last of them as a share of the greatest."""
    rng = canvas.rng
    points = wander(rng, (s, u), (s + rng.normal(0, 0.04 * length + 0.02), u + side * length), 0.04 + 0.02 * length)
    part = np.linspace(0, 1, len(points))
    widths = half * np.interp(part, [0, 0.25, 0.7, 1], [0.75, 1, (1 + widen) / 2, widen]) * rng.uniform(0.65, 1.3, len(points))
    return points, widths


def _around(canvas: Canvas, points: np.ndarray, pad: float) -> Window:
    low, high = points.min(axis=0) - pad, points.max(axis=0) + pad
    return canvas.window(low[0], high[0], low[1], high[1])


def strokes(
    canvas: Canvas,
    parts: Sequence[tuple[np.ndarray, np.ndarray | float]],
    look: Look,
    phenomenon: str,
    limit: str | None = None,
    stop: float | None = None,
) -> None:
    """One leak made of several strokes; ``stop`` is a ``u`` that it does not pass (the floor), seen from the crown."""
    everything = np.concatenate([p for p, _ in parts])
    widest = max(float(np.max(w)) for _, w in parts)
    window = _around(canvas, everything, widest + 3 * look.rough + look.edge[1] + 2 * look.salt_width)
    inside = np.full(window.shape, -10.0, dtype=np.float32)
    for points, widths in parts:
        np.maximum(inside, stroke(window, points, widths), out=inside)
    if stop is not None:
        inside = np.where(np.sign(stop) * (window.u - stop) > 0, -10.0, inside)
    soak(canvas, window, inside, look, phenomenon, limit)


def patch(
    canvas: Canvas,
    s: float,
    u: float,
    half_s: float,
    half_u: float,
    look: Look,
    phenomenon: str = "patch",
    limit: str | None = None,
) -> None:
    """A damp patch, of a few overlapping ovals; off the crown water runs out of it here and there."""
    rng = canvas.rng
    pad = 1.6 * max(half_s, half_u) + 4 * look.rough
    side = 1 if u > 0 else -1
    runs = rng.integers(1, 4) if abs(u) > 1.0 and half_u > 0.3 else 0
    below = (1.2 * half_u if runs else 0.0) * side
    window = canvas.window(s - pad, s + pad, min(u - pad, u - pad + below), max(u + pad, u + pad + below))
    inside = ellipse(window, s, u, half_s, half_u, rng.uniform(-0.3, 0.3))
    for _ in range(rng.integers(3, 6)):
        shift = rng.uniform(-0.8, 0.8, 2) * (half_s, half_u)
        size = rng.uniform(0.25, 0.55, 2) * (half_s, half_u)
        np.maximum(inside, ellipse(window, s + shift[0], u + shift[1], size[0], size[1], rng.uniform(-1, 1)), out=inside)
    for _ in range(runs):
        start = (s + rng.uniform(-0.6, 0.6) * half_s, u + 0.4 * side * half_u)
        points, widths = tongue(canvas, *start, rng.uniform(0.7, 1.6) * half_u, rng.uniform(0.12, 0.25) * half_s, side, 0.4)
        np.maximum(inside, stroke(window, points, widths), out=inside)
    soak(canvas, window, inside, look, phenomenon, limit)


def joint(
    canvas: Canvas,
    points: Sequence[tuple[float, float]],
    half: float,
    look: Look,
    phenomenon: str = "wet joint",
    tongues: Sequence[tuple[float, float, float, int]] = (),
    stop: float | None = None,
    limit: str | None = None,
) -> None:
    """Water along a joint or a crack, and ``tongues`` (share of the way along, length, half width, side) that run down
    from it."""
    rng = canvas.rng
    corners = np.asarray(points, dtype=float)
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    at = np.linspace(0, length[-1], max(int(length[-1] / 0.12), 4))
    path = np.stack([np.interp(at, length, corners[:, i]) for i in (0, 1)], axis=1)
    swell = np.clip(1 + 0.35 * noise.line(len(path), 0.12, 0.9, 0.2, rng), 0.45, 2.0)
    ends = np.clip(np.minimum(at, length[-1] - at) / 0.25, 0.4, 1)
    parts: list[tuple[np.ndarray, np.ndarray]] = [(path, half * swell * ends)]
    for share, long, wide, side in tongues:
        start = path[int(share * (len(path) - 1))]
        parts.append(tongue(canvas, start[0], start[1], long, wide, side))
    strokes(canvas, parts, look, phenomenon, limit, stop)


def outlet(
    canvas: Canvas,
    s: float,
    u: float,
    length: float,
    half: float,
    look: Look,
    phenomenon: str = "hole",
    side: int | None = None,
    widen: float = 1.6,
    stop: float | None = None,
    limit: str | None = None,
) -> None:
    """Water out of a hole or from behind a fixture: a spot and a fan or a tongue below it."""
    side = side or (1 if u > 0 else -1)
    points, widths = tongue(canvas, s, u, length, half, side, widen)
    spot = np.array([[s, u - side * 0.02], [s, u + side * 0.05]])
    strokes(canvas, [(points, widths), (spot, np.full(2, 0.8 * half + 0.03))], look, phenomenon, limit, stop)


def streaks(
    canvas: Canvas,
    places: Sequence[float],
    u: float,
    lengths: Sequence[float],
    half: float,
    look: Look,
    phenomenon: str = "streaks",
    stop: float | None = None,
    head: float = 0.05,
) -> None:
    """Several runs side by side that start from one wet line."""
    side = 1 if u > 0 else -1
    parts: list[tuple[np.ndarray, np.ndarray]] = []
    for s, length in zip(places, lengths, strict=True):
        parts.append(tongue(canvas, s, u, length, half * canvas.rng.uniform(0.7, 1.4), side, 0.7))
    line = wander(canvas.rng, (min(places) - 0.05, u), (max(places) + 0.05, u), 0.02)
    parts.append((line, np.full(len(line), head)))
    strokes(canvas, parts, look, phenomenon, None, stop)


def foot(
    canvas: Canvas,
    s1: float,
    s2: float,
    side: int,
    height: float,
    look: Look,
    phenomenon: str = "rising damp",
    waves: float = 1.5,
    uneven: float = 0.3,
    limit: str | None = None,
) -> None:
    """A damp foot of a wall: from the floor to an uneven height."""
    base = canvas.profile.foot_right if side > 0 else canvas.profile.foot_left
    window = canvas.window(s1 - 0.3, s2 + 0.3, base - side * (2.2 * height + 0.3), base - side * 0.005)
    s = window.s[0]
    top = height * np.clip(1 + uneven * noise.line(len(s), canvas.pixel, waves, 0.15, canvas.rng), 0.2, 1.9)
    top = top * np.clip(np.minimum(s - s1, s2 - s) / 0.5, -1, 1)
    inside = (top[None, :] - (base - window.u) * side) * 0.8
    soak(canvas, window, inside, look, phenomenon, limit)
