"""Functions of a stretch or of kilometres refuse one that runs backwards: an empty answer would say that nothing is there."""

from __future__ import annotations

from typing import Any

import psycopg
import pytest
from psycopg import sql

VALUES = {"survey_before": "'demo-2024'", "survey": "'demo-2024'", "survey_after": "'demo-2024'", "layer": "'lining'"}
OTHERS = {
    "integer": "1",
    "integer[]": "'{1}'",
    "text[]": "'{load}'",
    "double precision": "1.0",
    "text": "'x'",
    "boolean": "true",
    "geometry": "'POLYGON((12300 0,12500 0,12400 1,12300 0))'",
}


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def calls(conn: psycopg.Connection[Any]) -> dict[str, sql.Composed]:
    """A call of each function with arguments …_from and …_to, the greater first; hours of a clock may go over 12."""
    rows = conn.execute(
        "SELECT p.pronamespace::regnamespace::text, p.proname, p.proargnames[:p.pronargs],"
        " array_agg(format_type(t.oid, NULL) ORDER BY t.n)"
        "  FROM pg_proc p CROSS JOIN unnest(p.proargtypes) WITH ORDINALITY AS t (oid, n)"
        " WHERE p.pronamespace = ANY (ARRAY['tunnel_api', 'tunnel_internal']::regnamespace[]) GROUP BY p.oid"
    ).fetchall()
    found = {}
    for schema, name, arguments, types in rows:
        ends = [a for a in arguments or [] if a.endswith(("_from", "_to"))]
        if len(ends) != 2 or "clock_from" in ends or name == "area_between":  # a part of what was clamped has no part: 0
            continue
        texts = {
            argument: "12500" if argument.endswith("_from") else "12300"
            if argument.endswith("_to") else VALUES.get(argument, OTHERS[type_])
            for argument, type_ in zip(arguments, types, strict=True)
        }  # fmt: skip
        pairs = [sql.SQL("{} => {}").format(sql.Identifier(a), sql.SQL(text)) for a, text in texts.items()]
        found[f"{name}({', '.join(types)})"] = sql.SQL("SELECT * FROM {}({})").format(
            sql.Identifier(schema, name), sql.SQL(", ").join(pairs)
        )
    return found


def test_every_function_refuses_a_backward_stretch(conn: psycopg.Connection[Any]) -> None:
    wanted = calls(conn)
    assert {"coverage", "leak_statistics", "coverage_gaps", "stage_state", "queue_plan", "ring_statistics"} <= {
        call.partition("(")[0] for call in wanted
    }
    for name, call in wanted.items():
        with (
            pytest.raises(psycopg.errors.InvalidParameterValue, match=r"from 12500 to 12300 k?m runs backwards"),
            conn.transaction(),
        ):
            conn.execute(call)
            pytest.fail(name)


def test_what_is_no_number_is_no_stretch(conn: psycopg.Connection[Any]) -> None:
    with pytest.raises(psycopg.errors.InvalidParameterValue, match="from 0 to NaN m is no stretch"):
        conn.execute("SELECT tunnel_api.wet_area('demo-2024', 0, 'NaN')")
