"""The command ``rating``: rating schemes of owners, and ratings by them."""

from __future__ import annotations

import datetime as dt
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.measure import number, output_option, require_ending, say_written, write_rows
from tunneldb.cli.output import CommandGroup, add_to_json, notify
from tunneldb.cli.param_types import FilePath
from tunneldb.cli.past import as_of_option, connect_as_of
from tunneldb.cli.tables import print_table
from tunneldb.counted import counted
from tunneldb.database import connect
from tunneldb.errors import UserError
from tunneldb.files import replacing

COLUMNS = (
    "number", "name", "chainage_from", "chainage_to", "clock_from", "clock_to", "inspected_share", "findings", "result",
    "complete", "rule", "measure", "value", "limit_reached", "finding_id", "why", "remark",
)  # fmt: skip
"""Columns of a rating as CSV."""

COMPARISON_COLUMNS = (
    "number", "name", "result", "complete", "other_result", "other_complete", "difference", "why", "other_why",
)  # fmt: skip
"""Columns of a comparison of two schemes as CSV."""

CHANGE_COLUMNS = (
    "number", "name", "earlier_survey", "earlier_date", "earlier_result", "result", "change", "known", "earlier_why", "why",
)  # fmt: skip
"""Columns of a change since the earlier inspection as CSV."""


@click.group(cls=CommandGroup)
def rating() -> None:
    """Add, list, show or remove rating schemes, and rate the elements of a survey."""


@rating.command(examples=["tunneldb rating add owner-scheme.toml", "tunneldb rating add --shipped gb-50108-2008"])
@click.argument("file", type=FilePath(dir_okay=False), required=False)
@click.option(
    "--shipped", metavar="NAME", help="Scheme that is part of tunneldb, instead of FILE (tunneldb rating list --shipped)."
)
@click.pass_obj
def add(settings: Settings, file: Path | None, shipped: str | None) -> None:
    """Add the rating scheme of FILE, or one that is part of tunneldb.

    FILE is TOML: name, version, source, results (from the best to the worst), and a [[rule]] for each rule: text,
    measure, kinds, and limits as above = {RESULT = LIMIT} or from = {…}. Measures: area (m²), share (of the inspected
    lining), largest_area (m²), length (m), density_length (m per m² of inspected lining), width_mm, severity, count,
    growth (m² per year since the earlier inspection). A rule can be a matrix of two measures, and the rules' points can
    be summed. A version is never changed.
    """
    from tunneldb.pipeline.rating_file import read_scheme, shipped_scheme
    from tunneldb.store.rating import save_scheme

    if file is None and shipped is not None:
        file = shipped_scheme(shipped)
    elif file is None or shipped is not None:
        raise UserError("give exactly one of FILE and --shipped NAME")
    scheme = read_scheme(file)
    with connect(settings.dsn) as conn:
        save_scheme(conn, scheme)
    add_to_json(name=scheme.name, version=scheme.version, rules=len(scheme.rules))
    notify(f"{scheme.name} {scheme.version}: {counted(len(scheme.rules), 'rule')}, results {', '.join(scheme.results)}")


@rating.command("list", examples=["tunneldb rating list", "tunneldb rating list --shipped"])
@click.option("--shipped", is_flag=True, help="List the schemes that are part of tunneldb, not those of the database.")
@click.pass_obj
def list_(settings: Settings, shipped: bool) -> None:
    """List the rating schemes, the one added last first."""
    from tunneldb.pipeline.rating_file import list_shipped
    from tunneldb.store.rating import list_schemes

    if shipped:
        schemes = list_shipped()
        add_to_json(schemes=schemes)
        print_table(
            ["scheme", "version", "results", "source"],
            [(one["name"], one["version"], ", ".join(one["results"]), one["source"]) for one in schemes],
        )
        return
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
        [(rule["number"], rule["text"], *_columns(rule)) for rule in rules],
        right=(0,),
    )
    if found["totals"]:
        totals = zip(found["totals"], found["total_results"], strict=True)
        notify(f"sum of points: {_limits(found['totals_inclusive'], totals)}")


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
@as_of_option
@click.pass_obj
def apply(
    settings: Settings,
    survey: str,
    element_set: str,
    scheme: str,
    version: str | None,
    output: Path | None,
    moment: dt.datetime | None,
) -> None:
    """Rate the elements of SURVEY.

    The worst result of all rules is that of the element. If less than the scheme's minimum was inspected, the result
    is a lower bound, marked "at least". An element that was not inspected and has no findings has no result.
    """
    from tunneldb.export.tables.rating import write_rating
    from tunneldb.store.rating import rate, scheme_rules
    from tunneldb.store.survey import get_survey

    require_ending(output, "the rating", (".csv", ".xlsx"))
    with connect_as_of(settings.dsn, survey, moment) as conn:
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
        reason = f"less than {100 * found['min_inspected']:g} % was inspected"
        if any("growth unknown" in (row["remark"] or "") for row in rows):
            reason += ", now or in the earlier inspection (remark)"
        notify(f"a lower bound, because {reason}: {counted(partial, 'element')}")
    say_written(files)


@rating.command(
    examples=["tunneldb rating compare ringo-2024 --elements rings --scheme Landesbahn --scheme SNTI -o schemes.csv"]
)
@click.argument("survey")
@click.option("--elements", "element_set", required=True, metavar="NAME", help="Division of the tunnel (tunneldb elements).")
@click.option(
    "--scheme", "schemes", required=True, multiple=True, metavar="NAME[:VERSION]",
    help="Two schemes, or two versions of one. [default version: the one added last]",
)  # fmt: skip
@output_option("File to write: .csv.")
@click.pass_obj
def compare(settings: Settings, survey: str, element_set: str, schemes: tuple[str, ...], output: Path | None) -> None:
    """Rate the elements of SURVEY by two schemes, and show where and why these differ.

    The table has the elements with the greatest difference first: the place of a result in its scheme, from 0 (best) to
    1 (worst).
    """
    from tunneldb.store.rating import compare_schemes, scheme_rules
    from tunneldb.store.survey import get_survey

    require_ending(output, "the comparison", (".csv",))
    if len(schemes) != 2:
        raise UserError(f"--scheme is given {counted(len(schemes), 'time')}; two schemes are compared")
    with connect(settings.dsn) as conn:
        get_survey(conn, survey)
        found = [scheme_rules(conn, *_named(scheme))[0] for scheme in schemes]
        rows = compare_schemes(conn, survey, element_set, *((one["name"], one["version"]) for one in found))
    names = [f"{one['name']} {one['version']}" for one in found]
    add_to_json(survey=survey, elements=element_set, schemes=names, ratings=rows)
    files = [] if output is None else write_rows(output, COMPARISON_COLUMNS, rows)
    differing = [row for row in rows if row["difference"]]
    print_table(
        ["element", *names, "difference", "why", "why by the other"],
        [
            (
                row["name"], result_text(row), result_text({"result": row["other_result"], "complete": row["other_complete"]}),
                number(row["difference"], 2), row["why"] or "", row["other_why"] or "",
            )
            for row in sorted(differing, key=lambda row: -abs(row["difference"]))
        ],
        right=(3,),
    )  # fmt: skip
    unknown = sum(row["difference"] is None for row in rows)
    notify(
        f"{counted(len(differing), 'element')} of {len(rows)} rated differently" + (f", {unknown} not rated" if unknown else "")
    )
    say_written(files)


@rating.command(examples=["tunneldb rating change ringo-2025 --elements rings --scheme Landesbahn -o change.csv"])
@click.argument("survey")
@click.option("--elements", "element_set", required=True, metavar="NAME", help="Division of the tunnel (tunneldb elements).")
@click.option("--scheme", required=True, metavar="NAME", help="Rating scheme.")
@click.option("--version", metavar="VERSION", help="Version of the scheme. [default: the one added last]")
@output_option("File to write: .csv.")
@click.pass_obj
def change(settings: Settings, survey: str, element_set: str, scheme: str, version: str | None, output: Path | None) -> None:
    """Rate the elements of SURVEY and of the last earlier inspection of the tunnel by the same scheme.

    The table has the elements that changed, the worse ones first. A change between lower bounds is marked as uncertain.
    """
    from tunneldb.store.rating import rating_change, scheme_rules
    from tunneldb.store.survey import get_survey

    require_ending(output, "the change", (".csv",))
    with connect(settings.dsn) as conn:
        get_survey(conn, survey)
        found, _ = scheme_rules(conn, scheme, version)
        rows = rating_change(conn, survey, element_set, found["name"], found["version"])
    earlier = rows[0]["earlier_survey"] if rows else None
    if earlier is None:
        raise UserError(f"survey {survey} has no earlier inspection: no older survey of the tunnel with stage detect")
    add_to_json(
        survey=survey, elements=element_set, scheme=found["name"], version=found["version"], earlier=earlier, changes=rows
    )
    files = [] if output is None else write_rows(output, CHANGE_COLUMNS, rows)
    changed = sorted((row for row in rows if row["change"]), key=lambda row: -row["change"])
    print_table(
        ["element", earlier, survey, "change", "why"],
        [
            (
                row["name"], row["earlier_result"], row["result"],
                f"{row['change']:+d}" if row["known"] else f"{row['change']:+d}, uncertain", row["why"] or "",
            )
            for row in changed
        ],
        right=(3,),
    )  # fmt: skip
    worse, unknown = sum(row["change"] > 0 for row in changed), sum(row["change"] is None for row in rows)
    parts = [f"{counted(worse, 'element')} worse", f"{len(changed) - worse} better", f"{unknown} not rated in both"]
    notify(f"since {earlier} ({rows[0]['earlier_date']}): {', '.join(parts)}")
    say_written(files)


def result_text(row: dict[str, Any]) -> str:
    """Return a result, marked if it is a lower bound."""
    if row["result"] is None:
        return "not rated"
    return str(row["result"]) if row["complete"] else f"at least {row['result']}"


def _named(scheme: str) -> tuple[str, str | None]:
    name, _, version = scheme.partition(":")
    return name, version or None


def _columns(rule: dict[str, Any]) -> tuple[str, str, str]:
    """Return kinds, measure and limits of a rule as text."""
    kinds = ", ".join(rule["kinds"]) or "all wet"
    if rule["by_measure"] is None:
        gives = rule["results"] if rule["points"] is None else [f"{points:g} points" for points in rule["points"]]
        return kinds, rule["measure"], _limits(rule["inclusive"], zip(rule["limits"], gives, strict=True))
    width = len(rule["by_limits"]) + 1
    rows = [rule["results"][n : n + width] for n in range(0, len(rule["results"]), width)]
    axes = [
        f"{measure} {'≥' if inclusive else '>'} {', '.join(f'{limit:g}' for limit in limits)}"
        for measure, inclusive, limits in (
            (rule["measure"], rule["inclusive"], rule["limits"]),
            (rule["by_measure"], rule["by_inclusive"], rule["by_limits"]),
        )
    ]
    return (
        f"{kinds} × {', '.join(rule['by_kinds']) or 'all wet'}",
        f"{rule['measure']} × {rule['by_measure']}",
        f"{' × '.join(axes)}: {' | '.join(' '.join(row) for row in rows)}",
    )


def _limits(inclusive: bool, limits: Iterable[tuple[float, str]]) -> str:
    return "; ".join(f"{'≥' if inclusive else '>'} {limit:g}: {result}" for limit, result in limits)
