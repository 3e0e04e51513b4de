"""Design alignments from IFC 4.3: the segments of IfcAlignmentHorizontal and IfcAlignmentVertical.

Only the design parameters are read, not the file's geometry. Needs ifcopenshell (the extra ``ifc``).
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tunneldb.alignment.design import Design, StationPiece
from tunneldb.alignment.elements import PlanElement, PlanKind, ProfileElement, ProfileKind
from tunneldb.errors import InputError, UserError
from tunneldb.files import require_at_most

PLAN: dict[str, PlanKind] = {"LINE": "line", "CIRCULARARC": "arc", "CLOTHOID": "clothoid"}
PROFILE: dict[str, ProfileKind] = {"CONSTANTGRADIENT": "grade", "PARABOLICARC": "parabola", "CIRCULARARC": "circle"}

STATION_TOLERANCE = 0.001  # m; tolerance for a station that continues the previous piece
SCHEMAS = ("IFC4X3", "IFC4X3_TC1", "IFC4X3_ADD1", "IFC4X3_ADD2")
_END = "END-ISO-10303-21"
_END_WITHIN = 1000  # characters at the end of a file that contain it
_MAX_MEGABYTES = 200  # ifcopenshell takes eleven times that of memory
_STRING_OR_COMMENT = re.compile(r"('(?:[^']|'')*')|/\*.*?\*/", re.DOTALL)
_STRING_OR_SCHEMA = re.compile(r"'(?:[^']|'')*'|FILE_SCHEMA\s*\(\s*\(\s*'([^']*)'")
ARM = 1e6  # m; length for computing directions on the map, long enough for coordinates of millions
MAX_SCALE_ERROR = 1e-6  # greatest difference of a map scale from 1


@dataclass(frozen=True)
class _Frame:
    """Transformation from the alignment's coordinates (m) to the map's: rotation, then shift."""

    turn: float
    shift: tuple[float, float, float]

    def point(self, x: float, y: float) -> tuple[float, float]:
        cosine, sine = math.cos(self.turn), math.sin(self.turn)
        return self.shift[0] + cosine * x - sine * y, self.shift[1] + sine * x + cosine * y


class Ifc:
    """Alignments of an IFC file.

    Attributes
    ----------
    names : list of str
        Names of the alignments, in the file's order.
    profiles : list of list of str
        Names of each alignment's profiles (IfcAlignmentVertical), or of its child alignments with one profile each.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file = _open(path)
        with self._whole():
            self._look()

    @contextmanager
    def _whole(self) -> Iterator[None]:
        """Report an entity without a required attribute, for which ifcopenshell returns None; it does not check types."""
        try:
            yield
        except (AttributeError, TypeError, ValueError, IndexError, OverflowError, RuntimeError) as error:
            raise InputError(f"{self._path} is damaged: an alignment entity lacks a required attribute: {error}") from error

    def _look(self) -> None:
        from ifcopenshell.util.unit import calculate_unit_scale

        self._unit = float(calculate_unit_scale(self._file))
        self._angle = float(calculate_unit_scale(self._file, "PLANEANGLEUNIT"))
        self._alignments = [
            alignment for alignment in self._file.by_type("IfcAlignment") if _nested(alignment, "IfcAlignmentHorizontal")
        ]
        self.names = [alignment.Name or "" for alignment in self._alignments]
        self.profiles = [[profile.Name or "" for profile in _verticals(alignment)] for alignment in self._alignments]

    def design(self, number: int, profile: int) -> Design:
        """Return an alignment with one of its profiles, both by index from 0."""
        with self._whole():
            return self._design(number, profile)

    def _design(self, number: int, profile: int) -> Design:
        alignment = self._alignments[number]
        frame = self._frame(alignment)
        horizontal = _nested(alignment, "IfcAlignmentHorizontal")[0]
        plan = tuple(self._plan_element(segment, frame) for segment in _segments(horizontal))
        vertical = _verticals(alignment)[profile]
        heights = tuple(self._profile_element(segment, frame) for segment in _segments(vertical, "HorizontalLength"))
        if not plan or not heights:
            raise InputError(
                f"{self._path}: alignment {self.names[number]!r} has no segments in {'profile' if plan else 'plan'}"
            )
        start, pieces = self._stationing(alignment)
        notes = [] if self._unit == 1.0 else [f"lengths are converted to metres: 1 unit is {self._unit:.9g} m"]
        crs = self._file.by_type("IfcProjectedCRS")
        if crs and crs[0].Name:
            notes.append(f"the file states its coordinate system as {crs[0].Name}")
        return Design(self.names[number], plan, heights, start, pieces, tuple(notes))

    def _plan_element(self, segment: Any, frame: _Frame) -> PlanElement:
        kind = PLAN.get(segment.PredefinedType)
        if kind is None:
            raise self._unknown("plan", segment.PredefinedType, PLAN)
        x, y = (value * self._unit for value in segment.StartPoint.Coordinates[:2])
        before, after = (
            1.0 / (radius * self._unit) if radius else 0.0
            for radius in (segment.StartRadiusOfCurvature, segment.EndRadiusOfCurvature)
        )  # fmt: skip
        bearing = math.remainder(segment.StartDirection * self._angle + frame.turn, 2.0 * math.pi)
        return PlanElement(kind, segment.SegmentLength * self._unit, *frame.point(x, y), bearing, before, after)

    def _profile_element(self, segment: Any, frame: _Frame) -> ProfileElement:
        kind = PROFILE.get(segment.PredefinedType)
        if kind is None:
            raise self._unknown("profile", segment.PredefinedType, PROFILE)
        return ProfileElement(
            kind,
            segment.StartDistAlong * self._unit,
            segment.HorizontalLength * self._unit,
            segment.StartHeight * self._unit + frame.shift[2],
            segment.StartGradient,
            segment.EndGradient,
        )

    def _unknown(self, where: str, kind: str, known: dict[str, Any]) -> InputError:
        return InputError(f"{self._path}: the {where} has a segment of type {kind}; supported are {', '.join(known)}")

    def _frame(self, alignment: Any) -> _Frame:
        """Return the transformation to the map: the alignment's placement, then the file's map conversion."""
        from ifcopenshell.util.geolocation import auto_xyz2enh
        from ifcopenshell.util.placement import get_local_placement

        matrix = np.eye(4) if alignment.ObjectPlacement is None else get_local_placement(alignment.ObjectPlacement)
        if abs(matrix[2, 2] - 1.0) > 1e-9:
            raise InputError(f"{self._path}: the placement of alignment {alignment.Name!r} is tilted, so it has no plan")
        unit = self._map_unit()
        corners = [matrix @ (x, 0.0, 0.0, 1.0) for x in (0.0, ARM / self._unit)]
        origin, beside_origin = (np.array(auto_xyz2enh(self._file, *corner[:3]), dtype=np.float64) * unit for corner in corners)
        step = (beside_origin - origin) / ARM
        scale = float(np.hypot(step[0], step[1]))
        if abs(scale - 1.0) > MAX_SCALE_ERROR:
            raise InputError(
                f"{self._path}: its map conversion has the scale {scale:.9g}, so map lengths differ from the alignment's; "
                "export it in map coordinates"
            )
        return _Frame(float(np.arctan2(step[1], step[0])), (float(origin[0]), float(origin[1]), float(origin[2])))

    def _map_unit(self) -> float:
        """Return the metres per unit of the map's coordinates."""
        conversion = self._file.by_type("IfcCoordinateOperation")
        crs = conversion[0].TargetCRS if conversion else None
        unit = getattr(crs, "MapUnit", None)
        if unit is None:
            return self._unit
        from ifcopenshell.util.unit import get_unit_scale

        return float(get_unit_scale(unit))

    def _stationing(self, alignment: Any) -> tuple[float, tuple[StationPiece, ...]]:
        """Return the chainage at the start, and the pieces of the stationing if it differs from the chainage."""
        pieces = sorted(self._stations(alignment), key=lambda piece: piece.distance)
        if not pieces:
            return 0.0, ()
        first = pieces[0]
        start = first.station - first.direction * first.distance
        kept = [StationPiece(0.0, start, first.direction)]
        for piece in pieces[1:]:
            before = kept[-1]
            expected = before.station + before.direction * (piece.distance - before.distance)
            if abs(expected - piece.station) > STATION_TOLERANCE or piece.direction != before.direction:
                kept.append(piece)
        if len(kept) == 1 and first.direction == 1:
            return start, ()
        return (start if first.direction == 1 else 0.0), tuple(kept)

    def _stations(self, alignment: Any) -> Iterator[StationPiece]:
        """Yield stations stated by referents of the alignment, with their direction from there on."""
        from ifcopenshell.util.element import get_pset

        direction = 1
        found = []
        for referent in _nested(alignment, "IfcReferent"):
            stationing = get_pset(referent, "Pset_Stationing") or {}
            distance = self._distance_along(referent)
            if distance is not None and stationing.get("Station") is not None:
                found.append((distance, float(stationing["Station"]) * self._unit, stationing.get("HasIncreasingStation")))
        for distance, station, increasing in sorted(found, key=lambda row: row[0]):
            if increasing is not None:
                direction = 1 if increasing else -1
            yield StationPiece(distance, station, direction)

    def _distance_along(self, referent: Any) -> float | None:
        placement = referent.ObjectPlacement
        if placement is None:
            return None
        if not placement.is_a("IfcLinearPlacement"):
            return 0.0 if np.allclose(_origin(placement), 0.0) else None
        location = placement.RelativePlacement.Location
        if not location.is_a("IfcPointByDistanceExpression"):
            return None
        return float(location.DistanceAlong.wrappedValue) * self._unit


def _origin(placement: Any) -> Any:
    from ifcopenshell.util.placement import get_local_placement

    return get_local_placement(placement)[:3, 3]


def _open(path: Path) -> Any:
    try:
        import ifcopenshell
    except ImportError as error:
        raise UserError('reading IFC needs ifcopenshell, which is not installed: pip install "tunneldb[ifc]"') from error
    schema, text = _schema(path)
    if schema not in SCHEMAS:
        raise InputError(f"{path} has the schema {schema}; alignments need IFC 4.3, so export it as IFC4X3_ADD2")
    try:
        # The releases of 4.3 do not differ in the entities read here, and ifcopenshell supports the last one.
        return ifcopenshell.file.from_string(text)
    except (RuntimeError, ifcopenshell.Error) as error:
        raise InputError(f"{path} cannot be read as IFC: {str(error).strip().splitlines()[0]}") from None


def _schema(path: Path) -> tuple[str, str]:
    """Return the schema in the header of a STEP file, and its text with the schema that ifcopenshell is to use."""
    try:
        require_at_most(path, _MAX_MEGABYTES, "a file of an alignment")
        text = path.read_bytes().removeprefix(b"\xef\xbb\xbf").decode("latin-1")  # STEP escapes other letters
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from None
    data = re.search(r"\bDATA\s*;", text)
    end = len(text) if data is None else data.start()
    header = _STRING_OR_COMMENT.sub(lambda found: found[1] or "", text[:end])
    found = next((found for found in _STRING_OR_SCHEMA.finditer(header) if found[1] is not None), None)
    if found is None:
        raise InputError(f"{path} is not an IFC file: its header states no schema")
    if _END not in text[-_END_WITHIN:]:
        raise InputError(f"{path} is truncated: it does not end with {_END}; copy or export it again")
    return found[1].upper(), f"{header[: found.start(1)]}{SCHEMAS[-1]}{header[found.end(1) :]}{text[end:]}"


def _nested(entity: Any, kind: str) -> list[Any]:
    """Return the parts of an entity with a class, in order."""
    return [part for nest in entity.IsNestedBy for part in nest.RelatedObjects or () if part.is_a(kind)]


def _verticals(alignment: Any) -> list[Any]:
    """Return the profiles of an alignment: its own, or those of its child alignments, which share its plan."""
    children = [part for whole in alignment.IsDecomposedBy for part in whole.RelatedObjects or () if part.is_a("IfcAlignment")]
    return [vertical for owner in (alignment, *children) for vertical in _nested(owner, "IfcAlignmentVertical")]


def _segments(layout: Any, length: str = "SegmentLength") -> list[Any]:
    """Return the design parameters of a layout's segments; the last one may have no length, as an end mark."""
    parameters = [segment.DesignParameters for segment in _nested(layout, "IfcAlignmentSegment")]
    return [segment for segment in parameters if getattr(segment, length) > 0.0]
