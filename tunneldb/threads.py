"""How many threads this process computes with."""

from __future__ import annotations

import os
import sys

_POOLS = ("NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "RAYON_NUM_THREADS", "GDAL_NUM_THREADS")
_chosen: list[int] = []


def use_threads(count: int) -> None:
    """Let this process compute with ``count`` threads; best called before Numba and NumPy are imported.

    Libraries that are imported later size their pools by it. Of those imported before, Numba follows in the calling
    thread only.

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
    """Threads that this process computes with: what `use_threads` said, or one a core."""
    return _chosen[0] if _chosen else os.cpu_count() or 1
