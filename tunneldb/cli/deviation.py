"""The command ``deviation``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import psycopg

from tunneldb.cli.main import Settings
from tunneldb.cli.measure import (
    axis_quality,
    axis_sigma_option,
    every_option,
    layer_option,
    output_option,
    require_ending,
    say_written,
    surveys_in,
    with_progress,
    write_rows,
)
from tunneldb.cli.output import add_to_json, command
from tunneldb.cli.stretch import Stretch, stretch_options
from tunneldb.cli.tables import print_table
from tunneldb.errors import UserError
from tunneldb.files import by_kilometre, replacing
from tunneldb.store.survey import Survey

if TYPE_CHECKING:
    from tunneldb.measures.deviation.tables import Row


@command(
    examples=[
        "tunneldb deviation ringo-2024",
        "tunneldb deviation ringo-2024 --layer excavation --from 511+200 --to 511+400 --axis-sigma 0.01",
        "tunneldb deviation ringo-2024 -o sections.csv",
        "tunneldb deviation ringo-2024 -o sections.dxf --every 5",
    ]
)
@click.argument("survey")
@layer_option
@stretch_options
@every_option(text="Length of the listed stretches; distance of the sections of a .dxf, m.", shown="100; of a .dxf 10")
@axis_sigma_option("Accuracy of axis and registration, standard deviation, m: part of the errors of volumes.")
@output_option("File to write: .csv of sections, .dxf of sections with the design, .tif of each pixel, one a kilometre.")
@click.pass_obj
@click.pass_context
def deviation(
    context: click.Context,
    settings: Settings,
    survey: str,
    layer: str,
    start: str | None,
    end: str | None,
    every: float,
    axis_sigma: float | None,
    output: Path | None,
) -> None:
    """Measure the deviation of the lining of SURVEY from its design profiles, overbreak and underbreak.

    Missing or outdated kilometres are computed first, from the offset image: the distance of each lining pixel from
    the lines and arcs of the profile, positive inside. Areas are of sections of 1 m, volumes of stretches, both of
    the inspected lining; the rest is stated as not inspected. Add profiles by tunneldb profile add;
    docs/howto-shape.md describes the columns.
    """
    from tunneldb.measures.deviation.measure import measure_deviation
    from tunneldb.measures.deviation.tables import COLUMNS, section_rows, stretch_rows, volume

    require_ending(output, "deviation", (".csv", ".tif", ".dxf"))
    with surveys_in(settings, [survey], start, end) as (conn, [found], part):
        made = with_progress(lambda begin: measure_deviation(conn, found, layer, part.low, part.high, begin))
        whole = volume(conn, found, layer, part.low, part.high, axis_sigma or 0.0)
        if whole is None:
            raise UserError(f"survey {survey} has no lining or profile of layer {layer} there")
        rows = stretch_rows(conn, found, layer, part.low, part.high, every, axis_sigma or 0.0)
        add_to_json(survey=survey, layer=layer, made=made, axis_sigma=axis_sigma, volume=whole, stretches=rows)
        files: list[Path] = []
        if output is None:
            add_to_json(sections=section_rows(conn, found, layer, part.low, part.high))
        elif output.suffix.lower() == ".csv":
            files = write_rows(output, COLUMNS, section_rows(conn, found, layer, part.low, part.high))
        else:
            given = context.get_parameter_source("every") is not click.core.ParameterSource.DEFAULT
            files = _write(conn, found, layer, part, every if given else 10.0, output)
    _print(rows, whole, layer, axis_sigma)
    say_written(files)


def _write(conn: psycopg.Connection[Any], survey: Survey, layer: str, part: Stretch, every: float, output: Path) -> list[Path]:
    if output.suffix.lower() == ".dxf":
        from tunneldb.export.exchange.deviation_dxf import write_sections

        with replacing(output) as temporary:
            write_sections(conn, survey, layer, part.low, part.high, every, temporary)
        return [output]
    from tunneldb.export.images.deviation import write_deviation
    from tunneldb.measures.deviation.measure import deviation_from
    from tunneldb.stages.stale import result_states

    there = result_states(conn, deviation_from(survey, layer), part.low, part.high)
    paths = by_kilometre(output, list(there))
    written = (write_deviation(conn, survey, km, layer, path) for km, path in zip(there, paths, strict=True))
    return [path for path in written if path is not None]


def _print(rows: list[Row], whole: Row, layer: str, axis_sigma: float | None) -> None:
    def cells(row: Row) -> tuple[str, ...]:
        return (
            f"{row['length']:.1f}", f"{100.0 * row['seen_share']:.1f}", f"{row['overbreak']:.3f}",
            f"{row['overbreak_sigma']:.3f}", f"{row['underbreak']:.3f}", f"{row['underbreak_sigma']:.3f}",
        )  # fmt: skip

    table = [(row["label"], *cells(row)) for row in rows]
    print_table(
        ["from", "length m", "seen %", "overbreak m³", "±", "underbreak m³", "±"],
        [*table, ("all", *cells(whole))],
        right=(1, 2, 3, 4, 5, 6),
    )
    click.echo(f"compared with {layer}; inspected lining only; ± is one standard deviation; axis: {axis_quality(axis_sigma)}")
