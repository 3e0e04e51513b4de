"""`tunneldb batch`."""

from __future__ import annotations

import os
import re
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tunneldb.cli.load import density_of
from tunneldb.cli.main import Settings
from tunneldb.database import Survey, connect, get_survey
from tunneldb.errors import UserError
from tunneldb.job.parameters import PARAMETERS, settings

if TYPE_CHECKING:
    import psycopg


@click.command()
@click.argument("survey")
@click.argument("files", nargs=-1, type=click.Path(path_type=Path), metavar="[FILES...]")
@click.option("--workers", type=click.IntRange(1, 1000), metavar="N", help="Worker processes to start; one a core by default.")
@click.option("--km", metavar="A[-B]", help="Only these kilometres, 511 or 511-512.")
@click.option("--to", "last", metavar="STAGE", help="End with this stage: load, axis, segments, sections or detect (default).")
@click.option("--density", help="Points per m² of surface to keep, 1 or more, or 'all'; 100, or what the survey has.")
@click.option("--set", "assignments", multiple=True, metavar="NAME=VALUE", help="Set a parameter, as for tunneldb run.")
@click.option("--retry-failed", is_flag=True, help="Try again what has failed.")
@click.pass_obj
def batch(
    settings_: Settings,
    survey: str,
    files: tuple[Path, ...],
    workers: int | None,
    km: str | None,
    last: str | None,
    density: str | None,
    assignments: tuple[str, ...],
    retry_failed: bool,
) -> None:
    """Bring FILES of SURVEY from their points to leaks, kilometre by kilometre, on all cores.

    What is wanted is kept in the database: a batch that was stopped or killed goes on where it was when it is called again,
    without FILES. A file or kilometre that fails holds up no other. Workers of other machines on the same database help.

    Ctrl-C ends the stages that are under way, and stops; a second one stops at once.

    Exit code: 0 when all is done, 1 when something failed, 2 when nothing could be begun.
    """
    from tunneldb.job.batch import STEPS, plan, register

    if last is not None and last not in STEPS:
        raise UserError(f"there is no stage {last!r}; the stages are {', '.join(STEPS)}")
    values = settings(assignments)
    chosen = {name: values[name] for name in (text.partition("=")[0] for text in assignments) if name in PARAMETERS}
    reading = {} if density is None else {"load.density": "all" if density == "all" else density_of(density)}
    with connect(settings_.dsn) as conn:
        conn.autocommit = True
        found = get_survey(conn, survey)
        asked = plan(conn, found, files, kilometres=_range(km), stage=last, reading=reading, parameters=chosen)
        register(conn, found, asked, retry=retry_failed)
        for file in asked.files:
            if file.error:
                click.echo(f"{file.name}: failed: {file.error}")
        _work(conn, found, settings_.dsn, workers or os.cpu_count() or 1)
        raise SystemExit(_summary(conn, found))


def _range(text: str | None) -> range | None:
    if text is None:
        return None
    match = re.fullmatch(r"(-?\d+)(?:-(-?\d+))?", text.strip())
    if match is None:
        raise UserError(f"--km takes a kilometre or a range of them, 511 or 511-513, not {text!r}")
    first, last = int(match[1]), int(match[2] or match[1])
    if last < first:
        raise UserError(f"--km {text}: the range runs backwards")
    return range(first, last + 1)


def _work(conn: psycopg.Connection[Any], survey: Survey, dsn: str | None, count: int) -> None:
    """Let workers do what is to be done, and show what becomes of it."""
    from tunneldb.job.team import Team, interrupts
    from tunneldb.job.worker import Orders

    shown = _Lines(conn, survey)
    team = Team(Orders(dsn, 1, survey.id), count)
    with interrupts(team):
        if shown.busy():
            team.start()
        while team.tend():
            shown.show()
            time.sleep(0.5)
        shown.show()


class _Lines:
    """A line for each file and stage that has ended since this began."""

    def __init__(self, conn: psycopg.Connection[Any], survey: Survey) -> None:
        self.conn = conn
        self.survey = survey
        row = conn.execute("SELECT clock_timestamp()").fetchone()
        assert row is not None
        self.seen = row[0]

    def busy(self) -> bool:
        row = self.conn.execute("SELECT tunnel_api.queue_busy(%s)", [self.survey.id]).fetchone()
        return row is not None and bool(row[0])

    def show(self) -> None:
        rows = self.conn.execute(
            """
            SELECT stage, coalesce('km ' || km, parameters ->> 'file'), outcome, message,
                   extract(epoch FROM finished_at - started_at), finished_at
              FROM tunnel.run WHERE survey_id = %s AND job_id IS NOT NULL AND finished_at > %s ORDER BY finished_at
            """,
            [self.survey.id, self.seen],
        ).fetchall()
        for stage, what, outcome, message, seconds, finished in rows:
            said = f"{seconds:.1f} s" if outcome == "done" else f"failed: {message}"
            click.echo(f"{stage} {what}: {said}")
            self.seen = finished


def _summary(conn: psycopg.Connection[Any], survey: Survey) -> int:
    """Say what became of it; returns the exit code."""
    from tunneldb.job.batch import failed_files, results

    found = results(conn, survey)
    files = failed_files(conn, survey)
    done = sum(result.state == "done" for result in found)
    click.echo(f"{done} of {len(found)} kilometres done")
    for name, message in files:
        click.echo(f"file {name}: {message}")
    failed = [result for result in found if result.state == "failed"]
    for result in failed:
        click.echo(f"km {result.km}, {result.stage}: {result.message}")
    if failed or files:
        click.echo(f"when that is mended: tunneldb batch {survey.name} --retry-failed")
    elif done < len(found):
        click.echo(f"to go on: tunneldb batch {survey.name}")
    return 0 if done == len(found) and not files else 1
