"""The verb ``report``."""

from __future__ import annotations

import tempfile
from pathlib import Path

import click
import psycopg

from tunneldb.cli.main import Settings
from tunneldb.cli.output import tell, verb
from tunneldb.cli.progress import bar
from tunneldb.cli.stretch import Stretch, parse_stretch, stretch_options
from tunneldb.database import Survey, connect, get_survey
from tunneldb.errors import UserError
from tunneldb.export.atomic import replacing, told_to_end
from tunneldb.report.page import CARDS, write_html
from tunneldb.report.pdf import find_browser, print_pdf


@verb(
    examples=[
        "tunneldb report demo-2024 -o report.html",
        "tunneldb report demo-2024 -o part.pdf --from 12+300 --to 12+350",
    ]
)
@click.argument("survey")
@click.option(
    "-o", "--output", required=True, type=click.Path(dir_okay=False, path_type=Path),
    help="File to write: .html, or .pdf, which needs Chromium or Chrome.",
)  # fmt: skip
@stretch_options
@click.pass_obj
def report(settings: Settings, survey: str, output: Path, start: str | None, end: str | None) -> None:
    """Write the inspection report of SURVEY, to be handed over and signed.

    It states what was scanned and how much of the lining was seen, class of waterproofing, the unrolled lining with its
    leaks, each leak with picture and cross-section, statistics, parameters and versions, and who reviewed what.

    The HTML file is whole in itself: it asks nothing of the network. Its table of leaks can be sorted and searched, and it
    prints on A4. The PDF is what it prints; of pictures of single leaks it holds those of the 400 largest. It is printed by
    the program that TUNNELDB_BROWSER names, or by the Chromium or Chrome that is found.
    """
    suffix = output.suffix.lower()
    if suffix not in (".html", ".htm", ".pdf"):
        raise UserError(f"{output}: a report ends in .html or .pdf")
    browser = find_browser() if suffix == ".pdf" else None
    with connect(settings.dsn) as conn:
        found = get_survey(conn, survey)
        stretch = parse_stretch(conn, found, start, end)
        conn.rollback()
        with told_to_end(), replacing(output) as temporary:
            if browser is None:
                leaks = _write(conn, found, stretch, temporary, paper=False)
            else:
                with tempfile.TemporaryDirectory(prefix="tunneldb-report-") as folder:
                    page = Path(folder) / "report.html"
                    leaks = _write(conn, found, stretch, page, paper=True)
                    conn.close()  # a browser may take minutes
                    print_pdf(browser, page, temporary)
    tell(survey=survey, file=output, leaks=leaks, bytes=output.stat().st_size)
    click.echo(f"{output}: {leaks} leaks", err=True)


def _write(conn: psycopg.Connection, survey: Survey, stretch: Stretch, page: Path, *, paper: bool) -> int:
    """Write the page, for the screen or to be printed, and show how far it is; returns the number of leaks."""
    with bar("strips") as shown:
        task = shown.add_task(f"report of {survey.name}", total=None)
        return write_html(
            conn, survey, page, stretch.low, stretch.high,
            progress=lambda done, count: shown.update(task, completed=done, total=count),
            pictures=CARDS if paper else None, form="JPEG" if paper else "WEBP",
        )  # fmt: skip
