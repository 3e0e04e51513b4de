"""Shapes that water, dirt, paint and repairs take on a lining."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .canvas import Canvas, Patch, fractal
from .section import Array, Point


def smooth(x: Array) -> Array:
    """Step from 0 to 1 over the unit interval, without corners."""
    x = np.clip(x, 0, 1)
    return x * x * (3 - 2 * x)


def blot(canvas: Canvas, u: float, s: float, half_u: float, half_s: float, rim: float = 0.25, ragged: float = 0.18) -> Patch:
    """Rounded patch.

    Parameters
    ----------
    canvas : Canvas
        The lining.
    u, s : float
        Its middle.
    half_u, half_s : float
        Its half axes, in metres.
    rim : float
        Width of the rim where it fades, as a part of the half axes.
    ragged : float
        Unevenness of its outline, as a part of the half axes.

    Returns
    -------
    Patch
    """
    grow = 1 + rim + 3 * ragged
    window, along, around = canvas.window(u - grow * half_u, u + grow * half_u, s - grow * half_s, s + grow * half_s)
    size = 2 * max(half_u, half_s)
    bumps = fractal(canvas.rng, (along.size, around.size), canvas.cell, size, 5, 0.6)
    radius = np.hypot((along - u) / half_u, (around - s) / half_s) + ragged * bumps
    return Patch(window, smooth((1 - radius) / rim + 0.5).astype(np.float32))


def stroke(
    canvas: Canvas,
    path: Sequence[Point],
    half: float | tuple[float, float],
    rim: float = 0.03,
    ragged: float = 0.3,
    lumps: float = 0.6,
) -> Patch:
    """Band along a line.

    Parameters
    ----------
    canvas : Canvas
        The lining.
    path : sequence of tuple of float
        Chainage and place of its vertices.
    half : float or tuple of float
        Half its width, at its start and its end where they differ, in metres.
    rim : float
        Width of the rim where it fades, in metres.
    ragged : float
        Deviation of the width, as a part of it.
    lumps : float
        Longest wavelength of that, in metres.

    Returns
    -------
    Patch
    """
    line = np.asarray(path, dtype=float)
    first, last = (half, half) if isinstance(half, float | int) else half
    reach = max(first, last) * (1 + 3 * ragged) + rim
    low, high = line.min(axis=0) - reach, line.max(axis=0) + reach
    window, along, around = canvas.window(low[0], high[0], low[1], high[1])
    lengths = np.hypot(*np.diff(line, axis=0).T)
    travelled = np.concatenate([[0.0], np.cumsum(lengths)])
    nearest = np.full((along.size, around.size), np.inf)
    width = np.zeros_like(nearest)
    for k, length in enumerate(lengths):
        du, ds = (line[k + 1] - line[k]) / length
        at = np.clip((along - line[k, 0]) * du + (around - line[k, 1]) * ds, 0, length)
        distance = np.hypot(along - line[k, 0] - at * du, around - line[k, 1] - at * ds)
        closer = distance < nearest
        nearest[closer] = distance[closer]
        width[closer] = (first + (last - first) * (travelled[k] + at) / travelled[-1])[closer]
    bumps = fractal(canvas.rng, nearest.shape, canvas.cell, lumps, 4)
    width = width * np.clip(1 + ragged * bumps, 0, None)
    # Where the band thins to nothing its rim stays, half as strong: damp and dirt do not break off at once.
    return Patch(window, smooth((width - nearest) / rim + 0.5).astype(np.float32))


def wander(rng: np.random.Generator, start: Point, stop: Point, sway: float, step: float = 0.12) -> list[Point]:
    """Line from one point to another that wavers, as a crack or a rill does."""
    count = max(3, round(float(np.hypot(stop[0] - start[0], stop[1] - start[1])) / step))
    t = np.linspace(0, 1, count)
    walk = np.cumsum(rng.normal(size=count))
    walk = (walk - walk[0] - t * (walk[-1] - walk[0])) * sway / np.sqrt(count)
    direction = np.array([stop[0] - start[0], stop[1] - start[1]])
    direction /= np.linalg.norm(direction)
    return [
        (
            float(start[0] + f * (stop[0] - start[0]) - w * direction[1]),
            float(start[1] + f * (stop[1] - start[1]) + w * direction[0]),
        )
        for f, w in zip(t, walk, strict=True)
    ]


def runs(
    canvas: Canvas,
    u0: float,
    u1: float,
    start: float,
    stop: float,
    count: int,
    half: tuple[float, float] = (0.05, 0.1),
    rim: float = 0.05,
) -> list[Patch]:
    """Rills down a wall, of uneven length, from a line at one level.

    Parameters
    ----------
    canvas : Canvas
        The lining.
    u0, u1 : float
        Chainages between which they begin.
    start, stop : float
        Place where they begin, and where the longest of them ends.
    count : int
        Number of rills.
    half : tuple of float
        Half their width at the top and at the bottom, in metres.
    rim : float
        Width of the rim where they fade, in metres.

    Returns
    -------
    list of Patch
    """
    rng = canvas.rng
    patches = []
    for u in np.linspace(u0, u1, count) + rng.normal(0, 0.15 * abs(u1 - u0) / count, count):
        end = start + (stop - start) * (1.0 if count == 1 else rng.uniform(0.55, 1.0))
        path = wander(rng, (float(u), start), (float(u + rng.normal(0, 0.06)), float(end)), 0.25)
        scale = rng.uniform(0.75, 1.25)
        patches.append(stroke(canvas, path, (half[0] * scale, half[1] * scale), rim))
    return patches


def rising(canvas: Canvas, u0: float, u1: float, side: str, height: float, rim: float = 0.12) -> Patch:
    """Damp that rises from the foot of a wall.

    Parameters
    ----------
    canvas : Canvas
        The lining.
    u0, u1 : float
        Chainages between which it shows.
    side : {"left", "right"}
        Which wall.
    height : float
        Greatest height, in metres.
    rim : float
        Width of the rim where it fades, in metres.

    Returns
    -------
    Patch
    """
    foot = canvas.section.foot_right if side == "right" else canvas.section.foot_left
    window, along, around = canvas.window(u0, u1, foot - 1.6 * height, foot + 1.6 * height)
    above = (around - foot) * (1 if side == "right" else -1)
    taper = smooth((along - u0) / (0.3 * (u1 - u0))) * smooth((u1 - along) / (0.3 * (u1 - u0)))
    wave = fractal(canvas.rng, (along.size, 4), canvas.cell, 1.5, 4)[:, :1]
    fine = fractal(canvas.rng, (along.size, around.size), canvas.cell, 0.4, 3)
    top = height * taper * np.clip(0.75 + 0.2 * wave + 0.06 * fine, 0, None)
    return Patch(window, (smooth((top - above) / rim) * (above > 0)).astype(np.float32))


def rectangle(canvas: Canvas, u0: float, u1: float, s0: float, s1: float, rim: float = 0.03, ragged: float = 0.0) -> Patch:
    """Rectangle, its edges as straight as ``ragged`` (in metres) lets them be."""
    s0, s1 = sorted((s0, s1))
    reach = rim + 3 * ragged
    window, along, around = canvas.window(u0 - reach, u1 + reach, s0 - reach, s1 + reach)
    inside = np.minimum(np.minimum(along - u0, u1 - along), np.minimum(around - s0, s1 - around))
    if ragged:
        inside = inside + ragged * fractal(canvas.rng, (along.size, around.size), canvas.cell, 0.6, 4)
    return Patch(window, smooth(inside / rim + 0.5).astype(np.float32))


def specks(canvas: Canvas, patch: Patch, share: float, size: float = 0.12) -> Patch:
    """Specks that cover a share of a patch: crusts of salt, lumps, mould."""
    grain = fractal(canvas.rng, patch.weight.shape, canvas.cell, size, 3)
    level = np.quantile(grain, 1 - share)
    return Patch(patch.window, (patch.weight * smooth((grain - level) / 0.5)).astype(np.float32))


def tidemark(patch: Patch) -> Patch:
    """Line of dust and salt that a drying patch leaves where its rim has dried, just outside what is still damp."""
    return Patch(patch.window, np.exp(-(((patch.weight - 0.2) / 0.1) ** 2)).astype(np.float32))
