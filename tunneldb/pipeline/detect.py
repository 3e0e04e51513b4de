"""The stage ``detect``: from the scan files, at full density, to images and leaks of one kilometre."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, cast

import numpy as np
import psycopg
from shapely.geometry import Polygon

from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.anomalies.background.level_map import BackgroundMap
from tunneldb.anomalies.background.relate import relate, usable
from tunneldb.anomalies.bands import DarkBand, find_bands
from tunneldb.anomalies.coverage import Coverage, measure_coverage
from tunneldb.anomalies.detect import Detection, find_anomalies
from tunneldb.anomalies.detectability.blocks import Detectability, measure_detectability
from tunneldb.anomalies.detectability.conditions import measure_conditions
from tunneldb.anomalies.detectability.pieces import Pieces
from tunneldb.anomalies.measure import Measurement, measure_outline
from tunneldb.anomalies.sparse import least_density, leave_out_sparse
from tunneldb.arrays import Single, UInt8
from tunneldb.errors import NotReadyError, UserError
from tunneldb.finding_kind import FindingKind
from tunneldb.geometry.section_outliers import MAX_GIRTH_SHARE, SectionOutliers
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.geometry.surface import Surface
from tunneldb.pipeline.calibration import UNKNOWN, Calibration, calibrate, dry_sigma
from tunneldb.pipeline.detection_notes import describe, pixel_note
from tunneldb.pipeline.other_images import measure_kilometre
from tunneldb.pipeline.replace_findings import replace_findings
from tunneldb.pointcloud.colour_depth import colour_depth
from tunneldb.pointcloud.points import Points
from tunneldb.pointcloud.reader import ScanSource
from tunneldb.radiometry.correction import Kind, needs_reference
from tunneldb.radiometry.robust_statistics import DryLevel
from tunneldb.raster.accumulator import Accumulator, Window
from tunneldb.raster.colour_sums import ColourSums
from tunneldb.raster.floor import MAX_HIDDEN_LENGTH, Floor
from tunneldb.raster.geotiff import KINDS
from tunneldb.raster.grid import Grid
from tunneldb.raster.image import LiningImage, halo, halo_of_profiles, lining_image
from tunneldb.raster.observation import Observer, Radiometer
from tunneldb.raster.pixel_size import SMALLEST, choose_factor, coarse_grid, coarsen
from tunneldb.raster.profiles import ProfileGaps, find_gaps
from tunneldb.raster.rasterize import Counts, rasterize
from tunneldb.segmentation.network import Network
from tunneldb.store.coverage import seen_share
from tunneldb.store.detectability import detectability_statement, drop_detectability, save_detectability
from tunneldb.store.drawn_findings import Drawn, load_drawn, save_measured
from tunneldb.store.images import (
    ImageStore,
    drop_bands,
    drop_coverage,
    drop_radiometry,
    load_reference,
    load_regions,
    save_bands,
    save_coverage,
    save_radiometry,
    save_range_curve,
)
from tunneldb.store.learned import InForce, model_in_force
from tunneldb.store.networks import load_network
from tunneldb.store.poses import load_poses
from tunneldb.store.scene import load_arcs
from tunneldb.store.sonar import water_level
from tunneldb.store.sources import sample, sources
from tunneldb.store.surface import load_surface, survey_ends
from tunneldb.store.survey import Survey

SaveColours = Callable[[Grid, int, Single], None]
"""Function that saves the colours of a block, given the pixels and the number of the block."""

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
        Pixels of the kilometre and its halo, into which the points are sorted.
    files : list of ScanSource
        Files to read at full density.
    sample : Points or None
        Points of survey density; None without intensity.
    own_curve : bool
        True if the range curve must be estimated from the lining.
    homogeneous, dry : list of Polygon
        Regions that the user drew.
    network : Network or None
        Segmentation network, if one is to be asked.
    judge : InForce
        Evidence model, with the tunnel's adjustments.
    drawn : list of Drawn
        Findings whose outlines people drew, to be measured.
    colour_notes : tuple of str
        Notes on the colours of the files.
    """

    survey: str
    observer: Observer
    grid: Grid
    files: list[ScanSource]
    sample: Points | None
    own_curve: bool
    homogeneous: list[Polygon]
    dry: list[Polygon]
    network: Network | None
    judge: InForce
    drawn: list[Drawn]
    colour_notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class DetectionResult:
    """Result of detection in a kilometre.

    Attributes
    ----------
    grid : Grid
        Pixels of the images.
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
    bands : list of DarkBand
    detectability : Detectability
    drawn : list of Measurement
        Measurements of drawn outlines.
    """

    grid: Grid
    counts: Counts
    calibration: Calibration
    background: BackgroundMap
    state: UInt8
    anomalies: Detection
    dry_levels: tuple[DryLevel, DryLevel, DryLevel]
    coverage: Coverage
    bands: list[DarkBand]
    detectability: Detectability
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
        images = ImageStore(conn, survey, ["offset"])
        counts = make_offset_images(inputs, values, images.save, progress, images.save_colours)
        images.save_overviews(inputs.grid)
        drop_radiometry(conn, survey, km)
        drop_coverage(conn, survey, km)
        drop_bands(conn, survey, km)
        drop_detectability(conn, survey, km)
        save_range_curve(conn, survey, km, None)
        replace_findings(conn, survey, km, inputs.observer.surface, [], [], 0.0)
        return {
            **counts,
            "learned": inputs.judge.id,
            "pixels": images.pixels,
            "leaks": 0,
            "note": "; ".join(
                ["no intensity: offset image only, leaks not searched for", *pixel_note(counts), *colour_notes(inputs, counts)]
            ),
        }
    images = ImageStore(conn, survey, KINDS)
    result = compute_detection(inputs, inputs.sample, values, images.save, progress, images.save_colours)
    return _save(conn, survey, inputs, result, images, values)


def load_inputs(conn: psycopg.Connection[Any], survey: Survey, km: int, values: Mapping[str, float]) -> DetectionInputs:
    """Read the input of detection in a kilometre.

    Raises
    ------
    UserError
        If there are no sections, stage ground has not run, or a file is gone or was changed.
    """
    surface = load_surface(conn, survey, km * KILOMETRE - SURFACE_MARGIN, (km + 1) * KILOMETRE + SURFACE_MARGIN)
    grid = kilometre_grid(surface, km, values["image.pixel"] or SMALLEST)
    files, notes = coloured_sources(sources(conn, survey, km))
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
        load_network(conn, int(values["detect.model"])),
        model_in_force(conn, survey.tunnel_id),
        load_drawn(conn, survey, km),
        notes,
    )


def compute_detection(
    inputs: DetectionInputs,
    sample: Points,
    values: Mapping[str, float],
    save_block: Callable[[Grid, Window], None],
    progress: Callable[[float], None],
    save_colours: SaveColours | None = None,
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
        Given the pixels, and each block of the images.
    progress : callable
        Given the share of the points that were read.
    save_colours : callable or None
        Given the pixels, and number and colours of each block, after the block itself; only if files have colours.
    """
    calibration = calibrate(sample, inputs.observer, inputs.homogeneous, inputs.survey, own_curve=inputs.own_curve)
    observer, view, roughness = calibration.observer, calibration.view, calibration.roughness
    with ExitStack() as stack:
        image, gaps, colours, counts = _gather(observer, inputs, values, roughness.sigma, progress, stack)
        outliers = SectionOutliers.of(observer.surface, MAX_GIRTH_SHARE)
        grid = image.grid
        lining = lining_image(image, gaps, observer, outliers, values["appendage.distance"], partial(save_block, grid))
        _keep_colours(image, gaps, colours, save_colours)
    if gaps is not None:
        counts["profile_spacing"] = round(gaps.spacing, 3)
    density = least_density(values["image.min_density"], grid.pixel)
    if (sparse := leave_out_sparse(lining, density)) >= MIN_NOTED_SPARSE_SHARE:
        counts |= {"sparse": round(sparse, 4), "least_density": round(density, 1)}
    pieces = Pieces.of(lining)
    background, contrast, found = _search(lining, inputs, values["leak.min_area"])
    conditions = measure_conditions(contrast, found.dark, found.size)
    trials = pieces.try_out(found.dark, conditions, lambda picture: _search(picture, inputs, values["leak.min_area"])[2].wet)
    bands = find_bands(contrast, background)
    counts["bands_area"] = round(sum(band.area for band in bands), 3)
    return DetectionResult(
        grid,
        counts,
        calibration,
        background,
        contrast.state,
        found,
        dry_sigma(view, contrast, found, roughness, inputs.dry),
        measure_coverage(contrast.state, found.wet, grid, found.size),
        bands,
        measure_detectability(grid, conditions, trials, values["leak.demand_area"], values["leak.demand_drop"]),
        [measure_outline(contrast, finding.outline) for finding in inputs.drawn] if background.count else [],
    )


def _search(picture: LiningImage, inputs: DetectionInputs, min_area: float) -> tuple[BackgroundMap, ContrastImage, Detection]:
    """Find dark areas in a picture, whose levels are overwritten."""
    background, contrast = relate(picture, inputs.dry, inputs.network)
    return background, contrast, find_anomalies(contrast, background, min_area, inputs.judge.model)


def make_offset_images(
    inputs: DetectionInputs,
    values: Mapping[str, float],
    save_block: Callable[[Grid, Window], None],
    progress: Callable[[float], None],
    save_colours: SaveColours | None = None,
) -> Counts:
    """Make the offset image of a survey without intensity, and the image in colour if files have colours."""
    with ExitStack() as stack:
        image, _, colours, counts = _gather(inputs.observer, inputs, values, 0.0, progress, stack)
        width = image.grid.block_columns
        for block in image.inner_blocks():
            save_block(image.grid, image.window(block * width, (block + 1) * width))
        _keep_colours(image, None, colours, save_colours)
    return counts


def _keep_colours(image: Accumulator, gaps: ProfileGaps | None, colours: ColourSums | None, save: SaveColours | None) -> None:
    """Save the colours of the blocks of the kilometre itself."""
    if colours is not None and save is not None:
        inner = set(image.inner_blocks())
        for block in colours.inner_blocks():
            if block in inner:
                save(image.grid, block, colours.rgb(block, gaps))


def _save(
    conn: psycopg.Connection[Any],
    survey: Survey,
    inputs: DetectionInputs,
    result: DetectionResult,
    images: ImageStore,
    values: Mapping[str, float],
) -> Counts:
    km, surface, found, roughness = inputs.grid.km, inputs.observer.surface, result.anomalies, result.calibration.roughness
    images.save_states(result.grid, result.state, found.dark)
    images.save_overviews(result.grid)
    save_range_curve(conn, survey, km, result.calibration.found)
    save_radiometry(conn, survey, km, roughness, result.background, found.pixels, found.wet_pixels, result.dry_levels)
    save_coverage(conn, survey, km, result.coverage)
    save_bands(conn, survey, km, result.bands)
    save_detectability(conn, survey, km, result.detectability, values["leak.demand_area"], values["leak.demand_drop"])
    matched, other_pixels = replace_findings(
        conn, survey, km, surface, found.anomalies, found.cut, values["leak.min_area"], inputs.judge.model
    )
    if result.background.count:
        save_measured(conn, inputs.drawn, result.drawn)
    measure_kilometre(conn, survey, km)
    network = usable(inputs.network, result.grid.pixel)
    notes = [
        *colour_notes(inputs, result.counts),
        survey.note,
        inputs.judge.note,
        result.calibration.note,
        detectability_statement(conn, survey, km),
    ]
    return {
        **result.counts,
        "model": inputs.judge.model.version,
        "network": None if network is None else network.version,
        "learned": inputs.judge.id,
        "pixels": images.pixels,
        "lining_pixels": found.pixels,
        "wet_pixels": found.wet_pixels,
        "seen": round(seen_share(conn, survey, km), 9),
        "leaks": matched.new + matched.again,
        "joints": matched.kinds[FindingKind.JOINT],
        "dark": matched.kinds[FindingKind.DARK],
        "leaks_over_ends": matched.over_ends,
        "leaks_new": matched.new,
        "leaks_again": matched.again,
        "leaks_kept_for_review": matched.kept,
        "leaks_gone": matched.gone,
        **describe(result.counts, roughness, notes, other_pixels),
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
    observer: Observer,
    inputs: DetectionInputs,
    values: Mapping[str, float],
    roughness: float,
    progress: Callable[[float], None],
    stack: ExitStack,
) -> tuple[Accumulator, ProfileGaps | None, ColourSums | None, Counts]:
    """Read the files into an image, which must not show the halo alone, and find the gaps between its profiles.

    If files have colours, they are read into a second image of the same pixels.

    Its pixels are enlarged where points are few, unless profiles are apart: between them the nearest one is shown.
    """
    image = stack.enter_context(Accumulator(inputs.grid))
    coloured = any(file.full_colour for file in inputs.files)
    colours = stack.enter_context(ColourSums(inputs.grid)) if coloured else None
    counts = rasterize(observer, inputs.files, image, roughness, progress, colours)
    if not image.inner_blocks():
        raise UserError(
            f"no point of {', '.join(file.path.name for file in inputs.files)} is on the lining of kilometre {observer.km}"
        )
    gaps = find_gaps(image, values["image.spacing"])
    if values["image.pixel"] == 0.0 and gaps is None:
        factor, density = choose_factor(image)
        if factor > 1:
            large = stack.enter_context(Accumulator(coarse_grid(image.grid, factor, halo(factor * image.grid.pixel))))
            coarsen(image, large)
            image = large
            if colours is not None:
                large_colours = stack.enter_context(ColourSums(large.grid))
                coarsen(colours, large_colours)
                colours = large_colours
            counts["density"] = round(density)
    counts["pixel"] = image.grid.pixel
    return image, gaps, colours, counts


def coloured_sources(files: list[ScanSource]) -> tuple[list[ScanSource], tuple[str, ...]]:
    """Return the files with the value of full colour of those that have colours, and notes on it."""
    depths = [colour_depth(file.path) for file in files]
    pairs = [(file, depth) for file, depth in zip(files, depths, strict=True) if depth is not None]
    notes = filter(None, (depth.note(file.path) for file, depth in pairs))
    full = [0 if depth is None else depth.maximum for depth in depths]
    return [replace(file, full_colour=value) for file, value in zip(files, full, strict=True)], tuple(notes)


def colour_notes(inputs: DetectionInputs, counts: Counts) -> list[str]:
    """Return the notes on the colours of the files."""
    return [*inputs.colour_notes, *counts.get("colours_cut", ())]


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
