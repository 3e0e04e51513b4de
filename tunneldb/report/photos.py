"""Photos of findings as small pictures for the report; with the reason if one is not available."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import psycopg
from psycopg.rows import class_row

from tunneldb.report.pictures.load import Source, load_pictures
from tunneldb.report.pictures.trouble import TOO_MANY
from tunneldb.store.survey import Survey

MAX_PHOTOS = 2000
"""Maximum number of files and addresses that a report shows."""


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


def make_thumbnails(photos: Iterable[Photo], source: Source) -> list[Thumbnail]:
    """Make small pictures of photos, each file read once.

    Parameters
    ----------
    photos : iterable of Photo
        Their paths are files, or web addresses.
    source : Source
        Folder and servers of photos.
    """
    wanted = list(photos)
    paths = list(dict.fromkeys(photo.path for photo in wanted))
    pictures = load_pictures(paths[:MAX_PHOTOS], source)
    return [
        Thumbnail(photo, picture.url or None, picture.trouble)
        if (picture := pictures.get(photo.path))
        else Thumbnail(photo, None, TOO_MANY)
        for photo in wanted
    ]
