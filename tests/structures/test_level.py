"""The level of a surface over incidence, what differs from it by more than chance, and which faces are solid."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from tunneldb.structures.contrast import Observed, curve_of, face_level, member_levels, some_pixels
from tunneldb.structures.level import LevelCurve
from tunneldb.structures.models import WIDTH
from tunneldb.structures.significance import Scatter, limit, significance
from tunneldb.structures.solidity import solid_faces

FLAT = np.zeros(WIDTH)
SIDE = 0.02  # of a pixel, m
NOISE = 0.4  # dB
Law = Callable[[np.ndarray], np.ndarray]


def lambert(cosine: np.ndarray) -> np.ndarray:
    return 20.0 + 10.0 * np.log10(cosine)


def gloss(cosine: np.ndarray) -> np.ndarray:
    """Beckmann's lobe of facets with a slope of 0.35 on a dull ground: it falls by 5 dB from 13° to 34°."""
    square = 1.0 / cosine**2 - 1.0
    return 20.0 + 10.0 * np.log10(0.15 * cosine + 0.5 * np.exp(-square / 0.35**2) / cosine**5)


def wall(law: Law, spot: float = -4.0, scan: int = 0, *, seed: int = 1, left: float = 0.0) -> tuple[Observed, np.ndarray]:
    """A wall 6 m × 2 m from 4 m before its end, and which of its pixels are in a spot all over it between 1.5 and 2.5 m."""
    columns, rows = 300, 100
    row, column = np.divmod(np.arange(rows * columns), columns)
    x, z = (column + 0.5) * SIDE, (row + 0.5 - rows / 2) * SIDE
    range_m = np.sqrt((x - left) ** 2 + z**2 + 16.0)
    cosine = 4.0 / range_m
    covered = (x > 1.5 + 0.2 * z) & (x < 2.5)
    value = law(cosine) + spot * covered + np.random.default_rng(seed).normal(0.0, NOISE, len(x))
    return Observed(scan, columns, np.arange(len(x)), np.arccos(cosine), range_m, value, np.full(len(x), 2.0)), covered


def off(curve: LevelCurve, one: Observed, law: Law) -> np.ndarray:
    return np.abs(curve(one.angle, one.range_m) - law(np.cos(one.angle)))


@pytest.mark.parametrize("law", [lambert, gloss])
def test_a_spot_over_all_of_some_incidences_does_not_bend_the_level(law: Law) -> None:
    one, _ = wall(law)
    curve = curve_of([one], FLAT, by_range=False)
    assert off(curve, one, law).max() < 0.35
    assert np.median(curve.sigmas(one.angle)) == pytest.approx(NOISE, rel=0.1)


def test_gloss_at_right_angles_is_no_spot() -> None:
    one, _ = wall(gloss, 0.0)
    curve = curve_of([one], FLAT, by_range=False)
    assert off(curve, one, gloss).max() < 0.2


def test_beyond_what_was_seen_and_of_few_points_no_level_is_known() -> None:
    one, _ = wall(lambert)
    curve = curve_of([one], FLAT, by_range=False)
    assert curve.known(one.angle).all()
    assert not curve.known(np.radians([65.0, 85.0])).any()
    few = some_pixels([one], np.arange(len(one.pixel)).reshape(100, 300) < 14)
    assert not curve_of(few, FLAT, by_range=False).known(few[0].angle).any()


def test_what_one_scan_sees_mostly_covered_another_tells() -> None:
    def rust(cosine: np.ndarray) -> np.ndarray:
        return np.asarray(6.0 + 2.0 * np.log10(cosine))

    front, covered = wall(gloss, 0.0)
    front = Observed(**{**vars(front), "value": np.where(covered, rust(np.cos(front.angle)), front.value)})
    side, _ = wall(gloss, 0.0, 1, seed=2, left=2.0)
    side = Observed(**{**vars(side), "value": np.where(covered, rust(np.cos(side.angle)), side.value)})
    at = np.arange(30_000) % 300
    mostly_rust = some_pixels([side], ((at > 60) & (at < 140)).reshape(100, 300))[0]
    places = np.arange(30_000)
    one_face = member_levels([[front, mostly_rust]], FLAT, by_range=False)
    two_faces = member_levels([[front], [mostly_rust]], FLAT, [places, places], by_range=False)
    clean = ~covered[mostly_rust.pixel]
    assert clean.mean() < 0.4
    for levels in (one_face, two_faces):
        assert np.median(off(levels[1], mostly_rust, gloss)[clean]) < 0.4


def test_a_face_of_another_material_has_its_own_level() -> None:
    one, _ = wall(lambert, 0.0)
    curve = curve_of([one], FLAT, by_range=False)
    darker, _ = wall(lambda cosine: lambert(cosine) - 3.0, 0.0, seed=3)
    assert np.median(off(face_level(curve, darker), darker, lambda cosine: lambert(cosine) - 3.0)) < 0.1
    assert np.median(off(face_level(curve, darker, piece=True), darker, lambert)) < 0.1, "a stain covers a piece of a wall"
    rusty, _ = wall(lambert, -3.0, seed=4)
    half = some_pixels([rusty], (np.arange(30_000) % 300 < 150).reshape(100, 300))[0]
    assert np.median(off(face_level(curve, half), half, lambert)) < 0.1


def test_chance_passes_hardly_ever_and_weak_patches_do() -> None:
    rng = np.random.default_rng(5)
    judged = rng.random((400, 400)) < 0.9
    noise = rng.normal(0.0, 1.0, judged.shape).astype(np.float32)
    sigma = np.ones(judged.shape, np.float32)
    none = significance(noise, judged, sigma, judged.size, Scatter())[0]
    assert (np.abs(none) > 1.0).sum() <= 10
    patch = np.zeros(judged.shape, np.bool_)
    patch[200:225, 100:125] = True
    found = significance(noise + np.float32(1.5) * patch, judged, sigma, judged.size, Scatter())[0] > 1.0
    assert found[patch].mean() > 0.9
    assert found[~np.pad(patch, 6)[3:-9, 3:-9] & ~patch].mean() < 0.001


def test_more_is_asked_of_larger_structures_and_smaller_windows() -> None:
    assert limit(10**7, 3) > limit(10**5, 3) > limit(10**5, 9) > 3.0


def test_unevenness_is_no_spot() -> None:
    rng = np.random.default_rng(6)
    coarse = rng.normal(0.0, 0.4, (40, 40))
    uneven = np.kron(coarse, np.ones((15, 15))).astype(np.float32) + rng.normal(0.0, 0.3, (600, 600)).astype(np.float32)
    differs, _ = significance(
        uneven, np.ones(uneven.shape, np.bool_), np.full(uneven.shape, 0.5, np.float32), 360_000, Scatter()
    )
    assert (np.abs(differs) > 1.0).mean() < 0.002


def test_what_lets_beams_through_is_not_solid() -> None:
    densities = np.array([[[1000.0, 9e4]], [[1020.0, 5e4]], [[980.0, 2e3]], [[300.0, 1e3]]])
    assert solid_faces(densities).tolist() == [True, True, True, False]
    thinned = densities.copy()
    thinned[1, 0, 0] = 400.0  # by no even steps: nothing is told
    assert solid_faces(thinned).all()
