"""Profiles from points of vertical intersection."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tunneldb.alignment.elements import ProfileElement, ProfileKind
from tunneldb.errors import InputError

_OVERLAP = 0.001  # m by which rounded files let two curves overlap


@dataclass(frozen=True)
class Pvi:
    """Point where two grades meet, with its rounding: parabolas, or a circle if ``radius`` is not 0.

    Attributes
    ----------
    distance, z : float
        Distance in plan from the start of the alignment, and height, m.
    before, after : float
        Length in plan of the parabola before and after the point, m.
    radius : float
        Radius of the circle, m.
    """

    distance: float
    z: float
    before: float = 0.0
    after: float = 0.0
    radius: float = 0.0


def profile_elements(pvis: Sequence[Pvi], path: Path) -> tuple[ProfileElement, ...]:
    """Return the elements of the profile through points of vertical intersection; the first and the last are its ends.

    Raises
    ------
    InputError
        If there are fewer than two, they are not in order, or their curves overlap.
    """
    if len(pvis) < 2:
        raise InputError(f"{path}: a profile needs at least 2 points of vertical intersection, this one has {len(pvis)}")
    for low, high in itertools.pairwise(pvis):
        if high.distance <= low.distance:
            raise InputError(f"{path}: the profile reverses {high.distance:.3f} m from the start of its alignment")
    grades = [(high.z - low.z) / (high.distance - low.distance) for low, high in itertools.pairwise(pvis)]
    elements: list[ProfileElement] = []
    at, z = pvis[0].distance, pvis[0].z
    for pvi, grade, following in zip(pvis[1:], grades, [*grades[1:], None], strict=True):
        curve = [] if following is None else _curve(pvi, grade, following)
        begin = curve[0].distance if curve else pvi.distance
        if begin - at < -_OVERLAP:
            raise InputError(f"{path}: two curves of the profile overlap by {at - begin:.3f} m before {pvi.distance:.3f} m")
        if begin - at > 1e-6:
            elements.append(ProfileElement("grade", at, begin - at, z, grade, grade))
        elements += curve
        at, z = pvi.distance, pvi.z
        if curve:
            last = curve[-1]
            at = last.distance + last.length
            z = pvi.z + (at - pvi.distance) * (following or 0.0)
    return tuple(elements)


def _curve(pvi: Pvi, grade: float, following: float) -> list[ProfileElement]:
    """Return the rounding between two grades."""
    if grade == following:
        return []
    if pvi.radius:
        return [_circle(pvi, grade, following)]
    if pvi.before == 0.0 or pvi.after == 0.0:  # a parabola on one side only is a piece of its grade
        return []
    whole = pvi.before + pvi.after
    begin, z = pvi.distance - pvi.before, pvi.z - pvi.before * grade
    kind: ProfileKind = "parabola"
    if pvi.before == pvi.after:
        return [ProfileElement(kind, begin, whole, z, grade, following)]
    # Two parabolas with a common tangent above the point, parallel to the chord.
    middle = grade + (following - grade) * pvi.after / whole
    return [
        ProfileElement(kind, begin, pvi.before, z, grade, middle),
        ProfileElement(kind, pvi.distance, pvi.after, z + pvi.before * (grade + middle) / 2.0, middle, following),
    ]


def _circle(pvi: Pvi, grade: float, following: float) -> ProfileElement:
    low, high = math.atan(grade), math.atan(following)
    tangent = pvi.radius * math.tan(abs(high - low) / 2.0)
    before, after = tangent * math.cos(low), tangent * math.cos(high)
    return ProfileElement("circle", pvi.distance - before, before + after, pvi.z - before * grade, grade, following)
