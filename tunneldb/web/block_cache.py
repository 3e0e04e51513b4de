"""Cache of decoded image blocks."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Hashable

from tunneldb.export.images.tile_png import Stretch
from tunneldb.raster.geotiff import Raster

MAX_BYTES = 64 * 2**20
"""Maximum size of the kept images, bytes."""


LOADERS = 2
"""Number of requests that decode images at once."""


class BlockCache:
    """Images by key; those not used longest are dropped first.

    Parameters
    ----------
    max_bytes : int
        Maximum size of all.
    """

    def __init__(self, max_bytes: int = MAX_BYTES) -> None:
        self._max_bytes = max_bytes
        self._lock = threading.Lock()
        self._images: OrderedDict[Hashable, Raster] = OrderedDict()
        self._bytes = 0
        self.loading = threading.Semaphore(LOADERS)
        """Bounds the images that are decoded at once, and so the memory for it."""
        self.stretches: dict[str, Stretch] = {}
        """Colours of the images of surveys, by the tag of these."""

    def find(self, key: Hashable) -> Raster | None:
        """Return the image of a key; None if it is not kept."""
        with self._lock:
            image = self._images.get(key)
            if image is not None:
                self._images.move_to_end(key)
            return image

    def keep(self, key: Hashable, image: Raster) -> None:
        """Keep an image."""
        with self._lock:
            former = self._images.pop(key, None)
            self._bytes += image.values.nbytes - (former.values.nbytes if former is not None else 0)
            self._images[key] = image
            while self._bytes > self._max_bytes and len(self._images) > 1:
                _, dropped = self._images.popitem(last=False)
                self._bytes -= dropped.values.nbytes
