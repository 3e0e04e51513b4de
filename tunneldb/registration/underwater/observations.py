"""Observations between a sonar scan, the laser's model and other scans, as linear equations of small changes of the poses.

The changes of a pose are those of `results.PARAMETERS`: a turn about the tunnel's axes through the scanner, a shift of the
scanner, and a change of scale.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from tunneldb.arrays import Float, Int64
from tunneldb.registration.underwater.ladder_shape import PlacedLadder, nearest_element
from tunneldb.registration.underwater.walls import Walls
from tunneldb.registration.underwater.water_surface import Level

POSE = 7  # parameters of a pose
RANGE_NOISE = 0.015  # m, of a BV5000 (Moisan et al., 2015, section 3)
BEAM = np.radians(1.0)  # width of a beam there
BEAM_SIGMA = BEAM / np.sqrt(12.0)  # an echo comes from anywhere in the beam
BEAM_SPREAD = BEAM / np.sqrt(8.0 * np.log(2.0))  # of its power, assumed normally distributed
STRETCH = 2.0  # m of wall or bed: its relief is the same for all scans
SHARED = 0.002  # m: common error of a stretch of wall or bed, by relief and slanting beams
BATTER_SHARED = 0.01  # tangent: batter of a stretch below the water against the rest of its side
BARS_BEAMS = 4.0  # beams across a bar whose errors are independent: beams that hit it overlap
WATERLINE_NOISE = 0.025  # m, of upper edges of walls: half a bin, and half of the rest of half a beam
WATERLINE_SHARED = 0.01  # m
WATER_MOVEMENT = 0.015  # m of the water between two scans
FIRMNESS = 30.0  # factor by which a height is held that only the water gives
MAX_UPRIGHT = 0.4  # greatest vertical component of the normal of an upright wall
PROFILE_SPACING, PROFILE_NOISE = 0.15, 0.01  # m between a patch and the plan's nearest point, along the wall; m of the plan
PROFILE_STRETCH, PROFILE_SHARED = 1.0, 0.03  # m of a flank or recess; m, its common error above and below the water
MIN_PROFILE_COSINE, MIN_PROFILE_PATCHES = 0.8, 4
MAX_WALL_DISTANCE = 1.0  # m in plan, of a column from the wall that it belongs to
MIN_FACING_COSINE = 0.9  # least cosine between the normals of compared patches
WALL_DEPTH = 3.0  # m below the water
WALL_TOP = 0.05  # m below the water; closer to it, echoes by way of the surface disturb
RELIEF = 0.012  # m: distance of a patch of stones from its wall's plane
MIN_INCIDENCE_COSINE = 0.35  # least cosine of incidence of compared patches
MIN_SLANT_DISTANCE = 0.5  # m from a surface from which echoes of slanting beams come from nearer
MAX_RANGE = 12.0  # m
MIN_BED_COSINE = 0.6  # least cosine between the vertical and the normal of the bed
STILES_SIDE = 0.05  # m from a stile's axis within which an echo is from the stile
MIXTURE_ROUNDS = 10
MIN_INFORMATION_SHARE = (
    0.02  # least share of a rung's information, where rungs are hardly separable from the space between them
)
MAX_LADDER_DISTANCE = 4.0  # greatest distance of an echo from its ladder, standard deviations
PATCH = 0.3  # m
PATCH_POINTS = 8
MAX_PATCH_SPREAD = 0.035  # m: spread of a patch across its plane
SMOOTH_PATCH = 0.2  # m; size of patches for the comparison of two scans
SMOOTH_POINTS = 3
NORMAL_RADIUS = 0.4  # m: radius of the patches whose plane gives the normal
MAX_NORMAL_PATCHES, MIN_NORMAL_PATCHES = 13, 6  # of these patches
MAX_PATCH_DISTANCE = 0.3  # m between the centres of compared patches of two scans
MIN_SMOOTH_COSINE = 0.2  # least cosine of incidence by those normals


@dataclass(frozen=True)
class Pose:
    """``rotation @ (scale * point) + translation``."""

    rotation: Float
    translation: Float
    scale: float

    def apply(self, points: Float) -> Float:
        """Return points (n, 3) of the file in the tunnel's axes."""
        return np.asarray(self.scale * points @ self.rotation.T + self.translation)

    def to_file(self, points: Float) -> Float:
        """Return points (n, 3) of the tunnel's axes in those of the file."""
        return np.asarray((points - self.translation) @ self.rotation / self.scale)


@dataclass(frozen=True)
class Rows:
    """Equations: ``residual + design @ change ≈ 0``.

    Attributes
    ----------
    residual : (n,) float64 array
        Residuals, m.
    sigma : (n,) float64 array
        Standard deviations, m.
    poses : (n, 7) float64 array
        Derivatives with respect to the changes of the pose of scan ``scan``.
    scan : int
    other : int or None
        Second scan, with derivatives ``other_poses``.
    common : (n, c) float64 array
        Derivatives with respect to the common parameters ``columns``.
    columns : (c,) int64 array
    group : (n,) int64 array
        Groups of correlated rows; rows of walls and of overlaps (places in plan) are also correlated with those of other scans.
    shared : (n,) float64 array
        Standard deviation of the common error of a group, m.
    kind, name : str
    scatter : (n,) float64 array, optional
        Standard deviations of single residuals, if ``sigma`` is larger because rows of a group repeat the same error.
    """

    residual: Float
    sigma: Float
    poses: Float
    scan: int
    other: int | None
    other_poses: Float | None
    common: Float
    columns: Int64
    group: Int64
    shared: Float
    kind: str
    name: str
    scatter: Float | None = None


def cell_keys(points: Float, edge: float) -> Int64:
    """Return the numbers (n,) of the cubic cells that contain points (n, 3) within some kilometres."""
    cell = np.floor(points / edge).astype(np.int64) + (1 << 20)
    return np.asarray((cell[:, 0] << 42) | (cell[:, 1] << 21) | cell[:, 2])


def _stretches(points: Float) -> Int64:
    """Return the numbers (n,) of the stretches of wall or bed that contain points (n, 3), at any height."""
    return cell_keys(np.where([True, True, False], points, 0.0), STRETCH)


def pose_derivatives(points: Float, pose: Pose, normal: Float) -> Float:
    """Return the derivatives (n, 7) of points (n, 3), in the tunnel's axes, along normals (n, 3)."""
    arm = points - pose.translation
    scale = (arm * normal).sum(axis=1)[:, None] / pose.scale
    return np.hstack([np.cross(arm, normal), normal, scale])


@dataclass(frozen=True)
class Patches:
    """Flat patches of a scan in its file's axes: centroid and normal (k, 3), points (k,), spread across (k,) m."""

    centre: Float
    normal: Float
    count: Int64
    spread: Float

    @cached_property
    def tree(self) -> cKDTree:
        """Search tree of their centres."""
        return cKDTree(self.centre)


def find_patches(points: Float) -> Patches:
    """Return cells of a scan whose points lie on a plane, not at grazing incidence, with that plane's normal."""
    centre, count, value, vector = _cells(points, PATCH)
    normal = _towards_scanner(vector[:, :, 0], centre)
    spread = np.sqrt(np.maximum(value[:, 0], 0.0))
    keep = (count >= PATCH_POINTS) & (spread < MAX_PATCH_SPREAD) & (value[:, 1] > (PATCH / 8.0) ** 2)
    keep &= _cosine(normal, centre) > MIN_INCIDENCE_COSINE
    return Patches(centre[keep], normal[keep], count[keep], spread[keep])


def find_smooth_patches(points: Float) -> Patches:
    """Return smaller cells, with the normals of planes through the centres of neighbouring cells.

    A beam's echoes lie on an arc around the scanner, so that the points of one patch lean towards it, the more the farther away
    it is; and they are few. Two scans whose patches are compared along such normals attract each other.
    """
    centre, count, value, _ = _cells(points, SMOOTH_PATCH)
    spread = np.sqrt(np.maximum(value[:, 0], 0.0))
    keep = (count >= SMOOTH_POINTS) & (spread < MAX_PATCH_SPREAD) & (value[:, 1] > (SMOOTH_PATCH / 8.0) ** 2)
    centre, count, spread = centre[keep], count[keep], spread[keep]
    if len(centre) < MAX_NORMAL_PATCHES:
        return Patches(centre[:0], centre[:0], count[:0], spread[:0])
    reach, about = cKDTree(centre).query(centre, MAX_NORMAL_PATCHES, distance_upper_bound=NORMAL_RADIUS)
    valid = np.isfinite(reach)[..., None]
    number = valid.sum(axis=1)
    away = np.where(valid, centre[np.where(valid[..., 0], about, 0)] - centre[:, None], 0.0)
    away = np.where(valid, away - (away.sum(axis=1) / number)[:, None], 0.0)
    value, vector = np.linalg.eigh(np.swapaxes(away, 1, 2) @ away / number[..., None])
    normal = _towards_scanner(vector[:, :, 0], centre)
    keep = (
        (number[:, 0] >= MIN_NORMAL_PATCHES) & (value[:, 0] < MAX_PATCH_SPREAD**2) & (value[:, 1] > (SMOOTH_PATCH / 3.0) ** 2)
    )
    keep &= _cosine(normal, centre) > MIN_SMOOTH_COSINE
    return Patches(centre[keep], normal[keep], count[keep], spread[keep])


def _cells(points: Float, edge: float) -> tuple[Float, Int64, Float, Float]:
    """Return centroids (k, 3), numbers of points (k,), variances (k, 3) and axes (k, 3, 3) of the points in cubic cells."""
    near = points[np.linalg.norm(points, axis=1) < MAX_RANGE]
    _, number, count = np.unique(cell_keys(near, edge), return_inverse=True, return_counts=True)
    centre = np.column_stack([np.bincount(number, near[:, k]) for k in range(3)]) / count[:, None]
    away = near - centre[number]
    moments = np.empty((len(count), 3, 3))
    for a in range(3):
        for b in range(a, 3):
            moments[:, a, b] = moments[:, b, a] = np.bincount(number, away[:, a] * away[:, b]) / count
    value, vector = np.linalg.eigh(moments)
    return centre, count, value, vector


def _towards_scanner(normal: Float, centre: Float) -> Float:
    return -normal * np.sign((normal * centre).sum(axis=1))[:, None]


def _cosine(normal: Float, centre: Float) -> Float:
    """Return the cosines of incidence (k,) of beams on patches."""
    return np.asarray(-(normal * centre).sum(axis=1) / np.maximum(np.linalg.norm(centre, axis=1), 1e-9))


def nearer_by_slant(points: Float, scanner: Float, normal: Float) -> Float:
    """Return the offset (n,), m, of a beam's strongest echo in front of a surface with normals (n, 3) if its slant is 1.

    On a slanting surface the nearer side of a beam echoes more strongly, so that the echo comes from a direction off the beam's
    centre by ``slant * spread² / tan(elevation over the surface)``. The slant is 1 for the power of Lambert's law alone, 3 if
    the strongest range cell is used, and less on a rough surface, where stones that face the beam dominate.
    """
    arm = scanner - points
    over = np.maximum((arm * normal).sum(axis=1), MIN_SLANT_DISTANCE)
    return np.asarray(BEAM_SPREAD**2 * np.maximum((arm**2).sum(axis=1) - over**2, 0.0) / over)


def wall_rows(
    patches: Patches, pose: Pose, walls: Walls, common: Float, scan: int, columns: Int64, within: float
) -> list[Rows]:
    """Compare a scan's patches with walls at most ``within`` m away.

    Moves along a wall change nothing: derivatives are along the normals of its course.

    ``common`` are the offset of sonar ranges in front of masonry relative to the laser, m, and the slant (`nearer_by_slant`).
    ``columns`` are the indices, among the common parameters, of the changes of batter of either side, and of these two.
    """
    zero, slant = common
    centre = pose.apply(patches.centre)
    away, piece = walls.tree.query(centre[:, :2], distance_upper_bound=1.0)
    wet = (centre[:, 2] < -WALL_TOP) & (centre[:, 2] > -WALL_DEPTH) & np.isfinite(away)
    piece = np.where(wet, piece, 0)
    wet &= ~walls.rough[piece]
    normal = walls.normals(piece)
    off = walls.distance(centre, piece)
    facing = ((patches.normal @ pose.rotation.T) * normal).sum(axis=1) > MIN_FACING_COSINE
    keep = wet & facing & (np.abs(off) < within)
    centre, piece, normal, off = centre[keep], piece[keep], normal[keep], off[keep]
    sigma = np.sqrt(
        patches.spread[keep] ** 2 / patches.count[keep]
        + RELIEF**2
        + walls.sigma[piece] ** 2
        + (walls.sigma_batter[piece] * centre[:, 2]) ** 2
    )
    shared = np.hypot(SHARED, BATTER_SHARED * centre[:, 2])
    batter = walls.along[piece] * centre[:, 2] / np.sqrt(1.0 + walls.batter[piece] ** 2)
    facing_course = np.column_stack([walls.course[piece], walls.batter[piece]])
    facing_course /= np.linalg.norm(facing_course, axis=1)[:, None]
    nearer = nearer_by_slant(centre, pose.translation, normal)
    stretch = _stretches(walls.foot[piece])
    out = []
    for side in (0, 1):
        rows = walls.side[piece] == side
        if rows.any():
            design = np.column_stack([batter[rows], np.full(int(rows.sum()), -1.0), -nearer[rows]])
            moves = pose_derivatives(centre[rows], pose, facing_course[rows])
            out.append(
                Rows(
                    off[rows] - zero - slant * nearer[rows], sigma[rows], moves, scan, None, None, design,
                    columns[[side, 2, 3]], stretch[rows], shared[rows], "wall", "left" if side else "right",
                )
            )  # fmt: skip
    return out


def profile_rows(patches: Patches, pose: Pose, walls: Walls, scan: int, columns: Int64, within: float) -> Rows | None:
    """Compare a scan's columns with the plan of the walls at the waterline: flanks of piers, ends, recesses, rough walls.

    Columns that face straight pieces of wall are left to `wall_rows`. The others lean as the wall beside them does, in its
    direction: flanks stay upright, and a change of batter below the water is only that of walls along the canal. ``columns``
    are the indices, among the common parameters, of the changes of batter of either side.
    """
    profile = walls.profile
    if len(profile.place) == 0:
        return None
    centre, facing = pose.apply(patches.centre), patches.normal @ pose.rotation.T
    upright = (np.abs(facing[:, 2]) < MAX_UPRIGHT) & (centre[:, 2] < -WALL_TOP) & (centre[:, 2] > -WALL_DEPTH)
    away, k = profile.tree.query(centre[:, :2], distance_upper_bound=within + PROFILE_SPACING)
    near = np.flatnonzero(upright & np.isfinite(away))
    k, centre, facing = k[near], centre[near], facing[near]
    normal = profile.normal[k] * np.sign((profile.normal[k] * facing[:, :2]).sum(axis=1))[:, None]
    level = ((centre[:, :2] - profile.place[k]) * normal).sum(axis=1)
    beside = np.sqrt(np.maximum(away[near] ** 2 - level**2, 0.0))
    to_wall, piece = walls.tree.query(centre[:, :2], distance_upper_bound=MAX_WALL_DISTANCE)
    known = np.isfinite(to_wall)
    piece = np.where(known, piece, 0)
    cosine = np.where(known, (walls.normal[piece] * normal).sum(axis=1), 0.0)
    off = level + walls.batter[piece] * cosine * centre[:, 2]
    straight = known & ~walls.rough[piece] & (np.abs(cosine) > MIN_FACING_COSINE)
    straight &= np.abs(walls.distance(centre, piece)) < 2.0 * PROFILE_SPACING
    keep = ~straight & ((normal * facing[:, :2]).sum(axis=1) > MIN_PROFILE_COSINE)
    keep &= (np.abs(off) < within) & (beside < PROFILE_SPACING)
    if keep.sum() < MIN_PROFILE_PATCHES:
        return None
    near, centre, off, normal = near[keep], centre[keep], off[keep], normal[keep]
    side, lean = walls.side[piece[keep]], walls.along[piece[keep]] * cosine[keep] * centre[:, 2]
    sigma = np.sqrt(patches.spread[near] ** 2 / patches.count[near] + RELIEF**2 + PROFILE_NOISE**2)
    shared = np.hypot(PROFILE_SHARED, profile.sigma(centre[:, 2]))
    upright_normal = np.column_stack([normal, np.zeros(len(normal))])
    lumps = profile.growth > PROFILE_SHARED  # rock, whose forms are longer than a pier or a recess
    group = cell_keys(centre * [1.0, 1.0, 0.0], STRETCH if lumps else PROFILE_STRETCH)
    _, number, count = np.unique(group, return_inverse=True, return_counts=True)
    scatter = np.hypot(sigma, shared)
    sigma = np.hypot(sigma, np.sqrt(count[number]) * shared)  # a group weighs as one observation of this accuracy
    return Rows(
        off, sigma, pose_derivatives(centre, pose, upright_normal), scan, None, None,
        lean[:, None] * (side[:, None] == [0, 1]), columns, group,
        shared, "profile", "", scatter,
    )  # fmt: skip


def waterline_rows(level: Level, pose: Pose, bias: float, scan: int, column: int, *, firm: bool) -> Rows | None:
    """Return heights of a scan's points at the water's level over the water.

    ``bias`` m is common to all scans. The water may have moved between scans: the last row, of the mean height, has that
    uncertainty; the others state only that the water is level. With ``firm`` the last row weighs more than it is certain, and
    does not change ``bias``: of a scan without ladders nothing else gives the height. Battered walls only seem to: an error of
    a few millimetres of all of them is decimetres of height.
    """
    count = len(level.points)
    if count == 0:
        return None
    place = pose.apply(level.points)
    up = np.tile([0.0, 0.0, 1.0], (count, 1))
    design = pose_derivatives(place, pose, up)
    mean, height = design.mean(axis=0), place[:, 2] - bias
    noise = level.noise / np.sqrt(count)
    shared = WATERLINE_SHARED * level.noise / WATERLINE_NOISE / np.sqrt(count)
    common = np.zeros((count + 1, 1))
    if not firm:
        common[-1] = -1.0
    return Rows(
        np.append(height - height.mean(), height.mean()),
        np.append(np.full(count, level.noise), np.hypot(noise, WATER_MOVEMENT) / (FIRMNESS if firm else 1.0)),
        np.vstack([design - mean, mean]), scan, None, None, common, np.array([column]), np.arange(count + 1),
        np.append(np.full(count, shared), WATER_MOVEMENT), "waterline", "",
    )  # fmt: skip


def ladder_rows(
    points: Float,
    pose: Pose,
    placed: PlacedLadder,
    depth: float,
    scan: int,
    columns: tuple[int, int],
    within: float,
) -> Rows | None:
    """Return distances of a scan's points (n, 3), file's axes, from a ladder's axes below the water, across and along the beam.

    A sonar detects the near surface of a bar, or ``depth`` m behind it. ``columns`` are the indices, among the common
    parameters, of that depth, and of the first of the ladder's turn and shift.
    """
    depth_column, first_column = columns
    space = pose.apply(points)
    own = placed.to_ladder(space)
    ladder = placed.ladder
    reach = np.linalg.norm(space - pose.translation, axis=1)
    room = np.maximum(within, MAX_LADDER_DISTANCE * BEAM_SIGMA * reach)
    box = (np.abs(own[:, 0]) < placed.gap / 2.0 + room) & (np.abs(own[:, 2]) < room)
    box &= (own[:, 1] > ladder.height[0] - 0.3) & (own[:, 1] < ladder.height[-1] + 0.3)
    space, own, reach = space[box], own[box], reach[box]
    if len(own) < 30:
        return None
    which, away = nearest_element(own, placed)
    axis = np.where(which[:, None] < 2, [[0.0, 1.0, 0.0]], [[1.0, 0.0, 0.0]]) @ placed.axes
    ray = space - pose.translation
    ray = ray - (ray * axis).sum(axis=1)[:, None] * axis
    ray /= np.linalg.norm(ray, axis=1)[:, None]
    side = np.cross(axis, ray)
    vector = away @ placed.axes + (placed.radius(which) - depth)[:, None] * ray
    along, across = (vector * ray).sum(axis=1), (vector * side).sum(axis=1)
    sigma_along = np.full(len(own), np.hypot(RANGE_NOISE, 0.005))
    sigma_across = np.hypot(BEAM_SIGMA * reach, 0.005)
    near = np.hypot(along / sigma_along, across / sigma_across) < max(within / RANGE_NOISE / 4.0, MAX_LADDER_DISTANCE)
    if near.sum() < 30:
        return None
    arm = space[near] - placed.origin
    poses, common = [], []
    for direction, behind in ((ray[near], -1.0), (side[near], 0.0)):
        poses.append(pose_derivatives(space[near], pose, direction))
        common.append(np.hstack([np.full((len(arm), 1), behind), -np.cross(arm, direction), -direction]))
    bar = which[near]
    shares = np.bincount(bar, _information_share(own[near], bar, away[near], sigma_across[near], placed))[bar]
    return Rows(
        np.concatenate([along[near], across[near]]),
        np.concatenate([sigma_along[near], sigma_across[near]]),
        np.vstack(poses), scan, None, None, np.vstack(common),
        np.concatenate([[depth_column], first_column + np.arange(6)]),
        np.concatenate([bar, bar + 1000]),
        np.concatenate([np.full(len(bar), SHARED), sigma_across[near] / np.sqrt(np.minimum(shares, BARS_BEAMS))]),
        "ladder", ladder.name,
    )  # fmt: skip


def _information_share(own: Float, which: Int64, away: Float, sigma: Float, placed: PlacedLadder) -> Float:
    """Return the share (n,) of its information across the beam that each point has; 1 for points of stiles.

    At long range and at a slant, echoes of stiles mask those of rungs, and echoes from between the stiles carry little
    information about rungs. The model is a mixture of echoes of rungs and of uniformly distributed others, by expectation
    maximisation (McLachlan and Peel, 2000, section 2.8; the information of incomplete data is that of Louis, 1982).
    """
    share = np.where(which < 2, 1.0, MIN_INFORMATION_SHARE)
    inside = (which >= 2) & (np.abs(own[:, 0]) < placed.gap / 2.0 - STILES_SIDE)
    if not inside.any():
        return share
    off = (away[inside, 1] / sigma[inside]) ** 2
    echo = np.exp(-0.5 * off) / (np.sqrt(2.0 * np.pi) * sigma[inside])
    even = 1.0 / float(np.mean(np.diff(placed.ladder.height)))
    rungs = 0.5
    for _ in range(MIXTURE_ROUNDS):
        mine = rungs * echo / (rungs * echo + (1.0 - rungs) * even)
        rungs = float(mine.mean())
    information = float((mine - mine * (1.0 - mine) * off).sum() / mine.sum())
    share[inside] = np.maximum(mine * information, MIN_INFORMATION_SHARE)
    return share


def overlap_rows(
    one: Patches,
    other: Patches,
    poses: tuple[Pose, Pose],
    common: Float,
    scans: tuple[int, int],
    columns: Int64,
    within: float,
) -> Rows | None:
    """Return distances between smooth patches of two scans that are close to each other and face the same way.

    ``common`` are the slants of walls and of the bed (`nearer_by_slant`), and the shares by which the relief of either seems
    nearer to a scanner along the canal, since the near face of a crest or a stone echoes. ``columns`` are their indices among
    the common parameters.
    """
    first, second = poses
    place = first.apply(one.centre)
    low = np.flatnonzero(place[:, 2] < -WALL_TOP)  # images above the water move with the scanner
    reach, k = other.tree.query(second.to_file(place[low]), distance_upper_bound=max(MAX_PATCH_DISTANCE, within))
    i, k = low[np.isfinite(reach)], k[np.isfinite(reach)]
    normal, beside_normal = one.normal[i] @ first.rotation.T, other.normal[k] @ second.rotation.T
    same = (normal * beside_normal).sum(axis=1) > MIN_FACING_COSINE
    i, k, normal, beside_normal = i[same], k[same], normal[same], beside_normal[same]
    if len(i) < 20:
        return None
    place, neighbour = place[i], second.apply(other.centre[k])
    mean = normal + beside_normal
    mean /= np.linalg.norm(mean, axis=1)[:, None]
    nearer = nearer_by_slant(place, first.translation, mean) - nearer_by_slant(neighbour, second.translation, mean)
    bed = mean[:, 2] > MIN_BED_COSINE
    baseline = (second.translation - first.translation) * [1.0, 1.0, 0.0]
    design = np.column_stack(
        [
            np.where(bed, 0.0, -nearer),
            np.where(bed, -nearer, 0.0),
            np.where(bed, 0.0, mean @ baseline),
            np.where(bed, mean @ baseline, 0.0),
        ]
    )
    residual = ((place - neighbour) * mean).sum(axis=1) + design @ common
    close = np.abs(residual) < within
    i, k, place, neighbour = i[close], k[close], place[close], neighbour[close]
    mean, residual, design = mean[close], residual[close], design[close]
    if len(i) < 20:
        return None
    sigma = np.sqrt(one.spread[i] ** 2 / one.count[i] + other.spread[k] ** 2 / other.count[k] + RELIEF**2)
    return Rows(
        residual, sigma, pose_derivatives(place, first, mean), scans[0], scans[1],
        -pose_derivatives(neighbour, second, mean), design, columns, _stretches(place),
        np.full(len(i), SHARED), "scan", "",
    )  # fmt: skip
