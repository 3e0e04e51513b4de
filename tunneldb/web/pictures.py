"""Receive and decode photos: one at a time in a session, few at once in all, by processes with limits of memory and time."""

from __future__ import annotations

import asyncio
import base64
import tempfile
from collections import OrderedDict
from dataclasses import replace
from pathlib import Path
from typing import Literal

from starlette.concurrency import run_in_threadpool
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response

from tunneldb.errors import UserError
from tunneldb.report.pictures.decode import MAX_PIXELS
from tunneldb.report.pictures.load import Source, load_pictures
from tunneldb.report.pictures.trouble import NO_IMAGE, OUT_OF_TIME, TOO_LARGE
from tunneldb.report.pictures.upload import NOT_A_PHOTO
from tunneldb.web import photos
from tunneldb.web.route import Call, answer_to, in_turn, make_call, session_of, turn

DECODERS = 2
"""Maximum number of photos that are decoded at once."""

RECEIVE_SECONDS = 300.0
"""Maximum time to receive a photo, s."""

MAX_SMALL = 300
"""Number of small photos that are kept."""

REASONS = {
    NOT_A_PHOTO: f"the photo is {NOT_A_PHOTO}",
    TOO_LARGE: f"the photo has more than {MAX_PIXELS // 1_000_000} megapixels",
    NO_IMAGE: "the photo is damaged",
    OUT_OF_TIME: "the photo could not be decoded in time",
}
"""Messages for the reasons why a photo is refused."""

FILE = "photo"


class Decoding:
    """Decoders of an application, and the small photos that it made last.

    Attributes
    ----------
    free : asyncio.Semaphore
        Lets DECODERS photos through.
    """

    def __init__(self) -> None:
        self.free = asyncio.Semaphore(DECODERS)
        self._small: OrderedDict[str, bytes] = OrderedDict()

    def find(self, name: str) -> bytes | None:
        """Return a small photo; None if it is not kept."""
        if name in self._small:
            self._small.move_to_end(name)
        return self._small.get(name)

    def keep(self, name: str, small: bytes) -> None:
        """Keep a small photo; drop the one that was not used longest."""
        self._small[name] = small
        while len(self._small) > MAX_SMALL:
            self._small.popitem(last=False)


async def add(request: Request) -> Response:
    """Add the photo that is the body of a request to a finding."""
    session = await session_of(request)
    if isinstance(session, Response):
        return session
    try:
        call = make_call(request, session, None)
        await in_turn(session, photos.permit, call)
        async with session.upload_turn:
            return await in_turn(session, photos.add, replace(call, body=await _received(request)))
    except ClientDisconnect:
        return Response(status_code=400)
    except TimeoutError:
        return answer_to(UserError(f"the photo did not arrive within {RECEIVE_SECONDS:.0f} s; nothing was saved"))
    except Exception as error:
        return answer_to(error)


async def show(request: Request) -> Response:
    """Return a photo, small with ``size=small``."""
    session = await session_of(request)
    if isinstance(session, Response):
        return session
    try:
        call = make_call(request, session, None)
        small = call.query.get("size", [""])[0] == "small"
        async with turn(session):
            return await _shown(request, call, small)
    except Exception as error:
        return answer_to(error)


async def _received(request: Request) -> bytes:
    """Receive a photo; return it as a clean JPEG."""
    with tempfile.TemporaryDirectory(prefix="tunneldb-desk-") as name:
        folder = Path(name)
        with (folder / FILE).open("wb") as file:
            async with asyncio.timeout(RECEIVE_SECONDS):
                async for chunk in request.stream():
                    file.write(chunk)
        async with request.app.state.decoding.free:
            return await run_in_threadpool(_decoded, folder, "upload")


async def _shown(request: Request, call: Call, small: bool) -> Response:
    decoding: Decoding = request.app.state.decoding
    name = await run_in_threadpool(photos.name_of, call)
    headers = photos.HEADERS | {"ETag": f'"{name[:32]}{"-small" if small else ""}"'}
    if request.headers.get("if-none-match") == headers["ETag"]:
        return Response(status_code=304, headers=headers)
    content = decoding.find(name) if small else await run_in_threadpool(photos.content_of, call, name)
    if content is None:
        async with decoding.free:
            content = await run_in_threadpool(_reduced, call, name)
        decoding.keep(name, content)
    return Response(content, media_type="image/jpeg", headers=headers)


def _reduced(call: Call, photo: str) -> bytes:
    """Return a small version of an uploaded photo."""
    content = photos.content_of(call, photo)
    with tempfile.TemporaryDirectory(prefix="tunneldb-desk-") as folder:
        (Path(folder) / FILE).write_bytes(content)
        return _decoded(Path(folder), "photo")


def _decoded(folder: Path, form: Literal["photo", "upload"]) -> bytes:
    """Return the photo of a folder in a form, by a process with limits of memory and time.

    Raises
    ------
    UserError
        If it cannot be decoded.
    """
    picture = load_pictures([FILE], Source(folder), form)[FILE]
    if picture.trouble:
        raise UserError(REASONS.get(picture.trouble, picture.trouble))
    return base64.b64decode(picture.url.partition(",")[2])
