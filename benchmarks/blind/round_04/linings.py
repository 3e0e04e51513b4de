"""What linings look like dry: reflectance (dB about the mean) and relief on the sheet."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from .geometry import Array
from .sheet import H, Sheet, noise


def cloud(sheet: Sheet, rng: np.random.Generator, db: float, scale: float, octaves: int = 4, stretch: float = 1.0) -> None:
    """Uneven colour."""
    sheet.light += db * noise(sheet.shape, rng, scale, octaves, stretch)


def wavy(sheet: Sheet, rng: np.random.Generator, metres: float, scale: float) -> None:
    """Form that departs from the design."""
    sheet.relief += metres * np.clip(noise(sheet.shape, rng, scale, 1), -2, 2)


def soot(sheet: Sheet, rng: np.random.Generator, db: float, width: float, at: float = 0.0) -> None:
    """Soot of the crown: darkest over the track, thin towards the springing, in clouds."""
    fall = np.exp(-(((sheet.l - at) / width) ** 2))
    sheet.light -= db * fall * np.clip(1 + 0.3 * noise(sheet.shape, rng, 1.1, 3, 2.0), 0.2, 2)


def dust(sheet: Sheet, rng: np.random.Generator, db: float, height: float) -> None:
    """Brake dust (dark) or road dust (negative: bright) at the foot."""
    near = np.exp(-((sheet.end - np.abs(sheet.l)) / height))
    sheet.light -= db * near * np.clip(1 + 0.25 * noise(sheet.shape, rng, 0.5, 3, 3.0), 0.2, 2)


def washed(sheet: Sheet, rng: np.random.Generator, db: float) -> None:
    """Streaks down the wall that rain and melt water left in the dirt years ago."""
    streak = noise(sheet.shape, rng, 2.5, 2, 0.05)
    sheet.light += db * np.clip(streak - 0.6, 0, 2) * np.clip(np.abs(sheet.l) / sheet.end * 1.5 - 0.4, 0, 1)


def _blocks(
    sheet: Sheet, rng: np.random.Generator, heights: Array, lengths: tuple[float, float], joint: float
) -> tuple[NDArray[np.int64], Array]:
    """Courses along the tunnel: number of each block's random values, distance to the nearest joint."""
    bounds = np.cumsum(np.r_[-sheet.end - 0.1, heights])
    l, s = sheet.l[0], sheet.s[:, 0]  # noqa: E741
    row = np.clip(np.searchsorted(bounds, l) - 1, 0, len(heights) - 1)
    to_bed = np.minimum(l - bounds[row], bounds[row + 1] - l)
    number = np.zeros(sheet.shape, np.int64)
    gap = np.empty(sheet.shape)
    wander = 0.004 * np.sin(s / 1.7) + 0.003 * np.sin(s / 0.43)
    for k in np.unique(row):
        columns = np.flatnonzero(row == k)
        count = int((sheet.s1 - sheet.s0) / lengths[0]) + 4
        ends = np.cumsum(np.r_[s[0] - lengths[1] * rng.random(), rng.uniform(*lengths, count)])
        block = np.clip(np.searchsorted(ends, s) - 1, 0, count - 1)
        to_head = np.minimum(s - ends[block], ends[block + 1] - s)
        number[:, columns] = (block * 131 + k * 7919)[:, None]
        gap[:, columns] = np.minimum(to_head[:, None], to_bed[None, columns] + wander[:, None])
    return number % 65521, gap - joint / 2


def brick(sheet: Sheet, rng: np.random.Generator, spread: float = 0.7, mortar: float = 1.2) -> None:
    """Bricks of 25 by 6.5 cm in rings, burnt unevenly, with mortar that is light where whole and dark where gone."""
    heights = np.full(int(2 * sheet.end / 0.077) + 5, 0.077) + rng.normal(0, 0.0015, int(2 * sheet.end / 0.077) + 5)
    number, gap = _blocks(sheet, rng, heights, (0.245, 0.275), 0.011)
    tone = rng.normal(0, spread, 65521)
    burnt = rng.random(65521) < 0.03
    tone[burnt] -= 2.0
    face = np.clip(0.5 + gap / 0.006, 0, 1)
    gone = np.clip(noise(sheet.shape, rng, 0.5, 3, 2.5) - 0.9, 0, 1)
    sheet.light += face * tone[number] + (1 - face) * (mortar - 5.0 * gone)
    spalled = rng.random(65521) < 0.015
    thirst = rng.uniform(0.8, 1.15, 65521)
    sheet.thirst[:] = face * thirst[number] + (1 - face) * 1.15
    depth = rng.normal(0, 0.0012, 65521) + 0.009 * spalled
    sheet.relief += face * depth[number] + (1 - face) * (0.004 + 0.008 * gone)


def stone(sheet: Sheet, rng: np.random.Generator, spread: float = 1.0, bossed: float = 0.006) -> None:
    """Dressed stones in courses of 25 to 40 cm, from more than one quarry, faces left rough, joints of lime mortar."""
    heights = rng.uniform(0.25, 0.40, int(2 * sheet.end / 0.25) + 4)
    number, gap = _blocks(sheet, rng, heights, (0.38, 0.85), 0.016)
    tone = rng.normal(0, spread, 65521)
    face = np.clip(0.5 + gap / 0.008, 0, 1)
    gone = np.clip(noise(sheet.shape, rng, 0.9, 2, 2.0) - 0.6, 0, 1)
    sheet.light += face * tone[number] + (1 - face) * (1.0 - 3.0 * gone)
    sheet.light += face * 0.35 * noise(sheet.shape, rng, 0.05, 2)
    thirst = rng.uniform(0.65, 1.15, 65521)
    sheet.thirst[:] = face * thirst[number] + (1 - face) * 1.15
    bulge = bossed * np.clip(gap / 0.05, 0, 1) * (1 + 0.5 * noise(sheet.shape, rng, 0.09, 2))
    sheet.relief += (1 - face) * (0.006 + 0.008 * gone) - face * (bulge + 0.003 * tone[number] / spread)


def cast(sheet: Sheet, rng: np.random.Generator, block: float, first: float, boards: float = 0.0) -> None:
    """Cast concrete: blocks of one pour each, laitance, pores, marks of boards (width) or of steel panels."""
    s = sheet.s[:, 0]
    pour = np.floor((s - first) / block).astype(int) + 20
    sheet.light += rng.normal(0, 0.35, 60)[pour][:, None]
    sheet.relief += rng.normal(0, 0.003, 60)[pour][:, None]
    cloud(sheet, rng, 0.45, 0.9, 5)
    to_joint = np.abs((s - first + block / 2) % block - block / 2)[:, None]
    groove = np.exp(-((to_joint / 0.012) ** 2))
    sheet.light -= 2.0 * groove * np.clip(1 + 0.5 * noise(sheet.shape, rng, 0.4, 2), 0, 2)
    sheet.relief += 0.008 * groove
    if boards:
        count = int(2 * sheet.end / boards) + 3
        number = ((sheet.l[0] + sheet.end) / boards).astype(int)
        sheet.light += rng.normal(0, 0.4, (60, count))[pour][:, number]
        sheet.relief += rng.normal(0, 0.0015, count)[number][None, :]
        seam = np.abs((sheet.l[0] + sheet.end) / boards - np.rint((sheet.l[0] + sheet.end) / boards)) * boards
        sheet.light -= 0.7 * np.exp(-((seam / 0.006) ** 2))[None, :]
    else:
        panel = np.abs((s - first + 0.6) % 1.2 - 0.6)[:, None]
        sheet.light -= 0.6 * np.exp(-((panel / 0.008) ** 2))
    pores = ndimage.gaussian_filter((rng.random(sheet.shape) < 0.0015).astype(np.float32), 0.8)
    sheet.light -= 9.0 * np.clip(pores, 0, 0.3)


def shotcrete(sheet: Sheet, rng: np.random.Generator, bump: float = 0.007) -> None:
    """Sprayed concrete: humps of a decimetre or two, grain, bands of single passes."""
    sheet.relief += bump * np.clip(noise(sheet.shape, rng, 0.22, 4), -2.2, 2.2)
    cloud(sheet, rng, 0.5, 1.2, 4, 0.5)
    sheet.light += 0.4 * noise(sheet.shape, rng, 0.04, 2)
    sheet.light += 0.5 * noise(sheet.shape, rng, 3.0, 1, 0.3)


def segments(sheet: Sheet, rng: np.random.Generator, ring: float, count: int) -> None:
    """Precast rings, every other one turned by half a segment."""
    s, l = sheet.s[:, 0], sheet.l[0]  # noqa: E741
    number = np.floor((s - sheet.s0) / ring).astype(int)
    length = 2 * sheet.end / count
    turn = np.where(number % 2 == 0, 0.0, length / 2)
    piece = np.floor((l[None, :] + turn[:, None]) / length).astype(int) + 30
    tone = rng.normal(0, 0.45, (int((sheet.s1 - sheet.s0) / ring) + 2, 70))
    sheet.light += tone[number[:, None], piece]
    sheet.relief += 0.004 * tone[number[:, None], piece]
    along = np.abs((s - sheet.s0 + ring / 2) % ring - ring / 2)[:, None]
    across = np.abs((l[None, :] + turn[:, None] + length / 2) % length - length / 2)
    groove = np.exp(-((np.minimum(along, across) / 0.010) ** 2))
    sheet.light -= 2.2 * groove
    sheet.relief += 0.010 * groove
    cloud(sheet, rng, 0.35, 0.7, 4)


def pockets(s0: float, s1: float, end: float, ring: float, count: int) -> list[tuple[float, float]]:
    """Place (s, l) of the bolt pockets of such rings."""
    length = 2 * end / count
    at = [
        (s0 + ring * (r + 0.18 + 0.64 * k), length * (c + 0.5) - (length / 2 if r % 2 else 0.0))
        for r in range(int((s1 - s0) / ring))
        for c in range(-count, count)
        for k in (0, 1)
    ]
    return [(a, b) for a, b in at if abs(b) < end - 0.3]


def shade(sheet: Sheet) -> tuple[Array, Array]:
    """Slope of the relief along s and l, as a beam some millimetres wide sees it."""
    smooth = ndimage.gaussian_filter(sheet.relief, 0.8)
    return np.clip(np.gradient(smooth, H, axis=0), -0.5, 0.5), np.clip(np.gradient(smooth, H, axis=1), -0.5, 0.5)
