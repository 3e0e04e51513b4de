"""From the description of a tunnel to the files of a scene."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from . import files
from .geometry import FLOOR, LINING, Array, Axis, Bar, Material, Section, Tube
from .linings import shade
from .optics import Law, diffuse, lobe
from .sheet import Mark, Sheet, Stain
from .trace import Box, Hits, Icicle, Profiler, Static, World, direction, sphere

THIN = 0.016


@dataclass(frozen=True)
class Ground:
    """The floor: its level (dB), grain (dB and m), cell of the grain, spacing of sleepers (0: none), offsets of tracks."""

    level: float = -8.0
    grain: float = 1.2
    stones: float = 0.018
    cell: float = 0.045
    sleepers: float = 0.6
    tracks: tuple[float, ...] = (0.0,)


@dataclass
class Spec:
    """A scene: all that is known of a tunnel and of the scan of it."""

    seed: int
    axis: Axis
    section: Section
    length: float
    dress: Callable[[Sheet, np.random.Generator], None]
    law: Law
    scan: Static | Profiler
    level: float = -5.0
    rough: float = 0.35
    gloss: float = 0.0
    leaks: list[Stain] = field(default_factory=list)
    others: list[Stain] = field(default_factory=list)
    along: list[Tube | Bar] = field(default_factory=list)
    boxes: list[Box] = field(default_factory=list)
    icicles: list[Icicle] = field(default_factory=list)
    ground: Ground = Ground()
    reference: bool = True
    mixed: float = 0.35
    drift: float = 0.15


ICE = Material(-13.0, 0.1, 0.05)


class Maker:
    """Makes one scene."""

    def __init__(self, spec: Spec) -> None:
        self.spec = spec
        self.rng = np.random.default_rng(spec.seed)
        self.sheet = Sheet(-4.0, spec.length + 4.0, spec.section.end)
        spec.dress(self.sheet, self.rng)
        for stain in spec.others:
            self.sheet.stamp(stain, self.rng, wet=False)
        for stain in spec.leaks:
            self.sheet.stamp(stain, self.rng, wet=True)
        self.slopes = shade(self.sheet)
        self.world = World(spec.axis, spec.section, spec.along, spec.boxes, spec.icicles, ICE)
        self.hash = self.rng.standard_normal(8192)

    def make(self, folder: Path) -> None:
        """Scan the tunnel and write everything."""
        spec = self.spec
        rows = self._static() if isinstance(spec.scan, Static) else self._profiler(spec.scan)
        cloud = {key: np.concatenate([row[key] for row in rows]) for key in rows[0]}
        keep = self._thin(cloud["xyz"])
        files.write_cloud(folder / "scan.laz", spec.axis, {key: value[keep] for key, value in cloud.items()})
        files.write_axis(folder / "axis.csv", spec.axis, spec.length)
        if isinstance(spec.scan, Static):
            files.write_stations(folder / "stations.csv", spec.axis, spec.scan)
        else:
            files.write_trajectory(folder / "trajectory.csv", spec.axis, spec.scan, spec.length)
        if spec.reference:
            files.write_reference(folder / "reference.csv", spec.law, self.rng)
        files.write_truth(folder, spec.axis, spec.section, self.sheet, [self._drawn(m) for m in self.sheet.wet])

    def _static(self) -> list[dict[str, Array]]:
        scan = self.spec.scan
        assert isinstance(scan, Static)
        rows = []
        for k, place in enumerate(scan.stations):
            az, el = sphere(scan.step)
            az = az + self.rng.uniform(0, 2 * np.pi)
            time = 1000.0 * (k + 1) + np.arange(len(az)) * 2e-4
            origin = self.spec.axis.place(*(np.array(x) for x in place))[None, :]
            rows.append(self._shots(origin, direction(az, el), time, k + 1, self.rng.normal(0, self.spec.drift)))
        return rows

    def _profiler(self, scan: Profiler) -> list[dict[str, Array]]:
        rows = []
        lines = np.arange(0, self.spec.length, scan.spacing)
        for some in np.array_split(lines, max(len(lines) * scan.turn // 700_000, 1)):
            s = (some[:, None] + scan.spacing * np.arange(scan.turn)[None, :] / scan.turn).ravel()
            phi = np.tile(2 * np.pi * np.arange(scan.turn) / scan.turn, len(some))
            u, v = scan.path(s)
            ahead, right = self.spec.axis.frame(s)
            out = np.cos(phi)[:, None] * right + np.sin(scan.yaw) * np.cos(phi)[:, None] * ahead
            out[:, 2] += np.sin(phi)
            out /= np.linalg.norm(out, axis=1)[:, None]
            rows.append(self._shots(self.spec.axis.place(s, u, v), out, 500.0 + s / scan.speed, 1, 0.0))
        return rows

    def _shots(self, origin: Array, ray: Array, time: Array, number: int, drift: float) -> dict[str, Array]:
        """Echoes of rays in the order in which they were shot."""
        spec, rng, law = self.spec, self.rng, self.spec.law
        hits = self.world.trace(origin, ray, spec.scan.reach)
        t, echo = self._echo(origin, ray, hits)
        step = np.abs(np.diff(np.where(np.isfinite(t), t, 50.0)))
        edge = np.zeros(len(t), bool)
        edge[:-1] |= step > 0.015
        edge[1:] |= step > 0.015
        k = np.flatnonzero(edge & np.isfinite(t))
        spot = 0.5 * (law.beam + 0.004 / t[k])[:, None] * rng.uniform(-1, 1, (len(k), 3))
        second = ray[k] + spot
        second /= np.linalg.norm(second, axis=1)[:, None]
        from_there = np.broadcast_to(origin, ray.shape)[k]
        t2, echo2 = self._echo(from_there, second, self.world.trace(from_there, second, spec.scan.reach))
        share = rng.uniform(0.05, 0.6, len(k))
        p1 = (1 - share) * 10 ** ((echo[k] + law.range_term(t[k])) / 10)
        p2 = np.where(np.isfinite(t2), share * 10 ** ((echo2 + law.range_term(np.where(np.isfinite(t2), t2, 1.0))) / 10), 0.0)
        both = (p2 > 0) & (np.abs(t2 - t[k]) > 0.008)
        weight = np.where(both & (np.abs(np.where(both, t2, 0) - t[k]) < 0.6) & law.phase, p2 / (p1 + p2), 0.0)
        mixed_t = t[k] + weight * np.where(both, t2 - t[k], 0.0)
        power = np.where(weight > 0, p1 + p2, np.where(p2 > 0, p1 + p2 * ~both, p1 / (1 - share)))
        echo[k] = 10 * np.log10(np.maximum(power, 1e-9)) - law.range_term(mixed_t)
        t[k] = mixed_t
        dropped = k[(weight > 0.02) & (rng.random(len(k)) > spec.mixed)]
        good = np.isfinite(t) & (t > 1.5) & (hits.s > -0.5) & (hits.s < spec.length + 0.5)
        good[dropped] = False
        t, echo, hits_what = t[good], echo[good], hits.what[good]
        amplitude = law.observe(echo, t, rng) + drift
        weak = np.clip(10 ** ((law.floor + 18 - amplitude) / 20), 0.6, 6.0)
        ranged = t + law.range_noise * weak * rng.standard_normal(len(t))
        stray = np.flatnonzero(rng.random(len(t)) < 0.0006)
        ranged[stray] = np.maximum(ranged[stray] * rng.uniform(0.4, 0.97, len(stray)), 1.5)
        amplitude[stray] -= rng.uniform(3, 14, len(stray))
        xyz = np.broadcast_to(origin, ray.shape)[good] + ranged[:, None] * ray[good]
        detected = amplitude > law.floor - 4
        row = {"xyz": xyz, "amplitude": amplitude, "time": time[good], "station": np.full(len(t), number), "what": hits_what}
        return {key: value[detected] for key, value in row.items()}

    def _echo(self, origin: Array, ray: Array, hits: Hits) -> tuple[Array, Array]:
        """Ranges with the relief of the surfaces in them, and 10 lg of what comes back at range 1."""
        spec, world, sheet = self.spec, self.world, self.sheet
        t: Array = hits.t.copy()
        echo: Array = np.full(len(hits.t), -60.0)
        cos = np.abs((ray * hits.normal).sum(axis=1))
        hit = np.isfinite(t)
        k = np.flatnonzero(hit & (hits.what == LINING))
        s, l = hits.s[k], spec.section.project(hits.u[k], hits.v[k])  # noqa: E741
        n = spec.section.at(l)[1]
        ahead, right = spec.axis.frame(s)
        slope_s, slope_l = (sheet.sample(x, s, l) for x in self.slopes)
        tangent = -n[:, 1, None] * right
        tangent[:, 2] += n[:, 0]
        tilted = hits.normal[k] + slope_s[:, None] * ahead + slope_l[:, None] * tangent
        tilted /= np.linalg.norm(tilted, axis=1)[:, None]
        c = np.clip(-(ray[k] * tilted).sum(axis=1), 0.03, 1)
        t[k] += sheet.sample(sheet.relief, s, l) / np.maximum(cos[k], 0.25)
        light = spec.level + sheet.sample(sheet.light, s, l) - sheet.sample(sheet.drop, s, l)
        film = 0.25 * sheet.sample(sheet.film, s, l) * np.exp(0.5 * self.rng.standard_normal(len(k)))
        shine = (film + spec.gloss) * 10 ** (spec.level / 10) * lobe(c)
        echo[k] = 10 * np.log10(10 ** (light / 10) * diffuse(c, spec.rough) + shine)
        k = np.flatnonzero(hit & (hits.what == FLOOR))
        tone, bump = self._ground(hits.s[k], hits.u[k])
        c = np.clip(cos[k], 0.05, 1)
        t[k] += bump / np.maximum(c, 0.3)
        echo[k] = tone + 10 * np.log10(diffuse(c, 0.6))
        k = np.flatnonzero(hit & (hits.what > FLOOR))
        number = hits.what[k] - FLOOR - 1
        level, rough, gloss = (np.array([getattr(m, x) for m in world.materials]) for x in ("level", "rough", "gloss"))
        c = np.clip(cos[k], 0.05, 1)
        power = 10 ** (level[number] / 10) * diffuse(c, rough[number]) + gloss[number] * lobe(c)
        echo[k] = 10 * np.log10(power) + 0.4 * self.rng.standard_normal(len(k))
        return t, echo

    def _ground(self, s: Array, u: Array) -> tuple[Array, Array]:
        """Level (dB) and relief (m) of the floor."""
        g = self.spec.ground
        i, j = np.floor(s / g.cell).astype(np.int64), np.floor(u / g.cell).astype(np.int64)
        pick = (i * 73856093) ^ (j * 19349663)
        light, bump = g.level + g.grain * self.hash[pick & 8191], g.stones * np.clip(self.hash[(pick >> 3) & 8191], -1.5, 1.5)
        if g.sleepers:
            lies = np.zeros(len(s), bool)
            for track in g.tracks:
                lies |= (np.abs(u - track) < 1.3) & (np.mod(s, g.sleepers) < 0.24)
            light, bump = np.where(lies, g.level + 2.0, light), np.where(lies, 0.0, bump)
        return light, bump

    def _thin(self, xyz: Array) -> NDArray[np.int64]:
        """One point a cell of THIN, as the owner's copy is kept."""
        cell = np.floor((xyz - xyz.min(axis=0)) / THIN).astype(np.int64)
        size = cell.max(axis=0) + 1
        key = (cell[:, 0] * size[1] + cell[:, 1]) * size[2] + cell[:, 2]
        order = self.rng.permutation(len(key))
        return np.sort(order[np.unique(key[order], return_index=True)[1]])

    def _drawn(self, mark: Mark) -> tuple[Mark, NDArray[np.bool_]]:
        """A leak's mask without what is hidden behind things wider than 0.15 m."""
        n, m = mark.mask.shape
        i, j = np.meshgrid(np.arange(0, n, 2), np.arange(0, m, 2), indexing="ij")
        s, l = self.sheet.s[mark.i + i.ravel(), 0], self.sheet.l[0, mark.j + j.ravel()]  # noqa: E741
        p, inward = self.spec.section.at(l)
        target = self.spec.axis.place(s, p[:, 0] + 0.004 * inward[:, 0], p[:, 1] + 0.004 * inward[:, 1])
        seen = np.zeros(len(s), bool)
        for origin in self._viewpoints(s):
            ray = target - origin
            far = np.linalg.norm(ray, axis=1)
            reach = float(far.max()) + 1
            hits = self.world.trace(origin, ray / far[:, None], reach)
            seen |= (np.abs(hits.t - far) < 0.04) & (hits.what == LINING) & (far < self.spec.scan.reach)
        hidden = ~np.pad(seen.reshape(i.shape), 6, mode="edge")
        wide = ndimage.binary_opening(hidden, np.ones((8, 8)))[6:-6, 6:-6]
        wide = np.repeat(np.repeat(wide, 2, axis=0), 2, axis=1)[:n, :m]
        return mark, mark.mask & ~wide

    def _viewpoints(self, s: Array) -> list[Array]:
        scan = self.spec.scan
        if isinstance(scan, Profiler):
            return [self.spec.axis.place(s, *scan.path(s))]
        near = [p for p in scan.stations if s.min() - 9 < p[0] < s.max() + 9]
        return [self.spec.axis.place(*(np.array(x) for x in p))[None, :] for p in near]
