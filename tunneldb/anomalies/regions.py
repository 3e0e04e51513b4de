"""Connected dark regions: extracted from the image of a kilometre, with their drips, and merged across its ends."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from shapely.geometry import Polygon

from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.anomalies.drips import attach_drips
from tunneldb.anomalies.region_edges import Edges, Sides
from tunneldb.anomalies.runs import Components, connected, pixels_of, row_runs
from tunneldb.arrays import Bool, Float, Int64, Intp
from tunneldb.raster.geotiff import NODATA, STEP
from tunneldb.raster.polygons import outline
from tunneldb.raster.state import PixelState
from tunneldb.segmentation.network import CERTAIN

MIN_JOINT_LENGTH = 0.5
"""Minimum length of small regions that are kept, m: joints."""

PIXELS_AT_A_TIME = 1_000_000
"""Approximate number of pixels summed at a time."""


class RegionProperties(NamedTuple):
    """Sums over the pixels of a region, and over its sides that face pixels that are not dark.

    Attributes
    ----------
    sigma : float
        Local standard deviation of the background, dB, summed over the pixels with points.
    recess : float
        Number of pixels on recessed lining.
    perimeter, perimeter_off, perimeter_recess : float
        Number of sides; of these towards a fixture or the floor; and towards recessed lining.
    steps : float
        Number of sides with a known darkening on both sides, :data:`tunneldb.anomalies.region_edges.STEP_DISTANCE` from them.
    inside, outside : float
        Sum of the darkening there, dB.
    sharp, straight : float
        Number of sides across which half of the region's darkening is lost, and of those on straight lines
        (:meth:`tunneldb.anomalies.region_edges.Edges.straight`).
    between : float
        Number of pixels between profiles, which take the value of the nearest profile.
    darkening_square : float
        Sum of the squared darkening, dB², over the pixels with points.
    far_steps, far_outside : float
        Number of ``steps`` with a known darkening also :data:`tunneldb.anomalies.region_edges.FAR_STEP_DISTANCE` outside; sum
        of the darkening there, dB.
    bright : float
        Number of ``steps`` with lining outside that is brighter than dry lining is by chance.
    off_above, floor : float
        Number of sides towards a fixture in the direction of the crown, and towards the floor.
    judged, water, certain : float
        Number of pixels that a segmentation network judged, sum of their probabilities of water, and number of those of 0.9
        and more.
    """

    sigma: float = 0.0
    recess: float = 0.0
    perimeter: float = 0.0
    perimeter_off: float = 0.0
    perimeter_recess: float = 0.0
    steps: float = 0.0
    inside: float = 0.0
    outside: float = 0.0
    sharp: float = 0.0
    straight: float = 0.0
    between: float = 0.0
    darkening_square: float = 0.0
    far_steps: float = 0.0
    far_outside: float = 0.0
    bright: float = 0.0
    off_above: float = 0.0
    floor: float = 0.0
    judged: float = 0.0
    water: float = 0.0
    certain: float = 0.0


@dataclass(frozen=True)
class Region:
    """Dark pixels connected by their sides, with sums.

    Attributes
    ----------
    pixel : float
        Side of a pixel, m.
    column, row : int
        Chainage and arc of the lowest corner of the mask, pixels.
    mask : (rows, columns) bool array
        Its pixels, the first row at the lowest arc.
    filled : int
        Number of pixels with points, or with the value of the nearest profile.
    darkening_sum, darkening_max : float
        Sum and maximum over those of the darkening relative to the background, dB.
    properties : RegionProperties
        Further sums.
    """

    pixel: float
    column: int
    row: int
    mask: Bool
    filled: int
    darkening_sum: float
    darkening_max: float
    properties: RegionProperties

    @property
    def stop(self) -> int:
        """Column behind the last one, counted from chainage 0."""
        return self.column + self.mask.shape[1]

    @property
    def place(self) -> tuple[int, int, int]:
        """Column and row of the lowest corner, and the first pixel of the lowest row: unique for each region."""
        return self.column, self.row, self.column + int(self.mask[0].argmax())

    @property
    def area(self) -> float:
        """Area in the unrolled plane, m²."""
        return float(np.count_nonzero(self.mask)) * self.pixel**2

    @property
    def measured(self) -> float:
        """Number of its pixels with points."""
        return self.filled - self.properties.between

    @property
    def spacing(self) -> float:
        """Distance along the tunnel of the profiles that show it, m: its ends are uncertain by up to half of that.

        0 if profiles are as close as pixels.
        """
        return self.pixel * self.filled / max(self.measured, 1.0) if self.properties.between else 0.0

    @property
    def darkening_mean(self) -> float:
        """Mean darkening over the pixels with points, dB."""
        return self.darkening_sum / self.filled

    @property
    def contrast(self) -> float:
        """Mean darkening in standard deviations of the surrounding background."""
        return self.darkening_sum / self.properties.sigma if self.properties.sigma > 0 else 0.0

    @property
    def outline(self) -> Polygon:
        """Polygon of (chainage, arc), m."""
        return outline(self.mask, self.column, self.row, self.pixel)


def find_regions(
    part: Bool, dark: Bool, contrast: ContrastImage, min_area: float, may_drip: Callable[[Region], bool] | None
) -> list[Region]:
    """Find connected dark regions of a kilometre that are large or long enough, or that its ends cut.

    Drips below a region are a part of it.

    Parameters
    ----------
    part : (rows, columns) bool array
        Dark pixels that may belong to a region; those beyond the ends of the kilometre are ignored.
    dark : (rows, columns) bool array
        All dark pixels; regions do not end at these.
    contrast : ContrastImage
        Their darkening.
    min_area : float
        Minimum area of regions within the kilometre, m².
    may_drip : callable or None
        Returns True if a region may have drips; None if nothing drips.
    """
    grid = contrast.grid
    inner = grid.inner
    runs = row_runs(part, inner.start, inner.stop)
    if not len(runs):
        return []
    components = Components.of(runs)
    ends = components.touching(inner.start, inner.stop)
    large = components.pixels * grid.pixel**2 >= min_area * (1 - 1e-12)
    wanted = ends | large | (components.extent * grid.pixel >= MIN_JOINT_LENGTH)
    if may_drip is None:
        found = _regions(runs, components.label, np.flatnonzero(wanted), dark, contrast)
        return sorted(found, key=lambda region: region.place)
    whole, bridges = attach_drips(components, wanted, ends, grid, contrast.spacing)
    roots = np.unique(whole[whole != np.arange(len(whole))])
    for root, region in zip(roots.tolist(), _regions(runs, components.label, roots, dark, contrast), strict=True):
        if not may_drip(region):
            whole[whole == root] = np.flatnonzero(whole == root)
            bridges = bridges[bridges[:, 3] != root]
    label = np.concatenate([whole[components.label], bridges[:, 3]])
    found = _regions(np.concatenate([runs, bridges[:, :3]]), label, np.unique(whole[wanted]), dark, contrast)
    return sorted(found, key=lambda region: region.place)


def _regions(runs: Int64, label: Intp, chosen: Intp, dark: Bool, contrast: ContrastImage) -> list[Region]:
    """Extract the regions whose runs have the chosen labels, which are in order, and sum their pixels."""
    if not len(chosen):
        return []
    grid = contrast.grid
    number = np.searchsorted(chosen, label)
    selected = chosen[np.minimum(number, len(chosen) - 1)] == label
    order = np.flatnonzero(selected)[np.argsort(number[selected], kind="stable")]
    runs, number = runs[order], number[order]
    starts = np.searchsorted(number, np.arange(len(chosen)))
    low, high = np.minimum.reduceat(runs, starts), np.maximum.reduceat(runs, starts)
    sums = _sums(runs, number, len(chosen), dark, contrast)
    regions = []
    for k, of in enumerate(np.split(runs, starts[1:])):
        mask = np.zeros((high[k, 0] + 1 - low[k, 0], high[k, 2] - low[k, 1]), np.bool_)
        row, column = pixels_of(of)
        mask[high[k, 0] - row, column - low[k, 1]] = True
        filled, darkening_sum, darkening_max, *properties = sums[k].tolist()
        corner = grid.first_column + int(low[k, 1]), grid.bottom + grid.rows - 1 - int(high[k, 0])
        regions.append(
            Region(grid.pixel, *corner, mask, int(filled), darkening_sum, darkening_max, RegionProperties(*properties))
        )
    return regions


def _sums(runs: Int64, number: Intp, count: int, dark: Bool, contrast: ContrastImage) -> Float:
    """Return pixels with points, sum and maximum of the darkening over these, dB, and the properties of each region.

    Runs are (row, first column, column behind the last one), in order of the numbers of their regions.
    """
    edges, found = Edges(dark, contrast), []
    pixels, recess, steps, squares, sigma, between, judged, water, certain = (np.zeros(count) for _ in range(9))
    highest = np.full(count, NODATA, np.int16)
    until = np.cumsum(runs[:, 2] - runs[:, 1])
    for part in np.split(
        np.arange(len(runs)), np.searchsorted(until, np.arange(PIXELS_AT_A_TIME, until[-1], PIXELS_AT_A_TIME))
    ):
        row, column = pixels_of(runs[part])
        label = np.repeat(number[part], (runs[:, 2] - runs[:, 1])[part])
        is_dark = dark[row, column]  # all except those between a drip and the component above it
        row, column, label = row[is_dark], column[is_dark], label[is_dark]
        found.append(edges.sides(label, row, column))
        recess += np.bincount(label[contrast.state[row, column] == PixelState.RECESS], minlength=count)
        if contrast.water is not None:
            chance = contrast.water[row, column]
            judged += np.bincount(label, minlength=count)
            water += np.bincount(label, chance / CERTAIN, count)
            certain += np.bincount(label[chance >= 0.9 * CERTAIN], minlength=count)
        drop = contrast.drop[row, column]
        selected = drop != NODATA
        row, column, label, drop = row[selected], column[selected], label[selected], drop[selected]
        if contrast.between is not None:
            between += np.bincount(label[contrast.between[row, column]], minlength=count)
        pixels += np.bincount(label, minlength=count)
        steps += np.bincount(label, drop, count)
        squares += np.bincount(label, drop.astype(np.float64) ** 2, count)
        np.maximum.at(highest, label, drop)
        sigma += np.bincount(label, contrast.sigma[row // contrast.tile, column // contrast.tile], count)
    sides = Sides(*map(np.concatenate, zip(*found, strict=True)))
    darkening_sum = steps * STEP["corrected"]
    straight = edges.straight(sides, darkening_sum / np.maximum(pixels, 1))
    darkening_max = np.where(pixels > 0, highest * STEP["corrected"], -np.inf)
    perimeter, about = edges.perimeter(sides, count), edges.steps(sides, count)
    squares *= STEP["corrected"] ** 2
    return np.column_stack(
        [pixels, darkening_sum, darkening_max, sigma, recess, perimeter[:, :3], about[:, :3], straight, between, squares,
         about[:, 3:], perimeter[:, 3:], judged, water, certain]
    )  # fmt: skip


def merge_regions(parts: Sequence[Region]) -> Region:
    """Merge regions that touch each other."""
    if len(parts) == 1:
        return parts[0]
    column, row = min(part.column for part in parts), min(part.row for part in parts)
    mask = np.zeros((max(p.row + p.mask.shape[0] for p in parts) - row, max(p.stop for p in parts) - column), np.bool_)
    for part in parts:
        mask[part.row - row :, part.column - column :][: part.mask.shape[0], : part.mask.shape[1]] |= part.mask
    return Region(
        parts[0].pixel,
        column,
        row,
        mask,
        sum(part.filled for part in parts),
        float(sum(part.darkening_sum for part in parts)),
        max(part.darkening_max for part in parts),
        RegionProperties(*(float(sum(sums)) for sums in zip(*(part.properties for part in parts), strict=True))),
    )


def touching_groups(parts: Sequence[Region]) -> list[list[int]]:
    """Group parts that touch at their first and last columns: their numbers, in order of chainage."""
    pairs = [
        (a, b)
        for a, before in enumerate(parts)
        for b, after in enumerate(parts)
        if before.stop == after.column and _touch(before, after)
    ]
    count, label = connected(len(parts), *np.array(pairs, dtype=np.int64).reshape(-1, 2).T)
    # In order of place, whatever the order of the kilometres.
    places = sorted(range(len(parts)), key=lambda k: parts[k].place)
    groups: list[list[int]] = [[] for _ in range(count)]
    for k in places:
        groups[label[k]].append(k)
    return sorted(groups, key=lambda group: places.index(group[0]))


def _touch(before: Region, after: Region) -> bool:
    """Return True if a pixel of the last column is beside one of the other region's first column."""
    if before.pixel != after.pixel:
        return False
    low, high = max(before.row, after.row), min(before.row + len(before.mask), after.row + len(after.mask))
    return low < high and bool(
        (before.mask[low - before.row : high - before.row, -1] & after.mask[low - after.row : high - after.row, 0]).any()
    )
