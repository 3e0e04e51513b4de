"""The command ``sections``."""

from __future__ import annotations

from pathlib import Path

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.measure import every_option, number, output_option, require_ending, say_written, surveys_in, write_rows
from tunneldb.cli.output import add_to_json, command
from tunneldb.cli.stretch import stretch_options
from tunneldb.cli.tables import print_table
from tunneldb.errors import UserError


@command(examples=["tunneldb sections ringo-2024 --every 20", "tunneldb sections ringo-2024 --from 511+700 -o sections.xlsx"])
@click.argument("survey")
@stretch_options
@every_option(10.0, "Distance between listed sections, m.")
@output_option("File to write: .csv or .xlsx.")
@click.pass_obj
def sections(settings: Settings, survey: str, start: str | None, end: str | None, every: float, output: Path | None) -> None:
    """List width, height and area of cross-sections of SURVEY at a step.

    For each multiple of the step, the nearest section within half a step. Area is inside the measured line, which ends
    at the ground or the track. If there is a design profile of layer lining, the table has its area and the difference.
    """
    from tunneldb.export.tables.section_dimensions import COLUMNS, dimension_rows, dimension_sheet
    from tunneldb.export.tables.workbook import write_workbook
    from tunneldb.files import replacing

    require_ending(output, "the table of sections", (".csv", ".xlsx"))
    with surveys_in(settings, [survey], start, end) as (conn, [found], part):
        rows = dimension_rows(conn, found, part.low, part.high, every)
    if not rows:
        run = f"tunneldb run {survey} --to sections"
        raise UserError(f"survey {survey} has no section there: {run}, or give another --from and --to")
    add_to_json(survey=survey, every=every, sections=rows)
    files: list[Path] = []
    if output is not None and output.suffix.lower() == ".xlsx":
        with replacing(output) as temporary:
            write_workbook(temporary, [dimension_sheet(rows)], f"{survey}: cross-sections")
        files = [output]
    elif output is not None:
        files = write_rows(output, COLUMNS, rows)
    print_table(
        ["station", "width m", "height m", "area m²", "measured %", "design m²", "difference m²"],
        [
            (
                row["label"], number(row["width"], 3), number(row["height"], 3), number(row["area"], 2),
                number(row["measured_share"], 0, 100.0), number(row["design_area"], 2), number(row["area_difference"], 2),
            )
            for row in rows
        ],
        right=(1, 2, 3, 4, 5, 6),
    )  # fmt: skip
    say_written(files)
