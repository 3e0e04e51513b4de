"""PTX, PTS, tables and PLY: what was written by hand, or by another library, is what is read; faults name file and line."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

import laspy
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tunneldb.arrays import Float, UInt8
from tunneldb.errors import UserError
from tunneldb.pointcloud.formats import text
from tunneldb.pointcloud.points import Points
from tunneldb.pointcloud.reader import read_chunks, read_header
from tunneldb.pointcloud.rewrite import read_coordinates, rewrite
from tunneldb.pointcloud.stations import read_stations

FAR = np.array([500_000.0, 4_600_000.0, 300.0])
RNG = np.random.default_rng(1)
XYZ = RNG.uniform(-20.0, 20.0, (1000, 3)).round(4)
VALUES = RNG.uniform(0.0, 1.0, 1000).round(6)


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """So that a file of a thousand lines is many blocks."""
    monkeypatch.setattr(text, "BLOCK_LINES", 137)


def read(path: Path, dimension: str | None = None, **options: object) -> Points:
    chunks = list(read_chunks(path, dimension, **options))  # type: ignore[arg-type]
    names = ("xyz", "time", "scan_id", "intensity", "classification")
    return Points(*(np.concatenate([getattr(chunk, name) for chunk in chunks]) for name in names))


def ptx(scans: list[tuple[int, int, Float, Float, list[str]]]) -> str:
    """Text of PTX: columns, rows, rotation (own frame to the file's), position, lines."""
    lines = []
    for columns, rows, rotation, position, points in scans:
        place = " ".join(f"{value:.6f}" for value in position)
        axes = [" ".join(f"{value:.9f}" for value in rotation[:, axis]) for axis in range(3)]
        lines += [str(columns), str(rows), place, *axes, *(f"{axis} 0" for axis in axes), f"{place} 1", *points]
    return "\n".join(lines) + "\n"


def test_ptx_scans_are_turned_and_moved_by_their_poses(tmp_path: Path) -> None:
    rotations = Rotation.from_euler("zyx", [[30, 2, -1], [200, -3, 0.5]], degrees=True).as_matrix()
    positions = FAR + np.array([[0.0, 0.0, 0.0], [25.0, -3.0, 0.2]])
    world = [FAR + XYZ[:600], FAR + XYZ[600:]]
    scans, values = [], [VALUES[:600], VALUES[600:]]
    for rotation, position, points, own in zip(rotations, positions, world, values, strict=True):
        seen = (points - position) @ rotation  # the inverse turn
        lines = [f"{x:.7f} {y:.7f} {z:.7f} {i:.6f}" for (x, y, z), i in zip(seen, own, strict=True)]
        lines[7:7] = ["0 0 0 0.500000"] * 10  # rays without an echo
        scans.append((10, len(lines) // 10, rotation, position, lines))
    (tmp_path / "a.ptx").write_text(ptx(scans))

    header = read_header(tmp_path / "a.ptx")
    assert (header.points, header.dimensions, header.crs) == (1000, ("intensity",), None)
    np.testing.assert_allclose([header.low, header.high], [(FAR + XYZ).min(axis=0), (FAR + XYZ).max(axis=0)], atol=1e-5)
    found = read(tmp_path / "a.ptx", "intensity")
    np.testing.assert_allclose(found.xyz, FAR + XYZ, atol=1e-5)
    np.testing.assert_allclose(found.intensity, VALUES, atol=1e-6)
    stations = read_stations([tmp_path / "a.ptx"])
    np.testing.assert_allclose(stations.xyz, positions)
    np.testing.assert_array_equal(found.scan_id, np.repeat(stations.scan_id, [600, 400]))
    assert len(set(stations.scan_id)) == 2
    assert min(stations.scan_id) >= 65536
    (tmp_path / "scans").mkdir()
    (tmp_path / "scans" / "b.ptx").write_text(ptx(scans[1:]))
    assert read_stations([tmp_path / "scans"]).scan_id[0] == stations.scan_id[1]  # the same in another file


def test_two_ptx_scans_without_registration_are_two(tmp_path: Path) -> None:
    scan = (1, 2, np.eye(3), np.zeros(3), ["1 2 3 0.5 9 9 9", "2 3 4 0.6 9 9 9"])
    (tmp_path / "a.ptx").write_text(ptx([scan, scan]))
    assert len(read_stations([tmp_path / "a.ptx"]).scan_id) == 2
    assert read_header(tmp_path / "a.ptx").dimensions == ("intensity", "red", "green", "blue")


def test_a_table_written_by_numpy(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "a.txt", np.column_stack([FAR + XYZ, VALUES]), header="x y z intensity")
    found = read(tmp_path / "a.txt", "intensity")
    np.testing.assert_allclose(found.xyz, FAR + XYZ, rtol=0, atol=1e-9)
    np.testing.assert_allclose(found.intensity, VALUES, atol=1e-6)


def rows(*columns: Float, divider: str = " ") -> str:
    return "\n".join(divider.join(f"{value!r}" for value in row) for row in np.column_stack(columns).tolist()) + "\n"


def write_pts(path: Path) -> None:
    body = rows(FAR + XYZ, np.rint(VALUES * 4095 - 2048), *np.full((3, 1000), 7)).splitlines(keepends=True)
    path.write_text("400\n" + "".join(body[:400]) + "600\r\n" + "".join(body[400:]))


def test_pts_of_two_pieces(tmp_path: Path) -> None:
    write_pts(tmp_path / "a.PTS")
    found = read(tmp_path / "a.PTS", "intensity")
    np.testing.assert_allclose(found.xyz, FAR + XYZ, atol=1e-9)
    np.testing.assert_array_equal(found.intensity, np.rint(VALUES * 4095 - 2048))
    assert not found.scan_id.any()


TIME = 1.3e9 + np.arange(1000) * 0.001
TABLES = {
    "header.csv": ("X;Y;Z;GpsTime;Reflectance;Point_Source_ID\n", ";"),
    "commas.txt": ('"x","y","z","gps_time","Reflectance","scan_id"\n', ","),
    "cloudcompare.asc": ("//X Y Z Gps_Time Reflectance Scan_id\n", " "),
    "remark.xyz": ("# exported\n# x y z gps_time Reflectance point_source_id\n\n", "\t"),
}


@pytest.mark.parametrize("name", TABLES)
def test_a_table_with_a_header(tmp_path: Path, name: str) -> None:
    head, divider = TABLES[name]
    numbers = np.arange(1000) // 250
    (tmp_path / name).write_text(head + rows(FAR + XYZ, TIME, VALUES, numbers, divider=divider))
    assert read_header(tmp_path / name).dimensions == ("gps_time", "Reflectance", "scan_id")
    found = read(tmp_path / name, "Reflectance")
    np.testing.assert_allclose(found.xyz, FAR + XYZ, atol=1e-9)
    np.testing.assert_allclose(found.time, TIME, rtol=0, atol=1e-6)
    np.testing.assert_allclose(found.intensity, VALUES, atol=1e-6)
    np.testing.assert_array_equal(found.scan_id, numbers)


def test_what_columns_are_is_said_and_not_guessed(tmp_path: Path) -> None:
    path = tmp_path / "a.xyz"
    path.write_text("wall " + "wall ".join(rows(XYZ, VALUES).splitlines(keepends=True)))
    with pytest.raises(UserError, match=r"'wall' is not|no column x, y, z"):
        read_header(path)
    path.write_text(rows(XYZ, VALUES))
    with pytest.raises(UserError, match=r"a\.xyz: its 4 columns have no names .*echo 'x y z column4' > .*a\.xyz\.columns"):
        read_header(path)
    (tmp_path / "xyz.columns").write_text("y x z intensity\n")
    np.testing.assert_array_equal(read(path).xyz, XYZ[:, [1, 0, 2]])
    (tmp_path / "a.xyz.columns").write_text("x, y, z, -")
    np.testing.assert_array_equal(read(path).xyz, XYZ)
    assert read_header(path).dimensions == ()
    (tmp_path / "a.xyz.columns").write_text("x y z")
    with pytest.raises(UserError, match=r"a\.xyz, line 1: 4 values, but .*a\.xyz\.columns names 3 columns"):
        read_header(path)
    (tmp_path / "three.xyz").write_text(rows(XYZ))
    (tmp_path / "xyz.columns").unlink()
    np.testing.assert_array_equal(read(tmp_path / "three.xyz").xyz, XYZ)


def test_a_column_of_words_is_left_out(tmp_path: Path) -> None:
    lines = [f"{x} {y} {z} wall {i}" for (x, y, z), i in zip(XYZ.tolist(), VALUES.tolist(), strict=True)]
    (tmp_path / "a.txt").write_text("\n".join(lines))  # no end of the last line
    (tmp_path / "a.txt.columns").write_text("x y z - intensity")
    found = read(tmp_path / "a.txt", "intensity")
    np.testing.assert_array_equal(found.xyz, XYZ)
    np.testing.assert_allclose(found.intensity, VALUES, atol=1e-6)


def ply_header(order: str, scalar: str) -> str:
    names = [(scalar, name) for name in "xyz"] + [("uchar", "red"), ("float", "scalar_Intensity"), ("double", "scalar_GpsTime")]
    vertex = "".join(f"property {kind} {name}\n" for kind, name in names)
    face = "element face 0\nproperty list uchar int v\n"
    return f"ply\nformat {order} 1.0\ncomment by hand\nelement vertex 1000\n{vertex}{face}end_header\n"


def write_ply(path: Path, order: str) -> None:
    with path.open("wb") as file:
        file.write(ply_header(order, "double").encode())
        for (x, y, z), value, time in zip((FAR + XYZ).tolist(), VALUES.tolist(), TIME.tolist(), strict=True):
            if order == "ascii":
                file.write(f"{x!r} {y!r} {z!r} 9 {value!r} {time!r}\n".encode())
            else:
                file.write(struct.pack(("<" if "little" in order else ">") + "3dBfd", x, y, z, 9, value, time))


@pytest.mark.parametrize("order", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_ply(tmp_path: Path, order: str) -> None:
    write_ply(tmp_path / "a.ply", order)
    header = read_header(tmp_path / "a.ply")
    assert (header.points, header.dimensions) == (1000, ("red", "intensity", "gps_time"))
    np.testing.assert_array_equal([header.low, header.high], [(FAR + XYZ).min(axis=0), (FAR + XYZ).max(axis=0)])
    found = read(tmp_path / "a.ply", "intensity")
    np.testing.assert_array_equal(found.xyz, FAR + XYZ)
    np.testing.assert_array_equal(found.time, TIME)
    np.testing.assert_allclose(found.intensity, VALUES, atol=1e-6)


def test_ply_rounded_to_decimetres_is_refused(tmp_path: Path) -> None:
    head = ply_header("binary_little_endian", "float").replace("vertex 1000", "vertex 1")
    (tmp_path / "a.ply").write_bytes(head.encode() + struct.pack("<3fBfd", *FAR, 9, 0.5, 0.0))
    with pytest.raises(UserError, match=r"resolution is only 0\.5 m so far from the origin; export them as double"):
        read_header(tmp_path / "a.ply")


@pytest.mark.parametrize("name", ["a.pts", "b.ply", "a.ply"])
def test_ranges_are_the_points_of_the_whole(tmp_path: Path, name: str) -> None:
    if name == "a.pts":
        write_pts(tmp_path / name)
    else:
        write_ply(tmp_path / name, "ascii" if name == "a.ply" else "binary_little_endian")
    whole = read(tmp_path / name, "intensity")
    ranges = [(0, 5), (130, 420), (999, 1000), (3, 3)]
    some = read(tmp_path / name, "intensity", size=50, ranges=ranges)
    chosen = np.concatenate([np.arange(begin, end) for begin, end in ranges])
    np.testing.assert_array_equal(some.xyz, whole.xyz[chosen])
    np.testing.assert_array_equal(some.intensity, whole.intensity[chosen])
    with pytest.raises(UserError, match="points up to 1001 requested"):
        read(tmp_path / name, ranges=[(0, 1001)])


ONE = ptx([(1, 1, np.eye(3), FAR, ["1 2 3 0.5"])])
GOOD = "".join(f"{i} 2 3 0.5\n" for i in range(300))
DAMAGED = {
    "word.pts": (GOOD + "1 2 x 0.5\n", r"word\.pts, line 301: 'x' is not a number"),
    "short.pts": (GOOD + "1 2\n", r"short\.pts, line 301: 2 values, expected 4"),
    "long.csv": ("x,y,z\n" + "1,2,3\n" * 300 + "1,2,3,4\n", r"long\.csv, line 302: 4 values, expected 3"),
    "comma.csv": ("x;y;z\n1,5;2,5;3,5\n", r"comma\.csv, line 2: '1,5' is not a number; write decimals with a point"),
    "count.pts": ("500\n" + GOOD, "truncated: line 1 states 500 points, but 300 follow"),
    "none.pts": ("", "holds no points"),
    "head.csv": ("A,B,H\n1,2,3\n", r"no column x, y: its header names A, B, H"),
    "tabs.txt": ("X\tY\tZ\n1,5\t2,5\t3,5\n", r"tabs\.txt, line 2: '1,5' is not a number; write decimals with a point"),
    "blanks.xyz": ("1,5 2,5 3,5\n", r"blanks\.xyz, line 1: '1,5' is not a number; write decimals with a point"),
    "commas.csv": ("x,y,z\n1,5,2,5,3,5\n", r"line 2: 6 values, but its header names 3 columns: x, y, z; write decimals with"),
    "comma.pts": ("1\n1,5 2,5 3,5\n", r"line 2: '1,5' is not a number; write decimals with a point"),
    "comma.ply": (
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty double x\nproperty double y\nproperty double z\n"
        "end_header\n1,5 2 3\n",
        r"line 8: '1,5' is not a number; write decimals with a point",
    ),
    "thousands.csv": ("x;y;z\n4'640'000.5;2;3\n", '000.5" is not a number; write it without separators of thousands'),
    "mac.xyz": ("1 2 3\r" * 2, "its lines end with CR only; save it with line ends LF or CR LF"),
    "utf16.xyz": ("\ufeff1 2 3\n", "its text is UTF-16; save it as UTF-8"),
    "count.asc": ("//X Y Z\n3\n1 2 3\n1 2 4\n", "line 2 states 3 points, but 2 follow; if .* complete, remove that line"),
    "names.txt": ("x y z\n1 2 3 4\n", r"names 3 columns: x, y, z; write 4 names, - for a column to leave out, to .*columns"),
    "twice.csv": ("x,y,z,X\n1,2,3,4\n", "names the column x twice"),
    "ids.csv": ("x,y,z,scan_id\n1,2,3,1.5\n", r"scan_id of point 1 is 1\.5, not a whole number"),
    "short.ptx": (ptx([(2, 5, np.eye(3), FAR, ["1 2 3 0.5"] * 9)]), "line 1 states 2 × 5 points, but 9 follow"),
    "turn.ptx": (ptx([(1, 1, np.eye(3) * 0.3048, FAR, ["1 2 3 0.5"])]), r"line 7: the scan's matrix is not a rotation"),
    "head.ptx": (
        ptx([(1, 1, np.eye(3), FAR, ["1 2 3 0.5"])]).replace("1.000000000", "one", 1),
        r"line 4: 'one .* has 3 numbers",
    ),
    "next.ptx": (ptx([(1, 1, np.eye(3), FAR, ["1 2 3 0.5"] * 2)]), r"line 12: '1 2 3 0\.5', but the header .* a number"),
    "none.ptx": (ptx([(1, 1, np.eye(3), FAR, ["0 0 0 0"])]), "holds no points"),
    "no.ply": ("plx\n", "is not a PLY file"),
    "type.ply": ("ply\nformat ascii 1.0\nelement vertex 1\nproperty real x\n", r"type\.ply, line 4: 'property real x'"),
    "face.ply": ("ply\nformat ascii 1.0\nelement face 1\nproperty int x\nend_header\n1\n", "no element vertex; it has face"),
    "short.ply": (ply_header("ascii", "float") + "1 2 3 9 0.5 1\n", "states 1000 vertices, but 1 lines follow"),
    "cut.ply": (ply_header("binary_little_endian", "float") + "a" * 25, "1000 vertices, but the file has space for 1"),
}


@pytest.mark.parametrize("name", DAMAGED)
def test_damage_is_told_in_one_line(tmp_path: Path, name: str) -> None:
    content, message = DAMAGED[name]
    (tmp_path / name).write_bytes(content.encode("utf-16-le" if content.startswith("\ufeff") else "utf-8"))
    with pytest.raises(UserError, match=message) as error:
        read_header(tmp_path / name)
        read(tmp_path / name)
    assert "\n" not in str(error.value)


SAME: dict[str, tuple[str | bytes, str]] = {
    "mark.xyz": ("\ufeff1.5 2 3\r\n4 5 6\r\n", "marks of Windows"),
    "mark.pts": ("\ufeff1.5 2 3\n4 5 6\n", "byte order mark, no count"),
    "quotes.csv": ('"x","y","z"\n"1.5","2","3"\n"4","5","6"\n', "quotes"),
    "end.csv": ("x,y,z,\n1.5,2,3,\n4,5,6,\n", "separators at the end"),
    "end.xyz": ("1.5;2;3;\n4;5;6;\n", "separators at the end, no header"),
    "remarks.txt": ("x y z\n1.5 2 3\n# second scan\n4 5 6\n// end\n", "comments between points"),
    "cc.asc": ("//X Y Z\n2\n1.5 2 3\n4 5 6\n", "CloudCompare, with a line of the number of points"),
    "east.txt": ("Northing;Easting;Elevation\n2;1.5;3\n5;4;6\n", "usual names"),
    "letters.txt": ("x;y;z;Höhe\n1.5;2;3;0\n4;5;6;0\n".encode("cp1252"), "Windows-1252"),
    "dos.xyz": (b"1.5 2 3\r\n4 5 6\r\n\x1a", "end mark of DOS"),
    "spaces.xyz": ("1.5\u00a02\u00a03\n4\u00a05\u00a06\n", "no-break spaces"),
}  # fmt: skip


@pytest.mark.parametrize("name", SAME)
def test_points_however_written_are_the_same(tmp_path: Path, name: str) -> None:
    content, _ = SAME[name]
    (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    assert read_header(tmp_path / name).points == 2
    assert read(tmp_path / name).xyz.tolist() == [[1.5, 2.0, 3.0], [4.0, 5.0, 6.0]]


def test_names_written_by_windows_are_read(tmp_path: Path) -> None:
    """``echo 'x y z i' > a.xyz.columns`` in PowerShell, in cmd.exe, and by Notepad."""
    (tmp_path / "a.xyz").write_text("1 2 3 4\n")
    for content in ("\ufeffx y z i\r\n".encode("utf-16-le"), b"'x y z i' \r\n", b"\xef\xbb\xbfx y z i"):
        (tmp_path / "a.xyz.columns").write_bytes(content)
        assert read_header(tmp_path / "a.xyz").dimensions == ("i",)


def test_missing_numbers_are_not_refused(tmp_path: Path) -> None:
    """As C on Windows, databases and spreadsheets write them: no intensity, and no point without a coordinate."""
    path = tmp_path / "a.csv"
    rows = ["1,2,3,-nan(ind)", "1,2,4,1.#QNAN", "1,2,5,NULL", "1,2,6,", "1,2,7,8", "-1.#IND,2,3,4", "nan(ind),2,3,4", ",2,3,4"]
    path.write_text("x,y,z,i\n" + "\n".join([*rows, "1,inf,3,4"]) + "\n")
    found = read(path, "i")
    np.testing.assert_array_equal(found.xyz, [[1, 2, z] for z in (3, 4, 5, 6, 7)])
    np.testing.assert_array_equal(found.intensity, [np.nan, np.nan, np.nan, np.nan, 8])
    header = read_header(path)
    assert (header.points, header.high.tolist()) == (9, [1.0, 2.0, 7.0])


def test_points_without_coordinates_are_not_written_again(tmp_path: Path) -> None:
    rows = ["nan,2,3,4,1", "1,2,3,NULL,1", "1,2,-nan(ind),5,1", "1,2,290,inf,2", "5,6,400,200,2"]
    (tmp_path / "a.csv").write_text("x,y,z,intensity,scan_id\n" + "\n".join(rows))
    classes = rewrite(tmp_path / "a.csv", tmp_path / "b.laz", below_or_above, {2: "ground"})
    las = laspy.read(tmp_path / "b.laz")
    np.testing.assert_allclose(las.xyz, [[1, 2, 3], [1, 2, 290], [5, 6, 400]], atol=1e-4)
    np.testing.assert_array_equal(las.classification, [2, 2, 64])
    np.testing.assert_array_equal(las.source_intensity, [np.nan, np.inf, 200.0])
    np.testing.assert_array_equal(las.intensity, np.rint(np.array([0.0, 1.0, 200 / 255]) * 65535))
    np.testing.assert_array_equal(las.point_source_id, [1, 2, 2])
    assert classes.sum() == las.header.point_count == 3


def test_a_point_that_is_none_is_left_out(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("x,y,z,i\n1,2,3,4\n1,2,nan,5\n1,2,4,nan\n")
    found = read(tmp_path / "a.csv", "i")
    np.testing.assert_array_equal(found.xyz, [[1, 2, 3], [1, 2, 4]])
    np.testing.assert_array_equal(found.intensity, [4, np.nan])
    assert read_header(tmp_path / "a.csv").high[2] == 4.0


def test_a_file_of_a_name_that_no_format_has_is_told_which_there_are(tmp_path: Path) -> None:
    (tmp_path / "a.pcd").write_text("VERSION .7\n")
    with pytest.raises(UserError, match=r"a\.pcd: unknown suffix; files of points end with \.las, \.laz, .*\.ptx"):
        read_header(tmp_path / "a.pcd")


def test_what_is_no_text_is_refused(tmp_path: Path) -> None:
    for name in ("a.ptx", "a.pts", "a.xyz", "a.ply"):
        (tmp_path / name).write_bytes(bytes(range(256)) * 1000)
        with pytest.raises(UserError, match=name):
            read_header(tmp_path / name)
        with pytest.raises(UserError, match="no such file"):
            read_header(tmp_path / f"no{name}")


def test_memory_does_not_grow_with_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sizes = []

    def watched(path: Path, block: bytes, *rest: object) -> Float:
        sizes.append(len(block))
        return parse(path, block, *rest)  # type: ignore[arg-type]

    parse = text.parse
    monkeypatch.setattr(text, "parse", watched)
    write_pts(tmp_path / "a.pts")
    chunks: Iterator[Points] = read_chunks(tmp_path / "a.pts", None)
    next(chunks)
    assert max(sizes) < 0.2 * (tmp_path / "a.pts").stat().st_size
    assert len(sizes) == 9  # eight blocks of 137 lines or fewer to find what there is, and one that is read


def below_or_above(xyz: Float) -> UInt8:
    return np.where(xyz[:, 2] < FAR[2], 2, 64).astype(np.uint8)


@pytest.mark.parametrize("name", ["a.pts", "a.ply", "a.csv"])
def test_written_again_as_laz_with_classes(tmp_path: Path, name: str) -> None:
    if name == "a.pts":
        write_pts(tmp_path / name)
    elif name == "a.ply":
        write_ply(tmp_path / name, "binary_little_endian")
    else:
        (tmp_path / name).write_text(
            "x;y;z;GpsTime;Amplitude;scan_id\n" + rows(FAR + XYZ, TIME, VALUES, np.arange(1000) // 9, divider=";")
        )
    classes = rewrite(
        tmp_path / name, tmp_path / "b.laz", lambda xyz: np.where(xyz[:, 2] < 300, 2, 64).astype(np.uint8), {2: "ground"}
    )
    las = laspy.read(tmp_path / "b.laz")
    np.testing.assert_allclose(las.xyz, FAR + XYZ, atol=6e-5)
    np.testing.assert_array_equal(las.classification, np.where(XYZ[:, 2] < 0, 2, 64))
    assert classes.sum() == 1000
    np.testing.assert_allclose([las.header.mins, las.header.maxs], [las.xyz.min(axis=0), las.xyz.max(axis=0)], atol=1e-9)
    source = read(tmp_path / name, "Amplitude" if name == "a.csv" else "intensity")
    np.testing.assert_allclose(las["Amplitude" if name == "a.csv" else "source_intensity"], source.intensity, rtol=1e-6)
    np.testing.assert_array_equal(las.gps_time, source.time)
    np.testing.assert_array_equal(las.point_source_id, source.scan_id)
    if name == "a.pts":
        np.testing.assert_array_equal(las.red, 7 * 257)
    np.testing.assert_allclose(np.concatenate(list(read_coordinates(tmp_path / name))), FAR + XYZ, atol=6e-5)
