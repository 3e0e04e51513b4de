"""First poses of a sonar scan from the plan of the walls: the walls that it sees, compared with the laser's at the waterline.

The comparison is a correlation of two images of the plan (Lewis, 1995) at all places at once, for a set of headings. Each
image has channels 1, cos 2a and sin 2a of the direction a of the walls' normals, so that only walls of like direction
match. Cells of rare directions (flanks of piers, ends, recesses) weigh as much together as the long walls, which leave the
place along the canal open.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.fft import irfft2, next_fast_len, rfft2
from scipy.ndimage import gaussian_filter

from tunneldb.arrays import Bool, Float, Single
from tunneldb.registration.underwater.first_pose import LevelScan
from tunneldb.registration.underwater.observations import MAX_RANGE, Patches
from tunneldb.registration.underwater.profile import Profile, line_normals
from tunneldb.registration.underwater.results import Near, SonarCloud

PIXEL = 0.1  # m
BLUR = 0.08  # m: of either image
HEADINGS = np.radians(np.arange(-9.0, 9.1, 1.5))  # about the direction of the laser's walls, and half a turn from it
TILE, MARGIN = 30.0, 14.0  # m of a tile of the laser's plan; farther than a sonar sees
BED_MARGIN, WATER_MARGIN = 0.25, 0.05  # heights above the bed and below the water within which points are no wall, m
COLUMN, NORMAL_RADIUS = 0.08, 0.2  # m, of a column, and of those whose line gives the normal
MIN_POINTS, MIN_SPREAD = 4, 0.12  # of a column; m, standard deviation of their heights
MIN_COSINE = 0.17  # least cosine of incidence on a wall, in plan
MIN_CELLS = 30  # of a scan's plan
DIRECTION_BINS = 12  # of half a turn
PEAKS_OF_HEADING, PEAKS = 3, 24
PEAK_DISTANCE = 0.4  # m
ROUNDS = 8  # of the fit in plan
FIT_REACH = (0.4, 0.3, 0.25, 0.2, 0.15, 0.15, 0.1, 0.1)  # m
SIGMA = 0.05  # m of a distance in plan
SCALE_SIGMA, FEATURES = 0.015, 10.0  # standard deviation of the scale; number of independent features of a plan
MAX_CHANGE = np.array([0.3, 0.3, 0.05, 0.01])  # of place, m, heading, rad, and scale in one round


@dataclass(frozen=True)
class PlanCells:
    """Walls of a level scan in plan: places (k, 2) m, unit normals (k, 2), weights (k,)."""

    place: Float
    normal: Float
    weight: Float


@dataclass(frozen=True)
class PlanPose:
    """Heading, rad, place (2,) in plan, m, and scale of a level scan; ``score``: weighted share of its walls that match."""

    heading: float
    place: Float
    score: float
    scale: float = 1.0

    def turn(self) -> Float:
        """Return the rotation (2, 2) from the level scan to the tunnel."""
        c, s = np.cos(self.heading), np.sin(self.heading)
        return np.array([[c, -s], [s, c]])


def find_columns(flat: LevelScan, points: Float) -> Patches:
    """Return the columns of a scan's points (n, 3), file's axes, that lie on upright walls, as patches with level normals.

    A wall's plan is the same at all depths, so that a column has far more points than a patch. Columns are narrow, so that
    flanks of piers and recesses show.
    """
    own = points @ flat.rotation.T
    own = own[(own[:, 2] > flat.bed + BED_MARGIN) & (own[:, 2] < flat.top - WATER_MARGIN)]
    own = own[np.linalg.norm(own[:, :2], axis=1) < MAX_RANGE]
    moved = own[:, :2] + _batter(flat, own)
    cell = np.floor(moved / COLUMN).astype(np.int64)
    _, number, count = np.unique(cell, axis=0, return_inverse=True, return_counts=True)
    number = number.ravel()
    mean = np.column_stack([np.bincount(number, moved[:, k]) for k in (0, 1)]) / count[:, None]
    height = np.bincount(number, own[:, 2]) / count
    spread = np.sqrt(np.maximum(np.bincount(number, own[:, 2] ** 2) / count - height**2, 0.0))
    upright = (count >= MIN_POINTS) & (spread > MIN_SPREAD)
    mean, height, count = mean[upright], height[upright], count[upright]
    if len(mean) < MIN_CELLS:
        return Patches(np.zeros((0, 3)), np.zeros((0, 3)), count[:0], height[:0])
    normal, off, known = line_normals(mean, NORMAL_RADIUS)
    normal *= -np.sign((normal * mean).sum(axis=1))[:, None]
    facing = -(normal * mean).sum(axis=1) / np.linalg.norm(mean, axis=1) > MIN_COSINE
    keep = known & facing
    back = mean[keep] - _batter(flat, np.column_stack([mean[keep], height[keep]]))
    centre = np.column_stack([back, height[keep]])
    level = np.column_stack([normal[keep], np.zeros(int(keep.sum()))])
    return Patches(centre @ flat.rotation, level @ flat.rotation, count[keep], off[keep])


def _batter(flat: LevelScan, points: Float) -> Float:
    """Return the shifts (n, 2) of points (n, 3) of a level scan to the waterline, along the slope of the wall behind them."""
    slope = np.where(points[:, 1] > 0.0, flat.slopes[1], flat.slopes[0])
    return np.column_stack([np.zeros(len(points)), slope * (flat.top - points[:, 2])])


def plan_cells(flat: LevelScan, columns: Patches) -> PlanCells:
    """Return columns in plan, at the waterline."""
    centre, normal = columns.centre @ flat.rotation.T, columns.normal @ flat.rotation.T
    return PlanCells(centre[:, :2] + _batter(flat, centre), normal[:, :2], _balanced(normal[:, :2]))


def _balanced(normal: Float) -> Float:
    """Return weights (k,) that give rare directions more weight, 1 in the sum."""
    if len(normal) == 0:
        return np.zeros(0)
    angle = np.arctan2(normal[:, 1], normal[:, 0]) % np.pi
    bins = np.floor(angle / np.pi * DIRECTION_BINS + 0.5).astype(np.int64) % DIRECTION_BINS
    count = np.bincount(bins, minlength=DIRECTION_BINS).astype(np.float64)
    weight = 1.0 / np.sqrt(count[bins] + 0.05 * len(normal))
    return np.asarray(weight / weight.sum())


def find_plan_poses(cloud: SonarCloud, cells: PlanCells, profile: Profile) -> list[PlanPose]:
    """Return likely poses in plan, the most likely first; none if the scan shows too little of the walls."""
    if len(cells.place) < MIN_CELLS or len(profile.place) < MIN_CELLS:
        return []
    found: list[PlanPose] = []
    for tile in _tiles(profile, cloud):
        found += _in_tile(cells, tile, cloud)
    fitted = [_fitted(cells, one, profile) for one in _apart(found, 2 * PEAKS)]
    return _apart([one for one in fitted if cloud.may_stand(one.place)], PEAKS)


def _tiles(profile: Profile, cloud: SonarCloud) -> Iterator[Profile]:
    """Yield the parts of the plan around each place where the sonar may have stood."""
    key = np.floor(profile.place / TILE).astype(np.int64)
    for corner in np.unique(key, axis=0):
        low = corner * TILE - MARGIN
        inside = ((profile.place > low) & (profile.place < low + TILE + 2.0 * MARGIN)).all(axis=1)
        if cloud.near is not None:
            nearest = np.clip(cloud.near.place, corner * TILE, (corner + 1) * TILE)
            inside &= float(np.linalg.norm(nearest - cloud.near.place)) < cloud.near.within + MARGIN
        if inside.sum() >= MIN_CELLS:
            yield Profile(profile.place[inside], profile.normal[inside], profile.growth)


def _in_tile(cells: PlanCells, tile: Profile, cloud: SonarCloud) -> list[PlanPose]:
    """Return the best places of each heading in a part of the plan, where the sonar may have stood."""
    low = tile.place.min(axis=0) - MARGIN
    shape = np.ceil((tile.place.max(axis=0) + MARGIN - low) / PIXEL).astype(int)
    scene = _channels(tile.place, tile.normal, np.ones(len(tile.place)), low, shape)
    peak = scene[0].max()
    scene = np.minimum(scene / peak, 1.0) if peak > 0.0 else scene
    size = tuple(next_fast_len(int(n), real=True) for n in shape)
    spectrum = [np.conj(rfft2(channel, size)) for channel in scene]
    axis = 0.5 * np.angle(np.exp(2j * np.arctan2(tile.normal[:, 1], tile.normal[:, 0])).sum()) - 0.5 * np.pi
    out = []
    for heading in np.concatenate([HEADINGS, HEADINGS + np.pi]) + axis:
        pose = PlanPose(float(heading), np.zeros(2), 0.0)
        place, normal = cells.place @ pose.turn().T, cells.normal @ pose.turn().T
        own_low = place.min(axis=0) - 1.0
        own_shape = np.minimum(np.ceil((place.max(axis=0) + 1.0 - own_low) / PIXEL).astype(int), shape)
        own = _channels(place, normal, cells.weight, own_low, own_shape)
        score = sum(irfft2(np.conj(s) * np.conj(rfft2(o, size)), size) for s, o in zip(spectrum, own, strict=True))
        score = 0.5 * np.asarray(score)
        if cloud.near is not None:
            score = np.where(_within(cloud.near, low - own_low, shape, score.shape), score, -np.inf)
        for i, j in _peaks(score, PEAKS_OF_HEADING):
            shift = np.array([i if i < shape[0] else i - size[0], j if j < shape[1] else j - size[1]]) * PIXEL
            out.append(PlanPose(float(heading), low + shift - own_low, float(score[i, j])))
    return out


def _peaks(score: Single, most: int) -> list[tuple[int, int]]:
    """Return row and column of the highest maxima, the highest first, PEAK_DISTANCE apart; the image repeats itself."""
    reach = round(PEAK_DISTANCE / PIXEL)
    side = reach + 1  # a maximum is the greatest value of a block that is no larger than its reach
    blocks = np.pad(score, [(0, -n % side) for n in score.shape], constant_values=-np.inf)
    blocks = np.maximum.reduce([blocks[k::side] for k in range(side)])
    blocks = np.maximum.reduce([blocks[:, k::side] for k in range(side)])
    out: list[tuple[int, int]] = []
    for k in np.argsort(-blocks, axis=None):
        row, column = np.unravel_index(int(k), blocks.shape)
        highest = blocks[row, column]
        if len(out) == most or not np.isfinite(highest):
            break
        block = score[row * side : (row + 1) * side, column * side : (column + 1) * side]
        i, j = np.argwhere(block == highest)[0] + np.array([row, column]) * side
        around = [np.arange(at - reach, at + reach + 1) % n for at, n in zip((i, j), score.shape, strict=True)]
        if score[np.ix_(*around)].max() == highest:
            out.append((int(i), int(j)))
    return out


def _within(near: Near, origin: Float, shape: Float, size: tuple[int, ...]) -> Bool:
    """Return True for the shifts of a correlation image of a size at which the sonar is where it may have stood."""
    steps = [np.where(np.arange(n) < m, np.arange(n), np.arange(n) - n) * PIXEL for n, m in zip(size, shape, strict=True)]
    x, y = (steps[k] + origin[k] - near.place[k] for k in (0, 1))
    return np.asarray(np.hypot(x[:, None], y[None]) <= near.within)


def _channels(place: Float, normal: Float, weight: Float, low: Float, shape: Float) -> Single:
    """Return the images 1, cos 2a, sin 2a (3, n, m) of weighted places, for transforms in half the time."""
    k = np.floor((place - low) / PIXEL).astype(np.int64)
    inside = ((k >= 0) & (k < shape)).all(axis=1)
    key = k[inside, 0] * int(shape[1]) + k[inside, 1]
    twice = 2.0 * np.arctan2(normal[inside, 1], normal[inside, 0])
    size = int(shape[0] * shape[1])
    images = [
        np.bincount(key, weight[inside] * value, size).reshape(tuple(shape)).astype(np.float32)
        for value in (np.ones(len(key)), np.cos(twice), np.sin(twice))
    ]
    return np.array([gaussian_filter(image, BLUR / PIXEL) for image in images])


def _apart(poses: list[PlanPose], most: int) -> list[PlanPose]:
    """Return the best poses that are apart from each other."""
    out: list[PlanPose] = []
    for one in sorted(poses, key=lambda one: -one.score):
        if not any(
            np.linalg.norm(one.place - other.place) < PEAK_DISTANCE and np.cos(one.heading - other.heading) > 0.9
            for other in out
        ):
            out.append(one)
        if len(out) == most:
            break
    return out


def _fitted(cells: PlanCells, pose: PlanPose, profile: Profile) -> PlanPose:
    """Return a pose fitted to the plan, point to line, and its weighted share of matching walls."""
    prior = np.diag(cells.weight.sum() * np.array([1e-6, 1e-6, 1e-5, SIGMA**2 / SCALE_SIGMA**2 / FEATURES]))
    for reach in FIT_REACH:
        place, residual, normal, weight = _compared(cells, pose, profile)
        used = weight * (np.abs(residual) < 3.0 * reach) / (1.0 + (residual / reach) ** 2) ** 2
        arm = place - pose.place
        turn = arm[:, 0] * normal[:, 1] - arm[:, 1] * normal[:, 0]
        design = np.column_stack([normal, turn, (arm * normal).sum(axis=1) / pose.scale])
        weighted = design * used[:, None]
        right = weighted.T @ residual + prior @ np.array([0.0, 0.0, 0.0, pose.scale - 1.0])
        change = -np.linalg.solve(weighted.T @ design + prior, right)
        change = np.clip(change, -MAX_CHANGE, MAX_CHANGE)
        pose = PlanPose(pose.heading + float(change[2]), pose.place + change[:2], 0.0, pose.scale + float(change[3]))
    _, residual, _, weight = _compared(cells, pose, profile)
    return replace(pose, score=float((weight / (1.0 + (residual / SIGMA) ** 2)).sum()))


def _compared(cells: PlanCells, pose: PlanPose, profile: Profile) -> tuple[Float, Float, Float, Float]:
    """Return places, distances from the plan along its normals, these normals, and weights with the agreement of normals."""
    place, normal = pose.scale * cells.place @ pose.turn().T + pose.place, cells.normal @ pose.turn().T
    away, k = profile.tree.query(place, distance_upper_bound=1.0)
    known = np.isfinite(away)
    k = np.where(known, k, 0)
    line = profile.normal[k]
    residual = np.where(known, ((place - profile.place[k]) * line).sum(axis=1), 1.0)
    beside = np.sqrt(np.maximum(away**2 - residual**2, 0.0))
    same = np.abs((normal * line).sum(axis=1)) ** 4
    weight = cells.weight * same * (known & (np.where(known, beside, 1.0) < 0.2))
    return place, residual, line, weight
