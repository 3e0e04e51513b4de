"""Change of a kilometre: the rigid motion of each section, and what remains of the change without it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from tunneldb.arrays import Float, Single
from tunneldb.geometry.surface import Surface
from tunneldb.measures.change.compute import change as shape_change
from tunneldb.measures.change.compute.cells import CellGrid, Cells, slopes
from tunneldb.measures.change.compute.rigid_motion import Motion, SectionCells, bending_error, motion_columns, rigid_motion
from tunneldb.measures.change.compute.tied_motion import tied_motions

GROUP = 1.0
"""Length of the stretches of arc, m, whose residuals give the standard errors of motions."""


BENT_STEP = 10.0
"""Distance, m, at which the section is examined for corners."""


@dataclass(frozen=True)
class Section:
    """Section with its motion and the change that remains without it; areas m², lengths m."""

    low: float
    high: float
    seen_old: float
    seen_new: float
    seen_both: float
    motion: Motion
    rms: float
    least: float
    greatest: float
    lod: float
    cell: float
    arc_from: float
    change: Float


@dataclass(frozen=True)
class Change:
    """Change of a kilometre, in (rows, columns) arrays of cells.

    Attributes
    ----------
    grid : CellGrid
    old, new : Cells
        Cells of both epochs, in the plane of the older one.
    difference : m
        New minus old offset without the rigid motions; NaN where one of them has no measurement.
    variance, removed_error, lod : m², m, m
    scatter : Scatter
    place_error : m
        Twofold, (2, rows, columns): see `tunneldb.measures.change.compute.change.change_regions`.
    sections : list of (slice, Motion)
        Columns of each section, and its motion.
    """

    grid: CellGrid
    old: Cells
    new: Cells
    difference: Single
    variance: Single
    removed_error: Single
    lod: Single
    scatter: shape_change.Scatter
    place_error: Single
    sections: list[tuple[slice, Motion]]


def measure_change(surface: Surface, grid: CellGrid, old: Cells, new: Cells, length: float, pixel: float) -> Change:
    """Remove the rigid motion of each section from the difference of two epochs, and compute its level of detection.

    A pixel, of a side in m, represents its points as if they were in its middle. If profiles are about a pixel apart, all
    points of a place are on one side of it, and on another in the other epoch: uniformly distributed within the pixel, in both.
    """
    difference, variance = new.offset - old.offset, old.variance + new.variance
    noise = shape_change.measure_scatter(difference, variance).factors[0]
    removed_error = np.where(np.isfinite(difference), np.float32(0.0), np.float32(np.nan))
    number = np.floor((grid.chainage - grid.cell / 2.0) / length + 1e-9).astype(np.int64)
    edges = [0, *(np.flatnonzero(np.diff(number)) + 1).tolist(), grid.columns]
    relief = slopes(old, grid.cell)
    parts, cells = [], []
    for begin, end in pairwise(edges):
        row, column = np.nonzero(np.isfinite(difference[:, begin:end]))
        shown = _columns(surface, grid, (row, column + begin), old, relief)
        known = np.isfinite(shown).all(axis=1)  # beyond the last plane there is no surface
        difference[row[~known], column[~known] + begin] = np.nan
        at = row[known], column[known] + begin
        parts.append((slice(begin, end), at))
        cells.append(
            SectionCells(
                difference[at].astype(np.float64),
                variance[at].astype(np.float64) * noise**2,
                shown[known].astype(np.float32),  # all sections of a kilometre are held
                np.floor(grid.arc[at[0]] / GROUP).astype(np.int64),
                at[1] - begin,
            )
        )
    motions = tied_motions(cells, number[edges[:-1]], [rigid_motion(one) for one in cells])
    bent: dict[int, Float] = {}
    for k, ((_, at), motion) in enumerate(zip(parts, motions, strict=True)):
        if not len(at[0]):
            continue
        place = int(grid.chainage[at[1][0]] / BENT_STEP)
        if place not in bent:
            bent[place] = _bent(surface, grid, float(np.median(grid.chainage[at[1]])))
        difference[at] -= motion.removed.astype(np.float32)
        removed_error[at] = motion.removed_error + bending_error(motion, cells[k].columns, bent[place][at[0]])
    sections = [(columns, motion) for (columns, _), motion in zip(parts, motions, strict=True)]
    scatter = shape_change.measure_scatter(difference, variance)
    lod = shape_change.detection_level(variance, removed_error, scatter)
    place_error = (np.stack(relief) * (pixel / math.sqrt(6.0))).astype(np.float32)
    return Change(grid, old, new, difference, variance, removed_error, lod, scatter, place_error, sections)


def _columns(surface: Surface, grid: CellGrid, at: tuple[Any, Any], old: Cells, relief: tuple[Single, Single]) -> Float:
    """Return the effect of a section's motions on its cells, (n, 6), about the middle of its seen part.

    A lining with relief also changes its offset when it moves along itself, which determines this motion.
    """
    chainage, arc = grid.chainage[at[1]], grid.arc[at[0]]
    points = surface.to_space(chainage, arc, old.offset[at].astype(np.float64))
    normals = np.full_like(points, np.nan)
    valid = np.isfinite(points[:, 0])
    normals[valid] = surface.unroll(points[valid]).normal
    middle = float(np.median(chainage)) if len(chainage) else np.nan
    frame = surface.frames(np.array([middle]))[0]
    along, around = (slope[at][:, None] for slope in relief)
    normals = normals - along * frame[1] - around * np.cross(normals, frame[1])
    return motion_columns(points, normals, frame)


def _bent(surface: Surface, grid: CellGrid, chainage: float) -> Float:
    """Return the curvature (rows,) of a section over two cells about each row, 1/m; 0 where it is unknown."""
    normals = []
    for beside in (-grid.cell, grid.cell):
        points = surface.to_space(np.full(grid.rows, chainage), grid.arc + beside, np.zeros(grid.rows))
        normal = np.full_like(points, np.nan)
        valid = np.isfinite(points[:, 0])
        normal[valid] = surface.unroll(points[valid]).normal
        normals.append(normal)
    turn = np.arccos(np.clip(np.einsum("ij,ij->i", *normals), -1.0, 1.0))
    return np.nan_to_num(turn / (2.0 * grid.cell))


def section_figures(found: Change) -> list[Section]:
    """Compute the figures of the sections that at least one epoch saw."""
    grid, cell = found.grid, found.grid.cell
    window, _, number = shape_change.window_means(found.difference, found.variance, found.removed_error, found.scatter)
    both = np.isfinite(found.difference)
    window = np.where(both & (number >= shape_change.MIN_WINDOW_CELLS), window, np.nan)
    rows = []
    for columns, motion in found.sections:
        seen_old, seen_new = (float(np.isfinite(cells.offset[:, columns]).sum()) * cell**2 for cells in (found.old, found.new))
        if seen_old == seen_new == 0.0:
            continue
        selected = both[:, columns]
        change = found.difference[:, columns][selected].astype(np.float64)
        noise = found.variance[:, columns][selected].astype(np.float64) * found.scatter.factors[0] ** 2
        means = window[:, columns][np.isfinite(window[:, columns])]
        low, high = (grid.west + place * cell for place in (columns.start, columns.stop))
        rows.append(
            Section(
                round(low, 6), round(high, 6), seen_old, seen_new, float(selected.sum()) * cell**2, motion,
                float(np.sqrt(max(np.mean(change**2 - noise), 0.0))) if len(change) else np.nan,
                float(means.min()) if len(means) else np.nan, float(means.max()) if len(means) else np.nan,
                median(found.lod[:, columns]), cell, grid.south, _along(found.difference[:, columns]),
            )
        )  # fmt: skip
    return rows


def _along(change: Single) -> Float:
    """Return the mean of each row (rows,) over the compared cells; NaN without any."""
    count = np.isfinite(change).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.nansum(change, axis=1, dtype=np.float64) / count)


def median(values: Single) -> float:
    """Return the median of the finite values; NaN without any."""
    valid = values[np.isfinite(values)]
    return float(np.median(valid)) if len(valid) else float("nan")
