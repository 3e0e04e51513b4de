"""Density of cracks by element, from the view ``crack_density``."""

from __future__ import annotations

from typing import Any

import psycopg
from psycopg.rows import dict_row

from tunneldb.errors import UserError
from tunneldb.store.survey import Survey


def read_crack_density(conn: psycopg.Connection[Any], survey: Survey, name: str) -> list[dict[str, Any]]:
    """Return the density of cracks in the elements of a division; raise UserError if there is no such division.

    Lengths are in m, areas in m², densities in m/m², widths in mm.
    """
    rows = (
        conn.cursor(row_factory=dict_row)
        .execute(
            "SELECT d.number, d.name, d.label_from, d.label_to, d.lining_area, d.searched_share, d.cracks, d.crack_length,"
            " d.density, d.longitudinal_length, d.transverse_length, d.oblique_length, d.width_mm"
            " FROM tunnel_api.crack_density d WHERE d.survey_id = %s AND d.element_set = %s ORDER BY d.number",
            [survey.id, name],
        )
        .fetchall()
    )
    if not rows:
        raise UserError(f"tunnel {survey.tunnel} has no elements named {name!r}: tunneldb elements list {survey.tunnel}")
    return rows
