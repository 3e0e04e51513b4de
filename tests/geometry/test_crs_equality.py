"""One coordinate system in the texts of several programs is one; others stay different."""

from __future__ import annotations

import pytest
from pyproj import CRS
from support.benchmark_files import load_benchmark

from tunneldb.geometry.crs import heights_differ, in_metres
from tunneldb.geometry.crs_equality import epsg_code, lacks_datum, same_horizontally, stated_code

TABLE = load_benchmark("crs_table.py")

NORTHING_FIRST = [3006, 2193, 31256, 31467, 6677]  # Sweden, New Zealand, Austria, Germany, Japan
HARD = [2326, 5514, 28992, 27561]  # Cassini, Krovak, stereographic, meridian of Paris in grads


def test_every_form_of_a_system_is_equal_to_its_code() -> None:
    wrong = [row for row in TABLE.compare(NORTHING_FIRST + HARD) if row[2] in ("refused", "unreadable")]
    assert wrong == []


def test_a_projection_that_proj_lacks_is_known_by_its_code() -> None:
    equal = {form for code, form, result, _ in TABLE.compare([3173]) if result == "equal"}
    assert {"WKT1 GDAL", "WKT1 LAStools", "WKT2", "GeoTIFF key"} <= equal
    assert not same_horizontally(CRS(3173), CRS(3144))  # another one, of the same method


def test_a_text_of_another_program_has_the_code() -> None:
    for code, form in ((3006, "WKT1 LAStools"), (2193, "WKT1 ESRI"), (31256, "WKT1 GDAL without axes")):
        assert form in TABLE.FORMS
        found = TABLE.written(CRS.from_epsg(code), code, form)
        assert found is not None
        assert epsg_code(found) == code


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (25832, 25833),  # zones
        (31467, 25832),  # DHDN and ETRS89
        (25832, 32632),  # ETRS89 and WGS 84, which drift apart by 25 mm a year
        (2263, 32118),  # feet and metres
        (6677, 2451),  # JGD2011 and JGD2000, of one ellipsoid
        (3006, 3007),
    ],
)
def test_other_systems_are_not_equal(one: int, other: int) -> None:
    assert not same_horizontally(CRS(one), CRS(other))
    for form in ("WKT1 LAStools", "WKT1 ESRI"):
        found = TABLE.written(CRS.from_epsg(one), one, form)
        assert found is not None
        assert not same_horizontally(found, CRS(other))


def test_a_system_without_a_datum_agrees_with_its_ellipsoid_only() -> None:
    utm = CRS("+proj=utm +zone=33 +ellps=GRS80 +units=m")
    assert lacks_datum(utm)
    assert same_horizontally(utm, CRS(25833))
    assert not same_horizontally(utm, CRS(32633))
    assert not same_horizontally(utm, CRS(25832))
    assert epsg_code(utm) is None


def test_parameters_count_and_not_the_code_beside_them() -> None:
    text = CRS(25832).to_wkt("WKT1_GDAL").replace('"false_easting",500000', '"false_easting",400000')
    wrong = CRS.from_wkt(text)
    assert stated_code(wrong) == 25832
    assert epsg_code(wrong) is None
    assert not same_horizontally(wrong, CRS(25832))


def test_feet_become_metres_of_the_same_projection() -> None:
    assert same_horizontally(in_metres(CRS(2263)), CRS(32118))
    assert in_metres(CRS(25832)) == CRS(25832)


def test_heights_of_another_datum_are_named() -> None:
    nn2000, dhhn = CRS(5941), CRS(7837)
    assert heights_differ(dhhn, 5972) == "its heights are DHHN2016 height, the tunnel's are NN2000 height"
    assert heights_differ(nn2000, 5972) is None
    assert heights_differ(dhhn, 25832) is None  # of which no heights are known
