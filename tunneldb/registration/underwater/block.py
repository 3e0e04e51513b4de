"""Registration of sonar scans below the water to the laser's model above it.

After Moisan et al. (2015), with other means: walls, ladders and overlaps are adjusted jointly, and each direction that the
geometry leaves open is named.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tunneldb.arrays import Float
from tunneldb.errors import UserError
from tunneldb.registration.underwater.adjustment import Adjusted, adjust, scan_of
from tunneldb.registration.underwater.chain import OVERLAP, Reliefs, agreement, place_beside
from tunneldb.registration.underwater.determined import judge
from tunneldb.registration.underwater.laser_ladders import LaserLadder, find_laser_ladders
from tunneldb.registration.underwater.observations import Pose, Rows, cell_keys
from tunneldb.registration.underwater.results import Ladder, LadderFit, Registration, Residual, SonarCloud, SonarPose
from tunneldb.registration.underwater.single import PreparedScan, StartedScan, prepare, start
from tunneldb.registration.underwater.walls import Walls, find_walls

WALL_VOXEL = 0.03  # m


def register(laser: Float, clouds: Sequence[SonarCloud], ladders: Sequence[Ladder], water_level: float) -> Registration:
    """Register sonar scans to the laser's points.

    Parameters
    ----------
    laser : (n, 3) float64 array
        Points about the water's level and above, in the tunnel's frame, m.
    clouds : sequence of SonarCloud
    ladders : sequence of Ladder
        Those that stand in the water.
    water_level : float
        Height of the water, m.

    Raises
    ------
    UserError
        Nothing can be said of any scan: there are no walls at the water, or a scan shows none.
    """
    origin = np.array([*np.floor(np.median(laser[:, :2], axis=0)), water_level])
    local = laser - origin
    walls = find_walls(local[np.unique(cell_keys(local, WALL_VOXEL), return_index=True)[1]])
    found = find_laser_ladders(local, walls, ladders)
    scans, faults = _prepare(clouds, walls)
    seen = {one.placed.ladder.name for one in found}
    started = _start(scans, walls, found, unseen=len(seen) < len(ladders))
    notes = [f"ladder {one.name} is not seen by the laser" for one in ladders if one.name not in seen]
    known = sorted(started)
    adjusted = _adjust_all(scans, started, known, walls, found)
    poses = []
    for i, cloud in enumerate(clouds):
        if adjusted is None or i not in started:
            poses.append(_unknown(cloud))
            continue
        k = known.index(i)
        pose = adjusted.poses[k]
        state, open_directions = judge(adjusted.covariance[k], _along(walls, pose))
        residuals = _residuals(adjusted.rows, k, [clouds[j].path.name for j in known])
        poses.append(
            SonarPose(
                cloud.path, pose.rotation, pose.translation + origin, pose.scale, adjusted.covariance[k], state,
                open_directions, residuals,
            )
        )  # fmt: skip
    fits = [_fit(one, k, origin, clouds, started) for k, one in enumerate(found)]
    return Registration(tuple(poses), tuple(fits), water_level, (*notes, *faults))


def _prepare(clouds: Sequence[SonarCloud], walls: Walls) -> tuple[dict[int, PreparedScan], list[str]]:
    """Level scans, by their places in the list, and say what is wrong with those that cannot be."""
    scans, faults = {}, []
    for i, cloud in enumerate(clouds):
        try:
            scans[i] = prepare(cloud, walls)
        except UserError as error:
            faults.append(f"{cloud.path.name}: {error}")
    if not scans:
        raise UserError(faults[0])
    return scans, faults


def _start(
    scans: Mapping[int, PreparedScan], walls: Walls, found: Sequence[LaserLadder], *, unseen: bool
) -> dict[int, StartedScan]:
    """First poses: by the ladders that a scan sees, then beside scans that have one, as far as that leads.

    Raises
    ------
    UserError
        At least as many of those that see a ladder are upside down as are not.
    """
    started, upside_down = {}, []
    for i, scan in scans.items():
        try:
            one = start(scan, walls, found)
        except UserError as error:
            upside_down.append(error)
            continue
        if one is not None:
            started[i] = one
    if upside_down and len(upside_down) >= len(started):  # one alone may have taken one ladder for another
        raise upside_down[0]
    reliefs = Reliefs(scans)
    started = _agreeing(reliefs, started, unseen=unseen)
    left = [i for i in scans if i not in started]
    while started and left:
        placed = {i: one for i in left if (one := place_beside(i, reliefs, started, walls, found)) is not None}
        if not placed:
            break
        started |= placed
        left = [i for i in left if i not in placed]
    return _agreeing(reliefs, started, unseen=unseen)


def _agreeing(
    reliefs: Reliefs,
    started: Mapping[int, StartedScan],
    *,
    unseen: bool,
) -> dict[int, StartedScan]:
    """Those of the scans that do not contradict each other where they see the same bed: one ladder looks like another.

    Where there are ladders that the laser does not see (``unseen``), a scan that sees one ladder alone may have taken such
    for it: it needs another scan's word.
    """
    kept = dict(started)
    said = {
        (a, b): agreement(a, b, (started[a].pose, started[b].pose), reliefs)
        for a in started
        for b in started
        if a < b and np.linalg.norm(started[a].pose.translation - started[b].pose.translation) < OVERLAP
    }

    def votes(i: int) -> tuple[int, int]:
        of = [value for (a, b), value in said.items() if i in (a, b) and a in kept and b in kept]
        return of.count(1), of.count(-1)

    while kept:
        against = {i: votes(i) for i in kept if votes(i)[1]}
        if not against:
            break
        worst = min(for_it - no for for_it, no in against.values())
        for i in [i for i, (for_it, no) in against.items() if for_it - no == worst]:
            del kept[i]
    if unseen:
        kept = {i: one for i, one in kept.items() if len(one.ladders) > 1 or votes(i)[0]}
    return kept


def _adjust_all(
    prepared: Mapping[int, PreparedScan],
    started: Mapping[int, StartedScan],
    known: Sequence[int],
    walls: Walls,
    found: Sequence[LaserLadder],
) -> Adjusted | None:
    if not known:
        return None
    scans = []
    for i in known:
        scan, one = prepared[i], started[i]
        scans.append(scan_of(scan.cloud.points, scan.patches, scan.edges, one.pose, one.ladders, found))
    place = np.array([scan.pose.translation for scan in scans])
    pairs = [
        (a, b) for a in range(len(scans)) for b in range(a + 1, len(scans)) if np.linalg.norm(place[a] - place[b]) < OVERLAP
    ]
    return adjust(scans, walls, found, pairs)


def _along(walls: Walls, pose: Pose) -> Float:
    """Direction along the canal at a scanner, (2,)."""
    _, piece = walls.tree.query(pose.translation[:2])
    normal = walls.normal[piece]
    return np.array([-normal[1], normal[0]])


def _unknown(cloud: SonarCloud) -> SonarPose:
    nothing = np.full((7, 7), np.nan)
    return SonarPose(
        cloud.path, np.full((3, 3), np.nan), np.full(3, np.nan), np.nan, nothing, "undetermined",
        ("along the tunnel", "height", "half turn"), (),
    )  # fmt: skip


def _residuals(rows: Sequence[Rows], scan: int, names: Sequence[str]) -> tuple[Residual, ...]:
    out = []
    for one in rows:
        if scan not in (one.scan, one.other):
            continue
        name = one.name
        if one.other is not None:
            name = names[one.other if one.scan == scan else one.scan]
        absolute = np.abs(one.residual)
        out.append(Residual(one.kind, name, len(absolute), float(np.median(absolute)), float(np.percentile(absolute, 95))))
    return tuple(out)


def _fit(
    one: LaserLadder, k: int, origin: Float, clouds: Sequence[SonarCloud], started: Mapping[int, StartedScan]
) -> LadderFit:
    placed = one.placed
    scans = tuple(cloud.path.name for i, cloud in enumerate(clouds) if i in started and k in started[i].ladders)
    across, up, out = placed.axes
    return LadderFit(placed.ladder.name, placed.origin + origin, up, across, out, one.rms, one.rungs, scans)
