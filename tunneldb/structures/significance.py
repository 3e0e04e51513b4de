"""Significant differences of a face's pixels: means over windows of several sizes.

The paper requires 3σ of a single point (Ono et al., 3.4). Some hundred of a hundred thousand pixels exceed that by chance,
while a patch of a thousand that differ by 2σ each does not. So means over windows are compared with the scatter of such means
on the face itself, including the surface's unevenness, with a limit that hardly one window in a whole structure passes by
chance.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy import ndimage
from scipy.special import ndtri

from tunneldb.arrays import Bool, Single
from tunneldb.radiometry.robust_statistics import robust_statistics
from tunneldb.structures.level import SHORTH

WINDOWS = (3, 5, 9)
"""Sides of the windows, pixels."""

ALARMS = 0.05
"""Mean number of windows of each size that pass by chance in a whole structure."""

MIN_FILLED_SHARE = 0.5
"""Minimum share of a window's pixels with a value."""

USUAL = 30.0
"""Minimum number of adjacent windows for a face's own scatter; with fewer the usual scatter of all faces is used."""

LEVEL_SIGMA = 0.15
"""Minimum standard error of a level, dB."""

MAX_SAMPLES = 50_000


@dataclass
class Scatter:
    """Scatter of means over windows of each size, in standard deviations of a pixel, as it is on the faces so far."""

    sigma: dict[int, list[float]] = field(default_factory=dict)
    weight: dict[int, list[float]] = field(default_factory=dict)

    def copy(self) -> Scatter:
        """Return the current state."""
        return Scatter(*({window: list(values) for window, values in part.items()} for part in (self.sigma, self.weight)))

    def restore(self, other: Scatter) -> None:
        """Restore an earlier state."""
        self.sigma, self.weight = other.sigma, other.weight

    def blended(self, window: int, sigma: float, number: float) -> float:
        """Return the scatter of a face of so many windows, from its own and the usual one, and store it."""
        known, weights = self.sigma.setdefault(window, []), self.weight.setdefault(window, [])
        usual = 1.0 / window
        if known:
            order = np.argsort(known)
            share = np.cumsum(np.array(weights)[order])
            usual = known[order[int(np.searchsorted(share, 0.5 * share[-1]))]]
        if number >= 1.0:
            known.append(sigma)
            weights.append(number)
        return float(np.sqrt((number * sigma**2 + USUAL * usual**2) / (number + USUAL)))


def limit(pixels: int, window: int) -> float:
    """Return the standard deviations of a window's mean that chance does not exceed, for a structure of so many pixels."""
    return -float(ndtri(min(ALARMS * window**2 / max(pixels, 1), 0.01)))


def significance(drop: Single, judged: Bool, sigma: Single, pixels: int, scatter: Scatter) -> tuple[Single, Single]:
    """Compare the means of windows around each pixel with their scatter.

    Parameters
    ----------
    drop : (rows, columns) float32 array
        Contrast, dB.
    judged : (rows, columns) bool array
    sigma : (rows, columns) float32 array
        Standard deviation of a pixel, dB.
    pixels : int
        Number of pixels of all faces together.
    scatter : Scatter
        Scatter of the faces before; this one's is added.

    Returns
    -------
    ratio, broad : (rows, columns) float32 arrays
        Mean of the most different window over the chance limit, significant from 1 on; mean of the largest window, in
        standard deviations. Signed as the darkening.
    """
    most: Single = np.zeros(drop.shape, np.float32)
    broad: Single = np.zeros(drop.shape, np.float32)
    count = judged.astype(np.float32)
    ratio = np.where(judged, drop / np.maximum(sigma, 1e-3), np.float32(0.0)).astype(np.float32)
    usual = float(np.median(sigma[judged])) if judged.any() else 1.0
    for window in WINDOWS:
        filled = ndimage.uniform_filter(count, window, mode="constant")
        known = filled >= MIN_FILLED_SHARE
        mean = ndimage.uniform_filter(ratio, window, mode="constant")
        # Of fewer pixels a mean scatters more.
        mean = np.where(known, mean / np.sqrt(np.maximum(filled, MIN_FILLED_SHARE)), np.float32(0.0))
        whole = mean[known & judged]
        if not len(whole):
            continue
        step = -(-len(whole) // MAX_SAMPLES)
        own = robust_statistics(whole[::step], SHORTH, two_sided=True).sigma
        wide = scatter.blended(window, own, len(whole) / window**2)
        wide = float(np.hypot(wide, LEVEL_SIGMA / max(usual, 1e-3)))
        broad = np.asarray(mean / np.float32(wide), np.float32)
        scaled = broad / np.float32(limit(pixels, window))
        most = np.where(np.abs(scaled) > np.abs(most), scaled, most)
    return most, broad
