"""Scanning a painted tunnel: beams, what they meet, and how strongly they come back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy import ndimage

from .canvas import Canvas
from .fixtures import Beams, Fixture, Niche
from .geometry import Alignment, SectionView


@dataclass(frozen=True)
class Static:
    """Stations ``(s, y, z)`` on a tripod, with an even step of both angles, thinned to ``density`` points/m² each."""

    stations: tuple[tuple[float, float, float], ...]
    step: float
    density: float
    farthest: float = 20.0
    lowest: float = -65.0


@dataclass(frozen=True)
class Mobile:
    """A profiler that travels at ``(y, z)`` of the section."""

    y: float
    z: float
    speed: float
    turns: float
    per_turn: int
    density: float = 3900.0
    farthest: float = 25.0


@dataclass(frozen=True)
class Instrument:
    """How an instrument sees: ``fall`` over range (dB), ``tilt`` over the cosine of incidence (dB), noise and habits.

    ``blur`` is the spread of the footprint at no range and what each metre adds (metres); ``rim`` its radius at an
    edge; ``wobble`` slow changes from line to line or with the azimuth, ``offset`` between stations (dB); ``glint`` of a
    wet film met squarely.
    """

    constant: float
    fall: Callable[[np.ndarray], np.ndarray]
    tilt: Callable[[np.ndarray], np.ndarray]
    noise: float
    blur: tuple[float, float] = (0.002, 0.0004)
    rim: float = 0.004
    range_noise: float = 0.0012
    wobble: float = 0.15
    offset: float = 0.2
    glint: float = 0.0
    target: bool = True
    grain: float = 0.01


@dataclass
class Tunnel:
    """A tunnel that is ready to be scanned."""

    alignment: Alignment
    canvas: Canvas
    fixtures: list[Fixture] = field(default_factory=list)
    niches: list[Niche] = field(default_factory=list)


@dataclass
class Cast:
    """What beams met: ``kind`` 0 is lining or floor, 1 a niche, 2 a fixture."""

    kind: np.ndarray
    s: np.ndarray
    u: np.ndarray
    reach: np.ndarray
    behind: np.ndarray
    rim: np.ndarray
    tone: np.ndarray
    square: np.ndarray


def cast(tunnel: Tunnel, view: SectionView, beams: Beams, rim: float) -> Cast:
    """Follow beams to the nearest thing. ``reach`` and ``behind`` are in the section; the latter is that of the wall."""
    u, reach = view.look(beams.angle)
    s = beams.s0 + beams.k * reach
    count = len(u)
    out = Cast(np.zeros(count, np.int8), s, u, reach.copy(), reach, np.zeros(count, bool), np.zeros(count), np.ones(count))
    for niche in tunnel.niches:
        _enter(out, niche, tunnel, beams)
    out.behind = out.reach.copy()
    for fixture in tunnel.fixtures:
        met = fixture.meet(beams, rim)
        near = met.reach < out.reach[met.which]
        which = met.which[near]
        out.reach[which], out.square[which] = met.reach[near], met.square[near]
        out.rim[which], out.tone[which], out.kind[which] = met.rim[near], fixture.tone, 2
    return out


def _enter(out: Cast, niche: Niche, tunnel: Tunnel, beams: Beams) -> None:
    """Let beams that go through the opening of a niche go on to its inside."""
    which = np.flatnonzero((out.s > niche.s1) & (out.s < niche.s2) & (out.u > niche.u1) & (out.u < niche.u2))
    place, tangent, normal = (a[0] for a in tunnel.canvas.profile.at(np.array([(niche.u1 + niche.u2) / 2])))
    b = beams.pick(which)
    d = np.stack([np.cos(b.angle), np.sin(b.angle)], axis=1)
    o = np.array([beams.y0, beams.z0]) - place
    origin = np.stack(
        [b.s0 - (niche.s1 + niche.s2) / 2, np.full(len(b.s0), o @ tangent), np.full(len(b.s0), o @ normal)], axis=1
    )
    direction = np.stack([b.k, d @ tangent, d @ normal], axis=1)
    half = np.array([(niche.s2 - niche.s1) / 2, abs(niche.u2 - niche.u1) / 2, np.inf])
    with np.errstate(divide="ignore", invalid="ignore"):
        sides = (np.sign(direction[:, :2]) * half[:2] - origin[:, :2]) / direction[:, :2]
    back = (-niche.depth - origin[:, 2]) / direction[:, 2]
    exits = np.column_stack([np.where(np.isfinite(sides), sides, 1e9), back])
    face = exits.argmin(axis=1)
    out.reach[which] = np.maximum(exits.min(axis=1), out.reach[which])
    out.kind[which], out.tone[which] = 1, niche.tone
    out.square[which] = np.abs(np.take_along_axis(direction, face[:, None], axis=1)[:, 0]) / np.sqrt(1 + b.k**2)


def _static_beams(pattern: Static, view: SectionView, place: tuple, length: float, rng: np.random.Generator) -> Beams:
    """The beams of a station that are kept."""
    s, y, z = place
    azimuth = np.arange(0, 2 * np.pi, pattern.step) + rng.uniform(0, pattern.step)
    kept_angle, kept_k = [], []
    heights = np.arange(np.radians(pattern.lowest), np.pi / 2, pattern.step)
    for part in np.array_split(azimuth, 6):
        a, e = np.meshgrid(part, heights)
        a, e = a.ravel() + rng.normal(0, 1e-4, a.size), e.ravel() + rng.normal(0, 1e-4, e.size)
        along, dy, dz = np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)
        flat = np.maximum(np.hypot(dy, dz), 1e-6)
        angle, k = np.arctan2(dz, dy), along / flat
        u, reach = view.look(angle)
        far = reach * np.sqrt(1 + k**2)
        _, _, normal = view.profile.at(u)
        square = np.maximum(-(np.cos(angle) * normal[:, 0] + np.sin(angle) * normal[:, 1]), 0.02) * flat
        dense = square / (pattern.step**2 * far**2 * np.maximum(np.cos(e), 0.01))
        keep = (far < pattern.farthest) & (s + k * reach > 0) & (s + k * reach < length)
        keep &= rng.random(len(far)) < pattern.density / dense
        kept_angle.append(angle[keep])
        kept_k.append(k[keep])
    k = np.concatenate(kept_k)
    return Beams(np.full(len(k), s), y, z, np.concatenate(kept_angle), k)


def _mobile_beams(pattern: Mobile, view: SectionView, length: float, rng: np.random.Generator) -> tuple[Beams, np.ndarray]:
    """The beams of a journey, and when each was sent (seconds from its start)."""
    time = np.arange(0, length / pattern.speed, 1 / (pattern.turns * pattern.per_turn))
    s0 = pattern.speed * time + 0.05 * np.sin(time / 2.3)
    angle = 2 * np.pi * ((pattern.turns * time) % 1.0)
    u, reach = view.look(angle)
    _, _, normal = view.profile.at(u)
    square = np.maximum(-(np.cos(angle) * normal[:, 0] + np.sin(angle) * normal[:, 1]), 0.02)
    dense = square / (pattern.speed / pattern.turns * 2 * np.pi / pattern.per_turn * reach)
    keep = (rng.random(len(time)) < pattern.density / dense) & (s0 > 0) & (s0 < length) & (reach < pattern.farthest)
    return Beams(s0[keep], pattern.y, pattern.z, angle[keep], np.zeros(int(keep.sum()))), time[keep]


@dataclass
class Echoes:
    """Points of one station or journey."""

    s: np.ndarray
    y: np.ndarray
    z: np.ndarray
    amplitude: np.ndarray
    time: np.ndarray
    source: int


class Eye:
    """Turns what beams met into points and amplitudes."""

    def __init__(self, tunnel: Tunnel, instrument: Instrument):
        self.tunnel, self.instrument, self.canvas = tunnel, instrument, tunnel.canvas
        power = 10 ** ((self.canvas.base - self.canvas.wet) / 10)
        self.pictures = [power, ndimage.gaussian_filter(power, 0.006 / self.canvas.pixel)]

    def _surface(self, s: np.ndarray, u: np.ndarray, far: np.ndarray) -> np.ndarray:
        """Reflectance (as power) of the lining, blurred by the footprint."""
        spread = self.instrument.blur[0] + self.instrument.blur[1] * far
        share = np.clip((spread / 0.006) ** 2, 0, 1)
        return (1 - share) * self.canvas.sample(self.pictures[0], s, u) + share * self.canvas.sample(self.pictures[1], s, u)

    def see(self, beams: Beams, hit: Cast, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """``s, y, z`` and amplitude of each beam."""
        canvas, instrument = self.canvas, self.instrument
        stretch = np.sqrt(1 + beams.k**2)
        reach = hit.reach.copy()
        # the wall behind, met or not
        _, tangent, normal = canvas.profile.at(hit.u)
        bump = canvas.sample(canvas.bump, hit.s, hit.u)
        lean = 0.012
        along = (canvas.sample(canvas.bump, hit.s + lean, hit.u) - canvas.sample(canvas.bump, hit.s - lean, hit.u)) / (2 * lean)
        down = (canvas.sample(canvas.bump, hit.s, hit.u + lean) - canvas.sample(canvas.bump, hit.s, hit.u - lean)) / (2 * lean)
        tilted = normal - down[:, None] * tangent
        cy, cz = np.cos(beams.angle), np.sin(beams.angle)
        square = -(cy * tilted[:, 0] + cz * tilted[:, 1] - along * beams.k) / stretch
        square /= np.sqrt(1 + along**2 + down**2)
        square = np.clip(square, 0.03, 1)
        far = hit.behind * stretch
        wall = self._surface(hit.s, hit.u, far)
        if instrument.glint:
            film = np.clip(canvas.sample(canvas.wet, hit.s, hit.u) / 4 - 0.5, 0, 1)
            wall = wall * 10 ** (film * instrument.glint * np.exp(-((np.arccos(square) / 0.07) ** 2)) / 10)
        niche = hit.kind == 1
        wall = np.where(niche, 10 ** ((hit.tone + rng.normal(0, 0.3, len(far))) / 10), wall)
        back = wall * 10 ** ((instrument.fall(far) + instrument.tilt(np.where(niche, hit.square, square))) / 10)
        # fixtures before it
        near = hit.reach * stretch
        front = 10 ** ((hit.tone + rng.normal(0, 0.4, len(far)) + instrument.fall(near) + instrument.tilt(hit.square)) / 10)
        fixture = hit.kind == 2
        share = np.where(fixture, np.where(hit.rim, rng.uniform(0.05, 0.95, len(far)), 1.0), 0.0)
        reach = share * hit.reach + (1 - share) * hit.behind
        amplitude = instrument.constant + 10 * np.log10(share * front + (1 - share) * back)
        noise = rng.normal(0, instrument.range_noise, len(far)) / stretch
        s = beams.s0 + beams.k * (reach + noise)
        y, z = beams.y0 + cy * (reach + noise), beams.z0 + cz * (reach + noise)
        stand = np.where(hit.kind == 0, bump, 0)
        y, z = y + stand * normal[:, 0], z + stand * normal[:, 1]
        amplitude += rng.normal(0, 1, len(far)) * instrument.noise * np.where(fixture & hit.rim, 1.5, 1)
        return s, y, z, amplitude


def scan(tunnel: Tunnel, instrument: Instrument, pattern: Static | Mobile, rng: np.random.Generator) -> list[Echoes]:
    """All points."""
    eye, out = Eye(tunnel, instrument), []
    profile, length = tunnel.canvas.profile, tunnel.canvas.length
    places: Sequence[tuple[float, float, float]] = (
        pattern.stations if isinstance(pattern, Static) else ((0.0, pattern.y, pattern.z),)
    )
    for number, place in enumerate(places, start=1):
        view = SectionView(profile, place[1], place[2])
        if isinstance(pattern, Static):
            beams = _static_beams(pattern, view, place, length, rng)
            azimuth = np.arctan2(np.cos(beams.angle), beams.k)
            time = 900.0 * number + 180 * (azimuth + np.pi) / (2 * np.pi)
            habit = rng.normal(0, instrument.offset) + instrument.wobble * np.sin(azimuth + rng.uniform(0, 6))
        else:
            beams, time = _mobile_beams(pattern, view, length, rng)
            turn = np.floor(time * pattern.turns).astype(int)
            lines = rng.normal(0, 1, turn.max() + 1)
            slow = ndimage.gaussian_filter1d(rng.normal(0, 1, len(lines)), 40) * 16
            habit = instrument.wobble * (0.7 * lines + slow)[turn]
        hit = cast(tunnel, view, beams, instrument.rim)
        s, y, z, amplitude = eye.see(beams, hit, rng)
        keep = (s > -0.02) & (s < length + 0.02) & ~(hit.rim & (rng.random(len(s)) < 0.4))
        amplitude = np.round((amplitude + habit) / instrument.grain) * instrument.grain
        out.append(Echoes(s[keep], y[keep], z[keep], amplitude[keep], time[keep], number))
    return out


def visible(tunnel: Tunnel, pattern: Static | Mobile, cell: float = 0.03) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Which cells of the unrolled lining some station sees, with the chainages and the ``u`` of cells."""
    profile, length = tunnel.canvas.profile, tunnel.canvas.length
    s, u = np.arange(cell / 2, length, cell), np.arange(profile.foot_left, profile.foot_right, cell)
    grid_s, grid_u = (a.ravel() for a in np.meshgrid(s, u))
    place, _, _ = profile.at(grid_u)
    seen = np.zeros(grid_s.shape, dtype=bool)
    static = isinstance(pattern, Static)
    for s0, y0, z0 in pattern.stations if static else ((0.0, pattern.y, pattern.z),):
        dy, dz = place[:, 0] - y0, place[:, 1] - z0
        reach = np.hypot(dy, dz)
        k = (grid_s - s0) / reach if static else np.zeros(len(reach))
        start = np.full(len(reach), s0) if static else grid_s
        beams = Beams(start, y0, z0, np.arctan2(dz, dy), k)
        hit = cast(tunnel, SectionView(profile, y0, z0), beams, 0.0)
        limit = min(pattern.farthest, 15.0)
        seen |= (hit.kind == 0) & (np.abs(hit.u - grid_u) < 0.05) & (reach * np.sqrt(1 + k**2) < limit)
    return seen.reshape(len(u), len(s)), s, u
