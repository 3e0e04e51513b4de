"""Process that reads and decodes pictures for another, one at a time; it is ended when one takes too long.

Requests and answers are JSON, through the socket whose descriptor is the argument. ``read`` fetches or opens a picture,
``decode`` makes a small version of it. Nothing else ends a hanging decoder, a look-up of a name, or a server that sends a byte
now and then.
"""

from __future__ import annotations

import base64
import io
import json
import resource
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, BinaryIO
from urllib.request import url2pathname

from tunneldb.report.pictures.addresses import is_web
from tunneldb.report.pictures.decode import shrink_logo, shrink_photo
from tunneldb.report.pictures.local import open_picture
from tunneldb.report.pictures.trouble import TOO_LARGE, UNKNOWN_SCHEME, PictureError
from tunneldb.report.pictures.upload import clean_photo
from tunneldb.report.pictures.web import fetch

MAX_BYTES = 60_000_000
"""Maximum bytes of a picture."""

MAX_MEMORY = 1 << 30
"""Maximum address space of the process, bytes."""

_SPARE = 5.0  # s after its deadline at which the process ends by itself, if the other one is gone
_SHRINK: dict[str, Callable[[BinaryIO], tuple[bytes, str]]] = {
    "photo": shrink_photo,
    "logo": shrink_logo,
    "upload": clean_photo,
}


def main(descriptor: int) -> None:
    """Answer requests until the other process closes the connection."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the other process, which then ends this one
    for limit, value in ((resource.RLIMIT_AS, MAX_MEMORY), (resource.RLIMIT_CORE, 0), (resource.RLIMIT_FSIZE, 0)):
        hard = resource.getrlimit(limit)[1]
        resource.setrlimit(limit, (value if hard == resource.RLIM_INFINITY else min(value, hard), hard))
    data: BinaryIO = io.BytesIO()
    with Connection(descriptor) as connection, suppress(EOFError, ConnectionError):
        while True:
            asked = json.loads(connection.recv_bytes())
            signal.setitimer(signal.ITIMER_REAL, asked["seconds"] + _SPARE)
            answer = {"url": "", "trouble": ""}
            try:
                if asked["work"] == "read":
                    data.close()
                    data = read(asked)
                else:
                    content, kind = _SHRINK[asked["form"]](data)
                    answer["url"] = f"data:{kind};base64,{base64.b64encode(content).decode()}"
            except PictureError as error:
                answer["trouble"] = str(error)
            except MemoryError:
                answer["trouble"] = TOO_LARGE
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            connection.send_bytes(json.dumps(answer).encode())


def read(asked: dict[str, Any]) -> BinaryIO:
    """Return the content of a picture.

    Raises
    ------
    PictureError
        If it is refused, or not available.
    """
    path: str = asked["path"]
    if is_web(path):
        return io.BytesIO(fetch(path, asked["servers"], MAX_BYTES))
    scheme, separator, rest = path.partition("://")
    if separator and scheme.lower() != "file":
        raise PictureError(UNKNOWN_SCHEME)
    return open_picture(url2pathname(rest) if separator else path, Path(asked["folder"]), MAX_BYTES, confined=asked["confined"])


if __name__ == "__main__":
    main(int(sys.argv[1]))
