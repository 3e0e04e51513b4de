"""Scans of a file that states the scanner position of each."""

from __future__ import annotations

import hashlib
import struct
from dataclasses import dataclass

from tunneldb.arrays import Float

FIRST_NUMBER = 65536  # scan numbers of LAS are smaller


@dataclass(frozen=True)
class PosedScan:
    """Scan with its scanner position.

    Attributes
    ----------
    index : int
        Index in the file, from 0.
    name : str
        Displayed name.
    number : int
        Result of `scan_number`.
    position : (3,) float64 array or None
        Scanner position in the file's frame, m; None if the scan has no pose.
    stated : (3,) float64 array or None
        Scanner position in a second place of the header, which `position` should repeat; None if there is none.
    """

    index: int
    name: str
    number: int
    position: Float | None
    stated: Float | None = None


def scan_number(guid: str, position: Float | None) -> int:
    """Return the number of a scan, a hash of its GUID and position, so that it does not depend on the file.

    It is between 65536 and 2³¹ − 1, so never a number of a LAS file. A scan that is registered again has another number.
    """
    place = b"" if position is None else struct.pack("<3d", *(position + 0.0))
    digest = hashlib.blake2b(guid.strip().lower().encode() + place, digest_size=8).digest()
    return FIRST_NUMBER + int.from_bytes(digest, "big") % ((1 << 31) - FIRST_NUMBER)
