"""Map layers as OGC API features: rows of views of ``tunnel_api`` in longitude and latitude."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import psycopg
from psycopg import sql


@dataclass(frozen=True)
class Layer:
    """A view with a geometry on the map.

    Attributes
    ----------
    name, title : str
    geometry : str
        Name of the column.
    columns : tuple of str
        Other columns.
    """

    name: str
    title: str
    geometry: str
    columns: tuple[str, ...]


def layers(conn: psycopg.Connection[Any]) -> dict[str, Layer]:
    """Return the map layers by name."""
    rows = conn.execute(
        "SELECT l.layer, coalesce(obj_description(c.oid, 'pg_class'), l.layer),"
        " (array_agg(a.attname::text ORDER BY a.attnum) FILTER (WHERE t.typname = 'geometry'))[1],"
        " array_agg(a.attname::text ORDER BY a.attnum) FILTER (WHERE t.typname <> 'geometry')"
        " FROM tunnel_api.layer_types() l JOIN pg_class c ON c.oid = to_regclass('tunnel_api.' || quote_ident(l.layer))"
        " JOIN pg_attribute a ON a.attrelid = c.oid AND a.attnum > 0 AND NOT a.attisdropped"
        " JOIN pg_type t ON t.oid = a.atttypid"
        " WHERE NOT l.plane AND l.layer <> 'point' AND has_table_privilege(c.oid, 'SELECT')"
        " GROUP BY l.layer, c.oid ORDER BY l.layer"
    )
    return {name: Layer(name, title, geometry, tuple(columns)) for name, title, geometry, columns in rows if geometry}


def features(
    conn: psycopg.Connection[Any],
    layer: Layer,
    equal: Mapping[str, str],
    box: tuple[float, float, float, float] | None,
    limit: int,
    offset: int,
) -> list[str]:
    """Return features of a layer, each as a text of GeoJSON; those in local coordinates are left out.

    Parameters
    ----------
    equal : mapping
        Values, as text, that columns have.
    box : four floats or None
        West, south, east and north, degrees.
    limit, offset : int
        Number of features, and of those before them.
    """
    shape = sql.SQL("public.ST_Transform(v.{}, 4326)").format(sql.Identifier(layer.geometry))
    conditions = [sql.SQL("public.ST_SRID(v.{}) > 0").format(sql.Identifier(layer.geometry))]
    for name, value in equal.items():
        conditions.append(sql.SQL("v.{}::text = {}").format(sql.Identifier(name), sql.Literal(value)))
    if box is not None:
        frame = sql.SQL("public.ST_MakeEnvelope({}, 4326)").format(sql.SQL(", ").join(map(sql.Literal, box)))
        conditions.append(sql.SQL("public.ST_Intersects(public.ST_Force2D({}), {})").format(shape, frame))
    members = sql.SQL(", ").join(sql.SQL("v.{}").format(sql.Identifier(name)) for name in layer.columns if name != "id")
    rows = conn.execute(
        sql.SQL(
            "SELECT json_build_object('type', 'Feature', 'id', v.id, 'geometry',"
            " public.ST_AsGeoJSON(public.ST_Force2D({}), 8)::json,"
            " 'properties', (SELECT row_to_json(r) FROM (SELECT {}) r))::text FROM tunnel_api.{} v"
            " WHERE {} ORDER BY v.id LIMIT {} OFFSET {}"
        ).format(shape, members, sql.Identifier(layer.name), sql.SQL(" AND ").join(conditions), limit, offset)
    )
    return [text for (text,) in rows]
