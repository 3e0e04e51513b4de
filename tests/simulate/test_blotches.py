"""Salts, fringes, halos, shades, chamfers and turned patches of the simulator: points against the outlines of the truth."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pyogrio.raw
import pytest
import shapely
from support.lining_scans import BARE, inside, scan, whole_scan

from tunneldb.simulate import Parameters, Simulation, write
from tunneldb.simulate.truth import bright_features, dry_features

pytestmark = pytest.mark.slow


def test_salts_cover_their_share_and_no_leak() -> None:
    simulation, points, level = scan(salts=4.0, leaks=3, leak_edge=0.002, seed=2)
    spots = shapely.union_all([d.outline for d in bright_features(simulation) if d.kind == "salts"])
    lining = 30.0 * 2.0 * simulation.tunnel.section.floor_arc
    assert spots.area / lining == pytest.approx(0.04, abs=0.012)
    np.testing.assert_allclose(level[inside(spots.buffer(-0.015), points)], 4.0, atol=0.01)
    assert spots.intersection(shapely.union_all([leak.polygon for leak in simulation.leaks])).area < 1e-9
    wet = shapely.union_all([leak.polygon for leak in simulation.leaks])
    dry = ~inside(spots.buffer(0.02), points) & ~inside(wet.buffer(0.01), points)
    assert np.abs(level[dry]).max() < 0.01


def test_a_fringe_is_bright_outside_its_leak_only() -> None:
    simulation, points, level = scan(leaks=3, salt_fringe=0.1, salt_level=4.0, leak_edge=0.002, seed=3)
    wet = shapely.union_all([leak.polygon for leak in simulation.leaks])
    for leak in simulation.leaks:
        others = shapely.union_all([k.polygon for k in simulation.leaks if k is not leak])
        around = leak.polygon.buffer(0.075).difference(wet.buffer(0.025)).difference(others.buffer(0.15))
        fringe = level[inside(around, points)]
        assert 2.0 - 0.01 <= fringe.min() <= fringe.max() <= 4.01
        assert np.ptp(fringe) < 0.01
        np.testing.assert_allclose(level[inside(leak.polygon.buffer(-0.01), points)], -leak.drop, atol=0.01)
    assert np.abs(level[~inside(wet.buffer(0.11), points)]).max() < 0.01


def test_halos_fade_over_a_quarter_of_a_metre_and_are_dry() -> None:
    simulation, points, level = scan(halos=4, leaks=2, seed=4)
    halos = [b for b in simulation.blotches if b.kind == "halo"]
    assert len(halos) == 4
    for halo in halos:
        assert all(halo.outline.distance(leak.polygon) > 0.09 for leak in simulation.leaks)
        within = inside(halo.outline, points)
        depth = shapely.distance(halo.outline.exterior, shapely.points(points[within]))
        share = np.minimum(depth / 0.25, 1.0)
        np.testing.assert_allclose(level[within], halo.level * share**2 * (3.0 - 2.0 * share), atol=0.01)
        (truth,) = (d for d in dry_features(simulation) if d.kind == "halo" and d.drop == -halo.level)
        assert truth.outline.hausdorff_distance(halo.outline) == pytest.approx(0.125, rel=0.5)


def test_half_rings_are_of_one_shade_each() -> None:
    simulation, points, level = scan(shade=1.0, seed=5)
    middles = []
    for blotch in simulation.blotches:
        here = level[inside(blotch.outline.buffer(-0.001), points)]
        np.testing.assert_allclose(here, blotch.level, atol=0.01)
        middles.append(blotch.level)
    assert 0.5 < np.std(middles) < 1.6
    assert sum(b.outline.area for b in simulation.blotches) == pytest.approx(60.0 * simulation.tunnel.section.floor_arc)


def test_chamfers_are_dark_askew_and_as_many_as_joints() -> None:
    simulation, points, level = scan(lining="segments", chamfers=6.0, seed=6)
    chamfers = [m for m in simulation.marks if m.kind == "chamfer"]
    assert len(chamfers) == 20
    for mark in chamfers:
        lean = math.degrees(math.atan2(abs(mark.other[0] - mark.one[0]), mark.other[1] - mark.one[1]))
        assert 0.2 <= lean <= 1.5
        assert mark.width == 0.05
    for mark in chamfers[2:-2]:
        dark = inside(mark.polygon().buffer(-0.001), points)
        beside = inside(mark.polygon().buffer(0.05), points) & ~inside(mark.polygon().buffer(0.001), points)
        assert np.median(level[beside]) - np.median(level[dark]) == pytest.approx(6.0, abs=1.2)  # rings differ in level
    _, cloud = whole_scan(lining="segments", chamfers=6.0, ring_step=0.0, seed=6)
    place = np.column_stack([cloud.chainage, cloud.arc])
    middle = np.any([inside(m.polygon().buffer(-0.022), place) for m in chamfers], axis=0)
    deep = middle & (cloud.klass == 0) & (cloud.incidence < 0.5)
    assert deep.sum() > 100
    np.testing.assert_allclose(np.median(cloud.offset[deep]), -0.015, atol=0.002)
    assert sum(d.kind == "chamfer" for d in dry_features(simulation)) == 20


def test_patches_and_stripes_are_as_asked() -> None:
    p = Parameters(
        length=80.0, leaks=2, patches=8, patch_level=(-6.0, -3.0), patch_turn=6.0, paint=10, stripe_width=(0.03, 0.4)
    )
    marks = Simulation(p).marks
    patches = [m for m in marks if m.kind == "patch"]
    turns = [math.degrees(math.atan2(m.other[1] - m.one[1], m.other[0] - m.one[0])) for m in patches]
    np.testing.assert_allclose(np.abs(turns), 6.0)
    assert min(turns) < 0.0 < max(turns)
    assert all(-6.0 <= m.level <= -3.0 for m in patches)
    widths = [m.width for m in marks if m.kind == "stripe"]
    assert len(set(widths)) == 5
    assert 0.03 <= min(widths) < max(widths) <= 0.4


def test_truth_has_what_is_bright_in_a_layer_of_its_own(tmp_path: Path) -> None:
    p = Parameters(**{**BARE, "profile_spacing": 0.5, "leaks": 2}, salts=2.0, salt_fringe=0.05, halos=1, shade=0.5)
    made = write(Simulation(p), tmp_path)
    for layer, kinds, sign in (("dry", {"halo", "shade"}, 1.0), ("bright", {"salts", "fringe", "shade"}, -1.0)):
        meta, _, wkb, columns = pyogrio.raw.read(made.lining, layer=layer)
        table = dict(zip(meta["fields"], columns, strict=True))
        assert set(table["kind"]) == kinds
        assert (sign * table["drop_db"]).min() > 0.0
        assert shapely.is_valid(shapely.from_wkb(wkb)).all()
    plain = write(Simulation(Parameters(**{**BARE, "profile_spacing": 0.5}, name="plain")), tmp_path)
    assert set(pyogrio.list_layers(plain.lining)[:, 0]) == {"leak", "dry"}
