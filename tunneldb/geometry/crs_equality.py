"""Equality of coordinate systems in plan: same datum, and same easting and northing for the same place.

Texts of one system differ: GDAL writes no axes, LAStools writes easting first where EPSG has northing first, ESRI has its own
names, and projection methods have several sets of parameters. So the datum is compared by its ellipsoid, prime meridian and
names, and the projection by the coordinates that it gives to places in its area of use.

Source: OGC 18-010r11, *Well-known text representation of coordinate reference systems*, annex F (backward compatibility).
"""

from __future__ import annotations

import math
import re
from functools import lru_cache
from typing import Any

import numpy as np
from pyproj import CRS, Transformer
from pyproj.exceptions import CRSError, ProjError

from tunneldb.arrays import Float

MAX_SHIFT = 0.001
"""Maximum distance between the coordinates of a place in systems that are the same, m."""

_GRID = 5  # places along each side of the area of use
_INSET = 0.05  # of the area's size that its edges are left out by: projections may be undefined there
_REACH = 300_000.0  # m around the false origin, for systems without an area of use
_SAME_AXIS = 0.0005  # m, of ellipsoids
_SAME_FLATTENING = 2e-7  # of inverse flattening: that of GRS 1980 and of WGS 84 differ by 1.5e-6
_SAME_ANGLE = 1e-7  # degrees, of prime meridians
_MIN_CONFIDENCE = 25  # per cent, of PROJ's search by parameters; its results are compared afterwards
_UNKNOWN = re.compile("^(unknown|unnamed|not.?specified|undefined|user.?defined)", re.IGNORECASE)


def horizontal(crs: CRS) -> CRS:
    """Return the horizontal part of a coordinate system that may be compound, bound or three-dimensional."""
    if crs.is_bound and crs.source_crs is not None:
        return horizontal(crs.source_crs)
    if crs.is_compound:
        return horizontal(crs.sub_crs_list[0])
    return crs.to_2d()


def vertical(crs: CRS) -> CRS | None:
    """Return the vertical part of a compound or vertical system; None if it has none, or only ellipsoidal heights."""
    if crs.is_bound and crs.source_crs is not None:
        return vertical(crs.source_crs)
    if crs.is_compound:
        return next(filter(None, map(vertical, crs.sub_crs_list[1:])), None)
    return crs if is_vertical(crs) else None


def is_vertical(crs: CRS) -> bool:
    """Return True for a system of heights alone; pyproj counts compound ones as vertical, too."""
    return bool(crs.type_name == "Vertical CRS")


def same_horizontally(one: CRS, other: CRS) -> bool:
    """Return True if two coordinate systems agree in the plane, whatever their axis order, names and height systems.

    A system of unknown datum (see `lacks_datum`) agrees with those of its ellipsoid and projection.
    """
    a, b = horizontal(one), horizontal(other)
    if a.equals(b, ignore_axis_order=True):
        return True
    if a.geodetic_crs is None or b.geodetic_crs is None or a.is_projected != b.is_projected:
        return False
    if not _same_datum(a, b):
        return False
    if not a.is_projected:
        return True
    shift = plan_shift(a, b)
    # PROJ lacks a few of EPSG's projections: systems of these are the same by their code only.
    return shift < MAX_SHIFT or (
        math.isinf(shift) and _identifier(a.to_json_dict()) == _identifier(b.to_json_dict()) is not None
    )


def lacks_datum(crs: CRS) -> bool:
    """Return True if a system states ellipsoid and projection, but no datum, such as most PROJ strings."""
    geodetic = horizontal(crs).geodetic_crs
    return geodetic is not None and bool(_UNKNOWN.match(_datum_name(geodetic)))


def plan_shift(a: CRS, b: CRS) -> float:
    """Return the maximum distance between coordinates of the same places in two projected systems; infinite if unknown.

    Both are regarded as systems of the same datum, and coordinates as easting and northing in their own units.
    """
    try:
        places = _places(b if b.area_of_use else a)
        first, second = _project(a, places), _project(b, places)
    except (CRSError, ProjError):
        return float("inf")
    with np.errstate(invalid="ignore"):
        shift = np.hypot(*(first - second).T)
    shift = shift[np.isfinite(shift)]
    return float(shift.max()) if len(shift) else float("inf")


def epsg_code(crs: CRS) -> int | None:
    """Return the EPSG code of a system in plan; None if it has none, or its definition is not that of the code it states."""
    return _epsg_code(horizontal(crs).to_wkt())


def stated_code(crs: CRS) -> int | None:
    """Return the EPSG code that the text of a system states in plan, which its definition may contradict."""
    found = _identifier(horizontal(crs).to_json_dict())
    return int(found[1]) if found is not None and found[0] == "EPSG" and found[1].isdigit() else None


@lru_cache(maxsize=256)
def _epsg_code(wkt: str) -> int | None:
    crs = CRS.from_wkt(wkt)
    stated = stated_code(crs)
    if stated is not None:
        return stated if _is_code(crs, stated) else None
    if lacks_datum(crs):
        return None
    if not crs.is_projected:
        return crs.to_epsg()
    for form in (crs, _east_north(crs), _north_east(crs)):
        found = form.list_authority("EPSG", _MIN_CONFIDENCE)
        for authority in found:
            if _is_code(crs, int(authority.code)):
                return int(authority.code)
    return None


def _is_code(crs: CRS, code: int) -> bool:
    try:
        return same_horizontally(crs, CRS.from_epsg(code))
    except CRSError:
        return False


def _east_north(crs: CRS) -> CRS:
    return _with_axes(crs, ("east", "north"))


def _north_east(crs: CRS) -> CRS:
    return _with_axes(crs, ("north", "east"))


def _with_axes(crs: CRS, order: tuple[str, str]) -> CRS:
    """Return a projected system with its axes in another order, if these are east and north."""
    text = crs.to_json_dict()
    axes = {axis["direction"]: axis for axis in text["coordinate_system"]["axis"]}
    if set(axes) != set(order):
        return crs
    text["coordinate_system"]["axis"] = [axes[name] for name in order]
    text.pop("id", None)
    return CRS.from_json_dict(text)


def _same_datum(a: CRS, b: CRS) -> bool:
    """Return True if two systems have the same geodetic datum, by definition, code or name."""
    one, other = a.geodetic_crs, b.geodetic_crs
    if one is None or other is None:
        return False
    if one.equals(other, ignore_axis_order=True):
        return True
    if not _same_body(one, other):
        return False
    if lacks_datum(one) or lacks_datum(other):
        return True
    pairs = ((a, b), (one, other))
    codes = [(_identifier(x.to_json_dict()), _identifier(y.to_json_dict())) for x, y in pairs]
    codes.append((_identifier(_datum(one)), _identifier(_datum(other))))
    if any(x is not None and x == y for x, y in codes):
        return True
    return bool(_names(one) & _names(other))


def _same_body(one: CRS, other: CRS) -> bool:
    """Return True if two geodetic systems have the same ellipsoid and prime meridian."""
    body, other_body = one.ellipsoid, other.ellipsoid
    if body is None or other_body is None:
        return False
    return (
        abs(body.semi_major_metre - other_body.semi_major_metre) < _SAME_AXIS
        and abs(body.inverse_flattening - other_body.inverse_flattening) < _SAME_FLATTENING
        and abs(_meridian(one) - _meridian(other)) < _SAME_ANGLE
    )


def _meridian(geodetic: CRS) -> float:
    """Return the longitude of the prime meridian, degrees east of Greenwich."""
    meridian = geodetic.prime_meridian
    return 0.0 if meridian is None else float(np.degrees(float(meridian.longitude) * float(meridian.unit_conversion_factor)))


def _datum(geodetic: CRS) -> dict[str, Any]:
    text = geodetic.to_json_dict()
    return dict(text.get("datum") or text.get("datum_ensemble") or {})


def _datum_name(geodetic: CRS) -> str:
    return str(_datum(geodetic).get("name", ""))


def _names(geodetic: CRS) -> set[str]:
    """Return the names of a geodetic system and its datum without prefixes of ESRI, capitals and punctuation."""
    texts = (geodetic.name, _datum_name(geodetic))
    plain = {re.sub(r"[^a-z0-9]", "", re.sub("^(D|GCS)_", "", text).lower()) for text in texts}
    return {text for text in plain if text}


def _identifier(text: dict[str, Any]) -> tuple[str, str] | None:
    found = text.get("id")
    return None if found is None else (str(found["authority"]), str(found["code"]))


def _places(crs: CRS) -> Float:
    """Return longitudes and latitudes (n, 2) all over the area of a system, degrees from Greenwich."""
    area = crs.area_of_use
    if area is None:
        offsets = np.linspace(-_REACH, _REACH, _GRID)
        east, north = (grid.ravel() for grid in np.meshgrid(*(offsets + origin for origin in _false_origin(crs))))
        own = np.column_stack(_to_geodetic(crs).transform(east, north, direction="INVERSE"))
        factor, meridian = _angles(crs)
        return own * factor + [meridian, 0.0]
    width = (area.east - area.west) % 360.0 or 360.0
    share = np.linspace(_INSET, 1.0 - _INSET, _GRID)
    grids = np.meshgrid(area.west + share * width, area.south + share * (area.north - area.south))
    return np.column_stack([grid.ravel() for grid in grids])


def _false_origin(crs: CRS) -> tuple[float, float]:
    """Return the false easting and northing of a system, in its own unit; 0 if it has none."""
    operation = crs.coordinate_operation
    values = {} if operation is None else {parameter.name.lower(): float(parameter.value) for parameter in operation.params}
    found = [next((value for name, value in values.items() if axis in name), 0.0) for axis in ("easting", "northing")]
    return found[0], found[1]


def _project(crs: CRS, places: Float) -> Float:
    """Return easting and northing (n, 2) of longitudes and latitudes (n, 2), degrees from Greenwich."""
    factor, meridian = _angles(crs)
    longitude = (places[:, 0] - meridian + 180.0) % 360.0 - 180.0
    east, north = _to_geodetic(crs).transform(longitude / factor, places[:, 1] / factor)
    return np.column_stack([east, north])


def _to_geodetic(crs: CRS) -> Transformer:
    """Return the projection of a system from its own longitude and latitude."""
    return Transformer.from_crs(crs.geodetic_crs, crs, always_xy=True)


def _angles(crs: CRS) -> tuple[float, float]:
    """Return the unit of longitude and latitude, degrees, and the prime meridian, degrees."""
    geodetic = crs.geodetic_crs
    assert geodetic is not None
    factor = geodetic.axis_info[0].unit_conversion_factor
    return float(np.degrees(factor)), _meridian(geodetic)
