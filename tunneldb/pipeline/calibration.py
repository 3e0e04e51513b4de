"""Intensity correction of a kilometre: range curve and roughness, estimated from a sample of its points."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.geometry import Polygon

from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.anomalies.detect import Detection, background_places
from tunneldb.arrays import Bool, Int32, Int64
from tunneldb.errors import UserError
from tunneldb.pointcloud.points import Points
from tunneldb.radiometry.cells import IntensitySamples
from tunneldb.radiometry.correction import Observations, range_span
from tunneldb.radiometry.range_curve import MAX_SIGMA_FOR_DETECTION, RangeCurve, estimate_range_curve
from tunneldb.radiometry.reference_curve import ReferenceCurve
from tunneldb.radiometry.robust_statistics import DryLevel, plain_statistics
from tunneldb.radiometry.roughness import (
    MAX_INCIDENCE,
    SIGNIFICANT_CHANGE,
    Roughness,
    automatic_regions,
    drawn_regions,
    find_roughness,
)
from tunneldb.raster.observation import ObservedPoints, Observer, RangeSpan

CORNER = 0.1
"""Minimum height above the foot of the wall of points for the roughness, m: below it sections are rounded, and the incidence
angles wrong."""

NEAR_SURFACE = 0.05
"""Maximum distance from the surface of points for the roughness, m."""

UNKNOWN = ReferenceCurve(np.array([1e-3, 1e4]), np.zeros(2))
"""Placeholder for a range curve not found yet: no correction."""

BORROW = (
    "or, if the curve of a neighbouring kilometre was found, export its range_m and intensity_db"
    " (tunnel_api.range_curve) and run this one in a survey with that file as its --reference"
)
"""Further advice if no range curve could be found."""


@dataclass(frozen=True)
class Sample:
    """Points of survey density, as seen.

    Attributes
    ----------
    seen : ObservedPoints
        Places and values of the points.
    scan_id : (n,) int array
        Scan that each is of.
    clear : (n,) bool array
        Points on the lining, away from its foot.
    """

    seen: ObservedPoints
    scan_id: Int32
    clear: Bool

    @property
    def observations(self) -> Observations:
        """Return how the scanner saw the points."""
        assert self.seen.observations is not None
        return self.seen.observations

    @property
    def telling(self) -> Bool:
        """Points that say something of range and incidence: clear of the lining's foot and near the surface."""
        return self.clear & (np.abs(self.seen.offset) <= NEAR_SURFACE)

    def along(self, curve: ReferenceCurve) -> Sample:
        """Correct samples seen with an UNKNOWN curve for distance."""
        observations = self.observations
        level = (observations.raw_db - curve(observations.range_m.astype(np.float64))).astype(np.float32)
        return replace(self, seen=replace(self.seen, observations=replace(observations, distance_db=level)))


@dataclass(frozen=True)
class Calibration:
    """Intensity correction of a kilometre.

    Attributes
    ----------
    observer : Observer
        Observation of points with the valid range curve.
    view : Sample
        Observed points of survey density.
    roughness : Roughness
        Roughness of the lining.
    found : RangeCurve or None
        Range curve found on this kilometre's lining; None where it was measured, or isn't needed.
    """

    observer: Observer
    view: Sample
    roughness: Roughness
    found: RangeCurve | None

    @property
    def note(self) -> str | None:
        """Return the note for the ledger."""
        if self.found is None:
            return None
        alone = "hardly any lining was seen by two scans: the range curve assumes uniform lining along the tunnel, within 5 m"
        return "; ".join(filter(None, [alone if self.found.hardly_overlaps else None, self.found.remark])) or None


def observe_sample(points: Points, observer: Observer) -> Sample:
    """Observe points of survey density, and check their ranges against the reference curve before files are read."""
    seen = observer.observe(points)
    if not seen.lining.any():
        raise UserError(
            f"no point of kilometre {observer.km} is on the lining: within {observer.tolerance:g} m of the sections and seen"
            f" at less than intensity.max_incidence from nearer than intensity.max_range"
        )
    assert observer.radiometer is not None
    if observer.radiometer.reference:
        span = RangeSpan()
        assert seen.observations is not None
        span.add(*range_span(seen.observations, seen.lining, observer.radiometer.reference))
        span.require(observer.radiometer)
        within = ~observer.radiometer.reference.outside(seen.observations.range_m.astype(np.float64))
        seen = replace(seen, use=seen.use & within, lining=seen.lining & within)
    return Sample(seen, points.scan_id, seen.lining & ~observer.floor.covers(seen.chainage, seen.arc, CORNER))


def calibrate(points: Points, observer: Observer, drawn: list[Polygon], survey: str, *, own_curve: bool) -> Calibration:
    """Find range curve and roughness of a kilometre on points of survey density.

    Parameters
    ----------
    points : Points
        Points of the kilometre.
    observer : Observer
        Its radiometer's range curve is UNKNOWN where it is to be found.
    drawn : list of Polygon
        Homogeneous regions that the user drew, if any: they decide about the roughness.
    survey : str
        Name of the survey, for errors.
    own_curve : bool
        True if the range curve must be estimated from these points.

    Raises
    ------
    UserError
        If no lining was seen, it is outside the reference curve, or its own curve cannot be estimated.
    """
    view = observe_sample(points, observer)
    assert observer.radiometer is not None
    if observer.radiometer.poses.empty:
        return Calibration(observer, view, Roughness.unsought(), None)
    if not own_curve:
        return Calibration(observer, view, roughness_of(view, drawn), None)
    try:
        found = find_range_curve(view, observer)
        found.require(MAX_SIGMA_FOR_DETECTION)
    except UserError as error:
        raise UserError(f"survey {survey}, kilometre {observer.km}: {error}; {BORROW}") from None
    observer = replace(observer, radiometer=replace(observer.radiometer, reference=found.curve))
    view = view.along(found.curve)
    return Calibration(observer, view, roughness_of(view, drawn) if drawn else _roughness_found(view, found), found)


def find_range_curve(view: Sample, observer: Observer) -> RangeCurve:
    """Estimate range curve and roughness from the lining itself; see :func:`estimate_range_curve`.

    It covers the ranges of all points that may be lining at full density: also those inside and behind the surface.
    """
    seen, observations, near = view.seen, view.observations, view.telling
    ranges = observations.range_m[seen.lining].astype(np.float64)
    return estimate_range_curve(
        IntensitySamples(
            np.column_stack([seen.chainage[near], seen.arc[near]]),
            view.scan_id[near],
            observations.range_m[near].astype(np.float64),
            observations.cosine[near].astype(np.float64),
            observations.raw_db[near].astype(np.float64),
        ),
        reach=(
            max(float(ranges.min()) - observer.tolerance, 0.1),
            float(ranges.max()) + max(observer.tolerance, observer.recess),
        ),
    )


def _roughness_found(view: Sample, found: RangeCurve) -> Roughness:
    """Return the roughness found with the range curve, with its reliability from its deviation."""
    angle = np.degrees(np.arccos(view.observations.cosine[view.telling]))
    return Roughness(
        found.roughness,
        found.roughness_sigma < SIGNIFICANT_CHANGE,
        False,
        float("nan"),
        float("nan"),
        found.cells,
        *(float(a) for a in np.quantile(angle[angle <= MAX_INCIDENCE], (0.001, 0.999))),
    )


def roughness_of(view: Sample, drawn: list[Polygon]) -> Roughness:
    """Estimate roughness from the regions that the user drew, or from automatic ones."""
    seen, observations = view.seen, view.observations
    if drawn:
        regions = drawn_regions(_polygon_of(seen, drawn), view.scan_id, observations.cosine, observations.distance_db)
        if len(regions) < 2:
            raise UserError(f"the {len(drawn)} homogeneous regions drawn have too few points: draw larger ones, or none")
        return find_roughness(regions)
    near = view.telling
    regions = automatic_regions(
        seen.chainage[near], seen.arc[near], view.scan_id[near], observations.cosine[near], observations.distance_db[near]
    )
    return find_roughness(regions)


def _polygon_of(seen: ObservedPoints, polygons: list[Polygon]) -> Int64:
    """Return the number of the polygon around each point, -1 for none."""
    number = np.full(len(seen.chainage), -1, np.int64)
    usable = np.flatnonzero(seen.use)
    for k, polygon in enumerate(polygons):
        number[usable[shapely.contains_xy(polygon, seen.chainage[usable], seen.arc[usable])]] = k
    return number


def dry_sigma(
    view: Sample,
    darker: ContrastImage,
    found: Detection,
    roughness: Roughness,
    dry_regions: list[Polygon],
) -> tuple[DryLevel, DryLevel, DryLevel]:
    """Return the standard deviation of dry lining points, raw and corrected by Lambert's law and Oren–Nayar (Table 1)."""
    seen, observations = view.seen, view.observations
    if dry_regions:
        dry = seen.lining & (_polygon_of(seen, dry_regions) >= 0)
    else:
        dry = view.clear & background_places(darker, found, seen.chainage, seen.arc)
    return (
        plain_statistics(observations.raw_db[dry]),
        plain_statistics(observations.corrected(0.0)[dry]),
        plain_statistics(observations.corrected(roughness.sigma)[dry]),
    )
