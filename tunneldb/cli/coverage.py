"""Statements of commands on leaks: where leaks could be missed, and notes and limitations."""

from __future__ import annotations

from collections.abc import Sequence

import click
from rich.console import Console

from tunneldb.cli.output import add_to_json, notify, printable
from tunneldb.counted import counted
from tunneldb.geometry.local import LOCAL
from tunneldb.store.coverage import Coverage
from tunneldb.store.remarks import Remark
from tunneldb.store.survey import Survey

MOST_REMARKS = 6
"""Of those that are printed with what they are about; ``status`` has all."""


def say_remarks(remarks: Sequence[Remark], survey: Survey) -> None:
    """Print notes and limitations of the results on stderr, and add them to ``--json``."""
    add_to_json(remarks=remarks)
    for remark in remarks[:MOST_REMARKS]:
        notify(printable(remark.said))
    if len(remarks) > MOST_REMARKS:
        notify(f"and {counted(len(remarks) - MOST_REMARKS, 'more remark')}: tunneldb status {survey.name}")


def say_coverage(coverage: Coverage, survey: Survey, *, on_stdout: bool = False) -> None:
    """Say where leaks can't be vouched for, on stderr or before what stdout holds for people, and tell it to ``--json``."""
    add_to_json(
        statement=coverage.statement,
        gaps=coverage.gaps,
        seen_area=coverage.seen_area,
        seen_share=coverage.seen_share,
        searched_share=coverage.searched_share,
    )
    if survey.intensity_kind == "none":
        notify(f"survey {survey.name} has no intensity: leaks were not searched for")
    elif coverage.statement is not None and on_stdout:
        console = Console()
        if console.is_terminal:  # else there is no width: nothing is to be broken there
            console.print(coverage.statement, markup=False, highlight=False)
        else:
            click.echo(coverage.statement)
    elif coverage.statement is not None:
        notify(coverage.statement)


def say_no_crs(srid: int) -> None:
    """Warn on standard error that GeoJSON cannot state local coordinates."""
    if srid == LOCAL:
        notify(
            "GeoJSON can't say that coordinates are local: programs take them for longitude and latitude; a GeoPackage says it"
        )
