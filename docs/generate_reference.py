"""Write the parts of the reference pages that the program itself states: commands, parameters, views and functions.

    python docs/generate_reference.py

writes one file a part into `build/reference`, from a database on a temporary server. `make docs` runs it, and `site_hooks.py`
puts each part where a page names it.
"""

from __future__ import annotations

import inspect
import re
import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import click
import psycopg
from site_hooks import REFERENCE
from view_topics import base_views, views_by_topic

from tunneldb.cli.main import COMMANDS, main
from tunneldb.cli.output import JSON, Command
from tunneldb.database import install, open_connection
from tunneldb.database.schema import sql_files
from tunneldb.database.server import Server
from tunneldb.stages.parameters import PARAMETERS
from tunneldb.stages.registry import REGISTRY, STAGES

Columns = dict[str, tuple[str, str]]
"""Columns of a view: type and meaning by name."""


def commands(_: psycopg.Connection[Any]) -> str:
    """Return the options of all commands, and each command with its help, options and examples."""
    parts = [_options(main)]
    for verb in COMMANDS:
        command = main.get_command(click.Context(main), verb)
        assert command is not None
        parts += _command(command, verb)
    return "\n\n".join(parts)


def _command(command: click.Command, name: str) -> Iterator[str]:
    arguments = " ".join(_argument(p) for p in command.params if isinstance(p, click.Argument))
    yield f"{'###' if ' ' in name else '##'} {name}"
    if isinstance(command, click.Group):
        yield _help(command)
        for part, child in command.commands.items():
            yield from _command(child, f"{name} {part}")
        return
    usage = [f"tunneldb {name}", "[OPTIONS]" if any(isinstance(p, click.Option) for p in command.params) else "", arguments]
    yield f"`{' '.join(filter(None, usage))}`"
    yield _help(command)
    if options := _options(command):
        yield options
    if isinstance(command, Command):
        if command.wrong:
            yield f"Exit code 1: {command.wrong}."
        if command.codes:
            yield "Exit codes: " + "; ".join(f"{code}: {text}" for code, text in command.codes.items()) + "."
        yield "\n".join(["```sh", *command.examples, "```"])


def _argument(argument: click.Argument) -> str:
    name = argument.metavar or (argument.name or "").upper()
    if argument.nargs == -1 and "..." not in name:
        name += "..."
    return name if argument.required else f"[{name}]"


def _help(command: click.Command) -> str:
    """Return the help's paragraphs; those that keep their lines, which begin with a backspace, as code."""
    paragraphs = []
    for paragraph in re.split(r"\n\s*\n", inspect.cleandoc(command.help or "")):
        if paragraph.startswith("\b"):
            paragraphs.append(f"```text\n{paragraph[1:].strip(chr(10))}\n```")
        else:
            paragraphs.append(" ".join(paragraph.split()))
    return "\n\n".join(paragraphs)


def _options(command: click.Command) -> str:
    rows = []
    for option in command.params:
        if isinstance(option, click.Option) and option.opts != [JSON]:
            names = ", ".join(f"`{name}{'' if option.is_flag else ' ' + _metavar(option)}`" for name in option.opts)
            text = option.help or ""
            if option.required:
                text += " Required."
            if option.show_default and option.default is not None:
                default = f"{option.default:g}" if isinstance(option.default, float) else option.default
                text += f" Default: {default}."
            rows.append((names, text))
    return _table(("option", "meaning"), rows) if rows else ""


def _metavar(option: click.Option) -> str:
    if option.metavar:
        return option.metavar
    if isinstance(option.type, click.Choice):
        return "|".join(map(str, option.type.choices))
    names = {"text": "TEXT", "integer": "N", "path": "PATH", "file": "FILE", "directory": "FOLDER"}
    return names.get(option.type.name, option.type.name.upper().replace(" RANGE", "").replace("INTEGER", "N"))


def parameters(_: psycopg.Connection[Any]) -> str:
    """Return the table of the parameters."""
    stage_of = {prefix: stage.name for stage in STAGES for prefix in stage.parameters}
    rows = [
        (
            f"`{name}`",
            stage_of[name.partition(".")[0]],
            f"{p.default:g} {p.unit}",
            f"{p.low:g} to {p.high:g}",
            p.text[0].upper() + p.text[1:] + ("; a whole number" if p.whole else ""),
        )
        for name, p in PARAMETERS.items()
    ]
    return _table(("parameter", "stage", "default", "bounds", "meaning"), rows)


def views(conn: psycopg.Connection[Any]) -> str:
    """Return the views by topic, and the columns of each. A sister view shows what differs from its base view only."""
    topics = [(title, "<br>".join(f"`{line}`" for line in lines)) for title, lines in views_by_topic(conn)]
    return "\n\n".join([_table(("topic", "views"), topics), *_views(conn)])


def _views(conn: psycopg.Connection[Any]) -> Iterator[str]:
    columns: dict[str, dict[str, tuple[str, str]]] = {}
    comments: dict[str, str] = {}
    for view, comment, column, kind, text in conn.execute(
        """
        SELECT c.relname, obj_description(c.oid, 'pg_class'), a.attname, format_type(a.atttypid, a.atttypmod),
               col_description(c.oid, a.attnum)
          FROM pg_class c JOIN pg_attribute a ON a.attrelid = c.oid AND a.attnum > 0
         WHERE c.relnamespace = 'tunnel_api'::regnamespace AND c.relkind = 'v' ORDER BY c.oid, a.attnum
        """
    ):
        comments[view] = comment
        columns.setdefault(view, {})[column] = (kind, text)
    for view, base in ((view, base_views(conn)[view]) for view in columns):
        yield f"### {view}"
        yield _sentence(comments[view])
        yield from _columns(columns[view], columns[base] if base != view else {}, base)


def _columns(own: Columns, base: Columns, name: str) -> Iterator[str]:
    """Yield the table of a view's columns; for a sister view only the columns that differ from its base view."""
    if len(base.items() & own.items()) * 2 > len(own):
        geometry = [f"`{column}` ({kind}): {text}" for column, (kind, text) in own.items() if kind.startswith("geometry")]
        dropped = [f"`{column}`" for column, (kind, _) in base.items() if column not in own and not kind.startswith("geometry")]
        without = f" without {', '.join(dropped)}" if dropped else ""
        yield f"Columns of [{name}](#{name}){without}; geometry: {', '.join(geometry) or 'none'}."
        own = {column: what for column, what in own.items() if base.get(column) != what and not what[0].startswith("geometry")}
    if own:
        yield _table(("column", "type", "meaning"), [(f"`{column}`", kind, text) for column, (kind, text) in own.items()])


def functions(conn: psycopg.Connection[Any]) -> str:
    """Return the functions by the file that they come from."""
    return "\n\n".join(_functions(conn))


def _functions(conn: psycopg.Connection[Any]) -> Iterator[str]:
    """Yield the paragraphs of the functions, in the common order of files and database."""
    made = [
        (path, name)
        for path in sql_files()
        for name in re.findall(
            r"^CREATE OR REPLACE (?:FUNCTION|PROCEDURE) tunnel_api\.(\w+)", path.read_text("utf-8"), re.MULTILINE
        )
    ]
    found = conn.execute(
        """
        SELECT p.proname, pg_get_function_arguments(p.oid), pg_get_function_result(p.oid), p.provolatile, p.prosecdef,
               obj_description(p.oid, 'pg_proc')
          FROM pg_proc p WHERE p.pronamespace = 'tunnel_api'::regnamespace ORDER BY p.oid
        """
    ).fetchall()
    if [name for _, name in made] != [row[0] for row in found]:
        raise ValueError("the functions in the database are not those of the files")
    before = None
    for (path, name), (_, arguments, result, volatility, definer, comment) in zip(made, found, strict=True):
        if result == "trigger":
            continue
        if path != before:
            yield f"### {_first_sentence(path)}"
            before = path
        called = f"{name}({arguments})\n    → {result}" if result else f"CALL {name}({arguments})"
        text = called.replace(" DEFAULT ", " = ").replace("double precision", "float8")
        yield f"```text\n{text}\n```"
        notes = ["Changes data."] * (volatility == "v") + ["Runs with its owner's rights."] * definer
        yield " ".join([_sentence(comment), *notes])


def _first_sentence(path: Path) -> str:
    line = path.read_text("utf-8").splitlines()[0].removeprefix("-- ")
    return re.split(r"\.\s+(?=[A-Z])", line)[0].rstrip(".:")


def _sentence(text: str) -> str:
    return text if text.endswith(".") else f"{text}."


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [header, tuple("---" for _ in header), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|").strip() for cell in line) + " |" for line in lines)


PARTS: dict[str, Callable[[psycopg.Connection[Any]], str]] = {
    "commands": commands,
    "parameters": parameters,
    "views": views,
    "functions": functions,
}


def generate(folder: Path) -> None:
    """Write all parts into a folder, from a fresh database on a temporary server."""
    home = Path(tempfile.mkdtemp(prefix="tunneldb-reference-"))
    server = Server(home, {"fsync": "off", "shared_buffers": "32MB"})
    folder.mkdir(parents=True, exist_ok=True)
    try:
        with open_connection(server.start()) as conn:
            install(conn, REGISTRY)
            for part, write in PARTS.items():
                (folder / f"{part}.md").write_text(write(conn) + "\n", encoding="utf-8")
    finally:
        server.stop()
        shutil.rmtree(home)


if __name__ == "__main__":
    generate(REFERENCE)
