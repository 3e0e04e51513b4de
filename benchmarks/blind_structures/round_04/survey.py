"""A laser that scans bodies, and the files and truth of a scene."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path

import laspy
import numpy as np
from pyproj import CRS
from scipy.spatial import cKDTree

from .cast import Body, Hits, Noise, cast


@dataclass(frozen=True)
class Station:
    """A place, the sector in degrees (azimuth from +x, elevation), and the step in degrees."""

    place: tuple[float, float, float]
    azimuth: tuple[float, float]
    elevation: tuple[float, float]
    step: float
    offset_db: float = 0.0


@dataclass(frozen=True)
class Instrument:
    """Properties of the laser.

    `level` is the amplitude at 10 m of a white surface at 0 degrees, `near` the range in m below which light is lost.
    `noise` is in dB, `ranging` in m, `beam` is the full divergence in mrad.
    `facet` is a ripple in dB over elevation, `floor` the threshold.
    """

    level: float
    near: float = 2.0
    noise: float = 0.4
    ranging: float = 0.0015
    beam: float = 0.35
    facet: float = 0.1
    floor: float = 3.0

    def fall(self, t: np.ndarray) -> np.ndarray:
        """Give the part of the amplitude that depends on range, in dB."""
        return -20.0 * np.log10(t / 10.0) + 10.0 * np.log10(1.0 - np.exp(-((t / self.near) ** 2)))


@dataclass
class Survey:
    """A structure, its stations, and its place on the map."""

    bodies: list[Body]
    stations: list[Station]
    instrument: Instrument
    seed: int
    epsg: int
    origin: tuple[float, float, float]
    textures: dict = field(default_factory=dict)

    def write(self, folder: Path) -> None:
        """Write all files."""
        folder = Path(folder)
        self._number()
        parts = [self._scan(i, station) for i, station in enumerate(self.stations, start=1)]
        data = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
        world = data["xyz"] + np.array(self.origin)
        header = laspy.LasHeader(point_format=6, version="1.4")
        header.scales, header.offsets = np.full(3, 0.0005), np.floor(world.min(axis=0))
        header.creation_date = date(2025, 6, 1)
        header.add_crs(CRS.from_epsg(self.epsg))
        header.add_extra_dim(laspy.ExtraBytesParams(name="Amplitude", type=np.float32, description="dB"))
        las = laspy.LasData(header)
        las.x, las.y, las.z = world.T
        las["Amplitude"] = np.round(data["amplitude"], 2).astype(np.float32)
        las.intensity = np.clip(data["amplitude"] * 1000, 0, 65535).astype(np.uint16)
        las.point_source_id = data["station"].astype(np.uint16)
        las.return_number = las.number_of_returns = np.ones(len(world), dtype=np.uint8)
        las.gps_time = np.arange(len(world)) * 1e-5
        las.write(str(folder / "scan.laz"))
        np.savez_compressed(
            folder / "truth.npz",
            anomaly=data["anomaly"].astype(np.int32),
            surface=data["surface"].astype(np.int32),
            incidence=data["incidence"].astype(np.float32),
            area=data["area"].astype(np.float32),
        )
        (folder / "truth.json").write_text(json.dumps({"anomalies": self._truth(data)}, indent=1))
        with (folder / "stations.csv").open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["scan_id", "x", "y", "z"])
            for i, station in enumerate(self.stations, start=1):
                writer.writerow([i, *np.round(np.array(station.place) + np.array(self.origin), 4).tolist()])

    def _number(self) -> None:
        surface = mark = 0
        for i, body in enumerate(self.bodies):
            body.seed = i
            if body.smooth:
                body.front, body.back = surface + 1, surface + 2
                surface += 2
            for m in body.marks:
                mark += 1
                m.number = mark

    def _texture(self, cell: float) -> Noise:
        if cell not in self.textures:
            self.textures[cell] = Noise(self.seed + round(cell * 10000), cell)
        return self.textures[cell]

    def _paint(self, hits: Hits) -> dict[str, np.ndarray]:
        """Give, for each hit, its surface, anomaly, echo without range, and echo of the member's own kind."""
        n = len(hits.t)
        out = {key: np.zeros(n, int) for key in ("surface", "anomaly", "plain")}
        out["db"], out["own"] = np.zeros(n), np.zeros(n)
        order = np.argsort(hits.body, kind="stable")
        starts = np.searchsorted(hits.body[order], np.arange(len(self.bodies) + 1))
        for i, body in enumerate(self.bodies):
            w = order[starts[i] : starts[i + 1]]
            if not w.size:
                continue
            u, v, side, cosine = hits.u[w], hits.v[w], hits.side[w], hits.cosine[w]
            stuff = body.material
            shift = body.seed * 1.73 + 0.41 * (side > 0)
            db = (
                stuff.db
                + stuff.grain * self._texture(stuff.cell)(u + shift, v)
                + stuff.broad * self._texture(0.3)(u + shift, v)
            )
            drawn = np.zeros(len(w)) if body.design is None else body.design(u, v) * (side > 0)
            lobe, anomaly, change = np.zeros(len(w)), np.zeros(len(w), int), np.zeros(len(w))
            for mark in body.marks:
                weight = mark.weight(u, v) * (side == mark.side)
                speckle = 1.0 + 0.18 * self._texture(0.025)(u + 3.0 * mark.number, v)
                change += mark.db * weight * speckle
                lobe += mark.lobe * weight
                anomaly[weight > 0.5] = mark.number
            out["db"][w] = db + drawn + change + stuff.angle(cosine, lobe)
            out["own"][w] = stuff.angle(cosine)
            out["plain"][w] = drawn == 0
            if body.smooth:
                out["surface"][w] = np.where(side > 0, body.front, body.back)
                out["anomaly"][w] = anomaly
        return out

    def _scan(self, number: int, station: Station) -> dict[str, np.ndarray]:
        rng = np.random.default_rng([self.seed, number])
        tool, o = self.instrument, np.array(station.place)
        step = np.radians(station.step)
        az, el = np.meshgrid(
            np.arange(*np.radians(station.azimuth), step), np.arange(*np.radians(station.elevation), step), indexing="ij"
        )
        order = az.ravel()
        az = az.ravel() + rng.normal(0.0, step * 0.02, az.size)
        el = el.ravel() + rng.normal(0.0, step * 0.02, el.size)
        c = np.cos(el)
        d = np.stack([c * np.cos(az), c * np.sin(az), np.sin(el)], axis=-1)
        first = cast(self.bodies, o, d, order)
        # Two more rays lie at opposite sides of the beam. They only matter near edges.
        radius = tool.beam * 1e-3 / 2 + 0.0015 / np.where(np.isfinite(first.t), first.t, 10.0)
        phase = rng.uniform(0.0, np.pi, len(d))
        side = np.stack([-np.sin(az), np.cos(az), np.zeros(len(d))], axis=-1)
        shift = radius[:, None] * (np.cos(phase)[:, None] * side + np.sin(phase)[:, None] * np.cross(d, side))
        near = np.isfinite(first.t)
        grid = near.reshape(-1, len(np.arange(*np.radians(station.elevation), step)))
        touch = grid.copy()
        for ax in (0, 1):
            touch |= np.roll(grid, 1, ax) | np.roll(grid, -1, ax)
        w = np.flatnonzero(touch.ravel())
        d, el, order = d[w], el[w], order[w]
        first = Hits(*(getattr(first, key)[w] for key in ("t", "cosine", "body", "side", "u", "v")))
        sub = [cast(self.bodies, o, d + k * shift[w], order) for k in (1, -1)]
        paint = self._paint(first)
        t = np.stack([first.t, sub[0].t, sub[1].t])
        surface = np.stack([first.body * 2 + (first.side > 0)] + [s.body * 2 + (s.side > 0) for s in sub])
        hit = np.isfinite(t)
        best = np.where(hit[0], t[0], np.where(hit[1], t[1], t[2]))
        with np.errstate(invalid="ignore"):
            close = hit & (np.abs(t - best) < 0.45)
        share = close.sum(axis=0) / 3.0
        mean = np.sum(np.where(close, t, 0.0), axis=0) / np.maximum(close.sum(axis=0), 1)
        with np.errstate(invalid="ignore"):
            other = close & (surface != surface[0]) & (np.abs(t - best) > 0.008)
        mixed = other.any(axis=0) | ~hit[0]
        # Where only the rim of the beam hits, the echo is that of the body at the rim.
        rim = ~hit[0] & hit[1:].any(axis=0)
        for k in (1, 0):
            pick = rim & hit[k + 1]
            for key in ("body", "cosine", "side", "u", "v"):
                getattr(first, key)[pick] = getattr(sub[k], key)[pick]
        if rim.any():
            some = np.flatnonzero(rim)
            loose = self._paint(Hits(*(getattr(first, key)[some] for key in ("t", "cosine", "body", "side", "u", "v"))))
            paint["db"][some] = loose["db"]
        for key in ("surface", "anomaly"):
            paint[key][mixed] = 0
        r = np.where(mixed, mean, best)
        seen = hit.any(axis=0)
        r = np.where(seen, r, 1.0)
        amplitude = tool.level + tool.fall(r) + paint["db"] + 10.0 * np.log10(np.maximum(share, 0.1)) + station.offset_db
        amplitude += tool.facet * np.sin(el * 140.0) + rng.normal(0.0, tool.noise, len(r))
        wild = rng.random(len(r)) < 0.0004
        r[wild] *= rng.uniform(0.4, 0.98, wild.sum())
        amplitude[wild] = rng.uniform(tool.floor, tool.floor + 8.0, wild.sum())
        for key in ("surface", "anomaly"):
            paint[key][wild] = 0
        seen &= amplitude > tool.floor
        smooth = paint["surface"] > 0
        spread = r**2 * np.cos(el) * step**2 / np.clip(first.cosine, 0.02, 1.0)
        incidence = np.where(smooth, np.degrees(np.arccos(np.clip(first.cosine, 0.0, 1.0))), np.nan)
        xyz = o + d * (r + rng.normal(0.0, tool.ranging, len(r)))[:, None]
        return {
            "xyz": xyz[seen],
            "amplitude": amplitude[seen],
            "station": np.full(seen.sum(), number),
            "surface": paint["surface"][seen],
            "anomaly": paint["anomaly"][seen],
            "incidence": incidence[seen],
            "area": np.where(smooth, spread, 0.0)[seen],
            "rest": (paint["db"] - paint["own"])[seen],
            "plain": paint["plain"][seen],
            "u": first.u[seen],
            "v": first.v[seen],
        }

    def _truth(self, data: dict[str, np.ndarray]) -> list[dict]:
        out = []
        for body in self.bodies:
            for mark in body.marks:
                inside = data["anomaly"] == mark.number
                if not inside.any():
                    continue
                surface = data["surface"][inside][0]
                around = (data["surface"] == surface) & (data["anomaly"] == 0) & (data["plain"] > 0)
                if around.sum() < 30:
                    continue
                uv = np.stack([data["u"], data["v"]], axis=-1)
                reach = cKDTree(uv[inside]).query(uv[around])[0]
                ring = np.flatnonzero(around)[reach < max(0.25, np.partition(reach, 29)[29])]
                contrast = np.average(data["rest"][inside], weights=data["area"][inside])
                contrast -= np.average(data["rest"][ring], weights=data["area"][ring])
                # Per cell of 0.1 m, the station that saw most of it.
                cell = np.floor(uv[inside] / 0.1).astype(int)
                keys, which = np.unique(cell, axis=0, return_inverse=True)
                seen = np.zeros((len(self.stations) + 1, len(keys)))
                np.add.at(seen, (data["station"][inside], which.ravel()), data["area"][inside])
                entry = {
                    "id": mark.number,
                    "kind": mark.kind,
                    "area": round(float(seen.max(axis=0).sum()), 4),
                    "contrast_db": round(float(contrast), 2),
                }
                if mark.limit:
                    entry["limit"] = mark.limit
                out.append(entry)
        return out
