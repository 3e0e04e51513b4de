"""What each pixel of a face shows against the face's own level, scan by scan and all scans together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.arrays import Bool, Float, Int32, Int64
from tunneldb.radiometry.reference_curve import ReferenceCurve
from tunneldb.raster.geotiff import NODATA
from tunneldb.raster.grid import FaceGrid
from tunneldb.raster.pixel_state import PixelState
from tunneldb.structures.face_raster import BEAM, DIVERGENCE, STEP, Layout, Sums
from tunneldb.structures.level import CLASS, FEWEST, LevelCurve, level_curve
from tunneldb.structures.models import RADIUS, normals_at, to_space

CLOSING = 2
"""Holes of so many pixels are no holes of the face, but places between points."""


@dataclass(frozen=True)
class Observed:
    """Pixels of a face as one scan saw them.

    Attributes
    ----------
    scan : int
    pixel : (n,) int array
        Row × columns + column.
    cosine, range_m, value, points : (n,) float arrays
        Of incidence, m, mean level corrected for range where that is known, dB, number of points.
    """

    scan: int
    pixel: Int64
    cosine: Float
    range_m: Float
    value: Float
    points: Float


@dataclass(frozen=True)
class FaceContrast:
    """A face's pixels against its level; rows upwards.

    Attributes
    ----------
    image : ContrastImage
        Rows downwards, as detection takes it; positive is darker.
    face : (rows, columns) bool array
        What belongs to the face.
    judged : (rows, columns) bool array
        Where its level is known and points are.
    points : (rows, columns) int array
    scans : (rows, columns) int array
        Bits of the scans that count; of more than 31 the last ones share one.
    incidence : (float, float)
        Least and greatest where it was judged, degrees.
    level, sigma : float
        Medians, dB.
    """

    image: ContrastImage
    face: Bool
    judged: Bool
    points: Int32
    scans: Int32
    incidence: tuple[float, float]
    level: float
    sigma: float


def observe_face(layout: Layout, sums: Sums, face: int, stations: Float, reference: ReferenceCurve | None) -> list[Observed]:
    """Pixels of a face as each scan saw them, with the incidence and range of their centres."""
    u, v = layout.centres(face)
    model, columns = layout.models[face], len(u)
    found = []
    for scan in np.flatnonzero(layout.start[face] >= 0).tolist():
        part = slice(layout.start[face, scan], layout.start[face, scan] + columns * len(v))
        count = sums.count[part]
        pixel = np.flatnonzero(count)
        if not len(pixel):
            continue
        row, column = np.divmod(pixel, columns)
        place = to_space(model, u[column], v[row])
        towards = stations[scan] - place
        range_m = np.linalg.norm(towards, axis=1)
        cosine = np.einsum("ni,ni->n", towards, normals_at(model, u[column], v[row])) / range_m
        points = count[pixel].astype(np.float64)
        value = sums.level[part][pixel] * STEP / points
        if reference is not None:
            value = value - reference(range_m)
        found.append(Observed(scan, pixel, cosine, range_m, value, points))
    return found


def curve_of(observed: list[Observed], model: Float, *, by_range: bool) -> LevelCurve:
    """Level of what one scan saw, of one face or of the faces of a member."""
    names = ("cosine", "range_m", "value", "points")
    arrays = [np.concatenate([getattr(one, name) for one in observed]) for name in names]
    return level_curve(*arrays, by_range=by_range and model[RADIUS] > 0.0)


def some_pixels(observed: list[Observed], inside: Bool) -> list[Observed]:
    """Those of the pixels that lie in a part of the face (rows, columns), for each scan that saw any."""
    found = []
    for one in observed:
        use = inside.ravel()[one.pixel]
        if use.any():
            rest = (array[use] for array in (one.cosine, one.range_m, one.value, one.points))
            found.append(Observed(one.scan, one.pixel[use], *rest))
    return found


def class_levels(observed: list[Observed]) -> dict[tuple[int, int], float]:
    """Median level of each class of cos θ of each scan that holds enough points, dB."""
    found = {}
    for one in observed:
        number = np.floor(one.cosine / CLASS).astype(np.int64)
        for klass in np.unique(number).tolist():
            use = number == klass
            if one.points[use].sum() >= FEWEST:
                found[one.scan, klass] = float(np.median(one.value[use]))
    return found


def contrast_of(layout: Layout, face: int, observed: list[Observed], curves: list[list[LevelCurve]]) -> FaceContrast:
    """Hold the pixels of a face against its level.

    Parameters
    ----------
    layout, face
        Which.
    observed : list of Observed
        By scan.
    curves : list of list of LevelCurve
        For each of these the face's own level, and what takes its place where that is not known, in this order.
    """
    left, bottom, columns, rows = layout.shape[face].tolist()
    side, size = float(layout.pixel[face]), rows * columns
    drop, weight, variance = np.zeros(size), np.zeros(size), np.zeros(size)
    held, scans = np.zeros(size, np.int64), np.zeros(size, np.int64)
    cosines, levels, sigmas = [np.empty(0)], [np.empty(0)], [np.empty(0)]
    far = [np.empty(0)]
    for one, known_by in zip(observed, curves, strict=True):
        held[one.pixel] += one.points.astype(np.int64)
        far.append(one.range_m)
        free = np.ones(len(one.pixel), np.bool_)
        for curve in known_by:
            use = np.flatnonzero(free & curve.known(one.cosine))
            if not len(use):
                continue
            free[use] = False
            at, n = one.pixel[use], one.points[use]
            level = curve(one.cosine[use], one.range_m[use])
            sigma = curve.sigmas(one.cosine[use])
            drop[at] += n * (level - one.value[use])
            weight[at] += n
            variance[at] += (n * sigma) ** 2
            scans[at] |= 1 << min(one.scan, 30)
            cosines.append(one.cosine[use])
            levels.append(level)
            sigmas.append(sigma)
    judged = weight > 0.0
    safe = np.where(judged, weight, 1.0)
    drop, sigma = drop / safe, np.sqrt(variance) / safe
    shape = (rows, columns)
    occupied = (held > 0).reshape(shape)
    whole = np.pad(occupied, CLOSING)
    whole = ndimage.binary_closing(whole, iterations=CLOSING)[CLOSING:-CLOSING, CLOSING:-CLOSING]
    every = np.concatenate(far)
    footprint = BEAM + DIVERGENCE * (float(np.median(every)) if len(every) else 0.0)
    rim = round(0.5 * footprint / side)
    within = ndimage.binary_erosion(whole, iterations=rim) if rim else whole
    if within.sum() < 0.3 * whole.sum():  # a strip as narrow as the beam is all rim
        within = whole
    judged2 = judged.reshape(shape) & within
    state = np.full(shape, PixelState.OFF, np.uint8)
    state[within & ~occupied] = PixelState.EMPTY
    state[judged2] = PixelState.LINING
    steps = np.where(judged2, np.clip(np.rint(drop.reshape(shape) / STEP), NODATA + 1, -NODATA - 1), NODATA)
    grid = FaceGrid(side, bottom, rows, left, columns)
    image = ContrastImage(
        grid,
        np.ascontiguousarray(state[::-1]),
        np.ascontiguousarray(steps[::-1].astype(np.int16)),
        1,
        np.ascontiguousarray(sigma.reshape(shape)[::-1].astype(np.float32)),
    )
    cosine, nothing = np.concatenate(cosines), float("nan")
    incidence = (nothing, nothing)
    if len(cosine):
        incidence = tuple(float(a) for a in np.degrees(np.arccos(np.clip([cosine.max(), cosine.min()], -1.0, 1.0))))  # type: ignore[assignment]
    return FaceContrast(
        image,
        whole,
        judged2,
        held.reshape(shape).astype(np.int32),
        scans.reshape(shape).astype(np.int32),
        incidence,
        float(np.median(np.concatenate(levels))) if len(cosine) else nothing,
        float(np.median(np.concatenate(sigmas))) if len(cosine) else nothing,
    )
