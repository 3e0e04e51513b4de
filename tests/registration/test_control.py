"""Control points: which sphere is which, and the motion between the two."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tunneldb.errors import UserError
from tunneldb.pipeline.target_control import read_control
from tunneldb.registration.control import best_motion, match

ORIGIN = np.array([272_000.0, 4_765_000.0, 640.0])


def spheres(count: int, seed: int) -> np.ndarray:
    """Places as in a tunnel: 60 m long, 6 m wide, 2 m high."""
    return ORIGIN + np.random.default_rng(seed).uniform([0, -3, 0], [60, 3, 2], (count, 3))


def moved(points: np.ndarray, angles: tuple[float, float, float], shift: tuple[float, float, float]) -> np.ndarray:
    middle = points.mean(axis=0)
    return (points - middle) @ Rotation.from_euler("xyz", angles, degrees=True).as_matrix().T + middle + shift


@pytest.mark.parametrize("count", [3, 4, 20])
def test_a_motion_is_recovered(count: int) -> None:
    points = spheres(count, count)
    motion = best_motion(points, moved(points, (0.3, -20.0, 100.0), (5.0, -3.0, 0.7)))
    assert motion.determined == "all"
    assert motion.angles == pytest.approx([0.3, -20.0, 100.0], abs=1e-5)
    assert motion.shift == pytest.approx([5.0, -3.0, 0.7], abs=1e-7)
    assert np.linalg.det(motion.rotation) == pytest.approx(1.0)
    assert motion.rms_after < 1e-7
    assert motion.freedom == 3 * count - 6


def test_residuals_are_those_of_least_squares() -> None:
    """No other small motion leaves less, and noise comes out as it went in."""
    points = spheres(30, 1)
    rng = np.random.default_rng(2)
    onto = moved(points, (0.01, 0.02, -0.03), (0.02, 0.0, 0.01)) + rng.normal(0, 0.002, points.shape)
    motion = best_motion(points, onto)
    expected = 0.002 * np.sqrt(3 * (90 - 6) / 90)
    assert motion.rms_after == pytest.approx(expected, rel=0.25)
    for _ in range(20):
        turned = Rotation.from_rotvec(rng.normal(0, 1e-4, 3)).as_matrix()
        other = (motion.apply(points) - onto.mean(axis=0)) @ turned.T + onto.mean(axis=0) + rng.normal(0, 1e-4, 3)
        assert np.sqrt(((other - onto) ** 2).sum(axis=1).mean()) > motion.rms_after


def test_a_mirror_image_is_no_motion() -> None:
    points = spheres(6, 3)
    motion = best_motion(points, points * [1.0, -1.0, 1.0])
    assert np.linalg.det(motion.rotation) == pytest.approx(1.0)
    assert motion.rms_after > 0.1


def test_what_one_two_or_collinear_points_do_not_determine() -> None:
    one = best_motion(ORIGIN[None], ORIGIN[None] + [0.01, 0.0, 0.02])
    assert one.determined == "shift"
    assert one.rms_after < 1e-9
    assert np.array_equal(one.rotation, np.eye(3))

    line = ORIGIN + np.outer([0.0, 10.0, 25.0, 40.0], [1.0, 0.2, 0.01])
    for points in (line[:2], line):
        motion = best_motion(points, moved(points, (0.0, 0.0, 3.0), (0.1, 0.0, 0.0)))
        assert motion.determined == "line"
        assert motion.rms_after < 1e-6
        # Turned about the vertical and not about the line: the smallest rotation that does it.
        assert np.linalg.norm(Rotation.from_matrix(motion.rotation).as_rotvec(degrees=True)) == pytest.approx(3.0, abs=0.01)
        assert np.isnan(motion.turn_sigma)
    nearly = line + np.random.default_rng(4).normal(0, 0.002, line.shape)
    assert best_motion(nearly, nearly + np.array([0.1, 0, 0])).determined == "line"


def test_the_uncertainty_of_the_turn_is_that_of_repeated_measurements() -> None:
    points = ORIGIN + np.column_stack([np.linspace(0, 50, 8), [0.5, -0.5] * 4, np.zeros(8)])
    rng = np.random.default_rng(5)
    turns, sigmas = [], []
    for _ in range(200):
        motion = best_motion(points, points + rng.normal(0, 0.003, points.shape))
        turns.append(motion.angles[0])
        sigmas.append(motion.turn_sigma)
    assert np.std(turns) == pytest.approx(np.mean(sigmas), rel=0.25)


def test_by_place() -> None:
    points = spheres(8, 6)
    control = points[[5, 2, 0, 7]] + 0.03
    matched = match(np.vstack([points, ORIGIN + np.array([200, 0, 0])]), np.vstack([control, ORIGIN - [100, 0, 0]]))
    assert matched.how == "place"
    assert sorted(map(tuple, matched.pairs.tolist())) == [(0, 2), (2, 1), (5, 0), (7, 3)]


def test_of_two_near_each_other_each_gets_its_own() -> None:
    points = ORIGIN + np.array([[0.0, 0, 0], [0.16, 0, 0], [5, 0, 0]])
    matched = match(points, points + np.array([0.07, 0, 0]), within=0.1)
    assert sorted(map(tuple, matched.pairs.tolist())) == [(0, 0), (1, 1), (2, 2)]


@pytest.mark.parametrize("seed", range(5))
def test_by_distances_in_another_frame(seed: int) -> None:
    """Any frame; some spheres without control, some control without spheres, noise of 2 mm."""
    rng = np.random.default_rng(seed)
    points = spheres(9, 10 + seed)
    common = rng.permutation(9)[:6]
    others = spheres(3, 50 + seed)
    local = moved(np.vstack([points[common], others]), (10.0, -7.0, 120.0), (-271_000.0, 40.0, 3.0))
    local += rng.normal(0, 0.002, local.shape)
    matched = match(points, local)
    assert matched.how == "distances"
    assert sorted(map(tuple, matched.pairs.tolist())) == sorted((int(c), k) for k, c in enumerate(common))


def test_what_cannot_be_told_apart_is_not_matched() -> None:
    even = ORIGIN + np.outer(np.arange(6) * 10.0, [1.0, 0.0, 0.0])
    assert match(even, even - [300.0, 0, 0]).how == "ambiguous"
    assert match(spheres(5, 7), spheres(5, 8) + 100.0).how == "none"
    assert match(np.zeros((0, 3)), spheres(3, 1)).how == "none"
    assert len(match(spheres(2, 1), spheres(2, 1) + 50.0).pairs) == 0


def test_control_files(tmp_path: Path) -> None:
    path = tmp_path / "control.csv"
    path.write_text("\ufeffid,kind,x,y,z\nA 1,tripod,1,2,3\n\nB,bracket,4,5,6\n", encoding="utf-8")
    control = read_control(path)
    assert control.names == ["A 1", "B"]
    assert control.xyz.tolist() == [[1, 2, 3], [4, 5, 6]]


@pytest.mark.parametrize("text", ["id;x;y;z\nA 1;1,5;2;3\nB;4;5;6\n", "id\tz\tx\ty\nA 1\t3\t1.5\t2\nB\t6\t4\t5\n"])
def test_control_files_with_other_separators(tmp_path: Path, text: str) -> None:
    (tmp_path / "control.csv").write_text(text, encoding="utf-8")
    control = read_control(tmp_path / "control.csv")
    assert (control.names, control.xyz.tolist()) == (["A 1", "B"], [[1.5, 2, 3], [4, 5, 6]])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("id,x,y,z\nA,1,2,3\nB,4,five,6\n", "line 3: y is 'five', not a number"),
        ("id,x,y,z\nA,1,2,3\nB,4,,6\n", "line 3: y is empty; fill it in, or remove the line"),
        ("id,x,y,z\nA,1,2,nan\n", "line 2: z is nan"),
        ("id,x,y,z\nA,1,2\n", "line 2: 3 values, but the header has 4 columns"),
        ("id,x,y,z\nA,1,2,3\n,4,5,6\n", "line 3: id is empty"),
        ("id,x,y,z\nA,1,2,3\nB,4,5,6\nA,7,8,9\n", "line 4: id A is a duplicate (line 2)"),
        ("id,x,y,z\nA,1,2,3\nB,1,2,3.0005\n", "line 3: point B is at the place of point A (line 2)"),
        ("x,y,z\n1,2,3\n", "no column id"),
        ("id,x,y\nA,1,2\n", "no column z"),
        ("id|x|y|z\nA|1|2|3\n", "separate columns by commas, semicolons, tabs or spaces"),
        ("id,x,y,z\n", "has no control point"),
        ("", "is empty"),
    ],
)
def test_bad_control_files(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "control.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(UserError) as error:
        read_control(path)
    assert said in str(error.value)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


def test_a_control_file_that_is_none(tmp_path: Path) -> None:
    (tmp_path / "control.csv").write_bytes(b"id,x,y,z\nA\xff,1,2,3\n")
    for name in ("control.csv", "missing.csv"):
        with pytest.raises(UserError, match=name):
            read_control(tmp_path / name)
