"""How loops over points and pixels are compiled: the kinds of function that there are.

A kernel is called from Python, on arrays of one type each, so that it is compiled once. It lets other threads run meanwhile
(`tunneldb.threads.in_blocks` gives each of them a block of the points). What a kernel calls, for each point, is inner.
"""

from __future__ import annotations

from numba import njit

from tunneldb.arrays import Int64
from tunneldb.compiled_cache import require_own_cache

require_own_cache()

kernel = njit(cache=True, nogil=True)
"""Decorator of a compiled function that Python calls."""

inner = njit(cache=True, nogil=True, no_cpython_wrapper=True, no_cfunc_wrapper=True)
"""Decorator of a compiled function that only compiled functions call: it takes less to compile."""

point_kernel = njit(cache=True, nogil=True, error_model="numpy")
"""A kernel that divides for each point or pixel: division by zero is infinite or NaN, so no test for it is in the loop."""

point_inner = njit(
    cache=True, nogil=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True, no_cfunc_wrapper=True
)
"""What such a kernel calls for each point, put into it whole: several numbers returned cost nothing then."""

inner_sums = njit(
    cache=True, nogil=True, fastmath={"reassoc", "contract", "nsz", "nnan"}, no_cpython_wrapper=True, no_cfunc_wrapper=True
)
"""What adds up many numbers in any order, several at once."""


@inner
def lower_bound(values: Int64, wanted: int, begin: int, end: int) -> int:  # pragma: no cover - compiled
    """Place of the first of growing values that is not below the one wanted, looked for from begin on; end if none is."""
    while begin < end:
        middle = (begin + end) >> 1
        if values[middle] < wanted:
            begin = middle + 1
        else:
            end = middle
    return begin
