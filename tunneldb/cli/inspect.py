"""`tunneldb inspect`."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tunneldb.cli.output import add_to_json, command, notify
from tunneldb.cli.param_types import FilePath
from tunneldb.cli.progress import bar, step
from tunneldb.cli.tables import print_table
from tunneldb.cli.units import unit_options
from tunneldb.errors import UserError

if TYPE_CHECKING:
    from tunneldb.pipeline.first_steps import FirstSteps
    from tunneldb.pipeline.inspection import FileLook

_MOST_SCANS = 8


@command(
    examples=["tunneldb inspect scan.laz", "tunneldb inspect scans/*.e57"],
    wrong="a file can't be read; the others were looked at",
)
@click.argument("files", nargs=-1, required=True, type=FilePath(), metavar="FILES...")
@unit_options("FILES")
def inspect(files: tuple[Path, ...], unit: str | None, height_unit: str | None) -> None:
    """Show the contents of scan FILES, missing inputs, and the next commands; needs no database.

    Files are read once in chunks, and up to 50 million points a second time, to test if an axis can be found.
    Density, size and values are estimates from a random sample. The kind of intensity and the unit of length are
    guessed from values: ask whoever made the scan.
    """
    from tunneldb.pipeline.first_steps import first_steps, needs_axis
    from tunneldb.pipeline.inspection import find_axis_fault, inspect_file
    from tunneldb.pointcloud.units import GivenUnits

    given = GivenUnits(unit, height_unit)
    looks: list[FileLook] = []
    faults: list[UserError] = []
    with bar("points") as progress:
        for path in files:
            try:
                looks.append(inspect_file(path, step(progress), given))
            except UserError as error:  # what is wrong with one file is no reason not to look at the others
                faults.append(error)
        axis_fault = find_axis_fault(looks, step(progress), given) if looks and needs_axis(looks) else None
    if not looks:
        raise faults[0]
    for look in looks:
        _print_file(look)
    found = first_steps(looks, axis_fault)
    add_to_json(files=looks, unreadable=list(map(str, faults)), **dataclasses.asdict(found))
    for fault in faults:
        notify(str(fault))
    _print_steps(found)
    if faults:
        raise SystemExit(1)


def _print_file(look: FileLook) -> None:
    print_table([str(look.path), ""], _rows(look))
    click.echo()
    rows = []
    for one in look.intensities:
        if one.values is None:
            rows.append([one.name, "", "", "", "", "", "", "", one.fault])
            continue
        values = one.values
        numbers = [f"{value:.5g}" for value in (values.least, values.low, values.median, values.high, values.most)]
        missing = f"{100.0 * values.missing / values.count:.3g} %"
        kind = f"{one.type}, whole" if values.whole and "float" in one.type else one.type
        rows.append([one.name, kind, *numbers, missing, " or ".join(guess.what for guess in one.guesses) or "neither"])
    if rows:
        header = ["dimension", "numbers", "least", "1 %", "median", "99 %", "most", "NaN", "looks like (a guess)"]
        print_table(header, rows, right=range(2, 8))
    else:
        click.echo("no dimension that may be an intensity")
    click.echo()


def _rows(look: FileLook) -> list[tuple[str, str]]:
    low, high = look.low, look.high
    invalid = f", and {_number(look.invalid)} marked invalid" if look.invalid else ""
    rows = [
        ("format", look.format),
        ("points", _number(look.points) + invalid),
        ("coordinate system", look.crs or (f"can't be read: {look.unread_crs}" if look.unread_crs else "not stated")),
        ("heights", look.heights or "not stated"),
        ("x, y, z from", "  ".join(f"{value:.3f}" for value in low)),
        ("to", "  ".join(f"{value:.3f}" for value in high)),
    ]
    if look.length is not None:
        rows.append(("size, as a tunnel", f"{look.length:.1f} long, {look.width:.1f} wide, {look.height:.1f} high"))
    share = f"on {_number(look.sampled)} points" + ("" if look.sampled == look.points else " picked at random")
    least, median, most = map(_rounded, look.density)
    rows += [
        ("density", f"{median} per m² of surface, {least} to {most} for 80 % of it; counted within 1 m of 400 places, {share}"),
        ("profile spacing", "unknown" if look.profile_spacing is None else f"every {_length(look.profile_spacing)}"),
        ("unit of length", look.unit or "probably metres"),
        ("times", _times(look)),
        ("scans", _scans(look)),
    ]
    if look.colours is not None:
        rows.append(("colours", look.colours))
    if look.pictures:
        rows.append(("pictures", "; ".join(look.pictures)))
    return rows


def _length(metres: float) -> str:
    return f"{metres:.2f} m" if metres >= 0.1 else f"{1000.0 * metres:.0f} mm"


def _times(look: FileLook) -> str:
    if look.times is None:
        return "none"
    kind = f" ({look.time_kind})" if look.time_kind else ""
    untimed = f"; {_number(look.untimed)} points without" if look.untimed else ""
    return f"{look.times[0]:.3f} to {look.times[1]:.3f} s{kind}{untimed}"


def _scans(look: FileLook) -> str:
    if look.poses:
        posed = sum(scan.position is not None for scan in look.poses)
        return f"{len(look.poses)}, {posed} of them with their pose"
    numbers = sorted(look.scans)
    more = f" and {len(numbers) - _MOST_SCANS} more" if len(numbers) > _MOST_SCANS else ""
    return f"{len(numbers)}, without poses; scan_id {', '.join(map(str, numbers[:_MOST_SCANS]))}{more}"


def _print_steps(found: FirstSteps) -> None:
    for title, lines in (("Doubtful", found.doubts), ("Missing", found.missing), ("Next", found.commands)):
        if lines:
            click.echo(f"{title}:")
            for line in lines:
                click.echo(f"  {line}")


def _rounded(value: float) -> str:
    """Three digits."""
    return _number(int(float(f"{value:.3g}"))) if value >= 100.0 else f"{value:.3g}"


def _number(value: int) -> str:
    return f"{value:,}".replace(",", " ")
