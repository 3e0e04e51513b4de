"""Degrees to which a dark region looks like something that is dark but dry, by its shape and its sums."""

from __future__ import annotations

import numpy as np

from tunneldb.anomalies.region_shape import Shape
from tunneldb.anomalies.regions import Region

STRONG_CONTRAST, STRONG_DROP = 8.0, 3.0
"""Standard deviations and dB from which a patch with straight sides may be water after all, that fills a panel between joints:
of shades of concrete and mortar neither is expected, water takes away half of the light and more."""

DARKEST_JOINT = 3.0
"""A joint of up to 1 cm takes no more than half of the light from 2 cm, by which pixels and beam blur it, dB; what is darker is
wet. Finer pixels are seen by a beam that is no finer."""

RESOLVED = 0.02
"""Limits of widths, areas and straightness hold in metres for pixels up to this size, m, and grow with larger ones: of few
pixels sides look straight by chance, and leaks would be taken for something built."""

STRAIGHT = 0.02
"""Standard deviation of the sides of what was built about straight lines, m, at most."""

POCKET = 0.3
"""Bolt pockets are no longer, m."""

FEW_PROFILES, MANY_PROFILES = 3.0, 6.0
"""On so few profiles that lie apart anything looks straight along the tunnel; so many tell whether it is."""

LEAST_STEPS = 0.2
"""Length of the boundary of a region along which the step over it must be known to tell that it is soft, m."""


def degrees_of(region: Region, shape: Shape) -> dict[str, float]:
    """How much speaks for each of what a region may be instead of water, 0 to 1."""
    return {
        "thin": _thin(region, shape),
        "recess": _recess(region),
        "gradual": _gradual(region, shape),
        "rectangular": _rectangular(region, shape),
        "stripe": min(_stripe(shape, _straight(region)), told(region)),
        "shadow": _shadow(region, shape),
    }


def _thin(region: Region, shape: Shape) -> float:
    """Joints are at most 2 cm wide, which the beam, the pixels and the median filter widen, straight, not as dark as water."""
    straight = _straight(region)
    deviation = shape.deviation_along if shape.along > shape.across else shape.deviation_across
    return min(
        told(region),
        ramp(shape.mean_width, 0.10, 0.07),
        ramp(shape.length / max(shape.mean_width, region.pixel), 4.0, 8.0),
        ramp(deviation, 2.0 * straight, straight),
        ramp(region.drop_mean, DARKEST_JOINT + 0.5, DARKEST_JOINT),
    )


def _recess(region: Region) -> float:
    """A bolt pocket is dark as a whole, and small: it is set back, and what is about it is not."""
    properties, pixels = region.properties, np.count_nonzero(region.mask)
    about = properties.perimeter_recess / properties.perimeter if properties.perimeter else 0.0
    # A profile that hits a pocket stands for more than the pocket is long.
    area = region.area / max(1.0, region.spacing / POCKET)
    return min(ramp(properties.recess / pixels, 0.3, 0.7), ramp(about, 0.4, 0.2), ramp(area, 0.12, 0.08))


def _gradual(region: Region, shape: Shape) -> float:
    """Soot and grime fade out; of the darkness of a wet patch most is reached within some centimetres of its edge.

    Grime beneath a cable lies in a band along the tunnel, which water does not: there less softness is enough.
    """
    properties = region.properties
    if properties.steps * region.pixel < LEAST_STEPS * _coarseness(region) * (1 - 1e-12) or region.drop_sum <= 0:
        return 0.0
    step = (properties.inside - properties.outside) / properties.steps / region.drop_mean
    band = min(ramp(shape.along / shape.across, 4.0, 8.0), told(region))
    return ramp(step, 0.6 + 0.25 * band, 0.3 + 0.25 * band)


def _rectangular(region: Region, shape: Shape) -> float:
    """What was built, a repaired patch or a segment of another shade: its sharp sides lie along the tunnel and around it.

    However joints and appendages cut it up. Of a small blob or a narrow band along a joint more sides do by chance.
    """
    properties = region.properties
    shown = properties.perimeter - properties.perimeter_off
    if not properties.sharp or not shown:
        return 0.0
    width, area = shape.mean_width / _coarseness(region), region.area / _coarseness(region) ** 2
    most = 0.71 + 0.15 * ramp(width, 0.35, 0.2) + 0.12 * ramp(area, 0.3, 0.1)
    lines = ramp(properties.straight / properties.sharp, most, most + 0.08)
    # Water that fills a panel between joints is rectangular too, and darker than repairs are, and so are small blobs.
    panel = _strong(region) * max(ramp(region.area, 0.8, 1.2), ramp(width, 0.45, 0.3))
    sharp = ramp(properties.sharp / shown, 0.15, 0.25)
    return min(lines, sharp, ramp(width, 0.16, 0.22), 1.0 - panel, told(region))


def _strong(region: Region) -> float:
    """Whether a region is as dark as water, and no shade of concrete is."""
    return ramp(min(region.contrast / STRONG_CONTRAST, region.drop_mean / STRONG_DROP), 0.8, 1.0)


def _stripe(shape: Shape, straight: float) -> float:
    """A painted stripe: a band along the tunnel, straight and as wide at its ends; water along a joint keeps to no edge."""
    neat = min(
        ramp(shape.deviation_box, straight, 0.6 * straight),
        ramp(shape.rectangularity, 0.85, 0.93),
        ramp(shape.corners, 0.4, 0.7),
    )
    # Ragged ones are as long as no leak along the tunnel.
    long = min(ramp(shape.along, 2.0, 2.5), ramp(shape.deviation_along, 2.0 * straight, straight))
    return min(ramp(shape.aspect_ratio, 6.0, 10.0), max(neat, long))


def _shadow(region: Region, shape: Shape) -> float:
    """A narrow band beside a cable or a pipe; or what shows between appendages and ends nowhere on dry lining."""
    properties = region.properties
    beside = properties.perimeter_off / properties.perimeter if properties.perimeter else 0.0
    return max(min(ramp(beside, 0.25, 0.45), ramp(shape.width, 0.14, 0.08)), ramp(beside, 0.8, 0.9))


def told(region: Region) -> float:
    """Whether enough profiles show a region to tell how straight it is: 1 where they lie as close as pixels."""
    return ramp(region.mask.shape[1] * region.pixel / region.spacing, FEW_PROFILES, MANY_PROFILES) if region.spacing else 1.0


def _straight(region: Region) -> float:
    """Standard deviation up to which sides are straight, m."""
    return STRAIGHT * _coarseness(region)


def _coarseness(region: Region) -> float:
    """How much larger the pixels are than those for which the limits hold in metres; 1 if they are not."""
    return max(1.0, region.pixel / RESOLVED)


def ramp(value: float, none: float, full: float) -> float:
    """From 0 at ``none`` to 1 at ``full``, whichever is the greater."""
    return min(max((float(value) - none) / (full - none), 0.0), 1.0)
