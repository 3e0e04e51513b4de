"""Points for a browser as one binary buffer: a header as JSON, and after it arrays that scripts use without a copy.

The buffer begins with the length of the header, bytes, as a 32-bit little-endian number. Header and arrays each begin at a
multiple of four bytes; ``arrays`` of the header has name, type, number of values and place of each array, the latter in bytes
from the end of the header.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tunneldb.arrays import Int16, Single, UInt8
from tunneldb.export.images.tile_png import Stretch

NO_GREY = 0
"""Grey of a point without a value."""

NO_LENGTH = -32768
"""Length of a point without a value, mm."""


def point_buffer(header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Return the buffer of some arrays, with a header."""
    described, parts, place = [], [], 0
    for name, values in arrays.items():
        sent = np.ascontiguousarray(values, values.dtype.newbyteorder("<")).tobytes()
        described.append({"name": name, "type": values.dtype.name, "length": values.size, "at": place})
        parts.append(sent + b"\0" * (-len(sent) % 4))
        place += len(parts[-1])
    text = json.dumps({**header, "arrays": described}, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    return b"".join([struct.pack("<I", len(text)), text, *parts])


def greys(values: Single, stretch: Stretch) -> UInt8:
    """Return values (n,) as greys from 1 to 255, NaN as NO_GREY."""
    share = (values - stretch.low) / max(stretch.high - stretch.low, 1e-9)
    shown = np.isfinite(share)
    return np.where(shown, 1.0 + 254.0 * np.clip(np.where(shown, share, 0.0), 0.0, 1.0), NO_GREY).round().astype(np.uint8)


def millimetres(values: Single) -> Int16:
    """Return lengths (n,), m, in whole mm, NaN as NO_LENGTH."""
    shown = np.isfinite(values)
    return (
        np.where(shown, np.clip(1000.0 * np.where(shown, values, 0.0), -32767.0, 32767.0), NO_LENGTH).round().astype(np.int16)
    )
