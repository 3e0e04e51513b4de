"""What linings look like when they are dry: segments with joints and pockets, cast bays, shotcrete."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from shapely import unary_union
from shapely.geometry import Point
from shapely.geometry import box as rectangle
from shapely.geometry.base import BaseGeometry

from .shapes import line
from .tunnel import Tunnel


def segments(
    t: Tunnel,
    ring: float,
    first: float,
    joints: Sequence[Sequence[float]],
    *,
    batch: float = 0.45,
    step: float = 0.003,
    gap: tuple[float, float] = (0.012, -4.5),
    pockets: tuple[float, float] = (0.16, 0.13),
    bolts: int = 17,
) -> None:
    """Rings of segments.

    Parameters
    ----------
    t : Tunnel
        To be lined.
    ring, first : float
        Width of a ring and chainage of the first ring joint, in m.
    joints : sequence
        Arcs of the longitudinal joints; rings take turns at the sequences.
    batch : float
        Deviation of the brightness of segments, in dB.
    step : float
        Deviation of their height, in m.
    gap : tuple of float
        Width of the joints and their darkness in dB.
    pockets : tuple of float
        Size of the bolt pockets along and around; none where it is 0.
    bolts : int
        Pockets about a ring joint.
    """
    canvas, rng = t.canvas, t.rng
    starts = np.arange(first - ring, t.axis.length + ring, ring)
    turns = np.linspace(-t.section.foot, t.section.foot, bolts) + 0.11
    for number, c in enumerate(starts):
        cuts = sorted(joints[number % len(joints)])
        columns = canvas.cols(c, c + ring)
        if c + ring < canvas.c[0] or c > canvas.c[-1]:
            continue
        for low, high in zip([-99.0, *cuts], [*cuts, 99.0], strict=True):
            rows = canvas.rows(max(low, -t.section.foot), min(high, t.section.foot))
            canvas.dry[rows, columns] += np.float32(batch * rng.normal())
            canvas.relief[rows, columns] += np.float32(step * rng.normal())
            middle = (max(low, -t.section.foot) + min(high, t.section.foot)) / 2
            if high - low > 1.0:
                t.mark(Point(c + ring / 2, middle).buffer(0.045), rng.choice([-2.5, -1.5, 2.0]), "grout hole plug", 0.008)
        for cut in cuts:
            _seam(t, columns, canvas.rows(cut - gap[0] / 2, cut + gap[0] / 2), gap[1])
            if pockets[0]:
                for along in (0.28, 0.72):
                    for side in (-1, 1):
                        _pocket(t, c + along * ring, cut + side * 0.16, pockets[1], pockets[0])
        rows = canvas.rows(-t.section.foot, t.section.foot)
        _seam(t, canvas.cols(c - gap[0] / 2, c + gap[0] / 2), rows, gap[1], True)
        for s in turns if pockets[0] else ():
            _pocket(t, c + 0.15, float(s), *pockets)


def _seam(t: Tunnel, columns: slice, rows: slice, db: float, upright: bool = False) -> None:
    """Darken a joint unevenly: it is in part filled, in part open."""
    shape = t.canvas.dry[rows, columns].shape
    uneven = np.clip(1 + 0.5 * np.repeat(t.rng.normal(size=max(shape) // 12 + 1), 12)[: max(shape)], 0.1, 2)
    part = uneven[:, None] if upright else uneven[None, :]
    t.canvas.dry[rows, columns] += (db * part[: shape[0], : shape[1]]).astype(np.float32)


def _pocket(t: Tunnel, c: float, s: float, along: float, around: float) -> None:
    """A bolt pocket: recessed and darker, some plugged with mortar."""
    if abs(s) > t.section.foot - around or not 0.1 < c < t.axis.length - 0.1:
        return
    window = (t.canvas.rows(s - around / 2, s + around / 2), t.canvas.cols(c - along / 2, c + along / 2))
    if t.rng.random() < 0.12:
        t.canvas.dry[window] += np.float32(t.rng.normal(0.6, 0.6))
        return
    t.canvas.dry[window] += np.float32(-1.8 + 0.5 * t.rng.normal())
    t.canvas.relief[window] -= np.float32(0.05)
    t.others.append((rectangle(c - along / 2, s - around / 2, c + along / 2, s + around / 2), "bolt pocket"))


def bays(t: Tunnel, length: float, first: float, db: float = -3.0, batch: float = 0.5) -> None:
    """Cast bays with joints between them, prints of the formwork and lifts of pouring."""
    canvas = t.canvas
    rows = canvas.rows(-t.section.foot, t.section.foot)
    for c in np.arange(first - length, t.axis.length + 1, length):
        canvas.dry[rows, canvas.cols(c, c + length)] += np.float32(batch * t.rng.normal())
        _seam(t, canvas.cols(c - 0.012, c + 0.012), rows, db, True)
    for c in np.arange(first - length, t.axis.length, 1.5):
        canvas.dry[rows, canvas.cols(c - 0.005, c + 0.005)] += np.float32(-0.8)
    for s in np.arange(-t.section.foot + 1.5, t.section.foot, 1.5):
        canvas.dry[canvas.rows(s - 0.005, s + 0.005), :] += np.float32(-0.5)


def shotcrete(t: Tunnel, rough: float) -> None:
    """Sprayed concrete: a rough surface and passes of the nozzle."""
    canvas = t.canvas
    rows = canvas.rows(-t.section.foot, t.section.foot)
    window = (rows, slice(0, len(canvas.c)))
    for share, size in ((0.8, 0.5), (0.45, 0.18), (0.2, 0.07)):
        canvas.relief[rows] += (rough * share * canvas.noise(size, size, window)).astype(np.float32)
    t.roughness = True


def streak_dirt(t: Tunnel, amount: float, joint: float, length: tuple[float, float], kind: str, c: float, side: int) -> None:
    """A dry streak of rust or grime below a bracket, joint or bolt."""
    down = side * t.rng.uniform(*length)
    shape: BaseGeometry = line(t.rng, (c, joint), (c + t.rng.normal(0, 0.03), joint + down), t.rng.uniform(0.04, 0.12), 0.008)
    t.mark(shape, amount, kind, 0.02, 0.3)


def numerals(t: Tunnel, places: Sequence[tuple[float, float]], db: float) -> None:
    """Painted ring numbers and survey marks."""
    for c, s in places:
        strokes = [rectangle(c + 0.09 * k, s - 0.06, c + 0.09 * k + 0.025, s + 0.06) for k in range(int(t.rng.integers(2, 4)))]
        bars = [rectangle(c + 0.09 * k, s + d, c + 0.09 * k + 0.07, s + d + 0.02) for k in range(2) for d in (-0.06, 0.04)]
        t.mark(unary_union(strokes + bars), db, "paint", 0.006, 0.1)


def targets(t: Tunnel, places: Sequence[tuple[float, float]]) -> None:
    """Reflecting targets of the monitoring of convergence."""
    for c, s in places:
        t.mark(rectangle(c - 0.03, s - 0.03, c + 0.03, s + 0.03), 7.0, "target", 0.004, 0.0)
