"""The lining of a survey as patches about the given axis, block by block from the stored images."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
import psycopg

from tunneldb.arrays import Bool, Float
from tunneldb.geometry.alignment import Alignment
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.measures.deviation.compute import Design
from tunneldb.measures.deviation.measure import lining_by_class
from tunneldb.measures.rings.compute.patches import PATCH, Patches, average, join
from tunneldb.raster.geotiff import Raster
from tunneldb.raster.grid import BLOCK
from tunneldb.raster.state import shows_lining
from tunneldb.store.images import load_kinds
from tunneldb.store.surface import load_surface
from tunneldb.store.survey import Survey

_RING_MARGIN = 100.0
"""Maximum length by which rings extend over a kilometre's ends, m."""

_CACHED_BLOCKS = 4  # blocks


class LiningPatches:
    """Patches of a kilometre and its surroundings; few blocks are in memory at a time.

    Parameters
    ----------
    conn, survey, km
        Place.
    axis : Alignment
        The given one.
    """

    def __init__(self, conn: psycopg.Connection[Any], survey: Survey, km: int, axis: Alignment) -> None:
        self.conn, self.survey = conn, survey
        surface = load_surface(conn, survey, km * KILOMETRE - _RING_MARGIN, (km + 1) * KILOMETRE + _RING_MARGIN)
        self.surface, self._axis, self._design = surface, axis, Design(surface, axis, ())
        self._classes: dict[int, Callable[[Raster], Bool]] = {}
        self._block = lru_cache(_CACHED_BLOCKS)(self._load)

    def between(self, low: float, high: float) -> Patches | None:
        """Return the patches between two chainages, m; None without an image."""
        blocks = range(int(np.floor(low / BLOCK)), int(np.floor(high / BLOCK)) + 1)
        parts = [part.between(low, high) for part in map(self._block, blocks) if part is not None]
        parts = [part for part in parts if len(part.chainage)]
        return join(parts) if parts else None

    def girth(self, chainage: float) -> float:
        """Return the length of the section at a chainage, m; 0 without one."""
        low, high = self.surface.arc_range(np.array([chainage]))
        return float(np.nan_to_num(high[0] - low[0]))

    def in_space(self, chainage: float, right: float, up: float) -> Float:
        """Return a point (3,) in the tunnel's SRID, m, from its chainage and place about the given axis, m; NaN beyond it."""
        along = self._axis.across(self.surface.frames(np.array([chainage]))[:, 0])[:, 0]
        return self._axis.in_space(np.array([[along[0], right, up]]))[0] if np.isfinite(along[0]) else np.full(3, np.nan)

    def _load(self, block: int) -> Patches | None:
        images = load_images(self.conn, self.survey, block, ("offset", "state"))
        if "offset" not in images:
            return None
        offset = images["offset"]
        lining = self._lining(block, images)
        chainage, arc = offset.places()
        side = max(round(PATCH / offset.transform.a), 1) * offset.transform.a
        values = np.where(lining, offset.values, np.float32(np.nan))
        at, along, mean = average(values, chainage, arc, side)
        _, right, up = self._design.places(at, along, Raster(mean, offset.transform))
        return Patches(at, along, right, up)

    def _lining(self, block: int, images: dict[str, Raster]) -> Bool:
        if "state" in images:
            return shows_lining(images["state"].values)
        km = int(block * BLOCK // KILOMETRE)
        if km not in self._classes:
            self._classes[km] = lining_by_class(self.conn, self.survey, km, self.surface)
        return self._classes[km](images["offset"])


def load_images(conn: psycopg.Connection[Any], survey: Survey, block: int, kinds: tuple[str, ...]) -> dict[str, Raster]:
    """Load the images of a block by kind, of those that are stored."""
    return load_kinds(conn, survey, int(block * BLOCK // KILOMETRE), block, kinds)
