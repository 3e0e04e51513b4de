"""The command ``actions``: what inspections demand, by whom and until when."""

from __future__ import annotations

import datetime as dt
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import Any

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.measure import output_option, require_ending, say_written
from tunneldb.cli.output import CommandGroup, add_to_json, notify
from tunneldb.cli.param_types import FilePath
from tunneldb.cli.past import as_of_option, connect_as_of
from tunneldb.cli.stretch import parse_stretch, stretch_options
from tunneldb.cli.tables import print_table
from tunneldb.counted import counted
from tunneldb.database import connect
from tunneldb.errors import UserError
from tunneldb.files import replacing
from tunneldb.store.actions import STATES, URGENCIES


class _Day(click.ParamType[dt.date]):
    """A day, ``2027-03-31``."""

    name = "day"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> dt.date:
        """Return the day."""
        try:
            return dt.date.fromisoformat(value)
        except ValueError:
            raise UserError(f"--due {value}: write the day as 2027-03-31") from None


class _Cost(click.ParamType[tuple[Decimal, str]]):
    """A cost with its currency, ``1200.50 EUR``."""

    name = "cost"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[Decimal, str]:
        """Return amount and currency."""
        amount, _, currency = value.partition(" ")
        try:
            return Decimal(amount), currency.strip()
        except InvalidOperation:
            raise UserError(f"--cost {value}: write the amount and its currency, as '1200.50 EUR'") from None


def _given(command: Any) -> Any:
    """Add the options for the values of an action."""
    options = (
        click.option("--measure", metavar="TEXT", help="What is to be done."),
        click.option("--urgency", type=click.Choice(URGENCIES), help="Urgency. [default of a new action: planned]"),
        click.option("--responsible", metavar="TEXT", help="Person or firm that does it."),
        click.option("--due", type=_Day(), metavar="DAY", help="Day until which it is to be done, as 2027-03-31."),
        click.option("--cost", type=_Cost(), metavar="COST", help="Cost with its currency, as '1200.50 EUR'."),
        click.option("--state", type=click.Choice(STATES), help="State. [default of a new action: open]"),
        click.option("--remark", metavar="TEXT", help="Remark."),
    )
    for option in reversed(options):
        command = option(command)
    return command


def _values(given: dict[str, Any]) -> dict[str, Any]:
    """Return the values that were given, by column."""
    values = {name: value for name, value in given.items() if value is not None and name != "cost"}
    if given["cost"] is not None:
        values["cost"], values["currency"] = given["cost"]
    return values


@click.group(cls=CommandGroup)
def actions() -> None:
    """List, add, change, remove, export or import the actions that inspections demand."""


@actions.command(
    "list",
    examples=[
        "tunneldb actions list ringo",
        "tunneldb actions list ringo --overdue",
        "tunneldb actions list ringo --survey ringo-2024 --state open --state ordered",
    ],
)
@click.argument("tunnel")
@click.option("--survey", metavar="SURVEY", help="Only actions that this survey demands.")
@click.option(
    "--state", "states", type=click.Choice(STATES), multiple=True, help="Only actions in this state. Can be repeated."
)
@click.option("--overdue", is_flag=True, help="Only actions that are open or ordered after their due date.")
@as_of_option
@click.pass_obj
def list_(
    settings: Settings, tunnel: str, survey: str | None, states: tuple[str, ...], overdue: bool, moment: dt.datetime | None
) -> None:
    """List the actions of TUNNEL by due date, with the state of each leak in later surveys.

    A later survey is included if it was compared with the survey of the action (tunneldb compare). --as-of needs
    --survey.
    """
    if moment is not None and survey is None:
        raise UserError("--as-of needs --survey SURVEY: the past is shown of one survey")
    rows = _read(settings, tunnel, states, overdue, survey, moment)
    add_to_json(tunnel=tunnel, actions=rows)
    print_table(
        ["id", "place", "subject", "measure", "urgency", "responsible", "due", "cost", "state", "follow-up"],
        [
            (
                row["id"], row["label"], _subject(row), row["measure"], row["urgency"],
                row["responsible"] or "", f"{row['due']}, overdue" if row["overdue"] else row["due"] or "",
                f"{row['cost']} {row['currency']}" if row["cost"] is not None else "", row["state"], row["follow_up"] or "",
            )
            for row in rows
        ],
        right=(0, 7),
    )  # fmt: skip
    late = sum(bool(row["overdue"]) for row in rows)
    notify(f"{counted(len(rows), 'action')}, {late} overdue")
    wet = [str(row["id"]) for row in rows if row["state"] in ("done", "verified") and _is_wet(row["follow_up"])]
    if wet:
        notify(f"done, but wet in a later survey: {counted(len(wet), 'action')} ({', '.join(wet)})")


@actions.command(
    examples=[
        "tunneldb actions add ringo-2024 --finding 17 --measure 'Inject the joint' --urgency urgent --due 2027-03-31",
        "tunneldb actions add ringo-2024 --from 12+300 --to 12+350 --measure 'Clean the drain' --cost '1200.50 EUR'",
    ]
)
@click.argument("survey")
@click.option("--finding", "finding_id", type=int, metavar="ID", help="Finding that it is about; gives its place.")
@click.option("--element", metavar="NAME", help="Name of the element that it is about; --from and --to give its place.")
@stretch_options
@_given
@click.pass_obj
def add(
    settings: Settings,
    /,
    survey: str,
    finding_id: int | None,
    element: str | None,
    start: str | None,
    end: str | None,
    **given: Any,
) -> None:
    """Add an action that SURVEY demands, for a finding or a stretch."""
    from tunneldb.store.actions import add_action
    from tunneldb.store.survey import get_survey

    values = _values(given)
    if not values.get("measure"):
        raise UserError("--measure is missing: what is to be done")
    if (finding_id is None) == (start is None and end is None):
        raise UserError("give either --finding ID, or --from and --to, also with --element")
    with connect(settings.dsn) as conn:
        found = get_survey(conn, survey)
        values |= {"finding_id": finding_id, "element": element}
        if finding_id is None:
            part = parse_stretch(conn, found, start, end)
            values |= {"chainage_from": part.low, "chainage_to": part.high}
        key = add_action(conn, survey, values)
    add_to_json(survey=survey, id=key)
    notify(f"action {key} of {survey}: {values['measure']}")


@actions.command(
    "set",
    examples=["tunneldb actions set 3 --state ordered --responsible 'Works Ltd'", "tunneldb actions set 3 --state verified"],
)
@click.argument("action_id", metavar="ID", type=int)
@_given
@click.pass_obj
def set_(settings: Settings, /, action_id: int, **given: Any) -> None:
    """Change values of the action ID. Values that are not given stay."""
    from tunneldb.store.actions import change_action

    values = _values(given)
    if not values:
        raise UserError("nothing to change: give --state, --due or another value")
    with connect(settings.dsn) as conn:
        change_action(conn, action_id, values)
    add_to_json(id=action_id, **values)
    notify(f"action {action_id}: {', '.join(f'{name} {value}' for name, value in values.items())}")


@actions.command(examples=["tunneldb actions remove 3"])
@click.argument("action_id", metavar="ID", type=int)
@click.pass_obj
def remove(settings: Settings, action_id: int) -> None:
    """Remove the action ID. The audit keeps what it was."""
    from tunneldb.store.actions import remove_action

    with connect(settings.dsn) as conn:
        remove_action(conn, action_id)
    add_to_json(id=action_id)


@actions.command(examples=["tunneldb actions export ringo -o actions.xlsx"])
@click.argument("tunnel")
@output_option("File to write: .xlsx or .csv.")
@click.pass_obj
def export(settings: Settings, tunnel: str, output: Path | None) -> None:
    """Write the actions of TUNNEL to a file that can be edited and read again by tunneldb actions import."""
    from tunneldb.export.tables.actions import write_actions
    from tunneldb.pipeline.action_file import COLUMNS, stamped

    if output is None:
        raise UserError("--output FILE is missing")
    require_ending(output, "a list of actions", (".xlsx", ".csv"))
    rows = _read(settings, tunnel, (), False, None)
    with replacing(output) as temporary:
        write_actions(temporary, f"Actions of {tunnel}", COLUMNS, [stamped(row) for row in rows])
    add_to_json(tunnel=tunnel, actions=len(rows))
    notify(counted(len(rows), "action"))
    say_written([output])


@actions.command("import", examples=["tunneldb actions import ringo actions.xlsx"])
@click.argument("tunnel")
@click.argument("file", type=FilePath(dir_okay=False))
@click.pass_obj
def import_(settings: Settings, tunnel: str, file: Path) -> None:
    """Read an edited list of actions of TUNNEL from FILE, .xlsx or .csv.

    A row without id is a new action; it needs survey, measure, and finding_id or chainage_from and chainage_to (m). A row
    whose values differ changes its action. An action without a row stays. If somebody changed an action since the file was
    written, nothing is read, and the line is reported.
    """
    from tunneldb.pipeline.action_file import read_actions
    from tunneldb.store.tunnel import get_tunnel

    require_ending(file, "a list of actions", (".xlsx", ".csv"))
    with connect(settings.dsn) as conn:
        done = read_actions(conn, get_tunnel(conn, tunnel), file)
    add_to_json(tunnel=tunnel, added=done.added, changed=done.changed, unchanged=done.unchanged)
    notify(f"{done.added} added, {done.changed} changed, {done.unchanged} unchanged")


def _is_wet(follow_up: str | None) -> bool:
    """Return True if a leak is still wet in a later survey."""
    return (follow_up or "").startswith(("grown ", "same ", "shrunk "))


def _subject(row: dict[str, Any]) -> str:
    """Return the finding or element of an action as text; an element's name can be a number, too."""
    if row["finding_id"] is not None:
        return f"finding {row['finding_id']}"
    return f"element {row['element']}" if row["element"] else ""


def _read(
    settings: Settings,
    tunnel: str,
    states: tuple[str, ...],
    overdue: bool,
    survey: str | None,
    moment: dt.datetime | None = None,
) -> list[dict[str, Any]]:
    from tunneldb.store.actions import list_actions, outdated_comparisons
    from tunneldb.store.survey import get_survey
    from tunneldb.store.tunnel import get_tunnel

    with connect_as_of(settings.dsn, survey or "", moment) as conn:
        tunnel_id = get_tunnel(conn, tunnel)
        if survey is not None and get_survey(conn, survey).tunnel_id != tunnel_id:
            raise UserError(f"survey {survey} is not of tunnel {tunnel}")
        outdated = [] if moment is not None else outdated_comparisons(conn, tunnel_id)
        for older, newer, reason in (one for one in outdated if survey in (None, one[0])):
            notify(f"follow-ups in {newer} are outdated ({reason}): tunneldb compare {older} {newer}")
        return list_actions(conn, tunnel_id, states, overdue, survey)
