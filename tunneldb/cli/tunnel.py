"""`tunneldb tunnel`."""

from __future__ import annotations

from pathlib import Path

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.output import VerbGroup, records, tell
from tunneldb.cli.tables import print_table
from tunneldb.database import connect
from tunneldb.errors import UserError


@click.group(cls=VerbGroup)
def tunnel() -> None:
    """Add, list or remove tunnels, and give them a stationing."""


@tunnel.command(
    examples=[
        "tunneldb tunnel add ringo --srid 3794 --axis ringo.axis.csv --start-chainage 511746.75",
        "tunneldb tunnel add ringo --srid 3794 --axis ringo.xml --alignment Mainline",
    ]
)
@click.argument("name")
@click.option("--srid", type=int, required=True, help="Spatial reference of all coordinates; projected, metres.")
@click.option(
    "--axis",
    type=click.Path(path_type=Path),
    required=True,
    help="Design alignment (LandXML, IFC 4.3), or CSV with the header x,y,z: points of the axis in growing chainage.",
)
@click.option("--alignment", metavar="NAME", help="Which alignment of a LandXML or IFC file, if it holds several.")
@click.option("--profile", metavar="NAME", help="Which profile of the alignment, if it has several.")
@click.option(
    "--start-chainage",
    type=float,
    metavar="M",
    help="Chainage of the axis's beginning. [default: that of the alignment; 0 of a CSV]",
)
@click.option(
    "--spacing", type=float, default=10.0, show_default=True, metavar="M", help="Distance between the axis's vertices."
)
@click.option(
    "--stationing",
    "equations",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="The tunnel's own stationing, see tunneldb tunnel stationing. [default: that of the alignment]",
)
@click.pass_obj
def add(
    settings: Settings,
    name: str,
    srid: int,
    axis: Path,
    alignment: str | None,
    profile: str | None,
    start_chainage: float | None,
    spacing: float,
    equations: Path | None,
) -> None:
    """Add the tunnel NAME with its given axis.

    Of a design alignment the elements (lines, arcs, clothoids; grades, parabolas, circles) and the stationing are kept, and
    the axis follows them to a millimetre. Lengths in feet are turned into metres when the file says that they are feet.
    """
    from tunneldb.alignment.given import read_given
    from tunneldb.store.alignment import read_equations, save_equations
    from tunneldb.store.catalog import add_tunnel, get_tunnel

    given = read_given(axis, start_chainage, alignment, profile)
    own = read_equations(equations) if equations else None
    with connect(settings.dsn) as connection:
        line = add_tunnel(connection, name, srid, given, spacing)
        if own is not None:
            save_equations(connection, get_tunnel(connection, name), own)
    tell(tunnel=name, srid=srid, chainage_from=line.start, chainage_to=line.end, source=given.source)
    click.echo(f"{name}: {line.end - line.start:.3f} m of axis, chainage {line.start:.3f} to {line.end:.3f} m", err=True)
    if given.design is not None:
        plan, profiles = len(given.design.plan), len(given.design.profile)
        tell(plan_elements=plan, profile_elements=profiles, notes=given.design.notes)
        click.echo(f"{given.source}: {plan} elements in plan, {profiles} in profile", err=True)
        for note in given.design.notes:
            click.echo(f"{axis}: {note}", err=True)


@tunnel.command(examples=["tunneldb tunnel stationing ringo equations.csv", "tunneldb tunnel stationing ringo --show"])
@click.argument("name")
@click.argument("file", type=click.Path(path_type=Path), required=False)
@click.option("--show", is_flag=True, help="Print the pieces of the stationing.")
@click.option("--clear", is_flag=True, help="Take the tunnel's own stationing away: stations are chainages again.")
@click.pass_obj
def stationing(settings: Settings, name: str, file: Path | None, show: bool, clear: bool) -> None:
    """Give the tunnel NAME its own stationing from FILE, show it, or take it away.

    FILE is a CSV with a row for each piece of the stationing: chainage,station and, if a piece runs backwards, direction.
    From that chainage (distance along the axis, m) the station is station + direction × (chainage - that of the row), up to
    the next row; before the first row it is reckoned back from that. Nothing else is changed: all is stored in chainage,
    and the labels of views, lists and pictures (12+345.678) are stations from then on.
    """
    from tunneldb.store.alignment import read_equations, save_equations
    from tunneldb.store.catalog import get_tunnel

    if [file is not None, show, clear].count(True) != 1:
        raise UserError("give either a FILE, or --show, or --clear")
    with connect(settings.dsn) as connection:
        tunnel_id = get_tunnel(connection, name)
        if not show:
            save_equations(connection, tunnel_id, read_equations(file) if file else [])
        rows = connection.execute(
            """
            SELECT to_char(p.chainage_from, 'FM999999990.000'), to_char(p.chainage_to, 'FM999999990.000'), p.label_from,
                   p.label_to, CASE p.direction WHEN 1 THEN 'up' ELSE 'back' END
              FROM tunnel_api.station_pieces(%s) p
            """,
            [tunnel_id],
        ).fetchall()
    names = ("chainage_from", "chainage_to", "label_from", "label_to", "direction")
    tell(tunnel=name, pieces=records(names, rows))
    print_table(["chainage from", "to", "station from", "to", "runs"], rows, right=(0, 1, 2, 3))


@tunnel.command("list", examples=["tunneldb tunnel list"])
@click.pass_obj
def list_(settings: Settings) -> None:
    """List the tunnels."""
    with connect(settings.dsn) as connection:
        rows = connection.execute(
            """
            SELECT t.name, t.srid, tunnel_api.station_label(t.id, t.start_chainage), round(ST_Length(t.geom)::numeric, 1),
                   t.spacing, count(s.id)
              FROM tunnel_api.tunnel t LEFT JOIN tunnel_api.survey s ON s.tunnel_id = t.id
             GROUP BY t.id, t.name, t.srid, t.start_chainage, t.geom, t.spacing ORDER BY t.name
            """
        ).fetchall()
    tell(tunnels=records(("name", "srid", "label_from", "length", "spacing", "surveys"), rows))
    print_table(["tunnel", "SRID", "starts at", "length m", "spacing m", "surveys"], rows, right=(1, 2, 3, 4, 5))


@tunnel.command(examples=["tunneldb tunnel remove ringo"])
@click.argument("name")
@click.pass_obj
def remove(settings: Settings, name: str) -> None:
    """Remove the tunnel NAME, which must have no surveys any more."""
    from tunneldb.store.catalog import remove_tunnel

    with connect(settings.dsn) as connection:
        remove_tunnel(connection, name)
    tell(tunnel=name)
