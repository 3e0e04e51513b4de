"""Scan files written again with other classes or further dimensions, as LAZ 1.4, in chunks of constant memory.

Nothing else of a point changes: coordinates, scales and offsets, all other dimensions, extra bytes, coordinate
system, records and dates are the input's. Where its point format has no room for classes over 31, the next one that holds
the same takes its place.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import laspy
import numpy as np
from laspy import DecompressionSelection, LazBackend

from tunneldb.arrays import Float, Int64, UInt8, UInt32
from tunneldb.errors import InputError
from tunneldb.pointcloud.formats.e57 import is_e57
from tunneldb.pointcloud.formats.e57_records import E57Records
from tunneldb.pointcloud.formats.faults import decoding
from tunneldb.pointcloud.formats.las import KIND, read_las_header
from tunneldb.pointcloud.formats.las_header import Head, read_head
from tunneldb.pointcloud.formats.las_records import FORMAT_OF, coordinates, fields, record_size, upgraded
from tunneldb.pointcloud.formats.laz import writing
from tunneldb.pointcloud.formats.raw_records import RawRecords
from tunneldb.pointcloud.formats.table import format_of
from tunneldb.pointcloud.points import CHUNK
from tunneldb.threads import threads

Classes = Callable[[Float], UInt8]
"""Gives points (n, 3) their classes (n,)."""


_EVERYTHING = DecompressionSelection.all()


@dataclass(frozen=True)
class Source:
    """What is to be written: what surrounds the points, the points in chunks, what of the header is known only afterwards."""

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
    """Write a scan file again, each point with the class that it is given.

    Parameters
    ----------
    source : Path
        Scan file. Of E57, what `tunneldb.pointcloud.formats.e57_records.E57Records` says, of PTX, PTS, PLY and other
        tables `tunneldb.pointcloud.formats.raw_records.RawRecords`.
    target : Path
        LAZ file to write; it must not exist.
    classes : callable
        Called with each chunk's coordinates (n, 3), m, in the order of the file.
    names : mapping of int to str
        Names of the classes, for whoever opens the file.
    progress : callable
        Takes the number of points of each chunk that is written.
    size : int
        Greatest number of points of a chunk.

    Returns
    -------
    (256,) int64 array
        How many points each class has.

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
    """Write a scan file again, each point with further whole numbers.

    Parameters
    ----------
    source, target, progress, size
        As of `rewrite`.
    numbers : iterable of sequences of (n,) arrays
        The numbers of the points in the order of the file, an array for each name; in pieces of any length.
    names : mapping of str to str
        Names of the dimensions, and what they are.

    Raises
    ------
    InputError
        As of `rewrite`, and if the file has a dimension of that name.
    OSError
        If the target cannot be written.
    """
    what = records_of(source, size)
    try:
        head = what.head.with_numbers(names, record_size(what.head.point_format))
    except ValueError as error:
        raise InputError(f"{source}: it has a dimension {str(error)!r} already; write it without") from None
    values = _Pieces(numbers)
    with writing(target, head) as writer:
        for records in what.chunks:
            added = np.column_stack(values.take(len(records))).astype("<u4").view(np.uint8).reshape(len(records), -1)
            writer.write(np.concatenate([records, added], axis=1))
            progress(len(records))
        writer.close(what.patches())


class _Pieces:
    """Arrays that come in pieces, taken by so many elements."""

    def __init__(self, pieces: Iterable[Sequence[UInt32]]) -> None:
        self.pieces = iter(pieces)
        self.rest: list[UInt32] = []

    def take(self, count: int) -> list[UInt32]:
        """So many elements of each."""
        while not self.rest or len(self.rest[0]) < count:
            piece = next(self.pieces)
            self.rest = [np.concatenate(pair) for pair in zip(self.rest, piece, strict=True)] if self.rest else list(piece)
        taken = [array[:count] for array in self.rest]
        self.rest = [array[count:] for array in self.rest]
        return taken


def records_of(path: Path, size: int = CHUNK, only: Collection[int] | None = None) -> Source:
    """Points of a scan file as records of LAS with room for classes, to be read once.

    Parameters
    ----------
    path : Path
    size : int
        Greatest number of points of a chunk.
    only : collection of int
        Numbers of the chunks that are wanted, from 0; those of LAS between them are not read.

    Raises
    ------
    InputError
        If the file cannot be read, or holds waveforms; while it is read, if it is cut off.
    """
    return _of_las(path, size, only) if format_of(path).is_las else _of_others(path, size, only)


def read_coordinates(path: Path, size: int = CHUNK) -> Iterator[Float]:
    """Read the coordinates (n, 3) of a scan file's points, m, chunk by chunk, and nothing else of them.

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
        raise InputError(f"{path}: its waveforms would be lost: write it without them, or with them in a separate file")
    if head.points != header.points:
        raise InputError(f"{path}: its header announces {head.points} and {header.points} points; mend the file")
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
        las = laspy.open(path, laz_backend=backends, read_evlrs=False, decompression_selection=selection)
    with las:
        done = at = 0
        while done < count:
            if only is not None and done // size not in only:
                done += size
                continue
            with decoding(path, KIND):
                if at != done:
                    las.seek(done)
                array = las.read_points(size).array
            if len(array) == 0:
                raise InputError(f"{path}: truncated: {done} points read of the {count} that its header announces")
            done += len(array)
            at = done
            yield array.view(np.uint8).reshape(len(array), -1)


def _records(path: Path) -> E57Records | RawRecords:
    return E57Records(path) if is_e57(path) else RawRecords(path)


def _of_others(path: Path, size: int, only: Collection[int] | None) -> Source:
    source = _records(path)
    chunks = (records for number, records in enumerate(source.read(size)) if only is None or number in only)
    return Source(source.head, chunks, source.patches)
