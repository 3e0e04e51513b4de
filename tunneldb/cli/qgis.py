"""The command ``qgis``."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path

import click
import psycopg

from tunneldb.cli.coverage import say_coverage, say_remarks
from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command, notify
from tunneldb.cli.param_types import FilePath
from tunneldb.cli.progress import bar, step
from tunneldb.counted import counted
from tunneldb.database import connect
from tunneldb.errors import UserError
from tunneldb.export.images.change import export_change
from tunneldb.export.images.image import export_filled, export_kilometre, image_kilometres
from tunneldb.export.qgis import Rating, store_project, store_styles, write_project
from tunneldb.files import exit_on_sigterm, made_folder
from tunneldb.store.coverage import read_coverage
from tunneldb.store.rating import list_elements, scheme_rules
from tunneldb.store.remarks import read_remarks
from tunneldb.store.spots import read_spots
from tunneldb.store.survey import Survey, get_survey


@command(
    examples=[
        "tunneldb qgis demo-2024 -o demo.qgz",
        "tunneldb qgis demo-2024 --database --images /srv/tunnels/demo-2024",
        "tunneldb qgis demo-2024 -o demo.qgz --database demo --service tunnels",
        "tunneldb qgis demo-2024 -o demo.qgz --elements blocks --scheme example",
    ]
)
@click.argument("survey")
@click.option(
    "-o", "--output", type=FilePath(dir_okay=False),
    help="Project to write, .qgz or .qgs; its images go into a folder beside it.",
)  # fmt: skip
@click.option(
    "--database", "name", is_flag=False, flag_value="", metavar="[NAME]",
    help="Write the project to the database, under this name or the survey's; in QGIS: Project, Open From, "
        "PostgreSQL.",
)  # fmt: skip
@click.option(
    "--images", "folder", type=FilePath(file_okay=False),
    help="Folder of the images that all users can reach; default: FILE-images, or SURVEY-images here.",
)  # fmt: skip
@click.option("--service", metavar="NAME", help="Entry of pg_service.conf by which the project connects (never a password).")
@click.option("--elements", metavar="NAME", help="Elements whose rating the project shows (tunneldb elements list).")
@click.option("--scheme", metavar="NAME", help="Scheme by which they are rated (tunneldb rating list).")
@click.option("--scheme-version", metavar="VERSION", help="Version of the scheme; default: the one added last.")
@click.pass_obj
def qgis(
    settings: Settings,
    survey: str,
    output: Path | None,
    name: str | None,
    folder: Path | None,
    service: str | None,
    elements: str | None,
    scheme: str | None,
    scheme_version: str | None,
) -> None:
    """Write a QGIS project of SURVEY: map, unrolled lining, 3D and inspection sheets, with styled layers.

    If members of structures were found, it has them with faces and spots on the map, in space and unrolled, and an
    atlas with a page for each; the project of a site has only these.

    Leaks can be reviewed and axis vertices moved in it. It shows the intensity, or the offset if there is none, with
    gaps up to 0.6 m filled below it. For a survey compared with an older one it shows the changes. Styles are also
    stored in the database for layers that are added by hand. A project in the database refers to the images by
    absolute paths.

    With --elements and --scheme it shows the rating of the elements, as it is when the map is drawn: green to red,
    hatched for a lower bound, grey where nothing was inspected. Actions of the tunnel can be added and changed in it.
    """
    if output is None and name is None:
        raise UserError("say where the project goes: -o FILE.qgz, or --database")
    if output is not None and output.suffix.lower() not in (".qgz", ".qgs"):
        raise UserError(f"{output}: a QGIS project ends in .qgz or .qgs")
    if output is not None and not output.parent.is_dir():
        raise UserError(f"{output}: there is no folder {output.parent}")
    with connect(settings.dsn) as conn:
        found = get_survey(conn, survey, site=True)
        coverage = None if found.site else read_coverage(conn, found)
        spots, remarks = read_spots(conn, found), read_remarks(conn, found)
        rating = _rating(conn, found, elements, scheme, scheme_version)
        beside = Path(f"{found.name}-images") if output is None else output.with_name(f"{output.stem}-images")
        images = [] if found.site else _export_images(conn, found, folder or beside)
        written = []
        if output is not None:
            write_project(conn, found, output, images, service, rating)
            written.append(str(output))
        if name is not None:
            store_project(conn, found, name or found.name, images, service, rating)
            written.append(f"project {name or found.name} in public.qgis_projects")
        styles = _store_styles(conn)
        socket = conn.info.host.startswith("/")
    add_to_json(survey=survey, written=written, images=images, styles=styles)
    if coverage is not None:
        say_coverage(coverage, found)
    if spots.statement and (found.site or spots.face_area):
        notify(f"survey {survey}: {spots.statement}")
    say_remarks(remarks, found)
    notify(f"{', '.join(written)}: {counted(len(images), 'image')}, {styles}")
    if settings.dsn is None and service is None:
        notify("the project works while the database runs; after a restart of the machine: tunneldb server start")
    if name is not None and socket:
        notify("QGIS finds projects behind a socket only by an entry of pg_service.conf: docs/howto-qgis.md")


def _rating(
    conn: psycopg.Connection, survey: Survey, elements: str | None, scheme: str | None, version: str | None
) -> Rating | None:
    """Return the rating that the project shows, if any.

    Raises
    ------
    UserError
        If only one of elements and scheme is given, or one does not exist.
    """
    if elements is None and scheme is None and version is None:
        return None
    if elements is None or scheme is None:
        raise UserError("a rating needs both --elements NAME and --scheme NAME")
    chosen, _ = scheme_rules(conn, scheme, version)
    if all(one["element_set"] != elements for one in list_elements(conn, survey.tunnel_id)):
        raise UserError(f"tunnel {survey.tunnel} has no elements named {elements!r}: tunneldb elements list {survey.tunnel}")
    return Rating(elements, chosen["name"], chosen["version"], tuple(chosen["results"]))


def _export_images(conn: psycopg.Connection, survey: Survey, folder: Path) -> list[Path]:
    """Write the images of all kilometres and return the GeoTIFFs, with what is looked at also without gaps."""
    kilometres = image_kilometres(conn, survey)
    conn.rollback()
    written: list[Path] = []
    with exit_on_sigterm(), made_folder(folder) if kilometres else nullcontext(), bar("km") as progress:
        advance = step(progress)("images", len(kilometres))
        for km in kilometres:
            written += export_kilometre(conn, survey, km, folder)
            written += export_filled(conn, survey, km, folder)
            written += export_change(conn, survey, km, folder)
            advance(1)
    return [path for path in written if path.suffix == ".tif"]


def _store_styles(conn: psycopg.Connection) -> str:
    """Store the styles, or say that this user may not: the project holds them anyway."""
    try:
        with conn.transaction():
            return f"{counted(store_styles(conn), 'style')} in public.layer_styles"
    except psycopg.errors.InsufficientPrivilege:
        return "styles not stored in public.layer_styles: tunnel_operator may"
