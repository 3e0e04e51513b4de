"""Requests on photos of findings: add, show, caption, delete."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any

from starlette.responses import JSONResponse, Response

from tunneldb.errors import UserError
from tunneldb.store.desk import photos
from tunneldb.web.findings import one
from tunneldb.web.photo_folder import read_photo, write_photo
from tunneldb.web.route import Call, NotFoundError
from tunneldb.web.sessions import RefusedError

HEADERS = {
    "Content-Security-Policy": "default-src 'none'; sandbox",
    "Content-Disposition": "inline",
    "Cache-Control": "private, no-cache",
}
"""Headers of a photo. Whatever its bytes are, a browser shows it as an image, or not at all; it asks each time if it may."""


def permit(call: Call) -> None:
    """Check that a finding exists and that the role may add photos, before a photo is received.

    Raises
    ------
    NotFoundError
        If there is no such finding.
    RefusedError
        If the role may not.
    """
    one(call)
    with call.session.connection() as conn:
        if not photos.may_add(conn):
            raise RefusedError("you have no right to do this: photos are added by inspectors")


def add(call: Call) -> Response:
    """Add a photo, the body as a clean JPEG, to a finding; return the finding."""
    key, caption = call.path["id"], _text(call.query.get("caption", [""])[0])
    folder = call.desk.photos
    name = None if folder is None else write_photo(folder, call.body)  # before the row: no row without its file
    with call.session.connection() as conn:
        if name is None:
            photos.add_content(conn, key, call.body, caption)
        else:
            photos.add_path(conn, key, name, caption)
    return JSONResponse(one(call), 201)


def change(call: Call) -> Any:
    """Change the caption of a photo; return the finding."""
    body = call.body
    if not isinstance(body, Mapping) or set(body) != {"caption"} or not isinstance(body["caption"], str | None):
        raise UserError("the body of the request lacks the caption")
    with call.session.connection() as conn:
        if not photos.write_caption(conn, call.path["id"], call.path["photo"], _text(body["caption"])):
            raise _gone(call.path["photo"])
    return one(call)


def delete(call: Call) -> Any:
    """Delete a photo of a finding; return the finding."""
    with call.session.connection() as conn:
        if not photos.delete(conn, call.path["id"], call.path["photo"]):
            raise _gone(call.path["photo"])
    return one(call)


def name_of(call: Call) -> str:
    """Return the name of an uploaded photo.

    Raises
    ------
    NotFoundError
        If there is no such photo, or it is a path or URL that somebody gave.
    """
    with call.session.connection() as conn:
        path = photos.photo_path(conn, call.path["id"])
    if path is None or not photos.is_stored(path):
        raise _gone(call.path["id"])
    return path


def content_of(call: Call, name: str) -> bytes:
    """Return an uploaded photo from the database, or else from the folder of photos.

    Raises
    ------
    NotFoundError
        If neither has it, it is not a JPEG, or another one than the name says: its row was changed in the meantime.
    """
    with call.session.connection() as conn:
        content = photos.content(conn, call.path["id"])
    if content is None and call.desk.photos is not None:
        content = read_photo(call.desk.photos, name)
    if content is None or not content.startswith(b"\xff\xd8\xff") or _name(content) != name:
        raise _gone(call.path["id"])
    return content


def _name(content: bytes) -> str:
    return f"{hashlib.sha256(content).hexdigest()}.jpg"


def _text(value: str | None) -> str | None:
    return (value or "").strip() or None


def _gone(key: int) -> NotFoundError:
    return NotFoundError(f"photo {key} is not here")
