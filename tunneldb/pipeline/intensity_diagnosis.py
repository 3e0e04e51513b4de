"""Diagnoses of the dependence of intensity on range and incidence, for a survey and for a single scan file."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import psycopg
from numpy.typing import NDArray
from shapely import Polygon

from tunneldb.arrays import Float, Int32, Single
from tunneldb.errors import InputError, UserError
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.pipeline.calibration import UNKNOWN, Sample, find_range_curve, observe_sample, roughness_of
from tunneldb.pipeline.detect import SURFACE_MARGIN, load_floor, load_radiometer
from tunneldb.pointcloud.formats.table import has_scans, posed_scans
from tunneldb.pointcloud.reader import Points, read_chunks, read_header
from tunneldb.pointcloud.thinning import thin
from tunneldb.progress import StartProgress, silent
from tunneldb.radiometry.cells import IntensitySamples
from tunneldb.radiometry.correction import Kind, needs_reference, to_decibel
from tunneldb.radiometry.diagnosis import Diagnosis, pool
from tunneldb.radiometry.oren_nayar import incidence_db
from tunneldb.radiometry.range_curve import MAX_SIGMA_FOR_DETECTION, RangeCurve, estimate_range_curve
from tunneldb.radiometry.reference_curve import ReferenceCurve
from tunneldb.radiometry.scan_incidence import incidence_cosine
from tunneldb.raster.observation import Observer
from tunneldb.store.images import load_reference, load_regions
from tunneldb.store.sources import SAMPLE, sample
from tunneldb.store.surface import load_surface
from tunneldb.store.survey import Survey

THINNEST = 0.05
"""Edge of the voxels for thinning a scan before fitting planes, m; larger for too many points."""

MAX_POINTS = 2_000_000
"""Maximum number of points of a thinned scan."""


def diagnose_survey(
    conn: psycopg.Connection[Any],
    survey: Survey,
    kilometres: Sequence[int],
    values: Mapping[str, float],
    progress: Callable[[float], None] = lambda count: None,
) -> Diagnosis:
    """Diagnose lining points of survey density of some kilometres; nothing is changed.

    Parameters
    ----------
    conn, survey, kilometres
        Survey.
    values : mapping
        Parameters of the stages.
    progress : callable
        Given 1 after each kilometre.

    Raises
    ------
    InputError
        If the survey has no intensity, or a kilometre no sections or ground yet.
    """
    if survey.intensity_kind == "none":
        raise InputError(f"survey {survey.name} has no intensity: it was added with --intensity-kind none")
    if survey.platform == "unknown":
        raise InputError(f"survey {survey.name} has no scanner positions, so range and incidence are not known (--no-poses)")
    share = max(1, SAMPLE // len(kilometres))
    diagnoses = []
    for km in kilometres:
        diagnoses.append(compute_diagnosis(load_inputs(conn, survey, km, values), share))
        progress(1)
    numbers = ", ".join(map(str, kilometres))
    return pool(f"{survey.name}, kilometre {numbers}: {survey.intensity_kind}", diagnoses)


@dataclass(frozen=True)
class DiagnosisInputs:
    """Input of a kilometre's diagnosis.

    Attributes
    ----------
    title : str
        Points.
    kind : {'amplitude', 'reflectance', 'linear'}
        Kind of the intensity.
    measured : ReferenceCurve or None
        Curve measured on a target, where the kind needs one and it was given.
    observer : Observer
    view : Sample
        Lining points of survey density.
    regions : list of Polygon
        Regions drawn as homogeneous.
    """

    title: str
    kind: Kind
    measured: ReferenceCurve | None
    observer: Observer
    view: Sample
    regions: list[Polygon]


def load_inputs(conn: psycopg.Connection[Any], survey: Survey, km: int, values: Mapping[str, float]) -> DiagnosisInputs:
    """Load the input of a kilometre's diagnosis."""
    kind = cast(Kind, survey.intensity_kind)
    measured = load_reference(conn, survey) if needs_reference(kind) else None
    surface = load_surface(conn, survey, km * KILOMETRE - SURFACE_MARGIN, (km + 1) * KILOMETRE + SURFACE_MARGIN)
    # Without a curve the lining itself is asked, whether or not detection is to go by it.
    radiometer = load_radiometer(conn, survey if measured else replace(survey, reference="auto"), km, values)
    depth = values["lining.tolerance"], values["lining.recess"]
    observer = Observer.of(surface, km, depth, radiometer, load_floor(conn, survey, surface, km, 0.0))
    view = observe_sample(sample(conn, survey, km), observer)
    return DiagnosisInputs(f"kilometre {km}", kind, measured, observer, view, load_regions(conn, survey, km, "homogeneous"))


def compute_diagnosis(inputs: DiagnosisInputs, most: int) -> Diagnosis:
    """Diagnose a kilometre's sample; at most ``most`` of its points near a scanner are kept for display."""
    view = inputs.view
    found, refused = _attempt(lambda: find_range_curve(view, inputs.observer), view.observations.raw_db[view.telling])
    if needs_reference(inputs.kind) and inputs.measured is None:
        roughness, note = found.roughness if found else None, None
        view = view.along(found.curve if found else UNKNOWN)
    else:
        known = roughness_of(view, inputs.regions)
        roughness, note = known.sigma, known.note
    near = np.flatnonzero(view.telling)
    near = near[:: max(1, len(near) // most)]
    seen = view.observations
    return _diagnosis(
        inputs.title,
        inputs.kind,
        _Points(*(v[near].astype(np.float64) for v in (seen.range_m, seen.cosine, seen.raw_db, seen.distance_db))),
        roughness,
        found,
        inputs.measured,
        [note, f"the measured curve cannot be checked on this lining: {refused}" if refused and inputs.measured else refused],
    )


def diagnose_file(
    path: Path,
    dimension: str,
    kind: Kind,
    scanner: tuple[float, float, float] | None,
    begin: StartProgress = silent,
) -> Diagnosis:
    """Diagnose a single scan file: normals are those of planes through neighbouring points.

    Parameters
    ----------
    path : Path
        Scan file.
    dimension : str
        Dimension of the intensity.
    kind : {'amplitude', 'reflectance', 'linear'}
        Kind of the intensity.
    scanner : three floats or None
        Scanner position, in the file's coordinates, m; None to use the poses of an E57 or PTX file.
    begin : callable
        Called with a text and a number of points (or None) before each step; returns a function that takes the points done.

    Raises
    ------
    InputError
        If the file can't be read, or it isn't known where the scanner stood.
    """
    stations = _stations(path, scanner)
    xyz, scan_id, raw = _thinned(path, dimension, begin(path.name, read_header(path).points))
    scans = np.unique(scan_id)
    if scanner is not None and len(scans) > 1:
        raise InputError(
            f"{path} has {len(scans)} scans ({_some(scans)}), but --scanner is the position of one: split the file by"
            " point_source_id, or load it into a survey with --stations"
        )
    begin("fitting", None)
    at = (
        np.tile(np.asarray(scanner), (len(xyz), 1))
        if scanner is not None
        else np.array([stations[s] for s in scan_id.tolist()])
    )
    cosine = incidence_cosine(xyz, at)
    range_m = np.linalg.norm(xyz - at, axis=1)
    level = to_decibel(raw, kind)
    flat = np.isfinite(cosine) & np.isfinite(level)
    if not flat.any():
        raise InputError(f"{path}: no surface is flat enough for normals, so incidence angles are unknown")
    samples = IntensitySamples(xyz, scan_id, range_m, cosine, level).some(flat)
    range_m, cosine, level = samples.range_m, samples.cosine, samples.level
    found, refused = _attempt(lambda: estimate_range_curve(samples, unrolled=False), level)
    distance = level
    if found and needs_reference(kind):
        distance = level - found.curve(range_m)
    roughness = found.roughness if found else None
    return _diagnosis(path.name, kind, _Points(range_m, cosine, level, distance), roughness, found, None, [refused])


@dataclass(frozen=True)
class _Points:
    """Range, m, cosine of incidence, intensity as measured and corrected for distance, dB; (n,) each."""

    range_m: Float
    cosine: Float
    raw: Float
    distance: Float


def _diagnosis(
    title: str,
    kind: Kind,
    points: _Points,
    roughness: float | None,
    found: RangeCurve | None,
    measured: ReferenceCurve | None,
    remarks: list[str | None],
) -> Diagnosis:
    """Correct points with the known data, and note which were used."""
    nothing = roughness is None or (needs_reference(kind) and found is None and measured is None)
    with np.errstate(invalid="ignore", divide="ignore"):
        corrected = (
            np.full(len(points.raw), np.nan) if nothing else points.distance - incidence_db(points.cosine, roughness or 0.0)
        )
    notes = []
    if nothing:
        notes.append(f"{title}: not corrected")
    else:
        by = "the maker" if not needs_reference(kind) else "the measured curve" if measured else "the curve found here"
        notes.append(f"{title}: distance corrected by {by}, incidence by roughness {roughness:.1f}°")
    if found:
        sigma, where = found.worst
        notes.append(
            f"{title}: found on {found.cells:,} cells, {found.overlapping:,} of them seen by several scans: range curve known"
            f" to {sigma:.2f} dB between {found.nearest:.1f} and {found.farthest:.1f} m (worst at {where:.1f} m),"
            f" roughness {found.roughness:.1f}° ± {found.roughness_sigma:.1f}°"
        )
        if found.hardly_overlaps:
            notes.append(f"{title}: hardly any of it was seen by two scans, so it is assumed to be uniform within a few metres")
    notes += [f"{title}: {remark}" for remark in remarks if remark]
    return Diagnosis(
        f"{title}: {kind}",
        points.range_m,
        np.degrees(np.arccos(np.clip(points.cosine, -1.0, 1.0))),
        points.raw,
        corrected,
        () if nothing or roughness is None else (roughness,),
        (found,) if found else (),
        measured,
        tuple(notes),
    )


def _attempt(find: Callable[[], RangeCurve], raw: NDArray[np.floating]) -> tuple[RangeCurve | None, str | None]:
    """Return a range curve if one could be found, and the reason why detection would refuse it, or its remark.

    One less certain than that intensity, dB, is within so much of its mean anywhere, says nothing and is not shown.
    """
    try:
        found = find()
    except UserError as error:
        return None, str(error)
    try:
        found.require(MAX_SIGMA_FOR_DETECTION)
    except UserError as error:
        return found if found.worst[0] < float(np.std(raw)) else None, str(error)
    return found, found.remark


def _stations(path: Path, scanner: tuple[float, float, float] | None) -> dict[int, Float]:
    """Return the positions of a file's scans by their numbers; none if ``scanner`` gives it."""
    if not has_scans(path):
        if scanner is None:
            raise InputError(f"{path}: the scanner position is not in the file: give --scanner X Y Z in its coordinates")
        return {}
    scans = posed_scans(path)
    posed = {scan.number: scan.position for scan in scans if scan.position is not None}
    if scanner is not None:
        if posed:
            raise InputError(f"{path}: its scans have poses; leave out --scanner")
        return {}
    for scan in scans:
        if scan.number not in posed:
            raise InputError(
                f"{path}: scan {scan.name!r} has no pose, so the scanner position is unknown: give --scanner X Y Z"
            )
    return posed


def _thinned(path: Path, dimension: str, progress: Callable[[float], None]) -> tuple[Float, Int32, Single]:
    """Return coordinates, scan and raw intensity of a scan's points, each scan thinned to a point per voxel."""
    kept: list[Points] = []
    edge, count = THINNEST, 0
    for chunk in read_chunks(path, dimension):
        kept.append(_thin(chunk, edge))
        count += len(kept[-1])
        while count > 2 * MAX_POINTS:
            kept = [_thin(_joined(kept), edge)]
            count = len(kept[0])
            edge *= 1.0 if count <= MAX_POINTS else 2.0**0.5
        progress(len(chunk))
    if not count:
        raise InputError(f"{path}: the file holds no points")
    points = _thin(_joined(kept), edge)
    return points.xyz, points.scan_id, points.intensity


def _thin(points: Points, edge: float) -> Points:
    chosen = np.zeros(len(points), np.bool_)
    for scan in np.unique(points.scan_id):
        of = np.flatnonzero(points.scan_id == scan)
        chosen[of[thin(points.xyz[of], edge)]] = True
    return points.some(chosen)


def _joined(parts: list[Points]) -> Points:
    names = ("xyz", "time", "scan_id", "intensity", "classification")
    return Points(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def _some(numbers: Int32) -> str:
    shown = ", ".join(map(str, numbers[:5].tolist()))
    return shown if len(numbers) <= 5 else f"{shown}, …"
