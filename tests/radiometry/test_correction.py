"""Intensity correction against closed formulas and simulated reflection."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tunneldb.errors import UserError
from tunneldb.radiometry.correction import observe, range_span, to_decibel
from tunneldb.radiometry.oren_nayar import coefficients, incidence_db
from tunneldb.radiometry.reference_curve import ReferenceCurve
from tunneldb.radiometry.roughness import Regions, automatic_regions, drawn_regions, find_roughness, objective

CURVE = ReferenceCurve(np.array([1.0, 4.0, 10.0, 30.0]), np.array([20.0, 26.0, 25.0, 15.5]))


def test_oren_nayar_without_roughness_is_lambert():
    cosine = np.cos(np.radians([0.0, 30.0, 60.0, 85.0]))
    assert coefficients(0.0) == (1.0, 0.0)
    np.testing.assert_allclose(incidence_db(cosine, 0.0), 10 * np.log10(cosine), atol=1e-12)


@given(st.floats(0.0, 89.0), st.floats(0.0, 90.0))
def test_oren_nayar_is_equation_15(angle, roughness):
    theta, square = np.radians(angle), np.radians(roughness) ** 2
    written = np.cos(theta) * (
        1 - 0.5 * square / (square + 0.33) + 0.45 * square / (square + 0.09) * np.sin(theta) * np.tan(theta)
    )
    assert incidence_db(np.cos(theta), roughness) == pytest.approx(10 * np.log10(written), abs=1e-9)


def test_reference_curve_is_piecewise_linear():
    np.testing.assert_allclose(CURVE(np.array([1.0, 2.5, 4.0, 7.0, 20.0, 30.0])), [20, 23, 26, 25.5, 20.25, 15.5])


@pytest.mark.parametrize(
    ("ranges", "levels", "says"),
    [
        ([3.0], [1.0], "at least 2 rows"),
        ([1.0, np.nan], [1.0, 2.0], "row 2 .* is not finite"),
        ([1.0, 2.0], [1.0, np.inf], "row 2 .* is not finite"),
        ([0.0, 2.0], [1.0, 2.0], "positive"),
        ([2.0, 2.0], [1.0, 2.0], "2 m"),
    ],
)
def test_a_bad_reference_curve_is_refused(ranges, levels, says):
    with pytest.raises(UserError, match=says):
        ReferenceCurve.from_rows(np.array(ranges), np.array(levels))


def _views(points, scanner, raw, kind, reference=CURVE):
    normal = np.tile([0.0, 0.0, -1.0], (len(points), 1))
    return observe(points, np.broadcast_to(scanner, points.shape), normal, raw, kind, reference)


def _ceiling(count, seed):
    """Points on a ceiling 5 m above the scanner, with incidence angles up to about 70°."""
    rng = np.random.default_rng(seed)
    points = np.column_stack([rng.uniform(-10, 10, (count, 2)), np.full(count, 5.0)])
    return points, np.linalg.norm(points, axis=1), 5.0 / np.linalg.norm(points, axis=1), rng


@pytest.mark.parametrize("kind", ["amplitude", "reflectance", "linear"])
def test_correction_is_the_inverse_of_the_model(kind):
    points, ranges, cosine, rng = _ceiling(2000, 1)
    albedo = rng.uniform(-6.0, 3.0, len(points))
    level = albedo + incidence_db(cosine, 17.0) + (CURVE(ranges) if kind != "reflectance" else 0.0)
    raw = (10 ** (level / 10) if kind == "linear" else level).astype(np.float32)
    views = _views(points, np.zeros(3), raw, kind)
    np.testing.assert_allclose(views.range_m, ranges, rtol=1e-6)
    np.testing.assert_allclose(views.cosine, cosine, rtol=1e-5)
    np.testing.assert_allclose(views.raw_db, level, atol=1e-4)
    np.testing.assert_allclose(views.corrected(17.0), albedo, atol=1e-4)


def test_counts_that_are_not_positive_have_no_level():
    assert np.isnan(to_decibel(np.array([0.0, -3.0]), "linear")).all()
    points = np.array([[0.0, 0.0, 5.0], [0.0, 0.0, 5.0], [0.0, 0.0, 5.0]])
    views = _views(points, np.zeros(3), np.array([0.0, -1.0, 100.0], np.float32), "linear")
    assert np.isnan(views.raw_db).tolist() == [True, True, False]
    assert views.raw_db[2] == pytest.approx(20.0)


def test_a_surface_seen_from_behind_has_no_corrected_intensity():
    views = _views(np.array([[0.0, 0.0, 5.0]]), np.array([0.0, 0.0, 9.0]), np.array([3.0], np.float32), "reflectance")
    assert np.isnan(views.corrected(10.0)).all()


def test_amplitude_without_a_reference_curve_is_refused():
    with pytest.raises(UserError, match="reference"):
        _views(np.array([[0.0, 0.0, 5.0]]), np.zeros(3), np.array([3.0], np.float32), "amplitude", None)


def test_a_curve_that_does_not_span_the_lining_is_told_with_both_spans():
    points = np.column_stack([np.zeros((100, 2)), np.linspace(2.0, 40.0, 100)])
    views = _views(points, np.zeros(3), np.zeros(100, np.float32), "amplitude")
    span = range_span(views, np.ones(100, bool), CURVE)
    assert span[3] == 100
    assert span[2] == np.count_nonzero(points[:, 2] > 30.05)
    assert re.search(r"covers 1 to 30 m.*2\.00 to 40\.00 m.*26 %", CURVE.outside_text(*span))
    assert range_span(views, points[:, 2] < 30.04, CURVE)[2] == 0


def test_objective_is_equation_17():
    rng = np.random.default_rng(4)
    regions = Regions(rng.uniform(0.3, 1.0, 30), rng.normal(0, 1, 30), np.full(30, 5))
    corrected = regions.distance_db - incidence_db(regions.cosine, 12.0)
    total = sum(abs(corrected[m] - corrected[n]) for m in range(30) for n in range(m, 30))
    assert objective(regions, 12.0) == pytest.approx(np.sqrt(total / (30 * 31 / 2)), rel=1e-9)


def _lining(roughness, seed, steepest=70.0, noise=0.5):
    """Lining of 100 m × 16 m with a fifth of it wet, seen ever more slantingly away from the crown."""
    rng = np.random.default_rng(seed)
    chainage, arc = rng.uniform(0, 100, 200_000), rng.uniform(-8, 8, 200_000)
    cosine = np.cos(np.radians(np.abs(arc) / 8 * steepest))
    wet = np.sin(1.3 * chainage + seed) + np.sin(1.7 * arc + 1) > 1.1
    level = 3.0 + incidence_db(cosine, roughness) + rng.normal(0, noise, len(arc)) - 3.0 * wet
    assert wet.mean() > 0.15
    return chainage, arc, np.zeros(len(arc), int), cosine, level


@pytest.mark.parametrize("roughness", [5.0, 12.0, 20.0, 30.0])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_roughness_is_recovered(roughness, seed):
    found = find_roughness(automatic_regions(*_lining(roughness, seed)))
    assert found.determined
    assert found.sigma == pytest.approx(roughness, abs=1.0)


def test_roughness_is_not_claimed_where_incidence_hardly_varies():
    found = find_roughness(automatic_regions(*_lining(20.0, 1, steepest=12.0)))
    assert not found.determined
    assert found.incidence_to < 12.0


@pytest.mark.parametrize("brighter", [0.03, 0.1])
def test_roughness_is_not_taken_for_what_soot_does(brighter):
    """Lining that gets brighter the more slantingly it is seen follows no roughness: that of concrete is taken, and said."""
    chainage, arc, view, cosine, level = _lining(10.0, 2, steepest=40.0)
    angle = np.degrees(np.arccos(cosine))
    found = find_roughness(automatic_regions(chainage, arc, view, cosine, level + brighter * angle))
    assert (found.sigma, found.assumed, found.determined) == (9.0, True, False)
    assert "soot" in found.note


def test_roughness_of_nothing_is_that_of_concrete():
    nothing = np.zeros(0)
    found = find_roughness(Regions(nothing, nothing, nothing.astype(int)))
    assert (found.sigma, found.assumed, found.determined) == (9.0, True, False)
    assert "too little" in found.note


def test_roughness_of_drawn_regions():
    chainage, arc, view, cosine, level = _lining(15.0, 5)
    dry = np.sin(1.3 * chainage + 5) + np.sin(1.7 * arc + 1) < 1.0
    region = np.where(dry & (np.mod(arc, 2.0) < 0.3), np.floor(chainage / 10).astype(int), -1)
    found = find_roughness(drawn_regions(region, view, cosine, level))
    assert found.determined
    assert found.sigma == pytest.approx(15.0, abs=1.0)


def test_regions_of_no_points():
    nothing = np.zeros(0)
    assert len(automatic_regions(nothing, nothing, nothing.astype(int), nothing, nothing)) == 0
    assert len(drawn_regions(nothing.astype(int), nothing.astype(int), nothing, nothing)) == 0
