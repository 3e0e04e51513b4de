"""Uploaded photos in a folder of the owner's choice."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

from tunneldb.errors import BusyError, UserError
from tunneldb.files import replacing
from tunneldb.report.pictures.local import open_picture
from tunneldb.report.pictures.trouble import PictureError
from tunneldb.web.route import LOG

MAX_BYTES = 60_000_000
"""Maximum size of a file, bytes."""


def write_photo(folder: Path, photo: bytes) -> str:
    """Write a photo, whole or not at all, unless it is there; return the name of its file, which is its SHA-256.

    Raises
    ------
    BusyError
        If it cannot be written.
    """
    path = folder / f"{hashlib.sha256(photo).hexdigest()}.jpg"
    if not path.exists():
        try:
            with replacing(path) as temporary, temporary.open("xb") as file:
                file.write(photo)
                file.flush()
                os.fsync(file.fileno())
            _sync(folder)
        except (UserError, OSError) as error:
            LOG.error("a photo cannot be written: %s", error)
            raise BusyError("the folder of photos cannot be written to, or is full; nothing was saved") from None
    return path.name


def read_photo(folder: Path, name: str) -> bytes | None:
    """Return a photo by the name of its file; None if it is not there."""
    try:
        with open_picture(name, folder, MAX_BYTES) as file:
            return file.read()
    except PictureError:
        return None


def _sync(folder: Path) -> None:
    """Write the entries of a folder to the disk."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
