"""The verb ``thickness``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

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
from tunneldb.files import replacing, told_to_end
from tunneldb.store.survey import get_survey

if TYPE_CHECKING:
    from tunneldb.export.tables.thickness import Row


@verb(
    examples=[
        "tunneldb thickness ringo-excavated ringo-sprayed --layer excavation --minimum 0.2",
        "tunneldb thickness ringo-sprayed ringo-2024 --from 511+200 --to 511+400 -o thickness.csv",
    ]
)
@click.argument("before")
@click.argument("after")
@layer_option
@stretch_options
@click.option(
    "--minimum", type=FiniteRange(0.0), metavar="M",
    help="Thickness that is demanded, m: how much is thinner, and where, is told.",
)  # fmt: skip
@click.option(
    "--every", type=FiniteRange(1.0), default=100.0, show_default=True, metavar="M",
    help="Length of the stretches that are listed, m.",
)  # fmt: skip
@click.option(
    "--axis-sigma", type=FiniteRange(0.0, 1.0), metavar="M",
    help="What the places of the two scans are good for against each other, standard deviation, m: goes into ±.",
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
    """Tell what was put on the lining between the surveys BEFORE and AFTER of one tunnel.

    Both are held against the design profiles of one layer, which is done first where it is missing or out of date; the
    difference of the two distances, cell by cell, is the thickness at right angles to the profile. So the profiles need not be
    those that were built: they only say along which normals is measured. Volumes are of what both surveys saw. Where the
    surveys lie wrong against each other, thickness is wrong by as much: --axis-sigma says what that comes to.
    """
    from tunneldb.export.tables.thickness import below_rows, section_rows, sections_csv, stretch_rows
    from tunneldb.pipeline.thickness import measure_thickness

    if output is not None and output.suffix.lower() != ".csv":
        raise UserError(f"{output}: thickness is written as .csv")
    with connect(settings.dsn) as conn:
        earlier, later = get_survey(conn, before), get_survey(conn, after)
        part = parse_stretch(conn, later, start, end)
        conn.rollback()
        with told_to_end(), bar("km") as progress:
            made = measure_thickness(conn, earlier, later, layer, part.low, part.high, step(progress))
        least, sigma = minimum or 0.0, axis_sigma or 0.0
        rows = stretch_rows(conn, earlier, later, layer, part.low, part.high, every, least, sigma)
        whole = stretch_rows(conn, earlier, later, layer, part.low, part.high, None, least, sigma)
        if not rows:
            raise UserError(f"surveys {before} and {after} have no section in common there")
        tell(before=before, after=after, layer=layer, made=made, axis_sigma=axis_sigma, minimum=minimum)
        tell(stretches=rows, whole=whole[0])
        if minimum is not None:
            tell(below=below_rows(conn, earlier, later, layer, part.low, part.high, minimum))
        sections = section_rows(conn, earlier, later, layer, part.low, part.high)
    if output is None:
        tell(sections=sections)
    else:
        with replacing(output) as temporary:
            temporary.write_text(sections_csv(sections), encoding="utf-8")
        tell(files=[output])
    _print(rows, whole[0], layer, minimum, axis_sigma)
    if output is not None:
        click.echo(f"written to {output}", err=True)


def _print(rows: list[Row], whole: Row, layer: str, minimum: float | None, axis_sigma: float | None) -> None:
    def cells(row: Row) -> list[str]:
        mean, least = ("–" if row[name] is None else f"{1e3 * row[name]:.1f}" for name in ("thickness_mean", "thickness_least"))
        below = [] if minimum is None else [f"{row['below_area']:.2f}"]
        return [
            f"{row['length']:.1f}", f"{100.0 * row['compared_share']:.1f}", f"{row['volume']:.3f}",
            f"{row['volume_sigma']:.3f}", mean, least, *below,
        ]  # fmt: skip

    under = [] if minimum is None else [f"under {1e3 * minimum:g} mm m²"]
    print_table(
        ["from", "length m", "compared %", "volume m³", "±", "mean mm", "least mm", *under],
        [*((row["label"], *cells(row)) for row in rows), ("all", *cells(whole))],
        right=tuple(range(1, 7 + len(under))),
    )
    place = (
        "the scans taken to lie right against each other: --axis-sigma says what that is good for"
        if axis_sigma is None
        else f"the scans good for {1e3 * axis_sigma:g} mm against each other"
    )
    click.echo(f"at right angles to {layer}; of what both saw; ± is one standard deviation, {place}")
