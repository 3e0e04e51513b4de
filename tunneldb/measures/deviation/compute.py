"""Overbreak and underbreak by step of chainage, from the deviation of pixels, in cells along the profile."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.geometry.alignment import Alignment
from tunneldb.geometry.surface import Surface
from tunneldb.raster.geotiff import Raster
from tunneldb.shape.outline import Outline
from tunneldb.shape.profile import Deviation, Stretch, deviation, strip_area

CELL = 0.1
"""Length of a cell along the profile, m, if pixels are a third of it or less."""

MIN_PIXELS = 3
"""Minimum number of pixels in a cell; with fewer the cell counts as unseen."""

_MIN_SEEN_FOR_SHIFT = 0.4
"""Minimum seen share of a profile for the shift of the whole lining to be computed."""

STEP = 1.0
"""Length of a step of chainage, m; steps begin at whole metres."""

STATIONS = 1.0
"""Distance of stations of the given axis, m: between them its curve is followed to 0.01 mm."""

_ARM = 5.0  # m from the axis, where planes of the measured axis are compared with those of the given axis


@dataclass(frozen=True)
class SectionDeviation:
    """Deviation of a step of chainage from its design.

    Attributes
    ----------
    design_length, seen_length : float
        Length of the profile, and of its seen part, m.
    overbreak, underbreak : float
        Area of the seen lining outside and inside the profile, m².
    noise_area : float
        Standard deviation of underbreak minus overbreak from the scatter of pixels, m².
    over_by, under_by : (2,) float arrays
        Increase of overbreak and underbreak if the axis moves to the right, and up, m²/m.
    sigma : float
        Scatter of pixels within cells, m; NaN if nothing is seen.
    shift : (2,) float array
        Shift of the whole lining to the right of the profile and above it, m; NaN if too little is seen.
    deviation : (n,) float array
        Mean of each cell, at its middle, m, positive inside; NaN where unseen.
    """

    design_length: float
    seen_length: float
    overbreak: float
    underbreak: float
    noise_area: float
    over_by: Float
    under_by: Float
    sigma: float
    shift: Float
    deviation: Float

    @property
    def mean(self) -> float:
        """Mean of the cells, m; NaN if nothing is seen."""
        seen = self.deviation[np.isfinite(self.deviation)]
        return float(seen.mean()) if len(seen) else np.nan

    def extreme(self, sign: float) -> tuple[float, float]:
        """Return the greatest (1) or least (-1) mean of a cell, m, and the place of its middle along the profile, m, or NaN."""
        seen = np.flatnonzero(np.isfinite(self.deviation))
        if not len(seen):
            return np.nan, np.nan
        k = int(seen[np.argmax(sign * self.deviation[seen])])
        return float(self.deviation[k]), (k + 0.5) * self.design_length / len(self.deviation)


def cell_length(pixel: float) -> float:
    """Return the length of a cell, m, for pixels of a side, m: at least three pixels."""
    return max(CELL, 3.0 * pixel)


def section_deviation(found: Deviation, outline: Outline, pixel: float) -> SectionDeviation:
    """Summarise the pixels of a step of chainage.

    Parameters
    ----------
    found : Deviation
        Deviation of pixels of the lining; NaN for others.
    outline : Outline
        Design in the middle of the step.
    pixel : float
        Side of a pixel, m.

    Notes
    -----
    The area of a cell is the mean, over its pixels, of d (1 - κ d / 2), times its length. A cell with fewer than MIN_PIXELS
    pixels is unseen. Next to an unseen cell, a cell ends with its last pixel. Areas outside and inside are summed separately,
    so that they do not cancel within a cell. Stored means refer to the middle of cells, because pixels are not spread evenly in
    each, which matters on a slope.
    """
    length = outline.length
    count = max(int(np.ceil(length / cell_length(pixel) - 1e-9)), 1)
    each = length / count
    valid = np.isfinite(found.distance)
    distance = found.distance[valid]
    place = found.share[valid] * count
    cell = np.minimum(place.astype(np.int64), count - 1)
    area = strip_area(distance, found.curvature[valid])

    def summed(weights: Float | None = None) -> Float:
        return np.bincount(cell, weights, count).astype(np.float64)

    pixels, total = summed(), summed(distance)
    seen = pixels >= MIN_PIXELS
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.where(seen, total / pixels, np.nan)
        over, under = (np.where(seen, summed(part) / pixels, 0.0) for part in (-np.minimum(area, 0.0), np.maximum(area, 0.0)))
        outside = np.where(seen, summed((distance < 0.0).astype(np.float64)) / pixels, 0.0)
        square = summed((distance - np.nan_to_num(mean)[cell]) ** 2)
        centred = mean - _slope(mean, outline.closed) * (summed(place - cell) / pixels - 0.5)
        sigma = float(np.sqrt(square[seen].sum() / (pixels[seen] - 1.0).sum())) if seen.any() else np.nan
    long = each * _seen_parts(place - cell, cell, seen, pixel / each / 2.0, outline.closed)
    _, inward = outline.places((np.arange(count) + 0.5) / count)
    return SectionDeviation(
        design_length=length,
        seen_length=float(long.sum()),
        overbreak=float(long @ over),
        underbreak=float(long @ under),
        noise_area=float(sigma * np.sqrt((long[seen] ** 2 / pixels[seen]).sum())) if seen.any() else 0.0,
        over_by=(long * outside) @ inward,
        under_by=-(long * (seen - outside)) @ inward,
        sigma=sigma,
        shift=_shift(centred, inward),
        deviation=centred,
    )


def _seen_parts(within: Float, cell: Int64, seen: Bool, half: float, closed: bool) -> Float:
    """Return the seen part of each cell (n,), 0 to 1: all of it between seen neighbours, else up to its last pixel.

    Parameters
    ----------
    within, cell : (p,) arrays
        Place of each pixel within its cell, 0 to 1, and the cell's number.
    seen : (n,) bool array
    half : float
        Half a pixel, in cells.
    closed : bool
        True if the first cell follows the last.
    """
    low, high = np.ones(len(seen)), np.zeros(len(seen))
    np.minimum.at(low, cell, within)
    np.maximum.at(high, cell, within)
    before, after = np.roll(seen, 1), np.roll(seen, -1)
    if not closed:
        before[0] = after[-1] = False
    begin = np.where(before, 0.0, np.maximum(low - half, 0.0))
    end = np.where(after, 1.0, np.minimum(high + half, 1.0))
    return np.where(seen, end - begin, 0.0)


def _slope(mean: Float, closed: bool) -> Float:
    """Return the slope of the mean from cell to cell, (n,): the smaller of both sides, 0 where they differ in sign.

    So a step, or a neighbour not inspected, makes no slope.
    """
    rise = np.diff(mean, prepend=mean[-1] if closed else np.nan)
    after = np.roll(rise, -1)
    return np.asarray(np.where(rise * after > 0.0, np.sign(rise) * np.minimum(np.abs(rise), np.abs(after)), 0.0))


def _shift(mean: Float, inward: Float) -> Float:
    """Return the lining's shift right of the profile and above it, by least squares of its cells, with a free size."""
    seen = np.isfinite(mean)
    if seen.mean() < _MIN_SEEN_FOR_SHIFT:
        return np.full(2, np.nan)
    design = np.column_stack([inward[seen], np.ones(int(seen.sum()))])
    solved, _, rank, _ = np.linalg.lstsq(design, mean[seen], rcond=1e-3)
    return np.asarray(solved[:2]) if rank == 3 else np.full(2, np.nan)


@dataclass(frozen=True)
class Step:
    """Step of chainage with its figures."""

    profile: str
    low: float
    high: float
    figures: SectionDeviation


@dataclass(frozen=True)
class Design:
    """Design of a kilometre: its measured surface, the given axis, and the profiles about that axis."""

    surface: Surface
    axis: Alignment
    stretches: Sequence[Stretch]

    def places(self, chainage: Float, arc: Float, offset: Raster) -> tuple[Float, Float, Float]:
        """Return the chainage along the given axis (c,), and the places of pixels right of it and above it, (c, r), m.

        The planes of the measured axis and of the given one differ by fractions of a degree: of each column the place of three
        points is worked out, and that of all others is linear between them.
        """
        right, up = self.surface.section_points(chainage, arc, offset.values)
        origin, _, to_right, upwards = np.moveaxis(self.surface.frames(chainage), 1, 0)
        valid = np.isfinite(origin[:, 0])
        moved = np.full((3, len(chainage), 3), np.nan)
        for k, points in enumerate((origin, origin + _ARM * to_right, origin + _ARM * upwards)):
            moved[k, valid] = self.axis.across(points[valid])
        base, by_right, by_up = moved[0], (moved[1] - moved[0]) / _ARM, (moved[2] - moved[0]) / _ARM
        placed = [base[:, k, None] + by_right[:, k, None] * right + by_up[:, k, None] * up for k in (1, 2)]
        return base[:, 0], placed[0], placed[1]

    def deviation(self, offset: Raster, lining: Bool) -> tuple[Float, Deviation]:
        """Return the chainage of a block's columns along the given axis, and the deviation of its lining pixels, (c, r)."""
        chainage, arc = offset.places()
        shown = replace(offset, values=np.where(lining, offset.values, np.float32(np.nan)))
        along, right, up = self.places(chainage, arc, shown)
        found = Deviation(*(np.full(right.shape, np.nan) for _ in range(3)))
        for stretch in self.stretches:
            indices = np.flatnonzero((along >= stretch.low) & (along < stretch.high))
            if len(indices):
                part = deviation(stretch, along[indices], right[indices], up[indices])
                found.distance[indices], found.share[indices], found.curvature[indices] = (
                    part.distance,
                    part.share,
                    part.curvature,
                )
        return along, found


def block_steps(
    stretches: Sequence[Stretch], offset: Raster, along: Float, found: Deviation, ends: tuple[float, float]
) -> Iterator[Step]:
    """Compute the steps of a block, cut at the ends of the survey and of profiles."""
    pixel, west = offset.transform.a, offset.transform.c
    chainage, _ = offset.places()
    number = np.floor((chainage - west) / STEP)
    for first, stop in pairwise(np.flatnonzero(np.diff(number, prepend=-1.0, append=-1.0)).tolist()):
        here = slice(first, stop)
        begin = west + STEP * float(number[first])
        for stretch in stretches:
            selected = (along[here] >= stretch.low) & (along[here] < stretch.high)
            selected &= (chainage[here] >= ends[0]) & (chainage[here] <= ends[1])
            if not selected.any():
                continue
            k = first + np.flatnonzero(selected)
            low, high = float(chainage[k[0]] - pixel / 2.0), float(chainage[k[-1]] + pixel / 2.0)
            low, high = max(low, begin), min(high, begin + STEP)
            part = Deviation(found.distance[k], found.share[k], found.curvature[k])
            outline = stretch.at(float(along[k].mean()))
            yield Step(stretch.name, round(low, 6), round(high, 6), section_deviation(part, outline, pixel))
