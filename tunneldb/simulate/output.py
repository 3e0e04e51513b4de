"""Files of a synthetic survey: LAZ, poses, reference curve, axis and reference data."""

from __future__ import annotations

import json
import math
import shutil
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, BinaryIO

import laspy
import numpy as np
from shapely.geometry import mapping

import tunneldb
from tunneldb.arrays import Float
from tunneldb.errors import UserError
from tunneldb.files import disk_full_as_oserror, made_folder
from tunneldb.simulate.generate import Cloud, Simulation
from tunneldb.simulate.ring_truth import write_ring_truth
from tunneldb.simulate.truth import leaks_as_built, write_truth

# Resolution of the stored coordinates, m; as scanner makers export.
SCALE = 0.00025
AXIS_SPACING = 20.0
# A fixed date, so that the same seed gives the same bytes.
CREATED = date(2024, 5, 4)

TRUTH: dict[str, np.dtype[Any]] = {
    "chainage": np.dtype(np.float64),
    "arc": np.dtype(np.float32),
    "offset": np.dtype(np.float32),
    "klass": np.dtype(np.uint8),
    "leak": np.dtype(np.int32),
}
# Only with free-standing objects.
THING = {"thing": np.dtype(np.uint16)}
TRUTH_NAMES = {"klass": "class"}


@dataclass
class Files:
    """Files written by :func:`write`."""

    clouds: list[Path] = field(default_factory=list)
    truth: list[Path] = field(default_factory=list)
    axis: Path = Path()
    poses: Path = Path()
    reference: Path = Path()
    leaks: Path = Path()
    lining: Path = Path()
    parameters: Path = Path()
    rings: Path | None = None
    spheres: Path | None = None
    points: int = 0

    def moved(self, folder: Path) -> Files:
        """Move the files to another folder of the same disk."""

        def to(path: Path) -> Path:
            return path.replace(folder / path.name)

        return Files(
            clouds=[to(p) for p in self.clouds],
            truth=[to(p) for p in self.truth],
            axis=to(self.axis),
            poses=to(self.poses),
            reference=to(self.reference),
            leaks=to(self.leaks),
            lining=to(self.lining),
            parameters=to(self.parameters),
            rings=None if self.rings is None else to(self.rings),
            spheres=None if self.spheres is None else to(self.spheres),
            points=self.points,
        )


class _TruthWriter:
    """Writer of the columns of reference data to an .npz file, without keeping them in memory."""

    def __init__(self, path: Path, scratch: Path, columns: dict[str, np.dtype[Any]]) -> None:
        self.path = path
        self.columns = columns
        self.count = 0
        self.files: dict[str, BinaryIO] = {n: (scratch / f"{path.name}.{n}").open("w+b") for n in columns}

    def add(self, cloud: Cloud) -> None:
        self.count += len(cloud)
        for name, dtype in self.columns.items():
            getattr(cloud, name).astype(dtype, copy=False).tofile(self.files[name])

    def close(self) -> None:
        with zipfile.ZipFile(self.path, "w", zipfile.ZIP_STORED) as archive:
            for name, dtype in self.columns.items():
                source = self.files[name]
                source.flush()
                source.seek(0)
                info = zipfile.ZipInfo(f"{TRUTH_NAMES.get(name, name)}.npy")
                with archive.open(info, "w", force_zip64=True) as target:
                    header: dict[str, Any] = {
                        "descr": np.lib.format.dtype_to_descr(dtype),
                        "fortran_order": False,
                        "shape": (self.count,),
                    }
                    np.lib.format.write_array_header_1_0(target, header)
                    shutil.copyfileobj(source, target, 1 << 22)
                source.close()


def _header(simulation: Simulation) -> laspy.LasHeader:
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.add_extra_dims(
        [
            laspy.ExtraBytesParams("Amplitude", np.float32, "echo amplitude, dB"),
            laspy.ExtraBytesParams("Reflectance", np.float32, "without range, dB"),
        ]
    )
    header.add_crs(simulation.parameters.crs())
    header.scales = np.full(3, SCALE)
    header.offsets = np.floor(simulation.tunnel.line.origin)
    header.generating_software = f"tunneldb {tunneldb.__version__} simulate"
    header.system_identifier = "SIMULATION"
    header.creation_date = CREATED
    return header


def _record(header: laspy.LasHeader, cloud: Cloud) -> laspy.ScaleAwarePointRecord:
    record = laspy.ScaleAwarePointRecord.zeros(len(cloud), header=header)
    cells = np.rint((cloud.xyz - header.offsets) / header.scales)
    if np.abs(cells).max(initial=0.0) >= 2**31:
        raise UserError("the tunnel is too long for one coordinate offset in LAS; make it shorter than 500 km")
    for i, name in enumerate("XYZ"):
        record[name] = cells[:, i].astype(np.int32)
    record["intensity"] = cloud.intensity
    record["return_number"] = np.ones(len(cloud), dtype=np.uint8)
    record["number_of_returns"] = np.ones(len(cloud), dtype=np.uint8)
    record["point_source_id"] = cloud.scan_id
    record["gps_time"] = cloud.time
    record["Amplitude"] = cloud.amplitude
    record["Reflectance"] = cloud.reflectance
    return record


def _csv(path: Path, columns: str, rows: Float, formats: list[str]) -> Path:
    np.savetxt(path, rows, fmt=formats, delimiter=",", header=columns, comments="")
    return path


def _spheres(simulation: Simulation, path: Path) -> Path | None:
    """Write the centres of the target spheres, in the format of control points."""
    if not simulation.spheres:
        return None
    lines = (f"{k.id},{k.centre[0]:.5f},{k.centre[1]:.5f},{k.centre[2]:.5f},{k.radius:g},{k.kind}" for k in simulation.spheres)
    path.write_text("\n".join(["id,x,y,z,radius,kind", *lines]) + "\n")
    return path


def _sidecars(simulation: Simulation, folder: Path, files: Files) -> None:
    p, line, scanner = simulation.parameters, simulation.tunnel.line, simulation.scanner
    base = folder / p.name
    files.axis = _csv(Path(f"{base}.axis.csv"), "x,y,z", line.vertices(AXIS_SPACING), ["%.4f"] * 3)
    if p.scanner == "static":
        stations = scanner.stations()
        rows = np.column_stack([np.arange(1, len(stations) + 1), stations])
        files.poses = _csv(Path(f"{base}.stations.csv"), "scan_id,x,y,z", rows, ["%d"] + ["%.4f"] * 3)
    else:
        files.poses = _csv(Path(f"{base}.trajectory.csv"), "time,x,y,z", scanner.trajectory(), ["%.3f"] + ["%.4f"] * 3)
    files.reference = _csv(Path(f"{base}.reference.csv"), "range_m,intensity_db", simulation.reference, ["%.2f", "%.3f"])
    files.leaks = Path(f"{base}.truth.geojson")
    features = [
        {
            "type": "Feature",
            "id": leak.id,
            "properties": {
                "id": leak.id,
                "kind": leak.kind,
                "area": round(leak.area, 5),
                "area_surface": round(leak.area_surface, 5),
                "drop_db": round(leak.drop, 3),
            },
            "geometry": mapping(leak.polygon),
        }
        for leak in leaks_as_built(simulation)
    ]
    files.leaks.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    files.lining = Path(f"{base}.truth.gpkg")
    write_truth(simulation, files.lining)
    files.rings = write_ring_truth(simulation, Path(f"{base}.rings.csv"))
    files.spheres = _spheres(simulation, Path(f"{base}.spheres.csv"))
    section = simulation.tunnel.section
    record = {
        "software": f"tunneldb {tunneldb.__version__}",
        "parameters": p.as_dict(),
        "chainage": [line.start, line.end],
        "section": {
            "floor_arc": section.floor_arc,
            "half_perimeter": section.half_perimeter,
            "floor_below_axis": -section.floor,
        },
        "rings": {
            "first": simulation.rings.first,
            "length": simulation.rings.length,
            "step": simulation.ring_steps.tolist(),
        },
        "classes": {
            "lining": 0,
            "floor": 1,
            "appendage": 2,
            "niche": 3,
            "outlier": 4,
            "rail": 5,
            "object": 6,
            "sphere": 7,
        },
        "points": files.points,
        "files": [path.name for path in files.clouds],
        "appendages": [vars(a) for a in simulation.appendages],
        "niches": [vars(n) for n in simulation.niches],
        "things": [
            {"number": t.number, "kind": t.kind, "class": t.klass, "middle": np.round(t.middle(), 4).tolist()}
            for t in simulation.things
        ],
        "spheres": [
            {"id": k.id, "centre": np.round(k.centre, 5).tolist(), "radius": k.radius, "kind": k.kind}
            for k in simulation.spheres
        ],
    }
    files.parameters = Path(f"{base}.json")
    files.parameters.write_text(json.dumps(record, indent=1))


class _Sink:
    """Writers of the current file: points, and reference data if requested."""

    def __init__(self, header: laspy.LasHeader, folder: Path, base: str, columns: dict[str, np.dtype[Any]]) -> None:
        self.header = header
        self.cloud = folder / f"{base}.laz"
        self.truth = folder / f"{base}.truth.npz"
        self.points = laspy.open(self.cloud, mode="w", header=header, laz_backend=laspy.LazBackend.LazrsParallel)
        self.columns = _TruthWriter(self.truth, folder, columns) if columns else None

    def add(self, cloud: Cloud) -> None:
        self.points.write_points(_record(self.header, cloud))
        if self.columns is not None:
            self.columns.add(cloud)

    def close(self) -> None:
        self.points.close()
        if self.columns is not None:
            self.columns.close()


def write(
    simulation: Simulation,
    folder: Path,
    *,
    truth: bool = True,
    progress: Callable[[float, int], None] | None = None,
) -> Files:
    """Scan a simulation into ``folder``, one LAZ file up to 1 km of tunnel, else one per kilometre of chainage.

    Files appear in the folder only when all are complete.

    Parameters
    ----------
    truth : bool
        True to write reference data of each point (21 bytes per point, 23 with free-standing objects).
    progress : callable, optional
        Function of the completed share (0 to 1) and the number of points written, called after each block.

    Raises
    ------
    UserError
        If the folder cannot be written to, or the disk is full.
    """
    try:
        with (
            made_folder(folder),
            TemporaryDirectory(dir=folder, prefix=".simulate-") as scratch,
            disk_full_as_oserror(Path(scratch)),
        ):
            files = _scan(simulation, Path(scratch), truth, progress)
            _sidecars(simulation, Path(scratch), files)
            return files.moved(folder)
    except OSError as error:
        raise UserError(f"cannot write to {folder}: {error.strerror or error}") from error


def _scan(simulation: Simulation, folder: Path, truth: bool, progress: Callable[[float, int], None] | None) -> Files:
    """Write points and their reference data."""
    p, line = simulation.parameters, simulation.tunnel.line
    files = Files()
    header = _header(simulation)
    columns = (TRUTH | (THING if simulation.things else {})) if truth else {}
    current, sink = None, None
    for plan, cloud in simulation.blocks():
        km = math.floor(plan.chainage / 1000.0 + 1e-9) if p.length > 1000.0 else None
        if sink is None or km != current:
            if sink is not None:
                sink.close()
            current = km
            sink = _Sink(header, folder, p.name if km is None else f"{p.name}-km{km:03d}", columns)
            files.clouds.append(sink.cloud)
            if truth:
                files.truth.append(sink.truth)
        sink.add(cloud)
        files.points += len(cloud)
        if progress is not None:
            progress((plan.chainage_to - line.start) / (line.end - line.start), files.points)
    if sink is not None:
        sink.close()
    return files
