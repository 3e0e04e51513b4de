"""Classes of points of registered sonar scans, against a canal made independently."""

from __future__ import annotations

import numpy as np
import pytest
from support.canal_scene import DEPTH, WIDTH, Canal

from tunneldb.arrays import Float
from tunneldb.classification.underwater import WaterClass, classify, spacing_of_rays


def surfaces(canal: Canal, points: Float) -> tuple[Float, Float]:
    """Distance of points, canal frame, from the nearer wall and from the bed, m."""
    wall = np.full(len(points), np.inf)
    for side, batter, rough in zip((-1.0, 1.0), canal.batter, canal.rough, strict=True):
        at = WIDTH / 2.0 + batter * points[:, 2] + rough.at(points[:, 0], points[:, 2])
        wall = np.where(np.abs(side * points[:, 1] - at) < np.abs(wall), side * points[:, 1] - at, wall)
    return wall, points[:, 2] + DEPTH - canal.bed.at(points[:, 0], points[:, 1])


def test_points_get_the_class_of_what_they_were_measured_on() -> None:
    canal = Canal(5)
    scan = canal.sonar(0.0)
    points = (scan.to_tunnel(scan.points) - canal.to_tunnel(np.zeros((1, 3)))) @ canal.turn
    points = points[np.abs(points[:, 0]) < 12.0]
    place = (scan.translation - canal.to_tunnel(np.zeros((1, 3)))) @ canal.turn
    found = classify(points, spacing_of_rays(np.linalg.norm(points - place, axis=1)))
    wall, bed = surfaces(canal, points)
    wet = points[:, 2] < -0.2
    on_bed = wet & (np.abs(bed) < 0.05) & (wall < -0.3)
    on_wall = wet & (np.abs(wall) < 0.05) & (bed > 0.3)
    assert (found[on_bed] == WaterClass.BED).mean() > 0.99
    assert (found[on_wall] == WaterClass.LINING).mean() > 0.99
    behind = (wall > 0.4) | (bed < -0.4) | (points[:, 2] > 0.3)
    assert behind.sum() > 500
    assert (found[behind] == WaterClass.FALSE).mean() > 0.98
    adrift = wet & (wall < -1.0) & (bed > 0.6)  # in the water, where there are no ladders
    assert (found[adrift] == WaterClass.FALSE).mean() > 0.9


def test_nothing_is_classed_of_nothing() -> None:
    assert len(classify(np.zeros((0, 3)), np.zeros(0))) == 0


@pytest.mark.parametrize("height", [-1.0, 2.0])
def test_a_point_by_itself_is_a_false_echo(height: float) -> None:
    assert classify(np.array([[0.0, 0.0, height]]), np.ones(1)).tolist() == [WaterClass.FALSE]
