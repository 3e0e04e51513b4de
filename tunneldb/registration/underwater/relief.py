"""Relief of the bed in a sonar scan, and the evidence that two scans show the same bed at a shift along the canal.

Each scan's relief is an image in its own level frame, without the part that is constant along the canal. Two images are
compared at all shifts at once by masked correlation (Padfield, 2012). The significance of a correlation depends on the
number of independent places in the images (Dutilleul, 1993): wide relief has few.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.ndimage import gaussian_filter
from scipy.signal import fftconvolve
from scipy.special import log_ndtr

from tunneldb.arrays import Float
from tunneldb.registration.underwater.first_pose import LevelScan
from tunneldb.robust import MAD_TO_SIGMA

PIXEL = 0.1  # m
REACH = 10.0  # m along, from the scanner
MARGIN = 0.3  # m from the walls
MAX_RELIEF_WIDTH = 2.5  # m: wider relief carries no information about the place
MAX_HEIGHT_STEP = 0.6  # m: greater differences from the bed's height are objects and false echoes
MAX_RELIEF_SIGMA = 4.0  # standard deviations to which relief counts: a few false echoes would outweigh the bed
MIN_CELLS = 500  # that both scans must see
MAX_SAME_BED_CORRELATION = 0.9  # greatest correlation of two scans of one bed, which they see from different sides
MIN_BED_SHARE = 0.02  # least share of the variance that counts as bed
MAX_CORRELATION_LENGTH = 30  # pixels within which relief may be correlated
MIN_INDEPENDENT_PLACES = 3.0  # number of independent places up to which a correlation is meaningless
MAX_CORRELATION = 0.99  # greatest correlation, to limit the evidence
NO_EVIDENCE = -1e3  # log likelihood where nothing is shared


@dataclass(frozen=True)
class Relief:
    """Bed around a scanner.

    Attributes
    ----------
    height : (2 n, m) float64 array
        Height of the bed in pixels along (x from -REACH on) and across (symmetric about the canal's centre), m, level frame.
    fine : (2 n, m) float64 array
        Height without wide relief and without the part that is constant along the canal; 0 where not measured.
    seen : (2 n, m) float64 array
        1 where the bed was measured.
    likeness : (c, d) float64 array
        Correlation of ``fine`` with itself at shifts of up to MAX_CORRELATION_LENGTH pixels in either direction.
    """

    height: Float
    fine: Float
    seen: Float
    likeness: Float

    def turned(self) -> Relief:
        """Return the relief after half a turn of the scanner."""
        return Relief(self.height[::-1, ::-1], self.fine[::-1, ::-1], self.seen[::-1, ::-1], self.likeness)


def relief_of(scan: LevelScan) -> Relief | None:
    """Return the relief of a level scan; None if there is too little."""
    low, high = scan.walls
    width = high - low
    across = scan.points[:, 1] - 0.5 * (low + high)
    near = (np.abs(scan.points[:, 0]) < REACH) & (np.abs(across) < 0.5 * width - MARGIN)
    if near.sum() < MIN_CELLS:
        return None
    half = int(np.ceil(0.5 * width / PIXEL))
    shape = (round(2.0 * REACH / PIXEL), 2 * half)
    place = np.column_stack([scan.points[near, 0] + REACH, across[near] + half * PIXEL])
    cell = np.floor(place / PIXEL).astype(np.int64)
    key = cell[:, 0] * shape[1] + cell[:, 1]
    height = scan.points[near, 2]
    on_bed = np.abs(height - float(np.percentile(height, 20))) < MAX_HEIGHT_STEP
    key, height = key[on_bed], height[on_bed]
    order = np.lexsort([height, key])
    places, begin, count = np.unique(key[order], return_index=True, return_counts=True)
    grid, seen = np.zeros(shape), np.zeros(shape)
    grid.ravel()[places] = height[order][begin + count // 2]
    seen.ravel()[places] = 1.0
    if seen.sum() < MIN_CELLS:
        return None
    wide = _smooth(grid * seen) / np.maximum(_smooth(seen), 1e-6)
    fine = (grid - wide) * seen
    known = np.where(seen > 0.0, fine, np.nan)
    usual = np.zeros(shape[1])  # for example silt rising to the foot of the walls
    there = seen.any(axis=0)
    usual[there] = np.nanmedian(known[:, there], axis=0)
    fine = (fine - usual) * seen
    bound = MAX_RELIEF_SIGMA * MAD_TO_SIGMA * float(np.median(np.abs(fine[seen > 0.0])))
    fine = np.clip(fine, -bound, bound)
    return Relief(grid, fine, seen, _autocorrelation(fine, seen))


def _smooth(grid: Float) -> Float:
    return np.asarray(gaussian_filter(grid, MAX_RELIEF_WIDTH / PIXEL))


def _autocorrelation(fine: Float, seen: Float) -> Float:
    product = fftconvolve(fine, fine[::-1, ::-1])
    shared = fftconvolve(seen, seen[::-1, ::-1])
    variance = float((fine**2).sum() / seen.sum())
    alike = np.where(shared > MIN_CELLS, product / np.maximum(shared, 1.0) / variance, 0.0)
    middle = np.array(fine.shape) - 1
    reach = np.minimum(MAX_CORRELATION_LENGTH, middle)
    return np.asarray(alike[middle[0] - reach[0] : middle[0] + reach[0] + 1, middle[1] - reach[1] : middle[1] + reach[1] + 1])


def likelihood(one: Relief, other: Relief) -> Float:
    """Return the evidence that two scans show the same bed, at each shift of ``other`` relative to ``one`` along the canal.

    Returns
    -------
    (4 n - 1,) float64 array
        Log likelihood ratio of the same bed to different beds, at shifts from -(2 n - 1) pixels on: x in ``one`` is x in
        ``other`` plus the shift. NO_EVIDENCE where they share too little.
    """
    columns = min(one.fine.shape[1], other.fine.shape[1])
    a, b = _middle(one, columns), _middle(other, columns)
    shared = _over(a.seen, b.seen)
    product = _over(a.fine, b.fine)
    squares = _over(a.fine**2, b.seen) * _over(a.seen, b.fine**2)
    correlation = np.clip(product / np.sqrt(np.maximum(squares, 1e-12)), -MAX_CORRELATION, MAX_CORRELATION)
    patch = max(float((_middle_of(one.likeness, other.likeness)).sum()), 1.0)  # pixels per independent place
    weight = np.sqrt(np.maximum(shared / patch - MIN_INDEPENDENT_PLACES, 0.0))
    valid = (shared > MIN_CELLS) & (weight > 0.0)
    greatest = MAX_SAME_BED_CORRELATION * np.sqrt(_bed_share(one) * _bed_share(other))
    score = np.arctanh(correlation) * weight
    return np.where(valid, _log_ratio(score, np.where(valid, weight, 1.0), greatest), NO_EVIDENCE)


def _bed_share(relief: Relief) -> float:
    """Return the share of the relief's variance that is bed: what a cell has in common with those beside it, not noise."""
    x, y = np.array(relief.likeness.shape) // 2
    beside = relief.likeness[[x - 1, x + 1, x, x], [y, y, y - 1, y + 1]]
    return max(float(beside.mean()), MIN_BED_SHARE)


def _log_ratio(score: Float, weight: Float, greatest: float) -> Float:
    """Return the log likelihood ratio of scores (n,), with standard deviation 1, for one bed and for two.

    The similarity of two scans of one bed is not known in advance: all correlations up to ``greatest`` are equally likely, in
    Fisher's z.
    """
    upper = np.arctanh(greatest) * weight
    high, low = log_ndtr(score), log_ndtr(score - upper)
    mean = high + np.log1p(-np.exp(np.minimum(low - high, -1e-12))) - np.log(upper)
    return np.asarray(mean + 0.5 * score**2 + 0.5 * np.log(2.0 * np.pi))


def _middle(relief: Relief, columns: int) -> Relief:
    """Return its middle columns: widths of scans may differ by a pixel or two."""
    first = (relief.fine.shape[1] - columns) // 2
    part = slice(first, first + columns)
    return Relief(relief.height[:, part], relief.fine[:, part], relief.seen[:, part], relief.likeness)


def _middle_of(one: Float, other: Float) -> Float:
    """Return the product of two autocorrelations where both are known."""
    rows, columns = np.minimum(one.shape, other.shape)

    def part(of: Float) -> Float:
        first = (np.array(of.shape) - (rows, columns)) // 2
        return of[first[0] : first[0] + rows, first[1] : first[1] + columns]

    return np.asarray(part(one) * part(other))


def _over(one: Float, other: Float) -> Float:
    """Return sums of products of two images at all shifts along the canal; the walls already determine those across."""
    size = next_fast_len(one.shape[0] + other.shape[0] - 1, real=True)
    spectrum = (rfft(one, size, axis=0) * rfft(other[::-1], size, axis=0)).sum(axis=1)
    return np.asarray(irfft(spectrum, size)[: one.shape[0] + other.shape[0] - 1])


def height_difference(one: Relief, other: Relief, shift: int) -> float:
    """Return the median height of ``one`` over ``other`` where both show the bed at a shift, pixels."""
    columns = min(one.fine.shape[1], other.fine.shape[1])
    a, b = _middle(one, columns), _middle(other, columns)
    size = len(a.seen)
    mine = slice(max(shift, 0), min(size + shift, size))
    theirs = slice(max(-shift, 0), min(size - shift, size))
    both = (a.seen[mine] > 0.0) & (b.seen[theirs] > 0.0)
    return float(np.median((a.height[mine] - b.height[theirs])[both]))
