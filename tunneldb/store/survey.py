"""Survey, with the data of its tunnel."""

from __future__ import annotations

import datetime as dt
from dataclasses import dataclass
from typing import Any

import psycopg
from psycopg.rows import class_row

from tunneldb.errors import UserError
from tunneldb.store.unknown import unknown_survey

UNPOSED = (
    "scanner positions are unknown: intensity is used as the maker gives it, incidence is not corrected, and lining at too"
    " oblique incidence or too far away counts as inspected; leaks may be missed, and there may be false ones"
)
"""Remark on leaks that were searched for without scanner positions."""


@dataclass(frozen=True)
class Survey:
    """A scanning campaign of a tunnel.

    Attributes
    ----------
    id, name
        Key and name of the survey.
    tunnel_id, tunnel
        Key and name of its tunnel.
    srid
        Spatial reference of the tunnel, projected, metres.
    site
        True for a site, which has no axis, and so no chainage, sections or unrolled lining.
    start_chainage
        Chainage of the given axis's first vertex, m.
    spacing
        Distance between vertices of the axis, m of chainage.
    date
        Day of the scan.
    intensity_dimension
        Dimension of the intensity in the scan files, None if the kind is ``none``.
    intensity_kind
        ``amplitude``, ``reflectance``, ``linear`` or ``none``.
    platform
        ``static`` (stations), ``mobile`` (trajectory), or ``unknown``: range and incidence are not corrected.
    reference
        Range curve: ``none``, ``measured`` on a target, or ``auto``, found on the lining of each kilometre.
    """

    id: int
    name: str
    tunnel_id: int
    tunnel: str
    srid: int
    site: bool
    start_chainage: float
    spacing: float
    date: dt.date
    intensity_dimension: str | None
    intensity_kind: str
    platform: str
    reference: str

    @property
    def note(self) -> str | None:
        """Return a remark on all leaks of the survey, if there is any."""
        return UNPOSED if self.platform == "unknown" and self.intensity_kind != "none" else None


def get_survey(conn: psycopg.Connection[Any], name: str, *, site: bool = False) -> Survey:
    """Return the survey of that name.

    Parameters
    ----------
    site
        True if a site is allowed; else a survey of one is refused, because the command needs an axis.

    Raises
    ------
    UserError
        If there is none, with the existing and the nearest name; or if it is of a site and must not be.
    """
    with conn.cursor(row_factory=class_row(Survey)) as cursor:
        survey = cursor.execute(
            """
            SELECT s.id, s.name, s.tunnel_id, t.name AS tunnel, t.srid, t.alignment IS NULL AS site, t.start_chainage,
                   t.spacing, s.date, s.intensity_dimension, s.intensity_kind, s.platform, s.reference
              FROM tunnel.survey s JOIN tunnel.tunnel t ON t.id = s.tunnel_id
             WHERE s.name = %s
            """,
            [name],
        ).fetchone()
    if survey is None:
        raise unknown_survey(conn, name)
    if survey.site and not site:
        raise UserError(
            f"survey {name} is of the site {survey.tunnel!r}, which has no axis, and this needs one; structures are found"
            f" without: tunneldb members {name}"
        )
    return survey
