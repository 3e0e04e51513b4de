"""The offset image with gaps filled, over the ends of blocks and kilometres."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import psycopg
import pytest
import rasterio
from affine import Affine
from support.example_survey import PIXEL, without_intensity

from tunneldb.export.images.image import export_filled
from tunneldb.raster.geotiff import Raster, decode, encode
from tunneldb.store.survey import get_survey

LAST = 249
"""Number of the example's last block, from 12450 to 12500 m."""


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def read(path: Path) -> tuple[np.ndarray, Affine]:
    with rasterio.open(path) as image:
        assert image.profile["driver"] == "GTiff"
        assert image.units == ("m",)
        return image.read(1), image.transform


def test_the_end_of_a_kilometre_is_no_gap(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    """Its neighbour's image begins 0.8 m lower; profiles of either fill up to 0.3 m of the other."""
    without_intensity(conn, every=8)  # gaps of 0.7 m: a tenth stays open in the middle
    survey = get_survey(conn, example)
    conn.commit()
    whole, place = read(*export_filled(conn, survey, 12, tmp_path))
    assert np.isnan(whole).any(axis=0).sum() == pytest.approx(whole.shape[1] / 8, abs=4)
    (tiff,) = conn.execute("SELECT tiff FROM tunnel.image WHERE block = %s", [LAST], binary=True).fetchone()
    image = decode(bytes(tiff))
    lower = Raster(image.values[8:], image.transform @ Affine.translation(0, 8))
    conn.execute("UPDATE tunnel.image SET km = 13, tiff = %s WHERE block = %s", [encode(lower, "offset"), LAST])
    conn.commit()
    (left, at_left), (right, at_right) = (read(*export_filled(conn, survey, km, tmp_path)) for km in (12, 13))
    border = round((at_right.c - place.c) / PIXEL)
    assert (at_left, border) == (place, left.shape[1])
    assert at_right.f == pytest.approx(place.f - 0.8)
    # the rows that the neighbour lacks are filled by itself alone
    assert np.array_equal(left[11:], whole[11:, :border], equal_nan=True)
    assert np.array_equal(right[3:], whole[11:, border:], equal_nan=True)


def test_fine_pixels_become_those_of_a_preview(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    """Pixels of 2 cm: two by two, which divide a block."""
    without_intensity(conn)
    survey = get_survey(conn, example)
    conn.execute("DELETE FROM tunnel.image WHERE block <> %s", [LAST])
    values = np.full((101, 2500), np.nan, np.float32)
    values[:, ::25] = np.arange(101, dtype=np.float32)[:, None] / 1000
    tiff = encode(Raster(values, Affine(0.02, 0, LAST * 50.0, 0, -0.02, 1.0)), "offset")
    conn.execute("UPDATE tunnel.image SET tiff = %s", [tiff])
    conn.commit()
    filled, place = read(*export_filled(conn, survey, 12, tmp_path))
    assert (filled.shape, place.a, place.c, place.f) == ((51, 1250), 0.04, LAST * 50.0, 1.0)
    seven = slice(0, 1245)  # pixels beyond the last profile; 0.3 m are no eight
    assert filled[:50, seven] == pytest.approx(np.repeat((2 * np.arange(50) + 0.5)[:, None] / 1000, 1245, axis=1), abs=1e-4)
    assert np.isnan(filled[:, 1245:]).all()
