"""Folders of the embedded server, and the user that it runs as."""

from __future__ import annotations

import hashlib
import os
import pwd
import stat
import subprocess
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import platformdirs

from tunneldb.errors import UserError

SOCKET_PATH_LIMIT = 107  # bytes of sun_path on Linux (103 on macOS), without the final zero
SOCKET_NAME = ".s.PGSQL.5432"
ROOT_STATE = Path("/var/lib/tunneldb")


@dataclass(frozen=True)
class Home:
    """Folders of an embedded server.

    Attributes
    ----------
    folder
        TUNNELDB_HOME, or the folder tunneldb in the user's data folder.
    state
        Folder of the data and the log: `folder` itself, or for root one below /var/lib/tunneldb when the
        server's user cannot enter `folder`.
    run
        Folder of the socket; short enough for the operating system.
    user
        System user of the server; None for the current one.
    """

    folder: Path
    state: Path
    run: Path
    user: pwd.struct_passwd | None

    @property
    def cluster(self) -> Path:
        """Data folder of PostgreSQL."""
        return self.state / "cluster"

    @property
    def log(self) -> Path:
        """Log file of the server."""
        return self.state / "server.log"

    @property
    def lock(self) -> Path:
        """Lock file while the server is being created, started or stopped."""
        return self.folder / "lock"


def home_folder() -> Path:
    """Return the embedded server's folder: TUNNELDB_HOME, or tunneldb in the user's data folder."""
    given = os.environ.get("TUNNELDB_HOME")
    return Path(given).expanduser().absolute() if given else Path(platformdirs.user_data_dir("tunneldb"))


def prepare_home(folder: Path) -> Home:
    """Make the folders of an embedded server, with the owner and mode that PostgreSQL requires.

    Raises
    ------
    UserError
        If a folder cannot be made, or root finds no user to run the server as.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        user = _server_user(folder)
        state = folder
        if user is not None:
            folder.chmod(folder.stat().st_mode | 0o111)
            if not _can_enter(folder, user):
                state = ROOT_STATE / f"{folder.name}-{_digest(folder)}"
                state.mkdir(parents=True, exist_ok=True)
        run = _socket_dir(state, user)
        for private in (state / "cluster", run):
            _make_private(private, user)
        if state != folder:
            _link(folder / "cluster", state / "cluster")
    except OSError as error:
        raise UserError(
            f"cannot make the embedded server's folder {error.filename or folder}: {error.strerror}; "
            "set TUNNELDB_HOME to another"
        ) from None
    return Home(folder=folder, state=state, run=run, user=user)


def _link(link: Path, target: Path) -> None:
    try:
        link.symlink_to(target)
    except FileExistsError:
        if not link.is_symlink():
            raise


def _server_user(folder: Path) -> pwd.struct_passwd | None:
    """Return the user that root changes to, since PostgreSQL refuses root; None for other users."""
    if os.geteuid() != 0:
        return None
    owner = folder.stat().st_uid
    if owner != 0:
        return pwd.getpwuid(owner)
    try:
        return pwd.getpwnam("postgres")
    except KeyError:
        raise UserError(
            "PostgreSQL refuses to run as root, and there is no user postgres to run it as; type "
            "sudo apt install postgresql-15-postgis-3, or use tunneldb as another user"
        ) from None


def _can_enter(folder: Path, user: pwd.struct_passwd) -> bool:
    return execute(["/usr/bin/test", "-x", str(folder)], user).returncode == 0


def execute(command: list[str], user: pwd.struct_passwd | None) -> subprocess.CompletedProcess[str]:
    """Run a program to its end, with a user's rights; None means the current one.

    Its environment has no settings of libpq and the server, and its language is English.
    """
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("PG", "LC_", "LANG"))}
    return subprocess.run(
        command,
        cwd="/",
        env=kept | {"LC_ALL": "C"},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
        user=None if user is None else user.pw_uid,
        group=None if user is None else user.pw_gid,
        extra_groups=None if user is None else [],
    )


def _digest(folder: Path) -> str:
    return hashlib.sha256(os.fsencode(folder.resolve())).hexdigest()[:10]


def _socket_dir(state: Path, user: pwd.struct_passwd | None) -> Path:
    """Return the socket's folder: beside the data, or below /tmp if that path is too long or unusable for QGIS."""
    run = state / "run"
    fits = len(os.fsencode(run / SOCKET_NAME)) <= SOCKET_PATH_LIMIT - 5  # room for ".lock"
    if fits and not set(" '\\") & set(str(run)):  # QGIS hands the path to libpq unquoted
        return run
    owner = os.geteuid() if user is None else user.pw_uid
    return Path(f"/tmp/tunneldb-{owner}-{_digest(state)}")


def _make_private(folder: Path, user: pwd.struct_passwd | None) -> None:
    """Make a folder that only the server's user may enter; refuse one that another user has made.

    The socket trusts every connection, so the folder's mode is its protection.
    """
    owner = os.geteuid() if user is None else user.pw_uid
    with suppress(FileExistsError):
        folder.mkdir(mode=0o700)
    found = folder.lstat()
    # A folder of root was made by another start, still running or killed, and its owner not yet changed.
    if not stat.S_ISDIR(found.st_mode) or found.st_uid not in {owner, os.geteuid()}:
        raise UserError(f"{folder} is not a folder of the server's user; remove it or set TUNNELDB_HOME")
    if user is not None and found.st_uid != owner:
        os.chown(folder, user.pw_uid, user.pw_gid, follow_symlinks=False)
    if stat.S_IMODE(found.st_mode) & 0o077:
        folder.chmod(0o700)
