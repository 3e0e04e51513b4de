"""The files which a surveyor hands over, and the truth."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import laspy
import numpy as np
from pyproj import CRS

from .scanners import Profiler, Stations
from .survey import Build, Cloud, scan
from .truth import Outline, leak_outlines, length_of, on_lining, stain_outlines

_CRS = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::25832"}}


def _write_scan(path: Path, build: Build, cloud: Cloud) -> None:
    order = np.argsort(cloud.time, kind="stable")
    xyz = build.tunnel.alignment.to_national(cloud.site[order])
    header = laspy.LasHeader(version="1.4", point_format=6)
    header.add_crs(CRS.from_epsg(25832))
    header.add_extra_dim(laspy.ExtraBytesParams("Amplitude", np.float32, "dB"))
    header.scales = np.full(3, 0.0005)
    header.offsets = np.floor(xyz.min(axis=0))
    las = laspy.LasData(header)
    las.x, las.y, las.z = xyz.T
    las.Amplitude = cloud.amplitude[order].astype(np.float32)
    las.gps_time = cloud.time[order]
    las.point_source_id = cloud.source[order].astype(np.uint16)
    las.return_number = np.ones(order.size, np.uint8)
    las.number_of_returns = np.ones(order.size, np.uint8)
    las.write(path)


def _write_table(path: Path, head: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(head)
        writer.writerows(rows)


def _write_outlines(path: Path, build: Build, outlines: list[Outline]) -> None:
    features = [
        {
            "type": "Feature",
            "properties": outline.properties,
            "geometry": {"type": "MultiPolygon", "coordinates": on_lining(build, outline.shape)},
        }
        for outline in outlines
    ]
    collection = {"type": "FeatureCollection", "crs": _CRS, "features": features}
    path.write_text(json.dumps(collection), encoding="utf-8")


def _write_place(folder: Path, build: Build) -> None:
    """Axis, and stations or trajectory."""
    alignment, scanner = build.tunnel.alignment, build.scanner
    s = length_of(build.tunnel.canvas, 2.0 if alignment.curvature else 5.0)
    axis = alignment.to_national(alignment.to_site(s, np.zeros(s.size), np.full(s.size, build.axis_height)))
    _write_table(folder / "axis.csv", ("x", "y", "z"), ([f"{value:.4f}" for value in row] for row in axis))
    if isinstance(scanner, Stations):
        local = np.array(scanner.places)
        places = alignment.to_national(alignment.to_site(*local.T))
        rows = ([str(number), *(f"{value:.4f}" for value in row)] for number, row in enumerate(places, start=1))
        _write_table(folder / "stations.csv", ("scan_id", "x", "y", "z"), rows)
    elif isinstance(scanner, Profiler):
        time, site = scanner.trajectory(build.tunnel)
        places = alignment.to_national(site)
        rows = ([f"{at:.3f}", *(f"{value:.4f}" for value in row)] for at, row in zip(time, places, strict=True))
        _write_table(folder / "trajectory.csv", ("time", "x", "y", "z"), rows)


def write(build: Build, folder: Path) -> None:
    """Scan, and write all files."""
    cloud = scan(build)
    _write_scan(folder / "scan.laz", build, cloud)
    _write_place(folder, build)
    if build.has_reference:
        curve = build.instrument.reference(np.random.default_rng(build.seed + 1), 25.0, -2.0)
        _write_table(folder / "reference.csv", ("range_m", "intensity_db"), ([f"{r:.2f}", f"{v:.3f}"] for r, v in curve))
    _write_outlines(folder / "truth.geojson", build, leak_outlines(build, cloud))
    _write_outlines(folder / "other.geojson", build, stain_outlines(build))


def maker(make: Callable[[], Build]) -> Callable[[Path], None]:
    """What a scene calls with its folder."""

    def to_folder(folder: Path) -> None:
        write(make(), folder)

    return to_folder
