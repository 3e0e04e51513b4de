"""Types of the command line's values: files and folders, numbers."""

from __future__ import annotations

import datetime as dt
import math
import os
from pathlib import Path
from typing import Any

import click

from tunneldb.errors import UserError
from tunneldb.files import require_regular
from tunneldb.numerals import MAX_MEASUREMENT, is_plain

SMALLEST = 1e-30
"""Numbers nearer to 0, which are not 0, cannot be meant; their squares are none in a database."""


class FilePath(click.Path):
    """A file or a folder, to be read or to be written, as a `Path`.

    Refused is what is neither, such as a pipe, which would be waited for, or a device, in whose place a file would be put, and
    a name that cannot be printed on one line.
    """

    def __init__(self, *, file_okay: bool = True, dir_okay: bool = True) -> None:
        super().__init__(file_okay=file_okay, dir_okay=dir_okay, path_type=Path)

    def convert(
        self, value: str | os.PathLike[str], param: click.Parameter | None, ctx: click.Context | None
    ) -> str | bytes | os.PathLike[str]:
        """Return the path."""
        text = os.fspath(value)
        if not text.isprintable():  # bytes that are no UTF-8 are surrogates, which are not
            raise UserError(f"the name {text!a} has bytes that are not UTF-8, or control characters; rename it")
        path = super().convert(value, param, ctx)
        require_regular(Path(os.fsdecode(path)))
        return path


def file_path(text: str) -> Path:
    """Path of a file that is given where something else may be, too; refused as `FilePath` refuses it."""
    return Path(os.fsdecode(FilePath().convert(text, None, None)))


class Moment(click.ParamType[dt.datetime]):
    """A past moment in local time, ``2026-03-31T12:00``; of a day, ``2026-03-31``, its end."""

    name = "moment"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> dt.datetime:
        """Return the moment with its time zone."""
        option = param.opts[0] if param else "moment"
        now = dt.datetime.now(dt.UTC)
        try:
            if len(value) == len("2026-03-31"):
                day = dt.date.fromisoformat(value)
                return (
                    now
                    if day == now.astimezone().date()
                    else self._past(option, value, dt.datetime.combine(day, dt.time.max), now)
                )
            return self._past(option, value, dt.datetime.fromisoformat(value), now)
        except ValueError:
            raise UserError(f"{option} {value}: write a day as 2026-03-31, or a moment as 2026-03-31T12:00") from None

    def _past(self, option: str, value: str, moment: dt.datetime, now: dt.datetime) -> dt.datetime:
        try:
            found = moment.astimezone(dt.UTC)
        except OverflowError:
            raise UserError(f"{option} {value}: that is not a day that can be meant") from None
        if found > now:
            raise UserError(f"{option} {value} is in the future")
        return found


def _plain(value: Any) -> Any:
    """Return a value without a number as only Python reads it, such as 272_000, which click then refuses."""
    return f"'{value}'" if isinstance(value, str) and not is_plain(value) else value


def _finite(number: float, value: Any, param: click.Parameter | None) -> float:
    if not math.isfinite(number) or abs(number) > MAX_MEASUREMENT or 0.0 < abs(number) < SMALLEST:
        name = "" if param is None else f"{param.opts[0]} "
        raise UserError(f"{name}{value}: that is no number which can be meant")
    return number


class Finite(click.types.FloatParamType):
    """A number; neither infinite nor NaN."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number."""
        return _finite(float(super().convert(_plain(value), param, ctx)), value, param)


class FiniteRange(click.FloatRange):
    """A number in a range; neither infinite nor NaN, which is in every range."""

    name = "float range"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number."""
        return _finite(float(super().convert(_plain(value), param, ctx)), value, param)


class WholeRange(click.IntRange):
    """A whole number in a range."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Return the number."""
        return int(super().convert(_plain(value), param, ctx))


FINITE = Finite()
SEED = WholeRange(0, 2**63 - 1)  # what random numbers start from, and formats keep
