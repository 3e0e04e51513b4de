"""Rings of a scanned lining from patches that are made: shape, steps, lips, chords, and joints from peaks."""

from __future__ import annotations

import numpy as np
import pytest

from tunneldb.arrays import Float
from tunneldb.measures.rings.compute.joint_steps import joint_steps
from tunneldb.measures.rings.compute.joints import NoRingsError, column_signals, follow, peaks, ring_length, strength
from tunneldb.measures.rings.compute.lining_ring import measure_ring
from tunneldb.measures.rings.compute.patches import Patches, average
from tunneldb.shape.rings import fit_ring

RADIUS, CENTRE, SIDE, NOISE = 2.9, (0.02, -0.03), 0.06, 0.0006
JOINT, LENGTH = 101.5, 1.5
FLOOR = 6.5  # m of arc to both sides: beyond it nothing is seen


def patches(out: Float | float = 0.0, flattening: float = 0.0, seed: int = 0) -> Patches:
    """Two rings about a centre, which stand out by so much, (c, r) m."""
    chainage, arc = np.arange(100.0, 103.0, SIDE) + SIDE / 2, np.arange(-8.97, 9.0, SIDE)
    turn = arc / RADIUS
    radius = RADIUS + flattening * np.cos(2.0 * (turn - 0.4)) + np.zeros((len(chainage), 1)) + out
    radius += np.random.default_rng(seed).normal(0.0, NOISE, radius.shape)
    radius[:, np.abs(arc) > FLOOR] = np.nan
    return Patches(chainage, arc, CENTRE[0] + radius * np.sin(turn), CENTRE[1] + radius * np.cos(turn))


def test_shape_chord_and_seen_share_are_those_of_the_ellipse() -> None:
    found = measure_ring(patches(flattening=0.008), 100.0, JOINT, 2.0 * np.pi * RADIUS, [(270.0, 90.0), (170.0, 0.0)])
    assert found.ring is not None
    assert found.ring.is_ellipse
    ellipse = found.ring.adjustment.ellipse
    np.testing.assert_allclose(
        ellipse.parameters[:3], [*CENTRE, RADIUS], atol=5 * np.sqrt(np.diag(ellipse.covariance)[:3].max())
    )
    assert ellipse.radius == pytest.approx(RADIUS, abs=0.0005)
    assert 4.0 * ellipse.flattening / (2.0 * RADIUS) == pytest.approx(4.0 * 0.008 / (2.0 * RADIUS), abs=0.0005)
    assert ellipse.direction == pytest.approx(np.degrees(0.4), abs=2.0)
    assert found.seen_share == pytest.approx(2.0 * FLOOR / (2.0 * np.pi * RADIUS), abs=0.01)
    level, unseen = found.chords
    assert level.length == pytest.approx(2.0 * (RADIUS - 0.008 * np.cos(0.8)), abs=max(5.0 * level.se, 0.0005))
    assert np.isnan(unseen.length)


@pytest.mark.slow
@pytest.mark.parametrize("third", [0.0, 0.002])
def test_standard_errors_hold_with_three_tenths_of_the_ring_unseen(third: float) -> None:
    """Also of a ring that is not quite an ellipse, which an ellipse alone would follow by millimetres."""
    random = np.random.default_rng(7)
    turn = np.radians(np.linspace(-180.0, 180.0, 300, endpoint=False))
    turn = turn[np.abs(turn) < np.radians(126.0)]
    ratio = []
    for _ in range(80):
        radius = RADIUS + 0.008 * np.cos(2.0 * (turn - random.uniform(0.0, 3.0)))
        radius += third * np.cos(3.0 * (turn - random.uniform(0.0, 2.0))) + random.normal(0.0, NOISE, len(turn))
        ellipse = fit_ring(radius[:, None] * np.column_stack([np.sin(turn), np.cos(turn)])).adjustment.ellipse
        off = [ellipse.radius - RADIUS, ellipse.flattening - 0.008]
        ratio.append(off / np.array([np.sqrt(ellipse.covariance[2, 2]), ellipse.flattening_se]))
    assert (np.abs(ratio) < 1.96).mean() == pytest.approx(0.95, abs=0.05)


def test_a_box_has_chords_and_no_radius() -> None:
    shown = patches()
    right, up = shown.right - CENTRE[0], shown.up - CENTRE[1]
    scale = 2.5 / np.maximum(np.abs(right), np.abs(up))
    box = Patches(shown.chainage, shown.arc, right * scale, up * scale)
    found = measure_ring(box, 100.0, JOINT, 20.0, [(270.0, 90.0)])
    assert found.ring is None
    assert found.remark.startswith("not round")
    assert found.chords[0].length == pytest.approx(5.0, abs=0.02)


def test_standard_errors_of_steps_hold() -> None:
    """Of the biweight's planes, too, which give what lies far off less weight."""
    off = [joint_steps(patches(seed=seed), JOINT, LENGTH, LENGTH) for seed in range(12)]
    ratio = np.concatenate([(one.step / one.se)[np.isfinite(one.step)] for one in off])
    assert len(ratio) > 400
    assert np.sqrt(np.mean(ratio**2)) == pytest.approx(1.0, abs=0.07)


@pytest.mark.parametrize("kind", ["inwards", "shifted"])
def test_steps_are_those_that_were_made(kind: str) -> None:
    shown = patches()
    behind = (shown.chainage > JOINT)[:, None]
    if kind == "inwards":
        made = patches(np.where(behind, -0.004, 0.0))
        truth = np.full(len(shown.arc), 0.004)
    else:
        made = Patches(shown.chainage, shown.arc, shown.right + 0.005 * behind, shown.up)
        truth = -0.005 * np.sin(shown.arc / RADIUS)
    found = joint_steps(made, JOINT, LENGTH, LENGTH)
    told = np.isfinite(found.step)
    assert told.sum() == pytest.approx(2.0 * FLOOR / (5 * SIDE), abs=3)
    off = found.step - np.interp(found.arc, shown.arc, truth)
    assert np.quantile(np.abs(off[told]), 0.95) < 0.001
    assert np.sqrt(np.mean((off / found.se)[told] ** 2)) == pytest.approx(1.0, abs=0.35)
    greatest = found.greatest
    assert greatest is not None
    assert abs(greatest[0]) == pytest.approx(np.abs(truth).max(), abs=0.001)


def test_no_step_is_told_from_one_side() -> None:
    found = joint_steps(patches(), JOINT, 0.0, LENGTH)
    assert np.isnan(found.step).all()
    assert found.greatest is None


def test_lips_between_segments_are_found_where_they_are() -> None:
    shown = patches()
    assert measure_ring(shown, 100.0, JOINT, 18.2).lip is None
    lip = measure_ring(patches(np.where((shown.arc > 2.0) & (shown.arc < 4.5), -0.004, 0.0)), 100.0, JOINT, 18.2).lip
    assert lip is not None
    assert min(abs(lip.arc - 2.0), abs(lip.arc - 4.5)) < 2 * SIDE
    assert lip.size == pytest.approx(0.004 if abs(lip.arc - 2.0) < 1.0 else -0.004, abs=0.001)


def test_a_ring_askew_to_the_axis_has_no_lip_beside_what_hides_a_part_of_it() -> None:
    """Rows that are seen at one end of the ring only lie where that end is."""
    shown = patches()
    askew = Patches(shown.chainage, shown.arc, shown.right + 0.008 * (shown.chainage - 100.75)[:, None], shown.up)
    hidden = (shown.chainage < 101.1)[:, None] & (np.abs(shown.arc - 4.8) < 0.3)
    right, up = (np.where(hidden, np.nan, part) for part in (askew.right, askew.up))
    assert measure_ring(Patches(shown.chainage, shown.arc, right, up), 100.0, JOINT, 18.2).lip is None


def test_patches_are_means_at_whole_multiples() -> None:
    values = np.arange(60.0, dtype=np.float32).reshape(6, 10)
    values[0, 0] = np.nan
    chainage, arc, mean = average(values, 10.01 + 0.02 * np.arange(10), 0.05 - 0.02 * np.arange(6), 0.06)
    np.testing.assert_allclose(chainage, [9.99 + 0.06 * k for k in range(len(chainage))], atol=0.031)
    assert arc[0] < arc[-1]
    assert np.nanmean(mean) == pytest.approx(np.nanmean(values), abs=2.0)


def rows_of_joints(pitch: float, count: int = 80) -> tuple[Float, Float]:
    """Peaks of joints that drift by 10 mm a ring in the middle, a third of them hidden, with others in between."""
    random = np.random.default_rng(round(1000 * pitch))
    each = np.full(count, pitch) + np.where(np.arange(count) // 20 == 1, 0.006, 0.0)
    each[50] *= 0.7
    true = 300.0 + np.cumsum(each)
    seen = true[random.uniform(size=count) > 0.2]
    others = random.uniform(300.0, true[-1], count // 4)
    places = np.concatenate([seen + random.normal(0.0, 0.004, len(seen)), others])
    order = np.argsort(places)
    return places[order], np.concatenate([np.full(len(seen), 12.0), np.full(len(others), 7.0)])[order]


@pytest.mark.parametrize("pitch", [1.0, 1.3, 1.7, 2.0])
def test_joints_are_followed_over_hidden_ones_and_one_of_other_length(pitch: float) -> None:
    places, weight = rows_of_joints(pitch)
    found = follow(places, weight, ring_length(places, weight))
    assert found.pitch == pytest.approx(pitch + 0.0015, abs=0.002)
    assert len(found.chainage) == pytest.approx(80, abs=2)
    assert (~found.seen).sum() == pytest.approx(16, abs=8)


def test_places_that_lie_anywhere_are_refused() -> None:
    places = np.sort(np.random.default_rng(3).uniform(0.0, 500.0, 300))
    with pytest.raises(NoRingsError, match="evenly"):
        ring_length(places, np.full(300, 8.0))


def test_dark_lines_and_steps_of_images_are_peaks() -> None:
    random, pixel = np.random.default_rng(5), 0.02
    level = random.normal(0.0, 0.4, (600, 2500)).astype(np.float32)
    offset = random.normal(0.0, 0.003, (600, 2500)).astype(np.float32)
    joints = np.arange(40, 2480, 75)
    level[:, joints[::2]] -= 0.8
    for joint in joints[1::2]:
        offset[:, joint:] += 0.002 * random.choice([-1.0, 1.0])
    places, strong = peaks(strength(column_signals(level, offset, pixel), pixel), pixel)
    assert len(places) == pytest.approx(len(joints), abs=2)
    assert np.quantile(np.abs(places[:, None] - joints).min(axis=1), 0.9) <= 1.0
    assert ring_length((places + 0.5) * pixel, strong) == pytest.approx(1.5, abs=0.01)
