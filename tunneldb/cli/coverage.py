"""What verbs that state leaks say before them: where these can't be vouched for."""

from __future__ import annotations

import click
from rich.console import Console

from tunneldb.cli.output import tell
from tunneldb.store.coverage import Coverage
from tunneldb.store.survey import Survey


def say_coverage(coverage: Coverage, survey: Survey, *, on_stdout: bool = False) -> None:
    """Say where leaks can't be vouched for, on stderr or before what stdout holds for people, and tell it to ``--json``."""
    tell(
        statement=coverage.statement,
        gaps=coverage.gaps,
        seen_area=coverage.seen_area,
        seen_share=coverage.seen_share,
        searched_share=coverage.searched_share,
    )
    if survey.intensity_kind == "none":
        click.echo(f"survey {survey.name} has no intensity: leaks were not sought", err=True)
    elif coverage.statement is not None and on_stdout:
        console = Console()
        if console.is_terminal:  # else there is no width: nothing is to be broken there
            console.print(coverage.statement, markup=False, highlight=False)
        else:
            click.echo(coverage.statement)
    elif coverage.statement is not None:
        click.echo(coverage.statement, err=True)
