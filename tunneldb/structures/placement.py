"""Place structures on the map, in space and along the tunnel."""

from __future__ import annotations

import numpy as np
import shapely

from tunneldb.arrays import Float
from tunneldb.geometry.surface import Surface
from tunneldb.structures.records import PlacedFace, PlacedSpot, PlacedStructures
from tunneldb.structures.results import Structures


def place_structures(found: Structures, surface: Surface | None) -> PlacedStructures:
    """Place members, faces and spots; without a surface, as of a site, they have no chainage."""
    by_number = {face.number: face for face in found.faces}
    faces = [face.in_space(face.outline) for face in found.faces]
    spots = [by_number[spot.face].in_space(spot.outline) for spot in found.spots]
    return PlacedStructures(
        found,
        [_chainage(member.line.mean(axis=0), surface) for member in found.members],
        [PlacedFace(solid, _chainage(_middle(solid), surface)) for solid in faces],
        [
            PlacedSpot(solid, by_number[spot.face].on_map(spot.outline), _chainage(_middle(solid), surface))
            for spot, solid in zip(found.spots, spots, strict=True)
        ],
    )


def _middle(solid: shapely.Geometry) -> Float:
    return np.asarray(shapely.get_coordinates(solid, include_z=True).mean(axis=0), dtype=np.float64)


def _chainage(place: Float, surface: Surface | None) -> float | None:
    if surface is None:
        return None
    chainage = float(surface.unroll(place[None]).chainage[0])
    return chainage if np.isfinite(chainage) else None
