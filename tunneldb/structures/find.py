"""Steps from the sums of all faces to members, faces and spots."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy import ndimage, sparse

from tunneldb.arrays import Bool, Float, Int32, Int64
from tunneldb.radiometry.reference_curve import ReferenceCurve
from tunneldb.structures import profiles
from tunneldb.structures.contrast import FaceContrast, contrast_of, face_level, member_levels, observe_face, some_pixels
from tunneldb.structures.face_raster import Layout, Sums
from tunneldb.structures.joining import Extent, RangeImages, coplanar, is_rough, join
from tunneldb.structures.level import UNKNOWN
from tunneldb.structures.materials import Plane, parts_of_plane
from tunneldb.structures.models import AXIS, POINT, RADIUS, unroll
from tunneldb.structures.results import Face, LeftOut, Member, MemberKind, Spot, Structures, kind_of, outline_of
from tunneldb.structures.segmentation import Segmentation
from tunneldb.structures.significance import Scatter
from tunneldb.structures.solidity import closed, ray_densities, solid_faces
from tunneldb.structures.spots import BIMODAL, FaceSpots, extended, find_spots, without_design

MIN_FACE_AREA = 0.002
"""Minimum area of a face, m²."""

MIN_FILLED_SHARE = 0.35
"""Minimum share of a face's pixels with points, with holes of two pixels closed: gratings and leaves have less."""

MIN_FACE_WIDTH = 2.0
"""Minimum mean width of a face, in pixels: cables and edges are narrower."""


TURNS = 2
"""Number of iterations for the level."""


@dataclass(frozen=True)
class Found:
    """Members, faces and spots, and the means to find those of a point.

    Attributes
    ----------
    structures : Structures
    face_number, member_number : (k + 1,) int arrays
        Number of each face of the segmentation, 0 where it is none; the last is 0, for no face.
    places : list of (2, rows, columns) int arrays or None
        Numbers of face and member in each pixel of a face that is of several materials, rows upwards; None elsewhere.
    anomaly : list of int arrays or None
        Number of the spot in each pixel of a face, rows upwards; None where it has none.
    """

    structures: Structures
    face_number: Int32
    member_number: Int32
    places: list[Int32 | None]
    anomaly: list[Int32 | None]

    def of_points(self, face: Int32, pixel: Int32) -> tuple[Int32, Int32, Int32]:
        """Return the numbers of face, member and spot of points, from the result of `PointFinder.find`."""
        number, member = self.face_number[face], self.member_number[face]
        spot = np.zeros(len(face), np.int32)
        at = np.where(pixel < -1, -2 - pixel, pixel)
        held = np.flatnonzero(number > 0)
        held = held[np.argsort(face[held], kind="stable")]
        which = face[held]
        bounds = np.flatnonzero(np.diff(which, prepend=-1, append=-1))
        for begin, end in pairwise(bounds.tolist()):
            of, here = held[begin:end], int(which[begin])
            if (parts := self.places[here]) is not None:
                number[of], member[of] = parts.reshape(2, -1)[:, at[of]]
            if (spots := self.anomaly[here]) is not None:
                spot[of] = spots.ravel()[at[of]]
        return number, member, spot


def find_structures(
    found: Segmentation, sums: Sums, images: RangeImages, reference: ReferenceCurve | None, *, by_range: bool
) -> Found:
    """Join faces into members, and find spots on each face.

    Parameters
    ----------
    found : Segmentation
    sums : Sums
        Points and levels of all pixels, dB.
    images : RangeImages
        Sums of all points.
    reference : ReferenceCurve or None
        Curve for correcting levels for range.
    by_range : bool
        True if levels depend on range otherwise.
    """
    layout = found.layout
    parts = _parts(found, sums, images, reference)
    surfaces = _surfaces(parts)
    extents = [[part.extent for part in surface] for surface in surfaces]
    member_of = _numbers(profiles.group(extents, found.noise), extents)
    side_of = [int((member_of[:k] == number).sum()) + 1 for k, number in enumerate(member_of.tolist())]
    count = len(layout.models)
    places: list[Int32 | None] = [None] * count
    anomaly: list[Int32 | None] = [None] * count
    faces: list[Face] = []
    spots: list[Spot] = []
    face_number, member_number = np.zeros(count + 1, np.int32), np.zeros(count + 1, np.int32)
    pixels, scatter, omitted = int(np.count_nonzero(sums.count)), Scatter(), LeftOut()
    for number, side, surface in zip(member_of.tolist(), side_of, surfaces, strict=True):
        judged, design = _judge(found, sums, surface, reference, pixels, scatter, by_range=by_range)
        omitted += design
        for part, (contrast, here) in zip(surface, judged, strict=True):
            faces.append(_face(found, part, len(faces) + 1, number, side, contrast, here))
            face_number[part.face], member_number[part.face] = len(faces), number
            if part.inside is not None:
                rows_columns = part.inside.shape
                if places[part.face] is None:
                    places[part.face] = np.zeros((2, *rows_columns), np.int32)
                places[part.face][:, part.inside] = [[len(faces)], [number]]  # type: ignore[index]
            if here.spots:
                if anomaly[part.face] is None:
                    anomaly[part.face] = np.zeros(here.numbers.shape, np.int32)
                marked = here.numbers > 0
                anomaly[part.face][marked] = here.numbers[marked] + len(spots)  # type: ignore[index]
            spots += [
                Spot(
                    len(spots) + place, len(faces), number, spot.kind, spot.reasons, spot.confidence, spot.contrast,
                    spot.difference, spot.area, spot.points, spot.scans, spot.outline,
                )
                for place, spot in enumerate(here.spots, start=1)
            ]  # fmt: skip
    members = _members(faces, member_of, extents, found.origin)
    return Found(Structures(members, faces, spots, omitted), face_number, member_number, places, anomaly)


@dataclass(frozen=True)
class _Part:
    """A face of the segmentation, or the part of it that is of one material.

    Attributes
    ----------
    face : int
    inside : (rows, columns) bool array or None
        Its pixels; None for all.
    extent : Extent
    surface : (int, int)
        Number of the joined surface, and of the material.
    """

    face: int
    inside: Bool | None
    extent: Extent
    surface: tuple[int, int]


def _parts(found: Segmentation, sums: Sums, images: RangeImages, reference: ReferenceCurve | None) -> list[_Part]:
    """Return faces that are large and filled enough, joined behind objects in front of them, and split by material."""
    layout = found.layout
    held, extents, densities = {}, {}, []
    for face in range(len(layout.models)):
        points, scans = _points(layout, sums, face)
        columns, rows = layout.shape[face, 2:]
        points = points.reshape(rows, columns)
        extent = _extent(layout, face, points, scans, float(found.faces.rms[face]))
        if extent is not None:
            held[face], extents[face] = points, extent
            seen = observe_face(layout, sums, face, found.stations, reference)
            densities.append(ray_densities(layout, face, seen, found.stations))
    solid = solid_faces(np.array(densities).reshape(len(extents), len(found.stations), 2))
    for face in [face for face, good in zip(extents, solid, strict=True) if not good]:
        del held[face], extents[face]
    order = sorted(extents, key=lambda face: -extents[face].points)
    joined = dict(zip(order, join([extents[face] for face in order], images, found.noise).tolist(), strict=True))
    parts = {face: [_Part(face, None, extents[face], (joined[face], 0))] for face in order}
    for faces in _planes(extents, found.noise):
        by_face = [observe_face(layout, sums, face, found.stations, reference) for face in faces]
        materials = parts_of_plane(layout, faces, by_face)
        if materials is None:
            continue
        for face, material in zip(faces, materials, strict=True):
            parts[face] = []
            of = material.reshape(held[face].shape)
            for which in np.unique(of[held[face] > 0]).tolist():
                inside = of == which
                own = _extent(layout, face, np.where(inside, held[face], 0), extents[face].scans, extents[face].rms)
                if own is not None:
                    parts[face].append(_Part(face, inside, own, (joined[face], which)))
    return sorted((part for of in parts.values() for part in of), key=lambda part: -part.extent.points)


def _surfaces(parts: list[_Part]) -> list[list[_Part]]:
    """Group parts by their surface, the largest surface first."""
    of: dict[tuple[int, int], list[_Part]] = {}
    for part in parts:
        of.setdefault(part.surface, []).append(part)
    return sorted(of.values(), key=lambda surface: -sum(part.extent.outline.area for part in surface))


def _numbers(member: Int64, surfaces: list[list[Extent]]) -> Int64:
    """Renumber the members (n,) of surfaces from 1, the largest first."""
    sizes = np.bincount(member, [sum(extent.outline.area for extent in surface) for surface in surfaces])
    number = np.empty(len(sizes), np.int64)
    number[np.argsort(-sizes, kind="stable")] = np.arange(1, len(sizes) + 1)
    return number[member]


def _planes(extents: dict[int, Extent], noise: float) -> list[list[int]]:
    """Group flat faces in one plane, the largest first; a single face is also a plane."""
    flat = sorted((face for face in extents if extents[face].model[RADIUS] == 0.0), key=lambda face: -extents[face].points)
    pairs = np.array(coplanar([extents[face] for face in flat], noise), np.int64).reshape(-1, 2)
    graph = sparse.coo_array((np.ones(len(pairs), np.int8), tuple(pairs.T)), shape=(len(flat), len(flat)))
    label = sparse.csgraph.connected_components(graph, directed=False)[1] if flat else np.empty(0, np.int32)
    return [[flat[k] for k in np.flatnonzero(label == number).tolist()] for number in np.unique(label).tolist()]


def _extent(layout: Layout, face: int, held: Int64, scans: tuple[int, ...], rms: float) -> Extent | None:
    """Return the extent of a face from the points in its pixels; None if there is none."""
    occupied = held > 0
    if not occupied.any():
        return None
    side = float(layout.pixel[face])
    mask = closed(occupied, 2)
    if mask.sum() * side**2 < 0.5 * MIN_FACE_AREA:  # drawing outlines takes longest; straightened ones hardly have another area
        return None
    outline = outline_of(mask, int(layout.shape[face, 0]), int(layout.shape[face, 1]), side)
    area = outline.area
    if area < MIN_FACE_AREA or occupied.sum() * side**2 < MIN_FILLED_SHARE * area:
        return None
    if 2.0 * area / max(outline.length, 1e-9) < MIN_FACE_WIDTH * side:
        return None
    return Extent(layout.models[face], outline, side, scans, float(held.sum()), rms)


def _points(layout: Layout, sums: Sums, face: int) -> tuple[Int64, tuple[int, ...]]:
    """Count the points in each pixel of a face, and return the scans they are from."""
    size = int(layout.shape[face, 2] * layout.shape[face, 3])
    held, scans = np.zeros(size, np.int64), []
    for scan in np.flatnonzero(layout.start[face] >= 0).tolist():
        count = sums.count[layout.start[face, scan] :][:size]
        if count.any():
            held += count
            scans.append(scan)
    return held, tuple(scans)


def _judge(
    found: Segmentation,
    sums: Sums,
    parts: list[_Part],
    reference: ReferenceCurve | None,
    pixels: int,
    scatter: Scatter,
    *,
    by_range: bool,
) -> tuple[list[tuple[FaceContrast, FaceSpots]], LeftOut]:
    """Compute contrast and spots of the faces of a member, and count the regions that are left out.

    If there are spots the level is found again without them, because they distort it.
    """
    layout = found.layout
    observed = []
    for part in parts:
        seen_by = observe_face(layout, sums, part.face, found.stations, reference)
        observed.append(seen_by if part.inside is None else some_pixels(seen_by, part.inside))
    out: list[tuple[FaceContrast, FaceSpots]] = []
    bare, omitted = observed, LeftOut()
    places = Plane.of(layout, [part.face for part in parts]).place if len(parts) > 1 else None
    for turn in range(TURNS):
        levels = member_levels(bare, layout.models[parts[0].face], places, by_range=by_range)
        before, out = scatter.copy(), []
        for part, seen, rest in zip(parts, observed, bare, strict=True):
            piece = len(parts) > 1 and is_rough(part.extent, found.noise)
            own = {one.scan: face_level(levels[one.scan], one, piece=piece) for one in rest}
            curves = [own.get(one.scan, levels.get(one.scan, UNKNOWN)) for one in seen]
            contrast = contrast_of(layout, part.face, seen, curves, found.noise)
            out.append((contrast, find_spots(contrast, pixels, scatter)))
        pipe = bool(layout.models[parts[0].face][RADIUS] > 0.0)
        out, omitted = without_design(out, pipe=pipe)
        # A faint label may be complete only when its region is extended.
        out, more = without_design([(contrast, extended(contrast, spots)) for contrast, spots in out], pipe=pipe)
        omitted += more
        if turn == TURNS - 1 or not any(spots.spots for _, spots in out):
            break
        scatter.restore(before)
        bare = [some_pixels(seen, ~_about(spots.numbers > 0)) for seen, (_, spots) in zip(observed, out, strict=True)]
    return out, omitted


def _about(spots: Bool) -> Bool:
    """Add the surroundings to spots."""
    return np.asarray(ndimage.binary_dilation(spots, iterations=2)) if spots.any() else spots


def _face(
    found: Segmentation, part: _Part, number: int, member: int, side: int, contrast: FaceContrast, spots: FaceSpots
) -> Face:
    model, extent = found.layout.models[part.face], part.extent
    whole = int(contrast.face.sum())
    return Face(
        number,
        member,
        side,
        kind_of(model),
        model,
        found.origin,
        int(contrast.points.sum()),
        float(extent.outline.area),
        float(model[RADIUS]),
        float(found.faces.rms[part.face]),
        spots.seen / whole if whole else 0.0,
        contrast.incidence,
        contrast.level,
        contrast.sigma,
        spots.share >= BIMODAL,
        extent.outline,
    )


def _members(faces: list[Face], member_of: Int64, surfaces: list[list[Extent]], origin: Float) -> list[Member]:
    """Make members of faces from surfaces with known members (n,)."""
    on: dict[int, list[Face]] = {}
    sides: dict[int, list[list[Extent]]] = {}
    for face in faces:
        on.setdefault(face.member, []).append(face)
    for number, surface in zip(member_of.tolist(), surfaces, strict=True):
        sides.setdefault(number, []).append(surface)
    return [_member(number, on[number], sides[number], origin) for number in sorted(on)]


def _member(number: int, faces: list[Face], sides: list[list[Extent]], origin: Float) -> Member:
    """Make a member, with its line along the axis of a pipe, else along the middle of its longest side."""
    kind: MemberKind = "profile" if len(sides) > 1 else faces[0].kind
    if kind == "pipe":
        model = sides[0][0].model
        along, _, _ = unroll(model, profiles.places_of(sides[0]))
        line = model[POINT] + np.multiply.outer(np.array([along.min(), along.max()]), model[AXIS])
    else:
        line = profiles.middle_line([profiles.box_of(side) for side in sides])
    judged = sum(face.seen_share * face.area for face in faces)
    differs = sum(face.seen_share * face.area for face in faces if face.bimodal)
    return Member(
        number,
        kind,
        tuple(face.number for face in faces),
        sum(face.area for face in faces),
        float(np.linalg.norm(line[1] - line[0])),
        origin + line,
        bool(judged and differs > 0.5 * judged),
    )
