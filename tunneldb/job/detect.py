"""The stage ``detect``: from the scan files, at full density, to images and leaks of one kilometre."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import psycopg
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon

from tunneldb.database.survey import Survey
from tunneldb.errors import UserError
from tunneldb.geometry.store import load_surface
from tunneldb.geometry.surface import Surface
from tunneldb.intensity.correct import Kind, Views, needs_reference, range_span
from tunneldb.intensity.dry import Dry, plain_statistics
from tunneldb.intensity.roughness import Regions, Roughness, automatic_regions, drawn_regions, find_roughness
from tunneldb.job.sources import sample, sources
from tunneldb.leak.detection import Detection, dry_pixels
from tunneldb.leak.detection import detect as find_leaks
from tunneldb.leak.gather import Counts, gather
from tunneldb.leak.image import Accumulator, Grid
from tunneldb.leak.lining import Astray, states
from tunneldb.leak.raster import KINDS
from tunneldb.leak.seen import Eye, Radiometer, Seen, Span
from tunneldb.leak.store import (
    drop_radiometry,
    load_reference,
    load_regions,
    save_images,
    save_leaks,
    save_radiometry,
)
from tunneldb.scan.pose import load_poses

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
    """

    seen: Seen
    scan_id: NDArray[np.int32]

    @property
    def views(self) -> Views:
        """How the scanner saw the points."""
        assert self.seen.views is not None
        return self.seen.views


def detect(
    conn: psycopg.Connection[Any],
    survey: Survey,
    km: int,
    values: Mapping[str, float],
    progress: Callable[[float], None],
) -> Counts:
    """Make the unrolled images of a kilometre and find its leaks (Xu et al., 2018).

    The files are read chunk by chunk; only images and leaks are kept.

    Raises
    ------
    UserError
        If there are no sections, a file is gone or was changed, or intensity can't be corrected.
    """
    surface = load_surface(conn, survey, km * 1000.0, (km + 1) * 1000.0)
    grid = _grid(surface, km, values["image.pixel"])
    files = sources(conn, survey, km)
    radiometer = _radiometer(conn, survey, values["intensity.max_incidence"])
    eye = Eye.of(surface, km, values["lining.tolerance"], radiometer)
    with Accumulator(grid) as image:
        if radiometer is None:
            counts = gather(eye, files, image, 0.0, progress)
            drop_radiometry(conn, survey, km)
            save_leaks(conn, survey, km, surface, [])
            pixels = save_images(conn, survey, image, ["offset"])
            return {**counts, "pixels": pixels, "leaks": 0, "note": "no intensity: offset image only, no leaks sought"}
        view = _sample(conn, survey, eye)
        roughness = _roughness(view, load_regions(conn, survey, km, "homogeneous"))
        counts = gather(eye, files, image, roughness.sigma, progress)
        state = states(image, eye.floor, Astray.of(surface), values["appendage.distance"])
        dry_regions = load_regions(conn, survey, km, "dry")
        found = find_leaks(image, state, values["leak.min_area"], dry_regions)
        save_radiometry(conn, survey, km, roughness, found, _sigma(view, image, state, found, roughness, dry_regions))
        matched = save_leaks(conn, survey, km, surface, found.leaks)
        pixels = save_images(conn, survey, image, KINDS)
    return {
        **counts,
        "pixels": pixels,
        "lining_pixels": found.pixels,
        "wet_pixels": found.wet_pixels,
        "leaks": len(found.leaks),
        "leaks_new": matched.new,
        "leaks_again": matched.again,
        "leaks_kept_for_review": matched.kept,
        "leaks_gone": matched.gone,
        **_report(roughness),
    }


def _radiometer(conn: psycopg.Connection[Any], survey: Survey, max_incidence: float) -> Radiometer | None:
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


def _grid(surface: Surface, km: int, pixel: float) -> Grid:
    """Grid of a kilometre, from the lowest to the highest arc of its sections."""
    inside = (surface.chainages >= km * 1000.0 - surface.reach) & (surface.chainages <= (km + 1) * 1000.0 + surface.reach)
    if not inside.any():
        raise UserError(f"kilometre {km} has no sections yet: run its stages segments and sections first")
    return Grid.covering(km, pixel, float(surface.arcs[inside, 0].min()), float(surface.arcs[inside, -1].max()))


def _sample(conn: psycopg.Connection[Any], survey: Survey, eye: Eye) -> Sample:
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
    return Sample(seen, points.scan_id)


def _roughness(view: Sample, drawn: list[Polygon]) -> Roughness:
    """Roughness from the regions that the user drew, or from automatic ones."""
    seen, views = view.seen, view.views
    if drawn:
        regions = drawn_regions(_polygon_of(seen, drawn), view.scan_id, views.cosine, views.distance_db)
        if len(regions) < 2:
            raise UserError(f"the {len(drawn)} homogeneous regions drawn hold too few points: draw larger ones, or none")
        return find_roughness(regions)
    near = seen.lining & (np.abs(seen.offset) <= NEAR_SURFACE)
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


def _sigma(
    view: Sample,
    image: Accumulator,
    state: NDArray[np.uint8],
    found: Detection,
    roughness: Roughness,
    dry_regions: list[Polygon],
) -> tuple[Dry, Dry, Dry]:
    """Standard deviation of dry lining points, raw and corrected by Lambert's law and Oren–Nayar (Table 1)."""
    seen, views = view.seen, view.views
    if dry_regions:
        dry = seen.lining & (_polygon_of(seen, dry_regions) >= 0)
    else:
        dry = seen.lining & image.grid.pick(dry_pixels(image, state, found), seen.chainage, seen.arc)
    return (
        plain_statistics(views.raw_db[dry]),
        plain_statistics(views.corrected(0.0)[dry]),
        plain_statistics(views.corrected(roughness.sigma)[dry]),
    )


def _report(roughness: Roughness) -> Counts:
    """What the ledger says about the roughness."""

    def known(value: float, digits: int) -> float | None:
        return round(value, digits) if np.isfinite(value) else None

    report: Counts = {
        "roughness": known(roughness.sigma, 2),
        "roughness_determined": roughness.determined,
        "roughness_contrast_db": known(roughness.contrast, 3),
        "regions": roughness.regions,
        "incidence_from": known(roughness.incidence_from, 1),
        "incidence_to": known(roughness.incidence_to, 1),
    }
    if not roughness.determined:
        report["note"] = (
            "the lining is seen at too similar incidence angles to tell its roughness;"
            " whichever is taken hardly changes the corrected intensity"
        )
    return report
