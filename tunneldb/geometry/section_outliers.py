"""Sections that stand apart from those beside them, because they were measured in a niche or on something hung on the wall."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from tunneldb.arrays import Bool, Float, Single
from tunneldb.geometry.surface import Surface

MOST = 0.4
"""Where a larger share of a section's girth does, it may be the tunnel that has another shape."""

OFF_WALL = 0.03
"""Where the surface leaves the wall by more than this within a few degrees, it bends, m."""


@dataclass(frozen=True)
class SectionOutliers:
    """Where the surface leaves the wall, because a section was measured in a niche or on something hung on the wall.

    Such a section stands apart from those beside it, and between them the surface departs from the wall as it does from
    their course.

    Attributes
    ----------
    surface : Surface
        The tunnel.
    apart : (k, 361) float array
        How far each section stands apart from those beside it, m, outwards positive, at each whole degree; 0 where it is
        on the wall.
    """

    surface: Surface
    apart: Float

    @classmethod
    def of(cls, surface: Surface, most: float = 1.0) -> SectionOutliers:
        """Take the sections that stand apart from those beside them (:meth:`Surface.section_outliers`).

        Those that do over a larger share of their girth than ``most`` (0 to 1) are left out. On simulated tunnels that
        matters between 0.4 and 0.5 only: a section that is wider or narrower over half of its girth and more stands apart
        nowhere. There MOST finds more lining where one side of the tunnel is wider for a few metres, and 1 keeps the back of
        a niche as large from being taken for lining.
        """
        apart = surface.section_outliers()
        apart[(apart != 0.0).mean(axis=1) > most] = 0.0
        return cls(surface, apart)

    def offset(self, chainage: Float, arc: Float) -> Float:
        """Offset of the wall from the surface, m; (rows,) arcs by (columns,) chainages."""
        out = np.zeros((len(arc), len(chainage)))
        for column, nodes, apart in self._columns(chainage):
            out[:, column] = np.interp(arc, nodes, apart)
        return out

    def offset_and_bends(self, chainage: Float, arc: Float) -> tuple[Single, Bool] | None:
        """Offset of the wall from the surface, m, and where it bends; (rows,) arcs by (columns,) chainages; None: nowhere.

        Where it bends, at the edges of the niche, the surface's normals are not those of the wall.
        """
        columns = list(self._columns(chainage))
        if not columns:
            return None
        offset, bent = np.zeros((len(arc), len(chainage)), np.float32), np.zeros((len(arc), len(chainage)), np.bool_)
        for column, nodes, apart in columns:
            bend = ndimage.maximum_filter1d(apart, 7) - ndimage.minimum_filter1d(apart, 7)
            offset[:, column] = np.interp(arc, nodes, apart)
            bent[:, column] = np.interp(arc, nodes, bend) > OFF_WALL
        return offset, bent

    def _columns(self, chainage: Float) -> Iterator[tuple[int, Float, Float]]:
        """Places of chainages near sections that stand apart; arcs of the section's nodes there, and how far each is apart."""
        at = self.surface.chainages
        if len(at) < 2 or not self.apart.any():
            return
        after = np.clip(np.searchsorted(at, chainage, side="right"), 1, len(at) - 1)
        share = np.clip((chainage - at[after - 1]) / (at[after] - at[after - 1]), 0.0, 1.0)
        near = np.asarray(self.apart.any(axis=1))
        for column in np.flatnonzero(near[after] | near[after - 1]).tolist():
            a, b, g = after[column] - 1, after[column], share[column]
            nodes = (1 - g) * self.surface.arcs[a] + g * self.surface.arcs[b]
            yield column, nodes, (1 - g) * self.apart[a] + g * self.apart[b]
