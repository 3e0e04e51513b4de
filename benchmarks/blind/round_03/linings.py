"""What linings look like when they are dry: texture and relief, without dirt."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.spatial import cKDTree

from .arrays import Floats, smooth_line, smooth_step
from .canvas import CELL, RELIEF_CELL, Canvas


def concrete(canvas: Canvas, contrast: float = 1.0) -> None:
    """Cloudy fair concrete: patches of the pour, traces that run down the formwork, grain."""
    for along, down, sigma in ((2.2, 1.2, 0.4), (0.5, 0.4, 0.25), (0.12, 1.4, 0.22), (0.05, 0.05, 0.2), (0.01, 0.01, 0.25)):
        canvas.albedo += np.float32(sigma * contrast) * canvas.noise(along, down)
    canvas.relief += np.float32(0.002) * canvas.relief_noise(1.0, 1.0)


def blow_holes(canvas: Canvas, per_square_metre: float, depth: float, high: float = 99.0) -> None:
    """Pores of 1 to 3 cm, shaded and full of dust; below a height, where formwork stands steep."""
    count = int(per_square_metre * canvas.length * 2 * canvas.profile.foot)
    dots = np.zeros(canvas.shape, np.float32)
    rows = canvas.rng.integers(0, canvas.shape[0], count)
    columns = canvas.rng.integers(0, canvas.shape[1], count)
    np.add.at(dots, (rows, columns), canvas.rng.gamma(1.5, depth, count).astype(np.float32))
    holes = gaussian_filter(dots, 0.6, truncate=2.0) * np.float32(2.6)
    limit = 0.0 if high > 90.0 else canvas.profile.arc_of_height(high)
    canvas.albedo -= holes * canvas.wall() * (np.abs(canvas.a) >= limit)


def formwork(canvas: Canvas, pitch_s: float, pitch_a: float, line_db: float, panel_db: float) -> None:
    """Panels of the formwork: seams that show, and each panel a little brighter or darker than the next."""
    row = np.floor(canvas.s / pitch_s).astype(np.int64)
    column = np.floor((canvas.a + 50 * pitch_a) / pitch_a).astype(np.int64)
    tone = canvas.rng.normal(0.0, panel_db, (row.max() - row.min() + 1, column.max() + 1)).astype(np.float32)
    canvas.albedo += tone[(row - row.min())[:, None], column[None, :]] * canvas.wall()
    on_row = np.abs(canvas.s - pitch_s * np.round(canvas.s / pitch_s)) < 0.006
    on_column = np.abs(np.mod(canvas.a + pitch_a / 2, pitch_a) - pitch_a / 2) < 0.006
    seams = (on_row[:, None] | on_column[None, :]) * canvas.wall()
    canvas.albedo += np.float32(line_db) * seams * np.clip(0.8 + 0.5 * canvas.noise(0.4, 0.4), 0.0, 1.8)


def block_joints(canvas: Canvas, places: Sequence[float], line_db: float = -3.0, step: float = 0.004) -> None:
    """Joints between blocks: a dark groove, chipped edges, a small step of the surface."""
    for place in places:
        half = 0.008 + 0.004 * np.abs(smooth_line(canvas.rng, canvas.shape[1], 15.0))
        near = np.abs(canvas.s - place)
        rows = np.flatnonzero(near < 0.08)
        groove = np.clip((half[None, :] - near[rows, None]) / CELL + 0.5, 0.0, 1.0)
        canvas.albedo[rows] += (line_db * groove * canvas.wall()).astype(np.float32)
        canvas.relief[canvas.relief_s > place] += np.float32(canvas.rng.normal(0.0, step))


def boards(canvas: Canvas, width: float, tone_db: float) -> None:
    """Print of timber formwork: boards along the tunnel, each of its own tone, with the grain of wood."""
    board = np.floor(np.abs(canvas.a) / width).astype(np.int64) + 500 * (canvas.a < 0)
    bay = np.floor(canvas.s / 3.0).astype(np.int64) + 1
    tone = canvas.rng.normal(0.0, tone_db, (bay.max() + 1, board.max() + 1)).astype(np.float32)
    canvas.albedo += tone[bay[:, None], board[None, :]] * canvas.wall()
    canvas.albedo += np.float32(0.25) * canvas.noise(0.6, 0.015) * canvas.wall()
    fins = np.abs(np.mod(canvas.a + width / 2, width) - width / 2) < 0.006
    canvas.albedo += np.float32(-0.7) * fins * canvas.wall()


def painted(canvas: Canvas, high: float, low: float, gain: float, gloss: float) -> None:
    """Coat of light paint on the wall; it levels the tone of what is below, is glossy, and flakes here and there."""
    there = canvas.band(high, low) * np.ones((canvas.shape[0], 1), np.float32)
    flaked = smooth_step((canvas.noise(0.25, 0.2) - 2.4) * 4.0)
    there = there * (1.0 - flaked)
    canvas.albedo += (there * (gain - 0.6 * canvas.albedo)).astype(np.float32)
    canvas.gloss += (gloss * there).astype(np.float32)


def tiles(canvas: Canvas, high: float, low: float, pitch: float, gain: float, gloss: float) -> None:
    """Glazed tiles: grout that is darker and dull, each tile of its own gloss and tilt."""
    there = canvas.band(high, low, 0.01)
    column = np.floor((np.abs(canvas.a) + 0.03) / pitch).astype(np.int64) + 400 * (canvas.a < 0)
    row = np.floor(canvas.s / pitch).astype(np.int64) + 10
    shape = (row.max() + 1, column.max() + 1)
    tone = canvas.rng.normal(0.0, 0.25, shape).astype(np.float32)[row[:, None], column[None, :]]
    shine = canvas.rng.gamma(4.0, 0.25, shape).astype(np.float32)[row[:, None], column[None, :]]
    grout_s = np.abs(np.mod(canvas.s + pitch / 2, pitch) - pitch / 2) < 0.004
    grout_a = np.abs(np.mod(np.abs(canvas.a) + 0.03 + pitch / 2, pitch) - pitch / 2) < 0.004
    grout = (grout_s[:, None] | grout_a[None, :]).astype(np.float32) * 0.6
    glazed = gain + tone - 0.7 * canvas.albedo - grout * 2.0
    canvas.albedo += (there * glazed).astype(np.float32)
    canvas.gloss += (there * gloss * shine * (1.0 - grout)).astype(np.float32)


def panels(canvas: Canvas, high: float, low: float, pitch: float, stand: float, gain: float, gloss: float) -> None:
    """Enamelled steel panels on rails before the wall: two rows, gaps of 1 cm, each hung a little out of true."""
    depth = np.abs(canvas.relief_a)
    top, bottom = canvas.profile.arc_of_height(high), canvas.profile.arc_of_height(low)
    there = (depth > top) & (depth < bottom)
    row = np.floor(canvas.relief_s / pitch).astype(np.int64) + 2
    middle = 0.5 * (top + bottom)
    column = (depth > middle).astype(np.int64) + 2 * (canvas.relief_a > 0)
    shape = (row.max() + 1, 4)
    out, tilt = canvas.rng.normal(0.0, 0.002, shape), canvas.rng.normal(0.0, 0.002, shape)
    across = (canvas.relief_s - pitch * (row - 1.5))[:, None]
    place = (row[:, None], column[None, :])
    canvas.relief += ((out[place] + tilt[place] * across - stand) * there[None, :]).astype(np.float32)
    fine = canvas.band(high, low, 0.01)
    gap_s = np.abs(canvas.s - pitch * np.round(canvas.s / pitch)) < 0.006
    gap_a = np.abs(np.abs(canvas.a) - middle) < 0.006
    gaps = (gap_s[:, None] | gap_a[None, :]) * fine
    tone = canvas.rng.normal(0.0, 0.2, shape).astype(np.float32)
    row = np.floor(canvas.s / pitch).astype(np.int64) + 2
    column = (np.abs(canvas.a) > middle).astype(np.int64) + 2 * (canvas.a > 0)
    canvas.albedo += fine * (gain + tone[row[:, None], column[None, :]] - 0.8 * canvas.albedo) - np.float32(5.0) * gaps
    canvas.gloss += (gloss * fine * (1.0 - gaps)).astype(np.float32)


def shotcrete(canvas: Canvas, rough: float, waves: float) -> None:
    """Sprayed concrete: waves of the rock below, lobes of each pass of the nozzle, grain of the rebound."""
    wall = (np.abs(canvas.relief_a) < canvas.profile.foot).astype(np.float32)
    canvas.relief += np.float32(waves) * canvas.relief_noise(2.0, 1.6) * wall
    canvas.relief += np.float32(0.35 * waves) * canvas.relief_noise(0.6, 0.5) * wall
    canvas.relief += np.float32(rough) * canvas.relief_noise(0.1, 0.1) * wall
    for along, down, sigma in ((1.6, 0.9, 0.45), (0.45, 0.35, 0.35), (0.07, 0.07, 0.35), (0.01, 0.01, 0.45)):
        canvas.albedo += np.float32(sigma) * canvas.noise(along, down)


def ribs(canvas: Canvas, places: Sequence[float], half: float, rise: float, tone: float, depth: tuple[float, float]) -> None:
    """Strips across the tunnel that stand out of the wall: steel arches or drainage half-shells under shotcrete."""
    within = (np.abs(canvas.relief_a) > depth[0]) & (np.abs(canvas.relief_a) < depth[1])
    fine = (np.abs(canvas.a) > depth[0]) & (np.abs(canvas.a) < depth[1])
    for place in places:
        off = (canvas.relief_s - place) / half
        bump = np.sqrt(np.clip(1.0 - off**2, 0.0, 1.0))
        canvas.relief -= (rise * bump[:, None] * within[None, :]).astype(np.float32)
        wavy = canvas.s[:, None] - place + 0.02 * smooth_line(canvas.rng, canvas.shape[1], 40.0)[None, :]
        canvas.albedo += (tone * smooth_step((half - np.abs(wavy)) / 0.06 + 0.5) * fine).astype(np.float32)


def rock(canvas: Canvas, dip: float, amplitude: float) -> None:
    """Blasted gneiss: facets between joints, bands of dark and light minerals that dip along the tunnel."""
    density = 1.6
    reach_s, reach_a = canvas.length + 2.0, 2.0 * canvas.profile.half
    count = int(density * reach_s * reach_a)
    seeds = canvas.rng.uniform([-1.0, -canvas.profile.half], [canvas.length + 1.0, canvas.profile.half], (count, 2))
    grid = np.stack(np.meshgrid(canvas.relief_s, canvas.relief_a, indexing="ij"), axis=-1).reshape(-1, 2)
    bent = grid + 0.12 * np.stack([canvas.relief_noise(0.5, 0.5).ravel(), canvas.relief_noise(0.5, 0.5).ravel()], axis=1)
    _, facet = cKDTree(seeds).query(bent, workers=1)
    offset = canvas.rng.normal(0.0, 0.35 * amplitude, count)
    slope = canvas.rng.normal(0.0, 0.8 * amplitude, (count, 2))
    away = grid - seeds[facet]
    height = (offset[facet] + np.sum(slope[facet] * away, axis=1)).reshape(canvas.relief.shape)
    height = gaussian_filter(height, 1.6) + amplitude * 0.8 * canvas.relief_noise(3.5, 3.0)
    height += 0.018 * canvas.relief_noise(0.25, 0.25) + 0.006 * canvas.relief_noise(0.08, 0.08)
    wall = smooth_step((canvas.profile.foot - np.abs(canvas.relief_a)) / 0.3)
    canvas.relief += (height * wall).astype(np.float32)
    level = canvas.s[:, None] * math.sin(dip) + np.abs(canvas.a)[None, :] * math.cos(dip) + 0.15 * canvas.noise(1.2, 1.2)
    bands = np.interp(level, np.arange(-60.0, 60.0, 0.02), smooth_line(canvas.rng, 6000, 12.0))
    wide = np.interp(level, np.arange(-60.0, 60.0, 0.02), smooth_line(canvas.rng, 6000, 70.0))
    canvas.albedo += (0.55 * bands + 0.5 * wide).astype(np.float32)
    tone = canvas.rng.normal(0.0, 0.45, count).astype(np.float32)[facet].reshape(canvas.relief.shape)
    canvas.albedo += canvas.sample(tone, *_spread(canvas)).reshape(canvas.shape)
    for scale, sigma in ((0.1, 0.45), (0.01, 0.6)):
        canvas.albedo += np.float32(sigma) * canvas.noise(scale, scale)


def _spread(canvas: Canvas) -> tuple[Floats, Floats]:
    s, a = np.broadcast_arrays(canvas.s[:, None], canvas.a[None, :])
    return s.ravel(), a.ravel()


def floor(canvas: Canvas, tone: float, rough: float = 0.004, lines: Sequence[float] = (), loose: float = 0.0) -> None:
    """Carriageway or invert: its tone, its relief, bright road markings, and loose muck (metres of relief)."""
    there = 1.0 - canvas.wall()
    canvas.albedo *= 1.0 - 0.6 * there
    mottled = tone + 0.6 * canvas.noise(3.0, 0.4) + 0.5 * canvas.noise(0.03, 0.03)
    canvas.albedo += (there * mottled).astype(np.float32)
    for line in lines:
        for sign in (-1.0, 1.0):
            at = sign * (canvas.profile.half - line)
            canvas.albedo[:, np.abs(canvas.a - at) < 0.07] += np.float32(5.0)
    away = np.abs(canvas.relief_a) > canvas.profile.foot
    bumps = rough * canvas.relief_noise(0.3, 0.3) + loose * canvas.relief_noise(0.5, 0.5)
    canvas.relief += (bumps * away).astype(np.float32)


def relief_slopes(canvas: Canvas) -> tuple[Floats, Floats]:
    """Slope of the relief along the tunnel and along the section."""
    return np.gradient(canvas.relief, RELIEF_CELL, axis=0), np.gradient(canvas.relief, RELIEF_CELL, axis=1)
