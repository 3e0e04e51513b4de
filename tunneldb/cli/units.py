"""Options for the units of coordinates in files."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import click

from tunneldb.geometry.units import METRES

Command = TypeVar("Command", bound=Callable[..., Any])


def unit_options(files: str) -> Callable[[Command], Command]:
    """Add --unit and --height-unit, for the coordinates in `files`, to a command."""

    def add(command: Command) -> Command:
        choice = click.Choice(list(METRES))
        height = click.option(
            "--height-unit",
            type=choice,
            metavar="UNIT",
            help=f"Unit of z in {files}. [default: unit stated in {files}, else --unit]",
        )
        plan = click.option(
            "--unit",
            type=choice,
            metavar="UNIT",
            help=f"Unit of x and y in {files}, whatever they state: {', '.join(METRES)} (US survey foot: us-ft); they are "
            "converted to metres. [default: m]",
        )
        return plan(height(command))

    return add
