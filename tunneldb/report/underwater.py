"""Chapter on a canal tunnel below the water: sonar scans, the bed, closed sections."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, LiteralString

import numpy as np
import psycopg
import shapely
from psycopg.rows import dict_row

from tunneldb.arrays import Float
from tunneldb.report.drawing import line_path, step_for, ticks
from tunneldb.store.survey import Survey

WIDTH, HEIGHT = 1000.0, 180.0
"""Size of the profile of the bed, in its own unit."""

SECTIONS = 12
"""Maximum number of drawn closed sections, evenly spread."""


@dataclass(frozen=True)
class Profile:
    """The bed along the tunnel, drawn below the water surface at height 0.

    Attributes
    ----------
    range, mean : str
        Paths: from the least to the greatest height of each metre, and the mean height.
    depths, places : list of (float, str)
        Positions of lines of equal depth and ticks of chainage, and their labels.
    """

    range: str
    mean: str
    depths: list[tuple[float, str]]
    places: list[tuple[float, str]]


@dataclass(frozen=True)
class ClosedSection:
    """A closed section: its figures (columns of view ``closed_section``) and the paths of its parts, m, y downwards.

    The parts above and below the water are those of the view ``section_piece``; the water surface itself is not drawn.
    """

    row: dict[str, Any]
    parts: list[tuple[str, str]]
    box: str


@dataclass(frozen=True)
class UnderwaterChapter:
    """Content of the chapter.

    Attributes
    ----------
    scans, ladders, residuals : list of dict
        Columns of the views ``sonar_scan``, ``ladder`` and ``registration_residual``.
    water_level : list of float
        Heights of the water in the stretch, m.
    bed : dict or None
        Area seen and not, depths, volume of the water; None where no sonar saw the bed.
    profile : Profile or None
    sections : list of dict
        Columns of view ``closed_section``.
    drawn : list of ClosedSection
        At most SECTIONS of them.
    """

    scans: list[dict[str, Any]]
    ladders: list[dict[str, Any]]
    residuals: list[dict[str, Any]]
    water_level: list[float]
    bed: dict[str, Any] | None
    profile: Profile | None
    sections: list[dict[str, Any]]
    drawn: list[ClosedSection]

    @property
    def left_out(self) -> list[dict[str, Any]]:
        """Scans that were left out: without a pose, or not loaded with their current pose."""
        return [scan for scan in self.scans if not scan["kept"]]


def read_underwater(conn: psycopg.Connection[Any], survey: Survey, low: float, high: float) -> UnderwaterChapter | None:
    """Read the results of a stretch below the water, m; None if no sonar scan was registered."""
    scans = _rows(
        conn,
        "SELECT v.name, v.state, v.undetermined, v.sigma_x, v.sigma_y, v.sigma_z, v.scale,"
        " sqrt(v.covariance[49]) AS sigma_scale, c.points, c.false_echoes, c.kept, v.registered_at"
        "  FROM tunnel_api.sonar_scan v JOIN tunnel.sonar_scan c ON c.id = v.id WHERE v.survey_id = %s ORDER BY v.name",
        [survey.id],
    )
    if not scans:
        return None
    residuals = _rows(
        conn,
        "SELECT kind, sum(count)::int AS count, max(median) AS median, max(p95) AS p95 FROM tunnel_api.registration_residual"
        " WHERE survey_id = %s GROUP BY kind ORDER BY kind",
        [survey.id],
    )
    ladders = _rows(
        conn,
        "SELECT name, rms, cardinality(rungs) AS rungs, scans FROM tunnel_api.ladder WHERE survey_id = %s ORDER BY name",
        [survey.id],
    )
    levels = conn.execute(
        "SELECT DISTINCT height FROM tunnel_api.water_level WHERE survey_id = %s AND km BETWEEN floor(%s / 1000) AND"
        " floor(%s / 1000) ORDER BY 1",
        [survey.id, low, high],
    ).fetchall()
    sections = _rows(
        conn,
        "SELECT id, chainage, label, water_level, unseen, wet_area, depth FROM tunnel_api.closed_section"
        " WHERE survey_id = %s AND chainage BETWEEN %s AND %s ORDER BY chainage",
        [survey.id, low, high],
    )
    bed, profile = _bed(conn, survey, low, high)
    chosen = sorted({round(place) for place in np.linspace(0, len(sections) - 1, min(SECTIONS, len(sections))).tolist()})
    drawn = [_draw(conn, sections[k]) for k in chosen]
    return UnderwaterChapter(scans, ladders, residuals, [level for (level,) in levels], bed, profile, sections, drawn)


def _bed(
    conn: psycopg.Connection[Any], survey: Survey, low: float, high: float
) -> tuple[dict[str, Any] | None, Profile | None]:
    rows = conn.execute(
        "SELECT n, min(depth), avg(depth), max(depth), sqrt(avg(sigma ^ 2)) FROM tunnel.bed"
        " WHERE survey_id = %s AND n >= floor(%s) AND n < %s GROUP BY n ORDER BY n",
        [survey.id, low, high],
    ).fetchall()
    if not rows:
        return None, None
    metres = np.array(rows, np.float64)
    volume = _rows(conn, "SELECT seen_area, unseen_area FROM tunnel_api.bed_volume(%s, %s, %s, 0.0)", [survey.name, low, high])
    stated = {
        **volume[0], "shallowest": float(metres[:, 1].min()), "mean": float(metres[:, 2].mean()),
        "deepest": float(metres[:, 3].max()), "sigma": float(np.sqrt((metres[:, 4] ** 2).mean())),
        "from": float(metres[0, 0]), "to": float(metres[-1, 0]) + 1.0,
    }  # fmt: skip
    return stated, _draw_profile(metres)


def _draw_profile(metres: Float) -> Profile:
    """Draw the bed of metres (n, 5): chainage, least, mean and greatest depth, and its standard deviation, m."""
    start, end = metres[0, 0], metres[-1, 0] + 1.0
    deep = float(metres[:, 3].max()) * 1.05
    across, down = WIDTH / (end - start), HEIGHT / deep
    pieces = np.split(metres, np.flatnonzero(np.diff(metres[:, 0]) > 1.0) + 1)

    def steps(piece: Float, column: int) -> Float:
        x = np.column_stack([piece[:, 0], piece[:, 0] + 1.0]).ravel()
        return np.column_stack([(x - start) * across, np.repeat(piece[:, column], 2) * down])

    band = "".join(line_path(np.vstack([steps(p, 1), steps(p, 3)[::-1]])) + "Z" for p in pieces)
    step = step_for(end - start, 10)
    return Profile(
        band,
        "".join(line_path(steps(p, 2)) for p in pieces),
        [(depth * down, f"{depth:g} m") for depth in ticks(0.0, deep, step_for(deep * 10.0, 25) / 10.0)[1:]],
        [((x - start) * across, f"{x:.0f}") for x in ticks(start, end, step)],
    )


def _draw(conn: psycopg.Connection[Any], row: dict[str, Any]) -> ClosedSection:
    """Draw a closed section: its parts in its own plane, seen up-chainage."""
    parts = conn.execute(
        "SELECT q.part, q.n, c.radius[q.n], c.radius[q.n + 1] FROM tunnel_internal.section_piece q"
        " JOIN tunnel.section c ON c.id = q.section_id WHERE q.section_id = %s ORDER BY q.n",
        [row["id"]],
    ).fetchall()
    paths: dict[str, list[shapely.LineString]] = {}
    for part, n, here, after in parts:
        angle = np.radians([n - 181.0, n - 180.0])
        ends = np.array([here, after])
        line = shapely.LineString(np.column_stack([ends * np.sin(angle), -ends * np.cos(angle)]))
        paths.setdefault(part, []).append(line)
    merged = {part: shapely.get_parts(shapely.line_merge(shapely.MultiLineString(lines))) for part, lines in paths.items()}
    west, south, east, north = shapely.total_bounds([line for lines in merged.values() for line in lines])
    return ClosedSection(
        row,
        [
            (part, "".join(line_path(np.array(line.simplify(0.01).coords)) for line in lines))
            for part, lines in sorted(merged.items())
        ],
        f"{west - 0.3:.2f} {south - 0.3:.2f} {east - west + 0.6:.2f} {north - south + 0.6:.2f}",
    )


def _rows(conn: psycopg.Connection[Any], query: LiteralString, values: list[Any]) -> list[dict[str, Any]]:
    with conn.cursor(row_factory=dict_row) as cursor:
        return cursor.execute(query, values).fetchall()
