"""Write the reference pages from the program itself: its commands, its parameters, and the comments in its database.

    python docs/generate_reference.py

makes a scratch database on the server of TUNNELDB_DSN, or on the embedded one, and drops it again.
"""

from __future__ import annotations

import inspect
import os
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import click
import psycopg
from psycopg import sql
from psycopg.conninfo import make_conninfo
from view_diagram import view_diagram

from tunneldb.cli.main import COMMANDS, main
from tunneldb.cli.output import JSON, Verb
from tunneldb.database import install, open_connection, resolve_dsn
from tunneldb.database.schema import sql_files
from tunneldb.stages.parameters import PARAMETERS
from tunneldb.stages.registry import STAGES

FOLDER = Path(__file__).parent
NOTE = "<!-- Written by generate_reference.py; edit what it reads, not this page. -->"


def commands() -> str:
    """Return the page of the command line."""
    parts = [
        "# The command line",
        NOTE,
        "`tunneldb [--dsn DSN] VERB …`. Without `--dsn` or `TUNNELDB_DSN` the embedded server is used. Results go to standard "
        "output, messages and progress to standard error. Every verb but `psql` takes `--json`: "
        "[one JSON object](howto-operate.md#for-programs-json) on standard output. Exit codes: 0 done; 1, where a verb states "
        "it; 2 the input, the server or the command line is at fault, said in one line `tunneldb: …`.",
        _options(main),
    ]
    for verb in COMMANDS:
        command = main.get_command(click.Context(main), verb)
        assert command is not None
        parts += _command(command, verb)
    return _page(parts)


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
    if isinstance(command, Verb):
        if command.wrong:
            yield f"Exit code 1: {command.wrong}."
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


def parameters() -> str:
    """Return the page of the parameters."""
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
    load = main.get_command(click.Context(main), "load")
    assert load is not None
    return _page(
        [
            "# Parameters",
            NOTE,
            "Set by `tunneldb run SURVEY --set NAME=VALUE`, as often as needed, for that run. Every run records the values "
            "that its stage depends on (`tunnel_api.run`, column `parameters`). A value out of its bounds is refused.",
            _table(("parameter", "stage", "default", "bounds", "meaning"), rows),
            "Loading has options of its own:",
            _options(load),
            "A survey has one density: files loaded later must be loaded with the same one.",
        ]
    )


def database(conn: psycopg.Connection[Any]) -> str:
    """Return the page of schema tunnel_api, from the comments in an installed database."""
    parts = [
        "# Views and functions",
        NOTE,
        "Schema `tunnel_api`. What only its views and functions, triggers and the program call is in schema `tunnel_internal`. "
        "Lengths are metres, chainage is in plan along the axis, arc is from the crown and positive to "
        "the right looking up-chainage, offset is positive into the tunnel. Angles of sections are degrees from the upward "
        "direction, positive to the right. Geometry is in the tunnel's SRID, or in the unrolled plane (chainage, arc), SRID 0.",
        "## Views",
        "Members of `tunnel_viewer` may read all of them. `axis_vertex` (its geometry), the views of leaks "
        "(`review`, `remark` and `kind`), those of spots (`review` and `remark`), `region`, `finding_unrolled`, `finding_map`, "
        "`finding_3d` and `finding_photo` may be changed by members of `tunnel_inspector`; findings are drawn also through the "
        "unrolled and map views of leaks. They may call `finding_split`, `finding_merge` and `finding_undo`, "
        "too.",
    ]
    parts += [
        "By topic; what is after an arrow is the view that a key of the first leads to. Endings after a comma are views of the "
        "same rows with one geometry: in the unrolled plane, on the map, in space, in the plane of a face, on a sheet. Nearly "
        "all have `survey_id` and `survey`, the name, and lead to `survey`, and that to `tunnel`.",
        f"```mermaid\n{view_diagram(conn)}```",
    ]
    parts += _views(conn)
    parts += [
        "## Functions",
        "Those that only read may be called by members of `tunnel_viewer`; those that change data (marked) by members of "
        "`tunnel_operator`. A function that reads tables of schema `tunnel` and doesn't run with its owner's rights needs "
        "`tunnel_operator` too.",
    ]
    parts += _functions(conn)
    return _page(parts)


def _views(conn: psycopg.Connection[Any]) -> Iterator[str]:
    rows = conn.execute(
        """
        SELECT c.relname, obj_description(c.oid, 'pg_class'), a.attname, format_type(a.atttypid, a.atttypmod),
               col_description(c.oid, a.attnum)
          FROM pg_class c JOIN pg_attribute a ON a.attrelid = c.oid AND a.attnum > 0
         WHERE c.relnamespace = 'tunnel_api'::regnamespace AND c.relkind = 'v' ORDER BY c.oid, a.attnum
        """
    ).fetchall()
    for view in dict.fromkeys(row[0] for row in rows):
        columns = [row for row in rows if row[0] == view]
        yield f"### {view}"
        yield _sentence(columns[0][1])
        yield _table(("column", "type", "meaning"), [(f"`{column}`", kind, text) for _, _, column, kind, text in columns])


def _functions(conn: psycopg.Connection[Any]) -> Iterator[str]:
    """Functions by the file that they come from: both were made in the same order."""
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


def _page(parts: list[str]) -> str:
    return "\n\n".join(parts) + "\n"


PAGES: dict[str, Callable[..., str]] = {
    "reference-cli.md": lambda conn: commands(),
    "reference-parameters.md": lambda conn: parameters(),
    "reference-sql.md": database,
}


def generate() -> None:
    """Write all pages."""
    server = resolve_dsn(os.environ.get("TUNNELDB_DSN"))
    name = sql.Identifier(f"tunneldb_reference_{os.getpid()}")
    with psycopg.connect(server, autocommit=True) as admin:
        admin.execute(sql.SQL("CREATE DATABASE {}").format(name))
        try:
            with open_connection(make_conninfo(server, dbname=f"tunneldb_reference_{os.getpid()}")) as conn:
                install(conn, STAGES)
                for page, write in PAGES.items():
                    (FOLDER / page).write_text(write(conn), encoding="utf-8")
        finally:
            admin.execute(sql.SQL("DROP DATABASE {} WITH (FORCE)").format(name))


if __name__ == "__main__":
    generate()
