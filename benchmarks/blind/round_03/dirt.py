"""Dirt that tunnels gather, and traces of those who clean and mend them; all of it dry."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .arrays import smooth_line, smooth_step
from .canvas import Canvas
from .shapes import Blob, Rect, Runs


def soot(canvas: Canvas, depth: float, reach: float) -> None:
    """Exhaust on the vault: ``depth`` dB at the crown, fading over ``reach`` metres down both sides."""
    ragged = np.abs(canvas.a)[None, :] + 0.35 * canvas.noise(3.0, 1.0)
    canvas.albedo -= (depth * (1.0 - smooth_step(ragged / reach)) * canvas.wall()).astype(np.float32)


def splash(canvas: Canvas, depth: float, height: float) -> None:
    """Road dirt thrown up to a height: darkest at the foot, ragged at its top."""
    up = canvas.profile.foot - np.abs(canvas.a)
    tops = height * (1.0 + 0.2 * smooth_line(canvas.rng, canvas.shape[0], 80.0))
    share = 1.0 - smooth_step(up[None, :] / np.maximum(tops, 0.1)[:, None])
    canvas.albedo -= (depth * share * np.clip(1.0 + 0.2 * canvas.noise(0.3, 0.15), 0.4, 1.6) * canvas.wall()).astype(np.float32)


def washed(canvas: Canvas, high: float, low: float, gain: float, brush: float) -> None:
    """Passes of the brushes of a washing lorry: stripes along the tunnel, with seams that were missed."""
    there = canvas.band(high, low, 0.08)
    seam = np.mod(np.abs(canvas.a)[None, :] + 0.03 * smooth_line(canvas.rng, canvas.shape[0], 300.0)[:, None], brush) / brush
    cleaned = 1.0 - 0.8 * np.exp(-(((seam - 0.5) / 0.07) ** 2))
    stripes = 1.0 + 0.25 * canvas.noise(4.0, 0.06)
    canvas.albedo += (gain * there * cleaned * stripes).astype(np.float32)


def foot_dust(canvas: Canvas, change: float, height: float) -> None:
    """Dust that lies and sticks at the foot of the wall."""
    up = canvas.profile.foot - np.abs(canvas.a)
    ragged = up[None, :] + 0.05 * canvas.noise(0.6, 0.2)
    canvas.albedo += (change * np.exp(-np.clip(ragged, 0.0, None) / height) * canvas.wall()).astype(np.float32)


def lamp_halos(canvas: Canvas, places: Sequence[float], arc: float, change: float, size: float) -> None:
    """Dust and soot that warm air bakes on the lining above and beside each lamp."""
    for place in places:
        shape = Blob(size * canvas.rng.uniform(0.8, 1.3), 0.55 * size * canvas.rng.uniform(0.8, 1.2), 0.15, 0.5)
        shift = -0.12 if arc >= 0 else 0.12
        canvas.stain("lamp halo", shape, place, arc + shift, change * canvas.rng.uniform(0.8, 1.2), 0.3 * size)


def fan_halo(canvas: Canvas, s: float, arc: float, change: float, length: float) -> None:
    """Grime which a jet fan blows on the vault behind its outlet, in streaks."""
    canvas.stain("fan grime", Blob(length, 0.8, 0.18, 0.9), s, arc, change, soft=0.45, uneven=0.1)
    for offset in canvas.rng.uniform(-0.6, 0.6, 5):
        canvas.stain(
            None, Blob(0.5 * length, 0.07, 0.3, 0.6), s + 0.3 * length * canvas.rng.normal(), arc + offset, -0.5, soft=0.06
        )


def bracket_streaks(canvas: Canvas, places: Sequence[float], arc: float, change: float, length: float) -> None:
    """Rust and dirt that ran down below fixings, long dry."""
    for place in places:
        shape = Runs(length * canvas.rng.uniform(0.4, 1.2), 0.05 + 0.04 * canvas.rng.random(), head=0.0, wander=0.02)
        canvas.stain("dry streak", shape, place, arc, change * canvas.rng.uniform(0.6, 1.2), soft=0.03)


def old_traces(canvas: Canvas, count: int, change: float) -> None:
    """Where water ran or stood years ago and left dirt, and where dirt ran down with condensation: dry, soft, faint."""
    for _ in range(count):
        s = canvas.rng.uniform(0.5, canvas.length - 0.5)
        arc = canvas.rng.choice([-1.0, 1.0]) * canvas.rng.uniform(0.2, 0.85) * canvas.profile.foot
        size = canvas.rng.uniform(0.3, 1.2)
        depth = change * canvas.rng.uniform(0.4, 1.2)
        if canvas.rng.random() < 0.6:
            canvas.stain(
                "old trace" if abs(depth) > 0.9 else None, Runs(1.6 * size, 0.12, 0.6 * size, 3, 0.06), s, arc, depth, 0.07
            )
        else:
            canvas.stain("old trace" if abs(depth) > 0.9 else None, Blob(0.6 * size, 0.4 * size, 0.35), s, arc, depth, 0.12)


def repairs(canvas: Canvas, places: Sequence[tuple[float, float, float, float, float]]) -> None:
    """Patches of mortar: chainage, arc, width, height, change in dB."""
    for s, arc, width, height, change in places:
        kind = "dark mortar patch" if change < 0 else "bright mortar patch"
        canvas.stain(kind, Rect(width, height, 0.008), s, arc, change, soft=0.012, covered=True)


def marks(canvas: Canvas, count: int, height: float, change: float) -> None:
    """Numbers and arrows that surveyors sprayed on the wall at about breast height."""
    arc = canvas.profile.arc_of_height(height)
    for _ in range(count):
        side = canvas.rng.choice([-1.0, 1.0])
        s = canvas.rng.uniform(0.5, canvas.length - 0.5)
        for letter in range(int(canvas.rng.integers(2, 5))):
            shape = Rect(0.03, 0.2, 0.0, canvas.rng.uniform(-0.6, 0.6))
            canvas.stain(None, shape, s + 0.16 * letter, side * (arc + canvas.rng.normal(0.0, 0.01)), change, soft=0.01)


def dry_cracks(canvas: Canvas, count: int, length: float, change: float = -1.0) -> None:
    """Shrinkage cracks with a thin dark line of dust."""
    for _ in range(count):
        s, a = canvas.rng.uniform(0.5, canvas.length - 0.5), canvas.rng.uniform(-1.0, 1.0) * canvas.profile.foot
        cells = int(length * canvas.rng.uniform(0.4, 1.2) / 0.01)
        path = np.cumsum(canvas.rng.normal(0.0, 0.35, cells)) + 0.2 * np.arange(cells) * canvas.rng.normal()
        rows = ((s + 0.6) / 0.01 + path).astype(np.int64)
        columns = np.searchsorted(canvas.a, a) + np.arange(cells)
        valid = (rows >= 0) & (rows < canvas.shape[0]) & (columns < canvas.shape[1])
        canvas.albedo[rows[valid], columns[valid]] += np.float32(change)
