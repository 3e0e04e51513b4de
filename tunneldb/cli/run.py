"""``tunneldb run``: the stages of the pipeline."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command, notify
from tunneldb.cli.progress import bar, say
from tunneldb.cli.stage_sentence import stage_sentence
from tunneldb.counted import counted
from tunneldb.database import connect
from tunneldb.errors import NotReadyError
from tunneldb.stages.ledger import Run
from tunneldb.stages.parameters import PARAMETERS, settings
from tunneldb.store.coverage import read_coverage, sum_leaks
from tunneldb.store.survey import Survey, get_survey

if TYPE_CHECKING:
    import psycopg

    from tunneldb.stages.stage import Stage


def parameter_table(names: Iterable[str] = PARAMETERS) -> str:
    """Parameters, what they mean and their defaults, a line each."""
    chosen = {name: PARAMETERS[name] for name in names}
    width = max(map(len, chosen), default=0)
    return "\n".join(f"  {name:<{width}}  {p.text} [{f'{p.default:g} {p.unit}'.rstrip()}]" for name, p in chosen.items())


@command(
    epilog="\b\nParameters for --set, with their defaults:\n" + parameter_table(),
    examples=[
        "tunneldb run ringo-2024",
        "tunneldb run ringo-2024 --km 511-512 --from sections --to ground",
        "tunneldb run ringo-2024 --from detect --set leak.min_area=0.1",
        "tunneldb run ringo-2024 --stale",
    ],
)
@click.argument("survey")
@click.option("--km", metavar="A[-B]", help="Only these kilometres, 511 or 511-512; default: all loaded.")
@click.option("--from", "first", metavar="STAGE", help="First stage: axis, segments, sections, ground or detect.")
@click.option("--to", "last", metavar="STAGE", help="Last stage.")
@click.option("--set", "assignments", multiple=True, metavar="NAME=VALUE", help="Set a parameter; see below. May be repeated.")
@click.option(
    "--stale", is_flag=True,
    help="Only stale stages (tunneldb status), for example after an axis vertex was moved, with the "
        "parameters of their last run.",
)  # fmt: skip
@click.pass_obj
def run(
    settings_: Settings,
    survey: str,
    km: str | None,
    first: str | None,
    last: str | None,
    assignments: tuple[str, ...],
    stale: bool,
) -> None:
    """Run the stages of SURVEY: axis, segments, sections, ground, detect.

    Each stage of each kilometre is one transaction that replaces the earlier result, so a run can be stopped and
    repeated at any time. Axis vertices moved by hand and reviews are kept. --json has all counts.
    """
    from tunneldb.stages.run import choose_stages, loaded_kilometres, parse_km, run_tasks, stage_tasks, stale_tasks
    from tunneldb.store.networks import add_networks, names_network

    # Checked before the database is opened; a network becomes a number there.
    settings(one for one in assignments if not names_network(one))
    stages = choose_stages(first, last)
    with connect(settings_.dsn) as conn:
        found = get_survey(conn, survey)
        assignments = tuple(add_networks(conn, assignments))
        values = settings(assignments)
        there = loaded_kilometres(conn, found)
        conn.rollback()
        if not there:
            raise NotReadyError(f"survey {survey} holds no points yet: tunneldb load {survey} FILE...")
        kilometres = parse_km(km, there)
        if stale:
            tasks = stale_tasks(conn, found, kilometres, stages, assignments)
            conn.rollback()
        else:
            tasks = stage_tasks(kilometres, stages, values)
        if not tasks:
            click.echo(f"nothing of {survey} is stale")
        shown = _Shown(len(tasks))
        add_to_json(survey=survey, stages=shown.stages)
        with shown.progress:
            run_tasks(conn, found, tasks, shown.begin, shown.end)
        if any(task.stage.name == "detect" for task in tasks):
            _say_result(conn, found)


class _Shown:
    """A bar on a terminal that each stage of each kilometre moves on, and a sentence for each when it is done."""

    def __init__(self, total: int) -> None:
        self.progress = bar("stages")
        self.task = self.progress.add_task("", total=total)
        self.total = total
        self.stages: list[dict[str, Any]] = []
        self.began = time.monotonic()

    def begin(self, stage: Stage, km: int) -> Callable[[float], None]:
        done = len(self.stages)
        self.began = time.monotonic()
        self.progress.update(self.task, description=f"[{done + 1}/{self.total}] {stage.name} km {km}")
        return lambda share: self.progress.update(self.task, completed=done + share)

    def end(self, stage: Stage, km: int, run: Run) -> None:
        seconds = round(time.monotonic() - self.began, 3)
        self.stages.append({"stage": stage.name, "km": km, "seconds": seconds, "counts": run.counts})
        done = len(self.stages)
        self.progress.update(self.task, completed=done)
        counts = dict(run.counts)
        note = counts.pop("note", None)
        say(f"[{done}/{self.total}] {stage.name} km {km}: {stage_sentence(stage.name, counts)}")
        if note:
            say(f"  note: {note}")


def _say_result(conn: psycopg.Connection[Any], survey: Survey) -> None:
    """Print number and area of the leaks, and the commands that show them."""
    if survey.intensity_kind == "none":
        click.echo(f"no leaks were sought; the lining: tunneldb image {survey.name}, tunneldb qgis {survey.name} -o FILE.qgz")
        return
    leaks, area = sum_leaks(conn, survey)
    add_to_json(leaks=leaks, wet_area=area)
    if (statement := read_coverage(conn, survey).statement) is not None:
        notify(statement)
    click.echo(f"{survey.name}: {counted(leaks, 'leak')}, {area:.2f} m²: tunneldb leaks {survey.name}")
    click.echo(f"to look at it: tunneldb qgis {survey.name} -o FILE.qgz; a report: tunneldb report {survey.name} -o FILE.html")
