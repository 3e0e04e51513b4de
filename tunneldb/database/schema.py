"""Installation and upgrade: migrations of schema `tunnel`, then schemas `tunnel_api` and `tunnel_internal` from scratch."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import psycopg
from psycopg import sql

from tunneldb import __version__
from tunneldb.database.connection import MINIMUM_POSTGIS, engine_on
from tunneldb.database.foreign import catalogue_alone, overloads
from tunneldb.database.locks import open_transactions
from tunneldb.database.resources import resource_dir
from tunneldb.errors import NotReadyError, UserError

if TYPE_CHECKING:
    import sqlalchemy
    from alembic.config import Config

HEAD = "0001"
"""Newest migration, stated here so that a command need not import Alembic if the database is up to date."""

API_SCHEMAS = ("tunnel_api", "tunnel_internal", "tunnel_shared")
"""Schemas of the SQL files, dropped and installed as a whole: functions for users and QGIS, their helpers, views for a hub."""

_INTERNAL = "Functions and views behind tunnel_api and the program; not to be called by users; created again by tunneldb init"
_SHARED = "Views of tunnel_api for a hub (tunneldb federate); created again by tunneldb init"

_LOCK = 7088630451  # arbitrary number; two installations of one database wait for each other
_LAYERS_LOCK = 7088630452  # the one of tunnel_api.make_layers
_LOCK_TIMEOUT = "30s"  # time to wait for other users of the objects to change


class InputRow(Protocol):
    """Row of tunnel.stage_input, with the table's columns of the same names."""

    @property
    def key(self) -> str: ...  # noqa: D102

    @property
    def holds(self) -> str: ...  # noqa: D102

    @property
    def reason(self) -> str: ...  # noqa: D102


class StageRow(Protocol):
    """Row of tunnel.stage, with the table's columns of the same names."""

    @property
    def name(self) -> str: ...  # noqa: D102

    @property
    def reads(self) -> Sequence[str]: ...  # noqa: D102

    @property
    def reads_beside(self) -> Sequence[str]: ...  # noqa: D102

    @property
    def parameters(self) -> Sequence[str]: ...  # noqa: D102

    @property
    def on_demand(self) -> bool: ...  # noqa: D102

    @property
    def subject(self) -> Sequence[str]: ...  # noqa: D102

    @property
    def tables(self) -> Sequence[str]: ...  # noqa: D102

    @property
    def inputs(self) -> Sequence[InputRow]: ...  # noqa: D102


def install(connection: psycopg.Connection[Any], stages: Sequence[StageRow]) -> None:
    """Create or upgrade everything, in one transaction; current parts stay, tunnel_api and tunnel.stage are created again.

    Parameters
    ----------
    connection
        Idle connection as the database's owner.
    stages
        Stages of a kilometre and measures in order: `tunneldb.stages.registry.REGISTRY`.

    Raises
    ------
    UserError
        If PostGIS is missing and cannot be created, or the database is of another version, newer or unreleased.
    """
    import sqlalchemy

    try:
        _install(connection, stages)
    except (psycopg.errors.LockNotAvailable, sqlalchemy.exc.DBAPIError) as error:
        cause = error.orig if isinstance(error, sqlalchemy.exc.DBAPIError) and error.orig is not None else error
        if not isinstance(cause, psycopg.errors.LockNotAvailable):
            raise cause from None
        connection.rollback()
        holders = open_transactions(connection)
        raise UserError(
            f"other programs have used the database for {_LOCK_TIMEOUT}{': ' if holders else ''}{holders}; "
            "close QGIS, wait for runs, then type tunneldb init"
        ) from None


def _install(connection: psycopg.Connection[Any], stages: Sequence[StageRow]) -> None:
    from alembic import command

    with engine_on(connection).begin() as session:
        connection.execute(sql.SQL("SET LOCAL lock_timeout = {}").format(_LOCK_TIMEOUT))
        with catalogue_alone(connection):
            connection.execute("SELECT pg_advisory_xact_lock(%s)", [_LOCK])
            _close_public(connection)
            _refuse_planted(connection)
            _require_postgis(connection, create=True)
        _refuse_planted(connection)  # now also with the names of PostGIS
        present = schema_revision(connection)
        if present is not None and present not in revisions():
            raise UserError(_unknown(present))
        command.upgrade(alembic_config(session), "head")
        _fill_stages(connection, stages)
        install_api(connection)


def close_database(connection: psycopg.Connection[Any]) -> bool:
    """Let only members of tunneldb's roles connect to the database, and those whom its owner granted it by name.

    Whoever can connect can take locks, and make all others wait. The connection must be idle.

    Returns
    -------
    bool
        True if everybody could connect before; False also if this user may not change it, which `tunneldb check` reports.
    """
    with connection.transaction():
        viewers = connection.execute("SELECT pg_catalog.to_regrole('tunnel_viewer')").fetchone()
        if viewers == (None,) or not open_to_all(connection):
            return False
        name = sql.Identifier(connection.info.dbname)
        try:
            with connection.transaction():
                connection.execute(sql.SQL("GRANT CONNECT ON DATABASE {} TO tunnel_viewer").format(name))
                connection.execute(sql.SQL("REVOKE CONNECT ON DATABASE {} FROM PUBLIC").format(name))
        except psycopg.errors.InsufficientPrivilege:
            return False
        return not open_to_all(connection)


def limit_queries(connection: psycopg.Connection[Any]) -> bool:
    """Limit the time of queries of other programs, unless the database has a limit of its own. The connection must be idle.

    A limit of a group role would not apply to its members. The connections of commands have none.

    Returns
    -------
    bool
        True if the limit was set; False also if this user may not set it.
    """
    with connection.transaction():
        row = connection.execute(
            "SELECT EXISTS (SELECT FROM pg_catalog.pg_db_role_setting s JOIN pg_catalog.pg_database d ON d.oid = s.setdatabase,"
            "                      unnest(s.setconfig) AS c (setting)"
            "                WHERE d.datname = pg_catalog.current_database() AND s.setrole = 0"
            "                  AND c.setting LIKE 'statement\\_timeout=%')"
        ).fetchone()
        if row == (True,):
            return False
        name = sql.Identifier(connection.info.dbname)
        try:
            with connection.transaction():
                connection.execute(sql.SQL("ALTER DATABASE {} SET statement_timeout = {}").format(name, QUERY_TIMEOUT))
        except psycopg.errors.InsufficientPrivilege:
            return False
        return True


QUERY_TIMEOUT = "10min"
"""Maximum time of a query of QGIS, psql and others, unless the session sets another."""


def open_to_all(connection: psycopg.Connection[Any]) -> bool:
    """Return True if every login of the server can connect to the database."""
    row = connection.execute(
        "SELECT EXISTS (SELECT FROM pg_catalog.aclexplode(coalesce(d.datacl, pg_catalog.acldefault('d', d.datdba))) a"
        "                WHERE a.grantee = 0 AND a.privilege_type = 'CONNECT')"
        "  FROM pg_catalog.pg_database d WHERE d.datname = pg_catalog.current_database()"
    ).fetchone()
    assert row is not None
    return bool(row[0])


def _close_public(connection: psycopg.Connection[Any]) -> None:
    """Allow only its owner to create objects in the schema of PostGIS; before PostgreSQL 15 everybody could."""
    try:
        with connection.transaction():
            connection.execute("REVOKE CREATE ON SCHEMA public FROM PUBLIC")
    except psycopg.errors.InsufficientPrivilege:
        pass  # only its owner can; tunneldb check reports it


def _refuse_planted(connection: psycopg.Connection[Any]) -> None:
    """Refuse to continue with foreign functions or operators in the schema of PostGIS.

    It is in everybody's search path: a function there that matches a call better than PostgreSQL's function of that name is
    called instead, with the rights of the caller.
    """
    planted = overloads(connection)
    if planted:
        text, statement = planted[0]
        more = f", and {len(planted) - 1} more: tunneldb check" if len(planted) > 1 else ""
        raise UserError(f"{text}: {statement}{more}")


def _fill_stages(connection: psycopg.Connection[Any], stages: Sequence[StageRow]) -> None:
    connection.execute("DELETE FROM tunnel.stage")
    columns = ("reads", "reads_beside", "parameters", "subject", "tables")
    with connection.cursor() as cursor:
        cursor.executemany(
            sql.SQL("INSERT INTO tunnel.stage (step, name, on_demand, {}) VALUES (%s, %s, %s, %s, %s, %s, %s, %s)").format(
                sql.SQL(", ").join(map(sql.Identifier, columns))
            ),
            [
                (step, stage.name, stage.on_demand, *(list(getattr(stage, name)) for name in columns))
                for step, stage in enumerate(stages, 1)
            ],
        )
        cursor.executemany(
            "INSERT INTO tunnel.stage_input (stage, number, key, holds, reason) VALUES (%s, %s, %s, %s, %s)",
            [
                (stage.name, number, one.key, str(one.holds), one.reason or None)
                for stage in stages
                for number, one in enumerate(stage.inputs, 1)
            ],
        )
    # For a table that was never analysed the planner expects a thousand rows: status and queue then take seconds.
    connection.execute("ANALYZE tunnel.stage, tunnel.stage_input")


def install_api(connection: psycopg.Connection[Any]) -> None:
    """Drop tunnel_api, tunnel_internal and the schemas of typed layers, and install them from the SQL files.

    All in the connection's transaction.

    What another version kept of kilometres (`tunnel.waterproof`) may be of other limits, and is forgotten. Nobody is at it:
    making the trigger of that table has waited for all.

    Raises
    ------
    UserError
        If objects outside of these schemas depend on them, which the drop would remove.
    """
    connection.execute("SELECT pg_advisory_xact_lock(%s)", [_LAYERS_LOCK])
    _refuse_dependents(connection)
    _refuse_guests(connection)
    before, version = installed_api_version(connection), api_version()
    for schema in (*_layer_schemas(connection), *API_SCHEMAS):
        connection.execute(sql.SQL("DROP SCHEMA IF EXISTS {} CASCADE").format(sql.Identifier(schema)))
    for schema in API_SCHEMAS:
        connection.execute(sql.SQL("CREATE SCHEMA {}").format(sql.Identifier(schema)))
    for path in sql_files():
        try:
            connection.execute(path.read_bytes())
        except psycopg.Error as error:
            error.add_note(f"in {path}{_line_of(error, path)}")
            raise
    if before != version:
        connection.execute("DELETE FROM tunnel.waterproof")
    for schema, comment in zip(API_SCHEMAS, (version, _INTERNAL, _SHARED), strict=True):
        connection.execute(sql.SQL("COMMENT ON SCHEMA {} IS {}").format(sql.Identifier(schema), sql.Literal(comment)))


def sql_files() -> list[Path]:
    """Return the SQL files of tunnel_api and tunnel_internal in the order of installation.

    Raises
    ------
    ValueError
        If install.txt and the folder do not list the same files.
    """
    folder = resource_dir("sql")
    lines = (folder / "install.txt").read_text("utf-8").splitlines()
    listed = [line.strip() for line in lines if line.strip() and not line.startswith("#")]
    present = {path.relative_to(folder).as_posix() for path in folder.rglob("*.sql")}
    different = {name for name in present if not name.startswith("hub/")} ^ set(listed)  # hub/: tunneldb.federation
    if different:
        raise ValueError(f"{folder / 'install.txt'} and its folder differ in {', '.join(sorted(different))}")
    return [folder / name for name in listed]


def api_version() -> str:
    """Return the comment for schema tunnel_api: the program's version and a digest of the files."""
    digest = hashlib.sha256()
    for path in sql_files():
        digest.update(path.read_bytes())
    return f"Functions and views of tunneldb {__version__}, {digest.hexdigest()[:12]}; made anew by tunneldb init"


def installed_api_version(connection: psycopg.Connection[Any]) -> str | None:
    """Return the comment on the database's schema tunnel_api, None if one of API_SCHEMAS is missing."""
    row = connection.execute(
        "SELECT obj_description(to_regnamespace('tunnel_api'), 'pg_namespace')"
        " WHERE to_regnamespace('tunnel_internal') IS NOT NULL"
    ).fetchone()
    return row[0] if row else None


def alembic_config(session: sqlalchemy.Connection | None = None) -> Config:
    """Return Alembic's configuration, on a connection if one is given."""
    from alembic.config import Config

    config = Config()
    config.set_main_option("script_location", str(resource_dir("migrations")).replace("%", "%%"))
    config.attributes["connection"] = session
    return config


def revisions() -> set[str]:
    """Return all migrations of this program."""
    from alembic.script import ScriptDirectory

    return {script.revision for script in ScriptDirectory.from_config(alembic_config()).walk_revisions()}


def schema_revision(connection: psycopg.Connection[Any]) -> str | None:
    """Return the revision of the database's schema `tunnel`, None if it has none."""
    table = connection.execute("SELECT to_regclass('tunnel.alembic_version')").fetchone()
    if table is None or table[0] is None:
        return None
    row = connection.execute("SELECT version_num FROM tunnel.alembic_version").fetchone()
    return row[0] if row else None


def postgis_version(connection: psycopg.Connection[Any]) -> str | None:
    """Return the version of PostGIS in this database, None if it has none."""
    row = connection.execute("SELECT extversion FROM pg_extension WHERE extname = 'postgis'").fetchone()
    return row[0] if row else None


def postgis_schema(connection: psycopg.Connection[Any]) -> str | None:
    """Return the schema of PostGIS, None if it is missing."""
    row = connection.execute("SELECT extnamespace::regnamespace::text FROM pg_extension WHERE extname = 'postgis'").fetchone()
    return row[0] if row else None


def require_current_schema(connection: psycopg.Connection[Any]) -> None:
    """Raise a UserError unless PostGIS and this program's schema exist."""
    _require_postgis(connection, create=False)
    revision = schema_revision(connection)
    if revision == HEAD:
        if installed_api_version(connection) is None:
            raise UserError("schema tunnel_api or tunnel_internal is missing; type tunneldb init")
        return
    if revision is None:
        raise NotReadyError("the database has no schema tunnel yet; type tunneldb init")
    if revision in revisions():
        raise UserError(f"the database's schema is older ({revision}) than this program; type tunneldb init to upgrade it")
    raise UserError(_unknown(revision))


def _unknown(revision: str) -> str:
    return (
        f"the database's schema {revision} is unknown to tunneldb {__version__}; it is of a newer version "
        "(pip install --upgrade tunneldb) or of a development version before 0.1.0 (create a new database and load the "
        "scans again)"
    )


def _require_postgis(connection: psycopg.Connection[Any], *, create: bool) -> None:
    version = postgis_version(connection)
    if version is None and not create:
        raise NotReadyError("the database is not set up for tunneldb yet; type tunneldb init")
    if version is None:
        try:
            with connection.transaction():
                connection.execute("CREATE EXTENSION IF NOT EXISTS postgis SCHEMA public")
        except psycopg.errors.InsufficientPrivilege:
            raise UserError(
                "the database has no PostGIS, and this user may not create it; ask a superuser to: CREATE EXTENSION postgis"
            ) from None
        except (psycopg.errors.UndefinedFile, psycopg.errors.FeatureNotSupported):
            major = connection.info.server_version // 10000
            raise UserError(
                f"PostGIS is not installed on the database's server; type sudo apt install postgresql-{major}-postgis-3"
            ) from None
        version = postgis_version(connection)
    assert version is not None
    if tuple(int(part) for part in version.split(".")[:2]) < MINIMUM_POSTGIS:
        least = ".".join(map(str, MINIMUM_POSTGIS))
        raise UserError(
            f"the database has PostGIS {version}, tunneldb needs {least} or newer; after installing it on the "
            "server: SELECT postgis_extensions_upgrade()"
        )
    if postgis_schema(connection) != "public":
        raise UserError(
            f"PostGIS is in schema {postgis_schema(connection)}; tunneldb, like QGIS, expects it in public: "
            "use a database of its own"
        )


def _layer_schemas(connection: psycopg.Connection[Any]) -> list[str]:
    """Return the schemas of typed layers: `tunnel_api.layer_schemas`, which may not exist (yet, or any more)."""
    rows = connection.execute(
        "SELECT n.nspname FROM pg_namespace n"
        " WHERE n.nspname ~ '^tunnel_([0-9]{1,9}|local)$'"
        " AND obj_description(n.oid, 'pg_namespace') LIKE 'tunneldb: layers of %'"
        " AND n.nspowner = coalesce((SELECT a.nspowner FROM pg_namespace a WHERE a.nspname = 'tunnel_api'),"
        " current_user::regrole) ORDER BY 1"
    )
    return [row[0] for row in rows]


def _refuse_guests(connection: psycopg.Connection[Any]) -> None:
    """Refuse to drop schemas of typed layers that contain other objects."""
    listed = connection.execute("SELECT to_regprocedure('tunnel_api.layer_types()') IS NOT NULL").fetchone()
    types = "SELECT layer FROM tunnel_api.layer_types()" if listed is not None and listed[0] else "SELECT c.relname"
    rows = connection.execute(
        sql.SQL(
            "SELECT c.oid::regclass::text FROM pg_class c JOIN pg_namespace n ON n.oid = c.relnamespace"
            " WHERE n.nspname = ANY (%s) AND c.relkind <> 'i'"
            " AND (c.relkind <> 'v' OR c.relname NOT IN ({types}))"
            " UNION ALL SELECT p.oid::regprocedure::text FROM pg_proc p JOIN pg_namespace n ON n.oid = p.pronamespace"
            " WHERE n.nspname = ANY (%s) ORDER BY 1"
        ).format(types=sql.SQL(types)),
        [schemas := _layer_schemas(connection), schemas],
    ).fetchall()
    if rows:
        names = ", ".join(row[0] for row in rows)
        raise UserError(f"{names} are in a schema of typed layers, which is created again; move them to another schema")


def _refuse_dependents(connection: psycopg.Connection[Any]) -> None:
    """Refuse to drop tunnel_api, tunnel_internal and the schemas of typed layers while others' views or columns use them."""
    rows = connection.execute(
        """
        WITH own AS (
            SELECT to_regnamespace(name)::oid AS oid FROM unnest(%s::text[]) name
        ), api AS (
            SELECT 'pg_class'::regclass AS catalog, oid FROM pg_class WHERE relnamespace IN (SELECT oid FROM own)
            UNION ALL
            SELECT 'pg_proc'::regclass, oid FROM pg_proc WHERE pronamespace IN (SELECT oid FROM own)
            UNION ALL
            SELECT 'pg_type'::regclass, oid FROM pg_type WHERE typnamespace IN (SELECT oid FROM own)
        )
        SELECT DISTINCT coalesce(r.ev_class, CASE d.classid WHEN 'pg_class'::regclass THEN d.objid END)::regclass::text
          FROM pg_depend d
          JOIN api ON api.catalog = d.refclassid AND api.oid = d.refobjid
          LEFT JOIN pg_rewrite r ON d.classid = 'pg_rewrite'::regclass AND r.oid = d.objid
          JOIN pg_class c ON c.oid = coalesce(r.ev_class, CASE d.classid WHEN 'pg_class'::regclass THEN d.objid END)
         WHERE c.relnamespace NOT IN (SELECT oid FROM own WHERE oid IS NOT NULL) AND c.relkind <> 'S'
           AND d.deptype IN ('n', 'a')
         ORDER BY 1
        """,
        [[*API_SCHEMAS, *_layer_schemas(connection)]],
    ).fetchall()
    if rows:
        names = ", ".join(row[0] for row in rows)
        raise UserError(
            f"{names} depend on schema tunnel_api, which is created again; drop them, type tunneldb init, and create them again"
        )


def _line_of(error: psycopg.Error, path: Path) -> str:
    position = error.diag.statement_position
    if position is None:
        return ""
    return f", line {path.read_text('utf-8')[: int(position)].count(chr(10)) + 1}"
