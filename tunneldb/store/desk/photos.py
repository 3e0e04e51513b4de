"""Photos of findings that people upload, in the database or in a folder of the desk."""

from __future__ import annotations

import re
from typing import Any

import psycopg

_STORED = re.compile(r"[0-9a-f]{64}\.jpg")


def is_stored(path: str) -> bool:
    """Return True for the path of an uploaded photo: the SHA-256 of its content; others are paths and URLs that people gave."""
    return _STORED.fullmatch(path) is not None


def may_add(conn: psycopg.Connection[Any]) -> bool:
    """Return True if the role of a connection may add photos."""
    row = conn.execute("SELECT has_table_privilege('tunnel_api.finding_photo', 'INSERT')").fetchone()
    return row is not None and bool(row[0])


def photo_path(conn: psycopg.Connection[Any], photo_id: int) -> str | None:
    """Return the path of a photo; None if there is none."""
    row = conn.execute("SELECT p.path FROM tunnel_api.finding_photo p WHERE p.id = %s", [photo_id]).fetchone()
    return None if row is None else str(row[0])


def content(conn: psycopg.Connection[Any], photo_id: int) -> bytes | None:
    """Return a photo that is stored in the database; None if this one is not."""
    row = conn.execute("SELECT tunnel_api.finding_photo_content(%s)", [photo_id], binary=True).fetchone()
    return None if row is None or row[0] is None else bytes(row[0])


def add_content(conn: psycopg.Connection[Any], finding_id: int, photo: bytes, caption: str | None) -> None:
    """Store a photo in the database, and add it to a finding; a photo that the finding has already is not added again."""
    conn.execute("SELECT tunnel_api.finding_photo_add(%s, %b, %s)", [finding_id, photo, caption])


def add_path(conn: psycopg.Connection[Any], finding_id: int, path: str, caption: str | None) -> None:
    """Add a photo by its path to a finding; a photo that the finding has already is not added again."""
    conn.execute(
        "INSERT INTO tunnel_api.finding_photo (finding_id, path, caption) SELECT %(finding)s, %(path)s, %(caption)s"
        " WHERE NOT EXISTS (SELECT FROM tunnel_api.finding_photo p WHERE p.finding_id = %(finding)s AND p.path = %(path)s)",
        {"finding": finding_id, "path": path, "caption": caption},
    )


def write_caption(conn: psycopg.Connection[Any], finding_id: int, photo_id: int, caption: str | None) -> bool:
    """Change the caption of a finding's photo; return False if there is none."""
    done = conn.execute(
        "UPDATE tunnel_api.finding_photo SET caption = %s WHERE id = %s AND finding_id = %s", [caption, photo_id, finding_id]
    )
    return done.rowcount > 0


def delete(conn: psycopg.Connection[Any], finding_id: int, photo_id: int) -> bool:
    """Delete a photo of a finding, not its content; return False if there is none."""
    done = conn.execute("DELETE FROM tunnel_api.finding_photo WHERE id = %s AND finding_id = %s", [photo_id, finding_id])
    return done.rowcount > 0
