"""Smoothing of lines through points at even distances."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solveh_banded

from tunneldb.arrays import Bool, Float
from tunneldb.robust import MAD_TO_SIGMA

_STIFFNESS = 10.0  # of third differences; at 5 m between places waves of 45 m are halved
_MIN_PLACES = 6  # least number of places of a line for smoothing
_PASSES = 5
_MIN_OUTLIER_DEVIATION = 0.02  # m; deviations up to this are never outliers


def smooth_line(places: Float, seen: Bool) -> Float:
    """Smooth places (k, d) at even distances; missing places and outliers follow their neighbours (Whittaker, 1923).

    Third differences are minimised, so that straight lines and circles are preserved. Fewer than 6 places stay unchanged.
    """
    count = len(places)
    if count < _MIN_PLACES or np.count_nonzero(seen) < 4:
        return places
    bend = _STIFFNESS * _third_differences(count)
    weight = seen.astype(np.float64)
    out = places
    for _ in range(_PASSES):
        bands = bend.copy()
        bands[0] += weight + 1e-9
        out = solveh_banded(bands, (weight + 1e-9)[:, None] * places, lower=True)
        away = np.linalg.norm(places - out, axis=1)
        usual = max(3.0 * MAD_TO_SIGMA * float(np.median(away[seen])), _MIN_OUTLIER_DEVIATION)
        weight = np.where(seen, 1.0 / (1.0 + (away / usual) ** 2), 0.0)
    return np.asarray(out)


def _third_differences(count: int) -> Float:
    """Return the lower bands (4, count) of the sum of the squares of third differences of a sequence."""
    weights = np.array([-1.0, 3.0, -3.0, 1.0])
    bands = np.zeros((4, count))
    for i in range(4):
        for j in range(i + 1):
            bands[i - j, j : j + count - 3] += weights[i] * weights[j]
    return bands
