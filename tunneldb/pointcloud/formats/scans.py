"""Scans of a file that says where each was taken from."""

from __future__ import annotations

import hashlib
import struct
from dataclasses import dataclass

from tunneldb.arrays import Float

FIRST_NUMBER = 65536  # scan numbers of LAS lie below


@dataclass(frozen=True)
class PosedScan:
    """A scan and where the scanner stood.

    Attributes
    ----------
    index : int
        Place in the file, from 0.
    name : str
        What to call it.
    number : int
        `scan_number`.
    position : (3,) float64 array or None
        Where the scanner stood, in the file's frame, m; None where the scan has no pose.
    """

    index: int
    name: str
    number: int
    position: Float | None


def scan_number(guid: str, position: Float | None) -> int:
    """Number of a scan, the same in whichever file and place among the scans: a hash of its GUID and position.

    From 65536 to 2³¹ − 1, so never one of a LAS file. A scan that was registered anew has another number.
    """
    place = b"" if position is None else struct.pack("<3d", *(position + 0.0))
    digest = hashlib.blake2b(guid.strip().lower().encode() + place, digest_size=8).digest()
    return FIRST_NUMBER + int.from_bytes(digest, "big") % ((1 << 31) - FIRST_NUMBER)
