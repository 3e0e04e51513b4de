"""Features of a dark region as evidence for or against water: contrast, rim, shape and surroundings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely
from scipy.spatial import cKDTree

from tunneldb.anomalies.degrees import degrees_of, ramp
from tunneldb.anomalies.region_shape import Shape, measure_shape
from tunneldb.anomalies.regions import Region
from tunneldb.arrays import Bool, Float


class Feature(NamedTuple):
    """Feature of a region.

    Attributes
    ----------
    name : str
    reason : str
        Kind of evidence: features with the same reason are summed in a verdict.
    meaning : str
        Meaning, with the unit.
    """

    name: str
    reason: str
    meaning: str


DEGREES = {
    "thin": "like a joint",
    "recess": "like a bolt pocket",
    "gradual": "as if it faded out",
    "rectangular": "like something with straight sides",
    "stripe": "like a painted stripe",
    "shadow": "like the shadow of a fixture",
}
"""Degrees of :mod:`tunneldb.anomalies.degrees`; each is its own reason."""

FEATURES = (
    Feature("contrast", "faint", "mean drop, standard deviations of dry lining"),
    Feature("drop", "faint", "mean drop, dB"),
    Feature("area", "small", "area, m², as a logarithm"),
    Feature("mean_width", "thin", "area over the greater extent, m, as a logarithm"),
    Feature("width", "thin", "diameter of the largest inscribed circle, m, as a logarithm"),
    Feature("elongation", "thin", "greater extent over mean width, as a logarithm"),
    Feature("waviness", "thin", "standard deviation of the long sides about straight lines, m"),
    Feature("line", "thin", "degree to which it is as narrow, long and straight as a joint, 0 to 1"),
    Feature("recess", "recess", "share of its pixels set back behind the wall"),
    Feature("recess_rim", "recess", "share of its sides that face lining set back behind the wall"),
    Feature("step", "gradual", "drop 6 cm inside less that 6 cm outside, over the mean drop"),
    Feature("far_step", "gradual", "drop 6 cm inside less that 20 cm outside, over the mean drop"),
    Feature("uneven", "gradual", "standard deviation of the drop over its mean"),
    Feature("straight", "rectangular", "share of the sharp sides on four lines along and around the tunnel"),
    Feature("sharp", "rectangular", "share of its sides that are sharp"),
    Feature("box", "rectangular", "share that it fills of its box without what sticks out"),
    Feature("corners", "rectangular", "share that it fills of the emptiest corner of that box"),
    Feature("turned_box", "rectangular", "share that it fills of the smallest rectangle of any direction"),
    Feature("aspect", "stripe", "length of the box along the tunnel over its width, as a logarithm"),
    Feature("box_waviness", "stripe", "standard deviation of the sides of the box about straight lines, m"),
    Feature("beside", "shadow", "share of its sides that face a fixture or the floor"),
    Feature("beneath", "shadow", "share of its sides that face a fixture above"),
    Feature("ragged", "shape", "perimeter over that of a circle of the same area, as a logarithm"),
    Feature("taper", "shape", "how far its middle lies above that of its extent, in parts of this"),
    Feature("upright", "shape", "extent around the tunnel over that along it, as a logarithm"),
    Feature("bright_rim", "salts", "share of its rim with lining brighter than dry lining is by chance"),
    Feature("water", "picture", "mean probability of water by the segmentation network"),
    Feature("certain", "picture", "share of its pixels that the network is certain are wet, by 0.9 and more"),
    Feature("foot", "foot", "share of its sides that face the floor"),
    Feature("support", "small", "pixels that were measured, as a logarithm"),
    Feature("alike", "repeated", "number of similar regions within 5 m along the tunnel, as a logarithm: built objects repeat"),
    *(Feature(f"{name}_degree", name, f"degree to which it looks {look}, 0 to 1") for name, look in DEGREES.items()),
)
"""Features in the order of `measure_features`."""


NAMES = tuple(feature.name for feature in FEATURES)

SIMILARITY_LIMITS = {"mean_width": 0.3, "drop": 0.3, "upright": 0.8}
"""Maximum differences of these features, as logarithms, between similar regions."""

SIMILARITY_RANGE = 5.0
"""Maximum distance along the tunnel of regions that are compared with each other, m."""

CHANCE_COUNT = 4
"""Number of similar regions that occurs by chance; built objects repeat more often."""


def measure_regions(regions: Sequence[Region]) -> Float:
    """Measure the dark regions of a kilometre, each by itself, and count similar ones.

    Returns
    -------
    (n, len(FEATURES)) float array
        NaN for features that cannot be measured.
    """
    features = np.array([measure_features(region) for region in regions]).reshape(len(regions), len(FEATURES))
    if len(regions):
        values = {name: features[:, NAMES.index(name)] for name in SIMILARITY_LIMITS}
        values["drop"] = np.log(np.maximum(values["drop"], 0.1))
        chainage = np.array([0.5 * (region.column + region.stop) * region.pixel for region in regions])
        places = np.column_stack(
            [chainage / SIMILARITY_RANGE, *(values[name] / width for name, width in SIMILARITY_LIMITS.items())]
        )
        alike = cKDTree(places).query_ball_point(places, 1.0, p=np.inf, return_length=True) - 1
        features[:, NAMES.index("alike")] = np.log1p(np.maximum(alike - CHANCE_COUNT, 0))
    return features


def measure_features(region: Region) -> Float:
    """Measure a region by itself.

    Returns
    -------
    (len(FEATURES),) float array
        NaN for features that cannot be measured, and for those that need other regions.
    """
    shape = measure_shape(region.mask, region.pixel)
    degrees = degrees_of(region, shape)
    measures = *_contrast(region), *_extent(shape), *_recess(region), *_rim(region, shape), *_place(region, shape)
    return np.array([*measures, math.log(max(region.measured, 1)), math.nan, *(degrees[name] for name in DEGREES)])


def _contrast(region: Region) -> tuple[float, float]:
    return region.contrast, region.darkening_mean


def _extent(shape: Shape) -> tuple[float, ...]:
    deviation = shape.deviation_along if shape.along > shape.across else shape.deviation_across
    sizes = shape.area, shape.mean_width, max(shape.width, 1e-3), shape.length / shape.mean_width
    elongation = shape.length / shape.mean_width
    line = min(ramp(shape.mean_width, 0.12, 0.06), ramp(elongation, 4.0, 8.0), ramp(deviation, 0.04, 0.02))
    return *map(math.log, sizes), deviation, line


def _recess(region: Region) -> tuple[float, float]:
    properties = region.properties
    return properties.recess / np.count_nonzero(region.mask), _ratio(properties.perimeter_recess, properties.perimeter)


def _rim(region: Region, shape: Shape) -> tuple[float, ...]:
    properties, mean = region.properties, max(region.darkening_mean, 1e-6)
    inside, outside = _ratio(properties.inside, properties.steps), _ratio(properties.outside, properties.steps)
    far = _ratio(properties.far_outside, properties.far_steps)
    variance = properties.darkening_square / region.filled - region.darkening_mean**2
    shown = properties.perimeter - properties.perimeter_off
    return (
        (inside - outside) / mean, (inside - far) / mean, math.sqrt(max(variance, 0.0)) / mean,
        _ratio(properties.straight, properties.sharp), _ratio(properties.sharp, shown),
        shape.rectangularity, shape.corners, _turned_box(region.mask),
        math.log(shape.aspect_ratio), shape.deviation_box,
    )  # fmt: skip


def _place(region: Region, shape: Shape) -> tuple[float, ...]:
    properties = region.properties
    return (
        _ratio(properties.perimeter_off, properties.perimeter), _ratio(properties.off_above, properties.perimeter),
        math.log(_perimeter(region.mask) * region.pixel / (2.0 * math.sqrt(math.pi * shape.area))),
        _taper(region), math.log(shape.across / shape.along),
        _ratio(properties.bright, properties.steps),
        _ratio(properties.water, properties.judged), _ratio(properties.certain, properties.judged),
        _ratio(properties.floor, properties.perimeter),
    )  # fmt: skip


def _perimeter(mask: Bool) -> int:
    """Count the pixel sides on the outline of a mask and of its holes."""
    padded = np.pad(mask, 1)
    return sum(int(np.count_nonzero(np.diff(padded, axis=axis))) for axis in (0, 1))


def _turned_box(mask: Bool) -> float:
    """Return the share that a mask fills of the smallest rotated rectangle around it."""
    edge = mask & ~_eroded(mask)
    row, column = np.nonzero(edge)
    corners = np.concatenate([np.column_stack([column + x, row + y]) for x in (0, 1) for y in (0, 1)])
    box = shapely.minimum_rotated_rectangle(shapely.multipoints(corners))
    return float(np.count_nonzero(mask) / box.area)


def _eroded(mask: Bool) -> Bool:
    """Return the pixels whose four neighbours are all set."""
    padded = np.pad(mask, 1)
    return padded[2:, 1:-1] & padded[:-2, 1:-1] & padded[1:-1, 2:] & padded[1:-1, :-2]


def _taper(region: Region) -> float:
    """Return the height of the area's middle above that of its extent, relative to it; water is wider at its top."""
    counts = np.count_nonzero(region.mask, axis=1)
    rows = len(counts)
    middle = (np.arange(rows) + 0.5) @ counts / counts.sum()
    up = -1.0 if region.row + 0.5 * rows >= 0.0 else 1.0  # rows increase with the arc, which is 0 at the crown
    return float(up * (middle / rows - 0.5))


def _ratio(part: float, whole: float) -> float:
    return part / whole if whole else math.nan
