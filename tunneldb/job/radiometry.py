"""What the intensity of a kilometre is corrected with: scanner positions, range curve, roughness, found on a sample."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import psycopg
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon

from tunneldb.database.survey import Survey
from tunneldb.errors import UserError
from tunneldb.intensity.correct import Kind, Views, needs_reference, range_span
from tunneldb.intensity.dry import Dry, plain_statistics
from tunneldb.intensity.roughness import Regions, Roughness, automatic_regions, drawn_regions, find_roughness
from tunneldb.job.sources import sample
from tunneldb.leak.detection import Detection, dry_places
from tunneldb.leak.picture import Picture
from tunneldb.leak.seen import Eye, Radiometer, Seen, Span
from tunneldb.leak.store import load_reference
from tunneldb.scan.pose import load_poses

CORNER = 0.1
"""Points that serve for the roughness lie farther above the foot of the wall, m: there sections are rounded, and the incidence
angles wrong."""

NEAR_SURFACE = 0.05
"""Points that serve for the roughness lie no farther from the surface, m."""


@dataclass(frozen=True)
class Sample:
    """Points of survey density, as seen.

    Attributes
    ----------
    seen : Seen
        Where they lie and what they show.
    scan_id : (n,) int array
        Scan that each is of.
    clear : (n,) bool array
        Those on the lining, clear of its foot.
    """

    seen: Seen
    scan_id: NDArray[np.int32]
    clear: NDArray[np.bool_]

    @property
    def views(self) -> Views:
        """How the scanner saw the points."""
        assert self.seen.views is not None
        return self.seen.views


def find_radiometer(conn: psycopg.Connection[Any], survey: Survey, max_incidence: float) -> Radiometer | None:
    """Gather what a survey's intensity is corrected with; None when it has none."""
    if survey.intensity_kind == "none":
        return None
    kind = cast(Kind, survey.intensity_kind)
    reference = load_reference(conn, survey) if needs_reference(kind) else None
    if needs_reference(kind) and reference is None:
        raise UserError(
            f"survey {survey.name} has no reference curve, without which intensity of kind {kind} can't be corrected for"
            " distance: add the survey with --reference CSV (range_m,intensity_db), or take a reflectance dimension"
        )
    return Radiometer(kind, load_poses(conn, survey), reference, max_incidence)


def take_sample(conn: psycopg.Connection[Any], survey: Survey, eye: Eye) -> Sample:
    """Look at points of survey density, and check their ranges against the reference curve before files are read."""
    points = sample(conn, survey, eye.km)
    seen = eye.see(points, f"survey {survey.name}")
    if not seen.lining.any():
        raise UserError(
            f"no point of kilometre {eye.km} lies on the lining: within {eye.tolerance:g} m of the sections and seen at"
            f" less than the incidence intensity.max_incidence"
        )
    assert eye.radiometer is not None
    if eye.radiometer.reference:
        span = Span()
        assert seen.views is not None
        span.add(*range_span(seen.views, seen.lining, eye.radiometer.reference))
        span.require(eye.radiometer.reference)
    return Sample(seen, points.scan_id, seen.lining & ~eye.floor.covers(seen.chainage, seen.arc, CORNER))


def roughness_of(view: Sample, drawn: list[Polygon]) -> Roughness:
    """Roughness from the regions that the user drew, or from automatic ones."""
    seen, views = view.seen, view.views
    if drawn:
        regions = drawn_regions(_polygon_of(seen, drawn), view.scan_id, views.cosine, views.distance_db)
        if len(regions) < 2:
            raise UserError(f"the {len(drawn)} homogeneous regions drawn hold too few points: draw larger ones, or none")
        return find_roughness(regions)
    near = view.clear & (np.abs(seen.offset) <= NEAR_SURFACE)
    regions = automatic_regions(
        seen.chainage[near], seen.arc[near], view.scan_id[near], views.cosine[near], views.distance_db[near]
    )
    return find_roughness(regions) if len(regions) >= 2 else _unknown(regions)


def _unknown(regions: Regions) -> Roughness:
    """Lambert's law, for want of regions that tell."""
    return Roughness(0.0, False, float("nan"), 0.0, len(regions), float("nan"), float("nan"))


def _polygon_of(seen: Seen, polygons: list[Polygon]) -> NDArray[np.int64]:
    """Number of the polygon that holds each point, -1 for none."""
    number = np.full(len(seen.chainage), -1, np.int64)
    usable = np.flatnonzero(seen.use)
    for k, polygon in enumerate(polygons):
        number[usable[shapely.contains_xy(polygon, seen.chainage[usable], seen.arc[usable])]] = k
    return number


def dry_sigma(
    view: Sample,
    picture: Picture,
    found: Detection,
    roughness: Roughness,
    dry_regions: list[Polygon],
) -> tuple[Dry, Dry, Dry]:
    """Standard deviation of dry lining points, raw and corrected by Lambert's law and Oren–Nayar (Table 1)."""
    seen, views = view.seen, view.views
    if dry_regions:
        dry = seen.lining & (_polygon_of(seen, dry_regions) >= 0)
    else:
        dry = view.clear & dry_places(picture, found, seen.chainage, seen.arc)
    return (
        plain_statistics(views.raw_db[dry]),
        plain_statistics(views.corrected(0.0)[dry]),
        plain_statistics(views.corrected(roughness.sigma)[dry]),
    )
