"""The command ``alarms``: limits of series of a tunnel, and whether its latest survey reaches them."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.measure import output_option, require_ending, say_written, write_rows
from tunneldb.cli.output import CommandGroup, add_to_json, notify
from tunneldb.cli.param_types import FiniteRange
from tunneldb.cli.stretch import parse_stretch, stretch_options
from tunneldb.cli.tables import print_table
from tunneldb.counted import counted
from tunneldb.database import connect
from tunneldb.errors import UserError

QUANTITIES = ("ovality", "convergence", "wet_area", "growth")
OF_STRETCHES = ("wet_area", "growth")
"""Quantities of stretches of the length --step."""

STEP = 100.0
"""Default length of a stretch, m."""

CLOCK = (9.0, 3.0)
"""Default clock positions of the chord of convergence, hours."""

IMPLAUSIBLE = {
    "ovality": (0.5, "a share of the design diameter: 1 % is 0.01"),
    "convergence": (1.0, "in m: 10 mm is 0.01"),
}
"""Limits from which a value was probably given in another unit, and the unit."""

WARNED, ALARMED, UNKNOWN = 3, 4, 5
"""Exit codes of ``alarms check``."""

CODES = {
    "0": "all limits are judged, and all values are below the warning",
    "3": "a value reaches a warning, none an alarm",
    "4": "a value reaches an alarm",
    "5": "no value reaches a warning, but something could not be judged",
}

COLUMNS = (
    "name", "quantity", "unit", "chainage_from", "chainage_to", "label", "survey", "date", "value", "inspected_share",
    "warning", "alarm", "level", "previous_survey", "previous_date", "previous_value", "rate", "why",
)  # fmt: skip
"""Columns of the alarms as CSV."""


@click.group(cls=CommandGroup)
def alarms() -> None:
    """Add, list or remove limits of a tunnel's ovality, convergence and wet area, and check them."""


@alarms.command(
    examples=[
        "tunneldb alarms add ringo oval --quantity ovality --warning 0.006 --alarm 0.01 --min-inspected 0.7",
        "tunneldb alarms add ringo walls --quantity convergence --warning 0.01 --alarm 0.02 --clock 9 3",
        "tunneldb alarms add ringo wet --quantity wet_area --step 50 --warning 1 --alarm 5 --from 12+300 --to 12+800",
        "tunneldb alarms add ringo growth --quantity growth --step 50 --warning 0.5 --alarm 2",
    ]
)
@click.argument("tunnel")
@click.argument("name")
@click.option(
    "--quantity", type=click.Choice(QUANTITIES), required=True,
    help="ovality of each ring (share of the design diameter), convergence of each compared section (m), wet_area of each"
    " stretch (m²), growth of the wet area of each stretch (m² per year).",
)  # fmt: skip
@click.option("--warning", type=FiniteRange(0.0, 1e8, min_open=True), required=True, help="Value from which it is a warning.")
@click.option("--alarm", type=FiniteRange(0.0, 1e8, min_open=True), required=True, help="Value from which it is an alarm.")
@stretch_options
@click.option(
    "--step", type=FiniteRange(1.0, 1e6), metavar="M",
    help="Length of the stretches of wet_area and growth, from multiples of it. [default: 100]",
)  # fmt: skip
@click.option(
    "--clock", type=FiniteRange(0.0, 12.0), nargs=2, metavar="HOURS HOURS",
    help="Opposite clock positions between which convergence is measured. [default: 9 3]",
)  # fmt: skip
@click.option(
    "--reference", metavar="SURVEY",
    help="Survey since which convergence counts. [default: the earliest that another one was compared with]",
)  # fmt: skip
@click.option(
    "--min-inspected", type=FiniteRange(0.0, 1.0), default=0.95, show_default=True, metavar="SHARE",
    help="Inspected share below which a value below the limits is unknown.",
)  # fmt: skip
@click.pass_obj
def add(
    settings: Settings,
    tunnel: str,
    name: str,
    quantity: str,
    warning: float,
    alarm: float,
    start: str | None,
    end: str | None,
    step: float | None,
    clock: tuple[float, float] | None,
    reference: str | None,
    min_inspected: float,
) -> None:
    """Add a limit called NAME to TUNNEL.

    A value that reaches --warning or --alarm has that level; of convergence its absolute value counts. The limits are
    in the unit of the quantity: 1 % of ovality is 0.01, 10 mm of convergence are 0.01.
    """
    from tunneldb.store.alarm import AlarmLimit, save_limit
    from tunneldb.store.design import get_design_tunnel
    from tunneldb.store.survey import get_survey
    from tunneldb.store.tunnel import get_tunnel

    if alarm < warning:
        raise UserError(f"--alarm {alarm:g} is below --warning {warning:g}: an alarm is at least a warning")
    if quantity in IMPLAUSIBLE and alarm >= IMPLAUSIBLE[quantity][0]:
        raise UserError(f"--alarm {alarm:g} is too high: {quantity} is {IMPLAUSIBLE[quantity][1]}")
    if step is not None and quantity not in OF_STRETCHES:
        raise UserError(f"--step is for {' and '.join(OF_STRETCHES)}: {quantity} has its own places; leave it out")
    if (clock is not None or reference is not None) and quantity != "convergence":
        raise UserError(f"{'--reference' if clock is None else '--clock'} is for convergence: leave it out")
    if quantity == "convergence":
        clock = clock or CLOCK
        if abs(abs(clock[0] - clock[1]) - 6.0) > 0.05:
            raise UserError(f"--clock {clock[0]:g} {clock[1]:g}: the positions must be opposite each other, as 9 3 or 10 4")
    with connect(settings.dsn) as conn:
        place = get_design_tunnel(conn, get_tunnel(conn, tunnel), tunnel)
        part = parse_stretch(conn, place, start, end)
        if reference is not None and (there := get_survey(conn, reference)).tunnel_id != place.tunnel_id:
            raise UserError(f"survey {reference} is of tunnel {there.tunnel}, not of {tunnel}")
        if part.low >= place.end or part.high <= place.start:
            raise UserError(f"the limit applies to no part of {tunnel}, which is from {place.start:.3f} to {place.end:.3f} m")
        limit = AlarmLimit(
            name, quantity, warning, alarm, _bound(part.low), _bound(part.high),
            (step or STEP) if quantity in OF_STRETCHES else None, clock, reference, min_inspected,
        )  # fmt: skip
        save_limit(conn, place.tunnel_id, tunnel, limit)
    add_to_json(tunnel=tunnel, limit=limit)
    notify(f"{name}: {quantity} of {tunnel}, warning from {warning:g}, alarm from {alarm:g}")


@alarms.command("list", examples=["tunneldb alarms list ringo"])
@click.argument("tunnel")
@click.pass_obj
def list_(settings: Settings, tunnel: str) -> None:
    """List the limits of TUNNEL."""
    from tunneldb.store.alarm import list_limits
    from tunneldb.store.tunnel import get_tunnel

    with connect(settings.dsn) as conn:
        rows = list_limits(conn, get_tunnel(conn, tunnel))
    add_to_json(tunnel=tunnel, limits=rows)
    print_table(
        ["name", "quantity", "warning", "alarm", "unit", "from", "to", "inspected %", "of"],
        [
            (
                row["name"], row["quantity"], f"{row['warning']:g}", f"{row['alarm']:g}", row["unit"], row["label_from"] or "",
                row["label_to"] or "", f"{100 * row['min_inspected']:g}", _places(row),
            )
            for row in rows
        ],
        right=(2, 3, 5, 6, 7),
    )  # fmt: skip


@alarms.command(examples=["tunneldb alarms remove ringo oval"])
@click.argument("tunnel")
@click.argument("name")
@click.pass_obj
def remove(settings: Settings, tunnel: str, name: str) -> None:
    """Remove the limit NAME of TUNNEL."""
    from tunneldb.store.alarm import remove_limit
    from tunneldb.store.tunnel import get_tunnel

    with connect(settings.dsn) as conn:
        remove_limit(conn, get_tunnel(conn, tunnel), tunnel, name)
    add_to_json(tunnel=tunnel, name=name)


@alarms.command(
    examples=["tunneldb alarms check ringo", "tunneldb alarms check ringo -o alarms.csv"],
    codes=CODES,
)
@click.argument("tunnel")
@output_option("File to write, with a row for each limit and place: .csv.")
@click.pass_context
def check(ctx: click.Context, tunnel: str, output: Path | None) -> None:
    """Compare the latest survey of TUNNEL with all its limits.

    A place that was not inspected, or less than --min-inspected of it, is unknown, unless what was seen reaches a limit.
    The table has what is not below the warning: alarms first, and consecutive unknown places as one row.
    """
    from tunneldb.store.alarm import load_alarms
    from tunneldb.store.tunnel import get_tunnel

    settings: Settings = ctx.obj
    require_ending(output, "the list of alarms", (".csv",))
    with connect(settings.dsn) as conn:
        get_tunnel(conn, tunnel)
        rows = load_alarms(conn, tunnel)
    if not rows:
        raise UserError(f"tunnel {tunnel} has no limits: tunneldb alarms add {tunnel} NAME --quantity …")
    levels = Counter(row["level"] for row in rows)
    totals = {level: levels[level] for level in ("alarm", "warning", "unknown", "ok")}
    add_to_json(tunnel=tunnel, survey=rows[0]["survey"], date=rows[0]["date"], levels=totals, alarms=rows)
    files = [] if output is None else write_rows(output, COLUMNS, rows)
    print_table(
        ["level", "limit", "from", "to", "value", "unit", "per year", "why"],
        [line for level in ("alarm", "warning", "unknown") for line in _lines(level, rows)],
        right=(2, 3, 4, 6),
    )
    notify(f"{rows[0]['survey'] or 'no survey'}: " + ", ".join(f"{count} {level}" for level, count in totals.items()))
    say_written(files)
    ctx.exit(ALARMED if levels["alarm"] else WARNED if levels["warning"] else UNKNOWN if levels["unknown"] else 0)


def _lines(level: str, rows: Sequence[Mapping[str, Any]]) -> list[tuple[str, ...]]:
    """Return the lines of a level in the table; consecutive unknown places of a limit for the same reason are one."""
    numbered = [(n, row) for n, row in enumerate(rows) if row["level"] == level]
    if level != "unknown":
        return [_line(row, row["chainage_to"], row["why"]) for _, row in numbered]
    lines = []
    for _, grouped in groupby(enumerate(numbered), lambda one: (one[1][0] - one[0], one[1][1]["name"])):
        found = [row for _, (_, row) in grouped]
        reasons = list(dict.fromkeys(row["why"] for row in found))
        places = f"{counted(len(found), 'place')}: " if len(found) > 1 else ""
        lines.append(_line(found[0], found[-1]["chainage_to"], places + reasons[0] + (", …" if len(reasons) > 1 else "")))
    return lines


def _line(row: Mapping[str, Any], chainage_to: float | None, why: str) -> tuple[str, ...]:
    value, rate = row["value"], row["rate"]
    shown = row["level"] != "unknown"
    return (
        row["level"], row["name"], _metres(row["chainage_from"]), _metres(chainage_to),
        f"{value:.4g}" if shown and value is not None else "", row["unit"] if shown else "",
        f"{rate:+.3g}" if shown and rate is not None else "", why,
    )  # fmt: skip


def _metres(chainage: float | None) -> str:
    return "" if chainage is None else f"{chainage:.3f}"


def _bound(chainage: float) -> float | None:
    return chainage if math.isfinite(chainage) else None


def _places(row: Mapping[str, Any]) -> str:
    """Return what a limit is compared with, as text."""
    if row["quantity"] == "ovality":
        return "rings"
    if row["quantity"] == "convergence":
        since = f" since {row['reference']}" if row["reference"] else ""
        return f"chord {row['clock_from']:g} to {row['clock_to']:g} o'clock{since}"
    return f"stretches of {row['step']:g} m"
