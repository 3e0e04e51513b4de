"""Classes of the pixels of a kilometre, from its offset image and the stored results of stage ``ground``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import psycopg

from tunneldb.arrays import Float, Intp, UInt8
from tunneldb.classification.classes import PointClass
from tunneldb.export.images.palette import PALETTES
from tunneldb.geometry.surface import Surface
from tunneldb.raster.geotiff import Raster
from tunneldb.store.scene import load_scene
from tunneldb.store.survey import Survey

NO_CLASS = PALETTES["class"].nodata
"""Value of a pixel without a class."""

SEAM = 1e-3
"""Minimum distance of points from the ends of a section, m."""

CHUNK = 1_000_000
"""Number of pixels classified at a time: some 150 bytes each."""


@dataclass(frozen=True)
class ClassPainter:
    """Gives a pixel the class that a point in its middle, at its mean offset, has in an exported file.

    Attributes
    ----------
    surface : Surface
        The tunnel.
    classes : callable
        Classes (n,) of points (n, 3), m.
    """

    surface: Surface
    classes: Callable[[Float], UInt8]

    @classmethod
    def load(cls, conn: psycopg.Connection, survey: Survey, km: int) -> ClassPainter | None:
        """Load the stored results of a kilometre; None if stage ``ground`` found nothing there, or stages have not run."""
        held = conn.execute(
            "SELECT EXISTS (SELECT FROM tunnel.section WHERE survey_id = %(survey)s AND km = %(km)s)"
            " AND (EXISTS (SELECT FROM tunnel.lining WHERE survey_id = %(survey)s AND km = %(km)s)"
            " OR EXISTS (SELECT FROM tunnel.ground WHERE survey_id = %(survey)s AND km = %(km)s))",
            {"survey": survey.id, "km": km},
        ).fetchone()
        if held is None or not held[0]:
            return None
        scene = load_scene(conn, survey, km, km)
        assert scene.surface is not None
        return cls(scene.surface, scene.classes)

    def paint(self, offset: Raster) -> UInt8:
        """Return the class of each pixel of an offset image (rows, columns), NO_CLASS without a point."""
        classes = np.full(offset.values.shape, NO_CLASS, np.uint8)
        rows, columns = np.nonzero(np.isfinite(offset.values))
        for first in range(0, len(rows), CHUNK):
            row, column = rows[first : first + CHUNK], columns[first : first + CHUNK]
            classes[row, column] = self._classes(offset, row, column)
        return classes

    def _classes(self, offset: Raster, row: Intp, column: Intp) -> UInt8:
        """Return the class of pixels (n,) with points."""
        place = offset.transform
        chainage = np.asarray(place.c + (column + 0.5) * place.a, dtype=np.float64)
        arc = np.asarray(place.f + (row + 0.5) * place.e, dtype=np.float64)
        # The last pixel before the seam straight below the axis may reach beyond it by a part of itself.
        at, arcs = self.surface.chainages, self.surface.arcs
        arc = np.clip(arc, np.interp(chainage, at, arcs[:, 0]) + SEAM, np.interp(chainage, at, arcs[:, -1]) - SEAM)
        points = self.surface.to_space(chainage, arc, offset.values[row, column].astype(np.float64))
        held = np.isfinite(points[:, 0])
        classes = np.full(len(row), PointClass.UNASSIGNED, np.uint8)
        classes[held] = self.classes(points[held])
        return classes
