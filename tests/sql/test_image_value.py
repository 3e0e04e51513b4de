"""What the images hold at a place, in SQL, is what Python reads from their blocks."""

from __future__ import annotations

from typing import Any

import numpy as np
import psycopg
import pytest
from psycopg import sql

from tunneldb.store.images import load_block, survey_blocks
from tunneldb.store.survey import get_survey

QUERY = "SELECT value FROM tunnel_api.image_values(%s, %s, %s, %s) ORDER BY n"


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


@pytest.fixture
def survey_id(conn: psycopg.Connection[Any], example: str) -> int:
    if conn.execute("SELECT FROM pg_available_extensions WHERE name = 'postgis_raster'").fetchone() is None:
        pytest.skip("no postgis_raster")
    conn.execute("CREATE EXTENSION postgis_raster SCHEMA public")
    return get_survey(conn, example).id


@pytest.mark.parametrize("kind", ["corrected", "offset", "state"])
def test_values_are_those_of_the_pixels(conn: psycopg.Connection[Any], survey_id: int, example: str, kind: str) -> None:
    survey = get_survey(conn, example)
    random = np.random.default_rng(0)
    x, y, wanted = [], [], []
    for block in survey_blocks(conn, survey, kind):
        raster = load_block(conn, survey, block // 20, kind, block)
        chainage, arc = raster.places()
        row, column = random.integers(0, len(arc), 50), random.integers(0, len(chainage), 50)
        shift = random.uniform(-0.49, 0.49, (2, 50)) * raster.transform.a  # anywhere in a pixel
        x.append(chainage[column] + shift[0])
        y.append(arc[row] + shift[1])
        wanted.append(raster.values[row, column])
    conn.execute("SET LOCAL ROLE tunnel_viewer")
    places = [np.concatenate(each).tolist() for each in (x, y)]
    found = np.array(conn.execute(QUERY, [survey_id, kind, *places]).fetchall(), dtype=np.float64)[:, 0]
    assert np.isfinite(found).sum() > 10
    np.testing.assert_allclose(found, np.concatenate(wanted), atol=1e-6)
    one = conn.execute(
        "SELECT tunnel_api.image_value(%s, %s, %s, %s)", [survey_id, kind, places[0][0], places[1][0]]
    ).fetchone()
    assert one == (None if np.isnan(found[0]) else found[0],)


def test_where_there_is_no_image_there_is_no_value(conn: psycopg.Connection[Any], survey_id: int) -> None:
    places = [[0.0, 12345.0, float("nan"), None, float("inf")], [0.0, 500.0, 0.0, 0.0, 0.0]]
    assert conn.execute(QUERY, [survey_id, "offset", *places]).fetchall() == [(None,)] * 5
    with pytest.raises(
        psycopg.errors.InvalidParameterValue, match="there is no image 'offst': there are raw, corrected, offset"
    ):
        conn.execute(QUERY, [survey_id, "offst", [1.0], [1.0]])


def test_formats_stay_as_closed_as_they_were(conn: psycopg.Connection[Any], survey_id: int) -> None:
    conn.execute(QUERY, [survey_id, "offset", [12345.0], [0.0]])
    assert conn.execute("SHOW postgis.gdal_enabled_drivers").fetchone() == ("DISABLE_ALL",)


def test_who_may_not_open_the_format_is_told(conn: psycopg.Connection[Any], survey_id: int, example: str) -> None:
    """The owner is no superuser, as on a managed server."""
    conn.execute("CREATE ROLE plain")
    conn.execute(sql.SQL("GRANT USAGE ON SCHEMA tunnel, tunnel_api TO plain"))
    conn.execute("GRANT SELECT ON ALL TABLES IN SCHEMA tunnel TO plain")
    conn.execute("ALTER FUNCTION tunnel_api.image_values(int, text, float8[], float8[]) OWNER TO plain")
    place = conn.execute(
        "SELECT min(block) * 50.0 + 1 FROM tunnel.image WHERE survey_id = %s AND kind = 'offset'", [survey_id]
    ).fetchone()
    assert place is not None
    with pytest.raises(psycopg.errors.ObjectNotInPrerequisiteState, match="may not read GeoTIFF") as told:
        conn.execute(QUERY, [survey_id, "offset", [float(place[0])], [0.0]])
    assert "SET postgis.gdal_enabled_drivers = 'GTiff'" in str(told.value.diag.message_hint)


def test_without_the_extension_it_says_so(conn: psycopg.Connection[Any], example: str) -> None:
    with pytest.raises(psycopg.errors.UndefinedObject, match="postgis_raster"):
        conn.execute(QUERY, [1, "offset", [1.0], [1.0]])
