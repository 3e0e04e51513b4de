"""Design profiles from files: lines and arcs as they are, and what is wrong of them in one line."""

from __future__ import annotations

from pathlib import Path

import ezdxf
import numpy as np
import pytest
from support.real_scans import real_scan

from tunneldb.errors import UserError
from tunneldb.pipeline.profile_file import read_profile

SHOE = [(-5, -2, 0), (-5, 0, 5), (0, 5, 5), (5, 0, 0), (5, -2, 0)]


def written(folder: Path, rows: list[tuple[float, ...]], header: str = "right,up,radius") -> Path:
    path = folder / "shoe.csv"
    path.write_text("\n".join([header, *(",".join(map(str, row)) for row in rows)]) + "\n")
    return path


def drawn(folder: Path, unit: int = 4) -> Path:
    """The same horseshoe in millimetres, in pieces of all kinds, with the axis at 1000, 2000."""
    document = ezdxf.new()
    document.units = unit
    space = document.modelspace()
    space.add_line((6000, 0), (6000, 2000))
    space.add_arc((1000, 2000), 5000, 0, 90)
    space.add_lwpolyline([(-4000, 0, 0), (-4000, 2000, -np.tan(np.radians(90) / 4)), (1000, 7000, 0)], format="xyb")
    path = folder / "shoe.dxf"
    document.saveas(path)
    return path


def test_a_horseshoe_is_the_same_of_a_table_and_of_a_drawing(tmp_path: Path) -> None:
    outline = read_profile(written(tmp_path, SHOE)).outline
    assert outline.area == pytest.approx(20.0 + 12.5 * np.pi)
    assert outline.length == pytest.approx(4.0 + 5.0 * np.pi)
    np.testing.assert_allclose(read_profile(drawn(tmp_path), (1000.0, 2000.0)).outline.elements, outline.elements, atol=1e-9)
    backwards = [(*row[:2], before[2]) for row, before in zip(SHOE[::-1], [*SHOE[:-1][::-1], SHOE[-1]], strict=True)]
    np.testing.assert_allclose(read_profile(written(tmp_path, backwards)).outline.elements, outline.elements, atol=1e-9)
    ring = read_profile(written(tmp_path, [(0, -3, 3), (0, 3, 3), (0, -3, 0)])).outline
    assert (ring.closed, ring.area) == (True, pytest.approx(9.0 * np.pi))


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ([(-5000, -2000, 0), (0, 5000, 0), (5000, -2000, 0)], "10000 m wide and 7000 m high; tunnels have 1 to 60 m: is it in"),
        ([(-5, 0, 2), (5, 0, 0)], "line 2: radius 2 is too small for an arc to the next vertex, 10.0000 m away"),
        ([(-5, 0, 0), (-5, 0, 0), (5, 0, 0)], "line 3: the vertex -5,0 repeats that of the line before"),
        (
            [(0, 0, 0), (4, 4, 0), (4, 0, 0), (0, 4, 0), (0, 0, 0)],
            "line 2: what begins at 0,0 crosses what begins at 4,0 (line 4)",
        ),
        ([(20, 0, 0), (25, 5, 0), (30, 0, 0)], "away from the axis at 0,0; say where the file has the axis by --origin"),
        ([(-5, 0, 0), (0, "x", 0), (5, 0, 0)], "line 3: up is 'x', not a number"),
    ],
)
def test_what_is_wrong_of_a_table_is_said_in_a_line(tmp_path: Path, rows: list[tuple[float, ...]], said: str) -> None:
    with pytest.raises(UserError, match=r"shoe\.csv") as told:
        read_profile(written(tmp_path, rows))
    assert said in str(told.value)
    assert "\n" not in str(told.value)


def test_units_of_drawings_are_never_guessed_and_gaps_are_told(tmp_path: Path) -> None:
    path = drawn(tmp_path, unit=0)
    with pytest.raises(UserError, match=r"it states no unit \(\$INSUNITS 0\); say what its lengths are by --unit"):
        read_profile(path)
    assert read_profile(path, (1000.0, 2000.0), "mm").outline.length == pytest.approx(4.0 + 5.0 * np.pi)
    with pytest.raises(UserError, match="it states mm"):
        read_profile(drawn(tmp_path), unit="m")
    document = ezdxf.readfile(path)
    document.modelspace().query("ARC").first.dxf.end_angle = 89.0
    document.saveas(path)
    with pytest.raises(
        UserError, match=r"a gap of 87\.3 mm between its end at 1\.0873,6\.9992 m and the nearest other, of LWPOLY"
    ):
        read_profile(path, (1000.0, 2000.0), "mm")


def test_points_of_a_real_profile_become_an_outline() -> None:
    path = real_scan("maoliling-design-profile.txt")
    with pytest.raises(UserError, match="points state no unit"):
        read_profile(path, (10.34, 2.0))
    read = read_profile(path, (10.34, 2.0), "m")
    points = np.array([line.split() for line in path.read_bytes().decode("latin-1").splitlines() if line[:1].isdigit()], float)
    assert read.outline.closed
    width, height = np.ptp(read.outline.flattened(), axis=0)
    assert (width, height) == (pytest.approx(np.ptp(points[:, 0]), abs=0.02), pytest.approx(np.ptp(points[:, 1]), abs=0.02))
    assert "no deviation is better than that" in read.notes[0]
