"""The command ``ground``."""

from __future__ import annotations

from pathlib import Path

import click

from tunneldb.cli.output import add_to_json, command
from tunneldb.cli.param_types import FilePath
from tunneldb.cli.progress import bar, step
from tunneldb.cli.run import parameter_table
from tunneldb.cli.tables import print_classes
from tunneldb.errors import UserError
from tunneldb.files import exit_on_sigterm
from tunneldb.stages.parameters import PARAMETERS, settings

_PREFIXES = ("ground.", "cluster.")
_NAMES = [name for name in PARAMETERS if name.startswith(_PREFIXES)]


@command(
    epilog="\b\nParameters for --set, with their defaults:\n" + parameter_table(_NAMES),
    examples=["tunneldb ground scan.laz -o classed.laz"],
)
@click.argument("file", type=FilePath())
@click.option("-o", "--output", required=True, type=FilePath(dir_okay=False), help="File to write, .laz; not FILE.")
@click.option("--set", "assignments", multiple=True, metavar="NAME=VALUE", help="Set a parameter; see below. May be repeated.")
def ground(file: Path, output: Path, assignments: tuple[str, ...]) -> None:
    """Classify the points of FILE: ground, lining, fixtures and objects in front of the lining; needs no database.

    FILE may have any supported format; output is LAZ 1.4 with the classes 2 ground, 64 lining, 65 niche, 66 fixture,
    67 rail, 68 object, 70 noise. All other data of LAS and LAZ are kept. For a survey, tunneldb export --classified
    is more accurate.
    """
    for assignment in assignments:
        if not assignment.startswith(_PREFIXES):
            raise UserError(
                f"{assignment.partition('=')[0]!r} is no parameter of this command; parameters: {', '.join(_NAMES)}"
            )
    values = settings(assignments)
    from tunneldb.export.pointcloud.single_file import classify_file

    with exit_on_sigterm(), bar("points") as progress:
        found = classify_file(file, output, values, step(progress))
    add_to_json(file=output, ground=found.ground, lining=found.lining)
    print_classes(found.counts)
    if not found.ground:
        click.echo("no ground: nothing in the file is a floor")
    if not found.lining:
        click.echo("no lining: nothing in the file is a wall or a vault")
