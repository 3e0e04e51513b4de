"""The verb ``qgis``."""

from __future__ import annotations

from pathlib import Path

import click
import psycopg

from tunneldb.cli.main import Settings
from tunneldb.database import Survey, connect, get_survey
from tunneldb.errors import UserError
from tunneldb.export.image import export_kilometre, image_kilometres
from tunneldb.export.qgis import store_styles, write_project


@click.command()
@click.argument("survey")
@click.option(
    "-o", "--output", required=True, type=click.Path(dir_okay=False, path_type=Path),
    help="Project to write, .qgz or .qgs; its images go into a folder beside it.",
)  # fmt: skip
@click.option("--service", metavar="NAME", help="Let the project connect by this entry of pg_service.conf (never a password).")
@click.pass_obj
def qgis(settings: Settings, survey: str, output: Path, service: str | None) -> None:
    """Write a QGIS project of SURVEY: map, unrolled lining and 3D, with styled layers.

    Leaks can be reviewed and axis vertices moved in it. The styles also go into the database, where QGIS finds them
    for layers that are added by hand.
    """
    if output.suffix.lower() not in (".qgz", ".qgs"):
        raise UserError(f"{output}: a QGIS project ends in .qgz or .qgs")
    with connect(settings.dsn) as conn:
        found = get_survey(conn, survey)
        images = _export_images(conn, found, output.with_name(f"{output.stem}-images"))
        write_project(conn, found, output, images, service)
        styles = _store_styles(conn)
    click.echo(f"{output}: {len(images)} images, {styles}", err=True)
    if settings.dsn is None and service is None:
        click.echo("QGIS reads your own server; should it be stopped: tunneldb server start", err=True)


def _export_images(conn: psycopg.Connection, survey: Survey, folder: Path) -> list[Path]:
    """Write the images of all kilometres and return the GeoTIFFs."""
    kilometres = image_kilometres(conn, survey)
    conn.rollback()
    if kilometres:
        try:
            folder.mkdir(exist_ok=True)
        except OSError as error:
            raise UserError(f"{folder}: cannot be made: {error.strerror}") from error
    written = [path for km in kilometres for path in export_kilometre(conn, survey, km, folder)]
    return [path for path in written if path.suffix == ".tif"]


def _store_styles(conn: psycopg.Connection) -> str:
    """Store the styles, or say that this user may not: the project holds them anyway."""
    try:
        with conn.transaction():
            return f"{store_styles(conn)} styles in public.layer_styles"
    except psycopg.errors.InsufficientPrivilege:
        return "styles not stored in public.layer_styles: tunnel_operator may"
