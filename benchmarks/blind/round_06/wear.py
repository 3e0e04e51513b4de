"""Marks of building and use, dry places, and equipment by the row."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .canvas import Canvas
from .equipment import Box, Thing
from .fields import Part, blob, line, run, sheet
from .tunnel import Section


def drip(s: float, v: float, length: float, width: float, head: float = 0.2) -> tuple[Part, ...]:
    """Wet spot about a hole or a bolt with its run below."""
    return blob(s, v, head, head * 0.8), run(s, v, v + length, width, width * 0.7, 0.06, 3 * s)


def seep(s: float, v: float, rs: float, rv: float, tails: Sequence[float] = ()) -> tuple[Part, ...]:
    """Wet area with tails of the given lengths along its lower side."""
    at = np.linspace(-0.65, 0.65, len(tails)) * rs if len(tails) > 1 else np.zeros(len(tails))
    runs = (run(s + d, v, v + rv + t, 0.22, 0.12, 0.05, s + 5 * d) for d, t in zip(at, tails, strict=True))
    return blob(s, v, rs, rv), *runs


def floor(canvas: Canvas, db: float, marks: Sequence[tuple[float, float]] = ()) -> None:
    """Pavement, with painted lines at distances from the middle and of given widths."""
    canvas.albedo[:, ~canvas.wall] = db
    canvas.albedo += np.where(canvas.wall, 0, 0.8 * canvas.noise(0.05)) + np.where(canvas.wall, 0, 0.6 * canvas.noise((3, 0.6)))
    across = canvas.section.at(canvas.u.astype(float))[0]
    for at, width in marks:
        painted = ~canvas.wall & (np.abs(across - at) < width / 2)
        canvas.albedo[:, painted] += 4.5 + 0.8 * canvas.noise(0.2, (canvas.shape[0], int(painted.sum())))


def dirt_at_foot(canvas: Canvas, height: float, db: float, side: int, kind: str = "splash dirt") -> None:
    """Splashed and dusty zone along the foot, blotchy, with a wavy upper rim."""
    foot = canvas.section.foot
    top = canvas.section.height(height)
    canvas.paint([sheet(-1, canvas.length + 1, top, foot + 0.5)], db, kind, side, soft=0.08, warp=0.09)
    zone = side * canvas.u > top
    canvas.albedo[:, zone] += 0.5 * canvas.noise((0.5, 0.15), (canvas.shape[0], int(zone.sum())))


def joints(canvas: Canvas, at: Sequence[float], db: float = -2.0, half: float = 0.012) -> None:
    """Dry joints round the lining, grooves of a few centimetres."""
    for s in at:
        canvas.paint([line(((s, -canvas.section.foot), (s, canvas.section.foot)), half)], db, soft=0.006)
        canvas.relief -= 0.012 * np.exp(-(((canvas.s - s) / 0.02) ** 2))[:, None] * canvas.wall


def formwork(canvas: Canvas, along: float, around: float, db: float) -> None:
    """Fields of formwork: little steps of brightness and faint seams."""
    rows = np.floor((canvas.s + 0.37) / along).astype(int)
    columns = np.floor((canvas.u + 50 * around) / around).astype(int)
    table = canvas.rng.normal(0, db, (rows.max() + 1, columns.max() + 1)).astype(np.float32)
    canvas.albedo += table[rows[:, None], columns[None]] * canvas.wall
    seam = (np.mod(canvas.s + 0.37, along) < 0.02)[:, None] | (np.mod(canvas.u + 50 * around, around) < 0.02)[None]
    canvas.albedo -= 2 * db * seam * canvas.wall


def bolts(canvas: Canvas, along: float, around: float, db: float, radius: float = 0.07) -> list[tuple[float, float]]:
    """Plates of rock bolts, somewhat off their grid: where they are (chainage, ``u``)."""
    places = []
    for i, s in enumerate(np.arange(0.6, canvas.length - 0.3, along)):
        for u in np.arange(-canvas.section.foot + 1.2 + (i % 2) * around / 2, canvas.section.foot - 1.0, around):
            at = float(s + canvas.rng.normal(0, 0.12)), float(u + canvas.rng.normal(0, 0.12))
            canvas.paint([blob(*at, radius, radius)], db + canvas.rng.normal(0, 0.5), soft=0.01)
            places.append(at)
    return places


def crack(canvas: Canvas, s: float, v: float, length: float, along: bool, side: int = 1, db: float = -1.5) -> None:
    """Dry crack, a line that wanders."""
    t = np.linspace(0, length, 9)
    off = np.cumsum(canvas.rng.normal(0, 0.05, 9))
    points = tuple((float(s + a), float(v + b)) for a, b in (zip(t, off, strict=True) if along else zip(off, t, strict=True)))
    canvas.paint([line(points, 0.006)], db, side=side, soft=0.006)


def streaks(canvas: Canvas, v: float, side: int, count: int, db: float, longest: float) -> None:
    """Dry streaks of dirt that rain or washing left below an edge."""
    for _ in range(count):
        s, length = canvas.rng.uniform(0.5, canvas.length - 0.5), canvas.rng.uniform(0.3, 1) * longest
        width = canvas.rng.uniform(0.03, 0.09)
        part = run(float(s), v, v + float(length), float(width), float(width) * 0.4, 0.01, float(s))
        canvas.paint([part], db * canvas.rng.uniform(0.6, 1.2), "dry streak", side, soft=0.015, warp=0.01)


def plume(canvas: Canvas, s: float, v: float, side: int, length: float, db: float) -> None:
    """Soot above a warm lamp."""
    canvas.paint([run(s, v - length, v, 0.75, 0.35, 0.04, s)], db, "soot plume", side, soft=0.09, warp=0.05)


def repair(canvas: Canvas, s: float, v: float, size: tuple[float, float], db: float, side: int) -> None:
    """Patch of repair mortar, trowelled smooth, with straight edges."""
    part = sheet(s - size[0] / 2, s + size[0] / 2, v - size[1] / 2, v + size[1] / 2)
    canvas.paint([part], db, "repair mortar", side, soft=0.008, warp=0.012)


def number(canvas: Canvas, s: float, v: float, side: int, db: float = 3.5) -> None:
    """Chainage sprayed on the wall: some strokes of paint."""
    for k in range(4):
        at = s + 0.13 * k
        stroke = ((at, v), (at + 0.05, v + 0.02), (at + 0.02, v + 0.18), (at - 0.02, v + 0.2))
        canvas.paint([line(stroke, 0.018)], db, "sprayed number", side, soft=0.008)


def mounted(section: Section, u: float, off: float, around: float, deep: float, db: float, s: tuple[float, float]) -> Box:
    """Box whose back is ``off`` before the lining at ``u``: ``around`` wide, ``deep`` deep, from ``s[0]`` to ``s[1]``."""
    n, z = section.before(u, off + deep / 2)
    _, _, mn, mz, _, _ = section.at(np.array([u]))[:, 0]
    return Box(n, z, around / 2, deep / 2, db, *s, tilt=float(np.arctan2(-mn, mz)))


def lamps(section: Section, u: float, off: float, at: Sequence[float], length: float = 0.9, db: float = -2.5) -> list[Thing]:
    """Row of lamps."""
    return [mounted(section, u, off, 0.32, 0.16, db, (float(s) - length / 2, float(s) + length / 2)) for s in at]


def tray(section: Section, u: float, off: float, width: float = 0.3) -> list[Thing]:
    """Cable tray along the tunnel on brackets, 2 m apart."""
    ladder: list[Thing] = [mounted(section, u, off, width, 0.06, -4.0, (-np.inf, np.inf))]
    brackets = [mounted(section, u, 0.0, 0.05, off, -3.0, (s, s + 0.05)) for s in np.arange(0.8, 60, 2.0)]
    return ladder + list(brackets)


def kerb(section: Section, side: int, width: float, height: float, db: float = -6.0) -> Box:
    """Raised footway along the wall."""
    n, _ = section.point(height / 2, side, width / 2)
    return Box(n + side * 0.2, section.floor + height / 2, width / 2 + 0.2, height / 2, db)


def barrier(section: Section, side: int, off: float) -> list[Thing]:
    """Guard rail of steel on posts, ``off`` before the wall."""
    n, z = section.point(0.65, side, off)
    posts = [
        Box(n + side * 0.06, section.floor + 0.35, 0.04, 0.35, -3.0, float(s), float(s) + 0.08) for s in np.arange(1, 60, 2.0)
    ]
    return [Box(n, z, 0.035, 0.155, -2.0, gloss=0.05), *posts]
