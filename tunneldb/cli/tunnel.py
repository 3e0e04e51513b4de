"""`tunneldb tunnel`."""

from __future__ import annotations

from pathlib import Path

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.tables import print_table
from tunneldb.database import connect


@click.group()
def tunnel() -> None:
    """Add, list or remove tunnels."""


@tunnel.command()
@click.argument("name")
@click.option("--srid", type=int, required=True, help="Spatial reference of all coordinates; projected, metres.")
@click.option(
    "--axis",
    type=click.Path(path_type=Path),
    required=True,
    help="CSV with the header x,y,z: points of the axis in growing chainage.",
)
@click.option(
    "--start-chainage", type=float, default=0.0, show_default=True, metavar="M", help="Chainage of the axis's first point."
)
@click.option(
    "--spacing", type=float, default=10.0, show_default=True, metavar="M", help="Distance between the axis's vertices."
)
@click.pass_obj
def add(settings: Settings, name: str, srid: int, axis: Path, start_chainage: float, spacing: float) -> None:
    """Add the tunnel NAME with its given axis."""
    from tunneldb.database.catalog import add_tunnel

    with connect(settings.dsn) as connection:
        alignment = add_tunnel(connection, name, srid, axis, start_chainage, spacing)
    length = alignment.end - alignment.start
    click.echo(f"{name}: {length:.3f} m of axis, chainage {alignment.start:.3f} to {alignment.end:.3f} m", err=True)


@tunnel.command("list")
@click.pass_obj
def list_(settings: Settings) -> None:
    """List the tunnels."""
    with connect(settings.dsn) as connection:
        rows = connection.execute(
            """
            SELECT t.name, t.srid, tunnel_api.chainage_label(t.start_chainage), round(ST_Length(t.geom)::numeric, 1),
                   t.spacing, count(s.id)
              FROM tunnel_api.tunnel t LEFT JOIN tunnel_api.survey s ON s.tunnel_id = t.id
             GROUP BY t.id, t.name, t.srid, t.start_chainage, t.geom, t.spacing ORDER BY t.name
            """
        ).fetchall()
    print_table(["tunnel", "SRID", "starts at", "length m", "spacing m", "surveys"], rows, right=(1, 2, 3, 4, 5))


@tunnel.command()
@click.argument("name")
@click.pass_obj
def remove(settings: Settings, name: str) -> None:
    """Remove the tunnel NAME, which must have no surveys any more."""
    from tunneldb.database.catalog import remove_tunnel

    with connect(settings.dsn) as connection:
        remove_tunnel(connection, name)
