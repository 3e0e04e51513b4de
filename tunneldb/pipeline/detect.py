"""The stage ``detect``: from the scan files, at full density, to images and leaks of one kilometre."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import psycopg
from shapely.geometry import Polygon

from tunneldb.anomalies.background.contrast import contrast_image
from tunneldb.anomalies.background.level_map import BackgroundMap, map_background
from tunneldb.anomalies.coverage import Coverage, measure_coverage
from tunneldb.anomalies.detect import Detection, find_anomalies
from tunneldb.anomalies.measure import Measurement, measure_outline
from tunneldb.anomalies.sparse import least_density, leave_out_sparse
from tunneldb.arrays import UInt8
from tunneldb.errors import NotReadyError, UserError
from tunneldb.finding_kind import FindingKind
from tunneldb.geometry.section_outliers import MAX_GIRTH_SHARE, SectionOutliers
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.geometry.surface import Surface
from tunneldb.pipeline.calibration import UNKNOWN, Calibration, calibrate, dry_sigma
from tunneldb.pipeline.replace_findings import replace_findings
from tunneldb.pointcloud.points import Points
from tunneldb.pointcloud.reader import ScanSource
from tunneldb.radiometry.correction import Kind, needs_reference
from tunneldb.radiometry.robust_statistics import DryLevel
from tunneldb.raster.accumulator import Accumulator, Window
from tunneldb.raster.floor import MAX_HIDDEN_LENGTH, Floor
from tunneldb.raster.geotiff import KINDS
from tunneldb.raster.grid import Grid
from tunneldb.raster.image import halo, halo_of_profiles, lining_image
from tunneldb.raster.observation import Observer, Radiometer
from tunneldb.raster.profiles import find_gaps
from tunneldb.raster.rasterize import Counts, rasterize
from tunneldb.store.coverage import seen_share
from tunneldb.store.drawn_findings import Drawn, load_drawn, save_measured
from tunneldb.store.images import (
    ImageStore,
    drop_coverage,
    drop_radiometry,
    load_reference,
    load_regions,
    save_coverage,
    save_radiometry,
    save_range_curve,
)
from tunneldb.store.learned import InForce, model_in_force
from tunneldb.store.poses import load_poses
from tunneldb.store.scene import load_arcs
from tunneldb.store.sonar import water_level
from tunneldb.store.sources import sample, sources
from tunneldb.store.surface import load_surface, survey_ends
from tunneldb.store.survey import Survey

SURFACE_MARGIN = 50.0
"""Length of the surface loaded beyond the ends, m: sections are checked with the three before and after them."""

MIN_NOTED_SPARSE_SHARE = 0.01
"""Share of the lining too sparse to be searched from which there is a note; less is only in the share not inspected."""


@dataclass(frozen=True)
class DetectionInputs:
    """Input of detection in a kilometre.

    Attributes
    ----------
    survey : str
        Its name, for errors.
    observer : Observer
        Surface, floor and scanner; without a radiometer if there is no intensity.
    grid : Grid
        Pixels of the kilometre and its halo.
    files : list of ScanSource
        Files to read at full density.
    sample : Points or None
        Points of survey density; None without intensity.
    own_curve : bool
        True if the range curve must be estimated from the lining.
    homogeneous, dry : list of Polygon
        Regions that the user drew.
    judge : InForce
        Evidence model, with the tunnel's adjustments.
    drawn : list of Drawn
        Findings whose outlines people drew, to be measured.
    """

    survey: str
    observer: Observer
    grid: Grid
    files: list[ScanSource]
    sample: Points | None
    own_curve: bool
    homogeneous: list[Polygon]
    dry: list[Polygon]
    judge: InForce
    drawn: list[Drawn]


@dataclass(frozen=True)
class DetectionResult:
    """Result of detection in a kilometre.

    Attributes
    ----------
    counts : dict
        Points that were read and seen.
    calibration : Calibration
        Intensity correction used.
    background : BackgroundMap
        The dry lining.
    state : (rows, columns) uint8 array
        State of each pixel.
    anomalies : Detection
    dry_levels : three DryLevel
        Dry lining points, raw and corrected by Lambert's law and Oren–Nayar.
    coverage : Coverage
    drawn : list of Measurement
        Measurements of drawn outlines.
    """

    counts: Counts
    calibration: Calibration
    background: BackgroundMap
    state: UInt8
    anomalies: Detection
    dry_levels: tuple[DryLevel, DryLevel, DryLevel]
    coverage: Coverage
    drawn: list[Measurement]


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
        If there are no sections, stage ground has not run, a file is gone or was changed, or intensity cannot be corrected.
    """
    inputs = load_inputs(conn, survey, km, values)
    if inputs.sample is None:
        images = ImageStore(conn, survey, inputs.grid, ["offset"])
        counts = make_offset_images(inputs, images.save, progress)
        drop_radiometry(conn, survey, km)
        drop_coverage(conn, survey, km)
        save_range_curve(conn, survey, km, None)
        replace_findings(conn, survey, km, inputs.observer.surface, [], [], 0.0)
        return {
            **counts,
            "learned": inputs.judge.id,
            "pixels": images.pixels,
            "leaks": 0,
            "note": "no intensity: offset image only, leaks not searched for",
        }
    images = ImageStore(conn, survey, inputs.grid, KINDS)
    result = compute_detection(inputs, inputs.sample, values, images.save, progress)
    return _save(conn, survey, inputs, result, images, values["leak.min_area"])


def load_inputs(conn: psycopg.Connection[Any], survey: Survey, km: int, values: Mapping[str, float]) -> DetectionInputs:
    """Read the input of detection in a kilometre.

    Raises
    ------
    UserError
        If there are no sections, stage ground has not run, or a file is gone or was changed.
    """
    surface = load_surface(conn, survey, km * KILOMETRE - SURFACE_MARGIN, (km + 1) * KILOMETRE + SURFACE_MARGIN)
    grid = kilometre_grid(surface, km, values["image.pixel"])
    files = sources(conn, survey, km)
    radiometer = load_radiometer(conn, survey, km, values)
    beyond = grid.halo * grid.pixel
    depth = values["lining.tolerance"], values["lining.recess"]
    ends = survey_ends(conn, survey) or (-np.inf, np.inf)
    level = water_level(conn, survey, km)
    floor = load_floor(conn, survey, surface, km, beyond)
    observer = Observer.of(surface, km, depth, radiometer, floor, beyond, ends, -np.inf if level is None else level)
    return DetectionInputs(
        survey.name,
        observer,
        grid,
        files,
        None if radiometer is None else sample(conn, survey, km),
        survey.reference == "auto",
        load_regions(conn, survey, km, "homogeneous"),
        load_regions(conn, survey, km, "dry"),
        model_in_force(conn, survey.tunnel_id),
        load_drawn(conn, survey, km),
    )


def compute_detection(
    inputs: DetectionInputs,
    sample: Points,
    values: Mapping[str, float],
    save_block: Callable[[Window], None],
    progress: Callable[[float], None],
) -> DetectionResult:
    """Calibrate the intensity, make the images from the files, and find dark areas in them.

    Parameters
    ----------
    inputs : DetectionInputs
    sample : Points
        Points of survey density, on which the intensity is calibrated.
    values : mapping
        Parameters of the stage.
    save_block : callable
        Given each block of the images as soon as no more points fall into it.
    progress : callable
        Given the share of the points that were read.
    """
    calibration = calibrate(sample, inputs.observer, inputs.homogeneous, inputs.survey, own_curve=inputs.own_curve)
    observer, view, roughness = calibration.observer, calibration.view, calibration.roughness
    with Accumulator(inputs.grid) as image:
        counts = _gather(observer, inputs.files, image, roughness.sigma, progress)
        outliers = SectionOutliers.of(observer.surface, MAX_GIRTH_SHARE)
        gaps = find_gaps(image, values["image.spacing"])
        lining = lining_image(image, gaps, observer, outliers, values["appendage.distance"], save_block)
    if gaps is not None:
        counts["profile_spacing"] = round(gaps.spacing, 3)
    density = least_density(values["image.min_density"], inputs.grid.pixel)
    if (sparse := leave_out_sparse(lining, density)) >= MIN_NOTED_SPARSE_SHARE:
        counts |= {"sparse": round(sparse, 4), "least_density": round(density, 1)}
    background = map_background(lining, inputs.dry)
    contrast = contrast_image(lining, background)
    found = find_anomalies(contrast, background, values["leak.min_area"], inputs.judge.model)
    return DetectionResult(
        counts,
        calibration,
        background,
        contrast.state,
        found,
        dry_sigma(view, contrast, found, roughness, inputs.dry),
        measure_coverage(contrast.state, found.wet, inputs.grid, found.size),
        [measure_outline(contrast, finding.outline) for finding in inputs.drawn] if background.count else [],
    )


def make_offset_images(
    inputs: DetectionInputs, save_block: Callable[[Window], None], progress: Callable[[float], None]
) -> Counts:
    """Make the offset image of a survey without intensity."""
    with Accumulator(inputs.grid) as image:
        counts = _gather(inputs.observer, inputs.files, image, 0.0, progress)
        for block in image.inner_blocks():
            save_block(image.window(block * image.grid.block_columns, (block + 1) * image.grid.block_columns))
    return counts


def _save(
    conn: psycopg.Connection[Any],
    survey: Survey,
    inputs: DetectionInputs,
    result: DetectionResult,
    images: ImageStore,
    min_area: float,
) -> Counts:
    km, surface, found, roughness = inputs.grid.km, inputs.observer.surface, result.anomalies, result.calibration.roughness
    images.save_states(result.state, found.dark)
    save_range_curve(conn, survey, km, result.calibration.found)
    save_radiometry(conn, survey, km, roughness, result.background, found.pixels, found.wet_pixels, result.dry_levels)
    save_coverage(conn, survey, km, result.coverage)
    matched, other_pixels = replace_findings(
        conn, survey, km, surface, found.anomalies, found.cut, min_area, inputs.judge.model
    )
    if result.background.count:
        save_measured(conn, inputs.drawn, result.drawn)
    return {
        **result.counts,
        "model": inputs.judge.model.version,
        "learned": inputs.judge.id,
        "pixels": images.pixels,
        "lining_pixels": found.pixels,
        "wet_pixels": found.wet_pixels,
        "seen": round(seen_share(conn, survey, km), 4),
        "leaks": matched.new + matched.again,
        "joints": matched.kinds[FindingKind.JOINT],
        "dark": matched.kinds[FindingKind.DARK],
        "leaks_over_ends": matched.over_ends,
        "leaks_new": matched.new,
        "leaks_again": matched.again,
        "leaks_kept_for_review": matched.kept,
        "leaks_gone": matched.gone,
        **_report(result, [survey.note, inputs.judge.note], other_pixels),
    }


def load_radiometer(conn: psycopg.Connection[Any], survey: Survey, km: int, values: Mapping[str, float]) -> Radiometer | None:
    """Read the intensity correction of a kilometre, with the stages' parameters; None without intensity.

    A range curve that is to be found on the lining is UNKNOWN at first: see :func:`tunneldb.pipeline.calibration.calibrate`.
    """
    if survey.intensity_kind == "none":
        return None
    kind = cast(Kind, survey.intensity_kind)
    reference = None
    if needs_reference(kind):
        reference = UNKNOWN if survey.reference == "auto" else load_reference(conn, survey)
    if needs_reference(kind) and reference is None:
        raise UserError(
            f"survey {survey.name} has no reference curve, which is required to correct intensity of kind {kind} for"
            f" distance: tunneldb survey set {survey.name} --reference FILE (CSV with range_m,intensity_db), or --reference"
            " auto to estimate it from the lining"
        )
    limits = (values[f"intensity.{name}"] for name in ("max_incidence", "max_range", "max_outside"))
    return Radiometer(kind, load_poses(conn, survey, km), reference, *limits)


def load_floor(conn: psycopg.Connection[Any], survey: Survey, surface: Surface, km: int, halo: float) -> Floor:
    """Return the edges of the floor of a kilometre, and of some metres beyond its ends, from stage ``ground``.

    In a canal it begins where the surface meets the water, if sonar scans were loaded.
    """
    done = conn.execute(
        "SELECT FROM tunnel.run WHERE survey_id = %s AND km = %s AND stage = 'ground' AND outcome = 'done' LIMIT 1",
        (survey.id, km),
    ).fetchone()
    if done is None:
        raise NotReadyError(f"the ground of kilometre {km} is unknown: tunneldb run {survey.name} --km {km} --from ground")
    # Far enough for both kilometres to see the ground on both sides of a gap at their border.
    beyond = int(np.ceil(halo)) + MAX_HIDDEN_LENGTH
    first, last = int(km * KILOMETRE) - beyond, int((km + 1) * KILOMETRE) + beyond
    level = water_level(conn, survey, km)
    water = None if level is None else surface.waterline(np.arange(first, last + 1, dtype=np.float64), level)
    return Floor.of(first, *load_arcs(conn, survey, first, last), water)


def _gather(
    observer: Observer, files: list[ScanSource], image: Accumulator, roughness: float, progress: Callable[[float], None]
) -> Counts:
    """Read the files into the image, which must not show the halo alone."""
    counts = rasterize(observer, files, image, roughness, progress)
    if not image.inner_blocks():
        raise UserError(
            f"no point of {', '.join(file.path.name for file in files)} is on the lining of kilometre {observer.km}"
        )
    return counts


def kilometre_grid(surface: Surface, km: int, pixel: float) -> Grid:
    """Return the grid of a kilometre and its halo: blocks with a surface, from the lowest to the highest arc."""
    first, last = km * KILOMETRE - surface.reach, (km + 1) * KILOMETRE + surface.reach
    if not ((surface.chainages >= first) & (surface.chainages <= last)).any():
        raise NotReadyError(f"kilometre {km} has no sections yet: run its stages segments and sections first")
    beyond = halo(pixel)  # what is farther away counts only where profiles lie apart, and adds no rows
    inside = (surface.chainages >= first - beyond * pixel) & (surface.chainages <= last + beyond * pixel)
    low, high = float(surface.arcs[inside, 0].min()), float(surface.arcs[inside, -1].max())
    beyond_sections = surface.reach + pixel  # so that no lining touches an end that is not the kilometre's
    ends = surface.chainages[0] - beyond_sections, surface.chainages[-1] + beyond_sections
    return Grid.covering(km, pixel, low, high, halo_of_profiles(pixel), ends)


def _report(result: DetectionResult, known_before: list[str | None], other_pixels: list[int]) -> Counts:
    """Return the ledger's text on the roughness, and further notes."""
    roughness = result.calibration.roughness

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
    notes = [note for note in (*known_before, result.calibration.note) if note]
    if text := roughness.note:
        notes.append(text)
    if other_pixels:
        notes.append(
            f"leaks across the boundary to kilometre {' and '.join(map(str, other_pixels))} are in two pieces: its pixels have"
            " another size; run detect on both with the same image.pixel"
        )
    if (sparse := result.counts.get("sparse")) is not None:
        notes.append(
            f"{100.0 * sparse:.3g} % of the lining has fewer than {result.counts['least_density']:g} points/m², too few to"
            " distinguish wet from dry: it was not searched for leaks and counts as not inspected (image.min_density)"
        )
    if (spacing := result.counts.get("profile_spacing")) is not None:
        notes.append(
            f"profiles {spacing:g} m apart: between them the images show the nearest one; the ends of leaks along the"
            f" tunnel are uncertain by {0.5 * spacing:.2g} m, and those shorter than {spacing:g} m may be missed"
        )
    if notes:
        report["note"] = "; ".join(notes)
    return report
