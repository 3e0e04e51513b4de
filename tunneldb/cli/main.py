"""The group of all verbs; a verb's module is imported only when the verb is used, so that help is quick."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from functools import partial
from typing import Any

import click

from tunneldb import __version__
from tunneldb.cli.output import AS_JSON, AT_FAULT, DONE, JSON, error_line, run_as_json, write_lines
from tunneldb.errors import UserError, did_you_mean


@dataclass(frozen=True)
class Settings:
    """What every verb gets as ``ctx.obj``.

    Attributes
    ----------
    dsn
        Connection string of the database; None means the embedded server.
    """

    dsn: str | None


COMMANDS: dict[str, tuple[str, str]] = {
    "init": ("tunneldb.cli.init:init", "Create or upgrade the schema, the functions and the roles."),
    "inspect": ("tunneldb.cli.inspect:inspect", "Tell what scan files hold, what is missing, and what to type next."),
    "tunnel": ("tunneldb.cli.tunnel:tunnel", "Add, list or remove tunnels, and give them a stationing."),
    "survey": ("tunneldb.cli.survey:survey", "Add, list or remove the scanning campaigns of a tunnel."),
    "load": ("tunneldb.cli.load:load", "Load scan files into a survey."),
    "register": ("tunneldb.cli.register:register", "Register sonar scans below the water to the laser's above it."),
    "run": ("tunneldb.cli.run:run", "Run the stages: axis, segments, sections, ground, detect."),
    "batch": ("tunneldb.cli.batch:batch", "Bring files to leaks, kilometre by kilometre, on all cores; go on after a stop."),
    "worker": ("tunneldb.cli.worker:worker", "Do what batches ask for, also of other machines."),
    "stop": ("tunneldb.cli.worker:stop", "Ask all workers to end what they are at and leave."),
    "leaks": ("tunneldb.cli.leaks:leaks", "List or export the leaks that were found."),
    "findings": ("tunneldb.cli.findings:findings", "List, export or import findings of all kinds, detected and drawn."),
    "learn": ("tunneldb.cli.learn:learn", "Learn from reviews how far evidence of leaks holds in a tunnel."),
    "evaluate": ("tunneldb.cli.evaluate:evaluate", "Hold the leaks that were found against true ones."),
    "members": ("tunneldb.cli.members:members", "Find the members of structures, and what differs from its own surface."),
    "spots": ("tunneldb.cli.spots:spots", "List or export what on members differs from their own surface."),
    "spheres": ("tunneldb.cli.spheres:spheres", "Find target spheres, and compare them with control points."),
    "axis": ("tunneldb.cli.axis:axis", "Show how far the measured axis lies from the one given, by element of its design."),
    "rings": (
        "tunneldb.cli.rings:rings",
        "Measure the rings of a lining, scanned or surveyed: deviation from the axis, radius, ovality, steps, chords.",
    ),
    "profile": ("tunneldb.cli.profile:profile", "Add, list or remove the design profiles of a tunnel."),
    "deviation": (
        "tunneldb.cli.deviation:deviation",
        "Hold the lining against its design profiles: deviation, overbreak and underbreak.",
    ),
    "clearance": (
        "tunneldb.cli.clearance:clearance",
        "Hold what stands in a tunnel against an outline about a track: margins and infringements.",
    ),
    "compare": (
        "tunneldb.cli.compare:compare",
        "Compare two surveys of a tunnel: leaks new, grown, dry again, and where the lining changed.",
    ),
    "unroll": ("tunneldb.cli.unroll:unroll", "Turn x,y,z into chainage,arc,offset, or back."),
    "export": (
        "tunneldb.cli.export:export",
        "Write a survey as GeoPackage, DXF, or its scan files with the class of each point.",
    ),
    "thickness": ("tunneldb.cli.thickness:thickness", "State what lies between two surveys: thickness and volume."),
    "evenness": ("tunneldb.cli.evenness:evenness", "Lay a straightedge on the lining, and state the gaps beneath."),
    "ground": ("tunneldb.cli.ground:ground", "Class the points of a scan file by itself, without a database."),
    "intensity": ("tunneldb.cli.intensity:intensity", "Show whether intensity depends on range or incidence, and plot it."),
    "image": ("tunneldb.cli.image:image", "Write the unrolled images as GeoTIFF."),
    "report": ("tunneldb.cli.report:report", "Write the inspection report, to be handed over and signed."),
    "qgis": ("tunneldb.cli.qgis:qgis", "Write a QGIS project with styled layers."),
    "status": ("tunneldb.cli.status:status", "Show what is loaded and how far each kilometre has come."),
    "check": ("tunneldb.cli.check:check", "Check the server and the database, and say how to mend them."),
    "prune": ("tunneldb.cli.prune:prune", "Show or delete old runs and jobs that nothing goes by any more."),
    "vacuum": ("tunneldb.cli.vacuum:vacuum", "Show or free the room of deleted rows."),
    "psql": ("tunneldb.cli.psql:psql", "Open psql on the database."),
    "server": ("tunneldb.cli.server:server", "Start, stop or look at the embedded server."),
    "simulate": ("tunneldb.cli.simulate:simulate", "Make a simulated scan of a tunnel, with its truth."),
    "simulate-structure": (
        "tunneldb.cli.simulate_structure:simulate_structure",
        "Make a simulated scan of a structure, with its truth.",
    ),
    "simulate-canal": (
        "tunneldb.cli.simulate_canal:simulate_canal",
        "Make simulated scans of a canal tunnel, above and below the water, with their truth.",
    ),
}

MANUAL: dict[str, list[tuple[str, str]]] = {
    "Output": [
        ("stdout", "results; with --json one JSON object, also when the verb fails"),
        ("stderr", "messages; on a terminal a bar with rate and time left, in a pipe none"),
    ],
    "Exit codes": [
        ("0", DONE),
        ("1", "of some verbs: done, and something is wrong, see their help"),
        ("2", AT_FAULT),
    ],
    "Environment": [
        ("TUNNELDB_DSN", "database to use, as --dsn"),
        ("TUNNELDB_HOME", "folder of the embedded server; two folders are two servers"),
        ("TUNNELDB_BROWSER", "program that prints reports as PDF, if it isn't found: Chromium or Chrome"),
        ("TMPDIR", "folder for what does not fit into memory"),
        ("NUMBA_CACHE_DIR", "folder for what is compiled on first use, else beside the program, else in ~/.cache/numba"),
        ("PGPASSFILE, PGSERVICEFILE", "and the others of libpq, for passwords and services"),
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
    """A click group that knows its verbs' names and help without importing them."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the verbs in the order in which one uses them."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import the verb's module and return its command."""
        if cmd_name not in COMMANDS:
            return None
        module, _, attribute = COMMANDS[cmd_name][0].partition(":")
        command = getattr(importlib.import_module(module), attribute)
        assert isinstance(command, click.Command)
        return command

    def resolve_command(self, ctx: click.Context, args: list[str]) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the verb; of one that is mistyped ask for the nearest."""
        if args[0] not in COMMANDS and (meant := did_you_mean(args[0], COMMANDS)):
            ctx.fail(f"No such command {args[0]!r}.{meant}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the verbs from COMMANDS, without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, text) in COMMANDS.items()])

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Note whether JSON is asked for: what is wrong with the rest of the line is to be said in it, too."""
        if strange := next((word for word in args if any("\ud800" <= c <= "\udfff" for c in word)), None):
            ctx.fail(f"{strange!a} has bytes that are no UTF-8.")
        ctx.meta[AS_JSON] = JSON in args and next((word for word in args if word in COMMANDS), None) != "psql"
        try:
            return super().parse_args(ctx, args)
        except click.UsageError as error:
            if not ctx.meta[AS_JSON]:
                raise
            ctx.exit(run_as_json(ctx, partial(_raise, error), partial(_describe, ctx)))

    def invoke(self, ctx: click.Context) -> Any:
        """Run a verb; turn the user's errors and the server's into one line and exit code 2."""
        if ctx.meta[AS_JSON]:
            return ctx.exit(run_as_json(ctx, lambda: click.Group.invoke(self, ctx), partial(_describe, ctx)))
        try:
            return super().invoke(ctx)
        except Exception as error:
            message = _describe(ctx, error)
            if message is None:
                raise
        click.echo(error_line(message), err=True)
        return ctx.exit(2)

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write what holds for all verbs."""
        for title, rows in MANUAL.items():
            with formatter.section(title):
                formatter.write_dl(rows)
        write_lines(formatter, "Examples", EXAMPLES)


def _raise(error: Exception) -> None:
    raise error


def _describe(ctx: click.Context, error: Exception) -> str | None:
    """Return one line for what is no bug, None for one."""
    if isinstance(error, RuntimeError) and "no locator available" in str(error):  # Numba, as a module is imported
        return (
            "what is compiled can be kept nowhere: neither where tunneldb is installed nor in ~/.cache may be written;"
            " set NUMBA_CACHE_DIR to a folder of your own"
        )
    if isinstance(error, UserError):
        return str(error)
    from tunneldb.database.failures import connection_lost, describe_failure

    message = describe_failure(error)
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
    help="Database to use, as libpq wants it (postgresql://… or host=… dbname=…). "
    "Without it a private server of your own is started. [env: TUNNELDB_DSN]",
)
@click.pass_context
def main(ctx: click.Context, dsn: str | None) -> None:
    """From laser scans of tunnels to water leaks, in PostGIS and QGIS."""
    if dsn and ctx.get_parameter_source("dsn") is click.core.ParameterSource.COMMANDLINE:
        _warn_of_password(dsn)
    ctx.obj = Settings(dsn=dsn or None)


def _warn_of_password(dsn: str) -> None:
    """Say so where a password stands on the command line, which all users of the machine can read."""
    import psycopg

    try:
        told = psycopg.conninfo.conninfo_to_dict(dsn)
    except psycopg.ProgrammingError:
        return  # said when the connection is opened
    if told.get("password"):
        click.echo(
            "everybody on this machine can read the password in --dsn (ps); put it into ~/.pgpass, or a service into"
            " ~/.pg_service.conf and --dsn service=NAME",
            err=True,
        )
