"""The command ``rating``: rating schemes of owners, and ratings by them."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.measure import number, output_option, require_ending, say_written, write_rows
from tunneldb.cli.output import CommandGroup, add_to_json, notify
from tunneldb.cli.param_types import FilePath
from tunneldb.cli.tables import print_table
from tunneldb.counted import counted
from tunneldb.database import connect
from tunneldb.files import replacing

COLUMNS = (
    "number", "name", "chainage_from", "chainage_to", "clock_from", "clock_to", "inspected_share", "findings", "result",
    "complete", "rule", "measure", "value", "limit_reached", "finding_id", "why",
)  # fmt: skip
"""Columns of the CSV."""


@click.group(cls=CommandGroup)
def rating() -> None:
    """Add, list, show or remove rating schemes, and rate the elements of a survey."""


@rating.command(examples=["tunneldb rating add owner-scheme.toml"])
@click.argument("file", type=FilePath(dir_okay=False))
@click.pass_obj
def add(settings: Settings, file: Path) -> None:
    """Add the rating scheme of FILE.

    FILE is TOML: name, version, source, results (from the best to the worst), and a [[rule]] for each rule: text,
    measure, kinds, and limits as above = {RESULT = LIMIT} or from = {…}. Measures: area (m²), share (of the inspected
    lining), largest_area (m²), length (m), width_mm, severity, count. A version is never changed.
    """
    from tunneldb.pipeline.rating_file import read_scheme
    from tunneldb.store.rating import save_scheme

    scheme = read_scheme(file)
    with connect(settings.dsn) as conn:
        save_scheme(conn, scheme)
    add_to_json(name=scheme.name, version=scheme.version, rules=len(scheme.rules))
    notify(f"{scheme.name} {scheme.version}: {counted(len(scheme.rules), 'rule')}, results {', '.join(scheme.results)}")


@rating.command("list", examples=["tunneldb rating list"])
@click.pass_obj
def list_(settings: Settings) -> None:
    """List the rating schemes, the one added last first."""
    from tunneldb.store.rating import list_schemes

    with connect(settings.dsn) as conn:
        rows = list_schemes(conn)
    add_to_json(schemes=rows)
    print_table(
        ["scheme", "version", "valid from", "rules", "results", "source"],
        [
            (row["name"], row["version"], row["valid_from"] or "", row["rules"], ", ".join(row["results"]), row["source"])
            for row in rows
        ],
        right=(3,),
    )


@rating.command(examples=["tunneldb rating show Landesbahn", "tunneldb rating show Landesbahn 2026"])
@click.argument("scheme")
@click.argument("version", required=False)
@click.pass_obj
def show(settings: Settings, scheme: str, version: str | None) -> None:
    """Show the rules of SCHEME, by default of the version added last."""
    from tunneldb.store.rating import scheme_rules

    with connect(settings.dsn) as conn:
        found, rules = scheme_rules(conn, scheme, version)
    add_to_json(**found | {"rules": rules})
    notify(f"{found['name']} {found['version']}: {found['source']}")
    print_table(
        ["rule", "text", "kinds", "measure", "limits"],
        [
            (
                rule["number"], rule["text"], ", ".join(rule["kinds"]) or "all wet", rule["measure"],
                "; ".join(f"{'≥' if rule['inclusive'] else '>'} {limit:g}: {result}" for limit, result in _limits(rule)),
            )
            for rule in rules
        ],
        right=(0,),
    )  # fmt: skip


@rating.command(examples=["tunneldb rating remove Landesbahn 2026"])
@click.argument("scheme")
@click.argument("version")
@click.pass_obj
def remove(settings: Settings, scheme: str, version: str) -> None:
    """Remove VERSION of SCHEME."""
    from tunneldb.store.rating import remove_scheme

    with connect(settings.dsn) as conn:
        remove_scheme(conn, scheme, version)
    add_to_json(scheme=scheme, version=version)


@rating.command(
    examples=[
        "tunneldb rating apply ringo-2024 --elements rings --scheme Landesbahn",
        "tunneldb rating apply ringo-2024 --elements rings --scheme Landesbahn --version 2026 -o rating.csv",
    ]
)
@click.argument("survey")
@click.option("--elements", "element_set", required=True, metavar="NAME", help="Division of the tunnel (tunneldb elements).")
@click.option("--scheme", required=True, metavar="NAME", help="Rating scheme.")
@click.option("--version", metavar="VERSION", help="Version of the scheme. [default: the one added last]")
@output_option("File to write: .csv or .xlsx.")
@click.pass_obj
def apply(settings: Settings, survey: str, element_set: str, scheme: str, version: str | None, output: Path | None) -> None:
    """Rate the elements of SURVEY.

    The worst result of all rules is that of the element. If less than the scheme's minimum was inspected, the result
    is a lower bound, marked "at least". An element that was not inspected and has no findings has no result.
    """
    from tunneldb.export.tables.rating import write_rating
    from tunneldb.store.rating import rate, scheme_rules
    from tunneldb.store.survey import get_survey

    require_ending(output, "the rating", (".csv", ".xlsx"))
    with connect(settings.dsn) as conn:
        get_survey(conn, survey)
        found, _ = scheme_rules(conn, scheme, version)
        rows = rate(conn, survey, element_set, found["name"], found["version"])
        if output is not None and output.suffix.lower() == ".xlsx":
            with replacing(output) as temporary:
                write_rating(temporary, conn, survey, element_set, found["name"], found["version"])
    add_to_json(survey=survey, elements=element_set, scheme=found["name"], version=found["version"], ratings=rows)
    files = [] if output is None else [output] if output.suffix.lower() == ".xlsx" else write_rows(output, COLUMNS, rows)
    print_table(
        ["element", "inspected %", "findings", "result", "finding", "why"],
        [
            (row["name"], number(row["inspected_share"], 0, 100.0), row["findings"], result_text(row), row["finding_id"] or "",
             row["why"] or "")
            for row in rows
        ],
        right=(1, 2, 4),
    )  # fmt: skip
    totals = Counter(row["result"] for row in rows)
    parts = [f"{counted(totals[result], 'element')} {result}" for result in found["results"] if totals[result]]
    notify(f"{found['name']} {found['version']}: {', '.join(parts) or 'no element rated'}")
    unrated, partial = totals[None], sum(not row["complete"] and row["result"] is not None for row in rows)
    if unrated:
        notify(f"not rated, because nothing was inspected: {counted(unrated, 'element')}")
    if partial:
        share = f"{100 * found['min_inspected']:g} %"
        notify(f"a lower bound, because less than {share} was inspected: {counted(partial, 'element')}")
    say_written(files)


def result_text(row: dict[str, Any]) -> str:
    """Return a result, marked if it is a lower bound."""
    if row["result"] is None:
        return "not rated"
    return str(row["result"]) if row["complete"] else f"at least {row['result']}"


def _limits(rule: dict[str, Any]) -> list[tuple[float, str]]:
    return list(zip(rule["limits"], rule["results"], strict=True))
