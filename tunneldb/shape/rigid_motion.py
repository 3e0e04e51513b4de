"""Rigid motion that a section of lining made between two epochs as a whole: what of their difference is one, robustly.

It is the error of the registration of the one against the other, or a movement of the tunnel: which, nothing but points that
did not move can tell.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.robust import MAD_TO_SIGMA
from tunneldb.shape.tukey import CUT, weights

MOTIONS = ("right", "up", "along", "roll", "yaw", "pitch")
"""What a section can do: shifts to the right, up and along the axis, m; turns about the axis, upwards and to the right, rad."""

DETERMINED = 1e-3
"""A motion that moves the lining along its normal by so little that its standard error on it is more is not determined, m."""

LEAST_CELLS = 50
"""A section of which fewer cells were seen by both is compared with no motion removed, which is stated."""

_KEPT = 0.6  # of the cells
_ROUNDS = 50
_STILL = 1e-7  # m: a round that changes no residual by more ends the search


@dataclass(frozen=True)
class Motion:
    """Motion of a section.

    Attributes
    ----------
    values, errors : (6,) float arrays
        By :data:`MOTIONS`, with standard errors; NaN where not determined and so not removed.
    removed : (n,) float array
        What it does to the offset of each cell, m.
    removed_error : (n,) float array
        Standard error of that, m.
    cells : int
        How many it was found by.
    """

    values: Float
    errors: Float
    removed: Float
    removed_error: Float
    cells: int


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


def rigid_motion(difference: Float, variance: Float, columns: Float, group: Int64) -> Motion:
    """Fit the motion to differences of offset by Tukey's biweight, from the least sum of absolute residuals on.

    Parameters
    ----------
    difference, variance : (n,) float arrays
        New less old offset of the cells that both epochs saw, m, and its variance, m².
    columns : (n, 6) float array
        Of :func:`motion_columns` for these.
    group : (n,) int array
        Stretch of the arc that each lies in: residuals within one are taken to be alike, those of several to be independent,
        so that an oval section, or noise that goes over many cells, is in the standard errors (Liang & Zeger, 1986).
    """
    spread = np.sqrt(np.mean(columns**2, axis=0)) if len(columns) else np.zeros(len(MOTIONS))
    used = _determined(columns, variance, spread)
    if len(difference) < LEAST_CELLS or not used.any():
        nothing = np.full(len(MOTIONS), np.nan)
        return Motion(nothing, nothing.copy(), np.zeros(len(difference)), np.zeros(len(difference)), len(difference))
    design = columns[:, used]
    values, weight, residual = _fit(design, difference, np.sqrt(variance))
    covariance = _covariance(design, weight, residual, variance, group)
    found, errors = np.full(6, np.nan), np.full(6, np.nan)
    found[used], errors[used] = values, np.sqrt(np.diag(covariance))
    error = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", design, covariance, design), 0.0))
    return Motion(found, errors, design @ values, error, len(difference))


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
