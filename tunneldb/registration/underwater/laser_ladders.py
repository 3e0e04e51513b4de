"""Ladders in the laser's points above the water: found before the walls, numbered by the gaps of their rungs, and fitted.

Moisan et al. (2015), section 5.3, fit a plane, then stiles and rungs by Parzen windows, then lines. Here the peaks only give
initial values for a fit of the whole ladder, with known rung heights, by its six parameters and its width.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import least_squares, linear_sum_assignment
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.registration.underwater.ladder_shape import PlacedLadder, nearest_element
from tunneldb.registration.underwater.observations import cell_keys
from tunneldb.registration.underwater.results import Ladder
from tunneldb.registration.underwater.walls import Walls

WALL_DISTANCE = (0.05, 1.2)  # distance of a ladder from its wall, m
MAX_HEIGHT = 2.5  # above the water, m
MIN_HEIGHT = 0.03  # m above the water; below that, waves and mirror images disturb
MAX_FLATNESS = 0.5  # ratio of variances on a bar, also where two bars meet; on a surface the variances are similar
MIN_LADDER_HEIGHT = 0.3  # of a ladder above the water, m
MAX_POINTS = 4000
FIRST_FIT_POINTS = 600  # points of a first fit
LEANING = np.radians(np.arange(-15.0, 15.1, 0.5))  # sideways
BIN = 0.005  # m
STILE_SIGMA = 0.02  # m by which the diameter of stiles usually differs from that of rungs
NOISE = 0.004  # expected noise of laser points on a cylinder, m
STARTS = 8
MAX_LADDERS = 6  # after which a cluster that none fits is no ladder
DOTS = 40  # along each bar
UNSEEN_MARGIN, UNSEEN_REACH = 0.1, 0.025  # m from the limits of height; m around a bar
ON_WALL = 0.025  # m
UNSEEN_LENGTH = 0.05  # m of a bar that is not seen, for a log likelihood of 1
MAX_TIE_LOG_RATIO = float(np.log(100.0))  # likelihood ratio up to which two solutions are ambiguous
POINTS_PER_OBSERVATION = 5.0  # one point in this many has an independent error
MAX_COST_SHARE = 0.5  # share of the cost of outliers from which a first fit is not a ladder
OUTLIER_SIGMA = 5.0  # standard deviations from which a point does not belong to the ladder


@dataclass(frozen=True)
class Links:
    """Limits for linking points to clusters, and for accepting the rungs of a cluster.

    Attributes
    ----------
    link : float
        Greatest distance of neighbours, m.
    radius, neighbours
        Radius, m, and least number of the points that show the direction of a bar.
    rung_error : float
        Median distance of points between the stiles from expected rungs, above which the gaps differ, m.
    """

    link: float
    radius: float
    neighbours: int
    rung_error: float


LINKS = (Links(0.06, 0.08, 6, 0.01), Links(0.12, 0.14, 4, 0.007))  # two diameters of a bar; wider, for bars with few points
SURROUNDINGS = 0.3  # m around a ladder that was found


@dataclass(frozen=True)
class LaserLadder:
    """Ladder fitted to the laser's points.

    Attributes
    ----------
    placed : PlacedLadder
    rms : float
        Robust distance of the points from its surface, m.
    rungs : tuple of int
        Numbers of the visible rungs.
    points : int
    cost : float
        Half of the robust sum of squares of its cluster's points, with one independent point in POINTS_PER_OBSERVATION.
    covariance : (7, 7) float64 array
        Covariance of turn (3) rad, shift (3) m and gap m.
    ties : tuple of float
        Other shifts along the ladder at which its gaps fit as well, m.
    """

    placed: PlacedLadder
    rms: float
    rungs: tuple[int, ...]
    points: int
    cost: float
    covariance: Float
    ties: tuple[float, ...]


def find_laser_ladders(points: Float, walls: Walls, ladders: Sequence[Ladder]) -> list[LaserLadder]:
    """Find and fit ladders in laser points (n, 3), local frame with the water at zero; ladders not found are omitted.

    Ladders that few points show are searched afterwards, with wider links between points.
    """
    found: list[LaserLadder] = []
    shown = cKDTree(_before_walls(points[(points[:, 2] > 0.0) & (points[:, 2] < MAX_HEIGHT)], walls))
    for links in LINKS:
        names = {one.placed.ladder.name for one in found}
        left = [ladder for ladder in ladders if ladder.name not in names]
        if left:
            found += _assigned(_clusters(_away_from(points, found), walls, links), left, shown, links)
    order = {ladder.name: k for k, ladder in enumerate(ladders)}
    return sorted(found, key=lambda one: order[one.placed.ladder.name])


def _before_walls(points: Float, walls: Walls) -> Float:
    """Return the points (n, 3) that are not on a wall."""
    away, piece = walls.tree.query(points[:, :2], distance_upper_bound=WALL_DISTANCE[1] + 0.5)
    known = np.isfinite(away)
    off = np.full(len(points), np.inf)
    off[known] = walls.distance(points[known], piece[known])
    return points[off > ON_WALL]


def _away_from(points: Float, found: Sequence[LaserLadder]) -> Float:
    """Return the points (n, 3) that are not around ladders found already."""
    away = np.ones(len(points), np.bool_)
    for one in found:
        own = one.placed.to_ladder(points)
        away &= (np.abs(own[:, 0]) > one.placed.gap / 2.0 + SURROUNDINGS) | (np.abs(own[:, 2]) > SURROUNDINGS)
    return points[away]


def _assigned(
    clusters: Sequence[tuple[Float, Float]], ladders: Sequence[Ladder], shown: cKDTree, links: Links
) -> list[LaserLadder]:
    """Return the fits of ladders to clusters, each to one, with the greatest evidence in all."""
    fits = [_fits(cluster, out, ladders, shown, links) for cluster, out in clusters]
    if not fits:
        return []
    # evidence for a ladder, relative to outliers
    gain = [
        [0.0 if fit is None else _astray(len(cluster)) - fit.cost for fit in row]
        for (cluster, _), row in zip(clusters, fits, strict=True)
    ]
    rows, columns = linear_sum_assignment(-np.array(gain))
    found = [fits[row][column] for row, column in zip(rows, columns, strict=True)]
    return [fit for fit in found if fit is not None]


def _fits(cluster: Float, out: Float, ladders: Sequence[Ladder], shown: cKDTree, links: Links) -> list[LaserLadder | None]:
    """Return the fit of each ladder to a cluster; None where it is not that ladder."""
    starts: dict[tuple[float, float], PlacedLadder | None] = {}
    options = []
    for k, ladder in enumerate(ladders):
        shape = (ladder.stile_gap, ladder.diameter)
        if shape not in starts:
            starts[shape] = _stiles(cluster, out, ladder)
        start = starts[shape]
        if start is not None:
            shifts = _shifts(start.to_ladder(cluster), ladder, start.gap)
            if shifts:
                options.append((shifts[0][0], k, replace(start, ladder=ladder), [shift for _, shift in shifts]))
    options.sort(key=lambda one: -one[0])
    fits: list[LaserLadder | None] = [None] * len(ladders)
    for place, (_, k, start, heights) in enumerate(options):
        if place == MAX_LADDERS and not any(fits):
            break  # it is no ladder; otherwise all are compared, since they look alike
        fits[k] = _fit_cluster(cluster, start, heights, shown, links)
    return fits


def _astray(points: int) -> float:
    """Return the cost of points that are all outliers."""
    return 0.5 * min(points, MAX_POINTS) * float(np.log1p(OUTLIER_SIGMA**2)) / POINTS_PER_OBSERVATION


def _clusters(points: Float, walls: Walls, links: Links) -> list[tuple[Float, Float]]:
    """Return clusters in front of the walls that may be ladders: points (n, 3), and the direction (3,) to the water."""
    near = points[(points[:, 2] > MIN_HEIGHT) & (points[:, 2] < MAX_HEIGHT)]
    away, piece = walls.tree.query(near[:, :2], distance_upper_bound=WALL_DISTANCE[1] + 0.5)
    known = np.isfinite(away)
    near, piece = _thin(near[known], piece[known], LINKS[0].link / 3.0)
    off = walls.distance(near, piece)
    near_wall = (off > -links.radius) & (off < WALL_DISTANCE[1] + links.radius)
    near, piece, off = near[near_wall], piece[near_wall], off[near_wall]
    bars = (off > WALL_DISTANCE[0]) & (off < WALL_DISTANCE[1])
    bars[bars] = _elongated(near, bars, links)
    near, piece = near[bars], piece[bars]
    if len(near) == 0:
        return []
    pairs = cKDTree(near).query_pairs(links.link, output_type="ndarray")
    count = len(near)
    _, label = connected_components(coo_array((np.ones(len(pairs)), pairs.T), (count, count)), directed=False)
    out = []
    for number in np.flatnonzero(np.bincount(label) >= 30):
        mine = label == number
        if np.ptp(near[mine, 2]) >= MIN_LADDER_HEIGHT:
            normal = walls.normal[piece[mine]].mean(axis=0)
            out.append((near[mine], np.array([*normal, 0.0]) / np.linalg.norm(normal)))
    return out


def _elongated(points: Float, which: Bool, links: Links) -> Bool:
    """Return True for some of the points (n, 3) if they lie on bars rather than surfaces, by the principal axes around each.

    Otherwise a vault or a boat in front of the wall would be one cluster with the ladder that leans on it.
    """
    tree = cKDTree(points)
    pairs = cKDTree(points[which]).sparse_distance_matrix(tree, links.radius, output_type="coo_matrix")
    count = int(which.sum())
    about = coo_array((np.ones(pairs.nnz), (pairs.row, pairs.col)), (count, len(points))).tocsr()
    number = np.asarray(about.sum(axis=1))
    centred = points - points.mean(axis=0)
    mean = about @ centred / number[:, None]
    square = (centred[:, :, None] * centred[:, None]).reshape(-1, 9)
    spread = (about @ square / number[:, None]).reshape(-1, 3, 3) - mean[:, :, None] * mean[:, None]
    size = np.linalg.eigvalsh(spread)
    return np.asarray((number >= links.neighbours) & (size[:, 1] < MAX_FLATNESS * size[:, 2]))


def _thin(points: Float, piece: Int64, edge: float) -> tuple[Float, Int64]:
    """Return one point of each voxel."""
    _, first = np.unique(cell_keys(points, edge), return_index=True)
    return points[first], piece[first]


def _fit_cluster(
    cluster: Float, start: PlacedLadder, shifts: Sequence[float], shown: cKDTree, links: Links
) -> LaserLadder | None:
    """Fit a ladder to a cluster from several heights of its zero; return None if it is not a ladder."""
    ladder = start.ladder
    order = np.random.default_rng(0).permutation(len(cluster))
    few, cluster = cluster[order[:FIRST_FIT_POINTS]], cluster[order[:MAX_POINTS]]
    tried: list[tuple[float, PlacedLadder]] = []
    for shift in shifts:
        cost, fitted, _ = _refine(few, start.moved(np.zeros(3), start.axes[1] * shift), 10)
        tried.append((cost, fitted))
    if min((cost for cost, _ in tried), default=np.inf) > MAX_COST_SHARE * _astray(len(few)):
        return None
    tried.sort(key=lambda one: one[0])
    refined = [_refine(cluster, start, 40) for _, start in tried]
    refined = sorted(((cost + _unseen_cost(shown, one), one, spread) for cost, one, spread in refined), key=lambda one: one[0])
    cost, placed, covariance = refined[0]
    own = placed.to_ladder(cluster)
    which, away = nearest_element(own, placed)
    residual = np.linalg.norm(away, axis=1) - placed.radius(which)
    close = np.abs(residual) < 5.0 * NOISE
    if close.mean() < 0.5:
        return None
    inside = np.abs(own[:, 0]) < placed.gap / 2.0 - max(ladder.diameter, placed.stile)
    between = close & inside
    if not inside.any() or float(np.median(np.abs(residual[inside]))) > links.rung_error:  # its gaps differ
        return None
    counts = np.bincount(which[between], minlength=len(ladder.height) + 2)
    seen = np.flatnonzero(counts[2:] >= 5)
    if len(seen) < 2:
        return None
    rms = float(np.sqrt(np.mean(residual[close] ** 2)))
    tie = MAX_TIE_LOG_RATIO * (rms / NOISE) ** 2  # scaled to the observed noise
    ties = tuple(
        float((other.origin - placed.origin) @ placed.axes[1])
        for other_cost, other, _ in refined[1:]
        if other_cost < cost + tie and np.linalg.norm(other.origin - placed.origin) > 0.1
    )
    return LaserLadder(placed, rms, tuple(ladder.number[i] for i in seen), int(close.sum()), cost, covariance, ties)


def _unseen_cost(shown: cKDTree, placed: PlacedLadder) -> float:
    """Return the cost of the parts of a ladder above the water that the laser should see and does not.

    Rungs alone may fit one gap higher or lower; then the ladder would end elsewhere.
    """
    begin, end = placed.elements()
    low, high = placed.ladder.height[[0, -1]]
    begin[:2, 1], end[:2, 1] = low, high  # how far the stiles go beyond the rungs is not known
    share = np.linspace(0.0, 1.0, DOTS)
    dots = placed.to_space((begin[:, None] + share[None, :, None] * (end - begin)[:, None]).reshape(-1, 3))
    length = np.repeat(np.linalg.norm(end - begin, axis=1) / DOTS, DOTS)
    visible = (dots[:, 2] > MIN_HEIGHT + UNSEEN_MARGIN) & (dots[:, 2] < MAX_HEIGHT - UNSEEN_MARGIN)
    away, _ = shown.query(dots[visible], distance_upper_bound=placed.ladder.diameter / 2.0 + UNSEEN_REACH)
    return float(length[visible][~np.isfinite(away)].sum()) / UNSEEN_LENGTH


def _stiles(cluster: Float, out: Float, ladder: Ladder) -> PlacedLadder | None:
    """Fit plane and stiles: the sideways lean and the position at which two peaks are a ladder's width apart."""
    middle = np.median(cluster, axis=0)
    keep = np.ones(len(cluster), np.bool_)
    normal = out
    for _ in range(8):  # plane of most of the cluster, upright or leaning towards the wall
        _, _, axes = np.linalg.svd(cluster[keep] - cluster[keep].mean(axis=0), full_matrices=False)
        normal = axes[2] * np.sign(axes[2] @ out)
        off = (cluster - cluster[keep].mean(axis=0)) @ normal
        limit = max(3.0 * float(np.median(np.abs(off[keep]))), 0.02)
        keep = np.abs(off - np.median(off[keep])) < limit
        if keep.sum() < 30:
            return None
    if normal @ out < 0.7:
        return None
    middle = cluster[keep].mean(axis=0)
    across = np.cross(np.array([0.0, 0.0, 1.0]), normal)
    across /= np.linalg.norm(across)
    up = np.cross(normal, across)
    plane = (cluster[keep] - middle) @ np.column_stack([across, up])
    best: tuple[float, float, float, float] | None = None
    for lean in LEANING:
        place = plane[:, 0] * np.cos(lean) + plane[:, 1] * np.sin(lean)
        first = place.min() - 0.05
        histogram = np.bincount(((place - first) / BIN).astype(np.int64))
        smooth = gaussian_filter1d(histogram.astype(np.float64), 1.5, mode="constant")
        for gap in np.arange(ladder.stile_gap - 0.03, ladder.stile_gap + 0.031, BIN):
            step = round(gap / BIN)
            if step >= len(smooth):
                continue
            both = np.minimum(smooth[:-step], smooth[step:])
            k = int(np.argmax(both))
            if best is None or both[k] > best[0]:
                best = (float(both[k]), float(lean), first + (k + 0.5) * BIN, step * BIN)
    if best is None or best[0] <= 0.0:
        return None
    _, lean, left, gap = best
    turned_across = across * np.cos(lean) + up * np.sin(lean)
    turned_up = -across * np.sin(lean) + up * np.cos(lean)
    origin = middle + turned_across * (left + gap / 2.0) - normal * ladder.diameter / 2.0
    return PlacedLadder(ladder, origin, np.vstack([turned_across, turned_up, normal]), gap, ladder.diameter)


def _shifts(own: Float, ladder: Ladder, gap: float) -> list[tuple[float, float]]:
    """Return how well rungs match the points between the stiles at possible heights of the ladder's zero, the best first."""
    inside = np.abs(own[:, 0]) < gap / 2.0 - ladder.diameter
    if inside.sum() < 10:
        return []
    low, high = own[:, 1].min(), own[:, 1].max()
    histogram = np.bincount(((own[inside, 1] - low) / BIN).astype(np.int64), minlength=int((high - low) / BIN) + 1)
    smooth = gaussian_filter1d(histogram.astype(np.float64), 2.0, mode="constant")
    smooth = np.minimum(smooth, np.percentile(smooth[smooth > 0.0], 95) if (smooth > 0.0).any() else 0.0)
    zero = np.arange(low - ladder.height[-1], high - ladder.height[0], BIN)
    at = zero[:, None] + ladder.height[None]
    k = np.round((at - low) / BIN).astype(np.int64)
    visible = (k >= 0) & (k < len(smooth))
    score = np.where(visible, smooth[np.clip(k, 0, len(smooth) - 1)] - smooth.mean(), 0.0).sum(axis=1)
    chosen: list[tuple[float, float]] = []
    for i in np.argsort(-score):
        if score[i] <= 0.0 or len(chosen) == STARTS:
            break
        if all(abs(zero[i] - other) > 0.05 for _, other in chosen):
            chosen.append((float(score[i]), float(zero[i])))
    return chosen


def _refine(cluster: Float, start: PlacedLadder, max_points: int) -> tuple[float, PlacedLadder, Float]:
    """Fit turn, shift, gap and thickness of the stiles by robust least squares; return cost, ladder and covariance."""
    usual = start.ladder.diameter

    def compared(change: Float) -> tuple[PlacedLadder, Float, Int64, Float]:
        placed = start.moved(change[:3], change[3:6], float(change[6]), float(change[7]))
        own = placed.to_ladder(cluster)
        return placed, own, *nearest_element(own, placed)

    def residual(change: Float) -> Float:
        placed, _, which, away = compared(change)
        off = (np.linalg.norm(away, axis=1) - placed.radius(which)) / NOISE
        return np.append(off, (placed.stile - usual) / STILE_SIGMA)

    def derivatives(change: Float) -> Float:
        """Return the derivatives of the residuals: movement of a bar's axis towards a point reduces its distance."""
        placed, own, which, away = compared(change)
        towards = away / np.maximum(np.linalg.norm(away, axis=1), 1e-9)[:, None]
        turn, shift = np.cross(own - away, towards) @ placed.axes, towards @ placed.axes
        wider = 0.5 * towards[:, 0] * np.select([which == 0, which == 1], [-1.0, 1.0], 0.0)
        thicker = 0.5 * (which < 2)
        usual_stile = np.append(np.zeros(7), 1.0 / STILE_SIGMA)
        return np.vstack([-np.column_stack([turn, shift, wider, thicker]) / NOISE, usual_stile])

    scale = np.array([0.01] * 6 + [0.005, 0.005])
    found = least_squares(residual, np.zeros(8), derivatives, loss="cauchy", x_scale=scale, max_nfev=max_points)
    information = found.jac.T @ found.jac
    covariance = np.linalg.pinv(information, rcond=1e-12)[:7, :7]
    return (
        float(found.cost) / POINTS_PER_OBSERVATION,
        start.moved(found.x[:3], found.x[3:6], float(found.x[6]), float(found.x[7])),
        np.asarray(covariance),
    )
