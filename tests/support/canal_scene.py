"""A straight canal tunnel in a few lines: rough, battered walls, a bed in waves, ladders; a laser above and a sonar below.

Nothing of it is shared with what registers the scans. Canal frame: x along, y across, z up from the water; the tunnel's is
turned about z by an odd angle and shifted.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import laspy
import numpy as np
import pyproj
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.spatial.transform import Rotation

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.registration.underwater import Ladder

WIDTH, DEPTH, LEVEL = 6.6, 2.5, 265.0
ORIGIN = np.array([352000.0, 5400000.0, LEVEL])
STILES, DIAMETER = 0.32, 0.035
RANGE_NOISE, LASER_NOISE = 0.015, 0.002
FALSE = 0.03  # share of echoes


class Relief:
    """A smooth random field over x and another coordinate, m."""

    def __init__(self, rng: np.random.Generator, amplitude: float, correlation: float) -> None:
        grid = gaussian_filter(rng.normal(size=(600, 80)), correlation / 0.2, mode="wrap")
        self.grid = grid / grid.std() * amplitude

    def at(self, x: Float, y: Float) -> Float:
        return np.asarray(map_coordinates(self.grid, [(x + 30.0) / 0.1, (y + 4.0) / 0.1], order=1, mode="nearest"))


@dataclass
class TrueLadder:
    """Origin (3,) at height 0, rows across, up and out, heights of rungs; canal frame."""

    name: str
    origin: Float
    axes: Float
    height: Float

    def bars(self) -> Iterator[tuple[Float, Float]]:
        half = STILES / 2.0
        low, high = self.height[0] - 0.15, self.height[-1] + 0.15
        ends = [((-half, low), (-half, high)), ((half, low), (half, high))]
        ends += [((-half, h), (half, h)) for h in self.height]
        for one, other in ends:
            yield self.origin + np.array([*one, 0.0]) @ self.axes, self.origin + np.array([*other, 0.0]) @ self.axes

    def towards(self, station: Float, rays: Float) -> Int64:
        """Return rays, unit vectors (n, 3), that pass through a ball around all bars; the others miss them."""
        ends = np.array(list(self.bars())).reshape(-1, 3)
        away = ends.mean(axis=0) - station
        radius = np.linalg.norm(ends - ends.mean(axis=0), axis=1).max() + DIAMETER
        return np.flatnonzero(away @ away - (rays @ away) ** 2 < radius**2)

    def measured(self) -> Ladder:
        return Ladder(self.name, tuple(range(1, len(self.height) + 1)), self.height, STILES, DIAMETER)


@dataclass
class Sonar:
    """Points (n, 3) in the file's axes and the pose that brings them into the tunnel."""

    points: Float
    rotation: Float
    translation: Float
    scale: float

    def to_tunnel(self, points: Float) -> Float:
        return np.asarray(self.scale * points @ self.rotation.T + self.translation)


@dataclass
class Canal:
    """The scene; ``sides`` has -1 or 1 for each ladder's bank, ``waves`` the bed's standard deviation and correlation, m."""

    seed: int
    sides: tuple[int, ...] = (-1, 1)
    waves: tuple[float, float] = (0.06, 1.5)
    ladders: list[TrueLadder] = field(init=False)

    def __post_init__(self) -> None:
        rng = self.rng = np.random.default_rng(self.seed)
        self.bed, self.rough = Relief(rng, *self.waves), [Relief(rng, 0.01, 0.3) for _ in range(2)]
        self.batter = rng.uniform(0.0, 0.08, 2)
        angle = rng.uniform(0.0, 2.0 * np.pi)
        self.turn = Rotation.from_euler("z", angle).as_matrix()
        places = np.linspace(-3.0, 2.0, len(self.sides))
        self.ladders = [self._ladder(f"L{k}", x, side) for k, (x, side) in enumerate(zip(places, self.sides, strict=True))]

    def _ladder(self, name: str, x: float, side: int) -> TrueLadder:
        rng = self.rng
        height = np.concatenate([[0.0], np.cumsum(rng.normal(0.279, 0.006, 11))])
        water = np.array([0.0, -side, 0.0])
        up = np.array([rng.normal(0.0, 0.02), side * rng.uniform(0.02, 0.12), 1.0])
        up /= np.linalg.norm(up)
        out = water - (water @ up) * up
        out /= np.linalg.norm(out)
        foot = np.array([x + rng.uniform(-0.5, 0.5), side * (WIDTH / 2.0 - rng.uniform(0.2, 0.4)), 0.0])
        return TrueLadder(name, foot - rng.uniform(1.7, 2.0) * up, np.vstack([np.cross(up, out), up, out]), height)

    def measured(self) -> list[Ladder]:
        return [ladder.measured() for ladder in self.ladders]

    def near(self, ladder: TrueLadder, points: Float, aside: float, before: float) -> Bool:
        """Return True for points (n, 3), tunnel frame, within ``aside`` m of a ladder's middle, ``before`` m of its plane."""
        own = ((points - ORIGIN) @ self.turn - ladder.origin) @ ladder.axes.T
        return np.asarray((np.abs(own[:, 0]) < aside) & (np.abs(own[:, 2]) < before))

    def to_tunnel(self, points: Float) -> Float:
        return np.asarray(points @ self.turn.T + ORIGIN)

    def laser(self) -> Float:
        """Points (n, 3) of two stations above the water, tunnel frame."""
        step = np.radians(0.12)
        azimuth, elevation = np.meshgrid(np.arange(0.0, 2.0 * np.pi, step), np.arange(np.radians(-55.0), np.radians(6.0), step))
        rays = _rays(azimuth, elevation)
        rays = rays[np.abs(rays[:, 1]) > 0.15]
        parts = []
        for x in (-5.0, 4.0):
            station = np.array([x, 0.4, 1.2])
            reach, _ = self._cast(station, rays, water=False)
            seen = reach < 25.0
            reach = reach[seen] + self.rng.normal(0.0, LASER_NOISE, int(seen.sum()))
            parts.append(station + reach[:, None] * rays[seen])
        return self.to_tunnel(np.vstack(parts))

    def sonar(self, x: float, up: int = 1) -> Sonar:
        """A scan from a place along the canal, its yaw, tilt, depth and speed of sound by chance."""
        rng = self.rng
        station = np.array([x, rng.uniform(-0.8, 0.8), -rng.uniform(1.0, 1.4)])
        tilt = np.radians(rng.normal(0.0, 1.5, 2))
        rotation = Rotation.from_euler("zyx", [rng.uniform(0.0, 2.0 * np.pi), *tilt]).as_matrix() @ np.diag([1.0, up, up])
        scale = 1.0 + rng.uniform(-0.01, 0.01)
        azimuth, elevation = np.meshgrid(np.arange(0.0, 2.0 * np.pi, np.radians(0.3)), np.radians(np.arange(-22.5, 22.5, 0.3)))
        beams = _rays(azimuth, elevation)
        reach = self._strongest(station, beams, rotation)
        seen = np.isfinite(reach) & (reach < 25.0)
        beams, reach = beams[seen], reach[seen] + rng.normal(0.0, RANGE_NOISE, int(seen.sum()))
        false = rng.uniform(size=len(reach)) < FALSE
        reach[false] = rng.uniform(0.5, 15.0, int(false.sum()))
        place = self.to_tunnel(station[None])[0]
        return Sonar(beams * (reach / scale)[:, None], np.asarray(self.turn @ rotation), place, scale)

    def _strongest(self, station: Float, beams: Float, rotation: Float) -> Float:
        """Range of the strongest echo in each beam, a cone of one degree: seven rays."""
        best, strength = np.full(len(beams), np.inf), np.zeros(len(beams))
        side = np.cross(beams, [0.0, 0.0, 1.0])
        side /= np.linalg.norm(side, axis=1)[:, None]
        other = np.cross(beams, side)
        for k in range(7):
            angle = k * np.pi / 3.0
            off = np.radians(0.33) * (np.cos(angle) * side + np.sin(angle) * other) if k else 0.0 * side
            ray = beams + off
            ray = (ray / np.linalg.norm(ray, axis=1)[:, None]) @ rotation.T
            reach, surface = self._cast(station, ray, water=True)
            echo = np.array([1.0, 1.0, 1.5, 0.05])[surface] * (0.7 if k else 1.0) * self.rng.uniform(0.8, 1.2, len(ray))
            echo[~np.isfinite(reach)] = 0.0
            stronger = echo > strength
            best[stronger], strength[stronger] = reach[stronger], echo[stronger]
        return best

    def _cast(self, station: Float, rays: Float, water: bool) -> tuple[Float, Int64]:
        """Range to what each ray meets, inf if nothing, and what: 0 bed, 1 wall, 2 ladder, 3 the water's underside."""
        reach, surface = np.full(len(rays), np.inf), np.zeros(len(rays), np.int64)

        def meet(found: Float, kind: int) -> None:
            nearer = (found > 0.0) & (found < reach)
            reach[nearer], surface[nearer] = found[nearer], kind

        with np.errstate(divide="ignore", invalid="ignore"):
            for side, batter, rough in zip((-1.0, 1.0), self.batter, self.rough, strict=True):
                gap = WIDTH / 2.0 + batter * station[2] - side * station[1]
                closing = side * rays[:, 1] - batter * rays[:, 2]
                met = np.full(len(rays), np.inf)
                ahead = np.flatnonzero(closing > 0.0)
                ray, closing = rays[ahead], closing[ahead]
                found = gap / closing
                for _ in range(2):
                    hit = np.nan_to_num(station + found[:, None] * ray)
                    found = (gap + rough.at(hit[:, 0], hit[:, 2])) / closing
                met[ahead] = np.nan_to_num(found, nan=np.inf)
                meet(met, 1)
            if water:
                met = np.full(len(rays), np.inf)
                down = np.flatnonzero(rays[:, 2] < 0.0)
                ray = rays[down]
                found = (-DEPTH - station[2]) / ray[:, 2]
                for _ in range(3):
                    hit = np.nan_to_num(station + found[:, None] * ray)
                    found = (-DEPTH + self.bed.at(hit[:, 0], hit[:, 1]) - station[2]) / ray[:, 2]
                met[down] = np.nan_to_num(found, nan=np.inf)
                meet(met, 0)
                meet(np.where(rays[:, 2] > 0.0, -station[2] / rays[:, 2], np.inf), 3)
            else:
                height = (station + np.where(np.isfinite(reach), reach, 0.0)[:, None] * rays)[:, 2]
                reach[(height < 0.0) | (height > 1.5)] = np.inf
        for ladder in self.ladders:
            near = ladder.towards(station, rays)
            found = np.full(len(rays), np.inf)
            for begin, end in ladder.bars():
                found[near] = np.minimum(found[near], _cylinder(station, rays[near], begin, end))
            meet(found, 2)
        return reach, surface

    def write_laser(self, path: Path, points: Float) -> None:
        header = laspy.LasHeader(point_format=6, version="1.4")
        header.add_crs(pyproj.CRS(25832))
        header.scales, header.offsets = np.full(3, 1e-4), np.floor(ORIGIN)
        cloud = laspy.LasData(header)
        cloud.x, cloud.y, cloud.z = points.T
        cloud.point_source_id = np.ones(len(points), np.uint16)
        cloud.write(path)

    def write_ladders(self, path: Path) -> None:
        rows = [
            f"{ladder.name},{k + 1},{height:.4f},{STILES},{DIAMETER}"
            for ladder in self.ladders
            for k, height in enumerate(ladder.height)
        ]
        path.write_text("\n".join(["ladder,rung,height,stile_gap,diameter", *rows]) + "\n")

    def write_axis(self, path: Path) -> None:
        line = self.to_tunnel(np.array([[x, 0.0, 1.0] for x in np.arange(-30.0, 31.0, 10.0)]))
        path.write_text("\n".join(["x,y,z", *(f"{x:.4f},{y:.4f},{z:.4f}" for x, y, z in line)]) + "\n")


def _rays(azimuth: Float, elevation: Float) -> Float:
    cosine = np.cos(elevation)
    return np.stack([cosine * np.cos(azimuth), cosine * np.sin(azimuth), np.sin(elevation)], axis=-1).reshape(-1, 3)


def _cylinder(station: Float, rays: Float, begin: Float, end: Float) -> Float:
    """Range to a bar between two points, inf if it is missed."""
    length = float(np.linalg.norm(end - begin))
    axis = (end - begin) / length
    away = station - begin
    across = rays - np.outer(rays @ axis, axis)
    off = away - (away @ axis) * axis
    a, b, c = (across**2).sum(axis=1), across @ off, off @ off - (DIAMETER / 2.0) ** 2
    root = b * b - a * c
    reach = np.full(len(rays), np.inf)
    met = root > 0.0
    found = (-b[met] - np.sqrt(root[met])) / a[met]
    along = away @ axis + found * (rays[met] @ axis)
    reach[met] = np.where((found > 0.0) & (along > 0.0) & (along < length), found, np.inf)
    return reach
