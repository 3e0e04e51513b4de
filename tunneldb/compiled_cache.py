"""Where compiled loops are kept is code that is run: not from a folder into which others may write."""

from __future__ import annotations

import os
import pwd
import stat
from pathlib import Path

from tunneldb.errors import UserError


def require_own_cache() -> None:
    """Refuse a folder for compiled loops, NUMBA_CACHE_DIR or ~/.cache/numba, that others than this user and root may write to.

    What lies beside the program is not looked at: who may write there can change the program itself.

    Raises
    ------
    UserError
        It, or a folder above it, belongs to another user or may be written to by others.
    """
    told = os.environ.get("NUMBA_CACHE_DIR")
    try:
        folder = Path(told).absolute() if told else Path("~/.cache/numba").expanduser().absolute()
    except RuntimeError:  # a user without a home: Numba says what is to be done
        return
    if not told and not folder.exists():
        return
    folder = folder.resolve()
    for place in (folder, *folder.parents):
        why = _open_to(place, above=place != folder)
        if why:
            name = "NUMBA_CACHE_DIR" if told else "the folder of compiled loops"
            raise UserError(
                f"{name} {folder}: {place} {why}, and what lies there is run; set NUMBA_CACHE_DIR to a folder of your own"
            )


def _open_to(place: Path, *, above: bool) -> str | None:
    """Why others may put files into a folder, or take from one above what is there; None if they may not, or there is none."""
    try:
        found = place.stat()
    except OSError:
        return None
    if found.st_uid not in (0, os.getuid()):
        return "belongs to another user"
    if above and found.st_mode & stat.S_ISVTX:
        return None
    if found.st_mode & stat.S_IWOTH or (found.st_mode & stat.S_IWGRP and not _own_group(found.st_gid)):
        return "may be written to by others"
    return None


def _own_group(gid: int) -> bool:
    """Whether a group is this user's alone, as Debian makes one for each."""
    try:
        return gid == pwd.getpwuid(os.getuid()).pw_gid == os.getuid() or gid == 0
    except KeyError:
        return gid == 0
