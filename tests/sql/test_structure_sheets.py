"""How faces are laid out to be drawn: as they lie in their member, seen from the scanner, member below member."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import psycopg
import pytest
import shapely
from support.example_structures import ORIGIN, RADIUS, add_example_site, example_structures, model, save_example_structures

from tunneldb.pipeline.replace_structures import replace_structures
from tunneldb.store.survey import get_survey
from tunneldb.structures.models import normals_at, to_space, unroll
from tunneldb.structures.results import Face, Member, Structures


def test_faces_are_drawn_as_they_lie(conn: psycopg.Connection, tmp_path: Path) -> None:
    add_example_site(tmp_path)
    save_example_structures(conn, "hall-1")
    placed = {
        row[0]: row[1:]
        for row in conn.execute(
            "SELECT f.number, p.xx, p.xy, p.yx, p.yy, p.x, p.y, public.ST_AsBinary(p.cell)"
            " FROM tunnel_internal.face_placement p"
            " JOIN tunnel_api.face f ON f.id = p.id WHERE p.survey = 'hall-1'"
        )
    }
    drawn: dict[int, np.ndarray] = {}
    solid: dict[int, np.ndarray] = {}
    cells = {}
    for face in example_structures().faces:
        xx, xy, yx, yy, x, y, cell = placed[face.number]
        u, v = shapely.get_coordinates(shapely.segmentize(face.outline, 0.2)).T
        at = np.column_stack([xx * u + xy * v + x, yx * u + yy * v + y])
        drawn.setdefault(face.number, at)
        solid[face.number] = to_space(face.model, u, v)
        cells[face.member] = shapely.from_wkb(bytes(cell))
        assert cells[face.member].contains(shapely.MultiPoint(at))
        # To the right, then up: towards who looks at it.
        right, up = np.array([xx, xy]), np.array([yx, yy])
        step = 1e-5
        middle = face.outline.centroid
        centre, east, north = to_space(
            face.model, middle.x + step * np.array([0, right[0], up[0]]), middle.y + step * np.array([0, right[1], up[1]])
        )
        towards = normals_at(face.model, np.array([middle.x]), np.array([middle.y]))[0]
        assert np.cross(east - centre, north - centre) @ towards == pytest.approx(step**2, rel=1e-3)
    wall, picture = np.vstack([solid[1], solid[2]]), np.vstack([drawn[1], drawn[2]])
    np.testing.assert_allclose(
        np.linalg.norm(picture[:, None] - picture[None], axis=2), np.linalg.norm(wall[:, None] - wall[None], axis=2), atol=1e-6
    )
    assert np.ptp(picture[:, 1]) == pytest.approx(2.0), "up is up"
    pipe, picture = np.vstack([solid[3], solid[4]]), np.vstack([drawn[3], drawn[4]])
    angle = np.arctan2(pipe[:, 0] - 5.0, 1.0 - pipe[:, 1])
    np.testing.assert_allclose(np.abs(picture[:, 0] - picture[0, 0]), np.abs(pipe[:, 2] - pipe[0, 2]), atol=1e-6)
    np.testing.assert_allclose(np.abs(picture[:, 1] - picture[0, 1]), RADIUS * np.abs(angle - angle[0]), atol=1e-6)
    assert cells[1].intersection(cells[2]).area == 0.0
    for cell in cells.values():
        x0, y0, x1, y1 = cell.bounds
        assert (x1 - x0) / (y1 - y0) == pytest.approx(277 / 110)

    # Faces for 3D lie 1 cm behind; a plane's distance, and the pipe's radius, say so.
    for number, wkb in conn.execute("SELECT number, public.ST_AsBinary(geom) FROM tunnel_api.face_3d"):
        at = shapely.get_coordinates(shapely.from_wkb(bytes(wkb)), include_z=True) - ORIGIN
        if number < 3:
            np.testing.assert_allclose(at @ [0.6, -0.8, 0.0], -0.01, atol=1e-6)
        else:
            np.testing.assert_allclose(np.hypot(at[:, 0] - 5.0, at[:, 1] - 1.0), RADIUS - 0.01, atol=1e-6)


def test_sides_of_a_profile_are_drawn_below_each_other_along_it(conn: psycopg.Connection, tmp_path: Path) -> None:
    add_example_site(tmp_path)
    along = np.array([2.0, 1.0, 2.0]) / 3.0
    web = np.array([1.0, -2.0, 0.0]) / np.sqrt(5.0)
    flange = np.cross(along, web)
    # Two faces of the web, 2 m and 1 m long and 1 m apart, 0.3 m deep; one of the flange, 4 m long and 0.1 m wide.
    rows = [(np.zeros(3), web, 2.0, 0.3, 1), (3.0 * along, web, 1.0, 0.3, 1), (0.15 * flange, flange, 4.0, 0.1, 2)]
    faces, solid = [], {}
    for number, (start, normal, length, width, side) in enumerate(rows, start=1):
        across = np.cross(normal, along)
        corners = start + np.array(
            [(a * length) * along + b * width * across for a, b in ((0, -0.5), (1, -0.5), (1, 0.5), (0, 0.5))]
        )
        face = model(start, normal, start)
        outline = shapely.Polygon(np.column_stack(unroll(face, corners)[:2]))
        faces.append(
            Face(number, 1, side, "flat", face, ORIGIN, 1000, outline.area, 0.0, 0.001, 1.0, (5.0, 40.0), 20.0, 0.3, False,
                 shapely.MultiPolygon([outline]))
        )  # fmt: skip
        solid[number] = corners
    line = ORIGIN + np.array([np.zeros(3), 4.0 * along])
    beam = Member(1, "profile", (1, 2, 3), sum(face.area for face in faces), 4.0, line, False)
    replace_structures(conn, get_survey(conn, "hall-1", site=True), Structures([beam], faces, []), None)
    drawn = {}
    for number, xx, xy, yx, yy, x, y, cell in conn.execute(
        "SELECT f.number, p.xx, p.xy, p.yx, p.yy, p.x, p.y, public.ST_AsBinary(p.cell)"
        " FROM tunnel_internal.face_placement p"
        " JOIN tunnel_api.face f ON f.id = p.id WHERE p.survey = 'hall-1'"
    ):
        u, v, _ = unroll(faces[number - 1].model, solid[number])
        drawn[number] = np.column_stack([xx * u + xy * v + x, yx * u + yy * v + y])
        assert shapely.from_wkb(bytes(cell)).contains(shapely.MultiPoint(drawn[number]))
        assert xx * yy - xy * yx == pytest.approx(1.0), "seen from the scanner's side, at its size"
    for number, corners in solid.items():
        np.testing.assert_allclose(drawn[number][:, 0] - drawn[1][0, 0], corners @ along, atol=1e-6)
    one, other, below = (shapely.Polygon(drawn[number]) for number in (1, 2, 3))
    assert one.bounds[1] == pytest.approx(other.bounds[1])
    assert one.bounds[1] - below.bounds[3] == pytest.approx(0.05)
    sheet = conn.execute("SELECT kind, faces FROM tunnel_api.member_sheet WHERE survey = 'hall-1'").fetchall()
    assert sheet == [("profile", 3)]
