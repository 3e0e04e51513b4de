"""Synthetic leaks: irregular patches, some with a streak below, with soft rims and uneven darkening."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from tunneldb.arrays import Bool, Float

AREAS = (0.05, 3.0)
"""Areas of synthetic leaks, m²; equally frequent on a logarithmic scale."""

DROPS = (0.7, 9.0)
"""Darkening of synthetic leaks, dB; likewise."""

RIMS = (0.006, 0.06)
"""Width of their rims, m; likewise."""

HARMONICS = 8
"""Number of harmonics of an irregular outline."""

ANGLES = 361
"""Number of angles between which the outline is interpolated."""

MAX_ELONGATION = 2.0
"""Maximum ratio of the longer to the shorter side of a patch."""

STREAK_SHARE = 0.3
"""Share of leaks with a streak below."""

MAX_UNEVENNESS = 0.3
"""Maximum standard deviation of the darkening within a leak, relative to its mean."""

WET = 0.5
"""Share of the full darkening from which a pixel belongs to the leak."""


@dataclass(frozen=True)
class SyntheticLeak:
    """Synthetic leak.

    Attributes
    ----------
    darkening : (rows, columns) float array
        Darkening of the pixels around the middle, dB; the first row is the highest.
    wet : (rows, columns) bool array
        Pixels that belong to it.
    drop : float
        Mean darkening of these, dB.
    """

    darkening: Float
    wet: Bool
    drop: float


def draw_leak(rng: np.random.Generator, pixel: float, *, downward: bool) -> SyntheticLeak:
    """Draw a synthetic leak.

    Parameters
    ----------
    rng : numpy Generator
    pixel : float
        Side of a pixel, m.
    downward : bool
        True if water runs towards later rows; False if towards earlier ones.
    """
    area, drop, rim = (_log_uniform(rng, *limits) for limits in (AREAS, DROPS, RIMS))
    elongation = _log_uniform(rng, 1.0 / MAX_ELONGATION, MAX_ELONGATION)
    radius = np.sqrt(area / np.pi)
    half = int(np.ceil(1.6 * radius * np.sqrt(MAX_ELONGATION) / pixel)) + 3
    across, down = np.meshgrid(*[np.arange(-half, half + 1) * pixel] * 2)
    across, down = across * np.sqrt(elongation), down / np.sqrt(elongation)
    depth = _outline(rng, np.arctan2(down, across)) * radius - np.hypot(across, down)
    if rng.random() < STREAK_SHARE:
        depth = np.maximum(depth, _streak(rng, across, down if downward else -down, radius))
    depth = _of_area(depth, area / pixel**2)
    cover = 1.0 / (1.0 + np.exp(np.clip(-4.0 * depth / rim, -50.0, 50.0)))
    field = ndimage.gaussian_filter(rng.standard_normal(cover.shape), rng.uniform(2.0, 12.0))
    uneven = np.clip(1.0 + rng.uniform(0.0, MAX_UNEVENNESS) * field / max(field.std(), 1e-9), 0.3, 1.7)
    wet = cover >= WET
    amount = cover * uneven
    return SyntheticLeak(amount * drop / amount[wet].mean(), wet, drop)


def _outline(rng: np.random.Generator, angle: Float) -> Float:
    """Return the radius of an irregular outline at angles, about 1."""
    roughness = rng.uniform(0.05, 0.3)
    at = np.linspace(-np.pi, np.pi, ANGLES)
    radius = np.ones_like(at)
    for k in range(2, HARMONICS):
        radius += rng.normal(0.0, roughness / k) * np.cos(k * at + rng.uniform(0.0, 2.0 * np.pi))
    outline: Float = np.interp(angle, at, np.maximum(radius, 0.3))
    return outline


def _streak(rng: np.random.Generator, across: Float, down: Float, radius: float) -> Float:
    """Return the depth of pixels inside a streak that starts in the middle, m."""
    half, length, place = rng.uniform(0.1, 0.3) * radius, rng.uniform(1.0, 1.6) * radius, rng.uniform(-0.6, 0.6) * radius
    depth: Float = np.minimum(half - np.abs(across - place), np.minimum(down, length - down))
    return depth


def _of_area(depth: Float, pixels: float) -> Float:
    """Shift the depths so that as many pixels as wanted lie inside; the most that there are if those are fewer."""
    inside = int(np.clip(round(pixels), 1, depth.size - 1))
    limit = float(np.partition(depth, -inside, axis=None)[-inside])
    return depth - limit


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
