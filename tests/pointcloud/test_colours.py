"""Colours of points in all formats, and how many bits they have."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import laspy
import numpy as np
import pytest
from support.command import command

from tunneldb.pointcloud.colour_depth import RUN_POINTS, WHOLE, ColourDepth, colour_depth
from tunneldb.pointcloud.formats.table import has_colours
from tunneldb.pointcloud.reader import read_chunks

COUNT = 900
XYZ = np.random.default_rng(0).uniform(-9, 9, (COUNT, 3))
COLOURS = np.random.default_rng(1).integers(0, 256, (COUNT, 3))
HEAD = "ply\nformat {order} 1.0\nelement vertex 900\n{properties}end_header\n"


def text(values: np.ndarray) -> str:
    return "".join(
        f"{x:.6f} {y:.6f} {z:.6f} {r} {g} {b}\n" for (x, y, z), (r, g, b) in zip(XYZ.tolist(), values.tolist(), strict=True)
    )


def ply(path: Path, order: str, kind: str, values: np.ndarray) -> None:
    properties = "".join(f"property double {name}\n" for name in "xyz")
    properties += "".join(f"property {kind} {name}\n" for name in ("red", "green", "blue"))
    head = HEAD.format(order=order, properties=properties).encode()
    if order == "ascii":
        path.write_bytes(head + text(values).encode())
        return
    letter = {"uchar": "B", "ushort": "H", "float": "f"}[kind]
    packed = (struct.pack(f"<3d3{letter}", *xyz, *rgb) for xyz, rgb in zip(XYZ.tolist(), values.tolist(), strict=True))
    path.write_bytes(head + b"".join(packed))


def las(path: Path, values: np.ndarray, point_format: int) -> None:
    made = laspy.create(
        point_format=point_format, file_version={5: "1.3"}.get(point_format, "1.2" if point_format < 6 else "1.4")
    )
    made.header.scales = [1e-3] * 3
    made.x, made.y, made.z = np.resize(XYZ, (len(values), 3)).T
    made.red, made.green, made.blue = values.T
    made.write(path)


def colours(path: Path) -> np.ndarray:
    return np.vstack([chunk.colour for chunk in read_chunks(path, None, 200, colours=True)])


def written(folder: Path) -> list[Path]:
    ptx = "1\n900\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
    (folder / "a.ptx").write_text(ptx + text(COLOURS))
    (folder / "a.pts").write_text("900\n" + text(COLOURS))
    (folder / "a.csv").write_text("x y z red green blue\n" + text(COLOURS))
    ply(folder / "ascii.ply", "ascii", "uchar", COLOURS)
    ply(folder / "binary.ply", "binary_little_endian", "uchar", COLOURS)
    for point_format in (2, 3, 5, 7, 8, 10):
        las(folder / f"{point_format}.laz", COLOURS, point_format)
    return sorted(path for path in folder.iterdir())


def test_every_format_has_its_colours(tmp_path: Path) -> None:
    paths = written(tmp_path)
    assert len(paths) == 11
    for path in paths:
        assert has_colours(path)
        np.testing.assert_array_equal(colours(path), COLOURS)
        assert colour_depth(path) == ColourDepth(255)
        assert next(read_chunks(path, None)).colour is None
    assert colour_depth(tmp_path / "a.pts").note(tmp_path / "a.pts") == (
        "a.pts: no colour is above 255, so colours are read as 8 bits"
    )


def test_without_colours_there_is_no_depth(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("x y z red\n1 2 3 4\n")
    assert colour_depth(tmp_path / "a.csv") is None
    assert next(read_chunks(tmp_path / "a.csv", None, colours=True)).colour is None


@pytest.mark.parametrize(("kind", "scale", "maximum"), [("ushort", 257, 65535), ("float", 1, 255), ("float", 1 / 255, 0)])
def test_only_whole_numbers_of_16_bits_are_colours(tmp_path: Path, kind: str, scale: float, maximum: int) -> None:
    """Fractions from 0 to 1 are no colours of a known depth: no image, and a note."""
    values = COLOURS * scale
    ply(tmp_path / "a.ply", "binary_little_endian", kind, values.astype(int) if kind == "ushort" else values)
    depth = colour_depth(tmp_path / "a.ply")
    assert depth == ColourDepth(maximum)
    note = depth.note(tmp_path / "a.ply") or ""
    assert ("no image in colour" in note) == (maximum == 0)
    assert bool(note) == (maximum < 65535)


@pytest.mark.parametrize("seed", range(3))
def test_a_few_bright_points_of_a_large_file_decide(tmp_path: Path, seed: int) -> None:
    """In a sample of the whole file, not of its beginning: 16 bits, though nearly all colours are below 256."""
    rng = np.random.default_rng(seed)
    values = rng.integers(0, 200, (WHOLE + 200_000, 3)).astype(np.uint16)
    values[:, 0][rng.random(len(values)) < 10.0 / RUN_POINTS] = 40_000
    values[:50_000] = 9
    las(tmp_path / "a.laz", values, 7)
    assert colour_depth(tmp_path / "a.laz") == ColourDepth(65535)


def test_inspect_states_the_bits(tmp_path: Path) -> None:
    las(tmp_path / "a.laz", COLOURS, 7)
    (tmp_path / "b.csv").write_text("x y z\n" + "".join(f"{x} {y} {z}\n" for x, y, z in XYZ.tolist()))
    for name, stated in (("a.laz", "8 bits, by a sample"), ("b.csv", None)):
        (look,) = json.loads(command("inspect", tmp_path / name, "--json").stdout)["files"]
        assert look["colours"] == stated
