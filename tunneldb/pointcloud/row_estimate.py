"""Estimate of the points that loading keeps of scan files, from a sample of their points.

Loading keeps one point of each voxel. Surfaces of area A have about ``density · A`` voxels: of N points on them, which are
spread evenly, ``density · A · (1 − exp(−N / (density · A)))`` get a row. A scan of profiles leaves voxels between them empty
however many points a profile has; this is measured in the sample, where it is dense enough.

The area is that of a prism about the axis: its cross-section has the median position of the sampled points in each sector.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Bool, Float, Int64, UInt64
from tunneldb.geometry.alignment import Alignment
from tunneldb.pointcloud.noise import noise_filter
from tunneldb.pointcloud.selection import FilterSettings
from tunneldb.pointcloud.thinning import voxel_edge

SECTORS = 36
"""Number of sectors of a cross-section."""

MIN_BIN = 10.0
"""Least length of a stretch whose points and area are estimated together, m."""

RUNS_PER_BIN = 4
"""Average number of sampled runs in a stretch."""

SATURATED = 5.0
"""Points for each voxel from which more points occupy no more voxels."""

MIN_FILLED = 0.3
"""Occupied voxels of a dense place, as a share of the density, at least for its number of points."""

MIN_AROUND = 0.5
"""Share of the sectors in which the metres of a run have points, from which its scanner measures profiles."""

FILLED_QUANTILE = 0.6
"""Quantile of the occupied voxels of sampled places: some of them are covered in part only."""

SPREAD = (0.75, 1.35)
"""Factors from the estimated number of voxels to its low and high limit: objects, ballast and obstructed lining."""

SAMPLING = 1.1
"""Factor for the limits at least, because a sample stands for the file."""

NOISE_RUNS = 8
"""Number of runs of a sample on which the noise filter is tried."""


@dataclass(frozen=True)
class FileSample:
    """Sample of a file, or of several alike.

    Attributes
    ----------
    points : int
        Number of points that it stands for.
    runs : sequence of (n, 3) float64 arrays
        Runs of consecutive points, m.
    """

    points: int
    runs: Sequence[Float]


@dataclass(frozen=True)
class RowEstimate:
    """Estimated result of loading.

    Attributes
    ----------
    low, likely, high : float
        Number of rows.
    near : float
        Number of points within the greatest distance from the axis.
    area : float
        Area of the surfaces, m².
    """

    low: float
    likely: float
    high: float
    near: float
    area: float


def estimate_rows(samples: Sequence[FileSample], alignment: Alignment, settings: FilterSettings) -> RowEstimate:
    """Estimate the rows of files that are loaded together.

    Parameters
    ----------
    samples : sequence of FileSample
    alignment : Alignment
        Given axis.
    settings : FilterSettings
        Parameters of loading.
    """
    runs, weights = [], []
    for sample in samples:
        read = sum(map(len, sample.runs))
        runs += [run for run in sample.runs if len(run)]
        weights += [sample.points / read] * sum(1 for run in sample.runs if len(run))
    if not runs:
        return RowEstimate(0.0, 0.0, 0.0, 0.0, 0.0)
    number = np.repeat(np.arange(len(runs)), list(map(len, runs)))
    xyz, weight = np.concatenate(runs), np.asarray(weights)[number]
    placed = alignment.across(xyz)
    near = np.hypot(placed[:, 1], placed[:, 2]) <= settings.max_distance  # False beyond the ends
    if not near.any():
        return RowEstimate(0.0, 0.0, 0.0, 0.0, 0.0)
    placed, xyz, weight, number = placed[near], xyz[near], weight[near], number[near]
    total = float(weight.sum())
    noise = _noise_share(xyz, number, settings)
    bins = _Bins(placed, len(np.unique(number)))
    area = float(bins.area.sum())
    if settings.edge is None or settings.density is None:
        return RowEstimate(total * (1.0 - noise) / SAMPLING, total * (1.0 - 0.5 * noise), total, total, area)
    filled = _filled_share(placed, xyz, number, bins, settings.density)
    points: Float = np.bincount(bins.cell, weight, len(bins.area)).astype(np.float64)
    low, likely, high = (
        float(_occupied(points, settings.density * filled * factor * bins.area).sum()) for factor in (SPREAD[0], 1.0, SPREAD[1])
    )
    likely *= 1.0 - 0.5 * noise
    low, high = min(low * (1.0 - noise), likely / SAMPLING), min(max(high, likely * SAMPLING), total)
    return RowEstimate(low, likely, high, total, area)


def _occupied(points: Float, voxels: Float) -> Float:
    """Return the expected number of occupied voxels for points that are spread evenly."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(voxels > 0.0, -voxels * np.expm1(-points / voxels), 0.0)


class _Bins:
    """Stretches of tunnel by sectors, with the area of the surface in each.

    Parameters
    ----------
    placed : (n, 3) float64 array
        Chainage, right and up of the points, m.
    runs : int
        Number of runs.

    Attributes
    ----------
    cell : (n,) int64 array
        Stretch and sector of each point.
    area : (cells,) float64 array
        Area of the surface, m².
    width : (cells,) float64 array
        Length of the surface across the tunnel, m.
    """

    def __init__(self, placed: Float, runs: int) -> None:
        chainage = placed[:, 0]
        first, last = float(chainage.min()), float(chainage.max())
        step = max(MIN_BIN, RUNS_PER_BIN * (last - first) / runs)
        row = np.floor((chainage - first) / step).astype(np.int64)
        rows = int(row.max()) + 1
        self.cell = np.empty(len(placed), np.int64)
        width = np.zeros((rows, SECTORS))
        length = np.zeros(rows)
        order = np.argsort(row, kind="stable")
        for part in np.split(order, np.flatnonzero(np.diff(row[order])) + 1):
            stretch = int(row[part[0]])
            sector, width[stretch] = _outline(placed[part, 1:])
            self.cell[part] = SECTORS * stretch + sector
            length[stretch] = min(step, last - first - stretch * step)
        self.area = (width * length[:, None]).ravel()
        self.width = width.ravel()


def _outline(across: Float) -> tuple[Int64, Float]:
    """Return the sector of points of a cross-section (n, 2), and the length of the outline in each sector, m."""
    middle = across - np.quantile(across, (0.05, 0.95), axis=0).mean(axis=0)
    sector = np.floor((np.arctan2(middle[:, 1], middle[:, 0]) / (2.0 * np.pi) + 0.5) * SECTORS).astype(np.int64) % SECTORS
    vertices = np.full((SECTORS, 2), np.nan)
    for one in np.unique(sector).tolist():
        vertices[one] = np.median(middle[sector == one], axis=0)
    ahead = np.linalg.norm(np.roll(vertices, -1, axis=0) - vertices, axis=1)
    arc = np.linalg.norm(vertices, axis=1) * 2.0 * np.pi / SECTORS
    ahead = np.where(np.isfinite(ahead), ahead, arc)  # at the edge of a gap
    width = 0.5 * (ahead + np.where(np.isfinite(np.roll(ahead, 1)), np.roll(ahead, 1), arc))
    return sector, np.nan_to_num(width)


def _filled_share(placed: Float, xyz: Float, number: Int64, bins: _Bins, density: float) -> float:
    """Return the voxels for each m² that a dense scan occupies, as a share of the density; 1 if the sample is not dense.

    Places are metres of tunnel in a sector, or less where a run is shorter, that a run covers with many points for each voxel.
    A static scanner turns: its runs cover no cross-section, so places are covered in part; but it leaves no gaps either.
    """
    edge = voxel_edge(density)
    along = placed[:, 0] - _least(placed[:, 0], number)[number]  # from the beginning of its run
    _, place, counts = np.unique(
        _keys(np.column_stack([number, along.astype(np.int64), bins.cell])), return_inverse=True, return_counts=True
    )
    voxel = np.floor(xyz / edge).astype(np.int64)
    first = np.unique(_keys(np.column_stack([number, voxel])), return_index=True)[1]  # one across places counts once
    occupied = np.bincount(place[first], minlength=len(counts))
    left = -_least(-along, number)[number] - np.floor(along) + edge  # to the end of its run
    area = np.zeros(len(counts))
    area[place] = bins.width[bins.cell] * np.minimum(left, 1.0)
    dense: Bool = (counts >= SATURATED * np.maximum(occupied, MIN_FILLED * density * area)) & (area > 0.0)
    metres = len(np.unique(_keys(np.column_stack([number, along.astype(np.int64)]))))
    if np.count_nonzero(dense) < SECTORS or len(counts) < MIN_AROUND * SECTORS * metres:
        return 1.0
    return float(np.quantile(occupied[dense] / (density * area[dense]), FILLED_QUANTILE))


def _least(values: Float, group: Int64) -> Float:
    """Return the least value of each group, numbered from 0."""
    least = np.full(int(group.max()) + 1, np.inf)
    np.minimum.at(least, group, values)
    return least


def _keys(columns: Int64) -> UInt64:
    """Return a number (n,) for each row (n, k), equal for equal rows; others are equal with a probability of n²/2⁶⁵."""
    factors = np.random.default_rng(1).integers(1, 1 << 63, columns.shape[1], np.uint64) | np.uint64(1)
    keys = (columns.astype(np.uint64) * factors).sum(axis=1, dtype=np.uint64)
    return np.asarray(keys ^ (keys >> np.uint64(31)))


def _noise_share(xyz: Float, number: Int64, settings: FilterSettings) -> float:
    """Return the share of noise in some runs; rather too great, because points of other runs lie beside them."""
    if settings.noise_points <= 1:
        return 0.0
    chosen = np.unique(number)
    chosen = chosen[np.unique(np.linspace(0, len(chosen) - 1, NOISE_RUNS).astype(int))]
    found = [noise_filter(xyz[number == run], settings.noise_points, settings.noise_diameter) for run in chosen.tolist()]
    return float(np.concatenate(found).mean())
