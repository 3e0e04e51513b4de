"""Distances from lines and arcs, and areas, against closed formulas and shapely."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from tunneldb.measures.deviation.compute import section_deviation
from tunneldb.shape.outline import Outline
from tunneldb.shape.profile import Deviation, Profile, Stretch, deviation, signed_distance, stretches, strip_area


def arc(angle: float) -> float:
    """Bulge of an arc that turns clockwise through an angle, °."""
    return -np.tan(np.radians(angle) / 4.0)


def circle(radius: float, right: float = 0.0, up: float = 0.0) -> Outline:
    vertices = np.array([[right - radius, up], [right + radius, up]])
    return Outline.of(vertices, np.full(2, arc(180.0)), closed=True)


def horseshoe(radius: float = 5.0, wall: float = 2.0) -> Outline:
    """Half a circle on vertical walls, without a floor."""
    vertices = np.array([[-radius, -wall], [-radius, 0.0], [radius, 0.0], [radius, -wall]])
    return Outline.of(vertices, np.array([0.0, arc(180.0), 0.0, 0.0]), closed=False)


def test_an_outline_is_the_same_whichever_way_it_was_drawn() -> None:
    shoe = horseshoe()
    turned = Outline.of(
        np.vstack([shoe.elements[:, :2], shoe.elements[-1:, 2:4]])[::-1], np.array([0, -arc(180.0), 0, 0]), False
    )
    np.testing.assert_allclose(turned.elements, shoe.elements, atol=1e-12)
    assert shoe.length == pytest.approx(4.0 + 5.0 * np.pi)
    assert shoe.area == pytest.approx(20.0 + 12.5 * np.pi)
    closed = circle(3.0, 0.4, 1.0)
    assert closed.closed
    assert closed.elements[0, 0] == pytest.approx(0.0, abs=1e-9)  # straight below the axis
    assert closed.elements[0, 1] == pytest.approx(1.0 - np.sqrt(9.0 - 0.16))
    assert closed.area == pytest.approx(9.0 * np.pi)
    assert closed.length == pytest.approx(6.0 * np.pi)


def test_distances_are_those_of_shapely_with_the_sign_of_the_side() -> None:
    corners = np.array([[-4.0, -1.0], [-3.0, 3.0], [0.5, 3.5], [4.0, 2.0], [3.0, -1.0]])
    outline = Outline.of(corners, np.array([arc(60.0), 0.0, arc(80.0), -arc(40.0), arc(20.0)]), closed=True)
    polygon = shapely.Polygon(outline.flattened(1e-8))
    assert outline.area == pytest.approx(polygon.area, abs=1e-5)
    points = np.random.default_rng(1).uniform(-7.0, 7.0, (2000, 2))
    wanted = shapely.distance(polygon.exterior, shapely.points(points))
    wanted = np.where(shapely.contains_xy(polygon, *points.T), wanted, -wanted)
    np.testing.assert_allclose(signed_distance(outline, points), wanted, atol=1e-6)
    on_it, inwards = outline.places(np.linspace(0.0, 1.0, 77))
    np.testing.assert_allclose(signed_distance(outline, on_it + 0.01 * inwards)[1:-1], 0.01, atol=2e-4)


def test_beyond_the_feet_of_an_open_outline_nothing_is_said() -> None:
    found = signed_distance(horseshoe(), np.array([[-4.9, -2.1], [4.9, -2.1], [-4.9, -1.9], [0.0, 4.0], [0.0, 5.3]]))
    np.testing.assert_allclose(found, [np.nan, np.nan, 0.1, 1.0, -0.3], atol=1e-9)


@pytest.mark.parametrize("by", [0.05, 0.3])
def test_a_shifted_circle_has_the_lune_s_area_within_a_thousandth(by: float) -> None:
    """Over- and underbreak of a circle shifted by d are the lunes 2 r² asin(d/2r) + d/2 √(4 r² - d²)."""
    radius, angle = 3.0, np.radians(np.arange(0.0, 360.0, 0.1))
    outline = circle(radius)
    right, up = by + radius * np.sin(angle), radius * np.cos(angle)
    found = deviation(Stretch("", 0.0, 0.0, outline, outline), np.zeros(1), right[None], up[None])
    wanted = radius - np.sqrt(radius**2 + by**2 + 2.0 * radius * by * np.sin(angle))
    np.testing.assert_allclose(found.distance[0], wanted, atol=1e-9)
    area = strip_area(found.distance, found.curvature)[0]
    along = np.unwrap(found.share[0] * 2.0 * np.pi) * radius
    each = np.gradient(along)
    lune = 2.0 * radius**2 * np.arcsin(by / 2.0 / radius) + by / 2.0 * np.sqrt(4.0 * radius**2 - by**2)
    assert -(each * np.minimum(area, 0.0)).sum() == pytest.approx(lune, rel=1e-3)
    assert (each * np.maximum(area, 0.0)).sum() == pytest.approx(lune, rel=1e-3)


@pytest.mark.parametrize(("off", "pixel"), [(-0.1, 0.02), (0.08, 0.01)])
def test_a_horseshoe_has_the_over_or_underbreak_of_a_parallel_one(off: float, pixel: float) -> None:
    """Of a strip of width d along a horseshoe: 4 wall d on the walls, π d (r - d/2) on the arch (r = 5, walls of 2 m)."""
    shoe = horseshoe()
    share = np.tile((np.arange(pixel / 2.0, shoe.length, pixel)) / shoe.length, (3, 1))
    feet, inward = shoe.places(share[0])
    points = feet + off * inward
    found = deviation(Stretch("", 0.0, 0.0, shoe, shoe), np.zeros(3), *(np.tile(points[:, k], (3, 1)) for k in (0, 1)))
    np.testing.assert_allclose(found.distance, off, atol=1e-9)
    figures = section_deviation(found, shoe, pixel)
    area = 4.0 * off + np.pi * off * (5.0 - off / 2.0)
    assert figures.underbreak - figures.overbreak == pytest.approx(area, rel=1e-3)
    assert min(figures.underbreak, figures.overbreak) == 0.0
    assert figures.seen_length == pytest.approx(shoe.length, abs=pixel)
    # Of an axis moved up by t the arch, 10 m wide, has 10 t less overbreak or more underbreak; to the right walls cancel.
    assert -figures.over_by[1] + figures.under_by[1] == pytest.approx(10.0, rel=1e-3)
    np.testing.assert_allclose(figures.over_by[0] + figures.under_by[0], 0.0, atol=pixel)
    hidden = Deviation(np.where(share < 0.5, found.distance, np.nan), found.share, found.curvature)
    half = section_deviation(hidden, shoe, pixel)
    assert half.seen_length == pytest.approx(shoe.length / 2.0, abs=pixel)
    assert half.underbreak - half.overbreak == pytest.approx(area / 2.0, rel=2e-3)  # unseen is not as designed: it is nothing


def test_transitions_are_linear_and_outlines_with_other_elements_go_together() -> None:
    one, other = Profile("a", 0.0, 100.0, circle(3.0)), Profile("b", 120.0, 200.0, circle(4.0))
    parts = stretches([other, one])
    assert [part.name for part in parts] == ["a", "a – b", "b"]
    at = np.array([100.0, 105.0, 120.0])
    found = deviation(parts[1], at, np.zeros((3, 1)), np.full((3, 1), 2.0))
    np.testing.assert_allclose(found.distance[:, 0], [1.0, 1.25, 2.0], atol=1e-12)
    three = Outline.of(np.array([[-5.0, -2.0], [-5.0, 0.0], [0.0, 5.0], [5.0, 0.0], [5.0, -2.0]]),
                       np.array([0.0, arc(90.0), arc(90.0), 0.0, 0.0]), closed=False)  # fmt: skip
    middle = stretches([Profile("a", 0.0, 10.0, horseshoe()), Profile("c", 20.0, 30.0, three)])[1].at(13.0)
    assert middle.area == pytest.approx(three.area)  # the same shape in other pieces
    with pytest.raises(ValueError, match="a and b overlap"):
        stretches([one, Profile("b", 99.0, 120.0, circle(4.0))])
    with pytest.raises(ValueError, match="no transition is possible"):
        stretches([one, Profile("b", 101.0, 120.0, horseshoe())])


def test_crossings_are_found_by_their_elements() -> None:
    assert horseshoe().crossing() is None
    assert circle(3.0).crossing() is None
    bow = Outline(np.array([[0, 0, 4, 4, 0], [4, 4, 4, 0, 0], [4, 0, 0, 4, 0], [0, 4, 0, 0, 0]], dtype=float))
    assert bow.crossing() == (0, 2)
