"""Points in text lines: located in one pass, then read in chunks of constant memory."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from tunneldb.arrays import Bool, Float
from tunneldb.errors import InputError
from tunneldb.pointcloud.formats.columns import COORDINATES, SKIPPED
from tunneldb.pointcloud.formats.faults import check_ranges, decoding, require_dimension
from tunneldb.pointcloud.formats.scans import PosedScan
from tunneldb.pointcloud.formats.text_lines import TextLines, parse
from tunneldb.pointcloud.points import COLOURS, Ranges, Raw, ScanHeader, colours_of
from tunneldb.pointcloud.stated_crs import StatedCrs

KIND = "a text"
BLOCK_LINES = 1 << 18

_LIMITS = {"scan_id": 1 << 31, "classification": 256}


@dataclass(frozen=True)
class TextScan:
    """Consecutive lines of points: a whole file, or one of its scans.

    Attributes
    ----------
    columns : tuple of str
        Names of the values in a line, by `columns.meaning_of`.
    divider : str or None
        Separator of values; None for blanks and tabs.
    pose : PosedScan or None
        Number and position of the scan, if the format has them.
    rotation : (3, 3) float64 array
        Rotation from the scan's own frame to the file's.
    empty_rays : bool
        True if a point at the scan's own 0, 0, 0 means a ray without an echo.
    """

    columns: tuple[str, ...]
    divider: str | None
    pose: PosedScan | None = None
    rotation: Float = field(default_factory=lambda: np.eye(3))
    empty_rays: bool = False

    @property
    def position(self) -> Float:
        """Offset of rotated coordinates, m."""
        return np.zeros(3) if self.pose is None or self.pose.position is None else self.pose.position

    def table(self, path: Path, block: bytes, line: int) -> TextTable:
        """Return the points of a block of lines that begins at ``line``, without rays that have no echo."""
        used = tuple(place for place, name in enumerate(self.columns) if name != SKIPPED)
        values = parse(path, block, line, self.divider, len(self.columns), used)
        table = TextTable(self, tuple(self.columns[place] for place in used), values)
        return table.some(np.any(table.own() != 0.0, axis=1)) if self.empty_rays else table


@dataclass(frozen=True)
class TextTable:
    """Numbers (n, k) of a scan's lines, with the names of their columns."""

    scan: TextScan
    names: tuple[str, ...]
    values: Float

    def __len__(self) -> int:
        return len(self.values)

    def some(self, chosen: Bool) -> TextTable:
        """Return the chosen rows."""
        return replace(self, values=self.values[chosen])

    def column(self, name: str) -> Float | None:
        """Return the column of that name; None if there is none."""
        return self.values[:, self.names.index(name)] if name in self.names else None

    def columns(self, names: Sequence[str]) -> Float:
        """Return the columns of these names (n, k)."""
        return self.values[:, [self.names.index(name) for name in names]]

    def own(self) -> Float:
        """Return coordinates in the scan's own frame (n, 3), m."""
        return self.columns(COORDINATES)

    def turned(self) -> Float:
        """Return coordinates rotated into the file's frame, without the scan's position (n, 3), m."""
        with np.errstate(invalid="ignore"):  # infinite coordinates become NaN
            return self.own() @ self.scan.rotation.T


@dataclass(frozen=True)
class Block:
    """Place of some points: first index and count, offset and length in the file (bytes), first line, index of the scan."""

    point: int
    points: int
    offset: int
    bytes: int
    line: int
    scan: int


@dataclass(frozen=True)
class TextCloud:
    """Contents of a text file, found by reading it once.

    Attributes
    ----------
    scans : tuple of TextScan
    blocks : tuple of Block
        Blocks in file order.
    low, high : (3,) float64 array
        Bounding box of the coordinates, m.
    """

    path: Path
    scans: tuple[TextScan, ...]
    blocks: tuple[Block, ...]
    low: Float
    high: Float

    @property
    def points(self) -> int:
        """Number of points."""
        return self.blocks[-1].point + self.blocks[-1].points

    @property
    def dimensions(self) -> tuple[str, ...]:
        """Dimensions of every scan, without coordinates."""
        first = [name for name in self.scans[0].columns if name not in (*COORDINATES, SKIPPED)]
        return tuple(name for name in first if all(name in scan.columns for scan in self.scans))

    @property
    def has_colours(self) -> bool:
        """True if the points of a scan have colours."""
        return any(set(COLOURS) <= set(scan.columns) for scan in self.scans)

    def header(self) -> ScanHeader:
        """Return the scan header of the file."""
        return ScanHeader(self.path, self.points, self.dimensions, StatedCrs(), self.low, self.high)


class CloudBuilder:
    """Builder of a `TextCloud`, scan by scan."""

    def __init__(self, path: Path, lines: TextLines) -> None:
        self.path, self.lines = path, lines
        self.scans: list[TextScan] = []
        self.blocks: list[Block] = []
        self.points = 0
        self.low, self.high = np.full(3, np.inf), np.full(3, -np.inf)

    def add(self, scan: TextScan, count: int | None) -> int:
        """Add the lines of a scan, `count` of them or all to the end; return how many there were."""
        taken = 0
        while count is None or taken < count:
            line, offset = self.lines.line, self.lines.offset
            data, lines = self.lines.take(BLOCK_LINES if count is None else min(BLOCK_LINES, count - taken))
            if not lines:
                break
            table = scan.table(self.path, data, line)
            taken += lines
            if not len(table):
                continue
            turned = table.turned()
            placed = turned[np.isfinite(turned).all(axis=1)] + scan.position
            self.low = np.minimum(self.low, placed.min(axis=0, initial=np.inf))
            self.high = np.maximum(self.high, placed.max(axis=0, initial=-np.inf))
            self.blocks.append(Block(self.points, len(table), offset, len(data), line, len(self.scans)))
            self.points += len(table)
        self.scans.append(scan)
        return taken

    def cloud(self) -> TextCloud:
        """Return the completed cloud.

        Raises
        ------
        InputError
            If there are no points.
        """
        if not self.points:
            raise InputError(f"{self.path}: the file holds no points")
        return TextCloud(self.path, tuple(self.scans), tuple(self.blocks), self.low, self.high)


def read_cloud(
    cloud: TextCloud, dimension: str | None, size: int, ranges: Ranges | None, colours: bool = False
) -> Iterator[Raw]:
    """Read the points of a text file chunk by chunk; see `tunneldb.pointcloud.formats.raw.read_raw`."""
    path = cloud.path
    require_dimension(path, dimension, cloud.dimensions)
    starts = [block.point for block in cloud.blocks]
    for begin, end in check_ranges(path, ranges, cloud.points):
        first = int(np.searchsorted(starts, begin, side="right")) - 1
        for block in cloud.blocks[first:]:
            if block.point >= end:
                break
            raw = _read_block(cloud, block, dimension, colours)
            at, stop = max(begin - block.point, 0), min(end - block.point, block.points)
            for place in range(at, stop, size):
                yield raw.part(place, min(place + size, stop))


def _read_block(cloud: TextCloud, block: Block, dimension: str | None, colours: bool) -> Raw:
    with decoding(cloud.path, KIND), cloud.path.open("rb") as file:
        file.seek(block.offset)
        data = file.read(block.bytes)
    scan = cloud.scans[block.scan]
    table = scan.table(cloud.path, data, block.line)
    if len(table) != block.points:
        raise InputError(f"{cloud.path}: the file was changed while it was read")
    turned = table.turned()
    numbers = _whole(cloud.path, table, block, "scan_id")
    classes = _whole(cloud.path, table, block, "classification")
    if numbers is None:
        numbers = np.full(len(table), 0 if scan.pose is None else scan.pose.number)
    return Raw(
        turned[:, 0],
        turned[:, 1],
        turned[:, 2],
        np.ones(3),
        scan.position,
        table.column("gps_time"),
        numbers.astype(np.int32),
        None if dimension is None else table.column(dimension),
        None if classes is None else classes.astype(np.uint8),
        colours_of(table.columns(COLOURS)) if colours and set(COLOURS) <= set(table.names) else None,
    )


def _whole(path: Path, table: TextTable, block: Block, name: str) -> Float | None:
    values = table.column(name)
    if values is None:
        return None
    wrong = ~((values >= 0) & (values < _LIMITS[name]) & (values == np.floor(values)))
    if wrong.any():
        row = int(np.argmax(wrong))
        raise InputError(
            f"{path}: {name} of point {block.point + row + 1} is {values[row]:g}, not a whole number from 0 to "
            f"{_LIMITS[name] - 1}"
        )
    return values
