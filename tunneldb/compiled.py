"""Decorators for compiled loops over points and pixels.

Python calls a kernel with arrays of one type each, so that it is compiled once. A kernel releases the interpreter lock
(`tunneldb.threads.in_blocks` gives each thread a block of points). A kernel calls inner functions, once for each point.

Numba is imported when a kernel is first called: most commands call none, and the import takes longer than they do.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, update_wrapper
from typing import Any, TypeVar

from tunneldb.arrays import Int64
from tunneldb.compiled_cache import require_own_cache

require_own_cache()

_F = TypeVar("_F", bound=Callable[..., Any])


class Loop:
    """Function that Numba compiles when Python, or another compiled function, first calls it.

    Attributes
    ----------
    py_func : callable
        The function itself, which Python can run on single numbers.
    options : dict
        Options of Numba.
    """

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]) -> None:
        self.py_func = function
        self.options = options
        update_wrapper(self, function)

    def __call__(self, *arguments: Any) -> Any:
        """Run the compiled function."""
        return self.dispatcher(*arguments)

    def __reduce__(self) -> str:
        return self.py_func.__qualname__

    @cached_property
    def dispatcher(self) -> Any:
        """Numba's own object for this function."""
        from numba import njit
        from numba.extending import register_jitable

        while _SHARED:
            register_jitable(_SHARED.pop())
        return njit(**self.options)(self.py_func)

    @property
    def _numba_type_(self) -> Any:
        """Type by which Numba knows this function inside another one."""
        return self.dispatcher._numba_type_


_SHARED: list[Callable[..., Any]] = []
"""Functions of `both` that Numba does not know yet."""


def _loop(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    return lambda function: Loop(function, {"cache": True, "nogil": True, **options})


_INNER = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}

kernel = _loop()
"""Decorator of a compiled function that Python calls."""

inner = _loop(**_INNER)
"""Decorator of a compiled function that only compiled functions call; it compiles faster."""

point_kernel = _loop(error_model="numpy")
"""Decorator of a kernel that divides for each point or pixel; x / 0 is infinite or NaN, so the loop needs no test for it."""

point_inner = _loop(error_model="numpy", forceinline=True, **_INNER)
"""Decorator of a function that a point kernel calls for each point; it is always inlined, so tuples are returned at no cost."""

inner_sums = _loop(fastmath={"reassoc", "contract", "nsz", "nnan"}, **_INNER)
"""Decorator of a function that adds up many numbers in any order (vectorised)."""


def both(function: _F) -> _F:
    """Mark a function that Python calls on arrays, and compiled functions on single numbers."""
    _SHARED.append(function)
    return function


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
