"""Run ``tunneldb members`` on the files of a scene, and compare what it calls with the truth."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import laspy
import numpy as np

from benchmarks.common import progress
from benchmarks.structures.detector import CrashedError, run
from tunneldb.arrays import Bool, Float, Int64

SMALLEST, FEWEST, STEEPEST, LEAST_CONTRAST = 0.01, 100, 75.0, 1.0
HALF = 0.5
SEEN_CELL, SAME_CELL = 0.1, 0.02  # m


@dataclass(frozen=True)
class Scene:
    """Points of a scene with their truth, (n,) each."""

    xyz: Float
    scan: Int64
    anomaly: Int64
    surface: Int64
    incidence: Float
    area: Float
    anomalies: list[dict[str, Any]]


def read(folder: Path) -> Scene:
    """Read the points and the truth of a scene."""
    las, truth = laspy.read(folder / "scan.laz"), np.load(folder / "truth.npz")
    record = json.loads((folder / "truth.json").read_text())
    return Scene(
        np.asarray(las.xyz), np.asarray(las.point_source_id).astype(np.int64), truth["anomaly"].astype(np.int64),
        truth["surface"].astype(np.int64), truth["incidence"].astype(np.float64), truth["area"].astype(np.float64),
        record["anomalies"],
    )  # fmt: skip


def called(cloud: Path, stations: Path, output: Path) -> tuple[Int64, float, dict[str, Any]]:
    """Return the number of the region that each point is called, seconds, and the command's answer."""
    intensity = ["--intensity", "Amplitude", "--intensity-kind", "amplitude"]
    seconds, memory, text = run(["members", cloud, "--stations", stations, *intensity, "-o", output, "--json"])
    answer = json.loads(text)
    return np.asarray(laspy.read(output)["anomaly"]).astype(np.int64), seconds, answer | {"memory": memory}


def judge(name: str, folder: Path) -> dict[str, Any]:
    """Run a scene and compare; figures as JSON takes them."""
    scene, output = read(folder), folder / "found.laz"
    try:
        region, seconds, answer = called(folder / "scan.laz", folder / "stations.csv", output)
        refused = None
    except CrashedError as error:
        progress(f"{name}: {error}")
        region, seconds, answer, refused = np.zeros(len(scene.xyz), np.int64), float("nan"), {}, str(error)
    asked, found = _anomalies(scene, region > 0)
    kept = (scene.anomaly == 0) | np.isin(scene.anomaly, [one["id"] for one in asked])
    truth, mine = scene.anomaly[kept] > 0, region[kept] > 0
    tp, fp, fn = (float(np.count_nonzero(x)) for x in (truth & mine, ~truth & mine, truth & ~mine))
    false = [one for one in _regions(scene, region) if one["share"] < HALF]
    return {
        "scene": name, "points": len(scene.xyz), "refused": refused, "seconds": seconds,
        "f1": 2.0 * tp / (2.0 * tp + fp + fn) if asked else None, "tp": tp, "fp": fp, "fn": fn,
        "asked": len(asked), "found": len(found), "limits": sum(bool(one.get("limit")) for one in scene.anomalies),
        "false": false, "seen": seen_area(scene), "pair": None if refused else pair(scene, folder),
        "kinds": [[one["kind"], one["share"], one["contrast_db"], one["area"]] for one in asked],
        "memory": answer.get("memory"),
    }  # fmt: skip


def _anomalies(scene: Scene, mine: Bool) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Return the anomalies that count, with the share of their points that are called, and those that are found."""
    asked = []
    for one in scene.anomalies:
        rows = scene.anomaly == one["id"]
        counts = one["area"] >= SMALLEST and abs(one["contrast_db"]) >= LEAST_CONTRAST and not one.get("limit")
        if counts and rows.sum() >= FEWEST and float(np.nanmedian(scene.incidence[rows])) <= STEEPEST:
            asked.append({**one, "share": float(mine[rows].mean())})
    return asked, [one for one in asked if one["share"] >= HALF]


def _regions(scene: Scene, region: Int64) -> list[dict[str, Any]]:
    out = []
    for number in np.unique(region[region > 0]).tolist():
        rows = region == number
        surface, count = np.unique(scene.surface[rows], return_counts=True)
        out.append(
            {
                "region": number, "points": int(rows.sum()), "share": float((scene.anomaly[rows] > 0).mean()),
                "area": float(scene.area[rows].sum()), "surface": int(surface[np.argmax(count)]),
                "place": scene.xyz[rows].mean(axis=0).round(3).tolist(),
            }
        )  # fmt: skip
    return out


def _cells(scene: Scene, rows: Int64, size: float) -> Int64:
    """Return the cells (n, 4) of points on surfaces: surface and cube."""
    cube = np.floor((scene.xyz[rows] - scene.xyz.min(axis=0)) / size).astype(np.int64)
    return np.column_stack([scene.surface[rows], cube])


def seen_area(scene: Scene) -> float:
    """Return the surface seen, m²: of each cell the most that one scan saw."""
    rows = np.flatnonzero(scene.surface > 0)
    key = np.column_stack([_cells(scene, rows, SEEN_CELL), scene.scan[rows]])
    names, number = np.unique(key, axis=0, return_inverse=True)
    area = np.bincount(number.ravel(), scene.area[rows])
    _, cell = np.unique(names[:, :4], axis=0, return_inverse=True)
    most = np.zeros(int(cell.max(initial=-1)) + 1)
    np.maximum.at(most, cell.ravel(), area)
    return float(most.sum())


def pair(scene: Scene, folder: Path) -> float | None:
    """Return the IoU of what is called from the first two stations alone; None if there is one station, or nothing."""
    if scene.scan.max() < 2:
        return None
    cells = []
    for number in (1, 2):
        rows = np.flatnonzero(scene.scan == number)
        las = laspy.read(folder / "scan.laz")
        las.points = las.points[rows]
        las.write(folder / f"one-{number}.laz")
        try:
            region, _, _ = called(folder / f"one-{number}.laz", folder / "stations.csv", folder / f"found-{number}.laz")
        except CrashedError as error:
            progress(f"{folder.name}, station {number}: {error}")
            region = np.zeros(len(rows), np.int64)
        usable = (scene.surface[rows] > 0) & (scene.incidence[rows] <= STEEPEST)
        names, cell = np.unique(_cells(scene, rows[usable], SAME_CELL), axis=0, return_inverse=True)
        share = np.bincount(cell.ravel(), region[usable] > 0) / np.bincount(cell.ravel())
        cells.append({tuple(key): value >= HALF for key, value in zip(names.tolist(), share.tolist(), strict=True)})
    both = cells[0].keys() & cells[1].keys()
    either = sum(cells[0][key] or cells[1][key] for key in both)
    return sum(cells[0][key] and cells[1][key] for key in both) / either if either else None
