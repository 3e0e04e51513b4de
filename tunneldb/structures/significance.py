"""Which pixels of a face differ by more than chance lets any: means over windows of several sizes.

The paper asks 3σ of a single point (Ono et al., 3.4). Of hundred thousand pixels some hundred lie beyond that by chance, while
a patch of a thousand that differ by 2σ each is none. So means over windows are held against the scatter of such means on the
face itself, unevenness of the surface with it, and asked so much that in a whole structure hardly one window passes by chance.
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
"""Windows that pass by chance in a whole structure, on average, of each size."""

AROUND = 3
"""What lies about a window, to so many times its side, is held against it as well: unevenness that is wider cancels."""

LEAST_FILLED = 0.5
"""Share of the pixels of a window that were judged, or its mean tells nothing."""

USUAL = 30.0
"""Windows beside each other for which the usual scatter of all faces stands in: of few the own is not known."""

LEVEL_SIGMA = 0.15
"""A level is known no better than this, dB."""

MOST_SAMPLES = 50_000


@dataclass
class Scatter:
    """Scatter of means over windows of each size, in standard deviations of a pixel, as it is on the faces so far."""

    sigma: dict[tuple[int, bool], list[float]] = field(default_factory=dict)
    weight: dict[tuple[int, bool], list[float]] = field(default_factory=dict)

    def copy(self) -> Scatter:
        """As it is now."""
        return Scatter(*({which: list(values) for which, values in part.items()} for part in (self.sigma, self.weight)))

    def restore(self, other: Scatter) -> None:
        """Go back to what it was."""
        self.sigma, self.weight = other.sigma, other.weight

    def blended(self, window: int, sigma: float, number: float, *, beside: bool) -> float:
        """Scatter of a face of so many windows, by itself or beside what is about them, by its own and the usual one."""
        known, weights = (part.setdefault((window, beside), []) for part in (self.sigma, self.weight))
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
    """How many standard deviations of a window's mean are none by chance, of a structure of so many pixels."""
    return -float(ndtri(min(ALARMS * window**2 / max(pixels, 1), 0.01)))


def significance(drop: Single, judged: Bool, sigma: Single, pixels: int, scatter: Scatter) -> tuple[Single, Single]:
    """Mean of the window about each pixel that differs most, over what is none by chance: from 1 on it differs.

    Parameters
    ----------
    drop : (rows, columns) float32 array
        Contrast, dB.
    judged : (rows, columns) bool array
    sigma : (rows, columns) float32 array
        Standard deviation of a pixel, dB.
    pixels : int
        Of all faces together.
    scatter : Scatter
        Of the faces before; this one's is added.

    Returns
    -------
    itself, beside : (rows, columns) float32 arrays
        By the mean itself, and by how far it lies off that of what is about the window, both with the sign of the drop.
    """
    itself, beside = np.zeros(drop.shape, np.float32), np.zeros(drop.shape, np.float32)
    ratio = np.where(judged, drop / np.maximum(sigma, 1e-3), np.float32(0.0)).astype(np.float32)
    usual = float(np.median(sigma[judged])) if judged.any() else 1.0
    for window in WINDOWS:
        filled, total = _shares(judged, ratio, window)
        about, around = _shares(judged, ratio, AROUND * window)
        ring, in_ring = ((AROUND**2 * wide - inner) / (AROUND**2 - 1) for wide, inner in ((about, filled), (around, total)))
        known = filled >= LEAST_FILLED
        # Of fewer pixels a mean scatters more.
        mean = np.where(known, total / np.sqrt(filled.clip(LEAST_FILLED)), np.float32(0.0))
        least = LEVEL_SIGMA / max(usual, 1e-3)
        itself = _farther(itself, mean, known & judged, window, pixels, scatter, least, beside=False)
        known &= ring >= LEAST_FILLED
        off = np.where(known, total / filled.clip(LEAST_FILLED) - in_ring / ring.clip(LEAST_FILLED), np.float32(0.0))
        beside = _farther(beside, off, known & judged, window, pixels, scatter, 0.0, beside=True)
    return itself, beside


def _shares(judged: Bool, ratio: Single, window: int) -> tuple[Single, Single]:
    """Share of a window about each pixel that was judged, and the sum over that by the pixels of the whole window."""
    first, second = (ndimage.uniform_filter(part, window, mode="constant") for part in (judged.astype(np.float32), ratio))
    return first, second


def _farther(
    most: Single, mean: Single, told: Bool, window: int, pixels: int, scatter: Scatter, least: float, *, beside: bool
) -> Single:
    """What is farther from 0: what was so far, or means over windows by what is none by chance."""
    whole = mean[told]
    if not len(whole):
        return most
    step = -(-len(whole) // MOST_SAMPLES)
    own = robust_statistics(whole[::step], SHORTH, two_sided=True).sigma
    wide = float(np.hypot(scatter.blended(window, own, len(whole) / window**2, beside=beside), least))
    scaled = mean / np.float32(wide * limit(pixels, window))
    return np.where(np.abs(scaled) > np.abs(most), scaled, most)
