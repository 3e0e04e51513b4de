"""`tunneldb init`."""

from __future__ import annotations

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command, notify
from tunneldb.cli.progress import bar, step, tell_warnings
from tunneldb.counted import counted
from tunneldb.database import open_connection
from tunneldb.database.foreign import catalogue_alone
from tunneldb.database.schema import QUERY_TIMEOUT, close_database, install, limit_queries, schema_revision
from tunneldb.stages.registry import REGISTRY
from tunneldb.store.waterproof import keep_missing


@command(examples=["tunneldb init", 'tunneldb --dsn "host=gis.example.org dbname=tunnels user=anna" init'])
@click.pass_obj
def init(settings: Settings) -> None:
    """Create or upgrade the schema, the functions and the roles.

    Data are kept; schema tunnel_api is recreated. Run it once for a new database, and after each upgrade of tunneldb. Logins
    that have none of the three roles can no longer connect. Queries of other programs end after 10 minutes, unless the database
    has a statement_timeout.

    After an upgrade, statistics of waterproofing are recomputed kilometre by kilometre, each committed, while others
    work. If it is interrupted, views are correct but slower, and the next init continues.
    """
    with open_connection(settings.dsn) as connection:
        with catalogue_alone(connection):
            before = schema_revision(connection)
        connection.rollback()
        tell_warnings(connection)
        install(connection, REGISTRY)
        closed, limited = close_database(connection), limit_queries(connection)
        after = schema_revision(connection)
        connection.rollback()
        change = "created" if before is None else "is up to date" if before == after else f"upgraded from {before}"
        where = "the embedded server" if settings.dsn is None else "the database"
        notify(f"{where}: schema tunnel {change} ({after}), tunnel_api installed")
        if closed:
            notify(
                "logins that have none of the three roles can no longer connect to this database; to allow one:"
                f" GRANT CONNECT ON DATABASE {connection.info.dbname} TO NAME"
            )
        if limited:
            notify(
                f"queries of QGIS, psql and other programs end after {QUERY_TIMEOUT}; for another limit:"
                f" ALTER DATABASE {connection.info.dbname} SET statement_timeout = '1h'"
            )
        with bar("km") as shown:
            kept = keep_missing(connection, step(shown))
    add_to_json(before=before, revision=after, waterproofing=kept)
    if kept:
        notify(f"waterproofing of {counted(kept, 'kilometre')} computed")
