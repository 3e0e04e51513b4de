"""Pictures on which leaks, and what is dark but dry, are painted in great numbers, with ranges wider than a tunnel has.

Scans hold few of each thing. Here shapes are drawn by chance on lining with noise, each in a cell of its own: patches with soft
or sharp rims, uneven, with drips, curtains and wet bands; and repairs, upright or turned, segments of another shade, soot,
halos, stripes, grime beneath cables, shadows beside them, bolt pockets and joints.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy import ndimage
from shapely import affinity
from shapely.geometry import Polygon, box

from benchmarks.evidence.candidates import LEAST, MOSTLY, Candidates
from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.anomalies.detect import find_dark, find_dark_regions, is_large_enough
from tunneldb.anomalies.features import measure_regions
from tunneldb.raster.geotiff import NODATA
from tunneldb.raster.grid import FaceGrid
from tunneldb.raster.state import PixelState

PIXEL, TILE = 0.02, 25
LONG, HALF = 15.0, 4.5
"""Of a picture: from chainage 0 on, and arc from -HALF to HALF, m."""
CELL = 3.0
"""Side of a cell, m."""

Array = NDArray[np.float64]


class Painting:
    """Lining with noise, and what was painted on it."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.sigma = float(np.exp(self.rng.uniform(np.log(0.15), np.log(0.6))))
        self.filled = float(self.rng.uniform(0.5, 1.0))
        self.grid = FaceGrid(PIXEL, round(-HALF / PIXEL), round(2 * HALF / PIXEL), 0, round(LONG / PIXEL))
        self.x = (np.arange(round(LONG / PIXEL)) + 0.5) * PIXEL
        self.y = (HALF - (np.arange(self.grid.rows) + 0.5) * PIXEL)[:, None]
        self.drop = np.zeros((self.grid.rows, len(self.x)))
        self.state = np.full(self.drop.shape, PixelState.LINING, np.uint8)
        self.wet = np.zeros(self.drop.shape, np.bool_)

    def uniform(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high))

    def log(self, low: float, high: float) -> float:
        return float(np.exp(self.rng.uniform(np.log(low), np.log(high))))

    def cover(self, shape: Polygon, soft: float = 0.008) -> Array:
        """Return the share of each pixel covered by a shape, its edge blurred by a standard deviation, m."""
        held = shapely.contains_xy(shape, *np.broadcast_arrays(self.x, self.y)).astype(float)
        return ndimage.gaussian_filter(held, max(soft, 0.004) / PIXEL)

    def paint(self, amount: Array, drop: float, wet: bool = False) -> None:
        """Darken by a drop, dB, where an amount (0 to 1) is; where it is 0.4 and more it is wet, or dry, whatever was there."""
        self.drop = np.maximum(self.drop, drop * amount)
        self.wet[amount >= 0.4] = wet

    def regions(self) -> Iterator[tuple[Array, bool]]:
        """Features of the dark regions, and whether each is a leak."""
        noisy = self.drop + self.rng.normal(0, self.sigma, self.drop.shape)
        empty = (self.rng.random(self.drop.shape) > self.filled) & (self.state != PixelState.OFF)
        drop = np.where(empty, NODATA, np.rint(100 * noisy)).astype(np.int16)
        state = np.where(empty, PixelState.EMPTY, self.state).astype(np.uint8)
        sigma = np.full((self.grid.rows // TILE, self.grid.columns // TILE), self.sigma, np.float32)
        contrast = ContrastImage(self.grid, state, drop, TILE, sigma)
        dark = find_dark(contrast)
        regions = [region for region in find_dark_regions(dark, contrast, LEAST) if is_large_enough(region, LEAST)]
        for region, features in zip(regions, measure_regions(regions), strict=True):
            rows, columns = region.mask.shape
            top = self.grid.bottom + self.grid.rows - region.row - rows
            part = self.wet[top : top + rows, region.column : region.column + columns]
            yield features, bool(part[region.mask[::-1]].mean() >= MOSTLY)


def blob(art: Painting, s: float, a: float, area: float, elongation: float = 1.0) -> Polygon:
    """A patch of irregular outline; longer around the tunnel by a factor."""
    angle = np.linspace(0, 2 * np.pi, 120, endpoint=False)
    rough = art.uniform(0.05, 0.35)
    radius = 1 + sum(art.rng.normal(0, rough / k) * np.cos(k * angle + art.uniform(0, 6)) for k in range(2, 12))
    radius = np.maximum(radius, 0.3)
    shape = Polygon(np.column_stack([radius * np.cos(angle), elongation * radius * np.sin(angle)])).buffer(0)
    factor = float(np.sqrt(area / shape.area))
    return affinity.translate(affinity.scale(shape, factor, factor, origin=(0, 0)), s, a)


def uneven(art: Painting) -> Array:
    """Factor by which a patch differs from place to place, be it wet or dry: by how much tells neither."""
    field = ndimage.gaussian_filter(art.rng.normal(0, 1, art.drop.shape), art.uniform(4, 20))
    return np.clip(1 + art.uniform(0, 0.4) * field / field.std(), 0.3, 1.6)


def patch(art: Painting, s: float, a: float) -> None:
    shape = blob(art, s, a, art.log(0.06, 3.0), art.uniform(0.5, 2.5))
    down = 1.0 if a >= 0 else -1.0
    if art.rng.random() < 0.4:
        for _ in range(art.rng.integers(1, 5)):
            x, width, length = art.uniform(shape.bounds[0], shape.bounds[2]), art.uniform(0.03, 0.12), art.uniform(0.2, 1.2)
            shape = shape.union(
                Polygon(
                    [(x - width, a), (x + width, a), (x + width / 2, a + down * length), (x - width / 2, a + down * length)]
                )
            )
    art.paint(art.cover(shape, art.log(0.006, 0.08)) * uneven(art), art.log(0.9, 9.0), wet=True)
    if art.rng.random() < 0.2:
        rim = ndimage.binary_dilation(art.cover(shape) > 0.5, iterations=int(art.uniform(2, 8)))
        art.drop[rim & (art.drop < 0.2)] -= art.uniform(1.0, 4.0)


def curtain(art: Painting, s: float, a: float) -> None:
    top, down = a - (1.0 if a >= 0 else -1.0), (1.0 if a >= 0 else -1.0)
    x = np.linspace(s - art.uniform(0.1, 0.8), s + art.uniform(0.1, 0.8), 12)
    ends = top + down * np.array([art.uniform(0.4, 2.2) for _ in x])
    shape = Polygon([(x[0], top), *zip(x, ends, strict=True), (x[-1], top)]).buffer(0.02)
    art.paint(art.cover(shape, art.log(0.006, 0.05)) * uneven(art), art.log(1.5, 8.0), wet=True)


def band(art: Painting, s: float, a: float, straight: bool = False) -> None:
    """Water along a joint, or a joint itself."""
    around = art.rng.random() < 0.5
    length = art.uniform(1.0, 2.6)
    t = np.linspace(-length / 2, length / 2, 40)
    width = art.uniform(0.03, 0.08) if straight else art.uniform(0.09, 0.4)
    wave = 0.0 if straight else art.uniform(0.1, 0.5) * width * np.sin(art.uniform(2, 9) * t + art.uniform(0, 6))
    lean = art.uniform(-0.03, 0.03) * t
    low, high = lean - width / 2 - wave / 2, lean + width / 2 + wave / 2
    line = [*zip(t, low, strict=True), *zip(t[::-1], high[::-1], strict=True)]
    shape = Polygon([(s + v, a + u) if around else (s + u, a + v) for u, v in line]).buffer(0)
    if straight:
        art.paint(art.cover(shape) * uneven(art), art.log(1.2, 7.0))
    else:
        art.paint(art.cover(shape, art.log(0.006, 0.04)) * uneven(art), art.log(1.5, 8.0), wet=True)


def joint(art: Painting, s: float, a: float) -> None:
    band(art, s, a, straight=True)


def wet_panel(art: Painting, s: float, a: float) -> None:
    shape = box(s - art.uniform(0.6, 1.1), a - art.uniform(0.6, 1.3), s + art.uniform(0.6, 1.1), a + art.uniform(0.6, 1.3))
    art.paint(art.cover(shape) * uneven(art), art.log(2.4, 7.0), wet=True)


def repair(art: Painting, s: float, a: float) -> None:
    shape = box(s - art.log(0.12, 1.2), a - art.log(0.12, 1.2), s + art.log(0.12, 1.2), a + art.log(0.12, 1.2))
    if art.rng.random() < 0.3:
        shape = affinity.rotate(shape, art.uniform(-25, 25))
    art.paint(art.cover(shape) * uneven(art), art.log(0.6, 4.5))


def shade(art: Painting, s: float, a: float) -> None:
    shape = box(s - art.uniform(0.6, 1.4), a - art.uniform(0.6, 1.4), s + art.uniform(0.6, 1.4), a + art.uniform(0.6, 1.4))
    art.paint(art.cover(shape) * uneven(art), art.log(0.5, 2.0))


def soot(art: Painting, s: float, a: float) -> None:
    along, around = art.log(0.2, 1.2), art.log(0.2, 1.2)
    amount = np.exp(-(((art.x - s) / along) ** 2) - ((art.y - a) / around) ** 2)
    art.paint(amount * (1 + 0.2 * (uneven(art) - 1)), art.log(0.8, 5.0))


def halo(art: Painting, s: float, a: float) -> None:
    far = np.hypot(art.x - s, art.y - a)
    size = art.uniform(0.1, 0.4)
    art.paint(np.clip((1.8 * size - far) / size, 0, 1), art.log(0.8, 4.0))
    art.state[(np.abs(art.x - s) < 0.3 * size) & (np.abs(art.y - a) < 0.3 * size)] = PixelState.OFF


def stripe(art: Painting, s: float, a: float) -> None:
    half = art.uniform(0.02, 0.15)
    art.paint(art.cover(box(s - 1.35, a - half, s + art.uniform(0.3, 1.35), a + half)) * uneven(art), art.log(0.8, 5.0))


def grime(art: Painting, s: float, a: float) -> None:
    """Beneath a cable, fading downwards."""
    down = 1.0 if a >= 0 else -1.0
    below = (art.y - a) * down
    along = np.clip((1.35 - np.abs(art.x - s)) / art.uniform(0.1, 0.8), 0, 1)
    art.paint(along * np.where(below > 0, np.exp(-np.maximum(below, 0) / art.log(0.08, 0.5)), 0.0), art.log(1.0, 5.0))
    art.state[(np.abs(art.y - a) < art.uniform(0.02, 0.08)) & (np.abs(art.x - s) < 1.45)] = PixelState.OFF


def shadow(art: Painting, s: float, a: float) -> None:
    """Beside a pipe, or between two."""
    half, width = art.uniform(0.03, 0.1), art.uniform(0.03, 0.12)
    near = np.abs(art.x - s) < 1.4
    art.paint(art.cover(box(s - 1.3, a + half, s + 1.3, a + half + width)) * uneven(art), art.log(1.5, 7.0))
    art.state[(np.abs(art.y - a) < half) & near] = PixelState.OFF
    if art.rng.random() < 0.5:
        art.state[(np.abs(art.y - a - 2 * half - width) < half) & near] = PixelState.OFF


def between(art: Painting, s: float, a: float) -> None:
    """Paint lining that is visible between appendages and has no boundary on dry lining."""
    half, long, frame = art.log(0.05, 0.4), art.log(0.15, 1.2), art.uniform(0.06, 0.2)
    shown = box(s - long, a - half, s + long, a + half)
    art.state[(art.cover(shown.buffer(frame, join_style="mitre")) > 0.5) & (art.cover(shown) < 0.5)] = PixelState.OFF
    art.paint(art.cover(shown) * uneven(art), art.log(1.0, 6.0))


def pocket(art: Painting, s: float, a: float) -> None:
    half = art.uniform(0.08, 0.16)
    shape = box(s - half, a - half, s + half, a + half)
    art.state[art.cover(shape) > 0.5] = PixelState.RECESS
    art.paint(art.cover(shape) * uneven(art), art.log(1.0, 6.0))


def crossed(art: Painting, s: float, a: float) -> None:
    """A patch behind a cable."""
    patch(art, s, a)
    at, half = a + art.uniform(-0.4, 0.4), art.uniform(0.02, 0.08)
    art.state[(np.abs(art.y - at) < half) & (np.abs(art.x - s) < 1.45)] = PixelState.OFF


THINGS: tuple[tuple[Callable[[Painting, float, float], None], float], ...] = (
    (patch, 6.0), (crossed, 1.5), (curtain, 1.5), (band, 2.0), (wet_panel, 0.5),
    (repair, 3.0), (shade, 1.0), (soot, 1.5), (halo, 1.0), (stripe, 2.0), (grime, 1.0), (shadow, 1.0), (between, 1.5),
    (pocket, 2.0), (joint, 2.0),
)  # fmt: skip
"""What is painted, and how often in proportion."""


ALONE = 0.4
"""Share of the pictures that show one or two sorts of things only."""


def paintings(count: int, first: int = 1) -> list[Candidates]:
    """Regions of so many pictures."""
    makers = [make for make, _ in THINGS]
    parts = []
    for seed in range(first, first + count):
        art = Painting(seed)
        often = np.array([share for _, share in THINGS])
        if art.rng.random() < ALONE:
            # A stretch that leaks everywhere; things that are repeated.
            often[:] = 0.0
            often[art.rng.choice(len(THINGS), 1 + art.rng.integers(2))] = 1.0
        for s in np.arange(CELL / 2, LONG, CELL):
            for a in (-HALF + CELL / 2, 0.1, HALF - CELL / 2):
                makers[art.rng.choice(len(makers), p=often / often.sum())](art, float(s), float(a))
        found = list(art.regions())
        features = np.array([row for row, _ in found]).reshape(len(found), -1)
        parts.append(Candidates(f"painting {seed}", "painted", features, np.array([leak for _, leak in found], np.bool_)))
    return parts
