"""Write what a surveyor hands over, and the truth."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import laspy
import numpy as np
from numpy.typing import NDArray
from pyproj import CRS
from scipy.spatial import cKDTree
from shapely import MultiPolygon, Polygon, get_parts, points, segmentize, unary_union
from shapely.geometry.base import BaseGeometry

from benchmarks.blind.known.radiometry import Instrument
from benchmarks.blind.known.record import Scan
from benchmarks.blind.known.scanner import Profiler, Stations
from benchmarks.blind.known.section import Array
from benchmarks.blind.known.site import Leak, Site
from benchmarks.blind.known.surface import signed_distance

EPSG = 25832
HIDDEN = 0.09
SEEN = 0.025


def write_cloud(site: Site, scan: Scan, path: Path) -> None:
    """Write the points."""
    world = site.axis.world(*scan.local.T)
    order = np.argsort(scan.time, kind="stable")
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales = np.full(3, 0.0005)
    header.offsets = np.floor(world.min(axis=0))
    header.add_crs(CRS.from_epsg(EPSG))
    header.add_extra_dim(laspy.ExtraBytesParams(name="Amplitude", type=np.float32, description="dB"))
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = world[order].T
    cloud.gps_time = scan.time[order]
    cloud.point_source_id = scan.station[order].astype(np.uint16)
    cloud.return_number = np.ones(len(order), np.uint8)
    cloud.number_of_returns = np.ones(len(order), np.uint8)
    cloud["Amplitude"] = scan.amplitude[order].astype(np.float32)
    cloud.write(str(path), laz_backend=laspy.LazBackend.Lazrs)


def _write_rows(path: Path, names: list[str], rows: Iterable[Iterable[str]]) -> None:
    with path.open("w", newline="") as handle:
        writer = csv.writer(handle)
        writer.writerow(names)
        writer.writerows(rows)


def _metres(values: Iterable[float]) -> list[str]:
    return [f"{value:.4f}" for value in values]


def write_tables(site: Site, scanner: Stations | Profiler, scan: Scan, tool: Instrument, folder: Path) -> None:
    """Write axis, stations or trajectory, and the reference curve if there is one."""
    u = np.linspace(-3.0, site.length + 3.0, int(site.length / 3.0) + 3)
    axis = site.axis.world(u, np.zeros_like(u), np.full_like(u, site.section.centre))
    _write_rows(folder / "axis.csv", ["x", "y", "z"], map(_metres, axis))
    if isinstance(scanner, Stations):
        places = site.axis.world(*np.array(scanner.places, float).T)
        rows = [[str(number), *_metres(place)] for number, place in enumerate(places, start=1)]
        _write_rows(folder / "stations.csv", ["scan_id", "x", "y", "z"], rows)
    elif scan.path is not None:
        places = site.axis.world(*scan.path[:, 1:].T)
        rows = [[f"{time:.4f}", *_metres(place)] for time, place in zip(scan.path[:, 0], places, strict=True)]
        _write_rows(folder / "trajectory.csv", ["time", "x", "y", "z"], rows)
    if tool.has_reference:
        t = np.arange(1.0, 26.01, 0.25)
        curve = tool.range_db(t) + 10.0 * np.log10(0.8)
        rows = [[f"{a:.2f}", f"{b:.2f}"] for a, b in zip(t, curve, strict=True)]
        _write_rows(folder / "reference.csv", ["range_m", "intensity_db"], rows)


def _polygons(shape: BaseGeometry, least: float) -> list[Polygon]:
    return [part for part in get_parts(shape) if isinstance(part, Polygon) and part.area >= least]


def _on_lining(site: Site, flat: Array) -> Array:
    """World coordinates of points of the unrolled lining, with its relief."""
    u, s = flat[:, 0], np.clip(flat[:, 1], 0.0, site.section.lining)
    y, z = site.section.at(s)
    middle = site.section.centre
    stretch = 1.0 + site.surface.depth(u, s) / np.hypot(y, z - middle)
    return site.axis.world(u, y * stretch, middle + (z - middle) * stretch)


def _geometry(site: Site, parts: list[Polygon]) -> dict[str, Any]:
    """Polygons in 3D, their vertices on the lining."""

    def ring(line: BaseGeometry) -> list[list[float]]:
        flat = np.asarray(segmentize(line, 0.03).coords)
        world = _on_lining(site, flat)
        for _ in range(4):
            wide = np.flatnonzero(np.linalg.norm(np.diff(world, axis=0), axis=1) > 0.045)
            flat = np.insert(flat, wide + 1, 0.5 * (flat[wide] + flat[wide + 1]), axis=0)
            world = _on_lining(site, flat)
        rows: list[list[float]] = np.round(world, 3).tolist()
        return rows

    rings = [[ring(part.exterior), *(ring(hole) for hole in part.interiors)] for part in parts]
    if len(rings) == 1:
        return {"type": "Polygon", "coordinates": rings[0]}
    return {"type": "MultiPolygon", "coordinates": rings}


def _collection(features: list[dict[str, Any]]) -> str:
    crs = {"type": "name", "properties": {"name": f"urn:ogc:def:crs:EPSG::{EPSG}"}}
    return json.dumps({"type": "FeatureCollection", "crs": crs, "features": features})


def _visible(leak: Leak, u: Array, s: Array) -> tuple[BaseGeometry, float]:
    """The leak without what something wider than a hand hides, and the share of it that the scan shows."""
    u0, s0, u1, s1 = leak.outline.bounds
    near = (u > u0 - 0.2) & (u < u1 + 0.2) & (s > s0 - 0.2) & (s < s1 + 0.2)
    step = 0.02
    grid_u, grid_s = np.arange(u0 - 0.06, u1 + 0.08, step), np.arange(s0 - 0.06, s1 + 0.08, step)
    uu, ss = np.meshgrid(grid_u, grid_s, indexing="ij")
    gap, _ = cKDTree(np.column_stack([u[near], s[near]])).query(np.column_stack([uu.ravel(), ss.ravel()]))
    _, inside = signed_distance(leak.outline, grid_u, grid_s)
    seen = float((gap.reshape(uu.shape)[inside] < SEEN).mean())
    deep = (gap > HIDDEN) & inside.ravel()
    if not deep.any():
        return leak.outline, seen
    hidden = unary_union(points(uu.ravel()[deep], ss.ravel()[deep]).tolist()).buffer(HIDDEN)
    return leak.outline.difference(hidden.buffer(0.0)).buffer(0), seen


def write_truth(site: Site, scan: Scan, folder: Path) -> None:
    """Write leaks and what is not."""
    wall: NDArray[np.bool_] = scan.wall
    u, s = scan.u[wall], scan.s[wall]
    features: list[dict[str, Any]] = []
    for leak in site.leaks:
        shape, seen = _visible(leak, u, s)
        parts = _polygons(shape, 0.01)
        if not parts:
            continue
        record: dict[str, Any] = {
            "id": f"L{len(features) + 1:02d}",
            "drop_db": round(leak.drop, 2),
            "phenomenon": leak.phenomenon,
        }
        if seen < 0.35:
            record["limit"] = f"Only {100 * seen:.0f} % of it is visible between what hangs before it."
        features.append({"type": "Feature", "properties": record, "geometry": _geometry(site, parts)})
    (folder / "truth.geojson").write_text(_collection(features))
    wet = MultiPolygon([part for leak in site.leaks for part in _polygons(leak.outline, 0.0)]).buffer(0)
    others = []
    for mark in site.marks:
        parts = _polygons(mark.outline.difference(wet), 0.003)
        if parts:
            record = {"kind": mark.kind, "gain_db": round(mark.gain, 2)}
            others.append({"type": "Feature", "properties": record, "geometry": _geometry(site, parts)})
    (folder / "other.geojson").write_text(_collection(others))
