"""Design alignment: its elements, its stationing, and the resulting line."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tunneldb.alignment.elements import PlanElement, ProfileElement
from tunneldb.arrays import Float
from tunneldb.errors import InputError

CHORD_ERROR = 0.0005  # m; half of the documented error, for lines that bend in plan and in profile
MAX_STEP = 1.0  # m; the spline through the vertices needs even steps between line and arc
GAP = 0.01  # m between the end of an element and the start of the next; files are rounded to millimetres
MIN_RADIUS = 1.0  # m; smaller than any radius of a tunnel, in plan or profile
MAX_LENGTH = 1e6  # m, of an axis or of one curve of it
MAX_SHORTFALL = 0.1  # m by which a profile may be shorter than the plan before the alignment ends with it


@dataclass(frozen=True)
class StationPiece:
    """Piece of stationing: from ``distance`` (m from the start of the alignment) on, ``station`` + ``direction`` × the rest."""

    distance: float
    station: float
    direction: int = 1


@dataclass(frozen=True)
class Design:
    """Design alignment.

    Attributes
    ----------
    name : str
        Name in the file; may be empty.
    plan, profile : tuple of elements
        Elements in order along the alignment.
    start : float
        Chainage of its start, m.
    pieces : tuple of StationPiece
        Its own stationing, from the start on, if it differs from the chainage; else empty.
    notes : tuple of str
        Notes for the user about the import.
    """

    name: str
    plan: tuple[PlanElement, ...]
    profile: tuple[ProfileElement, ...]
    start: float = 0.0
    pieces: tuple[StationPiece, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def distances(self) -> Float:
        """Distances of the starts of the elements in plan, and of the end of the last one, (n + 1,), m."""
        return np.concatenate([[0.0], np.cumsum([element.length for element in self.plan])])

    @property
    def reach(self) -> tuple[float, float]:
        """Distances between which it has both plan and profile, m."""
        low, high = 0.0, float(self.distances[-1])
        first, last = self.profile[0].distance, self.profile[-1].distance + self.profile[-1].length
        return (first if first > low + MAX_SHORTFALL else low), (last if last < high - MAX_SHORTFALL else high)

    @property
    def chainages(self) -> tuple[float, float]:
        """First and last chainage of the axis, m."""
        low, high = self.reach
        return self.start + low, self.start + high

    def check(self) -> None:
        """Raise an InputError if elements don't join, or plan and profile have no common stretch, or one too long."""
        for number, (before, after) in enumerate(zip(self.plan, self.plan[1:], strict=False), start=1):
            gap = float(np.hypot(*(before.end - (after.x, after.y))))
            if gap > GAP:
                raise InputError(
                    f"{before.kind} {number} of the plan ends {gap:.3f} m from the start of {after.kind} {number + 1}, "
                    f"at {self.start + self.distances[number]:.3f} m; the file is damaged, or incomplete"
                )
        for number, (low, high) in enumerate(zip(self.profile, self.profile[1:], strict=False), start=1):
            gap = abs(high.distance - low.distance - low.length)
            step = abs(float(low.height(np.array([high.distance]))[0]) - high.z)
            if max(gap, step) > GAP:
                raise InputError(
                    f"{low.kind} {number} of the profile does not meet {high.kind} {number + 1} "
                    f"at {self.start + high.distance:.3f} m: gap {gap:.3f} m, step {step:.3f} m"
                )
        if not self._bending() <= 1.0 / MIN_RADIUS:
            raise InputError(
                f"plan or profile has an arc with a radius under {MIN_RADIUS:g} m; the file is damaged, or in another unit"
            )
        low_end, high_end = self.reach
        if high_end - low_end < MAX_STEP:
            raise InputError("plan and profile have no common stretch; is the profile from another alignment?")
        if not high_end - low_end <= MAX_LENGTH:
            raise InputError(
                f"the alignment is {(high_end - low_end) / 1000.0:.4g} km long, as no tunnel is; the file is damaged, or in"
                " another unit"
            )

    def _bending(self) -> float:
        """Return the greatest combined curvature of plan and profile, 1/m."""
        bend = max(max(abs(e.curvature_from), abs(e.curvature_to)) for e in self.plan)
        return bend + max(abs(e.grade_to - e.grade_from) / e.length for e in self.profile)

    def position(self, distance: Float) -> Float:
        """Return points (n, 3) at distances (n,) in plan from the start, m; extrapolated beyond the ends."""
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
        """Return heights (n,) at distances (n,); extrapolated beyond the profile's ends with its grade."""
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
        """Return vertices (n, 3) on the axis at an even step, m; no chord deviates from it by 1 mm.

        The step is at most 1 m: a spline through distant vertices on a straight would oscillate at the start of an arc.
        """
        low, high = self.reach
        step = min(MAX_STEP, np.sqrt(8.0 * CHORD_ERROR / max(self._bending(), 1e-9)))
        return self.position(np.linspace(low, high, int(np.ceil((high - low) / step)) + 1))

    def renumbered(self, start: float | None) -> Design:
        """Return the same alignment with another chainage at its start; its own stations stay in place."""
        if start is None or start == self.start:
            return self
        return replace(self, start=start)
