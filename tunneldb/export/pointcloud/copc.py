"""Points of a survey with their classes as Cloud Optimized Point Clouds, one for each kilometre, and a virtual one of all."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from pathlib import Path
from time import perf_counter
from typing import Any, BinaryIO

import numpy as np
import psycopg
from pyproj import CRS

from tunneldb.arrays import Float, Int64, UInt8
from tunneldb.database import snapshot
from tunneldb.errors import UserError
from tunneldb.export.pointcloud.dimensions import Dimensions
from tunneldb.export.pointcloud.survey import (
    CLASS_NAMES,
    ScanFile,
    Written,
    require_ground,
    require_no_scans,
    survey_files,
)
from tunneldb.export.pointcloud.vpc import Cloud, listed_clouds, write_vpc
from tunneldb.files import replacing
from tunneldb.geometry.alignment import Alignment
from tunneldb.geometry.local import LOCAL
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.pointcloud.formats.copc import FORMATS, writing_copc
from tunneldb.pointcloud.formats.las_header import Head
from tunneldb.pointcloud.formats.las_merge import Placement, merge_heads
from tunneldb.pointcloud.formats.las_records import coordinates, fields
from tunneldb.pointcloud.octree import GRID, CellCounts, Nodes, Tiling
from tunneldb.pointcloud.rewrite import read_coordinates, records_of
from tunneldb.progress import StartProgress
from tunneldb.store.scene import load_scene
from tunneldb.store.sources import unchanged_file
from tunneldb.store.surface import load_alignment
from tunneldb.store.survey import Survey


def export_copc(
    conn: psycopg.Connection[Any], survey: Survey, folder: Path, kilometres: Collection[int], begin: StartProgress
) -> Iterator[Written]:
    """Write each kilometre as ``SURVEY-kmNNN.copc.laz`` into a folder, with ``SURVEY.vpc``, which lists all.

    Each point of a file is in the kilometre of its chainage, or the nearest one that the file touches; its class is that of
    `export_classified`. Points of a kilometre that is not in the database yet are left to it. A file appears when it is
    complete. Memory does not grow with the number of points, except that those of a single cell of 1 m³ are in memory together.
    A kilometre temporarily takes as much additional space in the folder as its points uncompressed.

    Parameters
    ----------
    conn, folder, kilometres
        As for `export_classified`.
    begin : callable
        Called with a text and a number of points before each pass; returns a function that takes the points done.

    Raises
    ------
    UserError
        As for `export_classified`; if a file's points have waveforms, or the files of a kilometre cannot be combined; if
        another file has the name of the virtual point cloud.
    """
    files = [file for file in survey_files(conn, survey) if set(file.kilometres) & set(file.touched) & set(kilometres)]
    wanted = sorted(set(kilometres) & {km for file in files for km in set(file.kilometres) & set(file.touched)})
    _require_metres(files)
    targets = [folder / f"{survey.name}-km{km:03d}.copc.laz" for km in wanted]
    require_no_scans(conn, targets)
    virtual = folder / f"{survey.name}.vpc"
    listed_clouds(virtual)
    require_ground(conn, survey, {km for file in files for km in file.kilometres})
    divide = _Divide(load_alignment(conn, survey))
    conn.rollback()
    sources = [_Source(file, number, len(files)) for number, file in enumerate(files, start=1)]
    groups = {km: _Group(survey, km, [source for source in sources if km in source.file.touched]) for km in wanted}
    for source in sources:
        source.count([group for group in groups.values() if source in group.sources], divide, begin)
    for number, (group, target) in enumerate(zip(groups.values(), targets, strict=True), start=1):
        started = perf_counter()
        if not group.points:
            continue
        progress = begin(f"[{number}|{len(wanted)}] {target.name}", 2 * group.points)
        with replacing(target) as temporary:
            cloud, counts = _write(conn, survey, group, divide, temporary, progress)
        with replacing(virtual) as temporary:
            write_vpc(temporary, cloud, survey.date, folder)
        yield Written(target, counts, perf_counter() - started)


def _require_metres(files: Sequence[ScanFile]) -> None:
    """Refuse files in other units: a merged file is in metres, and records are copied as they are."""
    for file in files:
        if not file.units.metric:
            raise UserError(
                f"{file.path}: its coordinates are in {file.units.plan}, its heights in {file.units.height}, but a merged file"
                " is in metres: export without --copc"
            )


class _Divide:
    """Assignment of points to kilometres."""

    def __init__(self, alignment: Alignment) -> None:
        self.alignment = alignment

    def kilometre(self, xyz: Float, there: Sequence[int]) -> Int64:
        """Return the kilometre of each point (n, 3), or the nearest, among those that a file touches, (n,)."""
        if len(there) == 1:
            return np.full(len(xyz), there[0], np.int64)
        chainage = self.alignment.chainage(xyz)
        beyond = np.flatnonzero(np.isnan(chainage))
        ends = self.alignment.vertices[[0, -1]]
        to_start, to_end = (np.linalg.norm(xyz[beyond] - end, axis=1) for end in ends)
        chainage[beyond] = np.where(to_start < to_end, self.alignment.start, self.alignment.end)
        km = np.floor(chainage / KILOMETRE)
        choice = np.array(sorted(there))
        return choice[np.searchsorted((choice[1:] + choice[:-1]) / 2.0, km)]


class _Source:
    """Scan file that is read once for all its kilometres, and again for each of them where its points are.

    Attributes
    ----------
    chunks : dict of int to list of int
        Numbers of the chunks with points of each kilometre.
    """

    def __init__(self, file: ScanFile, number: int, of: int) -> None:
        self.file, self.name = file, f"[{number}|{of}] {file.name}"
        self.head = records_of(self.path).head
        self.chunks: dict[int, list[int]] = {km: [] for km in file.touched}
        if self.head.point_format not in FORMATS:
            raise UserError(f"{file.path}: its points have waveforms, which COPC does not support: export without --copc")

    @property
    def path(self) -> Path:
        """Return its path, after checking that the file is the one that was loaded."""
        return unchanged_file(self.file.path, self.file.bytes, self.file.checksum)

    def count(self, groups: Sequence[_Group], divide: _Divide, begin: StartProgress) -> None:
        """Count its points by cells for each of the kilometres.

        Raises
        ------
        UserError
            If the file was changed since it was loaded, or has coordinates that the merged file cannot store.
        """
        progress = begin(f"{self.name}: cells", self.file.points)
        forms = [(group, group.placement(self)) for group in groups]
        for number, xyz in enumerate(read_coordinates(self.path)):
            km = divide.kilometre(xyz, self.file.touched)
            for group, placement in forms:
                own = xyz[km == group.km]
                if not len(own):
                    continue
                try:
                    group.add(placement.coordinates(own))
                except ValueError as error:
                    raise UserError(f"{self.file.path}: {error}; export without --copc") from None
                self.chunks[group.km].append(number)
            progress(len(xyz))


class _Group:
    """A kilometre with its files."""

    def __init__(self, survey: Survey, km: int, sources: Sequence[_Source]) -> None:
        self.km, self.sources = km, sources
        try:
            head, self.placements = merge_heads([source.head for source in sources])
        except ValueError as error:
            raise UserError(f"kilometre {km}: {error}; export without --copc") from None
        if survey.srid != LOCAL:
            head = head.with_crs(CRS.from_epsg(survey.srid))
        self.head = head.with_classes(CLASS_NAMES)
        self.cells: CellCounts | None = None

    def placement(self, source: _Source) -> Placement:
        """Return the conversion of a file's points to those of the kilometre."""
        return self.placements[list(self.sources).index(source)]

    def add(self, xyz: Float) -> None:
        """Count points (n, 3), m."""
        if len(xyz):
            self.cells = self.cells or CellCounts(xyz[0])
            self.cells.add(xyz)

    @property
    def points(self) -> int:
        """Return the number of counted points."""
        return 0 if self.cells is None else int(self.cells.counts.sum())


def _write(
    conn: psycopg.Connection[Any],
    survey: Survey,
    group: _Group,
    divide: _Divide,
    target: Path,
    progress: Callable[[int], None],
) -> tuple[Cloud, Int64]:
    """Write a kilometre whose points were counted."""
    assert group.cells is not None
    tiling = Tiling.of(group.cells)
    dimensions, nodes, head = Dimensions(group.head), Nodes(), group.head
    with (target.parent / "points").open("x+b") as spool:
        counts = _sort(conn, survey, group, divide, tiling, spool, progress)
        spool.seek(0)
        with writing_copc(target, head, tiling.low, tiling.edge, tiling.edge / 2**GRID) as writer:
            for tile in tiling.tiles:
                records = _read_tile(spool, tile.points, head)
                dimensions.add(records)
                for key, chosen in nodes.add(tile, coordinates(records, head.scales, head.offsets), records):
                    writer.write(key, chosen)
                progress(tile.points)
            for key, chosen in nodes.close():
                writer.write(key, chosen)
    return Cloud(target.name, writer.low, writer.high, group.points, dimensions.listed(), head.crs), counts


def _sort(
    conn: psycopg.Connection[Any],
    survey: Survey,
    group: _Group,
    divide: _Divide,
    tiling: Tiling,
    spool: BinaryIO,
    progress: Callable[[int], None],
) -> Int64:
    """Write the classified points of a kilometre to a file, grouped by tile; points by class (256,)."""
    head, counts = group.head, np.zeros(256, np.int64)
    place = np.concatenate([[0], np.cumsum([tile.points for tile in tiling.tiles])])[:-1]
    for source in group.sources:
        near = [km for km in source.file.kilometres if abs(km - group.km) <= 1]
        with snapshot(conn):
            require_ground(conn, survey, near)
            scene = load_scene(conn, survey, min(near), max(near))
        placement = group.placement(source)
        for records in records_of(source.path, only=source.chunks[group.km]).chunks:
            xyz = coordinates(records, source.head.scales, source.head.offsets)
            own = divide.kilometre(xyz, source.file.touched) == group.km
            found = scene.classes(xyz[own])
            out = placement.records(records[own])
            fields(out, head.point_format)["classification"] = found
            counts += np.bincount(found, minlength=256)
            tile_of = tiling.tiles_of(coordinates(out, head.scales, head.offsets))
            order = np.argsort(tile_of, kind="stable")
            tiles, starts = np.unique(tile_of[order], return_index=True)
            for tile, part in zip(tiles.tolist(), np.split(out[order], starts[1:]), strict=True):
                spool.seek(int(place[tile]) * head.record_size)
                spool.write(part.tobytes())
                place[tile] += len(part)
            progress(len(out))
    return counts


def _read_tile(spool: BinaryIO, points: int, head: Head) -> UInt8:
    data = spool.read(points * head.record_size)
    return np.frombuffer(data, np.uint8).reshape(points, head.record_size)
