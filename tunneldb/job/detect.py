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
from tunneldb.job.scene import load_arcs
from tunneldb.job.sources import Source, sample, sources
from tunneldb.leak.detection import Detection, dry_places
from tunneldb.leak.detection import detect as find_leaks
from tunneldb.leak.gather import Counts, gather
from tunneldb.leak.image import KILOMETRE, Accumulator, Grid
from tunneldb.leak.leaks import save_leaks
from tunneldb.leak.lining import HIDDEN, Astray, Floor
from tunneldb.leak.picture import Picture, develop, halo
from tunneldb.leak.raster import KINDS
from tunneldb.leak.seen import Eye, Radiometer, Seen, Span
from tunneldb.leak.store import ImageStore, drop_radiometry, load_reference, load_regions, save_radiometry
from tunneldb.scan.pose import load_poses

ASIDE = 50.0
"""Length of the surface beyond the ends that is loaded too: sections are judged by the three before and after them, m."""

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
        If there are no sections, the ground was not sought, a file is gone or was changed, or intensity can't be corrected.
    """
    surface = load_surface(conn, survey, km * KILOMETRE - ASIDE, (km + 1) * KILOMETRE + ASIDE)
    grid = _grid(surface, km, values["image.pixel"])
    files = sources(conn, survey, km)
    radiometer = _radiometer(conn, survey, values["intensity.max_incidence"])
    beyond = grid.halo * grid.pixel
    eye = Eye.of(surface, km, values["lining.tolerance"], radiometer, load_floor(conn, survey, km, beyond), beyond)
    with Accumulator(grid) as image:
        if radiometer is None:
            return _offset_only(conn, survey, eye, files, image, progress)
        view = _sample(conn, survey, eye)
        roughness = _roughness(view, load_regions(conn, survey, km, "homogeneous"))
        counts = _gather(eye, files, image, roughness.sigma, progress)
        images = ImageStore(conn, survey, grid, KINDS)
        picture = develop(image, eye.floor, Astray.of(surface), values["appendage.distance"], images.save)
    dry_regions = load_regions(conn, survey, km, "dry")
    found = find_leaks(picture, values["leak.min_area"], dry_regions)
    save_radiometry(conn, survey, km, roughness, found, _sigma(view, picture, found, roughness, dry_regions))
    matched = save_leaks(conn, survey, km, surface, found.leaks, found.cut, values["leak.min_area"])
    return {
        **counts,
        "points_used": images.points,
        "pixels": images.pixels,
        "lining_pixels": found.pixels,
        "wet_pixels": found.wet_pixels,
        "leaks": matched.new + matched.again,
        "leaks_over_ends": matched.over_ends,
        "leaks_new": matched.new,
        "leaks_again": matched.again,
        "leaks_kept_for_review": matched.kept,
        "leaks_gone": matched.gone,
        **_report(roughness, matched.other_pixels),
    }


def load_floor(conn: psycopg.Connection[Any], survey: Survey, km: int, halo: float) -> Floor:
    """Where the floor of a kilometre begins, and of so many metres beyond its ends: where stage ``ground`` has found it."""
    done = conn.execute(
        "SELECT FROM tunnel.run WHERE survey_id = %s AND km = %s AND stage = 'ground' AND outcome = 'done' LIMIT 1",
        (survey.id, km),
    ).fetchone()
    if done is None:
        raise UserError(f"the ground of kilometre {km} is not known yet: tunneldb run {survey.name} --km {km} --from ground")
    # Far enough for both kilometres to see the ground on both sides of a gap at their border.
    beyond = int(np.ceil(halo)) + HIDDEN
    first = int(km * KILOMETRE) - beyond
    return Floor.of(first, *load_arcs(conn, survey, first, int((km + 1) * KILOMETRE) + beyond))


def _offset_only(
    conn: psycopg.Connection[Any],
    survey: Survey,
    eye: Eye,
    files: list[Source],
    image: Accumulator,
    progress: Callable[[float], None],
) -> Counts:
    """Make the offset image of a survey without intensity."""
    counts = _gather(eye, files, image, 0.0, progress)
    images = ImageStore(conn, survey, image.grid, ["offset"])
    for block in image.inner_blocks():
        images.save(image.window(block * image.grid.block_columns, (block + 1) * image.grid.block_columns))
    drop_radiometry(conn, survey, eye.km)
    save_leaks(conn, survey, eye.km, eye.surface, [], [], 0.0)
    return {
        **counts,
        "points_used": images.points,
        "pixels": images.pixels,
        "leaks": 0,
        "note": "no intensity: offset image only, no leaks sought",
    }


def _gather(eye: Eye, files: list[Source], image: Accumulator, roughness: float, progress: Callable[[float], None]) -> Counts:
    """Read the files into the image, which must not show the halo alone."""
    counts = gather(eye, files, image, roughness, progress)
    if not image.inner_blocks():
        raise UserError(f"no point of {', '.join(file.path.name for file in files)} lies on the lining of kilometre {eye.km}")
    return counts


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
    """Grid of a kilometre and its halo, from the lowest to the highest arc of their sections."""
    first, last = km * KILOMETRE - surface.reach, (km + 1) * KILOMETRE + surface.reach
    if not ((surface.chainages >= first) & (surface.chainages <= last)).any():
        raise UserError(f"kilometre {km} has no sections yet: run its stages segments and sections first")
    beyond = halo(pixel)
    inside = (surface.chainages >= first - beyond * pixel) & (surface.chainages <= last + beyond * pixel)
    return Grid.covering(km, pixel, float(surface.arcs[inside, 0].min()), float(surface.arcs[inside, -1].max()), beyond)


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
    return Sample(seen, points.scan_id, seen.lining & ~eye.floor.covers(seen.chainage, seen.arc, CORNER))


def _roughness(view: Sample, drawn: list[Polygon]) -> Roughness:
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


def _sigma(
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


def _report(roughness: Roughness, other_pixels: list[int]) -> Counts:
    """What the ledger says about the roughness, and what else there is to note."""

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
    notes = []
    if not roughness.determined:
        notes.append(
            "the lining is seen at too similar incidence angles to tell its roughness;"
            " whichever is taken hardly changes the corrected intensity"
        )
    if other_pixels:
        notes.append(
            f"leaks over the end towards kilometre {' and '.join(map(str, other_pixels))} are in two pieces: its pixels are of"
            " another size; detect both with the same image.pixel"
        )
    if notes:
        report["note"] = "; ".join(notes)
    return report
