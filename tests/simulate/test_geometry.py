"""Geometry of the simulator against closed formulas and other libraries."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import fresnel

from tunneldb.errors import UserError
from tunneldb.simulate import CentreLine, Element, Section, Tunnel, box, circular, horseshoe

SECTIONS = {
    "circular": circular(4.0, 2.8),
    "horseshoe": horseshoe(4.0, 3.0),
    "leaning": horseshoe(4.0, 3.0, 8.0),
    "box": box(8.0, 6.0),
}
LINES = {
    "straight": CentreLine.curve(100.0, 0.0),
    "arc": CentreLine.curve(100.0, 300.0, slope=0.04, start_chainage=12_345.0, origin=(272e3, 4765e3, 640.0)),
    "s": CentreLine.curve(
        200.0, -150.0, straight=20.0, transition=30.0, s_curve=True, slope=-0.03, slope_end=0.04, azimuth=210.0
    ),
}


@pytest.mark.parametrize("line", LINES.values(), ids=LINES)
def test_frame_is_orthonormal_right_handed_and_along_the_axis(line: CentreLine) -> None:
    s = np.linspace(line.start, line.end, 501)[1:-1]
    f = line.frame(s)
    for a, b in (("t", "u"), ("t", "w"), ("u", "w")):
        np.testing.assert_allclose(np.sum(getattr(f, a) * getattr(f, b), axis=1), 0.0, atol=1e-14)
    np.testing.assert_allclose(np.cross(f.u, f.t), f.w, atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(f.t, axis=1), 1.0, atol=1e-14)
    assert np.all(f.u[:, 2] == 0.0)
    assert np.all(f.w[:, 2] > 0.9)
    h = 1e-3
    step = line.position(s + h) - line.position(s - h)
    np.testing.assert_allclose(step / np.linalg.norm(step, axis=1)[:, None], f.t, atol=1e-6)


@pytest.mark.parametrize("line", LINES.values(), ids=LINES)
def test_chainage_is_length_in_plan(line: CentreLine) -> None:
    xyz = line.position(np.linspace(line.start, line.end, 200_001))
    length = np.hypot(*np.diff(xyz[:, :2], axis=0).T).sum()
    assert length == pytest.approx(line.end - line.start, abs=1e-5)


def test_right_curve_is_a_circle_to_the_right_and_slope_is_the_rise_per_plan_length() -> None:
    line = CentreLine.curve(100.0, 300.0, straight=0.0, slope=0.04, azimuth=0.0, origin=(10.0, 20.0, 5.0))
    s = np.linspace(0.0, 100.0, 11)
    expected = np.column_stack([10.0 + 300.0 * (1.0 - np.cos(s / 300.0)), 20.0 + 300.0 * np.sin(s / 300.0), 5.0 + 0.04 * s])
    np.testing.assert_allclose(line.position(s), expected, atol=1e-10)


def test_clothoid_agrees_with_fresnel_integrals() -> None:
    length, radius = 60.0, 300.0
    line = CentreLine.from_elements([Element(length, 0.0, 1.0 / radius)], azimuth=90.0)
    s = np.linspace(0.0, length, 13)
    a = np.sqrt(np.pi * radius * length)
    sine, cosine = fresnel(s / a)
    np.testing.assert_allclose(line.position(s)[:, :2], np.column_stack([a * cosine, a * sine]), atol=1e-10)


def test_vertical_curve_joins_both_grades() -> None:
    line = CentreLine.curve(400.0, 0.0, slope=-0.02, slope_end=0.03)
    z = line.position(np.array([0.0, 100.0, 200.0, 300.0, 400.0]))[:, 2]
    # The parabola over 200 m: its middle lies L*dg/8 above the vertex of the tangents.
    np.testing.assert_allclose(z, [0.0, -2.0, -4.0 + 200.0 * 0.05 / 8.0, -1.0, 2.0], atol=1e-12)


def test_vertices_end_at_the_end() -> None:
    line = CentreLine.curve(50.0, 0.0, azimuth=90.0)
    np.testing.assert_allclose(line.vertices(20.0)[:, 0], [0.0, 20.0, 40.0, 50.0])


def test_no_room_for_the_arc_is_the_users_error() -> None:
    with pytest.raises(UserError, match="leave no arc"):
        CentreLine.curve(30.0, 300.0, straight=20.0, transition=20.0)


def test_perimeters() -> None:
    corner = np.pi - np.arccos(2.8 / 4.0)
    assert SECTIONS["circular"].floor_arc == pytest.approx(4.0 * corner)
    assert SECTIONS["circular"].half_perimeter == pytest.approx(4.0 * corner + np.sqrt(16.0 - 2.8**2))
    assert SECTIONS["horseshoe"].half_perimeter == pytest.approx(2.0 * np.pi + 3.0 + 4.0)
    assert SECTIONS["box"].half_perimeter == pytest.approx(4.0 + 6.0 + 4.0)
    assert SECTIONS["box"].floor_arc == pytest.approx(10.0)


def ring(section: Section, n: int = 40_001) -> shapely.Polygon:
    half, corners = section.half_perimeter, section.parts[1:, 1]
    arcs = np.sort(np.concatenate([np.linspace(-half, half, n)[:-1], corners, -corners]))
    return shapely.Polygon(section.point(arcs)[0])


@pytest.mark.parametrize("section", SECTIONS.values(), ids=SECTIONS)
def test_section_is_closed_convex_and_as_long_as_its_arc(section: Section) -> None:
    polygon = ring(section)
    assert polygon.length == pytest.approx(2.0 * section.half_perimeter, abs=1e-6)
    assert polygon.area == pytest.approx(polygon.convex_hull.area, rel=1e-6)
    ends, _ = section.point(np.array([-section.half_perimeter, section.half_perimeter]))
    np.testing.assert_allclose(ends, [[0.0, section.floor]] * 2, atol=1e-12)
    point, normal = section.point(np.array([0.0, 2.0]))
    assert point[0, 0] == 0.0
    assert point[1, 0] > 0.0  # positive arc is to the right
    np.testing.assert_allclose(normal[0], [0.0, -1.0], atol=1e-15)


@pytest.mark.parametrize("section", SECTIONS.values(), ids=SECTIONS)
def test_offset_is_the_distance_to_the_outline(section: Section) -> None:
    polygon = ring(section)
    rng = np.random.default_rng(3)
    u, w = rng.uniform(-5.5, 5.5, (2, 500))
    points = shapely.points(u, w)
    expected = shapely.distance(polygon.exterior, points) * np.where(shapely.contains(polygon, points), 1, -1)
    np.testing.assert_allclose(section.project(u, w)[1], expected, atol=1e-6)


@pytest.mark.parametrize("section", SECTIONS.values(), ids=SECTIONS)
def test_projection_inverts_the_parametrisation(section: Section) -> None:
    rng = np.random.default_rng(4)
    arc = rng.uniform(-section.half_perimeter, section.half_perimeter, 2000)
    corners = np.append(section.parts[1:, 1], -section.parts[1:, 1])
    arc = arc[np.abs(arc[:, None] - corners).min(axis=1) > 0.3]
    offset = rng.uniform(-0.2, 0.2, arc.size)
    point, normal = section.point(arc)
    got_arc, got_offset, gradient = section.project(*(point + offset[:, None] * normal).T)
    np.testing.assert_allclose(got_arc, arc, atol=1e-9)
    np.testing.assert_allclose(got_offset, offset, atol=1e-9)
    np.testing.assert_allclose(gradient, normal, atol=1e-6)


@settings(max_examples=60, deadline=None)
@given(
    section=st.sampled_from(list(SECTIONS.values())),
    line=st.sampled_from(list(LINES.values())),
    share=st.floats(0.01, 0.99),
    along=st.floats(-0.999, 0.999),
    offset=st.floats(-0.3, 0.3),
)
def test_there_and_back(section: Section, line: CentreLine, share: float, along: float, offset: float) -> None:
    tunnel = Tunnel(line, section)
    arc = along * section.half_perimeter
    if np.abs(abs(arc) - section.parts[1:, 1]).min() < 0.4:
        return  # near corners the nearest point is another one
    s = line.start + share * (line.end - line.start)
    back = tunnel.unroll(tunnel.to_space(np.array([s]), np.array([arc]), np.array([offset])))
    assert back.chainage[0] == pytest.approx(s, abs=1e-8)
    assert back.arc[0] == pytest.approx(arc, abs=1e-8)
    assert back.offset[0] == pytest.approx(offset, abs=1e-8)


@pytest.mark.parametrize("line", LINES.values(), ids=LINES)
def test_normal_is_perpendicular_to_the_surface(line: CentreLine) -> None:
    tunnel = Tunnel(line, SECTIONS["leaning"])
    rng = np.random.default_rng(5)
    s, arc = rng.uniform(line.start + 1, line.end - 1, 300), rng.uniform(-8.5, 8.5, 300)
    normal = tunnel.unroll(tunnel.to_space(s, arc)).normal
    h = 1e-4
    for tangent in (
        tunnel.to_space(s + h, arc) - tunnel.to_space(s - h, arc),
        tunnel.to_space(s, arc + h) - tunnel.to_space(s, arc - h),
    ):
        np.testing.assert_allclose(np.sum(tangent * normal, axis=1) / (2 * h), 0.0, atol=2e-5)
    centre = line.position(s)
    assert np.all(np.sum((centre - tunnel.to_space(s, arc)) * normal, axis=1) > 0)


def test_level_circular_tunnel_on_an_arc_is_a_torus() -> None:
    bend, r = 300.0, 4.0
    tunnel = Tunnel(CentreLine.curve(100.0, bend, straight=0.0, azimuth=0.0), circular(r, 2.8))
    rng = np.random.default_rng(6)
    s, arc = rng.uniform(0.0, 100.0, 1000), rng.uniform(-9.3, 9.3, 1000)
    x, y, z = tunnel.to_space(s, arc).T
    to_centre = np.hypot(x - bend, y)
    np.testing.assert_allclose(np.hypot(to_centre - bend, z), r, atol=1e-10)
    np.testing.assert_allclose(bend * np.arctan2(y, bend - x), s, atol=1e-9)
    np.testing.assert_allclose(r * np.arctan2(bend - to_centre, z), arc, atol=1e-9)
    np.testing.assert_allclose(tunnel.area_factor(s, arc), to_centre / bend, atol=1e-6)
