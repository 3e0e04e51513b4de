"""Temporary storage of the points of a file or of a kilometre by chainage, in memory and then on disk."""

from __future__ import annotations

import errno
import math
import os
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from types import TracebackType
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from tunneldb.arrays import Float, Int64, Intp
from tunneldb.compiled import kernel
from tunneldb.errors import UserError

# One row per point. `tag` is the noise filter's cell while a file is filtered, its file's number afterwards.
ROW = np.dtype(
    [
        ("x", "<f8"),
        ("y", "<f8"),
        ("z", "<f8"),
        ("chainage", "<f8"),
        ("time", "<f8"),
        ("intensity", "<f4"),
        ("scan_id", "<i4"),
        ("tag", "<i4"),
        ("classification", "u1"),
    ]
)
Rows = NDArray[Any]
PLACE = np.dtype([("xyz", "f8", (3,))])  # a point that is used only as a neighbour

# Points are indexed by bins of 1/8 m of chainage: small enough for a bin of the densest scan to fit in memory, and
# a power of two, so that a bin never straddles a kilometre.
BINS_PER_METRE = 8
BINS_PER_KM = 1000 * BINS_PER_METRE


def bin_of(chainage: Float) -> Int64:
    """Return the bin of each chainage (m)."""
    return np.floor(chainage * BINS_PER_METRE).astype(np.int64)


def rows_xyz(rows: Rows, chosen: Intp) -> Float:
    """Return the coordinates (n, 3) of the chosen rows (n,)."""
    xyz = np.empty((len(chosen), 3))
    for column, name in enumerate("xyz"):
        xyz[:, column] = rows[name][chosen]
    return xyz


@dataclass
class _Run:
    """Rows sorted by bin: bin first + k begins at start[k]."""

    first: int
    start: Int64
    rows: Rows | None
    offset: int


class Spool:
    """Storage of rows that can be read back by bins of chainage, in whatever order they were added.

    Each call of `add` makes a run sorted by bin; runs beyond the memory allowed go to a temporary file (in TMPDIR),
    from which a range of bins is one read a run.

    Parameters
    ----------
    memory : int
        Bytes of rows kept in memory.
    dtype : dtype
        Type of a row.
    """

    def __init__(self, memory: int, dtype: np.dtype[Any] = ROW) -> None:
        self.memory = memory
        self.dtype = dtype
        self._runs: list[_Run] = []
        self._bytes = 0
        self._file: IO[bytes] | None = None
        self._spilt = 0

    def __enter__(self) -> Spool:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Release all rows."""
        if self._file is not None:
            self._file.close()
        self._runs.clear()

    def add(self, rows: Rows, bins: Int64 | None = None) -> None:
        """Store rows in these bins; by default in those of their chainage.

        Raises
        ------
        InputError
            If the disk of the temporary folder is full.
        """
        if len(rows) == 0:
            return
        bins = bin_of(rows["chainage"]) if bins is None else bins
        ordered, first, start = _sort_by_bin(rows, bins)
        run = _Run(first, start, ordered, 0)
        if self._bytes + rows.nbytes > self.memory:
            self._spill(run)
        else:
            self._bytes += rows.nbytes
        self._runs.append(run)

    def counts(self) -> tuple[int, Int64]:
        """Return the first bin, and the number of rows in each bin from it on."""
        if not self._runs:
            return 0, np.zeros(0, np.int64)
        first = min(run.first for run in self._runs)
        last = max(run.first + len(run.start) - 1 for run in self._runs)
        total = np.zeros(last - first, np.int64)
        for run in self._runs:
            total[run.first - first : run.first - first + len(run.start) - 1] += np.diff(run.start)
        return first, total

    def counts_of(self, low: int, high: int) -> Int64:
        """Return the number of rows in each of the bins low ≤ bin < high."""
        first, counts = self.counts()
        found = np.zeros(high - low, np.int64)
        begin, end = max(low, first), min(high, first + len(counts))
        if begin < end:
            found[begin - low : end - low] = counts[begin - first : end - first]
        return found

    def kilometres(self) -> dict[int, int]:
        """Return the number of rows in each kilometre that has any."""
        first, counts = self.counts()
        place = np.flatnonzero(counts)
        kms, inverse = np.unique((first + place) // BINS_PER_KM, return_inverse=True)
        totals = np.bincount(inverse, counts[place], len(kms)).astype(int)
        return dict(zip(kms.tolist(), totals.tolist(), strict=True))

    def read(self, low: int, high: int) -> Rows:
        """Read the rows of bins low ≤ bin < high, in order of `add` and then of bins; they may be the spool's own arrays."""
        parts = [part for run in self._runs if len(part := self._slice(run, low, high))]
        if len(parts) == 1:
            return parts[0]
        return np.concatenate(parts) if parts else np.empty(0, self.dtype)

    def _slice(self, run: _Run, low: int, high: int) -> Rows:
        last = len(run.start) - 1
        begin = int(run.start[min(max(low - run.first, 0), last)])
        end = int(run.start[min(max(high - run.first, 0), last)])
        if run.rows is not None:
            return run.rows[begin:end]
        assert self._file is not None
        rows: Rows = np.empty(end - begin, self.dtype)
        if end > begin:
            # preadv instead of seek and read: two threads may read at once.
            _read_at(self._file.fileno(), rows, run.offset + begin * self.dtype.itemsize)
        return rows

    def _spill(self, run: _Run) -> None:
        assert run.rows is not None
        try:
            if self._file is None:
                self._file = tempfile.TemporaryFile(prefix="tunneldb-", buffering=0)  # noqa: SIM115
            _write_all(self._file, _bytes(run.rows))
        except OSError as error:
            if error.errno not in (errno.ENOSPC, errno.EDQUOT):
                raise
            raise UserError(
                f"no space left for temporary files in {tempfile.gettempdir()}, the current job is rolled back; "
                "free some or set TMPDIR to a folder on a larger disk"
            ) from error
        run.offset, run.rows = self._spilt, None
        self._spilt += int(run.start[-1]) * self.dtype.itemsize


def windows(first: int, counts: Int64, limit: int) -> Iterator[tuple[int, int]]:
    """Divide a range of bins into windows.

    Parameters
    ----------
    first : int
        First bin.
    counts : (n,) int64 array
        Number of rows in each bin from `first` on.
    limit : int
        Number of rows at which a window ends.

    Yields
    ------
    low, high : int
        Windows low ≤ bin < high with rows, in order; none crosses a kilometre boundary.
    """
    before = np.concatenate([[0], np.cumsum(counts)])
    low, end = first, first + len(counts)
    while low < end:
        wall = (math.floor(low / BINS_PER_KM) + 1) * BINS_PER_KM
        full = int(np.searchsorted(before, before[low - first] + limit)) + first
        high = min(max(full, low + 1), wall, end)
        if before[high - first] > before[low - first]:
            yield low, high
        low = high


def _bytes(rows: Rows) -> memoryview:
    return rows.view(np.uint8).data


def _read_at(handle: int, rows: Rows, offset: int) -> None:
    view = _bytes(rows)
    done = 0
    while done < len(view):
        got = os.preadv(handle, [view[done:]], offset + done)
        if got == 0:
            raise EOFError("the temporary file is shorter than what was written to it")
        done += got


def _write_all(file: IO[bytes], view: memoryview) -> None:
    done = 0
    while done < len(view):
        done += file.write(view[done:])


def _sort_by_bin(rows: Rows, bins: Int64) -> tuple[Rows, int, Int64]:
    """Sort rows by bin; return the first bin, and the start index of each bin from it on."""
    first = int(bins.min())
    start = np.zeros(int(bins.max()) - first + 3, np.int64)
    ordered = np.empty_like(rows)
    _move_rows(np.ascontiguousarray(rows), np.ascontiguousarray(bins), first, start, ordered)
    return ordered, first, start[:-1]


@kernel
def _move_rows(rows: Rows, bins: Int64, first: int, start: Int64, ordered: Rows) -> None:  # pragma: no cover - compiled
    """Sort rows by bin; ``start`` has two entries more than bins, initially 0, and gets the first index of each bin."""
    for i in range(bins.shape[0]):
        start[bins[i] - first + 2] += 1
    for b in range(2, start.shape[0]):
        start[b] += start[b - 1]
    # start[b + 1] is the index for the next row of bin b; at the end it is the first index of bin b + 1.
    for i in range(bins.shape[0]):
        b = bins[i] - first + 1
        ordered[start[b]] = rows[i]
        start[b] += 1
