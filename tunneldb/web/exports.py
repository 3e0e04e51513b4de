"""Downloads of a stretch: report, workbook and GeoPackage, as the commands write them.

The writers are imported when they are first used: they need as much memory as the rest of the desk.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import psycopg
from starlette.responses import FileResponse, Response
from starlette.types import Receive, Scope, Send

from tunneldb.errors import UserError
from tunneldb.store.survey import Survey, get_survey
from tunneldb.web.route import Call, NotFoundError
from tunneldb.web.sessions import PREPARED, Connection, RefusedError

Writer = Callable[[Connection, Survey, float, float, Path, Path | None], None]
"""Writes a file of a survey between two chainages, m, with the photos of a folder."""


def _report(conn: Connection, survey: Survey, low: float, high: float, path: Path, photos: Path | None) -> None:
    from tunneldb.report.page import write_html
    from tunneldb.report.pictures.load import Source

    # No other file of the server may get into a report.
    write_html(conn, survey, path, low, high, photos=Source(path.parent / "photos" if photos is None else photos))


def _geopackage(conn: Connection, survey: Survey, low: float, high: float, path: Path, photos: Path | None) -> None:
    from tunneldb.export.exchange import write_survey

    write_survey(conn, survey, low, high, path)


def _workbook(conn: Connection, survey: Survey, low: float, high: float, path: Path, photos: Path | None) -> None:
    from tunneldb.export.tables.stretch_workbook import write_stretch_workbook

    write_stretch_workbook(conn, survey, low, high, path)


WRITERS: dict[str, tuple[str, str, Writer]] = {
    "report": ("html", "text/html", _report),
    "xlsx": ("xlsx", "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet", _workbook),
    "gpkg": ("gpkg", "application/geopackage+sqlite3", _geopackage),
}
"""Suffix, media type and function of each kind of download."""


def export(call: Call) -> Response:
    """Return a file of a stretch."""
    what = call.query.get("what", [""])[0]
    if what not in WRITERS:
        raise NotFoundError(f"what={what[:40]}: one of {', '.join(WRITERS)}")
    suffix, media, write = WRITERS[what]
    low, high = call.number("from", -np.inf), call.number("to", np.inf)
    if not low < high:
        raise UserError("the stretch ends before it begins")
    folder = Path(tempfile.mkdtemp(prefix="tunneldb-desk-"))
    try:
        with call.session.connection() as conn:
            survey = _written(conn, call, write, low, high, folder / f"download.{suffix}")
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    ends = "" if np.isinf([low, high]).all() else f"-{low:.0f}-{high:.0f}"
    return _Download(folder / f"download.{suffix}", media_type=media, filename=f"{survey.name}{ends}.{suffix}")


class _Download(FileResponse):
    """A file that is deleted, with its folder, however the answer ends."""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        try:
            await super().__call__(scope, receive, send)
        finally:
            shutil.rmtree(Path(self.path).parent, ignore_errors=True)


def _written(conn: Connection, call: Call, write: Writer, low: float, high: float, path: Path) -> Survey:
    """Write a file from one moment of the database."""
    conn.autocommit = False
    conn.prepare_threshold = None  # the plan of a statement would be that for the partitions of all surveys
    try:
        survey = get_survey(conn, call.path["survey"])
        conn.rollback()
        write(conn, survey, low, high, path, call.desk.photos)
        return survey
    except psycopg.errors.InsufficientPrivilege:
        raise RefusedError("downloads need the role tunnel_operator") from None
    finally:
        if not conn.closed:
            conn.rollback()
            conn.autocommit = True
            conn.prepare_threshold = PREPARED
