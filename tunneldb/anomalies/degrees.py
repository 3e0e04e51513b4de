"""Degrees of likeness of a dark region to dry dark areas, from its shape and its sums.

They are features of the model that classifies regions (:mod:`tunneldb.anomalies.evidence`), and name its reasons; none of them
decides by itself.
"""

from __future__ import annotations

import numpy as np

from tunneldb.anomalies.region_shape import Shape
from tunneldb.anomalies.regions import Region

STRONG_CONTRAST, STRONG_DROP = 8.0, 3.0
"""Contrast (standard deviations) and darkening (dB) from which a patch with straight sides may be water that fills a panel:
shades of concrete and mortar reach neither, water takes away half of the light and more."""

MAX_JOINT_DARKENING = 3.0
"""Maximum darkening of a dry joint, dB: of 2 cm, the blur of pixels and beam, a joint of up to 1 cm takes at most half of the
light. Finer pixels do not make the beam finer."""

REFERENCE_PIXEL = 0.02
"""Pixel size up to which limits of widths, areas and straightness apply in metres, m; they grow with larger pixels: with few
pixels sides look straight by chance, and leaks would be classified as something built."""

MAX_STRAIGHT_DEVIATION = 0.02
"""Maximum standard deviation of the sides of built objects about straight lines, m."""

MAX_POCKET_SIZE = 0.3
"""Maximum size of bolt pockets, m."""

FEW_PROFILES, MANY_PROFILES = 3.0, 6.0
"""Number of profiles across a region up to which anything looks straight along the tunnel, and from which its straightness is
known."""

MIN_STEP_LENGTH = 0.2
"""Minimum length of a region's boundary with a known step for the boundary to be called soft, m."""


def degrees_of(region: Region, shape: Shape) -> dict[str, float]:
    """Return the degrees of likeness of a region to each alternative to water, 0 to 1."""
    return {
        "thin": _thin(region, shape),
        "recess": _recess(region),
        "gradual": _gradual(region, shape),
        "rectangular": _rectangular(region, shape),
        "stripe": min(_stripe(shape, _straight(region)), straightness_weight(region)),
        "shadow": _shadow(region, shape),
    }


def _thin(region: Region, shape: Shape) -> float:
    """Compute the likeness to a joint: narrow (2 cm, widened by beam, pixels and filter), straight, less dark than water."""
    straight = _straight(region)
    deviation = shape.deviation_along if shape.along > shape.across else shape.deviation_across
    return min(
        straightness_weight(region),
        ramp(shape.mean_width, 0.10, 0.07),
        ramp(shape.length / max(shape.mean_width, region.pixel), 4.0, 8.0),
        ramp(deviation, 2.0 * straight, straight),
        ramp(region.darkening_mean, MAX_JOINT_DARKENING + 0.5, MAX_JOINT_DARKENING),
    )


def _recess(region: Region) -> float:
    """Compute the likeness to a bolt pocket: dark as a whole, small, and recessed, while its surroundings are not."""
    properties, pixels = region.properties, np.count_nonzero(region.mask)
    about = properties.perimeter_recess / properties.perimeter if properties.perimeter else 0.0
    # A profile that hits a pocket represents more than the pocket's length.
    area = region.area / max(1.0, region.spacing / MAX_POCKET_SIZE)
    return min(ramp(properties.recess / pixels, 0.3, 0.7), ramp(about, 0.4, 0.2), ramp(area, 0.12, 0.08))


def _gradual(region: Region, shape: Shape) -> float:
    """Compute the likeness to soot and grime, which fade out; a wet patch reaches most of its darkness within centimetres.

    Grime beneath a cable forms a band along the tunnel, which water does not: there less softness is required.
    """
    properties = region.properties
    if properties.steps * region.pixel < MIN_STEP_LENGTH * _coarseness(region) * (1 - 1e-12) or region.darkening_sum <= 0:
        return 0.0
    step = (properties.inside - properties.outside) / properties.steps / region.darkening_mean
    band = min(ramp(shape.along / shape.across, 4.0, 8.0), straightness_weight(region))
    return ramp(step, 0.6 + 0.25 * band, 0.3 + 0.25 * band)


def _rectangular(region: Region, shape: Shape) -> float:
    """Compute the likeness to repairs or segments of another shade, with sharp sides along the tunnel and around it.

    It allows for cuts by joints and fixtures. Small blobs or narrow bands along a joint have more such sides by chance.
    """
    properties = region.properties
    shown = properties.perimeter - properties.perimeter_off
    if not properties.sharp or not shown:
        return 0.0
    width, area = shape.mean_width / _coarseness(region), region.area / _coarseness(region) ** 2
    min_share = 0.71 + 0.15 * ramp(width, 0.35, 0.2) + 0.12 * ramp(area, 0.3, 0.1)
    lines = ramp(properties.straight / properties.sharp, min_share, min_share + 0.08)
    # Water that fills a panel between joints is rectangular too, but darker than repairs; small blobs are excluded too.
    panel = _strong(region) * max(ramp(region.area, 0.8, 1.2), ramp(width, 0.45, 0.3))
    sharp = ramp(properties.sharp / shown, 0.15, 0.25)
    return min(lines, sharp, ramp(width, 0.16, 0.22), 1.0 - panel, straightness_weight(region))


def _strong(region: Region) -> float:
    """Return how certainly a region is as dark as water, unlike any shade of concrete."""
    return ramp(min(region.contrast / STRONG_CONTRAST, region.darkening_mean / STRONG_DROP), 0.8, 1.0)


def _stripe(shape: Shape, straight: float) -> float:
    """Compute the likeness to a painted stripe: a band along the tunnel, straight and equally wide at its ends."""
    neat = min(
        ramp(shape.deviation_box, straight, 0.6 * straight),
        ramp(shape.rectangularity, 0.85, 0.93),
        ramp(shape.corners, 0.4, 0.7),
    )
    # Stripes with ragged edges are longer than any leak along the tunnel.
    long = min(ramp(shape.along, 2.0, 2.5), ramp(shape.deviation_along, 2.0 * straight, straight))
    return min(ramp(shape.aspect_ratio, 6.0, 10.0), max(neat, long))


def _shadow(region: Region, shape: Shape) -> float:
    """Compute the likeness to a shadow: a narrow band beside a cable or pipe, or a gap between fixtures without free ends."""
    properties = region.properties
    facing_share = properties.perimeter_off / properties.perimeter if properties.perimeter else 0.0
    return max(min(ramp(facing_share, 0.25, 0.45), ramp(shape.width, 0.14, 0.08)), ramp(facing_share, 0.8, 0.9))


def straightness_weight(region: Region) -> float:
    """Return how far the number of profiles suffices to judge straightness: 1 if they are as close as pixels."""
    return ramp(region.mask.shape[1] * region.pixel / region.spacing, FEW_PROFILES, MANY_PROFILES) if region.spacing else 1.0


def _straight(region: Region) -> float:
    """Return the maximum standard deviation of straight sides, m."""
    return MAX_STRAIGHT_DEVIATION * _coarseness(region)


def _coarseness(region: Region) -> float:
    """Return the size of the pixels relative to those for which limits apply in metres, at least 1."""
    return max(1.0, region.pixel / REFERENCE_PIXEL)


def ramp(value: float, none: float, full: float) -> float:
    """Return a linear ramp from 0 at ``none`` to 1 at ``full``, in either direction."""
    return min(max((float(value) - none) / (full - none), 0.0), 1.0)
