"""Faces, members and spots of plates and pipes whose truth is known by closed formulas."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from support.structure_scene import Pipe, Plate, Seen, scan

from tunneldb.structures.face_raster import Sums
from tunneldb.structures.find import Found, find_structures
from tunneldb.structures.joining import RangeImages
from tunneldb.structures.materials import part_by_material
from tunneldb.structures.models import normals_at, to_space, unroll
from tunneldb.structures.segmentation import Segmentation, find_faces
from tunneldb.structures.voxel_moments import VoxelMoments
from tunneldb.threads import use_threads

STATIONS = np.array([[0.0, 0.0, 1.5]])
WALL = Plate((-3, 6, 0), (6, 0, 0), (0, 0, 3))
SCENE = [
    WALL,
    Plate((-3, 2, 0), (6, 0, 0), (0, 4, 0)),  # floor
    Pipe((-2, 5, 1), (2, 5, 1), 0.10),
    Pipe((1, 4, 0), (1, 4, 3), 0.04),
    Pipe((-1.5, 5.5, 0), (-1.5, 5.5, 3), 0.20),
    Plate((-1, 4, 0.5), (0.2, 0, 0), (0, 0, 1.5)),  # a U profile
    Plate((-0.8, 4, 0.5), (0, 0.2, 0), (0, 0, 1.5)),
]
WINDOW = (-0.7, 0.7, -0.6, 0.5)
BASE = np.array([30.0, 25.0, 35.0, 28.0, 33.0, 31.0, 31.0])
SPOTS = [
    (0, (1.6, 6, 1.5), 0.15, -3.0),
    (0, (0.6, 6, 0.5), 0.12, 3.0),
    (2, (0.5, 4.9, 1.0), 0.10, -3.0),
    (4, (-1.5, 5.3, 1.8), 0.12, -2.5),
]


@dataclass(frozen=True)
class Result:
    """A scene, what was found of it, and the numbers of its points."""

    seen: Seen
    truth: np.ndarray
    segmentation: Segmentation
    found: Found
    face: np.ndarray
    member: np.ndarray
    spot: np.ndarray


def find(seen: Seen, level: np.ndarray, truth: np.ndarray, stations=STATIONS, pieces: int = 1) -> Result:
    scans = seen.scan.astype(np.int32)
    parts = np.array_split(np.arange(len(seen.xyz)), pieces)
    moments = VoxelMoments(stations.mean(axis=0))
    for part in parts:
        moments.add(seen.xyz[part], scans[part])
    segmentation = find_faces(moments, stations)
    sums, images = Sums.empty(segmentation.layout.size), RangeImages(segmentation.stations)
    for part in parts:
        segmentation.finder.add(seen.xyz[part], scans[part], level[part].astype(np.float32), sums)
        images.add(seen.xyz[part] - segmentation.origin, scans[part])
    found = find_structures(segmentation, sums, images, None, by_range=True)
    return Result(seen, truth, segmentation, found, *found.of_points(*segmentation.finder.find(seen.xyz, scans)))


def levels(seen: Seen, spots, base=BASE) -> tuple[np.ndarray, np.ndarray]:
    """Lambert's cosine to 0.8, the inverse square and noise of 0.5 dB; which points are in spots."""
    noise = np.random.default_rng(3).normal(0, 0.5, len(seen.xyz))
    level = base[seen.surface] + 8 * np.log10(np.maximum(seen.cosine, 0.01)) - 20 * np.log10(seen.range_m) + noise
    truth = np.zeros(len(level), bool)
    for surface, middle, radius, change in spots:
        inside = (seen.surface == surface) & (np.linalg.norm(seen.xyz - np.array(middle), axis=1) < radius)
        level[inside] += change
        truth |= inside
    return level, truth


@pytest.fixture(scope="module")
def plain() -> Seen:
    return scan(SCENE, STATIONS, step=0.0025, noise=0.0015, window=WINDOW)


@pytest.fixture(scope="module")
def result(plain: Seen) -> Result:
    return find(plain, *levels(plain, SPOTS))


def test_moments_are_those_of_the_points_in_any_order() -> None:
    rng = np.random.default_rng(1)
    xyz = rng.uniform(-1.0, 1.0, (20_000, 3)) + 1000.0
    xyz = np.round(xyz * 2**14) / 2**14  # on the steps in which coordinates are counted
    scans = rng.integers(0, 3, len(xyz)).astype(np.int32)
    one, other = VoxelMoments(np.full(3, 1000.0)), VoxelMoments(np.full(3, 1000.0))
    one.add(xyz, scans)
    order = rng.permutation(len(xyz))
    for part in np.array_split(order, 7):
        other.add(xyz[part], scans[part])
    for level in (7, 4):
        a, b = one.grid(level), other.grid(level)
        assert (a.keys == b.keys).all()
        assert (a.moments == b.moments).all()
        moved = xyz - 1000.0 + 0.5 * 2**-14
        sums = a.moments.sum(axis=0)
        expected = [len(xyz), *moved.sum(axis=0), *(moved**2).sum(axis=0), (moved[:, 0] * moved[:, 1]).sum()]
        np.testing.assert_allclose(sums[:8], expected, rtol=1e-9, atol=1e-6)


def test_unrolling_and_its_inverse() -> None:
    cylinder = np.array([1.0, 2.0, 3.0, 0.6, 0.8, 0.0, 0.25, 1.0, 0.0, 0.0, 1.0])
    u, v = np.array([0.0, 0.4, -2.0]), np.array([0.0, 0.3, -0.6])
    at = to_space(cylinder, u, v)
    back = unroll(cylinder, at + 0.01 * normals_at(cylinder, u, v))
    np.testing.assert_allclose(back, [u, v, np.full(3, 0.01)], atol=1e-12)
    # A quarter of the turn is v = r π / 2, across both the axis and where v begins.
    quarter = to_space(cylinder, np.zeros(1), np.array([0.25 * np.pi / 2]))[0] - cylinder[:3]
    np.testing.assert_allclose(quarter, 0.25 * np.cross([0.6, 0.8, 0.0], [0.0, 0.0, 1.0]), atol=1e-12)


def test_each_point_is_on_its_own_face(result: Result) -> None:
    held = result.face > 0
    assert held.mean() > 0.95
    pure = sum(
        np.unique(result.seen.surface[result.face == face], return_counts=True)[1].max()
        for face in np.unique(result.face[held])
    )
    assert pure / held.sum() > 0.99


def test_pipes_have_their_radius_and_axis(result: Result) -> None:
    for surface in (2, 3, 4):
        pipe = SCENE[surface]
        own = np.unique(result.face[(result.seen.surface == surface) & (result.face > 0)], return_counts=True)
        face = result.found.structures.faces[own[0][own[1].argmax()] - 1]
        assert abs(face.radius - pipe.radius) < max(0.001, 0.01 * pipe.radius)
        axis = np.subtract(pipe.end, pipe.begin) / np.linalg.norm(np.subtract(pipe.end, pipe.begin))
        assert np.degrees(np.arccos(min(abs(axis @ face.model[3:6]), 1.0))) < 0.2


def test_pipes_thinner_than_the_voxels_are_pipes() -> None:
    """Most points are on a wall far behind, by which voxels are wider than these pipes' radii."""
    radii = {1: 0.03, 2: 0.05, 3: 0.02}
    pipes = [
        Pipe((-1, 4, 1), (1, 4, 1), 0.03),
        Pipe((-0.5, 5, 0), (-0.5, 5, 3), 0.05),
        Pipe((0.6, 3, 0.6), (0.6, 3.4, 2.5), 0.02),
    ]
    seen = scan([Plate((-6, 8, -3), (12, 0, 0), (0, 0, 10)), *pipes], STATIONS, step=0.0025, noise=0.0015, window=WINDOW)
    result = find(seen, np.zeros(len(seen.xyz)), np.zeros(len(seen.xyz), bool))
    assert result.segmentation.edge > max(radii.values())
    faces = {face.number: face for face in result.found.structures.faces}
    for surface, radius in radii.items():
        mine = seen.surface == surface
        for number in np.unique(result.face[mine & (result.face > 0)]).tolist():
            assert faces[number].radius == pytest.approx(radius, abs=0.001)
        member = result.member[mine]
        assert (member == np.bincount(member[member > 0]).argmax()).mean() > 0.75
    assert (result.face[seen.surface == 0] == 1).mean() > 0.99


def test_incidence_is_that_of_the_surface(result: Result) -> None:
    errors = []
    for face in result.found.structures.faces:
        of = result.face == face.number
        xyz = result.seen.xyz[of] - face.origin
        u, v, _ = unroll(face.model, xyz)
        towards = STATIONS[result.seen.scan[of]] - face.origin - xyz
        cosine = np.einsum("ni,ni->n", normals_at(face.model, u, v), towards) / np.linalg.norm(towards, axis=1)
        errors.append(np.abs(np.degrees(np.arccos(np.clip(cosine, -1, 1)) - np.arccos(np.clip(result.seen.cosine[of], -1, 1)))))
    every = np.concatenate(errors)
    assert np.median(every) < 0.5
    assert np.quantile(every, 0.95) < 3.0


def test_what_a_pipe_parts_is_one_member(result: Result) -> None:
    for surface in (0, 2, 4):
        of = (result.seen.surface == surface) & (result.member > 0)
        number, count = np.unique(result.member[of], return_counts=True)
        assert count.max() / of.sum() > 0.97, f"surface {surface}: {dict(zip(number, count, strict=True))}"
        faces = np.unique(result.face[of & (result.member == number[count.argmax()])])
        assert len(faces) > 1


def test_spots_are_found_and_nothing_else(result: Result) -> None:
    marked = result.spot > 0
    both = (marked & result.truth).sum()
    assert 2 * both / (marked.sum() + result.truth.sum()) > 0.93
    assert sorted(spot.kind for spot in result.found.structures.spots) == ["bright", "dark", "dark", "dark"]
    bright = next(spot for spot in result.found.structures.spots if spot.kind == "bright")
    assert bright.difference == pytest.approx(3.0, abs=0.3)
    assert bright.area == pytest.approx(np.pi * 0.12**2, rel=0.15)
    face = result.found.structures.faces[bright.face - 1]
    centre = np.asarray(face.in_space(bright.outline.centroid).coords[0])
    np.testing.assert_allclose(centre, [0.6, 6.0, 0.5], atol=0.01)


def test_a_clean_scene_has_no_spot(plain: Seen) -> None:
    assert not find(plain, *levels(plain, [])).found.structures.spots


def test_order_of_points_and_threads_do_not_show(plain: Seen, result: Result) -> None:
    level, truth = levels(plain, SPOTS)
    order = np.random.default_rng(5).permutation(len(level))
    shuffled = Seen(*(getattr(plain, name)[order] for name in ("xyz", "surface", "scan", "range_m", "cosine")))
    use_threads(1)
    try:
        other = find(shuffled, level[order], truth[order], pieces=5)
    finally:
        use_threads(2)
    for name in ("face", "member", "spot"):
        assert (getattr(other, name) == getattr(result, name)[order]).all()


def test_plates_side_by_side_with_a_gap_between_are_two() -> None:
    plates = [Plate((-1.2, 5, 1), (1, 0, 0), (0, 0, 1)), Plate((0.2, 5, 1), (1, 0, 0), (0, 0, 1))]
    window = (-0.4, 0.4, -0.2, 0.2)
    open_ = scan(plates, STATIONS, step=0.002, window=window)
    assert len(find(open_, *levels(open_, [], np.array([30.0, 30.0, 30.0]))).found.structures.members) == 2
    # With a post before the gap, and nothing to be seen through it, they are one.
    posted = scan([*plates, Pipe((0, 3, -1), (0, 3, 4), 0.18)], STATIONS, step=0.002, window=window)
    found = find(posted, *levels(posted, [], np.array([30.0, 30.0, 30.0])))
    flat = [member for member in found.found.structures.members if member.kind == "flat"]
    assert [len(member.faces) for member in flat] == [2]


def test_a_plate_seen_from_both_sides_has_two_faces() -> None:
    sides = [Plate((-0.5, 3, 1), (1, 0, 0), (0, 0, 1)), Plate((-0.5, 3.012, 1), (1, 0, 0), (0, 0, 1))]
    stations = np.array([[0.0, 0.0, 1.5], [0.0, 6.0, 1.5]])
    front = scan(sides, stations[:1], step=0.003, window=(-0.3, 0.3, -0.3, 0.3))
    back = scan(sides, stations[1:], step=0.003, window=(np.pi - 0.3, np.pi + 0.3, -0.3, 0.3))
    both = Seen(
        *(np.concatenate([getattr(s, n) for s in (front, back)]) for n in ("xyz", "surface", "scan", "range_m", "cosine"))
    )
    both.scan[len(front.xyz) :] = 1
    found = find(both, *levels(both, [], np.array([30.0, 30.0])), stations=stations)
    assert len(found.found.structures.faces) == 2
    assert all(len(np.unique(both.surface[found.face == number])) == 1 for number in (1, 2))


def test_materials_are_parted_and_stains_are_not() -> None:
    rng = np.random.default_rng(4)
    value = rng.normal(0, 0.4, (150, 200))
    held = rng.random((150, 200)) < 0.9
    two = value + 2.0 * (np.arange(200) >= 120)
    parts = part_by_material([np.where(held, two, np.nan)], 0.01)
    assert (parts == (np.arange(200) >= 120)[None, :]).mean() > 0.99 or (parts == (np.arange(200) < 120)[None, :]).mean() > 0.99
    row, column = np.mgrid[:150, :200]
    stained = value - 3.0 * (np.hypot(row - 60, column - 90) < 40)
    assert not part_by_material([np.where(held, stained, np.nan)], 0.01).any()


def test_all_scans_say_where_a_material_ends_and_whether_it_does() -> None:
    rng = np.random.default_rng(5)
    noise = rng.normal(0, 0.4, (3, 150, 200))
    column = np.arange(200)
    two = noise + 2.0 * (column >= 120)
    gap = np.where((column > 105) & (column < 140), np.nan, two[0])  # sees most of both materials, and not the line between
    parts = part_by_material([gap, np.where(np.arange(150)[:, None] < 80, np.nan, two[1])], 0.01)
    assert np.unique(parts[:, :120]).size == np.unique(parts[:, 120:]).size == 1
    assert parts[0, 119] != parts[0, 120]
    stain = noise - 2.0 * ((column >= 120) & (np.arange(150)[:, None] < 60))
    few = np.where(np.arange(150)[:, None] < 55, stain[0], np.nan)  # sees nothing but what the stain ends on
    assert part_by_material([few], 0.01).any()
    assert not part_by_material([few, stain[1], stain[2]], 0.01).any()


def test_rust_that_hides_much_of_the_line_between_two_materials_does_not_keep_them_together() -> None:
    row, column = np.mgrid[:150, :200]
    value = np.random.default_rng(6).normal(0, 0.4, row.shape) + 3.0 * (column >= 120)
    value -= 2.8 * ((column >= 120) & (np.hypot(row - 75, (column - 120) * 1.5) < 45))
    parts = part_by_material([value], 0.01)
    assert np.unique(parts[:, :120]).size == np.unique(parts[:, 120:]).size == 1
    assert parts[0, 119] != parts[0, 120]
    alone = value - 3.0 * (column >= 120)  # the rust by itself, straight on one side: half of a disc
    assert not part_by_material([alone], 0.01).any()
