"""`tunneldb status`."""

from __future__ import annotations

from typing import Any

import click
from rich.text import Text

from tunneldb.cli.main import Settings
from tunneldb.cli.tables import print_table
from tunneldb.database import connect, get_survey

STAGES = ("load", "axis", "segments", "sections", "detect")
STYLES = {"done": "green", "running": "cyan", "failed": "red", "interrupted": "red", "stale": "yellow", "never": "dim"}


@click.command()
@click.argument("survey", required=False)
@click.pass_obj
def status(settings: Settings, survey: str | None) -> None:
    """Show what is loaded and how far each kilometre has come; of one SURVEY or of all.

    A stage is stale when what it rests on has changed since, interrupted when the program that ran it is gone.
    """
    with connect(settings.dsn) as connection:
        if survey is not None:
            get_survey(connection, survey)
        surveys = connection.execute(
            """
            SELECT name, tunnel, date, files, points,
                   tunnel_api.chainage_label(chainage_from), tunnel_api.chainage_label(chainage_to)
              FROM tunnel_api.survey WHERE %(survey)s::text IS NULL OR name = %(survey)s ORDER BY tunnel, date, name
            """,
            {"survey": survey},
        ).fetchall()
        stages = connection.execute(
            """
            SELECT survey, km, stage, CASE WHEN stale AND outcome = 'done' THEN 'stale' ELSE outcome END, reason, message
              FROM tunnel_api.stage_status
             WHERE %(survey)s::text IS NULL OR survey = %(survey)s ORDER BY survey, km, step
            """,
            {"survey": survey},
        ).fetchall()
    print_table(["survey", "tunnel", "date", "files", "points", "from", "to"], surveys, right=(3, 4, 5, 6))
    if stages:
        click.echo()
        print_table(["survey", "km", *STAGES, ""], _kilometres(stages), right=(1,))


def _kilometres(stages: list[tuple[Any, ...]]) -> list[list[Any]]:
    """Return a row a kilometre: the outcome of each stage, and what there is to say of the first that is not done."""
    outcomes: dict[tuple[str, int], dict[str, str]] = {}
    remarks: dict[tuple[str, int], str] = {}
    for survey, km, stage, outcome, reason, message in stages:
        outcomes.setdefault((survey, km), {})[stage] = outcome
        remark = message if outcome in ("failed", "interrupted") else reason if outcome == "stale" else None
        if remark:
            remarks.setdefault((survey, km), f"{stage}: {remark.splitlines()[0]}")
    return [
        [*key, *(Text(found[stage], STYLES[found[stage]]) for stage in STAGES), remarks.get(key, "")]
        for key, found in outcomes.items()
    ]
