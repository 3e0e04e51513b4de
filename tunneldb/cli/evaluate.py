"""The command ``evaluate``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command
from tunneldb.cli.param_types import FilePath, FiniteRange
from tunneldb.cli.progress import bar, step
from tunneldb.cli.tables import print_table
from tunneldb.database import connect
from tunneldb.errors import UserError
from tunneldb.store.survey import get_survey

if TYPE_CHECKING:
    import psycopg

    from tunneldb.evaluate.report import Report
    from tunneldb.progress import StartProgress
    from tunneldb.store.survey import Survey


MIN_LEAK, MIN_SPOT = 0.1, 0.01  # m²


@command(
    examples=[
        "tunneldb evaluate demo-2024 demo/demo.truth.gpkg",
        "tunneldb evaluate demo-2024 truth.geojson --km 12 -o figures.json",
        "tunneldb evaluate hall-2024 demo/hall.truth.json",
    ]
)
@click.argument("survey")
@click.argument("truth", type=FilePath(dir_okay=False))
@click.option("--layer", metavar="NAME", help="Layer of the file with the reference [the only one, or leak; for spots spot].")
@click.option("--km", metavar="A-B", help="Only these kilometres: 12 or 12-14.")
@click.option("--spots", is_flag=True, help="Compare spots of structures instead of leaks (default for a site).")
@click.option(
    "--min-area",
    type=FiniteRange(min=0),
    metavar="M2",
    help="Least area of a required reference leak, m² [0.1; for spots 0.01].",
)
@click.option("-o", "--output", type=FilePath(dir_okay=False), help="File to write: .json (all) or .csv (figures).")
@click.pass_obj
def evaluate(
    settings: Settings,
    survey: str,
    truth: Path,
    layer: str | None,
    km: str | None,
    spots: bool,
    min_area: float | None,
    output: Path | None,
) -> None:
    """Compare the leaks of SURVEY, or its spots, with reference ones of the file TRUTH.

    TRUTH is a GeoPackage or GeoJSON file with a polygon for each leak: in the unrolled plane (x chainage, y arc; no coordinate
    system), or 3D in the tunnel's; for each spot, 3D in the tunnel's, or the .truth.json of tunneldb simulate-structure. Those
    that an inspector rejected are left out. Nothing is changed.

    \b
    recall      of the leaks or spots: share with at least half of the area found; of the area: share that was found
    precision   of the leaks or spots: share with at least half of the area true; of the area: share that is true
    false       those that touch no true one
    area error  |found - true| / true area, median and 95 % quantile
    edge        distance between found and true outlines, median and 95 % quantile
    """  # noqa: D301 - \b is click's mark for lines to be kept
    from tunneldb.evaluate import report as reports
    from tunneldb.files import replacing

    form = output.suffix.lower() if output else ""
    if output and form not in (".json", ".csv"):
        raise UserError(f"{output}: the name must end in .json or .csv")
    with connect(settings.dsn) as conn, bar("leaks") as progress:
        conn.rollback()
        conn.read_only = True
        found = get_survey(conn, survey, site=True)
        begin = step(progress)
        if spots or found.site:
            if km is not None:
                raise UserError("--km is of leaks: spots of a structure are compared wherever they lie; omit it")
            smallest = MIN_SPOT if min_area is None else min_area
            report, about, said = _of_spots(conn, found, truth, layer, smallest, begin)
        else:
            smallest = MIN_LEAK if min_area is None else min_area
            report, about, said = _of_leaks(conn, found, truth, layer, km, smallest, begin)
    about = {"survey": survey, "truth": str(truth), **about, "min_area_m2": smallest}
    add_to_json(**reports.as_values(report, about), file=output)
    if output:
        with replacing(output) as temporary:
            text = reports.as_json(report, about) if form == ".json" else reports.as_csv(report)
            temporary.write_text(text, encoding="utf-8")
    header = report.subject.count_header
    print_table(header, reports.count_rows(report), right=range(1, len(header)))
    click.echo()
    print_table(reports.AREA_HEADER, reports.area_rows(report), right=range(1, len(reports.AREA_HEADER)))
    if rows := reports.list_rows(report):
        click.echo()
        print_table(report.subject.list_header, rows, right=range(1, len(report.subject.list_header)))
    click.echo(f"\n{reports.false_line(report)}")
    click.echo(f"counted are those of {smallest:g} m² and more (--min-area), by their areas as unrolled")
    for line in said:
        click.echo(line)


def _of_leaks(
    conn: psycopg.Connection[Any],
    survey: Survey,
    truth: Path,
    layer: str | None,
    km: str | None,
    min_area: float,
    begin: StartProgress,
) -> tuple[Report, dict[str, Any], list[str]]:
    """Report on leaks, what it is about, and what is to be said of it."""
    from tunneldb.evaluate.measure import compare
    from tunneldb.evaluate.report import make_report
    from tunneldb.evaluate.survey import read_findings, scanner_distance
    from tunneldb.evaluate.truth import read_truth

    begin(f"reading {truth.name}", None)
    true = read_truth(conn, survey, truth, layer)
    findings = read_findings(conn, survey, km)
    advance = begin(f"comparing with {truth.name}", len(true.shapes) + len(findings.shapes))
    comparison = compare(true.shapes, findings.shapes, min_area, findings.stretch, advance)
    outside = sum(not shape.intersects(findings.stretch) for shape in true.shapes)
    if outside == len(true.shapes):
        kilometres = ", ".join(map(str, findings.kilometres))
        raise UserError(f"{truth}: no leak lies where leaks were sought, kilometres {kilometres}; x must be the chainage, m")
    begin("distances from the scanner", None)
    distances = (
        scanner_distance(conn, survey, list(comparison.true_shape)),
        scanner_distance(conn, survey, list(comparison.found_shape)),
    )
    report = make_report(comparison, true.ids, [str(k) for k in findings.ids], distances, min_area, findings.seen)
    add_to_json(outside=outside)
    said = [f"{outside} true leaks lie where leaks were not searched for, and are left out"] if outside else []
    return report, {"kilometres": findings.kilometres}, said


def _of_spots(
    conn: psycopg.Connection[Any], survey: Survey, truth: Path, layer: str | None, min_area: float, begin: StartProgress
) -> tuple[Report, dict[str, Any], list[str]]:
    """Report on spots, what it is about, and what is to be said of it."""
    from tunneldb.evaluate.spots import evaluate_spots

    begin(f"comparing with {truth.name}", None)
    done = evaluate_spots(conn, survey, truth, layer, min_area)
    said = []
    if done.not_asked:
        said.append(f"{done.not_asked} true spots of too few points or too slanting are neither demanded nor do they harm")
    if done.true_area - done.on_faces > 5e-5:
        said.append(f"{done.true_area - done.on_faces:.4f} m² of {done.true_area:.4f} m² of true spots lie on no face found")
    if done.statement:
        said.append(f"survey {survey.name}: {done.statement}")
    about = {
        "not_asked": done.not_asked,
        "all_true_m2": round(done.true_area, 5),
        "true_on_faces_m2": round(done.on_faces, 5),
        "statement": done.statement,
    }
    return done.report, about, said
