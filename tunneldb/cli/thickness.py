"""The verb ``thickness``."""

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
        "tunneldb thickness excavation-2024 shotcrete-2024 --layer shotcrete --minimum 0.2",
        "tunneldb thickness ringo-2024 ringo-2025 --axis-sigma 0.005 -o thickness.csv",
    ]
)
@click.argument("before")
@click.argument("after")
@layer_option
@stretch_options
@click.option(
    "--minimum", type=FiniteRange(0.0), metavar="M", help="Thickness that is demanded, m: states how many m² are thinner."
)
@click.option(
    "--every", type=FiniteRange(1.0), default=100.0, show_default=True, metavar="M", help="Length of the stretches listed, m.",
)  # fmt: skip
@click.option(
    "--axis-sigma", type=FiniteRange(0.0, 1.0), metavar="M",
    help="How well the two scans lie to each other, standard deviation, m: goes into the errors of volumes.",
)  # fmt: skip
@click.option("-o", "--output", type=FilePath(dir_okay=False), help="File to write: .csv of sections.")
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
    """State what lies between surveys BEFORE and AFTER of one tunnel: what was put on, or went.

    Both are held against the design profiles of one layer, whichever they show themselves, and compared in cells of 0.1 m along
    its lines and arcs: thickness is measured at right angles to these. What is missing or out of date is made first. Only what
    both saw is in a volume or an area.
    """
    from tunneldb.measures.deviation.tables import rows_csv
    from tunneldb.measures.thickness.measure import measure_thickness
    from tunneldb.measures.thickness.tables import COLUMNS, section_rows, stretch_rows

    if output is not None and output.suffix.lower() != ".csv":
        raise UserError(f"{output}: thickness is written as .csv")
    with connect(settings.dsn) as conn:
        old, new = get_survey(conn, before), get_survey(conn, after)
        part = parse_stretch(conn, new, start, end)
        conn.rollback()
        with exit_on_sigterm(), bar("km") as progress:
            made = measure_thickness(conn, old, new, layer, part.low, part.high, step(progress))
        rows = stretch_rows(conn, old, new, layer, part.low, part.high, every, minimum or 0.0, axis_sigma or 0.0)
        if not rows:
            raise UserError(f"surveys {before} and {after} have no section in common there that was held against layer {layer}")
        sections = section_rows(conn, old, new, layer, part.low, part.high)
    tell(before=before, after=after, layer=layer, made=made, minimum=minimum, axis_sigma=axis_sigma, stretches=rows)
    if output is None:
        tell(sections=sections)
    else:
        with replacing(output) as temporary:
            temporary.write_text(rows_csv(COLUMNS, sections), encoding="utf-8")
    tell(files=[] if output is None else [output])

    def said(value: float | None, decimals: int) -> str:
        return "" if value is None else f"{value:.{decimals}f}"

    print_table(
        ["from", "length m", "compared %", "volume m³", "±", "mean m", "least m", *(["thinner m²"] if minimum else [])],
        [
            (
                row["label"], said(row["length"], 1), said(100.0 * row["compared_area"] / row["design_area"], 1),
                said(row["volume"], 3), said(row["volume_sigma"], 3), said(row["thickness_mean"], 3),
                said(row["thickness_least"], 3), *([said(row["thin_area"], 2)] if minimum else []),
            )
            for row in rows
        ],
        right=(1, 2, 3, 4, 5, 6, 7),
    )  # fmt: skip
    lying = (
        "taken to be right: --axis-sigma says what it is good for"
        if axis_sigma is None
        else f"good for {1e3 * axis_sigma:g} mm"
    )
    click.echo(f"along layer {layer}; of what both saw; ± is one standard deviation, how the scans lie to each other {lying}")
    if output is not None:
        click.echo(f"written to {output}", err=True)
