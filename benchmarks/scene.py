"""A simulated tunnel on disk and in the database: made, registered, loaded and run by the command line."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import laspy
import numpy as np
from numpy.typing import NDArray
from shapely.geometry import shape
from shapely.geometry.base import BaseGeometry

from benchmarks.common import tunneldb

Float = NDArray[np.float64]
LINING, FLOOR, APPENDAGE, NICHE, OUTLIER, RAIL, OBJECT, SPHERE = range(8)  # classes of the truth


@dataclass(frozen=True)
class Scene:
    """The files of one simulated tunnel, and its survey's name (the same as the tunnel's)."""

    folder: Path
    name: str
    start_chainage: float

    @classmethod
    def simulate(cls, folder: Path, name: str, *options: object, start_chainage: float = 0.0) -> Scene:
        """Make a tunnel; `options` are those of ``tunneldb simulate``."""
        tunneldb("simulate", folder, "--name", name, "--start-chainage", start_chainage, *options)
        return cls(folder, name, start_chainage)

    def register(self, dsn: str, intensity: str = "Amplitude", kind: str = "amplitude", reference: str = "measured") -> None:
        """Add tunnel and survey to the database; the range curve is measured, or found on the lining (``auto``)."""
        tunneldb(
            "tunnel", "add", self.name, "--srid", 25830, "--axis", self.file("axis.csv"),
            "--start-chainage", self.start_chainage, dsn=dsn,
        )  # fmt: skip
        stations, trajectory = self.file("stations.csv"), self.file("trajectory.csv")
        poses = ("--stations", stations) if stations.exists() else ("--trajectory", trajectory)
        tunneldb(
            "survey", "add", self.name, "--tunnel", self.name, "--date", "2024-05-04", *poses,
            "--reference", "auto" if reference == "auto" else self.file("reference.csv"),
            "--intensity", intensity, "--intensity-kind", kind, dsn=dsn,
        )  # fmt: skip

    def load(self, dsn: str) -> float:
        """Load the scan files; return the seconds it took."""
        return tunneldb("load", self.name, *self.scans, dsn=dsn)

    def run(self, dsn: str, first: str = "axis", last: str = "detect", *options: object) -> float:
        """Run the stages from `first` to `last`; return the seconds it took."""
        return tunneldb("run", self.name, "--from", first, "--to", last, *options, dsn=dsn)

    def file(self, ending: str) -> Path:
        return self.folder / f"{self.name}.{ending}"

    @property
    def scans(self) -> list[Path]:
        """Its scan files; other tunnels in the folder may begin with the same name."""
        return [self.folder / name for name in json.loads(self.file("json").read_text())["files"]]

    @cached_property
    def xyz(self) -> Float:
        """Coordinates of all points, in file order, (n, 3), m."""
        return np.concatenate([laspy.read(file).xyz for file in self.scans])

    @cached_property
    def truth(self) -> dict[str, NDArray[Any]]:
        """Return chainage, arc, offset, class and leak of each point, in file order."""
        with np.load(self.file("truth.npz")) as arrays:
            return {name: arrays[name] for name in arrays.files}

    @cached_property
    def leaks(self) -> list[BaseGeometry]:
        """True leaks in the unrolled plane, m."""
        features = json.loads(self.file("truth.geojson").read_text())["features"]
        return [shape(feature["geometry"]) for feature in features]

    @cached_property
    def parameters(self) -> dict[str, Any]:
        """Return the parameters of the tunnel."""
        parameters: dict[str, Any] = json.loads(self.file("json").read_text())["parameters"]
        return parameters
