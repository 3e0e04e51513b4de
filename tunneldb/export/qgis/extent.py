"""Initial extent of each map theme."""

from __future__ import annotations

from dataclasses import dataclass

import psycopg

from tunneldb.errors import NotReadyError
from tunneldb.stages.run import nothing_yet
from tunneldb.store.survey import Survey

MARGIN = 0.08
"""Margin around the extent, as a share of its size."""

WINDOW = 60.0
"""Minimum length of tunnel in the initial unrolled theme, m."""

PANEL = 3.5
"""Width of the panel relative to its height: a narrower extent would be widened beyond the end of the tunnel."""


MEMBERS_SHOWN = 6
"""Number of members in the initial theme Faces."""


@dataclass(frozen=True)
class Extent:
    """A rectangle, m."""

    xmin: float
    ymin: float
    xmax: float
    ymax: float

    def grown(self) -> Extent:
        """Return it with a margin all around."""
        margin = MARGIN * max(self.xmax - self.xmin, self.ymax - self.ymin)
        return Extent(self.xmin - margin, self.ymin - margin, self.xmax + margin, self.ymax + margin)

    def wkt(self) -> str:
        """Return it as a WKT polygon."""
        return (
            f"POLYGON(({self.xmin} {self.ymin}, {self.xmax} {self.ymin}, {self.xmax} {self.ymax}, "
            f"{self.xmin} {self.ymax}, {self.xmin} {self.ymin}))"
        )


@dataclass(frozen=True)
class View:
    """A place to start from.

    Attributes
    ----------
    name : str
        Name in the list of bookmarks.
    theme : str
        Map theme that it belongs to.
    extent : Extent
        In the tunnel's SRID or in the unrolled plane, m.
    """

    name: str
    theme: str
    extent: Extent


def map_extent(conn: psycopg.Connection, survey: Survey) -> Extent:
    """Return the extent of a survey's axis, of the leaks beside it and of the faces of structures, with a margin.

    Raises
    ------
    UserError
        If the survey has neither an axis nor faces yet.
    """
    row = conn.execute(
        "SELECT ST_XMin(e), ST_YMin(e), ST_XMax(e), ST_YMax(e) FROM (SELECT ST_Extent(g) AS e FROM ("
        "SELECT geom AS g FROM tunnel_api.axis_vertex WHERE survey = %(survey)s "
        "UNION ALL SELECT geom FROM tunnel_api.leak_map WHERE survey = %(survey)s "
        "UNION ALL SELECT geom FROM tunnel_api.face WHERE survey = %(survey)s) a) b WHERE e IS NOT NULL",
        {"survey": survey.name},
    ).fetchone()
    if row is None and survey.site:
        raise NotReadyError(f"no members were found in survey {survey.name} yet: tunneldb members {survey.name}")
    if row is None:
        raise nothing_yet(conn, survey, "has no axis")
    return Extent(*row).grown()


def unrolled_extents(conn: psycopg.Connection, survey: str) -> list[tuple[int, Extent]]:
    """Return km and extent of the unrolled lining of each kilometre that has sections, in order."""
    rows = conn.execute(
        "SELECT km, min(chainage), min(arc_from), max(chainage), max(arc_to) FROM tunnel_api.section_unrolled "
        "WHERE survey = %s GROUP BY km ORDER BY km",
        (survey,),
    ).fetchall()
    return [(km, Extent(*bounds)) for km, *bounds in rows]


def sheet_extent(conn: psycopg.Connection, survey: str) -> Extent | None:
    """Return the first sheet of a survey, None if it has no sections; all of its sheets are alike in size."""
    row = conn.execute(
        "SELECT ST_XMin(geom), ST_YMin(geom), ST_XMax(geom), ST_YMax(geom) FROM tunnel_api.sheet "
        "WHERE survey = %s ORDER BY number LIMIT 1",
        (survey,),
    ).fetchone()
    return None if row is None else Extent(*row)


def first_members(conn: psycopg.Connection, survey: str) -> Extent | None:
    """Return the drawing places of the largest members of a survey, MEMBERS_SHOWN at most; None if it has none."""
    row = conn.execute(
        "SELECT ST_XMin(e), ST_YMin(e), ST_XMax(e), ST_YMax(e) FROM (SELECT ST_Extent(g.geom) AS e FROM ("
        "SELECT geom FROM tunnel_api.member_sheet WHERE survey = %s ORDER BY number LIMIT %s) g) b WHERE e IS NOT NULL",
        (survey, MEMBERS_SHOWN),
    ).fetchone()
    return None if row is None else Extent(*row)


def largest_leak(conn: psycopg.Connection, survey: str) -> float | None:
    """Return the chainage of a survey's largest leak, m, None if it has none."""
    row = conn.execute(
        "SELECT (chainage_from + chainage_to) / 2 FROM tunnel_api.leak WHERE survey = %s ORDER BY area DESC, id LIMIT 1",
        (survey,),
    ).fetchone()
    return None if row is None else row[0]


def first_window(conn: psycopg.Connection, survey: str, kilometres: list[tuple[int, Extent]]) -> Extent:
    """Return a stretch of lining in which one can see something: around the largest leak, or at the start.

    Parameters
    ----------
    conn : psycopg.Connection
        The database.
    survey : str
        Name of the survey.
    kilometres : list of (int, Extent)
        From :func:`unrolled_extents`, at least one.
    """
    leak = largest_leak(conn, survey)
    low, high = kilometres[0][1].xmin, kilometres[-1][1].xmax
    bottom, top = min(extent.ymin for _, extent in kilometres), max(extent.ymax for _, extent in kilometres)
    length = max(WINDOW, PANEL * (top - bottom))
    middle = low + length / 2 if leak is None else leak
    start = max(low, min(middle - length / 2, high - length))
    return Extent(start, bottom, min(start + length, high), top).grown()
