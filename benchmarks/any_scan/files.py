"""Files of scans, axes and tables, written as other programs write them."""

from __future__ import annotations

import csv
import struct
from pathlib import Path
from typing import Any

import ezdxf
import laspy
import numpy as np
import pyogrio.raw
import shapely
from pyproj import CRS

from benchmarks.any_scan.scan import LEVEL, Cloud, law
from benchmarks.any_scan.tube import Array

SRID = 25832


def las(
    path: Path,
    cloud: Cloud,
    *,
    version: str = "1.4",
    point_format: int | None = None,
    srid: int | None = SRID,
    stated: str | dict[int, int] | None = None,
    scans: bool = True,
    times: bool = True,
) -> Path:
    """Write LAS or LAZ: ``Amplitude`` in dB, what `cloud.extra` holds, and counts as ``intensity``.

    Its coordinate system is that of `srid`, or as `stated`: WKT, or numbers of GeoTIFF keys.
    """
    header = laspy.LasHeader(version=version, point_format=point_format or (6 if version == "1.4" else 1))
    header.offsets = np.floor(cloud.xyz.min(axis=0)) if len(cloud) else [0, 0, 0]
    header.scales = [0.0005] * 3
    dimensions = {"Amplitude": cloud.db} | cloud.extra
    for name in dimensions:
        if name != "intensity":
            header.add_extra_dim(laspy.ExtraBytesParams(name, "f4"))
    if stated is not None:
        header.vlrs.append(_projection(stated))
        header.global_encoding.wkt = isinstance(stated, str)
    elif srid is not None:
        header.add_crs(CRS.from_epsg(srid))
    data = laspy.LasData(header)
    data.x, data.y, data.z = cloud.xyz.T
    data.intensity = counts(cloud.db)
    for name, values in dimensions.items():
        data[name] = values
    if times:
        data.gps_time = cloud.time
    if scans:
        data.point_source_id = cloud.scan
    data.write(path)
    return path


def _projection(stated: str | dict[int, int]) -> laspy.VLR:
    if isinstance(stated, str):
        return laspy.VLR("LASF_Projection", 2112, "", stated.encode() + b"\0")
    keys = [value for key, number in sorted(stated.items()) for value in (key, 0, 1, number)]
    return laspy.VLR("LASF_Projection", 34735, "", struct.pack(f"<{4 + len(keys)}H", 1, 1, 0, len(stated), *keys))


def patch(path: Path, at: int, form: str, *values: float) -> Path:
    """Write numbers over the bytes of a file, from `at` on."""
    data = bytearray(path.read_bytes())
    struct.pack_into("<" + form, data, at, *values)
    path.write_bytes(data)
    return path


def counts(db: Array) -> np.ndarray:
    """Return linear counts of 16 bits."""
    return np.clip(np.nan_to_num(10 ** ((db - LEVEL + 20) / 10) * 2000), 0, 65535).astype(np.uint16)


def ptx(path: Path, cloud: Cloud) -> Path:
    """Write a block for each scan, points about the scanner, as a grid with empty rays."""
    with path.open("w") as out:
        for number, *pose in cloud.poses:
            which = np.flatnonzero(cloud.scan == number)
            rows = 100
            columns = -(-len(which) // rows)
            table = np.zeros((rows * columns, 4))
            table[: len(which), :3] = cloud.xyz[which] - pose
            table[: len(which), 3] = counts(cloud.db[which]) / 65535
            table[len(which) :, 3] = 0.5
            out.write(f"{columns}\n{rows}\n{pose[0]:.4f} {pose[1]:.4f} {pose[2]:.4f}\n1 0 0\n0 1 0\n0 0 1\n")
            out.write(f"1 0 0 0\n0 1 0 0\n0 0 1 0\n{pose[0]:.4f} {pose[1]:.4f} {pose[2]:.4f} 1\n")
            np.savetxt(out, table, fmt="%.4f %.4f %.4f %.6f")
    return path


def pts(path: Path, cloud: Cloud) -> Path:
    with path.open("w") as out:
        out.write(f"{len(cloud)}\n")
        np.savetxt(out, np.column_stack([cloud.xyz, cloud.db]), fmt="%.4f %.4f %.4f %.3f")
    return path


def table(path: Path, cloud: Cloud, delimiter: str = ",") -> Path:
    """Write a table with named columns."""
    with path.open("w") as out:
        out.write(delimiter.join(["x", "y", "z", "Amplitude", "scan_id"]) + "\n")
        rows = np.column_stack([cloud.xyz, cloud.db, cloud.scan])
        np.savetxt(out, rows, fmt=delimiter.join(["%.4f"] * 3 + ["%.3f", "%d"]))
    return path


def ply(path: Path, cloud: Cloud) -> Path:
    """Write binary PLY with doubles."""
    kind = np.dtype([("x", "<f8"), ("y", "<f8"), ("z", "<f8"), ("Amplitude", "<f4"), ("scan_id", "<i4")])
    rows = np.empty(len(cloud), kind)
    rows["x"], rows["y"], rows["z"] = cloud.xyz.T
    rows["Amplitude"], rows["scan_id"] = cloud.db, cloud.scan
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(cloud)}"]
    head += ["property double x", "property double y", "property double z", "property float Amplitude", "property int scan_id"]
    path.write_bytes(("\n".join([*head, "end_header"]) + "\n").encode() + rows.tobytes())
    return path


def e57(path: Path, cloud: Cloud) -> Path:
    """Write a scan for each pose, with linear intensities."""
    import pye57

    out = pye57.E57(str(path), mode="w")
    for number, *pose in cloud.poses:
        which = cloud.scan == number
        local = cloud.xyz[which] - pose
        data = dict(zip(("cartesianX", "cartesianY", "cartesianZ"), np.ascontiguousarray(local.T), strict=True))
        data["intensity"] = counts(cloud.db[which]).astype(float) / 65535
        out.write_scan_raw(data, name=f"scan {int(number)}", rotation=np.array([1.0, 0, 0, 0]), translation=np.array(pose))
    out.close()
    return path


def rows(path: Path, header: list[str], values: Any, delimiter: str = ",") -> Path:
    """Write a table of numbers as they print."""
    with path.open("w", newline="") as out:
        writer = csv.writer(out, delimiter=delimiter)
        writer.writerow(header)
        writer.writerows([[repr(float(v)) if isinstance(v, float) else v for v in row] for row in values])
    return path


def stations(path: Path, poses: Array) -> Path:
    return rows(path, ["scan_id", "x", "y", "z"], [[int(p[0]), *map(float, p[1:])] for p in poses])


def trajectory(path: Path, poses: Array) -> Path:
    return rows(path, ["time", "x", "y", "z"], poses.tolist())


def axis(path: Path, points: Array, delimiter: str = ",") -> Path:
    return rows(path, ["x", "y", "z"], points.tolist(), delimiter)


def reference(path: Path, near: float = 0.5, far: float = 40.0) -> Path:
    """Write what a target looked at straight on gives over range."""
    distance = np.geomspace(near, far, 40)
    return rows(path, ["range_m", "intensity_db"], np.column_stack([distance, law(distance)]).tolist())


def dxf(path: Path, points: Array) -> Path:
    drawing = ezdxf.new("R2010", units=6)
    drawing.modelspace().add_polyline3d(points.tolist(), dxfattribs={"layer": "AXIS"})
    drawing.saveas(path)
    return path


def line(path: Path, points: Array, driver: str, srid: int | None = SRID) -> Path:
    """Write a line as GeoPackage, Shapefile or GeoJSON, by `driver`."""
    geometry = np.array([shapely.to_wkb(shapely.LineString(points), output_dimension=3)], dtype=object)
    crs = None if srid is None else f"EPSG:{srid}"
    pyogrio.raw.write(path, geometry, [], fields=[], driver=driver, layer=path.stem, geometry_type="LineString Z", crs=crs)
    return path


def landxml(path: Path, points: Array) -> Path:
    """Write an alignment of one line with a profile of two points, and no unit."""
    (x0, y0, z0), (x1, y1, z1) = points[0], points[-1]
    length = float(np.hypot(x1 - x0, y1 - y0))
    path.write_text(
        f"""<?xml version="1.0"?>
<LandXML xmlns="http://www.landxml.org/schema/LandXML-1.2" version="1.2"><Alignments><Alignment name="A" length="{length:.4f}"
staStart="0"><CoordGeom><Line length="{length:.4f}"><Start>{y0:.4f} {x0:.4f}</Start>
<End>{y1:.4f} {x1:.4f}</End></Line></CoordGeom>
<Profile name="P"><ProfAlign name="P"><PVI>0 {z0:.4f}</PVI><PVI>{length:.4f} {z1:.4f}</PVI></ProfAlign></Profile>
</Alignment></Alignments></LandXML>"""
    )
    return path


def las_degrees(path: Path, xyz: Array, cloud: Cloud) -> Path:
    """Write LAZ in longitude and latitude."""
    header = laspy.LasHeader(version="1.4", point_format=6)
    header.offsets, header.scales = [0, 0, 0], [1e-7, 1e-7, 0.001]
    header.add_extra_dim(laspy.ExtraBytesParams("Amplitude", "f4"))
    header.add_crs(CRS.from_epsg(4326))
    data = laspy.LasData(header)
    data.x, data.y, data.z = xyz.T
    data["Amplitude"], data.point_source_id = cloud.db, cloud.scan
    data.write(path)
    return path
