"""The command ``image``."""

from __future__ import annotations

from pathlib import Path

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command
from tunneldb.cli.param_types import FilePath
from tunneldb.cli.progress import bar, say, step
from tunneldb.database import connect
from tunneldb.export.images.image import export_kilometre, image_kilometres
from tunneldb.files import exit_on_sigterm, made_folder
from tunneldb.stages.run import nothing_yet, parse_km
from tunneldb.store.survey import get_survey


@command(examples=["tunneldb image ringo-2024 -o images --km 511-512"])
@click.argument("survey")
@click.option(
    "-o",
    "--output",
    type=FilePath(file_okay=False),
    default=Path(),
    help="Folder to write to, created if missing. [default: the current one]",
)
@click.option("--km", metavar="A-B", help="Only these kilometres: 12 or 12-14.")
@click.pass_obj
def image(settings: Settings, survey: str, output: Path, km: str | None) -> None:
    """Write the unrolled images of SURVEY: raw and corrected intensity, offset from the surface, colour, states, and classes.

    For each kilometre and kind a Cloud Optimized GeoTIFF (dB, dB, m, and codes of states and classes with their
    colours; x is the chainage, y the arc, m) and a PNG preview, with leaks outlined on the corrected one. The image
    in colour has red, green, blue and opacity; it exists if points have colours. In previews, gaps between profiles
    up to 0.6 m apart are filled, except between states. A state is inspected or not, lining or not, dark or not.
    Classes need stage ground.
    """
    with connect(settings.dsn) as conn:
        found = get_survey(conn, survey)
        there = image_kilometres(conn, found)
        if not there:
            raise nothing_yet(conn, found, "has no images")
        wanted = parse_km(km, there)
        conn.rollback()
        files: list[Path] = []
        add_to_json(survey=survey, files=files)
        with exit_on_sigterm(), made_folder(output), bar("km") as progress:
            advance = step(progress)("images", len(wanted))
            for number, kilometre in enumerate(wanted, start=1):
                for path in export_kilometre(conn, found, kilometre, output):
                    files.append(path)
                    say(f"[{number}|{len(wanted)}] {path}", err=True)
                advance(1)
