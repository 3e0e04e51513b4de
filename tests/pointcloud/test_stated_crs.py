"""Coordinate systems as files state them: read whole, contradictions named, and "unreadable" is not "not stated"."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from pyproj import CRS

from tunneldb.errors import InputError
from tunneldb.geometry.crs import describe_heights
from tunneldb.geometry.crs_equality import epsg_code
from tunneldb.geometry.units import METRES
from tunneldb.pointcloud.geokeys import ASCII, DIRECTORY, DOUBLES
from tunneldb.pointcloud.points import ScanHeader
from tunneldb.pointcloud.reader import check_header, coordinate_note, crs_note
from tunneldb.pointcloud.stated_crs import WKT, StatedCrs, stated_in_comments, stated_in_las, stated_in_text
from tunneldb.pointcloud.units import GivenUnits, in_units

UTM33_BY_PARAMETERS = {1024: 1, 2048: 4258, 3072: 32767, 3074: 32767, 3075: 1, 3076: 9001}
UTM33_NUMBERS = {3080: 15.0, 3081: 0.0, 3082: 500_000.0, 3083: 0.0, 3092: 0.9996}


def keys(
    codes: dict[int, int], numbers: dict[int, float] | None = None, texts: dict[int, str] | None = None
) -> dict[int, bytes]:
    """Records of GeoTIFF keys."""
    entries = {key: (0, 1, value) for key, value in codes.items()}
    doubles: Sequence[float] = list((numbers or {}).values())
    entries |= {key: (DOUBLES, 1, place) for place, key in enumerate(numbers or {})}
    text = b""
    for key, value in (texts or {}).items():
        entries[key] = (ASCII, len(value) + 1, len(text))
        text += value.encode() + b"|"
    directory = struct.pack("<4H", 1, 1, 0, len(entries))
    directory += b"".join(struct.pack("<4H", key, *entries[key]) for key in sorted(entries))
    return {DIRECTORY: directory, DOUBLES: struct.pack(f"<{len(doubles)}d", *doubles), ASCII: text}


def by_keys(codes: dict[int, int], numbers: dict[int, float] | None = None, texts: dict[int, str] | None = None) -> StatedCrs:
    return stated_in_las(keys(codes, numbers, texts), wkt_counts=False)


def by_wkt(text: str | bytes, **other: dict[int, bytes]) -> StatedCrs:
    data = text.encode() if isinstance(text, str) else text
    return stated_in_las({WKT: data, **other.get("keys", {})}, wkt_counts=True)


def header(stated: StatedCrs, given: GivenUnits | None = None) -> ScanHeader:
    low, high = np.array([300_000.0, 5_000_000.0, 100.0]), np.array([300_100.0, 5_000_100.0, 110.0])
    return in_units(ScanHeader(Path("a.las"), 10, (), stated, low, high), given or GivenUnits())


def test_user_defined_keys_are_read_by_their_parameters() -> None:
    found = by_keys(UTM33_BY_PARAMETERS, UTM33_NUMBERS)
    assert found.crs is not None
    assert epsg_code(found.crs) == 25833


@pytest.mark.parametrize(
    "codes",
    [
        {1024: 1, 3072: 32767},
        {1024: 1, 2048: 4258, 3072: 32767, 3074: 32767, 3075: 32767},
        {1024: 1, 3072: 65000},
    ],
)
def test_keys_of_no_known_system_are_unreadable_and_not_absent(codes: dict[int, int]) -> None:
    found = by_keys(codes)
    assert found.crs is None
    assert f"3072 ProjectedCRS = {codes[3072]}" in found.unread
    note = crs_note(header(found), 25833)
    assert note is not None
    assert "cannot be read (GeoTIFF keys 1024" in note


def test_keys_without_a_system_state_none() -> None:
    assert by_keys({1024: 1, 3072: 0}) == StatedCrs()
    assert stated_in_las({}, wkt_counts=True) == StatedCrs()
    assert "no coordinate system" in str(crs_note(header(StatedCrs()), 25833))


def test_a_site_grid_in_keys_is_local() -> None:
    found = by_keys({1024: 32767, 3076: 9001}, texts={1026: "Site grid"})
    assert found.crs is not None
    assert found.crs.is_engineering


@pytest.mark.parametrize("damaged", [b"", bytes(6), struct.pack("<4H", 1, 1, 0, 9), keys(UTM33_BY_PARAMETERS)[DIRECTORY][:-4]])
def test_damaged_keys_are_unreadable(damaged: bytes) -> None:
    assert "key directory" in stated_in_las({DIRECTORY: damaged}, wkt_counts=False).unread


def test_keys_beyond_their_records_are_unreadable() -> None:
    records = keys(UTM33_BY_PARAMETERS, UTM33_NUMBERS)
    assert "beyond" in stated_in_las({DIRECTORY: records[DIRECTORY]}, wkt_counts=False).unread


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "its record of WKT is empty"),
        (b"\0\0\0", "its record of WKT is empty"),
        (b'PROJCS["half', "WKT 'PROJCS[\"half'"),
        ("Übersicht Süd".encode("latin-1"), "WKT 'Übersicht Süd'"),
    ],
)
def test_unreadable_wkt_is_named(data: bytes, reason: str) -> None:
    found = by_wkt(data)
    assert found.crs is None
    assert found.unread.startswith(reason)


def test_padded_and_foreign_bytes_do_not_hide_a_wkt() -> None:
    text = CRS(31256).to_wkt("WKT1_GDAL")
    assert by_wkt(text + "\0\0garbage").crs == CRS.from_wkt(text)
    latin = text.replace("Austria", "Österreich").encode("latin-1")
    found = by_wkt(latin).crs
    assert found is not None
    assert epsg_code(found) == 31256


def test_heights_of_compound_systems_are_read() -> None:
    found = by_wkt(CRS("EPSG:25832+7837").to_wkt())
    assert describe_heights(found.crs, found.heights) == "DHHN2016 height, metre"
    keyed = by_keys({1024: 1, 3072: 25832, 4096: 5783, 4099: 9001})
    assert describe_heights(keyed.crs, keyed.heights) == "DHHN92 height, metre"
    spatial = by_wkt(CRS(25832).to_3d().to_wkt("WKT2_2019"))
    assert describe_heights(spatial.crs, spatial.heights) == "ellipsoidal, metre"
    only = by_wkt(CRS(7837).to_wkt())
    assert only.crs is None
    assert only.notes == ("states heights only (DHHN2016 height), no system in plan",)


FEET = {
    "plan in keys": (
        by_keys({1024: 1, 3072: 25833, 3076: 9003}),
        "us-ft",
        None,
        "in metre, but key 3076 states US survey foot",
    ),
    "heights in keys": (by_keys({1024: 1, 3072: 25833, 4099: 9003}), None, "us-ft", "heights are in US survey foot"),
    "heights in WKT": (by_wkt(CRS("EPSG:25833+6360").to_wkt()), None, "us-ft", "NAVD88 height (ftUS)"),
    "both in WKT": (by_wkt(CRS("EPSG:2263+6360").to_wkt()), "us-ft", "us-ft", "x and y are in US survey foot"),
    "3D system": (by_wkt(CRS("EPSG:2263").to_wkt()), "us-ft", None, "x and y are in US survey foot"),
    "site grid": (by_wkt('LOCAL_CS["Site",UNIT["foot",0.3048],AXIS["X",EAST],AXIS["Y",NORTH]]'), "ft", None, "in foot"),
}


@pytest.mark.parametrize("case", FEET)
def test_feet_are_refused_and_the_advice_converts_them(case: str) -> None:
    stated, plan, height, says = FEET[case]
    srid = 0 if case == "site grid" else 32118 if plan and case != "plan in keys" else 25833
    with pytest.raises(InputError) as caught:
        check_header(header(stated), None, srid, needs_time=False)
    message = str(caught.value)
    assert says in message
    for option, unit in (("--unit", plan), ("--height-unit", height)):
        assert (f"{option} {unit}" in message) == (unit is not None)
    given = header(stated, GivenUnits(plan, height))
    check_header(given, None, srid, needs_time=False)
    np.testing.assert_allclose(given.low[0], 300_000.0 * METRES[plan or "m"])
    np.testing.assert_allclose(given.low[2], 100.0 * METRES[height or plan or "m"])
    assert "converted from" in str(coordinate_note(given, srid))


def test_a_user_may_overrule_a_wrong_unit_key() -> None:
    given = header(by_keys({1024: 1, 3072: 25833, 3076: 9003}), GivenUnits("m"))
    check_header(given, None, 25833, needs_time=False)
    assert given.low[0] == 300_000.0
    assert "x and y taken as metres, as given (GeoTIFF key 3072 states EPSG:25833" in str(coordinate_note(given, 25833))


def test_heights_that_contradict_their_code_need_a_unit() -> None:
    stated = by_keys({1024: 1, 3072: 25833, 4096: 5703, 4099: 9003})
    with pytest.raises(InputError, match=r"4096 states EPSG:5703 .* but key 4099 states US survey foot.*--height-unit m or"):
        check_header(header(stated), None, 25833, needs_time=False)
    check_header(header(stated, GivenUnits(None, "us-ft")), None, 25833, needs_time=False)


def test_wkt_and_keys_that_contradict_are_named_and_the_header_decides() -> None:
    records = {WKT: CRS(25832).to_wkt("WKT1_GDAL").encode(), **keys({1024: 1, 3072: 25833})}
    for wkt_counts, code in ((True, 25832), (False, 25833)):
        found = stated_in_las(records, wkt_counts=wkt_counts)
        assert found.crs is not None
        assert epsg_code(found.crs) == code
        assert "EPSG:25832" in found.notes[0]
        assert "EPSG:25833" in found.notes[0]
    feet = stated_in_las({**records, **keys({1024: 1, 3072: 25832, 3076: 9003})}, wkt_counts=True)
    assert "US survey foot" in feet.unit_fault


def test_one_readable_statement_of_two_is_used() -> None:
    records = {WKT: b"nonsense", **keys({1024: 1, 3072: 25833})}
    found = stated_in_las(records, wkt_counts=True)
    assert found.crs == CRS(25833)
    assert "its WKT cannot be read" in found.notes[0]


def test_other_texts() -> None:
    assert stated_in_text("EPSG:25832\0", "coordinateMetadata").crs == CRS(25832)
    assert stated_in_text("  ", "coordinateMetadata") == StatedCrs()
    assert stated_in_text("Gauss-Krueger Zone 4", "coordinateMetadata").unread.startswith("coordinateMetadata: 'Gauss-Krueger")
    helmert = 'TOWGS84[598.1,73.7,418.2,0.202,0.045,-2.455,6.7],AUTHORITY["EPSG","6314"]'
    bound = stated_in_text(CRS(31467).to_wkt("WKT1_GDAL").replace('AUTHORITY["EPSG","6314"]', helmert), "text").crs
    assert bound is not None
    assert bound.is_bound
    assert epsg_code(bound) == 31467
    assert stated_in_comments(["VCGLIB generated", "crs EPSG:25832"]).crs == CRS(25832)
    assert stated_in_comments(["epsg: 25832"]).crs == CRS(25832)
    assert "comment" in stated_in_comments(["crs site 7"]).unread
    assert stated_in_comments(["crsh", "made by a scanner"]) == StatedCrs()


def test_degrees_and_geocentric_coordinates_do_not_fit() -> None:
    for code in (4326, 4978, 4979):
        with pytest.raises(InputError, match="transform the file"):
            check_header(header(by_wkt(CRS(code).to_wkt("WKT2_2019"))), None, 25832, needs_time=False)
    paris = by_wkt(CRS(27561).to_wkt("WKT1_GDAL"))  # grads, meridian of Paris
    check_header(header(paris), None, 27561, needs_time=False)
