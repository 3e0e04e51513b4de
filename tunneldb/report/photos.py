"""Photos of findings as small pictures for the report; with the reason if one is not available."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import psycopg
from psycopg.rows import class_row

from tunneldb.report.pictures.load import Picture, Source, load_pictures
from tunneldb.report.pictures.trouble import TOO_MANY
from tunneldb.store.desk.photos import content, is_stored
from tunneldb.store.survey import Survey

MAX_PHOTOS = 2000
"""Maximum number of files and addresses that a report shows."""

TOGETHER = 50
"""Number of photos of the database that are on the disk at once."""


@dataclass(frozen=True)
class Photo:
    """A photo of a finding, as tunnel_api.finding_photo has it."""

    id: int
    finding_id: int
    path: str
    caption: str | None


@dataclass(frozen=True)
class Thumbnail:
    """A photo as the report shows it.

    Attributes
    ----------
    photo : Photo
    url : str or None
        The picture as a data URL; None if it can't be had.
    trouble : str
        Why it can't; empty if it can.
    """

    photo: Photo
    url: str | None
    trouble: str = ""


def read_photos(conn: psycopg.Connection[Any], survey: Survey, findings: Sequence[int]) -> list[Photo]:
    """Read which photos there are of findings, in the order in which they were added."""
    with conn.cursor(row_factory=class_row(Photo)) as cursor:
        return cursor.execute(
            "SELECT id, finding_id, path, caption FROM tunnel_api.finding_photo"
            " WHERE survey_id = %s AND finding_id = ANY (%s) ORDER BY id",
            [survey.id, list(findings)],
        ).fetchall()


def make_thumbnails(conn: psycopg.Connection[Any], photos: Iterable[Photo], source: Source) -> list[Thumbnail]:
    """Make small pictures of photos, each read once.

    Parameters
    ----------
    conn : Connection
        Database, which has uploaded photos.
    photos : iterable of Photo
        Photos of one survey. Their paths are names in the database, files, or web addresses.
    source : Source
        Folder and servers of photos.
    """
    wanted = list(photos)
    ids = {photo.path: photo.id for photo in reversed(wanted)}
    paths = list(dict.fromkeys(photo.path for photo in wanted))[:MAX_PHOTOS]
    pictures = _load_stored(conn, {path: ids[path] for path in paths if is_stored(path)})
    pictures |= load_pictures([path for path in paths if path not in pictures], source)
    return [
        Thumbnail(photo, picture.url or None, picture.trouble)
        if (picture := pictures.get(photo.path))
        else Thumbnail(photo, None, TOO_MANY)
        for photo in wanted
    ]


def _load_stored(conn: psycopg.Connection[Any], ids: Mapping[str, int]) -> dict[str, Picture]:
    """Return small versions of the photos that are in the database, by their paths."""
    found: dict[str, Picture] = {}
    paths = list(ids)
    for first in range(0, len(paths), TOGETHER):
        with TemporaryDirectory(prefix="tunneldb-photos-") as name:
            folder = Path(name)
            for path in paths[first : first + TOGETHER]:
                if (photo := content(conn, ids[path])) is not None:
                    (folder / path).write_bytes(photo)
            found |= load_pictures([file.name for file in folder.iterdir()], Source(folder))
    return found
