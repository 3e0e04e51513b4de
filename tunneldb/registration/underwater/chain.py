"""Pose of a sonar scan that sees no ladder, beside one whose pose is known: by the relief of the bed that both see."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.signal import fftconvolve

from tunneldb.arrays import Float
from tunneldb.registration.underwater.adjustment import adjust, scan_of
from tunneldb.registration.underwater.first_pose import LevelScan
from tunneldb.registration.underwater.laser_ladders import LaserLadder
from tunneldb.registration.underwater.observations import Pose, Rows
from tunneldb.registration.underwater.single import PreparedScan, StartedScan, sees
from tunneldb.registration.underwater.walls import Walls

OVERLAP = 15.0  # m between scanners whose scans are compared
PIXEL = 0.1  # m
REACH = 10.0  # m along, from a scanner
MARGIN = 0.3  # m from the walls
FINE = 2.5  # m: relief that is wider says nothing of the place
STEPS = 0.6  # m: farther from the bed's height are objects and false echoes
LEAST_CELLS = 500  # that both scans must see
PATCH_AREA = 1.0  # m²: of bed whose relief is one observation
SURE = 2.2  # standard deviations by which beds are alike, and more alike than elsewhere
AHEAD = 1.0
LOOSE = 4  # pixels by which first poses may be off along
BED_NOISE = 0.02  # m: of the bed's height in a pixel, seen slantingly
REACHES = (0.3, 0.25, 0.2, 0.15, *[0.1] * 8)
AGREEING = 0.02  # m: median distance of patches that show the same
LEAST_SHARED = 60  # patches


@dataclass(frozen=True)
class _Relief:
    """Heights of the bed (x, y) in pixels from ``low`` on, without what is wide, and which pixels there are."""

    height: Float
    fine: Float
    seen: Float
    low: Float


def place_beside(
    i: int,
    scans: Mapping[int, PreparedScan],
    started: Mapping[int, StartedScan],
    walls: Walls,
    found: Sequence[LaserLadder],
) -> StartedScan | None:
    """Pose of scan ``i`` beside the one of those started that it shares most of the bed with; None if it isn't sure."""
    tried = []
    for k, known in started.items():
        for flip in (False, True):
            pose, alike = _candidate(scans[i].flat, scans[k], known.pose, walls, flip)
            if pose is not None:
                tried.append((alike, k, pose))
    tried.sort(key=lambda one: -one[0])
    if not tried or tried[0][0] < SURE:
        return None
    alike, k, pose = tried[0]
    own = [value for value, _, other in tried[1:] if np.linalg.norm(other.translation - pose.translation) > 1.0]
    if own and own[0] > alike - AHEAD:
        return None
    both = [
        scan_of(scans[k].thin, scans[k].patches, scans[k].edges, started[k].pose, started[k].ladders, found),
        scan_of(scans[i].thin, scans[i].patches, scans[i].edges, pose, (), found),
    ]
    adjusted = adjust(both, walls, found, [(0, 1)], REACHES)
    if not _agree(adjusted.rows):
        return None
    return StartedScan(adjusted.poses[1], sees(scans[i], adjusted.poses[1], found))


def _agree(rows: Sequence[Rows]) -> bool:
    """Whether two scans show the same where they overlap."""
    shared = next((one for one in rows if one.kind == "scan"), None)
    return shared is not None and len(shared.residual) > LEAST_SHARED and float(np.median(np.abs(shared.residual))) < AGREEING


def _candidate(flat: LevelScan, beside: PreparedScan, known: Pose, walls: Walls, flip: bool) -> tuple[Pose | None, float]:
    """Pose of a level scan at which its bed looks most like that of a known one, and how alike, in standard deviations."""
    _, piece = walls.tree.query(known.translation[:2])
    normal = walls.normal[piece]
    basis = np.column_stack([[normal[1], -normal[0], 0.0], [*normal, 0.0], [0.0, 0.0, 1.0]])
    base = walls.foot[piece]
    turn = np.diag([-1.0, -1.0, 1.0]) if flip else np.eye(3)
    place = -flat.walls[1] if flip else flat.walls[0]
    own = flat.points @ turn - [0.0, place, 0.0]
    other = (known.apply(beside.cloud.points) - base) @ basis
    there = float((known.translation - base) @ basis[:, 0])
    width = flat.walls[1] - flat.walls[0]
    mine, theirs = _relief(own, 0.0, width), _relief(other, there, width)
    if mine is None or theirs is None:
        return None, -1.0
    by_shift, _ = _correlate(mine, theirs)
    best = int(np.argmax(by_shift))
    alike, shift = float(by_shift[best]), best - (mine.seen.shape[0] - 1)
    if alike <= 0.0:
        return None, -1.0
    along = shift * PIXEL + theirs.low[0] - mine.low[0]
    up = _height_difference(mine, theirs, shift)
    rotation = basis @ turn @ flat.rotation
    translation = basis @ np.array([along, -place, up]) + base
    return Pose(rotation, translation, 1.0), alike


def _relief(points: Float, middle: float, width: float) -> _Relief | None:
    """Bed about a place along the canal, from points in a frame whose y is 0 at one wall."""
    near = points[(np.abs(points[:, 0] - middle) < REACH) & (points[:, 1] > MARGIN) & (points[:, 1] < width - MARGIN)]
    if len(near) < LEAST_CELLS:
        return None
    low = np.array([middle - REACH, 0.0])
    shape = (round(2.0 * REACH / PIXEL), int(width / PIXEL) + 1)
    cell = np.floor((near[:, :2] - low) / PIXEL).astype(np.int64)
    key = cell[:, 0] * shape[1] + cell[:, 1]
    bed = float(np.percentile(near[:, 2], 20))
    on_bed = np.abs(near[:, 2] - bed) < STEPS
    key, height = key[on_bed], near[on_bed, 2]
    order = np.lexsort([height, key])
    places, begin, count = np.unique(key[order], return_index=True, return_counts=True)
    grid, seen = np.zeros(shape), np.zeros(shape)
    grid.ravel()[places] = height[order][begin + count // 2]
    seen.ravel()[places] = 1.0
    sigma = FINE / PIXEL
    wide = gaussian_filter(grid * seen, sigma) / np.maximum(gaussian_filter(seen, sigma), 1e-6)
    return _Relief(grid, (grid - wide) * seen, seen, low)


def _correlate(mine: _Relief, theirs: _Relief) -> tuple[Float, Float]:
    """Significance of the correlation at each shift along, by pixels, from that at which they only touch on; and observations.

    Correlation of masked images (Padfield, 2012), in standard deviations by Fisher's transform: much bed that is somewhat alike
    says more than little that is very alike.
    """

    def over(one: Float, other: Float) -> Float:
        # shifts along only: the walls have settled those across
        return np.asarray(fftconvolve(one, other[::-1, ::-1], mode="full")[:, one.shape[1] - 1])

    shared = over(theirs.seen, mine.seen)
    product = over(theirs.fine, mine.fine)
    theirs_square, mine_square = over(theirs.fine**2, mine.seen), over(theirs.seen, mine.fine**2)
    correlation = np.clip(product / np.sqrt(np.maximum(theirs_square * mine_square, 1e-12)), -0.99, 0.99)
    observations = np.maximum(shared * PIXEL**2 / PATCH_AREA - 3.0, 0.0)
    return np.where(shared > LEAST_CELLS, np.arctanh(correlation) * np.sqrt(observations), -1.0), observations


def agreement(one: PreparedScan, other: PreparedScan, poses: tuple[Pose, Pose], walls: Walls) -> int:
    """Whether two scans show the same bed where their poses say that they see the same: 1 yes, -1 no, 0 it can't be told.

    It is yes if the reliefs are alike, and no if their correlation is less than half of what their noise leaves, both by SURE
    standard deviations.
    """
    first, second = poses
    _, piece = walls.tree.query(first.translation[:2])
    normal = walls.normal[piece]
    basis = np.column_stack([[normal[1], -normal[0], 0.0], [*normal, 0.0], [0.0, 0.0, 1.0]])
    base = walls.foot[piece]
    width = walls.width()
    reliefs = []
    for scan, pose in ((one, first), (other, second)):
        place = (pose.apply(scan.cloud.points) - base) @ basis
        reliefs.append(_relief(place, float((pose.translation - base) @ basis[:, 0]), width))
    mine, theirs = reliefs
    if mine is None or theirs is None:
        return 0
    by_shift, observations = _correlate(mine, theirs)
    together = round((mine.low[0] - theirs.low[0]) / PIXEL) + mine.seen.shape[0] - 1
    near = slice(max(together - LOOSE, 0), together + LOOSE + 1)
    if together < 0 or len(by_shift[near]) == 0 or observations[near].max() <= 0.0:
        return 0
    alike = float(by_shift[near].max())
    clear = [max(1.0 - BED_NOISE**2 / float((of.fine[of.seen > 0.0] ** 2).mean()), 0.0) for of in (mine, theirs)]
    expected = np.arctanh(min(0.5 * np.sqrt(clear[0] * clear[1]), 0.9)) * np.sqrt(observations[near].max())
    if alike > SURE:
        return 1
    return -1 if alike < expected - SURE else 0


def _height_difference(mine: _Relief, theirs: _Relief, shift: int) -> float:
    """Median of their heights over mine where both are seen at a shift."""
    size = mine.seen.shape[0]
    one = slice(max(shift, 0), min(size + shift, size))
    other = slice(max(-shift, 0), min(size - shift, size))
    both = (theirs.seen[one] > 0.0) & (mine.seen[other] > 0.0)
    return float(np.median((theirs.height[one] - mine.height[other])[both]))
