"""Middleware: headers of all answers, permitted hosts, and limits of requests."""

from __future__ import annotations

import re
from collections.abc import Awaitable, Callable

from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from tunneldb.web.pages import STATIC

POLICY = (
    "default-src 'self'; img-src 'self' data: blob:; style-src 'self'; script-src 'self'; worker-src 'self' blob:;"
    " connect-src 'self'; object-src 'none'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
)
"""Content security policy: no inline script, nothing from other servers."""

HEADERS = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "X-Frame-Options": "DENY",
}

MAX_BODY = 2_000_000
"""Maximum length of a request's body, bytes."""

MAX_PHOTO = 25_000_000
"""Maximum length of a photo, bytes."""

_PHOTOS = re.compile(r"/api/findings/[0-9]{1,18}/photos")

LOOPBACK = ("127.0.0.1", "localhost", "[::1]")
"""Names of this machine; a page of another name that leads here is refused (DNS rebinding)."""

SAFE_METHODS = ("GET", "HEAD", "OPTIONS")

Next = Callable[[Request], Awaitable[Response]]


def guard(loopback: bool, secure: bool) -> Callable[[Request, Next], Awaitable[Response]]:
    """Return the middleware function.

    Parameters
    ----------
    loopback : bool
        True to answer only requests to names of this machine.
    secure : bool
        True if the desk is reached by TLS.
    """
    headers = HEADERS | ({"Strict-Transport-Security": "max-age=31536000"} if secure else {})

    async def dispatch(request: Request, proceed: Next) -> Response:
        response = refusal(request, loopback) or await proceed(request)
        for name, value in headers.items():
            response.headers.setdefault(name, value)
        kept = response.status_code == 200 and request.scope["path"].startswith(f"{STATIC}/")
        response.headers.setdefault("Cache-Control", "public, max-age=31536000, immutable" if kept else "no-store")
        return response

    return dispatch


def refusal(request: Request, loopback: bool) -> Response | None:
    """Return the answer to a request that is not served; None if it is."""
    host = request.headers.get("host", "")
    name = host if host.endswith("]") else host.rsplit(":", 1)[0]
    if loopback and name not in LOOPBACK:
        return JSONResponse({"error": "this desk answers on this machine only, as localhost"}, 421)
    if request.method not in SAFE_METHODS:
        origin = request.headers.get("origin")
        if origin is not None and origin.partition("://")[2] != host:
            return JSONResponse({"error": "the request comes from another page"}, 403)
        if "transfer-encoding" in request.headers:
            return JSONResponse({"error": "state the length of the request"}, 411)
        length, most = request.headers.get("content-length", "0"), _most(request)
        if not length.isdigit() or int(length) > most:
            return JSONResponse({"error": f"the request is longer than {most:,} bytes"}, 413)
    return None


def _most(request: Request) -> int:
    """Return the maximum length of a request's body, bytes."""
    return MAX_PHOTO if request.method == "POST" and _PHOTOS.fullmatch(request.scope["path"]) else MAX_BODY
