"""Scanned points, and the header of a scan file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyproj import CRS

from tunneldb.arrays import Bool, Float, Int32, Single, UInt8, UInt16
from tunneldb.geometry.units import IN_METRES, Units
from tunneldb.pointcloud.stated_crs import StatedCrs

CHUNK = 500_000

Ranges = Sequence[tuple[int, int]]
"""Half-open ranges of point indices, from 0, in the order of reading."""


COLOURS = ("red", "green", "blue")
"""Names of the dimensions with the colour of a point."""

MAX_COLOUR = 65535
"""Greatest red, green or blue of 16 bits."""

MAX_COORDINATE = 1e11
"""Greatest plausible coordinate; projected systems have smaller ones, even in millimetres."""


def colours_of(values: NDArray[Any]) -> UInt16:
    """Return colours from numbers (n, 3) of a file; black, for no colour, where one is no whole number of 16 bits."""
    with np.errstate(invalid="ignore"):
        usable = ((values >= 0) & (values <= MAX_COLOUR) & (values == np.floor(values))).all(axis=1)
    return np.where(usable[:, None], values, 0).astype(np.uint16)


def on_earth(values: Float) -> Bool:
    """Return True for coordinates that are finite and plausible for a coordinate system."""
    return np.asarray(np.abs(values) <= MAX_COORDINATE)


@dataclass(frozen=True)
class Raw:
    """Chunk of points as stored in the file, mostly as views of its records.

    The arrays may have any stride and alignment and must not be written to.

    Attributes
    ----------
    x, y, z : (n,) int32 or float64 arrays
        Stored coordinates: `xyz` = stored × `scales` + `offsets`. int32 for LAS, float64 for E57.
    scales, offsets : (3,) float64 arrays
        Resolution and offsets of the stored coordinates, m.
    time : (n,) float64 array or None
        ``gps_time``, s; None if the file has none.
    scan_id : (n,) integer array
        Number of the scan: ``point_source_id`` of LAS, `tunneldb.pointcloud.formats.e57.scan_number` of E57.
    intensity : (n,) array of any number type, or None
        Chosen dimension in its own unit, with the scale and offset of the file; None if none was chosen.
    classification : (n,) uint8 array or None
        Class code; None if the file has none.
    colour : (n, 3) uint16 array or None
        Red, green, blue as in the file, black for a point without colour; None if colours were not requested, or the file has
        none.
    """

    x: NDArray[Any]
    y: NDArray[Any]
    z: NDArray[Any]
    scales: Float
    offsets: Float
    time: Float | None
    scan_id: NDArray[Any]
    intensity: NDArray[Any] | None
    classification: UInt8 | None
    colour: UInt16 | None = None

    def __len__(self) -> int:
        return len(self.x)

    def in_metres(self, units: Units) -> Raw:
        """Return the chunk with the units of its coordinates in scales and offsets."""
        return replace(self, scales=self.scales * units.scales, offsets=self.offsets * units.scales)

    def part(self, begin: int, end: int) -> Raw:
        """Return points begin to end, half-open, of the chunk."""
        chosen = slice(begin, end)
        return replace(
            self,
            x=self.x[chosen],
            y=self.y[chosen],
            z=self.z[chosen],
            time=None if self.time is None else self.time[chosen],
            scan_id=self.scan_id[chosen],
            intensity=None if self.intensity is None else self.intensity[chosen],
            classification=None if self.classification is None else self.classification[chosen],
            colour=None if self.colour is None else self.colour[chosen],
        )


@dataclass(frozen=True)
class Points:
    """Chunk of scanned points, in file order.

    Attributes
    ----------
    xyz : (n, 3) float64 array
        Coordinates in the file's frame, m.
    time : (n,) float64 array
        ``gps_time``, s; 0 if the file has none.
    scan_id : (n,) int32 array
        Number of the scan: ``point_source_id`` of LAS, `tunneldb.pointcloud.formats.e57.scan_number` of E57.
    intensity : (n,) float32 array
        Raw values of the chosen dimension, in its own unit; 0 if none was chosen.
    classification : (n,) uint8 array
        Class code of the file; 0 if it has none.
    colour : (n, 3) uint16 array or None
        As in `Raw`.
    """

    xyz: Float
    time: Float
    scan_id: Int32
    intensity: Single
    classification: UInt8
    colour: UInt16 | None = None

    def __len__(self) -> int:
        return len(self.xyz)

    def some(self, chosen: NDArray[Any]) -> Points:
        """Return the chosen points, by index or by mask."""
        return Points(
            self.xyz[chosen], self.time[chosen], self.scan_id[chosen], self.intensity[chosen], self.classification[chosen],
            None if self.colour is None else self.colour[chosen],
        )  # fmt: skip

    def finite(self, *, time: bool, intensity: bool) -> Bool | None:
        """Return True for points with plausible coordinates, and finite time and intensity if requested; None if all are."""
        checked: list[Float | Single] = [self.xyz]
        checked += [self.time] if time else []
        checked += [self.intensity] if intensity else []
        with np.errstate(over="ignore", invalid="ignore"):
            if -MAX_COORDINATE <= self.xyz.min(initial=0.0) <= self.xyz.max(initial=0.0) <= MAX_COORDINATE and all(
                np.isfinite(values.sum()) for values in checked
            ):
                return None
        finite: Bool = np.asarray(on_earth(self.xyz).all(axis=1))
        for values in checked:
            finite &= np.isfinite(values).reshape(len(self), -1).all(axis=1)
        return None if finite.all() else finite

    def located(self) -> Points:
        """Return the points without those of implausible coordinates."""
        finite = self.finite(time=False, intensity=False)
        return self if finite is None else self.some(finite)

    @classmethod
    def of(cls, raw: Raw) -> Points:
        """Return points with scaled coordinates, and each array in its own memory."""
        count = len(raw)
        xyz = np.empty((count, 3))
        for column, stored in enumerate((raw.x, raw.y, raw.z)):
            np.multiply(stored, raw.scales[column], out=xyz[:, column])
        xyz += raw.offsets
        return cls(
            xyz,
            np.zeros(count) if raw.time is None else np.array(raw.time, np.float64),
            np.array(raw.scan_id, np.int32),
            np.zeros(count, np.float32) if raw.intensity is None else np.array(raw.intensity, np.float32),
            np.zeros(count, np.uint8) if raw.classification is None else np.array(raw.classification, np.uint8),
            raw.colour,
        )


@dataclass(frozen=True)
class ScanHeader:
    """Header of a scan file.

    Attributes
    ----------
    path : Path
        File that was read.
    points : int
        Number of points by the header; an E57 file may mark some of them as invalid, which are not read.
    dimensions : tuple of str
        Names of the dimensions of a point.
    stated : StatedCrs
        Coordinate system that it states.
    low, high : (3,) float64 array
        Bounding box of the coordinates by the header, m; not checked, so it must not decide what is done with the points.
    units : Units
        Units of its coordinates; `low` and `high` are converted, and so are points that are read with them.
    unit_given, height_unit_given : bool
        True if the user gave the unit of x and y, or of z; then what the file states of it does not matter.
    notes : tuple of str
        Contradictions within the header, other than those of the coordinate system.
    tight : bool
        False if the box may be larger than that of the points because it encloses rotated boxes of scans.
    """

    path: Path
    points: int
    dimensions: tuple[str, ...]
    stated: StatedCrs
    low: Float
    high: Float
    units: Units = IN_METRES
    unit_given: bool = False
    height_unit_given: bool = False
    notes: tuple[str, ...] = ()
    tight: bool = True

    @property
    def crs(self) -> CRS | None:
        """Coordinate system in plan, perhaps with heights; None if the file states none or it cannot be read."""
        return self.stated.crs

    @property
    def unread_crs(self) -> str:
        """Text of a coordinate system that cannot be read, and the reason; empty if there is none."""
        return self.stated.unread
