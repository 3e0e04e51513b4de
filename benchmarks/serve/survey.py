"""The survey: synthetic rows, and images of noise with the leaks in them."""

from __future__ import annotations

import numpy as np
import psycopg
from psycopg import sql

from benchmarks import synthetic
from benchmarks.common import progress
from tunneldb.raster.geotiff import Raster, encode
from tunneldb.raster.grid import BLOCK, BLOCKS, Grid
from tunneldb.raster.overview import Overview
from tunneldb.raster.state import PixelState
from tunneldb.store.images import insert_image, save_overview
from tunneldb.store.survey import get_survey

SURVEY, PIXEL, ARCS = "long-2024", 0.02, (-12.0, 12.0)
PASSWORD = "benchmark"
PATTERNS = 8
"""Number of different blocks, which repeat along the tunnel."""


def make(conn: psycopg.Connection, kilometres: int, findings: int, points: int) -> None:
    """Fill an installed, empty database."""
    drawn, dry = findings // 5, findings // 14
    size = synthetic.Size(kilometres, findings - drawn - dry, points, dry, drawn)
    synthetic.make(conn, SURVEY, size)
    survey = get_survey(conn, SURVEY)
    rng = np.random.default_rng(1)
    shape = round((ARCS[1] - ARCS[0]) / PIXEL), round(BLOCK / PIXEL)
    patterns = {
        "corrected": [rng.normal(-10, 0.6, shape).astype(np.float32) for _ in range(PATTERNS)],
        "offset": [rng.normal(0, 0.004, shape).astype(np.float32) for _ in range(PATTERNS)],
        "state": [np.full(shape, PixelState.LINING, np.float32)] * PATTERNS,
    }
    for km in range(kilometres):
        progress(f"images of kilometre {km}")
        grid = Grid.covering(km, PIXEL, *ARCS)
        for kind, blocks in patterns.items():
            overview = Overview(kind)
            for n in range(BLOCKS):
                raster = Raster(blocks[(km + n) % PATTERNS], grid.transform(n * grid.block_columns))
                insert_image(conn, survey, km, kind, km * BLOCKS + n, encode(raster, kind))
                overview.add(raster)
            save_overview(conn, survey, km, overview)
        conn.commit()


def add_people(conn: psycopg.Connection, count: int) -> list[str]:
    """Make inspectors with passwords; return their names."""
    names = [f"reviewer_{n:02}" for n in range(count)]
    for name in names:
        conn.execute(sql.SQL("CREATE ROLE {} LOGIN PASSWORD {}").format(sql.Identifier(name), sql.Literal(PASSWORD)))
        conn.execute(sql.SQL("GRANT tunnel_inspector TO {}").format(sql.Identifier(name)))
    conn.commit()
    return names
