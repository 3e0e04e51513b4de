"""A stretch of lining as images at one resolution, with its truth: what the network is trained and measured on."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

NONE = -32768
"""Of the level: no point."""

DRY, WET, LIMIT, OTHER = 0, 1, 2, 3
"""Values of labels: dry lining; leaks; leaks that can't be told from the intensity; what is dark but dry, or bright."""


@dataclass(frozen=True)
class Sample:
    """Images (rows, columns), the first row at the greatest arc.

    Attributes
    ----------
    state : uint8 array
        Values of :class:`tunneldb.raster.state.PixelState`.
    level : int16 array
        Corrected intensity, 0.01 dB.
    label : uint8 array
        DRY, WET, LIMIT or OTHER.
    pixel, west : float
        Side of a pixel and chainage of the first column, m.
    bottom : int
        Arc of the lower edge of the last row, pixels.
    """

    state: NDArray[np.uint8]
    level: NDArray[np.int16]
    label: NDArray[np.uint8]
    pixel: float
    west: float
    bottom: int

    def save(self, path: Path) -> None:
        part = path.with_name(path.name + ".part.npz")
        np.savez_compressed(part, **self.__dict__)
        part.replace(path)

    @classmethod
    def load(cls, path: Path) -> Sample:
        with np.load(path) as f:
            images = (f[name] for name in ("state", "level", "label"))
            return cls(*images, float(f["pixel"]), float(f["west"]), int(f["bottom"]))
