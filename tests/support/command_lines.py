"""Compare command lines that texts name with the commands and options of the program."""

from __future__ import annotations

import click

from tunneldb.cli.main import main
from tunneldb.stages.parameters import PARAMETERS

PLACEHOLDERS = ("COMMAND", "…", "...", "[OPTIONS]", "[--dsn", "DSN]", "--help", "-h")


def mistake(words: list[str]) -> str | None:
    """Return what the program would not understand of a command line after ``tunneldb``; None if it is right."""
    command: click.Command = main
    words = list(words)
    while words:
        word = words.pop(0)
        if word in ("|", ">", "&&", ";"):
            return None
        if word in PLACEHOLDERS:
            continue
        if word.startswith("-"):
            option = next((p for p in command.params if isinstance(p, click.Option) and word in p.opts), None)
            if option is None:
                return f"{command.name} has no option {word}"
            if word == "--set" and words[0] != "NAME=VALUE" and words[0].partition("=")[0] not in PARAMETERS:
                return f"there is no parameter {words[0]}"
            words = words if option.is_flag else words[option.nargs :]
        elif isinstance(command, click.Group):
            found = command.get_command(click.Context(command), word)
            if found is None:
                return f"there is no command {word}"
            if found.name == "psql":
                return None  # the rest is psql's own
            command = found
    return None


def all_options(command: click.Command = main) -> set[str]:
    """Return the options of a command and its subcommands."""
    options = {name for p in command.params if isinstance(p, click.Option) for name in (*p.opts, *p.secondary_opts)}
    if isinstance(command, click.Group):
        context = click.Context(command)
        for name in command.list_commands(context):
            child = command.get_command(context, name)
            assert child is not None
            options |= all_options(child)
    return options | {"--help"}
