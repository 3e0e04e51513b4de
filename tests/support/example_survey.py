"""A survey made by hand, without scans: a curved, sloped tunnel with a flat floor, its leaks and images."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import psycopg
import pytest
import shapely
from psycopg import sql
from psycopg.conninfo import make_conninfo
from shapely.geometry import Polygon, box

from support.databases import create_database
from support.example_action import add_action
from support.example_alarm import add_alarms
from support.example_clearance import add_clearance
from support.example_deviation import add_deviation
from support.example_objects import CORNER, HALF_FLOOR, SPHERES, THINGS, beside, boxed, relief
from support.example_rating import add_rating
from support.example_rings import add_rings
from tunneldb.anomalies.geometries import anomaly_geometries
from tunneldb.database import open_connection
from tunneldb.geometry.frame import frames_at, segment_rows, tangents
from tunneldb.geometry.surface import Surface
from tunneldb.raster.geotiff import KINDS, Raster, decode, encode
from tunneldb.raster.grid import BLOCK, Grid
from tunneldb.raster.overview import Overview
from tunneldb.raster.state import PixelState
from tunneldb.store.images import save_overview
from tunneldb.store.survey import get_survey

DATABASE = "tunneldb_example"
NAME, SRID, SPACING = "demo-2024", 25830, 10.0
FIRST, LAST = 1230, 1250  # axis vertices: chainage 12+300 to 12+500
KM = 12
PIXEL = 0.1
LEAKS = [
    (12318.0, 1.0, 0.5, "open"),
    (12344.0, -5.2, 0.9, "open"),
    (12402.5, 4.4, 1.1, "confirmed"),
    (12421.0, -1.5, 0.4, "rejected"),
    (12428.0, 6.0, 0.7, "open"),
    (12436.0, -6.1, 0.8, "confirmed"),
    (12471.0, 0.3, 0.5, "open"),
]
"""Leaks: chainage and arc of the middle, radius across, m, and review."""

DRY = {
    "joint": (box(12415.0, -6.0, 12415.1, 6.0), ["thin"]),
    "dark": (box(12440.0, 2.0, 12441.0, 2.8), ["rectangular"]),
}
"""What is dark but dry: outline in the unrolled plane and reasons, by kind."""

SEEN_FROM, WET = 12310.0, (12400.0, 12405.0)
"""Before that chainage no lining was seen; the stretch in which a tenth of what was seen is wet, m."""

GIRTH = 2 * CORNER
"""Lining round the section, from foot to foot of the walls, m."""

PEOPLE = {
    "vera": "tunnel_viewer",
    "ines": "tunnel_inspector",
    "otto": "tunnel_operator",
    "olga": "tunnel_operator",
    "nobody": None,
}
"""Who can log in to the server, and with which role."""


@pytest.fixture(scope="session")
def people(server_dsn: str, example_template: str) -> None:
    """Make the people; roles belong to the whole server."""
    with psycopg.connect(server_dsn, autocommit=True) as connection:
        for name, role in PEOPLE.items():
            connection.execute(sql.SQL("CREATE ROLE {} LOGIN").format(sql.Identifier(name)))
            if role is not None:
                connection.execute(sql.SQL("GRANT {} TO {}").format(sql.Identifier(role), sql.Identifier(name)))


@pytest.fixture
def person(request: pytest.FixtureRequest, people: None, dsn: str) -> Iterator[psycopg.Connection]:
    """Connection of the one of PEOPLE that the test is given as its parameter."""
    with psycopg.connect(make_conninfo(dsn, user=request.param), autocommit=True) as connection:
        yield connection


@pytest.fixture(scope="session")
def example_template(server_dsn: str, installed: str) -> str:
    """Name of a database with a survey that has every kind of row which the views and QGIS show, to be copied.

    A test module that gives this as its `template` finds the survey in its `conn`.
    """
    create_database(server_dsn, DATABASE, installed)
    with open_connection(make_conninfo(server_dsn, dbname=DATABASE)) as connection:
        _fill(connection)
    return DATABASE


@pytest.fixture
def example(conn: psycopg.Connection) -> str:
    """Name of the survey in a copy of the example."""
    return NAME


def add_later_survey(conn: psycopg.Connection, name: str = "demo-2026") -> None:
    """Add a second survey of the tunnel that found the same lining and images, and no leak."""
    (later,) = conn.execute(
        "INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_dimension, intensity_kind, platform, reference) "
        "SELECT tunnel_id, %s, '2026-05-04', intensity_dimension, intensity_kind, platform, reference FROM tunnel.survey "
        "WHERE name = %s RETURNING id",
        (name, NAME),
    ).fetchone()
    copy_rows(conn, NAME, later, ("axis_vertex", "segment", "section", "coverage", "image"))


def copy_rows(conn: psycopg.Connection, source: str, target: int, tables: tuple[str, ...]) -> None:
    """Copy the rows of tables from a survey to another one, without their keys."""
    for table in tables:
        columns = [
            column
            for (column,) in conn.execute(
                "SELECT attname FROM pg_attribute WHERE attrelid = format('tunnel.%%I', %s::text)::regclass AND attnum > 0 "
                "AND NOT attisdropped AND attidentity = '' AND attgenerated = '' AND attname <> 'survey_id'",
                [table],
            )
        ]
        names = sql.SQL(", ").join(map(sql.Identifier, columns))
        conn.execute(
            sql.SQL(
                "INSERT INTO tunnel.{table} (survey_id, {names}) SELECT {target}, {names} FROM tunnel.{table}"
                " WHERE survey_id = (SELECT id FROM tunnel.survey WHERE name = {source})"
            ).format(table=sql.Identifier(table), names=names, target=sql.Literal(target), source=sql.Literal(source))
        )


def _fill(conn: psycopg.Connection) -> None:
    surface, vertices = example_surface()
    tunnel_id = conn.execute(
        "INSERT INTO tunnel.tunnel (name, srid, start_chainage, spacing, alignment) "
        "VALUES ('demo', %s, %s, %s, ST_GeomFromWKB(%s, %s)) RETURNING id",
        (SRID, FIRST * SPACING, SPACING, shapely.to_wkb(shapely.LineString(vertices)), SRID),
    ).fetchone()[0]
    conn.execute(
        "INSERT INTO tunnel.alignment_element (tunnel_id, plane, n, kind, chainage, length, x, y, bearing, curvature_from, "
        "curvature_to, z, grade_from, grade_to) VALUES "
        "(%(id)s, 'horizontal', 1, 'arc', 12300, 200, 500000, 4640000, pi() / 2, -1 / 300.0, -1 / 300.0, NULL, NULL, NULL), "
        "(%(id)s, 'vertical', 1, 'grade', 12300, 200, NULL, NULL, NULL, NULL, NULL, 600, 0.02, 0.02)",
        {"id": tunnel_id},
    )
    survey_id = conn.execute(
        "INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_dimension, intensity_kind, platform, reference) "
        "VALUES (%s, %s, '2024-05-04', 'Amplitude', 'amplitude', 'static', 'auto') RETURNING id",
        (tunnel_id, NAME),
    ).fetchone()[0]
    _files_and_runs(conn, survey_id)
    _axis(conn, survey_id, vertices)
    _segments(conn, survey_id, surface)
    _sections(conn, survey_id, surface)
    outlines = _anomalies(conn, survey_id, surface)
    _coverage(conn, survey_id)
    _detectability(conn, survey_id)
    _images(conn, survey_id, surface, outlines)
    _ground(conn, survey_id, surface)
    _things(conn, survey_id, surface)
    add_deviation(conn, survey_id)
    add_clearance(conn, survey_id)
    add_rating(conn, survey_id)
    add_action(conn, survey_id)
    add_alarms(conn, survey_id)
    add_rings(conn, survey_id)
    conn.execute(  # through the view, so that the audit has a row
        "INSERT INTO tunnel_api.region (survey_id, kind, geom) VALUES (%s, 'dry', ST_MakeEnvelope(12410, -3, 12414, 0, 0))",
        (survey_id,),
    )
    conn.execute(
        "INSERT INTO tunnel.radiometry (survey_id, km, roughness, dry_mean, dry_sigma, threshold, regions, pixels, wet_pixels) "
        "VALUES (%s, %s, 24, -12, 0.6, -13.8, 9, 1000000, 7000)",
        (survey_id, KM),
    )
    conn.execute(
        "INSERT INTO tunnel.range_curve (survey_id, km, range_m, intensity_db, sigma_db) "
        "VALUES (%s, %s, '{2,4,8,16}', '{-1,-3,-8,-14}', '{0.2,0.1,0.1,0.3}')",
        (survey_id, KM),
    )


def example_surface() -> tuple[Surface, np.ndarray]:
    """A circular tunnel of 4 m radius with a floor 2.5 m below its axis, R = 300 m, 2 % up."""
    chainage = np.arange(FIRST, LAST + 1) * SPACING
    azimuth = (chainage - chainage[0]) / 300.0
    vertices = np.column_stack([
        500_000 + 300 * (1 - np.cos(azimuth)),
        4_640_000 + 300 * np.sin(azimuth),
        600 + 0.02 * (chainage - chainage[0]),
    ])  # fmt: skip
    rows = segment_rows(vertices, tangents(vertices))
    ends = np.column_stack([chainage[:-1], chainage[1:]])
    sections = np.sort(np.concatenate([chainage[:-1] + 2.5, chainage[:-1] + 7.5]))
    angle = np.radians(np.arange(361) - 180.0)
    below = np.where(np.cos(angle) < -1e-9, -2.5 / np.minimum(np.cos(angle), -1e-9), np.inf)
    radius = np.minimum(4.0, below)
    u, w = radius * np.sin(angle), radius * np.cos(angle)
    length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(u), np.diff(w)))])
    arc = length - length[180]
    count = len(sections)
    surface = Surface(
        np.arange(FIRST, LAST), rows, ends, sections, np.tile(radius, (count, 1)), np.tile(arc, (count, 1)), SPACING
    )
    return surface, vertices


def _files_and_runs(conn: psycopg.Connection, survey_id: int) -> None:
    conn.execute(
        "INSERT INTO tunnel.scan_file (survey_id, name, path, checksum, bytes, points, noise, outside, thinned, kept, "
        "chainage_from, chainage_to, loaded_at) VALUES "
        "(%s, 'demo.laz', '/scans/demo.laz', repeat('0', 64), 1000, 100, 1, 2, 37, 60, 12300, 12500, '2024-05-05 08:00Z')",
        (survey_id,),
    )
    for hour, stage in enumerate(["load", "axis", "segments", "sections", "ground", "detect"], start=8):
        conn.execute(
            "INSERT INTO tunnel.run (survey_id, km, stage, started_at, finished_at, outcome) "
            "VALUES (%s, %s, %s, make_timestamptz(2024, 5, 5, %s, 0, 0, 'UTC'), "
            "make_timestamptz(2024, 5, 5, %s, 30, 0, 'UTC'), 'done')",
            (survey_id, KM, stage, hour, hour),
        )


def _axis(conn: psycopg.Connection, survey_id: int, vertices: np.ndarray) -> None:
    for n, vertex in enumerate(vertices, start=FIRST):
        interpolated = n in (1241, 1242)
        conn.execute(
            "INSERT INTO tunnel.axis_vertex (survey_id, n, km, geom, given, points, source) "
            "VALUES (%(survey)s, %(n)s, %(km)s, ST_GeomFromWKB(%(wkb)s, %(srid)s), ST_GeomFromWKB(%(wkb)s, %(srid)s), "
            "%(points)s, %(source)s)",
            {
                "survey": survey_id, "n": n, "km": KM, "wkb": shapely.to_wkb(shapely.Point(vertex)), "srid": SRID,
                "points": 0 if interpolated else 5000, "source": "interpolated" if interpolated else "measured",
            },
        )  # fmt: skip


def _segments(conn: psycopg.Connection, survey_id: int, surface: Surface) -> None:
    for n, row, (start, end) in zip(surface.number, surface.segments, surface.ends, strict=True):
        line = frames_at(row[None], np.zeros(5, int), np.linspace(0.0, 1.0, 5))[:, 0]
        conn.execute(
            "INSERT INTO tunnel.segment (survey_id, n, km, chainage_from, chainage_to, vertex_from, vertex_to, "
            "tangent_from, tangent_to, geom, points) "
            "VALUES (%s, %s, %s, %s, %s, %s, %s, %s, %s, ST_GeomFromWKB(%s, %s), 2500)",
            (
                survey_id, int(n), KM, float(start), float(end), *(row[i : i + 3].tolist() for i in (0, 3, 6, 9)),
                shapely.to_wkb(shapely.LineString(line)), SRID,
            ),
        )  # fmt: skip


def _sections(conn: psycopg.Connection, survey_id: int, surface: Surface) -> None:
    for k, chainage in enumerate(surface.chainages):
        arc = surface.arcs[k]
        ring = surface.to_space(np.full(361, chainage), arc, np.zeros(361))
        conn.execute(
            "INSERT INTO tunnel.section (survey_id, km, segment, half, chainage, half_width, angle_step, radius, arc, "
            "geom, points, interpolated) VALUES (%s, %s, %s, %s, %s, 0.5, 5, %s, %s, ST_GeomFromWKB(%s, %s), 900, %s)",
            (
                survey_id, KM, int(surface.number[k // 2]), 25 if k % 2 == 0 else 75, float(chainage),
                surface.radius[k].tolist(), arc.tolist(), shapely.to_wkb(shapely.LineString(ring)), SRID,
                4 if k in (22, 23) else 0,
            ),
        )  # fmt: skip


def _anomalies(conn: psycopg.Connection, survey_id: int, surface: Surface) -> list[Polygon]:
    """Store the leaks, and what is dark but dry; returns all their outlines."""
    rng = np.random.default_rng(1)
    outlines = []
    for number, (chainage, arc, size, review) in enumerate(LEAKS):
        angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
        reach = size * (1 + 0.35 * rng.standard_normal(24).cumsum() / 5)
        outlines.append(
            Polygon(np.column_stack([chainage + 1.4 * reach * np.cos(angle), arc + reach * np.sin(angle)])).buffer(0)
        )
        drop = 3.1 + number / 10
        _anomaly(conn, survey_id, surface, outlines[-1], "leak", [], 0.9 - number / 10, drop, review)
    for kind, (outline, reasons) in DRY.items():
        outlines.append(outline)
        _anomaly(conn, survey_id, surface, outline, kind, reasons, 0.8, 2.5, "open")
    return outlines


def _anomaly(
    conn: psycopg.Connection, survey_id: int, surface: Surface, outline: Polygon, kind: str, reasons: list[str],
    confidence: float, drop: float, review: str,
) -> None:  # fmt: skip
    shaped = anomaly_geometries(outline, surface)
    west, south, east, north = outline.bounds
    conn.execute(
        "INSERT INTO tunnel.finding (survey_id, km, chainage_from, chainage_to, arc_from, arc_to, clock, kind, reasons, "
        "confidence, contrast, area, darkening_mean, darkening_max, image_share, unrolled, map, surface,"
        " review) VALUES (%s, %s, %s, %s, "
        "%s, %s, %s, %s, %s, %s, %s, %s, %s, 5, 0.97, "
        "ST_GeomFromWKB(%s, 0), ST_GeomFromWKB(%s, %s), ST_GeomFromWKB(%s, %s), %s)",
        (
            survey_id, KM, west, east, south, north, shaped.clock, kind, reasons, confidence, drop / 0.6, shaped.area, drop,
            shapely.to_wkb(outline), shapely.to_wkb(shaped.map), SRID, shapely.to_wkb(shaped.surface), SRID, review,
        ),
    )  # fmt: skip


def _coverage(conn: psycopg.Connection, survey_id: int) -> None:
    """The lining of steps of 0.1 m, as a kilometre has them that the tunnel fills only in part."""
    start = KM * 1000 + 0.1 * np.arange(10_000) + 0.05
    lining = np.where((start > FIRST * SPACING) & (start < LAST * SPACING), 0.1 * GIRTH, 0.0)
    seen = np.where(start > SEEN_FROM, lining, 0.0)
    wet = np.where((start > WET[0]) & (start < WET[1]), 0.1 * seen, 0.0)
    conn.execute(
        "INSERT INTO tunnel.coverage (survey_id, km, step, lining, seen, wet) VALUES (%s, %s, 0.1, %s, %s, %s)",
        (survey_id, KM, lining.tolist(), seen.tolist(), wet.tolist()),
    )


def _detectability(conn: psycopg.Connection, survey_id: int) -> None:
    """Blocks of 10 m by 3 m: a leak of the demanded size is found from 12330, not before; left of -6 m it is unknown."""
    conn.execute(
        "INSERT INTO tunnel.detectability (survey_id, km, chainage_from, chainage_to, arc_from, arc_to, lining_area, trials, "
        "demand_area, demand_drop, probability, smallest_1_5_db, smallest_3_db, smallest_6_db) "
        "SELECT %s, %s, c, c + 10, a, a + 3, 30, 120, 0.3, 3, "
        "CASE WHEN a < -6 THEN NULL WHEN c < 12330 THEN 0.4 ELSE 0.97 END, NULL, "
        "CASE WHEN a < -6 THEN NULL WHEN c < 12330 THEN 0.9 ELSE 0.2 END, CASE WHEN a < -6 THEN NULL ELSE 0.05 END "
        "FROM generate_series(12310, 12490, 10) c, generate_series(-7.5, 4.5, 3) a",
        (survey_id, KM),
    )


def _images(conn: psycopg.Connection, survey_id: int, surface: Surface, outlines: list[Polygon]) -> None:
    """Lining in bands of shade, darker where it leaks; the floor, with what stands on it, has an offset only."""
    rng = np.random.default_rng(2)
    grid = Grid.covering(KM, PIXEL, *surface.arc_range(12402.5))
    overviews = {kind: Overview(kind) for kind in (*KINDS, "state")}
    for block in range(int(12300 / BLOCK), int(12500 / BLOCK)):
        columns = slice((block - grid.first_block) * grid.block_columns, (block - grid.first_block + 1) * grid.block_columns)
        x, y = np.meshgrid(grid.chainages(columns), grid.arcs())
        wet = np.zeros(x.shape, bool)
        for outline in outlines:
            wet |= shapely.contains_xy(outline, x, y)
        shade = -12 + 0.5 * rng.standard_normal(x.shape) + 0.3 * np.sin(x / 1.2) - 3.5 * wet
        offset = 0.004 * rng.standard_normal(x.shape) + np.where(np.abs(y) < CORNER, relief(x, y), 0.0)
        for thing in THINGS:
            _lay(offset, grid, columns, surface, thing)
        values = {
            "corrected": shade, "raw": shade - 0.08 * (x % 20 - 10) ** 2 / 2, "offset": offset,
            "state": np.where(wet & (np.abs(y) < CORNER), PixelState.DARK, _states(x, y)),
        }  # fmt: skip
        for kind in (*KINDS, "state"):
            held = np.where((np.abs(y) < 9.0) | (kind in ("offset", "state")), values[kind], np.nan).astype(np.float32)
            conn.execute(
                "INSERT INTO tunnel.image (survey_id, km, kind, block, tiff) VALUES (%s, %s, %s, %s, %s)",
                (survey_id, KM, kind, block, encode(Raster(held, grid.transform(columns.start)), kind)),
            )
            overviews[kind].add(Raster(held, grid.transform(columns.start)))
    for overview in overviews.values():
        save_overview(conn, get_survey(conn, NAME), KM, overview)


def without_intensity(conn: psycopg.Connection, every: int = 1) -> None:
    """Make the example a survey without intensity, of whose offset images only every so manyth column holds points."""
    for table in ("finding", "coverage", "detectability", "radiometry", "range_curve"):
        conn.execute(sql.SQL("DELETE FROM tunnel.{}").format(sql.Identifier(table)))
    conn.execute("DELETE FROM tunnel.image WHERE kind <> 'offset'")
    conn.execute("UPDATE tunnel.survey SET intensity_kind = 'none', intensity_dimension = NULL, reference = 'none'")
    thin_images(conn, "offset", every)


def thin_images(conn: psycopg.Connection, kind: str, every: int) -> None:
    """Leave points in every so manyth column of the images of a kind."""
    query = "SELECT block, tiff FROM tunnel.image WHERE kind = %s"
    for block, tiff in conn.execute(query, [kind], binary=True).fetchall():
        image = decode(bytes(tiff))
        number = np.arange(image.values.shape[1]) + block * image.values.shape[1]
        image.values[:, number % every > 0] = np.nan
        tiff = encode(image, kind)
        conn.execute("UPDATE tunnel.image SET tiff = %s WHERE kind = %s AND block = %s", [tiff, kind, block])
    conn.commit()


def _states(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """State of pixels, without the dark ones: a niche on the right, a cable on the left, the floor at both edges."""
    state = np.full(x.shape, PixelState.LINING, float)
    state[x < SEEN_FROM] = PixelState.EMPTY
    state[(x > 12360) & (x < 12362) & (y > 5) & (y < 7)] = PixelState.RECESS
    state[np.abs(y + 6.5) < 0.2] = PixelState.OFF
    state[np.abs(y) > CORNER] = PixelState.FLOOR
    return state


def _ground(conn: psycopg.Connection, survey_id: int, surface: Surface) -> None:
    across = np.arange(-31, 32) * 0.1
    for n in range(int(FIRST * SPACING), int(LAST * SPACING) + 1):
        line = beside(surface, n, across, 0.0)
        conn.execute(
            "INSERT INTO tunnel.ground (survey_id, n, km, across, height, gamma, foot, lean, arc_left, arc_right, geom) "
            "VALUES (%s, %s, %s, %s, %s, 0.05, %s, '{-0.8,0.8}', %s, %s, ST_GeomFromWKB(%s, %s))",
            (
                survey_id, n, KM, float(across[0]), line[:, 2].tolist(), [-HALF_FLOOR, HALF_FLOOR], -CORNER, CORNER,
                shapely.to_wkb(shapely.LineString(line)), SRID,
            ),
        )  # fmt: skip

    columns, rows = np.arange(int(FIRST * SPACING * 4), int(LAST * SPACING * 4)), np.arange(-36, 36)
    middles = np.meshgrid((columns + 0.5) / 4, (rows + 0.5) / 4)
    conn.execute(
        "INSERT INTO tunnel.lining (survey_id, km, cell, box, \"offset\", spread) VALUES (%s, %s, 0.25, %s, %s, %s)",
        (
            survey_id, KM, [int(columns[0]), -36, len(columns), 72], relief(*middles).astype("<f4").tobytes(),
            np.full((72, len(columns)), 0.004, "<f4").tobytes(),
        ),
    )  # fmt: skip


def _lay(offset: np.ndarray, grid: Grid, columns: slice, surface: Surface, thing: tuple[float, ...]) -> None:
    """Let the columns of an offset image show a thing where it lies within half a metre of the surface."""
    if thing[1] + thing[3] / 2 < grid.chainages(columns)[0] or thing[1] - thing[3] / 2 > grid.chainages(columns)[-1]:
        return
    place = surface.unroll(boxed(surface, thing, 0.05))
    row, column = grid.place(place.chainage, place.arc)
    held = (np.abs(place.offset) < 0.5) & (column >= columns.start) & (column < columns.stop)
    np.maximum.at(offset, (row[held], column[held] - columns.start), place.offset[held])


def _things(conn: psycopg.Connection, survey_id: int, surface: Surface) -> None:
    for klass, chainage, across, length, width, low, high in THINGS:
        sides = across + np.array([-width, width]) / 2
        along = np.linspace(chainage - length / 2, chainage + length / 2, max(2, round(length)))
        left, right = (np.array([beside(surface, c, [side], 0.0)[0] for c in along]) for side in sides)
        hull = Polygon(np.concatenate([left, right[::-1]])[:, :2])
        filled = np.unique(np.floor(boxed(surface, (klass, chainage, across, length, width, low, high), 0.05) / 0.1), axis=0)
        conn.execute(
            "INSERT INTO tunnel.cluster (survey_id, km, class, chainage_from, chainage_to, height_from, height_to, points, "
            "cell, cells, geom) VALUES (%s, %s, %s, %s, %s, %s, %s, 250, 0.1, %s, ST_GeomFromWKB(%s, %s))",
            (
                survey_id, KM, int(klass), chainage - length / 2, chainage + length / 2, low, high,
                filled.astype(int).ravel().tolist(), shapely.to_wkb(hull), SRID,
            ),
        )  # fmt: skip
    for number, (chainage, across, height) in enumerate(SPHERES, start=1):
        for scan in (1, 2) if number % 2 else (1,):
            centre = beside(surface, chainage, [across], height)[0] + 0.0002 * scan
            conn.execute(
                "INSERT INTO tunnel.target_sphere (survey_id, km, number, scan_id, chainage, geom, radius, nominal, rms, "
                "sigma, coverage, points) "
                "VALUES (%s, %s, %s, %s, %s, ST_GeomFromWKB(%s, %s), 0.0726, 0.0725, 0.0028, 0.0002, 0.41, 900)",
                (survey_id, KM, number, scan, chainage, shapely.to_wkb(shapely.Point(centre)), SRID),
            )
