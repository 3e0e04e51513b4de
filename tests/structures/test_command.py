"""The verb `members` on files."""

from __future__ import annotations

import json
from pathlib import Path

import laspy
import numpy as np
import pyogrio
import pytest
from click.testing import CliRunner
from pyproj import CRS
from support.structure_scene import Pipe, Plate, scan

from tunneldb.cli.main import main


@pytest.fixture(scope="module")
def plant(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wall with a dark spot behind a pipe, as LAZ."""
    seen = scan([Plate((-1, 4, 0.5), (2, 0, 0), (0, 0, 2)), Pipe((-0.3, 3, 0), (-0.3, 3, 3), 0.06)], [(0, 0, 1.5)], 0.003,
                window=(-0.3, 0.3, -0.3, 0.3))  # fmt: skip
    level = 30 - 20 * np.log10(seen.range_m) + np.random.default_rng(1).normal(0, 0.4, len(seen.xyz))
    dark = (seen.surface == 0) & (np.linalg.norm(seen.xyz - (0.5, 4, 1.6), axis=1) < 0.15)
    level[dark] -= 3.0
    return _write(tmp_path_factory.mktemp("plant") / "plant.laz", seen.xyz, level)


def _write(path: Path, xyz: np.ndarray, level: np.ndarray, crs: int | None = 25829) -> Path:
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = [1e-4] * 3, [0, 0, 0]
    header.add_extra_dim(laspy.ExtraBytesParams("Amplitude", "f4"))
    if crs:
        header.add_crs(CRS.from_epsg(crs))
    las = laspy.LasData(header)
    las.xyz, las.Amplitude = xyz, level
    las.point_source_id = np.ones(len(xyz), np.uint16)
    las.write(path)
    path.with_suffix(".csv").write_text("scan_id,x,y,z\n1,0,0,1.5\n")
    return path


def _run(path: Path, *more: str, stations: bool = True) -> tuple[int, dict]:
    options = ["--stations", str(path.with_suffix(".csv"))] if stations else []
    asked = ["members", str(path), *options, "--intensity", "Amplitude", "--intensity-kind", "amplitude", *more, "--json"]
    result = CliRunner().invoke(main, asked)
    return result.exit_code, json.loads(result.stdout)


def test_points_get_their_numbers_and_keep_the_rest(plant: Path, tmp_path: Path) -> None:
    code, told = _run(plant, "-o", str(tmp_path / "out.laz"))
    assert code == 0
    assert [spot["kind"] for spot in told["spots"]] == ["dark"]
    before, after = laspy.read(plant), laspy.read(tmp_path / "out.laz")
    for name in before.point_format.dimension_names:
        assert (before[name] == after[name]).all(), name
    assert after["face"].max() == len(told["faces"])
    assert after["member"].max() == len(told["members"])
    middle = after.xyz[after["anomaly"] == 1].mean(axis=0)
    np.testing.assert_allclose(middle, (0.5, 4.0, 1.6), atol=0.02)
    code, told = _run(tmp_path / "out.laz", "-o", str(tmp_path / "again.laz"), stations=False)
    assert code == 2


def test_polygons_lie_where_the_points_do(plant: Path, tmp_path: Path) -> None:
    code, _ = _run(plant, "-o", str(tmp_path / "out.gpkg"))
    assert code == 0
    layers = dict(pyogrio.list_layers(tmp_path / "out.gpkg"))
    assert set(layers) == {"member", "face", "spot"}
    info = pyogrio.read_info(tmp_path / "out.gpkg", layer="spot")
    assert info["features"] == 1
    west, south, east, north = info["total_bounds"]
    assert west == pytest.approx(0.35, abs=0.03)
    assert east == pytest.approx(0.65, abs=0.03)
    assert south == pytest.approx(north, abs=0.01)  # it stands upright
    assert CRS(info["crs"]).to_epsg() == 25829


@pytest.mark.parametrize(
    ("name", "level", "crs", "says"),
    [
        ("constant", lambda n: np.full(n, 7.0), 25829, "all values are 7"),
        ("saturated", lambda n: np.where(np.arange(n) % 5 == 0, 20.0, 45.0), 25829, "saturated: 80 %"),
        ("nothing", lambda n: np.full(n, np.nan), 25829, "no value is a number"),
        ("degrees", lambda n: np.linspace(10, 20, n), 4326, "coordinates are degrees"),
        ("counts", lambda n: np.linspace(0, 4000, n), 25829, "no amplitude"),
    ],
)
def test_bad_input_is_one_line(tmp_path: Path, name: str, level, crs: int, says: str) -> None:
    xyz = np.random.default_rng(0).uniform(1.0, 3.0, (2000, 3))
    path = _write(tmp_path / f"{name}.laz", xyz, level(2000), crs)
    code, told = _run(path, "-o", str(tmp_path / "out.laz"))
    assert code == 2
    assert says in told["error"]
    assert "\n" not in told["error"]
    assert not (tmp_path / "out.laz").exists()


def test_where_the_scanner_stood_must_be_known(plant: Path, tmp_path: Path) -> None:
    code, told = _run(plant, stations=False)
    assert code == 2
    assert "--stations" in told["error"]
    other = tmp_path / "other.csv"
    other.write_text("scan_id,x,y,z\n7,0,0,1.5\n")
    code, told = _run(plant, "--stations", str(other), stations=False)
    assert code == 2
    assert "no station for scan_id 1" in told["error"]
