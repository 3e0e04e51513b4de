"""Files of a synthetic structure: LAZ with reference data, stations, reference curve, and reference faces and anomalies."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import laspy
import numpy as np
from shapely.geometry import Polygon

import tunneldb
from tunneldb.arrays import Float
from tunneldb.errors import UserError
from tunneldb.files import disk_full_as_oserror, made_folder
from tunneldb.simulate.output import CREATED, SCALE
from tunneldb.simulate.radiometry import reference_curve
from tunneldb.simulate.structure.anomalies import Anomaly
from tunneldb.simulate.structure.generate import MAX_RANGE, StructureCloud, StructureScan
from tunneldb.simulate.structure.shapes import RING, Face

DIMENSIONS = [
    laspy.ExtraBytesParams("Amplitude", np.float32, "echo amplitude, dB"),
    laspy.ExtraBytesParams("Reflectance", np.float32, "without range, dB"),
    laspy.ExtraBytesParams("true_face", np.uint16, "0: none"),
    laspy.ExtraBytesParams("true_member", np.uint16, "0: none"),
    laspy.ExtraBytesParams("true_anomaly", np.uint16, "0: none"),
    laspy.ExtraBytesParams("true_incidence", np.float32, "degrees"),
]


@dataclass
class StructureFiles:
    """Files written by :func:`write_structure`."""

    cloud: Path
    stations: Path
    reference: Path
    truth: Path
    points: int = 0

    @classmethod
    def named(cls, folder: Path, name: str) -> StructureFiles:
        """Return the files of a name in a folder."""
        base = str(folder / name)
        ends = (".laz", ".stations.csv", ".reference.csv", ".truth.json")
        return cls(Path(base + ends[0]), Path(base + ends[1]), Path(base + ends[2]), Path(base + ends[3]))

    def moved(self, folder: Path) -> StructureFiles:
        """Move the files to another folder of the same disk."""

        def to(path: Path) -> Path:
            return path.replace(folder / path.name)

        return StructureFiles(to(self.cloud), to(self.stations), to(self.reference), to(self.truth), self.points)


@dataclass
class _Tally:
    """Sums over the points of each face or anomaly: points, incidences, changes of level."""

    points: int = 0
    incidence: list[Float] = field(default_factory=list)


def write_structure(scan: StructureScan, folder: Path, progress: Callable[[int], None] | None = None) -> StructureFiles:
    """Scan a structure into ``folder``; files appear there only when all are complete.

    Parameters
    ----------
    progress : callable, optional
        Function of the number of points written, called after each block.

    Raises
    ------
    UserError
        If the folder cannot be written to, or the disk is full.
    """
    name = scan.parameters.name
    try:
        with (
            made_folder(folder),
            TemporaryDirectory(dir=folder, prefix=".simulate-") as scratch,
            disk_full_as_oserror(Path(scratch)),
        ):
            made = _write(scan, Path(scratch), name, progress)
            return made.moved(folder)
    except OSError as error:
        raise UserError(f"cannot write to {folder}: {error.strerror or error}") from error


def _write(scan: StructureScan, folder: Path, name: str, progress: Callable[[int], None] | None) -> StructureFiles:
    parameters = scan.parameters
    files = StructureFiles.named(folder, name)
    origin = np.array(parameters.origin)
    header = laspy.LasHeader(point_format=6 if parameters.night else 7, version="1.4")
    header.add_extra_dims(DIMENSIONS)
    header.add_crs(parameters.crs())
    header.scales, header.offsets = np.full(3, SCALE), np.floor(origin)
    header.generating_software = f"tunneldb {tunneldb.__version__} simulate"
    header.system_identifier = "SIMULATION"
    header.creation_date = CREATED
    faces, anomalies = [_Tally() for _ in scan.structure.faces], [_Tally() for _ in scan.anomalies]
    with laspy.open(files.cloud, mode="w", header=header, laz_backend=laspy.LazBackend.LazrsParallel) as laz:
        for cloud in scan.blocks():
            laz.write_points(_record(header, cloud))
            _count(faces, cloud.face, cloud.incidence)
            _count(anomalies, cloud.anomaly, cloud.incidence)
            files.points += len(cloud.xyz)
            if progress is not None:
                progress(files.points)
    rows = np.column_stack([np.arange(1, len(scan.stations) + 1), scan.stations + origin])
    np.savetxt(files.stations, rows, ["%d"] + ["%.4f"] * 3, delimiter=",", header="scan_id,x,y,z", comments="")
    curve = reference_curve(MAX_RANGE, np.random.default_rng(parameters.seed))
    np.savetxt(files.reference, curve, ["%.2f", "%.3f"], delimiter=",", header="range_m,intensity_db", comments="")
    record = {
        "software": f"tunneldb {tunneldb.__version__}",
        "parameters": parameters.as_dict(),
        "points": files.points,
        "members": [vars(member) for member in scan.structure.members],
        "faces": [_face(f, tally, origin) for f, tally in zip(scan.structure.faces, faces, strict=True)],
        "anomalies": [_anomaly(a, tally, origin) for a, tally in zip(scan.anomalies, anomalies, strict=True)],
    }
    files.truth.write_text(json.dumps(record, indent=1))
    return files


def _record(header: laspy.LasHeader, cloud: StructureCloud) -> laspy.ScaleAwarePointRecord:
    record = laspy.ScaleAwarePointRecord.zeros(len(cloud.xyz), header=header)
    cells = np.rint((cloud.xyz - header.offsets) / header.scales).astype(np.int32)
    for i, name in enumerate("XYZ"):
        record[name] = cells[:, i]
    record["intensity"] = cloud.intensity
    record["return_number"] = np.ones(len(cells), dtype=np.uint8)
    record["number_of_returns"] = np.ones(len(cells), dtype=np.uint8)
    record["point_source_id"] = cloud.scan_id
    record["gps_time"] = cloud.time
    record["Amplitude"], record["Reflectance"] = cloud.amplitude, cloud.reflectance
    record["true_face"], record["true_member"], record["true_anomaly"] = cloud.face, cloud.member, cloud.anomaly
    record["true_incidence"] = cloud.incidence
    if cloud.rgb is not None:
        for i, name in enumerate(("red", "green", "blue")):
            record[name] = cloud.rgb[:, i]
    return record


def _count(tallies: list[_Tally], ids: Any, incidence: Any) -> None:
    """Add points to the tallies of their ids."""
    for number in np.unique(ids[ids > 0]).tolist():
        mine = ids == number
        tallies[number - 1].points += int(mine.sum())
        tallies[number - 1].incidence.append(incidence[mine])


def _incidence(tally: _Tally) -> list[float] | None:
    """Return the 5, 50 and 95 % quantiles of the incidence, degrees."""
    if not tally.points:
        return None
    return [round(float(v), 2) for v in np.percentile(np.concatenate(tally.incidence), [5, 50, 95])]


def _face(face: Face, tally: _Tally, origin: Float) -> dict[str, Any]:
    axes = face.row[4:13].reshape(3, 3)
    shape: dict[str, Any] = {"origin": (face.row[1:4] + origin).tolist(), "axes": axes.tolist()}
    if face.kind == "cylinder":
        shape |= {"radius": float(face.row[13]), "length": float(face.row[14])}
    elif face.kind == "bend":
        shape |= {"bend_radius": float(face.row[13]), "radius": float(face.row[14]), "angle": float(face.row[15])}
    elif face.row[0] == RING:
        shape |= {"radii": face.row[13:15].tolist()}
    elif face.surfaces == 1:
        shape |= {"size": list(face.size())}
    return {
        "id": face.id,
        "member": face.member,
        "kind": face.kind,
        "material": face.material,
        **shape,
        "points": tally.points,
        "incidence": _incidence(tally),
    }


def _anomaly(anomaly: Anomaly, tally: _Tally, origin: Float) -> dict[str, Any]:
    out: dict[str, Any] = {
        "id": anomaly.id,
        "face": anomaly.face.id,
        "member": anomaly.face.member,
        "kind": anomaly.kind,
        "area": anomaly.outline.area,
        "contrast": anomaly.shift,
        "points": tally.points,
        "incidence": _incidence(tally),
    }
    if tally.points:
        cosine = np.cos(np.radians(np.concatenate(tally.incidence)))
        out["contrast_seen"] = float(np.median(anomaly.level(cosine)))
    if anomaly.width:
        out["width"] = anomaly.width
    if isinstance(anomaly.outline, Polygon):
        ring = np.asarray(anomaly.outline.exterior.coords)
        out["outline"] = np.round(ring, 4).tolist()
        out["outline_3d"] = np.round(anomaly.face.to_space(ring) + origin, 4).tolist()
    return out
