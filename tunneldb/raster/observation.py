"""Scanned points as the image takes them: unrolled, with corrected intensity."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Bool, Float
from tunneldb.errors import NotReadyError, UserError
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.geometry.surface import Surface
from tunneldb.pointcloud.poses import PoseModel
from tunneldb.pointcloud.reader import Points
from tunneldb.radiometry.correction import Kind, Observations, observe, unposed
from tunneldb.radiometry.edge_normals import Edges
from tunneldb.radiometry.reference_curve import ReferenceCurve
from tunneldb.raster.floor import Floor
from tunneldb.raster.limits import Limits, near_surface, steep_enough, within_range


@dataclass(frozen=True)
class Radiometer:
    """Data for the correction of intensity.

    Attributes
    ----------
    kind : {'amplitude', 'reflectance', 'linear'}
        What the raw intensity is.
    poses : PoseModel
        Scanner positions.
    reference : ReferenceCurve or None
        Effect of distance; None for reflectance.
    max_incidence, max_range : float
        Points seen more slantingly (degrees) or from farther (m) are left out.
    max_outside : float
        Share of the lining's points that may lie outside the reference curve; those that do are left out.
    """

    kind: Kind
    poses: PoseModel
    reference: ReferenceCurve | None
    max_incidence: float
    max_range: float
    max_outside: float


@dataclass(frozen=True)
class ObservedPoints:
    """Points near the surface; all arrays (n,).

    Attributes
    ----------
    chainage, arc, offset : float arrays
        Unrolled, m.
    use : bool array
        Points near the surface, in the kilometre, and whose intensity can be corrected.
    lining : bool array
        Those of them that don't lie on the floor.
    observations : Observations or None
        Range, incidence and intensity; None when the survey has no intensity.
    """

    chainage: Float
    arc: Float
    offset: Float
    use: Bool
    lining: Bool
    observations: Observations | None


@dataclass(frozen=True)
class Observer:
    """Turns points of a survey into what the image of one kilometre takes.

    Attributes
    ----------
    surface : Surface
        The tunnel.
    km : int
        Kilometre.
    tolerance, recess : float
        Points that stand in farther from the surface, or lie farther behind it, are not lining, m.
    radiometer : Radiometer or None
        None when the survey has no intensity.
    floor : Floor
        Where the floor begins.
    edges : Edges
        Where the surface bends sharply.
    box : (2, 3) float array
        Least and greatest coordinates of the kilometre's lining, m.
    ends : (float, float)
        Chainage at which the survey begins and ends, m: what lies beyond is none of its lining.
    """

    surface: Surface
    km: int
    tolerance: float
    recess: float
    radiometer: Radiometer | None
    floor: Floor
    edges: Edges
    box: Float
    ends: tuple[float, float]

    @classmethod
    def of(
        cls,
        surface: Surface,
        km: int,
        depth: tuple[float, float],
        radiometer: Radiometer | None,
        floor: Floor,
        halo: float = 0.0,
        ends: tuple[float, float] = (-math.inf, math.inf),
        water: float = -math.inf,
    ) -> Observer:
        """Return the observer of a kilometre and of ``halo`` metres beyond its ends.

        The surface must cover the kilometre at least in part.

        ``depth`` is how far in front of the surface and behind it lining is looked for, m: tolerance and recess; ``ends`` is
        where the survey begins and ends; ``water`` the height of the water, m: what a laser shows below it are images that it
        mirrors.
        """
        start, stop = km * KILOMETRE, (km + 1) * KILOMETRE
        touching = (surface.ends[:, 1] > start) & (surface.ends[:, 0] < stop)
        if not touching.any():
            raise NotReadyError(f"kilometre {km} has no segments yet: run its stages segments and sections first")
        # Whole metres, so that what is laid out each metre lies at the same places from either kilometre.
        start, stop = start - math.ceil(halo), stop + math.ceil(halo)
        touching = (surface.ends[:, 1] > start) & (surface.ends[:, 0] < stop)
        vertices = surface.segments[touching, :6].reshape(-1, 3)
        margin = float(surface.radius.max()) + max(depth)
        low = vertices.min(0) - margin
        low[2] = max(low[2], water)
        return cls(
            surface,
            km,
            *depth,
            radiometer,
            floor,
            Edges.of(surface, start, stop),
            np.array([low, vertices.max(0) + margin]),
            ends,
        )

    @property
    def limits(self) -> Limits:
        """Limits of the points that the image takes."""
        if self.radiometer is None:
            return Limits(self.tolerance, self.recess, 0.0, math.inf)
        cosine = np.cos(np.radians(self.radiometer.max_incidence))  # a Python float would compare as float32
        return Limits(self.tolerance, self.recess, cosine, self.radiometer.max_range)

    def near(self, points: Points) -> Points:
        """Points in the kilometre's bounding box."""
        if not len(points) or np.all((points.xyz.min(0) >= self.box[0]) & (points.xyz.max(0) <= self.box[1])):
            return points
        inside = np.all((points.xyz >= self.box[0]) & (points.xyz <= self.box[1]), axis=1)
        return Points(
            points.xyz[inside],
            points.time[inside],
            points.scan_id[inside],
            points.intensity[inside],
            points.classification[inside],
        )

    def observe(self, points: Points) -> ObservedPoints:
        """Unroll a chunk of points and look up their intensity; those whose scanner position is unknown are not used."""
        unrolled = self.surface.unroll(points.xyz)
        start = self.km * KILOMETRE
        with np.errstate(invalid="ignore"):
            use = near_surface(unrolled.offset, self.limits)
            use &= (unrolled.chainage >= start) & (unrolled.chainage < start + KILOMETRE)
        observations = None
        if self.radiometer:
            radiometer = self.radiometer
            if radiometer.poses.empty:
                observations = unposed(points.intensity, radiometer.kind)
            else:
                scanner = radiometer.poses.positions(points)
                normals = self.edges.normals_of(points.xyz, unrolled)
                observations = observe(points.xyz, scanner, normals, points.intensity, radiometer.kind, radiometer.reference)
            with np.errstate(invalid="ignore"):
                use &= steep_enough(observations.cosine, self.limits) & within_range(observations.range_m, self.limits)
            use &= np.isfinite(observations.raw_db)
        lining = use & ~self.floor.covers(unrolled.chainage, unrolled.arc)
        return ObservedPoints(unrolled.chainage, unrolled.arc, unrolled.offset, use, lining, observations)


@dataclass
class RangeSpan:
    """Ranges of the lining points so far, against those of the reference curve.

    Attributes
    ----------
    nearest, farthest : float
        m.
    outside, count : int
        How many lie outside the curve's span, and how many there are.
    """

    nearest: float = np.inf
    farthest: float = -np.inf
    outside: int = 0
    count: int = 0

    def add(self, nearest: float, farthest: float, outside: int, count: int) -> None:
        """Count the points of a chunk."""
        self.nearest, self.farthest = min(self.nearest, nearest), max(self.farthest, farthest)
        self.outside += outside
        self.count += count

    def require(self, radiometer: Radiometer) -> None:
        """Raise UserError if too many points lie outside the curve's span."""
        if radiometer.reference and self.outside > radiometer.max_outside * self.count:
            raise UserError(radiometer.reference.outside_text(self.nearest, self.farthest, self.outside, self.count))
