"""First pose of a sonar scan, before any fit: levelled by walls, bed and water, turned along the canal, matched to a ladder.

The walls leave a half turn, the place along the canal and the height open. They are found by template matching with the
expected image of a ladder below the water, seen across the canal (Lewis, 1995, normalised cross-correlation), for each
ladder of the laser and either orientation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.signal import fftconvolve
from scipy.spatial.transform import Rotation

from tunneldb.arrays import Float, Int64
from tunneldb.errors import UserError
from tunneldb.registration.underwater.ladder_shape import PlacedLadder
from tunneldb.registration.underwater.walls import Walls
from tunneldb.registration.underwater.water_surface import find_surface
from tunneldb.registration.underwater.waterline import find_waterline
from tunneldb.robust import MAD_TO_SIGMA

MAX_RANGE = 12.0  # m from the scanner
BIN = 0.05  # m, across
ANGLES = np.radians(np.arange(0.0, 180.0, 1.0))
WIDTH_TOLERANCE = 0.15  # share, before the scan is level
PIXEL = 0.03  # m
BLUR = 0.045  # m: half a degree at 5 m
WALL_MARGIN = 0.07  # m: four standard deviations of a sonar's range
SLAB = 0.15  # in front of and behind the ladder's plane, m
MAX_TILT = np.radians(15.0)
MAX_PEAKS = 4  # peaks for each ladder and orientation
LEVEL_ROUNDS = 3
MIN_BED_CELLS = 10  # cells of 0.5 m
TOP_PERCENTILE = 95.0  # percentile of heights


@dataclass(frozen=True)
class LevelScan:
    """Scan turned level and along the canal.

    Attributes
    ----------
    rotation : (3, 3) float64 array
        From the file's axes to: x along the canal, y across, z up.
    walls : tuple of float
        Positions y of the walls, at the scanner's height, m.
    slopes : tuple of float
        Slopes of the walls: change of y per metre of height.
    points : (n, 3) float64 array
        Rotated points.
    bed : float
        Median height of the bed, m.
    edges : (k, 3) float64 array
        Upper edges of its walls, at the water level; see `find_waterline`.
    surface : (k, 3) float64 array
        Points of the water's surface; see `find_surface`.
    top : float
        Height of the water, m: of the surface, of the edges, or of the highest points.
    """

    rotation: Float
    walls: tuple[float, float]
    slopes: tuple[float, float]
    points: Float
    bed: float
    edges: Float
    surface: Float
    top: float


@dataclass(frozen=True)
class Candidate:
    """Possible pose: ``rotation @ point + translation``, the ladder it is based on, and the similarity to it (0 to 1)."""

    rotation: Float
    translation: Float
    score: float
    ladder: str


def level(points: Float, up: int, widths: tuple[float, float]) -> LevelScan:
    """Level a scan (n, 3), file's axes, between walls whose distance is within ``widths``, m.

    Raises
    ------
    UserError
        If it shows no two walls at about that distance, or no bed between them.
    """
    rotation = np.diag([1.0, float(up), float(up)])  # half a turn about x if z points down
    turned = points @ rotation.T
    near = np.linalg.norm(turned[:, :2], axis=1) < MAX_RANGE
    angle, low, high = _parallel_walls(turned[near], widths)
    rotation = _about_z(-angle) @ rotation
    slopes = (0.0, 0.0)
    bed = 0.0
    for _ in range(LEVEL_ROUNDS):
        turned = points @ rotation.T
        near = np.linalg.norm(turned[:, :2], axis=1) < MAX_RANGE
        first = _wall_plane(turned[near], low)
        second = _wall_plane(turned[near], high)
        pitch, bed = _bed_slope(turned[near], low, high)
        # Walls that lean the same way mean that the scan is not level; walls that lean apart are battered.
        roll = (first[2] + second[2]) / 2.0
        yaw = (first[1] + second[1]) / 2.0
        low, high = first[0], second[0]
        slopes = (first[2] - roll, second[2] - roll)
        turn = np.array([[1.0, yaw, pitch], [-yaw, 1.0, -roll], [-pitch, roll, 1.0]])
        left, _, right = np.linalg.svd(turn)
        rotation = left @ right @ rotation
    flat = _level_scan(points, rotation, (low, high), slopes, bed)
    if len(flat.surface):
        flat = _levelled_by_water(points, flat)
    if np.degrees(np.arccos(np.clip(flat.rotation[2, 2] * up, -1.0, 1.0))) > np.degrees(MAX_TILT):
        raise UserError("the scan is tilted by more than 15°; check --up")
    return flat


def _level_scan(
    points: Float, rotation: Float, walls: tuple[float, float], slopes: tuple[float, float], bed: float
) -> LevelScan:
    """Return the scan at a rotation, with the water's level."""
    turned = points @ rotation.T
    edges = find_waterline(turned, walls, slopes)
    top = float(np.median(edges[:, 2])) if len(edges) else float(np.percentile(turned[:, 2], TOP_PERCENTILE))
    surface = find_surface(turned, walls, top)
    top = float(np.median(surface[:, 2])) if len(surface) else top
    return LevelScan(rotation, walls, slopes, turned, bed, edges, surface, top)


def _levelled_by_water(points: Float, flat: LevelScan) -> LevelScan:
    """Return the scan levelled by the water's surface: rock walls and a bed are not level; itself if its surface is lost."""
    design = np.column_stack([np.ones(len(flat.surface)), flat.surface[:, :2]])
    _, along, across = np.linalg.lstsq(design, flat.surface[:, 2], rcond=None)[0]
    rotation = Rotation.from_rotvec([-across, along, 0.0]).as_matrix() @ flat.rotation
    turned = points @ rotation.T
    near = turned[np.linalg.norm(turned[:, :2], axis=1) < MAX_RANGE]
    first, second = (_wall_plane(near, place) for place in flat.walls)
    walls = first[0], second[0]
    found = _level_scan(points, np.asarray(rotation), walls, (first[2], second[2]), _bed_slope(near, *walls)[1])
    return found if len(found.surface) else flat


def _about_z(angle: float) -> Float:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _parallel_walls(points: Float, widths: tuple[float, float]) -> tuple[float, float, float]:
    """Return the direction in plan, rad, of two parallel walls within ``widths`` apart, and their offsets across it, m."""
    weight = np.minimum(np.linalg.norm(points[:, :2], axis=1) ** 2, 50.0)  # rays fan out
    best = (-1.0, 0.0, 0.0, 0.0)
    lags = np.arange(int(widths[0] * (1.0 - WIDTH_TOLERANCE) / BIN), int(widths[1] * (1.0 + WIDTH_TOLERANCE) / BIN) + 1)
    lags = lags[lags < int(2 * MAX_RANGE / BIN)]
    for angle in ANGLES:
        across = -np.sin(angle) * points[:, 0] + np.cos(angle) * points[:, 1]
        k = np.floor((across + MAX_RANGE) / BIN).astype(np.int64)
        histogram = np.bincount(np.clip(k, 0, int(2 * MAX_RANGE / BIN)), weights=weight, minlength=int(2 * MAX_RANGE / BIN) + 1)
        smooth = np.convolve(histogram, np.ones(3), mode="same")
        for lag in lags:
            both = np.minimum(smooth[:-lag], smooth[lag:])
            i = int(np.argmax(both))
            if both[i] > best[0]:
                best = (float(both[i]), float(angle), (i + 0.5) * BIN - MAX_RANGE, (i + lag + 0.5) * BIN - MAX_RANGE)
    score, angle, low, high = best
    if score <= 0.0 or not low < 0.0 < high:
        apart = f"{widths[0]:.1f}" if widths[1] - widths[0] < 0.5 else f"{widths[0]:.1f} to {widths[1]:.1f}"
        raise UserError(f"no two walls {apart} m apart (as in the laser scan) around the scanner; is the file in metres?")
    return angle, low, high


def _wall_plane(points: Float, place: float) -> tuple[float, float, float]:
    """Fit y = a + b x + c z robustly to the points within some decimetres of a wall."""
    mine = points[np.abs(points[:, 1] - place) < 0.4]
    design = np.column_stack([np.ones(len(mine)), mine[:, 0], mine[:, 2]])
    answer = np.array([place, 0.0, 0.0])
    for _ in range(15):
        residual = mine[:, 1] - design @ answer
        scale = max(MAD_TO_SIGMA * float(np.median(np.abs(residual))), 0.01)
        weight = 1.0 / (1.0 + (residual / scale) ** 2) ** 2  # Geman-McClure
        weighted = design * weight[:, None]
        answer = np.linalg.lstsq(weighted.T @ design, weighted.T @ mine[:, 1], rcond=None)[0]
    return float(answer[0]), float(answer[1]), float(answer[2])


def _bed_slope(points: Float, low: float, high: float) -> tuple[float, float]:
    """Return the slope along the canal of the lowest surface between the walls, and its median height, m."""
    margin = 0.25 * (high - low)
    mine = points[(points[:, 1] > low + margin) & (points[:, 1] < high - margin)]
    cell = np.floor(mine[:, :2] / 0.5).astype(np.int64)
    cells, number = np.unique(cell, axis=0, return_inverse=True)
    order = np.lexsort([mine[:, 2], number])
    begin = np.searchsorted(number[order], np.arange(len(cells) + 1))
    count = np.diff(begin)
    # The lower quartile of a cell is its bed; echoes of the water surface from below and their images are above it.
    low_of = mine[order[begin[:-1] + count // 4], 2][count >= 5]
    centre = np.array([mine[order[b], 0] for b in begin[:-1]])[count >= 5]
    if len(low_of) < MIN_BED_CELLS:
        raise UserError("no bed between its walls; is it a sonar scan?")
    slope, middle = 0.0, float(np.median(low_of))
    for _ in range(10):
        residual = low_of - middle - slope * centre
        scale = max(MAD_TO_SIGMA * float(np.median(np.abs(residual))), 0.02)
        weight = 1.0 / (1.0 + (residual / scale) ** 2) ** 2
        design = np.column_stack([np.ones(len(centre)), centre])
        middle, slope = np.linalg.lstsq(design * np.sqrt(weight)[:, None], low_of * np.sqrt(weight), rcond=None)[0]
    return float(slope), float(middle)


def candidates(scan: LevelScan, walls: Walls, ladders: Sequence[PlacedLadder], uncertain: float) -> list[Candidate]:
    """Return poses at which the scan may show one of the ladders, the most likely first.

    Parameters
    ----------
    scan : LevelScan
    walls, ladders
        Walls and ladders of the laser, local frame with the water at zero.
    uncertain : float
        Greatest height difference between the water and the top of the scan's walls, m.
    """
    found: list[Candidate] = []
    for placed in ladders:
        foot = placed.origin - placed.axes[1] * (placed.origin[2] / placed.axes[1, 2])  # its intersection with the water level
        _, piece = walls.tree.query(foot[:2])
        normal = walls.normal[piece]
        along = np.array([normal[1], -normal[0]])  # (along, normal, up) is right-handed
        basis = np.column_stack([[*along, 0.0], [*normal, 0.0], [0.0, 0.0, 1.0]])
        base = walls.foot[piece]
        for flip in (0, 1):
            turn = np.diag([-1.0, -1.0, 1.0]) if flip else np.eye(3)
            turned = scan.points @ turn
            place = -scan.walls[1] if flip else scan.walls[0]
            slope = -scan.slopes[1] if flip else scan.slopes[0]
            for x, h, score in _correlate(turned, place, slope, scan, placed, basis, base, uncertain):
                rotation = basis @ turn @ scan.rotation
                # at the water level the scan's wall and the laser's coincide
                shift = basis @ np.array([x, -(place - slope * h), h]) + base
                found.append(Candidate(rotation, shift, score, placed.ladder.name))
    return sorted(found, key=lambda one: -one.score)


def _correlate(
    points: Float,
    place: float,
    slope: float,
    scan: LevelScan,
    placed: PlacedLadder,
    basis: Float,
    base: Float,
    uncertain: float,
) -> list[tuple[float, float, float]]:
    """Return shifts along and up (m) at which points in front of a wall match the ladder, and the correlation (-1 to 1)."""
    dots, step = _dots(*(((placed.to_space(ends) - base) @ basis) for ends in placed.elements()))
    depth = scan.top - scan.bed
    wet = (dots[:, 2] < -0.03) & (dots[:, 2] > -depth - 0.1)
    dots, step = dots[wet], step[wet]
    if len(dots) < 50:
        return []
    off = points[:, 1] - place - slope * points[:, 2]
    # At the ladder's distance from the wall; it may lean: its plane at a height follows from the water's height.
    height = points[:, 2] - scan.top
    lean = np.polyfit(dots[:, 2], dots[:, 1], 1)
    expected = np.polyval(lean, height)
    mine = (np.abs(off - expected) < SLAB) & (off > WALL_MARGIN) & (height < uncertain) & (height > -depth - uncertain)
    mine &= np.abs(points[:, 0]) < MAX_RANGE
    own = points[mine]
    if len(own) < 50:
        return []
    low = np.array([-MAX_RANGE - 1.0, own[:, 2].min() - 1.0])
    shape = np.ceil((np.array([2.0 * MAX_RANGE + 2.0, np.ptp(own[:, 2]) + 2.0])) / PIXEL).astype(int)
    k = np.floor((own[:, [0, 2]] - low) / PIXEL).astype(np.int64)
    weight = (own**2).sum(axis=1)
    image = np.bincount(k[:, 0] * shape[1] + k[:, 1], weights=weight, minlength=shape[0] * shape[1]).reshape(shape)
    image = np.sqrt(gaussian_filter(image, 1.0))
    corner = np.array([dots[:, 0].min() - 0.2, dots[:, 2].min() - 0.2])
    size = np.ceil((np.array([dots[:, 0].max(), dots[:, 2].max()]) + 0.2 - corner) / PIXEL).astype(int)
    if (size > shape).any():
        return []
    t = np.floor((dots[:, [0, 2]] - corner) / PIXEL).astype(np.int64)
    template = np.bincount(t[:, 0] * size[1] + t[:, 1], weights=step, minlength=size[0] * size[1]).reshape(size)
    template = np.sqrt(gaussian_filter(template, BLUR / PIXEL))
    template -= template.mean()
    template /= np.linalg.norm(template)
    ones = np.ones_like(template)
    total = fftconvolve(image, ones, mode="valid")
    square = fftconvolve(image**2, ones, mode="valid")
    spread = np.sqrt(np.maximum(square - total**2 / template.size, 1e-6 * float(image.max()) ** 2 * template.size))
    alike = fftconvolve(image, template[::-1, ::-1], mode="valid") / spread
    # a template at pixel (i, j) puts its corner at low + (i, j) * PIXEL: shift = expected minus observed position
    along = corner[0] - (low[0] + np.arange(alike.shape[0]) * PIXEL)
    up = corner[1] - (low[1] + np.arange(alike.shape[1]) * PIXEL)
    alike[:, np.abs(up + scan.top) > uncertain] = -1.0
    out = []
    for _ in range(MAX_PEAKS):
        i, j = np.unravel_index(int(np.argmax(alike)), alike.shape)
        if alike[i, j] <= 0.1:
            break
        out.append((float(along[i]), float(up[j]), float(alike[i, j])))
        alike[max(i - 5, 0) : i + 6, max(j - 4, 0) : j + 5] = -1.0
    return out


def _dots(begin: Float, end: Float) -> tuple[Float, Float]:
    """Return points (n, 3) along lines between ends (k, 3) and (k, 3), and the length (n,) that each stands for."""
    share = np.linspace(0.0, 1.0, 80)
    dots = (begin[:, None] + share[None, :, None] * (end - begin)[:, None]).reshape(-1, 3)
    return dots, np.repeat(np.linalg.norm(end - begin, axis=1) / len(share), len(share))


@dataclass(frozen=True)
class _Picture:
    """A ladder below the water, seen square to its plane.

    Attributes
    ----------
    low, high : (2,) float64 array
        Corners in the ladder's own axes, across and up, m.
    size : (2,) int64 array
        Pixels.
    image : (n, m) float64 array
        Deviations from the mean, with a norm of 1.
    """

    low: Float
    high: Float
    size: Int64
    image: Float


@lru_cache(maxsize=256)
def _picture(placed: PlacedLadder) -> _Picture | None:
    """Return the picture of a ladder in the local frame, with the water at zero; None if no part is below the water."""
    dots, step = _dots(*placed.elements())
    wet = placed.to_space(dots)[:, 2] < -0.03
    if not wet.any():
        return None
    low, high = dots[wet, :2].min(axis=0) - 0.2, dots[wet, :2].max(axis=0) + np.array([0.2, 0.0])
    size = np.ceil((high - low) / PIXEL).astype(np.int64)
    image = _image(dots[wet, :2], step[wet], low, size, BLUR / PIXEL)
    image -= image.mean()
    return _Picture(low, high, size, image / np.linalg.norm(image))


def likeness(points: Float, scanner: Float, placed: PlacedLadder) -> float:
    """Return the similarity of points (n, 3) to a ladder below the water, seen square to its plane (-1 to 1).

    Parameters
    ----------
    points, scanner, placed
        In the local frame, with the water at zero.
    """
    picture = _picture(placed)
    if picture is None:
        return -1.0
    across, up, out = placed.to_ladder(points).T
    low, high = picture.low, picture.high
    mine = (np.abs(out) < 0.07) & (across > low[0]) & (across < high[0]) & (up > low[1]) & (up < high[1])
    if mine.sum() < 50:
        return -1.0
    weight = ((points[mine] - scanner) ** 2).sum(axis=1)
    seen = _image(np.column_stack([across[mine], up[mine]]), weight, low, picture.size, 1.0)
    seen -= seen.mean()
    return float((seen * picture.image).sum() / np.linalg.norm(seen))


def _image(places: Float, weight: Float, low: Float, size: Int64, blur: float) -> Float:
    """Return the blurred square root of the density of weighted positions (n, 2), in pixels from ``low`` on."""
    k = np.minimum(np.floor((places - low) / PIXEL).astype(np.int64), size - 1)
    image = np.bincount(k[:, 0] * size[1] + k[:, 1], weights=weight, minlength=size[0] * size[1]).reshape(tuple(size))
    return np.asarray(np.sqrt(gaussian_filter(image, blur)))
