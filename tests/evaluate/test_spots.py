"""Spots of structures against a truth: laid on faces, and the command on structures made by hand."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import psycopg
import pyogrio.raw
import pytest
import shapely
from shapely.geometry import MultiPolygon, Polygon, box
from support.command import command
from support.example_structures import ALONG, NORMAL, ORIGIN, RADIUS, add_example_site, model, save_example_structures

from tunneldb.evaluate.surfaces import FoundFace, on_one_plane, project_on_face, project_on_faces

UP = np.array([0.0, 0.0, 1.0])


def on_wall(u: np.ndarray, z: np.ndarray, off: float = 0.0) -> Polygon:
    """Polygon on the example's wall, by its places along and up, m."""
    return Polygon(np.outer(u, ALONG) + np.outer(z, UP) + off * NORMAL + ORIGIN)


def disc(u: float, z: float, radius: float, off: float = 0.0) -> Polygon:
    turn = np.linspace(0.0, 2.0 * np.pi, 256, endpoint=False)
    return on_wall(u + radius * np.cos(turn), z + radius * np.sin(turn), off)


def rectangle(u0: float, z0: float, u1: float, z1: float) -> Polygon:
    return on_wall(np.array([u0, u1, u1, u0]), np.array([z0, z0, z1, z1]))


def lens(radius: float, apart: float) -> float:
    """Area that two equal circles have in common (a closed formula)."""
    return 2 * radius**2 * math.acos(apart / (2 * radius)) - 0.5 * apart * math.sqrt(4 * radius**2 - apart**2)


def gpkg(path: Path, shapes: list[Polygon], crs: str = "EPSG:25829") -> Path:
    kind = "Polygon Z" if shapes[0].has_z else "Polygon"
    pyogrio.raw.write(
        str(path), shapely.to_wkb(np.array(shapes, dtype=object)), [np.arange(len(shapes)) + 101], np.array(["id"]),
        geometry_type=kind, crs=crs, driver="GPKG", layer="spot",
    )  # fmt: skip
    return path


def test_a_polygon_goes_to_the_nearest_face_and_over_a_gap() -> None:
    faces = [
        FoundFace(1, 1, model(np.zeros(3), UP, np.zeros(3)), box(0, 0, 1, 1)),
        FoundFace(2, 1, model(np.array([2.0, 0, 0]), UP, np.array([2.0, 0, 0])), box(0, 0, 1, 1)),
        FoundFace(3, 2, model(np.array([0, 0, -0.012]), -UP, np.zeros(3)), box(-9, -9, 9, 9)),  # the back of the sheet
    ]
    over = project_on_faces(Polygon([(0.5, 0.2, 0.001), (2.75, 0.2, 0.001), (2.75, 0.6, 0.001), (0.5, 0.6, 0.001)]), faces)
    assert {k: round(part.area, 9) for k, part in over.parts} == {0: 0.2, 1: pytest.approx(0.3 + 0.4, abs=1e-9)}
    assert over.on_faces == pytest.approx(0.5)
    assert on_one_plane([over.parts])[0].area == pytest.approx(0.9)
    nowhere = project_on_faces(Polygon([(0, 0, 5), (0, 1, 5), (0, 1, 6), (0, 0, 6)]), faces)
    assert [(k, part.area) for k, part in nowhere.parts] == [(None, pytest.approx(1.0))]
    assert nowhere.on_faces == 0.0


def test_a_ring_over_the_cut_of_a_pipe_is_parted_there() -> None:
    pipe = FoundFace(1, 1, model(np.zeros(3), UP, np.array([1.0, 0, 0]), 0.5), box(0, -math.pi / 2, 2, math.pi / 2))
    turn = np.linspace(math.pi - 0.4, math.pi + 0.2, 200)
    bent = np.column_stack([0.5 * np.cos(turn), 0.5 * np.sin(turn), np.full(200, 0.5)])
    flat = project_on_face(Polygon(np.vstack([bent, bent[::-1] + UP])), pipe)
    assert flat.area == pytest.approx(0.6 * 0.5)
    assert sorted(round(part.area, 6) for part in shapely.get_parts(flat)) == [0.1, 0.2]
    assert shapely.covered_by(flat, shapely.box(-1, -math.pi / 2 - 1e-9, 3, math.pi / 2 + 1e-9))


def test_figures_follow_from_geometry(conn: psycopg.Connection, tmp_path: Path) -> None:
    add_example_site(tmp_path)
    near = disc(1.5 + 0.2, 1.0, 0.3, 0.004)  # a found one of 0.3 m moved by 0.2 m, and 4 mm before the wall
    missed = rectangle(1.6, 0.1, 2.8, 0.3)  # over the gap between the two parts of the wall
    turn = np.linspace(-0.5, 0.5, 100)
    bent = np.array([5.0, 1.0, 0.0]) + np.column_stack([RADIUS * np.sin(turn), -RADIUS * np.cos(turn), np.full(100, 0.2)])
    pipe = Polygon(np.vstack([bent, bent[::-1] + 0.2 * UP]) + ORIGIN)  # just the spot on the pipe
    tiny = rectangle(0.1, 0.1, 0.15, 0.15)
    truth = gpkg(tmp_path / "truth.gpkg", [near, missed, pipe, tiny])
    assert "tunneldb members hall-1" in command("evaluate", "hall-1", truth, code=2).stderr
    save_example_structures(conn, "hall-1")
    told = json.loads(command("evaluate", "hall-1", truth, "--json", "-o", tmp_path / "out.json").stdout)
    every = told["groups"][0]
    # Spot 2, 0.2 m wide, at u = 2.9, z = 1.5, is on no true one.
    assert (every["true"], every["touched"], every["found"]) == (3, 2, 2 if lens(0.3, 0.2) > 0.5 * math.pi * 0.09 else 1)
    assert (every["called"], every["false"]) == (3, 1)
    shared, pipe_area, circle = lens(0.3, 0.2), 0.04, math.pi * 0.09
    assert every["area_recall"] == pytest.approx((shared + pipe_area) / (circle + 0.24 + pipe_area), rel=0.01)
    assert every["area_precision"] == pytest.approx((shared + pipe_area) / (circle + math.pi * 0.04 + pipe_area), rel=0.01)
    by_id = {row["id"]: row for row in told["true"]}
    assert by_id["101"]["iou"] == pytest.approx(shared / (2 * circle - shared), rel=0.02)
    assert (by_id["101"]["member"], by_id["101"]["face"]) == (1, 1)
    assert (by_id["103"]["member"], by_id["103"]["face"]) == (2, 3)
    assert by_id["103"]["iou"] == pytest.approx(1.0, abs=0.01)
    assert by_id["102"]["area"] == pytest.approx(1.2 * 0.2)
    # Of the long one 0.4 m lie between the parts.
    assert told["all_true_m2"] - told["true_on_faces_m2"] == pytest.approx(0.4 * 0.2, abs=1e-3)
    false = next(row for row in told["found"] if not row["touched"])
    np.testing.assert_allclose([false["x"], false["y"], false["z"]], 2.9 * ALONG + 1.5 * UP + ORIGIN, atol=0.2)
    assert told["statement"]
    assert json.loads((tmp_path / "out.json").read_text())["groups"] == told["groups"]
    # What was seen of the faces, whose seen shares are 1, 0.9, 0.8 and 0.
    assert told["seen_m2"] == pytest.approx(4.0 + 0.9 * 2.0 + 0.8 * 0.6)

    conn.execute("UPDATE tunnel_api.spot SET review = 'rejected' WHERE number = 2")
    conn.commit()
    assert json.loads(command("evaluate", "hall-1", truth, "--json").stdout)["groups"][0]["false"] == 0
    assert "1 false" not in command("evaluate", "hall-1", truth).stdout


def test_the_simulator_s_truth(conn: psycopg.Connection, tmp_path: Path) -> None:
    add_example_site(tmp_path)
    save_example_structures(conn, "hall-1")

    def row(number: int, shape: Polygon, points: int, slant: float) -> dict:
        ring = shapely.get_coordinates(shape, include_z=True).tolist()
        return {"id": number, "points": points, "incidence": [slant, slant, slant] if points else None, "outline_3d": ring}

    rows = [
        row(1, disc(1.5, 1.0, 0.3), 500, 20.0),
        row(2, disc(2.9, 1.5, 0.2), 99, 20.0),
        row(3, disc(0.5, 0.5, 0.2), 500, 75.5),
        row(4, disc(0.5, 1.5, 0.2), 0, 0.0),
    ]
    path = tmp_path / "hall.truth.json"
    path.write_text(json.dumps({"parameters": {"srid": 25829}, "anomalies": rows}))
    told = json.loads(command("evaluate", "hall-1", path, "--json").stdout)
    # The second is found, but has too few points to be demanded; found, it is no false one. The pipe's spot is.
    assert [row["id"] for row in told["true"]] == ["1"]
    assert [row["id"] for row in told["found"]] == ["1", "3"]
    assert told["not_asked"] == 2
    path.write_text(json.dumps({"parameters": {"srid": 25830}, "anomalies": rows}))
    assert "EPSG:25830" in command("evaluate", "hall-1", path, code=2).stderr


def test_local_coordinates_and_spots_in_a_tunnel(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    save_example_structures(conn, "demo-2024")
    conn.execute(
        "INSERT INTO tunnel.station (survey_id, scan_id, geom) SELECT s.id, 1, v.geom"
        " FROM tunnel.survey s, tunnel.axis_vertex v ORDER BY v.n LIMIT 1"
    )
    conn.execute("UPDATE tunnel.tunnel SET srid = 0")
    conn.commit()
    command("spots", "demo-2024", "--geometry", "3d", "-o", tmp_path / "spots.gpkg")
    told = json.loads(command("evaluate", "demo-2024", tmp_path / "spots.gpkg", "--spots", "--json").stdout)["groups"][0]
    assert (told["true"], told["found"], told["called"], told["right"]) == (3, 3, 3, 3)
    assert told["area_iou"] == pytest.approx(1.0, abs=1e-3)


def test_what_cannot_be_compared_is_refused_in_a_line(conn: psycopg.Connection, tmp_path: Path) -> None:
    add_example_site(tmp_path)
    save_example_structures(conn, "hall-1")
    flat = gpkg(tmp_path / "flat.gpkg", [box(0, 0, 1, 1)])
    other = gpkg(tmp_path / "other.gpkg", [disc(1.5, 1.0, 0.3)], "EPSG:25830")
    right = gpkg(tmp_path / "right.gpkg", [disc(1.5, 1.0, 0.3)])
    for arguments, says in (
        (["hall-1", flat], "has no heights"),
        (["hall-1", other], "EPSG:25829"),
        (["hall-1", right, "--km", "1"], "--km"),
    ):
        text = command("evaluate", *arguments, code=2).stderr
        assert says in text
        assert text.count("\n") == 1


def test_parts_of_one_true_spot_are_one(conn: psycopg.Connection, tmp_path: Path) -> None:
    add_example_site(tmp_path)
    save_example_structures(conn, "hall-1")
    both = MultiPolygon([disc(1.5, 1.0, 0.3), disc(2.9, 1.5, 0.2)])
    pyogrio.raw.write(
        str(tmp_path / "both.gpkg"), shapely.to_wkb(np.array([both], dtype=object)), [], np.array([]),
        geometry_type="MultiPolygon Z", crs="EPSG:25829", driver="GPKG", layer="spot",
    )  # fmt: skip
    told = json.loads(command("evaluate", "hall-1", tmp_path / "both.gpkg", "--json").stdout)["groups"][0]
    assert (told["true"], told["found"], told["called"], told["right"]) == (1, 1, 3, 2)
    assert told["area_recall"] == pytest.approx(1.0, abs=0.01)
