"""What came out of a registration, against the truth."""

from __future__ import annotations

import resource
import time
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.canal.scenes import CHECK_REACH, Case, check_points, true_places
from tunneldb.arrays import Float
from tunneldb.classification.underwater import WaterClass, classify, spacing_of_rays
from tunneldb.errors import UserError
from tunneldb.pipeline.load_sonar import MAX_SONAR_RANGE
from tunneldb.registration.underwater import Registration, SonarPose
from tunneldb.registration.underwater.block import register
from tunneldb.simulate.canal import FALSE, SonarScan
from tunneldb.simulate.canal.section import BED, WALL, WATER

HARMLESS = 0.15  # m from a surface within which a false echo says nothing wrong
CELL = 0.1  # m of wall, and across the bed
LEAST = 5  # points of a cell of the bed
RUNG = 0.279  # m


def judge(case: Case) -> dict[str, Any]:
    """Register a case and compare: figures as JSON takes them."""
    start = time.perf_counter()
    try:
        found = register(case.scene.laser, case.clouds, case.ladders, case.water_level)
    except UserError as error:
        return {"seed": case.scene.parameters.seed, "refused": str(error), "scans": [], "ladders": []}
    seconds = time.perf_counter() - start
    scans = [_scan(case, pose, true) for pose, true in zip(found.scans, case.scene.sonar, strict=True)]
    points = [np.empty((0, 7))]
    for one, pose, true in zip(scans, found.scans, case.scene.sonar, strict=True):
        if "shift" in one:
            counted, placed = _classes(case, pose, true)
            one |= counted
            points.append(placed)
    return {
        "seed": case.scene.parameters.seed,
        "seconds": seconds,
        "gigabytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6,
        "points": int(sum(len(cloud.points) for cloud in case.clouds)),
        "ladders": _ladders(case, found),
        "scans": scans,
        "surfaces": _surfaces(case, np.concatenate(points)) if len(points) > 1 else None,
    }


def _ladders(case: Case, found: Registration) -> list[dict[str, Any]]:
    out = []
    for true in case.scene.ladders:
        mine = [one for one in found.ladders if one.name == true.name]
        if mine:
            off = (mine[0].origin - true.origin) @ true.axes.T
            out.append({"off": off.tolist(), "rungs": len(mine[0].rungs)})
        else:
            out.append({"off": None, "rungs": 0})
    return out


def pose_errors(rotation: Float, translation: Float, scale: float, true: SonarScan) -> dict[str, Any]:
    """Errors of a pose: of check points (m, per point), turn (rad, 3), shift (m, 3), scale."""
    points = check_points(true)
    mine = scale * points @ rotation.T + translation
    return {
        "check": np.linalg.norm(mine - true_places(true, points), axis=1).round(5).tolist()[::10],
        "turn": Rotation.from_matrix(rotation @ true.rotation.T).as_rotvec().tolist(),
        "shift": (translation - true.translation).tolist(),
        "scale": scale - true.scale,
    }


def _scan(case: Case, pose: SonarPose, true: SonarScan) -> dict[str, Any]:
    out: dict[str, Any] = {"state": pose.state, "open": list(pose.undetermined)}
    if pose.state == "undetermined":
        return out
    out |= pose_errors(pose.rotation, pose.translation, pose.scale, true)
    out["sigma"] = np.sqrt(np.diag(pose.covariance)).tolist()
    points = check_points(true)[::20]
    error = pose.scale * points @ pose.rotation.T + pose.translation - true_places(true, points)
    out["inside"] = _share_inside(pose, points, error)
    return out


def _share_inside(pose: SonarPose, points: Float, error: Float) -> float:
    """Share of the coordinates of check points that lie within the stated 95 % intervals."""
    arm = pose.scale * points @ pose.rotation.T
    inside = []
    for own, off in zip(arm, error, strict=True):
        x, y, z = own
        turn = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
        design = np.hstack([turn, np.eye(3), own[:, None] / pose.scale])
        sigma = np.sqrt(np.diag(design @ pose.covariance @ design.T))
        inside += (np.abs(off) < 1.96 * sigma).tolist()
    return float(np.mean(inside))


def _classes(case: Case, pose: SonarPose, true: SonarScan) -> tuple[dict[str, Any], Float]:
    """False echoes removed and good points lost; of points of surfaces chainage, place across, place (3), class, true kind."""
    scene = case.scene
    space = pose.scale * true.points @ pose.rotation.T + pose.translation
    reach = np.linalg.norm(space - pose.translation, axis=1)
    near = reach < MAX_SONAR_RANGE
    space, reach, kind = space[near], reach[near], true.kind[near]
    stationed = scene.line.stationed(scene.line.to_local(space))
    along, across = stationed[:, 0] + 0.5 * scene.parameters.length, -stationed[:, 1]
    classes = classify(np.column_stack([along, across, stationed[:, 2]]), spacing_of_rays(reach))
    off = np.abs(scene.distance(space))
    phantom, good = (kind == FALSE) & (off > HARMLESS), (kind >= 0) & (kind != WATER)
    gone = classes == WaterClass.FALSE
    counted = {
        "phantoms": int(phantom.sum()),
        "removed": int((phantom & gone).sum()),
        "good": int(good.sum()),
        "lost": int((good & gone).sum()),
    }
    kept = (reach < CHECK_REACH) & ((classes == WaterClass.BED) | (classes == WaterClass.LINING))
    return counted, np.column_stack([along, across, space, classes, kind])[kept]


def _surfaces(case: Case, points: Float) -> dict[str, Any]:
    """Return the distance of bed and wall from the reference, by cells over the points of all scans."""
    scene = case.scene
    klass, kind, space = points[:, 5], points[:, 6], points[:, 2:5]
    wall = (klass == WaterClass.LINING) & (kind == WALL)
    bed = klass == WaterClass.BED
    cell = np.floor(np.column_stack([points[bed, 0], points[bed, 1] / CELL])).astype(np.int64)
    names, number, count = np.unique(cell, axis=0, return_inverse=True, return_counts=True)
    order = np.lexsort([space[bed, 2], number.ravel()])
    middle = np.concatenate([[0], np.cumsum(count)[:-1]]) + count // 2
    height = space[bed, 2][order][middle]
    place = scene.bed_height(points[bed, 0], points[bed, 1])  # of the bed where each point lies
    there = place[np.lexsort([place, number.ravel()])][middle]
    along = np.linspace(0.05, 0.95, 10)  # a cell is 1 m long
    truth = np.mean([scene.bed_height(names[:, 0] + share, (names[:, 1] + 0.5) * CELL) for share in along], axis=0)
    held = (count >= LEAST) & (kind[bed][order][middle] == BED)
    floor = scene.parameters.water_level - scene.parameters.depth - 0.5
    return {
        "wall": _cell_errors(space[wall], scene.distance(space[wall])),
        "seen": np.abs(height[held] - there[held]).round(5).tolist(),
        "bed": np.abs(height[held] - truth[held]).round(5).tolist(),
        "volume": [float((height[held] - floor).sum() * CELL), float((truth[held] - floor).sum() * CELL)],
    }


def _cell_errors(points: Float, distance: Float) -> list[float]:
    """Mean distances, m, of cells of a wall: what is left when the noise is averaged."""
    cell = np.floor(points / CELL).astype(np.int64)
    _, number, count = np.unique(cell, axis=0, return_inverse=True, return_counts=True)
    mean = np.bincount(number.ravel(), distance) / count
    return list(np.abs(mean[count >= 4]).round(5).tolist())[::5]
