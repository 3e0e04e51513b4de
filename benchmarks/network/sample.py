"""A stretch of lining as images at one resolution, with its truth: what the network is trained and measured on."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

NONE = -32768
"""Of offset, correction and level: no point."""

DRY, WET, LIMIT, OTHER = 0, 1, 2, 3
"""Values of labels: dry lining; leaks; leaks that can't be told from the intensity; what is dark but dry, or bright."""


@dataclass(frozen=True)
class Sample:
    """Images (rows, columns), the first row at the greatest arc.

    Attributes
    ----------
    state : uint8 array
        Values of :class:`tunneldb.raster.pixel_state.PixelState`.
    level : int16 array
        Corrected intensity, 0.01 dB.
    offset : int16 array
        Offset from the surface, mm.
    correction : int16 array
        Raw minus corrected intensity, 0.01 dB: what range and incidence took.
    weight : uint16 array
        Weight of the points of the pixel.
    label : uint8 array
        DRY, WET, LIMIT or OTHER.
    kind : uint8 array
        What is dark but dry, or bright: 1 + number in ``kinds``; 0 elsewhere.
    kinds : list of str
    pixel, west : float
        Side of a pixel and chainage of the first column, m.
    bottom : int
        Arc of the lower edge of the last row, pixels.
    """

    state: NDArray[np.uint8]
    level: NDArray[np.int16]
    offset: NDArray[np.int16]
    correction: NDArray[np.int16]
    weight: NDArray[np.uint16]
    label: NDArray[np.uint8]
    kind: NDArray[np.uint8]
    kinds: list[str]
    pixel: float
    west: float
    bottom: int

    def save(self, path: Path) -> None:
        values = {**self.__dict__, "kinds": np.array(self.kinds, dtype=np.str_)}
        part = path.with_name(path.name + ".part.npz")
        np.savez_compressed(part, **values)
        part.replace(path)

    @classmethod
    def load(cls, path: Path) -> Sample:
        with np.load(path) as f:
            values = {name: f[name] for name in f.files}
        single = {"pixel": float(values["pixel"]), "west": float(values["west"]), "bottom": int(values["bottom"])}
        return cls(**{**values, **single, "kinds": [str(kind) for kind in values["kinds"]]})


def steps_of(values: NDArray[np.float32], step: float) -> NDArray[np.int16]:
    """Whole steps of a value, NONE where it is NaN."""
    with np.errstate(invalid="ignore"):
        out = np.clip(np.rint(values / step), -32000, 32000)
    return np.where(np.isfinite(values), out, NONE).astype(np.int16)
