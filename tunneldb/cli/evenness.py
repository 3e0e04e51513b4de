"""The command ``evenness``."""

from __future__ import annotations

from pathlib import Path

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.measure import (
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
        "tunneldb evenness ringo-2024 --length 2 --limit 0.02",
        "tunneldb evenness ringo-2024 --layer shotcrete --length 4 --limit 0.1 -o evenness.csv",
    ]
)
@click.argument("survey")
@layer_option
@stretch_options
@click.option(
    "--length", type=FiniteRange(0.5, 10.0), default=2.0, show_default=True, metavar="M", help="Length of the straightedge, m.",
)  # fmt: skip
@click.option(
    "--limit", type=FiniteRange(0.001, 10.0), default=0.02, show_default=True, metavar="M",
    help="Gap above which areas are outlined and summed, m.",
)  # fmt: skip
@every_option()
@output_option("File to write: .csv of sections of 1 m.")
@click.pass_obj
def evenness(
    settings: Settings,
    survey: str,
    layer: str,
    start: str | None,
    end: str | None,
    length: float,
    limit: float,
    every: float,
    output: Path | None,
) -> None:
    """Measure evenness of the lining of SURVEY with a virtual straightedge, along the tunnel and around its section.

    It rests on two cells of 0.1 m of the deviation image; around the section it has the curvature of the design. The
    gap is measured between these points. Each cell has the greatest gap of all straightedges over it. Missing or
    outdated deviation is computed first; docs/howto-shape.md describes the columns.
    """
    from tunneldb.measures.evenness.measure import measure_evenness
    from tunneldb.measures.evenness.tables import COLUMNS, section_rows, stretch_rows

    require_ending(output, "evenness", (".csv",))
    with surveys_in(settings, [survey], start, end) as (conn, [found], part):
        made = with_progress(lambda begin: measure_evenness(conn, found, layer, length, limit, part.low, part.high, begin))
        rows = stretch_rows(conn, found, layer, part.low, part.high, every)
        if not rows:
            raise UserError(f"survey {survey} has no lining there that was compared with layer {layer}")
        sections = section_rows(conn, found, layer, part.low, part.high)
    add_to_json(survey=survey, layer=layer, made=made, length=length, limit=limit, stretches=rows)
    if output is None:
        add_to_json(sections=sections)
    files = [] if output is None else write_rows(output, COLUMNS, sections)
    print_table(
        ["from", "seen m²", "not measured m²", "over limit m²", "gap along mm", "gap around mm", "waviness %"],
        [
            (
                row["label"], f"{row['lining_area']:.1f}", f"{row['lining_area'] - row['measured_area']:.1f}",
                f"{row['over_area']:.2f}", number(row["gap_along"], 1, 1e3), number(row["gap_around"], 1, 1e3),
                number(row["waviness"], 1, 100.0),
            )
            for row in rows
        ],
        right=(1, 2, 3, 4, 5, 6),
    )  # fmt: skip
    click.echo(f"beneath {length:g} m, on a template of layer {layer}; limit {1e3 * limit:g} mm")
    say_written(files)
