"""Virtual point clouds: what names a point cloud for programs that show several as one."""

from __future__ import annotations

import datetime as dt
import json
from pathlib import Path

import numpy as np

from tunneldb.export.pointcloud.dimensions import Dimension
from tunneldb.export.pointcloud.vpc import Cloud, write_vpc

GREATEST = float(np.finfo(np.float64).max)


def test_names_with_dots_stay_apart_and_sums_beyond_all_numbers_are_left_out(tmp_path: Path) -> None:
    plain, huge = Dimension("Z", "floating", 8), Dimension("Huge", "floating", 8)
    for _ in range(2):
        plain.add(np.array([1.0, 3.0]))
        huge.add(np.array([GREATEST, -GREATEST, GREATEST]))
    path = tmp_path / "a.vpc"
    for name in ("north.2024-km001.copc.laz", "north.2025-km001.copc.laz"):
        (tmp_path / name).touch()
        write_vpc(path, Cloud(name, np.zeros(3), np.ones(3), 4, [plain, huge], None), dt.date(2024, 5, 4), tmp_path)

    def refused(constant: str) -> None:
        raise AssertionError(constant)  # Infinity and NaN are no JSON

    items = json.loads(path.read_text("utf-8"), parse_constant=refused)["features"]
    assert [item["id"] for item in items] == ["north.2024-km001", "north.2025-km001"]
    for item in items:
        assert [entry["name"] for entry in item["properties"]["pc:statistics"]] == ["Z"]
        assert len(item["properties"]["pc:schemas"]) == 2
