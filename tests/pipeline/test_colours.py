"""Coloured points through the real commands: the image in colour has the colours that were painted."""

from __future__ import annotations

import base64
import io
import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import psycopg
import pytest
import rasterio
from PIL import Image
from rasterio.enums import ColorInterp
from support.coloured_scan import paint, stripes
from support.command import command
from support.databases import Copies

from tunneldb.raster.geotiff import decode
from tunneldb.raster.state import PixelState
from tunneldb.simulate import Parameters, Simulation, write

NAME = "painted"
START = 12_310.0


@pytest.fixture(scope="module")
def scans(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Files of a tunnel without colours, to be copied and painted."""
    folder = tmp_path_factory.mktemp("scans")
    parameters = Parameters(
        name=NAME, section="circular", seed=4, start_chainage=START, length=16.0, scanner="profiler", profile_spacing=0.025,
        profile_points=1000, leaks=2,
    )  # fmt: skip
    write(Simulation(parameters), folder)
    return folder


@pytest.fixture
def unpainted(scans: Path, tmp_path: Path) -> Path:
    """Folder with files of its own."""
    shutil.copytree(scans, tmp_path, dirs_exist_ok=True)
    return tmp_path


@pytest.fixture(scope="module")
def striped(copies: Copies, template: str, scans: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A database of the tunnel in stripes of 16 bits through all stages, to be copied."""
    folder = tmp_path_factory.mktemp("striped") / "scans"
    shutil.copytree(scans, folder)
    paint(folder, stripes)

    def fill() -> None:
        assert "colours are read as 8 bits" not in run(folder)

    with copies.prepared(template, fill) as name:
        yield name


def run(folder: Path) -> str:
    command("tunnel", "add", NAME, "--srid", 25830, "--axis", folder / f"{NAME}.axis.csv", "--start-chainage", START)
    command(
        "survey", "add", NAME, "--tunnel", NAME, "--date", "2024-05-04", "--trajectory", folder / f"{NAME}.trajectory.csv",
        "--intensity", "Amplitude", "--intensity-kind", "amplitude", "--reference", folder / f"{NAME}.reference.csv",
    )  # fmt: skip
    command("load", NAME, *folder.glob("*.laz"))
    return command("run", NAME).output


def blocks(conn: psycopg.Connection, kind: str) -> list[bytes]:
    rows = conn.execute("SELECT tiff FROM tunnel.image WHERE kind = %s ORDER BY km, block", (kind,), binary=True).fetchall()
    conn.rollback()
    return [tiff for (tiff,) in rows]


@pytest.mark.slow
def test_pixels_have_the_colours_of_their_places(copies: Copies, striped: str) -> None:
    with copies.connected(striped) as conn:
        check_colours(conn)


@pytest.mark.slow
def test_colours_of_8_bits_are_told_and_the_same(conn: psycopg.Connection, unpainted: Path) -> None:
    paint(unpainted, stripes, full=255, point_format=3)
    assert "colours are read as 8 bits" in run(unpainted)
    check_colours(conn)


def check_colours(conn: psycopg.Connection) -> None:
    (tiff,) = blocks(conn, "rgb")
    image, plain = decode(tiff, "rgb"), decode(blocks(conn, "corrected")[0])
    assert image.transform == plain.transform
    chainage, arc = np.meshgrid(*image.places())
    expected = stripes(chainage.ravel(), arc.ravel()).reshape(*chainage.shape, 3) * 255
    # Away from the edges between colours: the measured axis is some millimetres off the true one.
    far = (np.abs(chainage / 2.0 - np.rint(chainage / 2.0)) > 0.03) & (np.abs(arc) > 0.05) & (np.abs(arc - 3.0) > 0.05)
    far &= (chainage > START + 1) & (chainage < START + 15)
    lining = decode(blocks(conn, "state")[0]).values == PixelState.LINING  # the arc of fixtures is not that of the lining
    seen = lining & np.isfinite(plain.values) & far
    painted = np.isfinite(expected[:, :, 0])
    assert (seen & painted).sum() > 100_000
    assert (seen & ~painted).sum() > 10_000
    coloured = np.isfinite(image.values[:, :, 0])
    assert coloured[seen & painted].mean() > 0.999
    assert coloured[seen & ~painted].mean() < 0.001
    both = seen & painted & coloured
    off = np.abs(image.values[both] - expected[both]).max(axis=1)
    assert (off <= 1.0).mean() > 0.999
    (overview,) = blocks(conn, "overview_rgb")
    assert decode(overview, "overview_rgb").values.shape[2] == 3


@pytest.mark.slow
def test_a_scan_without_colours_has_no_such_image(conn: psycopg.Connection, unpainted: Path) -> None:
    paint(unpainted, lambda chainage, _: np.zeros((len(chainage), 3)))
    assert "they are black or fractions of 1" in run(unpainted)
    assert not blocks(conn, "rgb")
    assert blocks(conn, "corrected")


@pytest.mark.slow
def test_images_in_colour_are_exported_and_shown(copies: Copies, striped: str, tmp_path: Path) -> None:
    with copies.connected(striped) as conn:
        check_documents(conn, tmp_path)


def check_documents(conn: psycopg.Connection, tmp_path: Path) -> None:
    stored = decode(blocks(conn, "rgb")[0], "rgb")
    command("image", NAME, "-o", tmp_path / "images")
    with rasterio.open(tmp_path / "images" / f"{NAME}-km012-rgb.tif") as image:
        assert image.descriptions == ("red", "green", "blue", "opacity")
        assert image.colorinterp == (ColorInterp.red, ColorInterp.green, ColorInterp.blue, ColorInterp.alpha)
        assert image.overviews(1)
        bands = image.read()
    held = np.isfinite(stored.values[:, :, 0])
    np.testing.assert_array_equal(bands[3], np.where(held, 255, 0))
    np.testing.assert_array_equal(np.moveaxis(bands[:3], 0, 2)[held], stored.values[held])
    preview = np.asarray(Image.open(tmp_path / "images" / f"{NAME}-km012-rgb.png").convert("RGB"))
    for colour in ((200, 60, 40), (40, 160, 90), (50, 80, 220), (230, 220, 40)):
        assert (np.abs(preview.astype(int) - colour).max(axis=2) <= 2).sum() > 1000
    command("report", NAME, "-o", tmp_path / "report.html")
    details = re.findall(
        r'<script type="application/json">(\{.*?\})</script>', (tmp_path / "report.html").read_text("utf-8"), re.S
    )
    shown = [leak for strip in details for leak in json.loads(strip).values()]
    assert shown
    for leak in shown:
        grey, colour = (_picture(leak[name]) for name in ("picture", "colour"))
        assert grey.size == colour.size
        assert np.ptp(np.asarray(grey).reshape(-1, 3).astype(int), axis=1).mean() < 20
        assert np.ptp(np.asarray(colour).reshape(-1, 3).astype(int), axis=1).mean() > 40


def _picture(url: str) -> Image.Image:
    return Image.open(io.BytesIO(base64.b64decode(url.partition(",")[2]))).convert("RGB")
