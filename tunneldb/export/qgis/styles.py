"""Styles of the layers: files in QGIS' own form, and their copies in ``public.layer_styles``."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from importlib import resources
from itertools import chain

import psycopg

from tunneldb.errors import UserError
from tunneldb.export.qgis.layer import (
    CHANGE_LAYERS,
    CLEARANCE_LAYERS,
    DEVIATION_LAYERS,
    LAYERS,
    RATING_LAYERS,
    RING_LAYERS,
    SCANNER_LAYERS,
    STRUCTURE_LAYERS,
    UNDERWATER_LAYERS,
)

STYLE_NAME = "tunneldb"


def style_text(name: str) -> str:
    """Return the text of a style file."""
    return (resources.files(__package__) / "style" / f"{name}.qml").read_text(encoding="utf-8")


def style_elements(name: str) -> list[ET.Element]:
    """Return the elements of a style file, as within a layer of a project."""
    return list(ET.fromstring(style_text(name)))


def require_table(conn: psycopg.Connection, name: str) -> None:
    """Raise UserError if a table that QGIS reads is missing."""
    exists = conn.execute("SELECT to_regclass(%s) IS NOT NULL", [name]).fetchone()
    if exists is None or not exists[0]:
        raise UserError(f'the table {name} is missing: run "tunneldb init" as the database\'s owner')


def store_styles(conn: psycopg.Connection) -> int:
    """Store each layer's style in ``public.layer_styles`` as its default; a rerun replaces only styles of tunneldb.

    The schemas of typed layers (``tunnel_api.layer_schemas``) get those of their layers as well.

    Parameters
    ----------
    conn : psycopg.Connection
        Connection whose transaction this joins.

    Returns
    -------
    int
        Number of styles stored for tunnel_api.

    Raises
    ------
    UserError
        The table is missing.
    """
    require_table(conn, "public.layer_styles")
    schemas = [row[0] for row in conn.execute("SELECT schema FROM tunnel_api.layer_schemas()")]
    layers = {row[0] for row in conn.execute("SELECT layer FROM tunnel_api.layer_types()")}
    for view, column, style, title in styled_columns():
        text = style_text(style)
        for schema in ("tunnel_api", *(schemas if column == "geom" and view in layers else ())):
            _store_style(
                conn, {"schema": schema, "view": view, "column": column, "name": STYLE_NAME, "qml": text, "title": title}
            )
    return len(styled_columns())


def _store_style(conn: psycopg.Connection, style: dict[str, str]) -> None:
    conn.execute(
        "DELETE FROM public.layer_styles WHERE f_table_catalog = current_database() "
        "AND f_table_schema = %(schema)s AND f_table_name = %(view)s AND f_geometry_column = %(column)s "
        "AND stylename = %(name)s",
        style,
    )
    conn.execute(
        "UPDATE public.layer_styles SET useasdefault = false WHERE f_table_catalog = current_database() "
        "AND f_table_schema = %(schema)s AND f_table_name = %(view)s AND f_geometry_column = %(column)s",
        style,
    )
    conn.execute(
        "INSERT INTO public.layer_styles (f_table_catalog, f_table_schema, f_table_name, f_geometry_column, "
        "stylename, styleqml, useasdefault, description, owner) "
        "VALUES (current_database(), %(schema)s, %(view)s, %(column)s, %(name)s, "
        "xmlparse(DOCUMENT %(qml)s), true, %(title)s, current_user)",
        style,
    )


def styled_columns() -> list[tuple[str, str, str, str]]:
    """Return view, geometry column, style and title of everything with a style; some views have several geometries.

    If a view is in a project twice, the layer of its own name has the style.
    """
    return [
        (layer.view, layer.column, layer.style, layer.title)
        for layer in chain(
            LAYERS,
            SCANNER_LAYERS,
            STRUCTURE_LAYERS,
            UNDERWATER_LAYERS,
            CLEARANCE_LAYERS,
            RING_LAYERS,
            RATING_LAYERS,
            DEVIATION_LAYERS,
            CHANGE_LAYERS,
        )
        if layer.id == layer.view
    ] + [
        ("leak", "unrolled", "leak", "Leaks, unrolled"),
        ("leak", "map", "leak", "Leaks beside the axis"),
        ("leak", "surface", "leak_3d", "Leaks in space"),
        ("spot", "map", "spot", "Spots on the map"),
        ("spot", "surface", "spot_3d", "Spots in space"),
        ("spot_face", "geom", "spot", "Spots, each in its face's own plane"),
    ]
