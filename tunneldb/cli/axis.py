"""The command ``axis``."""

from __future__ import annotations

from pathlib import Path

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command, notify
from tunneldb.cli.param_types import FilePath
from tunneldb.cli.stretch import parse_stretch, stretch_options
from tunneldb.cli.tables import print_table
from tunneldb.database import connect
from tunneldb.store.survey import get_survey


@command(examples=["tunneldb axis ringo-2024", "tunneldb axis ringo-2024 --from 511+700 -o axis.svg"])
@click.argument("survey")
@stretch_options
@click.option("-o", "--output", type=FilePath(dir_okay=False), help="File to write: .png, .pdf, .svg, or .csv.")
@click.pass_obj
def axis(settings: Settings, survey: str, start: str | None, end: str | None, output: Path | None) -> None:
    """Show the deviation of the axis of SURVEY from the given axis.

    Measured minus given, to the right looking up-chainage and upwards, mm: mean and maximum for each element of the
    design alignment, or for each kilometre if the axis is a table. Interpolated vertices are not counted. With -o, a
    figure of the deviation along the tunnel with the elements of the design, or a table (.csv, metres) of all
    vertices.
    """
    from tunneldb.export.figures.axis_deviation import check_format, write_deviation
    from tunneldb.store.alignment import load_deviation

    if output is not None:
        check_format(output)
    with connect(settings.dsn) as conn:
        found = get_survey(conn, survey)
        stretch = parse_stretch(conn, found, start, end)
        deviation = load_deviation(conn, found, stretch.low, stretch.high)
    add_to_json(survey=survey, elements=deviation.summaries(), file=output)
    header = ["from", "to", "what", "vertices", "right mm", "at most", "up mm", "at most"]
    rows = [
        (s.label_from, s.label_to, s.title, s.vertices, *map(_millimetres, (s.right_mean, s.right_most, s.up_mean, s.up_most)))
        for s in deviation.summaries()
    ]
    print_table(header, rows, right=(0, 1, 3, 4, 5, 6, 7))
    if output is not None:
        write_deviation(deviation, output)
        notify(f"deviation to {output}")


def _millimetres(metres: float) -> str:
    return "" if metres != metres else f"{1000.0 * metres:+.1f}"
