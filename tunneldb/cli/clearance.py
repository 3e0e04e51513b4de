"""The command ``clearance``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.measure import (
    every_option,
    number,
    output_option,
    require_ending,
    say_written,
    surveys_in,
    with_progress,
    write_text,
)
from tunneldb.cli.output import add_to_json, command
from tunneldb.cli.param_types import FINITE, FilePath, FiniteRange, WholeRange
from tunneldb.cli.stretch import stretch_options
from tunneldb.cli.tables import print_table
from tunneldb.counted import counted
from tunneldb.errors import UserError
from tunneldb.files import replacing
from tunneldb.numerals import percent_number

if TYPE_CHECKING:
    from tunneldb.measures.clearance.compute.gauge import Widening
    from tunneldb.measures.clearance.tables import Row

_LENGTH = FiniteRange(0.0)


@command(
    examples=[
        "tunneldb clearance ringo-2024 --gauge freight.csv --track left",
        "tunneldb clearance ringo-2024 --gauge freight.csv --track right --bogie-distance 14 --overhang 4 -o margins.csv",
        "tunneldb clearance demo-2024 --gauge lane.dxf --track-axis lane.csv -o sections.dxf --every 5",
    ]
)
@click.argument("survey")
@click.option(
    "--gauge", "outline", required=True, type=FilePath(dir_okay=False),
    help="Clearance outline, .csv or .dxf as of profile add: about the track's middle on its running "
        "surface, m.",
)  # fmt: skip
@click.option("--name", help="Name of the outline; default: that of its file.")
@click.option("--track", help="left or right, or the number from the left of more than two; needed if there are several.")
@click.option(
    "--track-axis", type=FilePath(dir_okay=False),
    help="Axis of the track or lane, instead of rails: chainage,right,up[,cant] about the given axis, or "
        "x,y,z[,cant]; m.",
)  # fmt: skip
@click.option(
    "--track-gauge",
    type=_LENGTH,
    default=1.435,
    show_default=True,
    metavar="M",
    help="Distance between the rails' inner faces.",
)
@click.option("--bogie-distance", type=_LENGTH, default=0.0, metavar="M", help="Distance between the middles of the bogies.")
@click.option(
    "--overhang", type=_LENGTH, default=0.0, metavar="M", help="Distance from a bogie's middle to the end of the vehicle."
)
@click.option(
    "--curve-widening", nargs=2, type=_LENGTH, default=(0.0, 0.0), metavar="INSIDE OUTSIDE",
    help="Widening inside and outside over the radius, m², instead of a vehicle.",
)  # fmt: skip
@click.option(
    "--radius", type=FINITE, metavar="M", help="Radius of the curve, positive to the right, instead of the track's own."
)
@click.option(
    "--cant", type=FINITE, metavar="M", help="Height of the left rail above the right, for roll, instead of the track's own."
)
@click.option("--speed", type=_LENGTH, default=0.0, metavar="KM/H", help="Speed, for roll by cant deficiency or excess.")
@click.option("--flexibility", type=_LENGTH, default=0.0, help="Roll of the vehicle over the angle of missing cant.")
@click.option("--roll-height", type=FINITE, default=0.5, show_default=True, metavar="M", help="Height of the roll centre.")
@click.option("--allowance", type=_LENGTH, default=0.0, metavar="M", help="Allowance for all else, to each side.")
@click.option(
    "--group-points",
    type=WholeRange(1, 10**9),
    default=3,
    show_default=True,
    help="Least number of points of an obstacle, …",
)
@click.option("--group-radius", type=_LENGTH, default=0.3, show_default=True, metavar="M", help="… within this radius.")
@stretch_options
@every_option(10.0, "Distance of the sections of a .dxf.")
@output_option("File to write: .csv of all metres and directions, .dxf of sections with outline and points, .gpkg.")
@click.pass_obj
def clearance(settings: Settings, /, survey: str, outline: Path, name: str | None, output: Path | None, **asked: Any) -> None:
    """Check the clearance around a track of SURVEY: margins and infringements.

    The track is found from its rails, or given. Points of survey density of any class count except ground, rails and
    noise; objects and spheres, which can be temporary, are stated and do not count. Directions that were not
    inspected are stated and never count as clear. No outline or value of a standard is included;
    docs/howto-clearance.md describes the widening.
    """
    from tunneldb.measures.clearance.compute.gauge import closed
    from tunneldb.measures.clearance.measure import Options, find_tracks, measure_clearance, read_track
    from tunneldb.measures.clearance.rows import save_gauge
    from tunneldb.measures.clearance.tables import infringement_rows, section_rows, sections_csv, summary
    from tunneldb.pipeline.profile_file import read_profile
    from tunneldb.store.surface import load_alignment

    require_ending(output, "clearance", (".csv", ".dxf", ".gpkg"))
    options = Options(
        asked["track_gauge"], _widening(asked), asked["radius"] or None, asked["cant"], asked["group_points"],
        asked["group_radius"],
    )  # fmt: skip
    read = closed(read_profile(outline).outline)
    gauge = name or outline.stem
    with surveys_in(settings, [survey], asked["start"], asked["end"]) as (conn, [found], part):
        if asked["track_axis"] is not None:
            tracks = read_track(asked["track_axis"], load_alignment(conn, found, 1.0))
        else:
            tracks = find_tracks(conn, found, options.track_gauge)
        track = _chosen(survey, tracks.names, asked["track"])
        save_gauge(conn, found, gauge, read, str(outline))
        made = with_progress(
            lambda begin: measure_clearance(conn, found, tracks, track, gauge, read, options, part.low, part.high, begin)
        )
        kilometres = summary(conn, found, gauge, track, part.low, part.high)
        if not kilometres:
            raise UserError(f"survey {survey}: track {track} was not seen there; nothing was measured, and nothing is clear")
        inside = infringement_rows(conn, found, gauge, track, part.low, part.high)
        rows = section_rows(conn, found, gauge, track, part.low, part.high)
        add_to_json(survey=survey, gauge=gauge, track=track, made=made, kilometres=kilometres, infringements=inside)
        if output is None:
            add_to_json(sections=[row | {"margins": [None if m != m else m for m in row["margins"]]} for row in rows])
        elif output.suffix.lower() == ".csv":
            write_text(output, sections_csv(rows))
        elif output.suffix.lower() == ".gpkg":
            from tunneldb.export.exchange import clearance_gpkg

            with replacing(output) as temporary:
                clearance_gpkg.write_clearance(conn, found, gauge, track, part.low, part.high, temporary)
        else:
            from tunneldb.export.exchange.clearance_dxf import write_clearance

            with replacing(output) as temporary:
                write_clearance(conn, found, gauge, track, part.low, part.high, asked["every"], temporary)
    _print(kilometres, rows, inside, track, gauge)
    say_written([output] if output else [])


def _widening(asked: dict[str, Any]) -> Widening:
    from tunneldb.measures.clearance.compute.gauge import Widening

    inside, outside = asked["curve_widening"]
    vehicle = asked["bogie_distance"] > 0.0 or asked["overhang"] > 0.0
    if vehicle and max(inside, outside) > 0.0:
        raise UserError("--curve-widening stands for --bogie-distance and --overhang: leave one out")
    if asked["flexibility"] > 0.0 and asked["speed"] == 0.0:
        raise UserError("--flexibility needs the speed: add --speed KM/H")
    return Widening(
        asked["bogie_distance"], asked["overhang"], inside, outside, asked["speed"] / 3.6, asked["flexibility"],
        asked["roll_height"], asked["allowance"],
    )  # fmt: skip


def _chosen(survey: str, names: list[str], wanted: str | None) -> str:
    if wanted is None and len(names) == 1:
        return names[0]
    if wanted not in names:
        says = "choose one by --track" if wanted is None else f"it has no track {wanted}"
        raise UserError(f"survey {survey} has the tracks {', '.join(names)}: {says}")
    return wanted


def _print(kilometres: list[Row], rows: list[Row], inside: list[Row], track: str, gauge: str) -> None:
    print_table(
        [
            "km", "metres", "track seen %", "axis ± mm", "cant ± mm", "least margin m", "metres inside", "seen %", "stray",
            "passing", "ground",
        ],
        [
            (row["km"], f"{row['metres']} of {row['run']['metres']}", percent_number(row["run"]["track_seen"]),
             f"{1e3 * row['run'].get('axis_se', 0.0):.1f}", f"{1e3 * row['run'].get('cant_se', 0.0):.1f}",
             number(row["margin"], 3), row["metres_inside"], percent_number(row["seen_share"]),
             row["stray"], row["passing"], row["ground"])
            for row in kilometres
        ],
        right=range(1, 11),
    )  # fmt: skip
    tightest = sorted((row for row in rows if row["margin"] is not None), key=lambda row: float(row["margin"]))[:10]
    print_table(
        ["tightest at", "margin m", "±", "clock °", "by", "cluster", "radius m", "wider left mm", "right mm", "roll mrad"],
        [
            (row["label"], number(row["margin"], 3), number(row["margin_se"], 3), f"{row['clock']:.0f}", row["class"],
             row["cluster_id"], number(row["radius"], 0), f"{1e3 * row['widened_left']:.1f}",
             f"{1e3 * row['widened_right']:.1f}", f"{1e3 * row['roll']:.1f}")
            for row in tightest
        ],
        right=(1, 2, 3, 5, 6, 7, 8, 9),
    )  # fmt: skip
    count = sum(row["counts"] for row in inside)
    click.echo(
        f"{gauge} about track {track}: {counted(count, 'infringement')}, and {len(inside) - count} by objects, which may be"
        " gone; stray, passing, ground: points inside that do not count; what was not seen is not clear"
    )
