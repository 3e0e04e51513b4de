"""Axes from DXF drawings: curves, blocks, units and damage."""

from __future__ import annotations

import os
import resource
import signal
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pyogrio
import pytest
import shapely
from support.axis_files import LINE, chain, dxf, plan_length

from tunneldb.alignment.given import read_given
from tunneldb.errors import UserError


def test_arcs_and_bulges_keep_their_circle(tmp_path: Path) -> None:
    """Straight, quarter of a circle of R 60 as a bulge of tan(90°/4), straight: in one polyline, and as LINE and ARC."""
    bulge = np.tan(np.radians(90.0 / 4))
    ends = [(0.0, 0.0, 0.0), (100.0, 0.0, bulge), (160.0, 60.0, 0.0), (160.0, 160.0, 0.0)]
    one = dxf(
        tmp_path / "one.dxf",
        lambda space: space.add_lwpolyline([(x, y, b) for x, y, b in ends], format="xyb", dxfattribs={"elevation": 12.0}),
    )

    def apart(space: object) -> None:
        space.add_line((0, 0, 12), (100, 0, 12))  # type: ignore[attr-defined]
        space.add_arc((100, 60, 12), 60, 270, 360)  # type: ignore[attr-defined]
        space.add_line((160, 160, 12), (160, 60, 12))  # type: ignore[attr-defined]

    for path in (one, dxf(tmp_path / "apart.dxf", apart)):
        xyz = read_given(path).xyz
        xyz = xyz if xyz[0, 0] < 1 else xyz[::-1]
        length = np.hypot(*np.diff(xyz[:, :2], axis=0).T)
        assert length.sum() == pytest.approx(200.0 + 60.0 * np.pi / 2, abs=0.01)
        assert length.max() < 2.0
        on = xyz[(xyz[:, 0] > 100.1) & (xyz[:, 1] < 59.9)]
        np.testing.assert_allclose(np.hypot(on[:, 0] - 100.0, on[:, 1] - 60.0), 60.0, atol=0.001)
        assert set(xyz[:, 2].round(6)) == {12.0}


def test_a_spline_is_followed(tmp_path: Path) -> None:
    path = dxf(tmp_path / "a.dxf", lambda space: space.add_spline([tuple(p) for p in LINE - LINE[0]]))
    line = shapely.LineString(read_given(path).xyz)
    assert max(line.distance(shapely.Point(p)) for p in LINE - LINE[0]) < 0.001


def test_the_frame_of_a_spline_is_no_part_of_the_line(tmp_path: Path) -> None:
    """PEDIT, Spline: a polyline with the vertices of its frame (flag 16), and those of the curve (flag 8)."""
    frame = LINE + np.array([0.0, 5.0, 0.0])

    def draw(space: object) -> None:
        drawn = space.add_polyline3d([*frame, *LINE], dxfattribs={"flags": 8 + 4})  # type: ignore[attr-defined]
        for k, vertex in enumerate(drawn.vertices):
            vertex.dxf.flags = 32 + (16 if k < len(frame) else 8)

    np.testing.assert_allclose(read_given(dxf(tmp_path / "a.dxf", draw)).xyz, LINE, atol=1e-6)


def test_an_ellipse_is_part_of_the_line(tmp_path: Path) -> None:
    def draw(space: object) -> None:
        space.add_line((0, 0), (0, 50))  # type: ignore[attr-defined]
        space.add_ellipse((-100, 50), (100, 0), 1.0, 0.0, 0.5)  # type: ignore[attr-defined]

    assert plan_length(read_given(dxf(tmp_path / "a.dxf", draw))) == pytest.approx(50.0 + 100.0 * 0.5, abs=0.01)


@pytest.mark.parametrize("nested", [False, True])
def test_lines_in_blocks_are_read_where_there_are_no_others(tmp_path: Path, nested: bool) -> None:
    """In a block drawn in millimetres, on layer 0, which is the layer of its reference."""

    def draw(space: object) -> None:
        document = space.doc  # type: ignore[attr-defined]
        document.blocks.new("AXIS").add_polyline3d(1000.0 * (LINE - LINE[0]))
        document.blocks.new("OUTER").add_blockref("AXIS", (0, 0, 0))
        scale = dict.fromkeys(("xscale", "yscale", "zscale"), 0.001)
        space.add_blockref("OUTER" if nested else "AXIS", LINE[0], dxfattribs={"layer": "TUBE", **scale})  # type: ignore[attr-defined]

    path = dxf(tmp_path / "a.dxf", draw)
    given = read_given(path, layer="TUBE")
    np.testing.assert_allclose(given.xyz, LINE, atol=1e-6)
    assert given.notes == ("is in blocks",)

    def beside(space: object) -> None:
        draw(space)
        space.add_polyline3d(LINE + 1.0, dxfattribs={"layer": "TUBE"})  # type: ignore[attr-defined]

    both = read_given(dxf(tmp_path / "b.dxf", beside))
    np.testing.assert_allclose(both.xyz, LINE + 1.0, atol=1e-6)
    assert both.notes == (("has blocks with lines on layer 'TUBE'; left out",) if not nested else ())


def test_blocks_that_multiply_are_refused(tmp_path: Path) -> None:
    def draw(space: object) -> None:
        blocks = space.doc.blocks  # type: ignore[attr-defined]
        blocks.new("B0").add_line((0, 0), (1, 0))
        for k in range(1, 8):
            outer = blocks.new(f"B{k}")
            for _ in range(10):
                outer.add_blockref(f"B{k - 1}", (0, 0))
        space.add_blockref("B7", (0, 0))  # type: ignore[attr-defined]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("tunneldb.alignment.dxf._MAX_IN_BLOCKS", 100)
        with pytest.raises(UserError, match="its blocks hold more than 100 entities; write the axis alone to a file"):
            read_given(dxf(tmp_path / "a.dxf", draw))


def test_a_damaged_drawing_is_repaired_and_said(tmp_path: Path) -> None:
    """Truncated behind its lines, which only `ezdxf.recover` reads."""
    path = dxf(tmp_path / "a.dxf", chain)
    whole = path.read_text()
    path.write_text(whole[: whole.index("ENDSEC", whole.index("ENTITIES")) + 7])
    given = read_given(path)
    np.testing.assert_allclose(given.xyz, LINE, atol=1e-6)
    assert "is damaged" in given.notes[0]
    assert "check that the axis is complete" in given.notes[0]


@pytest.mark.parametrize(
    ("code", "option", "metres"), [(4, "millimeter", 0.001), (2, "foot", 0.3048), (21, "USSurveyFoot", 1200 / 3937)]
)
def test_the_unit_of_a_drawing_is_named_with_the_option_to_pass(code: int, option: str, metres: float, tmp_path: Path) -> None:
    path = dxf(tmp_path / "a.dxf", lambda space: space.add_polyline3d((LINE - LINE[0]) / metres), code)
    with pytest.raises(UserError, match=rf"INSUNITS {code}.* pass --axis-unit {option}; .* in metres, pass --axis-unit meter"):
        read_given(path)
    np.testing.assert_allclose(read_given(path, unit=option).xyz[1:, :2], (LINE - LINE[0])[1:, :2], atol=1e-6)
    path = dxf(tmp_path / "b.dxf", chain, code)
    np.testing.assert_allclose(read_given(path, unit="meter").xyz, LINE, atol=1e-6)


def test_a_drawing_of_an_unknown_unit_is_read_in_the_given_one(tmp_path: Path) -> None:
    path = dxf(tmp_path / "a.dxf", chain, 99)
    with pytest.raises(UserError, match=r"unit is number 99 \(\$INSUNITS 99\).* pass --axis-unit meter"):
        read_given(path)
    np.testing.assert_allclose(read_given(path, unit="meter").xyz, LINE, atol=1e-6)


@pytest.mark.parametrize(
    "draw",
    [
        lambda space: space.add_arc((0, 0), 1e12, 0, 180),
        lambda space: space.add_arc((0, 0), 1e300, 0, 180),
        lambda space: space.add_ellipse((0, 0), (1e12, 0), 0.5, 0, 3.0),
        lambda space: space.add_open_spline([(0, 0), (1e11, 1e11), (2e11, -1e11), (3e11, 0)]),
        lambda space: space.add_spline([(0, 0), (1e12, 1e12), (2e12, -1e12), (3e12, 0)]),
        lambda space: space.add_lwpolyline([(0, 0, 0.5), (1e12, 0, 0.5), (2e12, 0, 0)], format="xyb"),
    ],
    ids=["arc", "arc beyond numbers", "ellipse", "spline", "fitted spline", "bulge"],
)
def test_curves_without_end_are_refused_before_they_are_divided(tmp_path: Path, draw: Callable[[Any], object]) -> None:
    with bounded(), pytest.raises(UserError, match=r"is longer than 1000 km, as no tunnel is"):
        read_given(dxf(tmp_path / "a.dxf", draw))


def test_curves_of_many_vertices_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tunneldb.alignment.dxf._MAX_CURVE_VERTICES", 1000)
    zigzag = [(float(k), float(k % 2)) for k in range(1000)]
    with pytest.raises(UserError, match="its curves need more than 1000 vertices"):
        read_given(dxf(tmp_path / "a.dxf", lambda space: space.add_open_spline(zigzag)))


def test_a_drawing_of_many_lines_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A layer of another subject; the axis alone on a layer is read."""
    monkeypatch.setattr("tunneldb.alignment.dxf._MAX_ENTITIES", 50)

    def draw(space: Any) -> None:
        for k in range(51):
            space.add_line((0, k), (1, k), dxfattribs={"layer": "SITE"})
        space.add_polyline3d(LINE)

    path = dxf(tmp_path / "a.dxf", draw)
    with pytest.raises(UserError, match="layer 'SITE' has 51 lines and arcs, an axis has at most 50"):
        read_given(path, layer="SITE")
    np.testing.assert_allclose(read_given(path, layer="0").xyz, LINE, atol=1e-6)


def test_a_file_larger_than_can_be_read_is_refused(tmp_path: Path) -> None:
    """Nearly all of it is a hole, which takes no space on the disk."""
    for name, text in (("a.dxf", "0\nSECTION\n"), ("a.ifc", "ISO-10303-21;"), ("a.geojson", '{"type": "FeatureCollection"')):
        path = tmp_path / name
        path.write_text(text)
        os.truncate(path, 1 << 40)
        with bounded(), pytest.raises(UserError, match=rf"{name} has 1099512 MB; a .* has at most \d+ MB"):
            read_given(path)


@contextmanager
def bounded() -> Iterator[None]:
    """Raise an error if the process takes 10 s of time of the processor, or 2 GiB more memory."""

    def late(number: int, frame: object) -> None:
        raise AssertionError("10 s")

    before, limit = signal.signal(signal.SIGVTALRM, late), resource.getrlimit(resource.RLIMIT_AS)
    with Path("/proc/self/statm").open() as file:
        used = int(file.read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + (2 << 30), limit[1]))
    signal.setitimer(signal.ITIMER_VIRTUAL, 10.0)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)
        resource.setrlimit(resource.RLIMIT_AS, limit)


@pytest.mark.parametrize("name", ["gpkg_contents", "axis"])
def test_a_view_without_end_is_refused_and_a_table_is_read(tmp_path: Path, name: str) -> None:
    """A recursive view, as a layer or in place of the catalogue; without it the same file is read, as the message says."""
    path = tmp_path / "axis.gpkg"
    line = shapely.to_wkb(np.array([shapely.LineString([(0, 0, 0), (50, 0, 0), (100, 0, 0)])]))
    pyogrio.raw.write(path, line, [], [], layer="line", geometry_type="LineString Z", crs="EPSG:25830", driver="GPKG")
    endless = "WITH RECURSIVE r (a) AS (SELECT 1 UNION ALL SELECT a + 1 FROM r) SELECT a FROM r"
    with closing(sqlite3.connect(path)) as file, file:
        if name == "gpkg_contents":
            file.execute("ALTER TABLE gpkg_contents RENAME TO kept")
        file.execute(f"CREATE VIEW {name} AS {endless}")
    with bounded(), pytest.raises(UserError, match=f"'{name}' is a view, .* export its layer as a table"):
        read_given(path)
    with closing(sqlite3.connect(path)) as file, file:
        file.execute(f"DROP VIEW {name}")
        if name == "gpkg_contents":
            file.execute("ALTER TABLE kept RENAME TO gpkg_contents")
    assert plan_length(read_given(path)) == pytest.approx(100.0)
