"""The command ``serve``."""

from __future__ import annotations

import ipaddress
import secrets
import signal
import socket
import ssl
import tempfile
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.output import AS_JSON, add_to_json, command
from tunneldb.cli.param_types import FilePath, WholeRange
from tunneldb.database import open_connection, resolve_dsn
from tunneldb.database.schema import installed_api_version
from tunneldb.errors import UserError


@command(
    examples=[
        "tunneldb serve",
        "tunneldb --dsn service=tunnels serve --host 0.0.0.0 --certificate desk.pem --key desk.key",
        "tunneldb --dsn service=tunnels serve --host 0.0.0.0 --behind-proxy",
    ]
)
@click.option("--port", type=WholeRange(0, 65535), default=8080, show_default=True, help="Port; 0 for a free one.")
@click.option("--host", default="127.0.0.1", show_default=True, help="Address to listen on.")
@click.option("--certificate", type=FilePath(), metavar="FILE", help="TLS certificate, PEM.")
@click.option("--key", type=FilePath(), metavar="FILE", help="Private key of the certificate, PEM.")
@click.option(
    "--behind-proxy", is_flag=True, help="A proxy with TLS is in front: other machines may reach it without a certificate."
)
@click.option(
    "--photos", type=FilePath(), metavar="FOLDER", help="Folder to store uploaded photos in. Default: in the database."
)
@click.option("--dsn", "own_dsn", metavar="DSN", help="Database, as tunneldb --dsn.")
@click.option("--no-open", is_flag=True, help="Do not open a browser.")
@click.pass_obj
def serve(
    settings: Settings,
    port: int,
    host: str,
    certificate: Path | None,
    key: Path | None,
    behind_proxy: bool,
    photos: Path | None,
    own_dsn: str | None,
    no_open: bool,
) -> None:
    """Serve the desk, a page for inspections in a browser, until stopped.

    With the embedded server the desk is for this machine only: the printed address has a token that works once. With
    --dsn each person signs in with a database role of their own and its password; the roles decide what is allowed.

    Ends on Ctrl-C or SIGTERM.
    """
    import uvicorn

    from tunneldb.web.app import create_app
    from tunneldb.web.config import Desk
    from tunneldb.web.memory import return_freed_memory
    from tunneldb.web.protocol import PunctualProtocol, raise_file_limit

    given = settings.dsn if own_dsn is None else own_dsn
    loopback = _is_loopback(host)
    if given is None and (behind_proxy or not loopback):
        raise UserError("the embedded server is for this machine only; give a server of your own with --dsn")
    if (certificate is None) != (key is None):
        raise UserError("--certificate and --key belong together")
    if not loopback and certificate is None and not behind_proxy:
        raise UserError(
            f"--host {host}: passwords would cross the network unencrypted; give --certificate and --key,"
            " or --behind-proxy if a proxy with TLS is in front"
        )
    if certificate is not None and key is not None:
        _check(certificate, key)
    if photos is not None:
        _require_folder(photos)
    dsn = resolve_dsn(given)
    _require_schema(dsn)
    token = secrets.token_urlsafe(32) if given is None else None
    desk = Desk(
        dsn, token, loopback=loopback and not behind_proxy, secure=certificate is not None or behind_proxy, photos=photos
    )
    listener = _listen(host, port)
    scheme = "http" if certificate is None else "https"
    name = f"[{host}]" if ":" in host else host
    address = f"{scheme}://{name}:{listener.getsockname()[1]}/" + (f"enter?token={token}" if token else "")
    server = uvicorn.Server(
        uvicorn.Config(
            create_app(desk),
            http=PunctualProtocol,
            access_log=False,
            log_level="warning",
            ssl_certfile=certificate,
            ssl_keyfile=key,
            proxy_headers=behind_proxy,
            server_header=False,
            timeout_graceful_shutdown=10,
        )
    )

    def leave(number: int, frame: object) -> None:
        server.should_exit = True

    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, leave)  # until uvicorn has its own, and when it sends itself the signal again at the end
    # With --json, standard output is one object, at the end.
    click.echo(address, err=bool(click.get_current_context().meta.get(AS_JSON)))
    add_to_json(address=address.partition("enter")[0])
    raise_file_limit()
    return_freed_memory()
    with listener, _opened(None if no_open or not loopback else address):
        server.run(sockets=[listener])


def _require_schema(dsn: str) -> None:
    """Raise UserError if the database lacks tunneldb; the role of the desk may be one that only reads."""
    with open_connection(dsn) as conn:
        if installed_api_version(conn) is None:
            raise UserError("the database is not set up for tunneldb yet; type tunneldb init")


def _require_folder(path: Path) -> None:
    """Raise UserError if this is not a folder in which files can be written."""
    if not path.is_dir():
        raise UserError(f"--photos {path}: there is no such folder; create it")
    try:
        with tempfile.TemporaryFile(dir=path):
            pass
    except OSError as error:
        raise UserError(f"--photos {path}: cannot be written to: {error.strerror or error}") from None


def _check(certificate: Path, key: Path) -> None:
    """Raise UserError if these files are no certificate and its key."""
    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(certificate, key)
    except (OSError, ssl.SSLError) as error:
        raise UserError(f"{certificate}, {key}: not a certificate and its key without a passphrase, PEM: {error}") from None


@contextmanager
def _opened(address: str | None) -> Iterator[None]:
    """Open an address in a browser, by a file of this user alone: others could read a token on the browser's command line."""
    if address is None:
        yield
        return
    with tempfile.NamedTemporaryFile("w", prefix="tunneldb-", suffix=".html") as page:
        page.write(f'<!doctype html><meta http-equiv="refresh" content="0; url={address}"><title>tunneldb</title>')
        page.flush()
        webbrowser.open(Path(page.name).as_uri())
        yield


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _listen(host: str, port: int) -> socket.socket:
    """Return a socket that listens on an address.

    Raises
    ------
    UserError
        If it cannot.
    """
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
        listener = socket.socket(family, kind, protocol)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(address)
        listener.listen(128)
    except (OSError, UnicodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "no such name"
        raise UserError(f"cannot listen on {host}, port {port}: {reason}; choose another --host or --port") from None
    return listener
