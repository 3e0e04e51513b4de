"""Found leaks against true ones: closed formulas, counted pixels, and what must not matter."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.affinity import translate
from shapely.geometry import MultiPolygon, Point, Polygon, box

from tunneldb.evaluate.measure import compare, figures
from tunneldb.evaluate.report import as_csv, as_json, make_report
from tunneldb.evaluate.survey import distance_from_scanner
from tunneldb.pointcloud.poses import PoseModel


def test_circle_in_a_circle():
    true, found = Point(5, 2).buffer(0.5, quad_segs=128), Point(5, 2).buffer(0.52, quad_segs=128)
    c = compare([true], [found], 0.1)
    one = figures(c, seen=500.0)
    assert (one.true, one.touched, one.found, one.called, one.right, one.false) == (1, 1, 1, 1, 1, 0)
    inner, outer = math.pi * 0.5**2, math.pi * 0.52**2
    assert one.area_recall == pytest.approx(1.0)
    assert one.area_precision == pytest.approx(inner / outer, rel=1e-3)
    assert one.area_iou == pytest.approx(inner / outer, rel=1e-3)
    assert one.area_f1 == pytest.approx(2 * inner / (inner + outer), rel=1e-3)
    assert one.iou == pytest.approx(inner / outer, rel=1e-3)
    assert one.area_error == pytest.approx(outer / inner - 1, rel=1e-3)
    assert one.edge == pytest.approx(0.02, abs=1e-4)
    assert one.edge_p95 == pytest.approx(0.02, abs=1e-4)
    assert one.false_per_1000 == 0.0


def test_a_leak_is_found_when_half_of_it_is():
    true = [box(0, 0, 1, 1), box(10, 0, 11, 1), box(20, 0, 21, 1)]
    found = [box(0.51, 0, 1, 1), box(10.5, 0, 11, 1)]  # 49 %, 50 %, nothing
    one = figures(compare(true, found, 0.1))
    assert (one.true, one.touched, one.found) == (3, 2, 1)
    assert one.recall == pytest.approx(1 / 3)
    assert one.precision == 1.0
    assert one.f1 == pytest.approx(0.5)
    assert one.iou == pytest.approx((0.49 + 0.5 + 0) / 3)


def test_a_leak_in_pieces_is_one_and_two_found_as_one_are_right():
    pieces = [box(0, 0, 0.3, 1), box(0.4, 0, 0.7, 1), box(0.8, 0, 1, 1)]
    c = compare([box(0, 0, 1, 1)], pieces, 0.1)
    assert c.covered == pytest.approx([0.8])
    assert c.area_error == pytest.approx([0.2])
    assert set(c.found_group) == {0}
    c = compare([box(0, 0, 1, 1), box(1.2, 0, 2.2, 1)], [box(0, 0, 2.2, 1)], 0.1)
    one = figures(c)
    assert (one.found, one.right, one.false) == (2, 1, 0)
    assert c.area_error == pytest.approx([0.1, 0.1])
    assert c.iou == pytest.approx([2 / 2.2, 2 / 2.2])


def test_parts_of_one_leak_are_one():
    drip = MultiPolygon([box(0, 0, 1, 1), box(0.4, -1, 0.6, -0.2)])
    one = figures(compare([drip], [box(0, 0, 1, 1)], 0.1))
    assert (one.true, one.found) == (1, 1)
    assert one.area_recall == pytest.approx(1 / 1.16)


def test_small_true_leaks_are_neither_demanded_nor_do_they_harm():
    true = [box(0, 0, 1, 1), box(5, 0, 5.2, 0.2), box(1.5, 0, 1.7, 0.2)]
    found = [box(0, 0, 2, 1), box(4.9, 0, 5.4, 0.5), box(9, 0, 9.2, 0.2)]  # over both, about a small one, small on none
    c = compare(true, found, 0.1)
    assert c.true.tolist() == [0]
    assert c.found.tolist() == [0]
    assert c.found_area == pytest.approx([2.0 - 0.04])
    assert figures(c).false == 0
    assert figures(compare(true, found, 0.0)).true == 3
    assert figures(compare(true, found, 0.0)).false == 1


def test_false_leaks_are_those_that_touch_no_true_one():
    true, found = [box(0, 0, 1, 1)], [box(0.9, 0, 2, 1), box(1, 0, 2, 1), box(7, 0, 8, 1)]
    one = figures(compare(true, found[:1] + found[2:], 0.1), seen=400.0)
    assert (one.called, one.right, one.false) == (2, 0, 1)
    assert one.false_per_1000 == pytest.approx(2.5)
    # A side in common is no area in common.
    assert figures(compare(true, found[1:2], 0.1)).false == 1


def test_nothing_found_and_nothing_there():
    none = figures(compare([box(0, 0, 1, 1)], [], 0.1), seen=10.0)
    assert (none.recall, none.f1, none.area_f1, none.area_iou, none.iou) == (0.0, 0.0, 0.0, 0.0, 0.0)
    assert math.isnan(none.precision)
    assert math.isnan(none.edge)
    dry = figures(compare([], [box(0, 0, 1, 1)], 0.1), seen=2000.0)
    assert (dry.false, dry.false_per_1000, dry.precision, dry.area_precision) == (1, 0.5, 0.0, 0.0)
    assert math.isnan(dry.recall)
    empty = figures(compare([], [], 0.1), seen=2000.0)
    assert empty.false_per_1000 == 0.0
    assert math.isnan(empty.f1)


def test_leaks_are_cut_at_the_ends_of_the_stretch_and_the_cut_is_no_edge():
    stretch = box(0, -100, 1000, 100)
    true, found = [box(-1, 0, 1, 1), box(1000, 0, 1001, 1), box(998, 5, 1002, 6)], [box(-1, 0, 1.1, 1), box(999, 5, 1005, 6)]
    c = compare(true, found, 0.1, stretch)
    assert c.true.tolist() == [0, 2]
    assert c.true_area == pytest.approx([1.0, 2.0])
    assert c.covered == pytest.approx([1.0, 0.5])
    assert c.area_error == pytest.approx([0.1, 0.5])
    # Right side of the first: 0.1 m off from 100 points each way; above and below: on the line, but for the last 0.1 m.
    assert c.edges[0].max() == pytest.approx(0.1, abs=0.001)
    assert len(c.edges[0]) == pytest.approx(300 + 320, abs=4)


boxes = st.lists(
    st.tuples(st.integers(0, 30), st.integers(0, 12), st.integers(1, 8), st.integers(1, 6)), min_size=0, max_size=8
)


def polygons(rows):
    return [box(x / 8, y / 8, (x + w) / 8, (y + h) / 8) for x, y, w, h in rows]


def mask(rows):
    out = np.zeros((20, 40), bool)
    for x, y, w, h in rows:
        out[y : y + h, x : x + w] = True
    return out


@given(boxes, boxes)
@settings(deadline=None, max_examples=60)
def test_areas_are_those_of_counted_pixels(true, found):
    one = figures(compare(polygons(true), polygons(found), 0.0))
    t, f = mask(true), mask(found)
    assert one.true_area == pytest.approx(t.sum() / 64)
    assert one.found_area == pytest.approx(f.sum() / 64)
    if t.any():
        assert one.area_recall == pytest.approx((t & f).sum() / t.sum())
    if f.any():
        assert one.area_precision == pytest.approx((t & f).sum() / f.sum())
    if t.any() or f.any():
        assert one.area_iou == pytest.approx((t & f).sum() / (t | f).sum())
        assert one.area_f1 == pytest.approx(2 * (t & f).sum() / (t.sum() + f.sum()))
    hit = sum((mask([row]) & f).sum() >= 0.5 * mask([row]).sum() for row in true)
    touched = sum((mask([row]) & f).any() for row in true)
    assert (one.found, one.touched) == (hit, touched)
    assert one.false == sum(not (mask([row]) & t).any() for row in found)


@given(boxes.filter(len), st.randoms(use_true_random=False))
@settings(deadline=None, max_examples=30)
def test_order_and_place_do_not_matter_and_the_same_is_perfect(rows, random):
    shapes = polygons(rows)
    moved = [translate(shape, 12_345.0, -3.0) for shape in shapes]
    random.shuffle(moved)
    same = figures(compare(shapes, shapes, 0.0), seen=100.0)
    assert (same.recall, same.precision, same.false) == (1.0, 1.0, 0)
    assert same.area_iou == pytest.approx(1.0)
    assert same.edge_p95 == pytest.approx(0.0, abs=1e-9)
    other = figures(compare([translate(s, 12_345.25, -3.0) for s in shapes], moved, 0.0))
    again = figures(compare([translate(s, 0.25, 0.0) for s in shapes], shapes, 0.0))
    assert other.area_f1 == pytest.approx(again.area_f1)
    assert (other.found, other.right, other.false) == (again.found, again.right, again.false)


def test_groups_hold_each_leak_once():
    rng = np.random.default_rng(3)
    true = [box(10 * k, 0, 10 * k + a, 1) for k, a in enumerate(rng.uniform(0.1, 3.0, 40))]
    found = [translate(shape, 0.05, 0.02) for shape in true[::2]] + [box(500 + k, 0, 500.3 + k, 0.5) for k in range(9)]
    c = compare(true, found, 0.1)
    distances = rng.uniform(0, 15, len(c.true)), rng.uniform(0, 15, len(c.found))
    report = make_report(c, [str(k) for k in range(40)], [str(k) for k in range(29)], distances, 0.1, 900.0)
    names = list(report.groups)
    assert names == ["all", "0.1 to 0.3 m²", "0.3 to 1 m²", "1 m² and more", "0 to 5 m", "5 to 10 m", "10 m and more"]
    for groups in (names[1:4], names[4:]):
        for field in ("true", "touched", "found", "called", "right", "false"):
            assert sum(getattr(report.groups[g], field) for g in groups) == getattr(report.groups["all"], field)
    assert len(report.missed) == 20
    assert len(report.wrong) == report.groups["all"].false == 9
    assert as_csv(report).count("\n") == 8
    assert '"area_f1": null' not in as_json(report, {}).split('"group": "0.1')[0]


def test_distance_from_stations_and_from_a_trajectory():
    points = np.array([[5.0, 3.0, 4.0], [25.0, 0.0, 2.0], [np.nan, 0.0, 0.0]])
    track = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [20.0, 0.0, 0.0]])
    static = distance_from_scanner(points, PoseModel.from_stations(np.arange(3), track))
    assert static[:2] == pytest.approx([math.sqrt(50.0), math.sqrt(29.0)])
    mobile = distance_from_scanner(points, PoseModel.from_trajectory(np.arange(3.0), track))
    assert mobile[:2] == pytest.approx([5.0, math.sqrt(29.0)])
    assert np.isnan(static[2])
    assert np.isnan(mobile[2])


def test_a_hole_counts_as_edge_and_not_as_area():
    ring = Polygon(box(0, 0, 2, 2).exterior.coords, [box(0.5, 0.5, 1.5, 1.5).exterior.coords])
    c = compare([ring], [box(0, 0, 2, 2)], 0.1)
    assert c.true_area == pytest.approx([3.0])
    assert c.area_error == pytest.approx([1 / 3])
    # The hole's points lie 0.5 m from the found outline, the outer ones on it: 4 of 8 + 4 + 8 m of outline.
    assert (c.edges[0] > 0.4).mean() == pytest.approx(4 / 20, abs=0.01)
    assert shapely.area(c.found_shape) == pytest.approx([4.0])
