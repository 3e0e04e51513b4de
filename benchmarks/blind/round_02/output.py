"""Files of a scene."""

from __future__ import annotations

import json
from pathlib import Path

import laspy
import numpy as np
import pyproj

from . import truth
from .arrays import FloatArray
from .instrument import Instrument
from .stances import Drive, Stance, Stations
from .survey import Cloud, survey
from .tracing import Tunnel

EPSG = 25832
TARGET_DB = -1.0


def write(
    folder: Path,
    tunnel: Tunnel,
    instrument: Instrument,
    stance: Stations | Drive,
    rng: np.random.Generator,
    reference: bool = True,
) -> None:
    """Scan a tunnel and write what a surveyor hands over, and the truth."""
    cloud = survey(tunnel, instrument, stance, rng)
    origin = np.array(tunnel.line.origin)
    _scan(folder / "scan.laz", cloud, origin)
    _axis(folder / "axis.csv", tunnel)
    if isinstance(stance, Stations):
        rows = [stance.origin(tunnel, number) + origin for number in range(len(stance.places))]
        lines = [f"{number},{x:.3f},{y:.3f},{z:.3f}" for number, (x, y, z) in enumerate(rows, 1)]
        _table(folder / "stations.csv", "scan_id,x,y,z", lines)
    else:
        times, xyz = stance.track(tunnel)
        xyz = xyz + origin + rng.normal(0, 0.001, xyz.shape)
        lines = [f"{time:.3f},{x:.4f},{y:.4f},{z:.4f}" for time, (x, y, z) in zip(times, xyz, strict=True)]
        _table(folder / "trajectory.csv", "time,x,y,z", lines)
    if reference:
        ranges = np.concatenate([np.arange(0.75, 6, 0.25), np.arange(6, 27.1, 0.5)])
        levels = instrument.range_db(ranges) + TARGET_DB + rng.normal(0, 0.06, ranges.size)
        lines = [f"{r:.3f},{level:.2f}" for r, level in zip(ranges, levels, strict=True)]
        _table(folder / "reference.csv", "range_m,intensity_db", lines)
    _truth(folder, tunnel, stance, instrument.beam)


def _scan(path: Path, cloud: Cloud, origin: FloatArray) -> None:
    """Points as LAS 1.4, compressed."""
    header = laspy.LasHeader(version="1.4", point_format=6)
    header.scales = np.full(3, 0.0005)
    header.offsets = np.floor(origin)
    header.add_crs(pyproj.CRS.from_epsg(EPSG))
    header.add_extra_dim(laspy.ExtraBytesParams(name="Amplitude", type=np.float32, description="dB"))
    las = laspy.LasData(header)
    order = np.argsort(cloud.time, kind="stable")
    las.x, las.y, las.z = (cloud.xyz[order] + origin).T
    las["Amplitude"] = cloud.amplitude[order].astype(np.float32)
    las.intensity = np.clip((cloud.amplitude[order] + 60) * 500, 0, 65535).astype(np.uint16)
    las.gps_time = cloud.time[order]
    las.point_source_id = cloud.source[order]
    las.return_number[:] = 1
    las.number_of_returns[:] = 1
    las.write(path)


def _axis(path: Path, tunnel: Tunnel) -> None:
    """Points of the axis, from before the scan to beyond it."""
    s = np.arange(-9.0, tunnel.canvas.length + 9.1, 3.0)
    xyz = tunnel.line.local(s, np.zeros_like(s), np.full_like(s, tunnel.section.axis_height)) + np.array(tunnel.line.origin)
    _table(path, "x,y,z", [f"{x:.3f},{y:.3f},{z:.3f}" for x, y, z in xyz])


def _table(path: Path, header: str, lines: list[str]) -> None:
    path.write_text("\n".join([header, *lines]) + "\n", encoding="utf-8")


def _truth(folder: Path, tunnel: Tunnel, stance: Stance, beam: float) -> None:
    """Outlines of leaks and of other marks."""
    leaks, wet = truth.leaks(tunnel, stance, beam)
    for name, features in (("truth", leaks), ("other", truth.others(tunnel, wet))):
        crs = {"type": "name", "properties": {"name": f"urn:ogc:def:crs:EPSG::{EPSG}"}}
        collection = {"type": "FeatureCollection", "name": name, "crs": crs, "features": features}
        (folder / f"{name}.geojson").write_text(json.dumps(collection), encoding="utf-8")
