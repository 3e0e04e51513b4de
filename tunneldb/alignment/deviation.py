"""Deviation of the measured axis from the given axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Bool, Float
from tunneldb.geometry.stationing import KILOMETRE, Stationing


@dataclass(frozen=True)
class Part:
    """Element of the design alignment, as in the view alignment_element: chainages and radii m, grades %."""

    plane: str
    kind: str
    turn: str | None
    chainage_from: float
    chainage_to: float
    label_from: str
    label_to: str
    radius_from: float | None
    radius_to: float | None
    grade_from: float | None
    grade_to: float | None

    @property
    def title(self) -> str:
        """Description for a table: ``arc, R 250 m left``."""
        if self.plane == "vertical":
            return self.kind if self.turn is None else f"{self.kind}, {self.turn}"
        radii = [radius for radius in (self.radius_from, self.radius_to) if radius is not None]
        if not radii:
            return self.kind
        written = " to ".join(f"{radius:.5g}" for radius in dict.fromkeys(radii))
        return f"{self.kind}, R {written} m {self.turn}"


@dataclass(frozen=True)
class Summary:
    """Deviation over a stretch; lengths in m, for vertices that were measured or edited.

    ``right_most`` and ``up_most`` are the greatest deviations, with their signs; NaN where no vertex was measured.
    """

    title: str
    label_from: str
    label_to: str
    vertices: int
    right_mean: float
    right_most: float
    up_mean: float
    up_most: float


@dataclass(frozen=True)
class Deviation:
    """Measured minus given axis, vertex by vertex.

    Attributes
    ----------
    survey : str
        Name of the survey.
    design : str or None
        File and alignment of the given axis.
    chainage, to_right, up : (n,) float arrays
        Chainage, deviation to the right looking up-chainage and upwards, m.
    label, source : tuple of str
        Station; measured, interpolated or edited.
    vertices : (n, 3) float array
        Measured vertices, tunnel's SRID, m.
    elements : tuple of Part
        Elements of the design, if any.
    stationing : Stationing
        Stationing of the tunnel.
    """

    survey: str
    design: str | None
    chainage: Float
    label: tuple[str, ...]
    source: tuple[str, ...]
    to_right: Float
    up: Float
    vertices: Float
    elements: tuple[Part, ...]
    stationing: Stationing

    @property
    def known(self) -> Bool:
        """True for vertices that were not interpolated from their neighbours."""
        return np.array(self.source) != "interpolated"

    def parts(self, plane: str) -> list[Part]:
        """Return the elements of a plane that have vertices."""
        low, high = self.chainage[0], self.chainage[-1]
        return [
            part for part in self.elements if part.plane == plane and part.chainage_to >= low and part.chainage_from <= high
        ]

    def summaries(self) -> list[Summary]:
        """Return summaries by element in plan, or by kilometre without a design; the last one is the total."""
        parts = self.parts("horizontal")
        if parts:
            ends = [(p.title, p.chainage_from, p.chainage_to, p.label_from, p.label_to) for p in parts]
        else:
            kilometres = np.unique(np.floor(self.chainage / KILOMETRE)) * KILOMETRE
            label = self.stationing.label
            ends = [("kilometre", k, k + KILOMETRE, label(k), label(k + KILOMETRE)) for k in kilometres.tolist()]
        rows = [self._summary(title, (self.chainage >= a) & (self.chainage < b), *labels) for title, a, b, *labels in ends]
        whole = self._summary("all", np.ones(len(self.chainage), bool), self.label[0], self.label[-1])
        return [row for row in rows if row.vertices] + [whole]

    def _summary(self, title: str, within: Bool, label_from: str, label_to: str) -> Summary:
        rows = within & self.known
        if not rows.any():
            return Summary(title, label_from, label_to, 0, *[float("nan")] * 4)
        right, up = self.to_right[rows], self.up[rows]
        return Summary(
            title,
            label_from,
            label_to,
            int(rows.sum()),
            float(right.mean()),
            float(right[np.argmax(np.abs(right))]),
            float(up.mean()),
            float(up[np.argmax(np.abs(up))]),
        )
