"""Report as one HTML file, written piece by piece, so that memory does not grow with the pictures."""

from __future__ import annotations

import datetime as dt
import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
import psycopg

from tunneldb import __version__
from tunneldb.database import as_of
from tunneldb.errors import NotReadyError
from tunneldb.export.tables.finding_counts import ORIGINS, SEVERITIES, STATES, UNCOUNTED
from tunneldb.export.tables.leaks import clock_label
from tunneldb.finding_kind import REVIEW_COLOURS
from tunneldb.report import data, text
from tunneldb.report.actions import follow_up_text
from tunneldb.report.chapters import ALL
from tunneldb.report.facts import Facts, Request, digest_spots
from tunneldb.report.findings import STATE_WORDS
from tunneldb.report.gaps import gaps_statement
from tunneldb.report.leak_table import leak_table
from tunneldb.report.lining import Form
from tunneldb.report.owner import Owner
from tunneldb.report.photos import Thumbnail
from tunneldb.report.pictures.load import Source
from tunneldb.report.rating import headline, measured, name_elements, result_text
from tunneldb.report.record import in_html, record_of
from tunneldb.report.strip import Progress
from tunneldb.report.structures import read_structures
from tunneldb.store.catalog import crs_text
from tunneldb.store.coverage import read_coverage
from tunneldb.store.remarks import read_remarks
from tunneldb.store.survey import Survey

MAX_LISTED_LEAKS = 10_000
"""Default number of leaks that a report lists and draws, the largest; the others are only counted."""


@dataclass(frozen=True)
class Written:
    """Numbers of a report.

    Attributes
    ----------
    leaks, findings : int
        Number of leaks, and of findings of all kinds, that are included in totals: existing, and not rejected.
    missing : list of Thumbnail
        Photos that can't be had.
    """

    leaks: int
    findings: int
    missing: list[Thumbnail]


def write_html(
    conn: psycopg.Connection[Any],
    survey: Survey,
    path: Path,
    low: float = -np.inf,
    high: float = np.inf,
    progress: Progress = lambda done, count: None,
    pictures: int | None = None,
    form: Form = "WEBP",
    owner: Owner | None = None,
    photos: Source | None = None,
    listed: int = MAX_LISTED_LEAKS,
    moment: dt.datetime | None = None,
) -> Written:
    """Write the report of a survey, or of the stretch between two chainages, m, as an HTML file; the connection must be idle.

    Parameters
    ----------
    conn, survey, path, low, high
        Content, and target.
    progress : callable
        Called after each strip.
    pictures : int, optional
        Maximum number of leaks, the largest, with pictures in the file.
    form : {'WEBP', 'JPEG'}
        Format of the pictures.
    owner : Owner, optional
        Owner's settings.
    photos : Source, optional
        Folder and servers of photos; else files in the current folder, and the web.
    listed : int
        Maximum number of leaks, the largest, that are listed and drawn; rejected ones last. Totals and digest include all.
    moment : datetime, optional
        Moment at which the survey is reported; else the present.
    """
    wanted = Owner() if owner is None else owner
    with as_of(conn, survey.name, moment) as at:
        search = read_coverage(conn, survey, low, high)
        ends = data.find_stretch(conn, survey, low, high)
        place = Source() if photos is None else photos
        facts = Facts(
            conn, Request(survey, *ends, search, wanted, place, listed, pictures, form, progress, at, moment is not None)
        )
        with path.open("w", encoding="utf-8") as file:
            file.writelines(_template("report.html", wanted).generate(_context(facts)))
        found = facts.findings
        return Written(facts.sums.counted, found.counted if found else 0, found.missing if found else [])


def write_site_html(conn: psycopg.Connection[Any], survey: Survey, path: Path, owner: Owner | None = None) -> int:
    """Write the report of a survey of a site, with the chapter on structures; the connection must be idle.

    Returns
    -------
    int
        Number of spots that it counts: found last, and not rejected.

    Raises
    ------
    UserError
        Members were never looked for.
    """
    with as_of(conn, survey.name) as now:
        found = read_structures(conn, survey)
        if found is None:
            raise NotReadyError(f"survey {survey.name} has nothing to report yet: tunneldb members {survey.name}")
        numbers = {spot.id: spot.number for spot in found.spots.rows}
        edits_in_all, edits = data.read_edits(conn, survey, now)
        context = {
            "survey": survey,
            "version": __version__,
            "now": now,
            "digest": digest_spots(hashlib.sha256(survey.name.encode()), found).hexdigest()[:16],
            "structures": found,
            "files": data.read_files_of_site(conn, survey),
            "remarks": read_remarks(conn, survey),
            "runs": data.read_member_runs(conn, survey),
            "edits": [text.edit(edit, numbers) for edit in edits],
            "edits_in_all": edits_in_all,
            "crs": text.crs(crs_text(conn, survey.srid)),
        }
        with path.open("w", encoding="utf-8") as file:
            file.writelines(_template("site.html", Owner() if owner is None else owner).generate(context))
        return found.spots.count


def _template(name: str, owner: Owner) -> jinja2.Template:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("tunneldb.report"),
        autoescape=jinja2.select_autoescape(["html"]),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "percent": text.percent, "number": text.number, "whole": text.whole, "signed": text.signed, "clock": clock_label,
        "when": text.when, "day": owner.words.day, "kilometres": text.kilometres, "size": text.size, "css": text.css,
        "counters": text.counters, "measured": measured,
    }  # fmt: skip
    environment.globals |= {"_": owner.words, "owner": owner}
    environment.globals |= {"origins": ORIGINS, "severities": SEVERITIES, "uncounted": UNCOUNTED, "said": STATE_WORDS}
    environment.globals |= {"review_colours": REVIEW_COLOURS}
    environment.globals |= {
        "headline": headline,
        "name_elements": name_elements,
        "result_text": result_text,
        "follow_up": follow_up_text,
        "gaps_statement": gaps_statement,
    }
    return environment.get_template(name)


def _context(facts: Facts) -> dict[str, Any]:
    """Return what the page itself and several chapters show; a template of a chapter sees the chapter, too."""
    chapters = {name: chapter(facts) for name, chapter in ALL.items()}
    chosen = [chapters[name] for name in facts.request.owner.chapters]
    low_label, high_label = (facts.labels([end])[0] for end in (facts.low, facts.high))
    return {
        "version": __version__,
        "now": dt.datetime.now(dt.UTC),
        "at": facts.request.at,
        "past": facts.request.past,
        "record": in_html(record_of(facts)),
        "survey": facts.survey,
        "facts": facts,
        "chapters": chosen,
        "nav": [chapter for chapter in chosen if chapter.name != "summary" and chapter.has_content],
        "omitted": [chapter for chapter in chapters.values() if chapter not in chosen and chapter.has_content],
        "styles": list(dict.fromkeys(chapter.style for chapter in chapters.values() if chapter.style and chapter.has_content)),
        "low": facts.low,
        "high": facts.high,
        "low_label": low_label,
        "high_label": high_label,
        "digest": facts.digest,
        "sought": facts.sought,
        "part": facts.part,
        "total": facts.total,
        "kilometres": facts.kilometres,
        "files": facts.files,
        "findings": facts.findings,
        "by_state": facts.findings.wet_states if facts.findings else dict.fromkeys(STATES, 0),
        "stale": facts.stale,
        "strips": facts.strips,
        "table": leak_table(facts),
    }
