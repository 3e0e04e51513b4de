"""Contrast of each pixel of a face with the face's own level, scan by scan and for all scans together."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.arrays import Bool, Float, Int32, Int64
from tunneldb.radiometry.reference_curve import ReferenceCurve
from tunneldb.radiometry.robust_statistics import robust_statistics
from tunneldb.raster.geotiff import NODATA
from tunneldb.raster.grid import FaceGrid
from tunneldb.raster.state import PixelState
from tunneldb.structures.face_raster import BEAM, DIVERGENCE, STEP, TOLERANCE, Layout, Sums
from tunneldb.structures.level import MAX_PAIRS, MIN_LEVEL_POINTS, OWN, SHORTH, LevelCurve, level_curve
from tunneldb.structures.models import RADIUS, normals_at, to_space

LAGS = (2, 5)
"""Distance, in pixels, of places whose levels are compared: few of these pairs span the edge of a spot."""

MIN_OWN_SHARE = 0.2
"""Minimum share of a face at its member's level; otherwise its own level counts."""

UNIFORM = 0.6
"""Minimum share of a face at its own level for it to be of another material."""

CLOSING = 2
"""Maximum size of holes, in pixels, that are gaps between points and not holes of the face."""


@dataclass(frozen=True)
class Observed:
    """Pixels of a face as one scan saw them.

    Attributes
    ----------
    scan : int
    columns : int
        Pixels of the face.
    pixel : (n,) int array
        Row × columns + column, in growing order.
    angle, range_m, value, points : (n,) float arrays
        Classes of incidence, radians, range, m, mean level, corrected for range if known, dB, number of points.
    """

    scan: int
    columns: int
    pixel: Int64
    angle: Float
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
        Pixels that belong to the face.
    judged : (rows, columns) bool array
        Pixels with points and a known level.
    rim : int
        Pixels along its edge that are not judged.
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
    rim: int
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
        angle = np.arccos(np.clip(cosine, -1.0, 1.0))
        found.append(Observed(scan, columns, pixel, angle, range_m, value, points))
    return found


def member_levels(
    parts: list[list[Observed]], model: Float, places: list[Int64] | None = None, *, by_range: bool
) -> dict[int, LevelCurve]:
    """Return the level of a member's surface as each scan saw it: of all its faces, from the same places for all scans.

    If one scan saw more rust than paint, the others show which is which.

    Parameters
    ----------
    parts : list of list of Observed
        Each face as the scans saw it.
    model : (WIDTH,) float array
        Model of the largest face.
    places : list of int arrays, optional
        Place on the surface of each pixel of each face: scans whose faces were not merged see the same places. Without it
        each face has its own.
    by_range : bool
        True if levels depend on range.
    """
    by_scan: dict[int, list[tuple[int, Observed]]] = {}
    for face, part in enumerate(parts):
        for one in part:
            by_scan.setdefault(one.scan, []).append((face, one))
    points = {scan: sum(one.points.sum() for _, one in seen) for scan, seen in by_scan.items()}
    known: dict[int, list[Int64]] = {}  # by face, or of the whole surface
    curves = {}
    for scan in sorted(by_scan, key=lambda scan: -points[scan]):
        seen = [one for _, one in by_scan[scan]]
        at_places = [(face, one.pixel) if places is None else (-1, places[face][one.pixel]) for face, one in by_scan[scan]]
        own = [np.isin(at, np.concatenate(known.get(face, [np.empty(0, np.int64)]))) for face, at in at_places]
        curve = curves[scan] = curve_of(seen, model, np.concatenate(own), by_range=by_range)
        for (face, at), one in zip(at_places, seen, strict=True):
            use = curve.known(one.angle)
            use[use] = curve.own(one.angle[use], one.range_m[use], one.value[use])
            known.setdefault(face, []).append(at[use])
    return curves


def face_level(curve: LevelCurve, one: Observed, *, piece: bool = False) -> LevelCurve:
    """Return the level of a face: its member's, shifted by the face's offset; unshifted if the whole face is off.

    Parameters
    ----------
    curve : LevelCurve
        Level of the member.
    one : Observed
        The face as a scan saw it.
    piece : bool
        True if the face is a piece of a rough wall: it has no material of its own, so a stain may cover it.
    """
    use = np.flatnonzero(curve.known(one.angle))
    if one.points[use].sum() < MIN_LEVEL_POINTS:
        return curve
    rest = one.value[use] - curve(one.angle[use], one.range_m[use])
    sigma = curve.sigmas(one.angle[use])
    own = np.abs(rest) < OWN * sigma
    if own.mean() < MIN_OWN_SHARE:
        if piece:
            return curve
        mode = robust_statistics(rest, SHORTH, two_sided=True)
        own = np.abs(rest - mode.mean) < OWN * sigma
        if own.mean() < UNIFORM:
            return curve
    return replace(curve, level=curve.level + float(np.mean(rest[own])))


def curve_of(
    observed: list[Observed], model: Float, own: Bool | None = None, *, by_range: bool, one_surface: bool = True
) -> LevelCurve:
    """Return the level of what one scan saw of one face or of the faces of a member; see `level_curve`."""
    angle, range_m, value, points = (
        np.concatenate([getattr(one, name) for one in observed]) for name in ("angle", "range_m", "value", "points")
    )
    starts = np.cumsum([0, *(len(one.pixel) for one in observed)])
    step = -(-2 * len(LAGS) * len(value) // MAX_PAIRS)
    pairs = np.concatenate([_pairs(one, step) + start for one, start in zip(observed, starts[:-1], strict=True)])
    by_range = by_range and model[RADIUS] > 0.0
    return level_curve(angle, range_m, value, points, pairs, own, by_range=by_range, one_surface=one_surface)


def _pairs(one: Observed, step: int) -> Int64:
    """Return pairs (m, 2) of nearby pixels in their row or column, every n-th of each kind."""
    found = [np.empty((0, 2), np.int64)]
    aparts = [lag * width for lag in LAGS for width in (1, one.columns)]
    for number, apart in enumerate(aparts):
        first = np.arange(number * step // len(aparts), len(one.pixel), step)
        pixel = one.pixel[first]
        inside = pixel % one.columns + apart < one.columns if apart < one.columns else np.ones(len(first), np.bool_)
        there = np.searchsorted(one.pixel, pixel + apart)
        held = inside & (one.pixel[np.minimum(there, len(one.pixel) - 1)] == pixel + apart)
        found.append(np.column_stack([first[held], there[held]]))
    return np.concatenate(found)


def some_pixels(observed: list[Observed], inside: Bool) -> list[Observed]:
    """Select the pixels in a part of the face (rows, columns), for each scan that saw any."""
    found = []
    for one in observed:
        use = inside.ravel()[one.pixel]
        if use.any():
            rest = (array[use] for array in (one.angle, one.range_m, one.value, one.points))
            found.append(Observed(one.scan, one.columns, one.pixel[use], *rest))
    return found


def contrast_of(layout: Layout, face: int, observed: list[Observed], curves: list[LevelCurve], noise: float) -> FaceContrast:
    """Compare the pixels of a face with its level.

    Parameters
    ----------
    layout, face
        Number of the face.
    observed : list of Observed
        Levels by scan.
    curves : list of LevelCurve
        The face's level for each of these.
    noise : float
        Standard deviation of ranges, m: near its edge, points of an adjoining face may be on it.
    """
    left, bottom, columns, rows = layout.shape[face].tolist()
    side, size = float(layout.pixel[face]), rows * columns
    drop, weight, variance = np.zeros(size), np.zeros(size), np.zeros(size)
    held, scans = np.zeros(size, np.int64), np.zeros(size, np.int64)
    angles, levels, sigmas = [np.empty(0)], [np.empty(0)], [np.empty(0)]
    far = [np.empty(0)]
    for one, curve in zip(observed, curves, strict=True):
        held[one.pixel] += one.points.astype(np.int64)
        far.append(one.range_m)
        use = np.flatnonzero(curve.known(one.angle))
        at, n = one.pixel[use], one.points[use]
        level = curve(one.angle[use], one.range_m[use])
        sigma = curve.sigmas(one.angle[use])
        drop[at] += n * (level - one.value[use])
        weight[at] += n
        variance[at] += (n * sigma) ** 2
        scans[at] |= 1 << min(one.scan, 30)
        angles.append(one.angle[use])
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
    rim = int(np.ceil((0.5 * footprint + TOLERANCE * noise) / side))
    within = ndimage.binary_erosion(whole, iterations=rim) if rim else whole
    if within.sum() < 0.3 * whole.sum():  # a strip as narrow as the beam is all rim
        within, rim = whole, 0
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
    angle, nothing = np.concatenate(angles), float("nan")
    incidence = (nothing, nothing)
    if len(angle):
        incidence = float(np.degrees(angle.min())), float(np.degrees(angle.max()))
    return FaceContrast(
        image,
        whole,
        judged2,
        rim,
        held.reshape(shape).astype(np.int32),
        scans.reshape(shape).astype(np.int32),
        incidence,
        float(np.median(np.concatenate(levels))) if len(angle) else nothing,
        float(np.median(np.concatenate(sigmas))) if len(angle) else nothing,
    )
