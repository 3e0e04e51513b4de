"""LAS and LAZ files, read in chunks of constant memory."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import laspy
import numpy as np
from laspy import DecompressionSelection, LazBackend
from numpy.typing import NDArray

from tunneldb.arrays import Float
from tunneldb.counted import counted
from tunneldb.errors import InputError
from tunneldb.pointcloud.formats.faults import check_ranges, decoding, require_dimension
from tunneldb.pointcloud.formats.las_bounds import POINTWISE, check_envelope, count_contradiction, point_counts
from tunneldb.pointcloud.formats.las_header import HEADER_SIZE
from tunneldb.pointcloud.formats.laz_chunks import VariedChunks, count_points
from tunneldb.pointcloud.points import CHUNK, COLOURS, Ranges, Raw, ScanHeader
from tunneldb.pointcloud.stated_crs import StatedCrs, stated_in_las
from tunneldb.threads import threads

KIND = "a LAS or LAZ"
FIRST_OF_WKT = 6
"""Point format from which a coordinate system is stated by WKT only."""


COLOURED = frozenset((2, 3, 5, 7, 8, 10))
"""Point formats with colours."""

_POINT_FORMAT = 104  # its offset in the header, bytes; the highest bits mark compression


@dataclass(frozen=True)
class ExtraBytes:
    """A dimension in the extra bytes of a point.

    laspy reads only the first record of extra bytes, but files of some makers have a record for each dimension; so the
    records are read here.

    Attributes
    ----------
    name : str
    dtype : dtype
        Stored type; several values per point make a subarray.
    at : int
        Offset in the extra bytes of a point, bytes.
    scale, offset : float
        Value = stored × scale + offset.
    no_data : number or None
        Stored value that means no data.
    """

    name: str
    dtype: np.dtype[Any]
    at: int
    scale: float = 1.0
    offset: float = 0.0
    no_data: Any = None

    def stored(self, array: NDArray[Any], before: int) -> NDArray[Any]:
        """Return a view of the dimension in an array of records that have ``before`` bytes before the extra ones."""
        return np.ndarray(array.shape, self.dtype, array.data, before + self.at, array.strides)


def read_las_header(path: Path) -> ScanHeader:
    """Read the header of a LAS or LAZ file; see `tunneldb.pointcloud.reader.read_header`."""
    with decoding(path, KIND):
        check_envelope(path)
        las = open_las(path)
    with decoding(path, KIND), las, path.open("rb") as source:
        header = las.header
        dimensions = _dimensions(header)
        scales, offsets, count = header.scales, header.offsets, int(header.point_count)
        stored = count_points(source, header)
        if stored is not None and stored != count:
            raise ValueError(f"its header states {count} points, but it contains {stored}; export it again")
        stated = _stated_crs(header)
        notes = tuple(filter(None, [count_contradiction(path)]))
    if count == 0:
        raise InputError(f"{path}: the file holds no points")
    _check_scales(path, scales, offsets)
    return ScanHeader(path, count, dimensions, stated, np.array(header.mins), np.array(header.maxs), notes=notes)


def has_las_colours(path: Path) -> bool:
    """Return True if the point format of a LAS or LAZ file has colours; reads the beginning of the header only."""
    with decoding(path, KIND), path.open("rb") as file:
        start = file.read(_POINT_FORMAT + 1)
    return len(start) > _POINT_FORMAT and start[_POINT_FORMAT] & 0b111111 in COLOURED


def open_las(path: Path, **options: Any) -> laspy.LasReader:
    """Open a LAS or LAZ file whose header was checked, with its number of points from the field that has it."""
    las = laspy.open(path, **options)
    with path.open("rb") as file:
        las.header.point_count = point_counts(file.read(HEADER_SIZE))[0]
    return las


def _stated_crs(header: laspy.LasHeader) -> StatedCrs:
    records: dict[int, bytes] = {}
    for record in [*header.vlrs, *(header.evlrs or ())]:
        if record.user_id.strip("\0 ") == "LASF_Projection":
            records.setdefault(record.record_id, record.record_data_bytes())
    wkt_counts = bool(header.global_encoding.wkt) or header.point_format.id >= FIRST_OF_WKT
    return stated_in_las(records, wkt_counts=wkt_counts)


def read_las_facts(path: Path) -> tuple[str, str | None]:
    """Return version and point format of a LAS or LAZ file, and the kind of its times by the header; None if it has none."""
    with decoding(path, KIND):
        check_envelope(path)
        las = open_las(path)
    with decoding(path, KIND), las:
        header = las.header
        kind = "LAZ" if header.are_points_compressed else "LAS"
        name = f"{kind} {header.version}, point format {header.point_format.id}"
        if "gps_time" not in header.point_format.dimension_names:
            return name, None
        standard = header.global_encoding.gps_time_type == laspy.header.GpsTimeType.STANDARD
        return name, "adjusted standard GPS time" if standard else "seconds of the GPS week, or no GPS time"


def read_las(
    path: Path, dimension: str | None, size: int, ranges: Ranges | None = None, colours: bool = False
) -> Iterator[Raw]:
    """Read a LAS or LAZ file chunk by chunk; see `tunneldb.pointcloud.formats.raw.read_raw`.

    If the point format allows it, only the needed parts of compressed points are decoded, in as many threads as
    `tunneldb.threads.threads` states.
    """
    with decoding(path, KIND):
        check_envelope(path)
        las = open_las(path, laz_backend=_backends())
    with las, path.open("rb") as source:
        with decoding(path, KIND):
            header = las.header
            require_dimension(path, dimension, _dimensions(header))
            _check_scales(path, header.scales, header.offsets)
            take = _Taker(path, header, dimension, colours)
            las.decompression_selection = take.selection()
            pointwise = is_pointwise(header)
            varied = VariedChunks(source, header, take.selection()) if VariedChunks.has(header) else None
        for begin, end in check_ranges(path, ranges, int(header.point_count)):
            records = varied.read(begin, end, size) if varied else _read(las, begin, end, size, pointwise)
            done = begin
            while done < end:
                with decoding(path, KIND):
                    raw = take(next(records))
                if len(raw) == 0:
                    raise InputError(f"{path}: truncated: {done} points read, but its header states {header.point_count}")
                done += len(raw)
                yield raw


def _read(las: laspy.LasReader, begin: int, end: int, size: int, pointwise: bool) -> Iterator[laspy.ScaleAwarePointRecord]:
    seek(las, begin, pointwise)
    for at in range(begin, end, size):
        yield las.read_points(min(size, end - at))


def seek(las: laspy.LasReader, point: int, pointwise: bool) -> None:
    """Go to a point of a file; where `is_pointwise`, the points before it are read and discarded."""
    if las.points_read == point:
        return
    if not pointwise:
        las.seek(point)
        return
    if las.points_read > point:
        raise ValueError(f"point {point} is before point {las.points_read}, and the file has no chunk table")
    while las.points_read < point:
        las.read_points(min(CHUNK, point - las.points_read))


def is_pointwise(header: laspy.LasHeader) -> bool:
    """Return True for LAZ without a chunk table, as LASzip wrote it before version 2.0; only before points are read."""
    if not header.are_points_compressed:
        return False
    return int.from_bytes(header.vlrs.get("LasZipVlr")[0].record_data[:2], "little") == POINTWISE


class _Taker:
    """Reader of the requested dimensions of records."""

    def __init__(self, path: Path, header: laspy.LasHeader, dimension: str | None, colours: bool) -> None:
        self.path = path
        self.dimension = dimension
        self.has_time = "gps_time" in header.point_format.dimension_names
        self.coloured = colours and "red" in header.point_format.dimension_names
        self.before = header.point_format.size - header.point_format.num_extra_bytes
        self.extra = next((extra for extra in _extra_bytes(header) if extra.name == dimension), None)
        if self.extra is not None and self.extra.dtype.subdtype is not None:
            raise InputError(f"{path}: {dimension} has several values per point; an intensity is one number")

    def selection(self) -> DecompressionSelection:
        """Return the parts of a point to decompress; extra bytes are decompressed all or not at all."""
        every = DecompressionSelection
        selected = every.base() | every.Z | every.CLASSIFICATION | every.POINT_SOURCE_ID | every.GPS_TIME
        if self.coloured:
            selected |= every.RGB
        if self.dimension is None:
            return selected
        if self.extra is not None:
            return selected | every.ALL_EXTRA_BYTES
        return selected | every.INTENSITY if self.dimension == "intensity" else every.all()

    def __call__(self, record: Any) -> Raw:
        array = record.array
        return Raw(
            array["X"],
            array["Y"],
            array["Z"],
            np.array(record.scales, np.float64),
            np.array(record.offsets, np.float64),
            array["gps_time"] if self.has_time else None,
            array["point_source_id"],
            self._intensity(record),
            np.asarray(record["classification"]),
            np.column_stack([array[name] for name in COLOURS]) if self.coloured else None,
        )

    def _intensity(self, record: Any) -> NDArray[Any] | None:
        if self.dimension is None:
            return None
        if self.extra is None:
            return np.asarray(record[self.dimension])
        stored = self.extra.stored(record.array, self.before)
        if self.extra.no_data is not None:
            missing = int(np.count_nonzero(stored == self.extra.no_data))
            if missing:
                raise InputError(
                    f"{self.path}: {counted(missing, 'point')} of a chunk without {self.dimension}, with the header's no-data"
                    f" value {self.extra.no_data}; remove these points, or the no-data entry of the header"
                )
        if self.extra.scale == 1.0 and self.extra.offset == 0.0:
            return stored
        return stored * self.extra.scale + self.extra.offset


def _extra_bytes(header: laspy.LasHeader) -> list[ExtraBytes]:
    """Return the dimensions in the extra bytes that the header describes, in the order of the bytes."""
    found: list[ExtraBytes] = []
    at = 0
    for record in (record for record in header.vlrs if isinstance(record, laspy.vlrs.known.ExtraBytesVlr)):
        for struct in record.extra_bytes_structs:
            dtype = np.dtype(struct.dtype())
            if at + dtype.itemsize > header.point_format.num_extra_bytes:
                return found
            scalar = dtype.subdtype is None and struct.data_type != 0
            scale = float(struct.scale[0]) if scalar and struct.scale is not None else 1.0
            offset = float(struct.offset[0]) if scalar and struct.offset is not None else 0.0
            no_data = struct.no_data[0] if scalar and struct.no_data is not None else None
            found.append(ExtraBytes(struct.format_name(), dtype, at, scale, offset, no_data))
            at += dtype.itemsize
    return found


def _dimensions(header: laspy.LasHeader) -> tuple[str, ...]:
    standard = tuple(header.point_format.standard_dimension_names)
    return standard + tuple(extra.name for extra in _extra_bytes(header))


def _backends() -> tuple[LazBackend, ...]:
    return (LazBackend.Lazrs,) if threads() == 1 else (LazBackend.LazrsParallel, LazBackend.Lazrs)


def _check_scales(path: Path, scales: Float, offsets: Float) -> None:
    with np.errstate(over="ignore", invalid="ignore"):
        farthest = np.abs(scales) * 2.0**31 + np.abs(offsets)
    if not (np.all(np.isfinite(farthest)) and np.all(scales > 0)):
        raise InputError(
            f"{path}: the header's scale {_row(scales)} or offset {_row(offsets)} is not a usable number, "
            "so the coordinates are invalid"
        )


def _row(values: Float) -> str:
    return "(" + ", ".join(f"{value:g}" for value in values) + ")"
