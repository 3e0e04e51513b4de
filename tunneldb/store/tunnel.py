"""A tunnel by its name."""

from __future__ import annotations

from typing import Any

import psycopg

from tunneldb.store.unknown import unknown_tunnel


def get_tunnel(connection: psycopg.Connection[Any], name: str) -> int:
    """Return the key of the tunnel of that name.

    Raises
    ------
    UserError
        If there is none; with the existing ones.
    """
    row = connection.execute("SELECT id FROM tunnel.tunnel WHERE name = %s", [name]).fetchone()
    if row is None:
        raise unknown_tunnel(connection, name)
    return int(row[0])
