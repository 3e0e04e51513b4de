"""Names of a hub's schemas, and of the objects of each of its servers."""

from __future__ import annotations

import re

from tunneldb.errors import UserError

HUB = "tunnel_hub"
"""Schema of the views over all servers, for users."""

INTERNAL = "tunnel_hub_internal"
"""Schema of the partitioned tables. Their partitions are the foreign tables."""

SHARED = "tunnel_shared"
"""Schema of each server that is imported: the views of tunnel_api with a column ``server``."""

SERVER = "server"
"""Column with the name of a row's server."""

STATE, COMMENTS = "database_state", "view_comment"
"""Views of SHARED about the server itself, which are not shown over all servers."""

_NAME = re.compile(r"[a-z][a-z0-9_]{0,30}")
_PREFIX = "tunnel_server_"


def check_name(name: str) -> str:
    """Return the name of a server if it is valid.

    Raises
    ------
    UserError
        If it is not: names are part of identifiers and of the option that is sent to the server.
    """
    if not _NAME.fullmatch(name):
        raise UserError(
            f"{name!r} is not valid as a name: use a to z, 0 to 9 and _, begin with a letter, at most 31 characters"
        )
    return name


def foreign_server(name: str) -> str:
    """Return the identifier of a server's foreign server, and of the schema of its foreign tables."""
    return _PREFIX + name
