"""Database: server, connections, schema and COPY."""

from tunneldb.database.connection import open_connection, resolve_dsn, sqlalchemy_engine
from tunneldb.database.copy import PointZ, copy_binary, pack
from tunneldb.database.resources import resource_dir
from tunneldb.database.schema import install
from tunneldb.database.session import as_of, connect, snapshot

__all__ = [
    "PointZ",
    "as_of",
    "connect",
    "copy_binary",
    "install",
    "open_connection",
    "pack",
    "resolve_dsn",
    "resource_dir",
    "snapshot",
    "sqlalchemy_engine",
]
