"""Shared parts of all commands: help as a manual page, and ``--json``.

Under ``--json`` standard output holds exactly one JSON object, also when the command fails; what the command would print there
for people is left out. Keys that every object has: ``command``, ``ok``, ``exit_code``, ``seconds``; ``error`` where there is
one. The others are the results of the command.
"""

from __future__ import annotations

import dataclasses
import json
import logging
import math
import os
import time
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import Any

import click

from tunneldb.log import MESSAGES

JSON = "--json"
DONE = "done"
AT_FAULT = "the input, the server or the command line is at fault: one line says what, where, and what to do"

AS_JSON = "tunneldb.json"
"""Key in the context's meta: True if JSON is asked for."""

QUIET = "tunneldb.quiet"
"""Key in the context's meta: True if only errors are to be printed."""

log = logging.getLogger(MESSAGES)

MAX_LINE = 2000
"""Maximum characters of the line of an error; a longer one lacks its middle."""

_STDOUT = 1
"""Descriptor of standard output, which programs that are started inherit."""

_RESULT = "tunneldb.result"
_COMMAND = "tunneldb.command"


def printable(text: str) -> str:
    """Return text of others, such as a remark or a name in a file, on one line, with control characters as their codes."""
    return "".join(c if c == "\t" or _is_shown(c) else c.encode("unicode_escape").decode() for c in text)


def notify(text: str) -> None:
    """Print a message on standard error, unless the command is to be quiet, and log it."""
    log.info("%s", text)
    if not is_quiet():
        click.echo("\n".join(map(printable, text.split("\n"))), err=True)


class WaitHandler(logging.Handler):
    """Handler that prints which session a command waits for."""

    def emit(self, record: logging.LogRecord) -> None:
        """Print the line on standard error."""
        if not is_quiet():
            click.echo(f"tunneldb: {printable(record.getMessage())}", err=True)


def is_quiet() -> bool:
    """Return True if the command is to print errors only (`--quiet`)."""
    context = click.get_current_context(silent=True)
    return context is not None and bool(context.meta.get(QUIET))


def error_line(message: str) -> str:
    """Return the line by which an error is told, whatever names are in it."""
    text = printable(message)
    if len(text) > MAX_LINE:  # of a file with thousands of columns; the advice is at the end
        text = f"{text[: MAX_LINE // 2]} … {text[-MAX_LINE // 2 :]}"
    return "tunneldb: " + text


def _is_shown(character: str) -> bool:
    return character.isprintable() or unicodedata.category(character) == "Zs"  # such as the narrow space between thousands


def add_to_json(**values: Any) -> None:
    """Add to what ``--json`` prints; a later value takes the place of an earlier one.

    Parameters
    ----------
    **values
        What was done: names, counts, paths, rows. Lengths in metres, times in seconds.
    """
    context = click.get_current_context(silent=True)
    if context is not None:
        context.meta.setdefault(_RESULT, {}).update(values)


def records(names: Sequence[str], rows: Iterable[Sequence[Any]]) -> list[dict[str, Any]]:
    """Return rows of a table as mappings, to be told."""
    return [dict(zip(names, row, strict=True)) for row in rows]


def wants_json() -> bool:
    """Return True if the current command prints JSON."""
    context = click.get_current_context(silent=True)
    return context is not None and bool(context.meta.get(AS_JSON))


class Command(click.Command):
    """A command with ``--json``, and with examples and exit codes in its help.

    Parameters
    ----------
    *arguments, **options
        As of click.Command.
    examples : sequence of str
        Command lines to copy.
    wrong : str
        What exit code 1 means; empty when the command does not have it.
    codes : mapping of str to str, optional
        Meanings of further exit codes, or of code 0.
    """

    def __init__(
        self,
        *arguments: Any,
        examples: Sequence[str] = (),
        wrong: str = "",
        codes: Mapping[str, str] | None = None,
        **options: Any,
    ) -> None:
        super().__init__(*arguments, **options)
        self.examples = tuple(examples)
        self.wrong = wrong
        self.codes = dict(codes or {})
        help_ = "Print one JSON object with results, counts and seconds; also after an error."
        self.params.append(click.Option([JSON], is_flag=True, expose_value=False, help=help_))

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Note which command it is, before what stands after it can be wrong."""
        ctx.meta[_COMMAND] = ctx.command_path.partition(" ")[2]
        return super().parse_args(ctx, args)

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write what the command appends, then examples and exit codes."""
        super().format_epilog(ctx, formatter)
        write_lines(formatter, "Examples", self.examples)
        codes = {"0": DONE, "1": self.wrong, "2": AT_FAULT} | self.codes
        with formatter.section("Exit codes"):
            formatter.write_dl([(code, text) for code, text in codes.items() if text])


class CommandGroup(click.Group):
    """A group whose commands are commands."""

    command_class = Command


class DefaultGroup(CommandGroup):
    """A group with a command that may be left out: ``tunneldb findings SURVEY`` is ``tunneldb findings list SURVEY``."""

    default = "list"

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse arguments, after the name of the default command if they begin with no command."""
        if args and args[0] not in self.commands and args[0] not in ctx.help_option_names:
            args = [self.default, *args]
        return super().parse_args(ctx, args)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return a command; another word is an argument of the default one."""
        return super().get_command(ctx, cmd_name) or super().get_command(ctx, self.default)


def command(name: str | None = None, cls: type[Command] = Command, **options: Any) -> Callable[[Callable[..., Any]], Command]:
    """Return the decorator that makes a command of a function; options are those of `Command`."""
    return click.command(name, cls=cls, **options)


def write_lines(formatter: click.HelpFormatter, title: str, lines: Sequence[str]) -> None:
    """Write a section of lines that are not to be wrapped."""
    if lines:
        with formatter.section(title):
            for line in lines:
                formatter.write(f"{'':>{formatter.current_indent}}{line}\n")


def run_as_json(ctx: click.Context, run: Callable[[], Any], describe: Callable[[Exception], str | None]) -> int:
    """Run a command, print its JSON object, and return the exit code.

    Parameters
    ----------
    ctx
        Context of the whole program.
    run
        Runs the command.
    describe
        Returns the one line for an error that is not a bug. Bugs are raised on.
    """
    began, code, error = time.monotonic(), 0, None
    try:
        with _quiet():
            run()
    except (SystemExit, click.exceptions.Exit) as ended:
        code = exit_code(ended)
    except (KeyboardInterrupt, click.Abort):
        code, error = 1, "interrupted"
    except click.ClickException as wrong:
        wrong.show()
        code, error = wrong.exit_code, wrong.format_message()
    except Exception as wrong:
        error = describe(wrong)
        if error is None:
            raise
        click.echo(error_line(error), err=True)
        code = 2
    said = {"error": error} if error is not None else {}
    told = ctx.meta.get(_RESULT, {})
    name = ctx.meta.get(_COMMAND, ctx.invoked_subcommand)
    seconds = round(time.monotonic() - began, 3)
    result = {"command": name, "ok": code == 0, "exit_code": code, "seconds": seconds} | said | told
    click.echo(json.dumps(plain(result), ensure_ascii=False, indent=1, allow_nan=False))
    return code


@contextmanager
def _quiet() -> Iterator[None]:
    """Let nothing of this process, of libraries or of programs that it starts, come to standard output."""
    with Path(os.devnull).open("w", encoding="utf-8") as nowhere, redirect_stdout(nowhere):
        try:
            kept = os.dup(_STDOUT)
        except OSError:  # closed by who started it
            yield
            return
        try:
            os.dup2(nowhere.fileno(), _STDOUT)
            yield
        finally:
            os.dup2(kept, _STDOUT)
            os.close(kept)


def exit_code(ended: BaseException) -> int:
    """Return the exit code of a command that ended early."""
    code = ended.exit_code if isinstance(ended, click.exceptions.Exit) else getattr(ended, "code", 0)
    return code if isinstance(code, int) else int(code is not None)


def plain(value: Any) -> Any:
    """Return a value as JSON knows it: numbers that are none become null, arrays lists, all else that is no number text."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {plain(str(key)): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple, set, frozenset, range)):
        return [plain(item) for item in value]
    if hasattr(value, "__geo_interface__"):
        return plain(value.__geo_interface__)
    if hasattr(value, "tolist"):  # of NumPy, which help must not import
        return plain(value.tolist())
    if isinstance(value, str):  # names of files may hold what is not UTF-8
        return value.encode("utf-8", "replace").decode()
    if value is None or isinstance(value, (bool, int)):
        return value
    if hasattr(value, "as_integer_ratio"):  # float, Decimal
        number = float(value)
        return number if math.isfinite(number) else None
    if hasattr(value, "isoformat"):
        return value.isoformat()
    if hasattr(value, "total_seconds"):
        return value.total_seconds()
    return plain(str(value))
