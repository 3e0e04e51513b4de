"""Description of an algorithm."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Optional, Tuple


@dataclass(frozen=True)
class Parameter:
    """A parameter of an algorithm.

    Attributes
    ----------
    name : str
        Its id in Processing.
    title : str
        What the dialogue says.
    option : str
        Option of the command line; empty for what stands without one. Of a flag it may have a value: ``--axis auto``.
    kind : str
        survey, surveys (names with spaces between), text, texts (parts with ``;`` between, each an option of its own), numbers
        (several for one option), file, files, output, folder, choice, choices, integer, number or flag.
    help : str
        What it means.
    required : bool
    default : object
        Of the dialogue; None leaves it to the command.
    choices : tuple of str
    minimum, maximum : float, optional
    filter : str
        Endings of files, as QGIS writes them.
    advanced : bool
        Whether it is folded away at first.
    """

    name: str
    title: str
    option: str
    kind: str
    help: str = ""
    required: bool = False
    default: Any = None
    choices: Tuple[str, ...] = ()
    minimum: Optional[float] = None
    maximum: Optional[float] = None
    filter: str = ""
    advanced: bool = False


@dataclass(frozen=True)
class Command:
    """An algorithm.

    Attributes
    ----------
    name, title, group : str
        Its id, its name and where it stands in the toolbox.
    words : tuple of str
        Words that the command line begins with.
    help : str
        What it does.
    parameters : tuple of Parameter
    wrong : str
        What exit code 1 means.
    loads : bool
        Whether what it writes can be added to the project as layers.
    database : bool
        Whether it needs the database.
    """

    name: str
    title: str
    group: str
    words: Tuple[str, ...]
    help: str
    parameters: Tuple[Parameter, ...]
    wrong: str = ""
    loads: bool = False
    database: bool = True
