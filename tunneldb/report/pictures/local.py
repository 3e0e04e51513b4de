"""Files of photos: regular files of a known size, in one folder."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import BinaryIO

from tunneldb.report.pictures.trouble import NO_FILE, NO_IMAGE, NOT_REGULAR, OUTSIDE, TOO_LARGE, UNREADABLE, PictureError


def open_picture(path: str, folder: Path, max_bytes: int, *, confined: bool = True) -> BinaryIO:
    """Open a file of a picture.

    Parameters
    ----------
    path : str
        Path, relative to ``folder`` or absolute.
    folder : Path
        Folder of photos.
    max_bytes : int
        Maximum size, bytes.
    confined : bool
        True if the file must be in that folder, also after links are followed.

    Raises
    ------
    PictureError
        If it is missing, elsewhere, too large, or a device, a pipe, a socket or a file of the system without a size.
    """
    try:
        target = (folder / path).resolve()
        if confined and not target.is_relative_to(folder.resolve()):
            raise PictureError(OUTSIDE)
        _require_regular(target.lstat(), max_bytes)  # before it is opened: opening a device may have effects
        file = os.fdopen(os.open(target, os.O_RDONLY | os.O_NONBLOCK | os.O_NOFOLLOW), "rb")
    except (FileNotFoundError, NotADirectoryError, ValueError) as error:  # ValueError: a NUL in the path
        raise PictureError(NO_FILE) from error
    except (OSError, RuntimeError) as error:  # RuntimeError: links in a circle
        raise PictureError(UNREADABLE) from error
    try:
        _require_regular(os.fstat(file.fileno()), max_bytes)
    except PictureError:
        file.close()
        raise
    return file


def _require_regular(status: os.stat_result, max_bytes: int) -> None:
    if stat.S_ISDIR(status.st_mode):
        raise PictureError(NO_IMAGE)
    if not stat.S_ISREG(status.st_mode):
        raise PictureError(NOT_REGULAR)
    if status.st_size == 0:  # also files of /proc, some of which never end
        raise PictureError(NO_IMAGE)
    if status.st_size > max_bytes:
        raise PictureError(TOO_LARGE)
