"""The command ``elements``: elements of a tunnel that are rated."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.output import CommandGroup, add_to_json, notify
from tunneldb.cli.param_types import FilePath, FiniteRange
from tunneldb.cli.tables import print_table
from tunneldb.counted import counted
from tunneldb.database import connect
from tunneldb.errors import UserError

WHOLE = 0.999
"""Share of the lining of an element from which it counts as searched in whole: areas of curved sections differ by less."""


@click.group(cls=CommandGroup)
def elements() -> None:
    """Add, list or remove the elements of a tunnel: rings, blocks, stretches or zones; show cracks by element."""


@elements.command(
    examples=[
        "tunneldb elements add ringo stretches --length 10",
        "tunneldb elements add ringo rings --rings ringo-2024 --zones",
        "tunneldb elements add ringo blocks --joints ringo-2024",
        "tunneldb elements add ringo portals --file portals.csv",
    ]
)
@click.argument("tunnel")
@click.argument("name")
@click.option("--length", type=FiniteRange(0.1, 1e6), metavar="M", help="Stretches of this length, from multiples of it.")
@click.option("--rings", "survey", metavar="SURVEY", help="Rings of a survey (tunneldb rings).")
@click.option("--joints", metavar="SURVEY", help="Blocks between the transverse joints that a survey detected.")
@click.option("--file", type=FilePath(dir_okay=False), metavar="FILE", help="CSV of elements.")
@click.option("--zones", is_flag=True, help="Divide each into crown, right wall, invert and left wall by clock position.")
@click.pass_obj
def add(
    settings: Settings,
    tunnel: str,
    name: str,
    length: float | None,
    survey: str | None,
    joints: str | None,
    file: Path | None,
    zones: bool,
) -> None:
    """Add elements to TUNNEL as a division called NAME.

    FILE has name,chainage_from,chainage_to (m) and optionally clock_from,clock_to (hours, clockwise looking
    up-chainage). Zones: crown 10 to 2 o'clock, right 2 to 5, invert 5 to 7, left 7 to 10.
    """
    from tunneldb.pipeline.rating_file import read_elements, stretches_of
    from tunneldb.store.design import get_design_tunnel
    from tunneldb.store.rating import joint_elements, ring_elements, save_elements, zoned
    from tunneldb.store.survey import get_survey
    from tunneldb.store.tunnel import get_tunnel

    if sum(given is not None for given in (length, survey, joints, file)) != 1:
        raise UserError("give exactly one of --length M, --rings SURVEY, --joints SURVEY and --file FILE")
    found = read_elements(file) if file is not None else []
    if zones and any(one.clock for one in found):
        raise UserError(f"{file} has clock positions: leave out --zones")
    with connect(settings.dsn) as conn:
        place = get_design_tunnel(conn, get_tunnel(conn, tunnel), tunnel)
        if length is not None:
            found = stretches_of(length, place.start, place.end)
        elif (of := survey or joints) is not None:
            there = get_survey(conn, of)
            if there.tunnel_id != place.tunnel_id:
                raise UserError(f"survey {of} is of tunnel {there.tunnel}, not of {tunnel}")
            found = (ring_elements if survey else joint_elements)(conn, there.id, of)
        found = zoned(found) if zones else found
        source = "file" if file is not None else "length" if length is not None else "rings" if survey else "joints"
        save_elements(conn, place.tunnel_id, tunnel, name, source, found)
    add_to_json(tunnel=tunnel, name=name, source=source, elements=len(found))
    notify(f"{name}: {counted(len(found), 'element')} of {tunnel}")


@elements.command("list", examples=["tunneldb elements list ringo"])
@click.argument("tunnel")
@click.pass_obj
def list_(settings: Settings, tunnel: str) -> None:
    """List the divisions of TUNNEL into elements."""
    from tunneldb.store.rating import list_elements
    from tunneldb.store.tunnel import get_tunnel

    with connect(settings.dsn) as conn:
        rows = list_elements(conn, get_tunnel(conn, tunnel))
    add_to_json(tunnel=tunnel, element_sets=rows)
    print_table(
        ["name", "source", "elements", "from", "to"],
        [
            (row["element_set"], row["source"], row["elements"], f"{row['chainage_from']:.3f}", f"{row['chainage_to']:.3f}")
            for row in rows
        ],
        right=(2, 3, 4),
    )


@elements.command(examples=["tunneldb elements cracks ringo-2024 blocks"])
@click.argument("survey")
@click.argument("name")
@click.pass_obj
def cracks(settings: Settings, survey: str, name: str) -> None:
    """Show the density of cracks of SURVEY in each element of the division NAME.

    The density is the length of the counted cracks by the area of the lining, m/m²; a lower bound (≥) if less than the
    whole lining of the element was searched for cracks; none if nothing was (tunneldb findings searched). Lengths are
    also stated for longitudinal (less than 30° to the axis), oblique and transverse cracks (more than 60°).
    """
    from tunneldb.store.crack_density import read_crack_density
    from tunneldb.store.survey import get_survey

    with connect(settings.dsn) as conn:
        rows = read_crack_density(conn, get_survey(conn, survey), name)
    add_to_json(survey=survey, name=name, elements=rows)
    header = [
        "element",
        "from",
        "to",
        "lining m²",
        "searched %",
        "cracks",
        "length m",
        "m/m²",
        "longitudinal m",
        "oblique m",
        "transverse m",
        "widest mm",
    ]
    cells = [
        [
            row["name"], row["label_from"], row["label_to"], f"{row['lining_area']:.1f}",
            math.floor(100 * (row["searched_share"] + 1 - WHOLE)), row["cracks"], f"{row['crack_length']:.2f}", _density(row),
            f"{row['longitudinal_length']:.2f}", f"{row['oblique_length']:.2f}", f"{row['transverse_length']:.2f}",
            None if row["width_mm"] is None else f"{row['width_mm']:.2f}",
        ]
        for row in rows
    ]  # fmt: skip
    print_table(header, cells, right=range(1, 12))
    if unknown := sum(row["density"] is None and row["lining_area"] > 0 for row in rows):
        notify(f"Note: {counted(unknown, 'element')} not known to be searched for cracks: tunneldb findings searched {survey}")


def _density(row: dict[str, Any]) -> str | None:
    """Return a density in words: a lower bound if not the whole element was searched."""
    if row["density"] is None:
        return None
    return f"{'' if row['searched_share'] >= WHOLE else '≥ '}{row['density']:.3f}"


@elements.command(examples=["tunneldb elements remove ringo blocks"])
@click.argument("tunnel")
@click.argument("name")
@click.pass_obj
def remove(settings: Settings, tunnel: str, name: str) -> None:
    """Remove the division NAME of TUNNEL."""
    from tunneldb.store.rating import remove_elements
    from tunneldb.store.tunnel import get_tunnel

    with connect(settings.dsn) as conn:
        remove_elements(conn, get_tunnel(conn, tunnel), tunnel, name)
    add_to_json(tunnel=tunnel, name=name)
