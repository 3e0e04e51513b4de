"""Smooth random fields: sums of cubic splines through random numbers, at several wavelengths."""

from __future__ import annotations

import numpy as np
from scipy import sparse

# standard deviation of a cubic B-spline through independent normal numbers, along one direction
_SPREAD = 0.692


def _spline(count: int, step: float) -> sparse.csr_matrix:
    """Matrix that evaluates a cubic B-spline with unit knots at ``count`` places ``step`` knots apart."""
    place = np.arange(count) * step
    knot = np.floor(place).astype(int)
    f = place - knot
    weight = np.stack([(1 - f) ** 3, 3 * f**3 - 6 * f**2 + 4, -3 * f**3 + 3 * f**2 + 3 * f + 1, f**3], axis=1) / 6
    rows = np.repeat(np.arange(count), 4)
    columns = (knot[:, None] + np.arange(4)).ravel()
    return sparse.csr_matrix((weight.ravel().astype(np.float32), (rows, columns)), shape=(count, knot[-1] + 4))


def smooth(shape: tuple[int, int], pixel: float, wave_u: float, wave_s: float, rng: np.random.Generator) -> np.ndarray:
    """Field of about unit spread with one wavelength (metres) down the rows and another along the columns."""
    down = _spline(shape[0], min(pixel / wave_u, 1.0))
    along = _spline(shape[1], min(pixel / wave_s, 1.0))
    knots = rng.standard_normal((down.shape[1], along.shape[1])).astype(np.float32)
    half = down @ knots
    return (along @ half.T).T / _SPREAD**2


def fractal(
    shape: tuple[int, int],
    pixel: float,
    longest: float,
    shortest: float,
    rng: np.random.Generator,
    fade: float = 0.6,
    stretch: float = 1.0,
) -> np.ndarray:
    """Sum of octaves from ``longest`` to ``shortest`` (metres), of about unit spread.

    ``fade`` is how much weaker each octave is than the one before, ``stretch`` how much longer waves are down the rows.
    """
    total = np.zeros(shape, dtype=np.float32)
    weight, power, wave = 1.0, 0.0, longest
    while wave >= shortest * 0.999:
        total += weight * smooth(shape, pixel, wave * stretch, wave, rng)
        power += weight**2
        weight *= fade
        wave /= 2
    return total / np.sqrt(power)


def line(count: int, pixel: float, longest: float, shortest: float, rng: np.random.Generator, fade: float = 0.6) -> np.ndarray:
    """A fractal along a line, of about unit spread."""
    total = np.zeros(count)
    weight, power, wave = 1.0, 0.0, longest
    while wave >= shortest * 0.999:
        matrix = _spline(count, min(pixel / wave, 1.0))
        total += weight * (matrix @ rng.standard_normal(matrix.shape[1])) / _SPREAD
        power += weight**2
        weight *= fade
        wave /= 2
    return total / np.sqrt(power)
