"""The verb ``report``."""

from __future__ import annotations

import tempfile
from pathlib import Path

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.stretch import parse_stretch, stretch_options
from tunneldb.database import connect, get_survey
from tunneldb.errors import UserError
from tunneldb.export.atomic import replacing
from tunneldb.report.page import CARDS, write_html
from tunneldb.report.pdf import find_browser, print_pdf


@click.command()
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
    prints on A4. The PDF is what it prints; of pictures of single leaks it holds those of the 400 largest.
    """
    suffix = output.suffix.lower()
    if suffix not in (".html", ".htm", ".pdf"):
        raise UserError(f"{output}: a report ends in .html or .pdf")
    browser = find_browser() if suffix == ".pdf" else None
    with connect(settings.dsn) as conn:
        found = get_survey(conn, survey)
        stretch = parse_stretch(conn, found, start, end)
        conn.rollback()
        with replacing(output) as temporary:
            if browser is None:
                leaks = write_html(conn, found, temporary, stretch.low, stretch.high)
            else:
                with tempfile.TemporaryDirectory(prefix="tunneldb-report-") as folder:
                    page = Path(folder) / "report.html"
                    leaks = write_html(conn, found, page, stretch.low, stretch.high, pictures=CARDS)
                    print_pdf(browser, page, temporary)
    click.echo(f"{output}: {leaks} leaks", err=True)
