"""`image import` of pictures in an E57: spots on the lining, seen by panoramas and a camera with known poses."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import psycopg
import pytest
from click.testing import CliRunner, Result
from scipy.spatial.transform import Rotation
from support.e57_pictures import Shot, write_e57
from support.example_objects import relief
from support.example_survey import NAME

from tunneldb.cli.main import main
from tunneldb.raster.geotiff import decode
from tunneldb.store.surface import load_surface
from tunneldb.store.survey import get_survey

SPOTS = [(12330.3, -5.2), (12332.0, 3.1), (12336.7, 0.4), (12341.2, -2.0), (12344.5, 4.4)]
"""Chainage and arc of white spots, m."""


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


@pytest.fixture
def surface(conn: psycopg.Connection, example: str):
    found = load_surface(conn, get_survey(conn, NAME))
    conn.rollback()
    return found


def run(*arguments: object) -> Result:
    return CliRunner().invoke(main, [str(a) for a in arguments])


def camera_at(surface, chainage: float, aside: float, up: float) -> np.ndarray:
    """A place in the tunnel, right of the axis and above it."""
    origin, _, right, upwards = surface.frames(np.array([chainage]))[0]
    return origin + aside * right + up * upwards


def panorama(surface, place: np.ndarray, turn: Rotation, columns: int = 3600) -> Shot:
    """A spherical picture of the spots, each drawn where its direction from the camera leads, 4 cm wide; the rest is grey."""
    rows = columns // 2
    step = 2 * np.pi / columns
    chainage, arc = np.array(SPOTS).T
    spots = surface.to_space(chainage, arc, relief(chainage, arc))  # as the example's image of the offset has it
    azimuth = (columns / 2 - np.arange(columns) - 0.5) * step
    elevation = (rows / 2 - np.arange(rows) - 0.5) * step
    pixels = np.full((rows, columns, 3), 90, np.uint8)
    for own in turn.inv().apply(spots - place):
        reach = np.linalg.norm(own)
        across = (azimuth - np.arctan2(own[1], own[0]) + np.pi) % (2 * np.pi) - np.pi
        level = np.arcsin(own[2] / reach)
        near = np.flatnonzero(np.abs(elevation - level) * reach < 0.06)
        far = np.hypot(across[None, :] * np.cos(level), elevation[near, None] - level) * reach
        pixels[near] = np.where((far < 0.06)[:, :, None], np.uint8(255), pixels[near])
    numbers = {"pixelWidth": step, "pixelHeight": step}
    return Shot(pixels, "sphericalRepresentation", numbers, tuple(place), turn, f"at {place[0]:.0f}")


def imported(path: Path, *options: object) -> dict:
    done = run("image", "import", NAME, path, "--kind", "photo", *options, "--json")
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


def spot_errors(conn: psycopg.Connection, spots: list[tuple[float, float]] = SPOTS) -> np.ndarray:
    """Distance of the centre of each white spot in the stored image from its true place, m."""
    rows = conn.execute(
        "SELECT block, tiff FROM tunnel.image WHERE kind = 'imported_photo' ORDER BY block", binary=True
    ).fetchall()
    conn.rollback()
    blocks = {block: decode(bytes(tiff), "imported_photo") for block, tiff in rows}
    out = []
    for chainage, arc in spots:
        raster = blocks[int(chainage // 50)]
        x, y = raster.places()
        near = np.ix_(abs(y - arc) < 0.3, abs(x - chainage) < 0.3)
        white = np.maximum(np.nan_to_num(raster.values[..., 1][near], nan=90.0) - 110.0, 0.0)
        assert white.sum() > 0, (chainage, arc)
        at_x, at_y = x[near[1][0]], y[near[0][:, 0]]
        out.append(np.hypot((white.sum(0) @ at_x) / white.sum() - chainage, (white.sum(1) @ at_y) / white.sum() - arc))
    return np.array(out)


def test_two_panoramas_are_placed_within_2_cm(conn: psycopg.Connection, example: str, surface, tmp_path: Path) -> None:
    turns = Rotation.from_euler("zyx", [[130.0, 3.0, -5.0], [-20.0, -8.0, 2.0]], degrees=True)
    places = [camera_at(surface, 12331.0, 0.4, 0.3), camera_at(surface, 12343.0, -0.7, -0.2)]
    shots = [panorama(surface, place, turn) for place, turn in zip(places, turns, strict=True)]
    said = imported(write_e57(tmp_path / "two.e57", shots), "--pixel", 0.01)
    assert said["image"]["placement"] == "poses"
    assert said["image"]["frames"] == 2
    assert said["image"]["colour"] is True
    assert said["image"]["warnings"] == []
    assert spot_errors(conn).max() < 0.02


def test_a_camera_without_lens_errors_sees_what_the_panorama_saw(
    conn: psycopg.Connection, example: str, surface, tmp_path: Path
) -> None:
    """Each of four pinhole pictures is resampled from the panorama by the definition of a pinhole, and shows the same."""
    place, turn = camera_at(surface, 12336.0, 0.1, 0.2), Rotation.from_euler("z", 30.0, degrees=True)
    whole = panorama(surface, place, turn, 7200)
    shots = []
    for heading in (0.0, 90.0, 180.0, 270.0):
        aim = turn * Rotation.from_euler("z", heading, degrees=True) * Rotation.from_matrix([[0, 0, -1], [-1, 0, 0], [0, 1, 0]])
        size, focal = 1600, 700.0  # pixels: 98° wide, so that the four overlap
        across, down = np.meshgrid(np.arange(size) + 0.5 - size / 2, np.arange(size) + 0.5 - size / 2)
        rays = np.stack([across, -down, np.full_like(across, -focal)], axis=-1).reshape(-1, 3)
        own = turn.inv().apply(aim.apply(rays))
        column = (3600 - np.arctan2(own[:, 1], own[:, 0]) / (2 * np.pi / 7200)).astype(int) % 7200
        row = (1800 - np.arctan2(own[:, 2], np.hypot(own[:, 0], own[:, 1])) / (2 * np.pi / 7200)).astype(int)
        pixels = whole.pixels[np.clip(row, 0, 3599), column].reshape(size, size, 3)
        numbers = {
            "pixelWidth": 5e-6, "pixelHeight": 5e-6, "focalLength": focal * 5e-6, "principalPointX": size / 2,
            "principalPointY": size / 2,
        }  # fmt: skip
        shots.append(Shot(pixels, "pinholeRepresentation", numbers, tuple(place), aim))
    imported(write_e57(tmp_path / "four.e57", shots), "--pixel", 0.01)
    crown = SPOTS[2]  # above the cameras: in none of the pictures
    assert spot_errors(conn, [spot for spot in SPOTS if spot != crown]).max() < 0.02


def test_pictures_without_a_pose_and_elsewhere_are_counted(
    conn: psycopg.Connection, example: str, surface, tmp_path: Path
) -> None:
    place = camera_at(surface, 12336.0, 0.0, 0.0)
    there = panorama(surface, place, Rotation.identity(), 1200)
    elsewhere = panorama(surface, place + np.array([0.0, 0.0, 80.0]), Rotation.identity(), 1200)
    bare = Shot(there.pixels, "visualReferenceRepresentation")
    said = imported(write_e57(tmp_path / "some.e57", [bare, there, elsewhere]), "--pixel", 0.02)
    assert said["image"]["frames"] == 1
    assert said["image"]["warnings"] == [
        "1 picture of 3 without a pose or a projection",
        "1 picture of 3 taken outside the tunnel",
    ]


def test_what_cannot_be_placed_is_refused(conn: psycopg.Connection, example: str, surface, tmp_path: Path) -> None:
    place = camera_at(surface, 12336.0, 0.0, 0.0)
    there = panorama(surface, place, Rotation.identity(), 360)
    numbers = there.numbers
    cases = {
        "has a pose and a projection": [Shot(there.pixels, "visualReferenceRepresentation")],
        "was taken in the tunnel": [Shot(there.pixels, "sphericalRepresentation", numbers, (0.0, 0.0, 0.0))],
        "its header states 100 × 50": [Shot(there.pixels, "sphericalRepresentation", numbers, tuple(place), size=(50, 100))],
        "has pixelWidth 0: it must be positive": [
            Shot(there.pixels, "sphericalRepresentation", {**numbers, "pixelWidth": 0.0}, tuple(place))
        ],
        "the file has no pictures": [],
    }
    for n, (said, shots) in enumerate(cases.items()):
        done = run("image", "import", NAME, write_e57(tmp_path / f"{n}.e57", shots), "--kind", "photo", "--pixel", 0.05)
        assert done.exit_code == 2, (said, done.output)
        assert said in done.stderr
        assert len(done.stderr.splitlines()) == 1
    path = write_e57(tmp_path / "good.e57", [there])
    assert "--kind photo" in run("image", "import", NAME, path, "--kind", "thermal").stderr
    assert "leave out --band" in run("image", "import", NAME, path, "--kind", "photo", "--band", 1).stderr
    assert conn.execute("SELECT count(*) FROM tunnel.imported_image").fetchone() == (0,)


def test_a_file_without_a_scan_names_the_command(example: str, surface, tmp_path: Path) -> None:
    there = panorama(surface, camera_at(surface, 12336.0, 0.0, 0.0), Rotation.identity(), 360)
    done = run("inspect", write_e57(tmp_path / "pictures.e57", [there, there]))
    assert done.exit_code == 2
    assert "only pictures (2): tunneldb image import" in done.stderr
