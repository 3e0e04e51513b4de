"""Photos of findings as small pictures for the report, from files and from the web; with the reason if one is not available."""

from __future__ import annotations

import base64
import io
import time
import warnings
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any
from urllib import request
from urllib.error import HTTPError

import psycopg
from PIL import Image, ImageOps
from psycopg.rows import class_row

from tunneldb import __version__
from tunneldb.store.survey import Survey

SIZE = 480
"""Maximum width and height, pixels: 6 cm on paper at 200 dpi."""

MAX_BYTES = 100_000_000
"""Maximum bytes of a photo."""

PATIENCE, TOGETHER = 10.0, 60.0
"""Timeout of a server, and total time for all photos from the web, s."""

_FORMATS = ("JPEG", "PNG", "WEBP", "TIFF", "BMP", "GIF")  # none that runs another program, as PostScript
_THREADS = 8


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


class _NotHadError(Exception):
    """A photo can't be had; the message is why."""


def read_photos(conn: psycopg.Connection[Any], survey: Survey, findings: Sequence[int]) -> list[Photo]:
    """Read which photos there are of findings, in the order in which they were added."""
    with conn.cursor(row_factory=class_row(Photo)) as cursor:
        return cursor.execute(
            "SELECT id, finding_id, path, caption FROM tunnel_api.finding_photo"
            " WHERE survey_id = %s AND finding_id = ANY (%s) ORDER BY id",
            [survey.id, list(findings)],
        ).fetchall()


def make_thumbnails(photos: Iterable[Photo], folder: Path) -> list[Thumbnail]:
    """Make small pictures of photos, each file read once.

    Parameters
    ----------
    photos : iterable of Photo
        Their paths are files, or addresses that begin with http:// or https://.
    folder : Path
        Base of relative paths.
    """
    wanted = list(photos)
    paths = dict.fromkeys(photo.path for photo in wanted)
    end = time.monotonic() + TOGETHER
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # at twice as many pixels it is an error
        with ThreadPoolExecutor(_THREADS, "photo") as pool:
            had = dict(zip(paths, pool.map(partial(_have, folder=folder, end=end), paths), strict=True))
    return [Thumbnail(photo, *had[photo.path]) for photo in wanted]


def _have(path: str, folder: Path, end: float) -> tuple[str | None, str]:
    """Return a photo as a data URL and why it can't be had, either of them."""
    try:
        return _picture(_read(path, folder, end)), ""
    except _NotHadError as error:
        return None, str(error)


def _read(path: str, folder: Path, end: float) -> bytes:
    scheme, separator, rest = path.partition("://")
    scheme = scheme.lower() if separator else ""
    if scheme in ("http", "https"):
        return _fetch(path, end)
    if scheme == "file":
        path = request.url2pathname(rest)
    elif scheme:
        raise _NotHadError("neither a file nor http:// or https://")
    try:
        file = folder / path
        if not file.exists():
            raise _NotHadError("no such file")
        if not file.is_file() or file.stat().st_size > MAX_BYTES:
            raise _NotHadError("not a readable image")
        return file.read_bytes()
    except OSError as error:
        raise _NotHadError("cannot be read") from error


def _fetch(url: str, end: float) -> bytes:
    """Return the content of a web address."""
    opener = request.OpenerDirector()  # one that knows no files: a server could send us to them
    for handler in (
        request.ProxyHandler, request.HTTPHandler, request.HTTPSHandler, request.HTTPDefaultErrorHandler,
        request.HTTPRedirectHandler, request.HTTPErrorProcessor,
    ):  # fmt: skip
        opener.add_handler(handler())
    data = io.BytesIO()
    try:
        asked = request.Request(url, headers={"User-Agent": f"tunneldb/{__version__}"})
        if time.monotonic() > end:
            raise _NotHadError("could not be fetched: out of time")
        with opener.open(asked, timeout=PATIENCE) as answer:
            while chunk := answer.read1(1 << 16):
                data.write(chunk)
                if time.monotonic() > end or data.tell() > MAX_BYTES:
                    raise _NotHadError("could not be fetched: too large or too slow")
    except HTTPError as error:
        raise _NotHadError(f"could not be fetched: {error.code} {error.reason}") from error
    except Exception as error:  # of sockets, TLS, HTTP and odd addresses; whatever it is, the report is written
        cause = getattr(error, "reason", error)
        reason = str(getattr(cause, "strerror", None) or cause) or type(cause).__name__
        raise _NotHadError(reason if isinstance(error, _NotHadError) else f"could not be fetched: {reason}") from error
    return data.getvalue()


def _picture(data: bytes) -> str:
    """Return a small version of an image, rotated as the camera states, as a data URL."""
    try:
        with Image.open(io.BytesIO(data), formats=_FORMATS) as image:
            image.draft("RGB", (2 * SIZE, 2 * SIZE))
            image.thumbnail((2 * SIZE, 2 * SIZE))
            upright = ImageOps.exif_transpose(image).convert("RGBA")
        upright.thumbnail((SIZE, SIZE))
        paper = Image.new("RGB", upright.size, "white")
        paper.paste(upright, mask=upright.getchannel("A"))
        out = io.BytesIO()
        paper.save(out, "JPEG", quality=80, optimize=True)
    except Exception as error:  # decoders raise much that is no OSError; whatever it is, the report is written
        raise _NotHadError("not a readable image") from error
    return f"data:image/jpeg;base64,{base64.b64encode(out.getvalue()).decode()}"
