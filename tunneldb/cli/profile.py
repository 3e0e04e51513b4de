"""The command ``profile``: design profiles of a tunnel."""

from __future__ import annotations

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.measure import LAYERS, layer_option
from tunneldb.cli.output import CommandGroup, add_to_json, notify, records
from tunneldb.cli.param_types import file_path
from tunneldb.cli.stretch import parse_stretch, stretch_options
from tunneldb.cli.tables import print_table
from tunneldb.database import connect
from tunneldb.errors import UserError
from tunneldb.numerals import parse_number


@click.group(cls=CommandGroup)
def profile() -> None:
    """Add, list or remove the design profiles of a tunnel: lines and arcs around its axis, by chainage and layer."""


@profile.command(
    examples=[
        "tunneldb profile add ringo regular.csv",
        "tunneldb profile add ringo wide wide.csv --from 1+250 --to 1+310",
        "tunneldb profile add ringo regular.dxf --unit mm --origin 0,1500 --layer excavation",
    ]
)
@click.argument("words", nargs=-1, required=True, metavar="TUNNEL [NAME] FILE")
@stretch_options
@layer_option
@click.option("--unit", type=click.Choice(["m", "cm", "mm", "ft", "in"]), help="Unit of a .dxf without a unit, or of a .txt.")
@click.option("--origin", default="0,0", metavar="RIGHT,UP", help="Position of the axis in FILE, in its unit.")
@click.option("--drawing-layer", metavar="NAME", help="Layer of a .dxf, if several have lines.")
@click.pass_obj
def add(
    settings: Settings,
    words: tuple[str, ...],
    start: str | None,
    end: str | None,
    layer: str,
    unit: str | None,
    origin: str,
    drawing_layer: str | None,
) -> None:
    """Add a design profile to TUNNEL for a range, by default the whole axis.

    FILE is a .csv with right,up and optionally radius, m: a row for each vertex, seen from the axis looking
    up-chainage; radius is of the arc to the next vertex, positive if it bulges outwards, 0 for a line; if the last
    row repeats the first, the outline is closed. Or a .dxf of lines, arcs and polylines; or a .txt with two columns,
    points of an outline. Between two profiles of a layer the outline changes linearly.
    """
    from tunneldb.pipeline.profile_file import read_profile
    from tunneldb.shape.profile import Profile
    from tunneldb.store.design import get_design_tunnel, save_profile
    from tunneldb.store.tunnel import get_tunnel

    if len(words) not in (2, 3):
        raise UserError("profile add takes TUNNEL, perhaps a NAME, and a FILE")
    tunnel, file = words[0], file_path(words[-1])
    name = words[1] if len(words) == 3 else file.stem
    read = read_profile(file, _origin(origin), unit, drawing_layer)
    with connect(settings.dsn) as conn:
        place = get_design_tunnel(conn, get_tunnel(conn, tunnel), tunnel)
        stretch = parse_stretch(conn, place, start, end)
        low, high = max(stretch.low, place.start), min(stretch.high, place.end)
        if low >= high:
            raise UserError(f"tunnel {tunnel} has nothing there: it lies between {place.start:.3f} and {place.end:.3f} m")
        save_profile(conn, place, Profile(name, low, high, read.outline), layer, file.name)
    outline = read.outline
    add_to_json(
        tunnel=tunnel, name=name, layer=layer, chainage_from=low, chainage_to=high, closed=outline.closed,
        elements=len(outline.elements), length=outline.length, area=outline.area, notes=read.notes,
    )  # fmt: skip
    notify(
        f"{name}: {len(outline.elements)} elements, {outline.length:.3f} m long, "
        f"{'closed' if outline.closed else 'open below'}, {outline.area:.3f} m²; {layer}, {low:.3f} to {high:.3f} m"
    )
    for note in read.notes:
        notify(f"{file}: {note}")


@profile.command("list", examples=["tunneldb profile list ringo"])
@click.argument("tunnel")
@click.pass_obj
def list_(settings: Settings, tunnel: str) -> None:
    """List the design profiles of TUNNEL and the transitions between them."""
    from tunneldb.shape.profile import stretches
    from tunneldb.store.design import load_profiles
    from tunneldb.store.tunnel import get_tunnel

    rows = []
    with connect(settings.dsn) as conn:
        tunnel_id = get_tunnel(conn, tunnel)
        for layer in LAYERS.choices:
            profiles = load_profiles(conn, tunnel_id, layer)
            names = {profile.name for profile in profiles}
            for part in stretches(profiles):
                kind = "profile" if part.name in names and part.first is part.second else "transition"
                sizes = sorted((part.first.area, part.second.area))
                rows.append((layer, part.name, kind, part.low, part.high, *sizes, part.first.closed))
    columns = ("layer", "name", "kind", "chainage_from", "chainage_to", "area_least", "area_most", "closed")
    add_to_json(tunnel=tunnel, profiles=records(columns, rows))
    print_table(
        ["layer", "profile", "", "from", "to", "area m²"],
        [
            (layer, name, kind, f"{low:.3f}", f"{high:.3f}", f"{least:.3f}" if least == most else f"{least:.3f} – {most:.3f}")
            for layer, name, kind, low, high, least, most, _ in rows
        ],
        right=(3, 4, 5),
    )


@profile.command(examples=["tunneldb profile remove ringo wide --layer excavation"])
@click.argument("tunnel")
@click.argument("name")
@layer_option
@click.pass_obj
def remove(settings: Settings, tunnel: str, name: str, layer: str) -> None:
    """Remove the design profile NAME of TUNNEL; deviations from it become stale."""
    from tunneldb.store.design import remove_profile
    from tunneldb.store.tunnel import get_tunnel

    with connect(settings.dsn) as conn:
        remove_profile(conn, get_tunnel(conn, tunnel), tunnel, name, layer)
    add_to_json(tunnel=tunnel, name=name, layer=layer)


def _origin(text: str) -> tuple[float, float]:
    try:
        right, up = (parse_number(part) for part in text.split(","))
    except ValueError:
        raise UserError(f"--origin takes two numbers, as 0,1.5, not {text!r}") from None
    return right, up
