"""Rows of tunnel.point, put in the order of chainage and packed for COPY in one go."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tunneldb.arrays import Float, Int32, UInt8
from tunneldb.database.copy import PointZ, pack
from tunneldb.pointcloud.spool import ROW, Rows
from tunneldb.store.survey import Survey

COLUMNS = (
    "survey_id",
    "km",
    "chainage",
    "gps_time",
    "geom",
    "scan_id",
    "file_id",
    "intensity",
    "classification",
)


# Where values begin in a packed row: after the number of fields (2 bytes), each field has its length (4) before it.
_CHAINAGE, _TIME, _XYZ, _SCAN, _FILE, _INTENSITY, _CLASS, _END = 22, 34, 55, 83, 91, 99, 107, 109
_AT = {name: int(offset) for name, (_, offset, *_) in (ROW.fields or {}).items()}
_FROM_X, _FROM_CHAINAGE, _FROM_TIME = _AT["x"], _AT["chainage"], _AT["time"]
_FROM_INTENSITY, _FROM_SCAN, _FROM_TAG, _FROM_CLASS = _AT["intensity"], _AT["scan_id"], _AT["tag"], _AT["classification"]


def pack_rows(survey: Survey, km: int, rows: Rows, file_ids: Int32) -> UInt8:
    """Pack rows of a kilometre for `tunneldb.database.copy.copy_binary`, in the order of chainage.

    Parameters
    ----------
    rows : (n,) array of ROW
        Their tags tell the file.
    file_ids : (k,) int32 array
        scan_file.id for each tag.

    Returns
    -------
    (n × 109,) uint8 array
        COLUMNS of each row.
    """
    template = np.frombuffer(pack(_columns(survey, km, np.zeros(1, ROW), np.zeros(1, np.int32))), np.uint8)
    packed = np.empty((len(rows), _END), np.uint8)
    _fill(packed, rows.view(np.uint8).reshape(-1, ROW.itemsize), by_chainage(rows["chainage"]), template, _swapped(file_ids))
    return packed.ravel()


def _columns(survey: Survey, km: int, rows: Rows, file_ids: Int32) -> list[NDArray[np.generic] | PointZ]:
    count = len(rows)
    return [
        np.full(count, survey.id, np.int32),
        np.full(count, km, np.int32),
        rows["chainage"],
        rows["time"],
        PointZ(np.column_stack([rows["x"], rows["y"], rows["z"]]), survey.srid),
        rows["scan_id"],
        file_ids,
        rows["intensity"],
        rows["classification"].astype(np.int16),
    ]


def _swapped(file_ids: Int32) -> UInt8:
    return np.ascontiguousarray(file_ids.astype(">i4")).view(np.uint8).reshape(-1, 4)


@njit(cache=True, nogil=True)
def by_chainage(chainage: Float) -> Int32:  # pragma: no cover - compiled
    """Order of growing values; equal ones stay as they come. Spread fairly evenly, they are binned and hardly compared."""
    n = len(chainage)
    order = np.empty(n, np.int32)
    if n == 0:
        return order
    low, high = chainage[0], chainage[0]
    for i in range(n):
        low, high = min(low, chainage[i]), max(high, chainage[i])
    scale = (n - 1) / (high - low) if high > low else 0.0
    start = np.zeros(n + 1, np.int32)
    for i in range(n):
        start[int((chainage[i] - low) * scale) + 1] += 1
    for b in range(n):
        start[b + 1] += start[b]
    for i in range(n):
        b = int((chainage[i] - low) * scale)
        order[start[b]] = i
        start[b] += 1
    crowded = False
    for i in range(1, n):
        j = order[i]
        k = i
        while k > 0 and chainage[order[k - 1]] > chainage[j]:
            order[k] = order[k - 1]
            k -= 1
            if i - k > 1000:
                crowded = True
                break
        order[k] = j
        if crowded:
            break
    if crowded:
        return np.argsort(chainage, kind="mergesort").astype(np.int32)
    return order


@njit(cache=True, nogil=True)
def _fill(packed: UInt8, rows: UInt8, order: Int32, template: UInt8, file_ids: UInt8) -> None:  # pragma: no cover - compiled
    for k in range(len(order)):
        row, out = rows[order[k]], packed[k]
        for b in range(_END):
            out[b] = template[b]
        for b in range(8):  # network order, from that of this machine
            out[_CHAINAGE + b] = row[_FROM_CHAINAGE + 7 - b]
            out[_TIME + b] = row[_FROM_TIME + 7 - b]
        for b in range(24):  # the geometry states its own order
            out[_XYZ + b] = row[_FROM_X + b]
        tag = np.int64(0)
        for b in range(4):
            out[_SCAN + b] = row[_FROM_SCAN + 3 - b]
            out[_INTENSITY + b] = row[_FROM_INTENSITY + 3 - b]
            tag |= np.int64(row[_FROM_TAG + b]) << (8 * b)
        for b in range(4):
            out[_FILE + b] = file_ids[tag, b]
        out[_CLASS] = 0
        out[_CLASS + 1] = row[_FROM_CLASS]
