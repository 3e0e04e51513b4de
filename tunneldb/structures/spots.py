"""Spots from the contrast of a face: both tails, median filter, boundary, regions, verdict (Ono et al., 3.4)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy import ndimage
from shapely.geometry import Polygon

from tunneldb.anomalies.boundary import refine_boundary
from tunneldb.anomalies.degrees import degrees_of
from tunneldb.anomalies.region_shape import measure_shape
from tunneldb.anomalies.regions import Region, find_regions
from tunneldb.anomalies.threshold import filter_size, seen_lining
from tunneldb.arrays import Bool, Int32, Single
from tunneldb.raster.geotiff import NODATA
from tunneldb.raster.state import PixelState
from tunneldb.structures.contrast import FaceContrast
from tunneldb.structures.drawn import drawn, left_out, patch_of
from tunneldb.structures.face_raster import STEP
from tunneldb.structures.results import LeftOut
from tunneldb.structures.significance import Scatter, significance

MIN_SPOT_AREA = 0.0016
"""Minimum area of a spot, m²: 4 cm × 4 cm."""

MIN_SPOT_POINTS = 30
"""Minimum number of points of a spot."""

MIN_FACE_POINTS = 150
"""Minimum number of points of a face: the smallest spot would be a fifth of it."""

RIM = 0.75
"""Share of a region along the face's own edge from which it is an effect of the beam there."""

SPREAD = 3.0
"""Standard deviations from which windows beside a spot belong to it (Ono et al., 3.4): few are tested there."""

SMOOTHED = 5
"""Side of the window whose mean must exceed half of the contrast of a spot to belong to it, pixels."""

BIMODAL = 0.5
"""Share of the surface that differs from which it is uncertain which part is the surface itself."""

_KINDS: tuple[tuple[Literal["dark", "bright"], int], ...] = (("dark", 1), ("bright", -1))

_REASONS = ("thin", "gradual", "rectangular")


@dataclass(frozen=True)
class FoundSpot:
    """A region of a face that differs from it; see `results.Spot`."""

    kind: Literal["dark", "bright"]
    reasons: tuple[str, ...]
    confidence: float
    contrast: float
    difference: float
    area: float
    points: int
    scans: int
    outline: Polygon
    mask: Bool
    corner: tuple[int, int]


@dataclass(frozen=True)
class FaceSpots:
    """Spots of a face.

    Attributes
    ----------
    spots : list of FoundSpot
    numbers : (rows, columns) int32 array
        Number of the spot in each pixel, rows upwards, from 1; 0 is none.
    share : float
        Share of the pixels judged that are in spots.
    seen : int
        Pixels that are known to differ or not: with contrast, or with enough contrast around them.
    size : int
        Size of the median filter, pixels.
    ratio, broad : (rows, columns) float32 arrays or None
        Significance, rows downwards; see `significance`.
    """

    spots: list[FoundSpot]
    numbers: Int32
    share: float
    seen: int
    size: int = 1
    ratio: Single | None = None
    broad: Single | None = None


def find_spots(face: FaceContrast, pixels: int, scatter: Scatter) -> FaceSpots:
    """Find spots that differ from a face's own level, darker or brighter.

    Parameters
    ----------
    face : FaceContrast
    pixels : int
        Number of pixels with points of all faces of the structure.
    scatter : Scatter
        Scatter of the faces before.
    """
    numbers = np.zeros(face.face.shape, np.int32)
    judged = int(face.judged.sum())
    if not judged or face.points[face.judged].sum() < MIN_FACE_POINTS:
        return FaceSpots([], numbers, 0.0, 0)
    has_contrast = face.image.state == PixelState.LINING
    ratio, broad = significance(_contrast(face), has_contrast, face.image.sigma, pixels, scatter)
    empty = int((face.image.state == PixelState.EMPTY).sum())
    size = filter_size(judged / (judged + empty))
    found = [spot for kind, sign in _KINDS for spot in _outlined(face, kind, sign * ratio > 1.0, ratio, size)]
    return numbered(face, found, size, ratio, broad)


def extended(face: FaceContrast, spots: FaceSpots) -> FaceSpots:
    """Extend the spots of a face to what differs around them, and combine those that are then connected.

    The limit of a whole structure finds a weak spot only where it is strongest. Beside a spot few windows are tested.
    """
    if not spots.spots or spots.ratio is None or spots.broad is None:
        return spots
    found: list[FoundSpot] = []
    smooth = _smooth(face)
    for kind, sign in _KINDS:
        of_kind = [spot for spot in spots.spots if spot.kind == kind]
        seeds, marked = np.zeros(face.face.shape, np.bool_), np.zeros(face.face.shape, np.bool_)
        for spot in of_kind:
            seed = np.zeros(face.face.shape, np.bool_)
            seed[_box(spot)] = spot.mask
            beside = (sign * spots.broad > SPREAD) & (sign * smooth > 0.5 * spot.difference)
            marked |= ndimage.binary_propagation(seed, mask=seed | beside[::-1])
            seeds |= seed
        wider = _outlined(face, kind, marked[::-1], spots.ratio, spots.size)
        found += [spot for spot in wider if (seeds[_box(spot)] & spot.mask).any()]
    return numbered(face, found, spots.size, spots.ratio, spots.broad)


def _smooth(face: FaceContrast) -> Single:
    """Return the mean contrast about each pixel, dB, rows downwards."""
    has_contrast = face.image.state == PixelState.LINING
    count = ndimage.uniform_filter(has_contrast.astype(np.float32), SMOOTHED, mode="constant")
    return np.asarray(ndimage.uniform_filter(_contrast(face), SMOOTHED, mode="constant") / np.maximum(count, 1e-3))


def _contrast(face: FaceContrast) -> Single:
    """Return the contrast of each pixel, dB, rows downwards; 0 where it has none."""
    has_contrast = face.image.state == PixelState.LINING
    return np.where(has_contrast, face.image.drop, np.int16(0)) * np.float32(STEP)


def _outlined(face: FaceContrast, kind: Literal["dark", "bright"], marked: Bool, ratio: Single, size: int) -> list[FoundSpot]:
    """Return the spots of a kind from the pixels (rows downwards) that differ."""
    marked = marked & (face.image.state != PixelState.OFF)
    if not marked.any():
        return []
    image = face.image
    if kind == "bright":
        image = replace(image, drop=np.where(image.drop == NODATA, np.int16(NODATA), -image.drop).astype(np.int16))
        ratio = -ratio
    marked = refine_boundary(marked, image, size)
    rim = face.face & ~ndimage.binary_erosion(face.face, np.ones((3, 3), np.bool_), iterations=2)
    regions = find_regions(marked, marked, image, MIN_SPOT_AREA, None)
    judged = [_judge(region, kind, face, ratio[::-1], rim) for region in regions]
    return [spot for spot in judged if spot is not None]


def numbered(face: FaceContrast, found: list[FoundSpot], size: int, ratio: Single | None, broad: Single | None) -> FaceSpots:
    """Write the numbers of the spots of a face into its pixels."""
    numbers = np.zeros(face.face.shape, np.int32)
    for number, spot in enumerate(found, start=1):
        part = numbers[_box(spot)]
        part[spot.mask & (part == 0)] = number
    _over_rim(face, numbers, found)
    share = float((numbers[face.judged] > 0).mean())
    seen = sum(int(np.count_nonzero(part)) for _, part in seen_lining(face.image.state, size))
    return FaceSpots(found, numbers, share, seen, size, ratio, broad)


def without_design(
    faces: list[tuple[FaceContrast, FaceSpots]], *, pipe: bool
) -> tuple[list[tuple[FaceContrast, FaceSpots]], LeftOut]:
    """Leave out the drawn regions of the faces of a surface, and stray points; count them."""
    patches = []
    for face, spots in faces:
        drop = _contrast(face)[::-1]
        pixel = face.image.grid.pixel
        patches += [patch_of(spot.mask, spot.corner, pixel, drop, face.judged, face.sigma, pipe=pipe) for spot in spots.spots]
    kinds = drawn(patches)
    kept = iter([kind is None and not patch.stray for patch, kind in zip(patches, kinds, strict=True)])
    out = []
    for face, spots in faces:
        rest = [spot for spot in spots.spots if next(kept)]
        same = len(rest) == len(spots.spots)
        out.append((face, spots if same else numbered(face, rest, spots.size, spots.ratio, spots.broad)))
    return out, left_out(patches, kinds)


def _judge(
    region: Region, kind: Literal["dark", "bright"], face: FaceContrast, limit_ratio: Single, rim: Bool
) -> FoundSpot | None:
    """Classify a region; return None if it is nothing."""
    if not region.filled:
        return None
    grid = face.image.grid
    corner = (region.row - grid.bottom, region.column - grid.first_column)
    box = tuple(slice(at, at + size) for at, size in zip(corner, region.mask.shape, strict=True))
    points = int(face.points[box][region.mask].sum())
    if points < MIN_SPOT_POINTS:
        return None
    shape = measure_shape(region.mask, region.pixel)
    degrees = degrees_of(region, shape)
    along = float(rim[box][region.mask].mean())
    if along > RIM and not rim[face.judged].mean() > 0.5:
        return None
    reasons = sorted((name for name in _REASONS if degrees[name] > 0.5), key=lambda name: -degrees[name])
    seen = int(np.bitwise_or.reduce(face.scans[box][region.mask]))
    return FoundSpot(
        kind,
        tuple(reasons),
        1.0 - 0.5 * float(np.exp(1.0 - max(limit_ratio[box][region.mask].max(), 1.0))),
        region.contrast,
        region.darkening_mean,
        region.area,
        points,
        seen.bit_count(),
        region.outline,
        region.mask,
        corner,
    )


def _box(spot: FoundSpot) -> tuple[slice, slice]:
    (row, column), (rows, columns) = spot.corner, spot.mask.shape
    return slice(row, row + rows), slice(column, column + columns)


def _over_rim(face: FaceContrast, numbers: Int32, found: list[FoundSpot]) -> None:
    """Extend spots over the face's rim, which has no contrast, to the nearest of it."""
    off = face.image.state[::-1] == PixelState.OFF
    if not found or not face.rim or off.all():
        return
    row, column = ndimage.distance_transform_edt(off, return_distances=False, return_indices=True)
    left = face.face & off & (face.points > 0)
    numbers[left] = numbers[row[left], column[left]]
