"""From rays to points: where they end, what is before it, and how strong the echo is."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from .canvas import Canvas
from .equipment import Body, hits
from .frames import Array, Mask, Tunnel
from .instruments import Instrument, Law, mirror
from .linings import Lining
from .scanners import Grid, Index

REACH = 24.5
FINE = 0.008


@dataclass(frozen=True)
class Wall:
    """The lining with all that is on it.

    Attributes
    ----------
    tunnel, lining, canvas : Tunnel, Lining, Canvas
        Shape and surface.
    law, floor_law : Law
        How lining and floor reflect.
    base, floor : float
        Reflectance of lining and floor square to the beam, dB below white.
    """

    tunnel: Tunnel
    lining: Lining
    canvas: Canvas
    law: Law
    base: float
    floor: float
    floor_law: Law

    def relief(self, u: Array, v: Array) -> Array:
        """Depth outside the smooth lining."""
        depth = self.canvas.sample(self.canvas.relief, u, v)
        wall = np.abs(v) < self.tunnel.section.foot
        depth[wall] += self.lining.relief(u[wall], v[wall])
        return depth

    def settle(self, origin: Array, ray: Array, reach: Array) -> Array:
        """Follow rays from where they meet the smooth lining to where they meet the real one."""
        site = origin + reach[:, None] * ray
        cosine = np.maximum(np.einsum("ij,ij->i", ray, self.tunnel.normals(site)[2]), 0.2)
        lift = 0.006 + max(0.0, -float(self.canvas.relief.min()))
        reach = reach - lift / cosine
        active = np.arange(len(reach))
        for _ in range(28):
            u, v, depth = self.tunnel.locate(origin[active] + reach[active, None] * ray[active])
            short = self.relief(u, v) - depth
            going = short > 0.001
            active, short = active[going], short[going]
            if len(active) == 0:
                break
            reach[active] += np.clip(0.6 * short / cosine[active], 0.001, 0.04)
        return reach

    def tilt(self, site: Array, ray: Array, u: Array, v: Array) -> Array:
        """Cosine of the incidence on the real surface."""
        along, girthwise, out = self.tunnel.normals(site)
        here = self.relief(u, v)
        by_u = np.clip((self.relief(u + FINE, v) - here) / FINE, -2.0, 2.0)
        by_v = np.clip((self.relief(u, v + FINE) - here) / FINE, -2.0, 2.0)
        normal = out - by_u[:, None] * along - by_v[:, None] * girthwise
        cosine: Array = np.einsum("ij,ij->i", ray, normal) / np.linalg.norm(normal, axis=1)
        return np.clip(cosine, 0.03, 1.0)

    def echo(self, u: Array, v: Array, cosine: Array) -> tuple[Array, Array]:
        """Reflectance towards the scanner, dB, and the part of it that water takes."""
        canvas = self.canvas
        on_wall = np.abs(v) < self.tunnel.section.foot
        shade = canvas.sample(canvas.shade, u, v)
        shade[on_wall] += self.base + self.lining.shade(u[on_wall], v[on_wall]) + self.law(cosine[on_wall])
        shade[~on_wall] += self.floor + self.floor_law(cosine[~on_wall])
        water = mirror(canvas.sample(canvas.wet, u, v), canvas.sample(canvas.film, u, v), cosine)
        return shade + water, water


@dataclass
class Echoes:
    """Points of a scan, one entry each; ``on_lining`` are those whose beam met nothing but the lining."""

    site: Array
    amplitude: Array
    time: Array
    source: Array
    reach: Array
    cosine: Array
    u: Array
    v: Array
    water: Array
    on_lining: Mask

    def only(self, keep: Mask) -> Echoes:
        """Those that a mask keeps."""
        return Echoes(*(getattr(self, part.name)[keep] for part in fields(self)))


def merge(parts: list[Echoes]) -> Echoes:
    """Points of several scans, one after the other."""
    return Echoes(*(np.concatenate([getattr(part, item.name) for part in parts]) for item in fields(Echoes)))


def first_wall(tunnel: Tunnel, origin: Array, ray: Array) -> Array:
    """Range at which rays leave the smooth lining; infinite beyond the scanner's reach."""
    count = len(ray)
    low, high = np.zeros(count), np.full(count, np.inf)
    before, after = np.full(count, -1.0), np.zeros(count)
    active = np.arange(count)
    for reach in np.concatenate([np.arange(1.0, 6.0, 1.0), np.arange(6.0, REACH + 1.5, 1.8)]):
        level = tunnel.outside(origin[active] + reach * ray[active])
        out = level > 0
        high[active[out]], after[active[out]] = reach, level[out]
        low[active[~out]], before[active[~out]] = reach, level[~out]
        active = active[~out]
    found = np.flatnonzero(np.isfinite(high))
    a, b, fa, fb = low[found], high[found], before[found], after[found]
    start, way = origin[found], ray[found]
    side = np.zeros(len(found))
    for _ in range(8):
        c = np.clip((a * fb - b * fa) / (fb - fa), a, b)
        fc = tunnel.outside(start + c[:, None] * way)
        out = fc > 0
        fa = np.where(out & (side > 0), fa / 2, fa)
        fb = np.where(~out & (side < 0), fb / 2, fb)
        a, fa = np.where(out, a, c), np.where(out, fa, fc)
        b, fb = np.where(out, c, b), np.where(out, fc, fb)
        side = np.where(out, 1.0, -1.0)
    reach = np.full(count, np.inf)
    reach[found] = np.where(np.abs(fa) < np.abs(fb), a, b)
    return reach


@dataclass
class Screen:
    """What stands before the lining, for each ray of a grid."""

    reach: Array
    cosine: Array
    shade: Array
    edge: Mask

    def only(self, pick: Index) -> Screen:
        """On some rays, by their number."""
        return Screen(self.reach.flat[pick], self.cosine.flat[pick], self.shade.flat[pick], self.edge.flat[pick])


def _screen(grid: Grid, bodies: list[Body], instrument: Instrument) -> Screen:
    """Nearest body on each ray."""
    shape = grid.shape
    screen = Screen(np.full(shape, np.inf), np.ones(shape), np.zeros(shape), np.zeros(shape, bool))
    for body in bodies:
        rows, columns = grid.window(body.corners())
        if len(rows) == 0 or len(columns) == 0:
            continue
        origin, ray = grid.rays(rows, columns)
        away = float(np.linalg.norm(body.corners().mean(axis=0) - origin.reshape(-1, 3).mean(axis=0)))
        if away > REACH:
            continue
        width = instrument.beam[0] + instrument.beam[1] * away
        reach, cosine, edge = hits(body, origin, ray, width)
        cross = np.ix_(rows, columns)
        nearer = reach < screen.reach[cross]
        for layer, values in ((screen.reach, reach), (screen.cosine, cosine), (screen.edge, edge)):
            layer[cross] = np.where(nearer, values, layer[cross])
        screen.shade[cross] = np.where(nearer, body.shade, screen.shade[cross])
    return screen


def scan(wall: Wall, bodies: list[Body], grid: Grid, instrument: Instrument, rng: np.random.Generator, cap: float) -> Echoes:
    """All points from one station, or from one part of a ride, at no more than about ``cap`` points per square metre."""
    height, width = grid.shape
    rows, columns = np.arange(height), np.arange(width)
    origin, ray = grid.rays(rows, columns)
    origin = np.broadcast_to(origin, ray.shape).reshape(-1, 3)
    ray = ray.reshape(-1, 3)
    screen = _screen(grid, bodies, instrument)
    smooth = first_wall(wall.tunnel, origin, ray)
    within = np.isfinite(smooth)
    site = origin + np.where(within, smooth, REACH)[:, None] * ray
    slant = np.maximum(np.einsum("ij,ij->i", ray, wall.tunnel.normals(site)[2]), 0.02)
    area = grid.share(smooth.reshape(grid.shape)).ravel() / slant
    u = wall.tunnel.locate(site)[0]
    within &= (smooth < REACH) & (u > 0.05) & (u < wall.tunnel.axis.length - 0.05)
    pick = np.flatnonzero(within & (rng.random(len(area)) < cap * area))
    origin, ray = origin[pick], ray[pick]
    reach = wall.settle(origin, ray, smooth[pick])
    site = origin + reach[:, None] * ray
    u, v, _ = wall.tunnel.locate(site)
    cosine = wall.tilt(site, ray, u, v)
    echo, water = wall.echo(u, v, cosine)
    before, ends, amplitude = _mix(instrument, rng, reach, echo, screen.only(pick))
    ends, amplitude, stray = _disturb(instrument, rng, ends, amplitude)
    time, source = grid.times().ravel()[pick], np.full(len(pick), float(grid.source))
    echoes = Echoes(origin + ends[:, None] * ray, amplitude, time, source, ends, cosine, u, v, water, ~before & ~stray)
    return echoes.only(np.isfinite(amplitude) & (ends >= 1.5) & (ends < 25.0))


def _mix(
    instrument: Instrument, rng: np.random.Generator, reach: Array, echo: Array, screen: Screen
) -> tuple[Mask, Array, Array]:
    """Whether a body is before the lining, range of the echo, and its amplitude before noise.

    A beam that meets the edge of a body leaves a random share of its light on it; both echoes become one, at the mean of their
    ranges by power, unless they are far enough apart.
    """
    before = screen.reach < reach
    body = np.where(before, screen.reach, reach)
    share = np.where(before, np.where(screen.edge, rng.random(len(reach)), 1.0), 0.0)
    cosine = np.clip(np.where(before, screen.cosine, 1.0), 0.05, 1.0)
    body_echo = screen.shade + 10 * np.log10(cosine) + rng.normal(0, 0.5, len(reach))
    wall_power = (1 - share) * 10 ** ((instrument.curve(reach) + echo) / 10)
    body_power = share * 10 ** ((instrument.curve(body) + body_echo) / 10)
    total = wall_power + body_power
    mean = (wall_power * reach + body_power * body) / total
    stronger = np.where(body_power > wall_power, body, reach)
    return before, np.where(np.abs(reach - body) < 0.8, mean, stronger), 10 * np.log10(total)


def _disturb(instrument: Instrument, rng: np.random.Generator, reach: Array, amplitude: Array) -> tuple[Array, Array, Mask]:
    """Add noise, and echoes that are nowhere near a surface."""
    amplitude = instrument.noise(amplitude, rng)
    reach = reach + instrument.range_error(np.nan_to_num(amplitude, nan=instrument.threshold), rng)
    stray = rng.random(len(reach)) < instrument.stray
    elsewhere = np.clip(reach * rng.uniform(0.5, 1.3, len(reach)), 1.5, 24.9)
    weaker = np.maximum(amplitude - rng.uniform(3.0, 15.0, len(reach)), instrument.threshold + 0.1)
    return np.where(stray, elsewhere, reach), np.where(stray, weaker, amplitude), stray


def thin(echoes: Echoes, size: float) -> Echoes:
    """One point per cube of a given edge, as exports are thinned."""
    cell = np.floor((echoes.site - echoes.site.min(axis=0)) / size).astype(np.int64)
    spans = cell.max(axis=0) + 1
    key = (cell[:, 0] * spans[1] + cell[:, 1]) * spans[2] + cell[:, 2]
    keep = np.zeros(len(key), bool)
    keep[np.unique(key, return_index=True)[1]] = True
    return echoes.only(keep)
