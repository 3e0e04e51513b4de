"""Two places of a header that state one thing: the right one is read, and a contradiction is named."""

from __future__ import annotations

import re
import struct
from pathlib import Path

import laspy
import numpy as np
import pytest

from tunneldb.errors import InputError
from tunneldb.pointcloud.reader import read_chunks, read_header
from tunneldb.pointcloud.rewrite import read_coordinates
from tunneldb.pointcloud.stations import read_stations

LEGACY_AT, COUNT_AT = 107, 247
PLACES = [(5.0, 3.0, -1.0), (17.0, 10.0, -1.0), (29.0, 16.0, -1.0)]


def write_las(path: Path, count: int, legacy: int) -> np.ndarray:
    """A file of version 1.4 whose header has these numbers of points; it holds 40."""
    las = laspy.LasData(laspy.LasHeader(point_format=3, version="1.4"))
    las.x, las.y, las.z = np.random.default_rng(1).uniform(0.0, 5.0, (3, 40))
    las.write(path)
    data = bytearray(path.read_bytes())
    struct.pack_into("<I", data, LEGACY_AT, legacy)
    struct.pack_into("<Q", data, COUNT_AT, count)
    path.write_bytes(data)
    return np.column_stack([las.x, las.y, las.z])


@pytest.mark.parametrize(("count", "legacy", "noted"), [(0, 40, False), (40, 0, False), (40, 40, False), (40, 30, True)])
def test_the_number_of_points_is_read_from_the_field_that_has_it(tmp_path: Path, count: int, legacy: int, noted: bool) -> None:
    xyz = write_las(tmp_path / "a.las", count, legacy)
    header = read_header(tmp_path / "a.las")
    assert header.points == 40
    assert bool(header.notes) == noted
    np.testing.assert_array_equal(np.concatenate([chunk.xyz for chunk in read_chunks(tmp_path / "a.las", None)]), xyz)
    np.testing.assert_allclose(np.concatenate(list(read_coordinates(tmp_path / "a.las"))), xyz)
    if noted:
        assert "states 40 points in its field of 64 bits, which counts, but 30" in header.notes[0]


def write_ptx(path: Path, places: list[tuple[float, float, float]], matrix_places: list[tuple[float, float, float]]) -> Path:
    lines = []
    for place, moved in zip(places, matrix_places, strict=True):
        lines += ["2", "1", " ".join(map(str, place)), "1 0 0", "0 1 0", "0 0 1", "1 0 0 0", "0 1 0 0", "0 0 1 0"]
        lines += [f"{' '.join(map(str, moved))} 1", f"{place[0]} 1 2 0.5", f"{place[0]} 2 2 0.6"]
    path.write_text("\n".join(lines))
    return path


def test_positions_beside_an_identity_are_refused_and_the_advice_helps(tmp_path: Path) -> None:
    path = write_ptx(tmp_path / "a.ptx", PLACES, [(0.0, 0.0, 0.0)] * 3)
    with pytest.raises(InputError, match="position and matrix of the header contradict each other") as caught:
        read_stations([path])
    rows = re.findall(r"(\d{5,}) ([-\d.]+,[-\d.]+,[-\d.]+)", str(caught.value))
    table = tmp_path / "STATIONS.csv"
    table.write_text("scan_id,x,y,z\n" + "".join(f"{number},{place}\n" for number, place in rows))
    stations = read_stations([table])
    assert sorted(map(tuple, stations.xyz.tolist())) == sorted(PLACES)
    scans = np.concatenate([chunk.scan_id for chunk in read_chunks(path, None)])
    assert set(stations.scan_id.tolist()) == set(scans.tolist())


def test_other_positions_than_in_the_matrix_are_noted(tmp_path: Path) -> None:
    equal = read_stations([write_ptx(tmp_path / "a.ptx", PLACES, PLACES)])
    assert equal.notes == ()
    moved = [(x + 500_000.0, y, z) for x, y, z in PLACES]
    other = read_stations([write_ptx(tmp_path / "b.ptx", PLACES, moved)])
    assert "3 of 3 scans have another position in line 3 of their header than in their matrix" in other.notes[0]
    np.testing.assert_array_equal(other.xyz, moved)
