"""Writes a scene as a surveyor hands it over, and its truth."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Sequence
from pathlib import Path

import laspy
import numpy as np
import pyproj
from shapely.geometry.base import BaseGeometry

from .geometry import STRAIGHT, Array
from .scan import Instrument, Law, Points, Trolley, decibel, mobile, static
from .truth import Views, geometry, outlines, seen_from, seen_passing, tidy
from .tunnel import Tunnel

EPSG = 25832
MOST = 3_000_000
Features = list[tuple[BaseGeometry, dict[str, object]]]


def write_static(
    t: Tunnel,
    folder: Path,
    tool: Instrument,
    law: Law,
    stations: Sequence[tuple[float, float, float]],
    step: float,
    target: float,
) -> None:
    """Write a scan from tripods at (c, u, w); ``target`` is the reflectance of the reference, 0 for none."""
    places = np.array(stations)
    _cloud(t, folder, static(t, tool, law, places, step))
    world = t.axis.to_world(t.axis.to_frame(*places.T))
    _table(folder / "stations.csv", "scan_id,x,y,z", [[n, *_metres(p)] for n, p in enumerate(world, start=1)])
    _rest(t, folder, tool, target, seen_from(t, places))


def write_mobile(t: Tunnel, folder: Path, tool: Instrument, law: Law, trolley: Trolley, target: float) -> None:
    """Write the scan of a profiler."""
    start = 231_400.0
    _cloud(t, folder, mobile(t, tool, law, trolley, start))
    time, places = trolley.path(t.axis.length)
    world = t.axis.to_world(t.axis.to_frame(*places.T))
    rows = [[f"{start + a:.3f}", *_metres(p)] for a, p in zip(time, world, strict=True)]
    _table(folder / "trajectory.csv", "time,x,y,z", rows)
    _rest(t, folder, tool, target, seen_passing(t, trolley.u, trolley.w, trolley.yaw))


def _cloud(t: Tunnel, folder: Path, pieces: Iterable[Points]) -> None:
    parts = list(pieces)
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.add_crs(pyproj.CRS.from_epsg(EPSG))
    header.add_extra_dim(laspy.ExtraBytesParams("Amplitude", np.float32, "dB"))
    header.scales = np.full(3, 0.0005)
    header.offsets = np.floor(t.axis.origin)
    count = sum(len(p.time) for p in parts)
    keep = np.ones(count, bool)
    if count > MOST:
        keep[t.rng.choice(count, count - MOST, replace=False)] = False
    las = laspy.LasData(header)
    las.xyz = t.axis.to_world(np.concatenate([p.xyz for p in parts]))[keep]
    las["Amplitude"] = np.concatenate([p.amplitude for p in parts])[keep].astype(np.float32)
    las.gps_time = np.concatenate([p.time for p in parts])[keep]
    las.point_source_id = np.concatenate([np.full(len(p.time), p.station, np.uint16) for p in parts])[keep]
    las.write(folder / "scan.laz")


def _rest(t: Tunnel, folder: Path, tool: Instrument, target: float, views: Views) -> None:
    spacing = 2.0 if abs(t.axis.radius) < STRAIGHT else 4.0
    c = np.arange(-spacing, t.axis.length + 1.5 * spacing, spacing)
    world = t.axis.to_world(t.axis.to_frame(c, np.zeros_like(c), np.zeros_like(c)))
    _table(folder / "axis.csv", "x,y,z", [_metres(p) for p in world])
    if target:
        r = np.concatenate([np.arange(1.0, 10.0, 0.25), np.arange(10.0, 27.01, 0.5)])
        db = tool.curve(r) + decibel(np.full_like(r, target)) + t.rng.normal(0, 0.04, len(r))
        _table(folder / "reference.csv", "range_m,intensity_db", [[f"{a:.2f}", f"{b:.2f}"] for a, b in zip(r, db, strict=True)])
    _features(t, folder / "truth.geojson", outlines(t, views))
    others = [(tidy(shape), {"id": n, "kind": kind}) for n, (shape, kind) in enumerate(t.others, start=1)]
    _features(t, folder / "other.geojson", [(s, dict(p)) for s, p in others if not s.is_empty])


def _features(t: Tunnel, path: Path, features: Features) -> None:
    members = [{"type": "Feature", "properties": p, "geometry": geometry(t, s)} for s, p in features]
    crs = {"type": "name", "properties": {"name": f"urn:ogc:def:crs:EPSG::{EPSG}"}}
    path.write_text(json.dumps({"type": "FeatureCollection", "crs": crs, "features": members}), encoding="utf-8")


def _metres(point: Array) -> list[str]:
    return [f"{v:.4f}" for v in point]


def _table(path: Path, head: str, rows: Iterable[Sequence[object]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(head.split(","))
        writer.writerows(rows)
