"""Placement of an image by control points: pixels with known chainage and arc."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from affine import Affine

from tunneldb.arrays import Bool, Float, Intp
from tunneldb.errors import InputError
from tunneldb.raster.placement.mapping import AffineMapping, Mapping, PiecewiseMapping

KNOTS = (3, 4, 6, 8, 12, 16, 24, 32, 48, 64)
"""Numbers of knots of a piecewise mapping that are tried."""

POINTS_PER_KNOT = 3
"""Minimum number of points per knot."""

PIECEWISE_GAIN = 0.7
"""A piecewise mapping is used if its prediction error is at most this multiple of the affine mapping's."""

MIN_OUTLIER = 0.03
"""Minimum error of an outlier, m."""

MAX_OUTLIER_SHARE = 0.25
"""Maximum share of points that are rejected as outliers."""

OUTLIER_RATIOS = (0.4, 0.3)
"""One point, or two, are outliers if the standard deviation without them is at most this multiple of the former one."""

MIN_REDUNDANT = 5
"""Minimum number of points that remain after the rejection of an outlier: two more than an affine mapping needs."""

_FOLDS = 50
_ROUNDS = 5
_SUSPECTS = 6


@dataclass(frozen=True)
class ControlFit:
    """Mapping fitted to control points.

    Attributes
    ----------
    mapping : Mapping
        From pixels to the unrolled plane.
    model : {'similarity', 'affine', 'piecewise'}
        Kind of the mapping. A similarity, from points on one line, has the same scale along and around the tunnel.
    residuals : (n, 2) array
        Given place minus fitted place of each point, chainage and arc, m; also of outliers.
    outliers : (n,) bool array
        True for points that the fit does not use.
    rms : float
        Root mean square of the distance between given and fitted place, of the points used, m.
    predicted : float or None
        The same for points that are predicted from the others, m; None without redundant points.
    """

    mapping: Mapping
    model: str
    residuals: Float
    outliers: Bool
    rms: float
    predicted: float | None


def fit_control(pixels: Float, places: Float) -> ControlFit:
    """Fit a mapping to control points by least squares, without outliers.

    The mapping is affine with three points or more, and a similarity if they are two, or on one line. It is piecewise along
    the tunnel if that predicts points from the others better, as with a drifting odometer.

    Parameters
    ----------
    pixels : (n, 2) array
        Column and row.
    places : (n, 2) array
        Chainage and arc, m.

    Raises
    ------
    InputError
        If the points do not determine a mapping.
    """
    if len(pixels) < 2:
        raise InputError("an image needs at least two control points")
    for what, array in (("pixel", pixels), ("place", places)):
        if len(pixels) == 2 and np.array_equal(array[0], array[1]):
            raise InputError(f"both control points have the same {what}")
    if _spread(pixels)[0] == 0.0 or _spread(places)[0] == 0.0:
        raise InputError("all control points are at one place")
    model = "affine" if _is_plane(pixels) else "similarity"
    fit = _fit_affine if model == "affine" else _fit_similarity
    used, predicted = _without_outliers(fit, pixels, places)
    mapping: Mapping = fit(pixels[used], places[used])
    if model == "affine":
        better = _piecewise(pixels, places)
        if better is not None and better[2] <= PIECEWISE_GAIN * (float("inf") if better[1].sum() > used.sum() else predicted):
            (mapping, used, predicted), model = better, "piecewise"
    residuals = places - np.column_stack(mapping.forward(pixels[:, 0], pixels[:, 1]))
    return ControlFit(mapping, model, residuals, ~used, _rms(residuals[used]), predicted if np.isfinite(predicted) else None)


def _spread(points: Float) -> Float:
    """Return the standard deviations of points along their principal directions, the greater one first."""
    return np.asarray(np.linalg.svd(points - points.mean(axis=0), compute_uv=False) / np.sqrt(len(points)))


def _is_plane(pixels: Float) -> bool:
    """Return True if points are not on one line, within a hundredth of their extent or 2 pixels."""
    if len(pixels) < 3:
        return False
    long, short = _spread(pixels)
    return bool(short > max(1e-3 * long, 1.0))


Fit = Callable[[Float, Float], Mapping]


def _fit_affine(pixels: Float, places: Float) -> AffineMapping:
    middle = pixels.mean(axis=0)
    design = np.column_stack([pixels - middle, np.ones(len(pixels))])
    (a, d), (b, e), (c, f) = np.linalg.lstsq(design, places, rcond=None)[0]
    return AffineMapping(Affine(a, b, c, d, e, f) @ Affine.translation(*-middle))


def _fit_similarity(pixels: Float, places: Float) -> AffineMapping:
    """Fit shift, turn and one scale to points; the image is not mirrored."""
    middle = pixels.mean(axis=0)
    x, y = (pixels - middle).T
    one, zero = np.ones(len(x)), np.zeros(len(x))
    # chainage = a x + b y + c; arc = b x - a y + f, as rows run downwards
    design = np.vstack([np.column_stack([x, y, one, zero]), np.column_stack([-y, x, zero, one])])
    a, b, c, f = np.linalg.lstsq(design, places.T.ravel(), rcond=None)[0]
    return AffineMapping(Affine(a, b, c, b, -a, f) @ Affine.translation(*-middle))


def _piecewise(pixels: Float, places: Float) -> tuple[Mapping, Bool, float] | None:
    """Return the piecewise mapping that predicts points best, the points that it uses, and its prediction error, m."""
    found = None
    for knots in KNOTS:
        if knots * POINTS_PER_KNOT > len(pixels):
            break

        def fit(some_pixels: Float, some_places: Float, knots: int = knots) -> Mapping:
            return _fit_piecewise(some_pixels, some_places, knots)

        used, predicted = _without_outliers(fit, pixels, places)
        mapping = fit(pixels[used], places[used])
        if isinstance(mapping, PiecewiseMapping) and (found is None or predicted < 0.98 * found[2]):
            found = (mapping, used, predicted)
    return found


def _fit_piecewise(pixels: Float, places: Float, count: int) -> Mapping:
    """Fit a piecewise mapping; an affine one if its chainage would not grow, or its points are not enough."""
    linear = _fit_affine(pixels, places)
    along, around = linear.forward(pixels[:, 0], pixels[:, 1])
    knots = np.unique(np.quantile(along, np.linspace(0.0, 1.0, count)))
    if len(knots) < 2:
        return linear
    # The second differences are kept small where points do not determine a knot.
    smooth = 1e-3 * np.diff(np.eye(len(knots)), 2, axis=0)
    for _ in range(_ROUNDS):
        hats = np.column_stack([np.interp(along, knots, unit) for unit in np.eye(len(knots))])
        left = np.vstack([places - np.column_stack([along, around]), np.zeros((len(smooth), 2))])
        shift = np.linalg.lstsq(np.vstack([hats, smooth]), left, rcond=None)[0]
        linear = _fit_affine(pixels, places - hats @ shift)
        along, around = linear.forward(pixels[:, 0], pixels[:, 1])
    if not np.all(np.diff(knots + shift[:, 0]) > 0.2 * np.diff(knots)):
        return linear
    return PiecewiseMapping(linear.linear, knots, shift[:, 0], shift[:, 1])


def _without_outliers(fit: Fit, pixels: Float, places: Float) -> tuple[Bool, float]:
    """Return the points that agree with each other under a model, and how well they predict each other, m; inf: unknown."""
    used = np.ones(len(pixels), dtype=np.bool_)
    least = max(MIN_REDUNDANT, int(np.ceil((1.0 - MAX_OUTLIER_SHARE) * len(pixels))))
    while True:
        errors = _predict(fit, pixels[used], places[used])
        number = int(used.sum())
        at = np.flatnonzero(used)
        suspects = at[np.argsort(-errors)[:_SUSPECTS]]
        removed = None
        for size, ratio in enumerate(OUTLIER_RATIOS, start=1):
            if number - size < least:
                break
            removed = _removable(fit, pixels, places, used, suspects, size, ratio)
            if removed is not None:
                break
        if removed is None:
            return used, _rms(errors[:, None]) if np.all(np.isfinite(errors)) else float("inf")
        used[removed] = False


def _removable(fit: Fit, pixels: Float, places: Float, used: Bool, suspects: Intp, size: int, ratio: float) -> list[int] | None:
    """Return the outliers whose removal reduces the standard deviation most; None if none reduces it enough."""
    before, best = _deviation(fit, pixels[used], places[used]), None
    for some in combinations(suspects.tolist(), size):
        rest = used.copy()
        rest[list(some)] = False
        after = _deviation(fit, pixels[rest], places[rest])
        if after > ratio * before or (best is not None and after >= best[0]):
            continue
        mapping = fit(pixels[rest], places[rest])
        error = _distances(mapping, pixels[list(some)], places[list(some)])
        if np.all(error > max(MIN_OUTLIER, 4.0 * after)):
            best = (after, list(some))
    return None if best is None else best[1]


def _deviation(fit: Fit, pixels: Float, places: Float) -> float:
    """Return the standard deviation of the points about a fit, m, by the degrees of freedom of an affine mapping."""
    distances = _distances(fit(pixels, places), pixels, places)
    return float(np.sqrt(np.sum(distances**2) / max(len(pixels) - 3, 1)))


def _predict(fit: Fit, pixels: Float, places: Float) -> Float:
    """Return the distance of each point from where the others predict it, m; infinite without redundant points."""
    errors = np.full(len(pixels), np.inf)
    if len(pixels) < 4:
        return errors
    fold = np.arange(len(pixels)) % min(len(pixels), _FOLDS)
    for number in range(int(fold.max()) + 1):
        out = fold == number
        errors[out] = _distances(fit(pixels[~out], places[~out]), pixels[out], places[out])
    return errors


def _distances(mapping: Mapping, pixels: Float, places: Float) -> Float:
    return np.hypot(*(places - np.column_stack(mapping.forward(pixels[:, 0], pixels[:, 1]))).T)


def _rms(errors: Float) -> float:
    return float(np.sqrt(np.mean(np.sum(errors**2, axis=1)))) if len(errors) else 0.0
