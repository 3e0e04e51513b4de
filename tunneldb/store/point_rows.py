"""Rows of tunnel.point, put in the order of chainage and packed for COPY in one go."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tunneldb.arrays import Float, Int32, UInt8
from tunneldb.compiled import kernel
from tunneldb.database.copy import Column, PointZ, pack
from tunneldb.pointcloud.spool import ROW, Rows
from tunneldb.store.survey import Survey

_POINT_Z = np.dtype([("head", "V9"), ("xyz", "<f8", (3,))])  # the head: byte order, type and SRID
_FIELDS = {
    "survey_id": ">i4",
    "km": ">i4",
    "chainage": ">f8",
    "gps_time": ">f8",
    "geom": _POINT_Z,
    "scan_id": ">i4",
    "file_id": ">i4",
    "intensity": ">f4",
    "classification": ">i2",
}
COLUMNS = tuple(_FIELDS)

BLOCK = 8192  # rows packed at a time: a megabyte, which stays in the processor's cache until it is sent

# A row of binary COPY: the number of its fields, and before each one its length.
PACKED = np.dtype(
    [("fields", ">i2"), *(field for name, kind in _FIELDS.items() for field in ((f"{name}_", ">i4"), (name, kind)))]
)


def _place(dtype: np.dtype[np.void], name: str) -> int:
    """Return the byte at which a field of a record begins."""
    assert dtype.fields is not None
    return int(dtype.fields[name][1])


_CHAINAGE, _TIME, _SCAN, _FILE, _INTENSITY, _CLASS = (
    _place(PACKED, name) for name in ("chainage", "gps_time", "scan_id", "file_id", "intensity", "classification")
)
_XYZ, _BYTES = _place(PACKED, "geom") + _place(_POINT_Z, "xyz"), PACKED.itemsize
_FROM_X, _FROM_CHAINAGE, _FROM_TIME, _FROM_INTENSITY, _FROM_SCAN, _FROM_TAG, _FROM_CLASS = (
    _place(ROW, name) for name in ("x", "chainage", "time", "intensity", "scan_id", "tag", "classification")
)


def pack_rows(survey: Survey, km: int, rows: Rows, file_ids: Int32) -> Iterator[UInt8]:
    """Pack rows of a kilometre for `tunneldb.database.copy.copy_binary`, in the order of chainage, BLOCK at a time.

    Parameters
    ----------
    rows : (n,) array of ROW
        Tags are the files' ids.
    file_ids : (k,) int32 array
        scan_file.id for each tag.

    Yields
    ------
    (m × PACKED.itemsize,) uint8 array
        COLUMNS of each row.
    """
    no_row = np.zeros(1, ROW)
    columns: list[Column] = [
        np.full(1, survey.id, np.int32),
        np.full(1, km, np.int32),
        no_row["chainage"],
        no_row["time"],
        PointZ(np.zeros((1, 3)), survey.srid),
        no_row["scan_id"],
        np.zeros(1, np.int32),
        no_row["intensity"],
        no_row["classification"].astype(np.int16),
    ]
    template = np.frombuffer(pack(columns), np.uint8).copy()
    swapped = np.ascontiguousarray(file_ids.astype(">i4")).view(np.uint8).reshape(-1, 4)
    records = np.ascontiguousarray(rows).view(np.uint8).reshape(-1, ROW.itemsize)
    order = by_chainage(rows["chainage"])
    for begin in range(0, len(rows), BLOCK):
        block = order[begin : begin + BLOCK]
        packed = np.empty((len(block), _BYTES), np.uint8)
        _fill(packed, records, block, template, swapped)
        yield packed.ravel()


def by_chainage(chainage: Float) -> Int32:
    """Order of growing values; equal ones stay as they come. Spread fairly evenly, they are binned and hardly compared."""
    chainage = np.ascontiguousarray(chainage)
    order, start = np.empty(len(chainage), np.int32), np.zeros(len(chainage) + 1, np.int32)
    if len(chainage) and not _binned(chainage, float(chainage.min()), float(chainage.max()), start, order):
        return np.argsort(chainage, kind="stable").astype(np.int32)
    return order


@kernel
def _binned(chainage: Float, low: float, high: float, start: Int32, order: Int32) -> bool:  # pragma: no cover - compiled
    """Write the order; return False if so many values are close together that comparing all is faster."""
    n = chainage.shape[0]
    scale = (n - 1) / (high - low) if high > low else 0.0
    for i in range(n):
        start[int((chainage[i] - low) * scale) + 1] += 1
    for b in range(n):
        start[b + 1] += start[b]
    for i in range(n):
        b = int((chainage[i] - low) * scale)
        order[start[b]] = i
        start[b] += 1
    for i in range(1, n):
        j = order[i]
        k = i
        while k > 0 and chainage[order[k - 1]] > chainage[j]:
            order[k] = order[k - 1]
            k -= 1
            if i - k > 1000:
                return False
        order[k] = j
    return True


@kernel
def _fill(packed: UInt8, rows: UInt8, order: Int32, template: UInt8, file_ids: UInt8) -> None:  # pragma: no cover - compiled
    for k in range(order.shape[0]):
        i = order[k]
        for b in range(_BYTES):
            packed[k, b] = template[b]
        for b in range(8):  # network order, from that of this machine
            packed[k, _CHAINAGE + b] = rows[i, _FROM_CHAINAGE + 7 - b]
            packed[k, _TIME + b] = rows[i, _FROM_TIME + 7 - b]
        for b in range(24):  # the geometry states its own order
            packed[k, _XYZ + b] = rows[i, _FROM_X + b]
        tag = np.int64(0)
        for b in range(4):
            packed[k, _SCAN + b] = rows[i, _FROM_SCAN + 3 - b]
            packed[k, _INTENSITY + b] = rows[i, _FROM_INTENSITY + 3 - b]
            tag |= np.int64(rows[i, _FROM_TAG + b]) << (8 * b)
        for b in range(4):
            packed[k, _FILE + b] = file_ids[tag, b]
        packed[k, _CLASS] = 0
        packed[k, _CLASS + 1] = rows[i, _FROM_CLASS]
