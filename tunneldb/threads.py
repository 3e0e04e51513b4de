"""Number of threads that this process computes with."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

_POOLS = ("NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "RAYON_NUM_THREADS", "GDAL_NUM_THREADS")
_chosen: list[int] = []


def use_threads(count: int) -> None:
    """Let this process compute with ``count`` threads; best called before Numba and NumPy are imported.

    Libraries that are imported later size their thread pools accordingly. Of those already imported, only Numba follows, in the
    calling thread.

    Raises
    ------
    ValueError
        If the count is less than 1.
    """
    if count < 1:
        raise ValueError(f"a process computes with 1 thread or more, not {count}")
    _chosen[:] = [count]
    numba = sys.modules.get("numba")
    # Numba objects to another NUMBA_NUM_THREADS once its threads run.
    os.environ.update({name: str(count) for name in _POOLS if numba is None or not name.startswith("NUMBA")})
    if numba is not None:
        numba.set_num_threads(min(count, numba.config.NUMBA_NUM_THREADS))


def threads() -> int:
    """Return the number of threads that this process computes with: that of `use_threads`, or one per core."""
    return _chosen[0] if _chosen else os.cpu_count() or 1


def in_blocks(work: Callable[[int, int], object], count: int, size: int) -> None:
    """Call ``work(begin, end)`` for each block of ``size`` of ``count`` items, on as many threads as this process has.

    Parameters
    ----------
    work : callable
        Function of the first index of a block and the one after its last. It must release Python's lock, as compiled kernels
        and NumPy do, to gain from threads; blocks must not write to the same places.
    count, size : int
        Number of items, and of items in a block.
    """
    starts = range(0, count, size)
    many = min(threads(), len(starts))
    if many <= 1:
        for begin in starts:
            work(begin, min(begin + size, count))
        return
    with ThreadPoolExecutor(many) as pool:
        for _ in pool.map(lambda begin: work(begin, min(begin + size, count)), starts):
            pass
