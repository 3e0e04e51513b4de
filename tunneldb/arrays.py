"""Array types, by element type."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Single = NDArray[np.float32]
Bool = NDArray[np.bool_]
Int16 = NDArray[np.int16]
Int32 = NDArray[np.int32]
Int64 = NDArray[np.int64]
Intp = NDArray[np.intp]
UInt8 = NDArray[np.uint8]
UInt16 = NDArray[np.uint16]
UInt32 = NDArray[np.uint32]
UInt64 = NDArray[np.uint64]
Whole = Int32 | Int64


def known(value: float) -> float | None:
    """Return a number as a Python float, or None if it is not finite (NaN in an array is NULL in the database)."""
    return float(value) if np.isfinite(value) else None
