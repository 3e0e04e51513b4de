"""More of the matrix: files that state something other than what they hold, and ways of doing it wrong."""

from __future__ import annotations

import codecs
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pyogrio.raw
import shapely
from pyproj import CRS

from benchmarks.any_scan import files
from benchmarks.any_scan.judge import Plan, Scene
from benchmarks.any_scan.scan import join, mobile, static
from benchmarks.any_scan.scenes import (
    FOOT,
    POSES,
    TUBE,
    across_kilometres,
    axis_changed,
    axis_file,
    axis_points,
    driven,
    plan,
    reflectance,
    shifted,
    standing,
    with_intensity,
)
from benchmarks.any_scan.tube import Array

Build = Callable[[Path], Plan]

LEGACY_COUNT, BOX, COUNT = 107, 179, 247  # places in a header of LAS
US_FOOT = 1200 / 3937
FEET = r"feet|foot|ftus"
SYSTEM = r"coordinate system|feet|foot|epsg"


def stating(stated: str | dict[int, int], srid: int = files.SRID, scale: tuple[float, float] = (1.0, 1.0)) -> Build:
    """Write the scan with `stated` as its coordinate system; `scale` multiplies plan and heights of its coordinates."""

    def build(folder: Path) -> Plan:
        cloud = static(TUBE)
        other = replace(cloud, xyz=cloud.xyz * [scale[0], scale[0], scale[1]])
        version = "1.4" if isinstance(stated, str) else "1.2"
        files.las(folder / "scan.laz", other, version=version, stated=stated)
        return plan(folder, cloud, tunnel=["--srid", srid, "--axis", "axis.csv"])

    return build


def wkt(code: int | str, form: str = "WKT1_GDAL") -> str:
    return CRS.from_user_input(code).to_wkt(form)


def east_north(code: int) -> str:
    """Return WKT as LAStools writes it: east before north, whatever EPSG says."""
    text, end = wkt(code), f'AUTHORITY["EPSG","{code}"]]'
    assert "AXIS" not in text
    return text.removesuffix(end) + f'AXIS["X",EAST],AXIS["Y",NORTH],{end}'


def unnamed() -> str:
    """Return the system of the tunnel by its parameters only, without a code."""
    return CRS.from_proj4("+proj=utm +zone=32 +ellps=GRS80 +units=m +no_defs").to_wkt("WKT1_GDAL")


def boxed(box: tuple[float, ...] | None, batch: bool = False) -> Build:
    """Write LAS whose header has another box than its points: six numbers, or that of the first metre of points."""

    def build(folder: Path) -> Plan:
        out = across_kilometres("")(folder)
        cloud = static(TUBE)
        files.las(folder / "a.las", cloud)
        s = TUBE.unplace(cloud.xyz)[0]
        first = cloud.xyz[s < 3.0]
        low, high = first.min(axis=0), first.max(axis=0)
        values = box or tuple(value for pair in zip(high, low, strict=True) for value in pair)
        files.patch(folder / "a.las", BOX, "6d", *values)
        out.files, out.batch = ["a.las"], batch
        return out

    return build


def counted(change: Callable[[int], int]) -> Build:
    """Write LAS 1.4 whose header counts its points in the field of 64 bits otherwise."""

    def build(folder: Path) -> Plan:
        cloud = static(TUBE)
        path = files.las(folder / "scan.las", cloud, point_format=3)
        files.patch(path, LEGACY_COUNT, "I", len(cloud))
        files.patch(path, COUNT, "Q", change(len(cloud)))
        return plan(folder, cloud, name="scan.las")

    return build


def cut(folder: Path) -> Plan:
    """Write an uncompressed LAS file without its last 40 %, as after an interrupted copy."""
    cloud = static(TUBE, density=300)
    path = files.las(folder / "scan.las", cloud)
    data = path.read_bytes()
    path.write_bytes(data[: len(data) * 6 // 10])
    return plan(folder, cloud, name="scan.las")


def standing_before_and_after(by: float, *more: Any) -> Build:
    """Drive with a stop of a minute before and after, so that each time has a pose; the trajectory's times are off by `by`."""

    def build(folder: Path) -> Plan:
        out = driven(lambda poses: _waiting(poses, by))(folder)
        out.survey += more
        return out

    return build


def _waiting(poses: Array, by: float) -> Array:
    wait = np.arange(1.0, 60.0)
    before = np.column_stack([poses[0, 0] - wait[::-1], np.repeat(poses[:1, 1:], len(wait), axis=0)])
    after = np.column_stack([poses[-1, 0] + wait, np.repeat(poses[-1:, 1:], len(wait), axis=0)])
    return shifted(by)(np.vstack([before, poses, after]))


def rollover(folder: Path) -> Plan:
    """Seconds of the GPS week begin anew in the middle, in scan and trajectory alike."""
    week = 604800.0
    cloud = mobile(TUBE, start=week - 12.0)
    cloud.time = np.mod(cloud.time, week)
    out = plan(folder, cloud)
    poses = cloud.poses.copy()
    poses[:, 0] = np.mod(poses[:, 0], week)
    files.trajectory(folder / "poses.csv", poses)
    return out


def scaled(factor: float) -> Callable[[Array], Array]:
    return lambda poses: poses * [1.0, factor, factor, factor]


def timed(change: Callable[[Array], Array]) -> Build:
    """Change the times of the trajectory."""
    return driven(lambda poses: np.column_stack([change(poses[:, 0]), poses[:, 1:]]))


def one_place(poses: Array) -> Array:
    poses[:, 1:] = poses[0, 1:]
    return poses


def exchanged(poses: Array) -> Array:
    poses[[0, 1], 1:] = poses[[1, 0], 1:]
    return poses


def identity(folder: Path) -> Plan:
    """PTX with points in the frame of the project, and each scanner's position in line 3 of its header only."""
    cloud = static(TUBE)
    with (folder / "scan.ptx").open("w") as out:
        for number, *pose in cloud.poses:
            which = np.flatnonzero(cloud.scan == number)
            which = which[: len(which) // 100 * 100]
            table = np.column_stack([cloud.xyz[which], files.counts(cloud.db[which]) / 65535])
            out.write(f"{len(which) // 100}\n100\n{pose[0]:.4f} {pose[1]:.4f} {pose[2]:.4f}\n1 0 0\n0 1 0\n0 0 1\n")
            out.write("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")
            np.savetxt(out, table, fmt="%.4f %.4f %.4f %.6f")
    words = ["--intensity", "intensity", "--intensity-kind", "linear"]
    return plan(folder, cloud, name="scan.ptx", poses=["--stations", "scan.ptx"], intensity=words)


def text(change: Callable[[bytes], bytes], name: str = "scan.csv", delimiter: str = ",") -> Build:
    def build(folder: Path) -> Plan:
        cloud = static(TUBE)
        files.table(folder / name, cloud, delimiter)
        (folder / name).write_bytes(change((folder / name).read_bytes()))
        return plan(folder, cloud, name=name)

    return build


def not_numbers(data: bytes) -> bytes:
    """Replace every thousandth intensity as the C library of Windows prints NaN."""
    lines = data.split(b"\n")
    for k in range(1, len(lines) - 1, 1000):
        cells = lines[k].split(b",")
        lines[k] = b",".join([*cells[:3], b"-nan(ind)", *cells[4:]])
    return b"\n".join(lines)


def european_stations(folder: Path) -> Plan:
    out = standing(lambda poses: poses)(folder)
    path = folder / "poses.csv"
    path.write_bytes(codecs.BOM_UTF8 + path.read_bytes().replace(b",", b";").replace(b".", b","))
    return out


def lone_shp(path: Path, points: Array) -> None:
    files.line(path, points, "ESRI Shapefile")
    for other in path.parent.glob(f"{path.stem}.*"):
        if other != path:
            other.unlink()


def empty_rows(path: Path, points: Array) -> None:
    """Write a layer with a row without geometry, a row with an empty line, and the line."""
    wanted = shapely.to_wkb(shapely.LineString(points), output_dimension=3)
    geometry = np.array([None, shapely.to_wkb(shapely.LineString()), wanted], dtype=object)
    pyogrio.raw.write(
        path, geometry, [], fields=[], driver="GPKG", layer="line", geometry_type="LineString Z", crs=f"EPSG:{files.SRID}"
    )


def splined(path: Path, points: Array) -> None:
    """Write a polyline with the vertices of its spline's frame, as PEDIT leaves it."""
    drawing = ezdxf.new("R2010", units=6)
    line = drawing.modelspace().add_polyline3d([], dxfattribs={"layer": "AXIS"})
    line.dxf.flags |= 4
    side = np.where(np.arange(len(points)) % 2, 1.5, -1.5)[:, None] * [0.6, -0.6, 0.0]
    line.append_vertices((points + side).tolist(), dxfattribs={"flags": 16 | 32})
    line.append_vertices(points.tolist(), dxfattribs={"flags": 8 | 32})
    drawing.saveas(path)


def dxf_in_feet(path: Path, points: Array) -> None:
    drawing = ezdxf.new("R2010", units=2)
    drawing.modelspace().add_polyline3d((points / FOOT).tolist(), dxfattribs={"layer": "AXIS"})
    drawing.saveas(path)


def scan_changed(change: Callable[[Array], Array], srid: int | None = files.SRID) -> Build:
    """Write the scan with other coordinates than axis and stations have."""

    def build(folder: Path) -> Plan:
        cloud = static(TUBE)
        moved = replace(cloud, xyz=change(cloud.xyz.copy()))
        files.las(folder / "scan.laz", moved, srid=srid)
        return plan(folder, cloud)

    return build


def all_millimetres(folder: Path) -> Plan:
    """Scan, stations and axis are in millimetres, and no file says so."""
    cloud = static(TUBE)
    files.las(folder / "scan.laz", replace(cloud, xyz=cloud.xyz * 1000), srid=None)
    out = plan(folder, cloud)
    files.stations(folder / "poses.csv", scaled(1000.0)(cloud.poses))
    files.axis(folder / "axis.csv", axis_points(TUBE) * 1000)
    out.unit = 0.001
    return out


def two_tunnels(folder: Path) -> Plan:
    """One file of two tunnels 300 m apart, whose scans have the same numbers."""
    cloud = static(TUBE)
    other = replace(cloud, xyz=cloud.xyz + np.array([210.0, 210.0, 0.0]))
    files.las(folder / "scan.laz", join(cloud, other))
    return plan(folder, cloud)


def numbered_anew(folder: Path) -> Plan:
    """Two scans merged in one file, whose numbers both begin with 1: points of the second are given the poses of the first."""
    cloud = static(TUBE, spacing=6.0)
    first = cloud.scan <= 2
    cloud.scan = np.where(first, cloud.scan, cloud.scan - 2)
    out = plan(folder, cloud)
    files.stations(folder / "poses.csv", cloud.poses[:2])
    return out


STATED: tuple[Scene, ...] = (
    # Coordinate systems, written otherwise.
    Scene("crs-northing-first", "northing first by EPSG, east first in the file", "result", stating(east_north(31256), 31256)),
    Scene("crs-esri", "the system in WKT of ESRI", "result", stating(wkt(files.SRID, "WKT1_ESRI"))),
    Scene("crs-keys", "the system as GeoTIFF keys of LAS 1.2", "result", stating({1024: 1, 3072: files.SRID, 3076: 9001})),
    Scene("crs-compound", "with a system of heights in metres", "result", stating(wkt(f"EPSG:{files.SRID}+7837"))),
    Scene("crs-unnamed", "the system by its parameters, without a code", "result", stating(unnamed())),
    Scene(
        "crs-unreadable",
        "text that is no coordinate system",
        "warning",
        stating('PROJCS["broken",GEOGCS['),
        r"can ?not be read|can't be read|unreadable",
    ),
    Scene(
        "heights-in-feet",
        "heights in feet, as the file's compound system says, under a plan in metres",
        "refusal",
        stating(wkt(f"EPSG:{files.SRID}+6360"), scale=(1.0, 1 / US_FOOT)),
        FEET,
    ),
    Scene(
        "keys-in-feet",
        "GeoTIFF keys of a metric system with the unit US survey foot, coordinates in feet",
        "refusal",
        stating({1024: 1, 3072: files.SRID, 3076: 9003}, scale=(1 / US_FOOT, 1 / US_FOOT)),
        FEET,
    ),
    Scene(
        "state-plane-feet",
        "a system of the United States in feet, coordinates in feet",
        "refusal",
        stating(wkt(2263), scale=(1 / US_FOOT, 1 / US_FOOT)),
        SYSTEM,
    ),
    # Headers.
    Scene("box-small", "box of the header spans the first 3 of 24 m, over two kilometres", "result|warning", boxed(None)),
    Scene("box-small-batch", "the same by batch", "result|warning", boxed(None, True)),
    Scene("box-zero", "box of the header is all zero", "result|warning", boxed((0.0,) * 6)),
    Scene("box-zero-batch", "the same by batch", "result|warning", boxed((0.0,) * 6, True)),
    Scene("count-legacy", "number of points in the legacy field only", "result|refusal", counted(lambda n: 0), r"points"),
    Scene("count-half", "header counts half of the points", "warning|refusal", counted(lambda n: n // 2), r"points|count", 0),
    Scene("clipped-las", "LAS without its last 40 %", "refusal", cut, r"scan\.las"),
    # Times.
    Scene(
        "utc",
        "trajectory in UTC, 18 s off; the trolley stood before and after",
        "warning|refusal",
        standing_before_and_after(-18.0),
        r"18 ?s|utc|time",
        0,
    ),
    Scene("tai", "trajectory 19 s off the other way", "warning|refusal", standing_before_and_after(19.0), r"time", 0),
    Scene("week-rollover", "seconds of the GPS week begin anew in scan and trajectory", "result|refusal", rollover, r"week"),
    Scene("nanoseconds", "times of the trajectory in nanoseconds", "refusal", timed(lambda t: t * 1e9), r"time|nanosecond"),
    Scene(
        "day-seconds", "trajectory in seconds of the day, scan of the week", "refusal", timed(lambda t: t - 172800.0), r"time"
    ),
    # Stations.
    Scene("stations-one-place", "all stations at one place", "warning|refusal", standing(one_place), POSES, 0),
    Scene("stations-exchanged", "two of three stations exchanged", "warning|refusal", standing(exchanged), POSES, 0),
    Scene("stations-feet", "stations in feet, scan in metres", "refusal", standing(scaled(1 / FOOT)), POSES),
    Scene("numbered-anew", "two scans in one file, numbers of both begin with 1", "warning|refusal", numbered_anew, POSES, 0),
    Scene(
        "ptx-identity",
        "PTX with identity matrices, positions in the header",
        "result|warning|refusal",
        identity,
        r"matri|pos|curve|reference",
        0,
    ),
    # Tables.
    Scene(
        "bom",
        "table with a byte order mark and CRLF",
        "result",
        text(lambda data: codecs.BOM_UTF8 + data.replace(b"\n", b"\r\n")),
    ),
    Scene(
        "decimal-comma",
        "table with tabs and decimal commas",
        "result|refusal",
        text(lambda data: data.replace(b".", b","), "scan.txt", "\t"),
        r"comma|decimal",
    ),
    Scene("nan-ind", "0.1 % of the intensities are -nan(ind)", "warning", text(not_numbers), r"nan\b|left out|no number"),
    Scene("stations-european", "stations with semicolons, decimal commas and a byte order mark", "result", european_stations),
    # Axes.
    Scene("shp-alone", "only the .shp of a Shapefile", "refusal", axis_file(lone_shp, "line.shp"), r"shx"),
    Scene("gpkg-empty", "GeoPackage with rows without geometry", "result", axis_file(empty_rows, "line.gpkg")),
    Scene("dxf-spline", "DXF polyline with the frame of its spline", "result", axis_file(splined, "axis.dxf")),
    # Templates of drawings state feet or inches by default, also for drawings in metres. A result would rest on a guess. Right
    # is a refusal that names the option for each of the two.
    Scene(
        "dxf-feet",
        "DXF that states feet, in feet",
        "refusal",
        axis_file(dxf_in_feet, "axis.dxf"),
        r"--axis-unit foot.*--axis-unit meter",
    ),
    Scene(
        "axis-swapped",
        "axis with east and north swapped",
        "refusal",
        axis_changed(lambda p: p[:, [1, 0, 2]]),
        r"axis|outside|swapped",
    ),
    Scene(
        "axis-other",
        "axis of another tunnel, 3 km away",
        "refusal",
        axis_changed(lambda p: p + np.array([2100.0, -2100.0, 0])),
        r"axis",
    ),
    Scene("axis-millimetres", "axis in millimetres", "refusal", axis_changed(lambda p: p * 1000), r"axis|millimet"),
    # Scans.
    Scene(
        "scan-swapped",
        "scan with east and north swapped",
        "refusal",
        scan_changed(lambda p: p[:, [1, 0, 2]]),
        r"swapped|axis|outside",
    ),
    Scene(
        "scan-thousandfold",
        "scan, stations and axis in millimetres, no coordinate system",
        "warning|refusal",
        all_millimetres,
        r"millimet|\bmm\b",
        0,
    ),
    Scene("two-tunnels", "two tunnels 300 m apart in one file", "result|warning", two_tunnels),
    # Intensity of another kind.
    Scene(
        "reflectance-as-amplitude",
        "reflectance declared amplitude",
        "warning|refusal",
        with_intensity(reflectance, "amplitude", "Reflectance"),
        r"reflectance|range",
        0,
    ),
    Scene(
        "amplitude-as-reflectance",
        "amplitude declared reflectance",
        "warning|refusal",
        with_intensity(lambda c: c.db, "reflectance"),
        r"amplitude|range",
        0,
    ),
    Scene(
        "eight-bits",
        "8-bit grey values declared amplitude",
        "warning|refusal",
        with_intensity(lambda c: np.clip((c.db - 20) * 8, 0, 255).round(), "amplitude", "Grey"),
        r"\bdb\b|8.bit|counts|whole|linear",
        0,
    ),
)
