"""Laser scanners in a tunnel: rays, what they meet, and how strong the echo is."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy import ndimage

from .canvas import Canvas
from .texture import fractal
from .tunnel import FIXTURE, FLOOR, LINING, NICHE, Block, Strand, Tunnel


@dataclass(frozen=True)
class Instrument:
    """Ranges and amplitudes of a scanner.

    Attributes
    ----------
    constant_db : float
        Amplitude of a white target at 10 m.
    falloff : float
        Decibels lost by a factor of ten in range.
    near_db, near_m : float, float
        Loss close to the instrument, and the range over which it dies away.
    incidence_power : float
        Power of the cosine of incidence in the echo; one for a matt surface.
    noise_db : float
        Deviation of one amplitude.
    drift_db, band_db : float, float
        Slow drift with time, and jitter from one profile or scan line to the next.
    range_noise_m, beam_mrad, exit_m : float
        Deviation of a range; divergence and first diameter of the beam.
    """

    constant_db: float
    falloff: float
    near_db: float
    near_m: float
    incidence_power: float
    noise_db: float
    drift_db: float = 0.15
    band_db: float = 0.05
    range_noise_m: float = 0.0012
    beam_mrad: float = 0.4
    exit_m: float = 0.004

    def range_db(self, distance: np.ndarray) -> np.ndarray:
        """Effect of the range."""
        return -self.falloff * np.log10(distance / 10.0) - self.near_db * np.exp(-distance / self.near_m)

    def incidence_db(self, cosine: np.ndarray) -> np.ndarray:
        """Effect of the angle of incidence."""
        return 10 * self.incidence_power * np.log10(np.clip(cosine, 0.05, 1.0))

    def footprint(self, distance: np.ndarray) -> np.ndarray:
        """Diameter of the beam."""
        return np.hypot(self.exit_m, self.beam_mrad * 1e-3 * distance)


@dataclass
class Rays:
    """Rays from one place of the section: start along the tunnel, direction in the section, advance by metre in it."""

    origin: tuple[float, float]
    s0: np.ndarray
    phi: np.ndarray
    advance: np.ndarray
    time: np.ndarray
    line: np.ndarray


@dataclass
class Hits:
    """What rays met; arrays of one length."""

    kind: np.ndarray
    s: np.ndarray
    y: np.ndarray
    z: np.ndarray
    across: np.ndarray
    normal: np.ndarray
    reach: np.ndarray
    tone: np.ndarray
    facing: np.ndarray
    ray: np.ndarray
    segment: np.ndarray = field(repr=False)


class Tracer:
    """Finds what rays from one place meet in a tunnel."""

    def __init__(self, tunnel: Tunnel, origin: tuple[float, float], beam: float = 0.006):
        """``origin`` in the section, ``beam`` the diameter of the beam in metres for edges."""
        self.tunnel, self.origin, self.beam = tunnel, origin, beam
        self.table = tunnel.section.first_segments(origin)

    def background(self, rays: Rays) -> Hits:
        """Lining, floor and niches, without fixtures."""
        section = self.tunnel.section
        cosine, sine = np.cos(rays.phi), np.sin(rays.phi)
        index = ((rays.phi + np.pi) / (2 * np.pi) * len(self.table)).astype(np.int64) % len(self.table)
        segment = self.table[index]
        edge = (section.end - section.start)[segment]
        y, z = section.start[segment, 0] - self.origin[0], section.start[segment, 1] - self.origin[1]
        bottom = cosine * edge[:, 1] - sine * edge[:, 0]
        bottom = np.where(np.abs(bottom) < 1e-9, 1e-9, bottom)
        reach = (y * edge[:, 1] - z * edge[:, 0]) / bottom
        along = np.clip((y * sine - z * cosine) / bottom, 0, 1)
        reach = np.clip(reach, 0.05, 400.0)
        kind = np.where(section.is_floor[segment], FLOOR, LINING).astype(np.int8)
        s = rays.s0 + rays.advance * reach
        across = section.offset[segment] + along * section.size[segment]
        normal = section.normal[segment].copy()
        for niche in self.tunnel.niches:
            inside = np.flatnonzero(
                (kind == LINING)
                & (s > niche.hollow.start)
                & (s < niche.hollow.stop)
                & (across > niche.u0)
                & (across < niche.u1)
            )
            if inside.size:
                _, leave, out = self._cross(niche.hollow, rays, inside)
                reach[inside], kind[inside], normal[inside] = leave, NICHE, -out
        tone = np.zeros(len(s), np.float32)
        return Hits(
            kind,
            rays.s0 + rays.advance * reach,
            self.origin[0] + reach * cosine,
            self.origin[1] + reach * sine,
            across,
            normal,
            reach,
            tone,
            np.full(len(s), np.nan, np.float32),
            np.arange(len(s)),
            segment,
        )

    def _cross(self, block: Block, rays: Rays, pick: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Where rays enter and leave a prism, and the normal (in the section) where they leave."""
        normals, offsets = block.planes()
        direction = np.stack([np.cos(rays.phi[pick]), np.sin(rays.phi[pick])], axis=1)
        enter, leave = np.full(len(pick), -np.inf), np.full(len(pick), np.inf)
        out = np.zeros((len(pick), 2))
        with np.errstate(divide="ignore", invalid="ignore"):
            for normal, offset in zip(normals, offsets, strict=True):
                speed = direction @ normal
                at = (offset - normal @ np.asarray(self.origin)) / speed
                enter = np.where(speed < 0, np.maximum(enter, at), enter)
                closer = (speed > 0) & (at < leave)
                leave = np.where(closer, at, leave)
                out[closer] = normal
            advance = rays.advance[pick]
            first, last = (block.start - rays.s0[pick]) / advance, (block.stop - rays.s0[pick]) / advance
        slab = np.abs(advance) > 1e-9
        enter = np.where(slab, np.maximum(enter, np.minimum(first, last)), enter)
        leave = np.where(slab, np.minimum(leave, np.maximum(first, last)), leave)
        beside = ~slab & ((rays.s0[pick] < block.start) | (rays.s0[pick] > block.stop))
        leave[beside] = -1.0
        return enter, leave, out

    def _span(self, points: np.ndarray) -> tuple[float, float]:
        """Interval of directions in which points lie."""
        angle = np.arctan2(points[:, 1] - self.origin[1], points[:, 0] - self.origin[0])
        middle = np.angle(np.mean(np.exp(1j * angle)))
        turn = np.angle(np.exp(1j * (angle - middle)))
        return float(middle + turn.min()), float(middle + turn.max())

    def fixtures(self, rays: Rays, hits: Hits, rng: np.random.Generator) -> np.ndarray:
        """Put fixtures before the background in ``hits``; returns how much of the beam each covers."""
        order = np.argsort(rays.phi, kind="stable")
        sorted_phi = rays.phi[order]
        background = hits.reach.copy()
        cover = np.ones(len(background), np.float32)
        behind = np.zeros(len(background), bool)

        def between(low: float, high: float) -> np.ndarray:
            parts = []
            for turn in (-2 * np.pi, 0.0, 2 * np.pi):
                a, b = np.searchsorted(sorted_phi, (low + turn, high + turn))
                parts.append(order[a:b])
            return np.concatenate(parts)

        for strand in self.tunnel.strands:
            self._strand(strand, rays, hits, cover, between)
        for block in self.tunnel.blocks:
            pick = between(*self._span(np.asarray(block.corners, float)))
            pick = pick[self._near(block, rays, pick)]
            if not pick.size:
                continue
            enter, leave, _ = self._cross(block, rays, pick)
            good = (enter > 0.05) & (enter < leave) & (enter < hits.reach[pick])
            hit = pick[good]
            hits.reach[hit], hits.kind[hit], hits.tone[hit], cover[hit] = enter[good], FIXTURE, block.tone_db, 1.0
            hits.facing[hit] = rng.uniform(0.55, 0.95, len(hit))
        mixed = (hits.kind == FIXTURE) & (cover < 0.98)
        behind = mixed & (cover < 0.5)
        share = np.where(mixed, cover, 1.0)
        near = hits.reach
        hits.reach = np.where(mixed, near * share + background * (1 - share), near)
        hits.tone = np.where(behind, hits.tone - 1.0, hits.tone)
        changed = hits.kind == FIXTURE
        hits.s[changed] = rays.s0[changed] + rays.advance[changed] * hits.reach[changed]
        hits.y[changed] = self.origin[0] + hits.reach[changed] * np.cos(rays.phi[changed])
        hits.z[changed] = self.origin[1] + hits.reach[changed] * np.sin(rays.phi[changed])
        return cover

    def _near(self, block: Block, rays: Rays, pick: np.ndarray) -> np.ndarray:
        """Rays that may pass a block, by chainage."""
        corners = np.asarray(block.corners, float) - np.asarray(self.origin)
        far = float(np.hypot(corners[:, 0], corners[:, 1]).max())
        end = rays.s0[pick] + rays.advance[pick] * far
        low, high = np.minimum(rays.s0[pick], end), np.maximum(rays.s0[pick], end)
        return (low < block.stop) & (high > block.start)

    def _strand(self, strand: Strand, rays: Rays, hits: Hits, cover: np.ndarray, between: object) -> None:
        """Rays that meet a strand, or brush it."""
        centre = np.array([strand.y - self.origin[0], strand.z - self.origin[1]])
        size = strand.radius + self.beam / 2
        distance = float(np.hypot(*centre))
        box = np.array([[a, b] for a in (-size, size) for b in (-size - strand.sag, size)]) + [strand.y, strand.z]
        pick = between(*self._span(box))
        if not pick.size:
            return
        cosine, sine = np.cos(rays.phi[pick]), np.sin(rays.phi[pick])
        s = rays.s0[pick] + rays.advance[pick] * distance
        z = strand.centre_z(s) - self.origin[1]
        aside = np.abs(centre[0] * sine - z * cosine)
        part = np.clip(0.5 + (strand.radius - aside) / self.beam, 0, 1)
        reach = centre[0] * cosine + z * sine - np.sqrt(np.clip(strand.radius**2 - aside**2, 0, None))
        good = (part > 0.02) & (s > strand.start) & (s < strand.stop) & (reach < hits.reach[pick]) & (reach > 0.05)
        hit = pick[good]
        hits.reach[hit], hits.kind[hit], hits.tone[hit], cover[hit] = reach[good], FIXTURE, strand.tone_db, part[good]
        hits.facing[hit] = np.sqrt(np.clip(1 - (aside[good] / strand.radius) ** 2, 0.05, 1)) / np.hypot(1, rays.advance[hit])

    def select(self, rays: Rays, hits: Hits, keep: np.ndarray) -> tuple[Rays, Hits]:
        """Only some of the rays and what they met."""
        thin = Rays(rays.origin, rays.s0[keep], rays.phi[keep], rays.advance[keep], rays.time[keep], rays.line[keep])
        names = ("kind", "s", "y", "z", "across", "normal", "reach", "tone", "facing", "ray", "segment")
        return thin, Hits(**{name: getattr(hits, name)[keep] for name in names})


def visible(
    tracer: Tracer, s: np.ndarray, u: np.ndarray, station_s: float | None, lead: float, rng: np.random.Generator
) -> np.ndarray:
    """Whether points of the lining are seen from a place; ``station_s`` is None for a profiler that leads by ``lead``."""
    position, normal = tracer.tunnel.section.at(u)
    to = position - np.asarray(tracer.origin)
    reach = np.hypot(to[:, 0], to[:, 1])
    s0 = s - lead * reach if station_s is None else np.full(len(s), station_s)
    advance = (s - s0) / reach
    rays = Rays(tracer.origin, s0, np.arctan2(to[:, 1], to[:, 0]), advance, s0, s0)
    hits = tracer.background(rays)
    cosine = -np.sum(normal * to, axis=1) / np.hypot(reach, advance * reach)
    seen = (
        (hits.kind == LINING) & (np.abs(hits.reach - reach) < 0.03) & (cosine > 0.13) & (np.hypot(reach, advance * reach) < 25)
    )
    tracer.fixtures(rays, hits, rng)
    return seen & (hits.kind == LINING)


@dataclass
class Ground:
    """Tone and relief of the floor."""

    tone_db: float
    cloud_db: float
    grain_db: float
    rough_m: float
    stripes: list[tuple[float, float, float]] = field(default_factory=list)

    def paint(self, length: float, width: float, rng: np.random.Generator, cell: float = 0.04) -> tuple[np.ndarray, np.ndarray]:
        """Tone and relief on a grid; ``stripes`` are (from, to, dB) across the floor."""
        shape = int(length / cell) + 1, int(width / cell) + 2
        tone = self.tone_db + self.cloud_db * fractal(shape, (60, 12), rng, 4)
        tone += self.grain_db * rng.standard_normal(shape)
        middle = (np.arange(shape[1]) + 0.5) * cell
        for start, stop, level in self.stripes:
            tone[:, (middle >= start) & (middle < stop)] += level
        return tone.astype(np.float32), (self.rough_m * ndimage.gaussian_filter(rng.standard_normal(shape), 0.6)).astype(
            np.float32
        )


def lining_tone(canvas: Canvas) -> tuple[np.ndarray, np.ndarray]:
    """Tone as a narrow beam sees it, and as a wide one does."""
    power = 10 ** (canvas.tone / 10)
    return (
        (10 * np.log10(ndimage.gaussian_filter(power, 0.4))).astype(np.float32),
        (10 * np.log10(ndimage.gaussian_filter(power, 1.5))).astype(np.float32),
    )
