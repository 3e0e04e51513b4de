"""Clearance against closed formulas and shapely; tracks against rails that are known."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from support.rails import BOX, rails

from tunneldb.classification.classes import PointClass
from tunneldb.measures.clearance.compute.clearance import clearance, clock
from tunneldb.measures.clearance.compute.gauge import Widening, closed, halved, overthrow, terms, widened
from tunneldb.measures.clearance.compute.track import Track, curvature, fit_track, follow, rail_pairs
from tunneldb.shape.outline import Outline


def test_two_tracks_are_found_with_their_cant_among_other_bars() -> None:
    rng = np.random.default_rng(1)
    guard = np.column_stack([rng.uniform(0, 200, 3000), rng.normal(-0.4, 0.01, 3000), rng.normal(-2.52, 0.01, 3000)])
    points = np.vstack([rails(-0.05, 0.06, rng, 1 / 2e4), rails(3.9, -0.02, rng, 1 / 2e4), guard])
    pairs = follow(rail_pairs(points))
    assert len(pairs) == 2
    for coarse, middle, cant in zip(pairs, (-0.05, 3.9), (0.06, -0.02), strict=True):
        track = fit_track(points, coarse, 0.0, 200.0)
        true = middle + track.chainage**2 / 4e4
        assert track.seen.mean() > 0.9
        assert np.median(np.abs(track.right - true)) < 0.0015
        assert np.abs(track.right - true).max() < 0.005
        assert np.abs(track.up + 2.5).max() < 0.002
        assert np.abs(track.cant - cant).max() < 0.003
        assert 0.1 < np.std(track.right - true) / track.right_se.mean() < 10.0


def test_one_rail_or_another_gauge_is_no_track() -> None:
    rng = np.random.default_rng(2)
    points = rails(0.0, 0.0, rng)
    assert follow(rail_pairs(points[points[:, 1] > 0])) == []
    assert follow(rail_pairs(points, 1.0)) == []


def test_overthrow_is_that_of_a_chord() -> None:
    inward, outward = overthrow(14.0, 4.0, np.array([0.0, 1 / 300.0, -1 / 300.0]))
    chord = np.sqrt(300.0**2 - 7.0**2)
    assert inward == pytest.approx([0.0, 300.0 - chord, 300.0 - chord], abs=1e-9)
    assert outward == pytest.approx([0.0, *2 * [np.hypot(chord, 11.0) - 300.0]], abs=1e-9)


def test_equilibrium_cant_needs_no_roll() -> None:
    cant = 1.5 * 30.0**2 / (9.80665 * 800.0)
    found = terms(Widening(speed=30.0, flexibility=0.4), np.array([1 / 800.0, 1 / 800.0]), np.array([cant, cant - 0.05]), 1.5)
    assert found.deficiency == pytest.approx([0.0, 0.05])
    assert found.roll == pytest.approx([0.0, -0.4 * 0.05 / 1.5])  # to the left, out of a curve to the right


@pytest.mark.slow
def test_margins_are_those_of_shapely_in_a_canted_track_on_a_curve() -> None:
    rng = np.random.default_rng(3)
    n, radius, cant = 4000, 300.0, 0.1
    s = rng.uniform(0.0, 4.0, n)
    x, y = rng.uniform(-3.0, 3.0, n), rng.uniform(-0.5, 6.0, n)
    flat = np.full(2, 0.0)
    track = Track(np.array([0.0, 4.0]), flat + 0.2, flat - 1.0, flat + cant, flat, flat, flat, np.ones(2, np.bool_), 1.5, 9.0)
    angle = np.arcsin(cant / 1.5)
    # The track's own axes, turned to the right by the cant.
    about = [0.2, -1.0] + x[:, None] * [np.cos(angle), -np.sin(angle)] + y[:, None] * [np.sin(angle), np.cos(angle)]
    places = track.places(s, *about.T)
    assert places == pytest.approx(np.column_stack([x, y]), abs=1e-9)
    assert track.about_axis(s, x, y) == pytest.approx(about, abs=1e-9)
    inward, outward = overthrow(14.0, 4.0, np.array([1 / radius]))
    outline = widened(halved(BOX), outward[0], inward[0])
    ends = np.array([[-1.6, 0.3], [-1.6, 3.0], [-1.0, 4.3], [1.0, 4.3], [1.6, 3.0], [1.6, 0.3]])
    ends[:3, 0] -= outward[0]
    ends[3:, 0] += inward[0]
    polygon = shapely.Polygon(ends)
    found = clearance(
        np.column_stack([s, places]), np.full(n, PointClass.LINING, np.uint8), np.arange(4.0), [outline] * 4
    ).margin  # fmt: skip
    wanted = shapely.distance(polygon.exterior, shapely.points(x, y)) * np.where(shapely.contains_xy(polygon, x, y), -1, 1)
    assert np.abs(found - wanted).max() < 1e-6
    assert outline.area == pytest.approx(polygon.area)


def test_noise_and_people_do_not_infringe_but_a_box_does() -> None:
    wall = np.array([(s, x, y) for s in np.arange(0.05, 3, 0.1) for x in (-2.0, 2.0) for y in np.arange(0.05, 5, 0.1)])
    box = np.array([(1.5 + a, 1.55, 2.0 + b) for a in (0.0, 0.1) for b in (0.0, 0.1)])
    person = np.array([(0.5, 0.3, 0.5 + k / 10) for k in range(12)])
    single = np.array([(2.5, 0.0, 3.0)])
    noise = np.array([(2.5, 1.0 + k / 50, 2.0) for k in range(5)])
    places = np.vstack([wall, box, person, single, noise])
    kinds = (PointClass.LINING, PointClass.APPENDAGE, PointClass.OBJECT, PointClass.APPENDAGE, PointClass.NOISE)
    classes = np.repeat([int(k) for k in kinds], [len(wall), 4, 12, 1, 5]).astype(np.uint8)
    found = clearance(places, classes, np.arange(3.0), [BOX] * 3)
    first, second, third = found.sections
    assert first.margin == pytest.approx(0.4)
    assert first.passing == 12
    assert first.inside == 0
    assert second.margin == pytest.approx(-0.05)
    assert second.inside == 4
    assert second.clock == pytest.approx(clock(np.array([[1.55, 2.0]]), np.array([0.0, 2.3]))[0], abs=4.0)
    assert third.margin == pytest.approx(0.4)
    assert third.stray == 6
    found_inside = [(one.klass, len(one.points)) for one in found.infringements]
    assert found_inside == [(PointClass.OBJECT, 12), (PointClass.APPENDAGE, 4)]
    assert found.infringements[1].depth == pytest.approx(0.05)
    assert third.seen < 0.9  # nothing below, little above


def test_curvature_of_a_circle() -> None:
    s = np.arange(0.0, 200.0, 1.0)
    xy = 500.0 * np.column_stack([np.cos(s / 500.0), -np.sin(s / 500.0)])  # clockwise: to the right
    assert curvature(s, xy) == pytest.approx(np.full(200, 1 / 500.0), rel=5e-3)


def test_an_open_outline_is_closed_by_a_line() -> None:
    open_one = Outline.of(np.array([[-1.6, 0.3], [-1.6, 3.0], [1.6, 3.0], [1.6, 0.3]]), np.zeros(4), False)
    assert closed(open_one).closed
