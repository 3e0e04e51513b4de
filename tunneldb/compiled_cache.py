"""Check of the folder of compiled loops: its files are executed, so other users must not be able to write to it."""

from __future__ import annotations

import os
import pwd
import stat
from pathlib import Path

from tunneldb.errors import UserError


def require_own_cache() -> None:
    """Refuse a folder for compiled loops (NUMBA_CACHE_DIR or ~/.cache/numba) that other users, except root, can write to.

    The folder beside the program is not checked: whoever can write there can change the program itself.

    Raises
    ------
    UserError
        If the folder, or one above it, belongs to another user or can be written to by others.
    """
    configured = os.environ.get("NUMBA_CACHE_DIR")
    try:
        folder = Path(configured).absolute() if configured else Path("~/.cache/numba").expanduser().absolute()
    except RuntimeError:  # the user has no home; Numba reports what to do
        return
    if not configured and not folder.exists():
        return
    folder = folder.resolve()
    for place in (folder, *folder.parents):
        why = _open_to(place, above=place != folder)
        if why:
            name = "NUMBA_CACHE_DIR" if configured else "the folder of compiled loops"
            raise UserError(
                f"{name} {folder}: {place} {why}, and files there are executed; set NUMBA_CACHE_DIR to a folder of your own"
            )


def _open_to(place: Path, *, above: bool) -> str | None:
    """Return why others can add or replace files in a folder; None if they cannot, or if the folder does not exist."""
    try:
        found = place.stat()
    except OSError:
        return None
    if found.st_uid not in (0, os.getuid()):
        return "belongs to another user"
    if above and found.st_mode & stat.S_ISVTX:
        return None
    if found.st_mode & stat.S_IWOTH or (found.st_mode & stat.S_IWGRP and not _own_group(found.st_gid)):
        return "can be written to by other users"
    return None


def _own_group(gid: int) -> bool:
    """Return True if a group is private to this user, as Debian makes one for each user."""
    try:
        return gid == pwd.getpwuid(os.getuid()).pw_gid == os.getuid() or gid == 0
    except KeyError:
        return gid == 0
