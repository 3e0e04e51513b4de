"""Robust rigid motion of a section of lining between two epochs.

The motion is the error of the registration between them, or a movement of the tunnel. Only stable control points can separate
the two.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Bool, Float, Int64, Single
from tunneldb.robust import MAD_TO_SIGMA
from tunneldb.shape.tukey import CUT, weights

MOTIONS = ("right", "up", "along", "roll", "yaw", "pitch")
"""Motions of a section: shifts to the right, up and along the axis, m; turns about the axis, upwards and to the right, rad."""

MAX_MOTION_ERROR = 1e-3
"""Maximum standard error on the lining along its normal, m; a motion with a larger one is not determined."""

MIN_CELLS = 50
"""Minimum number of common cells; with fewer no motion is removed from the section, and this is reported."""

CORNER_CURVATURE = 2.0
"""Curvature from which a part of the wall is a corner, 1/m."""

MIN_COMMON_SHARE = 0.15
"""Minimum share of a section's cells that made the neighbours' motion, for them to say anything about it."""

_KEPT_SHARE = 0.6  # of the cells
_ROUNDS = 50
_CONVERGED = 1e-7  # m: the iteration ends when no residual changes by more


@dataclass(frozen=True)
class SectionCells:
    """Cells of a section that both epochs saw.

    Attributes
    ----------
    difference, variance : (n,) float arrays
        New minus old offset, m, and its variance, m².
    columns : (n, 6) float32 array
        Columns of :func:`motion_columns` for these cells.
    group : (n,) int array
        Stretch of the arc of each cell. Residuals within a stretch are treated as dependent, those of different stretches as
        independent, so that an oval section, or noise over many cells, enters the standard errors (Liang & Zeger, 1986).
    column : (n,) int array
        Column of each cell along the section, from 0.
    """

    difference: Float
    variance: Float
    columns: Single
    group: Int64
    column: Int64

    def part(self, mask: Bool) -> SectionCells:
        """Return some of the cells."""
        return SectionCells(self.difference[mask], self.variance[mask], self.columns[mask], self.group[mask], self.column[mask])


@dataclass(frozen=True)
class Motion:
    """Rigid motion of a section.

    Attributes
    ----------
    values : (6,) float array
        Values by :data:`MOTIONS`; NaN for those not determined and so not removed.
    covariance : (6, 6) float array
        Their covariance. In a round lining a roll resembles a shift to the right: both together are known far better than each.
    removed : (n,) float array
        Effect on the offset of each cell, m.
    removed_error : (n,) float array
        Standard error of that effect, m.
    cells : int
        Number of cells used.
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
        """True for motions that are determined."""
        return np.asarray(np.isfinite(self.values))


def motion_columns(points: Float, normals: Float, frame: Float) -> Float:
    """Return the change of the cells' offsets by a unit of each motion, (n, 6).

    Parameters
    ----------
    points, normals : (n, 3) float arrays
        Positions of the cells, and inward directions there, in the tunnel's frame, m.
    frame : (4, 3) float array
        Origin, tangent, right and up of the section's middle.
    """
    origin, tangent, right, up = frame
    away = points - origin
    turns = [np.einsum("ij,ij->i", normals, np.cross(axis, away)) for axis in (tangent, up, right)]
    return np.column_stack([normals @ right, normals @ up, normals @ tangent, *turns])


def rigid_motion(cells: SectionCells) -> Motion:
    """Fit the motion of a section by Tukey's biweight, starting from the least sum of absolute residuals."""
    difference, variance, columns = cells.difference, cells.variance, cells.columns.astype(np.float64)
    spread = np.sqrt(np.mean(columns**2, axis=0)) if len(columns) else np.zeros(len(MOTIONS))
    used = _determined(columns, variance, spread)
    if len(difference) < MIN_CELLS or not used.any():
        nothing = np.full((len(MOTIONS), len(MOTIONS)), np.nan)
        return Motion(nothing[0].copy(), nothing, np.zeros(len(difference)), np.zeros(len(difference)), len(difference))
    design = columns[:, used]
    values, weight, residual = _fit(design, difference, np.sqrt(variance))
    return _motion(cells, used, values, _covariance(design, weight, residual, variance, cells.group))


def motion_from(cells: SectionCells, start: Float, used: Bool) -> Motion | None:
    """Fit the motion nearest to a given one (6,), by Tukey's biweight; None if too few cells share one."""
    used = used & np.isfinite(start)
    if not used.any() or len(cells.difference) < MIN_CELLS:
        return None
    design, sigma = cells.columns[:, used].astype(np.float64), np.sqrt(cells.variance)
    values = np.asarray(start[used], dtype=np.float64)
    residual = cells.difference - design @ values
    for _ in range(_ROUNDS):
        weight = weights(residual / (CUT * float(np.median(sigma))))
        if float(weight.mean()) < MIN_COMMON_SHARE:
            return None
        weighted = weight[:, None] * design
        values = np.asarray(np.linalg.lstsq(weighted.T @ design, weighted.T @ cells.difference, rcond=None)[0], np.float64)
        before, residual = residual, cells.difference - design @ values
        if float(np.abs(residual - before).max()) < _CONVERGED:
            break
    try:
        return _motion(cells, used, values, _covariance(design, weight, residual, cells.variance, cells.group))
    except np.linalg.LinAlgError:
        return None


def removed_by(cells: SectionCells, values: Float, covariance: Float, used: Bool) -> Motion:
    """Make the motion of a section from determined values (m,) and their covariance (m, m)."""
    return _motion(cells, used, values, covariance)


def unexplained(cells: SectionCells, residual: Float) -> float:
    """Return the share of cells left by residuals (n,), by Tukey's loss: 0 if all are 0, 1 if all exceed its limit."""
    return float(np.mean(loss(cells, residual))) if len(residual) >= MIN_CELLS else float("nan")


def loss(cells: SectionCells, residual: Float) -> Float:
    """Return Tukey's loss (n,) of residuals (n,), 1 beyond its limit."""
    u = residual / (CUT * np.sqrt(cells.variance))
    return np.asarray(1.0 - np.clip(1.0 - u**2, 0.0, None) ** 3)


def bending_error(motion: Motion, columns: Single, curvature: Float) -> Float:
    """Return the change of offset (n,), m, by a shift along a sharply bent wall, which the linear motions do not include.

    For a shift t along a wall of curvature κ it is t² κ / 2: 2 mm in the corner of a box displaced by 20 mm.

    Parameters
    ----------
    columns : (n, 6) float array
        Columns of :func:`motion_columns`.
    curvature : (n,) float array
        Curvature of the section, 1/m.
    """
    shift = np.nan_to_num(motion.values[:2])
    along = np.maximum(shift @ shift - (columns[:, :2] @ shift) ** 2, 0.0)
    return np.asarray(np.where(curvature > CORNER_CURVATURE, 0.5 * along * curvature, 0.0))


def _motion(cells: SectionCells, used: Bool, values: Float, covariance: Float) -> Motion:
    design = cells.columns[:, used].astype(np.float64)
    found, known = np.full(len(MOTIONS), np.nan), np.full((len(MOTIONS), len(MOTIONS)), np.nan)
    found[used], known[np.ix_(used, used)] = values, covariance
    error = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", design, covariance, design), 0.0))
    return Motion(found, known, design @ values, error, len(cells.difference))


def _determined(columns: Float, variance: Float, spread: Float) -> Bool:
    """Return the motions that the cells determine; the worst determined ones are left out one by one."""
    used = spread > 1e-6
    sigma = np.sqrt(np.median(variance)) if len(variance) else 0.0
    while used.any():
        scaled = columns[:, used] / spread[used]
        values, vectors = np.linalg.eigh(scaled.T @ scaled)
        errors = sigma * np.sqrt(np.sum(vectors**2 / np.maximum(values, 1e-12), axis=1))
        # In the scale of a shift: an undetermined shift, or turn, would move the wall along itself by more.
        moved = errors / np.minimum(spread[used], 1.0)
        if moved.max() <= MAX_MOTION_ERROR:
            break
        used[np.flatnonzero(used)[int(moved.argmax())]] = False
    return np.asarray(used)


def _fit(design: Float, difference: Float, sigma: Float) -> tuple[Float, Float, Float]:
    """Return parameters, and weight and residual of each cell."""
    noise = float(np.median(sigma))
    residual = difference
    for tukey in (False, True):
        # What most cells show is noise; if few do, the section has changed its shape, and the usual residual in it counts.
        usual = MAD_TO_SIGMA * float(np.median(np.abs(residual)))
        scale = noise if np.mean(np.abs(residual) < CUT * noise) >= _KEPT_SHARE else max(noise, usual)
        for _ in range(_ROUNDS):
            weight = weights(residual / (CUT * scale)) if tukey else 1.0 / np.maximum(np.abs(residual), 0.1 * noise)
            weighted = weight[:, None] * design
            values = np.linalg.lstsq(weighted.T @ design, weighted.T @ difference, rcond=None)[0]
            before, residual = residual, difference - design @ values
            if float(np.abs(residual - before).max()) < _CONVERGED:
                break
    return np.asarray(values, dtype=np.float64), weight, residual


def _covariance(design: Float, weight: Float, residual: Float, variance: Float, group: Int64) -> Float:
    """Return the covariance of the parameters from the summed residuals of each group; with few groups, from their noise."""
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
