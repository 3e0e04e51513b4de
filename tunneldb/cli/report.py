"""The command ``report``."""

from __future__ import annotations

import datetime as dt
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import click
import psycopg

from tunneldb.cli.coverage import say_coverage
from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command, notify, printable
from tunneldb.cli.param_types import FilePath, WholeRange
from tunneldb.cli.past import as_of_option
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
from tunneldb.report.record import append_to_pdf, read_record, verify
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
        "tunneldb report demo-2024 -o then.html --as-of 2026-03-31",
        "tunneldb report --verify report.pdf",
    ],
    codes={
        "3": "--verify: the report is genuine, and the database changed since",
        "4": "--verify: the database never had what the report states: the file or the database was altered",
        "5": "--verify: the database changed since, and its state at that time is not stored",
    },
)
@click.argument("survey", required=False)
@click.option(
    "-o", "--output", type=FilePath(dir_okay=False), help="File to write: .html, or .pdf, which needs Chromium or Chrome."
)
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
@as_of_option
@click.option(
    "--verify", "signed", type=FilePath(dir_okay=False), metavar="FILE",
    help="Compare the digest of a report, .html or .pdf, with the database; write nothing.",
)  # fmt: skip
@click.pass_context
def report(
    ctx: click.Context,
    survey: str | None,
    output: Path | None,
    start: str | None,
    end: str | None,
    template: Path | None,
    photos: Path | None,
    servers: tuple[str, ...],
    listed: int,
    moment: dt.datetime | None,
    signed: Path | None,
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

    With --as-of, reviews, drawings, photos, dry regions and actions are those of the moment. This is refused if a stage
    ran since, because its earlier results are not stored.
    """
    settings: Settings = ctx.obj
    if signed is not None:
        if survey is not None or output is not None or moment is not None:
            raise UserError("--verify FILE is given alone: the file names its survey and moment")
        ctx.exit(_verify(settings, signed))
    if survey is None or output is None:
        raise UserError(f"{'SURVEY' if survey is None else '--output FILE'} is missing: tunneldb report SURVEY -o report.html")
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
            if moment is not None:
                raise UserError(f"survey {survey} is of a site: its report is written as of now")
            _write_site(conn, found, output, browser, start or end, owner)
            return
        stretch = parse_stretch(conn, found, start, end)
        coverage = read_coverage(conn, found, stretch.low, stretch.high)
        conn.rollback()
        with exit_on_sigterm(), replacing(output) as temporary, bar("strips") as shown:
            if browser is None:
                written = _write(conn, found, stretch, temporary, shown, owner, source, listed, moment, paper=False)
            else:
                with tempfile.TemporaryDirectory(prefix="tunneldb-report-") as folder:
                    page = Path(folder) / "report.html"
                    written = _write(conn, found, stretch, page, shown, owner, source, listed, moment, paper=True)
                    conn.close()  # a browser may take minutes
                    _print(browser, page, temporary, shown)
                    append_to_pdf(page, temporary)
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
    moment: dt.datetime | None,
    *,
    paper: bool,
) -> Written:
    """Write the page, for the screen or to be printed, and show how far it is."""
    task = shown.add_task(f"report of {survey.name}", total=None)
    return write_html(
        conn, survey, page, stretch.low, stretch.high,
        progress=lambda done, count: shown.update(task, completed=done, total=count),
        pictures=CARDS if paper else None, form="JPEG" if paper else "WEBP", owner=owner, photos=photos,
        listed=listed, moment=moment,
    )  # fmt: skip


def _verify(settings: Settings, signed: Path) -> int:
    """Compare a report with the database, print the result, and return the exit code."""
    record = read_record(signed)
    with connect(settings.dsn) as conn:
        found = verify(conn, record)
    edits = [{"who": who, "view": view, "edits": count} for (who, view), count in found.edits.items()]
    add_to_json(survey=record.survey, file=signed, at=record.at, digest=record.digest, digest_now=found.now)
    add_to_json(unchanged=found.unchanged, genuine=found.genuine, edits=edits)
    notify(f"{signed}: survey {record.survey} as of {record.at.astimezone():%Y-%m-%d %H:%M:%S %z}, digest {record.digest}")
    if found.unchanged:
        notify("unchanged: the database has what the report states")
        return 0
    for (who, view), count in found.edits.items():
        notify(f"changed since: {counted(count, 'edit')} of {view} by {who}")
    if found.genuine is None:
        notify(f"changed since, and not verified: {found.reason}")
        return 5
    notify(
        f"changed since: the digest is {found.now} now; the report states what the database had then"
        if found.genuine
        else f"not genuine: the database had digest {found.then} then; the file or the database was altered"
    )
    return 3 if found.genuine else 4


def _print(browser: str, page: Path, pdf: Path, shown: Progress) -> None:
    """Print the page; how far that is, is guessed from the time that writing the page took."""
    (written,) = shown.tasks
    count = written.completed
    expected = _START + _PRINTING * (written.elapsed or 0.0)
    task = shown.add_task("printing, estimated", total=count)
    shown.update(written.id, visible=False)
    print_pdf(browser, page, pdf, lambda seconds: shown.update(task, completed=min(count * seconds / expected, 0.99 * count)))
    shown.update(task, completed=count)
