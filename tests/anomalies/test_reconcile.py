"""Matching of findings with those of an earlier run, and the fate of the others, without a database."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence

import numpy as np
import pytest
from shapely.geometry import Polygon, box

from tunneldb.anomalies.features import NAMES
from tunneldb.anomalies.reconcile import Boundary, gather_boundary, reconcile
from tunneldb.anomalies.records import Anomaly, BoundaryRegion, EarlierFinding
from tunneldb.anomalies.regions import Region, RegionProperties
from tunneldb.anomalies.verdict import Verdict

KM = 13
NOTHING = Boundary(KM, [], set(), KM - 1, KM + 1, [])


def anomaly(outline: Polygon, kind: str = "leak") -> Anomaly:
    verdict = Verdict(kind, (), 0.9, {}, np.zeros(len(NAMES)), 1.0, "test")  # type: ignore[arg-type]
    return Anomaly(outline, 3.0, 4.0, 3.5, 1.0, verdict)


def earlier(key: int, outline: Polygon, km: int = KM, *, reviewed: bool = False, dry: bool = False) -> EarlierFinding:
    return EarlierFinding(key, km, reviewed, True, dry, outline)


def region(first: int, last: int, row: int = 0, pixel: float = 0.5) -> Region:
    mask = np.ones((2, last - first), bool)
    return Region(pixel, first, row, mask, mask.size, 1.0, 1.0, RegionProperties())


def gather(km: int, parts: Sequence[BoundaryRegion], replaced: Sequence[int] = ()) -> Boundary:
    def read(kms: Iterable[int]) -> list[BoundaryRegion]:
        wanted = set(kms)
        return [part for part in parts if part.km in wanted]

    return gather_boundary(km, read, replaced)


def test_what_overlaps_is_updated_and_what_is_new_inserted() -> None:
    moved, fresh = box(13_010.1, 0, 13_011.1, 1), box(13_020, 0, 13_021, 1)
    changes = reconcile([anomaly(fresh), anomaly(moved)], [], NOTHING, [earlier(7, box(13_010, 0, 13_011, 1))])
    assert (changes.insert, changes.update, changes.keep, changes.delete) == ([0], {1: 7}, [], [])
    assert (changes.summary.new, changes.summary.again) == (1, 1)


def test_another_kind_is_the_same_finding() -> None:
    place = box(13_010, 0, 13_011, 1)
    changes = reconcile([anomaly(place, "joint")], [], NOTHING, [earlier(7, place)])
    assert changes.update == {0: 7}
    assert (changes.summary.new, changes.summary.again, changes.summary.kinds) == (0, 0, {"joint": 1})


def test_of_what_is_gone_the_reviewed_is_kept_and_the_dry_left_alone() -> None:
    places = [box(13_010 + 5 * k, 0, 13_011 + 5 * k, 1) for k in range(3)]
    before = [earlier(1, places[0]), earlier(2, places[1], reviewed=True), earlier(3, places[2], dry=True)]
    changes = reconcile([], [], NOTHING, before)
    assert (changes.keep, changes.delete) == ([2], [1])
    assert (changes.summary.kept, changes.summary.gone) == (1, 1)


def test_what_a_neighbour_lost_before_comes_back_or_stays() -> None:
    lost = earlier(4, box(12_990, 0, 12_991, 1), km=12)
    assert reconcile([], [], NOTHING, [lost]).delete == []
    assert reconcile([anomaly(lost.outline)], [], NOTHING, [lost]).update == {0: 4}


def test_of_two_halves_the_reviewed_one_is_the_whole() -> None:
    parts = [BoundaryRegion(1, 12, 10, region(25_990, 26_000)), BoundaryRegion(2, 13, None, region(26_000, 26_010))]
    boundary = gather(KM, parts, [11])
    assert boundary.findings == {10, 11}
    halves = [earlier(10, box(12_995, 0, 13_000, 1), km=12), earlier(11, box(13_000, 0, 13_005, 1), reviewed=True)]
    changes = reconcile([], [anomaly(box(12_995, 0, 13_005, 1))], boundary, halves)
    assert (changes.update, changes.keep, changes.delete) == ({0: 11}, [], [10])
    assert changes.summary.over_ends == 1


def test_a_cluster_that_is_nothing_counts_for_nothing() -> None:
    boundary = gather(KM, [BoundaryRegion(1, 13, 5, region(26_000, 26_010))])
    changes = reconcile([anomaly(box(13_020, 0, 13_021, 1))], [None], boundary, [earlier(5, box(13_000, 0, 13_005, 1))])
    assert (changes.insert, changes.update, changes.delete) == ([0], {}, [5])


@pytest.mark.parametrize("order", list(itertools.permutations(range(4))))
def test_a_boundary_reaches_as_far_as_its_regions_do(order: tuple[int, ...]) -> None:
    parts = [
        BoundaryRegion(1, 12, None, region(25_990, 26_000)),
        BoundaryRegion(2, 13, None, region(26_000, 28_000)),
        BoundaryRegion(3, 14, 9, region(28_000, 30_000)),
        BoundaryRegion(4, 15, None, region(30_000, 30_010)),
    ]
    boundary = gather(12, [parts[k] for k in order])
    (cluster,) = boundary.clusters
    assert (cluster.region.column, cluster.region.stop, cluster.crosses) == (25_990, 30_010, True)
    assert (boundary.first, boundary.last, boundary.findings) == (11, 15, {9})


def test_neighbours_with_other_pixels_are_named() -> None:
    parts = [BoundaryRegion(1, 13, None, region(26_000, 26_010)), BoundaryRegion(2, 12, None, region(51_990, 52_000, 0, 0.25))]
    boundary = gather(KM, parts)
    assert boundary.other_pixels == [12]
    assert len(boundary.clusters) == 2
