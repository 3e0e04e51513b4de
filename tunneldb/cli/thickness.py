"""The command ``thickness``."""

from __future__ import annotations

from pathlib import Path

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.measure import (
    axis_quality,
    axis_sigma_option,
    every_option,
    layer_option,
    number,
    output_option,
    require_ending,
    say_written,
    surveys_in,
    with_progress,
    write_rows,
)
from tunneldb.cli.output import add_to_json, command
from tunneldb.cli.param_types import FiniteRange
from tunneldb.cli.stretch import stretch_options
from tunneldb.cli.tables import print_table
from tunneldb.errors import UserError


@command(
    examples=[
        "tunneldb thickness excavation-2024 shotcrete-2024 --layer shotcrete --minimum 0.2",
        "tunneldb thickness ringo-2024 ringo-2025 --axis-sigma 0.005 -o thickness.csv",
    ]
)
@click.argument("before")
@click.argument("after")
@layer_option
@stretch_options
@click.option("--minimum", type=FiniteRange(0.0), metavar="M", help="Required thickness, m: states the area below it.")
@every_option()
@axis_sigma_option("Accuracy of the registration between the scans, standard deviation, m: part of the errors of volumes.")
@output_option("File to write: .csv of sections.")
@click.pass_obj
def thickness(
    settings: Settings,
    before: str,
    after: str,
    layer: str,
    start: str | None,
    end: str | None,
    minimum: float | None,
    every: float,
    axis_sigma: float | None,
    output: Path | None,
) -> None:
    """Compute layer thickness and volume between the surveys BEFORE and AFTER of one tunnel.

    Both are compared with the design profiles of one layer, in cells of 0.1 m along its lines and arcs: thickness is
    measured at right angles to these. Missing or outdated results are computed first. Volumes and areas include only
    lining that both inspected.
    """
    from tunneldb.measures.thickness.measure import measure_thickness
    from tunneldb.measures.thickness.tables import COLUMNS, section_rows, stretch_rows

    require_ending(output, "thickness", (".csv",))
    with surveys_in(settings, [before, after], start, end, of=1) as (conn, [old, new], part):
        made = with_progress(lambda begin: measure_thickness(conn, old, new, layer, part.low, part.high, begin))
        rows = stretch_rows(conn, old, new, layer, part.low, part.high, every, minimum or 0.0, axis_sigma or 0.0)
        if not rows:
            raise UserError(f"surveys {before} and {after} have no common section there that was compared with layer {layer}")
        sections = section_rows(conn, old, new, layer, part.low, part.high)
    add_to_json(before=before, after=after, layer=layer, made=made, minimum=minimum, axis_sigma=axis_sigma, stretches=rows)
    if output is None:
        add_to_json(sections=sections)
    files = [] if output is None else write_rows(output, COLUMNS, sections)
    print_table(
        ["from", "length m", "compared %", "volume m³", "±", "mean m", "least m", *(["thinner m²"] if minimum else [])],
        [
            (
                row["label"], number(row["length"], 1), number(100.0 * row["compared_area"] / row["design_area"], 1),
                number(row["volume"], 3), number(row["volume_sigma"], 3), number(row["thickness_mean"], 3),
                number(row["thickness_least"], 3), *([number(row["thin_area"], 2)] if minimum else []),
            )
            for row in rows
        ],
        right=(1, 2, 3, 4, 5, 6, 7),
    )  # fmt: skip
    quality = axis_quality(axis_sigma)
    click.echo(f"along layer {layer}; inspected in both; ± is one standard deviation; relative registration: {quality}")
    say_written(files)
