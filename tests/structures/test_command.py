"""The command `members` on files."""

from __future__ import annotations

import json
from pathlib import Path

import laspy
import numpy as np
import pyogrio
import pyogrio.raw
import pytest
import shapely
from click.testing import CliRunner
from pyproj import CRS
from support.structure_scene import Pipe, Plate, scan

from tunneldb.cli.main import main

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def plant(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wall with a dark spot and a bright label behind a pipe, as LAZ."""
    seen = scan([Plate((-1, 4, 0.5), (2, 0, 0), (0, 0, 2)), Pipe((-0.3, 3, 0), (-0.3, 3, 3), 0.06)], [(0, 0, 1.5)], 0.003,
                window=(-0.3, 0.3, -0.3, 0.3))  # fmt: skip
    level = 30 - 20 * np.log10(seen.range_m) + np.random.default_rng(1).normal(0, 0.4, len(seen.xyz))
    dark = (seen.surface == 0) & (np.linalg.norm(seen.xyz - (0.5, 4, 1.6), axis=1) < 0.15)
    label = (seen.surface == 0) & (abs(seen.xyz[:, 0] - 0.5) < 0.2) & (abs(seen.xyz[:, 2] - 0.9) < 0.1)
    level[dark] -= 3.0
    level[label] += 4.0
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
    assert told["left_out"] == {"labels": 1, "bands": 0, "stray": 0, "parts": 0, "seams": 0}
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
    assert "1 label left out" in info["layer_metadata"]["DESCRIPTION"]
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
        ("counts", lambda n: np.linspace(0, 4000, n), 25829, "is not amplitude"),
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


def _layer(path: Path, name: str) -> tuple[dict, list[dict], np.ndarray]:
    """What a layer says of itself, its rows and its geometries."""
    meta, _, shapes, columns = pyogrio.raw.read(path, layer=name)
    rows = [dict(zip(meta["fields"], values, strict=True)) for values in zip(*columns, strict=True)]
    return pyogrio.read_info(path, layer=name), rows, shapely.from_wkb(shapes)


def test_faces_have_axis_radius_and_normal(plant: Path, tmp_path: Path) -> None:
    code, told = _run(plant, "-o", str(tmp_path / "out.gpkg"))
    assert code == 0
    _, rows, shapes = _layer(tmp_path / "out.gpkg", "face")
    pipe = next(row for row in rows if row["kind"] == "pipe")
    wall = max((row for row in rows if row["kind"] == "flat"), key=lambda row: row["area"])
    assert abs(pipe["axis_z"]) == pytest.approx(1.0, abs=1e-4)
    assert (pipe["origin_x"], pipe["origin_y"]) == pytest.approx((-0.3, 3.0), abs=0.003)
    assert pipe["radius"] == pytest.approx(0.06, abs=0.002)
    assert not pipe["inside"]
    normal = np.array([wall[f"axis_{axis}"] for axis in "xyz"])
    np.testing.assert_allclose(normal, (0.0, -1.0, 0.0), atol=0.003)  # towards the scanner
    at = shapely.get_coordinates(shapes[rows.index(wall)], include_z=True)
    assert np.abs((at - [wall[f"origin_{axis}"] for axis in "xyz"]) @ normal).max() < 1e-6
    by_number = {face["face"]: face for face in told["faces"]}
    assert by_number[wall["face"]]["axis"] == pytest.approx(normal.tolist())


def test_polygons_on_the_map_and_in_their_own_plane(plant: Path, tmp_path: Path) -> None:
    for geometry in ("map", "face"):
        assert _run(plant, "-o", str(tmp_path / f"{geometry}.gpkg"), "--geometry", geometry)[0] == 0
    info, rows, shapes = _layer(tmp_path / "map.gpkg", "member")  # the pipe parts the wall into two faces
    assert CRS(info["crs"]).to_epsg() == 25829
    assert not shapely.has_z(shapes).any()
    wall = shapes[int(np.argmax([row["area"] for row in rows]))]
    west, south, east, north = wall.bounds
    assert (west, east) == pytest.approx((-1.0, 1.0), abs=0.05)
    assert (south, north) == pytest.approx((4.0, 4.0), abs=0.03)
    info, rows, shapes = _layer(tmp_path / "face.gpkg", "spot")
    assert CRS(info["crs"]).is_engineering
    assert [shape.area for shape in shapes] == pytest.approx([row["area"] for row in rows], rel=0.01)
    assert shapes[0].area == pytest.approx(np.pi * 0.15**2, rel=0.1)
    code, told = _run(plant, "-o", str(tmp_path / "out.laz"), "--geometry", "map")
    assert code == 2
    assert "--geometry" in told["error"]
    assert not (tmp_path / "out.laz").exists()


def test_a_reference_curve_takes_the_range_out(plant: Path, tmp_path: Path) -> None:
    curve = tmp_path / "curve.csv"
    at = np.arange(0.5, 8.0, 0.05)
    np.savetxt(curve, np.column_stack([at, 30 - 20 * np.log10(at)]), "%.4f", ",", header="range_m,intensity_db", comments="")
    _, without = _run(plant)
    code, told = _run(plant, "--reference", str(curve))
    assert code == 0
    levels = {face["kind"]: face["level"] for face in without["faces"] if np.isfinite(face["level"] or np.nan)}
    assert levels["pipe"] - levels["flat"] == pytest.approx(20 * np.log10(4.0 / 2.95), abs=0.35)
    # Of all faces what is left over the curve is nothing but noise.
    left = [face["level"] for face in told["faces"] if face["level"] is not None]
    np.testing.assert_allclose(left, 0.0, atol=0.15)
    assert [spot["kind"] for spot in told["spots"]] == ["dark"]
    assert any("no reference curve" in note for note in without["notes"])
    assert not told["notes"]
    curve.write_text("range_m,intensity_db\n1,20\nx,18\n")
    code, told = _run(plant, "--reference", str(curve))
    assert code == 2
    assert str(curve) in told["error"]


def test_a_reference_curve_is_found_from_the_faces_or_said_to_be_none(plant: Path, tmp_path: Path) -> None:
    stations = [(-3.0, -1.0, 1.5), (3.0, -5.0, 1.5)]
    seen = scan(
        [Plate((-8, 2, -2), (16, 0, 0), (0, 0, 7)), Plate((-1, 0, 0.5), (2, 0, 0), (0, 0, 2))], stations, 0.01,
        window=(-1.2, 1.2, -0.8, 0.8),
    )  # fmt: skip
    level = 30 - 20 * np.log10(seen.range_m) + 10 * np.log10(seen.cosine)
    path = _write(tmp_path / "walls.laz", seen.xyz, level + np.random.default_rng(1).normal(0, 0.3, len(level)))
    las = laspy.read(path)
    las.point_source_id = seen.scan + 1
    las.write(path)
    path.with_suffix(".csv").write_text("scan_id,x,y,z\n1,-3,-1,1.5\n2,3,-5,1.5\n")
    code, told = _run(path, "--reference", "auto")
    assert code == 0
    assert "reference curve found from the faces" in " ".join(told["notes"])
    # Two plates of one material, several metres apart: with the range taken out they are of one level.
    levels = [face["level"] for face in told["faces"] if face["area"] > 1.0]
    assert len(levels) >= 2
    assert np.ptp(levels) < 1.0

    code, told = _run(plant, "--reference", "auto")  # nearly all of it at one distance
    assert code == 0
    assert "so none is used" in " ".join(told["notes"])
    assert [spot["kind"] for spot in told["spots"]] == ["dark"]
