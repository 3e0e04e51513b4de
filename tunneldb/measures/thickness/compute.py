"""Layer between two surfaces with the same design profile: thickness and area, in cells along it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float
from tunneldb.measures.deviation.compute import STEP
from tunneldb.shape.outline import Outline
from tunneldb.shape.profile import Stretch, strip_area

MIN_SEEN_SHARE = 0.5
"""Minimum seen share of a cell made of cells of another length."""


@dataclass(frozen=True)
class SectionThickness:
    """Layer between two surfaces in a step of chainage.

    Attributes
    ----------
    design_length, compared_length : float
        Length of the profile, and of the part that both saw, m.
    area : float
        Area between the surfaces where both saw, positive where the later one is inside the earlier one, m².
    area_by : (2,) float array
        Increase of the area if the later surface moves to the right, and up, m²/m.
    thickness : (n,) float array
        Thickness in each cell, at right angles to the profile, m; NaN where either saw nothing.
    """

    design_length: float
    compared_length: float
    area: float
    area_by: Float
    thickness: Float

    @property
    def mean(self) -> float:
        """Mean of the cells, m; NaN without any."""
        seen = self.thickness[np.isfinite(self.thickness)]
        return float(seen.mean()) if len(seen) else np.nan

    @property
    def least(self) -> tuple[float, float]:
        """Return the least value of a cell, m, and the place of its middle along the profile, m; NaN if there is none."""
        if not np.isfinite(self.thickness).any():
            return np.nan, np.nan
        k = int(np.nanargmin(self.thickness))
        return float(self.thickness[k]), (k + 0.5) * self.design_length / len(self.thickness)


def section_thickness(before: Float, after: Float, outline: Outline) -> SectionThickness:
    """Compute thickness and area between two surfaces.

    Parameters
    ----------
    before, after : (n,), (m,) float arrays
        Deviation of both from one profile in cells of equal length along it, m, positive inside; NaN where unseen. If their
        cells differ in length, the longer ones are used.
    outline : Outline
        The profile.

    Notes
    -----
    A point of either surface is assigned to its foot on the profile, so that a cell compares points on one normal of the
    profile: thickness is measured along that. Compared with the distance at right angles to a surface inclined to the profile
    by an angle a it is longer by a factor 1 / cos a, 0.4 % at 5°. Areas are those between parallel curves (Steiner) of each
    cell.
    """
    count = min(len(before), len(after))
    old, new = resampled(before, count), resampled(after, count)
    middle = (np.arange(count) + 0.5) / count
    _, inward = outline.places(middle)
    curvature = outline.curvature(middle)
    each = outline.length / count
    both = np.isfinite(old) & np.isfinite(new)
    area = np.where(both, strip_area(new, curvature) - strip_area(old, curvature), 0.0)
    return SectionThickness(
        design_length=outline.length,
        compared_length=float(each * both.sum()),
        area=float(each * area.sum()),
        area_by=each * (both @ inward),
        thickness=np.where(both, new - old, np.nan),
    )


def resampled(values: Float, count: int) -> Float:
    """Return means of cells (n,) in fewer cells of equal length (count,), NaN where too little was seen."""
    values = np.asarray(values, np.float64)
    if len(values) == count:
        return values
    seen = np.isfinite(values)
    edges, wanted = np.linspace(0.0, 1.0, len(values) + 1), np.linspace(0.0, 1.0, count + 1)

    def within(amount: Float) -> Float:
        return np.diff(np.interp(wanted, edges, np.concatenate([[0.0], np.cumsum(amount)])))

    selected, total = within(seen.astype(np.float64)), within(np.where(seen, values, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(selected > MIN_SEEN_SHARE * len(values) / count, total / selected, np.nan))


@dataclass(frozen=True)
class DeviationCells:
    """Step of chainage of a survey with the deviation of its cells."""

    profile: str
    low: float
    high: float
    noise_area: float
    cells: Float


@dataclass(frozen=True)
class ThicknessStep:
    """Step of chainage that two surveys have, with the layer between them."""

    low: float
    high: float
    noise_area: float
    figures: SectionThickness


def compared_steps(
    stretches: Sequence[Stretch], before: Sequence[DeviationCells], after: Sequence[DeviationCells]
) -> Iterator[ThicknessStep]:
    """Yield the layer between two surveys in the steps that both have, within the ends of both."""
    by_place = {(np.floor(old.low / STEP), old.profile): old for old in before}
    by_name = {stretch.name: stretch for stretch in stretches}
    for new in after:
        old = by_place.get((np.floor(new.low / STEP), new.profile))
        if old is None:
            continue
        low, high = max(old.low, new.low), min(old.high, new.high)
        if low < high:
            outline = by_name[new.profile].at((low + high) / 2.0)
            noise = float(np.hypot(old.noise_area, new.noise_area))
            yield ThicknessStep(low, high, noise, section_thickness(old.cells, new.cells, outline))
