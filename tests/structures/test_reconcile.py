"""Matching of spots with those of earlier runs and surveys, and the numbers of the others, without a database."""

from __future__ import annotations

from dataclasses import replace

import shapely
from support.example_structures import example_structures

from tunneldb.structures.reconcile import reconcile_spots
from tunneldb.structures.records import EarlierSpot
from tunneldb.structures.results import Structures

FOUND = example_structures()


def earlier(index: int, key: int, number: int, *, reviewed: bool = False, kind: str | None = None) -> EarlierSpot:
    """A spot of the example, as an earlier run had found it."""
    spot = FOUND.spots[index]
    face = next(face for face in FOUND.faces if face.number == spot.face)
    vertices = shapely.get_coordinates(face.in_space(spot.outline), include_z=True)
    return EarlierSpot(key, number, kind or spot.kind, reviewed, vertices)  # type: ignore[arg-type]


def test_spots_found_again_are_updated_and_the_others_numbered_on() -> None:
    changes = reconcile_spots(FOUND, [earlier(1, 70, 5)], [])
    assert (changes.update, changes.insert) == ({1: 70}, {0: 6, 2: 7})


def test_a_spot_of_another_survey_gives_its_number_unless_it_is_taken() -> None:
    assert reconcile_spots(FOUND, [], [earlier(0, 70, 4)]).insert == {0: 4, 1: 5, 2: 6}
    changes = reconcile_spots(FOUND, [earlier(1, 71, 4)], [earlier(0, 70, 4)])
    assert (changes.update, changes.insert) == ({1: 71}, {0: 5, 2: 6})


def test_another_kind_or_another_place_is_another_spot() -> None:
    moved = replace(earlier(1, 71, 2), vertices=earlier(1, 71, 2).vertices + 0.2)
    changes = reconcile_spots(FOUND, [earlier(0, 70, 1, kind="bright"), moved], [])
    assert (changes.update, changes.delete) == ({}, [70, 71])


def test_of_spots_that_are_gone_the_reviewed_are_kept() -> None:
    nothing = Structures(FOUND.members, FOUND.faces, [])
    changes = reconcile_spots(nothing, [earlier(0, 70, 1, reviewed=True), earlier(1, 71, 2)], [])
    assert (changes.keep, changes.delete) == ([70], [71])
