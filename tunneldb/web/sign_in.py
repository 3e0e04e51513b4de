"""Sign in, by a token of one use or by a database role and its password, and sign out."""

from __future__ import annotations

import secrets

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse, RedirectResponse, Response

from tunneldb import __version__
from tunneldb.errors import UserError
from tunneldb.web.config import Desk
from tunneldb.web.pages import TEMPLATES
from tunneldb.web.route import COOKIE, Call
from tunneldb.web.sessions import CONNECTIONS, RefusedError, Session, open_for, open_own

FORM_COOKIE = "tunneldb_form"
"""Cookie that the sign-in form repeats, so that no other page can send it."""


async def page(request: Request) -> Response:
    """Show the desk, or the way to it."""
    desk: Desk = request.app.state.desk
    session = desk.sessions.find(request.cookies.get(COOKIE))
    if session is None:
        return RedirectResponse("/login", 303)
    return TEMPLATES.TemplateResponse(
        request,
        "desk.html",
        {"version": __version__, "csrf": session.csrf, "user": session.user, "role": session.role},
    )


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
    return _signed_in(desk, session)


async def sign_in(request: Request) -> Response:
    """Check user and password against the database, and begin a session."""
    desk: Desk = request.app.state.desk
    sent = await request.form(max_files=0, max_fields=5)
    user, password, token = (str(sent.get(name) or "") for name in ("user", "password", "csrf"))
    given = request.cookies.get(FORM_COOKIE, "")
    if desk.token is not None or not given or not secrets.compare_digest(given.encode(), token.encode()):
        return _form(request, "The form was out of date: try again.", 403)
    names = f"address {request.client.host if request.client else ''}", f"user {user[:200]}"
    if desk.limit.refuses(*names):
        return _form(request, "Too many failed attempts: wait a minute.", 429)
    try:
        session = await run_in_threadpool(lambda: desk.sessions.begin(open_for(desk.dsn, user, password), None))
    except RefusedError as error:
        desk.limit.failed(*names)
        return _form(request, f"Not signed in: {error}.", 403)
    except UserError as error:
        return _form(request, f"Not signed in: {error}.", 503)
    return _signed_in(desk, session)


def sign_out(call: Call) -> Response:
    """End the session."""
    call.desk.sessions.end(call.session)
    response = JSONResponse({})
    response.delete_cookie(COOKIE)
    return response


def _signed_in(desk: Desk, session: Session) -> Response:
    response = RedirectResponse("/", 303)
    response.set_cookie(COOKIE, session.key, httponly=True, samesite="strict", secure=desk.secure)
    return response


def _form(request: Request, error: str, status: int = 200) -> Response:
    token = secrets.token_urlsafe(24)
    response = TEMPLATES.TemplateResponse(request, "login.html", {"csrf": token, "error": error}, status_code=status)
    response.set_cookie(
        FORM_COOKIE, token, httponly=True, samesite="strict", secure=request.app.state.desk.secure, path="/login"
    )
    return response


def _plain(text: str, status: int) -> Response:
    return Response(text + "\n", status, media_type="text/plain")
