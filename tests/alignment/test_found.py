"""The axis found from points: of boxes bent along circles of known radius and slope, with what stands in and about them."""

from __future__ import annotations

import numpy as np
import pytest

from tunneldb.alignment.found import FoundAxis, find_axis, follow_line, without_haze
from tunneldb.arrays import Bool, Float
from tunneldb.errors import UserError

pytestmark = pytest.mark.slow

Rng = np.random.Generator
WIDTH, HEIGHT, LENGTH = 8.0, 6.0, 120.0
AT = np.array([512_345.0, 104_321.0, 414.0])


def box(low: tuple[float, ...], high: tuple[float, ...], density: float, rng: Rng, faces: str = "NSTB") -> Float:
    """Points on faces of a box in (along, right, up): walls N and S, top, bottom, and its ends E and W."""
    a, b = np.array(low), np.array(high)
    points = []
    for face in faces:
        axis, value = {"N": (1, b), "S": (1, a), "T": (2, b), "B": (2, a), "E": (0, b), "W": (0, a)}[face]
        size = np.delete(b - a, axis).prod()
        p = a + rng.random((int(size * density), 3)) * (b - a)
        p[:, axis] = value[axis]
        points.append(p)
    return np.vstack(points)


def inside(p: Float, low: tuple[float, ...], high: tuple[float, ...]) -> Bool:
    return ((p > np.array(low)) & (p < np.array(high))).all(axis=1)


def bent(p: Float, radius: float, slope: float) -> Float:
    """Transform (along, right, up) to the map: along an arc that bends right (inf: straight), from north-east, with a slope."""
    s, u, w = p.T
    turn = 0.9 + (s / radius)
    centre = np.array([np.sin(0.9), -np.cos(0.9)])  # to the right
    if np.isinf(radius):
        plan = s[:, None] * [np.cos(0.9), np.sin(0.9)] + u[:, None] * centre
    else:
        heading = 0.9 - (turn - 0.9)
        right = np.column_stack([np.sin(heading), -np.cos(heading)])
        plan = radius * centre - (radius - u)[:, None] * right
    return AT + np.column_stack([plan, w + slope * s])


def axis(radius: float, slope: float, step: float = 0.05) -> Float:
    along = np.arange(0.0, LENGTH + step / 2, step)
    return bent(np.column_stack([along, 0 * along, 0 * along]), radius, slope)


def away(found: FoundAxis, truth: Float) -> tuple[float, float]:
    """Greatest distance in plan and in height of the found line from the true one, m."""
    step = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(found.xyz, axis=0), axis=1))])
    at = np.arange(0.0, step[-1], 0.5)
    line = np.column_stack([np.interp(at, step, column) for column in found.xyz.T])
    from scipy.spatial import cKDTree

    distance, place = cKDTree(truth[:, :2]).query(line[:, :2])
    return float(distance.max()), float(np.abs(line[:, 2] - truth[place, 2]).max())


def tunnel(density: float, rng: Rng) -> Float:
    half, up = WIDTH / 2, HEIGHT / 2
    return box((0.0, -half, -up), (LENGTH, half, up), density, rng)


def open_cut(density: float, rng: Rng) -> Float:
    """30 m of track before and behind, with slopes of 45° up to the crown, the portal's face, and the hill above it."""
    parts = []
    for low, high, face in ((-30.0, 0.0, 0.0), (LENGTH, LENGTH + 30.0, LENGTH)):
        n = int(30 * 30 * density)
        p = np.column_stack([rng.uniform(low, high, n), rng.uniform(-15, 15, n), np.zeros(n)])
        p[:, 2] = -3.0 + np.maximum(np.abs(p[:, 1]) - 5.0, 0.0)
        n = int(30 * 12 * density)
        wall = np.column_stack([np.full(n, face), rng.uniform(-15, 15, n), rng.uniform(-3, 9, n)])
        parts += [p, wall[~((np.abs(wall[:, 1]) < 4) & (wall[:, 2] < 3))]]
    return np.vstack(parts)


def passage(density: float, rng: Rng) -> Float:
    """A cross passage of 3.5 m by 3 m that leaves to the right for 18 m."""
    return box((50.0, 4.0, -3.0), (53.5, 22.0, 0.0), density, rng, "TBEW")


def with_passage(points: Float, density: float, rng: Rng) -> Float:
    hole = inside(points, (50.0, 3.9, -3.0), (53.5, 4.1, 0.0))
    return np.vstack([points[~hole], passage(density, rng)])


def with_train(points: Float, density: float, rng: Rng, top: float = 1.2) -> Float:
    """A train 70 m long on the right track: what it hides of floor and wall isn't seen."""
    hidden = inside(points, (30.0, -0.2, -3.1), (100.0, 4.1, top)) & ((points[:, 1] > 0.0) | (points[:, 2] > -2.9))
    return np.vstack([points[~hidden], box((30.0, 0.2, -2.5), (100.0, 3.2, top), density, rng, "STEW")])


def with_niches(points: Float, density: float, rng: Rng) -> Float:
    for at in (20.0, 45.0, 70.0, 95.0):
        points = points[~inside(points, (at, -4.1, -3.1), (at + 4.0, -3.9, -0.5))]
        points = np.vstack([points, box((at, -6.5, -3.0), (at + 4.0, -4.0, -0.5), density, rng, "STBEW")])
    return points


CASES = [
    ("bare", np.inf, 0.0, 3.0, 0.1),
    ("bare", -150.0, -0.1, 8.0, 0.5),
    ("niches", 300.0, 0.04, 5.0, 0.1),
    ("passage", 300.0, 0.04, 5.0, 0.1),
    ("train", 300.0, 0.04, 3.0, 0.2),
    ("train", np.inf, 0.0, 25.0, 0.2),
    ("tall train", 300.0, 0.04, 5.0, 0.3),
    ("cut", -150.0, -0.02, 8.0, 0.6),
    ("all", 300.0, 0.04, 3.0, 0.3),
]


@pytest.mark.parametrize(("what", "radius", "slope", "density", "within"), CASES)
def test_it_lies_in_the_middle(what: str, radius: float, slope: float, density: float, within: float) -> None:
    rng = np.random.default_rng(5)
    points = tunnel(density, rng)
    if what in ("niches", "all"):
        points = with_niches(points, density, rng)
    if what in ("passage", "all"):
        points = with_passage(points, density, rng)
    if what in ("train", "tall train", "all"):
        points = with_train(points, density, rng, 2.0 if what == "tall train" else 1.2)
    if what in ("cut", "all"):
        points = np.vstack([points, open_cut(density, rng)])
    stray = rng.uniform((-20, -30, -20), (LENGTH + 20, 30, 20), (30, 3))
    found = find_axis(bent(np.vstack([points + rng.normal(0, 0.005, points.shape), stray]), radius, slope))
    plan, height = away(found, axis(radius, slope))
    assert plan < within
    assert height < 0.2
    assert found.length == pytest.approx(LENGTH, abs=1.0)
    assert found.width == pytest.approx(WIDTH, abs=0.3)
    assert found.xyz[0, 0] < found.xyz[-1, 0]  # from the west
    np.testing.assert_array_equal(found.reversed().xyz, found.xyz[::-1])


@pytest.mark.parametrize("spacing", [1.0, 2.5, 5.0])
def test_profiles_may_lie_apart(spacing: float) -> None:
    rng = np.random.default_rng(5)
    points = tunnel(20.0, rng)
    points[:, 0] = np.round(points[:, 0] / spacing) * spacing
    found = find_axis(bent(points, 300.0, 0.02))
    assert max(away(found, axis(300.0, 0.02))) < 0.1
    assert found.length == pytest.approx(LENGTH, abs=1.0)


def test_haze_is_left_out_and_what_is_far_from_the_scanner_is_not() -> None:
    """Voxels of a wall that a scanner sees with 20 000 points nearby and with 2 at 60 m, and single echoes in the air."""
    rng = np.random.default_rng(5)
    wall = np.column_stack([rng.uniform(0.0, 60.0, 4000), np.zeros(4000), rng.uniform(0.0, 6.0, 4000)])
    counts = np.maximum(20_000.0 / (1.0 + wall[:, 0]) ** 2.2, 2.0).astype(np.int64)
    air = np.column_stack([rng.uniform(0.0, 12.0, 500), rng.uniform(1.0, 4.0, 500), rng.uniform(0.0, 6.0, 500)])
    kept = without_haze(np.vstack([wall, air]), np.append(counts, np.ones(500, np.int64)))
    assert (kept[:, 1] == 0.0).sum() == len(wall)
    assert (kept[:, 1] > 0.0).sum() < 100


def test_a_wide_and_low_tunnel() -> None:
    """Seen from its middle, vault and floor take more of the sides than the walls."""
    rng = np.random.default_rng(5)
    found = find_axis(bent(box((0.0, -8.0, -2.5), (LENGTH, 8.0, 2.5), 8.0, rng), 300.0, 0.0))
    assert max(away(found, axis(300.0, 0.0))) < 0.15
    assert found.width == pytest.approx(16.0, abs=0.3)


def test_where_walls_are_missing_is_said() -> None:
    rng = np.random.default_rng(5)
    points = tunnel(5.0, rng)
    points = points[~inside(points, (60.0, -5.0, -2.9), (80.0, -2.0, 4.0))]  # no left wall for 20 m
    found = find_axis(bent(points, np.inf, 0.0))
    assert away(found, axis(np.inf, 0.0))[0] < 0.3
    ((low, high),) = found.doubtful if found.xyz[0, 0] < found.xyz[-1, 0] else found.reversed().doubtful
    assert 58.0 < low < 66.0
    assert 74.0 < high < 82.0
    assert find_axis(bent(tunnel(5.0, rng), np.inf, 0.0)).doubtful == []


def test_what_is_not_along_the_line_is_said() -> None:
    """A passage of 18 m by 3.5 m beside a tunnel of 120 m by 8 m, and a second piece of the tunnel beyond a gap of 40 m."""
    rng = np.random.default_rng(5)
    passed = find_axis(bent(with_passage(tunnel(5.0, rng), 5.0, rng), np.inf, 0.0))
    assert 0.01 < passed.off_line_share < 63.0 / (120.0 * 8.0)
    assert passed.off_line_centre is not None
    middle = bent(np.array([[51.75, 15.0, 0.0]]), np.inf, 0.0)[0, :2]
    assert np.hypot(*(passed.off_line_centre - middle)) < 4.0
    piece = box((160.0, -4.0, -3.0), (180.0, 4.0, 3.0), 5.0, rng)
    parted = find_axis(bent(np.vstack([tunnel(5.0, rng), piece]), np.inf, 0.0))
    assert parted.off_line_share == pytest.approx(20.0 / 140.0, abs=0.03)
    assert find_axis(bent(tunnel(5.0, rng), np.inf, 0.0)).off_line_share == 0.0


def test_a_drawn_line_keeps_its_course_beyond_the_tunnel() -> None:
    rng = np.random.default_rng(5)
    drawn = bent(np.column_stack([np.linspace(-60.0, 60.0, 5), np.full(5, 1.0), np.zeros(5)]), -150.0, 0.0)[:, :2]
    found = follow_line(bent(tunnel(5.0, rng), -150.0, 0.0), drawn)
    course = bent(np.column_stack([np.arange(-60.0, 0.0), np.zeros(60), np.zeros(60)]), -150.0, 0.0)[:, :2]
    assert max(np.hypot(*(course - vertex).T).min() for vertex in found.xyz[:8, :2]) < 1.5
    assert np.abs(found.xyz[:8, 2] - AT[2]).max() < 0.5
    assert not found.whole[:8].any()
    assert found.whole[-8:].all()


def test_two_tubes_are_refused_and_a_drawn_line_chooses() -> None:
    rng = np.random.default_rng(5)
    second = tunnel(5.0, rng) + np.array([0.0, 20.0, 0.0])
    both = bent(np.vstack([tunnel(5.0, rng), second]), 300.0, 0.04)
    with pytest.raises(UserError, match=r"has separate parts, or there are several tunnels: .* m² near .*; .* m² near"):
        find_axis(both)
    drawn = np.column_stack([np.linspace(10.0, 100.0, 7), [1.0, -1.0, 1.5, 0.0, -1.5, 1.0, 0.5], np.zeros(7)])
    plan = bent(drawn, 300.0, 0.0)[:, :2]
    found = follow_line(both, plan[::-1])
    assert max(away(found, axis(300.0, 0.04))) < 0.1
    assert np.hypot(*(found.xyz[0, :2] - plan[-1])) < 1.5  # it begins where the line does
    with pytest.raises(UserError, match="no points of a tunnel along the line"):
        follow_line(both, plan + 500.0)


def test_a_fork_of_the_same_width_is_refused() -> None:
    rng = np.random.default_rng(5)
    turned = tunnel(5.0, rng)[:, [1, 0, 2]] * (1.0, 0.6, 1.0) + (60.0, 4.0, 0.0)
    with pytest.raises(UserError, match="the tunnel forks: the branch near"):
        find_axis(bent(np.vstack([tunnel(5.0, rng), turned]), np.inf, 0.0))


@pytest.mark.parametrize("what", ["field", "wall", "hangers", "nothing"])
def test_what_is_no_tunnel_is_refused(what: str) -> None:
    rng = np.random.default_rng(5)
    points = {
        "field": np.column_stack([rng.uniform(0, 100, (20_000, 2)), rng.normal(0, 0.2, 20_000)]),
        "wall": np.column_stack([rng.uniform(0, 100, 20_000), rng.normal(0, 0.1, 20_000), rng.uniform(0, 8, 20_000)]),
        # a roof on posts: no walls
        "hangers": np.column_stack([rng.uniform(0, (100, 8), (20_000, 2)), rng.choice([0.0, 6.0], 20_000)]),
        "nothing": np.full((3, 3), np.nan),
    }[what]
    with pytest.raises(UserError, match="no tunnel: "):
        find_axis(points)
