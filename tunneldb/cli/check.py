"""`tunneldb check`."""

from __future__ import annotations

import sys

import click

from tunneldb.cli.main import Settings


@click.command()
@click.pass_obj
def check(settings: Settings) -> None:
    """Check the server and the database; say what mends them.

    Exit code 1 if something is wrong.
    """
    from tunneldb.database.health import examine

    healthy = True
    for finding in examine(settings.dsn):
        mark = {"ok": "✓", "note": "•", "wrong": "✗"}[finding.level]
        colour = {"ok": "green", "note": "yellow", "wrong": "red"}[finding.level]
        click.echo(f"{click.style(mark, fg=colour)} {finding.subject}: {finding.text}")
        if finding.mend:
            click.echo(f"    {finding.mend}")
        healthy = healthy and finding.level != "wrong"
    if not healthy:
        sys.exit(1)
