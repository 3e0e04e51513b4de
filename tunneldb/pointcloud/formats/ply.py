"""PLY files, ascii and binary: the vertices and their properties.

Source: G. Turk, *The PLY Polygon File Format*, 1994.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tunneldb.arrays import Float
from tunneldb.errors import InputError
from tunneldb.pointcloud.formats.columns import COORDINATES, meaning_of
from tunneldb.pointcloud.formats.faults import check_ranges, decoding, require_dimension
from tunneldb.pointcloud.formats.text import CloudBuilder, TextCloud, TextScan, read_cloud
from tunneldb.pointcloud.formats.text_lines import TextLines
from tunneldb.pointcloud.points import CHUNK, COLOURS, Ranges, Raw, ScanHeader, colours_of
from tunneldb.pointcloud.stated_crs import stated_in_comments

KIND = "a PLY"
MAX_ROUNDING = 0.01
"""Greatest rounding of coordinates, m; coarser rounding would show in sections and outlines."""

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2",
    "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_MAX_HEADER_LINES = 10_000  # lines


@dataclass(frozen=True)
class Vertices:
    """Vertices of a PLY file.

    Attributes
    ----------
    order : str
        Byte order in NumPy's notation; empty for ascii.
    names : tuple of str
        Names of the properties, by `columns.meaning_of`.
    types : tuple of str
    count : int
    offset : int
        Start of the vertices in a binary file, bytes.
    last : bool
        True if no other element follows the vertices.
    comments : tuple of str
        Comments of the header.
    """

    order: str
    names: tuple[str, ...]
    types: tuple[str, ...]
    count: int
    offset: int
    last: bool
    comments: tuple[str, ...] = ()

    @property
    def dtype(self) -> np.dtype[Any]:
        """NumPy type of a vertex of a binary file."""
        return np.dtype([(name, self.order + kind) for name, kind in zip(self.names, self.types, strict=True)])

    @property
    def dimensions(self) -> tuple[str, ...]:
        """Dimensions of a vertex, without coordinates."""
        return tuple(name for name in self.names if name not in COORDINATES)


def read_ply_header(path: Path) -> ScanHeader:
    """Read the header of a PLY file, and the bounding box from its points; see `tunneldb.pointcloud.reader.read_header`."""
    with decoding(path, KIND):
        status = path.stat()
    found, _, low, high = _look_through(path, (status.st_size, status.st_mtime_ns))
    step = _step(found, low, high)
    if step > MAX_ROUNDING:
        raise InputError(
            f"{path}: its coordinates are 32-bit numbers, whose resolution is only {step:.3g} m so far from the origin; "
            "export them as double, or closer to the origin"
        )
    return ScanHeader(path, found.count, found.dimensions, stated_in_comments(found.comments), low, high)


def has_ply_colours(path: Path) -> bool:
    """Return True if the vertices of a PLY file have colours."""
    with decoding(path, KIND):
        status = path.stat()
    return set(COLOURS) <= set(_look_through(path, (status.st_size, status.st_mtime_ns))[0].names)


def read_ply(
    path: Path, dimension: str | None, size: int, ranges: Ranges | None = None, colours: bool = False
) -> Iterator[Raw]:
    """Read a PLY file chunk by chunk; see `tunneldb.pointcloud.formats.raw.read_raw`."""
    with decoding(path, KIND):
        status = path.stat()
    found, text, _, _ = _look_through(path, (status.st_size, status.st_mtime_ns))
    if text is not None:
        yield from read_cloud(text, dimension, size, ranges, colours)
        return
    require_dimension(path, dimension, found.dimensions)
    coloured = colours and set(COLOURS) <= set(found.names)
    for begin, end in check_ranges(path, ranges, found.count):
        for at in range(begin, end, size):
            with decoding(path, KIND):
                vertices = _read(path, found, at, min(size, end - at))
            yield Raw(
                vertices["x"],
                vertices["y"],
                vertices["z"],
                np.ones(3),
                np.zeros(3),
                vertices["gps_time"].astype(np.float64) if "gps_time" in found.names else None,
                vertices["scan_id"].astype(np.int32) if "scan_id" in found.names else np.zeros(len(vertices), np.int32),
                None if dimension is None else vertices[dimension],
                vertices["classification"].astype(np.uint8) if "classification" in found.names else None,
                colours_of(np.column_stack([vertices[name] for name in COLOURS])) if coloured else None,
            )


@lru_cache(maxsize=64)
def _look_through(path: Path, version: tuple[int, int]) -> tuple[Vertices, TextCloud | None, Float, Float]:
    """Return vertices, their lines in an ascii file, and their bounding box; read once for each version of a file."""
    with decoding(path, KIND), TextLines(path) as lines:
        found = _read_header(path, lines)
        if not found.order:
            return _ascii(path, lines, found)
        size = path.stat().st_size
        if size < found.offset + found.count * found.dtype.itemsize:
            raise InputError(
                f"{path}: truncated: its header states {found.count} vertices, but the file has space for "
                f"{(size - found.offset) // found.dtype.itemsize}"
            )
        beyond, rest = divmod(size - found.offset - found.count * found.dtype.itemsize, found.dtype.itemsize)
        if found.last and beyond and not rest:
            raise InputError(
                f"{path}: its header states {found.count} vertices, but it contains {found.count + beyond}; export it again"
            )
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for at in range(0, found.count, CHUNK):
            vertices = _read(path, found, at, min(CHUNK, found.count - at))
            low = np.fmin(low, [np.fmin.reduce(vertices[name]) for name in COORDINATES])
            high = np.fmax(high, [np.fmax.reduce(vertices[name]) for name in COORDINATES])
    return found, None, low, high


def _ascii(path: Path, lines: TextLines, found: Vertices) -> tuple[Vertices, TextCloud, Float, Float]:
    builder = CloudBuilder(path, lines)
    count = builder.add(TextScan(found.names, None), found.count)
    if count < found.count:
        raise InputError(f"{path}: truncated: its header states {found.count} vertices, but {count} lines follow")
    cloud = builder.cloud()
    return found, cloud, cloud.low, cloud.high


def _read(path: Path, found: Vertices, first: int, count: int) -> NDArray[Any]:
    dtype = found.dtype
    vertices: NDArray[Any] = np.fromfile(path, dtype, count, offset=found.offset + first * dtype.itemsize)
    if len(vertices) != count:
        raise InputError(f"{path}: the file was changed while it was read")
    return vertices


def _step(found: Vertices, low: Float, high: Float) -> float:
    """Return the resolution of the coarsest coordinate at the bounding box's farthest corner, m."""
    farthest = np.fmax(np.abs(low), np.abs(high))
    kinds = [found.types[found.names.index(name)] for name in COORDINATES]
    steps = [np.spacing(np.float32(value)) for value, kind in zip(farthest, kinds, strict=True) if kind == "f4"]
    return float(max(steps, default=0.0))


def _read_header(path: Path, lines: TextLines) -> Vertices:
    if lines.text() != "ply":
        raise InputError(f"{path}: it does not begin with ply, so it is not a PLY file")
    order: str | None = None
    comments: list[str] = []
    elements: list[tuple[str, int, list[tuple[str, str]]]] = []
    for _ in range(_MAX_HEADER_LINES):
        words = (lines.text() or "").split()
        match words:
            case ["format", name, _] if name in _ORDERS:
                order = _ORDERS[name]
            case ["comment" | "obj_info", *comment]:
                comments.append(" ".join(comment))
            case ["element", name, count] if count.isascii() and count.isdigit():
                elements.append((name, int(count), []))
            case ["property", "list", _, _, name] if elements:
                elements[-1][2].append((name, ""))
            case ["property", kind, name] if elements and kind in _TYPES:
                elements[-1][2].append((name, _TYPES[kind]))
            case ["end_header"]:
                break
            case _:
                raise InputError(f"{path}, line {lines.line - 1}: {' '.join(words)[:60]!r} is not a line of a PLY header")
    if order is None:
        raise InputError(f"{path}: its header states no format; expected ascii, binary_little_endian or binary_big_endian")
    return replace(_vertices(path, order, elements, lines), comments=tuple(comments))


def _vertices(path: Path, order: str, elements: list[tuple[str, int, list[tuple[str, str]]]], lines: TextLines) -> Vertices:
    offset = lines.offset
    for element, count, properties in elements:
        if any(not kind for _, kind in properties):
            raise InputError(f"{path}: element {element} has a list before or in the vertices; export only the points")
        if element == "vertex":
            break
        offset += count * sum(np.dtype(kind).itemsize for _, kind in properties)
        if not order:
            lines.skip(count)
    else:
        raise InputError(f"{path}: it has no element vertex; it has {', '.join(name for name, _, _ in elements) or 'none'}")
    if not count:
        raise InputError(f"{path}: the file holds no points")
    names = tuple(meaning_of(name) for name, _ in properties)
    missing = [name for name in COORDINATES if name not in names]
    if missing or len(set(names)) < len(names):
        wrong = f"no property {', '.join(missing)}" if missing else "a property twice"
        raise InputError(f"{path}: its vertices have {wrong}: {', '.join(name for name, _ in properties)}")
    return Vertices(order, names, tuple(kind for _, kind in properties), count, offset, elements[-1][0] == "vertex")
