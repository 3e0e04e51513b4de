"""Registration of sonar scans below the water to the laser's model above it.

After Moisan et al. (2015), with other methods: walls, ladders and overlaps are adjusted jointly, and each direction that the
geometry does not determine is reported.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from tunneldb.arrays import Float
from tunneldb.errors import UserError
from tunneldb.registration.underwater.adjustment import LADDER_SHIFT, Adjusted, adjust, scan_of
from tunneldb.registration.underwater.chain import MAX_OVERLAP_DISTANCE
from tunneldb.registration.underwater.determined import MIN_OPEN_SHIFT, classify_pose
from tunneldb.registration.underwater.laser_ladders import LaserLadder, find_laser_ladders
from tunneldb.registration.underwater.observations import Pose, Rows, cell_keys
from tunneldb.registration.underwater.results import (
    Alternative,
    Ladder,
    LadderFit,
    Registration,
    Residual,
    SonarCloud,
    SonarPose,
)
from tunneldb.registration.underwater.single import Hypothesis, PreparedScan, prepare
from tunneldb.registration.underwater.starting import find_first_poses
from tunneldb.registration.underwater.walls import Walls, find_walls, lower_edge

WALL_VOXEL = 0.03  # m
MIN_MOVEMENT_SIGMA = 2.5  # standard deviations from which a ladder has moved between laser and sonar
MAX_DRY_WALL = 0.1  # m: if the laser sees walls this far below the given water level, the level is wrong


def register(laser: Float, clouds: Sequence[SonarCloud], ladders: Sequence[Ladder], water_level: float) -> Registration:
    """Register sonar scans to the laser's points.

    Parameters
    ----------
    laser : (n, 3) float64 array
        Points around the water level and above, in the tunnel's frame, m.
    clouds : sequence of SonarCloud
    ladders : sequence of Ladder
        Ladders that stand in the water.
    water_level : float
        Height of the water level, m.

    Raises
    ------
    UserError
        If no scan can be registered: there are no walls at the water, or a scan shows none.
    """
    origin = np.array([*np.floor(np.median(laser[:, :2], axis=0)), water_level])
    local = laser - origin
    thin = local[np.unique(cell_keys(local, WALL_VOXEL), return_index=True)[1]]
    walls = find_walls(thin)
    edge = lower_edge(local, walls)  # mirror images in the water are fewer, which thinned points do not show
    if edge < -MAX_DRY_WALL:
        raise UserError(f"the laser sees walls {-edge:.2f} m below the water level and lower; check --water-level")
    found = find_laser_ladders(local, walls, ladders)
    scans, faults = _prepare([_local(cloud, origin) for cloud in clouds], walls)
    seen = {one.placed.ladder.name for one in found}
    first = find_first_poses(scans, walls, found, unseen=len(ladders) > len(found))
    started = first.started
    notes = []
    if edge > MAX_DRY_WALL:
        notes.append(f"the laser sees walls only from {edge:.2f} m above the water; check --water-level")
    notes += [f"ladder {one.name} is not in the laser scan, or has other gaps" for one in ladders if one.name not in seen]
    known = sorted(started)
    adjusted = _adjust_all(scans, started, known, walls, found)
    moved = () if adjusted is None else _moved(found, adjusted)
    poses = []
    for i, cloud in enumerate(clouds):
        if adjusted is None or i not in started:
            poses.append(_unknown(cloud, first.alternatives.get(i, ()), origin, _walls_of(scans.get(i))))
            continue
        k = known.index(i)
        pose = adjusted.poses[k]
        state, open_directions = classify_pose(adjusted.covariance[k], _along(walls, pose))
        if state == "determined" and set(started[i].ladders) & set(moved):
            state, open_directions = "weak", (*open_directions, "ladders disagree")
        residuals = _residuals(adjusted.rows, k, [clouds[j].path.name for j in known])
        here = (Alternative(pose.rotation, pose.translation + origin, pose.scale, 1.0),) if state == "undetermined" else ()
        poses.append(
            SonarPose(
                cloud.path, pose.rotation, pose.translation + origin, pose.scale, adjusted.covariance[k], state,
                open_directions, residuals, here, _walls_of(scans[i]),
            )
        )  # fmt: skip
    notes += [f"ladder {one.placed.ladder.name}: its gaps also fit {_shifts(one)} m higher" for one in found if one.ties]
    notes += [
        f"ladder {found[k].placed.ladder.name} is not where the laser saw it; the ladder or the tripod may have moved"
        for k in moved
    ]
    why = [
        f"{scan.path.name} is not determined {', '.join(scan.undetermined)}"
        for scan in poses
        if scan.state == "undetermined" and np.isfinite(scan.scale)
    ]
    why += [f"{clouds[i].path.name} has no pose: {reason}" for i, reason in first.reasons.items()]
    fits = [_fit(one, k, origin, clouds, started) for k, one in enumerate(found)]
    plan = walls.profile.place + origin[:2]
    return Registration(tuple(poses), tuple(fits), water_level, (*notes, *faults, *why), plan)


def _walls_of(scan: PreparedScan | None) -> Float:
    return np.zeros((0, 3)) if scan is None else scan.columns.centre


def _local(cloud: SonarCloud, origin: Float) -> SonarCloud:
    """Return the cloud with its approximate place in the local frame."""
    if cloud.near is None:
        return cloud
    return replace(cloud, near=replace(cloud.near, place=cloud.near.place - origin[:2]))


def _prepare(clouds: Sequence[SonarCloud], walls: Walls) -> tuple[dict[int, PreparedScan], list[str]]:
    """Level scans, by their index in the list, and return the errors of those that cannot be levelled."""
    scans, faults = {}, []
    for i, cloud in enumerate(clouds):
        try:
            scans[i] = prepare(cloud, walls)
        except UserError as error:
            faults.append(f"{cloud.path.name}: {error}")
    if not scans:
        raise UserError(faults[0])
    return scans, faults


def _adjust_all(
    prepared: Mapping[int, PreparedScan],
    started: Mapping[int, Hypothesis],
    known: Sequence[int],
    walls: Walls,
    found: Sequence[LaserLadder],
) -> Adjusted | None:
    if not known:
        return None
    scans = []
    for i in known:
        scan, one = prepared[i], started[i]
        scans.append(
            scan_of(scan.cloud.points, scan.patches, scan.smooth, scan.columns, scan.level, one.pose, one.ladders, found)
        )
    place = np.array([scan.pose.translation for scan in scans])
    pairs = [
        (a, b)
        for a in range(len(scans))
        for b in range(a + 1, len(scans))
        if np.linalg.norm(place[a] - place[b]) < MAX_OVERLAP_DISTANCE
    ]
    return adjust(scans, walls, found, pairs)


def _moved(found: Sequence[LaserLadder], adjusted: Adjusted) -> tuple[int, ...]:
    """Return the ladders whose place or height differs between sonar and laser by more than chance."""
    out = []
    for k, (before, now) in enumerate(zip(found, adjusted.ladders, strict=True)):
        axes = before.placed.axes[:2]
        sigma = np.sqrt(np.diag(axes @ before.covariance[3:6, 3:6] @ axes.T) + LADDER_SHIFT**2)
        if (np.abs(axes @ (now.origin - before.placed.origin)) > MIN_MOVEMENT_SIGMA * sigma).any():
            out.append(k)
    return tuple(out)


def _along(walls: Walls, pose: Pose) -> Float:
    """Return the direction along the canal at a scanner, (2,)."""
    _, piece = walls.tree.query(pose.translation[:2])
    normal = walls.normal[piece]
    return np.array([-normal[1], normal[0]])


def _unknown(cloud: SonarCloud, options: Sequence[tuple[Hypothesis, float]], origin: Float, walls: Float) -> SonarPose:
    """Return the state of a scan without a pose, with its possible poses; directions in which these differ are open."""
    nothing = np.full((7, 7), np.nan)
    alternatives = tuple(
        Alternative(one.pose.rotation, one.pose.translation + origin, one.pose.scale, probability)
        for one, probability in options
    )
    return SonarPose(
        cloud.path, np.full((3, 3), np.nan), np.full(3, np.nan), np.nan, nothing, "undetermined",
        _open_directions(alternatives), (), alternatives, walls,
    )  # fmt: skip


def _open_directions(alternatives: Sequence[Alternative]) -> tuple[str, ...]:
    """Return the names of the directions in which possible poses differ; of all of them if there are none."""
    if len(alternatives) < 2:
        return "along the tunnel", "height", "half turn"
    place = np.array([one.translation for one in alternatives])
    ahead = np.array([one.rotation[:2, 0] for one in alternatives])
    names = {
        "along the tunnel": np.ptp(place[:, :2], axis=0).max() > MIN_OPEN_SHIFT,
        "height": np.ptp(place[:, 2]) > MIN_OPEN_SHIFT,
        "half turn": (ahead @ ahead[0]).min() < 0.0,
    }
    return tuple(name for name, is_open in names.items() if is_open)


def _residuals(rows: Sequence[Rows], scan: int, names: Sequence[str]) -> tuple[Residual, ...]:
    out = []
    for one in rows:
        if scan not in (one.scan, one.other) or one.kind == "sound":
            continue
        kind, name = ("wall", "plan") if one.kind == "profile" else (one.kind, one.name)
        if one.other is not None:
            name = names[one.other if one.scan == scan else one.scan]
        absolute = np.abs(one.residual)
        out.append(Residual(kind, name, len(absolute), float(np.median(absolute)), float(np.percentile(absolute, 95))))
    return tuple(out)


def _shifts(one: LaserLadder) -> str:
    return " or ".join(f"{shift:.2f}" for shift in one.ties)


def _fit(one: LaserLadder, k: int, origin: Float, clouds: Sequence[SonarCloud], started: Mapping[int, Hypothesis]) -> LadderFit:
    placed = one.placed
    scans = tuple(cloud.path.name for i, cloud in enumerate(clouds) if i in started and k in started[i].ladders)
    across, up, out = placed.axes
    return LadderFit(placed.ladder.name, placed.origin + origin, up, across, out, one.rms, one.rungs, scans)
