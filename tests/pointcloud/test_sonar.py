"""Sonar scans in the formats that the makers' software exports."""

from __future__ import annotations

from pathlib import Path

import laspy
import numpy as np
import pytest

from tunneldb.errors import UserError
from tunneldb.pointcloud.sonar import read_sonar

POINTS = np.array([[1.25, -2.5, 0.75], [-3.0, 4.5, -1.5], [0.5, 0.25, -2.125]])


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.xyz", "1.25 -2.5 0.75 55\n-3.0 4.5 -1.5 60\n0.5 0.25 -2.125 7\n"),
        ("a.txt", "x;y;z\n1.25;-2.5;0.75\n-3.0;4.5;-1.5\n\n0.5;0.25;-2.125\n"),
        ("a.csv", "# BV5000\nX,Y,Z,I\n1.25,-2.5,0.75,1\n-3.0,4.5,-1.5,2\n0.5,0.25,-2.125,3\n"),
        ("b.xyz", "1.25 -2.5 0.75 12:31:07 ok\n-3.0 4.5 -1.5 12:31:07 ok\n0.5 0.25 -2.125 12:31:08 weak\n"),
        ("a.off", "OFF\n3 1 0\n1.25 -2.5 0.75\n-3.0 4.5 -1.5\n0.5 0.25 -2.125\n3 0 1 2\n"),
    ],
)
def test_text_is_read_with_and_without_a_header(tmp_path: Path, name: str, text: str) -> None:
    path = tmp_path / name
    path.write_text(text)
    points, invalid = read_sonar(path)
    assert np.array_equal(points, POINTS)
    assert invalid == 0


def test_las_is_read(tmp_path: Path) -> None:
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales = np.full(3, 1e-3)
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = POINTS.T
    cloud.write(tmp_path / "a.las")
    assert np.allclose(read_sonar(tmp_path / "a.las")[0], POINTS, atol=1e-9)


def test_points_that_are_no_numbers_are_left_out_and_counted(tmp_path: Path) -> None:
    lines = ["1.0 2.0 3.0"] * 199 + ["nan nan nan"]
    (tmp_path / "a.xyz").write_text("\n".join(lines))
    points, invalid = read_sonar(tmp_path / "a.xyz")
    assert (len(points), invalid) == (199, 1)


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("a.kmall", "", "export it from"),
        ("a.son", "", "export it from"),
        ("a.xyz", "", "holds no points"),
        ("a.xyz", "1.0 2.0 3.0\n1.0 2.0\n", "line 2"),
        ("a.xyz", "1.0 2.0 3.0\n1.0 2.0 abc\n", "line 2"),
        ("a.xyz", "1,0 2,0 3,0\n", "decimal point"),
        ("a.xyz", "version https://git-lfs.example/spec/v1\noid sha256:0\nsize 4453983\n", "git lfs pull"),
        ("a.xyz", "nan nan nan\n1.0 2.0 3.0\n", "invalid coordinates"),
        ("a.xyz", "352000.0 5400000.0 264.0\n" * 5, "origin at the sonar"),
        ("a.off", "OFF\n3 0 0\n1 2 3\n", "truncated"),
        ("a.off", "1 2 3\n", "line 1"),
        ("b.xyz", None, "no such file"),
    ],
)
def test_what_is_no_sonar_scan_is_refused_in_one_line(tmp_path: Path, name: str, text: str | None, said: str) -> None:
    path = tmp_path / name
    if text is not None:
        path.write_text(text)
    with pytest.raises(UserError, match=said) as raised:
        read_sonar(path)
    assert str(path) in str(raised.value)
    assert "\n" not in str(raised.value)
