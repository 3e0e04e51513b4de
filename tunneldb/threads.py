"""Number of threads that this process computes with."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from functools import cache

_POOLS = ("NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "RAYON_NUM_THREADS", "GDAL_NUM_THREADS")
_chosen: list[int] = []
_own = threading.local()
"""Values of each thread. `busy` is True if the thread works for `in_blocks`."""


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

    def block(begin: int) -> None:
        _own.busy = True
        work(begin, min(begin + size, count))

    if many <= 1 or getattr(_own, "busy", False):  # a thread that waited for others of its pool might wait for ever
        for begin in starts:
            work(begin, min(begin + size, count))
        return
    blocks = [_pool(threads()).submit(block, begin) for begin in starts]
    try:
        for done in blocks:
            done.result()
    finally:  # after an error none writes on
        for waiting in blocks:
            waiting.cancel()
        wait(blocks)


@cache
def _pool(many: int) -> ThreadPoolExecutor:
    """Return the threads of this process, which are kept: starting them takes longer than a small block."""
    return ThreadPoolExecutor(many, thread_name_prefix="blocks")


os.register_at_fork(after_in_child=_pool.cache_clear)  # threads do not outlive a fork
