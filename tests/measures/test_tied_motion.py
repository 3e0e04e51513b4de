"""Motion of sections that changed their shape, against what was put in; and which regions are no chance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tunneldb.measures.change.compute.change import Scatter, change_regions
from tunneldb.measures.change.compute.rigid_motion import SectionCells, motion_columns, rigid_motion
from tunneldb.measures.change.compute.tied_motion import tied_motions

RADIUS, NOISE, COUNT = 3.0, 0.0008, 24
FRAME = np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
EVEN = Scatter(np.array([1.0]), np.array([1.0]), 1.0)


def sections(
    change: dict[int, float], jump: float = 0.0, at: float = 12.0, box: bool = False, middle: float = 0.0, tall: float = 1.0
) -> list[SectionCells]:
    """Sections of a tube whose sides came in, or of a box whose right wall did; registration wanders, and jumps.

    The tube's middle lies so far above the axis, m, and it is so many times as tall as wide.
    """
    rng = np.random.default_rng(7)
    found = []
    for n in range(COUNT):
        if box:
            side = np.repeat([-1.0, 0.0, 1.0], [40, 50, 40])
            right = np.concatenate([np.full(40, -2.5), np.linspace(-2.5, 2.5, 50), np.full(40, 2.5)])
            up = np.concatenate([np.linspace(-2.0, 2.0, 40), np.full(50, 2.0), np.linspace(2.0, -2.0, 40)])
            normal = np.column_stack([-side, np.zeros(130), -1.0 * (side == 0.0)])
            shape = (side > 0.0) * 1.0
        else:
            angle = np.radians(np.linspace(-130.0, 130.0, 130))
            right, up = RADIUS * np.sin(angle), middle + tall * RADIUS * np.cos(angle)
            normal = np.column_stack([-np.sin(angle), np.zeros(130), -np.cos(angle) / tall])
            normal /= np.linalg.norm(normal, axis=1, keepdims=True)
            shape = -np.cos(2.0 * angle)
        column = np.repeat(np.arange(15), 130)
        points = np.column_stack([np.tile(right, 15), (column - 7) * 0.1, np.tile(up, 15)])
        columns = motion_columns(points, np.tile(normal, (15, 1)), FRAME)
        shift = 0.003 * np.sin((n + column / 15.0) / 5.0) + jump * (n + column / 15.0 >= at)
        difference = columns[:, 0] * shift + columns[:, 1] * 0.01 + change.get(n, 0.0) * np.tile(shape, 15)
        group = np.floor(np.tile(np.arange(130) / 10.0, 15)).astype(np.int64)
        difference = difference + rng.normal(0.0, NOISE, len(column))
        found.append(SectionCells(difference, np.full(len(column), NOISE**2), columns.astype(np.float32), group, column))
    return found


def true_shift(n: int) -> float:
    return float(0.003 * np.sin((n + 0.5) / 5.0))


@pytest.mark.parametrize("box", [True, False])
def test_of_a_section_that_changed_its_shape_neighbours_tell_which_side_moved(box: bool) -> None:
    given = sections(dict.fromkeys((8, 9, 10, 11), 0.004), box=box)
    tied = tied_motions(given, np.arange(COUNT), [rigid_motion(one) for one in given])
    for n in (8, 9, 10, 11):
        assert tied[n].values[0] == pytest.approx(true_shift(n), abs=max(3e-4, 3.0 * tied[n].errors[0]))
        assert tied[n].values[1] == pytest.approx(0.01, abs=max(4e-4, 3.0 * tied[n].errors[1]))
        assert tied[n].errors[:2].max() < 5e-4


def test_what_a_roll_and_a_shift_do_together_is_known_where_neither_is_by_itself() -> None:
    """Of a tube about a middle above the axis a roll moves the lining much as a shift does; its sides came in by 1 mm."""
    given = sections({10: 0.001}, middle=2.0, tall=1.02)
    own = [rigid_motion(one) for one in given]
    assert np.median([one.errors[0] for one in own]) > 3.0 * np.median([one.errors[1] for one in own])
    tied = tied_motions(given, np.arange(COUNT), own)[10]
    side = np.abs(given[10].columns[:, 0]) > 0.9
    assert np.median((given[10].difference - tied.removed)[side]) == pytest.approx(0.001, abs=2e-4)
    assert tied.removed_error[side].max() < 2e-4


def test_a_section_that_moved_as_a_whole_and_one_in_which_a_station_ends_keep_their_own() -> None:
    given = sections({}, jump=0.004, at=12.4)
    own = [rigid_motion(one) for one in given]
    tied = tied_motions(given, np.arange(COUNT), own)
    assert [n for n in range(COUNT) if tied[n] is not own[n]] == [12]
    left = given[12].difference - tied[12].removed
    assert np.sqrt(np.mean(left**2)) < 1.1 * NOISE
    assert np.sqrt(np.mean((given[12].difference - own[12].removed) ** 2)) > 1.2 * NOISE
    settled = sections({})
    for n in (9, 10):
        settled[n] = replace(settled[n], difference=settled[n].difference + 0.004 * settled[n].columns[:, 1])
    own = [rigid_motion(one) for one in settled]
    assert tied_motions(settled, np.arange(COUNT), own) == own


def test_a_line_of_cells_is_no_region_and_a_square_is() -> None:
    rng = np.random.default_rng(5)
    difference = rng.normal(0.0, 0.001, (150, 200)).astype(np.float32)
    difference[40, 30:60] -= 0.006  # a groove that one epoch hit and the other did not
    difference[90:100, 100:110] += 0.003
    variance, error = np.full_like(difference, 1e-6), np.zeros_like(difference)
    (region,) = change_regions(difference, variance, error, EVEN, np.stack([error, error]))
    assert region.mean == pytest.approx(0.003, abs=6e-4)
    assert 90 <= region.rows.mean() < 100


def test_chance_alone_makes_no_region_beside_a_wall_that_moved() -> None:
    rng = np.random.default_rng(6)
    for _ in range(5):
        difference = rng.normal(0.0, 0.001, (150, 400)).astype(np.float32)
        difference[:, :160] += 0.005
        variance, error = np.full_like(difference, 1e-6), np.zeros_like(difference)
        regions = change_regions(difference, variance, error, EVEN, np.stack([error, error]))
        assert len(regions) == 1
