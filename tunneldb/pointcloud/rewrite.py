"""Copying of scan files with other classes or additional dimensions, as LAZ 1.4, in chunks of constant memory.

Nothing else of a point changes: coordinates, scales and offsets, all other dimensions, extra bytes, coordinate system,
records and dates are those of the input. If its point format has no space for classes over 31, the next format with the
same fields is used.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from laspy import DecompressionSelection, LazBackend

from tunneldb.arrays import Float, Int64, UInt8, UInt32
from tunneldb.errors import InputError
from tunneldb.pointcloud.formats.e57 import is_e57
from tunneldb.pointcloud.formats.e57_records import E57Records
from tunneldb.pointcloud.formats.faults import decoding
from tunneldb.pointcloud.formats.las import KIND, is_pointwise, open_las, read_las_header, seek
from tunneldb.pointcloud.formats.las_header import Head, read_head
from tunneldb.pointcloud.formats.las_records import FORMAT_OF, coordinates, fields, record_size, upgraded
from tunneldb.pointcloud.formats.laz import writing
from tunneldb.pointcloud.formats.raw_records import RawRecords
from tunneldb.pointcloud.formats.table import format_of
from tunneldb.pointcloud.points import CHUNK
from tunneldb.threads import threads

Classes = Callable[[Float], UInt8]
"""Function that returns the classes (n,) of points (n, 3)."""


_EVERYTHING = DecompressionSelection.all()


@dataclass(frozen=True)
class Source:
    """Data to write: header and records, points in chunks, and the header values that are known only afterwards."""

    head: Head
    chunks: Iterator[UInt8]
    patches: Callable[[], tuple[int, bytes] | None]


def rewrite(
    source: Path,
    target: Path,
    classes: Classes,
    names: Mapping[int, str],
    progress: Callable[[int], None] = lambda count: None,
    size: int = CHUNK,
) -> Int64:
    """Copy a scan file with the given class for each point.

    Parameters
    ----------
    source : Path
        Scan file. E57 is converted as described in `tunneldb.pointcloud.formats.e57_records.E57Records`, PTX, PTS, PLY and
        other tables as in `tunneldb.pointcloud.formats.raw_records.RawRecords`.
    target : Path
        LAZ file to write; it must not exist.
    classes : callable
        Function of each chunk's coordinates (n, 3), m, in the order of the file.
    names : mapping of int to str
        Names of the classes, stored in the file.
    progress : callable
        Function of the number of points of each chunk that is written.
    size : int
        Greatest number of points of a chunk.

    Returns
    -------
    (256,) int64 array
        Number of points of each class.

    Raises
    ------
    InputError
        If the source cannot be read, holds no points, or holds waveforms.
    OSError
        If the target cannot be written.
    """
    what = records_of(source, size)
    head = what.head.with_classes(names)
    counts = np.zeros(256, np.int64)
    with writing(target, head) as writer:
        for records in what.chunks:
            found = classes(coordinates(records, head.scales, head.offsets))
            fields(records, head.point_format)["classification"] = found
            writer.write(records)
            counts += np.bincount(found, minlength=256)
            progress(len(records))
        writer.close(what.patches())
    return counts


def rewrite_with_numbers(
    source: Path,
    target: Path,
    numbers: Iterable[Sequence[UInt32]],
    names: Mapping[str, str],
    progress: Callable[[int], None] = lambda count: None,
    size: int = CHUNK,
) -> None:
    """Copy a scan file with additional integer dimensions.

    Parameters
    ----------
    source, target, progress, size
        As for `rewrite`.
    numbers : iterable of sequences of (n,) arrays
        Numbers of the points in the order of the file, an array for each name; in pieces of any length.
    names : mapping of str to str
        Names of the dimensions, with descriptions.

    Raises
    ------
    InputError
        As for `rewrite`, and if the file already has a dimension of that name.
    OSError
        If the target cannot be written.
    """
    what = records_of(source, size)
    try:
        head = what.head.with_numbers(names, record_size(what.head.point_format))
    except ValueError as error:
        raise InputError(
            f"{source}: it already has a dimension {str(error)!r}, as files that tunneldb members writes; use the original scan"
        ) from None
    values = _Pieces(numbers)
    with writing(target, head) as writer:
        for records in what.chunks:
            added = np.column_stack(values.take(len(records))).astype("<u4").view(np.uint8).reshape(len(records), -1)
            writer.write(np.concatenate([records, added], axis=1))
            progress(len(records))
        writer.close(what.patches())


class _Pieces:
    """Arrays that arrive in pieces, taken by number of elements."""

    def __init__(self, pieces: Iterable[Sequence[UInt32]]) -> None:
        self.pieces = iter(pieces)
        self.rest: list[UInt32] = []

    def take(self, count: int) -> list[UInt32]:
        """Return the next ``count`` elements of each array."""
        while not self.rest or len(self.rest[0]) < count:
            piece = next(self.pieces)
            self.rest = [np.concatenate(pair) for pair in zip(self.rest, piece, strict=True)] if self.rest else list(piece)
        taken = [array[:count] for array in self.rest]
        self.rest = [array[count:] for array in self.rest]
        return taken


def records_of(path: Path, size: int = CHUNK, only: Collection[int] | None = None) -> Source:
    """Return the points of a scan file as LAS records with space for classes, to be read once.

    Parameters
    ----------
    path : Path
    size : int
        Greatest number of points of a chunk.
    only : collection of int
        Indices of the requested chunks, from 0; chunks of LAS between them are not read.

    Raises
    ------
    InputError
        If the file cannot be read, or holds waveforms; while reading, if it is truncated.
    """
    return _of_las(path, size, only) if format_of(path).is_las else _of_others(path, size, only)


def read_coordinates(path: Path, size: int = CHUNK) -> Iterator[Float]:
    """Read only the coordinates (n, 3) of a scan file's points, m, chunk by chunk.

    Raises
    ------
    InputError
        If the file cannot be read, or holds no points.
    """
    if not format_of(path).is_las:
        source = _records(path)
        for records in source.read(size):
            yield coordinates(records, source.head.scales, source.head.offsets)
        return
    count = read_las_header(path).points
    with decoding(path, KIND):
        head = read_head(path)
    for records in _read(path, count, size, DecompressionSelection.base() | DecompressionSelection.Z):
        yield coordinates(records, head.scales, head.offsets)


def _of_las(path: Path, size: int, only: Collection[int] | None) -> Source:
    header = read_las_header(path)
    with decoding(path, KIND):
        head = read_head(path)
    if head.holds_waveforms:
        raise InputError(f"{path}: it holds waveforms, which would be lost; export it without them, or to a separate file")
    if head.points != header.points:
        raise InputError(f"{path}: its header states both {head.points} and {header.points} points; export the file again")
    before = head.point_format
    after = FORMAT_OF[before]
    head = head.with_points(after, record_size(after) + head.record_size - record_size(before)).with_crs(header.crs)
    chunks = _read(path, header.points, size, only=only)
    return Source(head, (upgraded(records, before) for records in chunks), lambda: None)


def _read(
    path: Path,
    count: int,
    size: int,
    selection: DecompressionSelection = _EVERYTHING,
    only: Collection[int] | None = None,
) -> Iterator[UInt8]:
    backends = (LazBackend.Lazrs,) if threads() == 1 else (LazBackend.LazrsParallel, LazBackend.Lazrs)
    with decoding(path, KIND):
        las = open_las(path, laz_backend=backends, read_evlrs=False, decompression_selection=selection)
        pointwise = is_pointwise(las.header)
    with las:
        done = at = 0
        while done < count:
            if only is not None and done // size not in only:
                done += size
                continue
            with decoding(path, KIND):
                if at != done:
                    seek(las, done, pointwise)
                array = las.read_points(size).array
            if len(array) == 0:
                raise InputError(f"{path}: truncated: {done} points read, but its header states {count}")
            done += len(array)
            at = done
            yield array.view(np.uint8).reshape(len(array), -1)


def _records(path: Path) -> E57Records | RawRecords:
    return E57Records(path) if is_e57(path) else RawRecords(path)


def _of_others(path: Path, size: int, only: Collection[int] | None) -> Source:
    source = _records(path)
    chunks = (records for number, records in enumerate(source.read(size)) if only is None or number in only)
    return Source(source.head, chunks, source.patches)
