"""The verb ``evenness``."""

from __future__ import annotations

from pathlib import Path

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.output import tell, verb
from tunneldb.cli.param_types import FilePath, FiniteRange
from tunneldb.cli.profile import layer_option
from tunneldb.cli.progress import bar, step
from tunneldb.cli.stretch import parse_stretch, stretch_options
from tunneldb.cli.tables import print_table
from tunneldb.database import connect
from tunneldb.errors import UserError
from tunneldb.files import exit_on_sigterm, replacing
from tunneldb.store.survey import get_survey


@verb(
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
    help="Greater gaps beneath it are outlined and summed up, m.",
)  # fmt: skip
@click.option(
    "--every", type=FiniteRange(1.0), default=100.0, show_default=True, metavar="M", help="Length of the stretches listed, m.",
)  # fmt: skip
@click.option("-o", "--output", type=FilePath(dir_okay=False), help="File to write: .csv of sections of 1 m.")
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
    """Lay a straightedge on the lining of SURVEY, along the tunnel and around its section, and state the gaps beneath it.

    It lies on cells of 0.1 m of the image of deviation, from the design profiles of the layer, on the two points that it
    touches; around the section it has the curvature of the design, as a template has. The gap is measured between these points.
    Each place of the lining has the greatest gap of all straightedges over it. Deviation is made first, where it is missing or
    out of date; docs/howto-shape.md says what the columns mean.
    """
    from tunneldb.measures.deviation.tables import rows_csv
    from tunneldb.measures.evenness.measure import measure_evenness
    from tunneldb.measures.evenness.tables import COLUMNS, section_rows, stretch_rows

    if output is not None and output.suffix.lower() != ".csv":
        raise UserError(f"{output}: evenness is written as .csv")
    with connect(settings.dsn) as conn:
        found = get_survey(conn, survey)
        part = parse_stretch(conn, found, start, end)
        conn.rollback()
        with exit_on_sigterm(), bar("km") as progress:
            made = measure_evenness(conn, found, layer, length, limit, part.low, part.high, step(progress))
        rows = stretch_rows(conn, found, layer, part.low, part.high, every)
        if not rows:
            raise UserError(f"survey {survey} has no lining there that was held against layer {layer}")
        sections = section_rows(conn, found, layer, part.low, part.high)
    tell(survey=survey, layer=layer, made=made, length=length, limit=limit, stretches=rows)
    if output is None:
        tell(sections=sections)
    else:
        with replacing(output) as temporary:
            temporary.write_text(rows_csv(COLUMNS, sections), encoding="utf-8")
    tell(files=[] if output is None else [output])

    def millimetres(value: float | None) -> str:
        return "" if value is None else f"{1e3 * value:.1f}"

    print_table(
        ["from", "seen m²", "not measured m²", "over limit m²", "gap along mm", "gap around mm", "waviness %"],
        [
            (
                row["label"], f"{row['lining_area']:.1f}", f"{row['lining_area'] - row['measured_area']:.1f}",
                f"{row['over_area']:.2f}", millimetres(row["gap_along"]), millimetres(row["gap_around"]),
                "" if row["waviness"] is None else f"{100.0 * row['waviness']:.1f}",
            )
            for row in rows
        ],
        right=(1, 2, 3, 4, 5, 6),
    )  # fmt: skip
    click.echo(f"beneath {length:g} m, on a template of layer {layer}; limit {1e3 * limit:g} mm")
    if output is not None:
        click.echo(f"written to {output}", err=True)
