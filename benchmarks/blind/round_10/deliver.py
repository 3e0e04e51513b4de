"""What the surveyor hands over: the scan, the axis, the stations or the trajectory, and beside it the truth."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import laspy
import numpy as np
import pyproj

from . import truth
from .canvas import Canvas
from .geometry import Alignment, Profile
from .scanner import Echoes, Instrument, Mobile, Static, Tunnel, scan

_MOST = 3_000_000
_CLOCK = 4.1e8


@dataclass(frozen=True)
class Site:
    """Everything about a scene but what is painted on its lining."""

    name: str
    alignment: Alignment
    profile: Profile
    length: float
    pixel: float
    instrument: Instrument
    pattern: Static | Mobile
    seed: int
    ranges: tuple[float, float] = (1.0, 25.0)


def _table(path: Path, head: str, rows: Iterable[Iterable[object]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(head.split(","))
        writer.writerows(rows)


def _features(path: Path, features: list[dict]) -> None:
    content = {"type": "FeatureCollection", "crs": truth.CRS, "features": features}
    path.write_text(json.dumps(content), encoding="utf-8")


def _las(path: Path, site: Site, parts: list[Echoes]) -> int:
    """Write the points; returns how many they are."""
    s, y, z, amplitude, time = (np.concatenate([getattr(p, n) for p in parts]) for n in ("s", "y", "z", "amplitude", "time"))
    source = np.concatenate([np.full(len(p.s), p.source, dtype=np.uint16) for p in parts])
    if len(s) > _MOST:
        raise ValueError(f"{site.name}: {len(s)} points")
    world = site.alignment.world(s, y, z)
    header = laspy.LasHeader(version="1.4", point_format=6)
    header.add_crs(pyproj.CRS.from_epsg(25832))
    header.scales = np.full(3, 0.0005)
    header.offsets = np.floor(world.min(axis=0) / 100) * 100
    header.add_extra_dim(laspy.ExtraBytesParams(name="Amplitude", type=np.float32, description="dB"))
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = world.T
    cloud.Amplitude = amplitude.astype(np.float32)
    cloud.intensity = np.clip((amplitude - amplitude.min() + 1) * 1000, 0, 65535).astype(np.uint16)
    cloud.gps_time = _CLOCK + time
    cloud.point_source_id = source
    cloud.return_number = np.ones(len(s), dtype=np.uint8)
    cloud.number_of_returns = np.ones(len(s), dtype=np.uint8)
    cloud.write(path)
    return len(s)


def deliver(folder: Path, site: Site, build: Callable[[Site, Canvas], Tunnel]) -> None:
    """Make a scene and write its files into a folder."""
    folder = Path(folder)
    rng = np.random.default_rng(site.seed)
    canvas = Canvas(site.profile, site.length, site.pixel, rng)
    tunnel = build(site, canvas)
    _las(folder / "scan.laz", site, scan(tunnel, site.instrument, site.pattern, rng))
    at = np.arange(-9.0, site.length + 10.0, 3.0)
    _table(folder / "axis.csv", "x,y,z", np.round(site.alignment.world(at, 0 * at, 0 * at), 4).tolist())
    if isinstance(site.pattern, Static):
        stations = np.array(site.pattern.stations)
        places = np.round(site.alignment.world(*stations.T), 4).tolist()
        _table(folder / "stations.csv", "scan_id,x,y,z", [[i, *p] for i, p in enumerate(places, start=1)])
    else:
        p = site.pattern
        time = np.arange(0, site.length / p.speed + 0.15, 0.1)
        s = p.speed * time + 0.05 * np.sin(time / 2.3)
        places = np.round(site.alignment.world(s, np.full_like(s, p.y), np.full_like(s, p.z)), 4)
        rows = [[f"{_CLOCK + t:.3f}", *xyz] for t, xyz in zip(time, places.tolist(), strict=True)]
        _table(folder / "trajectory.csv", "time,x,y,z", rows)
    if site.instrument.target:
        far = np.arange(site.ranges[0], site.ranges[1] + 0.01, 0.5)
        level = site.instrument.constant + site.instrument.fall(far) + rng.normal(0, 0.05, len(far))
        _table(
            folder / "reference.csv",
            "range_m,intensity_db",
            [[f"{a:.2f}", f"{b:.3f}"] for a, b in zip(far, level, strict=True)],
        )
    shade = truth.hidden(tunnel, site.pattern)
    _features(folder / "truth.geojson", truth.leaks(tunnel, shade))
    _features(folder / "other.geojson", truth.others(tunnel, shade))
