"""Shapes of water and of dry marks on lining: at joints, cracks, holes, fittings, the crown and the foot of the walls.

Water begins at an opening and runs down; soot is soft and long; what people made is straight. All are painted on a picture of
:mod:`benchmarks.evidence.painted`. Joints are at the places that :class:`Joints` gives.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy import ndimage
from shapely.geometry import box

from benchmarks.evidence import painted
from benchmarks.evidence.painted import HALF, LONG, PIXEL, Painting, blob, uneven
from tunneldb.raster.state import PixelState

Array = NDArray[np.float64]
STEP = 0.03
"""Distance of the points of a path, m."""


@dataclass(frozen=True)
class Joints:
    """Chainages of ring joints and arcs of joints along the tunnel, m."""

    around: Array
    along: Array

    @classmethod
    def of(cls, rng: np.random.Generator) -> Joints:
        """Draw joints: rings of 1 to 2.4 m, or casts of 4 to 12 m; some joints along the tunnel."""
        ring = rng.uniform(1.0, 2.4) if rng.random() < 0.7 else rng.uniform(4.0, 12.0)
        around = np.arange(rng.uniform(0, min(ring, 4.0)), LONG, ring)
        along = rng.uniform(-HALF + 0.3, HALF - 0.3, rng.integers(1, 6))
        return cls(around, along)


def down_of(a: float) -> float:
    """Direction in which water runs at an arc: away from the crown."""
    return 1.0 if a >= 0 else -1.0


def wander(rng: np.random.Generator, count: int, reach: float) -> Array:
    """Smooth random values of about unit spread along a path."""
    values = ndimage.gaussian_filter1d(rng.normal(0, 1, count + 40), reach, mode="wrap")[20 : count + 20]
    return values / max(values.std(), 1e-9) if count > 1 else values


def depth_of(art: Painting, path: Array, half: Array) -> Array:
    """Depth (m) of pixels within a path of varying half width; negative outside."""
    depth = np.full(art.drop.shape, -1.0)
    reach = 0.4 + float(half.max())
    columns = np.flatnonzero((art.x > path[:, 0].min() - reach) & (art.x < path[:, 0].max() + reach))
    rows = np.flatnonzero((art.y[:, 0] > path[:, 1].min() - reach) & (art.y[:, 0] < path[:, 1].max() + reach))
    if not len(columns) or not len(rows):
        return depth
    here = np.ix_(rows, columns)
    x, y = art.x[columns], art.y[rows]
    best = np.full((len(rows), len(columns)), -1.0)
    for (s, a), w in zip(path, half, strict=True):
        np.maximum(best, w - np.hypot(x - s, y - a), out=best)
    depth[here] = best
    return depth


def trail(art: Painting, s: float, a: float, length: float, half: float, *, straight: float = 0.02) -> Array:
    """Depth of a trail of water that runs down from a place, wider and narrower on its way."""
    rng = art.rng
    count = max(int(length / STEP), 2)
    t = np.arange(count) * STEP
    path = np.column_stack([s + straight * wander(rng, count, 12) * np.minimum(t / 0.3, 1.0), a + down_of(a) * t])
    width = half * np.exp(art.uniform(0.1, 0.5) * wander(rng, count, art.uniform(3, 12)))
    kind = rng.random()
    if kind < 0.35:
        width = width * np.linspace(1.0, art.uniform(0.1, 0.5), count)
    elif kind < 0.6:
        width = width * np.linspace(1.0, art.uniform(1.5, 3.0), count)
    return depth_of(art, path, np.clip(width, 0.012, 0.6))


def water(art: Painting, depth: Array, drop: tuple[float, float] = (1.0, 8.0), rim: tuple[float, float] = (0.01, 0.12)) -> None:
    """Paint water where a depth is positive, with a ragged rim of some width, darker in places, on soot too."""
    field = ndimage.gaussian_filter(art.rng.normal(0, 1, depth.shape), art.log(1.5, 8.0))
    depth = depth + art.log(0.003, 0.05) * field / field.std()
    amount = np.clip(depth / art.log(*rim) + 0.5, 0, 1)
    art.drop = art.drop + amount * uneven(art) * art.log(*drop)
    art.wet |= amount >= 0.4


def joint_leak(art: Painting, joints: Joints, s: float, a: float) -> None:
    """Water at a joint around the tunnel; perhaps with beads or a fan."""
    at = float(joints.around[np.abs(joints.around - s).argmin()]) if len(joints.around) else s
    half, length = art.log(0.025, 0.2), art.log(0.3, 4.0)
    depth = trail(art, at, a, length, half, straight=0.012)
    for _ in range(art.rng.integers(0, 3)):
        depth = np.maximum(
            depth, trail(art, at, a + down_of(a) * art.uniform(0, length), art.log(0.1, 0.6), art.log(0.06, 0.3))
        )
    water(art, depth)


def edge_leak(art: Painting, joints: Joints, s: float, a: float) -> None:
    """Water at a joint along the tunnel, from which trails run down."""
    at = float(joints.along[np.abs(joints.along - a).argmin()])
    count = max(int(art.log(0.4, 4.0) / STEP), 3)
    path = np.column_stack([s + (np.arange(count) - count / 2) * STEP, at + 0.01 * wander(art.rng, count, 8)])
    half = art.log(0.02, 0.12) * np.exp(0.4 * wander(art.rng, count, 8))
    depth = depth_of(art, path, half)
    for _ in range(art.rng.integers(0, 5)):
        start = art.uniform(path[0, 0], path[-1, 0])
        depth = np.maximum(depth, trail(art, start, at, art.log(0.1, 1.5), art.log(0.02, 0.12)))
    water(art, depth)


def crack_leak(art: Painting, joints: Joints, s: float, a: float) -> None:
    """Water along a crack in any direction."""
    count = max(int(art.log(0.4, 3.0) / STEP), 3)
    turn = art.uniform(0, np.pi) + 0.25 * np.cumsum(art.rng.normal(0, 1, count)) * np.sqrt(STEP)
    path = np.column_stack([s + np.cumsum(np.cos(turn)) * STEP, a + np.cumsum(np.sin(turn)) * STEP])
    depth = depth_of(art, path, art.log(0.025, 0.15) * np.exp(0.4 * wander(art.rng, count, 6)))
    for k in art.rng.integers(0, count, art.rng.integers(0, 4)):
        depth = np.maximum(depth, trail(art, *path[k], art.log(0.1, 1.2), art.log(0.02, 0.1)))
    water(art, depth)


def hole_leak(art: Painting, joints: Joints, s: float, a: float) -> None:
    """Water from a hole, a bolt or a pipe's end: a small patch with a trail."""
    depth = trail(art, s, a, art.log(0.1, 2.0), art.log(0.02, 0.12))
    water(art, np.maximum(depth, art.log(0.06, 0.3) - np.hypot(art.x - s, art.y - a)))


def fingers(art: Painting, joints: Joints, s: float, a: float) -> None:
    """Water from a line, running down in fingers of different lengths."""
    wide, longest = art.log(0.2, 1.0), art.log(0.3, 2.0)
    depth = np.full(art.drop.shape, -1.0)
    for start in np.arange(s - wide, s + wide, art.uniform(0.06, 0.25)):
        length = longest * art.uniform(0.2, 1.0) * max(1.0 - ((start - s) / wide) ** 2, 0.1)
        depth = np.maximum(depth, trail(art, float(start), a, length, art.log(0.03, 0.12)))
    water(art, depth)


def inside(art: Painting, s: float, a: float, area: float, elongation: float) -> Array:
    """Depth of a patch of irregular outline."""
    shape = blob(art, s, a, area, elongation)
    mask = shapely.contains_xy(shape, *np.broadcast_arrays(art.x, art.y))
    return (ndimage.distance_transform_edt(mask) - ndimage.distance_transform_edt(~mask)) * PIXEL


def damp(art: Painting, joints: Joints, s: float, a: float) -> None:
    """Faint damp of irregular outline."""
    water(art, inside(art, s, a, art.log(0.1, 4.0), art.uniform(0.5, 2.0)), (1.0, 3.0), (0.03, 0.3))


def patch(art: Painting, joints: Joints, s: float, a: float) -> None:
    """A wet patch, perhaps with trails; perhaps with lime at its rim."""
    depth = inside(art, s, a, art.log(0.06, 3.0), art.uniform(0.5, 2.5))
    dark = depth > 0
    for _ in range(art.rng.integers(0, 4)):
        start = s + art.uniform(-0.3, 0.3)
        depth = np.maximum(depth, trail(art, start, a, art.log(0.2, 1.5), art.log(0.02, 0.12)))
    water(art, depth)
    if art.rng.random() < 0.2:
        rim = ndimage.binary_dilation(dark, iterations=int(art.uniform(2, 8))) & ~ndimage.binary_erosion(dark, iterations=3)
        art.drop[rim & (art.drop < 0.2)] -= art.uniform(1.0, 4.0)


def crossed(art: Painting, joints: Joints, s: float, a: float) -> None:
    """A patch behind a cable."""
    patch(art, joints, s, a)
    at, half = a + art.uniform(-0.4, 0.4), art.uniform(0.02, 0.08)
    art.state[(np.abs(art.y - at) < half) & (np.abs(art.x - s) < 1.45)] = PixelState.OFF


def tongue(art: Painting, joints: Joints, s: float, a: float) -> None:
    """Water that rises or ponds at the foot of a wall, along some metres."""
    side = down_of(a)
    edge = float(np.abs(art.y[(art.state[:, 0] != PixelState.FLOOR)]).max())
    up = edge - side * art.y
    height = art.log(0.1, 1.2) * np.exp(-(np.abs((art.x - s) / art.log(0.15, 1.5)) ** art.uniform(1.5, 6.0)))
    height = height * np.clip(1 + art.uniform(0.05, 0.4) * wander(art.rng, len(art.x), art.uniform(3, 20)), 0.1, 3.0)
    water(art, np.where(up > 0, np.minimum(height - up, 0.3), -1.0) - 0.01)


def soot(art: Painting, joints: Joints, s: float, a: float) -> None:
    """Soot: soft, long, in the crown or above a fitting."""
    middle = art.uniform(-1.8, 1.8) if art.rng.random() < 0.7 else a
    along, around, power = art.log(0.6, 8.0), art.log(0.3, 1.5), art.uniform(2.0, 4.0)
    ragged = ndimage.gaussian_filter(art.rng.normal(0, 1, art.drop.shape), art.uniform(15, 50))
    far = np.hypot((art.x - s) / along, (art.y - middle) / around) * (1 + art.uniform(0, 0.25) * ragged / ragged.std())
    art.paint(np.exp(-(np.abs(far) ** power)), art.log(0.6, 4.5))


def dry_joint(art: Painting, joints: Joints, s: float, a: float) -> None:
    """A joint that is dark all around, or along, the picture, or a part of it; straight and of one width."""
    half = art.log(0.015, 0.06)
    if art.rng.random() < 0.6 and len(joints.around):
        at = float(joints.around[np.abs(joints.around - s).argmin()])
        low, high = (-HALF, HALF) if art.rng.random() < 0.6 else sorted((a, a + art.uniform(-4, 4)))
        shape = box(at - half, low, at + half, high)
    else:
        at = float(joints.along[np.abs(joints.along - a).argmin()])
        low, high = (0.0, LONG) if art.rng.random() < 0.6 else sorted((s, s + art.uniform(-5, 5)))
        shape = box(low, at - half, high, at + half)
    art.paint(art.cover(shape) * (0.8 + 0.2 * uneven(art)), art.log(0.8, 7.0))


def stain(art: Painting, joints: Joints, s: float, a: float) -> None:
    """A dry patch that is hardly darker or brighter than its surroundings."""
    shape = blob(art, s, a, art.log(0.1, 4.0), art.uniform(0.5, 2.0))
    art.drop = art.drop + art.cover(shape, art.log(0.01, 0.1)) * uneven(art) * art.uniform(-2.0, 0.6)


def lime(art: Painting, joints: Joints, s: float, a: float) -> None:
    """Lime that water has left: bright, and now dry."""
    depth = trail(art, s, a, art.log(0.2, 2.0), art.log(0.02, 0.15))
    amount = np.clip(depth / art.log(0.01, 0.08) + 0.5, 0, 1)
    art.drop = art.drop - amount * uneven(art) * art.log(0.6, 5.0)


def crack(art: Painting, joints: Joints, s: float, a: float) -> None:
    """A dry crack: a thin dark line."""
    count = max(int(art.log(0.4, 4.0) / STEP), 3)
    turn = art.uniform(0, np.pi) + 0.25 * np.cumsum(art.rng.normal(0, 1, count)) * np.sqrt(STEP)
    path = np.column_stack([s + np.cumsum(np.cos(turn)) * STEP, a + np.cumsum(np.sin(turn)) * STEP])
    depth = depth_of(art, path, np.full(count, art.log(0.008, 0.02)))
    art.paint(np.clip(depth / 0.01 + 0.5, 0, 1), art.log(0.8, 5.0))


def bars(art: Painting, joints: Joints, s: float, a: float) -> None:
    """Straight stripes side by side, down the wall: rubbed dirt, formwork, paint."""
    half, apart, length = art.log(0.02, 0.1), art.log(0.1, 0.5), art.log(0.3, 2.5)
    drop = art.log(0.6, 4.0)
    for k in range(int(art.rng.integers(1, 6))):
        x = s + k * max(apart, 3 * half)
        ends = sorted((a, a + down_of(a) * length * art.uniform(0.9, 1.1)))
        art.paint(art.cover(box(x - half, ends[0], x + half, ends[1]), art.log(0.005, 0.03)) * uneven(art), drop)


def writing(art: Painting, joints: Joints, s: float, a: float) -> None:
    """A number plate, paint, or writing: small bars."""
    for k in range(int(art.rng.integers(1, 6))):
        x, y = s + 0.12 * k, a + art.uniform(-0.02, 0.02)
        shape = box(x, y, x + art.log(0.02, 0.1), y + art.log(0.05, 0.25))
        art.paint(art.cover(shape), art.log(0.8, 6.0))


def _plain(make: Callable[[Painting, float, float], None]) -> Callable[[Painting, Joints, float, float], None]:
    return lambda art, joints, s, a: make(art, s, a)


WATER = (
    (joint_leak, 3.0), (edge_leak, 1.5), (crack_leak, 2.0), (hole_leak, 2.5), (fingers, 1.0), (damp, 2.0), (patch, 3.0),
    (crossed, 1.0), (tongue, 1.5),
)  # fmt: skip
DRY = (
    (soot, 4.0), (dry_joint, 3.0), (stain, 2.0), (lime, 1.0), (crack, 1.0), (writing, 1.0), (bars, 1.5),
    (_plain(painted.repair), 6.0),
    (_plain(painted.shade), 1.0), (_plain(painted.halo), 1.0), (_plain(painted.stripe), 1.5), (_plain(painted.grime), 1.5),
    (_plain(painted.shadow), 1.0), (_plain(painted.between), 1.0), (_plain(painted.pocket), 1.5),
)  # fmt: skip
"""Makers of wet and of dry shapes, with their relative frequencies."""
