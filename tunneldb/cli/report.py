"""The command ``report``."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import click
import psycopg

from tunneldb.cli.coverage import say_coverage
from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command, notify, printable
from tunneldb.cli.param_types import FilePath, WholeRange
from tunneldb.cli.progress import bar
from tunneldb.cli.stretch import Stretch, parse_stretch, stretch_options
from tunneldb.counted import counted
from tunneldb.database import connect
from tunneldb.errors import UserError
from tunneldb.files import exit_on_sigterm, replacing
from tunneldb.report.leak_table import CARDS
from tunneldb.report.owner import Owner, read_owner
from tunneldb.report.page import MAX_LISTED_LEAKS, Written, write_html, write_site_html
from tunneldb.report.pdf import find_browser, print_pdf
from tunneldb.report.pictures.addresses import parse_server
from tunneldb.report.pictures.load import Source
from tunneldb.store.coverage import read_coverage
from tunneldb.store.survey import Survey, get_survey

if TYPE_CHECKING:
    from rich.progress import Progress

_START = 3.0  # time in which a browser starts, s
_PRINTING = 1.2  # time in which it prints a page as a multiple of that in which the page was written, as seen on 0.2 and 25 km


class _PhotoServer(click.ParamType[str]):
    """A server, ``HOST`` or ``HOST:PORT``."""

    name = "server"

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the server in lower case."""
        try:
            return parse_server(value)
        except ValueError:
            raise UserError(f"--photo-server {value}: not a host or host:port, such as photos.example.org:8443") from None


PHOTO_SERVER = _PhotoServer()


@command(
    examples=[
        "tunneldb report demo-2024 -o report.html",
        "tunneldb report demo-2024 -o part.pdf --from 12+300 --to 12+350",
        "tunneldb report demo-2024 -o bericht.pdf --template owner.toml --photos photos",
    ]
)
@click.argument("survey")
@click.option(
    "-o", "--output", required=True, type=FilePath(dir_okay=False),
    help="File to write: .html, or .pdf, which needs Chromium or Chrome.",
)  # fmt: skip
@stretch_options
@click.option(
    "--template",
    type=FilePath(),
    metavar="FILE",
    help="Owner's template, TOML: logo, client, project, headline, ratings, language of the headings, chapters, colours.",
)
@click.option(
    "--photos",
    type=FilePath(),
    metavar="FOLDER",
    help="Folder of photos; files elsewhere are refused. Default: the current folder.",
)
@click.option(
    "--photo-server",
    "servers",
    type=PHOTO_SERVER,
    multiple=True,
    metavar="HOST[:PORT]",
    help="Server of photos that may have an internal address, and may be http://. Can be repeated.",
)
@click.option(
    "--list",
    "listed",
    type=WholeRange(1, 1_000_000),
    default=MAX_LISTED_LEAKS,
    show_default=True,
    metavar="N",
    help="Most leaks to list and draw, the largest, rejected ones last. Sums include all.",
)
@click.pass_obj
def report(
    settings: Settings,
    survey: str,
    output: Path,
    start: str | None,
    end: str | None,
    template: Path | None,
    photos: Path | None,
    servers: tuple[str, ...],
    listed: int,
) -> None:
    """Write the inspection report of SURVEY for signature.

    It first states where leaks could be missed: lining not searched, outdated or hardly inspected. It contains the
    scanned and inspected lining, the unrolled lining with its leaks, each leak with picture
    and cross-section, statistics, findings of all kinds with photos, dry regions, parameters and versions, and
    reviews by person. With the owner's template it also rates elements of the tunnel. The summary compares with the last
    inspection. If members of structures were found, a chapter has the part that could be judged, their spots,
    and each member's unrolled faces; for a site that is the report.

    The HTML file needs no network. Its table of leaks can be sorted and searched, and it prints on A4. The PDF is its
    print, with pictures of the 400 largest leaks. It is printed by the program in TUNNELDB_BROWSER, or by Chromium or
    Chrome.
    """
    suffix = output.suffix.lower()
    if suffix not in (".html", ".htm", ".pdf"):
        raise UserError(f"{output}: a report ends in .html or .pdf")
    browser = find_browser() if suffix == ".pdf" else None
    owner = read_owner(template) if template else Owner()
    if photos is not None and not photos.is_dir():
        raise UserError(f"--photos {photos}: there is no such folder")
    source = Source(Path() if photos is None else photos, servers)
    with connect(settings.dsn) as conn:
        found = get_survey(conn, survey, site=True)
        if found.site:
            conn.rollback()
            _write_site(conn, found, output, browser, start or end, owner)
            return
        stretch = parse_stretch(conn, found, start, end)
        coverage = read_coverage(conn, found, stretch.low, stretch.high)
        conn.rollback()
        with exit_on_sigterm(), replacing(output) as temporary, bar("strips") as shown:
            if browser is None:
                written = _write(conn, found, stretch, temporary, shown, owner, source, listed, paper=False)
            else:
                with tempfile.TemporaryDirectory(prefix="tunneldb-report-") as folder:
                    page = Path(folder) / "report.html"
                    written = _write(conn, found, stretch, page, shown, owner, source, listed, paper=True)
                    conn.close()  # a browser may take minutes
                    _print(browser, page, temporary, shown)
    leaks, missing = written.leaks, [photo.photo.path for photo in written.missing]
    add_to_json(survey=survey, file=output, leaks=leaks, findings=written.findings, bytes=output.stat().st_size)
    add_to_json(missing_photos=missing)
    say_coverage(coverage, found)
    for photo in written.missing:
        notify(printable(f"finding {photo.photo.finding_id}: photo {photo.photo.path}: {photo.trouble}"))
    sought = leaks or coverage.searched_share
    notify(f"{output}: {counted(leaks, 'leak')}" if sought else f"{output}: leaks were not searched for")


def _write_site(
    conn: psycopg.Connection, survey: Survey, output: Path, browser: str | None, asked: str | None, owner: Owner
) -> None:
    """Write the report of a site, which has structures only, and print its counts."""
    if asked:
        raise UserError(f"{asked}: survey {survey.name} is of a site, which has no chainage: leave --from and --to out")
    with exit_on_sigterm(), replacing(output) as temporary, bar("reports") as shown:
        if browser is None:
            spots = write_site_html(conn, survey, temporary, owner)
        else:
            with tempfile.TemporaryDirectory(prefix="tunneldb-report-") as folder:
                page = Path(folder) / "report.html"
                task = shown.add_task(f"report of {survey.name}", total=1)
                spots = write_site_html(conn, survey, page, owner)
                shown.update(task, completed=1)
                conn.close()
                _print(browser, page, temporary, shown)
    add_to_json(survey=survey.name, file=output, spots=spots, bytes=output.stat().st_size)
    notify(f"{output}: {counted(spots, 'spot')}")


def _write(
    conn: psycopg.Connection,
    survey: Survey,
    stretch: Stretch,
    page: Path,
    shown: Progress,
    owner: Owner,
    photos: Source,
    listed: int,
    *,
    paper: bool,
) -> Written:
    """Write the page, for the screen or to be printed, and show how far it is."""
    task = shown.add_task(f"report of {survey.name}", total=None)
    return write_html(
        conn, survey, page, stretch.low, stretch.high,
        progress=lambda done, count: shown.update(task, completed=done, total=count),
        pictures=CARDS if paper else None, form="JPEG" if paper else "WEBP", owner=owner, photos=photos,
        listed=listed,
    )  # fmt: skip


def _print(browser: str, page: Path, pdf: Path, shown: Progress) -> None:
    """Print the page; how far that is, is guessed from the time that writing the page took."""
    (written,) = shown.tasks
    count = written.completed
    expected = _START + _PRINTING * (written.elapsed or 0.0)
    task = shown.add_task("printing, estimated", total=count)
    shown.update(written.id, visible=False)
    print_pdf(browser, page, pdf, lambda seconds: shown.update(task, completed=min(count * seconds / expected, 0.99 * count)))
    shown.update(task, completed=count)
