"""The commands ``image``, ``image import``, ``image list`` and ``image remove``."""

from __future__ import annotations

import re
from pathlib import Path

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.output import DefaultGroup, add_to_json, notify
from tunneldb.cli.param_types import FINITE, FilePath, FiniteRange, WholeRange
from tunneldb.cli.progress import bar, say, step
from tunneldb.cli.tables import print_table
from tunneldb.counted import counted
from tunneldb.database import connect
from tunneldb.errors import UserError
from tunneldb.files import exit_on_sigterm, made_folder
from tunneldb.geometry.stationing import chainage_label
from tunneldb.store.imported_images import ImportedImage, read_imported, remove_imported
from tunneldb.store.survey import get_survey

_NAME = re.compile("[a-z0-9][a-z0-9-]{0,39}")


class _ImageGroup(DefaultGroup):
    """Its command is ``write`` where none is named: ``tunneldb image SURVEY``."""

    default = "write"


@click.group(cls=_ImageGroup)
def image() -> None:
    """Write the unrolled images of a survey; import images of other instruments."""


@image.command("write", examples=["tunneldb image write ringo-2024 -o images --km 511-512"])
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
def write(settings: Settings, survey: str, output: Path, km: str | None) -> None:
    """Write the unrolled images of SURVEY: raw and corrected intensity, offset from the surface, colour, states, and classes.

    For each kilometre and kind a Cloud Optimized GeoTIFF (dB, dB, m, and codes of states and classes with their
    colours; x is the chainage, y the arc, m) and a PNG preview, with leaks outlined on the corrected one. The image
    in colour has red, green, blue and opacity; it exists if points have colours. In previews, gaps between profiles
    up to 0.6 m apart are filled, except between states. A state is inspected or not, lining or not, dark or not.
    Classes need stage ground. Imported images are written as GeoTIFF only.

    The word write is optional: tunneldb image SURVEY.
    """
    from tunneldb.export.images.image import export_kilometre, image_kilometres
    from tunneldb.stages.run import nothing_yet, parse_km

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


@image.command(
    "import",
    examples=[
        "tunneldb image import ringo-2024 thermal.tif --kind thermal",
        "tunneldb image import ringo-2024 strip.tif --kind thermal --points points.csv --name thermal-night",
        "tunneldb image import ringo-2024 frames.csv --kind photo",
        "tunneldb image import ringo-2024 scan.e57 --kind photo --pixel 0.01",
    ],
)
@click.argument("survey")
@click.argument("file", type=FilePath(dir_okay=False))
@click.option(
    "--kind", required=True, type=click.Choice(["thermal", "photo", "radar", "moisture", "other"]), help="Kind of the image."
)
@click.option("--name", metavar="NAME", help="Name in the survey: small letters, digits and hyphens. [default: the kind]")
@click.option("--points", type=FilePath(dir_okay=False), help="File of control points, or of QGIS's georeferencer (.points).")
@click.option(
    "--pixel",
    type=FiniteRange(min=0, min_open=True),
    metavar="M",
    help="Side of a stored pixel, m. [default: about the image's]",
)
@click.option(
    "--unit", metavar="UNIT", help="Unit of the values. [default: the file's, else °C of a thermal image, % of moisture]"
)
@click.option("--band", type=WholeRange(1, 65535), metavar="N", help="Band of the file. [default: the only one, or colours]")
@click.option("--scale", type=FINITE, help="Value of one step of the stored numbers. [default: the file's, else 1]")
@click.option("--offset", type=FINITE, help="Value of the stored number 0. [default: the file's, else 0]")
@click.pass_obj
def import_(
    settings: Settings,
    survey: str,
    file: Path,
    kind: str,
    name: str | None,
    points: Path | None,
    pixel: float | None,
    unit: str | None,
    band: int | None,
    scale: float | None,
    offset: float | None,
) -> None:
    """Import an image of another instrument from FILE into the unrolled plane of SURVEY.

    FILE is a GeoTIFF, PNG or JPEG. Its place is given in one of three ways. (1) Its own coordinates, also of a world
    file: x is the chainage, y the arc, m. (2) Control points (--points): a CSV with column, row (in pixels, from the
    upper left corner), chainage and arc. An affine mapping is fitted to three points or more; with many points it
    follows a drifting odometer. Outliers are named and not used. (3) FILE is a CSV of frames with file, chainage_from
    (of the left edge), chainage_to, arc_from and arc_to (of the upper edge).

    FILE may also be an E57: its pictures with a pose (pinhole, spherical, cylindrical) are projected onto the lining.

    A chainage may be a station, as 12+345.678. The image is resampled into blocks of the survey. An image of the
    same name is replaced. Refused are mirrored images, images outside the survey, and images whose seam is at
    another side of the section. An image that exceeds the survey or is distorted gets a warning.
    """
    from tunneldb.pipeline.image_placement import ImportSettings
    from tunneldb.pipeline.import_image import import_image

    name = kind if name is None else name
    if not _NAME.fullmatch(name):
        raise UserError(f"--name {name!r}: use at most 40 small letters, digits and hyphens, beginning with a letter or digit")
    if unit is not None and (len(unit) > 20 or not unit.isprintable()):
        raise UserError(f"--unit {unit[:30]!r}: use at most 20 characters")
    if scale == 0:
        raise UserError("--scale 0: all values would be equal")
    chosen = ImportSettings(name, kind, points, pixel, unit, band, scale, offset)
    with exit_on_sigterm(), connect(settings.dsn) as conn, bar("km") as progress:
        done = import_image(conn, get_survey(conn, survey), file, chosen, step(progress))
    found = done.image
    for note in (*done.notes, *found.warnings):
        notify(f"{'Warning' if note in found.warnings else 'Note'}: {note}")
    add_to_json(
        survey=survey, image=found, replaced=done.replaced, kilometres=done.kilometres, blocks=done.blocks, points=done.points,
        notes=done.notes,
    )  # fmt: skip
    click.echo(f"{survey}: image {found.name} {'replaced' if done.replaced else 'imported'}: {_described(found)}")


def _described(found: ImportedImage) -> str:
    """Return the extent, the values and the accuracy of an image."""
    parts = [
        f"{chainage_label(found.chainage_from, 1)} to {chainage_label(found.chainage_to, 1)}",
        f"arc {found.arc_from:+.2f} to {found.arc_to:+.2f} m",
        f"pixel {found.pixel:g} m",
    ]
    if not found.colour:
        parts.append(f"values {found.value_from:g} to {found.value_to:g}{f' {found.unit}' if found.unit else ''}")
    if found.points is not None:
        used = found.points - (found.outliers or 0)
        parts.append(f"{found.model} by {counted(used, 'control point')}, residual {found.residual:.3f} m")
    if found.predicted is not None:
        parts.append(f"prediction error {found.predicted:.3f} m")
    return ", ".join(parts)


@image.command("list", examples=["tunneldb image list ringo-2024"])
@click.argument("survey")
@click.pass_obj
def list_(settings: Settings, survey: str) -> None:
    """List the images of other instruments that were imported into SURVEY."""
    with connect(settings.dsn) as conn:
        rows = read_imported(conn, get_survey(conn, survey))
    add_to_json(survey=survey, images=rows)
    header = [
        "name",
        "kind",
        "unit",
        "values",
        "from",
        "to",
        "arc m",
        "pixel m",
        "placed by",
        "residual m",
        "source",
        "imported by",
    ]
    cells = [
        [
            row.name, row.kind, row.unit, "colours" if row.colour else f"{row.value_from:g} to {row.value_to:g}",
            chainage_label(row.chainage_from, 1), chainage_label(row.chainage_to, 1),
            f"{row.arc_from:+.2f} to {row.arc_to:+.2f}", f"{row.pixel:g}",
            row.placement if row.points is None else f"{counted(row.points - (row.outliers or 0), 'point')}",
            None if row.residual is None else f"{row.residual:.3f}", row.source, row.imported_by,
        ]
        for row in rows
    ]  # fmt: skip
    if rows:
        print_table(header, cells, right=(4, 5, 6, 7, 9))


@image.command("remove", examples=["tunneldb image remove ringo-2024 thermal"])
@click.argument("survey")
@click.argument("name")
@click.pass_obj
def remove(settings: Settings, survey: str, name: str) -> None:
    """Delete the imported image NAME from SURVEY. The file that it came from stays."""
    with connect(settings.dsn) as conn:
        remove_imported(conn, get_survey(conn, survey), name)
        conn.commit()
    add_to_json(survey=survey, removed=name)
    click.echo(f"{survey}: image {name} removed")
