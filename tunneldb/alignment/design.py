"""A design alignment: its elements, its stationing, and the line that they make."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tunneldb.alignment.elements import PlanElement, ProfileElement
from tunneldb.arrays import Float
from tunneldb.errors import InputError

CHORD_ERROR = 0.0005  # m; half of what is promised, for lines that bend in plan and in profile at once
LONGEST_STEP = 1.0  # m; the spline through the vertices needs even steps where a line meets an arc
GAP = 0.01  # m between the end of an element and the beginning of the next; files are rounded to millimetres
LEAST_RADIUS = 1.0  # m; no tunnel bends so, in plan or profile
SHORT_END = 0.1  # m by which a profile may be shorter than the plan before the alignment ends with it


@dataclass(frozen=True)
class StationPiece:
    """From ``distance`` (m from the beginning of the alignment) on the station is ``station`` + ``direction`` × the rest."""

    distance: float
    station: float
    direction: int = 1


@dataclass(frozen=True)
class Design:
    """A design alignment.

    Attributes
    ----------
    name : str
        Name in the file; may be empty.
    plan, profile : tuple of elements
        In order along the alignment.
    start : float
        Chainage of its beginning, m.
    pieces : tuple of StationPiece
        Its own stationing where that is not the chainage, from the beginning on; else empty.
    notes : tuple of str
        What the user should know about the reading.
    """

    name: str
    plan: tuple[PlanElement, ...]
    profile: tuple[ProfileElement, ...]
    start: float = 0.0
    pieces: tuple[StationPiece, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def distances(self) -> Float:
        """Distances at which the elements in plan begin, and the last one ends, (n + 1,), m."""
        return np.concatenate([[0.0], np.cumsum([element.length for element in self.plan])])

    @property
    def reach(self) -> tuple[float, float]:
        """Distances between which there is both plan and profile, m."""
        low, high = 0.0, float(self.distances[-1])
        first, last = self.profile[0].distance, self.profile[-1].distance + self.profile[-1].length
        return (first if first > low + SHORT_END else low), (last if last < high - SHORT_END else high)

    @property
    def chainages(self) -> tuple[float, float]:
        """Chainages between which the axis runs, m."""
        low, high = self.reach
        return self.start + low, self.start + high

    def check(self) -> None:
        """Raise InputError where an element does not begin where the one before it ends, or plan and profile don't meet."""
        for number, (before, after) in enumerate(zip(self.plan, self.plan[1:], strict=False), start=1):
            gap = float(np.hypot(*(before.end - (after.x, after.y))))
            if gap > GAP:
                raise InputError(
                    f"{before.kind} {number} of the plan ends {gap:.3f} m from where {after.kind} {number + 1} begins, "
                    f"at {self.start + self.distances[number]:.3f} m: the file is damaged, or not all of it was exported"
                )
        for number, (low, high) in enumerate(zip(self.profile, self.profile[1:], strict=False), start=1):
            gap = abs(high.distance - low.distance - low.length)
            step = abs(float(low.height(np.array([high.distance]))[0]) - high.z)
            if max(gap, step) > GAP:
                raise InputError(
                    f"{low.kind} {number} of the profile does not meet {high.kind} {number + 1} "
                    f"at {self.start + high.distance:.3f} m: {gap:.3f} m apart, a step of {step:.3f} m"
                )
        if not self._bending() <= 1.0 / LEAST_RADIUS:
            raise InputError(
                f"plan or profile has an arc of less than {LEAST_RADIUS:g} m: the file is damaged, or not in its unit"
            )
        low_end, high_end = self.reach
        if high_end - low_end < LONGEST_STEP:
            raise InputError("plan and profile have no stretch in common: is the profile that of another alignment?")

    def _bending(self) -> float:
        """Greatest curvature of the plan and of the profile together, 1/m."""
        bend = max(max(abs(e.curvature_from), abs(e.curvature_to)) for e in self.plan)
        return bend + max(abs(e.grade_to - e.grade_from) / e.length for e in self.profile)

    def position(self, distance: Float) -> Float:
        """Points (n, 3) at distances (n,) in plan from the beginning, m; beyond the ends on the continuation."""
        distance = np.asarray(distance, dtype=np.float64)
        result = np.empty((len(distance), 3))
        begins = self.distances
        which = np.clip(np.searchsorted(begins, distance, side="right") - 1, 0, len(self.plan) - 1)
        for number in np.unique(which):
            rows = which == number
            result[rows, :2] = self.plan[number].position(distance[rows] - begins[number])
        result[:, 2] = self.height(distance)
        return result

    def height(self, distance: Float) -> Float:
        """Heights (n,) at distances (n,); beyond the profile's ends its grade goes on."""
        begins = np.array([element.distance for element in self.profile])
        which = np.clip(np.searchsorted(begins, distance, side="right") - 1, 0, len(begins) - 1)
        first, last = begins[0], begins[-1] + self.profile[-1].length
        inside = np.clip(distance, first, last)
        height = np.empty(len(distance))
        for number in np.unique(which):
            rows = which == number
            height[rows] = self.profile[number].height(inside[rows])
        grade = np.where(distance < first, self.profile[0].grade_from, self.profile[-1].grade_to)
        return height + grade * (distance - inside)

    def polyline(self) -> Float:
        """Vertices (n, 3) on the axis at an even step, m; no chord departs from it by a millimetre.

        The step is at most a metre: a spline through vertices far apart on a straight would swing where the arc begins.
        """
        low, high = self.reach
        step = min(LONGEST_STEP, np.sqrt(8.0 * CHORD_ERROR / max(self._bending(), 1e-9)))
        return self.position(np.linspace(low, high, int(np.ceil((high - low) / step)) + 1))

    def renumbered(self, start: float | None) -> Design:
        """Return the same alignment with another chainage at its beginning; its own stations stay where they were."""
        if start is None or start == self.start:
            return self
        return replace(self, start=start)
