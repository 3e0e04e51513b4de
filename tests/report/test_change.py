"""The report's chapter on what changed: series over surveys are drawn as they are stored."""

from __future__ import annotations

import datetime as dt
import re

import numpy as np
import psycopg
import pytest
from support.example_change import EARLIER, OVALER, add_earlier
from support.example_rings import COUNT, LENGTH, OVALITY

from tunneldb.report.change import read_change
from tunneldb.report.change_series import wet_curve
from tunneldb.report.rings import HEIGHT, WIDTH
from tunneldb.store.survey import get_survey


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def points(path: str) -> np.ndarray:
    """Vertices (n, 2) of a path."""
    return np.array(re.findall(r"(-?[\d.]+) (-?[\d.]+)", path), dtype=float)


def test_ovality_is_drawn_before_and_after(conn: psycopg.Connection, example: str) -> None:
    add_earlier(conn, example)
    chapter = read_change(conn, get_survey(conn, example), 12300.0, 12500.0)
    assert chapter is not None
    assert chapter.old.name == EARLIER
    assert chapter.ovality is not None
    lines = {kind: points(path) for kind, path in chapter.ovality.paths}
    number = np.arange(1, COUNT + 1)
    top = 1.05 * 1e3 * COUNT * OVALITY * OVALER  # room of a twentieth above the greatest
    for kind, factor in (("before", OVALER), ("after", 1.0)):
        x, y = lines[kind].T
        np.testing.assert_allclose(x, (number - 1) * LENGTH * WIDTH / ((COUNT - 1) * LENGTH), atol=0.06)
        np.testing.assert_allclose((HEIGHT - y) * top / HEIGHT, 1e3 * number * OVALITY * factor, atol=0.06 * top / HEIGHT)


def test_wet_area_is_drawn_by_date() -> None:
    series = [{"date": dt.date(2022, 1, 1), "area": 2.0}, {"date": dt.date(2022, 7, 2), "area": 4.0}]
    assert wet_curve(series[:1]) is None
    curve = wet_curve([*series, {"date": dt.date(2022, 12, 31), "area": 3.0}])
    assert curve is not None
    (kind, path) = curve.paths[0]
    assert kind == "wet"
    heights = HEIGHT * (1.0 - np.array([2.0, 4.0, 3.0]) / 4.2)
    np.testing.assert_allclose(points(path), np.column_stack([[0.0, WIDTH / 2.0, WIDTH], heights]), atol=0.06)
    assert curve.places == [(0.0, "2022-01-01"), (WIDTH / 2.0, "2022-07-02"), (WIDTH, "2022-12-31")]
