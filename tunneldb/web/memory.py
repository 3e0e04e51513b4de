"""Memory of the process."""

from __future__ import annotations

import ctypes

_M_MMAP_THRESHOLD = -3
_LARGE = 256 * 1024


def return_freed_memory() -> None:
    """Let the C library (glibc) return the memory of arrays to the system when they are freed.

    By default it keeps blocks of up to 32 MB for later once such a block was freed; with a dozen threads that is as much
    memory as the desk itself needs.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(_M_MMAP_THRESHOLD, _LARGE)
