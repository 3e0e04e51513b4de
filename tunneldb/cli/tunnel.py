"""`tunneldb tunnel`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tunneldb.alignment.units import UNITS
from tunneldb.cli.main import Settings
from tunneldb.cli.output import CommandGroup, add_to_json, notify, records
from tunneldb.cli.param_types import FINITE, FilePath, file_path
from tunneldb.cli.progress import bar, step, tell_warnings
from tunneldb.cli.tables import print_table
from tunneldb.cli.units import unit_options
from tunneldb.counted import counted
from tunneldb.database import connect
from tunneldb.errors import UserError
from tunneldb.files import exit_on_sigterm
from tunneldb.numerals import parse_whole
from tunneldb.store.listing import list_station_pieces, list_tunnels

if TYPE_CHECKING:
    from tunneldb.alignment.found import FoundAxis

AUTO = "auto"
"""Stands for a file of the axis that is to be found in the scan."""


class Srid(click.ParamType[int]):
    """An EPSG number, or the word for local coordinates."""

    name = "EPSG|local"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Return the number, LOCAL for ``local``."""
        from tunneldb.geometry.local import LOCAL

        if value == "local":
            return LOCAL
        try:
            number = parse_whole(str(value))
        except ValueError:
            raise UserError(f"--srid {value!r} is neither an EPSG number, such as 25830, nor local") from None
        if number == LOCAL:  # PostGIS's number for it would be typed by mistake
            raise UserError(f"PostGIS does not know SRID {number}; use an EPSG number, such as 25830, or local")
        return number


@click.group(cls=CommandGroup)
def tunnel() -> None:
    """Add, list or remove tunnels; set their stationing."""


@tunnel.command(
    examples=[
        "tunneldb tunnel add ringo --srid 3794 --axis ringo.axis.csv --start-chainage 511746.75",
        "tunneldb tunnel add ringo --srid 3794 --axis auto ringo.laz",
        "tunneldb tunnel add ringo --srid 3794 --axis drawn.gpkg --axis-layer axis --reverse ringo.laz",
        "tunneldb tunnel add ringo --srid 3794 --axis ringo.xml --alignment Mainline",
        "tunneldb tunnel add hall --srid 25829 --site",
        "tunneldb tunnel add adit --srid local --axis auto adit.laz",
    ]
)
@click.argument("name")
@click.argument("scans", metavar="[SCAN...]", nargs=-1, type=FilePath())
@click.option(
    "--srid",
    type=Srid(),
    required=True,
    help="Spatial reference of all coordinates: EPSG number of a projected system in metres, or local: "
    "metres in own coordinates.",
)
@click.option(
    "--axis",
    metavar="FILE|auto",
    help="Design alignment (LandXML, IFC 4.3); lines of a drawing or a map (DXF, GeoPackage, Shapefile, GeoJSON, FlatGeobuf); "
    "CSV with a header x,y,z, or a trajectory: points of the axis in growing chainage; or auto: found in the SCAN files.",
)
@click.option("--site", is_flag=True, help="A structure without an axis: a bridge, a hall, a plant.")
@click.option("--axis-layer", metavar="NAME", help="Layer of a drawing or map, if several hold lines.")
@click.option(
    "--axis-unit",
    type=click.Choice(UNITS),
    metavar="UNIT",
    help="Unit of the lengths of a LandXML or DXF without a unit, or with a wrong one: millimeter, "
    "centimeter, meter, kilometer, inch, foot, USSurveyFoot, mile. ",
)
@unit_options("SCAN files")
@click.option(
    "--alignment",
    metavar="NAME",
    help="Name of the alignment, if a LandXML or IFC file has several; number of the line, if lines are not connected.",
)
@click.option("--profile", metavar="NAME", help="Profile of the alignment, if it has several.")
@click.option("--reverse", is_flag=True, help="Reverse the direction of chainage; not for a design alignment.")
@click.option(
    "--start-chainage",
    type=FINITE,
    metavar="M",
    help="Chainage of the start of the axis. [default: that of the alignment; else 0]",
)
@click.option(
    "--spacing", type=FINITE, default=10.0, show_default=True, metavar="M", help="Distance between the axis vertices."
)
@click.option(
    "--stationing",
    "equations",
    type=FilePath(),
    metavar="FILE",
    help="CSV of the tunnel's stationing, see tunneldb tunnel stationing. [default: that of the alignment]",
)
@click.option(
    "--axis-out",
    type=FilePath(dir_okay=False),
    metavar="FILE",
    help="File of an axis found in SCAN files, .csv, with a picture, .png, beside it. [default: NAME.found-axis.csv]",
)
@click.pass_obj
def add(
    settings: Settings,
    name: str,
    scans: tuple[Path, ...],
    srid: int,
    axis: str | None,
    site: bool,
    axis_layer: str | None,
    axis_unit: str | None,
    unit: str | None,
    height_unit: str | None,
    alignment: str | None,
    profile: str | None,
    reverse: bool,
    start_chainage: float | None,
    spacing: float,
    equations: Path | None,
    axis_out: Path | None,
) -> None:
    """Add the tunnel NAME with its given axis, or, with --site, a structure without an axis.

    The elements of a design alignment (lines, arcs, clothoids; grades, parabolas, circles) and its stationing are
    stored, and the axis follows them to a millimetre. Lengths in feet are converted if the file states them.

    Lines that meet end to end are joined. A line without heights, as drawn in QGIS, takes its heights and the
    tunnel's middle from SCAN files. --axis auto needs SCAN files only; check the picture that is written.
    """
    from tunneldb.alignment.drawing import describe_line
    from tunneldb.alignment.given import read_given
    from tunneldb.geometry.crs import outside_area
    from tunneldb.pipeline.axis_search import complete, found_given
    from tunneldb.pointcloud.units import NOT_GIVEN, GivenUnits
    from tunneldb.store.alignment import read_equations, save_equations
    from tunneldb.store.catalog import add_tunnel, require_new_tunnel
    from tunneldb.store.tunnel import get_tunnel

    if (axis is None) != site:
        raise UserError("give a tunnel its --axis; or say --site, if it has none")
    if axis is None:
        about_axis = {
            "--axis-layer": axis_layer, "--axis-unit": axis_unit, "--unit": unit, "--height-unit": height_unit,
            "--alignment": alignment, "--profile": profile, "--start-chainage": start_chainage, "--stationing": equations,
            "--axis-out": axis_out, "--reverse": reverse or None, "SCAN": scans or None,
        }  # fmt: skip
        _add_site(settings, name, srid, [option for option, value in about_axis.items() if value is not None])
        return
    units = GivenUnits(unit, height_unit)
    if units != NOT_GIVEN and not scans:
        raise UserError("--unit and --height-unit are of SCAN files; --axis-unit is that of a LandXML or DXF")
    own = read_equations(equations) if equations else None
    found = None
    with connect(settings.dsn) as connection:
        require_new_tunnel(connection, name, srid)
    if axis == AUTO:
        if {axis_layer, axis_unit, alignment, profile} != {None}:
            raise UserError("--axis auto reads SCAN files; --axis-layer, --axis-unit, --alignment and --profile are for others")
        with exit_on_sigterm(), bar("points") as progress:
            given, found = found_given(scans, srid, step(progress), start_chainage, reverse, units)
    else:
        given = read_given(
            file_path(axis), start_chainage, alignment, profile, layer=axis_layer, unit=axis_unit, srid=srid, reverse=reverse
        )
        if given.has_heights and scans:
            raise UserError(f"{axis} has heights; SCAN files go with --axis auto, or with a line that has none")
        if not given.has_heights:
            if not scans:
                raise UserError(
                    f"{axis}: its line has no heights; give the scan files too, which have them: "
                    f"tunneldb tunnel add {name} --srid {srid or 'local'} --axis {axis} SCAN..."
                )
            with exit_on_sigterm(), bar("points") as progress:
                given, found = complete(given, scans, srid, step(progress), units)
    if found is None and axis_out is not None:
        raise UserError("--axis-out is for an axis that is found in SCAN files")
    with connect(settings.dsn) as connection:
        tell_warnings(connection)
        line = add_tunnel(connection, name, srid, given, spacing)
        if own is not None:
            save_equations(connection, get_tunnel(connection, name), own)
        if found is not None:
            _keep(found, axis_out or Path(f"{name}.found-axis.csv"), None, line.start, name)
    place = outside_area(srid, given.xyz[:, :2])
    notes = (*given.notes, place) if place else given.notes
    add_to_json(
        tunnel=name,
        srid=srid,
        chainage_from=line.start,
        chainage_to=line.end,
        source=given.source,
        begins_at=given.xyz[0].tolist(),
        ends_at=given.xyz[-1].tolist(),
        notes=notes,
    )
    notify(f"{name}: {line.end - line.start:.3f} m of axis, chainage {line.start:.3f} to {line.end:.3f} m")
    turn = "" if given.design is not None else "; --reverse turns it round"
    notify(f"chainage grows over {describe_line(given.xyz)}{turn}")
    if given.design is not None:
        plan, profiles = len(given.design.plan), len(given.design.profile)
        add_to_json(plan_elements=plan, profile_elements=profiles)
        notify(f"{given.source}: {counted(plan, 'element')} in plan, {profiles} in profile")
    for note in notes:
        notify(f"{axis}: {note}")


def _add_site(settings: Settings, name: str, srid: int, given: list[str]) -> None:
    """Add a site; no option of an axis may be given."""
    from tunneldb.store.catalog import add_site

    if given:
        raise UserError(f"a --site has no axis: omit {', '.join(given)}")
    with connect(settings.dsn) as connection:
        tell_warnings(connection)
        add_site(connection, name, srid)
    add_to_json(tunnel=name, srid=srid, site=True)
    notify(f"{name}: a site, without an axis")


@tunnel.command(
    "find-axis",
    examples=["tunneldb tunnel find-axis ringo.laz", "tunneldb tunnel find-axis ringo-1.laz ringo-2.laz -o ringo.axis.csv"],
)
@click.argument("scans", metavar="SCAN...", nargs=-1, required=True, type=FilePath())
@click.option(
    "-o",
    "--output",
    type=FilePath(dir_okay=False),
    help="Axis to write, .csv with x,y,z. [default: NAME.found-axis.csv, with the name of the SCAN files]",
)
@click.option(
    "--picture",
    type=FilePath(dir_okay=False),
    metavar="FILE",
    help="Picture to write, .png. [default: beside the axis, with its name]",
)
@click.option("--reverse", is_flag=True, help="Reverse the direction of chainage.")
@unit_options("SCAN files")
def find_axis(
    scans: tuple[Path, ...],
    output: Path | None,
    picture: Path | None,
    reverse: bool,
    unit: str | None,
    height_unit: str | None,
) -> None:
    """Find the axis of the tunnel in SCAN files; needs no database.

    It needs a roof, two walls and a floor along most of one tunnel. The tunnel may be straight or curved, level or
    steep, with niches, cross passages, a train, or open cuts at the portals. Chainage increases from the western end.
    The picture shows the line over the points in plan and profile: check it, then use tunneldb tunnel add --axis.
    """
    from tunneldb.alignment.drawing import describe_line
    from tunneldb.files import common_name
    from tunneldb.pipeline.axis_search import found_given
    from tunneldb.pointcloud.units import GivenUnits

    name = common_name(scans)
    with exit_on_sigterm(), bar("points") as progress:
        _, found = found_given(scans, None, step(progress), None, reverse, GivenUnits(unit, height_unit))
    _keep(found, output or Path(f"{name}.found-axis.csv"), picture, 0.0, name)
    notify(f"chainage grows over {describe_line(found.xyz)}; --reverse turns it round")


def _keep(found: FoundAxis, path: Path, picture: Path | None, start: float, title: str) -> None:
    """Write an axis that was found, with its picture, and say how far to trust it."""
    from tunneldb.export.figures.found_axis import write_found
    from tunneldb.files import replacing
    from tunneldb.pipeline.axis_search import describe_found, write_axis

    picture = picture or path.with_suffix(".png")
    if path.suffix.lower() != ".csv" or picture.suffix.lower() != ".png":
        raise UserError(f"{path}, {picture}: an axis is written as .csv, its picture as .png")
    with replacing(picture) as drawn, replacing(path) as written:
        write_axis(written, found.xyz)
        write_found(found, drawn, start, title)
    lines = describe_found(found, start)
    add_to_json(
        axis=path, picture=picture, length=found.length, width=found.width, height=found.height, sections=len(found.whole),
        whole_sections=int(found.whole.sum()), doubtful=found.doubtful, says=lines,
    )  # fmt: skip
    for line in [*lines, f"axis: {path}, picture to check: {picture}"]:
        notify(line)


@tunnel.command(examples=["tunneldb tunnel stationing ringo equations.csv", "tunneldb tunnel stationing ringo --show"])
@click.argument("name")
@click.argument("file", type=FilePath(), required=False)
@click.option("--show", is_flag=True, help="Print the pieces of the stationing.")
@click.option("--clear", is_flag=True, help="Remove the stationing: stations are chainages again.")
@click.pass_obj
def stationing(settings: Settings, name: str, file: Path | None, show: bool, clear: bool) -> None:
    """Set the stationing of the tunnel NAME from FILE, show it, or remove it.

    FILE is a CSV with a row for each piece of the stationing: chainage,station and, if a piece runs backwards,
    direction. From that chainage (distance along the axis, m) the station is station + direction × (chainage - that
    of the row), up to the next row. The first row also applies before its chainage. All data stay stored in chainage;
    labels (12+345.678) in views, lists and pictures are stations.
    """
    from tunneldb.store.alignment import read_equations, save_equations
    from tunneldb.store.tunnel import get_tunnel

    if [file is not None, show, clear].count(True) != 1:
        raise UserError("give either a FILE, or --show, or --clear")
    with connect(settings.dsn) as connection:
        tunnel_id = get_tunnel(connection, name)
        if not show:
            save_equations(connection, tunnel_id, read_equations(file) if file else [])
        rows = list_station_pieces(connection, tunnel_id)
    names = ("chainage_from", "chainage_to", "label_from", "label_to", "direction")
    add_to_json(tunnel=name, pieces=records(names, rows))
    print_table(["chainage from", "to", "station from", "to", "runs"], rows, right=(0, 1, 2, 3))


@tunnel.command("list", examples=["tunneldb tunnel list"])
@click.pass_obj
def list_(settings: Settings) -> None:
    """List the tunnels."""
    from tunneldb.geometry.local import LOCAL

    with connect(settings.dsn) as connection:
        rows = list_tunnels(connection)
    add_to_json(tunnels=records(("name", "srid", "label_from", "length", "spacing", "surveys"), rows))
    shown = [(name, "local" if srid == LOCAL else srid, *others) for name, srid, *others in rows]
    print_table(["tunnel", "SRID", "starts at", "length m", "spacing m", "surveys"], shown, right=(1, 2, 3, 4, 5))


@tunnel.command(examples=["tunneldb tunnel remove ringo"])
@click.argument("name")
@click.pass_obj
def remove(settings: Settings, name: str) -> None:
    """Remove the tunnel NAME, which must have no surveys."""
    from tunneldb.store.catalog import remove_tunnel

    with connect(settings.dsn) as connection:
        tell_warnings(connection)
        remove_tunnel(connection, name)
    add_to_json(tunnel=name)
