"""Dimensions of a point cloud: definitions, and statistics of their values."""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import Any

import laspy
import numpy as np

from tunneldb.arrays import Float, UInt8
from tunneldb.pointcloud.formats.las_header import Head

_NAMES = {
    "X": "X",
    "Y": "Y",
    "Z": "Z",
    "intensity": "Intensity",
    "return_number": "ReturnNumber",
    "number_of_returns": "NumberOfReturns",
    "synthetic": "Synthetic",
    "key_point": "KeyPoint",
    "withheld": "Withheld",
    "overlap": "Overlap",
    "scanner_channel": "ScanChannel",
    "scan_direction_flag": "ScanDirectionFlag",
    "edge_of_flight_line": "EdgeOfFlightLine",
    "classification": "Classification",
    "user_data": "UserData",
    "scan_angle": "ScanAngleRank",
    "point_source_id": "PointSourceId",
    "gps_time": "GpsTime",
    "red": "Red",
    "green": "Green",
    "blue": "Blue",
    "nir": "Infrared",
}
"""PDAL's names of the LAS dimensions, as other programs use them."""

_DEGREES = 0.006  # a step of the scan angle
_TYPES = {"FloatingPoint": "floating", "SignedInteger": "signed"}


@dataclass
class Dimension:
    """Dimension with statistics of its values.

    Attributes
    ----------
    name : str
        PDAL's, or the one it has in the extra bytes.
    type : str
        ``floating``, ``unsigned`` or ``signed``.
    size : int
        Bytes of a value.
    count, average, squares, least, greatest
        Statistics of the values so far; squares are summed about the average.
    """

    name: str
    type: str
    size: int
    count: int = 0
    average: float = 0.0
    squares: float = 0.0
    least: float = np.inf
    greatest: float = -np.inf

    def add(self, values: Float) -> None:
        """Add values (n,); those that are not numbers are ignored."""
        values = values[np.isfinite(values)]
        if not len(values):
            return
        with np.errstate(over="ignore", invalid="ignore"):  # of values that are nearly the greatest there are
            mean, count = float(values.mean()), self.count + len(values)
            step = mean - self.average  # Chan, Golub & LeVeque 1983, equation 1.5
            self.squares += float(np.square(values - mean).sum()) + step * step * self.count * len(values) / count
        self.average += step * len(values) / count
        self.count = count
        self.least, self.greatest = min(self.least, float(values.min())), max(self.greatest, float(values.max()))

    @property
    def is_finite(self) -> bool:
        """Return True if the statistics are finite: sums may overflow."""
        return bool(np.isfinite([self.average, self.variance]).all())

    @property
    def variance(self) -> float:
        """Variance of the values, of the sample."""
        return self.squares / (self.count - 1) if self.count > 1 else 0.0


class Dimensions:
    """Dimensions of the points of a file, in their order in a record.

    Parameters
    ----------
    head : Head
        Polygon around the points.
    """

    def __init__(self, head: Head) -> None:
        # laspy reads of a whole header what the extra bytes are.
        header = laspy.LasHeader.read_from(io.BytesIO(head.before_points(b"")), read_evlrs=False)
        self.form: Any = header.point_format
        self.dtype = self.form.dtype()
        self.scales, self.offsets = np.array(head.scales), np.array(head.offsets)
        self.every: dict[str, list[Dimension]] = {}
        for dimension in self.form.dimensions:
            scaled = dimension.name in ("X", "Y", "Z", "scan_angle") or dimension.is_scaled
            kind = "floating" if scaled else _TYPES.get(dimension.kind.name, "unsigned")
            many = dimension.num_elements
            size = 4 if dimension.name == "scan_angle" else 8 if scaled else max(1, dimension.num_bits // 8 // many)
            name = _NAMES.get(dimension.name, dimension.name)
            names = [name] if many == 1 else [f"{name}_{number}" for number in range(many)]
            self.every[dimension.name] = [Dimension(name, kind, size) for name in names]

    def add(self, records: UInt8) -> None:
        """Add the values of records (n, size)."""
        points = laspy.ScaleAwarePointRecord(records.view(self.dtype)[:, 0], self.form, self.scales, self.offsets)
        for name, dimensions in self.every.items():
            values = np.asarray(points[name.lower() if name in "XYZ" else name], np.float64).reshape(len(records), -1)
            for dimension, column in zip(dimensions, values.T, strict=True):
                dimension.add(column * _DEGREES if name == "scan_angle" else column)

    def listed(self) -> list[Dimension]:
        """Return all dimensions."""
        return [dimension for dimensions in self.every.values() for dimension in dimensions]
