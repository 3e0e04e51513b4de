"""The unrolled lining: maps of reflectance, relief and moisture, and the outlines that are stamped into them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy import ndimage
from shapely.geometry.base import BaseGeometry

from .geometry import Array

H = 0.01


def noise(shape: tuple[int, int], rng: np.random.Generator, scale: float, octaves: int = 1, stretch: float = 1.0) -> Array:
    """Smooth noise of deviation 1 on cells of H; `scale` is its length along l, `stretch` times as long along s."""
    total = np.zeros(shape)
    for k in range(octaves):
        step = [max(scale * stretch / 2**k / H, 1.0), max(scale / 2**k / H, 1.0)]
        coarse = rng.standard_normal([int(n / d) + 5 for n, d in zip(shape, step, strict=True)])
        for axis in (0, 1):
            at = 1.5 + np.arange(shape[axis]) / step[axis]
            i = at.astype(int)
            f = at - i
            w = [(1 - f) ** 3 / 6, (3 * f**3 - 6 * f**2 + 4) / 6, (-3 * f**3 + 3 * f**2 + 3 * f + 1) / 6, f**3 / 6]
            form = (-1, 1) if axis == 0 else (1, -1)
            coarse = sum(np.take(coarse, i - 1 + m, axis=axis) * w[m].reshape(form) for m in range(4))
        total += coarse / max(coarse.std(), 1e-9) * 0.6**k
    return total / max(float(total.std()), 1e-9)


@dataclass(frozen=True)
class Stain:
    """Something on the lining with an outline in (s, l).

    Attributes
    ----------
    kind : str
        What it is.
    db : float
        How much darker (wet: always positive) or, if negative, brighter it is.
    shape : shapely geometry
        Outline before it is made ragged.
    rim : float
        Width over which it fades, about the outline.
    ragged : float
        By how much the outline strays (standard deviation).
    fade : float
        Share of its strength that is lost from its top to its bottom (negative: gained).
    mottle : float
        Relative unevenness inside.
    film : float
        Running water: strength of its gloss.
    limit : str, optional
        Why an inspector could not tell it.
    """

    kind: str
    db: float
    shape: BaseGeometry
    rim: float = 0.05
    ragged: float = 0.04
    fade: float = 0.0
    mottle: float = 0.15
    film: float = 0.0
    limit: str | None = None


@dataclass
class Mark:
    """A stain as it came out: its mask in a window of the sheet that begins at cell (i, j)."""

    stain: Stain
    i: int
    j: int
    mask: NDArray[np.bool_]


@dataclass
class Sheet:
    """Maps over s (rows) and l (columns) in cells of H.

    Reflectance and moisture in dB, relief in m (outwards), gloss, and how thirsty the lining is (1: as most of it).
    """

    s0: float
    s1: float
    end: float
    light: Array = field(init=False)
    relief: Array = field(init=False)
    drop: Array = field(init=False)
    film: Array = field(init=False)
    thirst: Array = field(init=False)
    wet: list[Mark] = field(default_factory=list)
    dry: list[Mark] = field(default_factory=list)

    def __post_init__(self) -> None:
        n = (round((self.s1 - self.s0) / H), int(2 * self.end / H))
        self.light, self.relief, self.drop, self.film = (np.zeros(n, np.float32) for _ in range(4))
        self.thirst = np.ones(n, np.float32)

    @property
    def shape(self) -> tuple[int, int]:
        """Number of cells."""
        return self.light.shape[0], self.light.shape[1]

    @property
    def s(self) -> Array:
        """Chainage of the cells, a column."""
        return (self.s0 + (np.arange(self.shape[0]) + 0.5) * H)[:, None]

    @property
    def l(self) -> Array:  # noqa: E743
        """Coordinate along the section of the cells, a row."""
        return (-self.end + (np.arange(self.shape[1]) + 0.5) * H)[None, :]

    def sample(self, what: Array, s: Array, l: Array) -> Array:  # noqa: E741
        """Read a map at points."""
        at = [(s - self.s0) / H - 0.5, (l + self.end) / H - 0.5]
        return ndimage.map_coordinates(what, at, order=1, mode="nearest")

    def stamp(self, stain: Stain, rng: np.random.Generator, *, wet: bool) -> None:
        """Put a stain on: half of its strength is reached on the outline that is kept."""
        pad = 3 * stain.rim + 3 * stain.ragged + 0.05
        a, b, c, d = stain.shape.bounds
        i0, i1 = (int(np.clip((x - self.s0) / H, 0, self.shape[0])) for x in (a - pad, c + pad))
        j0, j1 = (int(np.clip((x + self.end) / H, 0, self.shape[1])) for x in (b - pad, d + pad))
        s, l = np.meshgrid(self.s[i0:i1, 0], self.l[0, j0:j1], indexing="ij")  # noqa: E741
        shapely.prepare(stain.shape)
        depth = _depth(shapely.contains_xy(stain.shape, s, l))
        if stain.ragged:
            least = -0.8 * np.maximum(ndimage.maximum_filter(depth, 25), 0.02)
            depth = depth + np.maximum(stain.ragged * noise(depth.shape, rng, 0.32, 4), least)
        parts, _ = ndimage.label(depth > 0)
        sizes = np.bincount(parts.ravel())
        sizes[0] = 0
        mask = parts == sizes.argmax() if wet else (sizes > 0.02 / H**2)[parts]
        holes, _ = ndimage.label(~mask)
        mask |= (np.bincount(holes.ravel()) < 0.03 / H**2)[holes] & ~mask
        depth = _depth(mask)
        down = np.abs(l)
        down = (down - down.min()) / max(float(np.ptp(down)), 0.1)
        inside = (1 - stain.fade * down) * (1 + stain.mottle * noise(depth.shape, rng, 0.22, 3))
        inside *= 0.85 + 0.15 * np.tanh(depth / 0.12)
        part = 0.5 * (1 + np.tanh(2 * depth / max(stain.rim, 0.01)))
        window = (slice(i0, i1), slice(j0, j1))
        if wet:
            inside *= self.thirst[window]
            self.drop[window] = np.maximum(self.drop[window], stain.db * np.clip(inside, 0.3, 1.6) * part)
            self.film[window] = np.maximum(self.film[window], stain.film * part)
            self.wet.append(Mark(stain, i0, j0, mask))
        else:
            self.light[window] -= stain.db * np.clip(inside, 0.3, 1.6) * part
            self.dry.append(Mark(stain, i0, j0, mask))

    def mean_drop(self, mark: Mark) -> float:
        """By how much a mark's mean lies below dry lining 0.1 to 0.5 m about it."""
        far = 50
        i, j = max(mark.i - far, 0), max(mark.j - far, 0)
        n, m = mark.mask.shape
        window = (slice(i, mark.i + n + far), slice(j, mark.j + m + far))
        total, drop = (self.light - self.drop)[window], self.drop[window]
        inside = np.zeros(total.shape, bool)
        inside[mark.i - i : mark.i - i + n, mark.j - j : mark.j - j + m] = mark.mask
        away = ndimage.distance_transform_edt(~inside) * H
        ring = (away > 0.1) & (away < 0.5) & (drop < 0.2)
        return float(total[ring].mean() - total[inside].mean())


def _depth(mask: NDArray[np.bool_]) -> Array:
    """Distance from the outline, positive inside."""
    if mask.all():
        return np.ones(mask.shape)
    return H * (ndimage.distance_transform_edt(mask) - ndimage.distance_transform_edt(~mask) + np.where(mask, -0.5, 0.5))


def outline(mark: Mark, sheet: Sheet, mask: NDArray[np.bool_]) -> BaseGeometry:
    """Polygon in (s, l) of a mask in the window of a mark."""
    s0, l0 = sheet.s0 + mark.i * H, -sheet.end + mark.j * H
    edge = np.diff(np.pad(mask, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    (i, a), (_, b) = np.nonzero(edge == 1), np.nonzero(edge == -1)
    rows = shapely.box(s0 + i * H, l0 + a * H, s0 + (i + 1) * H, l0 + b * H)
    shape = shapely.union_all(rows).buffer(0.012).buffer(-0.024).buffer(0.012).simplify(0.003)
    parts = [p for p in shapely.get_parts(shape) if p.area > 0.004]
    return shapely.union_all(parts)


def blob(s: float, l: float, a: float, b: float) -> BaseGeometry:  # noqa: E741
    """Ellipse with half axes a along s and b along l."""
    w = np.linspace(0, 2 * np.pi, 60)[:-1]
    return shapely.Polygon(np.stack([s + a * np.cos(w), l + b * np.sin(w)], axis=1))


def runs(s: float, top: float, length: float, w0: float, w1: float, lean: float = 0.0) -> BaseGeometry:
    """Where water runs down from `top` towards the foot, ending in fingers: widths at its head and its end."""
    k = np.linspace(0, 1, 40)
    side = np.sign(top) or 1.0
    l = top + side * length * k  # noqa: E741
    mid = s + lean * k + 0.05 * np.sin(7 * k + 3 * s) * min(length, 1.5)
    half = (w0 + (w1 - w0) * k) * (1 + 0.25 * np.sin(11 * k + s)) / 2
    body = shapely.Polygon(np.concatenate([np.stack([mid - half, l], 1), np.stack([mid + half, l], 1)[::-1]])).buffer(0)
    if abs(length) < 1.5:
        return body
    fingers = [body]
    for m, place in enumerate((-0.36, 0.05, 0.38)):
        end = 1.04 + 0.09 * ((3 * m + int(10 * s)) % 4)
        at = np.linspace(0.4 + 0.1 * m, end, 30)
        course = np.interp(at, k, mid) + place * w1 + 0.03 * np.sin(9 * at + m + s)
        fingers.append(shapely.LineString(np.stack([course, top + side * length * at], 1)).buffer(0.045 + 0.012 * m))
    return shapely.union_all(fingers)


def rect(s0: float, s1: float, l0: float, l1: float) -> BaseGeometry:
    """Rectangle."""
    return shapely.box(s0, min(l0, l1), s1, max(l0, l1))


def line(points: list[tuple[float, float]], width: float) -> BaseGeometry:
    """Band along a line: a crack, a joint."""
    return shapely.LineString(points).buffer(width / 2, cap_style="flat")


def foot(s0: float, s1: float, l: float, height: float) -> BaseGeometry:  # noqa: E741
    """What rises from the foot at l: its upper edge goes up and down."""
    s = np.linspace(s0, s1, 80)
    rise = (
        height
        * (0.75 + 0.25 * np.sin(2.3 * s) + 0.15 * np.sin(5.9 * s + 1))
        * np.clip(4 * np.sin(np.pi * (s - s0) / (s1 - s0)), 0.25, 1)
    )
    top = l - np.sign(l) * rise
    return shapely.Polygon([*zip(s, top, strict=True), (s1, l), (s0, l)]).buffer(0)


def joined(*shapes: BaseGeometry) -> BaseGeometry:
    """What water joins."""
    return shapely.union_all(list(shapes)).buffer(0.02)
