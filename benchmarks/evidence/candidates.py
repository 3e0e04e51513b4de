"""Dark regions of known tunnels: their features, and which are leaks in truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from benchmarks.blind.run import Outcome
from tunneldb.anomalies.background.relate import relate
from tunneldb.anomalies.detect import find_dark, find_dark_regions, is_large_enough
from tunneldb.anomalies.features import measure_regions
from tunneldb.raster.image import LiningImage
from tunneldb.segmentation.network import Network

MOSTLY = 0.5
"""A region is a leak if so much of its area is wet."""

LEAST = 0.05
"""Minimum area of a region, m²: ``leak.min_area``; for joints see :data:`tunneldb.anomalies.detect.MIN_JOINT_LENGTH`."""


@dataclass(frozen=True)
class Candidates:
    """Dark regions of one tunnel.

    Attributes
    ----------
    scene, family : str
        Where from; generators of scenes are families.
    features : (n, features) float array
    leak : (n,) bool array
        Which of them are leaks.
    """

    scene: str
    family: str
    features: NDArray[np.float64]
    leak: NDArray[np.bool_]


def candidates(family: str, picture: LiningImage, truth: Outcome, network: Network | None) -> Candidates:
    """Find the dark regions of a tunnel, and hold them against the truth; those on leaks that can't be told are left out."""
    picture = LiningImage(picture.grid, picture.state, picture.level.copy(), picture.gaps)
    _, contrast = relate(picture, [], network)
    dark = find_dark(contrast)
    wet = shapely.union_all(truth.true)
    dim = shapely.union_all([shape for shape, limit in zip(truth.true, truth.limits, strict=True) if limit])
    features, leak = [], []
    regions = [region for region in find_dark_regions(dark, contrast, LEAST) if is_large_enough(region, LEAST)]
    for region, measures in zip(regions, measure_regions(regions), strict=True):
        outline = region.outline
        if outline.intersection(dim).area >= MOSTLY * outline.area:
            continue
        features.append(measures)
        leak.append(outline.intersection(wet).area >= MOSTLY * outline.area)
    return Candidates(truth.scene, family, np.array(features).reshape(len(leak), -1), np.array(leak, np.bool_))


def together(parts: Sequence[Candidates]) -> tuple[NDArray[np.float64], NDArray[np.bool_], NDArray[np.object_]]:
    """Features of all regions, whether they are leaks, and the family of each."""
    families = np.concatenate([np.full(len(part.leak), part.family, dtype=object) for part in parts])
    held = [part.features for part in parts if len(part.leak)]
    return np.concatenate(held), np.concatenate([part.leak for part in parts]), families
