"""Record of a report in its own file, and verification of the report against the database."""

from __future__ import annotations

import datetime as dt
import json
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psycopg
from markupsafe import Markup

from tunneldb.database import as_of
from tunneldb.errors import InputError, NotReadyError, UserError
from tunneldb.report.facts import Facts, Request
from tunneldb.report.owner import CHAPTERS, Owner, RatingRequest
from tunneldb.report.pictures.load import Source
from tunneldb.store.coverage import read_coverage
from tunneldb.store.survey import Survey, get_survey

_MARK = "% tunneldb "
"""Beginning of the record's line after the end of a PDF, where readers ignore it."""

_IN_HTML = re.compile(r'<script type="application/json" id="record">(.*?)</script>', re.DOTALL)


@dataclass(frozen=True)
class Record:
    """Content that a report's digest was computed from.

    Attributes
    ----------
    survey : str
    low, high : float
        Ends of the stretch, chainage, m.
    at : datetime
        Moment whose state the report has.
    digest : str
    leaks : bool
        True if the report has the table of leaks.
    listed : int
        Maximum number of leaks in it.
    ratings : tuple of RatingRequest
        Ratings, with their versions.
    """

    survey: str
    low: float
    high: float
    at: dt.datetime
    digest: str
    leaks: bool
    listed: int
    ratings: tuple[RatingRequest, ...]


@dataclass(frozen=True)
class Verification:
    """Comparison of a report with the database.

    Attributes
    ----------
    record : Record
    now : str
        Digest of the same report now.
    then : str or None
        Digest of the state at the moment of the report; None if that state is not stored.
    reason : str
        Why it is not stored.
    edits : mapping of (str, str) to int
        Number of edits since, by person and view.
    """

    record: Record
    now: str
    then: str | None
    reason: str
    edits: Mapping[tuple[str, str], int]

    @property
    def unchanged(self) -> bool:
        """True if the database still has what the report states."""
        return self.now == self.record.digest

    @property
    def genuine(self) -> bool | None:
        """True if the database had what the report states at its moment; None if that is not stored."""
        return True if self.unchanged else None if self.then is None else self.then == self.record.digest


def record_of(facts: Facts) -> Record:
    """Return the record of a report."""
    owner = facts.request.owner
    return Record(
        facts.survey.name, facts.low, facts.high, facts.request.at, facts.digest, "leaks" in owner.chapters,
        facts.request.listed,
        tuple(RatingRequest(one.scheme["name"], one.scheme["version"], one.elements) for one in facts.ratings),
    )  # fmt: skip


def as_text(record: Record) -> str:
    """Return a record as JSON on one line."""
    values = vars(record) | {"at": record.at.isoformat(), "ratings": [vars(one) for one in record.ratings]}
    return json.dumps(values)


def in_html(record: Record) -> Markup:
    """Return a record as JSON that a page can contain."""
    return Markup(as_text(record).replace("<", "\\u003c"))


def append_to_pdf(page: Path, pdf: Path) -> None:
    """Append the record of the page that was printed to the PDF."""
    with pdf.open("ab") as file:
        file.write(f"{_MARK}{as_text(read_record(page))}\n".encode())


def read_record(path: Path) -> Record:
    """Read the record of a report, .html or .pdf.

    Raises
    ------
    InputError
        If the file cannot be read or has no record.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}") from None
    if content.startswith(b"%PDF"):
        _, mark, text = content.decode("latin-1").rpartition(f"\n{_MARK}")
        text = text.encode("latin-1").decode("utf-8", "replace") if mark else ""
    else:
        found = _IN_HTML.search(content.decode("utf-8", "replace"))
        text = found.group(1) if found else ""
    try:
        values = json.loads(text)
        return Record(
            str(values["survey"]), values["low"] + 0.0, values["high"] + 0.0, dt.datetime.fromisoformat(values["at"]),
            str(values["digest"]), bool(values["leaks"]), values["listed"] + 0,
            tuple(RatingRequest(one["scheme"], one["version"], one["elements"]) for one in values["ratings"]),
        )  # fmt: skip
    except (ValueError, KeyError, TypeError):
        raise InputError(f"{path} is not a report by tunneldb report, or was changed: it has no record of its digest") from None


def verify(conn: psycopg.Connection[Any], record: Record) -> Verification:
    """Compare a report with the database, now and at the moment of the report; the connection must be idle.

    Raises
    ------
    UserError
        If there is no such survey, scheme or division any more.
    """
    survey = get_survey(conn, record.survey)
    conn.rollback()
    now = _digest(conn, survey, record, None)
    then, reason = (now, "") if now == record.digest else (None, "")
    if then is None:
        try:
            then = _digest(conn, survey, record, record.at)
        except (NotReadyError, UserError) as error:
            reason = str(error)
    rows = conn.execute(
        "SELECT e.who, e.view, count(*) FROM tunnel_api.audit e WHERE e.survey = %s AND e.at > %s GROUP BY 1, 2 ORDER BY 1, 2",
        [record.survey, record.at],
    ).fetchall()
    return Verification(record, now, then, reason, Counter({(who, view): count for who, view, count in rows}))


def _digest(conn: psycopg.Connection[Any], survey: Survey, record: Record, moment: dt.datetime | None) -> str:
    chapters = tuple(name for name in CHAPTERS if name != "leaks" or record.leaks)
    owner = Owner(chapters=chapters, ratings=record.ratings)
    with as_of(conn, survey.name, moment) as at:
        search = read_coverage(conn, survey, record.low, record.high)
        request = Request(
            survey, record.low, record.high, search, owner, Source(Path(), ()), record.listed, 0, "WEBP",
            lambda done, count: None, at,
        )  # fmt: skip
        return Facts(conn, request).digest
