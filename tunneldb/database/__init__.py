"""Which server, the connection to it, its schema, and COPY."""

from tunneldb.database.connection import connect, open_connection, resolve_dsn, snapshot, sqlalchemy_engine
from tunneldb.database.copy import PointZ, copy_binary, pack
from tunneldb.database.resources import resource_dir
from tunneldb.database.schema import install
from tunneldb.store.survey import Survey, get_survey

__all__ = [
    "PointZ",
    "Survey",
    "connect",
    "copy_binary",
    "get_survey",
    "install",
    "open_connection",
    "pack",
    "resolve_dsn",
    "resource_dir",
    "snapshot",
    "sqlalchemy_engine",
]
