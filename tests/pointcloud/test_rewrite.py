"""Scan files written again with other classes, read back by laspy."""

import datetime as dt
import errno
from pathlib import Path

import laspy
import numpy as np
import pytest
from pyproj import CRS
from support import e57_files as e57files
from support.real_scans import real_scan

from tunneldb.errors import UserError
from tunneldb.pointcloud.formats import laz
from tunneldb.pointcloud.reader import read_header
from tunneldb.pointcloud.rewrite import read_coordinates, rewrite

pytestmark = pytest.mark.slow

NAMES = {2: "ground", 64: "lining"}
COUNT = 120_001


def write(path: Path, point_format: int, version: str, count: int = COUNT, crs: CRS | None = None) -> laspy.LasData:
    """A file whose every dimension has all values that it may have, by chance."""
    rng = np.random.default_rng(point_format)
    header = laspy.LasHeader(point_format=point_format, version=version)
    header.scales, header.offsets = [0.00025, 0.001, 0.0001], [512341.7, 104241.3, 410.05]
    header.creation_date = dt.date(2019, 2, 28)
    header.system_identifier = "SCANNER"
    header.file_source_id = 77
    header.global_encoding.gps_time_type = laspy.header.GpsTimeType.STANDARD
    header.add_extra_dims(
        [
            laspy.ExtraBytesParams("Amplitude", "float32"),
            laspy.ExtraBytesParams("pair", "2uint16"),
            laspy.ExtraBytesParams("scaled", "int16", scales=[0.1], offsets=[3.0]),
        ]
    )
    if crs is not None:
        header.add_crs(crs)
    header.vlrs.append(laspy.VLR("somebody", 4711, "what they say", b"\x00\x01any bytes\xff"))
    las = laspy.LasData(header)
    las.points = laspy.ScaleAwarePointRecord.zeros(count, header=header)
    array = las.points.array
    array.view(np.uint8)[:] = rng.integers(0, 256, array.nbytes, dtype=np.uint8)
    if "gps_time" in las.point_format.dimension_names:
        las.gps_time = rng.normal(0, 1e5, count)
    las.Amplitude = rng.normal(20, 1, count)
    las.write(path)
    return las


def parity(xyz: np.ndarray) -> np.ndarray:
    """A class that depends on the coordinates, so that points and classes cannot be confused."""
    return np.where(np.floor(xyz[:, 2]).astype(np.int64) % 2 == 0, 2, 64).astype(np.uint8)


@pytest.mark.parametrize("suffix", ["las", "laz"])
@pytest.mark.parametrize(
    ("before", "version", "after"),
    [(0, "1.2", 6), (1, "1.1", 6), (2, "1.2", 7), (3, "1.4", 7), (6, "1.4", 6), (7, "1.4", 7), (8, "1.4", 8), (6, "1.5", 6)],
)
def test_everything_but_the_class_stays(tmp_path: Path, before: int, version: str, after: int, suffix: str) -> None:
    source, target = tmp_path / f"a.{suffix}", tmp_path / "b.laz"
    las = write(source, before, version, crs=CRS.from_epsg(25830))
    bytes_before = source.read_bytes()
    counts = rewrite(source, target, parity, NAMES, size=50_000)
    assert source.read_bytes() == bytes_before
    with laspy.open(target) as reader:
        header = reader.header
        assert header.are_points_compressed
        assert header.vlrs.get("WktCoordinateSystemVlr")
    found = laspy.read(target)
    assert found.header.point_format.id == after
    assert str(found.header.version) == max(version, "1.4")
    for axis in "XYZ":
        np.testing.assert_array_equal(found[axis], las[axis])
    np.testing.assert_array_equal(found.xyz, las.xyz)  # bit-identical
    expected = parity(np.asarray(las.xyz))
    np.testing.assert_array_equal(found.classification, expected)
    assert counts.tolist() == np.bincount(expected, minlength=256).tolist()
    for name in set(las.point_format.dimension_names) - {"classification", "scan_angle_rank"}:
        np.testing.assert_array_equal(found[name], las[name], err_msg=name)
    if before < 6:
        assert np.abs(np.asarray(found.scan_angle) * 0.006 - las.scan_angle_rank).max() <= 0.003
        np.testing.assert_array_equal(found.overlap, np.asarray(las.classification) == 12)


def test_header_stays(tmp_path: Path) -> None:
    for point_format, version in ((3, "1.2"), (7, "1.4")):
        source, target = tmp_path / f"{version}.laz", tmp_path / f"{version}-out.laz"
        write(source, point_format, version, crs=CRS.from_epsg(25830))
        rewrite(source, target, parity, NAMES)
        with laspy.open(source) as a, laspy.open(target) as b:
            one, other = a.header, b.header
            for name in ("scales", "offsets", "mins", "maxs", "number_of_points_by_return"):
                np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)
            for name in ("creation_date", "system_identifier", "generating_software", "file_source_id", "uuid", "point_count"):
                assert getattr(one, name) == getattr(other, name), name
            assert other.global_encoding.wkt
            assert other.global_encoding.gps_time_type == one.global_encoding.gps_time_type
            assert one.parse_crs() is not None
            assert other.parse_crs().to_epsg() == one.parse_crs().to_epsg() == 25830
            kept = {(record.user_id, record.record_id): record.record_data_bytes() for record in other.vlrs}
            for record in one.vlrs:
                if record.user_id != "laszip encoded":
                    assert kept[record.user_id, record.record_id] == record.record_data_bytes()
            names = other.vlrs.get("ClassificationLookupVlr")[0].lookups
            assert {number: name for number, name in names.items() if name} == NAMES


def test_records_behind_the_points_stay(tmp_path: Path) -> None:
    source, target = tmp_path / "a.laz", tmp_path / "b.laz"
    las = write(source, 6, "1.4", 1000)
    las.evlrs = laspy.vlrs.vlrlist.VLRList([laspy.VLR("somebody", 9, "large", bytes(range(256)) * 1000)])
    las.write(source)
    rewrite(source, target, parity, NAMES)
    (record,) = laspy.read(target).evlrs
    assert (record.user_id, record.record_id, record.description) == ("somebody", 9, "large")
    assert record.record_data_bytes() == bytes(range(256)) * 1000


@pytest.mark.parametrize("name", ["ringo", "lone-star", "extra-bytes"])
def test_real_files(tmp_path: Path, name: str) -> None:
    source, target = real_scan(f"{name}.laz"), tmp_path / "b.laz"
    rewrite(source, target, parity, NAMES)
    before, after = laspy.read(source), laspy.read(target)
    np.testing.assert_array_equal(after.xyz, before.xyz)
    for dimension in set(before.point_format.dimension_names) - {"classification", "scan_angle_rank"}:
        np.testing.assert_array_equal(after[dimension], before[dimension], err_msg=dimension)
    assert read_header(source).crs == read_header(target).crs or name == "lone-star"  # GeoTIFF's words for the same


def test_class_is_made_of_whole_chunks_in_order(tmp_path: Path) -> None:
    write(tmp_path / "a.laz", 6, "1.4")
    seen: list[int] = []

    def classes(xyz: np.ndarray) -> np.ndarray:
        seen.append(len(xyz))
        return np.full(len(xyz), 64, np.uint8)

    written: list[int] = []
    rewrite(tmp_path / "a.laz", tmp_path / "b.laz", classes, NAMES, written.append, size=50_000)
    assert seen == written == [50_000, 50_000, 20_001]


def test_e57(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    count = 1000
    xyz = rng.uniform(-20, 20, (count, 3))
    good = rng.random(count) < 0.8
    fields = {
        **dict(zip(("cartesianX", "cartesianY", "cartesianZ"), xyz.T, strict=True)),
        "cartesianInvalidState": (~good).astype(float),
        "intensity": rng.random(count),
        "timeStamp": np.arange(count) * 0.01,
        "rowIndex": np.arange(count) // 7,
        "columnIndex": np.arange(count) % 7,
    }
    turned = [np.sqrt(0.5), 0, 0, np.sqrt(0.5)]  # a quarter turn to the left
    scan = e57files.Scan(fields, (500_000.0, 4_500_000.0, 100.0), turned, start=1.4e9)
    source = e57files.write(tmp_path / "a.e57", [scan, scan], "EPSG:25830")
    rewrite(source, tmp_path / "b.laz", parity, NAMES, size=300)
    las = laspy.read(tmp_path / "b.laz")
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    expected = (xyz @ turn.T + scan.translation)[good]
    assert len(las) == 2 * good.sum() == las.header.point_count == las.header.number_of_points_by_return[0]
    np.testing.assert_allclose(las.xyz, np.tile(expected, (2, 1)), atol=0.51e-4)
    np.testing.assert_allclose([las.header.mins, las.header.maxs], [las.xyz.min(axis=0), las.xyz.max(axis=0)])
    np.testing.assert_array_equal(las.classification, parity(np.asarray(las.xyz)))
    np.testing.assert_array_equal(las.point_source_id, np.repeat([1, 2], good.sum()))
    np.testing.assert_allclose(las.e57_intensity, np.tile(fields["intensity"][good], 2), rtol=1e-6)
    np.testing.assert_allclose(las.intensity, las.e57_intensity * 65535, atol=0.51)
    np.testing.assert_array_equal(las.row_index, np.tile(fields["rowIndex"][good], 2))
    np.testing.assert_allclose(las.gps_time, np.tile(0.4e9 + fields["timeStamp"][good], 2))
    assert las.header.parse_crs().to_epsg() == 25830
    assert las.header.creation_date is None  # the file has none: written on another day it is the same


def test_e57_of_invalid_points_alone_is_refused(tmp_path: Path) -> None:
    fields = {name: np.ones(10) for name in ("cartesianX", "cartesianY", "cartesianZ", "cartesianInvalidState")}
    source = e57files.write(tmp_path / "a.e57", [e57files.Scan(fields)])
    with pytest.raises(UserError, match=r"a\.e57: all 10 points are marked as invalid"):
        list(read_coordinates(source))
    with pytest.raises(UserError, match=r"a\.e57: all 10 points are marked as invalid"):
        rewrite(source, tmp_path / "b.laz", parity, NAMES)


class Full:
    """A disk on which little fits."""

    def __init__(self, file, room=200_000):
        self.file, self.room = file, room
        self.seek, self.tell, self.flush, self.read = file.seek, file.tell, file.flush, file.read

    def write(self, data):
        self.room -= len(data)
        if self.room < 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        return self.file.write(data)


def test_full_disk_is_told_as_such(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path / "a.laz", 6, "1.4")
    told = laz._ErrorKeepingFile
    monkeypatch.setattr(laz, "_ErrorKeepingFile", lambda file: told(Full(file)))
    with pytest.raises(OSError, match="No space left"):
        rewrite(tmp_path / "a.laz", tmp_path / "b.laz", parity, NAMES)


def test_what_cannot_be_read_is_refused(tmp_path: Path) -> None:
    whole = tmp_path / "a.laz"
    write(whole, 6, "1.4")
    cut = tmp_path / "cut.laz"
    cut.write_bytes(whole.read_bytes()[:-100_000])
    with pytest.raises(UserError, match=r"cut\.laz: truncated"):
        rewrite(cut, tmp_path / "b.laz", parity, NAMES)
    with pytest.raises(UserError, match="no such file"):
        rewrite(tmp_path / "none.laz", tmp_path / "c.laz", parity, NAMES)
    write(tmp_path / "empty.laz", 6, "1.4", 0)
    with pytest.raises(UserError, match="holds no points"):
        rewrite(tmp_path / "empty.laz", tmp_path / "d.laz", parity, NAMES)
    waves = tmp_path / "waves.las"
    write(waves, 4, "1.3", 100)
    data = bytearray(waves.read_bytes())
    data[6] |= 2
    waves.write_bytes(data)
    with pytest.raises(UserError, match="waveforms"):
        rewrite(waves, tmp_path / "e.laz", parity, NAMES)
    data = bytearray(whole.read_bytes())
    data[96:100] = (300).to_bytes(4, "little")
    (tmp_path / "early.laz").write_bytes(data)
    with pytest.raises(UserError, match=r"early\.laz: truncated, corrupt"):
        rewrite(tmp_path / "early.laz", tmp_path / "f.laz", parity, NAMES)
