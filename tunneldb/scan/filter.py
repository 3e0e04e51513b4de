"""One scan file, from its points to those that go into the database."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from queue import Queue
from threading import Event, Thread
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tunneldb.errors import UserError
from tunneldb.geometry.alignment import KILOMETRE, Alignment
from tunneldb.scan.noise import DIAMETER, POINTS, CellCounts, is_noise, search_radii
from tunneldb.scan.pose import PoseFaults, PoseModel
from tunneldb.scan.reader import CHUNK, Points, read_chunks
from tunneldb.scan.spool import BINS_PER_METRE, ROW, Rows, Spool, bin_of, rows_xyz, windows
from tunneldb.scan.thin import thin, voxel_edge

T = TypeVar("T")
Progress = Callable[[int], None]

MEMORY = 192 << 20  # bytes of rows that each spool holds before it goes to disk
WINDOW = 500_000  # points filtered at a time by each thread
CROWDED = 2_000_000  # from this many points in one window on, one thread, for the sake of memory
BLOCK = 50_000  # points of a LAZ file that can be decoded by themselves
MARGIN = 10.0  # m beyond its ends that a kilometre is looked up in a file for what happens at its end
STRETCH = 5.0  # m of tunnel for which the noise filter's widest radius is found
# A distance in space is at most this many times as long in chainage: a point 25 m inside a curve of 75 m radius.
STRETCHING = 1.5


@dataclass(frozen=True)
class FilterSettings:
    """How the points of a file are chosen.

    Attributes
    ----------
    density : float or None
        Survey density, points per m²; None keeps every point.
    noise_points : int
        A point with fewer points than this in its neighbourhood, itself included, is noise.
    noise_diameter : float
        Diameter of the neighbourhood at full density, m.
    max_distance : float
        Points farther than this from the given axis are outside, m.
    """

    density: float | None = 100.0
    noise_points: int = POINTS
    noise_diameter: float = DIAMETER
    max_distance: float = 25.0

    @property
    def edge(self) -> float | None:
        """Voxel edge of thinning, m; None when every point is kept."""
        return None if self.density is None else voxel_edge(self.density)


@dataclass
class FilterCounts:
    """What became of the points of a file: points = noise + outside + thinned + kept.

    Attributes
    ----------
    points, outside, noise, kept : int
        Points read; beyond the ends of the axis or too far from it; noise; kept after thinning.
    chainage : (float, float)
        Least and greatest chainage of the points kept, m.
    extent : (6,) float64 array
        Least and greatest x, y, z of the points kept: x0, y0, z0, x1, y1, z1, m.
    ranges : dict of int to list of (int, int)
        Where in the file the points of each kilometre and MARGIN beyond are: ranges of point numbers from 0.
    """

    points: int = 0
    outside: int = 0
    noise: int = 0
    kept: int = 0
    chainage: tuple[float, float] = (math.inf, -math.inf)
    extent: NDArray[np.float64] = field(default_factory=lambda: np.array([np.inf] * 3 + [-np.inf] * 3))
    ranges: dict[int, list[tuple[int, int]]] = field(default_factory=dict)

    @property
    def thinned(self) -> int:
        """Points that thinning left out."""
        return self.points - self.outside - self.noise - self.kept

    def locate(self, first: int, near: NDArray[np.intp], chainage: NDArray[np.float64]) -> None:
        """Note where in the file kilometres are: chainage of the points with numbers first + near, which grow."""
        if len(near) == 0:
            return
        number = first + near
        starts = np.flatnonzero(np.diff(number // BLOCK, prepend=-1))
        low = np.floor((np.minimum.reduceat(chainage, starts) - MARGIN) / KILOMETRE).astype(int)
        high = np.floor((np.maximum.reduceat(chainage, starts) + MARGIN) / KILOMETRE).astype(int)
        for block, lowest, highest in zip((number[starts] // BLOCK).tolist(), low.tolist(), high.tolist(), strict=True):
            for km in range(lowest, highest + 1):
                ranges = self.ranges.setdefault(km, [])
                if ranges and ranges[-1][1] >= block * BLOCK:
                    ranges[-1] = (ranges[-1][0], (block + 1) * BLOCK)
                else:
                    ranges.append((block * BLOCK, (block + 1) * BLOCK))

    def keep(self, rows: Rows) -> None:
        """Count rows that are kept."""
        self.kept += len(rows)
        if len(rows):
            low, high = float(rows["chainage"].min()), float(rows["chainage"].max())
            self.chainage = (min(self.chainage[0], low), max(self.chainage[1], high))
            for column, name in enumerate("xyz"):
                self.extent[column] = min(self.extent[column], rows[name].min())
                self.extent[column + 3] = max(self.extent[column + 3], rows[name].max())


def filter_file(
    path: Path,
    dimension: str | None,
    alignment: Alignment,
    poses: PoseModel,
    settings: FilterSettings,
    survivors: Spool,
    tag: int,
    progress: Progress = lambda points: None,
    memory: int = MEMORY,
    chunk: int = CHUNK,
) -> FilterCounts:
    """Read a scan file at full density and set aside the points worth a row.

    The whole file is read before the first point is judged, so the result does not depend on the order of its points.

    Parameters
    ----------
    path, dimension : Path and str or None
        The file and its intensity dimension.
    alignment : Alignment
        The given axis, which gives the chainage.
    poses : PoseModel
        Scanner positions, which must cover every point near the axis.
    settings : FilterSettings
        Noise filter, thinning, and how far from the axis the tunnel reaches.
    survivors : Spool
        Gets the points that stay, with `tag`; thinned within the file up to the borders of its parts, so they have
        to be thinned once more as a whole.
    tag : int
        Number of the file.
    progress : callable
        Called with a number of points; the whole comes to twice the number of points of the file.
    memory, chunk : int
        Bytes of rows held in memory; points read at a time.

    Raises
    ------
    UserError
        If the file cannot be read, no point lies near the axis (says how far they are), all near it are noise, or the
        scanner position of any point near the axis is unknown.
    """
    counts, cells = FilterCounts(), CellCounts()
    with Spool(memory) as spool:
        _spool_file(path, dimension, alignment, poses, settings, spool, cells, counts, progress, chunk)
        stretch = _stretches(alignment, cells)
        radii = search_radii(cells.counts, cells.edge, settings.noise_points, settings.noise_diameter, stretch)
        widest = _widest(stretch, radii)
        first, bins = spool.counts()
        parts = list(windows(first, bins, WINDOW))
        crowded = max(int(bins[low - first : high - first].sum()) for low, high in parts) > CROWDED

        def judge(low: int, high: int) -> tuple[int, Rows]:
            return _judge(spool, low, high, _reach(low, high, widest), radii, settings)

        with ThreadPoolExecutor(1 if crowded else 2, "filter") as pool:
            for (low, high), (noise, rows) in zip(parts, _in_order(pool, judge, parts), strict=True):
                rows["tag"] = tag
                survivors.add(rows)
                counts.noise += noise
                counts.keep(rows)
                progress(int(bins[low - first : high - first].sum()))
    progress(counts.outside)
    if counts.kept == 0:
        raise UserError(
            f"{path}: all {counts.noise} points near the axis are noise: none has {settings.noise_points} points around it"
        )
    return counts


def prefetch(items: Iterable[T], ahead: int = 1) -> Generator[T, None, None]:
    """Make the next items in a thread of their own while the present one is worked on.

    To be closed by whoever may leave before the end (`contextlib.closing`), which also ends the thread.
    """
    queue: Queue[tuple[bool, T | BaseException | None]] = Queue(ahead)
    stopped = Event()

    def fill() -> None:
        try:
            for item in items:
                queue.put((True, item))
                if stopped.is_set():
                    return
            queue.put((False, None))
        except BaseException as error:
            queue.put((False, error))

    thread = Thread(target=fill, name="prefetch", daemon=True)
    thread.start()
    try:
        while True:
            good, item = queue.get()
            if good:
                yield item  # type: ignore[misc]
            elif isinstance(item, BaseException):
                raise item
            else:
                return
    finally:
        stopped.set()
        while thread.is_alive():
            while not queue.empty():
                queue.get()
            thread.join(0.01)


def _spool_file(
    path: Path,
    dimension: str | None,
    alignment: Alignment,
    poses: PoseModel,
    settings: FilterSettings,
    spool: Spool,
    cells: CellCounts,
    counts: FilterCounts,
    progress: Progress,
    chunk: int,
) -> None:
    faults = PoseFaults()
    nearest = math.inf
    with closing(prefetch(read_chunks(path, dimension, chunk))) as chunks:
        for points in chunks:
            chainage, distance = alignment.locate(points.xyz)
            with np.errstate(invalid="ignore"):
                near = np.flatnonzero(distance <= settings.max_distance)
            counts.locate(counts.points, near, chainage[near])
            counts.points += len(points)
            counts.outside += len(points) - len(near)
            if len(near):
                rows = _rows(points, chainage, near)
                rows["tag"] = cells.add(rows_xyz(rows))
                spool.add(rows)
                faults += poses.faults(_some(points, near))
            elif counts.outside == counts.points:
                nearest = min(nearest, float(cKDTree(alignment.vertices).query(points.xyz[::100])[0].min()))
            progress(len(points))
    for ranges in counts.ranges.values():
        ranges[-1] = (ranges[-1][0], min(ranges[-1][1], counts.points))
    if counts.outside == counts.points:
        raise UserError(
            f"{path}: no points near the axis: the nearest is about {nearest:.0f} m from it and the limit is "
            f"{settings.max_distance:g} m; check the axis, the file's coordinates and the tunnel's SRID"
        )
    if faults:
        raise faults.error(str(path))


def _rows(points: Points, chainage: NDArray[np.float64], chosen: NDArray[np.intp]) -> Rows:
    rows: Rows = np.empty(len(chosen), ROW)
    for column, name in enumerate("xyz"):
        rows[name] = points.xyz[chosen, column]
    rows["chainage"] = chainage[chosen]
    for name in ("time", "intensity", "scan_id", "classification"):
        rows[name] = getattr(points, name)[chosen]
    return rows


def _some(points: Points, chosen: NDArray[np.intp]) -> Points:
    if len(chosen) == len(points):
        return points
    return Points(*(getattr(points, name)[chosen] for name in Points.__dataclass_fields__))


def _stretches(alignment: Alignment, cells: CellCounts) -> NDArray[np.int64]:
    """Stretch of tunnel of each cell, by its centre; those beyond the ends of the axis go with the nearest one."""
    chainage = np.clip(alignment.locate(cells.centres)[0], alignment.start, alignment.end)
    chainage[np.isnan(chainage)] = alignment.start
    return np.floor(chainage / STRETCH).astype(np.int64)


def _widest(stretch: NDArray[np.int64], radii: NDArray[np.float64]) -> tuple[int, NDArray[np.float64]]:
    """Widest radius in each stretch from the first on."""
    first = int(stretch.min())
    widest = np.zeros(int(stretch.max()) - first + 1)
    np.maximum.at(widest, stretch - first, radii)
    return first, widest


def _reach(low: int, high: int, widest: tuple[int, NDArray[np.float64]]) -> int:
    """Bins beyond a window in which its points may have neighbours."""
    first, radii = widest
    # A point's cell may have its centre in the next stretch.
    begin = math.floor(low / BINS_PER_METRE / STRETCH) - 1 - first
    end = math.floor(high / BINS_PER_METRE / STRETCH) + 2 - first
    near = radii[max(begin, 0) : max(end, 1)]
    radius = float(near.max()) if len(near) else float(radii.max())
    return math.ceil(radius * STRETCHING * BINS_PER_METRE)


def _judge(
    spool: Spool, low: int, high: int, reach: int, radii: NDArray[np.float64], settings: FilterSettings
) -> tuple[int, Rows]:
    """Noise of a window, counted, and the rows that stay after thinning."""
    rows = spool.read(low - reach, high + reach)
    bins = bin_of(rows["chainage"])
    judged = (bins >= low) & (bins < high)
    noise = is_noise(rows_xyz(rows), radii[rows["tag"]], settings.noise_points, judged)
    rows = rows[judged & ~noise]
    return int(noise.sum()), thin_rows(rows, settings.edge)


def thin_rows(rows: Rows, edge: float | None) -> Rows:
    """Thin rows by voxels of this edge (m); None keeps all. Between points that are equal in all else the tag decides."""
    if edge is None:
        return rows
    names = ("time", "intensity", "scan_id", "classification", "tag")
    ties = np.empty((len(rows), len(names)))
    for column, name in enumerate(names):
        ties[:, column] = rows[name]
    return rows[thin(rows_xyz(rows), edge, ties)]


def _in_order(
    pool: ThreadPoolExecutor, work: Callable[[int, int], tuple[int, Rows]], parts: list[tuple[int, int]]
) -> Iterator[tuple[int, Rows]]:
    """Results in the order of the parts, with no more under way than threads can take up at once."""
    waiting: deque[Future[tuple[int, Rows]]] = deque()
    todo = iter(parts)
    for part in todo:
        waiting.append(pool.submit(work, *part))
        if len(waiting) > 2:
            yield waiting.popleft().result()
    while waiting:
        yield waiting.popleft().result()
