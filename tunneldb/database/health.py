"""Examination of the server and the database, with commands to fix problems."""

from __future__ import annotations

import shutil
from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter
from typing import Any, Literal, LiteralString

import psycopg

from tunneldb.counted import counted
from tunneldb.database.broken import broken_rows
from tunneldb.database.connection import MINIMUM_POSTGIS, open_connection
from tunneldb.database.foreign import SUBJECTS, catalogue_alone, foreign_objects, silent_triggers
from tunneldb.database.locks import lock_waits
from tunneldb.database.schema import (
    HEAD,
    api_version,
    installed_api_version,
    open_to_all,
    postgis_schema,
    postgis_version,
    revisions,
    schema_revision,
)
from tunneldb.database.server import Server
from tunneldb.errors import UserError

ROLES = ("tunnel_viewer", "tunnel_inspector", "tunnel_operator")
MIN_FREE_SPACE = 5 * 1024**3  # bytes; a kilometre at survey density takes some 0.5 GB with its rewrite
LOCKS_PER_TABLE = 6
"""Greatest number of locks for dropping a kilometre: its table, its TOAST table, and indexes."""
LOCKS_OF_A_SESSION = 16
"""Approximate number of locks of another session meanwhile."""
GIB = 1024**3
MAX_BROKEN = 5
"""Greatest number of broken rows that are listed."""


@dataclass(frozen=True)
class CheckResult:
    """Result of one check.

    Attributes
    ----------
    level
        ``ok``, ``note`` (works, but could be better) or ``wrong``.
    subject, text
        Subject of the check, and its state.
    remedy
        Command or statement to fix it; empty if nothing is wrong.
    """

    level: Literal["ok", "note", "wrong"]
    subject: str
    text: str
    remedy: str = ""


def examine(dsn: str | None) -> Iterator[CheckResult]:
    """Check everything, in the order of dependence; stop where nothing more can be checked."""
    try:
        connection = open_connection(dsn)
    except UserError as error:
        yield CheckResult("wrong", "server", str(error))
        return
    with connection:
        with catalogue_alone(connection):  # foreign objects in public are searched, and must not run
            sound = yield from _foundations(connection, embedded=dsn is None)
        if not sound:
            return
        yield from _settings(connection, embedded=dsn is None)
        yield _locks(connection)
        yield from _waits(connection)
        yield from _values(connection)
        state = connection.execute(_STATE).fetchall()
        yield from _work(state)
        yield from _queue(connection)
        yield from _stale(state)
        yield from _remarks(connection)
        if dsn is None:
            yield _space()


def _foundations(connection: psycopg.Connection[Any], *, embedded: bool) -> Generator[CheckResult, None, bool]:
    """Check the server, PostGIS and schema; return True if further checks are possible."""
    info = connection.info
    where = "embedded" if embedded else f"{info.host or 'local'}, database {info.dbname}"
    yield CheckResult("ok", "server", f"PostgreSQL {info.parameter_status('server_version')} ({where})")
    for look in (_postgis, _schema):
        found = look(connection)
        yield found
        if found.level == "wrong":
            return False
    yield _api(connection)
    if installed_api_version(connection) is None:
        return False
    yield from _roles(connection)
    yield _logins(connection)
    yield _public(connection)
    yield _audit(connection)
    foreign = list(_foreign(connection))
    yield from foreign
    return all(found.level != "wrong" or found.subject != "functions" for found in foreign)


def _postgis(connection: psycopg.Connection[Any]) -> CheckResult:
    version = postgis_version(connection)
    if version is None:
        return CheckResult(
            "wrong", "PostGIS", "not in this database", "tunneldb init   -- or a superuser: CREATE EXTENSION postgis;"
        )
    if tuple(map(int, version.split(".")[:2])) < MINIMUM_POSTGIS:
        minimum = ".".join(map(str, MINIMUM_POSTGIS))
        return CheckResult("wrong", "PostGIS", f"{version}, older than {minimum}", "SELECT postgis_extensions_upgrade();")
    schema = postgis_schema(connection)
    if schema != "public":
        return CheckResult("wrong", "PostGIS", f"{version}, in schema {schema} instead of public", "use a database of its own")
    return CheckResult("ok", "PostGIS", version)


def _schema(connection: psycopg.Connection[Any]) -> CheckResult:
    revision = schema_revision(connection)
    if revision is None:
        return CheckResult("wrong", "schema tunnel", "missing", "tunneldb init")
    if revision == HEAD:
        return CheckResult("ok", "schema tunnel", f"revision {revision}, the newest")
    if revision in revisions():
        return CheckResult("wrong", "schema tunnel", f"revision {revision}, older than this program", "tunneldb init")
    return CheckResult(
        "wrong",
        "schema tunnel",
        f"revision {revision}, newer than this program or never released",
        "pip install --upgrade tunneldb",
    )


def _api(connection: psycopg.Connection[Any]) -> CheckResult:
    installed = installed_api_version(connection)
    if installed == api_version():
        return CheckResult("ok", "schema tunnel_api", installed.split(";")[0])
    text = "missing" if installed is None else f"not this program's ({installed.split(';')[0]})"
    return CheckResult("wrong", "schema tunnel_api", text, "tunneldb init")


def _roles(connection: psycopg.Connection[Any]) -> Iterator[CheckResult]:
    existing = {row[0] for row in connection.execute("SELECT rolname FROM pg_roles WHERE rolname = ANY(%s)", [list(ROLES)])}
    missing = [role for role in ROLES if role not in existing]
    if missing:
        remedy = "; ".join(f"CREATE ROLE {role}" for role in missing)
        remedy = f"tunneldb init   -- if you may not create roles, first a superuser: {remedy};"
        yield CheckResult("wrong", "roles", f"missing: {', '.join(missing)}", remedy)
        return
    granted = connection.execute(
        "SELECT bool_and(has_schema_privilege(role, 'tunnel_api', 'USAGE')) FROM unnest(%s::text[]) role", [list(ROLES)]
    ).fetchone()
    if granted is None or not granted[0]:
        yield CheckResult("wrong", "roles", "without their privileges, for example after a restore", "tunneldb init")
    else:
        yield CheckResult("ok", "roles", ", ".join(ROLES))


def _logins(connection: psycopg.Connection[Any]) -> CheckResult:
    """Check that only members of tunneldb's roles can connect: whoever can may take locks."""
    if open_to_all(connection):
        name = connection.info.dbname
        mend = f"tunneldb init   -- or its owner: REVOKE CONNECT ON DATABASE {name} FROM PUBLIC;"
        return CheckResult("note", "logins", "every login of the server can connect, and make others wait by locks", mend)
    return CheckResult("ok", "logins", "only members of tunneldb's roles, and logins that the owner allowed")


def _public(connection: psycopg.Connection[Any]) -> CheckResult:
    """Check who may create objects in the schema of PostGIS, which is in everybody's search path."""
    rows = connection.execute(
        """
        SELECT CASE a.grantee WHEN 0 THEN 'PUBLIC' ELSE quote_ident(pg_get_userbyid(a.grantee)) END
          FROM pg_namespace n CROSS JOIN LATERAL aclexplode(n.nspacl) a
         WHERE n.nspname = 'public' AND a.privilege_type = 'CREATE' AND a.grantee <> n.nspowner
           AND NOT EXISTS (SELECT FROM pg_roles r, pg_database d
                            WHERE r.oid = a.grantee AND d.datname = current_database() AND (r.rolsuper OR r.oid = d.datdba))
         ORDER BY 1
        """
    ).fetchall()
    if not rows:
        return CheckResult("ok", "schema public", "only its owner and the database's owner may create objects in it")
    names = ", ".join(name for (name,) in rows)
    text = f"{names} may create functions in it, which run in the place of PostgreSQL's with the rights of whoever calls them"
    return CheckResult("wrong", "schema public", text, f"as a superuser: REVOKE CREATE ON SCHEMA public FROM {names};")


def _audit(connection: psycopg.Connection[Any]) -> CheckResult:
    """Check that manual changes are recorded: the table's own trigger is on, and operators don't own the table."""
    row = connection.execute(
        """
        SELECT EXISTS (SELECT FROM pg_trigger t
                        WHERE t.tgrelid = c.oid AND t.tgname = 'append_only' AND t.tgenabled IN ('O', 'A')),
               'tunnel_operator' IN (pg_get_userbyid(c.relowner), pg_get_userbyid(n.nspowner)),
               (SELECT quote_ident(pg_get_userbyid(a.nspowner)) FROM pg_namespace a WHERE a.nspname = 'tunnel_api')
          FROM pg_class c JOIN pg_namespace n ON n.oid = c.relnamespace
         WHERE n.nspname = 'tunnel_audit' AND c.relname = 'entry'
        """
    ).fetchone()
    if row is None:
        return CheckResult("wrong", "audit", "table tunnel_audit.entry is missing", "restore schema tunnel_audit from a backup")
    if not row[0]:
        remedy = "ALTER TABLE tunnel_audit.entry ENABLE TRIGGER append_only;"
        return CheckResult("wrong", "audit", "entries can be changed and deleted: its trigger is disabled", remedy)
    if row[1]:
        remedy = f"ALTER SCHEMA tunnel_audit OWNER TO {row[2]}; ALTER TABLE tunnel_audit.entry OWNER TO {row[2]};"
        return CheckResult("wrong", "audit", "its owner is the role of operators, who could drop it", remedy)
    return CheckResult("ok", "audit", "accepts only new entries")


def _foreign(connection: psycopg.Connection[Any]) -> Iterator[CheckResult]:
    """Check for foreign objects on the tables and in schema public, and for own triggers that are disabled."""
    found = [("triggers", text, remedy) for text, remedy in silent_triggers(connection)]
    found += foreign_objects(connection)
    for subject, text, remedy in found:
        yield CheckResult("wrong", subject, text, remedy)
    for subject in SUBJECTS:
        if not any(subject == other for other, *_ in found):
            yield CheckResult("ok", subject, "none but tunneldb's own")


def _settings(connection: psycopg.Connection[Any], *, embedded: bool) -> Iterator[CheckResult]:
    """Check settings that make a survey slow; the embedded server has its own."""
    if embedded:
        yield CheckResult("ok", "settings", "sized to this machine")
        return
    rows = connection.execute(
        """
        SELECT name, pg_size_bytes(current_setting(name)), pg_size_bytes(least), least
          FROM (VALUES ('shared_buffers', '512MB'), ('work_mem', '16MB'), ('maintenance_work_mem', '128MB'),
                       ('max_wal_size', '2GB')) wanted (name, least)
        """
    ).fetchall()
    small = [(name, minimum) for name, size, required, minimum in rows if size < required]
    for name, minimum in small:
        remedy = f"as a superuser: ALTER SYSTEM SET {name} = '{minimum}'; then restart the server"
        yield CheckResult("note", "settings", f"{name} is small for scans", remedy)
    if not small:
        yield CheckResult("ok", "settings", "memory and WAL are big enough")


def _locks(connection: psycopg.Connection[Any]) -> CheckResult:
    """Check that there are enough locks for a dump of all tables, and for removing the longest survey."""
    row = connection.execute(
        """
        SELECT current_setting('max_locks_per_transaction')::bigint * c.places, c.places, d.dump, d.removal
          FROM (SELECT current_setting('max_connections')::bigint
                         + current_setting('max_prepared_transactions')::bigint) c (places)
         CROSS JOIN (
               SELECT sum(s.tables)::bigint AS dump, %s * max(s.tables) FILTER (WHERE s.survey IS NOT NULL) AS removal
                 FROM (SELECT substring(r.relname FROM '^point_s([0-9]+)') AS survey, count(*) AS tables
                         FROM pg_class r
                        WHERE r.relnamespace = 'tunnel'::regnamespace AND r.relkind IN ('r', 'p') GROUP BY 1) s) d
        """,
        [LOCKS_PER_TABLE],
    ).fetchone()
    assert row is not None
    available, places, dump, removal = row
    needed = max(dump, removal or 0)
    text = f"{available} for {dump} tables, one a kilometre"
    if needed + places * LOCKS_OF_A_SESSION <= available:
        return CheckResult("ok", "locks", text)
    advised = 64 * -(-(2 * needed + places * LOCKS_OF_A_SESSION) // (64 * places))
    what = "to dump them all" if dump >= (removal or 0) else "to remove the longest survey"
    return CheckResult(
        "note", "locks", f"{text}: too few {what}",
        f"as a superuser: ALTER SYSTEM SET max_locks_per_transaction = {advised}; then restart the server",
    )  # fmt: skip


def _waits(connection: psycopg.Connection[Any]) -> Iterator[CheckResult]:
    """Report sessions that others wait for."""
    waits = lock_waits(connection)
    for sentence in waits:
        mend = "ask them to end their transaction; or as a superuser: SELECT pg_terminate_backend(PROCESS);"
        yield CheckResult("note", "waiting", sentence, mend)
    if not waits:
        yield CheckResult("ok", "waiting", "nobody waits for a lock")


def _values(connection: psycopg.Connection[Any]) -> Iterator[CheckResult]:
    """Report rows with numbers that nothing can be computed with."""
    rows = broken_rows(connection)
    for row in rows[:MAX_BROKEN]:
        yield CheckResult("wrong", "values", f"{row.name}: {row.fault}", row.remedy)
    if len(rows) > MAX_BROKEN:
        yield CheckResult("wrong", "values", f"{len(rows) - MAX_BROKEN} more rows", "fix these first, then tunneldb check")
    if not rows:
        yield CheckResult("ok", "values", "positions, sizes and dates are possible numbers")


_STATE: LiteralString = """
SELECT survey, km, stage, outcome, message, stale FROM tunnel_api.stage_status
 WHERE outcome IN ('interrupted', 'failed') OR stale ORDER BY survey, km, step
"""


def _work(state: Sequence[tuple[Any, ...]]) -> Iterator[CheckResult]:
    """Report interrupted and failed stages."""
    rows = [row for row in state if row[3] in ("interrupted", "failed")]
    for survey, km, stage, outcome, message, _ in rows:
        why = f": {message.splitlines()[0]}" if message else ""
        remedy = f"tunneldb run {survey} --km {km} --from {stage}" if stage != "load" else f"tunneldb load {survey} FILES"
        yield CheckResult("note", "work", f"{survey} km {km}, {stage} {outcome}{why}", remedy)
    if not rows:
        yield CheckResult("ok", "work", "no stage failed or was interrupted")


def _queue(connection: psycopg.Connection[Any]) -> Iterator[CheckResult]:
    """Report files that could not be read, and jobs without a worker."""
    for survey, name, path, message in connection.execute(
        "SELECT survey, name, path, message FROM tunnel_api.incoming WHERE state = 'failed' ORDER BY survey, name"
    ).fetchall():
        why = (message or "it could not be read").splitlines()[0]
        remedy = f"tunneldb batch {survey} {path}   -- after fixing the file; or tunneldb survey remove-file {survey} {name}"
        yield CheckResult("note", "files", f"{survey}, {name}: {why}", remedy)
    row = connection.execute(
        """
        SELECT (SELECT count(*) FROM tunnel_api.job WHERE state = 'queued'), (SELECT count(*) FROM tunnel_api.worker)
        """
    ).fetchone()
    assert row is not None
    queued, workers = row
    if queued and not workers:
        yield CheckResult(
            "note", "queue", f"{counted(queued, 'job is', 'jobs are')} queued, but no worker is running", "tunneldb worker"
        )


def _remarks(connection: psycopg.Connection[Any]) -> Iterator[CheckResult]:
    """Report notes and limitations of the results."""
    for survey, remark in connection.execute(
        "SELECT s.name, r.said FROM tunnel.survey s CROSS JOIN LATERAL tunnel_api.remarks(s.id) WITH ORDINALITY AS"
        " r (file, stage, kilometres, remark, said, n) ORDER BY s.name, r.n"
    ).fetchall():
        yield CheckResult("note", "results", f"{survey}, {remark}")


def _stale(state: Sequence[tuple[Any, ...]]) -> Iterator[CheckResult]:
    """Report results that are out of date, one line per survey."""
    for survey, rows in groupby((row for row in state if row[5]), key=itemgetter(0)):
        kilometres = [row[1] for row in rows]
        stages = counted(len(kilometres), "stage")
        text = f"{survey}: out of date: {stages} of {counted(len(set(kilometres)), 'kilometre')}"
        yield CheckResult("note", "work", text, f"tunneldb run {survey} --stale")


def _space() -> CheckResult:
    home = Server().home()
    free = shutil.disk_usage(home.state).free
    text = f"{free / GIB:.1f} GB free in {home.state}"
    if free < MIN_FREE_SPACE:
        return CheckResult("note", "disk", text, "free some, or set TUNNELDB_HOME to a folder on a bigger disk")
    return CheckResult("ok", "disk", text)
