"""The unrolled lining as pictures: its reflectance when dry, how much water darkens it, and its bumps."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy import ndimage

from . import noise
from .geometry import Profile


@dataclass(frozen=True)
class Window:
    """A rectangle of the canvas: its rows, its columns, and the places of its pixels."""

    rows: slice
    columns: slice
    s: np.ndarray
    u: np.ndarray

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.u.shape[0], self.s.shape[1]

    @property
    def at(self) -> tuple[slice, slice]:
        """What to index a picture with."""
        return self.rows, self.columns


@dataclass
class Leak:
    """What was painted in one go; ``number`` is its label on the canvas."""

    number: int
    phenomenon: str
    limit: str | None = None


@dataclass
class Dry:
    """Something dark or bright that is no leak: where, and what."""

    kind: str
    window: Window
    mask: np.ndarray


@dataclass
class Canvas:
    """Pictures of the whole perimeter, ``u`` down the rows and ``s`` along the columns.

    ``base`` is the reflectance of the dry surface and ``wet`` what water takes of it (dB), ``bump`` stands out of the nominal
    section, inwards (metres), ``label`` is the number of the leak.
    """

    profile: Profile
    length: float
    pixel: float
    rng: np.random.Generator
    margin: float = 0.3
    leaks: list[Leak] = field(default_factory=list)
    others: list[Dry] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.shape = (
            int(np.ceil((self.profile.high - self.profile.low) / self.pixel)) + 1,
            int(np.ceil((self.length + 2 * self.margin) / self.pixel)) + 1,
        )
        self.base = np.zeros(self.shape, dtype=np.float32)
        self.wet = np.zeros(self.shape, dtype=np.float32)
        self.bump = np.zeros(self.shape, dtype=np.float32)
        self.label = np.zeros(self.shape, dtype=np.uint8)

    def window(self, s1: float, s2: float, u1: float, u2: float) -> Window:
        """The pixels between two chainages and two places of the section."""
        u1, u2, s1, s2 = min(u1, u2), max(u1, u2), min(s1, s2), max(s1, s2)
        r1, r2 = ((np.array([u1, u2]) - self.profile.low) / self.pixel).round().astype(int)
        c1, c2 = ((np.array([s1, s2]) + self.margin) / self.pixel).round().astype(int)
        r1, r2 = np.clip([r1, r2 + 1], 0, self.shape[0])
        c1, c2 = np.clip([c1, c2 + 1], 0, self.shape[1])
        u = self.profile.low + np.arange(r1, r2)[:, None] * self.pixel
        s = np.arange(c1, c2)[None, :] * self.pixel - self.margin
        return Window(slice(r1, r2), slice(c1, c2), s, u)

    def whole(self) -> Window:
        """Everything."""
        return self.window(-self.margin, self.length + 2 * self.margin, self.profile.low, self.profile.high + 1)

    def lining(self) -> Window:
        """Everything above the floor."""
        return self.window(-self.margin, self.length + self.margin, self.profile.foot_left, self.profile.foot_right)

    def floors(self) -> list[Window]:
        """The two halves of the floor."""
        a, b = -self.margin, self.length + self.margin
        p = self.profile
        return [self.window(a, b, p.low, p.foot_left - 0.01), self.window(a, b, p.foot_right + 0.01, p.high)]

    def fractal(self, window: Window, longest: float, shortest: float, fade: float = 0.6, stretch: float = 1.0) -> np.ndarray:
        """A random field over a window."""
        return noise.fractal(window.shape, self.pixel, longest, max(shortest, 1.5 * self.pixel), self.rng, fade, stretch)

    def sample(self, picture: np.ndarray, s: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Values of a picture at places between its pixels."""
        rows = (np.asarray(u) - self.profile.low) / self.pixel
        columns = (np.asarray(s) + self.margin) / self.pixel
        return ndimage.map_coordinates(picture, [rows, columns], order=1, mode="nearest")

    def note(self, kind: str, window: Window, mask: np.ndarray, least: float = 0.05) -> None:
        """Remember something that is no leak, unless it is tiny."""
        if mask.sum() * self.pixel**2 >= least:
            self.others.append(Dry(kind, window, mask))


def ellipse(window: Window, s: float, u: float, half_s: float, half_u: float, turn: float = 0.0) -> np.ndarray:
    """How far pixels lie inside an ellipse (metres, negative outside)."""
    x, y = window.s - s, window.u - u
    x, y = x * np.cos(turn) + y * np.sin(turn), -x * np.sin(turn) + y * np.cos(turn)
    return (1 - np.sqrt((x / half_s) ** 2 + (y / half_u) ** 2)) * min(half_s, half_u)


def rectangle(window: Window, s1: float, s2: float, u1: float, u2: float) -> np.ndarray:
    """How far pixels lie inside a rectangle."""
    u1, u2 = min(u1, u2), max(u1, u2)
    return np.minimum(np.minimum(window.s - s1, s2 - window.s), np.minimum(window.u - u1, u2 - window.u))


def stroke(window: Window, points: np.ndarray, half: np.ndarray | float) -> np.ndarray:
    """How far pixels lie inside a stroke through ``points`` (s, u) whose half width is given at each of them."""
    points = np.asarray(points, dtype=float)
    half = np.broadcast_to(np.asarray(half, dtype=float), (len(points),))
    inside = np.full(window.shape, -10.0, dtype=np.float32)
    for (s1, u1), (s2, u2), w1, w2 in zip(points[:-1], points[1:], half[:-1], half[1:], strict=True):
        length2 = max((s2 - s1) ** 2 + (u2 - u1) ** 2, 1e-9)
        part = np.clip(((window.s - s1) * (s2 - s1) + (window.u - u1) * (u2 - u1)) / length2, 0, 1)
        away = np.hypot(window.s - s1 - part * (s2 - s1), window.u - u1 - part * (u2 - u1))
        np.maximum(inside, w1 + part * (w2 - w1) - away, out=inside)
    return inside


def cover(inside: np.ndarray, edge: np.ndarray | float) -> np.ndarray:
    """From 0 outside to 1 inside over an edge of given width, a half on the outline."""
    x = np.clip(0.5 + inside / edge, 0, 1)
    return x * x * (3 - 2 * x)
