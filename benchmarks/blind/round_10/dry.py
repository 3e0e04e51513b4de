"""What makes a dry lining uneven: joints, tones, dirt, stains, repairs, marks and paint."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .canvas import Canvas, Window, cover, ellipse, rectangle, stroke


def paint(
    canvas: Canvas,
    window: Window,
    inside: np.ndarray,
    change: float,
    kind: str,
    edge: float = 0.03,
    rough: float = 0.02,
    scale: float = 0.25,
    texture: float = 0.2,
) -> None:
    """Make the dry surface brighter or darker (dB) where ``inside`` is positive, with a rough outline and an uneven middle."""
    if rough:
        inside = inside + rough * canvas.fractal(window, scale, 0.03)
    share = cover(inside, edge)
    depth = 1 + texture * canvas.fractal(window, 4 * scale, scale / 4) if texture else 1.0
    canvas.base[window.at] += (change * share * depth).astype(np.float32)
    if kind:
        canvas.note(kind, window, share > 0.5)


def texture(canvas: Canvas, window: Window, spread: float, longest: float, shortest: float, fade: float = 0.7) -> None:
    """Uneven reflectance."""
    canvas.base[window.at] += spread * canvas.fractal(window, longest, shortest, fade)


def grain(canvas: Canvas, spread: float) -> None:
    """Unevenness from pixel to pixel."""
    for row in range(0, canvas.shape[0], 512):
        block = canvas.base[row : row + 512]
        block += spread * canvas.rng.standard_normal(block.shape, dtype=np.float32)


def bumps(canvas: Canvas, window: Window, spread: float, longest: float, shortest: float, fade: float = 0.5) -> None:
    """Uneven shape (metres)."""
    canvas.bump[window.at] += spread * canvas.fractal(window, longest, shortest, fade)


def tone(canvas: Canvas, s1: float, s2: float, u1: float, u2: float, change: float, kind: str = "", step: float = 0.0) -> None:
    """A rectangle of another tone, and standing out by ``step``."""
    window = canvas.window(s1, s2, u1, u2)
    canvas.base[window.at] += change
    canvas.bump[window.at] += step
    if kind:
        canvas.note(kind, window, np.ones(window.shape, dtype=bool))


def groove(
    canvas: Canvas, points: Sequence[tuple[float, float]], half: float, change: float, depth: float, kind: str = ""
) -> None:
    """A joint or a crack: a narrow line of another tone, set back by ``depth``."""
    points = np.asarray(points, dtype=float)
    pad = half + 0.03
    (s1, u1), (s2, u2) = points.min(axis=0) - pad, points.max(axis=0) + pad
    window = canvas.window(s1, s2, u1, u2)
    share = cover(stroke(window, points, half), max(half, canvas.pixel))
    canvas.base[window.at] += change * share
    canvas.bump[window.at] -= depth * share
    if kind:
        canvas.note(kind, window, share > 0.5)


def wander(rng: np.random.Generator, start: tuple[float, float], end: tuple[float, float], sway: float) -> np.ndarray:
    """A crooked line between two places."""
    start, end = np.array(start), np.array(end)
    count = max(int(np.linalg.norm(end - start) / 0.15), 3)
    part = np.linspace(0, 1, count)
    walk = np.cumsum(rng.standard_normal(count))
    walk -= walk[0] + (walk[-1] - walk[0]) * part
    walk *= sway / max(np.abs(walk).max(), 1e-6)
    across = np.array([-(end - start)[1], (end - start)[0]]) / max(np.linalg.norm(end - start), 1e-6)
    return start + part[:, None] * (end - start) + walk[:, None] * across


def run(
    canvas: Canvas, s: float, u: float, length: float, half: float, change: float, kind: str, side: int | None = None
) -> None:
    """A dry trace of something that once ran down: rust, lime or dirty water."""
    side = side or (1 if u > 0 else -1)
    points = wander(canvas.rng, (s, u), (s + canvas.rng.normal(0, 0.05), u + side * length), 0.03)
    half_line = half * np.interp(np.linspace(0, 1, len(points)), [0, 0.3, 1], [0.7, 1.0, 0.4])
    window = canvas.window(s - 0.4, s + 0.4, u - side * 0.1, u + side * (length + 0.15))
    fade = np.clip(1.15 - (window.u - u) * side / length, 0, 1)
    share = cover(stroke(window, points, half_line) + 0.008 * canvas.fractal(window, 0.12, 0.02), 0.03) * fade
    canvas.base[window.at] += change * share
    canvas.note(kind, window, share > 0.4)


def blot(
    canvas: Canvas, s: float, u: float, half_s: float, half_u: float, change: float, kind: str, edge: float, rough: float
) -> None:
    """A stain without a form of its own."""
    pad = 1.5 * max(half_s, half_u) + 2 * rough
    window = canvas.window(s - pad, s + pad, u - pad, u + pad)
    turn = canvas.rng.uniform(-0.4, 0.4)
    paint(
        canvas,
        window,
        ellipse(window, s, u, half_s, half_u, turn),
        change,
        kind,
        edge,
        rough,
        scale=0.5 * min(half_s, half_u) + 0.05,
    )


def tide_mark(canvas: Canvas, s: float, u: float, half_s: float, half_u: float, change: float) -> None:
    """A stain that has dried: hardly darker within, with a darker rim."""
    pad = 1.6 * max(half_s, half_u)
    window = canvas.window(s - pad, s + pad, u - pad, u + pad)
    inside = ellipse(window, s, u, half_s, half_u) + 0.06 * canvas.fractal(window, 0.5, 0.04)
    rim = np.exp(-((inside / 0.025) ** 2)) * np.clip(0.6 + 0.5 * canvas.fractal(window, 0.4, 0.1), 0, 1)
    canvas.base[window.at] += change * (0.35 * cover(inside, 0.04) + 0.65 * rim)
    canvas.note("dried stain", window, inside > 0)


def repair(canvas: Canvas, s: float, u: float, length: float, height: float, change: float, step: float = 0.004) -> None:
    """A patch of newer mortar with straight, cut edges."""
    window = canvas.window(s - 0.1, s + length + 0.1, u - 0.1, u + height + 0.1)
    inside = rectangle(window, s, s + length, u, u + height) + 0.004 * canvas.fractal(window, 0.1, 0.02)
    share = cover(inside, 0.015)
    canvas.base[window.at] += change * share * (1 + 0.1 * canvas.fractal(window, 0.3, 0.03))
    canvas.bump[window.at] += step * share
    canvas.note("repair", window, share > 0.5)


def band(
    canvas: Canvas, s1: float, s2: float, u1: float, u2: float, change: float, kind: str, edge: float, rough: float
) -> None:
    """A strip along the tunnel: splash, wear, dust, soot or a cleaned stretch."""
    pad = edge + 3 * rough
    window = canvas.window(s1 - 0.1, s2 + 0.1, min(u1, u2) - pad, max(u1, u2) + pad)
    paint(canvas, window, rectangle(window, s1, s2, u1, u2), change, kind, edge, rough, scale=0.6, texture=0.15)


def pocket(canvas: Canvas, s: float, u: float, length: float, height: float, depth: float, change: float) -> None:
    """A recess with slanting sides, as about a bolt."""
    window = canvas.window(s - length, s + length, u - height, u + height)
    share = cover(rectangle(window, s - length / 2, s + length / 2, u - height / 2, u + height / 2), 0.03)
    canvas.base[window.at] += change * share
    canvas.bump[window.at] -= depth * share


def disc(canvas: Canvas, s: float, u: float, half: float, depth: float, change: float) -> None:
    """A round hole or plug."""
    window = canvas.window(s - 2 * half, s + 2 * half, u - 2 * half, u + 2 * half)
    share = cover(ellipse(window, s, u, half, half), 0.012)
    canvas.base[window.at] += change * share
    canvas.bump[window.at] -= depth * share


def boards(canvas: Canvas, window: Window, width: float, spread: float, step: float) -> None:
    """Marks of the boards of a formwork, that ran along the tunnel: each has its tone."""
    number = np.floor(window.u / width).astype(int)
    tones = canvas.rng.normal(0, spread, number.max() - number.min() + 1)
    steps = canvas.rng.normal(0, step, len(tones))
    canvas.base[window.at] += tones[number - number.min()].astype(np.float32)
    canvas.bump[window.at] += steps[number - number.min()].astype(np.float32)


def graffiti(canvas: Canvas, s: float, u: float, width: float, height: float, change: float) -> None:
    """Sprayed letters: thick bent strokes, and a fill."""
    rng = canvas.rng
    window = canvas.window(s - 0.3, s + width + 0.3, u - 0.3, u + height + 0.3)
    inside = np.full(window.shape, -10.0, dtype=np.float32)
    letters = max(int(width / (0.6 * height)), 2)
    for i in range(letters):
        left = s + i * width / letters
        corners = np.array([[left + rng.uniform(0, 0.9) * width / letters, u + rng.uniform(0, 1) * height] for _ in range(5)])
        smooth = np.stack([np.interp(np.linspace(0, 4, 17), np.arange(5), corners[:, j]) for j in (0, 1)], axis=1)
        smooth[1:-1] = (smooth[:-2] + smooth[1:-1] + smooth[2:]) / 3
        np.maximum(inside, stroke(window, smooth, rng.uniform(0.03, 0.06)), out=inside)
    share = cover(inside, 0.02)
    canvas.base[window.at] += change * share
    canvas.note("graffiti", window, share > 0.5)
