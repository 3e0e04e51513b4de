"""Sides of one beam are told from what only stands beside it."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from scipy.spatial.transform import Rotation

from tunneldb.arrays import Float
from tunneldb.simulate.structure.members import Section, box_section, i_section, l_section, u_section
from tunneldb.structures.joining import Extent
from tunneldb.structures.models import unroll, with_directions
from tunneldb.structures.profiles import MAX_FLANGE_THICKNESS, MAX_SECTION_DEPTH, SLENDER, box_of, group, middle_line

NOISE = 0.001
SECTIONS = {
    "I": i_section(0.3, 0.2, 0.009, 0.014),
    "U": u_section(0.2, 0.075, 0.01),
    "L": l_section(0.1, 0.1, 0.01),
    "box": box_section(0.25, 0.15),
}


def rectangle(corners: Float, outside: Float) -> list[Extent]:
    """A surface of one face with these corners (4, 3), whose normal points as ``outside`` does."""
    normal = np.cross(corners[1] - corners[0], corners[3] - corners[0])
    normal *= np.sign(normal @ outside) / np.linalg.norm(normal)
    row = np.zeros((1, 11))
    row[0, 0:3], row[0, 3:6], row[0, 7] = corners.mean(axis=0), normal, 1.0
    model = with_directions(row, corners[:1])[0]
    u, v, _ = unroll(model, corners)
    outline = shapely.MultiPolygon([shapely.Polygon(np.column_stack([u, v]))])
    return [Extent(model, outline, 0.005, (0,), 1000.0)]


def beam(section: Section, length: float, turn: Rotation, start: Float, least: float = 0.02) -> list[list[Extent]]:
    """Its sides that are wide enough to be found; the section is at right angles to the third axis of ``turn``."""
    corners, _ = section
    found = []
    for one, other in zip(corners, [*corners[1:], corners[0]], strict=True):
        if np.hypot(other[0] - one[0], other[1] - one[1]) >= least:
            flat = np.array([(*one, 0.0), (*other, 0.0), (*other, length), (*one, length)])
            outside = np.array([other[1] - one[1], one[0] - other[0], 0.0])
            found.append(rectangle(start + turn.apply(flat), turn.apply(outside)))
    return found


def members(surfaces: list[list[Extent]]) -> list[int]:
    return group(surfaces, NOISE).tolist()


@pytest.mark.parametrize("name", SECTIONS)
@pytest.mark.parametrize("seed", range(5))
def test_sides_of_a_beam_are_one_member_however_it_lies(name: str, seed: int) -> None:
    turn = Rotation.random(random_state=seed)
    start = np.random.default_rng(seed).uniform(-5.0, 5.0, 3)
    sides = beam(SECTIONS[name], 3.0, turn, start)
    assert len(sides) >= 4
    assert members(sides) == [0] * len(sides)
    corners = np.array(SECTIONS[name][0])
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    ends = start + turn.apply(np.array([(*middle, 0.0), (*middle, 3.0)]))
    found = middle_line([box_of(side) for side in sides])
    if (found[1] - found[0]) @ (ends[1] - ends[0]) < 0.0:
        ends = ends[::-1]
    np.testing.assert_allclose(found, ends, atol=1e-6 if name != "L" else 0.05)  # about an L the least rectangle is turned


def test_a_beam_seen_from_one_side_alone_is_one_member() -> None:
    sides = beam(SECTIONS["I"], 3.0, Rotation.identity(), np.zeros(3))
    seen = [side for side in sides if side[0].model[3] > 0.5 or abs(side[0].model[4]) > 0.5]
    assert 2 <= len(seen) < len(sides)
    assert set(members(seen)) == {0}


def test_broken_off_pieces_of_a_side_are_of_it() -> None:
    whole = beam(SECTIONS["U"], 4.0, Rotation.identity(), np.zeros(3))
    piece = beam(SECTIONS["U"], 0.7, Rotation.identity(), np.array([0.0, 0.0, 3.0]))
    assert set(members([whole[0], piece[1], piece[2]])) == {0}


def test_beams_that_cross_are_two() -> None:
    upright = beam(SECTIONS["I"], 3.0, Rotation.identity(), np.zeros(3))
    level = beam(SECTIONS["I"], 3.0, Rotation.from_euler("y", 90, degrees=True), np.array([0.11, 0.0, 1.5]))
    assert members(upright + level) == [0] * len(upright) + [1] * len(level)


def test_beams_side_by_side_are_two() -> None:
    apart = np.array([0.15 + 2.0 * MAX_FLANGE_THICKNESS, 0.0, 0.0])
    one, other = (beam(SECTIONS["box"], 3.0, Rotation.identity(), start) for start in (np.zeros(3), apart))
    assert members(one + other) == [0] * 4 + [1] * 4


def test_parts_of_one_plane_are_no_two_sides() -> None:
    low = rectangle(np.array([(0, 0, 0), (2, 0, 0), (2, 0, 0.2), (0, 0, 0.2)], float), np.array([0, -1.0, 0]))
    high = rectangle(np.array([(0, 0, 0.2), (2, 0, 0.2), (2, 0, 0.4), (0, 0, 0.4)], float), np.array([0, -1.0, 0]))
    assert members([low, high]) == [0, 1]


@pytest.mark.parametrize(("length", "depth"), [(10.0, 1.5 * MAX_SECTION_DEPTH), (0.9 * SLENDER * 0.5, 0.5)])
def test_walls_and_stubs_are_no_beams(length: float, depth: float) -> None:
    """A corridor is too deep, a pedestal too short."""
    sides = beam(box_section(depth, depth), length, Rotation.identity(), np.zeros(3))
    assert members(sides) == [0, 1, 2, 3]


def test_a_flight_of_stairs_is_no_beam() -> None:
    surfaces = []
    across = np.array([1.2, 0.0, 0.0])
    for step in range(12):
        foot = np.array([0.0, 0.28 * step, 0.18 * step])
        edge = foot + np.array([0.0, 0.0, 0.18])
        back = edge + np.array([0.0, 0.28, 0.0])
        for low, high, outside in ((foot, edge, np.array([0.0, -1.0, 0.0])), (edge, back, np.array([0.0, 0.0, 1.0]))):
            surfaces.append(rectangle(np.array([low, low + across, high + across, high]), outside))
    assert np.bincount(members(surfaces)).max() == 2, "a step"


def test_pipes_are_no_sides() -> None:
    row = np.zeros((1, 11))
    row[0, 3:6], row[0, 6], row[0, 7] = (0.0, 0.0, 1.0), 0.05, 1.0
    outline = shapely.MultiPolygon([shapely.box(0, -0.1, 3, 0.1)])
    pipe = Extent(with_directions(row, np.array([[1.0, 0, 0]]))[0], outline, 0.005, (0,), 9.0)
    side = rectangle(np.array([(0.05, -0.1, 0), (0.05, 0.1, 0), (0.05, 0.1, 3), (0.05, -0.1, 3)]), np.array([-1.0, 0, 0]))
    assert members([[pipe], side]) == [0, 1]


def test_nothing_is_no_member() -> None:
    assert members([]) == []
