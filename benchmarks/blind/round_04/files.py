"""The files that a surveyor hands over, and the truth."""

from __future__ import annotations

import json
from pathlib import Path

import laspy
import numpy as np
import pyproj
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from .geometry import Array, Axis, Section
from .optics import Law
from .sheet import Mark, Sheet, outline
from .trace import Profiler, Static

CRS = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::25832"}}


def _table(path: Path, head: str, rows: Array, form: str) -> None:
    np.savetxt(path, rows, fmt=form, delimiter=",", header=head, comments="")


def write_cloud(path: Path, axis: Axis, cloud: dict[str, Array]) -> None:
    """Write the points."""
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.add_crs(pyproj.CRS.from_epsg(25832))
    header.add_extra_dim(laspy.ExtraBytesParams(name="Amplitude", type=np.float32, description="dB"))
    xyz = axis.to_map(cloud["xyz"])
    header.scales, header.offsets = np.full(3, 0.0005), np.floor(xyz.min(axis=0))
    las = laspy.LasData(header)
    las.x, las.y, las.z = xyz.T
    las.gps_time = cloud["time"]
    las.point_source_id = cloud["station"].astype(np.uint16)
    las.return_number = np.ones(len(xyz), np.uint8)
    las.number_of_returns = np.ones(len(xyz), np.uint8)
    las["Amplitude"] = cloud["amplitude"].astype(np.float32)
    las.write(str(path))


def write_axis(path: Path, axis: Axis, length: float) -> None:
    """Write the axis, 2 m apart, some metres beyond both ends of the scan."""
    s = np.arange(-2.0, length + 2.1, 2.0)
    _table(path, "x,y,z", axis.to_map(axis.place(s, 0 * s, 0 * s)), "%.4f")


def write_stations(path: Path, axis: Axis, scan: Static) -> None:
    """Write where the scanner stood."""
    xyz = axis.to_map(axis.place(*np.array(scan.stations).T))
    _table(path, "scan_id,x,y,z", np.column_stack([np.arange(1, len(xyz) + 1), xyz]), "%.4f")
    path.write_text("\n".join(line.replace(".0000,", ",", 1) for line in path.read_text().splitlines()) + "\n")


def write_trajectory(path: Path, axis: Axis, scan: Profiler, length: float) -> None:
    """Write the scanner's way, ten times a second."""
    s = np.arange(-0.5, length + 0.5, scan.speed / 10)
    u, v = scan.path(s)
    _table(path, "time,x,y,z", np.column_stack([500.0 + s / scan.speed, axis.to_map(axis.place(s, u, v))]), "%.4f")


def write_reference(path: Path, law: Law, rng: np.random.Generator) -> None:
    """Write the amplitude of a white target over range."""
    r = np.r_[np.arange(1.0, 8.0, 0.25), np.arange(8.0, 26.1, 0.5)]
    _table(
        path,
        "range_m,intensity_db",
        np.column_stack([r, law.constant + law.range_term(r) + rng.normal(0, 0.05, len(r))]),
        "%.3f",
    )


def write_truth(folder: Path, axis: Axis, section: Section, sheet: Sheet, leaks: list[tuple[Mark, NDArray[np.bool_]]]) -> None:
    """Write leaks, and what is dark but dry or bright."""
    rows, wet = [], []
    for mark, mask in leaks:
        shape = outline(mark, sheet, mask)
        if shape.is_empty:
            continue
        wet.append(shape)
        facts: dict[str, object] = {"id": len(wet), "drop_db": round(sheet.mean_drop(mark), 1), "phenomenon": mark.stain.kind}
        if mark.stain.limit:
            facts["limit"] = mark.stain.limit
        rows.append(_feature(shape, facts, axis, section, sheet))
    _collection(folder / "truth.geojson", rows)
    water = shapely.union_all(wet)
    dry = []
    for mark in sheet.dry:
        shape = outline(mark, sheet, mark.mask).difference(water)
        shape = shapely.union_all([p for p in shapely.get_parts(shape) if p.geom_type == "Polygon" and p.area > 0.004])
        if not shape.is_empty:
            dry.append(_feature(shape, {"kind": mark.stain.kind, "change_db": -mark.stain.db}, axis, section, sheet))
    _collection(folder / "other.geojson", dry)


def _feature(shape: BaseGeometry, facts: dict[str, object], axis: Axis, section: Section, sheet: Sheet) -> dict[str, object]:
    def ring(line: BaseGeometry) -> list[list[float]]:
        s, l = np.array(shapely.segmentize(line, 0.045).coords).T  # noqa: E741
        p, n = section.at(l)
        out = sheet.sample(sheet.relief, s, l)
        xyz = axis.to_map(axis.place(s, p[:, 0] - out * n[:, 0], p[:, 1] - out * n[:, 1]))
        return [[round(float(x), 4) for x in q] for q in xyz]

    polygons = [[ring(p.exterior), *(ring(h) for h in p.interiors)] for p in shapely.get_parts(shape)]
    geometry: dict[str, object] = {"type": "MultiPolygon", "coordinates": polygons}
    if len(polygons) == 1:
        geometry = {"type": "Polygon", "coordinates": polygons[0]}
    return {"type": "Feature", "properties": facts, "geometry": geometry}


def _collection(path: Path, features: list[dict[str, object]]) -> None:
    text = {"type": "FeatureCollection", "name": path.stem, "crs": CRS, "features": features}
    path.write_text(json.dumps(text), encoding="utf-8")
