"""Width, height and area of cross-sections and of design profiles, compared with shapely on the same points."""

from __future__ import annotations

import csv
import itertools
import json
import math
from pathlib import Path

import numpy as np
import openpyxl
import psycopg
import pytest
import shapely
from click.testing import CliRunner

from tunneldb.cli.main import main


def arc_points(x: float, y: float, next_x: float, next_y: float, bulge: float) -> np.ndarray:
    """Points of an edge with a bulge, by its centre and angle: 2000 on an arc."""
    if bulge == 0.0:
        return np.array([[x, y]])
    angle = 4.0 * math.atan(bulge)
    start, chord = complex(x, y), complex(next_x - x, next_y - y)
    centre = start + chord / 2 + chord / 2 * 1j / math.tan(angle / 2)
    turned = centre + (start - centre) * np.exp(1j * np.linspace(0.0, angle, 2000, endpoint=False))
    return np.column_stack([turned.real, turned.imag])


@pytest.mark.parametrize(
    "outline",
    [
        [-3, -2, 0, -3, 2, 0, 3, 2, 0, 3, -2, 0, -3, -2, 0],
        [-4, 0, -1, 4, 0, -0.2, -4, 0, 0],  # a half circle above a flat invert
        [-4, 0, -1, 4, 0, 0.2, -4, 0, 0],  # its invert bent inwards
        [-4, 0, -0.6, 0, 3, -0.4, 4, 0, 0, -4, 0, 0],
    ],
)
def test_area_of_an_outline_with_arcs(conn: psycopg.Connection, outline: list[float]) -> None:
    vertices = np.array(outline, float).reshape(-1, 3)
    edges = itertools.pairwise(vertices)
    points = np.concatenate([arc_points(*a[:2], *b[:2], a[2]) for a, b in edges])
    ((area,),) = conn.execute("SELECT tunnel_internal.outline_area(%s::float8[])", [vertices.ravel().tolist()]).fetchall()
    assert area == pytest.approx(shapely.Polygon(points).area, rel=1e-5)
    ((none,),) = conn.execute("SELECT tunnel_internal.outline_area(%s::float8[])", [vertices[:-1].ravel().tolist()]).fetchall()
    assert none is None, "an open profile has no area"


def test_sections_have_the_size_of_their_polygon(example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    angle = np.radians(np.arange(-180.0, 180.0))
    rng = np.random.default_rng(0)
    radii = {}
    for key, chainage in conn.execute("SELECT id, chainage FROM tunnel.section ORDER BY chainage").fetchall():
        radius = rng.uniform(2.0, 5.0, 360)
        radii[chainage] = radius
        conn.execute("UPDATE tunnel.section SET radius = %s WHERE id = %s", [[*radius, radius[0]], key])
    conn.execute("DELETE FROM tunnel.design_profile")
    outline = [-4.0, 0.0, -1.0, 4.0, 0.0, -1.0, -4.0, 0.0, 0.0]
    conn.execute(
        "INSERT INTO tunnel.design_profile (tunnel_id, name, layer, chainage_from, chainage_to, outline, source)"
        " SELECT id, 'ring', 'lining', -1e6, %s, %s, 'test' FROM tunnel.tunnel", [min(radii) + 30.0, outline]
    )  # fmt: skip
    conn.commit()
    found = CliRunner().invoke(main, ["sections", example, "--every", "20", "--json", "-o", str(tmp_path / "s.csv")])
    assert found.exit_code == 0, found.output
    rows = json.loads(found.stdout)["sections"]
    stored = np.array(sorted(radii))
    for row in rows:
        chainage = stored[np.argmin(np.abs(stored - row["chainage"]))]
        far = radii[chainage]
        polygon = shapely.Polygon(np.column_stack([far * np.sin(angle), far * np.cos(angle)]))
        west, south, east, north = polygon.bounds
        assert (row["width"], row["height"]) == (pytest.approx(east - west, abs=1e-4), pytest.approx(north - south, abs=1e-4))
        assert row["area"] == pytest.approx(polygon.area, abs=1e-4)
        if row["chainage"] <= min(radii) + 30.0:
            assert row["design_area"] == pytest.approx(16.0 * math.pi, abs=1e-4)
            assert row["area_difference"] == pytest.approx(polygon.area - 16.0 * math.pi, abs=2e-4)
        else:
            assert (row["profile"], row["design_area"], row["area_difference"]) == (None, None, None)
    steps = np.unique(np.round(stored / 20.0))
    assert [round(row["chainage"] / 20.0) for row in rows] == steps.tolist()
    best = [np.abs(stored[np.round(stored / 20.0) == n] - 20.0 * n).min() for n in steps]
    assert [abs(row["chainage"] - 20.0 * n) for row, n in zip(rows, steps, strict=True)] == pytest.approx(best, abs=1e-4)
    with (tmp_path / "s.csv").open(newline="", encoding="utf-8") as file:
        table = list(csv.DictReader(file))
    assert [float(row["area"]) for row in table] == [row["area"] for row in rows]
    assert CliRunner().invoke(main, ["sections", example, "--every", "20", "-o", str(tmp_path / "s.xlsx")]).exit_code == 0
    sheet = openpyxl.load_workbook(tmp_path / "s.xlsx")["Cross-sections"]
    assert [row[4] for row in sheet.iter_rows(min_row=2, values_only=True)] == [row["area"] for row in rows]
    report = CliRunner().invoke(main, ["report", example, "-o", str(tmp_path / "r.html")])
    assert report.exit_code == 0, report.output
    chapter = (tmp_path / "r.html").read_text("utf-8").partition('<section id="sections">')[2].partition("</section>")[0]
    assert f'<td>{rows[0]["label"]}</td><td class="n">{rows[0]["width"]:.2f}</td>' in chapter


def test_a_face_that_fills_the_classes_outwards_is_no_roof(conn: psycopg.Connection) -> None:
    """Points of a plane across the tunnel from 3 to 7 m scatter by 4 m / √12 in each class; those of a lining by noise."""
    for sigma, roofed in ((0.01, True), (4.0 / math.sqrt(12.0), False)):
        classes = [0.01] * 72
        classes[27:45] = [sigma] * 18
        assert conn.execute("SELECT tunnel_internal.section_roofed(5, %s::float8[])", [classes]).fetchone() == (roofed,)
    classes = [None if n % 3 else 0.01 for n in range(72)]
    assert conn.execute("SELECT tunnel_internal.section_roofed(5, %s::float8[])", [classes]).fetchone() == (True,)
