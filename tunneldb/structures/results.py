"""Results for a structure: members, their faces, and the spots on these."""

from __future__ import annotations

from dataclasses import astuple, dataclass
from typing import Literal

import numpy as np
import rasterio.features
import shapely
from affine import Affine
from shapely.geometry import MultiPolygon, Polygon

from tunneldb.arrays import Bool, Float
from tunneldb.counted import counted
from tunneldb.structures.models import RADIUS, to_space

SIMPLIFY = 0.75
"""Tolerance for simplifying outlines of faces, pixels."""

VERTICAL_STRIP_WIDTH = 0.02
"""Width on the map of vertical faces, m."""

_CHORD = 0.005  # m by which an edge of a polygon may cut the corner of a curved face

Kind = Literal["flat", "pipe"]
MemberKind = Literal["flat", "pipe", "profile"]


@dataclass(frozen=True)
class Member:
    """Faces of one surface, joined behind objects in front of it, or of the sides of one beam or column.

    Attributes
    ----------
    number : int
        From 1, the largest first.
    kind : {'flat', 'pipe', 'profile'}
    faces : tuple of int
        Numbers of its faces.
    area : float
        m², of its faces.
    length : float
        Along its longest direction, gaps counted, m.
    line : (2, 3) float array
        The ends of that, m.
    bimodal : bool
        True if so much of it differs from the rest that its own surface cannot be identified.
    """

    number: int
    kind: MemberKind
    faces: tuple[int, ...]
    area: float
    length: float
    line: Float
    bimodal: bool


@dataclass(frozen=True)
class Face:
    """A plane or a part of a cylinder.

    Attributes
    ----------
    number, member : int
        From 1, and that of its member.
    side : int
        Side number within its member, from 1, the largest first: faces of one plane or pipe are of one side.
    kind : {'flat', 'pipe'}
    model : (11,) float array
        See `models`; lengths are m from ``origin``.
    origin : (3,) float array
        m.
    points : int
        Points on it.
    area : float
        m².
    radius : float
        m; 0 of a plane.
    rms : float
        Standard deviation of the voxels' centroids about a cylinder, of the points about a plane, m: roughness and noise.
    seen_share : float
        Share of its area that was judged, 0 to 1; of the rest too little is known for an all-clear.
    incidence : (float, float)
        Least and greatest at which it was judged, degrees; NaN where none of it was.
    level, sigma : float
        Median of its own level where it was judged, and of the standard deviation about it, dB; NaN where none of it was.
    bimodal : bool
        True if more than half of its inspected part differs from the level.
    outline : MultiPolygon
        Outline in unrolled (u, v), m.
    """

    number: int
    member: int
    side: int
    kind: Kind
    model: Float
    origin: Float
    points: int
    area: float
    radius: float
    rms: float
    seen_share: float
    incidence: tuple[float, float]
    level: float
    sigma: float
    bimodal: bool
    outline: MultiPolygon

    def in_space(self, shape: shapely.Geometry) -> shapely.Geometry:
        """Convert unrolled coordinates on the face to a geometry with Z, in the coordinates of the points."""
        if self.radius > 0.0:
            parts = isinstance(shape, MultiPolygon)
            shape = shapely.segmentize(shape, 2.0 * float(np.sqrt(2.0 * self.radius * _CHORD)))
            if parts and isinstance(shape, Polygon):  # GEOS makes one part of one
                shape = MultiPolygon([shape])

        def place(at: Float) -> Float:
            return to_space(self.model, at[:, 0], at[:, 1])[:, :3] + self.origin

        flat = shapely.get_coordinates(shape)
        raised = place(flat)
        lifted = shapely.force_3d(shape)
        return shapely.set_coordinates(lifted, raised)

    def on_map(self, shape: Polygon) -> Polygon:
        """Return a polygon of unrolled coordinates in plan, m; a vertical one is a strip `VERTICAL_STRIP_WIDTH` wide."""
        placed = shapely.force_2d(self.in_space(shape))
        plan = placed if placed.is_valid and placed.area > 0.05 * shape.area else placed.convex_hull
        return plan if isinstance(plan, Polygon) else plan.buffer(VERTICAL_STRIP_WIDTH / 2.0, cap_style="flat")


@dataclass(frozen=True)
class Spot:
    """A region that differs from its own surface.

    Attributes
    ----------
    number, face, member : int
        From 1; where it is.
    kind : {'dark', 'bright'}
        Against its own surface.
    reasons : tuple of str
        Descriptions of its shape, the strongest first: ``thin``, ``gradual``, ``rectangular``.
    confidence : float
        Probability of a difference, 0 to 1.
    contrast : float
        Mean difference in standard deviations of the surface.
    difference : float
        The same in dB, positive.
    area : float
        m².
    points : int
    scans : int
        Scans that saw it.
    outline : Polygon
        Outline in unrolled (u, v), m.
    rgb : (int, int, int) or None
        Mean colour of its points, 0 to 255; None where they have none.
    """

    number: int
    face: int
    member: int
    kind: Literal["dark", "bright"]
    reasons: tuple[str, ...]
    confidence: float
    contrast: float
    difference: float
    area: float
    points: int
    scans: int
    outline: Polygon
    rgb: tuple[int, int, int] | None = None


@dataclass(frozen=True)
class LeftOut:
    """Numbers of regions that differ from their surface and are no spots.

    Attributes
    ----------
    labels, bands : int
        Drawn regions: labels, plates and windows; bands around pipes, and stripes.
    stray : int
        Regions of stray points of other objects.
    parts, seams : int
        Parts attached to the rim of a face, in its plane; straight lines of one or two pixels, such as welds and joints.
    """

    labels: int = 0
    bands: int = 0
    stray: int = 0
    parts: int = 0
    seams: int = 0

    def __add__(self, other: LeftOut) -> LeftOut:
        return LeftOut(*(one + more for one, more in zip(astuple(self), astuple(other), strict=True)))

    @property
    def statement(self) -> str | None:
        """Sentence about these regions; None if there are none."""
        counts = (
            (self.labels, "label"), (self.bands, "painted band"), (self.stray, "region of stray points"),
            (self.parts, "attached part"), (self.seams, "seam"),
        )  # fmt: skip
        texts = [counted(count, one, "regions of stray points" if "stray" in one else "") for count, one in counts if count]
        return f"{', '.join(texts)} left out: they differ from their surface but are no spots" if texts else None


@dataclass(frozen=True)
class Structures:
    """All that is found, and the numbers of regions that were left out."""

    members: list[Member]
    faces: list[Face]
    spots: list[Spot]
    left_out: LeftOut = LeftOut()


def outline_of(mask: Bool, left: int, bottom: int, pixel: float) -> MultiPolygon:
    """Outline of pixels (rows upwards, columns), in unrolled coordinates, m."""
    image = mask.astype(np.uint8)
    moved = Affine(pixel, 0.0, left * pixel, 0.0, pixel, bottom * pixel)
    found = [shapely.geometry.shape(shape) for shape, _ in rasterio.features.shapes(image, mask=mask, transform=moved)]
    parts = shapely.get_parts(shapely.make_valid(shapely.simplify(np.array(found, object), SIMPLIFY * pixel)))
    return MultiPolygon([part for part in parts if isinstance(part, Polygon)])


def kind_of(model: Float) -> Kind:
    """Return the kind of a face, from its model."""
    return "pipe" if model[RADIUS] > 0.0 else "flat"
