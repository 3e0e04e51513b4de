"""A second tunnel beside the example's, for questions over all of an owner's tunnels: its survey of 2025, and an older one."""

from __future__ import annotations

import psycopg

TUNNEL, NEWER, OLDER = "adit", "adit-2025", "adit-2021"
LEAST = 0.5
"""Area of the least of the example's leaks that the newer survey has as well, m²; the older has all of them."""

WORSE = (("new", 0.0, 0.9), ("grown", 1.0, 1.05), ("unseen", 1.5, 0.0))
"""State, and area before and after, of what became of leaks, m²; standard errors are 0.03 and 0.04."""


def _copy(conn: psycopg.Connection, table: str, source: int, target: int, where: str = "true") -> None:
    """Copy a survey's rows of a table to another survey."""
    columns = ", ".join(
        row[0]
        for row in conn.execute(
            "SELECT quote_ident(attname) FROM pg_attribute WHERE attrelid = %s::regclass AND attnum > 0 AND NOT attisdropped"
            " AND attgenerated = '' AND attidentity = '' AND attname <> 'survey_id'",
            [f"tunnel.{table}"],
        )
    )
    conn.execute(
        f"INSERT INTO tunnel.{table} (survey_id, {columns}) SELECT %s, {columns} FROM tunnel.{table}"  # type: ignore[arg-type]
        f" WHERE survey_id = %s AND {where}",
        [target, source],
    )


def add_network(conn: psycopg.Connection, survey: str) -> None:
    """Add it to a copy of the example survey; to be committed or not by the caller."""
    (source,) = conn.execute("SELECT id FROM tunnel.survey WHERE name = %s", [survey]).fetchone()  # type: ignore[misc]
    (tunnel,) = conn.execute(  # type: ignore[misc]
        "INSERT INTO tunnel.tunnel (name, srid, start_chainage, spacing, alignment)"
        " SELECT %s, srid, start_chainage, spacing, alignment FROM tunnel.tunnel WHERE name = 'demo' RETURNING id",
        [TUNNEL],
    ).fetchone()
    keys = {}
    for name, where in ((OLDER, "true"), (NEWER, f"kind = 'leak' AND area >= {LEAST}")):
        (keys[name],) = conn.execute(  # type: ignore[misc]
            "INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_dimension, intensity_kind, platform, reference)"
            " SELECT %s, %s, %s, intensity_dimension, intensity_kind, platform, reference FROM tunnel.survey WHERE id = %s"
            " RETURNING id",
            [tunnel, name, f"{name[-4:]}-05-04", source],
        ).fetchone()
        for table in ("scan_file", "segment", "coverage"):
            _copy(conn, table, source, keys[name])
        _copy(conn, "finding", source, keys[name], where)
    conn.execute(
        "INSERT INTO tunnel.change_section (survey_id, old_survey_id, km, chainage_from, chainage_to, seen_old, seen_new,"
        " seen_both, cell, arc_from, change) SELECT %s, %s, km, chainage_from, chainage_to, seen_old, seen_new, seen_both,"
        " cell, arc_from, change FROM tunnel.change_section WHERE old_survey_id = %s",
        [keys[NEWER], keys[OLDER], source],
    )
    box = "ST_Multi(ST_MakeEnvelope(12310, 0, 12311, 1, %s))"
    for state, before, after in WORSE:
        conn.execute(
            "INSERT INTO tunnel.leak_change (survey_id, old_survey_id, km, state, old_ids, new_ids, old_kinds, new_kinds,"
            " area_old, area_old_se, area_new, area_new_se, seen_old, seen_new, chainage_from, chainage_to, clock,"
            " unrolled, map, surface)"
            " VALUES (%s, %s, 12, %s, '{1}', '{}', '{leak}', '{}', %s, 0.03, %s, 0.04, 1, 1, 12310, 12311, 1,"
            f" {box}, {box}, ST_Force3D({box}))",  # type: ignore[arg-type]
            [keys[NEWER], keys[OLDER], state, before, after, 0, 25830, 25830],
        )
