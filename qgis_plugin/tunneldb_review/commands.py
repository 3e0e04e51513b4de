"""Commands of ``tunneldb`` as algorithms: command line of a call, and meaning of its output lines.

Knows neither QGIS nor ``tunneldb``. Parameters are in ``catalogue.py``, which ``scripts/package_plugin.py`` generates from the
command line.
"""

from __future__ import annotations

import re
from typing import Any, List, Mapping, Optional

from .catalogue import COMMANDS
from .description import Command, Parameter

__all__ = ["COMMANDS", "Command", "Parameter", "arguments_of", "error_of", "help_of", "progress_of"]

_COUNT = re.compile(r"^\[(\d+)/(\d+)\]")
_FAULT = "tunneldb: "


def arguments_of(command: Command, values: Mapping[str, Any]) -> List[str]:
    """Return the command line after ``tunneldb`` and the database option.

    Parameters
    ----------
    command : Command
    values : mapping
        Values by the names of parameters; None or empty for what is not given.

    Raises
    ------
    ValueError
        What is needed is missing, in one line.
    """
    options: List[str] = []
    positional: List[str] = []
    for parameter in command.parameters:
        value = values.get(parameter.name)
        if parameter.kind == "flag":
            options += parameter.option.split() if value else []
            continue
        words = _words(parameter, value)
        if not words:
            if parameter.required:
                raise ValueError(f"{parameter.title}: a value is required")
            continue
        if not parameter.option:
            positional += words
        elif parameter.kind == "numbers":
            options += [parameter.option, *words]
        else:
            options += [word for value in words for word in (parameter.option, value)]
    # after -- a name that begins with a hyphen is none of an option
    return [*command.words, *options, *(["--", *positional] if positional else [])]


def progress_of(line: str) -> Optional[float]:
    """Return the share, 0 to 1, of a line like ``[2/5] axis km 12: …``, None of others."""
    found = _COUNT.match(line)
    if found is None or int(found[2]) == 0:
        return None
    return min(int(found[1]) / int(found[2]), 1.0)


def error_of(text: str) -> str:
    """Return the error line of ``tunneldb``, without its name; else the last line, or nothing.

    What click says of a command line ends in a line ``Error: …``.
    """
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    for line in reversed(lines):
        for mark in (_FAULT, "Error: "):
            if line.startswith(mark):
                return line[len(mark) :]
    return lines[-1] if lines else ""


def help_of(command: Command) -> str:
    """Return the help of an algorithm: its purpose, and the command that it calls."""
    said = f"<p>{command.help}</p><p>Calls <code>tunneldb {' '.join(command.words)}</code>.</p>"
    if command.wrong:
        said += f"<p>Exit code 1: {command.wrong}.</p>"
    return said


def _words(parameter: Parameter, value: Any) -> List[str]:
    """Return the words of a value."""
    if value is None:
        return []
    if parameter.kind in ("files", "choices"):
        return [str(item) for item in value]
    text = str(value).strip()
    if parameter.kind in ("surveys", "numbers"):
        return text.replace(",", " ").split()
    if parameter.kind == "texts":
        return [part.strip() for part in text.split(";") if part.strip()]
    if parameter.kind == "number":
        return [f"{float(value):.12g}"]
    return [text] if text else []
