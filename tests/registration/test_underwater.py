"""Sonar scans below the water, registered to the laser's points above it, against a canal made independently."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.canal_scene import LEVEL, ORIGIN, WIDTH, Canal, Sonar

from tunneldb.arrays import Float
from tunneldb.errors import UserError
from tunneldb.registration.underwater import Registration, SonarCloud, SonarPose, register
from tunneldb.registration.underwater.chain import Reliefs, agreement
from tunneldb.registration.underwater.laser_ladders import find_laser_ladders
from tunneldb.registration.underwater.observations import Pose, find_patches, pose_derivatives
from tunneldb.registration.underwater.single import _Fitted, _one_stile_beside, prepare
from tunneldb.registration.underwater.walls import find_walls

pytestmark = pytest.mark.slow


@dataclass(frozen=True)
class Scene:
    canal: Canal
    laser: Float
    scans: tuple[Sonar, ...]

    def clouds(self, up: int = 1) -> list[SonarCloud]:
        return [SonarCloud(Path(f"s{k}.xyz"), scan.points, up) for k, scan in enumerate(self.scans)]


@pytest.fixture(scope="module")
def scene() -> Scene:
    canal = Canal(31)
    laser = canal.laser()
    return Scene(canal, laser, (canal.sonar(-3.0), canal.sonar(1.0)))


@pytest.fixture(scope="module")
def found(scene: Scene) -> Registration:
    return register(scene.laser, scene.clouds(), scene.canal.measured(), LEVEL)


def check_points(scan: Sonar) -> Float:
    """Points of the scan within 10 m of the sonar, file's axes, without those of false echoes."""
    reach = np.linalg.norm(scan.points, axis=1)
    return scan.points[(reach > 1.0) & (reach < 10.0)][::50]


def turn_between(pose: SonarPose, scan: Sonar) -> float:
    return float(np.degrees(Rotation.from_matrix(pose.rotation @ scan.rotation.T).magnitude()))


def test_points_of_all_scans_come_to_where_they_were_measured(scene: Scene, found: Registration) -> None:
    for pose, scan in zip(found.scans, scene.scans, strict=True):
        points = check_points(scan)
        mine = pose.scale * points @ pose.rotation.T + pose.translation
        off = np.linalg.norm(mine - scan.to_tunnel(points), axis=1)
        assert np.median(off) < 0.015
        assert np.percentile(off, 95) < 0.035
        assert turn_between(pose, scan) < 0.3
        assert pose.state == "determined", pose.undetermined
        assert {one.kind for one in pose.residuals} == {"wall", "ladder", "waterline", "scan"}
    scale = np.array([pose.scale / scan.scale - 1.0 for pose, scan in zip(found.scans, scene.scans, strict=True)])
    assert np.sqrt(np.mean(scale**2)) < 0.001
    assert np.abs(scale).max() < 0.002


def test_stated_deviations_are_of_the_size_of_the_errors(scene: Scene, found: Registration) -> None:
    chi = []
    for pose, scan in zip(found.scans, scene.scans, strict=True):
        turn = Rotation.from_matrix(scan.rotation @ pose.rotation.T).as_rotvec()
        error = np.concatenate([turn, scan.translation - pose.translation, [scan.scale - pose.scale]])
        chi.append(float(error @ np.linalg.solve(pose.covariance, error)) / len(error))
    assert 0.05 < np.mean(chi) < 9.0


def test_ladders_stand_where_the_laser_saw_them(scene: Scene, found: Registration) -> None:
    assert {one.name for one in found.ladders} == {"L0", "L1"}
    for one in found.ladders:
        true = scene.canal.ladders[int(one.name[1:])]
        assert np.linalg.norm(one.origin - scene.canal.to_tunnel(true.origin)) < 0.006
        assert one.up @ (scene.canal.turn @ true.axes[1]) > np.cos(np.radians(0.15))
        assert one.scans == ("s0.xyz", "s1.xyz")
        heights = true.origin[2] + true.height * true.axes[1, 2]
        assert set(one.rungs) <= {k + 1 for k in np.flatnonzero(heights > 0.0)}


def test_walls_at_the_water_are_those_of_the_canal(scene: Scene) -> None:
    walls = find_walls((scene.laser - ORIGIN)[::3])
    assert walls.widths == pytest.approx((WIDTH, WIDTH), abs=0.03)
    measured = sorted(float(np.median(walls.batter[walls.side == side])) for side in (0, 1))
    assert measured == pytest.approx(sorted(scene.canal.batter), abs=0.02)


def test_a_scan_whose_axes_point_down_comes_to_the_same_place(scene: Scene) -> None:
    flip = np.diag([1.0, -1.0, -1.0])
    scan = scene.scans[0]
    turned = [SonarCloud(Path("s.xyz"), scan.points @ flip, -1)]
    ladders = scene.canal.measured()
    down = register(scene.laser, turned, ladders, LEVEL).scans[0]
    up = register(scene.laser, scene.clouds()[:1], ladders, LEVEL).scans[0]
    assert np.allclose(down.rotation @ flip, up.rotation, atol=1e-4)
    assert np.allclose(down.translation, up.translation, atol=1e-3)


def test_a_scan_said_to_point_the_other_way_is_refused(scene: Scene) -> None:
    ladders = scene.canal.measured()
    with pytest.raises(UserError, match="--up"):
        register(scene.laser, scene.clouds(-1)[:1], ladders, LEVEL)


def test_without_a_ladder_nothing_is_claimed_along_the_tunnel(scene: Scene) -> None:
    none = replace(scene.canal.ladders[0].measured(), name="elsewhere")
    bare = scene.laser[~near_ladders(scene)]
    result = register(bare, scene.clouds()[:1], [none], LEVEL)
    assert result.ladders == ()
    assert result.scans[0].state == "undetermined"
    assert "along the tunnel" in result.scans[0].undetermined
    assert result.notes == (
        "ladder elsewhere is not in the laser scan, or has other gaps",
        "s0.xyz has no pose: several poses fit; choose one by --start",
    )


def test_a_scan_that_shows_no_ladder_is_placed_by_the_bed_beside_others() -> None:
    canal = Canal(33, waves=(0.1, 0.7))
    scans = [canal.sonar(x) for x in (1.0, 5.5, 8.0, 10.5)]
    far = scans[3]
    place = far.to_tunnel(far.points)
    shows = np.any([canal.near(ladder, place, 0.4, 0.25) for ladder in canal.ladders], axis=0)
    clouds = [SonarCloud(Path(f"s{k}.xyz"), scan.points, 1) for k, scan in enumerate(scans[:3])]
    clouds.append(SonarCloud(Path("s3.xyz"), far.points[~shows], 1))
    result = register(canal.laser(), clouds, canal.measured(), LEVEL)
    pose = result.scans[3]
    assert all("s3.xyz" not in ladder.scans for ladder in result.ladders)
    assert pose.state == "determined", result.notes
    mine = pose.scale * check_points(far) @ pose.rotation.T + pose.translation
    assert np.percentile(np.linalg.norm(mine - far.to_tunnel(check_points(far)), axis=1), 95) < 0.05


def near_ladders(scene: Scene) -> np.ndarray:
    return np.any([scene.canal.near(ladder, scene.laser, 0.25, 0.1) for ladder in scene.canal.ladders], axis=0)


def test_no_wall_at_the_water_is_said_so(scene: Scene) -> None:
    with pytest.raises(UserError, match="water-level"):
        register(scene.laser, scene.clouds(), [scene.canal.ladders[0].measured()], LEVEL + 5.0)


def test_a_ladder_with_other_gaps_is_fitted_to_its_own(scene: Scene) -> None:
    """Two ladders that differ only in their gaps are each found at their own rungs."""
    local = scene.laser - ORIGIN
    walls = find_walls(local[::3])
    ladders = scene.canal.measured()
    for order in (ladders, ladders[::-1]):
        fits = {fit.placed.ladder.name: fit.placed.origin for fit in find_laser_ladders(local, walls, order)}
        for true in scene.canal.ladders:
            assert np.linalg.norm(fits[true.name] + ORIGIN - scene.canal.to_tunnel(true.origin)) < 0.006


def test_derivatives_of_a_pose_are_those_of_differences() -> None:
    rng = np.random.default_rng(5)
    pose = Pose(Rotation.from_rotvec([0.3, -0.2, 1.0]).as_matrix(), np.array([3.0, -2.0, -1.0]), 1.004)
    own = rng.normal(0.0, 4.0, (20, 3))
    normal = rng.normal(size=(20, 3))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    analytic = pose_derivatives(pose.apply(own), pose, normal)
    for k in range(7):
        change = np.zeros(7)
        change[k] = 1e-6
        turn = Rotation.from_rotvec(change[:3]).as_matrix()
        moved = Pose(turn @ pose.rotation, pose.translation + change[3:6], pose.scale + change[6])
        difference = ((moved.apply(own) - pose.apply(own)) * normal).sum(axis=1) / 1e-6
        assert np.allclose(difference, analytic[:, k], atol=1e-4)


def test_scans_at_wrong_places_contradict_each_other(scene: Scene) -> None:
    local = scene.laser - ORIGIN
    walls = find_walls(local)
    reliefs = Reliefs({i: prepare(cloud, walls) for i, cloud in enumerate(scene.clouds())})
    along = scene.canal.turn @ [1.0, 0.0, 0.0]
    first, second = (Pose(scan.rotation, scan.translation - ORIGIN, scan.scale) for scan in scene.scans)
    assert agreement(0, 1, (first, second), reliefs, walls) != -1
    assert agreement(0, 0, (first, first), reliefs, walls) == 1
    moved = replace(first, translation=first.translation + 3.0 * along)
    assert agreement(0, 0, (first, moved), reliefs, walls) == -1


def test_a_ladder_that_the_laser_does_not_see_is_not_taken_for_another(scene: Scene) -> None:
    hidden = scene.canal.ladders[1]
    seen = scene.laser[~scene.canal.near(hidden, scene.laser, 0.3, 0.1)]
    found = register(seen, scene.clouds(), scene.canal.measured(), LEVEL)
    assert any(hidden.name in note for note in found.notes)
    for pose, scan in zip(found.scans, scene.scans, strict=True):
        if pose.state != "undetermined":
            assert np.linalg.norm(pose.translation - scan.translation) < 0.05
            assert turn_between(pose, scan) < 0.5


def test_ladders_whose_gaps_are_others_are_not_used(scene: Scene) -> None:
    other = [replace(ladder, height=0.3 * np.arange(len(ladder.height))) for ladder in scene.canal.measured()]
    result = register(scene.laser, scene.clouds(), other, LEVEL)
    assert result.ladders == ()
    assert {pose.state for pose in result.scans} == {"undetermined"}
    assert sum("has other gaps" in note for note in result.notes) == 2


def test_a_ladder_that_was_moved_after_the_laser_is_told_and_scans_are_weak(scene: Scene) -> None:
    moved = scene.laser.copy()
    moved[scene.canal.near(scene.canal.ladders[1], moved, 0.3, 0.1)] += np.array([0.0, 0.0, 0.05])
    result = register(moved, scene.clouds(), scene.canal.measured(), LEVEL)
    assert any("is not where the laser saw it" in note for note in result.notes)
    for pose in result.scans:
        assert (pose.state, pose.undetermined[-1]) == ("weak", "ladders disagree")


def test_a_scan_of_the_laser_is_no_scan_of_the_sonar(scene: Scene) -> None:
    own = (scene.laser - scene.laser.mean(axis=0))[::4]
    with pytest.raises(UserError, match=r"laser\.xyz: no bed between its walls"):
        register(scene.laser, [SonarCloud(Path("laser.xyz"), own, 1)], scene.canal.measured(), LEVEL)


def test_a_pose_one_stile_beside_leads_to_the_right_one(scene: Scene) -> None:
    walls = find_walls(scene.laser - [*ORIGIN[:2], LEVEL])
    ladders = find_laser_ladders(scene.laser - [*ORIGIN[:2], LEVEL], walls, scene.canal.measured())
    scan = scene.scans[0]
    prepared = prepare(SonarCloud(Path("s0.xyz"), scan.points, 1), walls)
    true = scan.translation - [*ORIGIN[:2], LEVEL]
    k = int(np.argmin([np.linalg.norm(one.placed.origin[:2] - true[:2]) for one in ladders]))
    placed = ladders[k].placed
    wrong = Pose(scan.rotation, true + placed.gap * placed.axes[0], scan.scale)
    found = _one_stile_beside(prepared, find_patches(prepared.thin), _Fitted(wrong, (k,), 0), walls, ladders)
    assert min(np.linalg.norm(one.pose.translation - true) for one in found) < 0.05
