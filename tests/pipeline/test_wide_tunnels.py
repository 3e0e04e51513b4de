"""Tunnels much wider than high: the axis comes to rest in the middle, wherever it was given and whatever stands in them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import psycopg
import pytest
from support.loaded_survey import LENGTH, ORIGIN, SURVEY, add_survey, load, write

from tunneldb.pipeline.geometry import axis
from tunneldb.pointcloud.selection import FilterSettings
from tunneldb.stages.parameters import PARAMETERS
from tunneldb.store.survey import get_survey

WIDTH, HEIGHT = 14.0, 5.0
TRAIN = 13.0, 33.0  # from and to, m from the axis' beginning; it fills a third of the tunnel


def outline(rise: float, count: int) -> np.ndarray:
    """Places evenly on a section of vertical walls and a flat arch (rise, m), as seen from its middle: (n, 2)."""
    x = np.linspace(-WIDTH / 2, WIDTH / 2, 2000)
    radius = (WIDTH**2 / 4 + rise**2) / (2 * rise) if rise else np.inf
    vault = HEIGHT / 2 - (radius - np.sqrt(radius**2 - x**2) if rise else 0 * x)
    corners = np.concatenate(
        [[[-WIDTH / 2, -HEIGHT / 2]], np.column_stack([x, vault]), [[WIDTH / 2, -HEIGHT / 2], [-WIDTH / 2, -HEIGHT / 2]]]
    )
    way = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
    at = np.random.default_rng(0).uniform(0, way[-1], count)
    return np.column_stack([np.interp(at, way, corners[:, k]) for k in (0, 1)])


def scene(rise: float, off: float, train: bool) -> np.ndarray:
    """Points of a tunnel whose middle lies ``off`` to the right of the axis given, seen from its middle."""
    rng = np.random.default_rng(1)
    across = outline(rise, int(40 * 2 * (WIDTH + HEIGHT) * LENGTH))
    along = rng.uniform(0, LENGTH, len(across))
    if train:
        # its near side at 2 m hides what lies behind, its roof is not seen
        beside = (along > TRAIN[0]) & (along < TRAIN[1]) & (across[:, 0] > 2.0)
        height = across[:, 1] * 2.0 / np.maximum(across[:, 0], 1e-9)
        hidden = beside & (height < HEIGHT / 2 - 1.0) & (height > -HEIGHT / 2)
        across[hidden] = np.column_stack([np.full(hidden.sum(), 2.0), height[hidden]])
    across += rng.normal(0, 0.003, across.shape)
    return np.round(ORIGIN + np.column_stack([along, -(across[:, 0] + off), across[:, 1]]), 3)


@pytest.mark.parametrize("rise", [0.0, 1.0])
@pytest.mark.parametrize("train", [False, True])
@pytest.mark.parametrize("off", [0.5, -1.5])
def test_the_axis_rests_in_the_middle(conn: psycopg.Connection, tmp_path: Path, rise: float, train: bool, off: float) -> None:
    add_survey(conn)
    load(conn, [write(tmp_path / "a.las", scene(rise, off, train))], FilterSettings(density=25.0))
    survey = get_survey(conn, SURVEY)
    for km in (0, 1):
        axis(
            conn, survey, km, {name: p.default for name, p in PARAMETERS.items() if name.startswith("axis.")}, lambda done: None
        )
    found = np.array(conn.execute("SELECT n, ST_Y(geom), source = 'measured' FROM tunnel.axis_vertex ORDER BY n").fetchall())
    assert np.abs(ORIGIN[1] - found[:, 1].astype(float) - off).max() < 0.05
    assert found[:, 2].any()
