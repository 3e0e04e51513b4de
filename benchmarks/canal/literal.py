"""The steps of Moisan et al. (2015), word for word, with the operator's hand played by the truth.

What the paper does by hand is done as well as can be: ladders and walls are cut out at their true places, rungs have their true
numbers, the ladder above the water is known without error, and the search along the canal begins at the ladder. What it leaves
out is filled in: rho is Geman and McClure's with a scale of 1.4826 MAD, clouds are centred before the principal axes. Its
appendix C is misprinted; here the rungs' common height is the weighted mean of their heights less the known ones.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
from scipy.signal import argrelmax, argrelmin
from scipy.spatial import cKDTree

from benchmarks.canal.scenes import Case
from tunneldb.arrays import Bool, Float
from tunneldb.registration.underwater import SonarCloud
from tunneldb.registration.underwater.walls import Walls
from tunneldb.simulate.canal import SonarScan
from tunneldb.simulate.canal.layout import TrueLadder
from tunneldb.simulate.canal.section import WALL

CUT = 0.12  # m about a ladder that the operator cuts out
COARSE, FINE = 0.01, 0.001  # m: bandwidths of Parzen's windows (section 5.3.2)
LEAST = 60  # points of a ladder
NEAREST_RUNG = 0.1  # m
SILHOUETTE = 0.4  # m below the water, down to which points are taken for its line
ROUNDS = 30


def paper_pose(
    case: Case, cloud: SonarCloud, true: SonarScan, walls: Walls, origin: Float, start: Float
) -> tuple[Float, Float] | None:
    """Rotation and translation of a scan, local frame; None where it sees no ladder. ``start`` tells which way is which."""
    ladders = list(_ladders(case, cloud, true))
    if not ladders:
        return None
    _, piece = walls.tree.query(true.translation[:2] - origin[:2])
    laser, sonar = [], []
    for side in (0, 1):
        near = (walls.side == side) & (np.linalg.norm(walls.foot[:, :2] - walls.foot[piece, :2], axis=1) < 8.0)
        mine = (true.kind == WALL) & (np.linalg.norm(cloud.points, axis=1) < 8.0)
        place = true.scale * cloud.points @ true.rotation.T + true.translation - origin
        away, which = walls.tree.query(place[:, :2])
        mine &= (walls.side[which] == side) & (away < 1.0) & (place[:, 2] < 0.0)
        if not near.any() or mine.sum() < LEAST:
            continue
        normal = walls.normals(np.flatnonzero(near)).mean(axis=0)
        laser.append(normal / np.linalg.norm(normal))
        _, axes = reweighted_axes(cloud.points[mine])
        sonar.append(_towards(axes[2], start, laser[-1]))
    for ladder, fit in ladders:
        for k, axis in ((0, fit.across), (1, fit.up)):
            laser.append(ladder.axes[k])
            sonar.append(_towards(axis, start, ladder.axes[k]))
    rotation = procrustes(np.array(laser), np.array(sonar))
    places = np.array([ladder.origin - origin - rotation @ fit.origin for ladder, fit in ladders])
    translation = places.mean(axis=0)
    return rotation, _horizontal(cloud.points @ rotation.T, translation, walls)


def gap_errors(case: Case, cloud: SonarCloud, true: SonarScan) -> list[float]:
    """Rung gaps of a sonar's ladders without the known ones, less these, m: the paper's Table 2 in kind."""
    out = []
    for ladder, fit in _ladders(case, cloud, true):
        known = sorted(fit.rungs)
        out += [
            fit.rungs[b] - fit.rungs[a] - (ladder.heights[b] - ladder.heights[a])
            for a, b in itertools.pairwise(known)
            if b == a + 1
        ]
    return out


class _Fit:
    """A ladder in a sonar's cloud: origin at its height zero, unit vectors, heights of rungs by their places in the list."""

    def __init__(self, origin: Float, across: Float, up: Float, rungs: dict[int, float]) -> None:
        self.origin, self.across, self.up, self.rungs = origin, across, up, rungs


def _ladders(case: Case, cloud: SonarCloud, true: SonarScan) -> Iterator[tuple[TrueLadder, _Fit]]:
    place = true.scale * cloud.points @ true.rotation.T + true.translation
    for ladder in case.scene.ladders:
        own = (place - ladder.origin) @ ladder.axes.T
        half = ladder.stile_gap / 2.0 + CUT
        cut = (np.abs(own[:, 0]) < half) & (np.abs(own[:, 2]) < CUT) & (own[:, 1] > -0.3)
        cut &= place[:, 2] < case.water_level
        fit = _fit(cloud.points[cut], own[cut], ladder, true) if cut.sum() >= LEAST else None
        if fit is not None:
            yield ladder, fit


def _fit(points: Float, own: Float, ladder: TrueLadder, true: SonarScan) -> _Fit | None:
    """Plane, stiles and rungs of a ladder's points (n, 3), file's axes; ``own`` (n, 3) are their places by the truth."""
    middle, axes = reweighted_axes(points)
    up = _towards(axes[0], true.rotation, ladder.axes[1])
    across = _towards(axes[1], true.rotation, ladder.axes[0])
    plane = (points - middle) @ np.column_stack([across, up])
    stiles = _peaks(plane[:, 0])
    if len(stiles) < 2:
        return None
    left, right = sorted(stiles[:2])
    inside = (plane[:, 0] > left + 0.05) & (plane[:, 0] < right - 0.05)
    if inside.sum() < 20:
        return None
    edges = _valleys(plane[inside, 1])
    parts = [inside & (plane[:, 1] > a) & (plane[:, 1] < b) for a, b in itertools.pairwise(edges)]
    parts = [part for part in parts if part.sum() >= 5]
    if len(parts) < 2:
        return None
    direction, heights = _simultaneous(plane, parts)
    normal = np.array([-direction[1], direction[0]])
    rungs: dict[int, float] = {}
    for part, height in zip(parts, heights, strict=True):  # the operator says which is which
        number = int(np.argmin(np.abs(ladder.heights - np.median(own[part, 1]))))
        if abs(ladder.heights[number] - np.median(own[part, 1])) < NEAREST_RUNG:
            rungs[number] = height
    if len(rungs) < 2:
        return None
    zero = float(np.median([height - ladder.heights[number] for number, height in rungs.items()]))
    turn = np.column_stack([across, up])
    centre = 0.5 * (left + right)
    origin = middle + turn @ (centre * direction + zero * normal)
    return _Fit(origin, turn @ direction, turn @ normal, rungs)


def reweighted_axes(points: Float) -> tuple[Float, Float]:
    """Mean (3,) and principal axes (3, 3), greatest first, by reweighted principal components (appendix A)."""
    middle = np.median(points, axis=0)
    weight = np.ones(len(points))
    axes = np.eye(3)
    for _ in range(ROUNDS):
        middle = (weight[:, None] * points).sum(axis=0) / weight.sum()
        centred = points - middle
        value, vector = np.linalg.eigh((weight[:, None] * centred).T @ centred / weight.sum())
        axes = vector[:, np.argsort(-value)].T
        residual = np.abs(centred @ axes[2])
        scale = max(1.4826 * float(np.median(residual)), 1e-4)
        weight = 1.0 / (1.0 + (residual / scale) ** 2) ** 2  # Geman and McClure: rho'(r) / 2r but for a factor
    return middle, axes


def _simultaneous(plane: Float, parts: list[Bool]) -> tuple[Float, list[float]]:
    """One direction for all rungs, and the height of each square to it (appendix B)."""
    direction = np.array([1.0, 0.0])
    weights = [np.ones(int(part.sum())) for part in parts]
    means = [plane[part].mean(axis=0) for part in parts]
    for _ in range(ROUNDS):
        total = np.zeros((2, 2))
        for k, part in enumerate(parts):
            means[k] = (weights[k][:, None] * plane[part]).sum(axis=0) / weights[k].sum()
            centred = plane[part] - means[k]
            total += (weights[k][:, None] * centred).T @ centred
        value, vector = np.linalg.eigh(total)
        direction = vector[:, np.argmax(value)] * np.sign(vector[0, np.argmax(value)])
        normal = np.array([-direction[1], direction[0]])
        residuals = [np.abs((plane[part] - mean) @ normal) for part, mean in zip(parts, means, strict=True)]
        scale = max(1.4826 * float(np.median(np.concatenate(residuals))), 1e-4)
        weights = [1.0 / (1.0 + (residual / scale) ** 2) ** 2 for residual in residuals]
    return direction, [float(mean @ np.array([-direction[1], direction[0]])) for mean in means]


def _density(values: Float, width: float) -> tuple[Float, Float]:
    """Parzen's estimate with a Gaussian kernel on a grid of 1 mm."""
    grid = np.arange(values.min() - 0.05, values.max() + 0.05, FINE)
    return grid, np.exp(-0.5 * ((grid[:, None] - values[None]) / width) ** 2).sum(axis=1)


def _peaks(values: Float) -> list[float]:
    """Places of the peaks, highest first: roughly with 1 cm, then with 1 mm about each."""
    grid, rough = _density(values, COARSE)
    tops = argrelmax(rough)[0]
    tops = tops[np.argsort(-rough[tops])]
    out = []
    for top in tops[:2]:
        near = values[np.abs(values - grid[top]) < 2.0 * COARSE]
        fine_grid, fine = _density(near, FINE * 3.0)
        out.append(float(fine_grid[np.argmax(fine)]))
    return out


def _valleys(values: Float) -> Float:
    """Limits between peaks."""
    grid, rough = _density(values, COARSE * 2.0)
    return np.concatenate([[grid[0]], grid[argrelmin(rough)[0]], [grid[-1]]])


def _towards(axis: Float, rotation: Float, wanted: Float) -> Float:
    """An axis of the file, signed so that it points where it is wanted in the tunnel."""
    return axis * np.sign((rotation @ axis) @ wanted)


def procrustes(laser: Float, sonar: Float) -> Float:
    """Rotation that turns sonar directions (k, 3) into the laser's, by singular values (section 5.2); never a mirror."""
    u, _, vt = np.linalg.svd(laser.T @ sonar)
    return np.asarray(u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt)


def _horizontal(turned: Float, translation: Float, walls: Walls) -> Float:
    """Shift in plan by a 2D ICP of the lines in which both models meet the water (section 5.4)."""
    moved = turned + translation
    line = turned[(moved[:, 2] > -SILHOUETTE) & (moved[:, 2] < 0.0)]
    tree = cKDTree(walls.foot[:, :2])
    shift = translation.copy()
    for _ in range(ROUNDS):
        place = line[:, :2] + shift[:2]
        away, which = tree.query(place)
        close = away < 0.5
        if close.sum() < LEAST:
            break
        shift[:2] -= np.median(place[close] - walls.foot[which[close], :2], axis=0)
    return shift
