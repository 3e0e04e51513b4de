"""Structures in QGIS: of a site a project of their own, of a tunnel a group; the form, the atlas of members, 3D."""

from __future__ import annotations

import shutil
import warnings
from pathlib import Path

import numpy as np
import psycopg
import rasterio
from rasterio.errors import NotGeoreferencedWarning
from support.command import output_of
from support.example_structures import add_example_site, save_example_structures
from support.pdf import words
from support.qgis import act
from support.system import missing

LAYERS = {
    "spot_map": ("Polygon", 3), "member": ("LineStringZ", 2), "spot_3d": ("PolygonZ", 3), "face": ("MultiPolygonZ", 4),
    "face_3d": ("MultiPolygonZ", 4), "spot_sheet": ("Polygon", 3), "member_sheet": ("Polygon", 2),
    "face_sheet": ("MultiPolygon", 4), "member_statistics": ("NoGeometry", 2),
}  # fmt: skip


def test_a_site(conn: psycopg.Connection, tmp_path: Path) -> None:
    project = tmp_path / "hall.qgz"
    add_example_site(tmp_path)
    assert "tunneldb members hall-1" in output_of("qgis", "hall-1", "-o", project, code=2)
    assert not project.exists()
    save_example_structures(conn, "hall-1")
    assert "more than half of member 2 differs" in output_of("qgis", "hall-1", "-o", project)
    seen = act(project, "describe")
    assert {name: (layer["wkb"], layer["features"]) for name, layer in seen["layers"].items()} == LAYERS | {
        "remark": ("NoGeometry", 0), "scan_station": ("PointZ", 1),
    }  # fmt: skip
    assert all(layer["valid"] and not layer["error"] for layer in seen["layers"].values())
    assert {name: set(layers) for name, layers in seen["themes"].items()} == {
        "Map": {"scan_station", "spot_map", "member", "face"}, "3D": {"scan_station", "spot_3d", "face_3d"},
        "Faces": {"spot_sheet", "member_sheet", "face_sheet"},
    }  # fmt: skip
    for name in ("spot_map", "spot_3d", "spot_sheet"):
        layer = seen["layers"][name]
        assert (layer["read_only"], layer["editable"]) == (False, ["review", "remark"])
        assert layer["widget"]["review"] == "ValueMap"
    assert all(layer["read_only"] for name, layer in seen["layers"].items() if not name.startswith("spot"))

    # Reviewed through the form's layers.
    (key,) = conn.execute("SELECT id FROM tunnel_api.spot WHERE number = 1").fetchone()  # type: ignore[misc]
    conn.rollback()
    assert act(project, "review", str(key), "rejected", "shadow", "spot_sheet")["saved"]
    assert conn.execute("SELECT review, remark FROM tunnel_api.spot WHERE number = 1").fetchone() == ("rejected", "shadow")
    conn.rollback()

    # A page for each member, with its own spots.
    pdf = tmp_path / "members.pdf"
    assert act(project, "atlas", str(pdf), "Members") == {"saved": True, "error": "", "sheets": 2}
    wall, pipe = words(pdf)
    assert "Member 1, flat" in wall
    assert "2 faces, 6.00 m2, 96.7 % inspected; 1 spot, dark 0.0000 m2, bright 0.1255 m2" in wall
    assert "shadow" in wall
    assert "rejected 1" not in pipe
    assert "2 dark" not in wall
    assert "2 bright" in wall
    assert "Member 2, pipe" in pipe
    assert "More than half of it differs" in pipe
    assert "More than half" not in wall
    assert "dark 0.0400 m2" in pipe
    assert "shadow" not in pipe

    # In space, spots before their faces.
    screen = shutil.which("xvfb-run")
    if screen is None:
        missing("xvfb-run, for OpenGL without a screen")
    picture = tmp_path / "space.png"
    software = {"QT_QPA_PLATFORM": "xcb", "LIBGL_ALWAYS_SOFTWARE": "1"}
    drawn = act(
        project, "space", str(picture), before=(screen, "-a", "-s", "-screen 0 1280x1024x24 +extension GLX"), **software
    )
    assert set(drawn["layers"]) == {"scan_station", "spot_3d", "face_3d"}
    if drawn["drawn"] is not True:
        missing(drawn["drawn"])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        image = rasterio.open(picture)
    with image:
        red, green, blue = image.read([1, 2, 3]).astype(int)
    inked = (red < 250) | (green < 250) | (blue < 250)
    yellow = (red > 120) & (green > 0.6 * red) & (blue < 0.4 * red)
    # The bright spot is a disc of 0.2 m: 0.126 m² of some 7 m² that are drawn.
    assert 0.005 < yellow.sum() / inked.sum() < 0.04
    rows, columns = np.nonzero(yellow)
    assert yellow.sum() > 0.6 * np.pi / 4 * np.ptp(rows) * np.ptp(columns), "whole, not in shreds"


def test_a_survey_of_a_tunnel(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    conn.execute("DELETE FROM tunnel.image")
    conn.commit()
    output_of("qgis", "demo-2024", "-o", tmp_path / "without.qgs")
    assert "spot" not in (tmp_path / "without.qgs").read_text()
    save_example_structures(conn, "demo-2024")
    output_of("qgis", "demo-2024", "-o", tmp_path / "with.qgz")
    seen = act(tmp_path / "with.qgz", "describe")
    assert {name: layer["features"] for name, layer in seen["layers"].items() if name in LAYERS} == {
        name: count for name, (_, count) in LAYERS.items()
    }
    assert {"axis", "leak_map", "spot_map"} <= set(seen["themes"]["Map"])
    assert {"leak_3d", "spot_3d", "face_3d"} <= set(seen["themes"]["3D"])
    assert seen["canvas_theme"] == "Unrolled"
