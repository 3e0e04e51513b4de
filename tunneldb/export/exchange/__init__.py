"""A survey for programs that don't reach the database: GeoPackage and DXF."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import psycopg

from tunneldb.errors import UserError
from tunneldb.progress import StartProgress, silent
from tunneldb.store.surface import load_surface, survey_ends
from tunneldb.store.survey import Survey


def write_survey(
    conn: psycopg.Connection[Any],
    survey: Survey,
    low: float,
    high: float,
    path: Path,
    begin: StartProgress = silent,
) -> dict[str, int]:
    """Write a stretch of a survey in the format of the file's extension, and return the counts of each layer.

    Parameters
    ----------
    conn, survey
        Survey to export.
    low, high : float
        Chainage, m; infinite for the whole survey.
    path : Path
        File that isn't there yet, ``.gpkg`` or ``.dxf``.
    begin : callable
        Called with a text and the number of parts; returns a function that takes the written ones.

    Raises
    ------
    UserError
        The survey has no sections yet, or no axis between the two chainages.
    """
    ends = survey_ends(conn, survey)
    if ends is not None and (ends[0] >= high or ends[1] <= low):
        raise UserError(f"survey {survey.name} has no data there: it extends from chainage {ends[0]:.3f} to {ends[1]:.3f} m")
    held = conn.execute(
        "SELECT bool_or(chainage_to > %s AND chainage_from < %s) FROM tunnel.segment WHERE survey_id = %s",
        [low, high, survey.id],
    ).fetchone()
    if held is not None and held[0] is False:
        raise UserError(
            f"survey {survey.name} has no axis between chainages {low:.3f} and {high:.3f} m: its axis has a gap there"
        )
    surface = load_surface(conn, survey, low, high)
    if path.suffix.lower() == ".gpkg":
        from tunneldb.export.exchange import gpkg

        return gpkg.write_survey_gpkg(conn, survey, surface, low, high, path, begin(survey.name, gpkg.parts()))
    from tunneldb.export.exchange import dxf

    if ends is not None:  # what is drawn ends with the scan, not at the next vertex of the axis
        low, high = max(low, ends[0]), min(high, ends[1])
    return dxf.write_survey_dxf(conn, survey, surface, low, high, path, begin(survey.name, dxf.PARTS))
