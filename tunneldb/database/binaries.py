"""Find the PostgreSQL programs for the embedded server."""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from tunneldb.errors import UserError

MINIMUM_POSTGRESQL = 14
INSTALL_HINT = "sudo apt install postgresql-15-postgis-3"

_FOLDERS = (
    "/usr/lib/postgresql/*/bin",
    "/usr/pgsql-*/bin",
    "/opt/homebrew/opt/postgresql@*/bin",
    "/usr/local/opt/postgresql@*/bin",
    "/Applications/Postgres.app/Contents/Versions/*/bin",
)


@dataclass(frozen=True)
class Binaries:
    """Installation of PostgreSQL.

    Attributes
    ----------
    folder
        Folder of ``postgres``, ``initdb`` and ``pg_ctl``.
    major
        Major version.
    """

    folder: Path
    major: int

    def __getitem__(self, program: str) -> str:
        """Return the path of a program."""
        return str(self.folder / program)

    @property
    def has_postgis(self) -> bool:
        """Return True if PostGIS is installed for this version."""
        config = self.folder / "pg_config"
        if config.exists():
            share = subprocess.run([str(config), "--sharedir"], capture_output=True, text=True, check=True).stdout.strip()
        else:
            share = f"/usr/share/postgresql/{self.major}"
        return (Path(share) / "extension" / "postgis.control").exists()


@cache
def find_binaries(major: int | None = None) -> Binaries:
    """Return the newest PostgreSQL that has PostGIS, or the one with a given major version.

    Raises
    ------
    UserError
        If there is none; the message has the command to install it.
    """
    found = {binaries.major: binaries for binaries in map(_inspect, _candidates()) if binaries is not None}
    if major is not None:
        if major not in found:
            raise UserError(
                f"the embedded server's data need PostgreSQL {major}, which is not installed; type "
                f"sudo apt install postgresql-{major}-postgis-3"
            )
        return found[major]
    new_enough = [found[version] for version in sorted(found, reverse=True) if version >= MINIMUM_POSTGRESQL]
    if not new_enough:
        older = f" (only {max(found)} is)" if found else ""
        raise UserError(f"PostgreSQL {MINIMUM_POSTGRESQL} or newer is not installed{older}; type {INSTALL_HINT}, or use --dsn")
    for binaries in new_enough:
        if binaries.has_postgis:
            return binaries
    newest = new_enough[0].major
    raise UserError(f"PostGIS is not installed for PostgreSQL {newest}; type sudo apt install postgresql-{newest}-postgis-3")


def _candidates() -> list[Path]:
    """Return the folders that may hold a server's programs."""
    folders = [folder for pattern in _FOLDERS for folder in sorted(Path("/").glob(pattern.lstrip("/")))]
    if config := shutil.which("pg_config"):
        result = subprocess.run([config, "--bindir"], capture_output=True, text=True, check=False)
        folders.append(Path(result.stdout.strip()))
    if server := shutil.which("postgres"):
        folders.append(Path(server).resolve().parent)
    return folders


def _inspect(folder: Path) -> Binaries | None:
    """Return the installation in a folder, None if it is not a server's."""
    if not all((folder / program).exists() for program in ("postgres", "initdb", "pg_ctl")):
        return None
    answer = subprocess.run([str(folder / "postgres"), "--version"], capture_output=True, text=True, check=False)
    version = re.search(r"\b(\d+)(\.\d+|devel|beta|rc)", answer.stdout)
    return Binaries(folder, int(version[1])) if version else None
