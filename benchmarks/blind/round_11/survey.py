"""A survey of a painted tunnel: static stations or a mobile profiler, and the files that are handed over."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import laspy
import numpy as np
import pyproj

from . import outline
from .canvas import Canvas
from .scanner import Ground, Instrument, Rays, Tracer, lining_tone, visible
from .tunnel import FIXTURE, FLOOR, LINING, NICHE, Tunnel


@dataclass
class Stations:
    """Static scanning: places (s, y, z), steps of the angles in degrees, farthest range that is kept."""

    places: Sequence[tuple[float, float, float]]
    step_deg: float = 0.15
    reach: float = 16.0
    offset_db: float = 0.15


@dataclass
class Trolley:
    """Mobile profiler: place (y, z), speed, profiles a second, step of the angle, lead of the plane of profiles by metre."""

    place: tuple[float, float]
    speed: float = 0.9
    rate: float = 50.0
    step_deg: float = 0.3
    lead: float = 0.0


@dataclass
class Survey:
    """All that is needed to scan a tunnel and to hand over files."""

    tunnel: Tunnel
    canvas: Canvas
    ground: Ground
    instrument: Instrument
    platform: Stations | Trolley
    seed: int
    cap_lining: float = 3200.0
    cap_floor: float = 700.0
    start_time: float = 352800.0
    with_reference: bool = True
    base_db: float = -4.5
    niche_db: float = -1.0
    track: list[tuple[float, float, float, float]] = field(default_factory=list)

    # ------------------------------------------------------------------ rays

    def _static_rays(self, place: tuple[float, float, float], number: int) -> Rays:
        """A full dome without the cone below the tripod."""
        step = np.radians(self.platform.step_deg)
        azimuth = np.arange(0, 2 * np.pi, step)
        elevation = np.arange(np.radians(-60), np.radians(90), step)
        az, el = np.meshgrid(azimuth, elevation, indexing="ij")
        along, right, up = np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)
        flat = np.hypot(right, up)
        line = np.broadcast_to(np.arange(len(azimuth))[:, None], az.shape)
        time = self.start_time + number * 600.0 + line * (200.0 / len(azimuth))
        use = flat > 0.12
        s0 = np.full(int(use.sum()), place[0])
        return Rays(place[1:], s0, np.arctan2(up, right)[use], (along[use] / flat[use]), time[use], line[use])

    def _mobile_rays(self) -> Rays:
        """Profiles along the whole scene and a little farther."""
        run = self.platform
        profiles = int((self.tunnel.length + 2.0) / run.speed * run.rate)
        count = int(360 / run.step_deg)
        turn = np.arange(profiles * count, dtype=np.float64) / count
        line = turn.astype(np.int64)
        phi = np.pi - (turn - line) * 2 * np.pi
        time = turn / run.rate
        return Rays(run.place, time * run.speed - 1.0, phi, np.full(len(phi), run.lead), self.start_time + time, line)

    # ------------------------------------------------------------------ scan

    def scan(self) -> dict[str, np.ndarray]:
        """Points with amplitude, time and station."""
        rng = np.random.default_rng(self.seed)
        narrow, wide = lining_tone(self.canvas)
        slopes = self.canvas.slopes()
        floor = self.ground.paint(self.tunnel.length, self.tunnel.section.floor_width, rng)
        clouds = []
        if isinstance(self.platform, Stations):
            for number, place in enumerate(self.platform.places, 1):
                tracer = Tracer(self.tunnel, place[1:])
                rays = self._static_rays(place, number)
                clouds.append(self._measure(tracer, rays, number, rng, narrow, wide, slopes, floor))
        else:
            tracer = Tracer(self.tunnel, self.platform.place)
            clouds.append(self._measure(tracer, self._mobile_rays(), 1, rng, narrow, wide, slopes, floor))
        return {key: np.concatenate([c[key] for c in clouds]) for key in clouds[0]}

    def _thin(self, hits: object, rng: np.random.Generator, cosine: np.ndarray, distance: np.ndarray, rays: Rays) -> np.ndarray:
        """Which rays are kept, so that the cloud is not denser than it is delivered."""
        if isinstance(self.platform, Stations):
            step = np.radians(self.platform.step_deg)
            level = np.abs((hits.z - rays.origin[1]) / distance)
            density = cosine / (distance**2 * step**2 * np.sqrt(np.clip(1 - level**2, 0.05, 1)))
            reach = self.platform.reach
        else:
            step = np.radians(self.platform.step_deg)
            density = self.platform.rate / self.platform.speed * cosine / (hits.reach * step)
            reach = 25.0
        cap = np.where(hits.kind == FLOOR, self.cap_floor, self.cap_lining)
        keep = rng.random(len(distance)) < cap / np.maximum(density, 1.0)
        return keep & (distance < reach) & (cosine > 0.12) & (hits.s > 0) & (hits.s < self.tunnel.length)

    def _measure(
        self,
        tracer: Tracer,
        rays: Rays,
        number: int,
        rng: np.random.Generator,
        narrow: np.ndarray,
        wide: np.ndarray,
        slopes: tuple[np.ndarray, np.ndarray],
        floor: tuple[np.ndarray, np.ndarray],
    ) -> dict[str, np.ndarray]:
        """Trace, displace by relief, and add up the amplitude."""
        axis, instrument, cell = self.tunnel.axis, self.instrument, self.canvas.grid.cell
        hits = tracer.background(rays)
        distance = hits.reach * np.hypot(1.0, rays.advance)
        toward = np.stack([np.cos(rays.phi), np.sin(rays.phi)], axis=1)
        cosine = -np.sum(hits.normal * toward, axis=1) / np.hypot(1.0, rays.advance)
        rays, hits = tracer.select(rays, hits, np.flatnonzero(self._thin(hits, rng, cosine, distance, rays)))
        cover = tracer.fixtures(rays, hits, rng)
        inside = (hits.s > 0) & (hits.s < self.tunnel.length)
        good = inside & ((cover > 0.9) | (rng.random(len(cover)) < 0.5))
        rays, hits = tracer.select(rays, hits, np.flatnonzero(good))
        count = len(hits.s)
        lining, ground = np.flatnonzero(hits.kind == LINING), np.flatnonzero(hits.kind == FLOOR)
        row = np.clip((hits.s[lining] / cell).astype(int), 0, narrow.shape[0] - 1)
        column = np.clip((hits.across[lining] / cell).astype(int), 0, narrow.shape[1] - 1)
        floor_row = np.clip((hits.s[ground] / 0.04).astype(int), 0, floor[0].shape[0] - 1)
        floor_column = np.clip((hits.across[ground] / 0.04).astype(int), 0, floor[0].shape[1] - 1)

        cos_phi, sin_phi = np.cos(rays.phi), np.sin(rays.phi)
        facing = -(hits.normal[:, 0] * cos_phi + hits.normal[:, 1] * sin_phi)
        push = np.zeros(count)
        push[lining] = self.canvas.relief[row, column] / np.maximum(facing[lining], 0.3)
        push[ground] = floor[1][floor_row, floor_column] / np.maximum(facing[ground], 0.3)
        distance = hits.reach * np.hypot(1.0, rays.advance)
        push += rng.normal(0, instrument.range_noise_m * (1 + 0.04 * distance)) / np.hypot(1.0, rays.advance)
        hits.reach = hits.reach + push
        s = rays.s0 + rays.advance * hits.reach
        y, z = rays.origin[0] + hits.reach * cos_phi, rays.origin[1] + hits.reach * sin_phi
        place = axis.world(rays.s0, np.full(count, rays.origin[0]), np.full(count, rays.origin[1]))
        world = axis.world(s, y, z)
        beam = place - world
        distance = np.linalg.norm(beam, axis=1)

        slope_s, slope_u = np.zeros(count), np.zeros(count)
        slope_s[lining], slope_u[lining] = slopes[0][row, column], slopes[1][row, column]
        cosine_s, sine_s = axis.frame(s)
        normal_y = hits.normal[:, 0] + slope_u * -hits.normal[:, 1]
        normal_z = hits.normal[:, 1] + slope_u * hits.normal[:, 0]
        normal = np.stack([normal_y * sine_s + slope_s * cosine_s, -normal_y * cosine_s + slope_s * sine_s, normal_z], axis=1)
        cosine = np.sum(normal * beam, axis=1) / distance / np.linalg.norm(normal, axis=1)
        cosine = np.where(hits.kind == FIXTURE, hits.facing, cosine)

        tone = np.zeros(count)
        spot = np.clip(instrument.footprint(distance[lining]) / np.clip(cosine[lining], 0.2, 1) / 0.03, 0, 1)
        tone[lining] = narrow[row, column] * (1 - spot) + wide[row, column] * spot
        tone[ground] = floor[0][floor_row, floor_column]
        fixture = hits.kind == FIXTURE
        tone[fixture] = hits.tone[fixture] + rng.normal(0, 0.4, int(fixture.sum()))
        niche = hits.kind == NICHE
        tone[niche] = self.niche_db + 0.4 * np.sin(hits.s[niche] * 2.1) + rng.normal(0, 0.5, int(niche.sum()))
        amplitude = instrument.constant_db + self.base_db + tone
        amplitude += instrument.range_db(distance) + instrument.incidence_db(cosine)
        amplitude += self._instrument_effects(rays, number, rng)
        amplitude += rng.normal(0, instrument.noise_db, count)
        return {
            "world": world,
            "amplitude": amplitude.astype(np.float32),
            "time": rays.time,
            "station": np.full(count, number, np.uint16),
            "kind": hits.kind,
            "s": s,
            "u": hits.across,
            "distance": distance,
            "cosine": cosine,
        }

    def _instrument_effects(self, rays: Rays, number: int, rng: np.random.Generator) -> np.ndarray:
        """Drift with time, jitter of lines, offsets of stations."""
        local = np.random.default_rng([self.seed, number])
        since = rays.time - rays.time.min()
        phase = local.uniform(0, 2 * np.pi, 3)
        whole = max(float(since.max()), 1e-6)
        drift = np.sin(since / whole * 2.3 + phase[0]) + 0.5 * np.sin(since / whole * 7.1 + phase[1])
        jitter = local.standard_normal(int(rays.line.max()) + 1)[rays.line]
        effect = self.instrument.drift_db * drift + self.instrument.band_db * jitter
        if isinstance(self.platform, Stations):
            effect = effect + local.normal(0, self.platform.offset_db)
        return effect

    # ------------------------------------------------------------------ what is seen

    def seen(self, coarse: float = 0.025) -> np.ndarray:
        """Whether the lining can be seen from anywhere, on a grid."""
        rng = np.random.default_rng(self.seed)
        rows, columns = int(np.ceil(self.tunnel.length / coarse)), int(np.ceil(self.tunnel.section.girth / coarse))
        s, u = np.meshgrid((np.arange(rows) + 0.5) * coarse, (np.arange(columns) + 0.5) * coarse, indexing="ij")
        s, u = s.ravel(), np.minimum(u.ravel(), self.tunnel.section.girth - 0.001)
        if isinstance(self.platform, Trolley):
            tracer = Tracer(self.tunnel, self.platform.place)
            return visible(tracer, s, u, None, self.platform.lead, rng).reshape(rows, columns)
        total = np.zeros(len(s), bool)
        for place in self.platform.places:
            tracer = Tracer(self.tunnel, place[1:])
            near = np.flatnonzero((np.abs(s - place[0]) < self.platform.reach - 2.0) & ~total)
            total[near] |= visible(tracer, s[near], u[near], place[0], 0.0, rng)
        return total.reshape(rows, columns)

    # ------------------------------------------------------------------ files

    def deliver(self, folder: Path) -> None:
        """Write all files of the contract."""
        folder = Path(folder)
        hidden = outline.wide_hidden(self.seen(), 0.025, self.canvas.grid.shape, self.canvas.grid.cell)
        outline.write(folder / "truth.geojson", outline.leaks(self.canvas, hidden), self.tunnel, self.canvas)
        outline.write(folder / "other.geojson", outline.marks(self.canvas, hidden), self.tunnel, self.canvas)
        self._write_lines(folder)
        self._write_cloud(folder / "scan.laz", self.scan())

    def _write_lines(self, folder: Path) -> None:
        """Axis, stations or trajectory, and reference."""
        axis = self.tunnel.axis
        s = np.linspace(-9.0, self.tunnel.length + 9.0, int((self.tunnel.length + 18) / 3.0) + 1)
        _table(folder / "axis.csv", "x,y,z", axis.world(s, np.zeros_like(s), np.zeros_like(s)), "%.4f")
        if isinstance(self.platform, Stations):
            places = np.asarray(self.platform.places)
            world = axis.world(places[:, 0], places[:, 1], places[:, 2])
            rows = np.column_stack([np.arange(1, len(world) + 1), world])
            _table(folder / "stations.csv", "scan_id,x,y,z", rows, ["%d", "%.4f", "%.4f", "%.4f"])
        else:
            run = self.platform
            time = np.arange(0, (self.tunnel.length + 2.0) / run.speed + 0.2, 0.1)
            place = axis.world(time * run.speed - 1.0, np.full_like(time, run.place[0]), np.full_like(time, run.place[1]))
            _table(folder / "trajectory.csv", "time,x,y,z", np.column_stack([time + self.start_time, place]), "%.4f")
        if self.with_reference:
            rng = np.random.default_rng(self.seed + 1)
            distance = np.concatenate([np.arange(1.0, 6.0, 0.25), np.arange(6.0, 27.1, 0.5)])
            level = self.instrument.constant_db - 3.0 + self.instrument.range_db(distance) + rng.normal(0, 0.03, len(distance))
            _table(folder / "reference.csv", "range_m,intensity_db", np.column_stack([distance, level]), ["%.2f", "%.3f"])

    def _write_cloud(self, path: Path, cloud: dict[str, np.ndarray]) -> None:
        """The point cloud, in order of time."""
        order = np.argsort(cloud["time"], kind="stable")
        world = cloud["world"][order]
        header = laspy.LasHeader(point_format=6, version="1.4")
        header.scales = np.full(3, 0.0005)
        header.offsets = np.floor(world.min(axis=0))
        header.add_crs(pyproj.CRS.from_epsg(25832))
        header.add_extra_dim(laspy.ExtraBytesParams(name="Amplitude", type=np.float32, description="dB"))
        las = laspy.LasData(header)
        las.x, las.y, las.z = world.T
        amplitude = cloud["amplitude"][order]
        las.Amplitude = amplitude
        las.intensity = np.clip(amplitude * 1000, 0, 65535).astype(np.uint16)
        las.gps_time = cloud["time"][order]
        las.point_source_id = cloud["station"][order]
        las.return_number = np.ones(len(order), np.uint8)
        las.number_of_returns = np.ones(len(order), np.uint8)
        las.write(str(path))


def _table(path: Path, head: str, rows: np.ndarray, form: str | list[str]) -> None:
    """A table with a header line."""
    forms = [form] * rows.shape[1] if isinstance(form, str) else form
    with path.open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(head.split(","))
        writer.writerows([[f % value for f, value in zip(forms, row, strict=True)] for row in rows.tolist()])
