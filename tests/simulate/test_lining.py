"""Make and looks of the simulator's lining: points against the polygons of the truth, which are made apart from them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyogrio.raw
import pytest
import shapely
from support.lining_scans import BARE, inside, scan

from tunneldb.errors import UserError
from tunneldb.simulate import Cloud, Parameters, Simulation, simulate, write
from tunneldb.simulate.lining.reflectance import level as level_at
from tunneldb.simulate.truth import dry_features

pytestmark = pytest.mark.slow

# Points of the simulator before it had linings: number; means of x, y, z from the origin and of the amplitude, standard
# deviation of the offset, means of class and leak.
BEFORE: list[tuple[dict[str, Any], list[float]]] = [
    ({"length": 30.0, "straight": 5.0, "seed": 3, "section": "horseshoe", "scanner": "profiler", "profile_spacing": 0.2,
      "profile_points": 300, "leaks": 3, "relief": 0.002},
     [44999, 13.215647354430985, 7.084444020874798, -0.9625964337247979,
      21.407358798358903, 0.07923711600142003, 0.5309451321140469, -0.99564434765217]),
    ({"length": 30.0, "angular_step": 1.0, "seed": 4, "section": "circular", "slope": 3.0, "leaks": 3, "people": 1,
      "spheres": 2, "ballast": 0.02, "camber": 2.0},
     [102915, 13.118434499658179, 7.307680781930685, 0.9520992889581521,
      21.664568466040482, 0.09754885876823084, 0.41640188505077, -0.9055336928533255]),
    ({"length": 40.0, "density": 40.0, "seed": 5, "section": "box", "scanner": "static", "leaks": 4, "walkway": 0.3,
      "catenary": True},
     [44779, 17.499431330652442, 9.54063185211271, 0.007427522394891639,
      21.272353495361845, 0.0826395692303846, 0.401572165524018, -0.9918711896201344]),
]  # fmt: skip


def figures(cloud: Cloud) -> list[float]:
    means = np.mean(cloud.xyz, axis=0) - np.array([272_000.0, 4_765_000.0, 640.0])
    rest = np.mean(cloud.amplitude, dtype=float), np.std(cloud.offset, dtype=float), np.mean(cloud.klass), np.mean(cloud.leak)
    return [float(len(cloud)), *means.tolist(), *(float(v) for v in rest)]


@pytest.mark.parametrize(("values", "before"), BEFORE)
def test_old_seeds_keep_their_points(values: dict[str, Any], before: list[float]) -> None:
    np.testing.assert_allclose(figures(simulate(Parameters(**values))), before, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    "asked",
    [
        {"salts": 4.0, "salt_fringe": 0.1, "halos": 2, "shade": 0.5, "chamfers": 6.0},
        {"banding": 0.3, "drift": 0.3, "gain_step": 1.0, "saturation": 20.0, "ghosts": 0.1},
        {"mesh": 0.1, "patch_turn": 6.0, "patch_level": (-6.0, -3.0)},
    ],
)
def test_a_phenomenon_moves_nothing_else(asked: dict[str, Any]) -> None:
    common: dict[str, Any] = {"length": 40.0, "lining": "segments", "leaks": 4, "clutter": 3, "seed": 11}
    plain, other = Simulation(Parameters(**common)), Simulation(Parameters(**common, **asked))
    assert other.leaks == plain.leaks
    assert other.appendages == plain.appendages
    np.testing.assert_array_equal(other.rings.level, plain.rings.level)


@pytest.fixture(scope="module")
def segments() -> tuple[Simulation, np.ndarray, np.ndarray]:
    return scan(lining="segments", seed=2)


def test_segments_are_even_between_joints_and_pockets(segments: tuple[Simulation, np.ndarray, np.ndarray]) -> None:
    simulation, points, level = segments
    dry = dry_features(simulation)
    lowest = simulation.tunnel.section.floor_arc
    gaps = shapely.union_all([d.outline.buffer(0.001) for d in dry if d.kind == "joint"])
    pockets = shapely.union_all([d.outline.buffer(0.1) for d in dry if d.kind == "pocket"])  # their walls are met too
    clear = ~inside(pockets, points)
    points, level = points[clear], level[clear]
    middles = []
    for cell in shapely.box(0.0, -lowest, 30.0, lowest).difference(gaps).geoms:
        here = level[inside(cell, points)]
        if len(here) > 200:
            assert np.ptp(here) < 1e-4
            middles.append((cell.centroid.x, here.mean()))
    s, mean = np.array(middles).T
    assert len(s) > 90  # 20 rings of 4.5 segments above the floor
    rings = np.floor((s - simulation.rings.first) / 1.5)
    of_ring = np.array([mean[rings == r].mean() for r in np.unique(rings)])
    assert 0.45 < of_ring.std() < 1.2  # 0.8 dB, of 20 rings
    assert 0.2 < np.concatenate([mean[rings == r] - mean[rings == r].mean() for r in np.unique(rings)]).std() < 0.4


def test_joints_are_darker_by_their_drop_where_the_truth_has_them(segments: tuple[Simulation, np.ndarray, np.ndarray]) -> None:
    simulation, points, level = segments
    joints = [d for d in dry_features(simulation) if d.kind == "joint"]
    checked = 0
    for joint in joints:
        left, low, right, high = joint.outline.bounds
        is_ring = high - low > right - left
        assert 0.005 - 1e-9 <= (right - left if is_ring else high - low) <= 0.012 + 1e-9
        assert 2.0 <= joint.drop <= 5.0
        clear = (points[:, 0] > left + 0.5) & (points[:, 0] < right - 0.1)  # of pockets and of ring joints
        mine = clear & inside(joint.outline, points)
        below = clear & (points[:, 1] > low - 0.05) & (points[:, 1] < low - 0.001)
        above = clear & (points[:, 1] > high + 0.001) & (points[:, 1] < high + 0.05)
        if not is_ring and min(mine.sum(), below.sum(), above.sum()) > 3:
            # Half of the joint belongs to the segment on either side.
            falls = [np.median(level[beside]) - level[mine] for beside in (below, above)]
            assert np.min(np.abs(np.array(falls) - joint.drop), axis=0).max() < 1e-3
            checked += 1
    assert checked > 10


def test_blocks_shotcrete_and_tiles_have_their_textures() -> None:
    simulation, points, level = scan(lining="cast", length=60.0, seed=4)
    joints = [d for d in dry_features(simulation) if d.kind == "joint"]
    np.testing.assert_allclose(np.diff([d.outline.centroid.x for d in joints]), 10.0, atol=1e-9)
    for d in joints:
        assert 0.010 <= d.outline.bounds[2] - d.outline.bounds[0] <= 0.020 + 1e-9
    between = shapely.union_all([d.outline for d in joints])
    blocks = np.floor((points[:, 0] - simulation.rings.first) / 10.0)
    clear = ~inside(between, points)
    spread = [level[clear & (blocks == b)].std() for b in np.unique(blocks)]
    assert 0.12 < np.mean(spread) < 0.28
    _, points, level = scan(lining="shotcrete", seed=5)
    assert 0.25 < level.std() < 0.6
    _, points, level = scan(lining="tiles", seed=5)
    bulk = level[level > -0.7]
    assert bulk.std() == pytest.approx(0.2, abs=0.02)
    assert 0.02 < (level < -0.7).mean() < 0.08  # grout of 5 mm about tiles of 15 to 30 cm


def test_shotcrete_is_alike_over_centimetres_and_unlike_over_metres() -> None:
    simulation = Simulation(Parameters(**{**BARE, "lining": "shotcrete"}, seed=6))
    rng = np.random.default_rng(0)
    s, arc = rng.uniform(0.0, 30.0, 3000), rng.uniform(-9.0, 9.0, 3000)
    assert simulation.reflectance is not None
    here, near, far = (level_at(simulation.reflectance, s + d, arc) for d in (0.0, 0.02, 2.0))
    assert 0.3 * 0.9 < here.std() < 0.5 * 1.1
    assert abs(here.mean()) < 0.05
    assert np.corrcoef(here, near)[0, 1] > 0.95
    assert abs(np.corrcoef(here, far)[0, 1]) < 0.1


def test_marks_and_soot_are_where_the_truth_has_them() -> None:
    simulation, points, level = scan(soot=3.0, patches=6, paint=8, seed=7)
    dry = dry_features(simulation)
    (soot,) = (d for d in dry if d.kind == "soot")
    marks = shapely.union_all([m.polygon().buffer(0.001) for m in simulation.marks])
    off = ~inside(marks, points)
    within, without = inside(soot.outline.buffer(-0.1), points), ~inside(soot.outline.buffer(0.1), points)
    assert level[within & off].max() < -1.4
    assert level[without & off].min() > -1.6
    assert level[inside(soot.outline, points) & off].mean() == pytest.approx(-soot.drop, abs=0.1)
    high = np.abs(points[:, 1]) > 6.0  # where there is no soot
    assert np.abs(level[high & off]).max() < 0.1
    kinds = {d.kind for d in dry}
    assert kinds <= {"soot", "patch", "paint", "stripe"}
    seen = 0
    for m in simulation.marks:
        mine = inside(m.polygon().buffer(-0.0005), points) & high
        if mine.any():
            np.testing.assert_allclose(level[mine], m.level, atol=0.1)
            seen += 1
        assert (-4.0 <= m.level <= 4.0) if m.kind != "patch" else (-2.0 <= m.level <= 2.0)
        assert any(d.outline.equals(m.polygon()) for d in dry) == (m.level < 0.0)
    assert seen > 5


def test_grime_hangs_beneath_what_runs_along_the_wall() -> None:
    simulation, points, level = scan(grime=3.0, appendages=True, seed=8)
    bands = [d for d in dry_features(simulation) if d.kind == "grime"]
    assert len(bands) == 4
    tray = next(a for a in simulation.appendages if a.kind == "tray")
    below = abs(tray.arc) + 0.5 * tray.width
    depth = np.abs(points[:, 1]) - below
    side = np.sign(points[:, 1]) == np.sign(tray.arc)
    beneath, farther = side & (depth > 0.03) & (depth < 0.08), side & (depth > 1.0)
    assert level[beneath].mean() < -0.6
    assert level[farther].mean() > -0.1


def test_marks_leave_leaks_and_each_other_alone() -> None:
    p = Parameters(length=60.0, leaks=8, patches=6, paint=8, seed=9)
    simulation = Simulation(p)
    assert [k.polygon.wkb for k in simulation.leaks] == [
        k.polygon.wkb for k in Simulation(Parameters(length=60.0, leaks=8, seed=9)).leaks
    ]
    for mark in simulation.marks:
        assert all(mark.polygon().distance(leak.polygon) > 0.14 for leak in simulation.leaks)


def test_truth_of_the_lining_as_geopackage(tmp_path: Path) -> None:
    p = Parameters(
        **{**BARE, "leaks": 3, "profile_spacing": 0.5}, lining="segments", joint_leaks=2, drips=True, soot=2.0, paint=2
    )
    made = write(Simulation(p), tmp_path)
    assert made.lining == tmp_path / "tunnel.truth.gpkg"
    meta, _, wkb, columns = pyogrio.raw.read(made.lining, layer="leak")
    assert meta["crs"] is None
    table = dict(zip(meta["fields"], columns, strict=True))
    features = json.loads(made.leaks.read_text())["features"]
    assert list(table["id"]) == [f["id"] for f in features] == [1, 2, 3, 4, 5]
    for shape, feature, area in zip(shapely.from_wkb(wkb), features, table["area"], strict=True):
        assert shape.is_valid
        assert shape.equals(shapely.geometry.shape(feature["geometry"]))
        assert shape.area == pytest.approx(area)
    meta, _, wkb, columns = pyogrio.raw.read(made.lining, layer="dry")
    table = dict(zip(meta["fields"], columns, strict=True))
    assert set(table["kind"]) >= {"joint", "pocket", "soot"}
    assert table["drop_db"].min() > 0.0
    assert shapely.is_valid(shapely.from_wkb(wkb)).all()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"lining": "wood"}, "lining 'wood' is unknown: use plain, cast, segments, .*rock or rough_shotcrete"),
        ({"range_curve": "cube"}, "range curve 'cube' is unknown"),
        ({"joint_leaks": 1}, "joint leaks need joints, but lining plain has none"),
        ({"ring_step": 0.003, "lining": "tiles"}, "ring step needs rings, but lining tiles has none"),
        ({"niche_leaks": 1, "niches": False}, "niche leaks need niches"),
        ({"beam": -1.0}, "beam is -1"),
        ({"chamfers": 6.0}, "chamfers need joints, but lining plain has none: use lining cast or segments"),
        ({"pocket_leaks": 1, "lining": "cast"}, "pocket leaks need bolt pockets, but lining cast has none"),
        ({"mesh": 0.01}, "mesh is 0.01 m: give 0 for none"),
        ({"banding": 0.3, "density": 100.0}, "banding needs scan lines"),
        ({"patch_level": (2.0, -2.0)}, "patch level is 2 to -2"),
    ],
)
def test_bad_linings_are_the_users_errors(values: dict[str, Any], message: str) -> None:
    with pytest.raises(UserError, match=message):
        Parameters(**values)
