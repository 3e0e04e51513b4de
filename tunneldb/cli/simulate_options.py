"""Options of the simulators: each sets a field of a simulator's parameters and shows its default."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from typing import Any, TypeVar

import click

from tunneldb.cli.param_types import FINITE, SEED

_Command = TypeVar("_Command", bound=Callable[..., Any])


def parameter_option(
    parameters: type[Any], field: str, metavar: str, text: str, kind: Any = FINITE, nargs: int = 1
) -> Callable[[_Command], _Command]:
    """Return the decorator of an option that sets a field of the parameters.

    Parameters
    ----------
    parameters : type
        Dataclass of the parameters; the default is taken from there and shown, unless it is None.
    field, metavar, text : str
        Name of the field, placeholder of the value, and help.
    kind : click.ParamType or type
        Type of the value.
    nargs : int
        Number of values.
    """
    default: Any = next(known.default for known in fields(parameters) if known.name == field)
    shown = " ".join(f"{v:.10g}" if isinstance(v, float) else str(v) for v in (default if nargs > 1 else [default]))
    flag = "--" + field.replace("_", "-")
    help_text = text if default is None else f"{text} [{shown}]"
    return click.option(flag, field, type=kind, nargs=nargs, metavar=metavar, help=help_text)


SRID = ("srid", "EPSG", "Coordinate system, projected in metres.", int)
NAME = ("name", "NAME", "First part of the file names.", str)
SEED_NUMBER = ("seed", "N", "Seed; the same seed gives the same points.", SEED)
