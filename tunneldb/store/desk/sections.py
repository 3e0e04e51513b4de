"""A cross-section of a survey at any chainage: curve, and points of the survey density beside it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import psycopg

from tunneldb.arrays import Float, Int64

THICKNESS = 0.2
"""Length of tunnel whose points are shown, m."""

MOST_POINTS = 20_000
"""Maximum number of points of a section."""


@dataclass(frozen=True)
class Frame:
    """Plane of a section.

    Attributes
    ----------
    centre : (3,) float array
        Point of the measured axis, in the tunnel's SRID, m.
    across, up : (3,) float array
        Unit vectors to the right, looking up-chainage, and up.
    """

    centre: Float
    across: Float
    up: Float

    def places(self, xyz: Float) -> Float:
        """Return points (n, 3) in the plane, right and up of the axis, (n, 2), m."""
        away = xyz - self.centre
        return np.column_stack([away @ self.across, away @ self.up])


@dataclass(frozen=True)
class Section:
    """A section, looking up-chainage.

    Attributes
    ----------
    frame : Frame
    curve : (361, 2) float array
        Right and up of the axis, m, at each degree from straight below, clockwise.
    points : (n, 2) float array
        Right and up of the axis, m.
    classes : (n,) int array
        Classes of the points.
    """

    frame: Frame
    curve: Float
    points: Float
    classes: Int64


def load_section(conn: psycopg.Connection[Any], survey_id: int, survey: str, chainage: float) -> Section | None:
    """Read the section at a chainage, m; None if no section is near."""
    row = conn.execute("SELECT s.radius, s.arc FROM tunnel_api.section_at(%s, %s) s", [survey_id, chainage]).fetchone()
    if row is None or row[0] is None:
        return None
    radius, arc = np.array(row[0]), np.array(row[1])
    angle = np.radians(np.arange(-180, 181))
    curve = radius[:, None] * np.column_stack([np.sin(angle), np.cos(angle)])
    left, crown, right = (_on_lining(conn, survey_id, chainage, float(arc[node])) for node in (90, 180, 270))
    # The walls at the height of the axis give its place and the direction to the right; the crown, what is up.
    centre = (left * radius[270] + right * radius[90]) / (radius[90] + radius[270])
    frame = Frame(centre, (right - left) / np.linalg.norm(right - left), (crown - centre) / np.linalg.norm(crown - centre))
    rows = conn.execute(
        "SELECT public.ST_X(p.geom), public.ST_Y(p.geom), public.ST_Z(p.geom), coalesce(p.class, 0)"
        " FROM tunnel_api.points(%s, %s, %s) p LIMIT %s",
        [survey, chainage - THICKNESS / 2, chainage + THICKNESS / 2, MOST_POINTS],
    ).fetchall()
    table = np.array(rows, dtype=np.float64).reshape(-1, 4)
    return Section(frame, curve, frame.places(table[:, :3]), table[:, 3].astype(np.int64))


def station_label(conn: psycopg.Connection[Any], tunnel_id: int, chainage: float) -> str:
    """Return the station of a chainage, such as ``12+345.678``."""
    row = conn.execute("SELECT tunnel_api.station_label(%s, %s)", [tunnel_id, chainage]).fetchone()
    return "" if row is None else str(row[0])


def _on_lining(conn: psycopg.Connection[Any], survey_id: int, chainage: float, arc: float) -> Float:
    row = conn.execute(
        "SELECT public.ST_X(g), public.ST_Y(g), public.ST_Z(g) FROM tunnel_api.roll(%s, %s, %s) AS g",
        [survey_id, chainage, arc],
    ).fetchone()
    assert row is not None
    return np.array(row, dtype=np.float64)
