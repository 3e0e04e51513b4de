"""Map of the axis: true scale, north upwards, coordinates where the grid lines are."""

from __future__ import annotations

import re

import numpy as np
import pytest
from shapely.geometry import LineString

from tunneldb.report.location import HEIGHT, MARGIN, WIDTH, draw_location, round_length


@pytest.mark.parametrize(
    "axis",
    [
        [[500000.0, 5100000.0], [500300.0, 5100400.0]],
        [[512345.0, 104321.0], [512345.0, 104448.0]],  # due north
        [[0.0, 0.0], [25000.0, -3000.0], [30000.0, -9000.0]],
    ],
)
def test_places_are_true_to_scale(axis: list[list[float]]) -> None:
    places = np.array(axis)
    drawn = draw_location(places, ("a", "b"))
    line = np.array([list(map(float, at.split())) for at in drawn.line[1:].split("L")])
    number, unit = drawn.bar_label.split()
    scale = drawn.bar / (float(number) * {"m": 1.0, "km": 1000.0}[unit])
    assert LineString(line).length == pytest.approx(scale * LineString(places).length, abs=0.3)
    assert (line >= MARGIN - 0.1).all()
    assert (line <= np.array([WIDTH, HEIGHT]) - MARGIN + 0.1).all()
    for x, label in drawn.eastings:
        assert float(label) == pytest.approx(places[0, 0] + (x - line[0, 0]) / scale, abs=0.1 / scale)
    for y, label in drawn.northings:
        assert float(label) == pytest.approx(places[0, 1] - (y - line[0, 1]) / scale, abs=0.1 / scale)
    assert 2 <= len(drawn.eastings) <= 10
    assert drawn.bar < WIDTH / 3
    assert all(re.fullmatch(r"-?\d+", label) for _, label in drawn.eastings + drawn.northings)


def test_lengths_are_round() -> None:
    assert [round_length(most) for most in (0.3, 1.0, 4.9, 5.0, 37.0, 99.0, 2600.0)] == [1, 1, 2, 5, 20, 50, 2000]
