"""Cracks with known length, width and direction: as lines of the unrolled plane, in files, and as masks."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pyogrio.raw
import rasterio
import shapely
from affine import Affine
from shapely.geometry.base import BaseGeometry

CRACKS = [
    ([(12315.0, 2.0), (12318.0, 2.0)], 0.3),
    ([(12332.0, -6.0), (12332.0, -3.5)], 1.2),
    ([(12341.0, 1.0), (12343.0, 3.0)], None),
    ([(12351.0, 4.0), (12353.0, 4.3), (12355.0, 4.0), (12357.0, 4.3)], 0.5),
]
"""Vertices in chainage and arc, m, and width, mm."""

ANGLES = [0.0, 90.0, 45.0, float("nan")]
CLASSES = ["longitudinal", "transverse", "oblique", "longitudinal"]
"""Angles to the axis, degrees (the last is wavy), and their classes."""


def write_layer(path: Path, shapes: Sequence[BaseGeometry], crs: str | None = None, **columns: Sequence[Any]) -> Path:
    pyogrio.raw.write(
        str(path), shapely.to_wkb(np.array(shapes, object)), [np.array(c, object) for c in columns.values()],
        np.array(list(columns)), geometry_type="Unknown", crs=crs, driver={".gpkg": "GPKG"}.get(path.suffix, "GeoJSON"),
    )  # fmt: skip
    return path


def write_dxf(path: Path, lines: Sequence[Sequence[tuple[float, ...]]], layer: str = "RISSE", unit: int = 6) -> Path:
    drawing = ezdxf.new()
    drawing.header["$INSUNITS"] = unit
    for line in lines:
        if len(line[0]) == 3:
            drawing.modelspace().add_polyline3d(line, dxfattribs={"layer": layer})
        else:
            drawing.modelspace().add_lwpolyline(line, dxfattribs={"layer": layer})
    drawing.saveas(path)
    return path


def mask(lines: Sequence[Sequence[tuple[float, float]]], width: float, place: Affine, columns: int, rows: int) -> np.ndarray:
    """Mask in which lines of a width, m, are 255: the pixels whose middle lies within half of it."""
    drawn = shapely.unary_union([shapely.buffer(shapely.LineString(line), width / 2, cap_style="flat") for line in lines])
    out = np.zeros((rows, columns), np.uint8)
    shapely.prepare(drawn)
    for row in range(rows):
        x, y = place @ (np.arange(columns) + 0.5, np.full(columns, row + 0.5))
        out[row] = 255 * shapely.contains_xy(drawn, x, y)
    return out


def write_png(path: Path, values: np.ndarray) -> Path:
    bands = values if values.ndim == 3 else values[None]
    with rasterio.open(
        path, "w", driver="PNG", height=bands.shape[1], width=bands.shape[2], count=len(bands), dtype=bands.dtype
    ) as image:
        image.write(bands)
    return path
