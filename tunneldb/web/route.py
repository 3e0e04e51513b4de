"""From a request to a handler and back: session, token against forged requests, JSON, and errors as one line."""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any

import psycopg
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.types import Receive, Scope, Send

from tunneldb.errors import BusyError, UserError
from tunneldb.numerals import parse_number
from tunneldb.web.config import Desk
from tunneldb.web.security import SAFE_METHODS
from tunneldb.web.sessions import MAX_WAITING, RefusedError, Session, SignedOutError

COOKIE = "tunneldb_session"
"""Name of the session's cookie; with TLS it has the prefix that keeps other hosts of the domain from setting it."""

MAX_QUERY = 100
"""Maximum number of values in the query string."""

MAX_LARGE = 2
"""Number of large answers that are made at once."""

PART = 64 * 1024
"""Length of the parts in which a large answer is sent, bytes."""

CHALLENGE = 'Basic realm="tunneldb", charset="UTF-8"'

LOG = logging.getLogger("tunneldb.web")

NOT_WRITTEN = "the database cannot be reached; nothing was written: try again"


class NotFoundError(UserError):
    """The requested object does not exist."""


class ConflictError(UserError):
    """The request contradicts what is stored now.

    Parameters
    ----------
    message : str
    values : dict
        Further members of the answer.
    """

    def __init__(self, message: str, **values: Any) -> None:
        super().__init__(message)
        self.values = values


@dataclass(frozen=True)
class Call:
    """Request of a person who is signed in."""

    desk: Desk
    session: Session
    path: dict[str, Any]
    query: dict[str, list[str]]
    body: Any
    headers: dict[str, str]

    def number(self, name: str, default: float) -> float:
        """Return a number of the query string."""
        text = self.query.get(name, [""])[0]
        if not text:
            return default
        try:
            return parse_number(text)
        except ValueError:
            raise UserError(f"{name}={text[:40]}: not a number") from None


UNREACHABLE = 503

STATUS = {
    "08": UNREACHABLE, "57P": UNREACHABLE, "53": UNREACHABLE,  # connection, shutdown, resources
    "57014": 504, "55P03": 504, "40P01": 504,  # took too long, waited too long, deadlock
    "42501": 403,  # no privilege
    "40001": 409, "0A": 409, "55": 409, "P0": 409,  # what is stored does not permit it
    "22": 400, "23": 400, "XX000": 400,  # values, constraints, geometries that PostGIS refuses
}  # fmt: skip
"""Status of the answer by the beginning of an error's SQLSTATE, the first that fits."""


def cookie_name(desk: Desk) -> str:
    """Return the name of the session's cookie."""
    return f"__Host-{COOKIE}" if desk.secure else COOKIE


Handler = Callable[[Call], Any]


def route(handler: Handler, *, large: bool = False) -> Callable[[Request], Awaitable[Response]]:
    """Return the endpoint of a handler, which runs in a thread and returns a response or a value for JSON.

    With ``large`` few run at once, and a session gets one answer after the other: they need much memory and time.
    """

    async def endpoint(request: Request) -> Response:
        session = await session_of(request)
        if isinstance(session, Response):
            return session
        try:
            call = make_call(request, session, await _body(request))
            if large:
                return await _large(request, handler, call)
            return _response(await in_turn(session, handler, call))
        except Exception as error:
            return answer_to(error)

    return endpoint


class _InParts(Response):
    """Large answer that is sent in parts as its reader takes them, and ends the turn of its session.

    Parameters
    ----------
    whole : Response
    turn : asyncio.Semaphore
    """

    def __init__(self, whole: Response, turn: asyncio.Semaphore) -> None:
        super().__init__(whole.body, whole.status_code)
        self.raw_headers = whole.raw_headers
        self._turn = turn

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        try:
            await send({"type": "http.response.start", "status": self.status_code, "headers": self.raw_headers})
            for begin in range(0, len(self.body), PART):
                part = self.body[begin : begin + PART]
                await send({"type": "http.response.body", "body": part, "more_body": True})
            await send({"type": "http.response.body", "body": b""})
        finally:
            self._turn.release()


async def _large(request: Request, handler: Handler, call: Call) -> Response:
    """Run a handler whose answer is large."""
    session = call.session
    await _wait(session, session.large_turn)
    try:
        async with turn(session), request.app.state.large:
            return _InParts(_response(await run_in_threadpool(handler, call)), session.large_turn)
    except BaseException:
        session.large_turn.release()
        raise


def _response(result: Any) -> Response:
    return result if isinstance(result, Response) else JSONResponse(result)


async def session_of(request: Request) -> Session | Response:
    """Return the session of a request, or the answer to a request without one."""
    desk: Desk = request.app.state.desk
    session = desk.sessions.find(request.cookies.get(cookie_name(desk)))
    if session is None and "authorization" in request.headers and desk.token is None and request.method in SAFE_METHODS:
        address = request.client.host if request.client else ""
        try:
            session = await run_in_threadpool(desk.basic.session, desk.dsn, request.headers["authorization"], address)
        except UserError as error:
            return JSONResponse({"error": str(error)}, 401, {"WWW-Authenticate": CHALLENGE})
    if session is None:
        return JSONResponse({"error": "sign in"}, 401)
    if request.method not in SAFE_METHODS and request.headers.get("x-csrf-token") != session.csrf:
        return JSONResponse({"error": "the page is out of date: load it again"}, 403)
    return session


def make_call(request: Request, session: Session, body: Any) -> Call:
    """Return the call of a request."""
    desk: Desk = request.app.state.desk
    return Call(desk, session, dict(request.path_params), _query(request), body, dict(request.headers))


async def in_turn(session: Session, handler: Handler, call: Call) -> Any:
    """Run a handler in a thread in the turn of its session."""
    async with turn(session):
        return await run_in_threadpool(handler, call)


@asynccontextmanager
async def turn(session: Session) -> AsyncIterator[None]:
    """Wait until a connection of a session is free: nobody takes the threads of others."""
    await _wait(session, session.gate)
    try:
        yield
    finally:
        session.gate.release()


async def _wait(session: Session, gate: asyncio.Semaphore) -> None:
    """Wait at a gate of a session.

    Raises
    ------
    BusyError
        If too many requests of the session wait.
    """
    if session.waiting >= MAX_WAITING:
        raise BusyError("too many requests at once: try again")
    session.waiting += 1
    try:
        await gate.acquire()
    finally:
        session.waiting -= 1


def answer_to(error: Exception) -> Response:
    """Return the answer that states an error; a bug is logged with its traceback."""
    match error:
        case SignedOutError():
            return JSONResponse({"error": str(error)}, 401)
        case RefusedError():
            return JSONResponse({"error": str(error)}, 403)
        case NotFoundError():
            return JSONResponse({"error": str(error)}, 404)
        case ConflictError():
            return JSONResponse({"error": str(error), **error.values}, 409)
        case BusyError():
            return JSONResponse({"error": str(error)}, 503)
        case UserError():
            return JSONResponse({"error": str(error)}, 400)
        case UnicodeEncodeError():
            return JSONResponse({"error": "a text has characters that no text can have"}, 400)
        case psycopg.Error() if (status := _status(error)) is not None:
            text = NOT_WRITTEN if status == UNREACHABLE else _line(error)
            return JSONResponse({"error": f"you have no right to do this: {text}" if status == 403 else text}, status)
    LOG.error("a request failed", exc_info=error)
    return JSONResponse({"error": "the server has an error, which is in its log"}, 500)


def _status(error: psycopg.Error) -> int | None:
    """Return the status that tells whose fault an error of the database is; None for a bug."""
    state = error.sqlstate
    if state is None and isinstance(error, psycopg.DataError):  # a text with a zero byte, which psycopg refuses
        return 400
    if state is None:
        return UNREACHABLE if isinstance(error, psycopg.OperationalError | psycopg.InterfaceError) else None
    return next((status for start, status in STATUS.items() if state.startswith(start)), None)


def _line(error: psycopg.Error) -> str:
    return error.diag.message_primary or str(error).splitlines()[0]


def _query(request: Request) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for number, (name, value) in enumerate(request.query_params.multi_items()):
        if number >= MAX_QUERY:
            raise UserError(f"more than {MAX_QUERY} values in the address")
        found.setdefault(name, []).append(value)
    return found


async def _body(request: Request) -> Any:
    if request.method in SAFE_METHODS:
        return None
    content = await request.body()
    if not content:
        return None
    try:
        return json.loads(content)
    except (ValueError, RecursionError):
        raise UserError("the body of the request is not JSON") from None
