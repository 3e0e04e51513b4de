import builtins
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pyproj import CRS
from scipy.spatial.transform import Rotation
from support.real_scans import real_scan

from tunneldb.errors import UserError
from tunneldb.pointcloud.formats.e57 import read_e57_scans, scan_number
from tunneldb.pointcloud.formats.table import has_colours
from tunneldb.pointcloud.reader import check_header, crs_note, read_chunks, read_header
from tunneldb.pointcloud.stations import read_stations

pytest.importorskip("pye57")
from support import e57_files as e57

QUATERNION = (0.5, -0.1, 0.7, 0.4)  # w, x, y, z; not of length 1
TURN = Rotation.from_quat([-0.1, 0.7, 0.4, 0.5])  # SciPy: x, y, z, w
STATION = np.array([500_010.25, 4_500_020.5, 101.75])


def cloud(count: int = 1000, seed: int = 0) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    xyz = rng.uniform(-9, 9, (3, count))
    fields = dict(zip(("cartesianX", "cartesianY", "cartesianZ"), xyz, strict=True))
    return {**fields, "intensity": np.round(rng.uniform(0, 4096, count))}


def own(fields: Mapping[str, np.ndarray]) -> np.ndarray:
    return np.column_stack([fields[f"cartesian{axis}"] for axis in "XYZ"])


def read(path: Path, dimension: str | None = "intensity", **options: Any) -> dict[str, np.ndarray]:
    chunks = list(read_chunks(path, dimension, **options))
    names = [name for name in chunks[0].__dataclass_fields__ if getattr(chunks[0], name) is not None]
    return {name: np.concatenate([getattr(chunk, name) for chunk in chunks]) for name in names}


def test_pose_turns_and_moves_points(tmp_path: Path) -> None:
    fields = cloud()
    path = e57.write(tmp_path / "a.e57", [e57.Scan(fields, STATION, QUATERNION)])
    points = read(path, size=300)
    np.testing.assert_allclose(points["xyz"], TURN.apply(own(fields)) + STATION, atol=1e-8)
    np.testing.assert_array_equal(points["intensity"], fields["intensity"].astype("f4"))
    assert not points["time"].any()
    assert not points["classification"].any()
    assert set(points["scan_id"]) == {scan_number("{A}", STATION)}


def test_colours_have_16_bits_whatever_the_file_s(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    colour = rng.integers(0, 1024, (3, 1000))
    names = ("colorRed", "colorGreen", "colorBlue")
    hidden = np.arange(1000) % 7 == 0
    flags = {"isColorInvalid": hidden.astype(int)}
    limits = {f"{name}{end}": value for name in names for end, value in (("Minimum", 0.0), ("Maximum", 1023.0))}
    bytes_ = dict(zip(names, rng.integers(0, 256, (3, 1000)), strict=True))
    path = e57.write(
        tmp_path / "a.e57",
        [e57.Scan({**cloud(), **dict(zip(names, colour, strict=True)), **flags}, STATION, colour_limits=limits),
         e57.Scan({**cloud(), **bytes_}, STATION, guid="{B}")],
    )  # fmt: skip
    assert has_colours(path)
    assert "colour" not in read(path)
    read_ = read(path, colours=True)["colour"]
    np.testing.assert_array_equal(read_[:1000], np.rint(np.where(hidden, 0, colour) * 65535 / 1023).astype(int).T)
    np.testing.assert_array_equal(read_[1000:], np.array(list(bytes_.values())).T * 257)
    assert not has_colours(e57.write(tmp_path / "b.e57", [e57.Scan(cloud(), STATION)]))


def test_points_are_where_pye57_puts_them(tmp_path: Path) -> None:
    pye57 = pytest.importorskip("pye57")
    path = e57.write(
        tmp_path / "a.e57", [e57.Scan(cloud(), STATION, Rotation.from_euler("xyz", [1, 2, 3]).as_quat(scalar_first=True))]
    )
    theirs = pye57.E57(str(path)).read_scan(0, intensity=True, ignore_missing_fields=True)
    np.testing.assert_allclose(read(path)["xyz"], own(theirs), atol=1e-8)


def test_without_a_pose_points_are_in_the_file_s_frame(tmp_path: Path) -> None:
    fields = cloud()
    points = read(e57.write(tmp_path / "a.e57", [e57.Scan(fields)]))
    np.testing.assert_allclose(points["xyz"], own(fields), atol=1e-12)


def test_spherical_coordinates(tmp_path: Path) -> None:
    xyz = own(cloud())
    plan = np.hypot(xyz[:, 0], xyz[:, 1])
    fields = {
        "sphericalRange": np.linalg.norm(xyz, axis=1),
        "sphericalAzimuth": np.arctan2(xyz[:, 1], xyz[:, 0]),
        "sphericalElevation": np.arctan2(xyz[:, 2], plan),
        "sphericalInvalidState": np.arange(len(xyz)) % 3,
    }
    points = read(e57.write(tmp_path / "a.e57", [e57.Scan(fields, STATION, QUATERNION)]), None)
    np.testing.assert_allclose(points["xyz"], TURN.apply(xyz[::3]) + STATION, atol=1e-8)


def test_invalid_points_are_left_out(tmp_path: Path) -> None:
    fields = cloud()
    state = np.arange(1000) % 3  # 1: only its direction is known, 2: nothing is
    intensity_bad = (np.arange(1000) % 6 == 0).astype(int)
    path = e57.write(
        tmp_path / "a.e57", [e57.Scan({**fields, "cartesianInvalidState": state, "isIntensityInvalid": intensity_bad})]
    )
    assert read_header(path).points == 1000
    np.testing.assert_allclose(read(path, None)["xyz"], own(fields)[state == 0], atol=1e-12)
    good = (state == 0) & (intensity_bad == 0)
    np.testing.assert_array_equal(read(path)["intensity"], fields["intensity"][good].astype("f4"))


def test_nothing_but_invalid_points(tmp_path: Path) -> None:
    path = e57.write(tmp_path / "a.e57", [e57.Scan({**cloud(), "cartesianInvalidState": np.full(1000, 2)})])
    with pytest.raises(UserError, match="all 1000 points are marked as invalid"):
        list(read_chunks(path, "intensity"))


def test_scaled_integers_keep_the_file_s_values(tmp_path: Path) -> None:
    fields = {**cloud(), "intensity": np.arange(1000) / 8 - 40}
    scales = {"cartesianX": 1e-6, "cartesianY": 1e-6, "cartesianZ": 1e-6, "intensity": 0.125}
    points = read(e57.write(tmp_path / "a.e57", [e57.Scan(fields, scaled=scales)]))
    np.testing.assert_allclose(points["xyz"], own(fields), atol=1e-6)
    np.testing.assert_array_equal(points["intensity"], fields["intensity"])


@pytest.mark.parametrize("invalid", [False, True], ids=["all valid", "some invalid"])
def test_ranges_are_slices_of_the_whole(tmp_path: Path, invalid: bool) -> None:
    clouds = [cloud(count, count) for count in (1000, 1, 700, 1300)]
    for number, fields in enumerate(clouds):
        if invalid and number != 2:
            fields["cartesianInvalidState"] = np.random.default_rng(number).integers(0, 2, len(fields["intensity"]))
    path = e57.write(tmp_path / "a.e57", [e57.Scan(fields, STATION + i, QUATERNION) for i, fields in enumerate(clouds)])
    whole = read(path, size=128)
    end = len(whole["xyz"])
    ranges = [(0, 1), (10, 600), (600, 601), (900, 1400), (3, 4), (end - 5, end), (5, 5), (0, end)]
    parts = read(path, size=128, ranges=ranges)
    for name, values in whole.items():
        np.testing.assert_array_equal(parts[name], np.concatenate([values[a:b] for a, b in ranges]))
    with pytest.raises(UserError, match="points up to 3002 requested"):
        list(read_chunks(path, None, ranges=[(0, 3002)]))
    if invalid:
        with pytest.raises(UserError, match=rf"{end} valid points, points up to {end + 1} requested"):
            list(read_chunks(path, None, ranges=[(0, end + 1)]))


def test_times_count_from_the_scan_s_start(tmp_path: Path) -> None:
    fields = {**cloud(), "timeStamp": np.arange(1000) * 0.01}
    path = e57.write(tmp_path / "a.e57", [e57.Scan(fields, start=1_300_000_000.5)])
    check_header(read_header(path), "intensity", 25830, needs_time=True)
    np.testing.assert_allclose(read(path)["time"], 1_300_000_000.5 + np.arange(1000) * 0.01, atol=1e-6)
    path = e57.write(tmp_path / "b.e57", [e57.Scan(fields)])
    with pytest.raises(UserError, match="no dimension 'gps_time', which the trajectory needs; the file has intensity"):
        check_header(read_header(path), "intensity", 25830, needs_time=True)


def test_fields_of_extensions_are_dimensions(tmp_path: Path) -> None:
    """RIEGL writes reflectance in dB beside an intensity without a unit; if one scan lacks it, it is not a dimension."""
    fields = cloud() | {"rlms:reflectance": np.random.default_rng(5).uniform(-25.0, 5.0, 1000)}
    path = e57.write(tmp_path / "a.e57", [e57.Scan(fields, STATION)])
    assert read_header(path).dimensions == ("intensity", "rlms:reflectance")
    points = read(path, "rlms:reflectance", size=300)
    np.testing.assert_array_equal(points["intensity"], fields["rlms:reflectance"].astype("f4"))
    np.testing.assert_allclose(points["xyz"], own(fields) + STATION, atol=1e-8)
    both = e57.write(tmp_path / "b.e57", [e57.Scan(fields), e57.Scan(cloud(seed=1), guid="{B}")])
    with pytest.raises(UserError, match=r"rlms:reflectance.*intensity"):
        read(both, "rlms:reflectance")


def test_missing_dimension_lists_those_present(tmp_path: Path) -> None:
    path = e57.write(tmp_path / "a.e57", [e57.Scan(cloud())])
    with pytest.raises(UserError, match=r"no dimension 'Intensity' \(did you mean 'intensity'\?.*; the file has intensity$"):
        list(read_chunks(path, "Intensity"))
    bare = {name: values for name, values in cloud().items() if name != "intensity"}
    path = e57.write(tmp_path / "b.e57", [e57.Scan(cloud()), e57.Scan(bare)])
    with pytest.raises(UserError, match="no dimension 'intensity'; the file has none"):
        list(read_chunks(path, "intensity"))


@pytest.mark.parametrize("frame", ["own", "file", "none", "nonsense"])
def test_box_is_in_the_file_s_frame(tmp_path: Path, frame: str) -> None:
    fields = cloud()
    moved = TURN.apply(own(fields)) + STATION
    bounds = {
        "own": (own(fields).min(axis=0), own(fields).max(axis=0)),
        "file": (moved.min(axis=0), moved.max(axis=0)),
        "none": None,
        "nonsense": (np.full(3, -np.finfo(float).max), np.full(3, np.finfo(float).max)),
    }[frame]
    header = read_header(e57.write(tmp_path / "a.e57", [e57.Scan(fields, STATION, QUATERNION, bounds=bounds)]))
    assert np.all(header.low <= moved.min(axis=0) + 1e-6)
    assert np.all(header.high >= moved.max(axis=0) - 1e-6)
    assert np.all(header.high - header.low < 60)  # the box of a turned box is larger, up to √3 times


@pytest.mark.parametrize(
    ("metadata", "crs"),
    [("", None), ("site grid, see plan", None), (CRS(25830).to_wkt(), CRS(25830)), ("EPSG:3794", CRS(3794))],
)
def test_coordinate_system_where_it_is_readable(tmp_path: Path, metadata: str, crs: CRS | None) -> None:
    header = read_header(e57.write(tmp_path / "a.e57", [e57.Scan(cloud())], metadata))
    assert header.crs == crs
    assert crs_note(header, 25830) == {
        "": "states no coordinate system; using the tunnel's, EPSG:25830",
        "site grid, see plan": "states a coordinate system that cannot be read (coordinateMetadata: 'site grid, see plan' "
        "(proj_create: unrecognized format / unknown name)); using the tunnel's, EPSG:25830",
    }.get(metadata)


def test_poses_are_stations(tmp_path: Path) -> None:
    scans = [e57.Scan(cloud(), STATION + i, QUATERNION, f"{{{i}}}") for i in range(3)]
    (tmp_path / "scans").mkdir()
    one = e57.write(tmp_path / "scans" / "1.e57", scans[:2])
    two = e57.write(tmp_path / "scans" / "2.E57", scans[1:])  # the second scan is in both
    stations = read_stations([tmp_path / "scans"])
    assert len(set(stations.scan_id.tolist())) == 3
    np.testing.assert_array_equal(stations.xyz, [STATION, STATION + 1, STATION + 2])
    for path, numbers in ((one, stations.scan_id[:2]), (two, stations.scan_id[1:])):
        assert list(dict.fromkeys(read(path)["scan_id"].tolist())) == numbers.tolist()
    again = read_stations([two, one])
    assert dict(zip(again.scan_id.tolist(), again.xyz.tolist(), strict=True)) == dict(
        zip(stations.scan_id.tolist(), stations.xyz.tolist(), strict=True)
    )


def test_scans_of_equal_guid_at_other_places_are_others(tmp_path: Path) -> None:
    path = e57.write(tmp_path / "a.e57", [e57.Scan(cloud(), STATION), e57.Scan(cloud(), STATION + 9)])
    assert len(read_stations([path]).scan_id) == 2


def test_scan_numbers_are_beyond_those_of_las() -> None:
    numbers = [scan_number(f"{{{i}}}", STATION) for i in range(1000)]
    assert len(set(numbers)) == 1000
    assert min(numbers) > 65535
    assert max(numbers) < 2**31
    assert scan_number("{ab}", np.zeros(3)) == scan_number("{AB}", -np.zeros(3))


def test_scan_without_pose_needs_a_csv(tmp_path: Path) -> None:
    path = e57.write(tmp_path / "a.e57", [e57.Scan(cloud(), STATION), e57.Scan(cloud())])
    number = scan_number("{A}", None)
    with pytest.raises(UserError, match=rf"a\.e57, scan 2 \(Scan 2\) has no pose.*scan_id {number}$"):
        read_stations([path])
    (tmp_path / "s.csv").write_text(f"scan_id,x,y,z\n{number},1,2,3\n")
    assert sorted(read_stations([path, tmp_path / "s.csv"]).xyz.tolist()) == [[1, 2, 3], STATION.tolist()]


def test_two_positions_of_one_station(tmp_path: Path) -> None:
    for name in "ab":
        (tmp_path / f"{name}.csv").write_text(f"scan_id,x,y,z\n1,0,0,{ord(name)}\n")
    with pytest.raises(UserError, match=r"scan_id 1 has two positions: in .*a\.csv, line 2 and in .*b\.csv, line 2"):
        read_stations([tmp_path / "a.csv", tmp_path / "b.csv"])
    (tmp_path / "empty").mkdir()
    with pytest.raises(UserError, match="no E57 or PTX file in this folder"):
        read_stations([tmp_path / "empty"])


@pytest.mark.parametrize("share", [0.0, 0.001, 0.3, 0.999])
def test_truncated(tmp_path: Path, share: float) -> None:
    path = e57.write(tmp_path / "a.e57", [e57.Scan(cloud())])
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    with pytest.raises(UserError, match=r"a\.e57: truncated, corrupt or not an E57 file"):
        read_header(path)


def test_every_damaged_byte_is_noticed(tmp_path: Path) -> None:
    path = e57.write(tmp_path / "a.e57", [e57.Scan(cloud(200), STATION)])
    data = path.read_bytes()
    for place in np.random.default_rng(1).integers(0, len(data), 60):
        bad = bytearray(data)
        bad[place] ^= 0x55
        path.write_bytes(bad)
        with pytest.raises(UserError, match=r"a\.e57: truncated, corrupt or not an E57 file"):
            read_header(path)
            list(read_chunks(path, "intensity"))


def test_missing_empty_and_odd_files(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"none\.e57: no such file"):
        read_header(tmp_path / "none.e57")
    with pytest.raises(UserError, match="holds no scan"):
        read_header(e57.write(tmp_path / "a.e57", []))
    nothing = {name: values[:0] for name, values in cloud().items()}
    with pytest.raises(UserError, match="holds no points"):
        read_header(e57.write(tmp_path / "b.e57", [e57.Scan(nothing)]))
    with pytest.raises(UserError, match=r"scan 'Scan 1' have no coordinates, only intensity"):
        read_header(e57.write(tmp_path / "c.e57", [e57.Scan({"intensity": np.ones(3)})]))
    with pytest.raises(UserError, match="scan 'Scan 1' has an invalid pose"):
        read_header(e57.write(tmp_path / "d.e57", [e57.Scan(cloud(), STATION, (0, 0, 0, 0))]))
    fields = cloud()
    fields["cartesianY"][[3, 8]] = np.nan
    chunks = list(read_chunks(e57.write(tmp_path / "e.e57", [e57.Scan(fields, STATION)]), None))
    assert sum(map(len, chunks)) == len(fields["cartesianY"]) - 2
    assert all(np.isfinite(chunk.xyz).all() for chunk in chunks)


def test_without_pye57_a_line_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real: Callable[..., Any] = builtins.__import__

    def refuse(name: str, *args: Any, **options: Any) -> Any:
        if name == "pye57":
            raise ModuleNotFoundError("No module named 'pye57'")
        return real(name, *args, **options)

    path = e57.write(tmp_path / "a.e57", [e57.Scan(cloud())])
    monkeypatch.delitem(sys.modules, "pye57")
    monkeypatch.setattr(builtins, "__import__", refuse)
    with pytest.raises(UserError, match=r'pip install "tunneldb\[e57\]"'):
        read_header(path)


def test_real_scan_as_pye57_reads_it() -> None:
    pye57 = pytest.importorskip("pye57")
    points = read(real_scan("pump.e57"), size=50_000)
    theirs = pye57.E57(str(real_scan("pump.e57"))).read_scan(0, intensity=True, ignore_missing_fields=True)
    assert len(points["xyz"]) == 155_201
    np.testing.assert_allclose(points["xyz"], own(theirs), atol=1e-12)
    np.testing.assert_array_equal(points["intensity"], theirs["intensity"])
    header = read_header(real_scan("pump.e57"))
    np.testing.assert_allclose([header.low, header.high], [points["xyz"].min(axis=0), points["xyz"].max(axis=0)], atol=2e-6)
    (scan,) = read_e57_scans(real_scan("pump.e57"))
    assert (scan.name, scan.position) == ("pumpA", None)


def crc32c(data: bytes) -> int:
    """Castagnoli's checksum, which pages of E57 end with."""
    value = 0xFFFFFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0x82F63B78 if value & 1 else 0)
    return value ^ 0xFFFFFFFF


def state_count(path: Path, former: int, count: int) -> None:
    """Change the number of points that the first scan states."""
    pages = [path.read_bytes()[at : at + 1020] for at in range(0, path.stat().st_size, 1024)]
    old, new = (f'recordCount="{number}"'.encode() for number in (former, count))
    changed = b"".join(pages).replace(old, new, 1)
    assert len(changed) == sum(map(len, pages))
    assert new in changed
    with path.open("r+b") as file:
        for number, page in enumerate(pages):
            data = changed[1020 * number : 1020 * (number + 1)]
            if data != page:
                file.seek(1024 * number)
                file.write(data + crc32c(data).to_bytes(4, "big"))


def test_a_number_of_points_that_the_data_contradict_is_named(tmp_path: Path) -> None:
    path = e57.write(tmp_path / "a.e57", [e57.Scan(cloud(20_000), STATION)])
    assert read_header(path).notes == ()
    state_count(path, 20_000, 10_000)
    (note,) = read_header(path).notes
    assert "states 10000 points, which are read, but its data are of about 200" in note
    assert len(read(path)["xyz"]) == 10_000
    state_count(path, 10_000, 30_000)
    with pytest.raises(UserError, match="ends after 20000 of 30000 points"):
        read(path)
