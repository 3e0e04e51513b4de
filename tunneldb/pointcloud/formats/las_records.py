"""Points of LAS as the bytes of their records, brought into the formats whose class has 8 bits.

Source: ASPRS LAS 1.4 R15, tables 7 to 17 (point formats) and section 1.1 (what the older formats become).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from laspy.point.dims import POINT_FORMATS_DTYPE
from numpy.typing import NDArray

from tunneldb.arrays import Float, UInt8

FORMAT_OF = {0: 6, 1: 6, 2: 7, 3: 7, 4: 9, 5: 10, 6: 6, 7: 7, 8: 8, 9: 9, 10: 10}
"""Point format with 8 bits for the class that holds all that each format does."""

_OVERLAP = 12  # a class of formats 0 to 5, a flag of the later ones
_DEGREE = 0.006  # unit of the later formats' scan angle


def record_size(point_format: int) -> int:
    """Bytes of a point without extra bytes."""
    return int(POINT_FORMATS_DTYPE[point_format].itemsize)


def fields(records: UInt8, point_format: int) -> NDArray[np.void]:
    """View of records (n, size) by the names of their standard fields; extra bytes are behind them."""
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
    """Coordinates (n, 3) of records of any format, m, by the scales and offsets of the header."""
    stored = fields(records, 0)
    xyz = np.empty((len(records), 3))
    for column, axis in enumerate("XYZ"):
        np.multiply(stored[axis], scales[column], out=xyz[:, column])
    xyz += np.asarray(offsets, np.float64)
    return xyz


def upgraded(records: UInt8, point_format: int) -> UInt8:
    """Records in the format that `FORMAT_OF` names, with all that they held; the same array where that is their own.

    Parameters
    ----------
    records : (n, size) uint8 array
    point_format : int
        0 to 10.

    Returns
    -------
    (n, size') uint8 array
        The scan angle in its new unit of 0.006°; class 12 (overlap) as the flag that it became; no time where there was
        none (0); extra bytes behind the standard fields as before.
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
