"""`tunneldb check`."""

from __future__ import annotations

import sys

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command, printable


@command(examples=["tunneldb check", "tunneldb check --json"], wrong="a check failed; the list has the fix")
@click.pass_obj
def check(settings: Settings) -> None:
    """Check the server and the database, and show how to fix faults.

    ✓ correct, • works but can be improved, ✗ wrong.
    """
    from tunneldb.database.health import CheckResult, examine

    findings: list[CheckResult] = []
    add_to_json(findings=findings)
    for finding in examine(settings.dsn):
        findings.append(finding)
        mark = {"ok": "✓", "note": "•", "wrong": "✗"}[finding.level]
        colour = {"ok": "green", "note": "yellow", "wrong": "red"}[finding.level]
        click.echo(f"{click.style(mark, fg=colour)} {finding.subject}: {printable(finding.text)}")
        if finding.remedy:
            click.echo(f"    {printable(finding.remedy)}")
    if any(finding.level == "wrong" for finding in findings):
        sys.exit(1)
