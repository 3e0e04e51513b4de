"""Register the files of a scene, and compare the poses with the truth."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common import progress
from tunneldb.arrays import Float
from tunneldb.errors import UserError
from tunneldb.pipeline.ladder_file import read_ladders
from tunneldb.pipeline.register import ABOVE, BELOW, VOXEL
from tunneldb.pointcloud.reader import read_chunks
from tunneldb.pointcloud.sonar import read_sonar
from tunneldb.pointcloud.voxels import Voxels
from tunneldb.registration.underwater import Ladder, Near, Registration, SonarCloud, SonarPose, register

RIGHT, POOR, WRONG = 0.025, 0.06, 0.1
"""p95 of check points, m: up to which a pose is right, and from which it is wrong if called determined, and in any case."""
SAME = 0.25
"""p95 of check points, m, up to which an alternative is the true pose."""


def laser_points(folder: Path, level: float) -> Float:
    """Return the laser's points near the water, thinned as ``tunneldb register`` thins them."""
    voxels = Voxels(VOXEL)
    for chunk in read_chunks(folder / "laser.laz", None):
        height = chunk.xyz[:, 2]
        voxels.add(chunk.xyz[(height > level - BELOW) & (height < level + ABOVE)])
    return voxels.centroids()


def sonar_clouds(folder: Path, scene: dict[str, Any]) -> list[SonarCloud]:
    """Return the sonar scans of a scene, as ``tunneldb register`` reads them."""
    near = {one["file"]: Near(np.array([one["x"], one["y"]]), float(one["within"])) for one in scene.get("start") or ()}
    assumed, measured = scene.get("sound_speed") or (1.0, 1.0)
    paths = sorted(folder.glob("sonar_*.xyz"), key=lambda path: int(path.stem.split("_")[1]))
    up = 1 if scene["up"] == "+z" else -1
    return [SonarCloud(path, read_sonar(path)[0] * (measured / assumed), up, near.get(path.name)) for path in paths]


def ladders_of(folder: Path) -> list[Ladder]:
    """Return the ladders of a scene; none if the file has only a header."""
    rows = (folder / "ladders.csv").read_text().split()
    return read_ladders(folder / "ladders.csv") if len(rows) > 1 else []


def judge(name: str, folder: Path) -> dict[str, Any]:
    """Register a scene's scans and compare; figures as JSON takes them."""
    scene = json.loads((folder / "scene.json").read_text())
    truth = json.loads((folder / "truth.json").read_text())["scans"]
    level = float(scene["water_level"])
    laser, clouds, ladders = laser_points(folder, level), sonar_clouds(folder, scene), ladders_of(folder)
    assumed, measured = scene.get("sound_speed") or (1.0, 1.0)
    start = time.perf_counter()
    try:
        found: Registration | None = register(laser, clouds, ladders, level)
        notes = list(found.notes) if found else []
    except UserError as error:
        found, notes = None, [f"refused: {error}"]
    seconds = time.perf_counter() - start
    for note in notes:
        progress(f"{name}: {note}")
    scans = []
    for k, true in enumerate(truth):
        one: dict[str, Any] = {"asked": bool(true["determined"]), "state": "undetermined", "alternatives": None}
        if found is not None:
            one |= _scan(found.scans[k], true, measured / assumed)
        scans.append(one)
    return {"scene": name, "seconds": seconds, "notes": notes, "scans": scans}


def _scan(pose: SonarPose, true: dict[str, Any], factor: float) -> dict[str, Any]:
    out: dict[str, Any] = {"state": pose.state, "open": list(pose.undetermined)}
    others = [_errors(a.rotation, a.translation, a.scale * factor, true)["p95"] for a in pose.alternatives]
    out["alternatives"] = others
    out["probabilities"] = [float(a.probability) for a in pose.alternatives]
    if pose.state != "undetermined":
        out |= _errors(pose.rotation, pose.translation, pose.scale * factor, true)
    return out


def _errors(rotation: Float, translation: Float, scale: float, true: dict[str, Any]) -> dict[str, float]:
    local, world = np.array(true["check_local"]), np.array(true["check_world"])
    off = np.linalg.norm(scale * local @ rotation.T + translation - world, axis=1)
    return {"median": float(np.median(off)), "p95": float(np.percentile(off, 95.0))}


def is_wrong(scan: dict[str, Any]) -> bool:
    """Return True if a scan has a pose that misleads."""
    if scan["state"] == "undetermined":
        return False
    return scan["p95"] > WRONG or (scan["state"] == "determined" and scan["p95"] > POOR)
