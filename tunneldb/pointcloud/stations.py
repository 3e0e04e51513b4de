"""Stations of a static scanner, from CSV files and from the poses of E57 and PTX files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tunneldb.arrays import Float, Int32
from tunneldb.csvfile import read_csv
from tunneldb.errors import InputError
from tunneldb.pointcloud.formats.pose_contradictions import lost_positions, position_notes
from tunneldb.pointcloud.formats.table import has_scans, posed_scans

SCAN_ID_LIMIT = 1 << 31  # point_source_id of LAS has 16 bits, the numbers of E57 scans have 31
SCAN_ID = "scan_id is the number of a point's scan, its point_source_id; tunneldb inspect FILE lists them"
PLACE_TOLERANCE = 0.001  # m; greatest distance between positions of one station in two files


@dataclass(frozen=True)
class Stations:
    """Positions of a static scanner.

    Attributes
    ----------
    scan_id : (n,) int32 array
        Number of the scan, without repeats.
    xyz : (n, 3) float64 array
        Position, m.
    notes : tuple of str
        Positions for which a header has two that contradict each other.
    """

    scan_id: Int32
    xyz: Float
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Station:
    scan_id: int
    place: Float | None
    origin: str


def read_stations(paths: Sequence[Path]) -> Stations:
    """Read the stations of a survey.

    Parameters
    ----------
    paths : sequence of Path
        CSV files with scan_id,x,y,z; E57 and PTX files, whose scans with poses are stations; folders, for all such files in
        them. A scan of an E57 file without a pose must be in a CSV file, by its number.

    Raises
    ------
    InputError
        If a file cannot be read or holds no station, a number is invalid, a scan has no position, or a scan has two, or the two
        places of its headers contradict each other so that the positions are lost.
    """
    known: dict[int, _Station] = {}
    placeless = []
    notes: list[str] = []
    for path in _files(paths):
        for station in _of_scans(path, notes) if has_scans(path) else _of_csv(path):
            if station.place is None:
                placeless.append(station)
                continue
            other = known.setdefault(station.scan_id, station)
            if other.place is not None and np.linalg.norm(other.place - station.place) > PLACE_TOLERANCE:
                raise InputError(f"scan_id {station.scan_id} has two positions: in {other.origin} and in {station.origin}")
    for station in placeless:
        if station.scan_id not in known:
            raise InputError(
                f"{station.origin} has no pose, so the scanner position is unknown; "
                f"give it in a CSV file: --stations FILE, scan_id {station.scan_id}"
            )
    xyz = np.array([station.place for station in known.values()], np.float64)
    return Stations(np.array(list(known), np.int32), xyz, tuple(notes))


def _files(paths: Sequence[Path]) -> Iterator[Path]:
    for path in paths:
        if not path.is_dir():
            yield path
            continue
        found = sorted(file for file in path.iterdir() if has_scans(file))
        if not found:
            raise InputError(f"{path}: no E57 or PTX file in this folder")
        yield from found


def _of_scans(path: Path, notes: list[str]) -> Iterator[_Station]:
    scans = posed_scans(path)
    lost = lost_positions(scans)
    if lost:
        raise InputError(f"{path}: {lost}: --stations STATIONS.csv")
    notes += [f"{path.name}: {note}" for note in position_notes(scans)]
    for scan in scans:
        yield _Station(scan.number, scan.position, f"{path}, scan {scan.index + 1} ({scan.name})")


def _of_csv(path: Path) -> Iterator[_Station]:
    table = read_csv(path, ("scan_id", "x", "y", "z"), hint={"scan_id": SCAN_ID})
    if not len(table):
        raise InputError(f"{path} holds no station")
    ids = table["scan_id"]
    wrong = np.flatnonzero((ids != np.floor(ids)) | (ids < 0) | (ids >= SCAN_ID_LIMIT))
    if len(wrong):
        raise table.error(int(wrong[0]), f"scan_id {ids[wrong[0]]:g} is not a whole number from 0 to {SCAN_ID_LIMIT - 1}")
    _, first = np.unique(ids, return_index=True)
    repeated = np.setdiff1d(np.arange(len(ids)), first)
    if len(repeated):
        raise table.error(int(repeated[0]), f"scan_id {ids[repeated[0]]:g} is repeated; list each station once")
    for row, place in enumerate(table.columns(("x", "y", "z"))):
        yield _Station(int(ids[row]), place, f"{path}, line {table.lines[row]}")
