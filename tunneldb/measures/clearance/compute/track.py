"""Tracks from points of their rails: heads, pairs of heads at the gauge, and a smooth axis with cant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.robust import MAD_TO_SIGMA

GAUGE = 1.435
"""Distance of the inner faces of the two heads, m: standard gauge."""

HEAD = 0.072
"""Width of a rail's head, m: profile 60E1; heads of other rails differ by a few mm."""

STATION = 5.0
"""Length of the stretches in which rails are located, m: dozens of points of a head at a point spacing of 0.1 to 0.2 m."""

MIN_TRACK_LENGTH = 25.0
"""Minimum length of two parallel rails for a track, m."""

_HEAD_DEPTH = 0.02  # m: maximum depth below the top of a rail of points of its head
_MIN_RAIL_GAP = 0.12  # m: minimum lateral gap between two rails
_MAX_RAIL_WIDTH = 0.35  # m: maximum width of a rail
_MIN_HEAD_POINTS = 4  # minimum points of a head
_SPACING_TOLERANCE = 0.06  # m: tolerance of the distance of two heads: widened gauge, wear, few points
_MAX_CANT = 0.25  # m: maximum height difference of the rails of a track
_MAX_SIDESTEP = 0.15  # m: maximum deviation of a track from the straight continuation, from one station to the next
_MAX_GAP = 30.0  # m without rails over which a track is followed and interpolated
_MIN_SIGMA = 0.003  # m: lower limit of a head's standard error, from dozens of points over 0.07 m
_MAX_HEAD_RESIDUAL = 0.05  # m: maximum deviation of a head at one station from the smooth track; few points show its edges only
_EDGE_SHARE = 0.05  # share of the points of a head beyond each of its two estimated edges


@dataclass(frozen=True)
class Pairs:
    """Pairs of heads that may be a track: (n,) arrays; heads are (n, 2), left and right, about the given axis, m."""

    chainage: Float
    right: Float
    up: Float

    @property
    def middle(self) -> Float:
        """Middle between the two heads, (n,), m right of the axis."""
        return np.asarray(self.right.mean(axis=1))

    @classmethod
    def joined(cls, parts: Sequence[Pairs]) -> Pairs:
        """Join the pairs of several stretches."""
        if not parts:
            return cls(np.empty(0), np.empty((0, 2)), np.empty((0, 2)))
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in ("chainage", "right", "up")))


@dataclass(frozen=True)
class Track:
    """Axis and cant of a track at stations along the given axis; (n,) arrays.

    Attributes
    ----------
    chainage : float array
        Along the given axis, m, growing.
    right, up : float array
        Middle of the track on the plane of the running surface, about the given axis, m.
    cant : float array
        Height of the left head above the right one, m.
    right_se, up_se, cant_se : float array
        Standard errors, m; 0 for a given track.
    seen : bool array
        True if both rails were seen there; elsewhere it is interpolated.
    spacing : float
        Distance of the heads' middles over which the cant is measured, m.
    reach : float
        Maximum distance from the nearest station at which a place has a track, m.
    """

    chainage: Float
    right: Float
    up: Float
    cant: Float
    right_se: Float
    up_se: Float
    cant_se: Float
    seen: Bool
    spacing: float = GAUGE + HEAD
    reach: float = STATION / 2.0

    def at(self, chainage: Float) -> Float:
        """Return right, up, cant, right_se, up_se, cant_se at chainages (n,): (n, 6), m; NaN without a track."""
        columns = (self.right, self.up, self.cant, self.right_se, self.up_se, self.cant_se)
        found = np.column_stack([_linear(chainage, self.chainage, column) for column in columns])
        if len(self.chainage) < 2:
            found[np.abs(chainage - self.chainage[0]) > self.reach + 1e-6] = np.nan
            return found
        after = np.clip(np.searchsorted(self.chainage, chainage), 1, len(self.chainage) - 1)
        away = np.minimum(np.abs(chainage - self.chainage[after - 1]), np.abs(chainage - self.chainage[after]))
        found[away > self.reach + 1e-6] = np.nan
        return found

    def places(self, chainage: Float, right: Float, up: Float) -> Float:
        """Return points about the given axis (n,) in the track's frame: right of its middle and above it, (n, 2), m."""
        found = self.at(chainage)
        sine = np.clip(found[:, 2] / self.spacing, -1.0, 1.0)
        cosine = np.sqrt(1.0 - sine**2)
        x, y = right - found[:, 0], up - found[:, 1]
        return np.column_stack([cosine * x - sine * y, sine * x + cosine * y])

    def about_axis(self, chainage: Float, right: Float, up: Float) -> Float:
        """Return points in the track's frame (n,) about the given axis, right and up, (n, 2), m: the inverse of `places`."""
        found = self.at(chainage)
        sine = np.clip(found[:, 2] / self.spacing, -1.0, 1.0)
        cosine = np.sqrt(1.0 - sine**2)
        return np.column_stack([found[:, 0] + cosine * right + sine * up, found[:, 1] - sine * right + cosine * up])


def metre_track(begin: float, right: float, up: float, cant: float) -> Track:
    """Return the track of a metre: its middle right of the given axis and above it, m; cant: left rail above the right one."""
    same, none = np.array([begin, begin + 1.0]), np.zeros(2)
    return Track(same, none + right, none + up, none + cant, none, none, none, np.ones(2, np.bool_), reach=1.0)


def metre_places(about: Float, begin: float, right: float, up: float, cant: float) -> tuple[Float, Bool]:
    """Return the points of a metre in its track's frame, (k, 2), m, and which of the points about the axis (n, 3) they are.

    The track is that of :func:`metre_track`.
    """
    selected = np.asarray((about[:, 0] >= begin) & (about[:, 0] < begin + 1.0))
    return metre_track(begin, right, up, cant).places(*about[selected].T), selected


def rail_pairs(points: Float, gauge: float = GAUGE) -> Pairs:
    """Find pairs of heads at the gauge in stretches of `STATION`.

    Parameters
    ----------
    points : (n, 3) float array
        Points of bars along the ground: chainage, right of the given axis, above it, m.
    gauge : float
        m.
    """
    number = np.floor(points[:, 0] / STATION).astype(np.int64)
    order = np.argsort(number, kind="stable")
    points, number = points[order], number[order]
    found: list[Pairs] = []
    for first, stop in _runs(number):
        heads = _heads(points[first:stop])
        if len(heads) < 2:
            continue
        left, right = np.triu_indices(len(heads), k=1)
        selected = np.abs(heads[right, 0] - heads[left, 0] - gauge - HEAD) <= _SPACING_TOLERANCE
        selected &= np.abs(heads[right, 1] - heads[left, 1]) <= _MAX_CANT
        both = np.stack([heads[left[selected]], heads[right[selected]]], axis=1)
        middle = np.full(len(both), (number[first] + 0.5) * STATION)
        found.append(Pairs(middle, both[:, :, 0], both[:, :, 1]))
    return Pairs.joined(found)


def follow(pairs: Pairs) -> list[Pairs]:
    """Sort pairs into tracks, from left to right: each continues nearly straight from station to station.

    Raises
    ------
    ValueError
        If two tracks share a rail, so that the right one is ambiguous.
    """
    tracks: list[list[int]] = []
    order = np.argsort(pairs.chainage, kind="stable")
    for k in order.tolist():
        best, nearest = None, np.inf
        for track in tracks:
            gap = pairs.chainage[k] - pairs.chainage[track[-1]]
            if not 0.0 < gap <= _MAX_GAP:
                continue
            off = abs(pairs.middle[k] - _continued(pairs, track, pairs.chainage[k]))
            if off < min(nearest, _MAX_SIDESTEP * max(gap / STATION, 1.0) ** 0.5):
                best, nearest = track, off
        if best is None:
            tracks.append([k])
        else:
            best.append(k)
    long = [t for t in tracks if (len(t) - 1) * STATION >= MIN_TRACK_LENGTH / 2.0]
    long = [t for t in long if pairs.chainage[t[-1]] - pairs.chainage[t[0]] + STATION >= MIN_TRACK_LENGTH]
    found = [Pairs(pairs.chainage[t], pairs.right[t], pairs.up[t]) for t in long]
    found.sort(key=lambda track: float(np.median(track.middle)))
    for one, two in pairwise(found):
        shared = np.intersect1d(one.chainage, two.chainage)
        if len(shared) and abs(float(np.median(two.middle)) - float(np.median(one.middle))) < GAUGE:
            separation = float(np.median(two.middle) - np.median(one.middle))
            raise ValueError(f"near chainage {shared[0]:.0f} two tracks would be {separation:.2f} m apart")
    return found


def fit_track(points: Float, coarse: Pairs, low: float, high: float, gauge: float = GAUGE) -> Track:
    """Fit axis and cant of a track to points of its rails.

    Parameters
    ----------
    points : (n, 3) float array
        Points of bars along the ground: chainage, right of the given axis, above it, m.
    coarse : Pairs
        One of the tracks from `follow`.
    low, high : float
        Limits of the stretch, m; stations are within, and where the coarse track is.
    gauge : float
        m.

    Notes
    -----
    Each head is in the middle of its edges, which enclose all but a twentieth of its points on either side; its top is the
    median of the middle of its points. Both are measured as deviations from the track so far, so that a curve does not blur
    them; three iterations. The two heads' means and difference are then smoothed along the track: least squares with a penalty
    on the third difference, which does not affect a circular curve or a constant cant. Generalised cross-validation sets the
    penalty. A station that contradicts the smooth track has no value: interpolation would hide a different measurement.
    """
    low, high = max(low, coarse.chainage[0] - STATION / 2.0), min(high, coarse.chainage[-1] + STATION / 2.0)
    first, last = int(np.floor(low / STATION)), int(np.ceil(high / STATION))
    stations = (np.arange(first, max(last, first + 1)) + 0.5) * np.float64(STATION)
    heads = np.stack([
        np.interp(stations, coarse.chainage, column) for column in (*coarse.right.T, *coarse.up.T)
    ])  # fmt: skip
    width = gauge + HEAD
    seen: Bool = np.zeros(len(stations), np.bool_)
    smooth = np.zeros((3, len(stations)))
    errors = np.zeros((3, len(stations)))
    found = seen
    for _ in range(3):
        measured = [_measured(points, stations, heads[k], heads[k + 2]) for k in (0, 1)]
        seen = found = np.asarray(np.isfinite(np.hstack(measured)).all(axis=1))
        if seen.sum() < 4:
            break
        (left, left_up), (right, right_up) = measured[0].T, measured[1].T
        used = seen.copy()
        for row, value in enumerate(((left + right) / 2.0, (left_up + right_up) / 2.0, left_up - right_up)):
            smooth[row], errors[row], selected = _smoothed(value, seen)
            used &= selected
        half = width / 2.0 * np.sqrt(1.0 - np.clip(smooth[2] / width, -1.0, 1.0) ** 2)
        heads = np.stack([smooth[0] - half, smooth[0] + half, smooth[1] + smooth[2] / 2.0, smooth[1] - smooth[2] / 2.0])
        seen = used
    kept = ~_far_from_seen(stations, seen) & (found | ~_contradicted(stations, heads, coarse))
    right, up, cant = smooth[:, kept]
    right_se, up_se, cant_se = errors[:, kept]
    return Track(stations[kept], right, up, cant, right_se, up_se, cant_se, seen[kept], width)


def curvature(chainage: Float, xy: Float, window: float = 50.0) -> Float:
    """Compute the curvature (n,), 1/m, positive to the right, of a track in plan at evenly spaced places xy (n, 2), m.

    It is that of the parabola through the places of a window about each place (Savitzky and Golay, 1964).
    """
    from scipy.signal import savgol_filter

    step = float(np.median(np.diff(chainage))) if len(chainage) > 1 else 1.0
    count = min(2 * round(window / step / 2.0) + 1, len(chainage) - (1 - len(chainage) % 2))
    if count < 5:
        return np.zeros(len(chainage))
    (dx, dy), (ddx, ddy) = (savgol_filter(xy, count, 2, deriv=k, delta=step, axis=0, mode="interp").T for k in (1, 2))
    return np.asarray(-(dx * ddy - dy * ddx) / np.hypot(dx, dy) ** 3)


def _linear(at: Float, along: Float, values: Float) -> Float:
    """Interpolate values (n,) linearly at increasing places, and extrapolate linearly before the first and after the last."""
    if len(along) < 2:
        return np.full(len(at), values[0])
    k = np.clip(np.searchsorted(along, at), 1, len(along) - 1)
    share = (at - along[k - 1]) / (along[k] - along[k - 1])
    return np.asarray(values[k - 1] + share * (values[k] - values[k - 1]))


def _runs(number: Int64) -> list[tuple[int, int]]:
    """Return the first index and one after the last of each run of equal numbers."""
    if not len(number):
        return []
    bounds = np.flatnonzero(np.diff(number, prepend=number[0] - 1, append=number[-1] + 1))
    return list(pairwise(bounds.tolist()))


def _heads(points: Float) -> Float:
    """Return middle and top of each rail in points of a stretch, (k, 2), from left to right, m."""
    order = np.argsort(points[:, 1])
    right, up = points[order, 1], points[order, 2]
    label = np.cumsum(np.diff(right, prepend=right[0]) > _MIN_RAIL_GAP)
    found = []
    for first, stop in _runs(label):
        if stop - first < _MIN_HEAD_POINTS or right[stop - 1] - right[first] > _MAX_RAIL_WIDTH:
            continue
        part = up[first:stop]
        top = np.partition(part, -2)[-2]  # the highest may be an outlier
        selected = part > top - _HEAD_DEPTH
        found.append((float(np.median(right[first:stop][selected])), float(top)))
    return np.array(found).reshape(-1, 2)


def _continued(pairs: Pairs, track: list[int], chainage: float) -> float:
    """Extrapolate a track by its last stations, m to the right."""
    recent = np.array(track[-6:])
    if len(recent) < 4:
        return float(pairs.middle[recent[-1]])
    line = np.polynomial.Polynomial.fit(pairs.chainage[recent], pairs.middle[recent], 1)
    return float(line(chainage))


def _measured(points: Float, stations: Float, head: Float, top: Float) -> Float:
    """Measure middle and top of a rail at stations, (n, 2), m, NaN where not seen; ``head`` and ``top`` are approximate."""
    expected, level = _linear(points[:, 0], stations, head), _linear(points[:, 0], stations, top)
    offset, above = points[:, 1] - expected, points[:, 2] - level
    near = np.flatnonzero((np.abs(offset) <= HEAD / 2.0 + 0.04) & (np.abs(above) <= 2.0 * _HEAD_DEPTH))
    number = np.floor(points[near, 0] / STATION).astype(np.int64) - int(np.floor(stations[0] / STATION))
    near, number = near[(number >= 0) & (number < len(stations))], number[(number >= 0) & (number < len(stations))]
    order = np.argsort(number, kind="stable")
    near, number = near[order], number[order]
    found = np.full((len(stations), 2), np.nan)
    for first, stop in _runs(number):
        x, y = offset[near[first:stop]], above[near[first:stop]]
        if len(x) < _MIN_HEAD_POINTS:
            continue
        crown = np.abs(y - np.quantile(y, 0.7)) <= _HEAD_DEPTH / 2.0 + 0.005
        x, y = x[crown], y[crown]
        if len(x) < _MIN_HEAD_POINTS:
            continue
        middle = np.quantile(x, [_EDGE_SHARE, 1.0 - _EDGE_SHARE]).mean()
        inner = np.abs(x - middle) <= 0.4 * HEAD
        if inner.any():
            k = int(number[first])
            found[k] = head[k] + middle, top[k] + np.median(y[inner])
    return found


def _smoothed(value: Float, seen: Bool) -> tuple[Float, Float, Bool]:
    """Smooth and interpolate values (n,) by robust penalised least squares: values, standard errors, and which were used."""
    n = len(value)
    filled = np.where(seen, value, 0.0)
    penalty = np.diff(np.eye(n), 3, axis=0)
    penalty = penalty.T @ penalty
    weight = seen.astype(np.float64)
    fitted, errors = filled, np.zeros(n)
    for _ in range(4):
        best = np.inf
        for strength in 10.0 ** np.arange(-1.0, 8.5, 0.5):
            hat = np.linalg.solve(np.diag(weight) + strength * penalty + 1e-12 * np.eye(n), np.diag(weight))
            guess = hat @ filled
            freedom = weight.sum() - np.trace(hat)
            if freedom <= 1.0:
                continue
            score = weight.sum() * (weight * (filled - guess) ** 2).sum() / freedom**2
            if score < best:
                best, fitted = score, guess
                sigma = np.sqrt((weight * (filled - guess) ** 2).sum() / freedom)
                errors = sigma * np.sqrt((hat**2 / np.where(weight > 0.0, weight, np.inf)).sum(axis=1))
        residual = (filled - fitted)[seen]
        scale = max(MAD_TO_SIGMA * float(np.median(np.abs(residual - np.median(residual)))), _MIN_SIGMA)
        weight[seen] = np.clip(1.0 - (residual / (4.685 * scale)) ** 2, 0.0, None) ** 2
        if weight.sum() < 4.0:
            weight = seen.astype(np.float64)
    return fitted, errors, weight > 0.0


def _contradicted(stations: Float, heads: Float, coarse: Pairs) -> Bool:
    """Return the stations at which heads (4, n) disagree with those of the coarse track."""
    k = np.searchsorted(coarse.chainage, stations)
    k = np.clip(k, 0, len(coarse.chainage) - 1)
    there = np.abs(coarse.chainage[k] - stations) < 0.5
    rough = np.stack([*coarse.right[k].T, *coarse.up[k].T])
    return np.asarray(there & (np.abs(heads - rough).max(axis=0) > _MAX_HEAD_RESIDUAL))


def _far_from_seen(stations: Float, seen: Bool) -> Bool:
    """Return the stations in a gap without rails too long to interpolate, or beyond the last rails."""
    if not seen.any():
        return np.ones(len(stations), np.bool_)
    there = stations[seen]
    k = np.clip(np.searchsorted(there, stations), 0, len(there) - 1)
    before = there[np.clip(k - 1, 0, None)]
    after = there[k]
    inside = (stations >= there[0]) & (stations <= there[-1])
    gap = np.where(seen, 0.0, np.where(inside, after - before, np.inf))
    return np.asarray(gap > _MAX_GAP)
