"""What darkens or brightens a lining without being wet."""

from __future__ import annotations

import numpy as np

from .canvas import Canvas, Patch
from .shapes import blot, runs, smooth, specks, stroke, wander


def by_height(canvas: Canvas, low: float, high: float, level: float, uneven: float = 0.25) -> None:
    """Film that grows from one height to another, in dB, and is as uneven as dirt is.

    Parameters
    ----------
    canvas : Canvas
        The lining.
    low, high : float
        Heights of no film and of the whole film, in metres; the other way about for a film near the foot.
    level : float
        Change of reflectance, in dB.
    uneven : float
        Deviation of the film, as a part of it.
    """
    share = smooth((canvas.z - low) / (high - low)) * canvas.on_wall
    cloud = canvas.noise(3.0, 5, 0.6, stretch=(1.6, 0.8))
    canvas.base += (level * share[None, :] * np.clip(1 + uneven * cloud, 0, None)).astype(np.float32)


def streaks(canvas: Canvas, low: float, high: float, level: float, share: float = 0.3) -> None:
    """Dry streaks that water once washed down the walls between two heights."""
    band = smooth((canvas.z - low) / 0.4) * smooth((high - canvas.z) / 0.6) * canvas.on_wall
    lines = canvas.noise(0.35, 3, 0.7, stretch=(1.0, 9.0))
    wash = smooth((lines - np.quantile(lines[::7, ::7], 1 - share)) / 0.8)
    canvas.base += (level * band[None, :] * wash).astype(np.float32)


def crack(
    canvas: Canvas, start: tuple[float, float], stop: tuple[float, float], level: float = -1.2, half: float = 0.006
) -> None:
    """Dry crack, dark by its own shadow and the dust in it."""
    path = wander(canvas.rng, start, stop, 0.35)
    canvas.stain(stroke(canvas, path, half, 0.03, 0.2), level, "dry crack")


def old_salt(canvas: Canvas, u: float, s: float, half_u: float, half_s: float, level: float = 3.0) -> None:
    """Dry bloom of salt: specks that grow together."""
    patch = blot(canvas, u, s, half_u, half_s, 0.4, 0.25)
    crust = specks(canvas, patch, 0.55, 0.25)
    canvas.stain(Patch(patch.window, np.maximum(crust.weight, 0.35 * patch.weight)), level)
    canvas.stain(patch, 0.0, "dry salt")


def old_run(canvas: Canvas, u: float, width: float, start: float, stop: float, level: float, kind: str, count: int = 4) -> None:
    """Dry trace of former rills: rust, soot, grease or lime."""
    patches = runs(canvas, u - width / 2, u + width / 2, start, stop, count, (0.03, 0.06), 0.05)
    canvas.stain(patches, level, kind)


def wet_floor(canvas: Canvas, u: float, s: float, half_u: float, half_s: float, level: float = -4.0) -> None:
    """Puddle on the floor, which is no leak of the lining."""
    canvas.stain(blot(canvas, u, s, half_u, half_s, 0.15, 0.2), level, "puddle on floor", sheen=1.0)
