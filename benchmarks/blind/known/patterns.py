"""What linings are made of: joints of rings and blocks, bricks, stones, rock."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.spatial import Delaunay
from shapely import Polygon

from benchmarks.blind.known.section import Array, Section
from benchmarks.blind.known.shapes import wave
from benchmarks.blind.known.surface import CELL, Surface


def cover(distance: Array, width: float) -> Array:
    """Share of a cell that a line covers."""
    value: Array = np.clip(0.5 + (0.5 * width - np.abs(distance)) / CELL, 0.0, 1.0)
    return value


def line_across(surface: Surface, u: Array, width: float, gain: float) -> None:
    """Paint a joint around the lining at chainage u, given for each column of the lining."""
    low = max(int((u.min() - width) / CELL), 0)
    high = max(min(int((u.max() + width) / CELL) + 2, surface.shape[0]), low)
    away = surface.u[low:high, None] - u[None, :]
    surface.dry[low:high, : len(u)] += (gain * cover(away, width)).astype(np.float32)


def line_along(surface: Surface, s: float, start: float, end: float, width: float, gain: float) -> None:
    """Paint a joint along the tunnel."""
    low, high = int((s - width) / CELL), int((s + width) / CELL) + 2
    rows = slice(max(int(start / CELL), 0), min(int(end / CELL) + 1, surface.shape[0]))
    away = surface.s[low:high] - s
    surface.dry[rows, low:high] += (gain * cover(away, width)).astype(np.float32)[None, :]


@dataclass
class Rings:
    """Rings of segments.

    Attributes
    ----------
    joints : array
        Chainage of the ring joints on the middle axis.
    tilt_y, tilt_z : array
        Slant of each joint's plane against the cross-section.
    cuts : list of arrays
        Outline coordinates of the longitudinal joints of each ring.
    """

    section: Section
    joints: Array
    tilt_y: Array
    tilt_z: Array
    cuts: list[Array]

    def edge(self, number: int, s: Array) -> Array:
        """Chainage of a ring joint."""
        y, z = self.section.at(s)
        edge: Array = self.joints[number] + self.tilt_y[number] * y + self.tilt_z[number] * (z - self.section.centre)
        return edge

    def panel(self, ring: int, low: float, high: float, inset: float = 0.0) -> Polygon:
        """Part of a ring between two outline coordinates."""
        s = np.linspace(low + inset, high - inset, max(3, int((high - low) / 0.05)))
        near, far = self.edge(ring, s) + inset, self.edge(ring + 1, s) - inset
        return Polygon(np.vstack([np.column_stack([near, s]), np.column_stack([far, s])[::-1]]))

    def paint(self, surface: Surface, width: float, gain: float) -> None:
        """Paint all joints."""
        s = surface.s[: surface.lining_rows]
        for number in range(len(self.joints)):
            line_across(surface, self.edge(number, s), width, gain)
        for ring, cuts in enumerate(self.cuts):
            for cut in cuts:
                ends = [float(self.edge(ring + k, np.array([cut]))[0]) for k in (0, 1)]
                line_along(surface, float(cut), ends[0] + 0.5 * width, ends[1] - 0.5 * width, width, gain)

    def strips(self, width: float) -> list[Polygon]:
        """Outlines of all joints."""
        s = np.linspace(0.0, self.section.lining, 200)
        found = []
        for number in range(1, len(self.joints) - 1):
            u = self.edge(number, s)
            found.append(
                Polygon(np.vstack([np.column_stack([u - 0.5 * width, s]), np.column_stack([u + 0.5 * width, s])[::-1]]))
            )
        for ring, cuts in enumerate(self.cuts[1:-1], start=1):
            found += [self.panel(ring, cut - 0.5 * width, cut + 0.5 * width).buffer(0) for cut in cuts]
        return found


def make_rings(section: Section, length: float, ring: float, segment: float, tilt: float, rng: np.random.Generator) -> Rings:
    """Staggered rings; ``tilt`` is the slant of their joints in degrees, which drifts from ring to ring."""
    joints = np.arange(-ring, length + 1.5 * ring, ring) + 0.3 * ring
    count = len(joints)
    slope = np.tan(np.radians(tilt))
    turn = np.linspace(0.4, 1.2, count)
    size = slope * (1.0 + wave(rng, np.arange(count, dtype=float), 20.0, 6.0, 0.12))
    cuts = []
    for k in range(count - 1):
        start = 0.3 * segment + (0.5 * segment if k % 2 else 0.0)
        cuts.append(np.arange(start, section.lining - 0.15, segment))
    return Rings(section, joints, size * np.cos(turn), size * np.sin(turn), cuts)


def chamfer(surface: Surface, rings: Rings, width: float, depth: float) -> None:
    """Cut joints into the relief as shallow notches."""
    relief = np.zeros(surface.shape, np.float32)
    half = 0.5 * width
    s = surface.s[: surface.lining_rows]
    for number in range(len(rings.joints)):
        u = rings.edge(number, s)
        low = max(int((u.min() - width) / CELL), 0)
        high = max(min(int((u.max() + width) / CELL) + 2, surface.shape[0]), low)
        notch = depth * np.clip(1.0 - np.abs(surface.u[low:high, None] - u[None, :]) / half, 0.0, 1.0)
        part = relief[low:high, : len(s)]
        np.maximum(part, notch, out=part, casting="same_kind")
    for ring, cuts in enumerate(rings.cuts):
        for cut in cuts:
            ends = [float(rings.edge(ring + k, np.array([cut]))[0]) for k in (0, 1)]
            rows = slice(max(int(ends[0] / CELL), 0), max(int(ends[1] / CELL), 0))
            low, high = int((cut - width) / CELL), int((cut + width) / CELL) + 2
            notch = depth * np.clip(1.0 - np.abs(surface.s[low:high] - cut) / half, 0.0, 1.0)
            part = relief[rows, low:high]
            np.maximum(part, notch[None, :], out=part, casting="same_kind")
    surface.set_relief(relief)


def block_joints(surface: Surface, pitch: float, first: float, gain: float, panel: float) -> None:
    """Joints of cast blocks, 2 cm, and faint lines of the shutter's panels."""
    columns = surface.lining_rows
    for u in np.arange(first, surface.length, pitch):
        line_across(surface, np.full(columns, u), 0.02, gain)
    for u in np.arange(first % panel, surface.length, panel):
        line_across(surface, np.full(columns, u), 0.01, -0.4)
    middle = 0.5 * surface.lining
    for s in np.arange(middle % (1.2 * panel), surface.lining - 0.2, 1.2 * panel):
        line_along(surface, float(s), 0.0, surface.length, 0.01, -0.3)


class Bricks:
    """Stretcher courses along the tunnel; bricks 25 x 6.5 cm, mortar 1 cm; a pattern for :class:`Surface`."""

    def __init__(self, lining: float, std: float, mortar: float, rng: np.random.Generator) -> None:
        self.lining, self.mortar = lining, mortar
        self.tone = rng.normal(0.0, std, (307, 211))
        self.offset = rng.normal(0.0, 0.0025, (307, 211))
        self.start = rng.normal(0.0, 0.02, 307)
        self.seeds = rng.integers(0, 2**31, 3)

    def __call__(self, u: Array, s: Array, beam: Array) -> tuple[Array, Array]:
        """Decibels and outward offset, the beam's width blurs the edges."""
        waves = [np.random.default_rng(int(seed)) for seed in self.seeds]
        wander = wave(waves[0], u, 14.0, 2.5, 0.016) + wave(waves[1], u + 2.0 * s, 9.0, 2.0, 0.008)
        rise = (s + wander + 5.0) / 0.075
        course = np.floor(rise)
        row = course.astype(np.int64) % 307
        along = (u + 20.0 + self.start[row] + wave(waves[2], u, 5.0, 0.7, 0.004)) / 0.26 + 0.5 * (course % 2)
        number = np.floor(along)
        column = number.astype(np.int64) % 211
        bed = 0.075 * (0.5 - np.abs(rise - course - 0.5)) - 0.005
        perpend = 0.26 * (0.5 - np.abs(along - number - 0.5)) - 0.005
        inside = np.clip(0.5 + np.minimum(bed, perpend) / (2.0 * beam), 0.0, 1.0)
        brick = s < self.lining
        value = np.where(brick, inside * self.tone[row, column] + (1.0 - inside) * self.mortar, 0.0)
        recess = np.where(brick, inside * self.offset[row, column] + (1.0 - inside) * 0.005, 0.0)
        return value, recess


def lay_stones(surface: Surface, std: float, rng: np.random.Generator) -> None:
    """Coursed stones of 0.3 to 0.7 m by 0.2 to 0.4 m with joints of 2 cm, recessed by 1 to 3 cm."""
    relief = np.zeros(surface.shape, np.float32)
    recess = 0.02 + 0.01 * np.clip(gaussian_filter(rng.standard_normal((surface.shape[0] // 10 + 1, 60)), (8, 1)) * 9, -1, 1)
    top, course = 0.0, 0
    while top < surface.lining - 0.02:
        height = float(rng.uniform(0.22, 0.42))
        if surface.lining - top - height < 0.24:
            height = surface.lining - top
        low, high = int(top / CELL), min(int((top + height) / CELL), surface.lining_rows)
        edges = np.cumsum(rng.uniform(0.32, 0.72, int(surface.length / 0.4) + 8)) - float(rng.uniform(0.2, 0.8))
        level = top + wave(rng, surface.u, 12.0, 3.0, 0.012)
        block = np.searchsorted(edges, surface.u)
        side = np.minimum(np.abs(edges[block] - surface.u), np.abs(surface.u - edges[np.maximum(block - 1, 0)]))
        bed = np.minimum(
            np.abs(surface.s[None, low:high] - level[:, None]), np.abs(surface.s[None, low:high] - level[:, None] - height)
        )
        away = np.minimum(side[:, None], bed)
        joint = cover(away, 0.02)
        tone, bulge, lean = (
            rng.normal(0, std, len(edges)),
            rng.normal(0, 0.004, len(edges)),
            rng.normal(0, 0.02, (2, len(edges))),
        )
        tilt = lean[0][block] * (surface.u - edges[block] + 0.25)
        tilt = np.clip(
            tilt[:, None] + lean[1][block][:, None] * (surface.s[None, low:high] - top - 0.5 * height), -0.008, 0.008
        )
        depth = recess[np.arange(surface.shape[0]) // 10, course % 60][:, None]
        surface.dry[:, low:high] += ((1.0 - joint) * tone[block][:, None] - 0.5 * joint).astype(np.float32)
        relief[:, low:high] = (1.0 - joint) * (bulge[block][:, None] + tilt) + joint * depth
        top += height
        course += 1
    rough = gaussian_filter(rng.standard_normal(relief.shape, dtype=np.float32), 3.0)
    relief[:, : surface.lining_rows] += 0.0022 * rough[:, : surface.lining_rows] / rough.std()
    surface.set_relief(relief)


def _planes(corner: Array, height: Array) -> Array:
    """Coefficients of height over chainage and outline coordinate for each triangle."""
    system = np.concatenate([np.ones((*corner.shape[:2], 1)), corner], axis=2)
    planes: Array = np.linalg.solve(system, height[..., None])[..., 0]
    return planes


def blast_rock(surface: Surface, std: float, rng: np.random.Generator) -> None:
    """Rough rock: facets of 0.2 to 0.8 m between random corners, within 0.15 m of the mean; each has a tone of its own."""
    count = int(1.15 * (surface.length + 2) * (surface.lining + 2) / 0.2)
    corners = rng.uniform([-1.0, -1.0], [surface.length + 1.0, surface.lining + 1.0], (count * 3, 2))
    wanted = 0.30 + 0.22 * np.sin(0.9 * corners[:, 0] + 1.3 * np.sin(0.7 * corners[:, 1]))
    kept: list[int] = []
    taken: dict[tuple[int, int], list[int]] = {}
    for k, (point, apart) in enumerate(zip(corners, np.maximum(wanted, 0.2), strict=True)):
        a, b = int(point[0] // 0.55), int(point[1] // 0.55)
        near = [j for i in (a - 1, a, a + 1) for m in (b - 1, b, b + 1) for j in taken.get((i, m), [])]
        if not near or np.min(np.hypot(*(corners[near] - point).T)) > apart:
            kept.append(k)
            taken.setdefault((a, b), []).append(k)
    corners = corners[kept]
    mesh = Delaunay(corners)
    swell = wave(rng, corners[:, 0] + 0.6 * corners[:, 1], 9.0, 2.0, 0.035) + wave(rng, corners[:, 1], 5.0, 1.5, 0.025)
    height = np.clip(swell + rng.uniform(-0.085, 0.085, len(corners)), -0.145, 0.145)
    height *= np.clip((surface.lining - corners[:, 1]) / 0.5, 0, 1) * np.clip(corners[:, 1] / 0.5, 0, 1)
    tone = rng.normal(0.0, std, len(mesh.simplices))
    relief = np.zeros(surface.shape, np.float32)
    columns = surface.s[: surface.lining_rows]
    planes = _planes(corners[mesh.simplices], height[mesh.simplices])
    for low in range(0, surface.shape[0], 400):
        u = surface.u[low : low + 400]
        spots = np.stack(np.meshgrid(u[::2], columns[::2], indexing="ij"), axis=-1)
        facet = mesh.find_simplex(spots.reshape(-1, 2)).reshape(spots.shape[:2])
        facet = facet.repeat(2, axis=0).repeat(2, axis=1)[: len(u), : len(columns)]
        a, b, c = planes[facet].transpose(2, 0, 1)
        relief[low : low + 400, : len(columns)] = a + b * u[:, None] + c * columns[None, :]
        surface.dry[low : low + 400, : len(columns)] += tone[facet].astype(np.float32)
    rough = gaussian_filter(rng.standard_normal(relief.shape, dtype=np.float32), 3.0)
    relief[:, : len(columns)] += 0.003 * rough[:, : len(columns)] / rough.std()
    surface.set_relief(relief)
