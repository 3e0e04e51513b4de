"""What came out of a registration, against the truth."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.canal.scenes import Case, check_points, true_places
from tunneldb.arrays import Float
from tunneldb.classification.underwater import WaterClass, classify
from tunneldb.errors import UserError
from tunneldb.pipeline.load_sonar import FARTHEST
from tunneldb.registration.underwater import Registration, SonarPose
from tunneldb.registration.underwater.block import register
from tunneldb.simulate.canal import FALSE, SonarScan
from tunneldb.simulate.canal.section import BED, WALL, WATER

HARMLESS = 0.15  # m from a surface within which a false echo says nothing wrong
CELL = 0.1  # m of wall, and across the bed
RUNG = 0.279  # m


def judge(case: Case) -> dict[str, Any]:
    """Register a case and compare: figures as JSON takes them."""
    start = time.perf_counter()
    try:
        found = register(case.scene.laser, case.clouds, case.ladders, case.water_level)
    except UserError as error:
        return {"seed": case.scene.parameters.seed, "refused": str(error), "scans": [], "ladders": []}
    seconds = time.perf_counter() - start
    return {
        "seed": case.scene.parameters.seed,
        "seconds": seconds,
        "points": int(sum(len(cloud.points) for cloud in case.clouds)),
        "ladders": _ladders(case, found),
        "scans": [_scan(case, pose, true) for pose, true in zip(found.scans, case.scene.sonar, strict=True)],
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
    return out | _classes(case, pose, true)


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


def _classes(case: Case, pose: SonarPose, true: SonarScan) -> dict[str, Any]:
    """False echoes removed, good points lost, and how far bed and wall lie from the truth."""
    scene = case.scene
    space = pose.scale * true.points @ pose.rotation.T + pose.translation
    reach = np.linalg.norm(space - pose.translation, axis=1)
    near = reach < FARTHEST
    space, reach, kind = space[near], reach[near], true.kind[near]
    stationed = scene.line.stationed(scene.line.to_local(space))
    along, across = stationed[:, 0] + 0.5 * scene.parameters.length, -stationed[:, 1]
    classes = classify(np.column_stack([along, across, stationed[:, 2]]), reach)
    off = np.abs(scene.distance(space))
    phantom, good = (kind == FALSE) & (off > HARMLESS), (kind >= 0) & (kind != WATER)
    gone = classes == WaterClass.FALSE
    wall = (classes == WaterClass.LINING) & (kind == WALL) & (reach < 10.0)
    out = {
        "phantoms": int(phantom.sum()), "removed": int((phantom & gone).sum()), "good": int(good.sum()),
        "lost": int((good & gone).sum()), "wall": _cell_errors(space[wall], scene.distance(space[wall])),
    }  # fmt: skip
    bed = (classes == WaterClass.BED) & (reach < 10.0)
    cell = np.floor(np.column_stack([along[bed], across[bed] / CELL])).astype(np.int64)
    names, number, count = np.unique(cell, axis=0, return_inverse=True, return_counts=True)
    order = np.lexsort([space[bed, 2], number.ravel()])
    begin = np.concatenate([[0], np.cumsum(count)[:-1]])
    height = space[bed, 2][order][begin + count // 2]
    fine = np.linspace(0.05, 0.95, 10)
    truth = np.mean(
        [scene.bed_height(names[:, 0] + share, (names[:, 1] + 0.5) * CELL) for share in fine], axis=0
    )  # a cell is 1 m long
    held = (count >= 5) & (kind[bed][order][begin] == BED)
    error = height[held] - truth[held]
    floor = scene.parameters.water_level - scene.parameters.depth - 0.5
    out["bed"] = np.abs(error).round(5).tolist()[::3]
    out["volume"] = [float((height[held] - floor).sum() * CELL), float((truth[held] - floor).sum() * CELL)]
    return out


def _cell_errors(points: Float, distance: Float) -> list[float]:
    """Mean distances, m, of cells of a wall: what is left when the noise is averaged."""
    cell = np.floor(points / CELL).astype(np.int64)
    _, number, count = np.unique(cell, axis=0, return_inverse=True, return_counts=True)
    mean = np.bincount(number.ravel(), distance) / count
    return list(np.abs(mean[count >= 4]).round(5).tolist())[::5]
