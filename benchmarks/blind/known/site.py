"""A tunnel under construction for a scene: its lining, what is wet, what is stained, what hangs before it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from shapely import box, distance
from shapely.geometry.base import BaseGeometry

from benchmarks.blind.known import shapes
from benchmarks.blind.known.axis import Axis
from benchmarks.blind.known.equipment import Item
from benchmarks.blind.known.section import Array, Section
from benchmarks.blind.known.surface import Surface, rim_profile, signed_distance

Maker = Callable[[np.random.Generator, float], BaseGeometry]


def _patch(rng: np.random.Generator, area: float) -> BaseGeometry:
    return shapes.blob(rng, area, float(rng.uniform(0.6, 2.2)))


MAKERS: dict[str, Maker] = {
    "patch": _patch,
    "drip": shapes.dripping,
    "interrupted drip": shapes.interrupted,
    "curtain": shapes.curtain,
    "wet crack": shapes.crack,
    "bolt pocket": shapes.pocket,
}
RIMS = {
    "patch": (0.05, 0.24),
    "drip": (0.04, 0.08),
    "interrupted drip": (0.04, 0.07),
    "curtain": (0.03, 0.09),
    "wet crack": (0.03, 0.06),
    "bolt pocket": (0.03, 0.05),
}
HANGING = {"drip", "interrupted drip", "curtain", "bolt pocket"}


@dataclass
class Leak:
    """Lining that is wet; ``drop`` is the mean inside the outline, ``gradient`` the share lost towards the bottom."""

    outline: BaseGeometry
    drop: float
    rim: float
    phenomenon: str
    gradient: float = 0.0


@dataclass(frozen=True)
class Mark:
    """Lining that is dark (negative gain) or bright and dry."""

    outline: BaseGeometry
    kind: str
    gain: float
    rim: float


@dataclass
class Site:
    """Everything a scanner meets, in coordinates of the tunnel."""

    section: Section
    axis: Axis
    length: float
    surface: Surface
    rng: np.random.Generator
    items: list[Item] = field(default_factory=list)
    leaks: list[Leak] = field(default_factory=list)
    marks: list[Mark] = field(default_factory=list)
    taken: list[BaseGeometry] = field(default_factory=list)

    def down(self, s: float) -> float:
        """Direction of s that leads down."""
        return -1.0 if s < self.section.crown else 1.0

    def add_leak(self, leak: Leak) -> None:
        """Paint a leak and note it."""
        where = self.surface.window(leak.outline, leak.rim)
        u, s = self.surface.u[where[0]], self.surface.s[where[1]]
        signed, inside = signed_distance(leak.outline, u, s)
        low, high = leak.outline.bounds[1], leak.outline.bounds[3]
        fall = np.clip((s - low) / (high - low), 0.0, 1.0)
        if self.down(0.5 * (low + high)) < 0:
            fall = 1.0 - fall
        strength = (1.0 - leak.gradient * fall)[None, :] * (1.0 + self._mottle(u, s))
        wet = rim_profile(signed, leak.rim) * strength
        wet *= leak.drop / float(wet[inside].mean())
        np.maximum(self.surface.wet[where], wet, out=self.surface.wet[where], casting="same_kind")
        self.leaks.append(leak)
        self.taken.append(leak.outline)

    def _mottle(self, u: Array, s: Array) -> Array:
        """Unevenness of wetness, 5 %."""
        along = shapes.wave(self.rng, u, 1.5, 0.15, 0.04)
        across = shapes.wave(self.rng, s, 1.5, 0.15, 0.04)
        value: Array = along[:, None] + across[None, :]
        return value

    def add_mark(self, mark: Mark, take: bool = False) -> None:
        """Paint a stain and note it; with ``take``, nothing else is placed there."""
        where = self.surface.window(mark.outline, mark.rim)
        signed, _ = signed_distance(mark.outline, self.surface.u[where[0]], self.surface.s[where[1]])
        self.surface.dry[where] += (mark.gain * rim_profile(signed, mark.rim)).astype(np.float32)
        self.marks.append(mark)
        if take:
            self.taken.append(mark.outline)

    def free(self, outline: BaseGeometry, gap: float) -> bool:
        """Whether an outline lies on the lining, off the ends and off what is taken."""
        room = box(0.8, 0.02, self.length - 0.8, self.section.lining - 0.02)
        if not room.contains(outline):
            return False
        return not self.taken or bool(np.min(distance(np.array(self.taken), outline)) >= gap)

    def place(
        self, make: Callable[[], BaseGeometry], s_range: tuple[float, float], gap: float = 0.35, steep: bool = False
    ) -> BaseGeometry:
        """Find a place for a local shape along the tunnel, its origin in a range of s; ``steep`` excludes flat roofs."""
        for _ in range(600):
            u = float(self.rng.uniform(0.8, self.length - 0.8))
            s = float(self.rng.uniform(*s_range))
            if steep and abs(float(self.section.tangent(np.array([s]))[1][0])) < 0.35:
                continue
            outline = shapes.on_wall(make(), u, s, self.down(s))
            if self.free(outline, gap):
                return outline
        raise RuntimeError("no room for the shape")

    def scatter_leaks(
        self,
        kinds: Sequence[str],
        areas: tuple[float, float],
        drops: tuple[float, float],
        s_range: tuple[float, float] | None = None,
        gap: float = 0.35,
    ) -> None:
        """Place one leak of each of the kinds, their areas spread evenly on a logarithmic scale, the largest first."""
        count = len(kinds)
        sizes = np.geomspace(areas[1], areas[0], count) * self.rng.uniform(0.92, 1.08, count)
        strengths = self.rng.permutation(np.linspace(drops[0], drops[1], count))
        for kind, area, drop in zip(kinds, sizes, strengths, strict=True):
            rim = float(min(self.rng.uniform(*RIMS[kind]), 0.6 * np.sqrt(area / np.pi)))
            outline = self.place(
                partial(MAKERS[kind], self.rng, float(area)),
                s_range or (0.3, self.section.lining - 0.3),
                gap,
                kind in HANGING,
            )
            self.add_leak(Leak(outline, float(drop), rim, kind, float(self.rng.uniform(0.0, 0.3))))
