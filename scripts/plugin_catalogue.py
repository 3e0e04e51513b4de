"""The algorithms of the QGIS plugin, from the commands of tunneldb: parameters, help and bounds are those of `--help`."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from pprint import pformat
from typing import Any

import click

from tunneldb.cli.main import COMMANDS, main
from tunneldb.cli.output import JSON, Command

GROUPS = {
    "1 Begin": ("init", "check", "inspect", "tunnel add", "survey add"),
    "2 Stages": ("load", "run", "batch", "status", "members", "spheres"),
    "3 Leaks and findings": ("leaks", "findings list", "findings import", "findings trace", "findings searched",
                             "elements cracks", "spots", "learn", "evaluate"),
    "4 Shape and change": (
        "compare", "axis", "profile add", "deviation", "evenness", "thickness", "rings", "clearance", "intensity",
    ),
    "5 Hand over": ("qgis", "image write", "report", "export", "export --classified"),
}  # fmt: skip
"""Commands that are algorithms, by groups of the toolbox, in the order in which one uses them."""

WITHOUT_DATABASE = ("inspect",)
OMITTED = {JSON, "--format", "--watch", "--interval"}
"""Options of a terminal; an output's format follows from its ending."""

COMMON = {"--axis", "--stations", "--trajectory", "--from", "--to", "--km", "--kind", "--geometry", "--layer", "--min-area",
          "--min-confidence", "--clock", "--output", "--reference", "--intensity"}  # fmt: skip
"""Optional options that the dialogue shows at first; it folds the others away."""

FORMATS = {
    "gpkg": "GeoPackage", "geojson": "GeoJSON", "csv": "CSV", "xlsx": "Excel", "dxf": "DXF", "tif": "GeoTIFF", "laz": "LAZ",
    "png": "PNG", "pdf": "PDF", "svg": "SVG", "html": "HTML", "json": "JSON", "qgz": "QGIS project", "qgs": "QGIS project",
}  # fmt: skip
UNITS = {"M": "m", "M2": "m²", "KM/H": "km/h", "S": "s", "PERCENT": "%"}
_HEAD = '''"""The commands of tunneldb that are algorithms. Generated when the plugin is packed; do not edit."""

from .description import Command, Parameter

COMMANDS = (
'''


def catalogue() -> str:
    """Return the Python module with the description of all algorithms."""
    commands = [_command(name, group) for group, names in GROUPS.items() for name in names]
    return f"{_HEAD}{''.join(commands)})\n"


def _command(name: str, group: str) -> str:
    words = name.split()
    command: click.Command = main
    for word in (word for word in words if not word.startswith("-")):
        assert isinstance(command, click.Group)
        found = command.get_command(click.Context(command), word)
        assert found is not None, name
        command = found
    parameters = [item for item in _parameters(command) if _belongs(item, words)]
    if "--classified" in words:  # its output is a folder
        parameters = [item | {"kind": "folder", "filter": ""} if item["kind"] == "output" else item for item in parameters]
    parts = re.split(r"\n\s*\n", inspect.cleandoc(command.help or ""))
    paragraphs = [" ".join(part.split()) for part in parts if "\b" not in part]  # tables of a terminal have a backspace
    summary = COMMANDS[name][1] if name in COMMANDS else command.get_short_help_str(200)
    title = re.split(r"[:;,.]", summary)[0]
    described = {
        "name": re.sub(r"\W+", "_", name),
        "title": f"{title} ({words[-1].strip('-')})" if words[-1].startswith("-") else title,
        "group": group,
        "words": tuple(words),
        "help": "</p><p>".join(paragraphs),
        "wrong": command.wrong or "" if isinstance(command, Command) else "",
        "loads": any(ending in item.get("filter", "") for item in parameters for ending in ("gpkg", "geojson", "dxf")),
        "database": name not in WITHOUT_DATABASE,
    }
    calls = "".join(f"            {_call('Parameter', item)},\n" for item in parameters)
    return f"    {_call('Command', described)[:-1]}, parameters=(\n{calls}        ),\n    ),\n"


def _belongs(item: dict[str, Any], words: list[str]) -> bool:
    """Return whether a parameter belongs to the command with these fixed words; --classified divides export in two."""
    if words[0] != "export":
        return True
    if item["option"] == "--classified":
        return False
    return item["option"] in ("", "--output") or item["help"].startswith("With --classified:") == ("--classified" in words)


def _call(name: str, values: dict[str, Any]) -> str:
    return f"{name}({', '.join(f'{key}={pformat(value, width=100_000)}' for key, value in values.items())})"


def _parameters(command: click.Command) -> Iterator[dict[str, Any]]:
    outputs = next((p.type.choices for p in command.params if "--format" in p.opts and isinstance(p.type, click.Choice)), ())
    for parameter in command.params:
        if isinstance(parameter, click.Argument):
            yield from _argument(parameter)
        elif isinstance(parameter, click.Option) and not OMITTED & set(parameter.opts) and not parameter.hidden:
            yield from _option(parameter, tuple(map(str, outputs)))


def _argument(argument: click.Argument) -> Iterator[dict[str, Any]]:
    for word in (argument.metavar or (argument.name or "").upper()).split():
        name = word.strip("[].")
        kind = {"SURVEY": "survey", "FILE": "file", "TRUTH": "file"}.get(name.split("|")[0], "text")
        if argument.nargs == -1 and kind != "file":
            kind = {"survey": "surveys"}.get(kind, "files" if isinstance(argument.type, click.Path) else kind)
        name = "SURVEYS" if kind == "surveys" else name.split("|")[0]
        text = "Names with spaces between." if kind == "surveys" else ""
        yield _described(name, "", kind, text, argument.required and not word.startswith("["))


def _option(option: click.Option, outputs: tuple[str, ...]) -> Iterator[dict[str, Any]]:
    long = max(option.opts, key=len)
    name = long.strip("-").replace("-", "_").upper()
    kind, more = _kind(option, long, outputs)
    auto = "|auto" in (option.metavar or "")
    text = (option.help or "") + (" Several with ; between." if kind == "texts" else "")
    advanced = not option.required and long not in COMMON
    yield _described(name, long, kind, text, option.required, advanced=advanced, **more)
    if auto:
        yield _described(f"{name}_AUTO", f"{long} auto", "flag", f"Instead of a file: {long} auto.", False)


def _described(name: str, option: str, kind: str, text: str, required: bool, **more: Any) -> dict[str, Any]:
    title = option.strip("-").replace("-", " ").capitalize() or name.capitalize()
    if unit := UNITS.get(more.pop("metavar", "")):
        title += f", {unit}"
    return {"name": name, "title": title, "option": option, "kind": kind, "help": text, "required": required, **more}


def _kind(option: click.Option, long: str, outputs: tuple[str, ...]) -> tuple[str, dict[str, Any]]:
    """Return what kind of value an option takes, see `Parameter` of the plugin, and its bounds, choices or endings."""
    kind = option.type
    if option.is_flag:
        return "flag", {}
    if option.nargs > 1:
        return "numbers", {}
    if isinstance(kind, click.Choice):
        choices = tuple(map(str, kind.choices))
        if option.multiple:
            return "choices", {"choices": choices}
        return "choice", {"choices": choices, "default": option.default if option.default in choices else None}
    if isinstance(kind, click.Path):
        if not kind.file_okay or option.metavar == "FOLDER":
            return "text" if kind.file_okay else "folder", {}
        if long in ("--output", "--report", "--axis-out"):
            named = [ending for ending in re.findall(r"\.(\w+)", option.help or "") if ending in FORMATS]
            endings = dict.fromkeys(named or [ending for ending in outputs if ending in FORMATS])
            return "output", {"filter": ";;".join(f"{FORMATS[ending]} (*.{ending})" for ending in endings)}
        return ("files" if option.multiple else "file"), {}
    if option.multiple:
        return "texts", {}
    if isinstance(kind, (click.types.FloatParamType, click.types.IntParamType)):
        whole = isinstance(kind, click.types.IntParamType)
        bounds = {"minimum": getattr(kind, "min", None), "maximum": getattr(kind, "max", None)}
        return ("integer" if whole else "number"), {"metavar": option.metavar or "", **bounds}
    if (option.metavar or "").startswith(("FILE", "CSV")):
        return "file", {}
    return "text", {}
