"""Painted pictures for training: water and dry marks on lining as scans show it.

    python -m benchmarks.network.painting --cache DIR --count 300       # about three seconds each

Painted are the shapes of :mod:`benchmarks.network.shapes`, and: water and dirt along the foot of the walls without an end,
tones of segments and rings, joints, courses of brick, ribs of cast iron, rows of bolt pockets, posts with their shadows,
banding, noise, sparse points, grey steps. The rims of water count neither as wet nor as dry.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from scipy import ndimage

from benchmarks.evidence.painted import CELL, HALF, LONG, PIXEL, Painting
from benchmarks.network.sample import DRY as CLEAN
from benchmarks.network.sample import LIMIT, NONE, OTHER, WET, Sample
from benchmarks.network.shapes import DRY, WATER, Joints
from tunneldb.raster.pixel_size import FACTORS, MIN_POINTS
from tunneldb.raster.state import PixelState

DARK = 0.4
"""Painted darkening from which dry lining counts as dark, dB."""


RIM = 4
"""Width of the rims of water, pixels."""


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.network.painting", description=__doc__.splitlines()[0])
    parser.add_argument("--cache", type=Path, required=True, metavar="DIR")
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--first", type=int, default=1, help="seed of the first one")
    arguments = parser.parse_args()
    folder = arguments.cache / "scenes" / "painted"
    folder.mkdir(parents=True, exist_ok=True)
    for seed in range(arguments.first, arguments.first + arguments.count):
        path = folder / f"{seed:05}.npz"
        if not path.is_file():
            paint(seed).save(path)


def paint(seed: int) -> Sample:
    """Paint a picture."""
    art = Painting(100_000 + seed)
    rng = art.rng
    art.state[np.abs(np.broadcast_to(art.y, art.state.shape)) > HALF - rng.uniform(0.1, 1.0)] = PixelState.FLOOR
    joints = Joints.of(rng)
    busy, leaky = rng.uniform(0.1, 1.0), rng.uniform(0.1, 0.8)
    few = rng.random() < 0.25
    chosen = {wet: np.array([share if not few or rng.random() < 0.25 else 1e-9 for _, share in things])
              for wet, things in ((True, WATER), (False, DRY))}  # fmt: skip
    cells = [(s, a) for s in np.arange(CELL / 2, LONG, CELL) for a in (-HALF + CELL / 2, 0.1, HALF - CELL / 2)]
    busy_cells = [cell for cell in cells if rng.random() < busy]
    for s, a, wet in sorted(((s, a, bool(rng.random() < leaky)) for s, a in busy_cells), key=lambda cell: cell[2]):
        often = chosen[wet]  # what is dry first: water lies on top
        make, _ = (WATER if wet else DRY)[rng.choice(len(often), p=often / often.sum())]
        make(art, joints, float(s + rng.uniform(-1.2, 1.2)), float(a + rng.uniform(-1.2, 1.2)))
    dark = np.abs(art.drop) > DARK
    for side in (-1, 1):
        if rng.random() < 0.5:
            dark |= foot(art, side, wet=bool(rng.random() < 0.65))
    label = np.where(art.wet, WET, np.where(dark, OTHER, CLEAN)).astype(np.uint8)
    label[ndimage.binary_dilation(art.wet, iterations=RIM) & ~art.wet & (art.drop > DARK)] = LIMIT
    level = -art.drop * rng.uniform(0.7, 1.1) + lining(art, label, joints)
    return scanned(art, level, label)


def foot(art: Painting, side: int, *, wet: bool) -> np.ndarray:
    """Darken the foot of a wall along the whole picture: water that rises, its upper edge ragged, or straight dirt."""
    rng = art.rng
    edge = float(np.abs(art.y[(art.state[:, 0] != PixelState.FLOOR)]).max())
    up = edge - side * art.y
    if wet:
        rag = sum(ndimage.gaussian_filter1d(rng.normal(0, 1, len(art.x)), w, mode="wrap") * np.sqrt(w) for w in (3, 12, 40))
        height = art.log(0.08, 0.9) * np.clip(1 + art.uniform(0.1, 0.4) * rag, 0.1, 3.0)
        if rng.random() < 0.5:
            at = (art.x - art.uniform(0, 1.5)) % art.uniform(1.0, 2.0)
            height = height + art.uniform(0.1, 0.5) * np.exp(-at / art.uniform(0.03, 0.2))
        amount = np.clip((height - up) / art.log(0.01, 0.15) + 0.5, 0, 1) * (up > 0)
    else:
        low, height = art.uniform(0.0, 0.5), art.log(0.05, 1.5)
        soft = art.log(0.01, 0.1) if rng.random() < 0.6 else height
        amount = np.clip((low + height - up) / soft + 0.5, 0, 1) * (up > low) * np.ones(len(art.x))
    field = ndimage.gaussian_filter(rng.normal(0, 1, art.drop.shape), art.uniform(3, 20))
    drop = art.log(1.8, 8.0) * np.clip(1 + art.uniform(0, 0.35) * field / field.std(), 0.3, 1.6)
    art.paint(amount, drop, wet=wet)
    return amount >= DARK


def lining(art: Painting, label: np.ndarray, at: Joints) -> np.ndarray:
    """Level of dry lining, dB: tones, joints, texture, fittings; joints and fittings are marked as dark but dry."""
    rng, x, y = art.rng, art.x, art.y
    level = np.zeros(art.drop.shape)
    ring = float(np.diff(at.around).mean()) if len(at.around) > 1 else 12.0
    from_ = ring - float(at.around[0])
    number = np.floor((x + from_) / ring).astype(int)
    if rng.random() < 0.7:
        level += rng.normal(0, art.uniform(0, 0.6), number.max() + 1)[number]
    joints = np.zeros(label.shape, np.bool_)
    if rng.random() < 0.6:
        joints |= np.broadcast_to(((x + from_ + 0.02) % ring) < 0.04, label.shape)
        part = art.uniform(1.2, 3.0)
        shift = rng.integers(0, 2, number.max() + 1)[number] * part / 2
        joints |= ((y + 10 + shift) % part) < 0.03
        tone = rng.normal(0, art.uniform(0, 0.5), (64, 64))
        level += tone[np.floor((y + 10 + shift) / part).astype(int) % 64, number % 64]
        level[joints] -= art.log(0.3, 4.0)
    kind = rng.random()
    if kind < 0.12:
        course = art.uniform(0.07, 0.12)
        row = np.floor((y + 10) / course).astype(int)
        stone = np.floor((x + 0.11 * (row % 2)) / 0.23).astype(int)
        level += rng.normal(0, art.uniform(0.3, 1.2), (512, 512))[row % 512, stone % 512]
    elif kind < 0.22:
        rib = art.uniform(0.4, 0.8)
        level -= art.log(0.5, 3.0) * (((x + from_) % rib) < 0.1)
        level -= art.log(0.5, 3.0) * (((y + 10) % art.uniform(0.5, 1.6)) < 0.1)
    if rng.random() < 0.35:
        size, across = art.uniform(0.06, 0.2), art.uniform(0.8, 1.6)
        marks = (np.abs((x + from_) % ring - 0.3) < size / 2) & (np.abs((y + 10) % across - 0.4) < size / 2)
        level[marks] -= art.log(0.5, 5.0)
        label[marks & (label == CLEAN)] = OTHER
    if rng.random() < 0.25:
        low, high = sorted(rng.uniform(1.0, HALF, 2))
        posts = ((x % art.uniform(0.8, 2.0)) < art.log(0.04, 0.12)) & (y * rng.choice([-1, 1]) > low) & (np.abs(y) < high)
        level[posts] -= art.log(1.0, 6.0)
        label[posts & (label == CLEAN)] = OTHER
    for scale in (4, 15, 60, 150):
        field = ndimage.gaussian_filter(rng.normal(0, 1, label.shape), scale)
        level += art.uniform(0, 0.5) * field / field.std()
    level += art.uniform(0, 0.3) * rng.normal(0, 1, len(x)) * (rng.random() < 0.4)
    level += art.uniform(-0.8, 0.8) * (y / HALF) ** 2 + art.uniform(-0.5, 0.5) * y / HALF
    label[joints & (label == CLEAN)] = OTHER
    return level


def scanned(art: Painting, level: np.ndarray, label: np.ndarray) -> Sample:
    """See the picture with noise, in steps, by points of some density or profiles apart, on pixels as the program's."""
    rng = art.rng
    density = art.log(40.0, 4000.0) if rng.random() < 0.5 else 4000.0
    points = rng.poisson(density * PIXEL**2, level.shape)
    if rng.random() < 0.15:
        every = int(rng.integers(2, 16))
        points[:, np.arange(level.shape[1]) % every != 0] = 0
    points[art.state > PixelState.RECESS] = 1
    sigma = art.log(0.15, 1.2) * (1.0 if density > 1000.0 or rng.random() < 0.5 else 0.5)
    noisy = level + rng.normal(0, 1, level.shape) * sigma / np.sqrt(np.maximum(points, 1))
    step = rng.choice([0.0, 0.0, 0.08, 0.25])
    if step:
        noisy = np.rint(noisy / step) * step
    factor = next((f for f in FACTORS if density * (PIXEL * f) ** 2 >= MIN_POINTS), FACTORS[-1])
    rows, columns = (n // factor * factor for n in level.shape)
    first = (art.grid.bottom + art.grid.rows) % factor  # rows above the first whole pixel
    here = np.s_[first : first + (rows - first) // factor * factor, :columns]

    def blocks(image: np.ndarray) -> np.ndarray:
        high, wide = image[here].shape
        return (
            image[here]
            .reshape(high // factor, factor, wide // factor, factor)
            .swapaxes(1, 2)
            .reshape(-1, wide // factor, factor**2)
        )

    count = blocks(points).sum(-1)
    mean = (blocks(noisy) * blocks(points)).sum(-1) / np.maximum(count, 1)
    state = np.sort(blocks(art.state), axis=-1)[..., factor**2 // 2]
    empty = count == 0
    state = np.where(empty & (state <= PixelState.RECESS), PixelState.EMPTY, state).astype(np.uint8)
    seen = np.where(empty, NONE, np.rint(100 * (mean + 40.0))).astype(np.int16)
    marks = blocks(label)
    wet = (marks == WET).mean(-1)
    marks = np.where((marks == LIMIT).mean(-1) >= 0.25, LIMIT, np.where((marks == OTHER).mean(-1) >= 0.5, OTHER, CLEAN))
    marks = np.where(wet >= 0.5, WET, marks).astype(np.uint8)
    bottom = (art.grid.bottom + art.grid.rows - first) // factor - len(state)
    return Sample(state, seen, marks, PIXEL * factor, 0.0, bottom)


if __name__ == "__main__":
    main()
