"""Images of another instrument: hot spots at known places of the lining, seen by a thermal line scanner or a camera."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import rasterio
from affine import Affine

WEST, TOP = 12310.0, 8.0
SPOTS = [(12315.0, 2.0), (12330.3, -6.2), (12343.7, 7.1), (12359.9, 0.4), (12371.2, -3.3), (12386.5, 5.0)]
"""Hot spots on the lining, chainage and arc, m."""

LONG = Affine(0.02 / 1.02, 0, WEST + 0.05, 0, -0.02, TOP + 0.05)
"""True place of a strip that states pixels of 20 mm from WEST and TOP: 2 % too long and 5 cm off."""

STATED = Affine(0.02, 0, WEST, 0, -0.02, TOP)
COLUMNS, ROWS = 4080, 800
PIXELS = [(40, 60), (70, 750), (1400, 100), (2000, 700), (3300, 450), (4000, 70), (3990, 760)]


def temperature(chainage: np.ndarray, arc: np.ndarray) -> np.ndarray:
    out = np.full(np.broadcast_shapes(chainage.shape, arc.shape), 10.0)
    for x, y in SPOTS:
        out += 8.0 * np.exp(-((chainage - x) ** 2) / (2 * 0.15**2)) * np.exp(-((arc - y) ** 2) / (2 * 0.15**2))
    return out


def strip(place: Affine, columns: int = COLUMNS, rows: int = ROWS) -> np.ndarray:
    """Temperature of the lining where the pixels of an upright image truly are, °C."""
    chainage = place.c + (np.arange(columns) + 0.5) * place.a
    arc = place.f + (np.arange(rows) + 0.5) * place.e
    return temperature(chainage[None, :], arc[:, None]).astype(np.float32)


def write(path: Path, values: np.ndarray, place: Affine | None, unit: str = "", **options: Any) -> Path:
    bands = values if values.ndim == 3 else values[None]
    with rasterio.open(
        path, "w", driver="GTiff", height=bands.shape[1], width=bands.shape[2], count=len(bands), dtype=bands.dtype,
        transform=place, **options,
    ) as image:  # fmt: skip
        image.write(bands)
        if unit:
            image.units = (unit,)
    return path
