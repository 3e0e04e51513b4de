"""What linings are built of: precast segments, cast bays, brick courses, sprayed concrete."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .canvas import Canvas, ramp
from .frames import Array
from .shapes import Crack, Disc, Slab

Index = NDArray[np.int64]


class Lining(Protocol):
    """What is too fine for the layers, at points."""

    def relief(self, u: Array, v: Array) -> Array:
        """Depth outside the smooth lining, m."""

    def shade(self, u: Array, v: Array) -> Array:
        """What reflectance differs by from the lining's mean, dB."""


@dataclass
class Segments:
    """Rings of precast segments with chamfered joints, alternately turned.

    Attributes
    ----------
    radius, width : float
        Inner radius and width of a ring, m.
    first : float
        Chainage of the first ring joint.
    rings : int
        Number of rings.
    bounds : tuple of float
        Angles of the longitudinal joints about the key's middle, degrees, the first two the key's.
    turns : tuple of float
        Angles of the key in successive rings, degrees from the crown.
    rng : numpy.random.Generator
        For what differs from segment to segment.
    lips : float
        Deviation of the steps between neighbours, m.
    gap : float
        Half width of the open joint, m.
    contrast : float
        Deviation of the segments' reflectance, dB.
    """

    radius: float
    width: float
    first: float
    rings: int
    bounds: tuple[float, ...]
    turns: tuple[float, ...]
    rng: np.random.Generator
    lips: float = 0.002
    gap: float = 0.004
    contrast: float = 0.4
    taper: float = 0.12
    joints: Array = field(init=False)
    steps: Array = field(init=False)
    shades: Array = field(init=False)

    def __post_init__(self) -> None:
        turn = np.array([self.turns[k % len(self.turns)] for k in range(self.rings)])
        angle = np.radians(np.array(self.bounds)[None, :] + turn[:, None])
        self.joints = angle * self.radius
        shape = (self.rings, len(self.bounds))
        self.steps = self.rng.normal(0.0, self.lips, shape)
        self.shades = self.rng.normal(0.0, self.contrast, shape)

    def ring(self, k: int) -> float:
        """Chainage of the joint at which ring ``k`` begins."""
        return self.first + k * self.width

    def joint(self, k: int, j: int) -> float:
        """Girth of a longitudinal joint in the middle of a ring, between the floor's middle on either side."""
        whole = 2 * np.pi * self.radius
        return float((self.joints[k, j] + whole / 2) % whole - whole / 2)

    def _place(self, u: Array, v: Array) -> tuple[Index, Index, Array, Array]:
        """Ring, segment, and distances from the ring joint and from the longitudinal joint."""
        part = (u - self.first) / self.width
        ring = np.clip(np.floor(part), 0, self.rings - 1).astype(np.int64)
        inside = (part - ring) * self.width
        whole = 2 * np.pi * self.radius
        nearest = np.full(u.shape, np.inf)
        since = np.full(u.shape, np.inf)
        segment = np.zeros(u.shape, np.int64)
        for j in range(len(self.bounds)):
            slope = self.taper * (1.0 if j == 0 else -1.0 if j == 1 else 0.0)
            away = (v - self.joints[ring, j] - slope * (inside - self.width / 2)) % whole
            segment[away < since] = j
            since = np.minimum(since, away)
            nearest = np.minimum(nearest, np.minimum(away, whole - away))
        return ring, segment, np.minimum(inside, self.width - inside), nearest

    def relief(self, u: Array, v: Array) -> Array:
        ring, segment, axial, girth = self._place(u, v)
        away = np.minimum(np.abs(axial), girth)
        chamfer = 0.012 * np.clip(1 - away / 0.014, 0.0, 1.0)
        return self.steps[ring, segment] + chamfer + 0.02 * (away < self.gap)

    def shade(self, u: Array, v: Array) -> Array:
        ring, segment, axial, girth = self._place(u, v)
        away = np.minimum(np.abs(axial), girth)
        joint = -5.0 * ramp((self.gap - away) / 0.005) - 0.5 * ramp((0.015 - away) / 0.006)
        return self.shades[ring, segment] + joint

    def pockets(self, canvas: Canvas, size: tuple[float, float], depth: float, per_ring: int, both: bool) -> None:
        """Carve the pockets of the bolts along ring joints (on one side, or both) and longitudinal joints."""
        spacing = 2 * np.pi * self.radius / per_ring
        foot = canvas.tunnel.section.foot - 0.15
        for k in range(self.rings - 1):
            places = []
            for n in range(per_ring):
                girth = ((n + 0.5) * spacing + self.joints[k, 0]) % (per_ring * spacing) - per_ring * spacing / 2
                places += [(self.width - 0.17, girth)] + ([(0.17, girth)] if both else [])
            for j in range(len(self.bounds)):
                places += [(x * self.width, self.joint(k, j) + side) for x in (0.28, 0.72) for side in (-0.2, 0.2)]
            for x, girth in places:
                if abs(girth) < foot:
                    pocket = Slab(self.ring(k) + x, girth, *size)
                    canvas.carve(pocket, depth, 0.035)
                    canvas.stain(pocket, float(canvas.rng.normal(-0.6, 0.4)), "", rim=0.06)

    def plugs(self, canvas: Canvas, radius: float, shade: float) -> None:
        """Grouting holes with their plugs, in the middle of each segment."""
        order = np.sort(self.joints, axis=1)
        middles = (order + np.roll(order, -1, axis=1)) / 2
        for k in range(self.rings - 1):
            for girth in middles[k, :-1]:
                if abs(girth) < canvas.tunnel.section.foot - 0.1:
                    plug = Disc(self.ring(k) + self.width / 2, float(girth), radius)
                    canvas.carve(plug, 0.012, 0.01)
                    canvas.stain(plug, shade + float(canvas.rng.normal(0, 0.5)), "", rim=0.015)


@dataclass
class Bays:
    """Cast concrete: bays between block joints, panels of formwork inside them.

    Attributes
    ----------
    bay, first : float
        Length of a bay and chainage of the first block joint, m.
    panel : tuple of float
        Size of the formwork's panels along the tunnel and along the girth, m.
    contrast : float
        Deviation of the panels' reflectance, dB.
    """

    bay: float
    first: float
    panel: tuple[float, float]
    rng: np.random.Generator
    contrast: float = 0.3
    groove: float = 0.012
    shades: Array = field(init=False)

    def __post_init__(self) -> None:
        panels = self.rng.normal(0.0, self.contrast, (64, 64))
        self.shades = panels + self.rng.normal(0.0, self.contrast, (64, 1))

    def _places(self, u: Array, v: Array) -> tuple[Array, Array, Array]:
        """Distances from the block joint and from the panels' edge, and the panel's shade."""
        block = np.abs((u - self.first + self.bay / 2) % self.bay - self.bay / 2)
        x, y = (u - self.first) / self.panel[0], (v + 20.0) / self.panel[1]
        shade = self.shades[np.floor(x).astype(np.int64) % 64, np.floor(y).astype(np.int64) % 64]
        edge = np.minimum(np.abs(x - np.round(x)) * self.panel[0], np.abs(y - np.round(y)) * self.panel[1])
        return block, edge, shade

    def relief(self, u: Array, v: Array) -> Array:
        block, edge, _ = self._places(u, v)
        return 0.018 * np.clip(1 - block / self.groove, 0.0, 1.0) - 0.0015 * (edge < 0.004)

    def shade(self, u: Array, v: Array) -> Array:
        block, edge, shade = self._places(u, v)
        return shade - 3.0 * ramp((0.006 - block) / 0.008) - 0.7 * ramp((0.004 - edge) / 0.006)

    def ties(self, canvas: Canvas, radius: float, shade: float) -> None:
        """Tie holes, closed by mortar, on a grid of the panels' size."""
        foot = canvas.tunnel.section.foot
        for u in np.arange(self.first % self.panel[0] + 0.4, canvas.u[-1] - 0.2, self.panel[0] / 2):
            for v in np.arange(-foot + 0.5, foot - 0.3, self.panel[1]):
                hole = Disc(float(u), float(v), radius)
                canvas.stain(hole, shade + float(canvas.rng.normal(0, 0.6)), "", rim=0.012, lift=0.004)

    def cracks(self, canvas: Canvas, count: int, shade: float) -> None:
        """Dry shrinkage cracks, which run across a bay."""
        foot = canvas.tunnel.section.foot
        for _ in range(count):
            u = float(canvas.rng.uniform(1.0, canvas.u[-1] - 1.0))
            v = float(canvas.rng.uniform(-0.8, 0.5)) * foot
            length = float(canvas.rng.uniform(0.6, 2.4))
            end = (u + float(canvas.rng.normal(0, 0.2)), v + length)
            canvas.stain(Crack((u, v), end, 0.008, 0.05), shade, "", rim=0.008)


@dataclass
class Bricks:
    """Courses of bricks in stretcher bond, each with a reflectance and a depth of its own."""

    length: float
    course: float
    joint: float
    rng: np.random.Generator
    contrast: float = 0.8
    mortar: float = 0.8
    recess: float = 0.006
    shades: Array = field(init=False)
    depths: Array = field(init=False)

    def __post_init__(self) -> None:
        self.shades = self.rng.normal(0.0, self.contrast, (512, 512))
        self.depths = np.abs(self.rng.normal(0.0, 0.003, (512, 512)))
        spalled = self.rng.random((512, 512)) < 0.02
        self.depths[spalled] += self.rng.uniform(0.008, 0.03, int(spalled.sum()))

    def _place(self, u: Array, v: Array) -> tuple[Index, Index, Array]:
        """Course, brick and distance from the edge of the brick's face."""
        row = np.floor(v / self.course)
        x = u / self.length + 0.5 * (row % 2)
        column = np.floor(x)
        across = np.minimum(v / self.course - row, 1 + row - v / self.course) * self.course
        along = np.minimum(x - column, 1 + column - x) * self.length
        return row.astype(np.int64) % 512, column.astype(np.int64) % 512, np.minimum(across, along) - self.joint / 2

    def relief(self, u: Array, v: Array) -> Array:
        row, column, inside = self._place(u, v)
        face = ramp(inside / 0.006)
        return face * self.depths[row, column] + (1 - face) * self.recess

    def shade(self, u: Array, v: Array) -> Array:
        row, column, inside = self._place(u, v)
        face = ramp(inside / 0.007)
        return face * self.shades[row, column] + (1 - face) * self.mortar


@dataclass
class Sprayed:
    """Sprayed concrete: all of it is in the layers."""

    def relief(self, u: Array, v: Array) -> Array:
        return np.zeros_like(u)

    def shade(self, u: Array, v: Array) -> Array:
        return np.zeros_like(u)

    def paint(self, canvas: Canvas, roughness: float, girders: float) -> None:
        """Lay the relief on: lobes of the spraying, grain, and ribs over lattice girders a given distance apart."""
        canvas.texture(canvas.relief, roughness, 0.45)
        canvas.texture(canvas.relief, 0.3 * roughness, 0.12)
        canvas.texture(canvas.relief, 0.12 * roughness, 0.04)
        rib = np.exp(-(((canvas.u + 0.3) % girders - girders / 2) ** 2) / 0.05)
        canvas.relief -= (0.03 * rib[:, None]).astype(np.float32)
        canvas.texture(canvas.shade, 0.4, 0.9)
        canvas.texture(canvas.shade, 0.35, 0.15)
        canvas.texture(canvas.shade, 0.3, 0.05)
