"""Decorators for compiled loops over points and pixels.

Python calls a kernel with arrays of one type each, so that it is compiled once. A kernel releases the interpreter lock
(`tunneldb.threads.in_blocks` gives each thread a block of points). A kernel calls inner functions, once for each point.
"""

from __future__ import annotations

from numba import njit
from numba.extending import register_jitable

from tunneldb.arrays import Int64
from tunneldb.compiled_cache import require_own_cache

require_own_cache()

kernel = njit(cache=True, nogil=True)
"""Decorator of a compiled function that Python calls."""

inner = njit(cache=True, nogil=True, no_cpython_wrapper=True, no_cfunc_wrapper=True)
"""Decorator of a compiled function that only compiled functions call; it compiles faster."""

point_kernel = njit(cache=True, nogil=True, error_model="numpy")
"""Decorator of a kernel that divides for each point or pixel; x / 0 is infinite or NaN, so the loop needs no test for it."""

point_inner = njit(
    cache=True, nogil=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True, no_cfunc_wrapper=True
)
"""Decorator of a function that a point kernel calls for each point; it is always inlined, so tuples are returned at no cost."""

inner_sums = njit(
    cache=True, nogil=True, fastmath={"reassoc", "contract", "nsz", "nnan"}, no_cpython_wrapper=True, no_cfunc_wrapper=True
)
"""Decorator of a function that adds up many numbers in any order (vectorised)."""


both = register_jitable
"""Decorator of a function that Python calls on arrays, and compiled functions on single numbers."""


@inner
def lower_bound(values: Int64, value: int, begin: int, end: int) -> int:  # pragma: no cover - compiled
    """Return the index of the first of ascending values not less than ``value``, from ``begin`` on; ``end`` if none."""
    while begin < end:
        middle = (begin + end) >> 1
        if values[middle] < value:
            begin = middle + 1
        else:
            end = middle
    return begin
