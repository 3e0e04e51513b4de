"""Sign in, by a token of one use or by a database role and its password, and sign out."""

from __future__ import annotations

import secrets
from urllib.parse import parse_qsl

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse, RedirectResponse, Response

from tunneldb import __version__
from tunneldb.errors import UserError
from tunneldb.web.config import Desk
from tunneldb.web.pages import TEMPLATES
from tunneldb.web.route import LOG, Call, cookie_name
from tunneldb.web.sessions import CONNECTIONS, RefusedError, Session, open_for, open_own

FORM_COOKIE = "tunneldb_form"
"""Cookie that the sign-in form repeats, so that no other page can send it."""


MAX_FORM, MAX_FIELDS = 8192, 5
"""Maximum length of the sign-in form, bytes, and of the number of its fields."""


async def page(request: Request) -> Response:
    """Show the desk, or the way to it."""
    desk: Desk = request.app.state.desk
    session = desk.sessions.find(request.cookies.get(cookie_name(desk)))
    if session is None:
        return _again(request) if _from_elsewhere(request) else RedirectResponse("/login", 303)
    return TEMPLATES.TemplateResponse(
        request,
        "desk.html",
        {"version": __version__, "csrf": session.csrf, "user": session.user, "role": session.role},
    )


async def open_desk(request: Request) -> Response:
    """Lead to the desk: where a step from ``/`` to itself would not ask the server (`_again`)."""
    return RedirectResponse("/", 303)


async def form(request: Request) -> Response:
    """Show the sign-in form."""
    desk: Desk = request.app.state.desk
    if desk.token is not None:
        return _plain(
            "Open the address that `tunneldb serve` printed. It works once: start the command again for a new one.", 403
        )
    return _form(request, "")


async def enter(request: Request) -> Response:
    """Take the token of the person who started the server."""
    desk: Desk = request.app.state.desk
    if not desk.take_token(request.query_params.get("token", "")):
        return _plain("This address was used, or is wrong. Start `tunneldb serve` again for a new one.", 403)
    session = await run_in_threadpool(
        lambda: desk.sessions.begin([open_own(desk.dsn) for _ in range(CONNECTIONS)], lambda: open_own(desk.dsn))
    )
    return _signed_in(desk, session, _again(request) if _from_elsewhere(request) else RedirectResponse("/", 303))


def _from_elsewhere(request: Request) -> bool:
    """Return True if a link of another page, a file or another program leads here: the browser then sends no strict cookie."""
    return request.headers.get("sec-fetch-site") == "cross-site"


def _again(request: Request) -> Response:
    """Return a page that opens the desk at the same place, as a step of the desk itself: then the cookie is sent."""
    return TEMPLATES.TemplateResponse(request, "again.html")


async def sign_in(request: Request) -> Response:
    """Check user and password against the database, and begin a session."""
    desk: Desk = request.app.state.desk
    sent = await _fields(request)
    user, password, token = (sent.get(name, "") for name in ("user", "password", "csrf"))
    given = request.cookies.get(FORM_COOKIE, "")
    if desk.token is not None or not given or not secrets.compare_digest(given.encode(), token.encode()):
        return _form(request, "The form was out of date: try again.", 403)
    address = request.client.host if request.client else ""
    if not desk.limit.attempt(user, address):
        return _form(request, "Too many failed attempts: wait a minute.", 429)
    try:
        session = await run_in_threadpool(lambda: desk.sessions.begin(open_for(desk.dsn, user, password), None))
    except RefusedError as error:
        return _form(request, f"Not signed in: {error}.", 403)
    except UserError as error:
        LOG.warning("nobody can sign in: %s", error)
        return _form(request, "Not signed in: the database cannot be reached.", 503)
    desk.limit.succeeded(user, address)
    if (former := desk.sessions.find(request.cookies.get(cookie_name(desk)))) is not None:
        desk.sessions.end(former)
    return _signed_in(desk, session, RedirectResponse("/", 303))


def sign_out(call: Call) -> Response:
    """End the session."""
    call.desk.sessions.end(call.session)
    response = JSONResponse({})
    response.delete_cookie(cookie_name(call.desk), secure=call.desk.secure, httponly=True, samesite="strict")
    return response


async def _fields(request: Request) -> dict[str, str]:
    """Return the fields of the sign-in form; none if it is too long or of another kind."""
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind != "application/x-www-form-urlencoded" or int(request.headers.get("content-length", "0")) > MAX_FORM:
        return {}
    text = (await request.body()).decode("utf-8", "replace")
    try:
        return dict(parse_qsl(text, max_num_fields=MAX_FIELDS))
    except ValueError:
        return {}


def _signed_in(desk: Desk, session: Session, response: Response) -> Response:
    response.set_cookie(cookie_name(desk), session.key, httponly=True, samesite="strict", secure=desk.secure)
    return response


def _form(request: Request, error: str, status: int = 200) -> Response:
    # A second form of the same browser leaves the first one valid.
    token = request.cookies.get(FORM_COOKIE) or secrets.token_urlsafe(24)
    response = TEMPLATES.TemplateResponse(request, "login.html", {"csrf": token, "error": error}, status_code=status)
    response.set_cookie(
        FORM_COOKIE, token, httponly=True, samesite="strict", secure=request.app.state.desk.secure, path="/login"
    )
    return response


def _plain(text: str, status: int) -> Response:
    return Response(text + "\n", status, media_type="text/plain")
