"""Drawn regions: labels, plates and painted bands are part of the design of a surface.

Their outline is a triangle or quadrilateral with straight edges, and they are as even as the surface. Rust and damp end on
straight edges only where the face itself ends. So a drawn region lies within its face, or goes around a pipe, or is one of
several of the same width and contrast. Parts flush with the face and seams are of the design, too; see `parts`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import rasterio.features
import shapely
from scipy import ndimage

from tunneldb.arrays import Bool, Float, Single
from tunneldb.robust import MAD_TO_SIGMA
from tunneldb.structures.cuts import cuts_of
from tunneldb.structures.parts import REACH, is_attached, is_seam
from tunneldb.structures.results import LeftOut
from tunneldb.structures.solidity import closed

MAX_DEVIATION = 0.5
"""Maximum mean deviation of a drawn outline from straight sides, pixels: an edge can lie anywhere in a pixel."""

MIN_ELLIPSE_RATIO = 2.0
"""Minimum ratio of the deviation from an ellipse to that from straight sides: small regions resemble both."""

MAX_SCATTER = 1.1
"""Maximum scatter within a drawn region, in standard deviations of the surface: it is as even."""

MIN_FREE = 0.9
"""Minimum share of the outline of a single drawn region that lies within the face."""

MIN_FREE_OF_RING = 1.0 / 3.0
"""The same of a ring around a pipe, whose ends are the rims of what is seen."""

RING = 0.85
"""Minimum share of a pipe's seen pixels, along a region, that a ring covers."""

MAX_BLUR = 0.35
"""Maximum loss of contrast beside a drawn edge: at an edge anywhere in a pixel, a quarter on the average."""

MAX_UNEVEN_BLUR = 0.5
"""The same of an uneven label: an edge in the middle of a pixel loses half."""

MIN_REPEATED, ALIKE = 3, 0.15
"""Minimum number of like regions of one width that are a design, and their maximum difference in contrast."""

MIN_CORE = 9
"""Minimum number of inner pixels for the scatter; with fewer all count."""

CORNERS = (3, 4)

MAX_TURN_ERROR = 10.0
"""Maximum deviation of the angles of a label from those of a rectangle or an equilateral triangle, degrees."""

ROUNDS = 3
"""Number of fits of the sides."""

Design = Literal["label", "band", "part", "seam"]
"""Kinds of drawn regions: a label, plate or window lies within its face; a band goes around a pipe or repeats; a part is
attached to the rim of its face; a seam is a straight line."""


@dataclass(frozen=True)
class Patch:
    """A region of a face.

    Attributes
    ----------
    mask : (rows, columns) bool array
    pixel : float
        Side of a pixel, m.
    free : float
        Share of its outline within the judged part of the face.
    ring : bool
        True if it goes around a pipe, as far as that is seen.
    level, scatter : float
        Median contrast within it, positive if darker, and standard deviation, dB.
    sigma : float
        Standard deviation of a pixel of the surface, dB.
    blur : float
        Loss of contrast beside its edge: the sum of both sides, in the contrast within it.
    cuts : int
        Number of straight lines that cut it off its face; see `cuts`.
    pipe : bool
        True on a pipe.
    attached, seam : bool
        True if it lies beyond the rim of its face, or is a part of a straight line; see `parts`.
    """

    mask: Bool
    pixel: float
    free: float
    ring: bool
    level: float
    scatter: float
    sigma: float
    blur: float
    cuts: int
    pipe: bool = False
    attached: bool = False
    seam: bool = False

    @property
    def even(self) -> bool:
        """True if it is as even as the surface."""
        return self.scatter <= (MAX_SCATTER + 1.5 / np.sqrt(self.mask.sum())) * self.sigma

    @property
    def stray(self) -> bool:
        """True if its pixels scatter more than they differ: points of other objects, which have no level of their own."""
        return self.scatter >= abs(self.level)


def drawn(patches: list[Patch]) -> list[Design | None]:
    """Return the kind of each drawn region of a surface; None for the others."""
    found = [_alone(patch) for patch in patches]
    widths = [_width(patch.mask) for patch in patches]
    out: list[Design | None] = []
    for one, width, (straight, alone) in zip(patches, widths, found, strict=True):
        like = straight and sum(
            _alike(one, other, width, wide) for other, wide, (fits, _) in zip(patches, widths, found, strict=True) if fits
        )
        out.append(alone or ("band" if like >= MIN_REPEATED else None))
    paint = [patch.level for patch, kind in zip(patches, out, strict=True) if kind == "band"]
    return [
        kind or ("band" if not patch.stray and _of_paint(patch.level, paint) else None)
        for patch, kind in zip(patches, out, strict=True)
    ]


def _alone(patch: Patch) -> tuple[bool, Design | None]:
    """Return True if a region is even and has straight sides, and what it is by itself."""
    if patch.seam or patch.attached:
        return False, "seam" if patch.seam else "part"
    straight, round_, regular = deviations(patch.mask)
    clear = round_ >= max(MIN_ELLIPSE_RATIO * straight, MAX_DEVIATION)
    # Glass, displays and print scatter more than paint, so a clear rectangle needs not be even.
    sharp = patch.blur <= (MAX_BLUR if patch.even else MAX_UNEVEN_BLUR)
    if clear and sharp and regular <= MAX_DEVIATION and patch.free >= MIN_FREE:
        return patch.even, "label"
    around = patch.ring and patch.free >= MIN_FREE_OF_RING and patch.cuts == 1
    if patch.even and sharp and (around or (patch.pipe and patch.cuts == 2)):
        return True, "band"
    return patch.even and straight <= MAX_DEVIATION, None


def _of_paint(level: float, bands: list[float]) -> bool:
    """Return True if a region has the contrast of several bands: a part of one, as at the end of a pipe or behind a cable."""
    return sum(abs(level - other) <= ALIKE * max(abs(level), abs(other)) for other in bands) >= MIN_REPEATED


def left_out(patches: Iterable[Patch], kinds: Iterable[Design | None]) -> LeftOut:
    """Count regions that are drawn or stray."""
    count = Counter(kind or ("stray" if patch.stray else None) for patch, kind in zip(patches, kinds, strict=True))
    return LeftOut(count["label"], count["band"], count["stray"], count["part"], count["seam"])


def _width(mask: Bool) -> float:
    """Return the width of the smallest rectangle about a mask, pixels."""
    row, column = np.nonzero(mask)
    corners = shapely.box(column, row, column + 1.0, row + 1.0)
    ring = shapely.get_coordinates(shapely.minimum_rotated_rectangle(shapely.multipolygons(corners).convex_hull))
    return float(np.hypot(*np.diff(ring[:3], axis=0).T).min())


def _alike(one: Patch, other: Patch, width: float, wide: float) -> bool:
    """Return True if two regions have one width and contrast."""
    near = abs(width * one.pixel - wide * other.pixel) <= max(one.pixel, 0.1 * width * one.pixel)
    return near and abs(one.level - other.level) <= ALIKE * max(abs(one.level), abs(other.level))


def patch_of(
    mask: Bool, corner: tuple[int, int], pixel: float, drop: Single, judged: Bool, sigma: float, *, pipe: bool
) -> Patch:
    """Measure a region of a face.

    Parameters
    ----------
    mask : (rows, columns) bool array
    corner : (int, int)
        Its first row and column on the face.
    pixel : float
        Side of a pixel, m.
    drop : (rows, columns) float32 array
        Contrast of the face, dB.
    judged : (rows, columns) bool array
    sigma : float
        Standard deviation of a pixel, dB.
    pipe : bool
        True if columns follow the axis of a pipe.
    """
    (row, column), (rows, columns) = corner, mask.shape
    box = (slice(row, row + rows + 4), slice(column, column + columns + 4))
    wide, within = np.pad(mask, 2), np.pad(closed(judged, 2), 2)[box]
    known, value = np.pad(judged, 2)[box], np.pad(drop, 2)[box]
    outside, core = ndimage.binary_dilation(wide) & ~wide, ndimage.binary_erosion(wide)
    rim = wide & ~core
    if (core & known).sum() < MIN_CORE:
        core = wide
    inner = value[core & known]
    level = float(np.median(inner)) if len(inner) else 0.0
    scatter = MAD_TO_SIGMA * float(np.median(np.abs(inner - level))) if len(inner) else np.inf
    beside = judged[:, column : column + columns]
    ring = pipe and float((beside[row : row + rows] & mask).sum()) >= RING * float(beside.sum())
    free = float(within[outside].mean())
    edges = [value[side & known] for side in (rim, outside)]
    blur = 1.0 - float(np.median(edges[0]) - np.median(edges[1])) / level if level and all(map(len, edges)) else np.inf
    region, near, contrast = _around(mask, corner, judged, drop)
    seam = is_seam(region, contrast if level >= 0.0 else -contrast, near)
    return Patch(
        mask, pixel, free, ring, level, scatter, sigma, blur, cuts_of(wide, within), pipe, is_attached(region, near), seam
    )  # fmt: skip


def _around(mask: Bool, corner: tuple[int, int], judged: Bool, drop: Single) -> tuple[Bool, Bool, Single]:
    """Return a region, and the judged pixels and contrast of its face around it, all with a margin of `REACH`."""
    box = tuple(slice(at, at + size + 2 * REACH) for at, size in zip(corner, mask.shape, strict=True))
    return np.pad(mask, REACH), np.pad(judged, REACH)[box], np.pad(drop, REACH)[box]


def deviations(mask: Bool) -> tuple[float, float, float]:
    """Return the mean deviation of a region's outline from three shapes, pixels.

    The shapes are the best triangle or quadrilateral, an ellipse, and the best equilateral triangle or rectangle.
    """
    filled = ndimage.binary_fill_holes(np.pad(mask, 1))
    parts = [shapely.geometry.shape(s) for s, _ in rasterio.features.shapes(filled.astype(np.uint8), mask=filled)]
    region = max(parts, key=lambda part: part.area)
    shapes = [shape for corners in _corners(region) if (shape := _fitted(region, corners)) is not None]
    best = min((_deviation(region, shape) for shape in shapes), default=np.inf)
    regular = min((_deviation(region, shape) for shape in shapes if _is_regular(shape)), default=np.inf)
    return best, _deviation(region, _ellipse(filled)), regular


def _is_regular(shape: shapely.Polygon) -> bool:
    """Return True if all angles are equal, as of plates and warning signs; flakes of paint have any angles."""
    sides = np.diff(shapely.get_coordinates(shape), axis=0)
    sides /= np.hypot(*sides.T)[:, None]
    turn = np.degrees(np.arccos(np.clip(np.einsum("ni,ni->n", sides, np.roll(sides, -1, axis=0)), -1.0, 1.0)))
    return bool(np.abs(turn - 360.0 / len(sides)).max() <= MAX_TURN_ERROR)


def _deviation(region: shapely.Polygon, shape: shapely.Polygon) -> float:
    return float(region.symmetric_difference(shape).area / shape.length)


def _corners(region: shapely.Polygon) -> list[Float]:
    """Return first corners (n, 2) of shapes: of the smallest rectangle, and of the outline with few corners."""
    found = [shapely.get_coordinates(shapely.minimum_rotated_rectangle(region))[:-1]]
    hull = region.convex_hull
    for count in CORNERS:
        tolerance = 0.5
        while tolerance < np.sqrt(region.area):
            ring = shapely.get_coordinates(hull.simplify(tolerance))[:-1]
            if len(ring) <= count:
                break
            tolerance *= 1.2
        if len(ring) == count:
            found.append(ring)
    return [corners for corners in found if len(corners) in CORNERS]


def _fitted(region: shapely.Polygon, corners: Float) -> shapely.Polygon | None:
    """Fit each side to the part of the outline nearest to it."""
    outline = shapely.get_coordinates(shapely.segmentize(region.exterior, 0.5))
    for _ in range(ROUNDS):
        ends = np.roll(corners, -1, axis=0)
        along = ends - corners
        length = np.hypot(*along.T)
        if length.min() < 1.0:
            return None
        along /= length[:, None]
        off = outline[:, None] - corners[None]
        place = np.einsum("nsi,si->ns", off, along)
        across = off[:, :, 0] * along[:, 1] - off[:, :, 1] * along[:, 0]
        beyond = np.maximum(np.maximum(-place, place - length), 0.0)
        nearest = np.argmin(np.hypot(across, beyond), axis=1)
        lines = []
        for side in range(len(corners)):
            inner = (nearest == side) & (place[:, side] > 0.1 * length[side]) & (place[:, side] < 0.9 * length[side])
            lines.append(_line(outline[inner]))
        if any(line is None for line in lines):
            return None
        crossed = [_crossing(lines[side - 1], lines[side]) for side in range(len(lines))]
        if any(point is None for point in crossed):
            return None
        corners = np.array(crossed)
    shape = shapely.Polygon(corners)
    return shape if shape.is_valid and shape.area > 0.0 else None


def _line(points: Float) -> tuple[Float, Float] | None:
    """Return middle and direction of a line through points (n, 2)."""
    if len(points) < 3:
        return None
    middle = points.mean(axis=0)
    return middle, np.linalg.svd(points - middle, full_matrices=False)[2][0]


def _crossing(one: tuple[Float, Float] | None, other: tuple[Float, Float] | None) -> Float | None:
    if one is None or other is None:
        return None
    matrix = np.column_stack([one[1], -other[1]])
    if abs(np.linalg.det(matrix)) < 0.1:
        return None
    return np.asarray(one[0] + np.linalg.solve(matrix, other[0] - one[0])[0] * one[1])


def _ellipse(mask: Bool) -> shapely.Polygon:
    """Return the ellipse with the area and moments of a mask."""
    row, column = np.nonzero(mask)
    at = np.column_stack([column, row]) + 0.5
    middle = at.mean(axis=0)
    spread = np.cov((at - middle).T, bias=True) + np.eye(2) / 12.0
    values, axes = np.linalg.eigh(spread)
    half = 2.0 * np.sqrt(values)
    half *= np.sqrt(len(at) / (np.pi * half.prod()))
    angle = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
    return shapely.Polygon(middle + (half * np.column_stack([np.cos(angle), np.sin(angle)])) @ axes.T)
