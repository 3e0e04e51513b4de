"""LAS points as record bytes, converted to the formats with an 8-bit class.

Source: ASPRS LAS 1.4 R15, tables 7 to 17 (point formats) and section 1.1 (conversion of older formats).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from laspy.point.dims import POINT_FORMATS_DTYPE
from numpy.typing import NDArray

from tunneldb.arrays import Float, UInt8

FORMAT_OF = {0: 6, 1: 6, 2: 7, 3: 7, 4: 9, 5: 10, 6: 6, 7: 7, 8: 8, 9: 9, 10: 10}
"""Point format with an 8-bit class that holds all fields of each format."""

_OVERLAP = 12  # a class in formats 0 to 5, a flag in later ones
_DEGREE = 0.006  # unit of the later formats' scan angle


def record_size(point_format: int) -> int:
    """Return the size of a point without extra bytes, bytes."""
    return int(POINT_FORMATS_DTYPE[point_format].itemsize)


def fields(records: UInt8, point_format: int) -> NDArray[np.void]:
    """Return a view of records (n, size) by the names of their standard fields; extra bytes follow them."""
    standard: np.dtype[np.void] = POINT_FORMATS_DTYPE[point_format]
    layout = np.dtype(
        {
            "names": list(standard.names or ()),
            "formats": [standard[name] for name in standard.names or ()],
            "offsets": [standard.fields[name][1] for name in standard.names or ()] if standard.fields else [],
            "itemsize": records.shape[1],
        }
    )
    return records.view(layout)[:, 0]


def coordinates(records: UInt8, scales: Sequence[float], offsets: Sequence[float]) -> Float:
    """Return coordinates (n, 3) of records of any format, m, by the scales and offsets of the header."""
    stored = fields(records, 0)
    xyz = np.empty((len(records), 3))
    for column, axis in enumerate("XYZ"):
        np.multiply(stored[axis], scales[column], out=xyz[:, column])
    xyz += np.asarray(offsets, np.float64)
    return xyz


def upgraded(records: UInt8, point_format: int) -> UInt8:
    """Convert records to the format in `FORMAT_OF` without loss; the same array if they already have it.

    Parameters
    ----------
    records : (n, size) uint8 array
    point_format : int
        0 to 10.

    Returns
    -------
    (n, size') uint8 array
        Scan angle in the new unit of 0.006°; class 12 (overlap) as the overlap flag; time 0 if there was none; extra bytes
        after the standard fields as before.
    """
    target = FORMAT_OF[point_format]
    if target == point_format:
        return records
    before, after = record_size(point_format), record_size(target)
    out = np.zeros((len(records), after + records.shape[1] - before), np.uint8)
    out[:, after:] = records[:, before:]
    old, new = fields(records, point_format), fields(out, target)
    for name in set(old.dtype.names or ()) & set(new.dtype.names or ()) - {"bit_fields"}:
        new[name] = old[name]
    bits, klass = old["bit_fields"], old["raw_classification"]
    new["bit_fields"] = (bits & 0b111) | (bits & 0b111000) << 1
    overlap = ((klass & 0b11111) == _OVERLAP).astype(np.uint8)
    new["classification_flags"] = klass >> 5 | overlap << 3 | bits & 0b11000000
    new["classification"] = klass & 0b11111
    new["scan_angle"] = np.rint(old["scan_angle_rank"] / _DEGREE)
    return out
