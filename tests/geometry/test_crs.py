"""Where on Earth coordinate systems are made for, and those that are nowhere."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from pyproj import CRS

from tunneldb.arrays import Float
from tunneldb.geometry.crs import fits_srid, mirroring_axes, outside_area
from tunneldb.geometry.local import LOCAL

PLACES = [  # published coordinates of places, m
    (3794, 462000.0, 101000.0, True),  # Ljubljana
    (25832, 691600.0, 5334800.0, True),  # Munich
    (28992, 121500.0, 487000.0, True),  # Amsterdam
    (2193, 1749000.0, 5428000.0, True),  # Wellington
    (3832, 0.0, 0.0, True),  # the Pacific at 150° E, whose area lies across 180°
    (3794, 100.0, 50.0, False),  # a scanner's own coordinates
    (25832, 0.0, 0.0, False),
    (3794, 691600.0, 5334800.0, False),  # Munich's coordinates of UTM
    (25832, 4468500.0, 5333500.0, False),  # Munich in Gauß-Krüger
]


@pytest.mark.parametrize(("srid", "x", "y", "inside"), PLACES)
def test_places_outside_of_the_area_are_told(srid: int, x: float, y: float, inside: bool) -> None:
    said = outside_area(srid, np.array([[x, y], [x + 50.0, y + 50.0]]))
    assert (said is None) == inside
    if said is not None:
        assert f"EPSG:{srid}" in said
        assert "--srid local" in said


@pytest.mark.parametrize(
    ("change", "cause"),
    [
        (lambda xy: xy[:, ::-1], "inside with east and north swapped"),
        (lambda xy: xy * 1000.0, "inside if they are millimetres"),
        (lambda xy: xy / 0.3048, "inside if they are feet"),
    ],
)
def test_the_likely_cause_is_named(change: Callable[[Float], Float], cause: str) -> None:
    munich = np.array([[691600.0, 5334800.0]])
    assert cause in str(outside_area(25832, change(munich)))


def test_what_lies_over_a_border_is_taken_for_meant() -> None:
    # Villach, 20 km beyond the Slovene border, from where the Karavanke tunnel comes; and a line with one end inside.
    assert outside_area(3794, np.array([[412000.0, 164000.0]])) is None
    assert outside_area(3794, np.array([[462000.0, 101000.0], [462000.0, 901000.0]])) is None


def test_what_has_no_area_is_not_judged() -> None:
    far = np.array([[1e7, 1e7]])
    assert outside_area(LOCAL, far) is None
    assert outside_area(None, far) is None
    assert outside_area(3794, far) is not None


def test_only_systems_of_no_place_are_local() -> None:
    site = CRS.from_wkt('LOCAL_CS["Site grid",UNIT["metre",1]]')
    assert fits_srid(site, LOCAL)
    assert not fits_srid(site, 3794)
    assert not fits_srid(CRS(3794), LOCAL)
    assert fits_srid(CRS("EPSG:3794+5778"), 3794)


@pytest.mark.parametrize("srid", [25832, 3006, 5514, 2046, 2218, 3031])
def test_axes_that_keep_left_and_right(srid: int) -> None:
    assert mirroring_axes(srid) is None


def test_axes_that_exchange_left_and_right() -> None:
    assert mirroring_axes(5513) == ("south", "west")
    assert mirroring_axes(3052) == ("west", "north")
