"""Profiles: the sides of one beam or column, found by long edges that touch or are a flange apart.

A beam is slender, its sides run along it, and each has an edge on another side or, around a flange or a leg, opposite to one.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.cluster.hierarchy import DisjointSet

from tunneldb.arrays import Float, Int64
from tunneldb.structures.joining import COMMON_ANGLE, Extent, numbered
from tunneldb.structures.merging import ANGLE, MAX_DISTANCE_IN_SCAN
from tunneldb.structures.models import AXIS, RADIUS, to_space, unroll

SLENDER = 3.0
"""Minimum ratio of a beam's length to the depth of its section (EN 1992-1-1, 5.3.1)."""

MAX_SECTION_DEPTH = 1.2
"""Maximum depth of sections, m: the deepest rolled one has 1118 mm (EN 10365, HL 1100)."""

MAX_FLANGE_THICKNESS = 0.04
"""Maximum distance of edges of two sides, m: the thickest rolled flange (EN 10365, HE 1000 M)."""

OVERLAP = 0.5
"""Minimum overlap of the sides along the beam, as a share of the shorter one."""


@dataclass(frozen=True)
class Box:
    """The least rectangle about a flat surface.

    Attributes
    ----------
    middle, normal, along, across : (3,) float arrays
        m from the origin; unit directions, the second of its longer sides.
    length, width : float
        m.
    """

    middle: Float
    normal: Float
    along: Float
    across: Float
    length: float
    width: float

    @property
    def ends(self) -> Float:
        """Ends (2, 3) of its middle line."""
        return self.middle + np.multiply.outer(np.array([-0.5, 0.5]) * self.length, self.along)

    @property
    def corners(self) -> Float:
        """Its corners (4, 3)."""
        half = 0.5 * self.width * self.across
        return np.concatenate([self.ends - half, self.ends + half])


def box_of(surface: list[Extent]) -> Box:
    """Return the least rectangle about faces of one plane, in the plane of the first."""
    model = surface[0].model
    u, v, _ = unroll(model, places_of(surface))
    box = shapely.get_coordinates(shapely.minimum_rotated_rectangle(shapely.MultiPoint(np.column_stack([u, v]))))
    if len(box) < 5:  # all on a line
        box = np.array([[u.min(), v.min()], [u.max(), v.min()], [u.max(), v.max()], [u.min(), v.max()]])
    at = to_space(model, box[:4, 0], box[:4, 1])
    sides = at[1] - at[0], at[3] - at[0]
    sizes = [float(np.linalg.norm(side)) for side in sides]
    longer = int(sizes[1] > sizes[0])
    along = sides[longer] / max(sizes[longer], 1e-12)
    return Box(at.mean(axis=0), model[AXIS], along, np.cross(model[AXIS], along), sizes[longer], sizes[1 - longer])


def places_of(surface: list[Extent]) -> Float:
    """Return places (n, 3) along the outlines of faces, m from the origin."""
    found = []
    for extent in surface:
        at = shapely.get_coordinates(extent.outline)
        found.append(to_space(extent.model, at[:, 0], at[:, 1]))
    return np.concatenate(found)


def group(surfaces: list[list[Extent]], noise: float) -> Int64:
    """Return the member of each surface (n,): sides of one profile share one; numbered from 0 by the first of each.

    Parameters
    ----------
    surfaces : list of lists of Extent
        Faces of one plane or pipe each, the largest first.
    noise : float
        Standard deviation of ranges, m.
    """
    boxes = {number: box_of(surface) for number, surface in enumerate(surfaces) if surface[0].model[RADIUS] == 0.0}
    boxes = {
        number: box for number, box in boxes.items() if box.length >= SLENDER * box.width and box.width <= MAX_SECTION_DEPTH
    }
    found = DisjointSet(range(len(surfaces)))
    for a, b in _touching(boxes, max(MAX_DISTANCE_IN_SCAN, 3.0 * noise)):
        together = found.subset(a) | found.subset(b)
        if not found.connected(a, b) and _slender([boxes[number] for number in together]):
            found.merge(a, b)
    return numbered(found)


def middle_line(boxes: list[Box]) -> Float:
    """Return the line (2, 3) along the middle of a profile's section, from end to end of its sides."""
    frame, extent, section = _section(boxes)
    (x, y), (first, last) = section.mean(axis=0), extent
    return np.array([[first, x, y], [last, x, y]]) @ frame


def _slender(boxes: list[Box]) -> bool:
    """Return True if sides together are as long and as deep as a beam."""
    _, (first, last), section = _section(boxes)
    depth = float(np.linalg.norm(np.diff(section[:3], axis=0), axis=1).max())
    return depth <= MAX_SECTION_DEPTH and last - first >= SLENDER * depth


def _section(boxes: list[Box]) -> tuple[Float, Float, Float]:
    """Return the section of sides at right angles to the longest.

    Returns
    -------
    frame : (3, 3) float array
        Unit directions: along the longest side, across it, and out of it.
    extent : (2,) float array
        From where to where sides reach along the first, m.
    section : (k, 2) float array
        Corners of the least rectangle about them, along the other two, m; k is 4, or 2 where it is a line.
    """
    longest = max(boxes, key=lambda box: box.length)
    frame = np.array([longest.along, longest.across, longest.normal])
    at = np.concatenate([box.corners for box in boxes]) @ frame.T
    rectangle = shapely.get_coordinates(shapely.minimum_rotated_rectangle(shapely.MultiPoint(at[:, 1:])))
    return frame, np.array([at[:, 0].min(), at[:, 0].max()]), rectangle[:4]


def _touching(boxes: dict[int, Box], apart: float) -> Iterable[tuple[int, int]]:
    """Return pairs of sides that may be of one profile, the nearest first, then those with the longest overlap."""
    numbers = list(boxes)
    near = shapely.box(*_bounds(boxes).T)
    i, j = shapely.STRtree(near).query(near)
    i, j = i[i < j], j[i < j]
    along, normal, middle = (
        np.array([getattr(boxes[number], name) for number in numbers]).reshape(-1, 3) for name in ("along", "normal", "middle")
    )
    parallel = np.abs(np.einsum("ni,ni->n", along[i], along[j])) >= math.cos(math.radians(COMMON_ANGLE))
    one_plane = np.einsum("ni,ni->n", normal[i], normal[j]) > math.cos(math.radians(ANGLE))
    one_plane &= np.abs(np.einsum("ni,ni->n", middle[j] - middle[i], normal[i])) < apart
    found = []
    for a, b in zip(i[parallel & ~one_plane].tolist(), j[parallel & ~one_plane].tolist(), strict=True):
        distance, beside = _distance(boxes[numbers[a]], boxes[numbers[b]])
        if distance <= MAX_FLANGE_THICKNESS and beside > 0.0:
            found.append((distance, -beside, numbers[a], numbers[b]))
    return [(a, b) for _, _, a, b in sorted(found)]


def _bounds(boxes: dict[int, Box]) -> Float:
    """Return least and greatest x and y of boxes (n, 4), enlarged by half of `MAX_FLANGE_THICKNESS`."""
    at = np.array([box.corners[:, :2] for box in boxes.values()]).reshape(-1, 4, 2)
    return np.column_stack([at.min(axis=1) - 0.5 * MAX_FLANGE_THICKNESS, at.max(axis=1) + 0.5 * MAX_FLANGE_THICKNESS])


def _distance(one: Box, other: Box) -> tuple[float, float]:
    """Return distance of two sides in the section halfway along their overlap, and its length, m; inf, 0: too short."""
    long, short = (one, other) if one.length >= other.length else (other, one)
    at = np.sort((short.ends - long.middle) @ long.along)
    begin, end = max(at[0], -0.5 * long.length), min(at[1], 0.5 * long.length)
    if end - begin < OVERLAP * short.length:
        return math.inf, 0.0
    halfway = 0.5 * (begin + end)
    on_long = long.middle + halfway * long.along
    way = (halfway - (short.middle - long.middle) @ long.along) / (short.along @ long.along)
    on_short = short.middle + way * short.along
    lines = []
    for box, place in ((long, on_long), (short, on_short)):
        edges = place - long.middle + np.multiply.outer(np.array([-0.5, 0.5]) * box.width, box.across)
        lines.append(shapely.LineString(np.column_stack([edges @ long.across, edges @ long.normal])))
    return float(shapely.distance(*lines)), float(end - begin)
