"""The files that a surveyor hands over, and the truth."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path

import laspy
import numpy as np
from pyproj import CRS

from .sensors import Sonar, Station, laser, sonar, turn
from .trace import Bar, Canal, Field, Stone


@dataclass
class Ladder:
    """A ladder: its foot, its top, the direction of its rungs, and its measures in m."""

    foot: np.ndarray
    top: np.ndarray
    across: np.ndarray
    gap: float
    rungs: np.ndarray
    stile: float
    rung: float

    def bars(self) -> list[Bar]:
        """Give the stiles and rungs as cylinders."""
        along = (self.top - self.foot) / np.linalg.norm(self.top - self.foot)
        half = self.across / np.linalg.norm(self.across) * self.gap / 2
        out = [Bar(self.foot + k * half, self.top + k * half, self.stile / 2) for k in (-1, 1)]
        for height in self.rungs:
            middle = self.foot + along * height
            out.append(Bar(middle - half, middle + half, self.rung / 2))
        return out


def uneven(first: float, pitch: float, count: int, jitter: float, rng: np.random.Generator) -> np.ndarray:
    """Give heights of rungs that a smith or a carpenter spaced by eye."""
    return np.round(first + pitch * np.arange(count) + rng.normal(0.0, jitter, count), 3)


def stones(
    count: int,
    span: tuple[float, float],
    wide: float,
    bed: float,
    size: tuple[float, float],
    canal: Canal,
    rng: np.random.Generator,
) -> list[Stone]:
    """Scatter stones on the bed."""
    out = []
    for s, q in zip(rng.uniform(*span, count), rng.uniform(-wide, wide, count), strict=True):
        half = rng.uniform(*size) * rng.uniform(0.6, 1.2, 3)
        x, y = canal.course.to_plan(s, q)
        out.append(Stone(np.array([float(x), float(y), bed + half[2] * rng.uniform(-0.2, 0.6)]), half))
    return out


@dataclass
class Survey:
    """A canal, its sensors, and the place on the map."""

    canal: Canal
    seed: int
    epsg: int
    east: float
    north: float
    bearing: float
    water: float
    water_then: float
    axis_height: float
    stations: list[Station]
    scans: list[Sonar]
    ladders: list[Ladder] = field(default_factory=list)
    weed: Field | None = None
    dry: list[Bar | Stone] = field(default_factory=list)
    speed: tuple[float, float] | None = None
    spacing: float = 3.0

    def to_world(self, p: np.ndarray) -> np.ndarray:
        """Bring points of the scene onto the map."""
        return np.asarray(p) @ turn("z", self.bearing).T + np.array([self.east, self.north, 0.0])

    def write(self, folder: Path) -> None:
        """Write all files."""
        folder = Path(folder)
        for ladder in self.ladders:
            self.canal.bodies += ladder.bars()
        self._laser(folder)
        self._tables(folder)
        up, truth, begin = self.scans[0].point, [], []
        for i, scan in enumerate(self.scans, start=1):
            rng = np.random.default_rng([self.seed, 50, i])
            points, local, scene = sonar(self.canal, scan, self.water_then, self.weed, rng)
            np.savetxt(folder / f"sonar_{i}.xyz", points, fmt="%.3f")
            entry = {
                "rotation": (turn("z", self.bearing) @ scan.rotation()).tolist(),
                "origin": self.to_world(np.array(scan.place)).tolist(),
                "scale": scan.scale,
                "check_local": local.tolist(),
                "check_world": self.to_world(scene).tolist(),
                "determined": scan.determined,
            }
            if not scan.determined:
                entry["open"] = scan.open
            truth.append(entry)
            if scan.start:
                off = rng.uniform(-0.6, 0.6, 2) * scan.start
                x, y = entry["origin"][0] + off[0], entry["origin"][1] + off[1]
                begin.append({"file": f"sonar_{i}.xyz", "x": round(x, 1), "y": round(y, 1), "within": scan.start})
        note: dict = {"epsg": self.epsg, "up": up, "water_level": self.water}
        if self.speed is not None:
            note["sound_speed"] = list(self.speed)
        if begin:
            note["start"] = begin
        (folder / "scene.json").write_text(json.dumps(note, indent=1))
        (folder / "truth.json").write_text(json.dumps({"scans": truth}))

    def _laser(self, folder: Path) -> None:
        wet = list(self.canal.bodies)
        self.canal.bodies = wet + self.dry
        points, strength, source = [], [], []
        for i, station in enumerate(self.stations, start=1):
            p, a = laser(self.canal, station, self.water, np.random.default_rng([self.seed, 20, i]))
            points.append(p)
            strength.append(a)
            source.append(np.full(len(p), i, dtype=np.uint16))
        self.canal.bodies = wet
        world = self.to_world(np.concatenate(points))
        header = laspy.LasHeader(point_format=6, version="1.4")
        header.scales, header.offsets = np.full(3, 0.001), np.floor(world.min(axis=0))
        header.creation_date = date(2025, 6, 1)
        header.add_crs(CRS.from_epsg(self.epsg))
        las = laspy.LasData(header)
        las.x, las.y, las.z = world.T
        las.intensity = np.concatenate(strength)
        las.point_source_id = np.concatenate(source)
        las.return_number = las.number_of_returns = np.ones(len(world), dtype=np.uint8)
        las.write(str(folder / "laser.laz"))

    def _tables(self, folder: Path) -> None:
        rows = [[i, *np.round(self.to_world(np.array(s.place)), 3)] for i, s in enumerate(self.stations, start=1)]
        _table(folder / "stations.csv", ["scan_id", "x", "y", "z"], rows)
        s = np.linspace(0.0, self.canal.length, round(self.canal.length / self.spacing) + 1)
        x, y = self.canal.course.to_plan(s, np.zeros(len(s)))
        axis = self.to_world(np.stack([x, y, np.full(len(s), self.axis_height)], axis=-1))
        _table(folder / "axis.csv", ["x", "y", "z"], np.round(axis, 3).tolist())
        rows = []
        for i, ladder in enumerate(self.ladders, start=1):
            for j, height in enumerate(ladder.rungs, start=1):
                rows.append([i, j, round(float(height - ladder.rungs[0]), 3), ladder.gap, ladder.rung])
        _table(folder / "ladders.csv", ["ladder", "rung", "height", "stile_gap", "diameter"], rows)


def _table(path: Path, head: list[str], rows: list) -> None:
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(head)
        writer.writerows(rows)
