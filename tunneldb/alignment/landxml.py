"""Design alignments from LandXML 1.0 to 1.2 and formats based on it (Inframodel, J-LandXML).

Points have northing first. Lengths are in the file's linear unit. Stations of the profile and ``staInternal`` of station
equations are the alignment's continuous ones, from ``staStart`` on.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError, iterparse

from tunneldb.alignment.design import Design, StationPiece
from tunneldb.alignment.elements import PlanElement, clothoid_from_chord
from tunneldb.alignment.profile import Pvi, profile_elements
from tunneldb.alignment.units import UNITS, unit_of
from tunneldb.errors import InputError
from tunneldb.numerals import parse_number

MISMATCH = 0.02  # m between a stated length and that of its points; files are rounded to millimetres or centimetres
_PVIS = ("PVI", "ParaCurve", "UnsymParaCurve", "CircCurve")
_READ_ELEMENTS = ("Alignments", "Units", "CoordinateSystem", "CgPoints")
_SKIPPED_ELEMENTS = ("CrossSects", "CrossSect")  # inside Alignments; they are most of some files

_SAVE_AS = "save it as GeoPackage in the coordinate system of the tunnel (in QGIS: Export, Save Features As)"
_OTHER_ROOTS = {"kml": _SAVE_AS, "gpx": _SAVE_AS, "FeatureCollection": _SAVE_AS, "ifcXML": "export it as .ifc"}

Point = tuple[float, float]


class LandXml:
    """Alignments of a LandXML file.

    Parameters
    ----------
    path : Path
        File to read.
    unit : str or None
        Unit of its lengths, one of `UNITS`; None: as in the file.

    Attributes
    ----------
    names : list of str
        Names of the alignments, in the file's order.
    profiles : list of list of str
        Names of each alignment's profiles (ProfAlign).
    """

    def __init__(self, path: Path, unit: str | None = None) -> None:
        self._path = path
        root = _read(path)
        stated = _linear_unit(root)
        name = unit or (None if stated is None else unit_of(stated))
        if name is None:
            problem = (
                "states no unit of lengths (linearUnit of Units)" if stated is None else f"has an unknown unit, {stated!r}"
            )
            raise InputError(f"{path} {problem}; give it by --axis-unit meter, foot, USSurveyFoot, ...")
        self._unit = UNITS[name]
        self._unit_note = "" if unit is None or unit == stated else f", as given; the file states {stated or 'none'}"
        self._points = {
            point.get("name"): point.text for point in root.iter() if _tag(point) == "CgPoint" and point.get("name")
        }
        self._alignments = [element for element in root.iter() if _tag(element) == "Alignment"]
        self._epsg = next((e.get("epsgCode") for e in root.iter() if _tag(e) == "CoordinateSystem"), None)
        self.names = [element.get("name", "") for element in self._alignments]
        self.profiles = [[p.get("name", "") for p in self._profiles(element)] for element in self._alignments]

    def design(self, number: int, profile: int) -> Design:
        """Return an alignment with one of its profiles, both by index from 0."""
        alignment = self._alignments[number]
        start = self._length(alignment, "staStart", default=0.0)
        geometry = _child(alignment, "CoordGeom")
        if geometry is None or not len(geometry):
            raise InputError(f"{self._path}: alignment {self.names[number]!r} has no geometry in plan (CoordGeom)")
        elements = [self._element(element) for element in geometry if _tag(element) not in ("Feature", "Description")]
        plan = tuple(element for element in elements if element.length > 0.0)
        if not plan:
            raise InputError(f"{self._path}: the plan of alignment {self.names[number]!r} (CoordGeom) has no length")
        pvis = list(self._pvis(self._profiles(alignment)[profile], start))
        notes = []
        if self._unit != 1.0 or self._unit_note:
            notes.append(f"lengths are converted to metres: 1 unit is {self._unit:.9g} m{self._unit_note}")
        if self._epsg:
            notes.append(f"the file states its coordinate system as EPSG:{self._epsg}")
        return Design(
            self.names[number],
            plan,
            profile_elements(pvis, self._path),
            start,
            self._stationing(alignment, start),
            tuple(notes),
        )

    def _profiles(self, alignment: Element) -> list[Element]:
        return [
            element
            for profile in alignment
            if _tag(profile) == "Profile"
            for element in profile
            if _tag(element) == "ProfAlign"
        ]

    def _element(self, element: Element) -> PlanElement:
        kind = _tag(element)
        if kind == "Line":
            return self._line(element)
        if kind == "Curve":
            return self._curve(element)
        if kind == "Spiral":
            return self._spiral(element)
        raise InputError(f"{self._path}: the plan has a {kind}; supported are Line, Curve and Spiral")

    def _line(self, element: Element) -> PlanElement:
        start, end = self._point(element, "Start"), self._point(element, "End")
        dx, dy = end[0] - start[0], end[1] - start[1]
        length = math.hypot(dx, dy)
        self._compare(element, "length", self._extent(element, "length", length), length)
        return PlanElement("line", length, *start, math.atan2(dy, dx))

    def _curve(self, element: Element) -> PlanElement:
        """Return an arc around its centre, from start to end; a contradicting radius or length is an error."""
        start, end, centre = (self._point(element, name) for name in ("Start", "End", "Center"))
        turn = self._turn(element)
        radius = math.dist(start, centre)
        first, last = (math.atan2(p[1] - centre[1], p[0] - centre[0]) for p in (start, end))
        angle = (turn * (last - first)) % (2.0 * math.pi)
        if radius * (2.0 * math.pi - angle) < MISMATCH:  # an arc without length, whose rounded end is before its start
            angle = 0.0
        length = radius * angle
        self._compare(element, "radius", math.dist(end, centre), radius)
        self._compare(element, "radius", self._length(element, "radius", radius), radius)
        self._compare(element, "length", self._extent(element, "length", length), length)
        bearing = math.remainder(first + turn * math.pi / 2.0, 2.0 * math.pi)
        curvature = turn / radius if length else 0.0
        return PlanElement("arc", length, *start, bearing, curvature, curvature)

    def _spiral(self, element: Element) -> PlanElement:
        """Return a clothoid between two points, by its length and radii."""
        kind = element.get("spiType", "clothoid")
        if kind != "clothoid":
            raise InputError(f"{self._path}: the plan has a spiral of type {kind}; only clothoids are supported")
        turn = self._turn(element)
        length = self._extent(element, "length")
        before, after = (turn * self._curvature(element, name) for name in ("radiusStart", "radiusEnd"))
        start, end = self._point(element, "Start"), self._point(element, "End")
        if length == 0.0:
            self._compare(element, "distance of its ends", math.dist(start, end), 0.0)
            return PlanElement("clothoid", 0.0, *start, 0.0)
        clothoid, excess = clothoid_from_chord(start, end, length, before, after)
        self._compare(element, "distance of its ends", excess, 0.0)
        return clothoid

    def _curvature(self, element: Element, name: str) -> float:
        text = (element.get(name) or "INF").strip().upper()
        if text in ("INF", "INFINITY", "0"):
            return 0.0
        radius = self._length(element, name)
        return 1.0 / radius if radius else 0.0

    def _turn(self, element: Element) -> float:
        rotation = element.get("rot")
        if rotation not in ("cw", "ccw"):
            raise InputError(f"{self._path}: a {_tag(element)} has the rotation {rotation!r}; it must be cw or ccw")
        return 1.0 if rotation == "ccw" else -1.0

    def _compare(self, element: Element, what: str, stated: float, measured: float) -> None:
        if abs(stated - measured) > MISMATCH:
            place = element.find("{*}Start")
            raise InputError(
                f"{self._path}: the {what} of the {_tag(element)} from {'' if place is None else (place.text or '').strip()} "
                f"is off by {abs(stated - measured):.3f} m from its points, radii and length"
            )

    def _point(self, element: Element, name: str) -> Point:
        """Return easting and northing of a point, which is given or refers to a CgPoint."""
        place = _child(element, name)
        if place is None:
            raise InputError(f"{self._path}: a {_tag(element)} has no {name}")
        reference = place.get("pntRef")
        text = (self._points.get(reference) if reference else place.text) or ""
        try:
            north, east = (_number(value) for value in text.split()[:2])
        except ValueError:
            raise InputError(
                f"{self._path}: {name} of a {_tag(element)} is {text.strip()!r}, not northing and easting"
            ) from None
        return east * self._unit, north * self._unit

    def _pvis(self, element: Element, start: float) -> Iterator[Pvi]:
        """Yield the points of vertical intersection of a ProfAlign, with their roundings."""
        for point in element:
            kind = _tag(point)
            if kind in ("Feature", "Description"):
                continue
            if kind not in _PVIS:
                raise InputError(
                    f"{self._path}: the profile has a {kind}; supported are PVI, ParaCurve, UnsymParaCurve and CircCurve"
                )
            try:
                station, height = (_number(value) * self._unit for value in (point.text or "").split())
            except ValueError:
                raise InputError(
                    f"{self._path}: a {kind} of the profile is {(point.text or '').strip()!r}, not station and height"
                ) from None
            before, after, radius = 0.0, 0.0, 0.0
            if kind == "UnsymParaCurve":
                before, after = self._extent(point, "lengthIn"), self._extent(point, "lengthOut")
            elif kind == "ParaCurve":
                before = after = self._extent(point, "length") / 2.0
            elif kind == "CircCurve":
                radius = abs(self._length(point, "radius"))
            yield Pvi(station - start, height, before, after, radius)

    def _stationing(self, alignment: Element, start: float) -> tuple[StationPiece, ...]:
        """Return the pieces of the alignment's own stationing; none if it equals the chainage."""
        pieces = []
        for element in (e for e in alignment if _tag(e) == "StaEquation"):
            internal, ahead = self._length(element, "staInternal"), self._length(element, "staAhead")
            direction = -1 if element.get("staIncrement") == "decreasing" else 1
            pieces.append(StationPiece(internal - start, ahead, direction))
        if not pieces:
            return ()
        pieces.sort(key=lambda piece: piece.distance)
        first = () if pieces[0].distance <= 0.0 else (StationPiece(0.0, start),)
        return (*first, *pieces)

    def _length(self, element: Element, name: str, default: float | None = None) -> float:
        """Return the length in an attribute, m."""
        text = element.get(name)
        if text is None and default is not None:
            return default
        try:
            return _number(text or "") * self._unit
        except ValueError:
            raise InputError(f"{self._path}: {name} of a {_tag(element)} is {text!r}, not a number") from None

    def _extent(self, element: Element, name: str, default: float | None = None) -> float:
        """Return the length between two places in an attribute, m; it must not be negative."""
        length = self._length(element, name, default)
        if length < 0.0:
            raise InputError(f"{self._path}: {name} of a {_tag(element)} is {element.get(name)!r}; it must not be negative")
        return length


def _read(path: Path) -> Element:
    """Parse a file without keeping its surfaces and points, which may be hundreds of megabytes."""
    stack: list[Element] = []
    kept = 0
    try:
        for event, element in iterparse(path, events=("start", "end")):
            if event == "start":
                stack.append(element)
                kept += _tag(element) in _READ_ELEMENTS
                continue
            stack.pop()
            if stack and (not kept or _tag(element) in _SKIPPED_ELEMENTS):
                stack[-1].remove(element)
            kept -= _tag(element) in _READ_ELEMENTS
    except ParseError as error:
        raise InputError(f"{path} is not a complete XML file: {error}") from None
    except (ValueError, LookupError) as error:  # a multi-byte or unknown encoding
        raise InputError(f"{path} cannot be read as XML: {error}; save it as UTF-8") from None
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from None
    if _tag(element) != "LandXML":
        root = _tag(element)
        advice = _OTHER_ROOTS.get(root, "export the alignment as LandXML 1.2")
        raise InputError(f"{path} is XML, but its root is {root}, not LandXML; {advice}")
    return element


def _linear_unit(root: Element) -> str | None:
    """Return the unit of lengths that a file states; None if it states none."""
    systems = (system for element in root.iter() if _tag(element) == "Units" for system in element)
    return next((system.get("linearUnit") for system in systems), None)


def _tag(element: Element) -> str:
    return element.tag.rpartition("}")[2]


def _number(text: str) -> float:
    value = parse_number(text)
    if not math.isfinite(value):
        raise ValueError(f"{text} is neither a position nor a length")
    return value


def _child(element: Element, name: str) -> Element | None:
    return next((child for child in element if _tag(child) == name), None)
