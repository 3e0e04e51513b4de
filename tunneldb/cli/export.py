"""The verb ``export``."""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np

from tunneldb.cli.classes import print_classes, told_to_end
from tunneldb.cli.main import Settings
from tunneldb.cli.progress import points_bar, step
from tunneldb.database import connect, get_survey
from tunneldb.errors import UserError
from tunneldb.export.atomic import make_folder
from tunneldb.job.run import loaded_kilometres, parse_km


@click.command()
@click.argument("survey")
@click.option("--classified", is_flag=True, help="Scan files at full density, each point with its class.")
@click.option(
    "-o",
    "--output",
    required=True,
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder to write to; made if it isn't there.",
)
@click.option("--km", metavar="A-B", help="Only files that touch these kilometres: 12 or 12-14.")
@click.pass_obj
def export(settings: Settings, survey: str, classified: bool, output: Path, km: str | None) -> None:
    """Write the scan files of SURVEY again, as LAZ 1.4 with the class of each point.

    The classes are those of stage ground, which must have run and be up to date in every kilometre that a file touches: 2
    ground, 64 lining, 65 niche, 66 appendage, 67 rail, 68 object, 69 target sphere, 70 noise, 1 outside of the surveyed
    tunnel. All else stays as it is in the files. A file is written whole and once, also where it touches several
    kilometres; it appears when it is complete, and is never written over a file of the survey.
    """
    if not classified:
        raise UserError(f"say what to export: tunneldb export {survey} --classified -o {output}")
    from tunneldb.export.classified import export_classified

    total = np.zeros(256, np.int64)
    with connect(settings.dsn) as conn:
        found = get_survey(conn, survey)
        there = loaded_kilometres(conn, found)
        if not there:
            raise UserError(f"survey {survey} holds no points yet: tunneldb load {survey} FILE...")
        wanted = parse_km(km, there)
        conn.rollback()
        make_folder(output)
        with told_to_end(), points_bar() as progress:
            for file in export_classified(conn, found, output, wanted, step(progress)):
                points = int(file.counts.sum())
                rate = points / file.seconds / 1e6
                click.echo(f"{file.path}: {points} points, {rate:.1f} million/s", err=True)
                total += file.counts
    print_classes(total)
