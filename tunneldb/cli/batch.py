"""`tunneldb batch`."""

from __future__ import annotations

import datetime as dt
import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from rich.console import Console

from tunneldb.cli.load import density_of, say_notes
from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command, notify, wants_json
from tunneldb.cli.param_types import FilePath, WholeRange
from tunneldb.cli.units import unit_options
from tunneldb.counted import counted
from tunneldb.database import connect
from tunneldb.errors import UserError
from tunneldb.queue.watching import is_busy, server_time
from tunneldb.stages.parameters import PARAMETERS, settings
from tunneldb.stages.registry import STAGE_NAMES
from tunneldb.store.survey import Survey, get_survey

if TYPE_CHECKING:
    import psycopg

    from tunneldb.cli.watch import Watch
    from tunneldb.queue.batch import Plan


OUTSIDE = "outside the kilometres of --km, by its header and a sample of its points: not read"


@command(
    examples=[
        "tunneldb batch pajares-2026 /data/pajares/*.laz --preview",
        "tunneldb batch pajares-2026 /data/pajares/*.laz",
        "tunneldb batch pajares-2026                          # go on after a stop",
        "tunneldb batch pajares-2026 --km 3-7 --retry-failed",
    ],
    wrong="something failed; of --preview: the disk is too small",
)
@click.argument("survey")
@click.argument("files", nargs=-1, type=FilePath(), metavar="[FILES...]")
@click.option(
    "--workers", type=WholeRange(1, 1000), metavar="N", help="Number of worker processes; default: one for each core."
)
@click.option("--km", metavar="A[-B]", help="Only these kilometres, 511 or 511-512.")
@click.option("--to", "last", metavar="STAGE", help="Last stage: load, axis, segments, sections, ground or detect (default).")
@click.option("--density", help="Points per m² of surface to keep, 1 or more, or 'all'; 100, or what the survey has.")
@unit_options("FILES")
@click.option("--set", "assignments", multiple=True, metavar="NAME=VALUE", help="Set a parameter, as for tunneldb run.")
@click.option("--retry-failed", is_flag=True, help="Retry failed jobs.")
@click.option(
    "--preview",
    is_flag=True,
    help="Only show the plan: files, kilometres covered and missing, points, disk space, time.",
)
@click.pass_obj
def batch(
    settings_: Settings,
    survey: str,
    files: tuple[Path, ...],
    workers: int | None,
    km: str | None,
    last: str | None,
    density: str | None,
    unit: str | None,
    height_unit: str | None,
    assignments: tuple[str, ...],
    retry_failed: bool,
    preview: bool,
) -> None:
    """Load FILES into SURVEY and run all stages, kilometre by kilometre, on all cores.

    The goal is stored in the database: a stopped or killed batch continues when it is called again without FILES. A
    failed file or kilometre does not block others. Workers of other machines on the same database help.

    Ctrl-C finishes the current stages and stops; a second one stops at once.
    """
    from tunneldb.queue.batch import plan, register
    from tunneldb.stages.run import km_range
    from tunneldb.store.networks import add_networks, names_network

    if last is not None and last not in STAGE_NAMES:
        raise UserError(f"unknown stage {last!r}; the stages are {', '.join(STAGE_NAMES)}")
    # Checked before the database is opened; a network becomes a number there.
    settings(one for one in assignments if not names_network(one))
    kilometres = None if km is None else km_range(km)
    reading: dict[str, Any] = {} if density is None else {"load.density": "all" if density == "all" else density_of(density)}
    reading |= {"load.unit": unit, "load.height_unit": height_unit}
    with connect(settings_.dsn) as conn:
        conn.autocommit = True
        found = get_survey(conn, survey)
        assignments = tuple(add_networks(conn, assignments))
        values = settings(assignments)
        chosen = {name: values[name] for name in (text.partition("=")[0] for text in assignments) if name in PARAMETERS}
        asked = plan(
            conn, found, files, kilometres=kilometres, stage=last, reading=reading, parameters=chosen, retry=retry_failed
        )
        count = workers or os.cpu_count() or 1
        if preview:
            from tunneldb.cli.preview import show
            from tunneldb.queue.preview import preview as look_ahead

            seen = look_ahead(conn, found, asked, kilometres, settings_.dsn is None, count)
            show(seen)
            add_to_json(survey=survey, preview=seen, fits=seen.fits)
            raise SystemExit(0 if seen.fits else 1)
        register(conn, found, asked, retry=retry_failed)
        busy, since = _busy(conn, found)
    began = time.monotonic()
    watch = _work(found, settings_.dsn, count if busy else 0)
    with connect(settings_.dsn) as conn:  # the server may have been restarted meanwhile
        raise SystemExit(_summary(conn, found, asked, watch, time.monotonic() - began, since))


def _work(survey: Survey, dsn: str | None, count: int) -> Watch:
    """Start workers, and show the progress."""
    from tunneldb.cli.watch import Watch
    from tunneldb.queue.pool import WorkerPool, interrupts
    from tunneldb.queue.worker import Orders

    team = WorkerPool(Orders(dsn, 1, survey.id), count)
    # the picture is drawn on stdout, which JSON has for itself
    console = Console(stderr=True) if wants_json() and sys.stderr.isatty() else None
    with interrupts(team), Watch(dsn, survey.name, console) as watch:
        watch.look()
        team.start()
        while team.tend():
            watch.look()
            team.rest(1.0)
        watch.look()
    return watch


def _busy(conn: psycopg.Connection[Any], survey: Survey) -> tuple[bool, dt.datetime]:
    """Return whether there is work to do, and the server's time."""
    return is_busy(conn, survey.id), server_time(conn)


def _summary(
    conn: psycopg.Connection[Any], survey: Survey, asked: Plan, watch: Watch, seconds: float, since: dt.datetime
) -> int:
    """Print a summary, and return the exit code."""
    from tunneldb.cli.overview import advise, duration, number, spans
    from tunneldb.queue.batch import failed_files, notes_of_files, only_loaded, results

    found = results(conn, survey)
    files = failed_files(conn, survey)
    notes = notes_of_files(conn, survey, since)
    done = sum(result.state == "done" for result in found)
    points = watch.ledger.points if watch.ledger is not None else 0
    add_to_json(
        survey=survey.name,
        kilometres=found,
        failed_files=[{"name": name, "message": why} for name, why in files],
        points=points,
        notes=[{"name": name, "note": note} for name, note in notes],
        skipped=asked.skipped,
        only_loaded=(loaded := only_loaded(conn, survey, asked, since)),
    )
    say_notes([*notes, *((name, OUTSIDE) for name in asked.skipped)])
    if loaded:
        last = asked.stage or STAGE_NAMES[-1]
        notify(
            f"km {spans(loaded)}: loaded and not run, because these files have points there, but --km excludes it: "
            f"tunneldb batch {survey.name} --km {loaded[0]}{f'-{loaded[-1]}' * (len(loaded) > 1)} --to {last}"
        )
    speed = f", {number(points / seconds)} points/s" if points else ""
    click.echo(f"{done} of {counted(len(found), 'kilometre')} done; {duration(seconds)}{speed}")
    if watch.live is None and watch.seen is not None:  # on a terminal it stands there already
        for advice in advise(watch.seen):
            click.echo(advice.line())
    return 0 if done == len(found) and not files else 1
