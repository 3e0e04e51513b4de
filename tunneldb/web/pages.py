"""Pages of the desk, and the files that they load."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.templating import Jinja2Templates

FOLDER = Path(__file__).parent
TEMPLATES = Jinja2Templates(FOLDER / "templates")
"""Templates; Jinja2 escapes what is put into them."""

_IMPORT = re.compile(r"^(?:import|export) [^;]*?'\./([\w./-]+\.js)';", re.MULTILINE)


def _digest(folder: Path) -> str:
    """Return a name for the content of a folder."""
    total = hashlib.sha256()
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        total.update(str(path.relative_to(folder)).encode() + b"\0" + path.read_bytes())
    return total.hexdigest()[:16]


def _modules(folder: Path, name: str) -> list[str]:
    """Return a module with those that it imports, directly or not."""
    found, left = [], [name]
    while left:
        one = left.pop()
        found.append(one)
        left.extend(other for other in _IMPORT.findall((folder / one).read_text()) if other not in (*found, *left))
    return sorted(found)


STATIC = f"/static/{_digest(FOLDER / 'static')}"
"""Path of the files; another one with each version, so browsers need not ask whether a file has changed."""

WORKER_HEADERS = {"Cache-Control": "no-cache", "Service-Worker-Allowed": "/"}


async def worker(request: Request) -> Response:
    """Return the service worker; a browser asks each time whether it has changed."""
    return FileResponse(FOLDER / "static" / "worker.js", media_type="text/javascript", headers=WORKER_HEADERS)


TEMPLATES.env.globals |= {"static": STATIC, "modules": _modules(FOLDER / "static", "main.js")}
