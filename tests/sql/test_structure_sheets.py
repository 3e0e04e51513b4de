"""How faces are laid out to be drawn: as they lie in their member, seen from the scanner, member below member."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import psycopg
import pytest
import shapely
from support.example_structures import ORIGIN, RADIUS, add_example_site, example_structures, save_example_structures

from tunneldb.structures.models import normals_at, to_space


def test_faces_are_drawn_as_they_lie(conn: psycopg.Connection, tmp_path: Path) -> None:
    add_example_site(tmp_path)
    save_example_structures(conn, "hall-1")
    placed = {
        row[0]: row[1:]
        for row in conn.execute(
            "SELECT f.number, p.xx, p.xy, p.yx, p.yy, p.x, p.y, public.ST_AsBinary(p.cell) FROM tunnel_api.face_placement p"
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
