"""Files of a synthetic canal tunnel: laser points, stations, sonar scans, ladders, axis and reference data."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import laspy
import numpy as np

import tunneldb
from tunneldb.errors import UserError
from tunneldb.files import disk_full_as_oserror, made_folder
from tunneldb.simulate.canal.generate import CanalScene
from tunneldb.simulate.canal.layout import TrueLadder
from tunneldb.simulate.canal.section import KINDS
from tunneldb.simulate.canal.sonar import SonarScan
from tunneldb.simulate.output import CREATED, SCALE


@dataclass(frozen=True)
class CanalFiles:
    """Files written by :func:`write`."""

    laser: Path
    stations: Path
    axis: Path
    ladders: Path
    truth: Path
    sonar: tuple[Path, ...]


def write(scene: CanalScene, folder: Path) -> CanalFiles:
    """Write a scene's files into ``folder``; they appear there only when all are complete.

    Raises
    ------
    UserError
        If the folder cannot be written to, or the disk is full.
    """
    name = scene.parameters.name
    try:
        with (
            made_folder(folder),
            TemporaryDirectory(dir=folder, prefix=".simulate-") as scratch,
            disk_full_as_oserror(Path(scratch)),
        ):
            _write(scene, Path(scratch), name)
            for path in sorted(Path(scratch).iterdir()):
                path.replace(folder / path.name)
    except OSError as error:
        raise UserError(f"cannot write to {folder}: {error.strerror or error}") from error
    laser, stations, axis, ladders, truth = (
        folder / f"{name}{end}" for end in (".laz", ".stations.csv", ".axis.csv", ".ladders.csv", ".truth.json")
    )
    return CanalFiles(laser, stations, axis, ladders, truth, tuple(folder / f"{name}.{s.name}.xyz" for s in scene.sonar))


def _write(scene: CanalScene, folder: Path, name: str) -> None:
    _write_laser(scene, folder / f"{name}.laz")
    numbers = np.arange(1, len(scene.laser_places) + 1)
    rows = np.column_stack([numbers, scene.laser_places])
    csv = {"delimiter": ",", "comments": ""}
    np.savetxt(folder / f"{name}.stations.csv", rows, ["%d", *["%.4f"] * 3], header="scan_id,x,y,z", **csv)
    np.savetxt(folder / f"{name}.axis.csv", scene.axis, "%.4f", header="x,y,z", **csv)
    lines = [
        f"{one.name},{number},{height:.4f},{one.stile_gap:.4f},{one.diameter:.4f}"
        for one in scene.ladders
        for number, height in enumerate(one.heights, start=1)
    ]
    text = "\n".join(["ladder,rung,height,stile_gap,diameter", *lines])
    (folder / f"{name}.ladders.csv").write_text(text + "\n", encoding="utf-8")
    for scan in scene.sonar:
        values = np.column_stack([scan.points, scan.intensity])
        np.savetxt(folder / f"{name}.{scan.name}.xyz", values, ["%.4f", "%.4f", "%.4f", "%.1f"])
    (folder / f"{name}.truth.json").write_text(json.dumps(_truth(scene), indent=1), encoding="utf-8")


def _write_laser(scene: CanalScene, path: Path) -> None:
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.add_crs(scene.parameters.crs())
    header.scales, header.offsets = np.full(3, SCALE), np.floor(np.array(scene.line.origin))
    header.generating_software = f"tunneldb {tunneldb.__version__} simulate"
    header.system_identifier = "SIMULATION"
    header.creation_date = CREATED
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = scene.laser.T
    cloud.point_source_id = scene.laser_station.astype(np.uint16)
    cloud.return_number = np.ones(len(scene.laser), np.uint8)
    cloud.number_of_returns = np.ones(len(scene.laser), np.uint8)
    cloud.write(path)


def _truth(scene: CanalScene) -> dict[str, Any]:
    length, half = scene.parameters.length, 0.5 * scene.parameters.width
    chainage, across = np.arange(0.25, length, 0.5), np.arange(-half + 0.05, half, 0.1)
    x, y = np.meshgrid(chainage, across, indexing="ij")
    return {
        "software": f"tunneldb {tunneldb.__version__}",
        "parameters": scene.parameters.as_dict(),
        "water_level": scene.parameters.water_level,
        "kinds": dict(enumerate(KINDS)),
        "ladders": [_ladder(one) for one in scene.ladders],
        "sonar": [_scan(one) for one in scene.sonar],
        "bed": {
            "chainage": chainage.round(2).tolist(),
            "across": across.round(2).tolist(),
            "height": scene.bed_height(x.ravel(), y.ravel()).reshape(x.shape).round(4).tolist(),
        },
    }


def _ladder(one: TrueLadder) -> dict[str, Any]:
    return {
        "name": one.name,
        "origin": one.origin.tolist(),
        "axes": one.axes.tolist(),
        "heights": one.heights.tolist(),
        "hidden": list(one.hidden),
    }


def _scan(one: SonarScan) -> dict[str, Any]:
    kinds, counts = np.unique(one.kind, return_counts=True)
    return {
        "name": one.name,
        "rotation": one.rotation.tolist(),
        "translation": one.translation.tolist(),
        "scale": one.scale,
        "tilt": one.tilt,
        "points": len(one.points),
        "of_kind": dict(zip(kinds.tolist(), counts.tolist(), strict=True)),
    }
