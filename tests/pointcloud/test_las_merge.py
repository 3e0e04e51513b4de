"""Points of several LAS files in the form of one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import laspy
import numpy as np
import pytest

from tunneldb.pointcloud.formats.las_header import read_head
from tunneldb.pointcloud.formats.las_merge import Placement, merge_heads
from tunneldb.pointcloud.formats.laz import writing
from tunneldb.pointcloud.rewrite import records_of

COUNT = 1000


def scan(path: Path, scale: float, offset: float, extra: list[laspy.ExtraBytesParams], point_format: int = 6) -> laspy.LasData:
    """A file of points about (1000, 1000, 1000)."""
    rng = np.random.default_rng(COUNT)
    header = laspy.LasHeader(point_format=point_format, version="1.4")
    header.scales, header.offsets = [scale] * 3, [offset] * 3
    header.add_extra_dims(extra)
    las = laspy.LasData(header)
    las.xyz = 1000.0 + rng.normal(0.0, 5.0, (COUNT, 3))
    las.gps_time = np.arange(COUNT, dtype=float)
    for number, parameters in enumerate(extra):
        las[parameters.name] = np.arange(COUNT) % 100 + 100 * number
    las.write(path)
    return las


def written(placement: Placement, source: Path, target: Path) -> laspy.LasData:
    """A file in the form of the whole."""
    with writing(target, placement.target) as writer:
        for records in records_of(source, 300).chunks:
            writer.write(placement.records(records))
        writer.close()
    with laspy.open(target, "r") as reader:
        reader.header.point_count = COUNT
        return reader.read_points(COUNT)


def test_the_whole_holds_what_each_file_does(tmp_path: Path) -> None:
    one = scan(tmp_path / "a.las", 0.001, 1000.0, [laspy.ExtraBytesParams("Amplitude", "float32")])
    other = scan(
        tmp_path / "b.laz", 0.0001, 900.0,
        [laspy.ExtraBytesParams("Amplitude", "uint16"), laspy.ExtraBytesParams("Pulse", "uint8")], 7,
    )  # fmt: skip
    other.red[:] = 7
    other.write(tmp_path / "b.laz")
    whole, (first, second) = merge_heads([read_head(tmp_path / name) for name in ("a.las", "b.laz")])
    assert whole.point_format == 7
    assert whole.scales == (0.0001, 0.0001, 0.0001)
    a = written(first, tmp_path / "a.las", tmp_path / "A.laz")
    b = written(second, tmp_path / "b.laz", tmp_path / "B.laz")
    assert list(a.point_format.extra_dimension_names) == ["Amplitude", "Amplitude_2", "Pulse"]
    np.testing.assert_allclose(np.column_stack([a.x, a.y, a.z]), one.xyz, atol=1e-9)
    np.testing.assert_allclose(np.column_stack([b.x, b.y, b.z]), other.xyz, atol=0.00005 + 1e-9)
    np.testing.assert_array_equal(a["Amplitude"], one["Amplitude"])
    np.testing.assert_array_equal(b["Amplitude_2"], other["Amplitude"])
    np.testing.assert_array_equal(b["Pulse"], other["Pulse"])
    np.testing.assert_array_equal(b.red, other.red)
    assert not np.any(a["Pulse"])
    np.testing.assert_array_equal(first.coordinates(one.xyz), np.column_stack([a.x, a.y, a.z]))


def test_what_is_the_same_is_not_copied(tmp_path: Path) -> None:
    scan(tmp_path / "a.las", 0.001, 1000.0, [laspy.ExtraBytesParams("Amplitude", "float32")])
    head = read_head(tmp_path / "a.las")
    _, placements = merge_heads([head, head])
    records = next(records_of(tmp_path / "a.las").chunks)
    assert placements[1].records(records) is records


def test_times_of_two_kinds_are_refused(tmp_path: Path) -> None:
    scan(tmp_path / "a.las", 0.001, 1000.0, [])
    head = read_head(tmp_path / "a.las")
    other = bytearray(head.header)
    other[6] ^= 1
    with pytest.raises(ValueError, match="GPS time"):
        merge_heads([head, type(head)(bytes(other), head.records)])


def test_points_too_far_for_the_digits_are_refused(tmp_path: Path) -> None:
    scan(tmp_path / "a.las", 0.001, 1000.0, [])
    scan(tmp_path / "b.las", 1e-6, 1000.0, [])
    _, placements = merge_heads([read_head(tmp_path / name) for name in ("a.las", "b.las")])
    with pytest.raises(ValueError, match="too far"):
        placements[0].coordinates(np.array([[1e6, 0.0, 0.0]]))


def test_only_the_chunks_that_are_wanted_are_read(tmp_path: Path) -> None:
    for name in ("a.las", "a.laz"):
        scan(tmp_path / name, 0.001, 1000.0, [])
        chunks = list(records_of(tmp_path / name, 300).chunks)
        found = list(records_of(tmp_path / name, 300, [1, 3]).chunks)
        assert [len(chunk) for chunk in found] == [300, 100]
        np.testing.assert_array_equal(found[0], chunks[1])
        np.testing.assert_array_equal(found[1], chunks[3])


@pytest.mark.parametrize("standard", [0, 1])
@pytest.mark.parametrize("first", [True, False])
def test_a_file_without_times_takes_no_part_in_how_they_are_counted(tmp_path: Path, standard: int, first: bool) -> None:
    scan(tmp_path / "a.las", 0.001, 1000.0, [])
    head = read_head(tmp_path / "a.las")
    timed = replace(head, header=head.header[:6] + bytes([head.header[6] & ~1 | standard]) + head.header[7:])
    for point_format in (0, 2):
        las = laspy.LasData(laspy.LasHeader(point_format=point_format, version="1.2"))
        las.xyz = np.full((3, 3), 1000.0)
        las.header.global_encoding.gps_time_type = laspy.header.GpsTimeType(1 - standard)
        las.write(tmp_path / "b.las")
        timeless = records_of(tmp_path / "b.las").head
        assert timeless.header[6] & 1 == 1 - standard
        whole, _ = merge_heads([timed, timeless] if first else [timeless, timed])
        assert whole.header[6] & 1 == standard
