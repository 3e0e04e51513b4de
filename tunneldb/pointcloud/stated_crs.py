"""Coordinate system that a scan file states, with its heights, their units, and what cannot be read or contradicts itself."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from pyproj import CRS
from pyproj.exceptions import CRSError

from tunneldb.geometry.crs import describe_crs, height_unit, in_metres, plan_unit
from tunneldb.geometry.crs_equality import epsg_code, is_vertical, same_horizontally, stated_code, vertical
from tunneldb.pointcloud.geokeys import (
    ASCII,
    DIRECTORY,
    DOUBLES,
    height_contradiction,
    parse_geokeys,
    read_crs,
    unit_contradiction,
)

WKT = 2112
"""Number of the record of WKT in LAS."""

_SHOWN = 60  # characters of a text that cannot be read
_PLY = re.compile(
    r"^(?:(?P<code>epsg|srid)|crs|srs|wkt|proj4?|projection|coordinate[ _]?(?:reference[ _]?)?system)\b[\s:=]*", re.I
)
_WKT_START = re.compile(r"^(?:PROJ|GEOG|GEOD|COMPD|COMPOUND|BOUND|LOCAL_|ENG|VERT)\w*\s*\[")


@dataclass(frozen=True)
class StatedCrs:
    """Coordinate system of a file, as it states it.

    Attributes
    ----------
    crs : CRS or None
        System in plan, perhaps with heights; None if none is stated or it cannot be read.
    unread : str
        Text of a system that cannot be read, and the reason; empty if there is none.
    heights : CRS or None
        System of the heights; None if none is stated.
    unit_fault, height_fault : str
        Two different units that the file states for x and y, or for z; empty if it does not.
    notes : tuple of str
        Other contradictions within the file.
    """

    crs: CRS | None = None
    unread: str = ""
    heights: CRS | None = None
    unit_fault: str = ""
    height_fault: str = ""
    notes: tuple[str, ...] = ()


def stated_by(crs: CRS) -> StatedCrs:
    """Return what a coordinate system states of plan and heights."""
    heights = vertical(crs)
    if is_vertical(crs):
        return StatedCrs(None, heights=heights, notes=(f"states heights only ({crs.name}), no system in plan",))
    code = stated_code(crs)
    if code is None or epsg_code(crs) is not None:
        return StatedCrs(crs, heights=heights)
    note = f"its coordinate system {crs.name} states EPSG:{code}, but has other parameters; these count, not the code"
    return StatedCrs(crs, heights=heights, notes=(note,))


def stated_in_text(text: str, where: str) -> StatedCrs:
    """Return what a text states: WKT, PROJ string, PROJJSON or authority and code; `where` it is, for messages."""
    text = text.split("\0", 1)[0].strip()
    if not text:
        return StatedCrs()
    try:
        return stated_by(CRS.from_user_input(text))
    except CRSError as error:
        return StatedCrs(unread=f"{where}: {_short(text)} ({_reason(error)})")


def stated_in_comments(comments: Sequence[str]) -> StatedCrs:
    """Return what the comments of a PLY header state, such as ``crs EPSG:25832``, ``epsg 25832`` or a WKT."""
    for comment in comments:
        found = _PLY.match(comment)
        text = comment[found.end() :].strip() if found else comment.strip()
        if found and found["code"] and text.isdigit():
            text = f"EPSG:{text}"
        if (found and text) or _WKT_START.match(text):
            return stated_in_text(text, f"comment {_short(comment)}")
    return StatedCrs()


def stated_in_las(records: Mapping[int, bytes], *, wkt_counts: bool) -> StatedCrs:
    """Return what the records of a LAS file state.

    Parameters
    ----------
    records : mapping of int to bytes
        Records of user ``LASF_Projection`` by number: WKT and GeoTIFF keys.
    wkt_counts : bool
        True if the header states that WKT is valid, not GeoTIFF keys; if both are there, one of them counts.
    """
    wkt, keys = _by_wkt(records), _by_keys(records)
    if wkt is None or keys is None:
        return wkt or keys or StatedCrs()
    (first, name), (second, other) = [(wkt, "WKT"), (keys, "GeoTIFF keys")][:: 1 if wkt_counts else -1]
    if first.crs is None:
        fault = f"its {name} cannot be read: {first.unread}; its {other} are used" if first.unread else ""
        if second.crs is None:
            return replace(first, unread="; ".join(filter(None, (first.unread, second.unread))))
        return replace(second, notes=tuple(filter(None, (fault, *first.notes, *second.notes))))
    if second.unread:
        return replace(first, notes=(*first.notes, f"its {other} cannot be read: {second.unread}; its {name} is used"))
    if second.crs is None:
        return first
    return _first_of_two(first, second, name, other)


def _first_of_two(first: StatedCrs, second: StatedCrs, name: str, other: str) -> StatedCrs:
    """Return the first of two readable statements, with what the second adds or contradicts."""
    assert first.crs is not None
    assert second.crs is not None
    notes = list(first.notes)
    fault, height_fault = first.unit_fault or second.unit_fault, first.height_fault or second.height_fault
    if not same_horizontally(first.crs, second.crs):
        one, two = plan_unit(first.crs), plan_unit(second.crs)
        if one and two and one != two and not fault and same_horizontally(in_metres(first.crs), in_metres(second.crs)):
            fault = f"its {name} states {one.name}, its {other} {two.name}"
        else:
            notes.append(
                f"its {name} states {describe_crs(first.crs)}, its {other} {describe_crs(second.crs)}; by its header the "
                f"{name} counts"
            )
    if first.heights is None:
        return replace(first, heights=second.heights, unit_fault=fault, height_fault=height_fault, notes=tuple(notes))
    up, other_up = height_unit(None, first.heights), height_unit(None, second.heights)
    if up and other_up and up != other_up and not height_fault:
        height_fault = f"its {name} states heights in {up.name}, its {other} in {other_up.name}"
    return replace(first, unit_fault=fault, height_fault=height_fault, notes=tuple(notes))


def _by_wkt(records: Mapping[int, bytes]) -> StatedCrs | None:
    if WKT not in records:
        return None
    data = records[WKT].split(b"\0", 1)[0].strip()
    if not data:
        return StatedCrs(unread="its record of WKT is empty")
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    try:
        return stated_by(CRS.from_wkt(text))
    except CRSError as error:
        return StatedCrs(unread=f"WKT {_short(text)} ({_reason(error)})")


def _by_keys(records: Mapping[int, bytes]) -> StatedCrs | None:
    if DIRECTORY not in records:
        return None
    try:
        keys = parse_geokeys(records[DIRECTORY], records.get(DOUBLES, b""), records.get(ASCII, b""))
        crs = read_crs(keys)
    except ValueError as error:
        return StatedCrs(unread=str(error))
    if crs is None:
        return None
    return replace(stated_by(crs), unit_fault=unit_contradiction(keys), height_fault=height_contradiction(keys))


def _short(text: str) -> str:
    line = text.split("\n", 1)[0]
    return repr(line[:_SHOWN] + ("…" if len(line) > _SHOWN else ""))


def _reason(error: CRSError) -> str:
    """Return PROJ's reason for not reading a text."""
    text = str(error).strip().split("\n", 1)[0]
    return text.rsplit("(Internal Proj Error: ", 1)[-1].rstrip(")") if "Internal Proj Error" in text else text[:_SHOWN]
