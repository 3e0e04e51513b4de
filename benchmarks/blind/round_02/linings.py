"""What a lining is made of: brick, stone, rock, sprayed and cast concrete, each as reflectance and relief."""

from __future__ import annotations

import numpy as np

from .arrays import BoolArray, FloatArray, IntArray
from .canvas import CELL, Canvas, Window
from .noise import fractal, line, ramp, smooth

JOINT = 0.011


def _breaks(rng: np.random.Generator, low: float, high: float, shortest: float, longest: float) -> FloatArray:
    """Positions of joints, from below `low` to beyond `high`, at random distances."""
    count = int((high - low) / shortest) + 3
    return np.asarray(low - rng.random() * longest + np.cumsum(rng.uniform(shortest, longest, count)))


def brickwork(
    rng: np.random.Generator,
    window: Window,
    level: float,
    scatter: float = 0.9,
    burnt: float = 0.08,
    mortar: float = 0.8,
    course: float = 0.076,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """English bond with its beds along the tunnel.

    Parameters
    ----------
    rng, window
        Randomness, and where.
    level, scatter : float
        Mean reflectance of bricks in dB and its scatter from brick to brick.
    burnt : float
        Share of overburnt, dark headers.
    mortar : float
        Reflectance of joints above `level`, dB.
    course : float
        Height of a course with its joint, metres.

    Returns
    -------
    albedo, relief, units
        Reflectance in dB, relief in metres, and one random number for each brick.
    """
    course_number = np.floor(window.t / course).astype(int)
    course_number -= course_number.min()
    header = course_number % 2 == 1
    length = np.where(header, 0.118, 0.236)
    shift = rng.uniform(-0.01, 0.01, course_number.max() + 1)[course_number] + np.where(header, 0.03, 0.0) + 1.0
    x = (window.s[:, None] - window.s[0] + shift) / length
    brick = np.floor(x).astype(np.int32)
    columns = int(brick.max()) + 1
    size = (columns, int(course_number.max()) + 1)
    value = rng.normal(0, scatter, size)
    value -= 3.0 * ((rng.random(size) < burnt) & (np.arange(size[1]) % 2 == 1))
    albedo = (level + value)[brick, course_number[None, :]].astype(np.float32)
    units = rng.uniform(-1, 1, size).astype(np.float32)[brick, course_number[None, :]]
    y = np.abs((window.t / course) % 1 - 0.5) * course
    bed = y > course / 2 - JOINT / 2
    joint = (np.abs(x - brick - 0.5) * length > length / 2 - JOINT / 2) | bed[None, :]
    depth = np.abs(0.006 + 0.004 * smooth(rng, window.shape, CELL, 0.8))
    relief = rng.normal(0, 0.0025, size).astype(np.float32)[brick, course_number[None, :]]
    joints = level + mortar + 0.5 * smooth(rng, window.shape, CELL, 0.5)
    albedo = np.where(joint, joints, albedo)
    relief = np.where(joint, relief - depth, relief)
    albedo += fractal(rng, window.shape, CELL, (1.5, 0.3), (0.5, 0.25))
    return albedo.astype(np.float32), relief.astype(np.float32), units


def ashlar(
    rng: np.random.Generator, window: Window, level: float, scatter: float = 1.1, bulge: float = 0.010
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Coursed stone; courses and blocks of varying size, faces that bulge. Returns the same as `brickwork`."""
    beds = _breaks(rng, float(window.t[0]), float(window.t[-1]), 0.27, 0.42)
    number = np.searchsorted(beds, window.t)
    ids = np.zeros(window.shape, dtype=np.int32)
    gap = np.zeros(window.shape, dtype=np.float32)
    bed_gap = np.minimum(np.abs(window.t - beds[number - 1]), np.abs(window.t - beds[np.minimum(number, beds.size - 1)]))
    total = 0
    for row in np.unique(number):
        ends = _breaks(rng, float(window.s[0]), float(window.s[-1]), 0.38, 0.95)
        block = np.searchsorted(ends, window.s)
        beside = np.minimum(np.abs(window.s - ends[block - 1]), np.abs(window.s - ends[np.minimum(block, ends.size - 1)]))
        columns = number == row
        ids[:, columns] = (block + total)[:, None]
        gap[:, columns] = np.minimum(beside[:, None], bed_gap[columns][None, :])
        total += ends.size + 1
    value = rng.normal(0, scatter, total).astype(np.float32)
    units = rng.uniform(-1, 1, total).astype(np.float32)[ids]
    wander = 0.004 * smooth(rng, window.shape, CELL, 0.12)
    joint = ramp((0.009 - gap + wander) / 0.012)
    face = fractal(rng, window.shape, CELL, (0.15, 0.04), (0.45, 0.25)) * bulge
    pillow = bulge * np.minimum(gap / 0.10, 1)
    stagger = rng.normal(0, 0.006, total).astype(np.float32)[ids]
    relief = (face + pillow + stagger) * (1 - joint) - 0.014 * joint
    albedo = level + value[ids] * (1 - joint) + joint * (0.9 + 0.6 * smooth(rng, window.shape, CELL, 0.7))
    albedo += fractal(rng, window.shape, CELL, (1.2, 0.25, 0.06), (0.5, 0.4, 0.3))
    return albedo.astype(np.float32), relief.astype(np.float32), units


def sprayed(
    rng: np.random.Generator, window: Window, level: float, rough: float = 1.0
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Sprayed concrete: lumps of centimetres, lanes of the nozzle. Returns the same as `brickwork`."""
    shape = window.shape
    relief = rough * fractal(rng, shape, CELL, (0.9, 0.28, 0.10, 0.045), (0.020, 0.012, 0.005, 0.002))
    lanes = 0.35 * smooth(rng, shape, CELL, 0.5, 1.6)
    albedo = level + lanes + fractal(rng, shape, CELL, (1.5, 0.25, 0.05), (0.35, 0.35, 0.4))
    return albedo.astype(np.float32), relief, 0.6 * smooth(rng, shape, CELL, 0.12)


def rock(
    rng: np.random.Generator, window: Window, level: float, amplitude: float = 1.0
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Blasted rock: facets of three sets of joints, bands of other minerals. Returns the same as `brickwork`."""
    s, t = window.s[:, None].astype(np.float32), window.t[None, :].astype(np.float32)
    warp = fractal(rng, window.shape, CELL, (2.5, 0.8), (0.35, 0.10))
    relief = fractal(rng, window.shape, CELL, (3.0, 0.5, 0.18, 0.06), (0.05, 0.022, 0.009, 0.003))
    albedo = np.full(window.shape, level, dtype=np.float32)
    facets: IntArray = np.zeros(window.shape, dtype=np.int32)
    for angle, spacing, height in ((0.5, 1.9, 0.20), (1.9, 1.1, 0.11), (2.7, 0.55, 0.05)):
        x = (np.cos(angle) * s + np.sin(angle) * t + warp) / spacing
        sheet = np.floor(x).astype(np.int32)
        saw = np.abs(x - sheet - 0.35) / 0.65
        relief += np.float32(height) * (saw - 0.5) * (0.7 + 0.6 * rng.random(400)[sheet % 400])
        facets = facets * 31 + sheet
        albedo -= 1.1 * ramp((0.015 - np.abs(x - np.rint(x)) * spacing) / 0.02)
    albedo += rng.normal(0, 0.7, 4099).astype(np.float32)[facets % 4099]
    bands = np.sin(2 * np.pi * (0.6 * s - 0.8 * t + 1.5 * warp) / 1.3)
    albedo += 0.6 * bands + fractal(rng, window.shape, CELL, (0.4, 0.08), (0.4, 0.4))
    units = rng.uniform(-1, 1, 4099).astype(np.float32)[facets % 4099]
    return albedo.astype(np.float32), (amplitude * relief).astype(np.float32), units


def cast(
    rng: np.random.Generator, window: Window, level: float, block: float = 8.0, plank: float = 0.12, first: float = 2.4
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Concrete cast in blocks against planks, with lifts and gravel nests. Returns the same as `brickwork`."""
    shape = window.shape
    number = np.floor((window.s - first) / block).astype(int) + 1
    lift = np.digitize(window.t, (-3.4, 3.3))
    tone = rng.normal(0, 0.45, (number.max() + 1, 3)).astype(np.float32)[number][:, lift]
    board = np.floor(window.t / plank).astype(int) - int(np.floor(window.t[0] / plank))
    boards = rng.normal(0, 0.22, (number.max() + 1, board.max() + 1)).astype(np.float32)[number][:, board]
    steps = rng.normal(0, 0.0012, (number.max() + 1, board.max() + 1)).astype(np.float32)[number][:, board]
    relief = steps + rng.normal(0, 0.004, number.max() + 1).astype(np.float32)[number][:, None]
    clouds = fractal(rng, shape, CELL, (2.0, 0.7, 0.2, 0.05), (0.45, 0.40, 0.3, 0.3))
    albedo = level + tone + boards + clouds
    nest = ramp((smooth(rng, shape, CELL, 0.35) - 2.6) / 0.5)
    albedo -= 1.8 * nest * (0.6 + 0.4 * smooth(rng, shape, CELL, 0.03))
    relief = relief - 0.008 * nest + 0.0015 * smooth(rng, shape, CELL, 0.5)
    distance = np.abs((window.s - first + block / 2) % block - block / 2)
    seam = ramp((0.012 - distance) / 0.012)[:, None]
    albedo = albedo - 1.3 * seam
    relief = relief - 0.012 * seam
    for edge in (-3.4, 3.3):
        joint = edge + 0.03 * line(rng, window.s, 0.9)
        albedo -= 0.8 * ramp((0.010 - np.abs(window.t[None, :] - joint[:, None])) / 0.012)
    return albedo.astype(np.float32), relief.astype(np.float32), 0.5 * smooth(rng, shape, CELL, 0.2)


def lay(
    canvas: Canvas, window: Window, fabric: tuple[FloatArray, FloatArray, FloatArray], mask: FloatArray | None = None
) -> None:
    """Put a fabric onto a part of the canvas, where `mask` says so."""
    for raster, values in zip((canvas.albedo, canvas.relief, canvas.units), fabric, strict=True):
        if mask is None:
            raster[window.index] = values
        else:
            raster[window.index] += (mask * (values - raster[window.index])).astype(np.float32)


def lengths(rng: np.random.Generator, canvas: Canvas, shortest: float, longest: float, ring: float, half: float) -> FloatArray:
    """Differences between the lengths in which a tunnel was turned, and between their left and right halves.

    Parameters
    ----------
    rng, canvas
        Randomness, and what is changed.
    shortest, longest : float
        Length of a part, metres.
    ring, half : float
        Standard deviations in dB: from part to part, and of each half in it.

    Returns
    -------
    ndarray
        Chainages of the joints between them.
    """
    ends = _breaks(rng, 0.0, canvas.length, shortest, longest)
    number = np.searchsorted(ends, canvas.s)
    parts = rng.normal(0, ring, (ends.size + 1, 1)) + rng.normal(0, half, (ends.size + 1, 2))
    meet = rng.normal(0, 0.15, ends.size + 1)
    left: BoolArray = canvas.t[None, :] < meet[number][:, None]
    canvas.albedo += np.where(left, parts[number, 0][:, None], parts[number, 1][:, None]).astype(np.float32)
    canvas.relief += rng.normal(0, 0.004, ends.size + 1).astype(np.float32)[number][:, None]
    inside = ends[(ends > 0) & (ends < canvas.length)]
    for end in inside:
        near = np.abs(canvas.s - end) < 0.03
        seam = ramp((0.012 - np.abs(canvas.s[near] - end)) / 0.015)[:, None]
        canvas.albedo[near] -= (0.9 * seam).astype(np.float32)
        canvas.relief[near] -= (0.008 * seam).astype(np.float32)
    return np.asarray(inside)
