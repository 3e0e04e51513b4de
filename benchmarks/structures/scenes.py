"""Simulated structures of the benchmark: what each seed stands for, and its points and truth as arrays.

Rules and constants of the detector may be looked at on OWN seeds only. JUDGE seeds are for the figure of record: nobody tunes
on them, or looks at single scenes of them to mend the detector; who did so takes new ones, and says it.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import laspy
import numpy as np

from tunneldb.arrays import Float, Int64
from tunneldb.simulate.structure import StructureParameters, StructureScan, write_structure

OWN = tuple(range(1, 13))
JUDGE = tuple(range(2001, 2013))
FINE_EVERY = 6  # one is scanned from one station at 0.035 degrees
CLEAN_EVERY = 4  # one scene of so many has no anomaly


def parameters(seed: int, name: str, **other: Any) -> StructureParameters:
    """A scene of a seed: 1 to 4 stations, 1 to 3 mm, 0.035 to 0.12 degrees, 5 to 14 m, by day and by night."""
    rng = np.random.default_rng([17, seed])
    values: dict[str, Any] = {
        "stations": int(rng.integers(1, 5)),
        "range_noise": float(rng.uniform(0.001, 0.003)),
        "angular_step": float(rng.uniform(0.05, 0.12)),
        "distance": float(rng.uniform(5.0, 14.0)),
        "width": float(rng.uniform(4.0, 7.0)),
        "fronts": int(rng.integers(1, 5)),
        "night": bool(rng.random() < 0.4),
        "anomalies": 0 if seed % CLEAN_EVERY == 0 else int(rng.integers(8, 20)),
    }
    # Far scenes are scanned finely and few stations, too, as one would; so all have some hundred thousand points.
    values["angular_step"] = min(values["angular_step"], 0.7 / values["distance"])
    values["angular_step"] = max(values["angular_step"], 0.05 * values["stations"] ** 0.5)
    if seed % FINE_EVERY == 1:
        values |= {"stations": 1, "angular_step": 0.035}
    return StructureParameters(**{"name": name, "seed": seed, **values, **other})


@dataclass(frozen=True)
class Scene:
    """A scene's files, its points with truth (n each) and the record of faces and anomalies."""

    cloud: Path
    stations_file: Path
    stations: Float
    truth: dict[str, Any]
    xyz: Float
    scan: Int64
    level: Float
    face: Int64
    member: Int64
    anomaly: Int64
    incidence: Float

    def weights(self) -> Float:
        """Area that each point stands for in its scan, m²: its solid angle on the slanted surface."""
        ray = self.xyz - self.stations[self.scan - 1]
        far = np.linalg.norm(ray, axis=1)
        sine = np.linalg.norm(ray[:, :2], axis=1) / far
        step = np.radians(self.truth["parameters"]["angular_step"])
        return far**2 * step**2 * sine / np.maximum(np.cos(np.radians(self.incidence)), 0.03)

    def unroll(self, number: int, xyz: Float) -> Float:
        """Places (n, 2) on a true plane or cylinder, m."""
        face = self.truth["faces"][number - 1]
        local = (xyz - face["origin"]) @ np.array(face["axes"]).T
        if face["kind"] == "cylinder":
            return np.column_stack([local[:, 2], face["radius"] * np.arctan2(local[:, 1], local[:, 0])])
        return local[:, :2]


def make(wanted: StructureParameters, folder: Path) -> Scene:
    """Scan a scene, or read it if the folder has it."""
    base = folder / wanted.name
    if not Path(f"{base}.truth.json").exists():
        write_structure(StructureScan(wanted), folder)
    return read(base)


def read(base: Path) -> Scene:
    las = laspy.read(f"{base}.laz")
    stations = np.loadtxt(f"{base}.stations.csv", delimiter=",", skiprows=1, ndmin=2)[:, 1:]
    return Scene(
        Path(f"{base}.laz"),
        Path(f"{base}.stations.csv"),
        stations,
        json.loads(Path(f"{base}.truth.json").read_text()),
        np.asarray(las.xyz),
        np.asarray(las.point_source_id).astype(np.int64),
        np.asarray(las["Amplitude"]).astype(np.float64),
        *(np.asarray(las[name]).astype(np.int64) for name in ("true_face", "true_member", "true_anomaly")),
        np.asarray(las["true_incidence"]).astype(np.float64),
    )


def one_scan(scene: Scene, number: int, folder: Path) -> Scene:
    """A scene as one of its scans alone has it."""
    base = folder / f"{scene.cloud.stem}-scan{number}"
    las = laspy.read(scene.cloud)
    las.points = las.points[np.asarray(las.point_source_id) == number]
    las.write(f"{base}.laz")
    lines = scene.stations_file.read_text().splitlines()
    Path(f"{base}.stations.csv").write_text("\n".join(lines[: len(scene.stations) + 1]) + "\n")
    Path(f"{base}.truth.json").write_text(json.dumps(scene.truth))
    return read(base)
