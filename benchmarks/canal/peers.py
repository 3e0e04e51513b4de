"""Other ways to the same poses: on the same clouds, from the same start.

Start: the true pose, turned by 5° about the vertical and 1.5° about a horizontal axis, shifted by 0.5 m in plan and 0.1 m in
height, scale 1; each in a direction by chance. Target: the laser's points, with the walls continued below the water, without
which points above and below it share nothing.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from benchmarks.canal.judge import pose_errors
from benchmarks.canal.literal import paper_pose
from benchmarks.canal.scenes import Case
from tunneldb.arrays import Float
from tunneldb.registration.underwater import SonarCloud
from tunneldb.registration.underwater.observations import MAX_RANGE, Pose, cell_keys, find_patches
from tunneldb.registration.underwater.walls import Walls, find_walls
from tunneldb.simulate.canal import SonarScan

TURN, TILT, SHIFT, RISE = 5.0, 1.5, 0.5, 0.1
VOXEL = 0.1  # m, to which clouds are thinned
REACH = 0.5  # m between points that belong together

Method = Callable[[Float, Float, Float, Float], tuple[Float, Float]]
"""Takes target (n, 3), source (m, 3), and the start's rotation and translation; returns rotation and translation."""


def compare(case: Case) -> list[dict[str, Any]]:
    """Errors and seconds of each method on each scan of a case; those not installed are left out."""
    origin = np.floor(np.median(case.scene.laser, axis=0))
    origin[2] = case.water_level
    laser = case.scene.laser - origin
    walls = find_walls(_thin(laser, 0.03))
    target = np.concatenate([_thin(laser, VOXEL), _continued(walls)])
    rng = np.random.default_rng([case.scene.parameters.seed, 7])
    out = []
    for cloud, true in zip(case.clouds, case.scene.sonar, strict=True):
        rotation, translation = _start(true, origin, rng)
        near = cloud.points[np.linalg.norm(cloud.points, axis=1) < MAX_RANGE]
        source = _thin(near, VOXEL)
        of_scan: dict[str, Any] = {"start": _errors(rotation, translation + origin, 1.0, true, 0.0)}
        for name, method in _methods().items():
            begun = time.perf_counter()
            found = method(target, source, rotation, translation)
            of_scan[name] = _errors(found[0], found[1] + origin, 1.0, true, time.perf_counter() - begun)
        begun = time.perf_counter()
        pose = _least_squares(cloud, walls, rotation, translation)
        of_scan["least squares to walls"] = _errors(
            pose.rotation, pose.translation + origin, pose.scale, true, time.perf_counter() - begun
        )
        begun = time.perf_counter()
        paper = paper_pose(case, cloud, true, walls, origin, rotation)
        seconds = time.perf_counter() - begun
        if paper is None:
            of_scan["Moisan et al., word for word"] = {}
        else:
            of_scan["Moisan et al., word for word"] = _errors(paper[0], paper[1] + origin, 1.0, true, seconds)
        out.append(of_scan)
    return out


def _errors(rotation: Float, translation: Float, scale: float, true: SonarScan, seconds: float) -> dict[str, Any]:
    return pose_errors(rotation, translation, scale, true) | {"seconds": seconds}


def _thin(points: Float, edge: float) -> Float:
    return points[np.unique(cell_keys(points, edge), return_index=True)[1]]


def _continued(walls: Walls) -> Float:
    """Walls below the water, as points."""
    along = np.column_stack([-walls.normal[:, 1], walls.normal[:, 0]])
    step, depth = np.meshgrid(np.arange(-0.2, 0.25, 0.1), np.arange(0.05, 2.5, 0.1))
    plan = walls.foot[:, None, :2] + step.ravel()[None, :, None] * along[:, None]
    plan = plan + (walls.batter[:, None] * depth.ravel()[None])[..., None] * walls.normal[:, None]
    height = np.broadcast_to(-depth.ravel(), plan.shape[:2])
    return np.concatenate([plan, height[..., None]], axis=2).reshape(-1, 3)


def _start(true: SonarScan, origin: Float, rng: np.random.Generator) -> tuple[Float, Float]:
    direction, lean = rng.uniform(0.0, 2.0 * np.pi, 2)
    turn = Rotation.from_rotvec(
        np.radians([TILT * np.cos(lean), TILT * np.sin(lean), TURN * rng.choice([-1.0, 1.0])])
    ).as_matrix()
    shift = np.array([SHIFT * np.cos(direction), SHIFT * np.sin(direction), RISE * rng.choice([-1.0, 1.0])])
    return np.asarray(turn @ true.rotation), true.translation - origin + shift


def _methods() -> dict[str, Method]:
    found: dict[str, Method] = {}
    if find_spec("open3d"):
        found["Open3D, ICP point to plane"] = lambda *given: _open3d(*given, generalized=False)
        found["Open3D, generalized ICP"] = lambda *given: _open3d(*given, generalized=True)
    if find_spec("small_gicp"):
        found["small_gicp, GICP"] = _small_gicp
    if find_spec("kiss_matcher"):
        found["KISS-Matcher, without a start"] = _kiss_matcher
    return found


def _matrix(rotation: Float, translation: Float) -> Float:
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = rotation, translation
    return out


def _open3d(target: Float, source: Float, rotation: Float, translation: Float, *, generalized: bool) -> tuple[Float, Float]:
    import open3d

    clouds = []
    for points in (source, target):
        cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
        cloud.estimate_normals(open3d.geometry.KDTreeSearchParamHybrid(radius=0.4, max_nn=30))
        clouds.append(cloud)
    registration = open3d.pipelines.registration
    start = _matrix(rotation, translation)
    if generalized:
        found = registration.registration_generalized_icp(*clouds, REACH, start)
    else:
        found = registration.registration_icp(*clouds, REACH, start, registration.TransformationEstimationPointToPlane())
    return found.transformation[:3, :3], found.transformation[:3, 3]


def _small_gicp(target: Float, source: Float, rotation: Float, translation: Float) -> tuple[Float, Float]:
    import small_gicp

    found = small_gicp.align(
        target, source, _matrix(rotation, translation), downsampling_resolution=VOXEL, max_correspondence_distance=REACH
    )
    return found.T_target_source[:3, :3], found.T_target_source[:3, 3]


def _kiss_matcher(target: Float, source: Float, rotation: Float, translation: Float) -> tuple[Float, Float]:
    import kiss_matcher

    matcher = kiss_matcher.KISSMatcher(kiss_matcher.KISSMatcherConfig(VOXEL))
    found = matcher.estimate(source, target)
    return np.asarray(found.rotation), np.asarray(found.translation)


def _least_squares(cloud: SonarCloud, walls: Walls, rotation: Float, translation: Float) -> Pose:
    """Patches to the continued walls, all with the same weight: what walls alone tell."""
    patches = find_patches(cloud.points)

    def moved(change: Float) -> Pose:
        turn = Rotation.from_rotvec(change[:3]).as_matrix()
        return Pose(np.asarray(turn @ rotation), translation + change[3:6], 1.0 + float(change[6]))

    first = moved(np.zeros(7)).apply(patches.centre)
    away, piece = walls.tree.query(first[:, :2])
    facing = ((patches.normal @ rotation.T) * walls.normals(piece)).sum(axis=1) > 0.8
    keep = facing & (away < 1.0) & (np.abs(walls.distance(first, piece)) < REACH + SHIFT)
    centre, piece = patches.centre[keep], piece[keep]
    found = least_squares(lambda change: walls.distance(moved(change).apply(centre), piece), np.zeros(7))
    return moved(found.x)
