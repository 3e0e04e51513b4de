"""From the sums of all faces to members, faces and spots: the list of the steps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from tunneldb.arrays import Float, Int32, Int64
from tunneldb.radiometry.reference_curve import ReferenceCurve
from tunneldb.structures.contrast import FaceContrast, Observed, contrast_of, curve_of, observe_face
from tunneldb.structures.face_raster import Layout, Sums
from tunneldb.structures.joining import Extent, RangeImages, join
from tunneldb.structures.models import AXIS, RADIUS, to_space, unroll
from tunneldb.structures.results import Face, Member, Spot, Structures, kind_of, outline_of
from tunneldb.structures.segmentation import Segmentation
from tunneldb.structures.spots import BIMODAL, FaceSpots, find_spots

LEAST_AREA = 0.002
"""Faces that are smaller are none, m²."""

LEAST_FILLED = 0.35
"""Share of its pixels that hold points, holes of two pixels closed: gratings and leaves have less."""

LEAST_WIDTH = 2.0
"""Mean width of a face, in pixels: less is a cable or an edge."""


@dataclass(frozen=True)
class Found:
    """What is found, and how to tell a point's.

    Attributes
    ----------
    structures : Structures
    face_number, member_number : (k + 1,) int arrays
        Number of each face of the segmentation, 0 where it is none; the last is 0, for no face.
    anomaly : list of int arrays or None
        Number of the spot in each pixel of a face, rows upwards; None where it has none.
    """

    structures: Structures
    face_number: Int32
    member_number: Int32
    anomaly: list[Int32 | None]

    def of_points(self, face: Int32, pixel: Int32) -> tuple[Int32, Int32, Int32]:
        """Number of face, member and spot of points, by what `PointFinder.find` says of them."""
        number, member = self.face_number[face], self.member_number[face]
        spot = np.zeros(len(face), np.int32)
        at = np.where(pixel < -1, -2 - pixel, pixel)
        held = np.flatnonzero(number > 0)
        held = held[np.argsort(face[held], kind="stable")]
        which = face[held]
        bounds = np.flatnonzero(np.diff(which, prepend=-1, append=-1))
        for begin, end in zip(bounds[:-1], bounds[1:], strict=True):
            numbers = self.anomaly[int(which[begin])]
            if numbers is not None:
                of = held[begin:end]
                spot[of] = numbers.ravel()[at[of]]
        return number, member, spot


def find_structures(
    found: Segmentation, sums: Sums, images: RangeImages, reference: ReferenceCurve | None, *, by_range: bool
) -> Found:
    """Join faces into members, and find on each face what differs from it.

    Parameters
    ----------
    found : Segmentation
    sums : Sums
        Points and levels of all pixels, dB.
    images : RangeImages
        Of all points.
    reference : ReferenceCurve or None
        By which levels are corrected for range.
    by_range : bool
        Whether levels go by range otherwise.
    """
    layout = found.layout
    kept, extents = _faces_that_are(found, sums)
    member_of = join(extents, images, found.noise)
    count = len(layout.models)
    anomaly: list[Int32 | None] = [None] * count
    faces: list[Face] = []
    spots: list[Spot] = []
    members: list[Member] = []
    face_number, member_number = np.zeros(count + 1, np.int32), np.zeros(count + 1, np.int32)
    sizes = np.bincount(member_of, [extent.outline.area for extent in extents], minlength=0)
    for number, member in enumerate(np.argsort(-sizes, kind="stable").tolist(), start=1):
        of = np.flatnonzero(member_of == member).tolist()
        judged = _judge(layout, sums, [kept[k] for k in of], found.stations, reference, by_range=by_range)
        first = len(faces)
        for k, (contrast, found_spots) in zip(of, judged, strict=True):
            face = kept[k]
            faces.append(_face(found, face, len(faces) + 1, number, extents[k], contrast, found_spots))
            face_number[face], member_number[face] = len(faces), number
            anomaly[face] = np.where(found_spots.numbers > 0, found_spots.numbers + len(spots), 0) if found_spots.spots else None
            spots += [
                Spot(
                    len(spots) + place, len(faces), number, spot.kind, spot.reasons, spot.confidence, spot.contrast,
                    spot.difference, spot.area, spot.points, spot.scans, spot.outline,
                )
                for place, spot in enumerate(found_spots.spots, start=1)
            ]  # fmt: skip
        members.append(_member(number, faces[first:], [extents[k] for k in of], found.origin))
    return Found(Structures(members, faces, spots), face_number, member_number, anomaly)


def _faces_that_are(found: Segmentation, sums: Sums) -> tuple[list[int], list[Extent]]:
    """Faces that are large and filled enough to be some."""
    layout, kept, extents = found.layout, [], []
    for face in range(len(layout.models)):
        held, scans = _points(layout, sums, face)
        columns, rows = layout.shape[face, 2:]
        occupied = held.reshape(rows, columns) > 0
        side = float(layout.pixel[face])
        outline = outline_of(_closed(occupied), int(layout.shape[face, 0]), int(layout.shape[face, 1]), side)
        area = outline.area
        if area < LEAST_AREA or occupied.sum() * side**2 < LEAST_FILLED * area:
            continue
        if 2.0 * area / max(outline.length, 1e-9) < LEAST_WIDTH * side:
            continue
        kept.append(face)
        extents.append(Extent(layout.models[face], outline, side, scans, float(held.sum())))
    return kept, extents


def _closed(occupied: np.ndarray) -> np.ndarray:  # type: ignore[type-arg]
    from scipy import ndimage

    padded = np.pad(occupied, 2)
    return np.asarray(ndimage.binary_closing(padded, iterations=2)[2:-2, 2:-2])


def _points(layout: Layout, sums: Sums, face: int) -> tuple[Int64, tuple[int, ...]]:
    """Points in each pixel of a face, and which scans they are of."""
    size = int(layout.shape[face, 2] * layout.shape[face, 3])
    held, scans = np.zeros(size, np.int64), []
    for scan in np.flatnonzero(layout.start[face] >= 0).tolist():
        count = sums.count[layout.start[face, scan] :][:size]
        if count.any():
            held += count
            scans.append(scan)
    return held, tuple(scans)


def _judge(
    layout: Layout, sums: Sums, faces: list[int], stations: Float, reference: ReferenceCurve | None, *, by_range: bool
) -> list[tuple[FaceContrast, FaceSpots]]:
    """Contrast and spots of the faces of a member; where a face has too few points it borrows the member's level."""
    observed = [observe_face(layout, sums, face, stations, reference) for face in faces]
    by_scan: dict[int, list[Observed]] = {}
    for one in observed:
        for seen in one:
            by_scan.setdefault(seen.scan, []).append(seen)
    model = layout.models[faces[0]]
    common = {
        scan: curve_of(seen, model, by_range=by_range) for scan, seen in by_scan.items() if len(faces) > 1
    }
    out = []
    for face, one in zip(faces, observed, strict=True):
        curves = [
            [curve_of([seen], model, by_range=by_range), *([common[seen.scan]] if seen.scan in common else [])] for seen in one
        ]
        contrast = contrast_of(layout, face, one, curves)
        out.append((contrast, find_spots(contrast)))
    return out


def _face(
    found: Segmentation, face: int, number: int, member: int, extent: Extent, contrast: FaceContrast, spots: FaceSpots
) -> Face:
    model = found.layout.models[face]
    whole = int(contrast.face.sum())
    return Face(
        number,
        member,
        kind_of(model),
        model,
        found.origin,
        int(contrast.points.sum()),
        float(extent.outline.area),
        float(model[RADIUS]),
        float(found.faces.rms[face]),
        spots.seen / whole if whole else 0.0,
        contrast.incidence,
        contrast.level,
        contrast.sigma,
        spots.share >= BIMODAL,
        extent.outline,
    )


def _member(number: int, faces: list[Face], extents: list[Extent], origin: Float) -> Member:
    """A member, its line along the axis of a pipe, else along its longest side."""
    model = extents[0].model
    places = []
    for extent in extents:
        at = shapely.get_coordinates(extent.outline)
        places.append(to_space(extent.model, at[:, 0], at[:, 1]))
    u, v, _ = unroll(model, np.concatenate(places))
    area = sum(face.area for face in faces)
    if model[RADIUS] > 0.0:
        ends = np.array([u.min(), u.max()])
        line = origin + model[:3] + np.multiply.outer(ends, model[AXIS])
        length = float(ends[1] - ends[0])
    else:
        box = shapely.get_coordinates(shapely.minimum_rotated_rectangle(shapely.MultiPoint(np.column_stack([u, v]))))
        if len(box) < 5:
            box = np.array([[u.min(), v.min()], [u.max(), v.min()], [u.max(), v.max()], [u.min(), v.max()]])
        first, second = np.linalg.norm(box[1] - box[0]), np.linalg.norm(box[2] - box[1])
        pairs = ((0, 3), (1, 2)) if first >= second else ((0, 1), (2, 3))
        ends = np.array([0.5 * (box[a] + box[b]) for a, b in pairs])
        line = origin + to_space(model, ends[:, 0], ends[:, 1])
        length = float(max(first, second))
    judged = sum(face.seen_share * face.area for face in faces)
    differs = sum(face.seen_share * face.area for face in faces if face.bimodal)
    return Member(
        number, faces[0].kind, tuple(face.number for face in faces), area, length, line, bool(judged and differs > 0.5 * judged)
    )
