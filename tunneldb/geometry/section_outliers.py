"""Sections that deviate from neighbouring ones, because they were measured in a niche or on fixtures on the wall."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from tunneldb.arrays import Bool, Float, Single
from tunneldb.geometry.surface import Surface

MAX_GIRTH_SHARE = 0.4
"""Share of a section's girth above which a deviation may be a real change of the tunnel's shape."""

MIN_BEND = 0.03
"""Deviation of the surface from the wall, within a few degrees, above which it bends, m."""


@dataclass(frozen=True)
class SectionOutliers:
    """Deviations of the surface from the wall, where a section was measured in a niche or on fixtures on the wall.

    Such a section deviates from neighbouring ones, and around it the surface deviates from the wall in the same way.

    Attributes
    ----------
    surface : Surface
        Surface of the tunnel.
    deviation : (k, 361) float array
        Deviation of each section from neighbouring ones, m, positive outwards, at each whole degree; 0 where it is on the
        wall.
    """

    surface: Surface
    deviation: Float

    @classmethod
    def of(cls, surface: Surface, max_girth_share: float = 1.0) -> SectionOutliers:
        """Find the sections that deviate from neighbouring ones (:meth:`Surface.section_outliers`).

        Sections that deviate over a larger share of their girth than ``max_girth_share`` (0 to 1) are ignored. On simulated
        tunnels this matters only between 0.4 and 0.5: a section that is wider or narrower over at least half of its girth has
        no deviation at all. MAX_GIRTH_SHARE finds more lining where one side of the tunnel is wider for a few metres, and 1
        prevents the back of a niche of that size from being classified as lining.
        """
        deviation = surface.section_outliers()
        deviation[(deviation != 0.0).mean(axis=1) > max_girth_share] = 0.0
        return cls(surface, deviation)

    def offset(self, chainage: Float, arc: Float) -> Float:
        """Return the offset of the wall from the surface, m; (rows,) arcs by (columns,) chainages."""
        out = np.zeros((len(arc), len(chainage)))
        for column, nodes, deviation in self._columns(chainage):
            out[:, column] = np.interp(arc, nodes, deviation)
        return out

    def offset_and_bends(self, chainage: Float, arc: Float) -> tuple[Single, Bool] | None:
        """Return offset (m) and bends of the wall relative to the surface, (rows,) arcs by (columns,) chainages; None if none.

        At bends, on the edges of the niche, the surface's normals differ from those of the wall.
        """
        columns = list(self._columns(chainage))
        if not columns:
            return None
        offset, bent = np.zeros((len(arc), len(chainage)), np.float32), np.zeros((len(arc), len(chainage)), np.bool_)
        for column, nodes, deviation in columns:
            bend = ndimage.maximum_filter1d(deviation, 7) - ndimage.minimum_filter1d(deviation, 7)
            offset[:, column] = np.interp(arc, nodes, deviation)
            bent[:, column] = np.interp(arc, nodes, bend) > MIN_BEND
        return offset, bent

    def _columns(self, chainage: Float) -> Iterator[tuple[int, Float, Float]]:
        """Yield indices of chainages near deviating sections, the arcs of the section's nodes there, and their deviations."""
        at = self.surface.chainages
        if len(at) < 2 or not self.deviation.any():
            return
        after = np.clip(np.searchsorted(at, chainage, side="right"), 1, len(at) - 1)
        share = np.clip((chainage - at[after - 1]) / (at[after] - at[after - 1]), 0.0, 1.0)
        near = np.asarray(self.deviation.any(axis=1))
        for column in np.flatnonzero(near[after] | near[after - 1]).tolist():
            a, b, g = after[column] - 1, after[column], share[column]
            nodes = (1 - g) * self.surface.arcs[a] + g * self.surface.arcs[b]
            yield column, nodes, (1 - g) * self.deviation[a] + g * self.deviation[b]
