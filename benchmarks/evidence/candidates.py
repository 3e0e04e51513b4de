"""Dark regions of known tunnels: their features, and what they are in truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from benchmarks.blind.run import Outcome
from tunneldb.anomalies.background.contrast import contrast_image
from tunneldb.anomalies.background.level_map import map_background
from tunneldb.anomalies.detect import find_dark, find_dark_regions, may_count
from tunneldb.anomalies.features import NAMES, measure_regions
from tunneldb.raster.image import LiningImage

MOSTLY = 0.5
"""A region is what so much of its area is."""

LEAST = 0.05
"""Regions are judged from this size on, m²: ``leak.min_area``; joints from :data:`tunneldb.anomalies.detect.MIN_JOINT` on."""

LEAK, JOINT, DARK = range(3)
"""Numbers of the kinds; the model tells leaks from the other two."""


@dataclass(frozen=True)
class Candidates:
    """Dark regions of one tunnel.

    Attributes
    ----------
    scene, family : str
        Where from; generators of scenes are families.
    features : (n, features) float array
    kind : (n,) int array
        LEAK, JOINT or DARK.
    area : (n,) float array
        m².
    """

    scene: str
    family: str
    features: NDArray[np.float64]
    kind: NDArray[np.int64]
    area: NDArray[np.float64]


def candidates(family: str, picture: LiningImage, truth: Outcome) -> Candidates:
    """Find the dark regions of a tunnel, and hold them against the truth; those on leaks that can't be told are left out."""
    picture = LiningImage(picture.grid, picture.state, picture.level.copy(), picture.gaps)
    background = map_background(picture, [])
    contrast = contrast_image(picture, background)
    dark, _ = find_dark(contrast)
    wet = shapely.union_all(truth.true)
    dim = shapely.union_all([shape for shape, limit in zip(truth.true, truth.limits, strict=True) if limit])
    joints = shapely.union_all(
        [shape for shape, kind in zip(truth.other, truth.other_kinds, strict=True) if "joint" in kind and "wet" not in kind]
    )
    features, kinds, areas = [], [], []
    regions = [region for region in find_dark_regions(dark, contrast, LEAST) if may_count(region, LEAST)]
    for region, measures in zip(regions, measure_regions(regions), strict=True):
        outline = region.outline
        if outline.intersection(dim).area >= MOSTLY * outline.area:
            continue
        shares = [outline.intersection(shape).area / outline.area for shape in (wet, joints)]
        line = shares[1] >= MOSTLY or _is_line(measures)
        kinds.append(LEAK if shares[0] >= MOSTLY else JOINT if line else DARK)
        features.append(measures)
        areas.append(region.area)
    return Candidates(
        truth.scene, family, np.array(features).reshape(len(kinds), -1), np.array(kinds, np.int64), np.array(areas)
    )


def _is_line(features: NDArray[np.float64]) -> bool:
    """Whether a region is as narrow, long and straight as a joint: what is so, and dry, is called one."""
    return bool(features[NAMES.index("line")] >= 0.5)


def together(parts: Sequence[Candidates]) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.object_]]:
    """Features and kinds of all regions, and the family of each."""
    families = np.concatenate([np.full(len(part.kind), part.family, dtype=object) for part in parts])
    held = [part.features for part in parts if len(part.kind)]
    return np.concatenate(held), np.concatenate([part.kind for part in parts]), families
