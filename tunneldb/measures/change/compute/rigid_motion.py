"""Rigid motion that a section of lining made between two epochs as a whole: what of their difference is one, robustly.

It is the error of the registration of the one against the other, or a movement of the tunnel: which, nothing but points that
did not move can tell.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Bool, Float, Int64, Single
from tunneldb.robust import MAD_TO_SIGMA
from tunneldb.shape.tukey import CUT, weights

MOTIONS = ("right", "up", "along", "roll", "yaw", "pitch")
"""What a section can do: shifts to the right, up and along the axis, m; turns about the axis, upwards and to the right, rad."""

DETERMINED = 1e-3
"""A motion that moves the lining along its normal by so little that its standard error on it is more is not determined, m."""

LEAST_CELLS = 50
"""A section of which fewer cells were seen by both is compared with no motion removed, which is stated."""

BENT = 2.0
"""A wall of a larger curvature is a corner, 1/m."""

LEAST_SHARE = 0.15
"""Where a smaller share of a section's cells made the motion that its neighbours made, none of them says anything on it."""

_KEPT = 0.6  # of the cells
_ROUNDS = 50
_STILL = 1e-7  # m: a round that changes no residual by more ends the search


@dataclass(frozen=True)
class SectionCells:
    """Cells of a section that both epochs saw.

    Attributes
    ----------
    difference, variance : (n,) float arrays
        New less old offset, m, and its variance, m².
    columns : (n, 6) float32 array
        Of :func:`motion_columns` for these.
    group : (n,) int array
        Stretch of the arc that each lies in: residuals within one are taken to be alike, those of several to be independent,
        so that an oval section, or noise that goes over many cells, is in the standard errors (Liang & Zeger, 1986).
    column : (n,) int array
        Of cells along the section, from 0.
    """

    difference: Float
    variance: Float
    columns: Single
    group: Int64
    column: Int64

    def part(self, held: Bool) -> SectionCells:
        """Some of the cells."""
        return SectionCells(self.difference[held], self.variance[held], self.columns[held], self.group[held], self.column[held])


@dataclass(frozen=True)
class Motion:
    """Motion of a section.

    Attributes
    ----------
    values : (6,) float array
        By :data:`MOTIONS`; NaN where not determined and so not removed.
    covariance : (6, 6) float array
        Of these. In a round lining a roll is much like a shift to the right, of which together far more is known than of each.
    removed : (n,) float array
        What it does to the offset of each cell, m.
    removed_error : (n,) float array
        Standard error of that, m.
    cells : int
        How many it was found by.
    """

    values: Float
    covariance: Float
    removed: Float
    removed_error: Float
    cells: int

    @property
    def errors(self) -> Float:
        """Standard errors (6,) of the motions."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def used(self) -> Bool:
        """Which motions are determined."""
        return np.asarray(np.isfinite(self.values))


def motion_columns(points: Float, normals: Float, frame: Float) -> Float:
    """By how much a unit of each motion changes the offsets of cells, (n, 6).

    Parameters
    ----------
    points, normals : (n, 3) float arrays
        Where the cells lie, and which way is inwards there, in the tunnel's frame, m.
    frame : (4, 3) float array
        Origin, tangent, right and up of the section's middle.
    """
    origin, tangent, right, up = frame
    away = points - origin
    turns = [np.einsum("ij,ij->i", normals, np.cross(axis, away)) for axis in (tangent, up, right)]
    return np.column_stack([normals @ right, normals @ up, normals @ tangent, *turns])


def rigid_motion(cells: SectionCells) -> Motion:
    """Fit the motion of a section by Tukey's biweight, from the least sum of absolute residuals on."""
    difference, variance, columns = cells.difference, cells.variance, cells.columns.astype(np.float64)
    spread = np.sqrt(np.mean(columns**2, axis=0)) if len(columns) else np.zeros(len(MOTIONS))
    used = _determined(columns, variance, spread)
    if len(difference) < LEAST_CELLS or not used.any():
        nothing = np.full((len(MOTIONS), len(MOTIONS)), np.nan)
        return Motion(nothing[0].copy(), nothing, np.zeros(len(difference)), np.zeros(len(difference)), len(difference))
    design = columns[:, used]
    values, weight, residual = _fit(design, difference, np.sqrt(variance))
    return _motion(cells, used, values, _covariance(design, weight, residual, variance, cells.group))


def motion_from(cells: SectionCells, start: Float, used: Bool) -> Motion | None:
    """The motion that is nearest to a given one (6,), by Tukey's biweight; None where too few cells share one."""
    used = used & np.isfinite(start)
    if not used.any() or len(cells.difference) < LEAST_CELLS:
        return None
    design, sigma = cells.columns[:, used].astype(np.float64), np.sqrt(cells.variance)
    values = np.asarray(start[used], dtype=np.float64)
    residual = cells.difference - design @ values
    for _ in range(_ROUNDS):
        weight = weights(residual / (CUT * float(np.median(sigma))))
        if float(weight.mean()) < LEAST_SHARE:
            return None
        weighted = weight[:, None] * design
        values = np.asarray(np.linalg.lstsq(weighted.T @ design, weighted.T @ cells.difference, rcond=None)[0], np.float64)
        before, residual = residual, cells.difference - design @ values
        if float(np.abs(residual - before).max()) < _STILL:
            break
    try:
        return _motion(cells, used, values, _covariance(design, weight, residual, cells.variance, cells.group))
    except np.linalg.LinAlgError:
        return None


def removed_by(cells: SectionCells, values: Float, covariance: Float, used: Bool) -> Motion:
    """The motion with determined values (m,) and their covariance (m, m), for a section."""
    return _motion(cells, used, values, covariance)


def unexplained(cells: SectionCells, residual: Float) -> float:
    """Share of cells that residuals (n,) leave, by Tukey's loss: 0 where they are none, 1 where all lie beyond its limit."""
    return float(np.mean(loss(cells, residual))) if len(residual) >= LEAST_CELLS else float("nan")


def loss(cells: SectionCells, residual: Float) -> Float:
    """Tukey's loss (n,) of residuals (n,), 1 beyond its limit."""
    u = residual / (CUT * np.sqrt(cells.variance))
    return np.asarray(1.0 - np.clip(1.0 - u**2, 0.0, None) ** 3)


def bending_error(motion: Motion, columns: Single, curvature: Float) -> Float:
    """By how much a shift along a sharply bent wall changes its offset (n,), m, which motions are not made of.

    With a shift t along a wall of curvature κ that is t² κ / 2: 2 mm in the corner of a box that is off by 20 mm.

    Parameters
    ----------
    columns : (n, 6) float array
        Of :func:`motion_columns`.
    curvature : (n,) float array
        Of the section, 1/m.
    """
    shift = np.nan_to_num(motion.values[:2])
    along = np.maximum(shift @ shift - (columns[:, :2] @ shift) ** 2, 0.0)
    return np.asarray(np.where(curvature > BENT, 0.5 * along * curvature, 0.0))


def _motion(cells: SectionCells, used: Bool, values: Float, covariance: Float) -> Motion:
    design = cells.columns[:, used].astype(np.float64)
    found, known = np.full(len(MOTIONS), np.nan), np.full((len(MOTIONS), len(MOTIONS)), np.nan)
    found[used], known[np.ix_(used, used)] = values, covariance
    error = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", design, covariance, design), 0.0))
    return Motion(found, known, design @ values, error, len(cells.difference))


def _determined(columns: Float, variance: Float, spread: Float) -> Bool:
    """Which motions the cells determine; what they do not is left out, the least determined first."""
    used = spread > 1e-6
    sigma = np.sqrt(np.median(variance)) if len(variance) else 0.0
    while used.any():
        scaled = columns[:, used] / spread[used]
        values, vectors = np.linalg.eigh(scaled.T @ scaled)
        errors = sigma * np.sqrt(np.sum(vectors**2 / np.maximum(values, 1e-12), axis=1))
        # In the scale of a shift: one that the normals hardly show, or a turn, would move the wall along itself by more.
        moved = errors / np.minimum(spread[used], 1.0)
        if moved.max() <= DETERMINED:
            break
        used[np.flatnonzero(used)[int(moved.argmax())]] = False
    return np.asarray(used)


def _fit(design: Float, difference: Float, sigma: Float) -> tuple[Float, Float, Float]:
    """Parameters, and weight and residual of each cell."""
    noise = float(np.median(sigma))
    residual = difference
    for tukey in (False, True):
        # What most cells bear is noise; where they do not, the section has changed its shape, and what is usual in it counts.
        usual = MAD_TO_SIGMA * float(np.median(np.abs(residual)))
        scale = noise if np.mean(np.abs(residual) < CUT * noise) >= _KEPT else max(noise, usual)
        for _ in range(_ROUNDS):
            weight = weights(residual / (CUT * scale)) if tukey else 1.0 / np.maximum(np.abs(residual), 0.1 * noise)
            weighted = weight[:, None] * design
            values = np.linalg.lstsq(weighted.T @ design, weighted.T @ difference, rcond=None)[0]
            before, residual = residual, difference - design @ values
            if float(np.abs(residual - before).max()) < _STILL:
                break
    return np.asarray(values, dtype=np.float64), weight, residual


def _covariance(design: Float, weight: Float, residual: Float, variance: Float, group: Int64) -> Float:
    """Covariance of the parameters by what the residuals of each group add up to; with few groups, by their noise."""
    inverse = np.linalg.inv(design.T @ (weight[:, None] * design))
    number, member = np.unique(group, return_inverse=True)
    count = design.shape[1]
    if len(number) < 2 * count:
        middle = design.T @ ((weight**2 * np.maximum(variance, residual**2))[:, None] * design)
    else:
        pulls = (weight * residual)[:, None] * design
        sums = np.column_stack([np.bincount(member, pull, minlength=len(number)) for pull in pulls.T])
        middle = sums.T @ sums * len(number) / (len(number) - count)
    return np.asarray(inverse @ middle @ inverse)
