"""Embedded server: a private PostgreSQL cluster of the user, started automatically.

It listens only on a Unix socket, in a folder that no other user may enter. It continues to run after the command that
started it; `tunneldb server stop` stops it.
"""

from __future__ import annotations

import fcntl
import getpass
import os
import shutil
import subprocess
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import psycopg
from psycopg import pq, sql
from psycopg.conninfo import make_conninfo

from tunneldb.database import machine
from tunneldb.database.binaries import Binaries, find_binaries
from tunneldb.database.home import Home, execute, home_folder, prepare_home
from tunneldb.errors import UserError
from tunneldb.files import replacing

DATABASE = "tunneldb"
_SUPERUSER = "postgres"
_START_SECONDS = 120
_LOG_LIMIT = 20 * machine.MIB
_SETTINGS_FILE = "tunneldb.conf"

State = Literal["absent", "stopped", "running"]


class Server:
    """Embedded server in a folder.

    Parameters
    ----------
    folder
        Folder of the server; TUNNELDB_HOME or the user's data folder if None.
    settings
        PostgreSQL settings in addition to those sized to the machine.
    """

    def __init__(self, folder: Path | None = None, settings: Mapping[str, str] | None = None) -> None:
        self.folder = folder or home_folder()
        self._extra = dict(settings or {})

    def start(self) -> str:
        """Start the server unless it is running, create missing parts, and return the DSN of its database.

        Raises
        ------
        UserError
            If PostgreSQL or PostGIS is not installed, or the server does not start.
        """
        home = prepare_home(self.folder)
        if not _accepts(home):
            with _locked(home):
                if not _accepts(home):
                    binaries = _initialise(home)
                    self._write_settings(home)
                    _launch(home, binaries)
        return _prepare_database(home)

    def stop(self) -> bool:
        """Stop the server, and return True if it was running. Connections are closed, their transactions rolled back."""
        if self.state() != "running":
            return False
        home = prepare_home(self.folder)
        with _locked(home):
            _pg_ctl(home, find_binaries(_major(home)), "stop", "-m", "fast", "-t", str(_START_SECONDS))
        return True

    def state(self) -> State:
        """Return the state of the server: absent, stopped or running."""
        if not (self.folder / "cluster" / "PG_VERSION").exists():
            return "absent"
        return "running" if _accepts(prepare_home(self.folder)) else "stopped"

    def home(self) -> Home:
        """Return the server's folders, made if necessary."""
        return prepare_home(self.folder)

    def crash(self) -> str | None:
        """Return the server's last message before a crash in the last minute, for example because of a full disk."""
        log = (self.folder / "cluster").resolve().parent / "server.log"  # beside the data, which may be elsewhere
        try:
            if time.time() - log.stat().st_mtime > _JUST_NOW:
                return None
            with log.open("rb") as file:
                file.seek(max(0, log.stat().st_size - _TAIL))
                lines = file.read().decode(errors="replace").splitlines()
        except OSError:
            return None
        return next((line.split(_PANIC, 1)[1].strip() for line in reversed(lines) if _PANIC in line), None)

    def _write_settings(self, home: Home) -> None:
        lines = ["# Rewritten at each start, from the machine's size. Your own settings: postgresql.conf"]
        lines += [f"{name} = {value}" for name, value in (machine.settings(home.run) | self._extra).items()]
        path = home.cluster / _SETTINGS_FILE
        with replacing(path) as temporary:
            temporary.write_text("\n".join(lines) + "\n")
            _give(temporary, home)


_PANIC = "PANIC:"
_JUST_NOW = 60.0  # seconds
_TAIL = 1 << 16  # bytes of the log that are read


def _give(path: Path, home: Home) -> None:
    """Make the server's user the owner of a file made by root."""
    if home.user is not None:
        os.chown(path, home.user.pw_uid, home.user.pw_gid)


@contextmanager
def _locked(home: Home) -> Iterator[None]:
    """Hold the server's lock, so that two commands do not create or start it at once."""
    with home.lock.open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def _dsn(home: Home, database: str, user: str) -> str:
    return make_conninfo(host=str(home.run), port=5432, dbname=database, user=user)


def _accepts(home: Home) -> bool:
    """Return True if the server accepts connections; while it starts or stops, wait for the outcome."""
    deadline = time.monotonic() + _START_SECONDS
    while True:
        answer = pq.PGconn.ping(_dsn(home, "postgres", _SUPERUSER).encode())
        if answer != pq.Ping.REJECT or time.monotonic() > deadline:
            return answer == pq.Ping.OK
        time.sleep(0.1)


def _major(home: Home) -> int:
    return int((home.cluster / "PG_VERSION").read_text())


def _pg_ctl(home: Home, binaries: Binaries, *arguments: str) -> subprocess.CompletedProcess[str]:
    return execute([binaries["pg_ctl"], "-D", str(home.cluster), "-w", *arguments], home.user)


def _initialise(home: Home) -> Binaries:
    """Create the cluster unless it exists, and return the matching programs."""
    if (home.cluster / "PG_VERSION").exists():
        return find_binaries(_major(home))
    binaries = find_binaries()
    # A cluster whose creation was interrupted has no PG_VERSION yet, and initdb requires an empty folder.
    _empty(home.cluster)
    command = [binaries["initdb"], "-D", str(home.cluster), "-U", _SUPERUSER, "-A", "trust"]
    command += ["--data-checksums", "--encoding=UTF8", "--locale=C"]
    result = execute(command, home.user)
    if result.returncode:
        _empty(home.cluster)
        raise UserError(f"initdb failed in {home.cluster}: {_reason(result.stderr)}")
    try:
        with (home.cluster / "postgresql.conf").open("a") as settings:
            settings.write(f"\ninclude '{_SETTINGS_FILE}'\n# Your own settings below override those of tunneldb:\n")
    except OSError as error:  # a cluster without that line would start with other settings
        _empty(home.cluster)
        raise UserError(f"{home.cluster}: cannot be written: {error.strerror}") from error
    return binaries


def _empty(folder: Path) -> None:
    for entry in folder.iterdir():
        if entry.is_dir() and not entry.is_symlink():
            shutil.rmtree(entry)
        else:
            entry.unlink()


def _launch(home: Home, binaries: Binaries) -> None:
    """Start the server, also after a crash."""
    if home.log.exists() and home.log.stat().st_size > _LOG_LIMIT:
        home.log.unlink()
    home.log.touch()
    _give(home.log, home)
    deadline = time.monotonic() + _START_SECONDS
    while True:
        _clear_stale_pid(home)
        begin = home.log.stat().st_size
        result = _pg_ctl(home, binaries, "start", "-t", str(_START_SECONDS), "-l", str(home.log))
        if result.returncode == 0:
            return
        with home.log.open(errors="replace") as log:
            log.seek(begin)
            output = log.read()
        # After a crash of the server's first process, a query may still be running; it ends by itself.
        if "pre-existing shared memory block" not in output or time.monotonic() > deadline:
            raise UserError(f"the embedded server does not start: {_reason(output)}; see {home.log}")
        time.sleep(0.5)


def _reason(log: str) -> str:
    """Return the reason of the server, or of initdb, for not starting; for a wrong setting, its name."""
    marks = ("invalid value for parameter", "unrecognized configuration parameter", "FATAL:", "PANIC:", "error:")
    lines = log.splitlines()
    found = (line for mark in marks for line in lines if mark in line)
    return next(found, _last_line(log)).split(":  ", 1)[-1].strip()


def _last_line(text: str) -> str:
    lines = text.strip().splitlines()
    return lines[-1].strip() if lines else "no message"


def _clear_stale_pid(home: Home) -> None:
    """Remove the pid file of a crashed server if its number now belongs to another program.

    PostgreSQL itself removes one whose process is gone. It is kept while any process has the data folder as its working
    directory: an orphan of the crashed server may still write there.
    """
    pid_file = home.cluster / "postmaster.pid"
    try:
        pid = int(pid_file.read_text().split("\n", 1)[0])
    except (OSError, ValueError):
        return
    processes = Path("/proc")
    if not (processes / str(pid)).exists():
        return
    cluster = home.cluster.resolve()
    for process in processes.glob("[0-9]*"):
        try:
            if (process / "cwd").readlink() == cluster:
                return
        except OSError:
            continue
    pid_file.unlink()


def _prepare_database(home: Home) -> str:
    """Create the database and the current user's role unless they exist; return the DSN."""
    user = getpass.getuser()
    dsn = _dsn(home, DATABASE, user)
    try:
        psycopg.connect(dsn).close()
        return dsn
    except psycopg.OperationalError:
        pass
    with (
        _locked(home),
        psycopg.connect(_dsn(home, "postgres", _SUPERUSER), autocommit=True) as connection,
    ):
        if not _exists(connection, "pg_roles", "rolname", user):
            connection.execute(sql.SQL("CREATE ROLE {} LOGIN SUPERUSER").format(sql.Identifier(user)))
        if not _exists(connection, "pg_database", "datname", DATABASE):
            connection.execute(sql.SQL("CREATE DATABASE {}").format(sql.Identifier(DATABASE)))
    return dsn


def _exists(connection: psycopg.Connection[Any], catalog: str, column: str, name: str) -> bool:
    query = sql.SQL("SELECT FROM {} WHERE {} = %s").format(sql.Identifier(catalog), sql.Identifier(column))
    return connection.execute(query, [name]).fetchone() is not None
