"""The command ``findings trace``."""

from __future__ import annotations

from pathlib import Path

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command, notify
from tunneldb.cli.param_types import FilePath, FiniteRange, WholeRange
from tunneldb.cli.progress import bar, step
from tunneldb.counted import counted
from tunneldb.database import connect
from tunneldb.files import exit_on_sigterm
from tunneldb.store.survey import get_survey


@command(
    "trace",
    examples=[
        "tunneldb findings trace ringo-2024 cracks.png --points points.csv",
        "tunneldb findings trace ringo-2024 masks.csv --min-length 0.3",
    ],
)
@click.argument("survey")
@click.argument("file", type=FilePath(dir_okay=False))
@click.option("--points", type=FilePath(dir_okay=False), help="File of control points, or of QGIS's georeferencer (.points).")
@click.option("--band", type=WholeRange(1, 65535), metavar="N", help="Band of the mask. [default: the only one, or colours]")
@click.option(
    "--min-length", type=FiniteRange(0.01, 1000.0), default=0.1, show_default=True, metavar="M", help="Minimum length, m."
)
@click.pass_obj
def trace(settings: Settings, survey: str, file: Path, points: Path | None, band: int | None, min_length: float) -> None:
    """Trace the cracks of a mask and add them to SURVEY as open findings of kind crack.

    FILE is a PNG or GeoTIFF whose pixels are 0, and one other value in cracks; or a CSV of frames. It is placed as by
    image import: by its own coordinates, by control points (--points), or by the table of frames. The areas
    are thinned to lines. A crack has the length of its line, and as width the area of the mask divided by the length.

    Shorter lines than --min-length are left out, also areas wider than 100 mm, lines beyond the lining, and cracks that
    SURVEY has already. The area of the masks is recorded as searched for cracks.
    """
    from tunneldb.pipeline.trace_mask import MAX_WIDTH, trace_mask

    with exit_on_sigterm(), connect(settings.dsn) as conn, bar("masks") as progress:
        done = trace_mask(conn, get_survey(conn, survey), file, points, band, min_length, step(progress))
    for warning in done.warnings:
        notify(f"Warning: {warning}")
    for note in done.notes:
        notify(f"Note: {note}")
    if done.short:
        notify(f"Note: left out: {counted(done.short, 'line')} shorter than {min_length:g} m, in all {done.short_length:.2f} m")
    if done.wide:
        notify(f"Note: left out: {counted(done.wide, 'area')} wider than {MAX_WIDTH:g} mm")
    if done.beyond:
        notify(f"Warning: left out: {counted(done.beyond, 'crack')} beyond the lining")
    if done.repeated:
        notify(f"Note: left out: {counted(done.repeated, 'crack')} that the survey has already")
    widths = [line.width_mm for line in done.lines]
    add_to_json(
        survey=survey, ids=done.ids, length=sum(line.length for line in done.lines), short=done.short,
        short_length=done.short_length, wide=done.wide, beyond=done.beyond, repeated=done.repeated, searched=done.searched,
        warnings=done.warnings, notes=done.notes, points=done.points,
    )  # fmt: skip
    size = f", mask {min(widths):.1f} to {max(widths):.1f} mm wide" if widths else ""
    click.echo(
        f"{survey}: {counted(len(done.ids), 'crack')} traced, {sum(line.length for line in done.lines):.2f} m{size}; searched:"
        f" {done.searched.chainage_from:.2f} to {done.searched.chainage_to:.2f} m"
    )
