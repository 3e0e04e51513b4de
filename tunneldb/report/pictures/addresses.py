"""Servers from which photos may come: any with a public address, and those that whoever writes the report allows."""

from __future__ import annotations

import ipaddress
import socket
from collections.abc import Collection
from dataclasses import dataclass
from urllib.parse import quote, urlsplit

from tunneldb.report.pictures.trouble import (
    BAD_ADDRESS,
    NO_SERVER,
    NOT_ENCRYPTED,
    NOT_PUBLIC,
    UNKNOWN_SCHEME,
    PictureError,
)

PORTS = {"http": 80, "https": 443}
"""Schemes of web addresses, and their ports."""

_TRANSLATORS = (ipaddress.ip_network("64:ff9b::/96"), ipaddress.ip_network("64:ff9b:1::/48"))  # RFC 6052, RFC 8215

_KEPT = "/?%:@!$&'()*+,;=~[]"  # characters of a path and a query, RFC 3986

Address = ipaddress.IPv4Address | ipaddress.IPv6Address


def is_web(path: str) -> bool:
    """Return True for a path that needs the network."""
    scheme, separator, _ = path.partition("://")
    return bool(separator) and scheme.lower() in PORTS


@dataclass(frozen=True)
class Target:
    """A web address, checked as far as its text goes.

    Attributes
    ----------
    host, port
        Server.
    encrypted
        True for https://.
    path
        Path and query.
    allowed
        True if whoever writes the report allows this server.
    """

    host: str
    port: int
    encrypted: bool
    path: str
    allowed: bool


def parse_server(text: str) -> str:
    """Return an allowed server, ``HOST`` or ``HOST:PORT``, in lower case.

    Raises
    ------
    ValueError
        If it is neither.
    """
    parts = urlsplit(f"//{text}")
    if not parts.hostname or parts.netloc != text or "@" in text or any(c.isspace() for c in text):
        raise ValueError(text)
    host = f"[{parts.hostname}]" if ":" in parts.hostname else parts.hostname
    return host if parts.port is None else f"{host}:{parts.port}"


def parse_address(url: str, servers: Collection[str]) -> Target:
    """Return the target of a web address.

    Parameters
    ----------
    url : str
    servers : collection of str
        Allowed servers, by `parse_server`. One without a port is allowed on the ports of http and https.

    Raises
    ------
    PictureError
        If it is not https, or http of an allowed server, or not valid.
    """
    try:
        parts = urlsplit(url)
        host, port = (parts.hostname or "").encode("idna").decode() if parts.hostname else "", parts.port
    except ValueError as error:
        raise PictureError(BAD_ADDRESS) from error
    if parts.scheme not in PORTS:
        raise PictureError(UNKNOWN_SCHEME)
    if not host or "@" in parts.netloc or not url.isprintable():
        raise PictureError(BAD_ADDRESS)
    number = PORTS[parts.scheme] if port is None else port
    name = f"[{host}]" if ":" in host else host
    allowed = f"{name}:{number}" in servers or (number in PORTS.values() and name in servers)
    if parts.scheme == "http" and not allowed:
        raise PictureError(NOT_ENCRYPTED)
    path = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
    return Target(host, number, parts.scheme == "https", quote(path, safe=_KEPT), allowed)


def resolve(target: Target) -> list[str]:
    """Return the addresses of a server; the connection must be made to one of them, since a second look-up may differ.

    Raises
    ------
    PictureError
        If it has none, or one that is not public, and it is not an allowed server.
    """
    try:
        found = socket.getaddrinfo(target.host, target.port, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError) as error:
        raise PictureError(NO_SERVER) from error
    addresses = [str(entry[4][0]) for entry in found]
    if not target.allowed and not all(is_public(ipaddress.ip_address(address)) for address in addresses):
        raise PictureError(NOT_PUBLIC)
    return addresses


def is_public(address: Address) -> bool:
    """Return True for an address of the public internet; False for loopback, private, link-local, multicast and the like.

    An IPv6 address that stands for IPv4 addresses (mapped, 6to4, Teredo, NAT64) is public if these are.
    """
    if inner := _inner(address):
        return all(map(is_public, inner))
    if isinstance(address, ipaddress.IPv6Address) and address.is_site_local:
        return False
    return address.is_global and not (address.is_multicast or address.is_reserved or address.is_unspecified)


def _inner(address: Address) -> tuple[ipaddress.IPv4Address, ...]:
    """Return the IPv4 addresses within an IPv6 address, empty if it has none."""
    if isinstance(address, ipaddress.IPv4Address):
        return ()
    if address.ipv4_mapped is not None:
        return (address.ipv4_mapped,)
    if address.sixtofour is not None:
        return (address.sixtofour,)
    if address.teredo is not None:
        return address.teredo
    if any(address in network for network in _TRANSLATORS):
        return (ipaddress.IPv4Address(int(address) & 0xFFFFFFFF),)
    return ()
