"""The command ``learn``."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command, notify
from tunneldb.cli.tables import print_table
from tunneldb.counted import counted
from tunneldb.database import connect
from tunneldb.errors import UserError

if TYPE_CHECKING:
    from tunneldb.pipeline.learn import Plan
    from tunneldb.store.learned import Learned

STRONGEST = 8
"""So many terms of features are printed; ``--json`` has all."""


@command(
    examples=[
        "tunneldb learn ringo-2024",
        "tunneldb learn ringo-2024 ringo-2025 --apply --note 'soot at the portals'",
        "tunneldb learn ringo-2024 --list",
        "tunneldb learn ringo-2024 --undo",
    ],
)
@click.argument("surveys", metavar="SURVEY...", nargs=-1, required=True)
@click.option("--apply", "apply_", is_flag=True, help="Activate the adapted model for the tunnels of these surveys.")
@click.option("--undo", is_flag=True, help="Deactivate the last adapted model of the tunnels of these surveys.")
@click.option("--list", "list_", is_flag=True, help="List the adapted models of the tunnels of these surveys.")
@click.option("--note", metavar="TEXT", help="With --apply: note to store.")
@click.pass_obj
def learn(settings: Settings, surveys: tuple[str, ...], apply_: bool, undo: bool, list_: bool, note: str | None) -> None:
    """Adapt leak detection to findings that inspectors confirmed, rejected and renamed in SURVEY...

    Without --apply nothing changes. The output shows how the reviews agree with the present model, recalibrated and,
    from 25 reviews on, refit (a factor for each reason) and extended (also a term for each feature), each judged on
    reviews of other places; and the findings that would change their kind. The best is selected if it is
    significantly better. Fewer false leaks can mean more missed ones: both are stated.

    An applied model is used for all surveys of these tunnels: their stage detect becomes stale until tunneldb run
    SURVEY --stale. Reviews are kept. Outlines drawn by hand have no features and are not used; detected findings without stored
    features are not used until stage detect has run again.
    """
    from tunneldb.pipeline.learn import apply_plan, get_surveys, plan_learning, undo_learning
    from tunneldb.store.learned import list_learned

    if sum((apply_, undo, list_)) > 1:
        raise UserError("--apply, --undo and --list are three things: one at a time")
    if note is not None and not apply_:
        raise UserError("--note is of what is applied: add --apply")
    with connect(settings.dsn) as conn:
        found = get_surveys(conn, surveys)
        if list_:
            _print_list(list_learned(conn, {survey.tunnel_id for survey in found}))
        elif undo:
            undone = undo_learning(conn, found)
            conn.commit()
            add_to_json(undone=undone)
            for tunnel, number in undone.items():
                click.echo(
                    f"tunnel {tunnel}: learned {number} is undone; detection is stale where it was used: {_rerun(surveys)}"
                )
        else:
            plan = plan_learning(conn, found)
            numbers = apply_plan(conn, plan, note) if apply_ else {}
            conn.commit()
            _print_plan(plan)
            add_to_json(applied=numbers)
            _print_end(plan, numbers, surveys, apply_=apply_)


def _print_plan(plan: Plan) -> None:
    from tunneldb.pipeline.learn import no_features

    lesson = plan.lesson
    adjustment = lesson.adjustment
    add_to_json(
        surveys=plan.surveys, tunnels=list(plan.tunnels.values()), reviews=plan.reviews,
        without_features={survey: one.detected for survey, one in plan.unused.items()}, unused=plan.unused,
        held_out=lesson.held_out, chosen=adjustment.way, parameters=adjustment.to_json(), changes=plan.changes,
        largest=plan.largest,
    )  # fmt: skip
    for line in no_features(plan.unused):
        notify(line)
    sorts = ", ".join(f"{count} {sort}" for sort, count in plan.reviews.items())
    click.echo(f"{counted(lesson.reviews, 'review')}: {sorts}")
    rows = [
        (one.way, f"{one.loss:.3f}", one.false_leaks, one.missed, "chosen" if one.way == adjustment.way else "")
        for one in lesson.held_out
    ]
    print_table(("on reviews held out", "loss", "false leaks", "missed leaks", ""), rows, right=(1, 2, 3))
    if adjustment.way == "recalibrated":
        click.echo(f"logarithms of odds times {adjustment.slope:.2f}, plus {adjustment.offset:+.2f}")
    elif adjustment.factors:
        most = sorted(adjustment.factors.items(), key=lambda item: -abs(item[1] - 1.0))
        factors = ", ".join(f"{reason} {factor:.2f}" for reason, factor in most)
        click.echo(f"reasons count by these factors: {factors}; offset {adjustment.offset:+.2f}")
    if adjustment.terms:
        weights = sorted(((name, weight) for name, (_, _, weight) in adjustment.terms.items()), key=lambda item: -abs(item[1]))
        told = ", ".join(f"{name} {weight:+.2f}" for name, weight in weights[:STRONGEST])
        click.echo(f"logarithms of odds by standard deviations of features, the strongest: {told}")
    changes = [(one.survey, one.anomalies, one.to_leak, one.from_leak) for one in plan.changes]
    print_table(("survey", "anomalies", "become leaks", "no longer leaks"), changes, right=(1, 2, 3))
    largest = [
        (one.id, one.survey, one.label, one.was, one.will_be, f"{one.before:.2f}", f"{one.after:.2f}") for one in plan.largest
    ]
    if largest:
        print_table(("id", "survey", "chainage", "is", "becomes", "P(leak)", "then"), largest, right=(0, 5, 6))


def _print_end(plan: Plan, numbers: dict[str, int], surveys: tuple[str, ...], *, apply_: bool) -> None:
    if plan.lesson.adjustment.way == "base":
        click.echo("nothing was learned: on reviews held out the model as it is does as well")
    elif not apply_:
        click.echo("nothing was changed: --apply puts this in force")
    for tunnel, number in numbers.items():
        click.echo(f"tunnel {tunnel}: learned {number} is in force; detection is stale: {_rerun(surveys)}")


def _rerun(surveys: tuple[str, ...]) -> str:
    return " and ".join(f"tunneldb run {survey} --stale" for survey in dict.fromkeys(surveys))


def _print_list(listed: list[Learned]) -> None:
    add_to_json(learned=[dataclasses.asdict(one) for one in listed])
    rows = [
        (
            one.id, one.tunnel, "in force" if one.in_force else "undone" if one.undone_at else "before", one.way,
            sum(one.reviews.values()), f"{one.loss_base:.3f}", f"{one.loss:.3f}", f"{one.active_from:%Y-%m-%d %H:%M}",
            one.applied_by, ", ".join(one.surveys), one.note,
        )
        for one in listed
    ]  # fmt: skip
    if rows:
        header = ["id", "tunnel", "state", "way", "reviews", "loss before", "loss", "since", "by", "from", "note"]
        print_table(header, rows, right=(0, 4, 5, 6))
    else:
        click.echo("nothing was learned yet")
