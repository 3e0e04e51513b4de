"""Plain records of structures: places, earlier results, and changes to them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import shapely
from shapely.geometry import Polygon

from tunneldb.arrays import Float
from tunneldb.structures.results import Structures


@dataclass(frozen=True)
class PlacedFace:
    """Place of a face.

    Attributes
    ----------
    surface : geometry
        Outline in space, with Z, m.
    chainage : float or None
        Chainage of its middle, m; None of a site or beyond the sections.
    """

    surface: shapely.Geometry
    chainage: float | None


@dataclass(frozen=True)
class PlacedSpot:
    """Place of a spot: on its face, and its outline on the map."""

    surface: shapely.Geometry
    map: Polygon
    chainage: float | None


@dataclass(frozen=True)
class PlacedStructures:
    """Structures and their places, in the order of ``structures``.

    Attributes
    ----------
    structures : Structures
    members : list of (float or None)
        Chainage of the middle of each member's line, m.
    faces : list of PlacedFace
    spots : list of PlacedSpot
    """

    structures: Structures
    members: list[float | None]
    faces: list[PlacedFace]
    spots: list[PlacedSpot]


@dataclass(frozen=True)
class EarlierSpot:
    """A spot of an earlier run of the survey, or of another survey of the same structure.

    Attributes
    ----------
    id : int
        Key.
    number : int
        Its number in the tunnel or site.
    kind : {'dark', 'bright'}
    reviewed : bool
        True if an inspector reviewed it or wrote a remark.
    vertices : (n, 3) float array
        Its outline in space, m.
    """

    id: int
    number: int
    kind: Literal["dark", "bright"]
    reviewed: bool
    vertices: Float


@dataclass(frozen=True)
class SpotReconciliation:
    """Changes to the spots of a survey.

    Attributes
    ----------
    insert : dict of int to int
        Index of a spot that was found for the first time in this survey → its number.
    update : dict of int to int
        Index of a spot → key of the earlier spot that it is.
    keep, delete : list of int
        Keys of earlier spots that were not found again: the reviewed ones stay, the others are deleted.
    """

    insert: dict[int, int]
    update: dict[int, int]
    keep: list[int]
    delete: list[int]
