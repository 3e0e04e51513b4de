"""What each role can write through the views and pass to the functions of tunnel_api, and extreme values for it, by type."""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass

import psycopg

SURVEY = "demo-2024"
SRID = 25830

Column = tuple[str, str, str, bool, bool]
"""View, column, type, and whether the role may update it, and insert into it."""

Function = tuple[str, list[str]]
"""Name, and types of the arguments."""

WRITABLE = """
SELECT c.relname, a.attname, format_type(a.atttypid, NULL), has_column_privilege(%(role)s, c.oid, a.attnum, 'UPDATE'),
       has_column_privilege(%(role)s, c.oid, a.attnum, 'INSERT')
  FROM pg_class c JOIN pg_attribute a ON a.attrelid = c.oid AND a.attnum > 0
 WHERE c.relnamespace = 'tunnel_api'::regnamespace AND c.relkind = 'v'
   AND has_any_column_privilege(%(role)s, c.oid, 'UPDATE') AND has_column_privilege(%(role)s, c.oid, a.attnum, 'UPDATE, INSERT')
 ORDER BY 1, 2
"""

CALLABLE = """
SELECT p.proname, p.proargtypes::regtype[]::text[]
  FROM pg_proc p
 WHERE p.pronamespace = 'tunnel_api'::regnamespace AND p.prokind = 'f' AND p.pronargs > 0
   AND has_function_privilege(%(role)s, p.oid, 'EXECUTE')
 ORDER BY 1, p.oid
"""

NUMBERS = ["1e300", "1e154", "NaN", "Infinity", "-Infinity", "-1"]
FAR = ["1e300", "1e154", "1e17", "NaN", "Infinity", "-Infinity"]
EMPTY = ["POINT EMPTY", "LINESTRING EMPTY", "POLYGON EMPTY", "GEOMETRYCOLLECTION EMPTY", "POLYHEDRALSURFACE Z EMPTY"]
CURVED = ["CIRCULARSTRING(12350 0, 12351 1, 12352 0)", "CURVEPOLYGON(CIRCULARSTRING(0 0, 1 1, 2 0, 1 -1, 0 0))"]
VERTICES = 20_001

REFUSED = {
    "geometry": [
        *(f"ST_MakePoint('{v}', '{v}', '{v}')" for v in FAR),
        *(f"ST_MakeLine(ST_MakePoint(12350, 1, 600), ST_MakePoint('{v}', 1, 600))" for v in FAR),
        *(
            f"ST_MakePolygon(ST_MakeLine(ARRAY[{{p}}, ST_MakePoint(12351, 1, 0), ST_MakePoint('{v}', 2, 0), {{p}}]))".format(
                p="ST_MakePoint(12350, 1, 0)"
            )
            for v in FAR
        ),
        *(f"'{wkt}'::geometry" for wkt in (*EMPTY, *CURVED)),
        f"(SELECT ST_MakeLine(ST_MakePoint(12350 + i / 1e5, sin(i), 600) ORDER BY i) FROM generate_series(1, {VERTICES}) i)",
        f"ST_Buffer('POINT(12350 1)', 0.5, {VERTICES // 4})",
        "NULL",
    ],
    "double precision": [f"'{v}'" for v in NUMBERS],
    "smallint": ["32767", "-1", "0"],
    "text": ["repeat('x', 1000000)"],
    "text[]": ["'{}'", "NULL", "array_fill('polygon'::text, ARRAY[100000])"],
    "integer": ["2147483648", "'NaN'::float8", "NULL"],
    "bigint": ["9223372036854775808", "-1"],
    "boolean": ["NULL"],
}
"""Values that no column takes, by type."""

HARMLESS = {"text": ["''", r"E'a\nb\tc'", r"E'\x1b[31m'", "'=1+1'"], "integer": ["2147483647"], "double precision": ["NULL"]}
"""Values that a column may take."""

ARGUMENTS = {
    "text": [f"'{SURVEY}'", "'demo'", f"'{SURVEY}'", "repeat('9', 100000)"],
    "integer": ["1", "2147483647"],
    "bigint": ["1", "9223372036854775807"],
    "bytea": [r"'\xffd8ff'", "sha256('a')", r"'\xffd8ff' || convert_to(repeat('x', 31000000), 'UTF8')"],
    "double precision": ["12345", "'1e300'", "'NaN'", "'Infinity'", "'-Infinity'", "1e-300", "-1"],
    "double precision[]": ["array_fill('12345'::float8, ARRAY[100000])"],
    "geometry": ["ST_MakeLine(ST_MakePoint(0, 0, 0), ST_MakePoint(1e7, 0, 0))", "ST_MakePoint(1e300, 1e300, 1e300)"],
    "boolean": ["true", "false"],
    "timestamp with time zone": ["now()", "'infinity'", "'-infinity'", "'2001-01-01'"],
    "integer[]": ["'{1,2}'", "array_fill(240, ARRAY[100000])"],
}
"""Extreme arguments of functions, by type."""

FREE = "ST_SetSRID('POLYGON((12350 0.5,12350.2 0.5,12350.2 0.7,12350 0.5))'::geometry, 0)"
ROWS = {
    "region": {"survey": f"'{SURVEY}'", "kind": "'dry'", "geom": FREE},
    "finding_photo": {"finding_id": "1", "path": "'a.jpg'"},
    "action": {"survey": f"'{SURVEY}'", "chainage_from": "12310", "chainage_to": "12320", "measure": "'seal'"},
    "finding_kind": {
        "code": "'a' || floor(1e9 * random())::bigint", "label": "'a'", "geometries": "'{polygon}'", "position": "1",
        "wet": "false", "active": "true",
    },
}  # fmt: skip
"""Rows that are inserted with one value instead."""


def drawn(view: str) -> dict[str, str]:
    """Row of a view of findings."""
    return {"survey": f"'{SURVEY}'", "kind": "'leak'", "geom": f"(SELECT geom FROM tunnel_api.{view} WHERE id = 7)"}


def statements(view: str, column: str, value: str, update: bool, insert: bool) -> list[str]:
    """Statements that write a value into a column."""
    found = []
    if update:
        found.append(
            f"UPDATE tunnel_api.{view} SET {column} = {value} WHERE {'code' if view == 'finding_kind' else 'id'}"
            f" = (SELECT min({'code' if view == 'finding_kind' else 'id'}) FROM tunnel_api.{view})"
        )
    row = ROWS.get(view) or (drawn(view) if view.startswith(("finding_", "leak_")) else None)
    if insert and row is not None and (update or column in row):
        given = row | {column: value}
        found.append(f"INSERT INTO tunnel_api.{view} ({', '.join(given)}) VALUES ({', '.join(given.values())})")
    return found


def placed(view: str, value: str, srid: int = SRID) -> str:
    """Return a geometry in the coordinate system of a view."""
    return f"ST_SetSRID({value}, {0 if 'unrolled' in view or view == 'region' else srid})"


@dataclass(frozen=True)
class Rights:
    """What a person can write and call."""

    login: str
    columns: Sequence[Column]
    functions: Sequence[Function]


def read_rights(dsn: str, people: dict[str, str]) -> list[Rights]:
    """Read the rights of people, given with their roles."""
    with psycopg.connect(dsn) as conn:
        return [
            Rights(login, *(conn.execute(query, {"role": role}).fetchall() for query in (WRITABLE, CALLABLE)))
            for login, role in people.items()
        ]


def make_write(chance: random.Random, rights: Sequence[Rights]) -> tuple[str, str]:
    """Return somebody's login, and a statement that writes an extreme value through a view."""
    every = [one for one in rights if one.columns]
    whose = chance.choice(every)
    view, column, kind, update, insert = chance.choice(whose.columns)
    # one in ten by somebody else, who may have no right
    login = whose.login if chance.random() < 0.9 else chance.choice(rights).login
    value = _value(chance, kind)
    if kind == "geometry" and value != "NULL":
        value = placed(view, value, chance.choice((SRID, SRID, SRID, 4326, 0)))
    made = statements(view, column, value, update, insert)
    return login, chance.choice(made) if made else f"UPDATE tunnel_api.{view} SET {column} = {value}"


def make_call(chance: random.Random, rights: Sequence[Rights]) -> tuple[str, str]:
    """Return somebody's login, and a call of a function with extreme arguments."""
    whose = chance.choice(rights)
    name, kinds = chance.choice(whose.functions)
    values = [chance.choice((*ARGUMENTS.get(kind, ()), *(_value(chance, kind),) * 2)) for kind in kinds]
    given = ", ".join(f"({value})::{kind}" for value, kind in zip(values, kinds, strict=True))
    return whose.login, f"SELECT count(*) FROM tunnel_api.{name}({given}) q"


def _value(chance: random.Random, kind: str) -> str:
    """Return a value of a type: one of those that are listed, or an arbitrary one."""
    listed = [*REFUSED.get(kind, ()), *HARMLESS.get(kind, ())]
    if kind == "geometry" and chance.random() < 0.7:
        return _shape(chance)
    if kind == "double precision[]":
        return f"array_fill(({_number(chance)})::float8, ARRAY[{chance.choice((0, 1, 2, 3, 1000))}])"
    if kind in ("double precision", "real", "numeric") and chance.random() < 0.7:
        return _number(chance)
    if kind in ("integer", "bigint", "smallint") and chance.random() < 0.7:
        return str(chance.choice((-1, 1)) * (1 << chance.randrange(0, 63)) - chance.randrange(2))
    if kind == "text" and chance.random() < 0.7:
        return chance.choice((_word(chance), f"repeat({_word(chance)}, {10 ** chance.randrange(1, 7)})"))
    return chance.choice(listed) if listed else "NULL"


def _number(chance: random.Random) -> str:
    return f"'{chance.choice((-1, 1)) * 10.0 ** chance.uniform(-320, 308)!r}'"


def _word(chance: random.Random) -> str:
    """Return a text of arbitrary characters as a literal."""
    codes = [chance.choice((chance.randrange(1, 128), chance.randrange(0x80, 0xD800))) for _ in range(chance.randrange(1, 9))]
    return "U&'" + "".join(f"\\{code:04X}" for code in codes) + "'"


_MAP = "ST_Force3D(ST_Centroid((SELECT geom FROM tunnel_api.leak_map WHERE id = 7)))"


def _shape(chance: random.Random) -> str:
    """Return a geometry near a leak, on the map or unrolled, with some vertices far away or close together."""
    origin = chance.choice(("ST_MakePoint(12350, 1, 600)", _MAP))
    moved = [
        f"ST_Translate({origin}, {', '.join(_offset(chance) for _ in range(3))})" for _ in range(chance.choice((1, 3, 5, 40)))
    ]
    line = f"ST_MakeLine(ARRAY[{', '.join(moved)}])"
    polygon = f"ST_MakePolygon(ST_AddPoint({line}, {moved[0]}))" if len(moved) > 2 else moved[0]
    return chance.choice(
        (
            moved[0],
            f"ST_Force2D({moved[0]})",
            line,
            f"ST_Force2D({line})",
            polygon,
            f"ST_Force2D({polygon})",
            f"ST_Multi(ST_Force2D({polygon}))",
            # a radius that is no number ends the server's process in GEOS 3.11, whoever calls ST_Buffer
            f"ST_Buffer({moved[0]}, {abs(chance.gauss(0, 1)):.3f}, {10 ** chance.randrange(5)})",
            f"ST_Collect({moved[0]}, {line})",
        )
    )


def _offset(chance: random.Random) -> str:
    near = f"{chance.gauss(0, 1):.3f}"
    return chance.choice((near, near, near, near, "0", f"'{10.0 ** chance.uniform(-12, 8)!r}'", _number(chance), "'NaN'"))
