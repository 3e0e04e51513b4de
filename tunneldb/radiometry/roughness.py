"""Roughness of the lining from small homogeneous regions (Xu et al., 2018, eq. 17–18).

Regions of the same material seen at different incidence angles must have the same corrected intensity: the roughness is the σ
at which they differ least. If all of the lining is seen at nearly the same incidence (a profiler near the middle of a round
tunnel), all σ are equivalent, and none matters; the result says so.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tunneldb.arrays import Float, Int64, Intp
from tunneldb.radiometry.oren_nayar import incidence_db
from tunneldb.radiometry.robust_statistics import robust_statistics

CELL = 0.2
"""Side of an automatic region, m."""

CLASS_WIDTH = 2.5
"""Width of an incidence class, degrees."""

CLASS_CELLS = 40
"""Maximum number of regions of an incidence class."""

MIN_CLASS_CELLS = 10
"""Minimum number of regions of a class."""

MIN_CELL_POINTS = 2
"""Minimum number of points of a cell."""

MAX_INCIDENCE = 75.0
"""Maximum incidence of lining used, degrees: beyond it an error of 1° in the normal is 0.3 dB."""

SIGNIFICANT_CHANGE = 3.0
"""Change of roughness that must exceed NOTICEABLE for the roughness to be determined, degrees."""

NOTICEABLE = 0.1
"""Smallest change of intensity over the incidence angles that is significant, dB."""

TYPICAL_ROUGHNESS = 9.0
"""Roughness of a concrete lining (Xu et al., 2018, fig. 5), degrees: used if the lining's own is not determined."""

MAX_ROUGHNESS = 60.0
"""Maximum roughness of a lining, degrees: a larger result has another cause than incidence, such as soot or damp."""


@dataclass(frozen=True)
class Regions:
    """Homogeneous regions, all (m,): mean cosine of incidence, mean distance-corrected dB, number of points."""

    cosine: Float
    distance_db: Float
    points: Int64

    def __len__(self) -> int:
        """Return the number of regions."""
        return len(self.cosine)


@dataclass(frozen=True)
class Roughness:
    """Roughness and its reliability.

    Attributes
    ----------
    sigma : float
        σ at the objective's minimum, or TYPICAL_ROUGHNESS, degrees.
    determined : bool
        False if the regions' incidence angles are too similar to determine σ; correcting with ``sigma`` is then as good as
        with any other near it.
    assumed : bool
        True if ``sigma`` is TYPICAL_ROUGHNESS, because no roughness explains the regions, or there are none; not determined
        then.
    objective : float
        Value of the objective for it, √dB.
    contrast : float
        Change of the correction at the steepest incidence relative to that at the flattest, for a σ smaller or larger by 3°,
        dB: the objective's flatness.
    regions : int
        Number of regions used.
    incidence_from, incidence_to : float
        Smallest and largest incidence angle of the regions, degrees.
    """

    sigma: float
    determined: bool
    assumed: bool
    objective: float
    contrast: float
    regions: int
    incidence_from: float
    incidence_to: float

    @classmethod
    def unsought(cls) -> Roughness:
        """Make a placeholder for unknown, and so uncorrected, incidence."""
        return cls(0.0, False, False, np.nan, np.nan, 0, np.nan, np.nan)

    @property
    def note(self) -> str | None:
        """Return a remark on it, if there is any."""
        if not self.regions and not self.assumed:
            return None
        if self.assumed:
            return (
                f"roughness could not be estimated (intensity does not follow incidence; soot or another effect may mask it):"
                f" using {self.sigma:g}°, that of concrete"
                if self.regions >= 2
                else f"roughness could not be estimated (too little lining was seen): using {self.sigma:g}°, that of concrete"
            )
        if not self.determined:
            return (
                "roughness could not be estimated (incidence angles of the lining are too similar);"
                " its value hardly changes the corrected intensity"
            )
        return None


def objective(regions: Regions, roughness: float) -> float:
    """Return the objective O(σ) of eq. 17: root of the mean absolute difference between regions corrected with σ, √dB.

    Computed from the sorted values, so that M regions cost M lg M, not M².
    """
    corrected = np.sort(regions.distance_db - incidence_db(regions.cosine, roughness))
    count = len(corrected)
    weight = 2.0 * np.arange(count) - (count - 1)
    return float(np.sqrt(max(float(weight @ corrected), 0.0) / (count * (count + 1) / 2)))


def find_roughness(regions: Regions) -> Roughness:
    """Find the σ of the least objective (eq. 18): 0° to 90° in steps of 1°, then of 0.02° around the best.

    A result above MAX_ROUGHNESS is no roughness of a lining; TYPICAL_ROUGHNESS is used instead, and also if there are fewer
    than two regions.
    """
    if len(regions) < 2:
        return Roughness(TYPICAL_ROUGHNESS, False, True, float("nan"), 0.0, len(regions), float("nan"), float("nan"))
    coarse = np.arange(0.0, 91.0)
    best = coarse[np.argmin([objective(regions, s) for s in coarse])]
    fine = np.clip(best + np.arange(-50, 51) * 0.02, 0.0, 90.0)
    values = [objective(regions, s) for s in fine]
    sigma = float(fine[np.argmin(values)])
    least = min(values)
    if assumed := sigma > MAX_ROUGHNESS:
        sigma, least = TYPICAL_ROUGHNESS, objective(regions, TYPICAL_ROUGHNESS)
    flattest, steepest = float(regions.cosine.max()), float(regions.cosine.min())
    ends = np.array([flattest, steepest])
    course = [
        float(np.diff(incidence_db(ends, float(np.clip(s, 0, 90))))[0])
        for s in (sigma - SIGNIFICANT_CHANGE, sigma + SIGNIFICANT_CHANGE)
    ]
    contrast = abs(course[1] - course[0])
    return Roughness(
        sigma=sigma,
        determined=contrast > NOTICEABLE and not assumed,
        assumed=assumed,
        objective=least,
        contrast=contrast,
        regions=len(regions),
        incidence_from=float(np.degrees(np.arccos(min(flattest, 1.0)))),
        incidence_to=float(np.degrees(np.arccos(steepest))),
    )


def automatic_regions(
    chainage: Float,
    arc: Float,
    view: NDArray[np.integer],
    cosine: NDArray[np.floating],
    distance_db: NDArray[np.floating],
) -> Regions:
    """Choose small homogeneous regions of dry lining, spread over the incidence angles.

    Cells are 0.2 m wide, one for each scanner position and incidence class. Cells whose points vary more than usual (edges,
    joints) are removed. In each incidence class the cells nearest to its dry level stay, so that leaks, dark or bright patches
    do not count, and no class dominates the others.

    Parameters
    ----------
    chainage, arc : (n,) float arrays
        Places of the lining points, m.
    view : (n,) int array
        Scanner position (scan id); points of different views do not share a cell.
    cosine : (n,) float array
        Cosine of the incidence angle.
    distance_db : (n,) float array
        Intensity corrected for distance, dB.

    Returns
    -------
    Regions
        Empty if there are no usable lining points.
    """
    angle = np.degrees(np.arccos(np.clip(cosine, 0.0, 1.0)))
    usable = np.isfinite(distance_db) & (angle <= MAX_INCIDENCE) & np.isfinite(chainage) & np.isfinite(arc)
    incidence_class = np.floor(angle[usable] / CLASS_WIDTH).astype(np.int64)
    cell = [np.floor(along[usable] / CELL).astype(np.int64) for along in (chainage, arc)]
    keys = np.column_stack([incidence_class, view[usable].astype(np.int64), *cell])
    first, regions, spread = _group(keys, cosine[usable], distance_db[usable])
    enough = regions.points >= MIN_CELL_POINTS
    if not enough.any():
        return _take(regions, np.zeros(0, np.intp))
    kept = enough & (spread <= 2.0 * np.median(spread[enough]))
    class_of = incidence_class[first]
    chosen = [
        _nearest_to_dry_level(np.flatnonzero(kept & (class_of == c)), regions.distance_db) for c in np.unique(class_of[kept])
    ]
    return _take(regions, np.concatenate(chosen))


def drawn_regions(
    region: NDArray[np.integer],
    view: NDArray[np.integer],
    cosine: NDArray[np.floating],
    distance_db: NDArray[np.floating],
) -> Regions:
    """Use the regions that the user drew, one for each scanner position and incidence class that sees it.

    Parameters
    ----------
    region : (n,) int array
        Number of the drawn polygon around the point, -1 for none.
    view, cosine, distance_db : (n,) arrays
        As in :func:`automatic_regions`.
    """
    angle = np.degrees(np.arccos(np.clip(cosine, 0.0, 1.0)))
    usable = np.isfinite(distance_db) & (cosine > 0) & (region >= 0)
    incidence_class = np.floor(angle[usable] / CLASS_WIDTH).astype(np.int64)
    keys = np.column_stack([incidence_class, view[usable].astype(np.int64), region[usable].astype(np.int64)])
    _, regions, _ = _group(keys, cosine[usable], distance_db[usable])
    return _take(regions, np.flatnonzero(regions.points >= MIN_CELL_POINTS))


def _group(keys: Int64, cosine: NDArray[np.floating], level: NDArray[np.floating]) -> tuple[Intp, Regions, Float]:
    """Average points with the same key; return one point of each group, the groups, and the spread of each."""
    count = len(keys)
    order = np.lexsort(keys.T[::-1])
    start = np.flatnonzero(np.concatenate([np.ones(min(count, 1), bool), np.any(np.diff(keys[order], axis=0) != 0, axis=1)]))
    points = np.diff(np.append(start, count))
    if count == 0:
        return start, Regions(np.zeros(0), np.zeros(0), points), np.zeros(0)
    ordered = level[order].astype(np.float64)
    mean = np.add.reduceat(ordered, start) / points
    mean_cosine = np.add.reduceat(cosine[order].astype(np.float64), start) / points
    spread = np.sqrt(np.add.reduceat((ordered - np.repeat(mean, points)) ** 2, start) / np.maximum(points - 1, 1))
    return order[start], Regions(mean_cosine, mean, points), spread


def _take(regions: Regions, index: Intp) -> Regions:
    return Regions(regions.cosine[index], regions.distance_db[index], regions.points[index])


def _nearest_to_dry_level(cells: Intp, level: Float) -> Intp:
    """Return those cells of one incidence class that are nearest to its dry level."""
    if len(cells) < MIN_CLASS_CELLS:
        return cells[:0]
    away = np.abs(level[cells] - robust_statistics(level[cells]).mean)
    return cells[np.argsort(away, kind="stable")[:CLASS_CELLS]]
