"""The commands ``findings`` and ``findings import``."""

from __future__ import annotations

import datetime as dt
from collections.abc import Sequence
from pathlib import Path
from typing import cast, get_args

import click
import psycopg

from tunneldb.cli.coverage import say_coverage, say_remarks
from tunneldb.cli.findings_searched import searched
from tunneldb.cli.findings_trace import trace
from tunneldb.cli.leaks import parse_clock
from tunneldb.cli.main import Settings
from tunneldb.cli.output import DefaultGroup, add_to_json, notify, printable, records
from tunneldb.cli.param_types import FilePath, FiniteRange, WholeRange
from tunneldb.cli.past import as_of_option, connect_as_of
from tunneldb.cli.stretch import parse_stretch, stretch_options
from tunneldb.cli.tables import print_table, table_format
from tunneldb.counted import counted
from tunneldb.database import connect
from tunneldb.errors import UserError
from tunneldb.export.tables.finding_counts import count_findings, sum_groups
from tunneldb.export.tables.findings import FindingList, as_csv, as_geojson, write_gpkg
from tunneldb.export.tables.leaks import clock_label
from tunneldb.export.tables.workbooks import write_findings
from tunneldb.files import replacing
from tunneldb.finding_kind import DETECTED
from tunneldb.store.coverage import read_coverage
from tunneldb.store.drawn_findings import undo_finding
from tunneldb.store.dry_regions import read_dry_regions
from tunneldb.store.finding_kinds import read_kinds, read_severities, read_wet_kinds
from tunneldb.store.findings import COUNTED, Chosen, Finding, Geometry, State, read_findings
from tunneldb.store.listing import list_finding_counts, require_finding_kinds
from tunneldb.store.remarks import read_remarks
from tunneldb.store.survey import Survey, get_survey


@click.group(cls=DefaultGroup)
def findings() -> None:
    """List, export, import, trace or undo findings of all kinds, detected or drawn."""


findings.add_command(trace)
findings.add_command(searched)


@findings.command(
    "list",
    examples=[
        "tunneldb findings list ringo-2024",
        "tunneldb findings list ringo-2024 --kind crack --kind spall --min-severity 3 -o defects.gpkg",
        "tunneldb findings list ringo-2024 --origin drawn --from 511+700 --to 511+800 --format csv",
        "tunneldb findings list ringo-2024 -o findings.xlsx",
        "tunneldb findings list ringo-2024 --state all --count",
    ],
    wrong="done, but not all that was asked for has been searched for leaks, or nothing of it was seen: what, is said first",
)
@click.argument("survey")
@click.option("--kind", "kinds", multiple=True, metavar="KIND", help="Only this kind; may be repeated.")
@click.option(
    "--origin", "origins", multiple=True, type=click.Choice(["detected", "drawn", "redrawn", "split", "merged"]),
    help="Only this origin; may be repeated.",
)  # fmt: skip
@click.option(
    "--state", "states", multiple=True, type=click.Choice([*get_args(State), "all"]),
    help="Only this state, or all; may be repeated. Default: open and confirmed, which count.",
)  # fmt: skip
@click.option("--min-severity", type=WholeRange(1, 4), help="Least severity.")
@click.option("--min-area", type=FiniteRange(min=0), default=0.0, metavar="M2", help="Least area, m².")
@stretch_options
@click.option(
    "--clock", metavar="A-B", help="Only between these clock positions, clockwise; 12 is the crown: 10-2 or 10:30-1:30."
)
@click.option(
    "--geometry", type=click.Choice(["unrolled", "map", "3d"]), default="unrolled", show_default=True,
    help="Coordinates: chainage and arc; map strip beside the axis; on the lining in space.",
)  # fmt: skip
@click.option(
    "--format",
    "form",
    type=click.Choice(["table", "csv", "geojson", "gpkg", "xlsx"]),
    help="Default: by the ending of -o, otherwise a table.",
)
@click.option("-o", "--output", type=FilePath(dir_okay=False), help="File to write.")
@click.option("--scheme", metavar="NAME", help="Rating scheme, the version added last; with --elements, for a workbook.")
@click.option("--elements", "element_set", metavar="NAME", help="Division of the tunnel to rate (tunneldb elements).")
@click.option("--count", is_flag=True, help="Number of each kind and origin instead, by state.")
@as_of_option
@click.pass_context
def list_findings(
    context: click.Context,
    survey: str,
    kinds: tuple[str, ...],
    origins: tuple[str, ...],
    states: tuple[str, ...],
    min_severity: int | None,
    min_area: float,
    start: str | None,
    end: str | None,
    clock: str | None,
    geometry: str,
    form: str | None,
    output: Path | None,
    scheme: str | None,
    element_set: str | None,
    count: bool,
    moment: dt.datetime | None,
) -> None:
    """List the findings of SURVEY, detected and drawn, or write them to a file.

    Listed are findings that count: open and confirmed. --state selects others: rejected; gone (not found again by the
    last detection); dry (in a dry region); same (represented by another finding); merged into another.

    As for leaks, stretches where leaks could be missed, notes and limitations come first, in every file too.

    An Excel workbook has sheets of the listed findings, of counts, of findings that fit except for their state, and
    of dry regions; with --scheme and --elements also of the rated elements. --json has the counts too, of any state.

    The word list is optional: tunneldb findings SURVEY.
    """
    if count:
        _refuse_with_count(
            {
                "--state": bool(states) and "all" not in states,  # it has a column for each state
                "--min-severity": min_severity is not None,
                "--min-area": min_area > 0,
                "--from": start is not None,
                "--to": end is not None,
                "--clock": clock is not None,
                "--geometry": geometry != "unrolled",
                "--format": form not in (None, "table"),
                "-o": output is not None,
                "--scheme": scheme is not None,
            }
        )
    settings: Settings = context.obj
    form = table_format(form, output, "findings", ("csv", "geojson", "gpkg", "xlsx"))
    if (scheme is None) != (element_set is None) or (scheme is not None and form != "xlsx"):
        raise UserError("--scheme and --elements go together, and need a workbook: -o findings.xlsx")
    hours = parse_clock(clock) if clock else None
    with connect_as_of(settings.dsn, survey, moment) as conn:
        found = get_survey(conn, survey)
        require_finding_kinds(conn, kinds)
        stretch = parse_stretch(conn, found, start, end)
        coverage = read_coverage(conn, found, stretch.low, stretch.high)
        remarks = read_remarks(conn, found, stretch.low, stretch.high)
        say_remarks(remarks, found)
        searched = coverage.complete or not _is_detected(kinds, origins)
        if count:
            say_coverage(coverage, found, on_stdout=True)
            _print_counts(conn, found, kinds, origins)
            context.exit(0 if searched else 1)
        wanted = () if "all" in states else states or COUNTED
        chosen = Chosen(kinds, origins, (), stretch.low, stretch.high, hours, min_area, min_severity or 0)
        fitting = read_findings(conn, found, cast(Geometry, geometry), chosen)
        severities, regions = read_severities(conn), read_dry_regions(conn, found, stretch.low, stretch.high)
        counts, wet = count_findings(fitting, read_kinds(conn)), read_wet_kinds(conn)
        rated = []
        if scheme is not None and element_set is not None:
            from tunneldb.export.tables.rating import rating_sheets

            rated = rating_sheets(conn, found.name, element_set, scheme, None, stretch.low, stretch.high)
    rows = [row for row in fitting if not wanted or row.state in wanted]
    add_to_json(survey=survey, listed=len(rows), geometry=geometry, findings=rows, kinds=counts, dry_regions=regions)
    listed = FindingList(rows, coverage, remarks)
    say_coverage(coverage, found, on_stdout=output is None and form == "table")
    if output is None:
        _print(listed, form, cast(Geometry, geometry), found)
    else:
        with replacing(output) as temporary:
            if form == "gpkg":
                write_gpkg(temporary, listed, cast(Geometry, geometry), found.srid)
            elif form == "xlsx":
                others = [row for row in fitting if wanted and row.state not in wanted]
                write_findings(temporary, found.name, listed, others, sum_groups(counts, wet), severities, regions, rated)
            elif form == "geojson":
                temporary.write_text(as_geojson(listed, cast(Geometry, geometry), found.srid), encoding="utf-8")
            else:
                temporary.write_text(as_csv(listed), encoding="utf-8")
        add_to_json(file=output)
        unknown = not rows and not coverage.seen_area
        notify(f"{'findings were not searched for' if unknown else counted(len(rows), 'finding')}: {output}")
    if not searched:
        context.exit(1)


def _is_detected(kinds: Sequence[str], origins: Sequence[str]) -> bool:
    """Return True if detection finds some of the kinds and origins; others are drawn by people alone."""
    return (not kinds or not set(kinds).isdisjoint(DETECTED)) and tuple(set(origins)) != ("drawn",)


def _print(listed: FindingList, form: str, geometry: Geometry, survey: Survey) -> None:
    if form == "csv":
        click.echo(as_csv(listed), nl=False)
    elif form == "geojson":
        click.echo(as_geojson(listed, geometry, survey.srid), nl=False)
    elif listed.rows or listed.coverage.seen_area:
        header = [
            "id",
            "chainage",
            "arc m",
            "clock",
            "kind",
            "origin",
            "severity",
            "area m²",
            "length m",
            "width mm",
            "state",
            "by",
            "remark",
        ]
        cells = [
            [
                row.id, row.label, f"{row.arc_from:+.2f} to {row.arc_to:+.2f}", clock_label(row.clock), row.kind,
                row.origin + (", also detected" if row.also_detected else ""), row.severity, f"{row.area:.3f}",
                None if row.length is None else f"{row.length:.2f}",
                None if row.width_mm is None else f"{row.width_mm:g}", _state(row), row.drawn_by or row.reviewed_by,
                row.remark and " ".join(row.remark.split()),
            ]
            for row in listed.rows
        ]  # fmt: skip
        print_table(header, cells, right=(0, 1, 2, 3, 6, 7, 8, 9))


def _state(row: Finding) -> str:
    other = row.merged_into or row.same_as
    return row.state if other is None else f"{row.state} as {other}" if row.state == "same" else f"{row.state} into {other}"


def _refuse_with_count(given: dict[str, bool]) -> None:
    """Refuse options that the sums of the whole survey know nothing of, rather than pass them over."""
    if refused := [option for option, is_given in given.items() if is_given]:
        raise UserError(
            f"--count sums up a whole survey, by --kind and --origin at most: leave out {', '.join(refused)}; sums of what is"
            " chosen are in kinds of --json and in a workbook (-o FILE.xlsx)"
        )


def _print_counts(conn: psycopg.Connection, survey: Survey, kinds: Sequence[str], origins: Sequence[str]) -> None:
    names = [
        "kind",
        "origin",
        "counted",
        "open",
        "confirmed",
        "rejected",
        "merged",
        "same",
        "dry",
        "gone",
        "to_measure",
        "area",
    ]
    rows = list_finding_counts(conn, survey, kinds, origins)
    add_to_json(survey=survey.name, counts=records(names, rows))
    print_table([*names[:-2], "to measure", "area m²"], [[*row[:-1], f"{row[-1]:.3f}"] for row in rows], right=range(2, 12))


@findings.command(
    "import",
    examples=[
        "tunneldb findings import ringo-2024 defects.gpkg --map Riss=crack --map Abplatzung=spall --column kind=Art",
        "tunneldb findings import ringo-2024 drips.csv --column chainage=Station --column arc=Offset",
        "tunneldb findings import ringo-2024 cracks.dxf --kind crack --layer RISSE",
    ],
)
@click.argument("survey")
@click.argument("file", type=FilePath(dir_okay=False))
@click.option(
    "--map", "kinds", multiple=True, metavar="THEIRS=OURS", help="Kind in FILE and kind of tunneldb; may be repeated."
)
@click.option(
    "--column", "columns", multiple=True, metavar="OURS=THEIRS", help="Column of tunneldb and column in FILE; may be repeated."
)
@click.option("--layer", metavar="NAME", help="Layer of a GeoPackage; default: its only one. Layer of a DXF; default: all.")
@click.option("--kind", metavar="KIND", help="Kind of the rows without one, such as crack.")
@click.pass_obj
def import_(
    settings: Settings,
    survey: str,
    file: Path,
    kinds: tuple[str, ...],
    columns: tuple[str, ...],
    layer: str | None,
    kind: str | None,
) -> None:
    """Import findings of another system from FILE into SURVEY, all or none.

    FILE is CSV, GeoPackage or GeoJSON with a kind for each finding, and optionally severity (1 to 4), width_mm
    (millimetres), review, remark and photo (path or URL); or the lines of a DXF. Geometries of a layer without a
    coordinate system are in chainage and arc, m; in the tunnel's they must be 3D, on the lining. Lines of a DXF are
    in chainage and arc, or in the tunnel's system if they have heights. A CSV has places by wkt or geometry (WKT:
    chainage and arc, or 3D), by chainage_from, chainage_to, arc_from and arc_to, by chainage and arc, or by x, y and
    z; a chainage may be a station, as 12+345.678. Each wrong row is listed; then nothing is imported.
    """
    from tunneldb.pipeline.findings import import_findings

    theirs, ours = _pairs(kinds, "--map"), _pairs(columns, "--column")
    with connect(settings.dsn) as conn:
        done = import_findings(conn, get_survey(conn, survey), file, theirs, ours, layer, kind)
    for note in done.notes:
        notify(f"Note: {note}")
    for line in done.wrong:
        notify(printable(line))
    add_to_json(survey=survey, imported=len(done.ids), kinds=dict(done.kinds), ids=done.ids, wrong=done.wrong, notes=done.notes)
    if done.wrong:
        raise UserError(f"{file}: {counted(len(done.wrong), 'wrong row')}, so nothing was imported")
    said = ", ".join(f"{number} {kind}" for kind, number in sorted(done.kinds.items()))
    click.echo(f"{survey}: {counted(len(done.ids), 'finding')} imported" + (f": {said}" if said else ""))


@findings.command("undo", examples=["tunneldb findings undo 12"])
@click.argument("number", metavar="ID", type=WholeRange(1, 2**63 - 1))
@click.pass_obj
def undo(settings: Settings, number: int) -> None:
    """Undo the last change of the finding ID: drawn, redrawn, reviewed, split, merged or deleted.

    A second call undoes the change before. Only the author of a change, or an operator, can undo it, and not if a
    later change depends on it. Undo a split or merge on the finding that kept its number.
    """
    with connect(settings.dsn) as conn:
        undone = undo_finding(conn, number)
    add_to_json(finding=number, undone=undone)
    click.echo(f"finding {number}: change undone: {undone}")


def _pairs(given: tuple[str, ...], option: str) -> dict[str, str]:
    pairs = {}
    for text in given:
        left, equals, right = text.partition("=")
        if not (left and equals and right):
            raise UserError(f"{option} takes two names with = between them, not {text!r}")
        pairs[left] = right
    return pairs
