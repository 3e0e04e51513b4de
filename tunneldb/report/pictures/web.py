"""Content of a web address. A connection has no deadline of its own: the process that asks for it is ended at its deadline."""

from __future__ import annotations

import http.client
import socket
import ssl
from collections.abc import Collection
from urllib.parse import urljoin

from tunneldb import __version__
from tunneldb.report.pictures.addresses import Target, parse_address, resolve
from tunneldb.report.pictures.trouble import (
    BAD_ADDRESS,
    DENIED,
    FAILED,
    NO_CONNECTION,
    NOT_FOUND,
    NOT_TRUSTED,
    REDIRECTED,
    TOO_LARGE,
    PictureError,
)

MAX_REDIRECTS = 5
"""Maximum number of redirects; the address of each is checked like the first."""

_TROUBLES = {401: DENIED, 403: DENIED, 404: NOT_FOUND, 410: NOT_FOUND}
_REDIRECTS = (301, 302, 303, 307, 308)


def fetch(url: str, servers: Collection[str], max_bytes: int) -> bytes:
    """Return the content of a web address. Proxies of the environment are not used, since they would resolve names anew.

    Raises
    ------
    PictureError
        If it is refused, or not available.
    """
    for _ in range(MAX_REDIRECTS + 1):
        content, url = _ask(parse_address(url, servers), url, max_bytes)
        if content is not None:
            return content
    raise PictureError(REDIRECTED)


def _ask(target: Target, url: str, max_bytes: int) -> tuple[bytes | None, str]:
    """Return the content, or None and the address of a redirect."""
    kind = http.client.HTTPSConnection if target.encrypted else http.client.HTTPConnection
    connection = kind(target.host, target.port)
    connection.sock = _connect(target)
    try:
        headers = {"User-Agent": f"tunneldb/{__version__}", "Accept-Encoding": "identity", "Connection": "close"}
        connection.request("GET", target.path, headers=headers)
        answer = connection.getresponse()
        place = answer.headers.get("Location")
        if answer.status in _REDIRECTS and place is not None:
            return None, urljoin(url, place)
        if answer.status != 200:
            raise PictureError(_TROUBLES.get(answer.status, FAILED))
        return _content(answer, max_bytes), url
    except http.client.InvalidURL as error:
        raise PictureError(BAD_ADDRESS) from error
    except (OSError, http.client.HTTPException, ValueError) as error:
        raise PictureError(FAILED) from error
    finally:
        connection.close()


def _content(answer: http.client.HTTPResponse, max_bytes: int) -> bytes:
    data = bytearray()
    while chunk := answer.read1(1 << 16):
        data += chunk
        if len(data) > max_bytes:
            raise PictureError(TOO_LARGE)
    return bytes(data)


def _connect(target: Target) -> socket.socket:
    """Connect to an address of the server that was checked."""
    error: OSError | None = None
    for address in resolve(target):
        try:
            connection = socket.create_connection((address, target.port))
        except OSError as failed:
            error = failed
            continue
        if not target.encrypted:
            return connection
        try:
            return ssl.create_default_context().wrap_socket(connection, server_hostname=target.host)
        except (OSError, ValueError) as failed:  # of certificates too
            connection.close()
            raise PictureError(NOT_TRUSTED) from failed
    raise PictureError(NO_CONNECTION) from error
