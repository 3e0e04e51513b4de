"""Synthetic canal tunnels against formulas of their own."""

from __future__ import annotations

import json
from pathlib import Path

import laspy
import numpy as np
import pytest
from click.testing import CliRunner

from tunneldb.cli.main import main
from tunneldb.errors import UserError
from tunneldb.simulate.canal import FALSE, CanalParameters, CanalScene, simulate, write
from tunneldb.simulate.canal.section import BED, LADDER, WALL

pytestmark = pytest.mark.slow

COARSE = {"length": 24.0, "laser_step": 1.0, "laser_ladder_step": 0.1, "sonar_step": 3.0, "sonar_beams": 64}


@pytest.fixture(scope="module")
def smooth() -> CanalScene:
    """A canal with plane walls and bed, so that each place on it follows from the parameters."""
    return simulate(
        CanalParameters(
            seed=4, **COARSE, sonar_stations=1, roughness=0.0, joint_depth=0.0, bed_relief=0.0, bed_rise=0.0, batter=2.0,
            batter_below=3.0, ladders=1, laser_mirror_share=0.0, sonar_z_down=True,
        )
    )  # fmt: skip


def places(scene: CanalScene, k: int = 0) -> np.ndarray:
    """Along, across and over the water, m, of a sonar scan's points by its true pose."""
    scan = scene.sonar[k]
    tunnel = scan.scale * scan.points @ scan.rotation.T + scan.translation
    return scene.line.stationed(scene.line.to_local(tunnel))


def test_echoes_lie_on_the_planes_that_the_parameters_describe(smooth: CanalScene) -> None:
    scan, own = smooth.sonar[0], places(smooth)
    reach = np.linalg.norm(scan.points, axis=1)
    wall, bed = (scan.kind == WALL) & (reach < 6.0), (scan.kind == BED) & (reach < 6.0)
    assert wall.sum() > 300
    assert bed.sum() > 100
    off = np.abs(own[wall, 1]) - (3.3 + np.tan(np.radians(3.0)) * own[wall, 2])
    assert abs(np.median(off)) < 0.004
    assert np.percentile(np.abs(off), 95) < 0.045
    assert abs(np.median(own[bed, 2]) + 2.5) < 0.004
    assert (scan.kind == FALSE).sum() / len(scan.kind) == pytest.approx(0.03, abs=0.012)


def test_laser_points_lie_on_walls_and_vault(smooth: CanalScene) -> None:
    own = smooth.line.stationed(smooth.line.to_local(smooth.laser))
    assert own[:, 2].min() > -0.02
    low = (own[:, 2] > 0.05) & (own[:, 2] < 1.4) & (np.abs(own[:, 1]) > 3.2)
    off = np.abs(own[low, 1]) - (3.3 + np.tan(np.radians(2.0)) * own[low, 2])
    assert np.percentile(np.abs(off), 90) < 0.006
    span = 3.3 + 1.5 * np.tan(np.radians(2.0))
    middle = 1.5 - np.sqrt(4.0**2 - span**2)
    high = own[:, 2] > 1.7
    assert np.percentile(np.abs(np.hypot(own[high, 1], own[high, 2] - middle) - 4.0), 95) < 0.006


def test_bars_of_the_ladder_are_met(smooth: CanalScene) -> None:
    ladder, scan = smooth.ladders[0], smooth.sonar[0]
    tunnel = scan.scale * scan.points @ scan.rotation.T + scan.translation
    own = (tunnel[scan.kind == LADDER] - ladder.origin) @ ladder.axes.T
    assert len(own) > 10
    stile = np.abs(np.abs(own[:, 0]) - 0.16)
    rung = np.abs(own[:, 1:2] - ladder.heights).min(axis=1)
    assert np.percentile(np.minimum(stile, rung), 90) < 0.1  # as far as a beam is wide
    assert np.allclose(ladder.axes @ ladder.axes.T, np.eye(3))
    assert np.diff(ladder.heights) == pytest.approx(0.279, abs=0.03)


def test_poses_are_rotations_also_with_z_down(smooth: CanalScene) -> None:
    scan = smooth.sonar[0]
    assert np.linalg.det(scan.rotation) == pytest.approx(1.0)
    assert scan.rotation[2, 2] < -0.9
    assert 0.98 < scan.scale < 1.02


def test_the_volume_is_that_of_a_prism(smooth: CanalScene) -> None:
    assert smooth.bed_volume(5.0, 15.0, 262.0, 3.0) == pytest.approx(10.0 * 6.0 * 0.5, rel=1e-6)
    assert smooth.bed_height(np.array([7.0]), np.array([0.5]))[0] == pytest.approx(262.5)


def test_a_seed_makes_the_same_scene_and_another_another() -> None:
    small = {**COARSE, "sonar_stations": 1, "laser_stations": 1, "ladders": 1, "radius": -300.0, "towpath": "left", "piers": 1}
    one, again = (simulate(CanalParameters(seed=9, **small)) for _ in range(2))
    assert np.array_equal(one.laser, again.laser)
    assert np.array_equal(one.sonar[0].points, again.sonar[0].points)
    assert not np.array_equal(one.sonar[0].rotation, simulate(CanalParameters(seed=10, **small)).sonar[0].rotation)


def test_points_of_a_bend_lie_on_its_surfaces() -> None:
    scene = simulate(CanalParameters(seed=2, **COARSE, sonar_stations=1, radius=300.0, towpath="right", boat=True, objects=3))
    scan = scene.sonar[0]
    true = (scan.kind >= BED) & (scan.kind != LADDER) & (np.linalg.norm(scan.points, axis=1) < 6.0) & (scan.kind < 8)
    off = np.abs(scene.distance(scan.scale * scan.points[true] @ scan.rotation.T + scan.translation))
    assert np.percentile(off, 95) < 0.08
    assert np.median(off) < 0.02


def test_files_hold_what_was_scanned(smooth: CanalScene, tmp_path: Path) -> None:
    files = write(smooth, tmp_path)
    with laspy.open(files.laser) as laz:
        assert laz.header.point_count == len(smooth.laser)
        assert laz.header.parse_crs().to_epsg() == 25832
        points = laz.read()
    assert np.abs(points.xyz - smooth.laser).max() < 0.001
    assert np.abs(np.loadtxt(files.sonar[0])[:, :3] - smooth.sonar[0].points).max() < 1e-4
    rows = files.ladders.read_text("utf-8").splitlines()
    assert rows[0] == "ladder,rung,height,stile_gap,diameter"
    assert len(rows) == 1 + 13
    truth = json.loads(files.truth.read_text("utf-8"))
    assert np.allclose(truth["sonar"][0]["rotation"], smooth.sonar[0].rotation)
    assert truth["water_level"] == 265.0
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(
        p.name for p in (files.laser, files.stations, files.axis, files.ladders, files.truth, *files.sonar)
    )


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"width": 1.0}, "width is 1: give 3 to 20 m"),
        ({"towpath": "up"}, "towpath is up: give left, right or none"),
        ({"radius": 5.0}, "radius is 5: give 0 or at least 30 m, either way"),
        ({"depth": 1.2}, "sonar-depth is up to 1.4 m: the canal is 1.2 m deep"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(given: dict[str, object], said: str) -> None:
    with pytest.raises(UserError, match=said):
        CanalParameters(**given)  # type: ignore[arg-type]


def test_the_verb_refuses_before_it_writes(tmp_path: Path) -> None:
    result = CliRunner().invoke(main, ["simulate-canal", str(tmp_path / "out"), "--length", "1"])
    assert result.exit_code == 2
    assert "length is 1: give 6 to 600 m" in result.output
    assert not (tmp_path / "out").exists()
