"""Sections that stand apart from those beside them, because they were measured in a niche or on something hung on the wall."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from tunneldb.arrays import Bool, Float, Single
from tunneldb.geometry.surface import Surface

MOST = 0.4
"""Where a larger part of a section does, it is the tunnel that has another shape."""

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
    def of(cls, surface: Surface) -> SectionOutliers:
        """Take the sections that stand apart from those beside them (:meth:`Surface.section_outliers`)."""
        apart = surface.section_outliers()
        # A tunnel that is wider or narrower all round has no niche.
        apart[(apart != 0.0).mean(axis=1) > MOST] = 0.0
        return cls(surface, apart)

    def level(self, chainage: Float, arc: Float) -> tuple[Single, Bool] | None:
        """Offset of the wall from the surface, m, and where it bends; (rows,) arcs by (columns,) chainages; None: nowhere.

        Where it bends, at the edges of the niche, the surface's normals are not those of the wall.
        """
        at = self.surface.chainages
        if len(at) < 2 or not self.apart.any():
            return None
        after = np.clip(np.searchsorted(at, chainage, side="right"), 1, len(at) - 1)
        columns = np.flatnonzero(self.apart[after].any(axis=1) | self.apart[after - 1].any(axis=1))
        if not len(columns):
            return None
        share = np.clip((chainage - at[after - 1]) / (at[after] - at[after - 1]), 0.0, 1.0)
        level, bent = np.zeros((len(arc), len(chainage)), np.float32), np.zeros((len(arc), len(chainage)), np.bool_)
        for column in columns.tolist():
            a, b, g = after[column] - 1, after[column], share[column]
            nodes = (1 - g) * self.surface.arcs[a] + g * self.surface.arcs[b]
            apart = (1 - g) * self.apart[a] + g * self.apart[b]
            bend = ndimage.maximum_filter1d(apart, 7) - ndimage.minimum_filter1d(apart, 7)
            level[:, column] = np.interp(arc, nodes, apart)
            bent[:, column] = np.interp(arc, nodes, bend) > OFF_WALL
        return level, bent


@dataclass(frozen=True)
class OutlierOffsets:
    """Where the surface left the lining, because a section was measured in a niche or on something hung on the wall.

    Attributes
    ----------
    surface : Surface
        The tunnel.
    apart : (k, 361) float array
        Offset of the lining from each section at each whole degree, m; 0 where the section is on it.
    """

    surface: Surface
    apart: Float

    @classmethod
    def of(cls, surface: Surface) -> OutlierOffsets:
        """Take the sections that stand apart from those beside them (:meth:`Surface.section_outliers`)."""
        return cls(surface, surface.section_outliers())

    def at(self, chainage: Float, arc: Float) -> Float:
        """Offset of the lining where the surface left it; (rows,) arcs by (columns,) chainages, m."""
        out = np.zeros((len(arc), len(chainage)))
        at = self.surface.chainages
        if len(at) < 2 or not self.apart.any():
            return out
        after = np.clip(np.searchsorted(at, chainage, side="right"), 1, len(at) - 1)
        share = np.clip((chainage - at[after - 1]) / (at[after] - at[after - 1]), 0.0, 1.0)
        for column in np.flatnonzero(self.apart[after].any(axis=1) | self.apart[after - 1].any(axis=1)):
            a, b, g = after[column] - 1, after[column], share[column]
            nodes = (1 - g) * self.surface.arcs[a] + g * self.surface.arcs[b]
            out[:, column] = np.interp(arc, nodes, (1 - g) * self.apart[a] + g * self.apart[b])
        return out
