"""Compare the spots of earlier runs and surveys with those found now: which to insert, update, keep or delete."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon

from tunneldb.anomalies.matching import match
from tunneldb.arrays import Float
from tunneldb.structures.models import unroll
from tunneldb.structures.records import EarlierSpot, SpotReconciliation
from tunneldb.structures.results import Face, Spot, Structures

MAX_VERTEX_DISTANCE = 0.05
"""Maximum distance of the vertices of an earlier spot from its face, m: registration of scans is better than that."""


def reconcile_spots(found: Structures, own: Sequence[EarlierSpot], others: Sequence[EarlierSpot]) -> SpotReconciliation:
    """Match each spot with an earlier one, number it, and decide what happens to the others.

    A spot is an earlier one of its kind if the two overlap best with each other on the same face, by at least 0.3 of their
    union. One that was found in another survey of the tunnel or site has that one's number.

    Parameters
    ----------
    found : Structures
    own : sequence of EarlierSpot
        Spots of an earlier run of the survey.
    others : sequence of EarlierSpot
        Spots of the other surveys, one of each number.
    """
    faces = {face.number: face for face in found.faces}
    again = _matches(found.spots, faces, own)
    known = _matches(found.spots, faces, others)
    # A number that another spot has already, of this survey or another, is not given twice.
    taken = {one.number for one in own}
    last = max((one.number for one in [*own, *others]), default=0)
    insert = {}
    for k in range(len(found.spots)):
        if k in again:
            continue
        number = others[known[k]].number if k in known else None
        if number is None or number in taken:
            last += 1
            number = last
        taken.add(number)
        insert[k] = number
    lost = [one for k, one in enumerate(own) if k not in again.values()]
    return SpotReconciliation(
        insert,
        {k: own[before].id for k, before in again.items()},
        [one.id for one in lost if one.reviewed],
        [one.id for one in lost if not one.reviewed],
    )


def _matches(spots: Sequence[Spot], faces: dict[int, Face], earlier: Sequence[EarlierSpot]) -> dict[int, int]:
    """Return the index of a spot → the index of the earlier one that it is."""
    found: dict[int, int] = {}
    if not earlier:
        return found
    of_face: dict[tuple[int, str], list[int]] = {}
    for k, spot in enumerate(spots):
        of_face.setdefault((spot.face, spot.kind), []).append(k)
    boxes = [
        (one.vertices.min(axis=0) - MAX_VERTEX_DISTANCE, one.vertices.max(axis=0) + MAX_VERTEX_DISTANCE) for one in earlier
    ]
    for (number, kind), of in of_face.items():
        face = faces[number]
        low, high = _box(face)
        near = [
            k for k, one in enumerate(earlier)
            if one.kind == kind and k not in found.values() and (boxes[k][0] <= high).all() and (boxes[k][1] >= low).all()
        ]  # fmt: skip
        outlines = [(k, outline) for k in near if (outline := _on_face(face, earlier[k].vertices)) is not None]
        pairs = match([outline for _, outline in outlines], [spots[k].outline for k in of])
        found |= {of[now]: outlines[before][0] for now, before in pairs.items()}
    return found


def _box(face: Face) -> tuple[NDArray[Any], NDArray[Any]]:
    at = shapely.get_coordinates(face.in_space(face.outline), include_z=True)
    return at.min(axis=0), at.max(axis=0)


def _on_face(face: Face, vertices: Float) -> Polygon | None:
    """Return the outline of these vertices in a face's unrolled coordinates; None if they do not lie on it."""
    u, v, off = unroll(face.model, vertices - face.origin)
    if np.abs(off).max() > MAX_VERTEX_DISTANCE:
        return None
    outline = shapely.make_valid(Polygon(np.column_stack([u, v])))
    return outline if outline.area > 0.0 else None
