"""The group of all commands. The module of a command is imported when the command is used, which keeps help quick."""

from __future__ import annotations

import importlib
import io
import logging
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import click

from tunneldb import __version__
from tunneldb.cli.output import (
    AS_JSON,
    AT_FAULT,
    DONE,
    JSON,
    QUIET,
    WaitHandler,
    error_line,
    exit_code,
    notify,
    run_as_json,
    write_lines,
)
from tunneldb.errors import UserError, did_you_mean
from tunneldb.log import MESSAGES, WAITS, fields, logging_to
from tunneldb.stages.registry import MEASURES

_WORDS = "tunneldb.words"
"""Key in the context's meta: the command line, for the log."""


@dataclass(frozen=True)
class Settings:
    """Settings that every command gets as ``ctx.obj``.

    Attributes
    ----------
    dsn
        Connection string of the database; None means the embedded server.
    """

    dsn: str | None


GROUPS: dict[str, dict[str, tuple[str, str]]] = {
    "Set up": {
        "init": ("tunneldb.cli.init:init", "Create or upgrade schemas, functions and roles of the database."),
        "inspect": ("tunneldb.cli.inspect:inspect", "Show the contents of scan files, what is missing, and the next command."),
        "tunnel": ("tunneldb.cli.tunnel:tunnel", "Add, list or remove tunnels; set their stationing."),
        "survey": ("tunneldb.cli.survey:survey", "Add, list, change, export, import or remove surveys of a tunnel."),
        "profile": ("tunneldb.cli.profile:profile", "Add, list or remove the design profiles of a tunnel."),
        "load": ("tunneldb.cli.load:load", "Load scan files into a survey."),
        "register": ("tunneldb.cli.register:register", "Register sonar scans below the water to the laser scan above it."),
    },
    "Process": {
        "run": ("tunneldb.cli.run:run", "Run the stages: axis, segments, sections, ground, detect."),
        "batch": ("tunneldb.cli.batch:batch", "Load files and run all stages on all cores; resume after a stop."),
        "worker": ("tunneldb.cli.worker:worker", "Run queued jobs, on this or another machine."),
        "stop": ("tunneldb.cli.worker:stop", "Ask all workers to finish their current job and exit."),
        "members": ("tunneldb.cli.members:members", "Find the members of a structure, and spots on their surfaces."),
        "ground": ("tunneldb.cli.ground:ground", "Classify the points of one scan file, without a database."),
    },
    "Review": {
        "serve": ("tunneldb.cli.serve:serve", "Serve the desk, a page for inspections in a browser."),
        "leaks": ("tunneldb.cli.leaks:leaks", "List or export detected leaks."),
        "findings": ("tunneldb.cli.findings:findings", "List, export or import findings of all kinds, detected or drawn."),
        "spots": ("tunneldb.cli.spots:spots", "List or export spots on the members of a structure."),
        "learn": ("tunneldb.cli.learn:learn", "Adapt leak detection in a tunnel to its reviews."),
        "actions": ("tunneldb.cli.actions:actions", "List, add, change, write or read the actions that inspections demand."),
        "elements": ("tunneldb.cli.elements:elements", "Add, list or remove the elements of a tunnel that are rated."),
        "rating": ("tunneldb.cli.rating:rating", "Rate the elements of a survey by an owner's scheme."),
        "alarms": ("tunneldb.cli.alarms:alarms", "Check ovality, convergence and wet area of a tunnel against limits."),
        "evaluate": ("tunneldb.cli.evaluate:evaluate", "Compare detected leaks with reference leaks."),
        "intensity": (
            "tunneldb.cli.intensity:intensity",
            "Plot intensity against range and incidence, before and after correction.",
        ),
    },
    "Measure": {
        "axis": ("tunneldb.cli.axis:axis", "Compare the measured axis with the design axis."),
        "sections": ("tunneldb.cli.sections:sections", "List width, height and area of cross-sections at a step."),
        **{stage.name: (stage.command, stage.summary) for stage in MEASURES},
        "spheres": ("tunneldb.cli.spheres:spheres", "Find target spheres, and compare them with control points."),
        "unroll": ("tunneldb.cli.unroll:unroll", "Convert x,y,z to chainage,arc,offset, or back."),
    },
    "Export": {
        "image": ("tunneldb.cli.image:image", "Write the unrolled images as GeoTIFF; import images of other instruments."),
        "report": ("tunneldb.cli.report:report", "Write the inspection report as HTML or PDF."),
        "qgis": ("tunneldb.cli.qgis:qgis", "Write a QGIS project with styled layers."),
        "export": ("tunneldb.cli.export:export", "Write a survey as GeoPackage or DXF, or its classified scan files."),
    },
    "Operate": {
        "status": ("tunneldb.cli.status:status", "Show what is loaded, and the stages done in each kilometre."),
        "check": ("tunneldb.cli.check:check", "Check server and database, and show how to fix faults."),
        "prune": ("tunneldb.cli.prune:prune", "Show or delete runs and jobs that are no longer needed."),
        "vacuum": ("tunneldb.cli.vacuum:vacuum", "Show or free the disk space of deleted rows."),
        "psql": ("tunneldb.cli.psql:psql", "Open psql on the database."),
        "federate": ("tunneldb.cli.federate:federate", "Show the tunnels of several servers in the views of one database."),
        "server": ("tunneldb.cli.server:server", "Start, stop or show the embedded server."),
    },
    "Simulate": {
        "simulate": ("tunneldb.cli.simulate:simulate", "Write a simulated tunnel scan and its reference data."),
        "simulate-structure": (
            "tunneldb.cli.simulate_structure:simulate_structure",
            "Write a simulated scan of a structure and its reference data.",
        ),
        "simulate-canal": (
            "tunneldb.cli.simulate_canal:simulate_canal",
            "Write simulated laser and sonar scans of a canal tunnel and their reference data.",
        ),
    },
}
"""Commands by what they are for: the place of each, and its summary."""

COMMANDS = {name: entry for commands in GROUPS.values() for name, entry in commands.items()}

MANUAL: dict[str, list[tuple[str, str]]] = {
    "Output": [
        ("stdout", "results; with --json one JSON object, also on failure"),
        ("stderr", "messages; on a terminal also a progress bar"),
    ],
    "Log": [
        ("--log FILE", "JSON, one object a line: time, level, message, stage, seconds, traceback of each error"),
        ("-v, -vv", "the same as text on stderr, without the tracebacks or with them"),
    ],
    "Exit codes": [
        ("0", DONE),
        ("1", "some commands: done, with problems; see their help"),
        ("2", AT_FAULT),
        ("3, 4, 5", "of alarms check: a warning, an alarm, or something not judged"),
    ],
    "Environment": [
        ("TUNNELDB_DSN", "database to use, as --dsn"),
        ("TUNNELDB_HOME", "folder of the embedded server, one server a folder"),
        ("TUNNELDB_LOG", "log file, as --log"),
        ("TUNNELDB_BROWSER", "path of Chromium or Chrome, which prints reports as PDF"),
        ("TMPDIR", "folder for temporary files"),
        ("NUMBA_CACHE_DIR", "folder for compiled code; default: next to the program, else ~/.cache/numba"),
        ("PGPASSFILE, PGSERVICEFILE", "files of passwords and services, and other variables of libpq"),
    ],
}
EXAMPLES = (
    "tunneldb simulate demo --preset demo",
    "tunneldb init",
    "tunneldb tunnel add demo --srid 25830 --axis demo/demo.axis.csv",
    "tunneldb survey add demo-2024 --tunnel demo --date 2024-05-04 --trajectory demo/demo.trajectory.csv"
    " --reference demo/demo.reference.csv --intensity Amplitude --intensity-kind amplitude",
    "tunneldb batch demo-2024 demo/*.laz",
    "tunneldb leaks demo-2024 --json | python -m json.tool",
)


class LazyGroup(click.Group):
    """A click group that knows the names and summaries of its commands without importing them."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the commands in the order of the groups."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import the module of a command and return the command."""
        if cmd_name not in COMMANDS:
            return None
        module, _, attribute = COMMANDS[cmd_name][0].partition(":")
        command = getattr(importlib.import_module(module), attribute)
        assert isinstance(command, click.Command)
        return command

    def resolve_command(self, ctx: click.Context, args: list[str]) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command; suggest the nearest name for one that is unknown."""
        if args[0] not in COMMANDS and (meant := did_you_mean(args[0], COMMANDS)):
            ctx.fail(f"No such command {args[0]!r}.{meant}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands by group, without importing them."""
        width = max(map(len, COMMANDS))
        for title, commands in GROUPS.items():
            with formatter.section(title):
                formatter.write_dl([(name.ljust(width), text) for name, (_, text) in commands.items()])

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Note if JSON is asked for: errors in the rest of the line are reported in it, too."""
        if strange := next((word for word in args if any("\ud800" <= c <= "\udfff" for c in word)), None):
            ctx.fail(f"{strange!a} is not UTF-8.")
        ctx.meta[_WORDS] = _without_dsn(args)
        ctx.meta[AS_JSON] = JSON in args and next((word for word in args if word in COMMANDS), None) != "psql"
        try:
            return super().parse_args(ctx, args)
        except click.UsageError as error:
            if not ctx.meta[AS_JSON]:
                raise
            ctx.exit(run_as_json(ctx, partial(_raise, error), partial(_describe, ctx)))

    def main(self, *args: Any, **options: Any) -> Any:
        """Run the program; characters that the terminal's encoding lacks are printed by their codes."""
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, io.TextIOWrapper) and (stream.errors == "strict" or stream.encoding.lower() != "utf-8"):
                stream.reconfigure(errors="backslashreplace")
        return super().main(*args, **options)

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; turn errors that the user can fix into one line and exit code 2."""
        ctx.meta[QUIET] = ctx.params["quiet"]
        run = partial(_logged, ctx.meta[_WORDS], partial(click.Group.invoke, self, ctx))
        waits = WaitHandler()
        logging.getLogger(WAITS).addHandler(waits)
        try:
            with logging_to(ctx.params["log_file"], ctx.params["verbosity"]):
                if ctx.meta[AS_JSON]:
                    return ctx.exit(run_as_json(ctx, run, partial(_describe, ctx)))
                return run()
        except Exception as error:
            message = _describe(ctx, error)
            if message is None:
                raise
        finally:
            logging.getLogger(WAITS).removeHandler(waits)
        click.echo(error_line(message), err=True)
        return ctx.exit(2)

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write what applies to all commands."""
        for title, rows in MANUAL.items():
            with formatter.section(title):
                formatter.write_dl(rows)
        write_lines(formatter, "Examples", EXAMPLES)


def _without_dsn(args: list[str]) -> list[str]:
    """Return a command line for the log: a DSN may hold a password."""
    before = ["", *args[:-1]]
    hidden = [word.partition("=")[0] + "=…" if word.startswith("--dsn=") else word for word in args]
    return ["…" if previous == "--dsn" else word for previous, word in zip(before, hidden, strict=False)]


def _logged(words: list[str], run: Callable[[], Any]) -> Any:
    """Run a command; log its beginning, its end, and its error with the traceback."""
    log, began = logging.getLogger("tunneldb.command"), time.monotonic()
    log.info("tunneldb %s", " ".join(words), extra=fields(version=__version__, words=words))
    code: int | None = None
    try:
        result = run()
        code = 0
    except (click.exceptions.Exit, SystemExit) as ended:
        code = exit_code(ended)
        raise
    except click.ClickException as error:
        code = error.exit_code
        logging.getLogger(MESSAGES).error("%s", error.format_message(), exc_info=error)
        raise
    except Exception as error:
        code = 2 if isinstance(error, UserError) else None
        logging.getLogger(MESSAGES).error("%s", error, exc_info=error)
        raise
    finally:
        seconds = round(time.monotonic() - began, 3)
        log.info("ended after %.1f s", seconds, extra=fields(seconds=seconds, exit_code=code))
    return result


def _raise(error: Exception) -> None:
    raise error


def _describe(ctx: click.Context, error: Exception) -> str | None:
    """Return one line for an error that is not a bug, None for a bug."""
    if isinstance(error, RuntimeError) and "no locator available" in str(error):  # Numba, as a module is imported
        return (
            "compiled code cannot be stored: neither the folder of tunneldb nor ~/.cache is writable;"
            " set NUMBA_CACHE_DIR to a folder of your own"
        )
    if isinstance(error, UserError):
        return str(error)
    from tunneldb.database.failures import connection_lost, describe_failure

    message = describe_failure(error)
    if message is None and not isinstance(error, (click.exceptions.Exit, click.ClickException, click.Abort)):
        from tunneldb.database.broken import explain_by_broken_row

        return explain_by_broken_row(ctx.params.get("dsn") or None)
    if message is not None and connection_lost(error) and ctx.params.get("dsn") is None:
        from tunneldb.database.server import Server

        crash = Server().crash()
        return message if crash is None else f"{message}; the server went down: {crash}"
    return message


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="tunneldb")
@click.option(
    "--dsn",
    envvar="TUNNELDB_DSN",
    metavar="DSN",
    help="Connection string of the database (postgresql://… or host=… dbname=…); default: the embedded server."
    " [env: TUNNELDB_DSN]",
)
@click.option("-v", "--verbose", "verbosity", count=True, help="Print what is done; -vv also tracebacks.")
@click.option("-q", "--quiet", is_flag=True, help="Print results and errors only: no messages, no progress bar.")
@click.option(
    "--log",
    "log_file",
    type=click.Path(dir_okay=False, path_type=Path),
    envvar="TUNNELDB_LOG",
    metavar="FILE",
    help="File to append the log to, as JSON lines. [env: TUNNELDB_LOG]",
)
@click.pass_context
def main(ctx: click.Context, dsn: str | None, verbosity: int, quiet: bool, log_file: Path | None) -> None:
    """From laser scans of tunnels to water leaks, in PostGIS and QGIS."""
    if dsn and ctx.get_parameter_source("dsn") is click.core.ParameterSource.COMMANDLINE:
        _warn_of_password(dsn)
    ctx.obj = Settings(dsn=dsn or None)


def _warn_of_password(dsn: str) -> None:
    """Warn of a password on the command line, which all users of the machine can read."""
    import psycopg

    try:
        given = psycopg.conninfo.conninfo_to_dict(dsn)
    except psycopg.ProgrammingError:
        return  # reported when the connection is opened
    if given.get("password"):
        notify(
            "Warning: all users of this machine can read the password in --dsn (ps). Put it into ~/.pgpass, or define a service"
            " in ~/.pg_service.conf and give --dsn service=NAME"
        )
